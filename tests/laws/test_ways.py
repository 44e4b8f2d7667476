"""Every way of a row keeps its bytes: what comes out, what is told, the status, the file (see make_ways.py)."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import console
import pytest
from make_ways import WAYS, Way, left_behind, outcome, stored

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

STORED = stored()
BY_BLAS = re.compile("mean|odometry|sigmas|uncertain")  # the last digits of a product of matrices are the processor's


@pytest.mark.parametrize("way", WAYS, ids=[way.name for way in WAYS])
def test_a_way_keeps_its_bytes(run: Callable[..., Outcome], tmp_path: Path, way: Way) -> None:
    done = run(*way.arguments, stdin=way.stdin, files=dict(way.files))
    found = outcome(done.status, done.out.encode(), done.err.encode(), left_behind(tmp_path, way))
    if BY_BLAS.search(way.name):
        assert {key: split(value)[0] for key, value in found.items()} == {key: split(value)[0] for key, value in STORED[way.name].items()}
        for key, value in found.items():
            assert split(value)[1] == pytest.approx(split(STORED[way.name][key])[1], rel=1e-12, abs=1e-15)
    else:
        assert found == STORED[way.name]


def split(value: Any) -> tuple[list[str], list[float]]:
    """Part what a way left behind into words and numbers."""
    return console.split(json.dumps(value))


def test_the_stored_ways_are_those_of_the_table() -> None:
    assert list(STORED) == [way.name for way in WAYS]
