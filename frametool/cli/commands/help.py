"""Show what the package contains: `help` on topics, commands and words, the cookbook, the example files."""

from __future__ import annotations

import os
import re
from shutil import get_terminal_size
from textwrap import fill
from typing import TYPE_CHECKING, Any

import click

from frametool import __version__
from frametool.cli import command as shared
from frametool.cli.command import EXIT_CODES, FILE, Inputs, Text, argument, command_named, option, refuse
from frametool.cli.commands import COMMANDS, group
from frametool.cli.sink import file_errors, refuse_existing, show, writing
from frametool.errors import FileProblem, ValueInvalid, any_near, shown
from frametool.formats.table import FORMATS, format_entry

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


PACKAGE = os.path.dirname(os.path.dirname(os.path.dirname(__file__)))
EXAMPLES = os.path.join(PACKAGE, "examples")
if not os.path.isdir(EXAMPLES):  # in the source tree they are next to the package
    EXAMPLES = os.path.join(os.path.dirname(PACKAGE), "examples")


def names() -> list[str]:
    """Return the names of the example files."""
    try:
        return sorted(each for each in os.listdir(EXAMPLES) if os.path.isfile(os.path.join(EXAMPLES, each)))
    except OSError:
        raise FileProblem(f"{EXAMPLES}: the example files are missing; install frametool anew") from None


def example(name: str) -> bytes:
    """Return the content of an example file."""
    with open(os.path.join(EXAMPLES, name), "rb") as file:
        return file.read()


FOLDER = os.path.join(os.path.dirname(os.path.dirname(__file__)), "topics")
MADE = {  # topics without a file of their own
    "common": "The options that many commands share, each with its meaning",
    "cookbook": "Questions with commands and what they print: help cookbook [WORD..]",
    "skill": "The whole tool in brief, for an assistant or a program",
    "schema": "The JSON Schema of trees in YAML and JSON, for editors",
}


def topics() -> dict[str, str]:
    """Return the topics: name -> the first line of its file."""
    names = sorted(name.removesuffix(".txt") for name in os.listdir(FOLDER) if name.endswith(".txt"))
    return {name: topic(name).partition("\n")[0] for name in names}


def topic(name: str) -> str:
    """Return the text of a topic."""
    with open(os.path.join(FOLDER, f"{name}.txt"), encoding="utf-8") as file:
        return file.read()


def questions() -> dict[str, str]:
    """Return the questions of the cookbook with their answers; commands are indented, as in topics."""
    text = re.sub(r"(?m)^## .*\n+", "", example("COOKBOOK.md").decode()).partition("\n### ")[2]
    text = re.sub(r"(?ms)^```\w*\n(.*?)^```\n", lambda block: re.sub(r"(?m)^(?=.)", "  ", block[1]), text)
    return {title: answer.strip("\n") for title, _, answer in (each.partition("\n") for each in text.split("\n### "))}


def finder(words: Iterable[str]) -> Callable[[str], bool]:
    """Return a predicate for texts with all these words, in any case, singular or plural; `y-up` is one word."""
    found = re.findall(r"\w+(?:-\w+)*", " ".join(words).lower())
    stems = []
    for each in found:  # singular or plural; a short one must be a whole word
        parts = [
            re.sub(r"s$", "", re.sub(r"(ies|y)$", "(?:ie|y)", part)) if len(part) > 3 else rf"{part}s?\b"
            for part in each.split("-")
        ]
        stems.append(r"\b" + r"\W?".join(parts))
    return lambda text: bool(stems) and all(re.search(each, text.lower()) for each in stems)


def _listed(rows: dict[str, str]) -> str:
    """Return a list of names with their descriptions, wrapped at the width of the terminal."""
    width = max(map(len, rows), default=0)
    return "".join(_wrapped(f"  {each:{width}}  {about}", width + 4) for each, about in rows.items())


def _wrapped(line: str, indent: int = 2) -> str:
    return fill(line, min(get_terminal_size().columns, 100), subsequent_indent=" " * indent) + "\n"


def _titles(label: str, titles: list[str], most: int = 12) -> str:
    most += len(titles) == most + 1
    more = [f".. and {len(titles) - most} more"] if len(titles) > most else []
    return "".join([f"{label}:\n\n", *(f"  {each}\n" for each in titles[:most] + more)])


def cookbook(words: tuple[str, ...]) -> str:
    """Return the answers whose questions have these words, else answers that have them; all questions without words."""
    known, holds = questions(), finder(words)
    if not words:
        return _titles("Questions of the cookbook (frametool help cookbook WORD shows them)", list(known), len(known))
    matching = [each for each in known if holds(each)]
    inside = [each for each in known if each not in matching and holds(f"{each} {known[each]}")]
    if not matching:
        matching, inside = inside[:3], inside[3:]
    refuse(not matching, f"no question has {shown(' '.join(words))}; `frametool help cookbook` lists all")
    answers = "".join(f"{each}\n\n{known[each]}\n\n" for each in matching)
    files = "The files: `frametool examples -o examples` copies them into a folder `examples`.\n"
    return answers + (f"{_titles('Also in', inside)}\n" if inside else "") + files


def _commands(ctx: click.Context, names: Iterable[str] = COMMANDS) -> dict[str, click.Command]:
    """Return commands and their subcommands by their names."""
    found: dict[str, click.Command] = {}
    for name in filter(COMMANDS.__contains__, names):
        found[name] = group.get_command(ctx, name)
        found |= {f"{name} {inner}": each for inner, each in getattr(found[name], "commands", {}).items()}
    return found


def _search(ctx: click.Context, name: str) -> str:
    """Return the topics, commands, formats and questions with these words; titles with the words come first."""
    known, recipes, holds = topics(), questions(), finder([name])
    for each in known:
        if holds(each) and abs(len(each) - len(name)) <= len("ies") - len("y"):  # the same, singular or plural
            return topic(each)
    about = sorted((each for each in known if holds(f"{each} {topic(each)}")), key=lambda each: not holds(known[each]))
    calls = []
    for each, one in _commands(ctx).items():  # the help of a command and of its own options
        own = shared.option_groups(one, ctx)["Options"]
        texts = [f"{one.name} {one.help}", *(f"{option.opts[-1]} {option.help}" for option in own)]
        calls += [each] * (each != "help" and any(map(holds, texts)))
    formats = [each for each, row in FORMATS.items() if holds(f"{each} {row.summary}")]
    titles = sorted((each for each in recipes if holds(f"{each} {recipes[each]}")), key=lambda each: not holds(each))
    if about and not (about[1:] or calls or formats or titles):
        return topic(about[0])
    if not (about or calls or formats or titles):
        from frametool.geometry.representations import REPRESENTATIONS

        words = known | MADE | COMMANDS | {each: "" for each in REPRESENTATIONS if len(each) > len("xyzw")}
        hint = any_near(name.lower(), words, "`frametool help` lists all topics")
        raise click.UsageError(f"no topic, command or text has {shown(name)}{hint}")
    parts = {
        f"Topics with {shown(name)} (frametool help TOPIC):\n\n{_listed({each: known[each] for each in about})}": about,
        _wrapped(f"Commands (frametool help COMMAND): {', '.join(calls)}"): calls,
        _wrapped(f"File formats (frametool formats NAME): {', '.join(formats)}"): formats,
        _titles(f"Cookbook (frametool help cookbook {name})", titles): titles,
    }  # fmt: skip
    return "\n".join(text for text, found in parts.items() if found)


def described(name: str, command: click.Command, ctx: click.Context) -> dict[str, Any]:
    """Return the description of a command for -f json."""
    lines = [line.strip() for line in (command.help or "").replace("\b\n", "").split("\n")]
    groups = shared.option_groups(command, ctx).items()
    return {
        "name": name,
        "about": lines[0],
        "usage": f"frametool {name} {' '.join(command.collect_usage_pieces(ctx))}",
        "help": "\n".join(lines).strip(),
        "examples": [line for line in lines if re.match(r"(frametool|printf|sed) .*", line)],
        "arguments": [
            {"name": each.get_usage_pieces(ctx)[0], "required": each.required, "repeated": each.nargs == -1}
            for each in command.params if isinstance(each, click.Argument)
        ],
        "options": [_option(each, title.partition(" (")[0], ctx) for title, options in groups for each in options],
        "exit_codes": _exit_codes(command.epilog or EXIT_CODES),
    }  # fmt: skip


def _exit_codes(text: str) -> dict[str, str]:
    first, *others = text.removeprefix("Exit codes: ").rstrip(".").split("; ")
    codes = dict(re.findall(r"(\d+|else) ((?:[^,]|, (?!\d|else))+)", first)) | dict(each.split(": ") for each in others)
    return codes | {"130": "interrupted"}


def _option(option: click.Option, group: str, ctx: click.Context) -> dict[str, Any]:
    kind, is_flag = option.type, option.is_flag or option.count
    choices = kind.offered(ctx, "") if isinstance(kind, Text) else getattr(kind, "choices", ())
    metavar = option.metavar or (option.opts[-1].strip("-") if choices else kind.name).upper()
    default = re.search(r"\[default: (.*?)\]", shared.option_row(option)[1])
    return {
        "names": option.opts, "metavar": None if is_flag else metavar, "choices": list(choices or ()),
        "default": default and default[1], "repeated": option.multiple, "group": group, "help": option.help,
    }  # fmt: skip


TOPIC = Text(offers=lambda _ctx, _incomplete: topics() | MADE | {name: row[1] for name, row in COMMANDS.items()})


@command_named("help")
@argument("words", TOPIC, nargs=-1, metavar="[TOPIC | COMMAND | WORD ..]")
@option("-f --format", "json: options, values and exit codes of all commands or one", ("text", "json"), name="fmt",
    default="text")  # fmt: skip
@click.pass_context
def help_command(ctx: click.Context, inputs: Inputs) -> None:
    """Explain a topic on one screen, or a command; search for any word in them and in the cookbook.

    \b
      frametool help
      frametool help pose
      frametool help convert
      frametool help hand-eye
      frametool help cookbook quaternion
      frametool help -f json lookup
    """
    words = inputs.words
    name = " ".join(words)
    named = _commands(ctx, words[:1]).get(name)
    from frametool.documents.writers import dump_json

    if inputs.fmt == "json":
        if name and not named:
            hint = any_near(name, COMMANDS, "`frametool help` lists all")
            raise click.UsageError(f"-f json is about commands, and {shown(name)} is not one{hint}")
        every = [described(each, one, ctx) for each, one in ({name: named} if named else _commands(ctx)).items()]
        whole = {
            "version": __version__, "topics": topics() | MADE, "commands": every,
            "formats": [*map(format_entry, FORMATS)], "exit_codes": _exit_codes(EXIT_CODES),
        }  # fmt: skip
        text = f"{dump_json(every[0] if named else whole)}\n"
    elif named and name not in topics():  # calc and formats are topics too
        shared.show_help(click.Context(named, parent=ctx.parent, info_name=name), paged=True)
        return
    elif not words:
        text = f"Topics (frametool help TOPIC; any other WORD is searched for):\n\n{_listed(topics() | MADE)}\n"
        text += _wrapped(f"Commands: {', '.join(COMMANDS)}")
    elif words[0] == "cookbook":
        text = cookbook(words[1:])
    elif name == "schema":
        from frametool.formats.trees.schema import schema

        text = f"{dump_json(schema())}\n"
    elif name == "common":  # options that are under another heading than `Options`, as in the first command with them
        first, found = shared.HEADINGS[0], dict[str, Any]()
        for command in _commands(ctx).values():
            shared_by_several = [each for each in command.params if getattr(each, "under", first) != first]
            found = {each.name or "": each for each in shared_by_several} | found
        formatter = ctx.make_formatter()
        shared.write_options(formatter, shared.grouped(found.values()))
        text = f"{MADE[name]}\n\n{formatter.getvalue()}"
    elif name == "skill":
        text = example("SKILL.md").decode()
    else:
        text = topic(name) if name in topics() else _search(ctx, name)
    show(text, paged=True)


def _read_example(text: str) -> str:
    """Return the name of an example; raises ValueInvalid with the nearest for an unknown one."""
    name = text.removeprefix("examples/")
    if name not in names():
        raise ValueInvalid(f"no example {shown(name)}{any_near(name, names(), '`frametool examples` lists all')}")
    return name


@command_named("examples")
@argument("name", Text(_read_example, lambda _ctx, _incomplete: dict.fromkeys(names(), "")), required=False)
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
        with file_errors(output):
            os.makedirs(output, exist_ok=True)
    else:
        targets = {name: output}
    for path in targets.values():  # all of them first: copy all or nothing
        refuse_existing(path, force=force)
    for each, path in targets.items():
        with writing(path, force=force) as write:
            write(example(each))
