"""Parquet and Arrow between frametool and others: files of Polars and DuckDB are read, and they read ours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import frametool

pytest.importorskip("pyarrow")
polars = pytest.importorskip("polars")
duckdb = pytest.importorskip("duckdb")

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

POSE = "{xyz: [1, -2, 0.5], rpy_deg: [10, 20, 30]}"
MOVER = frametool.Transform(frametool.Rotation.from_rpy(np.radians([10, 20, 30])), [1, -2, 0.5])
XYZ = np.random.default_rng(1).normal(size=(2000, 3)) * 20.0
TAGS = ["b", None] * 1000


def frame(kind: Any = polars.Float64) -> Any:
    """Make points between other columns."""
    points = {name: polars.Series(XYZ[:, at], dtype=kind) for at, name in enumerate("xyz")}
    return polars.DataFrame({"id": range(2000), **points, "tag": TAGS})


def by_polars(path: Path) -> None:
    frame().write_parquet(path, row_group_size=500)


def as_arrow_by_polars(path: Path) -> None:
    frame().write_ipc(path, compression="lz4")


def by_duckdb(path: Path) -> None:
    table = frame().to_arrow()
    with duckdb.connect() as connection:
        connection.register("points", table)
        connection.execute(f"COPY (FROM points) TO '{path}' (FORMAT parquet, COMPRESSION zstd, ROW_GROUP_SIZE 2048)")


WAYS = {"p.parquet": by_polars, "d.parquet": by_duckdb, "p.arrow": as_arrow_by_polars}


def read_by_polars(path: Path) -> Any:
    readers = {".parquet": polars.read_parquet, ".arrow": polars.read_ipc}
    return readers[path.suffix](path)


@pytest.mark.parametrize("name", WAYS)
def test_files_of_others_are_moved_and_read_by_them(run: Callable[..., Outcome], tmp_path: Path, name: str) -> None:
    WAYS[name](tmp_path / name)
    done = run("apply", "--transform", POSE, "-i", name, "-o", f"moved.{name}")
    assert (done.status, done.err) == (0, "")
    moved = read_by_polars(tmp_path / f"moved.{name}")
    assert moved.select("x", "y", "z").to_numpy().tobytes() == MOVER.apply(XYZ).tobytes()
    assert moved.schema == read_by_polars(tmp_path / name).schema
    assert moved["id"].to_list() == list(range(2000))
    assert moved["tag"].to_list() == TAGS


def test_duckdb_reads_what_was_made_of_a_table_of_text(run: Callable[..., Outcome], tmp_path: Path) -> None:
    frame().write_csv(tmp_path / "points.csv")
    assert run("apply", "--transform", POSE, "-i", "points.csv", "-o", "points.parquet").status == 0
    with duckdb.connect() as connection:
        rows = connection.execute(f"SELECT x, y, z, id, tag FROM '{tmp_path}/points.parquet'").fetchnumpy()  # noqa: S608
        types = connection.execute(f"DESCRIBE FROM '{tmp_path}/points.parquet'").fetchall()
    assert np.stack([rows[name] for name in "xyz"], axis=1).tobytes() == MOVER.apply(XYZ).tobytes()
    assert {name: kind for name, kind, *_ in types} == {"x": "DOUBLE", "y": "DOUBLE", "z": "DOUBLE", "id": "BIGINT", "tag": "VARCHAR"}
    assert rows["id"].tolist() == list(range(2000))
