"""Comparisons as pictures: paths coloured by error, errors over time, how often which, errors by length."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.fit.numbers import statistics
from frametool.view.fit_text import write_comparison, write_table
from frametool.view.pictures import Picture, PictureBox, PictureDot, PictureLine, PictureWords, shade_of, write_svg
from frametool.view.run_plot import ticks

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.fit.comparison import Comparison
    from frametool.view.pictures import Shape

    Points = Sequence[tuple[float, float]]

MAP, MARGIN, WIDE, HIGH, GAP = 460.0, 60.0, 420.0, 120.0, 50.0  # pixels
LEFT = MAP + 2 * MARGIN + 40.0
MOST = 2000  # points of a line
LEVELS = 24  # of error along a path
BINS = 30
POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def comparison_picture(found: Comparison) -> Picture:
    """Draw one comparison, as large at a thousand pairs as at a million."""
    numbers = found.as_dict()
    title = f"{found.names[1]} against {found.names[0]}"
    shapes: list[Shape] = [PictureWords(MARGIN, 24.0, f"{title}: ate {numbers['ate']['m']['rmse']:.4g} m", bold=True)]
    shapes += _paths(found)
    top = MARGIN
    shapes += _over_time(found, top)
    shapes += _histogram(found, top + HIGH + GAP)
    shapes += _by_length(numbers, top + 2 * (HIGH + GAP))
    return Picture(LEFT + WIDE + MARGIN / 2, MAP + 2 * MARGIN, shapes, title)


def write_report(found: Sequence[Comparison], form: str, command: str) -> str:
    """Return a report in one file that asks nothing of anybody: `svg` of one comparison, or `html` of any."""
    if form == "svg":
        return write_svg(comparison_picture(found[0]))
    from html import escape

    from frametool.documents.json import dump

    every = [each.as_dict() for each in found]
    table = write_table(every) + "\n" if len(every) > 1 else ""
    texts = table + "\n".join(map(write_comparison, every)) + f"\n$ {command}\n"
    pictures = "".join(write_svg(comparison_picture(each)) for each in found)
    held = "[" + ", ".join(map(dump, every)) + "]"
    for letter in "<>&":  # nothing in it ends the element
        held = held.replace(letter, f"\\u{ord(letter):04x}")
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f"<title>{escape(', '.join(each.names[1] for each in found))}</title></head>\n"
        f"<body>\n{pictures}<pre>{escape(texts)}</pre>\n"
        f'<script type="application/json" id="numbers">{held}</script>\n</body>\n</html>\n'
    )


def _thinned(values: Any) -> Any:
    """Return which of many values are drawn: of each stretch the least and the most, and both ends."""
    count = len(values)
    if count <= MOST:
        return np.arange(count)
    edges = np.linspace(0, count, MOST // 2 + 1).astype(int)
    found = [
        begin + at for begin, end in pairwise(edges) for at in (values[begin:end].argmin(), values[begin:end].argmax())
    ]
    return np.unique([0, count - 1, *found])


def _paths(found: Comparison) -> Iterator[Shape]:
    """Draw both paths along the axis they spread least, the estimate coloured by its error, and what colours mean."""
    ref, est, error = found.pairs.ref.xyz, found.moved.xyz, found.ate.m
    right, ahead = sorted(np.argsort(np.ptp(ref, 0), kind="stable")[1:].tolist())
    both = np.concatenate([ref, est])
    low, high = both.min(0), both.max(0)
    span = max(high[right] - low[right], high[ahead] - low[ahead], 1e-9)

    def place(xyz: Any) -> list[tuple[float, float]]:
        x = MARGIN + MAP * (xyz[:, right] - (low[right] + high[right] - span) / 2) / span
        y = MARGIN + MAP - MAP * (xyz[:, ahead] - (low[ahead] + high[ahead] - span) / 2) / span
        return list(zip(x.tolist(), y.tolist(), strict=True))

    yield PictureLine(place(ref[_thinned(ref[:, right])]), "zero", 2.0, title=found.names[0])
    chosen = _thinned(error)
    points, worst = place(est[chosen]), float(error.max())
    levels = np.minimum((error[chosen] / (worst or 1.0) * LEVELS).astype(int), LEVELS - 1).tolist()
    begin = 0
    for at in range(1, len(levels) + 1):
        if at == len(levels) or levels[at] != levels[begin]:
            colour = shade_of((levels[begin] + 0.5) / LEVELS)
            what = f"{found.names[1]}: {error[chosen[begin]]:.3g} m"
            yield PictureLine(points[begin : at + 1], colour, 2.0, title=what)
            begin = at
    yield PictureDot(*points[0], 4.0, "ink", f"{found.names[1]} begins")
    for level in range(LEVELS):
        colour = shade_of(level / (LEVELS - 1))
        yield PictureBox(MARGIN + level * 6.0, MARGIN + MAP + 18.0, 6.5, 10.0, colour)
    yield PictureWords(MARGIN + LEVELS * 6.0 + 8.0, MARGIN + MAP + 23.0, f"0 .. {worst:.3g} m", "soft")
    seen = f"{'xyz'[right]} right, {'xyz'[ahead]} up; {span:.4g} m"
    yield PictureWords(MARGIN + MAP, MARGIN + MAP + 23.0, seen, "soft", "end")


def _over_time(found: Comparison, top: float) -> Iterator[Shape]:
    stamps = found.pairs.ref.stamps_ns
    times = np.arange(found.pairs.ref.size) if stamps is None else (stamps - stamps[0]) / 1e9
    chosen = _thinned(found.ate.m)
    curve = list(zip(times[chosen].tolist(), found.ate.m[chosen].tolist(), strict=True))
    rmse = statistics(found.ate.m).rmse
    lines = [(curve, "x", 1.2), ([(curve[0][0], rmse), (curve[-1][0], rmse)], "soft", 1.0)]
    yield from _panel(f"error (m) over {'poses' if stamps is None else 'time (s)'}", lines, top)


def _histogram(found: Comparison, top: float) -> Iterator[Shape]:
    counts, edges = np.histogram(found.ate.m, BINS)
    steps = [point for count, begin, end in zip(counts.tolist(), edges.tolist(), edges[1:].tolist(), strict=False)
             for point in ((begin, count), (end, count))]  # fmt: skip
    yield from _panel("how many poses have which error (m)", [(steps, "y", 1.5)], top)


def _by_length(numbers: dict[str, Any], top: float) -> Iterator[Shape]:
    """Draw KITTI's errors by length, or else those of the deltas in metres."""
    if numbers["kitti"]:
        points = [(row["length_m"], row["percent"]) for row in numbers["kitti"]["lengths"]]
    else:
        points = [(float(row["delta"][:-1]), row["percent"]) for row in numbers["rpe"] if row["percent"] is not None]
    if points:
        yield from _panel("error (%) by length (m)", [(sorted(points), "z", 1.5)], top, dots=True)


def _panel(
    title: str, lines: Sequence[tuple[Points, str, float]], top: float, *, dots: bool = False
) -> Iterator[Shape]:
    """Draw a diagram from 0: ticks, their numbers, lines."""
    x_ticks = ticks(min(0.0, lines[0][0][0][0]), max(x for points, _, _ in lines for x, _ in points))
    y_ticks = ticks(0.0, max(y for points, _, _ in lines for _, y in points))

    def place(x: float, y: float) -> tuple[float, float]:
        return LEFT + WIDE * (x - x_ticks[0]) / (x_ticks[-1] - x_ticks[0]), top + HIGH * (1 - y / y_ticks[-1])

    yield PictureWords(LEFT, top - 14.0, title)
    for tick in y_ticks:
        yield PictureLine([place(x_ticks[0], tick), place(x_ticks[-1], tick)], "faint")
        yield PictureWords(LEFT - 6.0, place(0.0, tick)[1], f"{tick:g}", "soft", "end", 10.0)
    for tick in x_ticks:
        yield PictureWords(place(tick, 0.0)[0], top + HIGH + 12.0, f"{tick:g}", "soft", "middle", 10.0)
    for points, colour, width in lines:
        placed = [place(*point) for point in points]
        yield PictureLine(placed, colour, width)
        yield from (PictureDot(x, y, 3.0, colour) for x, y in placed if dots)
