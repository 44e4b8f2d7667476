"""`project` and `unproject`: the goldens through the command, rows of every form, along moving frames, what is refused."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    Run = Callable[..., Any]

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "camera.json").read_text())
EXAMPLES = Path(__file__).parent.parent.parent / "examples"
RIG, YARD = str(EXAMPLES / "cameras.yaml"), str(EXAMPLES / "yard.csv")
FORMS = {each["name"]: each for each in GOLDEN["forms"]}
READ = [name for name, each in FORMS.items() if "refused" not in each and each["camera"]]
PINHOLE = "{model: pinhole, K: [100, 100, 31.5, 23.5], size: [64, 48]}"
NONE = (math.nan, math.nan)


def table(points: Any, names: str = "x,y,z") -> str:
    return "\n".join([names, *(",".join(map(repr, each)) for each in points), ""])


def columns(text: str, *names: str) -> list[list[float]]:
    """Return columns of a table, nan where cells are empty."""
    head, *rows = (line.split(",") for line in text.splitlines())
    return [[float(row[head.index(name)] or "nan") for name in names] for row in rows]


def check(text: str, pixels: Any) -> None:
    found = columns(text, "u", "v")
    assert len(found) == len(pixels)
    for row, pixel in zip(found, pixels, strict=True):
        assert row == pytest.approx(pixel or NONE, rel=1e-14, abs=1e-10, nan_ok=True)


@pytest.mark.parametrize("name", READ)
def test_cameras_of_every_form(run: Run, name: str) -> None:
    case = FORMS[name]
    done = run("project", "--camera", case["camera"], *case["args"], stdin=table(case["points"]), files=case["files"])
    assert done.status == 0
    check(done.out, case["pixels"])
    assert ("no size" in done.err) == bool(case.get("sizeless"))


@pytest.mark.parametrize("name", [name for name, each in FORMS.items() if "tree" in each])
def test_trees_bring_their_cameras(run: Run, name: str) -> None:
    case, tree = FORMS[name], FORMS[name]["tree"]
    arguments = [tree["file"], tree["target"], tree["source"]]
    done = run("project", *arguments, stdin=table(tree["points"]), files=case["files"])
    assert done.status == 0
    check(done.out, tree["pixels"])


@pytest.mark.parametrize("form", ["yaml", "json", "text", "csv", "urdf"])
def test_a_tree_in_a_format_without_cameras_says_what_it_leaves_out(run: Run, form: str) -> None:
    tree = "frames: [{name: c, parent: b, xyz: [1, 2, 3], camera: {K: [500, 500, 320, 240]}}]"
    done = run("tree", "-", "-f", form, stdin=tree)
    assert ("500" in done.out) == (form in ("yaml", "json"))
    assert (f"warning: {form}: intrinsics of cameras left out\n" in done.err) == (form in ("csv", "urdf"))


def test_a_size_may_be_given_for_the_camera_of_a_tree(run: Run) -> None:
    files = {"bare.json": FORMS["transforms.json camera_angle_x, --size"]["files"]["bare.json"]}
    assert "needs --size W,H" in run("project", "bare.json", "camera", "world", "1", "2", "3", files=files).err
    assert run("project", "bare.json", "camera", "world", "--size", "1600,1200", "1", "2", "3").status == 0
    half = run("project", RIG, "cam_front", "lidar", "--size", "160,120", "-f", "json", "5", "0", "-1")
    u, v = json.loads(run("project", RIG, "cam_front", "lidar", "-f", "json", "5", "0", "-1").out)["pixel"]
    assert json.loads(half.out)["pixel"] == pytest.approx([0.5 * (u + 0.5) - 0.5, 0.5 * (v + 0.5) - 0.5])
    assert half.err == f"frametool: warning: {RIG}: K is scaled from 320 x 240 to 160 x 120\n"


@pytest.mark.parametrize("name", [name for name, each in FORMS.items() if "undistort" in each])
def test_undistorted_pixels_are_those_of_k_or_of_r_and_p(run: Run, name: str) -> None:
    case = FORMS[name]
    raw = table([row[0] for row in case["undistort"]], "u,v")
    for more, at in ((["--rectified"], 1), ([], 2)):
        done = run("unproject", "--camera", case["camera"], "--undistort", *more, stdin=raw, files=case["files"])
        check(done.out, [row[at] for row in case["undistort"]])
        assert done.out.startswith("u,v\n")


@pytest.mark.parametrize("name", [name for name, each in FORMS.items() if "refused" in each])
def test_cameras_that_cannot_be_read_are_refused_in_one_line(run: Run, name: str) -> None:
    case = FORMS[name]
    done = run("project", "--camera", case["camera"], *case["args"], "0", "0", "1", files=case["files"])
    assert (done.status, done.out, done.err.count("\n")) == (1, "", 1)
    assert all(re.search(word, done.err) for word in case["refused"])


@pytest.mark.parametrize("case", GOLDEN["trees"], ids=lambda case: case["camera"])
def test_through_trees_to_pixels_to_the_ground_and_back(run: Run, case: dict[str, Any]) -> None:
    files = {"rig.yaml": case["text"]}
    done = run("project", "rig.yaml", "camera_optical", "lidar", stdin=table(case["points"]), files=files)
    check(done.out, case["pixels"])
    depths = columns(done.out, "depth", "in_image")
    assert [row[0] for row in depths] == pytest.approx(case["depths"], abs=1e-11)
    assert [bool(row[1]) for row in depths] == case["in_image"]
    way = ["unproject", "rig.yaml", "map", "camera_optical"]
    pixels = table([row[0] for row in case["ground"]], "u,v")
    for more, at in (([], 1), (["--height", str(case["ground_height"])], 2)):
        found = columns(run(*way, "--ground", "map", *more, stdin=pixels).out, "x", "y", "z")
        for row, point in zip(found, (row[at] for row in case["ground"]), strict=True):
            assert row == pytest.approx(point or [math.nan] * 3, abs=1e-8, nan_ok=True)
    for name, at in (("depth", 1), ("range", 4)):
        given = table([(*row[0], row[at]) for row in case["depth"]], f"u,v,{name}")
        found = columns(run(*way, stdin=given).out, "x", "y", "z")
        assert [value for row in found for value in row] == pytest.approx([value for row in case["depth"] for value in row[3]], abs=1e-10)
    rays = run(*way, stdin=table([row[0] for row in case["rays_in_map"]], "u,v")).out
    for row, (_, ray) in zip(columns(rays, "ray_x", "ray_y", "ray_z"), case["rays_in_map"], strict=True):
        assert row == pytest.approx(ray, abs=1e-12)
    assert columns(rays, "origin_x", "origin_y", "origin_z")[0][:2] == pytest.approx(case["centre_in_map"][:2])


def test_an_argument_is_a_row(run: Run) -> None:
    (row,) = columns(run("project", "--camera", PINHOLE, stdin="x,y,z\n0.1,-0.2,3\n").out, "u", "v", "depth")
    given = json.loads(run("project", "--camera", PINHOLE, "0.1", "-0.2", "3", "-f", "json").out)
    assert given == {"point": [0.1, -0.2, 3.0], "pixel": row[:2], "depth": row[2], "in_image": True}
    back = json.loads(run("unproject", "--camera", PINHOLE, *map(repr, row), "-f", "json").out)
    assert back["point"] == pytest.approx([0.1, -0.2, 3.0])
    assert run("project", RIG, "cam_front", "{frame: lidar, point: [5, 1, 0]}", "-f", "json").out.startswith('{"frame": "lidar"')


def test_records_keep_what_they_say(run: Run) -> None:
    lines = '{"id": 1, "frame": "lidar", "point": [5, 0, -1]}\n{"id": 2, "frame": "map", "point": [-5, 0, 0]}\n'
    done = run("project", RIG, "cam_front", stdin=lines)
    first, second = map(json.loads, done.out.splitlines())
    assert [*first] == ["id", "frame", "point", "camera", "pixel", "depth", "in_image"]
    assert (first["camera"], second["pixel"], second["in_image"]) == ("cam_front", None, False)
    assert done.err == "frametool: 2 points: 1 in the image, 1 behind the camera\n"
    cells = run("project", RIG, "cam_front", "-f", "csv", stdin=lines).out.splitlines()
    assert cells[0] == "id,frame,x,y,z,u,v,depth,in_image"
    assert cells[1].endswith(",1")
    assert cells[2].split(",")[5:7] == ["", ""]


def test_rows_may_name_their_frame_in_a_column(run: Run) -> None:
    given = "sensor,x,y,z\nlidar,5,0,-1\nmap,6,1,0.5\n"
    found = run("project", RIG, "cam_front", "--frame-column", "sensor", stdin=given).out.splitlines()[1:]
    for row, frame in zip(found, ("lidar", "map"), strict=True):
        alone = run("project", RIG, "cam_front", frame, stdin=table([[*map(float, row.split(",")[1:4])]])).out
        assert alone.splitlines()[1].split(",")[3:] == row.split(",")[4:]


MOVING = """\
transforms:
- {header: {stamp: {sec: 0, nanosec: 0}, frame_id: map}, child_frame_id: cam,
   transform: {translation: {x: 0, y: 0, z: 1}, rotation: {x: 1, y: 0, z: 0, w: 0}}}
- {header: {stamp: {sec: 10, nanosec: 0}, frame_id: map}, child_frame_id: cam,
   transform: {translation: {x: 10, y: 0, z: 1}, rotation: {x: 1, y: 0, z: 0, w: 0}}}
"""


def test_each_row_at_its_own_time_and_all_at_one(run: Run) -> None:
    files, rows = {"move.yaml": MOVING}, "t,x,y,z\n2,2,0,0\n4,4,0,0\n5,5.1,0,0\n"
    own = run("project", "move.yaml", "cam", "map", "--camera", PINHOLE, "--time-column", "t", stdin=rows, files=files)
    assert [row[0] for row in columns(own.out, "u")] == pytest.approx([31.5, 31.5, 41.5])
    fixed = run("project", "move.yaml", "cam", "map", "--camera", PINHOLE, "--at", "4", stdin=rows)
    assert [row[0] for row in columns(fixed.out, "u")] == pytest.approx([-168.5, 31.5, 141.5])
    pixels = "t,u,v\n2,31.5,23.5\n4,31.5,23.5\n12,31.5,23.5\n"
    way = ["unproject", "move.yaml", "map", "cam", "--camera", PINHOLE, "--ground", "map"]
    ground = run(*way, "--time-column", "t", "--on-error", "skip", stdin=pixels)
    assert columns(ground.out, "x", "y", "z") == [pytest.approx([t, 0.0, 0.0], abs=1e-12) for t in (2.0, 4.0)]
    assert (ground.status, "12" in ground.err) == (3, True)
    latest = columns(run(*way, stdin=pixels).out, "x")
    assert latest == [[pytest.approx(10.0)]] * 3


def test_clouds_are_answered_as_csv(run: Run) -> None:
    assert run("convert", "-i", YARD, "--columns", "x,y,z", "-f", "pcd", "-o", "yard.pcd").status in (0, 1)
    moved = run("apply", "--transform", "{xyz: [0, 0, 0]}", "-i", YARD, "-o", "yard.ply", "-f", "ply")
    assert moved.status == 0
    cloud, rows = (run("project", RIG, "cam_front", "lidar", "-i", path) for path in ("yard.ply", YARD))
    assert columns(cloud.out, "u", "v", "depth", "in_image") == columns(rows.out, "u", "v", "depth", "in_image")
    assert cloud.err.endswith(rows.err)


def test_the_count_says_what_became_of_points(run: Run) -> None:
    camera = "{model: plumb_bob, K: [350, 350, 320, 240], D: [-0.4, 0.05, 0, 0], size: [640, 480]}"
    points = [(0.0, 0.0, 1.0), (0.9, 0.0, 1.0), (3.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)]
    done = run("project", "--camera", camera, stdin=table(points))
    assert done.err == "frametool: 5 points: 2 in the image, 2 behind the camera, 1 beyond the model (46.0 deg)\n"
    most = run("project", "--camera", camera, stdin=table([*points, (0.0, 1.0, -1.0), (0.0, 1.0, -1.0)]))
    assert "most are behind: --camera-axes" in most.err
    assert run("project", "--camera", camera, stdin=table([(0.0, 0.0, -1.0)])).err == "frametool: 1 point: 1 behind the camera\n"
    assert run("project", "--camera", camera, "--quiet", stdin=table(points)).err == ""


def test_pixels_without_a_depth_are_not_behind_the_camera(run: Run) -> None:
    camera = "{K: [350, 350, 320, 240], size: [640, 480]}"
    done = run("unproject", "--camera", camera, stdin="u,v,depth\n320,240,2\n1,5,\n3,4,\n5,5,\n")
    assert (done.status, done.err) == (0, "")
    skipped = run("unproject", "--camera", camera, "--on-error", "null", stdin="u,v,depth\n1,5,-1\n1,5,nan\n")
    assert skipped.err.endswith("frametool: 1 pixel: 1 behind the camera\n")


def test_axes_of_the_camera_are_those_of_the_tree_or_as_said(run: Run) -> None:
    as_said = {
        "optical": ("0.1", "0.2", "2"), "opengl": ("0.1", "-0.2", "-2"), "flu": ("2", "-0.1", "-0.2"),
    }  # fmt: skip
    found = {run("project", "--camera", PINHOLE, "--camera-axes", axes, *xyz, "-f", "json").out.partition('"pixel"')[2] for axes, xyz in as_said.items()}
    assert len(found) == 1


def test_pixels_may_count_from_the_corner(run: Run) -> None:
    usual, corner = (run("project", "--camera", PINHOLE, "--first-pixel", first, "0", "0", "1", "-f", "json") for first in ("0", "0.5"))
    assert (json.loads(usual.out)["pixel"], json.loads(corner.out)["pixel"]) == ([31.5, 23.5], [32.0, 24.0])


def test_prefix_makes_room_beside_columns_of_these_names(run: Run) -> None:
    once = run("project", "--camera", PINHOLE, stdin="x,y,z\n0,0,1\n").out
    again = run("project", "--camera", PINHOLE, stdin=once)
    assert (again.status, "--prefix" in again.err) == (2, True)
    assert run("project", "--camera", PINHOLE, "--prefix", "b_", stdin=once).out.startswith("x,y,z,u,v,depth,in_image,b_u,b_v")
    assert "b_pixel" in run("project", "--camera", PINHOLE, "--prefix", "b_", stdin='{"point": [0, 0, 1], "pixel": 1}\n').out


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["project", "rig.yaml", "cam_front", "lidar", "--camera", "none.yaml"], 5, "none.yaml"),
        (["project", "rig.yaml", "base_link", "lidar", "1", "2", "3"], 1, "base_link has no intrinsics; --camera FILE.*cameras: cam_front"),
        (["project", "rig.yaml", "cam_frond", "lidar", "1", "2", "3"], 4, "did you mean 'cam_front'"),
        (["project", "rig.yaml"], 2, "name TREE and CAMERA"),
        (["project", "--camera", PINHOLE, "{vector: [1, 2, 3]}"], 1, "vector has no pixel"),
        (["project", "--camera", PINHOLE, "1", "2"], 2, "three numbers"),
        (["project", "--camera", "{K: [0, 1, 1, 1]}", "1", "2", "3"], 1, "fx is 0"),
        (["project", "--camera", "{K: [1, 1, 1, .nan]}", "1", "2", "3"], 1, "finite|nan"),
        (["project", "--camera", "{model: plumb_bob, K: [1, 1, 1, 1], D: [1, 2, 3]}", "1", "2", "3"], 1, "4 or 5 coefficients in D, not 3"),
        (["project", "--camera", "{K: [1, 1, 1, 1], alpha: 2, beta: 1}", "1", "2", "3"], 1, "alpha 2 is beyond 0 .. 1"),
        (["project", "--camera", PINHOLE, "--size", "64x48", "1", "2", "3"], 2, "W,H"),
        (["project", "--camera", PINHOLE, "--size", "70,48", "1", "2", "3"], 1, "70 x 48 is another shape than 64 x 48"),
        (["project", "--camera", PINHOLE, "--rectified", "1", "2", "3"], 1, "no P"),
        (["project", "--camera", PINHOLE, "--from-first", "1", "2", "3"], 2, "--from-first needs --rectified"),
        (["project", "--camera", PINHOLE, "--image", "rig.yaml", "-o", "x.svg", "1", "2", "3"], 1, "neither a PNG nor a JPEG"),
        (["project", "--camera", PINHOLE, "--image", "rig.yaml", "-o", "x.gif", "1", "2", "3"], 1, "svg, .html, .png"),
        (["project", "--camera", PINHOLE, "--image", "rig.yaml", "1", "2", "3"], 2, "--image needs --output"),
        (["unproject", "--camera", PINHOLE, "--depth", "1", "--range", "2", "1", "2"], 2, "exclude each other"),
        (["unproject", "--camera", PINHOLE, "--depth", "1", "--ground", "map", "1", "2"], 2, "exclude each other"),
        (["unproject", "--camera", PINHOLE, "--ground", "map", "1", "2"], 2, "needs TREE"),
        (["unproject", "--camera", PINHOLE, "1", "2", "3", "4"], 2, "U V or U V DEPTH, found 4"),
        (["unproject", "rig.yaml", "map"], 2, "name TREE, TARGET and CAMERA"),
        (["project", "-5", "1", "2"], 2, "name TREE and CAMERA, or give --camera"),
        (["project", "--camera", "{K: [1, 1, 1, 1], D: [1, 2, 3]}", "1", "2", "3"], 1, "no model has 3 coefficients in D"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_one_line(run: Run, arguments: list[str], status: int, words: str) -> None:
    done = run(*arguments, files={"rig.yaml": Path(RIG).read_text()})
    assert (done.status, done.out, done.err.count("\n")) == (status, "", 1)
    assert re.search(words, done.err), done.err


def test_rows_without_pixels_are_refused(run: Run) -> None:
    for given in ("a,b\n1,2\n", '{"a": 1}\n'):
        done = run("unproject", "--camera", PINHOLE, stdin=given)
        assert (done.status, done.out, "u and v" in done.err) == (1, "", True)


def circles(svg: str) -> list[list[float]]:
    return [[float(each) for each in found] for found in re.findall(r'<circle[^>]* cx="([^"]*)" cy="([^"]*)"', svg)]


def test_the_overlay_has_a_circle_at_each_pixel_in_the_image_far_ones_first(run: Run, tmp_path: Path) -> None:
    way, image = ["project", RIG, "cam_front", "lidar", "-i", YARD], str(EXAMPLES / "yard.png")
    rows = columns(run(*way).out, "depth", "u", "v", "in_image")
    wanted = [[round(u, 3), round(v, 3)] for _, u, v, inside in sorted(rows, reverse=True) if inside]
    done = run(*way, "--image", image, "-o", "o.svg")
    svg = (tmp_path / "o.svg").read_text()
    assert (done.status, done.out, circles(svg)) == (0, "", wanted)
    assert 'viewBox="-0.5 -0.5 320 240"' in svg
    assert "695 points over" in done.err
    run(*way, "--image", image, "-o", "o.html")
    assert circles((tmp_path / "o.html").read_text()) == wanted
    assert run(*way, "--image", image, "-o", "o.svg").status == 5


def test_an_overlay_of_many_points_is_thinned_and_says_so(run: Run, tmp_path: Path) -> None:
    points = table([(0.001 * (at % 300) - 0.15, 0.1, 1.0 + at * 1e-5) for at in range(50_000)])
    done = run("project", RIG, "cam_front", "--camera-axes", "optical", "cam_front", "--image", str(EXAMPLES / "yard.png"), "-o", "o.svg", stdin=points)
    assert len(circles((tmp_path / "o.svg").read_text())) == 12_500
    assert "1 in 4 of 50000" in done.err


def test_the_cloud_of_the_example_lies_on_what_it_belongs_to(run: Run) -> None:
    """The colour of the picture at each pixel is that of the thing that the point was measured on."""
    data = (EXAMPLES / "yard.png").read_bytes()
    packed = data[data.index(b"IDAT") + 4 : data.index(b"IEND") - 8]  # rows are as they are, each behind a 0
    image = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(240, -1)[:, 1:].reshape(240, 320, 3).astype(int)
    out = run("project", RIG, "cam_front", "lidar", "-i", YARD).out
    rows = [(line.split(",")[3], row) for line, row in zip(out.splitlines()[1:], columns(out, "u", "v", "in_image"), strict=True)]
    for thing, more, less, most in (("crate", 0, 2, 20), ("cabinet", 2, 0, 20), ("post", 1, 2, 5)):
        pixels = [image[round(v), round(u)] for name, (u, v, inside) in rows if name == thing and inside]
        assert sum(pixel[more] > pixel[less] + 40 for pixel in pixels) > max(0.85 * len(pixels), most)


def test_a_point_loads_no_numpy() -> None:
    code = "import sys; from frametool.cli import run; run(sys.argv[1:]); sys.exit('numpy' in sys.modules)"
    for arguments in (["project", "--camera", PINHOLE, "0", "0", "1"], ["unproject", RIG, "map", "cam_front", "100", "200"]):
        assert subprocess.run([sys.executable, "-c", code, *arguments], check=False, capture_output=True).returncode == 0


def test_pixels_of_messages_are_seen_at_the_stamps_of_their_headers(run: Run) -> None:
    line = '{{"header": {{"stamp": {{"sec": {}, "nanosec": 0}}, "frame_id": "cam"}}, "pixel": [31.5, 23.5]}}\n'.format
    way = ["unproject", "move.yaml", "map", "cam", "--camera", PINHOLE, "--ground", "map"]
    found = run(*way, stdin=line(3) + line(7) * 40, files={"move.yaml": MOVING}).out.splitlines()
    assert [json.loads(row)["point"][0] for row in found] == pytest.approx([3.0, *[7.0] * 40])


def test_points_of_a_bag_in_the_camera_of_its_topic(run: Run, tmp_path: Path) -> None:
    recorded = pytest.importorskip("recorded")
    made, info = recorded.Maker("mcap"), "sensor_msgs/msg/CameraInfo"
    k, r, p = ([500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0], [1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0], [500.0, 0, 320.0, 0, 0, 500.0, 240.0, 0, 0, 0, 1.0, 0])
    numbers = (np.array(each) for each in ([0.0] * 5, k, r, p))
    region = made.part("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, 0)
    point = made.part("geometry_msgs/msg/PointStamped", made.header("lidar", 5), made.part("geometry_msgs/msg/Point", 0.3, -0.6, 2.0))
    bag = recorded.write(tmp_path / "run", "mcap", [
        recorded.Sent("/tf_static", *made.transforms(*(("base", name, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), 0) for name in ("cam", "lidar"))), 1),
        recorded.Sent("/info", info, made.part(info, made.header("cam", 5), 480, 640, "plumb_bob", *numbers, 0, 0, region), 2),
        recorded.Sent("/point", "geometry_msgs/msg/PointStamped", point, 3),
    ])  # fmt: skip
    for way in (["--camera", f"{bag}:/info"], [str(bag), "cam"]):
        done = run("project", *way, "-i", str(bag), "--topic", "/point")
        assert (json.loads(done.out)["pixel"], done.err) == ([395.0, 90.0], "frametool: 1 point: 1 in the image\n")


def test_what_has_no_pixel_has_no_ray(run: Run) -> None:
    points = '{"point": [0, 0, -1], "id": 1}\n{"point": [0, 0, 1], "id": 2}\n'
    projected = run("project", "--camera", PINHOLE, stdin=points).out
    back = [json.loads(row) for row in run("unproject", "--camera", PINHOLE, "--prefix", "b_", stdin=projected).out.splitlines()]
    assert [row["b_point"] for row in back] == [None, [0.0, 0.0, 1.0]]


def test_what_a_record_says_beside_its_point_stays(run: Run) -> None:
    sure = '{"point": [0, 0, 1], "sigma": {"xyz": 0.1}}\n'
    assert run("project", "--camera", PINHOLE, stdin=sure).out.startswith(sure[:-2])
    for form in ("text", "yaml"):
        assert run("project", "--camera", PINHOLE, "0", "0", "1", "-f", form).out.splitlines()[1] == "pixel: [31.5, 23.5]"


def test_the_shell_is_offered_the_cameras_of_a_file(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_FRAMETOOL_COMPLETE", "words")
    offered = run(f"frametool project --camera {EXAMPLES}/camchain.yaml:").out.splitlines()
    assert [row.split("\t")[1].rpartition(":")[2] for row in offered] == ["cam0", "cam1"]
