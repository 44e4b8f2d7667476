"""`lookup --covariance`, and what every other command does with a tree that has sigmas."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from console import ROOT

from frametool.cli.commands.lookup import WITH_COVARIANCE
from frametool.formats.rows import csv as csv_form
from frametool.formats.table import holds, writers
from frametool.grammar.covariance import columns
from frametool.grammar.result import Style
from frametool.view import text as text_for_people

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

STANDING = """\
frames:
  - {name: base, parent: map, xyz: [1, 2, 3], rpy_deg: [10, 20, 30], inverse: true, sigma: {xyz: 0.01, rpy_deg: 1}}
  - {name: arm, parent: base, xyz: [1, 0, 0]}
  - {name: tool, parent: arm, xyz: [0, 0, 0.5], sigma: {xyz_mm: [2.1, 3, 1.1], rpy_deg: [0.12, 0.1, 0.2]}}
  - {name: box, parent: map, xyz: [4, 0, 0]}
"""
MOVING = STANDING + """\
  - name: cart
    parent: map
    sigma: {xyz_mm: 3, rpy_deg: 0.1}
    samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 1, xyz: [1, 0, 0], rpy: [0, 0, 1]}, {stamp: 2, xyz: [2, 0, 1]}]
"""
EXACT = "frames: [{name: b, parent: a, xyz: [1, 0, 0]}, {name: c, parent: b, rpy: [0, 0, 1], stamp: 4}]\n"
FILES = {"robot.yaml": STANDING, "drive.yaml": MOVING, "exact.yaml": EXACT}
INDEPENDENT = "frametool: edges count as independent"


def entries_of(text: str) -> list[float]:
    """Return the covariance of a result in JSON."""
    return list(json.loads(text)["covariance"])


def test_a_lookup_carries_covariances_and_says_what_it_takes_for_granted(run: Run) -> None:
    done = run("lookup", "robot.yaml", "map", "tool", "--covariance", "-f", "json", files=FILES)
    assert (done.status, done.err) == (0, f"{INDEPENDENT}; 1 of 3 has no sigma and counts as exact\n")
    matrix = np.reshape(entries_of(done.out), (6, 6))
    assert np.array_equal(matrix, matrix.T)
    assert "-0.0," not in done.out
    done = run("lookup", "robot.yaml", "box", "tool", "--covariance", "-f", "json")
    assert done.err == f"{INDEPENDENT}; 2 of 4 have no sigma and count as exact\n"
    assert entries_of(done.out) == pytest.approx(matrix.ravel().tolist(), rel=1e-12, abs=1e-18)  # box is exact
    done = run("lookup", "robot.yaml", "arm", "tool", "--covariance", "-f", "yaml", "--quiet")
    assert (done.err, done.out.count("covariance: [4.4")) == ("", 1)
    assert run("lookup", "robot.yaml", "arm", "tool", "--covariance").err == f"{INDEPENDENT}\n"
    done = run("lookup", "robot.yaml", "tool", "tool", "--covariance", "-f", "json")
    assert (entries_of(done.out), done.err) == ([0.0] * 36, "")


def test_the_text_shows_six_sigmas_in_one_line(run: Run) -> None:
    done = run("lookup", "robot.yaml", "arm", "tool", "--covariance", "-f", "text", files=FILES)
    assert done.out.splitlines()[-1] == "  sigma          2.1 mm 3.0 mm 1.1 mm 0.12 deg 0.10 deg 0.20 deg"
    wide = "{name: b, parent: a, xyz: [1, 0, 0], sigma: {xyz: [12.345, 1e-9, 0.12345], rpy_deg: [1e-7, 11.11, 1e-6]}}"
    done = run("lookup", wide, "a", "b", "--covariance", "-f", "text")
    assert done.out.splitlines()[-2:] == [
        "  sigma          12 m 1.0e-06 mm 123 mm",
        "                 1.0e-07 deg 11 deg 1.0e-06 deg",
    ] or done.out.splitlines()[-1] == "  sigma          12 m 1.0e-06 mm 123 mm 1.0e-07 deg 11 deg 1.0e-06 deg"
    assert max(map(len, done.out.splitlines())) <= 80


def test_one_many_and_rows_have_the_same_bytes(run: Run) -> None:
    times = ["0.25", "0.5", "1.75", "0"]
    one = [run("lookup", "drive.yaml", "tool", "cart", "--at", at, "--covariance", "-f", "csv", files=FILES) for at in times]
    many = run("lookup", "drive.yaml", "tool", "cart", "--times", ",".join(times), "--covariance", "-f", "csv")
    assert many.out.splitlines()[1:] == [each.out.splitlines()[1] for each in one]
    assert many.err == one[0].err == f"{INDEPENDENT}; 1 of 4 has no sigma and counts as exact\n"
    rows = run(
        "lookup", "drive.yaml", "--target-column", "to", "--source-column", "from", "--at", "0.25", "--covariance",
        stdin="to,from\ntool,cart\nbox,box\ntool,cart\n",
    )  # fmt: skip
    table = list(csv.DictReader(io.StringIO(rows.out)))
    single = next(csv.DictReader(io.StringIO(one[0].out)))
    assert list(table[0]) == ["to", "from", *"xyz", "qx", "qy", "qz", "qw", *columns()]
    assert [table[0][name] for name in columns()] == [single[name] for name in columns()]
    assert table[0] == table[2]
    assert {table[1][name] for name in columns()} == {"0.0"}
    assert rows.err == one[0].err


def test_standing_trees_and_changing_parents_at_many_times(run: Run) -> None:
    done = run("lookup", "robot.yaml", "map", "tool", "--times", "1,2", "--covariance", "-f", "json", files=FILES)
    first, second = map(entries_of, done.out.splitlines())
    assert first == second == entries_of(run("lookup", "robot.yaml", "map", "tool", "--covariance", "-f", "json").out)
    tree = (
        "{frames: [{name: a, parent: w, xyz: [1, 0, 0], sigma: {rpy_deg: 1}}, {name: b, parent: w, xyz: [1, 0, 0], sigma: {xyz: 0.1}},"
        "{name: c, parent: a, sigma: {xyz: 0.01}, samples: [{stamp: 0, xyz: [0, 1, 0]}, {stamp: 1, xyz: [0, 2, 0]},"
        "{stamp: 2, parent: b, xyz: [0, 3, 0]}, {stamp: 3, parent: b, xyz: [0, 4, 0]}]}]}"
    )
    done = run("lookup", tree, "w", "c", "--times", "3,0.5,2,1", "--covariance", "-f", "json")
    for at, line in zip(("3", "0.5", "2", "1"), done.out.splitlines(), strict=True):
        assert line + "\n" == run("lookup", tree, "w", "c", "--at", at, "--covariance", "-f", "json").out
    assert entries_of(done.out.splitlines()[0])[0] == pytest.approx(0.0101)
    assert done.err == f"{INDEPENDENT}\n"


def test_rows_in_json_have_the_key_and_null_where_there_is_no_result(run: Run) -> None:
    done = run(
        "lookup", "robot.yaml", "arm", "--source-column", "s", "--covariance", "--in", "csv", "-f", "json", "--on-error", "null",
        stdin="s\ntool\nnobody\n", files=FILES,
    )  # fmt: skip
    rows = list(map(json.loads, done.out.splitlines()))
    assert done.status == 3
    assert rows[0]["covariance"] == entries_of(run("lookup", "robot.yaml", "arm", "tool", "--covariance", "-f", "json").out)
    assert (rows[1]["covariance"], rows[1]["xyz"]) == (None, None)


def test_columns_of_numbers_hold_covariances(run: Run, tmp_path: Path) -> None:
    run("lookup", "drive.yaml", "map", "cart", "--times", "0,1", "--covariance", "-f", "npy", "-o", "found.npy", files=FILES)
    found = np.load(tmp_path / "found.npy")
    assert set(columns()) <= set(found.dtype.names)
    assert found["c11"].tolist() == pytest.approx([9e-6, 9e-6])


def test_no_digits_of_a_covariance_are_dropped(run: Run) -> None:
    whole = run("lookup", "robot.yaml", "arm", "tool", "--covariance", "-f", "json", files=FILES)
    for form in ("json", "csv", "yaml"):
        done = run("lookup", "robot.yaml", "arm", "tool", "--covariance", "-f", form, "--precision", "2")
        assert repr(entries_of(whole.out)[0]) in done.out


@pytest.mark.parametrize("form", writers("poses"))
def test_a_form_has_a_place_for_covariances_or_says_so(form: str, run: Run) -> None:
    done = run("lookup", "robot.yaml", "map", "tool", "--covariance", "-f", form, "-o", "out", files=FILES)
    if form in (*WITH_COVARIANCE, "text") or holds(form, "arrays"):
        assert (done.status, done.err.splitlines()[0][: len(INDEPENDENT)]) == (0, INDEPENDENT)
    else:
        assert done.status == 2
        assert done.err.startswith(f"frametool: lookup: {form} has no place for a covariance; json, yaml, csv have;")


REFUSED = {
    "explain": (["--explain"], 2, "--covariance and --explain exclude each other"),
    "across": (
        ["--fixed", "map", "--source-at", "0"], 2,
        "--covariance and --fixed exclude each other",
    ),
    "far": (["--at", "9"], 4, "no data for map -> cart at 9.000000000"),
}  # fmt: skip


@pytest.mark.parametrize(("more", "status", "message"), REFUSED.values(), ids=REFUSED)
def test_what_has_no_answer_is_refused_in_a_line(more: list[str], status: int, message: str, run: Run) -> None:
    done = run("lookup", "drive.yaml", "map", "cart", "--covariance", *more, files=FILES)
    assert (done.status, done.out) == (status, "")
    assert message in done.err.splitlines()[0]


def test_a_path_without_any_sigma_has_no_covariance(run: Run) -> None:
    none = "frametool: no edge between map and box has a sigma or a covariance\n"
    done = run("lookup", "robot.yaml", "map", "box", "--covariance", files=FILES)
    assert (done.status, done.out, done.err) == (1, "", none)
    done = run("lookup", "robot.yaml", "map", "box", "--covariance", "--times", "0,1", "-f", "json")
    assert (done.status, done.out) == (1, "")
    assert "no edge between map and box has a sigma" in done.err
    done = run("lookup", "robot.yaml", "map", "--source-column", "s", "--covariance", "--on-error", "skip", stdin="s\nbox\ntool\nbase\n")
    assert (done.status, len(done.out.splitlines())) == (3, 3)
    assert "no edge between map and box has a sigma or a covariance (row skipped)" in done.err


def test_wide_turns_are_told_once(run: Run) -> None:
    tree = "{frames: [{name: a, parent: w, xyz: [1, 0, 0], sigma: {rpy: 0.31}}, {name: b, parent: a, xyz: [1, 0, 0], sigma: {rpy: 0.05}}]}"
    told = "frametool: warning: sigma of a turn is {} rad: the first order is a few per cent off above 0.2\n"
    assert run("lookup", tree, "w", "a", "--covariance").err.startswith(told.format("0.31"))
    done = run("lookup", tree, "w", "--source-column", "s", "--covariance", stdin="s\na\nb\na\n")
    assert done.err.count("sigma of a turn") == 1
    assert run("lookup", tree, "a", "b", "--covariance").err == f"{INDEPENDENT}\n"


def test_sigmas_that_are_not_used_are_told_once(run: Run) -> None:
    told = "frametool: sigmas of robot.yaml not used (--covariance)\n"
    assert run("lookup", "robot.yaml", "map", "tool", files=FILES).err == told
    assert run("lookup", "robot.yaml", "map", "tool", "--times", "1,2").err == told
    assert run("lookup", "robot.yaml", "map", "--source-column", "s", stdin="s\nbox\ntool\n").err == told
    assert run("lookup", "robot.yaml", "map", "tool", "--quiet").err == ""
    assert run("lookup", "exact.yaml", "a", "c").err == ""
    assert run("apply", "robot.yaml", "map", "tool", "1", "2", "3").err == told
    assert run("apply", "robot.yaml", "map", "tool", stdin="x,y,z\n1,2,3\n4,5,6\n").err.count(told) == 1


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
def test_a_tree_written_and_read_again_has_the_same_bits(name: str, run: Run) -> None:
    first = run("tree", name, "-f", "yaml", files=FILES)
    assert (first.err, first.out.count("covariance: [")) == ("", 2 + (name == "drive.yaml"))
    assert run("tree", "-", "-f", "yaml", stdin=first.out).out == first.out
    as_json = run("tree", name, "-f", "json")
    assert run("tree", "-", "-f", "yaml", stdin=as_json.out).out == first.out
    assert run("tree", "-", "-f", "yaml", "--with", name, stdin=first.out).out == first.out
    rounded = run("tree", name, "-f", "json", "--precision", "2")
    assert [each.get("covariance") for each in json.loads(rounded.out)["frames"]] == [
        each.get("covariance") for each in json.loads(as_json.out)["frames"]
    ]
    asked = ["map", "tool", "--covariance", "-f", "json", "--quiet"]
    assert run("lookup", "-", *asked, stdin=first.out).out == run("lookup", name, *asked).out


def test_a_tree_at_a_time_keeps_its_covariances_and_the_drawing_shows_the_largest(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    done = run("tree", "drive.yaml", "--at", "0.5", "-f", "json", files=FILES)
    assert sum("covariance" in each for each in json.loads(done.out)["frames"]) == 3
    done = run("tree", "drive.yaml", "-f", "text")
    assert done.err == ""
    assert "xyz 0 0 0.5  rpy_deg 0 0 0  ±3.0 mm 0.20 deg\n" in run("tree", "{frames: {a: {b: {xyz: [0, 0, 0.5], "
        "sigma: {xyz_mm: [2.1, 3, 1.1], rpy_deg: [0.12, 0.1, 0.2]}}}}}", "-f", "text").out  # fmt: skip
    assert max(map(len, done.out.splitlines())) <= 80
    assert "±" not in run("tree", "exact.yaml", "-f", "text").out


@pytest.mark.parametrize("form", [form for form in writers("tree", "trajectory") if form not in ("yaml", "json", "text")])
def test_forms_that_cannot_hold_covariances_say_so_once(form: str, run: Run) -> None:
    done = run("tree", "robot.yaml", "-f", form, "-o", "robot", files=FILES)
    assert done.err.count(f"frametool: warning: {form}: covariances left out\n") == 1
    assert done.err.count("covariances left out") == 1
    assert "covariances" not in run("tree", "exact.yaml", "-f", form, "-o", "exact").err


def test_commands_that_carry_none_say_so_once(run: Run) -> None:
    told = "frametool: warning: covariances left out: {} has none\n"
    done = run("calc", "--tree", "robot.yaml", "(map<-tool)", "(map<-arm) * {xyz: [1, 2, 3], sigma: {xyz: 1}}", files=FILES)
    assert (done.status, done.err) == (0, told.format("calc"))
    done = run("calc", "{xyz: [1, 2, 3], sigma: {xyz: 1}}")
    assert (done.status, done.err) == (0, told.format("calc"))
    done = run("calc", "--tree", "robot.yaml", "(map<-tool) * row", stdin='{"x": 1, "y": 2, "z": 3}\n[1, 2, 3]\n' * 2)
    assert done.err.count("covariances left out") == 1
    assert run("echo", "drive.yaml", "map", "cart", "--limit", "1").err == told.format("echo")
    assert "static2: covariances left out" in run("static", "robot.yaml").err
    assert run("view", "robot.yaml").status == 0


def test_trees_that_differ_in_covariances_only_are_the_same_and_that_is_told(run: Run) -> None:
    other = STANDING.replace("xyz_mm: [2.1", "xyz_mm: [2.2")
    done = run("diff", "robot.yaml", "other.yaml", files=FILES | {"other.yaml": other})
    assert (done.status, done.err) == (0, "frametool: covariances are not compared; those of tool differ\n")
    assert run("diff", "robot.yaml", "robot.yaml").err == ""


def test_check_takes_sigmas_and_finds_what_is_wrong_with_them(run: Run) -> None:
    assert run("check", "drive.yaml", files=FILES).status == 0
    done = run("check", "bad.yaml", files={"bad.yaml": STANDING.replace("xyz: 0.01", "xyz: -0.01")})
    assert done.status == 1
    assert "bad.yaml:2:" in done.out + done.err
    assert "sigma is negative: -0.01" in done.out + done.err


def test_a_lookup_without_covariances_loads_nothing_of_them(tmp_path: Path) -> None:
    (tmp_path / "exact.yaml").write_text(EXACT)
    code = "import sys; from frametool.cli import run; run(['lookup', 'exact.yaml', 'a', 'b']); print(*sys.modules)"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path, env=environment)
    loaded = {*done.stdout.splitlines()[-1].split()}
    assert not {name for name in loaded if "uncertain" in name or "covariance" in name}
    assert "numpy" not in loaded  # with covariances it multiplies matrices


def test_the_covariance_of_a_point_is_three_sigmas_and_nine_columns() -> None:
    record = {"frame": "map", "point": [1.0, 2.0, 3.0], "covariance": [4.41e-6, 0.0, 0.0, 0.0, 9e-6, 0.0, 0.0, 0.0, 1.21e-6]}
    text = text_for_people.write_points([record], Style("text"))
    assert text == "1.0  2.0  3.0  m in map  sigma 2.1 mm 3.0 mm 1.1 mm\n"
    head, row = csv_form.write_points([record], Style("csv")).splitlines()
    assert head.split(",") == ["frame", *"xyz", *columns(9)]
    assert row.startswith("map,1.0,2.0,3.0,4.41e-06,0.0,")
    unknown = text_for_people.write_points([record | {"covariance": [-1.0] + [0.0] * 8}], Style("text"))
    assert unknown == "1.0  2.0  3.0  m in map  sigma unknown\n"


def test_a_sigma_reaches_lookups_of_a_batch_and_of_merged_trees(run: Run) -> None:
    tree = "{name: cam, parent: tool, xyz: [0, 0, 1], sigma: {xyz: 0.5}}"
    done = run("lookup", "robot.yaml", "map", "cam", "--with", tree, "--covariance", "-f", "json", files=FILES)
    assert done.err == f"{INDEPENDENT}; 1 of 4 has no sigma and counts as exact\n"
    assert entries_of(done.out)[0] > 0.25
    lines = "lookup robot.yaml map tool --covariance -f json\n" * 2
    done = run("batch", stdin=lines)
    first, second = map(entries_of, done.out.splitlines())
    assert first == second == entries_of(run("lookup", "robot.yaml", "map", "tool", "--covariance", "-f", "json").out)


@pytest.mark.parametrize(("beside", "left_out"), [("stamp: 3", "'stamp'"), ("note: far", "'note'"), ("name: a", "")])
def test_what_else_the_pose_of_a_transform_says_is_told_to_be_left_out(run: Run, beside: str, left_out: str) -> None:
    done = run("apply", "--transform", f"{{xyz: [1, 2, 3], {beside}}}", "1", "2", "3")
    assert (done.status, done.out) == (0, "point: [2.0, 4.0, 6.0]\n")
    assert done.err == (left_out and f"frametool: warning: argument: {left_out} left out: only its pose is used\n")
