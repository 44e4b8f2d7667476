"""The page as a file: what is inside, what it may do, how large it is; no browser is needed."""

from __future__ import annotations

import base64
import hashlib
import itertools
import json
import math
import re
import zlib
from array import array
from functools import partial
from typing import TYPE_CHECKING, Any

import browsers
import pytest
from console import ROOT

import frametool
from frametool.errors import UnknownFrame, ValueInvalid
from frametool.frames.buffer import TransformBuffer
from frametool.frames.lookups import FrameTree
from frametool.geometry.transform import Transform
from frametool.view.exports import SCRIPTS, write_page
from frametool.view.frame_scene import FrameScene

if TYPE_CHECKING:
    from pathlib import Path

    from browsers import MakePage

HOSTILE = ["</script><script>alert(1)</script>", "<img src=x onerror=alert(1)>", "__proto__", "constructor", "@HEAD@", "\u2028", "a'b\"c&amp;", "界", "x" * 200]


@pytest.fixture
def page_of(tmp_path: Path) -> MakePage:
    """Write the page of a tree."""
    return partial(browsers.make_page, tmp_path)


def head_of(text: str) -> dict[str, Any]:
    """Read back what was written into a page."""
    found: dict[str, Any] = json.loads(re.search('id="head-data">([^<]*)<', text)[1])  # type: ignore[index]
    return found


def numbers_of(text: str) -> array[float]:
    """Read back the doubles of a page."""
    data = base64.b64decode(re.search('id="blob">([^<]*)<', text)[1])  # type: ignore[index]
    numbers = array("d")
    numbers.frombytes(zlib.decompress(data) if head_of(text)["packed"] else data)
    return numbers


def chain(names: list[str]) -> FrameTree:
    """Return a tree in which each frame hangs from the one before."""
    tree = FrameTree()
    tree.add_root(names[0])
    for parent, child in itertools.pairwise(names):
        tree.add(parent, child, Transform.of(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    return tree


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
def test_the_page_of_an_example_is_small_and_asks_nobody(page_of: MakePage, name: str) -> None:
    text = page_of(name).read_text()
    assert len(text.encode()) <= 75_000
    assert not re.search(r"(?:src|href)=|@import|fetch\(|XMLHttpRequest|WebSocket|import\(|https?://", text)


def test_the_script_is_no_larger_than_a_person_reads() -> None:
    from importlib.resources import files

    folder = files("frametool.view").joinpath("page")
    sources = [folder.joinpath(f"{name}.js").read_text("utf-8") for name in SCRIPTS]
    assert sum(map(len, sources)) <= 60_000
    assert max(len(line) for source in sources for line in source.splitlines()) <= 140


def test_only_the_pages_own_script_and_style_may_run(page_of: MakePage) -> None:
    text = page_of("robot.yaml").read_text()
    policy = re.search('Security-Policy" content="([^"]*)"', text)[1]  # type: ignore[index]
    for element, kind in (('script type="module"', "script"), ("style", "style")):
        own = re.search(f"<{element}>(.*?)</{kind}>", text, re.DOTALL)[1]  # type: ignore[index]
        digest = base64.b64encode(hashlib.sha256(own.encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}'" in policy
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy


def test_names_cannot_end_the_data_or_become_elements() -> None:
    text = write_page(FrameScene(chain(["map", *HOSTILE])), title=HOSTILE[0])
    assert text.count("<script") == 3
    assert "<img" not in text
    assert head_of(text)["names"] == ["map", *HOSTILE]


def test_poses_and_stamps_are_in_the_page_to_the_bit() -> None:
    buffer = TransformBuffer()
    begin = 1_700_000_000_123_456_789
    samples = [Transform.of(0.1 * k, 1e-300, -1 / 3, 0.0, 0.0, 0.6, 0.8) for k in range(5000)]
    for number, sample in enumerate(samples):
        buffer.insert("map", "base", sample, begin + number * 1_000_003)
    text = write_page(FrameScene(buffer), title="log")
    (track,) = head_of(text)["tracks"]
    numbers = numbers_of(text)[track["at"] // 8 :]
    assert (head_of(text)["first"], head_of(text)["last"]) == (str(begin), str(begin + 4999 * 1_000_003))
    assert head_of(text)["packed"]
    assert list(array("q", numbers[: track["count"]].tobytes())) == [begin + k * 1_000_003 for k in range(5000)]
    assert [tuple(numbers[5000 + 7 * k : 5007 + 7 * k]) for k in range(5000)] == [each.components for each in samples]


def test_the_command_chooses_what_the_page_shows_first() -> None:
    tree = frametool.load(ROOT / "examples" / "robot.yaml")
    scene = FrameScene(tree, fixed="odom", target="map", source="tool", only="link|map|odom|tool")
    shown = head_of(write_page(scene, title="robot", eye=(1.0, 0.25)))["show"]
    assert (shown["fixed"], shown["target"], shown["source"], shown["view"]) == ("odom", "map", "tool", [1.0, 0.25])
    assert "lidar" not in shown["only"]
    assert "wrist_link" in shown["only"]


@pytest.mark.parametrize("wrong", [{"fixed": "x"}, {"target": "x"}, {"source": "x"}, {"below": "x"}])
def test_a_frame_that_is_not_there_is_named(wrong: dict[str, str]) -> None:
    with pytest.raises(UnknownFrame, match="unknown frame 'x'"):
        FrameScene(chain(["map", "base"]), **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("only", ["(", "nothing like it"])
def test_an_expression_that_chooses_nothing_is_refused(only: str) -> None:
    with pytest.raises(ValueInvalid, match=r"regular expression|nothing matches"):
        FrameScene(chain(["map", "base"]), only=only)


def test_an_empty_tree_is_refused() -> None:
    with pytest.raises(ValueInvalid, match="no frames"):
        FrameScene(FrameTree())


# --- the scene --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
@pytest.mark.parametrize("at_ns", [None, 0, 500_000_000, 1_999_999_999, 2_000_000_000, 3_999_999_999])
def test_poses_are_those_of_lookup(name: str, at_ns: int | None) -> None:
    tree = frametool.load(ROOT / "examples" / name)
    scene = FrameScene(tree, at_ns=at_ns)
    poses = scene.poses()
    assert set(poses) == set(tree.frames)
    for frame, pose in poses.items():
        found = tree.lookup(scene.fixed, frame, scene.at_ns)
        assert Transform.of(*pose).is_close(found, angle=1e-13, distance=1e-13)


def test_below_takes_what_hangs_there_at_the_time() -> None:
    tree = frametool.load(ROOT / "examples" / "drive.yaml")
    names = [set(FrameScene(tree, below="base_link", at_ns=at).poses()) for at in (1_000_000_000, 3_000_000_000)]
    assert names == [{"base_link", "lidar", "gripper"}, {"base_link", "lidar", "gripper", "box"}]


def test_a_trail_breaks_where_the_parent_changes_and_nowhere_else() -> None:
    trails = FrameScene(frametool.load(ROOT / "examples" / "drive.yaml")).trails
    assert {name: len(trail) for name, trail in trails.items()} == {"base_link": 1, "box": 2}
    assert trails["base_link"][0][-1] == pytest.approx((2.0, 2.0, 0.0))
    assert len(trails["base_link"][0]) == 4 * 8 + 1


def test_a_trail_below_a_moving_parent_is_taken_at_the_parents_stamps_too() -> None:
    buffer = TransformBuffer()
    for second, yaw in enumerate((0.0, 1.0, 2.0, 3.0)):
        half = yaw / 2.0
        buffer.insert("map", "arm", Transform.of(0, 0, 0, 0, 0, math.sin(half), math.cos(half)), second * 10**9)
    for second in (0, 3):
        buffer.insert("arm", "hand", Transform.of(1.0, 0.0, 0.0, 0, 0, 0, 1), second * 10**9)
    trail = FrameScene(buffer).trails["hand"]
    assert len(trail[0]) == 3 * 8 + 1
    assert {round(math.hypot(*point), 9) for point in trail[0]} == {1.0}
