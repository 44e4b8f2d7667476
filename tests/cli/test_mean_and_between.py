"""The mean of poses with its spread, and the shortest rotation between two directions, against SciPy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

GENERATOR = np.random.default_rng(14)
COUNT = 40
TURNS = Rotation.from_rotvec(GENERATOR.normal(0.4, 0.5, (COUNT, 3)))
PLACES = GENERATOR.normal(0.0, 3.0, (COUNT, 3))
WEIGHTS = GENERATOR.uniform(0.0, 2.0, COUNT)
ROWS = np.hstack([PLACES, TURNS.as_quat()])
TABLE = "id,x,y,z,qx,qy,qz,qw,weight\n" + "".join(
    f"{index},{','.join(map(repr, row.tolist()))},{weight!r}\n"
    for index, (row, weight) in enumerate(zip(ROWS, WEIGHTS.tolist(), strict=True))
)
LINES = "".join(
    json.dumps({"xyz": row[:3], "xyzw": row[3:], "weight": weight}) + "\n"
    for row, weight in zip(ROWS.tolist(), WEIGHTS.tolist(), strict=True)
)
SPACES = "".join(f"{index} {' '.join(map(repr, row.tolist()))}\n" for index, row in enumerate(ROWS))


def mean_of(outcome: Outcome) -> dict[str, Any]:
    """Read the one result."""
    assert outcome.status == 0, outcome.err
    (line,) = outcome.out.splitlines()
    found: dict[str, Any] = json.loads(line)
    return found


def check_mean(found: dict[str, Any], weights: Any) -> None:
    """Compare with SciPy's mean and with the distances written out."""
    turn = TURNS.mean(weights)
    place = np.average(PLACES, axis=0, weights=weights)
    ours = Rotation.from_quat([found["quaternion"][name] for name in "xyzw"])
    assert (ours.inv() * turn).magnitude() < 1e-12
    np.testing.assert_allclose(found["xyz"], place, rtol=0, atol=1e-12)
    far, turned = np.linalg.norm(PLACES - place, axis=1), (turn.inv() * TURNS).magnitude()
    assert found["count"] == COUNT
    assert found["distance_rms"] == pytest.approx(np.sqrt(np.average(far**2, weights=weights)), abs=1e-12)
    assert found["distance_max"] == pytest.approx(far.max(), abs=1e-12)
    assert found["angle_rms"] == pytest.approx(np.sqrt(np.average(turned**2, weights=weights)), abs=1e-12)
    assert found["angle_max"] == pytest.approx(turned.max(), abs=1e-12)
    assert found["angle_max_deg"] == pytest.approx(np.degrees(turned.max()), abs=1e-10)


@pytest.mark.parametrize("text", [TABLE, LINES, SPACES], ids=["csv", "jsonl", "tum"])
def test_the_mean_of_a_stream_is_that_of_scipy(run: Run, text: str) -> None:
    check_mean(mean_of(run("mean", "-f", "json", stdin=text)), None)


@pytest.mark.parametrize("text", [TABLE, LINES], ids=["csv", "jsonl"])
def test_a_column_weighs_the_poses(run: Run, text: str) -> None:
    check_mean(mean_of(run("mean", "-f", "json", "--weights", "weight", stdin=text)), WEIGHTS)


@pytest.mark.parametrize("arguments", [["poses.csv"], ["-i", "poses.csv"], ["-", "-i", "poses.csv"]])
def test_a_file_is_read_however_it_is_named(run: Run, arguments: list[str]) -> None:
    check_mean(mean_of(run("mean", *arguments, "-f", "json", files={"poses.csv": TABLE})), None)


def test_poses_are_arguments_with_their_weights(run: Run) -> None:
    poses = [json.dumps({"xyz": row[:3], "xyzw": row[3:]}) for row in ROWS.tolist()]
    given = ["--weights", ",".join(map(repr, WEIGHTS.tolist()))]
    check_mean(mean_of(run("mean", *poses, *given, "-f", "json")), WEIGHTS)


def test_what_is_pasted_has_a_mean(run: Run) -> None:
    assert run("mean", "[0,0,0,1]", "[0,0,1,0]", "--from", "xyzw", "--weights", "3,1").status == 0


@pytest.mark.parametrize("text", ["x,y,z\n1,2,3\n3,4,5\n", '{"xyz":[1,2,3]}\n{"xyz":[3,4,5]}\n'])
def test_points_have_a_mean_position_and_no_rotation(run: Run, text: str) -> None:
    found = mean_of(run("mean", "-f", "json", stdin=text))
    root = dict.fromkeys(("std_x", "std_y", "std_z"), 2**0.5)
    far = {"count": 2, "distance_rms": 3**0.5, "distance_max": 3**0.5}
    assert found == {"xyz": [2.0, 3.0, 4.0], **far, **root, "covariance": [2.0] * 9}


@pytest.mark.parametrize("weights", [None, WEIGHTS])
def test_the_covariance_is_that_of_the_rows_in_the_axes_of_the_parent(run: Run, weights: Any) -> None:
    told = () if weights is None else ("--weights", "weight")
    found = mean_of(run("mean", *told, "-f", "json", stdin=TABLE))
    mass = np.ones(COUNT) if weights is None else weights
    middle = Rotation.from_quat([found["quaternion"][name] for name in "xyzw"])
    off = np.hstack([PLACES - found["xyz"], (TURNS * middle.inv()).as_rotvec()])
    want = (off * mass[:, None]).T @ off / mass.mean() / (COUNT - 1)
    np.testing.assert_allclose(np.reshape(found["covariance"], (6, 6)), want, rtol=1e-9, atol=1e-12)
    assert found["std_y"] == pytest.approx(want[1, 1] ** 0.5)
    assert found["std_angle_deg"] == pytest.approx(np.degrees(np.trace(want[3:, 3:]) ** 0.5))


def test_rotations_have_a_mean_rotation_and_no_position(run: Run) -> None:
    found = mean_of(run("mean", "-f", "json", "--from", "rpy_deg", "--to", "rpy_deg", stdin="0 0 80\n0 0 100\n"))
    assert found["rpy_deg"] == {"roll": 0.0, "pitch": 0.0, "yaw": pytest.approx(90.0, abs=1e-12)}
    assert "xyz" not in found


def test_millimetres_count_as_they_are_named(run: Run) -> None:
    assert mean_of(run("mean", "-f", "json", stdin="x_mm,y_mm,z_mm\n1000,0,0\n3000,0,0\n"))["xyz"] == [2.0, 0.0, 0.0]


def test_a_result_reads_back(run: Run) -> None:
    once = run("mean", "-f", "json", stdin=TABLE)
    again = mean_of(run("mean", "-f", "json", stdin=once.out))
    assert again["xyz"] == json.loads(once.out)["xyz"]


@pytest.mark.parametrize(
    ("stdin", "arguments", "said"),
    [
        ("", [], "nothing in it"),
        ("x,y,z\n", [], "no poses"),
        ("tag,x,y,z\n", ["--by", "tag"], "no poses"),
        ("x,y,z,weight\n1,2,3,-1\n", ["--weights", "weight"], "negative"),
        ("x,y,z,weight\n1,2,3,foo\n", ["--weights", "weight"], "'foo' is not a number"),
        ("x,y,z,weight\n1,2,3,0\n", ["--weights", "weight"], "weight"),
        ("x,y,z,w\n1,2,3,1\n", ["--weights", "wight"], "no column 'wight'"),
        ('{"xyz":[1,2,3]}\n', ["--weights", "w"], "no key 'w'"),
    ],
)
def test_what_has_no_mean_is_told(run: Run, stdin: str, arguments: list[str], said: str) -> None:
    outcome = run("mean", *arguments, stdin=stdin)
    assert outcome.status in (1, 2)
    assert outcome.out == ""
    assert said in outcome.err


def test_rotations_without_a_mean_are_refused(run: Run) -> None:
    outcome = run("mean", "{rpy_deg: [0, 0, 0]}", "{rpy_deg: [0, 0, 180]}")
    assert outcome.status == 1
    assert "so far apart that none is their mean" in outcome.err


@pytest.mark.parametrize("text", ["x,y,z\n1,2,3\nfoo,2,3\n3,2,3\n", '[1,2,3]\n["foo",2,3]\n[3,2,3]\n'])
@pytest.mark.parametrize("policy", ["skip", "null"])
def test_bad_rows_are_skipped_and_counted(run: Run, text: str, policy: str) -> None:
    outcome = run("mean", "-f", "json", "--on-error", policy, stdin=text.replace("[", '{"xyz": [').replace("]", "]}"))
    assert outcome.status == 3
    assert json.loads(outcome.out)["xyz"] == [2.0, 2.0, 3.0]


TAKEN = {
    ("--weights", "seen.weight"): '{"xyz": [0,0,0], "seen": {"weight": 1}}\n{"xyz": [4,0,0], "seen": {"weight": 3}}\n',
    ("--by", "name"): '{"name": "a", "xyz": [3,0,0]}\n{"name": "b", "xyz": [1,0,0]}\n{"name": "a", "xyz": [3,0,0]}\n',
    ("--weights", "w"): "x,y,z,w\n0,0,0,1\n4,0,0,3\n",
    ("--weights", "4"): "0,0,0,1\n4,0,0,3\n",
}


@pytest.mark.parametrize("asked", TAKEN)
def test_a_weight_or_label_is_a_column_a_key_or_a_name(run: Run, asked: tuple[str, str]) -> None:
    more = ("--no-header", "--columns", "1-3") if asked[1] == "4" else ()
    found = json.loads(run("mean", *asked, *more, "-f", "json", stdin=TAKEN[asked]).out.splitlines()[0])
    assert found["xyz"] == [3.0, 0.0, 0.0]


VECTORS = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, -2.0, 5.0], [1e-9, 1.0, 0.0], [-3.0, 0.1, 0.2], [1e200, 1e200, 0.0]]


@pytest.mark.parametrize("start", VECTORS)
@pytest.mark.parametrize("end", VECTORS)
def test_between_is_the_shortest_rotation(run: Run, start: list[float], end: list[float]) -> None:
    outcome = run("between", json.dumps(start), json.dumps(end), "-f", "json")
    found = json.loads(outcome.out)
    turn = Rotation.from_quat([found["quaternion"][name] for name in "xyzw"])
    a, b = (np.array(each) / max(map(abs, each)) for each in (start, end))
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    np.testing.assert_allclose(turn.apply(a), b, rtol=0, atol=1e-12)
    assert found["angle"] == pytest.approx(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b), abs=1e-12)


@pytest.mark.parametrize(
    "arguments",
    [
        ["1", "0", "0", "0", "-1", "0"],
        ["1,0,0", "0,-1,0"],
        ["[1 0 0]", "[0, -1, 0]"],
        ["{x: 1, y: 0, z: 0}", "{vector: [0, -2, 0]}"],
    ],
)
def test_a_vector_is_written_in_any_way(run: Run, arguments: list[str]) -> None:
    outcome = run("between", *arguments, "--to", "rpy_deg")
    right = "rpy_deg: {roll: 0.0, pitch: 0.0, yaw: -90.0}\n"
    assert outcome == (0, right + "angle: 1.5707963267948966\nangle_deg: 90.0\n", "")


@pytest.mark.parametrize("vector", [[1.0, 0.0, 0.0], [0.0, 0.0, -2.0], [1.0, 2.0, 3.0]])
def test_opposite_directions_are_half_a_turn_and_told(run: Run, vector: list[float]) -> None:
    outcome = run("between", json.dumps(vector), json.dumps([-2.0 * part for part in vector]), "-f", "json")
    found = json.loads(outcome.out)
    assert found["angle_deg"] == pytest.approx(180.0, abs=1e-9)
    assert "opposite" in outcome.err
    assert "opposite" not in run("between", json.dumps(vector), "[1, 1, 0.5]").err


@pytest.mark.parametrize(
    ("arguments", "status"), [(["1,0,0", "0,0,0"], 1), (["1,0,0"], 2), (["1", "2"], 2), (["1,0,0", "0,1,nan"], 1)]
)
def test_what_is_no_direction_is_refused(run: Run, arguments: list[str], status: int) -> None:
    outcome = run("between", *arguments)
    assert (outcome.status, outcome.out) == (status, "")
    assert outcome.err.count("\n") <= 3


# --- mean --robust -------------------------------------------------------------------------------------------------

WRONG = {3: [0.5, 0.0, 0.0], 7: [0.0, 0.0, -0.25]}
ALIKE = [
    [1 + at / 2e3 + WRONG.get(at, [0.0])[0], 2 + (at * 7 % 5) / 2e3, 3 + WRONG.get(at, [0.0] * 3)[2], 0.0, 0.0, 0.6, 0.8] for at in range(12)
]  # fmt: skip
FORMS = {
    "a.csv": "x,y,z,qx,qy,qz,qw,w\n" + "".join(",".join(map(repr, row)) + ",1\n" for row in ALIKE),
    "a.jsonl": "".join(json.dumps({"xyz": row[:3], "xyzw": row[3:], "w": 1}) + "\n" for row in ALIKE),
    "a.tum": "".join(f"{at} {' '.join(map(repr, row))}\n" for at, row in enumerate(ALIKE)),
    "a.yaml": "\n---\n".join(f"xyz: {row[:3]}\nxyzw: {row[3:]}\nw: 1" for row in ALIKE),
}
FIRST_LINES = {"a.csv": 2, "a.jsonl": 1, "a.tum": 1, "a.yaml": 1}
LINES_EACH = {"a.yaml": 4}
KEPT = [row for at, row in enumerate(ALIKE) if at not in WRONG]


def robust(run: Run, *arguments: str, **more: Any) -> Outcome:
    return run("mean", *arguments, "--robust", "-f", "json", **more)


@pytest.mark.parametrize("weights", [(), ("--weights", "w")])
@pytest.mark.parametrize("piped", [False, True])
@pytest.mark.parametrize("name", FORMS)
def test_wrong_rows_are_left_out_and_told_with_their_places(run: Run, name: str, piped: bool, weights: tuple[str, ...]) -> None:  # noqa: FBT001
    if weights and name == "a.tum":
        weights = ()
    given = {"stdin": FORMS[name]} if piped else {"files": {name: FORMS[name]}}
    found = robust(run, *(() if piped else (name,)), *weights, **given)
    plain = mean_of(run("mean", "-f", "json", stdin="".join(json.dumps({"xyz": row[:3], "xyzw": row[3:]}) + "\n" for row in KEPT)))
    assert found.status == 0
    assert json.loads(found.out) == {**plain, "count": 12, "used": 10}
    lines = [FIRST_LINES[name] + at * LINES_EACH.get(name, 1) for at in WRONG]
    where = "stdin" if piped else name
    told = [line for line in found.err.splitlines() if ": left out, " in line]
    assert [line.partition(": left out, ")[0] for line in told] == [f"frametool: warning: {where}:{line}" for line in lines]
    assert " mm 0.00 deg off (u " in told[0]


def test_arguments_left_out_are_named_by_number_or_file(run: Run) -> None:
    poses = [json.dumps({"xyz": row[:3], "xyzw": row[3:]}) for row in ALIKE]
    found = robust(run, *poses[:6], "rest.json", files={"rest.json": "[" + ", ".join(poses[6:]) + "]"})
    assert (found.status, json.loads(found.out)["used"]) == (0, 10)
    assert [line.partition(": left out")[0][20:] for line in found.err.splitlines()] == ["argument 4", "rest.json, pose 2"]


def test_rows_of_arrays_are_counted_and_bad_rows_before_are_too(run: Run) -> None:
    assert run("convert", "-i", "a.csv", "-f", "npy", "-o", "a.npy", files={"a.csv": FORMS["a.csv"]}).status == 0
    assert "a.npy: row 4: left out, " in robust(run, "a.npy").err
    broken = FORMS["a.csv"].replace("1.0005,", "none,", 1)
    found = robust(run, "a.csv", "--on-error", "skip", files={"a.csv": broken})
    assert (found.status, json.loads(found.out)["count"], json.loads(found.out)["used"]) == (3, 11, 9)
    assert "a.csv:5: left out, " in found.err


@pytest.mark.parametrize("text", [TABLE, LINES], ids=["csv", "jsonl"])
@pytest.mark.parametrize("weights", [(), ("--weights", "weight")])
def test_where_nothing_is_wrong_the_bits_are_those_of_the_plain_mean(run: Run, text: str, weights: tuple[str, ...]) -> None:
    plain = mean_of(run("mean", "-f", "json", *weights, stdin=text))
    found = robust(run, *weights, stdin=text)
    assert (found.status, found.err) == (0, "")
    assert json.loads(found.out) == {**plain, "used": COUNT}


def test_points_and_rotations_alone_are_left_out_too(run: Run) -> None:
    points = [f"{{xyz: [{1 + at / 1e3}, 0, 0]}}" for at in range(6)]
    turns = [f"{{rpy_deg: [{at / 10}, 0, 0]}}" for at in range(6)]
    for poses, wrong in ((points, "{xyz: [9, 0, 0]}"), (turns, "{rpy_deg: [90, 0, 0]}")):
        found = robust(run, *poses, wrong)
        assert (found.status, json.loads(found.out)["used"]) == (0, 6)
        assert "argument 7: left out" in found.err


def test_of_many_left_out_the_rest_are_counted(run: Run) -> None:
    rows = "x,y,z\n" + "".join(f"{at / 1e4},0,0\n" for at in range(60)) + "".join(f"{5 + at},0,0\n" for at in range(25))
    found = robust(run, stdin=rows)
    assert (found.status, found.err.count("left out")) == (0, 21)
    assert found.err.endswith("frametool: warning: 5 more poses left out\n")


def test_relative_of_two_trajectories_says_what_it_takes_and_what_compares_them(run: Run) -> None:
    row = "1 0 0 0 0 0 0 1\n"
    done = run("relative", "a.tum", "b.tum", files={"a.tum": row, "b.tum": row})
    assert (done.status, done.out) == (2, "")
    assert "only one argument may hold rows, a.tum and b.tum do; frametool compare takes two trajectories" in done.err


@pytest.mark.parametrize("stdin", [
    "stamp,x,y,z\n1,2,3,4\n", '{"stamp": 1, "xyz": [1, 2, 3]}\n', '{"stamp": 1, "xyz": [1, 2, 3]}\n{"xyz": [1, 2, 3]}\n',
    "1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1\n",
    '{"header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "a"}, "point": {"x": 1, "y": 2, "z": 3}}\n',
])  # fmt: skip
def test_stamps_that_a_mean_does_not_have_are_told_once(run: Run, stdin: str) -> None:
    assert run("mean", stdin=stdin).err.count("stamps left out: a mean is of no one time") == 1
    assert "stamps" not in run("mean", stdin="x,y,z\n1,2,3\n").err
    assert "stamps left out" in run("mean", "{stamp: 1, xyz: [1, 2, 3]}").err


TAGGED = 'tag,x,y,z\na,1,2,3\n"b, c",5,5,5\na,3,2,3\nb,0,0,0\n"b, c",5,5,6\n'


@pytest.mark.parametrize("form", ["csv", "jsonl", "parquet"])
def test_a_mean_for_each_value_of_a_column_is_that_of_its_rows(run: Run, form: str, tmp_path: Path) -> None:
    path = str(tmp_path / f"rows.{form}")
    if form == "parquet":
        pytest.importorskip("pyarrow")
    if form == "csv":
        Path(path).write_text(TAGGED)
    else:
        assert run("convert", "-o", path, "-f", "json" if form == "jsonl" else form, stdin=TAGGED).status == 0
    found = [json.loads(line) for line in run("mean", path, "--by", "tag", "-f", "json").out.splitlines()]
    assert [(each["tag"], each["xyz"], each["count"]) for each in found] == [
        ("a", [2.0, 2.0, 3.0], 2), ("b, c", [5.0, 5.0, 5.5], 2), ("b", [0.0, 0.0, 0.0], 1),
    ]
    alone = json.loads(run("mean", "-f", "json", stdin="x,y,z\n5,5,5\n5,5,6\n").out)
    assert {key: each for key, each in found[1].items() if key != "tag"} == alone


def test_a_mean_by_a_column_names_what_is_wrong(run: Run) -> None:
    assert "no column 'nope'; columns: tag, x, y, z" in run("mean", "--by", "nope", stdin=TAGGED).err
    assert run("mean", "{xyz: [1, 2, 3]}", "--by", "tag").status == 2
    assert run("mean", "--by", "tag", "--weights", "x", stdin=TAGGED).status == 2


def test_places_whose_squares_overflow_have_no_spread(run: Run) -> None:
    done = run("mean", "{xyz: [1, 2, 3]}", "{xyz: [1e300, 0, 0]}")
    assert (done.status, done.err) == (1, "frametool: poses: a place at 1e+300 m; at most 1e+100 m can be fitted\n")
    assert run("mean", "{xyz: [1, 2, 3]}", "{xyz: [1e99, 0, 0]}").status == 0


@pytest.mark.parametrize("count", [1, 40])
def test_frames_names_are_labels_too(run: Run, count: int) -> None:
    lines = ('{"xyz": [1, 2, 3], "name": "a"}\n{"xyz": [1, 2, 5], "name": "b"}\n{"xyz": [3, 2, 3], "name": "a"}\n') * count
    found = [json.loads(line) for line in run("mean", "-", "--by", "name", "-f", "json", stdin=lines).out.splitlines()]
    assert [(each["name"], each["count"], each["xyz"]) for each in found] == [("a", 2 * count, [2.0, 2.0, 3.0]), ("b", count, [1.0, 2.0, 5.0])]


@pytest.mark.parametrize("form", ["csv", "json", "arguments"])
def test_a_mean_is_in_the_frame_that_all_poses_are_in(run: Run, form: str) -> None:
    def mean(*parents: str, by: bool = False) -> Outcome:
        poses = [f'{{"parent": "{parent}", "name": "{name}", "xyz": [1, 2, {at}]}}'
                 for at, parent in enumerate(parents) for name in "ab"]  # fmt: skip
        text = run("convert", "-f", form, stdin="\n".join(poses)).out if form != "arguments" else ""
        return run("mean", *(poses * (not text)), *["--by", "name"] * by, "-f", "json", stdin=text)

    assert mean("w", "w").out.startswith('{"parent": "w", "xyz": [1.0, 2.0, 0.5]')
    assert mean("earth", "ecef").out.startswith('{"parent": "ecef",')
    apart = mean("w", "v")
    assert (apart.status, "the poses are in v, w; use one frame for all" in apart.err) == (1, True)
    if form != "arguments":
        names = [(found["name"], found["parent"]) for found in map(json.loads, mean("w", "w", by=True).out.splitlines())]
        assert names == [("a", "w"), ("b", "w")]
