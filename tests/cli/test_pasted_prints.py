"""What people paste is read as tools really printed it: golden/pasted_prints.json says which and where.

`prints` are the output of the tool and version named, run for poses known here: `plain`, `big` and `tiny` share a
rotation about all axes, `quarter` turns about z.  `copied` are from public pages, with the numbers that stand in them;
`written` follow manuals and turn a quarter about z.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "pasted_prints.json").read_text())
POSES = {name: np.array(rows) for name, rows in GOLDEN["poses"].items()}
PRINTS, COPIED, WRITTEN = ({each["from"]: each for each in GOLDEN[name]} for name in ("prints", "copied", "written"))
WAYS = ["argument", "file", "standard input"]

def printed(run: Run, way: str, text: str, *more: str) -> np.ndarray[Any, Any]:
    """Run `convert` on a text and return the pose that it prints, as a 4x4 matrix."""
    ways = {
        "argument": lambda: run("convert", text, *more, "-f", "json"),
        "file": lambda: run("convert", "pasted.txt", *more, "-f", "json", files={"pasted.txt": text}),
        "standard input": lambda: run("convert", *more, "-f", "json", stdin=text),
    }
    outcome = ways[way]()
    assert outcome.status == 0, outcome.err
    (line,) = outcome.out.splitlines()
    entry = json.loads(line)
    pose = np.eye(4)
    if "quaternion" in entry:
        pose[:3, :3] = Rotation.from_quat([entry["quaternion"][name] for name in "xyzw"]).as_matrix()
        pose[:3, 3] = entry.get("xyz", [0, 0, 0])
    else:  # a stream keeps the spelling of its records
        rows = np.array(entry["matrix"] if isinstance(entry, dict) else entry)
        pose[: len(rows), : len(rows)] = rows
    return pose


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", PRINTS)
def test_what_a_tool_printed_is_the_pose_that_it_held(run: Run, way: str, name: str) -> None:
    each = PRINTS[name]
    told = ["--from", each["told"]] if "told" in each else []
    got = printed(run, way, "\n".join(each["text"]), *told)
    wanted = POSES[each["pose"]]
    assert got[:3, :3] == pytest.approx(wanted[:3, :3], abs=2e-3)  # three decimals are the fewest
    position = [0, 0, 0] if "turn_only" in each else wanted[:3, 3]
    assert got[:3, 3] == pytest.approx(position, rel=5e-4, abs=1e-9)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", COPIED)
def test_what_people_copied_into_public_pages_is_read(run: Run, way: str, name: str) -> None:
    each = COPIED[name]
    got = printed(run, way, "\n".join(each["text"]))
    assert got[:3, 3].tolist() == each["xyz"]
    assert got[:3, :3] == pytest.approx(Rotation.from_quat(each["xyzw"]).as_matrix(), abs=1e-9)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", WRITTEN)
def test_what_manuals_show_is_read(run: Run, way: str, name: str) -> None:
    got = printed(run, way, "\n".join(WRITTEN[name]["text"]))
    assert got[:3, :3] == pytest.approx(POSES["quarter"][:3, :3], abs=1e-12)
    assert not got[:3, 3].any()


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("Quaternion(0.7071, 0.0, 0.0, 0.7071)", "{xyzw: [..]} or {wxyz: [..]}, or give --from"),  # pyquaternion, Unity
        ("Quaternion((0.7071, 0.0, 0.0, 0.7071))", "or give --from"),  # Blender is w first; others are not
        ("UnitQuaternion(array([0.7071, 0.0, 0.0, 0.7071]))", "or give --from"),
        ("(0.00, 0.00, 0.71, 0.71)", "or give --from"),  # Unity
        ("mat3x3((0, 1, 0), (-1, 0, 0), (0, 0, 1))", "column by column"),  # glm::to_string
        ("c(0, 1, 0, -1, 0, 0, 0, 0, 1)", "column by column; write its rows"),
        ("structure(c(0, 1, 0, -1, 0, 0, 0, 0, 1), dim = c(3L, 3L))", "column by column; write its rows"),  # dput
        ("[[100, 200, 300], [0, 0, 0, 1]]", "two lists state neither unit nor order; write {xyz: [..], wxyz: [..]}"),  # ABB?
        ("- Pose [ XYZ (m) ] [ RPY (rad) ]:\n [1 2 3]\n [0 0 0]\n- Pose [ XYZ (m) ] [ RPY (rad) ]:\n [1 2 3]\n [0 0 0]", "-p"),
    ],
)
def test_a_print_that_leaves_its_meaning_open_is_refused_with_what_does_not(run: Run, text: str, remedy: str) -> None:
    for outcome in (run("convert", text), run("convert", "-", stdin=text)):
        assert outcome.status in (1, 2)
        assert outcome.out == ""
        assert remedy in outcome.err
        assert outcome.err.count("\n") == 1


@pytest.mark.parametrize(
    "text", ["Quaternion(0.6, 0.0, 0.0, 0.8)", "Quaternion((0.6, 0.0, 0.0, 0.8))", "UnitQuaternion(array([0.6, 0., 0., 0.8]))"]
)
def test_a_name_around_four_numbers_is_no_hindrance_where_their_order_is_said(run: Run, text: str) -> None:
    outcome = run("convert", "--from", "wxyz", text, "-f", "json")
    assert json.loads(outcome.out)["quaternion"] == {"x": 0.0, "y": 0.0, "z": 0.8, "w": 0.6}


@pytest.mark.parametrize(
    ("block", "found"),
    [
        ("- Translation: [0, x, 1]\n- Rotation: in Quaternion [0, 0, 0, 1]\n", "- Translation: [0, x, 1]"),
        ("- Translation: [0, 0, 1]\n- Rotation: in Quaternion [0, 0, 0, x]\n            in RPY (radian) [0.000, -0.000, 0.000]\n", "in Quaternion [0, 0, 0, x]"),
        ("- Translation: [0, 0, 1]\n- Rotation: in RPY (radian) [0, 0, 90deg]\n", "in RPY (radian) [0, 0, 90deg]"),
    ],
)  # fmt: skip
def test_a_damaged_part_of_a_block_is_refused_and_not_left_out(block: str, found: str, run: Callable[..., Any]) -> None:
    done = run("convert", "-i", "a", files={"a": "At time 1.5\n" + block})
    assert (done.status, done.out, done.err) == (1, "", f"frametool: a: expected a list of numbers, found '{found}'\n")
