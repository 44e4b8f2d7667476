"""Pixels beside rows: what 40 digits say, in every form of rows; no pixel is no number; one row and many alike."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from flow import Asked, asked, flow

from frametool.geometry.camera import Camera
from frametool.rows.formulas import PixelsOfPoints, PointsOfPixels

GOLDEN = json.loads((Path(__file__).parent.parent / "golden" / "camera.json").read_text())
CASES = {each["name"]: each for each in GOLDEN["cameras"]}
named = pytest.mark.parametrize("name", CASES)
PINHOLE = Camera("pinhole", [100.0, 100.0, 31.5, 23.5], size=(64, 48))
POINTS = [(0.1 * at - 1.5, 0.07 * at - 1.0, 2.0 - 0.1 * at) for at in range(40)]


def camera_of(case: dict[str, Any]) -> Camera:
    given = {name: case[name] for name in ("skew", "xi", "alpha", "beta", "w") if name in case}
    return Camera(case["model"], case["K"], case.get("D", ()), case["size"], **given)


def projecting(camera: Camera, first: float = 0.0, *, ranged: bool = False, **options: Any) -> Asked:
    seen = PixelsOfPoints(camera, first, name="cam", ranged=ranged)
    return asked(formula=seen, moves=True, **options)


def unprojecting(camera: Camera, columns: tuple[str, ...], first: float = 0.0, **options: Any) -> Asked:
    seen = PointsOfPixels(camera, first, columns, target="map", **options)
    return asked(formula=seen, moves=True, poses=0)


def table(rows: Any, names: str) -> bytes:
    return f"{names}\n{''.join(','.join(map(repr, row)) + chr(10) for row in rows)}".encode()


def cells(text: bytes, first: int) -> list[list[float]]:
    """Return the cells of rows from a column on, nan where they are empty."""
    rows = [line.split(",")[first:] for line in text.decode().splitlines()[1:]]
    return [[float(cell) if cell else math.nan for cell in row] for row in rows]


@named
def test_rows_get_the_pixels_of_the_goldens(name: str) -> None:
    case = CASES[name]
    found = cells(flow(table(case["points"], "x,y,z"), projecting(camera_of(case))).text, 3)
    for (u, v, depth, inside), pixel, point, is_inside in zip(found, case["pixels"], case["points"], case["in_image"], strict=True):
        assert (u, v) == pytest.approx(pixel or (math.nan, math.nan), rel=0, abs=1e-10, nan_ok=True)
        assert (depth, bool(inside)) == (point[2], bool(is_inside))


@named
def test_records_have_the_numbers_of_tables_and_null_for_no_pixel(name: str) -> None:
    case, request = CASES[name], projecting(camera_of(CASES[name]))
    lines = "".join(json.dumps({"point": point, "id": at}) + "\n" for at, point in enumerate(case["points"]))
    rows = flow(table(case["points"], "x,y,z"), request).text.decode().splitlines()[1:]
    for row, line, point in zip(rows, flow(lines.encode(), request, "json").text.decode().splitlines(), case["points"], strict=True):
        u, v, depth, inside = row.split(",")[3:]
        pixel = f"[{u}, {v}]" if u else "null"
        truth = ("false", "true")[int(inside)]
        assert line.endswith(f', "camera": "cam", "pixel": {pixel}, "depth": {depth}, "in_image": {truth}}}')
        assert json.loads(line)["point"] == point


@pytest.mark.parametrize("form", ["json", "yaml"])
@pytest.mark.parametrize("precision", [None, 3])
def test_one_record_is_what_it_is_among_many(form: str, precision: int | None) -> None:
    request = projecting(PINHOLE, ranged=True, precision=precision)
    records = [f"point: [{x!r}, {y!r}, {z!r}]\nid: {at}\n" for at, (x, y, z) in enumerate(POINTS)]
    if form == "json":
        records = [json.dumps({"point": point, "id": at}) + "\n" for at, point in enumerate(POINTS)]
    between = "" if form == "json" else "---\n"
    many = flow(between.join(records).encode(), request, form).text.decode()
    assert many == between.join(flow(record.encode(), request, form).text.decode() for record in records)


def test_the_first_pixel_is_where_the_reader_has_it() -> None:
    usual, corner = (cells(flow(table(POINTS, "x,y,z"), projecting(PINHOLE, first)).text, 3) for first in (0.0, 0.5))
    assert [u + 0.5 for u, *_ in usual if u == u] == [u for u, *_ in corner if u == u]  # noqa: PLR0124
    pixels = [(u, v) for u, v, *_ in corner if u == u]  # noqa: PLR0124
    back = cells(flow(table(pixels, "u,v"), unprojecting(PINHOLE, ("u", "v"), 0.5)).text, 2)
    for (u, v), (*_, x, y, z) in zip(pixels, back, strict=True):
        assert (100.0 * x / z + 32.0, 100.0 * y / z + 24.0) == pytest.approx((u, v))


def test_without_a_size_it_is_open_whether_a_pixel_is_in_the_image() -> None:
    request = projecting(Camera("pinhole", [100.0, 100.0, 31.5, 23.5]))
    assert flow(b"x,y,z\n0,0,1\n", request).text == b"x,y,z,u,v,depth,in_image\n0,0,1,31.5,23.5,1.0,\n"
    assert b'"in_image": null' in flow(b'{"point": [0, 0, 1]}\n', request, "json").text


@named
def test_rows_of_pixels_get_the_rays_of_the_goldens(name: str) -> None:
    case = CASES[name]
    pixels = [*(pixel for pixel, _ in case["rays"]), *case.get("no_ray", [])]
    found = cells(flow(table(pixels, "u,v"), unprojecting(camera_of(case), ("u", "v"))).text, 2)
    rays = [*(ray for _, ray in case["rays"]), *[[math.nan] * 3] * len(case.get("no_ray", []))]
    for (x, y, z, *ray), wanted in zip(found, rays, strict=True):
        assert ray == pytest.approx(wanted, rel=0, abs=1e-12, nan_ok=True)
        assert [x, y, z] == ([0.0] * 3 if wanted[0] == wanted[0] else pytest.approx([math.nan] * 3, nan_ok=True))


@pytest.mark.parametrize("way", ["depth", "range"])
def test_a_point_is_where_its_pixel_and_its_depth_or_range_are(way: str) -> None:
    projected = flow(table(POINTS, "a,b,c"), projecting(PINHOLE, ranged=True, columns=("a,b,c",))).text
    request = unprojecting(PINHOLE, ("u", "v", way), far=(way, None))
    for (u, *_, x, y, z), point in zip(cells(flow(projected, request).text, 3), POINTS, strict=True):
        assert (x, y, z) == pytest.approx(point if u == u else (math.nan,) * 3, nan_ok=True)  # noqa: PLR0124


def test_pixels_of_records_are_lists_or_null_and_replaced_where_they_are_undistorted() -> None:
    camera = Camera("plumb_bob", [100.0, 100.0, 31.5, 23.5], [-0.2, 0.0, 0.0, 0.0])
    u, v = camera.undistort([5.0, 9.0]).tolist()
    request = unprojecting(camera, ("pixel.0", "pixel.1"), into=camera.flat())
    assert flow(b'{"pixel": [5, 9], "id": 1}\n', request, "json").text == f'{{"pixel": [{u!r}, {v!r}], "id": 1}}\n'.encode()
    rows = flow(b"id,u,v\n1,5,9\n,,\n", unprojecting(camera, ("u", "v"), into=camera.flat())).text
    assert rows == f"id,u,v\n1,{u!r},{v!r}\n,,\n".encode()


def test_what_is_there_already_is_not_written_a_second_time() -> None:
    told = flow(b'{"point": [0, 0, 1], "depth": 3}\n', projecting(PINHOLE), "json").told
    assert told == ["in:1: key 'depth' is there already; take another name, or --prefix"] or "--prefix" in told[0]
    assert "--prefix" in flow(b'{"point": [0, 0, 1], "pixel": 3}\n', projecting(PINHOLE), "json").told[0]
