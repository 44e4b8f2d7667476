"""Clouds between us and other libraries: theirs are read, ours are read by them, and all agree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from clouds import RNG, cloud, move, moved, pcd, turned, xyz

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

POINTS = RNG.normal(size=(700, 3), scale=20.0).astype(np.float32)
OTHERS = RNG.integers(0, 100, (700, 1)).astype(np.float32)


@pytest.mark.parametrize("encoding", ["ASCII", "BINARY", "BINARY_COMPRESSED"])
def test_what_pypcd4_writes_is_read_and_what_we_write_it_reads(run: Run, tmp_path: Path, encoding: str) -> None:
    pypcd4 = pytest.importorskip("pypcd4")
    made = pypcd4.PointCloud.from_xyzi_points(np.hstack([POINTS, OTHERS]))
    made.save(tmp_path / "theirs.pcd", encoding=getattr(pypcd4.Encoding, encoding))
    done = move(run, tmp_path, "pcd", (tmp_path / "theirs.pcd").read_bytes())
    assert done.status == 0, done.err
    found = pypcd4.PointCloud.from_path(tmp_path / "out.pcd")
    assert np.allclose(found.numpy(("x", "y", "z")), moved(POINTS), rtol=1e-6, atol=1e-5)
    assert np.array_equal(found.numpy(("intensity",)), OTHERS)
    assert np.allclose(found.metadata.viewpoint[:3], moved(np.zeros((1, 3)))[0])


def test_pypcd4_reads_the_fields_that_pass(run: Run, tmp_path: Path) -> None:
    pypcd4 = pytest.importorskip("pypcd4")
    given = cloud(60, intensity="u1", ring="<u2", time="<f8")
    move(run, tmp_path, "pcd", pcd(given))
    found = pypcd4.PointCloud.from_path(tmp_path / "out.pcd")
    assert all(np.array_equal(found.pc_data[name], given[name]) for name in ("intensity", "ring", "time"))


@pytest.mark.parametrize("order", ["=", "<", ">"])
def test_what_plyfile_writes_is_read_and_what_we_write_it_reads(run: Run, tmp_path: Path, order: str) -> None:
    plyfile = pytest.importorskip("plyfile")
    given = cloud(80, nx="<f4", ny="<f4", nz="<f4", red="u1")
    faces = np.array([([0, 1, 2], 9), ([3, 4, 5], 8)], [("vertex_indices", "i4", (3,)), ("red", "u1")])
    elements = [plyfile.PlyElement.describe(given, "vertex"), plyfile.PlyElement.describe(faces, "face")]
    plyfile.PlyData(elements, text=order == "=", byte_order=order, comments=["by them"]).write(tmp_path / "theirs.ply")
    done = move(run, tmp_path, "ply", (tmp_path / "theirs.ply").read_bytes())
    assert done.status == 0, done.err
    found = plyfile.PlyData.read(tmp_path / "out.ply")
    vertices = found["vertex"].data
    assert np.allclose(xyz(vertices), moved(xyz(given)), rtol=1e-6, atol=1e-5)
    assert np.allclose(xyz(vertices, "nx", "ny", "nz"), turned(xyz(given, "nx", "ny", "nz")), rtol=1e-6, atol=1e-5)
    assert vertices["red"].tolist() == given["red"].tolist()
    assert [list(each) for each in found["face"]["vertex_indices"]] == [[0, 1, 2], [3, 4, 5]]
    assert found.comments == ["by them"]


@pytest.mark.parametrize("form", ["pcd", "ply"])
def test_what_we_make_of_a_table_others_read(run: Run, tmp_path: Path, form: str) -> None:
    rows = "\n".join(f"{x!r},{y!r},{z!r},{at}" for at, (x, y, z) in enumerate(POINTS[:20].tolist()))
    done = move(run, tmp_path, "csv", f"x,y,z,id\n{rows}\n".encode(), into=form)
    assert done.status == 0, done.err
    if form == "pcd":
        found = pytest.importorskip("pypcd4").PointCloud.from_path(tmp_path / "out.pcd").pc_data
    else:
        found = pytest.importorskip("plyfile").PlyData.read(tmp_path / "out.ply")["vertex"].data
    assert np.allclose(xyz(found), moved(POINTS[:20]), rtol=1e-12)
    assert found["id"].tolist() == list(range(20))
