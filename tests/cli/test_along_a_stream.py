"""Poses of a stream seen from the first, from the one before, and the velocity in between, against SciPy."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

GENERATOR = np.random.default_rng(47)
COUNT = 25
TURNS = Rotation.from_rotvec(np.cumsum(GENERATOR.normal(0.0, 0.3, (COUNT, 3)), axis=0))
PLACES = np.cumsum(GENERATOR.normal(0.0, 1.0, (COUNT, 3)), axis=0)
STAMPS_NS = 1700000000000000000 + np.cumsum(GENERATOR.integers(1, 10**9, COUNT))
STAMPS = [f"{stamp // 10**9}.{stamp % 10**9:09d}" for stamp in STAMPS_NS.tolist()]
ROWS = np.hstack([PLACES, TURNS.as_quat()]).tolist()
SECONDS = np.diff(STAMPS_NS) / 1e9
LINEAR = TURNS[:-1].inv().apply(np.diff(PLACES, axis=0)) / SECONDS[:, None]
ANGULAR = (TURNS[:-1].inv() * TURNS[1:]).as_rotvec() / SECONDS[:, None]
TWISTS = np.hstack([LINEAR, ANGULAR])
VELOCITY = ["linear_x", "linear_y", "linear_z", "angular_x", "angular_y", "angular_z"]


def spaced(names: str = "") -> str:
    """Write the trajectory as a TUM file."""
    return names + "".join(f"{at} {' '.join(map(repr, row))}\n" for at, row in zip(STAMPS, ROWS, strict=True))


def table(stamp: str, texts: list[str]) -> str:
    """Write it as CSV under a name of the stamps."""
    lines = [f"{at},{','.join(map(repr, row))}\n" for at, row in zip(texts, ROWS, strict=True)]
    return f"{stamp},x,y,z,qx,qy,qz,qw\n" + "".join(lines)


def records(stamp: str, texts: list[str]) -> str:
    """Write it as JSON lines."""
    lines = (f'{{"{stamp}": {at}, "xyz": {row[:3]}, "xyzw": {row[3:]}}}\n' for at, row in zip(texts, ROWS, strict=True))
    return "".join(lines)


def messages() -> str:
    """Write it as ROS 2 echo prints PoseStamped."""
    return "".join(
        f"header:\n  stamp:\n    sec: {stamp // 10**9}\n    nanosec: {stamp % 10**9}\n  frame_id: map\npose:\n"
        f"  position:\n    x: {row[0]!r}\n    y: {row[1]!r}\n    z: {row[2]!r}\n"
        f"  orientation:\n    x: {row[3]!r}\n    y: {row[4]!r}\n    z: {row[5]!r}\n    w: {row[6]!r}\n---\n"
        for stamp, row in zip(STAMPS_NS.tolist(), ROWS, strict=True)
    )


NS = [str(stamp) for stamp in STAMPS_NS.tolist()]
STREAMS = {
    "tum": spaced(),
    "csv": table("stamp", STAMPS),
    "csv in ns": table("stamp_ns", NS),
    "jsonl": records("t", STAMPS),
    "jsonl in ns": records("stamp_ns", NS),
}


def twists_of(text: str) -> Any:
    """Read the velocities that were printed."""
    if text.startswith("{"):
        return [[float(json.loads(line)[name]) for name in VELOCITY] for line in text.splitlines()]
    if "," in text:
        return [[float(row[name]) for name in VELOCITY] for row in csv.DictReader(io.StringIO(text))]
    return [[float(cell) for cell in line.split()[-6:]] for line in text.splitlines() if line[0] != "#"]


@pytest.mark.parametrize("name", STREAMS)
def test_the_velocity_leads_from_one_row_to_the_next(run: Run, name: str) -> None:
    outcome = run("relative", "--consecutive", "--velocity", stdin=STREAMS[name])
    assert outcome.status == 0, outcome.err
    np.testing.assert_allclose(twists_of(outcome.out), TWISTS, rtol=1e-12, atol=1e-12)


def test_the_velocity_of_messages_uses_their_headers(run: Run) -> None:
    outcome = run("relative", "--consecutive", "--velocity", "-f", "json", stdin=messages())
    assert outcome.status == 0, outcome.err
    np.testing.assert_allclose(twists_of(outcome.out), TWISTS, rtol=1e-12, atol=1e-12)


def test_one_record_after_the_other_gives_the_same_bits(run: Run) -> None:
    lines = records("stamp", STAMPS)
    there = twists_of(run("relative", "--consecutive", "--velocity", stdin=lines).out)
    other = run("relative", "--consecutive", "--velocity", "-f", "yaml", stdin=lines).out
    found = [json.loads(f'"{line.split(": ")[1]}"') for line in other.splitlines() if line.split(":")[0] in VELOCITY]
    assert [float(each) for each in found] == [each for row in there for each in row]


def test_a_named_column_holds_the_stamps(run: Run) -> None:
    text = table("when", STAMPS)
    outcome = run("relative", "--consecutive", "--velocity", "--time-column", "when", stdin=text)
    np.testing.assert_allclose(twists_of(outcome.out), TWISTS, rtol=1e-12, atol=1e-12)
    refused = run("relative", "--consecutive", "--velocity", stdin=text)
    assert refused.status == 2
    assert "--time-column" in refused.err


@pytest.mark.parametrize("second", ["0.5", "0.25"])
def test_time_that_stands_still_or_turns_back_has_no_velocity(run: Run, second: str) -> None:
    text = f"t,x,y,z\n0.5,0,0,0\n{second},1,0,0\n1.5,2,0,0\n"
    outcome = run("relative", "--consecutive", "--velocity", "--on-error", "skip", stdin=text)
    assert outcome.status == 3
    assert "there is no velocity" in outcome.err
    assert len(outcome.out.splitlines()) == 2


@pytest.mark.parametrize("name", STREAMS)
def test_first_sees_all_poses_from_the_first_one(run: Run, name: str) -> None:
    outcome = run("relative", "--first", stdin=STREAMS[name])
    assert outcome.status == 0, outcome.err
    seen = [line for line in outcome.out.splitlines() if not line[:1].isalpha() and line[0] != "#"]
    assert len(seen) == COUNT
    turned, moved = TURNS[0].inv() * TURNS, TURNS[0].inv().apply(PLACES - PLACES[0])
    for line, place, turn in zip(seen, moved, turned, strict=True):
        if line.startswith("{"):
            entry = json.loads(line)
            xyz, xyzw = entry["xyz"], entry["xyzw"]
        else:
            cells = [float(cell) for cell in line.replace(",", " ").split()]
            xyz, xyzw = cells[1:4], cells[4:8]
        np.testing.assert_allclose(xyz, place, rtol=0, atol=1e-12)
        assert (Rotation.from_quat(xyzw).inv() * turn).magnitude() < 1e-12


def test_the_first_pose_becomes_the_identity(run: Run) -> None:
    first = run("relative", "--first", stdin=STREAMS["tum"]).out.splitlines()[1].split()
    assert list(map(float, first[1:8])) == pytest.approx([0, 0, 0, 0, 0, 0, 1], abs=1e-17)


@pytest.mark.parametrize("option", ["--first", "--consecutive"])
def test_another_form_of_output_says_the_same(run: Run, option: str) -> None:
    lines = records("stamp", STAMPS[:5] + STAMPS[5:])
    keys = ("xyz", "distance", "angle")
    there = [json.loads(line) for line in run("relative", option, stdin=lines).out.splitlines()]
    text = run("relative", option, "-f", "csv", stdin=lines).out
    other = list(csv.DictReader(io.StringIO(text)))
    assert [[float(row[name]) for name in "xyz"] for row in other] == [each["xyz"] for each in there]
    assert [float(row["angle"]) for row in other] == [each["angle"] for each in there]
    assert all(key in there[0] for key in keys)


DETECTION = '{"xyz": [1, 2, 3], "distance": 7, "id": 4}\n'


@pytest.mark.parametrize("copies", [1, 200])
def test_a_distance_of_the_user_is_neither_dropped_nor_replaced(run: Run, copies: int) -> None:
    assert run("invert", stdin=DETECTION * copies).out == DETECTION.replace("1, 2, 3", "-1.0, -2.0, -3.0") * copies
    assert run("convert", "-f", "csv", stdin=DETECTION * copies).out.startswith("x,y,z,qx,qy,qz,qw,distance,id\n1.0,2.0,3.0")
    for fmt in ([], ["-f", "csv"]):
        refused = run("relative", "--first", *fmt, stdin=DETECTION * copies)
        assert (refused.status, refused.out) == (1, "")
        assert refused.err == "frametool: stdin:1:1: key 'distance' is there already, where the result would stand\n"


AXIS_ANGLE = '{"x": 1, "y": 0, "z": 0, "axis_x": 0, "axis_y": 0, "axis_z": 1, "angle": 0.5, "id": 4}\n'


@pytest.mark.parametrize("copies", [1, 200])
def test_the_angle_of_an_axis_angle_is_the_angle_between_poses(run: Run, copies: int) -> None:
    done = run("relative", "{}", "-", stdin=AXIS_ANGLE * copies)
    first, _, last = done.out.splitlines()[-1].partition(' "id"')
    assert (done.status, last) == (0, ": 4}")
    wanted = json.loads(AXIS_ANGLE[:-11] + ', "distance": 1, "angle_deg": 28.64788975654116}')
    assert json.loads(first.rstrip(",") + "}") == pytest.approx(wanted, rel=1e-15)
    assert first.count('"angle"') == 1
    header, row = run("relative", "{}", "-", "-f", "csv", stdin=AXIS_ANGLE * copies).out.splitlines()[:2]
    assert (header, row[-4:]) == ("x,y,z,qx,qy,qz,qw,distance,angle,angle_deg,id", "17,4")


@pytest.mark.parametrize("fmt", ["json", "csv"])
def test_the_velocities_of_velocities_are_written_once(run: Run, fmt: str) -> None:
    rows = [f'{{"t": {at}, "xyz": [{at * at}, 0, 0]}}\n' for at in range(90)]
    for count in (5, 90):
        once = run("relative", "--consecutive", "--velocity", stdin="".join(rows[:count])).out
        twice = run("relative", "--consecutive", "--velocity", "-f", fmt, stdin=once).out
        assert twice.count("linear_x") == (count - 2 if fmt == "json" else 1)
        last = json.loads(twice.splitlines()[-1]) if fmt == "json" else [*csv.DictReader(io.StringIO(twice))][-1]
        assert float(last["linear_x"]) == float(last["distance"]) == 2.0


@pytest.mark.parametrize("option", ["--first", "--consecutive"])
def test_a_file_may_be_named_as_an_argument(run: Run, option: str) -> None:
    files = {"walk.tum": STREAMS["tum"]}
    assert run("relative", option, "walk.tum", files=files) == run("relative", option, "-i", "walk.tum")


def test_a_long_stream_in_blocks_remembers_what_was_before(run: Run) -> None:
    rows = 30000
    text = "t,x,y,z\n" + "".join(f"{at}.5,{at % 7},{at},{-at}\n" for at in range(rows))
    lines = run("relative", "--consecutive", "--velocity", stdin=text).out.splitlines()
    found = np.array([list(map(float, line.split(",")[-6:-3])) for line in lines[1:]])
    steps = np.diff([[at % 7, at, -at] for at in range(rows)], axis=0)
    np.testing.assert_array_equal(found, steps)
    last = run("relative", "--first", stdin=text).out.splitlines()[-1].split(",")
    assert list(map(float, last[1:4])) == [(rows - 1) % 7, rows - 1, 1 - rows]


@pytest.mark.parametrize(
    "arguments",
    [["--first", "--consecutive"], ["--velocity"], ["--first", "{}", "{}"], ["--time-column", "t"]],
)
def test_options_that_contradict_are_refused(run: Run, arguments: list[str]) -> None:
    assert run("relative", *arguments).status == 2


IMU = "t,ax,ay,az,gx,gy,gz,tag\n0,1.5,0,0,0,1,0,a\n1,0,0,9.81,0.1,0.2,0.3,b\n"
QUARTER = "{xyz: [5, 0, 0], rpy_deg: [0, 0, 90]}"


def test_several_vectors_of_a_row_are_moved_each_by_itself(run: Run) -> None:
    chosen = ["--columns", "ax,ay,az", "--as", "vector", "--columns", "gx,gy,gz", "--as", "vector"]
    outcome = run("apply", "--transform", QUARTER, *chosen, stdin=IMU)
    assert outcome.status == 0, outcome.err
    assert outcome.out == "t,ax,ay,az,gx,gy,gz,tag\n0,0.0,1.5,0.0,-1.0,0.0,0.0,a\n1,0.0,0.0,9.81,-0.2,0.1,0.3,b\n"


def test_several_sorts_in_a_row_give_what_each_gives_alone(run: Run) -> None:
    first, second = ["--columns", "gx,gy,gz", "--as", "point"], ["--columns", "ax,ay,az", "--as", "vector"]
    tree = ["apply", "--transform", QUARTER]
    both = run(*tree, *first, *second, stdin=IMU).out
    assert run(*tree, *second, stdin=run(*tree, *first, stdin=IMU).out).out == both


def test_several_vectors_move_each_row_at_its_time(run: Run) -> None:
    tree = "frames:\n  - {name: map}\n  - {name: imu, parent: map, samples: [{stamp: 0, rpy_deg: [0, 0, 0]}, "
    tree += "{stamp: 1, rpy_deg: [0, 0, 90]}]}\n"
    chosen = ["--columns", "ax,ay,az", "--as", "vector", "--columns", "gx,gy,gz", "--as", "vector"]
    where = ["apply", "tree.yaml", "map", "imu", "--time-column", "t"]
    outcome = run(*where, *chosen, stdin=IMU, files={"tree.yaml": tree})
    assert outcome.status == 0, outcome.err
    assert outcome.out == "t,ax,ay,az,gx,gy,gz,tag\n0,1.5,0.0,0.0,0.0,1.0,0.0,a\n1,0.0,0.0,9.81,-0.2,0.1,0.3,b\n"


def test_several_results_stand_beside_with_keep(run: Run) -> None:
    chosen = ["--columns", "ax,ay,az", "--columns", "gx,gy,gz", "--as", "vector", "--keep", "--prefix", "m_"]
    lines = run("apply", "--transform", QUARTER, *chosen, stdin=IMU).out.splitlines()
    assert lines[0] == "t,ax,ay,az,gx,gy,gz,tag,m_ax,m_ay,m_az,m_gx,m_gy,m_gz"
    assert lines[1] == "0,1.5,0,0,0,1,0,a,0.0,1.5,0.0,-1.0,0.0,0.0"


@pytest.mark.parametrize(
    "chosen",
    [
        ["--columns", "ax,ay,az", "--as", "vector", "--as", "point"],
        ["--columns", "ax,ay,az", "--columns", "ax,gy,gz", "--as", "vector"],
        ["--columns", "ax,ay,az", "--columns", "gx,gy,gx"],
    ],
)
def test_columns_that_do_not_fit_are_refused(run: Run, chosen: list[str]) -> None:
    outcome = run("apply", "--transform", QUARTER, *chosen, stdin=IMU)
    assert (outcome.status, outcome.out) == (2, "")


# --- times that are shifted, or left out -----------------------------------------------------------------------------

SHIFTED = {
    "tum": ("0.5 0 0 0 0 0 0 1\n1.50 1 0 0 0 0 0 1\n2.5 2 0 0 0 0 0 1\n", "1.75 1 0 0 0.0 0.0 0.0 1.0\n"),
    "csv": ("x,y,z,yaw,stamp_ns\n0,0,0,0,500000000\n1,0,0,0,1500000000\n9,0,0,0,2500000000\n",
            "x,y,z,qx,qy,qz,qw,stamp_ns\n1,0,0,0.0,0.0,0.0,1.0,1750000000\n"),
    "two columns": ("sec,nanosec,yaw\n0,500000000,0\n1,500000000,0\n2,500000000,0\n",
                    "sec,nanosec,qx,qy,qz,qw\n1,750000000,0.0,0.0,0.0,1.0\n"),
    "lines": ('{"t":0.5,"yaw":0}\n{"t":"1500ms","yaw":0}\n{"t":2.5,"yaw":0}\n', None),
    "messages": (messages(), None),
}  # fmt: skip


@pytest.mark.parametrize("name", ["tum", "csv", "two columns"])
def test_stamps_are_shifted_and_what_is_before_or_after_left_out(run: Run, name: str) -> None:
    text, kept = SHIFTED[name]
    outcome = run("convert", "--time-offset", "0.25", "--start", "1.7", "--stop", "1800ms", "--to", "quaternion", stdin=text)
    assert (outcome.status, outcome.out) == (0, kept)


def test_records_of_a_stream_are_those_of_a_document_at_other_times(run: Run) -> None:
    options = ("--time-offset", "-0.25", "--start", "1", "--to", "rpy")
    lines = "".join(f'{{"stamp": {at}.5, "xyz": [{at}, 0, 0]}}\n' for at in range(40))
    streamed = [json.loads(line) for line in run("convert", *options, stdin=lines).out.splitlines()]
    document = [json.loads(line) for line in run("convert", "a.jsonl", *options, "-f", "json", files={"a.jsonl": lines}).out.splitlines()]
    assert [each["stamp"] for each in streamed] == [at + 0.25 for at in range(1, 40)]
    assert [each["xyz"] for each in streamed] == [each["xyz"] for each in document]
    assert [float(each["stamp"]) for each in document] == [each["stamp"] for each in streamed]


def test_other_rows_than_those_wanted_may_be_bad(run: Run) -> None:
    text = "t,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,0\n1,1,2,3,0,0,0,1\n"
    assert run("relative", "--first", "--start", "1", stdin=text).status == 0


@pytest.mark.parametrize(
    ("arguments", "stdin", "said"),
    [
        (["--start", "2", "--stop", "1"], "", "--start is after --stop"),
        (["--start", "2"], "x,y,z,yaw\n1,2,3,4\n", "no column looks like stamps; name it with --time-column"),
        (["--time-offset", "1", "{xyz: [1, 2, 3]}"], "", "--time-offset has no effect: no timestamps in it"),
        (["--time-column", "t", "{xyz: [1, 2, 3]}"], "", "--time-column needs --time-offset or --start or --stop"),
    ],
)
def test_times_that_cannot_be_used_are_told(run: Run, arguments: list[str], stdin: str, said: str) -> None:
    outcome = run("convert", *arguments, stdin=stdin)
    assert outcome.status in (1, 2)
    assert said in outcome.err


def test_rows_with_more_numbers_than_their_form_name_their_columns(run: Run) -> None:
    out = run("relative", "--consecutive", stdin=STREAMS["tum"]).out
    assert out.splitlines()[0] == "# t x y z qx qy qz qw distance angle angle_deg"
    assert run("convert", "--to", "rpy", stdin=out).status == 0
