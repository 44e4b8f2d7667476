"""Where one pose is wanted and a file of frames is given: the error that says what the file is and points to lookup."""

from __future__ import annotations

import re

from frametool.documents.source import HEAD
from frametool.errors import FormatError

_XML = rb"\s*(?:<\?xml\b|<!--|<(?:robot|sdf|mujoco|launch|opencv_storage)\b)"
_TREE = rb"(?m)^\s*(?:---\s*)?\{?\s*[\"']?frames[\"']?\s*:"  # our own
_MESSAGES = ("echo", "jsonl", "calls", "csv1", "csv2")  # are read as poses too


def refuse_robots(text: bytes, name: str) -> None:
    """Raise FormatError for XML of a robot or a launch file, in which no reader of poses finds anything."""
    if re.match(_XML, text) and (error := _pointing(text, name)):
        raise error


def with_hint(error: FormatError, text: bytes, name: str) -> FormatError:
    """Return the error to raise where no pose was found in a text: for a file of frames, one that says so."""
    return _pointing(text, name) or error


def _pointing(text: bytes, name: str) -> FormatError | None:
    from frametool.formats import FORMATS
    from frametool.formats.detect import by_sign

    try:
        form = by_sign(text[:HEAD], "tree", name=name)
    except FormatError as error:
        return error
    if form is None or form in ("yaml", "json"):
        form = "yaml" if re.search(_TREE, text[:HEAD]) else None
    if form is None or form in _MESSAGES or "rows" in FORMATS[form].reads:
        return None
    what = "a tree of frames" if form == "yaml" else f"{FORMATS[form].summary}: frames"
    file = "FILE" if name in ("", "stdin") else name
    hint = f"look one up: frametool lookup {file} TARGET SOURCE"
    return FormatError(f"{what}, not a pose; {hint}", source=name or "stdin")
