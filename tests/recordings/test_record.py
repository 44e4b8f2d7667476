"""Recordings copied with something changed: what nobody asked to change is the same, message by message."""

from __future__ import annotations

import random
import re
import shutil
import struct
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("rosbags")
import mcap_bytes as by_hand
from recorded import FORMS, ROS2, SECOND, START, TF, Maker, Recorded, Sent, read, write
from rosbags.rosbag2.enums import CompressionFormat, CompressionMode

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

HALF = 0.7071067811865476
FIRST_PRIVATE = 0x80  # kind of a record of MCAP
CAMERA = (0.1, 0.2, 0.3, 0.0, 0.0, HALF, HALF)
LIDAR = (1.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0)
EXTRINSICS = """frames:
  - {name: camera, parent: base_link, xyz: [0.1, 0.2, 0.3], rpy_deg: [0, 0, 90]}
  - {name: optical, parent: camera, rpy_deg: [-90, 0, -90]}
"""
NEW_LIDAR = "{name: lidar, parent: base_link, xyz: [1.5, 0, 0.5]}"


def drive(form: str, count: int = 40) -> list[Sent]:
    """Make messages of many types: two of a topic, two who send one, a type nobody can read, and equal times."""
    made = Maker(form)
    sent = [
        Sent("/tf_static", *made.transforms(("base_link", "lidar", LIDAR, START), ("base_link", "imu", CAMERA, START)), START + 5, "/a"),
    ]
    for at in range(count):
        log_ns = START + at * SECOND // 10
        moved = (0.1 * at, 0.0, 0.0, 0.0, 0.0, 0.6, 0.8)
        sent += [
            Sent("/tf", *made.transforms(("odom", "base_link", moved, log_ns)), log_ns),
            Sent("/pose", *made.pose("odom", log_ns, moved), log_ns + 3),
            Sent("/odd", "my_msgs/msg/Odd", bytes([at]) * (at % 5), log_ns + 3),
            Sent("/odd", "my_msgs/msg/Distance", b"\x00\x01\x00\x00" + bytes(12), log_ns + 3),
            Sent("/odd", "my_msgs/msg/Distance", bytes([at]), log_ns + 4, "/b"),
        ]
    return sorted(sent, key=lambda each: each.log_ns)


def copy_name(form: str) -> str:
    return {"bag": "new.bag", "mcap": "new.mcap"}.get(form, "new")


def recording(folder: Path, form: str, messages: list[Sent] | None = None, **options: Any) -> Path:
    path = folder / ("run.bag" if form == "bag" else "run")
    return write(path, form, drive(form) if messages is None else messages, **options)


def record(run: Run, path: Path, *arguments: str, form: str, name: str = "", **options: Any) -> tuple[Any, Path]:
    name = name or copy_name(form)
    done = run("record", str(path), *arguments, "-o", name, **options)
    return done, path.parents[form == "mcap"] / name


def without_digest(messages: list[Recorded]) -> list[Recorded]:
    """Leave out what MCAP files and sqlite3 files of rosbags say in different places: the hash of a type."""
    return [each._replace(about=each.about[1:]) for each in messages]


@pytest.mark.parametrize("form", FORMS)
def test_a_message_is_added_first_and_all_others_stay_as_they_are(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form)
    done, new = record(run, path, "--with", "new.yaml", form=form, files={"new.yaml": EXTRINSICS})
    assert (done.status, done.out) == (0, "")
    assert done.err == f"frametool: {path}: added on /tf_static: base_link -> camera, camera -> optical\n"
    (first, *others), before = read(new), read(path)
    assert without_digest(others) == without_digest(before)
    assert (first.topic, first.kind, first.log_ns) == ("/tf_static", TF, START)
    edges = [(each.header.frame_id, each.child_frame_id) for each in Maker(form).read(TF, first.data).transforms]
    assert edges == [("base_link", "camera"), ("camera", "optical")]
    turned = Maker(form).read(TF, first.data).transforms[0].transform.rotation
    assert (turned.x, turned.y, turned.z, turned.w) == (0.0, 0.0, HALF, HALF)


@pytest.mark.parametrize("form", FORMS)
def test_adding_twice_is_adding_once(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form)
    once = record(run, path, "--with", "new.yaml", form=form, files={"new.yaml": EXTRINSICS})[1]
    name = f"again{once.suffix}"
    done = run("record", str(once), "--with", "new.yaml", "-o", name)
    said = f"frametool: {once}: "
    count = len(read(once))
    assert done.err == (
        f"{said}there already with the same values: base_link -> camera, camera -> optical\n"
        f"{said}nothing is changed: {count} messages copied\n"
    )
    assert without_digest(read(tmp_path / name)) == without_digest(read(once))


@pytest.mark.parametrize("form", FORMS)
def test_other_edges_are_added_to_a_recording_that_was_written_here(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form)
    for name in ("camera", "radar", "sonar"):
        new = {"new.yaml": f"{{name: {name}, parent: base_link, xyz: [1, 2, 3]}}"}
        before, path = path, tmp_path / copy_name(form).replace("new", name)
        done = run("record", str(before), "--with", "new.yaml", "-o", str(path), files=new)
        assert (done.status, done.err.rpartition(": added on ")[2]) == (0, f"/tf_static: base_link -> {name}\n")
    assert run("lookup", str(path), "camera", "sonar", "-f", "csv").out.splitlines()[1].startswith("sonar,camera,0.0,0.0,0.0,")
    if form == "bag":  # or players would keep the last of them only
        assert [each.about[1].callerid for each in read(path)[:3]] == ["/frametool_2", "/frametool_1", None]


def test_a_latched_topic_is_made_where_there_is_none(tmp_path: Path, run: Run) -> None:
    for form in FORMS:
        folder = tmp_path / form
        folder.mkdir()
        path = recording(folder, form, [each for each in drive(form) if each.topic != "/tf_static"])
        name = str(folder / copy_name(form))
        assert run("record", str(path), "--with", "new.yaml", "-o", name, files={"new.yaml": EXTRINSICS}).status == 0
        first = read(Path(name))[0]
        if form == "bag":
            assert (first.about[1].callerid, first.about[1].latching) == (None, 1)
            assert first.about[0] == "94810edda583a504dfda3829e70d7eec"
        else:
            (qos,) = first.about[1].offered_qos_profiles
            assert (qos.durability.name, qos.reliability.name, qos.history.name) == ("TRANSIENT_LOCAL", "RELIABLE", "KEEP_LAST")
        assert first.definition.startswith("geometry_msgs/TransformStamped[] transforms\n")


@pytest.mark.parametrize("form", FORMS)
def test_replacing_changes_the_numbers_of_one_transform_and_no_other_byte(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form)
    done, new = record(run, path, "--with", NEW_LIDAR, "--replace", form=form)
    assert done.err == f"frametool: {path}: replaced in 1 message: base_link -> lidar\n"
    before, after = read(path), read(new)
    changed = [(old, each) for old, each in zip(before, after, strict=True) if old.data != each.data]
    ((old, each),) = changed
    place = old.data.index(struct.pack("<7d", *LIDAR))
    assert each.data == old.data[:place] + struct.pack("<7d", 1.5, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0) + old.data[place + 56 :]
    assert [item._replace(data=b"") for item in without_digest(after)] == [item._replace(data=b"") for item in without_digest(before)]


def test_an_edge_that_comes_again_and_again_is_replaced_in_every_message(tmp_path: Path, run: Run) -> None:
    made = Maker("bag")
    sent = [Sent("/tf", *made.transforms(("base_link", "lidar", LIDAR, START + at), ("odom", "base_link", (at, 0, 0, 0, 0, 0, 1), START + at)), START + at) for at in range(9)]
    path = recording(tmp_path, "bag", sent)
    done, new = record(run, path, "--with", NEW_LIDAR, "--replace", form="bag")
    assert done.err == f"frametool: {path}: replaced in 9 messages: base_link -> lidar\n"
    for each in read(new):
        lidar, base = made.read(TF, each.data).transforms
        assert lidar.transform.translation.x == 1.5
        assert base.transform.translation.x * 1.0 == each.log_ns - START


BOTH = "{frames: [{name: lidar, parent: base_link, xyz: [1.5, 0, 0.5]}, {name: imu, parent: base_link, xyz: [0.1, 0.2, 0.3], rpy_deg: [0, 0, 92]}]}"
REFUSED = {
    NEW_LIDAR: "run: other values than in argument: base_link -> lidar on /tf_static (0.5 m and 0 deg off); --replace uses those of argument",
    BOTH: "run: other values than in argument: base_link -> lidar on /tf_static (0.5 m and 0 deg off), base_link -> imu on /tf_static (0 m and 2 deg off); --replace uses those of argument",
    "{name: lidar, parent: odom, xyz: [1, 0, 0]}": "frame 'lidar' has two parents: 'base_link' (run, /tf_static) and 'odom' (argument)",
    "{name: base_link, parent: odom, xyz: [1, 0, 0]}": "frame 'base_link': it moves in 'odom' (run, /tf) and is static in it (argument)",
    "{name: odom, parent: lidar, xyz: [1, 0, 0]}": "frames form a cycle: odom <- base_link <- lidar <- odom",
    "{frames: [{name: box, parent: map, samples: [{stamp: 1, xyz: [1, 2, 3]}, {stamp: 2, xyz: [1, 2, 4]}]}]}": "frame 'box' moves in argument; --with adds static frames",
}


@pytest.mark.parametrize("tree", REFUSED)
def test_an_edge_that_does_not_fit_is_one_error_and_leaves_nothing(tree: str, tmp_path: Path, run: Run) -> None:
    recording(tmp_path, "sqlite")
    done = run("record", "run", "--with", tree, "-o", "new.mcap")
    assert (done.status, done.err) == (1, f"frametool: {REFUSED[tree]}\n")
    assert [each.name for each in tmp_path.iterdir()] == ["run"]


def test_signs_of_quaternions_and_slashes_do_not_make_another_edge(tmp_path: Path, run: Run) -> None:
    made = Maker("mcap")
    numbers = (1.0, 0.0, 0.5, -0.0, -0.0, -HALF, -HALF)
    path = recording(tmp_path, "mcap", [Sent("/tf_static", *made.transforms(("/base_link", "/lidar", numbers, 0)), START)])
    done, _ = record(run, path, "--with", "{name: lidar, parent: base_link, xyz: [1, 0, 0.5], rpy_deg: [0, 0, 90]}", form="mcap")
    assert "there already with the same values: base_link -> lidar" in done.err


def test_an_edge_goes_to_the_namespace_of_the_frame_it_hangs_from(tmp_path: Path, run: Run) -> None:
    made = Maker("mcap")
    sent = [
        Sent(f"/{robot}/tf", *made.transforms(("odom", f"{robot}/base", LIDAR, START)), START) for robot in ("r1", "r2")
    ]
    path = recording(tmp_path, "mcap", sent)
    tree = "frames: [{name: lid, parent: mast, xyz: [1, 0, 0]}, {name: mast, parent: r2/base, xyz: [1, 0, 0]}, {name: a, parent: b, xyz: [1, 0, 0]}]"
    done, _ = record(run, path, "--with", "t.yaml", form="mcap", files={"t.yaml": tree})
    said = f"frametool: {path}: added on "
    apart = f"frametool: warning: {path}: frame 'b' is in none of its transforms\n"
    assert done.err == f"{apart}{said}/r2/tf_static: mast -> lid, r2/base -> mast\n{said}/tf_static: b -> a\n"


def test_a_frame_of_two_robots_is_replaced_where_a_topic_says_whose(tmp_path: Path, run: Run) -> None:
    made = Maker("mcap")
    sent = [Sent(f"/{robot}/tf_static", *made.transforms(("base_link", "lidar", LIDAR, START)), START) for robot in ("r1", "r2")]
    path = recording(tmp_path, "mcap", sent)
    done, _ = record(run, path, "--with", NEW_LIDAR, "--replace", form="mcap")
    both = "frame 'lidar' comes by /r1/tf_static and by /r2/tf_static"
    assert (done.status, done.err) == (1, f"frametool: {path}: {both}; choose with --topic /r1/tf_static or --topic /r2/tf_static\n")
    done, new = record(run, path, "--with", NEW_LIDAR, "--replace", "--topic", "/r2/tf_static", form="mcap")
    assert done.status == 0
    values = {each.topic: made.read(TF, each.data).transforms[0].transform.translation.x for each in read(new)}
    assert values == {"/r1/tf_static": 1.0, "/r2/tf_static": 1.5}


@pytest.mark.parametrize("form", FORMS)
def test_a_window_keeps_what_was_logged_in_it_and_all_of_tf_static(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form)
    done, new = record(run, path, "--between", "1700000001,1700000002000000003ns", form=form)
    assert done.err == f"frametool: {path}: kept outside of --between: 1 message on tf_static\n"
    left = [each for each in read(path) if START + SECOND <= each.log_ns <= START + 2 * SECOND + 3 or each.topic == "/tf_static"]
    assert without_digest(read(new)) == without_digest(left)


@pytest.mark.parametrize("form", FORMS)
def test_what_is_added_comes_first_of_a_window_too(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form, [each for each in drive(form) if each.topic != "/tf_static"])
    _, new = record(run, path, "--between", "1700000001,1700000002", "--with", "n.yaml", form=form, files={"n.yaml": EXTRINSICS})
    first, second, *_ = read(new)
    assert (first.topic, first.log_ns) == ("/tf_static", START + SECOND)
    assert (second.topic, second.log_ns) == ("/tf", START + SECOND)


def test_a_window_without_messages_says_which_there_are(tmp_path: Path, run: Run) -> None:
    recording(tmp_path, "sqlite")
    done = run("record", "run", "--between", "1,2", "-o", "new.mcap")
    span = "they are logged from 1700000000.000000000 to 1700000003.900000004"
    assert (done.status, done.err) == (4, f"frametool: run: no messages from 1.000000000 to 2.000000000; {span}\n")
    assert not (tmp_path / "new.mcap").exists()


@pytest.mark.parametrize("form", ROS2)
@pytest.mark.parametrize("folder", [False, True])
def test_every_form_of_ros2_becomes_a_file_or_a_folder(form: str, folder: bool, tmp_path: Path, run: Run) -> None:  # noqa: FBT001
    path = recording(tmp_path, form)
    done = run("record", str(path), *(["-f", "bag2"] if folder else []), "-o", "x" if folder else "x.mcap")
    assert done.err == f"frametool: {path}: nothing is changed: {len(read(path))} messages copied\n"
    new = tmp_path / ("x" if folder else "x.mcap")
    assert without_digest(read(new)) == without_digest(read(path))
    if folder and form != "mcap":
        assert read(new) == read(path)
    if folder:
        assert sorted(each.name for each in new.iterdir()) == ["metadata.yaml", "recording.mcap"]
        assert without_digest(read(new / "recording.mcap")) == without_digest(read(path))


PACKED = [
    ("folder", (CompressionMode.STORAGE, CompressionFormat.ZSTD)), ("folder", (CompressionMode.MESSAGE, CompressionFormat.ZSTD)),
    ("sqlite", (CompressionMode.MESSAGE, CompressionFormat.ZSTD)), ("sqlite", (CompressionMode.FILE, CompressionFormat.ZSTD)),
]  # fmt: skip


@pytest.mark.parametrize(("form", "compression"), PACKED)
@pytest.mark.parametrize("arguments", [(), ("--between", "1700000001,1700000002")])
def test_packed_recordings_are_copied_too(form: str, compression: Any, arguments: tuple[str, ...], tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form, compression=compression)
    plain = recording(tmp_path / "plain", form)
    for source, name in ((path, "a.mcap"), (plain, "b.mcap")):
        assert run("record", str(source), *arguments, "-o", name, "--quiet").err == ""
    assert read(tmp_path / "a.mcap") == read(tmp_path / "b.mcap")


def test_two_copies_are_the_same_bytes(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "sqlite")
    for name in ("a.mcap", "b.mcap"):
        run("record", str(path), "--with", "n.yaml", "-o", name, files={"n.yaml": EXTRINSICS})
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_a_bag_may_order_the_fields_of_heads_in_any_way(tmp_path: Path, run: Run) -> None:
    """As rosbag of C++ and of Python do, which sort them and do not; half of the messages are turned around here."""
    path = recording(tmp_path, "bag")
    data = path.read_bytes()
    head = re.compile(rb"(\x04\0\0\0op=\x02)(\x09\0\0\0conn=.{4})(\x0d\0\0\0time=.{8})", re.DOTALL)
    heads = iter(range(10**6))
    path.write_bytes(head.sub(lambda found: found[3] + found[2] + found[1] if next(heads) % 2 else found[2] + found[1] + found[3], data))
    assert path.read_bytes() != data
    done, new = record(run, path, "--between", "1700000001,1700000002", form="bag")
    assert done.status == 0, done.err
    assert read(new) == [each for each in read(path) if START + SECOND <= each.log_ns <= START + 2 * SECOND or each.topic == "/tf_static"]


def test_a_bag_that_is_not_closed_says_so(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "bag")
    data, field = path.read_bytes(), b"index_pos="
    at = data.index(field) + len(field)
    path.write_bytes(data[:at] + bytes(8) + data[at + 8 :])
    done = run("record", str(path), "-o", "new.bag")
    assert (done.status, done.err.count("\n")) == (1, 1)
    assert "Bag is not indexed, reindex before reading" in done.err


# --- what only MCAP holds ------------------------------------------------------------------------------------------


def rich(*, chunked: str | None = "") -> bytes:
    """Make a file of all that an MCAP file may hold, its messages in chunks or outside of them."""
    definition = "float64 x\n"
    defined = [
        by_hand.schema(7, TF, "ros2msg", "geometry_msgs/TransformStamped[] transforms\n"),
        by_hand.schema(3, "my_msgs/msg/A", "ros2msg", definition), by_hand.schema(4, "my_msgs/msg/A", "ros2idl", "struct A;"),
        by_hand.schema(5, "thing", "jsonschema", "{}"),
        by_hand.channel(2, 7, "/tf", more="is said"), by_hand.channel(9, 3, "/a"), by_hand.channel(8, 4, "/a"),
        by_hand.channel(1, 5, "/json", "json"), by_hand.channel(0, 0, "/raw", "bytes"), by_hand.channel(30, 3, "/never"),
    ]  # fmt: skip
    made = Maker("mcap")
    blocks = []
    for at in range(4):
        log_ns = START + at * SECOND
        moved = made.serialised(*made.transforms(("map", "base", (at, 0, 0, 0, 0, 0, 1), log_ns - 5)))
        blocks.append([
            by_hand.message(2, moved, log_ns, log_ns - 11, 100 + at), by_hand.message(9, b"one", log_ns + 1, 5, at),
            by_hand.message(8, b"two", log_ns - 40, 6, at), by_hand.message(1, b"{}", log_ns + 2, log_ns + 3), by_hand.message(0, b"", log_ns, log_ns),
        ])  # fmt: skip
    inside = [b"".join([*(defined if not at else []), *block]) for at, block in enumerate(blocks)]
    records = [each if chunked is None else by_hand.chunk(each, chunked) for each in inside]
    return by_hand.whole(
        by_hand.header(), by_hand.attachment("cal.txt", b"1 2 3"), *records[:2], by_hand.metadata("notes", who="me"),
        by_hand.record(0x80, b"private"), *records[2:],
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("chunked", ["", "lz4", None])
@pytest.mark.parametrize("window", [None, (START + SECOND, START + 2 * SECOND)])
def test_mcap_keeps_all_that_it_holds(chunked: str | None, window: tuple[int, int] | None, run: Run, tmp_path: Path) -> None:
    arguments = ["--between", f"{window[0]}ns,{window[1]}ns"] if window else []
    done = run("record", "run.mcap", *arguments, "-o", "new.mcap", files={"run.mcap": rich(chunked=chunked)})
    assert done.status == 0, done.err
    before, after = (by_hand.McapContents((tmp_path / name).read_bytes()) for name in ("run.mcap", "new.mcap"))
    there = [each for each in before.messages if window is None or window[0] <= each.log_ns <= window[1]]
    assert after.messages == sorted(there, key=attrgetter("log_ns"))
    assert sorted(after.others) == sorted(each for each in before.others if each[0] < FIRST_PRIVATE)
    assert {each[:3] for each in after.channels.values()} == {each[:3] for each in before.channels.values()}
    assert sum(map(len, after.places.values())) == len(after.messages)
    assert len(after.in_summary(4)) == len(before.channels)
    (statistics,) = after.in_summary(11)
    assert struct.unpack_from("<QHIII", statistics) == (len(after.messages), 4, 6, 1, 1)


def test_what_is_added_to_mcap_is_all_that_is_new(run: Run, tmp_path: Path) -> None:
    run("record", "run.mcap", "--with", "{name: c, parent: base, xyz: [1, 2, 3]}", "-o", "new.mcap", files={"run.mcap": rich()})
    before, after = (by_hand.McapContents((tmp_path / name).read_bytes()) for name in ("run.mcap", "new.mcap"))
    first, *others = after.messages
    assert others == sorted(before.messages, key=attrgetter("log_ns"))
    assert (first.topic, first.log_ns, first.published_ns) == ("/tf_static", START - 40, START - 40)
    assert first.schema == before.messages[0].schema
    assert b"transient_local" in first.said


def test_what_rosbag2_says_of_a_file_in_it_is_brought_up_to_date(run: Run, tmp_path: Path) -> None:
    path = recording(tmp_path, "mcap")
    for arguments in (), ("--between", "1700000001,1700000002"):
        done = run("record", str(path), *arguments, "-o", "new.mcap", "--force")
        assert done.status == 0, done.err
        ((kind, body),) = by_hand.McapContents((tmp_path / "new.mcap").read_bytes()).others
        assert kind == 12
        count = len(read(tmp_path / "new.mcap"))
        assert re.findall(rb"\nmessage_count: (\d+)\n", body) == [str(count).encode()]


def test_a_count_in_the_summary_that_is_not_that_of_messages_is_an_error(run: Run, tmp_path: Path) -> None:
    path = recording(tmp_path, "mcap")
    data, count = path.read_bytes(), len(read(path))
    at = data.rindex(b"\x0b" + struct.pack("<Q", 46 + 10 * 6) + struct.pack("<Q", count))
    at += 9 + 42 + 4 + 2  # the count of the first channel
    path.write_bytes(data[:at] + struct.pack("<Q", struct.unpack_from("<Q", data, at)[0] + 1) + data[at + 8 :])
    done = run("record", str(path), "-o", "new.mcap")
    assert (done.status, done.err) == (1, f"frametool: {path}: the bag is damaged: {count} of {count + 1} messages are there\n")


def test_files_of_a_folder_are_joined_whatever_numbers_they_use(run: Run, tmp_path: Path) -> None:
    definition = by_hand.schema(1, "my_msgs/msg/A", "ros2msg", "float64 x\n")
    files = [
        (definition, by_hand.channel(1, 1, "/a"), by_hand.channel(2, 1, "/b"), by_hand.message(1, b"a0", START, START), by_hand.message(2, b"b0", START, START)),
        (definition, by_hand.channel(1, 1, "/b"), by_hand.channel(2, 1, "/c"), by_hand.message(1, b"b1", START + 1, START), by_hand.message(2, b"c1", START + 1, START)),
    ]
    (tmp_path / "run").mkdir()
    for number, records in enumerate(files):
        (tmp_path / f"run/run_{number}.mcap").write_bytes(by_hand.whole(by_hand.header(), by_hand.chunk(b"".join(records))))
    (tmp_path / "run/metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  message_count: 4\n"
        "  relative_file_paths: [run_0.mcap, run_1.mcap]\n"
    )
    done = run("record", "run", "-o", "new.mcap")
    assert done.status == 0, done.err
    after = by_hand.McapContents((tmp_path / "new.mcap").read_bytes())
    assert [(each.topic, each.data) for each in after.messages] == [("/a", b"a0"), ("/b", b"b0"), ("/b", b"b1"), ("/c", b"c1")]
    assert [each[0] for each in after.channels.values()] == ["/a", "/b", "/c"]


@pytest.mark.parametrize("chosen", [(), ("--between", "1700000000,1700000001")])
def test_files_of_a_folder_are_counted_each_by_itself(chosen: tuple[str, ...], run: Run, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    for number, count in enumerate((3, 1)):
        sent = [Sent("/tf", *Maker("mcap").transforms(("map", "base", LIDAR, START + at)), START + at) for at in range(count)]
        write(tmp_path / f"part{number}", "mcap", sent).rename(tmp_path / f"run/run_{number}.mcap")
    (tmp_path / "run/metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n"
        "  relative_file_paths: [run_0.mcap, run_1.mcap]\n"
    )
    assert run("lookup", "run", "map", "base").status == 0
    done = run("record", "run", *chosen, "-o", "new.mcap")
    assert done.status == 0, done.err
    assert len(read(tmp_path / "new.mcap")) == 4


# --- what is not whole ---------------------------------------------------------------------------------------------


FRAME = b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 600 << 20)  # of zstd, which says how large it will be


@pytest.mark.parametrize(
    ("compression", "stated", "data"),
    [("", 600 << 20, b"no chunk."), ("lz4", 600 << 20, b"no chunk."), ("zstd", 600 << 20, b"no chunk."), ("zstd", 9, FRAME)],
)
def test_a_chunk_that_promises_more_than_a_file_holds_is_not_unpacked(
    compression: str, stated: int, data: bytes, run: Run, tmp_path: Path
) -> None:
    size = 600 << 20
    head = struct.pack("<QQQI", 0, 0, stated, 0) + by_hand.text(compression) + struct.pack("<Q", len(data))
    (tmp_path / "run.mcap").write_bytes(by_hand.whole(by_hand.header(), by_hand.record(6, head + data)))
    done = run("record", "run.mcap", "-o", "new.mcap")
    assert (done.status, done.err.count("frametool: run.mcap: ")) == (1, 1)
    assert f"a chunk of {size} bytes; {1 << 28} are read" in done.err


def check_spoilt(form: str, folder: Path, run: Run, count: int) -> None:
    """Copy a recording that is spoilt in many ways: with every message, or with one line and nothing left behind."""
    path = recording(folder, form, drive(form, 5))
    file = next(path.glob("*.db3")) if path.is_dir() and form == "sqlite" else next(path.glob("*.mcap")) if path.is_dir() else path
    data, draw = file.read_bytes(), random.Random(form)  # noqa: S311 - not for secrets
    whole = len(read(path))
    before = {each.name for each in folder.iterdir()}
    for _ in range(count):
        at = draw.randrange(len(data))
        changed = bytes([data[at] ^ draw.choice((1, 4, 32, 128, 255))]) + data[at + 1 :]
        file.write_bytes(data[:at] + (changed if draw.random() < 0.8 else b""))
        name = copy_name(form)
        done = run("record", str(path), *draw.choice(((), ("--with", "{name: c, parent: base_link, xyz: [1, 2, 3]}"))), "-o", name, "--force")
        if done.status:
            assert (done.status, done.err.count("\n")) in {(1, 1), (5, 1)}, done.err
            assert {each.name for each in folder.iterdir()} == before
            continue
        copy = folder / name
        told = run("record", name, "-o", f"again{copy.suffix}", "--force").err
        assert f"{name}: nothing is changed: {whole + done.err.count('added')} messages copied\n" in told
        for each in (copy, folder / f"again{copy.suffix}"):
            shutil.rmtree(each) if each.is_dir() else each.unlink()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("form", FORMS)
def test_a_spoilt_recording_is_copied_whole_or_not_at_all(form: str, tmp_path: Path, run: Run) -> None:
    check_spoilt(form, tmp_path, run, 60)


@pytest.mark.large
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("form", FORMS)
def test_a_recording_spoilt_in_many_ways_is_copied_whole_or_not_at_all(form: str, tmp_path: Path, run: Run) -> None:
    check_spoilt(form, tmp_path, run, 2000)
