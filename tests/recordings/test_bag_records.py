"""Messages of bags as streams of records: fixes, poses, points; what else a bag holds says what it is."""

from __future__ import annotations

import json
import re
from contextlib import closing
from sqlite3 import connect
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("rosbags")
from recorded import FORMS, START, Maker, Sent, store, write
from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from frametool.grammar.edges import Diagnostics
from frametool.recordings.contents import RECORDS, open_records
from frametool.recordings.read import MessageTypes

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

FIXES = [(48.137, 0), (48.138, 0), (float("nan"), 0), (48.1, -1), (99.0, 0)]
FIX, POSE = "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/PoseStamped"
TF = "tf2_msgs/msg/TFMessage"


def messages(store: Any, *, ros1: bool) -> list[tuple[str, str, Any]]:
    types = store.types

    def header(at: int, frame: str) -> Any:
        stamp = types["builtin_interfaces/msg/Time"](10 + at, 5)
        return types["std_msgs/msg/Header"](at, stamp, frame) if ros1 else types["std_msgs/msg/Header"](stamp, frame)

    made = []
    for at, (lat, status) in enumerate(FIXES):
        state = types["sensor_msgs/msg/NavSatStatus"](status, 1)
        covariance = np.diag([1.0, 1.0, 4.0]).ravel()
        made.append(("/fix", FIX, types[FIX](header(at, "gps"), state, lat, 11.576, 519.0, covariance, 2)))
    point, turn = types["geometry_msgs/msg/Point"](1.0, 2.0, 3.0), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    made.append(("/pose", POSE, types[POSE](header(0, "map"), types["geometry_msgs/msg/Pose"](point, turn))))
    return made


@pytest.fixture(params=["bag1", "bag2"])
def bag(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    ros1 = request.param == "bag1"
    types = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    path = tmp_path / ("run.bag" if ros1 else "run")
    with Writer1(path) if ros1 else Writer2(path, version=9) as writer:
        topics: dict[str, Any] = {}
        for at, (topic, kind, message) in enumerate(messages(types, ros1=ros1)):
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=types)
            data = types.serialize_ros1(message, kind) if ros1 else types.serialize_cdr(message, kind)
            writer.write(topics[topic], (10 + at) * 10**9, data)
    return path


def test_fixes_of_a_bag_are_points_of_the_earth_and_what_is_no_fix_is_a_bad_row(bag: Path, run: Run) -> None:
    done = run("convert", "-i", str(bag), "--topic", "/fix", "--to", "lla", "--on-error", "skip")
    rows = [json.loads(line) for line in done.out.splitlines()]
    assert [(round(row["lat"], 9), row["name"], row["stamp_ns"]) for row in rows] == [
        (48.137, "gps", 10_000_000_005), (48.138, "gps", 11_000_000_005),
    ]
    assert done.status == 3
    assert "'nan' is not finite" in done.err
    assert "status -1: there was no fix" in done.err
    assert "lat 99.0 is beyond 90 degrees" in done.err


def test_a_fix_is_moved_with_its_covariance(bag: Path, run: Run) -> None:
    site = "frames: [{name: map, at: {lat: 48.1, lon: 11.5, alt: 520}, axes: enu}]"
    done = run("apply", "site.yaml", "map", "-i", str(bag), "--topic", "/fix", "--on-error", "skip", files={"site.yaml": site})
    first = json.loads(done.out.splitlines()[0])
    assert first["point"] == pytest.approx([5656.952384, 4117.254609, -4.834100], abs=1e-6)
    assert np.trace(np.reshape(first["covariance"], (3, 3))) == pytest.approx(6.0, abs=1e-9)


@pytest.mark.parametrize("call", [("convert", "BAG"), ("convert", "-i", "BAG"), ("mean", "BAG"), ("invert", "BAG")])
def test_poses_of_a_bag_are_records_wherever_rows_are_read(bag: Path, call: tuple[str, ...], run: Run) -> None:
    done = run(*(str(bag) if each == "BAG" else each for each in call), "--topic", "/pose", "-f", "csv")
    assert done.status == 0, done.err
    names, cells = (line.split(",") for line in done.out.splitlines())
    row = dict(zip(names, cells, strict=False))
    size = -1.0 if call[0] == "invert" else 1.0
    assert [float(row[name]) for name in "xyz"] == [size, 2.0 * size, 3.0 * size]


def test_of_several_topics_one_is_named(bag: Path, run: Run) -> None:
    done = run("convert", "-i", str(bag))
    assert (done.status, done.out) == (2, "")
    assert done.err.count("\n") == 1
    assert "several topics hold points, poses or fixes; give --topic /fix|/pose" in done.err


def test_a_topic_without_records_says_which_there_are(bag: Path, run: Run) -> None:
    done = run("convert", "-i", str(bag), "--topic", "/scan")
    assert (done.status, done.out) == (1, "")
    assert f"no points, poses or fixes on /scan; topics: /fix ({FIX}), /pose ({POSE})" in done.err


def test_a_bag_that_is_damaged_midway_is_one_error_behind_its_whole_messages(bag: Path, run: Run) -> None:
    if bag.is_dir():
        with closing(connect(next(bag.glob("*.db3")))) as database, database:
            database.execute("DELETE FROM messages WHERE id = 2")
        said = "the bag is damaged: 4 of 5 messages on /fix are there"
    else:
        whole = bag.read_bytes()
        third = [found.start() for found in re.finditer(b"op=\x02", whole)][2]
        bag.write_bytes(whole[: third - 4] + bytes(40) + whole[third + 36 :])
        said = "message 3: cannot be read"
    done = run("convert", "-i", str(bag), "--topic", "/fix", "--to", "lla", "--on-error", "skip")
    assert done.status == 1
    assert done.err.splitlines()[-1].startswith(f"frametool: {bag}: {said}")
    assert json.loads(done.out.splitlines()[0])["lat"] == pytest.approx(48.137, abs=1e-9)


POSES = [(float(at), 0.5, -1e-7, 0.0, 0.0, 0.0, 1.0) for at in range(300)]


@pytest.mark.parametrize("form", FORMS)
def test_poses_of_a_recording_are_computed_as_those_of_its_text_are(form: str, tmp_path: Path, run: Run) -> None:
    made = Maker(form)
    sent = [Sent("/pose", *made.pose("map", START + at, numbers), START + at) for at, numbers in enumerate(POSES)]
    path = write(tmp_path / ("run.bag" if form == "bag" else "run"), form, sent)
    text = run("convert", "-i", str(path), "--on-error", "skip").out
    for wanted in ("csv", "yaml", "tum"):
        assert run("convert", "-i", str(path), "-f", wanted).out == run("convert", "-f", wanted, stdin=text).out
    lines = text.splitlines()
    assert len(lines) == len(POSES)
    assert [json.loads(line)["pose"]["position"]["x"] for line in lines] == [each[0] for each in POSES]


@pytest.mark.parametrize("form", FORMS)
def test_a_recording_is_read_in_pieces_of_many_messages(form: str, tmp_path: Path) -> None:
    made = Maker(form)
    sent = [Sent("/pose", *made.pose("map", START + at, numbers), START + at) for at, numbers in enumerate(POSES)]
    path = write(tmp_path / ("run.bag" if form == "bag" else "run"), form, sent)
    stream = open_records(str(path), (), Diagnostics())
    assert stream is not None
    with stream:
        assert stream.read1(1 << 19).count(b"\n") == len(POSES)


@pytest.mark.parametrize("seconds", [1 << 31, (1 << 32) - 1])
def test_seconds_of_ros1_have_no_sign(seconds: int, tmp_path: Path, run: Run) -> None:
    made, stamp_ns = Maker("bag"), seconds * 10**9 + 5
    sent = [
        Sent("/pose", *made.pose("map", START, POSES[0]), START),
        *(Sent("/tf", *made.transforms(("map", "base", POSES[0], START + each)), START) for each in (-10**9, 0)),
    ]
    said = [each._replace(data=made.serialised(each.kind, each.data)) for each in sent]  # the library has int32
    now, then = (np.array(divmod(each, 10**9), "<u4").tobytes() for each in (START, stamp_ns))
    path = write(tmp_path / "run.bag", "bag", [each._replace(data=each.data.replace(now, then)) for each in said])
    done = run("convert", "-i", str(path), "--topic", "/pose", "-f", "csv")
    assert done.out.splitlines()[1].endswith(f",{stamp_ns}"), done.err
    assert f"stamp_ns: {stamp_ns}" in run("lookup", str(path), "map", "base").out


@pytest.mark.parametrize("form", FORMS)
def test_poses_of_a_path_have_their_own_headers_and_what_these_leave_open_is_that_of_the_path(
    form: str, tmp_path: Path, run: Run
) -> None:
    made = Maker(form)
    poses = [made.pose("odom", START + 1, POSES[1])[1], made.pose("", 0, POSES[2])[1]]
    path = made.part("nav_msgs/msg/Path", made.header("map", START + 9), poses)
    place = tmp_path / ("run.bag" if form == "bag" else "run")
    bag = write(place, form, [Sent("/path", "nav_msgs/msg/Path", path, START)])
    rows = [line.split(",") for line in run("convert", "-i", str(bag), "-f", "csv").out.splitlines()[1:]]
    assert [(row[0], float(row[1]), int(row[-1])) for row in rows] == [("odom", 1.0, START + 1), ("map", 2.0, START + 9)]


@pytest.mark.parametrize("form", FORMS)
def test_poses_of_an_array_have_its_header(form: str, tmp_path: Path, run: Run) -> None:
    made, kind = Maker(form), "geometry_msgs/msg/PoseArray"
    array = made.part(kind, made.header("map", START), [made.posed(POSES[1]), made.posed(POSES[2])])
    bag = write(tmp_path / ("run.bag" if form == "bag" else "run"), form, [Sent("/some", kind, array, START)])
    rows = [line.split(",") for line in run("convert", "-i", str(bag), "-f", "csv").out.splitlines()[1:]]
    assert [(row[0], float(row[1]), int(row[-1])) for row in rows] == [("map", 1.0, START), ("map", 2.0, START)]


@pytest.mark.parametrize("suffix", ["mcap", "bag"])
def test_a_path_that_was_written_is_read_again(suffix: str, tmp_path: Path, run: Run) -> None:
    rows = "t,x,y,z,qx,qy,qz,qw\n1,1,2,3,0,0,0,1\n2,4,5,6,0,0,1,0\n"
    for kind in ("path", "pose"):
        assert run("convert", "--messages", kind, "-o", f"{tmp_path}/{kind}.{suffix}", stdin=rows).status == 0
    found = [run("convert", "-i", f"{tmp_path}/{kind}.{suffix}", "-f", "csv").out for kind in ("path", "pose")]
    assert found[0] == found[1] != ""
    moved = run("lookup", f"{tmp_path}/path.{suffix}", "world", "path", "--topic", "/path", "--at", "2", "-f", "csv")
    assert moved.out.splitlines()[1].startswith("path,world,4.0,5.0,6.0"), moved.err


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("name", "part", "key"), [("PointStamped", "Point", "point"), ("Vector3Stamped", "Vector3", "vector")])
def test_points_and_vectors_get_no_rotation(name: str, part: str, key: str, form: str, tmp_path: Path, run: Run) -> None:
    made, kind = Maker(form), f"geometry_msgs/msg/{name}"
    said = [made.part(kind, made.header("map", START), made.part(part, at, 2.0, 3.0)) for at in (1.0, 4.0)]
    sent = [Sent("/it", kind, each, START) for each in said]
    bag = str(write(tmp_path / ("run.bag" if form == "bag" else "run"), form, sent))
    text = run("convert", "-i", bag).out
    assert json.loads(text.splitlines()[0])[key] == {"x": 1.0, "y": 2.0, "z": 3.0}
    rows = run("convert", "-i", bag, "-f", "csv").out
    assert rows == f"frame,x,y,z,stamp_ns\nmap,1.0,2.0,3.0,{START}\nmap,4.0,2.0,3.0,{START}\n"
    assert rows == run("convert", "-f", "csv", stdin=text).out
    assert "roll,pitch,yaw" in run("convert", "-i", bag, "-f", "csv", "--to", "rpy").out  # asked for


def made_up(form: str, kind: str, random: np.random.Generator, text: str) -> Any:
    """Make a message of a type of random numbers, with one text in all places that have some."""
    def value(node: Nodetype, what: Any) -> Any:
        if node == Nodetype.NAME:
            return made_up(form, what, random, text)
        if node == Nodetype.ARRAY:
            return np.array([value(*what[0]) for _ in range(what[1])])
        if what[0].startswith("float"):
            return random.choice([0.0, -0.0, 1.0, 1e300, random.normal(), random.normal() * 10.0 ** random.integers(-30, 30)])
        return text if what[0] == "string" else int(random.integers(0, 100))

    return Maker(form).part(kind, *(value(*node) for _, node in store(form).fielddefs[kind][1]))


@pytest.mark.parametrize("form", ["bag", "mcap"])
@pytest.mark.parametrize("kind", sorted(RECORDS - {"nav_msgs/msg/Path", "geometry_msgs/msg/PoseArray"}))
def test_messages_that_lie_alike_become_the_same_lines_at_once(
    form: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    random, texts = np.random.default_rng(35), ['map "1" %r'] * 40 + ["odom", "östlich"] * 5 + ["map", "mop"] * 3
    sent = [Sent("/it", kind, made_up(form, kind, random, text), START + at) for at, text in enumerate(texts)]
    read, singly = MessageTypes.read, 0

    def counted(*arguments: Any) -> Any:
        nonlocal singly
        singly += 1
        return read(*arguments)

    def lines(some: list[Sent]) -> bytes:
        bag = write(tmp_path / f"run{random.random()}.{form}", form, some)
        stream = open_records(str(bag), (), Diagnostics())
        assert stream is not None
        return stream.read()

    monkeypatch.setattr(MessageTypes, "read", counted)
    found = [lines(sent[:40])]
    assert singly == 1
    found.append(lines(sent))
    monkeypatch.setattr("frametool.recordings.contents.layout_of", lambda *_: None)
    assert [lines(sent[:40]), lines(sent)] == found
    assert [json.loads(line)["header"]["frame_id"] for line in found[1].splitlines()] == texts


def test_a_number_that_is_not_finite_has_its_name_among_messages_that_lie_alike(tmp_path: Path, run: Run) -> None:
    made = Maker("mcap")
    poses = [(float(at), 0.0, float("nan") if at == 5 else 1.0, 0.0, 0.0, 0.0, 1.0) for at in range(9)]
    bag = write(tmp_path / "run", "mcap", [Sent("/it", *made.pose("map", START, each), START) for each in poses])
    done = run("convert", "-i", str(bag), "-f", "csv", "--on-error", "skip")
    assert [row.split(",")[1] for row in done.out.splitlines()[1:]] == ["0.0", "1.0", "2.0", "3.0", "4.0", "6.0", "7.0", "8.0"]
    assert "'nan' is not finite" in done.err
