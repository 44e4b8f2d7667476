"""Steps that move what a record holds into another frame: points, vectors, twists, wrenches, covariances."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc.explain.matrices import of_quaternion
from frametool.calc.explain.operations import FROM_Q, VECTOR, moved, turned
from frametool.calc.explain.sheet import METRES, Sheet, transposed
from frametool.calc.explain.to_quaternion import XYZ

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.calc.explain.sheet import Matrix
    from frametool.geometry.types import Rigid

    Block = Callable[[Sheet, Rigid, Sequence[float], str, str], Sequence[float]]

ARM = "The velocity and the torque depend on the point they are taken at: the lever arm t comes in."


def point(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn, then shift."""
    sheet.heading(f"point_in_{target} = {target}_from_{source} * point_in_{source}")
    sheet.say(FROM_Q)
    found = moved(sheet, pose, numbers, "p'", ("R(q) p + t", "R(q)\\,p + t"), METRES)
    sheet.caveat(VECTOR)
    return found


def vector(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn only."""
    sheet.heading(f"vector_in_{target} = R({target}_from_{source}) * vector_in_{source}")
    sheet.say(FROM_Q)
    found = turned(sheet, pose[3:], numbers, "v'", ("R(q) v", "R(q)\\,v"))
    sheet.caveat(VECTOR)
    return found


def twist(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn both vectors; the linear one is then that of the body's point at the target's origin."""
    sheet.heading(f"twist at the origin of {target}, from that at the origin of {source}")
    sheet.say("w' = R w, and v' = R v + t x w': the velocity of the same rigid body, elsewhere.")
    angular = turned(sheet, pose[3:], numbers[3:], "w'", ("R(q) w", "R(q)\\,w"), "rad/s")
    linear = turned(sheet, pose[3:], numbers[:3], "u", ("R(q) v", "R(q)\\,v"), "m/s")
    sheet.caveat(ARM)
    return *_with_arm(sheet, pose, linear, angular, ("u", "w", "v"), "m/s"), *angular


def wrench(sheet: Sheet, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Sequence[float]:
    """Turn both vectors; the torque is then that about the target's origin."""
    sheet.heading(f"wrench about the origin of {target}, from that about the origin of {source}")
    sheet.say("f' = R f, and m' = R m + t x f'.")
    force = turned(sheet, pose[3:], numbers[:3], "f'", ("R(q) f", "R(q)\\,f"), "N")
    torque = turned(sheet, pose[3:], numbers[3:], "u", ("R(q) m", "R(q)\\,m"), "Nm")
    sheet.caveat(ARM)
    return *force, *_with_arm(sheet, pose, torque, force, ("u", "f", "m"), "Nm")


def _with_arm(
    sheet: Sheet, pose: Rigid, own: Sequence[float], other: Sequence[float], names: tuple[str, str, str], unit: str
) -> Sequence[float]:
    """Add own + t x other."""
    a, b, c = names
    values = {f"{letter}{axis}": part for letter, vector in ((a, own), ("t", pose[:3]), (b, other))
              for axis, part in zip(XYZ, vector, strict=True)}  # fmt: skip
    return [
        sheet.step(values, f"{c}{i}", f"{a}{i} + t{j}*{b}{k} - t{k}*{b}{j}", unit)
        for i, j, k in (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y"))
    ]


def pose_covariance(sheet: Sheet, pose: Rigid, numbers: Sequence[float]) -> Sequence[float]:
    """Turn each 3x3 block C into R C R^T."""
    sheet.heading("The covariance: each 3x3 block C becomes R C R^T")
    turn = of_quaternion(sheet, pose[3:])
    found = [[0.0] * 6 for _ in range(6)]
    for top, rows in ((0, "position"), (3, "rotation")):
        for left, columns in ((0, "position"), (3, "rotation")):
            block = [list(numbers[6 * (top + i) + left : 6 * (top + i) + left + 3]) for i in range(3)]
            sheet.say(f"{rows} with {columns}:")
            made = _sandwich(sheet, turn, block, "R C R^T", r"R\,C\,R^{\mathsf T}")
            for i, row in enumerate(made):
                found[top + i][left : left + 3] = row
    return [entry for row in found for entry in row]


def twist_covariance(sheet: Sheet, pose: Rigid, numbers: Sequence[float]) -> Sequence[float]:
    """Turn the 6x6 covariance C into A C A^T."""
    sheet.heading("The covariance of the twist: A C A^T")
    sheet.say("A is what the move does to the six numbers: rows R | t x R, and 0 | R.")
    turn = of_quaternion(sheet, pose[3:])
    tx, ty, tz = pose[:3]
    arm = sheet.product([[0.0, -tz, ty], [tz, 0.0, -tx], [-ty, tx, 0.0]], turn)
    adjoint = [[*turn[i], *arm[i]] for i in range(3)] + [[0.0, 0.0, 0.0, *turn[i]] for i in range(3)]
    rows = [list(numbers[6 * i : 6 * i + 6]) for i in range(6)]
    made = _sandwich(sheet, adjoint, rows, "A C A^T", r"A\,C\,A^{\mathsf T}")
    return [entry for row in made for entry in row]


def _sandwich(sheet: Sheet, a: Matrix, c: Matrix, text: str, latex: str) -> Matrix:
    back = transposed(a)
    found = sheet.product(sheet.product(a, c), back)
    sheet.grid("C'", text, latex, [a, c, back, "=", found])
    return found


MOVERS: dict[str, Block] = {"point": point, "vector": vector, "twist": twist, "wrench": wrench}
