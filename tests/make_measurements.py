"""Make the measurements of examples/: a robot's frames, a camera in a hand, marks on two scans, a tag seen twelve times.

    python tests/make_measurements.py         # writes them into examples/

measurements.yaml                   20 measurements between frames of robot.yaml and a tag, one of them inverted
gripper.csv, target.csv             15 poses each of a hand and of a board that its camera sees, one of another board
hand_eye_samples.json               10 such pairs as moveit_calibration writes them
points_a.csv, points_b.csv          9 marks by their ids, one of them another's, two that the other file does not have
tag_seen.csv                        12 times where a camera sees a tag, twice mistaken
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import frametool
from frametool import Rotation, Transform

FOLDER = Path(__file__).parents[1] / "examples"
METRES, RADIANS = 2e-3, np.radians(0.15)  # noise of each axis
PAIRS = """base_link lidar, base_link imu_link, base_link arm_base_link, base_link camera_optical, lidar imu_link,
lidar camera_optical, arm_base_link camera_optical, base_link charging_dock, lidar charging_dock, arm_base_link lidar,
camera_optical charging_dock, base_link imu_link, arm_base_link imu_link, base_link lidar, lidar arm_base_link,
camera_optical imu_link, charging_dock arm_base_link, base_link camera_optical, camera_optical lidar, camera_optical tag_7"""
INVERTED = 5  # lidar camera_optical
TAG = Transform(Rotation.from_rpy([0.1, -0.2, 2.9]), [0.31, -0.12, 1.4])  # camera_optical<-tag_7
MOUNT = Transform(Rotation.from_rpy([0.02, -0.01, 1.59]), [0.041, -0.022, 0.087])  # tool<-camera_optical
BOARD = Transform(Rotation.from_rpy([3.1, 0.05, 0.4]), [0.62, 0.08, 0.02])  # arm_base_link<-board


def noisy(draw: np.random.Generator, true: Transform, metres: float = METRES, radians: float = RADIANS) -> Transform:
    """Return poses as they are measured: along the axes of their parent."""
    shape = true.xyz.shape
    return Transform(Rotation.from_rotvec(draw.normal(0, radians, shape)) @ true.rotation, true.xyz + draw.normal(0, metres, shape))


def row(pose: Transform, digits: int = 5) -> str:
    """Return the cells of a pose."""
    return ",".join([*(f"{part:.{digits}f}" for part in pose.xyz.tolist()), *(f"{part:.7f}" for part in pose.xyzw.tolist())])


def measurements(draw: np.random.Generator) -> str:
    """Return measurements between frames of robot.yaml."""
    tree = frametool.load(FOLDER / "robot.yaml")
    lines = []
    for at, pair in enumerate(PAIRS.replace("\n", " ").split(",")):
        parent, child = pair.split()
        pose = noisy(draw, TAG if child == "tag_7" else tree.lookup(parent, child))
        pose = pose.inverse() if at == INVERTED else pose
        xyz = ", ".join(f"{part:.4f}" for part in pose.xyz.tolist())
        rpy = ", ".join(f"{part:.3f}" for part in np.degrees(pose.rotation.as_rpy()).tolist())
        lines.append(f"  - {{parent: {parent}, child: {child}, xyz: [{xyz}], rpy_deg: [{rpy}]}}\n")
    head = "# Frames of robot.yaml and a tag, measured with a tape, a scanner and a camera: the pose of child in parent.\n"
    return f"{head}measurements:\n{''.join(lines)}"


def hand_eye(draw: np.random.Generator, count: int) -> tuple[Transform, Transform]:
    """Return arm_base_link<-tool and camera_optical<-board."""
    start = Transform(Rotation.from_rpy([3.0, 0.1, 0.2]), [0.45, 0.0, 0.55])
    moves = Transform(Rotation.from_rotvec(draw.normal(0, 0.35, (count, 3))), draw.normal(0, 0.08, (count, 3)))
    hand = start @ moves
    return hand, noisy(draw, MOUNT.inverse() @ hand.inverse() @ BOARD, 5e-4, np.radians(0.08))


def points(draw: np.random.Generator) -> tuple[str, str]:
    """Return marks on a workpiece, as two scanners see them."""
    b = draw.uniform((-0.4, -0.3, 0.0), (0.4, 0.3, 0.25), (11, 3))
    a = Transform(Rotation.from_rpy([0.02, -0.03, 0.6]), [1.2, -0.4, 0.85]).apply(b) + draw.normal(0, 2e-4, b.shape)
    a[6] = a[2] + draw.normal(0, 2e-4, 3)
    first, second = (
        [f"m{at + 1},{','.join(f'{part:.4f}' for part in place)}\n" for at, place in enumerate(places.tolist())] for places in (a, b)
    )
    shuffled = [second[at] for at in draw.permutation(10).tolist()]
    return "id,x,y,z\n" + "".join(first[:9] + first[10:]), "id,x,y,z\n" + "".join(shuffled)


def files() -> dict[str, str]:
    """Return all of them, by name."""
    made = {"measurements.yaml": measurements(np.random.default_rng(23))}

    draw = np.random.default_rng(5)
    hand, board = hand_eye(draw, 15)
    seen = [*board]
    seen[9] = seen[9] @ Transform(Rotation.from_rpy([0.0, 0.0, np.pi / 2]), [0.3, 0.1, 0.0])
    head = "x,y,z,qx,qy,qz,qw\n"
    made["gripper.csv"] = head + "".join(f"{row(each)}\n" for each in hand)
    made["target.csv"] = head + "".join(f"{row(each)}\n" for each in seen)

    hand, board = hand_eye(draw, 10)
    samples = [
        {"effector_wrt_world": [round(part, 7) for part in one.as_matrix().ravel().tolist()],
         "object_wrt_sensor": [round(part, 7) for part in other.as_matrix().ravel().tolist()]}
        for one, other in zip(hand, board, strict=True)
    ]  # fmt: skip
    made["hand_eye_samples.json"] = "[\n" + ",\n".join(map(json.dumps, samples)) + "\n]\n"

    made["points_a.csv"], made["points_b.csv"] = points(draw)

    many = noisy(draw, Transform.of(*(np.full(12, part) for part in TAG.components)), 4e-3, np.radians(0.4))
    poses = [*many]
    poses[4] = poses[4] @ Transform(Rotation.from_rpy([0.0, 0.0, np.pi / 2]), [0.0, 0.0, 0.0])
    poses[8] = Transform(poses[8].rotation, poses[8].xyz + np.array([0.0, 0.0, 0.6]))
    made["tag_seen.csv"] = head + "".join(f"{row(each, 4)}\n" for each in poses)
    return made


if __name__ == "__main__":
    for name, text in files().items():
        (FOLDER / name).write_text(text)
