"""Frame trees in YAML and JSON: nested, as a list, or as ROS messages; documents in, edges out.

    frames: {base: {lidar: {xyz: [0.9, 0, 2], rpy_deg: [0, 0, 90]}}}          nested: a root's keys are its children
    frames: [{name: lidar, parent: base, xyz: [0.9, 0, 2]}]                   list, any order
    {name: lidar, parent: base, xyz: [0.9, 0, 2]}                             one edge, as `lookup` prints it

Metres, radians unless said; every pose is that of the frame in its parent: parent_from_child.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.formats import ros
from frametool.formats.pose import POSE_KEYS, Pose, read_angle_unit, read_pose
from frametool.formats.values import Misfit, as_mapping

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.formats.values import Path, Reading

TREE_KEYS = frozenset(("frames", "angles"))
CHILDREN = frozenset(("children", "samples"))
SAMPLES = frozenset(("samples",))


class Edge(NamedTuple):
    """One line of a tree: the pose of `child` in `parent`; a root has no parent."""

    parent: str | None
    child: str
    pose: Pose
    path: Path
    stamp_ns: int | None = None


def read_edges(value: Any, reading: Reading) -> Iterator[Edge]:
    """Give the edges of one document, in its order.

    Raises Misfit with the path from the document's top.
    """
    if type(value) is list:
        yield from _entries(value, (), reading)
    elif type(value) is not dict:
        as_mapping(value, "a frame tree")
    elif "frames" in value:
        yield from _tree(value, reading)
    elif ros.is_message(value):
        yield from _messages(value, (), reading)
    elif "name" in value or "parent" in value:
        yield _entry(value, (), reading)
    else:
        raise Misfit(
            f"no frame tree: expected frames:, transforms: or an entry with name: and parent:; "
            f"found the keys {', '.join(map(repr, list(value)[:8]))}",
        )


def _tree(document: dict[str, Any], reading: Reading) -> Iterator[Edge]:
    if unknown := [key for key in document if key not in TREE_KEYS]:
        raise Misfit(f"unknown key {unknown[0]!r} beside frames; expected angles", (unknown[0],), key=True)
    if "angles" in document:
        reading.degrees = read_angle_unit(document["angles"])
    frames = document["frames"]
    if type(frames) is list:
        yield from _entries(frames, ("frames",), reading)
    elif frames is not None:
        for root, children in as_mapping(frames, "a mapping of root frames or a list of entries").items():
            yield from _below_root(root, children, reading)


def _below_root(root: str, children: Any, reading: Reading) -> Iterator[Edge]:
    """Walk one nested tree, parents before children; a stack, so that no tree is too deep."""
    path: Path = ("frames", root)
    yield Edge(None, root, Pose(), path)
    pending = [(root, children, path)]
    while pending:
        parent, entries, path = pending.pop()
        if entries is None:
            continue
        deeper = []
        for child, entry in _children(entries, path).items():
            here = (*path, child)
            yield Edge(parent, child, _nested_pose(child, entry, here, reading), here)
            if entry is not None and "children" in entry:
                deeper.append((child, entry["children"], (*here, "children")))
        pending.extend(reversed(deeper))


def _children(entries: Any, path: Path) -> dict[str, Any]:
    try:
        return as_mapping(entries, "the children as a mapping by name")
    except Misfit as misfit:
        raise misfit.below(*path) from None


def _nested_pose(child: str, entry: Any, path: Path, reading: Reading) -> Pose:
    reading.here = path
    try:
        if entry is None:
            entry = {}
        if child in POSE_KEYS and type(entry) is not dict:
            raise Misfit(
                f"{child!r} stands where a frame's name is expected: a root has no pose, its keys are its children",
                key=True,
            )
        for key in ("name", "parent"):
            if key in as_mapping(entry, f"the pose of frame {child!r}"):
                raise Misfit(f"{key} is given by the nesting; leave it out", (key,), key=True)
        pose = read_pose(entry, reading, CHILDREN)
        refuse_samples(entry, child)
    except Misfit as misfit:
        raise misfit.below(*path) from None
    note_identity(pose, child, reading)
    return pose


def _entries(entries: list[Any], path: Path, reading: Reading) -> Iterator[Edge]:
    """Walk a list of entries, ours or ROS messages."""
    for index, entry in enumerate(entries):
        here = (*path, index)
        reading.here = here
        if type(entry) is dict and ros.is_message(entry):
            yield from _messages(entry, here, reading)
        else:
            yield _entry(entry, here, reading)


def _entry(entry: Any, path: Path, reading: Reading) -> Edge:
    """Read {name, parent, pose}; without parent and pose it only names a root."""
    try:
        pose = read_pose(as_mapping(entry, "an entry {name, parent, ..}"), reading, SAMPLES)
        if pose.name is None:
            raise Misfit("missing name; an entry is {name: .., parent: .., xyz: [..], ..}")
        refuse_samples(entry, pose.name)
        if pose.parent is None:
            if pose.position or pose.rotation:
                raise Misfit(f"frame {pose.name!r} has a pose but no parent")
            return Edge(None, pose.name, pose, path)
    except Misfit as misfit:
        raise misfit.below(*path) from None
    note_identity(pose, pose.name, reading)
    return Edge(pose.parent, pose.name, pose, path)


def _messages(value: dict[str, Any], path: Path, reading: Reading) -> Iterator[Edge]:
    """Read every TransformStamped of a ROS message."""
    for message, here in ros.messages(value, path):
        reading.here = here
        try:
            parent, child, position, rotation, stamp_ns = ros.read_transform(message, reading)
        except Misfit as misfit:
            raise misfit.below(*here) from None
        yield Edge(parent, child, Pose(position, rotation), here, stamp_ns)


def refuse_samples(entry: dict[str, Any] | None, child: str) -> None:
    """Refuse a moving frame: lookups in time are not built yet, and dropping it would be a wrong answer."""
    if entry is not None and "samples" in entry:
        raise Misfit(f"frame {child!r} moves (samples:); only trees that stand still are read", ("samples",), key=True)


def note_identity(pose: Pose, child: str, reading: Reading) -> None:
    """Wonder about an entry without any numbers."""
    if pose.position is None and pose.rotation is None:
        reading.note(f"frame {child!r} has neither position nor rotation: taken as the identity")
