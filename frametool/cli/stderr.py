"""Talk beside the data: lines on stderr, which nobody has to read."""

from __future__ import annotations

import os
import sys


def tell(text: str) -> None:
    """Say something on stderr; that it is closed or on a full disk does not change what the data is worth."""
    if sys.stderr is None:
        return
    try:
        print(text, file=sys.stderr, flush=True)  # noqa: T201 - this is where messages become text
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())  # what is still buffered must not raise again
