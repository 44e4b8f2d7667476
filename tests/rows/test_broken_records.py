"""Records that are no JSON are faults of their own; what depends on the row before keeps the order of the text."""

from __future__ import annotations

import copy
import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from flow import MOVE, asked, convert, flow

from frametool.documents.source import Verbatim
from frametool.documents.writers import dump_json

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

CONSECUTIVE = asked(of="previous")
GOOD = '{"point":[1,2,3]}\n'


@pytest.mark.parametrize("bad", ['{"point":[1,2,3],"k":}', '{"point":[1,2,3],"k"}', '{"point":[1,2,3],}', "{'x':1}"])
@pytest.mark.parametrize("count", [1, 80])
@pytest.mark.parametrize("on_error", ["stop", "skip", "null"])
def test_what_only_yaml_would_read_is_a_fault_of_its_line(bad: str, count: int, on_error: str) -> None:
    text = (GOOD * count + bad + "\n" + GOOD * count).encode()
    result = flow(text, MOVE._replace(on_error=on_error), "json")
    assert result.told[0].startswith(f"in:{count + 1}:")
    assert result.text.count(b"[-1.0,3.0,6.0]") == (count if on_error == "stop" else 2 * count)
    assert result.text.splitlines().count(b"null") == (on_error == "null")


@pytest.mark.parametrize("count", [1, 80])
def test_a_frame_that_is_wrong_is_found_at_its_own_place(count: int) -> None:
    bad = '{"point":[1,2,3],"parent":"a","frame":"b"}\n'
    result = flow((GOOD * count + bad).encode(), MOVE, "json")
    assert result.told == [f"in:{count + 1}:frame: frame says 'b' and parent says 'a'; keep one"]


def test_a_value_that_is_missing_is_no_error_in_yaml() -> None:
    assert flow(b'{"point":[1,2,3],"k":}\n', MOVE, "yaml").text == b'{"point":[-1.0,3.0,6.0],"k":}\n'


@pytest.mark.parametrize("count", [2, 60])
@pytest.mark.parametrize("form", ["json", "yaml"])
def test_consecutive_poses_follow_the_text_however_they_are_spelled(count: int, form: str) -> None:
    spelled = ('{{"xyz":[{0},0,0],"rpy_deg":[0,0,0]}}\n', '{{"translation":[{0},0,0],"k":1,"rpy_deg":[0,0,0]}}\n')
    records = [spelled[i % 2].format(i * i) for i in range(count)]
    result = flow(("" if form == "json" else "---\n").join(records).encode(), CONSECUTIVE, form)
    steps = [float(found) for found in re.findall(r'distance"?: ([\d.]+)', result.text.decode())]
    assert steps == [0.0, *(2.0 * i + 1.0 for i in range(count - 1))]


def test_a_pose_is_compared_with_one_before_that_has_another_covariance() -> None:
    exact, sure = '{"xyz":[1,0,0],"xyzw":[0,0,0,1]}\n', '{"xyz":[3,0,0],"xyzw":[0,0,0,1],"sigma":{"xyz":0.5}}\n'
    result = flow((exact + sure + exact + exact).encode(), CONSECUTIVE._replace(on_error="skip"), "json")
    lines = [json.loads(line) for line in result.text.splitlines()]
    assert [each["distance"] for each in lines] == [0.0, 2.0, 0.0]
    assert [each.get("covariance", [0.0])[0] for each in lines] == [0.0, 0.25, 0.0]
    assert result.told[0] == "in:3: what it is compared with has a covariance, which this one has not (row skipped)"


def test_angles_of_records_go_on_beyond_half_a_turn() -> None:
    text = "".join(f'{{"rpy_deg":[0,0,{yaw}]}}\n' for yaw in (170, 190, 320, 90)).encode()
    result = flow(text, convert("rpy_deg").with_results(unwrap=True), "json")
    yaws = [json.loads(line)["rpy_deg"]["yaw"] for line in result.text.splitlines()]
    assert yaws == pytest.approx([170, 190, 320, 450])



@pytest.mark.parametrize("cut", ['{"k":1,"point":[1,', '{"k":[', '{"point":', '{"k":"x', '{"a":{"b":[[1,2],'])
@pytest.mark.parametrize("count", [1, 2, 60])
def test_a_cut_first_line_takes_no_other_with_it(cut: str, count: int) -> None:
    result = flow(f"{cut}\n{GOOD * count}".encode(), MOVE._replace(on_error="skip"), "json")
    assert result.text.count(b"[-1.0,3.0,6.0]") == count
    assert result.told[-1] == f"in: 1 of {count + 1} rows skipped"


WHOLE: dict[str, Any] = {"header": {"frame_id": "a"}, "pose": {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}}
NOT_FINITE, NO_UNIT, NO_NUMBER, HALF = (copy.deepcopy(WHOLE) for _ in range(4))
NOT_FINITE["pose"]["position"]["z"] = Verbatim("1e999")
NO_UNIT["pose"]["orientation"]["z"] = 2
NO_NUMBER["pose"]["position"]["y"] = "q"
del HALF["pose"]["orientation"]["w"]
BLOCK = "header:\n  frame_id: a\npose:\n  position:\n    x: {x}\n    y: {y}\n    z: {z}\n  orientation: {q}\n"


def document(record: Any, form: str) -> str:
    """Write a record on a line of JSON, or as a document of YAML with a number a line."""
    position, orientation = record["pose"]["position"], record["pose"]["orientation"]
    return f"{dump_json(record)}\n" if form == "json" else f"{BLOCK.format(**position, q=dump_json(orientation))}---\n"


@pytest.mark.parametrize("form", ["json", "yaml"])
@pytest.mark.parametrize("repeated", [1, 100])
def test_a_bad_record_has_one_place_whatever_is_written(form: str, repeated: int, run: Callable[..., Any], tmp_path: Path) -> None:
    records = [*[WHOLE] * repeated, NOT_FINITE, *[WHOLE] * repeated, NO_UNIT, NO_NUMBER, WHOLE, HALF]
    (tmp_path / f"a.{form}").write_text("".join(document(each, form) for each in records))
    told = set()
    for sink in ("csv", "yaml", "json", "npy", "tum", "ros2"):
        done = run("apply", "--transform", "{name: a}", "-i", f"a.{form}", "-f", sink, "-o", f"out.{sink}", "--on-error", "skip", "--quiet")
        assert done.status == 3
        told.add(tuple(line for line in said_in(done.err) if "skipped" in line))
    (only,) = told
    assert [line.split(": ")[0].split(":")[2] for line in only[:4]] == ["pose.position.z", "pose.orientation", "pose.position.y", "pose.orientation"]


def said_in(err: str) -> list[str]:
    """Return the messages of errors, for machines or for people."""
    return [json.loads(line)["message"] if line[:1] == "{" else line.removeprefix("frametool: ") for line in err.splitlines()]


@pytest.mark.parametrize("lines", [['{"k":1,"point":[1,'], ['{"point":[1,2', '{"point":[3'], ['{"point":[1,2', '{"point":[3', GOOD.strip()]])
def test_cut_lines_are_skipped_one_by_one(lines: list[str]) -> None:
    result = flow("".join(f"{line}\n" for line in lines).encode(), MOVE._replace(on_error="skip"), "json")
    assert (result.status, result.text.count(b"point")) == (3, lines.count(GOOD.strip()))
    assert result.told[-1] == f"in: {len(lines) - lines.count(GOOD.strip())} of {len(lines)} rows skipped"


def test_a_value_over_several_lines_that_is_cut_ends_the_run() -> None:
    result = flow(b'{\n "point": [1, 2, 3]\n}\n{\n "point": [1,', MOVE._replace(on_error="skip"), "json")
    assert (result.status, result.text.count(b"point"), result.told) == (1, 1, ["in:4: not JSON: it is cut off"])
