"""The table of commands; each command is imported when it is called, help and completion come from the table."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NoReturn

import click

from frametool import __version__
from frametool.cli.command import WithHelp, show_help
from frametool.cli.sink import writing
from frametool.errors import Misused, any_near, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from click.shell_completion import CompletionItem

# name -> (module, what it does); help, completion and the README's check are derived from this table
COMMANDS = {
    "convert": ("frametool.cli.commands.convert", "one rotation or pose in other representations"),
    "compose": ("frametool.cli.commands.algebra", "product of poses, left to right: a_from_b, b_from_c -> a_from_c"),
    "invert": ("frametool.cli.commands.algebra", "the inverse of a pose: a_from_b -> b_from_a"),
    "relative": ("frametool.cli.commands.algebra", "the pose of B seen from A, with distance and angle"),
    "mean": ("frametool.cli.commands.algebra", "the mean of poses or rows, and how far they lie from it"),
    "between": ("frametool.cli.commands.algebra", "the shortest rotation from one direction to another"),
    "interpolate": ("frametool.cli.commands.algebra", "poses between A and B at fractions of the way"),
    "calc": ("frametool.cli.commands.calc", "expressions over poses whose frames are checked like units"),
    "lookup": ("frametool.cli.commands.lookup", "where SOURCE is seen from TARGET in a tree of frames"),
    "tree": ("frametool.cli.commands.tree", "the frames of a tree, drawn or written in another format"),
    "view": ("frametool.cli.commands.tree", "frames in 3D: in the terminal, as an interactive page, as a picture"),
    "check": ("frametool.cli.commands.check", "mistakes in trees and recordings"),
    "diff": ("frametool.cli.commands.check", "what differs between two trees, calibrations or recordings"),
    "static": ("frametool.cli.commands.tree", "static_transform_publisher arguments, written and read"),
    "fk": ("frametool.cli.commands.lookup", "where TIP of a robot is seen from BASE, for joint values"),
    "solve": ("frametool.cli.commands.solve", "transforms estimated from measurements: trees, cameras, matched points"),
    "apply": ("frametool.cli.commands.apply", "points, vectors and poses moved into another frame"),
    "project": ("frametool.cli.commands.project", "points into the picture of a camera: pixels, depths, overlays"),
    "unproject": ("frametool.cli.commands.project", "pixels of a camera as rays, or as points in TARGET"),
    "batch": ("frametool.cli.commands.batch", "many commands, one a line, in one process"),
    "compare": ("frametool.cli.commands.compare", "how far trajectories are from a reference"),
    "align": ("frametool.cli.commands.compare", "the transform that brings a trajectory onto its reference"),
    "resample": ("frametool.cli.commands.compare", "a trajectory at other times"),
    "echo": ("frametool.cli.commands.lookup", "where SOURCE is seen from TARGET as a recording plays"),
    "record": ("frametool.cli.commands.record", "a recording with other edges, frames of poses or time span"),
    "monitor": ("frametool.cli.commands.check", "rate, interval, gaps and jumps of each edge of a recording"),
    "formats": ("frametool.cli.commands.check", "the file formats that are read and written, and what they mean"),
    "examples": ("frametool.cli.commands.help", "the example files and the cookbook, printed or copied"),
    "help": ("frametool.cli.commands.help", "topics, the cookbook, and any word: pose, axes, extrinsics"),
    "sim": ("frametool.cli.commands.sim", "turtlesim and its followers, without ROS and without a screen"),
}
# first command of a section of the help -> its heading
GROUPS = {"convert": "Poses", "lookup": "Trees", "apply": "Rows", "compare": "Trajectories", "echo": "Recordings",
          "formats": "Help", "sim": "Turtles"}  # fmt: skip
TROUBLE = {"diff": 2}  # command -> its exit code for all errors, as diff(1) has one

HELP = """The calculator for rigid-body frames.

\b
  frametool lookup robot.yaml map camera_optical
  frametool convert --from rpy_deg --to quaternion 0 0 90
  frametool compose '{xyz: [1, 2, 3]}' '{rpy_deg: [0, 0, 90]}'

Arguments are in the order TARGET SOURCE; the answer is the pose of SOURCE in TARGET, which maps points in SOURCE to
points in TARGET. Metres, radians unless said, quaternions x, y, z, w. `frametool help WORD` finds what explains a word,
`frametool help cookbook` has questions with their commands, `frametool examples -o examples` copies files to try.
"""
COMPLETION = "_FRAMETOOL_COMPLETE"  # the variable by which shells ask for completions


class Group(WithHelp, click.Group):
    """The commands of a table, name -> (module, what it does), each imported when it is called."""

    def __init__(self, *args: Any, table: Mapping[str, tuple[str, str]] = COMMANDS, **kwargs: Any) -> None:
        """Store the table."""
        super().__init__(*args, **kwargs)
        self.table = table

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Show the help if there are no arguments; how click itself does this depends on its version."""
        if not args and not ctx.resilient_parsing:
            show_help(ctx)
            ctx.exit()
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names of the commands in the order of the table."""
        return list(self.table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        """Return a command, imported if it is new; raises click.UsageError with the nearest name for an unknown one."""
        if cmd_name in self.commands:
            return self.commands[cmd_name]
        if cmd_name not in self.table:
            rest = f"`{ctx.command_path} --help` lists all, `frametool help WORD` searches"
            hint = f"; a file follows a command: frametool tree {cmd_name}" * os.path.isfile(cmd_name)
            raise click.UsageError(f"no command {shown(cmd_name)}{hint or any_near(cmd_name, self.table, rest)}", ctx)
        found: click.Command = getattr(import_module(self.table[cmd_name][0]), f"{cmd_name}_command")
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the commands from the table, without importing any."""
        width, rows = max(map(len, self.table)), list(self.table.items())
        starts = [0, *(at for at, name in enumerate(self.table) if at and name in GROUPS)]
        for begin, end in pairwise([*starts, len(rows)]):
            with formatter.section(GROUPS.get(rows[begin][0], "Commands")):
                formatter.write_dl([(name.ljust(width), about) for name, (_, about) in rows[begin:end]])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete command names from the table."""
        from click.shell_completion import CompletionItem

        named = [CompletionItem(name, help=row[1]) for name, row in self.table.items() if name.startswith(incomplete)]
        return named + click.Command.shell_complete(self, ctx, incomplete)


PACKAGES = ("numpy", "click", "rich", "pyyaml", "rosbags", "pyarrow", "laspy", "matplotlib")


def _show_version(ctx: click.Context) -> NoReturn:
    """Print the version, with -v also those of Python and of the installed packages, for bug reports.

    It is a literal, because importlib.metadata takes 25 ms.
    """
    lines = [f"frametool {__version__}"]
    if ctx.params.get("all_versions"):
        import platform
        from importlib.metadata import distributions

        there = {str(each.name).lower(): each.version for each in distributions()}
        lines.append(f"Python {platform.python_version()} on {platform.system()} {platform.machine()}")
        lines += [f"{package} {there.get(package, 'not installed')}" for package in PACKAGES]
    with writing(None) as write:
        write("".join(f"{line}\n" for line in lines))
    ctx.exit()


group = Group("group", help=HELP, params=[
    click.Option(["-v", "all_versions"], is_flag=True, is_eager=True,
                 help="with --version: of Python and of its packages too"),
    click.Option(["--version"], is_flag=True, expose_value=False, help="Show the version and exit.",
                 callback=lambda ctx, _, chosen: chosen and _show_version(ctx)),
])  # fmt: skip


def call_command(
    words: Sequence[str], parent: click.Context | None = None, prepare: Callable[[click.Context], None] | None = None
) -> int:
    """Call a command and return its exit status; raise FrametoolError for all errors of the user.

    click's own `main` is not used: it writes to stderr at Ctrl-C and turns a closed pipe into status 1.
    parent: a context of the group, shared by the lines of a batch
    prepare: called with the command's context before it runs
    """
    result, width = None, 100 if sys.stdout.isatty() else 80
    try:
        if instruction := os.environ.get(COMPLETION):
            return _print_completions(instruction, " ".join(words))
        name, *rest = ("frametool", *words) if parent is None else words
        command = group if parent is None else group.get_command(parent, name)
        with command.make_context(name, rest, parent, obj=(*words,), max_content_width=width) as ctx:
            if prepare:
                prepare(ctx)
            result = command.invoke(ctx)
    except click.exceptions.Exit as end:
        return end.exit_code
    except click.ClickException as error:
        from frametool.cli.options import usage_sentence

        raise Misused(usage_sentence(error, words)) from None
    return result if isinstance(result, int) else 0


SCRIPTS = os.path.join(os.path.dirname(os.path.dirname(__file__)), "completions")  # of shells; the wheel installs them


def _print_completions(wanted: str, line: str) -> int:
    """Print what a shell needs for completion; return 0.

    wanted: `words`, the completions of the line, each with its type and meaning; or `bash_source` etc., a script
    The scripts are our own: those of click depend on its version, and split words at a colon or a comma.
    """
    shells = sorted(os.listdir(SCRIPTS))
    if wanted == "words":
        from click.shell_completion import ShellComplete, split_arg_string

        *words, begun = split_arg_string(f"{line}.")  # because of the point, a new word begins after a space
        option = begun[: begun.find("=") + 1] if begun.startswith("--") else ""  # --NAME= is part of the word
        before = list(map(os.path.expanduser, words[1:]))
        found = ShellComplete(group, {}, "frametool", COMPLETION).get_completions(before, begun[:-1])
        rows = [(each.type, option + each.value, each.help or "") for each in found]
        text = "".join("\t".join(row) + "\n" for row in rows if "".join(row).isprintable())
    elif (shell := wanted.removesuffix("_source")) in shells:
        with open(os.path.join(SCRIPTS, shell), encoding="utf-8") as script:
            text = script.read()
    else:
        known = ", ".join(f"{each}_source" for each in shells)
        raise click.UsageError(f"{COMPLETION} is {wanted!r}; it prints the completions of a shell as {known}")
    with writing(None) as write:
        write(text)
    return 0
