"""A run as PNG, through matplotlib, which only the extra `plot` brings."""

from __future__ import annotations

import io
import math
import warnings
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.sim.turtle import SIZE
from frametool.view.plot_svg import BACKGROUND, panels

if TYPE_CHECKING:
    from frametool.view.drawing import Drawing

POINTS = 72 / 100  # of a pixel at 100 dots an inch


def require_matplotlib() -> None:
    """Say what to install if it is missing.

    Raises ValueInvalid.
    """
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        raise ValueInvalid("a PNG needs matplotlib: pip install 'frametool[plot]', or write .svg, which needs nothing")


def figure(width: float, height: float, layout: str = "constrained") -> Any:
    """Return an empty figure of so many inches, bound to no window; layout "none" leaves axes where they are put."""
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    empty = Figure(figsize=(width, height), dpi=100, layout=layout)
    FigureCanvasAgg(empty)
    return empty


def as_png(drawn: Any) -> bytes:
    """Return a figure as the bytes of a PNG, without a date in them."""
    stream = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of letters that matplotlib's font lacks: it draws boxes
        drawn.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def plot(drawing: Drawing) -> bytes:
    """Return the drawing as a PNG."""
    drawn = figure(11.0, 5.6)
    rows = panels(drawing)
    grid = drawn.add_gridspec(max(len(rows), 1), 2 if rows else 1)
    _window(drawn.add_subplot(grid[:, 0]), drawing)
    for index, panel in enumerate(rows):
        axes = drawn.add_subplot(grid[index, 1])
        for name, colour, times, values in panel.lines:
            axes.plot(times, values, color=colour, label=name, linewidth=1.2)
        axes.set_ylabel(panel.title)
        axes.grid(visible=True, color="#ddd")
        axes.legend(loc="upper right", fontsize="small")
    return as_png(drawn)


def _window(axes: Any, drawing: Drawing) -> None:
    """Draw the world with its trails and turtles."""
    axes.set(xlim=(0.0, SIZE), ylim=(0.0, SIZE), aspect="equal", facecolor=BACKGROUND, xlabel="x (m)", ylabel="y (m)")
    for stroke in drawing.strokes:
        red, green, blue, width, _ = stroke.pen
        xs, ys = zip(*stroke.points, strict=True)
        axes.plot(xs, ys, color=(red / 255, green / 255, blue / 255), linewidth=width * POINTS)
    colours = drawing.colours()
    for name, (x, y, theta) in drawing.turtles.items():
        triangle = 3, 0, math.degrees(theta) - 90.0
        axes.plot([x], [y], marker=triangle, markersize=14, color=colours[name])
        axes.annotate(name, (x, y), xytext=(0, 12), textcoords="offset points", ha="center", color="white")
