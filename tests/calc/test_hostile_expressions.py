"""Hostile expressions end in one line, soon; nothing is run as Python; light commands stay light."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import frametool
from frametool.calc.parser import DEEPEST, LONGEST
from frametool.errors import FrametoolError

if TYPE_CHECKING:
    from collections.abc import Callable

ROOM = Path(frametool.__file__).parent / "calc"
ROBOT = str(Path(__file__).parents[2] / "examples" / "robot.yaml")
TOO_DEEP = f"nested deeper than {DEEPEST} levels"
HOSTILE = {
    "(" * 10_000 + "1" + ")" * 10_000: TOO_DEEP,
    "(" * 30_000: TOO_DEEP,
    "[" * 10_000: TOO_DEEP,
    "-" * 10_000 + "1": TOO_DEEP,
    "2^" * 10_000 + "1": TOO_DEEP,
    "inv(" * 10_000: TOO_DEEP,
    "{xyz: " + "[" * 5_000 + "]" * 5_000 + "}": "nested deeper than 990 levels",
    "1+" * 500_000 + "1": f"an expression of 1000001 characters; the most are {LONGEST}",
    "x" * 100_000: f"an expression of 100000 characters; the most are {LONGEST}",
    "1e999": "'1e999' is not finite",
    "1e308 * 1e308": "the result is not finite",
    "1e200 ^ 2": "the result is not finite",
    "9" * 60_000: "... (60000 characters) is not finite",
    "a-" * 20_000 + "a<-b": "no tree to look up in",
    '"' * 9_999: "a quote is not closed",
    "{" * 20_000: "a { is not closed",
    "norm(exp([0, 0, 0, 1e300, 0, 0]))": "",
    "angle({rpy_deg: [1e300, 0, 0]})": "",
}  # fmt: skip


@pytest.mark.parametrize(("text", "told"), HOSTILE.items(), ids=[f"{text[:12]} {len(text)}" for text in HOSTILE])
def test_a_hostile_expression_is_refused_in_one_line(text: str, told: str, run: Callable[..., Any]) -> None:
    done = run("calc", stdin=text + "\n")
    assert done.status in ((1, 2) if told else (0, 1))
    first, *rest = done.err.splitlines() or [""]
    assert told in first
    assert len(first) < 300
    assert len(rest) in (0, 2)
    assert all(len(line) <= 84 for line in rest)


def test_what_is_long_but_flat_is_calculated() -> None:
    assert frametool.calc("1" + "+1" * 30_000) == 30_001
    assert frametool.calc("[1, 2, 3]" + " in a" * 10_000).target == "a"
    assert frametool.calc("(" * 99 + "7" + ")" * 99) == 7
    assert frametool.calc("2 * (1 + " * 99 + "0" + ")" * 99) == 2.0**100 - 2


@pytest.mark.parametrize("path", sorted(ROOM.rglob("*.py")), ids=lambda path: path.name)
def test_nothing_is_run_as_python(path: Path) -> None:
    called = {node.func.id for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    assert not called & {"eval", "exec", "compile", "__import__"}


@pytest.mark.parametrize(("arguments", "unloaded"), [
    (["1mm + 2 * 3m"], {"numpy", "rich", "yaml", "readline"}),
    (['inv({"xyz": [1, 2, 3]}) ^ 0.5'], {"numpy", "rich", "yaml"}),
    (["--tree", ROBOT, "dist(map<-tool, map<-lidar)", "(map<-tool) * [1, 2, 3]", "-f", "text"], {"numpy", "rich"}),
])  # fmt: skip
def test_single_expressions_load_nothing_heavy(arguments: list[str], unloaded: set[str]) -> None:
    code = f"import sys; from frametool.cli import run; status = run({['calc', *arguments]!r}); print(status, *sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOM.parent.parent)
    status, *names = done.stderr.split()
    assert status == "0"
    assert not unloaded & set(names)


def test_python_is_refused_what_is_no_value() -> None:
    for value in (None, "text", object(), float("nan"), [1, "a", 3], True):
        with pytest.raises(FrametoolError):
            frametool.calc("x", x=value)
    with pytest.raises(FrametoolError, match="has a meaning of its own"):
        frametool.calc("1", inv=3)
