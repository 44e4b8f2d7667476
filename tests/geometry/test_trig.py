"""The elementary functions of arrays against 60 digits, on random and hostile arguments."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import mpmath
import numpy as np
import oracles
import pytest
from mpmath import mpf

from frametool.geometry import arrays, floats

if TYPE_CHECKING:
    from collections.abc import Sequence

RANDOM = np.random.default_rng(0)
SMALL = (10.0 ** RANDOM.uniform(-300.0, 0.0, 200)).tolist()
TURNS = [
    sign * (k * math.pi / 2.0 + off) for k in range(5) for off in (-1e-8, 0.0, 1e-16, 1e-3) for sign in (1.0, -1.0)
]
WITHIN = [*RANDOM.uniform(-math.pi, math.pi, 2000).tolist(), *SMALL, -math.pi, math.pi, 0.0, 5e-324]
ANYWHERE = [*RANDOM.uniform(-1e3, 1e3, 1000).tolist(), *TURNS, 1e5, 4e6]
BEYOND = [1e8, 1e15, -1e22]
each_range = pytest.mark.parametrize("angles", [WITHIN, ANYWHERE, BEYOND], ids=["within", "anywhere", "beyond"])


def eps_off(found: float, exact: mpf, scale: mpf) -> float:
    return abs(float((mpf(found) - exact) / scale)) / oracles.EPS


@each_range
def test_half_sines_and_cosines_are_right_to_one_and_a_half_eps(angles: Sequence[float]) -> None:
    for angle, sine, cosine in zip(angles, *floats.half_sincos(np.array(angles), arrays), strict=True):
        assert eps_off(float(sine), mpmath.sin(mpf(angle) / 2), mpf(1)) <= 1.5
        assert eps_off(float(cosine), mpmath.cos(mpf(angle) / 2), mpf(1)) <= 1.5


def test_half_sines_of_small_angles_keep_relative_accuracy() -> None:
    for angle, sine in zip(SMALL, floats.half_sincos(np.array(SMALL), arrays)[0], strict=True):
        exact = mpmath.sin(mpf(angle) / 2)
        assert eps_off(float(sine), exact, exact) <= 1.5


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_no_angle_has_no_sine(bad: float) -> None:
    with np.errstate(invalid="ignore"):
        sine, cosine = floats.half_sincos(np.array([0.5, bad]), arrays)
    assert math.isnan(sine[1])
    assert math.isnan(cosine[1])


def test_doubled_arc_tangents_are_right_to_one_eps_of_themselves() -> None:
    tangents = [*RANDOM.uniform(-1.0, 1.0, 3000).tolist(), *SMALL, 1.0, -1.0]
    for tangent, angle in zip(tangents, arrays.doubled_arctan(np.array(tangents)), strict=True):
        exact = 2 * mpmath.atan(mpf(tangent))
        assert eps_off(float(angle), exact, exact) <= 1.0


def test_directions_have_their_angle_and_right_angles_exactly() -> None:
    angles = [*RANDOM.uniform(-math.pi, math.pi, 500).tolist(), *TURNS[:8]]
    for angle in angles:
        y, x = math.sin(angle), math.cos(angle)
        found = float(floats.bearing(np.array([y]), np.array([x]), np.array([math.hypot(y, x)]), arrays)[0])
        assert eps_off(found, mpmath.atan2(mpf(y), mpf(x)), mpmath.pi) <= 1.0
    straight = np.array([0.0, 1.0, 0.0, -1.0]), np.array([1.0, 0.0, -1.0, 0.0])
    assert floats.bearing(*straight, np.ones(4), arrays).tolist() == [0.0, math.pi / 2, math.pi, -math.pi / 2]
    half = np.array([0.0, math.sqrt(0.5), 1.0])
    assert floats.incline(half, half[::-1], arrays).tolist() == [0.0, math.pi / 4, math.pi / 2]
