"""One turtle, moved as turtlesim moves it: its arithmetic, its constants, its rounding.

Lengths in metres, angles in radians, x to the right, y up; inside, y runs down from the top as in turtlesim's window.
Source: turtlesim's turtle.cpp, for ROS 1 and ROS 2.
"""

from __future__ import annotations

import math
from struct import Struct
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid

if TYPE_CHECKING:
    from typing import Self

TICK_NS = 16_000_000
DT = 0.016  # seconds; the node takes this constant, not the time that passed
TIMEOUT_NS = 1_000_000_000
PI = 3.14159265  # the node's own macro
SIZE = 11.088889122009277  # metres: float32 of 499 pixels / 45 pixels a metre
CENTRE = SIZE / 2.0
TURN_SPEED = 1.0  # radians a second, of rotate_absolute
TURN_NEAR = 0.02  # radians, where rotate_absolute ends
FASTEST_TURN = 1e15  # radians a second; beyond, what is left of an angle after wrapping is rounding

_ONE_SINGLE = Struct("f")
_FIVE_SINGLES = Struct("5f")


class _Components(NamedTuple):
    linear_x: float
    angular_z: float
    linear_y: float = 0.0


class Twist(_Components):
    """A velocity command: metres and radians a second, in the turtle's own frame; x ahead, y to its left.

    Raises:
        ValueInvalid: a component is nan or infinite, or a turn so fast that no heading is left; turtlesim would take it
            and lose the turtle for good.
    """

    __slots__ = ()

    def __new__(cls, linear_x: float, angular_z: float, linear_y: float = 0.0) -> Self:
        """Check that every component can be used."""
        if not (math.isfinite(linear_x) and abs(angular_z) <= FASTEST_TURN and math.isfinite(linear_y)):
            limits = f"must be finite, and turns at most {FASTEST_TURN:g} rad/s"
            raise ValueInvalid(f"a velocity {limits}, found linear {linear_x} {linear_y}, angular {angular_z}")
        return super().__new__(cls, linear_x, angular_z, linear_y)


class TurtleState(NamedTuple):
    """Where a turtle is, in double precision: metres, radians."""

    x: float
    y: float
    theta: float

    def distance(self, other: TurtleState) -> float:
        """Return the metres to another turtle."""
        return math.hypot(other.x - self.x, other.y - self.y)


class TurtlePose(NamedTuple):
    """What turtlesim publishes at every tick: turtlesim/Pose, rounded to float32; the speed has no sign."""

    x: float
    y: float
    theta: float
    linear_velocity: float
    angular_velocity: float


class Pen(NamedTuple):
    """What a turtle draws with: colour 0 to 255, width in pixels."""

    r: int = 179
    g: int = 184
    b: int = 255
    width: int = 3
    off: bool = False


def single(value: float) -> float:
    """Round to float32, as turtlesim's messages and service arguments are."""
    try:
        return float(_ONE_SINGLE.unpack(_ONE_SINGLE.pack(value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def check_single(**numbers: float) -> None:
    """Refuse numbers that a message of float32 cannot hold.

    Raises ValueInvalid, which names the first of them.
    """
    for name, value in numbers.items():
        if not math.isfinite(single(value)):
            raise ValueInvalid(f"{name} must be a number within float32, found {value:g}")


def wrapped(theta: Any, xp: Any = math) -> Any:
    """Bring an angle into [-PI, PI) by turtlesim's formula."""
    return theta - 2.0 * PI * xp.floor((theta + PI) / (2.0 * PI))


def turned(theta: Any, turning: Any, xp: Any) -> tuple[Any, Any, Any]:
    """Return the heading after one tick at a turn rate (rad/s), its cosine and its sine.

    Floats with `math` as xp, or arrays with numpy.
    """
    theta = wrapped(theta + turning * DT, xp)
    return theta, xp.cos(theta), xp.sin(theta)


class Turtle:
    """A turtle that keeps its last command for a second, walks, and stops at the walls.

        turtle = Turtle()
        turtle.command(Twist(2.0, 0.0))
        for tick in range(1, 126):
            turtle.update(tick * TICK_NS)
        turtle.pose.x                       # 7.560444, after 63 ticks of motion

    holonomic: linear_y counts; ROS 1 always, ROS 2 only with its parameter of that name.
    """

    def __init__(
        self, x: float = CENTRE, y: float = CENTRE, theta: float = 0.0, *,
        name: str = "turtle1", holonomic: bool = True,
    ) -> None:  # fmt: skip
        """Put a turtle into the world; x, y, theta are float32, as in the spawn service.

        Raises ValueInvalid for what is no finite float32.
        """
        check_single(x=x, y=y, theta=theta)
        self.name = name
        self.holonomic = holonomic
        self.pen = Pen()
        self._x, self._down, self._theta = single(x), single(SIZE - single(y)), single(theta)
        self._velocity = Twist(0.0, 0.0)
        self._commanded_ns = 0
        self._inbox: Twist | None = None
        self._teleports: list[tuple[bool, float, float, float]] = []
        self._heading: float | None = None

    @property
    def state(self) -> TurtleState:
        """Return where the turtle is, in double precision, y up."""
        return TurtleState(self._x, SIZE - self._down, self._theta)

    @property
    def pose(self) -> TurtlePose:
        """Return what turtlesim would publish now, float32."""
        ahead, turning, aside = self._velocity
        return _rounded(self._x, SIZE - self._down, self._theta, math.sqrt(ahead * ahead + aside * aside), turning)

    def command(self, twist: Twist) -> None:
        """Take a velocity command; it acts from the next tick on, the last one of several wins."""
        self._inbox = twist

    def teleport_absolute(self, x: float, y: float, theta: float) -> None:
        """Jump to a place at the next tick; float32, as the service takes it."""
        self._teleports.append((False, single(x), single(y), single(theta)))

    def teleport_relative(self, linear: float, angular: float) -> None:
        """Turn, then jump ahead, at the next tick."""
        self._teleports.append((True, single(linear), 0.0, single(angular)))

    def set_pen(self, r: float, g: float, b: float, width: float, off: float) -> None:
        """Draw with another pen from the next tick on; the service's numbers, `off` is 0 or 1."""
        self.pen = Pen(int(r), int(g), int(b), int(width), bool(off))

    def rotate_absolute(self, theta: float | None) -> None:
        """Turn to a heading at 1 rad/s (ROS 2); a velocity command aborts it, None gives it up."""
        if theta is None and self._heading is not None:
            self._velocity = Twist(0.0, 0.0)
        self._heading = None if theta is None else single(theta)

    def update(self, now_ns: int) -> TurtleState | None:
        """Advance one tick.

        Returns where the turtle would have been outside the world before it was put back to the wall, else None.
        """
        self._take_command(now_ns)
        for teleport in self._teleports:
            self._teleport(*teleport)
        self._teleports.clear()
        self._turn_to_heading(now_ns)
        if now_ns - self._commanded_ns > TIMEOUT_NS:
            self._velocity = Twist(0.0, 0.0)
        ahead, turning, aside = self._velocity
        self._theta, cosine, sine = turned(self._theta, turning, math)
        self._x += cosine * ahead * DT - sine * aside * DT
        self._down -= cosine * aside * DT + sine * ahead * DT
        return self._stay_inside()

    def _take_command(self, now_ns: int) -> None:
        if self._inbox is None:
            return
        ahead, turning, aside = self._inbox
        self._velocity = Twist(ahead, turning, aside if self.holonomic else 0.0)
        self._commanded_ns = now_ns
        self._inbox = self._heading = None

    def _teleport(self, relative: bool, x: float, y: float, theta: float) -> None:  # noqa: FBT001 - a queued call
        if relative:
            self._theta += theta
            self._x += math.cos(self._theta) * x
            self._down -= math.sin(self._theta) * x
        else:
            self._x, self._down, self._theta = x, max(0.0, SIZE - y), theta

    def _turn_to_heading(self, now_ns: int) -> None:
        """Turn towards the goal of rotate_absolute, if there is one."""
        if self._heading is None:
            return
        remaining = wrapped(self._heading - self._theta)
        if abs(remaining) < TURN_NEAR:
            self._heading = None
            self._velocity = Twist(0.0, 0.0)
        else:
            self._velocity = Twist(0.0, math.copysign(TURN_SPEED, remaining))
            self._commanded_ns = now_ns

    def _stay_inside(self) -> TurtleState | None:
        if 0.0 <= self._x <= SIZE and 0.0 <= self._down <= SIZE:
            return None
        outside = self.state
        self._x = min(max(self._x, 0.0), SIZE)
        self._down = min(max(self._down, 0.0), SIZE)
        return outside


def _rounded(*numbers: float) -> TurtlePose:
    """Round a pose to float32."""
    try:
        return TurtlePose(*_FIVE_SINGLES.unpack(_FIVE_SINGLES.pack(*numbers)))
    except OverflowError:
        return TurtlePose(*map(single, numbers))
