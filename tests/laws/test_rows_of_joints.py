"""A robot stands the same whether its joints come one posture at a time or as rows."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from ways import Run

ARM = (Path(__file__).parents[2] / "examples" / "arm.urdf").read_text()
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_roll", "gripper")
RANDOM = Random(20)  # noqa: S311 - a test's
POSTURES = [[RANDOM.uniform(-1.0, 1.0) for _ in JOINTS[:4]] + [RANDOM.uniform(0.0, 0.03)] for _ in range(15)]
TIPS = ("tool", "left_finger", "right_finger")
Numbers = list[float]


def one_at_a_time(run: Run, posture: Numbers, tip: str) -> Numbers:
    joints = [word for name, value in zip(JOINTS, posture, strict=True) for word in ("-j", f"{name}={value!r}")]
    done = run("lookup", "arm.urdf", "arm_base", tip, *joints, "-f", "json", "--quiet", files={"arm.urdf": ARM})
    found = json.loads(done.out)
    return [*found["xyz"], *found["quaternion"].values()]


def as_rows(run: Run, postures: list[Numbers], tip: str, form: str) -> list[Numbers]:
    if form == "csv":
        text = ",".join(JOINTS) + "\n" + "".join(",".join(map(repr, posture)) + "\n" for posture in postures)
    else:
        text = "".join(json.dumps(dict(zip(JOINTS, posture, strict=True))) + "\n" for posture in postures)
    done = run("fk", "arm.urdf", "arm_base", tip, "--quiet", "-f", "json", stdin=text, files={"arm.urdf": ARM})
    found = [json.loads(row) for row in done.out.splitlines()]
    return [[*row["xyz"], *row["quaternion"].values()] for row in found]


@pytest.mark.parametrize("form", ["csv", "json"])
@pytest.mark.parametrize("tip", TIPS)
def test_rows_of_joints_have_the_bits_of_one_posture(run: Run, tip: str, form: str) -> None:
    wanted = [one_at_a_time(run, posture, tip) for posture in POSTURES]
    assert as_rows(run, POSTURES, tip, form) == wanted


@pytest.mark.parametrize("tip", TIPS)
def test_one_row_of_joints_has_the_bits_of_many(run: Run, tip: str) -> None:
    assert [as_rows(run, [posture], tip, "csv")[0] for posture in POSTURES] == as_rows(run, POSTURES, tip, "csv")
