"""Tables whose rows come one after the other are those of all rows at once."""

from __future__ import annotations

from typing import Any

import pytest

from frametool.formats.rows import csv_spool
from frametool.formats.rows.csv import write_points, write_poses
from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style

STYLE = Style("csv", (notation("quaternion"),))
PLAIN = Result(Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), None, "map"), {"stamp_ns": 5})
NAMED = Result(Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), 'a "b"\nc', None), {"note": "x,\ny"})
POINT = {"frame": "map", "point": [1.0, 2.0, 3.0], "stamp_ns": 7}
SEQUENCES: list[list[Any]] = [
    [], [PLAIN], [PLAIN, NAMED, PLAIN], [NAMED, PLAIN] * 3, [PLAIN] * 5 + [NAMED], [POINT] * 4,
    [PLAIN, NAMED, PLAIN, POINT, PLAIN], [POINT, NAMED],
]  # fmt: skip


@pytest.mark.parametrize("batch", [1, 2, 1000])
@pytest.mark.parametrize("values", SEQUENCES)
def test_rows_one_by_one_are_the_table_of_all_at_once(values: list[Any], batch: int, monkeypatch: Any) -> None:
    monkeypatch.setattr(csv_spool, "BATCH", batch)
    if all(isinstance(each, Result) for each in values):
        expected = write_poses(values, STYLE)
    else:
        expected = write_points([each.mapping(STYLE) if isinstance(each, Result) else each for each in values], STYLE)
    assert "".join(csv_spool.table_pieces(iter(values), STYLE)) == expected
