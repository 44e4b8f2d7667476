"""Records that are no JSON are faults of their own; what depends on the row before keeps the order of the text."""

from __future__ import annotations

import json
import re

import pytest
from flow import MOVE, asked, convert, flow

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


def test_angles_of_records_go_on_beyond_half_a_turn() -> None:
    text = "".join(f'{{"rpy_deg":[0,0,{yaw}]}}\n' for yaw in (170, 190, 320, 90)).encode()
    result = flow(text, convert("rpy_deg")._replace(unwrap=True), "json")
    yaws = [json.loads(line)["rpy_deg"]["yaw"] for line in result.text.splitlines()]
    assert yaws == pytest.approx([170, 190, 320, 450])



@pytest.mark.parametrize("cut", ['{"k":1,"point":[1,', '{"k":[', '{"point":', '{"k":"x', '{"a":{"b":[[1,2],'])
@pytest.mark.parametrize("count", [1, 2, 60])
def test_a_cut_first_line_takes_no_other_with_it(cut: str, count: int) -> None:
    result = flow(f"{cut}\n{GOOD * count}".encode(), MOVE._replace(on_error="skip"), "json")
    assert result.text.count(b"[-1.0,3.0,6.0]") == count
    assert result.told[-1] == f"in: 1 of {count + 1} rows skipped"
