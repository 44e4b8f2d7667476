"""Frames as PNG: the shapes of the still picture, painted by matplotlib, which only the extra `plot` brings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import printable
from frametool.view.frames_picture import HEIGHT, WIDTH, FrameDot, FrameLine
from frametool.view.plot_png import POINTS, as_png, figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.view.frames_picture import Shape

INK, SOFT = "#1b1f24", "#5b6470"
# kind -> colour, width in pixels, opacity, dashes
LINES: dict[str, tuple[str, float, float, Any]] = {
    "ground": ("#e3e6ea", 1.0, 1.0, "solid"),
    "zero": ("#c3c9d0", 1.0, 1.0, "solid"),
    "link": (SOFT, 1.0, 0.7, (0, (4, 3))),
    "trail": ("#7c3aed", 1.5, 0.5, "solid"),
    "leader": (SOFT, 0.7, 1.0, "solid"),
    "bar": (SOFT, 1.0, 1.0, "solid"),
    "x": ("#d92d20", 2.0, 1.0, "solid"),
    "y": ("#12873d", 2.0, 1.0, "solid"),
    "z": ("#1a5fd0", 2.0, 1.0, "solid"),
}
ANCHORS = {"start": "left", "middle": "center", "end": "right"}


def write_png(shapes: Sequence[Shape]) -> bytes:
    """Return the picture as a PNG, a pixel a pixel.

    Raises ValueInvalid where matplotlib is missing.
    """
    drawn = figure(WIDTH / 100.0, HEIGHT / 100.0, layout="none")
    axes = drawn.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, WIDTH), ylim=(HEIGHT, 0.0))
    axes.axis("off")
    for shape in shapes:
        if isinstance(shape, FrameLine):
            colour, width, alpha, dashes = LINES[shape.kind]
            xs, ys = zip(*shape.points, strict=True)
            axes.plot(xs, ys, color=colour, linewidth=width * POINTS, alpha=alpha, linestyle=dashes)
        elif isinstance(shape, FrameDot):
            axes.plot([shape.x], [shape.y], marker="o", markersize=4.4 * POINTS, color=INK)
        else:
            axes.text(
                shape.x, shape.y, _plain(shape.text), fontsize=(11.0 if shape.kind == "small" else 12.0) * POINTS,
                color=SOFT if shape.kind == "small" else INK, ha=ANCHORS[shape.anchor], va="center",
            )  # fmt: skip
    return as_png(drawn)


def _plain(text: str) -> str:
    """Return a text in which matplotlib finds no formula."""
    return printable(text).replace("$", r"\$")
