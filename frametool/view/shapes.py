"""What pictures are made of: lines, dots, boxes and words, in pixels with y down; `svg` writes them, `png` paints them.

A colour is `#rrggbb`, or a name of PALETTE, which is another one where the reader's system is dark.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

# name -> light, dark
PALETTE = {
    "paper": ("#ffffff", "#14171c"),
    "ink": ("#1b1f24", "#e8eaed"),
    "soft": ("#5b6470", "#9aa3ad"),
    "zero": ("#c3c9d0", "#454d57"),
    "faint": ("#e3e6ea", "#2c323a"),
    "trail": ("#7c3aed", "#c4a7ff"),
    "x": ("#d92d20", "#ff6b6b"),
    "y": ("#12873d", "#51cf66"),
    "z": ("#1a5fd0", "#5c9dff"),
}


class PictureLine(NamedTuple):
    """A line through points; dashes: pixels drawn and left out; title: what it says when pointed at."""

    points: Sequence[tuple[float, float]]
    colour: str
    width: float = 1.0
    alpha: float = 1.0
    dashes: tuple[float, ...] = ()
    title: str = ""


class PictureDot(NamedTuple):
    """A disc."""

    x: float
    y: float
    radius: float
    colour: str
    title: str = ""


class PictureBox(NamedTuple):
    """A filled rectangle by its left upper corner."""

    x: float
    y: float
    width: float
    height: float
    colour: str
    title: str = ""


class PictureWords(NamedTuple):
    """A text on one line, its middle at y; anchor: start, middle or end of it is at x; turn: degrees, clockwise."""

    x: float
    y: float
    text: str
    colour: str = "ink"
    anchor: str = "start"
    size: float = 12.0
    bold: bool = False
    turn: float = 0.0


Shape = PictureLine | PictureDot | PictureBox | PictureWords


class Picture(NamedTuple):
    """Shapes from the back to the front, and the size of the whole."""

    width: float
    height: float
    shapes: Sequence[Shape]
    title: str = ""
