"""Trees whose edges have covariances: looked up along the path, merged, and in every spelling of a file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frametool import FrameTree, Transform, TransformBuffer, covariance, load
from frametool.documents.source import Source
from frametool.errors import (
    BadTopology,
    FormatError,
    FrametoolWarning,
    NotConnected,
    TooLate,
    UnknownFrame,
    ValueInvalid,
)
from frametool.formats.load import load_sources

CHAINS = json.loads((Path(__file__).parent.parent / "golden" / "covariance.json").read_text())["covariance"]
SMALL = np.diag([1e-4, 4e-4, 9e-4, 1e-4, 4e-4, 9e-4])
ENTRIES = SMALL.ravel().tolist()
SECOND = 1_000_000_000


def tree_in(text: str, *more: str) -> Any:
    """Read trees that are merged."""
    return load_sources([Source(f"{name}.yaml", each) for name, each in zip("abc", (text, *more), strict=False)])


@pytest.mark.parametrize("golden", CHAINS, ids=lambda golden: str(golden["name"]))
def test_lookups_are_those_of_the_golden_numbers(golden: dict[str, Any]) -> None:
    tree = tree_in(json.dumps({"frames": golden["tree"]}))
    for lookup in golden["lookups"]:
        found = np.reshape(tree.covariance(lookup["target"], lookup["source"]), (6, 6))
        expected = np.reshape(lookup["covariance"], (6, 6))
        sizes = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.all(abs(found - expected) <= 1e-9 * sizes)
        assert np.array_equal(found, found.T)


@pytest.mark.parametrize("golden", CHAINS, ids=lambda golden: str(golden["name"]))
def test_the_other_way_round_is_the_inverse(golden: dict[str, Any]) -> None:
    tree = tree_in(json.dumps({"frames": golden["tree"]}))
    for lookup in golden["lookups"]:
        target, source = lookup["target"], lookup["source"]
        there = np.reshape(tree.covariance(target, source), (6, 6))
        back = np.reshape(covariance.invert(tree.lookup(source, target), tree.covariance(source, target)), (6, 6))
        sizes = np.sqrt(np.outer(np.diag(there), np.diag(there)))
        assert np.all(abs(there - back) <= 1e-14 * sizes.max())


def arm() -> FrameTree:
    """Make base - a - tip and base - b, a and b uncertain."""
    tree = FrameTree("arm")
    for name, pose in zip("ab", Transform.random(2, seed=4), strict=True):
        tree.add("base", name, pose, SMALL)
    tree.add("a", "tip", Transform.from_arrays([0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]))
    tree.add("world", "base", Transform.identity(), 100.0 * SMALL)
    return tree


def test_only_the_edges_on_the_path_count() -> None:
    tree = arm()
    alone = FrameTree()
    for parent, child, pose in tree.edges():
        if child != "base":
            alone.add(parent, child, pose, tree.covariances.get(child))
    assert tree.covariance("tip", "b") == alone.covariance("tip", "b")
    a, b = tree.lookup("a", "base"), tree.lookup("base", "b")
    by_hand = covariance.compose(a, covariance.invert(a.inverse(), SMALL), b, SMALL)
    assert tree.covariance("a", "b") == pytest.approx(by_hand, rel=1e-12, abs=1e-18)


def test_what_has_no_covariance_is_said() -> None:
    tree = arm()
    assert tree.covariance("tip", "tip") == [0.0] * 36
    with pytest.raises(ValueInvalid, match=r"^no edge between a and tip has a sigma or a covariance$"):
        tree.covariance("a", "tip")
    with pytest.raises(UnknownFrame):
        tree.covariance("tipp", "tipp")
    tree.add("island", "hut", Transform.identity(), ENTRIES)
    with pytest.raises(NotConnected):
        tree.covariance("a", "hut")


def test_an_edge_has_one_covariance() -> None:
    tree = arm()
    pose = tree.lookup("base", "a")
    tree.add("base", "a", pose, ENTRIES)
    for other, what in ((None, "a covariance in one place and none in another"), (2.0 * SMALL, "two different covariances")):
        with pytest.raises(BadTopology) as caught:
            tree.add("base", "a", pose, other)
        assert str(caught.value) == f"frame 'a' in 'base' has {what}"
    with pytest.raises(BadTopology, match="two parents"):
        tree.add("b", "a", pose, 2.0 * SMALL)
    with pytest.raises(ValueInvalid, match="covariance has 3 numbers"):
        tree.add("base", "c", pose, [1.0, 2.0, 3.0])
    assert "c" not in tree.frames


def test_a_covariance_holds_at_all_times() -> None:
    buffer = TransformBuffer(name="drive")
    poses = Transform.random(3, seed=2)
    buffer.insert("map", "base", poses[0], 0, covariance=SMALL)
    buffer.insert("map", "base", poses[1], SECOND)
    buffer.insert("base", "lidar", poses[2])
    for at_ns in (0, SECOND // 3, SECOND, None):
        expected = covariance.compose(buffer.lookup("map", "base", at_ns), SMALL, poses[2], None)
        assert buffer.covariance("map", "lidar", at_ns) == pytest.approx(expected, rel=1e-12, abs=1e-18)
    with pytest.raises(TooLate):
        buffer.covariance("map", "lidar", 2 * SECOND)
    with pytest.raises(BadTopology, match=r"^frame 'base' in 'map' has two different covariances$"):
        buffer.insert("map", "base", poses[1], 2 * SECOND, covariance=2.0 * SMALL)
    assert buffer.latest("map", "base") == SECOND
    assert buffer.tree_at(SECOND).covariances == buffer.covariances == {"base": tuple(ENTRIES)}


def test_a_lookup_warns_of_a_wide_turn_once() -> None:
    tree = FrameTree()
    tree.add("a", "b", Transform.identity(), 100.0 * SMALL)
    with pytest.warns(FrametoolWarning) as told:
        tree.covariance("a", "b")
    assert [str(each.message) for each in told] == [
        "sigma of a turn is 0.3 rad: the first order is a few per cent off above 0.2"
    ]


SIGMA = "sigma: {xyz_mm: 10, rpy_deg: 0.5}"
DEGREES = "sigma: {xyz: 0.01, rpy: [0.5, 0.5, 0.5]}"
SPELLINGS = {
    "nested": f"frames: {{a: {{b: {{xyz: [1, 2, 3], {SIGMA}}}}}}}",
    "nested-deg": f"angles: deg\nframes: {{a: {{b: {{xyz: [1, 2, 3], {DEGREES}}}}}}}",
    "children": f"frames: {{r: {{a: {{xyz: [0, 0, 1], children: {{b: {{xyz: [1, 2, 3], {SIGMA}}}}}}}}}}}",
    "list": f"frames: [{{name: b, parent: a, xyz: [1, 2, 3], {SIGMA}}}]",
    "one": f"{{name: b, parent: a, xyz: [1, 2, 3], {SIGMA}}}",
    "one-deg": f"{{name: b, parent: a, xyz: [1, 2, 3], angles: deg, {DEGREES}}}",
    "slashed": f"{{name: /b, parent: /a, xyz: [1, 2, 3], {SIGMA}}}",
    "stamped": f"{{name: b, parent: a, stamp: 3, xyz: [1, 2, 3], {SIGMA}}}",
    "samples": f"{{name: b, parent: a, {SIGMA}, samples: [{{stamp: 0, xyz: [1, 2, 3]}}, {{stamp: 1, xyz: [1, 2, 4]}}]}}",
    "nested-samples": f"frames: {{a: {{b: {{{SIGMA}, samples: [{{stamp: 0, xyz: [1, 2, 3]}}]}}}}}}",
}


@pytest.mark.filterwarnings("ignore:.*leading /")
@pytest.mark.parametrize("text", SPELLINGS.values(), ids=SPELLINGS)
def test_every_spelling_of_a_tree_has_sigmas(text: str) -> None:
    angle = np.radians(0.5) ** 2
    expected = np.diag([1e-4] * 3 + [angle] * 3).ravel()
    assert tree_in(text).covariance("a", "b") == pytest.approx(expected.tolist(), rel=1e-15, abs=0.0)


def test_what_is_inverse_is_inverted_whole() -> None:
    plain = "{name: b, parent: a, xyz: [1, 2, 3], rpy_deg: [10, 20, 30], sigma: {xyz: [0.1, 0.2, 0.3], rpy_deg: 1}"
    turned = tree_in(plain.replace("name: b, parent: a", "name: a, parent: b") + ", inverse: true}")
    straight = tree_in(plain + "}")
    expected = straight.covariance("a", "b")
    assert turned.covariance("a", "b") == pytest.approx(expected, rel=1e-13, abs=1e-17)


def test_several_files_have_to_agree() -> None:
    one = f"frames:\n  - {{name: b, parent: a, xyz: [1, 2, 3], {SIGMA}}}\n"
    assert tree_in(one, one).covariances == tree_in(one).covariances
    other = one.replace("10", "11")
    exact = one.replace(f", {SIGMA}", "")
    none = "a covariance in one place and none in another"
    for first, second, what in ((one, other, "two different covariances"), (one, exact, none), (exact, one, none)):
        with pytest.raises(BadTopology) as caught:
            tree_in(first, second)
        assert str(caught.value) == f"b.yaml:2:5: frame 'b' in 'a' has {what}: a.yaml:2 and line 2"


def test_samples_of_two_files_have_to_agree(tmp_path: Path) -> None:
    ours = f"{{name: b, parent: a, {SIGMA}, samples: [{{stamp: 0, xyz: [1, 2, 3]}}, {{stamp: 1, xyz: [1, 2, 4]}}]}}"
    exact = "{name: b, parent: a, samples: [{stamp: 2, xyz: [1, 2, 3]}]}"
    with pytest.raises(BadTopology, match=r"a covariance in one place and none in another: a\.yaml:1 and line 1"):
        tree_in(ours, exact)
    table = tmp_path / "more.csv"
    table.write_text("stamp,name,parent,x,y,z,qx,qy,qz,qw\n" + "".join(f"{at},b,a,0,0,0,0,0,0,1\n" for at in range(5, 9)))
    (tmp_path / "a.yaml").write_text(ours)
    with pytest.raises(BadTopology, match="a covariance in one place and none in another"):
        load(tmp_path / "a.yaml", table)


BAD = {  # what stands in an entry, what is said of it, and what the place points to
    "both": (f"{SIGMA}, covariance: {ENTRIES}", "sigma and covariance in one entry; keep one", "sigma"),
    "count": (
        f"covariance: {[0] * 21}",
        "covariance has 21 numbers; 36 are needed (6x6, row-major: x y z, turns about X Y Z)", "[0, 0, 0,",
    ),
    "unknown": (f"covariance: {[-1] + [0] * 35}", "covariance[0] is -1: 'unknown' in ROS; leave the covariance out", "-1"),
    "negative": ("sigma: {xyz: -0.1}", "sigma is negative: -0.1", "-0.1"),
    "scale": ("scale: 2", "scale: a similarity, not a pose; apply --transform, compose and invert take it", "2}"),
    "sample": (
        "samples: [{stamp: 0, xyz: [1, 2, 3], sigma: {xyz: 1}}]",
        "sigma is common to all samples; write it next to samples", "sigma",
    ),
    "inverse-sample": (
        f"{SIGMA}, samples: [{{stamp: 0, xyz: [1, 2, 3], inverse: true}}]",
        "a sample that is inverted has no part in one covariance for all; write its inverse", "true",
    ),
    "inverse-samples": (
        f"{SIGMA}, inverse: true, samples: [{{stamp: 0, xyz: [1, 2, 3]}}]",
        "inverse belongs into each of the samples", "inverse",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("beside", "message", "points_to"), BAD.values(), ids=BAD)
def test_what_no_entry_may_have_is_refused_with_its_place(beside: str, message: str, points_to: str) -> None:
    pose = "" if "samples" in beside else "xyz: [1, 2, 3], "
    line = f"  - {{name: b, parent: a, {pose}{beside}}}"
    with pytest.raises(FormatError) as caught:
        tree_in(f"frames:\n{line}\n")
    column = line.index(points_to, line.index(beside)) + 1
    assert str(caught.value) == f"a.yaml:2:{column}: {message}"


def test_a_root_has_none() -> None:
    with pytest.raises(FormatError, match="frame 'a' has a pose but no parent"):
        tree_in(f"frames: [{{name: a, {SIGMA}}}]")
