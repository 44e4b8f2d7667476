"""The prompt in a terminal: completion, history, errors that do not end it, Ctrl-C and Ctrl-D; and expressions piped in."""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from frametool.calc.evaluate import Scope, completions
from frametool.calc.functions import TREE, Term, Type
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PROMPT = "> "


class Talk:
    """A session in a pseudo terminal."""

    def __init__(self, folder: Path, *, readline: bool = True) -> None:
        self.folder = folder
        code = "from frametool.cli import main; main()" if readline else "import sys; sys.modules['readline'] = None; from frametool.cli import main; main()"
        own, theirs = pty.openpty()
        self.terminal = own
        environment = os.environ | {"XDG_STATE_HOME": str(folder), "TERM": "xterm", "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, "calc", "--tree", "robot.yaml", "d=drive.yaml", "--to", "rpy_deg"],
            stdin=theirs, stdout=theirs, stderr=theirs, cwd=EXAMPLES, env=environment, start_new_session=True,
            preexec_fn=lambda: _take_terminal(theirs),  # noqa: PLW1509 - no threads here
        )  # fmt: skip
        os.close(theirs)
        self.read()

    def read(self) -> str:
        """Return what is written up to the next prompt, or the end; the order of events decides, not the time."""
        text = ""
        while not text.endswith(PROMPT):
            if not select.select([self.terminal], [], [], 60)[0]:
                raise AssertionError(text)
            try:
                piece = os.read(self.terminal, 4096).decode()
            except OSError:
                break
            if not piece:
                break
            text = re.sub(r"\x1b\[[?\d;]*[a-zA-Z]|\x07", "", text + piece)
        return text

    def say(self, keys: str) -> str:
        os.write(self.terminal, keys.encode())
        return self.read()

    def interrupt(self) -> str:
        """Press Ctrl-C until there is an answer: CPython's readline misses a signal that arrives just before its select()."""
        while self._state() not in "S?":
            time.sleep(0.01)
        os.write(self.terminal, b"\x03")
        while not select.select([self.terminal], [], [], 5)[0]:
            os.write(self.terminal, b"\x03")
        return self.read()

    def _state(self) -> str:
        """Return the state of the process, S where it sleeps, ? where the system has no /proc."""
        try:
            return Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return "?"

    def until(self, keys: str, expected: str) -> None:
        """Type without ending the line, and wait for what the terminal then shows."""
        os.write(self.terminal, keys.encode())
        text = ""
        while expected not in re.sub(r"\x1b\[[?\d;]*[a-zA-Z]|\x07", "", text):
            if not select.select([self.terminal], [], [], 60)[0]:
                raise AssertionError(text)
            text += os.read(self.terminal, 4096).decode()

    def end(self) -> int:
        os.write(self.terminal, b"\x04")
        self.read()
        return self.process.wait()


def _take_terminal(terminal: int) -> None:
    import fcntl
    import signal
    import termios

    signal.signal(signal.SIGINT, signal.SIG_DFL)  # runs in the background ignore it
    fcntl.ioctl(terminal, termios.TIOCSCTTY, 0)


@pytest.fixture
def talk(tmp_path: Path) -> Iterator[Talk]:
    session = Talk(tmp_path)
    yield session
    session.process.kill()
    session.process.wait()
    os.close(session.terminal)


def test_a_session_completes_remembers_goes_on_after_errors_and_ends(talk: Talk, tmp_path: Path) -> None:
    assert "6.0\r\n" in talk.say("2 * 3\n")
    assert "12.0\r\n" in talk.say("ans * 2\n")
    wrong = talk.say("1 + map\n")
    assert "frametool: unknown name 'map'; a frame is asked for as TARGET<-SOURCE\r\n  1 + map\r\n      ^\r\n" in wrong
    talk.until("trans(base_link<-li\t", "trans(base_link<-lidar")
    assert "0.285  0.0  0.31  m in base_link\r\n" in talk.say(")\n")
    talk.until("nor\t", "norm(")
    assert "5.0 m\r\n" in talk.say("[3, 4, 0])\n")
    talk.until("d[map<-sh\t", "d[map<-shelf")
    assert "shelf seen from map" in talk.say("]\n")
    talk.until("1 / 0 and more", "more")
    talk.interrupt()
    assert "7.0\r\n" in talk.say("7\n")
    assert "7.0\r\n" in talk.say("\x1b[A\n")
    assert "look-ups: TARGET<-SOURCE" in talk.say("help\n")
    assert "2.0 m\r\n" in talk.say("far = 2m\n")
    assert talk.end() == 0
    history = (tmp_path / "frametool_history").read_text().splitlines()
    assert history[:3] == ["2 * 3", "ans * 2", "1 + map"]
    assert history[-2:] == ["help", "far = 2m"]
    again = Talk(tmp_path)
    assert "help\r\n" in again.say("\x1b[A\x1b[A\n")
    assert again.end() == 0
    os.close(again.terminal)


def test_without_readline_the_prompt_is_plain(tmp_path: Path) -> None:
    session = Talk(tmp_path, readline=False)
    assert "6.0\r\n" in session.say("2 * 3\n")
    assert session.end() == 0
    os.close(session.terminal)
    assert not (tmp_path / "frametool_history").exists()


def test_words_are_completed_where_they_fit() -> None:
    scope = Scope(tree=load(EXAMPLES / "robot.yaml"))
    scope.names["d"] = Term(Type(TREE), (), tree=load(EXAMPLES / "drive.yaml"))
    assert completions(scope, "map<-cam", "inv(") == ["map<-camera_link", "map<-camera_optical"]
    assert completions(scope, "li", "2 * ") == ["lidar<-"]
    assert completions(scope, "gri", "d[") == ["gripper<-"]
    assert completions(scope, "map<-gri", "1 + d[") == ["map<-gripper"]
    assert completions(scope, "di", "") == ["dist("]
    assert completions(scope, "a", "x") == ["angle(", "asin(", "acos(", "atan(", "ans", "as ", "arm_base_link<-"]


def test_the_shell_completes_frames_of_the_trees_that_were_named(run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    for words, expected in [("frametool calc --tree robot.yaml inv(map<-cam", "inv(map<-camera_optical"), ("frametool calc d=drive.yaml d[map<-gri", "d[map<-gripper")]:
        monkeypatch.setenv("_FRAMETOOL_COMPLETE", "words")
        done = run(words, files={name: (EXAMPLES / name).read_text() for name in ("robot.yaml", "drive.yaml")})
        assert f"plain\t{expected}\t" in done.out.splitlines()


def test_a_pipe_is_one_expression_a_line(run: Callable[..., Any]) -> None:
    done = run("calc", "-f", "json", stdin="# twice\nx = 2mm\n\nx * 3\nans + 1mm\n")
    assert done.out == "0.006\n0.007\n"
    assert run("calc", stdin="x = 2\ny = x * 4\n").out == "8.0\n"
    assert run("calc", stdin="").out == ""


def test_a_pipe_stops_at_the_first_error_unless_told(run: Callable[..., Any]) -> None:
    lines = "1 + 1\n1 + \n3\n"
    done = run("calc", stdin=lines)
    assert (done.status, done.out) == (1, "2.0\n")
    assert done.err == "frametool: something is missing here\n  1 + \n     ^\n"
    in_json = run("calc", "-f", "json", stdin=lines)
    assert in_json.err == '{"error": "calc_error", "message": "something is missing here", "column": 4}\n'
    skipped = run("calc", "--on-error", "skip", stdin=lines)
    assert (skipped.status, skipped.out) == (3, "2.0\n---\n3.0\n")
    assert "frametool: stdin:2:4: something is missing here (row skipped)" in skipped.err
    assert "stdin: 1 of 3 rows skipped" in skipped.err


def test_a_lone_dash_is_standard_input(run: Callable[..., Any]) -> None:
    assert run("calc", "-", "-f", "json", stdin="1 + 2\n").out == run("calc", "-f", "json", stdin="1 + 2\n").out != ""
