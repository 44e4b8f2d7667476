"""`frametool record` at its edges: what it refuses, and in which words; that it leaves nothing, and never its input."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("rosbags")
import make_recording
import make_trajectories
from recorded import SECOND, START, Maker, Sent, read, write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

STILL = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)
TREE = "{name: camera, parent: base, xyz: [1, 2, 3]}"
USAGE = "; `frametool record --help` shows the options"


def messages(form: str) -> list[Sent]:
    made = Maker(form)
    return [
        Sent("/tf_static", *made.transforms(("map", "base", STILL, START)), START),
        Sent("/pose", *made.pose("base", START, STILL), START + 1), Sent("/odd", "my_msgs/msg/Odd", b"1234", START + SECOND),
    ]  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Make run.bag, run.mcap and a folder of sqlite3, and a tree."""
    write(tmp_path / "run.bag", "bag", messages("bag"))
    write(tmp_path / "sqlite", "sqlite", messages("sqlite"))
    write(tmp_path / "made", "mcap", messages("mcap")).rename(tmp_path / "run.mcap")
    (tmp_path / "tree.yaml").write_text(TREE)
    return tmp_path


KINDS = "Odometry, Path, PointStamped, PoseArray, PoseStamped, PoseWithCovarianceStamped"
REFUSED = {
    ("run.mcap",): (2, f"record: give -o NEW.mcap or -f bag2 -o FOLDER{USAGE}"),
    ("run.bag",): (2, f"record: give -o NEW.bag{USAGE}"),
    ("run.mcap", "-f", "mcap"): (2, f"record: mcap is no text; give -o FILE{USAGE}"),
    ("run.mcap", "-f", "bag2", "-o", "-"): (2, f"record: bag2 is no text; give -o FOLDER{USAGE}"),
    ("run.mcap", "-o", "new"): (2, f"record: -o new names no format; give -o NEW.mcap or -f bag2 -o FOLDER{USAGE}"),
    ("run.mcap", "-o", "new.tum"): (2, f"record: -o new.tum names no format; give -o NEW.mcap or -f bag2 -o FOLDER{USAGE}"),
    ("run.mcap", "-o", "new.db3"): (2, f"record: -o new.db3: a ROS 2 bag is written as a folder of MCAP; give -f bag2 -o FOLDER{USAGE}"),
    ("run.mcap", "-o", "new.bag"): (2, f"record: run.mcap is copied as mcap or bag2, not as bag1; rosbags-convert --src run.mcap --dst new.bag makes that of it{USAGE}"),
    ("sqlite", "-f", "bag1", "-o", "new"): (2, f"record: sqlite is copied as mcap or bag2, not as bag1; rosbags-convert --src sqlite --dst new makes that of it{USAGE}"),
    ("run.bag", "-o", "new.mcap"): (2, f"record: run.bag is copied as a ROS 1 bag, not as mcap; rosbags-convert --src run.bag --dst new.mcap makes that of it{USAGE}"),
    ("run.mcap", "--replace", "-o", "new.mcap"): (2, f"record: --replace needs --with{USAGE}"),
    ("run.mcap", "--joint", "a=1", "-o", "new.mcap"): (2, f"record: --joint has no effect here{USAGE}"),
    ("run.mcap", "--in", "yaml", "-o", "new.mcap"): (2, f"record: --in has no effect here{USAGE}"),
    ("run.mcap", "--normalize", "-o", "new.mcap"): (2, f"record: --normalize has no effect here{USAGE}"),
    ("run.mcap", "--on-error", "skip", "-o", "new.mcap"): (2, f"record: --on-error has no effect here{USAGE}"),
    ("run.mcap", "--topic", "/pose", "-o", "new.mcap"): (2, f"record: --topic has no effect here{USAGE}"),
    ("run.mcap", "--topic", "/tf_static", "-o", "new.mcap"): (2, f"record: --topic has no effect here{USAGE}"),
    ("run.mcap", "--with", TREE, "--topic", "/pose", "-o", "new.mcap"): (2, f"record: --topic has no effect here{USAGE}"),
    ("run.mcap", "--into", "map", "-o", "new.mcap"): (2, "run.mcap: --into moves the messages of topics that are named; --topic /pose"),
    ("run.mcap", "--into", "map", "--topic", "/poze", "-o", "new.mcap"): (1, "run.mcap: no topic /poze; did you mean '/pose'? topics: /odd, /pose, /tf_static"),
    ("run.mcap", "--into", "map", "--topic", "/odd", "-o", "new.mcap"): (1, f"run.mcap: /odd holds my_msgs/msg/Odd; --into moves {KINDS}"),
    ("run.mcap", "--between", "2,1", "-o", "new.mcap"): (2, f"record: invalid value for '--between': 2 is after 1; START comes first{USAGE}"),
    ("run.mcap", "--between", "2", "-o", "new.mcap"): (2, f"record: invalid value for '--between': '2' is not START,STOP: two times with a comma between them{USAGE}"),
    ("run.mcap", "--force"): (2, f"record: --force needs --output{USAGE}"),
    ("tree.yaml", "-o", "new.mcap"): (1, "tree.yaml: YAML: trees, poses, documents parted by ---: no recording of messages; frametool tree, convert and lookup write one: -o NEW.mcap"),
    ("nope.mcap", "-o", "new.mcap"): (5, "nope.mcap: no such file or directory"),
    ("-", "-o", "new.mcap"): (5, "stdin: a recording cannot be read from a pipe; name its file"),
    ("run.mcap", "-o", "nope/new.mcap"): (5, "nope/new.mcap: no such file or directory"),
    ("sqlite", "-o", "sqlite/new.mcap"): (5, "sqlite/new.mcap: would change sqlite, which is read; give another name"),
    ("sqlite", "-f", "bag2", "-o", "sqlite", "--force"): (5, "sqlite: would change sqlite, which is read; give another name"),
    ("sqlite/sqlite.db3", "-f", "bag2", "-o", "sqlite", "--force"): (5, "sqlite: would change sqlite/sqlite.db3, which is read; give another name"),
    ("run.mcap", "-o", "./run.mcap", "--force"): (5, "./run.mcap: would change run.mcap, which is read; give another name"),
    ("run.mcap", "--with", "tree.yaml", "-o", "tree.yaml", "-f", "mcap", "--force"): (5, "tree.yaml: would change tree.yaml, which is read; give another name"),
    ("run.mcap", "-o", "run.bag", "-f", "mcap"): (2, f"record: -o run.bag is the name of bag1, -f says mcap; give -o NEW.mcap{USAGE}"),
}  # fmt: skip


@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
def test_what_is_refused_is_one_line_and_leaves_nothing(arguments: tuple[str, ...], folder: Path, run: Run) -> None:
    status, said = REFUSED[arguments]
    before = {each: each.read_bytes() for each in folder.rglob("*") if each.is_file()}
    done = run("record", *arguments)
    assert (done.status, done.out, done.err) == (status, "", f"frametool: {said.replace('PLACE', str(folder))}\n")
    assert {each: each.read_bytes() for each in folder.rglob("*") if each.is_file()} == before


@pytest.mark.parametrize(("link", "status"), [(os.symlink, 5), (os.link, 0)])  # the file of a hard link keeps its name
def test_a_link_to_the_recording_is_not_written_over(link: Callable[[str, str], None], status: int, folder: Path, run: Run) -> None:
    os.chdir(folder)
    link("run.mcap", "other.mcap")
    before = (folder / "run.mcap").read_bytes()
    assert run("record", "run.mcap", "--with", TREE, "-o", "other.mcap", "--force").status == status
    assert (folder / "run.mcap").read_bytes() == before


def test_without_the_extra_one_line_says_what_to_install(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    done = run("record", str(folder / "run.bag"), "--with", TREE, "-o", "new.bag")
    said = "bags are read with an extra; install it: pip install 'frametool[bag]'"
    assert (done.status, done.err) == (5, f"frametool: {folder / 'run.bag'}: {said}\n")


@pytest.mark.parametrize("command", ["tree run.mcap", "convert -i run.mcap -f csv", "compare run.mcap run.mcap", "record run.mcap -o new.mcap"])
def test_a_fresh_process_without_the_libraries_says_the_same(command: str, folder: Path) -> None:
    code = "import sys; sys.modules |= dict.fromkeys(('rosbags', 'mcap', 'zstandard')); from frametool.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", code, *command.split()], cwd=folder, capture_output=True, text=True, check=False)
    said = "run.mcap: bags are read with an extra; install it: pip install 'frametool[bag]'"
    assert (done.returncode, done.stdout, done.stderr) == (5, "", f"frametool: {said}\n")


@pytest.mark.parametrize("name", ["empty.mcap", "empty.bag", "empty.db3"])
def test_an_empty_file_is_named_as_that(name: str, run: Run) -> None:
    done = run("record", name, "-o", "new.bag" if name == "empty.bag" else "new.mcap", files={name: b""})
    assert (done.status, done.err) == (1, f"frametool: {name}: nothing in it: an empty file is not a bag\n")


def test_quiet_says_nothing(folder: Path, run: Run) -> None:
    done = run("record", str(folder / "run.mcap"), "--with", TREE, "--quiet", "-o", "new.mcap")
    assert (done.status, done.err) == (0, "")


def test_the_tree_may_be_of_any_form_and_several(folder: Path, run: Run) -> None:
    call = "static_transform_publisher 1 2 3 0 0 0 base lidar 100\n"
    done = run("record", str(folder / "run.mcap"), "--with", "tree.yaml", "--with", "calls.txt", "-o", "new.mcap", files={"calls.txt": call})
    assert done.status == 0, done.err
    assert done.err.splitlines()[-1] == f"frametool: {folder / 'run.mcap'}: added on /tf_static: base -> camera, base -> lidar"


def test_a_slash_before_the_frame_is_left_out(folder: Path, run: Run) -> None:
    done = run("record", str(folder / "run.mcap"), "--into", "/map", "--topic", "pose", "-o", "new.mcap")
    assert done.status == 0
    assert "frame '/map': the leading / is no part of a name and was left out" in done.err
    pose = next(each for each in read(folder / "new.mcap") if each.topic == "/pose")
    assert Maker("mcap").read(pose.kind, pose.data).header.frame_id == "map"


def test_covariances_of_a_tree_have_no_place_in_messages(folder: Path, run: Run) -> None:
    tree = "{name: camera, parent: base, xyz: [1, 2, 3], sigma: {xyz: 0.1}}"
    done = run("record", str(folder / "run.mcap"), "--with", tree, "-o", "new.mcap")
    assert done.err.startswith("frametool: warning: mcap: covariances left out\n")


def test_a_folder_without_a_suffix_is_a_bag_of_ros2_again(folder: Path, run: Run) -> None:
    done = run("record", str(folder / "sqlite"), "-o", "again")
    assert done.status == 0
    assert sorted(each.name for each in (folder / "again").iterdir()) == ["metadata.yaml", "recording.mcap"]
    assert run("record", str(folder / "sqlite"), "-o", "again", "--force").status == 0
    done = run("record", str(folder / "sqlite"), "--between", "1,2", "-o", "again")  # before anything is read
    assert (done.status, done.err) == (5, "frametool: again: exists; give --force to replace it\n")


def test_transforms_that_are_not_read_are_not_passed_over(run: Run, tmp_path: Path) -> None:
    import mcap_bytes as by_hand

    other = by_hand.whole(
        by_hand.header(""), by_hand.schema(1, "foxglove.FrameTransform", "protobuf", ""), by_hand.channel(1, 1, "/tf", "protobuf"),
        by_hand.message(1, b"", START, START),
    )  # fmt: skip
    old = by_hand.whole(
        by_hand.header("ros1"), by_hand.schema(1, "std_msgs/Int32", "ros1msg", "int32 data"), by_hand.channel(1, 1, "/a", "ros1"),
        by_hand.message(1, bytes(4), START, START),
    )  # fmt: skip
    for data, said in (
        (other, "/tf holds foxglove.FrameTransform in protobuf, which is only copied, not read"), (old, "/a holds std_msgs/msg/Int32 in ros1, which is only copied, not read"),
    ):  # fmt: skip
        done = run("record", "run.mcap", "--with", TREE, "-o", "new.mcap", files={"run.mcap": data})
        assert (done.status, done.err.splitlines()[-1]) == (1, f"frametool: run.mcap: {said}")
        assert run("record", "run.mcap", "--between", "0,1800000000", "-o", "new.mcap", "--quiet").status == 0
        (tmp_path / "new.mcap").unlink()


def test_frames_complete_from_the_recording(folder: Path) -> None:
    from click.shell_completion import ShellComplete

    from frametool.cli.commands import group

    complete = ShellComplete(group, {}, "frametool", "_FRAMETOOL_COMPLETE")
    found = complete.get_completions(["record", str(folder / "run.mcap"), "--into"], "")
    assert [each.value for each in found] == ["map", "base"]


def test_a_dot_is_the_tree_of_the_environment(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRAMETOOL_TREE", "tree.yaml")
    done = run("record", str(folder / "run.mcap"), "--with", ".", "-o", "new.mcap")
    assert (done.status, done.err) == (0, f"frametool: {folder / 'run.mcap'}: added on /tf_static: base -> camera\n")


def test_the_example_is_what_its_script_makes(tmp_path: Path) -> None:
    made, kept = (read(path) for path in (write(tmp_path / "run", "mcap", make_recording.messages()), make_trajectories.FOLDER / "run.mcap"))
    assert [(each.topic, each.kind, each.log_ns, len(each.data)) for each in made] == [(each.topic, each.kind, each.log_ns, len(each.data)) for each in kept]
    assert (make_trajectories.FOLDER / "run.mcap").stat().st_size < 100_000


def test_joints_without_a_value_are_not_made_static(folder: Path, run: Run) -> None:
    (folder / "arm.urdf").write_text(
        '<robot name="a"><link name="base"/><link name="arm"/><joint name="lift" type="prismatic"><parent link="base"/>'
        '<child link="arm"/><axis xyz="0 0 1"/><limit lower="0" upper="1"/></joint></robot>'
    )
    copy = ("record", f"{folder}/run.mcap", "--with", f"{folder}/arm.urdf", "-o", f"{folder}/new.mcap")
    said = run(*copy)
    assert said.status == 2
    assert said.err.endswith("\nframetool: joints without a value would be static: lift; --joint NAME=VALUE gives it\n")
    assert run(*copy, "-j", "lift=0.5").status == 0
    assert "base -> arm" in run("record", f"{folder}/new.mcap", "--with", f"{folder}/arm.urdf", "-j", "lift=0", "-o", f"{folder}/x.mcap").err
