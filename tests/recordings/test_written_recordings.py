"""Recordings written: what goes in comes out to the bit, by frametool and by the library; whole or not at all."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("rosbags")
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag1, QosDurability, QosReliability

from frametool.errors import ValueInvalid
from frametool.recordings import write as recordings
from frametool.recordings.write import KINDS, filled, serialised

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

FORMS = {"mcap": "run.mcap", "bag1": "run.bag", "bag2": "run"}
TREE = """
frames:
  - name: base_link
    parent: map
    samples:
      - {stamp_ns: 1700000000123456789, xyz: [1, 2, 3], quaternion: {x: 0.0, y: 0.0, z: 0.6, w: 0.8}}
      - {stamp_ns: 1700000001000000001, xyz: [0.1, 1e-300, -3], quaternion: {x: 0.5, y: 0.5, z: -0.5, w: 0.5}}
  - {name: wheel, parent: map, samples: [{stamp_ns: 1700000001000000001, xyz: [7, 0, 0]}, {stamp_ns: 1700000002000000000, xyz: [8, 0, 0]}]}
  - {name: shelf, parent: map, xyz: [0.1, 0.2, 0.30000000000000004], rpy_deg: [10, 20, 30]}
"""
EXAMPLES = Path(__file__).parent.parent.parent / "examples"


def messages(path: Path) -> list[tuple[str, int, Any]]:
    with AnyReader([path]) as reader:
        return [(to.topic, stamp, reader.deserialize(data, to.msgtype)) for to, stamp, data in reader.messages()]


def rows(count: int = 50) -> tuple[list[int], list[list[float]]]:
    """Stamps of all digits, positions of all sizes, unit quaternions with w >= 0."""
    random = np.random.default_rng(26)
    turn = random.normal(size=(count, 4))
    turn /= np.linalg.norm(turn, axis=1)[:, None]
    turn *= np.sign(turn[:, 3:])
    where = random.normal(size=(count, 3)) * 10.0 ** random.integers(-300, 300, (count, 3))
    stamps = np.sort(random.integers(0, 2**31 * 10**9, count))
    return stamps.tolist(), np.hstack([where, turn]).tolist()


def as_tum(stamps: list[int], poses: list[list[float]]) -> str:
    return "".join(f"{stamp // 10**9}.{stamp % 10**9:09d} {' '.join(map(repr, pose))}\n" for stamp, pose in zip(stamps, poses, strict=True))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("source", ["tree", "robot.yaml", "drive.yaml", "site.yaml", "arm.urdf", "camchain.yaml"])
def test_a_tree_is_read_back_to_the_same_bits_and_nanoseconds(run: Run, source: str, form: str) -> None:
    text = TREE if source == "tree" else (EXAMPLES / source).read_text()
    name = "tree.yaml" if source == "tree" else source
    assert run("tree", name, "-f", form, "-o", FORMS[form], files={name: text}).status == 0
    given = run("tree", name, "-f", "yaml", "--quiet").out.splitlines()
    found = run("tree", FORMS[form], "-f", "yaml").out.splitlines()
    assert sorted(found) == sorted(given)
    assert run("diff", name, FORMS[form], "--quiet").status == 0


@pytest.mark.parametrize("form", FORMS)
def test_a_trajectory_is_read_back_to_the_same_bits_and_nanoseconds(run: Run, tmp_path: Path, form: str) -> None:
    stamps, poses = rows()
    given = as_tum(stamps, poses)
    done = run("convert", "-i", "walk.tum", "-f", form, "-o", FORMS[form], "--quiet", files={"walk.tum": given})
    assert done.err == f"frametool: warning: {form}: nothing names the frame that the rows are seen from; 'world' is written\n"
    read = [(stamp, each) for _, stamp, each in messages(tmp_path / FORMS[form])]
    assert [stamp for stamp, _ in read] == stamps
    assert [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for _, each in read] == stamps
    numbers = [[getattr(part, axis) for part, axes in ((each.pose.position, "xyz"), (each.pose.orientation, "xyzw")) for axis in axes] for _, each in read]
    assert numbers == poses
    assert run("convert", "-i", FORMS[form], "-f", "tum").out == given


def test_every_form_of_input_becomes_the_same_recording(run: Run, tmp_path: Path) -> None:
    stamps, poses = rows(8)
    run("convert", "-i", "walk.tum", "-o", "tum.mcap", files={"walk.tum": as_tum(stamps, poses)})
    for form in ("csv", "json", "yaml", "euroc"):
        run("convert", "-i", "walk.tum", "-f", form, "-o", f"walk.{form}", "--force")
        assert run("convert", "-i", f"walk.{form}", "-o", f"{form}.mcap").status == 0, form
        assert (tmp_path / f"{form}.mcap").read_bytes() == (tmp_path / "tum.mcap").read_bytes(), form


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", [kind for kind in KINDS if kind != "path"])
@pytest.mark.parametrize("parent", ["", "m", "map", "m\u00fcnchen", "a/very_long_frame"])
def test_bytes_that_are_filled_in_are_those_of_the_library(form: str, name: str, parent: str) -> None:
    random = np.random.default_rng(1)
    kind = KINDS[name]
    numbers, stamps = random.normal(size=(5, kind.numbers)), np.array([0, 1, 10**9 - 1, 2**31 * 10**9 - 1, 5 * 10**9])
    made = filled(kind, form, (parent, "child"), stamps, numbers)
    wanted = [serialised(kind, form, [(int(stamp), (parent, "child"), row)]) for stamp, row in zip(stamps, numbers.tolist(), strict=True)]
    assert made == wanted


def test_stamps_before_1970_have_a_place_in_ros_2_only(run: Run, tmp_path: Path) -> None:
    early = as_tum([0], [[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]]).replace("0.000000000", "-1.500000000")
    assert run("convert", "-i", "w.tum", "-o", "w.mcap", files={"w.tum": early}).status == 0
    ((_, logged, message),) = messages(tmp_path / "w.mcap")
    assert (logged, message.header.stamp.sec, message.header.stamp.nanosec) == (0, -2, 500_000_000)
    done = run("convert", "-i", "w.tum", "-o", "w.bag")
    assert (done.status, (tmp_path / "w.bag").exists()) == (1, False)
    assert done.err.endswith("stamp -1.500000000 does not fit in bag1, whose seconds are 0 .. 4294967295\n")
    late = as_tum([2**31 * 10**9], [[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]])
    assert run("convert", "-i", "l.tum", "-o", "l.bag", files={"l.tum": late}).status == 0
    done = run("convert", "-i", "l.tum", "-o", "l.mcap")
    assert done.err.endswith("stamp 2147483648.000000000 does not fit in mcap, whose seconds are -2147483648 .. 2147483647\n")


def test_a_tree_of_2038_and_later_has_a_place_in_ros_1(run: Run) -> None:
    stamps = (2_147_483_648_000_000_001, 4_294_967_295_999_999_999)
    samples = ", ".join(f"{{stamp_ns: {stamp}, xyz: [1, 2, 3]}}" for stamp in stamps)
    files = {"t.yaml": f"frames: [{{name: b, parent: a, samples: [{samples}]}}]\n"}
    assert run("tree", "t.yaml", "-o", "t.bag", files=files).err == ""
    back = run("tree", "t.bag", "-f", "yaml", "--quiet").out
    assert back == run("tree", "t.yaml", "-f", "yaml", "--quiet").out


def test_rows_whose_stamps_go_back_keep_their_order_and_are_logged_in_order(run: Run, tmp_path: Path) -> None:
    text = as_tum([5, 3, 9], [[float(at), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] for at in range(3)])
    run("convert", "-i", "w.tum", "-o", "w.mcap", files={"w.tum": text})
    assert [(logged, each.header.stamp.nanosec) for _, logged, each in messages(tmp_path / "w.mcap")] == [(5, 5), (5, 3), (9, 9)]
    assert run("convert", "-i", "w.mcap", "-f", "tum").out == text


@pytest.mark.parametrize("form", FORMS)
def test_what_stands_is_latched_and_first_and_what_moves_is_one_message_a_stamp(run: Run, tmp_path: Path, form: str) -> None:
    run("tree", "t.yaml", "-f", form, "-o", FORMS[form], files={"t.yaml": TREE})
    found = [(topic, logged, [each.child_frame_id for each in message.transforms]) for topic, logged, message in messages(tmp_path / FORMS[form])]
    assert found == [
        ("/tf_static", 1700000000123456789, ["shelf"]), ("/tf", 1700000000123456789, ["base_link"]),
        ("/tf", 1700000001000000001, ["base_link", "wheel"]), ("/tf", 1700000002000000000, ["wheel"]),
    ]
    with AnyReader([tmp_path / FORMS[form]]) as reader:
        for connection in reader.connections:
            stays, said = connection.topic == "/tf_static", connection.ext
            if isinstance(said, ConnectionExtRosbag1):
                assert said.latching == int(stays)
            else:
                offered = [(each.durability, each.reliability) for each in said.offered_qos_profiles]
                assert offered == [(QosDurability.TRANSIENT_LOCAL, QosReliability.RELIABLE)] * stays


def test_a_tree_without_stamps_is_at_0(run: Run, tmp_path: Path) -> None:
    run("tree", "t.yaml", "-o", "t.bag", files={"t.yaml": "{frames: {map: {base: {xyz: [1, 2, 3]}, arm: {xyz: [0, 0, 1]}}}}"})
    ((topic, logged, message),) = messages(tmp_path / "t.bag")
    assert (topic, logged, [each.child_frame_id for each in message.transforms]) == ("/tf_static", 0, ["base", "arm"])


@pytest.mark.parametrize("form", FORMS)
def test_two_runs_write_the_same_bytes(run: Run, tmp_path: Path, form: str) -> None:
    text = as_tum(*rows(4))
    for name in ("a", "b"):
        run("convert", "-i", "w.tum", "--frames", "map,base", "-f", form, "-o", name, files={"w.tum": text})
    if form == "bag2":
        assert sorted(each.name for each in (tmp_path / "a").iterdir()) == ["metadata.yaml", "recording.mcap"]
        assert all(each.read_bytes() == (tmp_path / "b" / each.name).read_bytes() for each in (tmp_path / "a").iterdir())
    else:
        assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize(("options", "topics"), [
    ([], {"/pose"}), (["--frames", "map,base"], {"/pose", "/tf"}), (["--messages", "path"], {"/path"}),
    (["--messages", "tf", "--frames", "map,base"], {"/tf"}), (["--messages", "pose,path"], {"/pose", "/path"}),
    (["--topic-out", "/robot/pose"], {"/robot/pose"}), (["--topic-out", "/p", "--frames", "map,base"], {"/p"}),
])  # fmt: skip
def test_options_choose_the_messages(run: Run, tmp_path: Path, options: list[str], topics: set[str]) -> None:
    assert run("convert", "-i", "w.tum", "-o", "w.mcap", *options, files={"w.tum": as_tum(*rows(3))}).status == 0
    assert {topic for topic, _, _ in messages(tmp_path / "w.mcap")} == topics


def test_a_path_is_one_message_at_the_last_stamp(run: Run, tmp_path: Path) -> None:
    stamps, poses = rows(3)
    run("convert", "-i", "w.tum", "-o", "w.bag", "--messages", "path", "--frames", "map,base", files={"w.tum": as_tum(stamps, poses)})
    ((_, logged, path),) = messages(tmp_path / "w.bag")
    assert logged == stamps[-1]
    assert [(each.header.frame_id, each.pose.position.x) for each in path.poses] == [("map", pose[0]) for pose in poses]


def test_places_become_fixes_with_the_numbers_that_were_read(run: Run, tmp_path: Path) -> None:
    text = "t,lat,lon,alt\n5,48.1003346,11.5004189,521.4\n6,-33.1,-70.2,0.1\n"
    files = {"g.csv": text, "g.jsonl": '{"t": 5, "lat": 48.1003346, "lon": 11.5004189, "alt": 521.4}\n{"t": 6, "lat": -33.1, "lon": -70.2, "alt": 0.1}\n'}
    assert run("convert", "-i", "g.csv", "-o", "csv.mcap", files=files).err == ""
    for given, made in (("g.jsonl", "json.mcap"), ("csv.mcap", "again.mcap")):
        assert run("convert", "-i", given, "-o", made).status == 0
        assert (tmp_path / made).read_bytes() == (tmp_path / "csv.mcap").read_bytes()
    found = [(topic, each.latitude, each.longitude, each.altitude, each.position_covariance_type) for topic, _, each in messages(tmp_path / "csv.mcap")]
    assert found == [("/fix", 48.1003346, 11.5004189, 521.4, 0), ("/fix", -33.1, -70.2, 0.1, 0)]
    assert run("convert", "-i", "g.csv", "-o", "p.mcap", "--messages", "point").status == 0
    assert {topic for topic, _, _ in messages(tmp_path / "p.mcap")} == {"/point"}


def test_points_with_stamps_become_points_of_their_frame(run: Run, tmp_path: Path) -> None:
    lines = '{"t": 1.5, "frame": "map", "point": [1, 2, 3]}\n{"t": 2.5, "frame": "odom", "point": [4, 5, 6]}\n'
    assert run("convert", "-i", "p.jsonl", "-o", "p.bag", files={"p.jsonl": lines}).err == ""
    assert [(topic, each.header.frame_id, each.point.x) for topic, _, each in messages(tmp_path / "p.bag")] == [("/point", "map", 1.0), ("/point", "odom", 4.0)]


@pytest.mark.parametrize(("arguments", "status", "said"), [
    (["convert", "-i", "w.tum", "-f", "mcap"], 2, "convert: mcap is no text; give -o FILE; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-f", "bag2", "-o", "-"], 2, "convert: bag2 is no text; give -o FOLDER; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-o", "w.db3"], 2, "convert: -o w.db3: a ROS 2 bag is written as a folder of MCAP; give -f bag2 -o FOLDER; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-f", "csv", "--frames", "a,b"], 2, "convert: --frames has no effect here; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-f", "csv", "--messages", "pose"], 2, "convert: --messages has no effect here; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--frames", "a"], 2, "convert: invalid value for '--frames': 'a' is not WORLD,BODY, different names; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--precision", "3"], 2, "convert: --precision has no effect here; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--messages", "psoe"], 2, "convert: invalid value for '--messages': 'psoe' is none of pose, tf, path, point, fix; did you mean 'pose'? `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--messages", "point"], 1, "--messages point is not made of poses; these are pose, tf, path, fix\n"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--messages", "tf"], 1, "--messages tf needs the names of both frames; `convert --frames A,B` says them\n"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--messages", "pose,path", "--topic-out", "/a"], 1, "there are 2 topics (pose, path); /a names one\n"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--to", "rpy"], 1, "mcap writes rotations in its own way; leave --to out\n"),
    (["convert", "-i", "n.csv", "-o", "w.mcap"], 1, "mcap: the rows have no stamps, and messages need them; `convert --stamps FILE` says them, one a line\n"),
    (["convert", "-i", "k.txt", "--in", "kitti", "--quiet", "-o", "w.mcap"], 1, "mcap: the rows have no stamps, and messages need them; `convert --stamps FILE` says them, one a line\n"),
    (["convert", "-i", "v.jsonl", "-o", "w.mcap"], 1, "mcap is not written of rows of a vector; write csv, json or yaml\n"),
    (["convert", "-i", "v.csv", "-o", "w.mcap", "--as", "twist"], 2, "convert: no such option '--as'"),
    (["tree", "t.yaml", "-o", "t.mcap", "--topic-out", "/a"], 1, "the tree has static and moving frames, on two topics; /a names one\n"),
    (["convert", "-i", "w.tum", "-f", "bag2", "-o", "w.tum"], 5, "w.tum: exists; give --force to replace it\n"),
    (["convert", "-i", "w.tum", "-f", "bag2", "-o", "w.tum", "--force"], 5, "w.tum: is a file; a folder is to be written there\n"),
    (["convert", "-i", "w.tum", "-f", "bag2", "-o", ".", "--force"], 5, ".: holds more than a bag ('k.txt'); it is not replaced\n"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "--frames", "map,map"], 2, "convert: invalid value for '--frames': 'map,map' is not WORLD,BODY, different names; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-o", "w.mcap", "-f", "bag1"], 2, "convert: -o w.mcap is the name of mcap, -f says bag1; give -o NEW.bag; `frametool convert --help` shows the options"),
    (["convert", "-i", "w.tum", "-o", "w.bag", "-f", "mcap"], 2, "convert: -o w.bag is the name of bag1, -f says mcap; give -o NEW.mcap; `frametool convert --help` shows the options"),
    (["tree", "one.yaml", "-o", "t.mcap"], 1, "mcap holds transforms, and there is none in the tree\n"),
    (["convert", "-i", "w.tum", "-o", "none/w.mcap"], 5, "none/w.mcap: no such file or directory\n"),
])  # fmt: skip
def test_what_cannot_be_written_is_told_in_one_line(run: Run, tmp_path: Path, arguments: list[str], status: int, said: str) -> None:
    files = {
        "w.tum": as_tum(*rows(2)), "n.csv": "x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,1\n", "k.txt": "1 0 0 0 0 1 0 0 0 0 1 0\n",
        "t.yaml": TREE, "v.csv": "t,linear_x\n", "one.yaml": "frames: [{name: a}]\n",
        "v.jsonl": '{"t": 1, "frame": "a", "vector": [1, 2, 3]}\n' * 3,
    }  # fmt: skip
    before = {*files}
    done = run(*arguments, files=files)
    assert done.status == status
    assert said in done.err
    assert done.err.count("\n") - done.err.count("warning") - done.err.count("note") == 1
    assert {each.name for each in tmp_path.iterdir()} == before


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("arguments", [
    ("lookup", "drive.yaml", "map", "lidar", "--times", "0:4:1"), ("lookup", "drive.yaml", "map", "lidar", "--at", "2"),
    ("resample", "walk.tum", "--rate", "5"), ("echo", "drive.yaml", "map", "lidar"), ("align", "truth.tum", "odometry.tum"),
    ("invert", "-i", "walk.tum"), ("convert", "-i", "walk.json"), ("invert", "-i", "walk.json"), ("tree", "drive.yaml"),
    ("relative", "-i", "walk.json", "--first"),
])  # fmt: skip
def test_every_command_writes_every_recording(run: Run, tmp_path: Path, form: str, arguments: tuple[str, ...]) -> None:
    for each in EXAMPLES.iterdir():
        if each.suffix in (".tum", ".yaml"):
            (tmp_path / each.name).write_bytes(each.read_bytes())
    run("convert", "-i", "walk.tum", "-f", "json", "-o", "walk.json")
    done = run(*arguments, "-f", form, "-o", FORMS[form])
    assert done.status == 0, done.err
    assert messages(tmp_path / FORMS[form])


@pytest.mark.parametrize("form", FORMS)
def test_a_path_comes_back_with_the_stamp_0_among_others(run: Run, form: str) -> None:
    run("convert", "-i", "w.tum", "-f", form, "--messages", "path", "-o", FORMS[form], files={"w.tum": as_tum([0, 5 * 10**8], rows(2)[1])})
    back, given = (run("convert", "-i", name, "-f", "tum") for name in (FORMS[form], "w.tum"))
    assert back.out == given.out


def test_a_disk_without_room_is_named(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_room(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(recordings, "mkdtemp", no_room)
    done = run("convert", "-i", "w.tum", "--quiet", "-o", "w.mcap", files={"w.tum": as_tum(*rows(2))})
    assert (done.status, done.err.rpartition("/")[2].partition(": ")[2]) == (5, "no space left on device\n")


def test_a_folder_is_replaced_whole(run: Run, tmp_path: Path) -> None:
    arguments = ["convert", "-i", "w.tum", "-f", "bag2", "-o", "bag"]
    run(*arguments, files={"w.tum": as_tum(*rows(2))})
    assert run(*arguments).err.endswith("bag: exists; give --force to replace it\n")
    run("convert", "-i", "v.tum", "-f", "bag2", "-o", "bag", "--force", files={"v.tum": as_tum(*rows(5))})
    assert len(messages(tmp_path / "bag")) == 5
    assert sorted(each.name for each in tmp_path.iterdir()) == ["bag", "v.tum", "w.tum"]


def test_without_the_extra_it_is_named(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "rosbags"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    done = run("convert", "-i", "w.tum", "--quiet", "-o", "w.mcap", files={"w.tum": as_tum(*rows(2))})
    assert (done.status, done.err) == (5, "frametool: recordings are written with an extra; install it: pip install 'frametool[bag]'\n")


@pytest.mark.skipif(sys.platform == "win32", reason="a limit of the size of files is one of POSIX")
def test_a_bag_that_finds_no_room_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text("frames: {a: {b: {xyz: [1, 2, 3]}}}\n")
    code = (
        "import resource, signal, sys; from frametool.cli import run; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024)); sys.exit(run(['tree', 't.yaml', '-o', 't.bag']))"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (5, "")
    assert done.stderr == f"frametool: {tmp_path}: file too large\n"
    assert [path.name for path in tmp_path.iterdir()] == ["t.yaml"]


def test_a_name_that_is_no_text_is_refused() -> None:
    with pytest.raises(ValueInvalid, match="is not a name that can be written"):
        serialised(KINDS["tf"], "mcap", [(0, ("\udc80", "b"), [0.0] * 7)])
