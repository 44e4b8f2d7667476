"""What `monitor` tells, for a person: a table of the edges, then a sentence about the chain."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.frames.stamps import format_stamp
from frametool.view.pose_text import in_width

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.grammar.result import Style


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _stamp(value: int | None) -> str:
    return "" if value is None else format_stamp(value)[:-6]


COLUMNS: dict[str, tuple[str, Callable[[Any], str]]] = {
    "parent": ("parent", str),
    "child": ("child", str),
    "count": ("count", str),
    "rate_hz": ("rate Hz", lambda value: "static" if value is None else f"{value:.2f}"),
    "first_ns": ("first", _stamp),
    "last_ns": ("last", _stamp),
    "gap_s": ("gap s", _seconds),
    "delay_mean_s": ("delay s", _seconds),
    "delay_max_s": ("max s", _seconds),
    "jumps": ("jumps", str),
    "backward": ("back", str),
    "parent_changes": ("parents", str),
    "topics": ("topics", str),
}
RARE = ("parent_changes",)  # left out where all are 0
LEFT = ("parent", "child", "topics")


def write_report(entries: Sequence[dict[str, Any]], style: Style) -> str:  # noqa: ARG001 - the numbers here are for reading
    """Return the edges as an aligned table; columns that say nothing are left out."""
    edges = [entry for entry in entries if entry["kind"] != "chain"]
    shown = [key for key in COLUMNS if any(entry[key] or (entry[key] == 0 and key not in RARE) for entry in edges)]
    rows = [[COLUMNS[key][0] for key in shown], *([COLUMNS[key][1](entry[key]) for key in shown] for entry in edges)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = ["<" if key in LEFT else ">" for key in shown]
    aligned = (zip(row, sides, widths, strict=True) for row in rows)
    table = "".join("  ".join(f"{cell:{side}{width}}" for cell, side, width in row).rstrip() + "\n" for row in aligned)
    return table + "".join(map(_chain, (entry for entry in entries if entry["kind"] == "chain")))


def _chain(entry: dict[str, Any]) -> str:
    """Return the sentence about the interval in which the whole chain has data."""
    first, last = entry["first_ns"], entry["last_ns"]
    if first is None:
        said = "stands still: any time will do"
    elif first > last:
        said = f"its edges share no time: one begins at {format_stamp(first)}, one ends at {format_stamp(last)}"
    else:
        said = f"all edges have data from {format_stamp(first)} to {format_stamp(last)} ({(last - first) / 1e9:.3f} s)"
    return in_width(f"{entry['parents']}:", said)
