"""Look-ups for every row of a table: its frames, its time or both stand in columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Inputs, option, together
from frametool.cli.options import ColumnNames
from frametool.cli.trees import CarriedSigmas, frame_name
from frametool.errors import UnknownFrame
from frametool.geometry.representations import notation
from frametool.geometry.rigid import EXACT, UNCERTAIN
from frametool.grammar.pose_algebra import looked_up

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.cli.explaining import PoseTask
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.lookups import FrameTree
    from frametool.geometry.types import Components


ONE_LOOKUP = ("times", "source_at", "fixed", "explain")  # which a table does not take


def _column_option(end: str, *excludes: str) -> Callable[..., Any]:
    about = f"column of a table with each row's {end}"
    under = "Time" if end == "time" else "Rows"
    return option(f"--{end.lower()}-column NAME", about, ColumnNames(), excludes=(*ONE_LOOKUP, *excludes), under=under)


column_options = together(  # `RowFrames` takes them
    _column_option("TARGET"),
    _column_option("SOURCE"),
    _column_option("time", "at"),
)


class RowFrames:
    """Which columns name the frames and the time of each row; true if one does."""

    def __init__(self, inputs: Inputs) -> None:
        """Take what the options say."""
        self.target: str | None = inputs.target_column
        self.source: str | None = inputs.source_column
        self.time: str | None = inputs.time_column

    def __bool__(self) -> bool:
        """Return whether a column names a frame or a time."""
        return not (self.target is self.source is self.time is None)

    def run(
        self, task: PoseTask, tree: FrameTree | TransformBuffer, target: str | None, source: str | None, at: int | None,
        sigmas: CarriedSigmas | None = None, window: tuple[int, int] | None = None,
    ) -> int:  # fmt: skip
        """Add the pose of SOURCE in TARGET to every row; a frame named on the command line is every row's.

        sigmas: the covariances are wanted too
        """
        from frametool.stream.request import Operation
        from frametool.stream.stamp_source import Timed

        if self.target is not None and source is None:
            target, source = None, target
        for name, column, called in ((target, self.target, "TARGET"), (source, self.source, "SOURCE")):
            if (name is None) == (column is None):
                raise click.UsageError(f"name {called} or its column, one of the two")
        fixed_target, fixed_source = (name and frame_name(name, tree) for name in (target, source))
        frames, place = tuple(name for name in (self.target, self.source) if name is not None), task.output.style.place

        def ends_of(names: str | None) -> tuple[str, str]:
            cells = (names or "").split("\0") if len(frames) == 2 else [names or ""]
            if len(cells) > max(len(frames), 1):
                raise UnknownFrame(names or "", known=tree.frames)  # a NUL in a cell is no end of a name
            return fixed_target or cells[0], fixed_source or cells[-1]

        def edge_of(names: str | None, own: int | None = at) -> Components:
            ends = ends_of(names)
            if place is not None:
                from frametool.grammar.place import check_in_ecef

                check_in_ecef(ends[0], place)
            if sigmas is None:
                return tree.lookup(*ends, own).components
            found = sigmas.noted(looked_up(tree, *ends, own, covariance=True))
            return *found.pose.components, *found.extras["covariance"]

        def many(names: str | None, times_ns: Any) -> Components:
            ends = ends_of(names)
            found = tree.lookup_many(*ends, times_ns, missing="nan").components
            return found if sigmas is None else sigmas.beside(found, *ends, times_ns)

        forms = task.output.notations or (notation("quaternion"),)
        operation = Operation(uncertain=sigmas is not None)
        width = EXACT if sigmas is None else UNCERTAIN
        request = task.request(
            poses=0, frames=frames, pose_of_row_frame=edge_of, notations=forms, operation=operation,
            timed=None if self.time is None else Timed(self.time, many, edge_of, width=width),
            window=window,
        )  # fmt: skip
        status = task.stream.run(request, task.output, tables_only=True)
        if sigmas is not None:
            sigmas.tell()
        return status
