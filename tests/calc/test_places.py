"""Places on the Earth in expressions: points or poses of ecef, whose frames are checked."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

import frametool
from frametool.errors import FrametoolError

if TYPE_CHECKING:
    from collections.abc import Callable

TREE = "[{name: map, at: {lat: 48.1, lon: 11.5, alt: 520}, axes: enu}, {name: mast, parent: map, xyz: [0, 0, 9]}]"
ABOVE = "{lat: 48.1, lon: 11.5, alt: 521}"
GPS = "id,lat,lon,alt\n1,48.1,11.5,521\n2,48.1,11.5,523\n"
FILES = {"t.yaml": TREE, "e.yaml": TREE.replace("name: map,", "name: map, parent: earth,"), "gps.csv": GPS}


@pytest.mark.parametrize("tree", ["t.yaml", "e.yaml"])
@pytest.mark.parametrize("name", ["ecef", "earth"])
def test_a_place_is_a_point_of_the_earth_by_either_name(tree: str, name: str, run: Callable[..., Any]) -> None:
    found = run("calc", "--tree", tree, f"(map<-{name}) * {ABOVE}", "-f", "json", files=FILES)
    value = json.loads(found.out)
    assert (value["frame"], value["point"]) == ("map", pytest.approx([0.0, 0.0, 1.0], abs=5e-9))


def test_with_a_rotation_and_axes_it_is_a_pose() -> None:
    pose = frametool.calc("{lat: 48.1, lon: 11.5, alt: 520, axes: ned, heading_deg: 90}")
    assert (pose.kind, pose.target) == ("pose", "ecef")
    wanted = frametool.earth_pose(48.1, 11.5, 520.0, "ned").components[:3]
    assert pose.components[:3] == pytest.approx(wanted, rel=1e-15)


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        (f"(mast<-map) * {ABOVE}", "mast<-map * a point in 'ecef': 'map' and 'ecef' do not touch"),
        ("{lat: 48.1, lon: 11.5, alt: 0, rpy: [0, 0, 1]}", "a pose at lat, lon does not state the axes of its rotation"),
        ("{frame: map, lat: 48.1, lon: 11.5, alt: 0}", "lat places a frame in ecef; frame is 'map'"),
        ("{lat: 95, lon: 11.5, alt: 0}", "lat 95.0 is beyond 90 degrees; are lat and lon swapped?"),
    ],
)  # fmt: skip
def test_frames_and_places_are_checked(expression: str, message: str, run: Callable[..., Any]) -> None:
    found = run("calc", "--tree", "t.yaml", expression, files=FILES)
    assert (found.status, found.err.splitlines()[0][: 11 + len(message)]) == (1, f"frametool: {message}")


def test_distances_are_straight() -> None:
    assert frametool.calc("dist({lat: 0, lon: 0, alt: 0}, {lat: 0, lon: 180, alt: 0})") == 2 * 6378137.0


def test_rows_of_places_are_points_of_ecef(run: Callable[..., Any]) -> None:
    moved = run("calc", "--tree", "t.yaml", "(map<-ecef) * row", "-i", "gps.csv", files=FILES)
    rows = [[float(cell) for cell in line.split(",")] for line in moved.out.splitlines()[1:]]
    assert rows == [pytest.approx([1, 0, 0, 1], abs=5e-9), pytest.approx([2, 0, 0, 3], abs=5e-9)]
    wrong = run("calc", "--tree", "t.yaml", "(mast<-map) * row", "-i", "gps.csv", files=FILES)
    assert (wrong.status, wrong.out) == (1, "")
    assert "mast<-map * a point in 'ecef': 'map' and 'ecef' do not touch" in wrong.err
    beside = run("calc", "-e", f"d=dist(row, {ABOVE})", "-i", "gps.csv", files=FILES)
    assert [float(line.rpartition(",")[2]) for line in beside.out.splitlines()[1:]] == pytest.approx([0, 2], abs=5e-9)


@pytest.mark.parametrize("form", ["yaml", "json", "csv", "text"])
def test_results_in_ecef_are_written_at_places(form: str, run: Callable[..., Any]) -> None:
    found = run("calc", "--tree", "t.yaml", "(ecef<-mast) * {frame: mast, point: [0, 0, 1]}", "--to", "lla", "-f", form,
                files=FILES)  # fmt: skip
    assert (found.status, "48.09999999" in found.out or "48.1" in found.out, "point" in found.out) == (0, True, False)


def test_results_elsewhere_are_not(run: Callable[..., Any]) -> None:
    for arguments in (["map<-mast"], ["(map<-ecef) * row", "-i", "gps.csv"], [f"(map<-ecef) * {ABOVE}"]):
        found = run("calc", "--tree", "t.yaml", *arguments, "--to", "lla", files=FILES)
        assert (found.status, found.out) == (1, "")
        assert "--to lla wants poses in ecef: this one is in 'map'" in found.err


def test_a_file_of_a_place_is_a_point(run: Callable[..., Any]) -> None:
    found = run("calc", "p=p.yaml", f"dist(p, {ABOVE})", files={"p.yaml": "{lat: 48.1, lon: 11.5, alt: 523}"})
    assert float(found.out) == pytest.approx(2.0, abs=5e-9)


def test_half_a_place_is_an_error() -> None:
    with pytest.raises(FrametoolError, match="half a place on the Earth"):
        frametool.calc("{lat: 48.1, alt: 3}")
