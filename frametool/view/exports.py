"""Frames as files for other programs: an interactive HTML page, and binary glTF 2.0 (.glb).

The page is self-contained and makes no network requests.  Its script and style are the files in the folder `page`,
joined in the order of SCRIPTS and EXTRAS; its policy lets nothing else run.  Poses are stored as doubles, stamps as
64-bit integers of nanoseconds.  A run of turtles is shown as its followers saw it in tf.

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
from zlib import compress

from frametool import __version__
from frametool.formats.robots.model import JointValue, Solid
from frametool.frames.buffer import TransformBuffer
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry.rigid import IDENTITY
from frametool.sim.turtle import single
from frametool.view.pictures import PALETTE, page_file, write_html
from frametool.view.scene import EYES, FrameScene, Projection, can_be_drawn
from frametool.view.stills import SIZE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.frames.track import MovingTrack
    from frametool.geometry.types import Rigid
    from frametool.sim.simulate import SimulationStep


THICK = 0.02  # half the width of a bar, where its length is 1
COLOURS = [(*bytes.fromhex(PALETTE[axis][0][1:]), 255) for axis in "xyz"]
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))  # of a box, outwards
Z_UP = (-0.7071067811865476, 0.0, 0.0, 0.7071067811865476)
COMPONENTS = {"f": 5126, "H": 5123, "B": 5121}
VERTICES, INDICES = 34962, 34963
MESH = {"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}]}
MATERIAL = {"extensions": {"KHR_materials_unlit": {}}, "pbrMetallicRoughness": {"metallicFactor": 0}}


class BinaryPart:
    """The binary part of a .glb: one buffer, its views and accessors."""

    def __init__(self) -> None:
        """Create an empty one."""
        self.data = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, letter: str, rows: Sequence[Sequence[float]], *, target: int | None = None, **more: Any) -> int:
        """Append rows of numbers, each of a type of the module struct; return the index of their accessor."""
        data = _packed(letter, chain.from_iterable(rows))
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append(view if target is None else view | {"target": target})
        kind = {"count": len(rows), "type": ("SCALAR", "", "VEC3", "VEC4")[len(rows[0]) - 1]}
        self.accessors.append({"bufferView": len(self.views) - 1, "componentType": COMPONENTS[letter], **kind, **more})
        self.data += data + bytes(-len(data) % 4)
        return len(self.accessors) - 1


def write_glb(scene: FrameScene) -> bytes:
    """Return the scene as the bytes of a .glb."""
    flat, part = Projection(scene, SIZE), BinaryPart()
    index = {name: 1 + 2 * number for number, name in enumerate(flat.poses)}
    _add_axes(part)
    animation = _animation(scene, index, part)
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"frametool {__version__}"}, "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": _nodes(scene, flat, index), "meshes": [MESH],
        "materials": [MATERIAL], **({"animations": [animation]} if animation else {}), "accessors": part.accessors,
        "bufferViews": part.views, "buffers": [{"byteLength": len(part.data)}],
    }  # fmt: skip
    text = dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(part.data), len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(part.data), b"BIN\0") + part.data


def _add_axes(part: BinaryPart) -> None:
    """Add three bars of length 1 along x, y, z: positions, colours, triangles."""
    bars = [[(-THICK, 1.0 if side == axis else THICK) for side in range(3)] for axis in range(3)]
    corners = [(8 * bar + corner,) for bar in range(3) for a, b, c, d in SIDES for corner in (a, b, c, a, c, d)]
    places = [place for bar in bars for place in product(*bar)]
    part.add("f", places, target=VERTICES, min=[single(-THICK)] * 3, max=[1.0] * 3)
    part.add("B", [colour for colour in COLOURS for _ in range(8)], target=VERTICES, normalized=True)
    part.add("H", corners, target=INDICES)


def _nodes(scene: FrameScene, flat: Projection, index: dict[str, int]) -> list[dict[str, Any]]:
    """Return the nodes: of each frame and its axes; a frame without a drawn parent is placed in `fixed`."""
    nodes: list[dict[str, Any]] = [{"name": "z up", "rotation": Z_UP, "children": []}]
    for name, node in index.items():
        nodes.append({"name": name, "children": [node + 1]})
        nodes.append({"name": f"{name} axes", "mesh": 0, "scale": [flat.axis] * 3})
    for name, pose in flat.poses.items():
        parent, track = scene.tree.parent(name, scene.at_ns), scene.tree.track(name)
        edge = None if track is None else track.at(scene.at_ns or 0)
        above, place = (index[parent], edge) if parent in index and edge is not None else (0, pose)
        nodes[above]["children"].append(index[name])
        nodes[index[name]] |= {"translation": place[:3], "rotation": place[3:]}
    return nodes


def _animation(scene: FrameScene, index: dict[str, int], part: BinaryPart) -> dict[str, Any] | None:
    """Return the animation of the frames that move below one drawn parent."""
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    first_ns, _ = scene.span_ns
    for name, track in scene.tracks.items():
        drawn = name in index and track.parent in index and not track.varies
        if not drawn or not all(can_be_drawn(sample[:3]) for _, _, sample in track.walk()):
            continue
        seconds, places, rotations = _keys(track, first_ns)
        times = part.add("f", [*zip(seconds, strict=True)], min=[seconds[0]], max=[seconds[-1]])
        for path, rows in (("translation", places), ("rotation", rotations)):
            channels.append({"sampler": len(samplers), "target": {"node": index[name], "path": path}})
            samplers.append({"input": times, "output": part.add("f", rows), "interpolation": "LINEAR"})
    return {"name": "samples", "channels": channels, "samplers": samplers} if channels else None


def _keys(track: MovingTrack, first_ns: int) -> tuple[list[float], list[Sequence[float]], list[Sequence[float]]]:
    """Return increasing float32 seconds, positions, and quaternions with continuous signs."""
    keys: dict[float, Rigid] = {}
    for stamp_ns, _, sample in track.walk():
        keys.setdefault(single((stamp_ns - first_ns) / BILLION), sample)
    rotations: list[Sequence[float]] = []
    for *_, x, y, z, w in keys.values():
        sign = -1.0 if rotations and sum(map(mul, (x, y, z, w), rotations[-1])) < 0.0 else 1.0
        rotations.append((sign * x, sign * y, sign * z, sign * w))
    return [*keys], [sample[:3] for sample in keys.values()], rotations


SCRIPTS = ("begin", "kernels", "frames", "state", "camera", "picture", "labels", "panel", "hands")
EXTRAS = ("joints", "solids")  # where the page has some
PACKED = 48_000  # bytes of numbers, from where on they are compressed


def write_page(
    scene: FrameScene, *, title: str, file: str = "", eye: tuple[float, float] | None = None,
    other: FrameScene | None = None, other_title: str = "", sliders: bool = False, solids: Sequence[Solid] = (),
) -> str:  # fmt: skip
    """Return the page.

    title: its heading.  file: the name of the tree in the command that the page copies.
    eye: azimuth and elevation of the first view, radians.
    other, other_title: another tree in the same frame, drawn over this one, and its name.
    sliders: add one for each joint of a robot.  solids: of robots; a mesh is drawn as a box.
    """
    head, blob = _data(scene)
    head |= {"title": title, "file": file or title, "made": f"frametool {__version__}"}
    head["show"] = _shown(scene, eye)
    if sliders and (joints := joint_sliders(scene))["joints"]:
        head |= joints
    if solids:
        head |= _drawn_solids(scene, solids)
    if other is not None:
        poses = {scene.index[name]: pose for name, pose in other.poses().items() if name in scene.index}
        head["overlay"] = {"title": other_title, "poses": poses}
    if len(blob) > PACKED:
        blob, head["packed"] = compress(blob), True
    scripts = " ".join(f"{name}.js" for name in (*SCRIPTS, *(each for each in EXTRAS if each in head), "main"))
    held = {"head-data": dumps(head, separators=(",", ":")), "blob": dumps(b64encode(blob).decode())}
    return write_html(title, page_file("page.html"), style="page.css", script=scripts, data=held)


def _shown(scene: FrameScene, eye: tuple[float, float] | None) -> dict[str, Any]:
    """Return the initial view of the page."""
    is_part = not scene.path_only and len(scene.chosen) < len(scene.names)
    only = [name for name in scene.names if name in scene.chosen] if is_part else None
    time = None if scene.at_ns is None else format_stamp(scene.at_ns)
    shown = {"fixed": scene.fixed, "path": scene.path_only, "target": scene.target, "source": scene.source}
    return shown | {"t": time, "only": only, "view": eye}


def _data(scene: FrameScene) -> tuple[dict[str, Any], bytes]:
    """Return names and parents, and the static poses, followed by the stamps and poses of each track, as bytes."""
    index = scene.index
    static = [None if name in scene.tracks else scene.tree.track(name) for name in scene.names]
    blob = bytearray(_packed("d", chain.from_iterable(track.components if track else IDENTITY for track in static)))
    tracks: list[dict[str, Any]] = []
    for name, track in scene.tracks.items():
        stamps, above, poses = zip(*track.walk(), strict=True)
        parents = [index[parent] for parent in above] if track.varies else index[track.parent]
        tracks.append({"frame": index[name], "count": len(stamps), "at": len(blob), "parents": parents})
        blob += _packed("q", stamps) + _packed("d", chain.from_iterable(poses))
    first, last = map(str, scene.span_ns)
    parents_of = [-1 if track is None else index[track.parent] for track in static]
    return {"names": scene.names, "parents": parents_of, "tracks": tracks, "first": first, "last": last}, bytes(blob)


def _packed(letter: str, numbers: Iterable[float]) -> bytes:
    """Return numbers of a type of the module struct as bytes, little-endian."""
    found = [*numbers]
    return struct.pack(f"<{len(found)}{letter}", *found)


def run_page() -> tuple[Callable[[SimulationStep], None], Callable[[], str]]:
    """Return what collects the transforms of a run by steps, and what then makes a page of them, seen from above."""
    buffer = TransformBuffer(name="run")

    def watch(step: SimulationStep) -> None:
        for stamp_ns, parent, child, transform in step.broadcasts:
            buffer.insert(parent, child, transform, stamp_ns)

    return watch, lambda: write_page(FrameScene(buffer), title="turtles", file="tf.yaml", eye=EYES["top"])


SLIDER_KEYS = ("name", "kind", "axis", "anchor", "rest", "lower", "upper", "mimic")
LINK_KEYS = ("origin", "after", "inverted")


def joint_sliders(scene: FrameScene) -> dict[str, list[dict[str, Any]]]:
    """Return the revolute and prismatic joints with a constant value, and the links that they move, for the page."""
    sliders: list[dict[str, Any]] = []
    moved: list[dict[str, Any]] = []
    places: dict[str, int] = {}
    for values, links, _ in scene.tree.robots:
        for link in links:
            known: list[Any] = [values.get(joint.name) for joint in link.joints]
            if {*map(type, known)} != {JointValue} or link.child not in scene.index:
                continue
            numbers = [*range(len(sliders), len(sliders) + len(known))]
            moved.append({"frame": scene.index[link.child], "joints": numbers} | _picked(link, LINK_KEYS))
            places |= {joint.name: number for joint, number in zip(link.joints, numbers, strict=True)}
            sliders += ({"value": float(value.plain)} | _picked(joint, SLIDER_KEYS)
                        for joint, value in zip(link.joints, known, strict=True))  # fmt: skip
    for slider in sliders:
        mimic = slider.pop("mimic")
        if mimic is not None and mimic.joint in places:
            slider["mimic"] = [places[mimic.joint], mimic.multiplier, mimic.offset]
    return {"joints": sliders, "links": moved}


def _picked(value: Any, keys: Iterable[str]) -> dict[str, Any]:
    return {key: getattr(value, key) for key in keys}


MESH_PART = 0.35  # of the usual distance between frames is the least edge of a box


def _drawn_solids(scene: FrameScene, solids: Sequence[Solid]) -> dict[str, Any]:
    """Return the solids of known frames; a mesh becomes a box around the child frames of its frame."""
    ends = {name: [IDENTITY[:3]] for name in scene.names}  # of the links that begin at a frame
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
