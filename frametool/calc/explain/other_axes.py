"""Steps of a change of axes at the two ends of a pose: W p B, of `--world-axes` and `--axes`."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.calc.explain.operations import product, turned
from frametool.calc.explain.sheet import METRES
from frametool.geometry import rigid

if TYPE_CHECKING:
    from frametool.calc.explain.sheet import Sheet
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Quaternion

MIRROR = "One side alone would leave no rotation: its matrix would have the determinant -1."


class OtherAxes(NamedTuple):
    """A change of axes: the names and rotations of its sides, None for one that stays, and whether it is a mirror."""

    world: tuple[str, Quaternion] | None = None
    axes: tuple[str, Quaternion] | None = None
    mirrors: bool = False


def with_other_axes(sheet: Sheet, pose: Rigid, change: OtherAxes) -> Rigid:
    """Add the steps from a pose to the same with other axes, on its left, then on its right."""
    if change.world is not None and change.axes is not None:
        sheet.say("p becomes W p B: W turns the frame it is seen from, B the frame it is the pose of.")
    if change.mirrors:
        sheet.heading("Mirrored across y, for axes that are left-handed")
        sheet.say("y changes its sign, and so do the turns about x and z: t = (x, -y, z), q = (-qx, qy, -qz, qw).")
        pose = rigid.mirrored(*pose)
        sheet.say(f"p = xyz {sheet.numbers(pose[:3])} m, xyzw {sheet.numbers(pose[3:])}")
        sheet.caveat(MIRROR)
    if change.world is not None:
        name, w = change.world
        sheet.heading(f"Other axes of the frame it is seen from: {name}")
        sheet.say(f"W = {name} turns the position and stands on the left of the rotation so far: a = W, b = q.")
        x, y, z = pose[:3]
        if x or y or z:
            x, y, z = turned(sheet, w, pose[:3], "t", ("R(W) t", r"R(W)\,t"), METRES)
        pose = x, y, z, *product(sheet, w, pose[3:])
    if change.axes is None:
        return pose
    name, b = change.axes
    sheet.heading(f"Other axes: {name}")
    sheet.say(f"a is the rotation so far, b = {name}: the pose of the new axes in the old ones.")
    return *pose[:3], *product(sheet, pose[3:], b)
