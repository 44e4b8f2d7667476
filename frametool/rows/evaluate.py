"""Compute one block of rows as arrays: read and check its numbers, apply the operation, and collect the faults."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from itertools import accumulate, zip_longest
from operator import itemgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from frametool.errors import FrametoolError, NamedTuple
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry import arrays, floats, quaternion, uncertainty
from frametool.geometry.representations import UPPER_ROWS, BatchRule
from frametool.geometry.rigid import EXACT, UNCERTAIN
from frametool.geometry.validation import read_rotations
from frametool.grammar.edges import PROJECTED_IN_SILENCE, projection
from frametool.grammar.pose import FEW_DIGITS
from frametool.rows import shapes
from frametool.rows.batch import Block, assemble, chosen, coded, read_each, texts_as_rows
from frametool.rows.faults import DEGREES, NULL, STOP, Fault, RowNote
from frametool.rows.request import PAIR, START, VELOCITIES, Request, thing_pose
from frametool.rows.shapes import LEAVES_PLANE, NOWHERE, POSE, TURN, Shape, checked_rotation, doubt, wrong_tail
from frametool.text.parse import half_units, parse_floats
from frametool.text.spans import Flags, Floats, Ints, Spans

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.geometry import Components, Rigid
    from frametool.rows.sinks import Piece

COLUMNS_REMEDY = "give --deg, or name the columns _deg"


class Plan(NamedTuple):
    """The columns, the operation and the output of all rows of one layout.

    shapes: the points or poses of a row; targets: the shapes of its results
    names: the columns of all numbers of the shapes, for messages
    pieces: the text of a result; null: if b"", nan is an empty cell
    edge_of: returns the pose that moves a row, or one of its shapes, by the frame it is expressed in
    frame_column: the name of the column that names frames
    degree_hints: for each shape, the remedy if its angles are in degrees
    categorical: readers of words for numbers, such as UTM zones, by index; dms_columns: readers of cells that
        `Shape.read` cannot read, such as degrees and minutes
    yaml: numbers need a point before the exponent
    """

    shapes: tuple[Shape, ...]
    targets: tuple[Shape, ...]
    request: Request
    names: tuple[str, ...]
    pieces: tuple[Piece, ...] = ()
    null: bytes = b""
    edge_of: Callable[..., Rigid] | None = None
    frame_column: str = ""
    degree_hints: tuple[str, ...] = ()
    categorical: Mapping[int, Callable[[str], float]] = MappingProxyType({})
    dms_columns: Mapping[int, Callable[[str], float]] = MappingProxyType({})
    yaml: bool = False


@dataclass(slots=True)
class State:
    """The state that a block passes on to the next.

    previous: the row that the next one is compared with; frame: that of all rows; stamp_ns: that of the last row
    angles: for each unwrapped angle its last value and the full turns added to it
    """

    previous: Floats | None = None
    frame: str | None = None
    stamp_ns: int | None = None
    angles: dict[int, tuple[float, float]] = field(default_factory=dict)


class Run:
    """The computation of one block; rows are indices in the block.

    reasons: for each bad row the column and the reason; rows: the rows that have a result
    columns, moved: the numbers as read, and the components of the results
    results, locked: (n, k) the numbers to write, and (n,) 1 in rows whose Euler angles are not unique
    things: for each shape of the rows the shape, the index of its first number, and its columns
    mended: rows whose rotation was normalised; off: the largest deviation from a rotation
    doubted: an angle that looks like degrees was reported; notes: warnings
    absent: rows without a result that are not bad: without numbers, outside the requested times, or the first of
        velocities
    """

    def __init__(self, plan: Plan, block: Block, state: State) -> None:
        """Read, transform and check every row of the block."""
        self.plan, self.block, self.state, self.count = plan, block, state, len(block.places)
        self.request, self.operation = plan.request, plan.request.operation
        self.reasons: dict[int, tuple[str, str | FrametoolError]] = dict(block.bad)
        self.absent = set[int]() if block.gone is None else {*block.gone.tolist()}
        self.mended, self.notes = list[int](), list[RowNote]()
        self.doubted, self.off = False, 0.0
        self.columns = [*np.ascontiguousarray(self._read().T)]
        starts = zip(plan.shapes, accumulate([shape.size for shape in plan.shapes], initial=0), strict=False)
        self.things = [(shape, first, (*self.columns[first : first + shape.size],)) for shape, first in starts]
        self._check_covariances()
        if self.count and self.request.window:
            (first, last), times = self.request.window, block.stamps[0]
            self.absent |= {*np.flatnonzero((times < first) | (times > last)).tolist()} - {*self.reasons}
        with np.errstate(all="ignore"):
            self.moved = self._compute()
            self.results, self.locked = self._results()
        if self.absent:
            self.reasons = {row: why for row, why in self.reasons.items() if row not in self.absent}
            self.mended = [row for row in self.mended if row not in self.absent]
        self.rows = np.delete(np.arange(self.count), [*self.reasons, *self.absent])
        self._note_block()
        for column, period in plan.targets[0].angle_columns() if self.request.results.unwrap and len(self.rows) else ():
            values = self.results[self.rows, column]  # add full turns, so that no step exceeds half a turn
            last, turns = state.angles.get(column, (values[0], 0.0))
            every = turns - np.cumsum(np.rint((values - np.concatenate([[last], values[:-1]])) / period))
            self.results[self.rows, column] = values + period * every
            state.angles[column] = float(values[-1]), float(every[-1])

    def _good(self) -> Ints:
        """Return the rows that are neither bad nor absent so far."""
        return np.delete(np.arange(self.count), [*self.reasons, *self.absent])

    def _blame(self, rows: Ints | int, column: str, reason: str | FrametoolError) -> None:
        """Store why rows are bad, unless they have a reason already."""
        for row in np.ravel(rows).tolist():
            self.reasons.setdefault(row, (column, reason))

    def _note(self, row: int, number: int, about: str, sentence: str) -> None:
        """Warn about one number of a row."""
        place_of = self.block.place_of
        place = (self.block.line_of(row), self.plan.names[number]) if place_of is None else place_of(row, number)
        self.notes.append(RowNote(place[0], about, sentence, place[1]))

    def _read(self) -> Floats:
        """Return all numbers (n, c); nan where a cell cannot be read."""
        cells, plan = self.block.numbers, self.plan
        if not isinstance(cells, Spans):
            return cells
        numbers, bad = parse_floats(cells)
        width = max(len(plan.names), 1)
        readers = [partial(shape.read, at) for shape in plan.shapes for at in range(shape.size)] if len(bad) else []

        def read(at: int) -> float:
            """Read a cell that is not a plain number; cells with words are read below."""
            text, column = cells.text(*divmod(at, width)).decode("utf-8", "replace").strip(" \t"), at % width
            reader = plan.dms_columns.get(column) or readers[column]
            return 0.0 if column in plan.categorical else reader(text)

        for at, reason in read_each(numbers.reshape(-1), bad.tolist(), read).items():
            self._blame(at // width, plan.names[at % width], reason)
        for column, word in plan.categorical.items() if self.count else ():  # also words that look like numbers
            own = coded(Spans(cells.data, cells.starts[:, column], cells.ends[:, column]))
            numbers[:, column], reasons = own.numbers(word)
            for row, reason in reasons.items():
                self._blame(row, plan.names[column], reason)
        return numbers

    def _check_covariances(self) -> None:
        """Refuse rows with an invalid covariance, a negative sigma, or a scale that is not positive."""
        for shape, first, _ in self.things:
            at = first + shape.own_size
            for size in () if self.operation.reads_scale(shape) else shape.covariance:
                own = self.columns[at : at + size]
                what = "sigma is negative: {:g}" if shape.sigma else "scale is {:g}; it must be positive"
                for number, column in enumerate(own if shape.sigma or size == 1 else (), at):
                    for row in np.flatnonzero(column < 0.0 if shape.sigma else column <= 0.0).tolist():
                        self._blame(row, self.plan.names[number], what.format(column[row]))
                if not shape.sigma and size > 1:
                    for row, reason in uncertainty.problems(np.stack(own, axis=1)).items():
                        self._blame(row, self.plan.names[at], reason)
                at += size

    def _note_block(self) -> None:
        """Warn once per block about lost names, projected matrices, wide covariances, and the zones of UTM."""
        line_of, shapes, targets, lost = self.block.line_of, self.plan.shapes, self.plan.targets, self.block.names.lost
        self.notes += map(RowNote.of_lost_name, map(line_of, lost), lost.values())
        if shapes and shapes[0].notation is UPPER_ROWS and self.off > PROJECTED_IN_SILENCE:
            self.notes.append(RowNote(line_of(0), "projected", projection(self.off)))
        for shape, parts in zip(shapes or (Shape(POSE),), self.moved, strict=False):
            if len(self.operation.carried(shape)) < 36 or self.operation.uncertain or not self.count:
                continue
            columns = [np.broadcast_to(np.asarray(part), self.count) for part in parts[-36:]]
            with np.errstate(all="ignore"):
                wide = np.flatnonzero(columns[21] + columns[28] + columns[35] > uncertainty.WIDE**2)
            for row in wide.tolist():  # report the first row whose rotation is too uncertain for the first order
                if message := uncertainty.doubt([float(column[row]) for column in columns]):
                    self.notes.append(RowNote(line_of(row), uncertainty.WIDE_RULE, message))
                    break
        if shapes and (shapes[0].place or (targets and targets[0].place)):
            from frametool.rows.columns_earth import doubt_band, zone_notes

            if (own := shapes[0].place) is not None:
                self.notes += doubt_band(own, self.columns, line_of)
            if (place := targets[0].place) is not None and len(self.rows):
                self.notes += zone_notes(place, [*self.results[self.rows].T], lambda at: line_of(int(self.rows[at])))

    def _mover(self, at: int) -> Rigid | None:
        """Return the pose that moves shape `at` of the rows, by frame or at their stamps; None if nothing moves it."""
        plan, operation, timed, count = self.plan, self.operation, self.request.timed, self.count
        (frames, numbers), stamps = self.block.frames[at], self.block.stamps
        times = stamps[at] if timed is not None and len(stamps) > at else None
        if not count or (operation.formula is not None and not operation.shown):
            return None
        if times is None and (plan.edge_of is None or numbers is None):
            return plan.edge_of and plan.edge_of(frames[0])
        return self._movers(self.block.frames[at].of_rows(count), frames, times)

    def _movers(self, codes: Ints, frames: Sequence[Any], times: Ints | None) -> Rigid:
        """Return the pose of each row by its frame, or at its stamp; a row without such a pose is bad."""
        plan, timed, count = self.plan, self.request.timed, self.count
        if timed is None or times is None:
            edges: list[Rigid] = []
            for code, name in enumerate(frames):
                try:
                    edges.append(plan.edge_of(name))  # type: ignore[misc]
                except FrametoolError as error:
                    edges.append(NOWHERE)
                    self._blame(np.flatnonzero(codes == code), plan.frame_column, error)
            return tuple(np.array(each)[codes] for each in zip_longest(*edges, fillvalue=0.0))  # type: ignore[return-value]
        good, poses = np.delete(np.arange(count), [*self.reasons]), np.full((timed.width, count), np.nan)
        for code, frame in enumerate(frames):
            some = good[codes[good] == code] if len(frames) > 1 else good
            try:
                poses[:, some] = timed.many(frame, times[some])
            except FrametoolError as error:
                self._blame(some, plan.frame_column, error)
                continue
            for row in some[np.isnan(poses[6, some])].tolist():  # a single look-up raises the reason
                try:
                    timed.one(frame, int(times[row]))
                    self._blame(row, timed.column, "no data")
                except FrametoolError as error:
                    self._blame(row, timed.column, error)
        return tuple(poses)  # type: ignore[return-value]

    def _compute(self) -> list[Components]:
        """Return the components of the result for each point or pose of the rows."""
        operation = self.operation
        if operation.of == PAIR or not self.things:
            poses = [
                thing_pose(shape, own[: shape.own_size], partial(self._rotation, shape, first))
                for shape, first, own in self.things
            ]
            return [operation.pose(poses or [NOWHERE], self._mover(0), arrays)]
        needs_time = operation.formula is not None and operation.formula.needs_time
        found, mover = [], None
        for at, (shape, first, numbers) in enumerate(self.things):
            if at < len(self.block.frames):  # in a table all points of a row share one stamp and frame
                mover = self._mover(at)
            parts = operation.result(
                shape, numbers, mover, arrays, rotation=partial(self._rotation, shape, first),
                before=self._before if operation.looks_back else None,
                times_ns=self.block.stamps[at] if needs_time else None,
            )  # fmt: skip
            if operation.formula is not None:  # a result without inputs from rows is the same in all rows
                parts = tuple(np.full(self.count, part) if type(part) is float else part for part in parts)
            found.append(parts)
        return found

    def _before(self, pose: Rigid) -> tuple[list[Any], Floats]:
        """Return the pose to compare with (of the good row before, or the first), the own one, and the seconds between.

        The first row of all is compared with itself, and then both count as exact.
        """
        good, state, seconds = self._good(), self.state, np.ones(self.count)
        itself = good[: state.previous is None]
        if not len(good):
            return [pose, pose], seconds
        full = np.stack([np.broadcast_to(np.asarray(part, np.float64), self.count) for part in pose])
        counts = self.request.counts if not self.plan.frame_column else lambda _: False  # already removed in a table
        frames = [None if each and counts(each) else each for each in self.block.frames[0].texts]
        codes = self.block.frames[0].of_rows(self.count)[good]
        if state.previous is None:
            state.previous, state.frame = full[:, good[0]].copy(), frames[codes[0]]
        reason = f"given in another frame than {state.frame!r}, as the rows before are"
        reason = reason if state.frame else "given in a frame, as the rows before are not"
        others = np.array([each != state.frame for each in frames])[codes]
        self._blame(good[others], self.plan.frame_column, reason)
        if not len(good := good[~others]):
            return [pose, pose], seconds
        before = state.previous
        if len(before) > len(full):
            what = "what it is compared with has a covariance, which this one has not"
            self._blame(good[: None if self.operation.of == START else 1], "", what)
        before = np.append(before, np.zeros(UNCERTAIN - EXACT))[: len(full)]  # without a covariance: exact
        earlier = np.repeat(before[:, None], self.count, axis=1)
        if self.operation.of != START:
            later = np.arange(good[0] + 1, self.count)
            earlier[:, later] = full[:, good[np.searchsorted(good, later) - 1]]
            state.previous = full[:, good[-1]].copy()
        earlier[EXACT:, itself] = full[EXACT:, itself] = 0.0
        if self.operation.of == VELOCITIES and len(good := self._good()):
            seconds[good] = self._seconds(good, self.block.stamps[0][good])
        return [tuple(earlier), tuple(full)], seconds

    def _seconds(self, good: Ints, stamps: Ints) -> Floats:
        """Return the seconds since the good row before each; the first row of all has no velocity and is absent."""
        known = self.state.stamp_ns
        before = np.concatenate([[stamps[0] - BILLION if known is None else known], stamps[:-1]])
        steps = stamps - before
        for index in np.flatnonzero(steps <= 0).tolist():
            last, now = format_stamp(int(before[index])), format_stamp(int(stamps[index]))
            what = "is that of the row before" if now == last else f"is before {last}, of the row before"
            reason = f"stamp {now} {what}: there is no velocity"
            self._blame(int(good[index]), self.request.rows.stamp_or_weight_column or "", reason)
        if known is None:
            self.absent.add(int(good[0]))
        self.state.stamp_ns = int(stamps[-1])
        return np.where(steps > 0, steps, BILLION) / BILLION

    def _rotation(self, shape: Shape, first: int, numbers: Components) -> Components:
        """Return the checked quaternions of a shape whose numbers begin at column `first`."""
        if shape.notation is None:
            return shapes.IDENTITY
        values, names = list(shape.rotation(numbers)), self.plan.names[first : first + shape.size]
        tail = shape.joined.tail if shape.joined else ()  # the last row of a 4x4 matrix is 0 0 0 1
        last = numbers[len(numbers) - len(tail) :]
        for row in {row for at, each in enumerate(tail) for row in np.flatnonzero(last[at] != each).tolist()}:
            self._blame(row, names[-len(tail)], wrong_tail(tail, [number[row] for number in last]))
        read = partial(read_rotations, shape.notation, degrees=shape.degrees, normalize=self.request.rows.normalize)
        found = read(values)
        rule = shape.notation.representation.batch
        is_text = isinstance(self.block.numbers, Spans)
        if is_text and rule and rule.explained and (found.mended.size or found.reasons):
            self._take_as_meant(rule, values, [first + at for at in shape.rotation_at], {*found.mended, *found.reasons})
            found = read(values)
        for row, reason in found.reasons.items():
            self._blame(row, names[shape.rotation_at[0]], reason)
        for row in found.mended[:1].tolist():
            own = [float(column[row]) for column in numbers]
            for about, sentence in checked_rotation(shape, own, normalize=self.request.rows.normalize)[1]:
                self._note(row, first + shape.rotation_at[0], about, sentence)
        self.mended += found.mended.tolist()
        self.off = max(self.off, found.off)
        angles = shape.bare_angles
        beyond = np.flatnonzero(np.max([abs(values[at]) for at in angles], axis=0) > TURN) if angles else np.empty(0)
        if beyond.size and not self.doubted:
            self.doubted, row = True, int(beyond[0])
            at = max(angles, key=lambda at: abs(values[at][row]))
            remedy = self.plan.degree_hints[self.plan.shapes.index(shape)] if self.plan.degree_hints else COLUMNS_REMEDY
            self._note(row, first + shape.number_at(at), DEGREES, doubt(shape, values[at][row], remedy))
        return found.quaternions

    def _take_as_meant(self, rule: BatchRule, values: list[Floats], places: Sequence[int], rough: set[int]) -> None:
        """Repair rotations whose deviation is no larger than the rounding of their printed digits."""
        rows, cells = np.array(sorted(rough), np.int64), cast("Spans", self.block.numbers)
        own = [column[rows] for column in values]
        halves = [half_units(Spans(cells.data, cells.starts[rows, at], cells.ends[rows, at])) for at in places]
        meant = rule.explained is not None and rule.explained(own, halves, arrays)
        off = rule.deviation(*own, arrays)
        far = np.flatnonzero(meant & (off > quaternion.TOLERATED) & (off < np.inf) & (not self.request.rows.normalize))
        self.mended += rows[far].tolist()
        for at in far[:1].tolist():
            self._note(int(rows[at]), places[0], "rounded", FEW_DIGITS.format(off[at]))
        for at, numbers in enumerate(rule.repair(*own, arrays)):
            values[at] = values[at].copy()
            values[at][rows] = np.where(meant, numbers, own[at])

    def _results(self) -> tuple[Floats, Ints]:
        """Return the results as rows of numbers, and where angles are not unique; rows that are not finite are bad."""
        numbers: list[Floats] = []
        locked = np.zeros(self.count, np.int64)
        for target, parts in zip(self.plan.targets, self.moved, strict=True):
            numbers += target.written(parts, arrays)
            for name, number in target.left_out(parts, arrays):
                for row in np.flatnonzero(abs(number) > shapes.FLAT).tolist():
                    self._blame(row, "", LEAVES_PLANE.format(name, number[row]))
            if target.notations and (flags := target.locked(parts)) is not None:
                locked |= flags
        # without rows there are no movers, and the covariances are missing in `numbers`
        width = len(numbers) if self.count else sum(target.size for target in self.plan.targets)
        results = np.empty((self.count, width))
        for column, number in enumerate(numbers):
            results[:, column] = number
        results += 0.0  # no -0.0
        if not np.isfinite(results.sum()):
            wrong = np.isinf(results) if self.operation.shown else ~np.isfinite(results)  # nan of a formula is valid
            for row in np.flatnonzero(wrong.any(axis=1)).tolist():
                if row not in self.reasons and row not in self.absent:
                    self._blame(row, *self._why_not_finite(row))
        return results, locked

    def _why_not_finite(self, row: int) -> tuple[str, str | FrametoolError]:
        """Return the column and the reason for a row without a finite result."""
        formula, column = self.operation.formula, ""
        try:
            for at, (shape, first, columns) in enumerate(self.things):
                own = tuple(float(each[row]) for each in columns)
                if formula is not None:  # for a single row it raises the reason
                    stamp_ns = int(self.block.stamps[at][row]) if formula.needs_time else None
                    checked = lambda numbers, shape=shape: checked_rotation(shape, numbers, normalize=True)[0]  # noqa: E731
                    self.operation.result(shape, own, None, floats, rotation=checked, times_ns=stamp_ns)
                elif shape.place is not None:
                    column = self.plan.names[first]
                    shape.place.check(own[: shape.place.size])
            column = ""
            for target, parts in zip(self.plan.targets, self.parts_of(row), strict=True):
                if target.place is not None and formula is None:
                    target.place.check_result(*parts[:3])
        except FrametoolError as error:
            return column, error
        return "", "the result is not finite: the numbers are too large"

    def refuse(self, wrong: Flags, reason: str) -> None:
        """Mark rows as bad although they have a result."""
        if wrong.any():
            self._blame(self.rows[wrong[self.rows]], "", reason)
            self.rows = self.rows[~wrong[self.rows]]

    def settled(self, before: int | None = None) -> tuple[Ints, Floats]:
        """Return the rows to write and their numbers; nan in rows without a result that are kept.

        before: the position at which the output ends; None for all rows
        """
        if before is None and len(self.rows) == self.count:
            return self.rows, self.results
        has_result, stays = np.zeros((2, self.count), np.bool_)
        has_result[self.rows] = stays[self.rows] = True
        stays[[*self.reasons] if self.request.on_error == NULL else []] = True
        if self.block.gone is not None:
            stays[self.block.gone] = True
        rows = np.flatnonzero(stays if before is None else stays & (self.block.places < before))
        results = self.results[rows]
        results[~has_result[rows]] = np.nan
        return rows, results

    @property
    def end(self) -> int | None:
        """Return the position of the bad row that ends the stream; None if there is none."""
        if self.request.on_error != STOP or not (self.reasons or self.block.broken):
            return None
        first: int = min([*self.block.places[[*self.reasons]].tolist(), *(place for place, _ in self.block.broken)])
        return first

    def groups(self, parts: Mapping[Any, Spans], before: int | None = None) -> list[tuple[Ints, list[Spans]]]:
        """Return the spans to write: those of rows with their results, and those of unchanged text.

        parts: the spans (n,) that pieces refer to
        before: the position at which the output ends; None for `end`
        """
        before = self.end if before is None else before
        (rows, results), locked, plan, places = self.settled(before), self.locked, self.plan, self.block.places
        unchanged = self.block.unchanged
        if before is not None:
            unchanged = [(place, text) for place, text in unchanged if place < before]
        groups = []
        if len(rows):
            if len(rows) < self.count:  # else nothing is copied
                locked, parts = locked[rows], {key: chosen(part, rows) for key, part in parts.items()}
            precision = self.request.results.precision
            text = assemble(plan.pieces, parts, results, locked, precision, yaml=plan.yaml, null=plan.null)
            groups.append((places[rows], text))
        return [*groups, texts_as_rows(unchanged)] if unchanged else groups

    def parts_of(self, row: int) -> list[tuple[float, ...]]:
        """Return the components of the result for each point or pose of a row."""
        columns = ([np.broadcast_to(part, self.count) for part in parts] for parts in self.moved)
        return [tuple(float(column[row]) for column in each) for each in columns]

    def faults(self) -> list[Fault]:
        """Return the faults of the block in the order of its lines."""
        found = [Fault(self.block.line_of(row), *why) for row, why in self.reasons.items()]
        return sorted([*map(itemgetter(1), self.block.broken), *found], key=lambda each: (each.line, each.column))
