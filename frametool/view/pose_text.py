"""Poses and trees for a person: every notation aligned on the decimal point, blocks as tf2_echo prints them, drawings.

A tree is a drawing of lines, on a terminal in colour, through rich; so is how far a long stream is.
"""

from __future__ import annotations

import math
import re
import sys
from itertools import zip_longest
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.json import dump
from frametool.errors import ValueInvalid, cells, printable
from frametool.frames.stamps import format_stamp
from frametool.geometry import floats, rigid
from frametool.geometry.representations import ROTATIONS, ROWS, notation
from frametool.geometry.transform import Transform
from frametool.grammar.names import EARTH_FRAMES
from frametool.grammar.pose import TIMES, Pose
from frametool.grammar.result import (
    ROUNDED_TO_ZERO,
    Result,
    edge_label,
    is_locked,
    placed,
    rotation_entry,
    rotation_numbers,
)  # fmt: skip

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rich.console import Console

    from frametool.frames.lookups import Frames
    from frametool.frames.track import Track
    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Components
    from frametool.grammar.result import Style


OVERVIEW = [name + unit for name, row in ROTATIONS.items() for unit in row.overview]


WIDTH = 80
WIDEST_SIGMAS = 62  # characters of six sigmas in one line of an overview
DECIMALS = 6  # of an overview
ENDLESS = 1e9  # where that many decimals say nothing


class NumberLine(NamedTuple):
    """One line of a description: what it is, its numbers with their names, their unit."""

    label: str
    cells: Sequence[tuple[str, float]]
    unit: str


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Describe the results, parted by blank lines."""
    return "\n".join(_describe(result, style) for result in results)


def write_points(records: Iterable[dict[str, Any]], style: Style) -> str:
    """Return one line a point, aligned, with its frame."""
    frames, rows = [], []
    for record in records:
        frame = f"m in {record['frame']}" if record.get("frame") else "m"
        at = "" if record.get("stamp_ns") is None else f" at {format_stamp(record['stamp_ns'])}"
        kind, numbers = next(each for each in record.items() if isinstance(each[1], list))
        others = [
            f"  sigma {' '.join(sigmas)}" if (sigmas := _sigmas(key, value)) else f"  {key} {_said(value)}"
            for key, value in record.items()
            if key not in (kind, "frame", "stamp_ns")
        ]
        frames.append("".join([frame, at, *others]))
        rows.append([style.number(value + 0.0) for value in numbers])
    text = "".join(f"{'  '.join(cells)}  {frame}\n" for cells, frame in zip(_aligned(rows), frames, strict=True))
    if len(rows) == 1 and record.get("frame") in EARTH_FRAMES and style.place is None and "point" in record:
        lines = list(_earth_lines(Pose(tuple(record["point"]), parent=record["frame"])))
        text += _layout(lines, style) if lines else ""
    return text


def _describe(result: Result, style: Style) -> str:
    """Return the heading and the aligned lines of one pose."""
    pose = result.pose
    lines: list[NumberLine] = []
    if style.place is not None:
        from frametool.grammar.place import placed_entry

        entry, pose = placed_entry(pose, style.place)
        lines += _place_lines(entry)
    elif pose.position is not None:
        (position,), unit = placed(pose.position, style).values(), "cm" if style.in_cm else "m"
        lines.append(NumberLine("translation", list(zip("xyz", position, strict=True)), unit))
    if pose.rotation is not None:
        for each in style.notations or map(notation, OVERVIEW):
            lines += _rotation_lines(pose, each, style)
    if pose.parent in EARTH_FRAMES and not style.notations and style.place is None:
        lines += _earth_lines(pose)
    lines += _extra_lines(result.said(style))
    if style.place is not None and style.place.origin is not None:  # of its axes, not of the Earth's
        result = Result(result.pose._replace(parent=f"{style.place.name} at the origin"), result.extras)
    return _heading(result) + (_layout(lines, style) if lines else "  identity\n")


def _place_lines(entry: dict[str, Any]) -> Iterator[NumberLine]:
    """Yield the lines of a position on the Earth as a mapping has it."""
    at = [(name, entry[name]) for name in ("lat", "lon") if name in entry]
    if at:
        yield NumberLine("lla", at, "deg")
        yield NumberLine("", [("alt", entry["alt"])], "m")
    if "xyz" in entry or "ecef" in entry:
        yield NumberLine("ecef", list(zip("xyz", entry.get("xyz") or entry["ecef"], strict=True)), "m")
    if utm := entry.get("utm"):
        yield NumberLine("utm", [(name, utm[name]) for name in ("easting", "northing")], f"m in {utm['zone']}")
        yield NumberLine("", [("alt", utm["alt"])], "m")
        yield NumberLine("convergence", [("", utm["convergence_deg"])], "deg")
        yield NumberLine("grid scale", [("", utm["grid_scale"])], "")
    local = [(name, entry[name]) for name in ("east", "north", "up", "down") if name in entry]
    if local:
        yield NumberLine("enu" if "up" in entry else "ned", sorted(local, key=lambda at: [*entry].index(at[0])), "m")
    if "axes" in entry:
        yield NumberLine("axes", [], f"{entry['axes']}: of what follows")


def _heading(result: Result) -> str:
    """Return in words which frame is seen from which, and when."""
    pose = result.pose
    at, source_at, fixed = (result.extras.get(key) for key in TIMES)
    if pose.name is None or pose.parent is None:
        seen = f"a pose seen from {pose.parent}" if pose.parent else f"the pose of {pose.name}" if pose.name else ""
        said = " ".join([seen or "a pose", f"at {format_stamp(at)}"] if at is not None else [seen])
        return f"{printable(said)}\n" if said else ""
    name, parent = printable(pose.name), printable(pose.parent)
    source = name if source_at is None else f"{name} at {format_stamp(source_at)}"
    target = parent if at is None else f"{parent} at {format_stamp(at)}"
    across = "" if fixed is None else f" with {fixed} standing still"
    return in_width(f"{source} seen from {target}{across}", f"(maps points in {name} to points in {parent})", gap="  ")


def in_width(text: str, more: str, *, gap: str = " ") -> str:
    """Return one line, or two where one is wider than the terminal."""
    width = get_terminal_size((WIDTH, 0)).columns
    return f"{text}{gap}{more}\n" if len(text) + len(gap) + len(more) <= width else f"{text}\n  {more}\n"


def _earth_lines(pose: Pose) -> Iterator[NumberLine]:
    """Yield the lines of where a pose or point in ecef is on the Earth, and where its x points; nothing of no place."""
    from frametool.grammar.place import overview

    yield from (NumberLine(label, [], said) for label, said in overview(pose))


def _rotation_lines(pose: Pose, notation: Notation, style: Style) -> Iterator[NumberLine]:
    """Yield the lines of one notation."""
    row, numbers = notation.representation, rotation_numbers(pose, notation, style)
    if row.shape == ROWS:
        for at, each in enumerate(rotation_entry(pose, notation, style)[1][: math.isqrt(len(numbers))]):
            names = ["[" * style.screen, *[""] * len(each)]
            yield NumberLine("" if at else notation.label, list(zip(names, each, strict=False)), "]" * style.screen)
        return
    unit = ("deg" if style.in_degrees(notation) else "rad") if row.angles else ""
    yield NumberLine(notation.label, list(zip(notation.names, numbers, strict=True)), unit)
    if is_locked(pose, notation):
        yield NumberLine("", [], "gimbal lock: not unique, third angle set to 0")


def _extra_lines(extras: dict[str, Any]) -> Iterator[NumberLine]:
    """Yield the lines of what is only said about a pose."""
    units = {"distance": "m", "angle": "rad", "linear": "m/s", "angular": "rad/s", "std": "m", "std_angle": "rad"}
    for key, value in extras.items():
        if isinstance(value, float):
            unit = "deg" if key.endswith("_deg") else units.get(key) or units.get(key.partition("_")[0], "")
            yield NumberLine(key.removesuffix("_deg"), [("", value)], unit)
        elif sigmas := _sigmas(key, value):
            whole = " ".join(sigmas)
            yield NumberLine("sigma", [], whole if len(whole) <= WIDEST_SIGMAS else " ".join(sigmas[:3]))
            if len(whole) > WIDEST_SIGMAS:
                yield NumberLine("", [], " ".join(sigmas[3:]))
        elif key not in TIMES and value is not None:
            yield NumberLine(key, [], _said(value))


def _sigmas(key: str, value: Any) -> list[str]:
    """Write the roots of the diagonal of a covariance, two digits each; nothing of any other value."""
    if key != "covariance" or not isinstance(value, list) or len(value) not in (36, 9):
        return []
    try:
        variances = [float(entry) for entry in value[:: round(len(value) ** 0.5) + 1]]
    except (TypeError, ValueError):
        return []
    if variances[0] == -1.0:
        return ["unknown"]  # as ROS has it
    roots = [math.sqrt(max(each, 0.0)) for each in variances]
    return [*map(_length, roots[:3]), *map(_angle, roots[3:])]


def largest_sigmas(entries: Sequence[float]) -> str:
    """Return how uncertain a pose is along its worst axis, and about its worst: `±10 mm 1.0 deg`."""
    roots = [math.sqrt(max(entry, 0.0)) for entry in entries[::7]]
    return f"±{_length(max(roots[:3]))} {_angle(max(roots[3:]))}"


def _length(metres: float) -> str:
    return _two_digits(metres * 1000.0, "mm") if metres < 1.0 else _two_digits(metres, "m")


def _angle(radians: float) -> str:
    return _two_digits(math.degrees(radians), "deg")


def _two_digits(value: float, unit: str) -> str:
    """Write a sigma with its unit: `2.1 mm`, `12 m`; what is tiny with an exponent."""
    value = value if value > ROUNDED_TO_ZERO else 0.0
    if value and not 0.001 <= value < ENDLESS:
        return f"{value:.1e} {unit}"
    decimals = max(1 - math.floor(math.log10(value)), 0) if value else 0
    return f"{value:.{decimals}f} {unit}"


def _said(value: Any) -> str:
    """Write what accompanies numbers."""
    return printable(dump(value) if isinstance(value, (dict, list)) else "" if value is None else str(value))


def _layout(lines: Sequence[NumberLine], style: Style) -> str:
    """Align names and numbers in columns; where that is too wide each part, or each number, has a line."""
    label = max(len(line.label) for line in lines)
    width = get_terminal_size((WIDTH, 0)).columns
    parts: list[list[NumberLine]] = []
    for line in lines:
        if line.label or not parts:
            parts.append([])
        parts[-1].append(line)
    texts = _columns(lines, label, style)
    if max(map(len, texts)) <= width:
        return "".join(texts)
    found = []
    for part in parts:
        texts = _columns(part, label, style)
        found += texts if max(map(len, texts)) <= width else _columns(_stacked(part), label, style)
    return "".join(found)


def _columns(lines: Sequence[NumberLine], label: int, style: Style) -> list[str]:
    """Write lines with their names and numbers in columns."""
    numbers = _aligned([[_number(value, style) for _, value in line.cells] for line in lines])
    columns = zip_longest(*(line.cells for line in lines), fillvalue=("", 0.0))
    names = [max(len(name) for name, _ in column) for column in columns]
    texts = []
    for line, texts_of in zip(lines, numbers, strict=True):
        named = [
            f"{name:>{width}} {text}" if width else text
            for (name, _), text, width in zip(line.cells, texts_of, names, strict=False)
        ]
        parts = f"  {line.label:<{label}}", " ".join(named), line.unit
        texts.append("  ".join(parts).rstrip().replace("  ]", " ]") + "\n")
    return texts


def _stacked(lines: Sequence[NumberLine]) -> list[NumberLine]:
    """Put each number on a line of its own; a line without any has a word to say."""
    return [
        NumberLine(line.label * (not at), cells, line.unit)
        for line in lines
        for at, cells in enumerate([[cell] for cell in line.cells] or [[]])
    ]


def _number(value: float, style: Style) -> str:
    """Write a number for a person: some decimals in an overview, all digits of what was asked for, no minus zero."""
    text = style.number(value + 0.0)
    if style.precision is None and not style.full and len(style.notations) != 1:
        text = f"{value:.{DECIMALS}f}" if abs(value) < ENDLESS else f"{value:.{DECIMALS}e}"
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


ECHO_DECIMALS = 3
ECHOED = (("quaternion", "Quaternion"), ("rpy_rad", "RPY (radian)"), ("rpy_deg", "RPY (degree)"))


def write_blocks(results: Iterable[Result], target: str, source: str, style: Style) -> Iterator[str]:
    """Yield the blocks as they come; the first begins by saying in words which frame is seen from which."""
    heading = in_width(f"{source} seen from {target}", f"(maps points in {source} to points in {target})")
    for result in results:
        yield heading + _block(result, style)
        heading = ""


def _block(result: Result, style: Style) -> str:
    """Return one block; a static path has no time."""
    decimals = ECHO_DECIMALS if style.precision is None else style.precision
    stamp_ns, components = result.extras.get("stamp_ns"), result.pose.components

    def fixed(values: Sequence[float]) -> list[str]:
        return [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values]  # no minus before a zero

    lines = ["At any time: the frames stand still" if stamp_ns is None else f"At time {format_stamp(stamp_ns)}"]
    lines.append(f"- Translation: [{', '.join(fixed(components[:3]))}]")
    for spec, name in ECHOED:
        numbers = fixed(rotation_numbers(result.pose, notation(spec), style))
        lines.append(f"- Rotation: in {name} [{', '.join(numbers)}]")
    lines.append("- Matrix:")
    cells = [f" {cell:>{decimals + 3}}" for cell in fixed(rigid.to_homogeneous(*components, floats))]
    lines += ["".join(cells[at : at + 4]) for at in range(0, 16, 4)]
    return "\n".join(lines) + "\n"


WIDEST = 80  # cells of a line, if names and depth leave that much
DEEPEST = 1000  # levels; the lines of a drawing grow with its depth


class DrawnFrame(NamedTuple):
    """One frame of the drawing: the lines before its name, and its pose in its parent."""

    branch: str
    frame: str
    label: tuple[str, ...]


def write_tree(tree: Frames, style: Style) -> str:
    """Draw a tree with plain lines: each frame below its parent, its pose behind it."""
    return "".join(
        f"{line.branch}{line.frame}{pad}{'  '.join(line.label)}".rstrip() + "\n" for line, pad in _padded(tree, style)
    )


def print_tree(tree: Frames, style: Style, color: str = "auto") -> None:
    """Draw a tree on the terminal, in colour where it has any, or as `color` says: always or never."""
    from rich.text import Text

    console = coloured_console(color)
    for line, pad in _padded(tree, style):
        name = "bold green" if not line.label else "bold"
        console.print(Text.assemble((line.branch, "dim"), (line.frame, name), pad, ("  ".join(line.label), "cyan")))


def coloured_console(color: str = "auto", *, stderr: bool = False) -> Console:
    """Return an output, in colour where the terminal has any, or as `color` says: always or never.

    Where there is no colour, also by NO_COLOR, nothing is bold or dim either.
    """
    import os

    from rich.console import Console

    plain = color == "never" or (color == "auto" and bool(os.environ.get("NO_COLOR")))
    return Console(
        file=sys.stderr if stderr else sys.stdout, highlight=False, soft_wrap=True, no_color=plain,
        force_terminal=True if color == "always" else None,
        color_system=None if plain else "auto" if color == "auto" else "standard",
    )  # fmt: skip


def _label(track: Track, style: Style, covariance: Components | None) -> tuple[str, ...]:
    """Return the pose of an edge, how uncertain it is, and how it moves: its newest pose then."""
    label: tuple[str, ...] = edge_label(Transform.of(*track.components), style, track.parent)
    if covariance is not None:
        label = *label, largest_sigmas(covariance)
    if track.is_static:
        return label
    from frametool.frames.edge_log import motion

    return *label, motion(track)


def _padded(tree: Frames, style: Style) -> Iterator[tuple[DrawnFrame, str]]:
    """Yield the lines with the blanks that bring their poses below one another.

    Where that makes them too long levels are closer, sigmas are left out; where that is not enough either poses follow
    their names.
    """
    lines = list(_lines(tree, style))
    turns = max((len(line.label[1]) for line in lines if _is_uncertain(line)), default=0)
    wide = [_in_column(line, turns) if _is_uncertain(line) else line for line in lines]
    narrow = [line._replace(branch=re.sub("(.)..(.)", r"\1\2", line.branch)) for line in wide]  # 2 cells, not 4
    plain = [
        line._replace(label=(*each.label[:2], *each.label[2 + _is_uncertain(each) :]))
        for line, each in zip(narrow, lines, strict=True)
    ]
    for lines in (wide, narrow, plain):
        labels, names = [line.label for line in lines if line.label], _widest(lines)
        positions = max((len(label[0]) for label in labels), default=0)
        poses = 2 + positions + max((sum(2 + cells(part) for part in label[1:]) for label in labels), default=0)
        if names + poses <= WIDEST:
            break
    else:
        yield from ((part, "  " * bool(part.label)) for line in lines for part in _folded(line))
        return
    for line in lines:
        label = (f"{line.label[0]:<{positions}}", *line.label[1:]) if line.label else ()
        yield line._replace(label=label), " " * bool(label) * (names - len(line.branch) - cells(line.frame) + 2)


def _is_uncertain(line: DrawnFrame) -> bool:
    return len(line.label) > 2 and line.label[2].startswith("±")


def _in_column(line: DrawnFrame, width: int) -> DrawnFrame:
    position, rotation, *others = line.label
    return line._replace(label=(position, f"{rotation:<{width}}", *others))


def _folded(line: DrawnFrame) -> Iterator[DrawnFrame]:
    """Yield a line, what comes behind its pose on one of its own where they are too long for one."""
    begin = len(line.branch) + cells(line.frame)
    if not line.label or begin + sum(2 + cells(part) for part in line.label) <= WIDEST:
        yield line
        return
    first = 2 if begin + sum(2 + cells(part) for part in line.label[:2]) <= WIDEST else 0
    yield line._replace(label=line.label[:first])
    below = re.sub("[└─]", " ", line.branch).replace("├", "│")
    rest = line.label[first:]
    fits = len(below) + sum(2 + cells(part) for part in rest) <= WIDEST
    yield from (DrawnFrame(below, "", part) for part in ([rest] if fits else [rest[:2], rest[2:]]) if part)


def _widest(lines: Sequence[DrawnFrame]) -> int:
    """Return how many cells the widest name takes, with the lines before it."""
    return max((len(line.branch) + cells(line.frame) for line in lines), default=0)


def _lines(tree: Frames, style: Style) -> Iterator[DrawnFrame]:
    """Walk the tree from its roots, children in the order they were added; a stack, so that no tree is too deep."""
    children: dict[str, list[tuple[str, tuple[str, ...]]]] = {}
    for track in tree.tracks():
        drawn = tree.drawn.get(track.child)
        label = (drawn,) if drawn is not None else _label(track, style, tree.covariances.get(track.child))
        children.setdefault(track.parent, []).append((track.child, label))
    pending: list[tuple[str, tuple[str, ...], str, str]] = [(root, (), "", "") for root in reversed(tree.roots)]
    while pending:
        frame, label, branch, below = pending.pop()
        if len(branch) > 4 * DEEPEST:
            raise ValueInvalid(f"the tree is more than {DEEPEST} frames deep, too deep to draw; use --format json")
        yield DrawnFrame(branch, printable(frame), label)
        inner = children.get(frame, ())
        for at in range(len(inner) - 1, -1, -1):
            last = at == len(inner) - 1
            pending.append((*inner[at], below + ("└── " if last else "├── "), below + ("    " if last else "│   ")))
