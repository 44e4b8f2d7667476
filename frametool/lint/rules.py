"""The rules of `check`: mistakes in single entries, which do not hide others, then the tree and its motion.

Findings are written as compilers do:
    robot.yaml:9:17: error: quaternion 0 0 0 0.9 has norm 0.9; .. [denormalized]
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import locate_many, parse_documents
from frametool.documents.writers import dump_json
from frametool.errors import BadTopology, Finding, FormatError, Unanswered, first_of, shown
from frametool.formats.detect import by_sign
from frametool.formats.load import FrameFile, refuse_unknown_joints
from frametool.formats.trees.tree_reader import edges_of, located, read_edges
from frametool.frames import topology
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry.representations import EARTH_FRAMES
from frametool.grammar.readers import may_be_on_earth
from frametool.lint.monitor import EdgeLog

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.documents.source import Source
    from frametool.frames.lookups import FrameTree
    from frametool.geometry import Rigid
    from frametool.grammar.edges import Edge
    from frametool.grammar.readers import Misfit

    Find = Callable[[Finding], None]

# rule -> (level, description); an error fails, a warning fails under --strict, a note never
RULES = {
    "syntax": ("error", "text that cannot be read, or lacks a part"),
    "empty": ("warning", "a file without any transform"),
    "no-frames": ("warning", "a file of something else, among those of --each"),
    "denormalized": ("error", "a quaternion or matrix that is not a rotation"),
    "rounded": ("warning", "a rotation off by 1e-6 to 1e-3: normalised"),
    "mirrored": ("error", "a left-handed matrix"),
    "not-finite": ("error", "NaN or infinity"),
    "degrees": ("warning", "bare angles beyond a full turn: degrees?"),
    "w-first": ("warning", "x = 1 of x, y, z, w: the identity with w first?"),
    "identity": ("warning", "an entry with neither position nor rotation"),
    "slash": ("warning", "a frame name that begins with /"),
    "no-alt": ("note", "a place on the Earth without its height"),
    "band-s": ("warning", "a zone of UTM with S, which is south"),
    "noise": ("note", "lines that a tool printed between messages"),
    "topics": ("note", "the topics that transforms came by"),
    "two-topics": ("error", "a frame that comes by the topics of two robots"),
    "limit": ("warning", "the value of a joint beyond its limits"),
    "odd": ("warning", "anything else suspicious while reading"),
    "self": ("error", "a frame that is its own parent"),
    "cycle": ("error", "frames that form a cycle"),
    "two-parents": ("error", "a static frame with two parents"),
    "two-poses": ("error", "a static frame with two poses in its parent"),
    "static-and-moving": ("error", "a frame that is static in one place and moves in another"),
    "several-roots": ("note", "frames that hang in more than one tree"),
    "repeated": ("note", "the same sample twice"),
    "repeated-stamp": ("warning", "two different samples of a frame at one stamp"),
    "backward": ("warning", "samples of a frame that come after later ones"),
    "gap": ("warning", "a pause more than 5 times the usual one"),
    "jump": ("warning", "a step 10 times the usual one, and 0.1 m or 0.2 rad"),
    "disagreement": ("error", "a frame that jumps to and fro: two publishers?"),
    "reparented": ("note", "a frame whose parent changes once or twice"),
    "loop": ("warning", "a measurement (--measured) that the tree does not agree with"),
    "flicker": ("error", "a parent that goes to and fro: two publishers?"),
}


MOST_LINES = 5  # lines that are listed of the further places of a finding


def level(finding: Finding) -> str:
    """Return error, warning or note."""
    return RULES[finding.rule][0]


def write_text(findings: Iterable[Finding]) -> str:
    """Return one line per finding, as compilers do; equal findings in a file are combined."""
    alike: dict[tuple[str, str, str], list[Finding]] = {}
    for each in findings:
        alike.setdefault((each.source, each.rule, each.message), []).append(each)
    text = ""
    for each, *more in alike.values():
        place = ":".join(str(part) for part in (each.source, each.line, each.column) if part)
        lines = list(dict.fromkeys(other.line for other in more if other.line))
        named = ", ".join(map(str, lines[:MOST_LINES])) + ", .." * (len(lines) > MOST_LINES)
        where = f": line{'s' * (len(lines) > 1)} {named}" * bool(lines)
        further = f" (and {len(more)} more{where})" if more else ""
        text += f"{place}: {level(each)}: {each.message} [{each.rule}]{further}\n"
    return text


def write_json(findings: Iterable[Finding]) -> str:
    """Return one object per line."""
    text = ""
    for each in findings:
        place = {"file": each.source, "line": each.line or None, "column": each.column or None}
        text += f"{dump_json(place | {'level': level(each), 'rule': each.rule, 'message': each.message})}\n"
    return text


def write_github(findings: Iterable[Finding]) -> str:
    """Return workflow commands, which GitHub shows at the lines of a pull request."""
    text = ""
    for each in findings:
        kind, place = level(each).replace("note", "notice"), {"line": each.line, "col": each.column}
        text += github_command(kind, each.message, file=each.source, **place, title=each.rule)
    return text


def github_command(kind: str, message: str, **place: str | int) -> str:
    """Return one workflow command: `error`, `warning` or `notice`; unknown parts of the place are omitted."""
    properties = ",".join(f"{key}={_escaped(str(value), ',:')}" for key, value in place.items() if value)
    return f"::{kind} {properties}::{_escaped(message)}\n"


def _escaped(text: str, more: str = "") -> str:
    """Escape characters that would end a workflow command or one of its properties."""
    for character in "%\r\n" + more:
        text = text.replace(character, f"%{ord(character):02X}")
    return text


WRITERS = {"text": write_text, "json": write_json, "github": write_github}


WRITTEN_XYZW = frozenset(("quaternion", "xyzw", "rotation", "orientation", "transform"))


class Statement(NamedTuple):
    """An edge, or one sample of it, and its place.

    looks_w_first: True if it was written x, y, z, w with x = 1
    """

    parent: str
    child: str
    components: Rigid
    stamp_ns: int | None
    source: str
    line: int
    column: int
    looks_w_first: bool

    def finding(self, rule: str, message: str) -> Finding:
        """Return a finding for this place."""
        return Finding(rule, message, self.source, self.line, self.column)

    def broken(self, error: BadTopology, places: str = "") -> Finding:
        """Return the finding for an edge that breaks a rule of trees."""
        return self.finding(error.rule, error.message + places)


# formats whose quaternions are x, y, z, w; tables have them if a column says w
W_LAST = ("calls", "launch", "tum", "g2o", "echo", "jsonl", "csv1", "csv2", "bag1", "bag2", "mcap")


def _read(file: FrameFile, find: Find, *, normalize: bool) -> Iterator[Statement]:
    """Yield the edges of a file, and report errors; places in documents are searched once."""

    def report(error: FormatError) -> None:
        find(error.finding)

    in_documents: list[tuple[Edge, bool]] = []
    header = file.head().split(b"\n")[0].replace(b"yaw", b"")
    is_w_last = file.format in W_LAST or (file.format in ("csv", "tsv", "semicolon") and b"w" in header)
    try:
        if not file.holds_samples:
            in_documents = _read_tree(file.source, find, normalize=normalize)
        for edge in file.edges(report, tell=False, normalize=normalize) if file.holds_samples else ():
            if edge.path:  # formats with matrices or angles, and with quaternions by name or always w first
                in_documents.append((edge, False))
            elif edge.parent is not None:
                column, w_first = 1 if edge.line else 0, is_w_last and looks_w_first(edge.components)
                yield Statement(edge.parent, *edge[1:4], file.name, edge.line, column, w_first)
    except Unanswered:
        raise
    except FormatError as error:  # nothing after it can be read
        report(error)
    places = locate_many(file.text, [edge.path for edge, _ in in_documents]) if in_documents else []
    for (edge, w_first), place in zip(in_documents, places, strict=True):
        if edge.parent is not None:
            yield Statement(edge.parent, *edge[1:4], file.name, *place, w_first)
    if counts := file.topics.counts:
        listed = ", ".join(f"{topic} ({count})" for topic, count in counts.items())
        find(Finding("topics", f"transforms on {listed}", file.name, 1, 1))
    for note in file.tally.findings():
        find(note._replace(source=file.name, column=1))


def looks_w_first(components: Rigid) -> bool:
    """Return True if a rotation may be the identity written with w first and read with w last."""
    return bool(abs(components[3]) == 1.0 and not any(components[4:]))


def _read_tree(source: Source, find: Find, *, normalize: bool) -> list[tuple[Edge, bool]]:
    """Return the edges of a tree, each with True if it was written as a quaternion x, y, z, w with x = 1."""
    documents = parse_documents(source.text, source.name)
    values = {each.index: each.value for each in documents}
    notes: list[Finding] = []
    faults: list[Misfit] = []
    edges = []
    for edge in edges_of(documents, read_edges, notes, faults, normalize=normalize):
        value: Any = values
        for step in edge.path:
            value = value[step]
        written = value if type(value) is dict and not any(map(may_be_on_earth, value)) else {}
        edges.append((edge, not WRITTEN_XYZW.isdisjoint(written) and looks_w_first(edge.components)))
    for fault, line, column in located(faults, source):
        find(Finding(fault.rule or "syntax", str(fault), source.name, line, column))
    for note, (line, column) in zip(notes, locate_many(source.text, [note.path for note in notes]), strict=True):
        find(note._replace(source=source.name, line=line, column=column))
    return edges


FLICKER = 3  # changes of parent that pick-and-place does not explain


def check(
    files: Sequence[FrameFile], *, normalize: bool = False, tree: FrameTree | None = None, others: bool = False
) -> list[Finding]:
    """Return all findings in files, combined into one tree, in the order of the files and lines.

    tree: receives the static edges
    others: allow files of unknown formats; such a file without frames gets only the finding no-frames
    """
    findings: list[Finding] = []
    findings += lint(_statements(files, findings, normalize=normalize, others=others), tree)
    order = {file.name: index for index, file in enumerate(files)}
    return sorted(findings, key=lambda each: (order.get(each.source, 0), each.line, each.column))


def _statements(
    files: Sequence[FrameFile], findings: list[Finding], *, normalize: bool, others: bool
) -> Iterator[Statement]:
    """Read all files; unreadable parts become findings.

    The Earth's frame gets the first of its names; the identity between the two is not an edge.
    """
    earth = ""
    for file in files:
        before = len(findings)
        may_be_other = others and by_sign(file.head(), "tree") is None
        each = None
        for each in _read(file, findings.append, normalize=normalize):
            earth = earth or next((name for name in each[:2] if name in EARTH_FRAMES), "")
            parent, child = (earth if name in EARTH_FRAMES else name for name in each[:2])
            if parent != child or each.parent == each.child or any(each.components[:6]):
                yield each if (parent, child) == each[:2] else each._replace(parent=parent, child=child)
        if each is None and may_be_other:
            findings[before:] = [Finding("no-frames", "no frames in it", file.name, 1, 1)]
        elif each is None and len(findings) == before:
            findings.append(Finding("empty", "no transforms in it", file.name, 1, 1))
    refuse_unknown_joints(files)


class Child(EdgeLog):
    """All data of one child frame, and the samples that violate a rule.

    newest: the last sample
    irregular: rule -> samples with another parent than the previous one, at a known stamp, or after a later stamp
    """

    def __init__(self, first: Statement, number: int) -> None:
        """Create the log of a frame before its first sample; number: that of the sample among all that were read."""
        super().__init__(first)
        self.first = self.newest = first
        self.irregular: dict[str, list[Statement]] = {}
        self.since = (number, first)  # the first sample with the newest parent
        self.static: Statement | None = None
        self.stamps: dict[int, tuple[int, int]] = {}  # stamp -> hash of the sample, its line
        self.other_pose: Statement | None = None

    def take(self, seen: Statement, number: int) -> None:
        """Add a sample."""
        if seen.stamp_ns is None:
            self.static = self.static or seen
        else:
            fresh = (hash((seen.parent, seen.components)), seen.line)
            known = self.stamps.setdefault(seen.stamp_ns, fresh)
            if known is not fresh:
                self.irregular.setdefault("repeated" if known[0] == fresh[0] else "repeated-stamp", []).append(seen)
            if self.last_ns is not None and seen.stamp_ns < self.last_ns:
                self.irregular.setdefault("backward", []).append(seen)
        if seen.parent != self.newest.parent:
            self.since = (number, seen)
            self.irregular.setdefault("reparented", []).append(seen)
        elif seen.components != self.newest.components:
            self.other_pose = self.other_pose or seen
        self.newest = seen
        self.add(seen)


def lint(everything: Iterable[Statement], tree: FrameTree | None = None) -> Iterator[Finding]:
    """Apply the rules to all edges of all files together; tree: receives the static edges that fit into one."""
    children: dict[str, Child] = {}
    for number, seen in enumerate(everything):
        if seen.parent == seen.child:
            yield seen.broken(topology.own_parent(seen.child))
            continue
        child = children.get(seen.child)
        if child is None:
            child = children[seen.child] = Child(seen, number)
        if seen.looks_w_first and (child.first is seen or not child.first.looks_w_first):
            message = f"frame {shown(seen.child)} is turned by exactly 180 degrees about x; did you mean w first?"
            yield seen.finding("w-first", message)
        child.take(seen, number)
    for child in children.values():
        stamps = len(child.stamps) + (child.static is not None)
        if tree is not None and (stamps < 2 or not (child.changes or child.other_pose)):  # with a single pose
            with suppress(BadTopology):  # which a rule reports
                tree.add_components(*child.first[:3])
        yield from _child(child)
    yield from _cycles(children)
    roots = {
        child.newest.parent: child.first for child in reversed(children.values()) if child.newest.parent not in children
    }
    if len(roots) > 1:  # reported at the first edge of the second
        names = sorted(roots)
        yield roots[names[1]].finding("several-roots", f"{len(roots)} roots: {first_of(names, 10, quote=repr)}")


def _child(child: Child) -> Iterator[Finding]:
    """Apply the rules about one frame."""
    first, frame = child.first, f"frame {shown(child.first.child)}"
    moves = len(child.stamps) > 1
    if child.static is not None and moves:
        moving = next(each for each in (first, child.newest) if each.stamp_ns is not None)
        details = f" moves, but is static in {_at(child.static)}"
        yield moving.broken(topology.static_and_moving(first.child, details))
    elif moves:
        yield from _moving(child, frame)
    elif changes := child.irregular.get("reparented"):
        second = changes[0]
        yield second.broken(topology.two_parents(first.child, first.parent, second.parent, (_at(first), _at(second))))
    elif other := child.other_pose:
        yield other.broken(topology.two_poses(first.child, first.parent), f": {_at(first)} and {_at(other)}")


def _moving(child: Child, frame: str) -> Iterator[Finding]:
    """Apply the rules about a moving frame: changes of parent, by pick-and-place or two publishers, and stamps.

    Then the rules about pauses and distances between samples.
    """
    for rule in filter(child.irregular.get, ("reparented", "repeated", "repeated-stamp", "backward")):
        samples = child.irregular[rule]
        seen, stamp_ns = samples[0], samples[0].stamp_ns or 0
        stamp, parents = format_stamp(stamp_ns), " -> ".join(shown(each.parent) for each in (child.first, *samples[:3]))
        if rule == "reparented" and len(samples) >= FLICKER:
            times = f"{len(samples)} times: {parents} .."
            yield seen.finding("flicker", f"{frame} changes its parent {times}; two publishers disagree")
            continue
        problem = {
            "reparented": f" changes its parent: {parents}",
            "repeated": f": the same sample again{_more(samples)}",
            "repeated-stamp": f" has two poses at {stamp}: "
            f"lines {child.stamps.get(stamp_ns, (0, 0))[1]} and {seen.line}{_more(samples)}",
            "backward": f": {stamp} comes after a later stamp{_more(samples)}",
        }[rule]
        yield seen.finding(rule, frame + problem)
    for rule, steps in (("gap", child.gaps()), ("disagreement", child.returns()), ("jump", child.jumps())):
        if steps:
            step = steps[0]
            stamp, apart = format_stamp(step.stamp_ns), f"{step.metres:.3g} m and {step.radians:.3g} rad"
            problem = {
                "gap": f"no data for {step.pause_ns / BILLION:g} s before {stamp}",
                "disagreement": f"goes back and forth by {apart} at {stamp}; two publishers disagree",
                "jump": f"jumps by {apart} at {stamp}",
            }[rule]
            message = f"{child.newest.parent} -> {child.first.child}: {problem}{_more(steps)}"
            yield child.first._replace(line=step.line, column=1 if step.line else 0).finding(rule, message)


def _cycles(children: dict[str, Child]) -> Iterator[Finding]:
    """Find the cycles among the newest parents; each is reported once."""
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
            yield last.broken(topology.cycle([*circle[at:], *circle[:at], last.parent]))


def _at(seen: Statement) -> str:
    return f"{seen.source}:{seen.line}" if seen.line else seen.source


def _more(found: Sequence[object]) -> str:
    return f" (and {len(found) - 1} more of these)" if len(found) > 1 else ""
