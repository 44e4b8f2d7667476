"""Poses, points and vectors in blocks to any format of text that writes them.

What a row of text looks like is said by the format (`ROWS`), or learned from what it writes for one; where neither can
be, the format writes row after row as it writes single results.  Other columns go along where they have a place.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.documents.json import dump
from frametool.documents.source import Verbatim
from frametool.errors import ValueInvalid, listing, warn
from frametool.formats.rows.csv import cells_of, row
from frametool.formats.rows.pose_rows import (
    IMAGE,
    MOST_NAMED,
    NUMBER,
    DroppedFields,
    Numbers,
    RowForm,
    field,
    image_name,
    is_turned,
    rows_of,
    turned,
)
from frametool.formats.table import FORMATS
from frametool.frames.stamps import BILLION
from frametool.geometry import arrays, floats, quaternion, rigid
from frametool.geometry.representations import notation
from frametool.grammar.names import EARTH_FRAMES
from frametool.grammar.pose import SCALE, Pose
from frametool.grammar.result import Result, Style, with_entries
from frametool.stream.layout import Const, In, Out, Piece
from frametool.stream.record_results import BlockResults, Documents, csv_rows
from frametool.stream.row_layout import POSE, SIX, Target
from frametool.stream.row_poses import block_of, kept, plain_cell, plain_cells, points_of, results_of, spelled, texts_of
from frametool.stream.rows import assemble, number_spans, separators, spans_of
from frametool.stream.text_rows import (
    CELL,
    MORE_NUMBERS,
    NAME,
    NUMBERS,
    PARENT,
    STAMP_NS,
    Marked,
    filled,
    leaf_mark,
    words,
)
from frametool.text.spans import Flags, Floats, Ints, Spans, join

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.geometry.place import Place
    from frametool.geometry.types import Components
    from frametool.stream.row_poses import RowPoses
    from frametool.stream.text_rows import Syntax

LEARNED = ("csv", "json", "yaml")


def target_in(style: Style, kind: str, *, placed: bool) -> Target:
    """Return which numbers of a result of some kind are written in a style; placed: whether poses have a position."""
    place: Any = style.place
    if kind != POSE:
        return Target(None, (), plain=True) if kind in SIX else Target(place or 1.0, (), three=True)
    notations = tuple((each, each.in_degrees(style.degrees)) for each in style.notations or (notation("quaternion"),))
    whole = placed and len(notations) == 1 and notations[0][0].representation.whole is not None
    return Target(None if whole or not placed else place or 1.0, notations, style.keep_sign, whole)


def settle(place: Place, block: RowPoses) -> None:
    """Refuse positions of another frame than the Earth's; the first of all may be the origin."""
    from frametool.grammar.place import check_in_ecef

    for parent in dict.fromkeys(block.parents):
        check_in_ecef(parent, place)
    place.settle(*columns_of(block)[:3])


def columns_of(block: RowPoses, *, placed: bool = True) -> Components:
    """Return the numbers of a block as columns; poses that are not placed are at 0."""
    columns = tuple(map(np.ascontiguousarray, block.numbers.T))
    return columns if placed else (*[columns[0] * 0.0] * 3, *columns)


def values_of(block: RowPoses, kind: str, extras: Sequence[str], target: Target, *, placed: bool) -> Sequence[Any]:
    """Return the rows of a block as single results of some kind."""
    if kind == POSE:
        return results_of(block, extras, placed=placed)
    return points_of(block, kind, extras, target.place)


class TextWriter:
    """Write blocks of poses, points or vectors in formats whose rows are fixed, or one by one as single results."""

    def __init__(self, style: Style, kind: str = POSE, extras: Sequence[str] = (), *, placed: bool = True) -> None:
        """Choose how the format of a style is written.

        kind: pose, point or vector; extras: the numbers with each; placed: whether poses have a position
        Raises ValueInvalid for what the format does not hold, and for notations that it does not have.
        """
        if kind in SIX:
            raise ValueInvalid(f"{style.format} is not written of rows of a {kind}; write csv, json or yaml")
        if kind != POSE and "points" not in FORMATS[style.format].writes:
            raise ValueInvalid(f"{style.format} holds poses; a {kind} has no rotation")
        self.style = style
        self.kind = kind
        module: Any = import_module(FORMATS[style.format].writer)
        self.fixed = rows_of(style.format)
        name = "write_poses" if kind == POSE else "write_points"
        self.write: Callable[[Sequence[Any], Style], str] = getattr(module, name, _no_text)
        self.dropped_fields = None if self.fixed is None else DroppedFields(self.fixed, style)
        self.extras = tuple(extras)
        self.placed = placed or kind != POSE
        self.target = target_in(style, kind, placed=placed)
        self.count = 0
        self.dropped: dict[str, None] = {}
        self.first: Any = None

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block of poses; numbers are metres and x y z w."""
        if not len(block.numbers):
            return b""
        if (place := self.style.place) is not None:
            if self.fixed is not None:
                names = ", ".join(each.name for each in (place, *place.more))
                raise ValueInvalid(f"{self.style.format} holds x, y, z; leave --to {names} out, or write csv or json")
            settle(place, block)
        self.dropped |= dict.fromkeys((*self.extras, *block.extras))
        refuse_scale_in(self.style.format, self.dropped)
        text = self._fixed(self.fixed, block) if self.fixed else self._one_by_one(block)
        self.count += len(block.numbers)
        return text

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last pose, and warn of what was left out."""
        if self.fixed is None or self.dropped_fields is None:
            if self.dropped:
                warn(f"{self.style.format}: {listing(self.dropped, MOST_NAMED)} left out")
            return
        self.dropped_fields.tell()
        yield self.fixed.tail if self.count else self.fixed.head + self.fixed.tail

    def _one_by_one(self, block: RowPoses) -> bytes:
        """Write the rows as the format does for single results."""
        results = values_of(block, self.kind, self.extras, self.target, placed=self.placed)
        first = self.first = self.first or results[0]
        known = self.write([first], self.style) if self.count else ""
        text = self.write([first, *results] if self.count else results, self.style)
        return text[len(known) :].encode()

    def _fixed(self, fmt: RowForm, block: RowPoses) -> bytes:
        dropped = self.dropped_fields
        if dropped is not None:
            there = [name for names in (block.parents, block.names) for name in names if name]
            images = block.extras.get(IMAGE)
            dropped.record(
                frames=bool(there),
                stamps=block.stamps_ns is not None and NUMBER not in block.extras,
                extras=[*self.extras, *(name for name in block.extras if name not in (IMAGE, NUMBER))],
            )
            dropped.counted |= "stamps" in fmt.holds and block.stamps_ns is None
            dropped.by_stamp |= IMAGE in fmt.row and images is None
            dropped.turned = is_turned(self.style)
        tx, ty, tz, x, y, z, w = columns_of(block, placed=self.placed)[:7]  # as the format has them: axes, direction
        pose = turned(self.style, (tx, ty, tz, *quaternion.unit(x, y, z, w, arrays)))
        tx, ty, tz, x, y, z, w = rigid.inverse(*pose) if FORMATS[self.style.format].rows.inverse else pose
        turn = (x, y, z, w) if self.style.keep_sign else quaternion.from_quaternion(x, y, z, w, arrays)
        values = np.array(fmt.numbers(tx, ty, tz, *turn)).T + 0.0  # none is -0.0
        refuse_infinite(values)
        pieces: list[Piece] = [Const(fmt.between)] if fmt.between else []
        parts: list[Spans] = []
        first = 0
        for piece in fmt.row:
            if isinstance(piece, bytes):
                pieces.append(Const(piece))
            elif isinstance(piece, Numbers):
                pieces.append(Out(first, first + piece.size, piece.between))
                first += piece.size
            else:
                pieces.append(In(len(parts)))
                parts.append(self._field(piece, block, fmt.first))
        numbers = number_spans(np.ascontiguousarray(values), self.style.precision, separators(pieces))
        text = join(assemble(pieces, parts, numbers, np.zeros(len(values), np.int64)))
        return text if self.count else fmt.head + text[len(fmt.between) :]

    def _field(self, name: str, block: RowPoses, first: int) -> Spans:
        """Return what is written in one field of each row."""
        size = len(block.numbers)
        stamps: list[int] = [at * BILLION for at in range(self.count, self.count + size)]
        if block.stamps_ns is not None:
            stamps = block.stamps_ns.tolist()
        if name == IMAGE:
            images = texts_of(block.extras[IMAGE]) if IMAGE in block.extras else [None] * size
            return spans_of([image_name(*each).encode() for each in zip(images, stamps, strict=True)])
        if name == "seconds" and min(stamps) >= 0:
            return spans_of([b"%d.%09d" % divmod(stamp, BILLION) for stamp in stamps])
        numbers: Sequence[int] = range(self.count + first, self.count + first + size)
        if NUMBER in block.extras and name == NUMBER:
            numbers = [int(text) for text in texts_of(block.extras[NUMBER])]
        return spans_of([field(name, stamp, number).encode() for stamp, number in zip(stamps, numbers, strict=True)])

class PoseBatch(NamedTuple):
    """Rows of a block that are written alike; values: (n, k) the numbers that are written of each."""

    marked: Marked
    places: Ints
    values: Floats
    block: RowPoses

    def text(self, parts: Sequence[tuple[str, Syntax]], style: Style) -> list[Spans]:
        """Return the rows as text; parts: the text of the result with marks."""
        return filled(parts, style, self.marked.numbers, self.values, self._scalar)

    def _scalar(self, mark: str, syntax: Syntax) -> tuple[Spans, str]:
        """Return what rows have in the place of a mark, as it is written there."""
        block = self.block
        if mark == str(STAMP_NS) and block.stamps_ns is not None:
            return spans_of([b"%d" % stamp for stamp in block.stamps_ns.tolist()]), ""
        if mark in (NAME, PARENT):
            return words(block.names if mark == NAME else block.parents, len(block.numbers), syntax), ""
        cells = list(block.extras.values())[int(mark[-7:])]
        if syntax is CELL or isinstance(cells, Spans):
            texts = texts_of(cells)
            known = {text: syntax.write(text if syntax is CELL else plain_cell(text)).encode() for text in {*texts}}
            return spans_of([known[text] for text in texts]), ""
        return spans_of([dump(value).encode() for value in plain_cells(cells)]), ""


class RowsWriter:
    """Write blocks of poses, points or vectors as CSV, JSON or YAML; rows that are alike are written together."""

    def __init__(self, style: Style, kind: str = POSE, extras: Sequence[str] = (), *, placed: bool = True) -> None:
        """Take the style and what rows are, as `TextWriter`."""
        self.style, self.kind, self.extras, self.placed = style, kind, tuple(extras), placed or kind != POSE
        self.target = target_in(style, kind, placed=placed)
        self.more = [MORE_NUMBERS + at for at in range(len(self.extras))]
        self.documents = None if style.format == "csv" else Documents(style)
        self.columns: dict[str, None] = {}  # of a table: those of the first rows
        self.empty: RowPoses | None = None  # a block without rows says what columns there are

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block of poses; numbers are metres and x y z w."""
        if not len(block.numbers):
            self.empty = block
            return b""
        if self.style.place is not None:
            settle(self.style.place, block)
        alone = self._alone(block)
        alike, singles = np.flatnonzero(~alone), np.flatnonzero(alone)
        batches = [self._batch(kept(block, alike) if len(singles) else block, alike)] if len(alike) else []
        some = kept(block, singles) if len(alike) else block
        values = values_of(some, self.kind, self.extras, self.target, placed=self.placed) if len(singles) else ()
        results = BlockResults(batches, [*zip(singles.tolist(), values, strict=True)])
        if self.documents is not None:
            return self.documents.of_block(results)
        before = len(self.columns)
        text = csv_rows(results, self.columns, self.style)
        if before and (others := [*self.columns][before:]):
            raise ValueInvalid(f"{listing(others)}: the first rows have no such columns; write json or yaml")
        return text if before else row(self.columns, self.style).encode() + text

    def end(self) -> Iterator[bytes]:
        """Yield the names of the columns if there were no rows."""
        if self.documents is None and not self.columns and self.empty is not None:
            yield row(cells_of(self._marked(self.empty).value, self.style), self.style).encode()

    def _alone(self, block: RowPoses) -> Flags:
        """Return which rows are written one by one: without a result, and those whose angles are not unique."""
        varies = block.extras or any(len(each) > 1 for each in (block.names, block.parents))
        is_worded = self.target.place is not None and self.target.place.words
        if self.style.screen or is_worded or (varies and self.style.format == "yaml"):
            return np.ones(len(block.numbers), np.bool_)
        absent = np.isnan(block.numbers[:, 0])
        with np.errstate(invalid="ignore"):
            locked = self.target.locked(columns_of(block, placed=self.placed)[:7])
        return absent if locked is None else absent | (locked != 0)

    def _batch(self, block: RowPoses, places: Ints) -> PoseBatch:
        """Return rows that are alike, with the numbers that are written of them."""
        numbers = self.target.written(block.unmoved(columns_of(block, placed=self.placed)), arrays)
        values = np.stack(np.broadcast_arrays(*numbers), axis=-1) + 0.0  # none is -0.0
        refuse_infinite(values)
        return PoseBatch(self._marked(block), places, values, block)

    def _marked(self, block: RowPoses) -> Marked:
        """Make a result with what this block's have; what differs from row to row is marked."""
        size = {POSE: 7, **dict.fromkeys(SIX, 6)}.get(self.kind, 3)
        # nothing near the Earth's centre has a latitude
        own = (*((1.0 if self.target.place is None else 1e6) * part for part in NUMBERS[:3]), *NUMBERS[3:size])
        numbers = [*self.target.written(own, floats), *self.more]
        columns = {repr(number): at for at, number in enumerate(numbers) if type(number) is float}
        name, parent = (
            each[0] if len(each) == 1 else mark for mark, each in ((NAME, block.names), (PARENT, block.parents))
        )
        extras: dict[str, Any] = dict(zip(self.extras, self.more, strict=True))
        if self.style.format != "csv":
            extras = with_entries(extras)
        if block.stamps_ns is not None:
            extras["stamp_ns"] = STAMP_NS
        extras |= {name: Verbatim(leaf_mark(at)) for at, name in enumerate(block.extras)}
        if self.kind == POSE:
            pose = Pose.of(own, name, parent)
            return Marked(Result(pose if self.placed else pose._replace(position=None), extras), columns, len(numbers))
        named: dict[str, Any] = {} if name is None else {"name": name}
        if self.target.place is None:
            named |= {} if parent is None else {"frame": parent}
            return Marked(named | spelled(self.kind, own) | extras, columns, len(numbers))
        from frametool.grammar.place import point_entry

        return Marked(named | point_entry(EARTH_FRAMES[0], own, self.target.place) | extras, columns, len(numbers))


def refuse_infinite(values: Floats) -> None:
    """Raise ValueInvalid for numbers that are not finite."""
    if not np.isfinite(values).all():
        raise ValueInvalid("a result is too large for a double")


def refuse_scale_in(fmt: str, extra: Iterable[str]) -> None:
    """Stop where a format has no place for the scale of a similarity, which would then be a pose."""
    if SCALE in extra and fmt not in ("text", *LEARNED):
        raise ValueInvalid(f"{fmt} has no place for a scale; write json, yaml or csv")


def _no_text(_results: Sequence[Any], _style: Style) -> str:
    """Write nothing: a format that says what its rows are writes them by that alone."""
    return ""


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return the text of single poses in a format that says what its rows are."""
    writer = TextWriter(style)
    return b"".join((writer.of_block(block_of(list(results))), *writer.end())).decode()
