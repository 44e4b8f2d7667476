"""Angles of Unreal, CARLA and Unity against what these publish, and against their way to ROS."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pytest
import samples

from frametool.geometry import floats, quaternion
from frametool.geometry.representations import notation

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    from frametool.geometry import Quaternion

    Run = Callable[..., Outcome]

ANGLES = [(10.0, 20.0, 30.0), (-170.0, 89.0, 100.0), (0.0, -45.0, -179.0), (90.0, 0.0, 90.0), (33.0, -90.0, 0.0)]


def halves(*degrees: float) -> tuple[float, ...]:
    """Return sine and cosine of half of each angle."""
    return tuple(part for each in degrees for part in (math.sin(math.radians(each) / 2), math.cos(math.radians(each) / 2)))


def unreal(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Write FRotator::Quaternion of Unreal's UnrealMath.cpp as it stands there."""
    sp, cp, sy, cy, sr, cr = halves(pitch, yaw, roll)
    return (
        cr * sp * sy - sr * cp * cy, -cr * sp * cy - sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy,
    )  # fmt: skip


def unity(x: float, y: float, z: float) -> Quaternion:
    """Turn about z, then x, then y, as Unity's manual has Quaternion.Euler: AngleAxis of each, the first rightmost."""
    sx, cx, sy, cy, sz, cz = halves(x, y, z)
    return quaternion.compose(*quaternion.compose(0.0, sy, 0.0, cy, sx, 0.0, 0.0, cx), 0.0, 0.0, sz, cz)


@pytest.mark.parametrize(("name", "published"), [("rpy_unreal", unreal), ("euler_unity", unity)])
@pytest.mark.parametrize("unit", ["", "_deg"])
def test_angles_of_an_engine_are_those_it_publishes(name: str, unit: str, published: Callable[..., Quaternion]) -> None:
    form = notation(name + unit)
    for angles in ANGLES:
        assert quaternion.distance(*form.to_quaternion(angles, floats), *published(*angles), floats) < 1e-15
    for xyzw in samples.quaternions(20):
        back = published(*form.from_quaternion(*xyzw, floats))
        assert quaternion.distance(*back, *xyzw, floats) < 1e-14


@pytest.mark.parametrize(("roll", "pitch", "yaw"), ANGLES[:4])
def test_unreal_and_carla_to_ros_negate_pitch_and_yaw(run: Run, roll: float, pitch: float, yaw: float) -> None:
    """As CARLA's RightHandedRotation.h and carla_ros_bridge's transforms do."""
    change = ["--all-axes", "ros_from_unreal", "--to", "rpy_deg", "--precision", "9"]
    argument = run("convert", "--from", "rpy_unreal", str(roll), str(pitch), str(yaw), *change, "-f", "json")
    assert list(json.loads(argument.out)["rpy_deg"].values()) == pytest.approx([roll, -pitch, -yaw])
    table = f"pitch,yaw,roll\n{pitch},{yaw},{roll}\n"  # the order of CARLA
    rows = run("convert", "--from", "rpy_unreal", *change, stdin=table).out.splitlines()
    assert dict(zip(rows[0].split(","), map(float, rows[1].split(",")), strict=True)) == pytest.approx(
        {"roll_deg": roll, "pitch_deg": -pitch, "yaw_deg": -yaw}
    )


@pytest.mark.parametrize("names", ["roll,pitch,yaw", "roll_deg,pitch_deg,yaw_deg"])
@pytest.mark.parametrize("columns", [[], ["--columns", "1-3"]])
def test_columns_of_rpy_are_what_from_says(run: Run, names: str, columns: list[str]) -> None:
    outcome = run("convert", "--from", "rpy_unreal", *columns, "--to", "rpy_deg", stdin=f"{names}\n10,0,0\n")
    assert float(outcome.out.splitlines()[1].split(",")[0]) == pytest.approx(-10.0)


def test_unity_turns_to_the_right_where_ros_turns_to_the_left(run: Run) -> None:
    outcome = run("convert", "--from", "euler_unity", "0", "90", "0", "--all-axes", "ros_from_unity", "--to", "rpy_deg")
    assert outcome == (0, "rpy_deg: {roll: 0.0, pitch: 0.0, yaw: -90.0}\n", "")


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["--from", "rpy_deg", "0", "0", "90", "--all-axes", "ros_from_unreal"], "rpy_unreal"),
        (["--from", "rpy", "0", "0", "1", "--all-axes", "ros_from_unity"], "euler_unity"),
        (["{rpy: [0, 0, 1]}", "--all-axes", "unity_from_ros", "--to", "rpy_deg"], "euler_unity"),
        (["{rpy: [0, 0, 1]}", "--all-axes", "unity_from_ros", "--to", "euler_unity"], ""),
    ],
)
def test_rpy_in_axes_of_an_engine_is_warned_about(run: Run, arguments: list[str], name: str) -> None:
    outcome = run("convert", *arguments)
    assert outcome.status == 0
    assert ("warning: rpy is not what" in outcome.err) == bool(name)
    assert f"; {name} is" in outcome.err or not name
