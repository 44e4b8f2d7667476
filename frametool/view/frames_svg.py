"""Frames as SVG, without any library: light or dark as the reader's system is."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from frametool.errors import printable
from frametool.view.frames_picture import HEIGHT, WIDTH, FrameDot, FrameLine

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.view.frames_picture import FrameWords, Shape

STYLE = """
path {fill: none; stroke-linecap: round}
.ground {stroke: #e3e6ea} .zero {stroke: #c3c9d0} .link {stroke: #5b6470; stroke-dasharray: 4 3; opacity: .7}
.trail {stroke: #7c3aed; stroke-width: 1.5; opacity: .5}
.leader, .bar {stroke: #5b6470} .leader {stroke-width: .7}
.x, .y, .z {stroke-width: 2} path.x {stroke: #d92d20} path.y {stroke: #12873d} path.z {stroke: #1a5fd0}
.paper {fill: #fff} circle {fill: #1b1f24} text {fill: #1b1f24; dominant-baseline: central}
text.name {paint-order: stroke; stroke: #fff; stroke-width: 3px; stroke-linejoin: round}
text.small {fill: #5b6470; font-size: 11px} text.x, text.y, text.z {font-weight: bold; stroke: none}
@media (prefers-color-scheme: dark) {
.paper {fill: #14171c} .ground {stroke: #2c323a} .zero {stroke: #454d57} .link, .leader, .bar {stroke: #9aa3ad}
path.x {stroke: #ff6b6b} path.y {stroke: #51cf66} path.z {stroke: #5c9dff} .trail {stroke: #c4a7ff}
circle, text {fill: #e8eaed} text.name {stroke: #14171c} text.small {fill: #9aa3ad}
}
"""


def write_svg(shapes: Sequence[Shape], title: str) -> str:
    """Return the picture as an SVG document."""
    size = f'width="{WIDTH:g}" height="{HEIGHT:g}" viewBox="0 0 {WIDTH:g} {HEIGHT:g}"'
    font = 'font-family="DejaVu Sans, Verdana, sans-serif" font-size="12" role="img"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} {font}>\n{_title(title)}\n<style>{STYLE}</style>\n'
    paper = '<rect class="paper" width="100%" height="100%"/>\n'
    return f"{head}{paper}{''.join(_elements(shapes))}</svg>\n"


def _elements(shapes: Sequence[Shape]) -> Iterator[str]:
    for shape in shapes:
        if isinstance(shape, FrameLine):
            yield _line(shape)
        elif isinstance(shape, FrameDot):
            yield f'<circle cx="{_number(shape.x)}" cy="{_number(shape.y)}" r="2.2">{_title(shape.title)}</circle>\n'
        else:
            yield _words(shape)


def _line(line: FrameLine) -> str:
    way = "L".join(f"{_number(x)} {_number(y)}" for x, y in line.points)
    title = _title(line.title)
    return f'<path class="{line.kind}" d="M{way}"' + (f">{title}</path>\n" if title else "/>\n")


def _words(words: FrameWords) -> str:
    anchor = "" if words.anchor == "start" else f' text-anchor="{words.anchor}"'
    place = f'x="{_number(words.x)}" y="{_number(words.y)}"{anchor}'
    return f'<text class="{words.kind}" {place}>{_text(words.text)}</text>\n'


def _title(name: str) -> str:
    return f"<title>{_text(name)}</title>" if name else ""


def _text(text: str) -> str:
    """Return a text as XML may hold it."""
    return escape(printable(text))


def _number(value: float) -> str:
    """Write pixels with a tenth's precision."""
    return f"{round(value, 1) + 0.0:g}" if abs(value) < 1e5 else f"{value:.0f}"
