"""NeRF's transforms.json: the pose of each camera in the world as 4x4 rows, with the axes of OpenGL; any scale.

{"camera_angle_x": 0.69, "frames": [{"file_path": "1.png", "transform_matrix": [[..], [..], [..], [0, 0, 0, 1]]}]}

Axes of OpenGL: x right, y up, z backward. Matrices of three rows occur (Nerfstudio), and `applied_transform`, which
is already included in them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_documents
from frametool.formats.rows.pose_rows import Written, position_and_turn, samples
from frametool.formats.table import FORMATS
from frametool.grammar.readers import Misfit, as_mapping, kind, read_numbers, within

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Options, Samples

POSES = FORMATS["nerf"].poses
MATRIX = "transform_matrix"
LAST_ROW = (0.0, 0.0, 0.0, 1.0)


def poses(file: InputFile, options: Options) -> Iterator[Written]:
    """Yield the poses of the cameras as written."""
    for document in parse_documents(file.text, file.name):
        try:
            whole = as_mapping(document.value, "transforms.json")
            if "applied_transform" in whole:
                options.tally.note("the poses contain its applied_transform; it is not taken out", 1)
            for index, entry in enumerate(whole.get("frames") or ()):
                yield within(("frames", index), _pose, entry, index)._replace(
                    path=(document.index, "frames", index, MATRIX)
                )
        except Misfit as misfit:
            raise misfit.placed(file.source, document.index) from None


def _pose(entry: Any, index: int) -> Written:
    """Read one of the frames."""
    frame = as_mapping(entry, "a frame {file_path, transform_matrix}")
    matrix = frame.get(MATRIX)
    if type(matrix) is not list or len(matrix) not in (3, 4):
        raise Misfit(f"expected {MATRIX} as 4 rows, found {kind(matrix) if type(matrix) is not list else len(matrix)}")
    rows = [within((MATRIX, at), read_numbers, row, "1234") for at, row in enumerate(matrix)]
    if rows[3:] not in ([], [LAST_ROW]):
        raise Misfit("the last row of a pose is 0 0 0 1", (MATRIX, 3))
    image = frame.get("file_path")
    return Written(position_and_turn(rows), index, image=image if type(image) is str else "")


def read(file: InputFile, options: Options) -> Iterator[Samples]:
    """Yield the poses of the camera in the world."""
    return samples(poses(file, options), POSES, file, options)
