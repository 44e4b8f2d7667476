"""Make the trajectories of examples/: a drive round a block, and what three estimates of it look like.

    python tests/make_trajectories.py          # writes examples/{truth,odometry,mono}.tum and examples/antenna.csv

truth     20 Hz, 30 s, 200 m, east-north-up
odometry  10 Hz, from where it began, with 1 % of drift, its clock 0.3 s behind
mono      4 Hz, another world at 0.4 of the size, noise alone
gps       2 Hz, positions of an antenna 1.2 m behind and 0.8 m above the body, 2 cm of noise
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from frametool import Rotation, Transform

FOLDER = Path(__file__).parents[1] / "examples"
SECONDS = 30.0
BEGIN = 1_700_000_000
ARM = (-1.2, 0.3, 0.8)


def truth(seconds: np.ndarray) -> Transform:
    """Return where the body was: round a rounded block on a hill."""
    phase = 2 * np.pi * seconds / SECONDS
    x, y = 36 * np.sin(phase) + 4 * np.sin(3 * phase), 26 * (1 - np.cos(phase)) - 3 * np.sin(2 * phase)
    z = 1.5 * np.sin(phase) + 0.4 * np.cos(2 * phase)
    step = 1e-4
    ahead = [np.gradient(part, seconds) for part in (x, y, z)]
    yaw = np.unwrap(np.arctan2(ahead[1], ahead[0]))
    pitch = -np.arctan2(ahead[2], np.hypot(ahead[0], ahead[1]))
    roll = 0.05 * np.sin(5 * phase) + step * 0
    return Transform(Rotation.from_rpy(np.stack([roll, pitch, yaw], -1)), np.stack([x, y, z], -1))


def write_tum(name: str, seconds: np.ndarray, poses: Transform) -> None:
    """Write stamps and poses with the digits that such files have."""
    rows = zip(seconds.tolist(), poses.xyz.tolist(), poses.xyzw.tolist(), strict=True)
    lines = [f"{BEGIN + at:.3f} {' '.join(f'{part:.4f}' for part in xyz)} {' '.join(f'{part:.7f}' for part in q)}\n" for at, xyz, q in rows]
    (FOLDER / name).write_text("# t x y z qx qy qz qw\n" + "".join(lines))


def main() -> None:
    """Write all of them."""
    draw = np.random.default_rng(7)
    at = np.arange(0, SECONDS, 0.05)
    write_tum("truth.tum", at, truth(at))

    at = np.arange(0.02, SECONDS - 0.3, 0.1)
    poses = truth(at)
    steps = poses[:-1].relative(poses[1:])
    turned = Rotation.from_rotvec(draw.normal((0, 0, 2e-4), 6e-4, (len(steps), 3)))
    steps = Transform(steps.rotation @ turned, steps.xyz * 1.008 + draw.normal(0, 0.002, (len(steps), 3)))
    found = [Transform.identity()]
    for step in steps:
        found.append(found[-1] @ step)
    write_tum("odometry.tum", at - 0.3, Transform.from_arrays(np.array([each.xyz for each in found]), np.array([each.xyzw for each in found])))

    at = np.arange(0.1, SECONDS, 0.25)
    poses = truth(at)
    world = Rotation.from_rpy([0.4, -0.3, 2.0])
    noisy = poses.xyz + draw.normal(0, 0.05, poses.xyz.shape)
    write_tum("mono.tum", at, Transform(world @ poses.rotation @ Rotation.from_rotvec(draw.normal(0, 3e-3, noisy.shape)), 0.4 * world.apply(noisy) + [1.0, 2.0, 0.5]))

    at = np.arange(0.3, SECONDS - 0.2, 0.5)
    places = truth(at).apply(np.broadcast_to(ARM, (len(at), 3))) + draw.normal(0, 0.02, (len(at), 3))
    rows = [f"{BEGIN + each:.3f},{x:.3f},{y:.3f},{z:.3f}\n" for each, (x, y, z) in zip(at.tolist(), places.tolist(), strict=True)]
    (FOLDER / "antenna.csv").write_text("t,x,y,z\n" + "".join(rows))


if __name__ == "__main__":
    main()
