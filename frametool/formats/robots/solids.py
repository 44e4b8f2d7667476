"""Solids of robots as their files draw them: boxes, cylinders, spheres and capsules of `visual` and of MJCF's geoms.

    <visual><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></visual>

A mesh is known by its name only; of a link that shows meshes alone, the simple shapes of its `collision` are taken
instead.  Axes of cylinders and capsules are z, their middle is the origin.
"""

from __future__ import annotations

from math import dist
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.xml import read_xml
from frametool.formats.robots import mjcf, sdf
from frametool.geometry import euler, floats, rigid
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Diagnostics, Options, Topics

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from frametool.documents.source import InputFile
    from frametool.documents.xml import Element
    from frametool.formats.robots.mjcf import _Inside
    from frametool.geometry.types import Rigid

SIZES = {"box": 3, "cylinder": 2, "capsule": 2, "sphere": 1}
SHAPES = (*SIZES, "mesh")
DRAWN = ("visual", "collision")
SHOWN_GROUPS = 3  # of MJCF's geoms; its viewer draws those below
PARTS = {"size": 3, "radius": 1, "length": 1}  # what says how large a shape is, and with how many numbers

class Solid(NamedTuple):
    """A solid in a frame: a kind of SHAPES, its pose, and its size in metres.

    size: lengths of the edges of a box; radius and length, a capsule's without its caps; radius; of a mesh nothing
    """

    frame: str
    kind: str
    size: tuple[float, ...]
    pose: Rigid = IDENTITY


def read_solids(file: InputFile, fmt: str) -> list[Solid]:
    """Return the solids of a file whose frames were read; none of a form without any.  Raises FormatError."""
    readers: dict[str, Callable[[InputFile], Iterator[Solid]]] = {"urdf": _of_urdf, "sdf": _of_sdf, "mjcf": _of_mjcf}
    return [*readers[fmt](file)] if fmt in readers else []


def _seen(
    name: str, link: Element, pose_of: Callable[[Element], Rigid], numbers_of: Callable[[Element], Iterable[float]]
) -> list[Solid]:
    """Return what a link shows; of one that shows meshes alone the simple shapes it collides with, if there are any."""
    visual, collision = (
        [Solid(name, shape.tag, tuple(numbers_of(shape)), pose_of(node))
         for node in link.all(tag) for geometry in node.all("geometry") for shape in geometry.all(*SHAPES)]
        for tag in DRAWN
    )  # fmt: skip
    simple = [each for each in collision if each.kind != "mesh"]
    return simple if visual and simple and all(each.kind == "mesh" for each in visual) else visual


def _of_urdf(file: InputFile) -> Iterator[Solid]:
    def pose(node: Element) -> Rigid:
        origin = node.first("origin")
        if origin is None:
            return IDENTITY
        x, y, z = origin.numbers(3, "xyz", "0 0 0")
        roll, pitch, yaw = origin.numbers(3, "rpy", "0 0 0")
        return x, y, z, *euler.to_quaternion(roll, pitch, yaw, "sxyz", floats)

    def numbers(shape: Element) -> Iterator[float]:
        for part, count in PARTS.items():
            if part in shape.attributes:
                yield from shape.numbers(count, part)

    for link in read_xml(file, "robot").all("link"):
        yield from _seen(link.attribute("name").lstrip("/"), link, pose, numbers)


def _of_sdf(file: InputFile) -> Iterator[Solid]:
    frames = sdf.SdfFrames(read_xml(file, "sdf"), Options(Diagnostics(), Topics()))

    def numbers(shape: Element) -> Iterator[float]:
        for part in shape.all(*PARTS):
            yield from part.numbers(PARTS[part.tag])

    for frame in frames.all.values():
        if frame.kind == "link":
            yield from _seen(frame.name, frame.holder, lambda node: sdf.read_pose(node, frames.options)[0], numbers)


class _Geoms(mjcf.MjcfModel):
    """A model of MuJoCo, read for its geoms."""

    def __init__(self, root: Element) -> None:
        self.solids: list[Solid] = []
        super().__init__(root, Options(Diagnostics(), Topics()))

    def _take(self, node: Element, inside: _Inside) -> _Inside | None:
        if node.tag != "geom":
            return super()._take(node, inside)
        attributes = self.attributes(node, inside.around)
        usual = "mesh" if "mesh" in attributes else "sphere"
        kind = attributes["type"].attribute("type") if "type" in attributes else usual
        if mjcf.numbers_of(attributes, "group", "0")[0] >= SHOWN_GROUPS or kind not in SHAPES:
            return None
        size = mjcf.numbers_of(attributes, "size", attributes["size"].attribute("size") if "size" in attributes else "")
        if "fromto" in attributes:
            ends = mjcf.numbers_of(attributes, "fromto", "0 0 0 0 0 0")
            size = (*size[:1], 0.5 * dist(ends[:3], ends[3:]))
        size = tuple(2.0 * number if kind == "box" or at == 1 else number for at, number in enumerate(size))
        pose = rigid.compose(*inside.frame, *self.pose_of_site(attributes))
        self.solids.append(Solid(inside.body, kind, size[: SIZES.get(kind, 0)], pose))
        return None


def _of_mjcf(file: InputFile) -> Iterator[Solid]:
    yield from _Geoms(read_xml(file, "mujoco")).solids
