"""An error as one JSON object on a line of stderr: the sentence and what it is made of."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.errors import FrametoolError


def wants_json(arguments: Sequence[str]) -> bool:
    """Tell whether the arguments of a command ask for JSON."""
    if "--format=json" in arguments or "-fjson" in arguments:
        return True
    return any(option in ("-f", "--format") and value == "json" for option, value in pairwise(arguments))


def as_json(error: FrametoolError) -> str:
    """Return the error's kind, its message and its fields."""
    from frametool.documents.json_writer import dump

    return dump({"error": error.kind, "message": str(error), **error.details()})
