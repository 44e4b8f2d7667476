"""`frametool help`: a subject on one screen, or the help of a command."""

from __future__ import annotations

import os
from shutil import get_terminal_size
from textwrap import fill

import click

from frametool.cli.commands import COMMANDS
from frametool.cli.group import show_help
from frametool.cli.options import Command, Text
from frametool.cli.sink import writing
from frametool.errors import alternatives, shown

FOLDER = os.path.join(os.path.dirname(os.path.dirname(__file__)), "topics")


def topics() -> dict[str, str]:
    """Return the subjects there are: name -> what it is about, the first line of its file."""
    names = sorted(name.removesuffix(".txt") for name in os.listdir(FOLDER) if name.endswith(".txt"))
    return {name: topic(name).partition("\n")[0] for name in names}


def topic(name: str) -> str:
    """Return the text of a subject."""
    with open(os.path.join(FOLDER, f"{name}.txt"), encoding="utf-8") as file:
        return file.read()


def _wrapped(line: str, indent: int) -> str:
    """Return a line, or several in the width of the terminal."""
    return fill(line, min(get_terminal_size().columns, 100), subsequent_indent=" " * indent) + "\n"


class Topic(Text):
    """A subject or a command."""

    name = "topic"

    def offers(self, ctx: click.Context, incomplete: str) -> dict[str, str]:  # noqa: ARG002
        """Offer the subjects and the commands."""
        return topics() | {name: row[1] for name, row in COMMANDS.items()}


@click.command(cls=Command, name="help")
@click.argument("name", type=Topic(), required=False, metavar="[TOPIC | COMMAND]")
@click.pass_context
def command(ctx: click.Context, name: str | None) -> None:
    """Explain a subject on one screen, or a command.

    \b
      frametool help
      frametool help pose
      frametool help convert
    """
    known = topics()
    if name in COMMANDS and name not in known:  # calc and formats are subjects too
        from frametool.cli.group import group

        show_help(click.Context(group.get_command(ctx, name), parent=ctx.parent, info_name=name))
        return
    if name is not None and name not in known:
        raise click.UsageError(f"no topic {shown(name)}{alternatives(name, tuple(known | COMMANDS), 'topics')}")
    width = max(map(len, known))
    listed = "".join(_wrapped(f"  {each:{width}}  {about}", width + 4) for each, about in known.items())
    all_commands = _wrapped(f"Commands: {', '.join(COMMANDS)}", 2)
    with writing(None) as write:
        write(topic(name) if name else f"Topics (frametool help TOPIC):\n\n{listed}\n{all_commands}")
