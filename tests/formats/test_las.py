"""LAS: integers with a scale; what is not moved is kept."""

from __future__ import annotations

import io
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from clouds import RNG, move, moved, xyz

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

POINTS = RNG.normal(size=(30, 3), scale=20.0)


def scan(form: str = "las", **header: Any) -> bytes:
    """Write a scan with dimensions of every kind, a record of variable length and one behind the points."""
    laspy = pytest.importorskip("laspy")
    if form == "laz":
        pytest.importorskip("lazrs")
    head = laspy.LasHeader(version="1.4", point_format=7)
    head.scales, head.offsets = np.full(3, 0.001), np.array([430_000.0, 5_400_000.0, 100.0])
    head.add_extra_dim(laspy.ExtraBytesParams("reflectance", "<f8"))
    head.vlrs.append(laspy.VLR("someone", 7, "about", b"their bytes"))
    for name, value in header.items():
        setattr(head, name, value)
    made = laspy.LasData(head)
    rng = np.random.default_rng(3)
    made.x = 430_000 + rng.normal(size=500, scale=50)
    made.y = 5_400_000 + rng.normal(size=500, scale=50)
    made.z = 100 + rng.normal(size=500)
    made.intensity, made.red = rng.integers(0, 1 << 16, 500), rng.integers(0, 1 << 16, 500)
    made.classification, made.return_number = rng.integers(0, 20, 500), 1 + np.arange(500) % 3
    made.gps_time, made.reflectance = np.arange(500) / 7, rng.normal(size=500)
    made.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("someone", 8, "behind", b"far bytes")])
    file = io.BytesIO()
    made.write(file, do_compress=form == "laz")
    return file.getvalue()


@pytest.mark.parametrize("into", ["las", "laz"])
@pytest.mark.parametrize("form", ["las", "laz"])
def test_a_scan_moves_within_its_scale_and_keeps_all_else(run: Run, tmp_path: Path, form: str, into: str) -> None:
    data = scan(form)
    laspy = pytest.importorskip("laspy")
    pytest.importorskip("lazrs")
    done = move(run, tmp_path, form, data, into=into)
    given, found = laspy.read(io.BytesIO(data)), laspy.read(io.BytesIO(done.data or b""))
    assert abs(found.xyz - moved(given.xyz)).max() <= 0.00051
    assert found.header.scales.tolist() == given.header.scales.tolist()
    assert found.header.are_points_compressed == (into == "laz")
    others = [name for name in given.point_format.dimension_names if name not in "XYZ"]
    assert all(np.array_equal(np.array(found[name]), np.array(given[name])) for name in others)
    assert (found.header.vlrs.get_by_id("someone")[0].record_data, found.evlrs[0].record_data) == (b"their bytes", b"far bytes")
    assert np.allclose(found.header.maxs, found.xyz.max(axis=0))
    assert "x y z are rounded to the scale of las, 0.001 m" in done.err


def test_a_scan_that_does_not_fit_its_scale_is_refused(run: Run, tmp_path: Path) -> None:
    data = scan(scales=np.full(3, 1e-6), offsets=np.array([430_000.0, 5_400_000.0, 100.0]))
    laspy = pytest.importorskip("laspy")
    given = laspy.read(io.BytesIO(data))
    given.X[7], given.Y[7] = 2**31 - 1, -(2**31)
    file = io.BytesIO()
    given.write(file)
    done = move(run, tmp_path, "las", file.getvalue(), pose='{"rpy_deg": [0, 0, 45]}')
    assert (done.data, done.status) == (None, 1)
    assert "in.las: point 8: " in done.err
    assert "does not fit 32 bits of 1e-06 m around" in done.err


def test_a_scan_becomes_columns_and_columns_a_scan(run: Run, tmp_path: Path) -> None:
    laspy = pytest.importorskip("laspy")
    data = scan()
    array = np.load(io.BytesIO(move(run, tmp_path, "las", data, into="npy").data or b""))
    given = laspy.read(io.BytesIO(data))
    assert np.allclose(xyz(array), moved(given.xyz), rtol=0, atol=1e-8)
    assert array["intensity"].tolist() == given.intensity.tolist()
    file = io.BytesIO()
    np.save(file, array)
    found = laspy.read(io.BytesIO(move(run, tmp_path, "npy", file.getvalue(), into="las", pose="{}").data or b""))
    assert abs(found.xyz - moved(given.xyz)).max() <= 0.00051
    assert np.array_equal(found.reflectance, given.reflectance)
    assert np.array_equal(found.red, given.red)


def test_a_scan_of_which_nothing_changes_is_written_again(run: Run, tmp_path: Path) -> None:
    laspy = pytest.importorskip("laspy")
    (tmp_path / "a.las").write_bytes(data := scan())
    done = run("convert", "-i", str(tmp_path / "a.las"), "-o", str(tmp_path / "b.las"))
    assert done.status == 0, done.err
    again, given = laspy.read(tmp_path / "b.las"), laspy.read(io.BytesIO(data))
    assert (np.array_equal(again.xyz, given.xyz), np.array_equal(again.red, given.red)) == (True, True)


def test_points_without_a_return_have_no_place_in_a_scan_and_are_told(run: Run, tmp_path: Path) -> None:
    laspy = pytest.importorskip("laspy")
    points = POINTS.copy()
    points[4] = np.nan
    file = io.BytesIO()
    np.save(file, points)
    done = move(run, tmp_path, "npy", file.getvalue(), into="las")
    assert len(laspy.read(io.BytesIO(done.data or b"")).points) == 29
    assert "1 point without numbers left out: las has no place for them" in done.err


def test_a_cut_scan_is_one_line(run: Run, tmp_path: Path) -> None:
    data = scan()
    for end in (0, 3, 100, 300, 1000, len(data) // 2):
        done = move(run, tmp_path, "las", data[:end], "--quiet")
        assert (done.data, done.status) == (None, 1)
        assert len(done.err.splitlines()) == 1


@pytest.mark.parametrize(("form", "library"), [("las", "laspy"), ("laz", "lazrs")])
def test_what_is_not_installed_is_named(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: str, library: str
) -> None:
    data = scan(form)
    monkeypatch.setitem(sys.modules, library, None)
    done = move(run, tmp_path, form, data)
    message = f"in.{form}: LAS is read and written with an extra; install it: pip install 'frametool[las]'"
    assert (done.data, done.status, done.err) == (None, 5, f"frametool: {message}\n")
