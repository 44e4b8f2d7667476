"""Scenes of turtles: the input of a simulation, in Python or in a YAML or JSON file: spawn poses, drivers, events.

    duration: 20                                                  # seconds, or inf; also turtlesim: ros2, seed: 1
    turtles: {turtle1: {leader: square},                          # still, circle, square, figure8, random, or a file
              turtle2: {spawn: [4, 2, 0], follow: turtle1}}       # metres, radians (or 90deg); law: ros1, gains, ..
    events: [{t: 5, teleport_absolute: {turtle: turtle1, x: 2, y: 2, theta: 0}}]

Leader files are relative to the scene.
"""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import format_error, parse_documents
from frametool.documents.source import Source, read_text
from frametool.errors import ValueInvalid, alternatives, shown
from frametool.frames.stamps import BILLION
from frametool.grammar.readers import Misfit, as_mapping, kind, read_number, within
from frametool.sim import readers
from frametool.sim.drivers import LAWS, LEADERS, TARGETS, FollowController, built_in, scripted
from frametool.sim.readers import known_keys, nanoseconds
from frametool.sim.turtle import CENTRE, SERVICES, TICK_NS, VARIANTS, complete

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from frametool.sim.drivers import MakeLeader
    from frametool.sim.readers import Place

TUTORIAL_SPAWN: Place = (4.0, 2.0, 0.0)


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


SCENE_KEYS = ("turtles", "events", "duration", "turtlesim", "holonomic", "seed")
CONTROLLER_KEYS = ("rate", "gain_linear", "gain_angular", "max_linear", "max_angular")
FOLLOW_KEYS = ("follow", "law", *CONTROLLER_KEYS, "target", "delay")
TURTLE_KEYS = ("spawn", "leader", *FOLLOW_KEYS)


def _name(value: Any) -> str:
    if type(value) is not str or not value:
        raise Misfit(f"expected a turtle's name, found {kind(value or None)}")
    return value


# key, also of a service's argument -> its reader; others are numbers
READERS: dict[str, Callable[[Any], Any]] = {
    "duration": readers.read_duration,
    "turtlesim": readers.one_of(VARIANTS),
    "holonomic": readers.read_flag,
    "seed": readers.read_seed,
    "spawn": readers.read_place,
    "follow": _name,
    "law": readers.one_of(LAWS),
    "target": readers.one_of(TARGETS),
    "delay": readers.read_time,
    "t": readers.read_time,
    "turtle": _name,
    "name": _name,
    "theta": readers.read_angle,
    "angular": readers.read_angle,
    "off": readers.read_flag,
    **dict.fromkeys(("r", "g", "b", "width"), readers.read_byte),
}


def _field(mapping: Mapping[str, Any], key: str, default: Any = None) -> Any:
    """Read the value of a key, or its default."""
    return within((key,), READERS.get(key, read_number), mapping.get(key, default))


def read_scene(source: Source, *, seed: int | None = None) -> Scene:
    """Read the only scene of a text; files that it names are relative to it.

    seed: overrides the scene's own.
    Raises FormatError with file, line and column.
    """
    documents = parse_documents(source.text, source.name)
    if len(documents) != 1:
        raise format_error(source, (0,), f"expected one scene, found {len(documents)} documents")
    try:
        return _scene(documents[0].value, source, seed)
    except Misfit as misfit:
        raise misfit.placed(source, documents[0].index) from None


def _scene(value: Any, source: Source, seed: int | None) -> Scene:
    scene = known_keys(value, SCENE_KEYS, "a scene {turtles: .., events: .., duration: ..}")
    if "turtles" not in scene:
        raise Misfit(f"no turtles; expected {', '.join(SCENE_KEYS)}")
    own = _field(scene, "seed", "0")
    variant, holonomic = _field(scene, "turtlesim", "ros1"), bool(_field(scene, "holonomic", "false"))
    calls = within(("events",), _calls, scene.get("events") or [], source)
    entries = within(("turtles",), as_mapping, scene["turtles"], "the turtles by name")
    turtles = [
        within(("turtles", name), _turtle, name, entry or {}, source, own if seed is None else seed)
        for name, entry in entries.items()
    ]
    return Scene(turtles, calls, _field(scene, "duration", "20"), variant, holonomic)


def _turtle(name: str, value: Any, source: Source, seed: int) -> SceneTurtle:
    entry = known_keys(value, TURTLE_KEYS, "a turtle {spawn: [x, y, theta], leader: .. or follow: ..}")
    if name in ("", "world"):
        raise Misfit(f"a turtle cannot be called {shown(name)}", key=True)
    spawn = _field(entry, "spawn", [repr(CENTRE), repr(CENTRE), "0"])
    if "follow" in entry and "leader" in entry:
        raise Misfit("a turtle has a leader script or follows another, not both", ("leader",), key=True)
    if "follow" in entry:
        return SceneTurtle(name, spawn, _follow(name, entry))
    if stray := [key for key in entry if key in FOLLOW_KEYS]:
        raise Misfit(f"{stray[0]} says how to follow; add follow: NAME", (stray[0],), key=True)
    leader = within(("leader",), _leader, entry["leader"], source, seed) if "leader" in entry else None
    return SceneTurtle(name, spawn, leader)


def _leader(value: Any, source: Source, seed: int) -> MakeLeader:
    """Read a leader: a built-in name, a file relative to the scene, or the commands themselves."""
    if type(value) is list:
        return scripted(list(readers.timed_commands(value)))
    if type(value) is not str:
        raise Misfit(f"expected a leader's name, a file or a list of commands, found {kind(value)}")
    if value in LEADERS:
        return built_in(value, seed)
    path = os.path.join(os.path.dirname(source.name), value)
    if not os.path.exists(path):
        raise Misfit(f"no file {path} and no leader {shown(value)}{alternatives(value, LEADERS, 'leaders')}")
    return scripted(readers.read_script(Source(path, read_text(path))))


def _follow(name: str, entry: Mapping[str, Any]) -> Follow:
    """Read the follower settings of a turtle."""
    leader = _field(entry, "follow")
    if leader == name:
        raise Misfit(f"{name} cannot follow itself", ("follow",))
    law = _field(entry, "law", "ros1")
    numbers = {key: _field(entry, key) for key in CONTROLLER_KEYS if key in entry}
    for key, number in numbers.items():
        within((key,), FollowController, law, **{key: number})
    target, delay_ns = _field(entry, "target", "leader"), _field(entry, "delay", "0")
    return Follow(leader, FollowController(law, **numbers), target, delay_ns)


def _calls(value: Any, source: Source) -> list[ServiceCall]:
    if type(value) is not list:
        raise Misfit(f"expected a list of {{t: .., SERVICE: {{..}}}}, found {kind(value)}")
    calls = [within((index,), _call, entry) for index, entry in enumerate(value)]
    return [call._replace(place=f"{source.name}, event {number}") for number, call in enumerate(calls, 1)]


def _call(value: Any) -> ServiceCall:
    """Read {t: .., SERVICE: {..}}; kill also takes only the name."""
    entry = known_keys(value, ("t", *SERVICES), "an event {t: .., SERVICE: {..}}")
    named = [key for key in entry if key != "t"]
    if "t" not in entry or len(named) != 1:
        raise Misfit(f"an event has t and one of {', '.join(SERVICES)}")
    service = named[0]
    arguments = entry[service]
    if service == "kill" and type(arguments) is str:
        arguments = {"name": arguments}
    read = within((service,), _arguments, service, arguments or {})
    return ServiceCall(_field(entry, "t"), service, read)


def _arguments(service: str, value: Any) -> dict[str, float | str]:
    """Read a service's arguments and check that none is missing."""
    arguments = {key: _field(value, key) for key in known_keys(value, SERVICES[service], f"the arguments of {service}")}
    complete(service, arguments)
    return arguments
