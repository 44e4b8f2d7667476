"""Make the example of `project`: a rig, the picture that its camera takes of a made-up yard, and a lidar's cloud of it.

    python tests/make_camera_example.py

Each pixel is coloured by what its ray meets, each point of the cloud is where a ray of the lidar meets the same yard:
that points lie in the picture on what they belong to follows from nothing but camera and tree.
"""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

import frametool
from frametool.formats.cameras import load_camera

FOLDER = Path(__file__).parent.parent / "examples"
RIG = """\
# A rig on a slope: a lidar, and a camera below it that looks ahead, rolled by 8 degrees and pitched down by 12.
frames:
  map:
    base_link: {xyz: [0, 0, 0], rpy_deg: [0, 0, 0]}
  base_link:
    lidar: {xyz: [0, 0, 1.6], rpy_deg: [0, 0, 2]}
    cam_front:
      xyz: [0.3, 0.1, 1.2]
      rpy_deg: [8, 12, 0]
      camera: {axes: flu, model: plumb_bob, K: [210, 210, 159.5, 119.5], D: [-0.28, 0.07, 0.0005, -0.0003], size: [320, 240]}
"""
SIZE = 320, 240
# centre, half sizes, colour: a kerb, a crate, a post, a wall
BOXES = [
    ((6.0, 1.6, 0.5), (0.5, 0.5, 0.5), (200, 80, 60)),
    ((8.0, -1.8, 0.9), (0.4, 0.8, 0.9), (70, 110, 190)),
    ((5.0, -0.6, 0.75), (0.06, 0.06, 0.75), (230, 200, 60)),
    ((12.0, 0.0, 1.5), (0.2, 5.0, 1.5), (150, 150, 155)),
]
NAMES = ("ground", "crate", "cabinet", "post", "wall")


def meet(origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far each ray goes, infinite into the sky, and what it meets: 0 the ground, then the boxes."""
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(rays[:, 2] < 0.0, -origin[2] / rays[:, 2], np.inf)
        what = np.zeros(len(rays), int)
        for number, (centre, half, _) in enumerate(BOXES, 1):
            first, second = ((np.array(centre) + sign * np.array(half) - origin) / rays for sign in (-1.0, 1.0))
            enter, leave = np.minimum(first, second).max(axis=1), np.maximum(first, second).min(axis=1)
            hit = (enter < leave) & (enter > 0.0) & (enter < far)
            far, what = np.where(hit, enter, far), np.where(hit, number, what)
    return far, what


def colours(points: np.ndarray, far: np.ndarray, what: np.ndarray) -> np.ndarray:
    """Return what pixels show: a chequered ground, boxes shaded by their side, the sky."""
    squares = (np.floor(points[:, 0]) + np.floor(points[:, 1])) % 2.0 == 0.0
    shown = np.where(squares[:, None], (112, 122, 104), (92, 100, 86)).astype(float)
    for number, (centre, half, colour) in enumerate(BOXES, 1):
        own = what == number
        side = np.abs((points[own] - centre) / half).argmax(axis=1)
        shown[own] = np.array(colour) * np.array([1.0, 0.75, 1.15])[side][:, None]
    shown[np.isinf(far)] = (178, 203, 224)
    found: np.ndarray = np.clip(shown, 0, 255).astype(np.uint8)
    return found


def png(pixels: np.ndarray) -> bytes:
    """Return the bytes of a PNG of pixels (h, w, 3)."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    head = width.to_bytes(4, "big") + height.to_bytes(4, "big") + b"\x08\x02\0\0\0"
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def main() -> None:
    """Write the three files."""
    rig = FOLDER / "cameras.yaml"
    rig.write_text(RIG, encoding="utf-8")
    tree = frametool.load(rig)
    camera = load_camera(rig, "cam_front")
    # 3 x 3 rays a pixel
    fine = (np.arange(3) - 1.0) / 3.0
    v, u = np.meshgrid(*(np.add.outer(np.arange(side), fine).ravel() for side in SIZE[::-1]), indexing="ij")
    place = tree.lookup("map", "cam_front")
    rays = place.apply_vector(camera.unproject(np.column_stack([u.ravel(), v.ravel()])))
    origin = place.xyz
    far, what = meet(origin, rays)
    points = origin + np.where(np.isinf(far), 0.0, far)[:, None] * rays
    shown = colours(points, far, what).reshape(SIZE[1], 3, SIZE[0], 3, 3).mean(axis=(1, 3))
    (FOLDER / "yard.png").write_bytes(png(shown.round().astype(np.uint8)))
    lidar = tree.lookup("map", "lidar")
    elevation, azimuth = np.meshgrid(np.radians(np.linspace(-24.0, 2.0, 14)), np.radians(np.arange(-75.0, 75.0, 1.5)))
    beams = np.column_stack([
        (np.cos(elevation) * np.cos(azimuth)).ravel(), (np.cos(elevation) * np.sin(azimuth)).ravel(), np.sin(elevation).ravel(),
    ])  # fmt: skip
    far, what = meet(lidar.xyz, lidar.apply_vector(beams))
    there = far < 20.0
    with open(FOLDER / "yard.csv", "w", encoding="utf-8") as file:
        file.write("x,y,z,thing\n")
        rows = zip(far[there, None] * beams[there], what[there], strict=True)
        file.writelines(f"{x:.3f},{y:.3f},{z:.3f},{NAMES[number]}\n" for (x, y, z), number in rows)


if __name__ == "__main__":
    main()
