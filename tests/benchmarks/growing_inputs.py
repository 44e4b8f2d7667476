"""Inputs of any size for bench_growth.py: one function a shape, the same text for the same size."""

from __future__ import annotations

import json
import random
from itertools import chain
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

NANO = 10**9
GOLDEN = 0.618033988749895
WALL = 2.0  # metres
JOINTS = 10


def wave(number: int, turn: float = GOLDEN) -> float:
    """Return a number between -WALL and WALL that looks like chance and is none."""
    return round(WALL * (2.0 * (number * turn % 1.0) - 1.0), 6)


def point(number: int) -> str:
    """Return three coordinates, comma-separated."""
    return f"{wave(number)}, {wave(number, 0.414213562)}, {wave(number, 0.732050808)}"


def pose_rows(size: int) -> Iterator[str]:
    """Yield a table of poses."""
    yield "t,x,y,z,roll_deg,pitch_deg,yaw_deg,note"
    yield from (f"{n / 100},{point(n).replace(' ', '')},{n % 90},{n % 45},{n % 180},row {n}" for n in range(size))


def pair_rows(size: int) -> Iterator[str]:
    """Yield a table of two poses a row."""
    names = [f"{of}_{part}" for of in "ab" for part in ("x", "y", "z", "yaw_deg")]
    yield ",".join(names)
    yield from (f"{point(n)},{n % 90},{point(n + 7)},{n % 45}".replace(" ", "") for n in range(size))


def wide_table(size: int) -> Iterator[str]:
    """Yield a short table of many columns, the pose in the middle of them."""
    half = size // 2
    names = [*(f"left_{n}" for n in range(half)), "x", "y", "z", "yaw_deg", *(f"right_{n}" for n in range(half))]
    yield ",".join(names)
    yield from (",".join(str((row + n) % 97) for n in range(len(names))) for row in range(20))


def tum_rows(size: int) -> Iterator[str]:
    """Yield a trajectory in TUM's form."""
    yield from (f"{n / 100:.2f} {point(n).replace(',', '')} 0 0 0.6 0.8" for n in range(size))


def json_poses(size: int) -> Iterator[str]:
    """Yield a pose a line as JSON."""
    yield from (f'{{"id": {n}, "xyz": [{point(n)}], "rpy_deg": [{n % 90}, 0, {n % 180}]}}' for n in range(size))


def json_wide(size: int) -> Iterator[str]:
    """Yield few JSON records of many keys."""
    others = {f"key_{n}": n % 97 for n in range(size)}
    yield from (json.dumps({**others, "xyz": [row, 0, 1], "rpy_deg": [0, 0, row]}) for row in range(20))


def yaml_wide(size: int) -> Iterator[str]:
    """Yield few YAML documents of many keys."""
    for row in range(3):
        yield f"xyz: [{row}, 0, 1]"
        yield from (f"key_{n}: {n % 97}" for n in range(size))
        yield "---"


def yaml_poses(size: int) -> Iterator[str]:
    """Yield a pose a document as YAML."""
    yield from (f"xyz: [{point(n)}]\nrpy_deg: [{n % 90}, 0, {n % 180}]\n---" for n in range(size))


def times(size: int) -> Iterator[str]:
    """Yield times within those of the recordings."""
    yield from (f"1.{n % 999 + 1:06d}" for n in range(size))


def points(size: int) -> Iterator[str]:
    """Yield a table of points, each with its time."""
    yield "t,x,y,z"
    yield from (f"1.{n % 999 + 1:06d},{point(n)}".replace(" ", "") for n in range(size))


def entry(child: int, parent: str) -> str:
    """Return one frame of a list."""
    return f"  - {{name: f{child}, parent: {parent}, xyz: [{point(child)}], rpy_deg: [0, {child % 45}, {child % 90}]}}"


def frames(size: int) -> Iterator[str]:
    """Yield a bushy tree as a list, children before and behind their parents."""
    draw = random.Random(1)  # noqa: S311 - not for secrets
    order = list(range(1, size))
    draw.shuffle(order)
    yield "frames:"
    yield entry(0, "world")
    yield from (entry(child, f"f{(child - 1) // 8}") for child in order)


def other_frames(size: int) -> Iterator[str]:
    """Yield nearly the same tree, every tenth frame moved."""
    for number, line in enumerate(frames(size)):
        yield line.replace("rpy_deg: [0", "rpy_deg: [1") if number % 10 == 7 else line


def json_frames(size: int) -> Iterator[str]:
    """Yield the tree as JSON."""
    entries = ({"name": f"f{n}", "parent": f"f{(n - 1) // 8}" if n else "world", "xyz": [n, 0, 1]} for n in range(size))
    yield json.dumps({"frames": list(entries)})


def nested_frames(size: int) -> Iterator[str]:
    """Yield a tree in the nested form: branches of ten frames under one root."""
    yield "frames:\n  world:"
    for first in range(0, size, 10):
        yield f"    f{first}:\n      xyz: [{point(first)}]\n      children:"
        yield from (f"        f{n}: {{xyz: [{point(n)}], rpy_deg: [0, 0, {n % 90}]}}" for n in range(first + 1, first + 10))


def ros_frames(size: int) -> Iterator[str]:
    """Yield a tree as one ROS message."""
    yield "transforms:"
    for n in range(size):
        yield ros_transform(f"f{(n - 1) // 8}" if n else "world", f"f{n}", 0, n)


def ros_transform(parent: str, child: str, stamp_ns: int, number: int) -> str:
    """Return a TransformStamped as `ros2 topic echo` prints it."""
    x, y, z = point(number).split(", ")
    return (
        f"- header:\n    stamp:\n      sec: {stamp_ns // NANO}\n      nanosec: {stamp_ns % NANO}\n"
        f"    frame_id: {parent}\n  child_frame_id: {child}\n  transform:\n    translation:\n"
        f"      x: {x}\n      y: {y}\n      z: {z}\n"
        "    rotation:\n      x: 0.0\n      y: 0.0\n      z: 0.6\n      w: 0.8"
    )


def json_ros_frames(size: int) -> Iterator[str]:
    """Yield a tree as one ROS message in JSON."""
    yield json.dumps({
        "transforms": [
            {
                "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": f"f{(n - 1) // 8}" if n else "world"},
                "child_frame_id": f"f{n}",
                "transform": {"translation": {"x": n, "y": 0, "z": 1}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}},
            }
            for n in range(size)
        ]
    })


def chained(size: int) -> Iterator[str]:
    """Yield one chain of frames."""
    yield "frames:"
    yield from (entry(n, f"f{n - 1}" if n else "world") for n in range(size))


def late(size: int) -> list[int]:
    """Return the numbers below a size in a random order."""
    order = list(range(size))
    random.Random(2).shuffle(order)  # noqa: S311 - not for secrets
    return order


def samples(order: Iterable[int]) -> Iterator[str]:
    """Yield a frame that moves, a sample each microsecond, in some order."""
    yield "frames:\n  - name: base\n    parent: map\n    samples:"
    yield from (f"      - {{stamp: {1.0 + n / 1_000_000:.6f}, xyz: [{point(n)}]}}" for n in order)
    yield "  - {name: tool, parent: base, xyz: [0, 0, 1]}"


def ros_samples(order: Iterable[int]) -> Iterator[str]:
    """Yield a recording of two frames, a message each, in some order."""
    for n in order:
        yield "transforms:"
        yield ros_transform("map" if n % 2 else "base", "base" if n % 2 else "tool", NANO + 1000 * (n // 2 + 1), n)
        yield "---"


def moving_frames(size: int) -> Iterator[str]:
    """Yield frames that move, four samples each."""
    yield "frames:"
    for child in range(size):
        yield f"  - name: f{child}\n    parent: {f'f{(child - 1) // 8}' if child else 'world'}\n    samples:"
        yield from (f"      - {{stamp: {stamp}, xyz: [{point(child + stamp)}]}}" for stamp in range(4))


def reparented(size: int) -> Iterator[str]:
    """Yield a frame that changes its parent with each sample."""
    yield "frames:\n  - {name: left, parent: map, xyz: [0, 1, 0]}\n  - {name: right, parent: map, xyz: [0, -1, 0]}"
    yield "  - name: base\n    parent: left\n    samples:"
    for n in range(size):
        side = "left" if n % 2 else "right"
        yield f"      - {{stamp: {n / 1000}, parent: {side}, xyz: [{point(n)}]}}"


def urdf(size: int) -> Iterator[str]:
    """Yield a robot of one long arm, with ten joints that move."""
    yield '<robot name="snake"><link name="l0"/>'
    for n in range(1, size + 1):
        moves = n * JOINTS // size > (n - 1) * JOINTS // size
        name, kind = (f"joint{n * JOINTS // size}", "revolute") if moves else (f"j{n}", "fixed")
        yield (
            f'<link name="l{n}"/><joint name="{name}" type="{kind}"><parent link="l{n - 1}"/><child link="l{n}"/>'
            '<origin xyz="0 0 0.1" rpy="0 0 0.1"/><axis xyz="0 1 0"/><limit lower="-4" upper="4"/></joint>'
        )
    yield "</robot>"


def joint_rows(size: int) -> Iterator[str]:
    """Yield a table of the values of its joints."""
    yield "t," + ",".join(f"joint{n + 1}" for n in range(JOINTS))
    yield from (",".join(str((row + n) % 300 / 100.0) for n in range(JOINTS + 1)) for row in range(size))


def turtles(size: int) -> Iterator[str]:
    """Yield a scene of turtles, each behind the one before."""
    yield "duration: 5\nturtles:\n  turtle1: {leader: square}"
    yield from (f"  turtle{n}: {{spawn: [{n % 11}, {n % 7}, 0], follow: turtle{n - 1}}}" for n in range(2, size + 2))



INPUTS: dict[str, Callable[[int], Iterable[str]]] = {
    "poses.csv": pose_rows,
    "pairs.csv": pair_rows,
    "wide.csv": wide_table,
    "walk.tum": tum_rows,
    "poses.jsonl": json_poses,
    "wide.jsonl": json_wide,
    "wide.yaml": yaml_wide,
    "poses.yaml": yaml_poses,
    "times.txt": times,
    "points.csv": points,
    "frames.yaml": frames,
    "other.yaml": other_frames,
    "frames.json": json_frames,
    "nested.yaml": nested_frames,
    "ros.yaml": ros_frames,
    "ros.json": json_ros_frames,
    "chain.yaml": chained,
    "samples.yaml": lambda size: samples(range(size)),
    "reversed.yaml": lambda size: samples(range(size - 1, -1, -1)),
    "late.yaml": lambda size: samples(late(size)),
    "dump.yaml": lambda size: ros_samples(range(size)),
    "late_dump.yaml": lambda size: ros_samples(late(size)),
    "twice.yaml": lambda size: ros_samples(chain(range(size), range(size))),
    "moving.yaml": moving_frames,
    "reparented.yaml": reparented,
    "snake.urdf": urdf,
    "joints.csv": joint_rows,
    "turtles.yaml": turtles,
}
