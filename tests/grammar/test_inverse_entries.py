"""`inverse: true` turns a pose around however its position is called."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome


@pytest.mark.parametrize("key", ["xyz", "translation", "position"])
def test_an_inverse_entry_is_turned_around_under_each_name(key: str, run: Callable[..., Outcome]) -> None:
    tree = f"frames: {{a: {{b: {{{key}: [1, 2, 3], inverse: true}}}}}}"
    found = json.loads(run("lookup", "t.yaml", "a", "b", "-f", "json", files={"t.yaml": tree}).out)
    assert found["xyz"] == [-1.0, -2.0, -3.0]
