"""Points over the picture that a camera took of them: each where it is seen, in the colour of its depth.

The picture stays as it is, and its file's bytes stand in the drawing; places are pixels of the camera, the centre of
the first one at 0, 0.
"""

from __future__ import annotations

import os
from base64 import b64encode
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import FileProblem, FormatError, ValueInvalid
from frametool.view.pictures import FONT, POINTS, STOPS, require_matplotlib, shade_of, write_html

if TYPE_CHECKING:
    from frametool.geometry.types import Number

SUFFIXES = (".svg", ".html", ".png")
MOST = 20_000  # points that are drawn
UPRIGHT = ' style="image-orientation: none"'  # which pages say in their style
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # the markers of JPEG that are followed by a size


class Shot(NamedTuple):
    """A picture: the bytes of its file, what they are, its width and its height."""

    data: bytes
    kind: str
    width: int
    height: int


def read_shot(path: str) -> Shot:
    """Read a PNG or a JPEG; raises FormatError for anything else, FileProblem."""
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise FileProblem(f"{path}: {(error.strerror or str(error)).lower()}") from None
    if data.startswith(PNG) and len(data) > 24:
        return Shot(data, "png", int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big"))
    at = 2 if data.startswith(JPEG) else len(data)
    while at + 9 < len(data) and data[at] == 0xFF:
        if data[at + 1] in FRAMES:
            height, width = (int.from_bytes(data[begin : begin + 2], "big") for begin in (at + 5, at + 7))
            return Shot(data, "jpeg", width, height)
        is_filled = data[at + 1] == 0xFF  # before a marker there may be more of its first byte
        at += 1 if is_filled else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    raise FormatError("neither a PNG nor a JPEG; an overlay is drawn over one of these", source=path)


class Overlay:
    """The points in the image; of more than MOST every second, fourth .. is drawn."""

    def __init__(self, image: str, path: str) -> None:
        """Read the picture; path: of the drawing, whose suffix must be one of SUFFIXES.  Raises ValueInvalid."""
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
        """Return width and height of the picture."""
        return self.shot.width, self.shot.height

    def take(self, u: Number, v: Number, depth: Number, inside: Any) -> None:
        """Add those of a block of points, or the one, that are in the image."""
        if isinstance(inside, bool):
            found = [(depth, u, v)] * inside
        else:
            found = [*zip(*(each[inside].tolist() for each in (depth, u, v)), strict=True)]
        self.points += found[-self.count % self.every :: self.every]
        self.count += len(found)
        while len(self.points) > MOST:
            self.points, self.every = self.points[::2], 2 * self.every

    def drawn(self) -> bytes:
        """Return the drawing in the form of its suffix, far points first."""
        self.points.sort(reverse=True)
        if self.suffix == ".png":
            return self._png()
        svg = self._svg()
        if self.suffix == ".html":
            svg = write_html("overlay", f'<main id="overlay">{svg.replace(UPRIGHT, "")}</main>')
        return svg.encode()

    def summary(self) -> str:
        """Return what was drawn."""
        thinned = f", 1 in {self.every} of {self.count}" if self.every > 1 else ""
        points = f"{len(self.points)} point{'s' * (len(self.points) != 1)}"
        return f"{self.path}: {points} over {self.image}{thinned}"

    @property
    def span(self) -> tuple[float, float]:
        """Return the least and the greatest depth."""
        return (self.points[-1][0], self.points[0][0]) if self.points else (0.0, 0.0)

    @property
    def radius(self) -> float:
        """Return that of a point, in pixels: small where there are many."""
        return max(self.shot.width / (250.0 if len(self.points) < 1000 else 600.0), 0.75)

    def _colour(self, depth: float) -> str:
        """Return a colour, bright for what is near."""
        near, far = self.span
        return shade_of((far - depth) / (far - near) if far > near else 1.0)

    @property
    def _legend(self) -> tuple[float, float, float, float]:
        """Return left, top, width and height of the scale, in the lower left corner."""
        width, height = self.size
        return 0.04 * width, height - 0.5 - 0.035 * width, 0.3 * width, 0.015 * width

    @property
    def _labels(self) -> list[tuple[float, float, str]]:
        """Return where the words of the scale stand, above it, and what they say."""
        left, top, width, _ = self._legend
        near, far = self.span
        return [(left + part * width, top - 0.018 * self.shot.width, f"{near + part * (far - near):.3g}{unit}")
                for part, unit in ((0.0, ""), (0.5, ""), (1.0, " m"))]  # fmt: skip

    def _svg(self) -> str:
        shot, (left, top, width, height) = self.shot, self._legend
        stops = "".join(
            f'<stop offset="{at / (len(STOPS) - 1):g}" stop-color="{shade_of(1.0 - at / (len(STOPS) - 1))}"/>'
            for at in range(len(STOPS))
        )
        size = 0.022 * shot.width
        words = "".join(
            f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:.1f}" text-anchor="middle" fill="#ffffff" '
            f'stroke="#000000" stroke-width="{size / 5:.1f}" paint-order="stroke">{text}</text>\n'
            for x, y, text in self._labels
        )
        circles = "".join(
            f'<circle cx="{u:.3f}" cy="{v:.3f}" r="{self.radius:g}" fill="{self._colour(depth)}"/>\n'
            for depth, u, v in self.points
        )
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{shot.width}" height="{shot.height}" '
            f'viewBox="-0.5 -0.5 {shot.width} {shot.height}" {FONT}>\n'
            f'<defs><linearGradient id="depth">{stops}</linearGradient></defs>\n'
            f'<image x="-0.5" y="-0.5" width="{shot.width}" height="{shot.height}"{UPRIGHT} '
            f'href="data:image/{shot.kind};base64,{b64encode(shot.data).decode()}"/>\n{circles}'
            f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" fill="url(#depth)" '
            f'stroke="#000000"/>\n{words}</svg>\n'
        )

    def _png(self) -> bytes:
        """Return the drawing as the bytes of a PNG."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.colors import LinearSegmentedColormap
        from matplotlib.figure import Figure
        from matplotlib.image import imread

        shot, (left, top, width, height) = self.shot, self._legend
        figure = Figure(figsize=(shot.width / 100.0, shot.height / 100.0), dpi=100)
        FigureCanvasAgg(figure)
        axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.axis("off")
        ends = (-0.5, shot.width - 0.5, shot.height - 0.5, -0.5)
        pixels = imread(BytesIO(shot.data), format=shot.kind)
        white = 1.0 if pixels.dtype.kind == "f" else 255.0
        axes.imshow(pixels, extent=ends, interpolation="none", cmap="gray", vmin=0.0, vmax=white)
        if self.points:
            depths, us, vs = zip(*self.points, strict=True)
            colours = [self._colour(depth) for depth in depths]
            axes.scatter(us, vs, s=(2.0 * self.radius * POINTS) ** 2, c=colours, linewidths=0.0)
        shades = LinearSegmentedColormap.from_list("depth", [shade_of(1.0 - at / 4.0) for at in range(5)])
        axes.imshow([[at / 255.0 for at in range(256)]], cmap=shades, aspect="auto",
                    extent=(left, left + width, top + height, top))  # fmt: skip
        for x, y, text in self._labels:
            axes.text(x, y, text, fontsize=0.022 * shot.width * POINTS, color="white", ha="center", va="center",
                      bbox={"color": "black", "alpha": 0.5, "pad": 1.0})  # fmt: skip
        axes.set(xlim=ends[:2], ylim=ends[2:], aspect="auto")
        stream = BytesIO()
        figure.savefig(stream, format="png", metadata={"Software": None})
        return stream.getvalue()
