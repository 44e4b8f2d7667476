"""`lookup` and `tree` with frames that move: times in, stamps out, errors as sentences and as fields."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

EPOCH = 1_700_000_000_123_456_789
DRIVE = """\
- {name: base, parent: map, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 2, xyz: [4, 0, 0], rpy_deg: [0, 0, 90]}]}
- {name: lidar, parent: base, xyz: [1, 0, 0]}
- {name: hand, parent: base, samples: [{stamp: 1, xyz: [0, 0, 0]}, {stamp: 3, xyz: [0, 0, 2]}]}
"""
TODAY = f"""\
- {{name: base, parent: map, samples: [{{stamp_ns: {EPOCH}}}, {{stamp_ns: {EPOCH + 4}, xyz: [4, 0, 0]}}]}}
"""


@pytest.fixture
def ask(run: Run) -> Run:
    """Run `lookup` on the drive, as JSON unless told."""

    def call(*arguments: str, text: str = DRIVE) -> Any:
        form = () if "-f" in arguments else ("-f", "json")
        return run("lookup", "drive.yaml", *arguments, *form, files={"drive.yaml": text})

    return call


def answer(outcome: Any) -> dict[str, Any]:
    """Read the one object that was printed."""
    assert (outcome.status, outcome.err) == (0, "")
    found: dict[str, Any] = json.loads(outcome.out)
    return found


@pytest.mark.parametrize(("at", "x", "stamp"), [("0", 0, 0), ("0.5", 1, 500_000_000), ("2e0", 4, 2_000_000_000)])
def test_at_is_decimal_seconds(ask: Run, at: str, x: float, stamp: int) -> None:
    found = answer(ask("map", "base", "--at", at))
    assert (found["xyz"][0], found["stamp_ns"]) == (x, stamp)


@pytest.mark.parametrize("at", [f"{EPOCH + 1}ns", "1700000000.123456790"])
def test_a_nanosecond_of_today_is_exact(ask: Run, at: str) -> None:
    found = answer(ask("map", "base", "--at", at, text=TODAY))
    assert (found["xyz"][0], found["stamp_ns"]) == (1.0, EPOCH + 1)


@pytest.mark.parametrize("arguments", [[], ["--at", "latest"]])
def test_latest_is_the_newest_time_of_the_whole_way(ask: Run, arguments: list[str]) -> None:
    found = answer(ask("map", "hand", *arguments))
    assert (found["stamp_ns"], found["xyz"]) == (2 * 10**9, [4.0, 0.0, 1.0])


def test_frames_that_stand_still_have_no_stamp(ask: Run) -> None:
    assert "stamp_ns" not in answer(ask("base", "lidar"))


def test_two_times_are_joined_at_the_fixed_frame(ask: Run) -> None:
    found = answer(ask("base", "base", "--at", "2", "--source-at", "0", "--fixed", "map"))
    assert found["xyz"] == [0.0, 4.0, 0.0]
    assert (found["stamp_ns"], found["source_stamp_ns"], found["fixed"]) == (2 * 10**9, 0, "map")


def test_text_says_in_words_which_frame_when(ask: Run) -> None:
    outcome = ask("map", "base", "--at", "0.5", "-f", "text")
    assert outcome.out.startswith("base seen from map at 0.500000000  (maps points in base to points in map)\n")


def test_a_range_of_times_includes_its_end(ask: Run) -> None:
    rows = list(csv.DictReader(io.StringIO(ask("map", "base", "--times", "0:2:0.5", "-f", "csv").out)))
    assert [row["stamp_ns"] for row in rows] == ["0", "500000000", "1000000000", "1500000000", "2000000000"]
    assert [float(row["x"]) for row in rows] == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_times_come_from_a_file_in_its_order(run: Run) -> None:
    files = {"drive.yaml": DRIVE, "times.txt": "1.5\n# a remark\n\n500000000ns\n"}
    out = run("lookup", "drive.yaml", "map", "base", "--times", "times.txt", "-f", "json", files=files).out
    assert [json.loads(line)["xyz"][0] for line in out.splitlines()] == [3.0, 1.0]


def test_what_was_looked_up_at_many_times_is_a_moving_frame_again(ask: Run, run: Run) -> None:
    printed = ask("map", "base", "--times", "0:2:0.5").out
    outcome = run("lookup", "-", "map", "base", "--at", "1.75", "-f", "json", stdin=printed)
    assert answer(outcome)["xyz"] == [3.5, 0.0, 0.0]


def test_a_time_without_data_ends_with_4_and_names_the_edge(ask: Run) -> None:
    outcome = ask("map", "hand", "--at", "3.5", "-f", "yaml")
    assert (outcome.status, outcome.out) == (4, "")
    assert outcome.err == (
        "frametool: no data for map -> base at 3.500000000; samples cover 0.000000000 .. 2.000000000 (1.5 s too late), "
        "on the path map <- base <- hand; the whole path has data from 1.000000000 until 2.000000000\n"
    )


def test_the_error_has_fields_where_json_is_asked_for(ask: Run) -> None:
    error = json.loads(ask("map", "hand", "--at", "3.5").err)
    assert {key: error[key] for key in ("error", "parent", "child", "at_ns", "short_ns", "available_until_ns")} == {
        "error": "too_late", "parent": "map", "child": "base", "at_ns": 3_500_000_000, "short_ns": 1_500_000_000,
        "available_until_ns": 2_000_000_000,
    }  # fmt: skip
    assert error["path"] == ["map", "base", "hand"]


def test_an_unknown_frame_and_a_bad_file_have_fields_too(ask: Run) -> None:
    assert json.loads(ask("map", "hnad").err)["frame"] == "hnad"
    assert json.loads(ask("map", "hand", text="- {name: 1, parent: 2, xyz: [a, 0, 0]}").err)["line"] == 1


def test_times_without_data_can_be_skipped(ask: Run) -> None:
    outcome = ask("map", "base", "--times", "1:4:1", "--on-error", "skip")
    assert (outcome.status, len(outcome.out.splitlines())) == (3, 2)
    told = [json.loads(line) for line in outcome.err.splitlines()]
    assert [each.get("at_ns") for each in told] == [3 * 10**9, 4 * 10**9, None]
    assert (told[-1]["bad"], told[-1]["rows"]) == (2, 4)


def test_skipped_times_are_told_in_words_beside_other_forms(ask: Run) -> None:
    outcome = ask("map", "base", "--times", "1:4:1", "--on-error", "skip", "-f", "csv")
    assert outcome.err.endswith("frametool: 2 of 4 times skipped\n")


@pytest.mark.parametrize("form", ["static1", "static2"])
def test_what_moves_is_no_call_of_static_transform_publisher(ask: Run, run: Run, form: str) -> None:
    looked_up = ask("map", "base", "--times", "0:2:1", "-f", form)
    drawn = run("tree", "-", "-f", form, stdin=DRIVE)
    assert [(each.status, each.out) for each in (looked_up, drawn)] == [(1, "")] * 2
    assert drawn.err == "frametool: frames move and cannot be published as static: base, hand\n"


def test_without_skipping_the_first_time_without_data_ends_it(ask: Run) -> None:
    assert (ask("map", "base", "--times", "1:4:1").status, ask("map", "base", "--times", "1:4:1").out) == (4, "")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--at", "soon"], "'soon' is not a time"),
        (["--source-at", "1"], "--source-at needs --fixed"),
        (["--fixed", "map"], "--fixed needs --source-at"),
        (["--times", "0:1:0"], "STEP must be positive"),
        (["--times", "1:0:1"], "STEP must be positive and STOP not before START"),
        (["--times", "0:x:1"], "'x' is not a time"),
        (["--times", "0:1:1", "--at", "1"], "--at and --times exclude each other"),
        (["--times", "0:1:1", "--on-error", "null"], "with --times it is stop or skip"),
        (["--cache", "-1"], "not less than 0"),
    ],
)
def test_misuse_is_told(ask: Run, arguments: list[str], complaint: str) -> None:
    outcome = ask("map", "base", *arguments)
    assert outcome.status == 2
    assert complaint in outcome.err


def test_many_stamps_with_two_poses_are_one_warning_with_their_count(run: Run) -> None:
    samples = ", ".join(f"{{stamp: {at}, xyz: [{x}, 0, 0]}}" for at in range(11) for x in (0, 1))
    done = run("tree", "-", stdin=f"- {{name: b, parent: a, samples: [{samples}]}}")
    said = "frame 'b' has two poses at 0.000000000; the last one holds (10 more like it)"
    assert (done.status, done.err) == (0, f"frametool: warning: stdin:1: {said}\n")


def test_a_cache_forgets_what_is_older(ask: Run) -> None:
    assert ask("map", "base", "--at", "1", "--cache", "1").status == 4


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_a_tree_that_moves_reads_back_whole(run: Run, form: str) -> None:
    printed = run("tree", "-", "-f", form, stdin=TODAY).out
    found = answer(run("lookup", "-", "map", "base", "--at", f"{EPOCH + 3}ns", "-f", "json", stdin=printed))
    assert (found["xyz"][0], found["stamp_ns"]) == (3.0, EPOCH + 3)
    assert run("tree", "-", "-f", form, stdin=printed).out == printed


def test_a_tree_that_moves_is_drawn_with_rate_and_interval(run: Run) -> None:
    lines = run("tree", "-", "-f", "text", stdin=DRIVE).out.splitlines()
    assert lines[1].endswith("2 at 0.5 Hz, 0 .. 2 s")
    assert "samples" not in lines[2]


def test_a_tree_is_drawn_as_it_stood_at_one_time(run: Run) -> None:
    outcome = run("tree", "-", "-f", "text", "--at", "0.5", stdin=DRIVE)
    assert "xyz 1 0 0" in outcome.out.splitlines()[1]
    assert "base -> hand is left out: no data at 0.500000000" in outcome.err


def test_dot_draws_what_moves_as_view_frames_does(run: Run) -> None:
    lines = run("tree", "-", "-f", "dot", stdin=DRIVE).out.splitlines()
    assert lines[0] == "digraph G {"
    assert lines[1] == (
        r'"map" -> "base"[label=" Broadcaster: default_authority\nAverage rate: 1.0\nBuffer length: 2.0\n'
        r'Most recent transform: 2.0\nOldest transform: 0.0\n"];'
    )
    assert lines[-2:] == ['}->"map";', "}"]


def test_the_listing_of_tf2_gives_static_edges_its_rate(run: Run) -> None:
    outcome = run("tree", "-", "-f", "tf2", stdin="{name: b, parent: a, xyz: [1, 0, 0]}")
    assert outcome.out == (
        "b: \n  parent: 'a'\n  broadcaster: 'default_authority'\n  rate: 10000.000\n"
        "  most_recent_transform: 0.000\n  oldest_transform: 0.000\n  buffer_length: 0.000\n"
    )


def test_rows_get_the_pose_at_their_own_times(run: Run) -> None:
    files = {"drive.yaml": DRIVE, "rows.csv": 'id,t,tag\n1,0.5,a\n2,1500ms,"b,c"\n3,9,d\n'}
    command = ("lookup", "drive.yaml", "map", "base", "-i", "rows.csv", "--time-column", "t", "--keep", "--to", "rpy_deg")
    outcome = run(*command, "--on-error", "null", files=files)
    assert outcome.out.splitlines() == [
        "id,t,tag,x,y,z,roll_deg,pitch_deg,yaw_deg", "1,0.5,a,1.0,0.0,0.0,0.0,0.0,22.499999999999996",
        '2,1500ms,"b,c",3.0,0.0,0.0,0.0,0.0,67.49999999999999', "3,9,d,,,,,,",
    ]  # fmt: skip
    assert "rows.csv:4:t: no data for map -> base at 9.000000000" in outcome.err
    assert len(run(*command, "--stop", "1", files=files).out.splitlines()) == 2
    assert "--time-column and --at exclude each other" in run(*command, "--at", "1", files=files).err
    assert "no column 'nix'" in run(*command[:6], "--time-column", "nix", files=files).err


@pytest.mark.parametrize(("more", "stamps"), [((), [0, 2]), (("--start", "1"), [2]), (("--time-offset", "-2"), [-2, 0])])
def test_a_table_has_all_samples_as_a_trajectory_has(run: Run, more: tuple[str, ...], stamps: list[int]) -> None:
    command = ("lookup", "drive.yaml", "map", "base", *more)
    files = {"drive.yaml": DRIVE}
    rows = list(csv.DictReader(io.StringIO(run(*command, "-f", "csv", files=files).out)))
    assert [int(row["stamp_ns"]) for row in rows] == [at * 1_000_000_000 for at in stamps]
    assert [line.split()[0] for line in run(*command, "-f", "tum", files=files).out.splitlines()] == [
        f"{at}.000000000" for at in stamps
    ]


def test_latest_is_named_beside_what_is_no_time_alone(run: Run) -> None:
    command = ("lookup", "drive.yaml", "map", "base", "--at")
    assert "nanoseconds (12500000000ns), or latest;" in run(*command, "soon", files={"drive.yaml": DRIVE}).err
    assert ", or latest" not in run(*command, "1e30").err
