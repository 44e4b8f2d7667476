"""Common types of arguments, and options of inputs, results and times; importing this module reads no file.

Times are decimal seconds or nanoseconds, `latest`, ranges and files; they never pass through a float.
"""

from __future__ import annotations

import os
import re
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Inputs, Text, misuse, option, refuse, say_if_typed, together
from frametool.cli.sink import encoded
from frametool.errors import SHOWN, FormatError, ValueInvalid, did_you_mean, shown
from frametool.formats.table import CAMERA_AXES, DH, DIRECTIONS, FORMATS, ORDERS, readers, writers
from frametool.geometry.euler import AXES
from frametool.geometry.representations import NAMED_AXES, REPRESENTATIONS, WORLDS, Notation, notation, notations
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from frametool.cli.command import Adds

STREAMED = ("records", "rows", "arrays")
READ = readers("tree", "records", "rows", "arrays", "joints", "drawing")


def utf8(text: str) -> str:
    """Return text that becomes part of a result unchanged; raises ValueInvalid for bytes that are not UTF-8."""
    encoded(text)
    return text


def read_names(text: str, spec: str = "") -> tuple[str, ...]:
    """Parse names separated by commas.

    spec: an example like REF,EST with the required number of different names
    """
    names = tuple(name.strip() for name in text.split(",")) if text else ()
    if not all(names):
        raise ValueInvalid(f"{shown(text)} is not names with commas between them")
    if spec and (len({*names}) < len(names) or len(names) != spec.count(",") + 1):
        raise ValueInvalid(f"{shown(text)} is not {spec}, different names")
    return names


FULL = -1  # --precision full: as many digits as the number has
OF_EARTH = ("origin", "local_axes", "zone")  # options on geodetic positions


def _with_axes(chosen: Notation) -> Notation:
    """Return a representation unchanged; raises ValueInvalid for euler without axes, before anything is read."""
    chosen.bound_axes()
    return chosen


def _read_notations(text: str) -> tuple[Notation, ...]:
    """Parse representations separated by commas."""
    return tuple(_with_axes(each) for spec in text.split(",") for each in notations(spec.strip()))


def _offer_notations(_ctx: click.Context, incomplete: str) -> Mapping[str, str]:
    """Offer names after the last comma, and the axes after a colon."""
    done, comma, begun = incomplete.rpartition(",")
    names = [*REPRESENTATIONS, *(f"{name}_deg" for name, row in REPRESENTATIONS.items() if row.angles)]
    spec = begun.partition(":")[0]
    if spec in names and REPRESENTATIONS[spec.removesuffix("_deg")].axes == NAMED_AXES:
        names += [f"{spec}:{axes}" for axes in ("all", *AXES)]
    names += [f"heading_deg:{axes}" for axes in WORLDS]
    return dict.fromkeys((done + comma + name for name in names), "")


NOTATIONS = Text(_read_notations, _offer_notations)
NOTATION = Text(lambda text: _with_axes(notation(text.strip())), _offer_notations)


def format_among(choices: Collection[str], are: str) -> Text:
    """Return the parameter type of a format name, with the formats that a command reads or writes.

    are: what the choices are, for errors: `read`, `known`
    """

    def read(text: str) -> str:
        if text in choices:
            return text
        from frametool.formats.detect import UNSUPPORTED

        if row := UNSUPPORTED.get(text):
            raise ValueInvalid(f"{text} ({row.summary}) is not supported: {row.remedy}")
        near = did_you_mean(text, choices)
        raise ValueInvalid(f"no format {shown(text)} is {are} (`frametool formats` lists all){near}")

    meanings = {name: FORMATS[name].summary if name in FORMATS else "for people" for name in choices}
    return Text(read, lambda _ctx, _incomplete: meanings, choices)


def suffix_of(path: str) -> str:
    """Return a file's suffix in lower case."""
    return os.path.splitext(path)[1].lower()


def read_path(path: str, suffixes: Collection[str]) -> str:
    """Return a file name unchanged; raises ValueInvalid unless it ends in one of the suffixes."""
    if suffix_of(path) not in suffixes:
        raise ValueInvalid(f"{shown(path)} does not end in {' or '.join(suffixes)}")
    return path


def _offer_axes(_ctx: click.Context, incomplete: str) -> Mapping[str, str]:
    """Offer the axis conventions, also after `_from_`."""
    from frametool.geometry.conventions import AXES, MIRRORED, SYSTEMS

    begun, joint, _ = incomplete.partition("_from_")
    known = {name: about for name, (_, about) in (AXES | MIRRORED).items()} | dict.fromkeys(SYSTEMS, "")
    return {f"{begun}{joint}{name}" if joint else name: about for name, about in known.items() if name != begun}


AXIS = Text(offers=_offer_axes)


def _offer_columns(ctx: click.Context, incomplete: str) -> Mapping[str, str]:
    """Offer the columns, or keys, of the file of -i."""
    from frametool.documents.source import HEAD
    from frametool.formats.detect import Beginning, detect
    from frametool.rows.sources.tables import open_table

    path = ctx.params.get("input_path") or ""
    path = path if isinstance(path, str) else path[0]
    with open(path, "rb") as file:
        head = file.read(HEAD)
    fmt = detect(head, "rows", "records", name=path)
    names = sorted(path.replace("/", ".") for path in Beginning(head).json_paths)
    if FORMATS[fmt].is_table:
        names = list(open_table(head, fmt, header=True, source=path)[0].names or ())
    done, comma, _ = incomplete.rpartition(",")
    return dict.fromkeys((done + comma + name for name in names), "")


COLUMN = Text(offers=_offer_columns)


def tree_on_the_line(ctx: click.Context) -> str | None:
    """Return the first file of frames, also from arguments that click has not parsed yet."""
    named = ctx.params.get("files") or ctx.params.get("arguments") or ctx.args
    return ctx.params.get("tree") or ctx.params.get("recording") or next(iter(named), None)


def _offer_joints(ctx: click.Context, incomplete: str) -> Mapping[str, str]:
    """Offer the joints of the robot with their limits; after the = the limits."""
    from frametool.formats.load import load

    robots = load(tree_on_the_line(ctx) or "").robots
    joints = [joint for _, links, _ in robots for link in links for joint in link.joints]
    ends = {each.name: [str(end) for end in (each.lower, each.upper) if end is not None] for each in joints}
    name, equals, _ = incomplete.partition("=")
    if equals:
        return {f"{name}={end}": "a limit" for end in ends.get(name, ())}
    return {f"{each}=": " .. ".join(both) for each, both in ends.items()}


JOINT = Text(offers=_offer_joints)


# --- inputs --------------------------------------------------------------------------------------------------------

_of_files, _of_times, _of_rotations, _of_results, _of_formats = (
    partial(option, under=heading) for heading in ("Files", "Time", "Rotations", "Result", "Formats")
)
verbose_option = _of_files("-v --verbose", "report the detected format of each input")
_IN = "format of the input (`frametool formats`), once per file"
in_option = _of_files("--in FORM", _IN, format_among(READ, "read"), name="input_formats", multiple=True)
_AXES = "axes of the cameras in a file; converts nothing  [default: those of its format]"
_CAMERA_AXES = _of_formats("--camera-axes", _AXES, CAMERA_AXES)
_STAMPS = _of_formats("--stamps FILE", "timestamps for poses without any, one per line")
_EDGES = _of_formats("--edges", "read the edges of a g2o graph instead of its vertices")
_TOPIC = _of_files("--topic NAME", "read only this topic; may be repeated", name="topics", multiple=True)
# for streams of poses: the topic of a bag, timestamps, axes of cameras
pose_reading_options = together(_TOPIC, _CAMERA_AXES, _STAMPS, _EDGES)
# options on how files of frames are read, used by `trees.opened`
reading_options = together(
    in_option,
    _TOPIC,
    _of_files("--quiet", "suppress notes on files"),
    _of_formats("-j --joint NAME=VALUE", "value of a robot's joint: radians or metres, 30deg, 2cm, a POSE; "
              "may be repeated", JOINT, name="joints", multiple=True),
    _of_formats("--joints FILE", "joint values: a map, JointState messages, CSV, MJCF:KEY", name="joint_files",
              multiple=True),
    _of_formats("--frames WORLD,BODY", "frame names that a format does not store; may be repeated, "
              "in the order of the files", read_names, name="named_frames", multiple=True),
    _of_formats("--direction", "direction of matrices whose key does not say it", DIRECTIONS),
    _CAMERA_AXES,
    _of_formats("--dh", "convention of Denavit-Hartenberg parameters", DH),
    _STAMPS,
    _of_formats("--from", "order of quaternions in lists of numbers", ORDERS, name="order"),
)  # fmt: skip


def take_stream_format(formats: list[str]) -> str:
    """Remove the stream's format, the last one that can be streamed, from those of --in; return it, or ""."""
    for at in reversed(range(len(formats))):
        if not {*STREAMED}.isdisjoint(FORMATS[formats[at]].reads):
            return formats.pop(at)
    return ""


def for_each(formats: Sequence[str], files: int) -> list[str]:
    """Return the format of each file by --in; the last one is repeated; "" without --in."""
    refuse(len(formats) > files, f"--in appears {len(formats)} times for {files} file{'s' * (files != 1)}")
    return [*formats, *([*formats[-1:]] or [""]) * (files - len(formats))]


# --- results -------------------------------------------------------------------------------------------------------

PRECISION = _of_results("--precision N|full", "decimals  [default: full; a terminal shows 9 digits]",
                        lambda text: FULL if text == "full" else click.IntRange(0, 30)(text))  # fmt: skip
place_options = together(
    _of_results("-o --output FILE", "write to this file, atomically"),
    _of_results("--force", "let --output overwrite a file", requires=("output", "report", "plot", "view")),
)
MESSAGES = ("pose", "tf", "path", "point", "fix")


def parse_messages(text: str) -> tuple[str, ...]:
    """Parse kinds of messages separated by commas; raises ValueInvalid."""
    kinds = tuple(dict.fromkeys(text.split(",")))
    if unknown := [each for each in kinds if each not in MESSAGES]:
        near = did_you_mean(unknown[0], MESSAGES)
        raise ValueInvalid(f"{shown(unknown[0])} is none of {', '.join(MESSAGES)}{near}")
    return kinds


_RECORDING = together(
    _of_results("--messages KIND,..", f"message types of a recording: {', '.join(MESSAGES)}  [default: by the rows]",
                parse_messages, default=()),
    _of_results("--topic-out NAME", "topic of the messages of a recording"),
)  # fmt: skip
# for commands whose --frames is not about the input
_FRAMES_OUT = "names of the frames of poses in a recording; adds /tf"
frames_out_option = _of_results("--frames WORLD,BODY", _FRAMES_OUT, partial(read_names, spec="WORLD,BODY"),
                                name="recorded_frames")  # fmt: skip


def result_options(*what: str) -> Adds:
    """Return the options on the result of a command; the kinds of results in `what` determine the formats."""
    formats = writers(*what)
    recording = [_RECORDING] * (not set(formats).isdisjoint(writers("recording")))
    kind = format_among(("text", *formats), "written here")
    chosen = option("-f --format FORMAT", "of the result (frametool formats)", kind, name="format_name")
    return together(chosen, place_options, PRECISION, *recording)


def list_options(*more: str) -> Adds:
    """Return the options on the result of a command that prints a list; the default format is text.

    more: formats other than text and those of reports
    """
    formats = "text", *writers("report"), *more
    return together(option("-f --format", "of the result  [default: text]", formats, name="format_name"), place_options)


rotation_options = together(
    _of_rotations("--to REP[,REP..]", "representations of the result  [default: quaternion]", NOTATIONS,
                  name="notations"),
    _of_rotations("--deg", "angles in degrees"),
    _of_rotations("--keep-sign", "do not normalize the quaternion's sign to w >= 0"),
    _of_rotations("--local-axes", "axes of rotations at a position on the Earth (help earth)",
                  ("enu", "ned", "grid", "ecef")),
    _of_rotations("--origin PLACE|first", "position of east north up 0 0 0, as LAT,LON[,ALT]"),
    _of_rotations("--zone 32N", "UTM zone for all positions"),
)  # fmt: skip
pose_options = _of_rotations("--normalize", "accept any non-zero quaternion, matrices off by 0.1")
scale_option = option("--scale", "read a matrix s R as a similarity with scale s")


def pose_result_options(*what: str) -> Adds:
    """Return the options on reading poses and on the result of a command."""
    return together(rotation_options, pose_options, result_options(*what))


# --- times ---------------------------------------------------------------------------------------------------------



def read_limit(text: str) -> int:
    """Parse a time in seconds, or in nanoseconds with `ns`, to nanoseconds."""
    from frametool.frames.stamps import parse_time  # few calls have a time

    return parse_time(text)


def read_span(text: str) -> int:
    """Parse a duration to nanoseconds; raises ValueInvalid for a negative one."""
    found = read_limit(text)
    if found < 0:
        raise ValueInvalid(f"a time here is not less than 0, found {shown(text)}")
    return found


def read_rate(text: str) -> float:
    """Parse a rate in Hz."""
    from frametool.frames.lookups import checked_rate

    return checked_rate(parse_number(text))


def read_time(text: str) -> Any:
    """Parse a time to nanoseconds, or `latest`."""
    if text == "latest":
        return text
    try:
        return read_limit(text)
    except ValueInvalid as error:
        raise ValueInvalid(f"{error}" + ", or latest" * ("is not a time" in str(error))) from None


def parser(module: str, name: str) -> Callable[[str], Any]:
    """Return a parser that calls a function of a module, which is imported at the first call."""
    return lambda text: getattr(import_module(module), name)(text)  # noqa: PLW0108 - later


def _offset(text: str) -> Any:
    """Parse an offset to nanoseconds, or `first`, which shifts the first time to 0."""
    from frametool.frames.stamps import FromFirst

    return FromFirst() if text == "first" else read_limit(text)


# options of a tree: more files, and the meaning of moving frames
rules_options = together(
    _of_files("--with FILE", "merge this tree too; may be repeated", name="more", multiple=True),
    _of_times("--moving", "an edge with one timestamp is valid only at that time"),
    _of_times("--cache SECONDS", "drop older transforms  [default: none]", read_span),
)
_TIMES = "several: T,T,.., START:STOP:STEP, or the stamps of FILE"
times_option = _of_times("--times TIMES", _TIMES, excludes=("explain",))
_OFFSET = "add this to all timestamps read; first: start at 0"
offset_option = _of_times("--time-offset SECONDS|first", _OFFSET, _offset)
limit_options = together(
    _of_times("--start TIME", "ignore everything before", read_limit),
    _of_times("--stop TIME", "ignore everything after", read_limit),
    offset_option,
)
# for commands that read several files of frames, and for commands that read one tree, which may move
file_options = together(reading_options, verbose_option, pose_options)
moving_options = together(rules_options, offset_option, reading_options, verbose_option)


_COLOR = "colour of the text; auto: on terminals, unless NO_COLOR is set"
color_option = _of_results("--color", _COLOR, ("auto", "always", "never"), default="auto")


def window_of(passed: Inputs) -> tuple[int, int] | None:
    """Return the first and last nanosecond of --start and --stop, None without both; does not mark them as used."""
    start, stop = passed.peek("start"), passed.peek("stop")
    refuse(start is not None and stop is not None and start > stop, "--start is after --stop")
    if start is stop is None:
        return None
    from frametool.frames.stamps import FURTHEST_NS

    return -FURTHEST_NS if start is None else start, FURTHEST_NS if stop is None else stop


def read_times(text: str, report: Callable[[FormatError], None]) -> Sequence[int]:
    """Return the times of START:STOP:STEP (seconds; STOP is included if a step meets it), T,T,.., a file or `-`.

    report: called with the errors of lines that are not a time
    """
    if text.count(":") == 2 or (re.match(r"[-+]?\.?\d", text) and not os.path.exists(text)):
        from frametool.frames.stamps import parse_times

        with misuse(f"--times {text}: "):
            return parse_times(text)
    from frametool.rows.trajectories import read_stamps

    say_if_typed(text)
    return read_stamps(text, report)


# --- misuse --------------------------------------------------------------------------------------------------------

# removed option (also after its command, or with a value) or subcommand -> what to use instead
REPLACED = {
    "--jobs": "split the input, `split -n l/8 ROWS part. && ls part.* | xargs -P 8 -I{} frametool .. -i {} -o {}.out`",
    "sim sweep": 'a loop in Python over `frametool.simulate(..)` of `FollowController("ros1", gain_linear=2)`',
    "view --live": "the page plays what moves, `frametool view TREE --open`",
    "--explain=latex": "--explain=markdown has the formulas as LaTeX; pandoc makes a document of it",
    "view --sliders": "a robot's page has its sliders; --no-sliders leaves them out",
    "compare --end": "--stop says the same",
    "align --end": "--stop says the same",
    "--tf2": "numbers are tf2's anyway; --cache 10 keeps as much as its buffer, --moving reads one stamp as it does",
    "--explain-full": "--explain writes every product",
    "--array": 'NPZ is not read; one NPY for each array, `numpy.save("NEW.npy", numpy.load("OLD.npz")["NAME"])`',
}


def replacement(arguments: Sequence[str]) -> str | None:
    """Return the message about the first removed option or subcommand on a command line, None without one."""
    for word in arguments:
        option = word.partition("=")[0]
        for name in (option, word, f"{arguments[0]} {option}"):
            if name in REPLACED:
                return f"{name} is gone: {REPLACED[name]}"
    return None


def usage_sentence(error: click.ClickException, arguments: Sequence[str]) -> str:
    """Return a usage error as one line with a pointer to the help; long arguments in it are shortened."""
    ctx = getattr(error, "ctx", None)
    message = error.format_message().replace("\n", " ").rstrip(".")
    if isinstance(error, click.NoSuchOption):  # click's own wording depends on its version
        name, near = error.option_name, error.possibilities or ()
        message = f"no such option {shown(name)}{did_you_mean(name, near)}"
    message = replacement(arguments) or message
    for text in (part for each in arguments for part in (each, *each.split("=", 1)) if len(repr(part)) > SHOWN):
        message = message.replace(repr(text), shown(text)).replace(text, shown(text)[1:-1])
    if message[1:2].islower():
        message = message[0].lower() + message[1:]
    if ctx is None or ctx.parent is None:
        return message
    help_on = f"{' ' if message[-1] == '?' else '; '}`{ctx.command_path} --help` shows the options"
    return f"{ctx.info_name}: {message}{'' if '`frametool' in message else help_on}"
