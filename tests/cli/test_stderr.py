"""Talk beside the data: one way to stderr, sentences or objects, in the order in which things were found."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import frametool
from frametool.errors import FrametoolWarning, heard_by, overheard, shown, warn

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

PACKAGE = Path(frametool.__file__).parent
TALKING = {"echo", "secho", "warn", "catch_warnings", "print"}  # as names of functions
ALLOWED = {
    ("errors.py", "warn"), ("cli/sink.py", "print"), ("view/text.py", "print"),
    ("cli/__init__.py", "sys.stderr.write"),  # where no module can be opened, the voice cannot either
    ("view/pictures.py", "catch_warnings"),  # what a drawing library says of fonts
    ("cli/commands/batch.py", "catch_warnings"),  # filters of the program that runs a command are put back
    ("view/frame_scene.py", "catch_warnings"),  # what Python says of an expression
    ("formats/trees/launch.py", "catch_warnings"),  # what Python says of a file of somebody else's
}  # fmt: skip
MOVE = ["apply", "--transform", "{xyz: [1, 0, 0]}"]
LINES = '{"xyz": [1, 2, 3]}\n{"xyz": [1, "?", 3]}\n{"xyz": [4, 5, 6]}\n'


def calls(path: Path) -> set[str]:
    """Name the functions by which a file could write to stderr without `write_lines`."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found |= {node.func.id} & {"print"}
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            home = ast.unparse(node.func.value)
            found |= {node.func.attr} & TALKING if home in ("click", "warnings", "console") else set()
            found |= {f"{home}.write"} & {"sys.stderr.write", "sys.stdout.write"} if node.func.attr == "write" else set()
    return found


def test_nothing_is_printed_but_by_the_sink_and_the_voice() -> None:
    found = {(str(path.relative_to(PACKAGE)), name) for path in PACKAGE.rglob("*.py") for name in calls(path)}
    assert found <= ALLOWED


@pytest.mark.parametrize("on_error", ["skip", "null", "stop"])
def test_bad_records_are_objects_where_json_is_asked_for(run: Run, on_error: str) -> None:
    status, _, err = run(*MOVE, "--format", "json", "--on-error", on_error, stdin=LINES)
    first, *rest = [json.loads(line) for line in err.splitlines()]
    assert (first["source"], first["line"], "'?'" in first["message"]) == ("stdin", 2, True)
    assert status == (1 if on_error == "stop" else 3)
    fate = "skipped" if on_error == "skip" else "without result"
    if on_error != "stop":
        assert rest == [
            {"error": "rows_skipped", "message": f"stdin: 1 of 3 rows {fate}", "source": "stdin", "bad": 1, "rows": 3}
        ]


def test_misuse_is_an_object_where_json_is_asked_for(run: Run) -> None:
    status, out, err = run("lookup", "-f", "json")
    assert (status, out) == (2, "")
    assert json.loads(err)["error"] == "misused"


def test_rows_and_their_warnings_are_told_in_the_order_of_the_lines(run: Run) -> None:
    rows = "roll,pitch,yaw\n0,?,0\n0,0,90\n0,0,?\n"
    err = run("convert", "--to", "quaternion", "--on-error", "skip", stdin=rows).err.splitlines()
    assert [line.split("stdin:")[1].split(":")[0] for line in err[:3]] == ["2", "3", "4"]


def test_the_innermost_listener_hears_a_warning() -> None:
    heard: list[tuple[str, str]] = []
    with heard_by(lambda *warning: heard.append(warning)):
        warn("outer")
        assert overheard(lambda: warn("inner", rule="rounded"))[1] == [("rounded", "inner")]
    assert heard == [("outer", "")]
    with pytest.warns(FrametoolWarning, match="nobody listens"):
        warn("nobody listens")


@pytest.mark.parametrize(
    "text", ["", "a", "'", "\"'" * 40, "\x1b[31m" * 20, "x" * 60, "x" * 10**6, "\0" * 61, "\U0010ffff" * 30, "\udcff"]
)
def test_what_is_shown_is_one_short_printable_line(text: str) -> None:
    assert shown(text).isprintable()
    assert len(shown(text).removesuffix(f"... ({len(text)} characters)")) <= 60
    if len(repr(text)) <= 60:
        assert shown(text) == repr(text)
