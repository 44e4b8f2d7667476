"""A doubt is told on every way with its line, in words that fit the form, alone and in twenties, whatever comes out."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from ways import ARGUMENTS, STREAMS, given, ways

if TYPE_CHECKING:
    from ways import Run

MAP_FROM_BASE = "{xyz: [1, 2, 3]}"
COMMANDS: dict[str, tuple[str, ...]] = {
    "convert": ("convert",),
    "invert": ("invert",),
    "compose": ("compose", MAP_FROM_BASE),
    "relative": ("relative", MAP_FROM_BASE),
    "apply": ("apply", "--transform", MAP_FROM_BASE),
    "mean": ("mean",),
}


class Doubt(NamedTuple):
    """A record that is doubted, the same as a row, what is said of it, and the line of its value in a block of YAML."""

    record: dict[str, Any]
    cells: dict[str, Any]
    words: str
    line: int


DOUBTS = {
    "a rotation vector": Doubt({"rotvec": [0, 0, 7]}, {"rotvec_x": 0, "rotvec_y": 0, "rotvec_z": 7}, r"rotvec 7 is more than a full turn", 4),
    "rpy": Doubt({"rpy": [0, 0, 90]}, {"roll": 0, "pitch": 0, "yaw": 90}, r"(rpy|yaw) 90 is more than a full turn", 4),
    "a quaternion": Doubt(
        {"xyzw": [0, 0, 0, 1.0005]}, {"qx": 0, "qy": 0, "qz": 0, "qw": 1.0005}, r"quaternion 0 0 0 1\.0005 has norm 1\.0005", 2
    ),
}
ANGLES = ("a rotation vector", "rpy")
FORMS = (*ARGUMENTS, *STREAMS)


def line_of(form: str, source: str, doubt: Doubt) -> int:
    """Say in which line the first value that is doubted stands."""
    blocks = form == "documents" or source.endswith(".yaml")
    return {"table": 2}.get(form, doubt.line if blocks else 1)


def cases(law: str) -> list[Any]:
    found = []
    for command in COMMANDS:
        for doubt in DOUBTS:
            for form in FORMS:
                if (command, form) == ("apply", "file") or (law == "forms" and command not in ("convert", "apply")):
                    continue
                if doubt == "rpy" and command not in ("convert", "mean"):
                    continue
                found.append((command, doubt, form))
    return found


@pytest.mark.parametrize(("command", "doubt", "form"), cases("line"))
def test_a_warning_has_its_line_on_every_way(run: Run, command: str, doubt: str, form: str) -> None:
    case = DOUBTS[doubt]
    for way in ways(form, case.record, case.cells):
        told = given(run, COMMANDS[command], way).err.splitlines()
        assert told, way
        assert told[0].startswith(f"frametool: warning: {way.source}:{line_of(form, way.source, case)}:"), way


@pytest.mark.parametrize(("command", "doubt", "form"), cases("words"))
def test_a_warning_says_the_value_in_words_that_fit_the_form(run: Run, command: str, doubt: str, form: str) -> None:
    case = DOUBTS[doubt]
    for way in ways(form, case.record, case.cells):
        told = given(run, COMMANDS[command], way).err
        assert re.search(case.words, told), way
        assert ("column" in told) == (form == "table" and doubt in ANGLES), way


@pytest.mark.parametrize(("command", "doubt", "form"), cases("forms"))
def test_a_warning_is_the_same_whatever_form_the_result_takes(run: Run, command: str, doubt: str, form: str) -> None:
    case = DOUBTS[doubt]
    for way in ways(form, case.record, case.cells):
        told = [given(run, (*COMMANDS[command], *option), way).err for option in ((), ("-f", "json"), ("-f", "yaml"), ("-f", "csv"))]
        assert told == told[:1] * 4, way
