"""Tables of results: those whose rows wait, block after block, are those of all rows at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from frametool.formats.rows import csv
from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style
from frametool.rows.sinks.results import BlockResults, CsvTable

if TYPE_CHECKING:
    from conftest import Sizes

STYLE = Style("csv", (notation("quaternion"),))
PLAIN = Result(Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), None, "map"), {"stamp_ns": 5})
NAMED = Result(Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), 'a "b"\nc', None), {"note": "x,\ny"})
POINT = {"frame": "map", "point": [1.0, 2.0, 3.0], "stamp_ns": 7}
SEQUENCES: list[list[Any]] = [
    [], [PLAIN], [PLAIN, NAMED, PLAIN], [NAMED, PLAIN] * 3, [PLAIN] * 5 + [NAMED], [POINT] * 4,
    [PLAIN, NAMED, PLAIN, POINT, PLAIN], [POINT, NAMED],
]  # fmt: skip


def table(values: list[Any], most: int) -> str:
    """Write values as a table, so many of them in a block."""
    made = CsvTable(STYLE)
    for first in range(0, len(values), most):
        made.of_block(BlockResults((), [*enumerate(values[first : first + most])]))
    return b"".join(made.end()).decode()


@pytest.mark.parametrize("few", [1, 2, 4])
@pytest.mark.parametrize("values", SEQUENCES)
def test_rows_that_wait_are_the_table_of_all_at_once(values: list[Any], few: int, sizes: Sizes) -> None:
    at_once = csv.write_poses(values, STYLE)
    assert table(values, few) == at_once
    sizes(table=few)
    assert table(values, few) == at_once


def test_poses_and_points_stand_in_columns_of_their_own() -> None:
    assert table([PLAIN, POINT], 1) == (
        "parent,x,y,z,qx,qy,qz,qw,stamp_ns,frame\nmap,1.0,2.0,3.0,0.0,0.0,0.0,1.0,5,\n,1.0,2.0,3.0,,,,,7,map\n"
    )
