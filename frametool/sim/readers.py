"""Readers of scenes and leader files: single values, and velocity commands, one at a time, each with its line.

    t,linear,angular                                     CSV: columns by name, also linear_y and those of sim's own CSV
    - {t: 0.5, linear: 2.0, angular: 0.0}                YAML or JSON: mappings, in a list or as documents
    {linear: {x: 2.0}, angular: {z: 1.8}}                Twist messages
    up                                                   one word per line: the arrow keys of turtle_teleop_key

Metres and radians per second, times in seconds. A command without a time comes one period after the previous one.
"""

from __future__ import annotations

import re
from functools import partial
from itertools import chain
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from frametool.documents.document import Piece, counted_from, format_error, parse_documents
from frametool.documents.document import lines as pieces_of_lines
from frametool.documents.source import Source, error_at
from frametool.errors import FormatError, ValueInvalid, alternatives, shown
from frametool.formats.detect import detect
from frametool.formats.rows.csv import split_line
from frametool.frames.stamps import BILLION, FURTHEST_NS, format_stamp, parse_time
from frametool.grammar.readers import Misfit, Path, as_mapping, kind, read_number, read_numbers, within
from frametool.ros.message_stream import NOISE
from frametool.sim.drivers import KEYS
from frametool.sim.turtle import Twist
from frametool.text.numbers import parse_number, read_number_or_angle

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
    from typing import TypeVar

    from frametool.sim.drivers import TimedTwist

    NumberedLines = Iterator[tuple[int, str]]
    Place = tuple[float, float, float]  # metres, radians
    Value = TypeVar("Value")

LONGEST = FURTHEST_NS // BILLION  # seconds: the range of the buffer's stamps
FLAGS = {"true": "1", "false": "0"}  # as in turtlesim's services


def text_reader(parse: Callable[[str], Value], what: str) -> Callable[[Any], Value]:
    """Return the reader of values for a parser of text; `what` is the expected value in errors."""

    def read(value: Any) -> Value:
        if type(value) is not str:
            raise Misfit(f"expected {what}, found {kind(value)}")
        return parse(value)

    return read


def one_of(names: Collection[str]) -> Callable[[Any], str]:
    """Return the reader of one of several words."""

    def parse(text: str) -> str:
        if text not in names:
            raise ValueInvalid(f"unknown {shown(text)}{alternatives(text, names, 'choices')}")
        return text

    return text_reader(parse, f"one of {', '.join(names)}")


def known_keys(value: Any, keys: Collection[str], what: str) -> dict[str, Any]:
    """Return a value that must be a mapping with some of these keys."""
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


def _whole(text: str, most: int) -> int:
    if not re.fullmatch(r"[0-9]{1,30}", text) or int(text) > most:
        raise ValueInvalid(f"expected a whole number 0 .. {most}, found {shown(text)}")
    return int(text)


read_byte = text_reader(partial(_whole, most=255), "a whole number 0 .. 255")
read_angle = text_reader(partial(read_number_or_angle, degrees=False), "an angle in radians, or like 90deg")
read_time = text_reader(_time, "a time in seconds")
read_duration = text_reader(
    lambda text: None if text in ("inf", ".inf") else _time(text), "a duration in seconds, or inf"
)
read_flag = text_reader(lambda text: parse_number(FLAGS.get(text, text)), "true or false")
read_seed = text_reader(partial(_whole, most=1 << 64), "a whole number")


def read_place(value: Any) -> Place:
    """Read [x, y] or [x, y, theta]: metres, radians; the angle may have a unit."""
    if type(value) is not list or len(value) not in (2, 3):
        raise Misfit(f"expected [x, y, theta], found {kind(value)}")
    x, y = (within((index,), read_number, value[index]) for index in (0, 1))
    return x, y, within((2,), read_angle, value[2]) if len(value) == 3 else 0.0


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
COLUMNS = {name: name for name in (*NEEDED, "linear_y")} | {"linear_x": "linear", "angular_z": "angular"}
RECORDED = ("turtle", "distance", "leader_x", "leader_y", "leader_theta", "x", "y", "theta")  # ignored columns
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
    for piece, is_row in _pieces(lines):
        source = Source(name, piece.text)
        with counted_from(piece.line):
            try:
                if is_row and columns is None:
                    columns = _columns(source.text)
                    continue
                for path, value in _values(source, columns):
                    for t_ns, twist in timed_commands(value, path, last_ns, period_ns):
                        yield t_ns, twist
                        last_ns = t_ns
            except Misfit as misfit:
                raise _placed(misfit, source, is_row, columns or ()) from None


def _values(source: Source, columns: Sequence[str] | None) -> Iterator[tuple[Path, Any]]:
    """Yield the values of a piece of the input, each with its path; a row of CSV is a mapping."""
    if columns is None:
        yield from (((document.index,), document.value) for document in parse_documents(source.text, source.name))
        return
    cells = split_line(source.text)
    if len(cells) != len(columns):
        raise Misfit(f"expected {len(columns)} cells, found {len(cells)}")
    yield (), {name: cell.text for name, cell in zip(columns, cells, strict=True) if name}


def _placed(misfit: Misfit, source: Source, is_row: bool, columns: Sequence[str]) -> FormatError:  # noqa: FBT001
    """Return an error with its place: of a path in a document, or of the name or number of a column in a row."""
    if not is_row:
        return format_error(source, misfit.path, str(misfit), key=misfit.key)
    first = misfit.path[0] if misfit.path else 0
    cell = split_line(source.text)[first if isinstance(first, int) else columns.index(first)]
    return error_at(source, cell.column - 1, str(misfit))


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
    """Split lines into pieces that can be read one by one, and yield whether each is a row of CSV, header included.

    The first line with data distinguishes CSV from documents and words.
    """
    numbered = enumerate((_without_noise(line.rstrip("\r\n")) for line in lines), 1)
    for number, text in numbered:
        if _says_something(text):
            is_table = detect(text.encode(), "rows", "records", otherwise="yaml") == "csv"
            pieces = (_rows if is_table else _documents)(chain(((number, text),), numbered))
            yield from ((piece, is_table) for piece in pieces)


def _rows(numbered: NumberedLines) -> Iterator[Piece]:
    """Yield the rows of CSV; a quoted cell may contain a line end."""
    for number, line in numbered:
        text = line
        while text.count('"') % 2 and (more := next(numbered, None)):
            text = f"{text}\n{more[1]}"
        if _says_something(text):
            yield Piece(text, number)


def _documents(numbered: NumberedLines) -> Iterator[Piece]:
    """Yield documents, each when the line that ends it has arrived, and single-line documents at once."""
    pending: list[str] = []
    number = 0
    for number, text in numbered:
        alone = _WORD(text) is not None or (text.startswith("{") and text.rstrip().endswith("}"))
        if alone or text.startswith(("---", "...")):
            if any(map(str.strip, pending)):
                yield Piece("\n".join(pending), number - len(pending))
            pending.clear()
            if alone:
                yield Piece(text, number)
        elif pending or _says_something(text):
            pending.append(text)
    if pending:
        yield Piece("\n".join(pending), number - len(pending) + 1)


def _says_something(line: str) -> bool:
    """Return True for data, False for blank lines and comments."""
    return bool(line.strip()) and not line.startswith("#")


def _without_noise(text: str) -> str:
    """Blank a line that the shell or the tools wrote between the messages; one kind of them ends a document."""
    return text if NOISE(text) is None else "---" if text.endswith("---") else ""


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
    if "linear_y" in entry:
        aside = within(("linear_y",), read_number, entry["linear_y"])
    stamp_ns = within(("t",), read_time, entry["t"]) if "t" in entry else None
    return stamp_ns, Twist(ahead, turning, aside)


def _axes(value: Any, first: int, second: int) -> tuple[float, float]:
    """Read one number, or two axes of a vector; the others have no meaning for a turtle."""
    if type(value) is str:
        return read_number(value), 0.0
    numbers = read_numbers(value, AXES, partial=True)
    return numbers[first], numbers[second]


def lines_as_they_come(stream: Any, name: str) -> Iterator[str]:
    """Yield the lines of a stream as they arrive; raises FormatError for bytes that are not text.

    They are read past the buffer of standard input: Python aborts when it ends while a thread waits inside that.
    """
    unbuffered: Any = SimpleNamespace(read1=stream.raw.read)
    for piece in pieces_of_lines(unbuffered, name):
        yield from piece.text.splitlines()
