"""The meaning of the numbers of one row or record: a point, vector, pose, .., and in which notation and unit.

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
ROTATION = "rotation"  # without a position, also after a move
NORMAL, RATE = "normal", "rate"  # vectors rotated with a point or pose; RATE is along the body's axes
ATTITUDE = "attitude"  # the rotation of the frame itself in a fixed world
TURNED = (POSE, ROTATION, ATTITUDE)
PARTS = {TWIST: ("linear", "angular"), WRENCH: ("force", "torque"), ACCEL: ("linear", "angular")}
SIX = tuple(PARTS)  # two vectors, linear part first
# the keys of a mapping that hold the numbers, as lists, mappings or single numbers
MAPPINGS = ((POINT, ("point",)), (VECTOR, ("vector",)), (POINT, ("xyz",)), *PARTS.items(), (POINT, ("x", "y", "z")))
MOVERS: dict[str, Callable[..., Components]] = {  # by a pose, whose seven components come first
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
AS_READ = "lat lon alt as read"  # extra of a point in ECEF: lat, lon, alt of its row, to be written again
FLAT = 1e-9  # radians, metres: the largest size of a result that has no column
LEAVES_PLANE = "the result leaves the plane: {} is {:g} and has no column; give --to rpy"
# units per metre, for x, y, z separately if they differ; or the notation of positions on the Earth
Unit: TypeAlias = "float | tuple[float, float, float] | Place"


def six_names(kind: str) -> list[str]:
    """Name the columns of the six numbers of a twist, wrench or acceleration."""
    return [f"{part}_{axis}" for part in PARTS[kind] for axis in "xyz"]


class Shape(NamedTuple):
    """The meaning of the numbers of a row, in order: position, rotation, then covariances and extras.

    A row is read as one shape and its result is written as another, the target.
    kind: point, vector, pose, rotation, attitude, twist, wrench or accel; "" for no numbers
    unit: units of the position per metre, or its geodetic notation; None without a position
    notations: of the rotation, each with True for angles in degrees; a result may have several
    whole: the numbers are those of a whole pose, position and rotation in one matrix
    inverse: the row holds the inverse of the pose
    covariance: the size of each covariance, whose numbers follow the pose; 1 is a scale
    sigma: for a covariance from six independent sigmas, the index of each one's number (-1 for 0) and its unit; () for
        entries that the result writes under new names; None for entries that are replaced in place
    radians_at: the numbers of the rotation in radians, if the others are in degrees
    absent: the numbers without a column, which count as 0; in a result they must be 0
    extras: the names of further numbers
    keep_sign: quaternions keep their sign; scaled: the matrix is s R, with the scale s as the last component
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
        """Return the notation of the rotation, the first of several; None without a rotation."""
        return self.notations[0][0] if self.notations else None

    @property
    def degrees(self) -> bool:
        """Return True if the angles of this notation are in degrees."""
        return bool(self.notations) and self.notations[0][1]

    @property
    def rewritten(self) -> bool:
        """Return True if the result writes the entries of the first covariance under new names."""
        return self.sigma is not None

    @property
    def joined(self) -> Whole | None:
        """Return the rule that joins position and rotation in one matrix; None if they are separate."""
        return self.notation.representation.whole if self.whole and self.notation else None

    @property
    def size(self) -> int:
        """Return the number of all numbers, with covariances and extras."""
        return self.own_size + sum(self.covariance) + len(self.extras)

    @property
    def own_size(self) -> int:
        """Return the number of numbers without covariances and extras."""
        return self._full - len(self.absent)

    @property
    def _full(self) -> int:
        if self.joined or self.kind in SIX:
            return len(self.joined.columns) if self.joined else 6
        return count_of(self.unit) + sum(len(each.representation.columns) for each, _ in self.notations)

    @property
    def place(self) -> Place | None:
        """Return the notation of its position on the Earth; None for any other position."""
        return place_of(self.unit)

    @property
    def _there(self) -> list[int]:
        """Return for each number of a row its index in the rotation; below 0 in the position."""
        return [place - count_of(self.unit) for place in range(self._full) if place not in self.absent]

    @property
    def position_size(self) -> int:
        """Return the number of position numbers in a row; 0 for a matrix of the whole pose."""
        return 0 if self.whole else sum(index < 0 for index in self._there)

    @property
    def rotation_at(self) -> tuple[int, ...]:
        """Return the indices of the rotation's numbers in a row."""
        every = range(self.own_size)
        return tuple(self.joined.split(every)[1] if self.joined else every[self.position_size :])

    def number_at(self, index: int) -> int:
        """Return the index in a row of the rotation's number `index`, which must have a column."""
        return self.rotation_at[index] if self.joined else self._there.index(index)

    @property
    def angles(self) -> list[bool | None]:
        """Return for each number True for an angle in degrees, False for one in radians, None for any other number."""
        found: list[bool | None] = [None] * count_of(self.unit)
        for notation, degrees in self.notations:
            row = notation.representation
            found += [degrees if at in row.angles else None for at in range(len(row.columns))]
        for index in self.radians_at:
            found[count_of(self.unit) + index] = False
        return [each for place, each in enumerate(found) if place not in self.absent]

    def in_degrees(self, place: int) -> bool | None:
        """Return True for an angle in degrees, False for one in radians, None for any other number."""
        return dict(enumerate(self.angles)).get(place)

    def angle_columns(self) -> list[tuple[int, float]]:
        """Return the index of each angle, with the size of a full turn in its unit."""
        return [(at, 360.0 if degrees else TURN) for at, degrees in enumerate(self.angles) if degrees is not None]

    def read(self, place: int, text: str) -> float:
        """Read a number of a row; an angle, or a length in metres, may state its own unit."""
        is_length = self.place is None and place < self.position_size
        metres = is_length and _each(self.unit or 1.0)[self._there[place]] == 1.0
        return float(read_number_or_angle(text, self.in_degrees(place), metres=metres))

    def position(self, numbers: Sequence[Any]) -> Components:
        """Return x, y, z in metres from the numbers of a row; 0 without a position."""
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
        """Return the checked quaternion of a row; next to a geodetic position it is converted to the axes of ECEF."""
        place = self.place
        return rotation if place is None or self.notation is None else place.turned(numbers[: place.size], rotation)

    def rotation(self, numbers: Sequence[Any]) -> Components:
        """Return the numbers of the rotation in the order of its notation, all angles in one unit."""
        if self.joined:
            rotation: Components = self.joined.split(numbers)[1]
            return rotation
        values = list(self._with_absent(numbers)[count_of(self.unit) : self._full])
        for index in self.radians_at:
            values[index] = values[index] * TO_DEGREES
        return tuple(values)

    @property
    def bare_angles(self) -> tuple[int, ...]:
        """Return the indices of the rotation's numbers that are angles without a stated unit, read as radians."""
        fmt = self.notation
        return () if fmt is None or self.degrees or fmt.degrees is not None else tuple(fmt.representation.angles)

    def _with_absent(self, numbers: Sequence[Any]) -> Sequence[Any]:
        """Insert zeros for the numbers that have no column."""
        if not self.absent:
            return numbers
        full = list(numbers)
        for place in self.absent:
            full.insert(place, numbers[0] - numbers[0])
        return full

    # --- writing ---

    @property
    def position_columns(self) -> list[str]:
        """Name the columns of the position."""
        return list("xyz" if self.place is None else self.place.columns) if self.unit is not None else []

    def written(self, parts: Components, xp: Namespace) -> list[Any]:
        """Return all numbers of a result: those of the pose or point as they are written, then the others unchanged."""
        own = 6 if self.kind in SIX else 3 if self.kind in (POINT, VECTOR, NORMAL, RATE) else 7
        full = self._all_written(parts[:own], xp, parts[-1] if self.scaled else None, getattr(parts, "read", None))
        if self.absent:
            full = [number for place, number in enumerate(full) if place not in self.absent]
        return [*full, *parts[own : len(parts) - self.scaled]]

    def left_out(self, parts: Components, xp: Namespace) -> list[tuple[str, Any]]:
        """Return the numbers of a result that have no column, with their names; a row with one above FLAT is bad."""
        if not self.absent:
            return []
        full, names = self._all_written(parts, xp), [*self.position_columns, *self.names]
        return [(names[place], full[place]) for place in self.absent]

    def _all_written(self, parts: Components, xp: Namespace, scale: Any = None, read: Spot | None = None) -> list[Any]:
        """Return the numbers of a result as written: the position, then each notation, or those of a whole matrix."""
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
        """Name the columns of all notations; of a matrix of the whole pose all columns."""
        if self.joined:
            return list(self.joined.columns)
        return [name for notation, degrees in self.notations for name in notation.columns_in(degrees=degrees)]

    def locked(self, parts: Components) -> Any:
        """Return where the first Euler angles among the notations are not unique; None without Euler angles."""
        for notation, _ in self.notations:
            if notation.euler_axes and len(parts) >= 7:
                x, y, z, w = parts[3:7]
                return euler.locked(x, y, z, w, notation.euler_axes)
        return None


def place_of(unit: Unit | None) -> Place | None:
    """Return a unit if it is a notation of positions on the Earth; else None."""
    return None if unit is None or type(unit) is float or type(unit) is tuple else unit  # type: ignore[return-value]


def count_of(unit: Unit | None) -> int:
    """Return the number of numbers of a position: 3, or those of a geodetic notation; 0 without a unit."""
    place = place_of(unit)
    return place.size if place is not None else 3 * (unit is not None)


def _each(unit: Any) -> tuple[float, float, float]:
    """Return the unit of x, of y and of z."""
    return unit if type(unit) is tuple else (unit, unit, unit)


def checked_rotation(
    shape: Shape, values: Sequence[float], *, normalize: bool
) -> tuple[Quaternion, list[tuple[str, str]]]:
    """Return the quaternion of a record's numbers, and the warnings of its check as (rule, message).

    Raises ValueInvalid for an invalid rotation.
    """
    if shape.notation is None:
        return IDENTITY, []
    tail = shape.joined.tail if shape.joined else ()
    if tail and tuple(values[-len(tail) :]) != tail:
        raise ValueInvalid(wrong_tail(tail, values[-len(tail) :]))
    check = shape.notation.checked_quaternion
    return overheard(check, shape.rotation(values), floats, degrees=shape.degrees, normalize=normalize)


def wrong_tail(wanted: Sequence[float], found: Sequence[float]) -> str:
    """Return the error message for a 4x4 matrix with a wrong last row."""
    expected, actual = (" ".join(f"{value:g}" for value in row) for row in (wanted, found))
    return f"the last row of a 4x4 pose is {expected}, found {actual}"


def doubt(shape: Shape, angle: float, remedy: str) -> str:
    """Return the warning for an angle of more than a full turn: it may be in degrees."""
    name = shape.notation.representation.name if shape.notation else ""
    return f"{name} {angle:g} is more than a full turn in radians; degrees? {remedy}"
