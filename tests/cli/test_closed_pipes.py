"""A reader that has gone ends every command as it ends `cat`: by SIGPIPE, 141 in a shell, without a word."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TREE = "frames:\n" + "".join(f"- {{name: f{index}, parent: map, xyz: [{index}, 0, 0]}}\n" for index in range(3000))


@pytest.mark.parametrize("reader", ["true", "head -c 10"])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_large_result_is_cut_off_quietly(tmp_path: Path, reader: str, unbuffered: str) -> None:
    (tmp_path / "tree.yaml").write_text(TREE)
    assert ended(f"tree {tmp_path}/tree.yaml -f json", reader, PYTHONUNBUFFERED=unbuffered) == "141"


@pytest.mark.parametrize("arguments", ["", "--help", "--version", "apply --help", "convert --from rpy 0 0 1"])
def test_whatever_is_printed_may_find_no_reader(arguments: str) -> None:
    assert ended(arguments, "true") == "141"


def ended(arguments: str, reader: str, **environment: str) -> str:
    tool = f"{sys.executable} -c 'from frametool.cli import main; main()'"
    wait = "sleep 0.3; " * (reader == "true")  # so that the reader has gone before anything is written
    command = f"({wait}exec {tool} {arguments}) | {reader} >/dev/null; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", command], capture_output=True, text=True, check=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.strip()
