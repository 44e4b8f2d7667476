"""A block of rows: what a format found in it, names and stamps read in bulk, and the text of the results around them.

Knows no syntax: what a format found is spans of text, what it wants written is a list of pieces.  Stamps are decimal
seconds or nanoseconds, read as integer nanoseconds, never through a float.
"""

from __future__ import annotations

import re
from importlib import import_module
from math import isnan, nan
from operator import itemgetter
from types import MappingProxyType, NoneType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from frametool.documents.document import JSON_NUMBER
from frametool.documents.source import Verbatim
from frametool.documents.writers import dump_json
from frametool.errors import FrametoolError, NamedTuple, ValueInvalid
from frametool.frames.stamps import BILLION, read_header_stamp, read_stamp
from frametool.grammar.pose import SCALE, Pose
from frametool.grammar.readers import in_nanoseconds
from frametool.grammar.result import NoResult, Result, with_entries
from frametool.rows.shapes import AS_READ, MAPPINGS, NOWHERE, PARTS, POINT, POSE
from frametool.rows.sinks import IfLocked, In, Out, Piece, Word
from frametool.text.parse import FURTHEST, parse_stamps
from frametool.text.spans import MARGIN, Floats, Ints, Spans, framed, join, without_quotes
from frametool.text.write import float_spans, replaced, rounded_to_single

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from frametool.geometry import Components
    from frametool.geometry.place import Place, Spot
    from frametool.rows.faults import Fault
    from frametool.rows.plain import Value
    from frametool.rows.sinks.results import BlockResults

    Cells: TypeAlias = Spans | NDArray[Any]
    Frames: TypeAlias = tuple[str | None, str | None]


class Coded(NamedTuple):
    """A column of texts as the distinct ones and the number of each row's; without numbers one for all rows."""

    texts: Sequence[Any]
    codes: Ints | None = None

    def of_rows(self, size: int) -> Ints:
        """Return the number of the text of each of so many rows."""
        return np.zeros(size, np.int64) if self.codes is None else self.codes

    def each(self) -> list[str]:
        """Return the text of each row."""
        return [self.texts[code] for code in self.of_rows(1).tolist()]

    def numbers(self, read: Callable[[str], float]) -> tuple[Floats, dict[int, str]]:
        """Read the number that each encodes, nan if none, and why a row has none."""
        known = np.full(len(self.texts), np.nan)
        reasons = read_each(known, range(len(known)), lambda at: read(self.texts[at]))
        codes = self.of_rows(1)
        return known[codes], {row: reasons[at] for row, at in enumerate(codes.tolist()) if at in reasons}


ALL_ALIKE = Coded((None,))  # rows that name no frame


class BlockNames(NamedTuple):
    """The names of a block's rows.

    frames: those that the rows are expressed in; for look-ups the two names, parted by NUL
    pairs, results: the parents and names that there are, and those of their results; of_row: (n,) those of a row
    lost: the first row whose result cannot name a frame: that frame
    bad: rows whose names do not fit: column and reason
    """

    frames: Coded
    pairs: Sequence[tuple[str, str]] = (("", ""),)
    results: Sequence[tuple[str, str]] = (("", ""),)
    of_row: Ints | None = None
    lost: Mapping[int, str] = MappingProxyType({})
    bad: Mapping[int, tuple[str, FrametoolError | str]] = MappingProxyType({})

    def texts(self, role: int, rows: Ints) -> list[str | None]:
        """Return the parents (0) or names (1) of the results of rows, or one for all."""
        texts = [pair[role] or None for pair in self.results]
        return texts if len(texts) == 1 or self.of_row is None else [texts[at] for at in self.of_row[rows].tolist()]


class Block(NamedTuple):
    """What a format found in a block of text.

    numbers: (n, c) the cells with our numbers, or the numbers themselves
    parts: spans (n,) that pieces refer to by their keys
    places: (n,) where each row is among all that the block holds
    line_of: the line of a row, from 0
    unchanged: place and text of what passes as it is
    broken: place and fault of rows that no number can be read from
    names: those of the rows, and of their results
    stamps: for each shape (or one for all) the nanoseconds, None where it has none
    bad: rows that are bad by what is no number: column and reason
    frames: for each shape (or one for all) the name of the frame each row is expressed in
    place_of: line, from 0, and column, from 1, of one of a row's numbers, where columns have no names
    gone: rows that have no numbers on purpose, and no result
    """

    numbers: Spans | Floats
    parts: Mapping[Any, Spans]
    places: Ints
    line_of: Callable[[int], int]
    unchanged: Sequence[tuple[int, bytes]] = ()
    broken: Sequence[tuple[int, Fault]] = ()
    names: BlockNames = BlockNames(ALL_ALIKE)
    stamps: Sequence[Any] = ()
    bad: Mapping[int, tuple[str, FrametoolError | str]] = MappingProxyType({})
    place_of: Callable[[int, int], tuple[int, str]] | None = None
    frames: Sequence[Coded] = (ALL_ALIKE,)
    gone: Ints | None = None


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
    column = without_quotes(cells)
    if (only := one_text(column)) is not None:
        return Coded([_text(only)], np.zeros(len(cells.starts), np.int64))
    data = column.data.tobytes()
    spans = zip(column.starts.tolist(), column.ends.tolist(), strict=True)
    return coded_texts([data[start:end] for start, end in spans], _text)


def codes_of(cells: Cells) -> Coded:
    """Return cells (n,), not none, as the distinct texts of `texts_of` and the number of each row's."""
    return coded(cells) if isinstance(cells, Spans) else coded_texts(texts_of(cells))


def one_text(column: Spans) -> bytes | None:
    """Return the text that all cells (n,), not none, have; None where they differ, or are long."""
    first = column.text(0)
    if len(first) > MARGIN or (column.ends - column.starts != len(first)).any():
        return None
    return first if all((column.data[column.starts + at] == byte).all() for at, byte in enumerate(first)) else None


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


def number_spans(
    values: Floats, precision: int | None, separators: bytes, *, yaml: bool = False, null: bytes = b"nan"
) -> Spans:
    """Write floats as fixed decimals or as the shortest text that reads back; YAML wants a point before an exponent.

    nan is an empty cell, where `null` is that.
    """
    if not null and (gaps := np.isnan(values)).any():
        spans = number_spans(np.where(gaps, 0.0, values), precision, separators)
        return spans._replace(starts=np.where(gaps, spans.ends - 1, spans.starts))
    spans = float_spans(values, separators, precision)
    if precision is not None or not yaml:
        return spans
    size, shape = abs(values), values.shape
    far = np.flatnonzero(((size < 1e-4) & (size > 0.0)) | (size >= 1e16))  # 1e-05 is written as 1.0e-05
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
    pieces: Sequence[Piece], parts: Mapping[Any, Spans] | Sequence[Spans], results: Floats, locked: Ints,
    precision: int | None = None, *, yaml: bool = False, null: bytes = b"nan",
) -> list[Spans]:  # fmt: skip
    """Return the spans, in order, that make up the rows.

    results: (n, k) the numbers, as `number_spans` writes them
    locked: (n,) 1 where angles are not unique
    """
    found, size, after = list[Spans](), len(locked), separators(pieces)
    if after:
        values = number_spans(results[:, : len(after)], precision, after, yaml=yaml, null=null)
    for piece in pieces:
        if isinstance(piece, In):
            found.append(parts[piece.part])
        elif isinstance(piece, Out):
            own = slice(piece.first, piece.last)
            starts, ends = values.starts[:, own], values.ends[:, own].copy()
            if len(piece.between) == 1:
                ends[:, -1] -= 1
                found.append(Spans(values.data, starts, ends))
                continue
            each = [Spans(values.data, start, end) for start, end in zip(starts.T, ends.T - 1, strict=True)]
            found.append(each[0])
            for number in each[1:]:
                found += [constant(piece.between, size), number]
        elif isinstance(piece, Word):
            codes, of_row = np.unique(results[:, piece.number], return_inverse=True)
            found.append(chosen(spans_of([*map(piece.text, codes.tolist())]), of_row))
        else:
            text = constant(piece.text, size)
            shown = text.starts + locked * (text.ends - text.starts) if isinstance(piece, IfLocked) else text.ends
            found.append(text._replace(ends=shown))
    return found


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
    return _in_order(groups)


def _in_order(groups: Sequence[tuple[Ints, list[Spans]]]) -> bytes:
    """Join the spans of each row, and then the rows in the order of their places."""
    rows = []
    for _, spans in groups:
        if len(spans) == 1 and spans[0].starts.ndim == 1:
            rows.append(spans[0])
            continue
        lengths = sum((part.ends - part.starts).reshape(len(part.starts), -1).sum(axis=1) for part in spans)
        ends = np.cumsum(lengths) + MARGIN
        rows.append(Spans(framed(join(spans)), ends - lengths, ends))
    places = np.concatenate([each for each, _ in groups])
    offsets = np.cumsum([0, *(len(each.data) for each in rows)])[:-1].tolist()
    order = np.argsort(places, kind="stable")
    starts = np.concatenate([each.starts + offset for each, offset in zip(rows, offsets, strict=True)])
    ends = np.concatenate([each.ends + offset for each, offset in zip(rows, offsets, strict=True)])
    return join([Spans(np.concatenate([each.data for each in rows]), starts[order], ends[order])])


# --- stamps ---

def stamps_in(
    cells: Sequence[Spans], name: str, *, some_static: bool = False
) -> tuple[Ints | None, dict[int, tuple[str, str]]]:
    """Read the stamps of rows, and which rows have none.

    cells: as for `read_stamps`, or () for none; name: that of their column or key; some_static: they may be empty
    """
    if not cells:
        return None, {}
    stamps, reasons = read_stamps(cells, in_ns=in_nanoseconds(name) if len(cells) == 1 else 0)
    stamps[[*reasons]] = NO_STAMP
    if some_static:
        reasons = {row: reason for row, reason in reasons.items() if any(each.text(row).strip() for each in cells)}
    return stamps, {row: (name, reason) for row, reason in reasons.items()}


def read_stamps(cells: Sequence[Spans], *, in_ns: int) -> tuple[Ints, dict[int, str]]:
    """Read one column (n,) as nanoseconds, or two of whole seconds and nanoseconds.

    in_ns: how many nanoseconds a whole number of one column is; 0 are decimal seconds, and what ends in `ns` is some
    Gives the stamps, and why a row has none; what is not plainly written is read one by one.
    """
    parsed = [parse_stamps(each, in_ns=in_ns if len(cells) == 1 else 1) for each in cells]
    stamps, sure = parsed[0]
    if len(cells) == 2:
        stamps, sure = stamps * BILLION + parsed[1][0], sure & parsed[1][1] & (stamps < FURTHEST)

    def read(row: int) -> int:
        texts = [each.text(row).decode("utf-8", "replace") for each in cells]
        return read_header_stamp(*texts) if len(texts) == 2 else read_stamp(texts[0], in_ns=in_ns)

    return stamps, read_each(stamps, np.flatnonzero(~sure).tolist(), read)


# --- what became of rows: poses for trees and for other formats; single results as such blocks and back ---

NO_STAMP = np.iinfo(np.int64).min  # of a bad row that is kept, of a static one


class RowPoses(NamedTuple):
    """What became of the rows of a block: the good ones, in their order.

    numbers: (n, k) the results, position first; nan in a row without one that is kept
    stamps_ns: (n,) or None where rows have none; NO_STAMP in a row without a stamp
    lines: (n,) from 0
    parents, names: one a row, one for all, or none
    extras: columns that are not ours, by name: cells of text, numbers as they are, or objects (see `objects`)
    read: (n, 3) lat lon alt of positions on the Earth that nothing has moved, as they were read
    kind: what a row is: a pose, a point, ..; placed: poses have positions, which else are 0
    more: the names of the numbers that come behind those of the thing itself
    """

    numbers: Floats
    stamps_ns: Ints | None
    lines: Ints
    parents: Sequence[str | None]
    names: Sequence[str | None]
    extras: Mapping[str, Cells]
    read: Floats | None = None
    kind: str = POSE
    placed: bool = True
    more: tuple[str, ...] = ()

    def for_each(self, names: Sequence[str | None]) -> Sequence[str | None]:
        """Return parents or names, one a row."""
        return names if len(names) == len(self.numbers) else [*names] * len(self.numbers)

    def spot(self, row: int) -> Spot | None:
        """Return the place that a row was read as."""
        return None if self.read is None else _place().spot_of(self.read[row].tolist())

    def unmoved(self, parts: Components) -> Components:
        """Return the components of the rows with what they were read as, if it is known."""
        if self.read is None:
            return parts
        return _place().Unmoved(parts, _place().spot_of(np.ascontiguousarray(self.read.T)))  # type: ignore[no-any-return]


SOME_STAMPS = "some poses have a stamp and some have none; add it, or leave it out of all"
NO_ROWS = RowPoses(np.empty((0, 7)), None, np.empty(0, np.int64), (None,), (None,), {})


def _place() -> Any:
    return import_module("frametool.geometry.place")  # few rows are on the Earth


def kept(block: RowPoses, rows: slice | Ints) -> RowPoses:
    """Return some poses of a block."""
    at = np.arange(len(block.numbers))[rows]
    parents, names = (
        [each[row] for row in at.tolist()] if len(each) == len(block.numbers) else each
        for each in (block.parents, block.names)
    )
    return block._replace(
        numbers=block.numbers[rows],
        stamps_ns=None if block.stamps_ns is None else block.stamps_ns[rows],
        lines=block.lines[rows],
        read=None if block.read is None else block.read[rows],
        parents=parents,
        names=names,
        extras={name: taken(each, at) for name, each in block.extras.items()},
    )


def taken(cells: Any, rows: Ints) -> Cells:
    """Return some cells of a column; what is no number, truth value or time of numpy as plain values."""
    if isinstance(cells, Spans):
        return Spans(cells.data, cells.starts[rows], cells.ends[rows])
    if is_typed(cells):
        return cells[rows]  # type: ignore[no-any-return]
    from frametool.formats.rows.column_file import plain_value

    is_array = isinstance(cells, np.ndarray)
    return objects(map(plain_value, cells[rows].tolist() if is_array else [cells[row] for row in rows.tolist()]))


def is_typed(cells: Any) -> bool:
    """Return True if cells are numbers, truth values or times of numpy, one a row."""
    return isinstance(cells, np.ndarray) and cells.ndim == 1 and cells.dtype.kind in "fiubM"


def block_of(results: BlockResults, *, timed: bool = True, as_poses: bool = False) -> RowPoses:
    """Return results as one block of poses, points, vectors, twists or wrenches, with their places as lines.

    What a pose lacks is 0 or the identity; stamps that only some have are another column.
    timed: either all have a stamp, or none
    as_poses: a position without a rotation is a pose too, not a point; what a pose lacks is nan
    Raises ValueInvalid for things of several kinds, for other mappings, and for stamps that are missing.
    """
    if (alike := results.posed()) is not None:
        return alike
    if not (pairs := results.placed()):
        return NO_ROWS
    places, values = zip(*pairs, strict=True)
    rows = (_row_of(value, as_poses=as_poses) for value in values)
    kinds, numbers, frames, others = zip(*rows, strict=True)
    if len({*kinds}) > 1:
        raise ValueInvalid(f"one file holds things of one kind, found {' and '.join(sorted({*kinds}))}")
    parents, names = (each[:1] if len({*each}) == 1 else each for each in zip(*frames, strict=True))
    keys = dict.fromkeys(key for other in others for key in other)
    columns = {key: [other.get(key) for other in others] for key in keys}
    stamps, read = columns.get("stamp_ns", [None]), columns.pop(AS_READ, [None])
    if timed and None in stamps and "stamp_ns" in columns:
        raise ValueInvalid(SOME_STAMPS)
    stamps_ns = np.array(columns.pop("stamp_ns"), np.int64) if all(type(stamp) is int for stamp in stamps) else None
    return RowPoses(
        np.array(numbers, np.float64) + 0.0, stamps_ns, np.array(places, np.int64), parents, names,  # none is -0.0
        {key: objects(column) for key, column in columns.items()},
        None if None in read else np.array(read, np.float64), kinds[0],
        placed=not all(isinstance(value, Result) and value.pose.position is None for value in values),
    )  # fmt: skip


def _row_of(value: Value, *, as_poses: bool) -> tuple[str, Sequence[Any], Frames, Mapping[str, Any]]:
    """Return what a result is, its numbers, the names of its frames, and its other fields."""
    if isinstance(value, Result):
        pose, extras = value.pose, value.extras
        if pose.rotation is None and pose.position is not None and not as_poses:
            return POINT, pose.position, (pose.parent, None), ({"name": pose.name} if pose.name else {}) | extras
        scale = {} if pose.scale == 1.0 else {SCALE: pose.scale}
        if as_poses:
            pose = pose._replace(position=pose.position or (nan,) * 3, rotation=pose.rotation or (nan,) * 4)
        return POSE, pose.components, (pose.parent, pose.name), scale | extras
    kind, keys = next((each for each in MAPPINGS if {*each[1]} <= value.keys()), MAPPINGS[0])
    numbers: list[Any] = []
    for part in map(value.get, keys):
        numbers += part.values() if isinstance(part, dict) else part if isinstance(part, list) else [part]
    if len(numbers) != (6 if kind in PARTS else 3) or not all(isinstance(number, float) for number in numbers):
        raise ValueInvalid(f"columns hold points or poses, found {', '.join(value)}")
    rest = {key: each for key, each in value.items() if key not in (*keys, "frame")}
    return kind, numbers, (value.get("frame"), None), rest


def objects(values: Iterable[Any]) -> NDArray[Any]:
    """Return plain values as a column (n,): texts, None, mappings and lists; numbers and truth values as written."""
    found = list(values)
    if not {*map(type, found)} <= {str, Verbatim, NoneType}:
        found = [Verbatim(repr(each).lower()) if isinstance(each, (int, float)) else each for each in found]
    return np.fromiter(found, object, len(found))


def values_of(block: RowPoses, place: Place | None = None) -> list[Any]:
    """Return a block as single results: poses, placed or not, or points, vectors, .. as mappings.

    place: how positions on the Earth are written
    """
    kind, extras = block.kind, block.more
    names, parents = map(block.for_each, (block.names, block.parents))
    others = {name: plain_cells(cells) for name, cells in block.extras.items()}
    stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
    made: list[Any] = []
    for at, numbers in enumerate(block.numbers.tolist()):
        has_none, size = isnan(numbers[0]), len(numbers) - len(extras)
        own = None if has_none else numbers[:size]
        said = with_entries(dict(zip(extras, [None] * len(extras) if has_none else numbers[size:], strict=True)))
        if stamps is not None:
            said["stamp_ns"] = None if stamps[at] == NO_STAMP else stamps[at]
        said |= {name: cells[at] for name, cells in others.items()}
        named: dict[str, Any] = {"name": names[at]} if names[at] else {}
        if kind == POSE:
            pose = Pose.of(own or NOWHERE, names[at], parents[at])._replace(read=block.spot(at))
            pose = pose if block.placed else pose._replace(position=None)
            made.append(NoResult(pose, said) if own is None else Result(pose, said))
        elif place is not None and own is not None:
            from frametool.grammar.place import point_entry

            made.append(named | point_entry(parents[at], own, place, block.spot(at)) | said)
        else:
            named |= {"frame": parents[at]} if parents[at] else {}
            halves = (None, None) if own is None else (own[:3], own[3:])
            made.append(named | {kind: dict(zip(PARTS[kind], halves, strict=True)) if kind in PARTS else own} | said)
    return made


def texts_of(cells: Cells) -> list[str]:
    """Return the text of each cell, without its quotes; of numbers the shortest that reads back, of lists JSON."""
    if not isinstance(cells, Spans) and cells.dtype == object:
        return [text_of(value) for value in cells.tolist()]
    if not isinstance(cells, Spans) and cells.dtype.kind != "f":
        texts: list[str] = cells.astype(np.str_).tolist()
        return [text.lower() for text in texts] if cells.dtype.kind == "b" else texts
    if not isinstance(cells, Spans):
        doubles = cells.astype(np.float64)
        doubles = doubles if cells.dtype.itemsize > 4 else rounded_to_single(doubles)
        spans = float_spans(doubles.reshape(-1, 1), b",")
        cells = Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)
    bare = without_quotes(cells)
    data = bare.data.tobytes()
    places = zip(bare.starts.tolist(), bare.ends.tolist(), strict=True)
    return [data[start:end].decode("utf-8", "replace").strip().replace('""', '"') for start, end in places]


def text_of(value: Any) -> str:
    """Return a plain value as a text, "" for none."""
    return "" if value is None else dump_json(value) if isinstance(value, (dict, list)) else str(value)


def plain_cells(cells: Cells) -> list[Any]:
    """Return cells as plain values."""
    if not isinstance(cells, Spans) and cells.dtype == object:
        return list(cells)
    texts = texts_of(cells)
    known: dict[str, str | Verbatim | None] = {"": None}
    for text in {*texts} - {""}:  # numbers and truth values as they are written
        known[text] = Verbatim(text) if text in ("true", "false") or re.fullmatch(JSON_NUMBER, text) else text
    return [known[text] for text in texts]
