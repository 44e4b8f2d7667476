"""The CSV of the echo tools, as the messages it was made from.

    %time,field.header.seq,field.header.stamp,field.header.frame_id,field.point.x,..      rostopic echo -p
    1795206353524626016,1,1795206353524626016,turtle1,1.0,..                               stamps in ns, nothing quoted
    1683377979,902062451,world,turtle1,5.5,5.5,0.0,0.0,0.0,0.0,1.0                         ros2 topic echo --csv

rostopic names every field once, in the header; later rows may hold more or fewer transforms than it names. The
other has no header: the kind of message is known by how many fields there are, several transforms follow each other.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.errors import shown
from frametool.frames.stamps import BILLION
from frametool.grammar.readers import Misfit

if TYPE_CHECKING:
    from collections.abc import Sequence


def _axes(part: str, axes: str = "xyz") -> list[str]:
    return [f"{part}.{axis}" for axis in axes]


_RIGID = ["child_frame_id", *_axes("transform.translation"), *_axes("transform.rotation", "xyzw")]
_HEADER2 = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id"]
TRANSFORM1 = ["header.seq", "header.stamp", "header.frame_id", *_RIGID]
TRANSFORM2 = [*_HEADER2, *_RIGID]
_TWIST = [*_axes("linear"), *_axes("angular")]
_POINT = [*_HEADER2, *_axes("point")]
_POSE = [*_HEADER2, *_axes("pose.position"), *_axes("pose.orientation", "xyzw")]
_MANY = re.compile(r"field\.(\w*?)0\.header\.seq")


def message1(cells: Sequence[str], header: Sequence[str]) -> dict[str, Any]:
    """Return the message of one row under a header of `rostopic echo -p`.

    Raises Misfit with the column.
    """
    if len(header) > 1 and (many := _MANY.fullmatch(header[1])):
        return {many[1]: _entries(cells[1:], TRANSFORM1)}
    if len(cells) != len(header):
        raise Misfit(f"expected {len(header)} cells, found {len(cells)}")
    return _nested([name.removeprefix("field.") for name in header[1:]], cells[1:])


def message2(cells: Sequence[str]) -> dict[str, Any]:
    """Return the message of one row of `ros2 topic echo --csv`.

    Raises Misfit for a row that none of the known messages gives.
    """
    if len(cells) == 6:
        return _nested(_TWIST if _is_number(cells[2]) else _POINT, cells)
    if len(cells) == 10:
        return _nested(_POSE, cells)
    return {"transforms": _entries(cells, TRANSFORM2)}


def _entries(cells: Sequence[str], names: Sequence[str]) -> list[dict[str, Any]]:
    """Take the transforms of one row apart."""
    size = len(names)
    if not cells or len(cells) % size:
        raise Misfit(
            f"expected {size} cells for each transform, found {len(cells)} (nothing is quoted: a comma in a name?)"
        )
    return [_nested(names, cells[at : at + size]) for at in range(0, len(cells), size)]


def _nested(names: Sequence[str], cells: Sequence[str]) -> dict[str, Any]:
    """Put cells where their dotted names say; a stamp in nanoseconds becomes secs and nsecs."""
    message: dict[str, Any] = {}
    for name, cell in zip(names, cells, strict=True):
        *outer, last = name.split(".")
        inner = message
        for step in outer:
            inner = inner.setdefault(step, {})
        inner[last] = _stamp1(cell) if last == "stamp" else cell
    return message


def _stamp1(cell: str) -> dict[str, str]:
    """Split integer nanoseconds."""
    if not (cell.isascii() and cell.isdigit()):
        raise Misfit(f"stamp must be whole nanoseconds, found {shown(cell)}")
    seconds, nanoseconds = divmod(int(cell), BILLION)
    return {"secs": str(seconds), "nsecs": str(nanoseconds)}


def _is_number(cell: str) -> bool:
    return not cell.strip("-+.0123456789eE")
