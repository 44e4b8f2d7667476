"""What stands in the rows of a block beside their poses: the stamps of velocities, the weights of a mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.stream.memory import no_step
from frametool.stream.stamp_columns import parse_header_stamps, parse_stamps
from frametool.stream.stamp_source import in_nanoseconds
from frametool.text.numbers import parse_number
from frametool.text.parse import parse_floats

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.errors import FrametoolError
    from frametool.stream.rows import Block
    from frametool.text.array_types import Floats, Ints
    from frametool.text.spans import Spans

    Blame = Callable[[int, str, str | FrametoolError], None]


def stamps_of(block: Block, name: str, blame: Blame) -> Ints:
    """Return the stamps of rows in nanoseconds; a row without one is bad."""
    count = len(block.places)
    if not count:
        return np.zeros(0, np.int64)
    if block.times is not None:
        return block.times
    if not block.stamps or not block.stamps[0]:
        raise ValueInvalid("rows have no stamps; there is no velocity")
    spans = block.stamps[0]
    if len(spans) == 2:
        stamps, reasons = parse_header_stamps(*spans)
    else:
        stamps, reasons = parse_stamps(*spans, in_ns=in_nanoseconds(name))
    for row, reason in reasons.items():
        blame(row, name, reason)
    return stamps


def seconds_before(stamps: Ints, good: Sequence[int], before_ns: int | None, name: str, blame: Blame) -> Floats:
    """Return the seconds since the good row before each row; a row at which time stands still or turns back is bad.

    before_ns: the stamp of the last good row of the block before; None for the first block, whose first row gets 1.
    """
    seconds = np.ones(len(stamps))
    rows = np.array(good, np.int64)
    if not len(rows):
        return seconds
    at = stamps[rows]
    before = np.concatenate([[at[0] - BILLION if before_ns is None else before_ns], at[:-1]])
    steps = at - before
    for index in np.flatnonzero(steps <= 0).tolist():
        blame(good[index], name, no_step(int(before[index]), int(at[index])))
    seconds[rows] = np.where(steps > 0, steps, BILLION) / BILLION
    return seconds


def weights_of(block: Block, name: str, blame: Blame) -> Floats:
    """Return the weights of rows; a row with none, or a negative one, is bad."""
    if not len(block.places):
        return np.zeros(0)
    weights = _parsed(block.stamps[0][0], name, blame) if block.weights is None else block.weights
    for row in np.flatnonzero(weights < 0.0).tolist():
        blame(row, name, f"weight {weights[row]:g} is negative")
    return weights


def _parsed(cells: Spans, name: str, blame: Blame) -> Floats:
    """Read cells as numbers; a row with another cell is bad."""
    numbers, bad = parse_floats(cells)
    for row in bad.tolist():
        try:
            numbers[row] = parse_number(cells.text(row).decode("utf-8", "replace").strip(" \t\"'"))
        except ValueInvalid as error:
            blame(row, name, str(error))
    return numbers
