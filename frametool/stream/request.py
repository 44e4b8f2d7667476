"""What is asked of a stream, whatever its format: the operation, how rows are read, how results are written."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.stream.faults import STOP
from frametool.stream.operation import Operation

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Rigid
    from frametool.stream.stamp_source import Timed


class Request(NamedTuple):
    """The wishes of one run.

    poses: how many poses each row holds (0: rows only name frames)
    kind: what rows are taken for ("" as they look); given: notation of their rotations; degrees: of bare angles
    notations: those of the result (none: as read); columns: which are ours, one entry a pose
    keep, prefix: results beside what they come from, under other names
    frames: columns that name a row's frame, edge_of: the pose that moves from it; told: the frame results are in
    way: the pose that moves a record given in a frame; timed: those that do so in time, in place of both
    rename: a record's parent and name to those of its result
    """

    operation: Operation = Operation()
    poses: int = 1
    kind: str = ""
    given: Notation | None = None
    degrees: bool = False
    normalize: bool = False
    notations: tuple[Notation, ...] = ()
    keep_sign: bool = False
    precision: int | None = None
    columns: tuple[str, ...] = ()
    keep: bool = False
    prefix: str = ""
    frames: tuple[str, ...] = ()
    edge_of: Callable[[str], Rigid] | None = None
    way: Callable[[str | None], Rigid] | None = None
    timed: Timed | None = None
    rename: Callable[[str | None, str | None], tuple[str | None, str | None]] | None = None
    told: str | None = None
    unwrap: bool = False
    on_error: str = STOP

    @property
    def in_order(self) -> bool:
        """Tell whether a row's result depends on the rows before it."""
        return self.unwrap or self.operation.of == "previous"

    def in_degrees(self, form: Notation) -> bool:
        """Tell whether a notation's angles are degrees: its own word wins."""
        return self.degrees if form.degrees is None else form.degrees
