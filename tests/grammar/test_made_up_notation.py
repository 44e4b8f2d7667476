"""A notation is one row of the table: rows made up here serve the whole command line, and nothing else is told."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

# Gibbs' vector, and position and quaternion in seven numbers: both get their columns, shape and label from the row
ROWS = """
import sys
from frametool.geometry.representations import MAP, REPRESENTATIONS, ROTATIONS, Representation, Whole

def to_quaternion(numbers, xp, _degrees, _axes):
    x, y, z = numbers
    norm = xp.sqrt(1.0 + x * x + y * y + z * z)
    return x / norm, y / norm, z / norm, 1.0 / norm

def from_quaternion(quaternion, _xp, _degrees, _axes):
    x, y, z, w = quaternion
    return x / w, y / w, z / w

seven = Whole(tuple("s_1 s_2 s_3 s_4 s_5 s_6 s_7".split()), lambda p, q: (*p, *q), lambda n: (tuple(n[:3]), tuple(n[3:])))
REPRESENTATIONS["gibbs"] = ROTATIONS["gibbs"] = Representation(
    ("gibbs_x", "gibbs_y", "gibbs_z"), (), "Gibbs vector: axis times tan(angle/2)", label="Gibbs vector", overview=("",),
    forward=to_quaternion, backward=from_quaternion, name="gibbs",
)
REPRESENTATIONS["seven"] = ROTATIONS["seven"] = Representation(
    ("u_1", "u_2", "u_3", "u_4"), (), "position and quaternion in one", whole=seven,
    forward=lambda n, _xp, _degrees, _axes: n, backward=lambda q, _xp, _degrees, _axes: q, name="seven",
)
from frametool.cli import run
sys.exit(run(sys.argv[1:]))
"""
QUARTER = "0 0 90"
POSE = '{"xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}'
QUATERNION = [0.0, 0.0, 0.7071067811865476, 0.7071067811865476]


def run(*arguments: str, stdin: str = "", **environment: str) -> str:
    """Run the command line with the rows added; return what it printed."""
    done = subprocess.run(
        [sys.executable, "-c", ROWS, *arguments], input=stdin, capture_output=True, text=True, check=False,
        env={"PATH": "", "COLUMNS": "200", **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def numbers(text: str) -> list[float]:
    return [float(each) for each in text.split(",")]


def test_bare_numbers_and_results_are_in_the_notation() -> None:
    there = json.loads(run("convert", "--from", "rpy_deg", *QUARTER.split(), "--to", "gibbs", "-f", "json"))
    assert there["gibbs"] == pytest.approx([0.0, 0.0, 1.0])
    back = json.loads(run("convert", "--from", "gibbs", "0", "0", "1", "--to", "xyzw", "-f", "json"))
    assert back["xyzw"] == pytest.approx(QUATERNION)


def test_its_key_is_read_in_documents() -> None:
    for form in ("json", "yaml"):
        text = run("convert", POSE, "--to", "gibbs,quaternion", "-f", form)
        assert json.loads(run("invert", "-", "--to", "gibbs", "-f", "json", stdin=text))["gibbs"][2] == pytest.approx(-1.0)


def test_text_for_people_calls_it_by_its_label() -> None:
    assert "Gibbs vector" in run("convert", POSE, "--to", "gibbs", "-f", "text")
    assert "Gibbs vector" in run("convert", POSE, "-f", "text")


def test_json_lines_are_rewritten_to_it_and_back() -> None:
    lines = f"{POSE}\n" * 40
    there = run("convert", "--to", "gibbs", "--in", "json", stdin=lines)
    assert [json.loads(line)["gibbs"][2] for line in there.splitlines()] == pytest.approx([1.0] * 40)
    back = run("convert", "--to", "xyzw", "--in", "json", stdin=there)
    assert json.loads(back.splitlines()[7])["xyzw"] == pytest.approx(QUATERNION)


def test_columns_of_a_table_are_its_own_and_no_position() -> None:
    table = "id,x,y,z,qx,qy,qz,qw\na,1,2,3,0,0,0.7071067811865476,0.7071067811865476\n"
    there = run("convert", "--to", "gibbs", stdin=table)
    assert there.splitlines()[0] == "id,x,y,z,gibbs_x,gibbs_y,gibbs_z"
    inverse = run("invert", stdin=there)
    assert inverse.splitlines()[0] == there.splitlines()[0]
    assert numbers(inverse.splitlines()[1].removeprefix("a,")) == pytest.approx([-2.0, 1.0, -3.0, 0.0, 0.0, -1.0])
    assert run("convert", "--from", "gibbs", "--to", "gibbs", stdin="0 0 1\n") == "0.0 0.0 1.0\n"
    alone = run("invert", stdin="gibbs_x,gibbs_y,gibbs_z\n0,0,1\n")
    assert numbers(alone.splitlines()[1]) == pytest.approx([0.0, 0.0, -1.0])


def test_csv_of_single_results_reads_back() -> None:
    text = run("convert", POSE, "--to", "gibbs", "-f", "csv")
    assert text.splitlines()[0] == "x,y,z,gibbs_x,gibbs_y,gibbs_z"
    assert numbers(run("invert", stdin=text).splitlines()[1])[5] == pytest.approx(-1.0)


def test_help_and_completion_name_it() -> None:
    assert "gibbs" in run("convert", "--help")
    assert "plain\tgibbs\t" in run("frametool convert --to gi", _FRAMETOOL_COMPLETE="words").splitlines()


def test_a_notation_that_carries_the_position_takes_it_in() -> None:
    there = json.loads(run("convert", POSE, "--to", "seven", "-f", "json"))
    assert there == {"seven": pytest.approx([1.0, 2.0, 3.0, *QUATERNION])}
    again = json.loads(run("convert", json.dumps(there), "--to", "xyzw", "-f", "json"))
    assert again == {"xyz": pytest.approx([1.0, 2.0, 3.0]), "xyzw": pytest.approx(QUATERNION)}
    table = "id,x,y,z,qx,qy,qz,qw\na,1,2,3,0,0,0.7071067811865476,0.7071067811865476\n"
    moved = run("convert", "--to", "seven", stdin=table)
    assert moved.splitlines()[0] == "id,s_1,s_2,s_3,s_4,s_5,s_6,s_7"
    inverse = numbers(run("invert", stdin=moved).splitlines()[1].removeprefix("a,"))
    assert inverse == pytest.approx([-2.0, 1.0, -3.0, 0.0, 0.0, -QUATERNION[2], QUATERNION[3]])
