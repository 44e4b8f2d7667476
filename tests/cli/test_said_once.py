"""Errors quote little of the input and say the same thing once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

PROSE = "hello world " * 20000
ENDLESS = '{"xyz": "' + "x" * 100000 + '"}'
MANY_KEYS = "{" + ", ".join(f'"k{index}": {index}' for index in range(3000)) + "}"
TYPOS = "{xyz: [0, 0, 1], " + ", ".join(f"rpyy{index}: 1" for index in range(67)) + "}"
FRAMES = "frames:\n" + "".join(f"  - {{name: f{index}, parent: base, rol: 1}}\n" for index in range(67))


@pytest.mark.parametrize("text", [PROSE, ENDLESS, MANY_KEYS, TYPOS, "[" + "1, " * 20000 + "1]"])
@pytest.mark.parametrize(
    "arguments",
    [
        ["convert", "f"], ["convert", "-i", "f"], ["compose", "f", "f"], ["invert", "f"], ["tree", "f"],
        ["apply", "--transform", "f", "1", "2", "3"], ["apply", "--transform", "{}", "-i", "f"],
        ["lookup", "f", "a", "b"], ["relative", "f", "{}"],
    ],
)  # fmt: skip
def test_no_file_is_poured_into_an_error(run: Run, text: str, arguments: list[str]) -> None:
    outcome = run(*arguments, files={"f": text})
    assert outcome.status != 0
    assert len(outcome.err) < 1200


@pytest.mark.parametrize("text", [PROSE, ENDLESS, MANY_KEYS])
def test_no_argument_is_poured_into_an_error(run: Run, text: str) -> None:
    assert len(run("convert", text).err) < 1200
    assert len(run("apply", "--transform", text, "1", "2", "3").err) < 1200


def test_findings_in_the_same_words_are_one_line_with_their_count(run: Run) -> None:
    outcome = run("check", "f.yaml", files={"f.yaml": FRAMES})
    assert len(outcome.out.splitlines()) == 1
    assert "(and 66 more: lines 3, 4, 5, 6, 7, ..)" in outcome.out
    assert "67 errors" in outcome.err


def test_findings_for_machines_stay_one_each(run: Run) -> None:
    for form in ("json", "github"):
        assert len(run("check", "f.yaml", "-f", form, files={"f.yaml": FRAMES}).out.splitlines()) == 67


def test_warnings_about_many_poses_are_told_once_and_counted(run: Run) -> None:
    poses = "".join(f"{{xyz: [0, 0, {at}], xyzw: [0, 0, 0.7068, 0.7071]}}\n---\n" for at in range(67))
    outcome = run("convert", "f.yaml", "-f", "json", files={"f.yaml": poses})
    assert outcome.status == 0
    what = "quaternion 0 0 0.7068 0.7071 has norm 0.999778 and was normalised"
    assert outcome.err == f"frametool: warning: f.yaml:1:25: {what} (66 more like it)\n"


ENTRIES = {
    "yaml": "frames:\n" + "".join(f"- {{name: /f{at}, parent: map, xyz: [1, 2, 3]}}\n" for at in range(12)),
    "txt": "---\n".join(
        f"transforms:\n- header: {{frame_id: map}}\n  child_frame_id: /f{at}\n  transform:\n    translation: {{x: 0, y: 0, z: 0}}\n"
        "    rotation: {x: 0, y: 0, z: 0, w: 1}\n" for at in range(12)
    ),
    "urdf": '<robot name="r"><link name="map"/>' + "".join(
        f'<link name="/f{at}"/><joint name="j{at}" type="fixed"><parent link="map"/><child link="/f{at}"/></joint>' for at in range(12)
    ) + "</robot>",
}  # fmt: skip


@pytest.mark.parametrize("suffix", ENTRIES)
def test_a_note_that_differs_in_names_alone_is_one_line_with_its_count(run: Run, suffix: str) -> None:
    done = run("tree", f"a.{suffix}", files={f"a.{suffix}": ENTRIES[suffix]})
    (line,) = (line for line in done.err.splitlines() if "warning" in line)
    assert line.endswith("frame '/f0': the leading / is no part of a name and was left out (11 more like it)")


def test_the_first_pose_has_no_velocity_which_is_told(run: Run) -> None:
    rows = "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,1,0,0,0,0,0,1\n"
    done = run("relative", "--consecutive", "--velocity", stdin=rows)
    assert done.out.count("\n") == 2
    assert done.err == "frametool: note: the first pose has none before it, so no velocity: it is left out, results begin at the second\n"
    assert run("relative", "--consecutive", "--velocity", "--quiet", stdin=rows).err == ""


@pytest.mark.parametrize(("entry", "column"), [("{xyz: [1, 2, 3], ropy: [0, 0, 0]}", 29), ('{"xyz": [1, 2, 3], "rpy": {"ro": 0}}', 39)])
def test_tree_and_check_name_one_place_for_a_misspelt_key(run: Run, entry: str, column: int) -> None:
    files = {"t.yaml": f"frames:\n  base:\n    lidar: {entry}\n"}
    raised, found = run("tree", "t.yaml", files=files).err, run("check", "t.yaml").out
    assert raised.split()[1] == found.split()[0] == f"t.yaml:3:{column}:"


@pytest.mark.parametrize("command", [["solve"], ["tree"], ["compare", "m.csv"], ["invert", "--in", "csv", "-i"]])
def test_no_option_is_advised_that_the_command_lacks(run: Run, command: list[str]) -> None:
    said = run(*command, "m.csv", files={"m.csv": "1,2,3\n4,5,6\n"}).err
    assert said == "frametool: m.csv:1: the first line holds numbers and no names" + "; give --no-header" * (command[0] == "invert") + "\n"
