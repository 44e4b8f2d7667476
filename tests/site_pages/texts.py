"""The texts of the repository that are pages as they are, and where their links lead on the site."""

from __future__ import annotations

import posixpath
import re
from runpy import run_path
from typing import TYPE_CHECKING

from console import ROOT

from site_pages.markup import Page, slug

if TYPE_CHECKING:
    from collections.abc import Callable

TEXTS = {  # file -> its page, what it is called in the side bar, what it is about
    "examples/BEYOND.md": ("beyond.md", "Beyond one machine", "Points by the million in Spark, Ray, dask, DuckDB and Polars"),
    "examples/SKILL.md": ("skill.md", "For assistants", "The whole tool in brief, for an assistant or a program"),
    ".github/CONTRIBUTING.md": ("contributing.md", "Contributing", "How to change it, and what every change must pass"),
    ".github/SECURITY.md": ("security.md", "Security", "What it never does with a file, and how to report what it should not"),
    "CHANGELOG.md": ("changelog.md", "Changelog", "What is new in which version"),
}
CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)


def pages() -> list[Page]:
    """Return the pages of the texts there are."""
    found = []
    for file, (path, label, about) in TEXTS.items():
        if (ROOT / file).is_file():
            title, _, text = text_of(file).removeprefix("# ").partition("\n")
            found.append(Page(path, label, title, about, text.strip()))
    return found


def home() -> str:
    """Return README as somebody reads it who has no clone."""
    return text_of("README.md", run_path(str(ROOT / ".ci" / "release.py"))["with_setup"])


def text_of(file: str, changed: Callable[[str], str] = str) -> str:
    """Return a text of the repository, without a head for programs; its links begin at the top of the site."""
    text = re.sub(r"(?s)\A---\n.*?\n---\n", "", changed((ROOT / file).read_text("utf-8")))
    pieces = CODE.split(text)  # a link in code is none
    pieces[::2] = [re.sub(r"\]\((?![a-z][a-z0-9+.-]*:|[#/])([^)\s#]+)", lambda link: f"]({page_of(file, link[1])}", piece) for piece in pieces[::2]]
    return "".join(pieces).strip()


def page_of(file: str, link: str) -> str:
    """Return the page for a relative link in a file of the repository."""
    target = posixpath.normpath(posixpath.join(posixpath.dirname(file), link))
    folder, _, name = target.rpartition("/")
    pages = {name: row[0] for name, row in TEXTS.items()} | {"README.md": "index.md", "examples/COOKBOOK.md": "cookbook/index.md"}
    if link.endswith(".svg") and folder == ".github":
        return f"/static/{name}"
    if target in pages:
        return f"/{pages[target]}"
    if folder == "examples" and (ROOT / target).is_file():
        return f"/examples/{slug(name)}.md"
    raise SystemExit(f"{file}: {link} has no page; give it a row in TEXTS of {__file__}, or link to its address")
