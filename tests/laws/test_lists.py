"""Many poses in one document: each is written once, and they cost time in proportion to their number."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from kinds import HEADER, KINDS, LISTS, POSE, Q
from ways import document, line

if TYPE_CHECKING:
    from collections.abc import Callable

    from ways import Run

MAP_FROM_BASE = "{name: base, parent: map, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
MOVE = ("apply", "--transform", MAP_FROM_BASE)
TEXTS: dict[str, tuple[Callable[[Any], str], Callable[[str], Any]]] = {
    "json": (line, json.loads),
    "yaml": (document, lambda text: yaml.load(text, yaml.CSafeLoader)),
}


@pytest.mark.parametrize("rows", [1, 20])
@pytest.mark.parametrize("form", TEXTS)
@pytest.mark.parametrize("kind", LISTS)
def test_a_list_of_poses_is_moved_in_its_place_and_an_argument_is_a_pose_each(run: Run, kind: str, form: str, rows: int) -> None:
    write, read = TEXTS[form]
    parting = "---\n" if form == "yaml" else ""
    record = KINDS[kind].record
    streamed = run(*MOVE, stdin=parting.join([write(record)] * rows))
    wanted = [json.loads(row) for row in run(*MOVE, "-f", "json", json.dumps(record)).out.splitlines()]
    found = [read(text) for text in (streamed.out.split("---\n") if parting else streamed.out.splitlines())]
    assert all(each["header"]["frame_id"] == "map" for each in found)
    poses = [each.get("pose", each) for message in found for each in message["poses"]]
    assert [[*pose["position"].values(), *pose["orientation"].values()] for pose in poses] == [
        [*pose["xyz"], *pose["quaternion"].values()] for pose in wanted
    ] * rows


@pytest.mark.parametrize(("operation", "frame"), [("convert", "base"), ("invert", "")])
@pytest.mark.parametrize("form", TEXTS)
@pytest.mark.parametrize("kind", LISTS)
def test_a_list_of_poses_reads_back_from_what_is_written(run: Run, kind: str, form: str, operation: str, frame: str) -> None:
    write, read = TEXTS[form]
    found = read(run(operation, stdin=write(KINDS[kind].record)).out)
    assert found["header"] == {**HEADER, "frame_id": frame}
    assert len(found["poses"]) == 2


ALIASED = {
    "twist": "header: {frame_id: base}\ntwist:\n  linear: &three {x: 1, y: 2, z: 3}\n  angular: *three\n",
    "Path": "header: &head {frame_id: base}\nposes:\n- header: *head\n  pose: {position: {x: 1, y: 2, z: 3}, orientation: {x: 0, y: 0, z: 0, w: 1}}\n",
}


@pytest.mark.parametrize("kind", ALIASED)
@pytest.mark.parametrize("before", [0, 1, 30])
def test_an_alias_of_yaml_in_what_is_rewritten_is_refused_at_its_place(run: Run, kind: str, before: int) -> None:
    good = "point: [1, 2, 3]\n---\n"
    done = run(*MOVE, "-f", "yaml", "--in", "yaml", "--on-error", "skip", stdin=good * before + ALIASED[kind])
    line, column = next((at, text.index("*") + 1) for at, text in enumerate(ALIASED[kind].splitlines(), 1) if "*" in text)
    refused = f"stdin:{2 * before + line}:{column}: a YAML alias is in place of what is rewritten; replace it by its value"
    assert (done.status, done.out.count("point")) == (3, before)
    assert refused in done.err


MANY: dict[str, Callable[[int], Any]] = {
    "PoseArray": lambda count: {"header": HEADER, "poses": [POSE] * count},
    "Path": lambda count: {"header": HEADER, "poses": [{"header": HEADER, "pose": POSE}] * count},
    "list": lambda count: [{"stamp_ns": 5, "frame": "base", "xyz": [1, 2, 3], "xyzw": Q}] * count,
}


def took(run: Run, arguments: tuple[str, ...], text: str, enough: float) -> float:
    """Take the processor time of a command, the least of six; stop where it is enough."""
    least = float("inf")
    for _ in range(6):
        begun = time.process_time()
        assert run(*arguments, stdin=text).status == 0
        least = min(least, time.process_time() - begun)
        if least < enough:
            break
    return least


@pytest.mark.parametrize(
    ("kind", "form", "into"),
    [(kind, form, into) for kind in MANY for form, into in (("json", ""), ("json", "csv"), ("yaml", ""), ("argument", ""))],
)
def test_the_poses_of_one_document_cost_time_in_proportion(run: Run, kind: str, form: str, into: str) -> None:
    arguments = (*MOVE, *(("-f", into) if into else ()))
    times = [0.0]
    for count in (400, 1600):  # long ones both, for which no expression is made
        text = TEXTS[form.replace("argument", "json")][0](MANY[kind](count))
        given = ((*arguments, text), "") if form == "argument" else (arguments, text)
        times.append(took(run, *given, 8 * times[-1]))
    assert times[2] < 8 * times[1]
