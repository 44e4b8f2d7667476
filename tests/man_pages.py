"""Manual pages out of the commands' own help: `python tests/man_pages.py` writes them, a test holds them to it."""

from __future__ import annotations

import re
from pathlib import Path

import click

from frametool import __version__
from frametool.cli.command import EXIT_CODES, option_groups, option_row
from frametool.cli.commands import COMMANDS, group
from frametool.cli.commands.help import topic, topics

FOLDER = Path(__file__).resolve().parent.parent / "frametool" / "data" / "share" / "man" / "man1"


def pages() -> dict[str, str]:
    """Return the text of each page by the name of its file."""
    made = {"frametool.1": _overview()}
    for name, (_, about) in COMMANDS.items():
        command = group.get_command(click.Context(group), name)
        made[f"frametool-{name}.1"] = _of_command(name, about, command)
    return made


def _of_command(name: str, about: str, command: click.Command) -> str:
    context = click.Context(command, info_name=f"frametool {name}")
    pieces = " ".join(command.collect_usage_pieces(context))
    lines = [*_heading(f"frametool-{name}", about), ".SH SYNOPSIS", f".B frametool {name}", escaped(pieces), ".SH DESCRIPTION"]
    lines += _prose(command.help or "")
    if isinstance(command, click.Group):
        lines.append(".SH COMMANDS")
        for inner in command.list_commands(context):
            found = command.get_command(context, inner)
            lines += [".TP", f".B {escaped(inner)}", escaped((found.help or "").split("\n")[0] if found else "")]
    for title, options in option_groups(command, context).items():
        lines.append(f".SH {title.partition(' (')[0].upper()}")
        for each in options:
            left, text = option_row(each)
            lines += [".TP", f".B {escaped(left)}", escaped(text)]
    return "\n".join([*lines, *_ending(command.epilog or EXIT_CODES)]) + "\n"


def _overview() -> str:
    from frametool.cli.commands import HELP

    lines = [*_heading("frametool", "the calculator for rigid-body frames"), ".SH SYNOPSIS", ".B frametool", "COMMAND [OPTIONS] .."]
    lines += [".SH DESCRIPTION", *_prose(HELP), ".SH COMMANDS"]
    for name, (_, about) in COMMANDS.items():
        lines += [".TP", f".BR frametool-{escaped(name)} (1)", escaped(about)]
    for name in topics():
        title, _, text = topic(name).partition("\n")
        lines += [f".SH {name.upper()}", escaped(title) + ".", ".PP", ".nf", *map(escaped, text.strip("\n").split("\n")), ".fi"]
    return "\n".join([*lines, *_ending()]) + "\n"


def _heading(name: str, about: str) -> list[str]:
    return [f'.TH {name.upper()} 1 "" "frametool {__version__}" "frametool"', ".SH NAME", f"{name} \\- {escaped(about)}"]


def _ending(exit_codes: str = EXIT_CODES) -> list[str]:
    return [".SH EXIT STATUS", escaped(exit_codes.removeprefix("Exit codes: ").rstrip(".")) + ", 130 interrupted."]


def _prose(text: str) -> list[str]:
    """Return the paragraphs of a help; what it keeps as written stays so."""
    lines: list[str] = []
    for paragraph in re.split(r"\n\s*\n", text.strip()):
        kept = paragraph.lstrip().startswith("\b")
        body = [line.strip() for line in paragraph.replace("\b", "").split("\n") if line.strip()]
        lines += [".PP", ".nf", *map(escaped, body), ".fi"] if kept else [".PP", escaped(" ".join(body))]
    return lines


def escaped(text: str) -> str:
    """Write text so that it means nothing to the formatter."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{text}" if text.startswith((".", "'")) else text


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for old in FOLDER.glob("*.1"):
        old.unlink()
    for name, text in pages().items():
        (FOLDER / name).write_text(text)
