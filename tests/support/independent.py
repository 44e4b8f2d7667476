"""A slow second reading of examples/*.yaml and of the operations, by SciPy and 4x4 matrices."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.linalg import expm
from scipy.spatial.transform import Rotation, Slerp

EXAMPLES = Path(__file__).parents[2] / "examples"


def pose(xyz: Any = (0, 0, 0), **rotation: Any) -> Any:
    """Return the 4x4 matrix of a position and one rotation by name."""
    matrix = np.eye(4)
    matrix[:3, 3] = xyz
    ((name, value),) = rotation.items() or [("rpy_deg", (0, 0, 0))]
    turn = {
        "rpy_deg": lambda: Rotation.from_euler("xyz", value, degrees=True),
        "rpy": lambda: Rotation.from_euler("xyz", value),
        "quaternion": lambda: Rotation.from_quat(value),
        "rotvec": lambda: Rotation.from_rotvec(value),
        "rzyx_deg": lambda: Rotation.from_euler("ZYX", value, degrees=True),
    }[name]()
    matrix[:3, :3] = turn.as_matrix()
    return matrix


def robot() -> dict[tuple[str, str], Any]:
    """Return the edges of robot.yaml, each as parent_from_child."""
    edges: dict[tuple[str, str], Any] = {}
    for root, children in yaml.safe_load((EXAMPLES / "robot.yaml").read_text())["frames"].items():
        _walk(root, children, edges)
    return edges


def _walk(parent: str, children: dict[str, Any], edges: dict[tuple[str, str], Any]) -> None:
    for name, entry in children.items():
        xyz = entry.get("xyz", (0, 0, 0))
        xyz = [xyz.get(axis, 0) for axis in "xyz"] if isinstance(xyz, dict) else xyz
        edges[parent, name] = pose(xyz, **_rotation(entry))
        _walk(name, entry.get("children", {}), edges)


def _rotation(entry: dict[str, Any]) -> dict[str, Any]:
    if "rpy" in entry:
        rpy = entry["rpy"]
        return {"rpy_deg": [rpy.get(each, 0) for each in ("roll", "pitch", "yaw")] if isinstance(rpy, dict) else rpy}
    if "axis_angle" in entry:
        return {"rotvec": np.radians(entry["axis_angle"]["angle"]) * np.array(entry["axis_angle"]["axis"])}
    if "euler" in entry:
        assert entry["euler"]["axes"] == "rzyx"
        return {"rzyx_deg": entry["euler"]["angles"]}
    if "quaternion" in entry:
        return {"quaternion": [entry["quaternion"][each] for each in "xyzw"]}
    return {}


def looked_up(edges: dict[tuple[str, str], Any], target: str, source: str) -> Any:
    """Return target_from_source by way of the root."""
    parents = {child: (parent, matrix) for (parent, child), matrix in edges.items()}

    def to_root(frame: str) -> Any:
        total = np.eye(4)
        while frame in parents:
            frame, matrix = parents[frame]
            total = matrix @ total
        return total

    return inverse(to_root(target)) @ to_root(source)


def drive_lidar(at: float) -> Any:
    """Return map_from_lidar of drive.yaml at a time between two samples."""
    entries = {entry["name"]: entry for entry in yaml.safe_load((EXAMPLES / "drive.yaml").read_text())["frames"]}
    samples = entries["base_link"]["samples"]
    lidar = entries["lidar"]
    before = max((each for each in samples if each["stamp"] <= at), key=lambda each: each["stamp"])
    after = min((each for each in samples if each["stamp"] > at), key=lambda each: each["stamp"])
    fraction = (at - before["stamp"]) / (after["stamp"] - before["stamp"])
    a, b = (pose(each["xyz"], **_rotation(each)) for each in (before, after))
    return interpolated(a, b, fraction) @ pose(lidar["xyz"], **_rotation(lidar))


def inverse(matrix: Any) -> Any:
    """Return the inverse by transposition."""
    result = np.eye(4)
    result[:3, :3] = matrix[:3, :3].T
    result[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return result


def interpolated(a: Any, b: Any, fraction: float) -> Any:
    """Return the straight line and the slerp."""
    result = np.eye(4)
    result[:3, 3] = a[:3, 3] + fraction * (b[:3, 3] - a[:3, 3])
    both = Rotation.from_matrix([a[:3, :3], b[:3, :3]])
    if 0 <= fraction <= 1:
        result[:3, :3] = Slerp([0, 1], both)([fraction]).as_matrix()[0]
    else:
        step = (both[0].inv() * both[1]).as_rotvec()
        result[:3, :3] = (both[0] * Rotation.from_rotvec(fraction * step)).as_matrix()
    return result


def twist_matrix(twist: Any) -> Any:
    """Return the 4x4 generator of vx vy vz wx wy wz."""
    v, w = twist[:3], twist[3:]
    return np.array([[0, -w[2], w[1], v[0]], [w[2], 0, -w[0], v[1]], [-w[1], w[0], 0, v[2]], [0, 0, 0, 0]])


def exponential(twist: Any) -> Any:
    """Return the matrix exponential."""
    return expm(twist_matrix(np.asarray(twist, float)))


def logarithm(matrix: Any) -> Any:
    """Return the twist: the rotation vector by SciPy, the linear part by solving with the exponential's left Jacobian."""
    w = Rotation.from_matrix(matrix[:3, :3]).as_rotvec()
    cross = twist_matrix([0, 0, 0, *w])[:3, :3]
    # t = J v with J the integral of exp(s [w]) over s: the upper right block of one larger exponential
    whole = np.zeros((6, 6))
    whole[:3, :3], whole[:3, 3:] = cross, np.eye(3)
    return np.concatenate([np.linalg.solve(expm(whole)[:3, 3:], matrix[:3, 3]), w])


def angle(matrix: Any) -> float:
    """Return the angle of a rotation."""
    return float(Rotation.from_matrix(matrix[:3, :3]).magnitude())


def mean(*poses: Any) -> Any:
    """Return the mean of translations and SciPy's of rotations."""
    result = np.eye(4)
    result[:3, 3] = np.mean([each[:3, 3] for each in poses], axis=0)
    result[:3, :3] = Rotation.from_matrix([each[:3, :3] for each in poses]).mean().as_matrix()
    return result
