"""A page for each example file: what is in it, and the questions that use it."""

from __future__ import annotations

from site_pages.cookbook import EXAMPLES, asked_about, example_files, form_of
from site_pages.markup import Page, Section, bullets, fenced, links, see_also, slug

MOST = 60  # lines that a page shows


def section() -> Section:
    """Return the pages of all example files."""
    pages = [Page(f"examples/{slug(name)}.md", name, name, "", _text(name)) for name in example_files()]
    about = "What the commands of the cookbook read: `frametool examples -o examples` copies them into a folder."
    return Section("examples", "Example files", about, {"": pages})


def _text(name: str) -> str:
    parts = [f"`frametool examples {name}` prints this file."]
    if name.endswith(".mcap"):
        parts = [f"`frametool examples {name} -o {name}` copies this recording, `frametool tree {name}` draws its frames."]
    elif name.endswith((".svg", ".png")):
        parts.append(f"![{name}]({name})")
    else:
        lines = (EXAMPLES / name).read_text("utf-8").splitlines()
        more = f"\n.. and {len(lines) - MOST} more lines" if len(lines) > MOST else ""
        parts.append(fenced("\n".join(lines[:MOST]) + more))
    if asked := asked_about("files", name):
        parts += ["## In the cookbook", bullets(asked)]
    return "\n\n".join([*parts, see_also({"Form": links("formats", filter(None, [form_of(name)]))})])
