"""The errors frametool raises, with their exit codes, and the one way it warns.

    FrametoolError                                                   exit
      ValueInvalid     a number or name that cannot be               1
      FormatError      text that is not what it should be, with      1
                       its source, line and column
      BadTopology      cycle, two parents, a frame in itself         1
      LookupFailed                                                   4
        UnknownFrame   NotConnected
        NoDataAt       TooEarly  TooLate
      FileProblem      missing, unreadable, exists, full             5

The library raises; only the edge of the command line turns an error into a line on stderr.
"""

from __future__ import annotations

import warnings

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import TypeVar

    Result = TypeVar("Result")


class FrametoolError(Exception):
    """Any failure frametool reports; `exit_code` is the status its commands end with."""

    exit_code = 1


class ValueInvalid(FrametoolError, ValueError):
    """Report a number, rotation or name that cannot be used; `rule` is the rule of `check` that it breaks, if any."""

    rule = ""

    def __init__(self, message: str, *, rule: str = "") -> None:
        """Keep the rule beside the message."""
        super().__init__(message)
        self.rule = rule or self.rule


class FormatError(FrametoolError, ValueError):
    """Report text that cannot be read; say where: `source:line:column`, both counted from 1."""

    def __init__(
        self, message: str, *, source: str = "", line: int = 0, column: int = 0, snippet: str = "", rule: str = "",
    ) -> None:  # fmt: skip
        """Keep the place beside the message.

        snippet: the source line with a caret below it.  rule: the rule of `check` that is broken, if any.
        """
        super().__init__(message)
        self.message = message
        self.source = source
        self.line = line
        self.column = column
        self.snippet = snippet
        self.rule = rule

    def __str__(self) -> str:
        """Return `source:line:column: message`, leaving out what is not known."""
        place = [str(part) for part in (self.source, self.line, self.column) if part]
        return ": ".join((":".join(place), self.message)) if place else self.message


class BadTopology(FormatError):
    """Report frames that form no tree: a cycle, two parents, a frame in itself."""


class LookupFailed(FrametoolError, LookupError):
    """Report a lookup that has no answer."""

    exit_code = 4

    def __init__(self, message: str, **fields: object) -> None:
        """Keep what the message says as fields too, for those who do not read sentences."""
        super().__init__(message)
        self.fields = fields


class UnknownFrame(LookupFailed):
    """Report a frame that is not in the tree, with the nearest names and those there are."""

    def __init__(self, name: str, *, known: Iterable[str], where: str = "") -> None:
        """Compose the message from the name, the frames there are and the tree's name."""
        self.name = name
        self.known = tuple(known)
        place = f" in {where}" if where else ""
        message = f"unknown frame {name!r}{place}{alternatives(name, self.known, 'frames')}"
        super().__init__(message, frame=name, known=sorted(self.known)[:20])


class NotConnected(LookupFailed):
    """Report two frames that hang in different trees."""


class NoDataAt(LookupFailed):
    """Report an edge without data at the requested time."""


class TooEarly(NoDataAt):
    """Report a request before an edge's first sample."""


class TooLate(NoDataAt):
    """Report a request after an edge's last sample."""


class FileProblem(FrametoolError, OSError):
    """Report a file that is missing, unreadable, in the way or on a full disk."""

    exit_code = 5


class FrametoolWarning(UserWarning):
    """Mark what was read, used and is nevertheless worth a look."""


class Tf2Warning(FrametoolWarning):
    """Mark what tf2 would have logged, in its words."""


_listeners: list[list[tuple[str, str]]] = []


def warn(message: str, *, rule: str = "") -> None:
    """Tell of something odd that does not stop the work; `rule` is the rule of `check` that finds it, if any."""
    if _listeners:
        _listeners[-1].append((rule, message))
    else:
        warnings.warn(message, FrametoolWarning, stacklevel=3)


def overheard(
    call: Callable[..., Result], *arguments: object, **options: object
) -> tuple[Result, list[tuple[str, str]]]:
    """Return what a function returns, and its warnings as (rule, message), for a reader to add the place."""
    warned: list[tuple[str, str]] = []
    _listeners.append(warned)
    try:
        return call(*arguments, **options), warned
    finally:
        _listeners.pop()


def did_you_mean(name: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return `; did you mean 'x'?` for the nearest known name, or nothing."""
    from difflib import get_close_matches

    near = get_close_matches(name, list(known), n=1, cutoff=cutoff)
    return f"; did you mean {near[0]!r}?" if near else ""


def alternatives(name: str, known: Iterable[str], label: str) -> str:
    """Return `; did you mean 'x'? frames: a, b`, or only what there is."""
    names = list(known)
    return f"{did_you_mean(name, names) or ';'} {label}: {listing(names)}"


def listing(names: Iterable[str], most: int = 20) -> str:
    """Return the names sorted and joined by commas, cut after `most` of them."""
    ordered = sorted(names)
    more = f" and {len(ordered) - most} more" if len(ordered) > most else ""
    return ", ".join(map(printable, ordered[:most])) + more


def printable(name: str) -> str:
    """Return a name as a terminal may show it: control characters as escapes, so that none can steer it."""
    return name if name.isprintable() else repr(name)[1:-1]
