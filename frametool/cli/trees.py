"""Trees and frame names from the command line: files, inline texts, standard input, read as the options say.

What several lines of a batch read from the same files is read once for as long as these stay as they are.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Inputs, Text, asking, refuse, refuse_two_readers, say_if_typed
from frametool.cli.options import input_formats, tree_on_the_line
from frametool.cli.poses import is_inline, source_of
from frametool.cli.sink import say
from frametool.documents.source import ReadCache
from frametool.errors import bare, shown, warn
from frametool.formats.table import FORMATS, ORDERS
from frametool.grammar.edges import Answers
from frametool.grammar.pose_algebra import Lookups
from frametool.grammar.readers import EARTH_FRAMES, is_slashed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.formats.load import EdgePlace, FrameFile, Rules
    from frametool.formats.robots.model import Robot
    from frametool.frames.lookups import Frames

# field of Answers -> the parameters that say it; of the others the formats say whether they count, and what moves
ASKED_OUTSIDE = ("time_offset", "frames", "camera_axes")
ANSWERED: dict[str, tuple[str, ...]] = {name: (name,) for name in Answers._fields if name not in ASKED_OUTSIDE}
ANSWERED["order"] = "order", "from_rep"
OF_FILES = (*Answers._fields, "named_frames", "from_rep", "input_formats", "topics", "quiet", "verbose")


def load_tree(
    inputs: Inputs, argument: str, more: Sequence[str] = (), *, streams: bool = False, drawings: bool = False
) -> Frames:
    """Read the tree of an argument and merge further files into it; say what files of other formats were taken for.

    streams: `--in` is about what is streamed wherever that can be
    drawings: a file without poses is taken too, if it is alone
    """
    from frametool.formats.load import Rules  # not every command that may read trees does

    rules = Rules(bool(inputs.moving), inputs.cache, bool(inputs.normalize))
    return _load(inputs, (argument, *more), rules, streams=streams, drawings=drawings and not more)[0]


def load_sides(inputs: Inputs, a: Sequence[str], b: Sequence[str]) -> list[tuple[Frames, dict[str, EdgePlace]]]:
    """Read two trees that will be compared, each of several files, as `load_tree` does; with each frame's place."""
    from frametool.formats.load import Rules

    refuse_two_readers((*a, *b))
    count = len(a) + len(b)
    sides: list[tuple[Frames, dict[str, EdgePlace]]] = []
    for arguments, behind in ((a, 0), (b, len(a))):
        earth = next((name for name in EARTH_FRAMES if sides and name in sides[0][0].frames), "")
        rules = Rules(normalize=bool(inputs.normalize), earth=earth)
        sides.append(_load(inputs, arguments, rules, placed=True, behind=behind, of=count))
    return sides


def _load(
    inputs: Inputs, arguments: Sequence[str], rules: Rules, *, placed: bool = False, **how: Any
) -> tuple[Frames, dict[str, EdgePlace]]:
    """Merge files into a tree; in a batch only if they have changed since they were read.  Also: each frame's place.

    placed: whether the places are wanted
    how: they are opened
    """
    from frametool.formats.load import load_sources

    idle = {*inputs.idle}

    def read() -> tuple[tuple[Frames, dict[str, EdgePlace]], set[str]]:
        files = opened(inputs, arguments, **how)
        places: dict[str, EdgePlace] = {}
        tree = load_sources(files, rules, places if placed else None)
        if tree.moves:
            inputs.ask("time_offset")
        state(inputs, files)
        return (tree, places), idle - inputs.idle.keys()

    context = click.get_current_context(silent=True)
    cache = None if context is None else context.find_object(ReadCache)
    if cache is None:
        return read()[0]
    inputs.reads_trees = True
    named = [each if is_inline(each) else tree_file(each) for each in arguments]
    key = tuple(named), f"{rules!r} {how} {[inputs.peek(name) for name in OF_FILES]}"
    paths = [each for each in named if not is_inline(each) and os.path.exists(each)]
    found, asked = cache.read(key, paths, sum(map(len, {*named} - {*paths})), read)
    inputs.ask(*asked)
    return found


def lookups_in(inputs: Inputs, tree: Frames, *, carried: bool) -> Lookups:
    """Return the look-ups of a command; report covariances that are not wanted."""
    unused = tree.covariances and not carried
    inputs.note(f"sigmas of {bare(tree.name)} not used (--covariance)" if unused else None)
    return Lookups(tree, carried=carried)


def state(inputs: Inputs, files: Sequence[FrameFile]) -> None:
    """Report on stderr what files that were read were taken for: those of other formats than the own one, with -v all.

    Where one of them names a topic, --topic has an effect.
    """
    for file in files:
        if file.topics.counts or file.topics.seen:
            inputs.ask("topics")
        if inputs.verbose:
            say(f"{file.name}: {FORMATS[file.format].summary}")
        inputs.note(file.tally.assumed and f"{file.name}: {file.tally.assumed}")


def opened(
    inputs: Inputs, arguments: Sequence[str], *, streams: bool = False, behind: int = 0, of: int | None = None,
    drawings: bool = False,
) -> list[FrameFile]:  # fmt: skip
    """Open trees and recordings: files, `-` for standard input, `.` for FRAMETOOL_TREE, or trees written inline.

    streams: as `load_tree` has it
    behind: so many files came before these; their --in and --frames are passed over, unless they are all there are
    of: so many files there are in all
    drawings: files without poses are taken too
    """
    from frametool.formats.load import FrameFile, opened_together

    refuse_two_readers(arguments)
    say_if_typed("-" if "-" in arguments else "")
    inputs.reads_trees = True
    formats, named = input_formats(inputs, streams=streams)[0], [*inputs.peek("named_frames")]
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
        FrameFile.inline(source_of(each))
        if is_inline(each)
        else FrameFile(
            tree_file(each), fmt=next(format_of_next, None), topics=inputs.peek("topics"), answers=general, reads=reads
        )
        for each in arguments
    )
    lacking = []
    for file in found:
        lacking += [file] * ("frames" in file.required_options)
        inputs.ask(*{"camera_axes"}.intersection(file.required_options))
    if len(named) not in (0, 1, len(lacking), files):
        for file in found:
            file.close()
        raise click.UsageError(f"--frames appears {len(named)} times, {len(lacking)} of the files need names")
    if len(named) == 1:  # for poses that have no names at all, rather than for names that others go without saying
        lacking = [file for file in lacking if "rows" in FORMATS[file.format].reads] or lacking
    for file, names in zip(found if len(named) == files else lacking, named[behind:] or named, strict=False):
        file.answers = file.answers._replace(frames=names)
    inputs.ask(*["named_frames"] * bool(lacking))
    return found


def answers(inputs: Inputs) -> Answers:
    """Return what the options say about all files whose format leaves it open; no joint has two values."""
    joints: dict[str, str] = {}
    for text in inputs.peek("joints"):
        name, _, value = text.partition("=")
        refuse(not (name and value), f"--joint takes NAME=VALUE, found {shown(text)}")
        refuse(name in joints, f"--joint {shown(name)} has two values, {joints.get(name)} and {value}; leave one out")
        joints[name] = value
    named: dict[str, Any] = {"joints": joints}
    for each in inputs.peek("from_rep") or ():
        if each.spec in ORDERS:
            named["order"] = each.spec
    for name in Answers._fields:
        if name not in ("joints", "frames") and (value := inputs.peek(name)):
            named[name] = value
    return asking(inputs, Answers, ANSWERED)(**named)


def tree_file(argument: str) -> str:
    """Return the file that an argument denotes."""
    named = os.environ.get("FRAMETOOL_TREE") if argument == "." else argument
    refuse(argument == "." and not named, "TREE is . but FRAMETOOL_TREE is not set; name a file")
    return named or ""


def _offer_frames(ctx: click.Context, _incomplete: str) -> Mapping[str, str] | None:
    """Offer the frames of the tree, or files where none is named yet."""
    named = tree_on_the_line(ctx)
    if named is None and "arguments" in ctx.params:
        return None
    return dict.fromkeys(load_tree(Inputs(ctx.params, {}), named or ".", ctx.params.get("more") or ()).frames, "")


FRAME = Text(offers=_offer_frames)


def frame_name(name: str, tree: Frames | Robot) -> str:
    """Return what a tree calls a frame: without the leading `/` of old versions of tf2; the Earth's by either name."""
    if name in EARTH_FRAMES and name not in tree.frames:
        return next((other for other in EARTH_FRAMES if other in tree.frames), name)
    return name if name in tree.frames else without_slash(name)


def without_slash(name: str) -> str:
    """Return a frame's name without a leading `/`; warn of one."""
    if is_slashed(name):
        warn(f"frame {shown(name)}: the leading / is no part of a name and was left out")
    return name[is_slashed(name) :]
