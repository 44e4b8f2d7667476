"""One block of rows through the operation: numbers read, checked, moved, written; faults collected, nothing lost."""

from __future__ import annotations

from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from frametool.errors import FrametoolError, ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.geometry import arrays, floats, quaternion, uncertainty
from frametool.geometry.batch_validation import read_rotations
from frametool.grammar.names import in_nanoseconds
from frametool.grammar.rotation_spelling import FEW_DIGITS
from frametool.stream.faults import DEGREES, NULL, STOP, Fault, RowNote
from frametool.stream.layout import Const, In, Instead, Out, Word
from frametool.stream.request import PAIR, START, no_step, thing_pose
from frametool.stream.row_layout import (
    FLAT,
    IDENTITY,
    LEAVES_PLANE,
    POSE,
    TURN,
    Shape,
    checked_rotation,
    doubt,
    wrong_tail,
)
from frametool.stream.row_poses import texts_of
from frametool.stream.rows import assemble, chosen, coded, number_spans, numbers_or_null, separators, texts_as_rows
from frametool.stream.stamp_columns import NOWHERE, by_frame, by_time, read_stamps
from frametool.text.numbers import parse_number, read_number_or_angle
from frametool.text.parse import half_units, parse_floats
from frametool.text.spans import Spans

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from frametool.geometry.representations import BatchRule
    from frametool.geometry.types import Components, Rigid
    from frametool.stream.layout import Piece
    from frametool.stream.request import Request
    from frametool.stream.row_layout import Target
    from frametool.stream.rows import Block
    from frametool.text.spans import Flags, Floats, Ints




COLUMNS_REMEDY = "give --deg, or name the columns _deg"


class Plan(NamedTuple):
    """What is done to every row of one layout, as a request asks.

    shapes: the poses or points of a row, their numbers one after the other; names: of these numbers, for messages
    pieces: the text of a result; null: what replaces each number of a row without one
    edge_of: the pose that moves a row, or one of its shapes, by the name of the frame it is expressed in
    source: the frame of all rows, whatever they name; frame_column: the name of the column that names frames
    remedies: for each shape, what to do where its angles are degrees
    words: reads the numbers that are words of a table, by column: zones; marked: angles that are no plain number
    yaml: numbers need a point before the exponent
    """

    shapes: tuple[Shape, ...]
    targets: tuple[Target, ...]
    request: Request
    names: tuple[str, ...]
    pieces: tuple[Piece, ...] = ()
    null: bytes = b""
    edge_of: Callable[..., Rigid] | None = None
    source: str = ""
    frame_column: str = ""
    remedies: tuple[str, ...] = ()
    words: Mapping[int, Callable[[str], float]] = MappingProxyType({})
    marked: Mapping[int, Callable[[str], float]] = MappingProxyType({})
    yaml: bool = False


class State:
    """What one block leaves for the next: the row before, and how often each angle has turned around."""

    __slots__ = ("angles", "previous", "stamp_ns", "turns")

    def __init__(self) -> None:
        """Begin before the first row."""
        self.previous: list[float] | None = None
        self.stamp_ns: int | None = None
        self.angles: dict[int, float] = {}
        self.turns: dict[int, float] = {}


class Run:
    """The steps of one block; rows are numbered as in the block.

    reasons: row -> column and why it is bad; mended: rows whose rotation was off and normalised
    rounded: what is said of the first of them
    doubted: rows with an angle that looks like degrees, which of the numbers it is, and what is said of it
    """

    def __init__(self, plan: Plan, block: Block, state: State) -> None:
        """Read, transform and check every row of the block."""
        self.plan = plan
        self.request, self.operation = plan.request, plan.request.operation
        self.block = block
        self.reasons: dict[int, tuple[str, str | FrametoolError]] = dict(block.bad)
        self.mended: list[int] = []
        self.rounded: list[RowNote] = []
        self.doubted: list[tuple[int, int, str]] = []
        self.off = 0.0  # how far the worst rotation was from one, of those that are none too far
        self.count = len(block.places)
        numbers = self._read()
        if any(shape.covariance for shape in plan.shapes):
            self._check_covariances(numbers)
        is_cut = self.request.window or block.gone is not None
        self.outside = self._outside() if is_cut and self.count else set[int]()
        movers = self._movers()
        self.lone: int | None = None
        self.columns = list(np.ascontiguousarray(numbers.T))
        with np.errstate(all="ignore"):
            self.moved = moved = self._compute(self.columns, movers, state)
            self._doubt_turns(moved)
            self.results, self.locked = self._results(moved)
        self.rows = np.arange(self.count)
        weights = self._weights() if self.request.weighs and self.count else None
        if self.outside:
            self.reasons = {row: why for row, why in self.reasons.items() if row not in self.outside}
            self.mended = [row for row in self.mended if row not in self.outside]
        if self.reasons or self.outside or self.lone is not None:
            gone = {*self.reasons, *self.outside, self.lone}
            self._keep(np.array([row not in gone for row in range(self.count)], np.bool_))
        if plan.shapes and (plan.shapes[0].place or (plan.targets and plan.targets[0].place)):
            self._note_zones()
        if self.request.gathered:
            kept = np.isin(np.arange(self.count), self.rows)
            for shape, parts in zip(plan.shapes, moved, strict=False):
                self.request.gathered.take(shape, parts, kept, weights, self.block.line_of)
        if self.request.unwrap and len(self.rows):
            _unwrap(self.results, plan.targets[0].angle_columns(), state)

    def _blame(self, row: int, column: str, reason: str | FrametoolError) -> None:
        """Keep the first reason why a row is bad."""
        self.reasons.setdefault(row, (column, reason))

    def _read(self) -> Floats:
        """Read all numbers; those that are none are nan."""
        cells, words = self.block.numbers, self.plan.words
        if not isinstance(cells, Spans):
            return cells
        numbers = self._parsed(cells, self.plan.names, self._read_one)
        for column, word in words.items() if self.count else ():  # also those that look like numbers
            own = coded(Spans(cells.data, cells.starts[:, column], cells.ends[:, column]))
            numbers[:, column], reasons = own.numbers(word)
            for row, reason in reasons.items():
                self._blame(row, self.plan.names[column], reason)
        return numbers

    def _parsed(self, cells: Spans, names: Sequence[str], read_one: Callable[[str, int], float]) -> Floats:
        """Read cells (n, c) as numbers; read_one: reads what is no plain number in a column, or raises ValueInvalid."""
        numbers, bad = parse_floats(cells)
        for row, column in (divmod(place, len(names)) for place in bad.tolist()):
            try:
                numbers[row, column] = read_one(cells.text(row, column).decode("utf-8", "replace").strip(" \t"), column)
            except ValueInvalid as error:
                self._blame(row, names[column], str(error))
        return numbers

    def _check_covariances(self, numbers: Floats) -> None:
        """Refuse rows whose covariance is invalid; sigmas cannot be negative."""
        first = 0
        for shape in self.plan.shapes:
            at = first + shape.own_size
            for size in shape.covariance if not shape.multiple else ():
                own = numbers[:, at : at + size].T
                if shape.sigma or size == 1:
                    what = "sigma is negative: {:g}" if shape.sigma else "scale is {:g}; it must be positive"
                    for row, column in np.argwhere((own < 0.0 if shape.sigma else own <= 0.0).T).tolist():
                        self._blame(row, self.plan.names[at + column], what.format(own[column, row]))
                else:
                    for row, reason in uncertainty.problems(own.T).items():
                        self._blame(row, self.plan.names[at], reason)
                at += size
            first += shape.size

    def _note_zones(self) -> None:
        """Warn of zones of UTM: those of results, and of a southern one that looks like a band."""
        from frametool.stream.earth_columns import doubt_band, zone_notes

        line_of = self.block.line_of
        if (own := self.plan.shapes[0].place) is not None:
            self.rounded += doubt_band(own, self.columns, line_of)
        if (place := self.plan.targets[0].place) is not None and len(self.rows):
            self.rounded += zone_notes(place, [*self.results.T], lambda row: line_of(int(self.rows[row])))

    def _doubt_turns(self, moved: Sequence[Components]) -> None:
        """Warn of the first row whose turn is too uncertain for the first order."""
        operation = self.operation
        for shape, parts in zip(self.plan.shapes or (Shape(POSE),), moved, strict=False):
            if len(operation.carried(shape)) < 36 or operation.uncertain or not self.count:
                continue
            columns = [np.broadcast_to(np.asarray(part), self.count) for part in parts[-36:]]
            for row in np.flatnonzero(columns[21] + columns[28] + columns[35] > uncertainty.WIDE**2).tolist():
                if message := uncertainty.doubt([float(column[row]) for column in columns]):
                    self.rounded.append(RowNote(self.block.line_of(row), uncertainty.WIDE_RULE, message))
                    break

    def _read_one(self, text: str, column: int) -> float:
        """Read an angle, or a length where metres are wanted, which may say its own unit; words are read elsewhere."""
        if column in self.plan.words:
            return 0.0
        if column in self.plan.marked:
            return self.plan.marked[column](text)
        for shape in self.plan.shapes:
            if column < shape.size:
                return read_number_or_angle(text, shape.in_degrees(column), metres=shape.in_metres(column))
            column -= shape.size
        return parse_number(text)

    def _movers(self) -> list[Rigid | None]:
        """Return the pose that moves each point or pose of the rows: of its own frame, at its own time, or none."""
        plan, block, shapes = self.plan, self.block, max(len(self.plan.shapes), 1)
        if not self.count or (self.operation.formula is not None and not self.operation.shown):
            return [None] * shapes
        frames = [[plan.source]] if plan.source else block.sources or [block.names.frames or [None]]
        movers = [self._mover(at, each) for at, each in enumerate(frames)]
        return movers * (shapes // len(movers))  # the rows of a table have one stamp and one frame for all their points

    def _mover(self, at: int, frames: Sequence[str | None]) -> Rigid | None:
        """Return the pose that moves one of the points or poses of the rows, by the frames that it is expressed in."""
        plan, timed = self.plan, self.request.timed
        if timed is not None and len(self.block.stamps[at]):
            times = self._times(at)
            rows = np.delete(np.arange(self.count), [*self.reasons])
            return by_time(timed, times, rows, frames, self._blame, plan.frame_column)
        if plan.edge_of is None:
            return None
        is_one = len(frames) == 1 and (plan.source or self.block.sources)
        return plan.edge_of(frames[0]) if is_one else by_frame(plan.edge_of, frames, self._blame, plan.frame_column)

    def _compute(self, columns: list[Floats], movers: Sequence[Rigid | None], state: State) -> list[Components]:
        """Apply the operation to each point or pose of the rows."""
        shapes, operation = self.plan.shapes, self.operation
        if operation.of == PAIR or not shapes:
            poses = [thing_pose(shape, own[: shape.own_size], turn) for shape, own, turn in self._things(columns)]
            return [operation.pose(poses or [NOWHERE], movers[0], arrays)]
        needs_time = operation.formula is not None and operation.formula.needs_time
        times = [self._times(at) for at in range(len(shapes))] if needs_time else []
        found = []
        for at, (mover, (shape, numbers, rotation)) in enumerate(zip(movers, self._things(columns), strict=False)):
            parts = operation.result(
                shape, numbers, mover, arrays, rotation=rotation,
                compared=lambda pose: self._with_before(pose, state) if operation.looks_back else [pose],
                seconds=lambda: self._seconds(state), times_ns=times[at] if times else None,
            )  # fmt: skip
            if operation.formula is not None:  # what an expression makes of no row is that of each
                parts = tuple(np.full(self.count, part) if type(part) is float else part for part in parts)
            found.append(parts)
        return found

    def _things(self, columns: list[Floats]) -> Iterator[tuple[Shape, Components, Callable[[Components], Components]]]:
        """Yield each shape of the rows with its columns, and what reads and checks its rotation."""
        first = 0
        for shape in self.plan.shapes:
            yield shape, tuple(columns[first : first + shape.size]), partial(self._rotation, shape, first)
            first += shape.size

    def _times(self, at: int = 0) -> Ints:
        """Read the stamps of the rows."""
        stamps = self.block.stamps[at]
        if not isinstance(stamps, tuple):
            return stamps
        if not stamps:
            raise ValueInvalid("rows have no stamps; there is no velocity")
        timed, extra = self.request.timed, self.request.extra_column or ""
        in_ns = timed.in_ns if timed else len(stamps) == 1 and in_nanoseconds(extra)
        times, reasons = read_stamps(stamps, in_ns=in_ns)
        for row, reason in reasons.items():
            self._blame(row, timed.column if timed else extra, reason)
        return times

    def _weights(self) -> Any:
        """Return the weights of rows, or their labels; a row with none, or a negative weight, is bad."""
        weights: Any = self.block.stamps[0]
        name = self.request.extra_column or ""
        cells = weights[0] if isinstance(weights, tuple) else None
        if self.request.gathered is not None and self.request.gathered.labelled:
            return weights if cells is None else np.array(texts_of(cells), object)
        if cells is not None:
            column = Spans(cells.data, cells.starts[:, None], cells.ends[:, None])
            weights = self._parsed(column, [name], lambda text, _: parse_number(text.strip("\"'")))[:, 0]
        for row in np.flatnonzero(weights < 0.0).tolist():
            self._blame(row, name, f"weight {weights[row]:g} is negative")
        return weights

    def _good(self) -> list[int]:
        return [row for row in range(self.count) if row not in self.reasons and row not in self.outside]

    def _outside(self) -> set[int]:
        """Return the rows without numbers, and those before the first or after the last time that is wanted."""
        gone = set[int]() if self.block.gone is None else {*self.block.gone.tolist()}
        if self.request.window is None:
            return gone
        first, last = self.request.window
        times = self._times()
        return gone | ({*np.flatnonzero((times < first) | (times > last)).tolist()} - {*self.reasons})

    def _with_before(self, pose: Rigid, state: State) -> list[Any]:
        """Return the good row before each row, or the first of all, and the row; the very first row's is itself."""
        full = [np.broadcast_to(np.asarray(part, np.float64), self.count) for part in pose]
        kept = np.array(self._good(), np.int64)
        known, first = state.previous, self.operation.of == START
        if len(kept) and (known is None or not first):
            state.previous = [float(part[kept[0 if first else -1]]) for part in full]
        if first and state.previous is not None:
            return [tuple(np.full(self.count, value) for value in state.previous), tuple(full)]
        if first or not len(kept):
            return [pose, pose]
        earlier = [part[kept[np.maximum(np.searchsorted(kept, np.arange(self.count)) - 1, 0)]] for part in full]
        for part, value in zip(earlier, known or (), strict=False):
            part[: kept[0] + 1] = value
        return [tuple(earlier), tuple(full)]

    def _seconds(self, state: State) -> Floats:
        """Return the time since the good row before each; the very first row has no velocity and no result."""
        seconds = np.ones(self.count)
        stamps = self._times() if self.count else seconds
        if not (good := self._good()):
            return seconds
        at, known = stamps[good], state.stamp_ns
        before = np.concatenate([[at[0] - BILLION if known is None else known], at[:-1]])
        steps = at - before
        for index in np.flatnonzero(steps <= 0).tolist():
            reason = no_step(int(before[index]), int(at[index]))
            self._blame(good[index], self.request.extra_column or "", reason)
        seconds[good] = np.where(steps > 0, steps, BILLION) / BILLION
        self.lone = good[0] if known is None else None
        state.stamp_ns = int(at[-1])
        return seconds

    def _rotation(self, shape: Shape, first: int, numbers: Components) -> Components:
        """Return the checked quaternions of a shape whose numbers begin at the column `first`."""
        if shape.notation is None:
            return IDENTITY
        values = list(shape.rotation(numbers))
        names = self.plan.names[first : first + shape.size]
        if shape.joined:
            self._check_tail(numbers, names, shape.joined.tail)
        found = read_rotations(shape.notation, values, degrees=shape.degrees, normalize=self.request.normalize)
        rule = shape.notation.representation.batch
        is_text = isinstance(self.block.numbers, Spans)
        if is_text and rule and rule.explained and (found.mended.size or found.reasons):
            self._take_as_meant(rule, values, [first + at for at in shape.rotation_at], {*found.mended, *found.reasons})
            found = read_rotations(shape.notation, values, degrees=shape.degrees, normalize=self.request.normalize)
        for row, reason in found.reasons.items():
            self._blame(row, names[shape.rotation_at[0]], reason)
        if found.mended.size and not self.rounded:
            row = int(found.mended[0])
            own = [float(column[row]) for column in numbers]
            _, warned = checked_rotation(shape, own, normalize=self.request.normalize)
            place = self._place(row, first + shape.rotation_at[0])
            self.rounded += [RowNote(place[0], rule, sentence, place[1]) for rule, sentence in warned]
        self.mended += found.mended.tolist()
        self.off = max(self.off, found.off)
        self._doubt(shape, values, first)
        return found.quaternions

    def _take_as_meant(self, rule: BatchRule, values: list[Floats], places: Sequence[int], rough: set[int]) -> None:
        """Replace the rotations of rows that are off by no more than the digits they are written with."""
        rows, cells = np.array(sorted(rough), np.int64), cast("Spans", self.block.numbers)
        own = [column[rows] for column in values]
        halves = [half_units(Spans(cells.data, cells.starts[rows, at], cells.ends[rows, at])) for at in places]
        meant = rule.explained is not None and rule.explained(own, halves, arrays)
        off = rule.deviation(*own, arrays)
        far = np.flatnonzero(meant & (off > quaternion.TOLERATED) & (off < np.inf) & (not self.request.normalize))
        self.mended += rows[far].tolist()
        for at in far[: not self.rounded].tolist():
            line, column = self._place(int(rows[at]), places[0])
            self.rounded.append(RowNote(line, "rounded", FEW_DIGITS.format(off[at]), column))
        for at, numbers in enumerate(rule.repair(*own, arrays)):
            values[at] = values[at].copy()
            values[at][rows] = np.where(meant, numbers, own[at])

    def _doubt(self, shape: Shape, values: Sequence[Floats], first: int) -> None:
        """Wonder about the first row with a bare angle beyond a full turn."""
        angles = shape.bare_angles
        if not angles:
            return
        beyond = np.flatnonzero(np.max([abs(values[at]) for at in angles], axis=0) > TURN)
        if beyond.size:
            row = int(beyond[0])
            at = max(angles, key=lambda at: abs(values[at][row]))
            remedy = self.plan.remedies[self.plan.shapes.index(shape)] if self.plan.remedies else COLUMNS_REMEDY
            self.doubted.append((row, first + shape.number_at(at), doubt(shape, values[at][row], remedy)))

    def note_of_degrees(self, row: int, number: int, sentence: str) -> RowNote:
        """Return what is worth telling about an angle, with its place."""
        line, column = self._place(row, number)
        return RowNote(line, DEGREES, sentence, column)

    def _place(self, row: int, number: int) -> tuple[int, str]:
        """Return line and column of one of a row's numbers."""
        place_of = self.block.place_of
        return (self.block.line_of(row), self.plan.names[number]) if place_of is None else place_of(row, number)

    def _check_tail(self, numbers: Components, names: Sequence[str], tail: Sequence[float]) -> None:
        """Refuse rows whose last numbers are not what they always are: 0 0 0 1 of a 4x4 matrix."""
        first = len(numbers) - len(tail)
        wrong = {row for at, each in enumerate(tail) for row in np.flatnonzero(numbers[first + at] != each).tolist()}
        for row in wrong:
            self._blame(row, names[first], wrong_tail(tail, [number[row] for number in numbers[first:]]))

    def _results(self, moved: list[Components]) -> tuple[Floats, Ints]:
        """Return the results as rows of numbers, and where angles are not unique; what is not finite is bad."""
        numbers: list[Floats] = []
        locked = np.zeros(self.count, np.int64)
        for target, parts in zip(self.plan.targets, moved, strict=True):
            numbers += target.written(parts, arrays)
            for name, number in target.left_out(parts, arrays):
                for row in np.flatnonzero(abs(number) > FLAT).tolist():
                    self._blame(row, "", LEAVES_PLANE.format(name, number[row]))
            if target.notations and (flags := target.locked(parts)) is not None:
                locked |= flags
        results = np.empty((self.count, len(numbers)))
        for column, number in enumerate(numbers):
            results[:, column] = number
        results += 0.0  # none is -0.0
        if not np.isfinite(results.sum()):
            wrong = np.isinf(results) if self.operation.shown else ~np.isfinite(results)  # nan may be a formula's
            rows = np.asarray(wrong.any(axis=1))
            rows[[*self.outside]] = False
            for row in np.flatnonzero(rows).tolist():
                if row not in self.reasons:
                    self._blame(row, *self._why_not_finite(row, moved))
        return results, locked

    def _why_not_finite(self, row: int, moved: Sequence[Components]) -> tuple[str, str | FrametoolError]:
        """Return the column and the reason why a row has no finite result."""
        operation, first = self.operation, 0
        for at, (shape, columns, _) in enumerate(self._things(self.columns)):
            own = tuple(float(column[row]) for column in columns)
            times = int(self._times(at)[row]) if operation.formula and operation.formula.needs_time else None
            try:
                if operation.formula:  # for one row alone, it says so itself
                    operation.result(
                        shape, own, None, floats, times_ns=times, compared=lambda pose: [pose], seconds=float,
                        rotation=partial(_checked, shape),
                    )  # fmt: skip
                elif shape.place is not None:
                    shape.place.check(own[: shape.place.size])
            except FrametoolError as error:
                return "" if operation.formula else self.plan.names[first], error
            first += shape.size
        for target, parts in zip(self.plan.targets, moved, strict=True):
            try:
                if target.place is not None and not operation.formula:
                    target.place.check_result(*(float(np.broadcast_to(part, self.count)[row]) for part in parts[:3]))
            except ValueInvalid as error:
                return "", error
        return "", "the result is not finite: the numbers are too large"

    def _keep(self, kept: Flags) -> None:
        self.rows, self.results, self.locked = self.rows[kept], self.results[kept], self.locked[kept]

    def refuse(self, rows: Sequence[int], reason: str) -> None:
        """Take results back: these rows are bad."""
        for row in rows:
            self._blame(row, "", reason)
        self._keep(~np.isin(self.rows, rows))

    def settled(self) -> tuple[Ints, Floats]:
        """Return the rows that stay, and their numbers: nan in those that have none on purpose, or are null."""
        if len(self.rows) == self.count:
            return self.rows, self.results
        gone = [] if self.block.gone is None else self.block.gone.tolist()
        nulls = self.reasons if self.request.on_error == NULL else ()
        rows = np.array(sorted({*self.rows.tolist(), *gone, *nulls}), np.int64)
        numbers = np.full((len(rows), self.results.shape[1]), np.nan)
        numbers[np.searchsorted(rows, self.rows)] = self.results
        return rows, numbers

    def first_fault(self) -> int | None:
        """Return the place of the first bad row, if the run stops there."""
        if self.request.on_error != STOP or not (self.reasons or self.block.broken):
            return None
        return int(min([*self.block.places[[*self.reasons]].tolist(), *(place for place, _ in self.block.broken)]))

    def groups(self, end: int | None) -> list[tuple[Ints, list[Spans]]]:
        """Return what is written before place `end`: results, rows without one, and what passes."""
        unchanged = list(self.block.unchanged)
        if end is not None:
            self._keep(self.block.places[self.rows] < end)
            unchanged = [(place, text) for place, text in unchanged if place < end]
        groups = [] if self.request.gathered or not len(self.rows) else [self._written()]
        if self.request.on_error == NULL and self.reasons:
            rows = np.array(sorted(self.reasons), np.int64)
            pieces = [_without_result(piece, self.plan.null) for piece in self.plan.pieces]
            groups.append((self.block.places[rows], assemble(pieces, self._parts(rows), None, np.zeros_like(rows))))
        return [*groups, texts_as_rows(unchanged)] if unchanged else groups

    def _parts(self, rows: Ints) -> Sequence[Spans]:
        return self.block.parts if len(rows) == self.count else [chosen(part, rows) for part in self.block.parts]

    def _written(self) -> tuple[Ints, list[Spans]]:
        """Return the places and the text of the results."""
        plan, values = self.plan, None
        if self.results.shape[1]:
            write = partial(numbers_or_null, plan.pieces, plan.null) if self.operation.shown else number_spans
            after = separators(plan.pieces, self.results.shape[1])
            values = write(self.results, self.request.precision, after, yaml=plan.yaml)
        text = assemble(plan.pieces, self._parts(self.rows), values, self.locked, self.results)
        return self.block.places[self.rows], text

    def faults(self) -> list[Fault]:
        """Return what is wrong, line by line."""
        found = [fault for _, fault in self.block.broken]
        for row, (column, reason) in self.reasons.items():
            found.append(Fault.of(self.block.line_of(row), column, reason))
        return sorted(found)


def _checked(shape: Shape, own: Components) -> Components:
    """Return the quaternion of one row's numbers, which was checked before."""
    return checked_rotation(shape, own, normalize=True)[0]


def _without_result(piece: Piece, null: bytes) -> Piece:
    """Return what is in a row without a result: nulls for its numbers, the input for what was put in its place."""
    if isinstance(piece, Out):
        return Const(piece.between.join([null] * (piece.last - piece.first)))
    if isinstance(piece, Word):
        return Const(null)
    return In(piece.part) if isinstance(piece, Instead) else piece


def _unwrap(results: Floats, angles: Sequence[tuple[int, float]], state: State) -> None:
    """Add full turns to angles, in place, so that no step is larger than half a turn."""
    for column, period in angles:
        values = results[:, column].copy()
        before = np.concatenate([[state.angles.get(column, values[0])], values[:-1]])
        turns = state.turns.get(column, 0.0) - np.cumsum(np.rint((values - before) / period))
        results[:, column] = values + period * turns
        state.angles[column], state.turns[column] = float(values[-1]), float(turns[-1])
