"""Expressions over rows: right numbers in bulk, the same bytes alone and by the million, frames checked row by row."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import independent as by
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from collections.abc import Callable

ROBOT, DRIVE = str(by.EXAMPLES / "robot.yaml"), str(by.EXAMPLES / "drive.yaml")
COUNT = 300
SEEDED = np.random.default_rng(5)
XYZ, TURNS, K = SEEDED.normal(size=(COUNT, 3)) * 4, Rotation.random(COUNT, rng=SEEDED), SEEDED.uniform(-1, 1, COUNT)
STAMPS = SEEDED.uniform(0, 3.9, COUNT).round(9)
HEAD = "id,stamp,x,y,z,qx,qy,qz,qw,k"
ROWS = [
    f"{at},{float(STAMPS[at])!r},{','.join(map(repr, [*XYZ[at].tolist(), *TURNS[at].as_quat().tolist(), float(K[at])]))}" for at in range(COUNT)
]  # fmt: skip
TABLE = "\n".join([HEAD, *ROWS, ""])
POSES = np.tile(np.eye(4), (COUNT, 1, 1))
POSES[:, :3, :3], POSES[:, :3, 3] = TURNS.as_matrix(), XYZ
X = by.pose([1, 2, 3], rpy_deg=[10, 20, 30])
LITERAL = "{xyz: [1, 2, 3], rpy_deg: [10, 20, 30]}"


def column(out: str, *names: str) -> Any:
    """Return some columns of a table."""
    head, *rows = (line.split(",") for line in out.splitlines())
    return np.array([[float(row[head.index(name)]) for name in names] for row in rows])


def matrices(out: str) -> Any:
    """Return the poses of a table."""
    found = np.tile(np.eye(4), (len(out.splitlines()) - 1, 1, 1))
    found[:, :3, 3] = column(out, *"xyz")
    found[:, :3, :3] = Rotation.from_quat(column(out, "qx", "qy", "qz", "qw")).as_matrix()
    return found


@pytest.mark.parametrize(("text", "expected"), [
    ("inv(X) * row * X", by.inverse(X) @ POSES @ X),
    ("row ^ -1", np.array([by.inverse(each) for each in POSES])),
    ("row ^ row.k", np.array([by.exponential(k * by.logarithm(each)) for k, each in zip(K, POSES, strict=True)])),
    ("interp(X, row, row.k)", np.array([by.interpolated(X, each, k) for k, each in zip(K, POSES, strict=True)])),
    ("mean(row, X, X)", np.array([by.mean(each, X, X) for each in POSES])),
    ("exp(log(row) + [0, 0, 0, 0, 0, 0])", POSES),
    ("rot(row) * X", np.array([by.pose([0, 0, 0], quaternion=q) @ X for q in TURNS.as_quat()])),
])  # fmt: skip
def test_a_pose_of_each_row_is_scipys(text: str, expected: Any, run: Callable[..., Any]) -> None:
    done = run("calc", f"X={LITERAL}", text, stdin=TABLE)
    assert done.status == 0, done.err
    assert np.abs(matrices(done.out) - expected).max() < 1e-12 * 10
    assert [line.split(",")[0] for line in done.out.splitlines()] == [line.split(",")[0] for line in TABLE.splitlines()]


def test_named_results_stand_in_columns_of_their_own(run: Callable[..., Any]) -> None:
    done = run(
        "calc", f"X={LITERAL}", "half = row ^ 0.5", "-e", "d=dist(row, X)", "-e", "twice=2 * d", "-e", "p=X * trans(row)", "-e", "a=rpy(half * half)",
        "--deg", stdin=TABLE,
    )  # fmt: skip
    head, first, *_ = done.out.splitlines()
    assert head == f"{HEAD},d,twice,p_x,p_y,p_z,a_roll_deg,a_pitch_deg,a_yaw_deg"
    assert first.startswith(ROWS[0] + ",")
    far = np.linalg.norm(XYZ - X[:3, 3], axis=1)
    assert np.abs(column(done.out, "d", "twice") - np.stack([far, 2 * far], axis=1)).max() < 1e-13
    assert np.abs(column(done.out, "p_x", "p_y", "p_z") - (XYZ @ X[:3, :3].T + X[:3, 3])).max() < 1e-13
    angles = column(done.out, "a_roll_deg", "a_pitch_deg", "a_yaw_deg")
    assert np.abs(Rotation.from_euler("xyz", angles, degrees=True).as_matrix() - POSES[:, :3, :3]).max() < 1e-12


def test_a_row_is_looked_up_at_its_own_time(run: Callable[..., Any]) -> None:
    done = run("calc", "--tree", DRIVE, "-e", "p=(map<-lidar @ row) * trans(row)", stdin=TABLE)
    expected = [(by.drive_lidar(at) @ [*xyz, 1])[:3] for at, xyz in zip(STAMPS, XYZ, strict=True)]
    assert np.abs(column(done.out, "p_x", "p_y", "p_z") - expected).max() < 1e-12
    late = run("calc", "--tree", DRIVE, "map<-lidar @ row", "--on-error", "skip", stdin="t,id\n1,a\n9,b\n2,c\n")
    assert (late.status, len(late.out.splitlines())) == (3, 3)
    assert "stdin:3: no data for map -> base_link at 9.000000000" in late.err


SHAPES: dict[str, Callable[[int], dict[str, Any]]] = {
    "pose": lambda at: {"id": at, "parent": "map", "name": "tool", "xyz": XYZ[at].tolist(), "quaternion": dict(zip("xyzw", TURNS[at].as_quat().tolist(), strict=True)), "k": K[at]},
    "point": lambda at: {"point": XYZ[at].tolist(), "k": K[at], "frame": "map"},
    "flat": lambda at: {"x": XYZ[at][0], "y": 2, "z": 3, "roll_deg": at, "pitch_deg": 1, "yaw_deg": 0, "k": K[at]},
    "message": lambda at: {"header": {"frame_id": "map", "stamp": {"sec": 1, "nanosec": at}}, "k": K[at], "pose": {"position": dict(zip("xyz", XYZ[at].tolist(), strict=True)), "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}},
}  # fmt: skip
TEXTS = ["inv(row)", "trans(row)", "dist(row, row)", "row ^ row.k", "X * row", "rpy(row)", "vector(row)", "row.k * 2", "e:d=row.k", "e:p=row"]


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("form", ["json", "yaml"])
def test_records_are_the_same_one_by_one_and_in_bulk(form: str, shape: str, text: str, run: Callable[..., Any]) -> None:
    records = [json.dumps(SHAPES[shape](at)) for at in range(20)]
    expression = ["-e", text[2:]] if text.startswith("e:") else [text]
    between = "\n" if form == "json" else "\n---\n"

    def calculated(some: list[str]) -> Any:
        return run("calc", "--in", form, f"X={LITERAL}", *expression, stdin=between.join(some) + "\n")

    bulk, single = calculated(records), [calculated(some) for some in (records[:1], records[1:16], records[16:])]
    assert bulk.status == single[0].status
    if bulk.status == 0:
        assert bulk.out.rstrip("\n") == between.join(each.out.rstrip("\n") for each in single)
        assert bulk.out.count('"id"') == "".join(records).count('"id"')
    else:
        assert "frametool: stdin:1: " in bulk.err or "takes a" in bulk.err


@pytest.mark.parametrize("begin", ["", "- "])
@pytest.mark.parametrize(("text", "added"), [("trans(row)", {"point": [1, 2, 3]}), ("norm(trans(row))", {"result": 14**0.5}), ("-eb=row.id", {"b": 7})])
def test_a_result_without_a_rotation_is_yaml_in_a_block_of_lines(begin: str, text: str, added: dict[str, Any], run: Callable[..., Any]) -> None:
    pose = ["id: 7", "xyz: [1, 2, 3]", "rpy:", "- 0", "- 0", "- 1"]
    block = begin + f"\n{' ' * len(begin)}".join(pose) + "\n"
    found = yaml.safe_load(run("calc", text, stdin=block).out)
    kept = {"xyz": [1, 2, 3], "rpy": [0, 0, 1]} if "b" in added else {}
    assert (found[0] if begin else found) == {"id": 7, **kept, **added}


@pytest.mark.parametrize("around", ["", "pose"])
def test_numbers_are_added_beside_a_covariance_that_stays(around: str, run: Callable[..., Any]) -> None:
    pose = {"position": {"x": 3, "y": 0, "z": 4}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    record: dict[str, Any] = {"covariance": np.eye(6).ravel().tolist(), **({around: pose} if around else pose)}
    record = {"header": {"frame_id": "map"}, "pose": record} if around else record
    done = run("calc", "-e", "d=norm(trans(row))", stdin=json.dumps(record) + "\n")
    assert (json.loads(done.out), done.err) == ({**record, "d": 5.0}, "")


@pytest.mark.parametrize("text", ["row", "inv(row)", "trans(row)", "norm(trans(row))"])
@pytest.mark.parametrize("count", [2, 20])
def test_the_result_of_a_message_has_its_stamp_in_another_format(text: str, count: int, run: Callable[..., Any]) -> None:
    pose = {"position": {"x": 3, "y": 0, "z": 4}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    messages = ({"header": {"stamp": {"sec": at, "nanosec": 5}, "frame_id": "map"}, "pose": pose} for at in range(count))
    done = run("calc", text, "-f", "csv", stdin="".join(json.dumps(message) + "\n" for message in messages))
    assert column(done.out, "stamp_ns").ravel().tolist() == [at * 1_000_000_000 + 5 for at in range(count)]


def test_tables_and_records_have_the_same_numbers(run: Callable[..., Any]) -> None:
    lines = "".join(json.dumps(SHAPES["pose"](at)) + "\n" for at in range(COUNT))
    arguments = ("calc", f"X={LITERAL}", "-e", "p=inv(X) * row * X", "-e", "a=angle(row)")
    table, records = run(*arguments, stdin=TABLE).out, run(*arguments, stdin=lines).out
    names = ["p_x", "p_y", "p_z", "p_qx", "p_qy", "p_qz", "p_qw", "a"]
    assert column(table, *names).tolist() == [[json.loads(line)[name] for name in names] for line in records.splitlines()]


def test_a_row_in_another_frame_is_a_bad_row(run: Callable[..., Any]) -> None:
    rows = "frame,x,y,z\nlidar,1,2,3\nimu_link,1,2,3\nlidar,4,5,6\n"
    done = run("calc", "--tree", ROBOT, "(map<-lidar) * row", "--on-error", "skip", stdin=rows)
    assert done.status == 3
    assert [line.split(",")[0] for line in done.out.splitlines()] == ["frame", "map", "map"]
    assert "stdin:3:frame: map<-lidar * a point in 'imu_link': 'lidar' and 'imu_link' do not touch" in done.err
    empty = run("calc", "--tree", ROBOT, "(map<-lidar) * row", "--on-error", "null", stdin=rows)
    assert empty.out.splitlines()[2] == "imu_link,,,"


@pytest.mark.parametrize(("text", "named"), [
    ("inv(row)", ["map,tool", "map,map", "a,a", "b,lidar"]),
    ("row * row", ["", "map,map", "a,a", ""]),
    ("(map<-lidar) * row", ["", "", "", ""]),
    ("row * (lidar<-map)", ["", "", "", "map,b"]),
    ("row * {xyz: [1, 0, 0]} as b<-new", ["", "", "", ""]),
    ("{xyz: [1, 0, 0]} as new<-a * row", ["", "", "a,new", ""]),
    ("row ^ 1", ["tool,map", "map,map", "a,a", "lidar,b"]),
])  # fmt: skip
def test_frames_of_rows_are_checked_whatever_they_are_called(text: str, named: list[str], run: Callable[..., Any]) -> None:
    rows = ["tool,map", "map,map", "a,a", "lidar,b"]
    table = "".join(f"{names},1,2,3,0,0,0,1\n" for names in rows)
    done = run("calc", "--tree", ROBOT, text, "--on-error", "null", stdin=f"name,parent,x,y,z,qx,qy,qz,qw\n{table}")
    found = done.out.splitlines()[1:]
    assert [",".join(line.split(",")[:2]) if line.split(",")[2] else "" for line in found] == named


def test_a_row_without_a_value_says_why(run: Callable[..., Any]) -> None:
    done = run("calc", "-e", "q=1 / row.k", "-e", "w=acos(row.x)", "--on-error", "skip", stdin="x,y,z,k\n1,0,0,1\n0.5,0,0,0\n3,0,0,2\n")
    assert done.out == "x,y,z,k,q,w\n1,0,0,1,1.0,0.0\n"
    assert "stdin:3: division by zero" in done.err
    assert "stdin:4: acos() takes -1 .. 1, found 3" in done.err


def test_powers_of_rows_are_those_of_single_numbers(run: Callable[..., Any]) -> None:
    done = run("calc", "-e", "p=(row.k + 2) ^ 2.7", "-e", "q=2.5 ^ row.k", stdin=TABLE)
    assert column(done.out, "p", "q").tolist() == [[(k + 2) ** 2.7, 2.5**k] for k in K.tolist()]


@pytest.mark.parametrize(("row", "told"), [("0", "division by zero"), ("-2", "-2 has no power -2.5"), ("1e-200", "the result is not finite")])
def test_a_row_without_a_power_says_why(row: str, told: str, run: Callable[..., Any]) -> None:
    done = run("calc", "-e", "p=row.k ^ -2.5", "--on-error", "skip", stdin=f"x,y,z,k\n1,2,3,4\n1,2,3,{row}\n")
    assert (done.out, done.err.splitlines()[0]) == ("x,y,z,k,p\n1,2,3,4,0.03125\n", f"frametool: stdin:3: {told} (row skipped)")


@pytest.mark.parametrize(("arguments", "status", "told"), [
    (["row * x"], 1, "unknown name 'x'\n  row * x\n        ^"),
    (["(map<-lidar) * row"], 2, "give --tree FILE"),
    (["row * row.nope"], 2, "no column 'nope'"),
    (["row", "row"], 2, "-e NAME=EXPR"),
    (["-e", "x=norm(row)"], 2, "columns x would appear twice; name the new ones with --prefix"),
    (["-e", "d=norm(row)", "-e", "d=1"], 2, "-e d= appears twice"),
    (["map<-base @ row", "--tree", DRIVE], 4, "unknown frame 'base'"),
    (["map<-base_link @ row", "--tree", DRIVE], 2, "no column looks like stamps; name it with --time-column"),
    (["row", "--time-column", "k"], 2, "--time-column has no effect here"),
    (["inv(row)", "--as", "point"], 1, "inv() takes a pose, found a point"),
])  # fmt: skip
def test_what_cannot_be_asked_of_rows_is_said_before_any_is_read(arguments: list[str], status: int, told: str, run: Callable[..., Any]) -> None:
    done = run("calc", *arguments, stdin="x,y,z,k\n1,2,3,4\n")
    assert (done.status, done.out) == (status, "")
    assert told in done.err


def test_the_result_replaces_ours_or_stands_beside(run: Callable[..., Any]) -> None:
    rows = "id,x,y,z,roll_deg,pitch_deg,yaw_deg,tag\n1,1,2,3,0,0,90,a\n"
    assert run("calc", "trans(row)", stdin=rows).out == "id,x,y,z,tag\n1,1.0,2.0,3.0,a\n"
    assert run("calc", "norm(trans(row))", stdin=rows).out.startswith("id,result,tag\n1,3.74")
    kept = run("calc", "inv(row)", "--keep", "--prefix", "i_", "--to", "rpy_deg", stdin=rows).out
    assert kept == f"{rows.splitlines()[0]},i_x,i_y,i_z,i_roll_deg,i_pitch_deg,i_yaw_deg\n1,1,2,3,0,0,90,a,-2.0,1.0,-3.0,0.0,0.0,-90.0\n"
    assert run("calc", "trans(row) - row.x * vector([1, 0, 0])", "--as", "pose", stdin="x,y,z\n1,2,3\n").out == "x,y,z\n0.0,2.0,3.0\n"
    assert run("calc", "row", "--as", "vector", "-f", "json", "--in", "json", stdin="[1, 2, 3]\n").out == "[1.0, 2.0, 3.0]\n"


def test_a_table_of_poses_is_a_list_with_a_name(run: Callable[..., Any]) -> None:
    done = run("calc", "l=t.csv", "mean(l)", "-f", "csv", files={"t.csv": TABLE})
    expected = by.mean(*POSES)
    assert np.abs(matrices(done.out)[0] - expected).max() < 1e-12
