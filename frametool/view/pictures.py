"""Static pictures of lines, dots, boxes, text and images, in pixels with y down, written as SVG, HTML or PNG.

A colour is `#rrggbb` or a name in PALETTE, which has light and dark values.  Only PNG needs a library, matplotlib.
Also here: charts, the HTML shell of all pages, the static picture of frames, and the HTML of values for notebooks.
"""

from __future__ import annotations

import io
import math
import os
import warnings
from base64 import b64encode
from functools import partial
from hashlib import sha256
from itertools import groupby
from string import Template
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.sax.saxutils import escape

from frametool.errors import FileProblem, printable
from frametool.frames.lookups import Frames
from frametool.view.scene import SLANTED, FrameScene, Labels, Projection, Size, axis_tips, nice, text_width

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from frametool.geometry.types import Rigid
    from frametool.view.scene import Label

    Range = tuple[float, float]
    Point = tuple[float, float]

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
# the same of the lines of several things of one kind, on pages
SERIES = {
    "blue": ("#2563eb", "#7aa7ff"),
    "orange": ("#c2410c", "#fb923c"),
    "teal": ("#0f766e", "#2dd4bf"),
    "pink": ("#be185d", "#f472b6"),
    "olive": ("#4d7c0f", "#a3e635"),
    "violet": ("#7c3aed", "#c4a7ff"),
}
NAMED = PALETTE | SERIES

# viridis at five places, dark for little
STOPS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
PIECES, LAST_SHADE = 24, 0.85  # of a trail, from dark when it begins to a green that white paper still shows


def shade_of(part: float, stops: Sequence[tuple[int, int, int]] = STOPS) -> str:
    """Return the colour of a value from 0 to 1."""
    place = part * (len(stops) - 1)
    at = min(int(place), len(stops) - 2)
    mixed = (round(a + (b - a) * (place - at)) for a, b in zip(stops[at], stops[at + 1], strict=True))
    return f"#{''.join(f'{part:02x}' for part in mixed)}"


class PictureLine(NamedTuple):
    """A polyline, broken at NaN.

    dashes: pixels drawn and skipped in turn; title: its tooltip.
    """

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
    """A filled rectangle; x, y: its upper left corner."""

    x: float
    y: float
    width: float
    height: float
    colour: str


class PictureWords(NamedTuple):
    """One line of text, vertically centred at y; anchor: which part of it is at x; halo: colour of its outline."""

    x: float
    y: float
    text: str
    colour: str = "ink"
    anchor: str = "start"
    size: float = 12.0
    bold: bool = False
    halo: str = ""


class PictureImage(NamedTuple):
    """An embedded image file; x, y: its upper left corner; kind: png or jpeg."""

    x: float
    y: float
    width: int
    height: int
    kind: str
    data: bytes


Shape = PictureImage | PictureLine | PictureDot | PictureBox | PictureWords


class Picture(NamedTuple):
    """Shapes from back to front; corner: the coordinates of its upper left corner; decimals: of coordinates in SVG."""

    width: float
    height: float
    shapes: Sequence[Shape]
    title: str = ""
    corner: tuple[float, float] = (0.0, 0.0)
    decimals: int = 1
    notes: Sequence[str] = ()


FONT = 'font-family="DejaVu Sans, Verdana, sans-serif" font-size="12" dominant-baseline="central" role="img"'
SHARED = """\
path {fill: none; stroke-linecap: round; stroke-linejoin: round}
text {paint-order: stroke; stroke-width: .25em; stroke-linejoin: round}
image {image-orientation: none}
"""


def write_svg(picture: Picture, more: str = "") -> str:
    """Return the picture as an SVG document; more: elements drawn below it."""
    rule = ".{name} {{fill: {colour}}} .{name}-line {{stroke: {colour}}}\n".format
    light, dark = ("".join(rule(name=name, colour=PALETTE[name][scheme]) for name in PALETTE) for scheme in (0, 1))
    style = f"<style>\n{SHARED}{light}@media (prefers-color-scheme: dark) {{\n{dark}}}\n</style>\n"
    return svg_element(picture, f'{style}<rect class="paper" width="100%" height="100%"/>\n{more}')


def svg_element(picture: Picture, before: str = "", place: str = "") -> str:
    """Return the picture as an SVG element without styles.

    before: elements drawn below it.  place: its x and y attributes inside another SVG.
    """
    width, height, (left, top) = f"{picture.width:g}", f"{picture.height:g}", picture.corner
    size = f'width="{width}" height="{height}" viewBox="{left:g} {top:g} {width} {height}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg"{place} {size} {FONT}>\n{_title(picture.title)}'
    return f"{head}{before}{''.join(_element(each, picture.decimals) for each in picture.shapes)}</svg>\n"


def write_html(
    title: str, body: str, *, style: str = "report.css", script: str = "", data: Mapping[str, str] | None = None
) -> str:
    """Return a self-contained page whose policy allows its own script and style only.

    style, script: names of files in the folder `page`.  data: JSON texts by element id.
    """
    texts = {"style": page_file(style), "script": "".join(map(page_file, script.split()))}
    if style == "report.css":
        light, dark = ("".join(f"--{name}: {NAMED[name][scheme]}; " for name in NAMED) for scheme in (0, 1))
        rule = ".{0} {{fill: var(--{0})}} .{0}-line {{stroke: var(--{0})}} .{0}-swatch {{color: var(--{0})}}\n"
        rules = "".join(map(rule.format, NAMED))
        dark = f"@media screen and (prefers-color-scheme: dark) {{:root {{{dark}}}}}"
        texts["style"] = f":root {{{light}}}\n{dark}\n{SHARED}{rules}{texts['style']}"
    digests = (f"{kind}-src '{_digest(text)}'; " if text else "" for kind, text in texts.items())
    policy = f"default-src 'none'; img-src data:; {''.join(digests)}base-uri 'none'; form-action 'none'"
    held = {name: text.translate(HARMLESS) for name, text in (data or {}).items()}
    scripts = "".join(f'<script type="application/json" id="{name}">{text}</script>' for name, text in held.items())
    if script:
        texts["script"] = f'<script type="module">{texts["script"]}</script>'
    return filled("shell.html", policy=policy, title=_text(title), body=body, data=scripts, **texts)


HARMLESS = {ord(letter): f"\\u{ord(letter):04x}" for letter in "<>&"}  # JSON that no name in it can end


def page_file(name: str) -> str:
    """Return the text of a file in the folder `page`."""
    with open(os.path.join(os.path.dirname(__file__), "page", name), encoding="utf-8") as stream:
        return stream.read()


def filled(name: str, **texts: str) -> str:
    """Return the text of a file in the folder `page` with texts in their places."""
    return Template(page_file(name)).substitute(texts)


def _digest(text: str) -> str:
    return f"sha256-{b64encode(sha256(text.encode()).digest()).decode()}"


def write_picture(picture: Picture, suffix: str) -> str | bytes:
    """Return a picture as .png, .svg or .html."""
    if suffix == ".png":
        return write_png(picture)
    if suffix == ".svg":
        return write_svg(picture)
    return write_html(picture.title, f"<main>\n<figure>\n{svg_element(picture)}</figure>\n</main>\n")


def _element(shape: Shape, decimals: int) -> str:
    number = partial(_number, decimals=decimals)
    match shape:
        case PictureImage(x, y, width, height, kind, data):
            size = f'x="{x:g}" y="{y:g}" width="{width}" height="{height}"'
            return f'<image {size} href="data:image/{kind};base64,{b64encode(data).decode()}"/>\n'
        case PictureLine(points, colour, width, alpha, dashes, title):
            way = "L".join(f"{number(x)} {number(y)}" if x == x else "" for x, y in points)  # noqa: PLR0124 - no number
            way = way.replace("LL", "M")
            look = "" if width == 1.0 else f' stroke-width="{width:g}"'
            look += "" if alpha == 1.0 else f' opacity="{alpha:g}"'
            look += f' stroke-dasharray="{" ".join(map("{:g}".format, dashes))}"' if dashes else ""
            stroke = f'class="{colour}-line"' if colour in NAMED else f'stroke="{colour}"'
            end = f">{_title(title)}</path>" if title else "/>"
            return f'<path {stroke}{look} d="M{way}"{end}\n'
        case PictureDot(x, y, radius, colour, title):
            place = f'cx="{number(x)}" cy="{number(y)}" r="{radius:g}"'
            end = f">{_title(title)}</circle>" if title else "/>"
            return f"<circle {place} {_fill(colour)}{end}\n"
        case PictureBox(x, y, width, height, colour):
            size = f'width="{number(width)}" height="{number(height)}"'
            return f'<rect {_fill(colour)} x="{number(x)}" y="{number(y)}" {size}/>\n'
        case PictureWords(x, y, text, colour, anchor, size_px, bold, outline):
            look = "" if anchor == "start" else f' text-anchor="{anchor}"'
            look += "" if size_px == 12.0 else f' font-size="{size_px:g}"'
            look += ' font-weight="bold"' if bold else ""
            look += f' stroke="{outline}"' if outline else ""
            halo = " paper-line" if colour in NAMED else ""
            return f'<text {_fill(colour, halo)} x="{number(x)}" y="{number(y)}"{look}>{_text(text)}</text>\n'


def _fill(colour: str, more: str = "") -> str:
    return f'class="{colour}{more}"' if colour in NAMED else f'fill="{colour}"'


def _title(text: str) -> str:
    return f"<title>{_text(text)}</title>" if text else ""


def _text(text: str) -> str:
    """Escape a text for XML."""
    return escape(printable(text))


def _number(value: float, decimals: int = 1) -> str:
    """Write a coordinate with some decimals."""
    return f"{round(value, decimals) + 0.0:.{5 + decimals}g}" if abs(value) < 1e4 else f"{value:.0f}"


LEAST_SPAN, FURTHEST = 1e-300, 1e300  # of values on an axis; what is beyond is drawn at its end


class Area(NamedTuple):
    """The plot area of a chart in pixels, without its labels."""

    left: float
    top: float
    width: float
    height: float


class ChartLine(NamedTuple):
    """A line in data coordinates; a line without a name is not in the legend."""

    name: str
    colour: str
    points: Sequence[Point]
    width: float = 1.5
    dashes: tuple[float, ...] = ()
    dots: bool = False


class Chart:
    """Two axes in a plot area, and the mapping from data to pixels."""

    def __init__(
        self, area: Area, names: tuple[str, str], lines: Sequence[ChartLine] = (), *,
        ends: tuple[Range, Range] | None = None, equal: bool = False,
    ) -> None:  # fmt: skip
        """Choose the limits of both axes.

        names: titles of the x and the y axis, with units.  ends: least and greatest x and y; by default 0 and those of
        the lines.  equal: use one scale for both axes.
        """
        self.area, self.names, self.lines = area, names, lines
        columns = [(0.0, *column) for column in zip(*(point for line in lines for point in line.points), strict=True)]
        x, y = ends or [(min(column), max(column)) for column in columns] or [(0.0, 0.0)] * 2
        if equal:
            pixels = min(size / max(end - begin, 1e-9) for size, (begin, end) in zip(area[2:], (x, y), strict=True))
            x, y = (((begin + end - size / pixels) / 2.0, (begin + end + size / pixels) / 2.0)
                    for size, (begin, end) in zip(area[2:], (x, y), strict=True))  # fmt: skip
        limits = [(max(begin, -FURTHEST), min(end, FURTHEST)) for begin, end in (x, y)]
        self.ticks = [ticks(*each) for each in limits]
        self.x, self.y = ((each[0], each[-1]) for each in self.ticks)
        if x[1] - x[0] > LEAST_SPAN:  # ends where the values do
            self.x = limits[0]
        if equal:
            self.y = limits[1]
        self.ticks = [[at for at in each if begin <= at <= end]
                      for each, (begin, end) in zip(self.ticks, (self.x, self.y), strict=True)]  # fmt: skip

    def place(self, x: float, y: float) -> Point:
        """Return the pixels of a point; values beyond the y axis are clamped to its ends."""
        left, top, width, height = self.area
        inside = min(max(y, self.y[0]), self.y[1])
        across = left + width * (x - self.x[0]) / (self.x[1] - self.x[0])
        return across, top + height * (self.y[1] - inside) / (self.y[1] - self.y[0])

    def drawn(self) -> Iterator[Shape]:
        """Draw axes, lines and the legend."""
        left, top, width, height = self.area
        right, bottom = left + width, top + height
        yield PictureWords(left, top - 14.0, self.names[1], "soft")
        if self.names[0]:
            yield PictureWords(right, bottom + 30.0, self.names[0], "soft", "end")
        for tick in self.ticks[0]:
            across = self.place(tick, 0.0)[0]
            yield PictureLine([(across, top), (across, bottom)], "faint")
            yield PictureWords(across, bottom + 13.0, f"{tick:g}", "soft", "middle", 11.0)
        for tick in self.ticks[1]:
            down = self.place(0.0, tick)[1]
            yield PictureLine([(left, down), (right, down)], "faint" if tick else "zero")
            yield PictureWords(left - 7.0, down, f"{tick:g}", "soft", "end", 11.0)
        for line in self.lines:
            points = [self.place(*point) for point in line.points]
            if points:
                yield PictureLine(points, line.colour, line.width, dashes=line.dashes, title=line.name)
            yield from (PictureDot(x, y, 3.0, line.colour) for x, y in points if line.dots)
        yield from legend(self.lines, left + text_width(self.names[1]), right, top - 14.0)


def legend(lines: Sequence[ChartLine], left: float, right: float, y: float) -> Iterator[Shape]:
    """Draw a right-aligned legend on one line, each name after its line; of a long one only dashed lines."""
    named = [line for line in lines if line.name]
    if sum(text_width(line.name) + 33.0 for line in named) > right - left:
        named = [line for line in named if line.dashes]
    for line in reversed(named):
        yield PictureWords(right, y, line.name, "ink", "end", 11.0)
        right -= text_width(line.name) + 5.0
        yield PictureLine([(right - 16.0, y), (right, y)], line.colour, max(line.width, 2.0), dashes=line.dashes)
        right -= 28.0


def ticks(low: float, high: float) -> list[float]:
    """Return 2 to 10 round numbers that enclose two values, spaced 1, 2 or 5 times a power of ten."""
    span = high - low if high - low > LEAST_SPAN else 1.0
    step = 10.0 ** math.floor(math.log10(span / 4.0))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if span / (step * factor) <= 6.0)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [count * step for count in range(first, max(last, first + 1) + 1)]


POINTS = 72 / 100  # of a pixel at 100 dots an inch
ANCHORS = {"start": "left", "middle": "center", "end": "right"}


def require_matplotlib() -> None:
    """Check that matplotlib is installed.

    Raises FileProblem.
    """
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        raise FileProblem("a PNG needs matplotlib: pip install 'frametool[plot]', or write .svg, which needs nothing")


def write_png(picture: Picture) -> bytes:
    """Return the picture as a PNG without a timestamp.

    Raises FileProblem where matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(picture.width / 100.0, picture.height / 100.0), dpi=100)
    FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.axis("off")
    for order, (kind, run) in enumerate(groupby(picture.shapes, key=type)):
        if kind is PictureDot:
            _paint_dots(axes, run, order)
        else:
            for shape in run:
                _paint(axes, shape, order)
    left, top = picture.corner
    axes.set(xlim=(left, left + picture.width), ylim=(top + picture.height, top), aspect="auto")
    stream = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of letters that matplotlib's font lacks: it draws boxes
        figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _paint_dots(axes: Any, dots: Iterable[Any], order: int) -> None:
    """Paint a run of dots."""
    rows = ((x, y, (2.0 * radius * POINTS) ** 2, _plain(colour)) for x, y, radius, colour, _ in dots)
    xs, ys, sizes, colours = zip(*rows, strict=True)
    axes.scatter(xs, ys, s=sizes, c=colours, linewidths=0.0, zorder=order)


def _plain(colour: str) -> str:
    return NAMED.get(colour, (colour,))[0]


def _paint(axes: Any, shape: Any, order: int) -> None:
    """Paint a shape; gray images stay gray."""
    look: dict[str, Any] = {"zorder": order}
    if not isinstance(shape, PictureImage):
        look["color"] = _plain(shape.colour)
    match shape:
        case PictureImage(x, y, width, height, kind, data):
            from matplotlib.image import imread

            pixels = imread(io.BytesIO(data), format=kind)
            white, ends = 1.0 if pixels.dtype.kind == "f" else 255.0, (x, x + width, y + height, y)
            axes.imshow(pixels, extent=ends, interpolation="none", cmap="gray", vmin=0.0, vmax=white, **look)
        case PictureLine(points, _, width, alpha, dashes):
            xs, ys = zip(*points, strict=True)
            style = (0, [each * POINTS for each in dashes]) if dashes else "solid"
            axes.plot(xs, ys, linewidth=width * POINTS, alpha=alpha, linestyle=style, **look)
        case PictureBox(x, y, width, height):
            right, bottom = x + width, y + height
            axes.fill([x, right, right, x], [y, y, bottom, bottom], linewidth=0.0, **look)
        case PictureWords(x, y, text, _, anchor, size, bold):
            place: dict[str, Any] = {"ha": ANCHORS[anchor], "va": "center"}
            weight = "bold" if bold else "normal"
            if shape.halo:
                place["bbox"] = {"color": shape.halo, "alpha": 0.5, "pad": 1.0}
            axes.text(x, y, printable(text).replace("$", r"\$"), fontsize=size * POINTS, weight=weight, **place, **look)


WIDTH, HEIGHT = 1000.0, 700.0
SIZE = Size(WIDTH, HEIGHT, margin=70.0, axes=(14.0, 46.0), cell=(4, 4), line=16.0, measure=text_width)
CORNER = 46.0  # pixels from the corner to the little axes
AXES = ("x", "y", "z")


def still_picture(
    scene: FrameScene, eye: tuple[float, float] = SLANTED, title: str = "", other: FrameScene | None = None,
) -> Picture:  # fmt: skip
    """Draw a scene from a direction, azimuth and elevation in radians; its notes say what it does not show.

    other: another tree in the same frame; its frames with the same names are drawn faintly.
    """
    flat = Projection(scene, SIZE, eye)
    blocked = [(0.0, HEIGHT - 92.0, 100.0, HEIGHT), (WIDTH - 330.0, HEIGHT - 58.0, WIDTH, HEIGHT)]
    labels = Labels(flat, blocked)
    labels.place_all()
    step, ground = flat.ground()
    shapes: list[Shape] = [
        PictureLine([flat.at(a)[:2], flat.at(b)[:2]], "zero" if zero else "faint") for a, b, zero in ground
    ]
    for link in flat.links:
        points = [flat.origins[name][:2] for name in link]
        shapes.append(PictureLine(points, "soft", alpha=0.7, dashes=(4.0, 3.0)))
    for frame, stretches in flat.trails.items():
        shapes += _trail(frame, [[flat.at(point)[:2] for point in stretch] for stretch in stretches])
    for name, pose in other.poses().items() if other else ():
        if name in flat.poses:
            shapes += _other(flat, name, pose)
    for name in flat.nearest_last():
        shapes += _frame(flat, name)
    for label in labels.placed:
        shapes += _label(label)
    shapes += [*_corner(flat), *_scale(flat, step)]
    crowded, hidden = flat.crowded(), labels.hidden
    notes = [f"{crowded} of {len(scene.names)} frames lie in a small spot; --below FRAME shows a part"] * bool(crowded)
    notes += [f"{hidden} names found no place"] * bool(hidden)
    return Picture(WIDTH, HEIGHT, shapes, title, notes=notes)


def _frame(flat: Projection, name: str) -> Iterator[Shape]:
    """Draw the axes of a frame, the nearest last."""
    x, y, _ = flat.origins[name]
    yield from (PictureLine([(x, y), tip[:2]], AXES[axis], 2.0, title=name) for axis, tip in flat.axes(name))
    yield PictureDot(x, y, 2.2, "ink", name)


def _trail(frame: str, stretches: Sequence[Sequence[tuple[float, float]]]) -> Iterator[Shape]:
    """Draw the trail of a frame, coloured by time."""
    steps = max(sum(len(stretch) - 1 for stretch in stretches), 1)
    size, done = -(-steps // PIECES), 0
    for stretch in stretches:
        for begin in range(0, max(len(stretch) - 1, 1), size):
            shade = shade_of(LAST_SHADE * (done + begin) / steps)
            yield PictureLine(stretch[begin : begin + size + 1], shade, 1.5, 0.8, title=frame)
        done += len(stretch) - 1


def _other(flat: Projection, name: str, pose: Rigid) -> Iterator[Shape]:
    """Draw a frame's pose in the other tree, and a line to it."""
    x, y, _ = flat.at(pose[:3])
    for axis, tip in zip(AXES, axis_tips(pose, flat.axis), strict=True):
        yield PictureLine([(x, y), flat.at(tip)[:2]], axis, 2.0, 0.4, title=name)
    yield PictureLine([flat.origins[name][:2], (x, y)], "trail", 1.5)


def _label(label: Label) -> Iterator[Shape]:
    """Draw a name, with a leader line if it is away from its frame."""
    left, top, right, bottom = label.box
    if label.away > 1.1:
        end = min(max(label.point.x, left), right), top if top > label.point.y else bottom
        yield PictureLine([label.point[:2], end], "soft", 0.7)
    yield PictureWords(left + 2.0, (top + bottom) / 2.0, label.words)


def _corner(flat: Projection) -> Iterator[Shape]:
    """Draw the directions of the axes of the fixed frame."""
    x, y = CORNER, HEIGHT - CORNER
    right, up, toward = flat.view
    for axis in sorted(range(3), key=lambda axis: toward[axis]):
        dx, dy = right[axis], -up[axis]
        yield PictureLine([(x, y), (x + 28.0 * dx, y + 28.0 * dy)], AXES[axis], 2.0)
        yield PictureWords(x + 38.0 * dx, y + 38.0 * dy, AXES[axis], AXES[axis], "middle", bold=True)


def _scale(flat: Projection, step: float) -> Iterator[Shape]:
    """Draw the scale bar, and name the fixed frame."""
    metres = nice(110.0 / flat.scale)
    left, right, base = WIDTH - 20.0 - metres * flat.scale, WIDTH - 20.0, HEIGHT - 20.0
    yield PictureLine([(left, base - 6.0), (left, base), (right, base), (right, base - 6.0)], "soft")
    yield PictureWords((left + right) / 2.0, base - 10.0, f"{metres:g} m", "soft", "middle", 11.0)
    yield PictureWords(right, HEIGHT - 46.0, f"in {flat.scene.fixed[:40]}, grid {step:g} m", "soft", "end", 11.0)


def html_of(value: Any) -> str | None:
    """Return the HTML of a transform, rotation, tree, trajectory or comparison; None if its repr is all there is."""
    if isinstance(value, Frames) and value.frames:
        # a picture of its own, for the style of an SVG element would count in the whole notebook
        svg = b64encode(write_svg(still_picture(FrameScene(value), title=value.name)).encode()).decode()
        return f'<img alt="frames of {escape(value.name)}" src="data:image/svg+xml;base64,{svg}">'
    if hasattr(value, "as_dict"):
        from frametool.view.fit_text import write_comparison

        return f"<pre>{escape(write_comparison(value.as_dict()))}</pre>"
    if hasattr(value, "stamps_ns"):
        from frametool.frames.trajectory import way

        path = f"{way(value.xyz)[-1]:.3f} m of path" if value.size else "empty"
        return f"<pre>{value.size} poses of {escape(value.body)} in {escape(value.world)}, {path}</pre>"
    if isinstance(value, Frames) or value.shape:
        return None
    from frametool.grammar.pose import Pose
    from frametool.grammar.result import Result, Style
    from frametool.view.pose_text import write_poses

    parts = value.components
    pose = Pose.of(parts) if len(parts) > len("xyzw") else Pose(rotation=parts)
    return f"<pre>{escape(write_poses([Result(pose)], Style('text')))}</pre>"
