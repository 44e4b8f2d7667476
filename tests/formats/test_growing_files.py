"""Files of any size cost work in proportion to it, in every form of trees and robots, whether good or bad."""

from __future__ import annotations

import sys
from contextlib import closing
from typing import TYPE_CHECKING, Any

import pytest

from frametool.documents.source import InputFile
from frametool.formats.load import FrameFile
from frametool.formats.rows.clouds import read_head
from frametool.grammar.edges import Answers

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

ROWS = "[[1,0,0,{at}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"
MATRIX = "{{rows: 4, cols: 4, dt: d, data: [1,0,0,{at},0,1,0,0,0,0,1,0,0,0,0,1]}}"
HEAD = "%YAML:1.0\n---\n"
CALL = '<node pkg="tf2_ros" exec="static_transform_publisher" {more}args="1 0 0 0 0 0 a b{at}"/>\n'
# form, what stands before the entries, an entry, what stands behind them
FILES = {
    "camchain": ("camchain", "", f"cam{{at}}:\n  T_cam_imu: {ROWS}\n  resolution: [1, 2]\n", ""),
    "camchain, said twice": ("camchain", "", f"cam{{at}}:\n  T_cam_imu: {ROWS}\n  T_imu_cam: [[1,0,0,-{{at}}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n", ""),
    "camchain, a chain": ("camchain", "cam0: {}\n", f"cam{{next}}:\n  T_cn_cnm1: {ROWS}\n", ""),
    "camchain of okvis": ("camchain", "cameras:\n", f"  - T_SC: {ROWS}\n", ""),
    "opencv": ("opencv", HEAD, f"body_T_c{{at}}: !!opencv-matrix {MATRIX}\n", ""),
    "opencv, a chain": ("opencv", HEAD, f"c{{at}}_T_c{{next}}: !!opencv-matrix {MATRIX}\n", ""),
    "opencv, a chain said twice": ("opencv", HEAD, f"c{{at}}_T_c{{next}}: {MATRIX}\nT_c{{at}}_c{{next}}: {MATRIX}\n", ""),
    "opencv, pairs": ("opencv", HEAD, "rvec{at}: [0, 0, 0]\ntvec{at}: [0, 0, {at}]\n", ""),
    "opencv, frames by keys": ("opencv", HEAD + "trans_matrix:\n", f"  - {{{{parent_frame: c{{at}}, child_frame: c{{next}}, matrix: {MATRIX}}}}}\n", ""),
    "opencv, XML": ("opencv", "<opencv_storage>", '<b_T_c{at} type_id="opencv-matrix"><rows>4</rows><cols>4</cols><dt>d</dt><data>1 0 0 {at} 0 1 0 0 0 0 1 0 0 0 0 1</data></b_T_c{at}>\n', "</opencv_storage>"),
    "dh, lines": ("dh", "theta,d,a,alpha\n", "q{at},{at},0,0\n", ""),
    "dh, documents": ("dh", "", "- {{theta: q{at}, d: {at}, a: 0, alpha: 0}}\n", ""),
    "autoware": ("autoware", "base:\n", "  c{at}: {{x: {at}, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}}\n", ""),
    "autoware, all bad": ("autoware", "base:\n", "  c{at}: {{x: {at}q, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}}\n", ""),
    "autoware, all odd": ("autoware", "base:\n", "  /c{at}: {{x: 1, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}}\n", ""),
    "nuscenes, all bad": ("nuscenes", "[", '{{"token": "a{at}", "timestamp": {at}, "rotation": [1, 0], "translation": [1, 2, 3]}},\n', '{"token": "b", "timestamp": 1, "rotation": [1, 0, 0, 0], "translation": [1, 2, 3]}]'),
    "launch": ("launch", "<launch>\n", CALL.replace("{more}", ""), "</launch>"),
    "launch, conditions": ("launch", "<launch>\n", CALL.replace("{more}", 'if="$(var a)" '), "</launch>"),
    "calls": ("calls", "", "1 0 0 0 0 0 a b{at}\n", ""),
    "calls, all bad": ("calls", "", "1 0 0 0 0 x a b{at}\n", ""),
    "urdf, a chain": ("urdf", '<robot name="r"><link name="l0"/>', '<link name="l{next}"/><joint name="j{at}" type="revolute"><parent link="l{at}"/><child link="l{next}"/><limit lower="-1" upper="1"/></joint>\n', "</robot>"),
    "sdf, a chain": ("sdf", '<sdf version="1.9"><model name="m"><link name="l0"/>', '<link name="l{next}"><pose relative_to="l{at}">1 0 0 0 0 0</pose></link>\n', "</model></sdf>"),
    "mjcf": ("mjcf", "<mujoco><worldbody>", '<body name="b{at}" pos="1 0 0"><joint name="j{at}"/></body>\n', "</worldbody></mujoco>"),
}  # fmt: skip


def calls_of(work: Callable[[], Any]) -> int:
    """Count the calls that some work makes, which no other program on the machine changes."""
    count = 0

    def note(*_: Any) -> None:
        nonlocal count
        count += 1

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize("name", FILES)
def test_a_file_costs_work_in_proportion_to_its_size(name: str, tmp_path: Path) -> None:
    form, before, entry, behind = FILES[name]
    work, answers = [], Answers(dh="standard", direction="parent-from-child")
    for count in (10, 100, 200, 400):  # the first time, modules and patterns are made
        text = before + "".join(entry.format(at=at, next=at + 1) for at in range(count)) + behind
        path = tmp_path / str(count)
        path.write_text(text)
        faults: list[Any] = []

        def read(path: Path = path, faults: list[Any] = faults) -> None:
            assert list(FrameFile(path, fmt=form, answers=answers).edges(faults.append, tell=False)) or faults

        work.append(calls_of(read))
        assert len(faults) == (count if "bad" in name else 0)
    assert work[3] - work[2] < 2.3 * (work[2] - work[1])


@pytest.mark.parametrize("entry", ["element e{} 1\nproperty float a\n", "property float a{}\n"])
def test_the_head_of_a_cloud_costs_work_in_proportion_to_its_size(entry: str, tmp_path: Path) -> None:
    work = []
    for count in (10, 1000, 2000):
        path = tmp_path / "a.ply"
        path.write_text("ply\nformat ascii 1.0\nelement vertex 1\n" + "".join(map(entry.format, range(count))) + "end_header\n")
        with closing(InputFile(path)) as file:
            work.append(calls_of(lambda file=file: read_head(file)))  # type: ignore[misc]
    assert work[2] < 2.3 * work[1]
