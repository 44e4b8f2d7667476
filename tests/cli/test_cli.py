"""The commands from outside: what is printed where, and with which exit code."""

from __future__ import annotations

import json
import math
import shlex
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from frametool import Transform
from frametool.cli.commands import COMMANDS

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

ARM = """\
angles: deg
frames:
  world:
    base: {xyz: [1, 2, 0.5], rpy: [0, 0, 90]}
    tool:
      xyz: [0, 0, 1]
      children: {tip: {xyz_mm: [0, 0, 250], rpy: {pitch: 180}}}
"""


def mapping(outcome: Outcome) -> Any:
    """Give what a command printed as YAML."""
    assert (outcome.status, outcome.err) == (0, "")
    return yaml.safe_load(outcome.out)


# --- what the transform tutorial teaches ---------------------------------------------------------------------------


def test_half_a_turn_about_x_in_radians_leaves_the_cosine_of_the_double_nearest_to_pi_half(run: Run) -> None:
    result = mapping(run("convert", "--from", "axis_angle", "1", "0", "0", "3.141592653589793"))
    assert result["quaternion"] == {"x": 1.0, "y": 0.0, "z": 0.0, "w": 6.123233995736766e-17}


@pytest.mark.parametrize("angle", ["180deg", "pi", "180 deg"])
def test_half_a_turn_about_x_is_exact_in_degrees_and_as_pi(run: Run, angle: str) -> None:
    result = mapping(run("convert", "--from", "axis_angle", "1", "0", "0", angle))
    assert result["quaternion"] == {"x": 1.0, "y": 0.0, "z": 0.0, "w": 0.0}


def test_half_turns_about_x_and_z_make_one_about_y(run: Run) -> None:
    r1, r2 = "{axis_angle: {axis: [1, 0, 0], angle: 180deg}}", "{axis_angle: {axis: [0, 0, 1], angle: 180deg}}"
    result = mapping(run("compose", r1, r2, "--keep-sign"))
    assert result["quaternion"] == {"x": 0.0, "y": -1.0, "z": 0.0, "w": 0.0}


def test_a_rotation_times_its_inverse_is_one(run: Run) -> None:
    turned = "{axis_angle: {axis: [-1, 0, 1], angle: 1.2}}"
    inverse = run("invert", turned, "--format", "json").out
    result = mapping(run("compose", turned, "-", stdin=inverse))
    assert result["quaternion"] == pytest.approx({"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}, abs=1e-16)


def test_an_axis_of_any_length_is_accepted(run: Run) -> None:
    result = mapping(run("convert", "--from", "axis_angle", "-1", "0", "1", "90deg", "--to", "axis_angle_deg"))
    half = math.sqrt(0.5)
    assert result["axis_angle_deg"] == {"axis": pytest.approx([-half, 0.0, half]), "angle": pytest.approx(90.0)}


def test_the_tutorials_transform_is_printed_as_ros_prints_it(run: Run) -> None:
    pose = "{xyz: [1, 2, 3], axis_angle: {axis: [1, 0, 0], angle: 3.141592653589793}, name: tool, parent: world}"
    assert run("convert", pose, "--format", "ros2").out == (
        "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: world\nchild_frame_id: tool\ntransform:\n"
        "  translation:\n    x: 1.0\n    y: 2.0\n    z: 3.0\n"
        "  rotation:\n    x: 1.0\n    y: 0.0\n    z: 0.0\n    w: 6.123233995736766e-17\n---\n"
    )
    assert run("convert", pose, "--format", "ros1").out == (
        'header: \n  seq: 0\n  stamp: \n    secs: 0\n    nsecs:         0\n  frame_id: "world"\n'
        'child_frame_id: "tool"\ntransform: \n  translation: \n    x: 1.0\n    y: 2.0\n    z: 3.0\n'
        "  rotation: \n    x: 1.0\n    y: 0.0\n    z: 0.0\n    w: 6.123233995736766e-17\n---\n"
    )


def test_zyx_angles_give_the_closed_form_matrix(run: Run) -> None:
    a, b, c = 0.3, -0.7, 1.1
    result = mapping(run("convert", f"{{euler: {{axes: rzyx, angles: [{a}, {b}, {c}]}}}}", "--to", "matrix"))
    (ca, cb, cc), (sa, sb, sc) = ([f(angle) for angle in (a, b, c)] for f in (math.cos, math.sin))
    expected = [
        [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
        [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
        [-sb, cb * sc, cb * cc],
    ]
    for row, wanted in zip(result["matrix"], expected, strict=True):
        assert row == pytest.approx(wanted, abs=1e-15)


def test_a_homogeneous_matrix_times_a_point_is_apply(run: Run) -> None:
    pose = "{xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]}"
    rows = mapping(run("convert", pose, "--to", "matrix"))["matrix"]
    point = [0.5, -1.0, 2.0]
    moved = mapping(run("apply", "--transform", pose, *map(str, point)))["point"]
    assert moved == pytest.approx([sum(a * b for a, b in zip(row, [*point, 1.0], strict=True)) for row in rows[:3]])


# --- the commands on a tree ----------------------------------------------------------------------------------------


def test_lookup_prints_a_tree_entry_that_reads_back_to_the_same_bits(run: Run) -> None:
    for form in ("yaml", "json"):
        first = run("lookup", "arm.yaml", "base", "tip", "--format", form, files={"arm.yaml": ARM}).out
        assert run("lookup", "-", "base", "tip", "--format", form, stdin=first).out == first


def test_lookup_invert_compose_go_through_a_pipe(run: Run) -> None:
    there = run("lookup", "arm.yaml", "base", "tip", files={"arm.yaml": ARM}).out
    back = run("invert", "-", stdin=there).out
    assert yaml.safe_load(back)["name"] == "base"
    result = mapping(run("compose", "-", there.replace("\n", ", ").join("{}"), stdin=back))
    assert result["name"] == result["parent"] == "tip"
    assert result["xyz"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)


def test_a_rotation_of_90_degrees_moves_points_exactly(run: Run) -> None:
    result = run("apply", "arm.yaml", "world", "base", "1", "0", "0", "--format", "json", files={"arm.yaml": ARM})
    assert json.loads(result.out) == {"frame": "world", "point": [1.0, 3.0, 0.5]}


def test_vectors_rotate_and_points_also_shift(run: Run) -> None:
    records = ["{frame: tip, vector: [0, 0, 1]}", '{"frame": "tip", "point": {"x": 0, "y": 0, "z": 1}}']
    result = run("apply", "arm.yaml", "world", *records, "--format", "json", files={"arm.yaml": ARM})
    vector, point = map(json.loads, result.out.splitlines())
    assert vector == {"frame": "world", "vector": [0.0, 0.0, -1.0]}
    assert point == {"frame": "world", "point": [0.0, 0.0, 0.25]}


def test_trees_are_merged_and_found_through_the_environment(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    more = "{name: camera, parent: tip, xyz: [0.1, 0, 0]}"
    monkeypatch.setenv("FRAMETOOL_TREE", "arm.yaml")
    result = mapping(run("lookup", ".", "tip", "camera", "--with", "more.yaml", files={"arm.yaml": ARM, "more.yaml": more}))
    assert result["xyz"] == [0.1, 0.0, 0.0]


@pytest.mark.parametrize("form", ["yaml", "json", "ros1", "ros2"])
def test_a_tree_written_reads_back_as_the_same_tree(run: Run, form: str) -> None:
    names = "frames: {'a\"b': {'on': {xyz: [1, 0, 0]}, '007': {rpy_deg: [0, 0, 90]}, 'x y\\z': {}, '12:30': {}}}"
    first = run("tree", "odd.yaml", "--format", form, files={"odd.yaml": names}).out
    again = run("tree", "-", "--format", form, stdin=first)
    assert (again.status, again.out, again.err) == (0, first, "")


def test_dot_and_mermaid_quote_what_is_special_to_them(run: Run) -> None:
    tree = 'frames: {"a\\"b": {"c\\\\d|<e>": {xyz: [1, 2, 3]}}}'
    dot = run("tree", "-", "--format", "dot", stdin=tree).out
    assert '"a\\"b" -> "c\\\\d|<e>" [label="xyz 1 2 3\\nrpy_deg 0 0 0"];' in dot
    mermaid = run("tree", "-", "--format", "mermaid", stdin=tree).out
    assert 'n1["c#92;d#124;#60;e#62;"]' in mermaid
    assert 'n0 -->|"xyz 1 2 3<br>rpy_deg 0 0 0"| n1' in mermaid


def test_the_text_for_a_person_says_which_frame_in_which_and_every_notation(run: Run) -> None:
    text = run("lookup", "arm.yaml", "world", "base", "--format", "text", files={"arm.yaml": ARM}).out
    assert text.splitlines() == [
        "base seen from world  (maps points in base to points in world)",
        "  translation     x 1.000000     y  2.000000   z  0.500000  m",
        "  quaternion      x 0.000000     y  0.000000   z  0.707107     w 0.707107",
        "  rpy          roll 0.000000 pitch  0.000000 yaw  1.570796  rad",
        "  rpy          roll 0.000000 pitch  0.000000 yaw 90.000000  deg",
        "  axis-angle      x 0.000000     y  0.000000   z  1.000000 angle 1.570796  rad",
        "  matrix            0.000000       -1.000000      0.000000       1.000000",
        "                    1.000000        0.000000      0.000000       2.000000",
        "                    0.000000        0.000000      1.000000       0.500000",
    ]


# --- numbers in and out --------------------------------------------------------------------------------------------


def test_gimbal_lock_is_data_and_one_note(run: Run) -> None:
    outcome = run("convert", "{rpy_deg: [10, 90, 0]}", "--to", "rpy_deg", "--format", "json")
    assert json.loads(outcome.out) == {"rpy_deg": {"roll": 10.0, "pitch": 90.0, "yaw": 0.0}, "gimbal_lock": True}
    assert outcome.err == "frametool: note: gimbal lock: the angles are not unique; the third was set to 0\n"


def test_deg_is_for_bare_angles_in_and_out(run: Run) -> None:
    result = mapping(run("convert", "--from", "rpy", "0", "0", "90", "--deg", "--to", "rpy,rotvec"))
    assert result == {"rpy_deg": {"roll": 0.0, "pitch": 0.0, "yaw": 90.0}, "rotvec_deg": [0.0, 0.0, 90.0]}


def test_deg_does_not_touch_the_angles_of_a_tree(run: Run) -> None:
    tree = "{name: b, parent: a, rpy: [0, 0, pi/2]}"
    result = mapping(run("lookup", "-", "a", "b", "--deg", "--to", "rpy", stdin=tree))
    assert result["rpy_deg"]["yaw"] == 90.0


def test_precision_fixes_the_decimals(run: Run) -> None:
    out = run("convert", "{xyz: [1, 2, 3], rpy_deg: [0, 0, 30]}", "--precision", "3", "--format", "csv").out
    assert out == "x,y,z,qx,qy,qz,qw\n1.000,2.000,3.000,0.000,0.000,0.259,0.966\n"


def test_the_sign_of_a_quaternion_is_canonical_unless_kept(run: Run) -> None:
    numbers = ["--from", "quaternion", "0", "0", "-0.6", "-0.8"]
    assert mapping(run("convert", *numbers))["quaternion"] == {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8}
    kept = mapping(run("convert", *numbers, "--keep-sign"))["quaternion"]
    assert kept == {"x": 0.0, "y": 0.0, "z": -0.6, "w": -0.8}


@pytest.mark.parametrize("number", ["-1e-3", "-.5", "-0.25", "-1"])
def test_negative_numbers_are_arguments(run: Run, number: str) -> None:
    assert mapping(run("apply", "--transform", "{xyz: [0, 0, 0]}", number, "0", number))["point"] == [
        float(number), 0.0, float(number),
    ]  # fmt: skip


def test_interpolation_takes_the_shorter_arc_and_meets_its_ends(run: Run) -> None:
    a, b = "{rpy_deg: [0, 0, 170]}", "{xyz: [2, 0, 0], rpy_deg: [0, 0, -170]}"
    out = run("interpolate", a, b, "0", "0.5", "1", "--to", "rpy_deg", "--format", "json").out
    yaws = [json.loads(line)["rpy_deg"]["yaw"] for line in out.splitlines()]
    assert yaws == pytest.approx([170.0, -180.0, -170.0])  # half a turn is written by the sign of what rounding left


def test_relative_says_distance_and_angle(run: Run) -> None:
    result = mapping(run("relative", "{xyz: [1, 0, 0]}", "{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}"))
    assert (result["xyz"], result["distance"], result["angle_deg"]) == ([0.0, 2.0, 0.0], 2.0, 90.0)


def test_several_poses_in_a_stream_are_taken_one_by_one(run: Run) -> None:
    stream = "{xyz: [1, 0, 0]}\n---\n{xyz: [2, 0, 0]}\n"
    out = run("compose", "-", "{xyz: [0, 1, 0]}", "--format", "json", stdin=stream).out
    assert [json.loads(line)["xyz"] for line in out.splitlines()] == [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0]]


# --- what goes wrong -----------------------------------------------------------------------------------------------

QUATERNION = "quaternion -1 0 1 0 has norm 1.41421; a rotation needs norm 1 (normalize it with --normalize)"
WRONG = {
    ("convert --from quaternion -1 0 1 0", 1): QUATERNION,
    ("convert '{xyzw: [-1,0,1,0]}'", 1): f"argument:1:8: {QUATERNION}",
    ("convert --from quaternion 0 0 0 0 --normalize", 1): "quaternion 0 0 0 0 has no direction; give a non-zero one",
    ("convert --from quaternion nan 0 0 1", 1): "'nan' is not finite",
    ("convert --from quaternion 0 0 0 -inf", 1): "'-inf' is not finite",
    ("convert --from matrix 1 0 0 0 1 0 0 0 -1", 1):
        "matrix has determinant -1: it is left-handed (mirrored); a rotation has 1",
    ("convert --from quaternion 0 0 foo 1", 2):
        "convert: 'foo' is not a number; `frametool convert --help` shows the options",
    ("convert --from rpy 1 2", 2):
        "convert: rpy has 3 numbers (roll pitch yaw), or 6 with x y z before them; found 2; "
        "`frametool convert --help` shows the options",
    ("convert '{rpi: [1,2,3]}'", 2):
        "argument:1:2: unknown key 'rpi', did you mean 'rpy'?; a pose has xyz and one rotation: quaternion, xyzw, "
        "wxyz, rpy, euler, axis_angle, rotvec, matrix, mrp, six_d",
    ("convert '{quaternion: [1,0,0,0]}'", 2):
        "argument:1:14: quaternion [1, 0, 0, 0] has no order; write xyzw: [..], wxyz: [..] or {x:, y:, z:, w:}",
    ("convert '{xyz: [1,2]}'", 2): "argument:1:7: expected 3 numbers (x y z), found 2",
    ("convert '{xyz: [1,2,x]}'", 2): "argument:1:12: 'x' is not a number",
    ("convert '{rpy_deg: [0,0,1], rotvec: [0,0,1]}'", 1):
        "argument:1:28: two rotations in one entry disagree by 56.2958 degrees; keep one",
    ("convert {xyz:[1,2,3]}", 2): "argument:1:5: found unexpected ':'; write a blank after the colon",
    ("convert missing.yaml", 5): "missing.yaml: no such file or directory",
    ("lookup . a b", 2):
        "lookup: TREE is . but FRAMETOOL_TREE is not set; name a file; "
        "`frametool lookup --help` shows the options",
    ("lookup arm.yaml base tpi", 4):
        "unknown frame 'tpi' in arm.yaml; did you mean 'tip'? frames: base, tip, tool, world",
    ("lookup arm.yaml nope nope", 4): "unknown frame 'nope' in arm.yaml; frames: base, tip, tool, world",
    ("lookup two.yaml a d", 4): "'a' and 'd' are not connected: 'a' hangs from root 'a', 'd' from root 'c'",
    ("lookup folder a b", 5): "folder: is a directory",
    ("lookup empty.yaml a b", 1): "empty.yaml: no frames in it",
    ("lookup binary.yaml a b", 1):
        "binary.yaml: not text but a PNG picture",
    ("lookup parents.yaml a b", 1):
        "parents.yaml:3:5: frame 'tool' has two parents: 'wrist' (line 2) and 'flange' (line 3)",
    ("lookup values.yaml a b", 1): "values.yaml:2:1: frame 'b' has two different poses in 'a': line 1 and line 2",
    ("lookup cycle.yaml a b", 1): "cycle.yaml:4:5: frames form a cycle: c <- a <- b <- c",
    ("lookup self.yaml a b", 1): "self.yaml:1:1: frame 'a' is its own parent",
    ("lookup duplicate.yaml a b", 1): "duplicate.yaml:3:3: key 'b' appears twice; first at 2:3",
    ("lookup keys.yaml a b", 1):
        "keys.yaml:1:22: unknown key 'xzy', did you mean 'xyz'?; a pose has xyz and one rotation: quaternion, xyzw, "
        "wxyz, rpy, euler, axis_angle, rotvec, matrix, mrp, six_d",
    ("lookup rows.yaml a b", 1): "rows.yaml:1:30: the last row of a 4x4 pose is 0 0 0 1, found 0 0 0 2",
    ("compose '{name: b, parent: a, xyz: [0,0,0]}' '{name: d, parent: c, xyz: [0,0,0]}'", 1):
        "frames do not touch: a <- b is followed by c <- d; change the order, or invert one",
    ("loookup arm.yaml a b", 2): "no command 'loookup'; did you mean 'lookup'?",
    ("transform arm.yaml a b", 2):
        "no command 'transform'; `frametool --help` lists all, `frametool help WORD` searches",
    ("arm.yaml base tip", 2): "no command 'arm.yaml'; a file follows a command: frametool tree arm.yaml",
    ("lookup arm.yaml base", 2):
        "lookup: missing argument 'SOURCE'; `frametool lookup --help` shows the options",
    ("lookup arm.yaml base tip --presicion 3", 2):
        "lookup: no such option '--presicion'; did you mean '--precision'? "
        "`frametool lookup --help` shows the options",
    ("convert --from ryp 0 0 0", 2): "convert: invalid value for '--from': unknown representation 'ryp'; "
        "did you mean 'rpy'? representations: ",
    ("convert --from euler:zzx 0 0 0", 2): "convert: invalid value for '--from': unknown Euler axes 'zzx'; s (static axes) or r (rotating axes) and three "
        "letters, such as rzyx; `frametool convert --help` shows the options",
    (f"lookup '{{frames: {{a: {{{', '.join(f'{name}: {{xyz: [0, 0, 1]}}' for name in 'bcdefg')}}}}}}}' a x", 4):
        "unknown frame 'x' in argument; frames: a, b, c, d, e and 2 more",
    ("convert --from euler 0 0 0", 2): "convert: invalid value for '--from': euler needs its axes: ",
    ("convert 1 2 3", 2): "convert: 3 numbers do not say what they are; add --from with one of ",
    ("convert --from rpy 0 0 0 -o there.yaml", 5): "there.yaml: exists; give --force to replace it",
    ("convert --from rpy 0 0 0 -o folder/no/file", 5): "folder/no/file: no such file or directory",
}  # fmt: skip
FILES = {
    "arm.yaml": ARM,
    "two.yaml": "frames: {a: {b: {xyz: [0, 0, 0]}}, c: {d: {xyz: [0, 0, 0]}}}",
    "empty.yaml": "# nothing\n---\n",
    "binary.yaml": b"\x89PNG\r\n\x1a\n\x00",
    "parents.yaml": "frames:\n  - {name: tool, parent: wrist, xyz: [0, 0, 0]}\n  - {name: tool, parent: flange, xyz: [0, 0, 0]}",
    "values.yaml": "[{name: b, parent: a, xyz: [0, 0, 0]},\n{name: b, parent: a, xyz: [0, 0, 1]}]",
    "cycle.yaml": "frames:\n  - {name: b, parent: a, xyz: [0, 0, 0]}\n  - {name: c, parent: b, xyz: [0, 0, 0]}\n"
    "  - {name: a, parent: c, xyz: [0, 0, 0]}",
    "self.yaml": "{name: a, parent: a, xyz: [0, 0, 0]}",
    "duplicate.yaml": "frames:\n  b: {}\n  b: {}\n",
    "keys.yaml": "{name: b, parent: a, xzy: [0, 0, 0]}",
    "rows.yaml": "{name: b, parent: a, matrix: [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,2]]}",
    "there.yaml": "",
}


@pytest.mark.parametrize(("call", "message"), WRONG.items(), ids=[line for line, _ in WRONG])
def test_what_is_wrong_is_said_in_one_line_with_its_exit_code(
    run: Run, call: tuple[str, int], message: str, tmp_path: Any
) -> None:
    (tmp_path / "folder").mkdir()
    outcome = run(*shlex.split(call[0]), files=FILES)
    assert outcome.err.splitlines()[0].startswith(f"frametool: {message}")
    assert (outcome.status, outcome.out) == (call[1], "")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_that_leads_with_examples_and_ends_with_exit_codes(run: Run, name: str) -> None:
    text = run(name, "--help").out
    assert text.startswith(f"Usage: frametool {name}")
    assert text.index(f"    frametool {name} ") < text.index("Options:")
    assert "Exit codes: 0 " in text


def test_a_warning_names_its_place_and_does_not_stop_the_work(run: Run) -> None:
    tree = "frames:\n  - {name: b, parent: /a, rpy: [0, 0, 90]}\n  - {name: c, parent: b}\n"
    outcome = run("lookup", "warn.yaml", "a", "c", files={"warn.yaml": tree})
    assert outcome.status == 0
    assert outcome.err.splitlines() == [
        "frametool: warning: warn.yaml:2:39: rpy 90 is more than a full turn in radians; degrees? write rpy_deg",
        "frametool: warning: warn.yaml:2:5: frame '/a': the leading / is no part of a name and was left out",
        "frametool: warning: warn.yaml:3:5: frame 'c' has neither position nor rotation: taken as the identity",
    ]


def test_a_quaternion_nearly_of_norm_1_is_normalised_with_a_warning(run: Run) -> None:
    outcome = run("convert", "--from", "quaternion", "0", "0", "0.7068", "0.7071")
    assert outcome.status == 0
    assert "has norm 0.999778 and was normalised" in outcome.err


def test_what_a_file_holds_nearly_normalised_is_told_with_its_place(run: Run) -> None:
    text = "frames:\n  - {name: b, parent: a, xyzw: [0, 0, 0.7068, 0.7071]}\n"
    outcome = run("lookup", "near.yaml", "a", "b", files={"near.yaml": text})
    assert outcome.status == 0
    message = "quaternion 0 0 0.7068 0.7071 has norm 0.999778 and was normalised"
    assert outcome.err == f"frametool: warning: near.yaml:2:5: {message}\n"


@pytest.mark.parametrize(
    ("arguments", "yaw_pitch_roll"),
    [
        (["--axes", "optical"], [-90.0, 0.0, -90.0]),
        (["{axes: optical}"], [-90.0, 0.0, -90.0]),
        (["{rpy_deg: [0, 0, 90]}", "--axes", "frd"], [90.0, 0.0, 180.0]),
        (["{axes: ned_from_enu}"], [90.0, 0.0, 180.0]),
    ],
)
def test_axes_of_the_field_have_names(run: Run, arguments: list[str], yaw_pitch_roll: list[float]) -> None:
    assert mapping(run("convert", *arguments, "--to", "euler_deg:rzyx"))["euler_deg"]["angles"] == yaw_pitch_roll


def test_axes_without_such_a_name_are_misuse(run: Run) -> None:
    outcome = run("convert", "--axes", "optcal")
    assert outcome.status == 2
    assert "unknown axes 'optcal'; did you mean 'optical'? axes: flu, frd, optical, opengl, enu, ned" in outcome.err


def test_a_position_alone_is_a_pose_without_a_turn(run: Run) -> None:
    assert mapping(run("convert", "{xyz: [1, 2, 3]}", "--to", "rpy")) == {
        "xyz": [1.0, 2.0, 3.0], "rpy": {"roll": 0.0, "pitch": 0.0, "yaw": 0.0},
    }  # fmt: skip


@pytest.mark.parametrize("form", ["yaml", "json"])
@pytest.mark.parametrize("seed", range(20))
def test_what_is_printed_reads_back_to_the_same_bits(run: Run, form: str, seed: int) -> None:
    pose = Transform.random(seed=seed)
    text = json.dumps({"xyz": pose.xyz.tolist(), "quaternion": dict(zip("xyzw", pose.xyzw.tolist(), strict=True))})
    first = run("convert", text, "--format", form).out
    assert run("convert", "-", "--format", form, stdin=first).out == first


# --- what a hostile user found once --------------------------------------------------------------------------------


def test_nothing_where_a_coordinate_is_expected_is_an_error(run: Run) -> None:
    outcome = run("convert", '{"xyz": [null, 0, 0]}')
    assert (outcome.status, outcome.err.splitlines()[0]) == (2, "frametool: argument:1:10: expected a number, found nothing")


@pytest.mark.parametrize("form", ["json", "csv", "yaml", "ros2", "text"])
def test_a_result_too_large_for_a_double_is_refused_in_every_form(run: Run, form: str) -> None:
    far = '{"xyz": [1e308, 0, 0]}'
    outcome = run("compose", far, far, "--format", form)
    assert (outcome.status, outcome.out) == (1, "")
    assert "not finite" in outcome.err


def test_as_point_takes_a_vector_for_a_point(run: Run) -> None:
    out = run("apply", "--transform", "{xyz: [1, 1, 1]}", "{vector: [1, 2, 3]}", "--as", "point", "--format", "json").out
    assert json.loads(out) == {"point": [2.0, 3.0, 4.0]}


def test_a_link_is_followed_and_a_mode_is_kept(run: Run, tmp_path: Any) -> None:
    target = tmp_path / "private.yaml"
    target.write_text("old")
    target.chmod(0o600)
    (tmp_path / "link.yaml").symlink_to(target)
    assert run("convert", "--from", "rpy", "0", "0", "0", "-o", "link.yaml", "--force").status == 0
    assert target.read_text().startswith("quaternion:")
    assert (target.stat().st_mode & 0o777, (tmp_path / "link.yaml").is_symlink()) == (0o600, True)


@pytest.mark.parametrize("form", ["ros1", "ros2"])
def test_a_pose_without_names_goes_through_ros_text(run: Run, form: str) -> None:
    text = run("convert", "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}", "--format", form).out
    assert json.loads(run("convert", "-", "--format", "json", stdin=text).out)["xyz"] == [1.0, 2.0, 3.0]


def test_a_tree_too_deep_to_draw_and_a_long_cycle_are_told_shortly(run: Run) -> None:
    chain = "\n".join(f"- {{name: f{n + 1}, parent: f{n}, xyz: [0, 0, 1]}}" for n in range(1500))
    outcome = run("tree", "-", "--format", "text", stdin=chain)
    assert (outcome.status, len(outcome.err) < 200) == (1, True)
    outcome = run("tree", "-", stdin=f"{chain}\n- {{name: f0, parent: f1500, xyz: [0, 0, 1]}}")
    assert outcome.status == 1
    assert "(1486 more)" in outcome.err


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("frames:\n  - name: b\n    parent:\u00a0a\n    xyz: [0, 0, 0]\n", "no-break space (U+00A0), invisible"),
        ("frames:\n  a:\n    b:\n      xyz:1.5\n      rpy: [0, 0, 0]\n", "write a blank after 'xyz:'"),
        ("{name: b, parent: a, rpy: [${radians(90)}, 0, 0]}", "is this xacro? expand it first"),
    ],
)
def test_what_a_person_does_not_see_is_named(run: Run, text: str, hint: str) -> None:
    outcome = run("lookup", "-", "a", "b", stdin=text)
    assert outcome.status == 1
    assert hint in outcome.err.splitlines()[0]


def test_control_characters_in_names_do_not_reach_the_terminal(run: Run) -> None:
    tree = 'frames: {"a\\e[31m": {b: {xyz: [0, 0, 0]}}}'
    assert "\x1b" not in run("tree", "-", "--format", "text", stdin=tree).out
    assert "\x1b" not in run("lookup", "-", "b", "c", stdin=tree).err


def test_three_letters_of_euler_axes_name_both_readings(run: Run) -> None:
    err = run("convert", "--from", "euler:zyx", "0", "0", "0").err
    assert "did you mean rzyx (rotating axes, intrinsic) or szyx (static axes, extrinsic)?" in err
