"""Frames as SVG, PNG and in the terminal: where things are, what may not lie over what, and odd trees."""

from __future__ import annotations

import itertools
import json
import math
import re
import xml.etree.ElementTree as ET
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import pytest
from console import ROOT

import frametool
from frametool.errors import FileProblem
from frametool.frames.lookups import FrameTree
from frametool.geometry.transform import Transform
from frametool.view.exports import HEIGHT, SIZE, WIDTH, still_picture
from frametool.view.frame_scene import EYES, FrameScene, Projection, placed_names, rounded
from frametool.view.pictures import write_png, write_svg
from frametool.view.terminal import Canvas, terminal_lines, terminal_text

if TYPE_CHECKING:
    from pathlib import Path

SVG = "{http://www.w3.org/2000/svg}"
NAMES = ["</text><script>", "a&b", "\x1b[31m", "x" * 200, "界界", "$x^2$"]


def star(*places: tuple[float, float, float], names: list[str] | None = None) -> FrameTree:
    """Return a tree whose frames hang from one root at these places."""
    tree = FrameTree()
    tree.add_root("map")
    for number, place in enumerate(places):
        tree.add("map", names[number] if names else f"f{number}", Transform.of(*place, 0.0, 0.0, 0.0, 1.0))
    return tree


ODD = {
    "one frame": star(),
    "one point": star((0, 0, 0), (0, 0, 0)),
    "huge beside tiny": star((1e9, 0, 0), (1e-3, 0, 0)),
    "beyond squares": star((1e300, 0, 0), (1, 0, 0)),
    "tiny": star((1e-300, 0, 0)),
    "a line along the eye": star((0, 0, 1e6)),
    "hostile names": star(*((k, k % 2, 0) for k in range(len(NAMES))), names=NAMES),
}


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
def test_everything_lies_inside_the_picture_and_no_name_over_another(name: str, eye: str) -> None:
    flat = Projection(FrameScene(frametool.load(ROOT / "examples" / name)), SIZE, EYES[eye])
    labels, _ = placed_names(flat)
    for frame in flat.poses:
        x, y, _ = flat.origins[frame]
        assert SIZE.margin - 1e-6 <= x <= WIDTH - SIZE.margin + 1e-6
        assert SIZE.margin - 1e-6 <= y <= HEIGHT - SIZE.margin + 1e-6
    for a, b in itertools.combinations([box for _, _, box, _ in labels], 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def test_the_eye_in_front_sees_y_to_the_right_and_z_up() -> None:
    flat = Projection(FrameScene(star((0, 1, 0), (0, 0, 1), (1, 0, 0))), SIZE, EYES["front"])
    middle, y, z, x = (flat.origins[name] for name in ("map", "f0", "f1", "f2"))
    assert (y.x > middle.x, y.y == pytest.approx(middle.y)) == (True, True)
    assert (z.y < middle.y, z.x == pytest.approx(middle.x)) == (True, True)
    assert x.depth == pytest.approx(1.0)


def test_the_eye_above_sees_x_to_the_right_and_y_up() -> None:
    flat = Projection(FrameScene(star((1, 0, 0), (0, 1, 0))), SIZE, EYES["top"])
    middle, x, y = (flat.origins[name] for name in ("map", "f0", "f1"))
    assert (x.x > middle.x, x.y == pytest.approx(middle.y)) == (True, True)
    assert (y.y < middle.y, y.x == pytest.approx(middle.x)) == (True, True)


@pytest.mark.parametrize("name", ODD)
def test_an_odd_tree_is_drawn_in_every_form(name: str) -> None:
    scene = FrameScene(ODD[name])
    text = write_svg(still_picture(scene, title=name))
    ET.fromstring(text)  # noqa: S314 - our own
    assert not re.search(r"\b(nan|inf)\b", text)
    for columns, lines in ((80, 24), (200, 60), (20, 4), (1, 1)):
        picture = terminal_text(scene, columns, lines).splitlines()
        assert len(picture) == max(lines, 4)
        assert max(map(len, picture)) <= max(columns, 20)
        assert "\x1b" not in "".join(picture)


def test_hostile_names_are_text_in_the_svg() -> None:
    root = ET.fromstring(write_svg(still_picture(FrameScene(ODD["hostile names"]), title="</title><script>")))  # noqa: S314 - our own
    assert root.findall(f".//{SVG}script") == []
    titles = {title.text for title in root.iter(f"{SVG}title")}
    assert {"</text><script>", "a&b", "\\x1b[31m"} <= titles


def test_the_svg_is_light_and_dark_and_shows_each_frame_with_its_axes() -> None:
    tree = frametool.load(ROOT / "examples" / "robot.yaml")
    text = write_svg(still_picture(FrameScene(tree), title="robot"))
    root = ET.fromstring(text)  # noqa: S314 - our own
    kinds = [path.get("class") for path in root.iter(f"{SVG}path")]
    assert [kinds.count(f"{axis}-line") for axis in "xyz"] == [len(tree.frames) + 1] * 3
    assert len(root.findall(f".//{SVG}path[@stroke-dasharray]")) == len(tree.frames) - 1
    assert len(root.findall(f".//{SVG}circle")) == len(tree.frames)
    assert "prefers-color-scheme: dark" in text
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")


def test_a_picture_says_when_most_frames_lie_in_a_small_spot() -> None:
    tree = frametool.load(ROOT / "examples" / "robot.yaml")
    (note,) = still_picture(FrameScene(tree)).notes
    assert note.startswith("14 of 17 frames lie in a small spot")
    assert still_picture(FrameScene(tree, below="base_link")).notes == []


def test_placing_names_looks_at_twice_as_much_for_twice_as_many(monkeypatch: pytest.MonkeyPatch) -> None:
    counts, label = [], Projection.label
    looked = [0]

    def counted(*arguments: Any) -> Any:
        looked[0] += 1
        return label(*arguments)

    monkeypatch.setattr(Projection, "label", counted)
    for frames in (500, 1000):
        looked[0] = 0
        tree = star(*((math.cos(k * k), math.sin(k * k), k % 7 / 7) for k in range(frames)))
        still_picture(FrameScene(tree))
        counts.append(looked[0])
    assert counts[1] < 2.6 * counts[0]


@pytest.mark.parametrize(("length", "expected"), [(1.0, 1.0), (1.6, 2.0), (4.0, 5.0), (9.0, 10.0), (0.03, 0.02), (3e-7, 2e-7)])
def test_a_round_length_is_one_two_or_five(length: float, expected: float) -> None:
    assert rounded(length) == pytest.approx(expected)


def test_shapes_of_a_frame_come_farthest_first() -> None:
    shapes = still_picture(FrameScene(star((0, 0, 0), (2, 0, 0)))).shapes
    dots = [shape for shape in shapes if shape.kind == "circle"]
    assert [dot.text for dot in dots][-1] == "f1"
    assert {shape.kind for shape in shapes} == {"circle", "path", "text"}


@pytest.mark.parametrize("tree", ["robot.yaml", "drive.yaml", "hostile"])
def test_a_png_needs_matplotlib_and_says_so(tree: str) -> None:
    scene = FrameScene(ODD["hostile names"] if tree == "hostile" else frametool.load(ROOT / "examples" / tree))
    if find_spec("matplotlib") is None:
        with pytest.raises(FileProblem, match=r"pip install 'frametool\[plot\]'"):
            write_png(still_picture(scene))
    else:
        data = write_png(still_picture(scene))
        assert data.startswith(b"\x89PNG")
        assert (int.from_bytes(data[16:20]), int.from_bytes(data[20:24])) == (WIDTH, HEIGHT)


# --- the terminal ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("columns", "lines"), [(80, 24), (200, 60), (40, 12)])
def test_a_terminal_shows_names_axes_and_how_long_a_metre_is(columns: int, lines: int) -> None:
    scene = FrameScene(frametool.load(ROOT / "examples" / "robot.yaml"), below="base_link")
    text = terminal_text(scene, columns, lines)
    assert "tool" in text
    assert any(0x2800 < ord(letter) < 0x2900 for letter in text)
    assert " m  in base_link" in text.splitlines()[-1]
    styles = {style for line in terminal_lines(scene, columns, lines) for _, style in line}
    assert {"red", "green", "blue", "bold"} <= styles


def test_names_in_a_terminal_do_not_collide() -> None:
    tree = star(*((k / 10, 0, 0) for k in range(10)), names=[f"frame_{k}" for k in range(10)])
    text = terminal_text(FrameScene(tree), 80, 24)
    whole = [name for name in tree.frames if name in text]
    hidden = [part for part in text.splitlines()[-1].split(", ") if "hidden" in part]
    assert len(whole) + (int(hidden[0].split()[0]) if hidden else 0) >= 10


def test_a_wide_letter_takes_two_cells() -> None:
    text = terminal_text(FrameScene(star((1, 0, 0), names=["界界"])), 80, 24)
    line = next(line for line in text.splitlines() if "界" in line)
    assert "界界" in line


def test_the_last_dot_colours_a_cell() -> None:
    canvas = Canvas(1, 3)
    canvas.mark(0, 0, "grey")
    canvas.mark(1, 0, "red")
    canvas.mark(6, 0, "out")
    canvas.mark(-1, 0, "out")
    assert canvas.runs(0, {}) == [("⠉", "red"), ("  ", "")]


def test_a_tree_of_two_thousand_frames_fits_a_terminal(tmp_path: Path) -> None:
    grid = [{"name": f"f{k}", "parent": f"f{(k - 1) // 3}" if k else "map", "xyz": [k % 7, k % 11, k % 5]} for k in range(2000)]
    (tmp_path / "many.json").write_text(json.dumps({"frames": [{"name": "map"}, *grid]}))
    tree = frametool.load(tmp_path / "many.json")
    assert "names hidden" in terminal_text(FrameScene(tree), 100, 30)
