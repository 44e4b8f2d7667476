"""A message moves whole or not at all, however it is given and however many there are; an oracle of scipy says how."""

from __future__ import annotations

import copy
import csv
import itertools
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation
from ways import document, inline, values

if TYPE_CHECKING:
    from collections.abc import Callable

    from ways import Run

T = [1.0, -2.0, 0.5]
TURN = Rotation.from_euler("xyz", [20, -30, 110], degrees=True)
MAP_FROM_BASE = "{name: base, parent: map, xyz: [1, -2, 0.5], rpy_deg: [20, -30, 110]}"
TREE = {"tree.yaml": "frames:\n  map:\n    base: {xyz: [1, -2, 0.5], rpy_deg: [20, -30, 110]}\n"}
RANDOM = np.random.default_rng(3)


def spd(size: int) -> list[float]:
    root = RANDOM.normal(size=(size, size))
    return [float(each) / 1024.0 for each in (root @ root.T).ravel()]  # turns of less than 0.2 rad


def xyz(*numbers: float) -> dict[str, float]:
    return dict(zip("xyz", numbers, strict=True))


HEADERS = {
    "ros2": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "base"},
    "ros1": {"seq": 3, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": "base"},
}
HEADER = HEADERS["ros2"]
Q = {"x": 0.5, "y": -0.5, "z": 0.5, "w": 0.5}
NO_Q = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}
UNKNOWN = [-1.0] + [0.0] * 8
POSE = {"position": xyz(1.0, 2.0, 3.5), "orientation": Q}
BOTH = {"linear": xyz(0.5, -1.0, 2.0), "angular": xyz(0.25, 0.5, -0.75)}
WRENCH = {"force": xyz(0.5, -1.0, 2.0), "torque": xyz(0.25, 0.5, -0.75)}
MARKER = {
    "header": HEADER, "ns": "a", "id": 1, "type": 0, "action": 0, "pose": POSE, "scale": xyz(1.0, 2.0, 3.0),
    "color": {"r": 1.0, "g": 0.5, "b": 0.0, "a": 1.0}, "lifetime": {"sec": 0, "nanosec": 0}, "frame_locked": False,
    "points": [xyz(1.0, 0.0, 0.0), xyz(2.0, 0.0, 0.0)], "colors": [], "text": "", "mesh_resource": "",
}  # fmt: skip
IMU: dict[str, Any] = {
    "header": HEADER, "orientation": Q, "orientation_covariance": spd(3), "angular_velocity": xyz(0.25, 0.5, -0.75),
    "angular_velocity_covariance": spd(3), "linear_acceleration": xyz(0.5, -1.0, 9.5), "linear_acceleration_covariance": spd(3),
}  # fmt: skip
IMUS = {
    "Imu": IMU,
    "Imu without an orientation": IMU | {"orientation": NO_Q, "orientation_covariance": UNKNOWN},
    "Imu of which little is known": IMU | {"angular_velocity_covariance": UNKNOWN, "linear_acceleration_covariance": [0.0] * 9},
}
MESSAGES: dict[str, dict[str, Any]] = IMUS | {
    "MagneticField": {"header": HEADER, "magnetic_field": xyz(1e-5, 2e-5, -4e-5), "magnetic_field_covariance": spd(3)},
    "PointStamped": {"header": HEADER, "point": xyz(1.0, 2.0, 3.5)},
    "Vector3Stamped": {"header": HEADER, "vector": xyz(1.0, 2.0, 3.5)},
    "QuaternionStamped": {"header": HEADER, "quaternion": Q},
    "PolygonStamped": {"header": HEADER, "polygon": {"points": [xyz(1.0, 2.0, 0.0), xyz(2.0, 1.0, 0.0), xyz(0.0, 0.5, 0.0)]}},
    "PoseStamped": {"header": HEADER, "pose": POSE},
    "PoseWithCovarianceStamped": {"header": HEADER, "pose": {"pose": POSE, "covariance": spd(6)}},
    "Odometry": {
        "header": HEADER, "child_frame_id": "tool", "pose": {"pose": POSE, "covariance": spd(6)},
        "twist": {"twist": BOTH, "covariance": spd(6)},
    },
    "PoseArray": {"header": HEADER, "poses": [POSE, POSE, POSE]},
    "Path": {"header": HEADER, "poses": [{"header": HEADER, "pose": POSE}] * 2},
    "TransformStamped": {
        "header": HEADER, "child_frame_id": "tool", "transform": {"translation": xyz(1.0, 2.0, 3.5), "rotation": Q},
    },
    "TwistStamped": {"header": HEADER, "twist": BOTH},
    "TwistWithCovarianceStamped": {"header": HEADER, "twist": {"twist": BOTH, "covariance": spd(6)}},
    "AccelStamped": {"header": HEADER, "accel": BOTH},
    "AccelWithCovarianceStamped": {"header": HEADER, "accel": {"accel": BOTH, "covariance": spd(6)}},
    "WrenchStamped": {"header": HEADER, "wrench": WRENCH},
    "Marker": MARKER,
    "MarkerArray": {"markers": [MARKER, MARKER]},
    "in an envelope": {"op": "publish", "topic": "/imu", "msg": IMU},
}  # fmt: skip
PLAIN: dict[str, dict[str, Any]] = {
    "point with 3x3": {"frame": "base", "point": [1.0, 2.0, 3.5], "covariance": spd(3)},
    "point with rows": {"frame": "base", "point": [1.0, 2.0, 3.5], "covariance": np.reshape(spd(3), (3, 3)).tolist()},
    "point with position_covariance": {"frame": "base", "point": xyz(1.0, 2.0, 3.5), "position_covariance": spd(3)},
    "vector with 3x3": {"frame": "base", "vector": [1.0, 2.0, 3.5], "covariance": spd(3)},
    "vector of unknown covariance": {"frame": "base", "vector": [1.0, 2.0, 3.5], "covariance": UNKNOWN},
    "pose with two": {"frame": "base", **POSE, "position_covariance": spd(3), "orientation_covariance": spd(3)},
    "pose with 6x6": {"frame": "base", **POSE, "covariance": spd(6)},
    "pose of unknown covariance": {"frame": "base", **POSE, "covariance": [-1.0] + [0.0] * 35},
    "twist with 6x6": {"frame": "base", "twist": BOTH, "covariance": spd(6)},
    "wrench with 6x6": {"frame": "base", "wrench": WRENCH, "covariance": spd(6)},
}


# --- the oracle: what tf2 and imu_transformer do, by scipy ---


def numbers(value: Any) -> Any:
    return np.array(list(value.values()) if isinstance(value, dict) else value, float)


def like(value: Any, found: Any) -> Any:
    listed = np.asarray(found).tolist()
    return dict(zip(value, listed, strict=True)) if isinstance(value, dict) else listed


def point(value: Any) -> Any:
    return like(value, TURN.apply(numbers(value)) + T)


def vector(value: Any) -> Any:
    return like(value, TURN.apply(numbers(value)))


def quaternion(turn: Rotation) -> dict[str, float]:
    return dict(zip("xyzw", turn.as_quat(canonical=True).tolist(), strict=True))


def pose(value: Any) -> Any:
    where, turn = value
    return {where: point(value[where]), turn: quaternion(TURN * Rotation.from_quat(numbers(value[turn])))}


def covariance(value: Any, by: Any = None) -> Any:
    given = np.array(value, float)
    if given.ravel()[0] == -1.0:
        return value
    size = 3 if given.size == 9 else 6
    by = np.kron(np.eye(size // 3), TURN.as_matrix()) if by is None else by
    return (by @ given.reshape(size, size) @ by.T).reshape(given.shape).tolist()


CROSS = np.array([[0, -T[2], T[1]], [T[2], 0, -T[0]], [-T[1], T[0], 0]])
ZERO = np.zeros((3, 3))
R = TURN.as_matrix()
BY = {"twist": np.block([[R, CROSS @ R], [ZERO, R]]), "wrench": np.block([[R, ZERO], [CROSS @ R, R]])}
BY["accel"] = np.kron(np.eye(2), R)


def six(value: Any, kind: str) -> Any:
    one, two = value
    found = BY[kind] @ np.concatenate([numbers(value[one]), numbers(value[two])])
    return {one: like(value[one], found[:3]), two: like(value[two], found[3:])}


def moved(value: Any) -> Any:
    """Move a message or record, all of it."""
    found = copy.deepcopy(value)
    for key in ("header", "msg"):
        if key in value:
            found[key] = moved(value[key])
    for key in ("frame_id", "frame"):
        if key in value:
            found[key] = "map"
    if "angular_velocity" in value:
        known = value["orientation_covariance"][0] != -1.0
        turned = Rotation.from_quat(numbers(value["orientation"])) * TURN.inv() if known else None
        found |= {"orientation": quaternion(turned)} if turned is not None else {}
    elif "position" in value:
        found |= pose({key: value[key] for key in ("position", "orientation")})
    movers: dict[str, Callable[[Any], Any]] = {
        "point": point, "vector": vector, "angular_velocity": vector, "linear_acceleration": vector, "magnetic_field": vector,
        "quaternion": lambda each: quaternion(TURN * Rotation.from_quat(numbers(each))), "transform": pose,
        "polygon": lambda each: {"points": [point(one) for one in each["points"]]},
        "poses": lambda each: [moved(one) for one in each], "markers": lambda each: [moved(one) for one in each],
        "pose": lambda each: moved(each) if "pose" in each else pose(each),
    }  # fmt: skip
    found |= {key: move(value[key]) for key, move in movers.items() if key in value}
    for kind, held in value.items():
        if kind in BY and "pose" not in value:
            found[kind] = {kind: six(held[kind], kind)} if kind in held else six(held, kind)
            if "covariance" in held:
                found[kind]["covariance"] = covariance(held["covariance"], BY[kind])
    for key in value:
        if key.endswith("covariance"):
            found[key] = covariance(value[key], next((BY[kind] for kind in BY if kind in value), None))
    return found


def check(found: Any, wanted: Any, place: str = "") -> None:
    """Compare two values: the same keys, numbers to 12 digits, all else equal."""
    if isinstance(wanted, dict):
        assert list(found) == list(wanted), place
        for key, each in wanted.items():
            check(found[key], each, f"{place}.{key}")
    elif isinstance(wanted, list):
        assert len(found) == len(wanted), place
        for at, each in enumerate(wanted):
            check(found[at], each, f"{place}[{at}]")
    elif isinstance(wanted, float):
        assert found == pytest.approx(wanted, rel=1e-12, abs=1e-12), place
    else:
        assert found == wanted, place


CASES = MESSAGES | PLAIN
WAYS = ("argument", "flow", "json file", "yaml file", "line", "twenty lines", "lines", "array", "documents")
COUNTS = {"twenty lines": 20, "lines": 600, "array": 40, "documents": 40}


def given(run: Run, command: tuple[str, ...], way: str, record: Any, into: str) -> Any:
    line = json.dumps(record)
    count = COUNTS.get(way, 1)
    if way in ("argument", "flow"):
        return run(*command, "-f", into, line if way == "argument" else inline(record), files=TREE)
    if way.endswith("file"):
        name, text = ("one.json", line) if way == "json file" else ("one.yaml", document(record))
        return run(*command, "-f", into, "-i", name, files=TREE | {name: text})
    texts = {"array": "[" + ",\n".join([line] * count) + "]\n", "documents": "---\n".join([document(record)] * count)}
    return run(*command, "-f", into, stdin=texts.get(way, f"{line}\n" * count), files=TREE)


def keeps_its_form(way: str, into: str) -> bool:
    """Return True if a record keeps its spelling; an argument, or another format, has keys of its own."""
    return way not in ("argument", "flow") and into == ("yaml" if way in ("yaml file", "documents") else "json")


def floats_in(value: Any) -> list[float]:
    """Return the numbers of geometry in a value, small ones first."""
    if isinstance(value, (dict, list)):
        found = [floats_in(each) for each in (value.values() if isinstance(value, dict) else value)]
        return sorted(itertools.chain.from_iterable(found))
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("into", ["json", "yaml"])
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", CASES)
def test_all_of_a_message_moves_on_every_way(run: Run, name: str, way: str, into: str) -> None:
    if (way, into) in (("array", "yaml"), ("lines", "yaml")):
        return  # as the documents and the twenty lines
    for command in (("apply", "--transform", MAP_FROM_BASE), ("apply", "tree.yaml", "map")):
        done = given(run, command, way, CASES[name], into)
        assert (done.status, done.err) == (0, "")
        found = list(values(done.out, into))
        if not keeps_its_form(way, into):
            assert floats_in(found) == pytest.approx(floats_in([moved(CASES[name])] * COUNTS.get(way, 1)), rel=1e-12, abs=1e-12)
            assert {each.get("frame", each.get("parent")) for each in found} == {"map"}
            continue
        found = found[0] if way == "array" and into == "json" else found
        assert len(found) == COUNTS.get(way, 1)
        check(found[0], moved(CASES[name]))
        assert all(each == found[0] for each in found)


@pytest.mark.parametrize("name", ["Imu", "Odometry", "PoseArray"])
def test_ros_1_says_its_time_in_other_words(run: Run, name: str) -> None:
    record = MESSAGES[name] | {"header": HEADERS["ros1"]}
    for way in ("json file", "line", "twenty lines", "lines", "array"):
        done = given(run, ("apply", "tree.yaml", "map"), way, record, "json")
        found = next(values(done.out))
        check(found[0] if way == "array" else found, moved(record))


@pytest.mark.parametrize("first", [0, 1, 2])
def test_what_is_known_changes_from_row_to_row(run: Run, first: int) -> None:
    rows = [*IMUS.values()]
    rows = [*rows[first:], *rows[:first]] * 100
    done = run("apply", "--transform", MAP_FROM_BASE, stdin="".join(json.dumps(row) + "\n" for row in rows))
    assert (done.status, done.err) == (0, "")
    for found, row in zip(values(done.out), rows, strict=True):
        check(found, moved(row))


@pytest.mark.parametrize("spelt", ["-1", "-1.0", "-1.", "-1e0", "-1.0e+00"])
def test_unknown_is_unknown_however_it_is_spelt(run: Run, spelt: str) -> None:
    known = yaml.safe_dump(IMU, default_flow_style=True, width=10_000)
    text = known.replace(repr(IMU["orientation_covariance"][0]), spelt, 1)
    done = run("apply", "--transform", MAP_FROM_BASE, stdin="---\n".join([known, text] * 20))
    found = [each["orientation"] for each in yaml.load_all(done.out, yaml.CSafeLoader) if each]
    assert [each == Q for each in found] == [False, True] * 20
    assert f"orientation_covariance: [{spelt}," in done.out


def test_the_columns_of_an_imu(run: Run) -> None:
    out = run("apply", "--transform", MAP_FROM_BASE, "-f", "csv", stdin=f"{json.dumps(IMU)}\n").out
    (row,) = csv.DictReader(out.splitlines())
    assert (row["frame"], row["stamp_ns"]) == ("map", "1000000002")
    for field in ("orientation", "angular_velocity", "linear_acceleration"):
        assert [float(row[f"{field}_{axis}"]) for axis in IMU[field]] == pytest.approx([*moved(IMU)[field].values()], abs=1e-12)
        assert json.loads(row[f"{field}_covariance"]) == pytest.approx(moved(IMU)[f"{field}_covariance"], abs=1e-12)


# --- what is refused ---

WHAT = "may be given in a frame that changes, and would stay; leave out what does not move, see help records"
NOT_WHOLE = "that cannot be moved whole: its fields are"
SCAN = {"header": HEADER, "angle_min": -1.5, "angle_max": 1.5, "range_max": 30.0, "ranges": [1.0, 2.0], "intensities": []}
GRID = {"header": HEADER, "info": {"resolution": 0.05, "width": 1, "height": 1, "origin": POSE}, "data": [0]}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "LaserScan": (SCAN, f"a message {NOT_WHOLE} 'angle_min', 'angle_max', 'range_max', 'ranges', 'intensities'; see help records"),
    "OccupancyGrid": (GRID, f"a message {NOT_WHOLE} 'info', 'data'; see help records"),
    "Image": (
        {"header": HEADER, "height": 1, "width": 1, "encoding": "mono8", "is_bigendian": 0, "step": 1, "data": [7]},
        f"a message {NOT_WHOLE} 'height', 'width', 'encoding', 'is_bigendian', 'step', 'data'; see help records",
    ),
    "Range": ({"header": HEADER, "field_of_view": 0.1, "range": 2.0}, f"a message {NOT_WHOLE} 'field_of_view', 'range'; see help records"),
    "a message cut off": ({"header": HEADER}, f"a message {NOT_WHOLE} 'header'; see help records"),
    "JointState": (
        {"header": HEADER, "name": ["a", "b", "c"], "position": [1.0, 2.0, 3.0], "velocity": [], "effort": []}, f"'name' {WHAT}",
    ),
    "DetectionArray": (
        {"header": HEADER, "detections": [{"id": 1, "bbox": {"center": POSE, "size": xyz(1.0, 1.0, 1.0)}}]},
        f"a message {NOT_WHOLE} 'detections'; see help records",
    ),
    "a pose and more": (MESSAGES["PoseStamped"] | {"velocity": xyz(1.0, 0.0, 0.0)}, f"'velocity' {WHAT}"),
    "a point and a list": (MESSAGES["PointStamped"] | {"normal": [0.0, 0.0, 1.0]}, f"'normal' {WHAT}"),
    "a polygon and more": (MESSAGES["PolygonStamped"] | {"normal": xyz(0.0, 0.0, 1.0)}, f"'normal' {WHAT}"),
    "an Imu and more": (IMU | {"magnetic": xyz(0.0, 0.0, 1.0), "bias": [0.0, 0.0, 1.0]}, f"'magnetic', 'bias' {WHAT}"),
    "half an Imu": ({key: IMU[key] for key in ("header", "orientation", "angular_velocity")}, f"'angular_velocity' {WHAT}"),
    "a plain point and a vector": ({"frame": "base", "point": [1.0, 2.0, 3.0], "normal": xyz(0.0, 0.0, 1.0)}, f"'normal' {WHAT}"),
    "a plain pose and its twist": ({"frame": "base", **POSE, "twist": BOTH}, f"'twist' {WHAT}"),
    "a covariance of something else": (
        {"frame": "base", "point": [1.0, 2.0, 3.0], "velocity_covariance": [1.0] * 9}, f"'velocity_covariance' {WHAT}",
    ),
    "a covariance of six": ({"frame": "base", "point": [1.0, 2.0, 3.0], "covariance": [1.0] * 36}, "covariance has 36 numbers; 9 are needed (3x3, row-major: x y z)"),
    "a covariance of three": ({"header": HEADER, "twist": {"twist": BOTH, "covariance": [1.0] * 9}}, "covariance has 9 numbers; 36 are needed (6x6, row-major: x y z, turns about X Y Z)"),
    "a covariance cut short": (MESSAGES["MagneticField"] | {"magnetic_field_covariance": [1.0]}, "covariance has 1 number; 9 are needed (3x3, row-major: x y z)"),
}  # fmt: skip


def test_fields_of_another_message_are_no_misspelt_keys_of_a_pose(run: Run) -> None:
    done = run("convert", "-f", "tum", stdin=json.dumps({"header": HEADER, "point_step": 12, "row_step": 24, "data": [0]}) + "\n")
    assert (done.status, done.err.partition("found ")[2]) == (1, "the keys 'header', 'point_step', 'row_step', 'data'\n")


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_move_whole_is_a_bad_row(run: Run, name: str, way: str) -> None:
    record, why = REFUSED[name]
    done = given(run, ("apply", "--transform", MAP_FROM_BASE), way, record, "json")
    assert done.status in (1, 2)
    assert why in json.loads(done.err.splitlines()[0])["message"]
    assert not done.out.strip("[\n]")
    assert len(why) < 200


@pytest.mark.parametrize("name", ["Imu", "Odometry", "Marker", "MagneticField", "PolygonStamped"])
@pytest.mark.parametrize(
    "command",
    [("invert",), ("convert", "--axes", "ned_from_enu"), ("convert", "--world-axes", "ned_from_enu"),
     ("compose", MAP_FROM_BASE, "-"), ("compose", "-", MAP_FROM_BASE), ("relative", MAP_FROM_BASE, "-")],
    ids=" ".join,
)  # fmt: skip
def test_what_is_more_than_a_pose_is_moved_and_nothing_else(run: Run, command: tuple[str, ...], name: str) -> None:
    for count in (1, 40):
        done = run(*command, stdin=f"{json.dumps(MESSAGES[name])}\n" * count)
        assert (done.status, done.out) == (1, "")
        assert sum("note: " not in line for line in done.err.splitlines()) == 1


def test_the_notation_of_an_imu_changes_alone(run: Run) -> None:
    found = json.loads(run("convert", "--to", "rotvec", stdin=f"{json.dumps(IMU)}\n").out)
    assert found.pop("rotvec") == pytest.approx(Rotation.from_quat([*Q.values()]).as_rotvec().tolist())
    assert found == {key: value for key, value in IMU.items() if key != "orientation"}


# --- stamps ---

NO_STAMPS = ["-5", "1.5", "null", "true", "2000000000", '"x"']


@pytest.mark.parametrize("way", ["argument", "flow", "json file", "line", "twenty lines", "lines", "array", "documents"])
@pytest.mark.parametrize("key", ["sec", "nanosec"])
@pytest.mark.parametrize("bad", NO_STAMPS)
def test_a_stamp_that_is_none_is_refused_on_every_way(run: Run, bad: str, key: str, way: str) -> None:
    if (key, bad) in (("sec", "-5"), ("sec", "2000000000")):
        return  # seconds before 1970, and in 2033
    good, count = MESSAGES["PointStamped"], COUNTS.get(way, 1)
    stamp = {"sec": 1, "nanosec": 2} | {key: json.loads(bad)}
    record = good | {"header": {"stamp": stamp, "frame_id": "base"}}
    if count > 1:
        line = "\n---\n" if way == "documents" else ",\n" if way == "array" else "\n"
        dumped = [document(each).rstrip() if way == "documents" else json.dumps(each) for each in (*[good] * count, record, good)]
        text = line.join(dumped) + "\n"
        done = run("apply", "--transform", MAP_FROM_BASE, "--on-error", "skip", stdin=f"[{text}]\n" if way == "array" else text)
        assert (done.status, done.err.count("1 of ")) == (3, 1)
        return
    done = given(run, ("apply", "--transform", MAP_FROM_BASE), way, record, "json")
    assert done.status in (1, 2)
    assert key in done.err


@pytest.mark.parametrize("stamp", [{"sec": 4_294_967_295, "nanosec": 999_999_999}, {"sec": -5, "nanosec": 0}, {"sec": 0, "nanosec": 0}])
def test_stamps_at_the_ends_are_stamps(run: Run, stamp: dict[str, int]) -> None:
    record = MESSAGES["PointStamped"] | {"header": {"stamp": stamp, "frame_id": "base"}}
    for count in (1, 40):
        done = run("apply", "--transform", MAP_FROM_BASE, stdin=f"{json.dumps(record)}\n" * count)
        assert (done.status, done.out.count('"map"')) == (0, count)
