"""What all commands share: negative numbers as arguments, the options of every result, where it is written."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, TypeVar

import click

from frametool.cli.help_page import WithHelp
from frametool.cli.reuse import Reused
from frametool.cli.stderr import say
from frametool.errors import ValueInvalid, did_you_mean, shown
from frametool.formats import FORMATS, readers, writers
from frametool.geometry.euler import AXES
from frametool.geometry.representations import NAMED_AXES, REPRESENTATIONS, notations
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from frametool.geometry.representations import Notation

    Function = TypeVar("Function", bound=Callable[..., Any])

# an argument that begins like this is a number, whatever short options there are
NEGATIVE = re.compile(
    r"-(\d|\.\d|inf(inity)?$|nan$|pi\b|[jk]$|[ijk] ?[-+].| +(Translation:|Rotation:|Pose \[)|--\s)", re.IGNORECASE
)
STREAMED = ("records", "rows", "arrays")
READ = readers("tree", "records", "rows", "arrays", "joints")
EXIT_CODES = "Exit codes: 0 done, 1 bad data, 2 usage, 3 rows skipped, 4 lookup, 5 file."


class Command(WithHelp, Reused):
    """A command whose arguments may be negative numbers.

    click takes `-1e-3` for options. A blank before each such argument keeps it from doing so without giving up its
    own check of misspelled options; `Text` takes the blank off again.
    """

    exit_codes = EXIT_CODES

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Shield negative numbers (-j is an option where joints are), give a bare --explain its form, then parse."""
        if any(map(NEGATIVE.match, args)):
            options = {name for each in self.get_params(ctx) for name in each.opts}
            args = [f" {each}" if NEGATIVE.match(each) and each not in options else each for each in args]
        return super().parse_args(ctx, _with_form(args) if "--explain" in args else args)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """End every help with the exit codes."""
        super().format_epilog(ctx, formatter)
        formatter.write_paragraph()
        formatter.write_text(self.exit_codes)


def _with_form(args: list[str]) -> list[str]:
    """Join --explain with the form behind it, or with `text`: click would take any argument there for its value."""
    joined: list[str] = []
    for each in args:
        if joined and joined[-1] == "--explain":
            is_form = each in ("text", "markdown", "latex")
            joined[-1] = f"--explain={each if is_form else 'text'}"
            if is_form:
                continue
        joined.append(each)
    return [f"{each}=text" if each == "--explain" else each for each in joined]


class Text(click.ParamType[str]):
    """A text argument, without the blank that shields negative numbers; as a file's name it may hold any bytes."""

    name = "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ARG002
        """Remove the blank."""
        return value[1:] if value[:1] == " " and NEGATIVE.match(value[1:]) else value


class Utf8(Text):
    """Text that will be part of a result."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse bytes that are no text."""
        if any("\ud800" <= each <= "\udfff" for each in str(value)):
            self.fail(f"{shown(value)} is not UTF-8 text", param, ctx)
        return super().convert(value, param, ctx)


class File(Text):
    """A file's name, which the shell completes."""

    name = "file"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Leave it to the shell."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


class Number(Text):
    """A finite number."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read it as documents read theirs."""
        try:
            return parse_number(super().convert(value, param, ctx)) if isinstance(value, str) else value
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)


FULL = -1  # digits: as many as the number has


class Digits(Text):
    """How many digits stand after the point: a number, or `full`."""

    name = "digits"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Take the word for all, or count."""
        return FULL if value in ("full", FULL) else click.IntRange(0, 30).convert(value, param, ctx)


class Notations(click.ParamType["tuple[Notation, ...]"]):
    """Names of representations, separated by commas."""

    name = "rep[,rep..]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[Notation, ...]:
        """Look each name up."""
        if not isinstance(value, str):
            return tuple(value)
        try:
            chosen = tuple(form for spec in value.split(",") for form in notations(spec.strip()))
            for form in chosen:
                form.bound_axes()  # euler without its axes is refused before any work
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)
        return chosen

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Complete the last name of the list."""
        from click.shell_completion import CompletionItem

        done, comma, begun = incomplete.rpartition(",")
        names = [*REPRESENTATIONS, *(f"{name}_deg" for name, row in REPRESENTATIONS.items() if row.angles)]
        spec = begun.partition(":")[0]
        if spec in names and REPRESENTATIONS[spec.removesuffix("_deg")].axes == NAMED_AXES:
            names += [f"{spec}:{axes}" for axes in ("all", *AXES)]
        return [CompletionItem(done + comma + name) for name in names if name.startswith(begun)]


TEXT = Text()
UTF8 = Utf8()
FILE = File()
VERBOSE = "frametool.verbose"  # where a command's context keeps that -v was given


def _be_verbose(context: click.Context, _: click.Parameter, chosen: bool) -> None:
    context.meta[VERBOSE] = chosen


verbose_option = click.option(
    "-v", "--verbose", is_flag=True, expose_value=False, callback=_be_verbose,
    help="say what each input was taken for",
)  # fmt: skip


READING = "frametool.reading"  # where a command's context keeps the options about files of frames
TREES_OPENED = "frametool.trees_opened"  # set in a command's context once it reads files of frames
FORMS = "frametool.forms"  # where a command's context keeps those of --in


class Form(Text):
    """The name of a form of text, of any or of those from which something is read."""

    name = "form"

    def __init__(self, names: Collection[str], are: str) -> None:
        """Keep the forms that may be named, and what they are in an error: `read`, `known`."""
        self.names = names
        self.are = are

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse what is none, with the nearest name; of a form that is known and not read, say what to do."""
        if value not in self.names:
            self.fail(self._problem(value), param, ctx)
        return value

    def _problem(self, value: str) -> str:
        if value in FORMATS and (instead := FORMATS[value].instead):
            return f"{value} ({FORMATS[value].summary}) is not read: {instead}"
        near = did_you_mean(value, self.names)
        return f"no form {shown(value)} is {self.are}{near}; `frametool formats` lists all"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Offer the forms."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(name, help=FORMATS[name].summary) for name in self.names if name.startswith(incomplete)]


def _keep_forms(context: click.Context, _: click.Parameter, chosen: Sequence[str]) -> None:
    context.meta[FORMS] = chosen


def forms_told(*, streams: bool = False) -> tuple[list[str], str]:
    """Return the forms that --in names for files of frames, in their order, and the form of the stream.

    streams: there is a stream; its form is the last one that can be streamed, "" if there is none
    """
    context = click.get_current_context(silent=True)
    told = [] if context is None else list(context.meta.get(FORMS, ()))
    streamed = [form for form in told if streams and not {*STREAMED}.isdisjoint(FORMATS[form].reads)]
    if not streamed:
        return told, ""
    last = len(told) - 1 - told[::-1].index(streamed[-1])
    return told[:last] + told[last + 1 :], streamed[-1]


in_option = click.option(
    "--in", "input_forms", type=Form(READ, "read"), multiple=True, metavar="FORM", expose_value=False,
    callback=_keep_forms,
    help="form of the input (`frametool formats`), once a file",
)  # fmt: skip


def say_if_verbose(text: str) -> None:
    """Write a line on stderr if the command was called with -v."""
    context = click.get_current_context(silent=True)
    if context is not None and context.meta.get(VERBOSE):
        say(text)


_PRECISION = click.option(
    "--precision", type=Digits(), metavar="N|full",
    help="digits after the point  [default: full; overviews 6]",
)  # fmt: skip
_PLACE = (
    click.option("-o", "--output", type=FILE, metavar="FILE", help="write this file, whole or not at all"),
    click.option("--force", is_flag=True, help="let --output replace a file"),
)


def result_options(*what: str) -> Callable[[Function], Function]:
    """Add to a command the options that shape and place its result; `what` it writes decides the formats."""
    form = click.option(
        "-f", "--format", "format_name", type=click.Choice(("text", *writers(*what))),
        help="form of the result",
    )  # fmt: skip
    return lambda function: decorated(function, (form, _PRECISION, *_PLACE))


def list_options(*more: str) -> Callable[[Function], Function]:
    """Add to a command the options that shape and place a list for people, which is text wherever it goes.

    more: forms beside text and those of reports
    """
    form = click.option(
        "-f", "--format", "format_name", type=click.Choice(("text", *writers("report"), *more)),
        help="form of the result  [default: text]",
    )  # fmt: skip
    return lambda function: decorated(function, (form, *_PLACE))


def rotation_options(function: Function) -> Function:
    """Add to a command the options that choose how rotations are written."""
    return decorated(
        function,
        [
            click.option(
                "--to",
                "notations",
                type=Notations(),
                metavar="REP[,REP..]",
                help="representations of the result  [default: quaternion]",
            ),
            click.option("--deg", is_flag=True, help="angles in degrees"),
            click.option(
                "--keep-sign", is_flag=True, help="leave the quaternion's sign as it comes out"
            ),
        ],
    )


def pose_options(function: Function) -> Function:
    """Add to a command the options that say how poses are read; they come beside `rotation_options`."""
    return click.option(
        "--normalize", is_flag=True, help="take any non-zero quaternion, any near rotation"
    )(function)


def decorated(function: Function, options: Sequence[Callable[[Any], Any]]) -> Function:
    """Add several options to a command, in this order in its help."""
    for option in reversed(options):
        function = option(function)
    return function
