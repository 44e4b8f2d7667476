"""Trees and frame names from the command line."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import click

from frametool.cli.command import Text
from frametool.cli.poses import source_of
from frametool.errors import warn
from frametool.formats.load import load_sources

if TYPE_CHECKING:
    from collections.abc import Sequence

    from click.shell_completion import CompletionItem

    from frametool.frames.tree import FrameTree


def load_tree(argument: str, more: Sequence[str] = ()) -> FrameTree:
    """Read the tree of an argument (a file, inline, `-`, or `.` for FRAMETOOL_TREE) and merge further files into it."""
    return load_sources([source_of(_tree_file(each)) for each in (argument, *more)])


def _tree_file(argument: str) -> str:
    """Give the file that an argument stands for."""
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

        try:
            tree = load_tree(ctx.params.get("tree") or ".")
        except (FrametoolError, click.UsageError):
            return []  # nothing to offer, and a completion must not print
        return [CompletionItem(frame) for frame in tree.frames if frame.startswith(incomplete)]


FRAME = Frame()


def frame_name(name: str, tree: FrameTree) -> str:
    """Give a frame's name without a leading `/`, which tf2 has given up, unless a frame is called so."""
    if name.startswith("/") and name not in tree.frames:
        warn(f"frame {name!r}: the leading / is no part of a name and was left out")
        return name[1:]
    return name
