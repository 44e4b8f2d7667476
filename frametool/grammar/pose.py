"""The grammar of one pose: the mapping that files, JSON lines, shell arguments and results share.

    {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}          metres; fixed axes x, y, z
    {name: camera, parent: base, xyz: [0, 0, 1], quaternion: {x: 0, y: 0, z: 0, w: 1}}

The mapping is the pose of `name` in `parent`: parent_from_name. Values are dicts, lists and text as documents
have them; everything is checked here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid, did_you_mean, shown
from frametool.geometry import placed
from frametool.geometry.representations import REPRESENTATIONS, ROTATIONS, notation
from frametool.grammar.readers import (
    INDICES,
    NAME_KEYS,
    PARENT_NAMES,
    Misfit,
    NotARotation,
    Reading,
    kind,
    read_number,
    read_numbers,
    within,
)
from frametool.grammar.rotation_spelling import (
    AGREEMENT,
    AXES_KEY,
    LISTED_WORDS,
    POSITION_WORDS,
    ROTATION_KEYS,
    XYZ,
    agreeing_rotation,
    is_position,
    is_rotation,
    read_rotation,
    read_spelled,
    rotation_of,
    spelled,
)
from frametool.text.numbers import parse_length, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from frametool.geometry.place import Spot
    from frametool.geometry.representations import Notation
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Components, Rigid
    from frametool.grammar.readers import Quaternion, Vector

POSITION_KEYS = {"xyz": 1.0, "translation": 1.0, "position": 1.0, "xyz_mm": 0.001, "xyz_cm": 0.01}
POSITION_KEYS |= dict.fromkeys(POSITION_WORDS, 1.0)
TIMES = ("stamp_ns", "source_stamp_ns", "fixed")
SPREAD = ("count", "used", "distance_rms", "distance_max", "angle_rms", "angle_rms_deg", "angle_max", "angle_max_deg",
          "std_x", "std_y", "std_z", "std_angle", "std_angle_deg")  # fmt: skip
VELOCITY = ("linear_x", "linear_y", "linear_z", "angular_x", "angular_y", "angular_z")  # m/s, rad/s
DESCRIPTIVE = frozenset(("frame", "gimbal_lock", *TIMES, "distance", "angle", "angle_deg", *SPREAD, *VELOCITY))
NAMES = frozenset((*NAME_KEYS, *PARENT_NAMES))
OTHER_NAMES = NAMES.difference(("name", "parent"))
MOST_NAMED = 5  # unknown keys in one message, if they fit
MOST_CHOICES = 10  # representations listed in an error; `help rotations` has all
MOST_CHARACTERS = 80
SCALE = "scale"
COVARIANCE_KEYS = frozenset(("sigma", "covariance"))
LEFT_OUT = "covariances left out: {} has none"  # completed with the name of a command
POSE_KEYS = frozenset(
    (*POSITION_KEYS, *ROTATION_KEYS, *DESCRIPTIVE, *NAMES, *COVARIANCE_KEYS, "inverse", "angles", SCALE, AXES_KEY)
)


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
        """Return a pose of tx, ty, tz, x, y, z, w, and of its covariance or scale as in `placed`."""
        tx, ty, tz, x, y, z, w, *extras = components
        covariance = tuple(extras) if len(extras) > 1 else None
        return cls((tx, ty, tz), (x, y, z, w), name, parent, None, covariance, extras[0] if len(extras) == 1 else 1.0)

    @property
    def components(self) -> Rigid:
        """Return tx, ty, tz, x, y, z, w; missing parts are 0 and the identity."""
        return (*(self.position or (0.0, 0.0, 0.0)), *(self.rotation or (0.0, 0.0, 0.0, 1.0)))

    @property
    def is_exact(self) -> bool:
        """Return True if there is neither a covariance nor a scale."""
        return self.covariance is None and self.scale == 1.0

    @property
    def placed(self) -> Components:
        """Return the components, followed by the covariance or the scale: as in `geometry.placed`.

        Raises ValueInvalid if it has both.
        """
        if self.covariance is not None and self.scale != 1.0:
            raise ValueInvalid(placed.NOT_BOTH)
        return (*self.components, *(self.covariance or ()), *([self.scale] * (self.scale != 1.0)))

    @property
    def transform(self) -> Transform:
        """Return parent_from_name."""
        from frametool.geometry.transform import Transform

        return Transform.of(*self.components)


def read_pose(mapping: dict[str, Any], reading: Reading, also: Collection[str] = ()) -> Pose:
    """Read one pose; `also` lists further keys, which the caller reads.

    Raises Misfit with the path of what is wrong in this mapping.
    """
    if not POSE_KEYS.issuperset(mapping):
        from frametool.grammar.names import may_be_on_earth

        if any(map(may_be_on_earth, mapping)):
            from frametool.grammar.place import EARTH_KEYS, placed_by, without_place

            if not EARTH_KEYS.isdisjoint(mapping):
                return placed_by(mapping, read_pose(without_place(mapping), reading, also), reading)
        _refuse_unknown_keys(mapping, also)
    position: Vector | None = None
    rotation: Quaternion | None = None
    outer_degrees = reading.degrees
    if SCALE in mapping:
        refuse_scale(mapping[SCALE])
    if "angles" in mapping:
        reading.degrees = read_angle_unit(mapping["angles"])
    key, uncertain = "", None
    try:
        if not COVARIANCE_KEYS.isdisjoint(mapping):
            from frametool.grammar.covariance import read_covariance

            uncertain = read_covariance(mapping, reading)
        for key, value in mapping.items():
            if key in POSITION_KEYS and is_position(key, value):
                found = read_position(value, POSITION_KEYS[key], bare=reading.bare_numbers)
                position = found if position is None else _agreeing_position(position, found)
            elif key in LISTED_WORDS and not is_rotation(key, value):
                raise Misfit(f"expected the numbers of {'a position' if key in POSITION_WORDS else 'a rotation'}")
            elif key in ROTATION_KEYS or key == AXES_KEY:
                moved, turned = read_rotation(key, value, reading)
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
        name, parent = _agreeing_name(mapping, NAME_KEYS), _agreeing_name(mapping, PARENT_NAMES)
    pose = Pose(position, rotation, name, parent, None, uncertain)
    is_inverse = "inverse" in mapping and _read_choice("inverse", mapping["inverse"], "true", "false")
    return inverted(pose) if is_inverse else pose


def inverted(pose: Pose) -> Pose:
    """Return the inverse numbers under the same names: the meaning of `inverse: true`."""
    back = Pose.of(placed.inverse(pose.placed))
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
    return _read_choice("angles", value, "deg", "rad")


def _read_choice(key: str, value: Any, yes: str, no: str) -> bool:
    if value not in (yes, no):
        raise Misfit(f"{key} must be {yes} or {no}, found {kind(value)}", (key,))
    return bool(value == yes)


def read_scale(value: Any) -> float:
    """Read the scale of a similarity; raises Misfit, and NotARotation for one that is not positive."""
    scale = within((SCALE,), read_number, value)
    if scale <= 0.0:
        raise NotARotation(f"scale is {value}; it must be positive", (SCALE,))
    return float(scale)


def refuse_scale(value: Any) -> None:
    """Refuse a scale unless it is 1, or three of them: a scaled transform is not a pose."""
    parts = value if type(value) is list else [*value.values()] if type(value) is dict else [value]
    try:
        is_one = {parse_number(part) for part in parts} == {1.0}
    except (ValueInvalid, TypeError):
        is_one = False
    if not is_one:
        raise NotARotation(placed.SIMILARITY, (SCALE,))


def read_position(value: Any, unit: float, *, bare: bool = False) -> Vector:
    """Read [x, y, z] or {x, y, z}, in metres or in the unit, such as 0.001; bare: numbers without units only."""
    parts = round(1.0 / unit)  # dividing rounds once: 0.1 from 100
    x, y, z = read_numbers(value, XYZ, partial=True, each=read_number if bare else length_reader(parts))
    return (x, y, z) if parts == 1 else (x / parts, y / parts, z / parts)


def length_reader(parts: float) -> Callable[[Any], float]:
    """Return a reader of lengths in a unit (parts per metre); lengths in metres may carry another unit, 10cm."""

    def read(text: Any) -> float:
        return parse_length(text) if type(text) is str and parts == 1.0 else read_number(text)

    return read


def _agreeing_position(first: Vector, second: Vector) -> Vector:
    """Accept a second notation of the position if both agree."""
    apart = max(abs(a - b) for a, b in zip(first, second, strict=True))
    if apart > AGREEMENT * (1.0 + max(map(abs, first))):
        raise NotARotation(f"two positions in one entry disagree by {apart:.6g} m; keep one")
    return first


def unknown_keys(hints: Sequence[tuple[str, str]], count: int) -> str:
    """Return unknown keys, each with its hint, as long as they fit; and the number of the others."""
    named: list[str] = []
    for key, hint in hints:
        text = f"unknown key {shown(key)}{hint.replace('; ', ', ')}"
        if named and len("; ".join([*named, text])) > MOST_CHARACTERS:
            break
        named.append(text)
    left = count - len(named)
    last = [f"and {shown(hints[-1][0]) if left == 1 else f'{left} more'}"] if left else []
    return "; ".join([*named, *last])


def _refuse_unknown_keys(mapping: dict[str, Any], also: Collection[str]) -> None:
    """Report all unknown keys of an entry, each with its nearest known one."""
    known = POSE_KEYS.union(also)
    unknown = [key for key in mapping if key not in known]
    known -= LISTED_WORDS
    if unknown and "children" in also and type(mapping[unknown[0]]) is dict:
        below = f"children: {{{unknown[0]}: ..}}"
        raise Misfit(f"frames below one with a pose are under {below}", (unknown[0],), key=True)
    if unknown:
        named = unknown_keys([(key, did_you_mean(key, known)) for key in unknown[: MOST_NAMED + 1]], len(unknown))
        choices = ", ".join([*ROTATIONS][:MOST_CHOICES])
        raise Misfit(f"{named}; a pose has xyz and one rotation: {choices}", (unknown[0],), key=True)


_ROWS_OF_A_POSE = 12  # numbers of a 3x4 matrix


def pose_of_numbers(texts: Sequence[str], default: Notation | None, reading: Reading) -> Pose:
    """Read bare numbers: a rotation in the order of its representation, after x y z if there is a position.

    Raises NotARotation for an invalid rotation, ValueInvalid for a list that is not such numbers.
    """
    rep = _notation_of(texts, default)
    whole, size = rep.representation.whole, len(rep.representation.columns)
    if whole and len(texts) == _ROWS_OF_A_POSE:
        from frametool.grammar.pasted import matrix_pose

        return read_pose(matrix_pose([list(texts)], rep, stated=default is not None) or {}, reading)
    if whole and len(texts) == len(whole.columns):
        return Pose(*read_spelled(rep, texts, INDICES, reading))
    if len(texts) not in rep.counts:
        raise ValueInvalid(f"{rep.counted}; found {len(texts)}")
    x, y, z = map(parse_length, texts[:-size] or ("0", "0", "0"))
    rotation = rotation_of(rep, texts[-size:], INDICES, reading)
    return Pose((x, y, z) if len(texts) > size else None, rotation)


def mapping_of_numbers(texts: Sequence[str], default: Notation | None) -> str:
    """Return the mapping with the same meaning as bare numbers that `pose_of_numbers` has read."""
    from frametool.documents.json import dump
    from frametool.documents.source import Verbatim

    rep = _notation_of(texts, default)
    whole = rep.representation.whole
    size = len(texts) if whole and len(texts) == len(whole.columns) else len(rep.representation.columns)
    unit = "" if rep.degrees is None else "_deg" if rep.degrees else "_rad"
    numbers: Any = list(map(Verbatim, texts))  # texts in place of numbers, read as such
    mapping = {"xyz": numbers[:-size]} if len(texts) > size else {}
    mapping[rep.representation.name + unit] = spelled(rep, numbers[-size:])
    return dump(mapping)


def _notation_of(texts: Sequence[str], default: Notation | None) -> Notation:
    """Return the notation of bare numbers; only a matrix is known by their number."""
    if default is not None:
        return default
    if len(texts) in (9, _ROWS_OF_A_POSE, 16):
        return notation("matrix")
    choices = ", ".join(REPRESENTATIONS)
    raise ValueInvalid(f"{len(texts)} numbers do not say what they are; add --from with one of {choices}")
