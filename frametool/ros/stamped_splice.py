"""The text of a message in which moved numbers and frames stand; everything else stays, byte for byte."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.documents.json_writer import dump as json_dump
from frametool.documents.nodes import parse_nodes
from frametool.documents.yaml_writer import dump as yaml_dump
from frametool.documents.yaml_writer import quoted
from frametool.ros.stamped import COVARIANT, KINDS, XYZ

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.nodes import Node
    from frametool.grammar.readers import Path
    from frametool.grammar.result import Style
    from frametool.ros.stamped import Stamped


def respelled(text: str, index: int, moved: Sequence[Stamped], style: Style) -> str | None:
    """Return the text of a message with what moved in it; None if some of that has no place of its own in the text.

    index: of the document in the text.
    """
    root = parse_nodes(text)[index]
    try:
        edits = sorted(edit for each in moved for edit in _edits(root, each, style))
    except (KeyError, IndexError, TypeError):
        return None
    pieces, at = [], 0
    for start, end, new in edits:
        pieces += [text[at:start], new]
        at = end
    return "".join([*pieces, text[at:]])


def _edits(root: Node, moved: Stamped, style: Style) -> Iterator[tuple[int, int, str]]:
    """Yield stretches of the text and what stands there instead."""
    for path, value in _numbers(moved):
        node = root.at(path)
        if type(node.value) is not str or node.quote == "*":
            raise TypeError
        bare = bool(node.quote)
        number = style.number(value) if style.form != "ros2" else yaml_dump(value, style.number).rstrip("\n")
        yield node.start + bare, node.end - bare, number
    if "header" in moved.message and moved.frame is not None:
        node = root.at((*moved.path, "header", "frame_id"))
        if node.value != moved.frame:
            yield node.start, node.end, _named(moved.frame, node.quote)


def _numbers(moved: Stamped) -> Iterator[tuple[Path, float]]:
    """Yield the numbers of a message, each with its path."""
    key, parts = moved.key, KINDS[moved.key].parts
    base: Path = (*moved.path, key) if key in moved.message else moved.path
    if moved.covariance is not None:
        yield from (((*base, "covariance", place), value) for place, value in enumerate(moved.covariance))
    if key in COVARIANT and key in moved.message and key in moved.message[key]:
        base = (*base, key)
    names = [(*base, parts[0], axis) for axis in XYZ] if parts else [(*base, axis) for axis in XYZ]
    names += [(*base, parts[1], axis) for axis in "xyzw"] if parts else []
    yield from zip(names, moved.numbers, strict=False)


def _named(name: str, quote: str) -> str:
    """Write a frame's name with the quotes that the one before it had."""
    if quote == "'":
        return "'" + name.replace("'", "''") + "'"
    return str(json_dump(name)) if quote else quoted(name)
