"""Scenes of turtles, in Python or from a YAML or JSON file, and leader files: velocity commands, each with its line.

    duration: 20                                                  # seconds, or inf; also turtlesim: ros2, seed: 1
    turtles: {turtle1: {leader: square},                          # still, circle, square, figure8, random, or a file
              turtle2: {spawn: [4, 2, 0], follow: turtle1}}       # metres, radians (or 90deg); law: ros1, gains, ..
    events: [{t: 5, teleport_absolute: {turtle: turtle1, x: 2, y: 2, theta: 0}}]

Leader files are relative to the scene.

    t,linear,angular                                     CSV: columns by name, also linear_y and those of sim's own CSV
    - {t: 0.5, linear: 2.0, angular: 0.0}                YAML or JSON: mappings, in a list or as documents
    {linear: {x: 2.0}, angular: {z: 1.8}}                Twist messages
    up                                                   one word per line: the arrow keys of turtle_teleop_key

Metres and radians per second, times in seconds. A command without a time comes one period after the previous one.
"""

from __future__ import annotations

import math
import os
import re
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import format_error, parse_documents
from frametool.documents.source import InputFile, Piece, Source, counted_from, error_at
from frametool.documents.source import lines as pieces_of_lines
from frametool.errors import FormatError, ValueInvalid, alternatives, shown
from frametool.formats.detect import detect
from frametool.formats.rows.csv import split_line
from frametool.frames.stamps import BILLION, FURTHEST_NS, format_stamp, parse_time
from frametool.grammar.readers import Misfit, Path, as_mapping, kind, read_numbers, within
from frametool.ros.messages import without_noise
from frametool.sim import turtle as drivers
from frametool.sim.turtle import CENTRE, KEYS, LEADERS, SERVICES, TARGETS, FollowController, Twist, built_in, scripted
from frametool.text.numbers import parse_number, read_number_or_angle

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.sim.turtle import MakeLeader

    Place = tuple[float, float, float]  # metres, radians
    TimedTwist = tuple[int, Twist]

DURATION_NS = 20 * BILLION


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
    duration_ns: int | None = DURATION_NS
    variant: str = "ros1"
    holonomic: bool = False

    @property
    def followers(self) -> dict[str, Follow]:
        """Return the turtles that follow another, by name."""
        return {turtle.name: turtle.driver for turtle in self.turtles if isinstance(turtle.driver, Follow)}


def tutorial(
    *, leader: MakeLeader | str = "still", law: FollowController | str = "ros1",
    spawn: Place = (4.0, 2.0, 0.0), followers: int = 1, target: str = "leader", delay: float = 0.0,
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


LONGEST = FURTHEST_NS // BILLION  # seconds: the range of the buffer's stamps
FLAGS = {"true": "1", "false": "0"}  # as in turtlesim's services


def known_keys(value: Any, keys: Collection[str], what: str) -> dict[str, Any]:
    """Return a value as a mapping; raises Misfit for other values and for unknown keys."""
    mapping = as_mapping(value, what)
    if unknown := [key for key in mapping if key not in keys]:
        known = alternatives(unknown[0], keys, "keys")
        raise Misfit(f"unknown key {shown(unknown[0])}{known}", (unknown[0],), key=True)
    return mapping


def _time(text: str) -> int:
    stamp_ns = parse_time(text)
    if stamp_ns < 0:
        raise ValueInvalid(f"{text} s is before the start, which is 0")
    return stamp_ns


def _duration(text: str) -> int | None:
    return None if text in ("inf", ".inf") else _time(text)


def _whole(text: str, most: int) -> int:
    if not re.fullmatch(r"[0-9]{1,30}", text) or int(text) > most:
        raise ValueInvalid(f"expected a whole number 0 .. {most}, found {shown(text)}")
    return int(text)


CHOICES = {"turtlesim": drivers.VARIANTS, "law": (*drivers.LAWS,), "target": TARGETS}
# key, also of a service's argument or a command -> parser of its text, description; other keys are numbers
READERS: dict[str, tuple[Callable[[str], Any], str]] = {
    "duration": (_duration, "a duration in seconds, or inf"),
    "seed": (partial(_whole, most=1 << 64), "a whole number"),
    **{key: (str, f"one of {', '.join(words)}") for key, words in CHOICES.items()},
    **dict.fromkeys(("t", "delay"), (_time, "a time in seconds")),
    **dict.fromkeys(("turtle", "name", "follow"), (str, "a turtle's name")),
    **dict.fromkeys(
        ("theta", "angular"), (partial(read_number_or_angle, degrees=False), "an angle in radians, or like 90deg")
    ),
    **dict.fromkeys(("holonomic", "off"), (lambda text: parse_number(FLAGS.get(text) or text), "true or false")),
    **dict.fromkeys(("r", "g", "b", "width"), (partial(_whole, most=255), "a whole number 0 .. 255")),
}


def read_value(key: str, value: Any) -> Any:
    """Read the value of a key; a place is a list."""
    if key == "spawn":
        return read_place(value)
    parse, what = READERS.get(key, (parse_number, "a number"))
    if type(value) is not str or not value:
        raise Misfit(f"expected {what}, found {kind(value or None)}")
    if value not in (words := CHOICES.get(key, (value,))):
        raise ValueInvalid(f"unknown {shown(value)}{alternatives(value, words, 'choices')}")
    return parse(value)


def read_place(value: Any) -> Place:
    """Read [x, y] or [x, y, theta]: metres, radians; the angle may have a unit."""
    if type(value) is not list or len(value) not in (2, 3):
        raise Misfit(f"expected [x, y, theta], found {kind(value)}")
    x, y, *theta = (within((at,), read_value, ("x", "y", "theta")[at], each) for at, each in enumerate(value))
    return x, y, theta[0] if theta else 0.0


def parse_spawn(text: str) -> Place:
    """Parse X,Y or X,Y,THETA; raises ValueInvalid."""
    return read_place([cell.strip() for cell in text.split(",")])


def nanoseconds(name: str, seconds: float) -> int:
    """Return a duration in nanoseconds.

    Raises ValueInvalid with its name if it is negative or longer than stamps allow.
    """
    if not 0.0 <= seconds <= LONGEST:
        raise ValueInvalid(f"{name} must be 0 .. {LONGEST} s, found {seconds:g}")
    return round(seconds * BILLION)


NEEDED = ("t", "linear", "angular")
COLUMNS = {name: name for name in (*NEEDED, "linear_y", "turtle")} | {"linear_x": "linear", "angular_z": "angular"}
RECORDED = ("distance", "leader_x", "leader_y", "leader_theta", "x", "y", "theta")  # ignored columns
ENTRY_KEYS = ("t", "turtle", "linear", "angular", "linear_y")
AXES = ("x", "y", "z")
COMMAND = f"{{t: 0.5, linear: 2.0, angular: 0.0}}, a Twist message, or a key: {', '.join(KEYS)}"
EXPECTED = f"a command is {COMMAND}"
_WORD = re.compile(r"[A-Za-z_]+\s*").fullmatch


def read_script(source: Source) -> list[TimedTwist]:
    """Read a whole leader file: nanoseconds and commands in order; at least one.

    Raises FormatError with the line.
    """
    commands = list(read_commands(source.text.split("\n"), source.name))
    if not commands:
        raise FormatError(f"no commands in it; {EXPECTED}", source=source.name, line=1)
    return commands


def read_commands(lines: Iterable[str], name: str, *, period_ns: int = BILLION) -> Iterator[TimedTwist]:
    """Read commands from lines as they arrive, one document in memory at a time; otherwise as `read_script`."""
    last_ns: int | None = None
    columns: Sequence[str] | None = None
    turtles: dict[str, None] = {}
    for piece, is_row in _pieces(lines):
        source = Source(name, piece.text)
        with counted_from(piece.line):
            try:
                if is_row and columns is None:
                    columns = _columns(source.text)
                    continue
                for path, value in _values(source, columns):
                    _check_turtle(value, path, turtles)
                    for t_ns, twist in timed_commands(value, path, last_ns, period_ns):
                        yield t_ns, twist
                        last_ns = t_ns
            except Misfit as misfit:
                if not is_row:
                    raise format_error(source, misfit.path, str(misfit), key=misfit.key) from None
                first = misfit.path[0] if misfit.path else 0  # the number or the name of a column
                at = first if isinstance(first, int) else (columns or ()).index(first)
                raise error_at(source, split_line(source.text)[at].column - 1, str(misfit)) from None


def _check_turtle(value: Any, path: Path, turtles: dict[str, None]) -> None:
    """Raise Misfit for commands of another turtle than those before it, which are kept in `turtles`."""
    items = value if type(value) is list else [value]
    turtles |= {str(item["turtle"]): None for item in items if type(item) is dict and item.get("turtle")}
    if len(turtles) > 1:
        raise Misfit(f"commands of {' and '.join(map(shown, turtles))}; a leader takes those of one turtle", path)


def _values(source: Source, columns: Sequence[str] | None) -> Iterator[tuple[Path, Any]]:
    """Yield the values of a piece of the input, each with its path; a row of CSV is a mapping."""
    if columns is None:
        yield from (((document.index,), document.value) for document in parse_documents(source.text, source.name))
        return
    cells = split_line(source.text)
    if len(cells) != len(columns):
        raise Misfit(f"expected {len(columns)} cells, found {len(cells)}")
    yield (), {name: cell.text for name, cell in zip(columns, cells, strict=True) if name}


def timed_commands(
    value: Any, path: Path = (), last_ns: int | None = None, period_ns: int = BILLION
) -> Iterator[TimedTwist]:
    """Read the commands of a value, each with its time, which must not be before the previous one.

    Raises Misfit.
    """
    items = [((*path, at), item) for at, item in enumerate(value)] if type(value) is list else [(path, value)]
    for place, item in items:
        own_ns, twist = within(place, _entry, item)
        stamp_ns = own_ns if own_ns is not None else 0 if last_ns is None else last_ns + period_ns
        if last_ns is not None and stamp_ns < last_ns:
            late = f"t {format_stamp(stamp_ns)} comes after {format_stamp(last_ns)}"
            raise Misfit(f"{late}; sort the commands by time", (*place, "t"))
        last_ns = stamp_ns
        yield stamp_ns, twist


def _pieces(lines: Iterable[str]) -> Iterator[tuple[Piece, bool]]:
    """Split lines into pieces that can be read one by one, each with True for a row of CSV, header included.

    The first line with data distinguishes CSV from documents and words.  A quoted cell may contain a line end.  A
    document is yielded when the line that ends it has arrived, a single-line one at once.  Lines that the shell or the
    tools wrote between the messages are blanked.
    """
    is_table: bool | None = None
    held: list[str] = []
    for number, line in enumerate(lines, 1):
        text = without_noise(line.rstrip("\r\n"))
        if not held and (not text.strip() or text.startswith(("#", "..."))):
            continue
        if is_table is None:
            is_table = detect(text.encode(), "rows", "records", otherwise="yaml") == "csv"
        alone = _WORD(text) is not None or (text.startswith("{") and text.rstrip().endswith("}"))
        if alone and held and not is_table:
            yield Piece("\n".join(held), number - len(held)), False
            held.clear()
        held.append(text)
        if "\n".join(held).count('"') % 2 == 0 if is_table else alone or text.startswith(("---", "...")):
            yield Piece("\n".join(held), number - len(held) + 1), is_table
            held.clear()
    if held:
        yield Piece("\n".join(held), number - len(held) + 1), bool(is_table)


def _columns(header: str) -> list[str]:
    """Return the columns of CSV by their content; "" for ignored ones."""
    names = [cell.text for cell in split_line(header)]
    columns = [COLUMNS.get(name, "") for name in names]
    if missing := [name for name in NEEDED if name not in columns]:
        raise Misfit(f"no column {', '.join(missing)}; columns: {', '.join(names)}")
    for index, (name, column) in enumerate(zip(names, columns, strict=True)):
        if column and columns.index(column) < index:
            raise Misfit(f"two columns for {column}", (index,))
        if not column and name not in RECORDED:
            raise Misfit(f"unknown column {shown(name)}{alternatives(name, COLUMNS, 'columns')}", (index,))
    return columns


def _entry(value: Any) -> tuple[int | None, Twist]:
    """Read {t, linear, angular, linear_y}, a Twist message, or the name of an arrow key."""
    if type(value) is str and _WORD(value):
        if value.lower() not in KEYS:
            raise Misfit(f"unknown key {shown(value)}{alternatives(value, KEYS, 'keys')}")
        return None, KEYS[value.lower()]
    entry = known_keys(value, ENTRY_KEYS, f"a command {COMMAND}")
    if "linear" not in entry and "angular" not in entry:
        raise Misfit(f"neither linear nor angular; {EXPECTED}")
    ahead, aside = within(("linear",), _axes, entry.get("linear", "0"), 0, 1)
    turning, _ = within(("angular",), _axes, entry.get("angular", "0"), 2, 2)
    others = {key: within((key,), read_value, key, entry[key]) for key in ("linear_y", "t") if key in entry}
    return others.get("t"), Twist(ahead, turning, others.get("linear_y", aside))


def _axes(value: Any, first: int, second: int) -> tuple[float, float]:
    """Read one number, or two axes of a vector; the others have no meaning for a turtle."""
    if type(value) is str:
        return parse_number(value), 0.0
    numbers = read_numbers(value, AXES, partial=True)
    return numbers[first], numbers[second]


def read_stream(stream: Any, name: str, *, period_ns: int = BILLION) -> Iterator[TimedTwist]:
    """Yield commands from a stream as they arrive; raises FormatError for bytes that are not text.

    The buffer of standard input is bypassed: Python aborts if it exits while a thread waits in it.
    """
    unbuffered: Any = SimpleNamespace(read1=stream.raw.read)
    lines = (line for piece in pieces_of_lines(unbuffered, name) for line in piece.text.splitlines())
    return read_commands(lines, name, period_ns=period_ns)


SCENE_KEYS = ("turtles", "events", "duration", "turtlesim", "holonomic", "seed")
CONTROLLER_KEYS = ("rate", "gain_linear", "gain_angular", "max_linear", "max_angular")
FOLLOW_KEYS = ("follow", "law", *CONTROLLER_KEYS, "target", "delay")
TURTLE_KEYS = ("spawn", "leader", *FOLLOW_KEYS)


def _fields(value: Any, keys: Collection[str], what: str, raw: Collection[str] = ()) -> dict[str, Any]:
    """Read a mapping with some of these keys; `raw` are left as they are."""
    mapping = known_keys(value, keys, what)
    return {key: each if key in raw else within((key,), read_value, key, each) for key, each in mapping.items()}


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
    scene = _fields(value, SCENE_KEYS, "a scene {turtles: .., events: .., duration: ..}", ("turtles", "events"))
    if "turtles" not in scene:
        raise Misfit(f"no turtles; expected {', '.join(SCENE_KEYS)}")
    events = scene.get("events") or []
    if type(events) is not list:
        raise Misfit(f"expected a list of {{t: .., SERVICE: {{..}}}}, found {kind(events)}", ("events",))
    calls = [
        within(("events", at), _call, entry)._replace(place=f"{source.name}, event {at + 1}")
        for at, entry in enumerate(events)
    ]
    seed = scene.get("seed", 0) if seed is None else seed
    entries = within(("turtles",), as_mapping, scene["turtles"], "the turtles by name")
    turtles = [within(("turtles", name), _turtle, name, entry or {}, source, seed) for name, entry in entries.items()]
    variant, holonomic = scene.get("turtlesim", "ros1"), bool(scene.get("holonomic"))
    return Scene(turtles, calls, scene.get("duration", DURATION_NS), variant, holonomic)


def _turtle(name: str, value: Any, source: Source, seed: int) -> SceneTurtle:
    entry = _fields(value, TURTLE_KEYS, "a turtle {spawn: [x, y, theta], leader: .. or follow: ..}", ("leader",))
    if name in ("", "world"):
        raise Misfit(f"a turtle cannot be called {shown(name)}", key=True)
    driver: MakeLeader | Follow | None = None
    if "follow" in entry:
        if "leader" in entry:
            raise Misfit("a turtle has a leader script or follows another, not both", ("leader",), key=True)
        if entry["follow"] == name:
            raise Misfit(f"{name} cannot follow itself", ("follow",))
        law = entry.get("law", "ros1")
        numbers = {key: entry[key] for key in CONTROLLER_KEYS if key in entry}
        for key, number in numbers.items():
            within((key,), FollowController, law, **{key: number})
        controller = FollowController(law, **numbers)
        driver = Follow(entry["follow"], controller, entry.get("target", "leader"), entry.get("delay", 0))
    elif stray := [key for key in entry if key in FOLLOW_KEYS]:
        raise Misfit(f"{stray[0]} says how to follow; add follow: NAME", (stray[0],), key=True)
    elif "leader" in entry:
        driver = within(("leader",), _leader, entry["leader"], source, seed)
    return SceneTurtle(name, entry.get("spawn", (CENTRE, CENTRE, 0.0)), driver)


def _leader(value: Any, source: Source, seed: int) -> MakeLeader:
    """Read a leader: a built-in name, a file relative to the scene, or the commands themselves."""
    if type(value) is list:
        return scripted(list(timed_commands(value)))
    if type(value) is not str:
        raise Misfit(f"expected a leader's name, a file or a list of commands, found {kind(value)}")
    if value in LEADERS:
        return built_in(value, seed)
    path = os.path.join(os.path.dirname(source.name), value)
    if not os.path.exists(path):
        raise Misfit(f"no file {path} and no leader {shown(value)}{alternatives(value, LEADERS, 'leaders')}")
    return scripted(read_script(Source(path, InputFile(path).text)))


def _call(value: Any) -> ServiceCall:
    """Read {t: .., SERVICE: {..}}; for kill the name alone is enough."""
    entry = known_keys(value, ("t", *SERVICES), "an event {t: .., SERVICE: {..}}")
    named = [key for key in entry if key != "t"]
    if "t" not in entry or len(named) != 1:
        raise Misfit(f"an event has t and one of {', '.join(SERVICES)}")
    service = named[0]
    arguments = entry[service]
    if service == "kill" and type(arguments) is str:
        arguments = {"name": arguments}
    read = within((service,), _fields, arguments or {}, SERVICES[service], f"the arguments of {service}")
    within((service,), drivers.complete, service, read)
    return ServiceCall(within(("t",), read_value, "t", entry["t"]), service, read)
