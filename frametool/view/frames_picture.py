"""Frames as a still picture: ground, links, trails, axes, names and a scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.view.label_places import place_labels
from frametool.view.projection import SLANTED, Projection, Size, axis_tips, nice
from frametool.view.shapes import Picture, PictureDot, PictureLine, PictureWords

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.geometry.types import Rigid
    from frametool.view.frame_scene import FrameScene
    from frametool.view.label_places import Label
    from frametool.view.shapes import Shape

WIDTH, HEIGHT = 1000.0, 700.0
SIZE = Size(WIDTH, HEIGHT, margin=70.0, axes=(14.0, 46.0))
CORNER = 46.0  # pixels from the corner to the little axes
AXES = ("x", "y", "z")


class StillPicture(NamedTuple):
    """The picture; how many names found no place in it; how many frames lie in one small spot."""

    picture: Picture
    hidden: int
    crowded: int


def still_picture(
    scene: FrameScene, eye: tuple[float, float] = SLANTED, title: str = "", other: FrameScene | None = None,
) -> StillPicture:  # fmt: skip
    """Draw a scene as it is seen from a direction: azimuth and elevation, radians.

    other: another tree seen in the same frame, whose frames are laid faintly over those of the same names.
    """
    flat = Projection(scene, SIZE, eye)
    blocked = [(0.0, HEIGHT - 92.0, 100.0, HEIGHT), (WIDTH - 330.0, HEIGHT - 58.0, WIDTH, HEIGHT)]
    labels, hidden = place_labels(flat, blocked=blocked)
    step, ground = flat.ground()
    shapes: list[Shape] = [
        PictureLine([flat.at(a)[:2], flat.at(b)[:2]], "zero" if zero else "faint") for a, b, zero in ground
    ]
    for link in flat.links:
        points = [flat.origin(name)[:2] for name in link]
        shapes.append(PictureLine(points, "soft", alpha=0.7, dashes=(4.0, 3.0)))
    for frame, stretches in flat.trails:
        for stretch in stretches:
            points = [flat.at(point)[:2] for point in stretch]
            shapes.append(PictureLine(points, "trail", 1.5, 0.5, title=frame))
    for name, pose in other.poses().items() if other else ():
        if name in flat.poses:
            shapes += _other(flat, name, pose)
    for name in flat.nearest_last():
        shapes += _frame(flat, name)
    for label in labels:
        shapes += _label(label)
    shapes += [*_corner(flat), *_scale(flat, step)]
    return StillPicture(Picture(WIDTH, HEIGHT, shapes, title), hidden, flat.crowded())


def _frame(flat: Projection, name: str) -> Iterator[Shape]:
    """Draw the axes of a frame, the nearest last."""
    x, y, _ = flat.origin(name)
    tips = flat.tips(name)
    yield from (PictureLine([(x, y), tips[axis][:2]], AXES[axis], 2.0, title=name) for axis in flat.axis_order(name))
    yield PictureDot(x, y, 2.2, "ink", name)


def _other(flat: Projection, name: str, pose: Rigid) -> Iterator[Shape]:
    """Draw where a frame stands in the other tree, and the way there."""
    x, y, _ = flat.at(pose[:3])
    for axis, tip in zip(AXES, axis_tips(pose, flat.axis), strict=True):
        yield PictureLine([(x, y), flat.at(tip)[:2]], axis, 2.0, 0.4, title=name)
    yield PictureLine([flat.origin(name)[:2], (x, y)], "trail", 1.5)


def _label(label: Label) -> Iterator[Shape]:
    """Write a name, with a line to its frame where it stands off."""
    left, top, right, bottom = label.box
    if label.away > 16.0:
        end = min(max(label.point.x, left), right), top if top > label.point.y else bottom
        yield PictureLine([label.point[:2], end], "soft", 0.7)
    yield PictureWords(left + 2.0, (top + bottom) / 2.0, label.words)


def _corner(flat: Projection) -> Iterator[Shape]:
    """Draw which way the axes of the fixed frame point."""
    x, y = CORNER, HEIGHT - CORNER
    right, up, toward = flat.view
    for axis in sorted(range(3), key=lambda axis: toward[axis]):
        dx, dy = right[axis], -up[axis]
        yield PictureLine([(x, y), (x + 28.0 * dx, y + 28.0 * dy)], AXES[axis], 2.0)
        yield PictureWords(x + 38.0 * dx, y + 38.0 * dy, AXES[axis], AXES[axis], "middle", bold=True)


def _scale(flat: Projection, step: float) -> Iterator[Shape]:
    """Draw how long a metre is, and say what all is seen in."""
    metres = nice(110.0 / flat.scale)
    left, right, base = WIDTH - 20.0 - metres * flat.scale, WIDTH - 20.0, HEIGHT - 20.0
    yield PictureLine([(left, base - 6.0), (left, base), (right, base), (right, base - 6.0)], "soft")
    yield PictureWords((left + right) / 2.0, base - 10.0, f"{metres:g} m", "soft", "middle", 11.0)
    said = f"in {flat.scene.fixed[:40]}, grid {step:g} m"
    yield PictureWords(right, HEIGHT - 46.0, said, "soft", "end", 11.0)
