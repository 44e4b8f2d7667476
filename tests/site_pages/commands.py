"""A page for each command, out of what its `--help-all` says."""

from __future__ import annotations

import inspect
import re
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import option_groups, option_row
from frametool.cli.commands.help import described, topics
from site_pages.calls import commands
from site_pages.cookbook import asked_about, questions, topics_with
from site_pages.markup import Page, Section, bullets, definitions, document, fenced, inline, links, see_also, slug

if TYPE_CHECKING:
    from collections.abc import Mapping


MOST_SEEN = 14  # lines of an output that shows what a command does
POSES = "a pose or rotation in braces, as `help pose` says, or a file with one; - is standard input"
OF_RECORD = "numbers, or a record in braces; without them rows are read from standard input or -i FILE"
ARGUMENTS = {
    "VALUES.. | POSE": "numbers of the notation --from, or a pose in braces; without them rows are read from standard input or -i FILE",
    "POSE POSE": f"two or more of these: {POSES}", "POSE": POSES, "A": POSES, "B": POSES,
    "POSE.. | FILE": f"{POSES}; one FILE holds rows",
    "V1 V2": "two directions, x,y,z each",
    "FRACTION": "numbers from 0, which is A, to 1, which is B",
    "NAME=FILE ..] [EXPR": "trees by the names that expressions call them by; the expressions, or - for one a line",
    "TREE": "a file with frames: a tree, robot, calibration or recording; - is standard input, . the file that FRAMETOOL_TREE names",
    "TARGET": "the frame in which the result is expressed", "SOURCE": "the frame whose pose is wanted",
    "FILES": "trees, robots, calibrations and recordings",
    "TREE | X Y Z .. PARENT CHILD": "a tree whose publishers are wanted, or arguments of static_transform_publisher, in any order it knows",
    "URDF": "a robot: URDF, SDF or MJCF", "BASE": "the frame in which poses are expressed", "TIP": "the frame whose poses are wanted",
    "FILE.. | GRIPPER TARGET | SAMPLES | A B": "measurements; with --hand-eye poses of gripper and target, or samples with both; with --points two lists of points",
    "TREE TARGET [SOURCE]] [X Y Z | RECORD": f"the tree and the two frames, SOURCE unless the rows name theirs; {OF_RECORD}",
    "TREE CAMERA [SOURCE]] [X Y Z | RECORD": f"the tree, its camera, the frame of the points; {OF_RECORD}",
    "TREE TARGET CAMERA] [U V [DEPTH] | RECORD": f"the tree, the frame of the result, the camera of the pixels; {OF_RECORD}",
    "FILE": "commands, one a line; - is standard input",
    "REF": "the trajectory that counts as true", "EST": "an estimate of it", "TRAJ": "a trajectory",
    "RECORDING": "a bag, an MCAP file or `ros2 topic echo` of /tf",
    "TARGET SOURCE": "frames between which the transform is monitored; without them every edge is",
    "NAME": "of a file format, or of an example", "TOPIC | COMMAND | WORD": "what to explain; cookbook and a word search the questions",
    "SCENE": "a file with turtles and what they do",
}  # fmt: skip


def section() -> Section:
    """Return the pages of all commands."""
    pages = [
        Page(f"commands/{slug(name)}.md", name, f"{name}: {about}", about, _text(name, command))
        for name, (command, about) in commands().items()
    ]
    return Section("commands", "Commands", "In the terminal: `frametool COMMAND --help-all`.", {"": pages})


def _text(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=name)
    facts = described(name, command, context)
    parts = [fenced(facts["usage"], "sh"), document(inspect.cleandoc(command.help or "").replace("\b\n", ""))]
    if seen := _seen(name):
        parts.append(seen)
    if inner := [each for each in commands() if each.startswith(f"{name} ")]:
        parts += ["## Commands", bullets(f"[{each}](/commands/{slug(each)}.md): {inline(commands()[each][1])}" for each in inner)]
    if facts["arguments"]:
        parts += ["## Arguments", bullets(map(_argument, facts["arguments"]))]
    for title, options in option_groups(command, context).items():
        parts += [f"## {title.partition(' (')[0]}", definitions(map(option_row, options))]
    parts += ["## Exit codes", bullets(f"`{code}`: {inline(meaning)}" for code, meaning in facts["exit_codes"].items())]
    if asked := asked_about("commands", name):
        parts += ["## In the cookbook", bullets(asked)]
    about = [each for each in topics() if each == name or each in topics_with(name)]
    return "\n\n".join([*parts, see_also({"Topics": links("topics", about)})])


def _seen(name: str) -> str:
    """Return the shortest call of a command in the cookbook that is no error, with its output and where it stands."""
    lines = [(output.count("\n"), command, output, each) for each in questions() for command, output in each.shell if re.search(rf"\bframetool {name}\b", command)]
    _, command, output, question = min((each for each in lines if each[0] and not each[2].startswith("frametool: ")), default=(0, "", "", None), key=lambda each: (each[0] > MOST_SEEN, not each[1].startswith(f"frametool {name}"), len(each[1])))
    shown = fenced(f"$ {command}\n{output}", "console")
    return f"{shown}\n\n[{inline(question.title)}](/{question.path})" if question else ""


def _argument(facts: Mapping[str, Any]) -> str:
    """Return what there is to say of an argument: its name, whether it must be there, how often it may, what it is."""
    name = facts["name"].strip("[]. ")
    often = {(True, True): ", one or more", (False, True): ", any number"}.get((facts["required"], facts["repeated"]), "")
    return f"`{name}`{often}{'' if facts['required'] or often else ', may be left out'}: {inline(ARGUMENTS[name])}"
