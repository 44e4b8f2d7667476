"""`frametool tree`: the frames of a tree, drawn."""

from __future__ import annotations

import click

from frametool.cli.command import FILE, Inputs, argument, command_named, option
from frametool.cli.options import TIME, at_ns, color_option, result_options, rules, tree_options
from frametool.cli.output import Output
from frametool.cli.trees import load_tree


@command_named("tree", own=("notations", "joints"))
@argument("tree", FILE)
@option("--with FILE", "merge this tree too; may be repeated", name="more", multiple=True, under="Files")
@option("--at TIME", "seconds, nanoseconds with ns  [default: latest of each edge]", TIME)
@color_option
@tree_options
@result_options("tree", "trajectory")
def command(inputs: Inputs) -> None:
    """Draw the frames of TREE, each with its pose in its parent; those that move with their rate and interval too.

    \b
      frametool tree robot.yaml
      frametool tree robot.yaml --format dot -o robot.dot
      frametool tree robot.yaml --format csv --to rpy_deg
      frametool tree robot.yaml --with '{name: tip, parent: tool, xyz: [0, 0, 1]}'
      frametool tree drive.yaml --at 2.5

    TREE is a file, - for standard input, or . for the file that FRAMETOOL_TREE names. yaml and json are trees again
    and read back, frames that move with all their samples; csv is a table, a row an edge. dot draws what
    moves as ROS's view_frames does, tf2 is the listing of tf2's all_frames_as_yaml. --at draws the tree as it stood
    at one time. Of frames.gv and that listing names and rates are shown: they hold no poses.
    """
    output = Output(inputs, "tree", "trajectory")
    place, drawn = output.style.place, output.style.form in ("yaml", "json", "text", "dot", "mermaid")
    if place is not None and (not drawn or place.origin is not None):
        raise click.UsageError(f"--to {place.name}: trees say places by lla or utm, in yaml, json, text and drawings")
    frames = load_tree(inputs.tree, inputs.more, rules(inputs), drawings=True)
    stamp = at_ns(inputs.at)
    output.tree(frames if stamp is None else frames.tree_at(stamp), inputs.color)
