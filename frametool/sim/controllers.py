"""The follower's law: from where the target is, seen by the turtle, to a velocity command.

What a follower looks at: the leader itself, or a carrot frame that hangs on it.
"""

from __future__ import annotations

import math

from frametool.errors import ValueInvalid, shown
from frametool.frames.stamps import BILLION
from frametool.geometry.transform import Transform
from frametool.sim.turtle import Twist

# law -> rate in Hz, linear gain in 1/s, angular gain in 1/s: turtle_tf2_listener of each ROS
LAWS = {"ros1": (10.0, 0.5, 4.0), "ros2": (1.0, 0.5, 1.0)}
SLOWEST, FASTEST = 1e-6, 1e6  # Hz; two steps must not fall on one nanosecond
ARRIVED = 2e-6  # metres: positions near 11 m are float32, 1e-6 apart; a bearing between neighbours is rounding


class FollowController:
    """Drive towards a target: linear = gain * distance, angular = gain * bearing; each limited if told.

        FollowController().command(1.0, 1.0)         # Twist(linear_x=0.707.., angular_z=3.14159..)

    law: "ros1" or "ros2", for whatever is None.  rate in Hz, gains in 1/s, limits in m/s and rad/s (None: no limit).
    At distance zero (below ARRIVED) the command is zero: the bearing is rounding noise there and makes turtles spin.
    """

    def __init__(
        self, law: str = "ros1", *, rate: float | None = None, gain_linear: float | None = None,
        gain_angular: float | None = None, max_linear: float | None = None, max_angular: float | None = None,
    ) -> None:
        """Take what is given and the law's own numbers for the rest.

        Raises:
            ValueInvalid: unknown law, impossible rate, negative limit, a gain that is not finite.
        """
        if law not in LAWS:
            raise ValueInvalid(f"no law {shown(law)}; laws: {', '.join(LAWS)}")
        own_rate, own_linear, own_angular = LAWS[law]
        self.rate = _checked("rate", own_rate if rate is None else rate, SLOWEST, FASTEST)
        self.gain_linear = _checked("gain_linear", own_linear if gain_linear is None else gain_linear)
        self.gain_angular = _checked("gain_angular", own_angular if gain_angular is None else gain_angular)
        self.max_linear = math.inf if max_linear is None else _checked("max_linear", max_linear, 0.0)
        self.max_angular = math.inf if max_angular is None else _checked("max_angular", max_angular, 0.0)

    def command(self, x: float, y: float) -> Twist:
        """Return the command for a target seen at x ahead, y to the left (metres).

        Raises ValueInvalid when a gain makes the velocity infinite.
        """
        distance = math.sqrt(x * x + y * y)
        if distance < ARRIVED:
            return Twist(0.0, 0.0)
        linear = self.gain_linear * distance
        angular = self.gain_angular * math.atan2(y, x)
        try:
            return Twist(_limited(linear, self.max_linear), _limited(angular, self.max_angular))
        except ValueInvalid:
            raise ValueInvalid(unbounded(self.gain_linear, self.gain_angular, distance)) from None

    def due_ns(self, count: int) -> int:
        """Return the time of the control step of that number, from 0; rounded once, so that no rate drifts."""
        return round(count * BILLION / self.rate)


def unbounded(gain_linear: float, gain_angular: float, distance: float) -> str:
    """Say that gains are too great; metres."""
    return f"gain_linear {gain_linear:g}, gain_angular {gain_angular:g} give no finite velocity at {distance:g} m"


def _limited(value: float, most: float) -> float:
    return max(-most, min(most, value))


def _checked(name: str, value: float, least: float = -math.inf, most: float = math.inf) -> float:
    """Return a number back if it is finite and within its bounds."""
    if not math.isfinite(value):
        raise ValueInvalid(f"{name} must be finite, found {value}")
    if not least <= value <= most:
        bounds = f"{least:g} or more" if most == math.inf else f"{least:g} .. {most:g} Hz"
        raise ValueInvalid(f"{name} must be {bounds}, found {value:g}")
    return float(value)


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
