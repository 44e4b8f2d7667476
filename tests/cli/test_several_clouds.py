"""Several clouds into one: each from its own frame, the columns that all have, nothing replaced in silence."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

TREE = "frames: {map: {left: {xyz: [10, 0, 0]}, right: {xyz: [0, 10, 0], rpy_deg: [0, 0, 90]}}}"
PLY = "ply\nformat ascii 1.0\nelement vertex {}\n{}end_header\n{}"


def ply(names: str, *rows: str, kind: str = "float") -> str:
    return PLY.format(len(rows), "".join(f"property {kind} {each}\n" for each in names.split()), "\n".join([*rows, ""]))


A = ply("x y z intensity", "1 2 3 0.5", "4 5 6 0.25")
B = ply("x y z intensity", "1 0 0 7")
FILES: dict[str, str | bytes] = {"t.yaml": TREE, "a.ply": A, "b.ply": B}
BOTH = ("-i", "a.ply", "-i", "b.ply")
MOVED = "x,y,z,intensity\n11.0,2.0,3.0,0.5\n14.0,5.0,6.0,0.25\n"


def rows(run: Run, name: str, *options: str) -> str:
    return str(run("convert", "-i", name, "-f", "csv", "--quiet", *options).out)


@pytest.mark.parametrize("frames", [("--frames", "left,right"), ("--frames", "left", "--frames", "right")])
@pytest.mark.parametrize("form", ["ply", "pcd", "npy"])
def test_each_is_moved_from_its_own_frame(run: Run, frames: tuple[str, ...], form: str) -> None:
    done = run("apply", "t.yaml", "map", *BOTH, *frames, "-o", f"all.{form}", files=FILES)
    assert done.status == 0
    assert done.err.splitlines()[-1] == "frametool: 2 clouds in map as one, from left, right; metres"
    assert rows(run, f"all.{form}") == MOVED + "0.0,11.0,0.0,7.0\n"


def test_source_is_the_frame_of_all_and_transform_moves_all(run: Run) -> None:
    assert run("apply", "t.yaml", "map", "left", *BOTH, "-o", "all.ply", files=FILES).status == 0
    assert rows(run, "all.ply") == MOVED + "11.0,0.0,0.0,7.0\n"
    assert run("apply", "--transform", "{xyz: [10, 0, 0]}", *BOTH, "-o", "too.ply").status == 0
    assert rows(run, "too.ply") == MOVED + "11.0,0.0,0.0,7.0\n"


def test_clouds_without_points_become_one_without_points(run: Run) -> None:
    files = FILES | {"a.ply": ply("x y z"), "b.ply": ply("x y z")}
    assert run("apply", "t.yaml", "map", "left", *BOTH, "-o", "all.ply", files=files).status == 0
    assert rows(run, "all.ply") == "x,y,z\n"


def test_one_by_one_gives_the_same_points(run: Run) -> None:
    run("apply", "t.yaml", "map", *BOTH, "--frames", "left,right", "-o", "all.ply", files=FILES)
    single = [
        run("apply", "t.yaml", "map", frame, "-i", name, "-f", "csv", "--quiet").out.splitlines()
        for name, frame in (("a.ply", "left"), ("b.ply", "right"))
    ]
    lines = [line.removeprefix("frame,").removeprefix("map,") for line in (*single[0], *single[1][1:])]
    assert rows(run, "all.ply").splitlines() == lines


def test_columns_that_not_all_have_are_left_out_and_told_and_normals_turn(run: Run) -> None:
    names = "x y z nx ny nz"
    files = FILES | {"a.ply": ply(f"{names} gain", "1 2 3 1 0 0 9"), "b.ply": ply(names, "1 0 0 1 0 0", kind="double")}
    done = run("apply", "t.yaml", "map", *BOTH, "--frames", "left,right", "-o", "all.pcd", files=files)
    assert "frametool: warning: gain left out: not all of the clouds have it\n" in done.err
    assert rows(run, "all.pcd") == "x,y,z,nx,ny,nz\n11.0,2.0,3.0,1.0,0.0,0.0\n0.0,11.0,0.0,0.0,1.0,0.0\n"


def test_clouds_without_a_header_are_told_once_or_each(run: Run, tmp_path: Path) -> None:
    kitti, nuscenes = (np.array([row], "<f4").tobytes() for row in ([1, 2, 3, 0.5], [1, 0, 0, 7, 3]))
    files: dict[str, str | bytes] = {"t.yaml": TREE, "a.bin": kitti, "b.bin": kitti, "n.bin": nuscenes}
    asked = ("apply", "t.yaml", "map", "--frames", "left,right", "-i", "a.bin", "-i")
    assert run(*asked, "b.bin", "--in", "kitti-bin", "-o", "all.bin", "-f", "kitti-bin", files=files).status == 0
    points = np.frombuffer((tmp_path / "all.bin").read_bytes(), "<f4").reshape(-1, 4).tolist()
    assert points == [[11, 2, 3, 0.5], [-2, 11, 3, 0.5]]
    done = run(*asked, "n.bin", "--in", "kitti-bin", "--in", "nuscenes-bin", "-o", "all.ply")
    assert (done.status, "ring left out" in done.err) == (0, True)
    assert rows(run, "all.ply") == "x,y,z,intensity\n11.0,2.0,3.0,0.5\n0.0,11.0,0.0,7.0\n"


FRAMES = ("--frames", "left,right", "-o", "x.ply")


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (("map", *BOTH, "-o", "x.ply"), 2, "name SOURCE, the frame of all clouds, or --frames A,B with one for each of the 2"),
        (("map", *BOTH, "--frames", "left", "-o", "x.ply"), 2, "name SOURCE, the frame of all clouds, or --frames A,B with one for each of the 2"),
        (("map", "left", *BOTH, *FRAMES), 2, "name SOURCE, the frame of all clouds, or --frames A,B with one for each of the 2"),
        (("map", *BOTH, "--frames", "left,rigth", "-o", "x.ply"), 4, "unknown frame 'rigth' in t.yaml; did you mean 'right'?"),
        (("map", "-i", "a.ply", "-i", "no.ply", *FRAMES), 5, "no.ply: no such file or directory"),
        (("map", "-i", "a.ply", "-i", "p.csv", *FRAMES), 1, "p.csv: CSV with a header, no cloud; make one of it: "),
        (("map", *BOTH, "--frames", "left,right", "-f", "csv"), 2, "several clouds become one: -o all.ply, or -f; formats: "),
        (("map", *BOTH, "--frames", "left,right"), 2, "several clouds become one: -o all.ply, or -f; formats: "),
        (("map", *BOTH, *FRAMES, "--keep"), 2, "--keep has no effect here"),
        (("map", *BOTH, *FRAMES, "--columns", "x,y,z"), 2, "--columns has no effect here"),
        (("map", "left", *BOTH, "1", "2", "3", "-o", "x.ply"), 2, "clouds are moved whole, without records, "),
        (("map", "-i", "a.ply", "-i", "-", *FRAMES), 2, "-i -: several -i are files of one cloud each"),
        (("map", "-i", "a.ply", "-i", "cut.ply", *FRAMES), 1, "cut.ply:10: expected 4 numbers (x y z intensity), found 1"),
    ],
)
def test_what_is_not_said_or_cannot_be_is_refused_and_nothing_is_written(
    run: Run, tmp_path: Path, arguments: tuple[str, ...], status: int, message: str
) -> None:
    done = run("apply", "t.yaml", *arguments, files=FILES | {"p.csv": "x,y,z\n1,2,3\n", "cut.ply": A[:-9]})
    assert (done.status, done.out) == (status, "")
    assert message in done.err.splitlines()[-1]
    assert not (tmp_path / "x.ply").exists()


@pytest.mark.parametrize("command", ["convert", "invert"])
def test_no_other_command_replaces_a_second_input_in_silence(run: Run, command: str) -> None:
    done = run(command, *BOTH, "-o", "x.ply", files=FILES)
    assert (done.status, "--input appears twice; only one can be used" in done.err) == (2, True)
