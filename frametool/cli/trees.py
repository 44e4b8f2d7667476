"""Read the trees and frame names of the command line: files, inline text, standard input, by the options.

In a batch, files that several lines name are read once, and again when they have changed.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Inputs, Text, marking_use, refuse, refuse_two_readers, say_if_typed
from frametool.cli.options import take_stream_format, tree_on_the_line
from frametool.cli.poses import INLINE, OPENING
from frametool.cli.sink import say
from frametool.documents.source import ReadCache, Source
from frametool.errors import bare, shown, warn
from frametool.formats.table import FORMATS, ORDERS
from frametool.grammar.edges import Answers
from frametool.grammar.pose_algebra import Lookups
from frametool.grammar.readers import EARTH_FRAMES, is_slashed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.formats.load import EdgePlace, FrameFile
    from frametool.formats.robots.model import Robot
    from frametool.frames.lookups import Frames

# fields of Answers that are marked as used elsewhere: whether they have an effect depends on formats and motion;
# other field -> its parameters
USED_ELSEWHERE = ("time_offset", "frames", "camera_axes")
ANSWER_OPTIONS: dict[str, tuple[str, ...]] = {name: (name,) for name in Answers._fields if name not in USED_ELSEWHERE}
ANSWER_OPTIONS["order"] = "order", "from_rep"
OF_FILES = (*Answers._fields, "named_frames", "from_rep", "input_formats", "topics", "quiet", "verbose")


def load_tree(
    inputs: Inputs, argument: str, more: Sequence[str] = (), *, streams: bool = False, drawings: bool = False
) -> Frames:
    """Read the tree of an argument and merge further files into it; report what is assumed about their formats.

    streams: the command also reads a stream; the last --in that can be streamed is the format of the stream
    drawings: accept a file without poses too, if it is the only one
    """
    rules = {"moving": bool(inputs.moving), "keep_ns": inputs.cache, "normalize": bool(inputs.normalize)}
    return _load(inputs, (argument, *more), rules, streams=streams, drawings=drawings and not more)[0]


def load_sides(inputs: Inputs, a: Sequence[str], b: Sequence[str]) -> list[tuple[Frames, dict[str, EdgePlace]]]:
    """Read two trees to compare, each of several files, as `load_tree` does.

    Returns each tree with the places of its frames.
    """
    refuse_two_readers((*a, *b))
    sides: list[tuple[Frames, dict[str, EdgePlace]]] = []
    for arguments, behind in ((a, 0), (b, len(a))):
        earth = next((name for name in EARTH_FRAMES if sides and name in sides[0][0].frames), "")
        rules = {"normalize": bool(inputs.normalize), "earth": earth}
        sides.append(_load(inputs, arguments, rules, placed=True, behind=behind, of=len(a) + len(b)))
    return sides


def _load(
    inputs: Inputs, arguments: Sequence[str], rules: Mapping[str, Any], *, placed: bool = False, **how: Any
) -> tuple[Frames, dict[str, EdgePlace]]:
    """Merge files into a tree and return it with the places of its frames; a batch caches unchanged files.

    rules: fields of Rules; placed: collect the places
    how: options of `opened`
    """
    from frametool.formats.load import Rules, load_sources  # not every command that may read trees does

    before = {*inputs.unused}

    def read() -> tuple[tuple[Frames, dict[str, EdgePlace]], set[str]]:
        files = opened(inputs, arguments, **how)
        places: dict[str, EdgePlace] = {}
        tree = load_sources(files, Rules(**rules), places if placed else None)
        if tree.moves:
            inputs.use("time_offset")
        report_files(inputs, files)
        return (tree, places), before - inputs.unused.keys()

    context = click.get_current_context(silent=True)
    cache = None if context is None else context.find_object(ReadCache)
    if cache is None:
        return read()[0]
    inputs.reads_trees = True
    named = [each if each.startswith(OPENING) else tree_file(each) for each in arguments]
    key = tuple(named), f"{rules!r} {how} {[inputs.peek(name) for name in OF_FILES]}"
    paths = [each for each in named if not each.startswith(OPENING) and os.path.exists(each)]
    found, used = cache.read(key, paths, sum(map(len, {*named} - {*paths})), read)
    inputs.use(*used)
    return found


def lookups_in(inputs: Inputs, tree: Frames, *, carried: bool) -> Lookups:
    """Return the lookups in a tree; report covariances that are not used."""
    inputs.note(f"sigmas of {bare(tree.name)} not used (--covariance)" if tree.covariances and not carried else None)
    return Lookups(tree, carried=carried)


def report_files(inputs: Inputs, files: Sequence[FrameFile]) -> None:
    """Report on stderr what was assumed about the files read; with -v also their formats.

    --topic is marked as used if one of them has topics.
    """
    for file in files:
        if file.topics.counts or file.topics.seen:
            inputs.use("topics")
        if inputs.verbose:
            say(f"{file.name}: {FORMATS[file.format].summary}")
        inputs.note(file.tally.assumed and f"{file.name}: {file.tally.assumed}")


def opened(
    inputs: Inputs, arguments: Sequence[str], *, streams: bool = False, behind: int = 0, of: int | None = None,
    drawings: bool = False,
) -> list[FrameFile]:  # fmt: skip
    """Open trees and recordings: files, `-` for standard input, `.` for FRAMETOOL_TREE, or inline trees.

    streams: as in `load_tree`
    behind: the number of files before these; that many --in and --frames are skipped, unless there are no more
    of: the number of all files
    drawings: accept files without poses too
    """
    from frametool.formats.load import FrameFile, opened_together

    refuse_two_readers(arguments)
    say_if_typed("-" if "-" in arguments else "")
    inputs.reads_trees = True
    formats, named = [*inputs.input_formats], [*inputs.peek("named_frames")]
    if streams:
        take_stream_format(formats)
    reads = ("tree", "drawing") if drawings else ("tree",)
    for fmt in formats:
        is_other = {*reads}.isdisjoint(FORMATS[fmt].reads)
        refuse(is_other, f"--in {fmt}: no frames are read from that; `frametool formats` lists what is")
    files = of or len(arguments)
    for option, values in (("--in", formats), ("--frames", named)):
        more = f"{option} appears {len(values)} times for {files} file{'s' * (files != 1)}"
        refuse(not streams and len(values) > files, more)
    format_of_next, general = iter(formats[behind:] or formats), answers(inputs)
    found = opened_together(
        FrameFile.inline(Source(INLINE, each))
        if each.startswith(OPENING)
        else FrameFile(
            tree_file(each), fmt=next(format_of_next, None), topics=inputs.peek("topics"), answers=general, reads=reads
        )
        for each in arguments
    )
    lacking = []
    for file in found:
        lacking += [file] * ("frames" in file.required_options)
        inputs.use(*{"camera_axes"}.intersection(file.required_options))
    if len(named) not in (0, 1, len(lacking), files):
        for file in found:
            file.close()
        raise click.UsageError(f"--frames appears {len(named)} times, {len(lacking)} of the files need names")
    if len(named) == 1:  # names are for files of poses without names, if there are some, not for those with defaults
        lacking = [file for file in lacking if "rows" in FORMATS[file.format].reads] or lacking
    for file, names in zip(found if len(named) == files else lacking, named[behind:] or named, strict=False):
        file.answers = file.answers._replace(frames=names)
    inputs.use(*["named_frames"] * bool(lacking))
    return found


def answers(inputs: Inputs) -> Answers:
    """Return the options for what formats do not specify; raises click.UsageError for a joint with two values."""
    joints: dict[str, str] = {}
    for text in inputs.peek("joints"):
        name, _, value = text.partition("=")
        refuse(not (name and value), f"--joint takes NAME=VALUE, found {shown(text)}")
        refuse(name in joints, f"--joint {shown(name)} has two values, {joints.get(name)} and {value}; leave one out")
        joints[name] = value
    named: dict[str, Any] = {"joints": joints}
    if (chosen := inputs.peek("from_rep")) and chosen.spec in ORDERS:
        named["order"] = chosen.spec
    for name in Answers._fields:
        if name not in ("joints", "frames") and (value := inputs.peek(name)):
            named[name] = value
    return marking_use(inputs, Answers, ANSWER_OPTIONS)(**named)


def tree_file(argument: str) -> str:
    """Return the file of an argument; `.` is the file that FRAMETOOL_TREE names."""
    named = os.environ.get("FRAMETOOL_TREE") if argument == "." else argument
    refuse(argument == "." and not named, "TREE is . but FRAMETOOL_TREE is not set; name a file")
    return named or ""


def _offer_frames(ctx: click.Context, _incomplete: str) -> Mapping[str, str] | None:
    """Offer the frames of the tree; None, for files, if no tree is named yet."""
    named = tree_on_the_line(ctx)
    if named is None and "arguments" in ctx.params:
        return None
    return dict.fromkeys(load_tree(Inputs(ctx.params, {}), named or ".", ctx.params.get("more") or ()).frames, "")


FRAME = Text(offers=_offer_frames)


def frame_name(name: str, tree: Frames | Robot) -> str:
    """Return the name that a frame has in a tree: without the leading `/` of old tf; ecef and earth are one frame."""
    if name in EARTH_FRAMES and name not in tree.frames:
        return next((other for other in EARTH_FRAMES if other in tree.frames), name)
    return name if name in tree.frames else without_slash(name)


def lookup_time_ns(chosen: int | str | None) -> int | None:
    """Return the nanoseconds of --at; None for the latest."""
    return chosen if isinstance(chosen, int) else None


def without_slash(name: str) -> str:
    """Return a frame's name without a leading `/`, with a warning."""
    if is_slashed(name):
        warn(f"frame {shown(name)}: the leading / is no part of a name and was left out")
    return name[is_slashed(name) :]
