"""Every message of a recording in text, one after the other, whatever form it is in: bounded memory, any length.

Forms are those of `frametool.formats.FORMATS`. A message is plain values, as the document reader gives them.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.chunks import Piece, counted_from, documents, lines
from frametool.documents.document import parse_documents
from frametool.documents.json_reader import strict_json
from frametool.documents.source import Source, check_text
from frametool.errors import FormatError
from frametool.grammar.readers import Misfit
from frametool.ros import topic_csv
from frametool.ros.noise import NOISE

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

    from frametool.grammar.edges import Tally

_SEPARATOR = re.compile(r"^.*---[ \t]*$\n?", re.MULTILINE)
_ODD_START = re.compile(r"^(?=[A-Z\t\[\d$^\ufeff])", re.MULTILINE)  # no key that ROS prints begins so


class Message(NamedTuple):
    """The plain values of one message, with the text they stand in and the number of its first line."""

    value: Any
    source: Source
    line: int
    document: int = 0
    cells: bool = False
    received_ns: int | None = None

    def error(self, misfit: Misfit) -> FormatError:
        """Make the error for what does not fit in this message, placed in the whole file."""
        if self.cells:
            error = FormatError(str(misfit), source=self.source.name, line=1, rule=misfit.rule)
        else:
            error = misfit.placed(self.source, self.document)
        error.line += self.line - 1
        return error


def read_messages(stream: BinaryIO, name: str, form: str, tally: Tally) -> Iterator[Message | FormatError]:
    """Yield the messages of a recording; where one cannot be read the error stands in its place."""
    if form == "echo":
        for piece in documents(stream, name):
            yield from document_messages(piece, name, tally)
    elif form == "jsonl":
        for piece in lines(stream, name):
            for number, line in enumerate(piece.text.split("\n"), piece.line):
                yield from line_messages(line, number, name, tally)
    else:
        yield from _csv(stream, name, form, tally)


def document_messages(piece: Piece, name: str, tally: Tally) -> Iterator[Message | FormatError]:
    """Yield the messages of documents that end in `---`."""
    at, line = 0, piece.line
    while at < len(piece.text):
        end = end_of_document(piece.text, at)
        text = piece.text[at:end]
        yield from _parsed(without_noise(text, line, tally), line, name)
        line += text.count("\n")
        at = end


def end_of_document(text: str, at: int) -> int:
    """Return the offset behind the next line that ends in `---`, or the end of the text."""
    separator = _SEPARATOR.search(text, at)
    return separator.end() if separator else len(text)


def without_noise(text: str, line: int, tally: Tally) -> str:
    """Blank the lines that are known to be no data; the others keep their numbers."""
    if _ODD_START.search(text) is None:
        return text
    kept = text.split("\n")
    for index, each in enumerate(kept):
        if NOISE(each.rstrip("\r")):
            tally.noise.append((line + index, each.strip()))
            kept[index] = "---" if each.endswith("---") else ""
    return "\n".join(kept)


def _parsed(text: str, line: int, name: str) -> Iterator[Message | FormatError]:
    """Read the documents of a text whose first line has this number."""
    try:
        with counted_from(line):
            found = parse_documents(text, name)
    except FormatError as error:
        yield error
        return
    for document in found:
        yield Message(document.value, Source(name, text), line, document.index)


def line_messages(text: str, line: int, name: str, tally: Tally) -> Iterator[Message | FormatError]:
    """Yield the messages on a line that must be JSON, if it is neither blank nor noise."""
    if not _is_data(text, line, tally):
        return
    source = Source(name, text.removeprefix("\ufeff"))
    try:
        with counted_from(line):
            check_text(source)
            values = strict_json(source)
    except FormatError as error:
        yield error
        return
    for index, value in enumerate(values):
        yield Message(value, source, line, index)


def line_texts(stream: BinaryIO, name: str, tally: Tally) -> Iterator[tuple[int, str]]:
    """Yield the lines that are neither blank nor noise, with their numbers."""
    for piece in lines(stream, name):
        for number, line in enumerate(piece.text.split("\n"), piece.line):
            if _is_data(line, number, tally):
                yield number, line


def _is_data(line: str, number: int, tally: Tally) -> bool:
    """Tell whether a line is neither blank nor noise; count what is noise."""
    if NOISE(line):
        tally.noise.append((number, line.strip()))
        return False
    return bool(line.strip())


def _csv(stream: BinaryIO, name: str, form: str, tally: Tally) -> Iterator[Message | FormatError]:
    """Read rows; a line that begins with `%time` is the header of those below it."""
    header: list[str] = []
    for number, line in line_texts(stream, name, tally):
        cells = line.split(",")
        if cells[0] == "%time":
            header = cells
            continue
        try:
            value = topic_csv.message1(cells, header) if form == "csv1" else topic_csv.message2(cells)
        except Misfit as misfit:
            yield FormatError(str(misfit), source=name, line=number)
            continue
        received = int(cells[0]) if form == "csv1" and cells[0].isdecimal() else None
        yield Message(value, Source(name, line), number, cells=True, received_ns=received)
