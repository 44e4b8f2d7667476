"""ROS messages keep the text of what does not move; bad ones are faults like bad rows."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

SHIFT = ("apply", "--transform", "{xyz: [1, 2, 3], name: a, parent: a}")
LINE = '{ "header" : {"stamp":{"sec":1,"nanosec":0},"frame_id":"a"},"f":1.50,"e":1e3,"h":1e400,"u":"\\u00e9\\/","m":-0,"point":{"x":1,"y":2,"z":3} }\n'
ECHO = "header:\n  stamp: {sec: 1, nanosec: 0}  # c\n  frame_id: 'a'\nk: 007\nm: \"on\"\npoint:\n  x: 1\n  y: 2.00\n  z: 3\n---\n"


def test_json_lines_keep_their_spelling(run: Run) -> None:
    found = run(*SHIFT, stdin=LINE * 2)
    assert (found.status, found.out) == (0, LINE.replace('"x":1,"y":2,"z":3', '"x":2.0,"y":4.0,"z":6.0') * 2)


def test_documents_keep_their_spelling(run: Run) -> None:
    wanted = ECHO.replace("x: 1", "x: 2.0").replace("y: 2.00", "y: 4.0").replace("z: 3", "z: 6.0")
    assert run(*SHIFT, stdin=ECHO * 2).out == wanted * 2


def test_names_of_frames_keep_their_quotes(run: Run) -> None:
    found = run("apply", "--transform", "{xyz: [1, 2, 3], name: a, parent: map}", stdin=ECHO)
    assert "frame_id: 'map'\n" in found.out
    found = run("apply", "--transform", "{xyz: [1, 2, 3], name: a, parent: map}", stdin=LINE)
    assert '"frame_id":"map"}' in found.out


BAD = ['{"header":{"frame_id":"a"},"k":}\n', '{"header":{"frame_id":"a"},"point":{"x":1,"y":2}}\n']


@pytest.mark.parametrize("bad", BAD)
def test_bad_messages_do_as_told(run: Run, bad: str) -> None:
    text = LINE + bad + LINE
    stopped = run(*SHIFT, stdin=text)
    assert (stopped.status, stopped.out.count("\n")) == (1, 1)
    skipped = run(*SHIFT, "--on-error", "skip", stdin=text)
    assert (skipped.status, skipped.out.count("\n")) == (3, 2)
    assert "stdin:2:" in skipped.err
    null = run(*SHIFT, "--on-error", "null", stdin=text)
    rows = [json.loads(line.replace("1e400", "0")) for line in null.out.splitlines()]
    assert [row is None or row["point"] is None for row in rows] == [False, True, False]


def test_a_message_without_data_at_its_time_is_a_bad_one(run: Run) -> None:
    tree = "".join(
        f"transforms:\n- header:\n    stamp:\n      sec: {sec}\n      nanosec: 0\n    frame_id: map\n  child_frame_id: a\n  transform:\n"
        f"    translation:\n      x: {sec}.0\n      y: 0.0\n      z: 0.0\n    rotation:\n      x: 0.0\n      y: 0.0\n      z: 0.0\n      w: 1.0\n---\n"
        for sec in (1, 2)
    )  # fmt: skip
    late = LINE.replace('"sec":1', '"sec":9')
    found = run("apply", "tf.txt", "map", "--on-error", "skip", stdin=LINE + late + LINE, files={"tf.txt": tree})
    assert (found.status, found.out.count("\n")) == (3, 2)
    assert "stdin:2:header" in found.err
    stopped = run("apply", "tf.txt", "map", stdin=LINE + late + LINE, files={"tf.txt": tree})
    assert (stopped.status != 0, stopped.out.count("\n")) == (True, 1)
    assert "stdin:2:header" in stopped.err


POSE = '{"position": {"x": 1.0, "y": 2.0, "z": 3.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}'
HEADER = '"header": {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "a"}'
SEEN = f'{{"id": [3], "size": [0.1], "pose": {{{HEADER}, "pose": {{"pose": {POSE}, "covariance": {[0.0] * 36}}}}}}}'
TAGS = f'{{{HEADER}, "detections": [{SEEN}, {SEEN}]}}\n'
BUNDLES = TAGS.replace("[3]", "[3, 4]").replace("[0.1]", "[0.1, 0.2]")


@pytest.mark.parametrize(("text", "option"), [(TAGS, ()), (BUNDLES, ()), (BUNDLES, ("--columns", "detections.pose"))])
def test_poses_of_tags_move_with_their_frames_named(run: Run, text: str, option: tuple[str, ...]) -> None:
    found = run(*SHIFT, *option, stdin=text * 2)
    assert (found.status, found.err, found.out) == (0, "", text.replace('"x": 1.0, "y": 2.0, "z": 3.0', '"x": 2.0, "y": 4.0, "z": 6.0') * 2)
    rows = run(*SHIFT, *option, "-f", "csv", stdin=text).out.splitlines()
    assert [row.split(",")[1:4] for row in rows] == [["x", "y", "z"], *[["2.0", "4.0", "6.0"]] * 2]


@pytest.mark.parametrize(("key", "status", "said"), [
    ("a", 1, "no key 'a' for --columns; keys: id, result"),
    ("result.pos", 1, "no key 'pos' for --columns; did you mean 'pose'? keys: pose"),
    ("result,id", 2, "--columns names one key of records, as detections.pose"),
    ("id", 1, "expected a point"),
])  # fmt: skip
def test_a_key_that_holds_no_pose_is_told_with_those_there_are(run: Run, key: str, status: int, said: str) -> None:
    found = run("convert", "--to", "rpy", "--columns", key, stdin='{"id": 1, "result": {"pose": {"xyz": [1, 2, 3]}}}\n')
    assert (found.status, said in found.err) == (status, True), found.err
