"""Every line that a derivation prints recomputes from the numbers printed in it, at any number of digits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from console import ROOT
from recheck import recheck
from written import ALL, HOSTILE, ROTATIONS, SPECS, pose, record, rotation, seeded

import frametool
from frametool import TransformBuffer, explain
from frametool.explain.derive import BLOCKS
from frametool.geometry.representations import ROTATIONS as TABLE

if TYPE_CHECKING:
    from random import Random

DIGITS = (4, 6, None)


@pytest.mark.parametrize("spec", SPECS)
def test_each_line_of_a_conversion_recomputes(spec: str) -> None:
    random = seeded(spec)
    for xyzw in (random.choice(HOSTILE), random.choice(ALL)):
        written = rotation(spec, xyzw)
        for digits in DIGITS:
            sheet = explain("convert", written, to=",".join(random.sample(SPECS, 2)), precision=digits)
            assert recheck(str(sheet), digits) > 0


def moving_tree(random: Random) -> tuple[TransformBuffer, list[str]]:
    """Build a random tree in which some edges move."""
    frames, buffer = [f"f{number}" for number in range(random.randint(2, 8))], TransformBuffer()
    for number, child in enumerate(frames[1:], 1):
        parent = frames[random.randrange(number)]
        stamps = [700_000_000 * step + random.randrange(1000) for step in range(4)] if random.random() < 0.5 else [None]
        for stamp in stamps:
            made = frametool.Transform(frametool.Rotation(random.choice([*ROTATIONS, *HOSTILE])), [random.uniform(-9, 9) for _ in "xyz"])
            buffer.insert(parent, child, made, stamp)
    return buffer, frames


def operands(operation: str, random: Random) -> tuple[list[Any], dict[str, Any]]:
    """Draw the operands of an operation."""
    if operation == "compose":
        return [pose(random) for _ in range(random.randint(1, 6))], {}
    if operation in ("invert", "relative"):
        return [pose(random) for _ in range(1 + (operation == "relative"))], {}
    if operation == "interpolate":
        return [pose(random), pose(random), random.choice((0, 1, 0.5, random.uniform(-1, 2)))], {}
    tree, frames = moving_tree(random)
    at = {"at_ns": random.choice((None, random.randint(1000, 2_000_000_000)))}
    if operation == "apply":
        way = random.choice(([pose(random)], [tree, random.choice(frames), random.choice(frames)]))
        return [*way, record(random)], at if len(way) > 1 else {}
    if operation == "lookup across":
        at |= {"source_at_ns": random.randint(1000, 2_000_000_000), "fixed": random.choice(frames)}  # type: ignore[dict-item]
    return [tree, random.choice(frames), random.choice(frames)], at


@pytest.mark.parametrize("digits", DIGITS)
@pytest.mark.parametrize("operation", ["compose", "invert", "relative", "interpolate", "lookup", "lookup across", "apply"])
def test_each_line_of_an_operation_recomputes(operation: str, digits: int | None) -> None:
    random = seeded(f"{operation}{digits}")
    for _ in range(6):
        given, options = operands(operation, random)
        to = ",".join(random.sample(("quaternion", "rpy_deg", "matrix", "axis_angle", "euler:rzxz"), 2))
        sheet = explain(operation.split(maxsplit=1)[0], *given, to=to, precision=digits, **options)
        recheck(str(sheet), digits)


@pytest.mark.parametrize("digits", DIGITS)
@pytest.mark.parametrize("target", ["leader", "carrot", "moving-carrot"])
@pytest.mark.parametrize("delay", [0.0, 1.05])
def test_each_line_of_a_step_of_a_follower_recomputes(target: str, delay: float, digits: int | None) -> None:
    law = frametool.FollowController(rate=7.0, max_linear=1.0, max_angular=2.0)
    scene = frametool.tutorial(leader="figure8", law=law, target=target, delay=delay, followers=2)
    for number in (8, 9, 40):
        assert recheck(str(explain("follow", frametool.follow_steps(scene, number), precision=digits)), digits) > 8


def test_every_representation_has_a_block_each_way() -> None:
    assert list(BLOCKS) == list(TABLE)


def test_the_checker_finds_a_wrong_digit() -> None:
    sheet = str(explain("convert", {"rpy_deg": [10, 20, 30]}))
    with pytest.raises(AssertionError):
        recheck(sheet.replace("= 0.0381346", "= 0.0381356"), 6)
    with pytest.raises(AssertionError):
        recheck(sheet.replace("0.984808·0.965926", "0.984818·0.965926"), 6)


@pytest.mark.parametrize("line", ["truth.tum odometry.tum", "truth.tum mono.tum --align sim3 --delta 10m,5deg,1s", "antenna.csv truth.tum"])
def test_each_line_of_a_comparison_recomputes(line: str) -> None:
    files = {name: (ROOT / "examples" / name).read_bytes() for name in ("truth.tum", "odometry.tum", "mono.tum", "antenna.csv")}
    found = frametool.run(f"compare {line} --explain", files=files)
    assert (found.status, recheck(found.out.decode(), 9) > 1) == (0, True)
