"""Frames as glTF 2.0 in one binary file (.glb): a node a frame, named and nested as they are, with coloured axes.

Moving frames are animated, from their first stamp on, in seconds.  glTF has y up, so one node above all turns z up.
Source: Khronos glTF 2.0, sections 3.6 (buffers), 3.11 (animation), 4.4 (binary).
"""

from __future__ import annotations

import json
import struct
from operator import mul
from typing import TYPE_CHECKING, Any

from frametool import __version__
from frametool.frames.stamps import BILLION
from frametool.sim.turtle import single
from frametool.view.frame_scene import can_be_drawn
from frametool.view.projection import Projection, Size

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.track import MovingTrack
    from frametool.geometry.types import Rigid
    from frametool.view.frame_scene import FrameScene

THICK = 0.02  # half the width of a bar, where its length is 1
COLOURS = ((217, 45, 32, 255), (18, 135, 61, 255), (26, 95, 208, 255))
SIDES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))  # of a box, outwards
Z_UP = (-0.7071067811865476, 0.0, 0.0, 0.7071067811865476)
FLOAT, USHORT, UBYTE = 5126, 5123, 5121
VERTICES, INDICES = 34962, 34963
MESH = {"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}]}
MATERIAL = {"extensions": {"KHR_materials_unlit": {}}, "pbrMetallicRoughness": {"metallicFactor": 0}}


class BinaryPart:
    """The numbers of the file: one buffer, its views, and what is to be found in them."""

    def __init__(self) -> None:
        """Create an empty one."""
        self.data = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, data: bytes, kind: str, component: int, count: int, *, target: int = 0, **more: Any) -> int:
        """Append numbers, and return the number of their accessor."""
        self.data += bytes(-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append(view | ({"target": target} if target else {}))
        self.accessors.append(
            {"bufferView": len(self.views) - 1, "componentType": component, "count": count, "type": kind} | more
        )
        self.data += data
        return len(self.accessors) - 1

    def floats(self, rows: Sequence[Sequence[float]], kind: str, **more: Any) -> int:
        """Append rows of float32."""
        numbers = [number for row in rows for number in row]
        return self.add(struct.pack(f"<{len(numbers)}f", *numbers), kind, FLOAT, len(rows), **more)


def write_glb(scene: FrameScene) -> bytes:
    """Return the scene as the bytes of a .glb."""
    flat = Projection(scene, Size(1000.0, 700.0, 70.0, (14.0, 46.0)))
    part = BinaryPart()
    _add_axes(part)
    nodes, index = _nodes(scene, flat.poses, flat.axis)
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"frametool {__version__}"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [MESH],
        "materials": [MATERIAL],
    }
    if animation := _animation(scene, index, part):
        document["animations"] = [animation]
    part.data += bytes(-len(part.data) % 4)
    document |= {"accessors": part.accessors, "bufferViews": part.views, "buffers": [{"byteLength": len(part.data)}]}
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(part.data), len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(part.data), b"BIN\0") + part.data


def _add_axes(part: BinaryPart) -> None:
    """Add three bars along x, y, z of length 1: places, colours, triangles."""
    places: list[list[float]] = []
    faces: list[int] = []
    for axis in range(3):
        first = len(places)
        for corner in range(8):
            place = [THICK if corner >> side & 1 else -THICK for side in range(3)]
            place[axis] = 1.0 if corner >> axis & 1 else -THICK
            places.append(place)
        for a, b, c, d in SIDES:
            faces += [first + corner for corner in (a, b, c, a, c, d)]
    part.floats(places, "VEC3", target=VERTICES, min=[single(-THICK)] * 3, max=[1.0] * 3)
    colours = b"".join(bytes(colour) * 8 for colour in COLOURS)
    part.add(colours, "VEC4", UBYTE, len(places), target=VERTICES, normalized=True)
    part.add(struct.pack(f"<{len(faces)}H", *faces), "SCALAR", USHORT, len(faces), target=INDICES)


def _nodes(scene: FrameScene, poses: dict[str, Rigid], axis: float) -> tuple[list[dict[str, Any]], dict[str, int]]:
    """Return the nodes, and the number of each frame's; what has no drawn parent stands where it is in `fixed`."""
    nodes: list[dict[str, Any]] = [{"name": "z up", "rotation": Z_UP, "children": []}]
    index: dict[str, int] = {}
    for name, pose in poses.items():
        parent, track = scene.parent(name), scene.tree.track(name)
        edge = None if track is None else track.at(scene.at_ns or 0)
        above, place = (index[parent], edge) if parent in index and edge is not None else (0, pose)
        index[name] = len(nodes)
        nodes[above]["children"].append(index[name])
        nodes.append({"name": name, "translation": place[:3], "rotation": place[3:], "children": [len(nodes) + 1]})
        nodes.append({"name": f"{name} axes", "mesh": 0, "scale": [axis] * 3})
    return nodes, index


def _animation(scene: FrameScene, index: dict[str, int], part: BinaryPart) -> dict[str, Any] | None:
    """Return the samples of the frames that move below one and the same drawn parent."""
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    first_ns, _ = scene.span_ns
    for name, track in scene.tracks.items():
        drawn = name in index and track.parent in index and not track.varies
        if not drawn or not all(can_be_drawn(sample[:3]) for _, _, sample in track.walk()):
            continue
        seconds, places, rotations = _keys(track, first_ns)
        times = part.floats([*zip(seconds, strict=True)], "SCALAR", min=[seconds[0]], max=[seconds[-1]])
        for path, rows, kind in (("translation", places, "VEC3"), ("rotation", rotations, "VEC4")):
            channels.append({"sampler": len(samplers), "target": {"node": index[name], "path": path}})
            samplers.append({"input": times, "output": part.floats(rows, kind), "interpolation": "LINEAR"})
    return {"name": "samples", "channels": channels, "samplers": samplers} if channels else None


def _keys(track: MovingTrack, first_ns: int) -> tuple[list[float], list[Sequence[float]], list[Sequence[float]]]:
    """Return seconds that rise as float32, places, and rotations of which each is the nearer one of q and -q."""
    seconds: list[float] = []
    places: list[Sequence[float]] = []
    rotations: list[Sequence[float]] = []
    for stamp_ns, _, sample in track.walk():
        second = single((stamp_ns - first_ns) / BILLION)
        if seconds and second <= seconds[-1]:
            continue
        rotation = sample[3:]
        if rotations and sum(map(mul, rotation, rotations[-1])) < 0.0:
            rotation = tuple(-each for each in rotation)
        seconds.append(second)
        places.append(sample[:3])
        rotations.append(rotation)
    return seconds, places, rotations
