"""PLY: vertices move, normals and rotations of splats turn, faces and everything else pass byte for byte."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from clouds import cloud, move, moved, ply, ply_rows, turned, xyz

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

FACE = "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\n"
FACES = struct.pack("<B3iBB4iB", 3, 0, 1, 2, 9, 4, 0, 1, 2, 3, 8)
BINARY = ("binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("form", BINARY)
@pytest.mark.parametrize("kind", ["<f4", "<f8"])
def test_vertices_move_and_all_else_passes(run: Run, tmp_path: Path, form: str, kind: str) -> None:
    given = cloud(30, kind, red="u1", nx="<f4", ny="<f4", nz="<f4")
    data = ply(given, form, after=FACE) + FACES
    done = move(run, tmp_path, "ply", data)
    head, found, rest = ply_rows(done.data, given.dtype.newbyteorder("<" if "little" in form else ">"), 30)
    assert (head, rest) == (data[: len(head)], FACES)
    eps = float(np.finfo(np.dtype(kind)).eps)
    assert np.allclose(xyz(found), moved(xyz(given)), rtol=eps, atol=1e-6)
    assert np.allclose(xyz(found, "nx", "ny", "nz"), turned(xyz(given, "nx", "ny", "nz")), rtol=1e-6, atol=1e-5)
    assert found["red"].tolist() == given["red"].tolist()


def test_ascii_changes_only_the_cells_that_move(run: Run, tmp_path: Path) -> None:
    given = cloud(2, red="u1")
    data = ply(given[:0], "ascii", before="element camera 1\nproperty list uchar float view\n", after=FACE)
    data = data.replace(b"element vertex 0", b"element vertex 2") + b"2 0.5 0.25\n"
    rows, faces = b"1 0 0  255\r\n0 1.5 0\t007\n", b"3 0 1 1 9\n3 1 0 0  8\n"
    done = move(run, tmp_path, "ply", data + rows + faces, pose='{"xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}')
    assert done.data == data + b"1.0 3.0 3.0  255\r\n-0.5 2.0 3.0\t007\n" + faces


def test_elements_before_the_vertices_pass(run: Run, tmp_path: Path) -> None:
    given = cloud(4)
    data = ply(given, before="element camera 2\nproperty float f\nproperty uchar id\n")
    cameras = b"\1\2\3\4\5" * 2
    data = data.replace(b"end_header\n", b"end_header\n" + cameras)
    done = move(run, tmp_path, "ply", data)
    assert (done.data or b"")[: -given.nbytes] == data[: -given.nbytes]
    assert np.allclose(xyz(np.frombuffer((done.data or b"")[-given.nbytes :], given.dtype)), moved(xyz(given)), rtol=1e-6)


def splats(count: int, **others: str) -> Any:
    fields = {f"rot_{at}": "<f4" for at in range(4)} | {"scale_0": "<f4", "f_dc_0": "<f4"} | others
    return cloud(count, **fields)


def test_rotations_of_splats_turn_and_keep_their_norms(run: Run, tmp_path: Path) -> None:
    from scipy.spatial.transform import Rotation

    given = splats(50)
    done = move(run, tmp_path, "ply", ply(given))
    _, found, _ = ply_rows(done.data, given.dtype, 50)
    before, after = (np.array([each[f"rot_{at}"] for at in (1, 2, 3, 0)], float).T for each in (given, found))
    wanted = Rotation.from_euler("z", 30, degrees=True) * Rotation.from_quat(before)
    assert (wanted.inv() * Rotation.from_quat(after)).magnitude().max() < 1e-6
    assert np.allclose(np.linalg.norm(after, axis=1), np.linalg.norm(before, axis=1), rtol=1e-6)
    assert all(found[name].tobytes() == given[name].tobytes() for name in ("scale_0", "f_dc_0"))
    assert "f_rest" not in done.err


def test_spherical_harmonics_that_stay_are_told(run: Run, tmp_path: Path) -> None:
    given = ply(splats(3, f_rest_0="<f4"))
    assert "f_rest_*, spherical harmonics, are left as they are" in move(run, tmp_path, "ply", given).err
    assert "f_rest" not in move(run, tmp_path, "ply", given, pose='{"xyz": [1, 2, 3]}').err


def test_rotations_of_splats_turn_on_their_way_into_another_form_too(run: Run, tmp_path: Path) -> None:
    given = splats(3)
    data = ply(given)
    _, same, _ = ply_rows(move(run, tmp_path, "ply", data).data, given.dtype, 3)
    (tmp_path / "out.npy").write_bytes(move(run, tmp_path, "ply", data, into="npy").data or b"")
    there = np.load(tmp_path / "out.npy")
    assert all(there[f"rot_{at}"].tolist() == same[f"rot_{at}"].tolist() for at in range(4))


def test_rotations_of_splats_in_text_are_left_and_told(run: Run, tmp_path: Path) -> None:
    done = move(run, tmp_path, "ply", ply(splats(2), "ascii"))
    assert "rot_0 .. rot_3, the rotations of splats, are left as they are: only binary files are turned" in done.err


def test_vertices_that_faces_count_are_not_left_out(run: Run, tmp_path: Path) -> None:
    given = cloud(3)
    given["x"][1] = given["y"][1] = 3e38
    done = move(run, tmp_path, "ply", ply(given, after=FACE) + FACES, "--on-error", "skip")
    assert (done.data, done.status) == (None, 1)
    assert "vertices cannot be left out: other elements count them ('face')" in done.err
    alone = move(run, tmp_path, "ply", ply(given), "--on-error", "skip")
    head, found, _ = ply_rows(alone.data, given.dtype, 2)
    assert (alone.status, len(found)) == (3, 2)
    assert b"element vertex 2\n" in head


def test_results_beside_what_they_come_from_are_new_properties(run: Run, tmp_path: Path) -> None:
    given = cloud(6, red="u1")
    done = move(run, tmp_path, "ply", ply(given, after=FACE) + FACES, "--keep", "--prefix", "map_")
    kind = [*given.dtype.descr, *((f"map_{name}", "<f8") for name in "xyz")]
    head, found, rest = ply_rows(done.data, kind, 6)
    assert b"property uchar red\nproperty double map_x\nproperty double map_y\nproperty double map_z\nelement face" in head
    assert np.allclose(xyz(found, "map_x", "map_y", "map_z"), moved(xyz(given)), rtol=1e-12, atol=1e-12)
    assert rest == FACES


MESH = "element face {}\nproperty list uchar int vertex_indices\nproperty list ushort float uv\nelement edge 2\nproperty uchar a\n"


def mesh(order: str, corners: list[int]) -> bytes:
    """Return faces with so many corners each, and two edges."""
    faces = [struct.pack(f"{order}B{n}iH{n - 3}f", n, *range(n), n - 3, *range(n - 3)) for n in corners]
    return b"".join(faces) + b"ab"


@pytest.mark.parametrize("form", BINARY)
@pytest.mark.parametrize("corners", [[3, 4] * 50, []])
def test_faces_of_any_length_pass(run: Run, tmp_path: Path, form: str, corners: list[int]) -> None:
    given = cloud(6)
    faces = mesh("<" if "little" in form else ">", corners)
    data = ply(given, form, after=MESH.format(len(corners))) + faces
    assert (move(run, tmp_path, "ply", data).data or b"").endswith(faces)
