"""What commands share: the types of arguments, the options of inputs, results and times; adding them reads nothing.

Times are decimal seconds or nanoseconds, `latest`, ranges and files; they never pass through a float.
"""

from __future__ import annotations

import os
import re
import sys
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import click

from frametool.cli.group import INPUTS, Inputs, WithHelp, check_together, inputs, option
from frametool.cli.sink import checked_by
from frametool.cli.stderr import as_json, say, say_error, tell
from frametool.errors import FormatError, FrametoolError, ValueInvalid, did_you_mean, shown
from frametool.formats.table import CAMERA_AXES, DH, DIRECTIONS, FORMATS, ORDERS, readers, writers
from frametool.geometry.euler import AXES
from frametool.geometry.representations import NAMED_AXES, REPRESENTATIONS, notations
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.formats.load import Rules
    from frametool.grammar.result import Result

    Function = TypeVar("Function", bound=Callable[..., Any])

# an argument that begins like this is a number, whatever short options there are
NEGATIVE = r"(?i)-(\d|\.\d|inf(inity)?$|nan$|pi\b|[jk]$|[ijk] ?[-+].| +(Translation:|Rotation:|Pose \[)|--\s)"
STREAMED = ("records", "rows", "arrays")
READ = readers("tree", "records", "rows", "arrays", "joints", "drawing")
EXIT_CODES = "Exit codes: 0 done, 1 bad data, 2 usage, 3 rows skipped, 4 lookup, 5 file."


class Command(WithHelp):
    """A command whose arguments may be negative numbers.

    click takes `-1e-3` for options. A blank before each such argument keeps it from doing so without giving up its
    own check of misspelled options; `Text` takes the blank off again.
    """

    def make_parser(self, ctx: click.Context) -> Any:
        """Make click's parser; of an option of one value that stands there twice, the first would not be used."""
        parser: Any = super().make_parser(ctx)
        parse = parser.parse_args

        def parse_once(args: list[str]) -> Any:
            found = parse(args=args)
            told = [] if ctx.resilient_parsing else found[2]
            for each in told:
                if isinstance(each, click.Option) and not (each.multiple or each.is_flag) and told.count(each) > 1:
                    raise click.UsageError(f"{each.opts[-1]} is given twice; only one can be used", ctx)
            return found

        parser.parse_args = parse_once
        return parser

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Shield negative numbers (-j is an option where joints are), give bare options their values, then parse."""
        if any(map(_is_negative, args)):
            options = {name for each in self.get_params(ctx) for name in each.opts}
            args = [f" {each}" if _is_negative(each) and each not in options else each for each in args]
        if "inv" in args:
            args = _joined(args, ctx, always=self.name in OF_POSES)
        for name in {*OPTIONAL}.intersection(args):
            args = _with_value(args, name, *OPTIONAL[name])
        rest = super().parse_args(ctx, args)
        if not ctx.resilient_parsing:
            check_together(ctx)
        return rest

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command on its inputs, then say if --camera-axes was of no use: only a result shows that."""
        given = ctx.meta[INPUTS] = Inputs.of(ctx)
        with checked_by(given.refuse_idle):
            result = ctx.invoke(self.callback or (lambda _: 0), given)
        given.refuse_idle()
        _say_not_needed(given)
        return result

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """End every help with the exit codes, those of most commands unless its epilog says others."""
        formatter.write_paragraph()
        formatter.write_text(self.epilog or EXIT_CODES)


# options that may stand bare, and their values: the first is what they mean then
OPTIONAL = {"--explain": ("text", "markdown"), "--rows": ("ate", "rpe", "kitti")}


OF_POSES = ("compose", "convert", "interpolate", "invert", "mean", "relative")  # they have no other arguments


def _joined(args: list[str], ctx: click.Context, *, always: bool) -> list[str]:
    """Write the word `inv` before a pose as inv(POSE); before what may be no pose it is a name, unless `always`."""
    joined: list[str] = []
    for each in reversed(args):
        is_pose = bool(joined) and (always or joined[-1].lstrip(" ~").startswith(("{", "[", "inv(", "p[")))
        if each == "inv" and is_pose and not joined[-1].startswith("--"):
            joined.append(f"inv({joined.pop()})")
        elif each == "inv" and always:
            raise click.UsageError("inv stands before the pose whose inverse is meant; nothing follows it", ctx)
        else:
            joined.append(each)
    return joined[::-1]


def _is_negative(argument: str) -> bool:
    """Tell whether an argument begins as a number; most need no pattern for that, whose compiling takes longest."""
    is_long = argument[:2] == "--" and argument[2:3].isalpha()
    return argument[:1] == "-" and not is_long and re.match(NEGATIVE, argument) is not None


def _with_value(args: list[str], option: str, *values: str) -> list[str]:
    """Join an option with the value behind it, or its usual one: click would take any argument there for its value."""
    joined = []
    for before, each, behind in zip(["", *args], args, [*args[1:], ""], strict=False):
        if each == option:
            joined.append(f"{option}={behind if behind in values else values[0]}")
        elif before != option or each not in values:
            joined.append(each)
    return joined


class Text(click.types.StringParamType):
    """A text argument, without the blank that shields negative numbers; as a file's name it may hold any bytes."""

    name = "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ARG002
        """Remove the blank."""
        return value[1:] if value[:1] == " " and _is_negative(value[1:]) else value

    def offers(self, ctx: click.Context, incomplete: str) -> Mapping[str, str] | None:  # noqa: ARG002
        """Return what the shell may complete, and what it means; None for names of files, which the shell knows."""
        return {}

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Offer what begins as the incomplete word does."""
        from click.shell_completion import CompletionItem

        offered = self.offers(ctx, incomplete)
        if offered is None:
            return [CompletionItem(incomplete, type="file")]
        return [CompletionItem(word, help=about) for word, about in offered.items() if word.startswith(incomplete)]


class Utf8(Text):
    """Text that will be part of a result."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse bytes that are no text."""
        if any("\ud800" <= each <= "\udfff" for each in str(value)):
            self.fail(f"{shown(value)} is not UTF-8 text", param, ctx)
        return super().convert(value, param, ctx)


class File(Text):
    """A file's name."""

    name = "file"

    def offers(self, ctx: click.Context, incomplete: str) -> None:  # noqa: ARG002
        """Leave it to the shell."""
        return


class Parsed(Text):
    """A text that a function reads; what it refuses is a wrong value of the option."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        """Keep what it is called, and what reads it."""
        self.name = name
        self.parse = parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read it."""
        try:
            return self.parse(super().convert(value, param, ctx)) if isinstance(value, str) else value
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)


Number = partial(Parsed, "number", parse_number)  # finite, read as documents read theirs
FULL = -1  # digits: as many as the number has


class Digits(Text):
    """How many digits stand after the point: a number, or `full`."""

    name = "digits"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Take the word for all, or count."""
        return FULL if value in ("full", FULL) else click.IntRange(0, 30).convert(value, param, ctx)


class Notations(Text):
    """Names of representations, separated by commas."""

    name = "rep[,rep..]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
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

    def offers(self, ctx: click.Context, incomplete: str) -> Mapping[str, str]:  # noqa: ARG002
        """Offer names behind the last comma, and the axes of one that has its colon."""
        done, comma, begun = incomplete.rpartition(",")
        names = [*REPRESENTATIONS, *(f"{name}_deg" for name, row in REPRESENTATIONS.items() if row.angles)]
        spec = begun.partition(":")[0]
        if spec in names and REPRESENTATIONS[spec.removesuffix("_deg")].axes == NAMED_AXES:
            names += [f"{spec}:{axes}" for axes in ("all", *AXES)]
        return dict.fromkeys((done + comma + name for name in names), "")


class Form(Text):
    """The name of a form of text, of any or of those from which something is read."""

    name = "form"

    def __init__(self, names: Collection[str], are: str) -> None:
        """Keep the forms that may be named, and what they are in an error: `read`, `known`."""
        self.names = names
        self.are = are

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse an unknown one with the nearest name; of one that is not supported, say what to do."""
        if value not in self.names:
            _refuse_unsupported(self, value, param, ctx)
            near = did_you_mean(value, self.names)
            self.fail(f"no form {shown(value)} is {self.are}{near}; `frametool formats` lists all", param, ctx)
        return value

    def offers(self, ctx: click.Context, incomplete: str) -> Mapping[str, str]:  # noqa: ARG002
        """Offer the forms."""
        return {name: FORMATS[name].summary for name in self.names}


class WrittenForm(click.Choice[str]):
    """The form of a result, one of those that a command writes."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse an unknown one; of one that is not supported, say what to do."""
        if value not in self.choices:
            _refuse_unsupported(self, value, param, ctx)
        return super().convert(value, param, ctx)


def _refuse_unsupported(
    kind: click.ParamType[Any], value: Any, param: click.Parameter | None, ctx: click.Context | None
) -> None:
    from frametool.formats.unsupported import UNSUPPORTED

    if value in UNSUPPORTED:
        row = UNSUPPORTED[value]
        kind.fail(f"{value} ({row.summary}) is not supported: {row.remedy}", param, ctx)


class AxesName(Text):
    """A convention of axes, or the change from one to another: A_from_B."""

    name = "axes"

    def offers(self, ctx: click.Context, incomplete: str) -> Mapping[str, str]:  # noqa: ARG002
        """Offer the conventions; behind `_from_` those it may come from."""
        from frametool.geometry.conventions import AXES, MIRRORED, SYSTEMS

        begun, joint, _ = incomplete.partition("_from_")
        known = {name: about for name, (_, about) in (AXES | MIRRORED).items()} | dict.fromkeys(SYSTEMS, "")
        return {f"{begun}{joint}{name}" if joint else name: about for name, about in known.items() if name != begun}


class ColumnNames(Text):
    """Columns of the input, or keys of its records, with commas between them."""

    name = "name"

    def offers(self, ctx: click.Context, incomplete: str) -> Mapping[str, str]:
        """Offer those of the file that -i names."""
        done, comma, _ = incomplete.rpartition(",")
        path = ctx.params.get("input_path")
        path = path[0] if isinstance(path, tuple) and path else path
        found = _names_in(str(path)) if path and path != "-" else []
        return dict.fromkeys((done + comma + name for name in found), "")


def _names_in(path: str) -> list[str]:
    """Return the names of a table's columns, or the outermost keys of records; none for what cannot be read."""
    from frametool.documents.source import HEAD
    from frametool.formats.detect import Beginning, detect
    from frametool.stream.table import open_table

    try:
        with open(path, "rb") as file:
            head = file.read(HEAD)
        form, _ = detect(head, "rows", "records", name=path)
        if not FORMATS[form].is_table:
            return sorted(".".join(each) for each in Beginning(head).json_paths)
        return list(open_table(head, form, header=True, source=path)[0].names or ())
    except (OSError, FrametoolError):
        return []  # nothing to offer, and a completion must not print


TEXT = Text()
UTF8 = Utf8()
FILE = File()


def together(*options: Callable[[Any], Any]) -> Callable[[Function], Function]:
    """Return what adds several options to a command, in this order in its help."""

    def add(function: Function) -> Function:
        for add_option in reversed(options):
            function = add_option(function)
        return function

    return add


# --- inputs --------------------------------------------------------------------------------------------------------

verbose_option = option("-v", "--verbose", is_flag=True, help="say what each input was taken for")
in_option = option(
    "--in", "input_forms", type=Form(READ, "read"), multiple=True, metavar="FORM",
    help="form of the input (`frametool formats`), once a file",
)  # fmt: skip
_CAMERA_AXES = option(
    "--camera-axes", "camera_axes", type=click.Choice(CAMERA_AXES),
    help="what the axes of the cameras in a file are, which turns nothing  [default: those of its form]",
)  # fmt: skip
_STAMPS = option(
    "--stamps", "stamps", type=FILE, metavar="FILE", help="times of the poses of a form without, one a line"
)
_EDGES = option("--edges", "edges", is_flag=True, help="read the edges of a g2o graph instead of its vertices")
_TOPIC = option(
    "--topic", "topics", type=TEXT, multiple=True, metavar="NAME", help="read only this topic; may be repeated"
)
# of streams about trajectories: the topic of a bag, the times of their poses, the axes of cameras
pose_reading_options = together(_TOPIC, _CAMERA_AXES, _STAMPS, _EDGES)
_READING = (
    option("-j", "--joint", "joints", type=TEXT, multiple=True, metavar="NAME=VALUE",
             help="value of a joint of a robot: radians or metres, 30deg, 2cm, a POSE; may be repeated"),
    option("--joints", "joint_files", type=FILE, multiple=True, metavar="FILE",
             help="values of joints: a map, JointState messages, CSV, MJCF:KEY"),
    option("--frames", "named_frames", type=TEXT, multiple=True, metavar="WORLD,BODY",
             help="names of frames that a form does not name; may be repeated, in the order of the files"),
    option("--direction", "direction", type=click.Choice(DIRECTIONS),
             help="of matrices whose key does not say which frame they are seen from"),
    _CAMERA_AXES,
    option("--dh", "dh", type=click.Choice(DH), help="which Denavit-Hartenberg parameters a table holds"),
    _STAMPS,
)  # fmt: skip


_ORDER = option("--from", "order", type=click.Choice(ORDERS), help="order of quaternions in lists of numbers")


def reading_options(
    *, streams: bool = False, order: bool = True, topics: bool = True
) -> Callable[[Function], Function]:
    """Add to a command the options that say how files of frames are read; `opened` heeds them.

    streams: the command has those of streams too, `--in`, `--quiet` and `--from` among them
    order, topics: it has no --from, or --topic, of its own
    """
    if streams:
        return together(_TOPIC, *_READING)
    quiet = option("--quiet", "quiet", is_flag=True, help="no word on what files were taken for")
    return together(in_option, quiet, *[_TOPIC] * topics, *_READING, *[_ORDER] * order)


def input_forms(*, streams: bool = False) -> tuple[list[str], str]:
    """Return the forms that --in names for files of frames, in their order, and the form of the stream.

    streams: there is a stream; its form is the last one that can be streamed, "" if there is none
    """
    forms = list(inputs().input_forms)
    streamed = [at for at, form in enumerate(forms) if streams and not {*STREAMED}.isdisjoint(FORMATS[form].reads)]
    of_stream = forms.pop(streamed[-1]) if streamed else ""
    return forms, of_stream


def say_if_verbose(text: str) -> None:
    """Write a line on stderr if the command was called with -v."""
    if inputs().verbose:
        say(text)


def _say_not_needed(given: Inputs) -> None:
    """Say on stderr which options change nothing, where only what was read or is written shows whether they do."""
    forms = " and ".join(dict.fromkeys(form for form, _ in given.forms_read if form))
    for ask, chosen in (("frames", given.named_frames), ("camera_axes", given.camera_axes)):
        if chosen and not given.quiet and not any(ask in asks for _, asks in given.forms_read):
            why = f": {forms} does not leave that open" if forms else " here"
            say(f"note: --{ask.replace('_', '-')} changes nothing{why}")


# --- results -------------------------------------------------------------------------------------------------------

_PRECISION = option(
    "--precision", type=Digits(), metavar="N|full", help="digits after the point  [default: full; overviews 6]"
)
_PLACE = (
    option("-o", "--output", type=FILE, metavar="FILE", help="write this file, whole or not at all"),
    option("--force", is_flag=True, requires=("output", "report"), help="let --output replace a file"),
)


def _form_option(forms: Iterable[str], text: str) -> Callable[[Any], Any]:
    return option("-f", "--format", "format_name", type=WrittenForm(("text", *forms)), help=text)


MESSAGES = ("pose", "tf", "path", "point", "fix")


def parse_messages(text: str) -> tuple[str, ...]:
    """Read kinds of messages with commas between them; raises ValueInvalid."""
    kinds = tuple(dict.fromkeys(text.split(",")))
    if unknown := [each for each in kinds if each not in MESSAGES]:
        near = did_you_mean(unknown[0], MESSAGES)
        raise ValueInvalid(f"{shown(unknown[0])} is none of {', '.join(MESSAGES)}{near}")
    return kinds


_RECORDING = (
    option("--messages", "messages", type=Parsed("messages", parse_messages), metavar="KIND,..", default=(),
             help=f"messages of a recording: {', '.join(MESSAGES)}  [default: as the rows are]"),
    option("--topic-out", "topic_out", type=TEXT, metavar="NAME", help="the topic of a recording with one"),
)  # fmt: skip
# of commands that have no --frames for what they read
frames_out_option = option(
    "--frames", "recorded_frames", type=TEXT, metavar="WORLD,BODY",
    help="what the frames of poses in a recording are called; adds /tf",
)  # fmt: skip


def result_options(*what: str) -> Callable[[Function], Function]:
    """Add to a command the options that shape and place its result; `what` it writes decides the formats."""
    forms = writers(*what)
    recording = [] if set(forms).isdisjoint(writers("recording")) else _RECORDING
    return together(_form_option(forms, "form of the result"), _PRECISION, *recording, *_PLACE)


def list_options(*more: str) -> Callable[[Function], Function]:
    """Add to a command the options that shape and place a list for people, which is text wherever it goes.

    more: forms beside text and those of reports
    """
    return together(_form_option((*writers("report"), *more), "form of the result  [default: text]"), *_PLACE)


# how rotations are written
rotation_options = together(
    option(
        "--to", "notations", type=Notations(), metavar="REP[,REP..]",
        help="representations of the result  [default: quaternion]",
    ),
    option("--deg", is_flag=True, help="angles in degrees"),
    option("--keep-sign", is_flag=True, help="leave the quaternion's sign as it comes out"),
    option("--local-axes", "local_axes", type=click.Choice(("enu", "ned", "grid", "ecef")),
             help="what rotations at a place on the Earth are given in (help earth)"),
    option("--origin", "origin", type=TEXT, metavar="PLACE|first", help="where east north up 0 0 0 is"),
    option("--zone", "zone", type=TEXT, metavar="32N", help="the one zone of UTM"),
)  # fmt: skip
# how poses are read; commands have it with `rotation_options`
pose_options = option("--normalize", is_flag=True, help="take any non-zero quaternion, matrices off by 0.1")


scale_option = option("--scale", is_flag=True, help="take a matrix s R as a similarity of scale s")


def pose_result_options(*what: str) -> Callable[[Function], Function]:
    """Add to a command the options that say how poses are read, and those of its result."""
    return together(rotation_options, pose_options, result_options(*what))


# --- times ---------------------------------------------------------------------------------------------------------

LATEST = "latest"
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
        """Count one time, or several in a row; keep why they are left out if that will be reported."""
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
        from frametool.frames.stamps import NotATime

        try:
            return _stamp_ns(text)
        except ValueInvalid as error:
            self.fail(f"{error}{', or latest' if self.latest and isinstance(error, NotATime) else ''}", param, ctx)


def _stamp_ns(text: str) -> int:
    """Read a time in seconds, or in nanoseconds with `ns`."""
    from frametool.frames.stamps import parse_stamp, whole_stamp  # few calls say a time

    return whole_stamp(parse_stamp(text))


TIME = Time()


def at_ns(chosen: int | str | None) -> int | None:
    """Return the nanoseconds of an option; None for the latest."""
    return chosen if isinstance(chosen, int) else None


# how moving frames are taken
rules_options = together(
    option("--moving", is_flag=True, help="an edge with one stamp answers only that instant"),
    option(
        "--cache", type=Time(latest=False), metavar="SECONDS", help="forget what is older  [default: nothing]"
    ),
)
times_option = option(
    "--times", excludes=("explain",), type=TEXT, metavar="TIMES",
    help="many: T,T,.., START:STOP:STEP, or the stamps of FILE",
)
LIMIT = Time(latest=False)
offset_option = option(
    "--time-offset", "time_offset", type=LIMIT, metavar="SECONDS", help="add this to all stamps read"
)
limit_options = together(
    offset_option,
    option("--start", type=LIMIT, metavar="TIME", help="leave out what is before"),
    option("--stop", type=LIMIT, metavar="TIME", help="leave out what is after"),
)
# a command of files of frames; of one tree whose frames may move; and one that writes poses of it
file_options = together(reading_options(), verbose_option, pose_options)
moving_options = together(rules_options, offset_option, reading_options(order=False), verbose_option)
tree_options = together(moving_options, _ORDER, pose_options, rotation_options)
color_option = option(
    "--color", type=click.Choice(("auto", "always", "never")), default="auto", show_default=True,
    help="colour of the text; auto is on a terminal, and NO_COLOR is heeded",
)  # fmt: skip


def window_of(given: Inputs) -> tuple[int, int] | None:
    """Return the first and the last nanosecond that --start and --stop leave, None without either; nobody asks yet."""
    start, stop = given.peek("start"), given.peek("stop")
    if start is not None and stop is not None and start > stop:
        raise click.UsageError("--start is after --stop")
    if start is stop is None:
        return None
    from frametool.frames.stamps import FURTHEST_NS

    return -FURTHEST_NS if start is None else start, FURTHEST_NS if stop is None else stop


def rules(given: Inputs) -> Rules:
    """Collect what the options say about how frames are taken."""
    keep_ns = given.cache
    if keep_ns is not None and keep_ns < 0:
        raise click.UsageError("--cache takes seconds, not less than 0")
    from frametool.formats.load import Rules

    return Rules(moving=bool(given.moving), keep_ns=keep_ns, normalize=bool(given.normalize))


def read_times(text: str, report: Callable[[FormatError], None]) -> Sequence[int]:
    """Read START:STOP:STEP (seconds; STOP counts if a step meets it), T,T,.., or the stamps of a file or `-`, in order.

    report: takes the errors of lines that are no time.
    """
    if text.count(":") == 2:
        return _range(text)
    if re.match(r"[-+]?\.?\d", text) and not os.path.exists(text):
        return _listed(text)
    from frametool.stream.trajectories import read_stamps

    if text == "-" and sys.stdin is not None and sys.stdin.isatty():
        raise click.UsageError("standard input is a terminal; pipe something in")
    return read_stamps(text, report, say)


def _listed(text: str) -> list[int]:
    """Read times between commas."""
    try:
        return [_stamp_ns(part.strip()) for part in text.split(",")]
    except ValueInvalid as error:
        hint = "times are T,T,.. in seconds, START:STOP:STEP, or a file"
        raise click.UsageError(f"--times {shown(text)}: {error}; {hint}") from None


def _range(text: str) -> range:
    """Read START:STOP:STEP."""
    try:
        start, stop, step = map(_stamp_ns, text.split(":"))
    except ValueInvalid as error:
        raise click.UsageError(f"--times {text}: {error}; a range is START:STOP:STEP in seconds") from None
    if step <= 0 or stop < start:
        raise click.UsageError(f"--times {text}: STEP must be positive and STOP not before START")
    if (stop - start) // step >= MOST_TIMES:
        raise click.UsageError(f"--times {text} has more than {MOST_TIMES} times")
    return range(start, stop + 1, step)
