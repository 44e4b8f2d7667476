"""`frametool tree`: the frames of a tree, drawn."""

from __future__ import annotations

import click

from frametool.cli.command import FILE, Inputs, argument, command_named, option
from frametool.cli.options import at_ns, color_option, read_time, tree_result_options
from frametool.cli.output import Output
from frametool.cli.trees import load_tree


@command_named("tree", own=("notations", "joints"))
@argument("tree", FILE)
@option("--at TIME", "seconds, nanoseconds with ns  [default: latest of each edge]", read_time)
@color_option
@tree_result_options("tree", "trajectory")
def tree_command(inputs: Inputs) -> None:
    """Draw the frames of TREE with their poses in their parents; moving frames with rate and interval.

    \b
      frametool tree robot.yaml
      frametool tree robot.yaml --format dot -o robot.dot
      frametool tree robot.yaml --format csv --to rpy_deg
      frametool tree robot.yaml --with '{name: tip, parent: tool, xyz: [0, 0, 1]}'
      frametool tree drive.yaml --at 2.5

    TREE is a file, - for standard input, or . for the file that FRAMETOOL_TREE names. yaml and json can be read back
    and hold all samples of moving frames; csv has one row per edge. dot draws moving frames like ROS's view_frames, tf2
    is the listing of tf2's all_frames_as_yaml. --at draws the tree at one time. Files of these two have no poses: only
    names and rates are shown.
    """
    output = Output(inputs, "tree", "trajectory")
    place, drawn = output.style.place, output.style.format in ("yaml", "json", "text", "dot", "mermaid")
    if place is not None and (not drawn or place.origin is not None):
        raise click.UsageError(f"--to {place.name}: trees say places by lla or utm, in yaml, json, text and drawings")
    frames = load_tree(inputs.tree, inputs.more, drawings=True)
    stamp = at_ns(inputs.at)
    output.tree(frames if stamp is None else frames.tree_at(stamp), inputs.color)
