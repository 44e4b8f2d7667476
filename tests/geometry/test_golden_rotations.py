"""Numbers of tf.transformations 1.13.2 and PyKDL (golden/euler.json), and a few from papers and manuals."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frametool.geometry.representations import axes_name
from frametool.geometry.transform import Rotation

GOLDEN: dict[str, Any] = json.loads((Path(__file__).parents[1] / "golden" / "euler.json").read_text())
CLOSE = 1e-12


def rotation(xyzw: list[float]) -> Rotation:
    return Rotation.from_quaternion(xyzw, normalize=True)


@pytest.mark.parametrize(("axes", "angles", "xyzw", "_back"), GOLDEN["forward"])
def test_euler_angles_give_tfs_quaternion(axes: str, angles: list[float], xyzw: list[float], _back: object) -> None:
    assert Rotation.from_euler(axes, angles).is_close(rotation(xyzw), angle=CLOSE)


@pytest.mark.parametrize(("axes", "xyzw", "angles"), GOLDEN["backward"])
def test_quaternions_give_tfs_euler_rotation(axes: str, xyzw: list[float], angles: list[float]) -> None:
    ours = rotation(xyzw).as_euler(axes)
    assert Rotation.from_euler(axes, ours).is_close(Rotation.from_euler(axes, angles), angle=CLOSE)


@pytest.mark.parametrize("case", GOLDEN["axis_angle"])
def test_axis_and_angle_give_tfs_quaternion_and_matrix(case: dict[str, Any]) -> None:
    ours = Rotation.from_axis_angle(case["axis"], case["angle"])
    assert ours.is_close(rotation(case["q"]), angle=CLOSE)
    assert np.allclose(ours.as_matrix(), case["R"], rtol=0.0, atol=CLOSE)


@pytest.mark.parametrize("case", GOLDEN["kdl"])
def test_kdl_agrees_on_roll_pitch_yaw_and_two_more(case: dict[str, Any]) -> None:
    ours = rotation(case["q"])
    assert Rotation.from_rpy(case["rpy"]).is_close(ours, angle=CLOSE)
    assert Rotation.from_euler("rzyx", case["euler_zyx"]).is_close(ours, angle=CLOSE)
    assert Rotation.from_euler("rzyz", case["euler_zyz"]).is_close(ours, angle=CLOSE)


@pytest.mark.parametrize("case", GOLDEN["quat"])
def test_tf_agrees_on_products_inverses_and_slerp(case: dict[str, Any]) -> None:
    a, b = rotation(case["a"]), rotation(case["b"])
    assert (a @ b).is_close(rotation(case["ab"]), angle=CLOSE)
    assert a.inverse().is_close(rotation(case["inv_a"]), angle=CLOSE)
    assert a.slerp(b, case["frac"]).is_close(rotation(case["slerp"]), angle=CLOSE)


def test_a_published_triple_has_its_published_quaternion() -> None:
    w, x, y, z = 0.435953, 0.310622, -0.718287, 0.444435
    assert Rotation.from_euler("ryxz", [1.0, 2.0, 3.0]).is_close(rotation([x, y, z, w]), angle=2e-6)


def test_half_turns_about_x_then_z_make_one_about_minus_y() -> None:
    product = Rotation.from_axis_angle([1, 0, 0], math.pi) @ Rotation.from_axis_angle([0, 0, 1], math.pi)
    assert np.allclose(np.abs(product.as_quaternion()), [0.0, 1.0, 0.0, 0.0], rtol=0.0, atol=1e-15)


def test_zyx_angles_give_the_closed_form_matrix() -> None:
    alpha, beta, gamma = 0.3, -0.7, 1.9
    sa, ca, sb, cb, sc, cc = (f(t) for t in (alpha, beta, gamma) for f in (math.sin, math.cos))
    expected = [
        [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
        [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
        [-sb, cb * sc, cb * cc],
    ]
    found = Rotation.from_euler(axes_name("zyx", "intrinsic"), [alpha, beta, gamma]).as_matrix()
    assert np.allclose(found, expected, rtol=0.0, atol=1e-15)
