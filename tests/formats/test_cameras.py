"""Intrinsics: every form against 40 digits, alone and in a tree; names, what is assumed and told, and what is refused."""

from __future__ import annotations

import contextlib
import json
import pickle
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import recorded

import frametool
from frametool.errors import FileProblem, FormatError, FrametoolWarning, UnknownFrame, ValueInvalid

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Run = Callable[..., Any]

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "camera.json").read_text())
FORMS = {each["name"]: each for each in GOLDEN["forms"]}
TREES = {each["camera"]: each for each in GOLDEN["trees"]}
ALONE = [name for name, each in FORMS.items() if each["camera"] and "refused" not in each]
IN_TREES = [name for name, each in FORMS.items() if "file" in (each.get("tree") or {})]
PIXEL = 1e-10
INTRINSICS = [502.82, 528.2, 316.62, 234.22]
OURS = {"model": "plumb_bob", "K": INTRINSICS, "D": [-0.3, 0.1, 0.0, 0.0], "size": [640, 480]}


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FrametoolWarning)
        yield


def put(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def camera_of(folder: Path, form: dict[str, Any]) -> Any:
    """Read the camera of a golden form with the arguments that it says."""
    put(folder, form["files"])
    given = form["camera"].strip("'")
    options = dict(zip(form["args"], form["args"][1:], strict=False))
    size = tuple(map(int, options["--size"].split(","))) if "--size" in options else None
    camera = frametool.load_camera(
        given if given.startswith("{") else f"{folder}/{given}", model=options.get("--model"), size=size
    )
    return camera.rectified(from_first="--from-first" in form["args"]) if "--rectified" in form["args"] else camera


@pytest.mark.parametrize("name", ALONE)
def test_golden_pixels_of_a_camera_from_a_file(name: str, tmp_path: Path) -> None:
    form = FORMS[name]
    with quiet():
        camera = camera_of(tmp_path, form)
    np.testing.assert_allclose(camera.project(form["points"])[0], form["pixels"], rtol=0, atol=PIXEL)
    assert (camera.model, camera.size) == (form["model"], None if form["size"] is None else tuple(form["size"]))
    np.testing.assert_allclose(camera.numbers[:4], form["K"], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", IN_TREES)
def test_golden_pixels_of_a_camera_in_its_tree(name: str, tmp_path: Path) -> None:
    form = FORMS[name]
    put(tmp_path, form["files"])
    tree, target = frametool.load(tmp_path / form["tree"]["file"]), form["tree"]["target"]
    with quiet():
        camera = tree.camera(target)
    points = tree.lookup(target, form["tree"]["source"]).apply(form["tree"]["points"])
    expected = [[np.nan] * 2 if each is None else each for each in form["tree"]["pixels"]]
    np.testing.assert_allclose(camera.project(points)[0], expected, rtol=0, atol=PIXEL)
    assert target in {**tree.cameras, **tree.read_cameras()}


@pytest.mark.parametrize("name", TREES)
def test_golden_pixels_of_a_camera_in_a_tree_of_ours(name: str, tmp_path: Path) -> None:
    case = TREES[name]
    put(tmp_path, {"robot.yaml": case["text"]})
    tree = frametool.load(tmp_path / "robot.yaml")
    pixels, depth = tree.camera("camera_optical").project(tree.lookup("camera_optical", "lidar").apply(case["points"]))
    expected = [[np.nan] * 2 if each is None else each for each in case["pixels"]]
    np.testing.assert_allclose(pixels, expected, rtol=1e-13, atol=PIXEL)
    np.testing.assert_allclose(depth, case["depths"], rtol=0, atol=1e-12)


# ---------------------------------------------------------------- ours

LISTED = (
    "frames:\n- {name: base}\n"
    "- {name: cam, parent: base, xyz: [0, 0, 1], quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}, camera: "
    f"{json.dumps(OURS)}}}\n"
)


def test_a_tree_keeps_its_cameras(run: Run) -> None:
    written = run("tree", "robot.yaml", "-f", "yaml", files={"robot.yaml": LISTED}).out
    assert "camera: {model: plumb_bob, K: [502.82, 528.2, 316.62, 234.22], D: [-0.3, 0.1, 0.0, 0.0], size: [640, 480]}" in written
    assert run("tree", "-", "-f", "yaml", stdin=written).out == written
    as_json = run("tree", "robot.yaml", "-f", "json").out
    assert json.loads(as_json)["frames"][1]["camera"] == OURS


def test_a_moving_camera_and_one_without_a_parent(tmp_path: Path) -> None:
    text = (
        f"frames:\n- {{name: world, camera: {json.dumps(OURS)}}}\n"
        f"- name: cam\n  parent: world\n  camera: {json.dumps({**OURS, 'axes': 'flu'})}\n"
        "  samples: [{stamp: 0.0, xyz: [0, 0, 0]}, {stamp: 1.0, xyz: [1, 0, 0]}]\n"
    )
    put(tmp_path, {"robot.yaml": text})
    tree = frametool.load(tmp_path / "robot.yaml")
    assert (tree.camera("world").axes, tree.camera("cam").axes) == ("optical", "flu")
    assert tree.tree_at(5 * 10**8).camera("cam").axes == "flu"


def test_of_two_entries_of_one_camera_the_first_holds_in_files_that_are_merged_too(run: Run) -> None:
    cam = "{name: cam, parent: base, xyz: [0, 0, 1], camera: {model: pinhole, size: [640, 480], K: [%s, 500, 320, 240]}}"
    files = {"a.yaml": cam % 500, "b.yaml": cam % 501, "same.yaml": cam % 500}
    done = run("tree", "a.yaml", "--with", "b.yaml", files=files)
    assert "K: [500.0, 500.0, 320.0, 240.0]" in done.out
    assert done.err == "frametool: warning: b.yaml: camera cam comes again with other numbers; the first ones hold\n"
    assert run("tree", "a.yaml", "--with", "same.yaml", files=files).err == ""


def test_a_frame_may_be_called_camera(tmp_path: Path) -> None:
    put(tmp_path, {"robot.yaml": "frames: {base: {camera: {xyz: [0, 0, 1]}}}"})
    assert frametool.load(tmp_path / "robot.yaml").lookup("base", "camera").xyz.tolist() == [0.0, 0.0, 1.0]


def test_a_file_of_several_cameras_of_ours(tmp_path: Path) -> None:
    put(tmp_path, {"robot.yaml": LISTED})
    assert frametool.load_camera(tmp_path / "robot.yaml").model == "plumb_bob"
    assert frametool.load_camera(tmp_path / "robot.yaml", "cam").size == (640, 480)
    assert frametool.load_camera(f"{tmp_path}/robot.yaml:cam").size == (640, 480)


# ---------------------------------------------------------------- messages of ROS


def info(form: str, frame: str, focal: float) -> Any:
    """Make a message CameraInfo."""
    made = recorded.Maker(form)
    region = made.part("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, 0)
    k, r = np.array([focal, 0, 320, 0, focal, 240, 0, 0, 1.0]), np.eye(3).ravel()
    p = np.array([focal, 0, 320, 0, 0, focal, 240, 0, 0, 0, 1.0, 0])
    d = np.array([-0.3, 0.1, 0.0, 0.0, 0.0])
    return made.part("sensor_msgs/msg/CameraInfo", made.header(frame, 5), 480, 640, "plumb_bob", d, k, r, p, 0, 0, region)


@pytest.fixture(params=recorded.FORMS)
def bag(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    form = request.param
    made = recorded.Maker(form)
    kind = "sensor_msgs/msg/CameraInfo"
    path = tmp_path / f"run.{form}"
    edges = made.transforms(*((("base", name, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), 0)) for name in ("left", "right")))
    sent = [
        recorded.Sent("/tf_static", *edges, 1),
        *(recorded.Sent(f"/{side}/camera_info", kind, info(form, side, focal), 10) for side, focal in (("left", 500.0), ("right", 400.0))),
        recorded.Sent("/left/camera_info", kind, info(form, "left", 500.0), 20),
    ]
    return recorded.write(path, form, sent)


def test_cameras_of_a_bag_by_topic_by_frame_and_in_its_tree(bag: Path) -> None:
    for name, focal in (("/left/camera_info", 500.0), ("left", 500.0), ("right", 400.0)):
        camera = frametool.load_camera(bag, name)
        assert (camera.numbers[0], camera.size, camera.model) == (focal, (640, 480), "plumb_bob")
    assert frametool.load(bag).camera("right").numbers[0] == 400.0
    with pytest.raises(FormatError, match=r"several cameras; .*:NAME chooses one; cameras: /left/camera_info, /right/camera_info, left, right$"):
        frametool.load_camera(bag)


def test_another_camera_info_later_in_a_bag_is_told(tmp_path: Path) -> None:
    kind = "sensor_msgs/msg/CameraInfo"
    sent = [recorded.Sent("/info", kind, info("mcap", "cam", focal), at) for at, focal in enumerate((500.0, 510.0), 1)]
    path = recorded.write(tmp_path / "run", "mcap", sent)
    with pytest.warns(FrametoolWarning, match="/info, cam: other numbers come later; the first ones hold"):
        assert frametool.load_camera(path, "cam").numbers[0] == 500.0


ECHO = (
    "header:\n  frame_id: cam\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\nd: [-0.3, 0.1, 0.0, 0.0, 0.0]\n"
    "k: [500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]\nbinning_x: {}\nbinning_y: {}\n"
    "p: [450.0, 0.0, 318.0, {}, 0.0, 450.0, 238.0, 0.0, 0.0, 0.0, 1.0, 0.0]\n"
    "r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n---\n"
)


def test_messages_of_one_camera_are_one(tmp_path: Path) -> None:
    put(tmp_path, {"info.yaml": ECHO.format(0, 0, 0.0) * 3})
    assert frametool.load_camera(tmp_path / "info.yaml", "cam").numbers[0] == 500.0
    assert frametool.load_camera(tmp_path / "info.yaml").numbers[0] == 500.0


def test_binning_holds_for_the_rectified_picture_too(tmp_path: Path) -> None:
    put(tmp_path, {"info.yaml": ECHO.format(2, 2, -45.0)})
    camera = frametool.load_camera(tmp_path / "info.yaml")
    assert (camera.size, camera.numbers[:4]) == ((320, 240), (250.0, 250.0, 160.0, 120.0))
    first = camera.rectified(from_first=True)
    assert first.numbers[:4] == (225.0, 225.0, 159.0, 119.0)
    assert first.pixels_of(0.1, 0.0, 1.0)[0] == pytest.approx(159.0)


def test_a_message_without_p_has_no_rectified_picture(tmp_path: Path) -> None:
    put(tmp_path, {"info.yaml": ECHO.format(0, 0, 0.0).replace("450.0", "0.0").replace("318.0", "0.0").replace("238.0", "0.0").replace("1.0, 0.0]\n" + "r:", "0.0, 0.0]\nr:")})
    with pytest.raises(ValueInvalid, match="the camera has no P"):
        frametool.load_camera(tmp_path / "info.yaml").rectified()


# ---------------------------------------------------------------- others


def test_the_corner_of_the_first_pixel_is_told(tmp_path: Path) -> None:
    put(tmp_path, {"cameras.txt": "1 PINHOLE 640 480 500 500 320 240\n"})
    with pytest.warns(FrametoolWarning, match=r"cameras.txt: the centre of its first pixel is 0.5, 0.5: 0.5 is taken off cx and cy$"):
        assert frametool.load_camera(tmp_path / "cameras.txt").numbers[2:4] == (319.5, 239.5)


def test_another_size_is_told(tmp_path: Path) -> None:
    put(tmp_path, {"cam.yaml": json.dumps({"camera": OURS})})
    with pytest.warns(FrametoolWarning, match="K is scaled from 640 x 480 to 320 x 240"):
        assert frametool.load_camera(tmp_path / "cam.yaml", size=(320, 240)).size == (320, 240)
    assert frametool.load_camera(tmp_path / "cam.yaml", size=(640, 480)).size == (640, 480)


def test_a_tree_with_cameras_passes_between_processes(tmp_path: Path) -> None:
    put(tmp_path, FORMS["camchain cam0: plumb_bob"]["files"] | {"robot.yaml": LISTED})
    for name, frame in (("camchain.yaml", "cam3"), ("robot.yaml", "cam")):
        tree = frametool.load(tmp_path / name)
        assert pickle.loads(pickle.dumps(tree)).camera(frame).mapping() == tree.camera(frame).mapping()  # noqa: S301


def test_sensor_files_of_euroc(tmp_path: Path) -> None:
    text = (
        "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\n"
        "resolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458.6, 457.3, 367.2, 248.4]\n"
        "distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n"
    )
    (tmp_path / "cam0").mkdir()
    put(tmp_path / "cam0", {"sensor.yaml": text})
    camera = frametool.load_camera(tmp_path / "cam0" / "sensor.yaml")
    assert (camera.model, camera.D, camera.size) == ("plumb_bob", (-0.28, 0.07, 0.0002, 1.8e-05), (752, 480))
    assert frametool.load(tmp_path / "cam0" / "sensor.yaml").camera("cam0").numbers == camera.numbers


def test_cameras_of_kitti_by_each_of_their_names(tmp_path: Path) -> None:
    put(tmp_path, FORMS["KITTI odometry cam0"]["files"])
    for name in ("cam2", "P2", "02", "2"):
        assert frametool.load_camera(tmp_path / "calib.txt", name).numbers[0] == 708.2104
    text = (tmp_path / "calib.txt").read_text().replace("Tr:", "R0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam:")
    put(tmp_path, {"000000.txt": text})  # of the objects, whose projections are about rectified frames
    assert frametool.load_camera(tmp_path / "000000.txt", "cam2").numbers[0] == 708.2104
    assert frametool.load(tmp_path / "000000.txt").camera("cam2_rect").numbers[0] == 708.2104
    with pytest.raises(ValueInvalid, match="cam0 has no intrinsics"):
        frametool.load(tmp_path / "000000.txt").camera("cam0")
    tree = frametool.load(tmp_path / "calib.txt", frames=("left",))
    assert tree.camera("left").numbers[0] == 708.2104


def test_what_p_of_kitti_says_beyond_its_frame_shifts_the_points(tmp_path: Path) -> None:
    text = FORMS["KITTI raw cam1_rect"]["files"]["calib_cam_to_cam.txt"]
    p = [708.2104, 0.0, 602.9078, -330.09, 0.0, 708.2104, 183.9479, 2.5, 0.0, 0.0, 1.0, 0.004]
    lines = ["P_rect_01: " + " ".join(map(str, p)) if line.startswith("P_rect_01") else line for line in text.splitlines()]
    put(tmp_path, {"calib_cam_to_cam.txt": "\n".join(lines) + "\n"})
    tree = frametool.load(tmp_path / "calib_cam_to_cam.txt")
    point = np.array([-1.4, 0.1, 15.7])
    u, v, w = np.array(p).reshape(3, 4) @ [*point, 1.0]
    found, depth = tree.camera("cam1_rect").project(tree.lookup("cam1_rect", "cam0_rect").apply(point))
    np.testing.assert_allclose([*found, depth], [u / w, v / w, w], rtol=0, atol=PIXEL)


def test_axes_of_a_nerf_camera_come_with_its_tree(tmp_path: Path) -> None:
    put(tmp_path, FORMS["transforms.json OPENCV"]["files"])
    with quiet():
        assert frametool.load(tmp_path / "transforms.json").camera("camera").axes == "opengl"
        assert frametool.load_camera(tmp_path / "transforms.json").axes == "optical"


@pytest.mark.parametrize("key", ["distCoeffs", "dist_coeffs", "distortion", "D"])
@pytest.mark.parametrize("matrix", ["cameraMatrix", "K", "M"])
def test_keys_of_opencv(tmp_path: Path, matrix: str, key: str) -> None:
    k = "{rows: 3, cols: 3, data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}"
    text = f"%YAML:1.0\n---\n{matrix}1: {k}\n{key}1: [0.1, 0.2, 0.3, 0.4, 0.5]\n{matrix}2: {k}\ncamera_name: my_intrinsics\np1: 3\n"
    put(tmp_path, {"cv.yml": text})
    assert frametool.load_camera(tmp_path / "cv.yml", "1").D == (0.1, 0.2, 0.3, 0.4, 0.5)
    assert frametool.load_camera(tmp_path / "cv.yml", "2").model == "pinhole"


def test_the_cameras_of_a_pose_file_by_opencv(tmp_path: Path) -> None:
    pose = "body_T_cam1: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]\n"
    put(tmp_path, {"rig.yml": FORMS["OpenCV YAML, M1 D1 M2 D2"]["files"]["stereo.yml"] + pose})
    tree = frametool.load(tmp_path / "rig.yml")
    assert tree.camera("cam1").numbers[0] == 502.82
    with pytest.raises(ValueInvalid, match=r"rig.yml: body has no intrinsics"):
        tree.camera("body")


# ---------------------------------------------------------------- refused


def test_a_frame_without_intrinsics(tmp_path: Path) -> None:
    put(tmp_path, {"robot.yaml": LISTED.replace("cam,", "cam_left,")})
    tree = frametool.load(tmp_path / "robot.yaml")
    with pytest.raises(ValueInvalid) as caught:
        tree.camera("base")
    assert str(caught.value) == f"{tmp_path}/robot.yaml: base has no intrinsics; --camera FILE[:NAME]; cameras: cam_left"
    assert caught.value.exit_code == 1
    with pytest.raises(UnknownFrame, match="unknown frame 'cam_lft'"):
        tree.camera("cam_lft")
    made = frametool.FrameTree("made")
    made.add_root("base")
    with pytest.raises(ValueInvalid, match=r"^made: base has no intrinsics; --camera FILE\[:NAME\]; cameras: none$"):
        made.camera("base")


MODELS = (
    "EUCM, FISHEYE, FOV, FULL_OPENCV, OPENCV, OPENCV_FISHEYE, PINHOLE, RADIAL, RADIAL_FISHEYE, SIMPLE_FISHEYE, SIMPLE_PINHOLE, "
    "SIMPLE_RADIAL, SIMPLE_RADIAL_FISHEYE"
)
REFUSED = {
    "fish.yml: 4 coefficients: --model plumb_bob or --model equidistant": ("fish.yml", FORMS["OpenCV YAML, 4 coefficients"]["files"]["fish.yml"]),
    "cam.yaml: plumb_bob has 4 or 5 coefficients in D, not 3": ("cam.yaml", json.dumps({"camera": {**OURS, "D": [0.1, 0.1, 0.1]}})),
    "cam.yaml: unknown key 'sise'; did you mean 'size'? keys: D, K, P, R, alpha, axes, beta, model, size, skew, w, xi":
        ("cam.yaml", json.dumps({"camera": {**OURS, "sise": [1, 1]}})),
    "cam.yaml: 'x' is not a number": ("cam.yaml", json.dumps({"camera": {**OURS, "K": ["x", 1, 1, 1]}})),
    f"cameras.txt:2: THIN_PRISM_FISHEYE is not read; models: {MODELS}": ("cameras.txt", "# Camera list\n12 THIN_PRISM_FISHEYE 640 480 1 1 1 1 0 0 0 0\n"),
    "cameras.txt: not as a camera has it (not enough values to unpack (expected at least 2, got 1))": ("cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n2 PINHOLE 640\n"),
    "info.yaml: not as a camera has it ('str' object has no attribute 'get')": ("info.yaml", ECHO.format(0, 0, 0.0).replace("  frame_id: cam", "  cam")),
    "cam.yaml: a camera without K; it is {model: .., K: [fx, fy, cx, cy], D: [..], size: [w, h]}": ("cam.yaml", "{K: null, D: [0, 0, 0, 0, 0]}"),
    "cameras.txt:1: PINHOLE has 4 parameters, not 3": ("cameras.txt", "1 PINHOLE 640 480 500 320 240\n"),
    "t.json: camera_angle_x needs --size W,H": ("t.json", '{"camera_angle_x": 0.7, "frames": []}'),
    f"t.json: EQUIRECTANGULAR is not read; models: {MODELS}": ("t.json", '{"camera_model": "EQUIRECTANGULAR", "fl_x": 500, "w": 4, "h": 3, "frames": []}'),
    "poses.yaml: no camera in it: neither K nor what else `frametool help cameras` lists": ("poses.yaml", "frames: {base: {}}"),
}  # fmt: skip


@pytest.mark.parametrize("message", REFUSED)
def test_what_is_refused(message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    name, text = REFUSED[message]
    put(tmp_path, {name: text})
    with pytest.raises(FormatError) as caught:
        frametool.load_camera(name)
    assert str(caught.value) == message


def test_names_that_are_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    put(tmp_path, FORMS["camchain cam0: plumb_bob"]["files"])
    with pytest.raises(FormatError, match=r"^camchain.yaml: no camera 'cam9'; did you mean 'cam\d'\? cameras: cam0, cam1, "):
        frametool.load_camera("camchain.yaml:cam9")
    with pytest.raises(FormatError, match=r"^camchain.yaml: several cameras; camchain.yaml:NAME chooses one; cameras: cam0, "):
        frametool.load_camera("camchain.yaml")
    with pytest.raises(FileProblem):
        frametool.load_camera("nothing.yaml:cam0")


def test_a_camera_of_a_tree_that_cannot_be_is_refused_with_its_frame(run: Run) -> None:
    text = LISTED.replace('"D": [-0.3, 0.1, 0.0, 0.0]', '"D": [0.1]')
    done = run("tree", "robot.yaml", files={"robot.yaml": text})
    assert (done.status, done.err.splitlines()[0]) == (1, "frametool: robot.yaml:3:99: plumb_bob has 4 or 5 coefficients in D, not 1")
    done = run("check", "robot.yaml")
    assert (done.status, "robot.yaml:3:99: error: plumb_bob has 4 or 5 coefficients in D, not 1" in done.out) == (1, True)


def test_a_camera_without_k_is_refused_where_it_stands(run: Run) -> None:
    text = LISTED.replace('"K": [502.82, 528.2, 316.62, 234.22], ', "")
    done = run("tree", "robot.yaml", files={"robot.yaml": text})
    assert done.status == 1
    assert "robot.yaml:3:99: a camera without K; it is {model: .., K: [fx, fy, cx, cy], D: [..], size: [w, h]}" in done.err


def test_names_with_a_slash_and_numbers_that_are_null(tmp_path: Path) -> None:
    text = LISTED.replace("name: cam,", "name: /cam,").replace("[640, 480]", "null")
    put(tmp_path, {"robot.yaml": text})
    with pytest.warns(FrametoolWarning, match="/cam"):
        assert frametool.load(tmp_path / "robot.yaml").camera("cam").size is None
