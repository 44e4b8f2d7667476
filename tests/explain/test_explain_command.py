"""`--explain` on the command line: its spellings, where it is refused, where it is written, what it loads."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import console
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

CONVERT = ["convert", "--from", "rpy_deg", "10", "20", "30"]
POSE = "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"


@pytest.mark.parametrize("spelling", [["--explain"], ["--explain=text"]])
def test_the_option_may_stand_anywhere_with_and_without_its_form(spelling: list[str], run: Callable[..., Outcome]) -> None:
    outcomes = {run("invert", POSE, *spelling).out, run("invert", *spelling, POSE).out}
    assert len(outcomes) == 1
    assert outcomes.pop().startswith("1. Given\n")


@pytest.mark.parametrize(("form", "begins"), [("text", "1. Given\n"), ("markdown", "## b\\_from\\_a\n")])
def test_the_form_follows_the_equals_sign(form: str, begins: str, run: Callable[..., Outcome]) -> None:
    outcome = run("invert", POSE, f"--explain={form}", "-o", "sheet.out")
    assert (outcome.status, outcome.out) == (0, "")
    assert run("invert", POSE, f"--explain={form}").out.startswith(begins)
    assert run("invert", POSE, f"--explain={form}", "-o", "sheet.out").status == 5
    assert run("invert", POSE, f"--explain={form}", "-o", "sheet.out", "--force").status == 0


@pytest.mark.parametrize(("arguments", "message"), [
    ([*CONVERT, "--explain", "--format", "yaml"], "--explain writes text or markdown, not yaml"),
    ([*CONVERT, "--explain", "-o", "x.csv"], "--explain writes text or markdown, not csv"),
    ([*CONVERT, "--explain=html"], "'html' is not one of 'text', 'markdown'"),
    ([*CONVERT, "--explain", "--precision", "0"], "--precision counts significant digits with --explain; give 1 or more, or full"),
    (["convert", "--explain"], "standard input is a stream; --explain derives one record"),
    (["convert", "-", "--explain"], "standard input is a stream; --explain derives one record"),
    (["convert", "-i", "rows.csv", "--explain"], "standard input is a stream; --explain derives one record"),
    (["convert", POSE, POSE, "--explain"], "--explain derives one pose, found 2"),
    (["compose", "-", POSE, "--explain"], "standard input is a stream"),
    (["invert", "--explain"], "standard input is a stream"),
    (["relative", POSE, "--explain"], "standard input is a stream"),
    (["relative", "--consecutive", "--explain"], "--consecutive and --explain exclude each other"),
    (["interpolate", POSE, POSE, "0", "1", "--explain"], "--explain derives one fraction, found 2"),
    (["lookup", "tree.yaml", "a", "b", "--times", "0:1:1", "--explain"], "--times and --explain exclude each other"),
    (["lookup", "tree.yaml", "--target-column", "a", "b", "--explain"], "--target-column and --explain exclude each other"),
    (["apply", "--transform", POSE, "--explain"], "a stream, or several records; --explain derives one record"),
    (["apply", "--transform", POSE, "1", "2", "3", "4", "5", "6", "--explain"], "a stream, or several records"),
    (["sim", "follow", "--explain"], "--explain needs --explain-step"),
    (["sim", "follow", "--explain-step", "1", "--format", "csv"], "--explain-step writes text, not csv"),
    (["sim", "follow", "--explain-step", "1", "--emit", "tf", "--plot", "a.svg"], "--emit, --plot have no effect here"),
])  # fmt: skip
def test_what_is_no_single_record_in_words_is_misuse(arguments: list[str], message: str, run: Callable[..., Outcome]) -> None:
    outcome = run(*arguments, files={"tree.yaml": "frames: {a: {b: {xyz: [1, 2, 3]}}}", "rows.csv": "x,y,z\n1,2,3\n"})
    assert (outcome.status, outcome.out) == (2, "")
    assert message in outcome.err
    assert outcome.err.count("\n") == 1


@pytest.mark.parametrize("arguments", [
    [*CONVERT, "--precision", "4"], ["convert", POSE, "--to", "euler_deg:all"], ["convert", "--axes", "ned_from_enu", POSE, "--to", "matrix"],
    ["convert", *CONVERT[1:], "--find", "30,20,10", "--deg"], ["sim", "follow", "--explain-step", "2", "--precision", "full", "--followers", "3"],
])  # fmt: skip
def test_other_options_keep_their_meaning(arguments: list[str], run: Callable[..., Outcome]) -> None:
    explain = [] if arguments[0] == "sim" else ["--explain"]
    outcome = run(*arguments, *explain)
    assert (outcome.status, outcome.err) == (0, "")


def test_a_derivation_in_a_file_is_not_taken_for_its_pose(run: Callable[..., Outcome], tmp_path: Path) -> None:
    assert run(*CONVERT, "--explain", "-o", str(tmp_path / "how.md")).err == ""


def test_a_warning_is_told_once(run: Callable[..., Outcome]) -> None:
    for arguments in (["convert", "{xyzw: [0, 0, 0, 1.0005]}"], ["invert", "{xyzw: [0, 0, 0, 1.0005]}"], ["convert", "--from", "xyzw", "0", "0", "0", "1.0005"]):
        assert run(*arguments, "--explain").err.count("normalised") == 1


def test_a_covariance_is_not_derived_and_that_is_told(run: Callable[..., Outcome]) -> None:
    entries = f"{{xyz: [1, 2, 3], covariance: {[0.01 * (i == j) for i in range(6) for j in range(6)]}}}"
    for unsure in ("{xyz: [1, 2, 3], sigma: {xyz: 0.1}}", entries, "{xyz: [1, 2, 3], sigma: {xyz: 0.1}, inverse: true}"):
        for arguments in (["convert", unsure], ["invert", unsure], ["compose", POSE, unsure], ["relative", unsure, POSE]):
            told = run(*arguments, "--explain")
            assert (told.status, told.err) == (0, "frametool: warning: argument: --explain derives the pose alone; its covariance is left out\n")


def test_a_place_without_a_rotation_is_no_pose_to_derive(run: Callable[..., Outcome]) -> None:
    assert "--explain derives one pose, found 0;" in run("convert", "{lat: 1, lon: 2, alt: 3}", "--explain").err


def loaded(*arguments: str) -> set[str]:
    """Name the modules that a command loads."""
    code = f"import sys; from frametool.cli import run; run({list(arguments)!r}); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=console.ROOT)
    return set(done.stderr.splitlines()[-1].split())


def test_a_derivation_loads_no_numpy_and_without_one_its_modules_are_not_loaded() -> None:
    with_json = '{"xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}'
    for arguments in (CONVERT, ["compose", with_json, with_json], ["invert", with_json], ["sim", "follow", "--duration", "0.1"]):
        plain = loaded(*arguments)
        explained = loaded(*arguments, *(["--explain-step", "0"] if arguments[0] == "sim" else ["--explain"]))
        assert not {name for name in plain if name.startswith("frametool.explain")}
        assert "frametool.explain.run" in explained
        assert "numpy" not in explained


ODD = "{xyz: [1.23456789012345, 2.3456789012, 3.1], rpy_deg: [10.1, 20.2, 30.3]}"
OTHER = "{xyz: [11.23456789012345, 22.3456789012, 33.1], rpy_deg: [110.1, 20.2, 70.3]}"


@pytest.mark.parametrize(
    "arguments",
    [("convert", ODD, "--to", notation) for notation in ("matrix", "rpy_deg", "six_d", "mrp", "axis_angle", "rotvec", "euler:rzxz")]
    + [("compose", ODD, OTHER, "--to", "matrix"), ("relative", ODD, OTHER), ("invert", ODD), ("apply", "--transform", ODD, "1.1", "2.123456789", "3")],
)  # fmt: skip
def test_a_derivation_with_all_digits_fits_a_terminal(run: Callable[..., Outcome], arguments: tuple[str, ...]) -> None:
    lines = run(*arguments, "--explain", "--precision", "full").out.splitlines()
    assert max(map(len, lines)) <= 80
