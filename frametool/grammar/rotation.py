"""The shapes a rotation takes in YAML and JSON, one for each representation, and the unit of its angles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, overheard
from frametool.geometry import floats
from frametool.geometry.representations import REPRESENTATIONS, Notation, axes_name, notation
from frametool.grammar.readers import INDICES, Misfit, NotARotation, Reading, kind, read_texts
from frametool.text.numbers import NotFinite, parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.grammar.readers import Path, Quaternion, Vector

    Shape = tuple[Notation, Sequence[Any], Sequence[Path]]  # what it is, one text a component, and where each stands

ALIASES = {"rotation": "quaternion", "orientation": "quaternion"}  # as ROS messages name it
AXES_KEY = "axes"  # a constant rotation by name instead of numbers
TURN = 2.0 * math.pi


def _rotation_keys() -> dict[str, Notation]:
    """List every key that holds a rotation, with and without a unit."""
    keys = {}
    for name, row in REPRESENTATIONS.items():
        for spelled in (name, f"{name}_deg", f"{name}_rad") if row.angles else (name,):
            keys[spelled] = notation(spelled)
    return keys | {alias: keys[name] for alias, name in ALIASES.items()}


ROTATION_KEYS = _rotation_keys()


def read_rotation(key: str, value: Any, reading: Reading) -> tuple[Vector | None, Quaternion]:
    """Read the value of a rotation key as x, y, z, w; a 4x4 matrix also gives a position.

    Raises Misfit or ValueInvalid: wrong shape, no number, no rotation.
    """
    if key == AXES_KEY:
        return None, _read_axes(value)
    form, texts, places = shape_of(key, value)
    if len(texts) == 16:
        return read_homogeneous(form, texts, places, reading)
    return None, rotation_of(form, texts, places, reading)


def shape_of(key: str, value: Any) -> Shape:
    """Take the value of a rotation key apart: its notation, one text a component, and where each stands below it."""
    if key == AXES_KEY:
        return notation("quaternion"), [repr(part) for part in _read_axes(value)], [(name,) for name in "xyzw"]
    form = ROTATION_KEYS[key]
    return SHAPES.get(form.representation.name, _list_or_map)(form, value)


def _read_axes(value: Any) -> Quaternion:
    """Read the name of a change of axes: `optical`, `ned_from_enu`."""
    from frametool.geometry.conventions import named_rotation

    if type(value) is not str:
        raise Misfit(f"expected the name of axes like optical or ned_from_enu, found {kind(value)}")
    rotation: Quaternion = named_rotation(value).components
    return rotation


def rotation_of(form: Notation, texts: Sequence[Any], places: Sequence[Path], reading: Reading) -> Quaternion:
    """Turn one text a component into x, y, z, w, in the unit that applies, checked to be a rotation."""
    numbers, degrees = read_components(form, texts, places, reading)
    if not form.representation.can_fail:
        return form.to_quaternion(tuple(numbers), floats, degrees=degrees)
    return _checked(form, numbers, reading, degrees=degrees)


def _checked(form: Notation, numbers: Sequence[float], reading: Reading, *, degrees: bool = False) -> Quaternion:
    """Return the quaternion of numbers that make a rotation; what is odd about them is noted."""
    try:
        rotation, odd = overheard(
            form.checked_quaternion, numbers, floats, degrees=degrees, normalize=reading.normalize
        )
    except ValueInvalid as error:
        raise NotARotation(str(error), rule=error.rule) from None
    for rule, message in odd:
        reading.note(message, rule=rule)
    return rotation


def read_components(
    form: Notation,
    texts: Sequence[Any],
    places: Sequence[Path],
    reading: Reading,
) -> tuple[list[float], bool]:
    """Read the components of a rotation; returns them with the unit of the angles among them (True: degrees)."""
    degrees = reading.degrees if form.degrees is None else form.degrees
    try:
        numbers = list(map(parse_number, texts))
    except (ValueInvalid, TypeError):
        return _read_one_by_one(form, texts, places, degrees=degrees)
    if form.degrees is None and not degrees and form.representation.angles:
        _note_degrees(form, numbers, places, reading)
    return numbers, degrees


def _read_one_by_one(
    form: Notation, texts: Sequence[Any], places: Sequence[Path], *, degrees: bool
) -> tuple[list[float], bool]:
    """Read components among which an angle says its own unit, or one is no number: then say where."""
    angles = form.representation.angles
    numbers, units = [], []
    for index, text in enumerate(texts):
        try:
            if type(text) is not str:
                raise Misfit(f"expected a number, found {kind(text)}")
            number, unit = parse_angle(text) if index in angles else (parse_number(text), None)
            if index in angles:
                units.append(_unit_for(unit, text, form))
        except ValueInvalid as error:
            misfit = NotARotation if isinstance(error, NotFinite) else Misfit
            raise misfit(str(error), places[index], rule=error.rule) from None
        numbers.append(number)
    return numbers, _one_unit(numbers, angles, units, bare="deg" if degrees else "rad")


def _unit_for(unit: str | None, text: str, form: Notation) -> str | None:
    """Refuse an angle whose own unit contradicts its key's."""
    if unit == "deg" and form.degrees is False and "pi" not in text:
        raise ValueInvalid(f"{text!r} is in degrees, but {form.spec} says radians")
    if form.degrees and unit is not None and (unit == "rad" or "pi" in text):
        raise ValueInvalid(f"{text!r} is in radians, but {form.spec} says degrees")
    return unit


def _one_unit(numbers: list[float], angles: Sequence[int], units: Sequence[str | None], bare: str) -> bool:
    """Bring angles of one rotation to one unit, in place: degrees if all that are not 0 have them, else radians."""
    given = [unit or bare for unit in units]
    if all(unit == "deg" or numbers[index] == 0.0 for index, unit in zip(angles, given, strict=True)):
        return True
    for index, unit in zip(angles, given, strict=True):
        if unit == "deg":
            numbers[index] = math.radians(numbers[index])
    return False


def _note_degrees(form: Notation, numbers: Sequence[float], places: Sequence[Path], reading: Reading) -> None:
    """Wonder about bare angles beyond a full turn."""
    index = max(form.representation.angles, key=lambda index: abs(numbers[index]))
    if abs(numbers[index]) > TURN:
        name = form.representation.name
        message = f"{name} {numbers[index]:g} is more than a full turn in radians; degrees? write {name}_deg"
        reading.note(message, form.spec, *places[index], rule="degrees")


def _list_or_map(form: Notation, value: Any) -> Shape:
    """Take a list in column order, or a mapping by column names where every name counts as 0 if missing."""
    columns = form.representation.columns
    texts = read_texts(value, columns, partial=bool(form.representation.angles))
    return form, texts, INDICES if type(value) is list else [(name,) for name in columns]


def _quaternion(form: Notation, value: Any) -> Shape:
    if type(value) is list:
        numbers = ", ".join(map(str, value))
        raise Misfit(f"quaternion [{numbers}] has no order; write xyzw: [..], wxyz: [..] or {{x:, y:, z:, w:}}")
    texts = read_texts(value, ("x", "y", "z", "w"))
    return form, texts, (("x",), ("y",), ("z",), ("w",))


def _euler(form: Notation, value: Any) -> Shape:
    if type(value) is not dict:
        raise Misfit(f"expected {{axes: rzyx, angles: [..]}}, found {kind(value)}")
    if unknown := [key for key in value if key not in ("axes", "order", "frame", "angles")]:
        raise Misfit(
            f"unknown key {unknown[0]!r}; expected axes and angles, or order, frame and angles", (unknown[0],), key=True
        )
    try:
        axes = value["axes"] if "axes" in value else axes_name(value["order"], value["frame"])
        angles = value["angles"]
    except KeyError as missing:
        raise Misfit(f"missing {missing.args[0]}; expected axes and angles, or order, frame and angles") from None
    if type(axes) is not str:
        raise Misfit(f"expected axes like rzyx, found {kind(axes)}", ("axes",))
    bound = notation(f"{form.spec}:{axes}")
    texts = read_texts(angles, bound.representation.columns)
    return bound, texts, [("angles", index) for index in range(3)]


def _axis_angle(form: Notation, value: Any) -> Shape:
    if type(value) is not dict:
        raise Misfit(f"expected {{axis: [x, y, z], angle: a}}, found {kind(value)}")
    if wrong := [key for key in value if key not in ("axis", "angle")]:
        raise Misfit(f"unknown key {wrong[0]!r}; expected axis and angle (90deg has its unit)", (wrong[0],), key=True)
    if missing := [key for key in ("axis", "angle") if key not in value]:
        raise Misfit(f"missing {missing[0]}; expected axis and angle")
    axis = value["axis"]
    places = [("axis", index if type(axis) is list else name) for index, name in enumerate("xyz")]
    return form, [*read_texts(axis, ("x", "y", "z")), value["angle"]], [*places, ("angle",)]


def _matrix(form: Notation, value: Any) -> Shape:
    if type(value) is not list:
        raise Misfit(f"expected 3 rows of 3 numbers or 4 rows of 4, found {kind(value)}")
    if len(value) in (9, 16) and not any(type(row) is list for row in value):
        return form, value, INDICES
    size = len(value)
    if size not in (3, 4) or any(type(row) is not list or len(row) != size for row in value):
        lengths = ", ".join(str(len(row)) if type(row) is list else "no list" for row in value)
        raise Misfit(f"expected 3 rows of 3 numbers or 4 rows of 4, found {size} rows of lengths {lengths}")
    places = [(row, column) for row in range(size) for column in range(size)]
    return form, [text for row in value for text in row], places


SHAPES = {"quaternion": _quaternion, "euler": _euler, "axis_angle": _axis_angle, "matrix": _matrix}


def read_homogeneous(
    form: Notation,
    texts: Sequence[Any],
    places: Sequence[Path],
    reading: Reading,
) -> tuple[Vector, Quaternion]:
    """Read a 4x4 matrix: the whole pose."""
    m, _ = read_components(form, texts, places, reading)
    if m[12:] != [0.0, 0.0, 0.0, 1.0]:
        found = " ".join(f"{number:g}" for number in m[12:])
        raise NotARotation(f"the last row of a 4x4 pose is 0 0 0 1, found {found}", rule="denormalized")
    rows = [*m[0:3], *m[4:7], *m[8:11]]
    return (m[3], m[7], m[11]), _checked(form, rows, reading)
