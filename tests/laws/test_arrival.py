"""What a pipe brings in pieces gives the same bytes as what is there at once; what a command writes, the next one reads."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

import pytest
from make_ways import made
from pieces import CUTS, Pieces, comment_first, linewise, piped

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

ROWS = 3
TREE = {"robot.yaml": made("robot.yaml", 0), "arm.urdf": made("arm.urdf", 0), "site.yaml": made("site.yaml", 0)}
A = "'{name: lidar, parent: map, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'"
MOVE = f"apply --transform {A}"
POSES = (MOVE, "convert --to rpy_deg", "convert -f json", "invert", "invert -f csv", "relative --first", f"compose {A} -", "mean -")
POINTS = (MOVE, f"{MOVE} -f json", f"{MOVE} -f csv")
READ = {
    **dict.fromkeys(("poses.csv", "stamped.csv", "poses.tsv", "semicolon.csv", "poses.jsonl", "poses.json", "pretty.json", "poses.yaml"), POSES),
    **dict.fromkeys(("flat.jsonl", "degrees.jsonl", "pose_stamped.yaml", "pose_stamped.jsonl", "odometry.yaml", "odometry.jsonl"), POSES),
    **dict.fromkeys(("walk.tum", "walk.kitti", "euroc.csv", "graph.g2o", "sigmas.csv", "uncertain.jsonl"), POSES),
    **dict.fromkeys(("transform_stamped.yaml", "transform_stamped.jsonl", "tf.yaml", "tf.jsonl"), ("convert --to rpy_deg", "invert", "convert -f csv")),
    **dict.fromkeys(("pose_array.yaml", "pose_array.jsonl"), (MOVE, "convert -f csv")),
    **dict.fromkeys(("points.csv", "crlf.csv", "points.txt", "point_stamped.yaml", "point_stamped.jsonl"), POINTS),
    **dict.fromkeys(("framed.csv", "points.jsonl", "points.json", "points.yaml"), ("apply robot.yaml map", "apply robot.yaml map -f json")),
    **dict.fromkeys(("ascii.pcd", "binary.pcd", "points.npy"), (f"{MOVE} -f csv",)),
    **dict.fromkeys(("gps.csv", "fixes.jsonl"), ("convert --to utm", "apply site.yaml map")),
    **dict.fromkeys(("bad.csv", "bad.jsonl", "bad.json", "bad.yaml", "bad.tum"), (f"{MOVE} --on-error skip", "convert --on-error null -f csv")),
    "bare.csv": ("convert --from xyzw --to rpy_deg", f"{MOVE} --from xyzw"),
    "poses.txt": ("convert --from xyzw --to rpy_deg", "invert --from xyzw"),
    "angles.csv": ("convert --from rpy_deg --to matrix", "convert -f json"),
    "joints.csv": ("fk arm.urdf arm_base tool",),
    "postures.yaml": ("fk arm.urdf arm_base tool",),
}  # fmt: skip
WHOLE: dict[tuple[str, str], Outcome] = {}


def cases() -> list[Any]:
    """Pair lines, files and cuts."""
    return [
        pytest.param(line, name, cut, id=f"{line.replace(A, 'A')} < {name}, {cut}")
        for name, some in READ.items()
        for line in some
        for cut in CUTS
    ]


def came(run: Run, line: str, stdin: object) -> Outcome:
    return run(*shlex.split(line), stdin=stdin, files=TREE)


@pytest.mark.parametrize(("line", "name", "cut"), cases())
def test_pieces_give_the_bytes_of_the_whole(run: Run, line: str, name: str, cut: str) -> None:
    data = made(name, 7 if name.startswith("bad") else ROWS)
    if (line, name) not in WHOLE:
        WHOLE[line, name] = came(run, line, data)
    assert came(run, line, Pieces(CUTS[cut](data))) == WHOLE[line, name]


TREES = ("robot.yaml", "drive.yaml", "site.yaml", "arm.urdf", "tf.yaml", "walk.tum")
ASKED = {"robot.yaml": "map lidar", "drive.yaml": "map lidar", "site.yaml": "map antenna", "arm.urdf": "arm_base tool", "tf.yaml": "odom base", "walk.tum": "world body"}


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("line", ["lookup - FRAMES -f json", "tree - -f json", "check -", "monitor - -f json"])
def test_a_tree_may_arrive_in_pieces(run: Run, line: str, name: str, cut: str) -> None:
    data = made(name, ROWS)
    line = line.replace("FRAMES", ASKED[name]) + (" --frames world,body" if name == "walk.tum" else "")
    whole = came(run, line, data)
    assert whole.status == 0
    assert came(run, line, Pieces(CUTS[cut](data))) == whole


FIRST = {
    "convert --to rpy -i walk.tum": "a trajectory with other columns",
    "convert -i walk.tum": "a trajectory",
    "convert -f json -i walk.tum": "records",
    "convert -f ros2 -i stamped.csv": "messages",
    "invert -i poses.csv": "a table",
    "convert --to rpy_deg -i angles.csv": "a table of rotations",
    f"{MOVE} -i poses.yaml": "documents",
    f"{MOVE} -i pretty.json": "an array over several lines",
    f"compose {A} - -i poses.json": "an array",
    "relative --first -i walk.tum": "a trajectory with more columns",
    "invert -i walk.kitti": "rows of matrices",
    "convert -i walk.tum -f euroc": "EuRoC",
    "convert -i walk.tum -f g2o": "a pose graph",
    "convert -i walk.tum --to matrix -f csv": "a table of matrices",
    "fk arm.urdf arm_base tool -i joints.csv": "joints and poses",
    "lookup drive.yaml map base_link --times 0:3:1 -f tum": "what was looked up",
    "resample walk.tum --rate 20": "what was resampled",
}
B = "'{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'"
SECOND = (
    "convert --to quaternion", "convert --to rpy_deg -f csv", "invert", f"compose {B} -", f"apply --transform {B} --as pose", "mean - -f json",
    "relative --first -f json",
)  # fmt: skip


@pytest.mark.parametrize("second", SECOND)
@pytest.mark.parametrize("first", FIRST, ids=FIRST.values())
def test_what_a_command_writes_the_next_one_reads(run: Run, first: str, second: str) -> None:
    files = TREE | {each: made(each, ROWS) for each in shlex.split(first) if "." in each and each not in TREE and each[0] != "{"}
    written = run(*shlex.split(first), files=files)
    assert written.status == 0, written.err
    whole = came(run, second, written.out)
    if "distance" in written.out and "relative" in second:
        assert "would appear twice" in whole.err
    else:
        assert whole.status == 0, whole.err
    for cut in (linewise, comment_first):
        assert came(run, second, Pieces(cut(written.out.encode()))) == whole


@pytest.mark.parametrize(("line", "name"), [("convert --to rpy_deg", "walk.tum"), ("invert -f csv", "pose_stamped.yaml"), (f"{MOVE} -f json", "points.csv")])
def test_a_pipe_of_the_system_may_pause(run: Run, line: str, name: str) -> None:
    data = made(name, ROWS)
    whole = came(run, line, data)
    with piped(comment_first(data), pause=0.05) as stream:
        assert came(run, line, stream) == whole
    with piped(CUTS["byte by byte"](data), pause=0.0) as stream:
        assert came(run, line, stream) == whole
