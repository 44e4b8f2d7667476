"""Trees that stand still and trees that move answer the same questions; late samples and changing parents."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import pairwise
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool import FrameTree, Transform, TransformBuffer
from frametool.errors import BadTopology, LookupFailed, NoDataAt, NotConnected, TooLate, UnknownFrame, ValueInvalid
from frametool.frames.topology import FramePath, Query
from frametool.frames.track import MovingTrack, StaticTransform

if TYPE_CHECKING:

    from frametool.frames.lookups import Frames

EDGES = [("map", "base"), ("base", "lidar"), ("base", "arm"), ("arm", "hand"), ("island", "rock")]
POSES = Transform.random(len(EDGES), seed=3)


def standing(kind: type[FrameTree | TransformBuffer]) -> FrameTree | TransformBuffer:
    frames = kind()
    for (parent, child), pose in zip(EDGES, POSES, strict=True):
        frames.add(parent, child, pose) if isinstance(frames, FrameTree) else frames.insert(parent, child, pose)
    return frames


@pytest.mark.parametrize("pose", [Transform.random(5, seed=1).rotation[0], Transform.random(5, seed=1), Transform.random(1, seed=1)])
@pytest.mark.parametrize("put", [FrameTree().add, TransformBuffer().insert], ids=["add", "insert"])
def test_a_frame_has_one_pose_and_a_rotation_is_none(put: Any, pose: Any) -> None:
    with pytest.raises(ValueInvalid, match="the pose of a frame is one Transform, found"):
        put("map", "base", pose)


def answers(frames: Frames, target: str, source: str) -> list[Any]:
    questions = (
        lambda: frames.path(target, source),
        lambda: frames.lookup(target, source).components,
        lambda: frames.lookup(target, source, 7).components,
        lambda: frames.lookup_many(target, source, [1, 2]).as_matrix().tolist(),
        lambda: frames.lookup_across(target, 1, source, None, "base").components,
        lambda: frames.latest(target, source),
        lambda: frames.span(target, source),
        lambda: [(at, found.components) for at, found, _ in frames.replay(target, source, rate_hz=1.0)],  # type: ignore[union-attr]
        lambda: frames.tree_at(5).lookup(target, source).components,
    )
    found = []
    for question in questions:
        try:
            found.append(question())
        except (LookupFailed, ValueInvalid) as error:
            found.append((type(error), str(error)))
    return found


@pytest.mark.parametrize("target", ["map", "hand", "rock", "nowhere"])
@pytest.mark.parametrize("source", ["map", "lidar", "rock", "hnad"])
def test_a_tree_and_a_buffer_that_stands_still_give_the_same_answers(target: str, source: str) -> None:
    tree, buffer = standing(FrameTree), standing(TransformBuffer)
    assert answers(tree, target, source) == answers(buffer, target, source)


def test_a_tree_and_a_buffer_that_stands_still_hold_the_same() -> None:
    tree, buffer = standing(FrameTree), standing(TransformBuffer)
    assert set(tree.frames) == set(buffer.frames)
    assert set(tree.roots) == set(buffer.roots) == {"map", "island"}
    assert [edge[:2] for edge in tree.edges()] == [edge[:2] for edge in buffer.edges()] == EDGES
    assert not tree.moves
    assert not buffer.moves


def path_of(down: int, up: int, *, moves: bool = True) -> Query:
    """Return a path of edges with one pose each, that move or not."""
    poses = {f"f{at}": pose.components for at, pose in enumerate(Transform.random(down + up, seed=5))}
    tracks = {
        name: MovingTrack(name, 0, "", pose) if moves else StaticTransform(name, "", pose) for name, pose in poses.items()
    }
    return Query(FramePath(tuple(poses)[:down], "", tuple(poses)[down:]), tracks)


@pytest.mark.parametrize("count", [0, 1, 4])
def test_a_path_is_composed_alike_from_floats_and_from_columns(count: int) -> None:
    path = path_of(count, count)
    single = path.compose(lambda edge: edge.components)
    columns: Any = path.compose(lambda edge: tuple(np.array([value]) for value in edge.components))  # type: ignore[arg-type,return-value]
    assert single is not None
    assert [float(np.ravel(column)[0]) for column in columns] == list(single)


@pytest.mark.parametrize(("down", "up"), [(0, 0), (0, 3), (1, 1), (3, 4)])
def test_a_path_of_static_edges_is_that_of_the_same_edges_one_by_one(down: int, up: int) -> None:
    single = path_of(down, up).compose(lambda edge: edge.components)
    assert path_of(down, up, moves=False).fixed == single


@pytest.mark.parametrize("without", ["f0", "f1"])
def test_an_edge_without_a_pose_leaves_a_path_without_one(without: str) -> None:
    path = path_of(1, 1)
    assert path.compose(lambda edge: None if edge.child == without else edge.components) is None


def test_frames_of_two_trees_have_no_pose_in_each_other_however_they_are_climbed() -> None:
    tree = FrameTree()
    tree.add("a", "b", shifted(1))
    tree.add("c", "d", shifted(1))
    assert tree.near("a", "b") == shifted(1).components
    with pytest.raises(NotConnected, match="'b' hangs from root 'a', 'd' from root 'c'"):
        tree.near("b", "d")
    with pytest.raises(UnknownFrame):
        tree.near("b", "e")


# --- parents that change -------------------------------------------------------------------------------------------


def shifted(x: float) -> Transform:
    return Transform.of(float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def reparented() -> TransformBuffer:
    """Return f3, first below f0, then below f2, which has no data any more when f3 comes to it."""
    buffer = TransformBuffer()
    buffer.insert("f0", "f2", shifted(100), 400)
    buffer.insert("f0", "f2", shifted(100), 950)
    buffer.insert("f0", "f3", shifted(1), 825)
    buffer.insert("f2", "f3", shifted(5), 1075)
    return buffer


def test_the_latest_lookup_takes_the_way_of_its_own_time() -> None:
    buffer = reparented()
    assert buffer.latest("f0", "f3") == 950
    assert buffer.lookup("f0", "f3").components[0] == buffer.lookup("f0", "f3", 950).components[0] == 1.0
    assert buffer.path("f0", "f3") == ["f0", "f3"]


def test_the_span_of_changing_parents_is_where_there_are_answers() -> None:
    assert reparented().span("f0", "f3") == (825, 1074)


def test_an_error_names_the_path_of_its_own_time() -> None:
    buffer = TransformBuffer()
    for parent in "mn":
        buffer.insert("w", parent, shifted(0))
    for stamp, parent in ((10, "m"), (20, "m"), (30, "n")):
        buffer.insert(parent, "x", shifted(1), stamp)
        buffer.insert("x", "y", shifted(1), stamp // 2)
    for target, source, path in (("y", "w", "y <- x <- m <- w"), ("w", "y", "w <- m <- x <- y")):
        with pytest.raises(TooLate, match=f"on the path {path};") as caught:
            buffer.lookup(target, source, 18)
        assert caught.value.fields["path"] == path.split(" <- ")


class Scan:
    """tf2's BufferCore as its source has it, over lists that are searched from one end to the other."""

    def __init__(self) -> None:
        self.samples: dict[str, list[tuple[int, str, float]]] = {}

    def insert(self, parent: str, child: str, x: float, stamp: int) -> None:
        self.samples.setdefault(child, []).append((stamp, parent, x))
        self.samples[child].sort()

    def at(self, child: str, stamp: int) -> tuple[str, float] | None:
        known = self.samples.get(child, [])
        for (begin, parent, x), (end, after, other) in pairwise(known):
            if begin <= stamp < end:
                along = (other - x) * (stamp - begin) / (end - begin) if parent == after else 0.0
                return parent, x + along
        return known[-1][1:] if known and known[-1][0] == stamp else None

    def latest(self, target: str, source: str) -> int | None:
        """getLatestCommonTime: up from the source by the newest parents, then up from the target until the two meet."""
        if target == source:
            return self.samples[source][-1][0] if source in self.samples else None
        line: list[tuple[int, str]] = []
        frame = source
        while frame in self.samples:
            stamp, frame, _ = self.samples[frame][-1]
            line.append((stamp, frame))
            if frame == target:
                return min(stamp for stamp, _ in line)
        frame, newest = target, []
        while frame in self.samples:
            stamp, frame, _ = self.samples[frame][-1]
            newest.append(stamp)
            if frame == source:
                return min(newest)
            if frame in [parent for _, parent in line]:
                below = [at for at, _ in line[: [parent for _, parent in line].index(frame) + 1]]
                return min(newest + below)
        return None

    def lookup(self, target: str, source: str, stamp: int) -> float | None:
        ups = []
        for frame in (target, source):
            up = {frame: 0.0}
            here, x = frame, 0.0
            while (found := self.at(here, stamp)) is not None:
                here, x = found[0], x + found[1]
                up[here] = x
            ups.append(up)
        return next((ups[1][frame] - ups[0][frame] for frame in ups[0] if frame in ups[1]), None)


@pytest.mark.parametrize("seed", range(40))
def test_random_reparenting_trees_answer_as_tf2_does(seed: int) -> None:
    draw = random.Random(seed)  # noqa: S311 - not for secrets
    buffer, scan = TransformBuffer(keep_ns=10**6 if seed % 2 else None), Scan()
    frames = [f"f{number}" for number in range(6)]
    for child in range(1, 6):
        for stamp in draw.sample(range(1, 60), draw.randrange(1, 7)):
            parent, x = draw.choice(frames[:child]), draw.uniform(-9, 9)
            buffer.insert(parent, f"f{child}", shifted(x), stamp)
            scan.insert(parent, f"f{child}", x, stamp)
    for target in frames:
        for source in frames:
            if target == source:
                continue
            assert buffer.latest(target, source) == scan.latest(target, source)
            asked: list[int | None] = [None, *draw.sample(range(62), 8)]
            for time in asked:
                settled = scan.latest(target, source) or 0 if time is None else time
                expected = scan.lookup(target, source, settled)
                try:
                    found = buffer.lookup(target, source, time).components[0]
                except NoDataAt:
                    assert expected is None
                else:
                    assert expected == pytest.approx(found, abs=1e-12)


# --- late samples --------------------------------------------------------------------------------------------------


def in_order(order: str, count: int) -> list[int]:
    """Give stamps from 1 in some order."""
    draw = random.Random(1)  # noqa: S311 - not for secrets
    return {
        "reverse": list(range(count, 0, -1)), "random": draw.sample(range(1, count + 1), count),
        "two halves": [*range(1, count, 2), *range(2, count + 1, 2)], "in order": list(range(1, count + 1)),
    }[order]  # fmt: skip


@pytest.mark.parametrize(("order", "keep"), [("reverse", 1), ("random", 1), ("two halves", 1), ("in order", 1), ("in order", 4)])
def test_samples_take_time_in_proportion_however_late_and_however_many_are_forgotten(order: str, keep: int) -> None:
    def took(count: int) -> float:
        buffer = TransformBuffer(keep_ns=count // keep)
        stamps = in_order(order, count)
        begin = process_time()
        for stamp in stamps:
            buffer.insert_components("a", "b", (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), stamp)
        buffer.lookup("a", "b", count)
        return process_time() - begin

    assert min(took(80_000), took(80_000)) < 8 * min(took(20_000), took(20_000)) + 0.1


@pytest.mark.parametrize(("order", "keep"), [("reverse", 20_000), ("random", 20_000), ("two halves", 20_000), ("in order", 5000)])
def test_samples_stand_in_the_order_of_time_and_old_ones_are_forgotten(order: str, keep: int) -> None:
    buffer = TransformBuffer(keep_ns=keep)
    for stamp in in_order(order, 20_000):
        buffer.insert("a", "b", shifted(stamp), stamp)
    track = buffer.track("b")
    assert isinstance(track, MovingTrack)
    stamps = [stamp for stamp, _, _ in track.walk()]
    assert stamps == list(range(max(20_000 - keep, 1), 20_001))
    assert (track.span, track.count) == ((stamps[0], 20_000), len(stamps))


@pytest.mark.parametrize("seed", [1, 7])
def test_the_order_of_inserts_changes_no_answer(seed: int) -> None:
    draw = random.Random(seed)  # noqa: S311 - not for secrets
    stamps = draw.sample(range(1000), 150)
    poses = {stamp: Transform.random(seed=stamp) for stamp in stamps}
    parents = {stamp: draw.choice("ab") if seed == 7 else "a" for stamp in stamps}
    in_order, late = TransformBuffer(), TransformBuffer()
    for buffer in (in_order, late):
        buffer.insert("w", "a", shifted(1))
        buffer.insert("w", "b", shifted(2))
    for stamp in sorted(stamps):
        in_order.insert(parents[stamp], "c", poses[stamp], stamp)
    for stamp in stamps:
        late.insert(parents[stamp], "c", poses[stamp], stamp)
        assert late.lookup("w", "c", stamp).is_close(
            shifted(1 if parents[stamp] == "a" else 2) @ poses[stamp], angle=1e-12, distance=1e-12
        )
    for stamp in draw.sample(stamps, 20):  # a second word on a stamp
        for buffer in (in_order, late):
            buffer.insert_components(parents[stamp], "c", poses[0 if 0 in poses else stamp].components, stamp)
    times = range(min(stamps), max(stamps) + 1)
    assert [in_order.lookup("w", "c", at).components for at in times] == [late.lookup("w", "c", at).components for at in times]
    assert (in_order.lookup_many("w", "c", times).xyzw == late.lookup_many("w", "c", times).xyzw).all()


@pytest.mark.parametrize("every", [1, 3, 100])
def test_lookups_between_late_samples_find_what_is_known_so_far(every: int) -> None:
    draw = random.Random(every)  # noqa: S311 - not for secrets
    buffer = TransformBuffer(keep_ns=10**12)
    known: list[int] = []
    for number, stamp in enumerate(draw.sample(range(1, 5000), 1500)):
        buffer.insert("a", "b", shifted(stamp), stamp)
        known.append(stamp)
        if number % every == 0:
            at = draw.randint(min(known), max(known))
            assert buffer.lookup("a", "b", at).xyz == pytest.approx((at, 0.0, 0.0))


def test_of_two_poses_at_a_stamp_the_last_holds_however_late() -> None:
    buffer = TransformBuffer()
    order = [9, 3, 7, 1, 5, 8, 2, 6, 4]
    for stamp in order:
        assert not buffer.insert_components("a", "b", shifted(stamp).components, stamp)
    for stamp in order:
        assert buffer.insert_components("a", "b", shifted(-stamp).components, stamp)
        assert not buffer.insert_components("a", "b", shifted(-stamp).components, stamp)
        assert [*buffer.lookup("a", "b", stamp).xyz] == [-stamp, 0.0, 0.0]
    track = buffer.track("b")
    assert isinstance(track, MovingTrack)
    assert track.count == len(order)
    assert [stamp for stamp, _, _ in track.walk()] == sorted(order)


def test_what_is_too_old_is_dropped() -> None:
    buffer = TransformBuffer(keep_ns=30)
    for stamp in (*range(10, 40, 2), *range(11, 40, 2), 45, 60, 100):
        buffer.insert("a", "b", shifted(stamp), stamp)
        track = buffer.track("b")
        assert track is not None
        stamps = [at for at, _, _ in track.walk() if at is not None]
        assert stamps == sorted(stamps)
        assert stamps[0] >= stamps[-1] - 30
    assert stamps == [100]


# --- time goes by --------------------------------------------------------------------------------------------------


def drive() -> TransformBuffer:
    buffer = TransformBuffer()
    for stamp in (1, 3):
        buffer.insert("map", "base", shifted(stamp), stamp * 10**9)
    return buffer


def test_a_replay_goes_through_the_span_in_equal_steps() -> None:
    found = [(at, pose.components[0]) for at, pose, _ in drive().replay("map", "base", rate_hz=2.0)]  # type: ignore[union-attr]
    assert found == [(round(seconds * 10**9), seconds) for seconds in (1.0, 1.5, 2.0, 2.5, 3.0)]


def test_a_replay_yields_the_error_where_there_is_no_data() -> None:
    found = list(drive().replay("map", "base", rate_hz=1.0, start_ns=2 * 10**9, stop_ns=4 * 10**9))
    assert [isinstance(each.found, TooLate) for each in found] == [False, False, True]


@pytest.mark.parametrize("rate", [0.3, 1.0, 7.0, 1e9 / 3])
def test_the_steps_before_and_behind_the_data_are_counted_and_not_tried(rate: float) -> None:
    begin, end = -2 * 10**9, 4 * 10**9 if rate < 10 else 10**9 + 50
    begin = begin if rate < 10 else 10**9 - 50
    period = Fraction(10**9) / Fraction(rate)
    times = [begin + round(step * period) for step in range(int((end - begin) / period) + 2)]
    times = [at for at in times if at <= end]
    found = list(drive().replay("map", "base", rate_hz=rate, start_ns=begin, stop_ns=end))
    assert [each.at_ns for each in found if isinstance(each.found, Transform)] == [at for at in times if 10**9 <= at <= 3 * 10**9]
    assert sum(each.steps for each in found) == len(times)
    assert len([each for each in found if isinstance(each.found, NoDataAt)]) <= 2


def test_a_replay_of_centuries_takes_the_steps_of_the_data() -> None:
    assert len(list(drive().replay("map", "base", rate_hz=1.0, start_ns=-(10**18), stop_ns=4 * 10**18))) == 5


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf"), 1e-300, 1e-10, 1.1e9, 1e300])
def test_a_replay_takes_steps_of_a_nanosecond_up_to_a_century(rate: float) -> None:
    with pytest.raises(ValueInvalid, match="Hz has no steps between 1 ns"):
        list(drive().replay("map", "base", rate_hz=rate))


def test_the_fastest_replay_never_repeats_a_stamp() -> None:
    times = [each.at_ns for each in drive().replay("map", "base", rate_hz=1e9, stop_ns=10**9 + 1000)]
    assert times == list(range(10**9, 10**9 + 1001))


def test_an_unknown_frame_and_a_second_pose_say_the_rule_they_break() -> None:
    with pytest.raises(UnknownFrame):
        standing(FrameTree).replay("map", "nope", rate_hz=1.0).__next__()
    for edge, rule in ((("map", "lidar"), "two-parents"), (("base", "lidar"), "two-poses"), (("lidar", "map"), "cycle")):
        for kind in (FrameTree, TransformBuffer):
            frames = standing(kind)
            add = frames.add if isinstance(frames, FrameTree) else frames.insert
            with pytest.raises(BadTopology) as caught:
                add(*edge, POSES[0])
            assert caught.value.rule == rule


# --- what is said --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["f{}", "robot_{}/arm_link", "{}_camera_optical"])
def test_among_many_names_only_the_likely_ones_are_compared(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []

    def matches(name: str, known: list[str], **_: object) -> list[str]:
        compared.extend(known)
        return [min(known, key=lambda each: (each != form.format(7777), each))] if name else []

    monkeypatch.setattr("difflib.get_close_matches", matches)
    tree = FrameTree()
    for number in range(20_000):
        tree.add("root", form.format(number), POSES[0])
    wrong = form.format(7777)
    for name in (wrong + "q", wrong.replace("777", "77q"), "q" + wrong):
        compared.clear()
        with pytest.raises(UnknownFrame, match="did you mean"):
            tree.lookup("root", name)
        assert wrong in compared
        assert len(compared) <= 500


@pytest.mark.parametrize("name", ["x" * 1000, "a\x1b[31mb", "\n" * 80])
def test_no_message_holds_a_long_name_or_a_control_character(name: str) -> None:
    buffer = drive()
    buffer.insert("base", name, shifted(0), 2 * 10**9)
    buffer.insert("island", f"{name}!", shifted(0), 2 * 10**9)
    questions = (
        lambda: buffer.lookup("map", name, 9 * 10**9),
        lambda: buffer.lookup("map", f"{name}!"),
        lambda: buffer.lookup("map", f"{name}?"),
        lambda: buffer.insert(name, "map", shifted(0), 2 * 10**9),
        lambda: buffer.insert(name, name, shifted(0), 0),
        lambda: buffer.insert("base", name, shifted(0)),
    )
    for question in questions:
        with pytest.raises((LookupFailed, BadTopology)) as caught:
            question()
        assert str(caught.value).isprintable()
        assert len(str(caught.value)) < 500
