"""The errors raised by frametool, with their exit codes, and the function for warnings.

    FrametoolError                                                   exit
      ValueInvalid     an invalid number or name                      1
      FormatError      text that cannot be read, with its source,     1
                       line and column
        Unanswered     a file that needs an option                    2
        BadAnswer      an option that does not fit the file           2
      Misused          arguments or columns that do not fit           2
      BadTopology      cycle, two parents, a frame in itself          1
      LookupFailed                                                    4
        UnknownFrame   NotConnected
        NoDataAt       TooEarly  TooLate
      FileProblem      missing, unreadable, exists, full              5

The library raises; only the command line turns an error into a line on stderr.
"""

from __future__ import annotations

from collections import namedtuple
from contextlib import contextmanager

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from typing import Any, TypeVar
    from typing import NamedTuple as NamedTuple  # noqa: PLC0414 - for others

    Result = TypeVar("Result")
    Listener = Callable[[str, str], None]
else:

    class _Records(type):
        """Make a class of named fields as typing.NamedTuple does, but compile none of its types: 40 us instead of 200.

        For some 40 such classes this saves 4 of the 57 ms of `frametool compose`.  They have no other base.
        """

        def __new__(cls: Any, name: str, _bases: Any, body: dict[str, Any]) -> Any:
            fields = body.pop("__annotations__", {})
            defaults = [body.pop(field) for field in fields if field in body]
            made = namedtuple(name, fields, defaults=defaults, module=body.pop("__module__"))  # noqa: PYI024 - the base
            for key, value in body.items():
                setattr(made, key, value)
            return made

    NamedTuple = type.__new__(_Records, "NamedTuple", (), {})

SHOWN = 60  # maximum length of quoted input in a message
LONGEST_NAME = 200  # first characters of a name that are compared with others
MOST_COMPARED, NEIGHBOURS = 500, 60  # names that are all compared; of more, those before and after in the alphabet
NEAREST = 5  # names listed first in a shortened list


class FrametoolError(Exception):
    """Base class of all errors.

    exit_code: that of a command which ends with the error
    rule: the rule of `check` that is violated, if any
    """

    exit_code = 1
    rule = ""

    def __init__(self, *message: object, **fields: object) -> None:
        """Store the message, and its facts as fields for programs."""
        super().__init__(*message)
        self.fields = fields

    @property
    def kind(self) -> str:
        """Return the name of the error in machine output: `unknown_frame`."""
        name = next(each.__name__ for each in type(self).__mro__ if each.__name__[0] != "_")
        return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name)[1:]

    def details(self) -> dict[str, object]:
        """Return the fields for machine output, in addition to the kind and the message."""
        return self.fields

    def __reduce__(self) -> tuple[Callable[..., FrametoolError], tuple[object, ...], dict[str, object]]:
        """Allow pickling an error, whatever its arguments."""
        return type(self).__new__, (type(self),), {**self.__dict__, "args": self.args}


class ValueInvalid(FrametoolError, ValueError):
    """A number, rotation or name that cannot be used."""

    def __init__(self, message: str, *, rule: str = "") -> None:
        """Store the rule with the message."""
        super().__init__(message)
        self.rule = rule or self.rule


_FINDING = namedtuple("_FINDING", "rule message source line column path", defaults=("", 0, 0, ()))  # noqa: PYI024 - typing takes 8 ms


class Finding(_FINDING):
    """A message with a place: what is wrong or suspicious, and the rule of `check`.

    rule, message, source: texts
    line, column: from 1, 0 if unknown
    path: in a document, the keys that lead to it
    """

    __slots__ = ()


class FormatError(FrametoolError, ValueError):
    """Text that cannot be read; its place is `source:line:column`, both counted from 1."""

    def __init__(
        self, message: str, *, source: str = "", line: int = 0, column: int = 0, snippet: str = "", rule: str = "",
    ) -> None:  # fmt: skip
        """Store the place with the message; `snippet` is the source line with a caret below it."""
        super().__init__(message)
        self.rule = rule or self.rule
        self.message, self.source, self.line, self.column, self.snippet = message, source, line, column, snippet

    def __str__(self) -> str:
        """Return `source:line:column: message`, without unknown parts."""
        place = ":".join(str(part) for part in self.details().values())
        return f"{place}: {self.message}" if place else self.message

    @property
    def finding(self) -> Finding:
        """Return the error as a finding of `check`."""
        return Finding(self.rule or "syntax", self.message, self.source, self.line, self.column)

    def details(self) -> dict[str, object]:
        """Return the known parts of the place."""
        return {key: value for key in ("source", "line", "column") if (value := getattr(self, key))}


class Unanswered(FormatError):
    """A file that lacks something which an option can specify; the message names the options."""

    exit_code = 2


class BadAnswer(FormatError):
    """An option about a file that does not fit it, such as a joint that the robot does not have."""

    exit_code = 2


class Misused(FormatError):
    """Arguments or options that do not fit each other or the columns of a table."""

    exit_code = 2


class BadTopology(FormatError):
    """Frames that are not a tree: a cycle, two parents, a frame that is its own parent."""


class LookupFailed(FrametoolError, LookupError):
    """A lookup without a result."""

    exit_code = 4


class UnknownFrame(LookupFailed):
    """A frame that is not in the tree, with the nearest names and the number of frames.

    short: the message without the list of frames
    """

    def __init__(self, name: str, *, known: Iterable[str], where: str = "") -> None:
        """Compose the message from the name, the known frames and the tree's name."""
        from heapq import nsmallest

        self.name = name
        self.known = tuple(known)
        place = f" in {where}" if where else ""
        near = did_you_mean(name, self.known)
        self.short = f"unknown frame {shown(name)}{place}{near}"
        message = f"{self.short}{'' if near else ';'} frames: {listing(self.known, NEAREST, near=name)}"
        super().__init__(message, frame=name, known=nsmallest(20, self.known))


class NotConnected(LookupFailed):
    """Two frames in different trees."""


class NoDataAt(LookupFailed):
    """An edge without data at the requested time."""


class TooEarly(NoDataAt):
    """A request before an edge's first sample."""


class TooLate(NoDataAt):
    """A request after an edge's last sample."""


class FileProblem(FrametoolError, OSError):
    """A file that is missing, unreadable, already there or on a full disk."""

    exit_code = 5


class FrametoolWarning(UserWarning):
    """A warning about data that were used but look suspicious."""


_listeners: list[Listener] = []


def warn(message: str, *, rule: str = "") -> None:
    """Emit a warning: to the current listener, else as a Python warning.

    rule: the rule of `check` that finds it, if any
    """
    if _listeners:
        _listeners[-1](message, rule)
        return
    import warnings

    warnings.warn(message, FrametoolWarning, stacklevel=3)


@contextmanager
def heard_by(listener: Listener) -> Iterator[None]:
    """Pass the warnings of a block to a listener; outer listeners do not receive them."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.pop()


def overheard(
    call: Callable[..., Result], *arguments: object, **options: object
) -> tuple[Result, list[tuple[str, str]]]:
    """Call a function; return its result and its warnings as (rule, message), to which a reader adds the place."""
    warned: list[tuple[str, str]] = []
    _listeners.append(lambda message, rule: warned.append((rule, message)))
    try:  # without `heard_by`, which would cost half a microsecond for each of a million rotations
        return call(*arguments, **options), warned
    finally:
        _listeners.pop()


def did_you_mean(name: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return `; did you mean 'x'?` for the nearest known name, or nothing."""
    near = nearest(name, known, cutoff=cutoff)
    return f"; did you mean {shown(near[0])}?" if near else ""


def nearest(name: str, known: Iterable[str], *, cutoff: float = 0.6, behind: float = 0.2) -> list[str]:
    """Return the most similar known names, best first; an empty list if no name is similar.

    cutoff: least similarity, from 0 to 1; behind: the most that it may be below that of the best
    """
    from bisect import bisect
    from difflib import SequenceMatcher, get_close_matches

    name, known = name[:LONGEST_NAME], list(known)
    if len(known) > MOST_COMPARED:  # only the neighbours in alphabetical order, of the names and of the reversed names
        near: dict[str, None] = {}
        for step in (1, -1):
            texts = sorted(each[::step] for each in known)
            at = bisect(texts, name[::step])
            near |= dict.fromkeys(each[::step] for each in texts[max(at - NEIGHBOURS, 0) : at + NEIGHBOURS])
        known = [*near]
    found = get_close_matches(name, known, n=NEAREST, cutoff=cutoff)
    ratios = [SequenceMatcher(None, each, name).ratio() for each in found]
    return [each for each, ratio in zip(found, ratios, strict=True) if ratio >= ratios[0] - behind]


def any_near(name: str, known: Iterable[str], otherwise: str) -> str:
    """Return `; did you mean 'x' or 'y'?` for all near names, or else a hint."""
    near = nearest(name, known)
    return f"; did you mean {' or '.join(map(shown, near))}?" if near else f"; {otherwise}"


def alternatives(name: str, known: Iterable[str], label: str) -> str:
    """Return `; did you mean 'x'? frames: a, b`, or only the list."""
    names = list(known)
    return f"{did_you_mean(name, names) or ';'} {label}: {listing(names, near=name)}"


def listing(names: Iterable[str], most: int = 20, *, near: str = "") -> str:
    """Return the names sorted and joined by commas, shortened after `most`; then those nearest to a name come first."""
    from heapq import nsmallest

    everything = list(names)
    first = nearest(near, everything, cutoff=0.5, behind=1.0) if near and len(everything) > most + 1 else []
    rest = nsmallest(most + 1, (each for each in everything if each not in first) if first else everything)
    return first_of([*first, *rest], most, quote=bare, count=len(everything))


def first_of(
    names: Sequence[str], most: int, *, quote: Callable[[str], str] = str, gap: str = ", ", count: int | None = None
) -> str:
    """Return the first names, and the number of the others; all shortened lists are made by it.

    A single remaining name is listed instead of counted.
    count: the total number of names, if these are not all
    """
    count = len(names) if count is None else count
    most += count == most + 1
    return gap.join(map(quote, names[:most])) + f" and {count - most} more" * (count > most)


def bare(name: str) -> str:
    """Return a name for a list in a message: like `shown`, without quotes."""
    kept = _cut(name, printable)
    return printable(name) if kept == name else f"{printable(kept)}..."


def printable(name: str) -> str:
    """Return text on one line for a terminal: control characters are escaped, so that they have no effect."""
    if name.isprintable():
        return name
    return "".join(each if each.isprintable() else repr(each)[1:-1] for each in name)


def cells(text: str) -> int:
    """Return the width of a text on a terminal: wide characters count twice."""
    if text.isascii():
        return len(text)
    from unicodedata import combining, east_asian_width

    return sum(0 if combining(each) else 2 if east_asian_width(each) in "WF" else 1 for each in text)


def shown(value: object) -> str:
    """Return a value from the input for a message: on one line, within 60 characters, including escapes and quotes."""
    is_text = isinstance(value, str)
    text = str(value) if is_text else repr(value)
    quote = repr if is_text else str
    kept = _cut(text, quote)
    return quote(text) if kept == text else f"{quote(kept)}... ({len(text)} characters)"


def _cut(text: str, quote: Callable[[str], str]) -> str:
    """Return the beginning of a text that has at most 60 characters when quoted."""
    kept = text[:SHOWN]
    while len(quote(kept)) > SHOWN:
        kept = kept[:-1]
    return kept
