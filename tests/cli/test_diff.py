"""`diff`: its status, its forms, and everything that may go wrong."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING

import pytest
import yaml

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

A = """frames:
  base:
    mast: {xyz: [0, 0, 1], children: {camera: {xyz: [0.1, 0, 0.2]}, lidar: {xyz: [0, 0, 0.5]}}}
    old: {xyz: [1, 1, 1]}
"""
B = A.replace("old: {xyz: [1, 1, 1]}", "new: {xyz: [2, 1, 1]}").replace("0.1, 0, 0.2", "0.102, 0, 0.2")
DRIVE = """frames:
  - {name: base, parent: odom, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 2, xyz: [2, 0, 0]}]}
"""
FILES: dict[str, str | bytes] = {
    "a.yaml": A, "b.yaml": B, "drive.yaml": DRIVE, "bad.yaml": "frames: {a: {b: {xyz: [1, 2]}}}", "empty.yaml": "",
    "binary.bag": b"\x00\x01" * 50, "kit.yaml": "frames: {base: {kit: {xyz: [0, 0, 1]}}}",
}  # fmt: skip


def test_the_same_tree_is_silent_and_0(run: Run) -> None:
    assert run("diff", "a.yaml", "a.yaml", files=FILES) == (0, "", "")


def test_different_trees_are_1_and_told_in_sentences_and_a_table(run: Run) -> None:
    found = run("diff", "a.yaml", "b.yaml", files=FILES)
    assert (found.status, found.err) == (1, "")
    assert found.out == (
        "'old', under 'base', is only in A\n'new', under 'base', is only in B\n\n"
        "moved             in its parent          seen from base\n"
        "                             mm     deg              mm     deg\n"
        "  camera in mast          2.000  0.0000           2.000  0.0000\n"
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ("a.yaml", "missing.yaml"), ("missing.yaml", "a.yaml"), ("a.yaml", "bad.yaml"), ("a.yaml", "empty.yaml"),
        ("a.yaml", "binary.bag"), ("a.yaml", "b.yaml", "--seen-from", "nope"), ("a.yaml",), (), ("a.yaml", "."),
        ("a.yaml", "b.yaml", "--tolerance", "1kg"), ("-", "-"), ("a.yaml", "b.yaml", "--at", "soon"),
        ("a.yaml", "b.yaml", "--nope"), ("drive.yaml", "drive.yaml", "--at", "9"), ("a.yaml", "{xyz: [}"),
        ("a.yaml", "b.yaml", "-o", "kit.yaml"), ("a.yaml", "b.yaml", "-o", "no/such/folder"),
        ("a.yaml", "b.yaml", "--in", "urdff"), ("a.yaml", "/"),
    ],
)  # fmt: skip
def test_any_trouble_is_2(run: Run, arguments: tuple[str, ...]) -> None:
    found = run("diff", *arguments, files=FILES)
    assert found.status == 2
    assert found.err.splitlines()[-1].startswith("frametool: ") or "^" in found.err


def test_other_commands_keep_their_codes(run: Run) -> None:
    assert run("tree", "missing.yaml", files=FILES).status == 5
    assert run("tree", "bad.yaml", files=FILES).status == 1
    assert run("lookup", "a.yaml", "base", "nope", files=FILES).status == 4


def test_errors_are_json_where_results_are(run: Run) -> None:
    found = run("diff", "a.yaml", "missing.yaml", "-f", "json", files=FILES)
    assert (found.status, json.loads(found.err)["error"]) == (2, "file_problem")


def test_json_yaml_and_csv_say_the_same(run: Run) -> None:
    entries = [json.loads(line) for line in run("diff", "a.yaml", "b.yaml", "-f", "json", files=FILES).out.splitlines()]
    assert [(each["kind"], each["frame"], each["parent_a"], each["parent_b"]) for each in entries] == [
        ("only-in-a", "old", "base", None), ("only-in-b", "new", None, "base"), ("moved", "camera", "mast", "mast"),
    ]  # fmt: skip
    assert (entries[2]["seen_from"], entries[2]["moved_deg"], entries[2]["seen_deg"]) == ("base", 0.0, 0.0)
    assert entries[2]["moved_mm"] == pytest.approx(2, rel=1e-12)
    assert entries[2]["seen_mm"] == pytest.approx(2, rel=1e-12)
    assert list(yaml.safe_load_all(run("diff", "a.yaml", "b.yaml", "-f", "yaml").out)) == entries
    rows = list(csv.DictReader(io.StringIO(run("diff", "a.yaml", "b.yaml", "-f", "csv").out)))
    assert rows == [{key: "" if value is None else str(value) for key, value in each.items()} for each in entries]


def test_annotations_stand_at_the_line_of_b_or_else_of_a(run: Run) -> None:
    lines = run("diff", "a.yaml", "b.yaml", "-f", "github", files=FILES).out.splitlines()
    assert lines == [
        "::error file=a.yaml,line=4,title=only-in-a::'old', under 'base', is only in A",
        "::error file=b.yaml,line=4,title=only-in-b::'new', under 'base', is only in B",
        "::error file=b.yaml,line=3,title=moved::'camera' moved 2 mm and 0 deg in 'mast'; seen from 'base' it moved 2 mm and 0 deg",
    ]


CHAIN = """cam0:
  {camera_model: pinhole, intrinsics: [461.5, 460, 367, 248], distortion_model: radtan,
  distortion_coeffs: [-0.25, 0.07, 0, 0], resolution: [752, 480],
  T_cam_imu: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
"""
OWN = """frames: {base: {cam0: {xyz: [0, 0, 1], camera: {
  K: [461.5, 460, 367, 248], D: [-0.25, 0.07, 0, 0], size: [752, 480], model: plumb_bob}}}}
"""


@pytest.mark.parametrize("text", [CHAIN, OWN])
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("461.5", "463", "fx 461.5 -> 463"),
        ("461.5", "461.50000000000006", ""),  # rounding
        ("0.07", "0.08", "D [-0.25, 0.07, 0, 0] -> [-0.25, 0.08, 0, 0]"),
        ("752, 480", "640, 480", "size [752, 480] -> [640, 480]"),
    ],
)
def test_intrinsics_that_differ_are_told_old_and_new(run: Run, text: str, old: str, new: str, told: str) -> None:
    files = {"a.yaml": text, "b.yaml": text.replace(old, new)}
    done = run("diff", "a.yaml", "b.yaml", files=files)
    assert done == ((1, f"'cam0' has other intrinsics: {told}\n", "") if told else (0, "", ""))
    lines = run("diff", "a.yaml", "b.yaml", "-f", "json", files=files).out.splitlines()
    assert [json.loads(line)["note"] for line in lines] == [told] * bool(told)


def test_intrinsics_that_cannot_be_compared_are_noted(run: Run) -> None:
    files = {"a.yaml": CHAIN, "b.yaml": CHAIN.replace("intrinsics: [461.5, 460, 367, 248],", "")}
    note = "frametool: intrinsics in only one of A and B are not compared: cam0\n"
    assert run("diff", "a.yaml", "b.yaml", files=files) == (0, "", note)
    done = run("diff", "a.yaml", "b.yaml", files={**files, "b.yaml": CHAIN.replace("[461.5, 460", "[461.5, north")})
    assert (done.status, done.out) == (0, "")
    assert "intrinsics are not compared: b.yaml: " in done.err


def test_one_camera_that_cannot_be_compared_hides_no_other(run: Run) -> None:
    text = CHAIN + CHAIN.replace("cam0", "cam1").replace("pinhole", "foo")
    done = run("diff", "a.yaml", "b.yaml", files={"a.yaml": text, "b.yaml": text.replace("461.5", "463")})
    assert (done.status, done.out) == (1, "'cam0' has other intrinsics: fx 461.5 -> 463\n")
    assert "intrinsics of 'cam1' are not compared: a.yaml: cam1: camera model 'foo' is not known" in done.err


def test_all_lists_the_frames_that_did_not_move_too(run: Run) -> None:
    entries = [json.loads(line) for line in run("diff", "a.yaml", "b.yaml", "--all", "-f", "json", files=FILES).out.splitlines()]
    assert {each["frame"] for each in entries if each["kind"] == "same"} == {"base", "mast", "lidar"}
    assert "  lidar in mast           0.000  0.0000           0.000" in run("diff", "a.yaml", "b.yaml", "--all").out


@pytest.mark.parametrize(
    ("tolerance", "told"),
    [
        ("1mm", True), ("3mm", False), ("0.3cm,0.1deg", False), ("0.1deg,3mm", False), ("0.1deg", True), ("0.003", False),
        ("0.003,0.1", False), ("3 mm, 0.1 deg", False), ("0.001,pi/2", True), ("3000um", False),
    ],
)  # fmt: skip
def test_a_tolerance_is_a_length_an_angle_or_both(run: Run, tolerance: str, told: bool) -> None:  # noqa: FBT001 - a parameter of the test
    found = run("diff", "a.yaml", "b.yaml", "--tolerance", tolerance, files=FILES)
    assert (found.status, "camera" in found.out) == (1, told)


@pytest.mark.parametrize("tolerance", ["-1mm", "1mm,2mm", "1deg,1deg", "nan", "", "1mm,1deg,1", "inf"])
def test_what_is_no_tolerance_is_refused(run: Run, tolerance: str) -> None:
    found = run("diff", "a.yaml", "b.yaml", f"--tolerance={tolerance}", files=FILES)
    assert (found.status, found.out) == (2, "")
    assert "write a length, an angle or both: 1mm,0.1deg" in found.err


def test_more_files_go_into_either_side(run: Run) -> None:
    found = run("diff", "a.yaml", "b.yaml", "--with-a", "kit.yaml", "-f", "csv", files=FILES)
    assert "only-in-a,kit,base," in found.out
    assert "kit" not in run("diff", "a.yaml", "b.yaml", "--with-a", "kit.yaml", "--with-b", "kit.yaml").out


def test_a_tree_may_come_by_a_pipe_or_stand_in_the_command(run: Run) -> None:
    assert run("diff", "-", "a.yaml", stdin=A, files=FILES).status == 0
    assert run("diff", "a.yaml", "-", stdin=B).status == 1
    assert run("diff", "{name: a, parent: b, xyz: [1, 0, 0]}", "{name: a, parent: b, xyz: [1, 0, 0]}").status == 0


def test_recordings_are_compared_at_a_time_that_is_told(run: Run) -> None:
    found = run("diff", "drive.yaml", "drive.yaml", files=FILES)
    assert (found.status, found.out) == (0, "")
    assert found.err.startswith("frametool: what moves is compared at its latest (A 2.000000000 and B 2.000000000)")
    assert run("diff", "drive.yaml", "drive.yaml", "--quiet").err == ""
    other = {"other.yaml": DRIVE.replace("xyz: [2", "xyz: [3")}
    found = run("diff", "drive.yaml", "other.yaml", "--at", "1", "-f", "json", files=other)
    assert (found.status, json.loads(found.out)["moved_mm"]) == (1, 500.0)
    assert run("diff", "drive.yaml", "other.yaml", "--at", "0").status == 0


def test_one_form_that_is_named_is_that_of_both_sides(run: Run) -> None:
    files = {"a.txt": A, "b.txt": B}
    assert run("diff", "a.txt", "b.txt", "--in", "yaml", files=files).status == 1
    found = run("diff", "a.txt", "b.txt", "--in", "yaml", "--in", "echo")
    assert found.status == 2
    assert "b.txt" in found.err


def test_a_report_goes_into_a_file_whose_suffix_says_its_form(run: Run, tmp_path: Path) -> None:
    assert run("diff", "a.yaml", "b.yaml", "-o", "out.json", files=FILES) == (1, "", "")
    assert json.loads((tmp_path / "out.json").read_text().splitlines()[0])["frame"] == "old"


@pytest.mark.parametrize("name", ["a" * 100, "\u6a5f\u68b0" * 30, "x\x1b[31m", "with blank " * 9])
def test_the_report_fits_80_columns_and_steers_no_terminal(
    run: Run, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    from frametool.errors import cells

    monkeypatch.setenv("COLUMNS", "80")
    one = f"frames: {{{json.dumps(name)}: {{{json.dumps(name + 'b')}: {{xyz: [0, 0, 1]}}, old: {{xyz: [1, 0, 0]}}}}}}"
    other = one.replace("0, 1]", "1000, 1]").replace("old", "new") + f"\n---\n{{name: {json.dumps(name)}, parent: top}}"
    for pair in ((one, other), (other, one)):
        found = run("diff", "a.yaml", "b.yaml", files=dict(zip(("a.yaml", "b.yaml"), pair, strict=True)))
        assert found.status == 1
        assert max(map(cells, found.out.splitlines())) <= 80
        assert "\x1b" not in found.out + found.err
