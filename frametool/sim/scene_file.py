"""Scenes of turtles in YAML or JSON: who is where, who drives whom, what happens when.

    duration: 20                                                  # seconds, or inf; also turtlesim: ros2, seed: 1
    turtles: {turtle1: {leader: square},                          # still, circle, square, figure8, random, or a file
              turtle2: {spawn: [4, 2, 0], follow: turtle1}}       # metres, radians (or 90deg); law: ros1, gains, ..
    events: [{t: 5, teleport_absolute: {turtle: turtle1, x: 2, y: 2, theta: 0}}]

Leader files are looked for beside the scene.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from frametool.documents.document import format_error, parse_documents
from frametool.documents.source import Source, read_text
from frametool.errors import ValueInvalid, alternatives
from frametool.frames.stamps import parse_stamp
from frametool.grammar.readers import Misfit, as_mapping, kind, within
from frametool.sim.command_file import read_entries, read_script
from frametool.sim.controllers import LAWS, FollowController
from frametool.sim.leaders import LEADERS, built_in, scripted
from frametool.sim.scene import Actor, Call, Follow, Scene
from frametool.sim.targets import TARGETS
from frametool.sim.turtle import CENTRE
from frametool.sim.world import SERVICES, VARIANTS, complete
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from frametool.sim.leaders import MakeLeader
    from frametool.sim.scene import Place

SCENE_KEYS = ("turtles", "events", "duration", "turtlesim", "holonomic", "seed")
CONTROLLER_KEYS = ("rate", "gain_linear", "gain_angular", "max_linear", "max_angular")
FOLLOW_KEYS = ("follow", "law", *CONTROLLER_KEYS, "target", "delay")
TURTLE_KEYS = ("spawn", "leader", *FOLLOW_KEYS)
DURATION_S = "20"
RADIANS = 3.141592653589793 / 180.0


def read_scene(source: Source, *, seed: int | None = None) -> Scene:
    """Read the one scene of a text; files that it names are looked for beside it.

    seed: instead of the scene's own.
    Raises FormatError with file, line and column.
    """
    documents = parse_documents(source.text, source.name)
    if len(documents) != 1:
        raise format_error(source, (0,), f"expected one scene, found {len(documents)} documents")
    try:
        return _Reader(source, seed).scene(documents[0].value)
    except Misfit as misfit:
        raise format_error(source, (documents[0].index, *misfit.path), str(misfit), key=misfit.key) from None


class _Reader:
    """What holds while one scene is read: its source, its seed."""

    def __init__(self, source: Source, seed: int | None) -> None:
        self.source = source
        self.seed = seed
        self.names: list[str] = []  # of all turtles that are or will be there
        self.nameless = False  # whether turtles come that the world will name

    def scene(self, value: Any) -> Scene:
        """Read a scene."""
        scene = _known(value, SCENE_KEYS, "a scene {turtles: .., events: .., duration: ..}")
        if "turtles" not in scene:
            raise Misfit(f"no turtles; expected {', '.join(SCENE_KEYS)}")
        own = int(_field(scene, "seed", _whole, "0"))
        self.seed = own if self.seed is None else self.seed
        variant = _field(scene, "turtlesim", _one_of(VARIANTS), "ros1")
        calls = within(("events",), self._calls, scene.get("events") or [])
        spawned = [str(call.arguments.get("name", "")) for call in calls if call.service == "spawn"]
        self.names = list(filter(None, spawned))
        self.nameless = "" in spawned or any(call.service == "reset" for call in calls)
        actors = within(("turtles",), self._actors, scene["turtles"])
        duration_ns = _field(scene, "duration", _duration, DURATION_S)
        return Scene(actors, calls, duration_ns, variant, _field(scene, "holonomic", _truth, "false"))

    def _actors(self, value: Any) -> list[Actor]:
        """Read the turtles: a mapping by name, or a list of entries with a name."""
        if type(value) is list:
            return list(self._listed(value))
        turtles = as_mapping(value, "the turtles by name, or a list of {name: .., spawn: .., ..}")
        self.names += turtles
        return [within((name,), self._actor, name, entry or {}) for name, entry in turtles.items()]

    def _listed(self, entries: list[Any]) -> Iterator[Actor]:
        names = [within((index,), _name_of, entry) for index, entry in enumerate(entries)]
        self.names += names
        for index, (name, entry) in enumerate(zip(names, entries, strict=True)):
            if name in names[:index]:
                raise Misfit(f"A turtle named [{name}] already exists", (index, "name"))
            rest = {key: each for key, each in entry.items() if key != "name"}
            yield within((index,), self._actor, name, rest)

    def _actor(self, name: str, value: Any) -> Actor:
        entry = _known(value, TURTLE_KEYS, "a turtle {spawn: [x, y, theta], leader: .. or follow: ..}")
        if name == "world" or not name:
            raise Misfit(f"a turtle cannot be called {name!r}", key=True)
        spawn = _field(entry, "spawn", _place, [repr(CENTRE), repr(CENTRE), "0"])
        if "follow" in entry and "leader" in entry:
            raise Misfit("a turtle has a leader script or follows another, not both", ("leader",), key=True)
        if "follow" in entry:
            within(("follow",), self._check_leader, name, entry["follow"])
            return Actor(name, spawn, _follow(entry))
        if stray := [key for key in entry if key in FOLLOW_KEYS]:
            raise Misfit(f"{stray[0]} says how to follow; add follow: NAME", (stray[0],), key=True)
        return Actor(name, spawn, within(("leader",), self._leader, entry["leader"]) if "leader" in entry else None)

    def _check_leader(self, name: str, value: Any) -> None:
        """Refuse to follow oneself, or who never comes."""
        leader = _name(value)
        if leader == name:
            raise Misfit(f"{name} cannot follow itself")
        if leader not in self.names and not (self.nameless and leader.startswith("turtle")):
            raise Misfit(f"no turtle {leader!r} to follow{alternatives(leader, self.names, 'turtles')}")

    def _leader(self, value: Any) -> MakeLeader:
        """Read a leader: a built-in name, a file beside the scene, or the commands themselves."""
        if type(value) is list:
            return scripted(read_entries(value))
        if type(value) is not str:
            raise Misfit(f"expected a leader's name, a file or a list of commands, found {kind(value)}")
        if value in LEADERS:
            return built_in(value, self.seed or 0)
        path = os.path.join(os.path.dirname(self.source.name), value)
        if not os.path.exists(path):
            raise Misfit(f"no file {path} and no leader {value!r}{alternatives(value, LEADERS, 'leaders')}")
        return scripted(read_script(Source(path, read_text(path))))

    def _calls(self, value: Any) -> list[Call]:
        if type(value) is not list:
            raise Misfit(f"expected a list of {{t: .., SERVICE: {{..}}}}, found {kind(value)}")
        calls = [within((index,), _call, entry) for index, entry in enumerate(value)]
        return [call._replace(place=f"{self.source.name}, event {number}") for number, call in enumerate(calls, 1)]


def _follow(entry: Mapping[str, Any]) -> Follow:
    """Read whom a turtle follows, and how."""
    law = _field(entry, "law", _one_of(LAWS), "ros1")
    numbers = {key: within((key,), _gain, law, key, entry[key]) for key in CONTROLLER_KEYS if key in entry}
    target = _field(entry, "target", _one_of(TARGETS), "leader")
    return Follow(_name(entry["follow"]), FollowController(law, **numbers), target, _field(entry, "delay", _stamp, "0"))


def _gain(law: str, key: str, value: Any) -> float:
    """Read one number of a controller, and let the controller judge it."""
    number: float = _number(value)
    try:
        FollowController(law, **{key: number})
    except ValueInvalid as error:
        raise Misfit(str(error)) from None
    return number


def _call(value: Any) -> Call:
    """Read {t: .., SERVICE: {..}}; kill also takes the bare name."""
    entry = _known(value, ("t", *SERVICES), "an event {t: .., SERVICE: {..}}")
    named = [key for key in entry if key != "t"]
    if "t" not in entry or len(named) != 1:
        raise Misfit(f"an event has t and one of {', '.join(SERVICES)}")
    service = named[0]
    given = entry[service]
    if service == "kill" and type(given) is str:
        given = {"name": given}
    arguments = within((service,), _arguments, service, given or {})
    return Call(within(("t",), _stamp, entry["t"]), service, arguments)


def _arguments(service: str, value: Any) -> dict[str, float | str]:
    """Read a service's arguments and check that none is missing."""
    given = _known(value, SERVICES[service], f"the arguments of {service}")
    arguments = {key: within((key,), ARGUMENTS.get(key, _number), each) for key, each in given.items()}
    try:
        complete(service, arguments)
    except ValueInvalid as error:
        raise Misfit(str(error)) from None
    return arguments


def _known(value: Any, keys: Collection[str], what: str) -> dict[str, Any]:
    """Take a value for a mapping with some of these keys."""
    mapping = as_mapping(value, what)
    if unknown := [key for key in mapping if key not in keys]:
        raise Misfit(f"unknown key {unknown[0]!r}{alternatives(unknown[0], keys, 'keys')}", (unknown[0],), key=True)
    return mapping


def _field(mapping: Mapping[str, Any], key: str, read: Callable[[Any], Any], default: Any) -> Any:
    """Read the value of a key, or its default."""
    return within((key,), read, mapping.get(key, default))


def _name(value: Any) -> str:
    if type(value) is not str or not value:
        raise Misfit(f"expected a turtle's name, found {kind(value or None)}")
    return value


def _name_of(entry: Any) -> str:
    """Return the name of an entry in a list of turtles."""
    if "name" not in as_mapping(entry, "a turtle {name: .., spawn: .., ..}"):
        raise Misfit("missing name; a turtle is {name: .., spawn: [x, y, theta], ..}")
    return str(within(("name",), _name, entry["name"]))


def _one_of(names: Collection[str]) -> Callable[[Any], str]:
    """Return the reader of one of several words."""

    def read(value: Any) -> str:
        if type(value) is not str:
            raise Misfit(f"expected one of {', '.join(names)}, found {kind(value)}")
        if value not in names:
            raise Misfit(f"unknown {value!r}{alternatives(value, names, 'choices')}")
        return value

    return read


def _guarded(parse: Callable[[str], Any], what: str) -> Callable[[Any], Any]:
    """Make a parser of text a reader of values, whose complaints can be placed."""

    def read(value: Any) -> Any:
        if type(value) is not str:
            raise Misfit(f"expected {what}, found {kind(value)}")
        try:
            return parse(value)
        except ValueInvalid as error:
            raise Misfit(str(error)) from None

    return read


def _radians(text: str) -> float:
    value, unit = parse_angle(text)
    return value * RADIANS if unit == "deg" else value


def _not_negative(text: str) -> int:
    stamp_ns = parse_stamp(text)
    if stamp_ns < 0:
        raise ValueInvalid(f"{text} s is before the start, which is 0")
    return stamp_ns


def _endless(text: str) -> int | None:
    return None if text in ("inf", ".inf") else _not_negative(text)


def _boolean(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueInvalid(f"expected true or false, found {text!r}")
    return text == "true"


def _integer(text: str) -> int:
    if not text.isdecimal():
        raise ValueInvalid(f"expected a whole number, found {text!r}")
    return int(text)


def _pen_byte(text: str) -> float:
    value = parse_number(text)
    if not (0.0 <= value <= 255.0 and value.is_integer()):
        raise ValueInvalid(f"expected a whole number 0 .. 255, found {text}")
    return value


_number = _guarded(parse_number, "a number")
_byte = _guarded(_pen_byte, "a whole number 0 .. 255")
_angle = _guarded(_radians, "an angle in radians, or like 90deg")
_stamp = _guarded(_not_negative, "a time in seconds")
_duration = _guarded(_endless, "a duration in seconds, or inf")
_truth = _guarded(_boolean, "true or false")
_whole = _guarded(_integer, "a whole number")


def _flag(value: Any) -> float:
    """Read off: true, false, or turtlesim's 1 and 0."""
    return float(_truth(value)) if value in ("true", "false") else float(_number(value))


ARGUMENTS = {"turtle": _name, "name": _name, "theta": _angle, "angular": _angle, "off": _flag}  # others: numbers
ARGUMENTS |= dict.fromkeys(("r", "g", "b", "width"), _byte)


def _place(value: Any) -> Place:
    """Read [x, y], [x, y, theta] or {x, y, theta}: metres, radians."""
    if type(value) is dict:
        given = _known(value, ("x", "y", "theta"), "a place")
        x, y, theta = (within((key,), ARGUMENTS.get(key, _number), given.get(key, "0")) for key in ("x", "y", "theta"))
        return x, y, theta
    if type(value) is not list or len(value) not in (2, 3):
        raise Misfit(f"expected [x, y, theta], found {kind(value)}")
    x, y = (within((index,), _number, value[index]) for index in (0, 1))
    return x, y, within((2,), _angle, value[2]) if len(value) == 3 else 0.0
