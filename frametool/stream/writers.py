"""Poses, points and vectors in blocks to any format of text that writes them.

What a row of text looks like is said by the format (`ROWS`), or learned from what it writes for one; where neither can
be, the format writes row after row as it writes single results.  Other columns go along where they have a place.
"""

from __future__ import annotations

import re
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.documents.json import dump
from frametool.documents.source import Verbatim
from frametool.errors import ValueInvalid, listing, warn
from frametool.formats.rows.csv import quoted
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
from frametool.grammar.result import Result, with_entries
from frametool.stream.header import XYZ
from frametool.stream.layout import Const, In, Out
from frametool.stream.row_layout import POSE, SIX, Target
from frametool.stream.row_poses import (
    block_of,
    first_of,
    kept,
    plain_cell,
    plain_cells,
    points_of,
    results_of,
    spelled,
    texts_of,
)
from frametool.stream.rows import assemble, number_spans, separators, spans_of
from frametool.text.spans import Spans, join

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.geometry.place import Place
    from frametool.geometry.types import Components
    from frametool.grammar.result import Style
    from frametool.stream.layout import Piece
    from frametool.stream.row_poses import RowPoses
    from frametool.text.spans import Floats

LEARNED = ("csv", "json", "yaml")
PROBE_NS = 1234567890987654321
PROBE = (0.1370842961, -3.7208412957, 29.6518402397, 0.22360679774997896, -0.37416573867739417, 0.5099019513592785,
         0.7416198487095663)  # fmt: skip
MARK = "@@{}@@"


def target_in(style: Style, kind: str, *, placed: bool) -> Target:
    """Return which numbers of a result of some kind are written in a style; placed: whether poses have a position."""
    place: Any = style.place
    if kind != POSE:
        return Target(None, (), plain=True) if kind in SIX else Target(place or 1.0, (), three=True)
    notations = tuple((each, style.in_degrees(each)) for each in style.notations or (notation("quaternion"),))
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


class TextWriter:
    """Write blocks of poses, points or vectors as text; `end` says what comes behind the last."""

    def __init__(self, style: Style, kind: str = POSE, extras: Sequence[str] = (), *, placed: bool = True) -> None:
        """Choose how the format of a style is written.

        kind: pose, point or vector; extras: the numbers with each; placed: whether poses have a position
        Raises ValueInvalid for what the format does not hold, and for notations that it does not have.
        """
        if kind in SIX and style.format not in LEARNED:
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
        far = 1.0 if self.target.place is None else 1e6  # nothing near the Earth's centre has a latitude
        self.probe = (*(far * part for part in PROBE[:3]), *PROBE[3:])
        self.count = 0
        self.dropped: dict[str, None] = {}
        self.rows: RowForm | None = None
        self.looked = False  # whether the format was seen to write a row
        self.order: list[int] = []
        self.first: Any = None
        self.empty: RowPoses | None = None  # a block without rows says what columns there are

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block of poses; numbers are metres and x y z w."""
        if not len(block.numbers):
            self.empty = block
            return b""
        if (place := self.style.place) is not None:
            if self.fixed is not None:
                names = ", ".join(each.name for each in (place, *place.more))
                raise ValueInvalid(f"{self.style.format} holds x, y, z; leave --to {names} out, or write csv or json")
            settle(place, block)
        if self.style.format not in LEARNED:
            self.dropped |= dict.fromkeys((*self.extras, *block.extras))
            refuse_scale_in(self.style.format, self.dropped)
        absent = np.isnan(block.numbers[:, 0])
        cuts = [0, *(np.flatnonzero(np.diff(absent)) + 1).tolist(), len(absent)]
        text = b""
        for start, end in pairwise(cuts):
            run = block if len(cuts) == 2 else kept(block, slice(start, end))
            text += self._fixed(self.fixed, run) if self.fixed else self._free(run, is_null=bool(absent[start]))
            self.count += end - start
        return text

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last pose, and warn of what was left out."""
        if self.fixed is None or self.dropped_fields is None:
            if self.dropped:
                warn(f"{self.style.format}: {listing(self.dropped, MOST_NAMED)} left out")
            if self.style.format == "csv" and not self.count and self.empty is not None:
                self._learn(self.empty)
                yield self.rows.head if self.rows is not None else b""
            return
        self.dropped_fields.tell()
        yield self.fixed.tail if self.count else self.fixed.head + self.fixed.tail

    # --- formats that say what a row is ---

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
        tx, ty, tz, x, y, z, w = rigid.inverse(*pose) if FORMATS[self.style.format].poses.inverse else pose
        turn = (x, y, z, w) if self.style.keep_sign else quaternion.from_quaternion(x, y, z, w, arrays)
        return self._joined(fmt, np.array(fmt.numbers(tx, ty, tz, *turn)).T + 0.0, block)  # none is -0.0

    def _joined(self, fmt: RowForm, values: Floats, block: RowPoses) -> bytes:
        """Put the rows of a block together."""
        if not np.isfinite(values).all():
            raise ValueInvalid("a result is too large for a double")
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
        after, is_yaml = separators(pieces), self.style.format == "yaml"
        numbers = number_spans(np.ascontiguousarray(values), self.style.precision, after, yaml=is_yaml)
        text = join(assemble(pieces, parts, numbers, np.zeros(len(values), np.int64)))
        return text if self.count else fmt.head + text[len(fmt.between) :]

    def _field(self, name: str, block: RowPoses, first: int) -> Spans:
        """Return what is written in one field of each row."""
        size = len(block.numbers)
        if name.startswith("@@"):
            return self._cells(name, block)
        stamps = self._stamps(block)
        if name == IMAGE:
            images = texts_of(block.extras[IMAGE]) if IMAGE in block.extras else [None] * size
            return spans_of([image_name(*each).encode() for each in zip(images, stamps, strict=True)])
        if name == "seconds" and min(stamps) >= 0:
            return spans_of([b"%d.%09d" % divmod(stamp, BILLION) for stamp in stamps])
        numbers: Sequence[int] = range(self.count + first, self.count + first + size)
        if NUMBER in block.extras and name == NUMBER:
            numbers = [int(text) for text in texts_of(block.extras[NUMBER])]
        return spans_of([field(name, stamp, number).encode() for stamp, number in zip(stamps, numbers, strict=True)])

    def _stamps(self, block: RowPoses) -> list[int]:
        if block.stamps_ns is None:
            return [at * BILLION for at in range(self.count, self.count + len(block.numbers))]
        stamps: list[int] = block.stamps_ns.tolist()
        return stamps

    def _cells(self, mark: str, block: RowPoses) -> Spans:
        """Return a column of names or of what is not ours, as the format writes texts."""
        what = mark[2:-2]
        if what in ("name", "parent"):
            texts: Sequence[str | None] = block.names if what == "name" else block.parents
            texts = list(texts) * (len(block.numbers) if len(texts) == 1 else 1)
        elif self.style.format != "csv" and not isinstance(cells := list(block.extras.values())[int(what)], Spans):
            return spans_of([dump(value).encode() for value in plain_cells(cells)])
        else:
            texts = texts_of(list(block.extras.values())[int(what)])
        in_csv = self.style.format == "csv"
        known = {text: (quoted(text or "") if in_csv else dump(plain_cell(text or ""))).encode() for text in {*texts}}
        return spans_of([known[text] for text in texts])

    # --- formats whose rows depend on what is written ---

    def _free(self, block: RowPoses, *, is_null: bool) -> bytes:
        """Write a block as the format was seen to write poses; one by one where unseen, or angles are not unique."""
        if is_null:
            return self._one_by_one(block)
        if not self.looked:
            self.looked = True
            self._learn(block)
            if self.rows is not None and self._filled(self.rows, first_of(block)) != self._one_by_one(first_of(block)):
                self.rows = None
        locked = self.target.locked(columns_of(block, placed=self.placed)[:7])
        if self.rows is None or (locked is not None and bool(np.any(locked))):
            return self._one_by_one(block)
        return self._filled(self.rows, block)

    def _filled(self, rows: RowForm, block: RowPoses) -> bytes:
        """Fill the numbers of a block into the rows that were learned."""
        written = self.target.written(block.unmoved(columns_of(block, placed=self.placed)), arrays)
        values = np.empty((len(block.numbers), len(self.order)))
        for at, place in enumerate(self.order):
            values[:, at] = written[place]
        values += 0.0  # none is -0.0
        return self._joined(rows, values, block)

    def _learn(self, block: RowPoses) -> None:
        """See how the format writes a pose whose numbers are all different, and take them for places to fill in."""
        style = self.style.changed()
        style.precision = None
        varies = block.extras or {len(block.names), len(block.parents)} != {1}
        is_worded = self.target.place is not None and bool(self.target.place.words)
        if style.format not in LEARNED or (style.format == "yaml" and varies) or is_worded:
            return
        probe = self._probe(block)
        alone, twice = (self.write([probe] * count, style) for count in (1, 2))
        row = twice[len(alone) :]
        head, between = (alone[: -len(row)], "") if alone.endswith(row) else ("", row[: -len(alone)])
        row = row[len(between) :]
        own = self.probe[: self._size]
        extra = (0.7310585786300049 + at for at in range(len(self.extras)))
        written = [*self.target.written(own, floats), *extra]
        marks = {repr(value): at for at, value in enumerate(written) if type(value) is float}
        marks |= {MARK.format(what): -1 for what in ("name", "parent", *range(len(block.extras)))}
        marks[str(PROBE_NS)] = -1
        pieces: list[str | bytes | Numbers] = []
        for text in re.split("(" + "|".join(map(re.escape, marks)) + ")", row):
            if text not in marks:
                pieces += [text.encode()] if text else []
            elif marks[text] >= 0:
                pieces.append(Numbers(1, b""))
                self.order.append(marks[text])
            else:
                pieces.append("nanoseconds" if text == str(PROBE_NS) else text)
        self.rows = RowForm(tuple(pieces), head=head.encode(), between=between.encode())

    @property
    def _size(self) -> int:
        return len(PROBE) if self.kind == POSE else 6 if self.kind in SIX else len(XYZ)

    def _probe(self, block: RowPoses) -> Any:
        """Make a result with what this block's have; what differs from row to row is marked."""
        name, parent = (
            each[0] if len(each) == 1 else Verbatim(MARK.format(what))
            for what, each in (("name", block.names), ("parent", block.parents))
        )
        if self.kind != POSE:
            named = {} if parent is None else {"frame": parent}
            if self.target.place is not None:
                from frametool.grammar.place import point_entry

                named = point_entry(EARTH_FRAMES[0], self.probe[:3], self.target.place)
                return named | self._probe_extras(block)
            return named | spelled(self.kind, PROBE[: self._size]) | self._probe_extras(block)
        pose = Pose.of(self.probe, name, parent)
        return Result(pose if self.placed else pose._replace(position=None), self._probe_extras(block))

    def _probe_extras(self, block: RowPoses) -> dict[str, Any]:
        extras: dict[str, Any] = {name: 0.7310585786300049 + at for at, name in enumerate(self.extras)}
        if self.style.format != "csv":
            extras = with_entries(extras)
        if block.stamps_ns is not None:
            extras["stamp_ns"] = PROBE_NS
        return extras | {name: Verbatim(MARK.format(at)) for at, name in enumerate(block.extras)}

    def _one_by_one(self, block: RowPoses) -> bytes:
        """Write the rows as the format does for single results."""
        results: list[Any]
        if self.kind == POSE:
            results = list(results_of(block, self.extras, placed=self.placed))
        else:
            results = points_of(block, self.kind, self.extras, self.target.place)
        first = self.first = self.first or results[0]
        known = "" if not self.count else self.write([first], self.style)
        text = self.write(results if not self.count else [first, *results], self.style)
        return text[len(known) :].encode()


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
