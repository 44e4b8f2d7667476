"""Recordings cut and with bytes turned: read or refused, and never fewer samples without a word."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from oracles_of_use import cases

if TYPE_CHECKING:
    from random import Random

    from oracles_of_use import Tool

pytestmark = pytest.mark.fuzz
COUNT = 12


def echoed(at: int) -> str:
    return (
        f"transforms:\n- header:\n    stamp:\n      sec: {at}\n      nanosec: 5\n    frame_id: map\n  child_frame_id: base\n"
        f"  transform:\n    translation:\n      x: {at}.0\n      y: 0.0\n      z: 0.0\n"
        "    rotation:\n      x: 0.0\n      y: 0.0\n      z: 0.0\n      w: 1.0\n---\n"
    )


def line(at: int) -> str:
    stamp = {"sec": at, "nanosec": 5}
    inner = {"translation": {"x": at, "y": 0, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    return json.dumps({"transforms": [{"header": {"stamp": stamp, "frame_id": "map"}, "child_frame_id": "base", "transform": inner}]}) + "\n"


def foxglove(at: int) -> str:
    stamp = {"sec": at, "nsec": 5}
    inner = {"translation": {"x": at, "y": 0, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    return json.dumps({"timestamp": stamp, "parent_frame_id": "map", "child_frame_id": "base", **inner}) + "\n"


FORMS = {"echo.txt": echoed, "tf.jsonl": line, "foxglove.jsonl": foxglove}


def write_bag(kind: str) -> Path:
    """Write the samples as /tf into a bag, and return the file that holds them."""
    from rosbags import typesys

    name = "tf2_msgs/msg/TFMessage"
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if kind == "ros1" else typesys.Stores.ROS2_HUMBLE)
    if name not in store.types:
        store.register(typesys.get_types_from_msg("geometry_msgs/TransformStamped[] transforms", name))
    make = store.types

    def message(at: int) -> object:
        stamp = make["builtin_interfaces/msg/Time"](at, 5)
        header = make["std_msgs/msg/Header"](stamp=stamp, frame_id="map", **({"seq": 0} if kind == "ros1" else {}))
        moved, turned = make["geometry_msgs/msg/Vector3"](at, 0.0, 0.0), make["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
        inner = make["geometry_msgs/msg/Transform"](moved, turned)
        return make[name]([make["geometry_msgs/msg/TransformStamped"](header, "base", inner)])

    if kind == "ros1":
        from rosbags.rosbag1 import Writer as Writer1

        with Writer1(Path("one.bag")) as writer:
            topic = writer.add_connection("/tf", name, typestore=store)
            for at in range(COUNT):
                writer.write(topic, at * 10**9, store.serialize_ros1(message(at), name))
        return Path("one.bag")
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    with Writer2(Path(kind), version=9, storage_plugin=StoragePlugin[kind]) as writer2:
        topic2 = writer2.add_connection("/tf", name, typestore=store)
        for at in range(COUNT):
            writer2.write(topic2, at * 10**9, store.serialize_cdr(message(at), name))
    return next(path for path in Path(kind).iterdir() if path.suffix != ".yaml")


def damaged(random: Random, data: bytes) -> bytes:
    """Return bytes of which a few were turned, or that were cut."""
    changed = bytearray(data)
    for _ in range(random.choice([0, 1, 3])):
        changed[random.randrange(len(changed))] = random.randrange(256)
    return bytes(changed[: random.randrange(len(changed))] if random.random() < 0.3 else changed)


COMMANDS = [["monitor"], ["monitor", "-f", "json"], ["check"], ["lookup", "-f", "json"], ["echo"], ["tree"], ["tree", "-f", "json"]]


@pytest.mark.parametrize("name", [*FORMS, "ros1", "SQLITE3", "MCAP"])
def test_a_damaged_recording_is_read_or_refused(name: str, tool: Tool) -> None:
    if name in FORMS:
        Path(name).write_text("".join(map(FORMS[name], range(COUNT))))
    else:
        name = str(write_bag(name))
    whole = Path(name).read_bytes()
    for random in cases():
        data = damaged(random, whole)
        Path(name).write_bytes(data)
        command, *options = random.choice(COMMANDS)
        frames = ["map", "base"] if command in ("lookup", "echo") else []
        tool(command, name, *frames, *options)


@pytest.mark.parametrize("name", FORMS)
def test_a_sample_is_counted_or_told_of(name: str, tool: Tool) -> None:
    parts = list(map(FORMS[name], range(COUNT)))
    for random in cases(0.3):
        at = random.randrange(COUNT)
        broken = list(parts)
        broken[at] = re.sub(r"sec\W+\d+", "sec: oops", parts[at], count=1)
        Path(name).write_text("".join(broken))
        ending = tool("monitor", name, "-f", "json")
        assert ending.status or json.loads(ending.out.splitlines()[0])["count"] == COUNT
