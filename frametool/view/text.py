"""Write text for people: poses and points, aligned on the decimal points, and blocks like those of tf2_echo.

Colours on a terminal, and progress bars on stderr for jobs longer than two seconds, are written by rich.
"""

from __future__ import annotations

import math
import os
import sys
import time
from contextlib import contextmanager, suppress
from itertools import pairwise, zip_longest
from shutil import get_terminal_size
from textwrap import fill
from typing import TYPE_CHECKING, Any

from frametool.documents.writers import dump_json
from frametool.errors import printable
from frametool.frames.stamps import format_stamp
from frametool.geometry import floats, rigid
from frametool.geometry.representations import ROTATIONS, ROWS, notation
from frametool.grammar.pose import TIMES, Pose
from frametool.grammar.readers import EARTH_FRAMES
from frametool.grammar.result import ROUNDED_TO_ZERO, Result, Style, is_locked, placed, rotation_entry, rotation_numbers

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from rich.console import Console

    Line = tuple[str, Sequence[tuple[str, float]], str]  # label, numbers with their names, unit


OVERVIEW = [name + unit for name, row in ROTATIONS.items() for unit in row.overview]


WIDTH = 80
DECIMALS = 6  # in an overview of several representations
GLUE = "\0"
EXPONENT_FROM = 1e9  # larger numbers have an exponent


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return the text of results, separated by blank lines."""
    return "\n".join(_describe(result, style) for result in results)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return one aligned line per point or vector, with its frame; for a single point in ecef also its place."""
    frames, rows = [], []
    for record in records:
        frame = f"m in {record['frame']}" if record.get("frame") else "m"
        at = "" if record.get("stamp_ns") is None else f" at {format_stamp(record['stamp_ns'])}"
        kind, numbers = next(each for each in record.items() if isinstance(each[1], list))
        others = [
            f"  sigma {' '.join(sigmas)}" if (sigmas := _sigmas(key, value)) else f"  {key} {_extra_text(value)}"
            for key, value in record.items()
            if key not in (kind, "frame", "stamp_ns")
        ]
        frames.append("".join([frame, at, *others]))
        rows.append([style.number(value + 0.0) for value in numbers])
    text = "".join(f"{'  '.join(cells)}  {frame}\n" for cells, frame in zip(_aligned(rows), frames, strict=True))
    if len(rows) == 1 and record.get("frame") in EARTH_FRAMES and style.place is None and "point" in record:
        text += _layout([*_earth_lines(Pose(tuple(record["point"]), parent=record["frame"]))], style)
    return text


def _describe(result: Result, style: Style) -> str:
    """Return the heading and the aligned lines of one pose."""
    pose = result.pose
    lines: list[Line] = []
    if style.place is not None:
        from frametool.grammar.place import placed_entry

        entry, pose = placed_entry(pose, style.place)
        lines += _place_lines(entry)
    elif pose.position is not None:
        (position,), unit = placed(pose.position, style).values(), "cm" if style.in_cm else "m"
        lines.append(("translation", list(zip("xyz", position, strict=True)), unit))
    for each in style.notations or map(notation, OVERVIEW) if pose.rotation is not None else ():
        numbers = rotation_numbers(pose, each, style)
        if each.representation.shape == ROWS:
            for at, row in enumerate(rotation_entry(pose, each, style)[1][: math.isqrt(len(numbers))]):
                cells = list(zip(["[" * style.screen, *[""] * len(row)], row, strict=False))
                lines.append(("" if at else each.label, cells, "]" * style.screen))
            continue
        unit = ("deg" if each.in_degrees(style.degrees) else "rad") if each.representation.angles else ""
        lines.append((each.label, list(zip(each.names, numbers, strict=True)), unit))
        if is_locked(pose, each):
            lines.append(("", [], "gimbal lock: not unique, third angle set to 0"))
    if pose.parent in EARTH_FRAMES and not style.notations and style.place is None:
        lines += _earth_lines(pose)
    units = {"distance": "m", "angle": "rad", "linear": "m/s", "angular": "rad/s", "std": "m", "std_angle": "rad"}
    for key, value in result.all_extras(style).items():
        if isinstance(value, float):
            unit = "deg" if key.endswith("_deg") else units.get(key) or units.get(key.partition("_")[0], "")
            lines.append((key.removesuffix("_deg"), [("", value)], unit))
        elif sigmas := _sigmas(key, value):
            lines.append(("sigma", [], " ".join(each.replace(" ", GLUE) for each in sigmas)))
        elif key not in TIMES and value is not None:
            lines.append((key, [], _extra_text(value)))
    if style.place is not None and style.place.origin is not None:  # the pose is in the axes at the origin, not in ecef
        result = Result(result.pose._replace(parent=f"{style.place.name} at the origin"), result.extras)
    return _heading(result) + (_layout(lines, style) if lines else "  identity\n")


def _place_lines(entry: dict[str, Any]) -> Iterator[Line]:
    """Yield the lines of a geodetic position, one for each number of its mapping."""
    for key, value in (entry | entry.get("utm", {})).items():
        if isinstance(value, float):
            unit = "deg" if key in ("lat", "lon", "convergence_deg") else "m"
            yield key.removesuffix("_deg").replace("_", " "), [("", value)], unit * (key != "grid_scale")
        elif key == "zone":
            yield "utm zone", [], value
        elif key in ("xyz", "ecef"):
            yield "ecef", list(zip("xyz", value, strict=True)), "m"
    if "axes" in entry:
        yield "axes", [], f"{entry['axes']}: of what follows"


def _heading(result: Result) -> str:
    """Return a sentence on the frames and times of a pose."""
    pose = result.pose
    at, source_at, fixed = (result.extras.get(key) for key in TIMES)
    if pose.name is None or pose.parent is None:
        seen = f"a pose seen from {pose.parent}" if pose.parent else f"the pose of {pose.name}" if pose.name else ""
        sentence = " ".join([seen or "a pose", f"at {format_stamp(at)}"] if at is not None else [seen])
        return f"{printable(sentence)}\n" if sentence else ""
    name, parent = printable(pose.name), printable(pose.parent)
    source = name if source_at is None else f"{name} at {format_stamp(source_at)}"
    target = parent if at is None else f"{parent} at {format_stamp(at)}"
    across = "" if fixed is None else f" with {fixed} standing still"
    return in_width(f"{source} seen from {target}{across}", f"(maps points in {name} to points in {parent})", gap="  ")


def in_width(text: str, more: str, *, gap: str = " ") -> str:
    """Return one line, or two if it is wider than the terminal."""
    width = get_terminal_size((WIDTH, 0)).columns
    return f"{text}{gap}{more}\n" if len(text) + len(gap) + len(more) <= width else f"{text}\n  {more}\n"


def _earth_lines(pose: Pose) -> Iterator[Line]:
    """Yield lines with the geodetic position and heading of a pose or point in ecef, if it is finite."""
    from frametool.grammar.place import overview

    yield from ((label, [], text) for label, text in overview(pose))


def _sigmas(key: str, value: Any) -> list[str]:
    """Return the sigmas of a covariance, two digits each; [] for any other value."""
    if key != "covariance" or not isinstance(value, list) or len(value) not in (36, 9):
        return []
    try:
        numbers = [*map(float, value)]
    except (TypeError, ValueError):
        return []
    if numbers[0] == -1.0:
        return ["unknown"]  # ROS marks an unknown covariance by -1
    roots = sigmas_of(numbers)
    return [*map(_length, roots[:3]), *(_two_digits(math.degrees(root), "deg") for root in roots[3:])]


def sigmas_of(covariance: Sequence[float]) -> list[float]:
    """Return the standard deviations of a covariance of 6x6 or 3x3 numbers."""
    return [math.sqrt(max(entry, 0.0)) for entry in covariance[:: math.isqrt(len(covariance)) + 1]]


def largest_sigmas(entries: Sequence[float]) -> str:
    """Return the largest sigmas of a pose in position and rotation: `±10 mm 1.0 deg`."""
    roots = sigmas_of(entries)
    return f"±{_length(max(roots[:3]))} {_two_digits(math.degrees(max(roots[3:])), 'deg')}"


def _length(metres: float) -> str:
    return _two_digits(metres * 1000.0, "mm") if metres < 1.0 else _two_digits(metres, "m")


def _two_digits(value: float, unit: str) -> str:
    """Format a sigma with its unit: `2.1 mm`, `12 m`; tiny and huge ones have an exponent."""
    value = value if value > ROUNDED_TO_ZERO else 0.0
    if value and not 0.001 <= value < EXPONENT_FROM:
        return f"{value:.1e} {unit}"
    decimals = max(1 - math.floor(math.log10(value)), 0) if value else 0
    return f"{value:.{decimals}f} {unit}"


def _extra_text(value: Any) -> str:
    """Return the text of an extra value."""
    return printable(dump_json(value) if isinstance(value, (dict, list)) else "" if value is None else str(value))


def _layout(lines: Sequence[Line], style: Style, label: int = 0) -> str:
    """Align names and numbers in columns: of all lines or, if that is too wide, of each part; wrap longer lines.

    label: minimum width of the labels
    """
    label, width = max([label, *(len(each) for each, _, _ in lines)]), get_terminal_size((WIDTH, 0)).columns
    numbers = _aligned([[_number(value, style) for _, value in cells] for _, cells, _ in lines])
    columns = zip_longest(*(cells for _, cells, _ in lines), fillvalue=("", 0.0))
    sizes = [max(len(name) for name, _ in column) for column in columns]
    texts = []
    for (own, cells, unit), row in zip(lines, numbers, strict=True):
        named = [  # GLUE for spaces at which lines must not be wrapped
            f"{name:>{size}} {text}".replace(" ", GLUE) if size else text
            for (name, _), text, size in zip(cells, row, sizes, strict=False)
        ]
        text = f"  {own:<{label}}  ".replace(" ", GLUE) + " ".join(named)
        texts.append(f"{text}  {unit}".rstrip(f" {GLUE}").replace("  ]", " ]"))
    begins = [at for at, (own, _, _) in enumerate(lines) if at and own]
    if begins and max(map(len, texts)) > width:
        parts = pairwise([0, *begins, len(lines)])
        return "".join(_layout(lines[begin:end], style, label) for begin, end in parts)
    indent = GLUE * (label + 4)
    wrapped = (fill(text, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
               if len(text) > width else text for text in texts)  # fmt: skip
    return "".join(f"{text.replace(GLUE, ' ')}\n" for text in wrapped)


def _number(value: float, style: Style) -> str:
    """Format a number for people: DECIMALS in an overview, else all digits; 0 instead of -0."""
    text = style.number(value + 0.0)
    if style.precision is None and not style.full and len(style.notations) != 1:
        text = f"{value:.{DECIMALS}f}" if abs(value) < EXPONENT_FROM else f"{value:.{DECIMALS}e}"
    return text.removeprefix("-") if not float(text) else text


def _aligned(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Pad the numbers of each column so that their decimal points are aligned."""
    points = [[len(cell.partition(".")[0]) for cell in row] for row in rows]
    wholes = [max(column) for column in zip_longest(*points, fillvalue=0)]
    moved = [
        [" " * (whole - point) + cell for whole, point, cell in zip(wholes, places, row, strict=False)]
        for places, row in zip(points, rows, strict=True)
    ]
    widths = [max(map(len, column)) for column in zip_longest(*moved, fillvalue="")]
    return [[f"{cell:<{width}}" for cell, width in zip(row, widths, strict=False)] for row in moved]


ECHOED = (("quaternion", "Quaternion"), ("rpy_rad", "RPY (radian)"), ("rpy_deg", "RPY (degree)"))


def write_blocks(results: Iterable[Result], target: str, source: str, style: Style) -> Iterator[str]:
    """Yield blocks like those of tf2_echo as results arrive; the first begins with a sentence on the frames."""
    heading = in_width(f"{source} seen from {target}", f"(maps points in {source} to points in {target})")
    decimals = 3 if style.precision is None else style.precision
    number = style.changed(precision=decimals).number
    for result in results:
        stamp_ns, components = result.extras.get("stamp_ns"), result.pose.components
        time = "At any time: the frames stand still" if stamp_ns is None else f"At time {format_stamp(stamp_ns)}"
        lines = [f"{heading}{time}", f"- Translation: [{', '.join(map(number, components[:3]))}]"]
        for spec, name in ECHOED:
            numbers = rotation_numbers(result.pose, notation(spec), style)
            lines.append(f"- Rotation: in {name} [{', '.join(map(number, numbers))}]")
        lines.append("- Matrix:")
        entries = [f" {number(each):>{decimals + 3}}" for each in rigid.to_homogeneous(*components, floats)]
        lines += ["".join(entries[at : at + 4]) for at in range(0, 16, 4)]
        yield "\n".join(lines) + "\n"
        heading = ""


PATIENCE, BETWEEN = 2.0, 0.1  # seconds before the bar is shown, and between updates


@contextmanager
def progress_bar(
    total: int | None, *, quiet: bool = False, counted: str = "rows"
) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that adds rows and bytes; on a terminal they are shown if the job takes longer than PATIENCE.

    total: number of bytes, None if unknown; counted: the unit of the rows
    """
    is_hidden, begin = quiet or sys.stderr is None or not sys.stderr.isatty(), time.monotonic()
    rows, size, due = 0, 0, PATIENCE
    bar: Any = None

    def advance(more_rows: int, more_size: int) -> None:
        nonlocal rows, size, due, bar
        rows, size, seconds = rows + more_rows, size + more_size, time.monotonic() - begin
        if is_hidden or seconds < due:
            return
        due = seconds + BETWEEN
        with suppress(OSError):
            if bar is None:
                from rich.progress import Progress, TextColumn

                columns = [] if total else [TextColumn("{task.description}")]  # [] is rich's default, with a bar
                bar = Progress(*columns, console=coloured_console(stderr=True), transient=True)
                bar.start()
                bar.add_task("", total=total)
            bar.update(bar.task_ids[0], completed=size, description=f"{rows:,} {counted}  {rows / seconds:,.0f}/s")

    try:
        yield advance
    finally:
        with suppress(OSError):  # the results are valid even if the terminal is gone
            if bar is not None:
                bar.stop()


def coloured_console(color: str = "auto", *, stderr: bool = False) -> Console:
    """Return a rich console, in colour if the terminal has colours, or by `color`: always or never.

    Without colour, also by NO_COLOR, nothing is bold or dim either.
    """
    from rich.console import Console

    plain = color == "never" or (color == "auto" and bool(os.environ.get("NO_COLOR")))
    return Console(
        file=sys.stderr if stderr else sys.stdout, highlight=False, soft_wrap=True, no_color=plain,
        force_terminal=True if color == "always" else None,
        color_system=None if plain else "auto" if color == "auto" else "standard",
    )  # fmt: skip
