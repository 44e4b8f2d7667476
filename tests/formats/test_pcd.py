"""PCD: points move, normals turn, VIEWPOINT moves along, and nothing else changes."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from clouds import RNG, SHIFT, cloud, move, moved, pcd, pcd_rows, turned, xyz

from frametool.errors import ValueInvalid
from frametool.formats.rows.pcd import unpack

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

VIEWPOINT = b"VIEWPOINT 0 0 0 1 0 0 0"


def packed(data: bytes) -> bytes:
    """Pack bytes as LZF does, with runs of literals only."""
    return b"".join(bytes([len(data[at : at + 32]) - 1]) + data[at : at + 32] for at in range(0, len(data), 32))


def same_but_viewpoint(found: bytes, given: bytes) -> bool:
    """Tell whether two headers differ in nothing but VIEWPOINT."""
    lines = [[line for line in head.splitlines() if not line.startswith(b"VIEWPOINT")] for head in (found, given)]
    return lines[0] == lines[1]


@pytest.mark.parametrize("kind", ["<f4", "<f8"])
def test_points_are_moved_as_doubles_and_rounded_once_and_other_fields_pass(run: Run, tmp_path: Path, kind: str) -> None:
    given = cloud(1000, kind, intensity="u1", ring="<u2", time="<f8", label="<i4")
    done = move(run, tmp_path, "pcd", pcd(given))
    head, found = pcd_rows(done.data, given.dtype)
    assert same_but_viewpoint(head, pcd(given)[: len(pcd(given)) - given.nbytes])
    eps = float(np.finfo(np.dtype(kind)).eps)
    assert np.allclose(xyz(found), moved(xyz(given)), rtol=eps, atol=1e-13)
    assert all(found[name].tobytes() == given[name].tobytes() for name in ("intensity", "ring", "time", "label"))


def test_points_without_a_return_stay_and_keep_their_other_fields(run: Run, tmp_path: Path) -> None:
    given = cloud(10, ring="<u2")
    given["x"][3] = np.nan
    for name in "xyz":
        given[name][5] = np.nan
    _, found = pcd_rows(move(run, tmp_path, "pcd", pcd(given)).data, given.dtype)
    assert np.isnan(xyz(found)).all(axis=1).tolist() == [row in (3, 5) for row in range(10)]
    assert found["ring"].tolist() == given["ring"].tolist()


@pytest.mark.parametrize("names", [("normal_x", "normal_y", "normal_z"), ("nx", "ny", "nz")])
def test_normals_turn_and_are_not_shifted(run: Run, tmp_path: Path, names: tuple[str, ...]) -> None:
    given = cloud(50, curvature="<f4", **dict.fromkeys(names, "<f4"))
    _, found = pcd_rows(move(run, tmp_path, "pcd", pcd(given)).data, given.dtype)
    assert np.allclose(xyz(found), moved(xyz(given)), rtol=1e-6, atol=1e-6)
    assert np.allclose(xyz(found, *names), turned(xyz(given, *names)), rtol=1e-6, atol=1e-5)
    assert found["curvature"].tobytes() == given["curvature"].tobytes()


def test_a_point_without_a_normal_moves_and_a_normal_without_a_point_turns(run: Run, tmp_path: Path) -> None:
    given = cloud(3, nx="<f4", ny="<f4", nz="<f4")
    given["nx"][0] = np.nan
    given["z"][1] = np.nan
    _, found = pcd_rows(move(run, tmp_path, "pcd", pcd(given)).data, given.dtype)
    assert np.isnan(xyz(found)).any(axis=1).tolist() == [False, True, False]
    assert np.isnan(xyz(found, "nx", "ny", "nz")).any(axis=1).tolist() == [True, False, False]


def test_viewpoint_is_the_pose_of_the_sensor_and_moves_along(run: Run, tmp_path: Path) -> None:
    half = 0.5**0.5
    given = pcd(cloud(), viewpoint=f"1 2 3 {half!r} 0 0 {half!r}")
    head, _ = pcd_rows(move(run, tmp_path, "pcd", given).data, cloud().dtype)
    words = next(line for line in head.decode().splitlines() if line.startswith("VIEWPOINT")).split()[1:]
    numbers = [float(word) for word in words]
    assert np.allclose(numbers[:3], moved([[1, 2, 3]])[0], rtol=0, atol=1e-15)
    assert np.allclose(numbers[3:], [np.cos(np.radians(60)), 0, 0, np.sin(np.radians(60))], rtol=0, atol=1e-15)


def test_a_viewpoint_that_is_no_pose_stays_and_is_told(run: Run, tmp_path: Path) -> None:
    done = move(run, tmp_path, "pcd", pcd(cloud(), viewpoint="0 0 0 0 0 0 0"))
    assert b"VIEWPOINT 0 0 0 0 0 0 0\n" in (done.data or b"")
    assert "VIEWPOINT is left as it is: 0 0 0 0 is not a rotation" in done.err


def test_fields_of_several_values_and_padding_pass(run: Run, tmp_path: Path) -> None:
    given = np.zeros(7, [("x", "<f4"), ("pad", "u1", 4), ("y", "<f4"), ("z", "<f4"), ("fpfh", "<f4", 33), ("pad2", "u1", 3)])
    given["pad"], given["pad2"] = 7, 8
    given["fpfh"] = RNG.normal(size=(7, 33))
    words = {"fields": "x _ y z fpfh _"}
    done = move(run, tmp_path, "pcd", pcd(given, **words))
    head, found = pcd_rows(done.data, given.dtype)
    assert same_but_viewpoint(head, pcd(given, **words)[: -given.nbytes])
    assert np.allclose(xyz(found), np.tile(SHIFT, (7, 1)))
    assert all(found[name].tobytes() == given[name].tobytes() for name in ("pad", "pad2", "fpfh"))


@pytest.mark.parametrize("version", [".5", "0.6", ".6", ".7"])
def test_older_headers_are_read(run: Run, tmp_path: Path, version: str) -> None:
    given = cloud(5)
    old = pcd(given).replace(b"VERSION 0.7", f"VERSION {version}".encode()).replace(b"FIELDS", b"COLUMNS")
    for line in (b"COUNT 1 1 1\n", VIEWPOINT + b"\n", b"WIDTH 5\n", b"HEIGHT 1\n"):
        old = old.replace(line, b"")
    head, found = pcd_rows(move(run, tmp_path, "pcd", old).data, given.dtype)
    assert head == old[: len(old) - given.nbytes]
    assert np.allclose(xyz(found), moved(xyz(given)), rtol=1e-6)


def test_ascii_changes_only_the_cells_that_move(run: Run, tmp_path: Path) -> None:
    rows = b"1.50  0 0\t7.100 1e0 \n\n nan nan nan 8 -nan\r\n-0 1 2 +3 4"
    given = np.zeros(3, [("x", "<f4"), ("y", "<f4"), ("z", "<f8"), ("a", "<f4"), ("b", "<f4")])
    head = pcd(given[:0], "ascii", width=3, points=3)
    done = move(run, tmp_path, "pcd", head + rows, "--quiet", pose='{"xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}')
    wanted = b"1.0  3.5 3.0\t7.100 1e0 \n\n nan nan nan 8 -nan\r\n0.0 2.0 5.0 +3 4"
    assert (done.data or b"").endswith(b"DATA ascii\n" + wanted)


def test_ascii_and_binary_hold_the_same_points(run: Run, tmp_path: Path) -> None:
    given = cloud(300, ring="<u2")
    _, found = pcd_rows(move(run, tmp_path, "pcd", pcd(given)).data, given.dtype)
    text = (move(run, tmp_path, "pcd", pcd(given, "ascii")).data or b"").partition(b"DATA ascii\n")[2]
    rows = [line.split() for line in text.decode().splitlines()]
    assert [[np.float32(cell) for cell in row[:3]] for row in rows] == [list(row)[:3] for row in found.tolist()]
    assert all(len(cell) <= 13 for row in rows for cell in row[:3])
    assert [int(row[3]) for row in rows] == found["ring"].tolist()


def test_precision_fixes_the_decimals_of_ascii(run: Run, tmp_path: Path) -> None:
    text = (move(run, tmp_path, "pcd", pcd(cloud(9), "ascii"), "--precision", "3").data or b"").partition(b"DATA ascii\n")[2]
    assert all(len(cell.partition(b".")[2]) == 3 for cell in text.split())


def test_packed_points_are_read_and_written_plain(run: Run, tmp_path: Path) -> None:
    given = cloud(500, intensity="<f4", ring="<u2")
    body = packed(b"".join(given[name].tobytes() for name in given.dtype.names or ()))
    head = pcd(given[:0], "binary_compressed", width=500, points=500)
    done = move(run, tmp_path, "pcd", head + struct.pack("<II", len(body), given.nbytes) + body)
    plain = move(run, tmp_path, "pcd", pcd(given))
    assert done.data == plain.data
    assert "binary_compressed is written as binary" in done.err


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        (b"\x02abc", b"abc"),
        (b"\x02abc\x20\x02", b"abcabc"),
        (b"\x00a\xe0\x05\x00", b"a" * 15),
        (b"\x01ab\xe0\x01\x01", b"ab" + b"ab" * 5),
        (b"", b""),
    ],
)
def test_runs_of_lzf_are_unpacked(given: bytes, wanted: bytes) -> None:
    assert unpack(given, len(wanted)) == wanted


@pytest.mark.parametrize(
    ("given", "size", "message"),
    [
        (b"\x02ab", 3, "it ends in the middle of a run"),
        (b"\x20", 3, "it ends in the middle of a run"),
        (b"\x00a\x20\x05", 4, "it refers to bytes before its beginning"),
        (b"\x00a", 2, "it makes only 1 bytes, not 2"),
        (b"\x02abc\x02abc", 2, "it makes at least 3 bytes, not 2"),
        (b"\x00a", 10**9, "2 packed bytes cannot hold 1000000000"),
    ],
)
def test_what_is_no_lzf_is_refused(given: bytes, size: int, message: str) -> None:
    with pytest.raises(ValueInvalid, match=message):
        unpack(given, size)


def test_a_point_that_does_not_fit_its_type_is_a_bad_row(run: Run, tmp_path: Path) -> None:
    given = cloud(3)
    given["x"][1] = given["y"][1] = 3e38
    stopped = move(run, tmp_path, "pcd", pcd(given))
    assert (stopped.data, stopped.status) == (None, 1)
    assert "in.pcd: row 2: the result is too large for float32" in stopped.err
    skipped = move(run, tmp_path, "pcd", pcd(given), "--on-error", "skip")
    head, found = pcd_rows(skipped.data, given.dtype)
    assert (skipped.status, len(found)) == (3, 2)
    assert b"WIDTH 2\nHEIGHT 1\n" in head
    assert b"POINTS 2\n" in head


def test_integers_cannot_hold_what_is_moved(run: Run, tmp_path: Path) -> None:
    done = move(run, tmp_path, "pcd", pcd(cloud(3, "<i4")))
    assert (done.data, done.status) == (None, 2)
    assert "column x holds int32, where the result would be rounded" in done.err


def test_results_beside_what_they_come_from_are_new_fields(run: Run, tmp_path: Path) -> None:
    given = cloud(6, hist="<f4")
    done = move(run, tmp_path, "pcd", pcd(given), "--keep", "--prefix", "map_")
    kind = [*given.dtype.descr, *((f"map_{name}", "<f8") for name in "xyz")]
    head, found = pcd_rows(done.data, kind)
    assert b"FIELDS x y z hist map_x map_y map_z\nSIZE 4 4 4 4 8 8 8\nTYPE F F F F F F F\nCOUNT 1 1 1 1 1 1 1\n" in head
    assert VIEWPOINT + b"\n" in head
    assert np.allclose(xyz(found, "map_x", "map_y", "map_z"), moved(xyz(given)), rtol=1e-12, atol=1e-12)
    assert found["hist"].tobytes() == given["hist"].tobytes()


def test_what_comes_through_a_pipe_is_the_same(run: Run, tmp_path: Path) -> None:
    given = pcd(cloud(100, ring="<u2"))
    wanted = move(run, tmp_path, "pcd", given).data
    run("apply", "--transform", '{"xyz": [1.0, -2.0, 0.5], "rpy_deg": [0, 0, 30.0]}', "-o", "piped.pcd", stdin=given)
    assert (tmp_path / "piped.pcd").read_bytes() == wanted


def test_no_points_are_no_error(run: Run, tmp_path: Path) -> None:
    done = move(run, tmp_path, "pcd", pcd(cloud(0)))
    assert done.status == 0
    assert (done.data or b"").endswith(b"POINTS 0\nDATA binary\n")
