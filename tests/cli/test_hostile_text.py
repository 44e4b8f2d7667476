"""Names with control characters, and bytes that are no text: no terminal is steered, nothing ends in a traceback."""

from __future__ import annotations

import json
import os
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import shell
from shell import ENVIRONMENT, TOOL

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

ESC = "a\x1b[31mX\n\x9b\x7f\0"
TREE = json.dumps({"frames": [{"name": ESC, "parent": "p\x1b]0;q", "xyz": [1, 2, 3]}]})
MOVING = json.dumps(
    {"frames": [{"name": ESC, "parent": "p\x07", "samples": [{"stamp": at, "xyz": [at, 0, 0]} for at in (0, 1, 9)]}]}
)
NAMES = [b"\xff\xfe.yaml", b"a\x1b[31m\nb\x7f.yaml"]
COMMANDS = [
    "lookup FILE nope p", "lookup FILE nope p -f json", "tree FILE -f text", "tree FILE -f mermaid", "tree FILE -f json",
    "tree FILE -f yaml", "tree FILE -v", "tree FILE -f ros2", "check FILE", "check FILE -f json", "check FILE -f github",
    "monitor FILE -f text", "monitor FILE -f json", "monitor FILE p\x1b q", "apply FILE x\x1b y 1 2 3", "check no\x1bFILE",
    "convert no\x1b.yaml", "x\x1b", "invert --x\x1b", "lookup FILE a b --at \x1b", "convert --to \x1b 1", "sim run FILE",
    "sim follow --leader \x1bx", "sim follow --leader FILE", "convert --from rpy 0 0 \x1b", "convert {\x1b:1}", "monitor no\x1b",
    "static FILE -f json", "invert --columns \x1b", "apply FILE p -i FILE", "invert -i no\x1b", "compose FILE FILE",
]  # fmt: skip


def test_no_control_character_reaches_a_terminal(run: Callable[..., Outcome], tmp_path: Path) -> None:
    """In this process: the command line that a process runs, with stderr as Python makes it."""
    for name in map(os.fsdecode, NAMES):
        for content in (TREE, MOVING):
            (tmp_path / name).write_text(content)
            # what names no file is the same each time
            chosen = [command for command in COMMANDS if "FILE" in command or (name, content) == (os.fsdecode(NAMES[0]), TREE)]
            for command in chosen:
                done = run(*(word.replace("FILE", name) for word in command.split(" ")))
                shown = (done.out + done.err).replace("\n", "").replace("\ufffd", "")
                assert shown.isprintable(), command
                assert "Traceback" not in done.err, command
                assert done.status in (0, 1, 2, 4, 5), command


def test_files_may_be_called_as_the_system_allows(tmp_path: Path) -> None:
    for name in NAMES:
        path = bytes(tmp_path) + b"/" + name
        assert shell.run("convert", "--from", "rpy", "0", "0", "1", "-o", path) == (0, b"", b"")
        assert shell.run("invert", path)[::2] == (0, b"")
        assert shell.run("sim", "follow", "--duration", "0.1", "-o", path, "--force")[0] == 0
        status, _, err = shell.run("convert", "--from", "rpy", "0", "0", "1", "-o", path)
        assert (status, err.count(b"\n"), b"exists" in err) == (5, 1, True)


def test_what_becomes_part_of_a_result_is_text() -> None:
    status, out, err = shell.run("invert", "--prefix", b"\xff", text=b"x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n")
    assert (status, out) == (2, b"")
    assert b"cannot be written as UTF-8 text" in err


def test_a_nul_ends_no_name(tmp_path: Path) -> None:
    tree = tmp_path / "tree.yaml"
    tree.write_text("frames: [{name: map, parent: world, xyz: [1, 0, 0]}]")
    for options, cell in ((["world", "--source-column", "f"], b"1,map\0junk"), (["map", "--target-column", "f"], b"1,world\0")):
        status, out, err = shell.run("lookup", str(tree), *options, "--in", "csv", "--on-error", "skip", text=b"i,f\n" + cell + b"\n")
        assert (status, out.count(b"\n")) == (3, 1), err
        assert b"unknown frame" in err
    both = ["--target-column", "f", "--source-column", "g", "--in", "csv", "--on-error", "skip"]
    assert shell.run("lookup", str(tree), *both, text=b"f,g\nworld\0map,map\nworld,map\n")[0] == 3


@pytest.mark.parametrize("arguments", [["lookup", "TREE", "map", "lidar"], ["invert"]])
# Python itself needs five files to start where a .pth file imports something
@pytest.mark.parametrize("limit", ["-n 5", "-n 6", "-v 40000", "-v 60000", "-v 120000"])
def test_what_the_system_runs_out_of_is_one_line(arguments: list[str], limit: str) -> None:
    tree = str(Path(__file__).parents[2] / "examples" / "robot.yaml")
    command = [tree if word == "TREE" else word for word in arguments]
    done = subprocess.run(
        ["bash", "-c", f'ulimit {limit}; exec "$@"', "bash", *TOOL, *command],
        input=b"x,y,z,qx,qy,qz,qw\n" + b"1,2,3,0,0,0,1\n" * 20_000, capture_output=True, check=False, env=ENVIRONMENT,
    )  # fmt: skip
    if not done.stderr.startswith(b"OpenBLAS error"):  # which ends the process itself
        assert (done.returncode, done.stderr.count(b"\n")) in ((0, 0), (5, 1)), done.stderr


@pytest.mark.parametrize("blank", [" ", "\t", "\n", "\r\n", " \n", "- "])
@pytest.mark.parametrize("broken", ["", '{"xyz": [1, 2, x]}', "1 2 x"])
def test_blanks_before_something_broken_take_no_time(run: Callable[..., Outcome], blank: str, broken: str) -> None:
    began = time.process_time()
    for command in (["invert", "-i", "-"], ["tree", "-"]):
        done = run(*command, stdin=broken[:5] + blank * 20_000 + broken)
        assert (done.status, done.err.count("Traceback")) == (1, 0)
    assert time.process_time() - began < 4


IMU = {
    "header": {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "imu"},
    "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}, "angular_velocity": {"x": 0, "y": 0, "z": 0},
    "linear_acceleration": {"x": 0, "y": 0, "z": 9},
}  # fmt: skip
ENTRIES = ",".join(f"c{row}{column}" for row in range(1, 7) for column in range(1, 7))


@pytest.mark.parametrize(
    ("arguments", "stdin", "status", "words"),
    [
        (["calc", "{xyz: [1, 2, 3]}", "-f", "mcap", "-o", "z.mcap"], "", 1, "mcap holds messages"),
        (["calc", "row"], json.dumps(IMU) + "\n", 1, "an attitude cannot be added to rows"),
        (["mean", "-", "--by", "t"], '<origin xyz="1 2 3" rpy="0 0 1"/>\n', 1, "leave --by out"),
        (["invert", "--on-error", "null", "-f", "json"], f"x,y,z,qx,qy,qz,qw,{ENTRIES}\na\n", 3, "expected 43 cells, found 1"),
        (["resample", "hu.csv", "--every", "0.5m"], "", 1, "a place at 1e+308 m"),
    ],
)  # fmt: skip
def test_what_nobody_expects_is_refused_in_one_line(run: Callable[..., Outcome], arguments: list[str], stdin: str, status: int, words: str) -> None:
    done = run(*arguments, stdin=stdin, files={"hu.csv": "t,x,y,z\n0,0,0,0\n1,1e308,0,0\n2,-1e308,0,0\n"})
    assert (done.status, words in done.err, "Traceback" in done.err) == (status, True, False), done.err
