"""Reports as text within 80 columns: trees, edges of a recording, differences, file formats, solutions, comparisons.

Also tables of comparisons for papers, and solutions for programs.
"""

from __future__ import annotations

import math
import re
from importlib import import_module
from shutil import get_terminal_size
from textwrap import fill, wrap
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid, cells, printable
from frametool.formats.rows.csv import quoted
from frametool.formats.table import CHOICES, FORMATS
from frametool.frames.edge_log import motion
from frametool.frames.stamps import format_stamp
from frametool.geometry.transform import Transform
from frametool.grammar.result import edge_label
from frametool.lint.tree_diff import SAME
from frametool.view.pose_text import WIDTH, in_width, largest_sigmas, sigmas_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.frames.track import Track
    from frametool.geometry.types import Components, Rigid
    from frametool.grammar.result import Style
    from frametool.lint.tree_diff import Apart, Difference


LARGE, NOTHING = 1e6, 1e-9  # from where on numbers have an exponent, and below which they are rounding
BELOW = str.maketrans("├└─", "│  ")  # the lines of a drawing, a line further down


def columns(rows: Sequence[Sequence[str]], left: Sequence[bool]) -> str:
    """Return rows as lines of aligned cells, within WIDTH or the terminal's if possible; empty columns are left out.

    left: which columns are aligned to the left; if the last one is, it holds remarks, of any length.
    A first cell that leaves its row no room has a line of its own, and so has a remark.
    """
    width = max(WIDTH, get_terminal_size((WIDTH, 0)).columns)
    widths = [max(map(cells, column)) for column in zip(*rows, strict=True)]
    numeric = widths[1:-1] if left[-1] else widths[1:]
    room = width - sum(2 + size for size in numeric if size)
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
    """Wrap a text by display width, with a hanging indent."""
    line = indent
    for word in (short(word, WIDTH - len(indent) - 2) for word in text.split(" ")):
        if cells(line) + cells(word) >= WIDTH and line.strip():
            yield line
            line = f"{indent}  "
        line += f" {word}" if line.strip("│ ") else word
    yield line


def short(name: str, width: int) -> str:
    """Shorten a name to some columns, keeping both ends."""
    name = printable(name)
    if cells(name) <= width:
        return name
    keep = width // 2 - 2 if name.isascii() else width // 4 - 1
    return f"{name[:keep]}...{name[-keep:]}"


def fixed(value: float | None, decimals: int) -> str:
    """Write a number with some decimals; with an exponent where that says nothing or too much; no minus zero."""
    if value is None:
        return "-"
    is_plain = abs(value) < NOTHING or 0.5 * 10.0**-decimals <= abs(value) < LARGE
    return f"{round(value, decimals) + 0.0:.{decimals}f}" if is_plain else f"{value:.1e}"


DEEPEST = 1000  # levels; the lines of a drawing grow with its depth
TREE_MARKS = (r"(?m)^(?P<green>[^│├└ \n].*)", r"(?m)^(?P<dim>[│├└─ ]*)(?P<bold>\S.*?)?(?P<cyan>  +\S.*)?$")


def write_tree(tree: Frames, style: Style) -> str:
    """Draw a tree: each frame below its parent, with its pose there, how uncertain that is, and how it moves."""
    return columns([*_drawn(tree, style)], (True, True, True, True))


def _drawn(tree: Frames, style: Style) -> Iterator[tuple[str, ...]]:
    """Walk the tree from its roots, children in the order they were added; a stack, so that no tree is too deep."""
    children: dict[str, list[Track]] = {}
    for each in tree.tracks():
        children.setdefault(each.parent, []).append(each)
    pending: list[tuple[str, Track | None, str, str]] = [(root, None, "", "") for root in reversed(tree.roots)]
    while pending:
        frame, track, branch, below = pending.pop()
        if len(branch) > 2 * DEEPEST:
            raise ValueInvalid(f"the tree is more than {DEEPEST} frames deep, too deep to draw; use --format json")
        yield branch + printable(frame), *(("", "", "") if track is None else _label(tree, track, style))
        line, further = "└ ", "  "
        for each in reversed(children.get(frame, ())):
            pending.append((each.child, each, below + line, below + further))
            line, further = "├ ", "│ "


def _label(tree: Frames, track: Track, style: Style) -> tuple[str, str, str]:
    """Return position, rotation and remarks of an edge, its newest pose if it moves."""
    if (drawn := tree.drawn.get(track.child)) is not None:
        return "", "", drawn
    covariance = tree.covariances.get(track.child)
    remarks = [] if covariance is None else [largest_sigmas(covariance)]
    remarks += [] if track.is_static else [motion(track)]
    return *edge_label(Transform.of(*track.components), style, track.parent), "  ".join(remarks)


HEADINGS = {
    "parent": "parent <- child", "rate_hz": "rate Hz", "first_ns": "first", "last_ns": "last", "gap_s": "gap s",
    "delay_mean_s": "delay s", "delay_max_s": "max s", "backward": "back", "parent_changes": "parents",
}  # fmt: skip
MOTION = ("length_m", "duration_s", "speed_mean", "speed_max", "gaps")  # a sentence for each edge that moves
HIDDEN = ("kind", "child", "gap_until_ns", "parents", "overlap", *MOTION)
RARE = ("parent_changes",)  # left out where all are 0


def write_report(entries: Sequence[dict[str, Any]]) -> str:
    """Return the edges as an aligned table without empty columns."""
    edges = [entry for entry in entries if entry["kind"] != "chain"]
    keys = [key for key in entries[0] if key not in HIDDEN]
    shown = [key for key in keys if any(entry[key] or (entry[key] == 0 and key not in RARE) for entry in edges)]
    rows = [[HEADINGS.get(key, key) for key in shown], *([_cell(key, entry) for key in shown] for entry in edges)]
    sentences = [*(_motion(entry) for entry in edges if entry["length_m"])]
    sentences += (_chain(entry) for entry in entries if entry["kind"] == "chain")
    return "".join([columns(rows, [key in ("parent", "topics") for key in shown]), *sentences])


def trouble(entries: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """Return the patterns that highlight problems in a report; each group is named by its colour."""
    bad = [re.escape(_edge(entry)) for entry in entries if entry["jumps"] or entry["backward"]]
    rows = (rf"(?m)^(?P<red>{edge} .*)$" for edge in bad)
    return *rows, r"(?m)(?P<magenta>\b[1-9]\d* gaps?)$", r"(?P<red>share no time)"


def _edge(entry: dict[str, Any]) -> str:
    return f"{printable(entry['parent'])} <- {printable(entry['child'])}"


def _motion(entry: dict[str, Any]) -> str:
    """Return the sentence on a moving edge: length, duration, speed, gaps."""
    speed = f"{entry['speed_mean']:.3f} m/s (at most {entry['speed_max']:.3f})"
    gaps = f"{entry['gaps']} gap{'s' * (entry['gaps'] != 1)}"
    begin = f"{short(_edge(entry), WIDTH - 1)}:"
    return in_width(begin, f"{entry['length_m']:.3f} m in {entry['duration_s']:.3f} s, {speed}, {gaps}")


def _cell(key: str, entry: dict[str, Any]) -> str:
    """Write a value; its key ends with its unit."""
    if key == "parent":
        return _edge(entry)
    value = entry[key]
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


LONGEST = 22  # characters of a heading over two columns


def write_diff(found: Iterable[Difference]) -> str:
    """Return a sentence for each difference but motion, and tables of what has moved."""
    every = [*found]
    moved = [each for each in every if each.kind in ("moved", SAME)]
    parts = ["".join(f"{line}\n" for each in every if each not in moved for line in folded(each.sentence))]
    for start in dict.fromkeys(each.seen_from for each in moved):
        seen = short(f"seen from {start}" if start is not None else "seen from elsewhere", LONGEST)
        rows = [["moved", "in its parent", "", seen, ""], ["", "mm", "deg", "mm", "deg"]]
        for each in moved:
            if each.seen_from == start:
                label = f"  {each.frame} in {each.parent_a}" if each.parent_a is not None else f"  {each.frame}"
                rows.append([printable(label), *_distance(each.own), *_distance(each.seen)])
        parts.append(columns(rows, (True, False, False, False, False)))
    return "\n".join(filter(None, parts))


def _distance(apart: Apart | None) -> tuple[str, str]:
    """Write the distance of two poses in mm and degrees; rounding errors are 0."""
    if apart is None:
        return "-", "-"
    metres = 0.0 if apart.metres <= apart.rounding else apart.millimetres
    turn = 0.0 if apart.radians <= apart.turn_rounding else apart.degrees
    return fixed(metres, 3), fixed(turn, 4)


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
    parts: dict[str, str] = {}
    for entry in entries:
        kind = "read" if entry["reads"] else "only written"
        parts[kind] = parts.get(kind, f"{kind}:\n") + _described(entry)
    return "\n".join(parts[kind] for kind in sorted(parts, reverse=True))


def write_format(entry: dict[str, Any]) -> str:
    """Describe one format, with the example of its module if there is one."""
    signs = ", ".join(_signs(entry["name"]))
    example = "".join(f"    {line}\n" for line in example_of(entry["name"]))
    return _described(entry, f"known by {signs}" if signs else "") + (f"  example\n{example}" if example else "")


def _described(entry: dict[str, Any], more: str = "") -> str:
    """Return wrapped lines on a format, with its name before the first."""
    suffixes = f" ({' '.join(entry['suffixes'])})" if entry["suffixes"] else ""
    uses = (("read as", entry["reads"]), ("written from", entry["writes"]))
    texts = [f"{entry['summary']}{suffixes}", "; ".join(f"{use} {', '.join(what)}" for use, what in uses if what)]
    texts += [entry["states"] or "", *(f"asks for {option}" for option in entry["asks"]), more]
    lines = [line for text in texts for line in wrap(text, WIDTH - LIST_LABEL, break_on_hyphens=False)]
    label, apart = f"  {entry['name']:{LIST_LABEL - 2}}", "\n" + " " * LIST_LABEL
    return f"{label if len(entry['name']) < LIST_LABEL - 2 else label + apart}{apart.join(lines)}\n"


def example_of(name: str) -> list[str]:
    """Return the indented lines in the docstring of the format's reader, or else its writer."""
    for module in filter(None, (FORMATS[name].reader, FORMATS[name].writer)):
        text = import_module(module).__doc__ or ""
        if lines := [line[4:] for line in text.split("\n") if line.startswith("    ")]:
            return [line if len(line) <= WIDTH - 4 else f"{line[: WIDTH - 7].rstrip()} .." for line in lines]
    return []


def _signs(name: str) -> Iterator[str]:
    """Yield what a format is recognised by; of a regular expression only the kind."""
    for kind, what in FORMATS[name].magic:
        words = what if isinstance(what, str) and re.fullmatch(r"[\w./*|-]+", what) else ""
        yield f"{kind} {words}".rstrip()


MOST = 50  # frames


class SolvedFrame(NamedTuple):
    """A frame of the result.

    parent: None for a root; components: its pose there; covariance: 36 numbers, None where they are not known
    rows: how many measurements of it are used; checked: whether its pose rests on loops only
    fixed: whether its entry is one of --fix
    """

    name: str
    parent: str | None
    components: Rigid
    covariance: Components | None
    rows: int
    checked: bool
    fixed: bool = False


class SolvedRow(NamedTuple):
    """A measurement and its residual: metres, radians, and in sigmas (`u`).

    counted: its weight is not 0; fits: the blunder that explains it
    """

    place: str
    row: int
    id: str | None
    parent: str
    child: str
    distance: float
    angle: float | None
    u: float
    used: bool
    checked: bool
    fits: str | None = None
    counted: bool = True


class Solution(NamedTuple):
    """What was solved: `shape` tree, hand-eye or points; sigma: of one axis, estimated, metres and radians.

    turns: rms about the two main axes, radians; scale_sigma: of the scale, where it was solved for
    """

    shape: str
    root: str | None
    dof: int
    rms_distance: float
    rms_angle: float | None
    sigma: tuple[float, float | None] | None
    frames: list[SolvedFrame]
    rows: list[SolvedRow]
    noise_at: str | None = None
    scale: float = 1.0
    scale_sigma: float | None = None
    turns: tuple[float, float] | None = None

    @property
    def left_out(self) -> list[SolvedRow]:
        """Return the rejected measurements."""
        return [each for each in self.rows if each.counted and not each.used]


def row_report(each: SolvedRow, *, in_cells: bool = False) -> dict[str, Any]:
    """Return a measurement for programs; in_cells: as a row of a table."""
    row = {key: value for key, value in each._asdict().items() if key != "counted"}
    return {key: str(value).lower() if in_cells and isinstance(value, bool) else value for key, value in row.items()}


def report(found: Solution) -> dict[str, Any]:
    """Return a solution for programs."""
    sigma = found.sigma and {"xyz": found.sigma[0], "rpy": found.sigma[1]}
    frames = [
        {"name": each.name, "parent": each.parent, "sigma": _sigmas(each), "rows": each.rows, "checked": each.checked}
        for each in found.frames
    ]
    return {
        "shape": found.shape, "root": found.root, "count": len(found.rows),
        "used": sum(each.used for each in found.rows), "dof": found.dof, "rms_distance": found.rms_distance,
        "rms_angle": found.rms_angle, "sigma": sigma, "noise_at": found.noise_at, "scale_sigma": found.scale_sigma,
        "frames": frames, "measurements": [row_report(each) for each in found.rows],
    }  # fmt: skip


def _sigmas(each: SolvedFrame) -> dict[str, list[float]] | None:
    if each.covariance is None:
        return None
    roots = sigmas_of(each.covariance)
    return {"xyz": roots[:3], "rpy_deg": [*map(math.degrees, roots[3:])]}


def write_solution(found: Solution) -> str:
    """Write the summary, the frames and the rejected measurements."""
    used, last = [each for each in found.rows if each.used], found.frames[-1]
    count, rms = f"{len(used)} of {len(found.rows)}", f"rms {_off(found.rms_distance, found.rms_angle)}"
    noise = f"noise at the {found.noise_at}; " if found.noise_at else ""
    loops = sum(each.checked for each in used)
    lines = [{
        "tree": f"{len(found.frames)} frames from {count} measurements, {loops} in loops; {rms}",
        "points": f"{printable(f'{last.parent}<-{last.name}')} from {count} matched points; {rms}",
        "hand-eye": f"hand-eye from {count} samples; {noise}{rms}",
    }[found.shape]]  # fmt: skip
    if found.sigma is not None and found.dof > 0:
        lines.append(f"noise of one axis {_off(*found.sigma)}, estimated")
    if found.turns is not None:
        first, second = map(math.degrees, found.turns)
        lines.append(f"turns seen: {first:.1f} deg rms about the main axis, {second:.1f} deg about the second")
    if found.scale_sigma is not None:
        lines.append(f"scale {found.scale:.9g} sigma {found.scale_sigma:.2g}")
    return "".join(f"{line}\n" for line in lines) + _solved_frames(found) + write_left_out(found)


def _off(metres: float, radians: float | None) -> str:
    turn = "" if radians is None else f" {fixed(math.degrees(radians), 2)} deg"
    return f"{fixed(1e3 * metres, 1)} mm{turn}"


def _solved_frames(found: Solution) -> str:
    """Return the table of the frames: each in its parent, which is named unless it is the root of a tree."""
    root = found.root if found.shape == "tree" else None
    shown = [each for each in found.frames if each.parent is not None or each.name == root][:MOST]
    rows = [["  frame", *"xyz", "sigma mm", "deg", "rows", ""]]
    for each in shown:
        name = f"  {printable(each.name if each.parent in (None, root) else f'{each.parent}<-{each.name}')}"
        if each.parent is None:
            rows.append([name, *[""] * 5, str(each.rows), "root"])
            continue
        sigmas = _sigmas(each)
        length, angle = (1e3 * max(sigmas["xyz"]), max(sigmas["rpy_deg"])) if sigmas else (None, None)
        remark = "fixed" if each.fixed else "" if each.checked else "unchecked"
        place = (fixed(round(part, 4), 4) for part in each.components[:3])
        rows.append([name, *place, fixed(length, 1), fixed(angle, 2), str(each.rows), remark])
    more = len(found.frames) - len(shown) if root else 0
    rest = f"  .. and {more} more; --report FILE.json has all\n" if more else ""
    return columns(rows, [True, *[False] * 6, True]) + rest


def write_left_out(found: Solution) -> str:
    """Write a table of the rejected measurements: where each is, what it measures, how far it is off."""
    if not found.left_out:
        return ""
    in_tree = found.shape == "tree"
    rows = [["left out", "off mm", "deg", "" if in_tree else "u", ""]]
    for each in found.left_out:
        what = f"{each.parent}<-{each.child}" if in_tree else each.id or f"row {each.row}"
        angle = "-" if each.angle is None else f"{math.degrees(each.angle):.1f}"
        numbers = fixed(1e3 * each.distance, 1), angle, "" if in_tree else fixed(each.u, 1)
        rows.append([printable(f"  {each.place} {what}"), *numbers, f"fits when {each.fits}" if each.fits else ""])
    return columns(rows, [True, False, False, False, True])


LABEL, CELL, NAME, LONGEST_NAME = 16, 10, 18, 24  # characters; a longer name does not push the rest aside
COLUMNS = ("rmse", "mean", "median", "p95", "max")
ABSOLUTE = {
    "m": "ate m", "deg": "ate deg", "rot": "ate rot", "full": "ate full",
    "along_m": "  along m", "across_m": "  across m", "up_m": "  up m",
}  # fmt: skip
TITLES = ("est", "ate", "max", "deg", "along", "across", "up", "rpe", "kitti", "scale", "paired")
CSV_TITLES = (
    "est", "ate_m", "max_m", "ate_deg", "along_m", "across_m", "up_m", "rpe_percent", "kitti_percent", "scale",
    "paired",
)  # fmt: skip
RANKED = range(1, TITLES.index("scale"))
WIDEST = 1e5  # from where on errors have an exponent


def write_comparison(found: dict[str, Any]) -> str:
    """Write one comparison: pairs, alignment, errors."""
    poses, settings, kitti = found["poses"], found["settings"], found["kitti"]
    duration = "" if found["ref_duration_s"] is None else f", {found['ref_duration_s']:.3f} s"
    share = 100 * poses["paired"] / max(poses["possible"], 1)
    how = {
        "interpolate": f", {found.get(settings['interpolated'] or '')} interpolated",
        "nearest": f", nearest within {1e3 * (settings['max_diff_s'] or 0):g} ms",
        "number": ", by number",
    }[settings["match"]]
    heads = [
        (found["ref"] + "  ", f"reference: {poses['ref']} poses{duration}, {found['path_m']['ref']:.3f} m"),
        (found["est"] + "  ", f"{poses['paired']} of {poses['possible']} poses paired ({share:.0f} %){how}"),
    ]
    if found["offset_s"]:
        side = "behind" if found["offset_s"] > 0 else "ahead"
        heads.append(("clock", f"{abs(found['offset_s']):.6f} s {side}, corrected"))
    if settings["mount"]:
        x, y, z, w = settings["mount"]["quaternion"].values()
        turn = math.degrees(2.0 * math.atan2(math.hypot(x, y, z), abs(w)))
        place = ", ".join(f"{number:.6f}" for number in settings["mount"]["xyz"])
        heads.append(("mount", f"{place} m" + (f", turned by {turn:.3f} deg" if turn else "")))
    fits = "  ".join(f"{kind} {_error(value)}" for kind, value in found["ate_by_alignment"].items())
    heads.append((f"fit {settings['align']}; ate m ", fits))
    longest = max(len(name) for name, _ in heads[:2])
    width, indent = max(NAME, longest if longest <= LONGEST_NAME else 0), " " * LABEL
    lines = [
        fill(f"{name:<{width}}{text}", WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        for name, text in heads
    ]
    lines.append(indent + "".join(f"{title:>{CELL}}" for title in COLUMNS))
    lines += (_statistics(label, found["ate"][key]) for key, label in ABSOLUTE.items() if key in found["ate"])
    for row in found["rpe"]:
        percent = "" if row["percent"] is None else f"{row['percent']:>8.2f} %"
        lines.append(_statistics(f"rpe {row['delta']} m", row["m"]) + percent)
        other = ("  distance m", "distance_m") if row["deg"] is None else (f"rpe {row['delta']} deg", "deg")
        lines.append(_statistics(other[0], row[other[1]]))
    stretches = f"-  ({found['path_m']['ref']:.1f} m of path, {min(settings['segments_m']):g} m asked)"
    if kitti:
        stretches = f"{kitti['percent']:.4f} %  {kitti['deg_per_m']:.6f} deg/m  ({kitti['segments']} segments)"
    return "\n".join([*lines, f"{'kitti':<{NAME}}{stretches}", ""])


def _statistics(label: str, summed: dict[str, float] | None) -> str:
    """Return a row of statistics, each in eight characters."""
    texts = []
    for key in COLUMNS:
        if summed is None:
            texts.append("-")
        else:
            whole = len(str(int(abs(summed[key])))) + (summed[key] < 0)
            decimals = f".{min(6, CELL - 2 - whole)}f" if abs(summed[key]) < WIDEST else ".3e"
            texts.append(f"{summed[key]:{decimals}}")
    return f"{label:<{LABEL}}" + "".join(f"{text:>{CELL}}" for text in texts)


def _error(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if abs(value) < WIDEST else f"{value:.3e}"


def write_explanation(found: dict[str, Any]) -> str:
    """Write the formulas of a comparison with the numbers of this run."""
    poses, fit, ate, settings = found["poses"], found["transform"], found["ate"], found["settings"]
    c, q = fit.get("scale", 1.0), fit["quaternion"]
    parts = [ate[key]["rmse"] for key in ("along_m", "across_m", "up_m")]
    turn, shift = ", ".join(f"{q[axis]:.9g}" for axis in "xyzw"), ", ".join(f"{part:.9g}" for part in fit["xyz"])
    lines = [
        f"pairs      n = {poses['paired']} of {poses['possible']}, t_ref = t_est + {found['offset_s']:.9g} s",
        f"fit        p' = c R p + t, R' = R R_i   ({settings['align']})",
        f"           c = {c:.9g}",
        f"           R = quaternion x y z w ({turn})",
        f"           t = ({shift}) m",
        "ate        d_i = p'_i - p_ref,i;  rmse = sqrt(sum |d_i|^2 / n)",
        f"           = sqrt({ate['m']['sse']:.9g} / {poses['paired']}) = {ate['m']['rmse']:.9g} m",
        "           along, across, up: d_i in the axes of REF's path",
        f"           {' + '.join(f'{each:.6g}^2' for each in parts)} = {ate['m']['rmse']:.6g}^2",
    ]
    if ate["deg"]:
        lines.append(f"           E_i = inv(ref_i) est'_i;  its angle: rmse {ate['deg']['rmse']:.9g} deg")
    if found["rpe"]:
        lines.append("rpe        E_ij = inv(inv(ref_i) ref_j) inv(est'_i) est'_j")
    for row in found["rpe"]:
        if row["m"]:
            share = "" if row["percent"] is None else f" = {row['percent']:.6g} % of the delta"
            root = f"sqrt({row['m']['sse']:.9g} / {row['pairs']}) = {row['m']['rmse']:.9g} m"
            lines.append(f"           {row['delta']}: |t(E)|, rmse = {root}{share}")
    if kitti := found["kitti"]:
        lines.append(f"kitti      mean of |t(E)| / L over {kitti['segments']} stretches = {kitti['percent']:.9g} %")
        lines.append(f"           mean of angle(E) / L = {kitti['deg_per_m']:.9g} deg/m")
    return "\n".join([*lines, ""])


def write_table(found: Sequence[dict[str, Any]], fmt: str = "text") -> str:
    """Write one row per comparison: `csv`, or `text`, `markdown`, `latex` with the best value of each column marked."""
    rows = [_table_row(each) for each in found]
    if fmt == "csv":
        lines = [CSV_TITLES, *(["" if cell is None else str(cell) for cell in row] for row in rows)]
        return "".join(f"{','.join(map(quoted, line))}\n" for line in lines)
    known = ([cell for cell in column if isinstance(cell, float)] for column in zip(*rows, strict=True))
    best = [min(there) if at in RANKED and there and len(rows) > 1 else None for at, there in enumerate(known)]
    mark = {"text": "{}*", "markdown": "**{}**", "latex": r"\textbf{{{}}}"}[fmt]
    shown: list[Sequence[str]] = [TITLES]
    for row in rows:
        texts = [str(cell) if isinstance(cell, (str, int)) else _error(cell) for cell in row]
        if fmt == "latex":
            texts = ["".join(_LATEX.get(letter, letter) for letter in text) for text in texts]
        marks = (mark if cell is not None and cell == least else "{}" for cell, least in zip(row, best, strict=True))
        shown.append([each.format(text) for each, text in zip(marks, texts, strict=True)])
    if fmt == "markdown":
        shown.insert(1, ["---", *["---:"] * len(TITLES[1:])])
        return "".join(f"| {' | '.join(cell.replace('|', '&#124;') for cell in line)} |\n" for line in shown)
    if fmt == "latex":
        body = "".join(f"{' & '.join(line)} \\\\\n" for line in shown)
        return f"\\begin{{tabular}}{{l{'r' * len(TITLES[1:])}}}\n{body}\\end{{tabular}}\n"
    return columns(shown, [True, *[False] * len(TITLES[1:])])


def _table_row(found: dict[str, Any]) -> list[Any]:
    """Return the table row of a comparison: the name of the estimate and its errors."""
    ate, last = found["ate"], found["rpe"][-1] if found["rpe"] else None
    rmse = [(ate[key] or {}).get("rmse") for key in ("m", "deg", "along_m", "across_m", "up_m")]
    return [
        found["est"], rmse[0], ate["m"]["max"], *rmse[1:], last and last["percent"],
        found["kitti"] and found["kitti"]["percent"], found["transform"].get("scale"), found["poses"]["paired"],
    ]  # fmt: skip


_LATEX = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_LATEX |= {letter: "\\" + letter for letter in "_%&#${}"}
