"""A page for each topic of `frametool help`."""

from __future__ import annotations

import re

from frametool.cli.commands.help import topic, topics
from site_pages.calls import commands
from site_pages.cookbook import asked_about
from site_pages.markup import Page, Section, bullets, document, links, see_also


def section() -> Section:
    """Return the pages of all topics."""
    pages = [Page(f"topics/{name}.md", name, title, title, _text(name)) for name, title in topics().items()]
    return Section("topics", "Topics", "One subject each. In the terminal: `frametool help TOPIC`.", {"": pages})


def _text(name: str) -> str:
    text = topic(name).partition("\n")[2]
    parts = [document(text), f"In the terminal: `frametool help {name}`."]
    if asked := asked_about("topics", name):
        parts += ["## In the cookbook", bullets(asked)]
    shown = [each for each in commands() if re.search(rf"\bframetool {each}\b", text)]
    others = [each for each in topics() if each != name and re.search(rf"\bhelp {each}\b", text)]
    return "\n\n".join([*parts, see_also({"Commands": links("commands", shown), "Topics": links("topics", others)})])
