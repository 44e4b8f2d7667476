"""Records one by one, with plain floats: what each is asked, and the numbers and names of its result.

For the few records of a typed line, of an argument or of a document, without numpy; `evaluate` does the same for
blocks of rows.  Knows no text but that of stamps.
"""

from __future__ import annotations

from math import isfinite, isinf
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import Finding, FrametoolError, ValueInvalid
from frametool.geometry import floats
from frametool.grammar.names import STAMP_KEYS, in_nanoseconds
from frametool.grammar.readers import Misfit, Reading, within
from frametool.stream.record import find_records, lost_name, placed
from frametool.stream.row_layout import FLAT, LEAVES_PLANE, checked_rotation
from frametool.stream.splice import target_of
from frametool.stream.stamp_source import key_path, read_header_stamp, read_stamp, stamp_keys

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.documents.document import Document
    from frametool.documents.source import Source
    from frametool.geometry.types import Components, Rigid
    from frametool.grammar.readers import Path
    from frametool.stream.record import Record
    from frametool.stream.request import Operation, Request
    from frametool.stream.row_layout import Target

SIX_BY_SIX = 36  # entries of the covariance of a pose


class Outside(FrametoolError):
    """Report a record whose time is not wanted, which is left out without a word."""

    kind = "outside"


class Entry(NamedTuple):
    """One record of a text and what is asked of it.

    target: how its result is written
    edge: the pose that moves it; None if absent, or where its own time decides
    stamp: the paths of that time, or of what else comes with it: one, or seconds and nanoseconds
    parent, name: the frames of its result
    lost: a frame that the record names and the result cannot
    """

    record: Record
    target: Target
    edge: Rigid | None
    stamp: tuple[Path, ...] = ()
    parent: str | None = None
    name: str | None = None
    lost: str = ""


class Answer(NamedTuple):
    """What became of a record: the components of its result; has_gaps: numbers of it may be nan."""

    entry: Entry
    parts: Components
    has_gaps: bool = False


def read_entries(
    document: Document, request: Request, source: Source, note: Callable[[list[Finding]], object]
) -> list[Entry]:
    """Read the records of a document, and what each is asked; what is invalid about them goes to `note`.

    Raises FormatError with the place of a record that cannot be read.
    """
    reading = Reading(source, degrees=request.degrees, normalize=request.normalize, earth=request.earth)
    try:
        records = list(find_records(document.value, request, reading, (document.index,)))
        note([_at_its_number(each, records) for each in reading.notes])
        return [_entry(document, record, request) for record in records]
    except Misfit as misfit:
        error = placed(misfit, source)
        error.column_name = ".".join(map(str, misfit.path[1:]))  # type: ignore[attr-defined]
        raise error from misfit


def _at_its_number(note: Finding, records: Sequence[Record]) -> Finding:
    """Return a note about a rotation with the place of the first of its numbers, as blocks of rows have it."""
    found = (each for each in records if note.rule == "rounded" and each.path == note.path and each.shape.notation)
    record = next(found, None)
    path = record and record.numbers[record.shape.rotation_at[0]]
    return note._replace(path=path) if path else note


def _entry(document: Document, record: Record, request: Request) -> Entry:
    """Find the pose that moves a record, or the stamp at which it is looked up; check the frames it names."""
    stamp: tuple[Path, ...] = ()
    edge = None
    timed = request.timed
    if timed is not None and timed.name:
        stamp = (_extra(key_path, document, record, timed.name),)
    elif timed is not None and record.stamps and timed.moves(record.parent.text):
        stamp = record.stamps[:2]
    elif timed is not None and request.operation.formula is not None and not request.operation.shown:
        stamp = (_extra(stamp_keys, document, record),)
    elif request.extra_column is not None:
        stamp = _extra_path(document, record, request.extra_column)
    elif request.pose_from_frame is not None:
        edge = request.pose_from_frame(record.parent.text)
    request = request.for_kind(record.shape.kind)
    parent, name = record.parent.text, record.name.text
    if request.rename is not None:
        parent, name = request.rename(parent, name)
    return Entry(record, target_of(record, request), edge, stamp, parent, name, lost_name(record, request))


def _extra_path(document: Document, record: Record, name: str) -> tuple[Path, ...]:
    """Find what comes with a record under a key; "" is the stamp of its header, or else under a usual key."""
    if name:
        return (_extra(key_path, document, record, name),)
    try:
        return record.stamps[:2] or (_extra(stamp_keys, document, record),)
    except Misfit:
        usual = ", ".join(STAMP_KEYS)
        raise Misfit(f"no stamp: neither a header nor {usual}; give --time-column", record.path) from None


def _extra(find: Callable[..., Path], document: Document, record: Record, *name: str) -> Path:
    """Find a scalar around a record; raises Misfit."""
    return (document.index, *within((document.index,), find, document.value, record.path[1:], *name))


def answer(entry: Entry, values: Sequence[float], stamp: Sequence[str], request: Request) -> Answer:
    """Return what becomes of a record.

    values: its numbers; stamp: the texts of its own time
    Raises ValueInvalid for what is no rotation, FrametoolError where there is no pose at its time.
    """
    operation, shape, timed = request.operation, entry.record.shape, request.timed
    edge, at_ns = entry.edge, None
    if stamp and (timed is not None or request.window):
        try:
            at_ns = _stamp_ns(entry, stamp)
            if timed is not None and (operation.formula is None or operation.shown):
                edge = timed.pose(entry.record.parent.text, at_ns)
        except FrametoolError as error:
            error.column_name = timed.column if timed else str(entry.stamp[0][-1])  # type: ignore[attr-defined]
            raise
    if request.window and at_ns is not None and not request.window[0] <= at_ns <= request.window[1]:
        raise Outside("beyond --start or --stop")
    parts = operation.result(
        shape, tuple(values), edge, floats,
        rotation=lambda own: checked_rotation(shape, own, normalize=request.normalize)[0],
        compared=lambda pose: [pose], seconds=float, times_ns=at_ns,
    )  # fmt: skip
    return Answer(entry, parts, has_gaps=operation.shown is not None)


def wide_turn(made: Answer, operation: Operation) -> Finding | None:
    """Return a warning of a turn that is too uncertain for the first order; of what moves others it comes elsewhere."""
    record = made.entry.record
    if operation.uncertain or len(operation.carried(record.shape)) < SIX_BY_SIX:
        return None
    from frametool.geometry.uncertainty import WIDE_RULE, doubt

    message = doubt(made.parts[-SIX_BY_SIX:])
    return Finding(WIDE_RULE, message, path=record.path) if message else None


def _stamp_ns(entry: Entry, texts: Sequence[str]) -> int:
    if len(texts) > 1:
        return read_header_stamp(*texts)
    return read_stamp(texts[0], in_ns=in_nanoseconds(str(entry.stamp[0][-1])))


def written(each: Answer) -> list[float]:
    """Return the numbers of a result as they are written; raises ValueInvalid for one that leaves the plane."""
    target = each.entry.target
    for name, number in target.left_out(each.parts, floats):
        if abs(number) > FLAT:
            raise ValueInvalid(LEAVES_PLANE.format(name, number))
    if target.place is not None:
        target.place.check_result(*each.parts[:3])
    numbers = [number + 0.0 for number in target.written(each.parts, floats)]  # none is -0.0
    if not all(map(isfinite, numbers)) and (not each.has_gaps or any(map(isinf, numbers))):
        raise ValueInvalid("the result is not finite: the numbers are too large")
    return numbers


def number_writer(precision: int | None, *, yaml: bool) -> Callable[[float], str]:
    """Return what writes a number as the bulk of a stream does."""
    if precision is not None:
        return lambda value: f"{value:z.{precision}f}"
    if not yaml:
        return repr

    def write(value: float) -> str:
        text = repr(value)
        return text if "e" not in text or "." in text else text.replace("e", ".0e")

    return write
