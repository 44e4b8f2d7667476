"""One record of every kind, given in the frame base: as a mapping, and as a row of a table where one can hold it."""

from __future__ import annotations

from math import cos, sin
from typing import Any, NamedTuple

STAMP_NS = 1_000_000_002
HEADER = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "base"}
NAMES = {"frame": "base", "name": "tool"}
XYZ = {"x": 1.0, "y": 2.0, "z": 3.5}
LIST = [1.0, 2.0, 3.5]
QUATERNION = {"x": 0.5, "y": -0.5, "z": 0.5, "w": 0.5}
Q = [0.5, -0.5, 0.5, 0.5]
C, S = cos(0.3), sin(0.3)
TURN = [[C, -S, 0.0], [S, C, 0.0], [0.0, 0.0, 1.0]]
WHOLE = [[C, -S, 0.0, 1.0], [S, C, 0.0, 2.0], [0.0, 0.0, 1.0, 3.5], [0.0, 0.0, 0.0, 1.0]]
POSE = {"position": XYZ, "orientation": QUATERNION}
TWIST = {"linear": XYZ, "angular": {"x": 0.1, "y": 0.2, "z": 0.3}}
WRENCH = {"force": XYZ, "torque": {"x": 0.1, "y": 0.2, "z": 0.3}}
COVARIANCE = [float(at % 7 == 0) for at in range(36)]
TRANSFORM = {"translation": XYZ, "rotation": QUATERNION}


def columns(names: str, *numbers: Any) -> dict[str, Any]:
    """Name the cells of a row."""
    return dict(zip(names.split(), numbers, strict=True))


XYZ_CELLS = columns("x y z", *LIST)
POSE_CELLS = XYZ_CELLS | columns("qx qy qz qw", *Q)
STAMPED = {"stamp_ns": STAMP_NS, "frame_id": "base"}


class Kind(NamedTuple):
    """A record, the same as a row, and what it says: its names, its time, how many poses it holds."""

    record: dict[str, Any]
    cells: dict[str, Any] | None = None
    parent: str | None = "base"
    name: str | None = "tool"
    stamp_ns: int | None = None
    poses: int = 1


def pose(rotation: dict[str, Any], cells: dict[str, Any], *, at: bool = True) -> Kind:
    """Make a named pose of a rotation; at: with a position."""
    record = NAMES | ({"xyz": LIST} if at else {}) | rotation
    return Kind(record, NAMES | (XYZ_CELLS if at else {}) | cells)


def message(record: dict[str, Any], cells: dict[str, Any] | None = None, name: str | None = None, poses: int = 1) -> Kind:
    """Make a message with a header."""
    return Kind({"header": HEADER} | record, cells, name=name, stamp_ns=STAMP_NS, poses=poses)


POSES = {
    "quaternion": pose({"quaternion": QUATERNION}, columns("qx qy qz qw", *Q)),
    "xyzw": pose({"xyzw": Q}, columns("qx qy qz qw", *Q)),
    "wxyz": pose({"wxyz": [0.5, 0.5, -0.5, 0.5]}, columns("qw qx qy qz", 0.5, 0.5, -0.5, 0.5)),
    "rpy": pose({"rpy": [0.1, 0.2, 0.3]}, columns("roll pitch yaw", 0.1, 0.2, 0.3)),
    "rpy_deg": pose({"rpy_deg": [10, 20, 30]}, columns("roll_deg pitch_deg yaw_deg", 10, 20, 30)),
    "axis_angle": pose(
        {"axis_angle": {"axis": [0, 0, 2], "angle": 0.5}}, columns("axis_x axis_y axis_z angle", 0, 0, 2, 0.5)
    ),
    "rotvec": pose({"rotvec": [0.1, 0.2, 0.3]}, columns("rotvec_x rotvec_y rotvec_z", 0.1, 0.2, 0.3)),
    "matrix": pose({"matrix": TURN}, columns("r11 r12 r13 r21 r22 r23 r31 r32 r33", *sum(TURN, []))),  # noqa: RUF017
    "flat": Kind(NAMES | POSE_CELLS, NAMES | POSE_CELLS),
    "with a stamp": Kind(
        {"stamp_ns": STAMP_NS, **NAMES, "xyz": LIST, "xyzw": Q}, {"stamp_ns": STAMP_NS} | NAMES | POSE_CELLS,
        stamp_ns=STAMP_NS,
    ),
    "with seconds": Kind(
        {"stamp": 1.000000002, **NAMES, "xyz": LIST, "xyzw": Q}, {"stamp": "1.000000002"} | NAMES | POSE_CELLS,
        stamp_ns=STAMP_NS,
    ),
    "planar": Kind(NAMES | columns("x y yaw", 1.0, 2.0, 0.5), NAMES | columns("x y yaw", 1.0, 2.0, 0.5)),
    "rotation": pose({"rotvec": [0.1, 0.2, 0.3]}, columns("rotvec_x rotvec_y rotvec_z", 0.1, 0.2, 0.3), at=False),
    "nameless": Kind({"xyz": LIST, "xyzw": Q}, POSE_CELLS, parent=None, name=None),
}  # fmt: skip
EULER = {  # a whole matrix and Euler's angles say their order in the record, and by --from in a table
    "euler": Kind(NAMES | {"xyz": LIST, "euler": {"axes": "rzyx", "angles": [0.1, 0.2, 0.3]}}),
    "whole matrix": Kind(NAMES | {"matrix": WHOLE}),
}
POSE_MESSAGES = {
    "PoseStamped": message({"pose": POSE}, STAMPED | POSE_CELLS),
    "TransformStamped": message(
        {"child_frame_id": "tool", "transform": TRANSFORM}, STAMPED | {"child_frame_id": "tool"} | POSE_CELLS, "tool"
    ),
    "TFMessage": Kind(
        {"transforms": [{"header": HEADER, "child_frame_id": "tool", "transform": TRANSFORM}]}, stamp_ns=STAMP_NS
    ),
    "Pose": Kind(POSE, parent=None, name=None),
}  # fmt: skip
WITH_COVARIANCE = {
    "PoseWithCovarianceStamped": message({"pose": {"pose": POSE, "covariance": COVARIANCE}}),
    "Odometry": message(
        {
            "child_frame_id": "tool",
            "pose": {"pose": POSE, "covariance": COVARIANCE},
            "twist": {"twist": TWIST, "covariance": COVARIANCE},
        },
        name="tool",
    ),
}
LISTS = {
    "PoseArray": message({"poses": [POSE, POSE]}, poses=2),
    "Path": message({"poses": [{"header": HEADER, "pose": POSE}] * 2}, poses=2),
}
POINTS = {
    "point": Kind({"frame": "base", "point": LIST}, {"frame": "base"} | XYZ_CELLS, name=None),
    "position": Kind({"frame": "base", "xyz": LIST}, {"frame": "base"} | XYZ_CELLS, name=None),
    "flat point": Kind({"frame": "base"} | XYZ, {"frame": "base"} | XYZ_CELLS, name=None),
    "PointStamped": message({"point": XYZ}, STAMPED | XYZ_CELLS),
}
VECTORS = {
    "vector": Kind({"frame": "base", "vector": LIST}, name=None),
    "twist": Kind({"frame": "base", "twist": TWIST}, name=None),
    "wrench": Kind({"frame": "base", "wrench": WRENCH}, name=None),
    "Vector3Stamped": message({"vector": XYZ}),
    "TwistStamped": message({"twist": TWIST}),
    "WrenchStamped": message({"wrench": WRENCH}),
}
AS_POSES = POSES | EULER | POSE_MESSAGES | LISTS
KINDS = AS_POSES | WITH_COVARIANCE | POINTS | VECTORS
NOTATIONS = ("xyzw", "wxyz", "rpy", "axis_angle", "matrix", "flat", "euler", "whole matrix")


def without(kinds: dict[str, Kind], *names: str) -> dict[str, Kind]:
    """Leave some kinds out."""
    return {name: kind for name, kind in kinds.items() if name not in names}
