"""The grammar of one pose: the mapping that files, JSON lines, shell arguments and results share.

    {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}          metres; fixed axes x, y, z
    {name: camera, parent: base, xyz: [0, 0, 1], quaternion: {x: 0, y: 0, z: 0, w: 1}}

The mapping is the pose of `name` in `parent`: parent_from_name. Values are dicts, lists and text as documents
have them; everything is checked here.  The shapes of rotations are those of their representations.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from frametool.errors import NamedTuple, ValueInvalid, bare, did_you_mean, overheard, shown
from frametool.geometry import floats, matrix, quaternion, rigid
from frametool.geometry.representations import LIST, NAMED, NAMED_AXES, REPRESENTATIONS, ROTATIONS, ROWS, axes_name
from frametool.geometry.representations import notation as parse_notation
from frametool.grammar import readers
from frametool.grammar.readers import Misfit, NotARotation, Reading, kind, places_in, read_numbers, read_texts, within
from frametool.text.numbers import half_unit, parse_angle, parse_length, parse_number

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from frametool.geometry import Components, Rigid
    from frametool.geometry.place import Spot
    from frametool.geometry.representations import Notation
    from frametool.geometry.transform import Transform
    from frametool.grammar.readers import Path, Quaternion, Vector

    Spelled = tuple[Notation, Sequence[Any], Sequence[Path]]  # notation, one text per component, the path of each

# names of other tools (OpenCV, COLMAP) for a position in metres and a rotation, and the key of the grammar; "" if the
# shape of the value decides.  They need a list or mapping: `t` alone may be a time, and `T` is also a 4x4 matrix
POSITION_WORDS = ("tvec", "trans", "pos", "t", "T")
ROTATION_WORDS = {
    "rvec": "rotvec_rad", "qvec": "wxyz", "R": "matrix", "T": "matrix", "rotation_matrix": "matrix",
    "rot": "", "quat": "", "rotation": "", "orientation": "",
}  # fmt: skip
LISTED_WORDS = frozenset((*POSITION_WORDS, *ROTATION_WORDS)).difference(("rotation", "orientation"))
XYZ = ("x", "y", "z")
TURN = 2.0 * math.pi
IDENTITY = (0.0, 0.0, 0.0, 1.0)
AGREEMENT = 1e-6  # radians, metres: the largest difference between two notations in one entry


ROTATION_KEYS = {  # with and without a unit
    key: parse_notation(key) for name, row in ROTATIONS.items()
    for key in ((name, f"{name}_deg", f"{name}_rad") if row.angles else (name,))
}  # fmt: skip
ROTATION_KEYS |= {word: ROTATION_KEYS[name or "quaternion"] for word, name in ROTATION_WORDS.items()}
POSITION_KEYS = {"xyz": 1.0, "translation": 1.0, "position": 1.0, "xyz_mm": 0.001, "xyz_cm": 0.01}
POSITION_KEYS |= dict.fromkeys(POSITION_WORDS, 1.0)
TIMES = ("stamp_ns", "source_stamp_ns", "fixed")
SPREAD = ("count", "used", "distance_rms", "distance_max", "angle_rms", "angle_rms_deg", "angle_max", "angle_max_deg",
          "std_x", "std_y", "std_z", "std_angle", "std_angle_deg")  # fmt: skip
RELATIVE = ("distance", "angle", "angle_deg")  # m, rad
VELOCITY = ("linear_x", "linear_y", "linear_z", "angular_x", "angular_y", "angular_z")  # m/s, rad/s
DESCRIPTIVE = frozenset(("frame", "gimbal_lock", *TIMES, *RELATIVE, *SPREAD, *VELOCITY))
NAMES = frozenset((*readers.NAME_KEYS, *readers.PARENT_NAMES))
OTHER_NAMES = NAMES.difference(("name", "parent"))
MOST_CHOICES = 10  # representations listed in an error; `help rotations` has all
SCALE = "scale"
COVARIANCE_KEYS = frozenset(("sigma", "covariance"))
AT_EACH = "the covariance stays along {} at each position, which far from the origin differ from those there"
LEFT_OUT = "covariances left out: {} has none"  # completed with the name of a command
POSE_KEYS = frozenset((
    *POSITION_KEYS, *ROTATION_KEYS, *DESCRIPTIVE, *NAMES, *COVARIANCE_KEYS,
    "inverse", "angles", SCALE, readers.AXES_KEY,
))  # fmt: skip


class Pose(NamedTuple):
    """One record: the pose of `name` in `parent`, and its time; missing parts are None.

    covariance: its 36 entries, None if exact; scale: of a similarity p' = scale R p + t
    read: the position on the Earth as it was read
    """

    position: Vector | None = None
    rotation: Quaternion | None = None
    name: str | None = None
    parent: str | None = None
    stamp_ns: int | None = None
    covariance: Components | None = None
    scale: float = 1.0
    read: Spot | None = None

    @classmethod
    def of(cls, components: Sequence[float], name: str | None = None, parent: str | None = None) -> Pose:
        """Return a pose of tx, ty, tz, x, y, z, w, and of its covariance or scale as in `rigid`."""
        tx, ty, tz, x, y, z, w, *extras = components
        covariance = tuple(extras) if len(extras) > 1 else None
        return cls((tx, ty, tz), (x, y, z, w), name, parent, None, covariance, extras[0] if len(extras) == 1 else 1.0)

    @property
    def components(self) -> Rigid:
        """Return tx, ty, tz, x, y, z, w; missing parts are 0 and the identity."""
        return (*(self.position or (0.0, 0.0, 0.0)), *(self.rotation or (0.0, 0.0, 0.0, 1.0)))

    @property
    def placed(self) -> Components:
        """Return the components, followed by the covariance or the scale: as in `geometry.rigid`.

        Raises ValueInvalid if it has both.
        """
        if self.covariance is not None and self.scale != 1.0:
            raise ValueInvalid(rigid.NOT_BOTH)
        return (*self.components, *(self.covariance or ()), *([self.scale] * (self.scale != 1.0)))

    @property
    def transform(self) -> Transform:
        """Return parent_from_name."""
        from frametool.geometry.transform import Transform

        return Transform.of(*self.components)


class WrittenRotation(NamedTuple):
    """A rotation with the numbers that it was written with.

    position: of a matrix that is a whole pose
    numbers: one per component of the notation, or of the whole pose; degrees: the unit of angles
    places: the path of each number below the key; () if none of them may be replaced
    """

    position: Vector | None
    rotation: Quaternion
    notation: Notation
    numbers: Sequence[float]
    degrees: bool
    places: Sequence[Path] = ()


def read_pose(mapping: dict[str, Any], reading: Reading, also: Collection[str] = ()) -> Pose:
    """Read one pose; `also` lists further keys, which the caller reads.

    Raises Misfit with the path of the error in this mapping.
    """
    if not POSE_KEYS.issuperset(mapping):
        if any(map(readers.may_be_on_earth, mapping)):
            from frametool.grammar.place import EARTH_KEYS, placed_by, without_place

            if not EARTH_KEYS.isdisjoint(mapping):
                return placed_by(mapping, read_pose(without_place(mapping), reading, also), reading)
        for key in mapping:
            if key not in POSE_KEYS and key not in also:
                raise _unknown_keys(mapping, also)
    position: Vector | None = None
    rotation: Quaternion | None = None
    outer_degrees = reading.degrees
    if "angles" in mapping:
        reading.degrees = read_angle_unit(mapping["angles"])
    key, uncertain = "", None
    try:
        if not COVARIANCE_KEYS.isdisjoint(mapping) or SCALE in mapping:
            from frametool.grammar.covariance import read_covariance, refuse_scale

            refuse_scale(mapping.get(SCALE, "1"))
            uncertain = read_covariance(mapping, reading)
        for key, value in mapping.items():
            if key in POSITION_KEYS and is_position(key, value):
                parts = round(1.0 / POSITION_KEYS[key])  # of a metre: dividing rounds once, 0.1 from 100
                x, y, z = read_numbers(value, XYZ, partial=True, metres=parts == 1 and not reading.bare_numbers)
                found = x / parts, y / parts, z / parts
                if position is not None:
                    apart = max(abs(a - b) for a, b in zip(position, found, strict=True))
                    if apart > AGREEMENT * (1.0 + max(map(abs, position))):
                        raise NotARotation(f"two positions in one entry disagree by {apart:.6g} m; keep one")
                position = position or found
            elif key in LISTED_WORDS and not is_rotation(key, value):
                raise Misfit(f"expected the numbers of {'a position' if key in POSITION_WORDS else 'a rotation'}")
            elif key in ROTATION_KEYS or key == readers.AXES_KEY:
                moved, turned = read_rotation(key, value, reading)[:2]
                rotation = turned if rotation is None else agreeing_rotation(rotation, turned)
                if moved is not None and position is not None:
                    raise Misfit("a 4x4 matrix is the whole pose; remove xyz, or write the 3x3 rotation")
                position = position or moved
    except Misfit as error:
        raise error.below(key) if key else error from None
    except ValueInvalid as error:
        raise Misfit(str(error), (key,), rule=error.rule) from None
    finally:
        reading.degrees = outer_degrees
    name, parent = mapping.get("name"), mapping.get("parent")
    is_usual = name and parent and type(name) is type(parent) is str and OTHER_NAMES.isdisjoint(mapping)
    if not (is_usual or NAMES.isdisjoint(mapping)):
        name, parent = _agreeing_name(mapping, readers.NAME_KEYS), _agreeing_name(mapping, readers.PARENT_NAMES)
    pose = Pose(position, rotation, name, parent, None, uncertain)
    if (is_inverse := mapping.get("inverse", "false")) not in ("true", "false"):
        raise Misfit(f"inverse must be true or false, found {kind(is_inverse)}", ("inverse",))
    return inverted(pose) if is_inverse == "true" else pose


def inverted(pose: Pose) -> Pose:
    """Return the inverse numbers under the same names: the meaning of `inverse: true`."""
    back = Pose.of(rigid.inverse_full(pose.placed))
    return pose._replace(
        position=None if pose.position is None else back.position,
        rotation=None if pose.rotation is None else back.rotation,
        covariance=back.covariance,
        scale=back.scale,
        read=None,
    )


def read_name(mapping: dict[str, Any], key: str) -> str | None:
    """Read a frame's name, verbatim; None if the key is missing."""
    if key not in mapping:
        return None
    value = mapping[key]
    if type(value) is not str or not value:
        found = "nothing" if value in (None, "") else kind(value)
        raise Misfit(f"{key} must be a frame's name, found {found}; leave {key} out or quote the name", (key,))
    return value


def _agreeing_name(mapping: dict[str, Any], keys: Sequence[str]) -> str | None:
    """Read a frame's name under any of its keys; raises Misfit if two of them differ."""
    found = [(key, name) for key in keys if (name := read_name(mapping, key)) is not None]
    for key, name in found[1:]:
        if name != found[0][1]:
            raise Misfit(f"{key} is {shown(name)} and {found[0][0]} is {shown(found[0][1])}; keep one", (key,))
    return found[0][1] if found else None


def read_angle_unit(value: Any) -> bool:
    """Read `angles: deg` or `angles: rad`; True for degrees."""
    if value not in ("deg", "rad"):
        raise Misfit(f"angles must be deg or rad, found {kind(value)}", ("angles",))
    return bool(value == "deg")


def unknown_key(unknown: Sequence[str], hint: str) -> Misfit:
    """Return the error for unknown keys of an entry, with a suggestion for the first."""
    others = shown(unknown[-1]) if len(unknown) == 2 else f"{len(unknown) - 1} more"
    named = f"unknown key {shown(unknown[0])}{hint.replace('; ', ', ')}{f'; and {others}' * (len(unknown) > 1)}"
    choices = ", ".join([*ROTATIONS][:MOST_CHOICES])
    return Misfit(f"{named}; a pose has xyz and one rotation: {choices}", (unknown[0],), key=True)


def _unknown_keys(mapping: dict[str, Any], also: Collection[str]) -> Misfit:
    """Return the error for the unknown keys of an entry."""
    unknown = [key for key in mapping if key not in POSE_KEYS and key not in also]
    if "children" in also and type(mapping[unknown[0]]) is dict:
        below = f"children: {{{unknown[0]}: ..}}"
        return Misfit(f"frames below one with a pose are under {below}", (unknown[0],), key=True)
    known = POSE_KEYS.union(also) - LISTED_WORDS
    return unknown_key(unknown, did_you_mean(unknown[0], known))


_ROWS_OF_A_POSE = 12  # numbers of a 3x4 matrix


def pose_of_numbers(texts: Sequence[str], default: Notation | None, reading: Reading) -> Pose:
    """Read bare numbers: a rotation in the order of its representation, after x y z if there are more.

    Raises NotARotation for an invalid rotation, ValueInvalid for any other list.
    """
    rep = default or notation_of(texts)
    whole, size = rep.representation.whole, len(rep.representation.columns)
    if whole and len(texts) == _ROWS_OF_A_POSE:
        return read_pose(matrix_pose([list(texts)], rep, stated=default is not None) or {}, reading)
    if whole and len(texts) == len(whole.columns):
        return Pose(*read_spelled(rep, texts, readers.INDICES, reading)[:2])
    if len(texts) not in rep.counts:
        raise ValueInvalid(f"{rep.counted}; found {len(texts)}")
    position: Any = tuple(map(parse_length, texts[:-size])) or None
    return Pose(position, read_spelled(rep, texts[-size:], readers.INDICES, reading).rotation)


def matrix_pose(rows: Sequence[Sequence[str]], rep: Notation, *, stated: bool = False) -> dict[str, Any] | None:
    """Return a 3x3, a 3x4 or a 4x4 matrix, or its numbers row by row, as a mapping; None for another size.

    stated: the user stated `matrix`; then 12 numbers in one row may also be x y z and nine numbers.
    """
    key = rep.spec
    sizes = {len(row) for row in rows}
    cells = [cell for row in rows for cell in row]
    if (len(rows), sizes) in ((3, {3}), (4, {4})):
        return {key: rows}
    if (len(rows), sizes) not in ((3, {4}), (1, {9}), (1, {12}), (1, {16})):
        return None
    if len(cells) != 12:
        size = 3 if len(cells) == 9 else 4
        return {key: [cells[at : at + size] for at in range(0, len(cells), size)]}
    as_rows = cells[3::4], [cells[at : at + 3] for at in (0, 4, 8)]
    behind = cells[:3], [cells[at : at + 3] for at in (3, 6, 9)]
    fitting = [each for each in (behind, as_rows) if are_rotation(each[1])] if stated and len(rows) == 1 else [as_rows]
    if len(fitting) > 1:
        hint = "write {xyz: [..], matrix: [..]}"
        raise ValueInvalid(f"12 numbers may be x y z and a matrix, or the rows of a 3x4 pose; {hint}")
    xyz, turned = fitting[0] if fitting else behind
    return {"xyz": xyz, key: turned}


def are_rotation(rows: Sequence[Sequence[str]]) -> bool:
    """Return True if texts are three rows of three numbers that are a rotation to 1e-3."""
    try:
        numbers = [parse_number(cell) for row in rows for cell in row]
    except ValueInvalid:
        return False
    return [*map(len, rows)] == [3, 3, 3] and matrix.defect(*matrix.nine(numbers), floats) < 1e-3


def notation_of(texts: Sequence[str]) -> Notation:
    """Return the notation of bare numbers without --from; only that of a matrix is known by their number."""
    if len(texts) in (9, _ROWS_OF_A_POSE, 16):
        return parse_notation("matrix")
    choices = ", ".join(REPRESENTATIONS)
    raise ValueInvalid(f"{len(texts)} numbers do not say what they are; add --from with one of {choices}")


# --- rotations ---


def is_position(key: str, value: Any) -> bool:
    """Return True if a key with this value is a position: names of other tools need a list or mapping."""
    if key in ("t", "T"):
        return type(value) is list and len(value) in (1, 3) and len(places_in(value)) == len(XYZ)
    return key not in LISTED_WORDS or type(value) in (list, dict)


def is_rotation(key: str, value: Any) -> bool:
    """Return True if a key with this value is a rotation; never raises: errors are reported when it is read."""
    if key not in LISTED_WORDS:
        return key in ROTATION_KEYS or (key == readers.AXES_KEY and type(value) is str)
    if key not in ROTATION_WORDS or type(value) not in (list, dict):
        return False
    if key in ("R", "T"):
        return type(value) is list and (key == "R" or len(value) == 16 or (len(value) in (3, 4) and _is_rows(value)))
    return True


def _is_rows(value: list[Any]) -> bool:
    return all(type(row) is list and len(row) > 1 for row in value)


def own_key(key: str, value: Any) -> str:
    """Return the key of the grammar for a rotation key and its value.

    Raises Misfit for three or four numbers under a key that does not state their notation.
    """
    is_short = key == "R" and len(value) in (3, 4) and not _is_rows(value)
    if (meant := ROTATION_WORDS.get(key, key)) and not is_short:
        return meant
    if type(value) is dict:
        return "rpy" if not {"roll", "pitch", "yaw"}.isdisjoint(value) else "quaternion"
    if type(value) is list and (len(value) == 9 or (value and _is_rows(value))):
        return "matrix"
    if type(value) is list and len(value) == 3:
        numbers = bare(", ".join(map(str, value)))
        raise Misfit(f"{key} [{numbers}] does not say what it is; write rpy: [..], rpy_deg: [..] or rotvec: [..]")
    return "quaternion"


def read_rotation(key: str, value: Any, reading: Reading, *, check: bool = True) -> WrittenRotation:
    """Read the value of a rotation key; of several notations that agree the first, without places.

    check: False for a multiple of a rotation matrix; the returned rotation is then the identity
    Raises Misfit or ValueInvalid: wrong shape, not a number, not a rotation, or several that do not agree.
    """
    several = type(value) is list and key != readers.AXES_KEY and ROTATION_KEYS[key].representation.axes == NAMED_AXES
    if several and value and all(type(each) is dict for each in value):  # Euler angles about different axes
        first, *others = [within((index,), read_rotation, key, each, reading) for index, each in enumerate(value)]
        for other in others:
            agreeing_rotation(first.rotation, other.rotation)
        return first._replace(places=())  # type: ignore[no-any-return]
    return read_spelled(*_shape_of(key, value), reading, check=check)


def agreeing_rotation(first: Quaternion, second: Quaternion) -> Quaternion:
    """Accept a second notation of the rotation if both agree; return the first."""
    apart = quaternion.distance(*first, *second, floats)
    if apart > AGREEMENT:
        raise NotARotation(f"two rotations in one entry disagree by {math.degrees(apart):.6g} degrees; keep one")
    return first


def _shape_of(key: str, value: Any) -> Spelled:
    """Split the value of a rotation key: its notation, one text per component, and the path of each below it."""
    if key == readers.AXES_KEY:  # the name of a change of axes: optical, ned_from_enu
        from frametool.geometry.conventions import named_rotation

        if type(value) is not str:
            raise Misfit(f"expected the name of axes like optical or ned_from_enu, found {kind(value)}")
        parts = named_rotation(value).components
        return parse_notation("quaternion"), [*map(repr, parts)], ()
    notation = ROTATION_KEYS[own_key(key, value)]
    row, is_list = notation.representation, type(value) is list
    if isinstance(row.shape, tuple):
        return _take_parts(notation, value, dict(row.shape))
    if row.shape == ROWS:
        return _take_rows(notation, value)
    if row.shape == NAMED and is_list:
        raise _without_order(key, notation, value)
    columns = row.whole.columns if row.whole and is_list and len(value) == len(row.whole.columns) else row.columns
    if row.shape == NAMED or (type(value) is dict and value.keys() == {*row.names}):
        columns = row.names
    texts = read_texts(value, columns, partial=bool(row.angles))  # missing angles of a mapping count as 0
    return notation, texts, places_in(value) if is_list else [*zip(columns)]


def _without_order(key: str, notation: Notation, value: Any) -> Misfit:
    """Return the error for a list whose order only names could state."""
    columns = {*notation.representation.columns}
    others = [name for name, row in ROTATIONS.items() if row.shape == LIST and {*row.columns} == columns]
    choices, names = ", ".join(f"{name}: [..]" for name in others), ", ".join(f"{name}:" for name in notation.names)
    return Misfit(f"{key} [{bare(', '.join(map(str, value)))}] has no order; write {choices} or {{{names}}}")


def read_spelled(
    notation: Notation, texts: Sequence[Any], places: Sequence[Path], reading: Reading, *, check: bool = True
) -> WrittenRotation:
    """Read one text per component: a rotation, or the numbers of a whole pose; the rotation is checked."""
    row, whole = notation.representation, notation.representation.whole
    degrees = reading.degrees if notation.degrees is None else notation.degrees
    try:
        numbers = list(map(parse_number, texts))
    except (ValueInvalid, TypeError):
        numbers, degrees = _read_one_by_one(notation, texts, places, degrees=degrees, bare=reading.bare_numbers)
    else:
        if notation.degrees is None and not degrees and row.angles:
            index = max(row.angles, key=lambda index: abs(numbers[index]))
            if abs(numbers[index]) > TURN:
                message = f"{row.name} {numbers[index]:g} is more than a full turn in radians; degrees?"
                reading.note(f"{message} write {row.name}_deg", notation.spec, *places[index], rule="degrees")
        if row.batch is not None:
            numbers = as_meant(notation, numbers, texts, reading)
    own: Sequence[float] = numbers
    position, rotation = None, IDENTITY
    if check and whole is not None and len(numbers) == len(whole.columns):
        end = len(numbers) - len(whole.tail)
        if tuple(numbers[end:]) != whole.tail:
            found, tail = (" ".join(f"{number:g}" for number in each) for each in (numbers[end:], whole.tail))
            raise NotARotation(f"the last row of a 4x4 pose is {tail}, found {found}", rule="denormalized")
        position, own = whole.split(numbers)
    if check and row.complaint is None:
        rotation = notation.to_quaternion(tuple(own), floats, degrees=degrees)
    elif check:
        try:
            rotation, warnings = overheard(
                notation.checked_quaternion, own, floats, degrees=degrees, normalize=reading.normalize
            )
        except ValueInvalid as error:
            raise NotARotation(str(error), rule=error.rule) from None
        for rule, message in warnings:
            reading.note(message, rule=rule)
    return WrittenRotation(position, rotation, notation, numbers, degrees, places)


FEW_DIGITS = "a rotation is off by {:.2g}, which its few digits explain, and was normalised"


def as_meant(notation: Notation, numbers: list[float], texts: Sequence[str], reading: Reading) -> list[float]:
    """Return the nearest rotation to numbers written with few digits, if rounding alone makes them invalid.

    Beyond 1e-3 it is recorded as a warning.
    """
    row, rule = notation.representation, notation.representation.batch
    if rule is None or rule.explained is None:
        return numbers
    at: Sequence[int] = range(len(numbers))
    if row.whole is not None and len(numbers) == len(row.whole.columns):
        at = row.whole.split(at)[1]
    own = [*map(numbers.__getitem__, at)]
    off = rule.deviation(*own, floats) if len(own) == len(row.columns) else 0.0
    if not (off > quaternion.SILENT and rule.explained(own, [half_unit(texts[index]) for index in at], floats)):
        return numbers
    if quaternion.TOLERATED < off < math.inf and not reading.normalize:
        reading.note(FEW_DIGITS.format(off), rule="rounded")
    meant = dict(zip(at, rule.repair(*own, floats), strict=True))
    return [meant.get(index, number) for index, number in enumerate(numbers)]


def _read_one_by_one(
    notation: Notation, texts: Sequence[Any], places: Sequence[Path], *, degrees: bool, bare: bool
) -> tuple[list[float], bool]:
    """Read components if an angle has its own unit or one is not a number; an error has the path of the component.

    The result is in degrees if all angles other than 0 are, else in radians.
    """
    angles = () if bare else notation.representation.angles
    read = [
        within(place, _with_unit, text, notation if at in angles else None)
        for at, (text, place) in enumerate(zip(texts, places, strict=False))
    ]
    numbers = [number for number, _ in read]
    in_degrees = [at for at in angles if (read[at][1] or ("deg" if degrees else "rad")) == "deg"]
    if all(at in in_degrees or numbers[at] == 0.0 for at in angles):
        return numbers, True
    for at in in_degrees:
        numbers[at] = math.radians(numbers[at])
    return numbers, False


def _with_unit(text: Any, notation: Notation | None) -> tuple[float, str | None]:
    """Read a number, or an angle of a notation with its own unit; raises ValueInvalid if its key has another one."""
    if notation is None or type(text) is not str:
        return readers.read_number(text), None
    number, unit = parse_angle(text)
    own = "degrees" if "deg" in text or "°" in text else "radians"
    other = {True: "degrees", False: "radians", None: own}[notation.degrees]
    if unit and own != other:
        raise ValueInvalid(f"{shown(text)} is in {own}, but {notation.spec} is in {other}")
    return number, unit


def _take_parts(notation: Notation, value: Any, parts: dict[str, int]) -> Spelled:
    """Read a mapping whose keys hold several numbers each, with `axes`, or `order` and `frame`, if axes are named."""
    named = notation.representation.axes == NAMED_AXES
    of_axes: tuple[str, ...] = ("axes",) * named
    if named and type(value) is dict and not value.keys().isdisjoint(("order", "frame")):
        of_axes = ("order", "frame")
    if type(value) is not dict or value.keys() != {*of_axes, *parts}:
        keys = ", ".join(f"{key}: [..]" if count > 1 else f"{key}: 90deg" for key, count in parts.items())
        expected = f"expected {{{'axes: rzyx, ' * named}{keys}}}"
        if type(value) is not dict:
            raise Misfit(f"{expected}, found {kind(value)}")
        if unknown := [key for key in value if key not in parts and key not in of_axes]:
            raise Misfit(f"unknown key {shown(unknown[0])}; {expected}", (unknown[0],), key=True)
        raise Misfit(f"missing {next(key for key in (*of_axes, *parts) if key not in value)}; {expected}")
    for key in of_axes:
        if type(value[key]) is not str:
            raise Misfit(f"expected {key} like {'intrinsic' if key == 'frame' else 'rzyx'}", (key,))
    if of_axes:
        axes = value["axes"] if "axes" in value else axes_name(value["order"], value["frame"])
        notation = parse_notation(f"{notation.spec}:{axes}")
    texts: list[Any] = []
    places: list[Path] = []
    for key, count in parts.items():
        names = notation.representation.names[len(texts) : len(texts) + count]
        texts += within((key,), read_texts, value[key], names) if count > 1 else [value[key]]
        steps = range(count) if type(value[key]) is list else names
        places += [(key, step) for step in steps] if count > 1 else [(key,)]
    return notation, texts, places


def _take_rows(notation: Notation, value: Any) -> Spelled:
    """Read the rows of a rotation or of a whole pose, or all their numbers in one list."""
    row = notation.representation
    counts = {len(each): math.isqrt(len(each)) for each in (row.columns, *([row.whole.columns] if row.whole else []))}
    expected = " or ".join(f"{size} rows of {size}{' numbers' * (not at)}" for at, size in enumerate(counts.values()))
    if type(value) is not list:
        raise Misfit(f"expected {expected}, found {kind(value)}")
    if len(value) in counts and not any(type(each) is list for each in value):
        return notation, value, readers.INDICES
    size = len(value)
    if size not in counts.values() or any(type(each) is not list or len(each) != size for each in value):
        lengths = ", ".join(str(len(each)) if type(each) is list else "no list" for each in value)
        raise Misfit(f"expected {expected}, found {size} rows of lengths {bare(lengths)}")
    places = [(at, column) for at in range(size) for column in range(size)]
    return notation, [text for each in value for text in each], places
