"""Draw static pictures of SVG elements, in pixels with y down, and write them as SVG, HTML or PNG.

The module also has charts, the HTML shell of all pages, and overlays on camera images.  A colour is `#rrggbb` or a
name in PALETTE, with a light and a dark value.  Only PNG needs a library, matplotlib.
"""

from __future__ import annotations

import io
import math
import os
import struct
import warnings
from base64 import b64decode, b64encode
from hashlib import sha256
from itertools import groupby
from operator import attrgetter
from string import Template
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.sax.saxutils import escape

from frametool.documents.source import opened
from frametool.errors import FileProblem, FormatError, ValueInvalid, printable
from frametool.view.frame_scene import text_width

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.geometry import Number
    from frametool.view.frame_scene import Box

    Point = tuple[float, float]
    Place = Callable[[float, float], Point]  # maps data to pixels

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
# the same, for several lines of one kind on pages
SERIES = {
    "blue": ("#2563eb", "#7aa7ff"),
    "orange": ("#c2410c", "#fb923c"),
    "teal": ("#0f766e", "#2dd4bf"),
    "pink": ("#be185d", "#f472b6"),
    "olive": ("#4d7c0f", "#a3e635"),
    "violet": ("#7c3aed", "#c4a7ff"),
}
NAMED = PALETTE | SERIES

# five colours of viridis, from dark to light
STOPS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))


def shade_of(part: float, stops: Sequence[tuple[int, int, int]] = STOPS) -> str:
    """Return the colour of a value from 0 to 1."""
    place = part * (len(stops) - 1)
    at = min(int(place), len(stops) - 2)
    mixed = (round(a + (b - a) * (place - at)) for a, b in zip(stops[at], stops[at + 1], strict=True))
    return f"#{''.join(f'{part:02x}' for part in mixed)}"


class SvgElement(NamedTuple):
    """An element of SVG.

    kind: path, circle, rect, text or image.  look: its attributes except the colour.  points: of a path.
    text: the content of a text, or the tooltip of other elements.
    """

    kind: str
    colour: str
    look: dict[str, Any]
    points: Sequence[Point] = ()
    text: str = ""


def line(
    points: Sequence[Point], colour: str, width: float = 1.0, alpha: float = 1.0,
    dashes: tuple[float, ...] = (), title: str = "",
) -> SvgElement:  # fmt: skip
    """Return a polyline; dashes: pixels that are drawn and skipped in turn; title: its tooltip."""
    look = {"stroke-width": width, "opacity": alpha, "stroke-dasharray": dashes}
    return SvgElement("path", colour, look, points, title)


def dot(x: float, y: float, radius: float, colour: str, title: str = "") -> SvgElement:
    """Return a disc."""
    return SvgElement("circle", colour, {"cx": x, "cy": y, "r": radius}, text=title)


def box(x: float, y: float, width: float, height: float, colour: str) -> SvgElement:
    """Return a filled rectangle; x, y: its upper left corner."""
    return SvgElement("rect", colour, {"x": x, "y": y, "width": width, "height": height})


def svg_text(x: float, y: float, text: str, colour: str = "ink", anchor: str = "start", size: float = 12.0,
          weight: str = "normal", halo: str = "") -> SvgElement:  # fmt: skip
    """Return one line of text, vertically centred at y; anchor: start, middle or end is at x; halo: outline colour."""
    look = {"x": x, "y": y, "text-anchor": anchor, "font-size": size, "font-weight": weight, "stroke": halo}
    return SvgElement("text", colour, look, text=text)


class Picture(NamedTuple):
    """Shapes from back to front.

    corner: the coordinates of the upper left corner; decimals: of coordinates in SVG
    notes: what the picture does not show, for messages
    """

    width: float
    height: float
    shapes: Sequence[SvgElement]
    title: str = ""
    corner: Point = (0.0, 0.0)
    decimals: int = 1
    notes: Sequence[str] = ()


USUAL = {"stroke-width": 1.0, "opacity": 1.0, "text-anchor": "start", "font-size": 12.0, "font-weight": "normal"}
CLASSES = {"path": "-line", "text": " paper-line"}  # appended to the name of a colour
FONT = 'font-family="DejaVu Sans, Verdana, sans-serif" font-size="12" dominant-baseline="central" role="img"'
SHARED = """\
path {fill: none; stroke-linecap: round; stroke-linejoin: round}
text {paint-order: stroke; stroke-width: .25em; stroke-linejoin: round}
image {image-orientation: none}
"""


def write_svg(picture: Picture, more: str = "") -> str:
    """Return the picture as an SVG document; more: elements behind it."""
    rule = ".{name} {{fill: {colour}}} .{name}-line {{stroke: {colour}}}\n".format
    light, dark = ("".join(rule(name=name, colour=each[scheme]) for name, each in PALETTE.items()) for scheme in (0, 1))
    style = f"<style>\n{SHARED}{light}@media (prefers-color-scheme: dark) {{\n{dark}}}\n</style>\n"
    return svg_element(picture, f'{style}<rect class="paper" width="100%" height="100%"/>\n{more}')


def svg_element(picture: Picture, before: str = "", place: str = "") -> str:
    """Return the picture as an SVG element without styles, with colour names as classes.

    before: elements behind it.  place: its x and y attributes inside another SVG.
    """
    width, height, (left, top) = f"{picture.width:g}", f"{picture.height:g}", picture.corner
    size = f'width="{width}" height="{height}" viewBox="{left:g} {top:g} {width} {height}"'
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg"{place} {size} {FONT}>\n{_title(picture.title)}{before}']
    for kind, colour, look, points, text in picture.shapes:
        if colour in NAMED:
            paint = f' class="{colour}{CLASSES.get(kind, "")}"'
        else:
            paint = f' {"stroke" if points else "fill"}="{colour}"' * bool(colour)
        unusual = {name: value for name, value in look.items() if value not in ("", (), USUAL.get(name))}
        others = "".join(f' {name}="{_attribute(value, picture.decimals)}"' for name, value in unusual.items())
        if points:
            pairs = (" ".join(_attribute(number, picture.decimals) for number in point) for point in points)
            others += f' d="M{"L".join(pairs)}"'
        inside = _text(text) if kind == "text" else _title(text)
        parts.append(f"<{kind}{paint}{others}" + (f">{inside}</{kind}>\n" if inside else "/>\n"))
    return f"{''.join(parts)}</svg>\n"


def _attribute(value: Any, decimals: int) -> str:
    """Format a number with some decimals, several separated by spaces, or a string."""
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return " ".join(map("{:g}".format, value))
    return f"{round(value, decimals) + 0.0:.{5 + decimals}g}" if abs(value) < 1e4 else f"{value:.0f}"


def _title(text: str) -> str:
    return f"<title>{_text(text)}</title>" if text else ""


def _text(text: str) -> str:
    """Escape a text for XML."""
    return escape(printable(text))


def write_html(
    title: str, body: str, *, style: str = "report.css", script: str = "", data: Mapping[str, str] | None = None
) -> str:
    """Return a self-contained page whose content security policy allows only its own script and style.

    style, script: names of files in the folder `page`.  data: JSON texts by element id.
    """
    texts = {"style": page_file(style), "script": "".join(map(page_file, script.split()))}
    if style == "report.css":
        light, dark = ("".join(f"--{name}: {NAMED[name][scheme]}; " for name in NAMED) for scheme in (0, 1))
        rule = ".{0} {{fill: var(--{0})}} .{0}-line {{stroke: var(--{0})}} .{0}-swatch {{color: var(--{0})}}\n"
        rules = "".join(map(rule.format, NAMED))
        dark = f"@media screen and (prefers-color-scheme: dark) {{:root {{{dark}}}}}"
        texts["style"] = f":root {{{light}}}\n{dark}\n{SHARED}{rules}{texts['style']}"
    digests = {kind: b64encode(sha256(text.encode()).digest()).decode() for kind, text in texts.items() if text}
    allowed = "".join(f"{kind}-src 'sha256-{digest}'; " for kind, digest in digests.items())
    policy = f"default-src 'none'; img-src data:; {allowed}base-uri 'none'; form-action 'none'"
    held = ((name, text.translate(HARMLESS)) for name, text in (data or {}).items())
    scripts = "".join(f'<script type="application/json" id="{name}">{text}</script>' for name, text in held)
    texts["script"] = f'<script type="module">{texts["script"]}</script>' * bool(script)
    return filled("shell.html", policy=policy, title=_text(title), body=body, data=scripts, **texts)


HARMLESS = {ord(letter): f"\\u{ord(letter):04x}" for letter in "<>&"}  # so that no name in JSON ends the script


def page_file(name: str) -> str:
    """Return the text of a file in the folder `page`."""
    with open(os.path.join(os.path.dirname(__file__), "page", name), encoding="utf-8") as stream:
        return stream.read()


def filled(name: str, **texts: str) -> str:
    """Return the text of a file in the folder `page` with its placeholders replaced."""
    return Template(page_file(name)).substitute(texts)


def write_picture(picture: Picture, suffix: str) -> str | bytes:
    """Return the picture in the format of a suffix: .png, .svg or .html."""
    if suffix == ".png":
        return write_png(picture)
    if suffix == ".svg":
        return write_svg(picture)
    return write_html(picture.title, f"<main>\n<figure>\n{svg_element(picture)}</figure>\n</main>\n")


LEAST_SPAN, FURTHEST = 1e-300, 1e300  # least range of an axis, and largest value, to which larger ones are clamped


class ChartLine(NamedTuple):
    """A line in data coordinates; without a name it is not in the legend."""

    name: str
    colour: str
    points: Sequence[Point]
    width: float = 1.5
    dashes: tuple[float, ...] = ()
    dots: bool = False


def chart(
    area: Box, names: tuple[str, str], lines: Sequence[ChartLine] = (), ends: Sequence[Point] = (), *,
    is_scaled: bool = True,
) -> tuple[list[SvgElement], Place]:  # fmt: skip
    """Draw two axes, lines and a legend; a legend that is too long has only the dashed lines.

    area: left, top, width and height without the labels.  names: titles of the x and the y axis, with units.
    ends: smallest and largest x and y; by default those of 0 and the lines, in y rounded to ticks.
    is_scaled: draw ticks on the y axis.
    Returns the shapes, and a function from data to pixels; values beyond the y axis are clamped to its ends.
    """
    left, top, width, height = area
    right, bottom, above = left + width, top + height, top - 14.0
    columns = zip(*(point for each in lines for point in each.points), strict=True)
    found = ends or [(min(0.0, *column), max(0.0, *column)) for column in columns] or [(0.0, 0.0)] * 2
    x, y = ((max(begin, -FURTHEST), min(end, FURTHEST)) for begin, end in found)
    x_ticks, y_ticks = ticks(*x), ticks(*y)
    x = x if x[1] - x[0] > LEAST_SPAN else (x_ticks[0], x_ticks[-1])
    y = y if ends else (y_ticks[0], y_ticks[-1])

    def place(across: float, up: float) -> Point:
        inside = min(max(up, y[0]), y[1])
        return left + width * (across - x[0]) / (x[1] - x[0]), top + height * (y[1] - inside) / (y[1] - y[0])

    shapes = [svg_text(left, above, names[1], "soft")]
    if names[0]:
        shapes.append(svg_text(right, bottom + 30.0, names[0], "soft", "end"))
    for tick in (tick for tick in x_ticks if x[0] <= tick <= x[1]):
        across, _ = place(tick, 0.0)
        shapes.append(line([(across, top), (across, bottom)], "faint"))
        shapes.append(svg_text(across, bottom + 13.0, f"{tick:g}", "soft", "middle", 11.0))
    for tick in (tick for tick in y_ticks if is_scaled and y[0] <= tick <= y[1]):
        _, down = place(0.0, tick)
        shapes.append(line([(left, down), (right, down)], "faint" if tick else "zero"))
        shapes.append(svg_text(left - 7.0, down, f"{tick:g}", "soft", "end", 11.0))
    for each in lines:
        points = [place(*point) for point in each.points]
        if points:
            shapes.append(line(points, each.colour, each.width, dashes=each.dashes, title=each.name))
        shapes += (dot(*point, 3.0, each.colour) for point in points if each.dots)
    named = [each for each in lines if each.name]
    if sum(text_width(each.name) + 33.0 for each in named) > width - text_width(names[1]):
        named = [each for each in named if each.dashes]
    for each in reversed(named):
        shapes.append(svg_text(right, above, each.name, "ink", "end", 11.0))
        right -= text_width(each.name) + 21.0
        mark = [(right, above), (right + 16.0, above)]
        shapes.append(line(mark, each.colour, max(each.width, 2.0), dashes=each.dashes))
        right -= 12.0
    return shapes, place


def stacked(
    area: Box, gap: float, along: str, kinds: Mapping[str, Sequence[ChartLine]]
) -> tuple[list[SvgElement], Place]:
    """Draw charts with `chart`, one below the other, over one x axis, whose title is below the last.

    area: of the first chart, whose function from data to pixels is returned.  along: title of the x axis.
    kinds: title of the y axis -> lines
    """
    left, top, width, height = area
    charts = [
        chart((left, top + at * (height + gap), width, height), (along * (at == len(kinds) - 1), name), lines)
        for at, (name, lines) in enumerate(kinds.items())
    ]
    return [shape for shapes, _ in charts for shape in shapes], charts[0][1]


def ticks(low: float, high: float) -> list[float]:
    """Return 2 to 10 round numbers that enclose two values, spaced 1, 2 or 5 times a power of ten."""
    span = high - low if high - low > LEAST_SPAN else 1.0
    step = 10.0 ** math.floor(math.log10(span / 4.0))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if span / (step * factor) <= 6.0)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [count * step for count in range(first, max(last, first + 1) + 1)]


POINTS = 72 / 100  # per pixel, at 100 dots per inch
ANCHORS = {"start": "left", "middle": "center", "end": "right"}


def require_matplotlib() -> None:
    """Raise FileProblem if matplotlib is not installed."""
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        raise FileProblem("a PNG needs matplotlib: pip install 'frametool[plot]', or write .svg, which needs nothing")


def write_png(picture: Picture) -> bytes:
    """Return the picture as a PNG without a timestamp.

    Raises FileProblem if matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.image import imread
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(picture.width / 100.0, picture.height / 100.0), dpi=100)
    FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.axis("off")
    for order, (kind, run) in enumerate(groupby(picture.shapes, key=attrgetter("kind"))):
        if kind == "circle":  # all at once, because there may be many
            found = ((*each.look.values(), NAMED.get(each.colour, (each.colour,))[0]) for each in run)
            xs, ys, radii, colours = zip(*found, strict=True)
            sizes = [(2.0 * radius * POINTS) ** 2 for radius in radii]
            axes.scatter(xs, ys, s=sizes, c=colours, linewidths=0.0, zorder=order)
            continue
        for shape in run:
            look = shape.look
            style = {"color": NAMED.get(shape.colour, (shape.colour,))[0], "zorder": order}
            if kind == "path":
                dashes = [each * POINTS for each in look["stroke-dasharray"]]
                style |= {"alpha": look["opacity"], "linestyle": (0, dashes) if dashes else "solid"}
                axes.plot(*zip(*shape.points, strict=True), linewidth=look["stroke-width"] * POINTS, **style)
            elif kind == "text":
                style |= {"ha": ANCHORS[look["text-anchor"]], "va": "center", "weight": look["font-weight"]}
                if look["stroke"]:
                    style["bbox"] = {"color": look["stroke"], "alpha": 0.5, "pad": 1.0}
                text = printable(shape.text).replace("$", r"\$")
                axes.text(look["x"], look["y"], text, fontsize=look["font-size"] * POINTS, **style)
            elif kind == "rect":
                axes.add_patch(Rectangle((look["x"], look["y"]), look["width"], look["height"], linewidth=0.0, **style))
            else:  # an image; imshow would colour a gray one
                suffix, _, data = look["href"].removeprefix("data:image/").partition(";base64,")
                pixels = imread(io.BytesIO(b64decode(data)), format=suffix)
                gray = {"cmap": "gray", "vmin": 0.0, "vmax": 1.0 if pixels.dtype.kind == "f" else 255.0}
                extent = look["x"], look["x"] + look["width"], look["y"] + look["height"], look["y"]
                axes.imshow(pixels, extent=extent, interpolation="none", zorder=order, **gray)
    left, top = picture.corner
    axes.set(xlim=(left, left + picture.width), ylim=(top + picture.height, top), aspect="auto")
    stream = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # matplotlib draws boxes for letters that its font lacks
        figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


# --- overlays: projected points on the camera's image, coloured by depth; the centre of the first pixel is 0, 0

SUFFIXES = (".svg", ".html", ".png")
MOST, FEW = 20_000, 1000  # largest number of points drawn, and of points drawn large
CORNER = (-0.5, -0.5)  # upper left corner of an image whose first pixel has its centre at 0, 0
SHADES = 24  # colours of the scale
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # the markers of JPEG that are followed by a size


class Overlay:
    """Projected points on an image; if there are more than MOST, only every second, fourth .. is drawn."""

    def __init__(self, image: str, path: str) -> None:
        """Read a PNG or a JPEG, to be embedded unchanged.

        path: the output file, with one of SUFFIXES.
        Raises ValueInvalid; FormatError for anything else, FileProblem.
        """
        self.image, self.path = image, path
        self.suffix = os.path.splitext(path)[1].lower()
        if self.suffix not in SUFFIXES:
            raise ValueInvalid(f"{path}: --image draws {', '.join(SUFFIXES)}")
        if self.suffix == ".png":
            require_matplotlib()
        with opened(image) as file:
            data = file.read()
        kind, width, height = "", 0, 0
        if data.startswith(PNG) and len(data) > 24:
            kind, (width, height) = "png", struct.unpack_from(">II", data, 16)
        at = 2 if data.startswith(JPEG) else len(data)
        while not kind and at + 9 < len(data) and data[at] == 0xFF:
            if data[at + 1] in FRAMES:
                kind, (height, width) = "jpeg", struct.unpack_from(">HH", data, at + 5)
            is_filled = data[at + 1] == 0xFF  # the first byte of a marker may be repeated
            at += 1 if is_filled else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
        if not kind:
            raise FormatError("neither a PNG nor a JPEG; an overlay is drawn over one of these", source=image)
        self.size = width, height
        look = {"x": CORNER[0], "y": CORNER[1], "width": width, "height": height}
        href = f"data:image/{kind};base64,{b64encode(data).decode()}"
        self.shot = SvgElement("image", "", {**look, "href": href})
        self.points: list[tuple[float, float, float]] = []  # depth, u, v
        self.count, self.every = 0, 1

    def take(self, u: Number, v: Number, depth: Number, inside: Any) -> None:
        """Add the points of a block, or one point, where `inside` is True."""
        if isinstance(inside, bool):
            found = [(depth, u, v)] * inside
        else:
            found = [*zip(*(each[inside].tolist() for each in (depth, u, v)), strict=True)]
        self.points += found[-self.count % self.every :: self.every]
        self.count += len(found)
        while len(self.points) > MOST:
            self.points, self.every = self.points[::2], 2 * self.every

    def drawn(self) -> str | bytes:
        """Return the overlay in the format of its suffix; near points cover far ones."""
        self.points.sort(reverse=True)
        near, far = (self.points[-1][0], self.points[0][0]) if self.points else (0.0, 0.0)
        wide, high = self.size
        radius = max(wide / (250.0 if len(self.points) < FEW else 600.0), 0.75)
        shades = {depth: shade_of((far - depth) / (far - near) if far > near else 1.0) for depth, _, _ in self.points}
        shapes = [self.shot, *(dot(u, v, radius, shades[depth]) for depth, u, v in self.points)]
        left, top, part = 0.04 * wide, high - 0.5 - 0.035 * wide, 0.3 * wide / SHADES
        for at in range(SHADES):
            colour = shade_of(1.0 - at / (SHADES - 1))
            shapes.append(box(left + at * part, top, 1.05 * part, 0.015 * wide, colour))
        for share, unit in ((0.0, ""), (0.5, ""), (1.0, " m")):
            x, text = left + share * SHADES * part, f"{near + share * (far - near):.3g}{unit}"
            shapes.append(svg_text(x, top - 0.018 * wide, text, "#ffffff", "middle", 0.022 * wide, halo="#000000"))
        return write_picture(Picture(wide, high, shapes, "overlay", CORNER, 3), self.suffix)

    def summary(self) -> str:
        """Return a sentence on the points drawn."""
        thinned = f", 1 in {self.every} of {self.count}" if self.every > 1 else ""
        points = f"{len(self.points)} point{'s' * (len(self.points) != 1)}"
        return f"{self.path}: {points} over {self.image}{thinned}"
