"""Pixels as columns: what a camera says of the points of rows, and of the pixels of rows; the rows stay as they are.

Both are a `Formula` of streams, which is given what moves a row.  Without a pixel, or a ray, there is no number: nan.
"""

from __future__ import annotations

from collections import Counter
from math import degrees
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.geometry import quaternion, rigid
from frametool.stream.request import Formula, Shown
from frametool.stream.row_layout import POINT, POSE, Word

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.camera import Camera
    from frametool.geometry.types import Components, Namespace, Number, Rigid

ALL, INSIDE, OUTSIDE, UNSIZED = "", "in the image", "outside it", "with a pixel"
BEHIND, BEYOND, HORIZON = "behind the camera", "beyond the model", "above the horizon"
UNKNOWN = 2.0  # in_image where the size of the picture is not known
TRUTHS, BITS = ("false", "true", "null"), ("0", "1", "")
RAY = tuple(f"{part}_{axis}" for part in ("origin", "ray") for axis in "xyz")
OWN = (0.0,) * 7  # a row stays as it is: its own pose is not replaced


class Seen(Formula):
    """What both ways share: rows stay, no frame changes, and what becomes of each is counted."""

    def __init__(self, camera: Camera, what: str, first: float) -> None:
        """Begin without rows.

        what: a row is called; first: the centre of the first pixel, as pixels are written
        """
        self.camera = camera
        self.what = what
        self.first = first
        self.counts: Counter[str] = Counter()

    @property
    def lost(self) -> int:
        """Count the rows without numbers."""
        return self.counts[BEHIND] + self.counts[BEYOND] + self.counts[HORIZON]

    @property
    def is_mostly_behind(self) -> bool:
        """Return True if the camera may look another way than it was taken to."""
        return 2 * self.counts[BEHIND] > self.counts[ALL] >= 3

    def summary(self) -> str:
        """Return how many rows there were, and what became of them; "" where all have what they should."""
        angle = f" ({degrees(self.camera.end_angle):.1f} deg)"
        parts = [
            f"{self.counts[name]} {name}{angle * (name == BEYOND)}"
            for name in (INSIDE, OUTSIDE, UNSIZED, BEHIND, BEYOND, HORIZON)
            if self.counts[name]
        ]
        rows = f"{self.counts[ALL]} {self.what}{'s' * (self.counts[ALL] != 1)}"
        return f"{rows}: {', '.join(parts)}" if parts else ""


class PixelsOfPoints(Seen):
    """The pixel and the depth of each point, whether it is in the image, and its distance if that is wanted."""

    def __init__(
        self, camera: Camera, first: float, *, name: str, ranged: bool, take: Callable[..., None] | None = None
    ) -> None:
        """Take the camera and its name, if any; take: is given the pixels and depths, and which are in the image."""
        super().__init__(camera, "point", first)
        self.names = ("u", "v", "depth", "in_image", *["range"] * ranged)
        self.take = take
        members: dict[str, Any] = {"camera": name} if name else {}
        members |= {"pixel": (0, 1), "depth": (2,), "in_image": Word(3, TRUTHS)}
        self.shown = Shown({3: BITS}, members | dict.fromkeys(self.names[4:], (4,)))

    def extras(self, row: str) -> tuple[str, ...]:
        """Name the numbers; raise ValueInvalid for what is at no place."""
        if row not in (POINT, POSE):
            raise ValueInvalid(f"a {row} has no pixel; points and poses have one")
        return self.names

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace  # noqa: ARG002
    ) -> Components:
        """Return the numbers of points in the camera's frame."""
        x, y, z = parts[:3]
        u, v, depth = self.camera.pixels_of(x, y, z)
        sized = self.camera.size is not None
        inside = self.camera.is_in_image(u, v) if sized else _is_known(u)
        code = 1.0 * inside if sized else UNKNOWN + 0.0 * depth
        self._count(u, depth, inside, sized=sized)
        if self.take is not None:
            self.take(u, v, depth, inside)
        ranged = (xp.sqrt(x * x + y * y + z * z),) * len(self.names[4:])
        return (*OWN, u + self.first, v + self.first, depth, code, *ranged)

    def _count(self, u: Number, depth: Number, inside: Any, *, sized: bool) -> None:
        """Count what points became; rows that have none are bad and count elsewhere."""
        seen, there = _number(_is_known(u)), _number(_is_known(depth))
        behind = _number(self.camera.is_behind(depth) & (u != u))  # noqa: PLR0124 - nan
        within = _number(inside)
        self.counts.update({ALL: there, BEHIND: behind, BEYOND: there - seen - behind})
        self.counts.update({INSIDE: within, OUTSIDE: seen - within} if sized else {UNSIZED: seen})


class PointsOfPixels(Seen):
    """What pixels see: a ray from the camera, a point on it, or the pixel of another picture.

    columns: of u and v, then of how far away it is
    far: depth or range, and its value if that is one for all; "" where it is not known
    height: of the plane that rays meet, in the frame of the second pose that rows are given; None for no plane
    into: the camera of the other picture
    """

    reads_row = False

    def __init__(
        self, camera: Camera, first: float, columns: Sequence[str], *, far: tuple[str, float | None] = ("", None),
        height: float | None = None, into: Camera | None = None, target: str = "",
    ) -> None:  # fmt: skip
        """Take what pixels are made of; target: the frame that the numbers are in, if it has a name."""
        super().__init__(camera, "pixel", first)
        self.columns = tuple(columns)
        self.far, self.constant = far
        self.height = height
        self.into = into
        members: dict[str, Any] = {"frame": target} if target and into is None else {}
        if self.extras("") == RAY:
            members |= {"origin": (0, 1, 2), "ray": (3, 4, 5)}
        elif into is None:
            members["point"] = 0, 1, 2
        elif self.columns[0].startswith("pixel"):
            members["pixel"] = 0, 1
        else:
            members |= {self.columns[at]: (at,) for at in range(2)}
        self.shown = Shown({}, members, replaces=into is not None)

    def extras(self, row: str) -> tuple[str, ...]:  # noqa: ARG002
        """Name the numbers."""
        if self.into is not None:
            return ("u", "v") if self.columns[0].startswith("pixel") else self.columns[:2]
        return RAY if self.height is None and not self.far else ("x", "y", "z")

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace  # noqa: ARG002
    ) -> Components:
        """Return the numbers of pixels; parts: the poses of the camera and of the plane."""
        u, v = (each - self.first for each in cells[:2])
        poses: Any = parts
        found = self._found(poses[:7], poses[7:], u, v, cells[2] if cells[2:] else self.constant)
        there = _is_known(u + v)
        lost = there & (found[-1] != found[-1])
        beyond = _number(lost)
        if beyond and self.into is None:
            beyond -= _number(lost & _is_known(self.camera.rays_of(u, v)[0]))
        self.counts.update({ALL: _number(there), BEYOND: beyond})
        self.counts[BEHIND if self.far else HORIZON] += _number(lost) - beyond
        return (*OWN, *found)

    def _found(self, pose: Rigid, ground: Rigid, u: Number, v: Number, far: Number) -> Components:
        """Return the numbers themselves."""
        if self.into is not None:
            return tuple(each + self.first for each in self.camera.undistorted_of(u, v, self.into))
        if self.height is not None:
            return rigid.apply(*pose, *self.camera.plane_points_of(u, v, ground, self.height))
        if self.far:
            point = self.camera.points_of(u, v, **{self.far: far})
            return rigid.apply(*pose, *point) if pose else point
        origin, ray = self.camera.points_of(u, v, range=0.0), self.camera.rays_of(u, v)
        if pose:
            origin, ray = rigid.apply(*pose, *origin), quaternion.rotate(*pose[3:7], *ray)
        return *origin, *ray


def _is_known(number: Number) -> Any:
    return number == number  # noqa: PLR0124 - nan is not equal to itself


def _number(flag: Any) -> int:
    """Count the rows of a block that are something, or the one."""
    return int(flag if isinstance(flag, bool) else flag.sum())
