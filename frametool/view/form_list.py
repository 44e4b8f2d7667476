"""The forms of text for a person: a list of all, or all there is to say of one, within 80 columns."""

from __future__ import annotations

import re
from importlib import import_module
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from frametool.formats import CAMERA_AXES, DH, DIRECTIONS, FORMATS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

WIDTH = 80
LABEL = 15  # columns, the indent included
CHOICES = {"direction": DIRECTIONS, "camera_axes": CAMERA_AXES, "dh": DH}


def form_entry(name: str) -> dict[str, Any]:
    """Return what the table says of a form, as plain values; None where it says nothing."""
    row = FORMATS[name]
    return {
        "name": name,
        "summary": row.summary,
        "suffixes": row.suffixes,
        "reads": row.reads,
        "writes": row.writes,
        "states": row.states or None,
        "asks": tuple(map(option_of, row.asks)),
        "instead": row.instead or None,
    }


def option_of(ask: str) -> str:
    """Return how an option that answers a question is written: `--dh standard|modified`."""
    choices = "|".join(CHOICES.get(ask, ()))
    return f"--{ask.replace('_', '-')}{' ' * bool(choices)}{choices}"


def write_forms(entries: Iterable[dict[str, Any]]) -> str:
    """Return a list of forms: those that are read first, then those only written, then those only known."""
    parts: dict[str, list[str]] = {}
    for entry in entries:
        kind = _READ if entry["reads"] else _WRITTEN if entry["writes"] else _KNOWN
        said = [f"{entry['summary']}{_in_brackets(entry['suffixes'])}", _uses(entry), entry["states"]]
        said += [f"asks for {option}" for option in entry["asks"]]
        parts.setdefault(kind, []).append(_labelled(entry["name"], [*said, entry["instead"]]))
    return "\n".join(f"{kind}:\n{''.join(parts[kind])}" for kind in (_READ, _WRITTEN, _KNOWN) if kind in parts)


_READ, _WRITTEN, _KNOWN = "read", "only written", "known and not read; what to do"


def write_form(entry: dict[str, Any]) -> str:
    """Return all there is to say of one form, with an example if its module shows one."""
    name = entry["name"]
    said = {
        "suffixes": " ".join(entry["suffixes"]),
        "read as": ", ".join(entry["reads"]),
        "written from": ", ".join(entry["writes"]),
        "means": entry["states"],
        "asks for": ", ".join(entry["asks"]),
        "known by": ", ".join(_signs(name)),
        "instead": entry["instead"],
    }
    lines = "".join(_labelled(label, [text]) for label, text in said.items() if text)
    example = "".join(f"    {line}\n" for line in example_of(name))
    return f"{name}: {entry['summary']}\n{lines}" + (f"  example\n{example}" if example else "")


def example_of(name: str) -> list[str]:
    """Return the lines that stand indented in the docstring of what reads a form, or else of what writes it."""
    for module in filter(None, (FORMATS[name].reader, FORMATS[name].writer)):
        text = import_module(module).__doc__ or ""
        if lines := [line[4:] for line in text.split("\n") if line.startswith("    ")]:
            return [line if len(line) <= WIDTH - 4 else f"{line[: WIDTH - 7].rstrip()} .." for line in lines]
    return []


def _in_brackets(words: Iterable[str]) -> str:
    return f" ({' '.join(words)})" if words else ""


def _uses(entry: dict[str, Any]) -> str:
    """Say what is read from a form and what is written in it."""
    uses = (("read as", entry["reads"]), ("written from", entry["writes"]))
    return "; ".join(f"{label} {', '.join(what)}" for label, what in uses if what)


def _labelled(label: str, texts: Iterable[str | None]) -> str:
    """Return lines with a label before the first, folded."""
    lines = [line for text in texts if text for line in wrap(text, WIDTH - LABEL, break_on_hyphens=False)]
    first = f"  {label}"
    if len(first) >= LABEL:
        return "".join(f"{line}\n" for line in (first, *(" " * LABEL + line for line in lines)))
    return "".join(f"{begin:{LABEL}}{line}\n" for begin, line in zip([first, *[""] * len(lines)], lines, strict=False))


def _signs(name: str) -> Iterator[str]:
    """Name the signs of a form; of a pattern only the kind, if it is more than words."""
    for kind, what in FORMATS[name].signs:
        words = what if isinstance(what, str) and re.fullmatch(r"[\w./*|-]+", what) else ""
        yield f"{kind} {words}".rstrip()
