"""COLMAP's images.txt: two lines per image, the second its points (which may be empty, but must be there).

    # Image list with two lines of data per image:
    #   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME
    1 0.8517 0.0165 0.5035 -0.1431 -0.7376 1.0240 3.7463 1 P1180141.JPG
    2362.39 248.498 58396 1784.7 268.254 59027

The file has the pose of the world in the camera, camera<-world: the camera is at -R't. Optical axes. Since 2025
frames.txt, the list of frames of a rig, has the pose of the world in the rig: FRAME_ID RIG_ID QW .. TZ ..
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.errors import FormatError, shown
from frametool.formats.rows.pose_rows import Written, numbers_in, samples, text_lines, whole_in
from frametool.formats.table import FORMATS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Options, Samples

IMAGE_LINE = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
NUMBER_BEFORE = r"[-+.\d]+(?:[eE][-+]?\d+)?\s"
FRAME_LINE = "FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS .."
POSES = FORMATS["colmap"].poses



def poses(file: InputFile, options: Options) -> Iterator[Written]:  # noqa: ARG001 - as the other forms have it
    """Yield the poses of images.txt, or of frames.txt, as written."""
    comments, lines = True, text_lines(file)
    of_frames = False
    begins_so: bool | None = None  # whether names of images begin with a number and a blank
    for number, line in lines:
        bare = line.strip()
        if not bare or bare.startswith("#"):
            of_frames |= comments and "Frame list" in bare
            continue
        comments = False
        pose = _pose(file, number, bare, of_frame=of_frames)
        begins = re.match(NUMBER_BEFORE, pose.image) is not None
        begins_so = begins if begins_so is None else begins_so
        if begins != begins_so:
            message = f"only some pictures are called as {shown(pose.image)}; a number too many or too few in the line?"
            raise FormatError(message, source=file.name, line=number)
        yield pose
        if not of_frames:
            below, points = next(lines, (0, ""))
            words = points.split()
            if len(words) % 3 or not all(re.fullmatch("-1|[0-9]+", word) for word in words[2::3]):
                message = f"expected points (X Y POINT3D_ID each) or an empty line, found {len(words)} words"
                raise FormatError(message, source=file.name, line=below)


def read(file: InputFile, options: Options) -> Iterator[Samples]:
    """Yield the poses of the camera in the world."""
    return samples(poses(file, options), POSES, file, options)


def _pose(file: InputFile, line: int, text: str, *, of_frame: bool) -> Written:
    words = text.split(maxsplit=9)  # the name of an image may contain blanks
    data = text.split()[9:] if of_frame else []  # a count, and three words per item
    expected = FRAME_LINE if of_frame else f"10 words ({IMAGE_LINE})"
    if len(words) < 9 or (len(words) < 10 and not of_frame):
        raise FormatError(f"expected {expected}, found {len(words)} words", source=file.name, line=line)
    number = whole_in(file, line, words[0], "an id")
    whole_in(file, line, *((words[1], "RIG_ID") if of_frame else (words[8], "CAMERA_ID")))
    if data and len(data) != 1 + 3 * whole_in(file, line, data[0], "NUM_DATA_IDS"):
        raise FormatError(f"expected {expected}, three words of each, found {len(data)}", source=file.name, line=line)
    w, x, y, z, *position = numbers_in(file, line, words[1 + of_frame : 8 + of_frame])
    return Written((*position, w, x, y, z), number, line, "" if of_frame else words[9])
