"""Bundler's bundle.out: cameras that look along -z, as OpenGL's do; what is written is the pose of the world in them.

# Bundle file v0.3
2 1000                                  how many cameras, how many points
600.5 -0.1 0.02                         focal length, two coefficients of distortion; all 0: not estimated
1.0 0.0 0.0                             R, three rows
0.0 1.0 0.0
0.0 0.0 1.0
0.5 0.0 -2.0                            t: p_camera = R p_world + t
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import FormatError, shown
from frametool.formats.rows.trajectory import Written, numbers_in, samples, text_lines, whole_in
from frametool.formats.table import FORMATS
from frametool.grammar.readers import Note

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Options, Samples

POSES = FORMATS["bundler"].poses
LINES = 5  # of a camera, three words each


def poses(file: InputFile, options: Options) -> Iterator[Written]:
    """Yield the poses of the cameras that were estimated; those with a focal length of 0 are counted and told."""
    lines = ((number, line.split()) for number, line in text_lines(file) if line.strip() and not line.startswith("#"))
    first, head = next(lines, (1, []))
    if len(head) != 2:
        message = f"expected how many cameras and points, found {shown(' '.join(head))}"
        raise FormatError(message, source=file.name, line=first)
    count, _ = (whole_in(file, first, word, "how many cameras and points") for word in head)
    missing = 0
    for camera in range(count):
        rows, at = [], first
        for _ in range(LINES):
            at, words = next(lines, (at, []))
            if len(words) != 3:
                message = f"camera {camera}: expected {LINES} lines of three numbers, found {len(words)} numbers"
                raise FormatError(message, source=file.name, line=at)
            rows.append(numbers_in(file, at, words))
        if rows[0][0] == 0.0:
            missing += 1
        else:
            turn = [number for row in rows[1:4] for number in row]
            yield Written((*rows[4], *turn), camera, at - LINES + 1)
    if missing:
        message = f"{missing} of {count} cameras were not estimated (f = 0): left out"
        options.tally.note(Note("odd", message, ()), first)


def read(file: InputFile, options: Options) -> Iterator[Samples]:
    """Yield the poses of the camera in the world."""
    return samples(poses(file, options), POSES, file, options)
