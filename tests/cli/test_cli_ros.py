"""echo, monitor, static, check and ROS messages in apply, from outside."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from frametool.grammar.result import Style
from frametool.lint.rules import RULES
from frametool.ros.messages import message_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

BILLION = 10**9
EPOCH = 1_700_000_000 * BILLION


def transform(parent: str, child: str, stamp_ns: int, x: float = 0.0, turn: float = 0.0) -> dict[str, Any]:
    """Give a transform at x, turned about z by radians."""
    stamp = dict(zip(("sec", "nanosec"), divmod(stamp_ns, BILLION), strict=True))
    rotation = {"x": 0.0, "y": 0.0, "z": math.sin(turn / 2), "w": math.cos(turn / 2)}
    inner = {"translation": {"x": x, "y": 0.0, "z": 0.0}, "rotation": rotation}
    return {"header": {"stamp": stamp, "frame_id": parent}, "child_frame_id": child, "transform": inner}


def dump(*transforms: dict[str, Any], form: str = "ros2") -> str:
    return "".join(message_text({"transforms": [each]}, Style(form)) for each in transforms)


DRIVE = dump(*(transform("map", "base", EPOCH + at * BILLION // 10 + 1, 0.1 * at) for at in range(21)))
STATIC = dump(transform("base", "cam", EPOCH, 0.5))
FILES = {"tf.txt": DRIVE, "tf_static.txt": STATIC}
BOTH = ("tf.txt", "--with", "tf_static.txt")


# --- lookups in recordings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["json", "yaml", "ros1", "ros2", "foxglove", "csv"])
def test_a_stamp_of_nanoseconds_comes_out_exact_in_every_form(run: Run, form: str) -> None:
    found = run("lookup", *BOTH, "map", "cam", "--at", f"{EPOCH + 123456789}ns", "-f", form, files=FILES)
    assert (found.status, found.err) == (0, "")
    assert re.search(r"1700000000123456789|1700000000\D+123456789\b", found.out)


@pytest.mark.parametrize("form", ["ros1", "ros2", "foxglove", "static2", "yaml", "json"])
def test_what_is_written_of_a_lookup_is_a_tree_again(run: Run, form: str) -> None:
    written = run("lookup", *BOTH, "map", "cam", "--at", "1700000000.5", "-f", form, files=FILES).out
    again = json.loads(run("lookup", "-", "map", "cam", "-f", "json", stdin=written).out)
    assert again["xyz"] == pytest.approx([0.999999999, 0.0, 0.0], abs=1e-9)


def test_files_and_standard_input_are_merged(run: Run) -> None:
    found = run("lookup", "-", "map", "cam", "--with", "tf_static.txt", "-f", "json", stdin=DRIVE, files=FILES)
    assert json.loads(found.out)["xyz"] == [2.5, 0.0, 0.0]


def test_what_was_detected_is_said_on_request(run: Run) -> None:
    assert run("tree", "tf.txt", files=FILES).err == ""
    assert "tf.txt: messages as `ros2 topic echo`" in run("tree", "-v", "tf.txt", files=FILES).err


# --- echo ----------------------------------------------------------------------------------------------------------


def test_echo_prints_the_block_of_tf2_echo_with_whole_stamps(run: Run) -> None:
    found = run("echo", *BOTH, "map", "cam", "--rate", "2", "--limit", "1", files=FILES)
    assert found.out == (
        "cam seen from map (maps points in cam to points in map)\n"
        "At time 1700000000.000000001\n"
        "- Translation: [0.500, 0.000, 0.000]\n"
        "- Rotation: in Quaternion [0.000, 0.000, 0.000, 1.000]\n"
        "- Rotation: in RPY (radian) [0.000, 0.000, 0.000]\n"
        "- Rotation: in RPY (degree) [0.000, 0.000, 0.000]\n"
        "- Matrix:\n"
        "  1.000  0.000  0.000  0.500\n"
        "  0.000  1.000  0.000  0.000\n"
        "  0.000  0.000  1.000  0.000\n"
        "  0.000  0.000  0.000  1.000\n"
    )


def test_echo_goes_by_the_time_of_the_recording(run: Run) -> None:
    rows = run("echo", *BOTH, "map", "cam", "--rate", "4", "-f", "json", files=FILES).out.splitlines()
    assert [json.loads(row)["stamp_ns"] - EPOCH - 1 for row in rows] == [at * BILLION // 4 for at in range(9)]


def test_echo_tells_of_times_without_data_and_goes_on(run: Run) -> None:
    found = run("echo", *BOTH, "map", "cam", "--start", "1699999999", "-f", "json", files=FILES)
    assert found.status == 3
    assert len(found.out.splitlines()) == 2
    told = [json.loads(line) for line in found.err.splitlines()]
    assert [each["error"] for each in told] == ["too_early", "rows_skipped"]
    assert (told[-1]["bad"], told[-1]["rows"]) == (2, 4)


@pytest.mark.parametrize("times", [("--start", "1800000000"), ("--stop", "0"), ("--start", "1", "--stop", "2")])
def test_echo_without_any_data_is_a_failed_lookup(run: Run, times: tuple[str, ...]) -> None:
    found = run("echo", *BOTH, "map", "cam", *times, files=FILES)
    assert (found.status, found.out) == (4, "")
    assert "no data for map -> base" in found.err


def test_echo_cannot_stop_before_it_starts(run: Run) -> None:
    assert run("echo", *BOTH, "map", "cam", "--start", "3", "--stop", "1", files=FILES).status == 2


def test_echo_of_what_stands_still_has_no_time(run: Run) -> None:
    out = run("echo", "tf_static.txt", "base", "cam", files=FILES).out
    assert "At any time: the frames stand still" in out


# --- monitor -------------------------------------------------------------------------------------------------------


def test_monitor_tells_rate_interval_gap_and_jump_of_an_edge(run: Run) -> None:
    samples = [transform("map", "base", EPOCH + at * BILLION // 10, 0.1 * at) for at in range(10)]
    samples += [transform("map", "base", EPOCH + (at + 20) * BILLION // 10, 5 + 0.1 * at) for at in range(10)]
    entry = json.loads(run("monitor", "-", "-f", "json", stdin=dump(*samples)).out)
    assert (entry["count"], entry["first_ns"], entry["last_ns"]) == (20, EPOCH, EPOCH + 2_900_000_000)
    assert (entry["rate_hz"], entry["gap_s"], entry["jumps"]) == (19 / 2.9, 1.1, 1)
    assert entry["gap_until_ns"] == EPOCH + 2 * BILLION


def test_monitor_tells_the_common_interval_of_a_chain(run: Run) -> None:
    late = dump(*(transform("base", "arm", EPOCH + BILLION + at * BILLION) for at in range(5)))
    found = run("monitor", "tf.txt", "--with", "arm.txt", "map", "arm", files=FILES | {"arm.txt": late})
    chain = list(yaml.safe_load_all(found.out))[-1]
    assert (chain["kind"], chain["first_ns"], chain["last_ns"]) == ("chain", EPOCH + BILLION, EPOCH + 2 * BILLION + 1)


def test_a_gap_is_between_stamps_whatever_order_they_came_in(run: Run) -> None:
    text = moving(*((at, 0.1 * at) for at in (0, 1, 5, 2, 3, 4, 6)))
    entry = json.loads(run("monitor", "-", "-f", "json", stdin=text).out)
    assert (entry["gap_s"], entry["gap_until_ns"]) == (1.0, EPOCH + BILLION)
    assert entry["backward"] == 3
    assert "comes after a later stamp (and 2 more of these)" in run("check", "-", stdin=text).out


def test_monitor_names_each_parent_once_and_counts_the_changes(run: Run) -> None:
    entry = json.loads(run("monitor", "-", "-f", "json", stdin=moving(*STEADY, parents="mo")).out)
    assert (entry["parents"], entry["parent_changes"]) == ("map, odom", 19)
    header, row = run("monitor", "-", "-f", "text", stdin=moving(*STEADY, parents="mo")).out.splitlines()
    assert (header.split()[-1], row.split()[-1]) == ("parents", "19")


@pytest.mark.parametrize("begin", [1, 9])
def test_monitor_says_whether_the_edges_of_a_chain_overlap(run: Run, begin: int) -> None:
    late = dump(*(transform("base", "arm", EPOCH + (begin + at) * BILLION) for at in range(5)))
    found = run("monitor", "tf.txt", "--with", "arm.txt", "map", "arm", "-f", "json", files=FILES | {"arm.txt": late})
    assert [json.loads(line)["overlap"] for line in found.out.splitlines()] == [None, None, begin < 2]


def test_monitor_knows_the_delay_from_a_csv_recording(run: Run) -> None:
    rows = [f"{EPOCH + at + 2_000_000},0,{EPOCH + at},map,base,0,0,0,0,0,0,1" for at in (0, BILLION)]
    text = "\n".join(["%time,field.transforms0.header.seq,rest", *rows]) + "\n"
    entry = json.loads(run("monitor", "-", "-f", "json", stdin=text).out)
    assert (entry["delay_mean_s"], entry["delay_max_s"]) == (0.002, 0.002)


# --- static --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["static1", "static2"])
def test_static_lines_of_a_tree_are_that_tree_again(run: Run, form: str) -> None:
    tree = "frames: {base: {cam: {xyz: [0.1, 0, 0.2], rpy_deg: [0, 15, 90]}, lidar: {xyz: [0, 0, 1]}}}"
    lines = run("static", "tree.yaml", "-f", form, files={"tree.yaml": tree}).out
    assert lines.count("\n") == 2
    again, first = (run("tree", *arguments, "-f", "json") for arguments in (["tree.yaml"], ["tree.yaml"]))
    assert run("tree", "-", "-f", "json", stdin=lines).out == again.out == first.out


def test_static_arguments_become_a_tree_entry(run: Run) -> None:
    flags = ("--x", "-0.1", "--yaw", "1.5", "--frame-id", "base", "--child-frame-id", "cam")
    assert run("static", *flags).out == run("static", "-0.1", "0", "0", "1.5", "0", "0", "base", "cam").out
    assert yaml.safe_load(run("static", *flags).out)["frames"][1]["xyz"] == [-0.1, 0.0, 0.0]


@pytest.mark.parametrize("flags", ["--yaw 90deg", "--yaw pi/2", "--yaw 1.5707963267948966"])
def test_angles_of_static_may_have_a_unit(run: Run, flags: str) -> None:
    done = run("static", *flags.split(), "--frame-id", "a", "--child-frame-id", "b", "-f", "static1", "--to", "rpy")
    assert done.out == "0.0 0.0 0.0 1.5707963267948966 0.0 0.0 a b\n"


def test_static_refuses_what_moves_and_what_is_no_rotation(run: Run) -> None:
    assert run("static", "tf.txt", files=FILES).err == "frametool: frames move and cannot be published as static: base\n"
    assert run("static", "--qz", "0.5", "--frame-id", "a", "--child-frame-id", "b").status == 1
    assert run("static", "1", "2", "3").status == 2


@pytest.mark.parametrize("names", [("a", ""), ("", "a")])
def test_static_refuses_an_empty_name_in_either_spelling(run: Run, names: tuple[str, str]) -> None:
    assert run("static", *"000000", "1", *names).status == 2
    assert run("static", "--frame-id", names[0], "--child-frame-id", names[1]).status == 2


@pytest.mark.parametrize("command", ["", "rosrun tf static_transform_publisher "])
def test_calls_in_the_background_are_read_from_scripts(run: Run, command: str) -> None:
    text = f"{command}1 0 0 0 0 0 1 a b 100 &\n"
    assert run("tree", "-", stdin=text).out == run("tree", "-", stdin=text.replace(" &", "")).out != ""


# --- apply ---------------------------------------------------------------------------------------------------------


def stamped(stamp_ns: int, **fields: Any) -> dict[str, Any]:
    seconds, nanoseconds = divmod(stamp_ns, BILLION)
    return {"header": {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": "cam"}, **fields}


POINTS = [stamped(EPOCH + 1 + at * BILLION // 2, point={"x": 1.0, "y": 0.0, "z": 0.0}) for at in range(3)]


def test_each_message_moves_at_its_own_stamp(run: Run) -> None:
    text = "".join(json.dumps(point) + "\n" for point in POINTS)
    rows = run("apply", *BOTH, "map", stdin=text, files=FILES).out.splitlines()
    assert [json.loads(row)["point"]["x"] for row in rows] == pytest.approx([1.5, 2.0, 2.5])
    assert [json.loads(row)["header"] for row in rows] == [point["header"] | {"frame_id": "map"} for point in POINTS]


@pytest.mark.parametrize("form", ["ros1", "ros2"])
def test_messages_come_out_as_they_went_in(run: Run, form: str) -> None:
    twist = {"linear": {"x": 2.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": -0.25}}
    pose = {"position": {"x": 1.0, "y": 0.0, "z": 0.125}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8}}
    for message in (twist, POINTS[0], stamped(5, pose=pose), {"transforms": [transform("cam", "on", EPOCH + 1)]}):
        text = message_text(message, Style(form))
        assert run("apply", "--transform", "{name: cam, parent: cam, xyz: [0, 0, 0]}", stdin=text).out == text


def test_a_message_is_written_in_the_spelling_asked_for(run: Run) -> None:
    out = run("apply", "--transform", "{name: cam, parent: cam}", "-f", "ros1", stdin=json.dumps(POINTS[0])).out
    assert out.startswith('header: \n  seq: 0\n  stamp: \n    secs: 1700000000\n    nsecs:         1\n  frame_id: "cam"\n')


def test_a_cut_covariance_is_refused_with_its_place(run: Run) -> None:
    pose = {"position": {"x": 1.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
    text = message_text(stamped(5, pose={"pose": pose, "covariance": [0.0, "..."]}), Style("ros2"))
    found = run("apply", "--transform", "{}", stdin=text)
    assert (found.status, found.out) == (1, "")
    assert "stdin:19:" in found.err and "--full-length" in found.err  # noqa: PT018 - one message


# --- check ---------------------------------------------------------------------------------------------------------

OK = "{name: a, parent: map, xyz: [1, 0, 0]}"
TREES = {
    "syntax": "{name: a, parnt: map}",
    "denormalized": "{name: a, parent: map, quaternion: {x: 0, y: 0, z: 0, w: 0.9}}",
    "rounded": "{name: a, parent: map, quaternion: {x: 0, y: 0, z: 0, w: 1.0001}}",
    "mirrored": "{name: a, parent: map, matrix: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}",
    "not-finite": "{name: a, parent: map, xyz: [.nan, 0, 0]}",
    "degrees": "{name: a, parent: map, rpy: [0, 0, 90]}",
    "w-first": "{name: a, parent: map, xyzw: [1, 0, 0, 0]}",
    "identity": "{name: a, parent: map}",
    "self": "{name: a, parent: a, xyz: [1, 0, 0]}",
    "cycle": "[{name: a, parent: b, xyz: [1, 0, 0]}, {name: b, parent: a, xyz: [1, 0, 0]}]",
    "two-parents": f"[{OK}, {{name: a, parent: odom, xyz: [1, 0, 0]}}]",
    "two-poses": f"[{OK}, {{name: a, parent: map, xyz: [2, 0, 0]}}]",
    "several-roots": f"[{OK}, {{name: b, parent: odom, xyz: [1, 0, 0]}}]",
    "slash": "{name: a, parent: /map, xyz: [1, 0, 0]}",
    "empty": "frames:\n",
    "no-alt": "{name: a, at: {lat: 48, lon: 11}, axes: enu}",
    "band-s": "{name: a, at: {utm: {zone: 32S, easting: 5e5, northing: 4e6, alt: 0}}, axes: grid}",
}


def moving(*stamps_and_places: tuple[float, float], parents: str = "m") -> str:
    names = {"m": "map", "o": "odom"}
    return dump(
        *(
            transform(names[parents[index % len(parents)]], "a", EPOCH + round(at * BILLION), x)
            for index, (at, x) in enumerate(stamps_and_places)
        )
    )


def bridged(*topics: str) -> str:
    """Return lines of rosbridge, the same transform by each topic."""
    message = transform("map", "b", EPOCH)
    return "".join(json.dumps({"op": "publish", "topic": topic, "msg": message}) + "\n" for topic in topics)


STEADY = [(0.1 * at, 0.01 * at) for at in range(20)]
RECORDINGS = {
    "repeated": moving(*STEADY, STEADY[-1]),
    "repeated-stamp": moving(*STEADY, (1.9, 0.5)),
    "backward": moving(*STEADY, (0.55, 0.055)),
    "gap": moving(*STEADY, (5.0, 0.2)),
    "jump": moving(*STEADY, (2.0, 7.0)),
    "disagreement": moving(*((at + late, x + 9 * (late > 0)) for at, x in STEADY for late in (0, 5e-9))),
    "reparented": moving(*STEADY[:2]) + moving(*STEADY[2:], parents="o"),
    "flicker": moving(*STEADY, parents="mo"),
    "static-and-moving": moving(*STEADY),
    "noise": "WARNING: topic [/tf] does not appear to be published yet\n" + moving(*STEADY),
    "topics": bridged("/tf", "/tf_static"),
    "two-topics": bridged("/tf", "/robot1/tf"),
}


def findings(run: Run, text: str, *more: str) -> list[dict[str, Any]]:
    files = {"in.txt": text, "more.yaml": "frames: {map: {a: {xyz: [1, 0, 0]}}}"}
    return [json.loads(line) for line in run("check", "in.txt", *more, "-f", "json", files=files).out.splitlines()]


@pytest.mark.parametrize("rule", [*TREES, *RECORDINGS])
def test_each_rule_finds_what_it_is_about_with_its_place(run: Run, rule: str) -> None:
    text = (TREES | RECORDINGS)[rule]
    more = ("more.yaml",) if rule == "static-and-moving" else ()
    found = {each["rule"]: each for each in findings(run, text, *more)}
    assert rule in found
    assert found[rule]["level"] == RULES[rule][0]
    assert found[rule]["line"] >= 1
    assert found[rule]["column"] >= 1


UPSIDE_DOWN = {
    "name,parent,x,y,z,roll_deg,pitch_deg,yaw_deg\na,b,0,0,1,180,0,0\n": 0,
    "<mujoco><worldbody><body name='a' euler='180 0 0'/></worldbody></mujoco>": 0,
    "<mujoco><worldbody><body name='a' quat='0 1 0 0'/></worldbody></mujoco>": 0,
    "<sdf><model name='a'><link name='l'/><frame name='f'><pose degrees='1'>0 0 0 180 0 0</pose></frame></model></sdf>": 0,
    "name,parent,x,y,z,qx,qy,qz,qw\na,b,0,0,1,1,0,0,0\n": 1,
    "static_transform_publisher 0 0 1 1 0 0 0 b a\n": 1,
}  # fmt: skip


@pytest.mark.parametrize(("text", "count"), UPSIDE_DOWN.items())
def test_half_a_turn_about_x_is_suspicious_where_it_may_be_a_quaternion_with_w_last(
    run: Run, text: str, count: int
) -> None:
    assert [each["rule"] for each in findings(run, text)] == ["w-first"] * count


def test_a_sound_tree_and_a_sound_recording_have_no_findings(run: Run) -> None:
    assert findings(run, "frames: {map: {b: {xyz: [1, 0, 0], rpy_deg: [180, 0, 0]}}}") == []
    assert findings(run, moving(*STEADY)) == []


def test_every_rule_but_the_rest_is_tested(run: Run) -> None:
    robot = '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="-1" upper="1"/></joint></robot>'
    assert [each["rule"] for each in findings(run, robot, "-j", "j=2")] == ["limit"]
    assert {*TREES, *RECORDINGS, "limit", "loop", "no-frames"} == set(RULES) - {"odd"}  # loop: test_measured_trees.py, no-frames: test_one_by_one.py


@pytest.mark.parametrize("turn", [0, 1, 2])
def test_check_and_lookup_report_a_cycle_alike(run: Run, turn: int) -> None:
    edges = [("a", "b"), ("b", "c"), ("c", "a")]
    order = [*edges[turn:], *edges[:turn]]
    text = dump(*(transform(*edge, EPOCH + at) for edge in order for at in range(2)))
    (cycle,) = (each for each in findings(run, text) if each["rule"] == "cycle")
    error = json.loads(run("lookup", "-", "a", "c", "-f", "json", stdin=text).err)
    assert error["line"] == cycle["line"]
    assert error["message"].endswith(cycle["message"])


NEAR_ROTATION = "[[1, 0.00001, 0], [0, 1, 0], [0, 0, 1]]"


@pytest.mark.parametrize(
    ("entry", "rule"),
    [
        (f"{{name: a, parent: map, matrix: {NEAR_ROTATION}}}", "rounded"),
        ("{name: a, parent: map, matrix: [[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]}", "denormalized"),
        ("{name: a, parent: map, matrix: [[1, 0, 0], [1, 0, 0], [0, 0, 1]]}", "denormalized"),
        ("{name: a, parent: map, axis_angle: {axis: [0, 0, 0], angle: 1}}", "denormalized"),
        ("{name: a, parent: map, rotvec: [.inf, 0, 0]}", "not-finite"),
        ("{name: a, parent: map, rpy: [1e999, 0, 0]}", "not-finite"),
        ("{name: a, parent: map, xyz: [mirrored, 0, 0]}", "syntax"),
        ("{name: a, parent: map, xyz: ['not finite', 0, 0]}", "syntax"),
        ("{name: a, parent: map, rpy: ['degrees?', 0, 0]}", "syntax"),
        ("{name: 'normalised', parent: map, xyz: [1, 0, 0], its own parent: 1}", "syntax"),
        ("{name: mirrored, parent: map}", "identity"),
        ("{name: /normalised, parent: map, xyz: [1, 0, 0]}", "slash"),
    ],
)
def test_the_rule_of_a_finding_never_comes_from_words_that_the_file_holds(run: Run, entry: str, rule: str) -> None:
    (found,) = findings(run, entry)
    assert (found["rule"], found["level"]) == (rule, RULES[rule][0])


def test_a_call_of_static_transform_publisher_has_the_rules_of_its_numbers(run: Run) -> None:
    text = "rosrun tf static_transform_publisher 0 0 0 0 0 0 {} normalised b\n".replace("rosrun tf ", "")
    assert [each["rule"] for each in findings(run, text.format("1.0001"))] == ["rounded"]
    assert [each["rule"] for each in findings(run, text.format("1.1"))] == ["denormalized"]
    assert [each["rule"] for each in findings(run, text.format("1 0 0 0"))] == ["syntax"]


def test_one_bad_entry_does_not_hide_the_others(run: Run) -> None:
    text = f"frames:\n- {TREES['degrees']}\n- {TREES['mirrored']}\n- {TREES['not-finite']}\n"
    assert [(each["line"], each["rule"]) for each in findings(run, text)] == [
        (2, "degrees"), (3, "mirrored"), (4, "not-finite"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("rule", "plain", "strict"), [("cycle", 1, 1), ("degrees", 0, 1), ("several-roots", 0, 0), ("gap", 0, 1)]
)
def test_errors_fail_and_warnings_fail_when_strict(run: Run, rule: str, plain: int, strict: int) -> None:
    files = {"in.txt": (TREES | RECORDINGS)[rule]}
    assert run("check", "in.txt", files=files).status == plain
    assert run("check", "in.txt", "--strict", files=files).status == strict


def test_the_summary_is_there_for_notes_alone(run: Run) -> None:
    assert run("check", "in.txt", files={"in.txt": TREES["several-roots"]}).err == "frametool: 1 note\n"


def test_findings_are_lines_that_editors_and_github_understand(run: Run) -> None:
    files = {"a.yaml": TREES["denormalized"]}
    text = run("check", "a.yaml", files=files).out
    assert re.fullmatch(r"a\.yaml:1:\d+: error: quaternion 0 0 0 0\.9 has norm 0\.9; .* \[denormalized\]\n", text)
    github = run("check", "a.yaml", "-f", "github", files=files).out
    assert re.fullmatch(r"::error file=a\.yaml,line=1,col=\d+,title=denormalized::quaternion .*\n", github)
