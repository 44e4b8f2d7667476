"""Extrinsics as people write them by hand: the words for a pose, what is told, what is asked, what is refused."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from frametool.errors import Unanswered
from frametool.formats.detect import detect
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

HALF = "0.7071067811865476"
TURNS = [  # each is a quarter turn about z
    "roll: 0, pitch: 0, yaw: 1.5707963267948966",
    "roll_deg: 0, pitch_deg: 0, yaw_deg: 90",
    "yaw: 90deg",
    "yaw_deg: 90",
    "theta: 1.5707963267948966",
    "rpy: [0, 0, 1.5707963267948966]",
    "rpy_deg: [0, 0, 90]",
    "rotation: {roll: 0, pitch: 0, yaw: 1.5707963267948966}",
    "ax: 0, ay: 0, az: 1, theta: 1.5707963267948966",
    "ax: 0, ay: 0, az: 2, angle_deg: 90",
    f"qx: 0, qy: 0, qz: {HALF}, qw: {HALF}",
    f"q_w: {HALF}, q_x: 0, q_y: 0, q_z: {HALF}",
    f"rot_x: 0, rot_y: 0, rot_z: {HALF}, rot_w: {HALF}",
    f"quaternion: {{x: 0, y: 0, z: {HALF}, w: {HALF}}}",
    f"rotation: {{w: {HALF}, x: 0, y: 0, z: {HALF}}}",
    f"orientation: {{qx: 0, qy: 0, qz: {HALF}, qw: {HALF}}}",
    f"xyzw: [0, 0, {HALF}, {HALF}]",
    "rot: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]",
    "rotation: [0, -1, 0, 1, 0, 0, 0, 0, 1]",
    "rotvec: [0, 0, 1.5707963267948966]",
]
PLACES = [
    "x: 0.5, y: 2, z: -1",
    "tx: 0.5, ty: 2, tz: -1",
    "trans_x: 0.5, trans_y: 2, trans_z: -1",
    "x_mm: 500, y_mm: 2000, z_mm: -1000",
    "xyz: [0.5, 2, -1]",
    "translation: [0.5, 2, -1]",
    "position: {x: 0.5, y: 2, z: -1}",
    "trans: [0.5, 2, -1]",
    "t: [0.5, 2, -1]",
]
ORDERED = [  # asks for --from
    f"rot: [0, 0, {HALF}, {HALF}]",
    f"rotation: [0, 0, {HALF}, {HALF}]",
    f"quaternion: [0, 0, {HALF}, {HALF}]",
    f"q: [0, 0, {HALF}, {HALF}]",
]
POSE = "{name: lidar, parent: base, xyz: [0.5, 2.0, -1.0], rpy_deg: {roll: 0.0, pitch: 0.0, yaw: 90.0}}"
FIELDS = ("-f", "yaml", "--to", "rpy_deg", "--quiet")


def tree(run: Run, text: str, *options: str, name: str = "e.yaml") -> str:
    done = run("tree", name, *FIELDS, *options, files={name: text})
    assert (done.status, done.err) == (0, "")
    return str(done.out)


@pytest.mark.parametrize("turn", TURNS)
def test_a_rotation_in_any_word_is_the_same(run: Run, turn: str) -> None:
    assert tree(run, f"lidar: {{x: 0.5, y: 2, z: -1, {turn}}}\n").splitlines()[-1] == f"  - {POSE}"


@pytest.mark.parametrize("place", PLACES)
def test_a_position_in_any_word_is_the_same(run: Run, place: str) -> None:
    assert tree(run, f"# by hand\nlidar: {{yaw_deg: 90, {place}}}\n").splitlines()[-1] == f"  - {POSE}"
    block = place if "[" in place or "{" in place else place.replace(", ", "\n  ")
    assert tree(run, f"lidar:\n  yaw_deg: 90\n  {block}\n").splitlines()[-1] == f"  - {POSE}"


@pytest.mark.parametrize("turn", ORDERED)
def test_four_numbers_do_not_say_where_w_stands(run: Run, turn: str) -> None:
    text = f"lidar: {{trans: [0.5, 2, -1], {turn}}}\n"
    done = run("tree", "e.yaml", files={"e.yaml": text})
    assert (done.status, done.out) == (2, "")
    assert "does not state the position of w: give --from xyzw or --from wxyz, for all of the file" in done.err
    assert tree(run, text, "--from", "xyzw").splitlines()[-1] == f"  - {POSE}"
    swapped = text.replace(f"[0, 0, {HALF}, {HALF}]", f"[{HALF}, 0, 0, {HALF}]")
    assert tree(run, swapped, "--from", "wxyz").splitlines()[-1] == f"  - {POSE}"


@pytest.mark.parametrize("entry", ["{value: [..]}", "{pose: [..]}", "[..]"])
def test_seven_numbers_are_position_and_quaternion(run: Run, entry: str) -> None:
    seven = f"[0.5, 2, -1, 0, 0, {HALF}, {HALF}]"
    text = f"lidar: {entry.replace('[..]', seven)}\n"
    assert "give --from xyzw or --from wxyz" in run("tree", "e.yaml", files={"e.yaml": text}).err
    assert tree(run, text, "--from", "xyzw").splitlines()[-1] == f"  - {POSE}"


@pytest.mark.parametrize(
    "text",
    [
        "lidar: {parent: base, xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        "front: {parent: base, child: lidar, xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        "front: {frame_id: base, child_frame_id: lidar, xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        "front: {parent_frame: base, child_frame: lidar, xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        "transforms:\n- parent: base\n  child: lidar\n  xyz: [0.5, 2, -1]\n  yaw_deg: 90\n",
        "transforms:\n- {child: lidar, xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        "transforms:\n  lidar: {xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        "extrinsics:\n  lidar: {xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        "angles: deg\nlidar: {xyz: [0.5, 2, -1], yaw: 90}\n",
        "base_from_lidar: {xyz: [0.5, 2, -1], yaw_deg: 90}\n",
        '{"lidar": {"translation": [0.5, 2, -1], "rpy_deg": [0, 0, 90]}}',
    ],
)
def test_frames_are_named_by_keys_beside_the_pose_or_by_its_own(run: Run, text: str) -> None:
    assert tree(run, text) == f"frames:\n  - {{name: base}}\n  - {POSE}\n"


def test_an_entry_of_a_list_without_a_name_is_told_the_keys(run: Run) -> None:
    files = {"e.yaml": "transforms:\n- {from: base_link, to: camera, x: 1, y: 2, z: 3}\n"}
    done = run("tree", "e.yaml", "--in", "named", files=files)
    keys = "child_frame, child_frame_id, child; of its parent: parent_frame, parent_frame_id, frame_id, parent"
    said = f"missing child; in a list an entry names its frame; keys: {keys}"
    assert (done.status, said in done.err) == (1, True), done.err


def test_what_was_assumed_is_told_and_changed_by_frames(run: Run) -> None:
    text = "lidar: {x: 1, y: 0, z: 0, topic: /scan}\ncam: {parent: lidar, x: 0, y: 1, z: 0}\n"
    done = run("lookup", "e.yaml", "base", "cam", files={"e.yaml": text})
    assert done.err == "frametool: e.yaml: 1 pose in base (--frames says another); topic left out\n"
    assert "xyz: [1.0, 1.0, 0.0]" in done.out
    assert run("lookup", "e.yaml", "chassis", "cam", "--frames", "chassis").err == "frametool: e.yaml: topic left out\n"


def test_frames_that_change_nothing_are_told(run: Run) -> None:
    files = {"e.yaml": "a: {parent: w, xyz: [0, 0, 1], yaw: 0}\nb: {parent: w, xyz: [0, 0, 2], yaw: 0}\n"}
    said = "--frames map has no effect: each pose names its parent"
    assert said in run("tree", "e.yaml", "--frames", "map", files=files).err


def test_a_key_that_names_two_frames_asks_for_the_direction(run: Run) -> None:
    text = "base_to_left: {x: 1, y: 0, z: 0, ax: 0, ay: 0, az: 1, theta: 90deg}\n"
    done = run("tree", "e.yaml", files={"e.yaml": text})
    assert done.status == 2
    assert done.err.splitlines()[0] == (
        "frametool: e.yaml:1:1: 'base_to_left': the key does not say its direction: give --direction parent-from-child "
        "(takes points of left to base) or child-from-parent (of base to left)"
    )
    points = {
        direction: run("lookup", "e.yaml", "base", "left", "--direction", direction, "-f", "json", "--quiet").out
        for direction in ("parent-from-child", "child-from-parent")
    }
    assert '"xyz": [1.0, 0.0, 0.0]' in points["parent-from-child"]
    assert '"xyz": [0.0, 1.0, 0.0]' in points["child-from-parent"]


@pytest.mark.parametrize(
    "entry",
    [
        "rvec: [0, 0, 1.5707963267948966], tvec: [1, 0, 0]",
        "t: [1, 0, 0], R: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]",
        f"qvec: [{HALF}, 0, 0, {HALF}], tvec: [1, 0, 0]",
    ],
)
def test_the_words_of_opencv_ask_for_the_direction(run: Run, entry: str) -> None:
    files = {"e.yaml": f"cam: {{{entry}}}\n"}
    done = run("tree", "e.yaml", files=files)
    names = " and ".join(each.partition(":")[0] for each in entry.split(", ") if ":" in each)
    assert (done.status, done.out) == (2, "")
    assert f"'{names}': the key does not say its direction: give --direction parent-from-child" in done.err
    lookup = ("lookup", "e.yaml", "base", "cam", "-f", "json", "--quiet", "--direction")
    for direction, wanted in (("parent-from-child", [1.0, 0.0, 0.0]), ("child-from-parent", [0.0, 1.0, 0.0])):
        assert json.loads(run(*lookup, direction, files=files).out)["xyz"] == pytest.approx(wanted, abs=1e-15)
    files = {"e.yaml": f"cam: {{parent: base, {entry}}}\n"}
    assert run("lookup", "e.yaml", "base", "cam", files=files).status == 0


def test_a_tree_is_written_so_and_reads_back_to_the_same_bits(run: Run, tmp_path: Path) -> None:
    text = "frames: {map: {base: {xyz: [0.1, 0.2, 0.3], rpy: [0.1, -0.2, 0.3], children: {lidar: {xyz: [1, 0, 1e-7]}}}}}"
    done = run("tree", "t.yaml", "-f", "named", "-o", "n.yaml", files={"t.yaml": text})
    assert (done.status, done.err) == (0, "")
    assert run("diff", "t.yaml", "n.yaml", "--tolerance", "0m,0rad", "--quiet").status == 0
    assert run("tree", "t.yaml", "-f", "yaml").out == run("tree", "n.yaml", "-f", "yaml", "--quiet").out
    assert (tmp_path / "n.yaml").read_text().startswith("base: {parent: map, xyz: [0.1, 0.2, 0.3], quaternion: {x: ")


@pytest.mark.parametrize("fmt", ["named", "autoware"])
@pytest.mark.parametrize("name", ["arm::tip", "site:tip", "lidar top", "a,b", "#1", "a: b", "007", "it's", '"q"', "<a&b>", "{y}", "~"])
def test_it_is_recognised_whatever_its_frames_are_called(run: Run, fmt: str, name: str) -> None:
    source = json.dumps([{"name": name, "parent": f"{name}0", "xyz": [1, 2, 3]}])
    written = run("tree", "a.json", "-f", fmt, files={"a.json": source}).out
    assert run("tree", "b.yaml", "-f", "json", files={"b.yaml": written}).out == run("tree", "a.json", "-f", "json").out


def test_python_reads_it_with_the_same_answers(tmp_path: Path) -> None:
    (tmp_path / "e.yaml").write_text(f"lidar: {{trans: [0.5, 2, -1], rot: [{HALF}, 0, 0, {HALF}]}}\n")
    with pytest.raises(Unanswered, match="give --from xyzw or --from wxyz"):
        load(tmp_path / "e.yaml")
    found = load(tmp_path / "e.yaml", order="wxyz", frames=["car"]).lookup("car", "lidar")
    assert found.apply([1.0, 0.0, 0.0]) == pytest.approx((0.5, 3.0, -1.0))
    assert load(tmp_path / "e.yaml", order="wxyz", frames="car").frames == load(tmp_path / "e.yaml", order="wxyz", frames=["car"]).frames


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("roll: 1, pitch: 2", "1:4: incomplete rotation: missing yaw beside roll, pitch"),
        ("qx: 0, qy: 0, qz: 0", "1:4: incomplete rotation: missing w beside x, y, z"),
        ("rot_x: 0, rot_y: 0, rot_z: 0", "1:4: incomplete rotation: missing w beside x, y, z"),
        ("ax: 0, ay: 0, az: 1", "1:4: ax, ay, az and theta belong together: an axis and the angle about it"),
        ("rot: [1, 2, 3]", "1:28: rot [1, 2, 3] does not say what it is; write rpy: [..], rpy_deg: [..] or rotvec: [..]"),
        ("yaww: 1", "1:23: unknown key 'yaww'; a pose has xyz and one rotation: "),
        ("value: [1, 2]", "1:30: expected 7 numbers, found 2 numbers"),
        ("tx: 4", "1:23: tx repeats another key; keep one"),
        ("xyz: [1, 2, 3]", "1:23: xyz repeats another key; keep one"),
        ("yaw: fast", "1:28: 'fast' is not a number"),
        ("parent: b, frame_id: c", "1:23: frame_id and parent in one entry; keep one"),
        ("parent: a", "1:4: frame 'a' is its own parent"),
        ("quaternion: {x: 0, y: 0, z: 0, w: 0}", "1:35: quaternion 0 0 0 0 has no direction"),
    ],
)
def test_what_is_wrong_in_an_entry_names_its_place(run: Run, entry: str, message: str) -> None:
    done = run("tree", "e.yaml", files={"e.yaml": f"a: {{x: 1, y: 2, z: 3, {entry}}}\n"})
    assert (done.status, done.out) == (1, "")
    first = done.err.splitlines()[0]
    assert first.startswith(f"frametool: e.yaml:{message}"), first
    assert len(first) <= 200


@pytest.mark.parametrize(
    ("text", "form"),
    [
        ("position: {x: 1, y: 2, z: 3}\norientation: {x: 0, y: 0, z: 0, w: 1}\n", "yaml"),
        ("base: {lidar: {x: 1, y: 2, z: 3, roll: 0, pitch: 0, yaw: 0}}\n", "autoware"),
        ("name: a\nparent: b\nxyz: {x: 1, y: 2, z: 3}\n", "yaml"),
        ("frames:\n  a: {x: {xyz: [1, 2, 3]}}\n", "yaml"),
        ("transforms:\n- header: {frame_id: a}\n  child_frame_id: b\n  transform: {translation: {x: 1}}\n", "echo"),
        ("parameters: {eye_on_hand: true}\ntransformation: {x: 1, y: 2, z: 3, qx: 0, qy: 0, qz: 0, qw: 1}\n", "handeye"),
    ],
)
def test_what_has_a_form_of_its_own_keeps_it(text: str, form: str) -> None:
    assert detect(text.encode(), "tree", name="a.yaml") == form


def test_positions_alone_are_no_autoware(run: Run) -> None:
    done = run("tree", "e.yaml", files={"e.yaml": "base_link:\n  lidar: {x: 1, y: 2, z: 3}\n"})
    message = "frametool: e.yaml:2:10: missing roll, pitch, yaw; a pose has x, y, z, roll, pitch, yaw"
    assert done.err.splitlines()[0] == message


@pytest.mark.parametrize("command", [("tree", "t.yaml"), ("lookup", "t.yaml", "a", "b"), ("check", "t.yaml")])
def test_an_order_that_nothing_asks_for_is_refused(run: Run, command: tuple[str, ...]) -> None:
    done = run(*command, "--from", "xyzw", files={"t.yaml": "frames: {a: {b: {xyz: [1, 2, 3]}}}"})
    assert (done.status, done.out) == (2, "")
    assert "--from has no effect here" in done.err
