"""What click says of arguments, as errors and lines of ours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from frametool.cli.help_page import show_help
from frametool.errors import SHOWN, shown
from frametool.stream.faults import Misused

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


def answered(call: Callable[[], int], arguments: Sequence[str]) -> int:
    """Return the status of a call of a command; a call without arguments may have help for an answer.

    Raises FrametoolError for all that a user did wrong.
    """
    try:
        return call()
    except click.exceptions.Exit as end:
        return end.exit_code
    except click.exceptions.NoArgsIsHelpError as error:
        show_help(error.ctx)
        return 0
    except click.ClickException as error:
        raise Misused(_usage(error, arguments)) from None


def _usage(error: click.ClickException, arguments: Sequence[str]) -> str:
    """Put a usage error on one line, with how the command is called; what it quotes of the arguments is cut."""
    ctx = getattr(error, "ctx", None)
    message = error.format_message().replace("\n", " ").rstrip(".")
    for text in (part for each in arguments for part in (each, *each.split("=", 1)) if len(repr(part)) > SHOWN):
        message = message.replace(repr(text), shown(text)).replace(text, shown(text)[1:-1])
    if message[1:2].islower():
        message = message[0].lower() + message[1:]
    if ctx is None or ctx.parent is None:
        return message
    pieces = " ".join(ctx.command.collect_usage_pieces(ctx))
    return f"{ctx.info_name}: {message}; usage: {ctx.command_path} {pieces}"
