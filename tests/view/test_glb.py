"""GLB: what the Khronos validator looks at, and that each node stands where lookup says."""

from __future__ import annotations

import itertools
import json
import struct
from typing import Any

import pytest
from console import ROOT

import frametool
from frametool.frames.buffer import TransformBuffer
from frametool.geometry.transform import Transform
from frametool.view.exports import write_glb
from frametool.view.frame_scene import FrameScene

SIZES = {5126: ("f", 4), 5123: ("H", 2), 5121: ("B", 1)}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
Z_UP = Transform.of(0.0, 0.0, 0.0, -0.7071067811865476, 0.0, 0.0, 0.7071067811865476)


def parts(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Split a file into its document and its numbers, checking the frame around them."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    text_length, kind = struct.unpack_from("<I4s", data, 12)
    assert (kind, text_length % 4) == (b"JSON", 0)
    at = 20 + text_length
    binary_length, kind = struct.unpack_from("<I4s", data, at)
    assert (kind, binary_length % 4, at + 8 + binary_length) == (b"BIN\0", 0, len(data))
    document: dict[str, Any] = json.loads(data[20:at])
    return document, data[at + 8 :]


def rows(document: dict[str, Any], numbers: bytes, index: int) -> list[tuple[float, ...]]:
    """Read the rows of an accessor."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    letter, size = SIZES[accessor["componentType"]]
    width = WIDTHS[accessor["type"]]
    assert view["byteOffset"] % 4 == 0
    assert view["byteLength"] == accessor["count"] * width * size
    flat = struct.unpack_from(f"<{accessor['count'] * width}{letter}", numbers, view["byteOffset"])
    return [flat[at : at + width] for at in range(0, len(flat), width)]


def world(document: dict[str, Any]) -> dict[str, Transform]:
    """Compose the nodes from the scene's root down."""
    found = {}

    def walk(index: int, above: Transform) -> None:
        node = document["nodes"][index]
        here = above @ Transform.of(*node.get("translation", (0, 0, 0)), *node.get("rotation", (0, 0, 0, 1)))
        found[node["name"]] = here
        for child in node.get("children", ()):
            walk(child, here)

    walk(document["scenes"][document["scene"]]["nodes"][0], Transform.identity())
    return found


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
@pytest.mark.parametrize("at_ns", [None, 2_500_000_000])
def test_every_node_stands_where_lookup_says(name: str, at_ns: int | None) -> None:
    tree = frametool.load(ROOT / "examples" / name)
    scene = FrameScene(tree, at_ns=at_ns)
    document, _ = parts(write_glb(scene))
    nodes = world(document)
    for frame in tree.frames:
        expected = Z_UP @ tree.lookup(scene.fixed, frame, scene.at_ns)
        assert nodes[frame].is_close(expected, angle=1e-7, distance=1e-7)


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
def test_the_file_keeps_the_validators_rules(name: str) -> None:
    document, numbers = parts(write_glb(FrameScene(frametool.load(ROOT / "examples" / name))))
    assert document["buffers"] == [{"byteLength": len(numbers)}]
    for index, accessor in enumerate(document["accessors"]):
        values = rows(document, numbers, index)
        if "min" in accessor:
            assert [min(column) for column in zip(*values, strict=True)] == pytest.approx(accessor["min"], abs=0)
            assert [max(column) for column in zip(*values, strict=True)] == pytest.approx(accessor["max"], abs=0)
    (primitive,) = document["meshes"][0]["primitives"]
    assert "min" in document["accessors"][primitive["attributes"]["POSITION"]]
    triangles = rows(document, numbers, primitive["indices"])
    assert max(triangles)[0] < document["accessors"][primitive["attributes"]["POSITION"]]["count"]
    children = [child for node in document["nodes"] for child in node.get("children", ())]
    assert sorted(children) == list(range(1, len(document["nodes"])))
    assert len({node["name"] for node in document["nodes"]}) == len(document["nodes"])
    assert all(node.get("children", [0]) for node in document["nodes"])
    for node in document["nodes"]:
        assert sum(part * part for part in node.get("rotation", (0, 0, 0, 1))) == pytest.approx(1.0, abs=1e-6)


def test_samples_are_animated_with_times_that_rise_and_rotations_that_turn_the_short_way() -> None:
    buffer = TransformBuffer()
    for number, w in enumerate((0.8, -0.8, 0.8)):
        buffer.insert("map", "base", Transform.of(number, 0.0, 0.0, 0.0, 0.0, 0.6 * (1 if w > 0 else -1), w), 10**18 + number)
    buffer.insert("map", "base", Transform.of(9.0, 0.0, 0.0, 0.0, 0.0, 0.6, 0.8), 10**18 + 2 * 10**9)
    document, numbers = parts(write_glb(FrameScene(buffer)))
    (animation,) = document["animations"]
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        times = [row[0] for row in rows(document, numbers, sampler["input"])]
        values = rows(document, numbers, sampler["output"])
        assert len(times) == len(values)
        assert all(a < b for a, b in itertools.pairwise(times))
        assert document["accessors"][sampler["input"]]["max"] == [2.0]
        if channel["target"]["path"] == "rotation":
            assert all(sum(x * y for x, y in zip(a, b, strict=True)) > 0 for a, b in itertools.pairwise(values))
    assert document["nodes"][animation["channels"][0]["target"]["node"]]["name"] == "base"


def test_a_frame_that_changes_its_parent_is_drawn_and_not_animated() -> None:
    document, _ = parts(write_glb(FrameScene(frametool.load(ROOT / "examples" / "drive.yaml"))))
    moved = {document["nodes"][channel["target"]["node"]]["name"] for channel in document["animations"][0]["channels"]}
    assert moved == {"base_link"}
