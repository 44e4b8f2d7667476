"""Model directives of Drake (.dmd.yaml): frames added to models, and what is welded to what.

    directives:
    - add_model: {name: arm, file: package://models/arm.urdf}
    - add_frame: {name: tip, X_PF: {base_frame: arm::link7, translation: [0, 0, 0.1], rotation: !Rpy {deg: [0, 0, 90]}}}
    - add_weld: {parent: world, child: arm::base, X_PC: {rotation: !AngleAxis {angle_deg: 90, axis: [0, 0, 1]}}}

Metres, degrees, roll pitch yaw about fixed axes: parent<-frame; without a pose the identity.  The frames of the models
stand in their own files: given beside this one they hang in it as `arm::link7`.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from frametool.documents.yaml import TAG
from frametool.errors import did_you_mean, listing, shown
from frametool.formats.load import Recording
from frametool.formats.trees.matrices import Stated, edges_of
from frametool.formats.trees.tree_reader import XYZ, document_edges, named
from frametool.geometry.representations import notation
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pose import read_name
from frametool.grammar.readers import Misfit, as_mapping, kind, read_numbers, read_texts, within
from frametool.grammar.rotation_spelling import rotation_of
from frametool.ros.messages import only

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Quaternion, Reading

TAGS = frozenset(("!Rpy", "!AngleAxis", "!Identity"))
OTHERS = ("add_model_instance", "add_collision_filter_group")  # nothing in them has a pose
JOINTS, BODIES = "default_joint_positions", "default_free_body_pose"
WORLD = "world"
_RPY = notation("rpy_deg")
_AXIS_ANGLE = notation("axis_angle_deg")
_ZEROS = ["0", "0", "0"]


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the frames and welds, and give the files of models beside this one their scope."""

    def take(value: Any, reading: Reading) -> list[Edge]:
        scene = _Scene(file, reading)
        listed = as_mapping(value, "directives").get("directives")
        if type(listed) is not list:
            raise Misfit(f"expected directives as a list, found {kind(listed)}", ("directives",))
        for index, entry in enumerate(listed):
            within(("directives", index), scene.take, entry, ("directives", index))
        about = f"without the frames of {listing(scene.missing, 3)} (--with their files, by name)"
        options.tally.about = about if scene.missing else f"{len(scene.poses)} poses"
        # of directives that only add models something is known too: Drake's world is always there
        return edges_of(scene.poses, reading) or [Edge(None, WORLD, IDENTITY)]

    yield from document_edges(file, options, take, TAGS)


class _Scene:
    """What directives say, in their order."""

    def __init__(self, file: InputFile, reading: Reading) -> None:
        self.file = file
        self.reading = reading
        self.poses: list[Stated] = []
        self.missing: list[str] = []
        self.aliases: dict[str, str] = {}  # an added frame with the scope of what it is fixed to -> as it was written

    def take(self, entry: Any, path: Path) -> None:
        """Read one directive; raises Misfit."""
        known = {
            "add_model": self._model,
            "add_directives": self._include,
            "add_frame": self._frame,
            "add_weld": self._weld,
        }
        directive = as_mapping(entry, "a directive such as add_frame: {..}")
        if len(directive) != 1:
            raise Misfit(f"expected one directive an entry, found {listing(directive)}")
        ((name, value),) = directive.items()
        if name in known:
            fields = within((name,), as_mapping, value, f"what {name} takes")
            within((name,), known[name], fields, (*path, name))
        elif name not in OTHERS:
            near = did_you_mean(name, (*known, *OTHERS))
            raise Misfit(
                f"unknown directive {shown(name)}{near}; known: {', '.join((*known, *OTHERS))}", (name,), key=True
            )

    def _model(self, model: dict[str, Any], path: Path) -> None:
        """Take a model: put its scope on its file, tell its joints' values, and keep its free pose."""
        name = named(model, "name")
        only(model, ("name", "file", JOINTS, BODIES))
        found = self._beside(named(model, "file"), name)
        positions = within((JOINTS,), as_mapping, model.get(JOINTS, {}), "positions of joints")
        if positions and isinstance(found, Recording):
            self._say_joints(found, positions, (*path, JOINTS))
        for body, pose in within((BODIES,), as_mapping, model.get(BODIES, {}), "poses of bodies").items():
            here = (*path, BODIES, body)
            with_base = within(here[-2:], as_mapping, pose, "a pose")
            child = f"{name}::{body}" if body else name  # "" is the only body that a model has
            self._state(with_base.get("base_frame", WORLD), child, with_base, here, len(path))

    def _say_joints(self, found: Recording, positions: dict[str, Any], path: Path) -> None:
        """Tell the file of a model where its joints stand; `--joint` wins."""
        values = {}
        for joint, position in positions.items():
            numbers = position if type(position) is list else [position]
            if len(numbers) == 1 and len(found.scopes) == 1:
                within((JOINTS, joint), read_numbers, numbers, (joint,))
                values[joint] = numbers[0]
            else:
                self.reading.here = path
                self.reading.note("is left out: its joint has several values, or its file stands for two models", joint)
        found.answers = found.answers._replace(joints={**values, **found.answers.joints})

    def _include(self, include: dict[str, Any], _: Path) -> None:
        """Put their scope on other directives beside this file."""
        only(include, ("file", "model_namespace"))
        self._beside(named(include, "file"), read_name(include, "model_namespace") or "")

    def _beside(self, address: str, scope: str) -> InputFile | None:
        """Put a scope before the names of a file that is read together with this one."""
        name = address.rpartition("/")[2]
        for each in self.file.beside:
            if each is not self.file and os.path.basename(each.path) == name:
                if scope:
                    each.scopes.append(scope)
                return each
        self.missing.append(f"{scope or name} ({name})" if scope else name)
        return None

    def _frame(self, frame: dict[str, Any], path: Path) -> None:
        only(frame, ("name", "X_PF"))
        name = named(frame, "name")
        pose = within(("X_PF",), as_mapping, frame.get("X_PF"), "X_PF as {base_frame: .., translation: ..}")
        base = within(("X_PF",), named, pose, "base_frame")
        scope, colons, _ = base.rpartition("::")
        if colons and "::" not in name:
            self.aliases[f"{scope}::{name}"] = name
        self._state(base, name, pose, (*path, "X_PF"), len(path))

    def _weld(self, weld: dict[str, Any], path: Path) -> None:
        only(weld, ("parent", "child", "X_PC"))
        parent, child = named(weld, "parent"), named(weld, "child")
        pose = weld.get("X_PC")
        if pose is None:
            self._add(parent, child, IDENTITY, path)
        else:
            within(("X_PC",), only, within(("X_PC",), as_mapping, pose, "X_PC as a pose"), ("translation", "rotation"))
            self._state(parent, child, pose, (*path, "X_PC"), len(path))

    def _state(self, parent: str, child: str, pose: dict[str, Any], path: Path, depth: int) -> None:
        """Keep a pose; misfits in it are placed below the directive."""
        self.reading.here = path
        within(path[depth:], only, pose, ("base_frame", "translation", "rotation"))
        shift = within((*path[depth:], "translation"), read_numbers, pose.get("translation", _ZEROS), XYZ)
        turn = within((*path[depth:], "rotation"), _rotation, pose.get("rotation", {}), self.reading)
        self._add(parent, child, (*shift, *turn), path)

    def _add(self, parent: str, child: str, pose: Rigid, path: Path) -> None:
        parent, child = (self.aliases.get(name, name) for name in (parent, child))
        self.poses.append(Stated(parent, child, child, pose, path, firm=True))


def _rotation(value: Any, reading: Reading) -> Quaternion:
    """Read a rotation by its tag."""
    fields = as_mapping(value, "a rotation such as !Rpy {deg: [r, p, y]}")
    tag = fields.get(TAG)
    if tag == "!Rpy":
        only(fields, (TAG, "deg"))
        texts = within(("deg",), read_texts, fields.get("deg", _ZEROS), _RPY.names)
        return rotation_of(_RPY, texts, [("deg", index) for index in range(3)], reading)
    if tag == "!AngleAxis":
        only(fields, (TAG, "angle_deg", "axis"))
        if "angle_deg" not in fields:
            raise Misfit("missing angle_deg")
        texts = [*within(("axis",), read_texts, fields.get("axis", ["0", "0", "1"]), XYZ), fields["angle_deg"]]
        places: list[Path] = [*(("axis", index) for index in range(3)), ("angle_deg",)]
        return rotation_of(_AXIS_ANGLE, texts, places, reading)
    if keys := [key for key in fields if key != TAG]:
        raise Misfit(f"a rotation says by its tag what it is: !Rpy {{deg: [..]}}, found {listing(keys)}")
    return 0.0, 0.0, 0.0, 1.0
