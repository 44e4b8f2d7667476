"""A page for each form of files: what it is, how it is known, what its numbers mean, what it leaves open or loses."""

from __future__ import annotations

import re
from textwrap import indent

from frametool.formats.table import FORMATS, Format, example_of, option_of
from site_pages.cookbook import asked_about, example_files, form_of
from site_pages.markup import Page, Section, bullets, fenced, inline, links, see_also

READ = {  # what is read from a form, in words
    "tree": "a tree of frames, wherever a command takes a TREE",
    "trajectory": "a trajectory, the poses of one frame over time",
    "records": "records, one after the other: poses, points, vectors, messages",
    "rows": "rows of a table, a pose or a point each",
    "arrays": "columns of numbers: points or poses by the million",
    "joints": "values of joints by name (`--joints`)",
    "cameras": "cameras, the intrinsics (`--camera`)",
    "drawing": "who hangs under whom, without poses, by `frametool tree` alone",
}
WRITTEN = {
    "poses": "poses",
    "points": "points and vectors",
    "tree": "a tree of frames",
    "trajectory": "a trajectory, the poses of one frame over time",
    "arrays": "columns of numbers",
    "texts": "columns of text among them",
    "report": "reports: tables of what a command found",
    "recording": "a recording: messages with their stamps",
}
KNOWN = {  # kinds of signs, in words; of a pattern that is more than words only the kind is told
    "magic": "its first bytes",
    "folder": "a folder that holds {}",
    "xml text": "what its XML holds",
    "xml": "the root element {} of its XML",
    "json path": "the keys {} of its JSON",
    "json key": "the outermost key {} of its JSON",
    "own key": "an outermost key {}",
    "yaml key": "an outermost key {}",
    "yaml inner": "a key {} further in",
    "text": "the look of its first lines",
    "entries": "a pose under each of its names",
    "line": "the look of its first line of data",
    "leaves": "numbers under the keys {}",
    "begin": "how it begins",
    "header": "its header, or the look of its first line",
}
ASKED = {  # why there is such an option
    "frames": "the names of its frames, which it does not hold",
    "stamps": "a file of times, where it counts instead",
    "camera_axes": "which axes its cameras have, where they are others",
    "direction": "which way its matrices go, where a key does not say it",
    "dh": "which of the two conventions its parameters follow",
    "order": "the order of its quaternions",
    "edges": "to take its edges instead of its vertices",
}


def section() -> Section:
    """Return the pages of all forms: those that are read, those only written."""
    groups: dict[str, list[Page]] = {"Read": [], "Only written": []}
    for name, row in FORMATS.items():
        kind = "Read" if row.reads else "Only written"
        groups[kind].append(Page(f"formats/{name}.md", name, f"{name}: {row.summary}", row.summary, _text(name, row)))
    about = "What is in a file, what its numbers mean, how it is known: `frametool formats NAME` prints the same."
    return Section("formats", "Forms of files", about, groups)


def _text(name: str, row: Format) -> str:
    facts = {
        "What its numbers mean": [inline(row.conventions)],
        "Suffixes": [f"`{each}`" for each in row.suffixes],
        "Files called": [f"`{each}`" for each in row.names],
        "Columns": [f"`{' '.join(row.rows.columns)}`" if row.rows.columns else ""],
        "Read as": [READ.get(each, each) for each in row.reads],
        "Written from": [WRITTEN.get(each, each) for each in row.writes],
        "How it is recognised": _signs(name, row),
        "What it leaves open": [f"`{option_of(each)}`: {ASKED.get(each, 'what it does not say')}" for each in row.required_options],
        "What is lost": [inline(row.not_stored)],
    }
    parts = [bullets(_fact(title, texts) for title, texts in facts.items() if any(texts))]
    if lines := example_of(name, 76):
        parts += ["## Example", fenced("\n".join(lines))]
    if asked := asked_about("forms", name):
        parts += ["## In the cookbook", bullets(asked)]
    also = {"Topics": ["formats"], "Commands": ["formats"], "Examples": [each for each in example_files() if form_of(each) == name]}
    return "\n\n".join([*parts, see_also({kind: links(kind.lower(), found) for kind, found in also.items()})])


def _fact(title: str, texts: list[str]) -> str:
    return f"{title}: {texts[0]}" if len(texts) == 1 else f"{title}:\n{indent(bullets(texts), '  ')}"


def _signs(name: str, row: Format) -> list[str]:
    """Return how a form is known, in words, each once."""
    found = [_sign(kind, what) for kind, what in row.magic] + ["its suffix, where its content says nothing"] * bool(row.suffixes)
    only_told = [f"`--in {name}` only"] if row.reads else []
    return list(dict.fromkeys(found)) or only_told


def _sign(kind: str, what: str | bytes) -> str:
    words = what if isinstance(what, str) and re.fullmatch(r"[\w./*|-]+", what) else ""
    named = " or ".join(f"`{word}`" for word in words.split("|")) if words else ""
    return " ".join(KNOWN.get(kind, f"its {kind} {{}}").replace("{}", named).split())
