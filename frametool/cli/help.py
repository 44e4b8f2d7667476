"""The help option of all commands, made without click's translations: those load `locale`, 2 ms of every start."""

from __future__ import annotations

import click


def _show_help(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:  # click's signature
    if wanted:
        click.echo(ctx.get_help(), color=ctx.color)
        ctx.exit()


HELP_OPTION = click.Option(
    ["-h", "--help"], is_flag=True, is_eager=True, expose_value=False, callback=_show_help, help="Show this message."
)


class WithHelp(click.Command):
    """A command with -h and --help."""

    def get_help_option(self, ctx: click.Context) -> click.Option | None:  # noqa: ARG002 - click's signature
        """Return the one help option."""
        return HELP_OPTION
