"""Streams as a shell runs them: pipes, files, signals, latency by order of events and not by the clock."""

from __future__ import annotations

import json
import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from shell import ENVIRONMENT, in_shell, run, start

MOVE = ["apply", "--transform", "{xyz: [1, 2, 3]}"]
ROWS = b"id,x,y,z\n007,1,2,3\n"
MOVED = b"id,x,y,z\n007,2.0,4.0,6.0\n"


@pytest.mark.parametrize("line", [b"1,2,3\n", b'{"x": 1, "y": 2, "z": 3}\n'])
def test_a_typed_line_comes_out_before_the_next_is_typed(line: bytes) -> None:
    with start(*MOVE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        if b"{" not in line:
            process.stdin.write(b"x,y,z\n")
            process.stdin.flush()
            assert process.stdout.readline() == b"x,y,z\n"
        for _ in range(3):
            process.stdin.write(line)
            process.stdin.flush()
            assert b"4.0" in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait() == 130


def test_a_vanished_reader_ends_it_quietly(tmp_path: Path) -> None:
    source = tmp_path / "in.csv"
    source.write_bytes(ROWS + b"1,1,2,3\n" * 300_000)
    with start(*MOVE, "-i", str(source), stdin=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"id,x,y,z\n"
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == b""
        assert process.wait() in (-signal.SIGPIPE, 141)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full disk at hand")
def test_a_full_disk_is_told() -> None:
    with Path("/dev/full").open("wb") as full:
        process = start(*MOVE, stdout=full)
        _, err = process.communicate(ROWS)
    assert (process.returncode, err) == (5, b"frametool: standard output: no space left on device\n")


def test_files_are_whole_or_not_there(tmp_path: Path) -> None:
    source, target = tmp_path / "in.csv", tmp_path / "out.csv"
    source.write_bytes(ROWS + b"x,?,0,0\n")
    arguments = [*MOVE, "-i", str(source), "-o", str(target)]
    assert run(*arguments)[0] == 1
    assert not target.exists()
    assert run(*arguments, "--on-error", "skip")[0] == 3
    assert target.read_bytes() == MOVED
    assert run(*arguments, "--on-error", "skip")[0] == 5
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.csv", "out.csv"]


def test_what_is_no_plain_file_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE) as reader:
        assert run(*MOVE, "-o", str(pipe), text=ROWS)[0] == 0
        assert reader.communicate()[0] == MOVED
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_form_is_told_only_when_it_was_found_out() -> None:
    assert b"read as csv" in run(*MOVE, "-v", text=ROWS)[2]
    assert run(*MOVE, "-v", "--in", "csv", text=ROWS) == (0, MOVED, b"")


def test_a_few_records_need_no_numpy() -> None:
    code = "import sys; from frametool.cli import run; run(['invert', '-']); print('numpy' in sys.modules, file=sys.stderr)"
    record = b"name: a\nparent: b\nxyz: [1, 2, 3]\n"
    done = subprocess.run([sys.executable, "-c", code], input=record, capture_output=True, check=True, env=ENVIRONMENT)
    assert done.stdout == b"name: b\nparent: a\nxyz: [-1.0, -2.0, -3.0]\n"
    assert done.stderr == b"False\n"


@pytest.mark.parametrize(
    ("arguments", "text", "status", "message"),
    [
        ([*MOVE], b"", 1, b"frametool: stdin: nothing in it"),
        ([*MOVE, "--in", "csv"], b"\n \n", 1, b"frametool: stdin: nothing in it"),
        ([*MOVE, "--in", "csv"], b"# a comment\n", 1, b"frametool: stdin:1: no rows in it"),
        ([*MOVE], b"hello\n", 1, b"frametool: stdin:1: cannot detect the format of this text"),
        ([*MOVE, "--columns", "a,b,c"], b"x,y,z\n1,2,3\n", 2, b"frametool: --columns: no column 'a'"),
        ([*MOVE, "--columns", "x,x,z"], b"x,y,z\n1,2,3\n", 2, b"frametool: --columns: x appears twice"),
        (["invert", "--columns", "x,y"], b"x,y,z\n1,2,3\n", 2, b"frametool: --columns: 2 columns do not say"),
        ([*MOVE, "--keep"], b"x,y,z\n1,2,3\n", 2, b"frametool: columns x, y, z would appear twice; name the new"),
        (["convert", "--to", "rpy,rpy"], b"qx,qy,qz,qw\n0,0,0,1\n", 2, b"frametool: --to: columns pitch, roll"),
        (["convert", "--to", "rpy", "--unwrap", "-f", "json"], b"qx,qy,qz,qw\n0,0,0,1\n", 2, b'{"error": "misused", "message": "convert: --unwrap'),
        (["convert", "--to", "rpy", "--unwrap", "-f", "npy"], b'{"xyzw": [0, 0, 0, 1]}\n' * 2, 2, b"frametool: convert: --unwrap is for rows"),
        (["convert", "--to", "quaternion,xyzw"], b"roll,pitch,yaw\n0,0,0\n", 2, b"frametool: --to: columns qw"),
        (["relative", "--consecutive"], b"x,y,z,angle\n0,0,0,1\n", 2, b"frametool: columns angle would appear twice"),
        ([*MOVE, "-i", ""], b"x,y,z\n1,2,3\n", 5, b"frametool: '': no such file or directory"),
        ([*MOVE, "-i", "no.csv"], b"", 5, b"frametool: no.csv: no such file or directory"),
        ([*MOVE, "-i", "a.csv", "1", "2", "3"], b"", 2, b"frametool: apply: -i FILE and arguments are two inputs; give one"),
        (["invert", "--in", "cvs"], b"", 2, b"frametool: invert: invalid value for '--in'"),
        (["relative", "{xyz: [1, 2, 3]}"], b"", 2, b"frametool: relative: name A and B"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line_with_their_status(
    arguments: list[str], text: bytes, status: int, message: bytes
) -> None:
    code, out, err = run(*arguments, text=text)
    assert (code, out) == (status, b"")
    assert err.startswith(message)
    assert err.count(b"\n") == 1


@pytest.mark.parametrize("option", ["--consecutive", "--first"])
def test_a_prefix_names_the_distances_of_a_table_in_another_format_too(option: str) -> None:
    table = b"x,y,z,qx,qy,qz,qw,distance\n0,0,0,0,0,0,1,77\n3,4,0,0,0,0,1,78\n"
    code, out, err = run("relative", option, "-f", "json", text=table)
    assert (code, out) == (2, b"")
    assert b"--prefix" in err
    code, out, err = run("relative", option, "-f", "json", "--prefix", "rel_", text=table)
    assert code == 0, err
    last = json.loads(out.splitlines()[-1])
    assert (last["xyz"], last["rel_distance"], last["distance"]) == ([3, 4, 0], 5, 78)


def test_a_pipe_given_by_its_name_loses_nothing(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with start(*MOVE, "-i", str(pipe)) as process:
        pipe.write_bytes(ROWS)
        assert process.communicate()[0] == MOVED


def test_a_closed_input_is_told() -> None:
    for arguments in (MOVE, ["invert"]):
        assert in_shell("<&-", *arguments, text=ROWS) == (5, b"", b"frametool: standard input is closed\n")


def test_what_nobody_is_told_does_not_change_the_data() -> None:
    assert in_shell("2>&-", *MOVE, text=ROWS) == (0, MOVED, b"")
    assert in_shell("2>/dev/full", *MOVE, "--on-error", "skip", text=ROWS + b"8,1,2,?\n") == (3, MOVED, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full disk at hand")
def test_a_full_device_is_told_by_its_name() -> None:
    message = b"frametool: /dev/full: no space left on device\n"
    assert run(*MOVE, "-o", "/dev/full", text=ROWS) == (5, b"", message)


TREE = "frames: [{name: cam, parent: map, xyz: [1, 0, 0]}, {name: lid, parent: map, xyz: [2, 0, 0]}]\n"
FRAMES = b"frame_id,x,y,z\ncam,0,0,0\n/lid,0,0,0\nnope,0,0,0\nmop,0,0,0\n"


def in_tree(folder: Path, *arguments: str, text: bytes = FRAMES) -> tuple[int, bytes, list[str]]:
    tree = folder / "tree.yaml"
    tree.write_text(TREE)
    status, out, err = run("apply", str(tree), "map", *arguments, text=text)
    return status, out, err.decode().replace(str(tree), "TREE").splitlines()


def test_rows_without_a_result_keep_the_name_of_their_frame(tmp_path: Path) -> None:
    status, out, told = in_tree(tmp_path, "--on-error", "null")
    assert (status, out) == (3, b"frame_id,x,y,z\nmap,1.0,0.0,0.0\nmap,2.0,0.0,0.0\nnope,,,\nmop,,,\n")
    assert told == [
        "frametool: warning: frame '/lid': the leading / is no part of a name and was left out",
        "frametool: stdin:4:frame_id: unknown frame 'nope' in TREE; frames: cam, lid, map (no result)",
        "frametool: stdin:5:frame_id: unknown frame 'mop' in TREE; did you mean 'map'? (no result)",
        "frametool: stdin: 2 of 4 rows without result",
    ]


def test_rows_must_be_given_in_the_source(tmp_path: Path) -> None:
    status, out, told = in_tree(tmp_path, "cam", "--on-error", "null")
    assert (status, out) == (3, b"frame_id,x,y,z\nmap,1.0,0.0,0.0\n/lid,,,\nnope,,,\nmop,,,\n")
    assert "stdin:4:frame_id: a record is expressed in 'nope', not in 'cam'" in told[2]


def test_poses_are_not_cut_down_to_points(tmp_path: Path) -> None:
    status, out, told = in_tree(tmp_path, "cam", "--as", "point", text=b"x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,1\n")
    assert (status, out) == (2, b"")
    assert "cannot be taken for a point" in told[0]


def test_a_bad_row_after_good_ones_names_what_goes_on(tmp_path: Path) -> None:
    def told(*arguments: str, text: bytes) -> str:
        return in_tree(tmp_path, "cam", *arguments, text=text)[2][-1]

    assert told(text=b"x,y,z\n0,0,0\n0,n/a,0\n") == "frametool: stdin:3:y: 'n/a' is not a number; --on-error skip goes on"
    assert told(text=b"x,y,z\n0,n/a,0\n") == "frametool: stdin:2:y: 'n/a' is not a number"
    assert "skip" not in told("-f", "json", text=b"x,y,z\n0,0,0\n0,n/a,0\n")
    path = tmp_path / "points.csv"
    path.write_text("x,y,z\n0,0,0\n")
    assert "pass a file of records with -i " in told(str(path), text=b"")
