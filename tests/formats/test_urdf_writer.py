"""URDF written: it reads back to the same bits, and what it cannot hold is refused."""

from __future__ import annotations

import random
import re
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pytest
from robots import origin

import frametool
from frametool.formats.robots.urdf import write_tree
from frametool.frames.lookups import FrameTree
from frametool.grammar.result import Style

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

NAMES = ["a b", "base/link", 'quote"s', "<&>'", "tab\there", "line\nend", "händ", "  ", "a", "0"]


def random_tree(seed: int) -> FrameTree:
    """Draw a tree with awkward names."""
    draw = random.Random(seed)  # noqa: S311 - a test
    tree = FrameTree()
    for index, name in enumerate(NAMES[1:], 1):
        turned = frametool.Rotation.from_quaternion([draw.gauss(0, 1) for _ in range(4)], normalize=True)
        at = [draw.uniform(-1e3, 1e3), draw.gauss(0, 1e-9), 0.1 * draw.randrange(9)]
        tree.add(NAMES[draw.randrange(index)], name, frametool.Transform(turned, at))
    return tree


@pytest.mark.parametrize("seed", range(5))
def test_what_is_written_reads_back_to_the_same_bits(seed: int, tmp_path: Path) -> None:
    tree = random_tree(seed)
    (tmp_path / "out.urdf").write_text(write_tree(tree, Style("urdf")), encoding="utf-8")
    back = frametool.load(tmp_path / "out.urdf")
    assert set(back.frames) == set(tree.frames)
    for _, child, _ in tree.edges():
        parent = tree.parent(child)
        assert parent is not None
        assert back.lookup(parent, child).components == canonical(tree.lookup(parent, child))


def canonical(pose: Any) -> tuple[float, ...]:
    """Give the components of a pose with w >= 0, as written."""
    parts = pose.components
    return parts if parts[6] >= 0.0 else (*parts[:3], *(-part for part in parts[3:]))


@pytest.mark.parametrize("seed", range(5))
def test_readers_that_know_angles_only_find_the_same_poses(seed: int) -> None:
    tree = random_tree(seed)
    root = ET.fromstring(write_tree(tree, Style("urdf")))  # noqa: S314 - our own text
    for joint in root.iter("joint"):
        parts: dict[str, dict[str, str]] = {part.tag: part.attrib for part in joint}
        xyz, rpy = ([float(word) for word in parts["origin"][key].split()] for key in ("xyz", "rpy"))
        parent, child = parts["parent"]["link"], parts["child"]["link"]
        assert abs(origin(xyz, rpy) - tree.lookup(parent, child).as_matrix()).max() < 1e-12


def test_each_frame_is_a_link_and_each_edge_a_fixed_joint_of_its_child(run: Run) -> None:
    files = {"a.yaml": "frames: {a: {b: {xyz: [1, 0, 0], rpy: [0, 0, 0.5]}}}"}
    assert run("tree", "a.yaml", "-f", "urdf", files=files).out == (
        '<?xml version="1.0"?>\n<robot name="robot">\n  <link name="a"/>\n  <link name="b"/>\n'
        '  <joint name="b_joint" type="fixed">\n    <origin xyz="1.0 0.0 0.0" rpy="0.0 0.0 0.5"/>\n'
        '    <parent link="a"/>\n    <child link="b"/>\n  </joint>\n</robot>\n'
    )
    assert run("tree", "a.yaml", "-o", "b.urdf").status == 0
    assert 'rpy="0.00 0.00 0.50"' in run("tree", "b.urdf", "-f", "urdf", "--precision", "2").out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("frames: {a: {b: {}}, c: {d: {}}}", "URDF holds one tree, and this has the roots a, c"),
        (
            "frames: [{name: b, parent: a, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0]}]}]",
            "URDF holds no moving frames, and 'b' moves; give --at TIME",
        ),
        ('frames: {"${a}": {b: {}}}', "frame '${a}' cannot be written in URDF: it reads as xacro"),
        ('frames: {"a\\e": {b: {}}}', "cannot be written in URDF: XML has no such characters"),
    ],
)
@pytest.mark.filterwarnings("ignore")
def test_what_urdf_cannot_hold_is_refused(text: str, said: str, run: Run) -> None:
    done = run("tree", "a.yaml", "-f", "urdf", files={"a.yaml": text})
    assert (done.status, done.out) == (1, "")
    assert re.search(re.escape(said), done.err)


def test_a_moment_of_what_moves_is_written(run: Run) -> None:
    text = "frames: [{name: b, parent: a, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0]}]}]"
    done = run("tree", "a.yaml", "-f", "urdf", "--at", "0.25", files={"a.yaml": text})
    assert (done.status, 'xyz="0.25 0.0 0.0"' in done.out) == (0, True)
