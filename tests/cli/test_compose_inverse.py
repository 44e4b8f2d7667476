"""The inverse of any argument of `compose`: inv(POSE), ~POSE, the word inv before it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

A, B = '{"parent": "map", "name": "a", "xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}', '{"parent": "map", "name": "b", "xyz": [4, 2, 3]}'
SEEN = {"name": "b", "parent": "a", "xyz": [0.0, -3.0, 0.0], "rpy_deg": {"roll": 0.0, "pitch": 0.0, "yaw": -90.0}}
HOW = ("--to", "rpy_deg", "-f", "json")


@pytest.mark.parametrize("spelled", [[f"inv({A})"], [f"~{A}"], ["inv", A], [f"inv( {A} )"], [f"~~~{A}"], ["inv", f"~inv({A})"], ["inv(a.json)"], ["~a.json"], ["inv", "a.json"]])
def test_a_pose_seen_from_another_is_one_product(spelled: list[str], run: Callable[..., Any]) -> None:
    done = run("compose", *spelled, B, *HOW, files={"a.json": A})
    assert (done.status, json.loads(done.out)) == (0, SEEN)


@pytest.mark.parametrize("spelled", [["inv(-)"], ["~-"], ["inv", "-"]])
def test_rows_of_standard_input_are_inverted_too(spelled: list[str], run: Callable[..., Any]) -> None:
    done = run("compose", *spelled, B, stdin=A + "\n")
    assert done.out == '{"parent": "a", "name": "b", "xyz": [0.0, -3.0, 0.0], "rpy_deg": [0.0, 0.0, -90.0]}\n'
    table = run("compose", *spelled, '{"xyz": [4, 2, 3]}', stdin="id,x,y,z,roll_deg,pitch_deg,yaw_deg\n7,1,2,3,0,0,90\n")
    assert table.out.splitlines()[1] == "7,0.0,-3.0,0.0,0.0,0.0,-90.0"


@pytest.mark.parametrize(("arguments", "status", "told"), [
    (["inv"], 2, "nothing follows it"),
    ([A, "inv"], 2, "nothing follows it"),
    (["inv()", A], 2, "there is no pose whose inverse is meant"),
    (["inv(nope.yaml)", A], 5, "nope.yaml: no such file"),
    ([f"inv({A})", A, f"inv({B})", B], 1, "frames do not touch"),
    (["~-", "-"], 2, "standard input can be read once"),
])  # fmt: skip
def test_what_has_no_inverse_is_said(arguments: list[str], status: int, told: str, run: Callable[..., Any]) -> None:
    done = run("compose", *arguments)
    assert done.status == status
    assert told in done.err


STAMPED = "{xyz: [1, 0, 0], stamp: 1.5, label: a}"
LATER = "{xyz: [0, 2, 0], stamp: 2.5}"


def test_a_result_says_what_the_last_argument_says_and_what_the_others_say_is_told(run: Callable[..., Any]) -> None:
    done = run("compose", STAMPED, LATER, "-f", "json")
    assert done.out == '{"xyz": [1.0, 2.0, 0.0], "quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}\n'
    assert "argument: 'label' left out: only its pose is used\n" in done.err
    alone = run("relative", STAMPED, "{xyz: [0, 2, 0]}", "-f", "json")
    assert (json.loads(alone.out)["stamp"], json.loads(alone.out)["label"], alone.err) == (1.5, "a", "")
    between = run("interpolate", STAMPED, "{xyz: [0, 2, 0]}", "0.5")
    assert between.err == "frametool: warning: argument: 'label' left out: only its pose is used\n"


def test_a_table_among_the_arguments_is_what_input_would_be(run: Callable[..., Any]) -> None:
    rows = "id,x,y,z,qx,qy,qz,qw\n7,1,2,3,0,0,0,1\n8,4,5,6,0,0,0,1\n"
    fixed = "{xyz: [1, 0, 0]}"
    for arguments in (("compose", fixed, "rows.csv"), ("compose", "inv(rows.csv)", fixed), ("relative", "rows.csv", fixed)):
        piped = [{"rows.csv": "-", "inv(rows.csv)": "inv(-)"}.get(each, each) for each in arguments]
        assert run(*arguments, files={"rows.csv": rows}) == run(*piped, stdin=rows)
