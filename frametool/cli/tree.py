"""`frametool tree`: the frames of a tree, drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.trees import load_tree

if TYPE_CHECKING:
    from collections.abc import Sequence


@click.command(cls=Command, name="tree")
@click.argument("tree", type=TEXT)
@click.option("--with", "more", multiple=True, type=TEXT, metavar="FILE", help="merge this tree too; may be repeated")
@rotation_options
@result_options("tree")
def command(tree: str, more: Sequence[str], **options: Any) -> None:
    """Draw the frames of TREE, each with its pose in its parent.

    \b
      frametool tree robot.yaml
      frametool tree robot.yaml --format dot | dot -Tsvg -o robot.svg
      frametool tree arm.yaml --with gripper.yaml --format yaml --to rpy_deg

    TREE is a file, - for standard input, or . for the file that FRAMETOOL_TREE names. yaml and json are trees again
    and read back.
    """
    Output("tree", **options).tree(load_tree(tree, more))
