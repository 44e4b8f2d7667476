"""Results of records in another form: those computed in bulk are those computed one by one, with all that is told."""

from __future__ import annotations

import csv
import json
import math
import random
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import yaml
from sized import sized

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

COUNT = 60
NUMBERS = (0, 1, -3, -0.0, 1e-9, 123456.789, 1e300, 0.1)
ODD_CUTS = (("1", '"x"'), ("0", "null"), ("}", ""), (":", ": nan ,"))
TEXTS = ("x", "a b", 'quo"te', "comma,", "é\\n\n", "null", "1", "", None, True, 1.5, [1, 2], {"a": {"b": "c"}})


def unit(rng: random.Random, digits: int) -> list[float]:
    """Return a random quaternion, rounded."""
    parts = [rng.gauss(0, 1) for _ in range(4)]
    return [round(part / math.hypot(*parts), digits) for part in parts]


def a_record(kind: str, rng: random.Random, at: int) -> dict[str, Any]:
    """Return one record of a kind."""
    xyz, q = [rng.choice(NUMBERS) for _ in range(3)], unit(rng, 17)
    position, rotation = dict(zip("xyz", xyz, strict=True)), dict(zip("xyzw", q, strict=True))
    header = {"stamp": {"sec": at, "nanosec": at * 1000}, "frame_id": rng.choice(["map", "map", "odom"])}
    made: dict[str, dict[str, Any]] = {
        "pose": {"stamp": f"{at / 100:.2f}", "xyz": xyz, "xyzw": q},
        "rough": {"t": at, "xyz": xyz, "wxyz": unit(rng, rng.choice([2, 3, 17]))},
        "degrees": {"xyz": xyz, "rpy": [rng.uniform(-9, 9) for _ in range(3)], "parent": "map", "name": "b"},
        "stamped": {"header": header, "pose": {"position": position, "orientation": rotation}, "seq": at},
        "transform": {"header": header, "child_frame_id": "b", "transform": {"translation": position, "rotation": rotation}},
        "point": {"point": xyz, "frame": "map", "stamp_ns": at, "of": {"id": at}},
        "flat": {**position, "intensity": rng.random()},
        "uncertain": {"xyz": xyz, "xyzw": q, "sigma": {"xyz": 0.1, "rpy": 0.2}},
        "place": {"xyz": xyz, "stamp": at},
        "turn": {"xyzw": q, "stamp": at},
    }
    return made[kind]


def a_stream(seed: int) -> tuple[str, bytes]:
    """Return records, in a form and layout of their own: alike, mixed, and some of them broken."""
    rng = random.Random(seed)  # noqa: S311 - the same streams in every run
    kinds = rng.sample(["pose", "rough", "degrees", "stamped", "transform", "point", "flat", "uncertain", "place", "turn"], rng.choice([1, 1, 2, 3]))
    is_mixed, has_more, is_broken = (rng.random() < part for part in (0.4, 0.5, 0.3))
    records = []
    for at in range(COUNT):
        kind = rng.choice(kinds) if is_mixed else kinds[at * len(kinds) // COUNT]
        more = {"tag": rng.choice(TEXTS), "deep": {"list": [at, {"text": rng.choice(TEXTS[:6])}]}} if has_more else {}
        records.append(a_record(kind, rng, at) | (more if rng.random() < 0.9 else {}))
    layout = rng.choice(["lines", "lines", "array", "pretty", "documents", "flow"])
    if layout == "lines":
        lines = [json.dumps(each, ensure_ascii=rng.random() < 0.5) for each in records]
        cut = (lambda line: line.replace(*rng.choice(ODD_CUTS), 1) if rng.random() < 0.1 else line) if is_broken else str
        return "json", "\n".join(map(cut, lines)).encode()
    if layout in ("array", "pretty"):
        return "json", json.dumps(records, indent=1 if layout == "pretty" else None).encode()
    texts = (yaml.safe_dump(each, sort_keys=False, default_flow_style=layout == "flow", width=10**6) for each in records)
    return "yaml", "---\n".join(texts).encode()


COMMANDS = (
    ("convert",), ("convert", "--normalize"), ("invert",), ("convert", "--to", "rpy_deg,wxyz"), ("convert", "--to", "matrix"),
    ("calc", "inv(row)"), ("calc", "-e", "n=norm(trans(row))", "-e", "back=inv(row)"), ("convert", "--precision", "3"),
)  # fmt: skip


@pytest.mark.parametrize("seed", range(64))
@pytest.mark.parametrize("form", ["csv", "tum", "npy", "yaml", "json"])
def test_in_bulk_as_one_by_one(run: Run, seed: int, form: str, tmp_path: Path) -> None:
    how, data = a_stream(seed)
    command = COMMANDS[seed % len(COMMANDS)]
    if form == "npy" and "-e" in command:
        return  # columns of numbers hold poses or points
    made = tmp_path / "made"

    def outcome(**sizes: int) -> tuple[int, str, object]:
        with sized(**sizes):
            done = run(*command, "--in", how, "-f", form, "--on-error", "skip", "-o", "made", "--force", stdin=data)
        written = made.read_bytes() if made.exists() else b""
        read = repr(np.load(made).tolist()) if written and form == "npy" else written.decode()
        made.unlink(missing_ok=True)
        return done.status, done.err, read.replace("-0.0", "0.0")

    assert outcome(few=0) == outcome(few=1000, small=1 << 30)


@pytest.mark.parametrize("more", [(), ("--velocity",)])
def test_rows_that_depend_on_those_before_are_those_of_the_table(run: Run, more: tuple[str, ...]) -> None:
    rng = random.Random(3)  # noqa: S311 - the same records in every run
    records = [a_record("pose", rng, at) | ({"tag": at} if at % 3 else {}) for at in range(300)]
    records[50]["xyzw"] = [0, 0, 0, 2]
    stdin = "\n".join(map(json.dumps, records))
    table = run("convert", "-f", "csv", "--on-error", "skip", stdin=stdin).out
    wanted = run("relative", "--consecutive", *more, stdin=table)
    found = run("relative", "--consecutive", *more, "-f", "csv", "--on-error", "skip", stdin=stdin)
    assert (wanted.status, found.status) == (0, 3)
    rows = [[*csv.DictReader(done.out.splitlines())] for done in (found, wanted)]
    names = [name for name in rows[1][0] if name not in ("stamp", "tag")]
    assert [[row[name] for name in names] for row in rows[0]] == [[row[name] for name in names] for row in rows[1]]


@pytest.mark.parametrize("kind", ["pose", "degrees", "stamped", "transform", "point", "flat", "turn"])
@pytest.mark.parametrize("layout", ["lines", "array"])
def test_records_that_are_alike_take_less_time_than_one_by_one(run: Run, kind: str, layout: str) -> None:
    rng = random.Random(7)  # noqa: S311 - the same records in every run
    told = [{"note": f"n{at}", "stamp_ns": at, "distance": at / 7, "source_stamp_ns": 2 * at} for at in range(1000)]
    records = [told[at] | a_record(kind, rng, at) for at in range(1000)]
    data = json.dumps(records) if layout == "array" else "\n".join(map(json.dumps, records))

    def took(**sizes: int) -> float:
        begin = process_time()
        with sized(**sizes):
            assert run("convert", "-f", "csv", stdin=data).out.count("\n") == 1001
        return process_time() - begin

    assert min(took(), took()) < took(learned=0) / 2


@pytest.mark.parametrize("count", [2, 50])
@pytest.mark.parametrize("command", ["relative --consecutive", "relative --first", "relative --consecutive -f csv", "mean"])
def test_poses_of_one_message_follow_each_other_as_those_of_many(run: Run, command: str, count: int) -> None:
    poses = [{"position": {"x": at * at / 4, "y": 0.0, "z": 1.0}, "orientation": {"x": 0, "y": 0, "z": 0.6, "w": 0.8}} for at in range(3 * count)]
    header = {"frame_id": "map", "stamp": {"sec": 1, "nanosec": 0}}
    messages = [{"header": header, "poses": poses[first : first + 3]} for first in range(0, len(poses), 3)]
    together = run(*command.split(), stdin="".join(f"{json.dumps(each)}\n" for each in messages))
    apart = run(*command.split(), stdin="".join(f"{json.dumps({'header': header, 'pose': each})}\n" for each in poses))
    assert (together.status, apart.status) == (0, 0)
    if command == "mean" or "csv" in command:
        assert together.out == apart.out
        return
    found = [pose for line in together.out.splitlines() for pose in json.loads(line)["poses"]]
    wanted = [json.loads(line) for line in apart.out.splitlines()]
    assert [each["distance"] for each in found] == [each["pose"]["distance"] for each in wanted]


def test_the_scale_of_many_records_is_their_own(run: Run) -> None:
    done = run("invert", "-f", "text", stdin='{"xyz": [1, 2, 3], "rpy": [0.1, 0.2, 0.3], "scale": 4.0}\n' * 100)
    assert [line.split() for line in done.out.splitlines() if "scale" in line] == [["scale", "0.250000"]] * 100


def test_a_frame_that_is_left_out_is_told_once(run: Run) -> None:
    line = '{"parent": "map", "xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}\n'
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "-f", "csv", stdin=line * 100)
    assert done.err == "frametool: warning: stdin:1: frame 'map' is left out: the frames of the result are not known\n"
    assert done.out.count("\n") == 101


def test_the_frame_that_a_wrench_loses_is_told_and_is_not_in_its_result(run: Run) -> None:
    line = '{"frame": "lidar", "force": [1, 2, 3], "torque": [0, 0, 1]}\n'
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", stdin=line)
    assert done.out == '{"force": [1.0, 2.0, 3.0], "torque": [0.0, -3.0, 3.0]}\n'
    assert "frame 'lidar' is left out" in done.err


def test_a_broken_record_whose_key_is_a_mapping_is_null(run: Run) -> None:
    done = run("convert", "-f", "csv", "--on-error", "null", stdin='{"xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}\n{"a": nan , {"b": 1}: 2}\n')
    assert (done.status, done.out) == (3, "x,y,z,qx,qy,qz,qw\n1.0,2.0,3.0,0.0,0.0,0.0,1.0\n,,,,,,\n")


TREE = "".join(f"f{at}: {{parent: map, xyz: [{at}, 1, 2], rpy_deg: [{at}, 2, 3]}}\n" for at in range(60))
LINES = {
    "point": '{{"id": {0}, "frame": "f{1}", "point": [{0}, 2, 3]}}',
    "pose": '{{"parent": "f{1}", "name": "g{0}", "xyz": [{0}, 2, 3], "xyzw": [0, 0, 0.6, 0.8]}}',
    "stamped": '{{"header": {{"stamp": {{"sec": {0}, "nanosec": 5}}, "frame_id": "f{1}"}}, "point": {{"x": {0}, "y": 2, "z": 3}}}}',
}


@pytest.mark.parametrize("kind", LINES)
@pytest.mark.parametrize("form", ["json", "csv", "yaml"])
@pytest.mark.parametrize("command", ["apply tree.yaml map", "invert"])
def test_records_whose_frames_take_turns_become_what_each_becomes_alone(run: Run, kind: str, form: str, command: str) -> None:
    names = [*range(60), "1000", "", "unknown", "map"]
    lines = [LINES[kind].format(at, names[at * 7 % len(names)]) for at in range(200)]
    with sized(few=0):
        together = run(*command.split(), "-f", form, "--on-error", "skip", stdin="\n".join(lines), files={"tree.yaml": TREE})
    with sized(few=1000, small=1 << 30):
        alone = run(*command.split(), "-f", form, "--on-error", "skip", stdin="\n".join(lines), files={"tree.yaml": TREE})
    assert together == alone


def test_a_stream_of_many_frames_takes_little_more_than_one_of_one(run: Run) -> None:
    def took(names: int) -> float:
        lines = "\n".join(LINES["point"].format(at, at % names) for at in range(20_000))
        begin = process_time()
        assert run("apply", "tree.yaml", "map", stdin=lines, files={"tree.yaml": TREE}).status == 0
        return process_time() - begin

    assert min(took(60), took(60)) < 3 * min(took(1), took(1))


@pytest.mark.parametrize("count", [2, 300])
@pytest.mark.parametrize("source", ["json", "csv"])
def test_points_keep_their_names_in_another_format(run: Callable[..., Any], source: str, count: int) -> None:
    names = [f"n{at % 7}" for at in range(count)]
    records = "".join(f'{{"name": "{name}", "point": [1, 2, 3]}}\n' for name in names)
    rows = "name,x,y,z\n" + "".join(f"{name},1,2,3\n" for name in names)
    text, into = (records, "csv") if source == "json" else (rows, "json")
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "--in", source, "-f", into, stdin=text)
    assert done.status == 0
    lines = done.out.splitlines()[source == "json" :]
    assert [line.split(",")[0] if source == "json" else json.loads(line)["name"] for line in lines] == names


@pytest.mark.parametrize("record", [{"xyz_mm": [1000, 2000, 500]}, {"x_mm": 1000, "y_mm": 2000, "z_mm": 500}])
@pytest.mark.parametrize("count", [1, 70])
def test_points_in_millimetres_are_in_metres_elsewhere(run: Run, record: dict[str, Any], count: int) -> None:
    stdin = f"{json.dumps(record)}\n" * count
    move = ("apply", "--transform", "{xyz: [1, 0, 0]}", "-f")
    assert run(*move, "csv", stdin=stdin).out == "x,y,z\n" + "2.0,2.0,0.5\n" * count
    assert [*yaml.safe_load_all(run(*move, "yaml", stdin=stdin).out)] == [{"point": [2.0, 2.0, 0.5]}] * count
    same = json.loads(run(*move, "json", stdin=stdin).out.splitlines()[0])
    assert [*same.values()] in ([[2000.0, 2000.0, 500.0]], [2000.0, 2000.0, 500.0])


@pytest.mark.parametrize("form", ["json", "yaml"])
@pytest.mark.parametrize("point", [[4182105.0, 850859.0, 4724681.0], {"x": 4182105.0, "y": 850859.0, "z": 4724681.0}, {"x": 4182105.0}])
@pytest.mark.parametrize(("words", "keys"), [
    (("--to", "matrix"), {"matrix"}), (("--to", "rpy"), {"xyz", "rpy"}),
    (("--to", "lla"), {"lat", "lon", "alt"}), (("--to", "enu", "--origin", "48,11,0"), {"east", "north", "up"}),
])  # fmt: skip
def test_a_point_that_is_written_anew_leaves_nothing_of_its_key(words: tuple[str, ...], keys: set[str], point: Any, form: str, run: Run) -> None:
    record = {"id": 7, "point": point, "frame": "ecef"}
    text = json.dumps(record) if form == "json" else yaml.dump(record, sort_keys=False)
    assert {*yaml.safe_load(run("convert", *words, stdin=text + "\n").out)} == {"id", "frame", *keys}
