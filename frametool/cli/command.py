"""Define commands: their inputs, arguments, options and help, and how click parses them.

An option that was passed but not used before the first result is written has no effect: this is a usage error, and
nothing is written.
"""

from __future__ import annotations

import re
import sys
from contextlib import contextmanager, suppress
from functools import cache, partial, reduce
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar

import click

from frametool.cli.sink import CHECKS, say, show
from frametool.errors import FormatError, FrametoolError, ValueInvalid, heard_by

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.geometry.place import Earth

    Record = TypeVar("Record")
    Adds = Callable[[Any], Any]
    Lists = Callable[[click.HelpFormatter, bool], None]
    Offers = Callable[[click.Context, str], Mapping[str, str] | None]

# an argument that begins like this is a number, not a short option
NEGATIVE = r"(?i)-(\d|\.\d|inf(inity)?$|nan$|pi\b|[jk]$|[ijk] ?[-+].| +(Translation:|Rotation:|Pose \[)|--\s)"
EXIT_CODES = "Exit codes: 0 done, 1 bad data, 2 usage, 3 rows skipped, 4 lookup, 5 file."
EVERYTHING = "frametool.everything"  # key of a context's `meta`: True for --help-all
INPUTS = "frametool.inputs"  # key of a context's `meta`: the Inputs of the command
# values of repeatable options in commands that do not have them
WITHOUT = {"input_formats": (), "topics": (), "joints": (), "joint_files": (), "named_frames": (), "messages": ()}


class Inputs:
    """The arguments and options of a command, by the names of its parameters; reading one marks it as used.

    unused: name -> option, of the options that were passed and are not used yet
    peek: function that returns a value without marking it as used
    reads_trees: True once files of frames are opened, to which --in applies too
    earth: the options on geodetic positions, set when first needed
    """

    def __init__(self, values: dict[str, Any], unused: dict[Any, Option]) -> None:
        """Store the values, and the options that were passed."""
        values |= WITHOUT | values
        self._values, self.unused = values, unused
        self.peek: Callable[[str], Any] = values.get
        self.reads_trees = False
        self.earth: Earth | None = None

    def __getattr__(self, name: str) -> Any:
        """Return the value of an argument or option and mark it as used; None if the command does not have it."""
        if name.startswith("_"):
            raise AttributeError(name)
        self.unused.pop(name, None)
        return self._values.get(name)

    def use(self, *names: str) -> None:
        """Mark options as used."""
        for name in names:
            self.unused.pop(name, None)

    def update(self, **values: Any) -> None:
        """Replace values, such as topics by those that are left for other readers."""
        self._values |= values

    def changed(self, **values: Any) -> Inputs:
        """Return these inputs with other values for some parameters."""
        return Inputs(self._values | values, self.unused)

    def note(self, *texts: str | None) -> None:
        """Report what is assumed of the input, unless --quiet; empty texts are skipped."""
        for text in () if self.quiet else filter(None, texts):
            say(text)

    def refuse_unused(self, *names: str) -> None:
        """Raise a usage error for options, or some of them, that were passed but not used."""
        if unused := [option.opts[-1] for name, option in self.unused.items() if not names or name in names]:
            raise click.UsageError(f"{', '.join(unused)} {'has' if len(unused) == 1 else 'have'} no effect here")


class Option(click.Option):
    """An option with its relations to others of the command, by the names of their parameters, and its help heading.

    excludes: options that cannot be combined with it
    requires: one of these must be passed too
    under: the first word of its heading
    """

    def __init__(self, names: Any, excludes: Any = (), requires: Any = (), under: str = "Options", **rest: Any) -> None:
        """Store the relations and the heading; rest: arguments of click.Option."""
        super().__init__(names, **rest)
        self.excludes, self.requires, self.under = excludes, requires, under


def refuse(is_wrong: object, message: str) -> None:
    """Raise a usage error if the condition is true."""
    if is_wrong:
        raise click.UsageError(message)


def refuse_two_readers(arguments: Iterable[str]) -> None:
    """Raise a usage error if two arguments are standard input."""
    refuse([*arguments].count("-") > 1, "standard input can be read once; only one argument may be -")


def say_if_typed(argument: str = "-") -> None:
    """Report that input is read from the terminal, if the argument is standard input and that is one."""
    if argument == "-" and sys.stdin is not None and sys.stdin.isatty():
        say("reading from the terminal; end with Ctrl-D")


@contextmanager
def misuse(where: str = "") -> Iterator[None]:
    """Convert ValueInvalid into a usage error that begins with `where`; NotARotation is raised unchanged."""
    try:
        yield
    except ValueInvalid as error:
        from frametool.grammar.readers import NotARotation

        if isinstance(error, NotARotation):
            raise
        raise click.UsageError(f"{where}{error}") from None


def marking_use(inputs: Inputs, kind: type[Record], options: Mapping[str, Sequence[str]]) -> type[Record]:
    """Return a subclass of a record type that marks options as used when a field that is not empty is read.

    options: field -> the names of its options
    """

    def look_at(record: Record, name: str) -> Any:
        value = kind.__getattribute__(record, name)
        if value and name in options:
            inputs.use(*options[name])
        return value

    return type(kind.__name__, (kind,), {"__getattribute__": look_at, "__slots__": ()})


def show_help(ctx: click.Context, *, everything: bool = False, paged: bool = False) -> None:
    """Print the help of a command; with `everything` all its options are explained."""
    ctx.meta[EVERYTHING] = everything
    show(f"{ctx.get_help()}\n", paged=paged or everything)


def _help(ctx: click.Context, option: click.Parameter, chosen: bool) -> None:  # click's signature
    if chosen:
        show_help(ctx, everything=option is HELP_ALL)
        ctx.exit()


def option_row(option: click.Option) -> tuple[str, str]:
    """Return the names of an option with its value, and its meaning; a long list of choices is part of the meaning."""
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


# defined here because click's own, which are translated, import `locale`, 2 ms of every start
HELP_OPTION = click.Option(
    ["-h", "--help"], is_flag=True, is_eager=True, expose_value=False, callback=_help,
    help="this message; --help-all explains every option",
)  # fmt: skip
HELP_ALL = click.Option(
    ["--help-all"], is_flag=True, is_eager=True, expose_value=False, callback=_help, hidden=True, help="all options"
)


HEADINGS = (
    "Options", "Files (help formats)", "Time (help time)", "Rotations (help rotations, help earth)",
    "Rows (help streams)", "Result (help errors)", "Formats that do not specify something (help formats)",
    "Turtles (help turtles)",
)  # fmt: skip
WIDEST = 24  # columns of the option names
LONGEST_CHOICE = 14  # characters of choices in the left column
LONGEST_LINE = 62  # characters of the names of common options


def grouped(options: Iterable[click.Parameter], own: Sequence[str] = ()) -> dict[str, list[click.Option]]:
    """Return options by heading, those in `own` under the first one; empty headings are omitted."""
    found: dict[str, list[click.Option]] = {title: [] for title in HEADINGS}
    for each in options:
        if isinstance(each, click.Option) and not each.hidden:
            under = HEADINGS[0] if each.name in own else getattr(each, "under", HEADINGS[0])
            found[next(title for title in HEADINGS if title.startswith(under))].append(each)
    return {title: each for title, each in found.items() if each}


def option_groups(command: click.Command, ctx: click.Context) -> dict[str, list[click.Option]]:
    """Return the options of a command by heading; its own main options are under the first."""
    return grouped(command.get_params(ctx), getattr(command, "own", ()))


def write_options(formatter: click.HelpFormatter, groups: Mapping[str, Sequence[click.Option]]) -> None:
    """Write options under their headings, each with its meaning."""
    rows = {title: list(map(option_row, options)) for title, options in groups.items()}
    width = max((len(left) for each in rows.values() for left, _ in each if len(left) <= WIDEST), default=0)
    for title, each in rows.items():
        formatter.write(f"{title}:\n")
        with formatter.indentation():
            formatter.write_dl([(left.ljust(width), text) for left, text in each], WIDEST, col_spacing=1)


def _is_negative(argument: str) -> bool:
    """Return True if an argument is a negative number; the pattern, slow to compile, is used only if it may match."""
    is_long = argument[:2] == "--" and argument[2:3].isalpha()
    return argument[:1] == "-" and not is_long and re.match(NEGATIVE, argument) is not None


class Text(click.types.StringParamType):
    """The type of a text argument: removes the space that protects negative numbers; a file name may have any bytes.

    read: parses the text; ValueInvalid from it is a usage error of the option
    offers: returns the shell's completions and their meanings; None for file names, which the shell completes itself
    choices: all valid texts, if they are few
    """

    name = "text"

    def __init__(
        self, read: Callable[[str], Any] = str, offers: Offers = lambda _ctx, _incomplete: {},
        choices: Collection[str] = (),
    ) -> None:  # fmt: skip
        """Store the functions and the choices."""
        self.read, self.offers, self.choices = read, offers, choices

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Remove the space, and parse the text."""
        if not isinstance(value, str):
            return value
        try:
            return self.read(value[1:] if value[:1] == " " and _is_negative(value[1:]) else value)
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)

    def offered(self, ctx: click.Context, incomplete: str) -> Mapping[str, str] | None:
        """Return the completions, without any messages; none if a file cannot be read."""
        with heard_by(lambda *_: None), suppress(FrametoolError, click.UsageError, OSError):
            return self.offers(ctx, incomplete)
        return {}

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Return the completions that begin with the incomplete word."""
        from click.shell_completion import CompletionItem

        offered = self.offered(ctx, incomplete)
        if offered is None:
            return [CompletionItem(incomplete, type="file")]
        return [CompletionItem(word, help=about) for word, about in offered.items() if word.startswith(incomplete)]


TEXT = Text()
FILE = Text(offers=lambda _ctx, _incomplete: None)
# options whose =VALUE may be omitted, and their values, the default first
OPTIONAL = {"--explain": ("text", "markdown"), "--rows": ("ate", "rpe", "kitti")}
OF_POSES = ("compose", "convert", "interpolate", "invert", "mean", "relative")  # they take only poses


def _kind(kind: Any, offers: Offers = TEXT.offers) -> click.ParamType[Any]:
    """Return the parameter type for a tuple of choices or a function that parses the text; offers: as for Text."""
    if isinstance(kind, click.ParamType):
        return kind
    if isinstance(kind, tuple):
        return click.Choice(kind)
    return Text(kind, offers)


def option(spec: str, about: str, kind: Any = None, name: str = "", **more: Any) -> Adds:
    """Return a decorator that adds an option.

    spec: its names and value as in its help, `-o --output FILE`; without a value and a kind it is a flag
    kind: the choices, or a function that parses the value; by default a text or a file
    name: of the parameter, if it differs from that of the option
    """
    words = spec.split()
    names = [each for each in words if each.startswith("-")]
    taken = " ".join(words[len(names) :])
    kind = kind or OPTIONAL.get(names[-1])
    if taken or kind:
        more["type"] = _kind(kind or str, FILE.offers if "FILE" in taken or taken == "TREE" else TEXT.offers)
    else:
        more["is_flag"] = True
    shows = "[default" not in about and more.get("default") not in (None, (), "")
    names += [name] * bool(name)
    made = cache(partial(Option, names, help=about, metavar=taken or None, show_default=shows, **more))

    def add(function: Any) -> Any:
        vars(function).setdefault("__click_params__", []).append(made())  # one object for all commands
        return function

    return add


def argument(name: str, kind: Any = TEXT, metavar: str | None = None, **more: Any) -> Adds:
    """Return a decorator that adds an argument; optional with a default, `required=False` or any number of values."""
    return click.argument(name, type=_kind(kind), metavar=metavar, **more)


def together(*options: Adds) -> Adds:
    """Return a decorator that adds several options, in this order in the help."""
    return lambda function: reduce(lambda made, add: add(made), reversed(options), function)


class WithHelp(click.Command):
    """A command with -h and --help, and --help-all.

    own: names of its main options, which other commands have under another heading
    lists: writes a list before the exit codes, for --help-all with explanations
    """

    def __init__(self, *args: Any, own: Sequence[str] = (), lists: Lists | None = None, **kwargs: Any) -> None:
        """Add the help options; of several options with one name the first, that of the command itself, is used."""
        super().__init__(*args, **kwargs)
        self.add_help_option = False
        names = {name: each for each in reversed(self.params) for name in each.opts}
        self.params = [*dict.fromkeys(names[each.opts[-1]] for each in self.params), HELP_ALL, HELP_OPTION]
        self.own, self.lists = own, lists

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of this command, one line per group of common options, and the subcommands."""
        groups = option_groups(self, ctx)
        formatter.write_paragraph()
        if ctx.meta.get(EVERYTHING):
            write_options(formatter, groups)
        else:
            write_options(formatter, {"Options": groups.pop("Options")})
            rows = []
            for title, options in groups.items():  # those that do not fit in 80 columns are only in --help-all
                line = " ".join(each.opts[0] for each in options)
                cut = f"{line[:LONGEST_LINE].rpartition(' ')[0]} .." if len(line) > LONGEST_LINE else line
                rows.append((title.partition(" ")[0], cut))
            if rows:
                with formatter.section("Common options (explained by --help-all and help common)"):
                    formatter.write_dl(rows)
        if isinstance(self, click.Group):
            self.format_commands(ctx, formatter)


class Command(WithHelp):
    """A command whose arguments may be negative numbers.

    click takes `-1e-3` for options. A space before each such argument prevents this and preserves click's check of
    misspelled options; `Text` removes the space.
    """

    parser: Any = None

    def make_parser(self, ctx: click.Context) -> Any:
        """Return click's parser, created once for all calls, also those of a batch."""
        self.parser = self.parser or super().make_parser(ctx)
        self.parser.ctx = ctx
        return self.parser

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Protect negative numbers (but not -j if that is an option), add default values of options, then parse."""
        if any(map(_is_negative, args)):
            options = {name for each in self.get_params(ctx) for name in each.opts}
            args = [f" {each}" if _is_negative(each) and each not in options else each for each in args]
        if "inv" in args:
            args = _join_inverses(args, ctx, always=self.name in OF_POSES)
        if not OPTIONAL.keys().isdisjoint(args):
            for name, value in pairwise(args):
                if value in OPTIONAL.get(name, ()) and not ctx.resilient_parsing:
                    raise click.UsageError(f"{name} {value} is gone: {name}={value}", ctx)
            args = [f"{each}={OPTIONAL[each][0]}" if each in OPTIONAL else each for each in args]
        passed: dict[Any, Option] = {}
        for each in () if ctx.resilient_parsing else self.make_parser(ctx).parse_args(args=[*args])[2]:
            if isinstance(each, Option) and each.name not in ("quiet", "verbose"):
                if each.name in passed and not (each.multiple or each.is_flag):
                    raise click.UsageError(f"{each.opts[-1]} appears twice; only one can be used", ctx)
                passed[each.name] = each
        rest = super().parse_args(ctx, args)
        for option in passed.values():
            for other in option.excludes:
                if other in passed:
                    raise click.UsageError(f"{option.opts[-1]} and {passed[other].opts[-1]} exclude each other", ctx)
            if option.requires and passed.keys().isdisjoint(option.requires):
                known = {each.name: each.opts[-1] for each in self.params}
                choices = " or ".join(known[needed] for needed in option.requires if needed in known)
                raise click.UsageError(f"{option.opts[-1]} needs {choices}", ctx)
        ctx.meta[INPUTS] = Inputs(ctx.params, passed)
        return rest

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; raises a usage error for options without effect before anything is written."""
        passed: Inputs = ctx.meta[INPUTS]
        CHECKS.append(passed.refuse_unused)
        try:
            result = ctx.invoke(self.callback or (lambda _: 0), passed)
        except FormatError as error:
            advised = re.search(r"; (?:give|name them with) (--[\w-]+)$", error.message)
            if advised and not any(advised[1] in each.opts for each in self.params):  # not an option of this command
                error.message = error.message[: advised.start()]
            raise
        finally:
            CHECKS.pop()
        passed.refuse_unused()
        return result

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the exit codes at the end of the help: those of the epilog, or the common ones."""
        formatter.write_paragraph()
        if self.lists:
            self.lists(formatter, bool(ctx.meta.get(EVERYTHING)))
            formatter.write_paragraph()
        formatter.write_text(self.epilog or EXIT_CODES)


def _join_inverses(args: list[str], ctx: click.Context, *, always: bool) -> list[str]:
    """Rewrite the word `inv` and the pose after it as inv(POSE); always: also if the next word may not be a pose."""
    joined: list[str] = []
    for each in reversed(args):
        is_pose = bool(joined) and (always or joined[-1].lstrip(" ~").startswith(("{", "[", "inv(", "p[")))
        if each == "inv" and is_pose and not joined[-1].startswith("--"):
            joined.append(f"inv({joined.pop()})")
        elif each == "inv" and always:
            raise click.UsageError("inv stands before the pose whose inverse is meant; nothing follows it", ctx)
        else:
            joined.append(each)
    return joined[::-1]


command_named = partial(click.command, cls=Command)  # decorator of the function of a command
