"""The arithmetic against numbers of evo, the KITTI metric's definition and SciPy (golden/compare.json)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frametool.fit.alignment import ALIGNMENTS, Unaligned, fitted, lever_arm
from frametool.fit.pairing import Pairs, clock_offset, paired
from frametool.fit.trajectory_errors import (
    Delta,
    absolute_errors,
    all_pairs,
    chained,
    parse_delta,
    relative_errors,
    segment_errors,
    statistics,
)
from frametool.frames.trajectory import Trajectory, way
from frametool.geometry.transform import Rotation, Transform

GOLDEN = Path(__file__).parents[1] / "golden"
CASES = {case["name"]: case for case in json.loads((GOLDEN / "compare.json").read_text())["cases"]}
UP = np.array([0.0, 0.0, 1.0])


def read(name: str) -> Trajectory:
    """Read one of the golden files, without any of the readers."""
    rows = [line.replace(",", " ").split() for line in (GOLDEN / name).read_text().splitlines() if not line.startswith(("#", "t,"))]
    numbers = np.array(rows, float)
    if numbers.shape[1] == 12:
        m = numbers.reshape(-1, 3, 4)
        return Trajectory(None, m[:, :, 3], Rotation.from_matrix(m[:, :, :3], normalize=True).as_quaternion())
    stamps = np.array([int(row[0]) if len(row[0]) == 19 and "." not in row[0] else round(float(row[0]) * 1e9) for row in rows])
    if "." in rows[0][0]:
        whole = [row[0].split(".") for row in rows]
        stamps = np.array([int(a) * 10**9 + int(b.ljust(9, "0")) for a, b in whole])
    if numbers.shape[1] == 4:
        return Trajectory(stamps, numbers[:, 1:4])
    order = [5, 6, 7, 4] if name.endswith("csv") else [4, 5, 6, 7]
    return Trajectory(stamps, numbers[:, 1:4], Rotation.from_quaternion(numbers[:, order], normalize=True).as_quaternion())


def pairs_of(case: dict[str, Any]) -> Pairs:
    ref, est = read(case["ref"]).in_order(), read(case["est"]).in_order()
    if ref.stamps_ns is None or est.stamps_ns is None:
        return paired(ref, est)
    return paired(ref, est._replace(stamps_ns=est.stamps_ns + round(1e9 * case.get("offset", 0))))


def close(found: Any, wanted: Any, tolerance: float = 1e-9) -> None:
    """Compare statistics, each to a share of the rmse."""
    for key, value in wanted.items():
        scale = wanted["sse"] if key == "sse" else wanted["rmse"]
        assert found[key] == pytest.approx(value, rel=tolerance, abs=tolerance * scale + 1e-12), key


@pytest.mark.parametrize("name", CASES)
def test_pairs_alignments_and_absolute_errors(name: str) -> None:
    case, ours = CASES[name], CASES[name]["ours"]
    pairs = pairs_of(case)
    assert (pairs.ref.size, pairs.possible, pairs.interpolated) == (ours["paired"], ours["possible"], ours.get("interpolated"))
    assert pairs.max_gap_s == pytest.approx(ours.get("max_gap_s"))
    exact = 1e-5 if name == "kitti" else 1e-9
    for kind in ALIGNMENTS:
        try:
            fit = fitted(kind, pairs.ref, pairs.est, UP)
        except Unaligned:
            assert kind not in ours["ate_by_alignment"]
            continue
        rmse = statistics(absolute_errors(pairs.ref, fit.moved(pairs.est), UP).m)["rmse"]
        assert rmse == pytest.approx(ours["ate_by_alignment"][kind], rel=exact if kind == "origin" else 1e-9)
    fit = fitted(ours["align"], pairs.ref, pairs.est, UP)
    wanted = ours["transform"]
    assert fit.transform.is_close(Transform.from_arrays(wanted["xyz"], wanted["xyzw"], normalize=True), angle=1e-9, distance=1e-8)
    est = fit.moved(pairs.est)
    errors = absolute_errors(pairs.ref, est, UP)
    close(statistics(errors.m), ours["ate"]["m"])
    for key in ("along", "across", "up"):
        close(statistics(getattr(errors, key)), ours["ate"][f"{key}_m"])
    assert errors.m[-1] == pytest.approx(ours["ate"]["end_m"], rel=1e-9)
    assert (errors.rad is None) == ("deg" not in ours["ate"])
    if errors.rad is not None:
        close(statistics(np.degrees(errors.rad)), ours["ate"]["deg"], exact)
    assert way(est.xyz)[-1] == pytest.approx(ours["path_m"]["est"], rel=1e-9)


def along(trajectory: Trajectory, delta: Delta) -> Any:
    found = delta.along(trajectory)
    assert found is not None
    return found


@pytest.mark.parametrize("name", CASES)
def test_relative_errors_and_segments(name: str) -> None:
    case, ours = CASES[name], CASES[name]["ours"]
    pairs = pairs_of(case)
    est = fitted(ours["align"], pairs.ref, pairs.est, UP).moved(pairs.est)
    exact = 1e-5 if name == "kitti" else 1e-9
    for row in ours["rpe"]:
        delta = parse_delta(row["delta"])
        found = relative_errors(pairs.ref, est, *chained(along(pairs.ref, delta), delta.amount))
        assert len(found.start) == row["pairs"]
        close(statistics(found.distance), row["distance_m"], exact)
        if found.m is not None and found.rad is not None:
            close(statistics(found.m), row["m"], exact)
            close(statistics(np.degrees(found.rad)), row["deg"], exact)
    for key, lengths, step in (("kitti", range(100, 900, 100), 10), ("kitti_5_10_50_step_1", (5, 10, 50), 1)):
        if wanted := ours.get(key):
            found_segments = segment_errors(pairs.ref, est, list(lengths), step)
            assert found_segments is not None
            assert 100 * found_segments.share.mean() == pytest.approx(wanted["percent"], rel=exact)


def test_evo_gives_the_same_numbers() -> None:
    for name, case in CASES.items():
        if not case.get("evo"):
            continue
        exact = 1e-5 if name == "kitti" else 1e-9
        ref, est = read(case["ref"]), read(case["est"])
        pairs = paired(ref, est, max_diff_ns=1e7)
        assert pairs.ref.size == case["evo"]["pairs"], name
        for row in case["evo"]["ape"]:
            if name == "line" and row["align"] in ("se3", "sim3"):  # evo fits what the pairs do not determine
                with pytest.raises(Unaligned, match="lies on a line"):
                    fitted(row["align"], pairs.ref, pairs.est, UP)
                continue
            first = slice(row.get("first"))
            fit = fitted(row["align"], pairs.ref.at(first), pairs.est.at(first), UP)
            errors = absolute_errors(pairs.ref, fit.moved(pairs.est), UP)
            assert errors.rad is not None
            close(statistics(errors.m), row["trans_part"], exact)
            close(statistics(np.degrees(errors.rad)), row["angle_deg"], max(exact, 1e-7))
        for row in case["evo"]["rpe"]:
            delta = parse_delta(row["delta"])
            path = along(pairs.ref if row["pairs_from"] == "reference" else pairs.est, delta)
            ends = all_pairs(path, delta.amount, 0.1) if row["all"] else chained(path, delta.amount)
            found = relative_errors(pairs.ref, pairs.est, *ends)
            assert len(found.start) == row["count"], (name, row["delta"], row["all"])
            assert found.m is not None
            close(statistics(found.m), row["trans_part"], exact)


def test_all_pairs_end_at_the_first_of_poses_at_one_place() -> None:
    starts, ends = all_pairs(np.array([0.0, 0.5, 1.0, 1.0, 1.0, 2.5]), 1.0, 0.1)
    assert (starts.tolist(), ends.tolist()) == ([0], [2])


def test_a_clock_that_is_late_is_found_to_a_millisecond() -> None:
    for name, case in CASES.items():
        ref, est = read(case["ref"]).in_order(), read(case["est"]).in_order()
        if ref.stamps_ns is None or name == "line":
            continue
        found = clock_offset(ref, est)
        assert found.seconds == pytest.approx(case.get("offset", 0.0), abs=1e-3 if name == "clock" else 0.02), name


def test_the_arm_to_a_prism() -> None:
    case = CASES["prism"]
    pairs = pairs_of(case)
    arm = lever_arm("se3", pairs.ref, pairs.est, UP)
    assert arm == pytest.approx(case["mount_auto"]["xyz"], abs=1e-8)
    assert arm == pytest.approx(case["arm"], abs=2e-3)
