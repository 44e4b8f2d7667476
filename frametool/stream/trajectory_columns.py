"""The columns of trajectories whose form says what stands where: TUM, EuRoC and KITTI, with a header or without."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.errors import FormatError
from frametool.formats.euroc import COLUMNS as EUROC
from frametool.geometry.representations import UPPER_ROWS, notation
from frametool.stream.header import Columns, PoseColumns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.stream.request import Request
    from frametool.stream.table import Table

TUM = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
KITTI = ("r11", "r12", "r13", "tx", "r21", "r22", "r23", "ty", "r31", "r32", "r33", "tz")
STAMPS = re.compile(r"[#% ]*(?:.*[._])?(?:stamp|timestamp|time|t)(?:_ns|_s)?\s*(?:[\[(].*)?", re.IGNORECASE)
WIDTHS = {"tum": (len(TUM),), "kitti": (len(KITTI),), "euroc": (8, len(EUROC))}


def has_header(form: str, begin: bytes) -> bool:
    """Tell whether a table in a form may name its columns; EuRoC's comes with its header or without."""
    if form == "euroc":
        return begin.removeprefix(b"\xef\xbb\xbf").startswith(b"#")
    return form != "kitti"


def as_trajectory(table: Table, form: str, request: Request, source: str) -> Table:
    """Say the columns of a trajectory, unless --from or --columns do; eight numbers without names are TUM.

    Raises FormatError for a count of columns that the form does not have.
    """
    if request.given or request.columns:
        return table
    if form in ("kitti", "euroc") and not table.names and table.width not in WIDTHS[form]:
        wanted = " or ".join(map(str, WIDTHS[form]))
        line = table.head.count(b"\n") + 1
        raise FormatError(f"expected {wanted} numbers a line, found {table.width}", source=source, line=line)
    if form == "kitti":
        pose = Columns(tuple(range(len(KITTI))), KITTI, unit=1.0, notation=UPPER_ROWS, degrees=(None,) * 9, whole=True)
        return table._replace(names=KITTI, pose=PoseColumns(None, pose))
    if form == "euroc":
        names = table.names or EUROC[: table.width]
        return table._replace(names=names, pose=_euroc(names, source))
    if table.names or not (form == "tum" or table.width == len(TUM)):
        return table
    return table._replace(names=TUM, width=len(TUM))


def _euroc(names: Sequence[str], source: str) -> PoseColumns:
    """Find EuRoC's columns by the words their names begin with."""
    bare = [name.split("[")[0].strip() for name in names]
    wanted = [name.split("[")[0].strip() for name in EUROC[1:8]]
    if missing := [name for name in wanted if name not in bare]:
        raise FormatError(f"no column {', '.join(missing)}", source=source, line=1)
    places = [bare.index(name) for name in wanted]
    position = Columns(tuple(places[:3]), tuple(names[at] for at in places[:3]), unit=1.0)
    turn = tuple(names[at] for at in places[3:])
    return PoseColumns(position, Columns(tuple(places[3:]), turn, notation=notation("wxyz"), degrees=(None,) * 4))


def stamp_column(names: Sequence[str] | None) -> int | None:
    """Find the column of the stamps by its name."""
    return next((at for at, name in enumerate(names or ()) if STAMPS.fullmatch(name)), None)


def in_nanoseconds(form: str, name: str) -> bool:
    """Tell whether the stamps of a column are whole nanoseconds."""
    from frametool.stream.stamp_source import NANOSECONDS

    bare = name.lower().replace(" ", "")
    return form == "euroc" or bare.endswith(("_ns", "[ns]", "(ns)")) or name in NANOSECONDS
