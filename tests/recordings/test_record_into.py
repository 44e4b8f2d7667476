"""Messages of a recording moved into another frame: by matrices of a second hand, and there and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("rosbags")
from recorded import FORMS, SECOND, START, Maker, Sent, read, write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

MAP_FROM_ODOM = (10.0, -3.0, 0.5, 0.1, 0.2, 0.3, 0.9273618495495703)
COVARIANCE = np.diag([0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
COVARIANCE[0, 4] = COVARIANCE[4, 0] = 0.005
TWIST = np.arange(36, dtype=np.float64)


def matrix(numbers: Any) -> Any:
    tx, ty, tz, x, y, z, w = numbers
    made = np.eye(4)
    made[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    made[:3, 3] = tx, ty, tz
    return made


def numbers_of(pose: Any) -> tuple[float, ...]:
    at, turn = pose.position, pose.orientation
    return at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w


def place(at: int) -> tuple[float, ...]:
    turned = 0.1 * at
    return 0.5 * at, 1.0, 0.25 * at, 0.0, 0.0, float(np.sin(turned)), float(np.cos(turned))


def all_kinds(form: str, frame: str = "base") -> list[Sent]:
    """Make a message of each kind that moves, in a frame that moves, at the samples of its transform and between them."""
    made = Maker(form)
    sent = [Sent("/tf_static", *made.transforms(("map", "odom", MAP_FROM_ODOM, START)), START)]
    stamps = [START + at * SECOND for at in range(5)]
    sent += [Sent("/tf", *made.transforms(("odom", "base", place(at), each)), each) for at, each in enumerate(stamps)]
    for at in range(8):
        stamp_ns = START + at * SECOND // 2
        header, posed = made.header(frame, stamp_ns), made.posed(place(at + 3))
        with_covariance = made.part("PoseWithCovariance", posed, COVARIANCE.ravel())
        zero = made.part("Vector3", 1.0, 2.0, 3.0)
        twist = made.part("TwistWithCovariance", made.part("Twist", zero, zero), TWIST)
        kinds: dict[str, tuple[Any, ...]] = {
            "/pose": ("geometry_msgs/msg/PoseStamped", header, posed),
            "/uncertain": ("geometry_msgs/msg/PoseWithCovarianceStamped", header, with_covariance),
            "/odometry": ("nav_msgs/msg/Odometry", header, "wheel", with_covariance, twist),
            "/point": ("geometry_msgs/msg/PointStamped", header, made.part("Point", 1.0, 2.0, 3.0)),
            "/poses": ("geometry_msgs/msg/PoseArray", header, [posed, made.posed(place(1))]),
            "/path": ("nav_msgs/msg/Path", header, [
                made.part("geometry_msgs/msg/PoseStamped", made.header(frame, START), posed),
                made.part("geometry_msgs/msg/PoseStamped", made.header("", 0), posed),
                made.part("geometry_msgs/msg/PoseStamped", made.header("map", stamp_ns), posed),
            ]),
        }  # fmt: skip
        for topic, (kind, *fields) in kinds.items():
            sent.append(Sent(topic, kind, made.part(kind, *fields), START + 3 * SECOND + at))
    return sorted(sent, key=lambda each: each.log_ns)


TOPICS = ("/pose", "/uncertain", "/odometry", "/point", "/poses", "/path")
NAMED = [word for topic in TOPICS for word in ("--topic", topic)]


def at_time(stamp_ns: int) -> Any:
    """Return map_from_base: of turns about z that are as far apart in time as in angle, the one between is half of each."""
    return matrix(MAP_FROM_ODOM) @ matrix(place((stamp_ns - START) / SECOND))  # type: ignore[arg-type]


def stamp(header: Any) -> int:
    return int(header.stamp.sec * SECOND + header.stamp.nanosec)


def recording(folder: Path, form: str, sent: list[Sent]) -> Path:
    return write(folder / ("run.bag" if form == "bag" else "run"), form, sent)


def moved(folder: Path, run: Run, form: str, sent: list[Sent] | None = None, *arguments: str) -> tuple[Any, Path, Path]:
    path = recording(folder, form, all_kinds(form) if sent is None else sent)
    new = folder / ("new.bag" if form == "bag" else "new.mcap")
    return run("record", str(path), "--into", "map", *(arguments or NAMED), "-o", new.name), path, new


@pytest.mark.parametrize("form", FORMS)
def test_every_kind_is_moved_at_its_stamp(form: str, tmp_path: Path, run: Run) -> None:
    done, path, new = moved(tmp_path, run, form)
    assert done.err == f"frametool: {path}: 48 messages in map ({', '.join(sorted(TOPICS, key=TOPICS.index))})\n"
    made, before, after = Maker(form), read(path), read(new)
    assert [each._replace(data=b"", about=()) for each in after] == [each._replace(data=b"", about=()) for each in before]
    checked = set()
    for old_bytes, new_bytes in zip(before, after, strict=True):
        if old_bytes.topic not in TOPICS:
            assert new_bytes.data == old_bytes.data
            continue
        checked.add(old_bytes.topic)
        old, each = (made.read(one.kind, one.data) for one in (old_bytes, new_bytes))
        assert each.header.frame_id == "map"
        assert stamp(each.header) == stamp(old.header)
        mover = at_time(stamp(old.header))
        if old_bytes.topic == "/point":
            assert [each.point.x, each.point.y, each.point.z] == pytest.approx((mover @ [1, 2, 3, 1])[:3].tolist(), abs=1e-12)
        elif old_bytes.topic == "/path":
            movers = at_time(stamp(old.poses[0].header)), mover, np.eye(4)
            for pose, was, by in zip(each.poses, old.poses, movers, strict=True):
                assert (pose.header.frame_id, stamp(pose.header)) == ("map", stamp(was.header))
                assert matrix(numbers_of(pose.pose)) == pytest.approx(by @ matrix(numbers_of(was.pose)), abs=1e-12)
            assert numbers_of(each.poses[2].pose) == numbers_of(old.poses[2].pose)
        elif old_bytes.topic == "/poses":
            for pose, was in zip(each.poses, old.poses, strict=True):
                assert matrix(numbers_of(pose)) == pytest.approx(mover @ matrix(numbers_of(was)), abs=1e-12)
        else:
            pose, was = (getattr(one.pose, "pose", one.pose) for one in (each, old))
            assert matrix(numbers_of(pose)) == pytest.approx(mover @ matrix(numbers_of(was)), abs=1e-12)
        if old_bytes.topic in ("/uncertain", "/odometry"):
            turn = np.kron(np.eye(2), mover[:3, :3])
            assert np.reshape(each.pose.covariance, (6, 6)) == pytest.approx(turn @ COVARIANCE @ turn.T, abs=1e-14)
        if old_bytes.topic == "/odometry":
            assert each.child_frame_id == "wheel"
            assert each.twist.covariance.tolist() == TWIST.tolist()
    assert checked == set(TOPICS)


@pytest.mark.parametrize("form", FORMS)
def test_into_a_frame_and_back_is_where_it_was(form: str, tmp_path: Path, run: Run) -> None:
    _, path, new = moved(tmp_path, run, form, all_kinds(form, "odom"))
    back = new.with_stem("back")
    assert run("record", str(new), "--into", "odom", *NAMED, "-o", back.name).status == 0
    made = Maker(form)
    for old, each in zip(read(path), read(back), strict=True):
        if old.topic == "/pose":
            was, now = (numbers_of(made.read(one.kind, one.data).pose) for one in (old, each))
            assert now == pytest.approx(was, abs=1e-12)
        elif old.topic == "/uncertain":
            was, now = (made.read(one.kind, one.data).pose.covariance for one in (old, each))
            assert now == pytest.approx(was, abs=1e-15)


def test_what_is_in_the_frame_already_stays_as_its_bytes(tmp_path: Path, run: Run) -> None:
    done, path, new = moved(tmp_path, run, "mcap", [each for each in all_kinds("mcap", "map") if each.topic != "/path"], *NAMED[:-2])
    assert done.err == f"frametool: {path}: 40 messages in map (/pose, /uncertain, /odometry, /point, /poses), 40 of them were in it\n"
    assert [each.data for each in read(new)] == [each.data for each in read(path)]


def test_edges_that_are_added_or_replaced_move_messages_too(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "mcap", all_kinds("mcap"))
    tree = "{frames: [{name: map, parent: world, xyz: [0, 0, 7]}, {name: odom, parent: map, xyz: [1, 0, 0]}]}"
    done = run("record", str(path), "--with", tree, "--replace", "--into", "world", "--topic", "/point", "-o", "new.mcap")
    assert done.status == 0, done.err
    point = next(each for each in read(tmp_path / "new.mcap") if each.topic == "/point")
    found = Maker("mcap").read(point.kind, point.data).point
    assert (found.x, found.y, found.z) == pytest.approx((2.0, 3.0, 10.0), abs=1e-12)


def test_transforms_outside_of_a_window_count(tmp_path: Path, run: Run) -> None:
    done, _, new = moved(tmp_path, run, "bag", None, "--topic", "/pose", "--between", "1700000003,1700000003.000000004")
    assert done.status == 0, done.err
    assert [each.topic for each in read(new)].count("/pose") == 5
    assert [each.topic for each in read(new)].count("/tf") == 1


def late(form: str, bad: str = "") -> list[Sent]:
    """Make poses of which the third has no transform at its stamp; or one that is wrong in itself."""
    made = Maker(form)
    sent = [Sent("/tf", *made.transforms(("map", "odom", place(at), START + at * SECOND)), START + at * SECOND) for at in range(2)]
    stamps = [START, START + SECOND, START if bad in ("short", "long") else START + 9 * SECOND, START + SECOND // 2]
    poses = [made.pose({"frame": "nope", "empty": ""}.get(bad, "odom") if at == 2 else "odom", stamp_ns, place(at)) for at, stamp_ns in enumerate(stamps)]
    if bad in ("zero", "nan"):
        values = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0) if bad == "zero" else (float("nan"), 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)
        poses[2] = made.pose("odom", START, values)
    data = [made.serialised(*each) for each in poses]
    if bad == "short":
        data[2] = data[2][:-9]
    if bad == "long":
        data[2] += bytes(8)
    return [*sent, *(Sent("/pose", poses[at][0], each, START + 5 * SECOND + at) for at, each in enumerate(data))]


NO_DATA = "no data for map -> odom at 1700000009.000000000; samples cover 1700000000.000000000 .. 1700000001.000000000 (8 s too late), on the path map <- odom"
AT = ", stamp 1700000009.000000000"
WRONG = {
    "": (4, f"{AT}: {NO_DATA}"),
    "frame": (4, f"{AT}: unknown frame 'nope' in PATH; frames: map, odom"),
    "empty": (1, f"{AT}: its header names no frame"),
    "zero": (1, ", stamp 1700000000.000000000: quaternion 0 0 0 0 has no direction; give a non-zero one"),
    "nan": (1, ", stamp 1700000000.000000000: its position is not finite"),
    "short": (1, ": its bytes are not a geometry_msgs/msg/PoseStamped"),
    "long": (1, ": its bytes are not a geometry_msgs/msg/PoseStamped"),
}


@pytest.mark.parametrize("bad", WRONG)
def test_a_message_that_cannot_be_moved_stops_the_copy_or_is_left_out(bad: str, tmp_path: Path, run: Run) -> None:
    status, reason = WRONG[bad]
    done, path, new = moved(tmp_path, run, "mcap", late("mcap", bad), "--topic", "/pose")
    line = f"frametool: {path}: message 3: on /pose{reason.replace('PATH', str(path))}"
    assert (done.status, done.err) == (status, f"{line}\n")
    assert not new.exists()
    done = run("record", str(path), "--into", "map", "--topic", "/pose", "--on-error", "skip", "-o", "new.mcap")
    in_map = f"frametool: {path}: 3 messages in map (/pose)\n"
    assert (done.status, done.err) == (3, f"{line} (message skipped)\n{in_map}frametool: {path}: 1 of 4 messages skipped\n")
    assert len(read(new)) == 5


def test_a_frame_that_is_not_there_is_said_before_any_message(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "mcap", late("mcap"))
    done = run("record", str(path), "--into", "mapp", "--topic", "/pose", "--on-error", "skip", "-o", "new.mcap")
    assert (done.status, done.err) == (4, f"frametool: unknown frame 'mapp' in {path}; did you mean 'map'? frames: map, odom\n")


def test_a_covariance_that_is_none_is_an_error_and_unknown_or_no_ones_stay(tmp_path: Path, run: Run) -> None:
    made = Maker("mcap")
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    sent = [Sent("/tf_static", *made.transforms(("map", "odom", MAP_FROM_ODOM, 0)), START)]
    for entries in (np.zeros(36), np.array([-1.0, *[0.0] * 35])):
        posed = made.part("PoseWithCovariance", made.posed(place(1)), entries)
        sent.append(Sent("/pose", kind, made.part(kind, made.header("odom", START), posed), START))
    _, _, new = moved(tmp_path, run, "mcap", sent, "--topic", "/pose")
    covariances = [made.read(kind, each.data).pose.covariance for each in read(new)[1:]]
    assert [each.tobytes() for each in covariances] == [np.zeros(36).tobytes(), np.array([-1.0, *[0.0] * 35]).tobytes()]
    posed = made.part("PoseWithCovariance", made.posed(place(1)), np.arange(36, dtype=np.float64))
    sent[1:] = [Sent("/pose", kind, made.part(kind, made.header("odom", START), posed), START)]
    path = write(tmp_path / "other", "mcap", sent)
    done = run("record", str(path), "--into", "map", "--topic", "/pose", "-o", "other.mcap")
    said = "covariance is not symmetric: [0][1] is 1, [1][0] is 6"
    assert done.err == f"frametool: {path}: message 1: on /pose, stamp 1700000000.000000000: {said}\n"


def test_recordings_without_transforms_say_so(tmp_path: Path, run: Run) -> None:
    done, path, _ = moved(tmp_path, run, "mcap", [each for each in late("mcap") if each.topic == "/pose"], "--topic", "/pose")
    assert (done.status, done.err) == (1, f"frametool: {path}: no transforms in it; --with FILE brings some\n")
    done = run("record", str(path), "--into", "map", "--topic", "/pose", "--with", "{name: odom, parent: map, xyz: [1, 0, 0]}", "-o", "n.mcap")
    assert done.status == 0


@pytest.mark.parametrize("form", ["mcap", "bag"])
def test_bytes_in_the_other_order_and_what_fills_gaps_are_read(form: str, tmp_path: Path, run: Run) -> None:
    made = Maker(form)
    kind, message = made.pose("odom_with_a_longer_name", START, place(2))
    static = Sent("/tf_static", *made.transforms(("m", "odom_with_a_longer_name", MAP_FROM_ODOM, 0)), START)
    if form == "bag":
        data = made.serialised(kind, message)
    else:
        from recorded import store

        data = bytes(store(form).serialize_cdr(message, kind, little_endian=False))
        data = data[:2] + b"\x00\x02" + data[4:] + b"\xaa\xbb"
    path = recording(tmp_path, form, [static, Sent("/pose", kind, data, START)])
    name = "new.bag" if form == "bag" else "new.mcap"
    done = run("record", str(path), "--into", "m", "--topic", "/pose", "-o", name)
    assert done.status == 0, done.err
    new = read(tmp_path / name)[1].data
    found = made.read(kind, new)
    assert matrix(numbers_of(found.pose)) == pytest.approx(matrix(MAP_FROM_ODOM) @ matrix(place(2)), abs=1e-12)
    assert found.header.frame_id == "m"
    if form == "bag":
        assert found.header.seq == 7
