"""Hand-eye against SciPy's least squares and OpenCV's closed forms (golden/hand_eye.json), and its laws."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs import Rig, replaced, rig, small

from frametool.errors import ValueInvalid, overheard
from frametool.fit.hand_eye import HandEye, solve_hand_eye
from frametool.fit.least_squares import draws
from frametool.geometry.transform import Rotation, Transform

pytestmark = pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")  # what looks odd is in the result too

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "hand_eye.json").read_text())
RIGS = {each["name"]: each for each in GOLDEN["hand_eye"]}
CUTS = ("target", "camera", "gripper")
MOVED = Transform.random(seed=5)


def poses(rows: list[dict[str, Any]]) -> Transform:
    xyzw = [[row["quaternion"][key] for key in "xyzw"] for row in rows]
    return Transform.from_arrays([row["xyz"] for row in rows], xyzw, normalize=True)


def solved(made: Rig, **options: Any) -> HandEye:
    return solve_hand_eye(made.gripper, made.target, **options)


def turned_about(axis: list[float], seed: int = 0, count: int = 12) -> Rig:
    """Make a rig whose gripper turns about one axis of its own."""
    made = rig(None, seed=seed, count=count)
    angles = np.random.default_rng(seed).normal(size=count)
    gripper = Transform(Rotation.from_rotvec(np.outer(angles, axis)), made.gripper.xyz)
    return made._replace(gripper=gripper, target=made.x.inverse() @ gripper.inverse() @ made.z)


@pytest.mark.parametrize("name", RIGS)
def test_least_squares_are_those_of_scipy(name: str) -> None:
    case = RIGS[name]
    found = solve_hand_eye(poses(case["gripper"]), poses(case["target"]), eye_to_hand=case["eye_to_hand"])
    assert found.noise_at == case["noise_at"]
    assert (np.flatnonzero(~found.used) + 1).tolist() == case["left_out"]
    assert found.rms == pytest.approx((case["rms_distance"], case["rms_angle"]), abs=3e-8)
    for side, covariance in (("x", found.covariance_x), ("z", found.covariance_z)):
        assert (covariance == covariance.T).all()
        wanted = case[side]
        assert getattr(found, side).is_close(Transform.from_arrays(wanted["xyz"], wanted["xyzw"], normalize=True), angle=3e-8, distance=3e-8)
        if wanted["covariance"] is not None:
            there = np.array(wanted["covariance"]).reshape(6, 6)
            deviations = np.sqrt(np.diag(there))
            np.testing.assert_allclose(covariance / np.outer(deviations, deviations), there / np.outer(deviations, deviations), atol=1e-7)


def test_the_error_is_a_fraction_of_that_of_opencv() -> None:
    clean: list[Any] = []
    wrong: list[Any] = []
    for case in RIGS.values():
        if case["noise_at"] is None:
            continue
        truth = Transform.from_arrays(case["truth_x"]["xyz"], case["truth_x"]["xyzw"], normalize=True)
        x = solve_hand_eye(poses(case["gripper"]), poses(case["target"]), eye_to_hand=case["eye_to_hand"]).x
        metres, radians = x.distance(truth)
        best = np.min(list(case["opencv_error_deg_mm"].values()), 0)
        (wrong if case["left_out"] else clean).append(np.array([np.degrees(radians), 1000 * metres]) / best)
    assert (np.median(clean, 0) <= 0.7).all()
    assert np.median(wrong) <= 0.01


@pytest.mark.parametrize("eye_to_hand", [False, True])
@pytest.mark.parametrize(("count", "turn"), [(3, 0.5), (4, 0.5), (5, 0.2), (30, 0.4), (30, 2.0)])
def test_exact_samples_give_x_and_z_to_twelve_digits(count: int, turn: float, eye_to_hand: bool) -> None:  # noqa: FBT001
    for seed in range(3):
        made = rig(None, seed=seed, count=count, turn=turn)
        gripper = made.gripper.inverse() if eye_to_hand else made.gripper
        found = solve_hand_eye(gripper, made.target, eye_to_hand=eye_to_hand)
        assert found.noise_at is None
        assert found.used.all()
        assert found.x.is_close(made.x, angle=1e-12, distance=1e-12)
        assert found.z.is_close(made.z, angle=1e-12, distance=2e-12)


@pytest.mark.large
@pytest.mark.parametrize("cut", CUTS)
def test_it_is_seen_where_the_noise_is(cut: str) -> None:
    found = [solved(rig(cut, seed=seed, count=25)).noise_at for seed in range(8)]
    assert found.count(cut) >= 7


def test_noise_at_the_gripper_of_a_camera_beside_the_robot_is_noise_at_the_base() -> None:
    made = rig("gripper", seed=1, count=25)
    assert solve_hand_eye(made.gripper.inverse(), made.target, eye_to_hand=True).noise_at == "base"


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("seed", range(3))
def test_wrong_samples_are_left_out_and_told(cut: str, seed: int) -> None:
    made = rig(cut, seed=seed, count=20, wrong=5)
    found = solved(made)
    assert np.flatnonzero(~found.used).tolist() == made.wrong
    assert (found.u[made.wrong] > 3.0).all()
    assert found.dof == 3 * 15 - 6
    assert found.x.is_close(made.x, angle=5e-3, distance=5e-3)
    right = np.setdiff1d(np.arange(20), made.wrong)
    alone = solve_hand_eye(made.gripper[right], made.target[right], robust=False)
    assert found.x.is_close(alone.x, angle=1e-9, distance=1e-9)


def test_without_robust_all_are_kept() -> None:
    made = rig("target", seed=0, count=20)
    target = replaced(made.target, [3], made.target[[3]] @ Transform(Rotation.identity(), [0.0, 0.05, 0.0]))
    assert solve_hand_eye(made.gripper, target).used.tolist() == [row != 3 for row in range(20)]
    assert solve_hand_eye(made.gripper, target, robust=False).used.all()


def test_moving_the_world_moves_z_and_moving_the_target_too() -> None:
    made = rig("target", seed=2)
    plain = solved(made)
    world = solve_hand_eye(MOVED @ made.gripper, made.target)
    assert world.x.is_close(plain.x, angle=1e-9)
    assert world.z.is_close(MOVED @ plain.z, angle=1e-9)
    np.testing.assert_allclose(world.covariance_x, plain.covariance_x, atol=1e-12)
    np.testing.assert_allclose(world.residuals, plain.residuals, atol=1e-9)


def test_moving_the_gripper_or_the_camera_moves_x() -> None:
    made = rig("target", seed=3)
    plain = solved(made)
    assert solve_hand_eye(made.gripper @ MOVED, made.target).x.is_close(MOVED.inverse() @ plain.x, angle=1e-9, distance=1e-8)
    assert solve_hand_eye(made.gripper, MOVED @ made.target).x.is_close(plain.x @ MOVED.inverse(), angle=1e-9, distance=1e-8)


def test_with_all_inverted_x_and_z_change_places() -> None:
    made = rig("target", seed=4, count=20, wrong=3)
    plain, other = solved(made), solve_hand_eye(made.gripper, made.target.inverse(), eye_to_hand=True)
    assert other.x.is_close(plain.z, angle=1e-9, distance=1e-8)
    assert other.z.is_close(plain.x, angle=1e-9, distance=1e-8)
    assert other.noise_at == "camera"
    np.testing.assert_allclose(other.covariance_z, plain.covariance_x, atol=2e-4 * plain.covariance_x.max())  # to the first order


def test_the_order_of_samples_does_not_matter() -> None:
    made = rig("target", seed=5, count=20, wrong=4)
    back = solve_hand_eye(made.gripper[::-1], made.target[::-1])
    assert back.x.is_close(solved(made).x, angle=1e-9)
    assert (back.used[::-1] == solved(made).used).all()


@pytest.mark.large
@pytest.mark.parametrize("cut", CUTS)
def test_covariances_are_those_of_many_draws(cut: str) -> None:
    made = rig(None, seed=6, count=12)
    rng = np.random.default_rng(7)
    truth = {"x": made.x, "z": made.z}
    errors: dict[str, list[Any]] = {"x": [], "z": []}
    told: dict[str, list[Any]] = {"x": [], "z": []}
    for _ in range(150):
        off = small(rng, 12, (5e-4, 2e-3))
        target = {"target": made.target @ off, "camera": off @ made.target, "gripper": made.x.inverse() @ off @ made.x @ made.target}[cut]
        found = solve_hand_eye(made.gripper, target, robust=False)
        if found.noise_at != cut:
            continue
        for side, covariance in (("x", found.covariance_x), ("z", found.covariance_z)):
            at = getattr(found, side)
            errors[side].append([*(at.xyz - truth[side].xyz), *(at.rotation @ truth[side].rotation.inverse()).as_rotvec()])
            told[side].append(covariance)
    for side in "xz":
        drawn, mean = np.array(errors[side]), np.mean(told[side], 0)
        assert len(drawn) > 100
        white = np.linalg.solve(np.linalg.cholesky(mean), drawn.T)
        spread = np.linalg.eigvalsh(white @ white.T / len(drawn))
        assert 0.8 < spread.mean() < 1.25
        assert 0.5 < spread.min() < spread.max() < 1.8


def test_the_same_samples_give_the_same_bits() -> None:
    made = rig("target", seed=8, count=20, wrong=3)
    first, second = solved(made), solved(made)
    assert first.x.components == second.x.components
    assert first.covariance_z.tobytes() == second.covariance_z.tobytes()


def test_the_draws_are_the_same_for_ever() -> None:
    assert list(draws(3, 3, 20)) == [[8, 15, 16], [5, 8, 10], [6, 9, 15]]


def test_thousands_of_samples_of_a_trajectory_are_solved() -> None:
    made = rig("target", seed=9, count=3000, wrong=300)
    found = solved(made)
    assert not found.used[made.wrong].any()
    assert found.used.sum() > 2690
    assert found.x.is_close(made.x, angle=1e-3, distance=1e-3)


@pytest.mark.parametrize(("count", "words"), [(0, "0 samples"), (1, "1 sample"), (2, "2 samples")])
def test_too_few_samples(count: int, words: str) -> None:
    made = rig(None, seed=0)
    with pytest.raises(ValueInvalid, match=f"^{words}; hand-eye needs 3, turned about two axes$"):
        solve_hand_eye(made.gripper[:count], made.target[:count])


def test_as_many_poses_of_both() -> None:
    made = rig(None, seed=0)
    with pytest.raises(ValueInvalid, match=r"^gripper has 15 poses, target 14$"):
        solve_hand_eye(made.gripper, made.target[1:])


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize(("axis", "shown"), [([0, 0, 1], "0.000 0.000 1.000"), ([0, -2.5, 0], "0.000 1.000 0.000"), ([0.6, 0, -0.8], "-0.600 0.000 0.800")])
def test_turns_about_one_axis(axis: list[float], shown: str, noise: bool) -> None:  # noqa: FBT001
    made = turned_about(axis)
    target = made.target @ small(np.random.default_rng(0), 12, (5e-4, 2e-3)) if noise else made.target
    says = "all turns are about one axis ({} in {}): where {} is along it cannot be known; turn about a second one"
    with pytest.raises(ValueInvalid) as caught:
        solve_hand_eye(made.gripper, target)
    assert str(caught.value) == says.format(shown, "gripper", "camera")
    with pytest.raises(ValueInvalid) as caught:
        solve_hand_eye(made.gripper.inverse(), target, eye_to_hand=True, names=("map", "flange", "cam", "tag"))
    assert str(caught.value) == says.format(shown, "map", "cam")


def test_a_second_axis_among_wrong_samples_alone_is_none() -> None:
    made = turned_about([0, 0, 1], count=20)
    gripper = replaced(made.gripper, [4, 9], Transform.random(2, seed=1))
    with pytest.raises(ValueInvalid, match=r"^all turns are about one axis \("):
        solve_hand_eye(gripper, made.target)


def test_turns_about_the_second_axis_that_drown_in_noise() -> None:
    made = rig("target", seed=1, count=15, turn=np.array([0.5, 0.01, 0.01]), noise=(5e-4, 1e-2))
    with pytest.raises(ValueInvalid, match=r"^all turns are about one axis \(1.000 -?0.0\d\d -?0.0\d\d in gripper\)"):
        solved(made)


def test_a_gripper_that_does_not_turn() -> None:
    made = rig(None, seed=1, turn=0.001)
    with pytest.raises(ValueInvalid, match=r"^gripper does not turn \(0.10 deg\); hand-eye needs turns about two axes$"):
        solved(made)


def test_small_turns_are_warned_of() -> None:
    assert overheard(solved, rig(None, seed=0))[1] == []
    found, told = overheard(solved, rig(None, seed=0, turn=np.array([0.4, 0.04, 0.04])))
    assert found.turns[0] > 0.3
    assert found.turns[1] == pytest.approx(np.radians(2.7), abs=1e-3)
    assert [each for _, each in told] == ["turns about a second axis are small (2.7 deg rms, first axis 1.000 -0.008 -0.008 in gripper): turn more"]


@pytest.mark.large
@pytest.mark.parametrize("wrong", [0, 3])
@pytest.mark.parametrize("turn", [0.1, 0.4, 1.0])
@pytest.mark.parametrize("inverted", ["gripper", "target"])
def test_samples_the_other_way_round(inverted: str, turn: float, wrong: int) -> None:
    made = rig("target", seed=3, count=16, wrong=wrong, turn=turn)
    pairs = (made.gripper.inverse(), made.target) if inverted == "gripper" else (made.gripper, made.target.inverse())
    number = r"\d+\.\d mm \d+\.\d deg"
    says = rf"^the samples do not fit \({number}\); they do \({number}\) {{}} --eye-to-hand, or with TARGET inverted \({{}}\)$"
    with pytest.raises(ValueInvalid, match=says.format("with", "target<-camera")):
        solve_hand_eye(*pairs)
    with pytest.raises(ValueInvalid, match=says.format("without", "tag<-cam")):
        solve_hand_eye(pairs[0].inverse(), pairs[1], eye_to_hand=True, names=("base", "flange", "cam", "tag"))
    solve_hand_eye(*pairs, eye_to_hand=True)


@pytest.mark.parametrize("count", [3, 4, 6, 15, 40])
def test_samples_that_do_not_belong_together(count: int) -> None:
    with pytest.raises(ValueInvalid, match=r"^the samples do not fit \(.* mm .* deg\); does each row of GRIPPER belong to that of TARGET\?$"):
        solve_hand_eye(Transform.random(count, seed=1), Transform.random(count, seed=2))


@pytest.mark.parametrize(("factor", "told"), [(1000.0, "0.001"), (0.001, "1000"), (1.1, "0.909")])
def test_places_in_another_unit_are_told(factor: float, told: str) -> None:
    made = rig("target", seed=3, noise=(1e-4, 2e-4))
    _, [(_, warning)] = overheard(solve_hand_eye, made.gripper, Transform(made.target.rotation, factor * made.target.xyz))
    assert re.fullmatch(r"TARGET fits better with its places times [\d.]+: another unit, or the size of a marker\?", warning)
    assert float(warning.split()[7].rstrip(":")) == pytest.approx(float(told), rel=2e-3)


@pytest.mark.parametrize("eye_to_hand", [False, True])
def test_a_world_far_away_costs_no_digits_that_floats_have(eye_to_hand: bool) -> None:  # noqa: FBT001
    made = rig("target", seed=1, wrong=2)
    far = Transform(Rotation.identity(), [690_000.0, 5_330_000.0, 500.0]) @ made.gripper
    plain = solved(made)
    found = solve_hand_eye(far.inverse() if eye_to_hand else far, made.target, eye_to_hand=eye_to_hand)
    assert found.x.is_close(plain.x, angle=1e-7, distance=1e-7)
    assert (found.used == plain.used).all()


def test_places_whose_squares_overflow() -> None:
    made = rig(None, seed=0)
    with pytest.raises(ValueInvalid, match=r"^target: a place at .*e\+20\d m; at most 1e\+100 m can be fitted$"):
        solve_hand_eye(made.gripper, Transform(made.target.rotation, 1e202 * made.target.xyz))


def test_three_samples_do_not_look_certain() -> None:
    sizes = []
    for seed in range(15):
        made = rig("target", seed=seed, count=3)
        found, told = overheard(solved, made)
        off = np.array([*(found.x.xyz - made.x.xyz), *(found.x.rotation @ made.x.rotation.inverse()).as_rotvec()])
        sizes.append(off @ np.linalg.solve(found.covariance_x, off) / 6)
        assert told[-1][1].endswith(" say little of their own noise: the sigmas are rough; take 8 or more")
    assert 0.2 < np.median(sizes) < 5.0


# --- one table of both, and orientations alone ---------------------------------------------------------------------


def table(made: Any, words: tuple[str, str], parts: slice = slice(7)) -> str:
    """Write samples side by side."""
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")[parts]
    sides = [np.hstack([each.xyz, each.xyzw])[:, parts] for each in (made.gripper, made.target)]
    rows = [",".join(map(repr, row)) for row in np.hstack(sides).tolist()]
    return "\n".join([",".join(f"{word}{name}" for word in words for name in names), *rows]) + "\n"


@pytest.mark.parametrize("words", [("gripper_", "target_"), ("gripper.", "target."), ("ee_", "tag_")])
def test_both_poses_of_a_sample_may_stand_side_by_side(run: Any, words: tuple[str, str]) -> None:
    made = rig("target", seed=4, count=8, turn=0.6)
    sides = [[word + name for name in ("x", "y", "z", "qx", "qy", "qz", "qw")] for word in words]
    more = [] if words[0].startswith("gripper") else [part for side in sides for part in ("--columns", ",".join(side))]
    done = run("solve", "--hand-eye", "s.csv", *more, "-f", "csv", files={"s.csv": table(made, words)})
    assert done.status == 0, done.err
    samples = [{"gripper": {"xyz": g.xyz.tolist(), "xyzw": g.xyzw.tolist()}, "target": {"xyz": t.xyz.tolist(), "xyzw": t.xyzw.tolist()}} for g, t in zip(made.gripper, made.target, strict=True)]
    assert done.out == run("solve", "--hand-eye", "s.json", "-f", "csv", files={"s.json": json.dumps(samples)}).out
    bare = run("solve", "--hand-eye", "s.csv", files={"s.csv": table(made, words)})
    assert (bare.status, "--columns, twice" in bare.err) == ((0, False) if not more else (1, True))


def test_orientations_alone_give_the_rotation_and_say_so(run: Any) -> None:
    made = rig("target", seed=4, count=12, turn=0.6)
    done = run("solve", "--hand-eye", "s.csv", "-f", "json", files={"s.csv": table(made, ("gripper_", "target_"), slice(3, 7))})
    assert "no positions: only the rotations are solved (sigma 0.0" in done.err
    camera = next(each for each in json.loads(done.out)["frames"] if each["name"] == "camera")
    assert "covariance" not in camera
    assert Rotation.from_quaternion([*camera["quaternion"].values()]).distance(made.x.rotation) < 3e-3
