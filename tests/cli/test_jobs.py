"""Streams over several processes: the same bytes, and nobody left behind when one of them dies."""

from __future__ import annotations

import os
import pickle
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from shell import by_default, in_shell, run, start

from frametool.errors import FormatError, UnknownFrame
from frametool.stream.workers import cores

if TYPE_CHECKING:
    import subprocess

MOVE = ["apply", "--transform", "{xyz: [1, 2, 3]}", "--jobs", "2"]
HEAD = b"x,y,z\n"
BLOCK = b"1,2,3\n" * 20_000
CHILDREN = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="no list of child processes at hand")


def begun(*arguments: str) -> tuple[subprocess.Popen[bytes], list[int]]:
    """Start a stream that waits for more input, with its two workers at work."""
    process = start(*MOVE, *arguments, preexec_fn=by_default)  # runs in the background ignore SIGINT
    assert process.stdin is not None
    process.stdin.write(HEAD)
    workers: list[int] = []
    while len(workers) < 2:
        process.stdin.write(BLOCK)
        process.stdin.flush()
        workers = children_of(process, 0)
    return process, workers


def children_of(process: subprocess.Popen[bytes], count: int) -> list[int]:
    """Return the processes that a process has started, once there are so many."""
    found: list[int] = []
    while not found or len(found) < count:
        assert process.poll() is None
        found = [int(each) for each in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]
        if not count:
            break
    return found


@CHILDREN
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGSEGV])
@pytest.mark.parametrize("victim", [0, 1])
def test_a_worker_that_dies_is_an_error_and_leaves_no_file(number: int, victim: int, tmp_path: Path) -> None:
    process, workers = begun("-o", str(tmp_path / "out.csv"))
    os.kill(workers[victim], number)
    _, err = process.communicate(BLOCK * 4)
    message = f"frametool: a process of --jobs died of {signal.Signals(number).name}; the result is not complete\n"
    assert (process.returncode, err.decode()) == (5, message)
    assert list(tmp_path.iterdir()) == []


@CHILDREN
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_parent_that_dies_takes_its_workers_along(number: int, tmp_path: Path) -> None:
    process, _ = begun("-o", str(tmp_path / "out.csv"))
    with process:
        process.send_signal(number)
        assert process.stderr is not None
        assert process.stderr.read() == b""  # ends only when nobody holds the pipe any more
        assert process.wait() == (130 if number == signal.SIGINT else -number)


@CHILDREN
def test_a_worker_that_dies_over_a_file_is_an_error_too(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_bytes(HEAD + BLOCK * 50)
    process = start(*MOVE, "-i", str(tmp_path / "rows.csv"))  # which nobody reads from yet
    for worker in children_of(process, 2):
        os.kill(worker, signal.SIGKILL)
    out, err = process.communicate()
    assert err == b"frametool: a process of --jobs died of SIGKILL; the result is not complete\n"
    assert process.returncode == 5
    assert len(out) < 50 * len(BLOCK)


def test_a_reader_that_goes_ends_all(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_bytes(HEAD + BLOCK * 20)
    assert in_shell("| head -n 2", *MOVE, "-i", str(tmp_path / "rows.csv")) == (141, HEAD + b"2.0,4.0,6.0\n", b"")


def test_a_typed_line_is_answered_at_once() -> None:
    with start(*MOVE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for line in (HEAD + b"0,0,0\n", b"1,1,1\n"):
            process.stdin.write(line)
            process.stdin.flush()
            answers = [process.stdout.readline() for _ in range(line.count(b"\n"))]
            assert len(answers[-1].split(b",")) == 3
        process.stdin.close()
        assert (process.stdout.read(), process.wait()) == (b"", 0)


def test_zero_means_all_cores(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_bytes(HEAD + BLOCK * 10)
    told = [run(*MOVE[:-1], count, "-i", str(tmp_path / "rows.csv")) for count in ("0", "1")]
    assert told[0] == told[1]
    assert cores() == len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))


ROWS = b"t,x,y,z,yaw\n" + b"0,1,2,3,1\n1,2,2,3,3\n2,3,3,3,5\n"
RECORDS = b'{"xyz": [1, 2, 3], "rpy": [0, 0, 1]}\n' * 2
OBSTACLES = [
    ("each row needs those before it", ROWS, ["convert", "--to", "rpy", "--unwrap"]),
    ("each row needs those before it", ROWS, ["relative", "--consecutive"]),
    ("each row needs those before it", ROWS, ["mean"]),
    ("rows become tum one after the other", ROWS, ["convert", "-f", "tum"]),
    ("records become csv one after the other", RECORDS, ["convert", "-f", "csv"]),
]


@pytest.mark.parametrize(("obstacle", "rows", "command"), OBSTACLES)
def test_where_one_process_has_to_do_it_that_is_said_once(obstacle: str, rows: bytes, command: list[str]) -> None:
    status, out, err = run(*command, text=rows)
    word = f"frametool: --jobs does not help here: {obstacle}; one process does the work\n".encode()
    assert run(*command, "--jobs", "3", text=rows) == (status, out, word + err)
    assert status == 0


def test_more_processes_than_anyone_has_are_refused() -> None:
    for count in ("-1", "257", "99999999999999999999"):
        status, out, err = run(*MOVE[:-1], count, text=HEAD)
        assert (status, out, err.count(b"\n")) == (2, b"", 1)


def test_many_processes_give_the_bytes_of_one(tmp_path: Path) -> None:
    rows = HEAD + b"".join(b"%d,2,3\n" % row for row in range(60_000)) + b"1,?,3\n" + BLOCK
    alone = run(*MOVE[:-1], "1", "--on-error", "skip", text=rows)
    for count in ("2", "3", "64"):
        assert run(*MOVE[:-1], count, "--on-error", "skip", text=rows) == alone
    tree = tmp_path / "tree.yaml"
    tree.write_text("frames: [{name: a, parent: b, xyz: [1, 0, 0]}]")
    rows = b"frame_id,x,y,z\n" + b"/a,1,2,3\nno,1,2,3\n" * 20_000
    told = [
        run("apply", str(tree), "b", "--on-error", "skip", "--jobs", jobs, text=rows) for jobs in ("1", "2")
    ]
    assert told[0] == told[1]


def test_errors_pass_between_processes() -> None:
    unknown = pickle.loads(pickle.dumps(UnknownFrame("a", known=["b"])))  # noqa: S301 - our own bytes
    assert (str(unknown), unknown.details()) == ("unknown frame 'a'; frames: b", {"frame": "a", "known": ["b"]})
    placed = pickle.loads(pickle.dumps(FormatError("bad", source="s", line=3)))  # noqa: S301 - our own bytes
    assert (str(placed), placed.line) == ("s:3: bad", 3)
