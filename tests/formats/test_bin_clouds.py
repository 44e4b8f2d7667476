"""Clouds of KITTI and nuScenes: told by --in alone, sizes that do not divide, what a point lacks or has too much."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

KITTI = np.array([[1, 2, 3, 0.5], [4, 5, 6, 0.25]], "<f4").tobytes()
NUSCENES = np.array([[1, 2, 3, 55, 0], [4, 5, 6, 20, 31]], "<f4").tobytes()


@pytest.mark.parametrize(
    ("form", "data", "rows"),
    [
        ("kitti-bin", KITTI, "x,y,z,intensity\n1.0,2.0,3.0,0.5\n4.0,5.0,6.0,0.25\n"),
        ("nuscenes-bin", NUSCENES, "x,y,z,intensity,ring\n1.0,2.0,3.0,55.0,0.0\n4.0,5.0,6.0,20.0,31.0\n"),
        ("kitti-bin", b"", "x,y,z,intensity\n"),
    ],
)
def test_points_are_read_as_a_file_as_an_argument_and_from_a_pipe(run: Run, form: str, data: bytes, rows: str) -> None:
    told = ("--in", form, "-f", "csv")
    done = run("convert", "-i", "a.pcd.bin", *told, files={"a.pcd.bin": data})
    assert (done.status, done.out) == (0, rows)
    assert done.err == ""
    assert run("convert", *told, stdin=data).out == rows
    if data:
        assert run("convert", "a.pcd.bin", *told).out == rows


@pytest.mark.parametrize(("form", "data"), [("kitti-bin", KITTI), ("nuscenes-bin", NUSCENES)])
def test_what_moves_stays_of_its_form(run: Run, tmp_path: Path, form: str, data: bytes) -> None:
    tree = "frames: {map: {velo: {xyz: [10, 0, 0], rpy_deg: [0, 0, 90]}}}"
    done = run(
        "apply", "t.yaml", "map", "velo", "-i", "a.bin", "--in", form, "-o", "b.bin", files={"t.yaml": tree, "a.bin": data}
    )
    assert done.status == 0, done.err
    given, moved = (np.frombuffer((tmp_path / name).read_bytes(), "<f4").reshape(2, -1) for name in ("a.bin", "b.bin"))
    assert moved[:, :3].tolist() == [[8, 1, 3], [5, 4, 6]]
    assert np.array_equal(moved[:, 3:], given[:, 3:])
    assert run("convert", "-i", "a.bin", "--in", form, "-o", "c.bin").status == 0
    assert (tmp_path / "c.bin").read_bytes() == data


@pytest.mark.parametrize("form", ["ply", "pcd", "npy"])
def test_clouds_go_into_other_forms_and_back(run: Run, tmp_path: Path, form: str) -> None:
    files: dict[str, bytes] = {"a.bin": NUSCENES}
    assert run("convert", "-i", "a.bin", "--in", "nuscenes-bin", "-o", f"b.{form}", files=files).status == 0
    done = run("convert", "-i", f"b.{form}", "-f", "nuscenes-bin", "-o", "c.bin", "--quiet")
    assert (done.status, done.err) == (0, "")
    assert (tmp_path / "c.bin").read_bytes() == NUSCENES


def test_columns_are_found_by_name_in_any_order_and_rounding_is_told(run: Run, tmp_path: Path) -> None:
    rows = "intensity,label,z,y,x\n0.5,7,3,2,0.1\n"
    done = run("convert", "-i", "a.csv", "-f", "kitti-bin", "-o", "b.bin", files={"a.csv": rows})
    assert done.err == (
        "frametool: warning: kitti-bin: label left out: it holds x y z intensity alone\n"
        "frametool: warning: kitti-bin: numbers are float32; they were rounded by up to 1e-09\n"
    )
    assert (tmp_path / "b.bin").read_bytes() == np.array([0.1, 2, 3, 0.5], "<f4").tobytes()


def test_a_ring_has_no_place_in_kitti_and_is_told(run: Run, tmp_path: Path) -> None:
    done = run(
        "convert", "-i", "a.bin", "--in", "nuscenes-bin", "-f", "kitti-bin", "-o", "b.bin", "--quiet", files={"a.bin": NUSCENES}
    )
    assert (done.status, done.err) == (0, "frametool: warning: kitti-bin: ring left out: it holds x y z intensity alone\n")
    assert np.frombuffer((tmp_path / "b.bin").read_bytes(), "<f4").tolist() == [1, 2, 3, 55, 4, 5, 6, 20]


UNTOLD = "binary data; of a cloud say which: --in kitti-bin (float32 x y z intensity) or nuscenes-bin (and ring)"
LISTED = "`frametool formats` lists what is read"
CSV = "x,y,z,intensity\n1e300,2,3,4\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("convert", "-i", "a.bin"), f"a.bin: {UNTOLD}; {LISTED}"),
        (("convert", "a.bin"), f"a.bin: {UNTOLD}; {LISTED}"),
        (("convert", "-i", "noise.bin", "-f", "csv"), f"noise.bin: {UNTOLD}; {LISTED}"),
        (("tree", "noise.bin"), f"noise.bin: {UNTOLD}; {LISTED}"),
        (("apply", "--transform", "{xyz: [1, 0, 0]}", "-i", "noise.bin"), f"noise.bin: {UNTOLD}; {LISTED}"),
        (
            ("convert", "-i", "n.bin", "--in", "kitti-bin", "-f", "csv"),
            "n.bin: 40 bytes are no whole number of points of 16 bytes (float32 x y z intensity); --in nuscenes-bin fits",
        ),
        (
            ("convert", "-i", "odd.bin", "--in", "nuscenes-bin", "-f", "csv"),
            "odd.bin: 33 bytes are no whole number of points of 20 bytes (float32 x y z intensity ring); is it whole?",
        ),
        (
            ("convert", "-i", "five.bin", "--in", "nuscenes-bin", "-f", "csv"),
            "five.bin:1: ring: 0.5 is not a ring number; is it --in kitti-bin?",
        ),
        (("convert", "-i", "a.csv", "-f", "kitti-bin", "-o", "b.bin"), "column x: 1e+300 is too large for float32"),
        (
            ("convert", "-i", "p.csv", "-f", "nuscenes-bin", "-o", "b.bin"),
            "nuscenes-bin holds x y z intensity ring; there is no intensity, ring",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(run: Run, tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    noise = np.random.default_rng(1).random((300, 4), dtype="<f4").tobytes()
    five = np.full((5, 4), 0.5, "<f4").tobytes()
    files: dict[str, bytes | str] = {"a.bin": KITTI, "n.bin": NUSCENES, "odd.bin": b"\x01" * 33, "noise.bin": noise}
    done = run(*arguments, files=files | {"five.bin": five, "a.csv": CSV, "p.csv": "x,y,z\n1,2,3\n"})
    assert (done.status, done.out) == (1, "x,y,z,intensity,ring\n" * done.out.startswith("x"))
    assert done.err == f"frametool: {message}\n"
    assert len(done.err) <= 200
    assert not (tmp_path / "b.bin").exists()


def test_a_name_that_ends_in_bin_does_not_choose_what_is_written(run: Run) -> None:
    cloud = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n"
    for name in ("a.ply", "a.csv"):
        done = run("convert", "-i", name, "-o", "b.bin", files={"a.ply": cloud, "a.csv": "x,y,z\n1,2,3\n"})
        assert (done.status, done.out) == (2, "")
        assert "-o b.bin does not name its format; give -f kitti-bin or nuscenes-bin" in done.err


@pytest.mark.parametrize("form", ["pcd", "ply", "npy"])
def test_a_cloud_without_a_rotation_is_converted_into_its_own_form_too(run: Run, tmp_path: Path, form: str) -> None:
    run("convert", "-i", "a.csv", "-o", f"a.{form}", files={"a.csv": "x,y,z\n1,2,3\n4,5,6\n"})
    done = run("convert", "-i", f"a.{form}", "-o", f"b.{form}", "--quiet")
    assert (done.status, done.err) == (0, "")
    assert (tmp_path / f"a.{form}").read_bytes() == (tmp_path / f"b.{form}").read_bytes()
    assert run("convert", "-i", f"b.{form}", "-f", "csv", "--quiet").out == "x,y,z\n1.0,2.0,3.0\n4.0,5.0,6.0\n"
    refused = run("convert", "-i", f"a.{form}", "-o", f"c.{form}", "--to", "rpy")
    assert (refused.status, "no columns of a rotation among" in refused.err) == (1, True)
