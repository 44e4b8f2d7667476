"""The files that the ways of rows are run with, of any number of rows, made of plain products and no chance.

Positions have two or three decimals; rotations are taken from a few whose components are exact in decimal, so that
every system writes the same text.
"""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

ROOT = Path(__file__).resolve().parents[2]
TURNS = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.6, 0.8), (0.5, -0.5, 0.5, 0.5), (0.28, 0.0, 0.0, 0.96), (0.0, -0.6, 0.0, 0.8), (0.1, 0.7, -0.1, 0.7))
FRAMES = ("lidar", "imu_link", "tool")
FIRST_NS = 1_700_000_000_000_000_000
STEP_NS = 100_000_000
TAGS = ('"a,b"', "c", "", "d e", '"say ""no"""')


class _Plain(yaml.SafeDumper):
    """Write every mapping where it stands, without anchors."""

    def ignore_aliases(self, _data: Any) -> bool:
        return True


def position(at: int) -> tuple[float, float, float]:
    return at * 25 % 1000 / 100, -(at * 7 % 300) / 100, at % 11 / 8


def turn(at: int) -> tuple[float, float, float, float]:
    return TURNS[at % len(TURNS)]


def seconds(at: int) -> str:
    stamp = FIRST_NS + at * STEP_NS
    return f"{stamp // 10**9}.{stamp % 10**9:09d}"


def xyz(at: int) -> dict[str, float]:
    return dict(zip("xyz", position(at), strict=True))


def xyzw(at: int) -> dict[str, float]:
    return dict(zip("xyzw", turn(at), strict=True))


def cells(at: int) -> str:
    return ",".join(map(str, (*position(at), *turn(at))))


POSE_COLUMNS = "x,y,z,qx,qy,qz,qw"
SIGMAS = ",".join(f"sigma_{each}" for each in ("x", "y", "z", "roll", "pitch", "yaw"))


def table(head: str, row: Callable[[int], str], delimiter: str = ",") -> Callable[[int], str]:
    """Make what writes a table; no cell that is parted by another delimiter holds a comma."""

    def write(count: int) -> str:
        text = "".join(f"{line}\n" for line in (*([head] if head else []), *map(row, range(count))))
        return text.replace(",", delimiter)

    return write


def lines(record: Callable[[int], Any]) -> Callable[[int], str]:
    return lambda count: "".join(json.dumps(record(at)) + "\n" for at in range(count))


def array(record: Callable[[int], Any]) -> Callable[[int], str]:
    return lambda count: json.dumps([record(at) for at in range(count)], separators=(",", ":")) + "\n"


def pretty(record: Callable[[int], Any]) -> Callable[[int], str]:
    return lambda count: json.dumps([record(at) for at in range(count)], indent=2) + "\n"


def documents(record: Callable[[int], Any]) -> Callable[[int], str]:
    """Make what writes YAML as `ros2 topic echo` prints it: `---` behind each document."""
    return lambda count: "".join(yaml.dump(record(at), Dumper=_Plain, sort_keys=False) + "---\n" for at in range(count))


def pose(at: int) -> dict[str, Any]:
    return {"id": at, "frame": "lidar", "name": f"box{at % 3}", "xyz": [*position(at)], "quaternion": xyzw(at), "score": at / 4}


def point(at: int) -> dict[str, Any]:
    return {"id": at, "frame": FRAMES[at % 3], "point": [*position(at)], "tags": ["a", at]}


def header(at: int, frame: str = "lidar") -> dict[str, Any]:
    stamp = FIRST_NS + at * STEP_NS
    return {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": frame}


def pose_message(at: int) -> dict[str, Any]:
    return {"position": xyz(at), "orientation": xyzw(at)}


def transform_stamped(at: int) -> dict[str, Any]:
    return {"header": header(at, "odom"), "child_frame_id": "base", "transform": {"translation": xyz(at), "rotation": xyzw(at)}}


def with_covariance(at: int) -> dict[str, Any]:
    return {"pose": pose_message(at), "covariance": [(1 + at % 4) / 64 if each % 7 == 0 else 0.0 for each in range(36)]}


def odometry(at: int) -> dict[str, Any]:
    twist = {"linear": {"x": 0.5, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.25}}
    own = {"twist": twist, "covariance": [0.0] * 36}
    return {"header": header(at), "child_frame_id": "base", "pose": with_covariance(at), "twist": own}


MESSAGES: dict[str, Callable[[int], Any]] = {
    "pose_stamped": lambda at: {"header": header(at), "pose": pose_message(at)},
    "transform_stamped": transform_stamped,
    "tf": lambda at: {"transforms": [transform_stamped(at), transform_stamped(at + 1)]},
    "odometry": odometry,
    "point_stamped": lambda at: {"header": header(at), "point": xyz(at)},
    "pose_array": lambda at: {"header": header(at), "poses": [pose_message(at), pose_message(at + 1)]},
}


def fix(at: int) -> dict[str, float]:
    return {"lat": 48.1 + at * 7 % 1000 / 100000, "lon": 11.5 + at % 500 / 100000, "alt": 500 + at % 40 / 8}


def fix_row(at: int) -> str:
    return f"{seconds(at)},{','.join(format(each, '.6g') for each in fix(at).values())},{at % 2}"


def kitti(count: int) -> str:
    """Write twelve numbers a pose: a turn about z of cosine 0.28 and sine 0.96, or none."""
    turns = ("1 0 0", "0 1 0", "0 0 1"), ("0.28 -0.96 0", "0.96 0.28 0", "0 0 1")
    rows = ([f"{row} {where}" for row, where in zip(turns[at % 2], position(at), strict=True)] for at in range(count))
    return "".join(" ".join(row) + "\n" for row in rows)


def euroc(count: int) -> str:
    head = "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
    rows = ((FIRST_NS + at * STEP_NS, *position(at), turn(at)[3], *turn(at)[:3]) for at in range(count))
    return head + "".join(",".join(map(str, row)) + "\n" for row in rows)


def g2o(count: int) -> str:
    vertices = (f"VERTEX_SE3:QUAT {at} {cells(at).replace(',', ' ')}\n" for at in range(count))
    information = "100 0 0 0 0 0 100 0 0 0 0 100 0 0 0 400 0 0 400 0 400"
    edges = (f"EDGE_SE3:QUAT {at} {at + 1} {cells(at).replace(',', ' ')} {information}\n" for at in range(count - 1))
    return "".join((*vertices, *edges))


def cloud(count: int, *, binary: bool) -> bytes:
    head = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {'binary' if binary else 'ascii'}\n"
    )
    rows = [(*position(at), at % 5 / 2) for at in range(count)]
    if binary:
        return head.encode() + b"".join(struct.pack("<4f", *row) for row in rows)
    return (head + "".join(" ".join(map(str, row)) + "\n" for row in rows)).encode()


def array_file(rows: Callable[[int], tuple[float, ...]]) -> Callable[[int], bytes]:
    def write(count: int) -> bytes:
        file = io.BytesIO()
        np.save(file, np.array([rows(at) for at in range(count)]))
        return file.getvalue()

    return write


def worse(good: Callable[[int], str], bad: Mapping[int, str]) -> Callable[[int], str]:
    """Make what writes a text of which some lines, counted from 0, are others."""

    def write(count: int) -> str:
        found = good(count).splitlines()
        return "\n".join(bad.get(at, line) for at, line in enumerate(found)) + "\n"

    return write


def posture(at: int) -> dict[str, Any]:
    return {"id": at, "shoulder_pan": at % 7 / 8, "shoulder_lift_deg": -30, "elbow_deg": 90, "wrist_roll": 0, "phase": "go"}


def joined(values: Iterable[Any]) -> str:
    return ",".join(map(str, values))


WALK = table("# t x y z qx qy qz qw", lambda at: f"{seconds(at)} {cells(at).replace(',', ' ')}")
POSES = table(f"id,{POSE_COLUMNS},tag", lambda at: f"{at:03d},{cells(at)},{TAGS[at % 5]}")
POINTS = table("id,x,y,z,intensity", lambda at: f"{at},{joined(position(at))},{at % 5 / 2}")
BAD_RECORDS = {
    1: '{"id": 1, "frame": "lidar", "xyz": [1, "two", 3], "quaternion": {"x": 0, "y": 0, "z": 0, "w": 1}}',
    2: '{"id": 2, "frame": "lidar", "quaternion": {"x": 0, "y": 0, "w": 1}, "note": "no z"}',
    3: '{"id": 3, "frame": "lidar", "xyz": [1, 2, 3], "quaternion": {"x": NaN, "y": 0, "z": 0, "w": 1}}',
    4: '{"id": 4, "frame": "lidar", "xyz": [1, 2, 3',
    5: '{"id": 5, "frame": "lidar", "note": "no pose"}',
}
BAD_ROWS = {
    2: "001,1,two,3,0,0,0,1,c",
    3: "002,1,2,3,0,0",
    4: "003,1,2,3,nan,0,0,1,c",
    5: "004,1,2,3,0,0,0,0,c",
    6: "005,1,2,3,0,0,0,1,c,more",
}
FILES: dict[str, Callable[[int], str | bytes]] = {
    "poses.csv": POSES,
    "stamped.csv": table(f"stamp,frame_id,child_frame_id,{POSE_COLUMNS}", lambda at: f"{seconds(at)},lidar,box,{cells(at)}"),
    "bare.csv": table("", cells),
    "poses.tsv": table(f"id,{POSE_COLUMNS}", lambda at: f"{at},{cells(at)}", "\t"),
    "semicolon.csv": table(f"id,{POSE_COLUMNS}", lambda at: f"{at},{cells(at)}", ";"),
    "poses.txt": table("", cells, " "),
    "points.csv": POINTS,
    "points.txt": table("", lambda at: joined(position(at)), "  "),
    "crlf.csv": lambda count: "\ufeff" + POINTS(count).replace("\n", "\r\n"),
    "framed.csv": table("id,frame,x_mm,y [mm],z (mm)", lambda at: f"{at},{FRAMES[at % 3]},{joined(1000 * each for each in position(at))}"),
    "angles.csv": table("roll_deg,pitch_deg,yaw_deg,n", lambda at: f"{at % 4 * 90},0,{at % 3 * 90},{at}"),
    "plane.csv": table("t,x,y,yaw", lambda at: f"{at},{joined(position(at)[:2])},0"),
    "moving.csv": table("t,x,y,z", lambda at: f"{at % 40 / 10},{joined(position(at))}"),
    "lonely.csv": table("stamp,px,py,pz,label", lambda at: f"{seconds(at)},{joined(position(at))},n{at}"),
    "sigmas.csv": table(f"{POSE_COLUMNS},{SIGMAS}", lambda at: f"{cells(at)},0.5,0.25,0.125,0.0625,0.125,0.0625"),
    "gps.csv": table("stamp,lat,lon,alt,status", fix_row),
    "joints.csv": table("t,shoulder_pan_deg,shoulder_lift_deg,elbow_deg,wrist_roll_deg", lambda at: f"{at},{at % 4 * 15},-30,90,0"),
    "joints.jsonl": lines(lambda at: {"t": at / 10, **posture(at)}),
    "postures.yaml": documents(posture),
    "poses.jsonl": lines(pose),
    "poses.json": array(pose),
    "pretty.json": pretty(pose),
    "poses.yaml": documents(pose),
    "points.jsonl": lines(point),
    "points.json": array(point),
    "points.yaml": documents(point),
    "flat.jsonl": lines(lambda at: {"t": at, "x": at / 8, "y": 1, "z": -2.5, "qx": 0, "qy": 0, "qz": 0.6, "qw": 0.8}),
    "degrees.jsonl": lines(lambda at: {"angles": "deg", "xyz": [at, 0, 0], "rpy": [0, 0, 90], "n": at}),
    "uncertain.jsonl": lines(lambda at: {"xyz": [*position(at)], "xyzw": [*turn(at)], "sigma": {"xyz": 0.5, "rpy": [0.125, 0, 0.0625]}}),
    "fixes.jsonl": lines(lambda at: {"id": at, **fix(at)}),
    **{f"{name}.yaml": documents(record) for name, record in MESSAGES.items()},
    **{f"{name}.jsonl": lines(record) for name, record in MESSAGES.items()},
    "walk.tum": WALK,
    "walk.kitti": kitti,
    "euroc.csv": euroc,
    "graph.g2o": g2o,
    "ascii.pcd": lambda count: cloud(count, binary=False),
    "binary.pcd": lambda count: cloud(count, binary=True),
    "points.npy": array_file(position),
    "poses.npy": array_file(lambda at: (*position(at), *turn(at))),
    "bad.csv": worse(POSES, BAD_ROWS),
    "bad.jsonl": worse(lines(pose), BAD_RECORDS),
    "bad.json": worse(lambda count: "[" + ",\n".join(lines(pose)(count).splitlines()) + "]\n", {1: BAD_RECORDS[1] + ",", 4: BAD_RECORDS[4]}),
    "bad.yaml": worse(documents(lambda at: {"id": at, "xyz": [*position(at)], "rpy": [0, 0, 0]}), {3: "- east", 20: "xyz: [1, 2"}),
    "bad.tum": worse(WALK, {2: "1700000000.1 1 2 3 0 0 0 one", 4: "1700000000.3 1 2 3", 5: "1700000000.4 1 2 3 nan 0 0 1"}),
    "robot.yaml": lambda _count: (ROOT / "examples" / "robot.yaml").read_text(encoding="utf-8"),
    "drive.yaml": lambda _count: (ROOT / "examples" / "drive.yaml").read_text(encoding="utf-8"),
    "site.yaml": lambda _count: (ROOT / "examples" / "site.yaml").read_text(encoding="utf-8"),
    "arm.urdf": lambda _count: (ROOT / "examples" / "arm.urdf").read_text(encoding="utf-8"),
}  # fmt: skip
