"""Thousands of followers of one leader at once, on arrays; the same rules as `simulate`, without the buffer.

The leader does not depend on its followers, so it is run once; each follower is a row of every array.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool import sizes
from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.geometry import arrays
from frametool.geometry.floats import bearing, half_sincos
from frametool.sim.drivers import ARRIVED, FollowController, unbounded
from frametool.sim.scene import TUTORIAL_SPAWN, tutorial
from frametool.sim.simulate import simulate
from frametool.sim.turtle import DT, FASTEST_TURN, SIZE, TICK_NS, TIMEOUT_NS, wrapped

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from frametool.sim.drivers import MakeLeader
    from frametool.sim.turtle import TurtlePose, TurtleState

    LeaderTrack = list[tuple[TurtleState, TurtlePose]]
    Floats = NDArray[np.float64]

NUMBERS = ("gain_linear", "gain_angular", "max_linear", "max_angular")


class SweepResult(NamedTuple):
    """The results of the followers; every field has their common shape.

    x, y (m), theta (rad): final poses.  distance (m): to the leader, at the end.
    time_to_reach (s): of the first time within reach; nan for never.
    overshoot (m): the largest increase of the distance after its minimum from then on; nan if never within reach.
    wall_hits: ticks at a wall.
    """

    x: Floats
    y: Floats
    theta: Floats
    distance: Floats
    time_to_reach: Floats
    overshoot: Floats
    wall_hits: NDArray[np.int64]


def simulate_many(
    leader: MakeLeader | str = "still", *, spawn: ArrayLike = TUTORIAL_SPAWN, law: str = "ros1",
    rate: float | None = None, gain_linear: ArrayLike | None = None, gain_angular: ArrayLike | None = None,
    max_linear: ArrayLike | None = None, max_angular: ArrayLike | None = None,
    duration: float = 20.0, reach: float = 0.5, seed: int = 0,
) -> SweepResult:  # fmt: skip
    """Simulate many followers of one leader, each independently.

    spawn: (..., 3) of x, y (m), theta (rad); gains and limits: arrays that broadcast with its leading shape.
    law sets the defaults; rate (Hz) is one for all.

        starts = np.stack([xs, ys, np.zeros_like(xs)], axis=-1)
        simulate_many("circle", spawn=starts).time_to_reach

    Raises ValueInvalid for what `FollowController` would refuse, for velocities and a spawn that are not finite.
    """
    law_itself = FollowController(law, rate=rate)
    options = dict(zip(NUMBERS, (gain_linear, gain_angular, max_linear, max_angular), strict=True))
    numbers = [_checked(name, getattr(law_itself, name) if value is None else value) for name, value in options.items()]
    columns = np.broadcast_arrays(*np.moveaxis(_places(spawn), -1, 0), *numbers)
    shape, flat = columns[0].shape, [column.reshape(-1) for column in columns]
    if not 0.0 <= duration < math.inf:
        raise ValueInvalid(f"duration must be finite and 0 or more, found {duration}")
    steps = simulate(tutorial(leader=leader, followers=0, duration=duration, seed=seed))
    track = [(step.states["turtle1"], step.poses["turtle1"]) for step in steps if step.is_tick]
    blocks = [
        _follow([column[at : at + sizes.FOLLOWERS] for column in flat], track, law_itself, reach)
        for at in range(0, max(flat[0].size, 1), sizes.FOLLOWERS)
    ]
    return SweepResult(*(np.concatenate(parts).reshape(shape) for parts in zip(*blocks, strict=True)))


def _checked(name: str, value: ArrayLike) -> Floats:
    """Let the controller check the least and the greatest of some numbers; no limit is infinite."""
    numbers = np.asarray(value, dtype=float)
    if np.isnan(numbers).any():
        raise ValueInvalid(f"{name} must not be nan")
    for extreme in (numbers.min(), numbers.max()) if numbers.size else ():
        if not (name.startswith("max") and extreme == math.inf):
            FollowController("ros1", **{name: float(extreme)})
    return numbers


def _places(spawn: ArrayLike) -> Floats:
    """Check the start poses, and round them to float32 like the spawn service."""
    places = np.asarray(spawn, dtype=float)
    if places.shape[-1:] != (3,):
        raise ValueInvalid(f"spawn must have the shape (..., 3) of x, y, theta, found {places.shape}")
    with np.errstate(over="ignore"):
        rounded = _single(places)
    if not np.isfinite(rounded).all():
        raise ValueInvalid("spawn must be finite float32 numbers")
    return rounded


def _single(values: Floats) -> Floats:
    """Round to float32."""
    return values.astype(np.float32).astype(float)


def _follow(columns: list[Floats], track: LeaderTrack, law: FollowController, reach: float) -> tuple[Any, ...]:
    """Run one block of followers: x, y, theta, gains, limits in, the fields of SweepResult out."""
    block = _FollowerBlock(columns, reach)
    count, commanded_ns = 0, 0
    for tick, (state, pose) in enumerate(track):
        now_ns = tick * TICK_NS
        if tick:
            block.move(still=now_ns - commanded_ns > TIMEOUT_NS)
        block.measure(state, now_ns / BILLION)
        if law.due_ns(count) < now_ns + TICK_NS:
            block.steer(pose)
            commanded_ns = now_ns + TICK_NS
        while law.due_ns(count) < now_ns + TICK_NS:
            count += 1
    return block.result(track[-1][0])


class _FollowerBlock:
    """The followers of one block: the arithmetic of turtle and law, on arrays."""

    def __init__(self, columns: list[Floats], reach: float) -> None:
        self.x, y, self.theta = (column.copy() for column in columns[:3])  # changed in place
        self.down = _single(SIZE - y)
        self.gain_linear, self.gain_angular, self.max_linear, self.max_angular = columns[3:]
        self.reach = reach
        self.speed, self.turn = np.zeros_like(y), np.zeros_like(y)
        self.reached, self.nearest, self.overshoot = (np.full_like(y, np.nan) for _ in range(3))
        self.hits = np.zeros(y.shape, np.int64)
        self.unreached = True

    def move(self, *, still: bool) -> None:
        """Advance one tick: `Turtle.update`, without what followers never do."""
        if still:
            self.speed, self.turn = np.zeros_like(self.x), np.zeros_like(self.x)
        self.theta = wrapped(self.theta + self.turn * DT, np)
        sine, cosine = half_sincos(2.0 * self.theta, arrays)
        self.x += cosine * self.speed * DT
        self.down -= sine * self.speed * DT
        if all(axis.min(initial=0.0) >= 0.0 and axis.max(initial=SIZE) <= SIZE for axis in (self.x, self.down)):
            return
        self.hits += (self.x < 0.0) | (self.x > SIZE) | (self.down < 0.0) | (self.down > SIZE)
        self.x, self.down = np.clip(self.x, 0.0, SIZE), np.clip(self.down, 0.0, SIZE)

    def measure(self, leader: TurtleState, t: float) -> None:
        """Compare the distances with the reach, and with the minimum since it was reached."""
        distance = self._distance(leader)
        if self.unreached:
            new = np.isnan(self.reached) & (distance <= self.reach)
            self.reached[new] = t
            self.nearest[new] = distance[new]
            self.overshoot[new] = 0.0
            self.unreached = bool(np.isnan(self.reached).any())
        np.minimum(self.nearest, distance, out=self.nearest)
        np.maximum(self.overshoot, distance - self.nearest, out=self.overshoot)

    def _distance(self, leader: TurtleState) -> Floats:
        across, down = self.x - leader.x, SIZE - leader.y - self.down
        return np.sqrt(across * across + down * down)

    def steer(self, leader: TurtlePose) -> None:
        """Follow the published pose: `lookup` and `FollowController.command`, from float32 poses."""
        sine, cosine = half_sincos(2.0 * _single(self.theta), arrays)
        across, up = leader.x - _single(self.x), leader.y - _single(SIZE - self.down)
        ahead, left = cosine * across + sine * up, cosine * up - sine * across
        distance = np.sqrt(ahead * ahead + left * left)
        moving = distance >= ARRIVED
        with np.errstate(over="ignore", invalid="ignore"):  # overflows are refused below, or stop the turtle
            self.speed = np.clip(self.gain_linear * distance * moving, -self.max_linear, self.max_linear)
            turn = self.gain_angular * np.where(moving, bearing(left, ahead, distance, arrays), 0.0)
        self.turn = np.clip(turn, -self.max_angular, self.max_angular)
        finite = np.isfinite(self.speed) & (abs(self.turn) <= FASTEST_TURN)
        if not finite.all():
            first = int(np.argmin(finite))
            raise ValueInvalid(unbounded(self.gain_linear[first], self.gain_angular[first], distance[first]))

    def result(self, leader: TurtleState) -> tuple[Any, ...]:
        """Return the fields of SweepResult."""
        distance = self._distance(leader)
        return self.x, SIZE - self.down, self.theta, distance, self.reached, self.overshoot, self.hits
