"""`frametool lookup`: where one frame is seen from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.trees import FRAME, frame_name, load_tree
from frametool.formats.pose import Pose
from frametool.formats.results import Result

if TYPE_CHECKING:
    from collections.abc import Sequence


@click.command(cls=Command, name="lookup")
@click.argument("tree", type=TEXT)
@click.argument("target", type=FRAME)
@click.argument("source", type=FRAME)
@click.option("--with", "more", multiple=True, type=TEXT, metavar="FILE", help="merge this tree too; may be repeated")
@rotation_options
@result_options("poses")
def command(tree: str, target: str, source: str, more: Sequence[str], **options: Any) -> None:
    """Give the pose of SOURCE in TARGET: the transform that maps points in SOURCE to points in TARGET.

    \b
      frametool lookup robot.yaml map camera_optical
      frametool lookup robot.yaml base_link lidar --to rpy_deg --format json

    TREE is a file, - for standard input, or . for the file that FRAMETOOL_TREE names. --deg is about the angles of
    the result; the tree's own are what its file says.
    """
    output = Output("poses", **options)
    frames = load_tree(tree, more)
    target, source = frame_name(target, frames), frame_name(source, frames)
    output.poses([Result(Pose.of(frames.lookup(target, source).components, source, target))])
