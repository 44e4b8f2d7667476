"""`frametool.run`: the command line inside a program does what the shell does, and leaves the program as it was."""

from __future__ import annotations

import os
import sys
import warnings
from threading import Thread
from typing import TYPE_CHECKING

import pytest

import frametool
from frametool import Ran

if TYPE_CHECKING:
    from pathlib import Path

ROBOT = b"frames: {map: {base: {xyz: [1, 2, 3]}}}\n"
TURN = '{"rpy_deg": {"roll": 0.0, "pitch": 0.0, "yaw": 90.0}}\n'


def run(line: str | list[object], stdin: bytes = b"", files: dict[str, bytes] | None = None, columns: int = 0) -> Ran:
    """Run a command, and hold the process to what it was before."""

    def state() -> list[object]:
        return [sys.stdin, sys.stdout, sys.stderr, os.getcwd(), dict(os.environ), sys.getrecursionlimit(), [*warnings.filters]]

    before = state()
    found = frametool.run(line, stdin, files, columns=columns)
    assert state() == before
    return found


@pytest.mark.parametrize("line", [
    "convert --from rpy_deg 0 0 90 --to rpy_deg -f json", "frametool convert --from rpy_deg 0 0 90 --to rpy_deg -f json",
    ["convert", "--from", "rpy_deg", 0, 0, 90, "--to", "rpy_deg", "-f", "json"],
    "frametool convert --from rpy_deg 0 0 90 | frametool convert \\\n  --to 'rpy_deg' -f json  # | invert",
])  # fmt: skip
def test_a_line_or_its_words_give_what_the_shell_prints(line: str | list[object]) -> None:
    assert run(line) == run(line) == Ran(TURN.encode(), "", 0, {})


def test_standard_input_files_and_results_are_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("convert --from rpy_deg --to rotvec", b"roll,pitch,yaw\n0,0,0\n").out == b"rotvec_x,rotvec_y,rotvec_z\n0.0,0.0,0.0\n"
    found = run("lookup in/robot.yaml map base -f json -o base.json", files={"in/robot.yaml": ROBOT})
    assert found == Ran(b"", "", 0, {"base.json": b'{"name": "base", "parent": "map", "xyz": [1.0, 2.0, 3.0], "quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}\n'})
    assert [*tmp_path.iterdir()] == []
    (tmp_path / "robot.yaml").write_bytes(ROBOT)
    assert run("tree robot.yaml -o copy.json").status == 0
    assert (tmp_path / "copy.json").is_file()
    assert run("convert --from rpy_deg 0 0 90 --to rpy_deg -f json -o /dev/stdout").out == TURN.encode()


@pytest.mark.parametrize(("line", "status", "message"), [
    ("convert 'open", 2, "the ' in column 9 is not closed"),
    ("convert $pose", 2, "$pose has no value here"),
    ("convert > file", 2, "> is for a shell: write one command a line"),
    ("lookup robot.yaml map bse", 4, "did you mean 'base'?"),
    ("lookup nowhere.yaml map base", 5, "nowhere.yaml: no such file"),
    (["lookup", "a\0b", "map", "base"], 5, "embedded null byte"),
    ("convert --from rpy_deg 0 0 90 | convrt", 2, "no command 'convrt'"),
])  # fmt: skip
def test_an_error_is_a_message_and_a_status(line: str | list[object], status: int, message: str) -> None:
    found = run(line, files={"robot.yaml": ROBOT})
    assert (found.out, found.status, found.err.count("\n") > 0) == (b"", status, True)
    assert found.err.startswith("frametool: ")
    assert message in found.err


@pytest.mark.skipif(os.name == "nt", reason="named pipes are of POSIX")
def test_standard_input_and_files_may_be_text() -> None:
    text = "name,x,y,z\nZürich,1,2,3\n"
    expected = frametool.run("invert --quiet -f csv", text.encode())
    assert frametool.run("invert --quiet -f csv", text) == expected
    assert frametool.run("invert --quiet -f csv -i a.csv", files={"a.csv": text}).out == expected.out


def test_a_reader_that_is_gone_does_not_end_the_program(tmp_path: Path) -> None:
    pipe = str(tmp_path / "pipe")
    os.mkfifo(pipe)

    def read_nothing() -> None:
        os.close(os.open(pipe, os.O_RDONLY))

    thread = Thread(target=read_nothing)
    thread.start()
    found = run(["convert", "-i", "-", "--from", "rpy_deg", "--to", "xyzw", "-o", pipe], b"0 0 0\n" * 200_000)
    thread.join()
    assert (found.out, found.status) == (b"", 141)


def test_calls_of_several_threads_come_one_after_the_other() -> None:
    found: dict[int, bytes] = {}

    def turn(yaw: int) -> None:
        found[yaw] = frametool.run(["convert", "--from", "rpy_deg", 0, 0, yaw, "--to", "rpy_deg", "--precision", 0, "-f", "json"]).out

    threads = [Thread(target=turn, args=(yaw,)) for yaw in range(0, 80, 10)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert found == {yaw: TURN.replace("90.0", str(yaw)).replace("0.0", "0").encode() for yaw in range(0, 80, 10)}


def test_with_columns_the_output_is_laid_out_as_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"robot.yaml": ROBOT}
    assert run("tree robot.yaml", files=files, columns=80).out.decode().splitlines()[0] == "map"
    wide, narrow = (run("lookup robot.yaml map base", files=files, columns=width).out.decode() for width in (120, 30))
    assert max(map(len, wide.splitlines())) > 60
    assert max(map(len, narrow.splitlines())) < 60
    assert "\x1b[" not in wide
    drawn = run("view robot.yaml", files=files, columns=60)
    assert (drawn.status, drawn.err) == (0, "")
    assert 50 < max(map(len, drawn.out.decode().splitlines())) <= 60
    monkeypatch.delenv("NO_COLOR")
    monkeypatch.setenv("TERM", "xterm-256color")
    assert "\x1b[" in run("tree robot.yaml", files=files, columns=80).out.decode()


@pytest.mark.parametrize("name", ["/etc/robot.yaml", "../robot.yaml", "in/../../robot.yaml"])
def test_no_file_is_written_outside_the_folder(name: str) -> None:
    with pytest.raises(ValueError, match="is not the name of a file in the folder"):
        run("tree robot.yaml", files={name: ROBOT})
