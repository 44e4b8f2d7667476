"""A page for each public name of the package: how it is called, and what its docstring says."""

from __future__ import annotations

import inspect
import re
from textwrap import fill
from typing import Any

import frametool
from site_pages.markup import Page, Section, document, fenced

TABLES = {  # a table has no docstring; that of the package is about it
    "FORMATS": "The forms of files, name -> row: what is read from a form and written in it, what its numbers mean.",
}


def section() -> Section:
    """Return the pages of what `import frametool` offers."""
    names = sorted((name for name in frametool.__all__ if not name.startswith("_")), key=str.lower)
    return Section("python", "Python", "What `import frametool` offers.", {"": [_page(name, _meant(name)) for name in names]})


def _meant(name: str) -> Any:
    """Return what a name stands for; of a folder that can be called, the function in it."""
    value = getattr(frametool, name)
    return frametool.__getattr__(name) if inspect.ismodule(value) and callable(value) else value


def _page(name: str, value: Any) -> Page:
    about, _, rest = (TABLES.get(name) or inspect.getdoc(value) or "").partition("\n")
    parts = [*_signature(name, value), document(about), document(rest, listed=True)]
    for inner, member in _members(value).items():
        parts += [f"## {inner}", *_signature(inner, member), document(inspect.getdoc(member) or "", listed=True)]
    return Page(f"python/{name}.md", name, f"frametool.{name}", about.rstrip("."), "\n\n".join(filter(None, parts)))


def _members(value: Any) -> dict[str, Any]:
    """Return the functions of a module that are its own; the methods and properties of a class, inherited ones too."""
    if not inspect.isclass(value) and not inspect.ismodule(value):
        return {}
    home = value.__name__ if inspect.ismodule(value) else "frametool"
    found = {name: getattr(value, name) for name in dir(value) if not name.startswith("_")}
    return {name: member for name, member in found.items() if _module(member).startswith(home) and inspect.getdoc(member)}


def _module(member: Any) -> str:
    return str(getattr(getattr(member, "fget", member), "__module__", ""))


def _signature(name: str, value: Any) -> list[str]:
    """Return how a function or class is called, folded; nothing for a table, a module or a property."""
    if not callable(value):
        return []
    plain = re.sub(r"(: |-> )'([^']*)'", r"\1\2", f"{name}{inspect.signature(value)}")
    plain = re.sub(r"\(self(?:, )?", "(", plain).removesuffix(" -> None")
    return [fenced(fill(plain, 88, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False), "python")]
