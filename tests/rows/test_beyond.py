"""The examples for other engines: each runs as it stands in examples/BEYOND.md, and moves points as we do, to the bit."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import console
import numpy as np
import pytest

import frametool

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.engines

PAGE = (console.ROOT / "examples" / "BEYOND.md").read_text()
EXAMPLES = dict(re.findall(r"\n## ([^\n]+)\n(?:(?!\n## )(?s:.))*?```python\n(.*?)```", PAGE, re.DOTALL))
PACKAGES = {"DuckDB": "duckdb", "Polars": "polars", "Spark": "pyspark", "Ray": "ray", "dask": "dask.bag"}
ROWS = 4000
XYZ = ("x", "y", "z")


def rows(at: Path) -> Any:
    """Return the table that a file, or a folder of files, holds, by the order of its ids."""
    pq = pytest.importorskip("pyarrow.parquet")
    files = sorted(at.glob("*.parquet")) if at.is_dir() else [at]
    tables = [pq.ParquetFile(file).read() for file in files]
    return sys.modules["pyarrow"].concat_tables(tables).sort_by("id")


def numbers(table: Any) -> np.ndarray[Any, Any]:
    """Return points as rows of numbers."""
    return np.stack([table[name].to_numpy() for name in XYZ], axis=1)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Make a folder with points in four row groups, and the trees of the examples."""
    pa = pytest.importorskip("pyarrow")
    xyz = np.random.default_rng(1).normal(size=(ROWS, 3)) * 20.0
    stamps = np.linspace(0, 4 * 10**9, ROWS).astype(np.int64)
    columns = {"id": np.arange(ROWS), "stamp_ns": stamps, **dict(zip(XYZ, xyz.T, strict=True))}
    pytest.importorskip("pyarrow.parquet").write_table(
        pa.table({**columns, "tag": [f"t{row}" for row in range(ROWS)]}), tmp_path / "points.parquet", row_group_size=1000
    )
    for name in ("robot.yaml", "drive.yaml"):
        shutil.copy(console.ROOT / "examples" / name, tmp_path)
    return tmp_path


def run(code: str, folder: Path) -> None:
    """Run an example as the file of a script."""
    script = folder / "example.py"
    script.write_text(code)
    path = os.pathsep.join([str(console.ROOT), os.environ.get("PYTHONPATH", "")])
    told = {"PYTHONPATH": path, "PYSPARK_PYTHON": sys.executable, "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0"}
    done = subprocess.run(
        [sys.executable, str(script)], cwd=folder, capture_output=True, text=True, check=False, env=os.environ | told
    )
    assert done.returncode == 0, done.stderr[-4000:]


def test_every_engine_has_its_example() -> None:
    assert set(EXAMPLES) == {*PACKAGES, "A moving frame"}


@pytest.mark.parametrize("engine", PACKAGES)
def test_an_engine_moves_points_as_transform_apply_does(engine: str, folder: Path) -> None:
    pytest.importorskip(PACKAGES[engine])
    if engine == "Spark" and shutil.which("java") is None:
        pytest.skip("Spark needs java")
    run(EXAMPLES[engine], folder)
    given, moved = rows(folder / "points.parquet"), rows(folder / "moved.parquet")
    wanted = frametool.load(folder / "robot.yaml").lookup("map", "lidar").apply(numbers(given))
    assert numbers(moved).tobytes() == wanted.tobytes()
    assert all(moved[name].to_pylist() == given[name].to_pylist() for name in ("id", "stamp_ns", "tag"))


def test_rows_are_moved_each_at_its_own_time(folder: Path) -> None:
    run(EXAMPLES["A moving frame"], folder)
    given, moved = rows(folder / "points.parquet"), rows(folder / "moved.parquet")
    drive = frametool.load(folder / "drive.yaml")
    wanted = drive.lookup_many("map", "lidar", given["stamp_ns"].to_numpy()).apply(numbers(given))
    assert numbers(moved).tobytes() == wanted.tobytes()
