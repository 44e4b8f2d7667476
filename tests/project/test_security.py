"""What SECURITY.md promises: files are read, nothing in them is run, no entity is expanded, no connection is made."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import frametool

if TYPE_CHECKING:
    from collections.abc import Callable

MODULES = sorted(Path(frametool.__file__).parent.rglob("*.py"))
DANGEROUS = {
    "code", "ctypes", "ftplib", "http", "marshal", "pickle", "runpy", "shelve", "smtplib", "socket", "ssl", "subprocess",
    "telnetlib", "urllib", "xmlrpc",
}  # fmt: skip
RUNS = r"__import__|compile|eval|exec|os\.(?:system|popen|exec\w+|spawn\w+|posix_spawn\w*)|np\.load|yaml\.\w*load\w*"


def dangers(path: Path) -> set[str]:
    """Name what a module imports and calls that runs programs or texts, unpickles or connects."""
    nodes = [*ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    imported = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    called = {ast.unparse(node.func) for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute)}
    return {name.partition(".")[0] for name in imported} & DANGEROUS | {name for name in called if re.fullmatch(RUNS, name)}


def test_no_module_runs_programs_or_texts_unpickles_or_connects() -> None:
    assert {str(path): found for path in MODULES if (found := dangers(path))} == {}


ATTEMPTS = {
    "tag.yaml": "frames: {base: {lidar: {xyz: !!python/object/apply:os.mkdir [made]}}}\n",
    "whole.yaml": "!!python/object/apply:os.mkdir [made]\n",
    "robot.launch.py": "import os\nos.mkdir('made')\ndef generate_launch_description():\n    return os.mkdir('made')\n",
    "entity.urdf": '<!DOCTYPE robot [<!ENTITY e SYSTEM "secret.txt">]><robot name="r"><link name="&e;"/></robot>\n',
    "header.npy": "\x93NUMPY\x01\x00\x30\x00{'descr': __import__('os').mkdir('made')        }\n",
}


@pytest.mark.parametrize("name", ATTEMPTS)
def test_nothing_in_a_file_is_run_or_fetched(name: str, run: Callable[..., Any], tmp_path: Path) -> None:
    files = {name: ATTEMPTS[name].encode("latin-1"), "secret.txt": b"a secret"}
    for command in ("tree", "check", "convert"):
        done = run(command, *["-i"] * (command == "convert"), name, files=files)
        assert "Traceback" not in done.err
        assert "a secret" not in done.out + done.err
    assert {path.name for path in tmp_path.iterdir()} == {*files}
