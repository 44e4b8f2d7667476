"""Long lists of plain maps, flow ones on a line each or block ones, and plain values in brackets: what big trees are.

      - {name: lidar, parent: base_link, xyz: [0.9, 0, 2.0], rpy_deg: [0, 0, 90]}
      - name: lidar
        parent: base_link

Such lines differ from JSON only in the quotes.  Once a strict pattern has found nothing else in them, a few
replacements make them JSON, which reads 100 000 of them in a quarter of the time that the YAML parser takes to tell its
events (0.5 s against 2.1); anything unusual, also a mistake, goes to the parser.  In other forms lists and maps that
stand in brackets behind their key, `f1: {xyz: [0.9, 0, 2.0]}`, are taken out in the same way: the parser then has one
event of each.
"""

from __future__ import annotations

import re

from frametool.documents.limits import MOST_CONTAINERS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

LEAST = 1 << 16  # characters: shorter texts are not worth a second way
# plain words and numbers that mean themselves in YAML and hold nothing that JSON would need to escape
_WORD = r"(?:(?!(?:null|Null|NULL)[^\w./-])[A-Za-z_/][\w./-]*+|[-+]?(?:[0-9]+\.?[0-9]*+|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
_LIST = rf"\[{_WORD}(?:, {_WORD})*+\]"
_PAIR = rf"{_WORD}: (?:{_WORD}|{_LIST})"
_BLOCKS = rf"(?a)(?P<indent> *)- {_PAIR}\n(?:(?P=indent)(?:- |  ){_PAIR}\n)*+\Z"
_FLOWS = rf"(?a)(?P<indent> *)- \{{{_PAIR}(?:, {_PAIR})*+\}}\n(?:(?P=indent)- \{{{_PAIR}(?:, {_PAIR})*+\}}\n)*+\Z"
_QUOTES = (
    ("{", '{"'), ("}", '"}'), (": ", '": "'), (", ", '", "'), ('"[', '["'), (']"', '"]'),
)  # fmt: skip
STANDIN = "0"
_BRACKETED = rf"(?am)^( *+(?:- )?{_WORD}: )(\{{{_PAIR}(?:, {_PAIR})*+\}}|{_LIST})$"
_NOT_PLAIN = r"""["'|>#&*!%@`?\t\r]"""  # quotes, comments, texts of several lines, anchors: brackets may be none there
BRACKETS = "\ue000"
"""Stands for a value in brackets."""


def split_run(text: str) -> tuple[str, list[Any]] | None:
    """Take the list of plain maps off the end of a text.

    Returns the text with STANDIN as the list's one item, and the items; None where the text has no such end.
    """
    begin = re.search(r"(?m)^ *- (\{?)", text) if len(text) >= LEAST else None
    run = begin and re.compile(_FLOWS if begin[1] else _BLOCKS).match(text, begin.start())
    if not begin or not run:
        return None
    items = _items(run[0] if begin[1] else _as_flows(run[0], run["indent"]), run["indent"])
    return None if items is None else (f"{text[: run.start()]}{run['indent']}- {STANDIN}\n", items)


def _as_flows(run: str, indent: str) -> str:
    """Write block maps as flow ones, one a line."""
    lines = run[:-1].replace(f"\n{indent}  ", ", ").replace(f"\n{indent}- ", f"}}\n{indent}- {{")
    return f"{indent}- {{{lines[len(indent) + 2 :]}}}\n"


def put_back(values: list[Any], items: list[Any]) -> bool:
    """Put the items where the stand-in is: in the last list of the last document."""
    holder = values[-1]
    while isinstance(holder, dict) and holder:
        holder = next(reversed(holder.values()))
    if holder != [STANDIN]:
        return False
    holder[:] = items
    return True


def split_brackets(text: str) -> tuple[str, list[Any]] | None:
    """Take the plain values in brackets that end a line out of a text.

    Returns the text with BRACKETS in their places, and the values in order; None where a text is short or not plain.
    """
    if len(text) < LEAST or BRACKETS in text or re.search(_NOT_PLAIN, text):
        return None
    found: list[str] = []

    def stand_in(match: re.Match[str]) -> str:
        found.append(f"- {match[2]}\n")
        return f"{match[1]}{BRACKETS}"

    rest = re.sub(_BRACKETED, stand_in, text)
    items = _items("".join(found), "") if found else None
    return None if items is None else (rest, items)


def _items(run: str, indent: str) -> list[Any] | None:
    """Read a value in brackets a line as JSON; None where a key stands twice or there are too many."""
    from json import JSONDecoder

    if run.count("{") + run.count("[") > MOST_CONTAINERS:
        return None
    for plain, quoted in _QUOTES:
        run = run.replace(plain, quoted)
    run = run.replace("- [", '- ["').replace("]\n", '"]\n')
    run = run.replace(f"\n{indent}- ", ",\n")
    made: list[Any] = JSONDecoder(object_pairs_hook=_distinct).decode(f"[{run[len(indent) + 2 :]}]")
    return None if None in made else made


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any] | None:
    made = dict(pairs)
    return made if len(made) == len(pairs) else None
