"""What a result is made of: the same names, members and numbers for a record as for a row."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest
from ways import PARENTS, TWENTY, document, readings, table, values

if TYPE_CHECKING:
    from ways import Run

MAP_FROM_BASE = "{name: base, parent: map, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
TREE = {"tree.yaml": "frames:\n  map:\n    base: {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}\n"}
NUMBERS = {"x": 1.0, "y": 2.0, "z": 3.0, "qx": 0.5, "qy": -0.5, "qz": 0.5, "qw": 0.5}
COMMANDS = {
    "convert": (("convert",), ("base", "tool")),
    "invert": (("invert",), ("tool", "base")),
    "compose": (("compose", MAP_FROM_BASE, "-"), ("map", "tool")),
    "relative": (("relative", "{name: other, parent: base, xyz: [1, 0, 0]}", "-"), ("other", "tool")),
    "apply --transform": (("apply", "--transform", MAP_FROM_BASE), ("map", "tool")),
    "apply TREE": (("apply", "tree.yaml", "map"), ("map", "tool")),
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("form", ["csv", "json", "yaml"])
@pytest.mark.parametrize("into", ["json", "yaml"])
def test_parent_frame_id_names_the_frame_as_column_and_as_key(run: Run, command: str, form: str, into: str) -> None:
    arguments, names = COMMANDS[command]
    record = {"parent_frame_id": "base", "child_frame_id": "tool", **NUMBERS}
    texts = {"csv": table(record, TWENTY), "json": (json.dumps(record) + "\n") * TWENTY, "yaml": "---\n".join([document(record)] * TWENTY)}
    out = run(*arguments, "-f", into, stdin=texts[form], files=TREE).out
    assert [(each.parent, each.name) for each in readings(out, into)] == [names] * TWENTY
    assert all(sum(key in each for key in PARENTS) == 1 for each in values(out, into))


@pytest.mark.parametrize("rows", [1, TWENTY])
def test_a_table_with_parent_frame_id_stays_one(run: Run, rows: int) -> None:
    record = {"parent_frame_id": "base", "child_frame_id": "tool", **NUMBERS}
    found = run("invert", stdin=table(record, rows)).out.splitlines()
    assert [row.split(",")[:2] for row in found] == [["parent_frame_id", "child_frame_id"]] + [["tool", "base"]] * rows


TURN = "{rpy: [0.1, 0.2, 0.3]}"
ON_A_TURN = {"apply": ("apply", "--transform", TURN), "compose": ("compose", TURN), "relative": ("relative", TURN)}
ROTVEC = {"rotvec": [0.1, 0.2, 0.3]}


@pytest.mark.parametrize("command", ON_A_TURN)
@pytest.mark.parametrize("way", ["argument", "line", "lines", "row", "rows"])
def test_a_rotation_of_a_rotation_is_a_rotation(run: Run, command: str, way: str) -> None:
    rows = TWENTY if way in ("lines", "rows") else 1
    line = json.dumps(ROTVEC)
    if way == "argument":
        done = run(*ON_A_TURN[command], "-f", "json", line)
    elif way.startswith("line"):
        done = run(*ON_A_TURN[command], "-", "-f", "json", stdin=f"{line}\n" * rows)
    else:
        done = run(*ON_A_TURN[command], "-", "-f", "json", stdin="rotvec_x,rotvec_y,rotvec_z\n" + "0.1,0.2,0.3\n" * rows)
    assert [each.kind for each in readings(done.out)] == ["rotation"] * rows


SIGNED = {
    "rotvec": ("0 0 0.5", "0 0 3.5"),
    "rpy": ("0 0 0.5", "0.5 0 0"),
    "axis_angle": ("0 0 1 0.5", "1 0 0 0"),
    "matrix": ("1 0 0 0 1 0 0 0 1", "0 -1 0 1 0 0 0 0 1"),
    "mrp": ("0 0 0.1", "0.1 0 0"),
    "xyzw": ("0 0 0.6 0.8", "0 0 0 1"),
}


@pytest.mark.parametrize("form", ["json", "yaml", "csv"])
@pytest.mark.parametrize("rows", [1, TWENTY])
@pytest.mark.parametrize("notation", SIGNED)
def test_nothing_computed_is_a_negative_zero(run: Run, notation: str, rows: int, form: str) -> None:
    for numbers in SIGNED[notation]:
        done = run("invert", "--from", notation, "--to", notation, "-f", form, stdin=f"{numbers}\n" * rows)
        assert done.status == 0
        assert not re.search(r"-0\.0\b", done.out)


@pytest.mark.parametrize("way", ["argument", "file", "line", "array", "document"])
@pytest.mark.parametrize("kind", ["twist", "wrench"])
@pytest.mark.parametrize("command", ["convert", "invert"])
def test_what_is_no_pose_is_refused_for_that_reason_on_every_way(run: Run, command: str, kind: str, way: str) -> None:
    parts = ("linear", "angular") if kind == "twist" else ("force", "torque")
    record = {"frame": "base", kind: {part: {"x": 1.0, "y": 2.0, "z": 3.0} for part in parts}}
    line = json.dumps(record)
    texts = {"line": f"{line}\n", "array": f"[{line}]\n", "document": document(record)}
    if way in texts:
        done = run(command, stdin=texts[way])
    else:
        done = run(command, line if way == "argument" else "one.json", files={"one.json": f"{line}\n"})
    assert f"a {kind} cannot be taken for a pose" in done.err
    assert (done.status, done.out) == (1, "")


@pytest.mark.parametrize("form", ["line", "pretty", "document"])
@pytest.mark.parametrize("key", ["pose", "transform", "object"])
def test_what_is_wrong_with_a_message_is_told_of_the_message(run: Run, key: str, form: str) -> None:
    place, turn = {"x": 1.0, "y": 2.0, "z": 3.0}, {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8}
    inner: dict[str, object] = {"translation": place, "rotation": turn} if key == "transform" else {"position": place, "orientation": turn}
    if key == "object":
        inner = {"pose": {**place, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0}}
    record = {"header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "base"}, key: inner}
    text = document(record) if form == "document" else json.dumps(record, indent=2 if form == "pretty" else None)
    done = run("relative", MAP_FROM_BASE, "-", stdin=text)
    reason = "its fields are 'object'" if key == "object" else "A is in 'map' and B in 'base'"
    assert (done.status, done.out) == (1, "")
    assert reason in done.err


IMU = {
    "header": {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "base"},
    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    "angular_velocity": {"x": 1.0, "y": 0.0, "z": 0.0},
    "linear_acceleration": {"x": 0.0, "y": 0.0, "z": 9.5},
}


@pytest.mark.parametrize("way", ["argument", "line", "lines", "document"])
def test_what_names_another_frame_has_moved_whole_or_is_refused(run: Run, way: str) -> None:
    line = json.dumps(IMU)
    texts = {"line": f"{line}\n", "lines": f"{line}\n" * TWENTY, "document": document(IMU)}
    done = run("apply", "--transform", MAP_FROM_BASE, "-f", "json", *([line] if way == "argument" else ["-"]), stdin=texts.get(way, ""))
    if done.status in (1, 2):
        assert done.out == ""
        return
    for found in values(done.out):
        if way in ("argument", "document"):  # keys of their own
            assert (found["frame"], found["stamp_ns"]) == ("map", 1_000_000_000)
            assert [found[f"angular_velocity_{axis}"] for axis in "xyz"] == [0.0, 1.0, 0.0]
            continue
        assert found["header"]["frame_id"] == "map"
        assert found["angular_velocity"] == {"x": 0.0, "y": 1.0, "z": 0.0}


@pytest.mark.parametrize("record", ['{{"{}": [0, 0, 90]}}', '{{"x": 1, "{}": [0, 0, 90]}}', '{{"xyz": [1, 2, 3], "{}": [0, 0, 90]}}'])
@pytest.mark.parametrize(("key", "near"), [("ypr_deg", "rpy_deg"), ("ypr_rad", "rpy_rad"), ("euler_zyx", "euler")])
@pytest.mark.parametrize("rows", [1, TWENTY])
def test_a_rotation_under_a_key_of_others_is_no_further_field(run: Run, rows: int, key: str, near: str, record: str) -> None:
    done = run("convert", "--to", "quaternion", stdin=f"{record.format(key)}\n" * rows)
    assert f"unknown key '{key}', did you mean '{near}'?" in done.err
    assert (done.status, done.out) == (1, "")


def test_a_number_under_such_a_key_stays(run: Run) -> None:
    assert run("invert", stdin='{"xyz": [1, 2, 3], "ypr_deg": 4}\n').out.endswith(', "ypr_deg": 4}\n')


def test_without_a_record_a_key_is_compared_loosely(run: Run) -> None:
    assert "unknown key 'quatern', did you mean 'quaternion'?" in run("convert", stdin='{"quatern": [0, 0, 0, 1]}\n').err
    assert "unknown key 'rotaxion_x', did you mean 'rotation'?" in run("convert", stdin='{"rotaxion_x": [0, 0, 0, 1]}\n').err


@pytest.mark.parametrize("form", [(), ("-f", "csv"), ("-f", "json"), ("--on-error", "null"), ("--on-error", "skip")], ids=" ".join)
@pytest.mark.parametrize("rows", [1, 3, TWENTY])
@pytest.mark.parametrize("into", ["json", "yaml"])
def test_a_record_beyond_the_window_is_left_out_without_a_word(run: Run, into: str, rows: int, form: tuple[str, ...]) -> None:
    records = [{"stamp": 1.0 + (at > 0), "xyz": [1, 5, 3], "rpy_deg": [0, 0, 7]} for at in range(rows)]
    text = "".join(f"{json.dumps(each)}\n" for each in records) if into == "json" else "---\n".join(map(document, records))
    done = run("convert", "--start", "1.5", *form, stdin=text)
    assert (done.status, done.err) == (0, "")
    assert len(re.findall(r"\b2(?:\.0|000000000)\b", done.out)) == rows - 1


@pytest.mark.parametrize("rows", [2, 100])
def test_of_a_message_on_the_edge_of_the_window_all_or_what_is_within_is_told(run: Run, rows: int) -> None:
    pose = {"position": {"x": 1, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    stamps = [[at, at + 1] for at in range(rows)]
    paths = [{"poses": [{"header": {"stamp": {"sec": sec, "nanosec": 0}}, "pose": pose} for sec in each]} for each in stamps]
    window, text = ("convert", "--start", "1"), "".join(f"{json.dumps({'header': each['poses'][0]['header'], **each})}\n" for each in paths)
    stopped, skipped, table = run(*window, stdin=text), run(*window, "--on-error", "skip", stdin=text), run(*window, "-f", "csv", stdin=text)
    assert (stopped.status, skipped.status, skipped.out.count("\n"), table.status) == (1, 3, rows - 1, 0)
    assert "stdin:1: some of its poses are beyond --start or --stop" in stopped.err
    found = [int(line.rpartition(",")[2]) // 1_000_000_000 for line in table.out.splitlines()[1:]]
    assert found == [sec for each in stamps for sec in each if sec >= 1]


@pytest.mark.parametrize("rows", [3, 100])
@pytest.mark.parametrize("dashes", ["--- ", "---\t", "---\n", "---\r\n"])
def test_documents_may_begin_behind_their_dashes(run: Run, dashes: str, rows: int) -> None:
    records = [f'{{"stamp": {at}, "xyz": [{at}, 5, {"no" if at == 1 else 3}], "rpy_deg": [0, 0, 90]}}\n' for at in range(rows)]
    text = "".join(dashes + record for record in records)
    done = run("convert", "--to", "rpy_deg", "--start", "1", "--on-error", "skip", stdin=text)
    assert re.findall(f'^{dashes}{{"stamp": ([0-9]+)', done.out, re.MULTILINE) == [str(at) for at in range(2, rows)]
    assert done.err.splitlines()[-1] == f"frametool: stdin: 1 of {rows} rows skipped"


@pytest.mark.parametrize("quote", ['"', "'"])
@pytest.mark.parametrize("rows", [3, 100])
@pytest.mark.parametrize("more", [(), ("--start", "0")], ids=" ".join)
@pytest.mark.parametrize("form", ["json", "csv"])
def test_a_stamp_between_quotes_is_the_same_text_in_another_format(run: Run, form: str, more: tuple[str, ...], rows: int, quote: str) -> None:
    documents = (f"stamp: {quote}{at}.5{quote}\nxyz: [{at}, 5, 3]\nrpy: [0, 0, 7]\n" for at in range(rows))
    done = run("convert", *more, "-f", form, stdin="---\n".join(documents))
    ends = [line.rpartition(",")[2] if form == "csv" else json.loads(line)["stamp"] for line in done.out.splitlines()]
    assert ends[form == "csv" :] == [f"{at}.5" for at in range(rows)]
