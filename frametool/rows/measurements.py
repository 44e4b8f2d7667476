"""Measurements of frames relative to one another, and the files they are read from.

    measurements: [{parent: base, child: lidar, xyz: [1, 0, 2], rpy_deg: [0, 0, 90], sigma: {xyz: 0.01, rpy_deg: 1}}]
    parent,child,x,y,z,qx,qy,qz,qw,sigma_xyz,sigma_rpy_deg,id         one per row; pairs may repeat
    {"parent": "base", "child": "lidar", "xyz": [1, 0, 2]}            one per line

Any tree can be read, too: each of its edges is a measurement.  Poses are records or rows as everywhere.
"""

from __future__ import annotations

import re
from collections import Counter
from math import radians
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from frametool.documents.document import locate_many, parse_documents
from frametool.documents.source import Verbatim
from frametool.errors import FormatError, ValueInvalid, alternatives, did_you_mean, first_of, shown, warn
from frametool.fit.blunders import Measurement
from frametool.fit.measured_tree import solve_tree
from frametool.formats.load import EdgePlace, FrameFile, lines_of, listed, load
from frametool.formats.trees.tree_reader import MOST_KEYS, read_edges
from frametool.frames.lookups import FrameTree, taken
from frametool.geometry.transform import Transform
from frametool.grammar.covariance import AXES, is_sigma
from frametool.grammar.pose import COVARIANCE_KEYS, Pose, inverted, read_angle_unit
from frametool.grammar.readers import NAME_KEYS, STAMP_KEYS, Misfit, Path, Reading, kind, tell, within
from frametool.rows.faults import BadRows
from frametool.rows.holders import INNER, KNOWN, value_at
from frametool.rows.plain import stamp_of
from frametool.rows.record import Record, find_records, pose_of
from frametool.rows.request import COMBINED, Operation, Request, RowOptions
from frametool.rows.shapes import POSE, Shape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from typing import TypeAlias

    from frametool.fit.measured_tree import TreeSolution
    from frametool.text.lines import ByteStream

    Measured: TypeAlias = str | PathLike[str] | Iterable[tuple[str, str, Transform] | tuple[str, str, Transform, Any]]

LISTS = ("measurements", "frames")
CHILD = "child"
OURS = frozenset((*KNOWN, *NAME_KEYS, *STAMP_KEYS, *INNER, CHILD, "id", "children", "samples", "header"))
MISSPELT = ("parent", CHILD, *COVARIANCE_KEYS, "inverse", "angles")  # keys of measurements alone
LIKE = "a measurement is {parent: .., child: .., xyz: [..], rpy_deg: [..]}"
WRAPPED = rb'"(?:op|msg|message|topic|transforms?)"'  # JSON with messages, not rows
MOVED = Operation(left=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))  # the identity, so that covariances are read


class MeasuredRow(NamedTuple):
    """A measurement, its line, its stamp if it has one, and its column if known."""

    measurement: Measurement
    line: int
    stamp_ns: int | None = None
    column: int = 0


def read_measurements(
    files: Sequence[FrameFile], *, degrees: bool = False, normalize: bool = False
) -> list[Measurement]:
    """Read the measurements of files, in their order.

    degrees: the unit of bare angles; normalize: accept any non-zero quaternion and any matrix near a rotation
    Raises FormatError with the place of an invalid measurement: a moving frame, a frame in itself, a sigma of 0, a
    missing name or pose.
    """
    request = Request(rows=RowOptions(kind=POSE, degrees=degrees, normalize=normalize))
    found: list[Measurement] = []
    try:
        for file in files:
            first, rows = dict[tuple[str, str], MeasuredRow](), list[MeasuredRow]()
            is_rows = file.format == "jsonl" and not re.search(WRAPPED, file.head())
            read = _of_table if file.format in ("csv", "tsv", "semicolon") else _of_edges
            read = _of_documents if is_rows or not file.holds_samples else read
            for row in read(file, request):
                if problem := _problem(row, first):
                    raise FormatError(problem, source=file.name, line=row.line)
                rows.append(row)
            if not rows:
                raise FormatError(f"no measurements in it; {LIKE}", source=file.name)
            many = Counter(row.line for row in rows)
            for row in rows:
                column = row.column if many[row.line] > 1 else 0
                place = ":".join(str(part) for part in (file.name, row.line, column) if part)
                found.append(row.measurement._replace(place=place))
    finally:
        for file in files:
            file.close()
    return found


def solve(
    measurements: Measured, *, root: str | None = None, fix: Iterable[FrameTree | str | PathLike[str]] = (),
    robust: bool = True,
) -> TreeSolution:  # fmt: skip
    """Estimate the tree that fits measurements; outliers are rejected.

    measurements: (parent, child, transform) or (parent, child, transform, covariance), the covariance as 36 numbers or
        (6, 6); or the path of a file as for `frametool solve`
    root: the frame in which the others are expressed; fix: trees, or paths of them, that are exact
    Returns .tree, .covariance(target, source), .residuals (n, 6), .u, .used, .fits, .checked and more.
    Raises ValueInvalid if frames are not connected or an outlier cannot be identified; FormatError.
    """
    trees = [each if isinstance(each, FrameTree) else load(each) for each in listed(fix)]
    if moving := next((each for each in trees if each.moves), None):
        raise ValueInvalid(f"{moving.name} moves; fixed frames must be static")
    fixed = FrameTree("the fixed frames")
    for tree in trees:
        for track in tree.tracks():
            own = Transform.of(*track.components), tree.covariances.get(track.child)
            fixed.add(track.parent, track.child, *own)
    if isinstance(measurements, str | PathLike):
        rows = read_measurements([FrameFile(measurements)])
    else:
        rows = [_measurement(each, f"measurement {number}") for number, each in enumerate(measurements, 1)]
    return solve_tree(rows, root=root, fixed=fixed, robust=robust)


def _measurement(argument: Any, place: str) -> Measurement:
    """Check one measurement passed from Python; raises ValueInvalid that names it."""
    if isinstance(argument, Measurement):
        return argument
    if not (isinstance(argument, tuple | list) and len(argument) in (3, 4) and isinstance(argument[2], Transform)):
        raise ValueInvalid(f"{place}: expected (parent, child, Transform) or with a covariance behind")
    parent, child, transform = argument[:3]
    if wrong := [name for name in (parent, child) if not (isinstance(name, str) and name)]:
        raise ValueInvalid(f"{place}: a frame is named by a text, found {wrong[0]!r}")
    try:
        components, covariance = taken(transform, argument[3] if len(argument) > 3 else None)
        return Measurement(parent, child, components, covariance or None)
    except ValueInvalid as error:
        raise ValueInvalid(f"{place}: {error}") from None


def without(measurements: Sequence[Measurement], places: Sequence[str]) -> list[Measurement]:
    """Return the measurements except those at some places, FILE:LINE.

    Raises ValueInvalid for a place without a measurement, or with several.
    """
    many = Counter(each.place for each in measurements)
    if unknown := next((place for place in places if place not in many), ""):
        raise ValueInvalid(f"no measurement stands at {shown(unknown)}{alternatives(unknown, many, 'measurements')}")
    if several := next((place for place in places if many[place] > 1), ""):
        raise ValueInvalid(f"{several} holds {many[several]} measurements; write each on a line of its own")
    return [each for each in measurements if each.place not in places]


def _problem(row: MeasuredRow, first: dict[tuple[str, str], MeasuredRow]) -> str:
    """Return the error in a measurement, "" for none; first: for each pair its first measurement with a stamp."""
    parent, child, components, covariance = row.measurement[:4]
    if missing := [key for key, name in (("parent", parent), (CHILD, child)) if not name]:
        return f"missing {' and '.join(missing)}; {LIKE}"
    if parent == child:
        return f"{shown(child)} is measured from itself"
    sigmas = covariance[::7] if covariance is not None else (1.0,)
    if not all(sigmas):
        return f"sigma of {AXES[sigmas.index(0.0)]} is 0: give xyz and rpy; what is exact goes into --fix"
    if row.stamp_ns is not None:
        before = first.setdefault((parent, child), row)
        if before.stamp_ns != row.stamp_ns and before.measurement.components != components:
            moves = f"{shown(child)} moves in {shown(parent)}: another stamp than on line {before.line}"
            return f"{moves}; measure what stands still, and leave the stamps out if it does"
    return ""


def _of_edges(file: FrameFile, request: Request) -> Iterator[MeasuredRow]:
    """Yield the edges of a file that holds a tree; repeated messages of a recording count once."""
    edges = [edge for edge in file.edges(normalize=request.rows.normalize) if edge.parent is not None]
    lines = lines_of([EdgePlace(file, edge) for edge in edges])
    said = {edge[:4] if edge.stamp_ns is not None else at: at for at, edge in reversed([*enumerate(edges)])}
    for at in sorted(said.values()):
        edge, (_, line) = edges[at], lines[at]
        made = Measurement(edge.parent or "", edge.child, edge.components, edge.covariance)
        yield MeasuredRow(made, line, edge.stamp_ns)


def _of_table(file: FrameFile, request: Request) -> Iterator[MeasuredRow]:
    """Yield the rows of a table."""
    from frametool.rows.batch import values_of
    from frametool.rows.conversion import FormatConverter

    converter = FormatConverter(file.format, request._replace(operation=MOVED), file.name)
    bare, line = file.tally.names.bare, 0
    for block, outcome in converter.steps(cast("ByteStream", file.stream)):
        rows, shape = converter.rows, converter.rows.shape
        if not line and shape.notation is None:
            warn(f"{file.name}:1: no rotation among the columns {rows.columns}: each is taken for 0")
        line = line or 1
        BadRows(file.name).take(fault._replace(line=line + fault.line) for fault in outcome.faults)
        results = values_of(block)
        inputs = rows.inputs.T.tolist() if results else []
        for at, result, own in zip((block.lines + line).tolist(), results, inputs, strict=True):
            pose, cells = result.pose, result.extras
            try:
                child = _one_child(pose.name, cells.get("name"))
            except ValueInvalid as error:
                raise FormatError(str(error), source=file.name, line=at) from None
            if (flag := cells.get("inverse")) not in (None, "true", "false"):
                message = f"inverse must be true or false, found {shown(str(flag))}"
                raise FormatError(message, source=file.name, line=at)
            pose, turned = pose._replace(covariance=cells.get("covariance")), shape._replace(inverse=flag == "true")
            pose = inverted(pose) if turned.inverse else pose
            yield MeasuredRow(_made(pose, turned, own, bare, child, cells.get("id")), at, cells.get("stamp_ns"))
        line += outcome.lines
    file.tally.rough += [1] * converter.rows.mended
    file.tell()


def _of_documents(file: FrameFile, request: Request) -> Iterator[MeasuredRow]:
    """Yield the measurements of a YAML or JSON text."""
    source = file.source
    reading = Reading(source, normalize=request.rows.normalize)
    found: list[tuple[Measurement, Path, int | None]] = []
    for document in parse_documents(source.text, source.name):
        try:
            for path, row in _rows(document.value, (document.index,), reading):
                asked = request._replace(operation=COMBINED).with_rows(degrees=reading.degrees or request.rows.degrees)
                for record, each in _of_row(row, path, asked, reading):
                    last = max(at for at, step in enumerate(record.path) if type(step) is int)
                    stamp_ns = stamp_of({document.index: document.value}, record, source)
                    found.append((each, record.path[: max(last + 1, len(path))], stamp_ns))
        except Misfit as misfit:
            raise misfit.placed(source) from None
    tell(source, reading.notes)
    places = locate_many(source.text, [path for _, path, _ in found], key=True)
    for (made, _, stamp_ns), (line, column) in zip(found, places, strict=True):
        yield MeasuredRow(made, line, stamp_ns, column)


def _rows(value: Any, path: Path, reading: Reading) -> Iterator[tuple[Path, Any]]:
    """Yield the rows of a document with their paths; nested frames get the names of their parents."""
    reading.degrees = False
    if type(value) is dict and (keys := [key for key in LISTS if key in value]):
        key = keys[0]
        if unknown := [each for each in value if each not in (key, "angles")]:
            message = f"unknown key {shown(unknown[0])} beside {key}; expected angles"
            raise Misfit(message, (*path, unknown[0]), key=True)
        reading.degrees = "angles" in value and within(path, read_angle_unit, value["angles"])
        if type(value[key]) is dict and key == "frames":
            edges = within(path, lambda: [*read_edges(value, Reading(reading.source, normalize=reading.normalize))])
            for edge in edges:
                here = edge.path[: -2 if "samples" in edge.path[-2:-1] else None]
                if edge.parent is not None:
                    names = {"parent": edge.parent, CHILD: edge.child}
                    yield (*path, *here), (value_at(value, here) or {}) | names
            return
        value, path = value[key] or [], (*path, key)
    elif type(value) is dict:
        yield path, value
        return
    if type(value) is not list:
        raise Misfit(f"expected a list of measurements, found {kind(value)}; {LIKE}", path)
    for at, row in enumerate(value):
        yield (*path, at), row


def _of_row(row: Any, path: Path, request: Request, reading: Reading) -> Iterator[tuple[Record, Measurement]]:
    """Yield the measurements in one row of a document: one pose, or those of the transforms of a message."""
    if type(row) is not dict:
        raise Misfit(f"expected a measurement, found {kind(row)}; {LIKE}", path)
    if OURS.isdisjoint(row):
        found = first_of([*row], MOST_KEYS, quote=shown)
        raise Misfit(f"expected measurements:, frames: or a row, found the keys {found}; {LIKE}", path)
    if "samples" in row:
        raise Misfit("a frame that moves is not solved for; measure what stands still", (*path, "samples"), key=True)
    if set(row) == {"name"}:
        return  # a list of frames may name its roots
    for key in row:
        if key not in OURS and not is_sigma(key) and (hint := did_you_mean(key, MISSPELT, cutoff=0.75)):
            raise Misfit(f"unknown key {shown(key)}{hint}", (*path, key), key=True)
    plain = {key: each for key, each in row.items() if key not in (CHILD, "id", "children")}
    for record in find_records(plain, request, reading, path):
        if not record.values:
            raise Misfit(f"no pose; {LIKE}", path)
        pose = pose_of(record, request)
        child = within(path, _one_child, row.get(CHILD), pose.name)
        label = row.get("id") if type(row.get("id")) is str else None
        own = record.values[: record.shape.own_size]
        yield record, _made(pose, record.shape, own, reading.bare, child, label)


def _one_child(child: Any, name: str | None) -> str:
    """Return the name of the measured frame, from either key; raises Misfit if they differ."""
    if child is not None and (type(child) not in (str, Verbatim) or not child):
        raise Misfit(f"child must be a frame's name, found {kind(child)}", (CHILD,))
    if child and name and child != name:
        raise Misfit(f"child says {shown(child)} and name says {shown(name)}; keep one", (CHILD,))
    return str(child or name or "")


def _made(
    pose: Pose, shape: Shape, own: Sequence[float], bare: Callable[[str], str], child: str, label: str | None
) -> Measurement:
    """Return the measurement of a pose, with its angles as written unless the pose was inverted."""
    name = shape.notation.representation.name if shape.notation and not shape.inverse else ""
    written: tuple[str, tuple[float, float, float]] | None = None
    if name in ("rpy", "rotvec"):
        a, b, c = (radians(angle) if shape.degrees else angle for angle in shape.rotation(own))
        written = name, (a, b, c)
    parent, child, label = bare(pose.parent or ""), bare(child), label and str(label)
    return Measurement(parent, child, pose.components, pose.covariance, "", label, written)
