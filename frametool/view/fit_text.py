"""Text of comparisons and solutions within 80 columns, and tables of comparisons for papers."""

from __future__ import annotations

import math
from functools import partial
from math import atan2, degrees, hypot
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import printable
from frametool.formats.rows.csv import quoted
from frametool.view.pose_text import WIDTH
from frametool.view.report_text import columns, fixed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.geometry.types import Components, Rigid


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

    @property
    def is_left_out(self) -> bool:
        """Return True if the fit rejected it as an outlier."""
        return self.counted and not self.used


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
    def used(self) -> int:
        """Return the number of measurements used."""
        return sum(each.used for each in self.rows)

    @property
    def left_out(self) -> list[SolvedRow]:
        """Return the rejected measurements."""
        return [each for each in self.rows if each.is_left_out]


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
        "shape": found.shape, "root": found.root, "count": len(found.rows), "used": found.used, "dof": found.dof,
        "rms_distance": found.rms_distance, "rms_angle": found.rms_angle, "sigma": sigma, "noise_at": found.noise_at,
        "scale_sigma": found.scale_sigma, "frames": frames, "measurements": [row_report(each) for each in found.rows],
    }  # fmt: skip


def _sigmas(each: SolvedFrame) -> dict[str, list[float]] | None:
    if each.covariance is None:
        return None
    roots = [math.sqrt(max(entry, 0.0)) for entry in each.covariance[::7]]
    return {"xyz": roots[:3], "rpy_deg": [math.degrees(root) for root in roots[3:]]}


def write_solution(found: Solution) -> str:
    """Write the summary, the frames and the rejected measurements."""
    lines = [_first(found)]
    if found.sigma is not None and found.dof > 0:
        lines.append(f"noise of one axis {_apart(*found.sigma)}, estimated")
    if found.turns is not None:
        first, second = map(math.degrees, found.turns)
        lines.append(f"turns seen: {first:.1f} deg rms about the main axis, {second:.1f} deg about the second")
    if found.scale_sigma is not None:
        lines.append(f"scale {found.scale:.9g} sigma {found.scale_sigma:.2g}")
    return "".join(f"{line}\n" for line in [*lines, *_frames(found)]) + write_left_out(found)


def _first(found: Solution) -> str:
    count, rms = f"{found.used} of {len(found.rows)}", f"rms {_apart(found.rms_distance, found.rms_angle)}"
    if found.shape == "tree":
        loops = sum(each.used and each.checked for each in found.rows)
        return f"{len(found.frames)} frames from {count} measurements, {loops} in loops; {rms}"
    if found.shape == "points":
        return f"{_pair(found.frames[-1], None)} from {count} matched points; {rms}"
    noise = f"noise at the {found.noise_at}; " if found.noise_at else ""
    return f"hand-eye from {count} samples; {noise}{rms}"


def _apart(metres: float, radians: float | None) -> str:
    turn = "" if radians is None else f" {fixed(math.degrees(radians), 2)} deg"
    return f"{fixed(1e3 * metres, 1)} mm{turn}"


def _pair(each: SolvedFrame, root: str | None) -> str:
    """Return a frame's name, with its parent where that is not the root."""
    return printable(each.name if each.parent in (None, root) else f"{each.parent}<-{each.name}")


def _frames(found: Solution) -> Iterator[str]:
    root = found.root if found.shape == "tree" else None
    shown = [each for each in found.frames if each.parent is not None or each.name == root][:MOST]
    rows = [["  frame", *"xyz", "sigma mm", "deg", "rows", ""]]
    for each in shown:
        name, count = f"  {_pair(each, root)}", str(each.rows)
        if each.parent is None:
            rows.append([name, *[""] * 5, count, "root"])
            continue
        place = [fixed(round(part, 4), 4) for part in each.components[:3]]
        sigmas = _sigmas(each)
        length, angle = (1e3 * max(sigmas["xyz"]), max(sigmas["rpy_deg"])) if sigmas else (None, None)
        remark = "fixed" if each.fixed else "" if each.checked else "unchecked"
        rows.append([name, *place, fixed(length, 1), fixed(angle, 2), count, remark])
    yield from columns(rows, [True, *[False] * 6, True])
    if (more := len(found.frames) - len(shown)) > 0 and found.shape == "tree":
        yield f"  .. and {more} more; --report FILE.json has all"


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
    return "".join(f"{line}\n" for line in columns(rows, [True, False, False, False, True]))


LABEL, CELL, NAME, LONGEST_NAME = 16, 10, 18, 24  # characters; a longer name does not push the rest aside
COLUMNS = ("rmse", "mean", "median", "p95", "max")
TITLES = ("est", "ate", "max", "deg", "along", "across", "up", "rpe", "kitti", "scale", "paired")
CSV_TITLES = (
    "est", "ate_m", "max_m", "ate_deg", "along_m", "across_m", "up_m", "rpe_percent", "kitti_percent", "scale",
    "paired",
)  # fmt: skip
RANKED = range(1, TITLES.index("scale"))
LARGE = 1e5  # from where on numbers have an exponent


def write_comparison(found: dict[str, Any]) -> str:
    """Write one comparison: pairs, alignment, errors."""
    poses, settings = found["poses"], found["settings"]
    longest = 2 + max(len(found["ref"]), len(found["est"]))
    width = max(NAME, longest if longest <= LONGEST_NAME else 0)
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
    lines += [f"{'fit ' + settings['align'] + '; ate m ':<{width}}{each}"]
    indent = " " * LABEL
    folded = partial(fill, width=WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    lines = [*map(folded, lines)]
    lines.append(indent + "".join(f"{title:>{CELL}}" for title in COLUMNS))
    for label, key in (("ate m", "m"), ("ate deg", "deg"), ("ate rot", "rot"), ("ate full", "full"),
                       ("  along m", "along_m"), ("  across m", "across_m"), ("  up m", "up_m")):  # fmt: skip
        if key in found["ate"]:
            lines.append(_row(label, found["ate"][key]))
    for row in found["rpe"]:
        share_of_delta = "" if row["percent"] is None else f"{row['percent']:>8.2f} %"
        lines.append(_row(f"rpe {row['delta']} m", row["m"]) + share_of_delta)
        turned = row["deg"] is not None
        lines.append(_row(f"rpe {row['delta']} deg", row["deg"]) if turned else _row("  distance m", row["distance_m"]))
    return "\n".join([*lines, f"{'kitti':<{NAME}}{_kitti(found)}", ""])


def _row(label: str, summed: dict[str, float] | None) -> str:
    return f"{label:<{LABEL}}" + "".join(f"{_exact(summed and summed[key]):>{CELL}}" for key in COLUMNS)


def _kitti(found: dict[str, Any]) -> str:
    if kitti := found["kitti"]:
        return f"{kitti['percent']:.4f} %  {kitti['deg_per_m']:.6f} deg/m  ({kitti['segments']} segments)"
    asked = min(found["settings"]["segments_m"])
    return f"-  ({found['path_m']['ref']:.1f} m of path, {asked:g} m asked)"


def _exact(value: Any) -> str:
    if value is None:
        return "-"
    whole = len(str(int(abs(value)))) + (value < 0)
    return f"{value:.{min(6, CELL - 2 - whole)}f}" if abs(value) < LARGE else f"{value:.3e}"


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if abs(value) < LARGE else f"{value:.3e}"


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


def _table_row(found: dict[str, Any]) -> list[Any]:
    """Return the table row of a comparison: the name of the estimate and its errors."""
    ate, last = found["ate"], found["rpe"][-1] if found["rpe"] else None
    rmse = [(ate[key] or {}).get("rmse") for key in ("m", "deg", "along_m", "across_m", "up_m")]
    return [
        found["est"], rmse[0], ate["m"]["max"], *rmse[1:], last and last["percent"],
        found["kitti"] and found["kitti"]["percent"], found["transform"].get("scale"), found["poses"]["paired"],
    ]  # fmt: skip


def write_table(found: Sequence[dict[str, Any]], fmt: str = "text") -> str:
    """Write one row per comparison: `csv`, or `text`, `markdown`, `latex` with the best value of each column marked."""
    rows = [_table_row(each) for each in found]
    if fmt == "csv":
        lines = [CSV_TITLES, *(["" if cell is None else str(cell) for cell in row] for row in rows)]
        return "".join(f"{','.join(map(quoted, line))}\n" for line in lines)
    best = _best(rows)
    marked = {"text": "{}*", "markdown": "**{}**", "latex": r"\textbf{{{}}}"}[fmt]
    shown = []
    for row in rows:
        texts = [*map(_cell, row)]
        if fmt == "latex":
            texts = ["".join(_LATEX.get(letter, letter) for letter in text) for text in texts]
        is_best = (cell is not None and cell == best[at] for at, cell in enumerate(row))
        shown.append([marked.format(text) if best else text for text, best in zip(texts, is_best, strict=True)])
    if fmt == "markdown":
        lines = [TITLES, ["---", *["---:"] * (len(TITLES) - 1)], *shown]
        return "".join(f"| {' | '.join(cell.replace('|', '&#124;') for cell in line)} |\n" for line in lines)
    if fmt == "latex":
        body = "".join(f"{' & '.join(line)} \\\\\n" for line in (TITLES, *shown))
        return f"\\begin{{tabular}}{{l{'r' * (len(TITLES) - 1)}}}\n{body}\\end{{tabular}}\n"
    return "".join(f"{line}\n" for line in columns([TITLES, *shown], [True, *[False] * len(TITLES[1:])]))


def _best(rows: Sequence[Sequence[Any]]) -> list[float | None]:
    """Return the minimum of each ranked column; None if there is one row only."""
    columns = ([cell for cell in column if isinstance(cell, float)] for column in zip(*rows, strict=True))
    return [min(there) if at in RANKED and there and len(rows) > 1 else None for at, there in enumerate(columns)]


def _cell(cell: Any) -> str:
    return cell if isinstance(cell, str) else str(cell) if isinstance(cell, int) else _short(cell)


_LATEX = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_LATEX |= {letter: "\\" + letter for letter in "_%&#${}"}
