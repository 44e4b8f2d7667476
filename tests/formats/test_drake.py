"""Drake's directives: tags, degrees, welds, models beside them under their scope."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from calibrations import matrix
from scipy.spatial.transform import Rotation as Peer

from frametool.errors import FormatError
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from frametool.geometry.types import Array

SCENE = """\
directives:
- add_model:
    name: arm
    file: package://models/arm.urdf
- add_model_instance: {name: extra}
- add_frame:
    name: tip
    X_PF:
      base_frame: arm::hand
      translation: [0.1, 0.2, 0.3]
      rotation: !Rpy { deg: [10, 20, 30] }
- add_weld:
    parent: world
    child: arm::base
    X_PC:
      rotation: !AngleAxis
        angle_deg: 90
        axis: [0, 0, 2]
- add_weld: {parent: arm::tip, child: "tool::base"}
- add_frame: {name: same, X_PF: {base_frame: tip, rotation: !Identity {}}}
- add_collision_filter_group: {name: x, members: []}
"""
ARM = """\
<robot name="anything"><link name="base"/><link name="hand"/>
<joint name="lift" type="prismatic"><origin xyz="0 0 1"/><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
<limit lower="0" upper="1"/></joint></robot>
"""


def read(folder: Path, text: str, *more: str, **options: Any) -> Any:
    (folder / "a.dmd.yaml").write_text(text)
    (folder / "arm.urdf").write_text(ARM)
    return load(folder / "a.dmd.yaml", *(folder / name for name in more), **options)


def tip() -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = Peer.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix(), (0.1, 0.2, 0.3)
    return made


def test_frames_and_welds_are_poses_in_their_parents(tmp_path: Path) -> None:
    tree = read(tmp_path, SCENE)
    assert set(tree.roots) == {"arm::hand", "world"}
    assert matrix(tree, "arm::hand", "same") == pytest.approx(tip(), abs=1e-15)
    assert np.array_equal(matrix(tree, "world", "arm::base"), [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert matrix(tree, "tip", "tool::base") == pytest.approx(np.eye(4))


def test_a_model_beside_it_hangs_under_its_name(tmp_path: Path) -> None:
    tree = read(tmp_path, SCENE, "arm.urdf", joints={"lift": 0.5})
    assert tree.roots == ("world",)
    wanted = matrix(tree, "world", "arm::base") @ [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1.5], [0, 0, 0, 1]] @ tip()
    assert matrix(tree, "world", "tool::base") == pytest.approx(wanted, abs=1e-15)


def test_joints_stand_as_the_directives_say_unless_told(tmp_path: Path) -> None:
    text = SCENE.replace("arm.urdf\n", "arm.urdf\n    default_joint_positions: {lift: [0.25]}\n")
    assert matrix(read(tmp_path, text, "arm.urdf"), "arm::base", "arm::hand")[2, 3] == 1.25
    assert matrix(read(tmp_path, text, "arm.urdf", joints={"lift": 0.5}), "arm::base", "arm::hand")[2, 3] == 1.5


def test_a_file_may_stand_for_two_models(tmp_path: Path) -> None:
    text = "directives:\n" + "".join(
        f"- add_model: {{name: {name}, file: package://x/arm.urdf}}\n- add_weld: {{parent: world, child: '{name}::base', X_PC: {{translation: [{x}, 0, 0]}}}}\n"
        for name, x in (("left", 1), ("right", -1))
    )
    tree = read(tmp_path, text, "arm.urdf")
    assert matrix(tree, "left::hand", "right::hand")[0, 3] == -2.0


def test_directives_beside_it_get_their_namespace(tmp_path: Path) -> None:
    (tmp_path / "b.dmd.yaml").write_text(SCENE)
    tree = read(tmp_path, "directives:\n- add_directives: {file: package://x/b.dmd.yaml, model_namespace: cell}\n", "b.dmd.yaml")
    assert matrix(tree, "cell::arm::hand", "cell::tip") == pytest.approx(tip(), abs=1e-15)
    assert "world" in tree.frames


def test_a_weld_to_an_added_frame_turns_its_model_round(tmp_path: Path) -> None:
    text = "directives:\n- add_frame: {name: grip, X_PF: {base_frame: 'hand::base', translation: [0, 0, 0.1]}}\n- add_weld: {parent: world, child: grip, X_PC: {translation: [1, 0, 0]}}\n"
    tree = read(tmp_path, text)
    assert tree.roots == ("world",)
    assert tree.lookup("world", "hand::base").components[:3] == (1.0, 0.0, -0.1)


def test_a_free_body_stands_where_it_is_put(tmp_path: Path) -> None:
    text = "directives:\n- add_model: {name: box, file: package://x/box.sdf, default_free_body_pose: {body: {translation: [0, 0.09, 2.7]}}}\n"
    assert read(tmp_path, text).lookup("world", "box::body").components[:3] == (0.0, 0.09, 2.7)


def test_models_that_are_not_there_are_told(run: Callable[..., Any]) -> None:
    done = run("tree", "a.yaml", files={"a.yaml": SCENE})
    assert "without the frames of arm (arm.urdf)" in done.err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("10, 20, 30", "10, x, 30", "a.dmd.yaml:11:34: 'x' is not a number"),
        ("10, 20, 30", "10, 20", "a.dmd.yaml:11:29: expected 3 numbers"),
        ("[0.1, 0.2, 0.3]", "[0.1, nan, 0.3]", "a.dmd.yaml:10:26: 'nan' is not finite"),
        ("!Rpy", "!Uniform", "a.dmd.yaml:11:17: tag !Uniform is not read here"),
        ("!Rpy { deg: [10, 20, 30] }", "{ deg: [10, 20, 30] }", "a.dmd.yaml:11:17: a rotation says by its tag what it is"),
        ("!Rpy { deg: [10, 20, 30] }", "!Rpy { rad: [1, 2, 3] }", "a.dmd.yaml:11:24: unknown key 'rad'"),
        ("[0, 0, 2]", "[0, 0, 0]", "a.dmd.yaml:16:17: axis"),
        ("angle_deg: 90", "angle: 90", "unknown key 'angle'"),
        ("base_frame: arm::hand", "base: arm::hand", "a.dmd.yaml:9:7: missing base_frame"),
        ("add_weld:\n", "ad_weld:\n", "a.dmd.yaml:12:3: unknown directive 'ad_weld'; did you mean 'add_weld'?"),
        ("    child: arm::base\n", "", "a.dmd.yaml:13:5: missing child"),
        ("directives:", "directives: 3\nx:", "a.dmd.yaml:1:13: expected directives as a list, found '3'"),
    ],
)
def test_what_is_wrong_is_one_placed_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, SCENE.replace(old, new, 1))
    assert said in str(caught.value)


def test_tags_are_read_only_where_a_form_has_them(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("frames: {a: {b: !Rpy {deg: [0, 0, 0]}}}")
    with pytest.raises(FormatError, match=r"a.yaml:1:17: tag !Rpy is not read here"):
        load(tmp_path / "a.yaml")
