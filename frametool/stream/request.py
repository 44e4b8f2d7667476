"""What is asked of a stream, whatever its format: the operation, how rows are read, how results are written."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.stream.faults import STOP
from frametool.stream.operation import Operation

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.geometry.kinds import Rigid
    from frametool.geometry.representations import Notation


class Request(NamedTuple):
    """The wishes of one run.

    poses: how many poses each row holds (0: rows only name frames)
    kind: what rows are taken for ("" as they look); given: notation of their rotations; degrees: of bare angles
    notations: those of the result (none: as read); columns: which are ours, one entry a pose
    keep, prefix: results beside what they come from, under other names
    frames: columns or keys that name a row's frame; told: the frame results are in, if it is known
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
    told: str | None = None
    unwrap: bool = False
    on_error: str = STOP

    def in_degrees(self, form: Notation) -> bool:
        """Tell whether a notation's angles are degrees: its own word wins."""
        return self.degrees if form.degrees is None else form.degrees
