"""Recordings of transforms: every form gives the same samples, whatever stands between them and however it is cut."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import pytest

from frametool.documents import chunks
from frametool.errors import FileProblem, FormatError, FrametoolWarning
from frametool.formats.recordings import Recording
from frametool.grammar.result import Style
from frametool.ros.echo_format import message_text

if TYPE_CHECKING:
    from pathlib import Path

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


def recording(tmp_path: Path, text: str | bytes) -> Recording:
    path = tmp_path / "tf.txt"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return Recording(path)


def read(tmp_path: Path, text: str | bytes) -> list[Edge]:
    return list(recording(tmp_path, text).edges())


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("block", [1 << 20, 97])
def test_every_form_gives_the_same_samples_however_the_bytes_are_cut(
    form: str, block: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chunks, "BLOCK", block)
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
    rough = GOOD.replace("w: 0.8", "w: 0.80001")
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


def write_bag(path: Path, kind: str) -> None:
    """Write the two samples as /tf, and one more as /tf_static."""
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
            topics = {topic: writer.add_connection(topic, name, typestore=store) for topic in ("/tf", "/tf_static")}
            for topic, each in [("/tf", EXPECTED[0]), ("/tf", EXPECTED[1]), ("/tf_static", EXPECTED[0])]:
                writer.write(topics[topic], each[3] + 7, store.serialize_ros1(message(*each), name))
        return
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    with Writer2(path, version=9, storage_plugin=StoragePlugin[kind]) as writer2:
        topics2 = {topic: writer2.add_connection(topic, name, typestore=store) for topic in ("/tf", "/tf_static")}
        for topic, each in [("/tf", EXPECTED[0]), ("/tf", EXPECTED[1]), ("/tf_static", EXPECTED[0])]:
            writer2.write(topics2[topic], each[3] + 7, store.serialize_cdr(message(*each), name))


@pytest.mark.parametrize(("kind", "file"), [("ros1", ""), ("SQLITE3", ""), ("SQLITE3", "*.db3"), ("MCAP", "*.mcap")])
def test_a_bag_gives_its_samples_with_the_time_they_were_received(kind: str, file: str, tmp_path: Path) -> None:
    path = tmp_path / ("run.bag" if kind == "ros1" else "run")
    write_bag(path, kind)
    samples = list(Recording(next(path.glob(file)) if file else path).edges())
    assert [each[:4] for each in samples if each.stamp_ns is not None] == EXPECTED
    assert [each[:3] for each in samples if each.stamp_ns is None] == [EXPECTED[0][:3]]
    assert {each.received_ns for each in samples} == {EPOCH + 7, EPOCH + 8}


def test_without_the_extra_a_bag_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(b"#ROSBAG V2.0\n")
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(FileProblem, match=r"frametool\[bag\]"):
        list(Recording(path).edges())
