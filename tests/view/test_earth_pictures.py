"""Frames on the Earth for people: pictures leave its centre out, overviews say where things are."""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Any

import pytest

import frametool
from frametool.view.frame_scene import FrameScene

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

TREE = """\
- {name: car, axes: enu, samples: [{stamp: 0, lat: 48.1001, lon: 11.5, alt: 520}, {stamp: 1, lat: 48.1002, lon: 11.5, alt: 520}]}
- {name: map, parent: ROOT, at: {lat: 48.1, lon: 11.5, alt: 520}, axes: ned, heading_deg: 120}
- {name: mast, parent: map, xyz: [20, 0, 0]}
"""


@pytest.fixture(params=["ecef", "earth"])
def tree(request: pytest.FixtureRequest, tmp_path: Path) -> Any:
    """Return the tree, the Earth's frame by either name."""
    (tmp_path / "t.yaml").write_text(TREE.replace("ROOT", request.param))
    return frametool.load(tmp_path / "t.yaml")


def test_what_is_drawn_lies_on_the_ground_at_the_first_frame_that_stands(tree: Any) -> None:
    scene = FrameScene(tree)
    poses = scene.poses()
    assert scene.fixed == "enu at map"
    assert {*poses} == {"car", "map", "mast"}
    assert poses["map"][:3] == (0.0, 0.0, 0.0)
    assert poses["car"][:3] == pytest.approx((0.0, 11.1201, 0.0), abs=1e-4)
    assert max(abs(part) for trail in scene.trails.values() for piece in trail for point in piece for part in point) < 25


@pytest.mark.parametrize("name", ["ecef", "earth"])
def test_who_asks_for_the_centre_sees_it(tree: Any, name: str) -> None:
    assert {*FrameScene(tree, fixed=tree.resolve_name(name)).poses()} == {"car", "map", "mast", tree.resolve_name(name)}


def test_a_frame_called_earth_that_is_a_floor_is_drawn(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text("frames: {earth: {base: {xyz: [1, 2, 3]}}}")
    assert {*FrameScene(frametool.load(tmp_path / "t.yaml")).poses()} == {"earth", "base"}


@pytest.mark.parametrize("suffix", ["svg", "html", "glb"])
def test_no_picture_names_the_centre(suffix: str, run: Callable[..., Any], tmp_path: Path) -> None:
    found = run("view", "t.yaml", "-o", f"p.{suffix}", files={"t.yaml": TREE.replace("ROOT", "ecef")})
    content = (tmp_path / f"p.{suffix}").read_bytes()
    assert (found.status, b"ecef" in content) == (0, False)
    if suffix == "glb":
        (size,) = struct.unpack("<I", content[12:16])
        nodes = json.loads(content[20 : 20 + size])["nodes"]
        assert max(abs(part) for node in nodes for part in node.get("translation", ())) < 25


def test_an_overview_in_ecef_says_where_and_where_to(run: Callable[..., Any]) -> None:
    files = {"t.yaml": TREE.replace("ROOT", "ecef")}
    where = (
        "  lat lon alt    48.100000000 11.500000000 deg  520.0000 m\n"
        "  utm            32N 686121.7558 5330438.1302 m  convergence 1.861310 deg\n"
    )
    heading = "  heading        x 120.000000 deg from true north\n"
    assert run("lookup", "t.yaml", "ecef", "map", "-f", "text", files=files).out.endswith(where + heading)
    assert run("apply", "t.yaml", "ecef", "map", "0", "0", "0", "-f", "text").out.partition("\n")[2] == where
    for quiet in (["map", "mast"], ["ecef", "map", "--to", "rpy_deg"]):
        assert "lat lon" not in run("lookup", "t.yaml", *quiet, "-f", "text").out
