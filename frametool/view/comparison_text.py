"""Comparisons of trajectories for people: one with its statistics, several as a table; the same table for papers."""

from __future__ import annotations

from functools import partial
from math import atan2, degrees, hypot
from textwrap import fill
from typing import TYPE_CHECKING, Any

from frametool.text.csv_line import quoted

if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH, LABEL, CELL, NAME, LONGEST = 80, 16, 10, 18, 24  # characters; a longer name does not push the rest aside
COLUMNS = ("rmse", "mean", "median", "p95", "max")
TITLES = ("est", "ate", "max", "deg", "along", "across", "up", "rpe", "kitti", "scale", "paired")
CSV_TITLES = (
    "est", "ate_m", "max_m", "ate_deg", "along_m", "across_m", "up_m", "rpe_percent", "kitti_percent", "scale",
    "paired",
)  # fmt: skip
RANKED = range(1, TITLES.index("scale"))
LARGE = 1e5


def write_comparison(found: dict[str, Any]) -> str:
    """Write the numbers of one comparison: the pairs first, then the fit, then the errors."""
    poses, settings = found["poses"], found["settings"]
    longest = 2 + max(len(found["ref"]), len(found["est"]))
    width = max(NAME, longest if longest <= LONGEST else 0)
    duration = "" if found["ref_duration_s"] is None else f", {found['ref_duration_s']:.3f} s"
    share = 100 * poses["paired"] / max(poses["possible"], 1)
    how = {
        "interpolate": f", {found.get(settings['interpolated'] or '')} interpolated",
        "nearest": f", nearest within {1e3 * (settings['max_diff_s'] or 0):g} ms",
        "number": ", by number",
    }[settings["match"]]
    lines = [
        f"{found['ref'] + '  ':<{width}}reference: {poses['ref']} poses{duration}, {found['path_m']['ref']:.3f} m",
        f"{found['est'] + '  ':<{width}}{poses['paired']} of {poses['possible']} poses paired ({share:.0f} %){how}",
    ]
    if found["offset_s"]:
        side = "behind" if found["offset_s"] > 0 else "ahead"
        lines.append(f"{'clock':<{width}}{abs(found['offset_s']):.6f} s {side}, corrected")
    if settings["mount"]:
        x, y, z, w = settings["mount"]["quaternion"].values()
        turn = degrees(2.0 * atan2(hypot(x, y, z), abs(w)))
        place = ", ".join(f"{number:.6f}" for number in settings["mount"]["xyz"])
        lines.append(f"{'mount':<{width}}{place} m" + (f", turned by {turn:.3f} deg" if turn else ""))
    each = "  ".join(f"{kind} {_short(value)}" for kind, value in found["ate_by_alignment"].items())
    lines += [f"{'fit ' + settings['align'] + '; ate m':<{width}}{each}"]
    indent = " " * LABEL
    folded = partial(fill, width=WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    lines = [*map(folded, lines)]
    lines.append(indent + "".join(f"{title:>{CELL}}" for title in COLUMNS))
    ate = found["ate"]
    for label, key in (("ate m", "m"), ("ate deg", "deg"), ("ate rot", "rot"), ("ate full", "full"),
                       ("  along m", "along_m"), ("  across m", "across_m"), ("  up m", "up_m")):  # fmt: skip
        if key in ate:
            lines.append(_row(label, ate[key]))
    for row in found["rpe"]:
        share_of_delta = "" if row["percent"] is None else f"{row['percent']:>8.2f} %"
        lines.append(_row(f"rpe {row['delta']} m", row["m"]) + share_of_delta)
        if row["deg"] is not None:
            lines.append(_row(f"rpe {row['delta']} deg", row["deg"]))
        else:
            lines.append(_row("  distance m", row["distance_m"]))
    return "\n".join([*lines, _kitti(found), ""])


def _row(label: str, summed: dict[str, float] | None) -> str:
    return f"{label:<{LABEL}}" + "".join(f"{_exact(summed and summed[key]):>{CELL}}" for key in COLUMNS)


def _kitti(found: dict[str, Any]) -> str:
    kitti = found["kitti"]
    if kitti:
        said = f"{kitti['percent']:.4f} %  {kitti['deg_per_m']:.6f} deg/m  ({kitti['segments']} segments)"
    else:
        asked = min(found["settings"]["segments_m"])
        said = f"-  ({found['path_m']['ref']:.1f} m of path, {asked:g} m asked)"
    return f"{'kitti':<{NAME}}{said}"


def _exact(value: Any) -> str:
    if value is None:
        return "-"
    whole = len(str(int(abs(value)))) + (value < 0)
    return f"{value:.{min(6, CELL - 2 - whole)}f}" if abs(value) < LARGE else f"{value:.3e}"


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if abs(value) < LARGE else f"{value:.3e}"


def write_explanation(found: dict[str, Any]) -> str:
    """Write how the numbers come about, each formula with those of this run."""
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


def cells(found: dict[str, Any]) -> list[Any]:
    """Return the numbers of a comparison that stand in a table, behind the name of the estimate."""
    ate, last = found["ate"], found["rpe"][-1] if found["rpe"] else None
    rmse = [(ate[key] or {}).get("rmse") for key in ("m", "deg", "along_m", "across_m", "up_m")]
    return [
        found["est"], rmse[0], ate["m"]["max"], *rmse[1:], last and last["percent"],
        found["kitti"] and found["kitti"]["percent"], found["transform"].get("scale"), found["poses"]["paired"],
    ]  # fmt: skip


def write_table(found: Sequence[dict[str, Any]], form: str = "text") -> str:
    """Write one row for each comparison: `text` or `markdown` or `latex` with the best of a column marked, or `csv`."""
    rows = [cells(each) for each in found]
    if form == "csv":
        lines = [CSV_TITLES, *(["" if cell is None else str(cell) for cell in row] for row in rows)]
        return "".join(f"{','.join(map(quoted, line))}\n" for line in lines)
    best = [_best(column) for column in zip(*rows, strict=True)]
    marked = {"text": "{}*", "markdown": "**{}**", "latex": r"\textbf{{{}}}"}[form]
    shown = []
    for row in rows:
        texts = map(_cell, row)
        if form == "latex":
            texts = map(_in_latex, texts)
        is_best = (at in RANKED and cell is not None and cell == best[at] for at, cell in enumerate(row))
        shown.append([marked.format(text) if best else text for text, best in zip(texts, is_best, strict=True)])
    if form == "markdown":
        lines = [TITLES, ["---", *["---:"] * (len(TITLES) - 1)], *shown]
        return "".join(f"| {' | '.join(cell.replace('|', '&#124;') for cell in line)} |\n" for line in lines)
    if form == "latex":
        body = "".join(f"{' & '.join(line)} \\\\\n" for line in (TITLES, *shown))
        return f"\\begin{{tabular}}{{l{'r' * (len(TITLES) - 1)}}}\n{body}\\end{{tabular}}\n"
    widths = [max(map(len, column)) for column in zip(TITLES, *shown, strict=True)]
    aligned = ([f"{line[0]:<{widths[0]}}", *map(str.rjust, line[1:], widths[1:])] for line in (TITLES, *shown))
    return "".join(f"{'  '.join(line).rstrip()}\n" for line in aligned)


def _best(column: Sequence[Any]) -> float | None:
    """Return the least of several numbers; one alone is no best."""
    there = [cell for cell in column if isinstance(cell, float)]
    return min(there) if len(column) > 1 and there else None


def _cell(cell: Any) -> str:
    return cell if isinstance(cell, str) else str(cell) if isinstance(cell, int) else _short(cell)


_LATEX = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_LATEX |= {letter: "\\" + letter for letter in "_%&#${}"}


def _in_latex(text: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in text)
