"""On a terminal: colours mark frames and trouble, notes fit its width; in pipes the same bytes as ever."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from console import ROOT

if TYPE_CHECKING:
    from pathlib import Path

CODES = re.compile(r"\x1b\[[\d;]*m")
LATE = (
    "{frames: [{name: b, parent: a, samples: [{stamp: 0}, {stamp: 1}, {stamp: 2}, {stamp: 3}, {stamp: 4, xyz: [9, 0, 0]}, {stamp: 5, xyz: [9, 0, 0]}]}, "
    "{name: c, parent: b, samples: [{stamp: 7}, {stamp: 8}]}]}"
)
TABLE = "frame,x,y,z,yaw_deg\nlidar,1,2,3,90\n"


def seen(folder: Path, *arguments: str, **environment: str) -> str:
    """Return what a command shows on a terminal of 80 columns, stdout and stderr together."""
    kept = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "COLUMNS")}
    outer, inner = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "frametool", *arguments], stdin=inner if "PAGER" in environment else subprocess.DEVNULL, stdout=inner, stderr=inner, cwd=folder,
        env=kept | {"PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "80"} | environment,
    )  # fmt: skip
    os.close(inner)
    data = b""
    try:
        while piece := os.read(outer, 65536):
            data += piece
    except OSError:  # nobody writes any more
        pass
    os.close(outer)
    process.wait()
    return data.decode().replace("\r\n", "\n")


def green(text: str) -> str:
    return f"\x1b[32m{text}\x1b[0m"


def cyan(text: str) -> str:
    return f"\x1b[36m{text}\x1b[0m"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (tmp_path / "table.csv").write_text(TABLE)
    return tmp_path


COLOURED = [
    (("lookup", "examples/robot.yaml", "map", "tool"), f"{green('tool')} seen from {cyan('map')}  (maps points in {green('tool')} to points in {cyan('map')})\n"),
    (("lookup", "examples/drive.yaml", "map", "box", "--at", "1"), f"{green('box')} seen from {cyan('map')} at 1.000000000  (maps points in {green('box')} to points in {cyan('map')})\n"),
    (("lookup", "{name: seen, parent: from, xyz: [1, 2, 3]}", "from", "seen"), f"{green('seen')} seen from {cyan('from')}  (maps points in {green('seen')} to points in {cyan('from')})\n"),
    (("lookup", "examples/drive.yaml", "map", "base_link", "--times", "0,1", "-f", "text"), f"{green('base_link')} seen from {cyan('map')} at 1.000000000\n  (maps points in {green('base_link')} to points in {cyan('map')})\n"),
    (("convert", "{name: b c, parent: a, xyz: [1, 2, 3]}"), f"{green('b c')} seen from {cyan('a')}  (maps points in {green('b c')} to points in {cyan('a')})\n"),
    (("check", "table.csv"), "table.csv:1: \x1b[31merror\x1b[0m: no column name nor stamp among frame, x, y, z, yaw_deg;\n"),
    (("monitor", LATE), "\x1b[31ma <- b"),
    (("monitor", LATE, "a", "c"), "its edges \x1b[31mshare no time\x1b[0m: "),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "expected"), COLOURED, ids=[" ".join(row[0])[:60] for row in COLOURED])
def test_colour_marks_frames_and_trouble_on_a_terminal_and_nowhere_else(folder: Path, arguments: tuple[str, ...], expected: str) -> None:
    text = seen(folder, *arguments)
    assert expected in text
    assert "\x1b" not in seen(folder, *arguments, NO_COLOR="1")
    assert "\x1b" not in seen(folder, *arguments, TERM="dumb")
    assert CODES.sub("", text) == seen(folder, *arguments, NO_COLOR="1")
    piped = subprocess.run([sys.executable, "-m", "frametool", *arguments], cwd=folder, capture_output=True, check=False, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert b"\x1b" not in piped.stdout + piped.stderr


def test_what_is_in_order_has_no_colour_of_trouble(folder: Path) -> None:
    assert "\x1b" not in seen(folder, "monitor", "examples/drive.yaml")
    assert "\x1b" not in seen(folder, "check", "examples/drive.yaml")


NOTES = [
    ("tree", "examples/robot.yaml", "-f", "camchain"), ("convert", "-i", "table.csv", "-f", "tum"), ("tree", "examples/camchain.yaml"),
    ("mean", "examples/tag_seen.csv", "--robust"),
]  # fmt: skip


@pytest.mark.parametrize("arguments", NOTES, ids=[" ".join(row) for row in NOTES])
def test_notes_and_warnings_fit_the_terminal_and_are_one_line_in_a_pipe(folder: Path, arguments: tuple[str, ...]) -> None:
    shown = seen(folder, *arguments, "-o", "out.txt", *(["-f", "yaml"] if "-f" not in arguments else []))
    piped = subprocess.run(
        [sys.executable, "-m", "frametool", *arguments, "-o", "again.txt", *(["-f", "yaml"] if "-f" not in arguments else [])],
        cwd=folder, capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert [line for line in shown.split("\n") if len(line) > 80] == []
    assert all(line.startswith(("frametool: ", "  ")) for line in shown.split("\n") if line)
    assert all(line.startswith("frametool: ") for line in piped.stderr.splitlines())
    assert shown.split() == piped.stderr.split()
    assert any(len(line) > 80 for line in piped.stderr.splitlines()) == any(line.startswith("  ") for line in shown.split("\n"))


def test_an_error_wraps_at_the_width_of_the_terminal_and_is_one_line_in_a_pipe(folder: Path) -> None:
    shown = seen(folder, "tree", "table.csv")
    assert (shown.count("\n"), max(map(len, shown.splitlines())) <= 80) == (3, True)
    piped = subprocess.run(
        [sys.executable, "-m", "frametool", "tree", "table.csv"], cwd=folder, capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert (piped.stderr.count("\n"), shown.split()) == (1, piped.stderr.split())


NUMBERS = [
    (("convert", "--from", "rpy_deg", "10", "20", "30", "--to", "rpy_deg"), "  rpy  roll 10.0 pitch 20.0 yaw 30.0  deg\n"),
    (("apply", "--transform", "{rpy_deg: [0, 0, 120]}", "1", "0", "0"), "-0.5  0.866025404  0.0  m\n"),
    (("calc", "pi/3", "sin(pi)"), "1.04719755\n0.0\n"),
    (("convert", "--from", "rpy_deg", "0", "0", "30", "--to", "matrix"), "  matrix  [ 0.866025404 -0.5         0.0 ]\n          [ 0.5          0.866025404 0.0 ]\n          [ 0.0          0.0         1.0 ]\n"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "expected"), NUMBERS, ids=[row[0][0] for row in NUMBERS])
def test_a_terminal_shows_nine_digits_and_no_rounding_errors(folder: Path, arguments: tuple[str, ...], expected: str) -> None:
    text = seen(folder, *arguments)
    assert CODES.sub("", text) == expected
    assert ("\x1b[2m0.0\x1b[0m" in text) == (" 0.0" in f" {expected}".replace("\n", " "))  # zeros are dim
    exact = seen(folder, *arguments, *(("--precision", "full") if arguments[0] != "calc" else ()), NO_COLOR="1")
    piped = subprocess.run([sys.executable, "-m", "frametool", *arguments, "-f", "text"], cwd=folder, capture_output=True, text=True, check=True, env=os.environ | {"PYTHONPATH": str(ROOT)}).stdout
    if arguments[-1] == "matrix":
        assert "0.866025403784 " in seen(folder, *arguments, "--precision", "12", NO_COLOR="1")
    longest = [max(map(len, re.findall(r"\d+\.\d+", each))) for each in (exact, piped)]
    assert all(each > 12 for each in longest[arguments[0] == "calc" :])


def test_several_poses_and_uncertain_ones_are_brief_on_a_terminal(folder: Path) -> None:
    calls = (("mean", "examples/tag_seen.csv"), ("lookup", "examples/drive.yaml", "map", "base_link", "--times", "0,1", "-f", "text"), ("compose", "{xyz: [1, 2, 3], sigma: {xyz: 0.1, rpy_deg: 1}}", "{rpy_deg: [0, 0, 90]}"))
    for each in calls:
        text = seen(folder, *each, NO_COLOR="1")
        assert "quaternion" in text
        assert "rpy" in text
        assert "axis-angle" not in text
        assert "matrix" in seen(folder, *each, "--to", "matrix", NO_COLOR="1")
    assert "sigma   " in seen(folder, *calls[-1], NO_COLOR="1")


def test_sigmas_of_a_drawing_stand_in_a_column_or_below(folder: Path) -> None:
    entries = "{frames: [{name: a, parent: m, xyz: [1, 2, 3], sigma: {xyz: 0.1, rpy_deg: 1}}, {name: NAME, parent: m, rpy_deg: [30, 0.1, 2], sigma: {xyz: 0.1, rpy_deg: 1}}]}"
    lines = seen(folder, "tree", entries, NO_COLOR="1").splitlines()
    assert lines[1].index("\u00b1") == lines[2].index("\u00b1")
    wide = seen(folder, "tree", entries.replace("NAME", "n" * 40), NO_COLOR="1").splitlines()
    assert wide[2:] == ["│   \u00b1100 mm 1.0 deg", f"└ {'n' * 40}  xyz 0 0 0  rpy_deg 30 0.1 2", "    \u00b1100 mm 1.0 deg"]
    assert [line for line in wide if line != line.rstrip()] == []


def test_check_says_that_it_found_nothing_on_a_terminal_alone(folder: Path) -> None:
    assert re.fullmatch(r"frametool: examples/robot\.yaml: no findings \(\d+ rules\)\n", seen(folder, "check", "examples/robot.yaml"))
    piped = subprocess.run([sys.executable, "-m", "frametool", "check", "examples/robot.yaml"], cwd=folder, capture_output=True, check=True, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert (piped.stdout, piped.stderr) == (b"", b"")


def test_help_has_styles_on_a_terminal_and_its_width(folder: Path) -> None:
    text = seen(folder, "--help", COLUMNS="140")
    assert text.startswith("\x1b[1mUsage:\x1b[0m frametool")
    assert "\x1b[1mPoses:\x1b[0m\n  \x1b[36mconvert\x1b[0m  " in text
    assert "\x1b[32mframetool lookup robot.yaml map camera_optical\x1b[0m\n" in text
    assert 80 < max(map(len, CODES.sub("", text).splitlines())) <= 100
    assert re.findall(r"(?m)^(\w+):$", CODES.sub("", text)) == ["Options", "Poses", "Trees", "Rows", "Trajectories", "Recordings", "Help", "Turtles"]
    assert "  \x1b[36m-o\x1b[0m, \x1b[36m--output\x1b[0m FILE" in seen(folder, "lookup", "--help-all", PAGER="", LINES="999")
    for environment in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
        assert "\x1b" not in seen(folder, "--help", **environment)
    piped = subprocess.run([sys.executable, "-m", "frametool", "--help"], cwd=folder, capture_output=True, text=True, check=True, env={key: value for key, value in os.environ.items() if key != "COLUMNS"} | {"PYTHONPATH": str(ROOT)})
    assert max(map(len, piped.stdout.splitlines())) <= 80
    assert "\x1b" not in piped.stdout


@pytest.mark.parametrize("words", [("help", "pose"), ("formats",), ("help", "cookbook"), ("help", "lookup"), ("lookup", "--help-all")], ids=" ".join)
def test_what_is_longer_than_the_screen_goes_through_the_pager(folder: Path, words: tuple[str, ...]) -> None:
    paged = seen(folder, *words, PAGER="sed 's/^/|/'")
    assert all(line.startswith("|") for line in paged.splitlines())
    whole = seen(folder, *words, LINES="999", NO_COLOR="1", PAGER="sed 's/^/|/'")
    assert paged.replace("|", "", 1).replace("\n|", "\n") == whole
    piped = subprocess.run([sys.executable, "-m", "frametool", *words], cwd=folder, capture_output=True, text=True, check=True, env=os.environ | {"PYTHONPATH": str(ROOT), "PAGER": "sed 's/^/|/'"})
    assert "\n|" not in piped.stdout
