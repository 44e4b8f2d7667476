"""CSV: a header with the column names of the representations, then one row per result.

    name,parent,x,y,z,qx,qy,qz,qw
    camera,map,1.0,2.0,3.0,0.0,0.0,0.0,1.0

Metres, radians unless the column states degrees; the pose of `name` in `parent`.  Single lines are split here, quoted
as in RFC 4180; `text.spans` processes blocks of lines.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.errors import NamedTuple, ValueInvalid
from frametool.grammar.pose import NAMES
from frametool.grammar.result import NoResult, Result, Style, in_columns, pose_numbers

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


PLAIN = ("point", "vector", "xyz")  # keys whose numbers are x, y, z
SIX = ("twist", "wrench")
HALVES = ("linear", "angular", "force", "torque")
_CELL = re.compile(r'(?:[^\S\n]*"((?:[^"]|"")*)"\s*|([^,]*))(?:,|$)')


class LineCell(NamedTuple):
    """The text of a cell without its quotes and surrounding blanks, and its first character's column, from 1."""

    text: str
    column: int


def split_line(line: str) -> list[LineCell]:
    """Return the cells of a line; an empty line has one empty cell."""
    cells = []
    for cell in _CELL.finditer(line):
        quoted_text, plain = cell.groups()
        text = plain.strip() if quoted_text is None else quoted_text.replace('""', '"')
        cells.append(LineCell(text, cell.start() + 1))
        if not cell[0].endswith(","):
            break
    return cells


def quoted(text: str) -> str:
    """Return the text of a cell, in quotes if necessary."""
    is_split = "," in text or '"' in text or "\r" in text or "\n" in text
    return '"' + text.replace('"', '""') + '"' if is_split else text


def write_poses(results: Iterable[Result | dict[str, Any]], style: Style) -> str:
    """Return a header and one row per result; a point's coordinates are x, y, z."""
    rows = [cells_of(each, style) for each in results]
    if not rows:
        return ""
    columns = list(dict.fromkeys(name for each in rows for name in each))
    return row(columns, style) + "".join(row([each.get(column, "") for column in columns], style) for each in rows)


write_points = write_poses


def _record_cells(record: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the cells of a record: three for each vector; other values that are not scalar are one cell of JSON."""
    for key, value in in_columns(record).items():
        if key in (*PLAIN, *HALVES) and (value is None or isinstance(value, (dict, list))):
            numbers = value.values() if isinstance(value, dict) else value or [None] * 3
            yield from zip("xyz" if key in PLAIN else [f"{key}_{axis}" for axis in "xyz"], numbers, strict=False)
        elif key == "utm" and isinstance(value, dict):
            yield from ((f"utm_{name}" if name == "zone" else name, cell) for name, cell in value.items())
        elif key in SIX and isinstance(value, dict):
            for name, cell in _record_cells(value):
                yield name if name.startswith(HALVES) else f"{key}_{name}", cell
        else:
            yield key, value


def cells_of(value: Result | dict[str, Any], style: Style) -> dict[str, Any]:
    """Return the cells of a result by column name."""
    return _pose_cells(value, style) if isinstance(value, Result) else dict(_record_cells(value))


def _pose_cells(result: Result, style: Style) -> dict[str, Any]:
    """Return the cells of a pose by column name.

    An extra that a representation includes (the angle of an axis) is omitted.  Raises ValueInvalid if two
    representations need the same column.
    """
    pose, extras = result.pose, dict[str, Any]()
    names = ("name", pose.name), ("parent", pose.parent)
    cells: dict[str, Any] = {key: name for key, name in names if name is not None}
    if style.place is not None and not isinstance(result, NoResult):
        from frametool.grammar.place import placed_cells

        placed, pose = placed_cells(pose, style.place)
        if style.place.origin is not None:  # the columns state its axes
            cells.pop("parent", None)
        cells |= placed
    elif pose.position is not None and not any(each.representation.whole for each in style.notations):
        cells |= zip("xyz", pose.position, strict=True)
    for notation in style.notations if pose.rotation is not None else ():
        whole = notation.representation.whole if pose.position is not None else None
        columns = whole.columns if whole else notation.columns_in(degrees=style.degrees)
        rotation = dict(zip(columns, pose_numbers(pose, notation, style), strict=True))
        if twice := [name for name in rotation if cells.get(name, rotation[name]) != rotation[name]]:
            raise ValueInvalid(f"columns {', '.join(twice)} would appear twice; write json or yaml, or a single --to")
        cells |= rotation
    if isinstance(result, NoResult):
        cells |= dict.fromkeys(cells.keys() - NAMES)
    for key, each in in_columns(result.all_extras(style)).items():
        extras |= _record_cells({key: each}) if key in SIX else {key: each}
    return cells | extras | cells


def row(cells: Iterable[Any], style: Style) -> str:
    """Return one line of cells with its line end."""
    return ",".join(cell(value, style) for value in cells) + "\n"


def cell(value: Any, style: Style) -> str:
    """Format one cell, quoted if necessary."""
    if isinstance(value, float):
        return style.number(value)
    if isinstance(value, (dict, list, bool)):
        from frametool.documents.writers import dump_json

        return quoted(dump_json(value, style.number))
    return quoted("" if value is None else str(value))
