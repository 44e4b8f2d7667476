"""What the numbers of one row or record mean: a point, a vector or a pose, and in which notation.

Knows no text; works on floats and on arrays alike.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.errors import NamedTuple, ValueInvalid, overheard
from frametool.geometry import euler, floats, quaternion, rigid
from frametool.text.numbers import read_number_or_angle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry import Components, Namespace, Quaternion
    from frametool.geometry.place import Place, Spot
    from frametool.geometry.representations import Notation, Whole

POINT, VECTOR, POSE, TWIST, WRENCH, ACCEL = "point", "vector", "pose", "twist", "wrench", "accel"
ROTATION = "rotation"  # without a position, which no move gives it
NORMAL, RATE = "normal", "rate"  # vectors that turn along with a point or pose; the one along the axes of its body
ATTITUDE = "attitude"  # a rotation of the frame itself, seen from a fixed world
TURNED = (POSE, ROTATION, ATTITUDE)
PARTS = {TWIST: ("linear", "angular"), WRENCH: ("force", "torque"), ACCEL: ("linear", "angular")}
SIX = tuple(PARTS)  # two vectors, linear part first
# the keys of the numbers in a mapping: these are lists, mappings, or single numbers
MAPPINGS = ((POINT, ("point",)), (VECTOR, ("vector",)), (POINT, ("xyz",)), *PARTS.items(), (POINT, ("x", "y", "z")))
MOVERS: dict[str, Callable[..., Components]] = {  # by a pose, whose seven numbers come first
    "": lambda *_: (),
    POINT: rigid.apply,
    VECTOR: lambda _x, _y, _z, *numbers: quaternion.rotate(*numbers),
    NORMAL: lambda _x, _y, _z, *numbers: quaternion.rotate(*numbers),
    RATE: lambda _x, _y, _z, *numbers: quaternion.rotate(*numbers),
    ROTATION: rigid.compose,
    ATTITUDE: lambda *numbers: rigid.compose(*(*numbers[7:], *rigid.inverse(*numbers[:7]))),
    TWIST: rigid.move_twist,
    WRENCH: rigid.move_wrench,
    ACCEL: lambda _x, _y, _z, *n: (*quaternion.rotate(*n[:7]), *quaternion.rotate(*n[:4], *n[7:])),
}
IDENTITY = (0.0, 0.0, 0.0, 1.0)
NOWHERE = (0.0, 0.0, 0.0, *IDENTITY)
TURN = 6.283185307179586
TO_DEGREES = 180.0 / 3.141592653589793
AS_READ = "lat lon alt as read"  # of a point of ecef: of its row, for what is written of them again
FLAT = 1e-9  # radians, metres: what a number without a column may be
LEAVES_PLANE = "the result leaves the plane: {} is {:g} and has no column; give --to rpy"
# how many make a metre, where they differ of x, y, z each; or how positions on the Earth are written
Unit: TypeAlias = "float | tuple[float, float, float] | Place"


def six_names(kind: str) -> list[str]:
    """Name the numbers of a twist or wrench as columns."""
    return [f"{part}_{axis}" for part in PARTS[kind] for axis in "xyz"]


class Shape(NamedTuple):
    """The numbers of a row in order: position (3, if any), then rotation (if any); or those of a whole matrix.

    One shape is read, and one is written: the result.
    kind: point, vector, pose, rotation, attitude, twist, wrench or accel; "" for no numbers
    unit: how many of the position's numbers make a metre; None where there is no position
    notations: that of the rotation, with whether its angles are degrees; of a result there may be several
    whole: the numbers are those of a whole pose
    inverse: what is written is the inverse
    covariance: how many numbers each of the covariances has that come last; one is a scale
    sigma: of six independent axes, the place of each one's number among these, -1 for 0, and its unit; () for entries
        that have no place of their own in the result, which names them anew; None for those that have
    radians_at: which of the rotation's numbers are radians where the others are degrees
    absent: which numbers have no column and count as 0; of a result they have to be 0
    extras: the names of the numbers that come with it
    keep_sign: its quaternions keep their sign; scaled: its matrix is s R, of the scale that comes last
    """

    kind: str
    unit: Unit | None = 1.0
    notations: tuple[tuple[Notation, bool], ...] = ()
    whole: bool = False
    inverse: bool = False
    covariance: tuple[int, ...] = ()
    sigma: tuple[tuple[int, str], ...] | None = None
    radians_at: tuple[int, ...] = ()
    absent: tuple[int, ...] = ()
    extras: tuple[str, ...] = ()
    keep_sign: bool = False
    scaled: bool = False

    @property
    def notation(self) -> Notation | None:
        """Return the notation of the rotation, of several the first."""
        return self.notations[0][0] if self.notations else None

    @property
    def degrees(self) -> bool:
        """Return True if its angles are degrees."""
        return bool(self.notations) and self.notations[0][1]

    @property
    def rewritten(self) -> bool:
        """Return True if the result names the entries of the first covariance anew."""
        return self.sigma is not None

    @property
    def joined(self) -> Whole | None:
        """Return how position and rotation are written in one, if they are."""
        return self.notation.representation.whole if self.whole and self.notation else None

    @property
    def size(self) -> int:
        """Count the numbers of a row, or of a result with what comes with it."""
        return self.own_size + sum(self.covariance) + len(self.extras)

    @property
    def own_size(self) -> int:
        """Count the numbers of the thing itself, without its covariance."""
        return self._full - len(self.absent)

    @property
    def _full(self) -> int:
        if self.joined or self.kind in SIX:
            return len(self.joined.columns) if self.joined else 6
        return count_of(self.unit) + sum(len(each.representation.columns) for each, _ in self.notations)

    @property
    def place(self) -> Place | None:
        """Return how its position on the Earth is written, None of any other."""
        return place_of(self.unit)

    @property
    def _there(self) -> list[int]:
        """Return which number of the rotation each number of a row is; below 0 of the position."""
        return [place - count_of(self.unit) for place in range(self._full) if place not in self.absent]

    @property
    def position_size(self) -> int:
        """Count the numbers of the position in a row."""
        return 0 if self.whole else sum(index < 0 for index in self._there)

    @property
    def rotation_at(self) -> tuple[int, ...]:
        """Return where in a row the rotation's numbers are."""
        every = range(self.own_size)
        return tuple(self.joined.split(every)[1] if self.joined else every[self.position_size :])

    def number_at(self, index: int) -> int:
        """Return where in a row a number of the rotation is that has a column."""
        return self.rotation_at[index] if self.joined else self._there.index(index)

    @property
    def angles(self) -> list[bool | None]:
        """Return whether each of the numbers is an angle in degrees; None where it is no angle."""
        found: list[bool | None] = [None] * count_of(self.unit)
        for notation, degrees in self.notations:
            row = notation.representation
            found += [degrees if at in row.angles else None for at in range(len(row.columns))]
        for index in self.radians_at:
            found[count_of(self.unit) + index] = False
        return [each for place, each in enumerate(found) if place not in self.absent]

    def in_degrees(self, place: int) -> bool | None:
        """Return True if a row's number is an angle in degrees; None if it is no angle."""
        return dict(enumerate(self.angles)).get(place)

    def angle_columns(self) -> list[tuple[int, float]]:
        """Return which of the numbers are angles, each with the size of a full turn."""
        return [(at, 360.0 if degrees else TURN) for at, degrees in enumerate(self.angles) if degrees is not None]

    def read(self, place: int, text: str) -> float:
        """Read a row's number: an angle, or a length in metres, may have a unit of its own."""
        is_length = self.place is None and place < self.position_size
        metres = is_length and _each(self.unit or 1.0)[self._there[place]] == 1.0
        return float(read_number_or_angle(text, self.in_degrees(place), metres=metres))

    def position(self, numbers: Sequence[Any]) -> Components:
        """Return x, y, z in metres; 0 where there is no position."""
        if self.joined:
            position: Components = self.joined.split(numbers)[0]
            return position
        if self.unit is None:
            return (0.0, 0.0, 0.0)
        if (place := self.place) is not None:
            return place.ecef(numbers[: place.size])
        x, y, z = self._with_absent(numbers)[:3]
        if self.unit == 1.0:
            return x, y, z
        a, b, c = _each(self.unit)
        return x / a, y / b, z / c

    def turned(self, numbers: Sequence[Any], rotation: Components) -> Components:
        """Return the checked rotation of a row, as x y z w, in the frame that its position is in."""
        place = self.place
        return rotation if place is None or self.notation is None else place.turned(numbers[: place.size], rotation)

    def rotation(self, numbers: Sequence[Any]) -> Components:
        """Return the rotation's numbers in the order of its columns, angles in one unit."""
        if self.joined:
            rotation: Components = self.joined.split(numbers)[1]
            return rotation
        values = list(self._with_absent(numbers)[count_of(self.unit) : self._full])
        for index in self.radians_at:
            values[index] = values[index] * TO_DEGREES
        return tuple(values)

    @property
    def bare_angles(self) -> tuple[int, ...]:
        """Return which of the rotation's numbers are angles without a stated unit, taken as radians."""
        fmt = self.notation
        return () if fmt is None or self.degrees or fmt.degrees is not None else tuple(fmt.representation.angles)

    def _with_absent(self, numbers: Sequence[Any]) -> Sequence[Any]:
        """Put zeros where a row has no number."""
        if not self.absent:
            return numbers
        full = list(numbers)
        for place in self.absent:
            full.insert(place, numbers[0] - numbers[0])
        return full

    # --- writing ---

    @property
    def position_columns(self) -> list[str]:
        """Name the numbers of the position."""
        return list("xyz" if self.place is None else self.place.columns) if self.unit is not None else []

    def written(self, parts: Components, xp: Namespace) -> list[Any]:
        """Return all numbers of a result: those of the thing itself, then what comes with it as it is."""
        own = 6 if self.kind in SIX else 3 if self.kind in (POINT, VECTOR, NORMAL, RATE) else 7
        full = self._all_written(parts[:own], xp, parts[-1] if self.scaled else None, getattr(parts, "read", None))
        if self.absent:
            full = [number for place, number in enumerate(full) if place not in self.absent]
        return [*full, *parts[own : len(parts) - self.scaled]]

    def left_out(self, parts: Components, xp: Namespace) -> list[tuple[str, Any]]:
        """Return the numbers of a result without a column, by name; a row where one is above FLAT is bad."""
        if not self.absent:
            return []
        full, names = self._all_written(parts, xp), [*self.position_columns, *self.names]
        return [(names[place], full[place]) for place in self.absent]

    def _all_written(self, parts: Components, xp: Namespace, scale: Any = None, read: Spot | None = None) -> list[Any]:
        """Return the numbers of a result: the position, then each notation's; or those of a whole matrix."""
        if self.kind in SIX:
            return list(parts)
        position: list[Any] = []
        if self.unit == 1.0:
            position = list(parts[:3])
        elif (place := self.place) is not None:
            x, y, z = parts[:3]
            position = place.numbers(x, y, z, read)
        elif self.unit is not None:
            position = [part * unit for part, unit in zip(parts[:3], _each(self.unit), strict=True)]
        if not self.notations:
            return position
        x, y, z, w = parts[3:7] if self.place is None else self.place.local(parts[0], parts[1], parts[2], parts[3:7])
        unit = quaternion.unit(x, y, z, w, xp)
        written = [
            notation.from_quaternion(*unit, xp, degrees=degrees, keep_sign=self.keep_sign)
            for notation, degrees in self.notations
        ]
        if scale is not None:
            written = [tuple(number * scale for number in written[0])]
        if self.joined:
            return list(self.joined.join(parts[:3], written[0]))
        turned = [number for numbers in written for number in numbers]
        for index in self.radians_at:
            turned[index] = turned[index] / TO_DEGREES
        return position + turned

    @property
    def names(self) -> list[str]:
        """Name the numbers of all notations as columns; of a whole pose all of them."""
        if self.joined:
            return list(self.joined.columns)
        return [name for notation, degrees in self.notations for name in notation.columns_in(degrees=degrees)]

    def locked(self, parts: Components) -> Any:
        """Return where Euler angles among the notations are not unique; None if there are none."""
        for notation, _ in self.notations:
            if notation.euler_axes and len(parts) >= 7:
                x, y, z, w = parts[3:7]
                return euler.locked(x, y, z, w, notation.euler_axes)
        return None


def place_of(unit: Unit | None) -> Place | None:
    """Return a unit that is a way to write positions on the Earth, None for any other."""
    return None if unit is None or type(unit) is float or type(unit) is tuple else unit  # type: ignore[return-value]


def count_of(unit: Unit | None) -> int:
    """Count the numbers of a position: three, or those of a place; none without one."""
    place = place_of(unit)
    return place.size if place is not None else 3 * (unit is not None)


def _each(unit: Any) -> tuple[float, float, float]:
    """Return the unit of x, y and z each."""
    return unit if type(unit) is tuple else (unit, unit, unit)


def checked_rotation(
    shape: Shape, values: Sequence[float], *, normalize: bool
) -> tuple[Quaternion, list[tuple[str, str]]]:
    """Return the quaternion of a record's numbers, and what its check warned of as (rule, sentence).

    Raises ValueInvalid for what is no rotation.
    """
    if shape.notation is None:
        return IDENTITY, []
    tail = shape.joined.tail if shape.joined else ()
    if tail and tuple(values[-len(tail) :]) != tail:
        raise ValueInvalid(wrong_tail(tail, values[-len(tail) :]))
    check = shape.notation.checked_quaternion
    return overheard(check, shape.rotation(values), floats, degrees=shape.degrees, normalize=normalize)


def wrong_tail(wanted: Sequence[float], found: Sequence[float]) -> str:
    """Return the message that the last row of a 4x4 matrix is not what it always is."""
    expected, actual = (" ".join(f"{value:g}" for value in row) for row in (wanted, found))
    return f"the last row of a 4x4 pose is {expected}, found {actual}"


def doubt(shape: Shape, angle: float, remedy: str) -> str:
    """Wonder whether an angle beyond a full turn is meant in degrees."""
    name = shape.notation.representation.name if shape.notation else ""
    return f"{name} {angle:g} is more than a full turn in radians; degrees? {remedy}"
