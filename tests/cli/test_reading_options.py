"""The options about files of frames: which file each is about, what does not fit, what the shell completes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from frametool.cli.commands import group
from frametool.formats.table import FORMATS, Format, readers

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

ROBOT = """<robot name="r"><link name="base"/><link name="arm"/>
<joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>
"""
TREE = "frames: {base: {lidar: {xyz: [1, 0, 0]}}}\n"
FILES = {
    "r.urdf": ROBOT, "r.txt": ROBOT, "t.yaml": TREE, "t.txt": TREE, "more.txt": TREE.replace("lidar", "other"),
    "points.csv": "x,y,z\n1,2,3\n", "names.csv": "source\nlidar\n",
    "drive.yaml": "frames: [{name: base, parent: odom, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0]}]}]\n",
}  # fmt: skip
COMMANDS = {
    "tree": ("t.yaml",), "check": ("t.yaml",), "monitor": ("t.yaml",), "static": ("t.yaml",), "view": ("t.yaml",),
    "lookup": ("t.yaml", "base", "lidar"), "apply": ("t.yaml", "base", "lidar", "1", "2", "3"),
    "echo": ("drive.yaml", "odom", "base"), "diff": ("t.yaml", "t.yaml"),
}  # fmt: skip


def out(run: Run, *arguments: str) -> str:
    found = run(*arguments, files=dict(FILES))
    assert found.status == 0, found.err
    return found.out


# --- --in: which file it is about ---


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_that_reads_frames_is_told_the_form_of_its_file(run: Run, name: str) -> None:
    assert run(name, *COMMANDS[name], "--in", "yaml", files=dict(FILES)).status == 0
    refused = run(name, *COMMANDS[name], "--in", "urdf")
    assert refused.status == (2 if name == "diff" else 1)
    assert "not XML" in refused.err + refused.out


@pytest.mark.parametrize("name", COMMANDS)
def test_a_form_from_which_no_frames_are_read_is_refused(run: Run, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FORMATS, "columns", Format("a toy", reads=("rows",)))
    found = run(name, *COMMANDS[name], "--in", "columns", files=dict(FILES))
    assert found.status == 2
    assert "--in columns: no frames are read from that; `frametool formats` lists what is" in found.err


def test_forms_are_taken_in_the_order_of_the_files(run: Run) -> None:
    looked_up = ("lookup", "r.txt", "--with", "t.txt", "arm", "lidar", "-f", "json", "--quiet")
    assert json.loads(out(run, *looked_up, "--in", "urdf", "--in", "yaml"))["xyz"] == [1.0, 0.0, 0.0]
    assert json.loads(out(run, *looked_up, "--in", "urdf"))["xyz"] == [1.0, 0.0, 0.0]  # the second by its content
    assert "r.txt:" in run(*looked_up, "--in", "yaml", "--in", "urdf").err


def test_of_two_sides_that_are_compared_one_form_is_that_of_both(run: Run) -> None:
    assert run("diff", "t.txt", "more.txt", "--in", "yaml", files=dict(FILES)).status == 1
    assert run("diff", "r.txt", "t.txt", "--in", "urdf", "--in", "yaml").status == 1
    assert run("diff", "r.txt", "t.txt", "--in", "urdf").status == 2


@pytest.mark.parametrize("option", [("--in", "yaml"), ("--frames", "a,b")])
@pytest.mark.parametrize("name", ["tree", "lookup", "apply", "diff", "check"])
def test_an_option_that_is_given_more_often_than_there_are_files_is_refused(run: Run, name: str, option: tuple[str, str]) -> None:
    count = 3 if name == "diff" else 2
    found = run(name, *COMMANDS[name], *(option * count), files=dict(FILES))
    assert found.status == 2
    assert f"{option[0]} appears {count} times for {count - 1} file" in found.err


# --- --in beside a stream ---


def test_with_a_stream_the_form_of_rows_is_that_of_the_stream(run: Run) -> None:
    moved = ("apply", "r.txt", "base", "arm", "--quiet", "-i", "points.csv")
    for forms in (("csv",), ("urdf",), ("urdf", "csv"), ("csv", "urdf"), ()):
        told = [word for form in forms for word in ("--in", form)]
        assert out(run, *moved, *told) == "x,y,z\n1.0,2.0,3.0\n"


def test_of_two_forms_that_could_be_streamed_the_last_is_that_of_the_stream(run: Run) -> None:
    assert out(run, "apply", "t.txt", "base", "lidar", "-i", "points.csv", "--in", "yaml", "--in", "csv") == "x,y,z\n2.0,2.0,3.0\n"
    found = run("apply", "t.txt", "base", "lidar", "-i", "points.csv", "--in", "yaml")
    assert (found.status, "points.csv:1:1" in found.err) == (1, True)


def test_looked_up_rows_have_their_form_too(run: Run) -> None:
    looked_up = ("lookup", "t.txt", "base", "--source-column", "source", "-i", "names.csv")
    assert out(run, *looked_up, "--in", "csv").startswith("source,x,y,z")
    assert out(run, *looked_up, "--in", "yaml", "--in", "csv").startswith("source,x,y,z")
    assert "frames are looked up for the rows of a table, not of yaml" in run(*looked_up, "--in", "yaml").err


def test_without_a_stream_the_form_is_that_of_the_tree(run: Run) -> None:
    assert out(run, "apply", "t.txt", "base", "lidar", "1", "0", "0", "--in", "yaml", "-f", "csv").endswith("2.0,0.0,0.0\n")
    assert out(run, "apply", "t.txt", "base", "{frame: lidar, point: [1, 0, 0]}", "--in", "yaml", "-f", "csv").endswith("2.0,0.0,0.0\n")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("convert", "--in", "urdf"), "--in urdf is not streamed; streams are "),
        (("convert", "--in", "csv", "--in", "tsv", "-i", "points.csv"), "--in csv and --in tsv: there is one stream"),
        (("apply", "--transform", "{xyz: [1, 0, 0]}", "-i", "points.csv", "--in", "urdf"), "--in urdf is not streamed"),
        (("tree", "t.yaml", "--in", "yamll"), "no format 'yamll' is read (`frametool formats` lists all); did you mean 'yaml'?"),
        (("tree", "t.yaml", "--in", "xacro"), "is not supported: expand it: xacro FILE"),
        (("tree", "t.yaml", "--frames", "a,"), "'a,' is not names with commas between them"),
        (("tree", "t.yaml", "-j", "lift"), "--joint takes NAME=VALUE, found 'lift'"),
        (("tree", "t.yaml", "-j", "lift=1", "-j", "a=2", "-j", "lift=3"), "--joint 'lift' has two values, 1 and 3; leave one out"),
        (("tree", "t.yaml", "--direction", "up"), "'up' is not one of 'parent-from-child', 'child-from-parent'"),
    ],
)
def test_what_does_not_fit_is_misuse_in_one_line(run: Run, arguments: tuple[str, ...], said: str) -> None:
    found = run(*arguments, files=dict(FILES))
    assert (found.status, found.out) == (2, "")
    assert said in found.err
    assert found.err.count("\n") == 1


# --- the other options ---


@pytest.mark.parametrize("spelling", [("-j", "lift=0.5"), ("-jlift=0.5",), ("--joint", "lift=50cm"), ("--joint=lift=0.5",)])
def test_a_joint_is_set_in_every_spelling_of_its_option(run: Run, spelling: tuple[str, ...]) -> None:
    looked_up = ("lookup", "r.urdf", "base", "arm", *spelling, "-f", "json", "--quiet")
    assert json.loads(out(run, *looked_up))["xyz"] == [0.0, 0.0, 0.5]
    assert out(run, "apply", "r.urdf", "base", "arm", "1", "2", "-3", *spelling, "-f", "csv", "--quiet").endswith("1.0,2.0,-2.5\n")


def test_what_looks_like_a_negative_number_and_is_an_option_is_the_option(run: Run) -> None:
    for name, arguments in COMMANDS.items():
        assert "unexpected extra argument" not in run(name, *arguments, "-j", "a=1", files=dict(FILES)).err


def test_quiet_is_silent_on_what_a_file_was_taken_for(run: Run) -> None:
    said = run("tree", "r.urdf", files=dict(FILES)).err
    assert said == "frametool: r.urdf: 1 joint at 0 (--joint NAME=VALUE)\n"
    assert run("tree", "r.urdf", "--quiet").err == ""
    assert run("tree", "t.yaml").err == ""


def test_all_commands_that_read_frames_have_all_the_options() -> None:
    named = {"--in", "--topic", "--joint", "--joints", "--frames", "--direction", "--camera-axes", "--dh", "--stamps", "--quiet"}
    for name in COMMANDS:
        command = group.get_command(None, name)  # type: ignore[arg-type]
        assert command is not None
        assert named <= {spelling for parameter in command.params for spelling in parameter.opts}


# --- completion ---


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("tree --in ur", "urdf"),
        ("lookup t.yaml li", "lidar"),
        ("lookup --in yaml t.txt li", "lidar"),
        ("lookup -j lift=1 r.urdf ar", "arm"),
        ("apply t.yaml base li", "lidar"),
        ("diff t.yaml r.urdf --seen-from li", "lidar"),
        ("lookup t.yaml --fixed li", "lidar"),
        ("tree t.yaml --direction p", "parent-from-child"),
        ("formats sem", "semicolon"),
        ("formats mer", "mermaid"),
    ],
)
def test_forms_and_frames_are_completed(run: Run, monkeypatch: pytest.MonkeyPatch, words: str, offered: str) -> None:
    monkeypatch.setenv("_FRAMETOOL_COMPLETE", "words")
    found = run(f"frametool {words}", files=dict(FILES))
    assert offered in [line.split("\t")[1] for line in found.out.splitlines()]
    assert found.err == ""


def test_only_forms_that_are_read_are_offered_for_the_input(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_FRAMETOOL_COMPLETE", "words")
    offered = {line.split("\t")[1] for line in run("frametool tree --in ").out.splitlines()}
    assert offered == set(readers("tree", "records", "rows", "arrays", "joints", "drawing"))


# --- names of frames, what forms leave open ---

TUM = "0 1 2 3 0 0 0 1\n1 2 2 3 0 0 0 1\n"
OWN_NAMES = "stamp,parent,name,x,y,z,qx,qy,qz,qw\n0,a,b,0,0,0,0,0,0,1\n1,a,b,1,0,0,0,0,0,1\n"
CHAIN = "cam0:\n  T_cam_imu: [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
NO_NAMES = "stamp,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,1,0,0,0,0,0,1\n"


@pytest.mark.parametrize(
    ("files", "named", "frames", "told"),
    [
        (("r.urdf", "a.tum"), ("base,m",), ("base", "arm", "m"), ""),
        (("a.tum", "r.urdf"), ("base,m",), ("base", "arm", "m"), ""),
        (("r.urdf", "a.tum", "b.tum"), ("base,m", "base,n"), ("base", "arm", "m", "n"), ""),
        (("own.csv", "a.tum"), ("a,m",), ("a", "b", "m"), ""),
        (("r.urdf", "none.csv"), ("base,m",), ("base", "arm", "m"), ""),
        (("chain.yaml", "a.tum"), ("m,imu",), ("m", "imu", "cam0"), ""),
        (("chain.yaml", "a.tum"), ("arm", "m,arm"), ("m", "arm", "cam0"), ""),
        (("hand.yaml", "none.csv"), ("m,base",), ("m", "base", "lidar"), ""),
        (("chain.yaml",), ("arm",), ("arm", "cam0"), ""),
        (("r.urdf", "a.tum"), ("x,y", "base,m"), ("base", "arm", "m"), ""),
        (("own.csv",), ("x,y",), (), "--frames has no effect here"),
        (("none.csv",), ("x,y",), ("x", "y"), ""),
    ],
)  # fmt: skip
def test_names_of_frames_go_to_the_files_that_need_them(run: Run, files: tuple[str, ...], named: tuple[str, ...], frames: tuple[str, ...], told: str) -> None:
    texts = {**FILES, "a.tum": TUM, "b.tum": TUM, "own.csv": OWN_NAMES, "none.csv": NO_NAMES}
    texts |= {"chain.yaml": CHAIN, "hand.yaml": "lidar: {x: 1, y: 0, z: 0, yaw: 0}\n"}
    more = [word for file in files[1:] for word in ("--with", file)]
    done = run("tree", files[0], *more, *[word for each in named for word in ("--frames", each)], "-f", "json", files=texts)
    assert done.status == (2 if told else 0), done.err
    assert {frame for frame in frames if f'"name": "{frame}"' in done.out} == set(frames), done.out
    assert ("has no effect" in done.err) == bool(told)
    assert told in done.err


def test_names_of_frames_for_some_of_the_files_are_those_that_need_them(run: Run) -> None:
    texts = {**FILES, "a.tum": TUM}
    done = run("tree", "r.urdf", "--with", "a.tum", "--with", "t.yaml", "--frames", "a,b", "--frames", "c,d", files=texts)
    assert done.status == 2
    assert "--frames appears 2 times, 1 of the files need names" in done.err
