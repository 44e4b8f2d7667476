"""`solve` on the command line: golden worlds in several forms, what it prints, tells, refuses and ends with."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import yaml
from console import ROOT

from frametool.formats.table import writers
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from conftest import Outcome

    Run = Callable[..., Outcome]

GOLDEN = Path(__file__).parents[1] / "golden"
TREES = {each["name"]: each for each in json.loads((GOLDEN / "solve_tree.json").read_text())["tree"]}
OTHERS = json.loads((GOLDEN / "hand_eye.json").read_text())
RIGS = {each["name"]: each for each in OTHERS["hand_eye"]}
POINTS = {each["name"]: each for each in OTHERS["points"]}
TREE_KEYS = ("shape", "root", "count", "used", "dof", "rms_distance", "rms_angle", "sigma", "noise_at", "scale_sigma", "frames", "measurements")
ROW_KEYS = ("place", "row", "id", "parent", "child", "distance", "angle", "u", "used", "checked", "fits")
HEAD = "x,y,z,qx,qy,qz,qw"


def transform(pose: dict[str, Any]) -> Transform:
    turn = pose["quaternion"]
    return Transform(Rotation.from_quaternion([turn[each] for each in "xyzw"], normalize=True), np.array(pose["xyz"]))


def cells(pose: dict[str, Any]) -> str:
    return ",".join(map(repr, [*pose["xyz"], *(pose["quaternion"][each] for each in "xyzw")]))


def mapping(of: Transform) -> dict[str, Any]:
    return {"xyz": of.xyz.tolist(), "quaternion": dict(zip("xyzw", of.xyzw.tolist(), strict=True))}


def message(pose: dict[str, Any]) -> dict[str, Any]:
    return {"translation": dict(zip("xyz", pose["xyz"], strict=True)), "rotation": pose["quaternion"]}


def entries(out: str) -> dict[str, dict[str, Any]]:
    return {each["name"]: each for each in json.loads(out)["frames"]}


def require_near(entry: dict[str, Any], expected: dict[str, Any], *, within: float = 3e-8) -> None:
    found, wanted = transform(entry), Transform(Rotation.from_quaternion(expected["xyzw"], normalize=True), np.array(expected["xyz"]))
    metres, radians = found.distance(wanted)
    assert max(metres, radians) < within
    if expected.get("covariance") is not None:
        covariance = np.reshape(expected["covariance"], (6, 6))
        sigmas = np.sqrt(np.diag(covariance))
        assert np.abs((np.reshape(entry["covariance"], (6, 6)) - covariance) / np.outer(sigmas, sigmas)).max() < 2e-7


# --- trees ---


def tree_file(world: dict[str, Any], form: str) -> dict[str, str]:
    rows = world["measurements"]
    text = {
        "yaml": lambda: yaml.safe_dump({"measurements": rows}, default_flow_style=None, width=10_000),
        "json": lambda: json.dumps({"measurements": rows}),
        "jsonl": lambda: "".join(f"{json.dumps(row)}\n" for row in rows),
    }[form]()
    return {f"m.{form}": text, "fix.json": json.dumps({"frames": world["fix"]})}


def each_in_turn(names: Iterable[str], forms: Sequence[str]) -> list[Any]:
    """Pair names with forms: each with one of them in turn, the other pairs are large tests."""
    pairs = [(name, form, at % len(forms) == place) for at, name in enumerate(names) for place, form in enumerate(forms)]
    return [pytest.param(name, form, marks=() if is_turn else pytest.mark.large) for name, form, is_turn in pairs]


@pytest.mark.parametrize(("name", "form"), each_in_turn(TREES, ["yaml", "json", "jsonl"]))
def test_golden_worlds_are_solved_whatever_form_they_are_written_in(name: str, form: str, run: Run) -> None:
    world = TREES[name]
    fixed = ["--fix", "fix.json"] if world["fix"] else []
    arguments = (f"m.{form}", "--root", world["root"], *fixed, "--report", "r.json", "-f", "json")
    done = run("solve", *arguments, files=tree_file(world, form))
    assert (done.status, " rejected" in done.err) == (0, bool(world["left_out"])), done.err
    found, report = entries(done.out), json.loads(Path("r.json").read_text())
    for frame, expected in world["frames"].items():
        if frame in found and found[frame].get("parent") == world["root"]:
            require_near(found[frame], expected)
    assert {str(row["row"]): row["fits"] for row in report["measurements"] if not row["used"]} == world["left_out"]
    assert [row["row"] for row in report["measurements"] if not row["checked"]] == world["unchecked"]
    assert report["rms_distance"] == pytest.approx(world["rms_distance"], abs=1e-8)
    for words in world["left_out"].values():
        assert f"fits when {words}\n" in done.err


def test_frames_of_fix_keep_their_entries_to_the_bit(run: Run) -> None:
    world = TREES["a fixed pair"]
    (kept,) = world["fix"]
    done = run("solve", "m.json", "--fix", "fix.json", "-f", "json", files=tree_file(world, "json"))
    found = entries(done.out)[kept["name"]]
    assert (found["parent"], found["xyz"], found["quaternion"]) == (kept["parent"], kept["xyz"], kept["quaternion"])
    assert "covariance" not in found
    fixed = {"frames": [kept | {"sigma": {"xyz": 0.001, "rpy_deg": 0.1}}]}
    files = tree_file(world, "json") | {"fix.json": json.dumps(fixed)}
    found = entries(run("solve", "m.json", "--fix", "fix.json", "-f", "json", files=files).out)[kept["name"]]
    assert found["covariance"][0] == 0.001**2


LOOP = """\
measurements:
  - {parent: base_link, child: lidar, xyz: [1.2, 0, 1.8], id: tape}
  - {parent: base_link, child: camera, xyz: [1.5, 0, 1.2]}
  - {parent: lidar, child: camera, xyz: [0.301, 0, -0.6]}
  - {parent: base_link, child: lidar, xyz: [1.201, 0, 1.8]}
  - {parent: camera, child: lidar, xyz: [0.3, 0, -0.6]}
  - {parent: lidar, child: tag_7, xyz: [3, 1, -1.6]}
"""
TOLD = """\
frametool: m.yaml: 6 rows, each the pose of child in parent: base_link<-lidar ..
frametool: warning: 2 loops do not tell metres from radians: the sigmas are rough; give sigma
frametool: in no loop, cannot be cross-checked: m.yaml:7
4 frames from 5 of 6 measurements, 4 in loops; rms 0.5 mm 6.7e-05 deg
noise of one axis 0.5 mm 2.9e-03 deg, estimated
  frame           x       y       z  sigma mm      deg  rows
  base_link                                                3  root
  lidar      1.2002  0.0000  1.8000       0.3  1.8e-03     4
  camera     1.5006  0.0000  1.2000       0.4  2.2e-03     2
  tag_7      4.2002  1.0000  0.2000       0.6  3.4e-03     1  unchecked
left out                  off mm  deg
  m.yaml:6 camera<-lidar  1341.8  0.0  fits when inverted
frametool: warning: 1 outlier rejected; --no-robust uses all rows
"""


def test_the_summary_stands_on_stderr_and_the_tree_on_stdout(run: Run) -> None:
    done = run("solve", "m.yaml", files={"m.yaml": LOOP})
    assert done.err == TOLD
    assert done.status == 0
    assert done.out.startswith("frames:\n  - {name: base_link}\n  - {name: lidar, parent: base_link, xyz: [1.2002")
    quiet = run("solve", "m.yaml", "--quiet")
    assert (quiet.out, quiet.status) == (done.out, 0)
    lines = TOLD.splitlines(keepends=True)
    assert quiet.err == "".join([lines[1], *lines[-3:]])


def test_the_report_has_its_fields_in_json_and_its_rows_in_csv(run: Run) -> None:
    run("solve", "m.yaml", "--report", "r.json", files={"m.yaml": LOOP})
    report = json.loads(Path("r.json").read_text())
    assert tuple(report) == TREE_KEYS
    assert (report["shape"], report["root"], report["count"], report["used"], report["dof"]) == ("tree", "base_link", 6, 5, 6)
    assert [each["name"] for each in report["frames"]] == ["base_link", "lidar", "camera", "tag_7"]
    assert all(tuple(each) == ("name", "parent", "sigma", "rows", "checked") for each in report["frames"])
    assert {*report["frames"][1]["sigma"]} == {"xyz", "rpy_deg"}
    first, *_, wrong, last = report["measurements"]
    assert tuple(first) == ROW_KEYS
    assert (first["place"], first["row"], first["id"], first["parent"], first["child"]) == ("m.yaml:2", 1, "tape", "base_link", "lidar")
    assert (wrong["used"], wrong["fits"], wrong["place"], last["checked"]) == (False, "inverted", "m.yaml:6", False)
    assert wrong["distance"] == pytest.approx(1.3419, abs=1e-3)
    run("solve", "m.yaml", "--report", "r.csv")
    rows = [*csv.DictReader(io.StringIO(Path("r.csv").read_text()))]
    assert tuple(rows[0]) == ROW_KEYS
    assert (rows[4]["used"], rows[4]["fits"], rows[0]["used"], rows[1]["id"], rows[0]["id"]) == ("false", "inverted", "true", "", "tape")


@pytest.mark.parametrize("shape", ["m.yaml", "--hand-eye s.json", "--points a.csv b.csv"])
def test_text_fits_80_columns_whatever_the_names(shape: str, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    long = "a_very_long_name_of_a_frame_on_a_robot_that_somebody_has_built"
    files = {"m.yaml": LOOP.replace("lidar", long), **samples_file("3 of 20 wrong"), **points_files("3 of 15 wrong", "csv")}
    done = run("solve", *shape.split(), "-f", "text", files=files)
    told = [line for line in done.err.splitlines() if not line.startswith("frametool: ")]
    assert done.status == 0
    assert max(map(len, told)) <= 80


def test_rows_are_left_out_by_their_place(run: Run) -> None:
    done = run("solve", "m.yaml", "--without", "m.yaml:6", files={"m.yaml": LOOP})
    assert (done.status, "4 frames from 5 of 5 measurements" in done.err) == (0, True)
    assert run("solve", "m.yaml", "--no-robust").status == 0


def test_the_same_bytes_come_out_of_every_run_whatever_the_threads(tmp_path: Path) -> None:
    rows = TREES["three inverted"]["measurements"]
    (tmp_path / "m.json").write_text(json.dumps({"measurements": rows}))
    outs = set()
    for threads in ("1", "4"):
        environment = os.environ | {"OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads, "PYTHONPATH": str(Path(__file__).parents[2])}
        done = subprocess.run([sys.executable, "-m", "frametool", "solve", "m.json", "--report", "r.json", "--force"], cwd=tmp_path, env=environment, capture_output=True, check=False)
        outs.add((done.stdout, done.stderr, (tmp_path / "r.json").read_bytes(), done.returncode))
    assert len(outs) == 1


def test_the_result_is_a_tree_that_the_other_commands_read(run: Run) -> None:
    run("solve", "m.yaml", "-o", "t.yaml", files={"m.yaml": LOOP})
    found = json.loads(run("lookup", "t.yaml", "camera", "tag_7", "--covariance", "-f", "json").out)
    assert len(found["covariance"]) == 36
    assert run("view", "t.yaml").status == 0
    checked = run("check", "t.yaml", "--measured", "m.yaml")
    assert "m.yaml:6" in checked.err + checked.out
    assert "urdf: covariances left out" in run("tree", "t.yaml", "-f", "urdf").err
    again = run("solve", "m.yaml", "-o", "t.yaml")
    assert (again.status, again.err.splitlines()[-1]) == (5, "frametool: t.yaml: exists; give --force to replace it")


@pytest.mark.parametrize("form", [form for form in writers("tree") if form not in ("yaml", "json", "text")])
def test_every_form_of_trees_is_written_and_tells_once_what_it_loses(form: str, run: Run) -> None:
    done = run("solve", "--points", "a.csv", "b.csv", "-f", form, "-o", "tree", files=points_files("points", "csv"))
    assert done.status == 0, done.err
    assert done.err.count("covariances left out") == 1


def test_csv_keeps_covariances_and_reads_back_as_measurements(run: Run) -> None:
    done = run("solve", "m.yaml", "-f", "csv", files={"m.yaml": LOOP})
    assert "covariances" not in done.err
    first = next(csv.DictReader(io.StringIO(done.out)))
    assert {"name", "parent", "x", "qw", "c11", "c66"} <= {*first}


SPLIT = "parent,child,x,y,z,qx,qy,qz,qw\na,b,1,0,0,0,0,0,1\nc,d,1,0,0,0,0,0,1\n"
OPEN = "parent,child,x,y,z,qx,qy,qz,qw\na,b,1,0,0,0,0,0,1\nb,c,1,0,0,0,0,0,1\na,c,2.412,0,0,0,0,0,1\n"
ROW = "measurements:\n  - {{parent: a, child: b, {}}}\n"
MOVES = "frames:\n  - {name: lidar, parent: base_link, samples: [{stamp: 0, xyz: [1, 0, 0]}, {stamp: 1, xyz: [2, 0, 0]}]}\n"
BAD: tuple[tuple[str, dict[str, str], int, str], ...] = (
    ("split.csv", {"split.csv": SPLIT}, 1, "no measurement connects a, b | c, d"),
    ("open.csv", {"open.csv": OPEN}, 1,
     "undecided: open.csv:2, open.csv:3, open.csv:4 form a loop open by 412.0 mm 0.0 deg; measure again or leave one out (--without open.csv:4)"),
    ("m.yaml", {"m.yaml": "measurements: 5\n"}, 1, "m.yaml:1:15: expected a list of measurements, found '5'"),
    ("m.yaml", {"m.yaml": ""}, 1, "m.yaml: no measurements in it"),
    ("m.csv", {"m.csv": "x\n1\n2\n"}, 1, "m.csv:1: no columns of a point or pose among: x"),
    ("m.csv", {"m.csv": "parent,child,x,y,z,qx,qy,qz,qw\na,b,nan,0,0,0,0,0,1\n"}, 1, "m.csv:2:x: 'nan' is not finite"),
    ("m.yaml", {"m.yaml": ROW.format("xyz: [1, 0]")}, 1, "m.yaml:2:32: expected 3 numbers (x y z), found 2"),
    ("m.yaml", {"m.yaml": ROW.format("xyz: [1, 0, 0]").replace("child: b", "child: a")}, 1, "m.yaml:2: 'a' is measured from itself"),
    ("m.yaml", {"m.yaml": ROW.format("xyz: [1, 0, 0], sigma: {xyz: 0, rpy: 0.1}")}, 1, "--fix"),
    ("m.yaml", {"m.yaml": ROW.format("xyz: [1, 0, 0], sigma: {xyz: 0.1}")}, 1, "m.yaml:2: sigma of roll is 0"),
    ("m.yaml", {"m.yaml": ROW.format("xyz: [1, 0, 0], scale: 2")}, 1, "scale: a similarity, not a pose"),
    ("m.yaml", {"m.yaml": ROW.format("quaternion: {x: 0, y: 0, z: 0, w: 2}")}, 1, "normalize it with --normalize"),
    ("m.yaml", {"m.yaml": MOVES}, 1, "m.yaml:2:38: a frame that moves is not solved for"),
    ("m.yaml --root lida", {"m.yaml": LOOP}, 1, "unknown root 'lida'; did you mean 'lidar'?"),
    ("m.yaml --without m.yaml:99", {"m.yaml": LOOP}, 1, "no measurement stands at 'm.yaml:99'"),
    ("m.yaml --fix f.yaml", {"m.yaml": LOOP, "f.yaml": MOVES}, 1, "f.yaml: 'lidar' moves; fixed frames must be static"),
    ("m.yaml --fix f.yaml", {"m.yaml": LOOP, "f.yaml": "{name: x, parent: base_lnk, xyz: [1, 0, 0]}\n"}, 1,
     "f.yaml: no frame of it is measured: 'base_lnk'; did you mean 'base_link'?"),
    ("missing.yaml", {}, 5, "missing.yaml: no such file or directory"),
    ("m.yaml -o t.yaml --report t.yaml", {"m.yaml": LOOP}, 2, "'t.yaml' does not end in .json or .csv"),
    ("m.yaml -o t.json --report t.json", {"m.yaml": LOOP}, 2, "--report and -o name one file"),
)  # fmt: skip


@pytest.mark.parametrize(("arguments", "files", "status", "message"), BAD)
def test_bad_measurements_are_one_line_with_their_place(arguments: str, files: dict[str, str], status: int, message: str, run: Run) -> None:
    done = run("solve", *arguments.split(), "--quiet", files=files)
    assert (done.status, done.out) == (status, "")
    assert message in done.err
    first = next(line for line in done.err.splitlines() if not line.startswith("frametool: warning"))
    assert first.startswith("frametool: ")
    assert len(first) <= 280 if status == 2 else len(first) <= 200


def test_the_errors_of_trees_are_exact(run: Run) -> None:
    for arguments, files, _, message in BAD[:2]:
        assert run("solve", arguments, "--quiet", files=files).err == f"frametool: {message}\n"


# --- hand-eye ---


def samples_file(name: str) -> dict[str, str]:
    rig = RIGS[name]
    return {"s.json": json.dumps([{"gripper": g, "target": t} for g, t in zip(rig["gripper"], rig["target"], strict=True)])}


def pose_files(name: str, form: str) -> dict[str, str]:
    files = {}
    for side, letter in (("gripper", "g"), ("target", "t")):
        poses = RIGS[name][side]
        if form == "csv":
            files[f"{letter}.csv"] = "".join(f"{line}\n" for line in [HEAD, *map(cells, poses)])
        elif form == "tum":
            files[f"{letter}.tum"] = "".join(f"{at} {cells(pose).replace(',', ' ')}\n" for at, pose in enumerate(poses))
        else:
            files[f"{letter}.jsonl"] = "".join(f"{json.dumps(pose)}\n" for pose in poses)
    return files


def flags(name: str) -> Sequence[str]:
    return ("--eye-to-hand",) if RIGS[name]["eye_to_hand"] else ()


@pytest.mark.parametrize(("name", "form"), each_in_turn(RIGS, ["csv", "tum", "jsonl", "samples"]))
def test_golden_rigs_are_solved_whatever_form_they_are_written_in(name: str, form: str, run: Run) -> None:
    rig = RIGS[name]
    files = samples_file(name) if form == "samples" else pose_files(name, form)
    done = run("solve", "--hand-eye", *files, *flags(name), "-f", "json", "--report", "r.json", files=files)
    assert (done.status, " rejected" in done.err) == (0, bool(rig["left_out"])), done.err
    holder, other = ("base", "gripper") if rig["eye_to_hand"] else ("gripper", "base")
    found, report = entries(done.out), json.loads(Path("r.json").read_text())
    assert (found["camera"]["parent"], found["target"]["parent"]) == (holder, other)
    for frame, side in (("camera", "x"), ("target", "z")):
        require_near(found[frame], rig[side], within=1e-6)
    assert tuple(report) == TREE_KEYS
    assert (report["shape"], report["noise_at"]) == ("hand-eye", rig["noise_at"])
    assert [row["row"] for row in report["measurements"] if not row["used"]] == rig["left_out"]
    for row in report["measurements"]:
        if form in ("csv", "tum"):
            assert row["place"] == f"t.{form}:{row['row'] + (form == 'csv')}"
        if not row["used"]:
            assert f"  {row['place']} row {row['row']} " in done.err


EASY = "easy.samples"


def easy(rig: dict[str, Any], second: str) -> str:
    """Write samples as easy_handeye does: with the eye beside the robot its base in the gripper."""
    given = [mapping(transform(pose).inverse()) for pose in rig["gripper"]] if rig["eye_to_hand"] else rig["gripper"]
    return yaml.safe_dump({"samples": [{"robot": message(g), second: message(t)} for g, t in zip(given, rig["target"], strict=True)]})


def moveit(rig: dict[str, Any]) -> str:
    pairs = [[transform(pose).as_matrix().ravel().tolist() for pose in both] for both in zip(rig["gripper"], rig["target"], strict=True)]
    return yaml.safe_dump([{"effector_wrt_world": g, "object_wrt_sensor": t} for g, t in pairs])


@pytest.mark.parametrize("name", ["noise about the target", "eye to hand"])
@pytest.mark.parametrize("write", [moveit, lambda rig: easy(rig, "tracking"), lambda rig: easy(rig, "optical")])
def test_samples_of_other_tools_are_read(name: str, write: Callable[[dict[str, Any]], str], run: Run) -> None:
    done = run("solve", "--hand-eye", "s.samples", *flags(name), "-f", "json", files={"s.samples": write(RIGS[name])})
    assert done.status == 0, done.err
    require_near(entries(done.out)["camera"], RIGS[name]["x"] | {"covariance": None}, within=1e-6)


def test_what_robot_means_is_told(run: Run) -> None:
    files = {EASY: easy(RIGS["eye to hand"], "tracking")}
    told = "frametool: robot is taken for gripper<-base, inverted, as easy_handeye has it with --eye-to-hand\n"
    assert told in run("solve", "--hand-eye", EASY, "--eye-to-hand", files=files).err
    assert "frametool: robot is taken for base<-gripper, as easy_handeye has it without --eye-to-hand\n" in run("solve", "--hand-eye", EASY).err


def test_names_come_from_the_option_else_from_the_rows(run: Run) -> None:
    rig = RIGS["noise about the target"]
    rows = [
        {"gripper": g | {"parent": "world", "name": "flange"}, "target": t | {"parent": "cam", "name": "board"}}
        for g, t in zip(rig["gripper"], rig["target"], strict=True)
    ]
    done = run("solve", "--hand-eye", "s.json", "-f", "json", files={"s.json": "".join(f"{json.dumps(row)}\n" for row in rows)})
    assert {name: each.get("parent") for name, each in entries(done.out).items()} == {"flange": None, "world": None, "cam": "flange", "board": "world"}
    named = run("solve", "--hand-eye", "s.json", "-f", "json", "--names", "a,b,c,d")
    assert {name: each.get("parent") for name, each in entries(named.out).items()} == {"b": None, "a": None, "c": "b", "d": "a"}
    rows[3]["target"]["name"] = "other"
    done = run("solve", "--hand-eye", "s.json", files={"s.json": "".join(f"{json.dumps(row)}\n" for row in rows)})
    assert done.err == "frametool: s.json:4: 'other' is 'board' in other samples\n"


@pytest.mark.parametrize(("name", "mount", "other"), [("exact", "true", "robot_effector_frame: gripper"), ("eye to hand", "false", "robot_base_frame: base")])
def test_a_calibration_of_easy_handeye_holds_the_camera(name: str, mount: str, other: str, run: Run) -> None:
    done = run("solve", "--hand-eye", "s.json", *flags(name), "-f", "handeye", "-o", "c.yaml", files=samples_file(name))
    text = Path("c.yaml").read_text()
    assert f"eye_on_hand: {mount}\n" in text
    assert other in text
    assert done.err.count("left out") == 1
    holder = other.rsplit(maxsplit=1)[-1]
    found = json.loads(run("lookup", "c.yaml", holder, "camera", "--in", "handeye", "-f", "json").out)
    require_near(found, RIGS[name]["x"] | {"covariance": None}, within=1e-6)


def stamped(poses: Sequence[dict[str, Any]], *offsets: float) -> str:
    rows = [(10 + at + off, pose) for at, pose in enumerate(poses) for off in offsets]
    return f"stamp,{HEAD}\n" + "".join(f"{at:.3f},{cells(pose)}\n" for at, pose in rows)


def test_stamped_poses_are_interpolated_else_the_nearest_else_told(run: Run) -> None:
    rig = RIGS["noise about the target"]
    files = {"g.csv": stamped(rig["gripper"], -0.02, 0.02), "t.csv": stamped([*rig["target"], rig["target"][0]], 0.0)}
    done = run("solve", "--hand-eye", "g.csv", "t.csv", "-f", "json", files=files)
    require_near(entries(done.out)["camera"], rig["x"], within=1e-6)
    assert "frametool: warning: t.csv: 1 of 16 poses have none of g.csv within 50 ms: unpaired\n" in done.err
    assert done.status == 0
    nearest = run("solve", "--hand-eye", "g.csv", "t.csv", "--max-gap", "30ms", "-f", "json")
    require_near(entries(nearest.out)["camera"], rig["x"], within=1e-6)
    none = run("solve", "--hand-eye", "g.csv", "t.csv", "--max-gap", "5ms")
    assert (none.status, none.err) == (
        1, "frametool: no pose of g.csv is within 5 ms of one of t.csv: their stamps are 0.020 s apart at least; one clock? --max-gap\n",
    )  # fmt: skip


def one_axis() -> dict[str, str]:
    turns = [Transform(Rotation.from_rotvec([0, 0, angle]), np.array([angle, 0, 0])) for angle in (0.0, 0.4, 0.9, 1.5, 2.0)]
    x, z = Transform(Rotation.from_rpy([0.1, 0.2, 0.3]), np.array([0.1, 0, 0])), Transform(Rotation.from_rpy([1, 0, 0]), np.array([1.0, 0, 0]))
    rows = [{"gripper": mapping(g), "target": mapping((g @ x).inverse() @ z)} for g in turns]
    return {"s.json": json.dumps(rows)}


def short(count: int) -> dict[str, str]:
    files = pose_files("noise about the target", "csv")
    return files | {"t.csv": "".join(files["t.csv"].splitlines(keepends=True)[: count + 1])}


SAMPLE = "- {{gripper: {}, target: {{rpy: [0, 0, 0]}}}}\n"
HAND_EYE: tuple[tuple[str, dict[str, str], str], ...] = (
    ("g.csv t.csv", short(14), "g.csv has 15 poses, t.csv 14, and no stamps to pair them"),
    ("s.json", {"s.json": json.dumps(json.loads(samples_file("exact")["s.json"])[:2])}, "2 samples; hand-eye needs 3, turned about two axes"),
    ("s.json", one_axis(), "all turns are about one axis (0.000 0.000 1.000 in gripper): where camera is along it cannot be known; turn about a second one"),
    ("s.yaml", {"s.yaml": ""}, "s.yaml: no samples in it; each is {gripper: POSE, target: POSE}"),
    ("s.yaml", {"s.yaml": "- 5\n"}, "s.yaml:1:3: expected a sample {gripper: POSE, target: POSE}, found '5'"),
    ("s.yaml", {"s.yaml": "- {gripper: {rpy: [0, 0, 0]}}\n"}, "s.yaml:1:3: missing target beside gripper"),
    ("s.yaml", {"s.yaml": SAMPLE.format("{xyz: [1, 0, 0]}")}, "s.yaml:1:13: the pose has no rotation"),
    ("s.yaml", {"s.yaml": SAMPLE.format("[1, 2, 3]")}, "s.yaml:1:13: a bare list of 3 numbers does not say what it is; write {rpy_deg: [..]}, {xyzw: [..]}, .."),
    ("s.yaml", {"s.yaml": SAMPLE.format("{rpy: [0, nan, 0]}")}, "s.yaml:1:23: 'nan' is not finite"),
    ("g.csv t.csv", {"g.csv": "x,y,z\n1,2,3\n", "t.csv": f"{HEAD}\n1,2,3,0,0,0,1\n"}, "g.csv: positions alone are not poses: rotations are needed here"),
    ("g.csv t.csv", {"g.csv": f"{HEAD}\n1,2,3,0,0,0,2\n", "t.csv": ""}, "g.csv:2:qx: quaternion 0 0 0 2 has norm 2; a rotation needs norm 1 (normalize it with --normalize)"),
)  # fmt: skip


@pytest.mark.parametrize(("arguments", "files", "message"), HAND_EYE)
def test_bad_samples_are_one_line_with_their_place(arguments: str, files: dict[str, str], message: str, run: Run) -> None:
    done = run("solve", "--hand-eye", *arguments.split(), "--quiet", files=files)
    assert (done.status, done.out, done.err.splitlines()[0]) == (1, "", f"frametool: {message}")


def test_samples_the_wrong_way_round_are_named(run: Run) -> None:
    done = run("solve", "--hand-eye", "s.json", "--quiet", files=samples_file("eye to hand"))
    assert done.status == 1
    assert done.err.startswith("frametool: the samples do not fit (404.7 mm 6.3 deg); they do (1.2 mm 0.1 deg) with --eye-to-hand, or with TARGET inverted")


# --- points ---


def points_files(name: str, form: str) -> dict[str, str]:
    case, files = POINTS[name], {}
    for side, letter in (("target", "a"), ("source", "b")):
        rows = [dict(zip(("id", "x", "y", "z"), row, strict=True)) for row in case[side]]
        if case["weights"] and letter == "a":
            rows = [row | {"weight": weight} for row, weight in zip(rows, case["weights"], strict=True)]
        if form == "csv":
            files[f"{letter}.csv"] = "".join(f"{line}\n" for line in [",".join(rows[0]), *(",".join(map(str, row.values())) for row in rows)])
        elif form == "yaml":
            files[f"{letter}.yaml"] = yaml.safe_dump([{"name": r["id"], "xyz": [r["x"], r["y"], r["z"]]} | {k: r[k] for k in ("weight",) if k in r} for r in rows])
        else:
            files[f"{letter}.jsonl"] = "".join(f"{json.dumps(row)}\n" for row in rows)
    return files


@pytest.mark.parametrize(("name", "form"), each_in_turn(POINTS, ["csv", "jsonl", "yaml"]))
def test_golden_points_are_solved_whatever_form_they_are_written_in(name: str, form: str, run: Run) -> None:
    case, files = POINTS[name], points_files(name, form)
    scale = ("--scale",) if case["scaled"] else ()
    done = run("solve", "--points", *files, *scale, "-f", "json", "--report", "r.json", files=files)
    assert (done.status, " rejected" in done.err) == (0, bool(case["left_out"])), done.err
    entry = json.loads(done.out) if scale else entries(done.out)["B"]
    assert (entry["name"], entry["parent"]) == ("B", "A")
    require_near(entry, case["pose"])
    assert entry.get("scale", 1.0) == pytest.approx(case["scale"], rel=1e-10)
    report = json.loads(Path("r.json").read_text())
    assert tuple(report) == TREE_KEYS
    sigmas = np.sqrt(np.diag(np.reshape(case["pose"]["covariance"], (6, 6))))
    assert report["frames"][1]["sigma"]["xyz"] == pytest.approx(sigmas[:3], rel=1e-7)
    assert report["frames"][1]["sigma"]["rpy_deg"] == pytest.approx(np.degrees(sigmas[3:]), rel=1e-7)
    assert report["scale_sigma"] == (None if case["scale_sigma"] is None else pytest.approx(case["scale_sigma"], rel=1e-6))
    assert [row["id"] for row in report["measurements"] if not row["used"]] == case["left_out"]
    assert report["rms_distance"] == pytest.approx(case["rms_distance"], rel=1e-6)


def test_the_order_of_rows_does_not_matter_where_ids_match_them(run: Run) -> None:
    files = points_files("points", "csv")
    head, *rows = files["b.csv"].splitlines(keepends=True)
    one = run("solve", "--points", "a.csv", "b.csv", files=files)
    other = run("solve", "--points", "a.csv", "b.csv", files={"b.csv": "".join([head, *rows[::-1]])})
    assert one.out == other.out


@pytest.mark.parametrize("form", ["text", "csv", "yaml"])
def test_a_scale_stands_beside_the_pose_and_apply_takes_it(form: str, run: Run) -> None:
    done = run("solve", "--points", "a.csv", "b.csv", "--scale", "-f", form, files=points_files("scale", "csv"))
    assert "scale" in done.out
    assert done.status == 0
    assert {"text": "sigma  ", "csv": "c66", "yaml": "covariance: ["}[form] in done.out
    if form == "yaml":
        moved = run("apply", "--transform", "t.yaml", "-i", "b.csv", "-f", "csv", files={"t.yaml": done.out})
        assert moved.err == "frametool: warning: t.yaml: its covariance is not used (--covariance)\n"
        found = np.array([[float(row[axis]) for axis in "xyz"] for row in csv.DictReader(io.StringIO(moved.out))])
        assert np.abs(found - [row[1:] for row in POINTS["scale"]["target"]]).max() < 0.01
    refused = run("solve", "--points", "a.csv", "b.csv", "--scale", "-f", "ros2")
    assert (refused.status, refused.err) == (1, "frametool: ros2 has no place for a scale; write json, yaml or csv\n")


def test_what_has_no_partner_is_counted_and_named(run: Run) -> None:
    files = points_files("points", "csv")
    files["b.csv"] = "".join(files["b.csv"].splitlines(keepends=True)[:-2]) + "extra,1,2,3\n"
    done = run("solve", "--points", "a.csv", "b.csv", files=files)
    assert "frametool: warning: a.csv: 2 of 8 points have no partner in b.csv: p6, p7\n" in done.err
    assert "frametool: warning: b.csv: 1 of 7 points have no partner in a.csv: extra\n" in done.err
    assert done.status == 0


def test_points_without_ids_are_matched_by_row(run: Run) -> None:
    files = {name: "".join(f"{line.partition(',')[2]}\n" for line in text.splitlines()) for name, text in points_files("points", "csv").items()}
    done = run("solve", "--points", "a.csv", "b.csv", "-f", "json", files=files)
    require_near(entries(done.out)["B"], POINTS["points"]["pose"])
    assert "8 matched by row" in done.err


LINE = "id,x,y,z\na,0,0,0\nb,1,0,0\nc,2,0,0\n"
FLAT = "id,x,y,z\na,0,0,0\nb,1,0,0\nc,0,1,0\n"
FOUR = "id,x,y,z\na,0,0,0\nb,1,0,0\nc,0,1,0\nd,0,0,1\n"
BAD_POINTS: tuple[tuple[str, str, str], ...] = (
    ("id,x,y,z\na,0,0,0\nb,1,0,0\n", FLAT, "2 matched points; 3 are needed, not on a line"),
    (LINE, FLAT, "the points lie on a line: the turn about it cannot be known"),
    (FOUR + "e,1,1,1\n", FOUR.replace("d,0,0,1", "d,0,0,-1") + "e,1,1,-1\n", "a mirror image fits"),
    (FLAT + "a,1,1,1\n", FLAT, "a.csv:5: id 'a' appears twice, first at a.csv:2"),
    (FLAT.replace("b,", ","), FLAT, "a.csv:3: no id, the others have one"),
    ("id,x,y,z,weight\na,0,0,0,1\nb,1,0,0,-2\nc,0,1,0,1\n", FLAT, "a.csv:3: weight is negative: -2"),
    ("id,x,y,z,weight\na,0,0,0,1\nb,1,0,0,x\nc,0,1,0,1\n", FLAT, "a.csv:3: weight: 'x' is not a number"),
    ("x,y,z\n0,0,0\n", "x,y,z\n0,0,0\n1,0,0\n", "a.csv has 1 points, b.csv 2, and no ids to match them"),
    (FLAT, "id,x,y,z\nq,0,0,0\n", "a.csv and b.csv have no id in common: a, b, c | q"),
    ("id,x,y,z\na,nan,0,0\n", FLAT, "a.csv:2:x: 'nan' is not finite"),
    ("id\na\n", FLAT, "a.csv:1: no columns of a point or pose among: id"),
)  # fmt: skip


@pytest.mark.parametrize(("a", "b", "message"), BAD_POINTS)
def test_bad_points_are_one_line_with_their_place(a: str, b: str, message: str, run: Run) -> None:
    done = run("solve", "--points", "a.csv", "b.csv", "--quiet", files={"a.csv": a, "b.csv": b})
    assert (done.status, done.out) == (1, "")
    line = next(each for each in done.err.splitlines() if "have no partner" not in each)
    assert line.startswith(f"frametool: {message}")
    assert len(line) <= 200


# --- usage ---

USAGE: tuple[tuple[str, str], ...] = (
    ("m.yaml --scale", "--scale needs --points"),
    ("m.yaml --eye-to-hand --max-gap 5ms --names a,b", "--eye-to-hand needs --hand-eye"),
    ("m.yaml --max-gap 5ms", "--max-gap needs --hand-eye"),
    ("m.yaml --names a,b", "--names needs --hand-eye or --points"),
    ("--hand-eye a b --root c", "--root and --hand-eye exclude each other"),
    ("--hand-eye a b --fix c", "--fix and --hand-eye exclude each other"),
    ("--points a b --without c:1", "--without and --points exclude each other"),
    ("--hand-eye samples.json --max-gap 5ms --quiet", "--max-gap has no effect here"),
    ("--hand-eye samples.json --dh modified --quiet", "--dh has no effect here"),
    ("--hand-eye a b c", "--hand-eye takes GRIPPER TARGET, or one file of SAMPLES, found 3 files"),
    ("--points a", "--points takes two files, A B, found 1"),
    ("--points points_a.csv points_b.csv --topic d --quiet", "--topic has no effect here"),
    ("--points a b --hand-eye", "--hand-eye and --points exclude each other"),
    ("--points a b --names c", "--names takes two names, A,B"),
    ("--hand-eye a b --names c,d", "--names takes four names, BASE,GRIPPER,CAMERA,TARGET"),
    ("--points a b --names c,c", "--names takes two names, A,B; no two may be the same"),
    ("- -", "standard input can be read once; only one argument may be -"),
    ("m.yaml --force", "--force needs --output"),
    ("m.yaml --report r.html", "'r.html' does not end in .json or .csv"),
)  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), USAGE)
def test_options_of_another_shape_are_usage_errors(arguments: str, message: str, run: Run) -> None:
    names = {"points_a.csv": "points_a.csv", "points_b.csv": "points_b.csv", "samples.json": "hand_eye_samples.json"}
    done = run("solve", *arguments.split(), files={name: (ROOT / "examples" / file).read_bytes() for name, file in names.items()})
    assert (done.status, done.out) == (2, "")
    assert message in done.err.splitlines()[-1]
    assert done.err.count("\n") == 1 or message == "--topic has no effect here"  # seen when the points were read


def test_max_gap_needs_stamps(run: Run) -> None:
    done = run("solve", "--hand-eye", "g.csv", "t.csv", "--max-gap", "5ms", files=pose_files("exact", "csv"))
    assert (done.status, "--max-gap is not used: g.csv has no stamps" in done.err) == (2, True)


def test_help_is_one_screen(run: Run) -> None:
    text = run("solve", "--help").out
    assert len(text.splitlines()) <= 60
    assert max(map(len, text.splitlines())) <= 80


def test_exact_data_come_out_to_1e_12(run: Run) -> None:
    assert math.isclose(json.loads(run("solve", "--hand-eye", "s.json", "-f", "json", files=samples_file("exact")).out)["frames"][2]["xyz"][0], RIGS["exact"]["x"]["xyz"][0], abs_tol=1e-12)


def test_the_names_of_rows_are_those_of_the_frames(run: Run) -> None:
    """Columns parent and name name base, gripper, camera and target, as --names would."""
    files = {}
    for file, parent, name in (("gripper.csv", "base_link", "tool0"), ("target.csv", "cam", "board")):
        header, *rows = (Path(__file__).parents[2] / "examples" / file).read_text().splitlines()
        files[f"g_{file}"] = "\n".join([f"parent,name,{header}", *(f"{parent},{name},{row}" for row in rows)]) + "\n"
    done = run("solve", "--hand-eye", "g_gripper.csv", "g_target.csv", "-f", "json", files=files)
    entries = json.loads(done.out)["frames"]
    assert [(each["name"], each.get("parent")) for each in entries if "parent" in each] == [("cam", "tool0"), ("board", "base_link")]
    assert "left out: the frames" not in done.err
