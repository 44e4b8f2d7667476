"""A whole stream: blocks in, outcomes out in order, faults reported after the good rows before them are out."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import warn

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.stream.faults import BadRows, Fault


class Outcome(NamedTuple):
    """What became of a block.

    faults: by line, counted from 0 in the block
    rows, lines, size: how many rows, lines and bytes the block had
    mended: rotations that were normalised
    doubted: lines with an angle that looks like degrees, and that angle
    """

    text: bytes
    faults: Sequence[Fault] = ()
    rows: int = 0
    lines: int = 0
    mended: int = 0
    doubted: Sequence[tuple[int, str]] = ()
    size: int = 0


def run(
    outcomes: Iterable[Outcome], write: Callable[[bytes], None], bad: BadRows, advance: Callable[[int, int], None]
) -> int:
    """Write what becomes of each block, report its faults, and return the exit status.

    advance: is told rows and bytes done after each block.  Raises BadRow at the first fault if that is the rule.
    """
    line, rows, mended, doubted = 1, 0, 0, False
    for outcome in outcomes:
        if outcome.text:
            write(outcome.text)
        advance(outcome.rows, outcome.size)
        faults = [fault._replace(line=fault.line + line) for fault in outcome.faults]
        if outcome.doubted and not doubted:
            doubted = True
            at, angle = outcome.doubted[0]
            bad.take(fault for fault in faults if fault.line < line + at)
            _suspect_degrees(f"{bad.source}:{line + at}", angle)
            faults = [fault for fault in faults if fault.line >= line + at]
        bad.take(faults)
        line, rows, mended = line + outcome.lines, rows + outcome.rows, mended + outcome.mended
    if mended:
        warn(f"{bad.source}: {mended} of {rows} rotations were off by more than 1e-6 and were normalised")
    return bad.finish(rows)


def _suspect_degrees(place: str, angle: str) -> None:
    warn(f"{place}: {angle} is more than a full turn in radians; degrees? give --deg, or name the columns _deg")


def mapped(process: Callable[[bytes], Outcome], blocks: Iterable[bytes], jobs: int) -> Iterator[Outcome]:
    """Process blocks in order, over several processes if asked for."""
    if jobs < 2:
        return map(process, blocks)
    from frametool.stream.workers import spread

    return spread(process, blocks, jobs)
