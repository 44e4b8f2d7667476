"""Streams over several processes: the same bytes, and nobody left behind when one of them dies."""

from __future__ import annotations

import os
import pickle
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from shell import by_default, run, start

from frametool.errors import FormatError, UnknownFrame

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
        assert process.poll() is None
        process.stdin.write(BLOCK)
        process.stdin.flush()
        workers = [int(each) for each in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]
    return process, workers


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
