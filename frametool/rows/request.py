"""The request of a stream in any format: the operation, how rows are read, and how results are written.

One `Operation` serves floats and arrays alike.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.errors import NamedTuple, ValueInvalid
from frametool.geometry import quaternion, rigid
from frametool.geometry.floats import RADIAN
from frametool.geometry.representations import HEADING, Notation, notation
from frametool.geometry.rigid import EXACT, SCALED, UNCERTAIN
from frametool.grammar.pose import RELATIVE, SCALE, VELOCITY
from frametool.rows.faults import STOP
from frametool.rows.shapes import MOVERS, POINT, POSE, RATE, SIX, TURNED, VECTOR, Shape, Unit

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.geometry import Components, Namespace, Number, Rigid
    from frametool.geometry.place import Earth, Place
    from frametool.grammar.result import Style
    from frametool.rows.sinks import Word

    Rename: TypeAlias = Callable[[str | None, str | None], tuple[str | None, str | None]]

START, PREVIOUS, VELOCITIES = "start", "previous", "velocities"  # the earlier row that a row is compared with
PAIR = "pair"  # the two poses of a row
ALL, SOME, NO_STAMPS = "all", "some", "none"


class Formula:
    """An expression that is evaluated for each row: its inputs, the kind of its result, and its numbers.

    The kind of a row is that of its shape, "" for a row without a point or pose.
    columns: the columns or keys that it reads as numbers; reads_row: it reads the point or pose of the row
    needs_time: it reads the stamp of the row; adds: rows keep their columns, and the result is added
    shown: how its numbers are written as words or members; None for plain numbers
    """

    columns: tuple[str, ...] = ()
    reads_row = True
    needs_time = False
    adds = True
    shown: Shown | None = None

    def kind(self, row: str) -> str:  # noqa: ARG002 - by default all rows get numbers alone
        """Return the kind of the result: pose, point or vector; "" for numbers alone, which are `extras`."""
        return ""

    def extras(self, row: str) -> tuple[str, ...]:  # noqa: ARG002 - none by default
        """Name the numbers that follow those of a pose or point."""
        return ()

    def rename(self, row: str, parent: str | None, name: str | None) -> tuple[str | None, str | None]:  # noqa: ARG002
        """Return parent and name of a result from those of its row; raises FrametoolError if they do not fit."""
        return parent, name

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace
    ) -> Components:
        """Return the components of the result, then the extras; raises FrametoolError for floats without a result."""
        raise NotImplementedError


class Shown(NamedTuple):
    """How the numbers of a formula are written in a row; nan is an empty cell in tables and null in records.

    words: in tables, the index of a number that is written as a word, and the words
    members: in records, the value of each key: a text, a word, or the indices of its numbers
    replaces: existing columns and keys with these names are replaced, unless a prefix makes the names different
    """

    words: Mapping[int, tuple[str, ...]]
    members: Mapping[str, str | Word | tuple[int, ...]]
    replaces: bool = False

    def cells(self, names: Sequence[str], numbers: Components) -> dict[str, Any]:
        """Return the numbers as cells of a table, by column."""
        return {
            name: self.words[at][int(number)] if at in self.words else _or_none(number)
            for at, (name, number) in enumerate(zip(names, numbers, strict=True))
        }

    def values(self, prefix: str, numbers: Components) -> dict[str, Any]:
        """Return the numbers as members of a record, by key."""
        from frametool.documents.source import Verbatim
        from frametool.rows.sinks import Word

        found: dict[str, Any] = {}
        for key, value in self.members.items():
            made: Any = value
            if isinstance(value, Word):
                made = Verbatim(value.text(numbers[value.number]).decode())
            elif not isinstance(value, str):
                made = [_or_none(numbers[at]) for at in value]
                made = None if None in made else made if made[1:] else made[0]
            found[prefix + key] = made
        return found


class Operation(NamedTuple):
    """The operation on each row: optional inversion, products with fixed poses, then an optional comparison.

    left, right: the result is left @ row @ right[0] @ right[1] ..
    inverse: the row itself is inverted first
    of: the pose that a row is compared with; "" for none, "first" inverse(fixed) @ row, "second" inverse(row) @ fixed,
        "pair" the two poses of a row, "previous" the row before and this one, "start" the first row and this one,
        "velocities" as "previous", with the twist from one row to the next over the time between them
    fixed: the pose that "first" and "second" need
    moves: rows are expressed in another frame, so that points and vectors are allowed
    turns: the axes convention changes: `right` is a rotation alone, which leaves the position unchanged
    mirrors: the row is reflected across y, before `left` is applied
    formula: an expression instead of all this; it receives the point of a row moved by its edge, or the edge alone
    uncertain: the poses that move rows, by frame or by time, have covariances that are propagated
    similar: the scale of a pose is applied and is part of the result; multiples: so is the scale of a matrix s R
    A pose has seven components, with a scale eight, with a covariance 43, as in `geometry.rigid`.
    """

    left: Components | None = None
    right: tuple[Components, ...] = ()
    inverse: bool = False
    of: str = ""
    fixed: Components | None = None
    moves: bool = False
    turns: bool = False
    mirrors: bool = False
    formula: Formula | None = None
    uncertain: bool = False
    similar: bool = False
    multiples: bool = False

    def extras(self, shape: Shape) -> tuple[str, ...]:
        """Name the numbers of a row's result that have no column or key in the row as it was read."""
        if self.formula is not None:
            return self.formula.extras(shape.kind)
        compared = RELATIVE + VELOCITY * (self.of == VELOCITIES) if self.of and shape.kind == POSE else ()
        return compared if shape.covariance and not shape.rewritten else (*compared, *self.carried(shape))

    def carried(self, shape: Shape) -> tuple[str, ...]:
        """Name the covariance entries, or the scale, of the results of rows of a shape; () if they have neither."""
        stays = self.keeps_frames and not (self.uncertain or shape.inverse or shape.rewritten)
        passes = self.formula is not None or stays
        if passes or shape.kind not in (POSE, POINT, VECTOR):
            return ()
        sizes = {*map(len, filter(None, (self.left, *self.right, self.fixed)))}
        if SCALED in sizes or (1 in shape.covariance and not shape.sigma) or self.reads_scale(shape):
            return () if self.moves else (SCALE,)
        of_position = shape.kind == POSE and 9 in shape.covariance and not shape.rewritten  # unchanged
        if of_position or not (self.uncertain or shape.covariance or UNCERTAIN in sizes):
            return ()
        from frametool.grammar.covariance import columns

        return columns(36 if shape.kind == POSE else 9)

    def reads_scale(self, shape: Shape) -> bool:
        """Return True if the matrix of a shape may be s R, with a scale s that is part of the pose.

        Not if the row states the scale as a number of its own.
        """
        return self.multiples and shape.notation is not None and (
            shape.notation.representation.whole is not None and (1 not in shape.covariance or bool(shape.sigma))
        )

    def result_kind(self, kind: str) -> str:
        """Return the kind of the result of a row of some kind; "" for numbers alone."""
        return kind if self.formula is None else self.formula.kind(kind)

    @property
    def columns(self) -> tuple[str, ...]:
        """Name the columns that are read as numbers in addition to points and poses."""
        return () if self.formula is None else self.formula.columns

    @property
    def shown(self) -> Shown | None:
        """Return how the numbers of a formula are written; None for plain numbers or without a formula."""
        return None if self.formula is None else self.formula.shown

    @property
    def only_adds(self) -> bool:
        """Return True if rows keep their columns and the result is added to them."""
        return self.formula is not None and self.formula.adds

    @property
    def keeps_child(self) -> bool:
        """Return True if a result is the pose of the same frame as its row: of a camera with the same axes."""
        return not (self.inverse or self.right or self.formula) and (self.of in ("", "first") or self.looks_back)

    @property
    def looks_back(self) -> bool:
        """Return True if the result of a row depends on the rows before it."""
        return self.of in (START, PREVIOUS, VELOCITIES)

    @property
    def takes_points(self) -> bool:
        """Return True if points and vectors have a result: if rows are moved, or change their axes."""
        return self.moves or self.turns

    @property
    def changes_nothing(self) -> bool:
        """Return True if poses and points are unchanged, except for their notation or axes."""
        changed = self.left or self.right or self.of or self.moves or self.mirrors
        return not (changed or self.inverse)

    @property
    def keeps_frames(self) -> bool:
        """Return True if the frames of records are unchanged."""
        return self.shown is not None or (self.changes_nothing and (self.formula is None or self.formula.adds))

    @property
    def keeps_position(self) -> bool:
        """Return True if positions are unchanged, so that their text is kept."""
        return self.changes_nothing or (self.turns and self.left is None and not (self.mirrors or self.inverse))

    def move(self, shape: Shape, own: Components, extra: Components, edge: Components | None) -> Components:
        """Move a point, vector, .. with its covariances by `edge`, else by `left`; other numbers are unchanged."""
        mover = edge or self.left
        if shape.kind == RATE:  # along the axes of the body
            mover = rigid.inverse(*self.right[0]) if self.right else None
        if self.mirrors:
            own = (own[0], -own[1], *own[2:])
        if mover is not None and len(mover) == EXACT and not shape.covariance:
            return (*MOVERS[shape.kind](*mover, *own), *extra)
        if mover is None:
            return (*own, *extra)
        from frametool.rows.columns_uncertain import move

        return move(shape, own, extra, mover, mirrors=self.mirrors)

    def result(
        self,
        shape: Shape,
        numbers: Components,
        edge: Components | None,
        xp: Namespace,
        *,
        rotation: Callable[[Components], Components],
        before: Callable[[Components], tuple[Sequence[Components], Number]] | None = None,
        times_ns: Number = None,
    ) -> Components:
        """Return the components of the result of one row, or of a column of rows, followed by its extra numbers.

        rotation: returns the checked quaternion of the numbers of a row
        before: takes a pose; returns the pose that it is compared with, itself, and the seconds between them
        times_ns: the stamp of the row
        """
        own, extra = numbers[: shape.own_size], tuple(numbers[shape.own_size :])
        if shape.sigma or (shape.covariance and shape.place is not None):
            from frametool.rows.columns_uncertain import in_full

            shape, extra = in_full(shape, own, extra)
        if self.reads_scale(shape):
            from frametool.rows.columns_uncertain import of_multiple

            own = of_multiple(shape, own, rotation, xp)
        elif shape.kind in TURNED:
            own = thing_pose(shape, own, rotation)
        elif shape.unit is not None:
            own = shape.position(own)
        if self.formula is not None:
            mover: Any = edge or self.left
            parts = own if mover is None else rigid.apply(*mover, *own[:3]) if own else mover
            return self.formula.result(shape.kind, parts, extra, times_ns, xp)
        if shape.kind != POSE:
            found = self.move(shape, own, extra, edge)
        else:
            if shape.covariance:
                from frametool.rows.columns_uncertain import with_own

                own, extra = with_own(shape, own, extra, edge or self.left, mirrors=self.mirrors)
            poses, took = ([own], None) if before is None else before(own)
            found = self.pose(poses, edge, xp)
            if self.of == VELOCITIES:  # linear R_A' (p_B - p_A) / dt, angular the rotation vector of A^-1 B over dt
                last = EXACT + len(RELATIVE)
                steps = (*found[:3], *quaternion.as_rotvec(found[3], found[4], found[5], found[6], xp))
                found = (*found[:last], *(step / took for step in steps), *found[last:])
            found = (*found, *extra)
        if shape.place is None or not self.keeps_frames:
            return found
        from frametool.geometry.place import Spot, Unmoved  # unmoved: with the numbers that were read

        return Unmoved(found, Spot(shape.place, numbers[: shape.place.size]))

    def pose(self, poses: Sequence[Components], edge: Components | None, xp: Namespace) -> Components:
        """Return the resulting pose; distance and angle of compared poses; then its covariance or scale, if any."""
        result = poses[0]
        if self.inverse:
            result = rigid.inverse_full(result)
        if self.mirrors:
            result = rigid.mirrored(*result)
        left = edge or self.left
        if left is not None:
            result = rigid.compose_full(left, result)
        for right in self.right:
            result = rigid.compose_full(result, right)
        if self.moves and len(result) == SCALED:
            return result[:EXACT]  # a pose that a similarity moves is a pose without a scale
        if not self.of:
            return result
        others = poses[1:] if self.fixed is None else (self.fixed,)
        first, second = (*others, result) if self.of == "first" else (result, *others)
        result = rigid.relative_full(first, second)
        tx, ty, tz, x, y, z, w = result[:EXACT]
        metres, angle = rigid.extent(tx, ty, tz, x, y, z, w, xp)
        return (*result[:EXACT], metres, angle, angle * RADIAN, *result[EXACT:])


def _or_none(number: Number) -> Number | None:
    return None if number != number else number  # noqa: PLR0124 - nan


PLAIN = Shown({}, {})
COMBINED = Operation(of="arguments")  # the caller combines the poses; here they are only read


def thing_pose(shape: Shape, own: Components, rotation: Callable[[Components], Components]) -> Rigid:
    """Return the pose that the numbers of a row define; inverted if they are those of its inverse."""
    pose: Any = (*shape.position(own), *shape.turned(own, rotation(own)))
    return rigid.inverse(*pose) if shape.inverse else pose


class Timed(NamedTuple):
    """The stamps of rows, and the poses that move rows from a frame (None: the one SOURCE) at these times.

    An expression has no such poses; it defines itself what the stamps are for.

    name: the column or key of the stamps; "" for the stamp in the header of each message
    many: returns columns of poses at an array of nanoseconds, nan where there is no data
    one: returns the pose at one time; raises FrametoolError with the reason if there is none
    moves: returns True if the transform from a frame to the target depends on the time
    width: number of components of such a pose: 7, or 43 with its covariance
    """

    name: str
    many: Callable[[str | None, Any], Components] = lambda *_: ()
    one: Callable[[str | None, int], Components] = lambda *_: ()
    moves: Callable[[str | None], bool] = lambda _: True
    width: int = EXACT

    @property
    def column(self) -> str:
        """Name the column or key for messages."""
        return self.name or "header.stamp"

    def pose(self, frame: str | None, stamp_ns: int) -> Components:
        """Return the pose at one time, with the same bits as from `many`; raises FrametoolError without data."""
        found = tuple(float(column[0]) for column in self.many(frame, [stamp_ns]))
        return found if found[0] == found[0] else self.one(frame, stamp_ns)


class RowOptions(NamedTuple):
    """How rows are read.

    poses: the number of poses in each row; 0 if rows only name frames
    kind: pose, point, vector, twist or wrench; "" to decide by the columns; kinds: of each point or pose, if several
    given: the representation of rotations; given_place: the geodetic format of numbers without names
    degrees: bare angles are in degrees; normalize: accept any non-zero quaternion
    columns: the pose columns by name or number, one entry per pose; frames: the columns with the frame of a row
    stamp_or_weight_column: a further column or key to read; "" for the usual column of stamps
    stamps: ALL rows need a stamp if one has it, or SOME; with NO_STAMPS that column holds weights or labels
    frame_is_counter: a decimal `frame` is a counter, because no frame has such a name
    """

    poses: int = 1
    kind: str = ""
    kinds: tuple[str, ...] = ()
    given: Notation | None = None
    given_place: str = ""
    degrees: bool = False
    normalize: bool = False
    columns: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    stamp_or_weight_column: str | None = None
    stamps: str = ALL
    frame_is_counter: bool = True


class ResultOptions(NamedTuple):
    """How results are written.

    notations: of rotations; () for those of the input
    default_notation: no option chose these notations; results without a rotation get none
    keep_sign: quaternions keep their sign; precision: decimals, None for the shortest exact text
    keep, prefix: add the result to the columns of the input; the prefix of its names
    unwrap: angles continue beyond half a turn
    all_numbers: write all numbers of a result, also unchanged ones
    rewrite_records: write results as new records, not into the text of the old ones
    place: the format of positions on the Earth; last_place: the one into which a writer converts them later
    """

    notations: tuple[Notation, ...] = ()
    default_notation: bool = False
    keep_sign: bool = False
    precision: int | None = None
    keep: bool = False
    prefix: str = ""
    unwrap: bool = False
    all_numbers: bool = False
    rewrite_records: bool = False
    place: Place | None = None
    last_place: Place | None = None


class Request(NamedTuple):
    """What is done with the rows of one run, how they are read, and how results are written.

    pose_from_frame: returns the pose that moves a record expressed in a frame; timed: the poses at a record's stamp
    rename: returns the (parent, name) of a result from those of its record
    on_error: STOP, SKIP or NULL
    earth: the origin, the axes of rotations and the zone of all geodetic positions
    offset_ns: added to all stamps, an integer or `FromFirst`; window: the first and the last stamp of rows to use
    """

    operation: Operation = Operation()
    rows: RowOptions = RowOptions()
    results: ResultOptions = ResultOptions()
    pose_from_frame: Callable[[str | None], Rigid] | None = None
    timed: Timed | None = None
    rename: Rename | None = None
    on_error: str = STOP
    earth: Earth | None = None
    offset_ns: int = 0
    window: tuple[int, int] | None = None

    def with_rows(self, **fields: Any) -> Request:
        """Return the request with other options for reading rows."""
        return self._replace(rows=self.rows._replace(**fields))

    def with_results(self, **fields: Any) -> Request:
        """Return the request with other options for writing results."""
        return self._replace(results=self.results._replace(**fields))

    def of_inverses(self) -> Request:
        """Return the request for the inverse of each row, with parent and name exchanged."""
        rename, operation = self.rename, self.operation
        return self._replace(
            operation=operation._replace(inverse=not operation.inverse),
            rename=lambda parent, name: rename(name, parent) if rename else (name, parent),
        )

    @property
    def in_order(self) -> bool:
        """Return True if the order of rows matters: results depend on earlier rows, or the first is the origin."""
        takes_first = self.earth is not None and self.earth[0] is not None and self.earth[0].place is None
        return self.results.unwrap or self.operation.looks_back or takes_first

    @property
    def keeps_position(self) -> bool:
        """Return True if positions are unchanged, so that their text is kept."""
        return self.operation.keeps_position and self.results.place is None

    def target(self, shape: Shape) -> Shape:
        """Return the shape of the result for rows of a shape: written as it was read, unless options change it."""
        asked, operation, in_place = self.results, self.operation, () if shape.rewritten else shape.covariance
        kind, extras = operation.result_kind(shape.kind), operation.extras(shape)
        target = Shape(kind, None, covariance=in_place, extras=extras, keep_sign=asked.keep_sign)
        if kind != shape.kind:
            shape = Shape(kind, shape.unit or 1.0)
        if not kind or kind in SIX:
            return target
        if kind not in TURNED:
            if asked.place is not None and kind != POINT:
                raise ValueInvalid(f"a {kind} has no place on the Earth; leave --to {asked.place.name} out")
            return target._replace(unit=self._unit(shape))
        by_row = bool(self.rows.frames) or self.timed is not None  # each row is moved by its own pose
        poses = filter(None, (operation.left, *operation.right, operation.fixed))
        shifts = by_row or operation.formula is not None or any(any(pose[:3]) for pose in poses)
        there = shape.whole or shape.unit is not None
        placed = there or (shifts and kind == POSE)
        if asked.notations or shape.notation is None or shape.notation.representation is HEADING:
            changed = operation.left or operation.right or operation.of or operation.formula
            has_none = shape.notation is None and not by_row and bool(operation.turns or not changed)
            stays = has_none and (asked.default_notation or not asked.notations)
            notations = () if stays else asked.notations or (notation("quaternion"),)
            whole = there and len(notations) == 1 and notations[0].representation.whole is not None
            written = tuple((each, each.in_degrees(self.rows.degrees)) for each in notations)
            target = target._replace(notations=written, whole=whole)
        else:
            if shape.inverse:  # rewritten with all its numbers, in one unit
                shape = shape._replace(absent=(), radians_at=())
            ahead = 3 * (placed and shape.unit is None and not shape.whole)  # a position comes in front
            target = target._replace(
                notations=shape.notations, whole=shape.whole, radians_at=shape.radians_at,
                absent=tuple(at + ahead for at in shape.absent),
            )  # fmt: skip
        unit = (self._unit(shape) or 1.0) if placed and not target.whole else None
        is_matrix = len(target.notations) == 1 and target.notations[0][0].representation.whole is not None
        if is_matrix and operation.carried(shape) == (SCALE,):  # the matrix contains the scale
            extras = extras[:-1] if extras[-1:] == (SCALE,) else extras
            return target._replace(unit=unit, scaled=True, extras=extras)
        return target._replace(unit=unit)

    def _unit(self, shape: Shape) -> Unit | None:
        """Return the unit of written positions: as requested, else as read; metres if geodetic or a new record."""
        asked = self.results
        if asked.place is not None and shape.unit is not None:
            return asked.place
        own = shape.unit if shape.place is None and not (asked.rewrite_records and shape.unit) else 1.0
        return 1.0 if own is not None and asked.all_numbers and (asked.notations or shape.notation is None) else own

    def for_kind(self, kind: str) -> Request:
        """Return the request for rows of one kind: the frames of a formula's result depend on it."""
        formula = self.operation.formula
        if formula is None:
            return self
        return self._replace(rename=lambda parent, name: formula.rename(kind, parent, name))

    def counts(self, frame: str) -> bool:
        """Return True if the value of `frame` is a counter, not the name of a frame."""
        return self.rows.frame_is_counter and frame.isdecimal()


def target_of(style: Style, kind: str = POSE, *, placed: bool = True) -> Shape:
    """Return the shape of results in a style; placed: poses have a position."""
    quaternions = notation("quaternion")
    asked = ResultOptions(style.notations or (quaternions,), keep_sign=style.keep_sign, place=style.place)
    shape = Shape(kind, 1.0 if placed else None, ((quaternions, False),) if kind == POSE else ())
    return Request(rows=RowOptions(degrees=style.degrees), results=asked).target(shape)
