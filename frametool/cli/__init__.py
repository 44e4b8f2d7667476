"""The command line: one file a command, one table of them; the edge where errors become lines on stderr."""

from __future__ import annotations

import sys
from importlib import import_module
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any

import click

from frametool import __version__
from frametool.cli.help import WithHelp
from frametool.cli.stderr import tell
from frametool.errors import FrametoolError, FrametoolWarning, Tf2Warning, alternatives

if TYPE_CHECKING:
    from collections.abc import Sequence

    from click.shell_completion import CompletionItem

# name -> (module, what it does); help, completion and the README's check are derived from this table
COMMANDS = {
    "convert": ("frametool.cli.commands.convert", "one rotation or pose in other representations"),
    "compose": ("frametool.cli.commands.compose", "product of poses, left to right: a_from_b, b_from_c -> a_from_c"),
    "invert": ("frametool.cli.commands.invert", "the inverse of a pose: a_from_b -> b_from_a"),
    "relative": ("frametool.cli.commands.relative", "the pose of B seen from A, with distance and angle"),
    "interpolate": ("frametool.cli.commands.interpolate", "poses between A and B at fractions of the way"),
    "lookup": ("frametool.cli.commands.lookup", "where SOURCE is seen from TARGET in a tree of frames"),
    "apply": ("frametool.cli.commands.apply", "points, vectors and poses moved into another frame"),
    "tree": ("frametool.cli.commands.tree", "the tree of frames, drawn or written in another form"),
    "echo": ("frametool.cli.commands.echo", "where SOURCE is seen from TARGET as a recording goes by"),
    "monitor": ("frametool.cli.commands.monitor", "rate, interval, gaps and jumps of each edge of a recording"),
    "static": ("frametool.cli.commands.static", "static_transform_publisher arguments, written and read"),
    "check": ("frametool.cli.commands.check", "what is wrong or odd in trees and recordings"),
    "sim": ("frametool.cli.commands.sim", "turtlesim and its followers, without ROS and without a screen"),
}
HELP = """The calculator for rigid-body frames.

\b
  frametool lookup robot.yaml map camera_optical
  frametool convert --from rpy_deg --to quaternion 0 0 90
  frametool compose '{xyz: [1, 2, 3]}' '{rpy_deg: [0, 0, 90]}'

Arguments are in the order TARGET SOURCE; the answer is the pose of SOURCE in TARGET, which maps points in SOURCE to
points in TARGET. Metres, radians unless said, quaternions x, y, z, w.
"""


class ReaderGone(Exception):
    """Say that nobody reads stdout any more."""


class Group(WithHelp, click.Group):
    """The commands of a table, each imported when it is called and not before."""

    table = COMMANDS

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a closed pipe leaves as an error that click does not turn into status 1."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            raise ReaderGone from None

    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        """Parse the arguments; for a closed pipe as `invoke`, since --help and --version print here."""
        try:
            return super().make_context(*arguments, **options)
        except BrokenPipeError:
            raise ReaderGone from None

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Name the commands, in the table's order."""
        return list(self.table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import one command."""
        if cmd_name not in self.table:
            return None
        command: click.Command = import_module(self.table[cmd_name][0]).command
        return command

    def resolve_command(
        self,
        ctx: click.Context,
        args: list[str],
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command, or say which ones there are."""
        if args and args[0] not in self.table:
            raise click.UsageError(f"no command {args[0]!r}{alternatives(args[0], self.table, 'commands')}", ctx)
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


@click.command(cls=Group, help=HELP, no_args_is_help=True)
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, help="Show the version and exit.",
              callback=lambda ctx, _, wanted: _show_version(ctx) if wanted else None)  # fmt: skip
def group() -> None:
    """Hold the commands."""


def _show_version(ctx: click.Context) -> None:
    """Print the version; a literal, because asking importlib.metadata for it takes 25 ms."""
    click.echo(f"frametool {__version__}")
    ctx.exit()


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its status."""
    sys.exit(run(sys.argv[1:] if arguments is None else list(arguments)))


def run(arguments: list[str]) -> int:
    """Run one command; whatever goes wrong becomes one line on stderr and an exit code."""
    import warnings

    if sys.stdout is None:
        return _complain("standard output is closed", 5)
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.encoding.lower() != "utf-8":
        sys.stdout.reconfigure(encoding="utf-8")  # the same bytes in every locale
    warnings.simplefilter("always", FrametoolWarning)
    warnings.showwarning = _show_warning
    try:
        status = _run(arguments)
        sys.stdout.flush()
    except (ReaderGone, BrokenPipeError):
        return _die_of_closed_pipe()
    except OSError as error:
        return _complain(f"{error.strerror or error}", 5)
    return status


def _run(arguments: list[str]) -> int:
    """Run one command; a closed pipe and other trouble with stdout are the caller's."""
    try:
        status = group.main(arguments, prog_name="frametool", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else "")
        return 0
    except click.ClickException as error:
        return _complain(_usage(error), 2)
    except (click.Abort, KeyboardInterrupt):
        return 130
    except FrametoolError as error:
        return _report(error, arguments)
    return status if isinstance(status, int) else 0


def _usage(error: click.ClickException) -> str:
    """Put a usage error on one line, with how the command is called."""
    ctx = getattr(error, "ctx", None)
    message = error.format_message().replace("\n", " ").rstrip(".")
    if message[1:2].islower():
        message = message[0].lower() + message[1:]
    if ctx is None or ctx.parent is None:
        return message
    pieces = " ".join(ctx.command.collect_usage_pieces(ctx))
    return f"{ctx.info_name}: {message}; usage: {ctx.command_path} {pieces}"


def _report(error: FrametoolError, arguments: Sequence[str]) -> int:
    """Say what went wrong: as a sentence, or as an object where JSON was asked for."""
    from frametool.cli.error_json import as_json, wants_json

    if not wants_json(arguments):
        return _complain(_with_snippet(error), error.exit_code)
    tell(as_json(error))
    return error.exit_code


def _with_snippet(error: FrametoolError) -> str:
    snippet = getattr(error, "snippet", "")
    return f"{error}\n{snippet}" if snippet else str(error)


def _complain(message: str, status: int) -> int:
    tell(f"frametool: {message}")
    return status


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    start = "" if isinstance(message, Tf2Warning) else "frametool: warning: "
    tell(f"{start}{message}")


def _die_of_closed_pipe() -> int:
    """End as `cat` does when its reader is gone: killed by SIGPIPE, without a word."""
    import os
    import signal

    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is still buffered must not raise again
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    os.kill(os.getpid(), signal.SIGPIPE)
    return 141
