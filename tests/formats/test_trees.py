"""Frame trees in all their spellings, and poses in theirs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from flow import poses_in

from frametool import FrameTree, load
from frametool.errors import BadTopology, FormatError

if TYPE_CHECKING:
    from pathlib import Path

NESTED = """\
angles: deg
frames:
  base_link:
    lidar: {xyz: [0.9, 0.0, 2.0], rpy: [0, 0, 90]}
    camera_link:
      xyz: [0.1, 0, 1.2]
      rpy: {pitch: 15}
      children:
        camera_optical: {quaternion: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}
"""
LISTED = """\
frames:
  - {name: camera_optical, parent: camera_link, xyzw: [-0.5, 0.5, -0.5, 0.5]}
  - {name: camera_link, parent: base_link, xyz: {x: 0.1, z: 1.2}, rpy_deg: [0, 15, 0]}
  - name: base_link
  - {name: lidar, parent: base_link, position: [0.9, 0, 2], axis_angle: {axis: [0, 0, 3], angle: pi/2}}
"""
KEYED = """\
frames:
  camera_optical: {parent: camera_link, xyzw: [-0.5, 0.5, -0.5, 0.5]}
  camera_link: {parent: base_link, x: 0.1, z: 1.2, y: 0, roll_deg: 0, pitch_deg: 15, yaw_deg: 0}
  base_link:
    lidar: {xyz: [0.9, 0, 2], yaw: 90deg}
"""
HALF = "0.7071067811865476"
SIXTEENTH = "{x: 0, y: 0.13052619222005157, z: 0, w: 0.9914448613738104}"
ROS = f"""\
transforms:
- header: {{stamp: {{sec: 3, nanosec: 5}}, frame_id: base_link}}
  child_frame_id: lidar
  transform: {{translation: {{x: 0.9, y: 0, z: 2}}, rotation: {{x: 0, y: 0, z: {HALF}, w: {HALF}}}}}
---
transforms:
- header: {{seq: 7, stamp: {{secs: 4, nsecs: 0}}, frame_id: base_link}}
  child_frame_id: camera_link
  transform: {{translation: {{x: 0.1, y: 0, z: 1.2}}, rotation: {SIXTEENTH}}}
---
header: {{frame_id: camera_link}}
child_frame_id: camera_optical
transform: {{translation: {{x: 0, y: 0, z: 0}}, rotation: {{x: -0.5, y: 0.5, z: -0.5, w: 0.5}}}}
---
"""
JSON = json.dumps({
    "angles": "deg",
    "frames": {"base_link": {
        "lidar": {"xyz": [0.9, 0.0, 2.0], "rpy": [0, 0, 90]},
        "camera_link": {
            "xyz": [0.1, 0, 1.2], "euler": {"order": "zyx", "frame": "intrinsic", "angles": [0, "15deg", 0]},
            "children": {"camera_optical": {"matrix": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]}},
        },
    }},
})  # fmt: skip


def tree_of(tmp_path: Path, *texts: str | bytes) -> FrameTree:
    """Load texts as files 0.yaml, 1.yaml, .."""
    paths = [tmp_path / f"{number}.yaml" for number in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_bytes(text.encode() if isinstance(text, str) else text)
    tree = load(*paths)
    assert isinstance(tree, FrameTree)
    return tree


def refusal(tmp_path: Path, *texts: str | bytes) -> str:
    """Give what texts are refused with, files named without their folder."""
    with pytest.raises(FormatError) as caught:
        tree_of(tmp_path, *texts)
    return str(caught.value).replace(f"{tmp_path}/", "")


FRAME_IDS = LISTED.replace("{name:", "{child_frame_id:").replace("parent:", "frame_id:")


@pytest.mark.parametrize("text", [LISTED, FRAME_IDS, KEYED, ROS, JSON], ids=["list", "frame ids", "keys", "ros", "json"])
def test_all_spellings_make_the_same_tree(tmp_path: Path, text: str) -> None:
    expected, found = tree_of(tmp_path, NESTED), tree_of(tmp_path, text)
    assert set(found.frames) == set(expected.frames)
    for frame in expected.frames:
        assert found.lookup("lidar", frame).is_close(expected.lookup("lidar", frame), angle=1e-15, distance=1e-15)


def test_several_files_make_one_tree(tmp_path: Path) -> None:
    tree = tree_of(tmp_path, NESTED, "{name: base_link, parent: map, xyz: [1, 0, 0]}", "{name: base_link}")
    assert tree.path("map", "camera_optical") == ["map", "base_link", "camera_link", "camera_optical"]
    assert tree.roots == ("map",)


def test_an_edge_repeated_with_the_same_value_counts_once(tmp_path: Path) -> None:
    assert len(list(tree_of(tmp_path, ROS, ROS).edges())) == 3


def test_inverse_flips_an_entry(tmp_path: Path) -> None:
    tree = tree_of(tmp_path, "{name: b, parent: a, xyz: [1, 0, 0], rpy_deg: [0, 0, 90], inverse: true}")
    assert tree.lookup("a", "b").xyz.tolist() == [0.0, 1.0, 0.0]


@pytest.mark.parametrize("name", ["on", "no", "y", "007", "12:30", "2026-11-20", "null", "~", "1e3", "true", "a/b", "a::b"])
def test_names_stay_as_they_are_written(tmp_path: Path, name: str) -> None:
    assert name in tree_of(tmp_path, f"frames:\n  world:\n    {name}: {{xyz: [1, 2, 3]}}\n").frames


@pytest.mark.parametrize(
    ("number", "value"), [("1e-3", 1e-3), ("-.5", -0.5), ("010", 10.0), ("1E5", 1e5), ("+.5", 0.5), ("08", 8.0)]
)
def test_numbers_are_decimal(tmp_path: Path, number: str, value: float) -> None:
    tree = tree_of(tmp_path, f"{{name: b, parent: a, xyz: [{number}, 0, 0]}}")
    assert tree.lookup("a", "b").xyz.tolist() == [value, 0.0, 0.0]


def test_a_byte_order_mark_changes_nothing(tmp_path: Path) -> None:
    for text in (NESTED.encode("utf-8-sig"), NESTED.encode("utf-16")):
        assert len(tree_of(tmp_path, text).frames) == 4


REFUSED = {
    "{name: b, parent: a, xyz: [0x10, 0, 0]}": "0.yaml:1:28: '0x10' is not a decimal number; write it in base ten",
    "{name: b, parent: a, xyz: ['1,5', 0, 0]}": "0.yaml:1:28: '1,5' has a decimal comma; write a point",
    "{name: b, parent: a, xyz_mm: [10cm, 0, 0]}": "0.yaml:1:31: '10cm' has a unit where a bare number is expected",
    "{name: b, parent: a, xyz: [10deg, 0, 0]}":
        "0.yaml:1:28: '10deg' is not a length; write metres, or a unit: 2cm, 20mm, 0.02m",
    "{name: b, parent: a, t: 0.5}": "0.yaml:1:25: expected the numbers of a position",
    "{name: b, child: c, parent: a}": "0.yaml:1:8: name is 'b' and child is 'c'; keep one",
    "{name: b, parent: a, xyz: {x: 1, q: 2}}": "0.yaml:1:34: unknown key 'q'; expected x, y, z",
    "{name: b, parent: a, rpy: [1:30, 0, 0]}": "0.yaml:1:28: '1:30' is not a decimal number; base 60 is not read",
    "{name: b, parent: a, rpy_deg: [pi, 0, 0]}": "0.yaml:1:32: 'pi' is in radians, but rpy_deg is in degrees",
    "{name: b, parent: a, rpy_rad: [90deg, 0, 0]}": "0.yaml:1:32: '90deg' is in degrees, but rpy_rad is in radians",
    "{name: b, parent: a, inverse: yes}": "0.yaml:1:31: inverse must be true or false, found 'yes'",
    "{name: b, parent: a, angles: grad}": "0.yaml:1:30: angles must be deg or rad, found 'grad'",
    "{name: b, parent: ~, xyz: [1, 2, 3]}":
        "0.yaml:1:19: parent must be a frame's name, found nothing; leave parent out or quote the name",
    "{name: b, parent: a, matrix: [[1, 0, 0], [0, 1]]}":
        "0.yaml:1:30: expected 3 rows of 3 numbers or 4 rows of 4, found 2 rows of lengths 3, 2",
    "{name: b, parent: a, matrix: [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], xyz: [1, 2, 3]}":
        "0.yaml:1:78: two positions in one entry disagree by 3 m; keep one",
    "{name: b, parent: a, axis_angle: {axis: [0, 0, 0], angle: 1}}":
        "0.yaml:1:34: axis 0 0 0 has no direction; give a non-zero one",
    "{name: b, parent: a, xyzw: [0, 0, 0, .nan]}": "0.yaml:1:38: '.nan' is not finite",
    "{name: b, xyz: [1, 2, 3]}": "0.yaml:1:1: frame 'b' has a pose but no parent",
    "{parent: b, xyz: [1, 2, 3]}": "0.yaml:1:1: missing name; an entry is {name: .., parent: .., xyz: [..], ..}",
    "frames: {a: {xyz: [1, 2, 3]}}":
        "0.yaml:1:14: 'xyz' is in place of a frame's name: a root has no pose, its keys are its children",
    "frames: {a: {b: {name: c}}}": "0.yaml:1:18: name is defined by the nesting; remove it",
    "frames: {c: {parent: b, name: d}}": "0.yaml:1:25: name is defined by the nesting; remove it",
    "frames: {c: {parent: b, x: 1, theta: 9m}}": "0.yaml:1:38: '9m' is not an angle: the units are deg and rad",
    "frames: {c: {parent: b, x: 1, roll: 9}}": "0.yaml:1:13: incomplete rotation: missing pitch, yaw beside roll",
    "frames: {a: {b: {xyz: [1, 2, 3], c: {}}}}":
        "0.yaml:1:34: frames below one with a pose are under children: {c: ..}",
    "frames: {a: {b: {children: [1]}}}": "0.yaml:1:28: expected the children as a mapping by name, found a list",
    "{frams: {}}":
        "0.yaml:1:1: no frame tree: expected frames:, transforms: or an entry with name: and parent:; found the keys 'frams' (frametool help frames)",
    "{frames: {}, angels: deg}": "0.yaml:1:14: unknown key 'angels' next to frames; expected angles",
    "transforms: [{child_frame_id: b, header: {frame_id: a}}]":
        "0.yaml:1:14: missing transform; a TransformStamped has header, child_frame_id, transform",
    "42": "0.yaml:1:1: expected a frame tree, found '42'",
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), REFUSED.items(), ids=list(REFUSED))
def test_what_is_no_tree_is_refused_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    assert refusal(tmp_path, text) == message


def test_a_clash_between_files_names_both(tmp_path: Path) -> None:
    message = refusal(tmp_path, "{name: b, parent: a, xyz: [0, 0, 1]}", "\n{name: b, parent: c, xyz: [0, 0, 1]}")
    assert message == "1.yaml:2:1: frame 'b' has two parents: 'a' (0.yaml:1) and 'c' (line 2)"


def test_a_cycle_is_an_error_of_topology(tmp_path: Path) -> None:
    with pytest.raises(BadTopology, match="frames form a cycle"):
        tree_of(tmp_path, "[{name: b, parent: a, xyz: [0, 0, 0]}, {name: a, parent: b, xyz: [0, 0, 0]}]")


def test_a_chain_of_many_frames_in_any_order_is_read(tmp_path: Path) -> None:
    entries = [f"- {{name: f{n + 1}, parent: f{n}, xyz: [1, 0, 0]}}" for n in range(3000)]
    for order in (entries, entries[::-1], entries[::7] + [each for n, each in enumerate(entries) if n % 7]):
        tree = tree_of(tmp_path, "\n".join(order))
        assert tree.lookup("f0", "f3000").xyz.tolist() == [3000.0, 0.0, 0.0]


def test_a_deeply_nested_tree_is_read(tmp_path: Path) -> None:
    text = "frames: {root: {f0: " + "".join(f"{{children: {{f{n + 1}: " for n in range(400)) + "{xyz: [1, 0, 0]}" + "}}" * 400 + "}}"
    with pytest.warns(UserWarning, match="neither position nor rotation|more like these"):
        tree = tree_of(tmp_path, text)
    assert tree.lookup("root", "f400").xyz.tolist() == [1.0, 0.0, 0.0]


def test_rotations_that_agree_may_stand_together() -> None:
    text = "{rpy_deg: [0, 0, 90], axis_angle: {axis: [0, 0, 1], angle: pi/2}, quaternion: {x: 0, y: 0, z: 1, w: 1.0000001}}"
    (pose,) = poses_in(text, normalize=True)
    assert pose.rotation == (0.0, 0.0, 0.7071067811865476, 0.7071067811865476)


@pytest.mark.parametrize(
    "text",
    ["{rpy: [90deg, 0, 0]}", "{rpy: [pi/2, 0, 0]}", "{angles: deg, rpy: [90, 0, 0]}", "{euler_deg: {axes: rxyz, angles: [90, 0, 0]}}",
     "{rotvec_deg: [90, 0, 0]}", "{rotvec: [pi/2, 0, 0]}", "{axis_angle_deg: {axis: [2, 0, 0], angle: 90}}"],
)  # fmt: skip
def test_a_quarter_turn_is_exact_however_it_is_written(text: str) -> None:
    assert poses_in(text)[0].rotation == (0.7071067811865476, 0.0, 0.0, 0.7071067811865476)


def test_millimetres_round_once() -> None:
    assert poses_in("{xyz_mm: [100, 0.1, 3]}")[0].position == (0.1, 0.0001, 0.003)


def poses_of(value: Any) -> list[Any]:
    """Read the poses of a value written as JSON."""
    return poses_in(json.dumps(value))


def test_a_ros_pose_and_a_matrix_are_poses() -> None:
    (pose,) = poses_of({"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}})
    assert pose.components == (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)
    (pose,) = poses_of([[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    assert pose.components == (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)
