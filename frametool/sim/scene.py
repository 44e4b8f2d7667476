"""What is on stage: turtles with their drivers, service calls at times, how long it runs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.sim.controllers import FollowController
from frametool.sim.leaders import built_in
from frametool.sim.targets import TARGETS
from frametool.sim.turtle import CENTRE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.sim.leaders import MakeLeader

    Place = tuple[float, float, float]

TUTORIAL_SPAWN: Place = (4.0, 2.0, 0.0)


class Follow(NamedTuple):
    """A driver: follow another turtle through tf.

    target: the leader itself, a carrot 2 m to its left (+y of its frame), or one that circles it at 10 m.
    delay_ns: follow where it was that long ago (the time travel of the tutorial).
    """

    leader: str
    controller: FollowController
    target: str = "leader"
    delay_ns: int = 0


class Actor(NamedTuple):
    """A turtle of the scene: name, where it is spawned (metres, radians), and who drives it."""

    name: str
    spawn: Place
    driver: MakeLeader | Follow | None = None


class Call(NamedTuple):
    """A service call at a time; `place` says in messages where it was read."""

    t_ns: int
    service: str
    arguments: Mapping[str, float | str]
    place: str = ""


class Scene(NamedTuple):
    """All that a simulation needs; duration_ns None runs for ever."""

    actors: Sequence[Actor]
    calls: Sequence[Call] = ()
    duration_ns: int | None = 20 * BILLION
    variant: str = "ros1"
    holonomic: bool = False

    @property
    def followers(self) -> dict[str, Follow]:
        """Return the turtles that follow another, by name."""
        return {actor.name: actor.driver for actor in self.actors if isinstance(actor.driver, Follow)}


def tutorial(
    *, leader: MakeLeader | str = "still", law: FollowController | str = "ros1",
    spawn: Place = TUTORIAL_SPAWN, followers: int = 1, target: str = "leader", delay: float = 0.0,
    duration: float | None = 20.0, turtlesim: str = "ros1", holonomic: bool = False, seed: int = 0,
) -> Scene:
    """Set the tutorial's scene: turtle1 in the centre, turtle2 at `spawn` follows it, turtle3 follows turtle2, ...

    leader: a name of LEADERS or what `built_in`, `scripted` give.  law: "ros1", "ros2" or a controller.
    spawn: x, y (m), theta (rad) of turtle2; each further follower begins 1 m further left, wrapped into the world.
    delay, duration: seconds; duration None runs for ever.
    Raises ValueInvalid.
    """
    if target not in TARGETS:
        raise ValueInvalid(f"no target {target!r}; targets: {', '.join(TARGETS)}")
    if followers < 0 or not delay >= 0.0 or delay == math.inf:
        raise ValueInvalid(f"followers and delay must be 0 or more, found {followers} and {delay}")
    controller = FollowController(law) if isinstance(law, str) else law
    drive = built_in(leader, seed) if isinstance(leader, str) else leader
    actors = [Actor("turtle1", (CENTRE, CENTRE, 0.0), drive)]
    for count in range(followers):
        chase = Follow(actors[-1].name, controller, target, round(delay * BILLION))
        actors.append(Actor(f"turtle{count + 2}", _beside(spawn, count), chase))
    duration_ns = None if duration is None or duration == math.inf else round(duration * BILLION)
    return Scene(actors, (), duration_ns, turtlesim, holonomic)


def _beside(spawn: Place, count: int) -> Place:
    """Return the place of one of several followers; the first stands at `spawn` itself, wherever that is."""
    x, y, theta = spawn
    return (x, y, theta) if not count else ((x - count) % (2.0 * CENTRE), y, theta)
