"""What the tests share: the command line in this process."""

from __future__ import annotations

import io
import os
import pathlib
import re
import shutil
import signal
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import chromium
import pytest
from hypothesis import settings
from sized import set_sizes

from frametool import cli
from frametool.cli.commands.batch import reader, streams, writer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from oracles_of_use import Tool

    Sizes = Callable[..., None]

pytest_plugins = ["selection"]  # what runs by default
# the same examples in every run, however busy the machine is
settings.register_profile("steady", deadline=None, derandomize=True, max_examples=60)  # more: -m fuzz, -m large
settings.load_profile("steady")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # in the background of a script; the commands would ignore it too
    signal.signal(signal.SIGINT, signal.default_int_handler)

# terminals, shells, signals and forks are of POSIX; tests of them import what Windows has not
POSIX = r"(?m)^\s*(?:import|from) (?:browsers|console|fcntl|machine_output|oracles_of_use|pty|readline|resource|shell|termios)\b"
HERE = pathlib.Path(__file__).parent
TESTS = HERE.rglob("test_*.py")
collect_ignore = [str(each) for each in TESTS if os.name == "nt" and re.search(POSIX, each.read_text(encoding="utf-8"))]


class Outcome(NamedTuple):
    """What a run of the command line left behind."""

    status: int
    out: str
    err: str


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., Outcome]:
    """Run the command line in this process, in an empty folder that `files` fill."""

    def call(*arguments: str, stdin: str | bytes | io.RawIOBase = "", files: dict[str, str | bytes] | None = None) -> Outcome:
        monkeypatch.chdir(tmp_path)
        for name, content in (files or {}).items():
            (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
        data = stdin.encode() if isinstance(stdin, str) else stdin
        raw = io.BytesIO(data) if isinstance(data, bytes) else data
        out, err = io.BytesIO(), io.BytesIO()
        with streams(reader(raw), writer(out), writer(err, "backslashreplace")):
            status = cli.run(list(arguments))
        return Outcome(status, out.getvalue().decode(), err.getvalue().decode())

    return call


@pytest.fixture
def sizes(monkeypatch: pytest.MonkeyPatch) -> Sizes:
    """Set sizes of the run by their names in lower case, as in `sizes(block=7)`."""
    return partial(set_sizes, monkeypatch)


@pytest.fixture(scope="module")
def copied_examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy the example files into a folder."""
    return shutil.copytree(HERE.parent / "examples", tmp_path_factory.mktemp("copied") / "examples")


@pytest.fixture
def examples_folder(copied_examples: Path) -> Iterator[Path]:
    """Return a folder with the example files; what a test writes there is removed after it."""
    before = set(copied_examples.iterdir())
    yield copied_examples
    for path in set(copied_examples.iterdir()) - before:
        shutil.rmtree(path) if path.is_dir() else path.unlink()


@pytest.fixture(autouse=True)
def _plain_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the caller's settings out of the tests."""
    monkeypatch.delenv("FRAMETOOL_TREE", raising=False)
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setitem(os.environ, "COLUMNS", "100")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Start chromium, or skip."""
    with chromium.running() as started:
        yield started


@pytest.fixture
def tool(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Tool:
    """Run the command line in this process, in an empty folder, with the oracles of the fuzz."""
    from oracles_of_use import Tool

    monkeypatch.chdir(tmp_path)
    return Tool()
