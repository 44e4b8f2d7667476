"""Markdown out of the plain text of helps, topics and docstrings, and what a page and a section of the site are."""

from __future__ import annotations

import re
from textwrap import dedent
from typing import TYPE_CHECKING, NamedTuple

from frametool.cli.commands.help import topics

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


class Page(NamedTuple):
    """A page of the site; links in its text begin at the top: `/topics/pose.md`.

    label: what it is called beside others of its kind; title: its heading
    about: what stands behind a link to it, in lists
    """

    path: str
    label: str
    title: str
    about: str
    text: str


class Section(NamedTuple):
    """Pages of one kind, in groups with a heading each; a group without a name has none."""

    folder: str
    title: str
    about: str
    groups: Mapping[str, list[Page]]

    @property
    def pages(self) -> list[Page]:
        """Return all pages."""
        return [page for group in self.groups.values() for page in group]


NAMES = "|".join(topics())
ARGUMENT = r"[a-z_]+(?:, [a-z_]+)*: "  # begins a line of a docstring about an argument
SPECIAL = re.compile(
    rf"""
      `(?:frametool[ ])?help[ ](?P<quoted>{NAMES})` | \b(?:frametool[ ])?help[ ](?P<named>{NAMES})\b(?![ ][A-Z<])
    | `(?P<kept>[^`]+)`
    | (?<![^\s(]) (?P<code>                                  # what looks like code, as a word:
        \{{(?:[^{{}}]|\{{[^{{}}]*\}})*\}} | \[[^\[\]]*\] | <[^<>]+>       # what stands in braces or brackets
      | --?[A-Za-z][\w-]*                                    # an option
      | (?=\S*\w)[^\s(`]*[_<>|^=*\\@$][^\s`]*?               # a word with a sign in it
      ) (?=[.,;:?)]*(?:\s|$))
    """,
    re.VERBOSE,
)


def inline(text: str, *, linked: bool = True) -> str:
    """Return a sentence as Markdown: what looks like code is code, topics are links, all else means nothing more."""
    pieces, end = [], 0
    for found in SPECIAL.finditer(text):
        topic, code = found["quoted"] or found["named"], found["kept"] or found["code"] or found[0].strip("`")
        span = f"`{code}`" if len(code) > 1 or found["kept"] else _escaped(code)
        link = f"[`help {topic}`](/topics/{topic}.md)" if topic and linked else span
        pieces += [_escaped(text[end : found.start()]), link]
        end = found.end()
    return "".join([*pieces, _escaped(text[end:])])


def _escaped(text: str) -> str:
    return re.sub(r"[\\*_<>\[\]{}|~^#&`$]", r"\\\g<0>", text)


def paragraph(text: str) -> str:
    """Return prose on one line, which is no list and no heading, whatever it begins with."""
    line = inline(" ".join(text.split()))
    return re.sub(r"^(?=[-+=%:])|(?<=^\d)(?=[.)])", r"\\", line)


def fenced(text: str, language: str = "text") -> str:
    """Return a block that is shown as it is."""
    return f"```{language}\n{text.rstrip()}\n```"


def bullets(items: Iterable[str]) -> str:
    """Return a list."""
    return "\n".join(f"- {each}" for each in items)


def definitions(rows: Iterable[tuple[str, str]]) -> str:
    """Return terms, each with its meaning below: a table would be too wide for a telephone."""
    return "\n\n".join(f"`{term}`\n: {paragraph(meaning) or '..'}" for term, meaning in rows)


def document(text: str, *, listed: bool = False) -> str:
    """Return plain text as Markdown: what is indented or stands in columns is kept, all else flows.

    listed: lines about an argument or a result are a list, as docstrings have them
    """
    return "\n\n".join(_block(each, listed=listed) for each in re.split(r"\n\s*\n", text.strip("\n")))


def _block(text: str, *, listed: bool) -> str:
    if all(line.startswith("  ") for line in text.split("\n")):
        is_shell = re.match(r"\s*(?:frametool|printf|echo)\b", text)
        return fenced(dedent(text), "python" if listed else "sh" if is_shell else "text")
    if listed:
        lines = list(map(paragraph, re.split(rf"\n(?={ARGUMENT}|Returns |Raises )", text)))
        sentence = [] if re.match(ARGUMENT, text) else [lines.pop(0)]
        return "\n\n".join(filter(None, [*sentence, bullets(lines)]))
    return fenced(text) if re.search(r"\S  ", text) else paragraph(text)


def slug(title: str) -> str:
    """Return a name for the file of a page out of its title."""
    return re.sub(r"[^a-z0-9_]+", "-", title.lower().replace("'s", "s")).strip("-")


def links(folder: str, names: Iterable[str]) -> list[str]:
    """Return links to pages of one folder by their names."""
    return [f"[{name}](/{folder}/{slug(name)}.md)" for name in names]


def see_also(rows: Mapping[str, Iterable[str]]) -> str:
    """Return a heading and a line of links for each kind there is; "" without any."""
    lines = [f"{kind}: {', '.join(found)}" for kind, found in rows.items() if found]
    return f"## See also\n\n{bullets(lines)}" if lines else ""
