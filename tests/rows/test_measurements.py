"""Measurements read from every form: the same rows are the same numbers, each with its place; what is none is refused."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pytest

from frametool.errors import FormatError, FrametoolError, FrametoolWarning, ValueInvalid
from frametool.formats.load import FrameFile
from frametool.geometry import rigid
from frametool.geometry.transform import Transform
from frametool.rows.measurements import read_measurements, without

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from frametool.fit.blunders import Measurement

    Read = Callable[..., list[Measurement]]

SIGMAS = [0.01, 0.01, 0.02, 0.003, 0.003, 0.004]
DIAGONAL = [SIGMAS[i] ** 2 if i == j else 0.0 for i in range(6) for j in range(6)]
LIKE = "a measurement is {parent: .., child: .., xyz: [..], rpy_deg: [..]}"
EXACT = "give xyz and rpy; what is exact goes into --fix"


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Read:
    monkeypatch.chdir(tmp_path)

    def read_text(text: str | bytes, name: str = "m.yaml") -> list[Measurement]:
        (tmp_path / name).write_bytes(text.encode() if isinstance(text, str) else text)
        return read_measurements([FrameFile(name)])

    return read_text


POSE = "xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]"
ROW = f"parent: base, child: cam, {POSE}"
COVARIANCE = f"covariance: {DIAGONAL}"
SIGMA = "sigma: {xyz_mm: [10, 10, 20], rpy: [0.003, 0.003, 0.004]}"
MESSAGE = {
    "header": {"frame_id": "base"},
    "child_frame_id": "cam",
    "pose": {"pose": {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {}}, "covariance": DIAGONAL},
}
x, y, z, w = Transform.of(1, 2, 3, 0, 0, 0, 1).rotation.from_rpy([0.1, 0.2, 0.3]).components
MESSAGE["pose"]["pose"]["orientation"] = {"x": x, "y": y, "z": z, "w": w}  # type: ignore[index]
FLAT = {"parent": "base", "child": "cam", "x": 1, "y": 2, "z": 3, "roll": 0.1, "pitch": 0.2, "yaw": 0.3}
FLAT_SIGMAS = {f"sigma_{axis}": sigma for axis, sigma in zip(("x", "y", "z", "roll", "pitch", "yaw"), SIGMAS, strict=True)}
C_COLUMNS = {f"c{i + 1}{j + 1}": DIAGONAL[6 * i + j] for i in range(6) for j in range(6)}


def csv(row: dict[str, object], between: str = ",") -> str:
    return "".join(between.join(map(str, cells)) + "\n" for cells in (row.keys(), row.values()))


SPELLINGS = {
    "measurements": ("m.yaml", f"measurements:\n- {{{ROW}, {SIGMA}}}\n", 2),
    "frames": ("m.yaml", f"frames:\n- {{parent: base, name: cam, {POSE}, {COVARIANCE}}}\n", 2),
    "bare list": ("m.yaml", f"# of today\n- {{{ROW}, {SIGMA}}}\n", 2),
    "nested": ("m.yaml", f"frames:\n  base:\n    cam: {{{POSE}, {SIGMA}}}\n", 3),
    "block": ("m.yaml", f"measurements:\n- parent: base\n  child: cam\n  {POSE.replace(', r', chr(10) + '  r')}\n  {SIGMA}\n", 2),
    "degrees": ("m.yaml", f"angles: deg\nmeasurements:\n- {{{ROW.replace('rpy: [0.1, 0.2, 0.3]', f'rpy: {[math.degrees(a) for a in (0.1, 0.2, 0.3)]}')}, sigma: {{xyz: [0.01, 0.01, 0.02], rpy_rad: [0.003, 0.003, 0.004]}}}}\n", 3),
    "json": ("m.json", json.dumps({"measurements": [MESSAGE]}), 1),
    "json lines": ("m.jsonl", "\n" + json.dumps({"parent": "base", "child": "cam", "xyz": [1, 2, 3], "rpy": [0.1, 0.2, 0.3], "covariance": DIAGONAL}) + "\n", 2),
    "frame ids": ("m.jsonl", json.dumps({"frame_id": "base", "child_frame_id": "cam", "xyz": [1, 2, 3], "rpy": [0.1, 0.2, 0.3], "covariance": DIAGONAL}) + "\n", 1),
    "keys as columns": ("m.jsonl", json.dumps(FLAT | FLAT_SIGMAS) + "\n", 1),
    "csv": ("m.csv", csv(FLAT | FLAT_SIGMAS), 2),
    "name": ("m.csv", csv({"name" if key == "child" else key: each for key, each in (FLAT | FLAT_SIGMAS).items()}), 2),
    "entries": ("m.csv", csv(FLAT | C_COLUMNS), 2),
    "semicolons": ("m.csv", csv(FLAT | C_COLUMNS, ";"), 2),
    "tabs": ("m.tsv", csv(FLAT | FLAT_SIGMAS, "\t"), 2),
    "slashes": ("m.csv", csv(FLAT | FLAT_SIGMAS | {"parent": "/base", "child": "/cam"}), 2),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*the leading /")
@pytest.mark.parametrize("name", SPELLINGS)
def test_every_spelling_is_the_same_measurement(read: Read, name: str) -> None:
    file, text, line = SPELLINGS[name]
    (found,) = read(text, file)
    assert (found.parent, found.child, found.place) == ("base", "cam", f"{file}:{line}")
    assert found.transform.is_close(Transform.of(1, 2, 3, x, y, z, w), angle=1e-15, distance=1e-15)
    assert found.covariance == pytest.approx(DIAGONAL, rel=1e-14, abs=1e-30)
    if name != "json":
        kind, angles = found.written or ("", ())
        assert kind == "rpy"
        assert [*angles] == pytest.approx([0.1, 0.2, 0.3], rel=1e-15)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (f"measurements: [{{{ROW}, {SIGMA}, inverse: true}}]", "m.yaml"),
        (json.dumps(FLAT | FLAT_SIGMAS | {"inverse": True}), "m.jsonl"),
        (csv(FLAT | FLAT_SIGMAS | {"inverse": "true"}), "m.csv"),
    ],
)
def test_an_inverse_row_has_its_pose_and_its_covariance_inverted(read: Read, text: str, name: str) -> None:
    (found,) = read(text, name)
    whole = rigid.inverse_full((1.0, 2.0, 3.0, x, y, z, w, *DIAGONAL))
    assert (*found.components, *(found.covariance or ())) == pytest.approx(whole, rel=1e-12, abs=1e-18)
    assert found.written is None


def test_pairs_repeat_in_order_and_other_columns_pass(read: Read) -> None:
    rows = 'parent,child,id,x,y,z,rotvec_x,rotvec_y,rotvec_z,note\nb,c,7,1,2,3,0,0,90,"two\nlines"\nb,c,,1,2,4,0,0,1,\n'
    first, second = read(rows, "m.csv")
    assert (first.id, first.place, second.id, second.place) == ("7", "m.csv:2", None, "m.csv:4")
    assert first.written == ("rotvec", (0.0, 0.0, 90.0))  # as read: ninety radians
    assert first.covariance is second.covariance is None


ROBOT = '<robot name="r"><link name="a"/><link name="b"/>\n<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="1 2 3"/></joint></robot>'
STAMPED = '{"header": {"frame_id": "a", "stamp": {"sec": %d, "nanosec": 0}}, "child_frame_id": "b", "transform": {"translation": {"x": %g, "y": 2, "z": 3}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}}\n'


@pytest.mark.parametrize(
    ("text", "name", "place"),
    [
        (ROBOT, "r.urdf", "r.urdf:2"),
        (STAMPED % (1, 1), "tf.jsonl", "tf.jsonl:1"),
        (STAMPED % (1, 1) * 2, "tf.jsonl", "tf.jsonl:1"),
        ("static_transform_publisher 1 2 3 0 0 0 1 a b\n", "call.sh", "call.sh:1"),
    ],
)
def test_each_edge_of_what_holds_a_tree_measures(read: Read, text: str, name: str, place: str) -> None:
    (found,) = read(text, name)
    assert found == ("a", "b", (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0), None, place, None, None)


REFUSED = {
    "measurements: []": f"m.yaml: no measurements in it; {LIKE}",
    "": f"m.yaml: no measurements in it; {LIKE}",
    "frames: [{name: base}]": f"m.yaml: no measurements in it; {LIKE}",
    "[{parent: a, xyz: [1, 2, 3]}]": f"m.yaml:1: missing child; {LIKE}",
    "[{child: a, xyz: [1, 2, 3]}]": f"m.yaml:1: missing parent; {LIKE}",
    "[{xyz: [1, 2, 3]}]": f"m.yaml:1: missing parent and child; {LIKE}",
    "[{parent: b, child: a}]": f"m.yaml:1:2: no pose; {LIKE}",
    "\n- {parent: a, child: a, xyz: [1, 2, 3]}": "m.yaml:2: 'a' is measured from itself",
    "[{parent: b, child: a, name: c, xyz: [1, 2, 3]}]": "m.yaml:1:21: child says 'a' and name says 'c'; keep one",
    "[{parent: b, child: [a], xyz: [1, 2, 3]}]": "m.yaml:1:21: child must be a frame's name, found a list",
    "[{parent: b, child: a, xyz: [1, 2, 3], sigma: {xyz: 0.1}}]": f"m.yaml:1: sigma of roll is 0: {EXACT}",
    "[{parent: b, child: a, xyz: [1, 2, 3], sigma: {rpy: 0.1}}]": f"m.yaml:1: sigma of x is 0: {EXACT}",
    "[{parent: b, child: a, xyz: [1, 2, 3], sigma: {xyz: [1, 0, 1], rpy: 1}}]": f"m.yaml:1: sigma of y is 0: {EXACT}",
    "[{parent: b, child: a, xyz: [1, 2, 3], sigma: {xyz: 0, rpy: 0}}]": f"m.yaml:1: sigma of x is 0: {EXACT}",
    f"[{{parent: b, child: a, {SIGMA}, {COVARIANCE}, xyz: [1, 2, 3]}}]": "m.yaml:1:24: sigma and covariance in one entry; keep one",
    "[{parent: b, child: a, xyz: [1, 2, 3], scale: 2}]": "m.yaml:1:47: scale: a similarity, not a pose; apply --transform, compose and invert take it",
    "[{parent: b, child: a, xyz: [1, 2, 3], sigmas: {xyz: 1}}]": "m.yaml:1:40: unknown key 'sigmas'; did you mean 'sigma'?",
    "[{parent: b, child: a, samples: [{stamp: 1, xyz: [1, 2, 3]}]}]": "m.yaml:1:24: a frame that moves is not solved for; measure what stands still",
    "frames: {b: {a: {samples: [{stamp: 1, xyz: [1, 2, 3]}]}}}": "m.yaml:1:18: a frame that moves is not solved for; measure what stands still",
    "[{parent: b, child: a, stamp: 1, xyz: [1, 2, 3]}, {parent: b, child: a, stamp: 2, xyz: [1, 2, 4]}]":
        "m.yaml:1: 'a' moves in 'b': another stamp than on line 1; measure what stands still, and leave the stamps out if it does",
    "measurements: {a: 1}": f"m.yaml:1:15: expected a list of measurements, found a mapping; {LIKE}",
    "{measurements: [], frames: []}": "m.yaml:1:20: unknown key 'frames' beside measurements; expected angles",
    "hello: world": f"m.yaml:1:1: expected measurements:, frames: or a row, found the keys 'hello'; {LIKE}",
    "[1, 2, 3]": f"m.yaml:1:2: expected a measurement, found '1'; {LIKE}",
    "just text": f"m.yaml:1:1: expected a list of measurements, found 'just text'; {LIKE}",
    "[{parent: b, child: a, xyz: [1, 2]}]": "m.yaml:1:29: expected 3 numbers (x y z), found 2",
    "[{parent: b, child: a, xyz: [1, 2, 3], inverse: maybe}]": "m.yaml:1:49: inverse must be true or false, found 'maybe'",
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_measurement_is_refused_in_one_line_with_its_place(read: Read, text: str) -> None:
    with pytest.raises(FrametoolError) as caught:
        read(text)
    assert str(caught.value) == REFUSED[text]
    assert len(REFUSED[text]) <= 200


TABLES = {
    "a,b,1,2,3,x": "m.csv:2:yaw: 'x' is not a number",
    ",b,1,2,3,1": f"m.csv:2: missing parent; {LIKE}",
    "a,,1,2,3,1": f"m.csv:2: missing child; {LIKE}",
    "a,a,1,2,3,1": "m.csv:2: 'a' is measured from itself",
    "a,b,1,2,3,1\na,b,1,2": "m.csv:3: expected 6 cells (parent child x y z yaw), found 4",
    "": f"m.csv: no measurements in it; {LIKE}",
}


@pytest.mark.parametrize("rows", TABLES)
def test_rows_of_tables_are_refused_with_their_line(read: Read, rows: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(f"parent,child,x,y,z,yaw\n{rows}\n".rstrip("\n") + "\n", "m.csv")
    assert str(caught.value).startswith(TABLES[rows])


@pytest.mark.parametrize(
    ("columns", "row", "message"),
    [
        ("sigma_xyz", "0.1", f"m.csv:2: sigma of roll is 0: {EXACT}"),
        ("sigma_xyz,sigma_rpy", "-0.1,0.1", "m.csv:2:sigma_xyz: sigma is negative: -0.1"),
        ("sigma_xyz,sigma_x", "0.1,0.1", "m.csv:1: column 'sigma_x': the sigma of x is there already; keep one"),
        ("name", "d", "m.csv:2: child says 'b' and name says 'd'; keep one"),
        ("inverse", "maybe", "m.csv:2: inverse must be true or false, found 'maybe'"),
    ],
)
def test_columns_that_say_too_little_or_too_much_are_refused(read: Read, columns: str, row: str, message: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(f"parent,child,x,y,z,yaw,{columns}\na,b,1,2,3,1,{row}\n", "m.csv")
    assert str(caught.value) == message


@pytest.mark.parametrize("text", ["parent,child,id\na,b,1\n", "stamp,x,y,z,yaw\n1,1,2,3,1\n2,1,2,3,1\n"])
def test_a_table_without_poses_or_names_is_refused(read: Read, text: str) -> None:
    with pytest.raises(FormatError, match=r"columns|missing parent and child"):
        read(text, "m.csv")


def test_a_table_without_rotations_means_what_such_a_document_does(read: Read) -> None:
    with pytest.warns(match="m.csv:1: no rotation among the columns parent, child, x, y, z: each is taken for 0"):
        (row,) = read("parent,child,x,y,z\na,b,1,2,3\n", "m.csv")
    (wanted,) = read("[{parent: a, child: b, xyz: [1, 2, 3]}]", "m.yaml")
    assert row.components == wanted.components == (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


def test_recordings_of_what_moves_are_refused(read: Read) -> None:
    with pytest.raises(FormatError, match="'b' moves in 'a': another stamp than on line 1"):
        read(STAMPED % (1, 1) + STAMPED % (2, 5), "tf.jsonl")


def test_a_leading_slash_is_told_once(read: Read) -> None:
    with pytest.warns(FrametoolWarning, match="the leading / is no part of a name") as told:
        found = read("[{parent: /b, child: a, xyz: [1, 2, 3]}, {parent: /b, child: a, xyz: [1, 2, 3]}]")
    assert {each.parent for each in found} == {"b"}
    assert len(told) == 1


def test_rows_are_dropped_by_their_places(read: Read) -> None:
    rows = read("".join(f"- {{parent: a, child: f{at}, xyz: [1, 2, 3]}}\n" for at in range(5)))
    assert [each.child for each in without(rows, ["m.yaml:2", "m.yaml:5"])] == ["f0", "f2", "f3"]
    assert without(rows, []) == rows
    known = "measurements: m.yaml:1, m.yaml:2, m.yaml:3, m.yaml:4, m.yaml:5"
    for place, near in {"m.yaml:9": "m.yaml:5", "x.yaml:1": "m.yaml:1", "m.yaml": "m.yaml:5"}.items():
        with pytest.raises(ValueInvalid) as caught:
            without(rows, [place])
        assert str(caught.value) == f"no measurement stands at '{place}'; did you mean '{near}'? {known}"
    twice = read("[{parent: a, child: b, xyz: [1, 2, 3]}, {parent: a, child: c, xyz: [1, 2, 3]}]")
    assert [each.place for each in twice] == ["m.yaml:1:2", "m.yaml:1:41"]
    assert [each.child for each in without(twice, ["m.yaml:1:2"])] == ["c"]
    with pytest.raises(ValueInvalid, match=r"at 'm\.yaml:1'; did you mean 'm\.yaml:1:2'\? measurements: m\.yaml:1:2, m\.yaml:1:41"):
        without(twice, ["m.yaml:1"])
    robot = ROBOT.replace("\n", "").replace("</robot>", '<link name="c"/><joint name="k" type="fixed"><parent link="a"/><child link="c"/></joint></robot>')
    with pytest.raises(ValueInvalid, match=r"r\.urdf:1 holds 2 measurements; write each on a line of its own"):
        without(read(robot, "r.urdf"), ["r.urdf:1"])
