"""A block of rows: numbers in, the operation, numbers out, and the text put together again around them.

Knows no syntax: what a format found is spans of text, what it wants written is a list of pieces.
"""

from __future__ import annotations

from operator import itemgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import FrametoolError, ValueInvalid
from frametool.stream.layout import Const, IfLocked, In, Instead, Out, Piece, Word
from frametool.text.cells import without_quotes
from frametool.text.spans import MARGIN, Floats, Ints, Spans, framed, join
from frametool.text.write import fixed_spans, replaced, shortest_spans

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from frametool.stream.faults import Fault


class BlockNames(NamedTuple):
    """The names of a block's rows.

    pairs, results: the parents and names that there are, and those of their results; of_row: (n,) those of a row
    lost: the first row whose result cannot name a frame: that frame
    """

    pairs: Sequence[tuple[str, str]] = (("", ""),)
    results: Sequence[tuple[str, str]] = (("", ""),)
    of_row: Ints | None = None
    lost: Mapping[int, str] = MappingProxyType({})

    def texts(self, role: int, rows: Ints) -> list[str | None]:
        """Return the parents (0) or names (1) of the results of rows, or one for all."""
        texts = [pair[role] or None for pair in self.results]
        return texts if len(texts) == 1 or self.of_row is None else [texts[at] for at in self.of_row[rows].tolist()]


class Block(NamedTuple):
    """What a format found in a block of text.

    numbers: (n, c) the cells with our numbers, or the numbers themselves
    parts: spans (n,) that pieces refer to
    places: (n,) where each row is among all that the block holds
    line_of: the line of a row, from 0
    unchanged: place and text of what passes as it is
    broken: place and fault of rows that no number can be read from
    names: those of the rows, and of their results
    stamps: for each shape (or one for all) the nanoseconds, None where it has none; of gathered rows weights or labels
    bad: rows that are bad by what is no number: column and reason
    frames: for each shape (or one for all) the name of the frame each row is expressed in, or one for all rows; for
        look-ups the two names, parted by NUL
    place_of: line, from 0, and column, from 1, of one of a row's numbers, where columns have no names
    gone: rows that have no numbers on purpose, and no result
    """

    numbers: Spans | Floats
    parts: Sequence[Spans]
    places: Ints
    line_of: Callable[[int], int]
    unchanged: Sequence[tuple[int, bytes]] = ()
    broken: Sequence[tuple[int, Fault]] = ()
    names: BlockNames = BlockNames()
    stamps: Sequence[Any] = ()
    bad: Mapping[int, tuple[str, FrametoolError | str]] = MappingProxyType({})
    place_of: Callable[[int, int], tuple[int, str]] | None = None
    frames: Sequence[Sequence[str | None]] = ((None,),)
    gone: Ints | None = None


class Coded(NamedTuple):
    """A column of texts as the distinct ones and the number of each row's."""

    texts: Sequence[str]
    codes: Ints

    def numbers(self, read: Callable[[str], float]) -> tuple[Floats, dict[int, str]]:
        """Read the number that each encodes, nan if none, and why a row has none."""
        known = np.full(len(self.texts), np.nan)
        reasons = read_each(known, range(len(known)), lambda at: read(self.texts[at]))
        return known[self.codes], {row: reasons[at] for row, at in enumerate(self.codes.tolist()) if at in reasons}

    def each(self) -> list[str]:
        """Return the text of each row."""
        return [self.texts[code] for code in self.codes.tolist()]


def read_each(values: NDArray[Any], places: Iterable[int], read: Callable[[int], float]) -> dict[int, str]:
    """Set the values at some places to what is read there, one by one; return why some have none."""
    reasons = {}
    for place in places:
        try:
            values[place] = read(place)
        except (ValueInvalid, OverflowError) as error:
            reasons[place] = str(error)
    return reasons


def coded(cells: Spans) -> Coded:
    """Read cells (n,), not none, as texts; where all are the same, as frames often are, that is one text."""
    column, rows = without_quotes(cells), len(cells.starts)
    if _is_constant(column):
        return Coded([_text(column.text(0))], np.zeros(rows, np.int64))
    data = column.data.tobytes()
    spans = zip(column.starts.tolist(), column.ends.tolist(), strict=True)
    return coded_texts([data[start:end] for start, end in spans], _text)


def coded_texts(cells: Sequence[Any], text: Callable[[Any], str] = str) -> Coded:
    """Return cells as the distinct texts and the number of each."""
    known, codes = numbered(cells)
    return Coded([*map(text, known)], codes)


def numbered(values: Sequence[Any]) -> tuple[dict[Any, int], Ints]:
    """Return the distinct ones of some values, numbered, and the number of each."""
    known: dict[Any, int] = {}
    return known, np.fromiter((known.setdefault(each, len(known)) for each in values), np.int64, len(values))


def _text(cell: bytes) -> str:
    return cell.decode("utf-8", "replace").strip().replace('""', '"')


def _is_constant(column: Spans) -> bool:
    """Return True if all cells hold the same bytes."""
    length = int(column.ends[0] - column.starts[0])
    if length > MARGIN or (column.ends - column.starts != length).any():
        return False
    first = column.data[column.starts[0] : column.ends[0]]
    return all(bool((column.data[column.starts + offset] == byte).all()) for offset, byte in enumerate(first))


def number_spans(
    values: Floats, precision: int | None, separators: bytes, *, yaml: bool = False, null: bytes = b"nan"
) -> Spans:
    """Write floats as fixed decimals or as the shortest text that reads back; YAML wants a point before an exponent.

    nan is an empty cell, where `null` is that.
    """
    if not null and (gaps := np.isnan(values)).any():
        spans = number_spans(np.where(gaps, 0.0, values), precision, separators)
        return spans._replace(starts=np.where(gaps, spans.ends - 1, spans.starts))
    if precision is not None:
        return fixed_spans(values, precision, separators)
    spans = shortest_spans(values, separators)
    return _with_points(spans, values, separators) if yaml else spans


def _with_points(spans: Spans, values: Floats, separators: bytes) -> Spans:
    """Write 1e-05 as 1.0e-05."""
    size, shape = abs(values), values.shape
    far = np.flatnonzero(((size < 1e-4) & (size > 0.0)) | (size >= 1e16))
    texts = [text if "." in text else text.replace("e", ".0e") for text in map(repr, values.ravel()[far].tolist())]
    ended = [text + chr(separators[place % len(separators)]) for text, place in zip(texts, far.tolist(), strict=True)]
    data, starts, ends = replaced(Spans(spans.data, spans.starts.ravel(), spans.ends.ravel()), far, ended)
    return Spans(data, starts.reshape(shape), ends.reshape(shape))


def separators(pieces: Iterable[Piece]) -> bytes:
    """Return the character that follows each number of the result that pieces show."""
    after = bytearray()
    for piece in pieces:
        if isinstance(piece, Out):
            after += b"," * (piece.last - len(after))
            after[piece.first : piece.last] = (piece.between[:1] or b",") * (piece.last - piece.first)
    return bytes(after)


def assemble(
    pieces: Sequence[Piece], parts: Sequence[Spans], values: Spans | None, locked: Ints, results: Floats | None = None
) -> list[Spans]:
    """Return the spans, in order, that make up the rows.

    values: the texts of the results; locked: (n,) 1 where angles are not unique
    """
    found = []
    for piece in pieces:
        if isinstance(piece, (In, Instead)):
            found.append(parts[piece.part if isinstance(piece, In) else piece.new])
        elif isinstance(piece, Out) and values is not None:
            found += _numbers(values, piece)
        elif isinstance(piece, Word) and results is not None:
            found.append(worded(results[:, piece.number], piece))
        else:
            text = constant(piece.text if isinstance(piece, (Const, IfLocked)) else b"", len(locked))
            shown = text.starts + locked * (text.ends - text.starts) if isinstance(piece, IfLocked) else text.ends
            found.append(text._replace(ends=shown))
    return found


def _numbers(values: Spans, piece: Out) -> list[Spans]:
    """Return the spans of neighbouring numbers, with what is between them."""
    own = slice(piece.first, piece.last)
    starts, ends = values.starts[:, own], values.ends[:, own].copy()
    if len(piece.between) == 1:
        ends[:, -1] -= 1
        return [Spans(values.data, starts, ends)]
    between = constant(piece.between, len(ends))
    each = [Spans(values.data, start, end) for start, end in zip(starts.T, ends.T - 1, strict=True)]
    return [each[0], *(part for number in each[1:] for part in (between, number))]


def worded(numbers: Floats, piece: Word) -> Spans:
    """Return the words that numbers (n,) stand for."""
    counts = type(piece) is Word
    found, of_row = (np.arange(len(piece.words)), numbers) if counts else np.unique(numbers, return_inverse=True)
    return chosen(spans_of([*map(piece.text, found.tolist())]), of_row.astype(np.int64))


def constant(text: bytes, size: int) -> Spans:
    """Return one text for so many rows."""
    starts = np.full(size, MARGIN, np.int64)
    return Spans(framed(text), starts, starts + len(text))


def chosen(spans: Spans, rows: Ints) -> Spans:
    """Keep some rows."""
    return Spans(spans.data, spans.starts[rows], spans.ends[rows])


def texts_as_rows(unchanged: Sequence[tuple[int, bytes]]) -> tuple[Ints, list[Spans]]:
    """Return texts as rows in the order of their places."""
    unchanged = sorted(unchanged, key=itemgetter(0))
    return np.array([place for place, _ in unchanged], np.int64), [spans_of([text for _, text in unchanged])]


def spans_of(texts: list[bytes]) -> Spans:
    """Return texts, one a row, as spans."""
    lengths = np.fromiter(map(len, texts), np.int64, len(texts))
    ends = np.cumsum(lengths) + MARGIN
    return Spans(framed(b"".join(texts)), ends - lengths, ends)


def written(groups: Sequence[tuple[Ints, list[Spans]]]) -> bytes:
    """Put the rows of all groups in the order of their places."""
    if len(groups) < 2:
        return join(groups[0][1]) if groups else b""
    places = np.concatenate([each for each, _ in groups])
    rows = [_finished(spans) for _, spans in groups]
    offsets = np.cumsum([0, *(len(each.data) for each in rows)])[:-1].tolist()
    order = np.argsort(places, kind="stable")
    starts = np.concatenate([each.starts + offset for each, offset in zip(rows, offsets, strict=True)])
    ends = np.concatenate([each.ends + offset for each, offset in zip(rows, offsets, strict=True)])
    return join([Spans(np.concatenate([each.data for each in rows]), starts[order], ends[order])])


def _finished(spans: list[Spans]) -> Spans:
    """Join the spans of each row, and give the rows as spans of the joined text."""
    if len(spans) == 1 and spans[0].starts.ndim == 1:
        return spans[0]
    lengths = sum((part.ends - part.starts).reshape(len(part.starts), -1).sum(axis=1) for part in spans)
    ends = np.cumsum(lengths) + MARGIN
    return Spans(framed(join(spans)), ends - lengths, ends)
