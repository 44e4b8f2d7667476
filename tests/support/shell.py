"""The tool as a shell runs it: a process of its own, its pipes, its files."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
TOOL = [sys.executable, "-c", "from frametool.cli import main; main()"]
ENVIRONMENT = {key: value for key, value in os.environ.items() if key not in ("PYTHONUNBUFFERED", "FRAMETOOL_TREE")} | {
    "PYTHONPATH": str(ROOT)
}


def by_default() -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def start(*arguments: str | bytes, **options: object) -> subprocess.Popen[bytes]:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.Popen([*TOOL, *arguments], env=ENVIRONMENT, **pipes)  # type: ignore[call-overload, no-any-return]


def run(*arguments: str | bytes, text: bytes = b"", **options: object) -> tuple[int, bytes, bytes]:
    with start(*arguments, **options) as process:
        out, err = process.communicate(text)
    return process.returncode, out, err


def in_shell(redirection: str, *arguments: str, text: bytes = b"", cwd: Path | None = None) -> tuple[int, bytes, bytes]:
    """Run the tool with its streams redirected as a shell does it; `|` may follow."""
    command = ["bash", "-c", f'"$@" {redirection}; exit ${{PIPESTATUS[0]}}', "bash", *TOOL, *arguments]
    done = subprocess.run(command, input=text, capture_output=True, check=False, env=ENVIRONMENT, cwd=cwd)
    return done.returncode, done.stdout, done.stderr
