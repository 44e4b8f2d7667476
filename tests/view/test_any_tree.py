"""Random trees, still and moving, with hostile numbers and parents that change: every form of picture, at any time."""

from __future__ import annotations

import json
import math
import random
import re

import pytest
from console import ROOT

import frametool
from frametool.errors import FrametoolError, ValueInvalid
from frametool.frames.buffer import TransformBuffer
from frametool.geometry.transform import Transform
from frametool.view.exports import still_picture, write_glb, write_page
from frametool.view.frame_scene import FrameScene
from frametool.view.pictures import write_svg
from frametool.view.terminal import terminal_text

VALUES = (0.0, 1.0, -1.0, 1e-9, 1e-300, 5e-324, 1e9, 1e29, 1e150, 1e300, -1e300, 1.7e308, 123.456)
TIMES = (None, 0, 10**9, 10**18 + 5)


def random_pose(generator: random.Random) -> Transform:
    """Draw a pose; some coordinates are hostile."""
    turn = [generator.gauss(0, 1) for _ in range(4)]
    norm = math.hypot(*turn)
    place = (generator.choice(VALUES) if generator.random() < 0.3 else generator.uniform(-3, 3) for _ in range(3))
    return Transform.of(*place, *(part / norm for part in turn))


def random_tree(generator: random.Random) -> TransformBuffer:
    """Draw a tree of up to a dozen frames; what the buffer refuses is left out."""
    tree = TransformBuffer()
    tree.add_root("root")
    for number in range(generator.randrange(1, 12)):
        above = ["root", *(f"f{before}" for before in range(number))]
        stamps: list[int | None] = [None]
        if generator.random() < 0.5:
            begin = generator.choice([0, 10**18, -5])
            stamps = [begin + step * generator.choice([1, 3, 10**7, 10**9]) for step in range(generator.randrange(1, 6))]
        parent = generator.choice(above)
        for stamp in stamps:
            try:
                tree.insert(generator.choice(above) if generator.random() < 0.3 else parent, f"f{number}", random_pose(generator), stamp)
            except FrametoolError:
                continue
    return tree


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")  # two poses at one stamp
@pytest.mark.parametrize("seed", range(40))
def test_any_tree_is_drawn_in_every_form_or_says_that_nothing_is_left(seed: int) -> None:
    generator = random.Random(seed)  # noqa: S311 - no secret
    tree = random_tree(generator)
    for at_ns in TIMES:
        fixed, below = generator.choice([None, *tree.frames]), generator.choice([None, None, *tree.frames])
        eye = generator.uniform(-7, 7), generator.uniform(-1.57, 1.57)
        scene = FrameScene(tree, at_ns=at_ns, fixed=fixed, below=below)
        assert not re.search(r'[" ](nan|-?inf)[" ]', write_svg(still_picture(scene, eye)))
        columns, lines = generator.randrange(1, 120), generator.randrange(1, 40)
        assert len(terminal_text(scene, columns, lines, eye).splitlines()) == max(lines, 4)
        assert write_page(scene, title="x").startswith("<!DOCTYPE html>")
        data = write_glb(scene)
        text = data[20 : 20 + int.from_bytes(data[12:16], "little")]
        assert not re.search(rb"NaN|Infinity", text)
        assert json.loads(text)["asset"]["version"] == "2.0"


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
def test_a_choice_that_leaves_nothing_says_so() -> None:
    with pytest.raises(ValueInvalid, match="nothing matches"):
        FrameScene(random_tree(random.Random(1)), only="no such frame")  # noqa: S311


def test_a_terminal_begins_where_most_frames_are_and_points_to_the_others() -> None:
    """As the page does; where no frame is far away all of them are inside."""
    tree = frametool.load(ROOT / "examples" / "robot.yaml")
    text = terminal_text(FrameScene(tree), 100, 30)
    assert re.findall(r"(?m)^([←-⇿]) (\w+) ([\d.]+) m", text) == [("↖", "map", "14"), ("←", "charging_dock", "7.4"), ("←", "odom", "2.4")]
    assert "0.2 m  in map" in text.splitlines()[-1]
    assert not re.search("[←-⇿]", terminal_text(FrameScene(tree, below="base_link"), 100, 30))
