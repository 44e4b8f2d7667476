"""nuScenes: sensors on the vehicle by name, the vehicle in time, what is refused."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from frametool.errors import FormatError
from frametool.formats.load import load

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

FRONT = {"token": "c1", "sensor_token": "s1", "translation": [1.7, 0.0, 1.5], "rotation": [0.5, -0.5, 0.5, -0.5], "camera_intrinsic": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}
TOP = {"token": "c2", "sensor_token": "s2", "translation": [0.9, 0, 1.8], "rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]], "camera_intrinsic": []}
SENSORS = [{"token": "s1", "channel": "CAM_FRONT", "modality": "camera"}, {"token": "s2", "channel": "LIDAR_TOP", "modality": "lidar"}]
EGO = [{"token": f"e{n}", "timestamp": 1531883530449377 + 500000 * n, "rotation": [1, 0, 0, 0], "translation": [411.25 + n, 1180.75, 0]} for n in (0, 1)]


def put(folder: Path, **tables: Any) -> None:
    for name, records in tables.items():
        (folder / f"{name}.json").write_text(json.dumps(records))


def test_sensors_have_their_names_and_w_first(tmp_path: Path) -> None:
    put(tmp_path, calibrated_sensor=[FRONT, TOP], sensor=SENSORS)
    tree = load(tmp_path / "calibrated_sensor.json")
    assert tree.frames == ("ego", "CAM_FRONT", "LIDAR_TOP")
    assert tree.lookup("ego", "CAM_FRONT").components == (1.7, 0.0, 1.5, -0.5, 0.5, -0.5, 0.5)
    assert tree.lookup("ego", "LIDAR_TOP").components == (0.9, 0.0, 1.8, 0.0, 0.0, 0.5**0.5, 0.5**0.5)


def test_names_may_come_from_another_folder(run: Callable[..., Any], tmp_path: Path) -> None:
    put(tmp_path, calibrated_sensor=[FRONT])
    (tmp_path / "other").mkdir()
    put(tmp_path / "other", sensor=SENSORS)
    assert "name: CAM_FRONT" in run("tree", "calibrated_sensor.json", "--with", "other/sensor.json").out
    alone = run("tree", "calibrated_sensor.json")
    assert "name: s1" in alone.out
    assert "sensors are called by their tokens (sensor.json has the names: --with it)" in alone.err


def test_the_vehicle_moves_by_microseconds(tmp_path: Path) -> None:
    put(tmp_path, calibrated_sensor=[FRONT], sensor=SENSORS, ego_pose=EGO)
    tree = load(tmp_path / "calibrated_sensor.json", tmp_path / "ego_pose.json")
    assert tree.latest("global", "CAM_FRONT") == 1531883530949377000
    assert tree.lookup("global", "CAM_FRONT", at_ns=1531883530699377000).xyz.tolist() == pytest.approx([413.45, 1180.75, 1.5])


def test_a_sensor_with_several_poses_is_called_by_its_token_too(tmp_path: Path) -> None:
    moved = FRONT | {"token": "c3", "translation": [1.8, 0, 1.5]}
    put(tmp_path, calibrated_sensor=[FRONT, FRONT | {"token": "c9"}, moved, TOP], sensor=SENSORS)
    assert load(tmp_path / "calibrated_sensor.json").frames == ("ego", "CAM_FRONT/c1", "CAM_FRONT/c3", "LIDAR_TOP")


def test_frames_are_called_as_told(tmp_path: Path) -> None:
    put(tmp_path, ego_pose=EGO)
    assert set(load(tmp_path / "ego_pose.json", frames=("map", "car")).frames) == {"map", "car"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1.7", '"x"', "'x' is not a number"),
        ("1.7", "NaN", "'NaN' is not finite"),
        ("[0.5, -0.5, 0.5, -0.5]", "[0.5, -0.5, 0.5]", "expected 4 numbers (qw qx qy qz), found 3"),
        ("[0.5, -0.5, 0.5, -0.5]", "[[0, 0, 0], [0, 0, 0], [0, 0, 0]]", "is singular; no rotation is nearest to it"),
        ("[0.5, -0.5, 0.5, -0.5]", "[1, -0.5, 0.5, -0.5]", "quaternion"),
        ('"translation"', '"translatio"', "missing translation"),
    ],
)
def test_what_is_wrong_is_one_placed_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    (tmp_path / "a.json").write_text(json.dumps([FRONT]).replace(old, new, 1))
    with pytest.raises(FormatError) as caught:
        load(tmp_path / "a.json", format="nuscenes")
    assert caught.value.line == 1
    assert said in str(caught.value)


def test_a_table_without_poses_says_where_they_are(tmp_path: Path) -> None:
    put(tmp_path, sample_data=[{"token": "a", "sample_token": "b", "ego_pose_token": "c"}], ego_pose=[EGO[0] | {"timestamp": 1.5}])
    with pytest.raises(FormatError, match=r"no poses in this table of nuScenes: they are in calibrated_sensor.json and ego_pose.json"):
        load(tmp_path / "sample_data.json")
    with pytest.raises(FormatError, match=r"expected whole microseconds, found '1.5'"):
        load(tmp_path / "ego_pose.json")
