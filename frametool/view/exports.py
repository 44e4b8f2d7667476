"""Draw frames and runs of turtles for files and notebooks: still pictures, an interactive HTML page, glTF 2.0 (.glb).

The page is self-contained and makes no network requests.  Its script and style are the files in the folder `page`,
joined in the order of SCRIPTS and EXTRAS; its content security policy allows nothing else.  Poses are stored as
doubles, stamps as 64-bit integers of nanoseconds.  A run of turtles is shown by the transforms it broadcasts.

A .glb has one node per frame, with its name, its parent and coloured axes; moving frames are animated, in seconds
after their first stamp.  glTF has y up, so the root node rotates z up.
Source: Khronos glTF 2.0, sections 3.6 (buffers), 3.11 (animation), 4.4 (binary).
"""

from __future__ import annotations

import math
import struct
from base64 import b64encode
from itertools import chain, product
from json import dumps
from operator import mul
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape
from zlib import compress

from frametool import __version__
from frametool.formats.robots.model import JointValue, Solid
from frametool.frames.buffer import TransformBuffer
from frametool.frames.lookups import Frames
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry.rigid import IDENTITY
from frametool.sim.turtle import SIZE as WORLD
from frametool.sim.turtle import single
from frametool.view import pictures
from frametool.view.frame_scene import (
    EYES,
    FrameScene,
    Projection,
    Size,
    can_be_drawn,
    placed_names,
    rounded,
    text_width,
)
from frametool.view.pictures import PALETTE, ChartLine, Picture, box, dot, line, shade_of, stacked, svg_text
from frametool.view.terminal import BACKGROUND, ON_WHITE, colours_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.geometry import Rigid
    from frametool.sim.scene import Scene
    from frametool.sim.simulate import SimulationStep
    from frametool.sim.turtle import Pen, TurtleState
    from frametool.view.frame_scene import Eye
    from frametool.view.pictures import Point, SvgElement

    Stroke = tuple[str, Pen, list[Point]]  # turtle, pen, and a line drawn with it; metres, y up

PIECES, LAST_SHADE = 24, 0.85  # colours along a trail: from dark at its beginning to a green that is visible on white
WIDTH, HEIGHT = 1000.0, 700.0
SIZE = Size(WIDTH, HEIGHT, margin=70.0, axes=(14.0, 46.0), cell=(4, 4), line=16.0, measure=text_width)
CORNER = 46.0  # pixels from the corner to the origin of the legend's axes


def still_picture(
    scene: FrameScene, eye: Eye = EYES["slanted"], title: str = "", other: FrameScene | None = None,
) -> Picture:  # fmt: skip
    """Draw a scene from a direction, azimuth and elevation in radians; notes list what the picture does not show.

    other: another tree in the same frame; its frames with the same names are drawn faintly, with a line to them.
    """
    flat = Projection(scene, SIZE, eye)
    blocked = [(0.0, HEIGHT - 92.0, 100.0, HEIGHT), (WIDTH - 330.0, HEIGHT - 58.0, WIDTH, HEIGHT)]
    labels, hidden = placed_names(flat, blocked)
    step, ground = flat.ground()
    shapes = [line([flat.at(a)[:2], flat.at(b)[:2]], "zero" if zero else "faint") for a, b, zero in ground]
    for link in flat.links:
        points = [flat.origins[name][:2] for name in link]
        shapes.append(line(points, "soft", alpha=0.7, dashes=(4.0, 3.0)))
    for frame, stretches in flat.trails.items():  # in pieces coloured by time
        trail = [[flat.at(point)[:2] for point in stretch] for stretch in stretches]
        size = -(-sum(map(len, trail)) // PIECES)
        pieces = [each[at : at + size + 1] for each in trail for at in range(0, max(len(each) - 1, 1), size)]
        for number, piece in enumerate(pieces):
            shapes.append(line(piece, shade_of(LAST_SHADE * number / len(pieces)), 1.5, 0.8, title=frame))
    for name, pose in other.poses().items() if other else ():
        if name in flat.poses:
            there = flat.at(pose[:3])[:2]
            tips = zip("xyz", flat.tips(pose), strict=True)
            shapes += (line([there, tip[:2]], axis, 2.0, 0.4, title=name) for axis, tip in tips)
            shapes.append(line([flat.origins[name][:2], there], "trail", 1.5))
    for name in flat.nearest_last:
        x, y, _ = flat.origins[name]
        shapes += (line([(x, y), tip[:2]], "xyz"[axis], 2.0, title=name) for axis, tip in flat.axes(name))
        shapes.append(dot(x, y, 2.2, "ink", name))
    for text, point, (left, top, right, bottom), away in labels:
        if away > 1.1:  # with a leader line
            end = min(max(point.x, left), right), top if top > point.y else bottom
            shapes.append(line([point[:2], end], "soft", 0.7))
        shapes.append(svg_text(left + 2.0, (top + bottom) / 2.0, text))
    shapes += _legend(flat, step)
    near = len(flat.cluster())
    crowded = f"{near} of {len(scene.names)} frames lie in a small spot; --below FRAME shows a part"
    notes = [crowded] * (near < len(flat.poses)) + [f"{hidden} names found no place"] * bool(hidden)
    return Picture(WIDTH, HEIGHT, shapes, title, notes=notes)


def _legend(flat: Projection, step: float) -> Iterator[SvgElement]:
    """Draw the directions of the axes of the fixed frame, the scale bar, and the frame's name."""
    x, y = CORNER, HEIGHT - CORNER
    right, up, toward = flat.view
    for axis in sorted(range(3), key=lambda axis: toward[axis]):
        dx, dy = right[axis], -up[axis]
        yield line([(x, y), (x + 28.0 * dx, y + 28.0 * dy)], "xyz"[axis], 2.0)
        yield svg_text(x + 38.0 * dx, y + 38.0 * dy, "xyz"[axis], "xyz"[axis], "middle", weight="bold")
    metres = rounded(110.0 / flat.scale)
    begin, end, base = WIDTH - 20.0 - metres * flat.scale, WIDTH - 20.0, HEIGHT - 20.0
    yield line([(begin, base - 6.0), (begin, base), (end, base), (end, base - 6.0)], "soft")
    yield svg_text((begin + end) / 2.0, base - 10.0, f"{metres:g} m", "soft", "middle", 11.0)
    yield svg_text(end, HEIGHT - 46.0, f"in {flat.scene.fixed[:40]}, grid {step:g} m", "soft", "end", 11.0)


WINDOW, METRE = 500.0, 45.0  # pixels, as turtlesim's
MARGIN = 30.0
LEFT = WINDOW + 110.0  # left edge of the charts
PANEL_WIDTH, PANEL_GAP = 420.0, 50.0
SIDE = WINDOW + 2.0 * MARGIN
PANELS = ("distance (m)", "linear.x (m/s)", "angular.z (rad/s)")  # in the order of the numbers in `curves`
# circles of a turtle: pixels ahead and to the left, radius: feet, head, shell
BODY = (*((x, y, 4.0) for x in (-9.0, 9.0) for y in (-11.0, 11.0)), (17.0, 0.0, 5.0), (0.0, 0.0, 13.0))


def run_picture(scene: Scene) -> tuple[Callable[[SimulationStep], None], Callable[[], Picture]]:
    """Return a function that collects the steps of a run, and one that then draws them; turtles at rest use no memory.

    The picture shows the world with trails, the turtles at the end, and charts if there are followers.
    """
    strokes: list[Stroke] = []
    current: dict[str, Stroke] = {}  # the last stroke of each turtle
    turtles: dict[str, TurtleState] = {}
    # follower -> for each control step: seconds, metres, m/s, rad/s
    curves: dict[str, list[tuple[float, ...]]] = {name: [] for name in scene.followers}
    clears = 0

    def watch(step: SimulationStep) -> None:
        """Extend the strokes of the turtles; begin a new one if the pen changes."""
        nonlocal clears, turtles
        if step.is_tick:
            if step.clears != clears:
                clears = step.clears
                strokes.clear()
                current.clear()
            turtles = step.states
            for name, (x, y, _) in turtles.items():
                _, pen, points = current.get(name, (name, None, []))
                if pen != step.pens[name]:
                    points = points[-1:]
                    current[name] = name, step.pens[name], points
                    strokes.append(current[name])
                if not points or math.dist(points[-1], (x, y)) > 0.05:  # metres: two pixels
                    points.append((x, y))
        for command in step.commands:
            ahead, turning, _ = command.twist
            curves[command.turtle].append((step.t_ns / BILLION, command.distance or 0.0, ahead, turning))

    def place(x: float, y: float) -> Point:
        return MARGIN + x * METRE, MARGIN + (WORLD - y) * METRE

    def picture() -> Picture:
        colours = colours_of({*turtles, *curves})
        shapes = [box(MARGIN, MARGIN, WINDOW, WINDOW, f"#{bytes(BACKGROUND).hex()}")]
        for turtle, (*colour, width, _), way in (each for each in strokes if not each[1].off):
            shapes.append(line([place(*point) for point in way], f"#{bytes(colour).hex()}", width, title=turtle))
        for name, (*position, theta) in turtles.items():
            x, y = place(*position)
            cosine, sine = math.cos(theta), math.sin(theta)
            for ahead, left, radius in BODY:
                across, down = x + cosine * ahead - sine * left, y - sine * ahead - cosine * left
                shapes += dot(across, down, radius + 1.0, "#333333"), dot(across, down, radius, colours[name])
            shapes.append(svg_text(x, y - 24.0, name, "#ffffff", "middle"))
        followed = {name: rows for name, rows in curves.items() if rows}
        panels = {
            title: [ChartLine(name, ON_WHITE[colours[name]], [(row[0], row[at]) for row in rows])
                    for name, rows in followed.items()]
            for at, title in enumerate(PANELS, 1)
        }  # fmt: skip
        area = LEFT, MARGIN, PANEL_WIDTH, (WINDOW - 2.0 * PANEL_GAP) / len(PANELS)
        shapes += stacked(area, PANEL_GAP, "time (s)", panels)[0] if followed else ()
        return Picture(LEFT + PANEL_WIDTH + MARGIN if followed else SIDE, SIDE, shapes, "turtles")

    return watch, picture


def html_of(value: Any) -> str | None:
    """Return the HTML of a transform, rotation, tree, trajectory or comparison; None for arrays and empty trees."""
    if isinstance(value, Frames) and value.frames:
        # as an image, because the style of an SVG element would apply to the whole notebook
        svg = b64encode(pictures.write_svg(still_picture(FrameScene(value), title=value.name)).encode()).decode()
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
    from frametool.view.text import write_poses

    parts = value.components
    pose = Pose.of(parts) if len(parts) > len("xyzw") else Pose(rotation=parts)
    return f"<pre>{escape(write_poses([Result(pose)], Style('text')))}</pre>"


THICK = 0.02  # half the width of a bar of length 1
COLOURS = [(*bytes.fromhex(PALETTE[axis][0][1:]), 255) for axis in "xyz"]
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))  # facing outwards
Z_UP = (-0.7071067811865476, 0.0, 0.0, 0.7071067811865476)
COMPONENTS = {"f": 5126, "H": 5123, "B": 5121}
VERTICES, INDICES = 34962, 34963
MESH = {"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}]}
MATERIAL = {"extensions": {"KHR_materials_unlit": {}}, "pbrMetallicRoughness": {"metallicFactor": 0}}


def write_glb(scene: FrameScene) -> bytes:
    """Return the scene as the bytes of a .glb."""
    data, views, accessors = bytearray(), list[dict[str, int]](), list[dict[str, Any]]()  # the binary part

    def add(letter: str, rows: Sequence[Sequence[float]], *, target: int | None = None, **more: Any) -> int:
        """Append rows of numbers of a type of the module struct; return the index of their accessor."""
        packed = _packed(letter, chain.from_iterable(rows))
        view = {"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)}
        views.append(view if target is None else view | {"target": target})
        kind = {"count": len(rows), "type": ("SCALAR", "", "VEC3", "VEC4")[len(rows[0]) - 1]}
        accessors.append({"bufferView": len(views) - 1, "componentType": COMPONENTS[letter], **kind, **more})
        data.extend(packed + bytes(-len(packed) % 4))
        return len(accessors) - 1

    # three bars of length 1 along x, y, z: positions, colours, triangles
    bars = [[(-THICK, 1.0 if side == axis else THICK) for side in range(3)] for axis in range(3)]
    corners = [(8 * bar + corner,) for bar in range(3) for a, b, c, d in SIDES for corner in (a, b, c, a, c, d)]
    places = [place for bar in bars for place in product(*bar)]
    add("f", places, target=VERTICES, min=[single(-THICK)] * 3, max=[1.0] * 3)
    add("B", [colour for colour in COLOURS for _ in range(8)], target=VERTICES, normalized=True)
    add("H", corners, target=INDICES)
    flat = Projection(scene, SIZE)
    # a node for each frame and one for its axes; a frame whose parent is not drawn is a child of the root
    index = {name: 1 + 2 * number for number, name in enumerate(flat.poses)}
    nodes: list[dict[str, Any]] = [{"name": "z up", "rotation": Z_UP, "children": []}]
    for name, node in index.items():
        nodes.append({"name": name, "children": [node + 1]})
        nodes.append({"name": f"{name} axes", "mesh": 0, "scale": [flat.axis] * 3})
    for name, pose in flat.poses.items():
        parent, track = scene.tree.parent(name, scene.at_ns), scene.tree.track(name)
        edge = None if track is None else track.at(scene.at_ns or 0)
        holder, place = (index[parent], edge) if parent in index and edge is not None else (0, pose)
        nodes[holder]["children"].append(index[name])
        nodes[index[name]] |= {"translation": place[:3], "rotation": place[3:]}
    animation = _animation(scene, index, add)
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"frametool {__version__}"}, "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "meshes": [MESH], "materials": [MATERIAL],
        **({"animations": [animation]} if animation else {}), "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(data), len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(data), b"BIN\0") + data


def _animation(scene: FrameScene, index: dict[str, int], add: Callable[..., int]) -> dict[str, Any] | None:
    """Return the animation of the moving frames with a single parent that is drawn; `add` appends numbers."""
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    for name, track in scene.tracks.items():
        drawn = name in index and track.parent in index and not track.varies
        if not drawn or not all(can_be_drawn(sample[:3]) for _, _, sample in track.walk()):
            continue
        keys: dict[float, Rigid] = {}  # float32 seconds -> pose; glTF needs increasing times
        for stamp_ns, _, sample in track.walk():
            keys.setdefault(single((stamp_ns - scene.span_ns[0]) / BILLION), sample)
        rotations: list[Sequence[float]] = []  # with continuous signs
        for *_, x, y, z, w in keys.values():
            sign = -1.0 if rotations and sum(map(mul, (x, y, z, w), rotations[-1])) < 0.0 else 1.0
            rotations.append((sign * x, sign * y, sign * z, sign * w))
        times = add("f", [(second,) for second in keys], min=[min(keys)], max=[max(keys)])
        for path, rows in (("translation", [sample[:3] for sample in keys.values()]), ("rotation", rotations)):
            channels.append({"sampler": len(samplers), "target": {"node": index[name], "path": path}})
            samplers.append({"input": times, "output": add("f", rows), "interpolation": "LINEAR"})
    return {"name": "samples", "channels": channels, "samplers": samplers} if channels else None


SCRIPTS = ("begin", "kernels", "frames", "state", "camera", "picture", "labels", "panel", "hands")
EXTRAS = ("joints", "solids")  # only in pages that have these
PACKED = 48_000  # bytes; larger arrays of numbers are compressed


def write_page(
    scene: FrameScene, *, title: str, file: str = "", eye: Eye | None = None,
    other: FrameScene | None = None, other_title: str = "", sliders: bool = False, solids: Sequence[Solid] = (),
) -> str:  # fmt: skip
    """Return the page.

    title: its heading.  file: the name of the tree in the command that the page copies.
    eye: azimuth and elevation of the first view, radians.
    other, other_title: another tree in the same frame, drawn over this one, and its name.
    sliders: add one for each joint of a robot.  solids: of robots; a mesh is drawn as a box.
    """
    # as bytes: the static poses, then the stamps and poses of each track
    index = scene.index
    tracks: list[dict[str, Any]] = []
    static = [None if name in scene.tracks else scene.tree.track(name) for name in scene.names]
    blob = bytearray(_packed("d", chain.from_iterable(track.components if track else IDENTITY for track in static)))
    for name, moving in scene.tracks.items():
        stamps, above, poses = zip(*moving.walk(), strict=True)
        parents = [index[parent] for parent in above] if moving.varies else index[moving.parent]
        tracks.append({"frame": index[name], "count": len(stamps), "at": len(blob), "parents": parents})
        blob += _packed("q", stamps) + _packed("d", chain.from_iterable(poses))
    is_part = not scene.path_only and len(scene.chosen) < len(scene.names)
    head: dict[str, Any] = {
        "names": scene.names, "parents": [-1 if track is None else index[track.parent] for track in static],
        "tracks": tracks, "first": str(scene.span_ns[0]), "last": str(scene.span_ns[1]),
        "title": title, "file": file or title, "made": f"frametool {__version__}",
        "show": {
            "fixed": scene.fixed, "path": scene.path_only, "target": scene.target, "source": scene.source,
            "t": None if scene.at_ns is None else format_stamp(scene.at_ns),
            "only": [name for name in scene.names if name in scene.chosen] if is_part else None, "view": eye,
        },
    }  # fmt: skip
    if sliders and (joints := joint_sliders(scene))["joints"]:
        head |= joints
    if solids:
        head |= _drawn_solids(scene, solids)
    if other is not None:
        there = {index[name]: pose for name, pose in other.poses().items() if name in index}
        head["overlay"] = {"title": other_title, "poses": there}
    if len(blob) > PACKED:
        blob[:], head["packed"] = compress(blob), True
    scripts = " ".join(f"{name}.js" for name in (*SCRIPTS, *(each for each in EXTRAS if each in head), "main"))
    held = {"head-data": dumps(head, separators=(",", ":")), "blob": dumps(b64encode(blob).decode())}
    return pictures.write_html(title, pictures.page_file("page.html"), style="page.css", script=scripts, data=held)


def _packed(letter: str, numbers: Iterable[float]) -> bytes:
    """Return numbers as little-endian bytes; letter: their type in the module struct."""
    found = [*numbers]
    return struct.pack(f"<{len(found)}{letter}", *found)


def run_page() -> tuple[Callable[[SimulationStep], None], Callable[[], str]]:
    """Return a function that collects the transforms of a run, and one that then returns a page of them."""
    buffer = TransformBuffer(name="run")

    def watch(step: SimulationStep) -> None:
        for stamp_ns, parent, child, transform in step.broadcasts:
            buffer.insert(parent, child, transform, stamp_ns)

    return watch, lambda: write_page(FrameScene(buffer), title="turtles", file="tf.yaml", eye=EYES["top"])


SLIDER_KEYS = ("name", "kind", "axis", "anchor", "rest", "lower", "upper")


def joint_sliders(scene: FrameScene) -> dict[str, list[dict[str, Any]]]:
    """Return, for the page, the revolute and prismatic joints with a constant value, and the links that they move."""
    driven: list[tuple[Any, Any]] = []  # joints and their values
    moved: list[dict[str, Any]] = []
    for values, links, _ in scene.tree.robots:
        for link in links:
            known = [values.get(joint.name) for joint in link.joints]
            if {*map(type, known)} == {JointValue} and link.child in scene.index:
                numbers = [*range(len(driven), len(driven) + len(known))]
                own = {key: getattr(link, key) for key in ("origin", "after", "inverted")}
                moved.append({"frame": scene.index[link.child], "joints": numbers} | own)
                driven += zip(link.joints, known, strict=True)
    places = {joint.name: number for number, (joint, _) in enumerate(driven)}
    sliders: list[dict[str, Any]] = []
    for joint, value in driven:
        sliders.append({"value": float(value.plain)} | {key: getattr(joint, key) for key in SLIDER_KEYS})
        if (mimic := joint.mimic) is not None and mimic.joint in places:
            sliders[-1]["mimic"] = [places[mimic.joint], mimic.multiplier, mimic.offset]
    return {"joints": sliders, "links": moved}


MESH_PART = 0.35  # smallest edge of a mesh's box, in median distances between frames


def _drawn_solids(scene: FrameScene, solids: Sequence[Solid]) -> dict[str, Any]:
    """Return the solids of the drawn frames; a mesh becomes a box around the origins of its frame and its children."""
    ends = {name: [IDENTITY[:3]] for name in scene.names}  # frame -> its origin and those of its children in it
    for track in scene.tree.tracks():
        ends[track.parent].append(track.components[:3])
    lengths = sorted(filter(None, (math.hypot(*end) for held in ends.values() for end in held)))
    least = MESH_PART * (lengths[len(lengths) // 2] if lengths else 1.0)
    found = [each._asdict() | {"frame": scene.index[each.frame]} for each in solids if each.frame in ends]
    for each in found:
        if each["kind"] == "mesh":
            extents = [(min(column), max(column)) for column in zip(*ends[scene.names[each["frame"]]], strict=True)]
            centre = [(low + high) / 2.0 for low, high in extents]
            size = [max(high - low, least) for low, high in extents]
            each |= {"kind": "box", "size": size, "pose": [*centre, *IDENTITY[3:]]}
    return {"solids": found, "meshes": sum(each.kind == "mesh" for each in solids)}
