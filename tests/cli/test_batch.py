"""`batch`: every line prints what it prints alone, results are kept with all their digits, errors name their line."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import time
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

import pytest
import shell

from frametool.documents import source
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

EXAMPLES = Path(__file__).parents[2] / "examples"
FRAMES = ["map", "odom", "base_link", "lidar", "camera_optical", "tool", "nowhere"]
REPRESENTATIONS = ["rpy", "rpy_deg", "euler:rzyx", "euler_deg:sxyz", "rotvec", "xyzw", "axis_angle_deg", "matrix", "rpy_degg"]
ENDINGS = ["", "", "", "-f json", "-f yaml", "-f text", "-f csv", "--precision 3", "--keep-sign -f json", "-f ros2", "--deg", "-f=json"]
POSES = [
    "'{{xyz: [{}, {}, {}], rpy_deg: [{}, {}, {}]}}'", "'{{\"xyz\": [{}, {}, {}], \"rpy\": [{}, {}, {}]}}'", "'{{rotvec: [{}, {}, {}]}}'",
    "'{{name: tool, parent: base, xyz: [{}, {}, {}], note: kept}}'", "'{{xyz: [{}, {}, {}], wxyz: [{}, {}, {}, 1]}}'",
    "'[[1, 0, 0], [0, 1, 0], [0, 0, 1]]'", "'{{xyz: [{}, {}]}}'", "'- Translation: [{}, {}, {}]'", "nofile.yaml", "camchain.yaml",
]  # fmt: skip
SHAPES: list[Callable[[Random], str]] = [
    lambda r: f"convert --from {r.choice(REPRESENTATIONS)} {numbers(r, r.choice((3, 3, 3, 4, 6, 7)))} --to {r.choice(REPRESENTATIONS)}",
    lambda r: f"convert {pose(r)} --to {r.choice(REPRESENTATIONS)},rpy",
    lambda r: f"convert --axes {r.choice(('optical', 'frd_from_flu', 'opticall'))}",
    lambda r: f"convert --from rpy {numbers(r, 3)} --find 1,0,0 --tolerance {r.choice(('9', 'x'))}",
    lambda r: f"compose {' '.join(pose(r) for _ in range(r.randrange(4)))}",
    lambda r: f"compose --from rpy '{numbers(r, 3)}' inv '{numbers(r, 3)}'",
    lambda r: f"invert {pose(r)}",
    lambda r: f"invert -i walk.tum {r.choice(('', '--to rpy_deg'))}",
    lambda r: f"relative {pose(r)} {pose(r)}",
    lambda r: f"interpolate {pose(r)} {pose(r)} {numbers(r, 2)}",
    lambda r: f"between '[{number(r)}, 0, 1]' '[0, {number(r)}, 0]'",
    lambda r: f"lookup robot.yaml {r.choice(FRAMES)} {r.choice(FRAMES)}",
    lambda r: f"lookup drive.yaml map base_link --at {abs(float(number(r))):g}",
    lambda r: f"lookup drive.yaml map base_link --times 0:{r.randrange(9)}:1 --on-error skip",
    lambda r: f"lookup arm.urdf arm_base tool -j elbow={number(r)}",
    lambda r: f"apply robot.yaml {r.choice(FRAMES)} {r.choice(FRAMES)} {numbers(r, 3)}",
    lambda r: f"apply --transform {pose(r)} -i cloud.csv",
    lambda r: f"apply robot.yaml {r.choice(FRAMES)} -i hits.jsonl",
    lambda r: f"tree {r.choice(('robot.yaml', 'arm.urdf', 'lift.sdf', 'camchain.yaml', 'drive.yaml'))}",
    lambda r: f"calc --tree robot.yaml 'inv(map<-base_link) * (map<-{r.choice(FRAMES)})'",
    lambda r: f"calc x={number(r)} 'x * 2' \"sqrt(x)\"",
    lambda r: f"mean -i walk.tum {r.choice(('', '--to rpy'))}",
    lambda r: r.choice(("check robot.yaml", "diff robot.yaml robot.yaml", "diff robot.yaml arm.urdf", "formats", "--version", "help pose")),
    lambda r: r.choice(("fk arm.urdf arm_base tool -i joints.csv", "monitor drive.yaml", "echo drive.yaml map base_link", "view robot.yaml")),
    lambda r: r.choice(("sim follow --duration 1", "static robot.yaml", "nope", "convert --help", "compose --nope", "sim", "lookup")),
]  # fmt: skip


def number(random: Random) -> str:
    return random.choice([f"{random.uniform(-3.0, 3.0):.17g}", f"{random.randrange(-5, 6)}", "-1e-3", "-.5", "1e400", "90deg", "x"][:5])


def numbers(random: Random, count: int) -> str:
    return " ".join(number(random) for _ in range(count))


def pose(random: Random) -> str:
    return random.choice(POSES).format(*(number(random) for _ in range(7)))


def some_line(random: Random) -> str:
    return f"{random.choice(SHAPES)(random)} {random.choice(ENDINGS)}".strip()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for file in EXAMPLES.iterdir():
        if file.is_file():
            shutil.copy(file, tmp_path)
    return tmp_path


@pytest.mark.usefixtures("folder")
def test_a_batch_prints_what_its_lines_print_alone(run: Run) -> None:
    random = Random(15)  # noqa: S311 - a test's
    lines = [some_line(random) for _ in range(250)]
    alone = [run(*shlex.split(line)) for line in lines]
    batch = run("batch", "lines.txt", "--on-error", "skip", files={"lines.txt": "".join(f"{line}\n" for line in lines)})
    assert batch.out.splitlines(keepends=True) == "".join(each.out for each in alone).splitlines(keepends=True)
    assert batch.status == 3
    failed = {number for number, each in enumerate(alone, 1) if each.status not in (0, 3)}
    reported = re.findall(r"lines\.txt:(\d+): (.*) \(line skipped\)", batch.err)
    assert {int(number) for number, _ in reported} == failed
    assert batch.err.splitlines()[-1] == f"frametool: lines.txt: {len(failed)} of {len(lines)} lines skipped"
    assert all(message in alone[int(number) - 1].err or " ended with status 1" in message for number, message in reported)


def test_a_batch_prints_what_processes_print(folder: Path) -> None:
    lines = [
        "convert --from rpy_deg 0 0 90", "lookup robot.yaml map lidar -f json", "apply --transform '{xyz: [1, 0, 0]}' -i cloud.csv",
        "lookup robot.yaml map lidr",
    ]  # fmt: skip
    alone = [shell.run(*shlex.split(line), cwd=folder) for line in lines]
    status, out, err = shell.run("batch", "--on-error", "skip", text="\n".join(lines).encode(), cwd=folder)
    assert (status, out) == (3, b"".join(each[1] for each in alone))
    assert err.splitlines()[0] == alone[3][2].rstrip().replace(b"frametool: ", b"frametool: stdin:4: ", 1) + b" (line skipped)"


def test_a_kept_result_stands_for_a_pose_a_point_a_number_and_a_tree(run: Run, folder: Path) -> None:
    lines = r"""
        base = lookup robot.yaml map base_link   # a comment
        compose $base '{xyz: [0, 0, 1]}' -f json
        T=tree robot.yaml
        lookup $T map lidar -f json
        p = apply robot.yaml map lidar 1 2 3
        apply robot.yaml lidar map ${p} -f json
        n = calc '1 + 2'
        convert --from rpy_deg 0 0 $n --to rpy_deg -f json
        calc "inv($base) * $base" -f json
        compose "inv(${base})" $base -f json
    """
    done = run("batch", stdin=lines)
    assert (done.status, done.err) == (0, "")
    raised, lidar, point, turned, calculated, composed = map(json.loads, done.out.splitlines())
    tree = load(folder / "robot.yaml")
    assert tuple(raised["xyz"][:2]) == tree.lookup("map", "base_link").components[:2]
    assert tuple(lidar["xyz"]) + tuple(lidar["quaternion"].values()) == tree.lookup("map", "lidar").components
    assert point["point"] == pytest.approx([1, 2, 3], abs=1e-14)
    assert turned == {"rpy_deg": {"roll": 0.0, "pitch": 0.0, "yaw": pytest.approx(3.0, abs=1e-15)}}
    assert calculated["xyz"] == pytest.approx([0, 0, 0], abs=1e-15)
    assert composed["xyz"] == pytest.approx([0, 0, 0], abs=1e-15)


@pytest.mark.usefixtures("folder")
def test_a_kept_pose_has_all_its_bits(run: Run) -> None:
    lines = "p = lookup robot.yaml camera_optical tool\nconvert $p -f json\nlookup robot.yaml camera_optical tool -f json\n"
    kept, looked_up = run("batch", stdin=lines).out.splitlines()
    assert kept == looked_up


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("convert '1", "the ' in column 9 is not closed"),
        ('convert a "1', 'the " in column 11 is not closed'),
        ("lookup a b c | compose -", "| is for a shell: write one command a line, keep a result by NAME = COMMAND"),
        ("convert 1 > x.json", "> is for a shell: write one command a line"),
        ("convert $(pwd)", "$( names nothing"),
        ("convert $bsae", "unknown name $bsae; did you mean 'base'? names: base; a dollar sign is $$"),
        ("convert $HOME", "unknown name $HOME; names: base; a dollar sign is $$"),
        ("convert $1", "$1 names nothing"),
        ("batch more.txt", "a batch runs no batch"),
        ("frametool convert 1", "omit the word `frametool`"),
        ("convert -", "standard input is not for the lines of a batch"),
        ("calc", "standard input is not for the lines of a batch"),
        ("monitor -", "standard input is not for the lines of a batch"),
        ("sim follow --leader -", "standard input is not for the lines of a batch"),
        ("x = check robot.yaml", "x: check has no result that can be kept"),
        ("x = interpolate $base $base 0 1", "x: the command has 2 results; a name keeps one pose, point, number or tree"),
        ("x = convert $base -o x.yaml", "x: a result is kept, or written by -f, -o or --explain; leave these or x = out"),
        ("x = convert $base -f csv", "x: a result is kept, or written by -f, -o or --explain"),
        ("x =", "no command behind x ="),
        ("nope", "no command 'nope'"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_what_cannot_be_run_is_an_error_with_its_line(line: str, message: str, run: Run) -> None:
    done = run("batch", stdin=f"base = convert --from rpy 0 0 1\n\n{line}\nconvert --from rpy 0 0 2\n")
    assert done.out == ""
    assert done.status in (1, 2)
    assert done.err.startswith("frametool: stdin:3: ")
    assert message in done.err
    assert done.err.count("\n") == 1
    assert not Path("x.yaml").exists()


def test_a_name_whose_line_failed_has_no_older_value(run: Run) -> None:
    lines = "p = convert --from rpy 0 0 1\np = convert --from rpy 0 0 x\nconvert $p\n"
    done = run("batch", "--on-error", "skip", stdin=lines)
    assert (done.status, done.out) == (3, "")
    assert "stdin:3: $p has no value: line 2, which sets it, has failed (line skipped)" in done.err


@pytest.mark.parametrize(("line", "status"), [("convert --from rpy 0 0", 2), ("convert --from xyzw 0 0 0 0", 1), ("lookup robot.yaml a b", 4), ("tree no.yaml", 5)])
@pytest.mark.usefixtures("folder")
def test_a_batch_stops_with_the_status_of_the_line_that_failed(line: str, status: int, run: Run) -> None:
    done = run("batch", stdin=f"convert --from rpy 0 0 1\n{line}\nconvert --from rpy 0 0 2\n")
    assert done.status == status == run(*line.split()).status
    assert done.out == run("convert", "--from", "rpy", "0", "0", "1").out


@pytest.mark.usefixtures("folder")
def test_a_command_that_ends_with_a_status_of_its_own_fails(run: Run) -> None:
    lines = "diff robot.yaml arm.urdf\nconvert --from rpy 0 0 1\n"
    stopped, skipped = run("batch", stdin=lines), run("batch", "--on-error", "skip", stdin=lines)
    assert "frametool: stdin:1: diff ended with status 1\n" in stopped.err
    assert (stopped.status, skipped.status) == (1, 3)
    assert skipped.out == stopped.out + run("convert", "--from", "rpy", "0", "0", "1").out


@pytest.mark.usefixtures("folder")
def test_rows_that_a_line_skips_do_not_stop_the_batch(run: Run) -> None:
    rows = "x,y,z\n1,2,3\n1,x,3\n"
    line = "apply --transform '{xyz: [1, 0, 0]}' -i rows.csv --on-error skip"
    done = run("batch", stdin=f"{line}\nconvert --from rpy 0 0 1\n", files={"rows.csv": rows})
    assert done.status == 3
    assert done.out.startswith("x,y,z\n2.0,2.0,3.0\nquaternion:")
    assert done.err.startswith("frametool: stdin:1: rows.csv:3:y: 'x' is not a number (row skipped)\n")


@pytest.mark.usefixtures("folder")
def test_errors_of_a_line_in_json_are_objects_with_its_place(run: Run) -> None:
    lines = "lookup robot.yaml map lidr -f json\nconvert '{xyz: [1, 2]}' -f json\nconvert '{xyz: [1, 2]}'\n"
    done = run("batch", "--on-error", "skip", stdin=lines)
    unknown, broken, *_, last = done.err.splitlines()
    assert last == "frametool: stdin: 3 of 3 lines skipped"
    assert json.loads(run("batch", "--on-error", "skip", stdin=lines.partition("\n")[0]).err.splitlines()[-1])["bad"] == 1
    assert json.loads(unknown).items() >= {"error": "unknown_frame", "source": "stdin", "line": 1, "frame": "lidr"}.items()
    found: dict[str, Any] = json.loads(broken)
    assert found["message"].startswith("stdin:2: argument:1:")
    assert found.items() >= {"error": "format_error", "source": "stdin", "line": 2, "input": {"source": "argument", "line": 1, "column": 7}}.items()


def test_line_ends_marks_comments_and_joined_lines_are_as_in_a_shell(run: Run) -> None:
    expected = run("convert", "--from", "rpy", "0", "0", "1").out
    one = "convert --from rpy 0 0 1"
    texts = [
        one, f"\ufeff{one}\r\n", f"\n# no\n  {one}  # yes\n", "convert --from rpy \\\n0 0 \\\r\n1\n", "convert --from rpy 0 0 1 \\",
        "convert\t--from 'rpy' \"0\" 0 \\1\n", f"# no \\\n{one}\n", "x = convert --from \\\nrpy 0 0 1\nconvert $x",
    ]  # fmt: skip
    for text in texts:
        done = run("batch", stdin=text)
        assert (done.status, done.out, done.err) == (0, expected, ""), text


def test_bytes_that_are_no_text_are_part_of_their_line(run: Run) -> None:
    done = run("batch", "--on-error", "skip", stdin=b"convert --from rpy 0 0 1\nconvert \xff\nconvert --from rpy 0 0 1\n")
    assert (done.status, done.out.count("quaternion")) == (3, 2)
    assert "stdin:2: \\udcff: no such file" in done.err
    assert "UTF-16" in run("batch", stdin="convert 1".encode("utf-16")).err


def test_an_empty_batch_does_nothing(run: Run) -> None:
    assert run("batch", stdin="\n  # nothing\n\n") == (0, "", "")


def test_a_missing_batch_is_a_missing_file(run: Run) -> None:
    assert run("batch", "no.txt") == (5, "", "frametool: no.txt: no such file or directory\n")


@pytest.mark.usefixtures("folder")
def test_a_file_of_frames_is_read_once_until_it_changes(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from frametool.formats import load as loading

    read: list[str] = []
    before = loading.load_sources

    def counted(sources: Any, *rest: Any) -> Any:
        read.append(sources[0].name)
        return before(sources, *rest)

    monkeypatch.setattr(loading, "load_sources", counted)
    monkeypatch.setattr(source, "SETTLED_NS", 0)
    lines = [
        "tree robot.yaml -o own.yaml", "lookup own.yaml map lidar", "lookup own.yaml map tool", "lookup own.yaml map tool --normalize",
        "tree arm.urdf -o own.yaml --force", "lookup own.yaml arm_base tool", "lookup own.yaml map tool",
    ]  # fmt: skip
    done = run("batch", "--on-error", "skip", stdin="\n".join(lines))
    assert read == ["robot.yaml", "own.yaml", "own.yaml", "arm.urdf", "own.yaml"]
    assert done.err.count("unknown frame 'map' in own.yaml") == 1
    assert done.status == 3


def test_a_file_that_was_written_a_moment_ago_is_read_again(folder: Path) -> None:
    one, two = ((f"{{frames: {{a: {{b: {{xyz: [{x}, 0, 0]}}}}}}}}") for x in (1, 2))
    (folder / "now.yaml").write_text(one)
    with shell.start("batch", cwd=folder) as process:
        assert process.stdin
        assert process.stdout
        for text, x in ((one, b"[1.0,"), (two, b"[2.0,"), (one, b"[1.0,")):
            (folder / "now.yaml").write_text(text)
            process.stdin.write(b"lookup now.yaml a b -f json\n")
            process.stdin.flush()
            assert x in process.stdout.readline()
        process.stdin.close()
    assert process.returncode == 0


def test_each_line_of_a_pipe_is_answered_before_the_next_is_there(tmp_path: Path) -> None:
    with shell.start("batch", cwd=tmp_path) as process:
        assert process.stdin
        assert process.stdout
        for angle in ("0", "90"):
            process.stdin.write(f"convert --from rpy_deg 0 0 {angle} --to rpy_deg -f json\n".encode())
            process.stdin.flush()
            assert json.loads(process.stdout.readline())["rpy_deg"]["yaw"] == float(angle)
        process.stdin.close()
    assert process.returncode == 0


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, -signal.SIGTERM)])
def test_a_signal_ends_a_batch_without_a_traceback(number: int, status: int, tmp_path: Path) -> None:
    with shell.start("batch", cwd=tmp_path, preexec_fn=shell.by_default) as process:
        assert process.stdin
        assert process.stdout
        assert process.stderr
        process.stdin.write(b"convert --from rpy 0 0 1\n")
        process.stdin.flush()
        assert process.stdout.readline()
        time.sleep(0.05)
        process.send_signal(number)
        process.wait()
        assert process.stderr.read() == b""
    assert process.returncode == status


def test_a_reader_that_has_gone_ends_a_batch_quietly(tmp_path: Path) -> None:
    (tmp_path / "lines.txt").write_text("convert --from rpy 0 0 1\n" * 5000)
    status, _, err = shell.in_shell("| head -1 > /dev/null", "batch", "lines.txt", cwd=tmp_path)
    assert (status, err) == (141, b"")


def test_results_in_a_terminal_are_those_of_a_pipe(tmp_path: Path) -> None:
    import pty

    ours, theirs = pty.openpty()
    status, _, _ = shell.run("batch", text=b"convert --from rpy 0 0 0\nx = convert --from rpy 0 0 0\n", stdout=theirs, cwd=tmp_path)
    os.close(theirs)
    printed = os.read(ours, 1000)
    os.close(ours)
    assert (status, printed) == (0, b"quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}\r\n")
