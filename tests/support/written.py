"""Poses and records as users write them: every notation, hostile and random numbers. Seeded."""

from __future__ import annotations

from random import Random
from typing import Any

from samples import LATTICE, quaternions, random_quaternions, turned

from frametool.geometry import euler, floats
from frametool.geometry.representations import ROTATIONS as TABLE
from frametool.geometry.representations import notation

ROTATIONS = random_quaternions(12, seed=12)
HOSTILE = [
    *LATTICE[::3], (0.5, -0.5, 0.5, -0.5), *(turned(*vector) for vector in ((1e-9, 0, 0), (0, 1e-300, 0), (0, 3.14159265, 0))),
    *(turned(0.0, 0.5 * 3.141592653589793 - gap, 0.0) for gap in (0.0, 1e-9, 1e-5)),
]  # fmt: skip
ALL = quaternions(30)
SPECS = [
    f"{name}{unit}{axes}"
    for name, row in TABLE.items()
    for unit in (("", "_deg") if row.angles else ("",))
    for axes in ([f":{each}" for each in euler.AXES] if name == "euler" else [""])
]


def seeded(seed: str) -> Random:
    """Return a generator that draws the same for the same seed."""
    return Random(seed)  # noqa: S311 - draws samples


def rotation(spec: str, xyzw: tuple[float, float, float, float]) -> dict[str, Any]:
    """Write a rotation in a notation, as a member of a pose."""
    form = notation(spec)
    numbers = list(form.from_quaternion(*xyzw, floats))
    return {form.representation.name + ("_deg" if form.degrees else ""): form.spelled(numbers)}


def position(random: Random) -> list[float]:
    """Draw a position: zeros, exact and ragged numbers, tiny and large ones."""
    return [random.choice((0.0, random.uniform(-3, 3), random.uniform(-1e4, 1e4), 1e-9, 12.5)) for _ in "xyz"]


def pose(random: Random) -> dict[str, Any]:
    """Draw a pose in some notation, at times as the inverse of what it is."""
    made = {"xyz": position(random)} | rotation(random.choice(SPECS), random.choice([*ROTATIONS, *HOSTILE]))
    return made | ({"inverse": "true"} if random.random() < 0.2 else {})


def record(random: Random) -> dict[str, Any]:
    """Draw a point, a vector or a pose."""
    return random.choice(({"point": position(random)}, {"vector": position(random)}, pose(random)))
