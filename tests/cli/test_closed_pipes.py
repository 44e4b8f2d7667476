"""A reader that has gone ends every command as it ends `cat`: by SIGPIPE, 141 in a shell, without a word."""

from __future__ import annotations

import os
import signal
import subprocess
from typing import TYPE_CHECKING

import pytest
from shell import ENVIRONMENT, TOOL, in_shell

if TYPE_CHECKING:
    from pathlib import Path

TREE = "frames:\n" + "".join(f"- {{name: f{index}, parent: map, xyz: [{index}, 0, 0]}}\n" for index in range(3000))


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_large_result_is_cut_off_quietly(tmp_path: Path, unbuffered: str) -> None:
    (tmp_path / "tree.yaml").write_text(TREE)
    assert without_reader("tree", f"{tmp_path}/tree.yaml", "-f", "json", PYTHONUNBUFFERED=unbuffered)
    assert in_shell("| head -c 10 > /dev/null", "tree", f"{tmp_path}/tree.yaml", "-f", "json") == (141, b"", b"")


@pytest.mark.parametrize("arguments", ["", "--help", "--version", "apply --help", "convert --from rpy 0 0 1"])
def test_whatever_is_printed_may_find_no_reader(arguments: str) -> None:
    assert without_reader(*arguments.split())


def without_reader(*arguments: str, **environment: str) -> bool:
    """Tell whether the tool ends as `cat` does when nobody reads from the other end of its pipe."""
    ours, theirs = os.pipe()
    os.close(ours)
    done = subprocess.run(
        [*TOOL, *arguments], stdout=theirs, stderr=subprocess.PIPE, check=False, env=ENVIRONMENT | environment
    )
    os.close(theirs)
    return (done.returncode, done.stderr) == (-signal.SIGPIPE, b"")
