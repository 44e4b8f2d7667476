"""A tree of frames as a drawing of lines, on a terminal in colour, through rich; and how far a long stream is."""

from __future__ import annotations

import re
import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid, cells, printable
from frametool.geometry.transform import Transform
from frametool.grammar.result import edge_label

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Self

    from rich.console import Console

    from frametool.frames.lookups import Frames
    from frametool.frames.track import Track
    from frametool.geometry.types import Components
    from frametool.grammar.result import Style


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
    import sys

    from rich.console import Console

    plain = color == "never" or (color == "auto" and bool(os.environ.get("NO_COLOR")))
    return Console(
        file=sys.stderr if stderr else sys.stdout, highlight=False, soft_wrap=True, no_color=plain,
        force_terminal=True if color == "always" else None,
        color_system=None if plain else "auto" if color == "auto" else "standard",
    )  # fmt: skip


def coloured(text: str, marks: Sequence[str]) -> str:
    """Return text as the terminal shows it: each named group of some patterns in the colour that is its name."""
    from rich.text import Text

    whole, console = Text(text), coloured_console()
    for pattern in marks:
        whole.highlight_regex(pattern)
    with console.capture() as shown:
        console.print(whole, end="")
    return shown.get()


def _label(track: Track, style: Style, covariance: Components | None) -> tuple[str, ...]:
    """Return the pose of an edge, how uncertain it is, and how it moves: its newest pose then."""
    label: tuple[str, ...] = edge_label(Transform.of(*track.components), style, track.parent)
    if covariance is not None:
        from frametool.view.pose_text import largest_sigmas

        label = *label, largest_sigmas(covariance)
    if track.is_static:
        return label
    from frametool.frames.edge_log import motion

    return *label, motion(track)


def _padded(tree: Frames, style: Style) -> Iterator[tuple[DrawnFrame, str]]:
    """Yield the lines with the blanks that bring their poses below one another.

    Where that makes them too long levels stand closer; where that is not enough either poses stand behind their names.
    """
    lines = list(_lines(tree, style))
    labels = [line.label for line in lines if line.label]
    positions = max((len(label[0]) for label in labels), default=0)
    poses = 2 + positions + max((sum(2 + cells(part) for part in label[1:]) for label in labels), default=0)
    names = _widest(lines)
    if names + poses > WIDEST:
        # each level takes two cells instead of four
        lines = [line._replace(branch=re.sub("(.)..(.)", r"\1\2", line.branch)) for line in lines]
        names = _widest(lines)
    if names + poses > WIDEST:
        yield from ((part, "  " * bool(part.label)) for line in lines for part in _folded(line))
        return
    for line in lines:
        label = (f"{line.label[0]:<{positions}}", *line.label[1:]) if line.label else ()
        yield line._replace(label=label), " " * bool(label) * (names - len(line.branch) - cells(line.frame) + 2)


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


PATIENCE = 2.0  # seconds before anything is shown


class ProgressBar:
    """Show how far a job is, if stderr is a terminal and the job takes longer than two seconds."""

    def __init__(self, total: int | None, *, quiet: bool, counted: str = "rows") -> None:
        """Start the clock; `total` is the number of bytes, if it is known; counted: what is done, "" if only that."""
        self.total, self._counted = total, counted
        self.rows = self.size = 0
        self._hidden = quiet or sys.stderr is None or not sys.stderr.isatty()
        self._start = time.monotonic()
        self._bar: Any = None

    def __enter__(self) -> Self:
        """Wait for the first block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Clear the line."""
        if self._bar is not None:
            with suppress(OSError):  # a terminal that has gone does not change what the data is worth
                self._bar.stop()

    def advance(self, rows: int, size: int) -> None:
        """Count what was done."""
        self.rows += rows
        self.size += size
        seconds = time.monotonic() - self._start
        if self._hidden or seconds < PATIENCE:
            return
        if self._bar is None:
            self._bar = _bar(self.total, self._counted)
            self._bar.start()
            self._task = self._bar.add_task("", total=self.total, rows="0", rate="")
        with suppress(OSError):
            self._bar.update(self._task, completed=self.size, rows=f"{self.rows:,}", rate=f"{self.rows / seconds:,.0f}")


def _bar(total: int | None, counted: str) -> Any:
    from rich import progress

    text = f"{{task.fields[rows]}} {counted}  {{task.fields[rate]}} {counted}/s" if counted else "solving"
    columns: list[Any] = [progress.TextColumn(text)]
    if total:
        columns += [progress.BarColumn(), progress.TaskProgressColumn(), progress.TimeRemainingColumn()]
    return progress.Progress(*columns, console=coloured_console(stderr=True), transient=True)
