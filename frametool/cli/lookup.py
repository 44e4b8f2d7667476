"""`frametool lookup`: where one frame is seen from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, result_options, rotation_options
from frametool.cli.lookup_rows import RowFrames, column_options
from frametool.cli.output import Output
from frametool.cli.streaming import Stream, stream_options
from frametool.cli.trees import FRAME, frame_name, load_tree
from frametool.formats.pose import Pose
from frametool.formats.results import Result

if TYPE_CHECKING:
    from collections.abc import Sequence


@click.command(cls=Command, name="lookup")
@click.argument("tree", type=TEXT)
@click.argument("target", type=FRAME, required=False, metavar="TARGET")
@click.argument("source", type=FRAME, required=False, metavar="SOURCE")
@click.option("--with", "more", multiple=True, type=TEXT, metavar="FILE", help="merge this tree too; may be repeated")
@rotation_options
@result_options("poses")
@column_options
@stream_options
def command(tree: str, target: str | None, source: str | None, more: Sequence[str], **options: Any) -> int:
    """Give the pose of SOURCE in TARGET: the transform that maps points in SOURCE to points in TARGET.

    \b
      frametool lookup robot.yaml map camera_optical
      frametool lookup robot.yaml base_link lidar --to rpy_deg --format json

    TREE is a file, - for standard input, or . for the file that FRAMETOOL_TREE names. --deg is about the angles of
    the result; the tree's own are what its file says.
    """
    by_row, stream = RowFrames(options), Stream(options)
    output = Output("poses", **options)
    if not by_row and (target is None or source is None):
        raise click.UsageError(f"missing argument '{'TARGET' if target is None else 'SOURCE'}'")
    frames = load_tree(tree, more)
    if by_row or target is None or source is None:
        return by_row.run(stream, output, frames, target=target, source=source)
    target, source = frame_name(target, frames), frame_name(source, frames)
    output.poses([Result(Pose.of(frames.lookup(target, source).components, source, target))])
    return 0
