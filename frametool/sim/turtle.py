"""Turtlesim's world and its turtles: motion, constants and rounding of the node, its services; leaders and followers.

Lengths in metres, angles in radians, x to the right, y up; internally y points down from the top as in turtlesim.
Source: turtlesim's turtle.cpp, for ROS 1 and ROS 2.

Leaders move independently.  A leader is made from a function that returns the current pose of its turtle, and yields
the time at which it is to be resumed, in nanoseconds, and then its command, if there is one.  A follower's control law
maps the position of the target, relative to the turtle, to a velocity command.
"""

from __future__ import annotations

import math
import os
import re
import sys
from array import array
from collections import deque
from contextlib import contextmanager
from functools import partial
from itertools import chain, count, cycle, repeat
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import Misused, ValueInvalid, listing, printable, shown
from frametool.frames.lookups import checked_rate
from frametool.frames.stamps import BILLION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import Self

    Look = Callable[[], "TurtlePose"]
    MakeLeader = Callable[[Look], Iterator["int | Twist | Heading"]]

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

    Raises ValueInvalid for a component that is nan or infinite, or a rotation so fast that no heading is left;
    turtlesim would accept it and lose the turtle for good.
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
    """Raise ValueInvalid for numbers that a message of float32 cannot hold; it names the first of them."""
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
        """Jump to a pose; float32, as in the service."""
        self._x, self._down, self._theta = single(x), max(0.0, SIZE - single(y)), single(theta)

    def teleport_relative(self, linear: float, angular: float) -> None:
        """Rotate, then jump ahead."""
        self._theta += single(angular)
        self._x += math.cos(self._theta) * single(linear)
        self._down -= math.sin(self._theta) * single(linear)

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
        self.turtles: dict[str, Turtle] = {}
        self._count = 0

    def spawn(self, x: float = CENTRE, y: float = CENTRE, theta: float = 0.0, name: str = "") -> str:
        """Create a turtle; without a name it gets the next free turtleN. Returns its name.

        Raises ServiceRefused when the name is taken.
        """
        if name in self.turtles:
            article = "turtled" if self.variant == "ros1" else "turtle"
            raise ServiceRefused(f"A {article} named [{name}] already exists")
        while not name or name in self.turtles:
            self._count += 1
            name = f"turtle{self._count}"
        self.turtles[name] = Turtle(x, y, theta, name=name, holonomic=self.holonomic)
        return name

    def kill(self, name: str) -> None:
        """Remove a turtle; raises ServiceRefused if no turtle has this name."""
        if name not in self.turtles:
            raise ServiceRefused(f"Tried to kill turtle [{name}], which does not exist")
        del self.turtles[name]

    def reset(self) -> None:
        """Remove all turtles, restart their numbering, clear the drawing, and spawn turtle1 in the centre."""
        self.turtles.clear()
        self._count = 0
        self.clear()
        self.spawn()

    def clear(self) -> None:
        """Clear the drawing."""
        self.clears += 1

    def call(self, service: str, **arguments: float | str) -> str:
        """Call a service of the table SERVICES by name; missing arguments have the table's default.

        Returns the message that turtlesim logs, or "".
        Raises ServiceRefused, also if there is no such turtle; ValueInvalid for an unknown service or a wrong argument.
        """
        values = complete(service, arguments)
        if self.variant == "ros1" and service == "rotate_absolute":
            raise ServiceRefused("rotate_absolute is an action of the ROS 2 turtlesim; add turtlesim: ros2")
        receiver: World | Turtle = self
        if (name := str(values.pop("turtle", ""))) in self.turtles:
            receiver = self.turtles[name]
        elif "turtle" in SERVICES[service]:
            known = listing(self.turtles, near=name) or "none"
            raise ServiceRefused(f"no turtle [{name}] to call; turtles: {known}")
        answer = getattr(receiver, service)(**values)
        if service == "spawn":
            place = ", ".join(f"{name}=[{single(float(values[name])):f}]" for name in ("x", "y", "theta"))
            return f"Spawning turtle [{answer}] at {place}"
        return {"reset": "Resetting turtlesim.", "clear": "Clearing turtlesim."}.get(service, "")

    def tick(self, now_ns: int) -> list[WallHit]:
        """Move every turtle by one tick; returns those that hit a wall."""
        outside = ((name, turtle.update(now_ns)) for name, turtle in sorted(self.turtles.items()))
        return [WallHit(name, place) for name, place in outside if place is not None]


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


# --- leaders and followers ---

# law -> rate in Hz, linear gain in 1/s, angular gain in 1/s: turtle_tf2_listener of each ROS
LAWS = {"ros1": (10.0, 0.5, 4.0), "ros2": (1.0, 0.5, 1.0)}
ARRIVED = 2e-6  # metres: positions near 11 m are float32, 1e-6 apart; the bearing of a neighbour is rounding


class FollowController:
    """Drive towards a target: linear = gain * distance, angular = gain * bearing; with optional limits.

        FollowController().command(1.0, 1.0)         # Twist(linear_x=0.707.., angular_z=3.14159..)

    law: "ros1" or "ros2", the defaults.  rate in Hz, gains in 1/s, limits in m/s and rad/s (None: no limit).
    At distance zero (below ARRIVED) the command is zero: there the bearing is rounding noise and makes turtles spin.
    """

    def __init__(
        self, law: str = "ros1", *, rate: float | None = None, gain_linear: float | None = None,
        gain_angular: float | None = None, max_linear: float | None = None, max_angular: float | None = None,
    ) -> None:
        """Store these numbers, with the law's own for those that are None.

        Raises:
            ValueInvalid: unknown law, impossible rate, negative limit, a gain that is not finite.
        """
        if law not in LAWS:
            raise ValueInvalid(f"no law {shown(law)}; laws: {', '.join(LAWS)}")
        own_rate, own_linear, own_angular = LAWS[law]
        self.rate = checked_rate(own_rate if rate is None else rate)
        self.gain_linear = _checked("gain_linear", own_linear if gain_linear is None else gain_linear)
        self.gain_angular = _checked("gain_angular", own_angular if gain_angular is None else gain_angular)
        self.max_linear = math.inf if max_linear is None else _checked("max_linear", max_linear, 0.0)
        self.max_angular = math.inf if max_angular is None else _checked("max_angular", max_angular, 0.0)

    def command(self, x: float, y: float) -> Twist:
        """Return the command for a target at x ahead, y to the left (metres).

        Raises ValueInvalid when a gain makes the velocity infinite.
        """
        distance = math.sqrt(x * x + y * y)
        if distance < ARRIVED:
            return Twist(0.0, 0.0)
        linear = max(-self.max_linear, min(self.max_linear, self.gain_linear * distance))
        angular = max(-self.max_angular, min(self.max_angular, self.gain_angular * math.atan2(y, x)))
        return Twist(linear, angular)

    def due_ns(self, number: int) -> int:
        """Return the time of the n-th control step, from 0; rounded once, so that no rate drifts."""
        return round(number * BILLION / self.rate)


def _checked(name: str, value: float, least: float = -math.inf) -> float:
    """Return a number if it is finite and not below the least."""
    if not (math.isfinite(value) and least <= value):
        raise ValueInvalid(f"{name} must be finite{', 0 or more' * (least == 0.0)}, found {value:g}")
    return float(value)


TARGETS = ("leader", "carrot", "moving-carrot")
STILL = 1e-4  # m/s and rad/s: draw_square's own threshold for a stop
CIRCLING = Twist(2.0, 1.8)  # the command of the turtlesim tutorial: to the left with a radius of 1.11 m
KEYS = {"up": Twist(2.0, 0.0), "down": Twist(-2.0, 0.0), "left": Twist(0.0, 2.0), "right": Twist(0.0, -2.0)}


class EndOfRun(Exception):
    """Raised by a leader to end the simulation."""


class Heading(NamedTuple):
    """A command to rotate to a heading (radians), as the ROS 2 teleop sends to rotate_absolute; None cancels it."""

    theta: float | None


# the keys around F of the ROS 2 teleop
HEADINGS = {key: Heading(math.radians(45.0 * number)) for number, key in enumerate("gtredcvb")} | {"f": Heading(None)}


def arriving(commands: Iterable[tuple[int, Twist | Heading]]) -> MakeLeader:
    """Return a leader of commands that arrive during the simulation, read by a thread; each acts from its time on.

    It looks for commands at every tick; the last one wins.  If reading them fails it raises the error, EndOfRun if the
    user ended the run.
    """
    from threading import Thread

    posted: deque[tuple[int, Twist | Heading]] = deque()
    failures: list[Exception] = []

    def fill() -> None:
        try:
            posted.extend(commands)
        except Exception as error:  # noqa: BLE001 - raised again where it is seen
            failures.append(error)

    def leader(_: Look) -> Iterator[int | Twist | Heading]:
        for now_ns in count(0, TICK_NS):
            yield now_ns
            newest = None
            while posted and posted[0][0] <= now_ns:
                newest = posted.popleft()[1]
            if newest is not None:
                yield newest
            elif failures:
                raise failures[0]

    Thread(target=fill, daemon=True).start()
    return leader


def scripted(commands: Iterable[tuple[int, Twist]]) -> MakeLeader:
    """Return a leader of (nanoseconds, Twist) pairs, read one ahead; lists can be run again.

    Between them turtlesim keeps the last one for a second.
    Raises ValueInvalid, when it runs, for a time that is before the previous one.
    """

    def leader(_: Look) -> Iterator[int | Twist]:
        last_ns = 0
        for due_ns, twist in commands:
            if due_ns < last_ns:
                raise ValueInvalid(f"a command at {due_ns} ns comes after one at {last_ns} ns; sort them by time")
            yield due_ns
            yield twist
            last_ns = due_ns

    return leader


def periodic(period_ns: int, drive: Callable[[Look], Iterator[Twist]]) -> MakeLeader:
    """Return a leader with a command at a fixed period, the first at time 0."""

    def leader(look: Look) -> Iterator[int | Twist]:
        commands = drive(look)
        for now_ns in count(0, period_ns):
            yield now_ns
            yield next(commands)

    return leader


def figure_eight(_: Look) -> Iterator[Twist]:
    """Drive circles to the left and to the right in turn, a command each tick."""
    for now_ns in count(0, TICK_NS):
        turns = int(now_ns / BILLION * CIRCLING.angular_z / (2.0 * math.pi))
        yield Twist(CIRCLING.linear_x, -CIRCLING.angular_z if turns % 2 else CIRCLING.angular_z)


def square(look: Look) -> Iterator[Twist]:
    """Drive 2 m sides at 1 m/s, quarter turns at 0.4 rad/s, and a full stop after each, as turtlesim's draw_square.

    Source: turtlesim's tutorials/draw_square.cpp.
    """
    stop, pose = Twist(0.0, 0.0), look()
    for goes in cycle((True, False)):
        if goes:
            x, y = math.cos(pose.theta) * 2.0 + pose.x, math.sin(pose.theta) * 2.0 + pose.y
            goal = pose._replace(x=x, y=y)
        else:
            goal = pose._replace(theta=wrapped(pose.theta + PI / 2.0))
        pose = look()
        while max(abs(pose.x - goal.x), abs(pose.y - goal.y)) >= 0.1 or abs(wrapped(pose.theta - goal.theta)) >= 0.01:
            yield Twist(1.0, 0.0) if goes else Twist(0.0, 0.4)
            pose = look()
        yield stop
        while (pose := look()).linear_velocity >= STILL or abs(pose.angular_velocity) >= STILL:
            yield stop
        yield stop


MARGIN = 1.0  # metres to the walls


def wanderer(look: Look, seed: int) -> Iterator[Twist]:
    """Drive to random positions, one after another, at up to 2 m/s; reproducible for each seed."""
    from random import Random

    random = Random(seed)  # noqa: S311 - no secret
    law = FollowController(gain_linear=1.0, max_linear=2.0)
    while True:
        goal = tuple(random.uniform(MARGIN, SIZE - MARGIN) for _ in "xy")
        while math.dist(goal, (pose := look())[:2]) >= 0.5:
            x, y = goal[0] - pose.x, goal[1] - pose.y
            cosine, sine = math.cos(pose.theta), math.sin(pose.theta)
            yield law.command(cosine * x + sine * y, cosine * y - sine * x)


# name -> a function from a seed to the leader
LEADERS: dict[str, Callable[[int], MakeLeader]] = {
    "still": lambda _: scripted(()),
    "circle": lambda _: periodic(BILLION // 2, lambda _: repeat(CIRCLING)),
    "square": lambda _: periodic(TICK_NS, square),
    "figure8": lambda _: periodic(TICK_NS, figure_eight),
    "random": lambda seed: periodic(BILLION // 10, partial(wanderer, seed=seed)),
}


def built_in(name: str, seed: int = 0) -> MakeLeader:
    """Return a built-in leader.

    Raises ValueInvalid for a name that is not in LEADERS.
    """
    if name not in LEADERS:
        raise ValueInvalid(f"no leader {shown(name)}; leaders: {', '.join(LEADERS)}")
    return LEADERS[name](seed)


# escape sequences of arrow keys, in both modes of terminals
ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}


def typed_commands(reads: Iterable[bytes], *, headings: bool) -> Iterator[tuple[int, Twist | Heading]]:
    """Yield (0, command) for each typed key; other keys are ignored.  Raises EndOfRun at a key that ends the run."""
    for key in chain.from_iterable(re.findall(rb"(?s)\x1b[\[O].|.", data) for data in reads):
        if key in b"qQ\x04":
            raise EndOfRun
        heading = HEADINGS.get(key.decode("latin-1").lower()) if headings else None
        command = heading if len(key) == 1 else KEYS.get(ARROWS.get(key[2:], ""))  # an arrow has three bytes
        if command is not None:
            yield 0, command


INSTEAD = "pipe key names into frametool sim follow --leader -"


@contextmanager
def keyboard(*, headings: bool) -> Iterator[MakeLeader]:
    """Read single keys from the terminal for a leader; the terminal is as before afterwards.  Raises Misused."""
    try:
        import termios
        import tty
    except ImportError:
        raise Misused(f"single keys are read on Linux and macOS alone; {INSTEAD}") from None
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        reads = iter(partial(os.read, sys.stdin.fileno(), 64), b"")
        yield arriving(typed_commands(reads, headings=headings))
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
