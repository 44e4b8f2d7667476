"""The buffer's laws: exact stamps, any order of inserts, what is refused, and errors that say where and by how much."""

from __future__ import annotations

import numpy as np
import pytest

from frametool import Transform, TransformBuffer
from frametool.errors import (
    BadTopology,
    FrametoolWarning,
    LookupFailed,
    NotConnected,
    TooEarly,
    TooLate,
    UnknownFrame,
    ValueInvalid,
)

EPOCH = 1_700_000_000_123_456_789  # a float of this size has steps of 256
SECOND = 10**9


def shifted(x: float) -> Transform:
    """Return a shift along x."""
    return Transform.of(float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def moving(*, keep_ns: int | None = None) -> TransformBuffer:
    """Make map -> base, which moves by 1 m in 1000 ns, and base -> lidar, which stands."""
    buffer = TransformBuffer(keep_ns=keep_ns)
    buffer.insert("map", "base", shifted(0), EPOCH)
    buffer.insert("map", "base", shifted(1), EPOCH + 1000)
    buffer.insert("base", "lidar", shifted(10))
    return buffer


def x_of(transform: Transform) -> float:
    """Return the x of a translation."""
    return float(transform.components[0])


@pytest.mark.parametrize("after", [0, 1, 333, 999, 1000])
def test_a_nanosecond_counts_at_todays_stamps(after: int) -> None:
    buffer = moving()
    assert x_of(buffer.lookup("map", "lidar", EPOCH + after)) == pytest.approx(10 + after / 1000, abs=1e-15)
    assert x_of(buffer.lookup_many("map", "lidar", [EPOCH + after])[0]) == pytest.approx(10 + after / 1000, abs=1e-15)


def test_samples_may_come_in_any_order() -> None:
    generator = np.random.default_rng(5)
    stamps = [EPOCH + int(step) for step in generator.permutation(200)]
    in_order, shuffled = TransformBuffer(), TransformBuffer()
    for stamp in sorted(stamps):
        in_order.insert("a", "b", shifted(stamp % 7), stamp)
    for stamp in stamps:
        shuffled.insert("a", "b", shifted(stamp % 7), stamp)
        shuffled.lookup("a", "b")
    at = generator.integers(min(stamps), max(stamps) + 1, 100)
    assert (shuffled.lookup_many("a", "b", at).xyz == in_order.lookup_many("a", "b", at).xyz).all()


def test_latest_is_the_newest_time_that_every_moving_edge_has_reached() -> None:
    buffer = moving()
    buffer.insert("lidar", "hand", shifted(0), EPOCH - 500)
    buffer.insert("lidar", "hand", shifted(1), EPOCH + 500)
    assert buffer.latest("map", "hand") == EPOCH + 500
    assert x_of(buffer.lookup("map", "hand")) == 0.5 + 10 + 1


def test_frames_that_stand_still_have_no_latest_time() -> None:
    assert moving().latest("base", "lidar") is None


def test_a_stamp_of_zero_is_a_time_like_any_other() -> None:
    buffer = TransformBuffer()
    buffer.insert("a", "b", shifted(0), 0)
    buffer.insert("a", "b", shifted(1), 10)
    buffer.insert("b", "c", shifted(0), -10)
    buffer.insert("b", "c", shifted(1), 0)
    assert buffer.latest("a", "c") == 0
    assert x_of(buffer.lookup("a", "b", 0)) == 0.0


def test_a_lookup_across_times_joins_the_halves_at_the_fixed_frame() -> None:
    found = moving().lookup_across("lidar", EPOCH + 1000, "lidar", EPOCH, "map")
    assert x_of(found) == -1.0


def test_a_time_after_the_samples_names_the_edge_the_gap_and_the_way() -> None:
    with pytest.raises(TooLate) as caught:
        moving().lookup("map", "lidar", EPOCH + 1500)
    assert str(caught.value) == (
        "no data for map -> base at 1700000000.123458289; samples cover 1700000000.123456789 .. "
        "1700000000.123457789 (0.0000005 s too late), on the path map <- base <- lidar"
    )
    fields = caught.value.fields
    assert (fields["parent"], fields["child"], fields["short_ns"]) == ("map", "base", 500)
    assert (fields["first_ns"], fields["last_ns"], fields["at_ns"]) == (EPOCH, EPOCH + 1000, EPOCH + 1500)
    assert fields["available_until_ns"] == EPOCH + 1000


def test_a_time_before_the_samples_is_too_early() -> None:
    with pytest.raises(TooEarly, match=r"1 s too early.*whole path has data from 2\.0+ until 3\.0+"):
        two_edges(2, 3).lookup("a", "c", SECOND)


def two_edges(begin: int, end: int) -> TransformBuffer:
    """Make a -> b with samples at 0 and 3 s and b -> c with samples at two other times."""
    buffer = TransformBuffer()
    for seconds in (0, 3):
        buffer.insert("a", "b", shifted(0), seconds * SECOND)
    for seconds in (begin, end):
        buffer.insert("b", "c", shifted(0), seconds * SECOND)
    return buffer


def test_edges_that_never_overlap_are_both_named() -> None:
    with pytest.raises(TooEarly, match=r"a -> b ends at 3\.0+ before b -> c begins at 5\.0+: they never overlap"):
        two_edges(5, 6).lookup("a", "c")


def test_two_clocks_get_a_sentence_of_their_own() -> None:
    with pytest.raises(TooEarly, match="one of the clocks counts from 1970"):
        moving().lookup("map", "base", 3 * SECOND)
    buffer = TransformBuffer()
    buffer.insert("a", "b", shifted(0), 1_700_000_000 * SECOND)
    for seconds, clock in ((1_400_000_000, 1970), (1_900_000_000, 1970), (50, 0)):
        with pytest.raises(LookupFailed) as caught:
            buffer.lookup("a", "b", seconds * SECOND)
        assert ("counts from 1970" in str(caught.value)) == (clock == 0)


def test_an_unknown_frame_is_an_error_even_against_itself() -> None:
    with pytest.raises(UnknownFrame, match="did you mean 'lidar'"):
        moving().lookup("lidarr", "lidarr")


def test_frames_of_two_trees_are_not_connected_and_both_roots_are_named() -> None:
    buffer = moving()
    buffer.insert("island", "rock", shifted(0))
    with pytest.raises(NotConnected) as caught:
        buffer.lookup("lidar", "rock")
    assert (caught.value.fields["target_root"], caught.value.fields["source_root"]) == ("map", "island")


def test_a_parent_may_change_and_the_older_one_holds_until_then() -> None:
    buffer = TransformBuffer()
    buffer.insert("w", "shelf", shifted(100))
    buffer.insert("w", "hand", shifted(200))
    for stamp, parent in ((0, "shelf"), (10, "shelf"), (20, "hand"), (30, "hand")):
        buffer.insert(parent, "ball", shifted(stamp), stamp)
    found = buffer.lookup_many("w", "ball", [0, 5, 10, 15, 19, 20, 25, 30])
    assert found.xyz[:, 0].tolist() == [100, 105, 110, 110, 110, 220, 225, 230]
    assert [buffer.path("w", "ball", at) for at in (19, 20)] == [["w", "shelf", "ball"], ["w", "hand", "ball"]]


def test_two_publishers_that_disagree_make_the_tree_flicker_as_in_tf2() -> None:
    buffer = TransformBuffer()
    buffer.insert("w", "a", shifted(1000))
    buffer.insert("w", "b", shifted(2000))
    for stamp in range(400):
        buffer.insert("ab"[stamp % 2], "base", shifted(stamp), 2 * stamp)
    times = np.arange(0, 797)
    expected = [1000 * (1 + at // 2 % 2) + at // 2 for at in times]
    assert buffer.lookup_many("w", "base", times).xyz[:, 0].tolist() == expected
    assert [x_of(buffer.lookup("w", "base", int(at))) for at in times[::50]] == expected[::50]


def test_the_same_stamp_again_takes_the_last_word_with_a_warning() -> None:
    buffer = moving()
    buffer.insert("map", "base", shifted(1), EPOCH + 1000)
    with pytest.warns(FrametoolWarning, match="two different poses at 1700000000.123457789"):
        buffer.insert("map", "base", shifted(3), EPOCH + 1000)
    assert x_of(buffer.lookup("map", "base", EPOCH + 500)) == 1.5


@pytest.mark.parametrize(
    ("edge", "reason"),
    [
        (("base", "lidar", shifted(11)), "two different poses in 'base'"),
        (("map", "lidar", shifted(10)), "two parents: 'base' and 'map'"),
        (("base", "lidar", shifted(10), EPOCH), "is both static and moving"),
        (("map", "base", shifted(10)), "is both static and moving"),
        (("base", "base", shifted(1)), "its own parent"),
        (("lidar", "map", shifted(1)), "cycle"),
        (("lidar", "map", shifted(1), EPOCH), "cycle"),
    ],
)
def test_what_makes_no_tree_is_refused(edge: tuple[str, str, Transform], reason: str) -> None:
    buffer = TransformBuffer()
    for parent, child in (("map", "base"), ("base", "lidar")):
        buffer.insert(parent, child, shifted(10), None if "static" not in reason or child == "lidar" else EPOCH)
    with pytest.raises(BadTopology, match=reason):
        buffer.insert(*edge)


def test_a_frame_may_be_above_another_at_one_time_and_below_it_at_another() -> None:
    buffer = TransformBuffer()
    for stamp in (0, 10):
        buffer.insert("a", "b", shifted(1), stamp)
        buffer.insert("b", "a", shifted(2), stamp + 20)
    assert [x_of(buffer.lookup("a", "b", at)) for at in (5, 25)] == [1.0, -2.0]
    assert buffer.lookup_many("a", "b", [25, 5]).xyz[:, 0].tolist() == [-2.0, 1.0]


@pytest.mark.parametrize("stamp", [1.0, "1", 1 << 62, -(1 << 62)])
def test_a_stamp_is_a_whole_number_of_nanoseconds(stamp: int) -> None:
    with pytest.raises(ValueInvalid, match="nanoseconds"):
        TransformBuffer().insert("a", "b", shifted(0), stamp)
    with pytest.raises((ValueInvalid, LookupFailed)):
        moving().lookup("map", "base", stamp)


def test_times_as_floats_are_refused_in_bulk_too() -> None:
    with pytest.raises(ValueInvalid, match="integer nanoseconds"):
        moving().lookup_many("map", "base", [1.7e18])


def test_a_batch_keeps_the_shape_of_its_times_and_their_order() -> None:
    times = np.array([[EPOCH + 1000, EPOCH], [EPOCH + 250, EPOCH + 750]])
    found = moving().lookup_many("map", "base", times)
    assert found.xyz[..., 0].tolist() == [[1.0, 0.0], [0.25, 0.75]]


def test_a_batch_stops_at_the_first_time_without_data_or_marks_it() -> None:
    times = [EPOCH, EPOCH + 2000, EPOCH - 1]
    with pytest.raises(TooLate):
        moving().lookup_many("map", "base", times)
    found = moving().lookup_many("map", "base", times, missing="nan")
    assert np.isnan(found.xyz).all(axis=1).tolist() == [False, True, True]


def test_a_batch_gives_what_single_lookups_give() -> None:
    generator = np.random.default_rng(7)
    buffer = TransformBuffer()
    for edge in range(4):
        for stamp, pose in zip(np.sort(generator.choice(1000, 50, replace=False)), Transform.random(50, seed=edge), strict=True):
            buffer.insert(f"f{edge}", f"f{edge + 1}", pose, int(stamp))
    begin, end = buffer.span("f0", "f4") or (0, 0)
    times = generator.integers(begin, end + 1, 500)
    for target, source in (("f0", "f4"), ("f4", "f0"), ("f2", "f4")):
        singly = np.array([buffer.lookup(target, source, int(at)).as_matrix() for at in times])
        assert np.allclose(buffer.lookup_many(target, source, times).as_matrix(), singly, rtol=0.0, atol=1e-14)


def test_a_cache_keeps_so_much_before_each_newest_sample() -> None:
    buffer = moving(keep_ns=1000)
    buffer.insert("map", "base", shifted(2), EPOCH + 1500)
    with pytest.raises(TooEarly):
        buffer.lookup("map", "base", EPOCH + 400)
    with pytest.raises(ValueInvalid, match="older than the buffer keeps"):
        buffer.insert("map", "base", shifted(0), EPOCH)


def test_nothing_is_pruned_unless_asked() -> None:
    buffer = moving()
    buffer.insert("map", "base", shifted(2), EPOCH + 10**6 * SECOND)
    assert x_of(buffer.lookup("map", "base", EPOCH + 500)) == 0.5


def test_a_chain_of_1001_edges_works() -> None:
    buffer = TransformBuffer()
    for edge in range(1001):
        buffer.insert(f"f{edge}", f"f{edge + 1}", shifted(1), None if edge % 2 else 0)
    assert x_of(buffer.lookup("f0", "f1001")) == 1001.0
    assert x_of(buffer.lookup("f1001", "f0", 0)) == -1001.0


def test_a_hundred_thousand_frames_are_no_trouble() -> None:
    buffer = TransformBuffer()
    for frame in range(1, 100_001):
        buffer.insert(f"f{frame // 2}", f"f{frame}", shifted(1), 0)
    assert x_of(buffer.lookup("f0", "f100000")) == 17.0


def test_a_rotation_looked_up_between_samples_is_their_slerp_to_the_bit() -> None:
    samples = Transform.random(40, seed=3)
    buffer = TransformBuffer()
    for number, sample in enumerate(samples):
        buffer.insert("map", "base", sample, EPOCH + 1000 * number)
    for number in range(39):
        start, end = samples[number].rotation, samples[number + 1].rotation
        for after in (0, 1, 250, 500, 999, 1000):
            at_ns = EPOCH + 1000 * number + after
            expected = start.slerp(end, after / 1000).as_quaternion().tolist()
            assert buffer.lookup("map", "base", at_ns).xyzw.tolist() == expected


def test_edges_in_a_circle_that_held_one_after_the_other_do_not_stop_a_third() -> None:
    buffer = TransformBuffer()
    for parent, child, stamp_ns in (("a", "b", 1), ("b", "a", 2), ("a", "b", 3), ("c", "d", 1)):
        buffer.insert(parent, child, shifted(1), stamp_ns)
    buffer.insert("a", "c", shifted(1), 2)
    assert x_of(buffer.lookup("c", "d", 1)) == 1
