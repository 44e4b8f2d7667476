"""The same rows in every form come out to the same bits."""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from clouds import pcd, pcd_rows, ply, ply_rows

from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style
from frametool.rows.batch import block_of
from frametool.rows.shapes import NOWHERE
from frametool.rows.sinks.as_rows import RowsWriter
from frametool.rows.sinks.results import BlockResults

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

POSE = "{xyz: [1, -2, 0.5], rpy_deg: [10, 20, 30]}"
POINTS = np.random.default_rng(9).normal(size=(200, 3)) * 10.0 ** np.random.default_rng(8).integers(-8, 8, (200, 1))
NAMED = np.zeros(200, [(name, "<f8") for name in "xyz"])
for column, axis in enumerate("xyz"):
    NAMED[axis] = POINTS[:, column]
ROWS = POINTS.tolist()


def saved(save: Callable[..., None], *arrays: Any, **named: Any) -> bytes:
    file = io.BytesIO()
    save(file, *arrays, **named)
    return file.getvalue()


def rows_of(array: Any) -> Any:
    """Return an array with or without names as rows."""
    return np.array([array[name] for name in "xyz"]).T if array.dtype.names else array


FORMS: dict[str, tuple[bytes, Callable[[bytes], Any]]] = {
    "csv": (
        "\n".join(["x,y,z", *(",".join(map(repr, row)) for row in ROWS), ""]).encode(),
        lambda data: [[float(cell) for cell in line.split(",")] for line in data.decode().splitlines()[1:]],
    ),
    "jsonl": (
        "".join(json.dumps({"point": row}) + "\n" for row in ROWS).encode(),
        lambda data: [json.loads(line)["point"] for line in data.splitlines()],
    ),
    "npy": (saved(np.save, POINTS), lambda data: rows_of(np.load(io.BytesIO(data)))),
    "pcd": (pcd(NAMED), lambda data: rows_of(pcd_rows(data, NAMED.dtype)[1])),
    "ply": (ply(NAMED), lambda data: rows_of(ply_rows(data, NAMED.dtype, 200)[1])),
}


@pytest.fixture
def moved(run: Run, tmp_path: Path) -> Callable[[str, str], bytes]:
    """Move the points from one form into another."""

    def call(form: str, into: str) -> bytes:
        out = tmp_path / f"out.{into}"
        done = run("apply", "--transform", POSE, "-i", f"in.{form}", "-o", out.name, "--force", files={f"in.{form}": FORMS[form][0]})
        assert done.status == 0, done.err
        return out.read_bytes()

    return call


@pytest.mark.parametrize("into", FORMS)
@pytest.mark.parametrize("form", FORMS)
def test_any_form_becomes_any_other_with_the_same_bits(moved: Callable[[str, str], bytes], form: str, into: str) -> None:
    wanted = np.array(FORMS["csv"][1](moved("csv", "csv")))
    assert np.array(FORMS[into][1](moved(form, into)), np.float64).tobytes() == wanted.tobytes()


@pytest.mark.parametrize("form", ["csv", "json"])
def test_blocks_whose_rows_all_name_one_frame_each_name_their_own(form: str) -> None:
    frames = ("map", "odom")
    results: list[Any] = [[*enumerate([Result(Pose.of(NOWHERE, None, frame))] * 2)] for frame in frames]
    blocks = [block_of(BlockResults((), values)) for values in results]
    writer = RowsWriter(Style(form, (notation("quaternion"),)), blocks[0])
    texts = [writer.of_block(block).decode() for block in blocks]
    assert ["map" in text for text in texts] == [True, False]
    assert ["odom" in text for text in texts] == [False, True]


COLUMNS = (
    ["7", "-1.5e3", "true"], ["7", "007", " 8"], ["a b", "truer", "c,d"], ["a", "true", "n"], ["", "1", "2"], ["1\n2", "3", "4"], ["a\nb", "c", "d"],
    ['a "b"', "c", "é"], ["a ", "b", "c"], ["null", "a", "b"],
)  # fmt: skip


@pytest.mark.parametrize("cells", COLUMNS, ids=repr)
def test_a_column_of_a_table_is_written_as_json_alike_in_many_rows_and_in_one(run: Callable[..., Any], cells: list[str]) -> None:
    rows = ['1,2,3,"' + cell.replace('"', '""') + '"\n' for cell in cells]
    many = run("convert", "-f", "json", stdin="x,y,z,more\n" + "".join(rows)).out
    assert many == "".join(run("convert", "-f", "json", stdin=f"x,y,z,more\n{row}").out for row in rows)
