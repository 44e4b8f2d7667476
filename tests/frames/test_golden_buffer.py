"""The buffer against the real tf2 0.7.6 BufferCore of ROS 1 (Debian's tf2_py): values, stamps, and what has no answer.

Numbers: tests/golden/stamped_trees.json, lookup_full.json, slerp.json.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from frametool import Transform, TransformBuffer
from frametool.errors import LookupFailed, NoDataAt, NotConnected, UnknownFrame
from frametool.formats.trees.drawings import write_tree
from frametool.grammar.result import Style

GOLDEN = Path(__file__).parents[1] / "golden"
KINDS = {
    "ExtrapolationException": NoDataAt,
    "LookupException": UnknownFrame,
    "InvalidArgumentException": UnknownFrame,
    "ConnectivityException": NotConnected,
}


def read(name: str) -> Any:
    """Read a file of golden numbers."""
    return json.loads((GOLDEN / f"{name}.json").read_text())


STAMPED = read("stamped_trees")["trees"]
ACROSS = read("lookup_full")["trees"]
SLERP = read("slerp")["cases"]


def transform(xyz: Any, xyzw: Any) -> Transform:
    """Make a transform of any numbers, as a message brings them."""
    return Transform.of(*map(float, xyz), *map(float, xyzw))


def filled(tree: dict[str, Any]) -> TransformBuffer:
    """Fill a buffer with the operations of a golden tree."""
    buffer = TransformBuffer(keep_ns=int(tree["cache_s"] * 1e9))
    for static, parent, child, stamp_ns, xyz, xyzw in tree["ops"]:
        buffer.insert(parent, child, transform(xyz, xyzw), stamp_ns, static=bool(static))
    return buffer


def assert_near(found: Transform, xyz: list[float], xyzw: list[float], tolerance: float = 1e-9) -> None:
    """Compare with tf2's numbers, the quaternion up to its sign."""
    components = list(found.components)
    size = 1.0 + max(map(abs, xyz))
    assert components[:3] == pytest.approx(xyz, abs=tolerance * size, rel=0.0)
    sign = 1.0 if sum(a * b for a, b in zip(components[3:], xyzw, strict=True)) > 0.0 else -1.0
    assert components[3:] == pytest.approx([sign * value for value in xyzw], abs=tolerance, rel=0.0)


@pytest.mark.parametrize("tree", STAMPED, ids=[f"tree-{number}" for number in range(len(STAMPED))])
def test_lookups_in_time_are_tf2s_in_value_and_stamp_and_lack_the_same(tree: dict[str, Any]) -> None:
    buffer = filled(tree)
    for golden in tree["lookups"]:
        target, source, at_ns = golden["target"], golden["source"], golden["time_ns"] or None
        if target == source == "ghost":
            continue  # tf2 answers with the identity for frames nobody has heard of; frametool does not
        if "error" in golden:
            with pytest.raises(KINDS[golden["error"]]):
                buffer.lookup(target, source, at_ns)
        else:
            assert_near(buffer.lookup(target, source, at_ns), golden["t"], golden["q"])
            assert (at_ns or buffer.latest(target, source) or 0) == golden["stamp_ns"]


@pytest.mark.parametrize("tree", STAMPED, ids=[f"tree-{number}" for number in range(len(STAMPED))])
def test_many_lookups_at_once_are_tf2s(tree: dict[str, Any]) -> None:
    buffer = filled(tree)
    answered = [golden for golden in tree["lookups"] if "error" not in golden and golden["time_ns"]]
    for golden in answered:
        found = buffer.lookup_many(golden["target"], golden["source"], [golden["time_ns"]])
        assert_near(found[0], golden["t"], golden["q"])


@pytest.mark.parametrize("tree", STAMPED, ids=[f"tree-{number}" for number in range(len(STAMPED))])
def test_the_listing_is_tf2s(tree: dict[str, Any]) -> None:
    assert write_tree(filled(tree), Style("tf2")) == tree["yaml"].replace("golden", "default_authority")


@pytest.mark.parametrize("tree", ACROSS, ids=[f"tree-{number}" for number in range(len(ACROSS))])
def test_lookups_across_two_times_are_tf2s(tree: dict[str, Any]) -> None:
    buffer = filled(tree)
    for golden in tree["lookups"]:
        times = golden["target_time_ns"] or None, golden["source_time_ns"] or None
        arguments = golden["target"], times[0], golden["source"], times[1], golden["fixed"]
        if "error" in golden:
            with pytest.raises(LookupFailed):
                buffer.lookup_across(*arguments)
        else:
            assert_near(buffer.lookup_across(*arguments), golden["t"], golden["q"])


@pytest.mark.parametrize("case", SLERP, ids=[f"{case['tag']}-{number}" for number, case in enumerate(SLERP)])
def test_interpolations_are_tf2s(case: dict[str, Any]) -> None:
    buffer = TransformBuffer()
    buffer.insert("a", "b", transform([0, 0, 0], case["q1"]), 10**9)
    buffer.insert("a", "b", transform([1, 2, -4], case["q2"]), 2 * 10**9)
    at_ns = 10**9 + round(case["ratio"] * 1e9)
    # tf2 takes arcs below 2e-8 rad for none at all and answers with the older sample
    tolerance = 1e-12 if abs(sum(a * b for a, b in zip(case["q1"], case["q2"], strict=True))) < 1 - 1e-15 else 1e-8
    assert_near(buffer.lookup("a", "b", at_ns), case["t"], case["q"], tolerance)
    assert_near(buffer.lookup_many("a", "b", [at_ns])[0], case["t"], case["q"], tolerance)


def test_there_are_as_many_lookups_as_were_recorded() -> None:
    lookups = [golden.get("error") for tree in STAMPED for golden in tree["lookups"]]
    counts = {kind: lookups.count(kind) for kind in (None, *KINDS)}
    assert list(counts.values()) == [454, 292, 12, 12, 2]
    assert sum(len(tree["lookups"]) for tree in ACROSS) == 60
