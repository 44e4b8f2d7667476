from __future__ import annotations

import json
from typing import Any

import pytest
from flow import INVERT, MOVE, Asked, Flow, asked, convert, flow

from frametool.errors import FrametoolWarning

MANY = 80  # records: beyond what is done singly


def check(form: str, record: str, wanted: str, request: Asked) -> None:
    """Run one record alone, and many of it."""
    between = "" if form == "json" else "---\n"
    assert flow(record.encode(), request, form).text.decode() == wanted
    many = flow(between.join([record] * MANY).encode(), request, form)
    assert many.text.decode() == between.join([wanted] * MANY)


@pytest.mark.parametrize(
    ("record", "wanted"),
    [
        ('{"x":1,"y":2,"z":3,"k":[1, {"a":null}],"n":"é\\u00e9"}\n', '{"x":-1.0,"y":3.0,"z":6.0,"k":[1, {"a":null}],"n":"é\\u00e9"}\n'),
        ('{ "point" : [1, 2,3], "frame": 7 }\n', '{ "point" : [-1.0, 3.0,6.0], "frame": 7 }\n'),
        ('{"header": {"seq": 1}, "point": {"x": 1, "y": 2, "z": 3}}\r\n', '{"header": {"seq": 1}, "point": {"x": -1.0, "y": 3.0, "z": 6.0}}\r\n'),
        ('{"vector": [1, 0, 0], "1e3": 1e3}\n', '{"vector": [0.0, 1.0, 0.0], "1e3": 1e3}\n'),
        ('{"xyz_mm": [1000, 2000, 3000]}\n', '{"xyz_mm": [-1000.0, 3000.0, 6000.0]}\n'),
        ("[1, 2, 3]\n", "[-1.0, 3.0, 6.0]\n"),
    ],
)  # fmt: skip
def test_json_points_keep_their_spelling_and_all_other_keys(record: str, wanted: str) -> None:
    check("json", record, wanted, MOVE)


@pytest.mark.parametrize(
    ("record", "wanted"),
    [
        ("# c\nname: a  # b\nxyz: [1, 2, 3]\nrpy_deg: [0, 0, 90]\n", "# c\nparent: a\nxyz: [-2.0, 1.0, -3.0]\nrpy_deg: [0.0, 0.0, -90.0]\n"),
        ("{xyz: {x: 1}, quaternion: {x: 0, y: 0, z: 0, w: 1}}\n", "{xyz: [-1.0, 0.0, 0.0], quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}}\n"),
        ("rpy: [0, 0, 90deg]\n", "rpy_deg: {roll: 0.0, pitch: 0.0, yaw: -90.0}\n"),
        ("xyz: [1e-5, 0, 0]\n", "xyz: [-1.0e-05, 0.0, 0.0]\n"),
    ],
)  # fmt: skip
def test_yaml_poses_keep_their_spelling(record: str, wanted: str) -> None:
    request = INVERT._replace(rename=lambda parent, name: (name, parent))
    assert flow(record.encode(), request, "yaml").text.decode() == wanted
    many = flow("---\n".join([record] * MANY).encode(), request, "yaml")
    assert many.text.decode() == "---\n".join([wanted] * MANY)


def test_ros_messages_are_moved_where_they_hold_their_pose() -> None:
    record = (
        "header:\n  stamp:\n    sec: 1795206353\n    nanosec: 7\n  frame_id: odom\n"
        "pose:\n  position:\n    x: 1.0\n    y: 2.0\n    z: 3.0\n"
        "  orientation:\n    x: 0.0\n    y: 0.0\n    z: 0.0\n    w: 1.0\n---\n"
    )
    request = MOVE._replace(rename=lambda _parent, name: ("map", name))
    wanted = (
        record.replace("odom", "map")
        .replace("x: 1.0", "x: -1.0")
        .replace("y: 2.0", "y: 3.0")
        .replace("z: 3.0", "z: 6.0")
    )
    half = "0.7071067811865476"
    wanted = wanted.replace("z: 0.0\n    w: 1.0", f"z: {half}\n    w: {half}")
    assert flow(record.encode(), request, "yaml").text.decode() == wanted
    assert flow(record.encode() * MANY, request, "yaml").text.decode() == wanted * MANY


def test_stamps_and_other_numbers_of_messages_may_differ_between_records() -> None:
    records = [
        f'{{"id": {i}, "t": "n{i}", "x": {i}, "y": 0, "z": 0, "ok": {str(i % 2 == 0).lower()}}}\n' for i in range(MANY)
    ]
    result = flow("".join(records).encode(), MOVE, "json")
    for i, line in enumerate(result.text.splitlines()):
        assert json.loads(line) == {"id": i, "t": f"n{i}", "x": 1.0, "y": 2.0 + i, "z": 3.0, "ok": i % 2 == 0}


@pytest.mark.parametrize("layout", ["[\n{0},\n{1}\n]\n", "[{0},{1}]", "[{0}, \n{1}]\n"])
@pytest.mark.parametrize("record", ['{"x": 1, "y": 2, "z": 3}', '{\n "x": 1, "y": 2, "z": 3\n}'])
@pytest.mark.parametrize("count", [1, MANY])
def test_arrays_stay_arrays(layout: str, record: str, count: int) -> None:
    text = layout.replace("{0}", ",\n".join([record] * count)).replace("{1}", record)
    moved = text.replace('"x": 1, "y": 2, "z": 3', '"x": -1.0, "y": 3.0, "z": 6.0')
    assert flow(text.encode(), MOVE, "json").text.decode() == moved


@pytest.mark.parametrize("size", [1, 50, 333])
def test_the_size_of_blocks_does_not_show_in_records(size: int) -> None:
    text = "".join(
        f'{{"x": {i}, "y": 0, "z": 0}}\n' if i % 3 else f'{{"k": "{i}", "point": [{i}, 0, 0]}}\n' for i in range(90)
    )
    assert flow(text.encode(), MOVE, "json", size=size) == flow(text.encode(), MOVE, "json")


def test_one_record_alone_gives_what_it_gives_among_many() -> None:
    record = '{"name": "a", "xyz": [0.1, 0.2, 0.3], "quaternion": {"x": 0.1, "y": -0.2, "z": 0.3, "w": 0.9273618495495703}}\n'
    for request in (INVERT, MOVE, convert("matrix"), asked(right=((1.0, 0.0, 0.0, 0.0, 0.6, 0.0, 0.8),))):
        assert flow(record.encode() * MANY, request, "json").text == flow(record.encode(), request, "json").text * MANY


@pytest.mark.parametrize(
    "spec", ["rpy", "rpy_deg", "euler:rzyx", "axis_angle", "rotvec", "matrix", "wxyz", "six_d", "mrp"]
)
@pytest.mark.parametrize("form", ["json", "yaml"])
def test_records_go_to_every_representation_and_back(spec: str, form: str) -> None:
    record = {"json": '{"k": 1, "xyz": [1.0, 2.0, 3.0], "quaternion": {"x": 0.5, "y": 0.5, "z": -0.5, "w": 0.5}}\n',
              "yaml": "k: 1\nxyz: [1.0, 2.0, 3.0]\nquaternion: {x: 0.5, y: 0.5, z: -0.5, w: 0.5}\n---\n"}[form].encode()  # fmt: skip
    for text in (record, record * MANY):
        there = flow(text, convert(spec), form)
        assert there.status == 0
        back = flow(there.text, convert("quaternion"), form)
        assert back.text.count(b"quaternion") == text.count(b"quaternion")


FAULTS = [
    ('{"x": "foo", "y": 2, "z": 3}', "x"),
    ('{"x": NaN, "y": 2, "z": 3}', "x"),
    ('{"x": 1e999, "y": 2, "z": 3}', "x"),
    ('{"point": [1, 2]}', "point"),
    ('{"x": 1, "y": 2', ""),
    ('{"a": 1}', ""),
    ('{"x": 1, "x": 2, "y": 3, "z": 4}', ""),
    ("foo", ""),
    ('{"point": [1, 2, 3], "rpy_dge": [0, 0, 1]}', "rpy_dge"),
    ('{"xyz": [1, 2, 3], "xyzw": [0, 0, 0, 0]}', "xyzw"),
]


@pytest.mark.parametrize(("bad", "key"), FAULTS)
@pytest.mark.parametrize("before", [2, MANY])
def test_bad_records_are_told_with_line_and_key(bad: str, key: str, before: int) -> None:
    good = '{"x": 1, "y": 2, "z": 3}\n'
    text = (good * before + bad + "\n" + good).encode()
    stopped = flow(text, MOVE, "json")
    assert (stopped.status, stopped.text.count(b"\n")) == (1, before)
    assert stopped.told[0].startswith(f"in:{before + 1}:")
    assert key in stopped.told[0]
    skipped = flow(text, MOVE._replace(on_error="skip"), "json")
    assert (skipped.status, skipped.text.count(b"\n")) == (3, before + 1)
    null = flow(text, MOVE._replace(on_error="null"), "json")
    assert null.text.splitlines()[before] == b"null" or b"null" in null.text.splitlines()[before]


def test_a_bad_document_leaves_the_others_alone() -> None:
    good = "xyz: [1, 2, 3]\n---\n"
    text = (good * 3 + "xyz: [1, 2\n---\n" + good * 3).encode()
    result: Flow = flow(text, MOVE._replace(on_error="skip"), "yaml")
    assert (result.status, result.text.count(b"xyz")) == (3, 6)
    assert result.told[0].startswith("in:")


@pytest.mark.parametrize("count", [1, 3, MANY])
@pytest.mark.filterwarnings("default::frametool.errors.FrametoolWarning")
def test_a_frame_that_the_result_does_not_know_is_left_out_and_told_once(count: int) -> None:
    with pytest.warns(FrametoolWarning, match="in:1: frame 'a' is left out") as told:
        found = flow(b'{ "point" : [1, 2,3], "frame": "a" }\n' * count, MOVE, "json")
    assert found.text == b'{ "point" : [-1.0, 3.0,6.0] }\n' * count
    assert len(told) == 1


@pytest.mark.parametrize("copies", [1, 80])
@pytest.mark.parametrize("specs", ["rpy_deg,rotvec", "rotvec,rpy_deg", "rpy_rad,rotvec_deg,axis_angle"])
def test_each_key_of_several_notations_says_the_unit_of_its_own_angles(copies: int, specs: str) -> None:
    text = b'{"quaternion": {"x": 0, "y": 0, "z": 0.6, "w": 0.8}}\n' * copies
    together = json.loads(flow(text, convert(specs), "json").text.splitlines()[-1])
    for spec in specs.split(","):
        alone = json.loads(flow(text, convert(spec), "json").text.splitlines()[-1])
        assert together | alone == together


def test_a_list_on_lines_of_its_own_becomes_null_behind_its_key(run: Any) -> None:
    text = "id: 0\nxyz:\n- east\n- 1\n- 2\nrpy: [0, 0, 1]\n"
    done = run("convert", "--on-error", "null", "--to", "rpy_deg", stdin=f"{text}---\nid: 2\nxyz: [1, 2, 3]\n")
    assert done.out.startswith("id: 0\nxyz: null\nrpy: null\n---\nid: 2\n")
