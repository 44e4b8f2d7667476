"""A whole stream: blocks in, outcomes out in order, faults reported after the good rows before them are out."""

from __future__ import annotations

from itertools import starmap
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import warn
from frametool.geometry.representations import UPPER_ROWS
from frametool.grammar.edges import PROJECTED_IN_SILENCE, projection
from frametool.stream.faults import ZONES, RowNote

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.stream.evaluate import Run
    from frametool.stream.faults import BadRows, Fault
    from frametool.stream.rows import Block


def notes_of(run: Run, block: Block) -> list[RowNote]:
    """Return what is worth telling about the rows of a block, by line."""
    notes = [*run.rounded, *starmap(run.note_of_degrees, run.doubted[:1])]
    notes += [RowNote.of_lost_name(block.line_of(row), name) for row, name in block.lost]
    if run.plan.shapes and run.plan.shapes[0].notation is UPPER_ROWS and run.off > PROJECTED_IN_SILENCE:
        notes.append(RowNote(block.line_of(0), "projected", projection(run.off)))
    return sorted(notes)


class Outcome(NamedTuple):
    """What became of a block.

    text: what is written
    faults: the bad rows, by line from 0
    rows, lines, size: how many rows, lines and bytes the block had
    mended: how many rotations were off and normalised
    notes: what is worth telling
    kept: how many rows are in the text
    is_open: whether an array goes on behind the block; None for what is no array
    """

    text: bytes | memoryview
    faults: Sequence[Fault] = ()
    rows: int = 0
    lines: int = 0
    mended: int = 0
    notes: Sequence[RowNote] = ()
    size: int = 0
    kept: int = 0
    is_open: bool | None = None


def run(
    outcomes: Iterable[Outcome],
    write: Callable[[bytes | memoryview], None],
    bad: BadRows,
    advance: Callable[[int, int], None],
) -> int:
    """Write what becomes of each block, report its faults, and return the exit status.

    advance: is told rows and bytes done after each block.  Raises BadRow at the first fault if that is the rule.
    """
    line, rows, mended = 1, 0, 0
    told: set[str] = set()
    zone = ""
    for outcome in outcomes:
        if outcome.text:
            write(outcome.text)
        advance(outcome.rows, outcome.size)
        faults = [fault._replace(line=fault.line + line) for fault in outcome.faults]
        for note in outcome.notes:  # in the order of the lines
            if note.about == ZONES:
                before, zone = zone or note.sentence, note.sentence
                if before == zone:
                    continue
                sentence = f"the zone changes from {before} to {zone}: another grid; --zone {before} holds one"
                note = note._replace(sentence=sentence)  # noqa: PLW2901
            if note.about in told:
                continue
            told.add(note.about)
            bad.take(fault for fault in faults if fault.line < line + note.line)
            faults = [fault for fault in faults if fault.line >= line + note.line]
            warn(f"{bad.place(line + note.line, note.column)}: {note.sentence}")
        bad.take(faults)
        line, rows, mended = line + outcome.lines, rows + outcome.rows, mended + outcome.mended
    tell_of_rounding(bad.source, mended, rows)
    return bad.finish(rows)


def tell_of_rounding(source: str, count: int, rows: int) -> None:
    """Tell at the end of a stream how many rotations were normalised, of which the first was told of."""
    if count > 1:
        warn(f"{source}: {count} of {rows} rotations were off by more than 1e-6 and were normalised")
