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


@pytest.mark.parametrize("text", ['{"xyz": [1, 2, 3]}\n', "xyz: [1, 2, 3]\n"])
def test_a_record_alone_is_compared_with_nothing(run: Run, text: str) -> None:
    for rows in (1, 40):
        found = run("relative", stdin=(text if text.startswith("{") else text + "---\n") * rows)
        assert (found.status, found.out) == (1, "")
        assert found.err == (
            "frametool: stdin:1:1: a record holds one pose; name A or B, or compare it with the one before by --consecutive\n"
        )


def test_a_pose_with_neither_position_nor_rotation_is_the_identity_in_text(run: Run) -> None:
    assert run("invert", "{name: a}", "-f", "text").out == "a pose seen from a\n  identity\n"
    assert run("invert", "{name: a, parent: b}", "-f", "text").out.endswith("\n  identity\n")


@pytest.mark.parametrize("fraction", ["1e16", "1e160", "-1e200", "1e308"])
def test_poses_turned_alike_stay_so_at_every_fraction(run: Run, fraction: str) -> None:
    poses = ["{xyz: [1, 0, 0], rpy_deg: [0, 0, 90]}"] * 2
    found = run("interpolate", "--", *poses, fraction)
    assert (found.status, found.err) == (0, "")
    assert "quaternion: {x: 0.0, y: 0.0, z: 0.7071067811865476, w: 0.7071067811865476}" in found.out
