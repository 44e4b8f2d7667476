"""Times and rates on the command line: what is no time, what is far away, many of them, and parents that change."""

from __future__ import annotations

import json
import random
import sys
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

DRIVE = """\
- {name: base, parent: map, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 2, xyz: [4, 0, 0]}]}
- {name: lidar, parent: base, xyz: [1, 0, 0]}
"""
STILL = "{name: base, parent: map, xyz: [1, 0, 0]}"
CHANGING = """\
frames:
- {name: f2, parent: f0, samples: [{stamp: 4, xyz: [0, 0, 100]}, {stamp: 9.5, xyz: [0, 0, 100]}]}
- {name: f3, samples: [{stamp: 8.25, parent: f0, xyz: [1, 0, 0]}, {stamp: 10.75, parent: f2, xyz: [5, 0, 0]}]}
"""
FILES = {"drive.yaml": DRIVE, "still.yaml": STILL, "t.yaml": CHANGING, "bad.txt": "0.5\nsoon\n1e400\n1.5\n7\n"}


# --- parents that change -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "stdin"),
    [
        (["lookup", "t.yaml", "f0", "f3", "-f", "json"], ""),
        (["lookup", "t.yaml", "f0", "f3", "--at", "latest", "-f", "json"], ""),
        (["lookup", "t.yaml", "f0", "f3", "--at", "9", "--source-at", "latest", "--fixed", "f0", "-f", "json"], ""),
        (["apply", "t.yaml", "f0", "f3", "0", "0", "0", "-f", "json"], ""),
        (["apply", "t.yaml", "f0", "f3", "-f", "json"], '{"point": [0, 0, 0]}\n'),
        (["apply", "t.yaml", "f0", "f3", "--in", "csv"], "x,y,z\n0,0,0\n"),
        (["apply", "t.yaml", "f0", "--frame-column", "at", "-f", "csv"], "at,x,y,z\nf3,0,0,0\nf3,0,0,0\n"),
        (["lookup", "t.yaml", "f0", "--source-column", "seen"], "seen,id\nf3,1\nf3,2\n"),
        (["echo", "t.yaml", "f0", "f3", "--start", "9.5", "--limit", "1", "-f", "json"], ""),
    ],
)
def test_the_latest_of_changing_parents_is_true_at_its_time(run: Run, arguments: list[str], stdin: str) -> None:
    """tf2: the common time by the newest parents is 9.5, and at 9.5 the frame is still below f0."""
    outcome = run(*arguments, stdin=stdin, files=FILES)
    assert outcome.status == 0, outcome.err
    assert "1.0" in outcome.out
    assert "100" not in outcome.out
    assert "5.0" not in outcome.out


def test_echo_begins_and_ends_where_there_are_answers(run: Run) -> None:
    out = run("echo", "t.yaml", "f0", "f3", "--rate", "4", "-f", "json", files=FILES).out
    stamps = [json.loads(line)["stamp_ns"] / 1e9 for line in out.splitlines()]
    assert (stamps[0], stamps[-1]) == (8.25, 10.5)


# --- stamps that stand twice or go back ------------------------------------------------------------------------------

ODD = "".join(f"{stamp} {stamp} 0 0 0 0 0 1\n" for stamp in (1, 2, 2, 4, 3, 5))


def test_resample_warns_of_stamps_out_of_order_and_doubled_as_compare_does(run: Run) -> None:
    for arguments in (["odd.tum", "--rate", "1"], ["even.tum", "--at", "odd.tum"]):
        done = run("resample", *arguments, files={"odd.tum": ODD, "even.tum": "".join(sorted(set(ODD.splitlines(keepends=True))))})
        assert done.status == 0
        assert len(done.out.splitlines()) == 5
        assert "warning: odd.tum: stamps are out of order; sorted\n" in done.err
        assert "warning: odd.tum: 1 pose has the stamp of another; the last counts\n" in done.err


def test_a_trajectory_whose_stamps_go_back_is_looked_up_with_a_warning(run: Run) -> None:
    for text, warnings in ((ODD, 1), (ODD * 3000, 1), ("".join(f"{stamp} {stamp} 0 0 0 0 0 1\n" for stamp in (1, 2, 2, 4)), 0)):
        done = run("lookup", "odd.tum", "world", "body", "--at", "3.5", "-f", "json", files={"odd.tum": text}) if warnings else run("tree", "odd.tum", files={"odd.tum": text})
        assert done.err.count("warning: odd.tum: stamps of 'body' are out of order; sorted\n") == warnings
        assert (done.status, '"xyz": [3.5, 0.0, 0.0]' in done.out) == (0, bool(warnings))


@pytest.mark.parametrize(("times", "warnings"), [("0\n1\n2\n", 0), ("0\n2\n1\n", 1), ("0\n1\n1\n", 1)])
def test_times_of_a_file_that_go_back_or_stand_twice_are_answered_with_a_warning(run: Run, times: str, warnings: int) -> None:
    done = run("lookup", "drive.yaml", "map", "base", "--times", "times.txt", "-f", "tum", files=FILES | {"times.txt": times})
    assert [row[:1] for row in done.out.splitlines()] == times.split()
    assert done.err.count("warning: times.txt: stamps are out of order or doubled; used as they stand") == warnings


# --- options -------------------------------------------------------------------------------------------------------

HUGE = ["1e400", "-1e400", "1e999", "9" * 40, "99999999999999999999", "1e30", "nan", "inf", "-inf", "", "soon", "0x10"]
FAR = ["9e9", "4e9", "-4e9", "0.0000000001", "1e-300"]
TIMED = [
    ("lookup", "drive.yaml", "map", "base", "--at"), ("lookup", "still.yaml", "map", "base", "--at"),
    ("lookup", "drive.yaml", "map", "base", "--times"), ("tree", "drive.yaml", "--at"),
    ("lookup", "drive.yaml", "base", "base", "--fixed", "map", "--at", "1", "--source-at"),
    ("echo", "drive.yaml", "map", "base", "--start"), ("echo", "drive.yaml", "map", "base", "--stop"),
    ("echo", "drive.yaml", "map", "base", "--rate"), ("echo", "still.yaml", "map", "base", "--rate"),
    ("echo", "drive.yaml", "map", "base", "--limit"), ("lookup", "drive.yaml", "map", "base", "--cache"),
    ("tree", "drive.yaml", "--cache"), ("apply", "drive.yaml", "map", "base", "0", "0", "0", "--at"),
    ("lookup", "drive.yaml", "map", "base", "--precision"),
]  # fmt: skip


@pytest.mark.parametrize("command", TIMED, ids=" ".join)
@pytest.mark.parametrize("value", [*HUGE, *FAR, "0:1e400:1", "0:1:1e-9", "0:1:0.1", "::", "1:2", "0:4e9:1e-9"])
def test_no_number_however_large_or_odd_ends_in_more_than_one_line(run: Run, command: tuple[str, ...], value: str) -> None:
    if command[-1] == "--times" and value.isdecimal():
        pytest.skip("the name of a file that is not there")
    limit = () if "--limit" in command or command[0] != "echo" else ("--limit", "3")
    outcome = run(*command, value, *limit, "-f", "json", files=FILES)
    assert outcome.status in (0, 1, 2, 3, 4, 5)
    assert "Traceback" not in outcome.err
    assert outcome.status == 0 or 1 <= len(outcome.err.splitlines()) <= 11
    assert all(json.loads(line) for line in outcome.out.splitlines() if line.startswith("{"))


@pytest.mark.parametrize("value", ["1e400", "-1e400", "9" * 40, "1e999", "1e30"])
@pytest.mark.parametrize("command", [each for each in TIMED if each[-1] in ("--at", "--source-at", "--start", "--stop")], ids=" ".join)
def test_a_time_beyond_all_clocks_is_a_usage_error(run: Run, command: tuple[str, ...], value: str) -> None:
    outcome = run(*command, value, files=FILES)
    assert outcome.status == 2
    assert "beyond the year 2116" in outcome.err


@pytest.mark.parametrize("rate", ["nan", "inf", "-inf", "0", "-1", "1e-300", "1e300", "1e-10", "1e10", "x"])
def test_a_rate_without_steps_is_a_usage_error(run: Run, rate: str) -> None:
    outcome = run("echo", "drive.yaml", "map", "base", "--rate", rate, files=FILES)
    assert (outcome.status, outcome.out) == (2, "")


def test_the_fastest_echo_never_repeats_a_stamp(run: Run) -> None:
    out = run("echo", "drive.yaml", "map", "base", "--rate", "1e9", "--limit", "500", "-f", "json", files=FILES).out
    assert [json.loads(line)["stamp_ns"] for line in out.splitlines()] == list(range(500))


@pytest.mark.parametrize("limit", ["9223372036854775807", "9223372036854775808", "99999999999999999999"])
def test_a_limit_beyond_all_blocks_is_no_limit(run: Run, limit: str) -> None:
    outcome = run("echo", "drive.yaml", "map", "base", "-l", limit, "-f", "json", files=FILES)
    assert (outcome.status, len(outcome.out.splitlines())) == (0, 3)


# --- many times ----------------------------------------------------------------------------------------------------


def test_lines_that_are_no_time_are_skipped_with_their_place(run: Run) -> None:
    outcome = run("lookup", "drive.yaml", "map", "base", "--times", "bad.txt", "--on-error", "skip", "-f", "csv", files=FILES)
    assert outcome.status == 3
    assert [row.rpartition(",")[2] for row in outcome.out.splitlines()[1:]] == ["500000000", "1500000000"]
    lines = outcome.err.splitlines()
    assert lines[0].startswith("frametool: bad.txt:2: 'soon' is not a time")
    assert lines[1].startswith("frametool: bad.txt:3: '1e400' is beyond 64 bits of nanoseconds")
    assert lines[2].startswith("frametool: no data for map -> base at 7.000000000")
    assert lines[3:] == ["frametool: 3 of 5 times skipped"]


def test_without_skipping_a_line_that_is_no_time_stops_with_its_place(run: Run) -> None:
    outcome = run("lookup", "drive.yaml", "map", "base", "--times", "bad.txt", files=FILES)
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err.startswith("frametool: bad.txt:2: 'soon' is not a time")


@pytest.mark.parametrize("form", ["json", "yaml", "csv", "text", "ros1", "ros2", "foxglove"])
@pytest.mark.parametrize("command", ["lookup", "echo"])
def test_poses_written_in_batches_are_those_written_one_by_one(run: Run, form: str, command: str) -> None:
    """600 results, more than a batch holds; the same text as all at once."""
    if (command, form) == ("echo", "text"):
        pytest.skip("echo has blocks of its own")
    more = ("--times", "0:2:0.00333") if command == "lookup" else ("--rate", "300.3003003003003")
    out = run(command, "drive.yaml", "map", "base", *more, "-f", form, files=FILES).out
    singly = [run("lookup", "drive.yaml", "map", "base", "--at", f"{at}ns", "-f", form, files=FILES).out for at in (0, 3_330_000)]
    assert out.startswith(singly[0])
    body = singly[1].splitlines()[-1]
    assert sum(line == body for line in out.splitlines()) >= 1
    assert run("lookup", "-", "map", "base", "--at", "1.998", "-f", "json", stdin=out).status == 0 or form in ("text", "csv")


def test_the_machine_forms_of_echo_do_not_wait_for_the_end() -> None:
    from frametool.cli.command import Inputs
    from frametool.cli.output import Output
    from frametool.grammar.pose_algebra import result_at

    computed = 0

    def results() -> Any:
        nonlocal computed
        for stamp in range(10**9):
            computed += 1
            yield result_at((float(stamp), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), "map", "base", stamp)

    for form in ("json", "yaml", "csv", "ros2"):
        computed = 0
        pieces = Output(Inputs({"format_name": form}, {}), "poses")._batches(results())  # noqa: SLF001 - what `pieces` writes
        for _ in range(20):
            next(pieces)
        assert computed <= 20 * 256


# --- rotations that are off ----------------------------------------------------------------------------------------

OFF = "- {name: b, parent: a, quaternion: {x: 0, y: 0, z: 0, w: 1.2}}\n"
MESSAGES = """\
transforms:
- header: {stamp: {sec: 1, nanosec: 0}, frame_id: a}
  child_frame_id: b
  transform: {translation: {x: 1, y: 0, z: 0}, rotation: {x: 0, y: 0, z: 0, w: 1.004}}
---
"""


@pytest.mark.parametrize("text", [OFF, MESSAGES, "static_transform_publisher 0 0 0 0 0 0 1.2 a b\n"])
@pytest.mark.parametrize(
    "command", [("lookup", "q", "a", "b"), ("tree", "q"), ("echo", "q", "a", "b"), ("monitor", "q"), ("check", "q", "--strict")]
)
def test_every_reader_of_trees_normalises_where_its_error_advises_to(run: Run, command: tuple[str, ...], text: str) -> None:
    refused = run(*command, files={"q": text})
    assert refused.status == 1
    assert "--normalize" in refused.err + refused.out
    taken = run(*command, "--normalize", files={"q": text})
    assert (taken.status, taken.err) == (0, "")


# --- deep and many -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("deep", [900, 990, 1100, 5000])
@pytest.mark.parametrize("form", ["nested", "lists", "maps"])
@pytest.mark.parametrize("command", [("lookup", "d.yaml", "a", "b"), ("tree", "d.yaml"), ("echo", "d.yaml", "a", "b"), ("monitor", "d.yaml"), ("check", "d.yaml")])
def test_what_nests_deep_is_read_or_refused_in_one_line(run: Run, command: tuple[str, ...], form: str, deep: int) -> None:
    text = {
        "nested": "frames: {a: {" + "b: {children: {" * deep + "}}" * deep + "}}\n",
        "lists": "frames: " + "[" * deep + "]" * deep + "\n",
        "maps": "frames: " + "{a: " * deep + "}" * deep + "\n",
    }[form]
    outcome = run(*command, files={"d.yaml": text})
    assert outcome.status in (0, 1, 3, 4)
    assert "Traceback" not in outcome.err
    assert len(outcome.err.splitlines()) <= 4


def entries(count: int, form: str) -> str:
    if form == "list":
        return "frames:\n" + "".join(f"- {{name: f{at + 1}, parent: f{at // 2}, xyz: [1, 0, 0]}}\n" for at in range(count))
    if form == "bad":
        return "frames:\n" + "".join(f"- {{name: f{at + 1}, parent: f0, xyz: [x, 0, 0]}}\n" for at in range(count))
    if form == "samples":
        return "- name: a\n  parent: map\n  samples:\n" + "".join(f"  - {{stamp: {at}, xyz: [1, 0, 0]}}\n" for at in range(count))
    return "frames:\n  base:\n" + "".join(f"    f{at}: {{xyz: [1, 0, 0]}}\n" for at in range(count))


@pytest.mark.parametrize("form", ["list", "nested", "samples", "bad"])
def test_check_does_work_in_proportion_to_the_file(run: Run, form: str) -> None:
    work = []
    for count in (200, 400, 800):
        files = {"c.yaml": entries(count, form)}
        lines = 0

        def trace(*_: Any) -> Any:
            nonlocal lines
            lines += 1
            return trace

        sys.setprofile(trace)
        try:
            run("check", "c.yaml", files=files)
        finally:
            sys.setprofile(None)
        work.append(lines)
    assert work[2] - work[1] <= 2.5 * (work[1] - work[0])


def test_between_a_frame_and_itself_nothing_is_monitored(run: Run) -> None:
    done = run("monitor", "tree.yaml", "a", "a", files={"tree.yaml": "[{name: a, parent: b, xyz: [1, 2, 3]}]"})
    assert (done.status, done.err) == (2, "frametool: no edge is between 'a' and itself; name two frames\n")


def test_random_options_never_end_in_a_traceback(run: Run) -> None:
    draw = random.Random(7)  # noqa: S311 - not for secrets
    values = [*HUGE, *FAR, "0", "1", "latest", "0:2:0.5", "bad.txt", "-1", "500000000ns", "1.5"]
    options = ["--at", "--times", "--source-at", "--cache", "--start", "--stop", "--rate", "-l", "--precision", "--fixed"]
    switches = ["--moving", "--on-error=skip", "--on-error=null", "--normalize", "--deg", "-v"]
    for _ in range(300):
        command = draw.choice(["lookup", "echo", "tree", "monitor", "check"])
        ends = [draw.choice(["map", "base", "lidar", "nope"]) for _ in range(0 if command in ("tree", "check") else 2)]
        more = [each for _ in range(draw.randrange(4)) for each in (draw.choice(options), draw.choice(values))]
        limit = ["-l", "3"] if command == "echo" else []
        arguments = [command, draw.choice(["drive.yaml", "still.yaml", "t.yaml"]), *ends, *more, *limit]
        arguments += draw.sample(switches, draw.randrange(3))
        outcome = run(*arguments, files=FILES)
        assert outcome.status in (0, 1, 2, 3, 4, 5), arguments
        assert "Traceback" not in outcome.err, arguments


# --- the stamps of files -------------------------------------------------------------------------------------------

STAMPS = {
    "lines.txt": "0.5\n# between\n\n1.5\n",
    "titled.txt": "stamp_ns\n500000000\n1500000000\n",
    "noted.txt": "# stamp\n0.5\n1.5\n",
    "rows.csv": "name,t\na,0.5\nb,1500ms\n",
    "both.csv": "# x,t\nname,t\na,0.5\nb,1.5\n",
    "images.csv": "#timestamp [ns],filename\n500000000,a.png\n1500000000,b.png\n",
    "seconds.csv": "sec,nanosec\n0,500000000\n1,500000000\n",
    "walk.tum": "# timestamp tx ty tz qx qy qz qw\n0.5 0 0 0 0 0 0 1\n1.5 1 0 0 0 0 0 1\n",
    "records.jsonl": '{"stamp": 0.5, "xyz": [0, 0, 0]}\n{"stamp": 1.5, "xyz": [0, 0, 0]}\n',
    "moving.yaml": "frames: [{name: a, parent: b, samples: [{stamp: 1.5, xyz: [0, 0, 0]}, {stamp: 0.5, xyz: [0, 0, 0]}]}]",
}
BY_SIZE = "1700000000500000000\n1700000001500000000\n"


@pytest.mark.parametrize("name", STAMPS)
def test_times_are_the_stamps_of_any_file_that_has_some(run: Run, name: str) -> None:
    outcome = run("lookup", "drive.yaml", "map", "base", "--times", name, "-f", "csv", files=FILES | STAMPS)
    assert outcome.status == 0, outcome.err
    assert [row.rpartition(",")[2] for row in outcome.out.splitlines()[1:]] == ["500000000", "1500000000"]


def test_what_is_nanoseconds_by_its_size_alone_is_told(run: Run) -> None:
    files = FILES | {"ns.txt": BY_SIZE}
    outcome = run("lookup", "drive.yaml", "map", "base", "--times", "ns.txt", files=files)
    assert "warning: stamps such as 1700000000500000000 are taken for ns, by their size" in outcome.err
    assert "no data for map -> base at 1700000000.500000000" in outcome.err


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "x,y\n1,2\n", "a.csv:1: no column of stamps (t, stamp, time, stamp_ns ..); columns: x, y"),
        ("a.txt", "# nothing\n", "a.txt: no times in it; write one a line"),
        ("a.txt", "", "a.txt: no times in it; write one a line"),
        ("a.yaml", "frames: {a: {b: {xyz: [1, 2, 3]}}}", "a.yaml: no stamps in it (YAML: "),
    ],
)
def test_a_file_without_stamps_is_told_so(run: Run, name: str, text: str, said: str) -> None:
    outcome = run("lookup", "drive.yaml", "map", "base", "--times", name, files=FILES | {name: text})
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err.startswith(f"frametool: {said}")


@pytest.mark.parametrize("text", ["0.5s", "500ms", "500 ms", "500000us", "5e2ms", "500000000ns"])
def test_a_time_may_carry_its_unit(run: Run, text: str) -> None:
    at = run("lookup", "drive.yaml", "map", "base", "--at", text, files=FILES)
    assert at == run("lookup", "drive.yaml", "map", "base", "--at", "0.5", files=FILES)


def test_nanoseconds_taken_for_seconds_are_shown_as_they_are_written(run: Run) -> None:
    said = run("lookup", "drive.yaml", "map", "base", "--at", "1700000000123456789", files=FILES).err
    assert "are these nanoseconds? then write 1700000000123456789ns" in said


def test_fractions_are_a_range_as_times_are(run: Run) -> None:
    poses = ("interpolate", "{xyz: [0, 0, 0]}", "{xyz: [1, 0, 0]}")
    assert run(*poses, "0:1:0.1", "-f", "csv") == run(*poses, *[str(at / 10) for at in range(11)], "-f", "csv")
    assert "'0:1' is not a range; a range is START:STOP:STEP, as 0:1:0.25" in run(*poses, "0:1").err
    assert "STEP must be positive" in run(*poses, "0:1:-1").err


# --- units of stamps -----------------------------------------------------------------------------------------------

BY_NAME = [("timestamp_ms", 10**6), ("timestamp_us", 10**3), ("t [ms]", 10**6), ("stamp_ns", 1)]


@pytest.mark.parametrize(("name", "each"), [*BY_NAME, ("timestamp", 10**6), ("t", 10**3), ("stamp", 1)])
@pytest.mark.parametrize("into", ["tum", "json"])
def test_stamps_are_read_by_the_unit_in_their_name_or_else_by_their_size(run: Run, name: str, each: int, into: str) -> None:
    first = 1_700_000_000_123_000_000
    rows = "".join(f"{(first + step) // each},1,2,3,0,0,0,1\n" for step in (0, 10**8))
    done = run("convert", "-i", "a.csv", "-f", into, files={"a.csv": f"{name},x,y,z,qx,qy,qz,qw\n{rows}"})
    assert done.status == 0
    stamps = [str(first), str(first + 10**8)] if into == "json" else ["1700000000.123000000", "1700000000.223000000"]
    assert all(stamp in line for stamp, line in zip(stamps, done.out.splitlines(), strict=True)), done.out
    assert done.err.count("by their size") == ((name, each) not in BY_NAME)


@pytest.mark.parametrize(("text", "stamp"), [
    ("2024-05-01T12:00:00+02:00", "1714557600.000000000"), ("2024-05-01 10:00:00.123456789Z", "1714557600.123456789"),
    ("1969-12-31T23:59:59.5Z", "-0.500000000"),
])  # fmt: skip
def test_dates_of_iso_8601_are_stamps_where_they_say_their_zone(run: Run, text: str, stamp: str) -> None:
    done = run("convert", "-f", "tum", stdin=f"timestamp,x,y,z,qx,qy,qz,qw\n{text},1,2,3,0,0,0,1\n")
    assert (done.status, done.out.split(" ")[0]) == (0, stamp)
    done = run("convert", "-f", "tum", stdin=f"timestamp,x,y,z,qx,qy,qz,qw\n{text[:19]},1,2,3,0,0,0,1\n")
    assert (done.status, "is not a time" in done.err) == (1, True)
    assert run("convert", "-f", "tum", stdin="t,x,y,z,qx,qy,qz,qw\n2024-02-30T00:00:00Z,1,2,3,0,0,0,1\n").status == 1


@pytest.mark.parametrize(("name", "text"), [
    ("a.tum", "5.5 1 2 3 0 0 0 1\n7 1 2 3 0 0 0 1\n"),
    ("a.csv", "stamp_ms,x,y,z,qx,qy,qz,qw\n1700000000500,1,2,3,0,0,0,1\n1700000002000,1,2,3,0,0,0,1\n"),
    ("a.jsonl", '{"stamp": 4, "xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}\n{"stamp": 5.5, "xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}\n'),
])  # fmt: skip
def test_time_offset_first_begins_at_zero(run: Run, name: str, text: str) -> None:
    done = run("convert", "-i", name, "--time-offset", "first", "-f", "tum", files={name: text})
    assert [float(line.split(" ")[0]) for line in done.out.splitlines()] == [0.0, 1.5], done.err
    if name != "a.jsonl":
        done = run("resample", name, "--every", "1m", "--time-offset", "first", "-f", "tum", files={name: text})
        assert done.out.startswith("0.000000000 "), done.err


def test_iso_stamps_that_move_become_seconds_with_their_own_decimals(run: Run) -> None:
    text = "t,x,y,yaw\n2024-05-01T12:00:00Z,1,2,0\n2024-05-01T14:00:01.5+02:00,1,2,0\n"
    done = run("invert", "--time-offset", "first", stdin=text)
    assert done.out == "t,x,y,yaw\n0,-1.0,-2.0,0.0\n1.5,-1.0,-2.0,0.0\n", done.err


def test_time_offset_first_counts_for_trees(run: Run) -> None:
    moving = "{name: base, parent: map, samples: [{stamp: 7, xyz: [0, 0, 0]}, {stamp: 9, xyz: [4, 0, 0]}]}"
    done = run("lookup", "m.yaml", "map", "base", "--at", "1", "--time-offset", "first", files={"m.yaml": moving})
    assert "xyz: [2.0, 0.0, 0.0]" in done.out


@pytest.mark.parametrize("form", ["ros1", "ros2", "foxglove"])
def test_a_tree_at_a_time_is_written_with_that_stamp(run: Run, form: str) -> None:
    out = run("tree", "drive.yaml", "--at", "1.5", "-f", form, files=FILES).out
    assert out.count("500000000") == out.count("child_frame_id") == 2
    assert "500000000" not in run("tree", "still.yaml", "-f", form, files=FILES).out
