"""Random expressions over random trees, and a slow evaluator of them: 4x4 matrices, its own reading of the rules."""

from __future__ import annotations

import random
from typing import Any

import independent as by
import numpy as np
import pytest

import frametool
from frametool.calc.evaluate import Scope, evaluate_line, read_line
from frametool.calc.functions import TREE, Term, Type
from frametool.errors import FrametoolError
from frametool.geometry.transform import Transform

FRAMES = ["map", "odom", "base", "cam-0", "robot/arm", "tool:tip", "lidar", "imu.link"]
UNITS = {"m": "m", "mm": "m", "deg": "rad", "": ""}


class Mismatch(Exception):
    """The rules forbid it."""


class Undecided(Exception):
    """The numbers are such that two right evaluators may differ: half a turn, a zero vector."""


class World:
    """A random tree, as frametool has it and as matrices from the root."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)  # noqa: S311 - no secrets here
        self.frames = self.random.sample(FRAMES, self.random.randint(3, len(FRAMES)))
        self.tree = frametool.FrameTree("random")
        self.tree.add_root(self.frames[0])
        self.from_root = {self.frames[0]: np.eye(4)}
        for at, child in enumerate(self.frames[1:], 1):
            parent = self.frames[self.random.randrange(at)]
            edge = Transform.exp([self.random.gauss(0, 1) for _ in range(6)])
            self.tree.add(parent, child, edge)
            self.from_root[child] = self.from_root[parent] @ edge.as_matrix()

        self.goal = ("literal", [1.0, 2.0, 3.0], [0.1, 0.2, 0.3], (self.frame(), self.frame()))

    def frame(self) -> str:
        return self.random.choice(self.frames)

    def number(self) -> float:
        return round(self.random.uniform(-3, 3), 3)

    def three(self) -> str:
        return ", ".join(str(self.number()) for _ in range(3))

    # --- texts ---

    def pose(self, depth: int) -> tuple[Any, ...]:
        pick = self.random.random()
        if depth == 0 or pick < 0.3:
            chance = self.random.random()
            if chance < 0.6:
                return "asked" if chance < 0.2 else "lookup", self.frame(), self.frame()
            if chance < 0.7:
                return ("goal",)
            xyz, turn = ([self.number() for _ in range(3)] for _ in range(2))
            named = (self.frame(), self.frame()) if self.random.random() < 0.5 else (None, None)
            return "literal", xyz, turn, named
        if pick < 0.65:
            return "times", self.pose(depth - 1), self.pose(depth - 1)
        if pick < 0.8:
            return "inv", self.pose(depth - 1)
        if pick < 0.88:
            return "power", self.pose(depth - 1), self.random.choice([-1, 1, 0.5, -0.25, 2])
        if pick < 0.94:
            return "interp", self.pose(depth - 1), self.pose(depth - 1), self.random.choice([0, 0.25, 1, 1.5])
        return "rot", self.pose(depth - 1)

    def point(self, depth: int) -> tuple[Any, ...]:
        pick = self.random.random()
        if depth == 0 or pick < 0.35:
            return "point", [self.number() for _ in range(3)], self.frame() if self.random.random() < 0.5 else None
        if pick < 0.65:
            return "times", self.pose(depth - 1), self.point(depth - 1)
        if pick < 0.8:
            return "trans", self.pose(depth - 1)
        return self.random.choice(["plus", "minus"]), self.point(depth - 1), self.vector(depth - 1)

    def vector(self, depth: int) -> tuple[Any, ...]:
        pick = self.random.random()
        if depth == 0 or pick < 0.3:
            return "vector", self.point(0)
        if pick < 0.6:
            return "times", self.pose(depth - 1), self.vector(depth - 1)
        if pick < 0.75:
            return "minus", self.point(depth - 1), self.point(depth - 1)
        if pick < 0.9:
            return "cross", self.vector(depth - 1), self.vector(depth - 1)
        return "times", self.scalar(depth - 1), self.vector(depth - 1)

    def scalar(self, depth: int) -> tuple[Any, ...]:
        pick = self.random.random()
        if depth == 0 or pick < 0.2:
            return "number", abs(self.number()), self.random.choice(list(UNITS))
        if pick < 0.4:
            return "dist", self.pose(depth - 1), self.pose(depth - 1)
        if pick < 0.5:
            return "dist", self.point(depth - 1), self.point(depth - 1)
        if pick < 0.65:
            return "angle", self.pose(depth - 1), self.pose(depth - 1)
        if pick < 0.75:
            return "norm", self.vector(depth - 1)
        if pick < 0.85:
            return "dot", self.vector(depth - 1), self.vector(depth - 1)
        return self.random.choice(["plus", "minus", "times"]), self.scalar(depth - 1), self.scalar(depth - 1)

    def anything(self) -> tuple[Any, ...]:
        make = self.random.choice([self.pose, self.pose, self.point, self.vector, self.scalar])
        return make(self.random.randint(1, 4))

    # --- the slow evaluator: kind, frames or unit, numbers ---

    def value(self, node: tuple[Any, ...]) -> tuple[Any, ...]:
        kind, *rest = node
        return getattr(self, f"of_{kind}")(*rest)  # type: ignore[no-any-return]

    def of_lookup(self, target: str, source: str) -> tuple[Any, ...]:
        return "pose", target, source, by.inverse(self.from_root[target]) @ self.from_root[source]

    of_asked = of_lookup

    def of_goal(self) -> tuple[Any, ...]:
        return self.value(self.goal)

    def of_literal(self, xyz: Any, turn: Any, named: Any) -> tuple[Any, ...]:
        return "pose", *named, by.pose(xyz, rpy=turn)

    def of_point(self, xyz: Any, frame: str | None) -> tuple[Any, ...]:
        return "point", frame, None, np.array(xyz)

    def of_vector(self, node: Any) -> tuple[Any, ...]:
        _, frame, _, xyz = self.value(node)
        return "vector", frame, None, xyz

    def of_number(self, value: float, unit: str) -> tuple[Any, ...]:
        size = {"mm": 1e-3, "deg": np.pi / 180}.get(unit, 1.0)
        return "number", UNITS[unit], None, value * size

    def of_times(self, left: Any, right: Any) -> tuple[Any, ...]:
        a, b = self.value(left), self.value(right)
        if a[0] == "number" and b[0] == "number":
            if a[1] and b[1]:
                raise Mismatch
            return "number", a[1] or b[1], None, a[3] * b[3]
        if a[0] == "number":
            if a[1] not in ("", "m"):
                raise Mismatch
            return "vector", b[1], None, a[3] * b[3]
        one(a[2], b[1])
        if b[0] == "pose":
            return "pose", a[1], b[2], a[3] @ b[3]
        return b[0], a[1], None, (a[3] @ [*b[3], b[0] == "point"])[:3]

    def of_inv(self, node: Any) -> tuple[Any, ...]:
        _, target, source, matrix = self.value(node)
        return "pose", source, target, by.inverse(matrix)

    def of_power(self, node: Any, exponent: float) -> tuple[Any, ...]:
        _, target, source, matrix = self.value(node)
        if exponent == -1:
            return "pose", source, target, by.inverse(matrix)
        if exponent == 1:
            return "pose", target, source, matrix
        if not 1e-6 < by.angle(matrix) < 3.1:
            raise Undecided
        return "pose", target, None, by.exponential(exponent * by.logarithm(matrix))

    def of_interp(self, left: Any, right: Any, fraction: float) -> tuple[Any, ...]:
        a, b = self.value(left), self.value(right)
        frames = one(a[1], b[1]), one(a[2], b[2])
        if by.angle(by.inverse(a[3]) @ b[3]) > 3.1:
            raise Undecided
        return "pose", *frames, by.interpolated(a[3], b[3], fraction)

    def of_rot(self, node: Any) -> tuple[Any, ...]:
        _, target, source, matrix = self.value(node)
        turned = matrix.copy()
        turned[:3, 3] = 0
        return "pose", target, source, turned

    def of_trans(self, node: Any) -> tuple[Any, ...]:
        _, target, _, matrix = self.value(node)
        return "point", target, None, matrix[:3, 3]

    def of_plus(self, left: Any, right: Any) -> tuple[Any, ...]:
        return self._sum(left, right, 1)

    def of_minus(self, left: Any, right: Any) -> tuple[Any, ...]:
        return self._sum(left, right, -1)

    def _sum(self, left: Any, right: Any, sign: int) -> tuple[Any, ...]:
        a, b = self.value(left), self.value(right)
        if a[0] == "number":
            if a[1] != b[1]:
                raise Mismatch
            return "number", a[1], None, a[3] + sign * b[3]
        kind = "vector" if a[0] == b[0] == "point" else a[0]
        return kind, one(a[1], b[1]), None, a[3] + sign * b[3]

    def of_cross(self, left: Any, right: Any) -> tuple[Any, ...]:
        a, b = self.value(left), self.value(right)
        return "vector", one(a[1], b[1]), None, np.cross(a[3], b[3])

    def of_dot(self, left: Any, right: Any) -> tuple[Any, ...]:
        a, b = self.value(left), self.value(right)
        one(a[1], b[1])
        return "number", "", None, float(a[3] @ b[3])

    def of_norm(self, node: Any) -> tuple[Any, ...]:
        return "number", "m", None, float(np.linalg.norm(self.value(node)[3]))

    def of_dist(self, left: Any, right: Any) -> tuple[Any, ...]:
        a, b = self.value(left), self.value(right)
        one(a[1], b[1])
        a, b = (each[3][:3, 3] if each[0] == "pose" else each[3] for each in (a, b))
        return "number", "m", None, float(np.linalg.norm(a - b))

    def of_angle(self, left: Any, right: Any) -> tuple[Any, ...]:
        a, b = self.value(left), self.value(right)
        one(a[1], b[1])
        return "number", "rad", None, by.angle(by.inverse(a[3]) @ b[3])


def one(a: str | None, b: str | None) -> str | None:
    """Return the one frame of two."""
    if a is not None and b is not None and a != b:
        raise Mismatch
    return b if a is None else a


def text_of(node: tuple[Any, ...]) -> str:
    """Write an expression, brackets where they are needed and sometimes where not."""
    kind, *rest = node
    if kind == "lookup":
        return f"{rest[0]}<-{rest[1]}"
    if kind == "asked":
        return f"t[{rest[0]}<-{rest[1]}]"
    if kind == "goal":
        return "goal"
    if kind == "literal":
        xyz, turn, (target, source) = rest
        return f"{{xyz: {xyz}, rpy: {turn}}}" + (f" as {target}<-{source}" if target else "")
    if kind == "point":
        return f"{rest[0]}" + (f" in {rest[1]}" if rest[1] else "")
    if kind == "number":
        return f"{rest[0]}{rest[1]}"
    if kind in ("times", "plus", "minus"):
        sign = {"times": "*", "plus": "+", "minus": "-"}[kind]
        left, right = (f"({text_of(each)})" if each[0] in ("times", "plus", "minus") else text_of(each) for each in rest)
        return f"{left} {sign} {right}"
    if kind == "power":
        return f"({text_of(rest[0])}) ^ {rest[1]}"
    return f"{kind}({', '.join(text_of(each) if isinstance(each, tuple) else str(each) for each in rest)})"


def check(seed: int) -> str:
    """Compare one expression with the slow evaluator; say what became of it."""
    world = World(seed)
    node = world.anything()
    text, scope = text_of(node), Scope(tree=world.tree)
    evaluate_line(read_line(f"goal = {text_of(world.goal)}"), scope)
    scope.names["t"] = Term(Type(TREE), (), tree=world.tree, text="t")
    try:
        expected = world.value(node)
    except Mismatch:
        expected = ()
    except Undecided:
        return "undecided"
    if not expected:
        return check_refusal(text, scope)
    found = evaluate_line(read_line(text), scope)
    kind, first, second, numbers = expected
    assert found.type.kind == kind, text
    parts = found.at(None)
    if kind == "number":
        assert found.type.unit == first, text
        parts = (parts[0] * np.pi / 180,) if found.type.degrees else parts
    else:
        assert (found.type.target, found.type.source) == (first, second), text
    result = Transform.of(*parts).as_matrix() if kind == "pose" else np.array(parts)
    assert np.abs(result - numbers).max() <= 1e-9 * (1.0 + np.abs(numbers).max()), text
    return str(kind)


def check_refusal(text: str, scope: Scope) -> str:
    """See that an expression is refused with a caret."""
    with pytest.raises(FrametoolError) as caught:
        evaluate_line(read_line(text), scope)
    error = caught.value
    assert getattr(error, "snippet", "").count("\n") == 1, text
    return "refused"
