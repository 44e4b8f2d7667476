"""Leaders, which drive a turtle without following another: scripts of timed commands, and those that are built in.

A leader is asked at `due_ns` with the pose of its turtle, returns a command or None, and sets the next `due_ns` (None:
no more).
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple, Protocol

from frametool.errors import ValueInvalid, shown
from frametool.frames.stamps import BILLION
from frametool.sim.controllers import FollowController
from frametool.sim.turtle import PI, SIZE, TICK_NS, TurtlePose, Twist, wrapped

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    MakeLeader = Callable[[], "Leader"]
    TimedTwist = tuple[int, Twist]

STILL = 1e-4  # m/s and rad/s: draw_square's own threshold of standing
CIRCLING = Twist(2.0, 1.8)  # the command of the turtlesim tutorial
KEYS = {"up": Twist(2.0, 0.0), "down": Twist(-2.0, 0.0), "left": Twist(0.0, 2.0), "right": Twist(0.0, -2.0)}


class EndOfRun(Exception):
    """Raised by a leader to end the simulation."""


class Heading(NamedTuple):
    """A command to turn to a heading (radians), as the ROS 2 teleop sends to rotate_absolute; None gives that up."""

    theta: float | None


# the keys around F of the ROS 2 teleop
HEADINGS = {
    **{key: Heading(math.radians(45.0 * count)) for count, key in enumerate("gtredcvb")},
    "f": Heading(None),
}  # fmt: skip


class Leader(Protocol):
    """Whatever drives a turtle without following another."""

    due_ns: int | None

    def command(self, pose: TurtlePose) -> Twist | Heading | None:
        """Return the command that is due, if any, and set when the next one is."""


class Script:
    """Commands at given times (nanoseconds), read one ahead; between them turtlesim keeps the last for a second."""

    def __init__(self, commands: Iterable[TimedTwist]) -> None:
        """Take the commands in the order of their times.

        Raises:
            ValueInvalid: now or later, when a time lies before the one in front of it.
        """
        self._commands = iter(commands)
        self._next: Twist | None = None
        self.due_ns: int | None = 0
        self._advance()

    def command(self, pose: TurtlePose) -> Twist | None:  # noqa: ARG002 - a script does not look
        """Return the command that is due."""
        twist = self._next
        self._advance()
        return twist

    def _advance(self) -> None:
        due_ns, self._next = next(self._commands, (None, None))
        if due_ns is not None and self.due_ns is not None and due_ns < self.due_ns:
            raise ValueInvalid(f"a command at {due_ns} ns comes after one at {self.due_ns} ns; sort them by time")
        self.due_ns = due_ns


class Mailbox:
    """A leader for commands that come in while the turtles already walk; looked into at every tick, the last one wins.

    What fails while it is filled is raised where the next command is asked for.
    """

    def __init__(self) -> None:
        """Create an empty one."""
        self.due_ns: int | None = 0
        self._posted: deque[tuple[int, Twist | Heading]] = deque()
        self._failure: BaseException | None = None

    def post(self, command: Twist | Heading, t_ns: int = 0) -> None:
        """Put a command in; it acts now, or at a later time."""
        self._posted.append((t_ns, command))

    def close(self) -> None:
        """End the simulation."""
        self._failure = EndOfRun()

    def fill_from(self, commands: Iterable[TimedTwist]) -> None:
        """Post commands from a thread of their own, as they come."""
        from threading import Thread

        Thread(target=self._fill, args=(commands,), daemon=True).start()

    def _fill(self, commands: Iterable[TimedTwist]) -> None:
        try:
            for t_ns, twist in commands:
                self.post(twist, t_ns)
        except Exception as error:  # noqa: BLE001 - raised again where it is seen
            self._failure = error

    def command(self, pose: TurtlePose) -> Twist | Heading | None:  # noqa: ARG002 - whoever posts does the looking
        """Return the newest command whose time has come.

        Raises EndOfRun when it was closed.
        """
        now_ns = self.due_ns or 0
        self.due_ns = now_ns + TICK_NS
        newest = None
        while self._posted and self._posted[0][0] <= now_ns:
            newest = self._posted.popleft()[1]
        if newest is None and self._failure is not None:
            raise self._failure
        return newest


class Periodic:
    """A leader that is asked at a fixed period: drive(nanoseconds, pose) returns the command."""

    def __init__(self, period_ns: int, drive: Callable[[int, TurtlePose], Twist]) -> None:
        """Keep what drives; the first command is due at time 0."""
        self.due_ns: int | None = 0
        self._period_ns = period_ns
        self._drive = drive

    def command(self, pose: TurtlePose) -> Twist:
        """Return this moment's command."""
        now_ns = self.due_ns or 0
        self.due_ns = now_ns + self._period_ns
        return self._drive(now_ns, pose)


def circle(now_ns: int, pose: TurtlePose) -> Twist:  # noqa: ARG001 - looks at nothing
    """Go round to the left with a radius of 1.11 m."""
    return CIRCLING


def figure_eight(now_ns: int, pose: TurtlePose) -> Twist:  # noqa: ARG001
    """Go round to the left, then to the right, and so on."""
    turns = int(now_ns / BILLION * CIRCLING.angular_z / (2.0 * math.pi))
    return Twist(CIRCLING.linear_x, -CIRCLING.angular_z if turns % 2 else CIRCLING.angular_z)


class Square:
    """turtlesim's draw_square: 2 m sides at 1 m/s, quarter turns at 0.4 rad/s, a full stop after each.

    Source: turtlesim's tutorials/draw_square.cpp.
    """

    def __init__(self) -> None:
        """Create the driver in front of the first side."""
        self._moves = True
        self._stopping = True
        self._goal: TurtlePose | None = None

    def drive(self, now_ns: int, pose: TurtlePose) -> Twist:  # noqa: ARG002
        """Go or turn until the goal is reached, then stop, then take the next goal."""
        if self._goal is None:
            self._goal, self._stopping = _ahead(pose), False
        elif self._stopping and pose.linear_velocity < STILL and abs(pose.angular_velocity) < STILL:
            self._moves, self._stopping = not self._moves, False
            self._goal = _ahead(pose) if self._moves else pose._replace(theta=wrapped(pose.theta + PI / 2.0))
            return Twist(0.0, 0.0)
        if self._stopping or _reached(pose, self._goal):
            self._stopping = True
            return Twist(0.0, 0.0)
        return Twist(1.0, 0.0) if self._moves else Twist(0.0, 0.4)


class Wanderer:
    """Drive to places drawn at random, one after another, at up to 2 m/s; the same seed gives the same way."""

    margin = 1.0  # metres to the walls

    def __init__(self, seed: int = 0) -> None:
        """Draw the first place."""
        from random import Random

        self._random = Random(seed)  # noqa: S311 - no secret
        self._law = FollowController(gain_linear=1.0, max_linear=2.0)
        self._goal = self._draw()

    def drive(self, now_ns: int, pose: TurtlePose) -> Twist:  # noqa: ARG002
        """Follow the place; near it, take another."""
        if math.dist(self._goal, pose[:2]) < 0.5:
            self._goal = self._draw()
        x, y = self._goal[0] - pose.x, self._goal[1] - pose.y
        cosine, sine = math.cos(pose.theta), math.sin(pose.theta)
        return self._law.command(cosine * x + sine * y, cosine * y - sine * x)

    def _draw(self) -> tuple[float, float]:
        low, high = self.margin, SIZE - self.margin
        return self._random.uniform(low, high), self._random.uniform(low, high)


# name -> what makes the leader of a seed
LEADERS: dict[str, Callable[[int], Leader]] = {
    "still": lambda _: Script(()),
    "circle": lambda _: Periodic(BILLION // 2, circle),
    "square": lambda _: Periodic(TICK_NS, Square().drive),
    "figure8": lambda _: Periodic(TICK_NS, figure_eight),
    "random": lambda seed: Periodic(BILLION // 10, Wanderer(seed).drive),
}


def built_in(name: str, seed: int = 0) -> MakeLeader:
    """Return what makes a built-in leader anew for each run.

    Raises ValueInvalid for a name that is not in LEADERS.
    """
    if name not in LEADERS:
        raise ValueInvalid(f"no leader {shown(name)}; leaders: {', '.join(LEADERS)}")
    return lambda: LEADERS[name](seed)


def scripted(commands: Iterable[TimedTwist]) -> MakeLeader:
    """Return what makes a leader of (nanoseconds, Twist) pairs; a list can be run again, an iterator once."""
    return lambda: Script(commands)


def _ahead(pose: TurtlePose) -> TurtlePose:
    """Return the place 2 m ahead."""
    return pose._replace(x=math.cos(pose.theta) * 2.0 + pose.x, y=math.sin(pose.theta) * 2.0 + pose.y)


def _reached(pose: TurtlePose, goal: TurtlePose) -> bool:
    near = abs(pose.x - goal.x) < 0.1 and abs(pose.y - goal.y) < 0.1
    return near and abs(wrapped(pose.theta - goal.theta)) < 0.01
