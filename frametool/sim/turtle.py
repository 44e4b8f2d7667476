"""Turtlesim's world and its turtles: motion, constants and rounding of the node, its services and their errors.

Lengths in metres, angles in radians, x to the right, y up; internally y points down from the top as in turtlesim.
Source: turtlesim's turtle.cpp, for ROS 1 and ROS 2.
"""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, listing, printable, shown

if TYPE_CHECKING:
    from typing import Self

TICK_NS = 16_000_000
DT = 0.016  # seconds; the node uses this constant, not the elapsed time
TIMEOUT_NS = 1_000_000_000
PI = 3.14159265  # the node's own macro
SIZE = 11.088889122009277  # metres: float32 of 499 pixels / 45 pixels per metre
CENTRE = SIZE / 2.0
TURN_SPEED = 1.0  # radians per second, of rotate_absolute
TURN_NEAR = 0.02  # radians, where rotate_absolute ends
FASTEST_TURN = 1e15  # radians per second; beyond, an angle after wrapping is only rounding


class _Components(NamedTuple):
    linear_x: float
    angular_z: float
    linear_y: float = 0.0


class Twist(_Components):
    """A velocity command: metres and radians per second, in the turtle's own frame; x ahead, y to its left.

    Raises:
        ValueInvalid: a component is nan or infinite, or a rotation so fast that no heading is left; turtlesim would
        accept
            it and lose the turtle for good.
    """

    __slots__ = ()

    def __new__(cls, linear_x: float, angular_z: float, linear_y: float = 0.0) -> Self:
        """Check every component."""
        if not (math.isfinite(linear_x) and abs(angular_z) <= FASTEST_TURN and math.isfinite(linear_y)):
            limits = f"must be finite, and turns at most {FASTEST_TURN:g} rad/s"
            raise ValueInvalid(f"a velocity {limits}, found linear {linear_x} {linear_y}, angular {angular_z}")
        return super().__new__(cls, linear_x, angular_z, linear_y)


class TurtleState(NamedTuple):
    """The pose of a turtle, in double precision: metres, radians."""

    x: float
    y: float
    theta: float


class TurtlePose(NamedTuple):
    """The message that turtlesim publishes at every tick: turtlesim/Pose, rounded to float32; the speed has no sign."""

    x: float
    y: float
    theta: float
    linear_velocity: float
    angular_velocity: float


class Pen(NamedTuple):
    """The pen of a turtle: colour 0 to 255, width in pixels."""

    r: int = 179
    g: int = 184
    b: int = 255
    width: int = 3
    off: bool = False


def single(value: float) -> float:
    """Round to float32, as turtlesim's messages and service arguments are."""
    return array("f", (value,))[0]


def check_single(**numbers: float) -> None:
    """Refuse numbers that a message of float32 cannot hold.

    Raises ValueInvalid, which names the first of them.
    """
    for name, value in numbers.items():
        if not math.isfinite(single(value)):
            raise ValueInvalid(f"{name} must be a number within float32, found {value:g}")


def wrapped(theta: float) -> float:
    """Wrap an angle to [-PI, PI) by turtlesim's formula."""
    return theta - 2.0 * PI * math.floor((theta + PI) / (2.0 * PI))


class Turtle:
    """A turtle that keeps its last command for a second, moves, and stops at the walls.

        turtle = Turtle()
        turtle.command(Twist(2.0, 0.0))
        for tick in range(1, 126):
            turtle.update(tick * TICK_NS)
        turtle.pose.x                       # 7.560444, after 63 ticks of motion

    holonomic: linear_y is used; ROS 1 always, ROS 2 only with its parameter of that name.
    """

    def __init__(
        self, x: float = CENTRE, y: float = CENTRE, theta: float = 0.0, *,
        name: str = "turtle1", holonomic: bool = True,
    ) -> None:  # fmt: skip
        """Create a turtle; x, y, theta are float32, as in the spawn service.

        Raises ValueInvalid for values that are not finite float32.
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
        """Return the pose in double precision, y up."""
        return TurtleState(self._x, SIZE - self._down, self._theta)

    @property
    def pose(self) -> TurtlePose:
        """Return the message that turtlesim would publish now, float32."""
        ahead, turning, aside = self._velocity
        speed = math.sqrt(ahead * ahead + aside * aside)
        return TurtlePose(*array("f", (self._x, SIZE - self._down, self._theta, speed, turning)))

    def command(self, twist: Twist) -> None:
        """Set a velocity command; it acts from the next tick on, the last one of several wins."""
        self._inbox = twist

    def teleport_absolute(self, x: float, y: float, theta: float) -> None:
        """Jump to a pose at the next tick; float32, as in the service."""
        self._teleports.append((False, single(x), single(y), single(theta)))

    def teleport_relative(self, linear: float, angular: float) -> None:
        """Rotate, then jump ahead, at the next tick."""
        self._teleports.append((True, single(linear), 0.0, single(angular)))

    def set_pen(self, r: float, g: float, b: float, width: float, off: float) -> None:
        """Change the pen from the next tick on; the service's numbers, `off` is 0 or 1."""
        self.pen = Pen(int(r), int(g), int(b), int(width), bool(off))

    def rotate_absolute(self, theta: float | None) -> None:
        """Rotate to a heading at 1 rad/s (ROS 2); a velocity command aborts it, None cancels it."""
        if theta is None and self._heading is not None:
            self._velocity = Twist(0.0, 0.0)
        self._heading = None if theta is None else single(theta)

    def update(self, now_ns: int) -> TurtleState | None:
        """Advance one tick.

        Returns the pose outside the world from which the turtle was moved back to the wall, else None.
        """
        if self._inbox is not None:
            ahead, turning, aside = self._inbox
            self._velocity = Twist(ahead, turning, aside if self.holonomic else 0.0)
            self._commanded_ns = now_ns
            self._inbox = self._heading = None
        for is_relative, x, y, theta in self._teleports:
            if is_relative:
                self._theta += theta
                self._x += math.cos(self._theta) * x
                self._down -= math.sin(self._theta) * x
            else:
                self._x, self._down, self._theta = x, max(0.0, SIZE - y), theta
        self._teleports.clear()
        if self._heading is not None:  # the goal of rotate_absolute
            remaining = wrapped(self._heading - self._theta)
            if abs(remaining) < TURN_NEAR:
                self._heading = None
                self._velocity = Twist(0.0, 0.0)
            else:
                self._velocity = Twist(0.0, math.copysign(TURN_SPEED, remaining))
                self._commanded_ns = now_ns
        if now_ns - self._commanded_ns > TIMEOUT_NS:
            self._velocity = Twist(0.0, 0.0)
        ahead, turning, aside = self._velocity
        self._theta = wrapped(self._theta + turning * DT)
        cosine, sine = math.cos(self._theta), math.sin(self._theta)
        self._x += cosine * ahead * DT - sine * aside * DT
        self._down -= cosine * aside * DT + sine * ahead * DT
        if 0.0 <= self._x <= SIZE and 0.0 <= self._down <= SIZE:
            return None
        outside = self.state
        self._x = min(max(self._x, 0.0), SIZE)
        self._down = min(max(self._down, 0.0), SIZE)
        return outside


VARIANTS = ("ros1", "ros2")
FAR = 1e9  # metres; beyond, a position is written with an exponent
# service -> its arguments and their defaults (None: required)
SERVICES: dict[str, dict[str, float | str | None]] = {
    "spawn": {"x": None, "y": None, "theta": 0.0, "name": ""},
    "kill": {"name": None},
    "reset": {},
    "clear": {},
    "teleport_absolute": {"turtle": None, "x": None, "y": None, "theta": 0.0},
    "teleport_relative": {"turtle": None, "linear": 0.0, "angular": 0.0},
    "rotate_absolute": {"turtle": None, "theta": None},
    "set_pen": {"turtle": None, "r": 0.0, "g": 0.0, "b": 0.0, "width": 0.0, "off": 0.0},
}


class ServiceRefused(ValueInvalid):
    """A service call that turtlesim refuses, in its own words."""


class WallHit(NamedTuple):
    """A tick at which a turtle was moved back to the wall; `place` is where it would have been, y up."""

    t_ns: int
    turtle: str
    place: TurtleState

    def __str__(self) -> str:
        """Format turtlesim's warning, with y up."""
        x, y = (f"{each:f}" if abs(each) < FAR else f"{each:g}" for each in self.place[:2])
        return f"{printable(self.turtle)}: Oh no! I hit the wall! (Clamping from [x={x}, y={y}])"


class World:
    """The turtles by name, moved one after another in the order of their names at every tick.

        world = World()
        world.spawn(4.0, 2.0, 0.0, "turtle2")
        world.tick(16_000_000)

    variant: "ros1" or "ros2"; they differ in wording, in `rotate_absolute`, and in `holonomic`, which ROS 1 always is.
    """

    def __init__(self, variant: str = "ros1", *, holonomic: bool = False) -> None:
        """Create an empty world; `reset` adds turtle1, as the node does when it starts."""
        if variant not in VARIANTS:
            raise ValueInvalid(f"no turtlesim {shown(variant)}; there are {', '.join(VARIANTS)}")
        self.variant = variant
        self.holonomic = holonomic or variant == "ros1"
        self.clears = 0  # how often the drawing was cleared
        self._turtles: dict[str, Turtle] = {}
        self._in_order = True
        self._count = 0

    @property
    def turtles(self) -> dict[str, Turtle]:
        """Return the turtles in the order of their names; sorted once after any number of spawns."""
        if not self._in_order:
            self._turtles = dict(sorted(self._turtles.items()))
            self._in_order = True
        return self._turtles

    def spawn(self, x: float = CENTRE, y: float = CENTRE, theta: float = 0.0, name: str = "") -> str:
        """Create a turtle; without a name it gets the next free turtleN. Returns its name.

        Raises ServiceRefused when the name is taken.
        """
        if name in self._turtles:
            article = "turtled" if self.variant == "ros1" else "turtle"
            raise ServiceRefused(f"A {article} named [{name}] already exists")
        while not name or name in self._turtles:
            self._count += 1
            name = f"turtle{self._count}"
        self._turtles[name] = Turtle(x, y, theta, name=name, holonomic=self.holonomic)
        self._in_order = False
        return name

    def kill(self, name: str) -> None:
        """Remove a turtle.

        Raises ServiceRefused when there is none of that name.
        """
        if name not in self._turtles:
            raise ServiceRefused(f"Tried to kill turtle [{name}], which does not exist")
        del self._turtles[name]

    def reset(self) -> None:
        """Remove all turtles, restart their numbering, clear the drawing, and spawn turtle1 in the centre."""
        self._turtles.clear()
        self._count = 0
        self.clear()
        self.spawn()

    def clear(self) -> None:
        """Clear the drawing."""
        self.clears += 1

    def turtle(self, name: str) -> Turtle:
        """Return a turtle by name.

        Raises ServiceRefused when there is none: its services went with it.
        """
        if name not in self._turtles:
            raise ServiceRefused(f"no turtle [{name}] to call; turtles: {listing(self._turtles, near=name) or 'none'}")
        return self._turtles[name]

    def call(self, service: str, **arguments: float | str) -> str:
        """Call a service of the table SERVICES by name; missing arguments have the table's default.

        Returns the message that turtlesim logs, or "".
        Raises ServiceRefused; ValueInvalid for an unknown service or a wrong argument.
        """
        values = complete(service, arguments)
        if self.variant == "ros1" and service == "rotate_absolute":
            raise ServiceRefused("rotate_absolute is an action of the ROS 2 turtlesim; add turtlesim: ros2")
        receiver = self.turtle(str(values.pop("turtle"))) if "turtle" in values else self
        answer = getattr(receiver, service)(**values)
        if service == "spawn":
            place = ", ".join(f"{name}=[{single(float(values[name])):f}]" for name in ("x", "y", "theta"))
            return f"Spawning turtle [{answer}] at {place}"
        return {"reset": "Resetting turtlesim.", "clear": "Clearing turtlesim."}.get(service, "")

    def tick(self, now_ns: int) -> list[WallHit]:
        """Move every turtle by one tick; returns those that hit a wall."""
        outside = ((name, turtle.update(now_ns)) for name, turtle in self.turtles.items())
        return [WallHit(now_ns, name, place) for name, place in outside if place is not None]


def complete(service: str, arguments: dict[str, float | str]) -> dict[str, float | str]:
    """Return a service's arguments with the defaults of the table.

    Raises ValueInvalid for an unknown service or argument, or one that is missing or not a finite float32.
    """
    if service not in SERVICES:
        raise ValueInvalid(f"no service {shown(service)}; services: {', '.join(SERVICES)}")
    expected = SERVICES[service]
    if unknown := [name for name in arguments if name not in expected]:
        raise ValueInvalid(f"{service} has no {shown(unknown[0])}; expected {', '.join(expected) or 'nothing'}")
    values = {name: arguments.get(name, default) for name, default in expected.items()}
    if missing := [name for name, value in values.items() if value is None]:
        raise ValueInvalid(f"{service} needs {', '.join(missing)}")
    check_single(**{name: value for name, value in values.items() if isinstance(value, float)})
    return {name: value for name, value in values.items() if value is not None}
