"""What the printed digits of a rotation explain is normalised without a word; what they do not is told as before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

EXPLAINED = ["0 0 0.7071 0.7071", "0 0 7.071e-1 0.7071", "0.5774 0.5774 0.5774 0.0"]
NOT_EXPLAINED = ["0 0 0.71 0.71", "0.5 0.5 0.5 0.4", "0 0 0.7070 0.7070", "0 0 0.70700 0.70710", "0 0 1 0.02"]


def everywhere(run: Run, numbers: str) -> list[Outcome]:
    """Convert a quaternion as arguments, as a mapping, as a row of a table, and as records, one and many."""
    words = numbers.split()
    row, record = ",".join(words), f'{{"xyzw": [{", ".join(words)}]}}\n'
    return [
        run("convert", "--from", "xyzw", *words, "--to", "matrix"),
        run("convert", f"{{xyzw: [{row}]}}", "--to", "matrix"),
        run("convert", "--to", "matrix", stdin=f"qx,qy,qz,qw\n{row}\n"),
        run("convert", "--to", "matrix", stdin=record),
        run("convert", "--to", "matrix", stdin=record * 40),
    ]


@pytest.mark.parametrize("numbers", EXPLAINED)
def test_what_half_a_unit_of_the_last_digits_can_make_needs_no_word(run: Run, numbers: str) -> None:
    assert [(each.status, each.err) for each in everywhere(run, numbers)] == [(0, "")] * 5


@pytest.mark.parametrize("numbers", NOT_EXPLAINED)
def test_what_rounding_does_not_explain_is_told(run: Run, numbers: str) -> None:
    for each in everywhere(run, numbers):
        assert each.status == 0
        assert "normalised" in each.err


@pytest.mark.parametrize(("entry", "said"), [("0.866", ""), ("0.8658", "replaced by the nearest rotation")])
def test_the_rows_of_a_matrix_count_alike(run: Run, entry: str, said: str) -> None:
    outcome = run("convert", f"{{matrix: [[{entry}, -0.5000, 0], [0.5000, {entry}, 0], [0, 0, 1]]}}")
    assert (outcome.status, said in outcome.err, outcome.err == "") == (0, True, said == "")


def test_a_mirror_is_no_matter_of_digits(run: Run) -> None:
    table = "r11,r12,r13,r21,r22,r23,r31,r32,r33\n1,0,0,0,1,0,0,0,-1\n"
    for done in (run("convert", "{matrix: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}"), run("convert", "--to", "rpy", stdin=table)):
        assert (done.status, "mirrored" in done.err, "few digits" in done.err) == (1, True, False)
