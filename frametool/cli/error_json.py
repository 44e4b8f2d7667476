"""An error as one JSON object on a line of stderr: the sentence and what it is made of."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.cli.stderr import BatchLine
    from frametool.errors import FrametoolError

PLACE = ("source", "line", "column")


def wants_json(arguments: Sequence[str]) -> bool:
    """Tell whether the arguments of a command ask for JSON."""
    if "--format=json" in arguments or "-fjson" in arguments:
        return True
    return any(option in ("-f", "--format") and value == "json" for option, value in pairwise(arguments))


def as_json(error: FrametoolError, line: BatchLine | None = None, fate: str = "") -> str:
    """Return the error's kind, its message and its fields.

    line: of the batch in which it is; the object's place is then that one, and its own place stands under `input`
    fate: what became of that line
    """
    from frametool.documents.json_writer import dump

    message, details = str(error), error.details()
    if line is not None:
        own = {key: value for key, value in details.items() if key in PLACE}
        rest = {key: value for key, value in details.items() if key not in PLACE}
        message = f"{line}{message}"
        details = {**line._asdict(), **({"input": own} if own else {}), **rest}
    return dump({"error": error.kind, "message": f"{message} ({fate})" if fate else message, **details})
