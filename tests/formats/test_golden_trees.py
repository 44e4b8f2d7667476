"""Lookups in trees that stand still, against the real tf2 0.7.6 BufferCore (static_trees.json, Debian's tf2_py)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from frametool import FrameTree, Transform

TREES = json.loads((Path(__file__).parents[1] / "golden" / "static_trees.json").read_text())["trees"]


def tree_of(edges: list[Any]) -> FrameTree:
    """Build a tree of golden edges [parent, child, xyz, xyzw]."""
    tree = FrameTree()
    for parent, child, xyz, xyzw in edges:
        tree.add(parent, child, Transform.from_arrays(xyz, xyzw))
    return tree


@pytest.mark.parametrize("golden", TREES, ids=[f"{len(tree['edges'])}-edges-{n}" for n, tree in enumerate(TREES)])
def test_lookups_are_tf2s(golden: dict[str, Any]) -> None:
    tree = tree_of(golden["edges"])
    for target, source, xyz, xyzw in golden["lookups"]:
        found = tree.lookup(target, source)
        size = sum(value * value for value in xyz) ** 0.5
        assert found.xyz.tolist() == pytest.approx(xyz, abs=1e-9 * (1.0 + size), rel=0.0)
        sign = 1.0 if sum(a * b for a, b in zip(found.xyzw.tolist(), xyzw, strict=True)) > 0.0 else -1.0
        assert found.xyzw.tolist() == pytest.approx([sign * value for value in xyzw], abs=1e-9, rel=0.0)


def test_there_are_the_lookups_that_were_recorded() -> None:
    assert sum(len(tree["lookups"]) for tree in TREES) == 360
