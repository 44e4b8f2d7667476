"""Open3D's trajectories of a camera, optical axes: .log files, and PinholeCameraTrajectory in JSON.

0 0 1                                   three whole numbers, then the rows of a 4x4
1.0 0.0 0.0 2.0                         the pose of the camera in the world
0.0 1.0 0.0 2.0
0.0 0.0 1.0 -0.3
0.0 0.0 0.0 1.0

{"class_name": "PinholeCameraTrajectory", "parameters": [{"extrinsic": [..16, column by column], ..}]}

The two differ in direction: the extrinsic in JSON is the pose of the world in the camera.
Source: Open3D#2778, Open3D#6522.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.documents.document import parse_documents
from frametool.errors import FormatError
from frametool.formats.rows.pose_rows import Numbers, RowForm, rows_of_matrix
from frametool.formats.rows.trajectory import Written, numbers_in, position_and_turn, samples, text_lines, whole_in
from frametool.formats.table import FORMATS, Poses
from frametool.grammar.readers import Misfit, as_mapping, read_numbers, within

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Options, Samples

LOG = FORMATS["open3d"].poses
EXTRINSIC = LOG._replace(inverse=True)
LAST_ROW = [0.0, 0.0, 0.0, 1.0]
ROWS = RowForm(
    ("number", b" ", "number", b" ", "next", b"\n", *(Numbers(4), b"\n") * 3, b"0.0 0.0 0.0 1.0\n"),
    rows_of_matrix,
    holds=(),
)


def is_json(file: InputFile) -> bool:
    """Tell the JSON from the .log."""
    return file.head().lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{"


def form_of(file: InputFile, _options: Options) -> Poses:
    """Return how the file writes its poses."""
    return EXTRINSIC if is_json(file) else LOG


def poses(file: InputFile, options: Options) -> Iterator[Written]:  # noqa: ARG001 - as the other forms have it
    """Yield the poses as they are written."""
    return _parameters(file) if is_json(file) else _blocks(file)


def _blocks(file: InputFile) -> Iterator[Written]:
    """Yield the poses of a .log."""
    lines = ((number, line.split()) for number, line in text_lines(file) if line.strip())
    for number, words in lines:
        if len(words) != 3:
            raise FormatError("expected three whole numbers before a matrix", source=file.name, line=number)
        counted, *_ = (whole_in(file, number, word, "the number of a pose") for word in words)
        rows, at = [], number
        for _ in range(4):
            at, row = next(lines, (at, []))
            if len(row) != 4:
                message = f"expected four rows of four numbers behind line {number}, found {len(row)} numbers"
                raise FormatError(message, source=file.name, line=at)
            rows.append(numbers_in(file, at, row))
        if rows[3] != LAST_ROW:
            raise FormatError("the last row of a pose is 0 0 0 1", source=file.name, line=at)
        yield Written(position_and_turn(rows), counted, number)


def _parameters(file: InputFile) -> Iterator[Written]:
    """Yield the extrinsics of JSON, column by column as they stand there."""
    document = parse_documents(file.text, file.name)[0]
    try:
        parameters = as_mapping(document.value, "a PinholeCameraTrajectory").get("parameters")
        for index, entry in enumerate(parameters if type(parameters) is list else []):
            path = ("parameters", index, "extrinsic")
            extrinsic = within(path[:2], as_mapping, entry, "parameters of a camera").get("extrinsic")
            numbers = within(path, read_numbers, extrinsic, [f"m{at % 4 + 1}{at // 4 + 1}" for at in range(16)])
            rows = [list(numbers[row::4]) for row in range(4)]
            if rows[3] != LAST_ROW:
                raise Misfit("the last row of a pose is 0 0 0 1; an extrinsic stands column by column", path)
            yield Written(position_and_turn(rows), index, path=(document.index, *path))
    except Misfit as misfit:
        raise misfit.placed(file.source, document.index) from None


def read(file: InputFile, options: Options) -> Iterator[Samples]:
    """Yield the poses of the camera in the world."""
    return samples(poses(file, options), form_of(file, options), file, options)
