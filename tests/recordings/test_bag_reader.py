"""Bags are read for the types that are asked for; what else is in them is in nobody's way."""

from __future__ import annotations

import re
import struct
from contextlib import closing
from sqlite3 import connect
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.formats.load import FrameFile

pytest.importorskip("rosbags")
import mcap_bytes as mcap
from recorded import FORMS, START, TF, Maker, Sent, read, store, write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from frametool.grammar.edges import Edge

    Run = Callable[..., Any]

STILL = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


def recording(folder: Path, form: str, *more: Sent) -> Path:
    made = Maker(form)
    sent = [Sent("/tf_static", *made.transforms(("map", "base", STILL, START)), START), *more]
    return write(folder / ("run.bag" if form == "bag" else "run"), form, sent)


def as_of_humble(path: Path) -> None:
    """Take out of a folder of sqlite3 what ROS 2 Humble did not write: definitions and hashes."""
    with closing(connect(next(path.glob("*.db3")))) as database, database:
        database.executescript(
            "DROP TABLE message_definitions; DROP TABLE metadata; UPDATE schema SET schema_version = 3;"
            "ALTER TABLE topics DROP COLUMN type_description_hash;"
        )
    metadata = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(re.sub(r"\n *type_description_hash:\s*\S+", "", metadata))


@pytest.mark.parametrize("form", FORMS)
def test_a_type_that_cannot_be_read_is_not_in_the_way_of_others(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form, Sent("/odd", "my_msgs/msg/Odd", b"1234", START))
    done = run("lookup", str(path), "map", "base", "-f", "csv")
    assert done.status == 0, done.err
    assert done.out.splitlines()[1].startswith("base,map,1.0,2.0,3.0")


def test_a_hash_that_is_not_that_of_its_definition_is_an_error(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "sqlite")
    with closing(connect(next(path.glob("*.db3")))) as database, database:
        database.execute("UPDATE topics SET type_description_hash = 'RIHS01_other'")
    done = run("lookup", str(next(path.glob("*.db3"))), "map", "base")
    assert done.status == 1
    assert f"hash of {TF} is RIHS01_e369d0f05a23ae" in done.err


def test_a_hash_is_compared_for_frames_that_move_too(tmp_path: Path, run: Run) -> None:
    moved = [Sent("/tf", *Maker("sqlite").transforms(("map", "base", STILL, START + at)), START + at) for at in range(3)]
    path = next(write(tmp_path / "run", "sqlite", moved).glob("*.db3"))
    with closing(connect(path)) as database, database:
        database.execute("UPDATE topics SET type_description_hash = 'RIHS01_other'")
    done = run("lookup", str(path), "map", "base")
    assert (done.status, f"hash of {TF} is RIHS01_e369d0f05a23ae" in done.err) == (1, True)


def test_types_without_a_definition_are_those_of_ros2(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "sqlite", Sent("/odd", "my_msgs/msg/Odd", b"1234", START))
    as_of_humble(path)
    assert run("lookup", str(path), "map", "base", "-f", "csv").out.splitlines()[1].startswith("base,map,1.0,2.0,3.0")
    done = run("record", str(path), "-o", "new.mcap")
    assert done.err == (
        f"frametool: {path}: types that it does not define are written as in ROS 2 Humble: {TF}\n"
        f"frametool: {path}: types that it does not define are copied without a definition: my_msgs/msg/Odd\n"
        f"frametool: {path}: nothing is changed: 2 messages copied\n"
    )
    static, odd = read(tmp_path / "new.mcap")
    assert static.definition.startswith("geometry_msgs/TransformStamped[] transforms\n")
    assert (odd.definition, odd.data) == ("", b"1234")
    assert run("lookup", "new.mcap", "map", "base", "-f", "csv").status == 0


POSE, OTHERS = "geometry_msgs/msg/PoseStamped", ("jsonschema", "protobuf", "flatbuffer", "ros1msg", "")


def with_foreign(folder: Path, encoding: str, *, summary: bool) -> Path:
    """Write MCAP with a topic of ROS 2 between two others; a summary repeats what they are, as most writers have it."""
    made, store_ = Maker("mcap"), store("mcap")
    defined = store_.generate_msgdef(POSE, ros_version=2)[0]
    about = b"".join((
        mcap.schema(1, POSE, "ros2msg", defined), mcap.schema(2, "foxglove.Log", encoding, "\0" * 3 if not encoding else "{}"),
        mcap.record(3, (3).to_bytes(2, "little") + mcap.text("foxglove.Grid") + mcap.text(encoding) + mcap.text(b"\xff\xfe")),
        mcap.channel(1, 2, "/log", "json"), mcap.channel(2, 1, "/pose", offered_qos_profiles="never: [said"),
        mcap.channel(3, 3, "/grid", "protobuf", offered_qos_profiles="so"), mcap.channel(4, 1, "/odd", offered_qos_profiles="so"),
    ))  # fmt: skip
    sent = made.serialised(*made.pose("map", START, STILL))
    data = b"".join((mcap.message(1, b"{}", START, START), mcap.message(2, sent, START, START), mcap.message(3, b"1", START, START)))
    path = folder / "mixed.mcap"
    path.write_bytes(mcap.whole(mcap.header(), about, data))
    if summary:
        body = mcap.MAGIC + mcap.header() + about + data + mcap.record(15, bytes(4))
        counts = b"".join(struct.pack("<HQ", number, 1) for number in (1, 2, 3))
        said = struct.pack("<QHIIIIQQI", 3, 3, 4, 0, 0, 0, START, START, len(counts)) + counts
        footer = struct.pack("<QQI", len(body), 0, 0)
        path.write_bytes(body + about + mcap.record(11, said) + mcap.record(2, footer) + mcap.MAGIC)
    return path


@pytest.mark.parametrize("summary", [False, True])
@pytest.mark.parametrize("encoding", OTHERS)
def test_topics_in_other_encodings_are_in_nobodys_way(encoding: str, summary: bool, tmp_path: Path, run: Run) -> None:  # noqa: FBT001
    path = with_foreign(tmp_path, encoding, summary=summary)
    done = run("convert", "-i", str(path), "--topic", "/pose", "-f", "csv")
    assert done.status == 0, done.err
    assert done.out.splitlines()[1] == f"map,1.0,2.0,3.0,0.0,0.0,0.0,1.0,{START}"
    assert run("lookup", str(path), "map", "pose", "--topic", "/pose").status == 0


@pytest.mark.parametrize("call", [("convert", "-i", "BAG", "--topic", "/log"), ("lookup", "BAG", "a", "b", "--topic", "log")])
def test_a_topic_in_another_encoding_that_is_asked_for_has_nothing_to_read(call: tuple[str, ...], tmp_path: Path, run: Run) -> None:
    path = str(with_foreign(tmp_path, "jsonschema", summary=True))
    done = run(*(path if each == "BAG" else each for each in call))
    assert (done.status, done.out) == (1, "")
    assert done.err.startswith(f"frametool: {path}: no ")
    assert "; topics: " in done.err


@pytest.mark.parametrize("form", ["folder", "sqlite"])
def test_a_quality_of_service_that_says_nothing_is_in_nobodys_way(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form)
    metadata = path / "metadata.yaml"
    said = re.sub(r"offered_qos_profiles:.*", 'offered_qos_profiles: "never: [said"', metadata.read_text())
    metadata.write_text(said)
    for database in path.glob("*.db3"):
        with closing(connect(database)) as opened, opened:
            opened.execute("UPDATE topics SET offered_qos_profiles = 'so'")
    done = run("lookup", str(path), "map", "base", "-f", "csv")
    assert done.status == 0, done.err


def odd(at: int, numbers: list[float], stamp_ns: int) -> tuple[str, str, list[float], int]:
    """Return a transform with something that not all of its neighbours have."""
    parent, child = ("/map" if at == 31 else "map", "base" if at % 50 else "tool")
    if at == 57:
        numbers = [*numbers[:6], numbers[6] * (1 + 1e-5)]
    return parent, child, numbers, stamp_ns - (500 if at == 83 else 0)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("count", [1, 3])
def test_transforms_that_lie_alike_are_the_same_edges_one_by_one(
    form: str, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, random = Maker(form), np.random.default_rng(count)
    sent = []
    for at in range(120):
        turns = random.normal(size=(count, 4))
        numbers = [[*random.normal(size=3), *(turn / np.linalg.norm(turn))] for turn in turns]
        edges = [odd(at, [*map(float, each)], START + at * 1000) for each in numbers[:1]]
        edges += [("base", f"arm{place}", [*map(float, each)], START + at * 1000 + place) for place, each in enumerate(numbers[1:])]
        sent.append(Sent("/tf", *made.transforms(*edges), START + at * 1000 + 7))
        if at % 40 == 39:
            sent.append(Sent("/tf_static", *made.transforms(("map", "odom", STILL, START)), START + at * 1000 + 8))
    path = str(write(tmp_path / ("run.bag" if form == "bag" else "run"), form, sent))

    def edges_and_notes() -> tuple[list[Edge], list[Any]]:
        file = FrameFile(path)
        return [*file.edges(tell=False)], [*file.tally.findings()]

    at_once = edges_and_notes()
    monkeypatch.setattr("frametool.recordings.contents.alike", lambda *_: ())
    assert at_once == edges_and_notes()
    assert len(at_once[0]) == 120 * count + 3


def test_what_comes_before_a_bad_transform_is_checked_too(tmp_path: Path, run: Run) -> None:
    made, good, half = Maker("mcap"), (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0), (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.5)
    edges = [("odom", "base", good), ("map", "base", good), ("odom", "base", half), ("odom", "base", good)]
    sent = [Sent("/tf", *made.transforms((*edge, START + at)), START + at) for at, edge in enumerate(edges)]
    path = write(tmp_path / "run", "mcap", sent)
    found = run("check", str(path), "--topic", "/tf")
    error, topics, parent = (line.removeprefix(f"{path}:") for line in found.out.splitlines())
    assert error.startswith(" error: message 3: 'odom' -> 'base': quaternion 0 0 0 0.5 has norm 0.5;")
    assert topics == "1:1: note: transforms on /tf (3) [topics]"
    assert parent == "2:1: note: frame 'base' changes its parent: 'odom' -> 'map' [reparented]"
    path = write(tmp_path / "bad", "mcap", sent[2:])
    found = run("check", str(path), "--topic", "/tf")
    assert found.err == "frametool: 1 error, 1 note\n"


@pytest.mark.filterwarnings("error")
def test_steps_that_overflow_are_told_in_words_alone(tmp_path: Path, run: Run) -> None:
    made, far = Maker("mcap"), [(sign * 1e308, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) for sign in (1, -1, 1, -1, 1)]
    sent = [Sent("/tf", *made.transforms(("map", "base", each, START + at)), START + at) for at, each in enumerate(far)]
    path = str(write(tmp_path / "run", "mcap", [*sent, Sent("/pose", *made.pose("map", START + 1, STILL), START + 1)]))
    assert "base: goes back and forth by inf m and 0 rad" in run("check", path).out
    assert run("monitor", path).err == "frametool: inf is not finite and cannot be written\n"
    assert run("apply", path, "base", "-i", path, "--topic", "/pose").status == 0
