"""Robots for the tests: random URDF, and where its links are by a second implementation of plain 4x4 products."""

from __future__ import annotations

import random
from typing import Any

import numpy as np

KINDS = ("fixed", "revolute", "continuous", "prismatic", "revolute")


def turn_about(axis: Any, angle: float) -> Any:
    """Give the 4x4 matrix of a turn about an axis of any length, by Rodrigues' formula."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return matrix


def shift(xyz: Any) -> Any:
    """Give the 4x4 matrix of a shift."""
    matrix = np.eye(4)
    matrix[:3, 3] = xyz
    return matrix


def origin(xyz: Any, rpy: Any) -> Any:
    """Give the 4x4 matrix of <origin xyz rpy>: turns about the fixed axes x, then y, then z."""
    roll, pitch, yaw = (turn_about(axis, angle) for axis, angle in zip(np.eye(3), rpy, strict=True))
    return shift(xyz) @ yaw @ pitch @ roll


class RandomRobot:
    """A random tree of links with joints of every kind, mimics in chains among them."""

    def __init__(self, seed: int, size: int = 12) -> None:
        """Draw it."""
        draw = random.Random(seed)  # noqa: S311 - a test
        self.joints: list[dict[str, Any]] = []
        for index in range(size):
            free = [joint["name"] for joint in self.joints if joint["kind"] != "fixed"]
            kind = draw.choice(KINDS)
            follows = kind != "fixed" and free and draw.random() < 0.4
            self.joints.append({
                "name": f"joint{index}",
                "kind": kind,
                "parent": f"link{draw.randrange(index + 1)}",
                "child": f"link{index + 1}",
                "xyz": [draw.uniform(-1, 1) for _ in range(3)],
                "rpy": [draw.uniform(-3, 3) for _ in range(3)],
                "axis": draw.choice([(0, 0, 1), (0, -1, 0), tuple(draw.uniform(-2, 2) for _ in range(3))]),
                "mimic": (draw.choice(free), draw.uniform(-2, 2), draw.uniform(-1, 1)) if follows else None,
            })  # fmt: skip
        self.free = [joint["name"] for joint in self.joints if joint["kind"] != "fixed" and not joint["mimic"]]
        self.values = {name: draw.uniform(-3, 3) for name in self.free}
        draw.shuffle(self.joints)

    @property
    def urdf(self) -> str:
        """Write it."""
        links = "".join(f'<link name="link{index}"/>\n' for index in range(len(self.joints) + 1))
        return f'<robot name="random">\n{links}{"".join(map(_written, self.joints))}</robot>\n'

    def value(self, name: str) -> Any:
        """Give the value of a joint."""
        joint = next(each for each in self.joints if each["name"] == name)
        if not joint["mimic"]:
            return self.values.get(name, 0.0)
        leader, multiplier, offset = joint["mimic"]
        return multiplier * self.value(leader) + offset

    def pose(self, link: str) -> Any:
        """Give the 4x4 matrix of a link in link0."""
        joint = next((each for each in self.joints if each["child"] == link), None)
        if joint is None:
            return np.eye(4)
        here = self.pose(joint["parent"]) @ origin(joint["xyz"], joint["rpy"])
        if joint["kind"] == "fixed":
            return here
        value = self.value(joint["name"])
        if joint["kind"] == "prismatic":
            return here @ shift(value * np.asarray(joint["axis"], float) / np.linalg.norm(joint["axis"]))
        return here @ turn_about(joint["axis"], value)


def _written(joint: dict[str, Any]) -> str:
    parts = [
        f'<origin xyz="{_numbers(joint["xyz"])}" rpy="{_numbers(joint["rpy"])}"/>',
        f'<parent link="{joint["parent"]}"/><child link="{joint["child"]}"/>',
        f'<axis xyz="{_numbers(joint["axis"])}"/>',
    ]
    if joint["mimic"]:
        leader, multiplier, offset = joint["mimic"]
        parts.append(f'<mimic joint="{leader}" multiplier="{multiplier!r}" offset="{offset!r}"/>')
    return f'<joint name="{joint["name"]}" type="{joint["kind"]}">{"".join(parts)}</joint>\n'


def _numbers(values: Any) -> str:
    return " ".join(map(repr, values))
