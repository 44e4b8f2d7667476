"""Hand-eye beside OpenCV's five closed forms: `python tests/benchmarks/bench_hand_eye.py [RIGS]`.

For each way of noise the median over seeded rigs of our error to the true X over that of the closed form that does best
on these rigs, degrees and millimetres; last over all rigs.  Needs OpenCV 4 (5.0 has no calibrateHandEye).
Noise at the target is what markers have; where it is at camera or gripper the closed forms weigh nearly right already.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1] / "support"), str(Path(__file__).parents[2])]
from rigs import Rig, rig  # noqa: E402

from frametool.fit.hand_eye import solve_hand_eye  # noqa: E402
from frametool.geometry.transform import Transform  # noqa: E402

METHODS = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")
WRONG = 3


def theirs(cv2: Any, made: Rig) -> Any:
    """Return the errors in degrees and in millimetres of the closed forms, infinite where one found no rotation."""
    g, c = made.gripper.as_matrix(), made.target.as_matrix()
    found = np.full((len(METHODS), 2), np.inf)
    for at, name in enumerate(METHODS):
        method = getattr(cv2, f"CALIB_HAND_EYE_{name}")
        r, t = cv2.calibrateHandEye(g[:, :3, :3], g[:, :3, 3], c[:, :3, :3], c[:, :3, 3], method=method)
        if np.isfinite(t).all() and np.linalg.det(r) > 0.0:
            x = np.eye(4)
            x[:3, :3], x[:3, 3] = r, t[:, 0]
            found[at] = error(Transform.from_matrix(x, normalize=True), made)
    return found


def error(x: Transform, made: Rig) -> tuple[float, float]:
    """Return degrees and millimetres off the truth."""
    metres, radians = x.distance(made.x)
    return float(np.degrees(radians)), 1000.0 * float(metres)


def main(rigs: int) -> None:
    """Print a row for each way of noise."""
    try:
        import cv2  # type: ignore[import-not-found]
    except ImportError:
        cv2 = None
        print("OpenCV is not installed: our errors alone")
    print(f"{'noise at':<10} {'wrong':>5}  {'ours deg':>9} {'mm':>7}  {'of theirs deg':>13} {'mm':>7}  {'s a rig':>8}")
    for wrong in (0, WRONG):
        every = []
        for noise_at in ("target", "camera", "gripper"):
            made = [rig(noise_at, seed=seed, count=20, wrong=wrong) for seed in range(rigs)]
            begin = time.perf_counter()
            ours = np.array([error(solve_hand_eye(each.gripper, each.target).x, each) for each in made])
            seconds = (time.perf_counter() - begin) / rigs
            ratios = np.full((rigs, 2), np.nan)
            if cv2:
                peers = np.array([theirs(cv2, each) for each in made])
                best = np.median(peers, 0).argmin(0)
                ratios = ours / np.stack([peers[:, best[0], 0], peers[:, best[1], 1]], 1)
            every.append(ratios)
            (deg, mm), (of_deg, of_mm) = np.median(ours, 0), np.median(ratios, 0)
            print(f"{noise_at:<10} {wrong:>5}  {deg:>9.4f} {mm:>7.3f}  {of_deg:>13.4f} {of_mm:>7.4f}  {seconds:>8.3f}")
        of_deg, of_mm = np.median(np.concatenate(every), 0)
        print(f"{'all':<10} {wrong:>5}  {'':>17}  {of_deg:>13.4f} {of_mm:>7.4f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
