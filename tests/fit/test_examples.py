"""The measurements of examples/ are those that the script makes, and what is wrong in them is found."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import make_measurements
import numpy as np
import pytest

import frametool

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

FILES = make_measurements.files()
EXAMPLES = make_measurements.FOLDER


@pytest.mark.parametrize("name", FILES)
def test_the_files_are_those_that_the_script_writes(name: str) -> None:
    """Write them with `python tests/make_measurements.py`."""
    assert (EXAMPLES / name).read_text() == FILES[name]


def test_the_tree_is_that_of_the_robot_without_the_inverted_row() -> None:
    found, robot = frametool.solve(EXAMPLES / "measurements.yaml"), frametool.load(EXAMPLES / "robot.yaml")
    assert np.flatnonzero(~found.used).tolist() == [make_measurements.INVERTED]
    assert found.fits[make_measurements.INVERTED] == "inverted"
    assert np.flatnonzero(~found.checked).tolist() == [19]
    assert (len(found.frames), len(found.measurements)) == (7, 20)
    for name in found.frames[1:-1]:
        off = found.poses[name].distance(robot.lookup("base_link", name))
        covariance = found.covariance("base_link", name)
        assert covariance is not None
        assert off[0] < 3 * np.sqrt(np.trace(covariance[:3, :3]))
        assert off[1] < 3 * np.sqrt(np.trace(covariance[3:, 3:]))


@pytest.mark.parametrize("files", [["gripper.csv", "target.csv"], ["hand_eye_samples.json"]])
def test_the_camera_is_where_it_was_put(run: Run, files: list[str]) -> None:
    found = run("solve", "--hand-eye", *(str(EXAMPLES / name) for name in files), "-f", "json")
    camera = next(each for each in json.loads(found.out)["frames"] if each["name"] == "camera")
    assert np.linalg.norm(np.array(camera["xyz"]) - make_measurements.MOUNT.xyz) < 1.5e-3
    assert found.status == 0
    assert ("1 outlier rejected" in found.err) == (len(files) > 1)


def test_the_marks_are_those_of_one_workpiece(run: Run) -> None:
    found = run("solve", "--points", *(str(EXAMPLES / name) for name in ("points_a.csv", "points_b.csv")), "-f", "json")
    part = json.loads(found.out)["frames"][1]
    np.testing.assert_allclose(part["xyz"], [1.2, -0.4, 0.85], atol=5e-4)
    assert found.status == 0
    assert "m7" in found.err.split()


def test_the_tag_is_where_most_see_it(run: Run) -> None:
    found = run("mean", str(EXAMPLES / "tag_seen.csv"), "--robust", "-f", "json")
    assert found.status == 0
    np.testing.assert_allclose(json.loads(found.out)["xyz"], make_measurements.TAG.xyz, atol=5e-3)
    assert [line.split(":")[3] for line in found.err.splitlines()] == ["6", "10"]
