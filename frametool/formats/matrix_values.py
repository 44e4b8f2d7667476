"""Matrices as documents hold them: rows in rows, one long list, or OpenCV's map of rows, cols and data; row-major."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.yaml_events import TAG
from frametool.errors import shown
from frametool.geometry.representations import notation
from frametool.grammar.readers import Misfit, kind, read_numbers
from frametool.grammar.rotation import read_spelled, rotation_of

if TYPE_CHECKING:
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Quaternion, Reading

MATRIX = notation("matrix")
ROTVEC = notation("rotvec")
WHOLE = ((4, 4), (3, 4))  # rows and columns of what holds a whole pose
LAST_ROW = ("0", "0", "0", "1")
_NUMBER_TYPE = r"(\d*)[ucwsifdh]"  # OpenCV's dt: how many numbers an element has, and of which type


class Grid(NamedTuple):
    """A matrix in text: rows and columns (0 where they differ in length), one text a number, and where each stands."""

    rows: int
    columns: int
    texts: list[Any]
    places: list[Path]

    @property
    def size(self) -> str:
        """Say how large it is."""
        return f"{self.rows} x {self.columns}" if self.columns else f"{self.rows} rows of different lengths"

    def holds(self, count: int) -> bool:
        """Tell whether it is a row or a column of so many numbers."""
        return 1 in (self.rows, self.columns) and len(self.texts) == count


def grid_of(value: Any) -> Grid | None:
    """Return a value as a matrix; None if it is none.

    Raises Misfit for one whose data does not have the size that it says.
    """
    if type(value) is dict:
        return _stored(value) if {"rows", "cols", "data"} <= value.keys() else None
    if type(value) is not list or not value:
        return None
    if not any(type(row) is list for row in value):
        return None if any(type(each) is dict for each in value) else _flat(1, len(value), value, ())
    rows = [row if type(row) is list else [row] for row in value]
    widths = {len(row) for row in rows}
    places: list[Path] = [(at, column) for at, row in enumerate(rows) for column in range(len(row))]
    return Grid(len(rows), widths.pop() if len(widths) == 1 else 0, [text for row in rows for text in row], places)


def _flat(rows: int, columns: int, texts: list[Any], path: Path) -> Grid:
    return Grid(rows, columns, texts, [(*path, index) for index in range(len(texts))])


def _stored(value: dict[str, Any]) -> Grid:
    """Take OpenCV's map apart."""
    rows, columns = (_whole(value, key) for key in ("rows", "cols"))
    known = re.fullmatch(_NUMBER_TYPE, str(value.get("dt", "d")))
    if known is None:
        raise Misfit(f"expected a type of numbers like d or 3f, found {kind(value['dt'])}", ("dt",))
    columns *= int(known[1] or 1)
    data = value["data"]
    if type(data) is not list or len(data) != rows * columns:
        found = f"{len(data)} numbers" if type(data) is list else kind(data)
        raise Misfit(f"expected {rows} x {columns} = {rows * columns} numbers, found {found}", ("data",))
    return _flat(rows, columns, data, ("data",))


def _whole(value: dict[str, Any], key: str) -> int:
    text = value[key]
    if type(text) is not str or not re.fullmatch(r"[0-9]{1,9}", text):
        raise Misfit(f"expected a whole number, found {shown(text) if type(text) is str else kind(text)}", (key,))
    return int(text)


def is_tagged(value: Any, tag: str) -> bool:
    """Tell whether a mapping has a tag of YAML."""
    return type(value) is dict and value.get(TAG) == tag


def whole_pose(grid: Grid | None) -> Grid | None:
    """Return a matrix that has the size of a whole pose with the four rows of it; None for any other."""
    if grid is not None and grid.holds(16):
        grid = grid._replace(rows=4, columns=4)
    if grid is None or (grid.rows, grid.columns) not in WHOLE:
        return None
    missing = 16 - len(grid.texts)
    return Grid(4, 4, [*grid.texts, *LAST_ROW[:missing]], [*grid.places, *[()] * missing])


def read_whole(grid: Grid, reading: Reading) -> Rigid:
    """Read a 4x4 matrix as x, y, z, qx, qy, qz, qw, checked by the rules of the grammar; raises Misfit."""
    position, rotation = read_spelled(MATRIX, grid.texts, grid.places, reading)
    return (*(position or (0.0, 0.0, 0.0)), *rotation)


def read_turn(grid: Grid, reading: Reading) -> Quaternion:
    """Read a 3x3 matrix, or a rotation vector of three numbers in radians; raises Misfit."""
    if grid.holds(3):
        return rotation_of(ROTVEC, grid.texts, grid.places, reading)
    if (grid.rows, grid.columns) != (3, 3) and not grid.holds(9):
        raise Misfit(f"expected a 3 x 3 matrix or a rotation vector, found {grid.size}")
    return rotation_of(MATRIX, grid.texts, grid.places, reading)


def read_shift(grid: Grid) -> tuple[float, float, float]:
    """Read a vector of three numbers; raises Misfit."""
    if not grid.holds(3):
        raise Misfit(f"expected 3 numbers, found {grid.size}")
    try:
        x, y, z = read_numbers(grid.texts, ("x", "y", "z"))
    except Misfit as misfit:
        raise Misfit(str(misfit), grid.places[int(misfit.path[0])]) from None
    return x, y, z
