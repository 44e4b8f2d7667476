"""A matrix without a key keeps its spelling only while it has the same numbers."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]


@pytest.mark.parametrize("right", ["{xyz: [1, 2, 3]}", "{xyz: [0, 0, 1e-9], rpy_deg: [0, 0, 90]}"])
@pytest.mark.parametrize("command", ["compose", "relative"])
def test_a_bare_matrix_that_gains_a_position_becomes_a_mapping(run: Run, command: str, right: str) -> None:
    matrix = "[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]"
    streamed = json.loads(run(command, "-", right, "-f", "json", stdin=matrix + "\n").out)
    single = json.loads(run(command, matrix, right, "-f", "json", "--to", "matrix,quaternion").out)
    rows = streamed["matrix"] if len(streamed["matrix"]) == 3 else [row[:3] for row in streamed["matrix"][:3]]
    assert rows == [row[:3] for row in single["matrix"][:3]]
    xyz = streamed["xyz"] if "xyz" in streamed else [row[3] for row in streamed["matrix"][:3]]
    assert xyz == [row[3] for row in single["matrix"][:3]]
    assert streamed.get("distance") == single.get("distance")


@pytest.mark.parametrize("right", ["{rpy_deg: [0, 0, 90]}", "{xyz: [0, 0, 0]}"])
@pytest.mark.parametrize("command", ["compose", "relative"])
def test_a_bare_matrix_that_gains_no_position_stays_a_rotation(run: Run, command: str, right: str) -> None:
    matrix = "[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]"
    streamed = json.loads(run(command, "-", right, "-f", "json", stdin=matrix + "\n").out)
    single = json.loads(run(command, matrix, right, "-f", "json", "--to", "matrix,quaternion").out)
    rows = streamed if command == "compose" else streamed["matrix"]
    assert rows == [row[:3] for row in single["matrix"][:3]]
    assert command == "compose" or (streamed["distance"] == 0.0 and "xyz" not in streamed)


def test_a_bare_matrix_as_angles_is_json(run: Run) -> None:
    outcome = run("convert", "--to", "rpy", "-f", "json", stdin="[[0, -1, 0], [1, 0, 0], [0, 0, 1]]\n")
    assert list(json.loads(outcome.out)) == ["rpy"]


SHEARED = ["[[1, 4e-4, 0], [0, 1, 0], [0, 0, 1]]", "[[1, 4e-4, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]"]


@pytest.mark.parametrize("matrix", SHEARED)
@pytest.mark.parametrize("command", ["convert", "invert"])
def test_a_bare_matrix_that_is_rounded_is_reported(run: Run, matrix: str, command: str) -> None:
    off = "matrix is orthonormal only to 0.0004 and was replaced by the nearest rotation"
    assert run(command, matrix).err == f"frametool: warning: argument:1:3: {off}\n"
    assert run(command, stdin=f"{matrix}\n").err == f"frametool: warning: stdin:1:3: {off}\n"
    assert run(command, matrix, "--normalize").status == 0


def test_a_matrix_in_blocks_of_yaml_becomes_a_mapping_too(run: Run) -> None:
    blocks = "- - 0\n  - -1\n  - 0\n- - 1\n  - 0\n  - 0\n- - 0\n  - 0\n  - 1\n"
    done = run("convert", "--in", "yaml", "--to", "rpy_deg", stdin=blocks)
    assert (done.status, done.out) == (0, "{rpy_deg: {roll: 0.0, pitch: 0.0, yaw: 90.0}}\n"), done.err
