"""The poses that move the rows of a block: by the frame each row is given in, and at the time it says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import FrametoolError
from frametool.stream.row_layout import IDENTITY
from frametool.stream.stamp_columns import parse_header_stamps, parse_stamps

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.types import Rigid
    from frametool.stream.stamp_source import Timed
    from frametool.text.array_types import Floats, Ints
    from frametool.text.spans import Spans

    Blame = Callable[[int, str, str | FrametoolError], None]

NOWHERE = (0.0, 0.0, 0.0, *IDENTITY)


def by_frame(edge_of: Callable[..., Rigid], frames: Sequence[str | None], blame: Blame, column: str = "") -> Rigid:
    """Return the pose of each row by its frame's name; a row whose frame has none is bad."""
    table: list[Rigid] = []
    known: dict[str | None, tuple[int, FrametoolError | None]] = {}
    for row, name in enumerate(frames):
        if name not in known:
            edge, error = _edge(edge_of, name)
            known[name] = len(table), error
            table.append(edge)
        if problem := known[name][1]:
            blame(row, column, problem)
    chosen_rows = np.array([known[name][0] for name in frames], np.int64)
    return tuple(np.array(column)[chosen_rows] for column in zip(*table, strict=True))  # type: ignore[return-value]


def _edge(edge_of: Callable[..., Rigid], name: str | None) -> tuple[Rigid, FrametoolError | None]:
    """Return the edge of a frame, or why there is none."""
    try:
        return edge_of(name), None
    except FrametoolError as error:
        return NOWHERE, error


def by_time(
    timed: Timed, stamps: tuple[Spans, ...] | Ints, frames: Sequence[str | None], blame: Blame, column: str = ""
) -> Rigid:
    """Return the pose of each row at its stamp; a row without a stamp or without data then is bad.

    stamps: one for each row, or its seconds and nanoseconds; or the nanoseconds themselves
    frames: one a row, or one for all (None: the one SOURCE); column: the one that names them
    """
    if isinstance(stamps, np.ndarray):
        times, reasons = stamps, dict[int, str]()
    else:
        times, reasons = parse_header_stamps(*stamps) if len(stamps) == 2 else parse_stamps(*stamps, in_ns=timed.in_ns)
    for row, reason in reasons.items():
        blame(row, timed.column, reason)
    poses = np.full((7, len(times)), np.nan)
    for frame, rows in _by_frame(frames, np.delete(np.arange(len(times)), list(reasons))):
        _fill(poses, timed, frame, rows, times, blame, column)
    return tuple(poses)  # type: ignore[return-value]


def _by_frame(frames: Sequence[str | None], rows: Ints) -> list[tuple[str | None, Ints]]:
    """Part rows by their frames."""
    if len(set(frames)) == 1:
        return [(frames[0], rows)]
    numbers = {frame: number for number, frame in enumerate(dict.fromkeys(frames))}
    of_row = np.fromiter((numbers[frame] for frame in frames), np.int64, len(frames))[rows]
    return [(frame, rows[of_row == number]) for frame, number in numbers.items()]


def _fill(poses: Floats, timed: Timed, frame: str | None, rows: Ints, times: Ints, blame: Blame, column: str) -> None:
    """Look the rows of one frame up at once, then ask singly why some have no data."""
    try:
        poses[:, rows] = timed.many(frame, times[rows])
    except FrametoolError as error:
        for row in rows.tolist():
            blame(row, column, error)
    else:
        for row in rows[np.isnan(poses[6, rows])].tolist():
            blame(row, timed.column, _reason(timed, frame, int(times[row])))


def _reason(timed: Timed, frame: str | None, stamp_ns: int) -> str | FrametoolError:
    try:
        timed.one(frame, stamp_ns)
    except FrametoolError as error:
        return error
    return "no data"
