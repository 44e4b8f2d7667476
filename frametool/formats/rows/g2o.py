"""g2o pose graphs: vertices are poses in the world, metres, quaternion w last; edges are relative to the first vertex.

VERTEX_SE3:QUAT 0 1.0 2.0 0.5 0.0 0.0 0.0 1.0
VERTEX_SE2 1 1.0 2.0 0.5
EDGE_SE3:QUAT 0 1 1.0 0.0 0.0 0.0 0.0 0.0 1.0 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1

Edges are measurements and may contradict each other, so they are not a tree; the vertices are the estimate.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

from frametool.errors import FormatError, did_you_mean, listing, shown
from frametool.formats.rows.pose_rows import Written, numbers_in, samples, text_lines, whole_in
from frametool.formats.table import FORMATS, Poses
from frametool.geometry import euler, floats

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Options, Samples

POSES = FORMATS["g2o"].poses
EDGES = Poses("quaternion", counted="")
# other tags of g2o: landmarks, parameters, other measurements
NO_POSE = r"FIX|PARAMS_\w+|ROBOTLASER\d|VERTEX_(?:XY|\w+XYZ?|CAM|SW\w*)|EDGE_(?:SE[23]|PRIOR|BEARING|PR|SW|PO)\w+"
IN_SPACE, IN_PLANE = "x y z qx qy qz qw", "x y theta"
VERTICES = {"VERTEX_SE3:QUAT": IN_SPACE, "VERTEX_SE2": IN_PLANE}
MEASURED = {"EDGE_SE3:QUAT": IN_SPACE, "EDGE_SE2": IN_PLANE}
INFORMATION = {IN_SPACE: 21, IN_PLANE: 6}  # numbers after an edge


def form_of(_file: InputFile, options: Options) -> Poses:
    """Return the meaning of the poses: of vertices in the world, or of one vertex in another."""
    return EDGES if options.answers.edges else POSES


def poses(file: InputFile, options: Options) -> Iterator[Written]:
    """Yield the vertices as written, or the edges."""
    edges = options.answers.edges
    kinds, others = (MEASURED, VERTICES) if edges else (VERTICES, MEASURED)
    only_others = 0
    unknown, first = Counter[str](), 0
    for number, line in text_lines(file):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] in others:
            only_others = only_others or number
        elif words[0] in kinds:
            only_others = -1
            yield _pose(file, number, words, kinds[words[0]], ids=1 + edges)
        elif not words[0][0].isupper():
            message = f"expected a tag as {next(iter(kinds))}, found {shown(words[0])}"
            raise FormatError(message, source=file.name, line=number)
        elif not re.fullmatch(NO_POSE, words[0]):
            unknown[words[0]] += 1
            first = first or number
    if unknown:
        tag = next(iter(unknown))
        near = did_you_mean(tag, [each for each in kinds if each.startswith(tag)] or kinds)
        counts = listing((f"{count} {each}" for each, count in unknown.items()), 3)
        message = f"lines of unknown tags left out: {counts}{near}"
        options.tally.note(message, first)
    if only_others > 0:
        as_poses = "edges in it, which measure and are no tree; as poses: frametool convert FILE --edges"
        found = "vertices in it; leave --edges out" if edges else as_poses
        raise FormatError(f"only {found}", source=file.name, line=only_others)


def _pose(file: InputFile, line: int, words: list[str], layout: str, *, ids: int) -> Written:
    """Read a vertex with its id, or an edge with its two vertices and its information matrix."""
    expected = f"{'id' if ids == 1 else 'i j'} {layout}"
    size = len(expected.split())
    kind, *rest = words
    if len(rest) != size and (ids == 1 or len(rest) != size + INFORMATION[layout]):
        raise FormatError(f"expected {kind} {expected}, found {len(words)} words", source=file.name, line=line)
    number, *_ = (whole_in(file, line, word, "the id of a vertex") for word in rest[:ids])
    numbers = numbers_in(file, line, rest[ids:size])
    if layout == IN_PLANE:
        x, y, theta = numbers
        numbers = [x, y, 0.0, *euler.to_quaternion(0.0, 0.0, theta, "sxyz", floats)]
    return Written(tuple(numbers), number, line, names=(rest[0], rest[1]) if ids > 1 else None)


def read(file: InputFile, options: Options) -> Iterator[Samples]:
    """Yield the vertices as poses of one body."""
    return samples(poses(file, options), POSES, file, options)
