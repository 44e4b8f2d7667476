"""Clouds of bags: each message moves at its stamp, from the frame of its header, into a file of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

BILLION = 1_000_000_000
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
CLOUD, TF = "sensor_msgs/msg/PointCloud2", "tf2_msgs/msg/TFMessage"
ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF))
XYZ = np.random.default_rng(2).normal(size=(6, 3), scale=10.0).astype(np.float32)
KIND = [("x", "f4"), ("y", "f4"), ("z", "f4"), ("gap", "V4"), ("intensity", "u2"), ("ring", "u1")]


def header(store: Any, stamp_ns: int, frame: str) -> Any:
    seconds, below = divmod(stamp_ns, BILLION)
    stamp = store.types["builtin_interfaces/msg/Time"](seconds, below)
    kind = store.types["std_msgs/msg/Header"]
    return kind(0, stamp, frame) if store is ROS1 else kind(stamp, frame)


def cloud(store: Any = ROS2, stamp_ns: int = BILLION, frame: str = "lidar", *, big: bool = False, **changes: Any) -> Any:
    """Make a message: points with room between their fields, rows with room behind their points."""
    order = ">" if big else "<"
    height, width = 2, 3
    offsets = [0, 4, 8, 12, 16, 18]
    kind = np.dtype({"names": [name for name, _ in KIND], "formats": [order + code for _, code in KIND], "offsets": offsets, "itemsize": 24})
    rows = np.zeros((height, width), kind)
    for at, name in enumerate("xyz"):
        rows[name] = XYZ[:, at].reshape(height, width)
    rows["intensity"], rows["ring"] = np.arange(6).reshape(height, width) * 1000, 7
    data = b"".join(row.tobytes() + b"\xff" * 5 for row in rows)
    codes = {"f4": 7, "u2": 4, "u1": 2}
    field = store.types["sensor_msgs/msg/PointField"]
    fields = [field(name, offset, codes[code], 1) for (name, code), offset in zip(KIND, offsets, strict=True) if code in codes]
    values = {
        "header": header(store, stamp_ns, frame), "height": height, "width": width, "fields": fields, "is_bigendian": big,
        "point_step": 24, "row_step": width * 24 + 5, "data": np.frombuffer(data, np.uint8), "is_dense": True,
    }  # fmt: skip
    return store.types[CLOUD](**values | changes)


def pose(store: Any, stamp_ns: int, x: float) -> Any:
    """Make a message that says where the lidar is in the map."""
    types = store.types
    transform = types["geometry_msgs/msg/Transform"](
        types["geometry_msgs/msg/Vector3"](x, 0.0, 0.0), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.5**0.5, 0.5**0.5)
    )
    return types[TF]([types["geometry_msgs/msg/TransformStamped"](header(store, stamp_ns, "map"), "lidar", transform)])


def write(path: Path, messages: list[tuple[str, Any]], store: Any = ROS2, plugin: Any = None) -> str:
    """Write messages by their topics; return the bag's name."""
    writer: Any = Writer1(path) if store is ROS1 else Writer2(path, version=9, storage_plugin=plugin or StoragePlugin.MCAP)
    with writer as bag:
        connections: dict[str, Any] = {}
        for at, (topic, message) in enumerate(messages):
            kind = type(message).__msgtype__
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=store)
            data = (store.serialize_ros1 if store is ROS1 else store.serialize_cdr)(message, kind)
            bag.write(connections[topic], at, data)
    return path.name


def wanted(x: float) -> Any:
    """Return the points seen in the map: a quarter turn about z, then a shift."""
    return np.array([x - XYZ[:, 1], XYZ[:, 0], XYZ[:, 2]], np.float64).T


def drive(store: Any, count: int = 3) -> list[tuple[str, Any]]:
    """Return poses every second, and clouds in the middle between them."""
    poses = [("/tf", pose(store, at * BILLION, float(at))) for at in range(count + 1)]
    clouds = [("/points", cloud(store, at * BILLION + BILLION // 2, big=at % 2 == 1)) for at in range(count)]
    return [*poses, *clouds]


@pytest.mark.parametrize(
    ("name", "store", "plugin"),
    [("a.bag", ROS1, None), ("mcap", ROS2, StoragePlugin.MCAP), ("sqlite", ROS2, StoragePlugin.SQLITE3)],
)
def test_each_message_moves_at_its_stamp_by_the_tree_of_the_same_bag(run: Run, tmp_path: Path, name: str, store: Any, plugin: Any) -> None:
    bag = write(tmp_path / name, drive(store), store, plugin)
    done = run("apply", bag, "map", "-i", bag, "--topic", "/points", "-o", "scan_{stamp_ns}.pcd")
    assert (done.status, done.out) == (0, "")
    files = sorted(path.name for path in tmp_path.glob("scan_*"))
    assert files == ["scan_1500000000.pcd", "scan_2500000000.pcd", "scan_500000000.pcd"]
    for at in range(3):
        head, _, body = (tmp_path / f"scan_{at * BILLION + BILLION // 2}.pcd").read_bytes().partition(b"DATA binary\n")
        assert b"FIELDS x y z intensity ring\nSIZE 4 4 4 2 1\nTYPE F F F U U\n" in head
        assert b"WIDTH 3\nHEIGHT 2\n" in head
        points = np.frombuffer(body, [("xyz", "<f4", 3), ("intensity", "<u2"), ("ring", "u1")])
        assert np.allclose(points["xyz"], wanted(at + 0.5), rtol=1e-6, atol=1e-6)
        assert points["intensity"].tolist() == [0, 1000, 2000, 3000, 4000, 5000]
    assert f"{bag}: 18 points in map, metres, in 3 files (/points)" in done.err


def test_the_sensor_stands_where_its_frame_does(run: Run, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", drive(ROS2, 1))
    run("apply", bag, "map", "-i", bag, "-o", "{number}.pcd")
    head = (tmp_path / "000001.pcd").read_bytes().partition(b"DATA")[0].decode()
    words = next(line for line in head.splitlines() if line.startswith("VIEWPOINT")).split()[1:]
    assert np.allclose([float(word) for word in words], [0.5, 0, 0, 0.5**0.5, 0, 0, 0.5**0.5])


@pytest.mark.parametrize("options", [("/points",), ("points",)])
def test_arrays_are_written_too_and_names_may_hold_more(run: Run, tmp_path: Path, options: tuple[str, ...]) -> None:
    bag = write(tmp_path / "bag", drive(ROS2, 1))
    done = run("apply", bag, "map", "lidar", "-i", bag, "--topic", *options, "-o", "{topic}-{frame}-{stamp}.npy", "--at", "1.0")
    assert done.status == 0
    points = np.load(tmp_path / "points-lidar-0.500000000.npy")
    assert points.dtype.names == ("x", "y", "z", "intensity", "ring")
    assert np.allclose(np.array([points[name] for name in "xyz"]).T, wanted(1.0), rtol=1e-6, atol=1e-6)


def test_a_pose_moves_them_all(run: Run, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", drive(ROS2, 2))
    done = run("apply", "--transform", "{xyz: [5, 0, 0], rpy_deg: [0, 0, 90]}", "-i", bag, "-o", "{number}.ply")
    assert done.status == 0
    data = (tmp_path / "000002.ply").read_bytes()
    kind = [("xyz", "<f4", 3), ("intensity", "<u2"), ("ring", "u1")]
    points = np.frombuffer(data.partition(b"end_header\n")[2], kind)
    assert np.allclose(points["xyz"], wanted(5.0), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (("bag", "map"), 2, "each cloud of a bag is a file: -o 'scan_{stamp_ns}.pcd'; formats: "),
        (("bag", "map", "-o", "x.pcd"), 1, "bag: messages 1 and 2 would both become 'x.pcd'; put {stamp_ns} or {number} into its name"),
        (("bag", "map", "-o", "{nope}.pcd"), 1, "messages 1 and 2 would both become '{nope}.pcd'"),
        (("bag", "map", "-o", "{number}.pcd", "--topic", "/pionts"), 1, "bag: no clouds on /pionts; topics: /points ("),
        (("bag", "map", "base", "-o", "{number}.pcd"), 4, "unknown frame 'base'"),
        (("bag", "lidar", "map", "-o", "{number}.pcd"), 1, "bag: message 1: a record is expressed in 'lidar', not in 'map'"),
        (("bag", "map", "-o", "{number}.pcd", "--time-column", "t"), 2, "--time-column has no effect here"),
        (("bag", "map", "-o", "{number}.pcd", "--keep"), 2, "--keep has no effect here"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_one_line(run: Run, tmp_path: Path, arguments: tuple[str, ...], status: int, message: str) -> None:
    write(tmp_path / "bag", drive(ROS2, 2))
    done = run("apply", *arguments, "-i", "bag", "--quiet")
    assert done.status == status
    assert message in done.err.splitlines()[-1]


def test_several_topics_ask_for_one(run: Run, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", [*drive(ROS2, 1), ("/rear", cloud(stamp_ns=BILLION // 2))])
    done = run("apply", bag, "map", "-i", bag, "-o", "{number}.pcd")
    assert (done.status, done.err) == (2, "frametool: bag: several topics hold clouds; give --topic /points|/rear\n")
    assert run("apply", bag, "map", "-i", bag, "-o", "{topic}.pcd", "--topic", "/points", "--topic", "/rear").status == 0
    assert sorted(path.name for path in tmp_path.glob("*.pcd")) == ["points.pcd", "rear.pcd"]


def test_a_message_without_a_transform_is_skipped_if_told(run: Run, tmp_path: Path) -> None:
    messages = [*drive(ROS2, 2), ("/points", cloud(stamp_ns=9 * BILLION)), ("/points", cloud(stamp_ns=BILLION, frame="rear"))]
    bag = write(tmp_path / "bag", messages)
    stopped = run("apply", bag, "map", "-i", bag, "-o", "a{number}.pcd")
    assert stopped.status == 1
    assert "bag: message 3: no data for map -> lidar at 9.000000000" in stopped.err
    done = run("apply", bag, "map", "-i", bag, "-o", "b{number}.pcd", "--on-error", "skip")
    assert done.status == 3
    assert "bag: message 4: unknown frame 'rear'" in done.err
    assert sorted(path.name for path in tmp_path.glob("b*.pcd")) == ["b000001.pcd", "b000002.pcd"]


FIELD = ROS2.types["sensor_msgs/msg/PointField"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"width": 1000, "row_step": 24000}, "1000 x 2 points of 24 bytes in rows of 24000 (row_step) do not fit: the message has 154 bytes"),
        ({"row_step": 10}, "3 x 2 points of 24 bytes in rows of 10 (row_step) do not fit: the message has 154 bytes"),
        ({"point_step": 12}, "field 'intensity' ends at byte 18, a point has 12 (point_step)"),
        ({"fields": [FIELD("x", 0, 7, 1)]}, "no field y, z; fields: x"),
        ({"fields": [FIELD(name, 0, 9, 1) for name in "xyz"]}, "field 'x' has the datatype 9, known are 1 to 8"),
        ({"fields": [FIELD(name, 0, 7, 1) for name in "xyzx"]}, "field 'x' appears twice"),
        ({"fields": [FIELD("x", 0, 7, 4_000_000_000)]}, "field 'x' ends at byte 16000000000, a point has 24 (point_step)"),
        ({"width": 4_000_000_000, "height": 4_000_000_000, "row_step": 0}, "do not fit: the message has 154 bytes"),
    ],
)
def test_a_message_that_contradicts_itself_is_one_line(run: Run, tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    bag = write(tmp_path / "bag", [("/points", cloud(**changes))])
    done = run("apply", "--transform", "{xyz: [0, 0, 0]}", "-i", bag, "-o", "{number}.pcd", "--quiet")
    assert (done.status, len(done.err.splitlines())) == (1, 1)
    assert done.err.startswith("frametool: bag: message 1: ")
    assert message in done.err
    assert not list(tmp_path.glob("*.pcd"))


def test_a_message_without_points_is_a_file_without_points(run: Run, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", [("/points", cloud(width=0, height=1, data=np.empty(0, np.uint8)))])
    done = run("apply", "--transform", "{xyz: [0, 0, 0]}", "-i", bag, "-o", "{number}.pcd")
    assert done.status == 0
    assert b"WIDTH 0\nHEIGHT 1\n" in (tmp_path / "000001.pcd").read_bytes()


def test_a_file_that_is_there_is_not_replaced(run: Run, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", [("/points", cloud())])
    (tmp_path / "000001.pcd").write_text("mine")
    done = run("apply", "--transform", "{xyz: [0, 0, 0]}", "-i", bag, "-o", "{number}.pcd")
    assert (done.status, (tmp_path / "000001.pcd").read_text()) == (5, "mine")
    assert run("apply", "--transform", "{xyz: [0, 0, 0]}", "-i", bag, "-o", "{number}.pcd", "--force").status == 0


def test_the_name_of_a_frame_leads_into_no_other_folder(run: Run, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", [("/points", cloud(frame="..")), ("/points", cloud(frame="../../x"))])
    (tmp_path / "inner").mkdir()
    done = run("apply", "--transform", "{xyz: [0, 0, 0]}", "-i", bag, "-o", "inner/{frame}{number}.pcd")
    assert done.status == 0
    assert sorted(path.name for path in (tmp_path / "inner").iterdir()) == ["_000001.pcd", "__.._x000002.pcd"]
