"""Overlays: projected points on the camera's image, coloured by depth.

The image file is embedded unchanged; coordinates are pixels, the centre of the first one at 0, 0.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from frametool.errors import FileProblem, FormatError, ValueInvalid
from frametool.view.pictures import (
    Picture,
    PictureBox,
    PictureDot,
    PictureImage,
    PictureWords,
    require_matplotlib,
    shade_of,
    write_picture,
)

if TYPE_CHECKING:
    from frametool.geometry.types import Number
    from frametool.view.pictures import Shape

SUFFIXES = (".svg", ".html", ".png")
MOST, FEW = 20_000, 1000  # points that are drawn, and that are drawn large
CORNER = (-0.5, -0.5)  # of a picture, whose first pixel has its middle at 0, 0
SHADES = 24  # of the scale
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # the markers of JPEG that are followed by a size


def read_shot(path: str) -> PictureImage:
    """Read a PNG or a JPEG; raises FormatError for anything else, FileProblem."""
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise FileProblem(f"{path}: {(error.strerror or str(error)).lower()}") from None
    if data.startswith(PNG) and len(data) > 24:
        width, height = (int.from_bytes(data[begin : begin + 4], "big") for begin in (16, 20))
        return PictureImage(*CORNER, width, height, "png", data)
    at = 2 if data.startswith(JPEG) else len(data)
    while at + 9 < len(data) and data[at] == 0xFF:
        if data[at + 1] in FRAMES:
            height, width = (int.from_bytes(data[begin : begin + 2], "big") for begin in (at + 5, at + 7))
            return PictureImage(*CORNER, width, height, "jpeg", data)
        is_filled = data[at + 1] == 0xFF  # before a marker there may be more of its first byte
        at += 1 if is_filled else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    raise FormatError("neither a PNG nor a JPEG; an overlay is drawn over one of these", source=path)


class Overlay:
    """The points in an image; beyond MOST, every second, fourth .. is drawn."""

    def __init__(self, image: str, path: str) -> None:
        """Read the image; path: the output file, with one of SUFFIXES.  Raises ValueInvalid."""
        self.image, self.path = image, path
        self.suffix = os.path.splitext(path)[1].lower()
        if self.suffix not in SUFFIXES:
            raise ValueInvalid(f"{path}: --image draws {', '.join(SUFFIXES)}")
        if self.suffix == ".png":
            require_matplotlib()
        self.shot = read_shot(image)
        self.points: list[tuple[float, float, float]] = []  # depth, u, v
        self.count, self.every = 0, 1

    @property
    def size(self) -> tuple[int, int]:
        """Return the width and height of the image."""
        return self.shot.width, self.shot.height

    def take(self, u: Number, v: Number, depth: Number, inside: Any) -> None:
        """Add the points of a block, or one point, that are in the image."""
        if isinstance(inside, bool):
            found = [(depth, u, v)] * inside
        else:
            found = [*zip(*(each[inside].tolist() for each in (depth, u, v)), strict=True)]
        self.points += found[-self.count % self.every :: self.every]
        self.count += len(found)
        while len(self.points) > MOST:
            self.points, self.every = self.points[::2], 2 * self.every

    def drawn(self) -> str | bytes:
        """Return the overlay in the format of its suffix, with far points below near ones."""
        self.points.sort(reverse=True)
        near, far = (self.points[-1][0], self.points[0][0]) if self.points else (0.0, 0.0)
        wide, high = self.size
        radius = max(wide / (250.0 if len(self.points) < FEW else 600.0), 0.75)
        shades = {depth: shade_of((far - depth) / (far - near) if far > near else 1.0) for depth, _, _ in self.points}
        shapes: list[Shape] = [self.shot, *(PictureDot(u, v, radius, shades[depth]) for depth, u, v in self.points)]
        left, top, part = 0.04 * wide, high - 0.5 - 0.035 * wide, 0.3 * wide / SHADES
        for at in range(SHADES):
            colour = shade_of(1.0 - at / (SHADES - 1))
            shapes.append(PictureBox(left + at * part, top, 1.05 * part, 0.015 * wide, colour))
        for share, unit in ((0.0, ""), (0.5, ""), (1.0, " m")):
            x, said = left + share * SHADES * part, f"{near + share * (far - near):.3g}{unit}"
            shapes.append(PictureWords(x, top - 0.018 * wide, said, "#ffffff", "middle", 0.022 * wide, halo="#000000"))
        return write_picture(Picture(wide, high, shapes, "overlay", CORNER, 3), self.suffix)

    def summary(self) -> str:
        """Return what was drawn."""
        thinned = f", 1 in {self.every} of {self.count}" if self.every > 1 else ""
        points = f"{len(self.points)} point{'s' * (len(self.points) != 1)}"
        return f"{self.path}: {points} over {self.image}{thinned}"
