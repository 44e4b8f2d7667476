"""Static pictures for files and notebooks: of frames, and of runs of turtles with charts of distance and commands."""

from __future__ import annotations

import math
from base64 import b64encode
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.sax.saxutils import escape

from frametool.frames.lookups import Frames
from frametool.frames.stamps import BILLION
from frametool.sim.turtle import SIZE as WORLD
from frametool.view.pictures import ChartLine, Picture, box, dot, line, shade_of, stacked, words, write_svg
from frametool.view.scene import SLANTED, FrameScene, Label, Labels, Projection, Size, nice, text_width
from frametool.view.terminal import BACKGROUND, ON_WHITE, colours_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.geometry.types import Rigid
    from frametool.sim.scene import Scene
    from frametool.sim.simulate import SimulationStep
    from frametool.sim.turtle import Pen, TurtleState
    from frametool.view.pictures import Point, SvgElement

PIECES, LAST_SHADE = 24, 0.85  # of a trail, from dark when it begins to a green that white paper still shows
WIDTH, HEIGHT = 1000.0, 700.0
SIZE = Size(WIDTH, HEIGHT, margin=70.0, axes=(14.0, 46.0), cell=(4, 4), line=16.0, measure=text_width)
CORNER = 46.0  # pixels from the corner to the little axes


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
    yield from (line([(x, y), tip[:2]], "xyz"[axis], 2.0, title=name) for axis, tip in flat.axes(name))
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
    for axis, tip in zip("xyz", flat.tips(pose), strict=True):
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
        yield line([(x, y), (x + 28.0 * dx, y + 28.0 * dy)], "xyz"[axis], 2.0)
        yield words(x + 38.0 * dx, y + 38.0 * dy, "xyz"[axis], "xyz"[axis], "middle", weight="bold")


def _scale(flat: Projection, step: float) -> Iterator[SvgElement]:
    """Draw the scale bar, and name the fixed frame."""
    metres = nice(110.0 / flat.scale)
    left, right, base = WIDTH - 20.0 - metres * flat.scale, WIDTH - 20.0, HEIGHT - 20.0
    yield line([(left, base - 6.0), (left, base), (right, base), (right, base - 6.0)], "soft")
    yield words((left + right) / 2.0, base - 10.0, f"{metres:g} m", "soft", "middle", 11.0)
    yield words(right, HEIGHT - 46.0, f"in {flat.scene.fixed[:40]}, grid {step:g} m", "soft", "end", 11.0)


SHORT = 0.05  # metres: two pixels


class Stroke(NamedTuple):
    """A line drawn with one pen; points in metres, y up."""

    turtle: str
    pen: Pen
    points: list[Point]


class Drawing:
    """Collect what a plot shows of a run; turtles that do not move take no memory."""

    def __init__(self, scene: Scene) -> None:
        """Create an empty drawing."""
        self.strokes: list[Stroke] = []
        self.turtles: dict[str, TurtleState] = {}
        # of each follower, for each control step: seconds, metres, m/s, rad/s
        self.curves: dict[str, list[tuple[float, ...]]] = {name: [] for name in scene.followers}
        self._current: dict[str, Stroke] = {}
        self._clears = 0

    def watch(self, step: SimulationStep) -> None:
        """Add a step to the drawing."""
        if step.is_tick:
            if step.clears != self._clears:
                self._clears = step.clears
                self.strokes.clear()
                self._current.clear()
            self.turtles = step.states
            for name in step.states:
                self._draw(name, step)
        for command in step.commands:
            ahead, turning, _ = command.twist
            self.curves[command.turtle].append((step.t_ns / BILLION, command.distance or 0.0, ahead, turning))

    def _draw(self, name: str, step: SimulationStep) -> None:
        """Extend a turtle's stroke, or begin one with a new pen."""
        x, y, _ = step.states[name]
        pen = step.pens[name]
        stroke = self._current.get(name)
        if stroke is None or stroke.pen != pen:
            begin = [stroke.points[-1]] if stroke is not None else []
            stroke = self._current[name] = Stroke(name, pen, begin)
            if not pen.off:
                self.strokes.append(stroke)
        if not stroke.points or math.dist(stroke.points[-1], (x, y)) > SHORT:
            stroke.points.append((x, y))


WINDOW, METRE = 500.0, 45.0  # pixels, as turtlesim's
MARGIN = 30.0
LEFT = WINDOW + 110.0  # where the curves begin
PANEL_WIDTH, PANEL_GAP = 420.0, 50.0
SIDE = WINDOW + 2.0 * MARGIN
PANELS = ("distance (m)", "linear.x (m/s)", "angular.z (rad/s)")  # as the numbers of curves after the times
# circles of a turtle: pixels ahead and to the left, radius: feet, head, shell
BODY = (*((x, y, 4.0) for x in (-9.0, 9.0) for y in (-11.0, 11.0)), (17.0, 0.0, 5.0), (0.0, 0.0, 13.0))


def run_picture(drawing: Drawing) -> Picture:
    """Draw the run; without followers there are no charts."""
    colours = colours_of({*drawing.turtles, *drawing.curves})
    shapes = [*_window(drawing, colours)]
    followed = {name: rows for name, rows in drawing.curves.items() if rows}
    panels = {
        title: [ChartLine(name, ON_WHITE[colours[name]], [(row[0], row[at]) for row in rows])
                for name, rows in followed.items()]
        for at, title in enumerate(PANELS if followed else (), 1)
    }  # fmt: skip
    area = LEFT, MARGIN, PANEL_WIDTH, (WINDOW - 2.0 * PANEL_GAP) / len(PANELS)
    shapes += (shape for chart in stacked(area, PANEL_GAP, "time (s)", panels) for shape in chart.drawn())
    return Picture(LEFT + PANEL_WIDTH + MARGIN if followed else SIDE, SIDE, shapes, "turtles")


def _window(drawing: Drawing, colours: dict[str, str]) -> Iterator[SvgElement]:
    """Draw the world: background, trails, and the turtles at the end from above."""

    def place(x: float, y: float) -> Point:
        return MARGIN + x * METRE, MARGIN + (WORLD - y) * METRE

    yield box(MARGIN, MARGIN, WINDOW, WINDOW, f"#{bytes(BACKGROUND).hex()}")
    for stroke in drawing.strokes:
        *colour, width, _ = stroke.pen
        yield line([place(*point) for point in stroke.points], f"#{bytes(colour).hex()}", width, title=stroke.turtle)
    for name, (*position, theta) in drawing.turtles.items():
        x, y = place(*position)
        cosine, sine = math.cos(theta), math.sin(theta)
        for ahead, left, radius in BODY:
            across, down = x + cosine * ahead - sine * left, y - sine * ahead - cosine * left
            yield dot(across, down, radius + 1.0, "#333333")
            yield dot(across, down, radius, colours[name])
        yield words(x, y - 24.0, name, "#ffffff", "middle")


def html_of(value: Any) -> str | None:
    """Return the HTML of a transform, rotation, tree, trajectory or comparison; None if its repr is all there is."""
    if isinstance(value, Frames) and value.frames:
        # a picture of its own, for the style of an SVG element would count in the whole notebook
        svg = b64encode(write_svg(still_picture(FrameScene(value), title=value.name)).encode()).decode()
        return f'<img alt="frames of {escape(value.name)}" src="data:image/svg+xml;base64,{svg}">'
    if hasattr(value, "as_dict"):
        from frametool.view.comparison_report import write_comparison

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
