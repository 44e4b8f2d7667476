"""g2o pose graphs: the vertices are poses in the world, metres, the quaternion w last; an edge is seen from its first.

VERTEX_SE3:QUAT 0 1.0 2.0 0.5 0.0 0.0 0.0 1.0
VERTEX_SE2 1 1.0 2.0 0.5
EDGE_SE3:QUAT 0 1 1.0 0.0 0.0 0.0 0.0 0.0 1.0 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1

Edges measure, and contradict each other: they are no tree and are counted; the vertices are what was made of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import FormatError, shown
from frametool.formats.pose_rows import Numbers, RowForm, write_rows
from frametool.formats.trajectory import Poses, Written, numbers_in, samples, text_lines
from frametool.geometry import euler, floats

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.documents.input_file import InputFile
    from frametool.grammar.edges import Options, Samples
    from frametool.grammar.result import Result, Style

POSES = Poses("quaternion", counted="ids of vertices")
ROWS = RowForm((b"VERTEX_SE3:QUAT ", "number", b" ", Numbers(7), b"\n"), holds=())
IN_SPACE, IN_PLANE = "VERTEX_SE3:QUAT", "VERTEX_SE2"
WORDS = {IN_SPACE: "id x y z qx qy qz qw", IN_PLANE: "id x y theta"}


def poses(file: InputFile, options: Options) -> Iterator[Written]:  # noqa: ARG001 - as the other forms have it
    """Yield the vertices as they are written."""
    for number, line in text_lines(file):
        words = line.split()
        if words and words[0] in WORDS:
            yield _vertex(file, number, words)


def _vertex(file: InputFile, line: int, words: list[str]) -> Written:
    kind, *rest = words
    expected = WORDS[kind]
    if len(rest) != len(expected.split()):
        raise FormatError(f"expected {kind} {expected}, found {len(words)} words", source=file.name, line=line)
    if not rest[0].isdecimal():
        raise FormatError(f"expected the id of a vertex, found {shown(rest[0])}", source=file.name, line=line)
    numbers = numbers_in(file, line, rest[1:])
    if kind == IN_PLANE:
        x, y, theta = numbers
        numbers = [x, y, 0.0, *euler.to_quaternion(0.0, 0.0, theta, "sxyz", floats)]
    return Written(tuple(numbers), int(rest[0]), line)


def read(file: InputFile, options: Options) -> Iterator[Samples]:
    """Yield the vertices as poses of one body."""
    return samples(poses(file, options), POSES, file, options)


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return a vertex a pose, numbered from 0."""
    return write_rows(ROWS, results, style)
