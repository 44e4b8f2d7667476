"""The help option of all commands, made without click's translations: those load `locale`, 2 ms of every start."""

from __future__ import annotations

import click

from frametool.cli.sink import writing


def show_help(ctx: click.Context) -> None:
    """Print the help of a command."""
    with writing(None) as write:
        write(f"{ctx.get_help()}\n")


def _help(ctx: click.Context, _: click.Parameter, chosen: bool) -> None:  # click's signature
    if chosen:
        show_help(ctx)
        ctx.exit()


HELP_OPTION = click.Option(
    ["-h", "--help"], is_flag=True, is_eager=True, expose_value=False, callback=_help, help="Show this message."
)


class WithHelp(click.Command):
    """A command with -h and --help."""

    def get_help_option(self, ctx: click.Context) -> click.Option | None:  # noqa: ARG002 - click's signature
        """Return the one help option."""
        return HELP_OPTION
