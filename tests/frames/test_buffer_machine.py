"""Random sequences of inserts and lookups, against an oracle that is slow and obvious: lists, scans, scipy."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import hypothesis.strategies as st
import numpy as np
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule
from scipy.spatial.transform import Rotation, Slerp

from frametool import Transform, TransformBuffer
from frametool.errors import BadTopology, LookupFailed

if TYPE_CHECKING:
    from numpy.typing import NDArray

START = 1_700_000_000_123_456_789
FRAMES = 6
stamps = st.integers(0, 12).map(lambda step: START + step * 250_000_007)
times = st.one_of(stamps, st.integers(START - 1, START + 12 * 250_000_007 + 1))
children = st.integers(1, FRAMES - 1)
frames = st.integers(0, FRAMES - 1)
poses = st.integers(0, 2**32 - 1)


def pose_of(seed: int) -> tuple[NDArray[np.float64], Rotation]:
    """Draw a pose."""
    generator = np.random.default_rng(seed)
    return generator.normal(size=3), Rotation.random(random_state=generator)


def as_matrix(xyz: NDArray[np.float64], rotation: Rotation) -> NDArray[np.float64]:
    """Return the homogeneous matrix."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), xyz
    return matrix


class Oracle:
    """A list of everything that was said, scanned for every question."""

    def __init__(self) -> None:
        """Begin with nothing said."""
        self.said: list[tuple[int, int, int | None, int]] = []  # parent, child, stamp, pose

    def samples(self, child: int) -> list[tuple[int, int, int]]:
        """Return (stamp, parent, pose) of a child, oldest first; the last word on a stamp counts."""
        last = {stamp: (parent, pose) for parent, each, stamp, pose in self.said if each == child and stamp is not None}
        return [(stamp, *last[stamp]) for stamp in sorted(last)]

    def edge(self, child: int, at: int) -> tuple[int, NDArray[np.float64]] | None:
        """Return parent and pose of a child at a time; None without data."""
        for parent, each, stamp, pose in self.said:
            if each == child and stamp is None:
                return parent, as_matrix(*pose_of(pose))
        samples = self.samples(child)
        for stamp, parent, pose in samples:
            if stamp == at:
                return parent, as_matrix(*pose_of(pose))
        for (begin, parent, first), (end, other, second) in pairwise(samples):
            if begin < at < end:
                return parent, between(first, second if other == parent else first, (at - begin) / (end - begin))
        return None

    def to_top(self, frame: int, at: int) -> list[tuple[int, NDArray[np.float64]]]:
        """Return a frame and those above it as far as there are data, each with the frame's pose in it."""
        way = [(frame, np.eye(4))]
        while (edge := self.edge(way[-1][0], at)) is not None:
            way.append((edge[0], edge[1] @ way[-1][1]))
        return way

    def lookup(self, target: int, source: int, at: int) -> NDArray[np.float64] | None:
        """Return the pose of source in target where the two ways up meet; None where they do not."""
        if not {target, source} <= self.frames():
            return None
        downward = dict(self.to_top(target, at))
        for frame, top_from_source in self.to_top(source, at):
            if frame in downward:
                return np.asarray(np.linalg.inv(downward[frame]) @ top_from_source)
        return None

    def latest(self, target: int, source: int) -> int | None:
        """Return the least of the newest stamps between the two, along the newest parents."""
        parents = {child: parent for parent, child, stamp, _ in self.said if stamp is None}
        parents |= {child: self.samples(child)[-1][1] for _, child, stamp, _ in self.said if stamp is not None}
        lines = []
        for frame in (target, source):
            line = [frame]
            while line[-1] in parents:
                line.append(parents[line[-1]])
            lines.append(line)
        edges = set(lines[0]) ^ set(lines[1])
        newest = [self.samples(child)[-1][0] for child in edges if self.samples(child)]
        return min(newest, default=None)

    def frames(self) -> set[int]:
        """Return every frame mentioned."""
        return {frame for parent, child, _, _ in self.said for frame in (parent, child)}


def between(first: int, second: int, fraction: float) -> NDArray[np.float64]:
    """Interpolate two poses with scipy."""
    (a, start), (b, end) = pose_of(first), pose_of(second)
    turned = Slerp([0.0, 1.0], Rotation.concatenate([start, end]))(fraction)
    return as_matrix((1.0 - fraction) * a + fraction * b, turned)


class Machine(RuleBasedStateMachine):
    """Do to the buffer what is done to the oracle; they must agree."""

    @initialize()
    def begin(self) -> None:
        """Begin empty."""
        self.buffer, self.oracle = TransformBuffer(), Oracle()

    @rule(child=children, below=st.integers(0, 99), stamp=stamps, pose=poses)
    def insert(self, child: int, below: int, stamp: int, pose: int) -> None:
        """Insert a sample under any lower frame, so that no cycle can arise."""
        self._insert(below % child, child, stamp, pose)

    @rule(child=children, below=st.integers(0, 99), pose=poses)
    def insert_standing(self, child: int, below: int, pose: int) -> None:
        """Insert a frame that stands still."""
        self._insert(below % child, child, None, pose)

    def _insert(self, parent: int, child: int, stamp: int | None, pose: int) -> None:
        kinds = {(each is None) for _, other, each, _ in self.oracle.said if other == child}
        xyz, rotation = pose_of(pose)
        components = Transform.from_arrays(xyz, rotation.as_quat()).components
        try:
            self.buffer.insert_components(f"f{parent}", f"f{child}", components, stamp)
        except BadTopology:
            assert kinds == {True} or (stamp is None and kinds)
        else:
            assert not kinds or (kinds == {False} and stamp is not None) or (parent, child, None, pose) in self.oracle.said
            self.oracle.said.append((parent, child, stamp, pose))

    @rule(seen_from=frames, source=frames, at=times)
    def lookup(self, seen_from: int, source: int, at: int) -> None:
        """Look up at a time, singly and in bulk."""
        expected = self.oracle.lookup(seen_from, source, at)
        names = f"f{seen_from}", f"f{source}"
        if expected is None:
            try:
                found = self.buffer.lookup_many(*names, [at, at], missing="nan")
            except LookupFailed:
                found = None
            assert found is None or np.isnan(found.xyz).all()
            try:
                self.buffer.lookup(*names, at)
            except LookupFailed:
                return
            raise AssertionError("an answer without data")
        assert np.allclose(self.buffer.lookup(*names, at).as_matrix(), expected, rtol=0.0, atol=1e-12)
        assert np.allclose(self.buffer.lookup_many(*names, [at, at]).as_matrix(), expected, rtol=0.0, atol=1e-12)

    @rule(seen_from=frames, source=frames)
    def latest(self, seen_from: int, source: int) -> None:
        """Ask for the latest common time."""
        if seen_from != source:
            try:
                found = self.buffer.latest(f"f{seen_from}", f"f{source}")
            except LookupFailed:
                return
            assert found == self.oracle.latest(seen_from, source)


Machine.TestCase.settings = settings(max_examples=60, stateful_step_count=30, deadline=None, derandomize=True)
test_the_buffer_agrees_with_the_oracle = Machine.TestCase
