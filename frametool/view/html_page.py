"""One HTML file in which frames can be looked at from all sides, with everything inside and no request to anywhere.

Its script and style stand as plain files in the folder `page`, one after another in the order of SCRIPTS; the page
lets nothing else run.  Poses go in as doubles, stamps as 64-bit integers of nanoseconds; joints of a robot
with their limits.  A run of turtles is shown as its followers saw it in tf.
"""

from __future__ import annotations

import os
import re
import sys
from array import array
from base64 import b64encode
from hashlib import sha256
from html import escape
from itertools import chain, islice
from json import dumps
from typing import TYPE_CHECKING, Any

from frametool import __version__
from frametool.formats.robots.model import JointValue
from frametool.frames.buffer import TransformBuffer
from frametool.frames.stamps import format_stamp
from frametool.view.frame_scene import FrameScene
from frametool.view.projection import EYES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from frametool.formats.robots.model import Robot, Value
    from frametool.sim.simulate import SimulationStep

FOLDER = os.path.join(os.path.dirname(__file__), "page")
SCRIPTS = ("begin", "kernels", "frames", "state", "camera", "picture", "labels", "panel", "hands", "main")
WITH_JOINTS = (*SCRIPTS[:-1], "joints", "main")
EACH = 8  # bytes of a number
BLOCK = 1 << 13  # samples
PACKED = 48_000  # bytes of numbers, from where on they are compressed
NO_POSE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def write_page(
    scene: FrameScene, *, title: str, file: str = "", eye: tuple[float, float] | None = None,
    other: FrameScene | None = None, other_title: str = "", joints: Sequence[dict[str, Any]] = (),
) -> str:  # fmt: skip
    """Return the page.

    title: its heading.  file: the tree's name in the command that the page offers to copy.
    eye: azimuth and elevation of the first view, radians.
    other: another tree seen in the same frame, laid over this one; other_title: what it is called.
    joints: those with a slider, as `joint_sliders` makes them.
    """
    head = _head(scene) | {"title": title, "file": file or title, "made": f"frametool {__version__}"}
    head["show"] = _shown(scene, eye)
    if joints:
        head["joints"] = list(joints)
    if other is not None:
        here = {name: number for number, name in enumerate(scene.names)}
        poses = {here[name]: pose for name, pose in other.poses().items() if name in here}
        head["overlay"] = {"title": other_title, "poses": poses}
    script, style = "".join(_file(f"{name}.js") for name in (WITH_JOINTS if joints else SCRIPTS)), _file("page.css")
    parts = {
        # the page lets its own script and style run, and nothing else
        "POLICY": "default-src 'none'; "
        f"script-src '{_digest(script)}'; style-src '{_digest(style)}'; base-uri 'none'; form-action 'none'",
        "TITLE": escape(title),
        "STYLE": style,
        # JSON that no name in it can end
        "HEAD": dumps(head, separators=(",", ":")).replace("<", "\\u003c").replace("&", "\\u0026"),
        "BLOB": b64encode(b"".join(_packed(_blob(scene)) if head["packed"] else _blob(scene))).decode(),
        "SCRIPT": script,
    }
    return re.sub("@([A-Z]+)@", lambda mark: parts[mark[1]], _file("page.html"))


def _file(name: str) -> str:
    with open(os.path.join(FOLDER, name), encoding="utf-8") as stream:
        return stream.read()


def _digest(text: str) -> str:
    return f"sha256-{b64encode(sha256(text.encode()).digest()).decode()}"


def _shown(scene: FrameScene, eye: tuple[float, float] | None) -> dict[str, Any]:
    """Return what the page shows first."""
    shown: dict[str, Any] = {"fixed": scene.fixed, "path": scene.path_only}
    shown |= {key: name for key, name in (("target", scene.target), ("source", scene.source)) if name}
    if scene.at_ns is not None:
        shown["t"] = format_stamp(scene.at_ns)
    if scene.chosen is not None and not scene.path_only:
        shown["only"] = [name for name in scene.names if name in scene.chosen]
    return shown | ({"view": eye} if eye else {})


def _head(scene: FrameScene) -> dict[str, Any]:
    """Return names, parents and where each track's numbers begin in the blob."""
    index = {name: number for number, name in enumerate(scene.names)}
    standing = (None if name in scene.tracks else scene.tree.track(name) for name in scene.names)
    parents = [-1 if track is None else index[track.parent] for track in standing]
    tracks: list[dict[str, Any]] = []
    at = EACH * len(NO_POSE) * len(parents)
    for name, moving in scene.tracks.items():
        parents_then = [index[parent] for _, parent, _ in moving.walk()] if moving.varies else index[moving.parent]
        tracks.append({"frame": index[name], "count": moving.count, "at": at, "parents": parents_then})
        at += EACH * (1 + len(NO_POSE)) * moving.count
    first, last = map(str, scene.span_ns)
    head = {"names": scene.names, "parents": parents, "tracks": tracks, "first": first, "last": last}
    return head | {"packed": at > PACKED}


def _blob(scene: FrameScene) -> Iterator[bytes]:
    """Yield the poses of frames that stand still, then of each track its stamps and its samples."""
    standing = (None if name in scene.tracks else scene.tree.track(name) for name in scene.names)
    yield _little(array("d", chain.from_iterable(track.components if track else NO_POSE for track in standing)))
    for moving in scene.tracks.values():
        yield _little(array("q", (stamp for stamp, _, _ in moving.walk())))
        samples = moving.walk()
        while some := array("d", chain.from_iterable(each for _, _, each in islice(samples, BLOCK))):
            yield _little(some)


def _little(numbers: array[Any]) -> bytes:
    if sys.byteorder == "big":
        numbers.byteswap()
    return numbers.tobytes()


def _packed(pieces: Iterator[bytes]) -> Iterator[bytes]:
    from zlib import compressobj

    packer = compressobj(6)
    yield from map(packer.compress, pieces)
    yield packer.flush()


def joint_sliders(robot: Robot, values: Mapping[str, Value], names: Sequence[str]) -> list[dict[str, Any]]:
    """Return the joints that turn or slide and stand still, as the page has them.

    values: of the joints, by name.  names: of the frames of the page, in its order.
    """
    index = {name: number for number, name in enumerate(names)}
    links = {child: link for child, link in robot.links.items() if link.joints and child in index}
    found: list[dict[str, Any]] = []
    for child, link in links.items():
        (joint,) = link.joints
        value = values.get(joint.name)
        if not joint.posed and isinstance(value, JointValue):
            found.append({
                "name": joint.name, "frame": index[child], "kind": joint.kind, "axis": joint.axis,
                "origin": link.origin, "lower": joint.lower, "upper": joint.upper, "value": float(value.plain),
            })  # fmt: skip
    places = {str(each["name"]): number for number, each in enumerate(found)}
    for name, each in zip(places, found, strict=True):
        mimic = robot.joints[name].mimic
        if mimic and mimic.joint in places:
            each["mimic"] = [places[mimic.joint], mimic.multiplier, mimic.offset]
    return found


class RunPage:
    """Collect the transforms of a run, all of them, for a page."""

    def __init__(self) -> None:
        """Create the page of a run that has not begun."""
        self.buffer = TransformBuffer(name="run")

    def watch(self, step: SimulationStep) -> None:
        """Add the transforms of a step."""
        for stamp_ns, parent, child, transform in step.broadcasts:
            self.buffer.insert(parent, child, transform, stamp_ns)

    def content(self) -> str:
        """Return the page, seen from above."""
        return write_page(FrameScene(self.buffer), title="turtles", file="tf.yaml", eye=EYES["top"])
