"""A picture as SVG, without any library, light or dark as the reader's system is; and as an HTML page around that."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

from frametool.errors import printable
from frametool.view.shapes import PALETTE, PictureBox, PictureDot, PictureLine, PictureWords

if TYPE_CHECKING:
    from frametool.view.shapes import Picture, Shape

FONT = 'font-family="DejaVu Sans, Verdana, sans-serif" font-size="12" dominant-baseline="central" role="img"'
SHARED = """\
path {fill: none; stroke-linecap: round; stroke-linejoin: round}
text {paint-order: stroke; stroke-width: 3px; stroke-linejoin: round}
"""


def write_svg(picture: Picture) -> str:
    """Return the picture as an SVG document."""
    width, height = f"{picture.width:g}", f"{picture.height:g}"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    paper = '<rect class="paper" width="100%" height="100%"/>\n'
    return f"{head} {FONT}>\n{_title(picture.title)}{_style()}{paper}{''.join(map(_element, picture.shapes))}</svg>\n"


def write_html(picture: Picture, more: str = "") -> str:
    """Return an HTML document of the picture, and of what else it is to hold."""
    head = f'<head><meta charset="utf-8">{_title(picture.title)}</head>'
    return f'<!DOCTYPE html>\n<html lang="en">\n{head}\n<body>\n{write_svg(picture)}{more}</body>\n</html>\n'


def _style() -> str:
    """Return the rules that give the palette's colours."""
    light, dark = (
        "".join(
            f".{name} {{fill: {colours[scheme]}}} .{name}-line {{stroke: {colours[scheme]}}}\n"
            for name, colours in PALETTE.items()
        )
        for scheme in (0, 1)
    )
    return f"<style>\n{SHARED}{light}@media (prefers-color-scheme: dark) {{\n{dark}}}\n</style>\n"


def _element(shape: Shape) -> str:
    match shape:
        case PictureLine():
            return _line(shape)
        case PictureDot(x, y, radius, colour, title):
            place = f'cx="{_number(x)}" cy="{_number(y)}" r="{radius:g}"'
            return f"<circle {_fill(colour)} {place}>{_title(title)}</circle>\n"
        case PictureBox(x, y, width, height, colour, title):
            size = f'width="{_number(width)}" height="{_number(height)}"'
            return f'<rect {_fill(colour)} x="{_number(x)}" y="{_number(y)}" {size}>{_title(title)}</rect>\n'
        case PictureWords():
            return _words(shape)


def _line(line: PictureLine) -> str:
    way = "L".join(f"{_number(x)} {_number(y)}" for x, y in line.points)
    look = "" if line.width == 1.0 else f' stroke-width="{line.width:g}"'
    look += "" if line.alpha == 1.0 else f' opacity="{line.alpha:g}"'
    look += f' stroke-dasharray="{" ".join(map("{:g}".format, line.dashes))}"' if line.dashes else ""
    stroke = f'class="{line.colour}-line"' if line.colour in PALETTE else f'stroke="{line.colour}"'
    end = f">{_title(line.title)}</path>" if line.title else "/>"
    return f'<path {stroke}{look} d="M{way}"{end}\n'


def _words(words: PictureWords) -> str:
    look = "" if words.anchor == "start" else f' text-anchor="{words.anchor}"'
    look += "" if words.size == 12.0 else f' font-size="{words.size:g}"'
    look += ' font-weight="bold"' if words.bold else ""
    x, y = _number(words.x), _number(words.y)
    look += f' transform="rotate({words.turn:g} {x} {y})"' if words.turn else ""
    halo = "paper-line" if words.colour in PALETTE else ""
    colour = f'class="{words.colour} {halo}"' if halo else f"fill={quoteattr(words.colour)}"
    return f'<text {colour} x="{x}" y="{y}"{look}>{_text(words.text)}</text>\n'


def _fill(colour: str) -> str:
    return f'class="{colour}"' if colour in PALETTE else f'fill="{colour}"'


def _title(text: str) -> str:
    return f"<title>{_text(text)}</title>" if text else ""


def _text(text: str) -> str:
    """Return a text as XML may hold it."""
    return escape(printable(text))


def _number(value: float) -> str:
    """Write pixels with a tenth's precision."""
    return f"{round(value, 1) + 0.0:g}" if abs(value) < 1e4 else f"{value:.0f}"
