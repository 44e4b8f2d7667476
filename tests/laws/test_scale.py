"""What is scaled is no pose: refused wherever a pose is read, named, and never normalised away; a table's column passes."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from ways import STREAMS, ways

if TYPE_CHECKING:
    from conftest import Outcome
    from ways import Run

TURN = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
BY_A_MATRIX = "matrix is 2 times a rotation: a similarity, not a pose (--scale of compose, invert and apply takes it)"
BY_A_KEY = "scale: a similarity, not a pose; apply --transform, compose and invert take it"
TAKE_IT = ("invert", "compose")
POSES: dict[str, dict[str, Any]] = {
    "grammar": {"xyz": [1, 2, 3], "rpy": [0, 0, 1]},
    "position": {"xyz": [1, 2, 3]},
    "flat": {"x": 1, "y": 2, "z": 3, "qx": 0, "qy": 0, "qz": 0, "qw": 1},
    "message": {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
}
COMMANDS = (("convert",), ("invert",), ("relative", "{xyz: [1, 0, 0]}"), ("compose", "{xyz: [1, 0, 0]}"), ("mean",))


def scales(text: str) -> set[float]:
    return {float(found) for found in re.findall(r'"?scale"?: ([\d.]+)', text)}


def times(size: float, *, whole: bool = False) -> list[list[float]]:
    rows = [[size * part for part in row] for row in TURN]
    return [*([*row, 1.0] for row in rows), [0.0, 0.0, 0.0, 1.0]] if whole else rows


def given(run: Run, command: tuple[str, ...], way: Any) -> Outcome:
    stream = way.argument == "-"
    argument = () if stream and command in (("convert",), ("mean",)) else (way.argument,)
    return run(*command, *argument, "-f", "json", stdin=way.stdin, files=dict(way.files))


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each[0])
@pytest.mark.parametrize("form", ["argument", "file", *STREAMS])
@pytest.mark.parametrize("normalize", [(), ("--normalize",)], ids=["", "normalize"])
@pytest.mark.parametrize("whole", [False, True])
def test_a_scaled_matrix(
    run: Run, command: tuple[str, ...], form: str, normalize: tuple[str, ...], whole: bool  # noqa: FBT001
) -> None:
    entries = times(2.0, whole=whole)
    letter, size = ("m", 4) if whole else ("r", 3)
    cells = {f"{letter}{row}{column}": entries[row - 1][column - 1] for row in range(1, size + 1) for column in range(1, size + 1)}
    for way in ways(form, {"matrix": entries}, cells):
        done = given(run, (*command[:1], *normalize, *command[1:]), way)
        assert (done.status, done.out) == (1, "")
        assert BY_A_MATRIX in done.err
        assert "--normalize" not in done.err


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each[0])
@pytest.mark.parametrize("form", ["argument", "file", *STREAMS[:-1]])
@pytest.mark.parametrize("pose", POSES)
def test_a_scale_beside_a_pose(run: Run, command: tuple[str, ...], form: str, pose: str) -> None:
    for record in (POSES[pose] | {"scale": 2}, {"pose": POSES[pose], "scale": 2}):
        for way in ways(form, record):
            done = given(run, command, way)
            if command[0] in TAKE_IT and "pose" not in record:
                assert (done.status, 0.5 if command[0] == "invert" else 2.0) == (0, *scales(done.out)), way
                continue
            assert (done.status, done.out) == (1, ""), way
            assert BY_A_KEY in done.err
    for one in (1, 1.0, [1, 1, 1], {"x": 1, "y": 1.0, "z": 1}):
        for way in ways(form, POSES[pose] | {"scale": one}):
            assert given(run, command, way).status == 0


@pytest.mark.parametrize("command", [("convert",), ("invert",), ("compose", "{xyz: [1, 0, 0]}", "-")])
@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("scale", [-2, 0, [1, 1, 2], {"x": 1, "y": 1, "z": 2}, "a", None, True])
def test_among_many_as_alone(run: Run, command: tuple[str, ...], pose: str, scale: Any) -> None:
    ones: Any = [1, 1, 1] if type(scale) is list else {"x": 1, "y": 1, "z": 1} if type(scale) is dict else 1
    good, bad = (json.dumps(POSES[pose] | {"scale": each}) + "\n" for each in (ones, scale))
    done = run(*command, "--on-error", "skip", stdin=good * 20 + bad + good * 20)
    assert (done.status, done.out.count("\n")) == (3, 40)
    assert re.search(r"stdin:21:scale\S*: .*(a similarity, not a pose|positive|number)", done.err)


@pytest.mark.parametrize(
    "tree",
    [
        "{frames: {a: {b: {xyz: [1, 0, 0], scale: 2}}}}",
        "{frames: [{name: b, parent: a, xyz: [1, 0, 0], scale: 2}]}",
        "{frames: [{name: b, parent: a, samples: [{stamp: 1, xyz: [1, 0, 0], scale: 2}]}]}",
    ],
)
def test_in_trees(run: Run, tree: str) -> None:
    done = run("lookup", tree, "a", "b")
    assert (done.status, done.out) == (1, "")
    assert BY_A_KEY in done.err
    matrix = json.dumps(times(2.0))
    done = run("lookup", f"{{frames: {{a: {{b: {{matrix: {matrix}}}}}}}}}", "a", "b", "--normalize")
    assert (done.status, done.out) == (1, "")
    assert BY_A_MATRIX in done.err


@pytest.mark.parametrize("text", ["2 0 0 0 2 0 0 0 2", "2 0 0 1 0 2 0 1 0 0 2 1", "2 0 0 1 0 2 0 1 0 0 2 1 0 0 0 1"])
def test_bare_numbers_and_what_is_pasted(run: Run, text: str) -> None:
    numbers = text.split()
    width = 3 if len(numbers) == 9 else 4
    rows = [numbers[at : at + width] for at in range(0, len(numbers), width)]
    pasted = "[" + "\n ".join(f"[{'. '.join(row)}.]" for row in rows) + "]"
    for arguments, stdin in ((numbers, ""), ([pasted], ""), ([], pasted)):
        done = run("convert", "--normalize", *arguments, stdin=stdin)
        assert (done.status, done.out) == (1, "")
        assert BY_A_MATRIX in done.err


def test_what_is_no_scale_of_a_pose_passes(run: Run) -> None:
    table = "x,y,z,qx,qy,qz,qw,scale\n1,2,3,0,0,0,1,2.5\n"
    assert run("convert", "--to", "quaternion", stdin=table).out == table.replace("0,0,0,1,", "0.0,0.0,0.0,1.0,")
    marker = json.dumps({"pose": POSES["message"], "scale": {"x": 1, "y": 2, "z": 3}}) + "\n"
    assert '"scale": {"x": 1, "y": 2, "z": 3}' in run("convert", stdin=marker).out
    points = "".join(json.dumps({"point": [1, 2, 3], "scale": size}) + "\n" for size in range(20))
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", stdin=points)
    assert [json.loads(line) for line in done.out.splitlines()] == [
        {"point": [2.0, 2.0, 3.0], "scale": size} for size in range(20)
    ]


@pytest.mark.parametrize("scale", [".nan", ".inf", "1e999", "0", "-1"])
def test_a_scale_that_is_none_is_bad_data_as_other_numbers_are(run: Run, scale: str) -> None:
    for pose in (f"{{xyz: [1, 2, 3], scale: {scale}}}", "{xyz: [1, 2, .nan]}"):
        assert run("apply", "--transform", pose, "1", "2", "3").status == 1


@pytest.mark.parametrize("count", [0, 1, 70])
@pytest.mark.parametrize("fmt", ["json", "yaml", "csv"])
def test_a_scale_that_comes_with_a_matrix_counts(run: Run, count: int, fmt: str) -> None:
    for size, status in ((1.0, 0), (2.0, 1)):  # one that says it too may mean 2 or 4
        record = json.dumps({"xyz": [1, 2, 3], "matrix": times(size), "scale": 2})
        given = ("-",) if count else (record,)
        done = run("invert", "--scale", *given, "--to", "quaternion", "-f", fmt, stdin=f"{record}\n" * count)
        assert done.status == status
        assert (BY_A_MATRIX in done.err) if status else done.out.rstrip("}\n").endswith("0.5"), done.out
