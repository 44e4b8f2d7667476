"""The name of a stamp says its unit, in whatever spelling, for every command and form that reads stamps."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome
    from ways import Run

DRIVE = "frames: [{name: base, parent: map, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 0.000001, xyz: [1, 0, 0]}]}]\n"
NANOSECONDS = ("stamp_ns", "stamp [ns]", "stamp[ns]", "stamp (ns)", "stamp(ns)", "timestamp [ns]", "time_ns", "t [ns]", "t_ns")
HASHED = "#timestamp [ns]"  # as EuRoC begins its header
OTHERS = {"[us]": "0.5", "(us)": "0.5", "[ms]": "0.0005", "(ms)": "0.0005"}
POSES = "x,y,z,qx,qy,qz,qw\n"
ZERO, ONE = ",0,0,0,0,0,0,1\n", ",1,0,0,0,0,0,1\n"


def two_poses(name: str, later: str) -> str:
    """Write a metre in five hundred nanoseconds."""
    return f"{name},{POSES}0{ZERO}{later}{ONE}"


def applied(run: Run, name: str, later: str) -> tuple[Outcome, Any]:
    text = f"{name},frame,x,y,z\n{later},base,0,0,0\n"
    done = run("apply", "drive.yaml", "map", "--time-column", name.lstrip("#"), stdin=text, files={"drive.yaml": DRIVE})
    return done, done.out.rpartition("map,")[2].split(",")[0]


def asked(run: Run, name: str, later: str) -> tuple[Outcome, Any]:
    arguments = ("calc", "--tree", "drive.yaml", "(map<-base @ row) * row", "--as", "point", "--time-column", name.lstrip("#"))
    done = run(*arguments, stdin=f"{name},x,y,z\n{later},0,0,0\n", files={"drive.yaml": DRIVE})
    return done, done.out.rpartition(f"\n{later},")[2].split(",")[0]


def velocity(run: Run, name: str, later: str) -> tuple[Outcome, Any]:
    done = run("relative", "--consecutive", "--velocity", "--time-column", name.lstrip("#"), stdin=two_poses(name, later))
    return done, done.out.split(",")[-6:-5]


def velocity_of_itself(run: Run, name: str, later: str) -> tuple[Outcome, Any]:
    done = run("relative", "--consecutive", "--velocity", stdin=two_poses(name, later))
    return done, done.out.split(",")[-6:-5]


def as_tum(run: Run, name: str, later: str) -> tuple[Outcome, Any]:
    done = run("convert", "-f", "tum", stdin=two_poses(name, later))
    return done, [row.split()[0] for row in done.out.splitlines()]


def as_json(run: Run, name: str, later: str) -> tuple[Outcome, Any]:
    done = run("convert", "-f", "json", stdin=two_poses(name, later))
    return done, [json.loads(row).get("stamp_ns") for row in done.out.splitlines()]


def as_tree(run: Run, name: str, later: str) -> tuple[Outcome, Any]:
    files = {"drive.csv": two_poses(name, later)}
    done = run("lookup", "drive.csv", "world", "body", "--at", "250ns", "-f", "json", files=files)
    return done, done.out and json.loads(done.out)["xyz"]


READERS: dict[str, tuple[Callable[[Run, str, str], tuple[Outcome, Any]], Any]] = {
    "apply --time-column": (applied, "0.5"),
    "calc @ row": (asked, "0.5"),
    "relative --velocity --time-column": (velocity, ["2000000.0"]),
    "relative --velocity": (velocity_of_itself, ["2000000.0"]),
    "convert -f tum": (as_tum, ["0.000000000", "0.000000500"]),
    "convert -f json": (as_json, [0, 500]),
    "lookup in a tree of rows": (as_tree, [0.5, 0.0, 0.0]),
}


@pytest.mark.parametrize("name", [*NANOSECONDS, HASHED])
@pytest.mark.parametrize("reader", READERS)
def test_nanoseconds_are_nanoseconds_however_they_are_spelt(run: Run, reader: str, name: str) -> None:
    read, wanted = READERS[reader]
    done, found = read(run, name, "500")
    assert (done.status, found) == (0, wanted)


@pytest.mark.parametrize(("unit", "later"), OTHERS.items())
@pytest.mark.parametrize("reader", READERS)
def test_other_units_of_time_are_heeded(run: Run, reader: str, unit: str, later: str) -> None:
    read, wanted = READERS[reader]
    done, found = read(run, f"stamp {unit}", later)
    assert (done.status, found) == (0, wanted)


@pytest.mark.parametrize("rows", [1, 20])
@pytest.mark.parametrize("name", ["stamp_ns", "stamp [ns]", "stamp[ns]", "stamp (ns)"])
def test_keys_of_records_say_their_unit_as_columns_do(run: Run, name: str, rows: int) -> None:
    text = json.dumps({name: 500, "frame": "base", "point": [0, 0, 0]}) + "\n"
    done = run("apply", "drive.yaml", "map", "--time-column", name, stdin=text * rows, files={"drive.yaml": DRIVE})
    assert done.status == 0
    assert [json.loads(row)["point"] for row in done.out.splitlines()] == [[0.5, 0.0, 0.0]] * rows


def test_a_column_is_called_as_it_stands_in_its_header(run: Run) -> None:
    text = f"{HASHED},frame,x,y,z\n500,base,0,0,0\n"
    done = run("apply", "drive.yaml", "map", "--time-column", HASHED, stdin=text, files={"drive.yaml": DRIVE})
    assert (done.status, done.out) == (0, text.replace("base,0,0,0", "map,0.5,0.0,0.0"))


def test_a_cloud_of_poses_keeps_the_stamps_that_were_written_into_it(run: Run) -> None:
    table = two_poses("stamp_ns", "1500000000")
    at = run("convert", "-f", "tum", stdin=table).out
    assert run("convert", "-o", "poses.pcd", stdin=table).status == 0
    assert run("convert", "-i", "poses.pcd", "-f", "tum").out == at
    assert run("resample", "poses.pcd", "--rate", "1", "-f", "tum").out == run("resample", "poses.csv", "--rate", "1", "-f", "tum", files={"poses.csv": table}).out
    record = json.dumps({"stamp": 1.5, "xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]})
    assert run("convert", "-o", "poses.ply", stdin=record).status == 0  # as doubles: it has no such integers
    assert json.loads(run("convert", "-i", "poses.ply", "-f", "json").out)["stamp_ns"] == 1500000000
