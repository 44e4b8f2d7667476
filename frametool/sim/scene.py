"""The initial state of a simulation: turtles with their drivers, service calls at times, the duration."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, shown
from frametool.frames.stamps import BILLION, FURTHEST_NS
from frametool.sim.drivers import TARGETS, FollowController, built_in
from frametool.sim.turtle import CENTRE, TICK_NS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.sim.drivers import MakeLeader

    Place = tuple[float, float, float]

TUTORIAL_SPAWN: Place = (4.0, 2.0, 0.0)
LONGEST = FURTHEST_NS // BILLION  # seconds: the range of the buffer's stamps


class Follow(NamedTuple):
    """A driver that follows another turtle through tf.

    target: the leader itself, a carrot 2 m to its left (+y of its frame), or one that circles it at 10 m.
    delay_ns: follow its pose that long ago (the time travel of the tutorial).
    """

    leader: str
    controller: FollowController
    target: str = "leader"
    delay_ns: int = 0


class SceneTurtle(NamedTuple):
    """A turtle of a scene: name, spawn pose (metres, radians), and driver."""

    name: str
    spawn: Place
    driver: MakeLeader | Follow | None = None


class ServiceCall(NamedTuple):
    """A service call at a time; `place` is where it was read, for messages."""

    t_ns: int
    service: str
    arguments: Mapping[str, float | str]
    place: str = ""


class Scene(NamedTuple):
    """The input of a simulation; duration_ns None runs for ever."""

    turtles: Sequence[SceneTurtle]
    calls: Sequence[ServiceCall] = ()
    duration_ns: int | None = 20 * BILLION
    variant: str = "ros1"
    holonomic: bool = False

    @property
    def followers(self) -> dict[str, Follow]:
        """Return the turtles that follow another, by name."""
        return {turtle.name: turtle.driver for turtle in self.turtles if isinstance(turtle.driver, Follow)}

    def late_calls(self) -> list[ServiceCall]:
        """Return the calls at or after the end: a call acts at the first tick after its time."""
        if self.duration_ns is None:
            return []
        last_ns = self.duration_ns // TICK_NS * TICK_NS
        return [call for call in self.calls if call.t_ns >= last_ns]


def tutorial(
    *, leader: MakeLeader | str = "still", law: FollowController | str = "ros1",
    spawn: Place = TUTORIAL_SPAWN, followers: int = 1, target: str = "leader", delay: float = 0.0,
    duration: float | None = 20.0, turtlesim: str = "ros1", holonomic: bool = False, seed: int = 0,
) -> Scene:
    """Return the tutorial's scene: turtle1 in the centre, turtle2 at `spawn` follows it, turtle3 follows turtle2, ...

    leader: a name of LEADERS or the result of `built_in`, `scripted`.  law: "ros1", "ros2" or a controller.
    spawn: x, y (m), theta (rad) of turtle2; each further follower begins 1 m further left, wrapped into the world.
    delay, duration: seconds; duration None runs for ever.
    Raises ValueInvalid.
    """
    if target not in TARGETS:
        raise ValueInvalid(f"no target {shown(target)}; targets: {', '.join(TARGETS)}")
    if followers < 0:
        raise ValueInvalid(f"followers must be 0 or more, found {followers}")
    controller = FollowController(law) if isinstance(law, str) else law
    drive = built_in(leader, seed) if isinstance(leader, str) else leader
    turtles = [SceneTurtle("turtle1", (CENTRE, CENTRE, 0.0), drive)]
    for count in range(followers):
        follow = Follow(turtles[-1].name, controller, target, nanoseconds("delay", delay))
        x, y, theta = spawn
        place = (x - count) % (2.0 * CENTRE) if count else x  # the first at `spawn`, even outside of the world
        turtles.append(SceneTurtle(f"turtle{count + 2}", (place, y, theta), follow))
    return Scene(turtles, (), duration_ns(duration), turtlesim, holonomic)


def duration_ns(seconds: float | None) -> int | None:
    """Return a scene's duration in nanoseconds; None, for ever, for None and infinity.

    Raises ValueInvalid.
    """
    return None if seconds is None or seconds == math.inf else nanoseconds("duration", seconds)


def nanoseconds(name: str, seconds: float) -> int:
    """Return a duration in nanoseconds.

    Raises ValueInvalid with its name if it is negative or longer than stamps allow.
    """
    if not 0.0 <= seconds <= LONGEST:
        raise ValueInvalid(f"{name} must be 0 .. {LONGEST} s, found {seconds:g}")
    return round(seconds * BILLION)
