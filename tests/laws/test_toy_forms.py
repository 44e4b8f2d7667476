"""A form is one row of FORMATS and one file: made-up ones, of rows and of columns, serve every command and option.

The row of poses says in `rows` what its lines hold; all else is as in the row of TUM.
"""

from __future__ import annotations

import io
import json
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Run = Callable[..., "Done"]

ROOT = Path(__file__).resolve().parents[2]
BARS = '''
"""Bars: qw|qx|qy|qz|x|y|z|stamp, without a header."""
from importlib import import_module
from frametool import FORMATS

rows = import_module(FORMATS["tum"].writer)
ROW = rows.RowForm((rows.Numbers(7, b"|"), b"|", "seconds", b"\\n"), lambda x, y, z, *turn: (turn[3], *turn[:3], x, y, z))
ROWS = {"bars": ROW}

def write_poses(results, style):
    return rows.write_rows(ROW, results, style)
'''
DOUBLES = '''
"""Doubles: a mark, then an array of numpy."""
from importlib import import_module
from frametool import FORMATS

npy = import_module(FORMATS["npy"].reader)
MARK = b"DBL1\\n"

def marked(writer):
    head = writer.head
    writer.head = lambda count: MARK + head(count)
    return writer

def open_columns(file):
    assert file.stream.read(len(MARK)) == MARK
    opened = npy.open_columns(file)
    rewriter = opened.rewriter
    opened.rewriter = lambda *columns: marked(rewriter(*columns))
    return opened

def create(columns, count, style):
    return marked(npy.create(columns, count, style))
'''
ROWS = r"""
FORMATS["bars"] = FORMATS["tum"]._replace(
    summary="a toy trajectory", suffixes=(".bars",), writer="toy_bars",
    rows=FORMATS["tum"].rows._replace(delimiter="|", columns=("qw", "qx", "qy", "qz", "x", "y", "z", "stamp")), magic=(("line", r"[-\d.]+(?:\|[-\d.]+){7}$"),),
)
"""
ARRAYS = r"""
FORMATS["doubles"] = FORMATS["npy"]._replace(
    summary="a toy array", suffixes=(".doubles",), reader="toy_doubles", writer="toy_doubles",
    magic=(("magic", rb"DBL1\n"),),
)
"""
WALK = [("0.5", (1.0, 2.0, 3.0)), ("1.5", (2.0, 2.0, 3.0)), ("2.500000001", (3.0, 0.0, 3.0))]
AS_TUM = "".join(f"{stamp} {x} {y} {z} 0.5 -0.5 0.5 0.5\n" for stamp, (x, y, z) in WALK)
AS_BARS = "".join(f"0.5|0.5|-0.5|0.5|{x}|{y}|{z}|{stamp}\n" for stamp, (x, y, z) in WALK)
TREE = "frames: {map: {world: {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}}}\n"
MOVE = "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"


class Done(NamedTuple):
    """What a run left behind."""

    status: int
    out: bytes
    err: str


INTERPRETER = """
import json, os, sys
import numpy
from frametool import FORMATS
{row}
from frametool.cli import run, streaming
from frametool.cli.commands import apply, convert
for line in sys.stdin:
    folder, arguments, environment = json.loads(line)
    if (child := os.fork()) == 0:
        os.chdir(folder)
        os.environ.update(environment)
        sys.path.insert(0, folder)
        for number, name in enumerate(("stdin", "stdout", "stderr")):
            os.dup2(os.open(name, os.O_RDWR | os.O_CREAT), number)
        sys.exit(run(arguments))
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
ENVIRONMENT = {"PATH": "", "PYTHONPATH": str(ROOT), "COLUMNS": "100", "NO_COLOR": "1", "OPENBLAS_NUM_THREADS": "1"}


@pytest.fixture(scope="module")
def run() -> Iterator[Run]:
    """Run the command line where a row was there before it; words: ask what completes them.

    One interpreter a row is loaded, and every run is a fork of it.
    """
    with ExitStack() as stack:
        started: dict[str, subprocess.Popen[str]] = {}

        def call(folder: Path, row: str, *arguments: str, stdin: bytes = b"", words: str = "") -> Done:
            if row not in started:
                started[row] = stack.enter_context(
                    subprocess.Popen(
                        [sys.executable, "-c", INTERPRETER.format(row=row)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                        text=True, env=ENVIRONMENT,
                    )
                )  # fmt: skip
            files = {"toy_bars.py": BARS, "toy_doubles.py": DOUBLES, "tree.yaml": TREE, "walk.tum": AS_TUM, "walk.bars": AS_BARS}
            for name, text in files.items():
                (folder / name).write_text(text)
            for name, data in (("stdin", stdin), ("stdout", b""), ("stderr", b"")):
                (folder / name).write_bytes(data)
            completion = {"_FRAMETOOL_COMPLETE": "words"} if words else {}
            asked, answers = started[row].stdin, started[row].stdout
            assert asked
            assert answers
            print(json.dumps([str(folder), [words] if words else arguments, completion]), file=asked, flush=True)
            status = int(answers.readline())
            return Done(status, (folder / "stdout").read_bytes(), (folder / "stderr").read_text())

        yield call


class Case(NamedTuple):
    """What is asked of the toy, with {} for its file, and the same of TUM."""

    arguments: tuple[str, ...]
    by_stdin: bool = False


READ = {
    "convert": Case(("convert", "-i", "{}", "-f", "json")),
    "convert a file": Case(("convert", "{}", "-f", "json")),
    "convert what comes in": Case(("convert", "-f", "json"), by_stdin=True),
    "invert": Case(("invert", "-i", "{}", "-f", "csv")),
    "apply": Case(("apply", "--transform", MOVE, "-i", "{}", "-f", "yaml")),
    "apply by a tree": Case(("apply", "tree.yaml", "map", "world", "-i", "{}", "-f", "json")),
    "lookup": Case(("lookup", "{}", "world", "body", "--at", "1", "-f", "json")),
    "lookup with another": Case(("lookup", "tree.yaml", "map", "body", "--with", "{}", "--at", "2", "-f", "json")),
    "mean": Case(("mean", "-i", "{}", "-f", "json")),
    "relative": Case(("relative", "--consecutive", "--velocity", "-i", "{}", "-f", "json")),
}
@pytest.mark.parametrize("name", READ)
def test_rows_of_a_made_up_form_are_read_as_those_of_tum(run: Run, tmp_path: Path, name: str) -> None:
    case = READ[name]
    outs = []
    for form, text in (("tum", AS_TUM), ("bars", AS_BARS)):
        arguments = [word.format(f"walk.{form}") if "{}" in word else word for word in case.arguments]
        done = run(tmp_path, ROWS, *arguments, "--quiet", stdin=text.encode() if case.by_stdin else b"")
        assert done.status == 0, done.err
        outs.append(done.out)
    assert outs[0] == outs[1]


@pytest.mark.parametrize("given", [("-i", "walk.bars"), ("--in", "bars")])
def test_a_stream_in_a_made_up_form_stays_in_it(run: Run, tmp_path: Path, given: tuple[str, ...]) -> None:
    stdin = AS_BARS.encode() if "--in" in given else b""
    done = run(tmp_path, ROWS, "apply", "--transform", "{xyz: [1, 0, 0]}", *given, stdin=stdin)
    wanted = "".join(f"0.5|0.5|-0.5|0.5|{x + 1.0}|{y}|{z}|{stamp}\n" for stamp, (x, y, z) in WALK)
    assert (done.status, done.out.decode()) == (0, wanted), done.err


def test_a_made_up_form_is_written_by_name_and_by_suffix(run: Run, tmp_path: Path) -> None:
    wanted = AS_BARS.replace("0.5\n", "0.500000000\n").replace("1.5\n", "1.500000000\n")
    assert run(tmp_path, ROWS, "convert", "-i", "walk.tum", "-f", "bars").out.decode() == wanted
    assert run(tmp_path, ROWS, "convert", "-i", "walk.tum", "-o", "out.bars").status == 0
    assert (tmp_path / "out.bars").read_text() == wanted
    assert run(tmp_path, ROWS, "lookup", "walk.tum", "world", "body", "-f", "bars").out.decode() == wanted


def test_what_is_wrong_in_a_made_up_row_names_its_line(run: Run, tmp_path: Path) -> None:
    for text, where in ((AS_BARS + "0.5|0.5|-0.5|0.5|x|0|0|9\n", "stdin:4:x:"), (AS_BARS + "1|2\n", "stdin:4:")):
        done = run(tmp_path, ROWS, "invert", "--in", "bars", "--on-error", "skip", stdin=text.encode())
        assert (done.status, done.out.count(b"\n")) == (3, len(WALK))
        assert where in done.err


def test_help_lists_and_completes_a_made_up_form(run: Run, tmp_path: Path) -> None:
    assert b"bars" in run(tmp_path, ROWS, words="frametool convert -f ba").out
    assert b"a toy trajectory" in run(tmp_path, ROWS, "formats").out
    assert b"bars" in run(tmp_path, ROWS, words="frametool convert --in ba").out


def doubles(rows: list[list[float]]) -> bytes:
    """Write rows as the made-up form of columns."""
    file = io.BytesIO()
    np.save(file, np.array(rows))
    return b"DBL1\n" + file.getvalue()


POINTS = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
SEVEN = [[*place, 0.5, -0.5, 0.5, 0.5] for _, place in WALK]
NAMED = ("--from", "xyzw")


def test_columns_of_a_made_up_form_are_moved(run: Run, tmp_path: Path) -> None:
    (tmp_path / "points.doubles").write_bytes(doubles(POINTS))
    done = run(tmp_path, ARRAYS, "apply", "--transform", "{xyz: [1, 0, 0]}", "-i", "points.doubles", "-o", "moved.doubles")
    assert done.status == 0, done.err
    assert (tmp_path / "moved.doubles").read_bytes() == doubles([[x + 1.0, y, z] for x, y, z in POINTS])
    done = run(tmp_path, ARRAYS, "apply", "tree.yaml", "map", "world", "-i", "points.doubles", "-f", "csv")
    assert done.out.decode() == "frame,x,y,z\nmap,-1.0,3.0,6.0\nmap,-4.0,6.0,9.0\n"
    done = run(tmp_path, ARRAYS, "apply", "--transform", "{xyz: [1, 0, 0]}", "--in", "doubles", "-f", "csv", stdin=doubles(POINTS))
    assert done.out.decode() == "x,y,z\n2.0,2.0,3.0\n5.0,5.0,6.0\n"


@pytest.mark.parametrize("command", ["convert", "invert", "mean"])
def test_poses_of_a_made_up_form_of_columns_are_read_as_those_of_a_table(run: Run, tmp_path: Path, command: str) -> None:
    (tmp_path / "poses.doubles").write_bytes(doubles(SEVEN))
    (tmp_path / "poses.csv").write_text("x,y,z,qx,qy,qz,qw\n" + "".join(",".join(map(repr, row)) + "\n" for row in SEVEN))
    found = run(tmp_path, ARRAYS, command, *NAMED, "-i", "poses.doubles", "-f", "json", "--quiet")
    wanted = run(tmp_path, ARRAYS, command, "-i", "poses.csv", "-f", "json", "--quiet")
    assert (found.status, found.out) == (0, wanted.out), found.err


def test_a_made_up_form_of_columns_is_written_and_listed(run: Run, tmp_path: Path) -> None:
    assert run(tmp_path, ARRAYS, "convert", "-i", "walk.tum", "-o", "out.doubles").status == 0
    back = run(tmp_path, ARRAYS, "convert", "-i", "out.doubles", "-f", "json", "--quiet")
    found = [json.loads(line) for line in back.out.splitlines()]
    assert [tuple(each["xyz"]) for each in found] == [place for _, place in WALK]
    assert b"doubles" in run(tmp_path, ARRAYS, "formats").out
    assert b"a toy array" in run(tmp_path, ARRAYS, "formats").out
