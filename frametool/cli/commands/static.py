"""`frametool static`: the arguments of static_transform_publisher, from a tree or back into one."""

from __future__ import annotations

import os
import re

from frametool.cli.command import Inputs, argument, command_named, option, refuse, together
from frametool.cli.options import pose_result_options, reading_options
from frametool.cli.output import Output
from frametool.cli.poses import misuse_unless_rotations
from frametool.cli.trees import load_tree
from frametool.documents.source import Source
from frametool.errors import ValueInvalid, shown
from frametool.frames.lookups import FrameTree
from frametool.grammar.readers import Reading
from frametool.ros.publisher import FLAGS, moving_frames, read_flags, read_positional

ABOUT = "as static_transform_publisher has it"


@command_named("static")
@argument("arguments", nargs=-1, metavar="[TREE | X Y Z .. PARENT CHILD]")
@together(*(option(f"--{name} {'FRAME' if name.endswith('id') else 'N'}", ABOUT) for name in FLAGS))
@reading_options
@pose_result_options("tree")
def static_command(inputs: Inputs) -> None:
    """Write the static_transform_publisher arguments of a TREE, or read such arguments into a tree.

    \b
      frametool static robot.yaml
      frametool static robot.yaml --format static1 --to rpy
      frametool static --x 0.1 --yaw 1.5 --frame-id base --child-frame-id camera
      frametool static 0.1 0 0.2 1.5 0 0 base camera --format json

    A tree is written one line per edge, static2 (flags) unless --format says static1 (x y z qx qy qz qw PARENT CHILD)
    or another. With --to rpy angles are written: --roll --pitch --yaw, and yaw pitch roll in static1, in radians.
    Arguments that are read, in either spelling, become a tree entry: the pose of the child in its parent. Their angles
    are in radians, like the tool's; --deg applies to the result.
    """
    flags = {name: value for name in FLAGS if (value := getattr(inputs, name.replace("-", "_"))) is not None}
    arguments = inputs.arguments
    if len(arguments) == 1 and re.match(r"\s*[-+.\d]+\s", arguments[0]) and not os.path.exists(arguments[0]):
        arguments = re.sub(r"\\\s", " ", arguments[0]).split()  # in quotes
    if not flags and len(arguments) == 1:
        output = Output(inputs, "tree", otherwise="static2")
        tree = load_tree(arguments[0])
        if tree.moves:
            raise ValueInvalid(moving_frames(track.child for track in tree.tracks() if not track.is_static))
        output.tree(tree)
        return
    output = Output(inputs, "tree")
    tree = FrameTree("arguments")
    refuse(flags and arguments, f"extra arguments {shown(' '.join(arguments))} beside the flags")
    reading = Reading(Source("arguments", ""), normalize=inputs.normalize)
    with misuse_unless_rotations(reading):
        pose = read_flags(flags, reading) if flags else read_positional(arguments, reading)
    tree.add_components(pose.parent or "", pose.name or "", pose.components)
    output.tree(tree)
