"""Cameras: every model against 40 digits, the laws of projecting and back, where models end, and what is refused."""

from __future__ import annotations

import itertools
import json
import math
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frametool
from frametool.errors import FrametoolWarning, ValueInvalid
from frametool.geometry.camera import AXES, Camera
from frametool.geometry.lenses import CAMERA_MODELS
from frametool.geometry.transform import Transform

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "camera.json").read_text())
PARAMETERS = ("xi", "alpha", "beta", "w")
PIXEL, RAY = 1e-10, 1e-12
DRAWN = np.random.default_rng(36)
CASES = {each["name"]: each for each in GOLDEN["cameras"]}
TREES = {each["camera"]: each for each in GOLDEN["trees"]}


def camera_of(case: dict[str, Any]) -> Camera:
    given = {name: case[name] for name in ("skew", *PARAMETERS) if name in case}
    return Camera(case["model"], case["K"], case.get("D", ()), case["size"], **given)


CAMERAS = {name: camera_of(case) for name, case in CASES.items()}
named = pytest.mark.parametrize("name", CASES)
of_trees = pytest.mark.parametrize("name", TREES)


def with_none(rows: Any) -> Any:
    """Make an array of pixels of which some are none."""
    return np.array([[math.nan, math.nan] if row is None else row for row in rows])


def points(count: int = 4000) -> Any:
    """Draw points all around a camera, some on its axis, its plane, and in its centre."""
    found = DRAWN.normal(size=(count, 3)) * 10.0 ** DRAWN.uniform(-3, 3, (count, 1))
    found[:40, :2], found[40:80, 2], found[80] = 0.0, 0.0, 0.0
    return found


def test_every_model_of_the_table_has_a_golden_camera() -> None:
    assert {case["model"] for case in CASES.values()} == set(CAMERA_MODELS)


@named
def test_golden_pixels(name: str) -> None:
    case, camera = CASES[name], CAMERAS[name]
    pixels, depth = camera.project(case["points"])
    np.testing.assert_allclose(pixels, with_none(case["pixels"]), rtol=0, atol=PIXEL)
    assert depth.tolist() == [point[2] for point in case["points"]]
    assert camera.in_image(pixels).tolist() == case["in_image"]


@named
def test_golden_rays(name: str) -> None:
    case, camera = CASES[name], CAMERAS[name]
    pixels, rays = zip(*case["rays"], strict=True)
    np.testing.assert_allclose(camera.unproject(pixels), rays, rtol=0, atol=RAY)
    assert all(np.isnan(camera.unproject(pixel)).all() for pixel in case.get("no_ray", ()))


@named
def test_golden_ends(name: str) -> None:
    case, camera = CASES[name], CAMERAS[name]
    assert camera.end_angle == pytest.approx(case["end_angle"], abs=1e-14)
    if name != "fov":  # which ends by its angle
        assert camera.lens.end == pytest.approx(math.inf if case["end"] is None else case["end"], abs=1e-14)


@of_trees
def test_golden_points_at_a_depth_and_a_range(name: str) -> None:
    camera = camera_of(TREES[name]["spec"])
    for pixel, depth, point, _, distance in TREES[name]["depth"]:
        np.testing.assert_allclose(camera.unproject(pixel, depth=depth), point, rtol=0, atol=1e-11)
        np.testing.assert_allclose(camera.unproject(pixel, range=distance), point, rtol=0, atol=1e-11)


@of_trees
def test_golden_points_on_the_ground(name: str) -> None:
    case = TREES[name]
    camera, tree = camera_of(case["spec"]), frametool.FrameTree()
    import yaml  # the golden tree is text of ours, its camera aside

    base = yaml.safe_load(case["text"])["frames"]["map"]["base"]
    link = base["children"]["camera_link"]
    tree.add("map", "base", Transform.from_parts(base["xyz"], rpy=base["rpy"]))
    tree.add("base", "link", Transform.from_parts(link["xyz"], rpy=link["rpy"]))
    tree.add("link", "camera", Transform.from_parts(xyzw=[-0.5, 0.5, -0.5, 0.5]))
    map_from_camera = tree.lookup("map", "camera")
    for pixel, ground, higher in case["ground"]:
        for height, expected in ((0.0, ground), (case["ground_height"], higher)):
            found = camera.plane_points_of(pixel[0], pixel[1], map_from_camera.components, height)
            np.testing.assert_allclose(found, [math.nan] * 3 if expected is None else expected, rtol=1e-11, atol=1e-10)
    for pixel, ray in case["rays_in_map"]:
        np.testing.assert_allclose(map_from_camera.apply_vector(camera.unproject(pixel)), ray, rtol=0, atol=RAY)


@named
def test_what_is_projected_comes_back(name: str) -> None:
    camera, given = CAMERAS[name], points()
    pixels, depth = camera.project(given)
    seen = ~np.isnan(pixels[:, 0]) & (np.abs(pixels) < 3e3).all(axis=1)  # prisms fold far outside
    near_the_end = np.arctan2(np.hypot(given[:, 0], given[:, 1]), given[:, 2]) > camera.end_angle - 0.01
    seen &= ~near_the_end
    distance = np.linalg.norm(given, axis=1)
    assert seen.sum() > 500
    np.testing.assert_allclose(
        camera.unproject(pixels[seen]), given[seen] / distance[seen, None], rtol=0, atol=1e-10
    )
    back = camera.unproject(pixels, range=distance)
    np.testing.assert_allclose(back[seen] / distance[seen, None], given[seen] / distance[seen, None], atol=1e-10)
    level = seen & (np.abs(given[:, 2]) > 0.1 * distance)
    back = camera.unproject(pixels, depth=depth)
    np.testing.assert_allclose(back[level], given[level], rtol=1e-8, atol=1e-8)


@named
def test_beyond_the_end_angle_there_is_no_pixel(name: str) -> None:
    camera = CAMERAS[name]
    for turn in np.linspace(0.0, 2.0 * math.pi, 7):
        for angle, is_seen in ((camera.end_angle - 1e-6, True), (camera.end_angle + 1e-6, False)):
            if angle < math.pi:
                sine = math.sin(angle)
                u, _, _ = camera.pixels_of(sine * math.cos(turn), sine * math.sin(turn), math.cos(angle))
                assert math.isnan(u) != is_seen, (angle, turn)


@named
def test_one_point_and_many_give_the_same_bits(name: str) -> None:
    camera, given = CAMERAS[name], points(300)
    pixels, depth = camera.project(given)
    rays = camera.unproject(pixels)
    for point, pixel, far, ray in zip(given.tolist(), pixels, depth, rays, strict=True):
        *alone, own = camera.pixels_of(*point)
        np.testing.assert_array_equal([*alone, own], [*pixel, far])
        np.testing.assert_array_equal(camera.rays_of(*map(float, pixel)), ray)
    order = DRAWN.permutation(300)
    np.testing.assert_array_equal(camera.project(given[order])[0], pixels[order])
    np.testing.assert_array_equal(camera.unproject(pixels[order]), rays[order])


ODD = (0.0, -0.0, 5e-324, 1e-200, 1e-9, 1.0, -1.0, 2.0, 1e160, -1e300, math.inf, math.nan)
EXTREME = (
    Camera("rational_polynomial", [1, 1, 0, 0], [0, 0, 0, 0, 0, -1, 0, 0]),  # a pole at r = 1
    Camera("plumb_bob", [1, 1, 0, 0], [30.0, -20.0, 10.0, 10.0]),
    Camera("thin_prism", [1, 1, 0, 0], [1e8] * 12),
    Camera("omni", [1, 1, 0, 0], xi=0.0),
    Camera("omni", [1, 1, 0, 0], xi=1.0),
    *(Camera("ds", [1, 1, 0, 0], xi=xi, alpha=alpha) for xi in (-0.99999, 0.0, 1.0, 10.0) for alpha in (0.0, 0.5, 1.0)),
    *(Camera("eucm", [1, 1, 0, 0], alpha=alpha, beta=beta) for beta in (1e-3, 100.0) for alpha in (0.0, 0.5, 1.0)),
    *(Camera("fov", [1, 1, 0, 0], w=w) for w in (1e-6, 3.1)),
)


def test_rays_of_a_fisheye_lens_that_bends_inward_are_those_of_its_points() -> None:
    """Newton's steps that jump from one end of the bracket to the other come to no rest; they are bisected."""
    camera = Camera("equidistant", [850.0, 800.0, 320.0, 240.0], [0.08, -0.002, 0.01, -0.001])
    angles = np.linspace(0.0, 0.999 * camera.end_angle, 1500)
    points = np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=-1)
    np.testing.assert_allclose(camera.unproject(camera.project(points)[0]), points, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("camera", [*CAMERAS.values(), *EXTREME], ids=lambda camera: camera.model)
def test_no_number_stops_a_kernel_and_floats_and_arrays_agree(camera: Camera) -> None:
    given, places = [*itertools.product(ODD, repeat=3)], [*itertools.product((*ODD, 320.0, -5e3), repeat=2)]
    alone = [camera.pixels_of(*map(float, point))[:2] for point in given]
    np.testing.assert_array_equal(alone, camera.project(given)[0])
    np.testing.assert_array_equal([camera.rays_of(*place) for place in places], camera.unproject(places))
    back = [camera.points_of(u, v, 2.0) for u, v in places]
    np.testing.assert_array_equal(back, camera.unproject(places, depth=2.0))


def test_blocks_change_nothing() -> None:
    camera, given = CAMERAS["folding"], points(40_000)
    whole = camera.unproject(camera.project(given)[0])
    cut = [camera.unproject(camera.project(given[at : at + 7001])[0]) for at in range(0, 40_000, 7001)]
    np.testing.assert_array_equal(whole, np.concatenate(cut))


@named
def test_what_is_not_finite_has_no_pixel_and_no_ray(name: str) -> None:
    for point in ([math.nan, 0.0, 1.0], [0.0, math.nan, 1.0], [0.0, 0.0, math.nan], [0.0, 0.0, 0.0]):
        assert np.isnan(CAMERAS[name].project(point)[0]).all()
    for pixel in ([math.nan, 1.0], [1.0, math.nan], [math.inf, 1.0]):
        assert np.isnan(CAMERAS[name].unproject(pixel)).all()


def test_points_do_not_fold_back_into_the_picture() -> None:
    """opencv#17768: its projectPoints draws 74 528 points of this sweep where the model holds for 49 513."""
    camera = Camera("plumb_bob", (350.0, 350.0, 320.0, 240.0), (-0.4, 0.05, 0.0006, -0.0004), (640, 480))
    drawn = np.random.default_rng(1)
    around, up = drawn.uniform(-np.pi, np.pi, 200_000), drawn.uniform(-0.43, 0.2, 200_000)
    far = drawn.uniform(2, 60, 200_000)
    sweep = np.column_stack([far * np.cos(up) * np.sin(around), -far * np.sin(up), far * np.cos(up) * np.cos(around)])
    assert camera.in_image(camera.project(sweep)[0]).sum() == 49_513


def test_why_a_point_has_no_pixel() -> None:
    folding, wide = CAMERAS["folding"], CAMERAS["double_sphere"]
    assert [bool(folding.is_behind(z)) for z in (-1.0, 0.0, 1.0)] == [True, True, False]
    assert not wide.is_behind(-1.0)
    assert folding.is_behind(np.array([-1.0, 1.0])).tolist() == [True, False]


def test_depth_behind_a_ray_has_no_point() -> None:
    camera = CAMERAS["pinhole"]
    assert np.isnan(camera.unproject([10.0, 10.0], depth=-1.0)).all()
    assert np.isnan(camera.unproject([10.0, 10.0], range=-1.0)).all()
    with pytest.raises(ValueInvalid, match="depth or range, not both"):
        camera.unproject([10.0, 10.0], depth=1.0, range=1.0)


@pytest.mark.parametrize("axes", AXES)
def test_axes_turn_points_and_rays(axes: str) -> None:
    rotation = np.array(AXES[axes]).reshape(3, 3)
    given = np.array([[0.5, -0.2, 4.0], [1.0, 0.3, 2.0]])
    camera, plain = CAMERAS["radtan5"].changed(axes=axes), CAMERAS["radtan5"]
    pixels, depth = camera.project(given @ rotation)
    np.testing.assert_array_equal(pixels, plain.project(given)[0])
    assert depth.tolist() == [4.0, 2.0]
    np.testing.assert_array_equal(camera.unproject(pixels), plain.unproject(pixels) @ rotation)


RIGHT: dict[str, Any] = {
    "R": [0.999721410639185, 0.012271662925380908, 0.020162028634142147, -0.012302619472805042, 0.9999233228715186,
          0.0014120664601900833, -0.020143154264054434, -0.0016597188395831607, 0.9997957284714053],
    "P": [464.03, 0.0, 321.88, -55.265972999999995, 0.0, 464.03, 238.23, 0.0, 0.0, 0.0, 1.0, 0.0],
}  # fmt: skip
FORMS = {each["name"]: each for each in GOLDEN["forms"]}


def rectifiable() -> Camera:
    return Camera("plumb_bob", [502.82, 528.2, 316.62, 234.22], [-0.3136, 0.1068, 0.000849, -0.000271, 0.0], (640, 480), **RIGHT)


def test_golden_rectified_pictures() -> None:
    own, first = FORMS["camera_info file, --rectified"], FORMS["camera_info file, --from-first"]
    camera = rectifiable()
    with pytest.warns(FrametoolWarning, match=r"column 4 of P, -55.266 0 0, is a pose and not applied: --from-first"):
        rectified = camera.rectified()
    np.testing.assert_allclose(rectified.project(own["points"])[0], own["pixels"], rtol=0, atol=PIXEL)
    np.testing.assert_allclose(
        camera.rectified(from_first=True).project(first["points"])[0], first["pixels"], rtol=0, atol=PIXEL
    )
    for raw, by_p, by_k in own["undistort"]:
        np.testing.assert_allclose(camera.undistort(raw), by_k, rtol=0, atol=PIXEL)
        np.testing.assert_allclose(camera.undistort(raw, rectified), by_p, rtol=0, atol=PIXEL)


def test_rays_of_a_rectified_picture_are_those_of_the_camera() -> None:
    camera = rectifiable()
    first = camera.rectified(from_first=True)
    pixels, depth = first.project([[0.3, 0.2, 5.0]])
    np.testing.assert_allclose(first.unproject(pixels, depth=depth), [[0.3, 0.2, 5.0]], rtol=0, atol=1e-12)
    with pytest.warns(FrametoolWarning):
        own = camera.rectified()
    back = own.unproject(own.project([0.3, 0.2, 5.0])[0], range=math.hypot(0.3, 0.2, 5.0))
    np.testing.assert_allclose(back, [0.3, 0.2, 5.0], rtol=0, atol=1e-12)


def test_a_picture_of_another_size() -> None:
    half = rectifiable().scaled((320, 240))
    assert half.K.tolist() == [[251.41, 0.0, 158.06], [0.0, 264.1, 116.86], [0.0, 0.0, 1.0]]
    u, v, _ = rectifiable().pixels_of(0.3, 0.2, 5.0)
    np.testing.assert_allclose(half.pixels_of(0.3, 0.2, 5.0)[:2], [(u + 0.5) / 2 - 0.5, (v + 0.5) / 2 - 0.5], atol=1e-12)
    whole, cut = (each.rectified(from_first=True).pixels_of(0.3, 0.2, 5.0)[0] for each in (rectifiable(), half))
    assert cut == pytest.approx((whole + 0.5) / 2 - 0.5, abs=1e-12)
    assert Camera("pinhole", [1, 1, 0, 0]).scaled((4, 3)).size == (4, 3)
    assert Camera("pinhole", [1, 1, 0, 0], size=(1242, 375)).scaled((621, 188)).size == (621, 188)
    with pytest.raises(ValueInvalid, match=r"^size 700 x 480 is another shape than 640 x 480$"):
        rectifiable().scaled((700, 480))


def test_in_the_image_is_up_to_half_a_pixel_around() -> None:
    camera = Camera("pinhole", [1, 1, 0, 0], size=(4, 3))
    inside = [(-0.5, 0.0), (0.0, -0.5), (3.49, 2.49)]
    outside = [(-0.51, 0.0), (0.0, -0.51), (3.5, 0.0), (0.0, 2.5), (math.nan, math.nan)]
    assert camera.in_image([*inside, *outside]).tolist() == [True] * 3 + [False] * 5
    with pytest.raises(ValueInvalid, match="size of the picture is not known"):
        Camera("pinhole", [1, 1, 0, 0]).in_image([0.0, 0.0])


def test_a_camera_is_frozen_and_passes_between_processes() -> None:
    camera = rectifiable()
    with pytest.raises(AttributeError, match="a camera is frozen"):
        camera.model = "omni"
    assert pickle.loads(pickle.dumps(camera)).mapping() == camera.mapping() == eval(repr(camera)).mapping()  # noqa: S301, S307


@pytest.mark.parametrize(("count", "model"), [(0, "pinhole"), (5, "plumb_bob"), (8, "rational_polynomial"), (12, "thin_prism"), (14, "thin_prism")])
def test_without_a_model_the_count_of_coefficients_says_it(count: int, model: str) -> None:
    assert Camera(None, [1, 1, 0, 0], [0.0] * count).model == model


def test_arrays_of_numbers_are_taken() -> None:
    given: dict[str, Any] = {key: np.array(each) for key, each in RIGHT.items()}
    made = Camera("plumb_bob", np.array([[502.82, 0, 316.62], [0, 528.2, 234.22], [0, 0, 1]]), np.zeros(5), np.array([640, 480]), **given)
    assert made.mapping() == {**rectifiable().mapping(), "D": [0.0] * 5}
    assert made.K.shape == (3, 3)


def test_a_depth_for_each_pixel_some_of_them_unknown() -> None:
    camera = CAMERAS["pinhole"]
    found = camera.unproject([[10.0, 10.0], [10.0, 10.0]], depth=[2.0, math.nan])
    np.testing.assert_array_equal(found[0], camera.unproject([10.0, 10.0], depth=2))
    assert np.isnan(found[1]).all()


def test_parameters_say_the_model_too() -> None:
    assert Camera(None, [1, 1, 0, 0], xi=0.1, alpha=0.5).model == "ds"
    assert Camera(None, [1, 1, 0, 0], [0.0] * 4, xi=0.1).model == "omni"


def test_every_alias_is_its_model() -> None:
    for name, row in CAMERA_MODELS.items():
        given: dict[str, Any] = dict.fromkeys(row.parameters, 0.5)
        assert {Camera(alias, [1, 1, 0, 0], **given).model for alias in (name, *row.aliases)} == {name}


@pytest.mark.parametrize(("model", "count"), [("plumb_bob", 8), ("plumb_bob", 12), ("rational_polynomial", 5), ("rational_polynomial", 12)])
def test_the_count_of_coefficients_goes_before_the_name(model: str, count: int) -> None:
    with pytest.warns(FrametoolWarning, match=f"{model} with {count} coefficients is read as"):
        assert len(Camera(model, [1, 1, 0, 0], [0.01] * count).D) == count


K = [1.0, 1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"model": "plumb_bob", "D": [0.1] * 3}, "plumb_bob has 4 or 5 coefficients in D, not 3"),
        ({"model": "pinhole", "D": [0.1] * 4}, "pinhole has no coefficients in D, not 4"),
        ({"model": None, "D": [0.1] * 4}, "4 coefficients: --model plumb_bob or --model equidistant"),
        ({"model": "pinhole", "K": [0, 1, 2, 3]}, "fx is 0: the camera is not calibrated"),
        ({"model": "pinhole", "K": [1, 0, 2, 3]}, "fy is 0: the camera is not calibrated"),
        ({"model": "pinhole", "K": [math.nan, 1, 2, 3]}, "K: nan is not a finite number"),
        ({"model": "pinhole", "K": [1, 2, 3]}, "K is 4 or 9 numbers, not 3"),
        ({"model": "pinhole", "K": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}, "K is not a camera matrix: its rows are fx skew cx, 0 fy cy and 0 0 1"),
        ({"model": "ds", "xi": 0.1, "alpha": 1.5}, "alpha 1.5 is beyond 0 .. 1"),
        ({"model": "ds", "xi": -1.0, "alpha": 0.5}, "xi -1 is beyond -0.999999 .. inf"),
        ({"model": "omni", "xi": -0.1}, "xi -0.1 is beyond 0 .. inf"),
        ({"model": "ds", "xi": 0.1}, "ds has xi and alpha, not xi"),
        ({"model": "pinhole", "xi": 0.1}, "pinhole has only D as a parameter, not xi"),
        ({"model": "thin_prism", "D": [0.0] * 12 + [0.1, 0.0]}, "D is of a tilted sensor, tau 0.1 0, which is not read"),
        ({"model": "pinhole", "size": (640, 0)}, "size 640 x 0 is not a size: give whole pixels, width and height"),
        ({"model": "pinhole", "axes": "enu"}, "axes 'enu' are not known; axes: optical, opengl, flu"),
        ({"model": "pinhola"}, "camera model 'pinhola' is not known; did you mean 'pinhole'? models: ds, equidistant, eucm, fov, omni, pinhole, plumb_bob, rational_polynomial, thin_prism"),
    ],
)  # fmt: skip
def test_what_no_camera_can_be(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueInvalid) as caught:
        Camera(**{"K": K, **given})
    assert str(caught.value) == message


def test_no_picture_is_rectified_without_p() -> None:
    with pytest.raises(ValueInvalid, match="the camera has no P"):
        Camera("pinhole", K).rectified()


def test_floats_load_no_numpy() -> None:
    code = (
        "import sys; from frametool import Camera; c = Camera('plumb_bob', [500, 500, 320, 240], [-0.3, 0.1, 0, 0]);"
        "u, v, d = c.pixels_of(0.1, 0.2, 3.0); c.rays_of(u, v); c.points_of(u, v, d);"
        "assert 'numpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
