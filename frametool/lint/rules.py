"""What `check` finds in files, and its rules about edges together: the shape of the tree, what happens over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import shown
from frametool.formats.recordings import refuse_unknown_joints
from frametool.frames.edge_log import EdgeLog
from frametool.frames.path import cycle_message
from frametool.frames.stamps import BILLION, format_stamp
from frametool.lint.findings import Finding
from frametool.lint.reading import read_all

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.formats.recordings import Recording
    from frametool.frames.edge_log import SampleStep
    from frametool.lint.reading import Statement

FLICKER = 3  # so many changes of parent are no picking up and putting down


def check(files: Sequence[Recording], *, normalize: bool = False) -> list[Finding]:
    """Return all that is wrong or odd in files, taken together as one tree, in the order of the files and lines."""
    findings: list[Finding] = []
    findings += lint(_statements(files, findings, normalize=normalize))
    order = {file.name: index for index, file in enumerate(files)}
    return sorted(findings, key=lambda each: (order.get(each.source, 0), each.line, each.column))


def _statements(files: Sequence[Recording], findings: list[Finding], *, normalize: bool) -> Iterator[Statement]:
    """Read all files; what cannot be read is found at once."""
    for file in files:
        before = len(findings)
        statement = None
        for statement in read_all(file, findings.append, normalize=normalize):
            yield statement
        if statement is None and len(findings) == before:
            findings.append(Finding("empty", "no transforms in it", file.name, 1, 1))
    refuse_unknown_joints(files)


class Child:
    """Everything that was seen of one child frame."""

    def __init__(self, first: Statement, number: int) -> None:
        """Start from the first edge or sample; `number` counts all that were read."""
        self.first = first
        self.newest = first
        self.since = (number, first)  # where the newest parent took over
        self.log = EdgeLog(first.child)
        self.stands: Statement | None = None
        self.changes: list[Statement] = []
        self.stamps: dict[int, tuple[int, int]] = {}  # stamp -> hash of the sample, its line
        self.other_parent: Statement | None = None
        self.other_pose: Statement | None = None
        self.again: list[Statement] = []
        self.clashes: list[Statement] = []
        self.backward: list[Statement] = []

    def add(self, seen: Statement, number: int) -> None:
        """Take in one more."""
        if seen.stamp_ns is None:
            self._stand(seen)
        else:
            self._move(seen, seen.stamp_ns)
        if seen.parent != self.newest.parent:
            self.changes.append(seen)
            self.since = (number, seen)
            self.other_parent = self.other_parent or seen
        elif seen.components != self.newest.components:
            self.other_pose = self.other_pose or seen
        self.newest = seen
        self.log.add(seen.parent, seen.components, seen.stamp_ns, seen.line)

    def _stand(self, seen: Statement) -> None:
        self.stands = self.stands or seen

    def _move(self, seen: Statement, stamp_ns: int) -> None:
        data = hash((seen.parent, seen.components))
        fresh = (data, seen.line)
        known = self.stamps.setdefault(stamp_ns, fresh)
        if known is not fresh:
            (self.again if known[0] == data else self.clashes).append(seen)
        if self.log.is_late(stamp_ns):
            self.backward.append(seen)

    @property
    def moves(self) -> bool:
        """Return whether there are two different stamps."""
        return len(self.stamps) > 1


def lint(everything: Iterable[Statement]) -> Iterator[Finding]:
    """Apply the rules to all edges of all files together."""
    children: dict[str, Child] = {}
    for number, seen in enumerate(everything):
        if seen.parent == seen.child:
            yield seen.finding("self", f"frame {shown(seen.child)} is its own parent")
            continue
        child = children.get(seen.child)
        if child is None:
            child = children[seen.child] = Child(seen, number)
        if seen.looks_w_first and (child.first is seen or not child.first.looks_w_first):
            message = f"frame {shown(seen.child)} is turned by exactly 180 degrees about x; did you mean w first?"
            yield seen.finding("w-first", message)
        child.add(seen, number)
    for child in children.values():
        yield from _child(child)
    yield from _cycles(children)
    yield from _roots(children)


def _child(child: Child) -> Iterator[Finding]:
    """Apply the rules about one frame."""
    name = child.first.child
    if child.stands is not None and child.moves:
        moving = next(each for each in (child.first, child.newest) if each.stamp_ns is not None)
        yield moving.finding("static-and-moving", f"frame {shown(name)} moves, but stands still in {_at(child.stands)}")
    elif not child.moves:
        yield from _standing(child, name)
    else:
        yield from _moving(child, name)


def _standing(child: Child, name: str) -> Iterator[Finding]:
    """Apply the rules about a frame that has one pose."""
    first = child.first
    if other := child.other_parent:
        parents = f"{shown(first.parent)} ({_at(first)}) and {shown(other.parent)} ({_at(other)})"
        yield other.finding("two-parents", f"frame {shown(name)} has two parents: {parents}")
    elif other := child.other_pose:
        message = f"frame {shown(name)} has two different poses in {shown(first.parent)}: {_at(first)} and {_at(other)}"
        yield other.finding("two-poses", message)


def _moving(child: Child, name: str) -> Iterator[Finding]:
    """Apply the rules about a frame over time."""
    if child.changes:
        yield _reparented(child, name)
    if child.again:
        yield child.again[0].finding("repeated", f"frame {shown(name)}: the same sample again{_more(child.again)}")
    if child.clashes:
        first = child.clashes[0]
        stamp = format_stamp(first.stamp_ns or 0)
        line = child.stamps[first.stamp_ns or 0][1]
        places = f"lines {line} and {first.line}"
        message = f"frame {shown(name)} has two poses at {stamp}: {places}{_more(child.clashes)}"
        yield first.finding("repeated-stamp", message)
    if child.backward:
        first = child.backward[0]
        message = f"frame {shown(name)}: {format_stamp(first.stamp_ns or 0)} comes after a later stamp"
        yield first.finding("backward", message + _more(child.backward))
    yield from _steps(child, name)


def _reparented(child: Child, name: str) -> Finding:
    """Report a changing parent: of a frame that was picked up, or of publishers that disagree."""
    parents = " -> ".join(shown(each.parent) for each in (child.first, *child.changes[:3]))
    if len(child.changes) < FLICKER:
        return child.changes[0].finding("reparented", f"frame {shown(name)} changes its parent: {parents}")
    times = f"{len(child.changes)} times: {parents} .."
    message = f"frame {shown(name)} changes its parent {times}; two publishers disagree"
    return child.changes[0].finding("flicker", message)


def _steps(child: Child, name: str) -> Iterator[Finding]:
    """Apply the rules about pauses and distances between samples."""
    edge = f"{child.newest.parent} -> {name}"
    if gaps := child.log.gaps():
        pause = gaps[0].pause_ns / BILLION
        message = f"{edge}: no data for {pause:g} s before {format_stamp(gaps[0].stamp_ns)}"
        yield _at_step(child, gaps[0]).finding("gap", message + _more(gaps))
    if returns := child.log.returns():
        step = returns[0]
        apart = f"{step.metres:.3g} m and {step.radians:.3g} rad"
        message = f"{edge}: goes back and forth by {apart} at {format_stamp(step.stamp_ns)}; two publishers disagree"
        yield _at_step(child, step).finding("disagreement", message + _more(returns))
    if jumps := child.log.jumps():
        step = jumps[0]
        message = f"{edge}: jumps by {step.metres:.3g} m and {step.radians:.3g} rad at {format_stamp(step.stamp_ns)}"
        yield _at_step(child, step).finding("jump", message + _more(jumps))


def _at_step(child: Child, step: SampleStep) -> Statement:
    return child.first._replace(line=step.line, column=1 if step.line else 0)


def _cycles(children: dict[str, Child]) -> Iterator[Finding]:
    """Find the cycles among the newest parents; each is told once."""
    done: set[str] = set()
    for start in children:
        line: list[str] = []
        frame = start
        while frame in children and frame not in done:
            done.add(frame)
            line.append(frame)
            frame = children[frame].newest.parent
        if frame in line:
            circle = line[line.index(frame) :]
            _, last = max(children[each].since for each in circle)
            at = circle.index(last.parent)
            yield last.finding("cycle", cycle_message([*circle[at:], *circle[:at], last.parent]))


def _roots(children: dict[str, Child]) -> Iterator[Finding]:
    """Report more than one root, at the first edge of the second."""
    roots = {
        child.newest.parent: child.first
        for child in reversed(children.values())
        if child.newest.parent not in children
    }
    if len(roots) > 1:
        names = sorted(roots)
        seen = roots[names[1]]
        shown = ", ".join(map(repr, names[:10]))
        yield seen.finding("several-roots", f"{len(roots)} roots: {shown}{' ..' if len(names) > 10 else ''}")


def _at(seen: Statement) -> str:
    return f"{seen.source}:{seen.line}" if seen.line else seen.source


def _more(found: Sequence[object]) -> str:
    return f" (and {len(found) - 1} more of these)" if len(found) > 1 else ""
