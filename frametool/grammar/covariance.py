"""The uncertainty of a pose: `covariance`, 36 numbers or 6 rows of 6, and `sigma`, the roots of its diagonal.

    {xyz: [1, 2, 3], sigma: {xyz_mm: 2, rpy_deg: [0.1, 0.1, 0.3]}}       a missing part is 0: exact
    x, y, z, qx, qy, qz, qw, sigma_x, .. sigma_yaw                       or c11 .. c66, as columns

Over (x, y, z, rotation about X, Y, Z), metres and radians, along the fixed axes of the parent, as in ROS.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, did_you_mean, shown
from frametool.geometry import rigid, uncertainty
from frametool.grammar.readers import Misfit, NotARotation, Reading, kind, places_in, read_number, read_texts, within
from frametool.text.numbers import ANGLES as UNITS_OF_ANGLE
from frametool.text.numbers import BRACKETS, parse_number, read_number_or_angle
from frametool.text.numbers import LENGTHS as UNITS_OF_LENGTH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry import Components
    from frametool.grammar.readers import Path

COVARIANCE, SIGMA = "covariance", "sigma"
KEYS = ("xyz", "xyz_mm", "xyz_cm", "rpy", "rpy_deg", "rpy_rad")  # of sigma
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
RADIANS = 3.141592653589793 / 180.0


class Unrounded(float):
    """A number that --precision does not round: a few decimals would turn a small variance into 0."""

    __slots__ = ()

    def __format__(self, _: str) -> str:
        """Write the shortest text that reads back."""
        return repr(self)


_SIGMA_COLUMN = r"sigma_(xyz|rpy|x|y|z|roll|pitch|yaw)(?:_([a-z]+))?"
OF = {"xyz": AXES[:3], "rpy": AXES[3:]}


def find_columns(names: Sequence[str], size: int) -> tuple[tuple[int, ...], tuple[tuple[int, str], ...]]:
    """Return the indices of the columns of a covariance, and for sigmas the sources of each of the six axes.

    size: 36 of a pose, 9 of a point.  () without columns.  Raises NotARotation for an incomplete or duplicate one.
    """
    entries = columns(size)
    whole = tuple(names.index(name) for name in entries) if {*entries} <= {*names} else ()
    if not whole and size == 36 and {*columns(9)} <= {*names}:
        count = sum(name in names for name in entries)
        raise NotARotation(f"covariance has {count} columns; 36 are needed, c11 .. c66 (x y z, rotation about X Y Z)")
    places: list[int] = []
    found: dict[str, tuple[int, str]] = {}
    for place, name in enumerate(names):
        bracket = re.search(BRACKETS, name)
        match = re.fullmatch(_SIGMA_COLUMN, name[: bracket.start()] if bracket else name)
        if match is None:
            continue
        unit = bracket[1] if bracket else match[2] or ""
        for axis in OF.get(match[1], (match[1],)):
            if axis in found:
                raise NotARotation(f"column {shown(name)}: the sigma of {axis} is there already; keep one")
            if unit not in (UNITS_OF_LENGTH if axis in OF["xyz"] else ("", *UNITS_OF_ANGLE)):
                raise NotARotation(f"column {shown(name)}: unknown unit {shown(unit)} of a sigma")
            found[axis] = len(places), unit
        places.append(place)
    if whole and found:
        raise NotARotation("sigma and covariance in one row; keep the columns of one")
    if size == 9 and {*found} & {*OF["rpy"]}:
        raise NotARotation("a point has no rotation; its sigmas are sigma_x, sigma_y, sigma_z")
    return whole or tuple(places), tuple(found.get(axis, (-1, "")) for axis in AXES) if found else ()


def is_sigma(name: str) -> bool:
    """Return True if a column has the name of a sigma: `sigma_x`, `sigma_yaw_deg`, `sigma_z [mm]`."""
    return name.startswith("sigma_") and re.match(_SIGMA_COLUMN + r"\s*(?:[\[(]|$)", name) is not None


def in_unit(number: Any, unit: str) -> Any:
    """Return sigmas in metres or radians."""
    if UNITS_OF_ANGLE.get(unit):
        return number * RADIANS
    return number / UNITS_OF_LENGTH[unit] if unit in UNITS_OF_LENGTH else number


def columns(size: int = 36) -> tuple[str, ...]:
    """Return the entries' column names: c11 .. c66 of a pose, c11 .. c33 of a point."""
    axes = range(1, 7 if size == 36 else 4)
    return tuple(f"c{i}{j}" for i in axes for j in axes)


def read_covariance(mapping: dict[str, Any], reading: Reading) -> Components | None:
    """Read the covariance of an entry, from either key; None without one: the pose is exact.

    Raises Misfit with the path, NotARotation if the numbers are not a covariance.
    """
    if COVARIANCE in mapping and SIGMA in mapping:
        raise NotARotation("sigma and covariance in one entry; keep one", (SIGMA,), key=True)
    if SIGMA in mapping:
        said = within((SIGMA,), spelled, mapping[SIGMA])
        return of_sigmas(within((SIGMA,), read_sigmas, said, degrees=reading.degrees))
    if COVARIANCE not in mapping:
        return None
    numbers = [number for _, number in within((COVARIANCE,), entries_of, mapping[COVARIANCE], (36,))]
    within((COVARIANCE,), check, numbers)
    return tuple(numbers)


def entries_of(value: Any, sizes: Sequence[int]) -> list[tuple[Path, float]]:
    """Read the numbers of a covariance, each with its path: a list of them, or a list of rows."""
    if type(value) is not list:
        raise Misfit(f"covariance must be a list of numbers, found {kind(value)}")
    rows: list[tuple[Path, Any]] = [((at,), row) for at, row in enumerate(value)]
    if rows and all(type(row) is list for _, row in rows):
        texts = [((*at, place), text) for at, row in rows for place, text in enumerate(row)]
    else:
        texts = rows
    if len(texts) not in sizes:
        raise NotARotation(uncertainty.wrong_count(len(texts), sizes))
    return [(path, within(path, read_number, text)) for path, text in texts]


def spelled(value: Any) -> list[tuple[str, Path, Any]]:
    """Return `{xyz: .., rpy_deg: ..}` as columns: name, path and text of each sigma; one number is for three axes."""
    if type(value) is not dict or not value:
        raise Misfit(f"sigma must be {{xyz: .., rpy_deg: ..}}, found {kind(value)}")
    found: list[tuple[str, Path, Any]] = []
    for key, each in value.items():
        if key not in KEYS:
            hint = did_you_mean(key, KEYS) or f"; it has {', '.join(KEYS)}"
            raise Misfit(f"unknown key {shown(key)} in sigma{hint}", (key,), key=True)
        if type(each) in (dict, list):
            axes = OF[key[:3]]
            texts = within((key,), read_texts, each, axes, partial=True)
            places = [(key, *step) for step in (places_in(each) if type(each) is list else zip(axes))]
            found += zip((f"sigma_{axis}{key[3:]}" for axis in axes), places, texts, strict=True)
        else:
            found.append((f"sigma_{key}", (key,), each))
    return found


def read_sigmas(said: Sequence[tuple[str, Path, Any]], size: int = 36, *, degrees: bool) -> list[float]:
    """Read sigmas as six numbers in metres and radians; said: the column name, path and text of each.

    size: as for `find_columns`; degrees: the unit of bare angles
    """
    sigmas = [0.0] * 6
    for axis, (at, own_unit) in enumerate(find_columns([name for name, _, _ in said], size)[1]):
        if at >= 0:
            _, path, text = said[at]
            unit = own_unit or "deg" * (degrees and axis > 2)
            number = within(path, _sigma, text, UNITS_OF_ANGLE.get(unit, False) if axis > 2 else None)
            sigmas[axis] = in_unit(number, unit)
    return sigmas


def _sigma(text: Any, degrees: bool | None) -> float:  # noqa: FBT001 - None: not an angle
    if type(text) is not str:
        raise Misfit(f"expected a number, found {kind(text)}")
    number = read_number_or_angle(text, degrees)
    if number < 0.0:
        raise NotARotation(f"sigma is negative: {text}")
    return number


def read_scale(value: Any) -> float:
    """Read the scale of a similarity; raises Misfit, and NotARotation for one that is not positive."""
    scale = within(("scale",), read_number, value)
    if scale <= 0.0:
        raise NotARotation(f"scale is {value}; it must be positive", ("scale",))
    return float(scale)


def refuse_scale(value: Any) -> None:
    """Refuse a scale unless it is 1, or three of them: a scaled transform is not a pose."""
    parts = value if type(value) is list else [*value.values()] if type(value) is dict else [value]
    try:
        is_one = {parse_number(part) for part in parts} == {1.0}
    except (ValueInvalid, TypeError):
        is_one = False
    if not is_one:
        raise NotARotation(rigid.SIMILARITY, ("scale",))


def of_sigmas(sigmas: Sequence[Any]) -> Components:
    """Return the covariance of six independent sigmas, floats or arrays."""
    zero = sigmas[0] - sigmas[0]
    return tuple(sigmas[i] * sigmas[i] if i == j else zero for i in range(6) for j in range(6))


def of_position(entries: Components) -> Components:
    """Return the covariance of the position, a block of that of a pose."""
    return tuple(entries[6 * i + j] for i in range(3) for j in range(3))


def check(entries: Sequence[float]) -> None:
    """Raise NotARotation unless these 36 or 9 numbers are a covariance: known, symmetric, not negative."""
    try:
        uncertainty.check(entries)
    except ValueInvalid as error:
        raise NotARotation(str(error), (0,) if entries[0] == uncertainty.UNKNOWN else ()) from None
