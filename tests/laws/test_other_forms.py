"""On the way into another form nothing is lost without a word: stamps, other keys and columns, rows, signs, kinds."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import pytest
from ways import readings, values

if TYPE_CHECKING:
    from pathlib import Path

    from ways import Run

STAMP_NS = 1_000_000_002
SECONDS = "1.000000002"
CELLS = "1,2,3.5,0.5,-0.5,0.5,0.5"
NAMES = "x,y,z,qx,qy,qz,qw"
POSE = {"xyz": [1, 2, 3.5], "xyzw": [0.5, -0.5, 0.5, 0.5]}
XYZ = {"x": 1.0, "y": 2.0, "z": 3.5}
TURN = {"x": 0.5, "y": -0.5, "z": 0.5, "w": 0.5}
HEADER = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "base"}


def lines(*records: dict[str, Any]) -> str:
    return "".join(json.dumps(record) + "\n" for record in records)


STAMPED = {
    "tum": f"{SECONDS} 1 2 3.5 0.5 -0.5 0.5 0.5\n",
    "euroc": "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
    f"{STAMP_NS},1,2,3.5,0.5,0.5,-0.5,0.5\n",
    "t": f"t,{NAMES}\n{SECONDS},{CELLS}\n",
    "stamp_ns": f"stamp_ns,{NAMES}\n{STAMP_NS},{CELLS}\n",
    "header columns": f"header.stamp.sec,header.stamp.nanosec,{NAMES}\n1,2,{CELLS}\n",
    "header columns of ros1": f"stamp_secs,stamp_nsecs,{NAMES}\n1,2,{CELLS}\n",
    "json t": lines({"t": 1.000000002} | POSE),
    "json timestamp": lines({"timestamp": SECONDS} | POSE),
    "json stamp_ns": lines({"stamp_ns": STAMP_NS} | POSE),
    "json stamp of a message": lines({"stamp": {"sec": 1, "nanosec": 2}} | POSE),
    "PoseStamped": lines({"header": HEADER, "pose": {"position": XYZ, "orientation": TURN}}),
    "TransformStamped": lines({"header": HEADER, "transform": {"translation": XYZ, "rotation": TURN}}),
}
COMMANDS = {
    "convert": ("convert",),
    "invert": ("invert",),
    "apply": ("apply", "--transform", "{xyz: [1, 0, 0]}"),
    "compose": ("compose", "{xyz: [1, 0, 0]}", "-"),
    "relative": ("relative", "{xyz: [1, 0, 0]}", "-"),
}
WRITTEN = {
    "csv": ("stamp_ns", str(STAMP_NS), SECONDS),
    "json": (str(STAMP_NS), SECONDS, '"sec": 1, "nanosec": 2'),
    "yaml": (str(STAMP_NS), SECONDS, "nanosec: 2"),
    "tum": (f"{SECONDS} ",),
    "euroc": (f"\n{STAMP_NS},",),
    "ros1": ("secs: 1\n    nsecs:         2\n",),
    "ros2": ("sec: 1\n    nanosec: 2\n",),
}


@pytest.mark.parametrize("form", WRITTEN)
@pytest.mark.parametrize("given", STAMPED)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_stamp_goes_along_into_every_form(run: Run, command: str, given: str, form: str) -> None:
    done = run(*COMMANDS[command], "-f", form, stdin=STAMPED[given])
    said = done.out.replace('"sec":1,"nanosec":2', '"sec": 1, "nanosec": 2')
    if given.startswith("header columns") and form == "csv":
        assert ",1,2," in f",{said.splitlines()[1]}"
    else:
        assert any(text in said for text in WRITTEN[form]), done
    assert done.status == 0


@pytest.mark.parametrize("command", [("compose",), ("relative",)])
def test_the_one_stamp_of_arguments_is_that_of_their_result(run: Run, command: tuple[str, ...]) -> None:
    first, second = "{stamp: 1.5, xyz: [1, 2, 3], rpy: [0, 0, 1]}", "{stamp: 2.5, xyz: [0, 1, 0]}"
    done = run(*command, first, "{xyz: [0, 1, 0]}", "-f", "json")
    assert json.loads(done.out)["stamp"] == 1.5
    done = run(*command, first, "{xyz: [0, 1, 0], label: a}", "-f", "json")
    assert (json.loads(done.out)["stamp_ns"], json.loads(done.out)["label"]) == (1_500_000_000, "a")
    done = run(*command, first, second, "-f", "json")
    assert not {"stamp", "stamp_ns"} & json.loads(done.out).keys()
    assert "the result has no stamp: 1.500000000 and 2.500000000 are the times of two poses" in done.err


def test_what_lies_between_two_poses_lies_between_their_times(run: Run) -> None:
    done = run("interpolate", "{stamp: 1, xyz: [0, 0, 0]}", "{stamp: 2, xyz: [2, 0, 0]}", "0", "0.25", "-f", "tum")
    assert [line.split()[:2] for line in done.out.splitlines()] == [["1.000000000", "0.0"], ["1.250000000", "0.5"]]


def test_poses_of_which_some_have_a_stamp_are_no_trajectory(run: Run) -> None:
    done = run("convert", "-f", "tum", stdin=lines({"stamp": 1} | POSE, POSE))
    assert (done.status, done.out) == (1, "")
    assert "some poses have a stamp and some have none" in done.err


@pytest.mark.parametrize(("first", "second"), [({"stamp": 1}, {}), ({}, {"stamp": 1})])
@pytest.mark.parametrize("fmt", ["tum", "euroc"])
def test_poses_of_two_blocks_of_which_one_has_stamps_are_none(
    run: Run, monkeypatch: pytest.MonkeyPatch, fmt: str, first: dict[str, int], second: dict[str, int]
) -> None:
    monkeypatch.setattr("frametool.sizes.BLOCK", 1)
    done = run("convert", "-f", fmt, stdin=lines(first | POSE, second | POSE))
    assert (done.status, len([line for line in done.out.splitlines() if line[0] != "#"])) == (1, 1)
    assert "some poses have a stamp and some have none" in done.err


def test_positions_behind_a_block_of_rotations_are_refused_in_columns(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frametool.sizes.BLOCK", 1)
    done = run("convert", "-o", "a.npy", stdin=lines({"rpy": [0, 0, 0]}, POSE))
    assert (done.status, "rotations without a position, others have one" in done.err) == (1, True)
    assert run("convert", "-o", "a.npy", stdin=lines(POSE, {"rpy": [0, 0, 0]})).status == 0


THINGS: dict[str, tuple[dict[str, Any], str, str]] = {
    "point": ({"point": [1, 2, 3]}, "x,y,z", "1,2,3"),
    "pose": ({"xyz": [1, 2, 3], "rpy": [0, 0, 0]}, NAMES, "1,2,3,0,0,0,1"),
    "twist": (
        {"twist": {"linear": [1, 2, 3], "angular": [0, 0, 1]}},
        "linear_x,linear_y,linear_z,angular_x,angular_y,angular_z",
        "1,2,3,0,0,1",
    ),
    "wrench": (
        {"wrench": {"force": [1, 2, 3], "torque": [0, 0, 1]}},
        "force_x,force_y,force_z,torque_x,torque_y,torque_z",
        "1,2,3,0,0,1",
    ),
}
OTHERS: dict[str, Any] = {"id": 7, "label": 'a "b", c', "much": {"k": [1, 2]}}
ROW = '7,"a ""b"", c","{""k"": [1, 2]}"'
HOLDING = ("csv", "json", "yaml")
DROPPING = ("tum", "euroc", "kitti", "colmap", "g2o", "nerf", "ros1", "ros2", "foxglove")


def given(kind: str, form: str) -> str:
    record, names, cells = THINGS[kind]
    return lines(OTHERS | record) * 2 if form == "json" else f"id,label,much,{names}\n" + f"{ROW},{cells}\n" * 2


@pytest.mark.parametrize("into", HOLDING)
@pytest.mark.parametrize("form", ["json", "csv"])
@pytest.mark.parametrize("kind", THINGS)
def test_other_keys_and_columns_go_along(run: Run, kind: str, form: str, into: str) -> None:
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "-f", into, stdin=given(kind, form))
    assert (done.status, done.err) == (0, "")
    if into == "csv":
        found = [dict(row) for row in csv.DictReader(io.StringIO(done.out))]
        assert len(found[0]) == 3 + len(THINGS[kind][1].split(","))
        wanted = {"id": "7", "label": OTHERS["label"], "much": '{"k": [1, 2]}'}
    else:
        found = list(values(done.out, into))
        wanted = OTHERS if form == "json" else OTHERS | {"much": '{"k": [1, 2]}'}
    assert [{key: row[key] for key in OTHERS} for row in found] == [wanted] * 2


@pytest.mark.parametrize("into", DROPPING)
@pytest.mark.parametrize("form", ["json", "csv"])
def test_what_has_no_place_is_told_once_by_name(run: Run, form: str, into: str) -> None:
    done = run("convert", "-f", into, stdin=given("pose", form))
    assert done.status == 0
    assert done.err.count(f"{into}: id, label, much left out") == 1


@pytest.mark.parametrize("into", HOLDING)
@pytest.mark.parametrize("form", ["json", "csv", "tum"])
@pytest.mark.parametrize("kind", ["point", "pose", "twist"])
def test_a_bad_row_is_null_among_the_others(run: Run, kind: str, form: str, into: str) -> None:
    if form == "tum":
        text = "1 1 2 x 0 0 0 1\n2 1 2 3 0 0 0 1\n"
    else:
        text = given(kind, form).replace("2,3,", "2,x,", 1).replace("2,3\n", "2,x\n", 1).replace("2, 3]", '2, "x"]', 1)
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "-f", into, "--on-error", "null", stdin=text)
    assert done.status == 3
    if into == form == "json" or (into, form) == ("csv", "csv"):
        return
    found = list(csv.DictReader(io.StringIO(done.out))) if into == "csv" else list(values(done.out, into))
    assert len(found) == 2
    bad, good = ({key: value for key, value in row.items() if not _is_nothing(value)} for row in found)
    assert set(bad) == ({"stamp_ns"} if form == "tum" else set(OTHERS))
    assert set(bad) < set(good)


def _is_nothing(value: Any) -> bool:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return value in (None, "") if inner is None else all(map(_is_nothing, inner))


def test_a_row_with_too_few_cells_is_left_out_and_counted(run: Run) -> None:
    text = "id,x,y,z\n1,1,2,3\n2\n3,1,2,3\n"
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "-f", "json", "--on-error", "null", stdin=text)
    assert [json.loads(line) for line in done.out.splitlines()] == [
        {"point": [2.0, 2.0, 3.0], "id": 1}, {"point": [2.0, 2.0, 3.0], "id": 3},
    ]  # fmt: skip
    assert "stdin: 1 of 3 rows without result" in done.err


@pytest.mark.parametrize("into", ["tum", "ros2", "kitti"])
@pytest.mark.parametrize("form", ["json", "csv"])
def test_a_form_without_nulls_refuses_them(run: Run, form: str, into: str) -> None:
    done = run("convert", "-f", into, "--on-error", "null", stdin=given("pose", form))
    assert (done.status, done.out, done.err.count("\n")) == (2, "", 1)
    assert "cannot hold a row without a result; give skip" in done.err


MATRICES = {
    9: ("0 -1 0 1 0 0 0 0 1", None),
    12: ("0 -1 0 1 1 0 0 2 0 0 1 3", [1.0, 2.0, 3.0]),
    16: ("0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1", [1.0, 2.0, 3.0]),
    10: ("0 -1 0 1 0 0 0 0 1 1", ""),
    13: ("0 -1 0 1 0 0 0 0 1 1 1 1 1 1 1", ""),
}


@pytest.mark.parametrize("rows", [1, 3])
@pytest.mark.parametrize("way", ["arguments", "list", "stdin", "-i", "file", "no header", "columns"])
@pytest.mark.parametrize("count", MATRICES)
def test_numbers_of_a_matrix_are_the_same_on_every_way(run: Run, count: int, way: str, rows: int) -> None:
    text, wanted = MATRICES[count]
    ways = {
        "arguments": ((*text.split(),), ""),
        "list": ((f"[{','.join(text.split())}]",), ""),
        "stdin": ((), f"{text}\n" * rows),
        "-i": (("-i", "m.txt"), ""),
        "file": (("m.txt",), ""),
        "no header": (("--no-header", "--in", "csv"), f"{','.join(text.split())}\n" * rows),
        "columns": (("--columns", f"2-{len(text.split()) + 1}"), f"7 {text}\n" * rows),
    }
    arguments, stdin = ways[way]
    done = run("convert", "--from", "matrix", "-f", "json", *arguments, stdin=stdin, files={"m.txt": f"{text}\n" * rows})
    if wanted == "":
        assert done.status in (1, 2)
        assert "matrix has 9 numbers, 12 (three rows of a pose) or 16; found" in done.err
        return
    found = [json.loads(line) for line in done.out.splitlines()]
    assert len(found) == (1 if way in ("arguments", "list") else rows)
    assert all((each.get("xyz"), each["quaternion"]["z"]) == (wanted, 0.7071067811865476) for each in found)
    assert not any("stamp_ns" in each for each in found)


SIX = {
    "twist": (-2.0, 0.7, 3.1, -0.2, 0.1, 0.3),
    "wrench": (-2.0, 1.0, 3.0, -0.2, -2.9, 1.3),
}
TURNED = "{xyz: [1, 0, 0], rpy_deg: [0, 0, 90]}"


@pytest.mark.parametrize("into", HOLDING)
@pytest.mark.parametrize(
    ("kind", "names", "told"),
    [
        ("twist", "a,b,c,d,e,f", ("--as", "twist", "--columns", "a,b,c,d,e,f")),
        ("wrench", "a,b,c,d,e,f", ("--as", "wrench", "--columns", "1-6")),
        ("twist", "vx,vy,vz,wx,wy,wz", ("--as", "twist")),
        ("wrench", "fx,fy,fz,tx,ty,tz", ("--as", "wrench")),
        ("twist", THINGS["twist"][1], ()),
        ("wrench", THINGS["wrench"][1], ()),
        ("twist", ",".join(f"twist.{part}.{axis}" for part in ("linear", "angular") for axis in "xyz"), ()),
    ],
)
def test_six_columns_are_a_twist_or_a_wrench(run: Run, kind: str, names: str, told: tuple[str, ...], into: str) -> None:
    done = run("apply", "--transform", TURNED, *told, "-f", into, stdin=f"{names}\n1,2,3,0.1,0.2,0.3\n")
    assert done.status == 0
    if into == "csv":
        assert done.out.splitlines() == [names, ",".join(map(repr, SIX[kind]))]
        return
    parts = ("linear", "angular") if kind == "twist" else ("force", "torque")
    assert list(values(done.out, into)) == [{kind: dict(zip(parts, (list(SIX[kind][:3]), list(SIX[kind][3:])), strict=True))}]


@pytest.mark.parametrize("into", HOLDING)
@pytest.mark.parametrize("way", ["argument", "json", "yaml"])
def test_a_twist_of_lists_is_read_as_help_shows_it(run: Run, way: str, into: str) -> None:
    record = '{"twist": {"linear": [1, 2, 3], "angular": [0.1, 0.2, 0.3]}}'
    stdin = {"argument": "", "json": f"{record}\n", "yaml": "twist:\n  linear: [1, 2, 3]\n  angular: [0.1, 0.2, 0.3]\n"}[way]
    argument = (record,) if way == "argument" else ()
    done = run("apply", "--transform", TURNED, *argument, "-f", into, stdin=stdin)
    (found,) = readings(done.out, into)
    assert (found.kind, found.numbers) == ("twist", tuple(map(repr, SIX["twist"])))


def test_six_columns_of_a_twist_are_no_pose(run: Run) -> None:
    done = run("invert", stdin=f"{THINGS['twist'][1]}\n1,2,3,0,0,1\n")
    assert (done.status, done.out) == (2, "")
    assert "a twist cannot be taken for a pose; apply moves it" in done.err


def quaternions(text: str, form: str) -> list[list[float]]:
    """Read x, y, z, w of every row of a form."""
    rows = [line.split("," if form in ("euroc", "csv") else " ") for line in text.splitlines() if line[:1] not in ("#", "", "x")]
    if form in ("euroc", "colmap"):
        at = 4 if form == "euroc" else 1
        return [[*map(float, row[at + 1 : at + 4]), float(row[at])] for row in rows]
    if form in ("tum", "g2o", "csv"):
        first = {"tum": 4, "g2o": 5, "csv": 3}[form]
        return [list(map(float, row[first : first + 4])) for row in rows]
    found = values(text, "json" if form == "json" else "yaml")
    turns = [each.get("quaternion") or each["transform"]["rotation"] for each in found]
    return [[float(turn[axis]) for axis in "xyzw"] for turn in turns]


@pytest.mark.parametrize("into", ["tum", "euroc", "csv", "g2o", "colmap", "json", "yaml", "ros1", "ros2"])
@pytest.mark.parametrize("form", ["json", "csv", "tum"])
@pytest.mark.parametrize("command", COMMANDS)
def test_quaternions_leave_with_one_sign(run: Run, command: str, form: str, into: str) -> None:
    turns = [(0.5, -0.5, 0.5, -0.5), (-1, 0, 0, 0), (1, 0, 0, 0), (0, -1, 0, 0), (0, 0, -0.6, 0.8), (0, 0, 0, -1)]
    texts = {
        "json": lines(*({"xyz": [1, 2, 3], "xyzw": turn} for turn in turns)),
        "csv": f"{NAMES}\n" + "".join(f"1,2,3,{','.join(map(str, turn))}\n" for turn in turns),
        "tum": "".join(f"{at} 1 2 3 {' '.join(map(str, turn))}\n" for at, turn in enumerate(turns)),
    }
    done = run(*COMMANDS[command], "--to", "quaternion", "-f", into, stdin=texts[form])
    found = quaternions(done.out, into)
    assert len(found) == len(turns)
    assert all(next(number for number in (w, x, y, z) if number) > 0 for x, y, z, w in found)


@pytest.mark.parametrize("into", HOLDING)
@pytest.mark.parametrize("way", ["argument", "json", "csv"])
@pytest.mark.parametrize(
    ("axes", "wanted"),
    [
        (("--world-axes", "enu_from_ned"), [2.0, 1.0, -3.0]),
        (("--axes", "frd_from_flu"), [1.0, 2.0, 3.0]),
        (("--world-axes", "unity_from_ros", "--axes", "ros_from_unity"), [-2.0, 3.0, 1.0]),
    ],
)
def test_a_point_with_other_axes_stays_a_point(
    run: Run, axes: tuple[str, ...], wanted: list[float], way: str, into: str
) -> None:
    argument = ("{point: [1, 2, 3]}",) if way == "argument" else ()
    stdin = {"argument": "", "json": '{"point": [1, 2, 3]}\n', "csv": "x,y,z\n1,2,3\n"}[way]
    done = run("convert", *argument, *axes, "-f", into, stdin=stdin)
    (found,) = readings(done.out, into)
    assert (found.kind, list(map(float, found.numbers))) == ("point", wanted)


@pytest.mark.parametrize("into", ["yaml", "csv", "tum", "ros2", "text"])
@pytest.mark.parametrize("bad", ['{"xyz": [1, 2, "x"], "rpy": [0, 0, 0]}', '{"xyz": [1, 2'])
@pytest.mark.parametrize("count", [1, 200])
def test_good_rows_before_one_that_ends_the_run_are_written(run: Run, tmp_path: Path, into: str, bad: str, count: int) -> None:
    good = '{"xyz": [1, 2, 3], "rpy": [0, 0, 0]}\n'
    alone = run("convert", "-f", into, stdin=good * count)
    done = run("convert", "-f", into, stdin=f"{good * count}{bad}\n{good * count}")
    assert (done.status, done.out) == (1, alone.out)
    kept = run("convert", "-f", into, "-o", "new", stdin=f"{good * count}{bad}\n")
    assert (kept.status, (tmp_path / "new").exists()) == (1, False)
