"""A page for each question of the cookbook: the commands, what they print, why, their options, where to read on."""

from __future__ import annotations

import re

from frametool.cli.command import option_row
from frametool.cli.commands.help import topics
from site_pages import try_it
from site_pages.cookbook import Question, questions
from site_pages.markup import Page, Section, definitions, fenced, links, see_also


def section(calculator: str = "") -> Section:
    """Return the pages of all questions, by chapter; with the address of the calculator what runs there leads to it."""
    chapters: dict[str, list[Page]] = {}
    for each in questions():
        chapters.setdefault(each.chapter, []).append(Page(each.path, each.title, each.title, "", _text(each, calculator)))
    return Section("cookbook", "Cookbook", "Questions people ask, each with the command that answers it.", chapters)


def _text(question: Question, calculator: str) -> str:
    parts = [fenced("".join(f"$ {command}\n{output}" for command, output in question.shell), "console")]
    if calculator and (tried := _tried(question, calculator)):
        parts.append(f'<p class="try">{" ".join(tried)}</p>')
    if question.prose:
        parts += ["## Why, and what to mind", _linked(question.prose)]
    options = {option.name: option_row(option) for call in question.calls for option in call.options}
    if options:
        parts += ["## The options", definitions(options.values())]
    return "\n\n".join([*parts, see_also({
        "Commands": links("commands", question.commands),
        "Topics": links("topics", question.topics),
        "Forms of files": links("formats", question.forms),
        "Files": links("examples", question.files),
    })])  # fmt: skip


def _tried(question: Question, calculator: str) -> list[str]:
    """Return links that open the calculator with those commands of a question that run there."""
    found = []
    for number, (command, _) in enumerate(question.shell, 1):
        if command in try_it.lines():
            label = "Try it" if len(question.shell) == 1 else f"Try command {number}"
            found.append(f'<a href="{calculator}{try_it.link(try_it.lines()[command])}">{label}</a>')
    return found


def _linked(prose: str) -> str:
    """Return sentences of the cookbook with links to the topics and pictures they name."""
    for name in topics():
        prose = prose.replace(f"`frametool help {name}`", f"[`frametool help {name}`](/topics/{name}.md)")
    return re.sub(r"\]\((\w+\.svg)\)", r"](/examples/\1)", prose)
