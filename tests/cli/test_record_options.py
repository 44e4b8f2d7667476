"""What the options of numbers and tables do to records."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]


def test_precision_leaves_the_position_of_a_record_as_it_is_written(run: Run) -> None:
    record = '{"xyz":[0.123456789,2,3],"rpy_deg":[0,0,0]}\n'
    for text in (record, record * 40):
        found = run("convert", "--to", "quaternion", "--precision", "2", stdin=text)
        assert found.out.count('"xyz":[0.123456789,2,3]') == text.count("\n")
        assert found.out.count("1.00") == text.count("\n")


@pytest.mark.parametrize("option", [("--keep",), ("--prefix", "a_")])
def test_options_of_tables_are_refused_for_records(run: Run, option: tuple[str, ...]) -> None:
    found = run("convert", "--to", "quaternion", *option, stdin='{"xyz":[1,2,3],"rpy_deg":[0,0,0]}\n')
    assert (found.status, found.out) == (2, "")


def test_normalize_reaches_the_tree_that_points_are_moved_by(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("frames:\n  map:\n    base: {xyz: [1, 0, 0], xyzw: [0, 0, 0, 2]}\n")
    refused = run("apply", str(tmp_path / "a.yaml"), "map", "base", "1", "0", "0")
    assert (refused.status, refused.out) == (1, "")
    assert "--normalize" in refused.err
    moved = run("apply", "--normalize", str(tmp_path / "a.yaml"), "map", "base", "1", "0", "0")
    assert (moved.status, moved.out) == (0, "frame: map\npoint: [2.0, 0.0, 0.0]\n")
