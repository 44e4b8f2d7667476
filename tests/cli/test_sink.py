"""Where results go, in every command that has -o: whole or not at all, through links, into pipes and devices."""

from __future__ import annotations

import os
import stat
import subprocess
from pathlib import Path

import pytest
from shell import ROOT, in_shell, run

TREE = str(ROOT / "examples" / "robot.yaml")
ROWS = b"x,y,z\n1,2,3\n"
WRITERS = {
    "stream": ["apply", "--transform", "{xyz: [1, 2, 3]}"],
    "scalar": ["convert", "--from", "rpy", "0", "0", "1"],
    "lookup": ["lookup", TREE, "map", "lidar"],
    "tree": ["tree", TREE, "-f", "yaml"],
    "static": ["static", TREE],
    "monitor": ["monitor", TREE],
    "simulation": ["sim", "follow", "--duration", "0.2"],
}
pytestmark = pytest.mark.parametrize("arguments", WRITERS.values(), ids=WRITERS)


def into(path: str | Path, arguments: list[str], *more: str) -> tuple[int, bytes, bytes]:
    return run(*arguments, *more, "-o", str(path), text=ROWS)


def test_an_existing_file_stays_unless_told(arguments: list[str], tmp_path: Path) -> None:
    target = tmp_path / "out"
    target.write_bytes(b"before")
    status, out, err = into(target, arguments)
    assert (status, out, err) == (5, b"", f"frametool: {target}: exists; give --force to replace it\n".encode())
    assert target.read_bytes() == b"before"
    assert into(target, arguments, "--force")[0] == 0
    assert target.read_bytes() not in (b"", b"before")
    assert os.listdir(tmp_path) == ["out"]


def test_a_link_stays_a_link_and_a_mode_stays(arguments: list[str], tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_bytes(b"before")
    target.chmod(0o600)
    link.symlink_to("target")
    assert into(link, arguments)[0] == 5
    assert into(link, arguments, "--force")[0] == 0
    assert link.is_symlink()
    assert target.read_bytes() not in (b"", b"before")
    assert stat.S_IMODE(target.stat().st_mode) == 0o600
    assert sorted(os.listdir(tmp_path)) == ["link", "target"]


def test_a_link_to_nothing_yet_is_followed(arguments: list[str], tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("target")
    assert into(tmp_path / "link", arguments)[0] == 0
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").stat().st_size


def test_pipes_devices_and_own_streams_are_written_to(arguments: list[str], tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE) as reader:
        assert into(pipe, arguments)[0] == 0
        assert reader.communicate()[0]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert into("/dev/null", arguments)[0] == 0
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    status, out, _ = in_shell("-o /dev/stdout | cat", *arguments, text=ROWS, cwd=tmp_path)
    assert (status, bool(out)) == (0, True)
    status, out, _ = in_shell("-o /dev/fd/3 3>kept >&2 && cat kept", *arguments, text=ROWS, cwd=tmp_path)
    assert (status, bool(out)) == (0, True)


def test_the_longest_name_that_the_system_takes_is_taken(arguments: list[str], tmp_path: Path) -> None:
    name = "ä" * 125 + "long"
    assert into(tmp_path / name, arguments)[0] == 0
    assert os.listdir(tmp_path) == [name]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full disk at hand")
def test_a_full_device_is_one_line(arguments: list[str], tmp_path: Path) -> None:
    assert into("/dev/full", arguments)[::2] == (5, b"frametool: /dev/full: no space left on device\n")
    status, _, err = in_shell("> /dev/full", *arguments, text=ROWS, cwd=tmp_path)
    assert (status, err.count(b"standard output: no space left on device\n")) == (5, 1)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full disk at hand")
def test_what_nobody_reads_changes_no_exit_code(arguments: list[str], tmp_path: Path) -> None:
    plain = run(*arguments, text=ROWS)
    for redirection in ("2> /dev/full", "2>&-"):
        assert in_shell(redirection, *arguments, text=ROWS, cwd=tmp_path)[:2] == plain[:2]
        assert in_shell(redirection, *arguments, "--precision", "nan", text=ROWS, cwd=tmp_path)[:2] == (2, b"")


def test_a_reader_that_has_gone_ends_it_as_it_ends_cat(arguments: list[str], tmp_path: Path) -> None:
    for place in ("", "-o /dev/stdout"):
        status, out, err = in_shell(f"{place} | true", *arguments, text=ROWS, cwd=tmp_path)
        if status != 141:  # all was written before the reader went
            assert status == 0
        assert (out, b"frametool: standard" in err, b"Traceback" in err) == (b"", False, False)
