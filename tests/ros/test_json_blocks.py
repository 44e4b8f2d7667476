"""The fast way through JSON lines of transforms and the full reader give the same edges, notes and errors."""

from __future__ import annotations

import json
import random
import warnings
from typing import TYPE_CHECKING, Any

import pytest

from frametool.errors import FormatError
from frametool.formats.load import FrameFile, load
from frametool.grammar.edges import Diagnostics
from frametool.grammar.result import Style
from frametool.ros.message_stream import plain_columns
from frametool.ros.messages import message_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from conftest import Sizes

HALF = 0.7071067811865476


def transform(second: int, child: str = "base", **changed: Any) -> dict[str, Any]:
    """Build a TransformStamped from odom; `changed` replaces fields of its rotation."""
    return {
        "header": {"stamp": {"sec": second, "nanosec": 5}, "frame_id": "odom"},
        "child_frame_id": child,
        "transform": {
            "translation": {"x": 0.1 * second, "y": -2.0, "z": 1e-7},
            "rotation": {"x": 0.0, "y": 0.0, "z": HALF, "w": HALF, **changed},
        },
    }


def enveloped(topic: str, *transforms: dict[str, Any]) -> dict[str, Any]:
    """Build what rosbridge puts around a message."""
    return {"op": "publish", "topic": topic, "msg": {"transforms": list(transforms)}}


PLAIN = (
    json.dumps(transform(1)),
    json.dumps(transform(2, z=0.7075)),  # off norm 1 by less than 1e-3
    json.dumps(transform(3), separators=(",", ":")),
    json.dumps({"transforms": [transform(4), transform(4, "laser")]}),
    json.dumps(enveloped("/tf", transform(5), transform(5, "laser"))),
    json.dumps(enveloped("/tf_static", transform(0, "mast"))),
    json.dumps(transform(6, "5")),
    json.dumps(transform((1 << 32) - 1)),
)
OTHER = (
    json.dumps({"transforms": [transform(4), transform(4, "/laser")]}),
    json.dumps(enveloped("", transform(5), transform(5, "laser"))),
    json.dumps(transform(1, z=2.0)),
    json.dumps({"transforms": [transform(4, z=0.7075), transform(4, "laser", z=2.0)]}),
    json.dumps({"transforms": [transform(4, z=0.7075)]})[:-1] + "x",
    json.dumps({"transforms": []}),
    json.dumps(transform(1)).replace("nanosec", "nsec"),
    json.dumps(transform(1)).replace('"nanosec": 5', '"nanosec": 1000000000'),
    json.dumps(transform(1 << 32)),
    json.dumps(transform(1)).replace("-2.0", "1e999"),
    json.dumps(transform(1)).replace("-2.0", "NaN"),
    json.dumps(transform(1)).replace("-2.0", "-2."),
    json.dumps(transform(1)).replace("-2.0", "1_0"),
    json.dumps(transform(1)).replace("-2.0", '"-2.0"'),
    json.dumps(transform(1)).replace('"sec": 1', '"sec": 01'),
    json.dumps(transform(1, "")),
    json.dumps(transform(1, "K\u00f6rper")),
    json.dumps(transform(1)) + " ",
    json.dumps(transform(1)) + json.dumps(transform(2)),
    json.dumps(transform(1)) + ", " + json.dumps(transform(2)),
    json.dumps(transform(1)) + "]}",
    json.dumps({"transforms": [transform(1)]})[:-1],
    json.dumps({"topic": "/tf", "op": "publish", "msg": {"transforms": [transform(1)]}}),
    "",
    "[INFO] [1683377979.1]: recording",
    "half a line {",
)


def taken(path: Path, lines: Sequence[str], *topics: str, normalize: bool = False) -> tuple[Any, ...]:
    """Read lines; return the edges, the errors, and what was odd."""
    path.write_text("".join(line + "\n" for line in lines))
    errors: list[FormatError] = []
    recording = FrameFile(path, fmt="jsonl", topics=topics)
    edges = list(recording.edges(errors.append, tell=False, normalize=normalize))
    said = [(error.line, error.message, error.rule) for error in errors]
    return edges, said, list(recording.tally.findings()), recording.topics.counts


def in_full(line: str) -> str:
    """Put a blank where only the full reader expects one."""
    return line.replace(":", " :", 1) if line.startswith("{") else line


@pytest.mark.parametrize("line", PLAIN)
def test_plain_lines_take_the_fast_way(line: str) -> None:
    assert plain_columns(line + "\n", 1, Diagnostics()) is not None
    assert plain_columns(in_full(line) + "\n", 1, Diagnostics()) is None


@pytest.mark.parametrize("line", OTHER)
def test_other_lines_are_left_alone(line: str) -> None:
    tally = Diagnostics()
    assert plain_columns(line + "\n", 1, tally) is None
    assert not tally.rough


@pytest.mark.parametrize("topics", [(), ("/tf",)], ids=["all", "chosen"])
@pytest.mark.parametrize("line", [*PLAIN, *OTHER])
def test_both_ways_give_the_same(line: str, topics: tuple[str, ...], tmp_path: Path) -> None:
    lines = (PLAIN[0], line, PLAIN[1])
    fast = taken(tmp_path / "a.jsonl", lines, *topics)
    full = taken(tmp_path / "a.jsonl", [in_full(each) for each in lines], *topics)
    assert fast == full


@pytest.mark.parametrize("normalize", [False, True])
def test_all_together(normalize: bool, tmp_path: Path) -> None:  # noqa: FBT001
    lines = (*PLAIN, *OTHER, enveloped_line := json.dumps(enveloped("/robot2/tf", transform(9))), enveloped_line)
    fast = taken(tmp_path / "a.jsonl", lines, normalize=normalize)
    assert fast == taken(tmp_path / "a.jsonl", [in_full(each) for each in lines], normalize=normalize)
    assert any(rule == "two-topics" for _, _, rule in fast[1])



def test_text_and_json_normalize_alike(tmp_path: Path) -> None:
    numbers = "translation: {x: 0.2, y: -2.0, z: 1e-7}", "rotation: {x: 0.0, y: 0.0, z: 0.7075, w: 0.7071067811865476}"
    head = "transforms:\n- header:\n    stamp:\n      sec: 2\n      nanosec: 5\n    frame_id: odom\n  child_frame_id: base\n"
    block = head + "  transform:\n" + "".join(
        f"    {part}:\n" + "".join(f"      {each}\n" for each in inner.rstrip("}").split(", "))
        for part, _, inner in (each.partition(": {") for each in numbers)
    )
    (tmp_path / "a.txt").write_text(block + "---\n")
    (tmp_path / "a.jsonl").write_text(PLAIN[1] + "\n")
    for normalize, rough in (False, 1), (True, 0):
        text, lines = (FrameFile(tmp_path / name) for name in ("a.txt", "a.jsonl"))
        (one,), (other,) = (list(each.edges(tell=False, normalize=normalize)) for each in (text, lines))
        assert one.components == other.components
        assert len(text.tally.rough) == len(lines.tally.rough) == rough


def recorded(seed: int) -> list[dict[str, Any]]:
    """Build messages of frames that move, with one now and then that is late, comes twice or hangs elsewhere."""
    rng = random.Random(seed)  # noqa: S311 - no secret
    odd = {f"frame_{number}" for number in range(5) if rng.random() < 0.4}
    found = []
    for second in range(1, 60):
        for number in range(rng.randrange(1, 6)):
            child = f"frame_{number}"
            parent = f"frame_{number - 1}" if number else "odom"
            edge = transform(second, child)
            edge["header"]["frame_id"] = parent
            if child in odd and rng.random() < 0.1:
                edge["header"]["stamp"]["sec"] = rng.choice((second, second - 1, 7))
                edge["header"]["frame_id"] = rng.choice((parent, parent, "odom", "map", f"frame_{number + seed % 2}"))
            found.append(edge)
    return [{"transforms": found[at : at + 3]} for at in range(0, len(found), 3)]


def loaded(path: Path) -> tuple[Any, ...]:
    """Load a recording; return all samples and the warnings, or the error."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            tree = load(path)
        except FormatError as error:
            return error.line, str(error)
    samples = [(frame, track and [*track.walk()]) for frame in tree.frames for track in [tree.track(frame)]]
    return samples, [str(each.message) for each in caught]


@pytest.mark.parametrize("seed", range(30))
def test_stretches_and_single_messages_make_the_same_tree(
    seed: int, tmp_path: Path, sizes: Sizes
) -> None:
    path = tmp_path / "a.jsonl"
    path.write_text("".join(json.dumps(message) + "\n" for message in recorded(seed)))
    for size in (2000, 1 << 17):
        sizes(stretch=size)
        whole = loaded(path)
        sizes(stretch=1)
        assert loaded(path) == whole


@pytest.mark.parametrize("ros", ["ros1", "ros2"])
@pytest.mark.parametrize("odd", [None, 0, 40, 99])
def test_echoed_stretches_give_what_the_full_reader_gives(ros: str, odd: int | None, tmp_path: Path) -> None:
    messages = [message_text({"transforms": [transform(second), transform(second, "laser")]}, Style(ros)) for second in range(100)]
    if odd is not None:
        messages[odd] = "A message was lost!!!\n" + messages[odd].replace("base", "Körper")
    plain, full = tmp_path / "plain.txt", tmp_path / "full.txt"
    plain.write_text("".join(messages))
    full.write_text("".join(messages).replace("stamp:", "stamp: #"))
    edges = [list(FrameFile(path).edges(tell=False)) for path in (plain, full)]
    assert edges[0] == edges[1]
    assert len(edges[0]) == 200
    found = plain_columns("".join(messages), 1, Diagnostics())
    assert (found is None) == (odd is not None)
    assert found is None or list(found.edges()) == edges[0]
