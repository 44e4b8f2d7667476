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


@pytest.mark.parametrize("names", ["nx,ny,nz", "normal_x,normal_y,normal_z"])
@pytest.mark.parametrize("given", ["csv", "pcd", "ply"])
@pytest.mark.parametrize("form", ["csv", "pcd", "ply", "npy", "json"])
def test_normals_turn_along_from_each_form_into_each(run: Run, tmp_path: Path, names: str, given: str, form: str) -> None:
    (tmp_path / "a.csv").write_text(f"x,y,z,{names},ring\n1,2,3,0,0,1,7\n4,5,6,1,0,0,8\n")
    steps = [["convert", "-i", "a.csv", "-o", f"a.{given}"]] * (given != "csv")
    turn = "{xyz: [0, 0, 1], rpy_deg: [0, 90, 0]}"
    for step in (*steps, ["apply", "--transform", turn, "-i", f"a.{given}", "-o", f"b.{form}"]):
        assert run(*step).status == 0
    back = run("apply", "--transform", "{}", "-i", f"b.{form}", "-f", "csv", "--as", "point").out.splitlines()
    rows = [dict(zip(back[0].split(","), map(float, row.split(",")), strict=True)) for row in back[1:]]
    assert [[row[name] for name in ("x", "y", "z", *names.split(","), "ring")] for row in rows] == [[3, 2, 0, 1, 0, 0, 7], [6, 5, -3, 0, 0, -1, 8]]


def test_normals_that_axes_would_leave_behind_are_refused(run: Run) -> None:
    refused = run("convert", "--world-axes", "x,-y,-z", stdin="x,y,z,nx,ny,nz\n1,2,3,0,0,1\n")
    assert (refused.status, refused.err) == (2, "frametool: nx ny nz would keep to the old axes; --columns x,y,z turns the points alone, apply all of them\n")


def test_a_sensor_moves_along_under_a_scale_too(run: Run) -> None:
    cloud_of = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n"
    done = run("apply", "--transform", "{xyz: [1, 0, 0], scale: 2}", "-i", "a.pcd", files={"a.pcd": cloud_of})
    assert ("VIEWPOINT 3.0 4.0 6.0 1.0 0.0 0.0 0.0\n" in done.out, done.out.splitlines()[-1]) == (True, "3.0 4.0 6.0")
