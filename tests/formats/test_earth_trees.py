"""Frames of trees at places on the Earth: every form they are written in, what is refused, and the way back."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import frametool
from frametool.errors import FrametoolError, FrametoolWarning

if TYPE_CHECKING:
    from collections.abc import Callable

EPS = 2.0**-52
GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "earth.json").read_text())
AT, PLACE = "at: {lat: 48.1, lon: 11.5, alt: 520}", "lat: 48.1, lon: 11.5, alt: 520"
ECEF = "ecef: [4182118.2100205706, 850861.5662904108, 4724696.307258269]"
UTM = "utm: {zone: 32N, easting: 691607.86, northing: 5334760.4, alt: 519}"
SITE = f"""\
frames:
  - {{name: map, parent: ecef, {AT}, axes: enu}}
  - {{name: site, at: {{{UTM}}}, axes: grid, rpy_deg: [0, 0, 30]}}
  - {{name: plane, at: {{lat: 48.2, lon: 11.6, alt: 3000}}, axes: ned, heading_deg: 120}}
  - {{name: gps, parent: site, xyz: [1, 2, 3], rpy_deg: [0, 0, 10]}}
"""


def of(text: str, tmp_path: Path, *more: str) -> Any:
    """Load texts as files."""
    paths = [tmp_path / f"{number}.yaml" for number in range(1 + len(more))]
    for path, each in zip(paths, (text, *more), strict=True):
        path.write_text(each)
    return frametool.load(*paths)


def golden(*, utm: bool = False) -> dict[str, Any]:
    """Return the golden frames as a tree, those that UTM has."""
    return {
        "frames": [
            {
                "name": f"f{number}", "at": dict(zip(("lat", "lon", "alt"), each["at"], strict=True)),
                "axes": each["axes"], "rpy_deg": each["rpy_deg"], "xyz": each["offset"],
            }
            for number, each in enumerate(GOLDEN["frames"])
            if not utm or -79.9 < each["at"][0] < 83.9
        ]
    }  # fmt: skip


def apart(one: Any, other: Any) -> float:
    """Return how far two quaternions are apart, whatever their sign."""
    return float(min(max(abs(a - sign * b) for a, b in zip(one, other, strict=True)) for sign in (1, -1)))


def test_frames_and_lookups_between_them_have_the_golden_numbers(tmp_path: Path) -> None:
    tree = of(json.dumps(golden()), tmp_path)
    for number, each in enumerate(GOLDEN["frames"]):
        found = tree.lookup("ecef", f"f{number}").components
        assert found[:3] == pytest.approx(each["xyz"], rel=0, abs=5e-9)
        assert apart(found[3:], each["quaternion"]) <= 4 * EPS
    for target, source, xyz, quaternion in GOLDEN["pairs"]:
        found = tree.lookup(f"f{target}", f"f{source}").components
        assert found[:3] == pytest.approx(xyz, rel=0, abs=5e-9)
        assert apart(found[3:], quaternion) <= 4 * EPS


@pytest.mark.parametrize("place", [AT, PLACE, f"at: {{{ECEF}}}", ECEF, f"{PLACE}, {ECEF}", f"{AT}, parent: earth"])
@pytest.mark.parametrize("axes", ["enu", "ned", "grid", "ecef"])
def test_every_way_to_say_a_place_is_the_same_frame(place: str, axes: str, tmp_path: Path) -> None:
    tree = of(f"[{{name: map, {place}, axes: {axes}, rpy_deg: [1, 2, 3]}}]", tmp_path)
    turn = frametool.Transform.of(0.0, 0.0, 0.0, *frametool.Rotation.from_rpy([math.radians(each) for each in (1, 2, 3)]).components)
    wanted = (frametool.earth_pose(48.1, 11.5, 520.0, axes) @ turn).components
    found = tree.lookup("ecef", "map").components
    assert found[:3] == pytest.approx(wanted[:3], rel=2 * EPS)
    assert apart(found[3:], wanted[3:]) <= 4 * EPS


@pytest.mark.parametrize("root", ["ecef", "earth"])
def test_a_place_may_be_nested_under_the_earth(root: str, tmp_path: Path) -> None:
    tree = of(f"frames: {{{root}: {{map: {{{AT}, axes: enu, children: {{x: {{xyz: [0, 0, 1]}}}}}}}}}}", tmp_path)
    assert tree.frames == (root, "map", "x")
    assert frametool.lla_from_ecef(tree.lookup(root, "x").xyz) == pytest.approx((48.1, 11.5, 521.0), abs=1e-8)


def test_axes_beside_samples_are_those_of_all_that_say_none(tmp_path: Path) -> None:
    samples = f"[{{stamp: 0, {PLACE}}}, {{stamp: 1, {PLACE}, axes: ned}}, {{stamp: 2, {AT}, rpy_deg: [0, 0, 90]}}]"
    car = of(f"[{{name: car, axes: enu, samples: {samples}}}]", tmp_path)
    for at_s, axes in ((0, "enu"), (1, "ned")):
        wanted = frametool.earth_pose(48.1, 11.5, 520.0, axes).components
        assert apart(car.lookup("ecef", "car", at_s * 10**9).components[3:], wanted[3:]) <= 4 * EPS
    turn = car.lookup("car", "ecef", 0) @ car.lookup("ecef", "car", 2 * 10**9)
    assert turn.rotation.as_rpy() == pytest.approx((0.0, 0.0, math.pi / 2), abs=1e-15)


UNSAID = "a pose at lat, lon does not state the axes of its rotation; axes: enu, ned, grid or ecef"


@pytest.mark.parametrize(
    ("tree", "message"),
    [
        (f"[{{name: map, {AT}}}]", UNSAID),
        (f"[{{name: map, {PLACE}}}]", UNSAID),
        (f"[{{name: map, {ECEF}}}]", UNSAID),
        (f"[{{name: map, {PLACE}, rpy: [0, 0, 1]}}]", UNSAID),
        (f"[{{name: map, samples: [{{stamp: 0, {PLACE}}}]}}]", UNSAID),
        (f"[{{name: map, parent: base, {PLACE}, axes: enu}}]", "lat places a frame in ecef; parent is 'base'"),
        (f"[{{name: map, parent: utm, {PLACE}, axes: enu}}]", "utm is neither rigid nor a parent; place the frame"),
        (f"frames: {{base: {{map: {{{AT}, axes: enu}}}}}}", "at places a frame in ecef; its parent is 'base'"),
        (
            f"[{{name: map, parent: base, axes: enu, samples: [{{stamp: 0, {PLACE}}}]}}]",
            "lat places a frame in ecef; its parent is 'base'",
        ),
        (f"[{{name: map, {AT}, axes: enu, inverse: true}}]", "a position on the Earth is in ecef; remove inverse"),
        (f"[{{name: map, {AT}, axes: enu, scale: 2}}]", "scale: a similarity, not a pose"),
        (f"[{{name: map, {PLACE}, {UTM}, axes: enu}}]", "two positions in one entry disagree by"),
        (f"[{{name: map, {AT}, axes: enu, heading_deg: 3, rpy: [0, 0, 1]}}]", "a heading is a rotation; keep one"),
        ("[{name: a, parent: ecef, axes: enu, samples: [{stamp: 0, xyz: [1, 2, 3]}]}]", "axes next to samples are for"),
        (
            f"[{{name: a, axes: enu, sigma: {{xyz: 0.1}}, samples: [{{stamp: 0, {PLACE}}}]}}]",
            "axes turn from place to place; one covariance for all is in no axes",
        ),
    ],
)  # fmt: skip
def test_what_is_no_frame_on_the_earth_is_refused(tree: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(FrametoolError, match=re.escape(message)):
        of(tree, tmp_path)


def test_a_covariance_turns_with_the_axes_and_back(run: Callable[..., Any], tmp_path: Path) -> None:
    given = f"[{{name: map, {AT}, axes: enu, rpy_deg: [1, 2, 3], sigma: {{xyz: [0.1, 0.2, 0.3], rpy_deg: [1, 2, 3]}}}}]"
    entries = of(given, tmp_path).covariance("ecef", "map")
    turn = frametool.earth_pose(48.1, 11.5, 520.0).rotation.as_matrix().tolist()
    for row, column in ((0, 0), (0, 1), (1, 2), (2, 2)):
        wanted = sum(turn[row][axis] * turn[column][axis] * sigma**2 for axis, sigma in enumerate((0.1, 0.2, 0.3)))
        assert entries[6 * row + column] == pytest.approx(wanted, abs=1e-15)
    back = of(run("tree", "-", "--to", "lla", stdin=given).out, tmp_path)
    assert back.covariance("ecef", "map") == pytest.approx(entries, abs=1e-15)


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_a_tree_is_written_by_xyz_to_the_same_bits(form: str, run: Callable[..., Any], tmp_path: Path) -> None:
    before = of(SITE, tmp_path)
    after = of(run("tree", "-", "-f", form, stdin=SITE).out, tmp_path)
    assert [(*each[:2], each[2].components) for each in before.edges()] == [
        (*each[:2], each[2].components) for each in after.edges()
    ]


@pytest.mark.parametrize("axes", ["", "enu", "ned", "grid", "ecef"])
@pytest.mark.parametrize("to", ["lla", "utm", "lla,rpy_deg", "lla,utm", "lla,ecef", "ecef,lla"])
def test_a_tree_written_by_places_reads_back_within_two_eps(
    to: str, axes: str, run: Callable[..., Any], tmp_path: Path
) -> None:
    given = json.dumps(golden(utm="utm" in to or axes == "grid"))
    out = run("tree", "-", "--to", to, *(["--local-axes", axes] if axes else []), stdin=given).out
    before, after = of(given, tmp_path), of(out, tmp_path)
    for frame in before.frames[1:]:
        one, other = (tree.lookup("ecef", frame).components for tree in (before, after))
        distance = sum(part * part for part in one[:3]) ** 0.5
        assert other[:3] == pytest.approx(one[:3], rel=0, abs=2 * EPS * distance)
        assert apart(one[3:], other[3:]) <= 4 * EPS


def test_only_frames_of_the_earth_are_written_by_places_and_samples_too(run: Callable[..., Any]) -> None:
    entries = json.loads(run("tree", "-", "--to", "utm", "-f", "json", stdin=SITE).out)["frames"]
    assert [[*each][:3] for each in entries] == [["name"], *[["name", "parent", "at"]] * 3, ["name", "parent", "xyz"]]
    assert {each["axes"] for each in entries[1:4]} == {"grid"}
    moving = f"[{{name: car, axes: enu, samples: [{{stamp: 0, {PLACE}}}, {{stamp: 1, {PLACE}}}]}}]"
    (_, car) = json.loads(run("tree", "-", "--to", "lla", "-f", "json", stdin=moving).out)["frames"]
    assert [[*each] for each in car["samples"]] == [["stamp_ns", "at", "axes", "quaternion"]] * 2


def test_a_drawing_says_where_frames_stand(run: Callable[..., Any]) -> None:
    assert run("tree", "-", "-f", "text", stdin=SITE).out == (
        "ecef\n"
        "├ map    lat 48.1 lon 11.5 alt 520                  enu rpy_deg 0 0 0\n"
        "├ site   lat 48.137222106 lon 11.575555999 alt 519  enu rpy_deg 0 0 28.08\n"
        "│ └ gps  xyz 1 2 3                                  rpy_deg 0 0 10\n"
        "└ plane  lat 48.2 lon 11.6 alt 3000                 enu rpy_deg -180 0 -30\n"
    )
    assert "alt" not in run("tree", "-", "-f", "text", stdin="frames: {earth: {base: {xyz: [1, 2, 3]}}}").out


@pytest.mark.parametrize(
    "arguments",
    [
        ("tree", "t.yaml", "--to", "lla", "-f", "csv"),
        ("tree", "t.yaml", "--to", "enu", "--origin", "{lat: 48, lon: 11, alt: 0}"),
        ("lookup", "t.yaml", "ecef", "gps", "--to", "utm", "--covariance"),
        ("echo", "t.yaml", "ecef", "gps", "--to", "lla"),
    ],
)
def test_places_where_there_are_none_are_misused(arguments: tuple[str, ...], run: Callable[..., Any]) -> None:
    found = run(*arguments, files={"t.yaml": SITE})
    assert (found.status, found.out, found.err.count("\n")) == (2, "", 1)


@pytest.mark.parametrize("form", ["text", "json", "csv"])
@pytest.mark.parametrize("command", ["lookup", "echo"])
def test_what_is_not_in_ecef_has_no_place(command: str, form: str, run: Callable[..., Any]) -> None:
    arguments = ("-f", form) if (command, form) != ("echo", "text") else ("-f", "yaml")
    found = run(command, "t.yaml", "map", "gps", "--to", "lla", *arguments, files={"t.yaml": SITE})
    assert (found.status, found.out) == (1, "")
    assert "--to lla wants poses in ecef: this one is in 'map'" in found.err


def test_rows_get_places_where_their_target_is_the_earth(run: Callable[..., Any]) -> None:
    files = {"t.yaml": SITE, "rows.csv": "a,src,tgt\n1,map,ecef\n2,map,earth\n3,gps,map\n"}
    columns = ("--source-column", "src", "--target-column", "tgt")
    found = run("lookup", "t.yaml", "-i", "rows.csv", *columns, "--to", "lla", "--on-error", "skip", files=files)
    assert found.status == 3
    assert found.out.splitlines()[0] == "a,src,tgt,lat,lon,alt,axes,qx,qy,qz,qw"
    assert [line.split(",")[6] for line in found.out.splitlines()[1:]] == ["enu", "enu"]
    assert "rows.csv:4: --to lla wants poses in ecef: this one is in 'map' (row skipped)" in found.err


def test_rows_of_a_target_without_places_are_refused_before_their_header(run: Callable[..., Any]) -> None:
    found = run("lookup", "t.yaml", "map", "--source-column", "src", "--to", "lla", files={"t.yaml": SITE}, stdin="src\ngps\n")
    assert (found.status, found.out) == (1, "")
    assert "--to lla wants poses in ecef: this one is in 'map'" in found.err


# --- one frame by two names ---

EARTH, OTHER = "frames: {earth: {map: {xyz: [4e6, 1e6, 4e6]}}}", "frames: {ecef: {site: {xyz: [4e6, 1e6, 5e6]}}}"


@pytest.mark.parametrize(("texts", "root"), [((EARTH, OTHER), "earth"), ((OTHER, EARTH), "ecef")])
def test_the_name_that_comes_first_holds_and_both_find_it(texts: tuple[str, str], root: str, tmp_path: Path) -> None:
    tree = of(texts[0], tmp_path, texts[1])
    assert tree.roots == (root,)
    assert {tree.lookup(name, "map").components for name in ("ecef", "earth")} == {(4e6, 1e6, 4e6, 0, 0, 0, 1)}
    assert tree.path("map", "ecef") == tree.path("map", "earth") == ["map", root]
    assert tree.lookup("ecef", "earth").components == (0, 0, 0, 0, 0, 0, 1)
    assert tree.track("ecef") is tree.parent("earth") is None


def test_python_builds_one_earth_by_either_name() -> None:
    tree, pose = frametool.FrameTree(), frametool.earth_pose(48.1, 11.5)
    tree.add("earth", "map", pose)
    tree.add("ecef", "site", pose)
    assert tree.roots == ("earth",)
    buffer = frametool.TransformBuffer()
    buffer.insert("ecef", "map", pose, 0)
    buffer.insert("earth", "map", pose, 10)
    assert (buffer.frames, buffer.latest("earth", "map")) == (("map", "ecef"), 10)
    assert buffer.lookup_many("earth", "map", [0, 5]).shape == (2,)


def test_an_edge_between_the_two_names_is_nothing_or_a_mistake(tmp_path: Path) -> None:
    edge = "{{frames: [{{name: ecef, parent: earth, xyz: [{}, 0, 0]}}, {{name: map, parent: ecef, xyz: [1, 0, 0]}}]}}"
    with pytest.warns(FrametoolWarning, match="'earth' and 'ecef' are one frame; the edge between them is left out"):
        assert of(edge.format(0), tmp_path).frames == ("earth", "map")
    with pytest.raises(FrametoolError, match="'earth' and 'ecef' are one frame, this edge puts one elsewhere"):
        of(edge.format(1), tmp_path)


def test_diff_and_check_take_both_names_for_one(run: Callable[..., Any]) -> None:
    files = {"a.yaml": SITE, "b.yaml": SITE.replace("ecef", "earth"), "c.yaml": f"{EARTH}\n---\n{OTHER}\n"}
    assert run("diff", "a.yaml", "b.yaml", files=files)[:2] == (0, "")
    for name in files:
        assert run("check", name).out == ""
