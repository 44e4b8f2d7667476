"""Trees and frame names from the command line."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from frametool.cli.command import TEXT, Text, say_if_verbose
from frametool.cli.poses import is_inline, source_of
from frametool.errors import shown, warn
from frametool.formats.load import load_sources
from frametool.formats.recordings import Recording

if TYPE_CHECKING:
    from collections.abc import Sequence

    from click.shell_completion import CompletionItem

    from frametool.formats.assembly import Rules
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.tree import FrameTree


def load_tree(argument: str, more: Sequence[str] = (), rules: Rules | None = None) -> FrameTree | TransformBuffer:
    """Read the tree of an argument and merge further files into it."""
    return load_sources(opened((argument, *more)), rules)


def opened(arguments: Sequence[str]) -> list[Recording]:
    """Open trees and recordings: files, `-` for standard input, `.` for FRAMETOOL_TREE, or trees written inline."""
    if list(arguments).count("-") > 1:
        raise click.UsageError("standard input can be read once; only one argument may be -")
    if "-" in arguments and sys.stdin is not None and sys.stdin.isatty():
        raise click.UsageError("standard input is a terminal; pipe something in, or name a file")
    return [
        Recording.inline(source_of(each)) if is_inline(each) else _opened(tree_file(each)) for each in arguments
    ]


def _opened(path: str) -> Recording:
    """Open one file, of a recording the topics chosen; say what it was taken for, if the command was asked to."""
    context = click.get_current_context(silent=True)
    file = Recording(path, topics=() if context is None else context.meta.get(TOPICS, ()))
    say_if_verbose(file.described)
    return file


TOPICS = "frametool.topics"  # where a command's context keeps those of --topic


def _keep_topics(context: click.Context, _: click.Parameter, chosen: Sequence[str]) -> None:
    context.meta[TOPICS] = chosen


topic_option = click.option(
    "--topic", type=TEXT, multiple=True, metavar="NAME", expose_value=False, callback=_keep_topics,
    help="read only this topic of a recording; may be repeated",
)  # fmt: skip


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

        named = ctx.params.get("tree") or next(iter(ctx.params.get("arguments") or ()), None)
        if named is None and "arguments" in ctx.params:
            return [CompletionItem(incomplete, type="file")]
        try:
            tree = load_tree(named or ".", ctx.params.get("more") or ())
        except (FrametoolError, click.UsageError):
            return []  # nothing to offer, and a completion must not print
        return [CompletionItem(frame) for frame in tree.frames if frame.startswith(incomplete)]


FRAME = Frame()


def frame_name(name: str, tree: FrameTree | TransformBuffer) -> str:
    """Return a frame's name without a leading `/`, which tf2 has given up, unless a frame is called so."""
    if name.startswith("/") and name not in tree.frames:
        warn(f"frame {shown(name)}: the leading / is no part of a name and was left out")
        return name[1:]
    return name
