"""Times on the command line: decimal seconds or nanoseconds, `latest`, ranges and files; never through a float."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Text, decorated
from frametool.errors import FormatError, ValueInvalid
from frametool.formats.assembly import Rules
from frametool.frames.stamps import parse_stamp

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeVar

    Function = TypeVar("Function", bound=Callable[..., Any])

LATEST = "latest"
POLICIES = ("ros1", "ros2")
MOST_TIMES = 100_000_000


class Time(Text):
    """A time in seconds, or in nanoseconds with `ns`; `latest` where that is a choice."""

    name = "time"

    def __init__(self, *, latest: bool = True) -> None:
        """Keep whether `latest` is a choice."""
        self.latest = latest

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return nanoseconds, or `latest`."""
        text = super().convert(value, param, ctx)
        if not isinstance(text, str) or (self.latest and text == LATEST):
            return text
        try:
            return parse_stamp(text)
        except ValueInvalid as error:
            self.fail(f"{error}{', or latest' if self.latest and 'write' in str(error) else ''}", param, ctx)


TIME = Time()


def at_ns(chosen: int | str | None) -> int | None:
    """Return the nanoseconds of an option; None for the latest."""
    return chosen if isinstance(chosen, int) else None


def rules_options(function: Function) -> Function:
    """Add to a command the options that say how moving frames are taken."""
    options = [
        click.option("--moving", is_flag=True,
                     help="an edge with one stamp answers only that instant, as in tf2  [default: it stands still]"),
        click.option("--cache", type=Time(latest=False), metavar="SECONDS",
                     help="keep only so much before each frame's newest sample, as tf2 does  [default: everything]"),
        click.option("--tf2", type=click.Choice(POLICIES),
                     help="accept, refuse and complain as tf2 does; implies --cache 10"),
    ]  # fmt: skip
    return decorated(function, options)


def rules(*, moving: bool, cache: int | None, tf2: str | None) -> Rules:
    """Settle how moving frames are taken."""
    if cache is not None and cache < 0:
        raise click.UsageError("--cache takes seconds, not less than 0")
    return Rules(moving=moving, policy=tf2 or "frametool", keep_ns=cache)


def read_times(text: str) -> list[int] | range:
    """Read START:STOP:STEP (seconds; STOP counts if a step meets it), or the lines of a file or `-`, in order.

    Empty lines and those that begin with `#` are passed over.  Raises FormatError with the line.
    """
    from frametool.cli.poses import source_of

    if text.count(":") == 2:
        return _range(text)
    source = source_of(text)
    times = []
    for number, line in enumerate(source.text.splitlines(), 1):
        if (stripped := line.strip()) and not stripped.startswith("#"):
            try:
                times.append(parse_stamp(stripped))
            except ValueInvalid as error:
                raise FormatError(str(error), source=source.name, line=number) from None
    if not times:
        raise FormatError("no times in it; write one a line", source=source.name)
    return times


def _range(text: str) -> range:
    """Read START:STOP:STEP."""
    try:
        start, stop, step = map(parse_stamp, text.split(":"))
    except ValueInvalid as error:
        raise click.UsageError(f"--times {text}: {error}; a range is START:STOP:STEP in seconds") from None
    if step <= 0 or stop < start:
        raise click.UsageError(f"--times {text}: STEP must be positive and STOP not before START")
    if (stop - start) // step >= MOST_TIMES:
        raise click.UsageError(f"--times {text} has more than {MOST_TIMES} times")
    return range(start, stop + 1, step)


times_option = click.option(
    "--times", type=TEXT, metavar="FILE|START:STOP:STEP",
    help="many times: one a line, or a range in seconds, STOP included where a step meets it",
)  # fmt: skip
