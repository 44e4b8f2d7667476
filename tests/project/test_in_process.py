"""A line of shell in this process does what bash does, and leaves nothing behind."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import warnings
from typing import TYPE_CHECKING, Any

import pytest
from in_process import printed, run_line, understands

if TYPE_CHECKING:
    from pathlib import Path

LINES = [
    r"printf 'a\nb\n' | tail -n 1", "printf 'a\\n' |\n    sed s/a/b/", "echo \"a  b\"'c'd#e  # a comment", "echo ''; echo 1 2> /dev/null",
    "echo 1 > both 2>&1; cat both", "cat nowhere 2>&1 >/dev/null | wc -l", "cat nowhere 2> /dev/null", "cat nowhere | cat; echo $?",
    "true && echo $? || echo no", "grep x /dev/null && echo some || echo none", "grep x /dev/null | cat", "grep x /dev/null; echo $?",
    'd=$(mktemp -d); echo a > $d/f; cat < $d/f | sed "s/a/$?/"; cat "$d/f"', "cd /; cat nowhere",
]  # fmt: skip


@pytest.mark.skipif(os.name == "nt", reason="bash is of POSIX")
@pytest.mark.parametrize("pipefail", [False, True])
def test_a_line_does_what_bash_does(tmp_path: Path, *, pipefail: bool) -> None:
    for line in LINES:
        options = ["-o", "pipefail"] * pipefail
        done = subprocess.run(["bash", *options, "-c", line], cwd=tmp_path, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
        assert run_line(line, tmp_path, pipefail=pipefail) == (done.returncode, done.stdout, done.stderr), line


def test_what_only_a_shell_can_do_is_not_understood() -> None:
    lines = ["for a in b; do echo; done", "echo $(date)", "echo `date`", "echo *", "echo ~", "echo {a,b}", "true &", "(true)", "echo a\\ b", "python", "| cat", "echo >", "cat << A"]
    assert [line for line in lines if understands(line)] == []


def state() -> tuple[Any, ...]:
    """Return what a command could leave changed."""
    streams = sys.stdin, sys.stdout, sys.stderr
    return os.getcwd(), dict(os.environ), streams, sys.getrecursionlimit(), gc.get_threshold(), gc.isenabled(), list(warnings.filters)


def test_nothing_is_left_behind(examples_folder: Path) -> None:
    before = state()
    for line in ("frametool lookup robot.yaml map lidar", "frametool convert nowhere", "cd /; frametool batch < /dev/null | frametool invert"):
        assert printed(line, examples_folder, 80) == printed(line, examples_folder, 80)
        assert state() == before
