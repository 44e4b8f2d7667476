"""MJCF, the models of MuJoCo, read; their joints take values.

    <body name="arm" pos="0 0 1" quat="1 -1 0 0"><joint name="elbow" axis="0 1 0" pos="0 0 .1" ref="30"/> ..

parent_from_child = pose * the motions of the body's joints, in order: hinges turn about `axis` through `pos`, by their
value less `ref`; so a joint that nobody tells of stands at `ref`, where the file shows the body. Bodies hang on the
body around them, the outermost on `world`; sites and cameras are `site:NAME`, `camera:NAME` (looking along -z).
Metres; degrees unless the compiler says radian; quaternions w first, of any length; eulerseq with moving axes in lower
and fixed ones in upper case. Values of a key: --joints FILE.xml:KEY. <include>, <replicate>, <attach> are refused.
Source: MuJoCo 3 and 4, XML reference and engine_core_smooth.c (mj_kinematics).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from frametool.documents.source import Source
from frametool.documents.xml_events import XmlFile
from frametool.documents.xml_tree import read_nodes
from frametool.errors import FormatError, alternatives, shown
from frametool.formats.joint_files import Setting
from frametool.formats.joints import JointValue
from frametool.formats.mjcf_bodies import HELD, IDENTITY, MjcfModel
from frametool.formats.posture import Posture
from frametool.geometry import floats, quaternion, rigid
from frametool.grammar.edges import Edge, Options, Tally, Topics

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from frametool.documents.input_file import InputFile
    from frametool.documents.xml_tree import XmlNode
    from frametool.formats.joints import Joint
    from frametool.formats.mjcf_bodies import Anchored, Placed
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path

SIZES = {"floating": 7, "ball": 4}  # numbers of a joint in qpos; the others have one


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a model, its joints as told, else at their references."""
    xml = XmlFile(file)
    model = MjcfModel(read_nodes(xml, HELD), xml, options)
    joints = [each.joint for each in model.joints]
    posture = Posture(joints, options, lambda joint, problem: xml.error(model.joint_names[joint.name].element, problem))
    for placed in model.placed.values():
        line = placed.node.element.line
        if not placed.joints:
            yield Edge(placed.parent, placed.name, placed.pose, line=line)
            continue
        for stamp_ns, moved in posture.motions(*(each.joint.name for each in placed.joints)):
            yield Edge(placed.parent, placed.name, _moved(placed, moved, posture), stamp_ns, line)


def _moved(placed: Placed, moved: Sequence[Rigid], posture: Posture) -> Rigid:
    """Return the pose of a body whose joints have moved; the value of a free one is the pose itself, in the world."""
    pose = placed.pose
    for (joint, anchor, _), motion in zip(placed.joints, moved, strict=True):
        if joint.kind == "floating":
            pose = motion if joint.name in posture.told else pose
        elif motion != IDENTITY:
            pose = rigid.compose(*pose, *_about(anchor, motion))
    return pose


def _about(anchor: tuple[float, float, float], motion: Rigid) -> Rigid:
    """Return a motion about a point: what turns leaves the point where it is."""
    tx, ty, tz, qx, qy, qz, qw = motion
    px, py, pz = anchor
    mx, my, mz = quaternion.rotate(qx, qy, qz, qw, px, py, pz)
    return tx + px - mx, ty + py - my, tz + pz - mz, qx, qy, qz, qw


def read_joints(file: InputFile, state: str) -> Iterator[Setting]:
    """Yield what a key of the model says of its joints: `state` is its name, or its number from 0.

    Raises FormatError.
    """
    try:
        xml = XmlFile(file)
    finally:
        file.close()
    root = read_nodes(xml, HELD)
    joints = MjcfModel(root, xml, Options(Tally(), Topics())).joints
    key = _key(root, xml, state)
    if not key.attribute("qpos"):
        raise xml.error(key.element, f"key {shown(state)} has no qpos")
    count = sum(_size(each.joint) for each in joints)
    numbers = iter(xml.numbers(key.element, "qpos", count))
    refuse = partial(_refused, xml, key)
    for anchored in joints:
        mine = [next(numbers) for _ in range(_size(anchored.joint))]
        yield Setting(anchored.joint.name, _value(anchored, mine, refuse), None, refuse, Source(xml.name, ""))


def _size(joint: Joint) -> int:
    return SIZES.get(joint.kind, 1)


def _key(root: XmlNode, xml: XmlFile, state: str) -> XmlNode:
    """Return the key of a name or number."""
    keys = [key for frames in root.all("keyframe") for key in frames.all("key")]
    names = {key.attribute("name") or str(index): key for index, key in enumerate(keys)}
    numbered = {str(index): key for index, key in enumerate(keys)}
    if not keys:
        raise FormatError("no <key> in it, which would say where joints stand", source=xml.name)
    if not state:
        message = f"name one of its keys: {xml.name}:{next(iter(names))}"
        raise FormatError(f"{message}{alternatives('', names, 'keys')}", source=xml.name)
    if state not in names | numbered:
        raise FormatError(f"no key {shown(state)}{alternatives(state, names, 'keys')}", source=xml.name)
    return names.get(state) or numbered[state]


def _value(anchored: Anchored, numbers: list[float], refuse: Any) -> Any:
    """Return the value of a joint as files have it: a number, or the mapping that is a pose; quaternions w first."""
    if anchored.joint.kind not in SIZES:
        return JointValue(numbers[0])
    w, x, y, z = numbers[-4:]
    if w == x == y == z == 0.0:
        raise refuse(f"qpos of joint {shown(anchored.joint.name)}: 0 0 0 0 has no direction", ())
    turned = quaternion.normalized(x, y, z, w, floats)
    pose: dict[str, Any] = {"xyzw": [repr(part) for part in turned]}
    return pose | {"xyz": [repr(part) for part in numbers[:3]]} if anchored.joint.kind == "floating" else pose


def _refused(xml: XmlFile, key: XmlNode, problem: str, _path: Path) -> FormatError:
    return xml.error(key.element, problem, "qpos")
