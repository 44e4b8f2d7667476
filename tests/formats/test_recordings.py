"""Recordings of transforms: every form gives the same samples, whatever stands between them and however it is cut."""

from __future__ import annotations

import json
import random
import sys
from typing import TYPE_CHECKING, Any

import pytest

from frametool.errors import FileProblem, FormatError, FrametoolError, FrametoolWarning, ValueInvalid
from frametool.formats.load import FrameFile
from frametool.grammar.result import Style
from frametool.ros.messages import message_text, new_stamp

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Sizes

    from frametool.grammar.edges import Edge

EPOCH = 1_700_000_000_123_456_789
EXPECTED = [
    ("map", "base", (1.5, -2.0, 1e-05, 0.0, 0.0, 0.6, 0.8), EPOCH),
    ("base", "cam 1", (0.25, 0.0, 3.0, -0.5, 0.5, -0.5, 0.5), EPOCH + 1),
]


def transform(parent: str, child: str, numbers: tuple[float, ...], stamp_ns: int) -> dict[str, Any]:
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    return {
        "header": {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", numbers[:3], strict=True)),
            "rotation": dict(zip("xyzw", numbers[3:], strict=True)),
        },
    }


MESSAGES = [{"transforms": [transform(*each)]} for each in EXPECTED]
BOTH = {"transforms": [transform(*each) for each in EXPECTED]}


def echoed(form: str, *messages: dict[str, Any]) -> str:
    return "".join(message_text(message, Style(form)) for message in messages)


def foxglove(parent: str, child: str, numbers: tuple[float, ...], stamp_ns: int) -> str:
    inner = transform(parent, child, numbers, stamp_ns)["transform"]
    stamp = dict(zip(("sec", "nsec"), divmod(stamp_ns, 10**9), strict=True))
    return json.dumps({"timestamp": stamp, "parent_frame_id": parent, "child_frame_id": child, **inner})


CSV1 = "%time,field.transforms0.header.seq,field.transforms0.header.stamp,rest\n" + "".join(
    f"{stamp + 500},0,{stamp},{parent},{child},{','.join(map(repr, numbers))}\n"
    for parent, child, numbers, stamp in EXPECTED
)
CSV2 = ",".join(
    f"{stamp // 10**9},{stamp % 10**9},{parent},{child},{','.join(map(repr, numbers))}"
    for parent, child, numbers, stamp in EXPECTED
)
BRIDGE = "".join(json.dumps({"op": "publish", "topic": "/tf", "msg": message}) + "\n" for message in MESSAGES)
FORMS = {
    "echo of ros2": echoed("ros2", *MESSAGES),
    "echo of ros2, one message": echoed("ros2", BOTH),
    "echo of ros1": echoed("ros1", *MESSAGES),
    "echo of ros1, one message": echoed("ros1", BOTH),
    "echo without blanks at ends": echoed("ros1", BOTH).replace(" \n", "\n"),
    "echo of windows": echoed("ros2", *MESSAGES).replace("\n", "\r\n"),
    "echo without last separator": echoed("ros2", *MESSAGES).removesuffix("---\n"),
    "bare messages": "".join(f"{echoed('ros2', transform(*each))}" for each in EXPECTED),
    "flow style": "".join(f"transforms: {json.dumps(message['transforms'])}\n---\n" for message in MESSAGES),
    "noise": "WARNING: topic [/tf] does not appear to be published yet\n"
    + echoed("ros2", MESSAGES[0])
    + "A message was lost!!!\n\ttotal count change:1\n\ttotal count: 1---\n"
    + echoed("ros2", MESSAGES[1]),
    "a comment makes it slow": echoed("ros2", *MESSAGES).replace("stamp:", "stamp:  # of the robot"),
    "csv of ros1": CSV1,
    "csv of ros2": CSV2,
    "rosbridge": BRIDGE,
    "foxglove": "".join(foxglove(*each) + "\n" for each in EXPECTED),
    "foxglove, one message": '{"transforms": [' + ",".join(foxglove(*each) for each in EXPECTED) + "]}",
}


def recording(tmp_path: Path, text: str | bytes) -> FrameFile:
    path = tmp_path / "tf.txt"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return FrameFile(path)


def read(tmp_path: Path, text: str | bytes) -> list[Edge]:
    return list(recording(tmp_path, text).edges())


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("block", [1 << 20, 97])
def test_every_form_gives_the_same_samples_however_the_bytes_are_cut(
    form: str, block: int, tmp_path: Path, sizes: Sizes
) -> None:
    sizes(block=block)
    assert [each[:4] for each in read(tmp_path, FORMS[form])] == EXPECTED


@pytest.mark.parametrize("form", ["utf-16", "utf-8-sig"])
def test_other_encodings_give_the_same_samples(form: str, tmp_path: Path) -> None:
    assert [each[:4] for each in read(tmp_path, FORMS["echo of ros2"].encode(form))] == EXPECTED


def test_what_a_tool_printed_between_messages_is_told_once(tmp_path: Path) -> None:
    with pytest.warns(FrametoolWarning, match=r"tf\.txt:1: 4 lines printed between messages skipped") as caught:
        read(tmp_path, FORMS["noise"])
    assert len(caught) == 1


@pytest.mark.parametrize("form", ["echo of ros1", "a comment makes it slow"])
def test_a_sample_knows_the_line_on_which_it_begins(form: str, tmp_path: Path) -> None:
    lines = FORMS[form].split("\n")
    for sample in read(tmp_path, FORMS[form]):
        assert "header" in lines[sample.line - 1]
        assert sample.child in next(line for line in lines[sample.line :] if "child" in line)


def test_csv_of_ros1_knows_when_a_sample_was_received(tmp_path: Path) -> None:
    assert [each.received_ns for each in read(tmp_path, CSV1)] == [EPOCH + 500, EPOCH + 501]


def test_what_comes_by_tf_static_stands_still(tmp_path: Path) -> None:
    assert [each.stamp_ns for each in read(tmp_path, BRIDGE.replace('"/tf"', '"/robot/tf_static"'))] == [None, None]


def test_other_topics_of_a_bridge_are_left_out_and_counted(tmp_path: Path) -> None:
    other = json.dumps({"op": "publish", "topic": "/rosout", "msg": {"text": "x"}}) + "\n"
    with pytest.warns(FrametoolWarning, match="left out: 2 on /rosout"):
        assert len(read(tmp_path, BRIDGE + other + other)) == 2


GOOD = echoed("ros2", MESSAGES[0])
BAD = {
    "transforms:\n- header:\n    frame_id: map\n- '...'\n---\n": (4, "cut short here"),
    "transforms: '<sequence type: geometry_msgs/msg/TransformStamped, length: 1>'\n---\n": (1, "--no-arr"),
    GOOD.replace("x: 1.5", "x: .nan"): (10, "'.nan' is not finite"),
    GOOD.replace("w: 0.8", "w: 0.9"): (14, "norm 1.08167"),
    GOOD.replace("nanosec: 123456789", "nanosec: 1.5"): (5, "nanosec must be a whole number"),
    GOOD.replace("frame_id: map", "frame_id: ''"): (6, "frame_id must name a frame"),
    GOOD[:200].rpartition("\n")[0]: (9, "missing"),
    "linear:\n  x: 1.0\n---\n": (1, "expected a message with transforms"),
}


@pytest.mark.parametrize("text", BAD)
def test_what_is_wrong_is_placed_in_the_whole_file(text: str, tmp_path: Path) -> None:
    line, message = BAD[text]
    before = echoed("ros2", *MESSAGES)
    with pytest.raises(FormatError, match=message) as caught:
        read(tmp_path, before + text)
    assert caught.value.line >= before.count("\n") + line - (8 if "missing" in message else 0)
    assert caught.value.line <= before.count("\n") + line


def test_a_report_takes_the_errors_and_reading_goes_on(tmp_path: Path) -> None:
    errors: list[FormatError] = []
    bad = GOOD.replace("w: 0.8", "w: 0.9")
    samples = list(recording(tmp_path, GOOD + bad + GOOD).edges(errors.append))
    assert (len(samples), [error.line for error in errors]) == (2, [GOOD.count("\n") + 14])


def test_quaternions_of_few_digits_are_normalised_with_one_warning(tmp_path: Path) -> None:
    rough = GOOD.replace("z: 0.6", "z: 0.600000").replace("w: 0.8", "w: 0.80001")
    with pytest.warns(FrametoolWarning, match="2 quaternions were off norm 1") as caught:
        samples = read(tmp_path, rough + rough.replace("stamp:", "stamp: #"))
    assert (len(samples), len(caught)) == (2, 1)
    assert samples[0].components == samples[1].components


def test_fast_and_full_reading_agree_on_names_that_yaml_knows(tmp_path: Path) -> None:
    for name in ("on", "007", "12", "'null'", '"no"', "tool0", "a/b", "/base"):
        fast = GOOD.replace("frame_id: map", f"frame_id: {name}")
        full = fast.replace("stamp:", "stamp: #")
        with pytest.warns(FrametoolWarning, match="leading /") if name == "/base" else pytest.MonkeyPatch.context():
            first, second = read(tmp_path, fast), read(tmp_path, full)
        assert first[0][:4] == second[0][:4]


# --- bags ----------------------------------------------------------------------------------------------------------


RECORDED = [("/tf", EXPECTED[0]), ("/tf", EXPECTED[1]), ("/tf_static", EXPECTED[0])]


def write_bag(path: Path, kind: str, recorded: list[tuple[str, Any]] = RECORDED) -> None:
    """Write the two samples as /tf, and one more as /tf_static; or others."""
    from rosbags import typesys as stores

    store = stores.get_typestore(stores.Stores.ROS2_HUMBLE if kind != "ros1" else stores.Stores.ROS1_NOETIC)
    name = "tf2_msgs/msg/TFMessage"
    if name not in store.types:
        store.register(stores.get_types_from_msg("geometry_msgs/TransformStamped[] transforms", name))
    make = store.types

    def message(parent: str, child: str, numbers: tuple[float, ...], stamp_ns: int) -> Any:
        stamp = make["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
        seq = {"seq": 0} if kind == "ros1" else {}
        header = make["std_msgs/msg/Header"](stamp=stamp, frame_id=parent, **seq)
        moved = make["geometry_msgs/msg/Vector3"](*numbers[:3])
        turned = make["geometry_msgs/msg/Quaternion"](*numbers[3:])
        inner = make["geometry_msgs/msg/Transform"](moved, turned)
        return make[name]([make["geometry_msgs/msg/TransformStamped"](header, child, inner)])

    if kind == "ros1":
        from rosbags.rosbag1 import Writer as Writer1

        with Writer1(path) as writer:
            topics = {topic: writer.add_connection(topic, name, typestore=store) for topic in dict(recorded)}
            for topic, each in recorded:
                writer.write(topics[topic], each[3] + 7, store.serialize_ros1(message(*each), name))
        return
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    with Writer2(path, version=9, storage_plugin=StoragePlugin[kind]) as writer2:
        topics2 = {topic: writer2.add_connection(topic, name, typestore=store) for topic in dict(recorded)}
        for topic, each in recorded:
            writer2.write(topics2[topic], each[3] + 7, store.serialize_cdr(message(*each), name))


@pytest.mark.parametrize(("kind", "file"), [("ros1", ""), ("SQLITE3", ""), ("SQLITE3", "*.db3"), ("MCAP", "*.mcap")])
def test_a_bag_gives_its_samples_with_the_time_they_were_received(kind: str, file: str, tmp_path: Path) -> None:
    path = tmp_path / ("run.bag" if kind == "ros1" else "run")
    write_bag(path, kind)
    samples = list(FrameFile(next(path.glob(file)) if file else path).edges())
    assert [each[:4] for each in samples if each.stamp_ns is not None] == EXPECTED
    assert [each[:3] for each in samples if each.stamp_ns is None] == [EXPECTED[0][:3]]
    assert {each.received_ns for each in samples} == {EPOCH + 7, EPOCH + 8}


def test_without_the_extra_a_bag_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(b"#ROSBAG V2.0\n")
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(FileProblem, match=r"frametool\[bag\]"):
        list(FrameFile(path).edges())


def spoilt(data: bytes, draw: random.Random) -> bytes:
    """Return the bytes with one changed, or cut short."""
    at = draw.randrange(len(data))
    if draw.random() < 0.2:
        return data[:at]
    return data[:at] + bytes([data[at] ^ draw.choice((1, 4, 32, 128, 255))]) + data[at + 1 :]


def check_spoilt_bags(kind: str, folder: Path, count: int) -> None:
    """Read a bag that is spoilt in many ways; it comes out with every message, or with an error."""
    path = folder / ("run.bag" if kind == "ros1" else "run")
    write_bag(path, kind)
    file = path if kind == "ros1" else next(each for each in path.iterdir() if each.suffix != ".yaml")
    data, draw = file.read_bytes(), random.Random(1)  # noqa: S311 - not for secrets
    for _ in range(count):
        file.write_bytes(spoilt(data, draw))
        try:
            found = list(FrameFile(draw.choice((path, file))).edges())
        except FrametoolError:
            continue
        assert len(found) == 3


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", ["ros1", "SQLITE3", "MCAP"])
def test_a_spoilt_bag_never_comes_out_short_in_silence(kind: str, tmp_path: Path) -> None:
    check_spoilt_bags(kind, tmp_path, 30)


@pytest.mark.large
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", ["ros1", "SQLITE3", "MCAP"])
def test_a_bag_spoilt_in_many_ways_never_comes_out_short_in_silence(kind: str, tmp_path: Path) -> None:
    check_spoilt_bags(kind, tmp_path, 1000)


def refusal(path: Path) -> str:
    with pytest.raises(FrametoolError) as caught:
        list(FrameFile(path).edges())
    return str(caught.value).removeprefix(f"{path}: ")


@pytest.mark.parametrize("name", ["run.bag", "run.db3", "run.mcap"])
def test_an_empty_bag_is_named_as_that(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"")
    assert refusal(tmp_path / name) == "nothing in it: an empty file is not a bag"


def test_a_comment_that_begins_as_a_bag_does_makes_no_bag(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text("#ROSBAG V2.0\nframes: {a: {b: {xyz: [1, 2, 3]}}}\n")
    assert len(list(FrameFile(tmp_path / "t.yaml").edges())) == 2


def test_a_folder_without_metadata_is_no_bag(tmp_path: Path) -> None:
    assert refusal(tmp_path) == "is a directory; name a file in it, or the folder of a bag, with metadata.yaml"


# --- stamps --------------------------------------------------------------------------------------------------------

BEYOND = {
    "nanosec: 123456789": [("nanosec: 1000000000", "nanosec 1000000000 is beyond 0 .. 999999999")],
    "sec: 1700000000": [
        ("sec: 4294967296", "sec 4294967296 is beyond -2147483648 .. 4294967295"),
        ("sec: -2147483649", "sec -2147483649 is beyond -2147483648 .. 4294967295"),
    ],
}


@pytest.mark.parametrize(("old", "new", "said"), [(old, *each) for old, news in BEYOND.items() for each in news])
@pytest.mark.parametrize("slow", [False, True])
def test_a_stamp_that_no_message_can_hold_is_refused(old: str, new: str, said: str, slow: bool, tmp_path: Path) -> None:  # noqa: FBT001
    text = GOOD.replace(old, new)
    assert refusal_of(tmp_path, text.replace("stamp:", "stamp:  # slow") if slow else text).endswith(said)


def refusal_of(tmp_path: Path, text: str) -> str:
    (tmp_path / "tf.txt").write_text(text)
    return refusal(tmp_path / "tf.txt")


def test_seconds_of_ros1_are_not_negative(tmp_path: Path) -> None:
    text = echoed("ros1", MESSAGES[0]).replace("secs: 1700000000", "secs: -1")
    assert refusal_of(tmp_path, text).endswith("secs -1 is beyond 0 .. 4294967295")


def test_no_message_is_written_whose_stamp_no_message_can_hold() -> None:
    assert new_stamp(-1, "ros2") == {"sec": -1, "nanosec": 999_999_999}
    for form, stamp_ns in (("ros1", -1), ("ros1", 2**32 * 10**9), ("ros2", 2**63)):
        with pytest.raises(ValueInvalid, match="does not fit in ros"):
            new_stamp(stamp_ns, form)


DATES = {
    "2023-11-14T22:13:20Z": 0,
    "2023-11-14T22:13:20.123456789Z": 123_456_789,
    "2023-11-14T22:13:20.5000000000z": 500_000_000,
    "2023-11-15T00:13:20+02:00": 0,
    "2023-11-14t14:43:20.000000001-07:30": 1,
}


@pytest.mark.parametrize("date", DATES)
def test_foxglove_stamps_may_be_dates(date: str, tmp_path: Path) -> None:
    seconds = EXPECTED[0][3] // 10**9
    line = json.loads(foxglove(*EXPECTED[0])) | {"timestamp": date}
    (tmp_path / "f.jsonl").write_text(json.dumps(line) + "\n")
    (edge,) = FrameFile(tmp_path / "f.jsonl").edges()
    assert edge.stamp_ns == seconds * 10**9 + DATES[date]


@pytest.mark.parametrize("date", ["2023-02-30T00:00:00Z", "2023-11-14T22:13:20", "yesterday", "2023-11-14T25:13:20Z"])
def test_other_texts_are_no_dates(date: str, tmp_path: Path) -> None:
    line = json.loads(foxglove(*EXPECTED[0])) | {"timestamp": date}
    assert "expected a time as {sec, nsec} or 2023-11-14T22:13:20.5Z" in refusal_of(tmp_path, json.dumps(line) + "\n")


def test_an_mcap_file_without_a_summary_says_what_cannot_be_known(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", "MCAP", RECORDED[:2])
    file = tmp_path / "run" / "run.mcap"
    data = file.read_bytes()
    file.write_bytes(data[:-28] + bytes(20) + data[-8:])
    with pytest.warns(FrametoolWarning, match=r"run\.mcap has no summary: whether it lost messages cannot be known"):
        assert len(list(FrameFile(file).edges())) == 2


# --- topics --------------------------------------------------------------------------------------------------------

TWO_ROBOTS = [("/tf", EXPECTED[0]), ("/tf_static", EXPECTED[1]), ("/robot1/tf", EXPECTED[0])]


def bridged(path: Path, recorded: list[tuple[str, Any]]) -> Path:
    """Write a recording of rosbridge, one line a message."""
    lines = [{"op": "publish", "topic": topic, "msg": {"transforms": [transform(*each)]}} for topic, each in recorded]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


def two_robots(kind: str, folder: Path, recorded: list[tuple[str, Any]] = TWO_ROBOTS) -> Path:
    if kind == "rosbridge":
        return bridged(folder / "run.jsonl", recorded)
    path = folder / ("run.bag" if kind == "ros1" else "run")
    write_bag(path, kind, recorded)
    return path


KINDS = ["rosbridge", "ros1", "SQLITE3", "MCAP"]


@pytest.mark.parametrize("kind", KINDS)
def test_two_robots_that_use_the_same_names_are_not_merged(kind: str, tmp_path: Path) -> None:
    said = "frame 'base' comes by /tf and by /robot1/tf; choose with --topic /tf or --topic /robot1/tf"
    assert refusal(two_robots(kind, tmp_path)).endswith(said)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("topics", "count"), [(["/tf"], 1), (["tf", "tf_static"], 2), (["/robot1/tf"], 1), (["/robot1/tf", "/tf_static"], 2)]
)
def test_the_topics_chosen_are_read(kind: str, topics: list[str], count: int, tmp_path: Path) -> None:
    edges = list(FrameFile(two_robots(kind, tmp_path), topics=topics).edges())
    assert {edge.topic.strip("/") for edge in edges} == {topic.strip("/") for topic in topics}
    assert len(edges) == count


@pytest.mark.parametrize("kind", KINDS)
def test_a_topic_that_is_not_there_is_told_with_those_that_are(kind: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"no transforms on odom; topics: /robot1/tf, /tf, /tf_static"):
        list(FrameFile(two_robots(kind, tmp_path), topics=["/odom"]).edges())


def test_robots_with_names_of_their_own_are_one_tree(tmp_path: Path) -> None:
    apart = [("/tf", EXPECTED[0]), ("/robot1/tf", EXPECTED[1])]
    assert len(list(FrameFile(two_robots("rosbridge", tmp_path, apart)).edges())) == 2


def test_what_names_no_topics_is_read_whatever_is_chosen(tmp_path: Path) -> None:
    (tmp_path / "tf.txt").write_text(GOOD)
    assert len(list(FrameFile(tmp_path / "tf.txt", topics=["/odom"]).edges())) == 1


def test_the_command_line_chooses_and_lists_topics(run: Callable[..., Any], tmp_path: Path) -> None:
    path = str(two_robots("rosbridge", tmp_path))
    assert run("lookup", path, "map", "base").status == 1
    assert run("lookup", path, "map", "base", "--topic", "/robot1/tf").status == 0
    found = run("check", path)
    assert "transforms on /tf (1), /tf_static (1), /robot1/tf (1) [topics]" in found.out
    assert "frame 'base' comes by /tf and by /robot1/tf" in found.out
    entry = json.loads(run("monitor", path, "--topic", "tf", "-f", "json").out)
    assert entry["topics"] == "/tf (1)"


@pytest.mark.parametrize("kind", KINDS)
def test_monitor_tells_of_frames_that_come_by_two_robots_and_prints_its_table(run: Callable[..., Any], kind: str, tmp_path: Path) -> None:
    found = run("monitor", str(two_robots(kind, tmp_path)), "-f", "json")
    (error,) = map(json.loads, found.err.splitlines())
    assert "frame 'base' comes by /tf and by /robot1/tf; choose with --topic /tf or --topic /robot1/tf" in error["message"]
    assert (found.status, [json.loads(line)["child"] for line in found.out.splitlines()]) == (1, ["base", "cam 1"])


def test_monitor_names_the_first_of_many_frames_that_come_by_two_robots(run: Callable[..., Any], tmp_path: Path) -> None:
    parent, _, *rest = EXPECTED[0]
    many = [(topic, (parent, f"f{number}", *rest)) for topic in ("/tf", "/robot1/tf") for number in range(9)]
    found = run("monitor", str(two_robots("rosbridge", tmp_path, many)))
    assert found.status == 1
    assert [line.split(":", 1)[0] for line in found.err.splitlines()] == ["frametool"] * 4
    assert found.err.endswith("frametool: 6 more frames come by two topics\n")
