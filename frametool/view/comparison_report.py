"""Write reports of comparisons: text, tables for papers, and pictures of paths and errors over time.

The pictures are in an HTML page with all numbers, or in an SVG of one comparison.
"""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from html import escape
from itertools import groupby, pairwise
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool import __version__
from frametool.documents.writers import dump_json
from frametool.errors import printable
from frametool.fit.limits import SHORT, number_at
from frametool.formats.rows.csv import write_points
from frametool.grammar.result import Style
from frametool.view import pictures
from frametool.view.pictures import ChartLine, Picture, SvgElement, chart, stacked
from frametool.view.reports import columns, fixed
from frametool.view.text import WIDTH

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.fit.comparison import Comparison
    from frametool.view.pictures import Place, Point

NAME, LONGEST_NAME = 18, 24  # characters; longer names do not widen the column
STATISTICS = ("rmse", "mean", "median", "p95", "max")
ABSOLUTE = {
    "m": "ate m", "deg": "ate deg", "rot": "ate rot", "full": "ate full",
    "along_m": "  along m", "across_m": "  across m", "up_m": "  up m",
}  # fmt: skip
# the columns of a table: their titles and their names in CSV
TITLES = {
    "est": "est", "ate": "ate_m", "max": "max_m", "deg": "ate_deg", "along": "along_m", "across": "across_m",
    "up": "up_m", "rpe": "rpe_percent", "kitti": "kitti_percent", "scale": "scale", "paired": "paired",
}  # fmt: skip
PATHS = SHORT | {"rpe": "rpe.-1.percent"}
RANKED = range(1, [*TITLES].index("scale"))
LATEX = {letter: f"\\{letter}" for letter in "_%&#${}"}
LATEX |= {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
ESCAPED = {"text": {}, "markdown": str.maketrans({"|": "&#124;"}), "latex": str.maketrans(LATEX)}


def write_comparison(found: dict[str, Any]) -> str:
    """Return the text of one comparison: pairs, alignment, errors."""
    poses, settings, kitti, path = found["poses"], found["settings"], found["kitti"], found["path_m"]["ref"]
    duration = "" if found["ref_duration_s"] is None else f", {found['ref_duration_s']:.3f} s"
    share = 100 * poses["paired"] / max(poses["possible"], 1)
    how = {
        "interpolate": f", {found.get(settings['interpolated'] or '')} interpolated",
        "nearest": f", nearest within {1e3 * (settings['max_diff_s'] or 0):g} ms",
        "number": ", by number",
    }[settings["match"]]
    heads = [
        (f"{found['ref']}  ", f"reference: {poses['ref']} poses{duration}, {path:.3f} m"),
        (f"{found['est']}  ", f"{poses['paired']} of {poses['possible']} poses paired ({share:.0f} %){how}"),
    ]
    if found["offset_s"]:
        side = "behind" if found["offset_s"] > 0 else "ahead"
        heads.append(("clock", f"{abs(found['offset_s']):.6f} s {side}, corrected"))
    if settings["mount"]:
        x, y, z, w = settings["mount"]["quaternion"].values()
        turn = math.degrees(2.0 * math.atan2(math.hypot(x, y, z), abs(w)))
        place = ", ".join(f"{number:.6f}" for number in settings["mount"]["xyz"])
        heads.append(("mount", f"{place} m" + (f", turned by {turn:.3f} deg" if turn else "")))
    fits = "  ".join(f"{kind} {fixed(value, 3)}" for kind, value in found["ate_by_alignment"].items())
    heads.append((f"fit {settings['align']}; ate m ", fits))
    size = max([NAME, *(len(name) for name, _ in heads[:2] if len(name) <= LONGEST_NAME)])
    hanging: Any = {"subsequent_indent": " " * 16, "break_long_words": False, "break_on_hyphens": False}
    lines = [fill(f"{name:{size}}{text}", WIDTH, **hanging) for name, text in heads]
    lines.append("".join([f"{'':16}", *(f"{title:>10}" for title in STATISTICS)]))
    lines += (_statistics(label, found["ate"][key]) for key, label in ABSOLUTE.items() if key in found["ate"])
    for row in found["rpe"]:
        percent = "" if row["percent"] is None else f"{row['percent']:8.2f} %"
        lines.append(_statistics(f"rpe {row['delta']} m", row["m"]) + percent)
        other = ("  distance m", "distance_m") if row["deg"] is None else (f"rpe {row['delta']} deg", "deg")
        lines.append(_statistics(other[0], row[other[1]]))
    segments = f"-  ({path:.1f} m of path, {min(settings['segments_m']):g} m asked)"
    if kitti:
        segments = f"{kitti['percent']:.4f} %  {kitti['deg_per_m']:.6f} deg/m  ({kitti['segments']} segments)"
    return "\n".join([*lines, f"{'kitti':{NAME}}{segments}", ""])


def _statistics(label: str, summed: dict[str, float] | None) -> str:
    return f"{label:16} " + " ".join(f"{fixed(summed[key] if summed else None, 6):>9}" for key in STATISTICS)


def write_table(found: Sequence[dict[str, Any]], fmt: str = "text") -> str:
    """Return a row per comparison: `csv`, or `text`, `markdown`, `latex` with the best value of each column marked."""
    rows = [[number_at(each, PATHS.get(title, title)) for title in TITLES] for each in found]
    if fmt == "csv":
        return write_points([dict(zip(TITLES.values(), row, strict=True)) for row in rows], Style("csv"))
    known = ([cell for cell in column if isinstance(cell, float)] for column in zip(*rows, strict=True))
    best = [min(there) if at in RANKED and there and len(rows) > 1 else None for at, there in enumerate(known)]
    mark = {"text": "{}*", "markdown": "**{}**", "latex": r"\textbf{{{}}}"}[fmt]
    shown: list[Sequence[str]] = [[*TITLES]]
    for row in rows:
        texts = (str(cell) if isinstance(cell, (str, int)) else fixed(cell, 3) for cell in row)
        marks = (mark if cell is not None and cell == least else "{}" for cell, least in zip(row, best, strict=True))
        shown.append([each.format(text.translate(ESCAPED[fmt])) for each, text in zip(marks, texts, strict=True)])
    if fmt == "markdown":
        shown.insert(1, ["---", *["---:"] * (len(TITLES) - 1)])
        return "".join(f"| {' | '.join(line)} |\n" for line in shown)
    if fmt == "latex":
        body = "".join(f"{' & '.join(line)} \\\\\n" for line in shown)
        return f"\\begin{{tabular}}{{l{'r' * (len(TITLES) - 1)}}}\n{body}\\end{{tabular}}\n"
    return columns(shown, [True, *[False] * (len(TITLES) - 1)])


WIDE, HIGH = 412.0, 112.0  # pixels of a chart
LEFT, TOP, RIGHT, BOTTOM, GAP = 54.0, 40.0, 14.0, 42.0, 68.0  # pixels around a chart, and between two of a column
ROW = 38.0  # pixels for the box of an estimate and its name
STRETCHES, FEWEST = 200, 20  # parts of all paths together, and at least of each; of a part only extremes are drawn
LEVELS, BINS = 12, 30  # number of colours for the error along a path, and of columns in its histogram
ERROR_STOPS = ((47, 108, 216), (190, 90, 190), (235, 94, 20))  # visible on white and on dark
SHADES = [pictures.shade_of(level / (LEVELS - 1), ERROR_STOPS) for level in range(LEVELS)]
STILL = 1e-6  # metres: a smaller path is a point


class Curve(NamedTuple):
    """A comparison to draw: its name and colour, the indices of the drawn pairs, and their times in seconds."""

    found: Comparison
    name: str
    colour: str
    chosen: Any
    times: list[float]

    def line(self, name: str, colour: str, values: Any) -> ChartLine:
        """Return the line of a value over time, at the drawn pairs."""
        return ChartLine(name, colour, [*zip(self.times, values[self.chosen].tolist(), strict=True)], 1.2)


def write_report(found: Sequence[Comparison], fmt: str, command: str) -> str:
    """Return a self-contained report: `svg` of one comparison, or `html` of any number."""
    curves = [_curve(each, at, len(found)) for at, each in enumerate(found)]
    numbers = [each.as_dict() for each in found]
    unit = "pair" if found[0].pairs.ref.stamps_ns is None else "s"
    path, on_path = _path(curves)
    errors, on_errors = _over_time(curves, "pair" if unit == "pair" else "time (s)")
    left, right = {"path": path}, {"errors": errors}
    is_one = len(curves) == 1
    (left if is_one else right)["distribution"] = _distribution(curves)
    if lengths := _by_length(curves, numbers):
        (right if is_one else left)["lengths"] = lengths
    title = f"{curves[0].name if is_one else f'{len(curves)} estimates'} against {printable(found[0].names[0])}"
    if fmt == "svg":
        title = f"{title}: ate {numbers[0]['ate']['m']['rmse']:.4g} m"
        pieces, bottom, wide = "", 0.0, left["path"].width
        for number, column in enumerate((left, right)):
            top = 24.0
            for each in column.values():
                pieces += pictures.svg_element(each, place=f' x="{number * each.width:g}" y="{top:g}"')
                top += each.height
            bottom = max(bottom, top)
        heading = pictures.svg_text(LEFT, 20.0, title, weight="bold")
        return pictures.write_svg(Picture(2.0 * wide, bottom, [heading], title), pieces)
    drawn = ""
    for column in (left, right):
        figures = (f"<figure id={name}>{pictures.svg_element(each)}</figure>" for name, each in column.items())
        drawn += f"<div>{''.join(figures)}</div>\n"
    hints = dict.fromkeys(hint for each in numbers for hint in each["hints"])
    text = "\n".join([*([] if is_one else [write_table(numbers)]), *map(write_comparison, numbers)])
    body = pictures.filled(
        "report.html", title=escape(title), made=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC, frametool {__version__}",
        command=escape(printable(command)), hints="".join(f"<p class=hint>{escape(hint)}</p>" for hint in hints),
        text=escape(text), figures=drawn,
    )  # fmt: skip
    samples = {"unit": unit, "curves": [_samples(each, on_path, on_errors) for each in curves]}
    held = {"numbers": f"[{', '.join(map(dump_json, numbers))}]", "samples": json.dumps(samples)}
    return pictures.write_html(title, body, script="tables.js report.js", data=held)


def _curve(found: Comparison, at: int, count: int) -> Curve:
    """Choose the pairs of a comparison to draw: the extremes of its errors in each part of the path, and both ends."""
    ate, stamps = found.ate, found.pairs.ref.stamps_ns
    chosen = np.arange(found.pairs.ref.size)
    times = chosen if stamps is None else (stamps - stamps[0]) / 1e9
    stretches = max(STRETCHES // count, FEWEST)
    if len(chosen) > 2 * stretches:
        every = [ate.m, ate.rad, *((ate.along, ate.across, ate.up) if count == 1 else ())]
        edges = [*pairwise(np.linspace(0, len(chosen), stretches + 1).astype(int))]
        picked = {begin + pick(values[begin:end]) for values in every if values is not None
                  for begin, end in edges for pick in (np.argmin, np.argmax)}  # fmt: skip
        chosen = np.array(sorted({0, len(chosen) - 1, *picked}))
    colour = "trail" if count == 1 else [*pictures.SERIES][at % len(pictures.SERIES)]
    return Curve(found, printable(found.names[1]), colour, chosen, times[chosen].tolist())


def _figure(high: float, shapes: Sequence[SvgElement]) -> Picture:
    return Picture(LEFT + WIDE + RIGHT, TOP + high + BOTTOM, shapes)


def _path(curves: Sequence[Curve]) -> tuple[Picture, Callable[[Any], list[Point]]]:
    """Draw the paths, seen along the axis of least extent; a single estimate is coloured by its error.

    Also returns a function from positions to pixels.
    """
    first, ref = curves[0].found, curves[0].found.pairs.ref
    every = np.concatenate([xyz for each in curves for xyz in (each.found.pairs.ref.xyz, each.found.moved.xyz)])
    axes = np.sort(np.argsort(np.ptp(every, axis=0), kind="stable")[1:])
    low, high = every[:, axes].min(0), every[:, axes].max(0)
    span = (high - low).max() if (high - low).max() > STILL else 1.0
    base = np.where(np.abs(low) > 1e3 * span, np.round(low), 0.0)  # subtracted from a path far from 0
    names = [f"{'xyz'[axis]}{f' - {at:.0f}' if at else ''} (m)" for axis, at in zip(axes, base, strict=True)]
    wide, tall = np.maximum(high - low, 1e-9)
    area = LEFT, TOP, WIDE, WIDE * min(max(float(tall / wide), 0.5), 1.0)
    pixels = np.array(area[2:])
    reach = ((high - low + 0.06 * span) / pixels).max() * pixels / 2.0  # metres, with one scale for both axes
    middle = (low + high) / 2.0 - base
    ends = [*zip((middle - reach).tolist(), (middle + reach).tolist(), strict=True)]

    def seen(xyz: Any) -> list[Point]:
        return (xyz[:, axes] - base).tolist()  # type: ignore[no-any-return]

    lines = [ChartLine("reference", "soft", seen(ref.xyz[curves[0].chosen]), 2.0, (5.0, 4.0))]
    legend: list[SvgElement] = []
    if len(curves) == 1:
        lines.append(ChartLine("estimate, by error", SHADES[LEVELS // 2], []))
        points, errors, begin = seen(first.moved.xyz[curves[0].chosen]), first.ate.m, 0
        levels = (errors[curves[0].chosen] / (errors.max() or 1.0) * LEVELS).astype(int)
        for level, run in groupby(np.minimum(levels, LEVELS - 1).tolist()[:-1]):
            end = begin + len([*run])
            lines.append(ChartLine("", SHADES[level], points[begin : end + 1], 2.0))
            begin = end
        below, text = TOP + area[3] + 25.0, f"error 0 .. {errors.max():.3g} m"
        legend += (pictures.box(LEFT + at * 7.0, below, 7.5, 9.0, shade) for at, shade in enumerate(SHADES))
        legend.append(pictures.svg_text(LEFT + LEVELS * 7.0 + 8.0, below + 4.5, text, "soft", size=11.0))
    else:
        lines += [ChartLine(each.name, each.colour, seen(each.found.moved.xyz[each.chosen])) for each in curves]
    shapes, place = chart(area, (names[0], names[1]), lines, ends)
    start = pictures.dot(*place(*seen(first.moved.xyz[:1])[0]), 4.0, "ink", "start")
    return _figure(area[3], [*shapes, start, *legend]), lambda xyz: [place(*point) for point in seen(xyz)]


def _over_time(curves: Sequence[Curve], along: str) -> tuple[Picture, Place]:
    """Draw the errors over time: in position, in rotation, and for one estimate along and across its path.

    Also returns a function from a time and an error in position to pixels.
    """
    ate, one = curves[0].found.ate, len(curves) == 1
    position = [each.line(each.name * (not one), each.colour, each.found.ate.m) for each in curves]
    turned = [(each, each.found.ate.rad) for each in curves]
    rotation = [each.line("", each.colour, np.degrees(rad)) for each, rad in turned if rad is not None]
    kinds = {"error in position (m)": position, **({"error in rotation (deg)": rotation} if rotation else {})}
    if one:
        rmse, end = float(np.sqrt((ate.m**2).mean())), curves[0].times[-1]
        position.append(ChartLine(f"rmse {rmse:.3g} m", "soft", [(0.0, rmse), (end, rmse)], 1.0, (4.0, 3.0)))
        parts = (("along", "x", ate.along), ("across", "y", ate.across), ("up", "z", ate.up))
        kinds["error in the path's axes (m)"] = [curves[0].line(*part) for part in parts]
    shapes, place = stacked((LEFT, TOP, WIDE, HIGH), GAP, along, kinds)
    return _figure(len(kinds) * (HIGH + GAP) - GAP, shapes), place


def _distribution(curves: Sequence[Curve]) -> Picture:
    """Draw the distribution of the error: a histogram for one estimate, boxes for several."""
    if len(curves) == 1:
        errors = curves[0].found.ate.m
        counts, edges = np.histogram(errors, BINS, (0.0, errors.max() or 1.0))
        steps = [*zip(np.repeat(edges, 2)[1:-1].tolist(), np.repeat(counts, 2).tolist(), strict=True)]
        lines, names = [ChartLine("", curves[0].colour, steps)], ("error in position (m)", "poses")
        return _figure(HIGH, chart((LEFT, TOP, WIDE, HIGH), names, lines)[0])
    worst = max(float(each.found.ate.m.max()) for each in curves)
    names = ("error in position (m)", "boxes: half of the poses; lines: 5 to 95 %; dots: median, maximum")
    area, ends = (LEFT, TOP, WIDE, ROW * len(curves)), ((0.0, worst or 1.0), (0.0, 1.0))
    shapes, place = chart(area, names, ends=ends, is_scaled=False)
    for at, each in enumerate(curves):
        y, colour = TOP + (at + 0.66) * ROW, each.colour
        marks = np.percentile(each.found.ate.m, (5, 25, 50, 75, 95, 100)).tolist()
        least, first, middle, third, most, last = (place(mark, 0.0)[0] for mark in marks)
        shapes += [
            pictures.line([(least, y), (most, y)], colour, 1.5, title=each.name),
            pictures.box(first, y - 7.0, third - first, 14.0, colour), pictures.dot(middle, y, 4.0, "paper"),
            pictures.dot(last, y, 3.0, colour), pictures.svg_text(LEFT + 4.0, y - 17.0, each.name[:60], size=11.0),
        ]  # fmt: skip
    return _figure(ROW * len(curves), shapes)


def _by_length(curves: Sequence[Curve], numbers: Sequence[dict[str, Any]]) -> Picture | None:
    """Draw relative errors by length, of KITTI's segments or of deltas in metres; None for fewer than 3 lengths."""
    lines = []
    for curve, each in zip(curves, numbers, strict=True):
        points = [(row["length_m"], row["percent"]) for row in (each["kitti"] or {"lengths": []})["lengths"]]
        deltas = [(float(row["delta"][:-1]), row["percent"]) for row in each["rpe"] if row["percent"] is not None]
        if len(points or deltas) >= 3:
            lines.append(ChartLine("", curve.colour, sorted(points or deltas), dots=True))
    shapes, _ = chart((LEFT, TOP, WIDE, HIGH), ("length (m)", "relative error (%)"), lines)
    return _figure(HIGH, shapes) if lines else None


def _samples(curve: Curve, on_path: Callable[[Any], list[Point]], on_errors: Place) -> dict[str, Any]:
    """Return the pixels of the drawn pairs in both charts, and the values shown on hover."""
    ate, chosen = curve.found.ate, curve.chosen
    errors = [on_errors(*point) for point in zip(curve.times, ate.m[chosen].tolist(), strict=True)]
    pixels = {"path": on_path(curve.found.moved.xyz[chosen]), "errors": errors}
    numbers = {"m": ate.m[chosen], **({} if ate.rad is None else {"deg": np.degrees(ate.rad[chosen])})}
    return {
        "name": curve.name, "colour": curve.colour, "t": [round(each, 3) for each in curve.times],
        **{key: [[round(x, 1), round(y, 1)] for x, y in places] for key, places in pixels.items()},
        **{key: [float(f"{each:.4g}") for each in values.tolist()] for key, values in numbers.items()},
    }  # fmt: skip
