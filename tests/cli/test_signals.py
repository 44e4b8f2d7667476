"""Who ends a run leaves nothing half behind: files, lines, the terminal's state."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import termios
from threading import Thread
from typing import TYPE_CHECKING

import pytest
from shell import ENVIRONMENT, ROOT, TOOL, by_default, run, start

if TYPE_CHECKING:
    from pathlib import Path

STREAM = ["apply", "--transform", "{xyz: [1, 2, 3]}"]
ENDLESS = ["sim", "follow", "--duration", "inf", "--realtime"]


def until_written(process: subprocess.Popen[bytes], folder: Path, begun: int) -> None:
    """Wait until a part file has something in it."""
    while sum(path.stat().st_size for path in folder.iterdir()) <= begun:
        assert process.poll() is None


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
@pytest.mark.parametrize("arguments", [STREAM, ENDLESS], ids=["stream", "simulation"])
@pytest.mark.parametrize("link", [False, True])
def test_an_ended_run_replaces_nothing(number: int, arguments: list[str], link: bool, tmp_path: Path) -> None:  # noqa: FBT001
    (tmp_path / "old").write_bytes(b"before")
    (tmp_path / "link").symlink_to("old")
    target = str(tmp_path / ("link" if link else "old"))
    # a test may itself run under nohup, where SIGHUP is ignored and would stay so
    with start(*arguments, "-o", target, "--force", preexec_fn=by_default) as process:
        assert process.stdin is not None
        process.stdin.write(b"x,y,z\n1,2,3\n")
        process.stdin.flush()
        until_written(process, tmp_path, 2 * len(b"before"))
        process.send_signal(number)
        assert process.wait() == (130 if number == signal.SIGINT else -number)
    assert (tmp_path / "old").read_bytes() == b"before"
    left = {path.name for path in tmp_path.iterdir()} - {"old", "link"}
    if number == signal.SIGKILL:
        left.discard(f"old.{process.pid}.part")
    assert not left


def test_what_is_ignored_stays_ignored(tmp_path: Path) -> None:
    def as_under_nohup() -> None:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)

    with start(*STREAM, "-o", str(tmp_path / "out"), preexec_fn=as_under_nohup) as process:
        assert process.stdin is not None
        process.stdin.write(b"x,y,z\n1,2,3\n")
        process.stdin.flush()
        until_written(process, tmp_path, 0)
        process.send_signal(signal.SIGHUP)
        process.communicate(b"4,5,6\n")
    assert process.returncode == 0
    assert (tmp_path / "out").read_bytes() == b"x,y,z\n2.0,4.0,6.0\n5.0,7.0,9.0\n"


def test_a_bad_row_or_a_missing_input_leaves_no_file(tmp_path: Path) -> None:
    source = tmp_path / "in.csv"
    source.write_bytes(b"x,y,z\n1,2,3\n1,?,3\n")
    (tmp_path / "link").symlink_to("in.csv")
    assert run(*STREAM, "-i", str(source), "-o", str(tmp_path / "out"))[0] == 1
    assert run(*STREAM, "-i", str(source), "-o", str(tmp_path / "link"))[0] == 5
    assert run(*STREAM, "-i", str(source), "-o", str(tmp_path / "link"), "--force")[0] == 1
    assert source.read_bytes() == b"x,y,z\n1,2,3\n1,?,3\n"
    assert run(*STREAM, "-i", str(source), "-o", str(tmp_path / "link"), "--force", "--on-error", "skip")[0] == 3
    assert source.read_bytes() == b"x,y,z\n2.0,4.0,6.0\n"
    assert sorted(os.listdir(tmp_path)) == ["in.csv", "link"]


def test_a_result_and_its_plot_are_two_files(tmp_path: Path) -> None:
    (tmp_path / "link.svg").symlink_to("f.svg")
    for other in ("f.svg", "./f.svg", "link.svg"):
        done = subprocess.run(
            [*TOOL, "sim", "follow", "--duration", "0.1", "-o", "f.svg", "--plot", other, "--force"],
            cwd=tmp_path, env=ENVIRONMENT, capture_output=True, check=False,
        )  # fmt: skip
        assert (done.returncode, b"the same file" in done.stderr) == (2, True)
    assert os.listdir(tmp_path) == ["link.svg"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("arguments", [["follow", "--live", "--duration", "inf"], ["teleop"]], ids=["live", "teleop"])
def test_a_terminal_is_as_before(number: int, arguments: list[str]) -> None:
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    environment = ENVIRONMENT | {"TERM": "xterm", "COLUMNS": "80", "LINES": "24"}
    with subprocess.Popen(
        [*TOOL, "sim", *arguments], stdin=theirs, stdout=theirs, stderr=theirs, env=environment,
        preexec_fn=by_default,  # noqa: PLW1509 - no thread is running yet
    ) as tool:
        drawn = b""
        while b"\x1b[?25l" not in drawn or drawn.count(b"turtle2") < 2:  # it is drawing, without a cursor
            drawn += os.read(ours, 1 << 16)
        tool.send_signal(number)
        while b"\x1b[?25h" not in drawn[drawn.rindex(b"\x1b[?25l") :]:
            drawn += os.read(ours, 1 << 16)
        Thread(target=drain, args=(ours,), daemon=True).start()
        assert tool.wait() == (130 if number == signal.SIGINT else -number)
    assert termios.tcgetattr(theirs) == before


def drain(terminal: int) -> None:
    """Read what a program still draws, so that it can end."""
    while os.read(terminal, 1 << 16):
        pass


# the first signal comes when a module is looked for: click, whose import takes longest, or one that a command needs
HURRIED = """
import os, signal, sys
from frametool.cli import main
class Looked:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Looked())
main(["lookup", "robot.yaml", "map", "tool"])
"""


@pytest.mark.parametrize("module", ["contextlib", "frametool.cli.signals", "click", "frametool.cli.command", "frametool.formats.load", "yaml"])
def test_ctrl_c_during_the_start_prints_nothing(module: str) -> None:
    call = [sys.executable, "-I", "-S", "-c", f"import sys; sys.path[:0] = {sys.path!r}\n{HURRIED}", module]
    done = subprocess.run(call, cwd=ROOT / "examples", capture_output=True, check=False, preexec_fn=by_default)
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"")


def test_a_start_that_can_open_no_file_is_one_line() -> None:
    code = "import resource; from frametool.cli import main; resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3)); main()"
    done = subprocess.run([sys.executable, "-c", code, "--version"], env=ENVIRONMENT, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (5, b"frametool: too many open files\n")
