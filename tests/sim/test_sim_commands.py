"""`frametool sim` from outside: streams, pipes, files, interrupts, pictures."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import xml.etree.ElementTree as ET
from importlib.util import find_spec
from typing import TYPE_CHECKING

import console
import pytest
import yaml

from frametool.cli.commands.sim import SUBCOMMANDS, sim_command

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

SVG = "{http://www.w3.org/2000/svg}"
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
SCENE = "turtles:\n  turtle1: {leader: square}\n  turtle2: {spawn: [4, 2], follow: turtle1}\nduration: 1\n"
HELP_EXAMPLES = [
    line.strip()
    for each in sim_command.commands.values()
    for line in (each.help or "").splitlines()
    if line.strip().startswith("frametool ") and "teleop" not in line
]


def test_the_default_run_is_the_tutorial(run: Run) -> None:
    outcome = run("sim", "follow")
    documents = [each for each in yaml.load_all(outcome.out, yaml.CSafeLoader) if each]
    assert (outcome.status, len(documents)) == (0, 201)
    assert documents[0]["linear"]["x"] == pytest.approx(1.933158, abs=1e-6)
    assert documents[0]["angular"] == {"x": 0.0, "y": 0.0, "z": pytest.approx(4.639467, abs=1e-6)}
    assert "final distance to turtle1 0.0001 m; within 0.5 m after 4.064 s" in outcome.err


def test_numbers_have_the_decimals_that_are_asked_for(run: Run) -> None:
    outcome = run("sim", "follow", "--duration", "0.1", "--precision", "2", "-f", "csv")
    assert outcome.status == 0
    assert outcome.out.splitlines()[1].startswith("0.00,turtle2,1.93,4.64,3.87,")


def test_an_up_key_from_standard_input_moves_the_leader(run: Run) -> None:
    outcome = run("sim", "follow", "--leader", "-", "--emit", "poses", "-f", "csv", "--duration", "2", stdin="up\n")
    rows = [line.split(",") for line in outcome.out.splitlines() if ",turtle1," in line]
    assert float(rows[-1][2]) == pytest.approx(7.560444, abs=1e-6)
    assert sum(float(row[5]) > 0.0 for row in rows) == 63


def test_transforms_go_through_lookup_and_apply(run: Run) -> None:
    stream = run("sim", "follow", "--spawn", "1,1,0", "--duration", "1", "--emit", "tf").out
    found = yaml.safe_load(run("lookup", "-", "turtle2", "turtle1", "--at", "0", stdin=stream).out)
    assert found["xyz"] == pytest.approx([4.544445, 4.544445, 0.0], abs=1e-6)
    pose = run("lookup", "-", "world", "turtle2", "--at", "0", "-f", "json", stdin=stream).out
    moved = json.loads(run("apply", "--transform", pose.strip(), "-f", "json", "0", "2", "0").out)
    assert moved["point"] == [1.0, 3.0, 0.0]


def test_walls_are_told_of_once_a_contact_and_counted_every_tick(run: Run) -> None:
    keys = "t,linear,angular\n" + "".join(f"{t},2,0\n" for t in (0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5))
    outcome = run("sim", "follow", "--followers", "0", "--leader", "k.csv", "--duration", "4", files={"k.csv": keys})
    assert outcome.err.count("Oh no! I hit the wall!") == 1
    assert outcome.err.endswith("4 s simulated; wall hits: 77 (turtle1 77)\n")


def test_a_scene_is_run_with_its_duration_or_another(run: Run) -> None:
    lengths = []
    for more in ((), ("--duration", "0.5")):
        outcome = run("sim", "run", "s.yaml", "-f", "csv", *more, files={"s.yaml": SCENE})
        lengths.append(len(outcome.out.splitlines()))
    assert lengths == [12, 7]
    assert run("sim", "run", "-", "-f", "csv", stdin=SCENE).out.count("\n") == 12


def test_the_example_scene_has_three_turtles_that_come_together(run: Run) -> None:
    outcome = run("sim", "run", str(console.ROOT / "examples" / "turtles.yaml"), "-f", "csv")
    assert outcome.status == 0
    assert len(re.findall(r"within 0.5 m after [\d.]+ s", outcome.err)) == 2


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (("follow", "--leader", "circel"), 2, "did you mean 'circle'? leaders: "),
        (("follow", "--leader", "missing.csv"), 5, "missing.csv: no such file"),
        (("follow", "--spawn", "1"), 2, "expected [x, y, theta]"),
        (("follow", "--rate", "0"), 2, "a rate of 0 Hz has no steps"),
        (("follow", "--gain-linear", "nan"), 2, "is not finite"),
        (("follow", "--duration", "-1"), 2, "duration must be 0 .. "),
        (("follow", "--reach", "-1"), 2, "--reach must be 0 or more"),
        (("follow", "--live"), 2, "--live draws in a terminal"),
        (("follow", "--plot", "a.gif"), 2, "invalid value for '--plot': 'a.gif' does not end in .svg or .html or .png"),
        (("follow", "--view", "a.svg"), 2, "'a.svg' does not end in .html"),
        (("follow", "--view", "a.html", "--plot", "a.html"), 2, "the same file: --output, --plot or --view"),
        (("follow", "--plot", "taken.svg"), 5, "taken.svg: exists; give --force"),
        (("follow", "-o", "taken.svg"), 5, "taken.svg: exists; give --force"),
        (("follow", "--plot", "nowhere/f.svg"), 5, "nowhere/f.svg: no directory nowhere"),
        (("follow", "--holonomic"), 2, "--holonomic has no effect here"),
        (("follow", "--followers", "0", "--spawn", "1,1,0", "--rate", "5"), 2, "--spawn, --rate have no effect here"),
        (("follow", "--gain-linear", "1e308"), 1, "turtle2: a velocity must be finite"),
        (("folow",), 2, "did you mean 'follow'?"),
        (("run", "bad.yaml"), 1, "bad.yaml:1:23: "),
        (("run", "{turtles: {a: {folow: b}}}"), 2, "unknown key 'folow'"),
        (("teleop",), 2, "standard input is no terminal"),
    ],
)
def test_what_cannot_be_is_one_line_on_stderr(run: Run, arguments: tuple[str, ...], status: int, message: str) -> None:
    files = {"taken.svg": "kept", "bad.yaml": "turtles: {a: {leader: {}}}\n"}
    outcome = run("sim", *arguments, files=files)
    assert (outcome.status, outcome.out) == (status, "")
    assert outcome.err.startswith("frametool: ")
    assert message in outcome.err.splitlines()[0]


@pytest.mark.parametrize(
    ("event", "said"),
    [
        ("{t: 0.5, kill: turtle1}", "turtle2: not in the world together with turtle1; never within 0.5 m"),
        ("{t: 0.5, kill: turtle2}", "turtle2: not in the world together with turtle1; never within 0.5 m"),
        ("{t: 0.5, reset: }", "turtle2: not in the world together with turtle1; never within 0.5 m"),
        ("{t: 3, clear: }", "warning: s.yaml, event 1 (clear) never happens, the run ends at 1 s"),
    ],
)
def test_the_summary_tells_that_one_left_and_a_warning_what_never_happens(run: Run, event: str, said: str) -> None:
    outcome = run("sim", "run", "s.yaml", files={"s.yaml": f"{SCENE}events: [{event}]\n"})
    assert f"frametool: {said}\n" in outcome.err


def test_teleop_says_that_it_is_endless_and_follow_that_it_is_not(run: Run) -> None:
    defaults = [re.findall(r"or inf\s+\[default:\s+(\w+)", run("sim", name, "--help").out) for name in ("teleop", "follow")]
    assert defaults == [["inf"], ["20"]]


def test_files_are_written_whole_in_the_form_of_their_suffix(run: Run, tmp_path: Path) -> None:
    run("sim", "follow", "--duration", "0.2", "-o", "out.csv", "--plot", "out.html")
    assert (tmp_path / "out.csv").read_text().startswith("t,turtle,linear_x,")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.csv", "out.html"]
    run("sim", "follow", "--leader", "torn.csv", "-o", "new.csv", files={"torn.csv": "t,linear,angular\nx,1,1\n"})
    assert not (tmp_path / "new.csv").exists()


def test_a_plot_shows_the_world_the_trails_and_three_curves(run: Run, tmp_path: Path) -> None:
    run("sim", "follow", "--leader", "square", "--followers", "2", "--duration", "3", "--plot", "run.svg", "-f", "csv")
    root = ET.fromstring((tmp_path / "run.svg").read_text())  # noqa: S314 - our own
    lines = root.findall(f".//{SVG}path/{SVG}title")  # a line of a turtle says whose it is
    words = [text.text for text in root.iter(f"{SVG}text")]
    assert len(lines) == 3 + 3 * 2
    assert {"distance (m)", "linear.x (m/s)", "angular.z (rad/s)", "turtle1", "turtle3"} <= set(words)
    assert root.find(f".//{SVG}rect[@fill='#4556ff']") is not None


@pytest.mark.parametrize("arguments", [("follow", "--target", "carrot"), ("run", "s.yaml")])
def test_a_run_can_be_looked_at_as_frames_over_time(run: Run, tmp_path: Path, arguments: tuple[str, ...]) -> None:
    outcome = run("sim", *arguments, "--duration", "1", "--view", "run.html", "-f", "csv", files={"s.yaml": SCENE})
    assert outcome.status == 0
    text = (tmp_path / "run.html").read_text()
    head = json.loads(re.search('id="head-data">([^<]*)<', text)[1])  # type: ignore[index]
    assert head["names"][0] == "world"
    assert {"turtle1", "turtle2"} < set(head["names"])
    assert ("carrot1" in head["names"]) == ("carrot" in arguments)
    assert [track["count"] for track in head["tracks"]][:2] == [63, 63]


def test_a_png_needs_matplotlib_and_says_so(run: Run, tmp_path: Path) -> None:
    outcome = run("sim", "follow", "--duration", "1", "--plot", "run.png")
    if find_spec("matplotlib"):
        assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    else:
        assert outcome.status == 5
        assert "pip install 'frametool[plot]'" in outcome.err


@pytest.mark.parametrize("example", HELP_EXAMPLES)
def test_an_example_in_a_subcommands_help_runs(example: str, tmp_path: Path) -> None:
    (tmp_path / "turtles.yaml").write_text(SCENE)
    arguments = example.split()[1:]
    done = subprocess.run(
        [*TOOL, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(console.ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_every_subcommand_has_help_with_exit_codes(run: Run, name: str) -> None:
    outcome = run("sim", name, "--help")
    assert outcome.out.index(f"    frametool sim {name}") < outcome.out.index("Options:")
    assert "Exit codes: 0 done" in outcome.out


@pytest.mark.parametrize("arguments", [["follow"], ["run", "{turtles: {turtle1: }}"]])
def test_a_run_loads_no_numpy_and_no_rich(arguments: list[str]) -> None:
    code = f"import sys; from frametool.cli import run; run({['sim', *arguments]!r}); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=console.ROOT)
    assert not {"numpy", "rich", "dataclasses"} & set(done.stderr.split())


def test_a_closed_pipe_ends_an_endless_run_quietly() -> None:
    tool = subprocess.Popen(
        [*TOOL, "sim", "follow", "--duration", "inf", "-f", "csv"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=console.ROOT,
    )  # fmt: skip
    assert tool.stdout is not None
    assert tool.stderr is not None
    with tool:
        assert tool.stdout.readline().startswith("t,turtle")
        tool.stdout.close()
        assert (tool.wait(), tool.stderr.read()) == (-signal.SIGPIPE, "")


def test_an_interrupt_prints_the_summary_and_exits_130() -> None:
    tool = subprocess.Popen(
        [*TOOL, "sim", "follow", "--duration", "inf", "--realtime", "-f", "csv"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=console.ROOT,
    )  # fmt: skip
    assert tool.stdout is not None
    with tool:
        for _ in range(3):
            tool.stdout.readline()
        tool.send_signal(signal.SIGINT)
        _, err = tool.communicate()
    assert tool.returncode == 130
    assert "final distance to turtle1" in err
    assert "Traceback" not in err
    assert "\n\n" not in err


def _open_stdin(*arguments: str) -> subprocess.Popen[str]:
    """Start a leader from a standard input that stays open."""
    return subprocess.Popen(
        [*TOOL, "sim", "follow", "--leader", "-", "--emit", "poses", "-f", "csv", *arguments],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=console.ROOT,
    )  # fmt: skip


def test_in_real_time_one_key_is_enough_and_an_open_stdin_does_not_hold_the_end_up() -> None:
    with _open_stdin("--realtime", "--duration", "0.4") as tool:
        assert tool.stdin is not None
        assert tool.stdout is not None
        assert tool.stderr is not None
        tool.stdin.write("up\n")
        tool.stdin.flush()
        assert tool.wait() == 0
        assert tool.stdout.read().count(",turtle1,") == 25
        assert tool.stderr.read().endswith("0.4 s simulated; wall hits: 0\n")


@pytest.mark.parametrize("more", [(), ("--realtime",)])
def test_an_interrupt_ends_a_run_that_waits_for_keys(more: tuple[str, ...]) -> None:
    with _open_stdin("--duration", "inf", *more) as tool:
        assert tool.stdin is not None
        assert tool.stdout is not None
        assert tool.stderr is not None
        tool.stdin.write("up\nup\n")
        tool.stdin.flush()
        tool.stdout.readline()
        tool.send_signal(signal.SIGINT)
        assert tool.wait() == 130
        assert "simulated; wall hits: 0\n" in tool.stderr.read()


def test_keys_drive_the_turtle_in_a_terminal_and_commands_go_to_stdout() -> None:
    ours, theirs = pty.openpty()
    tool = subprocess.Popen(
        [*TOOL, "sim", "teleop", "-f", "json"], stdin=theirs, stderr=theirs, stdout=subprocess.PIPE, text=True,
        cwd=console.ROOT, env={**os.environ, "TERM": "xterm", "COLUMNS": "80", "LINES": "24"},
    )  # fmt: skip
    os.close(theirs)
    assert tool.stdout is not None
    with tool:
        first = json.loads(tool.stdout.readline())
        os.write(ours, b"\x1b[A")
        # when the key comes through is the machine's affair
        lines = (json.loads(tool.stdout.readline()) for _ in range(100))
        has_moved = any(each["turtle"] == "turtle1" and each["linear"]["x"] == 2.0 for each in lines)
        os.write(ours, b"q")
        drawn = b""
        while chunk := _read(ours):
            drawn += chunk
        assert tool.wait() == 0
    os.close(ours)
    assert first["turtle"] == "turtle2"
    assert has_moved
    assert "→" in drawn.decode()
    assert b"\x1b[?25h" in drawn  # the cursor is back


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("name", [("follow", "--live", "--duration", "inf"), ("teleop",)])
def test_a_signal_gives_the_terminal_back_with_its_cursor_and_leaves_no_file(
    number: signal.Signals, name: tuple[str, ...], tmp_path: Path,
) -> None:  # fmt: skip
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    tool = subprocess.Popen(
        [*TOOL, "sim", *name, "-o", "run.csv"], stdin=theirs, stderr=theirs, stdout=theirs, cwd=tmp_path,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "80", "LINES": "24", "PYTHONPATH": str(console.ROOT)},
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),  # noqa: PLW1509 - ignored under nohup
    )  # fmt: skip
    drawn = b""
    while "→" not in drawn.decode(errors="replace"):
        drawn += os.read(ours, 1 << 16)
    tool.send_signal(number)
    while tool.poll() is None:
        if select.select([ours], [], [], 0.05)[0]:
            drawn += os.read(ours, 1 << 16)
    assert termios.tcgetattr(theirs) == before
    os.close(theirs)
    while chunk := _read(ours):
        drawn += chunk
    os.close(ours)
    assert drawn.rindex(b"\x1b[?25h") > drawn.rindex(b"\x1b[?25l")
    assert tool.returncode == (130 if number == signal.SIGINT else -number)
    assert b"Traceback" not in drawn
    assert list(tmp_path.iterdir()) == []


def _read(terminal: int) -> bytes:
    """Read what a terminal got; nothing once the other side is closed."""
    try:
        return os.read(terminal, 1 << 16)
    except OSError:
        return b""
