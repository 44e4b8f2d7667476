"""Trees and frame names from the command line.

Where one pose is wanted and a file of frames is given: the error that says what the file is and points to lookup.

What several lines of a batch read from the same files, read once for as long as these stay as they are.
"""

from __future__ import annotations

import os
import re
import sys
import time
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from frametool.cli.group import settings
from frametool.cli.options import Text, forms_told
from frametool.cli.poses import is_inline, source_of
from frametool.cli.stderr import say
from frametool.documents.source import HEAD, noting_files, states_of
from frametool.errors import FormatError, shown, warn
from frametool.formats.table import FORMATS
from frametool.grammar.edges import Answers

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Hashable, Sequence
    from typing import TypeVar

    from click.shell_completion import CompletionItem

    from frametool.documents.source import FileState
    from frametool.formats.load import Place, Recording, Rules
    from frametool.formats.robots.robot import Robot
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.lookups import FrameTree

    Value = TypeVar("Value")

_XML = rb"\s*(?:<\?xml\b|<!--|<(?:robot|sdf|mujoco|launch|opencv_storage)\b)"
_TREE = rb"(?m)^\s*(?:---\s*)?\{?\s*[\"']?frames[\"']?\s*:"  # our own
_MESSAGES = ("echo", "jsonl", "calls", "csv1", "csv2")  # are read as poses too


def refuse_robots(text: bytes, name: str) -> None:
    """Raise FormatError for XML of a robot or a launch file, in which no reader of poses finds anything."""
    if re.match(_XML, text) and (error := _pointing(text, name)):
        raise error


def with_hint(error: FormatError, text: bytes, name: str) -> FormatError:
    """Return the error to raise where no pose was found in a text: for a file of frames, one that says so."""
    return _pointing(text, name) or error


def _pointing(text: bytes, name: str) -> FormatError | None:
    from frametool.formats.detect import by_sign
    from frametool.formats.table import FORMATS

    try:
        form = by_sign(text[:HEAD], "tree", name=name)
    except FormatError as error:
        return error
    if form is None or form in ("yaml", "json"):
        form = "yaml" if re.search(_TREE, text[:HEAD]) else None
    if form is None or form in _MESSAGES or "rows" in FORMATS[form].reads:
        return None
    what = "a tree of frames" if form == "yaml" else f"{FORMATS[form].summary}: frames"
    file = "FILE" if name in ("", "stdin") else name
    hint = f"look one up: frametool lookup {file} TARGET SOURCE"
    return FormatError(f"{what}, not a pose; {hint}", source=name or "stdin")


MOST = 32  # values
MOST_BYTES = 1 << 28  # of the files and texts they were read from
SETTLED_NS = 50_000_000  # a file that was written just now may change again within one tick of its clock


class Remembered(NamedTuple):
    """A value, and the files it was read from as they were then."""

    value: Any
    files: dict[str, list[FileState]]
    size: int

    def is_current(self) -> bool:
        """Tell whether all files still are what was read."""
        try:
            return all(states_of(path) == states for path, states in self.files.items())
        except OSError:
            return False


class TreeCache:
    """What was read last, mostly trees, by the arguments and by all that says how they are read."""

    def __init__(self) -> None:
        """Create an empty cache."""
        self._kept: dict[Hashable, Remembered] = {}

    def read(self, arguments: Sequence[str], options: Hashable, read: Callable[[], Value]) -> Value:
        """Return what `read` makes of some arguments: as it did before, or anew."""
        key = (tuple(arguments), options)
        if (kept := self._kept.pop(key, None)) is not None and kept.is_current():
            self._kept[key] = kept  # as the youngest
            return kept.value  # type: ignore[no-any-return]
        texts = [argument for argument in arguments if is_inline(argument)]
        with noting_files() as files:
            for argument in arguments:
                if argument not in texts and os.path.exists(argument):
                    files[argument] = states_of(argument)
            value = read()
        if _may_be_kept(files):
            size = sum(map(len, texts)) + sum(state.size for states in files.values() for state in states)
            self._kept[key] = Remembered(value, files, size)
            self._forget()
        return value

    def _forget(self) -> None:
        """Forget the oldest values where there are too many, or too large ones."""
        while len(self._kept) > MOST or sum(kept.size for kept in self._kept.values()) > MOST_BYTES:
            del self._kept[next(iter(self._kept))]


def _may_be_kept(files: dict[str, list[FileState]]) -> bool:
    """Tell whether files can be read again, and whether a change would show."""
    plain = all(os.path.isfile(path) or os.path.isdir(path) for path in files)
    youngest = max((state.ctime_ns for states in files.values() for state in states), default=0)
    return plain and youngest < time.time_ns() - SETTLED_NS


OPEN_IN_TREES = ("frames", "direction", "camera_axes", "dh", "stamps")  # what forms of files of frames may leave open


def load_tree(
    argument: str, more: Sequence[str] = (), rules: Rules | None = None, *, streams: bool = False
) -> FrameTree | TransformBuffer:
    """Read the tree of an argument and merge further files into it; say what files of other forms were taken for.

    streams: `--in` is about what is streamed wherever that can be
    """

    def read() -> FrameTree | TransformBuffer:
        return _loaded(opened((argument, *more), streams=streams), rules)

    return _read_once((argument, *more), f"{rules!r} {streams}", read)


def load_sides(
    a: Sequence[str], b: Sequence[str], *, normalize: bool, places: Sequence[dict[str, Place]]
) -> list[FrameTree | TransformBuffer]:
    """Read two trees that will be compared, each of several files, as `load_tree` does.

    places: are filled with where each frame of the one and the other was said to be
    """
    refuse_two_readers((*a, *b))
    count = len(a) + len(b)

    def side(arguments: Sequence[str], behind: int) -> tuple[FrameTree | TransformBuffer, dict[str, Place]]:
        from frametool.formats.load import Rules

        where: dict[str, Place] = {}
        return _loaded(opened(arguments, behind=behind, of=count), Rules(normalize=normalize), where), where

    trees = []
    for arguments, behind, found in zip((a, b), (0, len(a)), places, strict=True):
        options = f"{normalize} {behind} of {count}"
        tree, where = _read_once(arguments, options, partial(side, arguments, behind))
        trees.append(tree)
        found.update(where)
    return trees


def _loaded(
    files: Sequence[Recording], rules: Rules | None, places: dict[str, Place] | None = None
) -> FrameTree | TransformBuffer:
    """Merge files that are open, and say what they were taken for."""
    from frametool.formats.load import load_sources  # not every command that may read trees does

    tree = load_sources(files, rules, places)
    state(files)
    if places is None:  # of one of two sides, the other may need what this one does not
        say_not_needed([file.form for file in files], *OPEN_IN_TREES)
    return tree


def _read_once(arguments: Sequence[str], options: str, read: Callable[[], Value]) -> Value:
    """Return what is read from files; in a batch, what was read from them before as long as they have not changed.

    options: what says how, beside the options that the context keeps
    """
    context = click.get_current_context(silent=True)
    cache = None if context is None else context.find_object(TreeCache)
    if context is None or cache is None:
        return read()
    settings(context).reads_trees = True
    named = [each if is_inline(each) else tree_file(each) for each in arguments]
    return cache.read(named, f"{options} {vars(settings(context))}", read)


def state(files: Sequence[Recording]) -> None:
    """Say on stderr what files that were read were taken for: those of other forms than ours, with -v all."""
    for file in files:
        if settings().verbose:
            say(file.known)
        if file.stated and not settings().quiet:
            say(file.stated)


def say_not_needed(forms: Collection[str], *asked: str) -> None:
    """Say on stderr which options answer what none of these forms leaves open: they change nothing."""
    if settings().quiet:
        return
    for ask in asked:
        told = getattr(settings(), "named_frames" if ask == "frames" else ask)
        if told and not any(ask in FORMATS[form].asks for form in forms):
            option = f"--{ask.replace('_', '-')}"
            say(f"note: {option} changes nothing: {' and '.join(dict.fromkeys(forms))} does not leave that open")


def opened(
    arguments: Sequence[str], *, streams: bool = False, behind: int = 0, of: int | None = None
) -> list[Recording]:
    """Open trees and recordings: files, `-` for standard input, `.` for FRAMETOOL_TREE, or trees written inline.

    streams: as `load_tree` has it
    behind: so many files came before these; their --in and --frames are passed over, unless they are all there are
    of: so many files there are in all
    """
    from frametool.formats.load import Recording, opened_together

    refuse_two_readers(arguments)
    if "-" in arguments and sys.stdin is not None and sys.stdin.isatty():
        raise click.UsageError("standard input is a terminal; pipe something in, or name a file")
    forms = forms_told(streams=streams)[0]
    _check_forms(forms)
    if not streams:
        _refuse_more("--in", forms, of or len(arguments))
    told = iter(forms[behind:] or forms)
    chosen = settings()
    chosen.reads_trees = True
    named = chosen.named_frames
    if not streams:
        _refuse_more("--frames", named, of or len(arguments))
    frames = iter(named[behind:] or named)
    general = answers()
    return opened_together(
        Recording.inline(source_of(each))
        if is_inline(each)
        else Recording(
            tree_file(each),
            form=next(told, None),
            topics=chosen.topics,
            answers=general._replace(frames=_frame_names(next(frames, ""))),
        )
        for each in arguments
    )


def refuse_two_readers(arguments: Sequence[str]) -> None:
    """Raise a usage error where two arguments stand for standard input."""
    if list(arguments).count("-") > 1:
        raise click.UsageError("standard input can be read once; only one argument may be -")


def _check_forms(forms: Sequence[str]) -> None:
    """Refuse a form from which no frames are read."""
    if other := [form for form in forms if "tree" not in FORMATS[form].reads]:
        raise click.UsageError(f"--in {other[0]}: no frames are read from that; `frametool formats` lists what is")


def _refuse_more(option: str, values: Sequence[str], files: int) -> None:
    """Refuse an option that is given more often than there are files."""
    if len(values) > files:
        raise click.UsageError(f"{option} is given {len(values)} times for {files} file{'s' * (files != 1)}")


def answers() -> Answers:
    """Return what the options say about all files whose form leaves it open."""
    chosen = settings()
    named = {name: getattr(chosen, name) for name in Answers._fields if name not in ("joints", "frames")}
    return Answers(joints=_joints(chosen.joints), **{name: value for name, value in named.items() if value})


def _joints(texts: Sequence[str]) -> dict[str, str]:
    """Return the values of joints by name; raise a usage error for a joint that has two."""
    values: dict[str, str] = {}
    for name, value in map(_joint, texts):
        if name in values:
            raise click.UsageError(f"--joint {shown(name)} is given twice, {values[name]} and {value}; leave one out")
        values[name] = value
    return values


def _joint(text: str) -> tuple[str, str]:
    """Take NAME=VALUE apart."""
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise click.UsageError(f"--joint takes NAME=VALUE, found {shown(text)}")
    return name, value


def _frame_names(text: str) -> tuple[str, ...]:
    """Take WORLD,BODY apart."""
    names = tuple(name.strip() for name in text.split(",")) if text else ()
    if not all(names):
        raise click.UsageError(f"--frames takes names with commas between them, found {shown(text)}")
    return names


def tree_file(argument: str) -> str:
    """Return the file that an argument stands for."""
    if argument != ".":
        return argument
    if named := os.environ.get("FRAMETOOL_TREE"):
        return named
    raise click.UsageError("TREE is . but FRAMETOOL_TREE is not set; name a file")


class Frame(Text):
    """A frame's name, completed from the tree named before it."""

    name = "frame"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002
        """Offer the frames of the tree."""
        from click.shell_completion import CompletionItem

        from frametool.errors import FrametoolError

        # behind an option that wants a frame click has not come to the arguments
        named = ctx.params.get("tree") or next(iter(ctx.params.get("arguments") or ctx.args), None)
        if named is None and "arguments" in ctx.params:
            return [CompletionItem(incomplete, type="file")]
        try:
            tree = load_tree(named or ".", ctx.params.get("more") or ())
        except (FrametoolError, click.UsageError):
            return []  # nothing to offer, and a completion must not print
        return [CompletionItem(frame) for frame in tree.frames if frame.startswith(incomplete)]


FRAME = Frame()


def frame_name(name: str, tree: FrameTree | TransformBuffer | Robot) -> str:
    """Return a frame's name without a leading `/`, which tf2 has given up, unless a frame is called so."""
    if name.startswith("/") and name not in tree.frames:
        warn(f"frame {shown(name)}: the leading / is no part of a name and was left out")
        return name[1:]
    return name
