"""A picture as PNG, painted by matplotlib, which only the extra `plot` brings; a pixel is a pixel of the picture."""

from __future__ import annotations

import io
import warnings
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, printable
from frametool.view.shapes import PALETTE, PictureBox, PictureDot, PictureLine, PictureWords

if TYPE_CHECKING:
    from frametool.view.shapes import Picture, Shape

POINTS = 72 / 100  # of a pixel at 100 dots an inch
ANCHORS = {"start": "left", "middle": "center", "end": "right"}


def require_matplotlib() -> None:
    """Say what to install if it is missing.

    Raises ValueInvalid.
    """
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        raise ValueInvalid("a PNG needs matplotlib: pip install 'frametool[plot]', or write .svg, which needs nothing")


def write_png(picture: Picture) -> bytes:
    """Return the picture as the bytes of a PNG, without a date in them.

    Raises ValueInvalid where matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(picture.width / 100.0, picture.height / 100.0), dpi=100)
    FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, picture.width), ylim=(picture.height, 0.0))
    axes.axis("off")
    for order, shape in enumerate(picture.shapes):
        _paint(axes, shape, order)
    stream = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of letters that matplotlib's font lacks: it draws boxes
        figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _paint(axes: Any, shape: Shape, order: int) -> None:
    """Paint one shape over those before it."""
    look = {"color": PALETTE.get(shape.colour, (shape.colour,))[0], "zorder": order}
    match shape:
        case PictureLine(points, _, width, alpha, dashes):
            xs, ys = zip(*points, strict=True)
            style = (0, [each * POINTS for each in dashes]) if dashes else "solid"
            axes.plot(xs, ys, linewidth=width * POINTS, alpha=alpha, linestyle=style, **look)
        case PictureDot(x, y, radius):
            axes.plot([x], [y], marker="o", markersize=2.0 * radius * POINTS, markeredgewidth=0.0, **look)
        case PictureBox(x, y, width, height):
            right, bottom = x + width, y + height
            axes.fill([x, right, right, x], [y, y, bottom, bottom], linewidth=0.0, **look)
        case PictureWords(x, y, text, _, anchor, size, bold, turn):
            place = {"ha": ANCHORS[anchor], "va": "center", "rotation": -turn, "rotation_mode": "anchor"}
            weight = "bold" if bold else "normal"
            axes.text(x, y, printable(text).replace("$", r"\$"), fontsize=size * POINTS, weight=weight, **place, **look)
