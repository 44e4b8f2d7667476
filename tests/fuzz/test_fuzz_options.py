"""Every option of every command with hostile values: the contract holds, nothing hangs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
import pytest
from oracles_of_use import HOSTILE, TooMuch, cases, some

from frametool.cli.commands import COMMANDS, group
from frametool.cli.commands.sim import SUBCOMMANDS

if TYPE_CHECKING:
    from oracles_of_use import Tool

pytestmark = [pytest.mark.fuzz, pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")]
TREE = str(Path(__file__).parents[2] / "examples" / "drive.yaml")
POSE = "{xyz: [1, 2, 3], rpy: [0, 0, 1]}"
PLAIN = {
    "convert": [POSE], "compose": [POSE, POSE], "invert": [POSE], "relative": [POSE, POSE], "interpolate": [POSE, POSE, "0.5"],
    "lookup": [TREE, "map", "lidar"], "apply": [TREE, "map", "lidar", "1", "2", "3"], "tree": [TREE], "echo": [TREE, "map", "lidar"],
    "monitor": [TREE], "static": [TREE, "-f", "static2"], "check": [TREE], "sim follow": ["--duration", "0.1"],
    "sim run": ["{turtles: {turtle1: {leader: square}}, duration: 0.1}"],
    "sim teleop": [], "calc": ["1 + 1"],
}  # fmt: skip
STREAM = {"convert": [], "invert": [], "apply": [TREE, "map"], "relative": ["--consecutive"], "compose": ["-", POSE], "calc": ["row"]}
ROWS = b"stamp,frame,x,y,z,qx,qy,qz,qw\n1,lidar,1,2,3,0,0,0,1\n2,map,1,2,3,0,0,0.6,0.8\n"


def command_of(name: str) -> click.Command:
    """Import a command by its name; `sim follow` is one of two words."""
    first, _, second = name.partition(" ")
    found: click.Command = group.get_command(click.Context(group), first)
    return found.commands[second] if isinstance(found, click.Group) else found


NAMES = [*(name for name in COMMANDS if name != "sim"), *(f"sim {name}" for name in SUBCOMMANDS)]
OPTIONS = [
    (name, option.opts[-1])
    for name in NAMES
    for option in command_of(name).params
    if isinstance(option, click.Option) and not option.is_flag
]


def endless(name: str, option: str, value: str) -> bool:
    """Tell whether somebody asked for a run that goes on for ever."""
    return name.startswith("sim") and option == "--duration" and value.strip("+-").lower() in ("inf", "1e308", "9" * 20)


@pytest.mark.parametrize(("name", "option"), OPTIONS, ids=[" ".join(each) for each in OPTIONS])
def test_an_option_takes_or_refuses_every_value(name: str, option: str, tool: Tool) -> None:
    for value in some(HOSTILE, f"{name} {option}"):
        if endless(name, option, value) or "\0" in value:
            continue
        for arguments in (PLAIN.get(name, [TREE]), STREAM.get(name)):
            try:
                if arguments is not None:
                    tool(*name.split(), *arguments, option, value, stdin=ROWS)
            except TooMuch:
                assert (name, option) in (("echo", "--rate"), ("sim follow", "--duration")), value


@pytest.mark.parametrize("name", NAMES)
def test_arguments_are_taken_or_refused(name: str, tool: Tool) -> None:
    for random in cases(0.3):
        words = [*PLAIN.get(name, [TREE]), *(random.choice(HOSTILE) for _ in range(random.randint(0, 2)))]
        if words and random.random() < 0.7:
            words[random.randrange(len(words))] = random.choice(HOSTILE)
        if any("\0" in word or word in ("inf", "infinity", "Infinity") for word in words):
            continue
        tool(*name.split(), *words, stdin=ROWS)
