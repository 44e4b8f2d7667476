"""Whatever form rows come in, they go into every form of columns: all of it, or told by name what has no place there."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.formats.table import FORMATS

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

SECOND = [0.0, 0.0, 0.6, 0.8]
MATRIX = "1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n"
RECORD = {"id": 1, "label": "a", "nest": {"a": [1, 2]}, "ok": True, "xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}
FRAMES = [{"file_path": name, "transform_matrix": [list(map(float, line.split())) for line in MATRIX.splitlines()]} for name in ("a.png", "b.png")]
POSES = {
    "p.g2o": "VERTEX_SE3:QUAT 0 1 2 3 0 0 0 1\nVERTEX_SE3:QUAT 1 1 2 3 0 0 0.6 0.8\n",
    "images.txt": "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n1 1 0 0 0 1 2 3 1 a.png\n\n2 0.8 0 0 0.6 1 2 3 1 b.png\n\n",
    "k.kitti": "1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 1 0 1 0 2 0 0 1 3\n",
    "transforms.json": json.dumps({"camera_angle_x": 0.7, "frames": FRAMES}),
    "t.tum": "1700000000.5 1 2 3 0 0 0 1\n1700000001.5 1 2 3 0 0 0.6 0.8\n",
    "e.csv": "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n5,1,2,3,1,0,0,0\n6,1,2,3,0.8,0,0,0.6\n",
    "poses.csv": "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n1,2,3,0,0,0.6,0.8\n",
    "poses.tsv": "x\ty\tz\tqx\tqy\tqz\tqw\n1\t2\t3\t0\t0\t0\t1\n1\t2\t3\t0\t0\t0.6\t0.8\n",
    "poses.jsonl": (json.dumps(RECORD) + "\n") * 2,
    "poses.yaml": "xyz: [1, 2, 3]\nrpy: [0, 0, 1]\nstamp: 1.5\n---\nxyz: [1, 2, 3]\nrpy: [0, 0, 1]\nstamp: 2.5\n",
}
POINTS = {
    "points.csv": "x,y,z,id,label,gain\n1,2,3,4,a,0.5\n4,5,6,9007199254740993,,\n",
    "points.jsonl": '{"point": [1, 2, 3], "id": 4, "label": "a"}\n{"point": [4, 5, 6], "id": 5, "label": null}\n',
    "points.yaml": "x: 1.0\ny: 2.0\nz: 3.0\n---\nx: 4.0\ny: 5.0\nz: 6.0\n",
}
# forms whose points have the same numbers always refuse what lacks one: tests/formats/test_bin_clouds.py
ARRAYS = [name for name, row in FORMATS.items() if "arrays" in row.writes and not row.rows.columns]
OTHERS = [form for form in ARRAYS if form != "npy"]
MOVES = (("convert",), ("invert",), ("apply", "--transform", "{xyz: [1, 0, 0], rpy_deg: [0, 0, 90]}"), ("convert", "--to", "rpy"), ("convert", "--to", "matrix"))


@pytest.fixture(autouse=True)
def _libraries() -> None:
    for name in ("pyarrow", "laspy", "lazrs"):
        pytest.importorskip(name)


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def into(run: Run, command: tuple[str, ...], name: str, content: str, form: str) -> Any:
    return run(*command, "-i", name, "-f", form, "-o", f"made.{form}", "--force", "--quiet", files={name: content})


@pytest.mark.parametrize("form", ARRAYS)
@pytest.mark.parametrize("name", [*POSES, *POINTS])
def test_every_form_of_rows_goes_into_every_form_of_columns_or_is_refused_in_a_line(run: Run, name: str, form: str) -> None:
    content = (POSES | POINTS)[name]
    for command in MOVES:
        done = into(run, command, name, content, form)
        if command[0] == "apply" or (command == ("convert",) and name not in POINTS):
            assert done.status == 0, done.err
        else:
            assert done.status in (0, 1, 2), done.err
        assert done.status == 0 or done.err.count("\n") == 1
        if done.status == 0 and command[0] != "convert":
            assert len(rows_of(run("apply", "--transform", "{}", "-i", f"made.{form}", "-f", "csv", "--quiet").out)) == 2


@pytest.mark.parametrize("form", [form for form in ARRAYS if form not in ("las", "laz")])
@pytest.mark.parametrize("names", ["matrix", "rpy", "mrp"])
@pytest.mark.parametrize("head", ["x,y,z,", ""])
def test_a_pose_or_a_rotation_is_read_back_in_every_notation(run: Run, form: str, names: str, head: str) -> None:
    row = ["1,2,3,"] * bool(head)
    given = f"{head}qx,qy,qz,qw\n{''.join(row)}0.0,0.0,0.6,0.8\n"
    assert into(run, ("convert", "--to", names), "in.csv", given, form).status == 0
    back = rows_of(run("convert", "-i", f"made.{form}", "--to", "quaternion", "-f", "csv", "--quiet").out)
    assert [float(back[0][name]) for name in ("qx", "qy", "qz", "qw")] == pytest.approx([0, 0, 0.6, 0.8], abs=1e-6)


@pytest.mark.parametrize("form", ARRAYS)
@pytest.mark.parametrize("name", POINTS)
def test_points_stay_points_through_every_form(run: Run, name: str, form: str) -> None:
    assert into(run, ("convert",), name, POINTS[name], form).status == 0
    rows = rows_of(run("convert", "-i", f"made.{form}", "-f", "csv", "--quiet").out)
    assert [[float(row[axis]) for axis in "xyz"] for row in rows] == [[1, 2, 3], [4, 5, 6]]
    assert "qw" not in rows[0]
    for text in ("json", "yaml"):
        out = run("convert", "-i", f"made.{form}", "-f", text, "--quiet").out
        assert ("point" in out, "quaternion" in out) == (True, False)
    assert run("convert", "-i", f"made.{form}", "-f", "tum", "--quiet").status == 1


@pytest.mark.parametrize("form", ["parquet", "arrow", "npy"])
def test_other_keys_go_into_columns_and_back(run: Run, form: str) -> None:
    assert into(run, ("convert",), "in.jsonl", POSES["poses.jsonl"], form).err == ""
    back = [json.loads(line) for line in run("convert", "-i", f"made.{form}", "-f", "json").out.splitlines()]
    nest = RECORD["nest"] if form != "npy" else json.dumps(RECORD["nest"])
    assert [each[key] for each in back for key in ("id", "label", "ok", "nest")] == [1, "a", True, nest] * 2


@pytest.mark.parametrize("form", ARRAYS)
def test_what_a_form_has_no_place_for_is_told_by_its_name(run: Run, form: str) -> None:
    done = into(run, ("convert",), "in.csv", POINTS["points.csv"], form)
    there = rows_of(run("convert", "-i", f"made.{form}", "-f", "csv", "--quiet").out)[0].keys()
    assert [name for name in ("id", "label", "gain") if name not in there and name not in done.err] == []
    if "id" in there:
        assert rows_of(run("convert", "-i", f"made.{form}", "-f", "csv", "--quiet").out)[1]["id"] == "9007199254740993"


@pytest.mark.parametrize("form", OTHERS)
@pytest.mark.parametrize("kind", [">f8", ">f4", "<f2", "g", "<i4"])
def test_numbers_of_every_type_go_into_every_form(run: Run, tmp_path: Path, kind: str, form: str) -> None:
    np.save(tmp_path / "in.npy", np.array([[1, 2, 3], [4, 5, 6]], kind))
    assert run("convert", "-i", "in.npy", "-f", form, "-o", f"made.{form}").status == 0
    rows = rows_of(run("convert", "-i", f"made.{form}", "-f", "csv", "--quiet").out)
    assert [[float(row[axis]) for axis in "xyz"] for row in rows] == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("form", OTHERS)
def test_fields_of_every_type_go_along_or_are_told(run: Run, tmp_path: Path, form: str) -> None:
    fields = {"big": ">u2", "tag": "S3", "text": "U4", "flag": "?", "when": "M8[ns]", "pair": ("f4", (2,)), "odd": "c8", "p q": "u1"}
    records = np.zeros(2, [*((axis, "f4") for axis in "xyz"), *((name, *np.atleast_1d(kind)) if isinstance(kind, str) else (name, *kind) for name, kind in fields.items())])
    np.save(tmp_path / "in.npy", records)
    done = run("apply", "--transform", "{}", "-i", "in.npy", "-f", form, "-o", f"made.{form}")
    assert done.status == 0
    there = rows_of(run("convert", "-i", f"made.{form}", "-f", "csv", "--quiet").out)[0].keys()
    assert [name for name in fields if name not in there and name not in done.err] == []


def test_extra_bytes_that_nothing_describes_go_along(run: Run, tmp_path: Path) -> None:
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.add_extra_dim(laspy.ExtraBytesParams("ExtraBytes", "3u1"))
    data = laspy.LasData(header)
    data.x = data.y = data.z = np.array([1.0, 2.0])
    data["ExtraBytes"] = np.array([[1, 2, 3], [4, 5, 6]])
    data.write(str(tmp_path / "in.las"))
    rows = rows_of(run("convert", "-i", "in.las", "-f", "csv").out)
    assert [row["ExtraBytes"] for row in rows] == ["[1, 2, 3]", "[4, 5, 6]"]
    for form in ARRAYS:
        if form in ("las", "laz"):
            continue
        done = run("convert", "-i", "in.las", "-f", form, "-o", f"made.{form}")
        assert done.status == 0
        if form == "parquet":
            first = json.loads(run("convert", "-i", "made.parquet", "-f", "json").out.splitlines()[0])
            assert first["ExtraBytes"] == [1, 2, 3]


@pytest.mark.parametrize("form", OTHERS)
def test_a_cloud_without_points_keeps_its_columns(run: Run, tmp_path: Path, form: str) -> None:
    np.save(tmp_path / "in.npy", np.zeros(0, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("ring", "u2")]))
    assert run("convert", "-i", "in.npy", "-f", form, "-o", f"made.{form}").status == 0
    header = run("convert", "-i", f"made.{form}", "-f", "csv", "--quiet").out
    assert {"x", "y", "z", "ring"} <= set(header.strip().split(","))
    assert header.count("\n") == 1
