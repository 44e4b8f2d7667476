"""What is asked of a stream, whatever its format: the operation, how rows are read, how results are written."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.stream.faults import STOP
from frametool.stream.operation import Operation

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Rigid
    from frametool.stream.gathering import Gathered
    from frametool.stream.stamp_source import Timed


class Request(NamedTuple):
    """What one run does with its rows and how it writes the results.

    poses: how many poses each row holds; 0 where rows only name frames
    kind: what rows are taken for; "" as they look; kinds: of each of several points or poses in a row
    given: the notation of their rotations
    degrees: whether bare angles are in degrees
    notations: those of the result; none means as read
    columns: which columns are ours, one entry a pose
    keep, prefix: results stand beside what they come from, under other names
    frames: columns that name a row's frame
    edge_of: the pose that moves a row from the frame it names
    told: the frame results are in
    way: the pose that moves a record given in a frame
    timed: the poses that do so at the row's own time
    rename: turns a record's (parent, name) into those of its result
    counters: a decimal `frame` is a counter, because no frame is called so
    unwrap: angles go on beyond half a turn
    beside: the column or key of a number that is read beside the pose: its stamp or weight; "" is the usual stamp
    gathered: takes the poses, nothing is written then
    whole: all numbers of a result are wanted, also those that do not change
    """

    operation: Operation = Operation()
    poses: int = 1
    kind: str = ""
    kinds: tuple[str, ...] = ()
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
    counters: bool = True
    unwrap: bool = False
    beside: str | None = None
    gathered: Gathered | None = None
    on_error: str = STOP
    whole: bool = False

    @property
    def in_order(self) -> bool:
        """Tell whether a row's result depends on the rows before it."""
        return self.unwrap or self.operation.looks_back or self.gathered is not None

    def for_kind(self, kind: str) -> Request:
        """Return what is asked of rows of one kind: how an expression names its result depends on it."""
        formula = self.operation.formula
        if formula is None:
            return self
        return self._replace(rename=lambda parent, name: formula.rename(kind, parent, name))

    def counts(self, frame: str) -> bool:
        """Tell whether what stands under `frame` is a counter rather than a frame's name."""
        return self.counters and frame.isdecimal()

    def in_degrees(self, form: Notation) -> bool:
        """Tell whether a notation's angles are degrees: its own word wins."""
        return self.degrees if form.degrees is None else form.degrees
