"""Clouds whose headers lie, files that are cut, bytes that are others: one line, or all the rows that there are."""

from __future__ import annotations

import io
import re
import tracemalloc
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from clouds import cloud, pcd, ply
from oracles_of_use import cases

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random
    from typing import Any

    from oracles_of_use import Tool

CLOUD = cloud(30, ring="<u4")
FACES = "element face 3\nproperty list uchar int vi\n"
LIES = [b"0", b"1", b"29", b"31", b"-1", b"4000000000", b"99999999999999999999", b"1e3", b"", b"f", b"i8", b"3 3", b"\xff"]
MOST = 30e6  # bytes: what the batches of a good file take, too


def _npy(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def _las(*, packed: bool) -> bytes:
    laspy = pytest.importorskip("laspy")
    pytest.importorskip("lazrs")
    data = laspy.LasData(laspy.LasHeader(version="1.4", point_format=6))
    data.x, data.y, data.z = (CLOUD[axis] for axis in "xyz")
    file = io.BytesIO()
    data.write(file, do_compress=packed)
    return file.getvalue()


def _arrow(form: str) -> bytes:
    pa, feather = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.feather")
    table = pa.table({name: CLOUD[name] for name in CLOUD.dtype.names or ()})
    file = io.BytesIO()
    if form == "parquet":
        pytest.importorskip("pyarrow.parquet").write_table(table, file)
    else:
        feather.write_feather(table, file, compression="uncompressed")
    return file.getvalue()


GOOD: dict[str, Callable[[], bytes]] = {
    "pcd": lambda: pcd(CLOUD),
    "text.pcd": lambda: pcd(CLOUD, "ascii"),
    "ply": lambda: ply(CLOUD),
    "text.ply": lambda: ply(CLOUD, "ascii"),
    "mesh.ply": lambda: ply(CLOUD, after=FACES) + b"\x03\0\0\0\0\1\0\0\0\2\0\0\0" * 3,
    "npy": lambda: _npy(CLOUD),
    "plain.npy": lambda: _npy(np.zeros((30, 3))),
    "las": lambda: _las(packed=False),
    "laz": lambda: _las(packed=True),
    "parquet": lambda: _arrow("parquet"),
    "arrow": lambda: _arrow("arrow"),
}


def damaged(random: Random, data: bytes) -> bytes:
    """Lie in a number of the header, cut, add, or change bytes."""
    kind = random.randrange(5)
    head = list(re.finditer(rb"\d+", data[:400]))
    if kind < 2 and head:
        found = random.choice(head)
        return data[: found.start()] + random.choice(LIES) + data[found.end() :]
    if kind == 2:
        return data[: random.randrange(len(data))]
    if kind == 3:
        return data + random.randbytes(random.randrange(1, 200))
    changed = bytearray(data)
    for _ in range(random.randrange(1, 6)):
        at = random.randrange(min(len(data), 500) if random.random() < 0.7 else len(data))
        changed[at] = random.randrange(256)
    return bytes(changed)


@pytest.mark.parametrize("name", GOOD)
def test_a_cloud_that_lies_is_one_line_or_has_the_rows_that_it_says(tool: Tool, name: str) -> None:
    good = GOOD[name]()
    Path(f"in.{name}").write_bytes(good)
    assert tool("convert", "-i", f"in.{name}", "-f", "csv", "--quiet").out.count(b"\n") == 31
    form = name.rpartition(".")[2]
    for random in cases(0.2):
        data = damaged(random, good)
        Path(f"in.{name}").write_bytes(data)
        into = random.choice(["csv", "npy", "pcd", "json"])
        tracemalloc.start()
        try:
            done = tool("apply", "--transform", "{xyz: [1, 0, 0]}", "--in", form, "-i", f"in.{name}", "-f", into, "-o", "out", "--force", "--quiet")
            most = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert most < MOST
        errors = [line for line in done.err.splitlines() if "warning:" not in line]
        assert done.status == 0 or len(errors) == 1, errors
        assert all(len(line) <= 400 for line in errors)
