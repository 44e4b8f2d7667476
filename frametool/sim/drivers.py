"""Drivers of turtles: leaders, which move independently, and the follower's control law with its targets.

A leader yields the time at which it is to be resumed, in nanoseconds, and then its command, if there is one; `look`
returns the pose of its turtle. The law maps the position of the target, relative to the turtle, to a velocity command.
"""

from __future__ import annotations

import math
import os
import re
import sys
from collections import deque
from contextlib import contextmanager
from functools import partial
from itertools import chain, count, cycle
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import Misused, ValueInvalid, shown
from frametool.frames.stamps import BILLION
from frametool.geometry.transform import Transform
from frametool.sim.turtle import PI, SIZE, TICK_NS, TurtlePose, Twist, wrapped

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator

    TimedTwist = tuple[int, Twist]
    Look = Callable[[], TurtlePose]
    Leader = Iterator[int | Twist | "Heading"]
    MakeLeader = Callable[[Look], Leader]
    Drive = Generator[Twist, TurtlePose, None]
    Driver = Callable[[], Drive]

# law -> rate in Hz, linear gain in 1/s, angular gain in 1/s: turtle_tf2_listener of each ROS
LAWS = {"ros1": (10.0, 0.5, 4.0), "ros2": (1.0, 0.5, 1.0)}
SLOWEST, FASTEST = 1e-6, 1e6  # Hz; two steps must not fall on one nanosecond
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
        self.rate = _checked("rate", own_rate if rate is None else rate, SLOWEST, FASTEST)
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
        linear = self.gain_linear * distance
        angular = self.gain_angular * math.atan2(y, x)
        try:
            return Twist(
                max(-self.max_linear, min(self.max_linear, linear)),
                max(-self.max_angular, min(self.max_angular, angular)),
            )
        except ValueInvalid:
            gains = f"gain_linear {self.gain_linear:g}, gain_angular {self.gain_angular:g}"
            raise ValueInvalid(f"{gains} give no finite velocity at {distance:g} m") from None

    def due_ns(self, number: int) -> int:
        """Return the time of the n-th control step, from 0; rounded once, so that no rate drifts."""
        return round(number * BILLION / self.rate)


def _checked(name: str, value: float, least: float = -math.inf, most: float = math.inf) -> float:
    """Return a number if it is finite and within its bounds."""
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
    """Return the frame that is looked up: the turtle, or its carrot (turtle1's is carrot1)."""
    if target == "leader":
        return turtle
    return f"carrot{turtle[6:]}" if turtle[:6] == "turtle" and turtle[6:].isdigit() else f"{turtle}_carrot"


def offset(target: str, now_ns: int) -> tuple[float, float]:
    """Return the position of a target in its leader's frame, in metres."""
    if target == "leader":
        return 0.0, 0.0
    if target == "carrot":
        return 0.0, CARROT_ASIDE
    angle = now_ns / BILLION * math.pi
    return CARROT_CIRCLE * math.sin(angle), CARROT_CIRCLE * math.cos(angle)


def planar(x: float, y: float, theta: float) -> Transform:
    """Return a pose in the plane as a transform."""
    return Transform.of(x, y, 0.0, 0.0, 0.0, math.sin(theta / 2.0), math.cos(theta / 2.0))


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


class Mailbox:
    """A leader for commands that arrive during the simulation; read at every tick, the last one wins.

    An error while it is filled is raised when the next command is read.
    """

    def __init__(self) -> None:
        """Create an empty one."""
        self._posted: deque[tuple[int, Twist | Heading]] = deque()
        self._failure: BaseException | None = None

    def post(self, command: Twist | Heading, t_ns: int = 0) -> None:
        """Add a command; it acts now, or at a later time."""
        self._posted.append((t_ns, command))

    def fill_from(self, commands: Iterable[tuple[int, Twist | Heading]]) -> None:
        """Post commands from a separate thread, as they arrive."""
        from threading import Thread

        def fill() -> None:
            try:
                for t_ns, twist in commands:
                    self.post(twist, t_ns)
            except Exception as error:  # noqa: BLE001 - raised again where it is seen
                self._failure = error

        Thread(target=fill, daemon=True).start()

    def __call__(self, look: Look) -> Leader:  # noqa: ARG002 - whoever posts does the looking
        """Yield the newest command whose time has come, at each tick.

        Raises what ended the commands, EndOfRun if somebody did.
        """
        for now_ns in count(0, TICK_NS):
            yield now_ns
            newest = None
            while self._posted and self._posted[0][0] <= now_ns:
                newest = self._posted.popleft()[1]
            if newest is not None:
                yield newest
            elif self._failure is not None:
                raise self._failure


def scripted(commands: Iterable[TimedTwist]) -> MakeLeader:
    """Return a leader of (nanoseconds, Twist) pairs, read one ahead; lists can be run again.

    Between them turtlesim keeps the last one for a second.
    Raises ValueInvalid, when it runs, for a time that is before the previous one.
    """

    def leader(_: Look) -> Leader:
        last_ns = 0
        for due_ns, twist in commands:
            if due_ns < last_ns:
                raise ValueInvalid(f"a command at {due_ns} ns comes after one at {last_ns} ns; sort them by time")
            yield due_ns
            yield twist
            last_ns = due_ns

    return leader


def periodic(period_ns: int, drive: Driver) -> MakeLeader:
    """Return a leader with a command at a fixed period, the first at time 0.

    drive: a generator of commands that is sent the current pose for each
    """

    def leader(look: Look) -> Leader:
        driver = drive()
        next(driver)
        for now_ns in count(0, period_ns):
            yield now_ns
            yield driver.send(look())

    return leader


def circle() -> Drive:
    """Drive circles to the left."""
    while True:
        yield CIRCLING


def figure_eight() -> Drive:
    """Drive circles to the left and to the right in turn, a command each tick."""
    yield CIRCLING
    for now_ns in count(0, TICK_NS):
        turns = int(now_ns / BILLION * CIRCLING.angular_z / (2.0 * math.pi))
        yield Twist(CIRCLING.linear_x, -CIRCLING.angular_z if turns % 2 else CIRCLING.angular_z)


def square() -> Drive:
    """Drive 2 m sides at 1 m/s, quarter turns at 0.4 rad/s, and a full stop after each, as turtlesim's draw_square.

    Source: turtlesim's tutorials/draw_square.cpp.
    """
    stop = Twist(0.0, 0.0)
    pose = yield stop
    goal = _ahead(pose)
    for goes in cycle((True, False)):
        while not (
            max(abs(pose.x - goal.x), abs(pose.y - goal.y)) < 0.1 and abs(wrapped(pose.theta - goal.theta)) < 0.01
        ):
            pose = yield Twist(1.0, 0.0) if goes else Twist(0.0, 0.4)
        pose = yield stop
        while pose.linear_velocity >= STILL or abs(pose.angular_velocity) >= STILL:
            pose = yield stop
        goal = pose._replace(theta=wrapped(pose.theta + PI / 2.0)) if goes else _ahead(pose)
        pose = yield stop


MARGIN = 1.0  # metres to the walls


def wanderer(seed: int = 0) -> Drive:
    """Drive to random positions, one after another, at up to 2 m/s; reproducible for each seed."""
    from random import Random

    random = Random(seed)  # noqa: S311 - no secret
    law = FollowController(gain_linear=1.0, max_linear=2.0)
    pose = yield CIRCLING
    while True:
        goal = tuple(random.uniform(MARGIN, SIZE - MARGIN) for _ in "xy")
        while math.dist(goal, pose[:2]) >= 0.5:
            x, y = goal[0] - pose.x, goal[1] - pose.y
            cosine, sine = math.cos(pose.theta), math.sin(pose.theta)
            pose = yield law.command(cosine * x + sine * y, cosine * y - sine * x)


# name -> a function from a seed to the leader
LEADERS: dict[str, Callable[[int], MakeLeader]] = {
    "still": lambda _: scripted(()),
    "circle": lambda _: periodic(BILLION // 2, circle),
    "square": lambda _: periodic(TICK_NS, square),
    "figure8": lambda _: periodic(TICK_NS, figure_eight),
    "random": lambda seed: periodic(BILLION // 10, lambda: wanderer(seed)),
}


def built_in(name: str, seed: int = 0) -> MakeLeader:
    """Return a built-in leader.

    Raises ValueInvalid for a name that is not in LEADERS.
    """
    if name not in LEADERS:
        raise ValueInvalid(f"no leader {shown(name)}; leaders: {', '.join(LEADERS)}")
    return LEADERS[name](seed)


def _ahead(pose: TurtlePose) -> TurtlePose:
    """Return the position 2 m ahead."""
    return pose._replace(x=math.cos(pose.theta) * 2.0 + pose.x, y=math.sin(pose.theta) * 2.0 + pose.y)


# escape sequences of arrow keys, in both modes of terminals
ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}


def typed_commands(reads: Iterable[bytes], *, headings: bool) -> Iterator[tuple[int, Twist | Heading]]:
    """Yield the commands of what is typed, other keys without any; raise EndOfRun at the key that ends it."""
    for key in chain.from_iterable(re.findall(rb"(?s)\x1b[\[O].|.", data) for data in reads):
        if key in b"qQ\x04":
            raise EndOfRun
        heading = HEADINGS.get(key.decode("latin-1").lower()) if headings else None
        command = heading if len(key) == 1 else KEYS.get(ARROWS.get(key[2:], ""))  # an arrow has three bytes
        if command is not None:
            yield 0, command


INSTEAD = "pipe key names into frametool sim follow --leader -"


@contextmanager
def keyboard(mailbox: Mailbox, *, headings: bool) -> Iterator[None]:
    """Read single keys from the terminal into a mailbox; the terminal is as before afterwards.  Raises Misused."""
    try:
        import termios
        import tty
    except ImportError:
        raise Misused(f"single keys are read on Linux and macOS alone; {INSTEAD}") from None
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        mailbox.fill_from(typed_commands(iter(partial(os.read, sys.stdin.fileno(), 64), b""), headings=headings))
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
