"""Times on the command line: decimal seconds or nanoseconds, `latest`, ranges and files; never through a float."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Text, decorated
from frametool.cli.error_json import as_json
from frametool.cli.stderr import say_error, tell
from frametool.errors import FormatError, FrametoolError, ValueInvalid, shown
from frametool.formats.assembly import Rules
from frametool.frames.stamps import NotATime, parse_stamp, whole_stamp

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import TypeVar

    from frametool.grammar.result import Result

    Function = TypeVar("Function", bound=Callable[..., Any])

LATEST = "latest"
POLICIES = ("ros1", "ros2")
MOST_TIMES = 100_000_000
MOST_TOLD = 10  # times without a result


class TimesSkipped(FrametoolError):
    """Report how many of the times asked for have no result."""

    exit_code = 3


class Skipped:
    """Times that are left out: the first are reported, all are counted."""

    def __init__(self, *, in_json: bool) -> None:
        """Create an empty count; `in_json` says how errors are written."""
        self.in_json = in_json
        self.errors: list[FrametoolError] = []
        self.count = 0
        self.found = 0

    @property
    def is_full(self) -> bool:
        """Return whether further errors are only counted."""
        return len(self.errors) >= MOST_TOLD

    def add(self, error: FrametoolError | None, count: int = 1) -> None:
        """Count one time, or several in a row; keep why they are left out, if that is told and will be reported."""
        self.count += count
        if error is not None and not self.is_full:
            self.errors.append(error)

    def counted(self, results: Iterator[Result]) -> Iterator[Result]:
        """Yield results and count them."""
        for result in results:
            self.found += 1
            yield result

    def finish(self) -> int:
        """Report what was left out; return the exit status."""
        if not self.count:
            return 0
        for error in self.errors:
            tell(as_json(error) if self.in_json else f"frametool: {error} (skipped)")
        asked = self.found + self.count
        total = TimesSkipped(f"{self.count} of {asked} times skipped", skipped=self.count, asked=asked)
        say_error(total, in_json=self.in_json)
        return total.exit_code


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
            return whole_stamp(parse_stamp(text))
        except NotATime as error:
            self.fail(f"{error}{', or latest' if self.latest else ''}", param, ctx)
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)


TIME = Time()


def at_ns(chosen: int | str | None) -> int | None:
    """Return the nanoseconds of an option; None for the latest."""
    return chosen if isinstance(chosen, int) else None


def rules_options(function: Function) -> Function:
    """Add to a command the options that say how moving frames are taken."""
    options = [
        click.option("--moving", is_flag=True,
                     help="an edge with one stamp answers only that instant"),
        click.option("--cache", type=Time(latest=False), metavar="SECONDS",
                     help="forget what is older  [default: nothing]"),
        click.option("--tf2", type=click.Choice(POLICIES),
                     help="take, refuse and complain as tf2 does"),
    ]  # fmt: skip
    return decorated(function, options)


def rules(*, moving: bool, cache: int | None, tf2: str | None, normalize: bool = False) -> Rules:
    """Collect what the options say about how frames are taken."""
    if tf2 is not None and normalize:
        raise click.UsageError("--tf2 takes rotations as tf2 does; leave --normalize out")
    if cache is not None and cache < 0:
        raise click.UsageError("--cache takes seconds, not less than 0")
    return Rules(moving=moving, policy=tf2 or "frametool", keep_ns=cache, normalize=normalize)


def read_times(text: str, report: Callable[[FormatError], None]) -> Sequence[int]:
    """Read START:STOP:STEP (seconds; STOP counts if a step meets it), T,T,.., or the lines of a file or `-`, in order.

    Empty lines and those that begin with `#` are passed over.
    report: takes the errors of lines that are no time.
    """
    from frametool.cli.poses import source_of

    if text.count(":") == 2:
        return _range(text)
    if re.match(r"[-+]?\.?\d", text) and not os.path.exists(text):
        return _listed(text)
    source = source_of(text)
    times: list[int] = []
    bad = 0
    for number, line in enumerate(source.text.splitlines(), 1):
        if (stripped := line.strip()) and not stripped.startswith("#"):
            try:
                times.append(whole_stamp(parse_stamp(stripped)))
            except ValueInvalid as error:
                bad += 1
                report(FormatError(str(error), source=source.name, line=number))
    if not times and not bad:
        raise FormatError("no times in it; write one a line", source=source.name)
    return times


def _listed(text: str) -> list[int]:
    """Read times between commas."""
    try:
        return [whole_stamp(parse_stamp(part.strip())) for part in text.split(",")]
    except ValueInvalid as error:
        hint = "times are T,T,.. in seconds, START:STOP:STEP, or a file"
        raise click.UsageError(f"--times {shown(text)}: {error}; {hint}") from None


def _range(text: str) -> range:
    """Read START:STOP:STEP."""
    try:
        start, stop, step = (whole_stamp(parse_stamp(part)) for part in text.split(":"))
    except ValueInvalid as error:
        raise click.UsageError(f"--times {text}: {error}; a range is START:STOP:STEP in seconds") from None
    if step <= 0 or stop < start:
        raise click.UsageError(f"--times {text}: STEP must be positive and STOP not before START")
    if (stop - start) // step >= MOST_TIMES:
        raise click.UsageError(f"--times {text} has more than {MOST_TIMES} times")
    return range(start, stop + 1, step)


times_option = click.option(
    "--times", type=TEXT, metavar="TIMES",
    help="many: T,T,.., START:STOP:STEP, or FILE, one a line",
)  # fmt: skip
