"""Single results as CSV: no column twice, none dropped."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Protocol

import pytest

if TYPE_CHECKING:
    from conftest import Outcome

    class Run(Protocol):
        def __call__(self, *arguments: str, stdin: str = ..., files: dict[str, str] | None = None) -> Outcome: ...


def test_two_notations_that_need_one_column_are_refused(run: Run) -> None:
    outcome = run("convert", "{rpy: [1, 2, 3]}", "--to", "euler:rxyz,euler:rzxy", "-f", "csv")
    assert (outcome.status, outcome.out) == (1, "")
    assert "columns euler_1, euler_2, euler_3 would appear twice" in outcome.err


def test_an_angle_that_the_notation_says_stands_once(run: Run) -> None:
    text = run("relative", "{xyz: [1, 0, 0]}", "{rpy: [0, 0, 1]}", "--to", "axis_angle", "-f", "csv").out
    header = text.splitlines()[0].split(",")
    assert header == ["x", "y", "z", "axis_x", "axis_y", "axis_z", "angle", "distance", "angle_deg"]
    assert run("invert", stdin=text).status == 0


def test_the_columns_are_those_of_all_results(run: Run) -> None:
    text = run("convert", "{xyz: [1, 0, 0], rpy: [0, 0, 0]}", "{name: b, rpy: [0, 0, 1]}", "-f", "csv").out
    first, second = csv.DictReader(io.StringIO(text))
    assert (first["x"], first["name"], second["x"], second["name"]) == ("1.0", "", "", "b")


@pytest.mark.parametrize(("row", "column"), [("base,,4,5,6,0", "name"), (",lidar,4,5,6,0", "parent")])
def test_a_row_of_a_tree_without_the_name_of_a_frame_is_an_error(run: Run, row: str, column: str) -> None:
    files = {"t.csv": f"parent,name,x,y,z,yaw\nbase,camera,1,2,3,0\n{row}\n"}
    for command in (("tree", "t.csv"), ("lookup", "t.csv", "base", "camera")):
        done = run(*command, files=files)
        assert (done.status, done.out, done.err) == (1, "", f"frametool: t.csv:3:{column}: no name of a frame\n")


def test_angles_of_a_tree_that_look_like_degrees_are_a_warning(run: Run) -> None:
    files = {"t.csv": "name,parent,x,y,z,yaw\na,base,1,2,3,0\nlidar,base,1,2,3,90\n"}
    said = "rpy 90 is more than a full turn in radians; degrees? name the columns _deg"
    assert run("lookup", "t.csv", "base", "lidar", files=files).err == f"frametool: warning: t.csv:3: {said}\n"
    assert run("check", "t.csv").out == f"t.csv:3:1: warning: {said} [degrees]\n"


@pytest.mark.parametrize("column", ["sigma_xyz", "c11", "sigma_yaw_deg"])
def test_a_covariance_in_a_tree_of_rows_is_left_out_with_a_warning(run: Run, column: str) -> None:
    files = {"t.csv": f"name,parent,x,y,z,yaw,{column}\na,base,1,2,3,0,0.1\n"}
    said = "frametool: warning: t.csv:1: covariances left out: a table of frames has none\n"
    assert run("lookup", "t.csv", "base", "a", files=files).err == said
