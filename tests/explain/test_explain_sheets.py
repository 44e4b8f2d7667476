"""What a sheet teaches: exact texts, each caveat once, and sheets that are true where formulas break down."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from recheck import recheck

import frametool
from frametool import TransformBuffer, explain
from frametool.explain import derive
from frametool.explain.derive import BLOCKS
from frametool.explain.run import sheets
from frametool.sim import followed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.explain.run import SheetLine

AXIS_ANGLE = """\
1. Axis and angle to quaternion
   q = (v sin(angle/2), cos(angle/2)), v a unit axis.
   n  = sqrt(ax^2 + ay^2 + az^2) = sqrt(1^2 + 0^2 + 1^2) = 1.41421
   vx = ax/n = 1/1.41421 = 0.707107
   vy = ay/n = 0/1.41421 = 0
   vz = az/n = 1/1.41421 = 0.707107
   ! The axis is not a unit vector: it is divided by its length. With a longer
     axis q would not be a rotation.
   angle = angle_deg·pi/180 = 180·pi/180 = 3.14159 rad
   w     = cos(angle/2) = sqrt(0)/2 = 0
   s     = sin(angle/2) = sqrt(4)/2 = 1
   ! Multiples of 90 deg are exact: no rounded pi comes into their sines and
     cosines.
   x = vx·s = 0.707107·1 = 0.707107
   y = vy·s = 0·1 = 0
   z = vz·s = 0.707107·1 = 0.707107
   ! The half angle: a quaternion acts twice (q v q*), so w = cos(angle/2).
   norm = sqrt(x^2 + y^2 + z^2 + w^2)
        = sqrt(0.707107^2 + 0^2 + 0.707107^2 + 0^2) = 1.00000

Result
   quaternion  x 0.7071067811865475  y 0.0  z 0.7071067811865475  w 0.0
"""
INVERSE = """\
1. Given
   base_from_camera: xyz 0.1 0 1.2 m, xyzw 0 0.6 0 0.8

2. camera_from_base = inverse of base_from_camera
   The axis is negated: q* = (-x, -y, -z, w), and its matrix is R^T.
   t' = -R^T t
          [0.28 0 -0.96] [0.1]   [  1.12400]
      = - [   0 1     0] [  0] = [        0] m
          [0.96 0  0.28] [1.2]   [-0.432000]
   ! The position is not just negated but also turned into the other frame: -R^T
     t.
   q* = x 0, y -0.6, z 0, w 0.8

Result: camera_from_base
   xyz         x 1.1239999999999999  y 0.0  z -0.43200000000000005 m
   quaternion  x 0.0  y -0.6  z 0.0  w 0.8
"""
POINT = """\
1. Given
   base_from_lidar: xyz 0.5 0 0.31 m, xyzw 1 0 0 0

2. point_in_base = base_from_lidar * point_in_lidar
   R(q) is the matrix of q: r11 = 1 - 2 (y^2 + z^2), r12 = 2 (x y - z w), and so
   on.
   p' = R(q) p + t
        [1  0  0] [  5]   [ 0.5]   [ 5.5]
      = [0 -1  0] [0.2] + [   0] = [-0.2] m
        [0  0 -1] [  0]   [0.31]   [0.31]
   ! A direction (vector, axis, velocity) is only turned: R v, without + t. A
     point moves by R p + t.

Result: in base
   point  x 5.5  y -0.2  z 0.31 m
"""
FOLLOW = """\
1. Step 0, 0.000 s: turtle1 seen from turtle2
   turtle2_from_turtle1 = (world_from_turtle2)^-1 @ world_from_turtle1; in the
   plane: the difference, turned back by the heading h of turtle2.
   turtle1 at 0.000000000 s: x1 5.54444 m, y1 5.54444 m
   turtle2 at 0.000000000 s: x2 4 m, y2 2 m, h2 0 rad
   x = cos(h2)·(x1 - x2) + sin(h2)·(y1 - y2)
     = cos(0)·(5.54444 - 4) + sin(0)·(5.54444 - 2) = 1.54444 m
   y = cos(h2)·(y1 - y2) - sin(h2)·(x1 - x2)
     = cos(0)·(5.54444 - 2) - sin(0)·(5.54444 - 4) = 3.54444 m

2. The command of turtle2
   d         = sqrt(x^2 + y^2) = sqrt(1.54444^2 + 3.54444^2) = 3.86632 m
   bearing   = atan2(y, x) = atan2(3.54444, 1.54444) = 1.15987 rad
   linear_x  = 0.5·d = 0.5·3.86632 = 1.93316 m/s
   angular_z = 4·bearing = 4·1.15987 = 4.63947 rad/s
   ! 0.5 and 4 are gains with the unit 1/s: so much of the distance, and of the
     bearing, in a second.

Result: the command of turtle2
   linear_x   1.9331577954251546 m/s
   angular_z  4.639467449724775 rad/s
   distance   3.8663155908503093 m
"""


def test_the_sheet_of_an_axis_and_an_angle() -> None:
    assert str(explain("convert", {"axis_angle": {"axis": [1, 0, 1], "angle": "180deg"}})) == AXIS_ANGLE


def test_the_sheet_of_an_inverse() -> None:
    pose = {"name": "camera", "parent": "base", "xyz": [0.1, 0, 1.2], "xyzw": [0, 0.6, 0, 0.8]}
    assert str(explain("invert", pose)) == INVERSE


def test_the_sheet_of_a_point() -> None:
    pose = {"name": "lidar", "parent": "base", "xyz": [0.5, 0, 0.31], "xyzw": [1, 0, 0, 0]}
    assert str(explain("apply", pose, [5, 0.2, 0])) == POINT


def test_the_sheet_of_a_step_of_the_ros_1_follower() -> None:
    assert str(explain("follow", frametool.follow_steps(frametool.tutorial(), 0))) == FOLLOW


def sheet(pose: dict[str, Any], to: str = "quaternion", precision: int | None = 6) -> str:
    """Explain a conversion and check its lines."""
    text = str(explain("convert", pose, to=to, precision=precision))
    recheck(text, precision)
    return text


@pytest.mark.parametrize(("pose", "to", "said"), [
    ({"wxyz": [-0.5, 0.5, 0.5, 0.5]}, "quaternion", ["! Double cover", "qw = -w = -(-0.5) = 0.5"]),
    ({"rpy": [0.1, 0, 0]}, "quaternion", ["! The half angle"]),
    ({"xyzw": [0, 0, 0, 1]}, "axis_angle", ["No rotation: the angle is 0, any axis will do, and x is taken."]),
    ({"xyzw": [0, 0, 0, 1]}, "rotvec", ["No rotation: the vector is 0."]),
    ({"rotvec": [0, 0, 0]}, "quaternion", ["The vector is 0: no rotation"]),
    ({"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}, "axis_angle", ["No rotation: the angle is 0"]),
    ({"rotvec": [1e-300, 0, 0]}, "rotvec", ["angle = hypot(rx, ry, rz)", "rx = vx·angle = 1·1e-300 = 1e-300 rad"]),
    ({"rotvec": [1e-9, 0, 0]}, "axis_angle", ["angle = 2·atan2(s, w) = 2·atan2(5e-10, 1) = 1e-09 rad"]),
    ({"rpy_deg": [0, 90, 0]}, "rpy_deg", ["! Gimbal lock", "yaw   = 0 rad (chosen)", "pitch_deg = pitch·180/pi = 1.57080·180/pi = 90 deg"]),
    ({"rpy_deg": [0, 89.99999, 10]}, "rpy_deg", ["! Near gimbal lock: roll and yaw each are known only to about"]),
    ({"euler": {"axes": "rzxz", "angles": [0.3, 0, 0.4]}}, "euler:rzxz", ["! Gimbal lock", "a3 = 0 rad (chosen)"]),
    ({"xyzw": [0, 0, 1, 0]}, "rpy_deg", ["yaw   = atan2(r21, r11) = atan2(0, -1) = 3.14159 rad", "roll 0.0  pitch 0.0  yaw 180.0 deg"]),
    ({"rpy_deg": [0, 0, 180]}, "matrix", ["cy   = cos(yaw/2) = sqrt(0)/2 = 0", "r11 = 1 - 2·(y^2 + z^2) = 1 - 2·(0^2 + 1^2) = -1"]),
    ({"rpy_deg": [1000000, 0, 0]}, "quaternion", ["roll: 1000000.0 deg less whole double turns of 720 deg is 640.0 deg, exactly."]),
    ({"matrix": [[0.9998, -0.02, 0], [0.02, 0.9998, 0], [0, 0, 1]]}, "axis_angle", ["1. The nearest rotation", "Matrix to quaternion"]),
    ({"six_d": [0.6, 0.8, 0.1, 0.6000001, 0.8, 0.1]}, "matrix", ["The columns are nearly parallel"]),
    ({"mrp": [0, 0, 1]}, "rotvec_deg", ["rz_deg    = vz·angle_deg = 1·180 = 180 deg"]),
])  # fmt: skip
@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
def test_a_sheet_is_true_where_formulas_break_down(pose: dict[str, Any], to: str, said: list[str]) -> None:
    text = sheet(pose, to)
    assert [each for each in said if re.sub(r"\s+", " ", each) not in re.sub(r"\s+", " ", text)] == []


@pytest.mark.parametrize("quarter", range(-8, 9))
@pytest.mark.parametrize(("to", "precision"), [("matrix,quaternion", 6), ("quaternion", None)])
def test_multiples_of_a_right_angle_are_exact_in_every_line(quarter: int, to: str, precision: int | None) -> None:
    text = sheet({"rpy_deg": [0, 0, 90 * quarter]}, to, precision)
    assert "e-1" not in text


def test_a_caveat_stands_once_on_a_sheet() -> None:
    text = str(explain("compose", *[{"rpy_deg": [10, 20, 30]}] * 3, to="rpy_deg,axis_angle"))
    caveats = re.findall(r"^   ! ([^\n]+)", text, re.MULTILINE)
    assert len(caveats) == len(set(caveats)) >= 4


def test_noise_becomes_zero_and_stays_zero_except_with_every_digit() -> None:
    pose = {"rotvec": [0, 0, 3.141592653589793]}
    assert "w     = cos(angle/2) = cos(3.14159/2) = 0\n" in sheet(pose)
    assert "cos(3.141592653589793/2) = 6.123233995736766e-17" in sheet(pose, precision=None)


def test_a_number_that_was_rounded_shows_all_its_digits_and_an_exact_one_does_not() -> None:
    text = sheet({"axis_angle": {"axis": [3, 4, 0], "angle": 0.5}})
    assert "vx = ax/n = 3/5 = 0.6\n" in text
    assert "norm = sqrt(x^2 + y^2 + z^2 + w^2)" in text
    assert "sqrt((1234567)^2" not in sheet({"axis_angle": {"axis": [1234567.1, 4, 0], "angle": 0.5}})


def test_the_way_the_time_and_the_samples_of_a_lookup_are_named() -> None:
    buffer = TransformBuffer()
    still = frametool.Transform.identity()
    for second in range(3):
        buffer.insert("map", "base", frametool.Transform(frametool.Rotation.from_rpy([0, 0, 0.5 * second]), [second, 0.0, 0.0]), second * 10**9)
    buffer.insert("base", "lidar", still)
    text = str(explain("lookup", buffer, "lidar", "map", at_ns=1_250_000_000))
    assert "lidar <- base <- map" in text
    assert "lidar_from_map = (map_from_base @ base_from_lidar)^-1" in text
    assert "1.250000000 s lies between the samples at 1.000000000 and 2.000000000" in text
    assert "f = past/gap = 0.25/1 = 0.25" in text
    assert "It is the latest that every moving edge on the way has reached" in " ".join(str(explain("lookup", buffer, "map", "lidar")).split())
    assert "A frame seen from itself: the identity" in str(explain("lookup", buffer, "base", "base"))


def test_a_parent_that_changes_between_two_samples_is_told_and_the_older_one_holds() -> None:
    buffer = TransformBuffer()
    buffer.insert("map", "shelf", frametool.Transform.identity())
    buffer.insert("map", "hand", frametool.Transform.identity())
    buffer.insert("shelf", "box", frametool.Transform.identity(), 0)
    buffer.insert("hand", "box", frametool.Transform.identity(), 2_000_000_000)
    text = " ".join(str(explain("lookup", buffer, "map", "box", at_ns=1_000_000_000)).split())
    assert "The next, at 2.000000000, has another parent, hand: until then this one holds." in text


@pytest.mark.parametrize(("options", "spawn", "said"), [
    ({"max_linear": 1.0, "max_angular": 2.0}, (4.0, 2.0, 0.0), ["Limited to 1 m/s either way:", "linear_x = max(-1, min(1, l)) = max(-1, min(1, 1.93316)) = 1 m/s"]),
    ({"law": "ros2"}, (4.0, 2.0, 0.0), ["angular_z = 1·bearing = 1·1.15987 = 1.15987 rad/s", "0.5 and 1 are gains"]),
    ({}, (5.544445, 5.544445, 0.0), ["Nearer than 2e-06 m: arrived.", "linear_x   0.0 m/s"]),
    ({"gain_linear": -0.25}, (4.0, 2.0, 0.0), ["linear_x  = (-0.25)·d = (-0.25)·3.86632 = -0.966579 m/s"]),
])  # fmt: skip
def test_the_follower_s_law_its_limits_and_its_rest(options: dict[str, Any], spawn: tuple[float, float, float], said: list[str]) -> None:
    steps = frametool.follow_steps(frametool.tutorial(law=frametool.FollowController(**options), spawn=spawn), 0)
    text = str(explain("follow", steps))
    assert [each for each in said if each not in text] == []


@pytest.mark.parametrize(("scene", "number", "message"), [
    ({}, 201, "no control step 201 in this run; steps: 0 .. 200"),
    ({}, -1, "no control step -1 in this run; steps: 0 .. 200"),
    ({"followers": 0}, 0, "nobody follows in this scene"),
    ({"delay": 5.0}, 3, "turtle2 has no command at step 3, 0.300000000 s: Could not transform turtle2 to turtle1"),
])  # fmt: skip
def test_a_step_that_is_not_there_is_an_error(scene: dict[str, Any], number: int, message: str) -> None:
    with pytest.raises(frametool.FrametoolError, match=re.escape(message)):
        frametool.follow_steps(frametool.tutorial(**scene), number)


def lines_of(body: Sequence[SheetLine]) -> Iterator[str]:
    """List the lines of a sheet, the indented ones too."""
    for line in body:
        yield line.text
        yield from lines_of(line.body)


LINES = {name: [*lines_of(body)] for name, body in sheets().items()}


def test_what_a_sheet_uses_is_there_and_every_sheet_is_used() -> None:
    used = {text.removeprefix("use ") for lines in LINES.values() for text in lines if text.startswith("use ")}
    assert used <= set(LINES)
    files = [*Path(derive.__file__).parent.glob("*.py"), Path(followed.__file__)]
    code = "".join(path.read_text(encoding="utf-8") for path in files)
    ways = {f"{name} {way}" for name in BLOCKS for way in ("to", "from")} | {"point", "vector"}  # the kinds of records
    assert [name for name in LINES if name not in used | ways and f'"{name}"' not in code] == []


def test_sentences_of_a_sheet_have_no_numbers_of_a_run() -> None:
    """Numbers come in by name, so that they are written with the digits asked for."""
    words = [text for lines in LINES.values() for text in lines if text[:2] in ("# ", "> ", "! ")]
    assert [text for text in words if re.search(r"\d\.\d{3}", text)] == []
