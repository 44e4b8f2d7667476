"""`apply --time-column` and `--at`: every row where it was at its own time, as single lookups say."""

from __future__ import annotations

import json
import random
from typing import TYPE_CHECKING, Any

import pytest

from frametool.documents.source import Source
from frametool.formats.load import load_sources
from frametool.frames.lookups import FrameTree
from frametool.geometry import rigid

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

EPOCH = 1_700_000_000_000_000_000
DRIVE = f"""\
- {{name: base, parent: map, samples: [{{stamp_ns: {EPOCH}, xyz: [1, 2, 3]}}, {{stamp_ns: {EPOCH + 10**9}, xyz: [4, 0, 0], rpy_deg: [10, 20, 90]}}]}}
- {{name: lidar, parent: base, xyz: [1, 0, 0], rpy_deg: [0, 0, 30]}}
- {{name: arm, parent: lidar, samples: [{{stamp_ns: {EPOCH + 10**8}}}, {{stamp_ns: {EPOCH + 2 * 10**9}, xyz: [0, 0, 2], rpy_deg: [5, 0, 0]}}]}}
"""
FINE = f"- {{name: base, parent: map, samples: [{{stamp_ns: {EPOCH}}}, {{stamp_ns: {EPOCH + 4}, xyz: [4, 0, 0]}}]}}\n"
STILL = "{name: lidar, parent: map, xyz: [1, 0, 0]}\n"


@pytest.fixture
def move(run: Run) -> Run:
    """Run `apply` on the drive with a time column."""

    def call(*arguments: str, rows: str, tree: str = DRIVE, column: str = "stamp") -> Any:
        return run("apply", "drive.yaml", *arguments, "--time-column", column, stdin=rows, files={"drive.yaml": tree})

    return call


def cells(outcome: Any) -> list[list[str]]:
    return [line.split(",") for line in outcome.out.splitlines()[1:]]


def test_every_row_moves_as_a_single_lookup_at_its_time_says(move: Run) -> None:
    chance = random.Random(5)  # noqa: S311
    times = [EPOCH + chance.randrange(10**8, 10**9) for _ in range(300)]
    frames = [chance.choice(("arm", "lidar", "base")) for _ in times]
    points = [[chance.uniform(-9, 9) for _ in range(3)] for _ in times]
    rows = [
        f"{at // 10**9}.{at % 10**9:09d},{frame},{x!r},{y!r},{z!r}"
        for at, frame, (x, y, z) in zip(times, frames, points, strict=True)
    ]
    outcome = move("map", "--frame-column", "frame", rows="\n".join(["stamp,frame,x,y,z", *rows, ""]))
    assert (outcome.status, outcome.err) == (0, "")
    tree = load_sources([Source("tree", DRIVE)])
    for moved, row, at, frame, point in zip(cells(outcome), rows, times, frames, points, strict=True):
        expected = rigid.apply(*tree.lookup("map", frame, at).components, *point)
        assert moved[:2] == [row.split(",")[0], "map"]
        assert list(map(float, moved[2:])) == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(
    ("column", "stamps"),
    [
        ("stamp", ["1700000000.000000001", "1700000000000000003ns", '"1700000000.000000002"']),
        ("stamp_ns", [str(EPOCH + 1), f"{EPOCH + 3}ns", f'"{EPOCH + 2}"']),
    ],
)
def test_a_nanosecond_of_today_is_exact_in_tables(move: Run, column: str, stamps: list[str]) -> None:
    rows = "".join(f"{stamp},0,0,0\n" for stamp in stamps)
    outcome = move("map", "base", rows=f"{column},x,y,z\n{rows}", tree=FINE, column=column)
    assert [row[1] for row in cells(outcome)] == ["1.0", "3.0", "2.0"]
    assert [row[0] for row in cells(outcome)] == stamps


@pytest.mark.parametrize("copies", [1, 40])
def test_a_nanosecond_of_today_is_exact_in_records(move: Run, copies: int) -> None:
    stamps = ["1700000000.000000001", '"1700000000000000003ns"', "1.700000000000000002e9"] * copies
    rows = "".join(f'{{"id": 7.50, "stamp": {stamp}, "point": [0, 0, 0]}}\n' for stamp in stamps)
    outcome = move("map", "base", rows=rows, tree=FINE)
    assert [json.loads(line)["point"][0] for line in outcome.out.splitlines()] == [1.0, 3.0, 2.0] * copies
    assert all(f'"id": 7.50, "stamp": {stamp}, ' in line for stamp, line in zip(stamps, outcome.out.splitlines(), strict=True))


def test_a_few_records_and_many_give_the_same_bytes(move: Run) -> None:
    records = [
        f'{{"t": {{"at": 1700000000.{at:09d}}}, "frame": "arm", "point": [1.5, -2, {at}e-9]}}\n'
        for at in range(10**8, 10**9, 10**7)
    ]
    many = move("map", rows="".join(records), column="t.at").out.splitlines()
    few = [move("map", rows=record, column="t.at").out.rstrip("\n") for record in records[:5]]
    assert many[:5] == few


def test_yaml_documents_have_their_times_too(move: Run) -> None:
    document = "stamp: 1700000000.000000003\npoint: [0, 0, 0]\ntag: 007\n---\n"
    expected = document.replace("[0, ", "[3.0, ").replace(" 0, 0]", " 0.0, 0.0]")
    assert move("map", "base", rows=document * 2, tree=FINE).out == ("frame: map\n" + expected) * 2


@pytest.mark.parametrize(
    ("rule", "status", "printed"),
    [
        ("stop", 1, "1700000000,1.0,2.0,3.0\n"),
        ("skip", 3, "1700000000,1.0,2.0,3.0\n1700000000.0,1.0,2.0,3.0\n"),
        ("null", 3, "1700000000,1.0,2.0,3.0\n1700000002,,,\nnoon,,,\n1700000000.0,1.0,2.0,3.0\n"),
    ],
)
def test_rows_without_data_are_bad_rows(move: Run, rule: str, status: int, printed: str) -> None:
    rows = "stamp,x,y,z\n1700000000,0,0,0\n1700000002,0,0,0\nnoon,0,0,0\n1700000000.0,0,0,0\n"
    outcome = move("map", "base", "--on-error", rule, rows=rows)
    assert (outcome.status, outcome.out) == (status, f"stamp,x,y,z\n{printed}")
    assert outcome.err.startswith(
        "frametool: stdin:3:stamp: no data for map -> base at 1700000002.000000000; samples cover "
        "1700000000.000000000 .. 1700000001.000000000 (1 s too late)"
    )
    assert ("stdin:4:stamp: 'noon' is not a time" in outcome.err) == (rule != "stop")


@pytest.mark.parametrize("copies", [1, 40])
def test_records_without_data_are_bad_records(move: Run, copies: int) -> None:
    rows = '{"stamp": 1700000000, "x": 0, "y": 0, "z": 0}\n{"stamp": 0, "x": 0, "y": 0, "z": 0}\n{"x": 0, "y": 0, "z": 0}\n'
    outcome = move("map", "base", "--on-error", "skip", "--max-errors", "2", rows=rows * copies)
    assert outcome.status == 3
    assert len(outcome.out.splitlines()) == copies
    first, second, *_ = outcome.err.splitlines()
    assert first.startswith("frametool: stdin:2:stamp: no data for map -> base at 0.000000000")
    assert second.startswith("frametool: stdin:3:1: no key 'stamp'")


def test_frames_that_stand_still_answer_any_time(move: Run) -> None:
    outcome = move("map", "lidar", rows="stamp,x,y,z\n-5,0,0,0\n9e8,1,0,0\n", tree=STILL)
    assert cells(outcome) == [["-5", "1.0", "0.0", "0.0"], ["9e8", "2.0", "0.0", "0.0"]]
    assert type(load_sources([Source("tree", STILL)])) is FrameTree


def test_a_trajectory_moves_at_its_own_times(move: Run) -> None:
    outcome = move("map", "base", "--in", "tum", rows="1700000000.000000001 0 0 0 0 0 0 1\n", tree=FINE, column="t")
    assert outcome.out == "1700000000.000000001 1.0 0.0 0.0 0.0 0.0 0.0 1.0\n"


def test_at_is_one_time_for_all(run: Run) -> None:
    arguments = ("apply", "drive.yaml", "map", "base", "--at", "1700000000.000000003")
    files = {"drive.yaml": FINE}
    assert run(*arguments, "0", "0", "0", files=files).out == "frame: map\npoint: [3.0, 0.0, 0.0]\n"
    assert run(*arguments, stdin="x,y,z\n0,0,0\n", files=files).out == "x,y,z\n3.0,0.0,0.0\n"


def test_the_cache_forgets_for_apply_too(run: Run) -> None:
    arguments = ("apply", "drive.yaml", "map", "base", "0", "0", "0", "--at", "1700000000")
    assert run(*arguments, "--cache", "0.5", files={"drive.yaml": DRIVE}).status == 4


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        (["map", "base", "--at", "1"], 2, "exclude each other"),
        (["map", "base", "1", "2", "3"], 2, "--time-column has no effect here"),
        (["map", "bse"], 4, "did you mean 'base'?"),
        (["map", "base", "--frame-column", "frme"], 2, "no column 'frme'"),
        (["map", "base", "-f", "tum"], 1, "tum holds poses"),
    ],
)
def test_misuse_is_told(move: Run, arguments: list[str], status: int, complaint: str) -> None:
    outcome = move(*arguments, rows="stamp,x,y,z\n1,0,0,0\n")
    assert (outcome.status, outcome.out) == (status, "")
    assert complaint in outcome.err


def test_a_column_that_is_not_there_is_told_with_those_that_are(move: Run) -> None:
    outcome = move("map", "base", rows="stmp,x,y,z\n1,0,0,0\n")
    assert outcome.status == 2
    assert "no column 'stamp'; did you mean 'stmp'? columns: stmp, x, y, z" in outcome.err


def test_a_fixed_transform_has_no_times(run: Run) -> None:
    outcome = run("apply", "--transform", "{xyz: [1, 2, 3]}", "--time-column", "stamp", stdin="stamp,x,y,z\n1,0,0,0\n")
    assert (outcome.status, outcome.out) == (2, "")


@pytest.mark.parametrize("column", ["stamp", "t", "timestamp [s]", "header.stamp", "time_ns"])
@pytest.mark.parametrize("source", [("base",), ()])
def test_stamps_that_nobody_asks_for_are_told_once_where_the_tree_moves(
    run: Run, column: str, source: tuple[str, ...]
) -> None:
    still = "frames: [{name: map}, {name: base, parent: map, xyz: [1, 0, 0]}]"
    moving = "frames: [{name: base, parent: map, samples: [{stamp: 0, xyz: [1, 0, 0]}, {stamp: 9, xyz: [3, 0, 0]}]}]"
    rows = f"{column},frame_id,x,y,z\n" + "0,base,0,0,0\n" * 3
    quiet = run("apply", "t.yaml", "map", *source, stdin=rows, files={"t.yaml": still})
    told = run("apply", "t.yaml", "map", *source, stdin=rows, files={"t.yaml": moving})
    chosen = run("apply", "t.yaml", "map", *source, "--at", "9", stdin=rows, files={"t.yaml": moving})
    assert (quiet.err, chosen.err) == ("", "")
    assert chosen.out == told.out
    assert told.err.count("give --time-column") == 1
    assert told.err.startswith(f"frametool: warning: stdin:2: column {column!r} is not looked at")


@pytest.mark.parametrize(
    ("arguments", "status", "found"),
    [
        (("map", "-f", "tum"), 2, "rows move at the latest time; make --stamps a column first"),
        (("map", "base", "-f", "tum"), 2, "rows move at the latest time; make --stamps a column first"),
        (("map", "base"), 2, "rows move at the latest time; make --stamps a column first"),
        (("base", "mast"), 2, "--stamps has no effect here"),
        (("base", "mast", "-f", "tum"), 0, "4.000000000 0.0 0.0 1.0 0.0 0.0 0.0 1.0"),
        (("map", "base", "--at", "9", "-f", "tum"), 0, "4.000000000 3.0 0.0 0.0 0.0 0.0 0.0 1.0"),
    ],
)
def test_rows_do_not_move_at_the_times_of_a_file_of_stamps(
    run: Run, arguments: tuple[str, ...], status: int, found: str
) -> None:
    moving = "frames: [{name: base, parent: map, samples: [{stamp: 0, xyz: [1, 0, 0]}, {stamp: 9, xyz: [3, 0, 0]}]}, "
    files: dict[str, str | bytes] = {"t.yaml": f"{moving}{{name: mast, parent: base, xyz: [0, 0, 1]}}]", "times.txt": "4\n"}
    told = run("apply", "t.yaml", *arguments, "--stamps", "times.txt", files=files, stdin="x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,1\n")
    assert told.status == status
    assert found in (told.err if status else told.out)


def test_a_pose_is_the_same_at_all_times(run: Run) -> None:
    assert run("apply", "--transform", "{xyz: [1, 0, 0]}", stdin="t,x,y,z\n0,0,0,0\n").err == ""
