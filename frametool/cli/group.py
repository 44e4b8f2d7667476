"""How click is used: the inputs of a command, the group of all commands, their help, their calls and their misuse.

An option that was given, and that nobody has asked for when the first result is written, would be ignored: it is a
usage error, and nothing is written.

Each command is imported when it is called; help and completion come from the table.
"""

from __future__ import annotations

import os
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click

from frametool import __version__
from frametool.cli.commands import COMMANDS
from frametool.cli.sink import writing
from frametool.errors import SHOWN, any_near, did_you_mean, shown
from frametool.stream.faults import Misused

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from click.shell_completion import CompletionItem

    from frametool.geometry.place import Earth

EVERYTHING = "frametool.everything"  # a key in a context's `meta`
INPUTS = "frametool.inputs"  # the key in a context's `meta`
# what stands for an option of several values in a command without it
WITHOUT = {"input_forms": (), "topics": (), "joints": (), "joint_files": (), "named_frames": (), "messages": ()}
# options that any way may ignore: they are about what is said, not about what is done
OF_MESSAGES = ("quiet", "verbose")


class Inputs:
    """The arguments and options of a command, by the names of its parameters; to read one is to ask for it.

    forms_read: the forms of what was read, each with the options that say what it leaves open
    reads_trees: whether files of frames are opened: --in is then about these too
    earth: what the options say of places on the Earth, made when first needed
    """

    def __init__(self, values: Mapping[str, Any], idle: dict[str, str] | None = None) -> None:
        """Keep the values; idle: the options that were given, each as it is called."""
        self._values = {**values}
        self._idle = {} if idle is None else idle
        self.forms_read: tuple[tuple[str, tuple[str, ...]], ...] = ()
        self.reads_trees = False
        self.earth: Earth | None = None

    @classmethod
    def of(cls, context: click.Context) -> Inputs:
        """Return what a context has parsed."""
        idle = {name: called for name, called in told_options(context).items() if name not in OF_MESSAGES}
        return cls(context.params, idle)

    def __getattr__(self, name: str) -> Any:
        """Return the value of an argument or option, which counts as asked for; None where the command has none."""
        if name.startswith("_"):
            raise AttributeError(name)
        self._idle.pop(name, None)
        return self._values.get(name, WITHOUT.get(name))

    def peek(self, name: str) -> Any:
        """Return a value that is looked at and not used."""
        return self._values.get(name, WITHOUT.get(name))

    def ask(self, *names: str) -> None:
        """Count options as asked for."""
        for name in names:
            self._idle.pop(name, None)

    def leave(self, **values: Any) -> None:
        """Put what other readers have left in the place of what was given."""
        self._values |= values

    def but(self, **values: Any) -> Inputs:
        """Return these inputs with other values."""
        return Inputs(self._values | values, self._idle)

    def idle(self) -> set[str]:
        """Return the options that were given and that nobody has asked for."""
        return {*self._idle}

    def refuse_idle(self) -> None:
        """Raise a usage error for options that were given and that nobody has asked for."""
        if self._idle:
            has = "has" if len(self._idle) == 1 else "have"
            raise click.UsageError(f"{', '.join(self._idle.values())} {has} no effect here")


class Option(click.Option):
    """An option with what it says about other options of its command, by the names of their parameters.

    excludes: those that cannot stand beside it
    requires: without any of these it has no meaning
    """

    def __init__(
        self, *names: Any, excludes: Sequence[str] = (), requires: Sequence[str] = (), **rest: Any
    ) -> None:
        """Keep both beside what click keeps."""
        super().__init__(*names, **rest)
        self.excludes, self.requires = excludes, requires


option = partial(click.option, cls=Option)


def told_options(context: click.Context) -> dict[str, str]:
    """Return the options that stand on the command line, by their parameters, each as it is called."""
    told = click.core.ParameterSource.COMMANDLINE
    return {
        each.name or "": each.opts[-1] for each in context.command.params
        if isinstance(each, click.Option) and context.get_parameter_source(each.name or "") is told
    }  # fmt: skip


def check_together(context: click.Context) -> None:
    """Raise a usage error for options that do not belong together."""
    told = told_options(context)
    known = {each.name: each for each in context.command.params if isinstance(each, Option)}
    for name, called in told.items():
        if name not in known:
            continue
        if other := next((told[each] for each in known[name].excludes if each in told), ""):
            raise click.UsageError(f"{called} and {other} exclude each other", context)
        needed = known[name].requires
        if needed and told.keys().isdisjoint(needed):
            choices = " or ".join(known[each].opts[-1] for each in needed if each in known)
            raise click.UsageError(f"{called} needs {choices}", context)


def inputs() -> Inputs:
    """Return the inputs of the running command; where none runs, nothing is set but --quiet."""
    context = click.get_current_context(silent=True)
    if context is None:
        return Inputs({"quiet": True})
    found: Inputs = context.meta.get(INPUTS) or Inputs(context.params)
    return found


def show_help(ctx: click.Context, *, everything: bool = False) -> None:
    """Print the help of a command, with `everything` of all its options."""
    ctx.meta[EVERYTHING] = everything
    with writing(None) as write:
        write(f"{ctx.get_help()}\n")


def _help(ctx: click.Context, option: click.Parameter, chosen: bool) -> None:  # click's signature
    if chosen:
        show_help(ctx, everything=option is HELP_ALL)
        ctx.exit()


def option_row(option: click.Option) -> tuple[str, str]:
    """Return the names of an option with what it takes, and its meaning; long lists of choices stand in the latter."""
    names, text = ", ".join((*option.opts, *option.secondary_opts)), option.help or ""
    taken = option.metavar or option.type.name.upper()
    if isinstance(option.type, click.Choice) and not option.metavar:
        taken = f"[{'|'.join(option.type.choices)}]"
        if len(taken) > LONGEST_CHOICE:
            taken = option.opts[-1].strip("-").upper()
            what, bracket, default = text.partition("  [")
            text = f"{what}: {', '.join(option.type.choices)}{bracket}{default}"
    if option.show_default and option.default is not None:
        text += f"  [default: {option.default}]"
    return names if option.is_flag or option.count else f"{names} {taken}", text


# made without click's translations: those load `locale`, 2 ms of every start
HELP_OPTION = click.Option(
    ["-h", "--help"], is_flag=True, is_eager=True, expose_value=False, callback=_help,
    help="this message; --help-all explains every option",
)  # fmt: skip
HELP_ALL = click.Option(
    ["--help-all"], is_flag=True, is_eager=True, expose_value=False, callback=_help, hidden=True, help="all options"
)


# heading -> names of the parameters under it, those asked for most first; all others are what a command is about
GROUPS = {
    "Files (help formats)": ("input_forms", "more", "with_a", "with_b", "topics", "quiet", "verbose"),
    "Time (help time)": (
        "at", "times", "source_at", "fixed", "time_column", "moving", "cache",
        "start", "stop", "time_offset",
    ),
    "Rotations (help rotations, help earth)": (
        "given", "notations", "deg", "normalize", "keep_sign", "local_axes", "origin", "zone",
    ),
    "Rows (help streams)": (
        "input_path", "columns", "keep", "prefix", "on_error", "max_errors", "header", "unwrap", "frame_column",
        "target_column", "source_column",
    ),
    "Result (help errors)": (
        "output", "force", "precision", "covariance", "messages", "topic_out", "recorded_frames", "explain",
        "explain_step", "color",
    ),
    "Forms that leave something open (help formats)": (
        "joints", "joint_files", "named_frames", "direction", "camera_axes", "dh", "stamps", "edges", "order",
    ),
    "Turtles (help turtles)": (
        "target", "delay", "gain_linear", "gain_angular", "max_linear", "max_angular", "turtlesim", "holonomic", "seed",
        "reach", "realtime",
    ),
}  # fmt: skip
# command -> what it is about although it stands under a heading elsewhere
OWN = {
    "convert": ("given", "notations", "unwrap"), "relative": ("time_column",), "between": ("notations",),
    "interpolate": ("notations",), "lookup": ("at", "times", "source_at", "fixed", "notations", "covariance"),
    "apply": ("at", "time_column", "frame_column", "input_path", "output", "covariance"), "calc": ("input_path",),
    "fk": ("input_path", "joints"), "tree": ("at", "notations", "joints"), "view": ("at", "fixed", "output"),
    "resample": ("times",), "diff": ("at", "with_a", "with_b"),
    "record": ("more", "topics", "on_error", "output"),
}  # fmt: skip
WIDEST = 24  # of the left column
LONGEST_CHOICE = 14  # of choices beside their option
LONGEST_LINE = 62  # of names of common options


def option_groups(command: click.Command, ctx: click.Context) -> dict[str, list[click.Option]]:
    """Return the options of a command under the headings of GROUPS, those of its own first; no heading is empty."""
    own = OWN.get(command.name or "", ())
    options = {each.name or "": each for each in command.get_params(ctx) if isinstance(each, click.Option)}
    placed = {title: [name for name in names if name not in own] for title, names in GROUPS.items()}
    common = {name for names in placed.values() for name in names}
    grouped = {"Options": [name for name in options if name not in common], **placed}
    found = {title: [options[name] for name in names if name in options] for title, names in grouped.items()}
    return {title: shown for title, each in found.items() if (shown := [one for one in each if not one.hidden])}


def write_options(formatter: click.HelpFormatter, groups: Mapping[str, Sequence[click.Option]]) -> None:
    """Write options under their headings, each with its meaning."""
    rows = {title: list(map(option_row, options)) for title, options in groups.items()}
    width = max((len(left) for each in rows.values() for left, _ in each if len(left) <= WIDEST), default=0)
    for title, each in rows.items():
        formatter.write(f"{title}:\n")
        with formatter.indentation():
            formatter.write_dl([(left.ljust(width), text) for left, text in each], WIDEST, col_spacing=1)


def _write_names(formatter: click.HelpFormatter, groups: Mapping[str, Sequence[click.Option]]) -> None:
    """Write a line of names for each heading; what one of 80 columns has no room for is left to --help-all."""
    rows = []
    for title, options in groups.items():
        line = " ".join(each.opts[0] for each in options)
        cut = f"{line[:LONGEST_LINE].rpartition(' ')[0]} .." if len(line) > LONGEST_LINE else line
        rows.append((title.partition(" ")[0], cut))
    with formatter.section("Common options (explained by --help-all and help common)"):
        formatter.write_dl(rows)


class WithHelp(click.Command):
    """A command with -h, --help and --help-all."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Add --help-all, which click does not know."""
        super().__init__(*args, **kwargs)
        self.params.append(HELP_ALL)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of this command, and a line for each group that others have too; then the commands."""
        groups = option_groups(self, ctx)
        formatter.write_paragraph()
        if ctx.meta.get(EVERYTHING):
            write_options(formatter, groups)
        else:
            write_options(formatter, {"Options": groups.pop("Options")})
            if groups:
                _write_names(formatter, groups)
        if isinstance(self, click.Group):
            self.format_commands(ctx, formatter)

    def get_help_option(self, ctx: click.Context) -> click.Option | None:  # noqa: ARG002 - click's signature
        """Return the one help option."""
        return HELP_OPTION


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
    """The commands of a table, each imported when it is called and not before."""

    table = COMMANDS

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Answer a call without arguments with help; click's own way to it has changed with its versions."""
        if not args and not ctx.resilient_parsing:
            show_help(ctx)
            ctx.exit()
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Name the commands, in the table's order."""
        return list(self.table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        """Import one command, or say which ones there are."""
        if cmd_name not in self.table:
            otherwise = f"`{ctx.command_path} --help` lists all, `frametool help WORD` searches"
            hint = any_near(cmd_name, self.table, otherwise)
            raise click.UsageError(f"no command {shown(cmd_name)}{hint}", ctx)
        found: click.Command = import_module(self.table[cmd_name][0]).command
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """List the commands from the table, without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, summary) in self.table.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete command names from the table."""
        from click.shell_completion import CompletionItem

        named = [CompletionItem(name, help=row[1]) for name, row in self.table.items() if name.startswith(incomplete)]
        return named + click.Command.shell_complete(self, ctx, incomplete)


def _show_version(ctx: click.Context, _: click.Parameter, chosen: bool) -> None:  # click's signature
    """Print the version; a literal, because asking importlib.metadata for it takes 25 ms."""
    if chosen:
        with writing(None) as write:
            write(f"frametool {__version__}\n{_surroundings() if ctx.params.get('all_versions') else ''}")
        ctx.exit()


EXTRAS = {"rosbags": "bag", "pyarrow": "arrow", "laspy": "las", "matplotlib": "plot"}  # package -> extra with it


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


@click.command(cls=Group, help=HELP)
@click.option("-v", "all_versions", is_flag=True, is_eager=True,
              help="with --version: of Python and of its packages too")  # fmt: skip
@click.option("--version", is_flag=True, expose_value=False, callback=_show_version,
              help="Show the version and exit.")  # fmt: skip
def group(all_versions: bool) -> None:
    """Hold the commands."""


def called(arguments: list[str]) -> object:
    """Call a command and return its result.

    Not by click's own `main`, which writes to stderr at Ctrl-C and turns a closed pipe into status 1.
    """
    if instruction := os.environ.get(COMPLETION):
        from frametool.cli.completion import answer

        answer(group, COMPLETION, instruction, " ".join(arguments))
        return 0
    with group.make_context("frametool", arguments) as ctx:
        return group.invoke(ctx)


def called_in(
    parent: click.Context, words: Sequence[str], prepare: Callable[[click.Context], None] | None = None
) -> object:
    """Call the command that words begin with, in a context of the group that is there.

    parent: context of the group
    prepare: is shown the command's context before it runs
    """
    name, *rest = words
    with group.get_command(parent, name).make_context(name, rest, parent=parent) as ctx:
        if prepare:
            prepare(ctx)
        return ctx.command.invoke(ctx)


def answered(call: Callable[[], object], arguments: Sequence[str]) -> int:
    """Return the status of a call of a command; raise FrametoolError for all that a user did wrong."""
    try:
        result = call()
    except click.exceptions.Exit as end:
        return end.exit_code
    except click.ClickException as error:
        raise Misused(_usage(error, arguments)) from None
    return result if isinstance(result, int) else 0


def _usage(error: click.ClickException, arguments: Sequence[str]) -> str:
    """Put a usage error on one line, with how the command is called; what it quotes of the arguments is cut."""
    from frametool.cli.replaced import replacement

    ctx = getattr(error, "ctx", None)
    message = error.format_message().replace("\n", " ").rstrip(".")
    if isinstance(error, click.NoSuchOption):  # each version of click has its own words
        name, near = error.option_name, error.possibilities or ()
        message = f"no such option {shown(name)}{did_you_mean(name, near)}"
    message = replacement(arguments) or message
    for text in (part for each in arguments for part in (each, *each.split("=", 1)) if len(repr(part)) > SHOWN):
        message = message.replace(repr(text), shown(text)).replace(text, shown(text)[1:-1])
    if message[1:2].islower():
        message = message[0].lower() + message[1:]
    if ctx is None or ctx.parent is None:
        return message
    pieces = " ".join(ctx.command.collect_usage_pieces(ctx))
    return f"{ctx.info_name}: {message}; usage: {ctx.command_path} {pieces}"
