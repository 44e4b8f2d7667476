"""Every way of a row keeps its bytes: what comes out, what is told, the status, the file (see make_ways.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from make_ways import WAYS, Way, left_behind, outcome, stored

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

STORED = stored()


@pytest.mark.parametrize("way", WAYS, ids=[way.name for way in WAYS])
def test_a_way_keeps_its_bytes(run: Callable[..., Outcome], tmp_path: Path, way: Way) -> None:
    done = run(*way.arguments, stdin=way.stdin, files=dict(way.files))
    found = outcome(done.status, done.out.encode(), done.err.encode(), left_behind(tmp_path, way))
    assert found == STORED[way.name]


def test_the_stored_ways_are_those_of_the_table() -> None:
    assert list(STORED) == [way.name for way in WAYS]
