"""A page for each command, out of what its `--help-all` says."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import option_groups, option_row
from frametool.cli.commands.help import described, topics
from site_pages.calls import commands
from site_pages.cookbook import asked_about, topics_with
from site_pages.markup import Page, Section, bullets, definitions, document, fenced, inline, links, see_also, slug

if TYPE_CHECKING:
    from collections.abc import Mapping


def section() -> Section:
    """Return the pages of all commands."""
    pages = [
        Page(f"commands/{slug(name)}.md", name, f"{name}: {about}", about, _text(name, command))
        for name, (command, about) in commands().items()
    ]
    return Section("commands", "Commands", "In the terminal: `frametool COMMAND --help-all`.", {"": pages})


def _text(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=name)
    facts = described(name, command, context)
    parts = [fenced(facts["usage"], "sh"), document(inspect.cleandoc(command.help or "").replace("\b\n", ""))]
    if inner := [each for each in commands() if each.startswith(f"{name} ")]:
        parts += ["## Commands", bullets(f"[{each}](/commands/{slug(each)}.md): {inline(commands()[each][1])}" for each in inner)]
    if facts["arguments"]:
        parts += ["## Arguments", bullets(map(_argument, facts["arguments"]))]
    for title, options in option_groups(command, context).items():
        parts += [f"## {title.partition(' (')[0]}", definitions(map(option_row, options))]
    parts += ["## Exit codes", bullets(f"`{code}`: {inline(meaning)}" for code, meaning in facts["exit_codes"].items())]
    if asked := asked_about("commands", name):
        parts += ["## In the cookbook", bullets(asked)]
    about = [each for each in topics() if each == name or each in topics_with(name)]
    return "\n\n".join([*parts, see_also({"Topics": links("topics", about)})])


def _argument(facts: Mapping[str, Any]) -> str:
    """Return what there is to say of an argument: its name, whether it must be there, how often it may."""
    often = {(True, True): ", one or more", (False, True): ", any number"}.get((facts["required"], facts["repeated"]), "")
    return f"`{facts['name'].strip('[].')}`{often}{'' if facts['required'] or often else ', may be left out'}"
