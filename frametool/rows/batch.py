"""Blocks of rows: numbers and other cells as arrays, names and stamps read in bulk, results as text and as poses.

Knows no syntax: a source passes cells as spans of text, and the text of a result as a list of pieces.  Stamps in
seconds or in nanoseconds are read as integer nanoseconds, never through a float.
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
    """A column of texts: the distinct ones, and the index of each row's text; codes None: one text for all rows."""

    texts: Sequence[Any]
    codes: Ints | None = None

    def of_rows(self, size: int) -> Ints:
        """Return the index of the text of each of `size` rows."""
        return np.zeros(size, np.int64) if self.codes is None else self.codes

    def each(self) -> list[str]:
        """Return the text of each row."""
        return [self.texts[code] for code in self.of_rows(1).tolist()]

    def numbers(self, read: Callable[[str], float]) -> tuple[Floats, dict[int, str]]:
        """Convert each text to a number; return the numbers, nan where `read` raises, and the reasons by row."""
        known = np.full(len(self.texts), np.nan)
        reasons = read_each(known, range(len(known)), lambda at: read(self.texts[at]))
        codes = self.of_rows(1)
        return known[codes], {row: reasons[at] for row, at in enumerate(codes.tolist()) if at in reasons}


ALL_ALIKE = Coded((None,))  # no row names a frame


class BlockNames(NamedTuple):
    """The names of frames in the rows of a block, and in their results.

    frames: the frame that each row is expressed in; for look-ups by two columns both names, joined by NUL
    pairs: the distinct (parent, name) of the rows; results: the (parent, name) of their results
    of_row: (n,) index of each row's pair; None for a single pair
    lost: the first row that names a frame which its result does not name, with that frame
    bad: rows with names that the request does not allow, with column and reason
    """

    frames: Coded
    pairs: Sequence[tuple[str, str]] = (("", ""),)
    results: Sequence[tuple[str, str]] = (("", ""),)
    of_row: Ints | None = None
    lost: Mapping[int, str] = MappingProxyType({})
    bad: Mapping[int, tuple[str, FrametoolError | str]] = MappingProxyType({})

    def texts(self, role: int, rows: Ints) -> list[str | None]:
        """Return the parents (role 0) or the names (role 1) of the results of some rows, or one for all."""
        texts = [pair[role] or None for pair in self.results]
        return texts if len(texts) == 1 or self.of_row is None else [texts[at] for at in self.of_row[rows].tolist()]


class Block(NamedTuple):
    """The content of one block of input.

    numbers: (n, c) cells of the numbers, or the numbers themselves
    parts: the spans (n,) that pieces refer to, by key
    places: (n,) the position of each row in the block, in lines, bytes or rows; the output has this order
    line_of: returns the line of a row, from 0
    unchanged: position and text of all that is copied to the output
    broken: position and fault of rows from which no numbers can be read
    names: the names of the rows and of their results
    stamps: for each shape, or one for all, (n,) nanoseconds; None without stamps
    bad: rows that the source finds bad, with column and reason
    place_of: returns line (from 0) and column (from 1) of a number of a row; None if columns have names
    frames: for each shape, or one for all, the frame that each row is expressed in
    gone: rows whose numbers are absent, not invalid: they have no result and are not reported
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
    """Set `values[place]` to `read(place)` for each place; return the reason for each place that cannot be read."""
    reasons = {}
    for place in places:
        try:
            values[place] = read(place)
        except (ValueInvalid, OverflowError) as error:
            reasons[place] = str(error)
    return reasons


def coded(cells: Spans) -> Coded:
    """Read cells (n,), n > 0, as a column of texts; if all are equal, as frames often are, only one is decoded."""
    column = without_quotes(cells)
    if (only := one_text(column)) is not None:
        return Coded([_text(only)], np.zeros(len(cells.starts), np.int64))
    data = column.data.tobytes()
    spans = zip(column.starts.tolist(), column.ends.tolist(), strict=True)
    return coded_texts([data[start:end] for start, end in spans], _text)


def codes_of(cells: Cells) -> Coded:
    """Return cells (n,), n > 0, of any type as a column of the texts that `texts_of` returns."""
    return coded(cells) if isinstance(cells, Spans) else coded_texts(texts_of(cells))


def one_text(column: Spans) -> bytes | None:
    """Return the text that all cells (n,), n > 0, have in common; None if they differ or are longer than MARGIN."""
    first = column.text(0)
    if len(first) > MARGIN or (column.ends - column.starts != len(first)).any():
        return None
    return first if all((column.data[column.starts + at] == byte).all() for at, byte in enumerate(first)) else None


def coded_texts(cells: Sequence[Any], text: Callable[[Any], str] = str) -> Coded:
    """Return cells as a column of texts; text: converts each distinct value."""
    known, codes = numbered(cells)
    return Coded([*map(text, known)], codes)


def numbered(values: Sequence[Any]) -> tuple[dict[Any, int], Ints]:
    """Return the distinct values, each with its index, and the index of each value."""
    known: dict[Any, int] = {}
    return known, np.fromiter((known.setdefault(each, len(known)) for each in values), np.int64, len(values))


def _text(cell: bytes) -> str:
    return cell.decode("utf-8", "replace").strip().replace('""', '"')


def number_spans(
    values: Floats, precision: int | None, separators: bytes, *, yaml: bool = False, null: bytes = b"nan"
) -> Spans:
    """Write floats (n, k) as fixed decimals, or as the shortest text that reads back to the same bits.

    separators: the character after each of the k numbers
    yaml: an exponent has a point before it, as YAML requires
    null: if b"", nan is an empty cell
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
    """Return the character that follows each number of the result in these pieces."""
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
    """Return the spans that make up the rows, in order.

    parts: the spans (n,) that `In` pieces refer to
    results: (n, k) the numbers of the result; precision, yaml, null: as for `number_spans`
    locked: (n,) 1 in rows whose Euler angles are not unique
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
    """Return one text repeated for `size` rows."""
    starts = np.full(size, MARGIN, np.int64)
    return Spans(framed(text), starts, starts + len(text))


def chosen(spans: Spans, rows: Ints) -> Spans:
    """Return the spans of some rows."""
    return Spans(spans.data, spans.starts[rows], spans.ends[rows])


def texts_as_rows(unchanged: Sequence[tuple[int, bytes]]) -> tuple[Ints, list[Spans]]:
    """Return pairs of position and text as a group of rows, in the order of their positions."""
    unchanged = sorted(unchanged, key=itemgetter(0))
    return np.array([place for place, _ in unchanged], np.int64), [spans_of([text for _, text in unchanged])]


def spans_of(texts: list[bytes]) -> Spans:
    """Return a list of texts, one per row, as spans."""
    lengths = np.fromiter(map(len, texts), np.int64, len(texts))
    ends = np.cumsum(lengths) + MARGIN
    return Spans(framed(b"".join(texts)), ends - lengths, ends)


def written(groups: Sequence[tuple[Ints, list[Spans]]]) -> bytes:
    """Return the text of all groups of rows, in the order of their positions."""
    if len(groups) < 2:
        return join(groups[0][1]) if groups else b""
    return _in_order(groups)


def _in_order(groups: Sequence[tuple[Ints, list[Spans]]]) -> bytes:
    """Join the spans of each row, then the rows in the order of their positions."""
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
    """Read the stamps of rows; also return the column and the reason for each row without a valid stamp.

    cells: as for `read_stamps`, or () for rows without stamps, whose stamps are None
    name: the name of the column or key, which may state the unit
    some_static: a stamp may be empty
    """
    if not cells:
        return None, {}
    stamps, reasons = read_stamps(cells, in_ns=in_nanoseconds(name) if len(cells) == 1 else 0)
    stamps[[*reasons]] = NO_STAMP
    if some_static:
        reasons = {row: reason for row, reason in reasons.items() if any(each.text(row).strip() for each in cells)}
    return stamps, {row: (name, reason) for row, reason in reasons.items()}


def read_stamps(cells: Sequence[Spans], *, in_ns: int) -> tuple[Ints, dict[int, str]]:
    """Read stamps as nanoseconds: one column (n,), or two with whole seconds and nanoseconds.

    in_ns: nanoseconds per unit of an integer in a single column; 0 for decimal seconds, or nanoseconds if `ns` follows
    Returns the stamps, and the reason for each row without one.  Cells with unusual syntax are read one by one.
    """
    parsed = [parse_stamps(each, in_ns=in_ns if len(cells) == 1 else 1) for each in cells]
    stamps, sure = parsed[0]
    if len(cells) == 2:
        stamps, sure = stamps * BILLION + parsed[1][0], sure & parsed[1][1] & (stamps < FURTHEST)

    def read(row: int) -> int:
        texts = [each.text(row).decode("utf-8", "replace") for each in cells]
        return read_header_stamp(*texts) if len(texts) == 2 else read_stamp(texts[0], in_ns=in_ns)

    return stamps, read_each(stamps, np.flatnonzero(~sure).tolist(), read)


# --- results as blocks of poses, for trees and other formats; conversion from and to single results ---

NO_STAMP = np.iinfo(np.int64).min  # of a bad row that is kept, and of a static one


class RowPoses(NamedTuple):
    """The results of the rows of a block, in their order, without those of skipped rows.

    numbers: (n, k) the results, position first; nan in a row that is kept without a result
    stamps_ns: (n,), NO_STAMP in a row without a stamp; None if no row has one
    lines: (n,) lines of the input, from 0
    parents, names: one per row, or one for all; None or "" where a frame has no name
    extras: the other columns of the input by name: cells of text, typed arrays, or objects (see `objects`)
    read: (n, 3) lat, lon, alt as they were read, for positions on the Earth that the operation does not move
    kind: of each row: a pose, a point, ..; placed: False for poses without a position, which is then 0
    more: names of the numbers that follow those of the pose or point
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
        """Return parents or names with one entry per row."""
        return names if len(names) == len(self.numbers) else [*names] * len(self.numbers)

    def spot(self, row: int) -> Spot | None:
        """Return the geodetic position that a row was read from; None if unknown."""
        return None if self.read is None else _place().spot_of(self.read[row].tolist())

    def unmoved(self, parts: Components) -> Components:
        """Return the components of all rows together with the geodetic positions they were read from, if known."""
        if self.read is None:
            return parts
        return _place().Unmoved(parts, _place().spot_of(np.ascontiguousarray(self.read.T)))  # type: ignore[no-any-return]


SOME_STAMPS = "some poses have a stamp and some have none; add it, or leave it out of all"
NO_ROWS = RowPoses(np.empty((0, 7)), None, np.empty(0, np.int64), (None,), (None,), {})


def _place() -> Any:
    return import_module("frametool.geometry.place")  # imported late: few rows are on the Earth


def kept(block: RowPoses, rows: slice | Ints) -> RowPoses:
    """Return some rows of a block."""
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
    """Return some cells of a column; cells that are neither text nor a typed array are converted to plain values."""
    if isinstance(cells, Spans):
        return Spans(cells.data, cells.starts[rows], cells.ends[rows])
    if is_typed(cells):
        return cells[rows]  # type: ignore[no-any-return]
    from frametool.formats.rows.column_file import plain_value

    is_array = isinstance(cells, np.ndarray)
    return objects(map(plain_value, cells[rows].tolist() if is_array else [cells[row] for row in rows.tolist()]))


def is_typed(cells: Any) -> bool:
    """Return True if cells are a numpy array (n,) of numbers, booleans or times."""
    return isinstance(cells, np.ndarray) and cells.ndim == 1 and cells.dtype.kind in "fiubM"


def block_of(results: BlockResults, *, timed: bool = True, as_poses: bool = False) -> RowPoses:
    """Return results as one block of poses, points, vectors, twists or wrenches; their positions are its lines.

    A missing position is 0, a missing rotation the identity.  Stamps that only some results have are in `extras`.
    timed: either all results need a stamp, or none
    as_poses: a position without a rotation is a pose, not a point, and missing parts are nan
    Raises ValueInvalid for results of several kinds, for other mappings, and for missing stamps.
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
        np.array(numbers, np.float64) + 0.0, stamps_ns, np.array(places, np.int64), parents, names,  # no -0.0
        {key: objects(column) for key, column in columns.items()},
        None if None in read else np.array(read, np.float64), kinds[0],
        placed=not all(isinstance(value, Result) and value.pose.position is None for value in values),
    )  # fmt: skip


def _row_of(value: Value, *, as_poses: bool) -> tuple[str, Sequence[Any], Frames, Mapping[str, Any]]:
    """Return the kind of a result, its numbers, its parent and name, and its other fields."""
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
    """Return plain values as an array (n,) of texts, None, mappings, lists; numbers and booleans become `Verbatim`."""
    found = list(values)
    if not {*map(type, found)} <= {str, Verbatim, NoneType}:
        found = [Verbatim(repr(each).lower()) if isinstance(each, (int, float)) else each for each in found]
    return np.fromiter(found, object, len(found))


def values_of(block: RowPoses, place: Place | None = None) -> list[Any]:
    """Return the rows of a block as single results: `Result` for a pose, else a mapping.

    place: the notation of positions on the Earth; None for x, y, z
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
        # at a position on the Earth the columns of a covariance are read, but no list of nine
        said |= (dict if place else with_entries)({name: cells[at] for name, cells in others.items()})
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
    """Return the text of each cell: without quotes, a number as the shortest text that reads back, a list as JSON."""
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
    """Return a plain value as a text, "" for None."""
    return "" if value is None else dump_json(value) if isinstance(value, (dict, list)) else str(value)


def plain_cells(cells: Cells) -> list[Any]:
    """Return cells as plain values: None if empty, and numbers and booleans as `Verbatim`."""
    if not isinstance(cells, Spans) and cells.dtype == object:
        return list(cells)
    texts = texts_of(cells)
    known: dict[str, str | Verbatim | None] = {"": None}
    for text in {*texts} - {""}:  # numbers and truth values as they are written
        known[text] = Verbatim(text) if text in ("true", "false") or re.fullmatch(JSON_NUMBER, text) else text
    return [known[text] for text in texts]
