"""What a follower looks at: the leader itself, or a carrot frame that hangs on it."""

from __future__ import annotations

import math

from frametool.frames.stamps import BILLION
from frametool.geometry.transform import Transform

TARGETS = ("leader", "carrot", "moving-carrot")
CARROT_NS = BILLION // 10  # between two broadcasts of a carrot
CARROT_ASIDE = 2.0  # metres
CARROT_CIRCLE = 10.0  # metres


def frame_of(turtle: str, target: str) -> str:
    """Name the frame that is looked up: the turtle, or its carrot (turtle1's is carrot1)."""
    if target == "leader":
        return turtle
    return f"carrot{turtle[6:]}" if turtle[:6] == "turtle" and turtle[6:].isdigit() else f"{turtle}_carrot"


def offset(target: str, now_ns: int) -> tuple[float, float]:
    """Return where a target stands in its leader's frame, in metres."""
    if target == "leader":
        return 0.0, 0.0
    if target == "carrot":
        return 0.0, CARROT_ASIDE
    angle = now_ns / BILLION * math.pi
    return CARROT_CIRCLE * math.sin(angle), CARROT_CIRCLE * math.cos(angle)


def planar(x: float, y: float, theta: float) -> Transform:
    """Return a pose in the plane as a transform."""
    return Transform.of(x, y, 0.0, 0.0, 0.0, math.sin(theta / 2.0), math.cos(theta / 2.0))
