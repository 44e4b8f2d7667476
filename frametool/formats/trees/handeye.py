"""Hand-eye calibrations of easy_handeye and easy_handeye2: the pose of a camera on a robot's hand, or at its base.

    parameters: {eye_on_hand: true, robot_effector_frame: tool0, tracking_base_frame: camera_link, ..}
    transformation: {x: .., y: .., z: .., qx: .., qy: .., qz: .., qw: ..}
    parameters: {calibration_type: eye_in_hand, ..}                        easy_handeye2
    transform: {translation: {x: .., ..}, rotation: {x: .., y: .., z: .., w: ..}}

Metres, x y z w: the pose of tracking_base_frame in robot_effector_frame if the eye is on the hand, else in
robot_base_frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.yaml_writer import flow, quoted
from frametool.errors import ValueInvalid, listing, shown, warn
from frametool.formats.trees.tree_reader import XYZ, document_edges, named, read_flat_pose
from frametool.formats.trees.written_poses import static_edges, warn_lonely_roots
from frametool.geometry import floats, quaternion
from frametool.geometry.representations import notation
from frametool.grammar.edges import Edge, Options
from frametool.grammar.readers import Misfit, Reading, as_mapping, kind, within
from frametool.ros.messages import only, read_rigid

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.grammar.result import Style

NAME = "handeye"
CHILD = "tracking_base_frame"
EFFECTOR, BASE = "robot_effector_frame", "robot_base_frame"
# a parameter -> the reference frame of the camera
MOUNTS = {
    "eye_on_hand": {"true": EFFECTOR, "false": BASE},
    "calibration_type": {"eye_in_hand": EFFECTOR, "eye_on_hand": EFFECTOR, "eye_on_base": BASE, "eye_to_hand": BASE},
}
POSES = ("transformation", "transform")
_XYZW = notation("xyzw")


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the only edge."""

    def take(value: Any, reading: Reading) -> Iterator[Edge]:
        calibration = as_mapping(value, "parameters and transformation")
        # the first easy_handeye had no parameters: around them
        inner = "parameters" in calibration
        path = ("parameters",) if inner else ()
        parameters = within(path, as_mapping, calibration["parameters"] if inner else calibration, "the parameters")
        parent = within(path, named, parameters, within(path, _mount, parameters))
        child = within(path, named, parameters, CHILD)
        key = next((key for key in POSES if key in calibration), None)
        if key is None:
            raise Misfit(f"missing {POSES[0]} (easy_handeye) or {POSES[1]} (easy_handeye2)")
        reading.here = (key,)
        pose = within((key,), as_mapping, calibration[key], "the pose of the camera")
        components = within((key,), _pose, pose, reading)
        yield Edge(parent, child, components, path=(key,))

    yield from document_edges(file, options, take)


def _mount(parameters: dict[str, Any]) -> str:
    """Return the key of the reference frame of the camera."""
    key = next((key for key in MOUNTS if key in parameters), None)
    if key is None:
        raise Misfit("missing eye_on_hand (easy_handeye) or calibration_type (easy_handeye2)")
    found = parameters[key]
    if type(found) is not str or found not in MOUNTS[key]:
        said = shown(found) if type(found) is str else kind(found)
        raise Misfit(f"{key} must be {' or '.join(MOUNTS[key])}, found {said}", (key,))
    return MOUNTS[key][found]


def _pose(pose: dict[str, Any], reading: Reading) -> Rigid:
    """Read either notation."""
    if "rotation" in pose or "translation" in pose:
        only(pose, ("translation", "rotation"))
        position, rotation = read_rigid(pose, ("translation", "rotation"), reading)
        return (*position, *rotation)
    only(pose, (*XYZ, *_XYZW.columns))
    return read_flat_pose(pose, _XYZW, reading)


def write_tree(tree: Frames, style: Style) -> str:
    """Return the only edge of a tree as easy_handeye has it, as if on the hand; raises ValueInvalid for other trees."""
    edges = static_edges(tree, NAME)
    if len(edges) != 1:
        children = listing(child for _, child, _ in edges)
        raise ValueInvalid(f"{NAME} holds one pose, and here are {len(edges)}: {children}")
    ((parent, child, pose),) = edges
    warn(f"{NAME}: {shown(parent)} is written as the hand; for a fixed camera write eye_on_hand: false and {BASE}")
    warn_lonely_roots(tree, NAME)
    return write_mount(parent, child, pose, style, on_hand=True)


def write_mount(parent: str, child: str, pose: Rigid, style: Style, *, on_hand: bool) -> str:
    """Return the pose of a camera on the hand, or fixed to the base, as easy_handeye has it."""
    turned = quaternion.from_quaternion(*pose[3:], floats)
    numbers = zip((*XYZ, *_XYZW.columns), (*pose[:3], *turned), strict=True)
    lines = "".join(f"  {key}: {flow(number, style.number)}\n" for key, number in numbers)
    mount = EFFECTOR if on_hand else BASE
    frames = f"  eye_on_hand: {str(on_hand).lower()}\n  {mount}: {quoted(parent)}\n  {CHILD}: {quoted(child)}\n"
    return f"parameters:\n{frames}transformation:\n{lines}"
