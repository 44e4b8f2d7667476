"""What form a file has, by its first bytes and its name: the one place that guesses.

Kinds of signs in the table, the strongest first.  Above the suffix, a sign belongs to one form alone:

    magic      a pattern of the first bytes
    folder     a file that the folder holds
    xml        the root element
    json key   a key of the outermost object, or of the objects in the outermost list
    yaml key   a key at the beginning of a line
    line       a pattern of the first line of data, behind blank lines, comments and what tools print

Below it, the first form that looks so is taken:

    begin      a pattern of the first characters
    header     a pattern of the first line that is no comment, or of a comment that names columns
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from functools import cached_property

from frametool.documents.source import LOOKED_AT, UTF16, not_text
from frametool.errors import FormatError, shown
from frametool.formats import FORMATS, by_suffix, readers

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, TypeAlias

    Shows: TypeAlias = Callable[["Beginning", Any], bool]


class Beginning:
    """The first bytes of a file, and what they show; worked out when first asked for."""

    def __init__(self, head: bytes) -> None:
        """Keep the bytes."""
        self.head = head

    @cached_property
    def text(self) -> str:
        """Return the bytes as text."""
        return self.head.decode("utf-16" if self.head.startswith(UTF16) else "utf-8-sig", "replace")

    @cached_property
    def data_line(self) -> str:
        """Return the first line of data."""
        from frametool.ros.noise import NOISE

        lines = (line for line in self.text.splitlines() if line.strip() and not line.startswith(("#", "---")))
        return next((line for line in lines if not NOISE(line)), "")

    @cached_property
    def first_line(self) -> str:
        """Return the first line that is no comment; a comment with commas or tabs, as the rows below, is a header."""
        lines = [line.strip("\r") for line in self.text.split("\n") if line.strip()]
        plain = next((line for line in lines if not line.startswith("#")), "")
        if lines and lines[0].startswith("#") and (not plain or _has_delimiter(plain)) and _has_delimiter(lines[0]):
            return lines[0]
        return plain or "".join(lines[:1])

    @cached_property
    def json_keys(self) -> set[str]:
        """Return the outermost keys of JSON."""
        from frametool.documents.json_reader import json_events, looks_like_json
        from frametool.documents.marks import END, LEAF

        text = self.text[:LOOKED_AT].lstrip()
        keys, depth = set(), 0
        if looks_like_json(text):
            outermost = 1 + text.startswith("[")
            with suppress(ValueError):  # JSON up to a word with a backslash that JSON does not know
                for kind, word, _, end, *_ in json_events(text):
                    depth += (kind != LEAF) - 2 * (kind == END)
                    if kind == LEAF and depth == outermost and text[end:].lstrip().startswith(":"):
                        keys.add(word)
        return keys

    @cached_property
    def yaml_keys(self) -> set[str]:
        """Return the words at the beginnings of lines that a colon follows."""
        return {found[2] for found in re.finditer(r"""(?m)^(["']?)([A-Za-z_][\w./-]*)\1[ \t]*:(?=\s|$)""", self.text)}

    @cached_property
    def root(self) -> str:
        """Return the name of the root element of XML."""
        found = re.match(r"\s*(?:<[?!](?:--.*?--|[^>]*)>\s*)*<([\w.:-]+)", self.text, re.DOTALL)
        return found[1] if found else ""


def _has_delimiter(line: str) -> bool:
    return "," in line or "\t" in line


# kind -> whether a beginning shows what a row says, the strongest first
_STRONG: dict[str, Shows] = {
    "magic": lambda begin, what: re.match(what, begin.head, re.DOTALL) is not None,
    "xml": lambda begin, what: begin.root == what,
    "json key": lambda begin, what: what in begin.json_keys,
    "yaml key": lambda begin, what: what in begin.yaml_keys,
    "line": lambda begin, what: re.match(what, begin.data_line) is not None,
}
_WEAK: dict[str, Shows] = {
    "begin": lambda begin, what: re.match(what, begin.text) is not None,
    "header": lambda begin, what: re.match(what, begin.first_line) is not None,
}


def _fitting(begin: Beginning, tests: dict[str, Shows], names: tuple[str, ...]) -> list[str]:
    """Return the forms that show a sign of the strongest kind that is shown at all."""
    for kind, shows in tests.items():
        if found := [
            name for name in names if any(kind == of and shows(begin, what) for of, what in FORMATS[name].signs)
        ]:
            return found
    return []


def by_sign(head: bytes, *reads: str, name: str = "") -> str | None:
    """Return the form, among those from which `reads` is read, whose sign the first bytes show; None if none does.

    Raises FormatError if two forms fit.
    """
    found = _fitting(Beginning(head), _STRONG, readers(*reads))
    if len(found) > 1:
        raise FormatError(f"fits {' and '.join(found)}; give --in {'|'.join(found)}", source=name or "stdin")
    return found[0] if found else None


def of_folder(path: str) -> str | None:
    """Return the form of which a folder is; None for a file, and for any other folder."""
    for form, row in FORMATS.items():
        for kind, what in row.signs:
            if kind == "folder" and os.path.isdir(path) and os.path.exists(os.path.join(path, str(what))):
                return form
    return None


def detect(head: bytes, *reads: str, name: str = "", otherwise: str = "") -> tuple[str, str]:
    """Return the form of a file and by what it was known, among the forms from which `reads` is read.

    head: its first bytes; name: of the file, "" for standard input; otherwise: the form if nothing tells.
    Raises FormatError if nothing tells and there is no such form, or two forms fit.
    """
    if form := by_sign(head, *reads, name=name):
        return form, "its first bytes"
    if "tree" not in reads and (what := not_text(head)):
        raise FormatError(what, source=name or "stdin")
    if form := by_suffix(name, readers(*reads)):
        return form, f"the suffix {name[name.rfind('.'):].lower()}"
    begin = Beginning(head)
    if found := _fitting(begin, _WEAK, readers(*reads)):
        return found[0], "its first line"
    if otherwise:
        return otherwise, "nothing else"
    if not begin.text.strip():
        raise FormatError("nothing in it", source=name or "stdin")
    raise FormatError(
        f"cannot tell the form of {shown(begin.first_line[:60])}; give --in {'|'.join(readers(*reads))}",
        source=name or "stdin",
        line=1,
    )
