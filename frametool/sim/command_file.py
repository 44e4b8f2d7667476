"""Velocity commands in: leader files and streams, one command at a time, each with its line.

    t,linear,angular                                     CSV: columns by name, also linear_y and those of sim's own CSV
    - {t: 0.5, linear: 2.0, angular: 0.0}                YAML or JSON: mappings, in a list or as documents
    {linear: {x: 2.0}, angular: {z: 1.8}}                Twist messages
    up                                                   a word a line: the arrow keys of turtle_teleop_key

Metres and radians a second, times in seconds. What has no time comes one period after what is in front of it.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.document import format_error, parse_documents
from frametool.documents.source import Source, error_at
from frametool.errors import FormatError, ValueInvalid, alternatives
from frametool.frames.stamps import BILLION, format_stamp, parse_stamp
from frametool.grammar.readers import Misfit, as_mapping, kind, read_number, read_numbers, within
from frametool.ros.noise import NOISE
from frametool.sim.leaders import KEYS
from frametool.sim.turtle import Twist
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.grammar.readers import Path
    from frametool.sim.leaders import TimedTwist

    Found = tuple[int | None, Twist, "Chunk", Path]  # nanoseconds if given, command, where it stands

COLUMNS = {
    "t": "t", "linear": "linear", "angular": "angular", "linear_y": "linear_y",
    "linear_x": "linear", "angular_z": "angular",
}  # fmt: skip
NEEDED = ("t", "linear", "angular")
RECORDED = ("turtle", "distance", "leader_x", "leader_y", "leader_theta", "x", "y", "theta")  # not looked at
ENTRY_KEYS = ("t", "turtle", "linear", "angular", "linear_y")
AXES = ("x", "y", "z")
COMMAND = f"{{t: 0.5, linear: 2.0, angular: 0.0}}, a Twist message, or a key: {', '.join(KEYS)}"
EXPECTED = f"a command is {COMMAND}"
_WORD = re.compile(r"[A-Za-z_]+\s*").fullmatch
_CSV_HEADER = re.compile(r"[^-{\[:,][^:,]*(,[^:,]*)+").fullmatch


class Chunk:
    """A piece of the input that is read at once: a document, a word, a row of CSV; `line` is that of its begin."""

    def __init__(self, name: str, text: str, line: int, columns: dict[str, int] | None = None) -> None:
        """Keep the text; `columns` says which cell is what, in a row of CSV."""
        self.source = Source(name, text)
        self.line = line
        self.columns = columns

    @property
    def is_word(self) -> bool:
        """Tell whether it is the name of a key."""
        return self.columns is None and _WORD(self.source.text) is not None

    def error(self, message: str, path: Path = (), *, key: bool = False) -> FormatError:
        """Make the error for a place in it; a path is that of a document, or the cell's number."""
        if self.columns is None and not self.is_word:
            error = format_error(self.source, path, message, key=key)
        else:
            before = self.source.text.split(",")[: int(path[0]) if path else 0]
            error = error_at(self.source, sum(map(len, before)) + len(before), message)
        error.line += self.line - 1
        return error


def read_script(source: Source, *, period_ns: int = BILLION) -> list[TimedTwist]:
    """Read a whole leader file: nanoseconds and commands in order; at least one.

    Raises FormatError with the line.
    """
    commands = list(read_twists(source.text.split("\n"), source.name, period_ns=period_ns))
    if not commands:
        raise FormatError(f"no commands in it; {EXPECTED}", source=source.name, line=1)
    return commands


def read_entries(value: Any) -> list[TimedTwist]:
    """Read the commands written inside another document, as a list.

    Raises Misfit.
    """
    chunk = Chunk("", "", 1)
    last_ns, commands = None, []
    for stamp_ns, twist, _, path in _entries(value, (), chunk):
        last_ns = _next_time(stamp_ns, last_ns, BILLION, path)
        commands.append((last_ns, twist))
    return commands


def read_twists(lines: Iterable[str], name: str, *, period_ns: int = BILLION) -> Iterator[TimedTwist]:
    """Read commands from lines as they come, one document in memory at a time; otherwise as `read_script`."""
    last_ns: int | None = None
    for chunk in _chunks(lines, name):
        try:
            for stamp_ns, twist, _, path in _commands(chunk):
                last_ns = _next_time(stamp_ns, last_ns, period_ns, path)
                yield last_ns, twist
        except Misfit as misfit:
            raise chunk.error(str(misfit), misfit.path, key=misfit.key) from None
        except FormatError as error:
            error.line += chunk.line - 1
            raise


def _next_time(stamp_ns: int | None, last_ns: int | None, period_ns: int, path: Path) -> int:
    """Settle the time of a command, which may not lie before the last one's."""
    if stamp_ns is None:
        return 0 if last_ns is None else last_ns + period_ns
    if stamp_ns < 0:
        raise Misfit("t is before the start, which is 0", path)
    if last_ns is not None and stamp_ns < last_ns:
        raise Misfit(f"t {format_stamp(stamp_ns)} comes after {format_stamp(last_ns)}; sort the commands by time", path)
    return stamp_ns


def _chunks(lines: Iterable[str], name: str) -> Iterator[Chunk]:
    """Cut lines into pieces that can be read one by one."""
    pending: list[str] = []
    columns: dict[str, int] | None = None
    begun = False
    for number, line in enumerate(lines, 1):
        text = _without_noise(line.rstrip("\r\n"))
        if columns is not None:
            if text.strip() and not text.startswith("#"):
                yield Chunk(name, text, number, columns)
        elif not begun and _CSV_HEADER(text):
            columns = _header(Chunk(name, text, number, {}))
        elif text.startswith(("---", "...")) or _stands_alone(text):
            if any(map(str.strip, pending)):
                yield Chunk(name, "\n".join(pending), number - len(pending))
            pending = []
            if _stands_alone(text):
                yield Chunk(name, text, number)
        elif pending or (text.strip() and not text.startswith("#")):
            pending.append(text)
        begun = begun or bool(text.strip() and not text.startswith("#"))
    if pending:
        yield Chunk(name, "\n".join(pending), number - len(pending) + 1)


def _without_noise(text: str) -> str:
    """Blank a line that the shell or the tools wrote beside the messages; one of theirs ends a document."""
    return text if NOISE(text) is None else "---" if text.endswith("---") else ""


def _stands_alone(text: str) -> bool:
    """Tell whether a line needs none of the following: a key's name, an object of JSON."""
    return _WORD(text) is not None or (text.startswith("{") and text.rstrip().endswith("}"))


def _header(chunk: Chunk) -> dict[str, int]:
    """Find the columns of a CSV file by name."""
    names = [name.strip() for name in chunk.source.text.split(",")]
    columns: dict[str, int] = {}
    for index, name in enumerate(names):
        if name in COLUMNS:
            if COLUMNS[name] in columns:
                raise chunk.error(f"two columns for {COLUMNS[name]}", (index,))
            columns[COLUMNS[name]] = index
    if missing := [name for name in NEEDED if name not in columns]:
        raise chunk.error(f"no column {', '.join(missing)}; columns: {', '.join(names)}")
    for index, name in enumerate(names):
        if name not in COLUMNS and name not in RECORDED:
            raise chunk.error(f"unknown column {name!r}{alternatives(name, COLUMNS, 'columns')}", (index,))
    return columns | {"": len(names)}


def _commands(chunk: Chunk) -> Iterator[Found]:
    """Read what a piece says."""
    if chunk.columns is not None:
        yield _row(chunk, chunk.columns)
    elif chunk.is_word:
        yield None, _key(chunk.source.text.strip()), chunk, ()
    else:
        for document in parse_documents(chunk.source.text, chunk.source.name):
            yield from _entries(document.value, (document.index,), chunk)


def _row(chunk: Chunk, columns: dict[str, int]) -> Found:
    cells = [cell.strip() for cell in chunk.source.text.split(",")]
    if len(cells) != columns[""]:
        raise Misfit(f"expected {columns['']} cells, found {len(cells)}")
    stamp_ns = _cell(parse_stamp, cells, columns["t"])
    ahead, turning = (_cell(parse_number, cells, columns[name]) for name in ("linear", "angular"))
    aside = _cell(parse_number, cells, columns["linear_y"]) if "linear_y" in columns else 0.0
    return stamp_ns, Twist(ahead, turning, aside), chunk, (columns["t"],)


def _cell(parse: Any, cells: list[str], index: int) -> Any:
    try:
        return parse(cells[index])
    except ValueInvalid as error:
        raise Misfit(str(error), (index,)) from None


def _key(word: str) -> Twist:
    """Return the command of an arrow key."""
    if word.lower() not in KEYS:
        raise Misfit(f"unknown key {word!r}{alternatives(word, KEYS, 'keys')}")
    return KEYS[word.lower()]


def _entries(value: Any, path: Path, chunk: Chunk) -> Iterator[Found]:
    """Read one command, or a list of them."""
    if type(value) is list and not (value and all(type(item) is str for item in value)):
        for index, item in enumerate(value):
            yield from _entries(item, (*path, index), chunk)
    else:
        stamp_ns, twist = within(path, _entry, value)
        yield stamp_ns, twist, chunk, (*path, "t")


def _entry(value: Any) -> tuple[int | None, Twist]:
    """Read {t, linear, angular, linear_y}, a Twist message, or [t, linear, angular]."""
    if type(value) is list:
        t, linear, angular = _listed(value)
        return t, Twist(linear, angular)
    entry = as_mapping(value, f"a command {COMMAND}")
    if unknown := [key for key in entry if key not in ENTRY_KEYS]:
        known = alternatives(unknown[0], ENTRY_KEYS, "keys")
        raise Misfit(f"unknown key {unknown[0]!r}{known}", (unknown[0],), key=True)
    if "linear" not in entry and "angular" not in entry:
        raise Misfit(f"neither linear nor angular; {EXPECTED}")
    ahead, aside = within(("linear",), _axes, entry.get("linear", "0"), 0, 1)
    turning, _ = within(("angular",), _axes, entry.get("angular", "0"), 2, 2)
    if "linear_y" in entry:
        aside = within(("linear_y",), _number, entry["linear_y"])
    stamp_ns = within(("t",), _stamp, entry["t"]) if "t" in entry else None
    return stamp_ns, Twist(ahead, turning, aside)


def _listed(value: list[Any]) -> tuple[int, float, float]:
    if len(value) != 3:
        raise Misfit(f"expected [t, linear, angular], found {len(value)} items")
    return within((0,), _stamp, value[0]), within((1,), _number, value[1]), within((2,), _number, value[2])


def _axes(value: Any, first: int, second: int) -> tuple[float, float]:
    """Read one number, or two axes of a vector; the others mean nothing to a turtle."""
    if type(value) is str:
        return _number(value), 0.0
    numbers = read_numbers(value, AXES, partial=True)
    return numbers[first], numbers[second]


def _number(value: Any) -> float:
    """Read a number; what is none is placed by the caller."""
    try:
        return read_number(value)
    except ValueInvalid as error:
        raise Misfit(str(error)) from None


def _stamp(value: Any) -> int:
    """Read a time in seconds."""
    if type(value) is not str:
        raise Misfit(f"expected a time in seconds, found {kind(value)}")
    try:
        return parse_stamp(value)
    except ValueInvalid as error:
        raise Misfit(str(error)) from None
