"""The commands there are, and the calls of them in a line of shell."""

from __future__ import annotations

import re
from functools import cache
from typing import NamedTuple

import click

from frametool.cli.commands import COMMANDS, Group, group


@cache
def commands() -> dict[str, tuple[click.Command, str]]:
    """Return all commands and subcommands by name, each with what it is about in a line."""
    found: dict[str, tuple[click.Command, str]] = {}
    for name, (_, about) in COMMANDS.items():
        command = group.get_command(click.Context(group), name)
        found[name] = (command, about)
        if isinstance(command, Group):
            context = click.Context(command)
            found |= {f"{name} {each}": (command.get_command(context, each), row[1]) for each, row in command.table.items()}
    return found


class Call(NamedTuple):
    """A call of a command in a line of shell: its name, what follows it, and the options that are used."""

    name: str
    rest: str
    options: list[click.Option]


def calls(line: str) -> list[Call]:
    """Return the calls of frametool in a line of shell; a pipe or a semicolon ends each."""
    found = []
    for text in re.findall(r"\bframetool ((?:'[^']*'|\"[^\"]*\"|[^|;'\"])+)", line):
        name = next((each for each in reversed(commands()) if re.match(rf"{each}(?:\s|$)", text)), None)
        if name is not None:
            rest = text.removeprefix(name).strip()
            words = {word.partition("=")[0] for word in re.sub(r"'[^']*'", "", rest).split()}
            own = [each for each in commands()[name][0].params if isinstance(each, click.Option)]
            found.append(Call(name, rest, [each for each in own if words.intersection(each.opts)]))
    return found
