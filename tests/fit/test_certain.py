"""Results are certain only where they are: what cannot be known is a warning or an error of one line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rigs import rig
from worlds import ring

from frametool.errors import ValueInvalid, overheard
from frametool.fit.comparison import AUTO, EVO, Comparison, Settings
from frametool.fit.comparison import compared as compare
from frametool.fit.hand_eye import solve_hand_eye
from frametool.fit.measured_tree import solve_tree
from frametool.fit.pairing import clock_offset
from frametool.fit.trajectory_errors import parse_delta
from frametool.frames.trajectory import Trajectory
from frametool.geometry.transform import Rotation, Transform

pytestmark = pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")  # what looks odd is in the result too

TIME = np.arange(0.0, 20.0, 0.02)
MOUNT = Transform(Rotation.from_rpy(np.radians([0.0, 0.0, 120.0])), (0.3, -0.2, 0.1))


def drive(times: Any = TIME) -> Trajectory:
    """Return a body that moves and turns about all axes."""
    xyz = np.stack([5 * np.cos(0.4 * times), 3 * np.sin(0.7 * times), 0.5 * np.sin(times)], -1)
    rpy = np.stack([0.5 * np.sin(0.9 * times), 0.4 * np.cos(1.3 * times), 0.4 * times + 0.3 * np.sin(2.1 * times)], -1)
    return Trajectory(np.rint(times * 1e9).astype(np.int64), xyz, Rotation.from_rpy(rpy).as_quaternion())


def late(each: Trajectory, seconds: float) -> Trajectory:
    """Return a trajectory whose clock is behind."""
    return each._replace(stamps_ns=each.stamps_ns - round(1e9 * seconds))


def compared(ref: Trajectory, est: Trajectory, **settings: Any) -> Comparison:
    return compare(ref, est, Settings().changed(**settings))


# few loops


@pytest.mark.parametrize(("frames", "more"), [(3, 0), (3, 1), (5, 0), (8, 1), (10, 1), (10, 2), (12, 3)])
def test_few_loops_are_solved_and_their_noise_is_found_or_said_to_be_rough(frames: int, more: int) -> None:
    found, said = overheard(solve_tree, ring(frames, more, seed=1))
    assert found.used.all()
    assert found.sigma is not None
    assert all(1 / 3 < each / 1e-3 < 3 for each in found.sigma)
    assert bool(said) == (frames > 3 or more == 0) or frames + more <= 2 * (frames - 1)
    covariance = found.covariance(found.root, "f2")
    assert covariance is not None
    assert np.sqrt(np.diagonal(covariance)).min() > 1e-4


def test_one_loop_does_not_tell_metres_from_radians() -> None:
    said = [overheard(solve_tree, ring(5, loops, seed=1))[1] for loops in (0, 40)]
    assert said == [[("", "1 loop does not tell metres from radians: the sigmas are rough; give sigma")], []]


# hand-eye


@pytest.mark.parametrize("eye_to_hand", [False, True])
def test_three_samples_fit_either_setting_and_say_so(eye_to_hand: bool) -> None:  # noqa: FBT001 - of a test
    made = rig("target", seed=3, count=3, turn=0.5)
    _, told = overheard(solve_hand_eye, made.gripper, made.target, eye_to_hand=eye_to_hand)
    assert any(each.startswith("3 samples fit with and without --eye-to-hand") for _, each in told)


def test_enough_samples_fit_one_setting() -> None:
    made = rig("target", seed=3, count=5, turn=0.5)
    assert not any("without" in each for _, each in overheard(solve_hand_eye, made.gripper, made.target)[1])


# clocks


def repeating() -> tuple[Trajectory, Trajectory]:
    """Return a motion that repeats every 4 s, and a part of it on another clock."""
    times = np.arange(0.0, 40.0, 0.02)
    xyz = np.stack([np.sin(np.pi * times / 2) + 0.3 * np.sin(np.pi * times), np.cos(np.pi * times / 2), 0 * times], -1)
    whole = Trajectory(np.rint(times * 1e9).astype(np.int64), xyz)
    return whole, late(whole.at(slice(700, 1300)), 1.5)


def test_motion_that_repeats_names_another_offset_that_fits_as_well() -> None:
    found = compared(*repeating(), offset=AUTO)
    assert any(each.startswith("the motion repeats: clock offsets of ") for each in found.hints)
    offset = clock_offset(*repeating())
    assert offset.rival is not None
    assert (offset.rival - offset.seconds) / 4.0 == pytest.approx(round((offset.rival - offset.seconds) / 4.0), abs=0.02)


def test_motion_that_does_not_repeat_names_none() -> None:
    ref = drive()
    assert compared(ref, late(ref, 0.25), offset=AUTO).hints == []


@pytest.mark.parametrize("arm", [0.5, 2.0])
def test_a_lever_arm_does_not_move_the_clock(arm: float) -> None:
    est = drive()
    body = Transform(Rotation.identity(), (arm, 0.3, -0.2))
    ref = est.with_poses(est.poses @ body)
    found = compared(ref, late(est.at(slice(100, 800, 2)), 0.15), offset=AUTO, mount=AUTO)
    assert found.pairs.offset_ns / 1e9 == pytest.approx(0.15, abs=1e-4)
    mount = found.pairs.mount
    assert mount is not None
    assert mount.xyz == pytest.approx(body.xyz, abs=1e-3)


# mounts, worlds and lines


def test_a_turned_body_is_part_of_what_mount_auto_finds() -> None:
    est = drive()
    found = compared(est.with_poses(est.poses @ MOUNT), est, mount=AUTO)
    mount = found.pairs.mount
    assert mount is not None
    assert mount.is_close(MOUNT, angle=1e-9, distance=1e-9)
    assert found.ate.rad is not None
    assert np.degrees(found.ate.rad).max() < 1e-6


def test_a_turned_world_is_not_blamed_on_the_bodies() -> None:
    est = drive()
    world = Transform(Rotation.from_rpy((0.0, 0.0, 0.5)), (0.0, 0.0, 0.0))
    found = compared(est.with_poses(world @ est.poses), est, align="none")
    assert found.hints == ["the worlds are 28.6 deg apart; --align se3"]


def test_a_wrong_scale_is_not_a_line() -> None:
    ref = drive()
    assert compared(ref, ref._replace(xyz=2.5 * ref.xyz)).hints == []


def test_what_is_nearly_a_line_is_still_told() -> None:
    ref = drive()
    noise = np.random.default_rng(0).normal(size=ref.xyz.shape)
    ref = ref._replace(xyz=ref.xyz * [1.0, 0.003, 0.003])
    assert "positions lie nearly on a line: the turn about it rests on noise" in compared(ref, ref._replace(xyz=ref.xyz + 0.01 * noise)).hints


# numbers beyond measure


@pytest.mark.parametrize("size", [1e120, 1e154, 1e300])
@pytest.mark.parametrize("side", [0, 1])
def test_positions_whose_squares_overflow_are_refused(size: float, side: int) -> None:
    pair = [drive(), drive()]
    pair[side] = pair[side]._replace(xyz=size * pair[side].xyz)
    with pytest.raises(ValueInvalid, match=r"^(ref|est): a place at \S+ m; at most 1e\+100 m can be fitted$"):
        compared(*pair)


def test_large_worlds_are_compared() -> None:
    ref = drive()
    small, large = (compared(ref._replace(xyz=k * ref.xyz), ref._replace(xyz=k * (ref.xyz + 0.1 * ref.xyz**2))) for k in (1.0, 2.0**300))
    assert large.ate_by_alignment["se3"] == pytest.approx(2.0**300 * (small.ate_by_alignment["se3"] or 0.0), rel=1e-9)


@pytest.mark.parametrize(("delta", "size"), [("0.0000000000000000001m", 1.0), ("1m", 1e18)])
def test_a_delta_that_rounding_loses_is_refused(delta: str, size: float) -> None:
    ref = drive()._replace(xyz=size * drive().xyz)
    with pytest.raises(ValueInvalid, match="is lost in rounding"):
        compared(ref, ref, deltas=(parse_delta(delta),))


def test_a_delta_that_nobody_asked_for_is_left_out_where_rounding_loses_it() -> None:
    ref = drive()._replace(xyz=1e18 * drive().xyz)
    assert compared(ref, ref).relative == []


# as evo does


def test_as_evo_pairs_a_reference_out_of_order() -> None:
    ref = drive(np.arange(0.0, 2.0, 0.1))
    est = ref.at(np.arange(0, 20, 2))
    shuffled = ref.at(np.random.default_rng(1).permutation(20))
    assert compare(shuffled, est, EVO).pairs.ref.size == 10
    assert compare(shuffled, est, EVO).ate.m.max() == 0.0
