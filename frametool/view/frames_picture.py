"""Frames as a still picture: ground, links, trails, axes, names and a scale, as lines, dots and words in pixels.

What they look like is the business of `frames_svg` and `frames_png`; each shape says only what it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.view.label_places import place_labels
from frametool.view.projection import SLANTED, Projection, Size, nice

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.view.frame_scene import FrameScene
    from frametool.view.label_places import Label

WIDTH, HEIGHT = 1000.0, 700.0
SIZE = Size(WIDTH, HEIGHT, margin=70.0, axes=(14.0, 46.0))
CORNER = 46.0  # pixels from the corner to the little axes
AXES = ("x", "y", "z")


class FrameLine(NamedTuple):
    """A line through points; kind: ground, zero, link, trail, x, y, z, leader, bar.  title: the frame it belongs to."""

    kind: str
    points: Sequence[tuple[float, float]]
    title: str = ""


class FrameDot(NamedTuple):
    """The origin of a frame."""

    x: float
    y: float
    title: str


class FrameWords(NamedTuple):
    """A text whose middle is at y; kind: name, small, x, y, z.  anchor: which part of it stands at x."""

    kind: str
    text: str
    x: float
    y: float
    anchor: str = "start"


Shape = FrameLine | FrameDot | FrameWords


class StillPicture(NamedTuple):
    """The shapes, from the back to the front; how many names found no place; how many frames lie in one small spot."""

    shapes: list[Shape]
    hidden: int
    crowded: int


def still_picture(scene: FrameScene, eye: tuple[float, float] = SLANTED) -> StillPicture:
    """Draw a scene as it is seen from a direction: azimuth and elevation, radians."""
    flat = Projection(scene, SIZE, eye)
    blocked = [(0.0, HEIGHT - 92.0, 100.0, HEIGHT), (WIDTH - 330.0, HEIGHT - 58.0, WIDTH, HEIGHT)]
    labels, hidden = place_labels(flat, blocked=blocked)
    step, ground = flat.ground()
    shapes: list[Shape] = [
        FrameLine("zero" if zero else "ground", [flat.at(a)[:2], flat.at(b)[:2]]) for a, b, zero in ground
    ]
    shapes += [FrameLine("link", [flat.origin(parent)[:2], flat.origin(name)[:2]]) for parent, name in flat.links]
    shapes += [
        FrameLine("trail", [flat.at(point)[:2] for point in stretch], trail.frame)
        for trail in flat.trails
        for stretch in trail.stretches
    ]
    for name in flat.nearest_last():
        shapes += _frame(flat, name)
    for label in labels:
        shapes += _label(label)
    return StillPicture([*shapes, *_corner(flat), *_scale(flat, step)], hidden, flat.crowded())


def _frame(flat: Projection, name: str) -> Iterator[Shape]:
    """Draw the axes of a frame, the nearest last."""
    x, y, _ = flat.origin(name)
    tips = flat.tips(name)
    yield from (FrameLine(AXES[axis], [(x, y), tips[axis][:2]], name) for axis in flat.axis_order(name))
    yield FrameDot(x, y, name)


def _label(label: Label) -> Iterator[Shape]:
    """Write a name, with a line to its frame where it stands off."""
    left, top, right, bottom = label.box
    middle = (top + bottom) / 2.0
    if label.away > 16.0:
        end = min(max(label.point.x, left), right), top if top > label.point.y else bottom
        yield FrameLine("leader", [label.point[:2], end])
    yield FrameWords("name", label.words, left + 2.0, middle)


def _corner(flat: Projection) -> Iterator[Shape]:
    """Draw which way the axes of the fixed frame point."""
    x, y = CORNER, HEIGHT - CORNER
    right, up, toward = flat.view
    for axis in sorted(range(3), key=lambda axis: toward[axis]):
        dx, dy = right[axis], -up[axis]
        yield FrameLine(AXES[axis], [(x, y), (x + 28.0 * dx, y + 28.0 * dy)])
        yield FrameWords(AXES[axis], AXES[axis], x + 38.0 * dx, y + 38.0 * dy, "middle")


def _scale(flat: Projection, step: float) -> Iterator[Shape]:
    """Draw how long a metre is, and say what all is seen in."""
    metres = nice(110.0 / flat.scale)
    left, right, base = WIDTH - 20.0 - metres * flat.scale, WIDTH - 20.0, HEIGHT - 20.0
    yield FrameLine("bar", [(left, base - 6.0), (left, base), (right, base), (right, base - 6.0)])
    yield FrameWords("small", f"{metres:g} m", (left + right) / 2.0, base - 10.0, "middle")
    yield FrameWords("small", f"in {flat.scene.fixed[:40]}, grid {step:g} m", right, HEIGHT - 46.0, "end")
