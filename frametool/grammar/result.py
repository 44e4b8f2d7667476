"""Poses as the mappings that machine formats write: the grammar of `frametool.grammar.pose`, backwards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.geometry import euler, floats, quaternion
from frametool.grammar.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack
    from frametool.geometry.representations import Notation


# --keep-sign: the components as they come out of the arithmetic; other notations have no such sign
KEPT = {
    "quaternion": lambda x, y, z, w: (x, y, z, w),
    "xyzw": lambda x, y, z, w: (x, y, z, w),
    "wxyz": lambda x, y, z, w: (w, x, y, z),
}


INFINITE = float("inf")


class Style:
    """How results are written: form, representations, unit of bare angles, digits, sign of quaternions."""

    __slots__ = ("degrees", "form", "keep_sign", "notations", "precision")

    def __init__(
        self,
        form: str,
        notations: tuple[Notation, ...] = (),
        *,
        degrees: bool = False,
        precision: int | None = None,
        keep_sign: bool = False,
    ) -> None:
        """Keep what the options of a command say."""
        self.form = form
        self.notations = notations
        self.degrees = degrees
        self.precision = precision
        self.keep_sign = keep_sign

    def in_form(self, form: str) -> Style:
        """Return the same style in another form."""
        return Style(
            form, self.notations, degrees=self.degrees, precision=self.precision, keep_sign=self.keep_sign
        )

    def number(self, value: float) -> str:
        """Write a finite number: shortest text that reads back to the same bits, or fixed decimals."""
        if not -INFINITE < value < INFINITE:
            raise ValueInvalid(f"a result is {value}: too large for a double, or not finite to begin with")
        return repr(value) if self.precision is None else f"{value:.{self.precision}f}"

    def in_degrees(self, form: Notation) -> bool:
        """Tell whether a representation's angles are written in degrees: its own suffix wins."""
        return self.degrees if form.degrees is None else form.degrees


class Result:
    """A pose and what else is known about it (distance, angle, ..)."""

    __slots__ = ("extras", "pose")

    def __init__(self, pose: Pose, extras: dict[str, Any] | None = None) -> None:
        """Keep the two together."""
        self.pose = pose
        self.extras = extras or {}

    def mapping(self, style: Style) -> dict[str, Any]:
        """Return the tree entry: name, parent, xyz, one key a representation, then what is only said."""
        pose = self.pose
        entry: dict[str, Any] = {key: name for key, name in (("name", pose.name), ("parent", pose.parent)) if name}
        if pose.rotation is None:
            return entry | {"xyz": list(pose.position or (0.0, 0.0, 0.0))} | self.extras
        if pose.position is not None and not any(is_matrix(form) for form in style.notations):
            entry["xyz"] = list(pose.position)
        for form in style.notations:
            key, value = rotation_entry(pose, form, style)
            entry[key] = value
        if any(is_locked(pose, form) for form in style.notations):
            entry["gimbal_lock"] = True
        return entry | self.extras


def tree_entries(tree: Frames, style: Style) -> Iterator[dict[str, Any]]:
    """Yield a tree as the entries of its list form: roots, then edges; moving ones with their samples."""
    yield from ({"name": root} for root in tree.roots)
    for track in tree.tracks():
        if track.standing:
            yield Result(Pose.of(track.components, track.child, track.parent)).mapping(style)
        else:
            yield {"name": track.child, "parent": track.parent, "samples": list(_samples(track, style))}


def _samples(track: MovingTrack, style: Style) -> Iterator[dict[str, Any]]:
    """Yield the samples of a moving frame; one under another parent than the newest names it."""
    for stamp_ns, parent, components in track.walk():
        pose = Pose.of(components, None, None if parent == track.parent else parent)
        yield {"stamp_ns": stamp_ns} | Result(pose).mapping(style)


def sample_results(tree: Frames) -> Iterator[Result]:
    """Yield every sample as a result of its own, frame by frame; those that move have their stamp."""
    for track in tree.tracks():
        for stamp_ns, parent, components in track.walk():
            extras = {} if stamp_ns is None else {"stamp_ns": stamp_ns}
            yield Result(Pose.of(components, track.child, parent), extras)


def columns_of(form: Notation, style: Style) -> Sequence[str]:
    """Name a representation's columns; angles in degrees say so."""
    if form.degrees is not None or not style.degrees:
        return form.columns
    angles = form.representation.angles
    return [f"{name}_deg" if index in angles else name for index, name in enumerate(form.columns)]


def is_matrix(form: Notation) -> bool:
    """Tell whether a representation takes the position into itself."""
    return form.representation.name == "matrix"


def is_locked(pose: Pose, form: Notation) -> bool:
    """Tell whether the Euler angles asked for are not unique here: the third was set to 0."""
    axes = "sxyz" if form.representation.name == "rpy" else form.axes
    return axes is not None and pose.rotation is not None and bool(euler.locked(*pose.rotation, axes))


def rotation_numbers(pose: Pose, form: Notation, style: Style) -> Sequence[float]:
    """Return a pose's rotation as the numbers of one representation, in column order."""
    x, y, z, w = quaternion.unit(*pose.components[3:], floats)
    if style.keep_sign and form.representation.name in KEPT:
        return KEPT[form.representation.name](x, y, z, w)
    numbers: Sequence[float] = form.from_quaternion(x, y, z, w, floats, degrees=style.in_degrees(form))
    return numbers


def rotation_entry(pose: Pose, form: Notation, style: Style) -> tuple[str, Any]:
    """Return the key and the value of one representation, in the shape the grammar reads."""
    name = form.representation.name
    numbers = list(rotation_numbers(pose, form, style))
    key = f"{name}_deg" if form.representation.angles and style.in_degrees(form) else name
    columns = form.representation.columns
    match name:
        case "quaternion":
            return key, dict(zip("xyzw", numbers, strict=True))
        case "rpy":
            return key, dict(zip(columns, numbers, strict=True))
        case "euler":
            return key, {"axes": form.axes, "angles": numbers}
        case "axis_angle":
            return key, {"axis": numbers[:3], "angle": numbers[3]}
        case "matrix":
            return key, _rows(numbers, pose.position)
    return key, numbers


def _rows(numbers: list[float], position: Sequence[float] | None) -> list[list[float]]:
    """Return the 3x3 rows of a rotation, or the 4x4 rows of a pose."""
    rows = [numbers[0:3], numbers[3:6], numbers[6:9]]
    if position is None:
        return rows
    return [[*row, moved] for row, moved in zip(rows, position, strict=True)] + [[0.0, 0.0, 0.0, 1.0]]
