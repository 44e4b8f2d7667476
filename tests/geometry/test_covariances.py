"""Covariances composed, inverted and taken to points: against golden numbers, draws, and themselves as arrays."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frametool import Rotation, Transform, covariance
from frametool.errors import FrametoolWarning, ValueInvalid
from frametool.geometry import rigid, uncertainty

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "covariance.json").read_text())
CHAINS, SCALED = GOLDEN["covariance"], GOLDEN["scale"]
MATRIX = np.diag([1e-4, 4e-4, 9e-4, 1e-4, 4e-4, 9e-4])
DRAWS = 200_000


def pose_of(entry: dict[str, Any]) -> Transform:
    """Return the pose of a golden entry."""
    return Transform.from_arrays(entry["xyz"], [entry["quaternion"][axis] for axis in "xyzw"])


def covariance_of(entry: dict[str, Any]) -> list[float]:
    """Return the covariance of a golden entry, in whichever way it says it."""
    if "covariance" in entry:
        return list(entry["covariance"])
    lengths, angles = entry["sigma"]["xyz"], entry["sigma"]["rpy_deg"]
    sigmas = [*np.broadcast_to(lengths, 3), *np.radians(np.broadcast_to(angles, 3))]
    return np.diag(np.square(sigmas)).ravel().tolist()


def assert_near(found: Any, expected: Any, tolerance: float = 1e-9) -> None:
    """Hold two covariances together, each entry measured by its own two sigmas."""
    side = round(np.size(expected) ** 0.5)
    first, second = np.reshape(found, (side, side)), np.reshape(expected, (side, side))
    sizes = np.sqrt(np.outer(np.diag(second), np.diag(second)))
    assert np.all(abs(first - second) <= tolerance * sizes)
    assert np.array_equal(first, first.T)


def random_covariances(count: int, side: int = 6) -> Any:
    """Draw covariances, none of them diagonal."""
    roots = np.random.default_rng(5).normal(scale=0.01, size=(count, side, side))
    found = roots @ roots.swapaxes(1, 2)
    return (found + found.swapaxes(1, 2)) / 2.0


@pytest.mark.parametrize("golden", CHAINS, ids=lambda golden: str(golden["name"]))
def test_operations_are_those_of_the_golden_numbers(golden: dict[str, Any]) -> None:
    (a, of_a), (b, of_b) = ((pose_of(golden[key]), covariance_of(golden[key])) for key in "ab")
    back = covariance.invert(a, of_a)
    found = {
        "compose": covariance.compose(a, of_a, b, of_b),
        "compose_exact_b": covariance.compose(a, of_a, b, None),
        "compose_exact_a": covariance.compose(a, None, b, of_b),
        "invert": back,
        "relative": covariance.compose(a.inverse(), back, b, of_b),
    }
    for name, expected in golden["ops"].items():
        assert_near(found[name], expected["covariance"])
    p, own = golden["point"], golden["point_covariance_in"]
    assert_near(covariance.point(a, of_a, p), golden["point_covariance"])
    assert_near(covariance.point(a, of_a, p, own), golden["point_covariance_both"])
    of_vector = uncertainty.of_three(a.components, of_a, p, None, is_vector=True)
    assert of_vector is not None
    assert_near(of_vector, golden["vector_covariance"])


@pytest.mark.parametrize("golden", SCALED, ids=lambda golden: str(golden["name"]))
def test_similarities_are_those_of_the_golden_numbers(golden: dict[str, Any]) -> None:
    a, b = ((*pose_of(golden[key]).components, golden[key]["scale"]) for key in "ab")
    alone = pose_of(golden["rigid"]).components
    found = {
        "compose": rigid.compose_full(a, b),
        "compose_rigid": rigid.compose_full(a, alone),
        "rigid_compose": rigid.compose_full(alone, a) if "b" not in golden else rigid.compose_full(alone, b),
        "invert": rigid.inverse_full(a),
    }
    for name, result in found.items():
        expected = golden[name]
        assert result[:3] == pytest.approx(expected["xyz"], abs=1e-9)
        assert result[7] == pytest.approx(expected["scale"], rel=1e-12)
        assert Rotation.of(*result[3:7]).is_close(Rotation.from_quaternion(expected["xyzw"]))


def drawn(pose: Transform, spread: Any, seed: int) -> Transform:
    """Draw poses about a mean: t + d[:3], Exp(d[3:]) R."""
    d = np.random.default_rng(seed).multivariate_normal(np.zeros(6), spread, DRAWS)
    return Transform(Rotation.from_rotvec(d[:, 3:]) @ pose.rotation, pose.xyz + d[:, :3])


def spread_of(poses: Transform, mean: Transform) -> Any:
    """Return the covariance of poses about a mean."""
    turns = (poses.rotation @ mean.rotation.inverse()).as_rotvec()
    off = np.concatenate([poses.xyz - mean.xyz, turns], axis=1)
    return off.T @ off / len(off)


def test_the_formulas_are_what_draws_do() -> None:
    """One of DRAWS draws has a variance good to 0.3 %; the second order of sigmas of 0.03 rad is below 0.1 %."""
    a, b = Transform.random(2, seed=3)
    of_a, of_b = MATRIX, random_covariances(1)[0]
    some_a, some_b = drawn(a, of_a, 1), drawn(b, of_b, 2)
    for found, poses, mean in (
        (covariance.compose(a, of_a, b, of_b), some_a @ some_b, a @ b),
        (covariance.invert(a, of_a), some_a.inverse(), a.inverse()),
    ):
        expected = spread_of(poses, mean)
        sizes = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.all(abs(np.reshape(found, (6, 6)) - expected) < 0.012 * sizes)
    p, own = np.array([1.0, -2.0, 0.5]), np.diag([1e-4, 2e-4, 3e-4])
    points = some_a.apply(p + np.random.default_rng(4).multivariate_normal(np.zeros(3), own, DRAWS))
    expected = np.cov(points.T)
    sizes = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.all(abs(np.reshape(covariance.point(a, of_a, p, own), (3, 3)) - expected) < 0.012 * sizes)


def test_arrays_have_the_bits_of_floats_and_are_symmetric_to_the_bit() -> None:
    count = 300
    a, b = Transform.random(count, seed=1), Transform.random(count, seed=2)
    of_a, of_b, own = random_covariances(count), random_covariances(count)[::-1], random_covariances(count, 3)
    points = np.random.default_rng(0).normal(size=(count, 3))
    composed, back = covariance.compose(a, of_a, b, of_b), covariance.invert(a, of_a)
    moved = covariance.point(a, of_a, points, own)
    assert (composed.shape, moved.shape) == ((count, 6, 6), (count, 3, 3))
    for many in (composed, back, moved):
        assert np.array_equal(many, many.swapaxes(1, 2))
    for row in range(count):
        assert composed[row].ravel().tolist() == covariance.compose(a[row], of_a[row], b[row], of_b[row])
        assert back[row].ravel().tolist() == covariance.invert(a[row], of_a[row].tolist())
        assert moved[row].ravel().tolist() == covariance.point(a[row], of_a[row], points[row], own[row])


def test_twice_inverted_is_as_before_and_none_is_exact() -> None:
    a, b = Transform.random(2, seed=8)
    assert_near(covariance.invert(a.inverse(), covariance.invert(a, MATRIX)), MATRIX, 1e-14)
    assert covariance.compose(a, None, b, None) == covariance.invert(a, None) == [0.0] * 36
    assert covariance.point(a, None, [1.0, 2.0, 3.0]) == [0.0] * 9
    assert covariance.compose(Transform.random(4, seed=1), None, b, None).shape == (4, 6, 6)
    assert covariance.compose(a, random_covariances(4), b, MATRIX).shape == (4, 6, 6)


SPELLINGS = {
    "numbers": MATRIX.ravel().tolist(),
    "rows": MATRIX.tolist(),
    "tuples": tuple(map(tuple, MATRIX.tolist())),
    "array": MATRIX,
    "flat-array": MATRIX.ravel(),
    "rows-of-numpy": list(MATRIX),
}


@pytest.mark.parametrize("given", SPELLINGS.values(), ids=SPELLINGS)
def test_a_covariance_is_numbers_or_rows(given: Any) -> None:
    assert covariance.invert(Transform.identity(), given) == MATRIX.ravel().tolist()


def changed(place: int, value: float) -> list[float]:
    """Return a covariance with another number in one place."""
    numbers: list[float] = MATRIX.ravel().tolist()
    numbers[place] = value
    return numbers


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([0.0] * 21, "covariance has 21 numbers; 36 are needed (6x6, row-major: x y z, turns about X Y Z)"),
        ([[0.0] * 9] * 4, "covariance must be 36 numbers or 6 rows of 6"),
        (changed(0, -1.0), "covariance[0] is -1: 'unknown' in ROS; leave the covariance out"),
        (changed(4, 1e-5), "covariance is not symmetric: [0][4] is 1e-5, [4][0] is 0"),
        (changed(0, -1e-4), "covariance is not positive: its smallest eigenvalue is -1e-4"),
        (changed(7, float("nan")), "covariance has nan in it; every number must be finite"),
        ("diagonal", "covariance must be 36 numbers or 6 rows of 6"),
        (np.stack([MATRIX, -0.5 * MATRIX]), "row 1: covariance is not positive: its smallest eigenvalue is -4.5e-4"),
        (np.zeros((2, 5, 6)), "covariances: expected shape (..., 6, 6), got (2, 5, 6)"),
    ],
)
def test_what_is_no_covariance_is_refused(given: Any, message: str) -> None:
    with pytest.raises(ValueInvalid) as caught:
        covariance.invert(Transform.identity(), given)
    assert str(caught.value) == message


@pytest.mark.parametrize("many", [False, True])
def test_a_wide_turn_is_told(many: bool) -> None:  # noqa: FBT001 - a parameter of the test
    wide = np.diag([0.0, 0.0, 0.0, 0.09, 0.01, 0.01])
    with pytest.warns(FrametoolWarning) as told:
        covariance.invert(Transform.identity(), np.stack([MATRIX, wide]) if many else wide)
    text = "sigma of a turn is 0.3 rad: the first order is a few per cent off above 0.2"
    assert [str(each.message) for each in told] == [text]


def test_without_a_covariance_no_numpy_is_loaded_and_the_module_gives_out_three_functions() -> None:
    code = (
        "import sys, frametool; t = frametool.Transform.identity(); tree = frametool.FrameTree(); "
        "frametool.covariance.compose(t, None, t, None); frametool.covariance.invert(t, None); "
        "frametool.covariance.point(t, None, [1, 2, 3]); tree.add('a', 'b', t); tree.lookup('b', 'a'); "
        "print('numpy' in sys.modules, *frametool.covariance.__all__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "compose", "invert", "point"]


def test_the_example_of_the_module_is_true() -> None:
    assert covariance.__doc__ is not None
    lines = [line.strip() for line in covariance.__doc__.split("\n\n")[1].splitlines()]
    scope: dict[str, Any] = {}
    exec("\n".join(lines[:-1]), scope)  # noqa: S102 - our own text
    assert eval(lines[-1], scope) == [0.0] * 8 + [1e-4]  # noqa: S307
