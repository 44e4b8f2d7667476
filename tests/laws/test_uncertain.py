"""Covariances and scale are carried alike by every way in which a record comes, and by every form it leaves in."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from ways import STREAMS, given, values, ways

from frametool.covariance import compose, invert, point
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from conftest import Outcome
    from ways import Run

ROOT = np.random.default_rng(5).normal(size=(6, 6)) * 0.03
WHOLE = [float(entry) for entry in ((ROOT @ ROOT.T + (ROOT @ ROOT.T).T) / 2.0).ravel()]
SIGMAS = [0.01, 0.02, 0.03, 0.04, 0.05, 0.06]
DIAGONAL = [SIGMAS[i] ** 2 if i == j else 0.0 for i in range(6) for j in range(6)]
POSE: dict[str, Any] = {"xyz": [1.0, 2.0, 3.5], "quaternion": {"x": 0.5, "y": -0.5, "z": 0.5, "w": 0.5}}
CELLS = {"x": 1.0, "y": 2.0, "z": 3.5, "qx": 0.5, "qy": -0.5, "qz": 0.5, "qw": 0.5}
OTHER: dict[str, Any] = {"xyz": [0.5, -1.0, 0.25], "quaternion": {"x": 0.0, "y": 0.6, "z": 0.0, "w": 0.8}}
ROW, B = (Transform.from_arrays(each["xyz"], list(each["quaternion"].values())) for each in (POSE, OTHER))
NAMES = [f"c{i}{j}" for i in range(1, 7) for j in range(1, 7)]
SIGMA_CELLS = dict(zip(("sigma_x", "sigma_y", "sigma_z", "sigma_roll", "sigma_pitch", "sigma_yaw"), SIGMAS, strict=True))
MIXED = {"sigma_x_mm": 10.0, "sigma_y": 0.02, "sigma_z [cm]": 3.0, "sigma_roll": 0.04, "sigma_pitch": 0.05, "sigma_yaw": 0.06}
SPELLINGS: dict[str, tuple[dict[str, Any], dict[str, Any], list[float]]] = {
    "none": ({}, {}, [0.0] * 36),
    "entries": ({"covariance": WHOLE}, dict(zip(NAMES, WHOLE, strict=True)), WHOLE),
    "rows": ({"covariance": np.reshape(WHOLE, (6, 6)).tolist()}, {}, WHOLE),
    "keys of sigmas": (MIXED, MIXED, DIAGONAL),
    "keys of entries": (dict(zip(NAMES, WHOLE, strict=True)), {}, WHOLE),
    "one column": ({"sigma_xyz": 0.02}, {"sigma_xyz": 0.02}, [0.0004 * (i == j < 3) for i in range(6) for j in range(6)]),
    "sigmas": ({"sigma": {"xyz": SIGMAS[:3], "rpy": SIGMAS[3:]}}, SIGMA_CELLS, DIAGONAL),
}
EXACT, UNSURE = json.dumps(OTHER), json.dumps(OTHER | {"covariance": DIAGONAL})
COMMANDS: dict[str, tuple[tuple[str, ...], Any]] = {
    "invert": (("invert",), lambda c: invert(ROW, c)),
    "compose before": (("compose", UNSURE), lambda c: compose(B, DIAGONAL, ROW, c)),
    "compose exact": (("compose", EXACT), lambda c: compose(B, None, ROW, c)),
    "relative": (("relative", UNSURE), lambda c: compose(B.inverse(), invert(B, DIAGONAL), ROW, c)),
    "apply": (("apply", "--transform", EXACT), lambda c: compose(B, None, ROW, c)),
    "apply --covariance": (("apply", "--covariance", "--transform", UNSURE), lambda c: compose(B, DIAGONAL, ROW, c)),
    "world axes": (("convert", "--world-axes", "ned_from_enu"), None),
    "axes": (("convert", "--axes", "frd_from_flu"), lambda c: c),
}


def covariances(done: Outcome, form: str) -> list[list[float]]:
    """Read the covariances of all results; of rows those of their columns."""
    if form != "csv":
        return [np.ravel(each["covariance"]).tolist() for each in flat(values(done.out, form))]
    return [[float(row[name]) for name in NAMES] for row in csv.DictReader(io.StringIO(done.out))]


def flat(found: Any) -> list[Any]:
    return [each for value in found for each in (value if isinstance(value, list) else [value])]


def wanted(command: str, own: list[float]) -> Any:
    if command == "world axes":
        turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        both = np.kron(np.eye(2), turn)
        return (both @ np.reshape(own, (6, 6)) @ both.T).ravel()
    return np.ravel(COMMANDS[command][1](own))


@pytest.mark.parametrize("form", ["argument", "file", *STREAMS])
@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize("command", COMMANDS)
def test_each_way_and_each_form_gives_the_same_covariance(run: Run, command: str, spelling: str, form: str) -> None:
    arguments, _ = COMMANDS[command]
    beside, cells, own = SPELLINGS[spelling]
    if form == "file" and command.startswith("apply"):
        return  # its files are those of -i, as streams
    if (spelling == "none" and "UNSURE" not in repr(arguments) and UNSURE not in arguments) or (form == "table" and spelling in ("rows", "keys of entries")):
        return
    expected = wanted(command, own)
    record, row = {"id": 7} | POSE | beside | {"note": "x"}, {"id": 7} | CELLS | cells | {"note": "x"}
    for way in ways(form, record, row):
        bits = set()
        for out in ("json", *([] if way.rows > 1 else ["csv", "yaml"]), *[None] * (way.argument == "-")):
            told = ("-f", out) if out else ()
            done = given(run, (*arguments, *told), way)
            assert done.status == 0, done.err
            found = covariances(done, out or ("csv" if form == "table" else "yaml" if "documents" in form else "json"))
            assert len(found) == way.rows
            assert np.allclose(found, expected, rtol=1e-14, atol=1e-17), (way, out)
            bits |= {tuple(map(repr, each)) for each in found}
            assert "sigma" not in done.out
            assert out == "csv" or form == "table" or "c11" not in done.out
            assert "note" in done.out
            if command not in ("axes", "apply"):
                assert all(np.array_equal(np.reshape(each, (6, 6)), np.reshape(each, (6, 6)).T) for each in found)
        assert len(bits) == 1


@pytest.mark.parametrize("form", ["argument", "file", *STREAMS[:-1]])
@pytest.mark.parametrize("command", COMMANDS)
def test_that_of_a_message_stays_where_it_stands(run: Run, command: str, form: str) -> None:
    if form == "file" and command.startswith("apply"):
        return
    body = {"position": dict(zip("xyz", POSE["xyz"], strict=True)), "orientation": POSE["quaternion"]}
    message = {"header": {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "base"}, "pose": {"pose": body, "covariance": WHOLE}}
    for way in ways(form, message):
        done = given(run, (*COMMANDS[command][0], "-f", "json"), way)
        assert done.status == 0, done.err
        for each in flat(values(done.out)):
            found = each.get("covariance", each.get("pose", {}).get("covariance"))
            assert np.allclose(found, wanted(command, WHOLE), rtol=1e-14, atol=1e-17)


@pytest.mark.parametrize("form", ["argument", *STREAMS])
@pytest.mark.parametrize(("size", "own"), [(0, None), (9, [4.0, 0.5, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 9.0])])
def test_points_too(run: Run, form: str, size: int, own: list[float] | None) -> None:
    record = {"point": [1.0, 2.0, 3.5]} | ({"covariance": own} if own else {})
    cells = {"x": 1.0, "y": 2.0, "z": 3.5} | (dict(zip((n for n in NAMES if n[1] < "4" and n[2] < "4"), own, strict=True)) if own else {})
    expected = point(B, DIAGONAL, [1.0, 2.0, 3.5], own)
    for way in ways(form, record, cells):
        done = given(run, ("apply", "--covariance", "--transform", UNSURE, "-f", "json"), way)
        assert done.status == 0, done.err
        for each in flat(values(done.out)):
            assert np.allclose(each["covariance"], expected, rtol=1e-14, atol=1e-17)
    assert size in (0, 9)


@pytest.mark.parametrize("form", ["argument", "file", *STREAMS[:-1]])
def test_scale_is_carried(run: Run, form: str) -> None:
    similar = json.dumps(OTHER | {"scale": 2.0})
    for way in ways(form, POSE | {"scale": 4.0, "id": 7}):
        for command, scale in ((("invert",), 0.25), (("compose", similar), 8.0), (("compose", EXACT), 4.0)):
            for out in ("json", "csv", "yaml"):
                done = given(run, (*command, "-f", out), way)
                rows = list(csv.DictReader(io.StringIO(done.out))) if out == "csv" else flat(values(done.out, out))
                assert [float(each["scale"]) for each in rows] == [scale] * way.rows
            done = given(run, (*command, "-f", "json", "--to", "matrix"), way)
            for each in flat(values(done.out)):
                assert "scale" not in each
                assert np.linalg.det(np.array(each["matrix"])[:3, :3]) == pytest.approx(scale**3, rel=1e-14)
            assert given(run, (*command, "-f", "tum"), way).status == 1


def test_a_similarity_moves_points_vectors_and_poses(run: Run) -> None:
    pose = json.dumps(OTHER | {"scale": 2.0})

    def by(record: Any) -> Any:
        return json.loads(run("apply", "--transform", pose, json.dumps(record), "-f", "json").out)

    turned = B.apply_vector([1.0, 2.0, 3.5])
    assert by({"point": [1.0, 2.0, 3.5]})["point"] == pytest.approx((2.0 * turned + np.array(OTHER["xyz"])).tolist(), rel=1e-15)
    assert by({"vector": [1.0, 2.0, 3.5]})["vector"] == pytest.approx((2.0 * turned).tolist(), rel=1e-15)
    moved = by(POSE)
    assert "scale" not in moved
    assert moved["xyz"] == pytest.approx((2.0 * turned + np.array(OTHER["xyz"])).tolist(), rel=1e-15)
    for record in ({"linear": [1, 2, 3], "angular": [1, 2, 3]}, POSE | {"covariance": WHOLE}, {"point": [1, 2, 3], "covariance": WHOLE[:1] * 9}):
        done = run("apply", "--transform", pose, json.dumps(record))
        assert done.status == 1
        assert "cannot be carried through a scale" in done.err


BAD: dict[str, Any] = {
    "sigma and covariance in one entry; keep one": {"sigma": {"xyz": 1}, "covariance": WHOLE},
    "covariance has 21 numbers; 36 are needed (6x6, row-major: x y z, turns about X Y Z)": {"covariance": WHOLE[:21]},
    "covariance[0] is -1: 'unknown' in ROS; leave the covariance out": {"covariance": [-1.0, *WHOLE[1:]]},
    "covariance is not symmetric: [0][4] is 1e-5, [4][0] is 2e-5": {
        "covariance": [1.0 if at % 7 == 0 else {4: 1e-5, 24: 2e-5}.get(at, 0.0) for at in range(36)]
    },
    "covariance is not positive: its smallest eigenvalue is -1e-4": {"covariance": [(-1e-4 if at == 35 else 1.0) if at % 7 == 0 else 0.0 for at in range(36)]},
    "sigma is negative: -0.1": {"sigma": {"xyz": -0.1}},
}


@pytest.mark.parametrize("form", ["argument", "file", *STREAMS[:-1]])
@pytest.mark.parametrize("why", BAD)
def test_what_is_no_covariance_is_refused_with_its_place(run: Run, why: str, form: str) -> None:
    for way in ways(form, POSE | BAD[why]):
        for command in (("invert",), ("compose", EXACT), ("relative", EXACT)):
            done = given(run, command, way)
            assert (done.status, done.out.strip("[\n]")) == (1, "")
            assert why in done.err.splitlines()[0]
            assert done.err.startswith(f"frametool: {way.source}:1") or form in ("documents", "file")


def test_rows_without_a_covariance_are_bad_one_by_one(run: Run) -> None:
    bad = [-1.0, *WHOLE[1:]]
    lines = [",".join([*CELLS, *NAMES])]
    lines += [",".join(map(repr, [*CELLS.values(), *each])) for each in (WHOLE, bad, WHOLE)]
    done = run("invert", "--on-error", "skip", stdin="\n".join(lines) + "\n")
    assert (done.status, done.out.count("\n")) == (3, 3)
    assert "stdin:3:c11: covariance[0] is -1: 'unknown' in ROS" in done.err
    done = run("invert", stdin="x,y,z,sigma_x\n1,2,3,-0.5\n")
    assert (done.status, "stdin:2:sigma_x: sigma is negative: -0.5" in done.err) == (1, True)


def test_units_of_sigma_columns_count(run: Run) -> None:
    text = "x,y,z,yaw,sigma_x_mm,sigma_y [cm],sigma_z (m),sigma_yaw_deg\n0,0,0,0,10,2,0.03,180\n"
    row = next(csv.DictReader(io.StringIO(run("compose", EXACT, "-", "--to", "rpy", stdin=text).out)))
    assert "sigma_x_mm" not in row
    turn = B.rotation.as_matrix()
    placed = np.diag([0.01**2, 0.02**2, 0.03**2])
    assert np.allclose([[float(row[f"c{i}{j}"]) for j in (1, 2, 3)] for i in (1, 2, 3)], turn @ placed @ turn.T, rtol=1e-13, atol=1e-18)
    assert "unknown unit 'ft'" in run("invert", stdin="x,y,z,sigma_x_ft\n1,2,3,1\n").err
    assert run("convert", "--to", "xyzw", stdin="x,y,z,yaw,sigma_x_ft\n1,2,3,0,1\n").status == 0


def test_a_mirror_a_mean_and_a_fraction_have_none(run: Run) -> None:
    done = run("convert", "--all-axes", "unity_from_ros", json.dumps(POSE | {"covariance": WHOLE}))
    assert (done.status, "cannot be carried through axes that mirror" in done.err) == (1, True)
    pose = json.dumps(POSE | {"covariance": WHOLE})
    for command in (("mean", pose, pose), ("interpolate", pose, pose, "0.5")):
        done = run(*command)
        assert (done.status, "covariance:" in done.out) == (0, command[0] == "mean")  # of the rows, not of what they have
        assert f"covariances left out: {command[0]} has none" in done.err.replace("mean's is that of the rows", "mean has none")
    assert "covariances left out: mean's is that of the rows" in run("mean", stdin="x,y,z,sigma_x\n1,2,3,0.5\n").err


def test_converting_leaves_a_covariance_as_it_is_written(run: Run) -> None:
    line = '{"xyz": [1, 2, 3], "rpy": [0, 0, 1], "covariance": [' + ", ".join(["1"] + ["0"] * 35) + "]}\n"
    assert json.loads(run("convert", line, "-f", "json").out)["covariance"] == [1.0, *[0.0] * 35]
    assert line.partition('"covariance"')[2] in run("convert", "--to", "rpy_deg", stdin=line).out


def test_a_matrix_is_a_similarity_where_it_is_asked_for(run: Run) -> None:
    matrix = [[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]
    for argument in (json.dumps({"matrix": matrix}), "[[0,-2,0,1],[2,0,0,0],[0,0,2,0],[0,0,0,1]]"):
        assert json.loads(run("invert", "--scale", argument, "-f", "json").out)["scale"] == 0.5
        assert json.loads(run("apply", "--scale", "--transform", argument, "1", "1", "1", "-f", "json").out)["point"] == [-1.0, 2.0, 2.0]
        assert "matrix is 2 times a rotation: a similarity, not a pose (--scale of compose, invert and apply takes it)" in run("invert", argument).err
    cells = {f"m{i + 1}{j + 1}": matrix[i][j] for i in range(4) for j in range(4)}
    rows = ",".join(cells) + "\n" + ",".join(map(str, cells.values())) + "\n"
    back = np.linalg.inv(np.array(matrix, float))
    found = next(csv.DictReader(io.StringIO(run("invert", "--scale", stdin=rows).out)))
    assert np.allclose([float(found[name]) for name in cells], back.ravel(), atol=1e-15)
    found = next(csv.DictReader(io.StringIO(run("invert", "--scale", "--to", "quaternion", stdin=rows).out)))
    assert float(found["scale"]) == 0.5
    off = json.dumps({"matrix": [[2, 0, 0.5], [0, 2, 0], [0, 0, 2]]})
    assert run("invert", "--scale", off).status == 1
    assert "--scale has no effect here" in run("apply", "--scale", "tree.yaml", "a", "b", "1", "1", "1", files={"tree.yaml": "frames: {a: {b: {}}}"}).err


@pytest.mark.parametrize("form", ["argument", "file", *STREAMS[:-1]])
@pytest.mark.parametrize("spelling", ["entries", "rows", "sigmas"])
def test_inverse_true_is_that_of_the_pose_as_it_is_written(run: Run, spelling: str, form: str) -> None:
    beside, _, own = SPELLINGS[spelling]
    for way in ways(form, POSE | {"inverse": True} | beside):
        for command, expected in (
            (("convert", "--to", "quaternion"), invert(ROW, own)), (("invert",), own), (("compose", EXACT), compose(B, None, ROW.inverse(), invert(ROW, own))),
        ):  # fmt: skip
            done = given(run, (*command, "-f", "json"), way)
            assert done.status == 0, done.err
            for each in flat(values(done.out)):
                assert "inverse" not in each
                assert np.allclose(np.ravel(each["covariance"]), expected, rtol=1e-13, atol=1e-17)


def test_the_same_pose_twice_counts_as_two_and_that_is_told(run: Run) -> None:
    done = run("compose", "a.json", "inv(a.json)", files={"a.json": json.dumps(POSE | {"covariance": WHOLE})})
    assert done.err == "frametool: warning: 'a.json' appears twice: the two count as independent, as all poses do\n"
    assert run("compose", "a.json", "inv(a.json)", files={"a.json": json.dumps(POSE)}).err == ""


@pytest.mark.parametrize(
    "sigma", [{"sigma": {"xyz": "@"}}, {"sigma": {"xyz_cm": "@"}}, {"sigma": {"xyz": {"x": "@", "y": 1}}}, {"sigma": {"xyz": ["@", 0, 0], "rpy_deg": 1}}, {"sigma_x": "@"}],
)  # fmt: skip
def test_each_row_has_its_own_sigma(run: Run, sigma: Any) -> None:
    """What is learned of one record holds for those that are alike; sigmas decide."""
    lines = [json.dumps(POSE | sigma).replace('"@"', str(at % 7 + 1)) for at in range(40)]
    done = run("compose", EXACT, "-", stdin="\n".join(lines) + "\n")
    alone = [run("compose", EXACT, "-", stdin=line + "\n").out for line in lines[:7]]
    assert done.out == "".join(alone[at % 7] for at in range(40))
    assert len({*alone}) == 7


@pytest.mark.parametrize("entry", ["xyz: [1, 2, 3]", "rpy: [0, 0, 1]", "point: [1, 2, 3]", "rotvec: [0, 0, 1]"])
@pytest.mark.parametrize("count", [3, 6, 21])
def test_a_covariance_of_another_size_is_refused_where_it_is_only_copied(run: Any, entry: str, count: int) -> None:
    record = f"{{{entry}, covariance: {[0] * count}}}"
    for done in (run("convert", record), run("convert", stdin=f"{record}\n")):
        assert (done.status, done.out) == (1, "")
        assert f"covariance has {count} numbers; 36 are needed" in done.err.splitlines()[0]
    assert run("convert", f"{{{entry}, covariance: {[0] * 36}}}").status == 0


@pytest.mark.parametrize("normals", ["nx,ny,nz", "normal_x,normal_y,normal_z"])
def test_normals_turn_along_with_points_that_get_a_covariance(run: Run, normals: str) -> None:
    text = f"x,y,z,{normals}\n1.0,2.0,3.5,0.0,0.0,1.0\n"
    exact, unsure = (
        next(csv.DictReader(io.StringIO(run("apply", *option, "--transform", UNSURE, stdin=text).out)))
        for option in ((), ("--covariance",))
    )
    assert unsure == exact | {name: unsure[name] for name in NAMES if name in unsure}
    assert sum(name in unsure for name in NAMES) == 9


@pytest.mark.parametrize("sigmas", ["sigma_xyz", "sigma_x,sigma_y,sigma_z"])
def test_points_that_are_inverted_have_the_covariance_of_their_position_in_every_form(run: Run, sigmas: str) -> None:
    text = f"x,y,z,{sigmas}\n1,2,3,{','.join(['0.5'] * len(sigmas.split(',')))}\n"
    found = json.loads(run("invert", "-f", "json", stdin=text).out)
    assert found == {"point": [-1.0, -2.0, -3.0], "covariance": [0.25, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.25]}
    assert run("invert", "-o", "new.npy", stdin=text).status == 0


@pytest.mark.parametrize(
    ("kind", "form"), [("pose", "csv"), *((kind, form) for kind in ("pose", "point") for form in ("npy", "parquet"))]
)
def test_a_covariance_in_rows_becomes_the_same_columns_as_one_in_a_list(run: Any, kind: str, form: str) -> None:
    size, key = (6, POSE) if kind == "pose" else (3, {"point": [1.0, 2.0, 3.5]})
    rows = np.reshape(WHOLE, (6, 6))[:size, :size]
    texts = [json.dumps(key | {"covariance": each}) + "\n" for each in (rows.tolist(), rows.ravel().tolist())]
    (status,) = {run("convert", "-f", form, "-o", f"{at}.{form}", stdin=text).status for at, text in enumerate(texts)}
    assert status == 0
    found = [run("apply", "--transform", EXACT, "-f", "json", "-i", f"{at}.{form}").out for at in range(2)]
    assert found[0] == found[1]
    assert len(json.loads(found[0])["covariance"]) == size**2


@pytest.mark.parametrize("name", ["covariance", "field.pose.covariance7", "/odom/pose/pose/covariance[35]"])
def test_columns_of_a_covariance_by_other_names_are_not_moved_and_a_warning_says_it(run: Run, name: str) -> None:
    text = ",".join((*CELLS, name)) + "\n" + ",".join(map(str, CELLS.values())) + ",0.5\n"
    for command in (("invert",), ("apply", "--transform", EXACT)):
        done = run(*command, stdin=text)
        assert done.out.endswith(",0.5\n")
        assert done.err == f"frametool: warning: stdin: not moved: {name}; the columns of a covariance are c11, c12 ..\n"
    assert run("convert", "--to", "rpy", stdin=text).err == ""


@pytest.mark.parametrize("option", ["--first", "--consecutive"])
def test_a_pose_seen_from_itself_is_exact(run: Run, option: str) -> None:
    """The first row is; the others are seen from another pose, whose covariance counts."""
    other = OTHER | {"covariance": DIAGONAL}
    found = covariances(run("relative", option, "-f", "json", stdin="\n".join(map(json.dumps, (other, POSE | {"covariance": WHOLE}, other)))), "json")
    start, previous = ((B, DIAGONAL), (B, DIAGONAL)) if option == "--first" else ((B, DIAGONAL), (ROW, WHOLE))
    seen: list[Any] = [np.ravel(compose(a.inverse(), invert(a, sure), b, own)) for (a, sure), b, own in ((start, ROW, WHOLE), (previous, B, DIAGONAL))]
    assert np.allclose(found, [[0.0] * 36, *seen], rtol=1e-14, atol=1e-17)


@pytest.mark.parametrize("form", ["csv", "json"])
def test_a_table_of_calc_has_no_covariance_of_what_was_moved(run: Run, form: str) -> None:
    """It says that it leaves covariances out: so it does, also of columns; it adds results to rows as they are."""
    for names, cells in (("sigma_x", "1"), (",".join(f"c{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)), "1,0,0,0,1,0,0,0,1")):
        table = f"id,x,y,z,{names},note\n7,1,2,3,{cells},n\n"
        moved = run("calc", "{rpy: [0, 0, 1]} * row", "-f", form, stdin=table)
        assert moved.err == "frametool: warning: stdin: covariances left out: calc has none\n"
        assert names.partition(",")[0] not in moved.out
        assert "id" in moved.out
        assert "note" in moved.out
        added = run("calc", "-e", "a=norm(row)", stdin=table)
        assert added.err == ""
        assert names.partition(",")[0] in added.out


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_the_columns_of_a_points_covariance_become_one_list(run: Run, form: str) -> None:
    """As those of a pose do; what was written reads back."""
    table = f"x,y,z,{','.join(f'c{i}{j}' for i in (1, 2, 3) for j in (1, 2, 3))},id\n1,2,3,4,0.5,0,0.5,1,0,0,0,9,a\n"
    text = run("convert", "-f", form, stdin=table).out
    (found,) = flat(values(text, form))
    assert found == {"point": [1, 2, 3], "id": "a", "covariance": [4, 0.5, 0, 0.5, 1, 0, 0, 0, 9]}
    assert run("convert", "-f", "json", stdin=text).err == ""
    move = ("apply", "--transform", EXACT, "-f", "json")
    assert json.loads(run(*move, stdin=text).out)["covariance"] == json.loads(run(*move, stdin=table).out)["covariance"]
