"""The sizes of a run set for a test: how much is read, held or computed at once."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from frametool import sizes

if TYPE_CHECKING:
    from collections.abc import Iterator


def set_sizes(patch: pytest.MonkeyPatch, **changed: int) -> None:
    """Set sizes by their names in lower case."""
    for name, size in changed.items():
        patch.setattr(sizes, name.upper(), size)


@contextmanager
def sized(**changed: int) -> Iterator[None]:
    """Set sizes within a block, as in `with sized(block=7):`."""
    with pytest.MonkeyPatch.context() as patch:
        set_sizes(patch, **changed)
        yield
