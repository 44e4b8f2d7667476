"""Run the console blocks of a text as a person would: in a terminal, `$ command` and what it prints.

`python tests/console.py README.md` writes what the commands print now into the file; `python tests/console.py README.md BIN`
does so with the frametool that is in the folder BIN.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"```console\n(.*?)```", re.DOTALL)
WIDTH = 120


def commands(block: str) -> list[tuple[str, str]]:
    """Split a block into its commands and what is printed after each."""
    pieces = re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]
    return [(command, output) for command, _, output in (piece.partition("\n") for piece in pieces)]


def printed(command: str, bin_folder: Path) -> str:
    """Run a shell command in the project's folder with a terminal for its output; give what appears there."""
    import pty  # Windows has none; what else stands here is wanted there too

    script = bin_folder / "frametool"
    if not script.exists():
        script.write_text(f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {str(ROOT)!r})\nimport frametool.__main__\n")
        script.chmod(0o755)
    environment = os.environ | {
        "PATH": f"{bin_folder}:{os.environ['PATH']}",
        "TERM": "dumb",
        "NO_COLOR": "1",
        "COLUMNS": str(WIDTH),
    }
    terminal, inside = pty.openpty()
    process = subprocess.Popen(
        ["bash", "-c", command], cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=inside, stderr=inside
    )
    os.close(inside)
    data = b""
    while chunk := _read(terminal):
        data += chunk
    os.close(terminal)
    process.wait()
    return data.decode().replace("\r\n", "\n")


def _read(terminal: int) -> bytes:
    """Read what appeared; a terminal nobody writes to any more raises instead of ending."""
    try:
        return os.read(terminal, 65536)
    except OSError:
        return b""


def split(text: str) -> tuple[list[str], list[float]]:
    """Part a text into its words and its numbers: another libm may differ in a number's last digit."""
    pieces = re.split(r"((?<![\w.])[-+]?\d+\.\d+(?:e[-+]\d+)?)", text)
    return [" ".join(piece.split()) for piece in pieces[::2]], [float(piece) for piece in pieces[1::2]]


def rewritten(text: str, bin_folder: Path) -> str:
    """Give the text with every console block as it prints now."""

    def fresh(match: re.Match[str]) -> str:
        return "```console\n" + "".join(f"$ {cmd}\n{printed(cmd, bin_folder)}" for cmd, _ in commands(match[1])) + "```"

    return BLOCK.sub(fresh, text)


if __name__ == "__main__":
    import tempfile

    path = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        path.write_text(rewritten(path.read_text(), Path(*sys.argv[2:] or [folder])))
