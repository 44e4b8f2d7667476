"""Frames drawn once: a static picture for files and notebooks, and one of braille characters for a terminal."""

from __future__ import annotations

import math
from base64 import b64encode
from itertools import groupby, pairwise
from operator import itemgetter
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

from frametool.errors import cells, printable
from frametool.frames.lookups import Frames
from frametool.frames.stamps import format_stamp
from frametool.view.pictures import Picture, dot, line, shade_of, words, write_svg
from frametool.view.scene import SLANTED, FrameScene, Labels, Projection, Size, nice, text_width, words_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from frametool.geometry.types import Rigid
    from frametool.view.pictures import Point, SvgElement
    from frametool.view.scene import Flat, Label

    Run = tuple[str, str]  # text and its style
    Spot = tuple[int, int]  # line and column

PIECES, LAST_SHADE = 24, 0.85  # of a trail, from dark when it begins to a green that white paper still shows
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
    shapes = [line([flat.at(a)[:2], flat.at(b)[:2]], "zero" if zero else "faint") for a, b, zero in ground]
    for link in flat.links:
        points = [flat.origins[name][:2] for name in link]
        shapes.append(line(points, "soft", alpha=0.7, dashes=(4.0, 3.0)))
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
    near, hidden = len(flat.cluster()), labels.hidden
    crowded = f"{near} of {len(scene.names)} frames lie in a small spot; --below FRAME shows a part"
    notes = [crowded] * (near < len(flat.poses))
    notes += [f"{hidden} names found no place"] * bool(hidden)
    return Picture(WIDTH, HEIGHT, shapes, title, notes=notes)


def _frame(flat: Projection, name: str) -> Iterator[SvgElement]:
    """Draw the axes of a frame, the nearest last."""
    x, y, _ = flat.origins[name]
    yield from (line([(x, y), tip[:2]], AXES[axis], 2.0, title=name) for axis, tip in flat.axes(name))
    yield dot(x, y, 2.2, "ink", name)


def _trail(frame: str, stretches: Sequence[Sequence[Point]]) -> Iterator[SvgElement]:
    """Draw the trail of a frame in pieces, coloured by time."""
    size = -(-sum(map(len, stretches)) // PIECES)
    pieces = [each[at : at + size + 1] for each in stretches for at in range(0, max(len(each) - 1, 1), size)]
    for number, piece in enumerate(pieces):
        yield line(piece, shade_of(LAST_SHADE * number / len(pieces)), 1.5, 0.8, title=frame)


def _other(flat: Projection, name: str, pose: Rigid) -> Iterator[SvgElement]:
    """Draw a frame's pose in the other tree, and a line to it."""
    x, y, _ = flat.at(pose[:3])
    for axis, tip in zip(AXES, flat.tips(pose), strict=True):
        yield line([(x, y), tip[:2]], axis, 2.0, 0.4, title=name)
    yield line([flat.origins[name][:2], (x, y)], "trail", 1.5)


def _label(label: Label) -> Iterator[SvgElement]:
    """Draw a name, with a leader line if it is away from its frame."""
    left, top, right, bottom = label.box
    if label.away > 1.1:
        end = min(max(label.point.x, left), right), top if top > label.point.y else bottom
        yield line([label.point[:2], end], "soft", 0.7)
    yield words(left + 2.0, (top + bottom) / 2.0, label.words)


def _corner(flat: Projection) -> Iterator[SvgElement]:
    """Draw the directions of the axes of the fixed frame."""
    x, y = CORNER, HEIGHT - CORNER
    right, up, toward = flat.view
    for axis in sorted(range(3), key=lambda axis: toward[axis]):
        dx, dy = right[axis], -up[axis]
        yield line([(x, y), (x + 28.0 * dx, y + 28.0 * dy)], AXES[axis], 2.0)
        yield words(x + 38.0 * dx, y + 38.0 * dy, AXES[axis], AXES[axis], "middle", weight="bold")


def _scale(flat: Projection, step: float) -> Iterator[SvgElement]:
    """Draw the scale bar, and name the fixed frame."""
    metres = nice(110.0 / flat.scale)
    left, right, base = WIDTH - 20.0 - metres * flat.scale, WIDTH - 20.0, HEIGHT - 20.0
    yield line([(left, base - 6.0), (left, base), (right, base), (right, base - 6.0)], "soft")
    yield words((left + right) / 2.0, base - 10.0, f"{metres:g} m", "soft", "middle", 11.0)
    yield words(right, HEIGHT - 46.0, f"in {flat.scene.fixed[:40]}, grid {step:g} m", "soft", "end", 11.0)


def html_of(value: Any) -> str | None:
    """Return the HTML of a transform, rotation, tree, trajectory or comparison; None if its repr is all there is."""
    if isinstance(value, Frames) and value.frames:
        # a picture of its own, for the style of an SVG element would count in the whole notebook
        svg = b64encode(write_svg(still_picture(FrameScene(value), title=value.name)).encode()).decode()
        return f'<img alt="frames of {escape(value.name)}" src="data:image/svg+xml;base64,{svg}">'
    if hasattr(value, "as_dict"):
        from frametool.view.comparison import write_comparison

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


BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column of a cell


class Canvas:
    """A grid of cells with eight dots and one colour each; a terminal's cell is about twice as high as wide."""

    def __init__(self, lines: int, columns: int) -> None:
        """Create an empty one."""
        self.lines, self.columns = lines, columns
        self.cells: dict[Spot, tuple[int, str]] = {}  # dots and colour

    def mark(self, across: int, down: int, colour: str) -> None:
        """Set a dot by column and row; the last one in a cell gives its colour."""
        if 0 <= across < 2 * self.columns and 0 <= down < 4 * self.lines:
            cell = down // 4, across // 2
            dots, _ = self.cells.get(cell, (0, ""))
            self.cells[cell] = dots | DOTS[down % 4][across % 2], colour

    def runs(self, line: int, over: Mapping[Spot, Run]) -> list[Run]:
        """Return a line as runs of one colour; over: letters that replace cells."""
        drawn = (over.get((line, column)) or self._character((line, column)) for column in range(self.columns))
        return [("".join(map(itemgetter(0), run)), colour) for colour, run in groupby(drawn, key=itemgetter(1))]

    def _character(self, cell: Spot) -> Run:
        dots, colour = self.cells.get(cell, (0, ""))
        return chr(BRAILLE + dots) if dots else " ", colour


COLOURS = ("red", "green", "blue")  # of axes
ARROWS = "→↗↑↖←↙↓↘"
LEAST_LINES, LEAST_COLUMNS = 4, 20
MOST_OUTSIDE = 12  # frames that are pointed to


def terminal_lines(scene: FrameScene, columns: int, lines: int, eye: tuple[float, float] = SLANTED) -> list[list[Run]]:
    """Draw a scene in some columns and lines, each as runs of one style; the last line is the scale."""
    canvas = Canvas(max(lines, LEAST_LINES) - 1, max(columns, LEAST_COLUMNS))
    wide, high = 2.0 * canvas.columns, 4.0 * canvas.lines
    margin = min(14.0, wide / 8.0, high / 8.0)
    size = Size(wide, high, margin, (6.0, 14.0), cell=(2, 4), line=4.0, measure=lambda words: 2.0 * cells(words))
    flat = Projection(scene, size, eye, most=True)
    _draw(canvas, flat)
    labels = Labels(flat)
    outside = [name for name, point in flat.origins.items() if not flat.holds(point)]
    pointed = sum(labels.place(_at_edge(labels, flat, name)) for name in outside[:MOST_OUTSIDE])
    arrows = len(labels.placed)
    labels.place_all()
    letters: dict[Spot, Run] = {}
    for number, label in enumerate(labels.placed):
        row, column = int(label.box[1]) // 4, int(label.box[0]) // 2 + 1
        style = "dim" if number < arrows else "bold"
        letters |= {(row, column + at): (letter, style) for at, letter in enumerate(_letters(label.words))}
    scale = _scale_line(flat, canvas.columns, eye, len(outside) - pointed + labels.hidden)
    return [*(canvas.runs(row, letters) for row in range(canvas.lines)), scale]


def terminal_text(scene: FrameScene, columns: int, lines: int, eye: tuple[float, float] = SLANTED) -> str:
    """Return the picture without colours."""
    drawn = terminal_lines(scene, columns, lines, eye)
    return "".join("".join(text for text, _ in runs).rstrip() + "\n" for runs in drawn)


def print_terminal(scene: FrameScene, eye: tuple[float, float] = SLANTED, color: str = "auto") -> None:
    """Print a picture of the terminal's size, in colour where it has any, or as `color` says: always or never."""
    from shutil import get_terminal_size

    from rich.text import Text

    from frametool.view.progress import coloured_console

    columns, lines = get_terminal_size()
    drawn = terminal_lines(scene, columns, lines - 1, eye)
    coloured_console(color).print(Text("\n").join(Text.assemble(*runs) for runs in drawn))


def _draw(canvas: Canvas, flat: Projection) -> None:
    """Draw the links, the trails and the axes."""
    for parent, name in flat.links:
        _mark_line(canvas, flat, flat.origins[parent], flat.origins[name], "bright_black", 3)
    for stretch in (stretch for stretches in flat.trails.values() for stretch in stretches):
        for begin, end in pairwise(map(flat.at, stretch)):
            _mark_line(canvas, flat, begin, end, "magenta", 2)
    for name in flat.nearest_last():
        for axis, tip in flat.axes(name):
            _mark_line(canvas, flat, flat.origins[name], tip, COLOURS[axis])


def _mark_line(canvas: Canvas, flat: Projection, begin: Flat, end: Flat, colour: str, gap: int = 1) -> None:
    """Set every dot, or every second, third, .. of a line; a line that leaves the picture is cut."""
    if not flat.holds(begin):
        begin, end = end, begin
    if not flat.holds(begin):
        return
    far = max(abs(end.x - begin.x), abs(end.y - begin.y))
    most = 2.0 * flat.size.width + flat.size.height  # the rest is outside
    count = max(1, math.ceil(min(far, most)))
    part = min(1.0, most / max(far, 1.0)) / count
    for number in range(0, count + 1, gap):
        across, down = (a + (b - a) * part * number for a, b in zip(begin[:2], end[:2], strict=True))
        canvas.mark(math.floor(across), math.floor(down), colour)


def _at_edge(labels: Labels, flat: Projection, name: str) -> Iterator[Label]:
    """Yield the places at an edge for a frame beyond it: its name and distance with an arrow, the nearest first."""
    x, y, _ = flat.origins[name]
    half_wide, half_high = flat.size.width / 2.0, flat.size.height / 2.0
    across, down = x - half_wide, y - half_high
    arrow = ARROWS[round(math.atan2(-down, across) / (math.pi / 4.0)) % 8]
    away = math.dist(flat.poses[name][:3], flat.centre)
    said = f"{words_of([name])} {away:.0f} m" if away >= 10.0 else f"{words_of([name])} {away:.2g} m"
    text = f"{said} {arrow}" if across > 0.0 else f"{arrow} {said}"
    part = min(half_wide / max(abs(across), 1e-9), half_high / max(abs(down), 1e-9))
    length = flat.size.measure(text)
    left = half_wide + across * part - (length if across > 0.0 else 0.0)
    left = min(max(left, 0.0), flat.size.width - length)
    middles = (at + 2 for at in range(0, int(flat.size.height), 4))
    for middle in sorted(middles, key=lambda at: abs(at - half_high - down * part)):
        yield from labels.at(text, length, flat.origins[name], left, middle)


def _scale_line(flat: Projection, columns: int, eye: tuple[float, float], hidden: int) -> list[Run]:
    """Return the scale, the direction of view, and the number of names without room."""
    metres, stamp_ns = nice(24.0 / flat.scale), flat.scene.at_ns
    bar = "─" * max(round(metres * flat.scale / 2.0) - 2, 0)
    azimuth, elevation = (round(math.degrees(angle)) + 0 for angle in eye)
    more = f", {hidden} name{'s' * (hidden > 1)} hidden" if hidden else ""
    time = "" if stamp_ns is None else f" at {format_stamp(stamp_ns)[:-6]} s"
    seen = f"in {printable(flat.scene.fixed)[:40]}{time}, from {azimuth}, {elevation} deg{more}"
    text = f"├{bar}┤ {metres:g} m  {seen}  axes "[: columns - 6]
    return [(text, ""), ("x", COLOURS[0]), (" ", ""), ("y", COLOURS[1]), (" ", ""), ("z", COLOURS[2])]


def _letters(text: str) -> Iterator[str]:
    """Yield the content of each cell of a text; a wide letter takes two, the second one empty."""
    for letter in text:
        yield letter
        yield from [""] * (cells(letter) - 1)
