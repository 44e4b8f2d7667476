"""Tables as frames that move: every row a pose at its time, read in bulk. Trajectories (TUM, EuRoC, KITTI), CSV.

stamp,x,y,z,qx,qy,qz,qw                      frames as --frames says, `world` and `body` if it does not
stamp_ns,parent,name,x,y,yaw_deg             each row names its frames
parent,name,x,y,z,roll,pitch,yaw             no stamps: frames that are static
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, cast

from frametool.documents.source import not_text
from frametool.errors import FormatError
from frametool.formats.rows.pose_rows import describe
from frametool.formats.table import FORMATS
from frametool.grammar.edges import Edge, Samples
from frametool.stream.as_poses import FormatConverter
from frametool.stream.faults import BadRow, Fault
from frametool.stream.request import Request

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.formats.table import Poses
    from frametool.geometry.types import Components
    from frametool.grammar.edges import Options
    from frametool.stream.row_poses import RowPoses
    from frametool.stream.table_stream import PlannedRows
    from frametool.text.lines import ByteStream


def read(file: InputFile, options: Options) -> Iterator[Edge | Samples]:
    """Yield the rows of a table as poses of one frame, or of those that its columns name.

    Raises or reports FormatError with the line of a row that is no pose.
    """
    fmt = FORMATS[file.format].poses
    if what := not_text(file.head()):
        raise FormatError(what, source=file.name)
    converter = FormatConverter(file.format, Request(normalize=options.normalize), file.name, answers=options.answers)
    line = count = 0
    for block, outcome in converter.steps(cast("ByteStream", file.stream)):
        if not line:
            _check(converter.rows, fmt, file, options)
            line = 1
        for fault in outcome.faults:
            options.report(BadRow(fault._replace(line=line + fault.line), fault.reason, source=file.name))
        for row, column in _nameless(block, converter.rows).items():
            fault = Fault(line + int(block.lines[row]), column, "no name of a frame")
            options.report(BadRow(fault, fault.reason, source=file.name))
        yield from _pieces(block, line, fmt, options)
        line, count = line + outcome.lines, count + len(block.numbers)
    rows = converter.rows
    if len(rows.roles) < 2:
        describe(options, fmt, count)
    if fmt.rotation == "matrix":
        options.tally.projected = rows.off
    else:
        options.tally.rough += [1] * rows.mended


def _check(rows: PlannedRows, fmt: Poses, file: InputFile, options: Options) -> None:
    """Refuse a table that is no poses, or poses without time and names."""
    if rows.shape.notation is None:
        message = f"no rotation among the columns {rows.columns}: points are no frames"
        raise FormatError(message, source=file.name, line=1)
    if rows.stamp_at is None and not fmt.counted and not options.answers.stamps and len(rows.roles) < 2:
        lacking = ", ".join(name for role, name in enumerate(("parent", "name")) if role not in rows.roles)
        wanted = "frames that stand still have parent and name, one that moves stamp or stamp_ns, or --stamps FILE"
        raise FormatError(f"no column {lacking} nor stamp among {rows.columns}; {wanted}", source=file.name, line=1)


def _nameless(block: RowPoses, rows: PlannedRows) -> dict[int, str]:
    """Return the rows in which the cell of the parent (0) or of the name (1) is empty, and the name of its column."""
    found: dict[int, str] = {}
    for role in rows.roles:
        names = block.for_each((block.parents, block.names)[role])
        if not all(names):
            column = rows.table.name(rows.naming.places[role] or 0)
            found |= {row: column for row, name in enumerate(names) if not name}
    return found


def _pieces(block: RowPoses, line: int, fmt: Poses, options: Options) -> Iterator[Edge | Samples]:
    """Yield the poses of a block: as samples of one frame after the other, or as edges that are static."""
    columns: Components = tuple(block.numbers.T)
    if len(columns) == len("xyzw"):
        columns = (*[columns[0] * 0.0] * 3, *columns)
    times = None if block.stamps_ns is None else block.stamps_ns.tolist()
    poses = list(zip(*(column.tolist() for column in columns), strict=True))
    lines = (block.lines + line).tolist()
    world, body = options.answers.names(*fmt.frames)
    parents = [name or world for name in block.for_each(block.parents)]
    names = [name or body for name in block.for_each(block.names)]
    bare = options.tally.names.bare
    for (parent, name), group in groupby(range(len(poses)), key=lambda at: (bare(parents[at]), bare(names[at]))):
        some = list(group)
        part = slice(some[0], some[-1] + 1)
        if times is not None:
            yield Samples(parent, name, times[part], poses[part], lines[part])
        else:
            yield from (Edge(parent, name, poses[at], None, lines[at]) for at in some)
    options.tally.axes |= dict.fromkeys(names, options.answers.camera_axes or fmt.axes)
