"""Autoware's sensor calibration: a map of frames with the poses of others in them, six numbers each.

    base_link:
      sensor_kit_base_link: {x: 0.9, y: 0.0, z: 2.0, roll: -0.001, pitch: 0.015, yaw: -0.0364}

Metres, radians; roll, pitch, yaw about the fixed axes x, y, z: the pose of the inner frame in the outer one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.yaml_writer import flow, quoted
from frametool.errors import bare, listing, shown, warn
from frametool.formats.trees.tree_reader import XYZ, document_edges, read_flat_pose
from frametool.formats.trees.written_poses import angles_of, static_edges, warn_lonely_roots
from frametool.geometry.representations import notation
from frametool.grammar.edges import Edge, Options
from frametool.grammar.readers import Misfit, Reading, as_mapping, within

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames
    from frametool.grammar.readers import Path
    from frametool.grammar.result import Style

NAME = "autoware"
_RPY = notation("rpy")
KEYS = (*XYZ, *_RPY.columns)


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per pose."""

    def take(value: Any, reading: Reading) -> Iterator[Edge]:
        for parent, children in as_mapping(value, "frames with the poses of others in them").items():
            inner = within((parent,), as_mapping, children, f"the poses of frames in {shown(parent)}")
            for child, pose in inner.items():
                path: Path = (parent, child)
                reading.here = path
                try:
                    yield _edge(parent, child, pose, reading)
                except Misfit as misfit:
                    reading.refuse(misfit.below(*path))

    yield from document_edges(file, options, take)


def _edge(parent: str, child: str, pose: Any, reading: Reading) -> Edge:
    """Read one pose; raises Misfit."""
    if not set(_RPY.columns).intersection(as_mapping(pose, f"the pose of {shown(child)} as {{{', '.join(KEYS)}}}")):
        tree = f"frames: {{{bare(parent)}: {{{bare(child)}: {{xyz: [..]}}}}}}"
        raise Misfit(f"taken for Autoware by its keys, whose poses have roll, pitch, yaw too; positions alone: {tree}")
    for key in pose:
        if key not in KEYS:
            raise Misfit(f"unknown key {shown(key)}; a pose has {', '.join(KEYS)}", (key,), key=True)
    return Edge(parent, child, read_flat_pose(pose, _RPY, reading), path=(parent, child))


def write_tree(tree: Frames, style: Style) -> str:
    """Return one map per parent; raises ValueInvalid for moving frames."""
    texts: dict[str, list[str]] = {}
    for parent, child, pose in static_edges(tree, NAME):
        numbers = zip(KEYS, (*pose[:3], *angles_of(pose[3:])), strict=True)
        lines = "".join(f"    {key}: {flow(number, style.number)}\n" for key, number in numbers)
        texts.setdefault(parent, []).append(f"  {quoted(child)}:\n{lines}")
    if len(texts) > 1:
        warn(f"Autoware has a file for each frame that holds others; here in one: {listing(texts)}")
    warn_lonely_roots(tree, NAME)
    return "".join(f"{quoted(parent)}:\n{''.join(children)}" for parent, children in texts.items())
