"""Reports within 80 columns: edges of a recording, differences between trees, file formats."""

from __future__ import annotations

import re
from importlib import import_module
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from frametool.errors import cells, printable
from frametool.formats.table import CHOICES, FORMATS
from frametool.frames.stamps import format_stamp
from frametool.view.pose_text import WIDTH, in_width

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.grammar.result import Style
    from frametool.lint.tree_diff import Apart, Difference


HEADINGS = {
    "rate_hz": "rate Hz", "first_ns": "first", "last_ns": "last", "gap_s": "gap s", "delay_mean_s": "delay s",
    "delay_max_s": "max s", "backward": "back", "parent_changes": "parents",
}  # fmt: skip
MOTION = ("length_m", "duration_s", "speed_mean", "speed_max", "gaps")  # a sentence for each edge that moves
HIDDEN = ("kind", "gap_until_ns", "parents", "overlap", *MOTION)
RARE = ("parent_changes",)  # left out where all are 0
LEFT = ("parent", "child", "topics")


def write_report(entries: Sequence[dict[str, Any]], style: Style) -> str:  # noqa: ARG001 - the numbers here are for reading
    """Return the edges as an aligned table without empty columns."""
    edges = [entry for entry in entries if entry["kind"] != "chain"]
    keys = [key for key in entries[0] if key not in HIDDEN]
    shown = [key for key in keys if any(entry[key] or (entry[key] == 0 and key not in RARE) for entry in edges)]
    rows = [[HEADINGS.get(key, key) for key in shown], *([_cell(key, entry[key]) for key in shown] for entry in edges)]
    lines = columns(rows, [key in LEFT for key in shown])
    if max(map(cells, lines)) > max(WIDTH, get_terminal_size((WIDTH, 0)).columns):
        lines = [line for row in rows[1:] for line in _folded_edge(dict(zip(shown, row, strict=True)), rows[0])]
    table = "".join(f"{line}\n" for line in lines)
    table += "".join(map(_motion, (entry for entry in edges if entry["length_m"])))
    return table + "".join(map(_chain, (entry for entry in entries if entry["kind"] == "chain")))


def columns(rows: Sequence[Sequence[str]], left: Sequence[bool]) -> list[str]:
    """Return rows as lines with aligned cells; left: which columns are aligned to the left."""
    widths = [max(map(cells, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        padded = ((cell, " " * (width - cells(cell))) for cell, width in zip(row, widths, strict=True))
        parts = (cell + pad if is_left else pad + cell for (cell, pad), is_left in zip(padded, left, strict=True))
        lines.append("  ".join(parts).rstrip())
    return lines


def trouble(entries: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """Return the patterns that highlight problems in a report; each group is named by its colour."""
    bad = [entry for entry in entries if entry["jumps"] or entry["backward"]]
    names = ((re.escape(printable(entry["parent"])), re.escape(printable(entry["child"]))) for entry in bad)
    rows = (rf"(?m)^(?P<red>{parent} +{child} .*)$" for parent, child in names)
    said = r"(?P<red>\b(?:jumps|back) [1-9]\d*)", r"(?m)(?P<magenta>\b[1-9]\d* gaps?)$", r"(?P<red>share no time)"
    return *rows, *said


def _folded_edge(row: dict[str, str], titles: Sequence[str]) -> list[str]:
    """Return one edge as lines, for when the table is too wide: its frames, then its values."""
    parent, child = (short(row[key], WIDTH // 2 - 4) for key in ("parent", "child"))
    said = [f"{title} {short(cell, WIDTH - 20)}" for title, (key, cell) in zip(titles, row.items(), strict=True)
            if cell and key not in ("parent", "child")]  # fmt: skip
    return [f"{parent} <- {child}", *wrap(", ".join(said), WIDTH - 2, initial_indent="  ", subsequent_indent="  ")]


def _motion(entry: dict[str, Any]) -> str:
    """Return the sentence on a moving edge: length, duration, speed, gaps."""
    speed = f"{entry['speed_mean']:.3f} m/s (at most {entry['speed_max']:.3f})"
    gaps = f"{entry['gaps']} gap{'s' * (entry['gaps'] != 1)}"
    begin = f"{short(entry['parent'], WIDTH // 2 - 4)} <- {short(entry['child'], WIDTH // 2 - 4)}:"
    return in_width(begin, f"{entry['length_m']:.3f} m in {entry['duration_s']:.3f} s, {speed}, {gaps}")


def _cell(key: str, value: Any) -> str:
    """Write a value; its key ends with its unit."""
    if value is None:
        return "static" if key == "rate_hz" else ""
    if key.endswith("_ns"):
        return format_stamp(value)[:-6]
    return f"{value:.2f}" if key == "rate_hz" else f"{value:.3f}" if key.endswith("_s") else str(value)


def _chain(entry: dict[str, Any]) -> str:
    """Return the sentence on the interval in which the whole chain has data."""
    first, last = entry["first_ns"], entry["last_ns"]
    if first is None:
        sentence = "stands still: any time will do"
    elif first > last:
        sentence = f"its edges share no time: one begins at {format_stamp(first)}, one ends at {format_stamp(last)}"
    else:
        seconds = (last - first) / 1e9
        sentence = f"all edges have data from {format_stamp(first)} to {format_stamp(last)} ({seconds:.3f} s)"
    return in_width(f"{entry['parents']}:", sentence)


NUMBER = 11  # columns of each number
LABEL = WIDTH - 4 * NUMBER


def write_diff(found: Iterable[Difference]) -> str:
    """Return the differences grouped under headings."""
    kinds: dict[str, list[Difference]] = {}
    for each in found:
        kinds.setdefault(each.kind, []).append(each)
    moved = [*kinds.pop("moved", ()), *kinds.pop("same", ())]
    parts = [f"{_HEADINGS[kind]}:\n{''.join(map(_said, alike))}" for kind, alike in kinds.items()]
    starts = dict.fromkeys(each.seen_from for each in moved)
    parts += (_table(start, [each for each in moved if each.seen_from == start]) for start in starts)
    return "\n".join(parts)


_HEADINGS = {"only-in-a": "only in A", "only-in-b": "only in B", "parent": "other parent", "motion": "stands or moves",
             "no-data": "no data", "samples": "other samples", "camera": "other intrinsics"}  # fmt: skip


def _said(each: Difference) -> str:
    """Return the description of one frame's difference."""
    text = short(each.frame, WIDTH - 4)
    if each.kind in ("only-in-a", "only-in-b"):
        parent = each.parent_a if each.kind == "only-in-a" else each.parent_b
        text += f" in {short(parent, WIDTH - 8)}" if parent is not None else ", a root"
    elif each.kind == "parent":
        in_a, in_b = ("none" if name is None else short(name, WIDTH // 2) for name in (each.parent_a, each.parent_b))
        text += f": {in_a} in A, {in_b} in B"
    elif each.own:
        text += f" by up to {each.own}"
    text += f": {each.note}" if each.note else ""
    lines = list(_folded(text))
    if each.kind == "parent" and each.seen:
        lines.append(f"    moved {each.seen}, seen from {short(str(each.seen_from), WIDTH // 2 - 10)}")
    return "".join(f"{line}\n" for line in lines)


def _folded(text: str) -> Iterator[str]:
    """Wrap a text by display width, with a hanging indent."""
    line = " "
    for word in (short(word, WIDTH - 4) for word in text.split(" ")):
        if cells(line) + cells(word) >= WIDTH and line.strip():
            yield line
            line = "   "
        line += f" {word}"
    yield line


def _table(start: str | None, found: Sequence[Difference]) -> str:
    """Return the table of moved frames, seen from one frame."""
    both = 2 * NUMBER
    seen = short(f"seen from {start}" if start is not None else "seen from elsewhere", both - 2)
    head = f"{'moved':<{LABEL}}{'in its parent':>{both}}{' ' * (both - cells(seen))}{seen}\n"
    units = f"{'':{LABEL}}" + 2 * f"{'mm':>{NUMBER}}{'deg':>{NUMBER}}" + "\n"
    return head + units + "".join(map(_row, found))


def _row(each: Difference) -> str:
    """Return the row of one frame; two lines if its name is long."""
    label = f"  {each.frame} in {each.parent_a}" if each.parent_a is not None else f"  {each.frame}"
    numbers = "".join(f"{text:>{NUMBER}}" for text in (*_numbers(each.own), *_numbers(each.seen)))
    label = short(label, WIDTH)
    gap = LABEL - cells(label)
    return f"{label}{' ' * gap}{numbers}\n" if gap > 0 else f"{label}\n{'':{LABEL}}{numbers}\n"


def _numbers(apart: Apart | None) -> tuple[str, str]:
    """Write the distance of two poses in mm and degrees; rounding errors are 0."""
    if apart is None:
        return "-", "-"
    metres = 0.0 if apart.metres <= apart.rounding else apart.millimetres
    turn = 0.0 if apart.radians <= apart.turn_rounding else apart.degrees
    length, angle = (
        f"{value:.{decimals}f}" if value == 0.0 or 0.5 * 10.0**-decimals <= value < 1e6 else f"{value:.2e}"
        for value, decimals in ((metres, 3), (turn, 4))
    )
    return length, angle


def short(name: str, width: int) -> str:
    """Shorten a name to some columns, keeping both ends."""
    name = printable(name)
    if cells(name) <= width:
        return name
    keep = width // 2 - 2 if name.isascii() else width // 4 - 1
    return f"{name[:keep]}...{name[-keep:]}"


LIST_LABEL = 15  # columns, the indent included


def format_entry(name: str) -> dict[str, Any]:
    """Return the table row of a format as plain values."""
    row = FORMATS[name]
    return {
        "name": name, "summary": row.summary, "suffixes": row.suffixes, "reads": row.reads, "writes": row.writes,
        "states": row.conventions or None, "asks": tuple(map(option_of, row.required_options)),
    }  # fmt: skip


def option_of(ask: str) -> str:
    """Return the spelling of an option: `--dh standard|modified`."""
    choices = "|".join(CHOICES.get(ask, ()))
    name = "from" if ask == "order" else ask.replace("_", "-")
    return f"--{name}{' ' * bool(choices)}{choices}"


def write_formats(entries: Iterable[dict[str, Any]]) -> str:
    """Return the list of formats, those that are only written last."""
    parts: dict[str, list[str]] = {}
    for entry in entries:
        kind = _READ if entry["reads"] else _WRITTEN
        suffixes = f" ({' '.join(entry['suffixes'])})" if entry["suffixes"] else ""
        uses = (("read as", entry["reads"]), ("written from", entry["writes"]))
        texts = [f"{entry['summary']}{suffixes}", "; ".join(f"{use} {', '.join(what)}" for use, what in uses if what)]
        texts += [entry["states"], *(f"asks for {option}" for option in entry["asks"])]
        parts.setdefault(kind, []).append(_labelled(entry["name"], texts))
    return "\n".join(f"{kind}:\n{''.join(parts[kind])}" for kind in (_READ, _WRITTEN) if kind in parts)


_READ, _WRITTEN = "read", "only written"


def write_format(entry: dict[str, Any]) -> str:
    """Describe one format, with the example of its module if there is one."""
    name = entry["name"]
    facts = {
        "suffixes": " ".join(entry["suffixes"]), "read as": ", ".join(entry["reads"]),
        "written from": ", ".join(entry["writes"]), "means": entry["states"], "asks for": ", ".join(entry["asks"]),
        "known by": ", ".join(_signs(name)),
    }  # fmt: skip
    lines = "".join(_labelled(label, [text]) for label, text in facts.items() if text)
    example = "".join(f"    {line}\n" for line in example_of(name))
    return f"{name}: {entry['summary']}\n{lines}" + (f"  example\n{example}" if example else "")


def example_of(name: str) -> list[str]:
    """Return the indented lines in the docstring of the format's reader, or else its writer."""
    for module in filter(None, (FORMATS[name].reader, FORMATS[name].writer)):
        text = import_module(module).__doc__ or ""
        if lines := [line[4:] for line in text.split("\n") if line.startswith("    ")]:
            return [line if len(line) <= WIDTH - 4 else f"{line[: WIDTH - 7].rstrip()} .." for line in lines]
    return []


def _labelled(label: str, texts: Iterable[str | None]) -> str:
    """Return wrapped lines with a label before the first."""
    lines = [line for text in texts if text for line in wrap(text, WIDTH - LIST_LABEL, break_on_hyphens=False)]
    first = f"  {label:{LIST_LABEL - 2}}"
    apart = "\n" + " " * LIST_LABEL
    return f"{first.rstrip() + apart if len(label) + 2 >= LIST_LABEL else first}{apart.join(lines)}\n"


def _signs(name: str) -> Iterator[str]:
    """Yield what a format is recognised by; of a regular expression only the kind."""
    for kind, what in FORMATS[name].magic:
        words = what if isinstance(what, str) and re.fullmatch(r"[\w./*|-]+", what) else ""
        yield f"{kind} {words}".rstrip()
