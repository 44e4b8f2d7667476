"""The schema that editors check trees with: it takes all that the reader takes, and refuses keys that the reader refuses."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
import test_trees
import yaml
from console import ROOT

import frametool
from frametool.formats.trees.schema import schema
from frametool.geometry.lenses import CAMERA_MODELS
from frametool.geometry.representations import POSITIONS, ROTATIONS

if TYPE_CHECKING:
    from collections.abc import Callable

READ = [test_trees.NESTED, test_trees.LISTED, test_trees.KEYED, test_trees.ROS, test_trees.JSON, test_trees.FRAME_IDS]
READ += ["frames:", "{name: b, parent: a, xyz: {x: 10cm}, rpy: [90deg, 0, pi]}", "{child: 7, parent: on, t: [[1], [2], [3]], R: [1, 0, 0, 0, 1, 0, 0, 0, 1]}"]
READ += ["frames: {c: {parent: b, x: 1, theta: 1}, b: {d: {at: {lat: 48, lon: 11}}, e: }}", "{name: b, parent: a, euler: {axes: rzyx, angles: [0, 0, 1]}}"]
READ += ["{name: b, parent: a, samples: [{stamp: 0, xyz: [0, 0, 1], sigma: {xyz: 1}}]}", "[{name: b}, {name: c, parent: b, axes: optical, stamp_ns: 1}]"]
OF_KEYS = r"unknown key|is given by the nesting|no frame tree|stands where|stand under children"
REFUSED = [text for text, message in test_trees.REFUSED.items() if re.search(OF_KEYS, message)]
REFUSED += ["frames: {a: {b: {xzy: [1, 2, 3]}}}", "{name: b, parent: a, rpy_degrees: [0, 0, 0]}", "frames: {a: {b: {camera: {K: [1, 1, 1, 1], F: 2}}}}"]
REFUSED += ["{name: b, parent: a, samples: [{stamp: 0, xzy: [0, 0, 1]}]}", "frames: {c: {parent: b, xzy: 1}}"]


@pytest.fixture(scope="module")
def mistakes() -> Callable[[Any], list[str]]:
    """Return what finds the mistakes of a document."""
    validator = pytest.importorskip("jsonschema").Draft202012Validator
    validator.check_schema(schema())
    return lambda document: [each.message for each in validator(schema()).iter_errors(document)]


@pytest.mark.parametrize("text", READ)
def test_what_is_read_is_taken(mistakes: Callable[[Any], list[str]], text: str) -> None:
    assert [mistakes(each) for each in yaml.safe_load_all(text)] == [[] for _ in yaml.safe_load_all(text)]


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml", "cameras.yaml", "site.yaml"])
def test_our_examples_are_taken_and_their_lookups(mistakes: Callable[[Any], list[str]], name: str) -> None:
    assert mistakes(yaml.safe_load((ROOT / "examples" / name).read_text())) == []
    for form in ("yaml", "json"):
        printed = frametool.run(["tree", str(ROOT / "examples" / name), "-f", form]).out
        assert mistakes(yaml.safe_load(printed)) == []


@pytest.mark.parametrize("text", REFUSED)
def test_keys_that_the_reader_refuses_are_refused(mistakes: Callable[[Any], list[str]], text: str) -> None:
    assert mistakes(yaml.safe_load(text)) != []


def test_help_prints_it_with_the_keys_of_the_tables() -> None:
    printed = json.loads(frametool.run("help schema").out)
    assert printed == schema()
    keys = printed["$defs"]["keys"]["properties"]
    assert {*ROTATIONS, "rpy_deg", "xyz_mm", "at", "sigma"} | {*POSITIONS} - {"enu", "ned"} <= {*keys}
    assert keys["rpy_deg"]["description"].endswith(", degrees")
    assert printed["$defs"]["camera"]["properties"]["model"]["anyOf"][0]["enum"] == [*CAMERA_MODELS]
