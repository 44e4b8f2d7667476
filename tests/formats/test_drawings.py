"""Drawings of frames without poses, graphviz of view_frames and the listing of tf2: shown, and never looked up in."""

from __future__ import annotations

from time import process_time
from typing import TYPE_CHECKING, Any

import pytest

from frametool.errors import FormatError
from frametool.formats.load import FrameFile, load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

STATIC = "Average rate: 10000.0\\nBuffer length: 0.0\\nMost recent transform: 0.0\\nOldest transform: 0.0\\n"
ROS = f"""digraph G {{
"odom" -> "base link"[label=" Broadcaster: default_authority\\nAverage rate: 30.212\\nBuffer length: 4.7\\n\
Most recent transform: 1784457131.670903\\nOldest transform: 1784457126.970793\\n"];
"base link" -> "laser"[label=" Broadcaster: default_authority\\n{STATIC}"];
"base link" -> "tag"[label=" Broadcaster: a\\n{STATIC.replace("transform: 0.0", "transform: 12.5")}"];
edge [style=invis];
 subgraph cluster_legend {{ style=bold; color=black; label ="view_frames Result";
"Recorded at time: 1784457132.1"[ shape=plaintext ] ;
}}->"odom";
}}"""
SHOWN = """\
odom
└ base link  30.21 Hz over 4.7 s
  ├ laser    static
  └ tag      one at 12.5 s
"""
OLD = """digraph G {
"/world" -> "/turtle1"[label="Broadcaster: /a\\nAverage rate: 62.7 Hz\\nMost recent transform: 5.9 ( 0.1 sec old)\\n\
Buffer length: 4.9 sec\\n"];
}"""
LISTING = """\
laser:
  parent: 'base'
  broadcaster: 'default_authority'
  rate: 10000.000
  most_recent_transform: 0.000
  oldest_transform: 0.000
  buffer_length: 0.000
base:
  parent: 'odom'
  broadcaster: 'default_authority'
  rate: 20.500
  most_recent_transform: 104.000
  oldest_transform: 100.000
  buffer_length: 4.000
"""
REMEDY = "no poses in it (frametool tree shows the frames); give what it was made from, as a bag of /tf, /tf_static"


@pytest.mark.parametrize(
    ("name", "text", "shown"),
    [
        ("frames.gv", ROS, SHOWN),
        ("frames.txt", f"\ufeff// of the robot\n{ROS}\n", SHOWN),
        ("frames.gv", OLD, "world\n└ turtle1  62.7 Hz over 4.9 s\n"),
        ("frames.yaml", LISTING, "odom\n└ base     20.5 Hz over 4 s\n  └ laser  static\n"),
        ("a.dot", "digraph { map->odom->base; map -> tag [color=red] }", "map\n├ odom\n│ └ base\n└ tag\n"),
        ("a.dot", 'digraph {\n"a \\"b\\"";\n"a \\"b\\"" -> c\n}', 'a "b"\n└ c\n'),
    ],
)
def test_tree_shows_names_and_rates_and_says_that_there_are_no_poses(
    run: Callable[..., Any], name: str, text: str, shown: str
) -> None:
    done = run("tree", name, files={name: text})
    assert (done.status, done.out) == (0, shown)
    assert " no poses" not in done.err


def test_standard_input_is_drawn_too_and_a_form_is_told(run: Callable[..., Any]) -> None:
    assert run("tree", "-", stdin=ROS).out == SHOWN
    assert run("tree", "--in", "dot", "-", "--quiet", stdin=ROS).out == SHOWN


@pytest.mark.parametrize("form", ["yaml", "dot", "mermaid", "tf2", "csv", "ros2", "urdf"])
def test_no_pose_is_made_up_in_any_form(run: Callable[..., Any], form: str) -> None:
    done = run("tree", "f.gv", "--quiet", "-f", form, files={"f.gv": ROS})
    assert (done.status, done.out) == (1, "")
    assert done.err == f"frametool: f.gv has no poses to write as {form}; -f text shows its frames\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ("lookup", "f.gv", "odom", "laser"),
        ("apply", "f.gv", "odom", "laser", "1", "2", "3"),
        ("check", "f.gv"),
        ("monitor", "f.gv"),
        ("view", "f.gv"),
        ("diff", "f.gv", "f.gv"),
        ("convert", "f.gv"),
        ("convert", "-i", "f.gv"),
        ("tree", "a.yaml", "--with", "f.gv"),
        ("tree", "f.gv", "--with", "a.yaml"),
    ],
)
@pytest.mark.parametrize("text", [ROS, LISTING])
def test_nothing_else_takes_a_drawing_for_poses(run: Callable[..., Any], arguments: tuple[str, ...], text: str) -> None:
    done = run(*arguments, files={"f.gv": text, "a.yaml": "frames: {odom: {a: {xyz: [1, 2, 3]}}}"})
    assert done.out == ""
    assert done.status in (1, 2)
    assert REMEDY in done.err
    assert len(done.err.splitlines()) == 1
    assert len(done.err) < 200


def test_python_is_refused_too(tmp_path: Path) -> None:
    (tmp_path / "f.gv").write_text(ROS)
    with pytest.raises(FormatError, match="no poses in it"):
        load(tmp_path / "f.gv")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('digraph G { "No tf data received" }', "f.gv: no frames in it"),
        (ROS[:200], "f.gv: the drawing ends before its last }; is the file whole?"),
        ("digraph {\na -> b;\nb -> a;\n}", "f.gv:3: frames form a cycle: b <- a <- b"),
        ("digraph {\na -> b;\nc -> b;\n}", "f.gv:3: frame 'b' has two parents: 'a' (line 2) and 'c' (line 3)"),
    ],
)
def test_what_is_no_tree_is_named(run: Callable[..., Any], text: str, message: str) -> None:
    done = run("tree", "f.gv", files={"f.gv": text})
    assert (done.status, done.out, done.err) == (1, "", f"frametool: {message}\n")


def test_what_we_draw_ourselves_is_shown_with_its_labels(run: Callable[..., Any]) -> None:
    drawn = run("tree", "-", "-f", "dot", stdin="frames: {base: {lidar: {xyz: [1, 2, 3]}}}").out
    assert run("tree", "-", stdin=drawn).out == "base\n└ lidar  xyz 1 2 3 rpy_deg 0 0 0\n"


def test_a_drawing_of_many_edges_is_read_in_one_pass(tmp_path: Path) -> None:
    count = 50_000
    path = tmp_path / "frames.gv"
    nodes = "".join(f'"f{at}";\n' for at in range(count))
    arrows = "".join(f'"f0" -> "f{at}"[label="Broadcaster: /b\\nAverage rate: 10\\n"];\n' for at in range(1, count))
    path.write_text(f"digraph G {{\n{nodes}\n\n{arrows}}}\n")
    begin = process_time()
    lines = [edge.line for edge in FrameFile(path, reads=("drawing",)).edges()]
    assert lines == [*range(2, count + 2), *range(count + 4, 2 * count + 3)]
    assert process_time() - begin < 10
