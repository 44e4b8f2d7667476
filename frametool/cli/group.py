"""The group of all commands: each is imported when it is called; help and completion come from the table."""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING

import click

from frametool import __version__
from frametool.cli import COMMANDS
from frametool.cli.help_page import WithHelp
from frametool.cli.sink import writing
from frametool.errors import alternatives, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from click.shell_completion import CompletionItem

HELP = """The calculator for rigid-body frames.

\b
  frametool lookup robot.yaml map camera_optical
  frametool convert --from rpy_deg --to quaternion 0 0 90
  frametool compose '{xyz: [1, 2, 3]}' '{rpy_deg: [0, 0, 90]}'

Arguments are in the order TARGET SOURCE; the answer is the pose of SOURCE in TARGET, which maps points in SOURCE to
points in TARGET. Metres, radians unless said, quaternions x, y, z, w.
"""
COMPLETION = "_FRAMETOOL_COMPLETE"  # the variable by which click's scripts ask for completions


class Group(WithHelp, click.Group):
    """The commands of a table, each imported when it is called and not before."""

    table = COMMANDS

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Name the commands, in the table's order."""
        return list(self.table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import one command."""
        if cmd_name not in self.table:
            return None
        found: click.Command = import_module(self.table[cmd_name][0]).command
        return found

    def resolve_command(
        self,
        ctx: click.Context,
        args: list[str],
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command, or say which ones there are."""
        if args and args[0] not in self.table:
            raise click.UsageError(f"no command {shown(args[0])}{alternatives(args[0], self.table, 'commands')}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """List the commands from the table, without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, summary) in self.table.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete command names from the table."""
        from click.shell_completion import CompletionItem

        named = [CompletionItem(name, help=row[1]) for name, row in self.table.items() if name.startswith(incomplete)]
        return named + click.Command.shell_complete(self, ctx, incomplete)


ALL_VERSIONS = "frametool.all_versions"  # where the context keeps that --version is to tell more


def _keep_all_versions(ctx: click.Context, _: click.Parameter, chosen: bool) -> None:
    ctx.meta[ALL_VERSIONS] = chosen


def _show_version(ctx: click.Context, _: click.Parameter, chosen: bool) -> None:  # click's signature
    """Print the version; a literal, because asking importlib.metadata for it takes 25 ms."""
    if chosen:
        with writing(None) as write:
            write(f"frametool {__version__}\n{_surroundings() if ctx.meta.get(ALL_VERSIONS) else ''}")
        ctx.exit()


EXTRAS = {"rosbags": "bag", "pyarrow": "arrow", "matplotlib": "plot"}  # package -> the extra it comes with


def _surroundings() -> str:
    """Return the versions of Python and of the packages there are, one a line, for a report of a fault."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    lines = [f"Python {platform.python_version()} on {platform.system()} {platform.machine()}"]
    for package in ("numpy", "click", "rich", "pyyaml", *EXTRAS):
        try:
            found = version(package)
        except PackageNotFoundError:
            found = "not installed"
        lines.append(f"{package} {found}{f' (extra {EXTRAS[package]})' if package in EXTRAS else ''}")
    return "".join(f"{line}\n" for line in lines)


@click.command(cls=Group, help=HELP, no_args_is_help=True)
@click.option("-v", "all_versions", is_flag=True, is_eager=True, expose_value=False, callback=_keep_all_versions,
              help="with --version: of Python and of its packages too")  # fmt: skip
@click.option("--version", is_flag=True, expose_value=False, callback=_show_version,
              help="Show the version and exit.")  # fmt: skip
def group() -> None:
    """Hold the commands."""


def called(arguments: list[str]) -> int:
    """Call a command and return its status.

    Not by click's own `main`, which writes to stderr at Ctrl-C and turns a closed pipe into status 1.
    """
    if instruction := os.environ.get(COMPLETION):
        from click.shell_completion import shell_complete

        return shell_complete(group, {}, "frametool", COMPLETION, instruction)
    with group.make_context("frametool", arguments) as ctx:
        return _status(group.invoke(ctx))


def called_in(parent: click.Context, words: Sequence[str], prepare: Callable[[click.Context], None]) -> int:
    """Call the command that words begin with and return its status, as `called` does without making a group's context.

    parent: context of the group
    prepare: is shown the command's context before it runs
    """
    name, command, rest = group.resolve_command(parent, list(words))
    if name is None or command is None:
        raise click.UsageError("no command", parent)
    with command.make_context(name, rest, parent=parent) as ctx:
        prepare(ctx)
        return _status(command.invoke(ctx))


def _status(result: object) -> int:
    """Return the status that a command's result stands for."""
    return result if isinstance(result, int) else 0
