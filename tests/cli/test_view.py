"""`frametool view` from outside: forms by suffix, what is chosen, what is refused."""

from __future__ import annotations

import json
import os
import re
import struct
import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import console
import pytest
from shell import TOOL

import frametool

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

ROBOT = str(console.ROOT / "examples" / "robot.yaml")
DRIVE = str(console.ROOT / "examples" / "drive.yaml")
BEGINS = {"html": b"<!DOCTYPE html>", "svg": b"<svg ", "glb": b"glTF", "txt": b""}


@pytest.mark.parametrize("suffix", BEGINS)
def test_the_form_follows_the_suffix(run: Run, tmp_path: Path, suffix: str) -> None:
    outcome = run("view", DRIVE, "-o", f"x.{suffix}")
    assert (outcome.status, outcome.out) == (0, "")
    assert (tmp_path / f"x.{suffix}").read_bytes().startswith(BEGINS[suffix])


@pytest.mark.parametrize("form", ["html", "svg", "text"])
def test_a_form_can_be_told_and_goes_to_standard_output(run: Run, form: str) -> None:
    outcome = run("view", DRIVE, "-f", form, "-o", "-")
    assert outcome.status == 0
    assert outcome.out.encode().startswith(BEGINS.get(form, b""))
    assert "\x1b" not in outcome.out


def test_a_png_is_written_or_says_what_to_install(run: Run, tmp_path: Path) -> None:
    outcome = run("view", DRIVE, "-o", "x.png")
    if find_spec("matplotlib"):
        assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    else:
        assert (outcome.status, outcome.err) == (5, "frametool: a PNG needs matplotlib: pip install 'frametool[plot]', or write .svg, which needs nothing\n")


def test_target_source_frame_and_time_begin_the_page(run: Run) -> None:
    out = run("view", DRIVE, "map", "box", "--frame", "base_link", "--at", "2.5", "--from", "30,45", "-f", "html").out
    head = json.loads(re.search('id="head-data">([^<]*)<', out)[1])  # type: ignore[index]
    assert {key: head["show"][key] for key in ("target", "source", "fixed", "t")} == {
        "target": "map", "source": "box", "fixed": "base_link", "t": "2.500000000",
    }  # fmt: skip
    assert head["show"]["view"] == pytest.approx([0.5235987755982988, 0.7853981633974483])
    assert head["file"] == DRIVE


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("--below", "wrist_link"), {"wrist_link", "tool", "camera_link", "camera_optical"}),
        (("--only", "^wheel"), {"wheel_left_link", "wheel_right_link"}),
        (("--below", "base_link", "--only", "link$", "--from", "top"), {"base_link", "imu_link", "wheel_left_link", "wheel_right_link", "arm_base_link", "shoulder_link", "upper_arm_link", "forearm_link", "wrist_link", "camera_link"}),
        (("lidar", "imu_link", "--path"), {"lidar", "base_link", "imu_link"}),
    ],
)
def test_what_is_drawn_can_be_chosen(run: Run, arguments: tuple[str, ...], names: set[str]) -> None:
    positional = [each for each in arguments if each in ("lidar", "imu_link")]
    options = arguments[len(positional) :]
    out = run("view", ROBOT, *positional, *options, "-f", "svg").out
    assert set(re.findall("<circle[^>]*><title>([^<]*)</title>", out)) == names


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (("nope", "tool"), 4, "unknown frame 'nope'"),
        (("--below", "nope"), 4, "unknown frame 'nope'"),
        (("--only", "("), 1, "'(' is not a regular expression"),
        (("--only", "zzz"), 1, "nothing matches"),
        (("--path",), 2, "name both"),
        (("--from", "above"), 2, "expected slanted, front, side, top or AZ,EL in degrees, found 'above'"),
        (("--from", "0,100"), 2, "the elevation must be -90 .. 90 degrees"),
        (("--from", "x,1"), 2, "'x' is not a number"),
        (("-o", "x.gif"), 2, "no format has the suffix '.gif'"),
        (("-o", "taken.svg"), 5, "taken.svg: exists; give --force"),
        (("--overlay",), 2, "--overlay takes two trees"),
        ((ROBOT, "map", "--overlay"), 2, "--overlay takes two trees"),
        (("{frames: {a: }}", "--overlay", "-f", "svg"), 4, "unknown frame 'map'"),
        (("--open", "-f", "svg"), 2, "--open shows a page"),
        (("--open", "-o", "-"), 2, "--open shows a page"),
    ],
)
def test_what_cannot_be_is_one_line_on_stderr(run: Run, arguments: tuple[str, ...], status: int, message: str) -> None:
    outcome = run("view", ROBOT, *arguments, files={"taken.svg": "kept"})
    assert (outcome.status, outcome.out) == (status, "")
    assert outcome.err.startswith("frametool: ")
    assert message in outcome.err.splitlines()[0]


@pytest.mark.parametrize("form", ["html", "svg"])
def test_two_trees_are_laid_over_one_another(run: Run, form: str) -> None:
    before = Path(ROBOT).read_text().replace("xyz: [0.285, 0, 0.310]", "xyz: [0.285, 0, 0.322]")
    outcome = run("view", ROBOT, "before.yaml", "--overlay", "--below", "base_link", "-f", form, files={"before.yaml": before})
    assert (outcome.status, outcome.err) == (0, "")
    if form == "svg":
        assert outcome.out.count('opacity="0.4"') == 3 * 13
    else:
        head = json.loads(re.search('id="head-data">([^<]*)<', outcome.out)[1])  # type: ignore[index]
        assert head["overlay"]["title"] == "before.yaml"
        assert len(head["overlay"]["poses"]) == 17


def test_an_empty_tree_and_a_missing_file_are_told(run: Run) -> None:
    assert run("view", "{frames: {}}").status == 1
    assert run("view", "missing.yaml").status == 5


def test_a_crowded_picture_says_how_to_see_a_part(run: Run) -> None:
    assert "frames lie in a small spot; --below FRAME shows a part" in run("view", ROBOT, "-f", "svg").err
    assert run("view", ROBOT, "--below", "base_link", "-f", "svg").err == ""


def shown_in_a_terminal(*arguments: str, size: tuple[int, int] = (60, 20), command: str = "view", **environment: str) -> bytes:
    """Return what a command writes to a terminal of so many columns and lines."""
    pty, fcntl, termios = (pytest.importorskip(name) for name in ("pty", "fcntl", "termios"))
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", *size[::-1], 0, 0))
    inherited = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "COLUMNS", "LINES")}
    environment = inherited | {"TERM": "xterm-256color", "PYTHONPATH": str(console.ROOT)} | environment
    tool = subprocess.Popen([*TOOL, command, *arguments], stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    drawn = b""
    while True:
        try:
            drawn += os.read(ours, 1 << 16)
        except OSError:
            break
    assert tool.wait(20) == 0
    os.close(ours)
    return drawn


@pytest.mark.parametrize("no_color", [False, True])
def test_a_terminal_gets_a_picture_of_its_own_size_in_colour(no_color: bool) -> None:  # noqa: FBT001
    environment: dict[str, Any] = {"NO_COLOR": "1"} if no_color else {}
    drawn = shown_in_a_terminal(ROBOT, **environment)
    lines = re.sub(r"\x1b\[[\d;]*m", "", drawn.decode()).split("\r\n")
    assert len(lines) == 19 + 1
    assert max(map(len, lines)) <= 60
    assert (b"\x1b[31m" in drawn) != no_color


@pytest.mark.parametrize("command", ["view", "tree"])
@pytest.mark.parametrize("plain", ["NO_COLOR", "TERM", "--color=never"])
def test_where_no_colour_is_wanted_nothing_is_bold_or_dim_either(command: str, plain: str) -> None:
    environment: dict[str, Any] = {plain: "dumb"} if plain.isupper() else {}
    drawn = shown_in_a_terminal(ROBOT, *[plain] * (not environment), command=command, **environment)
    assert b"base_link" in drawn
    assert b"\x1b" not in drawn


def test_a_large_terminal_names_every_frame_whole() -> None:
    drawn = shown_in_a_terminal(ROBOT, size=(200, 60), NO_COLOR="1").decode()
    assert [name for name in frametool.load(ROBOT).frames if not re.search(rf"(?<!\w){name}(?!\w)", drawn)] == []
    assert "+" not in drawn
    assert "hidden" not in drawn


def test_the_page_is_opened_in_the_browser(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    outcome = run("view", ROBOT, "--open")
    assert outcome.status == 0
    (url,) = opened
    assert Path(url.removeprefix("file://")).read_text().startswith("<!DOCTYPE html>")
    assert outcome.err == f"frametool: the page is {url.removeprefix('file://')}\n"


def test_a_recording_from_standard_input_is_shown(run: Run) -> None:
    stream = run("sim", "follow", "--duration", "1", "--emit", "tf").out
    out = run("view", "-", "-f", "html", stdin=stream).out
    assert json.loads(re.search('id="head-data">([^<]*)<', out)[1])["names"] == ["world", "turtle1", "turtle2"]  # type: ignore[index]
