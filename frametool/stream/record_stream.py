"""JSON and YAML records as streams: each keeps its spelling and all its other keys, byte for byte."""

from __future__ import annotations

import re
from contextlib import suppress
from io import BufferedReader
from itertools import chain
from typing import TYPE_CHECKING

from frametool import sizes
from frametool.errors import FormatError, FrametoolError
from frametool.stream import stamp_source
from frametool.stream.answers import Outside
from frametool.stream.faults import SKIP, STOP, Fault, Outcome, RowNote
from frametool.stream.record_text import Rendered, attempt, column_in, null_of, rendered
from frametool.stream.splitter import ARRAY, NO_END, Splitter
from frametool.text.lines import Pieces, read_blocks

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator

    from frametool.stream.request import Request
    from frametool.stream.splitter import Part
    from frametool.text.lines import ByteStream

_LEADING_COMMA = re.compile(rb"\A((?:\xef\xbb\xbf)?\s*\[?\s*),\s*")


def run_records(stream: ByteStream, form: str, request: Request, *, source: str) -> Generator[Outcome]:
    """Yield the outcomes of a stream of records."""
    splitter = Splitter(form)
    outcomes = _outcomes(stream, splitter, form, request, source=source)
    yield from _as_array(outcomes, request.on_error) if form == "json" else outcomes


def _outcomes(
    stream: ByteStream, splitter: Splitter, form: str, request: Request, *, source: str
) -> Generator[Outcome]:
    blocks = read_blocks(stream, whole=splitter.whole)
    first = next(blocks, None)
    if first is None:
        return
    second: bytes | None = b""
    if len(first) < sizes.SMALL and _has_ended(stream):
        try:
            second = next(blocks, None)
        except FormatError as error:  # comes behind the results of what is whole
            blocks = _raising(error)
    few = second is None and not request.in_order
    if few and len((found := splitter.parts(first)).parts) <= sizes.FEW:
        outcome = _singly(first, found.parts, form, request, source)
        yield outcome._replace(is_open=None if splitter.layout != ARRAY else not found.closed)
        return
    from frametool.stream.record_blocks import RecordBlocks

    process = RecordBlocks(splitter, form, request, source)
    begun = [first, second] if second else [first]
    yield from map(process, chain(begun, blocks))


def _raising(error: FormatError) -> Iterator[bytes]:
    """Yield nothing and raise an error."""
    raise error
    yield b""


def at_other_times(stream: ByteStream, form: str, offset_ns: int) -> BufferedReader:
    """Return a stream of records with so much added to all stamps in them; a record that cannot be read stays."""

    def pieces() -> Iterator[bytes]:
        splitter = Splitter(form)
        for block in read_blocks(stream, whole=splitter.whole):
            edits = []
            for part in splitter.parts(block).parts:
                with suppress(FrametoolError, UnicodeDecodeError):
                    moved, _ = stamp_source.at_other_times(block[part.start : part.end].decode(), offset_ns)
                    edits.append((part.start, part.end, moved.encode()))
            yield stamp_source.replaced(block, edits)

    return BufferedReader(Pieces(filter(None, pieces())))


def _has_ended(stream: ByteStream) -> bool:
    """Tell whether a stream has nothing more to come, or will have within a moment."""
    import select

    try:
        poll = select.poll()
        poll.register(stream.fileno(), select.POLLIN | select.POLLHUP)
    except (AttributeError, OSError, ValueError):
        return True
    return bool(poll.poll(20))


def _as_array(outcomes: Iterable[Outcome], on_error: str) -> Iterator[Outcome]:
    """Let no comma stand before the first record that is left, and make the lack of the closing bracket a fault.

    What stands before that record is held back: where the first one is an error nothing is written.
    """
    any_kept, is_open, ended = False, None, True
    held = b""
    for outcome in outcomes:
        is_open = outcome.is_open if is_open is not False else False
        text = held + outcome.text
        if outcome.is_open is not None and not any_kept and outcome.kept:
            text = _LEADING_COMMA.sub(rb"\1", text)
        if ends := outcome.is_open and on_error != STOP and any(fault.final for fault in outcome.faults):
            text += b"]\n"
        any_kept = any_kept or bool(outcome.kept or ends)
        ended = text.endswith(b"\n") if text else ended
        held = b"" if any_kept or outcome.is_open is None else text
        yield outcome._replace(text=text[len(held) :])
    if held and not (is_open and on_error == STOP):
        yield Outcome(held, ())
    if is_open:
        fault = Fault(-1 if ended else 0, "", NO_END)
        yield Outcome(b"" if on_error == STOP else b"]\n", (fault,))


def _singly(text: bytes, parts: list[Part], form: str, request: Request, source: str) -> Outcome:
    """Return the outcome of the few records of a whole stream."""
    out: list[bytes] = []
    faults: list[Fault] = []
    notes: list[RowNote] = []
    at = mended = kept = 0
    for part in parts:
        out.append(text[at : part.begin])
        at = part.after
        line = text.count(b"\n", 0, part.start)
        template = attempt(text, part, form, request, source, line)
        made = template if isinstance(template, (Fault, bytes)) else rendered(
            template, request, line, column_in(text, part.start)
        )
        if isinstance(made, Rendered):
            mended += made.mended
            notes += made.notes
            made = made.text
        if isinstance(made, Fault) and made.kind == Outside.kind:
            continue
        if isinstance(made, Fault):
            faults.append(made)
            if request.on_error == STOP:
                at = len(text)
                break
            if request.on_error == SKIP or made.final:
                continue
            made = null_of(text[part.start : part.end], json=form == "json")
        kept += 1
        out += [text[part.begin : part.start], made, text[part.end : part.after]]
    out.append(text[at:])
    return Outcome(b"".join(out), faults, len(parts), text.count(b"\n"), mended, notes, len(text), kept)
