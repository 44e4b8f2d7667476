"""`frametool examples`: the example files that come with the package, printed or copied."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from frametool.cli.command import FILE, Inputs, Text, argument, command_named, option, refuse
from frametool.cli.sink import refuse_existing, writing
from frametool.errors import FileProblem, ValueInvalid, any_near, printable, shown

if TYPE_CHECKING:
    import click

PACKAGE = os.path.dirname(os.path.dirname(os.path.dirname(__file__)))


def folder() -> str:
    """Return where the files are: in the installed package, or next to it in its sources."""
    installed = os.path.join(PACKAGE, "examples")
    return installed if os.path.isdir(installed) else os.path.join(os.path.dirname(PACKAGE), "examples")


def names() -> list[str]:
    """Return the names of the example files."""
    try:
        return sorted(each for each in os.listdir(folder()) if os.path.isfile(os.path.join(folder(), each)))
    except OSError:
        raise FileProblem(f"{folder()}: the example files are missing; install frametool anew") from None


def example(name: str) -> bytes:
    """Return what is in an example file."""
    with open(os.path.join(folder(), name), "rb") as file:
        return file.read()


class Example(Text):
    """The name of an example file."""

    def read(self, text: str) -> str:
        """Refuse an unknown one with the nearest."""
        name = text.removeprefix("examples/")
        if name not in names():
            raise ValueInvalid(f"no example {shown(name)}{any_near(name, names(), '`frametool examples` lists all')}")
        return name

    def offers(self, ctx: click.Context, incomplete: str) -> dict[str, str]:  # noqa: ARG002
        """Offer the files."""
        return dict.fromkeys(names(), "")


@command_named("examples")
@argument("name", Example(), required=False)
@option("-o --output FOLDER|FILE", "copy all files into this folder, or NAME into this file", FILE, under="Result")
@option("--force", "let --output overwrite files", requires=("output",), under="Result")
def examples_command(inputs: Inputs) -> None:
    """List the example files, print one, or copy them.

    \b
      frametool examples
      frametool examples robot.yaml
      frametool examples -o frames

    The examples of every `COMMAND --help` run inside the folder, those of the cookbook beside one called `examples`.
    `frametool help cookbook` searches the cookbook, COOKBOOK.md; SKILL.md is the tool in brief for an assistant.
    """
    name, output, force = inputs.name, inputs.output, inputs.force
    if output is None:
        with writing(None) as write:
            write(example(name) if name else "".join(f"{each}\n" for each in names()))
        return
    refuse(name is None and output == "-", "--output - prints one example; name it, or a folder for all")
    if name is None or os.path.isdir(output):
        targets = {each: os.path.join(output, each) for each in ([name] if name else names())}
        try:
            os.makedirs(output, exist_ok=True)
        except OSError as error:
            raise FileProblem(f"{printable(output)}: {(error.strerror or str(error)).lower()}") from None
    else:
        targets = {name: output}
    for path in targets.values():  # all of them first: nothing is copied by half
        refuse_existing(path, force=force)
    for each, path in targets.items():
        with writing(path, force=force) as write:
            write(example(each))
