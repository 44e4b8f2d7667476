"""Matched points against SciPy's least squares (golden/hand_eye.json), and the laws of a similarity."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.errors import ValueInvalid, overheard
from frametool.fit.alignment import umeyama
from frametool.fit.matched_points import PointsFit, solve_points
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from frametool.geometry import Array

pytestmark = pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")  # what looks odd is in the result too

CASES = {each["name"]: each for each in json.loads((Path(__file__).parents[1] / "golden" / "hand_eye.json").read_text())["points"]}
MOVED = Transform.random(seed=5)
LINE = "the points lie on a line: the turn about it cannot be known"


def matched(*, seed: int = 0, count: int = 12, noise: float = 1e-3, scale: float = 1.0, wrong: int = 0) -> tuple[Array, Array, Transform, list[int]]:
    """Make target and source points, the truth between them, and which are wrong."""
    rng = np.random.default_rng(seed)
    truth, source = Transform.random(seed=rng), rng.normal(size=(count, 3))
    target = truth.apply(scale * source) + noise * rng.normal(size=(count, 3))
    rows = sorted(rng.choice(count, wrong, replace=False).tolist())
    target[rows] += scale * rng.normal(size=(wrong, 3))
    return target, source, truth, rows


@pytest.mark.parametrize("name", CASES)
def test_least_squares_are_those_of_scipy(name: str) -> None:
    case = CASES[name]
    target, source = ({row[0]: row[1:] for row in case[side]} for side in ("target", "source"))
    ids = [key for key in target if key in source]
    found = solve_points([target[key] for key in ids], [source[key] for key in ids], weights=case["weights"], scale=case["scaled"])
    wanted = Transform.from_arrays(case["pose"]["xyz"], case["pose"]["xyzw"], normalize=True)
    assert found.transform.is_close(wanted, angle=3e-8, distance=3e-8)
    assert found.scale == pytest.approx(case["scale"], rel=3e-8)
    assert found.scale_sigma == (None if case["scale_sigma"] is None else pytest.approx(case["scale_sigma"], rel=3e-8))
    assert [ids[row] for row in np.flatnonzero(~found.used)] == case["left_out"]
    assert found.rms[0] == pytest.approx(case["rms_distance"], abs=3e-8)
    there = np.array(case["pose"]["covariance"]).reshape(6, 6)
    deviations = np.outer(np.sqrt(np.diag(there)), np.sqrt(np.diag(there)))
    np.testing.assert_allclose(found.covariance / deviations, there / deviations, atol=1e-9)
    assert (found.covariance == found.covariance.T).all()


@pytest.mark.parametrize("scale", [1.0, 0.01, 250.0])
@pytest.mark.parametrize("count", [3, 4, 5, 20])
def test_exact_points_give_the_transform_to_twelve_digits(count: int, scale: float) -> None:
    target, source, truth, _ = matched(count=count, noise=0.0, scale=scale)
    found = solve_points(target, source, scale=scale != 1.0)
    assert found.transform.is_close(truth, angle=1e-12, distance=1e-12 * max(scale, 1.0))
    assert found.scale == pytest.approx(scale, rel=1e-12)
    assert found.used.all()
    assert found.dof == 3 * count - 6 - (scale != 1.0)


@pytest.mark.parametrize(("count", "wrong"), [(5, 1), (6, 2), (10, 4), (40, 15)])
@pytest.mark.parametrize("scale", [1.0, 0.001])
def test_wrong_pairs_are_left_out_and_told(count: int, wrong: int, scale: float) -> None:
    target, source, _, rows = matched(seed=count, count=count, wrong=wrong, noise=1e-3 * scale, scale=scale)
    found = solve_points(target, source, scale=scale != 1.0)
    assert np.flatnonzero(found.left_out).tolist() == np.flatnonzero(~found.used).tolist() == rows
    assert (found.u[rows] > 3.0).all()
    assert found.sigma == pytest.approx(1e-3 * scale, rel=0.6)
    kept = np.setdiff1d(np.arange(count), rows)
    alone = solve_points(target[kept], source[kept], scale=scale != 1.0, robust=False)
    assert alone.transform.components == found.transform.components
    assert solve_points(target, source, scale=scale != 1.0, robust=False).used.all()


@pytest.mark.large
def test_sets_of_any_size_without_wrong_pairs_keep_all() -> None:
    for seed in range(10):
        target, source, _, _ = matched(seed=seed, count=4 + 2 * seed)
        assert solve_points(target, source).used.all()


@pytest.mark.large
def test_moving_both_sides_moves_the_transform() -> None:
    target, source, _, rows = matched(wrong=3)
    plain, there = solve_points(target, source), solve_points(MOVED.apply(target), source)
    assert there.transform.is_close(MOVED @ plain.transform, angle=1e-12, distance=1e-12)
    assert np.flatnonzero(~there.used).tolist() == rows
    assert solve_points(target, MOVED.apply(source)).transform.is_close(plain.transform @ MOVED.inverse(), angle=1e-12, distance=1e-12)
    back = solve_points(source, target)
    assert back.transform.is_close(plain.transform.inverse(), angle=1e-12, distance=1e-12)


def test_points_far_from_their_origins() -> None:
    target, source, _, _ = matched()
    far = np.array([690_000.0, 5_330_000.0, 500.0])
    plain, found = solve_points(target, source), solve_points(target + far, source)
    assert found.transform.rotation.is_close(plain.transform.rotation, angle=1e-8)
    np.testing.assert_allclose(found.covariance, plain.covariance, rtol=1e-5, atol=1e-15)
    lever = solve_points(target, source + far)
    assert lever.transform.rotation.is_close(plain.transform.rotation, angle=1e-8)
    assert lever.covariance[0, 0] > 1e9 * plain.covariance[0, 0]


def test_a_pair_of_weight_zero_is_as_if_it_were_not_there() -> None:
    target, source, _, _ = matched(count=10)
    target[2] = 50.0
    weights = np.arange(10.0) + 1
    weights[[2, 5]] = 0.0
    found = solve_points(target, source, weights=weights)
    rows = np.flatnonzero(weights)
    alone = solve_points(target[rows], source[rows], weights=weights[rows])
    assert found.transform.components == alone.transform.components
    assert (found.dof, found.sigma) == (alone.dof, alone.sigma)
    assert np.flatnonzero(~found.used).tolist() == [2, 5]
    assert not found.left_out.any()
    assert (found.u[[2, 5]] == 0.0).all()
    np.testing.assert_array_equal(found.residuals[rows], alone.residuals)


def test_weights_are_in_proportion() -> None:
    target, source, _, _ = matched(count=10)
    weights = np.arange(10.0) + 1
    one, ten = (solve_points(target, source, weights=each) for each in (weights, 10 * weights))
    assert one.transform.is_close(ten.transform, angle=1e-13, distance=1e-13)
    np.testing.assert_allclose(one.covariance, ten.covariance, rtol=1e-9)
    np.testing.assert_allclose(one.u, ten.u, rtol=1e-9)


def test_weighted_umeyama_counts_a_pair_as_often_as_it_weighs() -> None:
    target, source, _, _ = matched(count=6)
    times = np.array([1, 3, 2, 1, 1, 4])
    for with_scale in (False, True):
        heavy = umeyama(target, source, times.astype(float), with_scale=with_scale)
        often = umeyama(np.repeat(target, times, 0), np.repeat(source, times, 0), with_scale=with_scale)
        assert heavy.transform.is_close(often.transform, angle=1e-14, distance=1e-14)
        assert heavy.scale == pytest.approx(often.scale, rel=1e-14)


@pytest.mark.parametrize("scale", [False, True])
def test_covariances_are_those_of_many_draws(scale: bool) -> None:  # noqa: FBT001
    rng = np.random.default_rng(3)
    source, truth = rng.normal(size=(10, 3)) * [1.0, 2.0, 0.5] + [3.0, 0.0, 1.0], Transform.random(seed=rng)
    exact = truth.apply(source)
    errors, told, scales = [], [], []
    for _ in range(600):
        found = solve_points(exact + 1e-3 * rng.normal(size=(10, 3)), source, scale=scale, robust=False)
        at = found.transform
        errors.append([*(at.xyz - truth.xyz), *(at.rotation @ truth.rotation.inverse()).as_rotvec()])
        told.append(found.covariance)
        scales.append([found.scale - 1.0, found.scale_sigma or 0.0])
    white = np.linalg.solve(np.linalg.cholesky(np.mean(told, 0)), np.transpose(errors))
    spread = np.linalg.eigvalsh(white @ white.T / len(errors))
    assert 0.8 < spread.min() < spread.max() < 1.25
    off, sigma = np.transpose(scales)
    assert np.sqrt((off**2).mean()) == pytest.approx(np.sqrt((sigma**2).mean()), rel=0.1)


def test_points_in_a_plane_are_enough() -> None:
    target, source, truth, _ = matched(noise=0.0)
    source[:, 2] = 0.0
    found = solve_points(truth.apply(source), source)
    assert found.transform.is_close(truth, angle=1e-12, distance=1e-12)
    assert np.isfinite(found.covariance).all()
    assert len(target) == len(source)


@pytest.mark.parametrize(("count", "words"), [(0, "0 matched points"), (1, "1 matched point"), (2, "2 matched points")])
def test_too_few_points(count: int, words: str) -> None:
    target, source, _, _ = matched()
    with pytest.raises(ValueInvalid, match=f"^{words}; 3 are needed, not on a line$"):
        solve_points(target[:count].reshape(-1, 3), source[:count].reshape(-1, 3))
    weights = np.zeros(12)
    weights[:count] = 1.0
    if count:
        with pytest.raises(ValueInvalid, match=f"^{words}; 3 are needed, not on a line$"):
            solve_points(target, source, weights=weights)


@pytest.mark.parametrize("offset", [0.0, 5e6])
@pytest.mark.parametrize("side", ["target", "source", "both", "one place"])
def test_points_on_a_line(side: str, offset: float) -> None:
    target, source, truth, _ = matched()
    along = np.outer(np.linspace(-1, 1, 12), [1.0, 2.0, -1.0]) * (side != "one place") + offset
    pairs = {"target": (along, source), "source": (target, along), "both": (truth.apply(along), along), "one place": (along, along)}[side]
    with pytest.raises(ValueInvalid) as caught:
        solve_points(*pairs)
    assert str(caught.value) == LINE


def test_kept_points_on_a_line() -> None:
    source = np.outer(np.linspace(-1, 1, 12), [1.0, 2.0, -1.0])
    target = MOVED.apply(source)
    source[7] += [0.3, 0.0, 0.4]
    with pytest.raises(ValueInvalid) as caught:
        solve_points(target, source)
    assert str(caught.value) == LINE


@pytest.mark.parametrize("wrong", [0, 3])
def test_a_mirror_image(wrong: int) -> None:
    target, source, truth, _ = matched(wrong=wrong)
    with pytest.raises(ValueInvalid, match=r"^a mirror image fits \(\d\.\d mm, not \d{3,4}\.\d mm\): one set is left-handed$"):
        solve_points(target, source * [1.0, -1.0, 1.0])
    with pytest.raises(ValueInvalid, match=r"^a mirror image fits \("):
        solve_points(2.5 * target, -source, scale=True)
    assert solve_points(target, source).used.sum() == 12 - wrong
    assert truth.shape == ()


@pytest.mark.parametrize(
    ("scale", "hint"),
    [
        (0.001, "B is 1000 times A: millimetres?"),
        (1000.0, "A is 1000 times B: millimetres?"),
        (99.0, "A is 100 times B: centimetres?"),
        (0.3048, "B is 3.281 times A: a scale?"),
        (2.5, "A is 2.5 times B: a scale?"),
    ],
)
@pytest.mark.parametrize("wrong", [0, 3])
def test_a_scale_that_fits_much_better_is_told(scale: float, hint: str, wrong: int) -> None:
    target, source, _, _ = matched(scale=scale, noise=1e-4 * scale, wrong=wrong)
    assert overheard(solve_points, target, source)[1] == [("", hint)]
    assert overheard(solve_points, target, source, scale=True)[1] == []


def test_the_hint_has_the_names_of_the_sets() -> None:
    target, source, _, _ = matched(scale=0.001, noise=0.0)
    said = overheard(solve_points, target, source, names=("map", "scan"))[1]
    assert said == [("", "scan is 1000 times map: millimetres?")]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"source": np.ones((11, 3))}, "target has 12 points, source 11"),
        ({"source": np.ones((12, 2))}, "source: expected shape (..., 3), got (12, 2)"),
        ({"target": np.ones((2, 6, 3))}, "target: expected shape (n, 3), got (2, 6, 3)"),
        ({"target": np.full((12, 3), 1e200)}, "target: a place at 1e+200 m; at most 1e+100 m can be fitted"),
        ({"weights": np.ones(11)}, "weights: expected shape (12,), got (11,)"),
        ({"weights": -np.ones(12)}, "weights: expected none negative and not all 0"),
    ],
)
def test_what_does_not_match(more: dict[str, Any], words: str) -> None:
    target, source, _, _ = matched()
    with pytest.raises(ValueInvalid) as caught:
        solve_points(**{"target": target, "source": source, **more})
    assert str(caught.value) == words


def test_numbers_that_are_none() -> None:
    target, source, _, _ = matched()
    source[3, 1] = np.nan
    with pytest.raises(ValueInvalid, match="source"):
        solve_points(target, source)


def test_many_points_are_fitted_as_few_and_the_same_each_time() -> None:
    target, source, truth, rows = matched(count=20_000, wrong=5_000)
    found: list[PointsFit] = [solve_points(target, source) for _ in range(2)]
    assert not found[0].used[rows].all()
    assert found[0].transform.is_close(truth, angle=1e-4, distance=1e-4)
    assert found[0].transform.components == found[1].transform.components
