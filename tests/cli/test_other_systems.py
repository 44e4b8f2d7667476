"""Systems that are not POSIX, and their habits: what they lack, how they end lines, name files and keep them open."""

from __future__ import annotations

import json
import ntpath
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest
from machine_output import COMMANDS, FITS, GOLDEN, STREAMS
from shell import ENVIRONMENT, ROOT

from frametool import cli
from frametool.cli.commands import COMMANDS as NAMES
from frametool.formats import table
from frametool.sim.turtle import keyboard

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

# what Windows lacks; libraries that know which system they run on are imported before it is taken away
LACKING = """
import multiprocessing.connection, os, select, shutil, signal, subprocess, sys, tempfile
import numpy
shutil._use_fd_functions = False
for name in ("fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "termios", "tty"):
    sys.modules[name] = None
there = {"SIGABRT", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM", "SIG_DFL", "SIG_IGN"}
for module, names in (
    (signal, [name for name in dir(signal) if name.startswith("SIG") and name not in there]),
    (signal, "alarm getitimer pause pthread_kill pthread_sigmask setitimer siginterrupt sigpending sigwait".split()),
    (os, "O_NONBLOCK chown chroot fchmod fchown fork forkpty getegid geteuid getgid getgroups getpgid getpgrp getuid kill"
         " killpg lchown mkfifo nice openpty posix_fadvise posix_fallocate pread preadv pwrite register_at_fork"
         " sched_getaffinity sched_yield sendfile set_blocking setpgid setsid statvfs sync sysconf uname wait".split()),
    (select, "epoll kqueue poll POLLIN POLLHUP".split()),
):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
"""
SAME = """
import io, json, shlex
from pathlib import Path
from frametool.cli import run
for each, text in json.load(sys.stdin):
    sys.stdin = io.TextIOWrapper(io.BufferedReader(io.BytesIO(text.encode())), "utf-8")
    sys.stdout = io.TextIOWrapper(io.BytesIO(), "utf-8")
    status = run(shlex.split(each["run"]))
    assert status == each["status"] and each["out"] in (None, sys.stdout.buffer.getvalue().decode()), each["run"]
"""
LINES = [
    "--version", "--help", "help|time", "formats", "convert|--from|rpy|0|0|0|-o|b.yaml|--force", "compose|{xyz: [1, 2, 3]}|b.yaml",
    "view|robot.yaml|-o|robot.html", "view|robot.yaml", "convert|-i|walk.tum|-f|csv|-o|walk.csv",
    "convert|-i|walk.tum|-f|npy|-o|walk.npy", "convert|-i|walk.npy|-f|kitti", "apply|--transform|b.yaml|-i|cloud.csv",
    "apply|robot.yaml|map|lidar|-i|cloud.csv|-f|pcd", "mean|walk.tum", "sim|follow|--duration|1|--plot|run.svg",
    "convert|-i|walk.csv|--to|rpy|-o|walk.csv|--force", "examples|cloud.csv|-o|new.csv", "tree|drive.yaml|-o|drive.mcap",
    "record|drive.mcap|--with|{name: camera, parent: base_link, xyz: [1, 2, 3]}|-o|new.mcap",
]  # fmt: skip


def test_a_system_without_what_posix_has_prints_the_same(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    stored = [json.loads(line) for line in GOLDEN.read_text(encoding="utf-8").splitlines()]
    assert {each["run"].split()[0] for each in stored} | {line.split("|")[0] for line in LINES} >= set(NAMES)
    # the last digits of a fit are those of the processor
    stored = [each | {"out": None} if each["run"].split()[0] in FITS else each for each in stored]
    rows = [(each, STREAMS[name]) for each, (_, name) in zip(stored, COMMANDS, strict=True)]
    done = subprocess.run(
        [sys.executable, "-c", LACKING + SAME], input=json.dumps(rows).encode(), cwd=tmp_path, env=ENVIRONMENT,
        capture_output=True, check=False,
    )  # fmt: skip
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr


def test_a_system_without_what_posix_has_writes_files_and_text_for_people(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples", tmp_path, dirs_exist_ok=True)
    (tmp_path / "b.yaml").write_text("before")
    code = f"{LACKING}\nfrom frametool.cli import run\nfor line in sys.argv[1:]:\n    assert run(line.split('|')) == 0, line\n"
    done = subprocess.run([sys.executable, "-c", code, *LINES], cwd=tmp_path, env=ENVIRONMENT, capture_output=True, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr
    assert "w: 1.0" in (tmp_path / "b.yaml").read_text()


def test_keys_that_cannot_be_read_one_by_one_are_asked_for_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "termios", None)
    with pytest.raises(Exception, match=r"^single keys are read on Linux and macOS alone; pipe key names into frametool sim"):
        keyboard(headings=False).__enter__()


@pytest.mark.parametrize(("arguments", "status"), [(("sim", "teleop"), 2), (("sim", "follow", "--leader", "-"), 5)])
def test_a_closed_standard_input_is_told(arguments: tuple[str, ...], status: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    assert cli.run([*arguments]) == status
    assert capsys.readouterr().err.count("\n") == 1


ELSEWHERE = """
import io, sys
from frametool.cli import main
for name in ("stdout", "stderr"):  # as a program's output is opened where lines end in CR LF
    old = getattr(sys, name)
    setattr(sys, name, io.TextIOWrapper(old.buffer, "cp1252", errors=old.errors, newline="\\r\\n"))
main()
"""
TEXTS = [
    ["tree", "examples/robot.yaml"],
    ["tree", "examples/robot.yaml", "--color", "always"],
    ["help", "rotations"],
    ["convert", "--help"],
    ["batch"],
    ["check", "examples/drive.yaml", "examples/lidar.launch"],
    ["tree", "é─.yaml"],
]


@pytest.mark.parametrize("arguments", TEXTS, ids=" ".join)
def test_lines_end_in_one_character_and_text_is_utf_8_everywhere(arguments: list[str]) -> None:
    found = []
    for code in ("from frametool.cli import main; main()", ELSEWHERE):
        call = [sys.executable, "-c", code, *arguments]
        lines = "x = tree examples/robot.yaml -f yaml\ncheck $x\nconvert --from rpy_deg 0 0 90 -f text\n"
        done = subprocess.run(call, input=lines.encode(), cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=False)
        found.append((done.returncode, done.stdout, done.stderr))
    assert found[0] == found[1]
    assert b"\r" not in found[1][1] + found[1][2]


@pytest.mark.skipif(os.name == "nt", reason="there these are names of files in another folder")
@pytest.mark.parametrize(
    "arguments",
    [
        ("compare", r"C:\truth.tum", r"C:\mono.tum", "-f", "csv"),
        ("compare", r"C:\drive.yaml:map:box", r"C:\drive.yaml:map:box", "--align", "none", "-f", "csv"),
        ("lookup", r"C:\finger.xml", "palm", "site:tip", "--joints", r"C:\finger.xml:grasp", "-f", "json"),
        ("lookup", r"C:\drive.yaml", "map", "box", "--times", r"C:\times.txt", "-f", "csv"),
        ("solve", r"C:\measurements.yaml", "--without", r"C:\measurements.yaml:8", "-f", "json"),
        ("calc", r"d=C:\drive.yaml", "dist(d[map<-box @ 1s], d[map<-box @ 3s])"),
        ("apply", r"C:\robot.yaml", "map", "lidar", "-i", r"C:\cloud.csv"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_drive_is_no_prefix_of_a_name(run: Run, arguments: tuple[str, ...]) -> None:
    names = ("truth.tum", "mono.tum", "drive.yaml", "finger.xml", "measurements.yaml", "robot.yaml", "cloud.csv")
    files = {name: (ROOT / "examples" / name).read_bytes() for name in names} | {"times.txt": b"1\n2\n"}
    there = run(*arguments, files={f"C:\\{name}": content for name, content in files.items()})
    here = run(*(each.replace("C:\\", "") for each in arguments), files=files)
    assert (there.status, there.out.replace("C:\\", "")) == (here.status, here.out)
    assert here.status == 0


def test_a_drive_alone_is_no_file(run: Run) -> None:
    done = run("compare", r"C:\run.mcap:map:base", r"C:\run.mcap:map:base")
    assert (done.status, done.err) == (5, "frametool: C:\\run.mcap:map:base: no such file or directory\n")


@pytest.mark.parametrize(
    ("path", "form"),
    [(r"C:\data.d\images.txt", "colmap"), (r"C:\data.d\walk.TUM", "tum"), (r"C:\data.d\walk", None), (r"..\transforms.json", "nerf")],
)
def test_a_form_is_known_by_the_name_in_a_folder_of_windows(path: str, form: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "os", SimpleNamespace(path=ntpath))
    assert table.by_name(path, table.writers("poses")) == form


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="only Linux tells which files are open")
@pytest.mark.parametrize("form", ["csv", "jsonl", "npy", "pcd", "ply", "parquet", "arrow"])
@pytest.mark.parametrize("into", ["", "csv", "json", "npy"])
def test_the_input_is_closed_before_its_result_takes_its_place(run: Run, monkeypatch: pytest.MonkeyPatch, form: str, into: str) -> None:
    name = f"in.{form}"
    made = ("apply", "--transform", "{}", "-i", "a.csv", "-f", form.replace("jsonl", "json"), "-o", name)
    assert run(*made, files={"a.csv": "x,y,z\n1,2,3\n4,5,6\n"}).status == 0
    replace = os.replace

    def refuse_open(part: str, place: str) -> None:
        held = {os.path.realpath(f"/proc/self/fd/{each}") for each in os.listdir("/proc/self/fd")}
        if not held.isdisjoint({os.path.realpath(part), os.path.realpath(place)}):
            raise PermissionError(13, "Access is denied")
        replace(part, place)

    monkeypatch.setattr(os, "replace", refuse_open)
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "-i", name, "-o", name, "--force", *(["-f", into] if into else []))
    assert done.status == 0, done.err
