"""COLMAP's images.txt: two lines an image, the second its points (which may be empty, and counts all the same).

# Image list with two lines of data per image:
#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME
1 0.8517 0.0165 0.5035 -0.1431 -0.7376 1.0240 3.7463 1 P1180141.JPG
2362.39 248.498 58396 1784.7 268.254 59027

What is written is the pose of the world in the camera, camera<-world: the camera stands at -R't. Optical axes. The list
of frames that a rig has since 2025, frames.txt, holds the pose of the world in the rig: FRAME_ID RIG_ID QW .. TZ ..
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import FormatError, shown
from frametool.formats.rows.pose_rows import IMAGE, Numbers, RowForm
from frametool.formats.rows.trajectory import Written, numbers_in, samples, text_lines
from frametool.formats.table import Poses

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Options, Samples

IMAGE_LINE = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
FRAME_LINE = "FRAME_ID RIG_ID QW QX QY QZ TX TY TZ"
POSES = Poses("wxyz", inverse=True, axes="optical", frames=("world", "camera"), counted="image ids")


ROWS = RowForm(
    ("number", b" ", Numbers(7), b" 1 ", IMAGE, b"\n\n"),
    lambda tx, ty, tz, x, y, z, w: (w, x, y, z, tx, ty, tz),
    head=b"# Image list with two lines of data per image:\n"
    b"#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n",
    first=1,
    axes="optical",
    inverse=True,
    holds=(),
    beside="every camera is number 1, without points",
)


def poses(file: InputFile, options: Options) -> Iterator[Written]:  # noqa: ARG001 - as the other forms have it
    """Yield the poses of images.txt, or of frames.txt, as they are written."""
    comments, lines = True, text_lines(file)
    of_frames = False
    for number, line in lines:
        bare = line.strip()
        if not bare or bare.startswith("#"):
            of_frames |= comments and "Frame list" in bare
            continue
        comments = False
        yield _pose(file, number, bare, of_frame=of_frames)
        if not of_frames:
            next(lines, None)


def read(file: InputFile, options: Options) -> Iterator[Samples]:
    """Yield the poses of the camera in the world."""
    return samples(poses(file, options), POSES, file, options)


def _pose(file: InputFile, line: int, text: str, *, of_frame: bool) -> Written:
    words = text.split(maxsplit=9)  # the name of a picture may hold blanks
    if of_frame and len(words) < 9:
        raise FormatError(f"expected {FRAME_LINE} .., found {len(words)} words", source=file.name, line=line)
    if not of_frame and len(words) != 10:
        raise FormatError(f"expected 10 words ({IMAGE_LINE}), found {len(words)}", source=file.name, line=line)
    w, x, y, z, *position = numbers_in(file, line, words[1 + of_frame : 8 + of_frame])
    if not words[0].isdecimal():
        raise FormatError(f"expected an id, found {shown(words[0])}", source=file.name, line=line)
    return Written((*position, w, x, y, z), int(words[0]), line, "" if of_frame else words[9])
