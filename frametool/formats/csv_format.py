"""CSV: a header with the column names of the representations, then one row a result.

name,parent,x,y,z,qx,qy,qz,qw
camera,map,1.0,2.0,3.0,0.0,0.0,0.0,1.0
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.grammar.result import columns_of, is_matrix, rotation_numbers
from frametool.text.csv_line import quoted

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.grammar.result import Result, Style


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return a header and one row a result; the columns are those of the first."""
    return _table([dict(_pose_cells(result, style)) for result in results], style)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return a header and one row a record; a point's coordinates are x, y, z."""
    return _table([dict(_record_cells(record)) for record in records], style)


def _pose_cells(result: Result, style: Style) -> Iterator[tuple[str, Any]]:
    """Yield a pose's cells by column name."""
    pose = result.pose
    yield from ((key, name) for key, name in (("name", pose.name), ("parent", pose.parent)) if name is not None)
    whole = pose.position is not None and any(is_matrix(form) for form in style.notations)
    if pose.position is not None and not whole:
        yield from zip("xyz", pose.position, strict=True)
    for form in style.notations if pose.rotation is not None else ():
        numbers = rotation_numbers(pose, form, style)
        if whole and is_matrix(form):
            yield from _homogeneous_cells(numbers, pose.position or ())
        else:
            yield from zip(columns_of(form, style), numbers, strict=True)
    yield from result.extras.items()


def _homogeneous_cells(numbers: Sequence[float], position: Sequence[float]) -> Iterator[tuple[str, float]]:
    """Yield the cells m11 .. m44 of a 4x4 pose."""
    for row in range(3):
        yield from ((f"m{row + 1}{column + 1}", numbers[3 * row + column]) for column in range(3))
        yield f"m{row + 1}4", position[row]
    yield from zip(("m41", "m42", "m43", "m44"), (0.0, 0.0, 0.0, 1.0), strict=True)


def _record_cells(record: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in record.items():
        if isinstance(value, dict):
            yield from value.items()
        elif isinstance(value, list):
            yield from zip("xyz", value, strict=False)
        else:
            yield key, value


def _table(rows: Sequence[dict[str, Any]], style: Style) -> str:
    """Write rows under the columns of the first."""
    if not rows:
        return ""
    columns = list(rows[0])
    return row(columns, style) + "".join(row([each.get(column, "") for column in columns], style) for each in rows)


def row(cells: Iterable[Any], style: Style) -> str:
    """Return one line of cells with its line end."""
    return ",".join(_cell(value, style) for value in cells) + "\n"


def _cell(value: Any, style: Style) -> str:
    """Write one cell, quoted where a reader would split it."""
    if isinstance(value, float):
        return style.number(value)
    return quoted("" if value is None else str(value))
