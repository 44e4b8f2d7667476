"""An error as one JSON object on a line of stderr: the sentence and what it is made of."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from frametool.errors import FormatError, FrametoolError

if TYPE_CHECKING:
    from collections.abc import Sequence

_WORD = re.compile(r"(?<!^)(?=[A-Z])")


def wants_json(arguments: Sequence[str]) -> bool:
    """Tell whether the arguments of a command ask for JSON."""
    if "--format=json" in arguments or "-fjson" in arguments:
        return True
    return any(option in ("-f", "--format") and value == "json" for option, value in pairwise(arguments))


def as_json(error: FrametoolError) -> str:
    """Return the error's kind, its message and its fields."""
    from frametool.documents.json_writer import dump

    kind = _WORD.sub("_", type(error).__name__).lower()
    return dump({"error": kind, "message": str(error), **_fields(error)})


def _fields(error: FrametoolError) -> dict[str, Any]:
    """Return what an error's message is made of."""
    if isinstance(error, FormatError):
        return {key: value for key in ("source", "line", "column") if (value := getattr(error, key))}
    fields: dict[str, Any] = getattr(error, "fields", {})
    return fields
