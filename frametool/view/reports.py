"""Write reports as text within 80 columns: trees, edges of a recording, differences, file formats, solutions."""

from __future__ import annotations

import math
import re
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid, cells, printable
from frametool.formats.table import FORMATS, example_of
from frametool.frames.stamps import format_stamp
from frametool.frames.topology import motion
from frametool.geometry.transform import Transform
from frametool.grammar.result import Style, edge_label
from frametool.lint.tree_diff import SAME, Apart, Difference
from frametool.view.text import WIDTH, in_width, largest_sigmas, sigmas_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.frames.track import Track
    from frametool.grammar.pose import Pose


LARGE, NOTHING = 1e6, 1e-9  # larger numbers have an exponent; smaller ones are rounding errors
BELOW = str.maketrans("├└─", "│  ")  # the lines of a drawing -> those in the next row


def columns(rows: Sequence[Sequence[str]], left: Sequence[bool]) -> str:
    """Return rows as lines of aligned cells, within WIDTH or the terminal's if possible; empty columns are omitted.

    left: True for columns aligned to the left; if the last one is, it has remarks of any length
    A first cell or a remark that does not fit has a line of its own.
    """
    width = max(WIDTH, get_terminal_size((WIDTH, 0)).columns)
    widths = [max(map(cells, column)) for column in zip(*rows, strict=True)]
    room = width - sum(2 + size for size in (widths[1:-1] if left[-1] else widths[1:]) if size)
    widths[0] = max((cells(row[0]) for row in rows if cells(row[0]) <= room), default=0)
    lines = []
    for first, *others in rows:
        indent, is_long = first[: len(first) - len(first.lstrip("│├└─ "))].translate(BELOW), cells(first) > room
        lines += [short(first, width)] * is_long
        padded = [
            cell + pad if is_left else pad + cell
            for cell, is_left, size in zip((indent if is_long else first, *others), left, widths, strict=True)
            if (pad := " " * (size - cells(cell))) or size
        ]
        line = "  ".join(padded).rstrip()
        if left[-1] and cells(line) > width:
            lines += ["  ".join(padded[:-1]).rstrip(), *folded(others[-1], f"{indent}  ")]
        elif any(others) or not is_long:
            lines.append(line)
    return "".join(f"{line}\n" for line in lines)


def folded(text: str, indent: str = "") -> Iterator[str]:
    """Wrap a text by display width, with a hanging indent; a word that is too long is shortened."""
    line = indent
    for word in (short(word, WIDTH - len(indent) - 2) for word in text.split(" ")):
        if cells(line) + cells(word) >= WIDTH and line.strip():
            yield line
            line = f"{indent}  "
        line += f" {word}" if line.strip("│ ") else word
    yield line


def short(name: str, width: int) -> str:
    """Shorten a name to `width` columns, preserving both ends."""
    name = printable(name)
    if cells(name) <= width:
        return name
    keep = width // 2 - 2 if name.isascii() else width // 4 - 1
    return f"{name[:keep]}...{name[-keep:]}"


def fixed(value: float | None, decimals: int) -> str:
    """Format a number with some decimals, or an exponent if it is too small or large for them; 0 instead of -0."""
    if value is None:
        return "-"
    is_plain = abs(value) < NOTHING or 0.5 * 10.0**-decimals <= abs(value) < LARGE
    return f"{value:z.{decimals}f}" if is_plain else f"{value:.1e}"


DEEPEST = 1000  # levels; the lines of a drawing grow with its depth
TREE_MARKS = (r"(?m)^(?P<green>[^│├└ \n].*)", r"(?m)^(?P<dim>[│├└─ ]*)(?P<bold>\S.*?)?(?P<cyan>  +\S.*)?$")


def write_tree(tree: Frames, style: Style) -> str:
    """Draw a tree: each frame below its parent, with its newest pose there, its sigmas, and its motion.

    Children are in the order in which they were added; a stack avoids Python's recursion limit.
    """
    children: dict[str, list[Track]] = {}
    for each in tree.tracks():
        children.setdefault(each.parent, []).append(each)
    rows: list[tuple[str, ...]] = []
    pending: list[tuple[str, Track | None, str, str]] = [(root, None, "", "") for root in reversed(tree.roots)]
    while pending:
        frame, track, branch, below = pending.pop()
        if len(branch) > 2 * DEEPEST:
            raise ValueInvalid(f"the tree is more than {DEEPEST} frames deep, too deep to draw; use --format json")
        label = ("", "", tree.drawn.get(frame, ""))
        if track is not None and frame not in tree.drawn:
            covariance = tree.covariances.get(frame)
            remarks = [] if covariance is None else [largest_sigmas(covariance)]
            remarks += [] if track.is_static else [motion(track)]
            label = *edge_label(Transform.of(*track.components), style, track.parent), "  ".join(remarks)
        rows.append((branch + printable(frame), *label))
        line, further = "└ ", "  "
        for each in reversed(children.get(frame, ())):
            pending.append((each.child, each, below + line, below + further))
            line, further = "├ ", "│ "
    return columns(rows, (True, True, True, True))


HEADINGS = {
    "parent": "parent <- child", "rate_hz": "rate Hz", "first_ns": "first", "last_ns": "last", "gap_s": "gap s",
    "delay_mean_s": "delay s", "delay_max_s": "max s", "backward": "back", "parent_changes": "parents",
}  # fmt: skip
HIDDEN = (  # keys without a column in the table of edges; sentences show some of them
    "kind", "child", "gap_until_ns", "parents", "overlap", "length_m", "duration_s", "speed_mean", "speed_max", "gaps",
)  # fmt: skip


def write_report(entries: Sequence[dict[str, Any]]) -> str:
    """Return a table of the edges without empty columns, then sentences about moving edges and the chain."""
    edges = [entry for entry in entries if entry["kind"] != "chain"]
    keys = [key for key in entries[0] if key not in HIDDEN]
    shown = [key for key in keys if any(entry[key] or (entry[key] == 0 and key != "parent_changes") for entry in edges)]
    rows = [[HEADINGS.get(key, key) for key in shown], *([_cell(key, entry) for key in shown] for entry in edges)]
    sentences = []
    for entry in entries:
        first, last = entry["first_ns"], entry["last_ns"]
        if entry["kind"] != "chain":
            if entry["length_m"]:
                speed = f"{entry['speed_mean']:.3f} m/s (at most {entry['speed_max']:.3f})"
                gaps = f"{entry['gaps']} gap{'s' * (entry['gaps'] != 1)}"
                far = f"{entry['length_m']:.3f} m in {entry['duration_s']:.3f} s, {speed}, {gaps}"
                sentences.append(in_width(f"{short(_edge(entry), WIDTH - 1)}:", far))
            continue
        text = "stands still: any time will do"
        if first is not None:
            begin, end = format_stamp(first), format_stamp(last)
            text = f"all edges have data from {begin} to {end} ({(last - first) / 1e9:.3f} s)"
            if first > last:
                text = f"its edges share no time: one begins at {begin}, one ends at {end}"
        sentences.append(in_width(f"{entry['parents']}:", text))
    return "".join([columns(rows, [key in ("parent", "topics") for key in shown]), *sentences])


def problem_patterns(entries: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """Return the patterns that highlight problems in a report; each group is named by its colour."""
    bad = (re.escape(_edge(entry)) for entry in entries if entry["jumps"] or entry["backward"])
    rows = (rf"(?m)^(?P<red>{edge} .*)$" for edge in bad)
    return *rows, r"(?m)(?P<magenta>\b[1-9]\d* gaps?)$", r"(?P<red>share no time)"


def _edge(entry: dict[str, Any]) -> str:
    return f"{printable(entry['parent'])} <- {printable(entry['child'])}"


def _cell(key: str, entry: dict[str, Any]) -> str:
    """Format a value by the unit at the end of its key."""
    if key == "parent":
        return _edge(entry)
    value = entry[key]
    if value is None:
        return "static" if key == "rate_hz" else ""
    if key.endswith("_ns"):
        return format_stamp(value)[:-6]
    return f"{value:.2f}" if key == "rate_hz" else f"{value:.3f}" if key.endswith("_s") else str(value)


def write_diff(found: Iterable[Difference]) -> str:
    """Return a sentence for each difference except motion, and tables of the frames that moved."""
    every = [*found]
    moved = [each for each in every if each.kind in ("moved", SAME)]
    parts = ["".join(f"{line}\n" for each in every if each not in moved for line in folded(each.sentence))]
    for start in dict.fromkeys(each.seen_from for each in moved):
        seen = short(f"seen from {start}" if start is not None else "seen from elsewhere", 22)  # two columns wide
        rows = [["moved", "in its parent", "", seen, ""], ["", "mm", "deg", "mm", "deg"]]
        for each in moved:
            if each.seen_from == start:
                label = f"  {each.frame} in {each.parent_a}" if each.parent_a is not None else f"  {each.frame}"
                rows.append([printable(label), *_distance(each.own), *_distance(each.seen)])
        parts.append(columns(rows, (True, False, False, False, False)))
    return "\n".join(filter(None, parts))


def _distance(apart: Apart | None) -> tuple[str, str]:
    """Return the distance of two poses in mm and degrees; rounding errors are 0."""
    if apart is None:
        return "-", "-"
    metres = 0.0 if apart.metres <= apart.rounding else apart.millimetres
    turn = 0.0 if apart.radians <= apart.turn_rounding else apart.degrees
    return fixed(metres, 3), fixed(turn, 4)


LIST_LABEL = 15  # columns, the indent included


def write_formats(entries: Sequence[dict[str, Any]]) -> str:
    """Return the list of formats, with those that are only written last."""
    read = "".join(_described(entry) for entry in entries if entry["reads"])
    written = "".join(_described(entry) for entry in entries if not entry["reads"])
    return f"read:\n{read}\nonly written:\n{written}"


def write_format(entry: dict[str, Any]) -> str:
    """Describe one format, with its signs (only the kind of a regular expression) and an example."""
    shown_as = re.compile(r"[\w./*|-]+").fullmatch
    magic = FORMATS[entry["name"]].magic
    signs = [f"{kind} {what}" if isinstance(what, str) and shown_as(what) else kind for kind, what in magic]
    example = "".join(f"    {line}\n" for line in example_of(entry["name"], WIDTH - 4))
    return _described(entry, f"known by {', '.join(signs)}" * bool(signs)) + f"  example\n{example}" * bool(example)


def _described(entry: dict[str, Any], more: str = "") -> str:
    """Return the name of a format, followed by wrapped lines that describe it."""
    suffixes = f" ({' '.join(entry['suffixes'])})" if entry["suffixes"] else ""
    uses = (("read as", entry["reads"]), ("written from", entry["writes"]))
    texts = [f"{entry['summary']}{suffixes}", "; ".join(f"{use} {', '.join(what)}" for use, what in uses if what)]
    texts += [entry["states"] or "", *(f"asks for {option}" for option in entry["asks"]), more]
    lines = [line for text in texts for line in wrap(text, WIDTH - LIST_LABEL, break_on_hyphens=False)]
    label, apart = f"  {entry['name']:{LIST_LABEL - 2}}", "\n" + " " * LIST_LABEL
    return f"{label if len(entry['name']) < LIST_LABEL - 2 else label + apart}{apart.join(lines)}\n"


class Solution(NamedTuple):
    """The result of `solve`.

    numbers: the report on the fit, its frames and its measurements; `shape` is tree, hand-eye or points
    poses: of the frames in their parents; a root has no parent.  left_out: the rejected measurements
    fixed: the frames of --fix.  turns: rms rotation about the two main axes, radians
    """

    numbers: dict[str, Any]
    poses: list[Pose]
    left_out: list[dict[str, Any]]
    fixed: Collection[str | None] = ()
    turns: tuple[float, float] | None = None


def sigma_entry(pose: Pose) -> dict[str, list[float]] | None:
    """Return the sigmas of a pose for a report, metres and degrees along and about each axis; None if unknown."""
    if pose.covariance is None:
        return None
    roots = sigmas_of(pose.covariance)
    return {"xyz": roots[:3], "rpy_deg": [*map(math.degrees, roots[3:])]}


def write_solution(found: Solution) -> str:
    """Return the summary, the poses of the frames in their parents, and the rejected measurements."""
    numbers, last = found.numbers, found.poses[-1]
    count = f"{numbers['used']} of {numbers['count']}"
    rms = f"rms {_off(numbers['rms_distance'], numbers['rms_angle'])}"
    noise = f"noise at the {numbers['noise_at']}; " if numbers["noise_at"] else ""
    loops = sum(each["used"] and each["checked"] for each in numbers["measurements"])
    lines = [{
        "tree": f"{len(found.poses)} frames from {count} measurements, {loops} in loops; {rms}",
        "points": f"{printable(f'{last.parent}<-{last.name}')} from {count} matched points; {rms}",
        "hand-eye": f"hand-eye from {count} samples; {noise}{rms}",
    }[numbers["shape"]]]  # fmt: skip
    if numbers["sigma"] and numbers["dof"] > 0:
        lines.append(f"noise of one axis {_off(*numbers['sigma'].values())}, estimated")
    if found.turns is not None:
        first, second = map(math.degrees, found.turns)
        lines.append(f"turns seen: {first:.1f} deg rms about the main axis, {second:.1f} deg about the second")
    if numbers["scale_sigma"] is not None:
        lines.append(f"scale {last.scale:.9g} sigma {numbers['scale_sigma']:.2g}")
    root = numbers["root"] if numbers["shape"] == "tree" else None
    pairs = zip(found.poses, numbers["frames"], strict=True)
    shown = [each for each in pairs if each[0].parent is not None or each[0].name == root][:50]
    rows = [["  frame", *"xyz", "sigma mm", "deg", "rows", ""]]
    for pose, entry in shown:
        name = f"  {printable(str(pose.name) if pose.parent in (None, root) else f'{pose.parent}<-{pose.name}')}"
        if pose.parent is None:
            rows.append([name, *[""] * 5, str(entry["rows"]), "root"])
            continue
        sigma = entry["sigma"]
        largest = (1e3 * max(sigma["xyz"]), max(sigma["rpy_deg"])) if sigma else (None, None)
        remark = "fixed" if pose.name in found.fixed else "" if entry["checked"] else "unchecked"
        place = (fixed(round(part, 4), 4) for part in pose.components[:3])
        rows.append([name, *place, fixed(largest[0], 1), fixed(largest[1], 2), str(entry["rows"]), remark])
    more = len(found.poses) - len(shown) if root else 0
    rest = f"  .. and {more} more; --report FILE.json has all\n" if more else ""
    table = columns(rows, [True, *[False] * 6, True])
    return "".join(f"{line}\n" for line in lines) + table + rest + write_left_out(found)


def _off(metres: float, radians: float | None) -> str:
    turn = "" if radians is None else f" {fixed(math.degrees(radians), 2)} deg"
    return f"{fixed(1e3 * metres, 1)} mm{turn}"


def write_left_out(found: Solution) -> str:
    """Return a table of the rejected measurements: location, frames, residual."""
    if not found.left_out:
        return ""
    in_tree = found.numbers["shape"] == "tree"
    rows = [["left out", "off mm", "deg", "" if in_tree else "u", ""]]
    for each in found.left_out:
        what = f"{each['parent']}<-{each['child']}" if in_tree else each["id"] or f"row {each['row']}"
        angle = "-" if each["angle"] is None else f"{math.degrees(each['angle']):.1f}"
        off = fixed(1e3 * each["distance"], 1), angle, "" if in_tree else fixed(each["u"], 1)
        rows.append([printable(f"  {each['place']} {what}"), *off, f"fits when {each['fits']}" if each["fits"] else ""])
    return columns(rows, [True, False, False, False, True])
