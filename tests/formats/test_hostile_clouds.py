"""Clouds that are cut, lie about themselves or are none: one line that says where and what, no file, no memory."""

from __future__ import annotations

import io
import struct
import tracemalloc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from clouds import cloud, move, pcd, ply

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

CLOUD = cloud(3, ring="<u4")
GOOD, TEXT, PACKED = (pcd(CLOUD, data) for data in ("binary", "ascii", "binary_compressed"))
PLY, TEXT_PLY = ply(CLOUD), ply(CLOUD, "ascii")
FACE = "element face 1\nproperty list uchar int vi\n"


def told(data: bytes, old: bytes, new: bytes) -> bytes:
    """Change what a header says."""
    assert old in data
    return data.replace(old, new, 1)


def sizes(packed: int, plain: int, body: bytes = b"") -> bytes:
    """Return packed points that say these sizes."""
    return PACKED[: -CLOUD.nbytes] + struct.pack("<II", packed, plain) + body


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (GOOD[:-1], "in.pcd: the header says 3 points of 16 bytes, the file holds 2; is it whole?"),
        (GOOD + GOOD[-16:], "in.pcd: the header says 3 points of 16 bytes, the file holds 4; correct the header"),
        (GOOD.replace(b" 3\n", b" 100000000\n"), "in.pcd: the header says 100000000 points of 16 bytes, the file holds 3; is it whole?"),
        (told(GOOD, b"POINTS 3", b"POINTS 4"), "in.pcd:11: POINTS is 4, WIDTH 3 times HEIGHT 1 is 3; correct the one that is wrong"),
        (told(GOOD, b"POINTS 3", b"POINTS -3"), "in.pcd:11: POINTS '-3' is not a count"),
        (told(GOOD, b"POINTS 3", b"POINTS 3 4"), "in.pcd:11: POINTS '3 4' is not a count"),
        (told(GOOD, b"FIELDS x y z ring", b"FIELDS x y x ring"), "in.pcd:4: field 'x' appears twice"),
        (told(GOOD, b"SIZE 4 4 4 4", b"SIZE 4 4 4"), "in.pcd:5: SIZE has 3 values for 4 fields"),
        (told(GOOD, b"SIZE 4 4 4 4", b"SIZE 4 4 4 3"), "in.pcd:5: TYPE 'U' with SIZE '3' of field 'ring' is not known; known: F with 4, 8; I with 1, 2, 4, 8; U with 1, 2, 4, 8"),
        (told(GOOD, b"TYPE F F F U", b"TYPE F F F Q"), "in.pcd:6: TYPE 'Q' with SIZE '4' of field 'ring' is not known; known: F with 4, 8; I with 1, 2, 4, 8; U with 1, 2, 4, 8"),
        (told(GOOD, b"COUNT 1 1 1 1", b"COUNT 1 1 1 99999999999"), "in.pcd:7: more than 65536 values a point"),
        (told(GOOD, b"HEIGHT 1", b"HIGHT 1"), "in.pcd:9: 'HIGHT' is not a key of a PCD header; keys: COLUMNS, COUNT, DATA, FIELDS, HEIGHT, POINTS, SIZE, TYPE, VERSION, VIEWPOINT, WIDTH"),
        (told(GOOD, b"VIEWPOINT 0", b"VIEWPOINT"), "in.pcd:10: VIEWPOINT has 6 numbers, expected 7 (tx ty tz qw qx qy qz)"),
        (told(GOOD, b"VIEWPOINT 0", b"VIEWPOINT nan"), "in.pcd:10: VIEWPOINT: 'nan' is not finite"),
        (told(GOOD, b"DATA binary", b"DATA bin"), "in.pcd:12: DATA 'bin' is not known; known: ascii, binary, binary_compressed"),
        (told(GOOD, b"SIZE 4 4 4 4\n", b"SIZE 4 4 4 4\nSIZE 4 4 4 4\n"), "in.pcd:6: SIZE appears twice, first on line 5"),
        (told(GOOD, b"TYPE F F F U\n", b""), "in.pcd:11: the header has no TYPE"),
        (GOOD[: GOOD.index(b"DATA")], "in.pcd:12: the header ends before its DATA line; is the file whole?"),
        (TEXT[: TEXT.rindex(b"\n", 0, -1)], "in.pcd: the header says 3 points, the file holds 2"),
        (TEXT.replace(b" 3\n", b" 100000000\n"), "in.pcd: the header says 100000000 points, the file holds 3"),
        (TEXT + b"1 2 3 4\n", "in.pcd:16: the header says 3 points, more rows follow; correct the header"),
        (TEXT.replace(b" 3\n", b" 4\n") + b"1 2 3\n", "in.pcd:16: expected 4 numbers (x y z ring), found 3"),
        (TEXT.replace(b" 3\n", b" 4\n") + b"1 2,5 3 4\n", "in.pcd:16: y: '2,5' has a decimal comma; write a point"),
        (sizes(10, 48), "in.pcd: the file ends within the packed points, 10 bytes are missing"),
        (sizes(3, 48, b"\x00a\x00"), "in.pcd: the packed points cannot be unpacked: it ends in the middle of a run"),
        (sizes(3, 48, b"\x00a\x00b"), "in.pcd: more bytes follow the packed points"),
        (sizes(4, 47, b"\x00a\x00b"), "in.pcd: the header says 3 points of 16 bytes, the packed data says 47 bytes"),
        (sizes(3, 16 * 10**8, b"\x00ab").replace(b" 3\n", b" 100000000\n"), "in.pcd: the packed points cannot be unpacked: 3 packed bytes cannot hold 1600000000"),
        (PACKED[: -CLOUD.nbytes], "in.pcd: the file ends within the sizes behind DATA, 8 bytes are missing"),
    ],
)  # fmt: skip
def test_a_broken_pcd_is_one_line(run: Run, tmp_path: Path, data: bytes, message: str) -> None:
    done = move(run, tmp_path, "pcd", data, "--quiet")
    errors = [line for line in done.err.splitlines() if "warning:" not in line]
    assert (done.data, done.status, errors) == (None, 1, [f"frametool: {message}"])


def test_too_many_fields_without_counts_are_one_line(run: Run, tmp_path: Path) -> None:
    many = {"FIELDS": "_", "SIZE": "1", "TYPE": "U"}
    head = "".join(f"{key} {f'{word} ' * 65537}\n" for key, word in many.items())
    done = move(run, tmp_path, "pcd", f"# .PCD v0.7\nVERSION 0.7\n{head}WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary\n".encode(), "--quiet")
    assert (done.status, done.err) == (1, "frametool: in.pcd: more than 65536 values a point\n")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (PLY[:-1], "in.ply: the header says 3 vertices of 16 bytes, the file holds 2; is it whole?"),
        (PLY + PLY[-16:], "in.ply: the header says 3 vertices of 16 bytes, the file holds 4; correct the header"),
        (told(PLY, b"vertex 3", b"vertex 100000000"), "in.ply: the header says 100000000 vertices of 16 bytes, the file holds 3; is it whole?"),
        (told(PLY, b"vertex 3", b"vertex -3"), "in.ply:5: '-3' of element 'vertex' is not a count"),
        (told(PLY, b"vertex 3", b"vertex"), "in.ply:5: 'element vertex': expected element NAME COUNT, each name once"),
        (told(PLY, b"vertex 3", b"vertices 3"), "in.ply: no element 'vertex'; elements: vertices"),
        (told(PLY, b"binary_little", b"binary_litle"), "in.ply:2: 'format binary_litle_endian 1.0': expected one format: ascii, binary_little_endian, binary_big_endian, and 1.0"),
        (told(PLY, b"format binary_little_endian 1.0\n", b""), "in.ply:9: the header has no format; formats: ascii, binary_little_endian, binary_big_endian"),
        (told(PLY, b"property float y", b"property flot y"), "in.ply:7: 'property flot y': expected property TYPE NAME below an element, or property list INTEGER TYPE NAME, each name once; types: char, uchar, short, ushort, int, uint, float, double, int8, uint8, int16, uint16, int32, uint32, float32, float64, int64, uint64"),
        (told(PLY, b"property float y", b"property float x"), "in.ply:7: 'property float x': expected property TYPE NAME below an element, or property list INTEGER TYPE NAME, each name once; types: char, uchar, short, ushort, int, uint, float, double, int8, uint8, int16, uint16, int32, uint32, float32, float64, int64, uint64"),
        (told(PLY, b"property float y", b"propert float y"), "in.ply:7: 'propert float y': expected format, element, property, comment, obj_info or end_header at its beginning"),
        (told(PLY, b"property uint ring", b"property list uchar int ring"), "in.ply:5: the list 'ring' within 'vertex' is not read; write it as an element of its own, or leave it out"),
        (ply(CLOUD, before=FACE), "in.ply:5: element 'face' with the list 'vi' is before 'vertex'; write 'vertex' first, or the file as ascii"),
        (ply(CLOUD, before="element cam 10000000000\nproperty float f\n"), "in.ply: the file ends within the elements before the vertices, 39999999952 bytes are missing"),
        (PLY[: PLY.index(b"end_header")], "in.ply:10: the header ends before its `end_header` line; is the file whole?"),
        (TEXT_PLY[: TEXT_PLY.rindex(b"\n", 0, -1)], "in.ply: the header says 3 points, the file holds 2"),
        (TEXT_PLY + b"1 2 3 4\n", "in.ply:14: the header says 3 points, more rows follow; correct the header"),
        (ply(CLOUD, "ascii", after=FACE).replace(b"vertex 3", b"vertex 2") + b"3 0 1 2\n", "in.ply: after the vertices there are 2 lines, the header says 1; correct the header"),
    ],
)  # fmt: skip
def test_a_broken_ply_is_one_line(run: Run, tmp_path: Path, data: bytes, message: str) -> None:
    done = move(run, tmp_path, "ply", data, "--quiet")
    errors = [line for line in done.err.splitlines() if "warning:" not in line]
    assert (done.data, done.status, errors) == (None, 1, [f"frametool: {message}"])


@pytest.mark.parametrize(("form", "data"), [("pcd", GOOD), ("ply", PLY)])
def test_a_file_that_is_cut_anywhere_leaves_nothing(run: Run, tmp_path: Path, form: str, data: bytes) -> None:
    for end in range(0, len(data), 7):
        done = move(run, tmp_path, form, data[:end], "--quiet")
        assert (done.data, done.status) == (None, 1), end
        assert sum("warning:" not in line for line in done.err.splitlines()) == 1


@pytest.mark.parametrize(
    ("form", "data"),
    [
        ("pcd", GOOD.replace(b" 3\n", b" 100000000\n")),
        ("pcd", TEXT.replace(b" 3\n", b" 100000000\n")),
        ("pcd", sizes(3, 16 * 10**8, b"\x00ab").replace(b" 3\n", b" 100000000\n")),
        ("ply", PLY.replace(b"vertex 3", b"vertex 100000000")),
        ("ply", ply(CLOUD, before="element cam 1000000000\nproperty float f\n")),
    ],
)
@pytest.mark.parametrize("way", ["file", "pipe"])
def test_no_memory_is_taken_for_points_that_are_not_there(run: Run, tmp_path: Path, form: str, data: bytes, way: str) -> None:
    move(run, tmp_path, form, PLY if form == "ply" else GOOD)  # what is loaded once
    tracemalloc.start()
    try:
        if way == "pipe":
            status = run("apply", "--transform", "{}", "-o", "out", "-f", form, "--force", stdin=data).status
        else:
            status = move(run, tmp_path, form, data, "--quiet").status
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert status == 1
    assert most < 20e6


def test_an_array_that_lies_about_its_length_is_refused(run: Run, tmp_path: Path) -> None:
    array = io.BytesIO()
    np.save(array, np.zeros((40, 3)))
    done = move(run, tmp_path, "npy", array.getvalue().replace(b"(40, 3)", b"(99, 3)"))
    assert (done.data, done.status) == (None, 1)
    assert done.err == "frametool: in.npy: the header says 99 rows of 24 bytes, the file holds 40; is it whole?\n"
