"""One record of a stream alone: learned from, its text with the result in it, or with nulls in the place of numbers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.document import locate_many
from frametool.documents.source import Source
from frametool.errors import FormatError, FrametoolError
from frametool.ros.message_stream import NOISE
from frametool.stream.answers import number_writer, written
from frametool.stream.faults import ZONES, Fault, RowNote
from frametool.stream.template import learn, nulled

if TYPE_CHECKING:
    from frametool.stream.request import Request
    from frametool.stream.splitter import Part
    from frametool.stream.template import Template

_ODD_START = re.compile(r"^(?=[A-Z\t\[\d$^])", re.MULTILINE)  # no key that ROS prints begins so


class Rendered(NamedTuple):
    """The text of a result, how many rotations were normalised for it, and what is worth telling."""

    text: bytes
    mended: int
    notes: list[RowNote]


def column_in(text: bytes, place: int) -> int:
    """Return the column, from 1, at which a place stands in its line."""
    return len(text[text.rfind(b"\n", 0, place) + 1 : place].decode("utf-8", "replace")) + 1


def rendered(template: Template, request: Request, line: int, column: int) -> Rendered | Fault:
    """Return the text of a record's result, or why there is none.

    line, column: where the record begins; lines count from 0
    """
    try:
        answers = template.answers(request)
        numbers = [number for each in answers for number in written(each)]
    except FrametoolError as error:
        return Fault.of(line + template.line, getattr(error, "column_name", ""), error)
    write = number_writer(request.precision, yaml=not template.json)
    text = template.with_numbers([write(number) for number in numbers])
    mended = sum(each.mended for each in answers)
    notes = _notes(template, line, column)
    if (place := answers[0].entry.target.place if answers else None) is not None:
        from frametool.geometry.transverse_mercator import ZONES as ZONE_NAMES

        zones = (ZONE_NAMES[int(numbers[at])] for at in place.words)
        notes += [RowNote(line + template.line, ZONES, zone) for zone in zones]
    return Rendered(text.encode(), mended, notes)


def _notes(template: Template, line: int, column: int) -> list[RowNote]:
    """Return what is worth telling about a record and its numbers, each with its place."""
    own = template.own_notes
    begin = Source("", template.text, line, column)
    places = [begin.place(*each) for each in locate_many(template.text, [note.path for note in own])]
    found = [RowNote(at, note.rule, note.message, str(there)) for note, (at, there) in zip(own, places, strict=True)]
    known = {note.about for note in found}
    others = [each for each in template.notes if each.about not in known]
    return sorted(found + [each._replace(line=line + template.line) for each in others])


def null_of(record: bytes, *, json: bool) -> bytes:
    """Return what stands for a record without a result: its keys with null in the place of ours, or null."""
    body = record.rstrip(b"\r\n")
    try:
        text = nulled(body.decode(), json=json)
    except UnicodeDecodeError:
        text = None
    return (b"null" if text is None else text.encode()) + record[len(body) :]


def attempt(text: bytes, part: Part, form: str, request: Request, source: str, line: int) -> Template | bytes | Fault:
    """Learn from a record; return its text where nothing is in it, or say what is wrong.

    line: where the record begins, counted from 0
    """
    if part.problem:
        return Fault(line, "", part.problem, final=part.final)
    record = text[part.start : part.end]
    try:
        decoded = _decoded(record, source, line)
        if form == "yaml" and _ODD_START.search(decoded):
            decoded = without_noise(decoded)
        return learn(decoded, request, json=form == "json", source=source, line=line + 1) or record
    except FormatError as error:
        column = getattr(error, "column_name", "") or (str(error.column) if error.column else "")
        return Fault(max(error.line, 1) - 1, column, error.message, kind=error.kind)
    except FrametoolError as error:
        return Fault.of(line, getattr(error, "column_name", ""), error)


def without_noise(text: str) -> str:
    """Blank the lines that the echo tools print between messages."""
    return "\n".join("" if NOISE(line.rstrip("\r")) else line for line in text.split("\n"))


def _decoded(text: bytes, source: str, line: int) -> str:
    try:
        return text.decode()
    except UnicodeDecodeError as error:
        problem = f"not UTF-8 text: byte 0x{text[error.start]:02x}"
        raise FormatError(problem, source=source, line=line + 1 + text.count(b"\n", 0, error.start)) from None
