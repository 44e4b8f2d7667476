"""Trees, poses and scenes, damaged at random: read or refused, and what is written of them is read again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from oracles_of_use import HOSTILE, cases

if TYPE_CHECKING:
    from random import Random

    from oracles_of_use import Tool

pytestmark = pytest.mark.fuzz
EXAMPLES = Path(__file__).parents[2] / "examples"
NESTED = """angles: deg
frames:
  base:
    lidar: {xyz: [0.9, 0.0, 2.0], rpy: [0, 0, 90]}
    cam:
      xyz: [0.1, 0, 1.2]
      rpy: {pitch: 15}
      children:
        optical: {quaternion: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}
"""
JSON = """{"frames": [
  {"name": "a", "parent": "b", "xyz": [1, 2, 3], "euler": {"axes": "rzyx", "angles": [1, 2, 3]}},
  {"name": "c", "parent": "a", "matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}
]}"""
MESSAGE = """transforms:
- header: {stamp: {sec: 1, nanosec: 5}, frame_id: map}
  child_frame_id: base
  transform:
    translation: {x: 1, y: 2, z: 3}
    rotation: {x: 0, y: 0, z: 0, w: 1}
---
"""
TREES = [NESTED, JSON, MESSAGE, *((EXAMPLES / name).read_text() for name in ("robot.yaml", "drive.yaml"))]
SCENE = (EXAMPLES / "turtles.yaml").read_text()
READERS = [
    ["tree", "IN"], ["tree", "IN", "-f", "json"], ["tree", "IN", "-f", "text"], ["check", "IN"], ["check", "IN", "-f", "json"], ["monitor", "IN"],
    ["lookup", "IN", "base", "lidar", "-f", "json"], ["lookup", "IN", "map", "base_link", "--at", "1"], ["echo", "IN", "map", "base_link", "-l", "3"],
    ["apply", "IN", "map", "lidar", "1", "2", "3"], ["static", "IN"], ["invert", "IN"], ["convert", "IN", "--to", "rpy_deg"],
    ["compose", "IN", "{xyz: [1, 2, 3]}"], ["tree", "IN", "-f", "dot"], ["tree", "IN", "-f", "ros2"], ["tree", "IN", "-f", "mermaid"],
]  # fmt: skip


def damaged(random: Random, text: str) -> str:
    """Return a text with a few pieces cut out, doubled, swapped for hostile ones or moved."""
    for _ in range(random.choice([1, 1, 2, 5])):
        at = random.randrange(len(text) + 1)
        end = min(len(text), at + random.choice([0, 1, 1, 2, 5, 40]))
        piece = random.choice([text[at:end] * 2, "", random.choice(HOSTILE), random.choice(HOSTILE), text[-20:], "\n", "  ", ": ", "- "])
        text = text[:at] + piece + text[end:]
    return text


def test_a_damaged_document_is_read_or_refused(tool: Tool) -> None:
    for random in cases(2.0):
        text = damaged(random, random.choice(TREES))
        Path("in.yaml").write_text(text, errors="surrogatepass", encoding="utf-8")
        tool(*("in.yaml" if word == "IN" else word for word in random.choice(READERS)))


def test_a_damaged_scene_is_run_or_refused(tool: Tool) -> None:
    for random in cases(0.5):
        Path("in.yaml").write_text(damaged(random, SCENE), encoding="utf-8")
        tool("sim", "run", "in.yaml", "--duration", "0.2", "-f", "json")


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_what_is_written_of_a_tree_is_the_same_tree(form: str, tool: Tool) -> None:
    for random in cases(0.5):
        Path("in.yaml").write_text(damaged(random, random.choice(TREES)), encoding="utf-8")
        first = tool("tree", "in.yaml", "-f", form)
        if first.status == 0:
            Path("out.yaml").write_bytes(first.out)
            assert tool("tree", "out.yaml", "-f", form).out == first.out
