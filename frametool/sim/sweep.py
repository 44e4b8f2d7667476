"""Thousands of followers of one leader at once, on arrays; the same rules as `simulate`, without the buffer.

The leader does not see its followers, so it is played once; each follower is then a row of every array.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.sim.controllers import ARRIVED, FollowController, unbounded
from frametool.sim.scene import TUTORIAL_SPAWN, tutorial
from frametool.sim.simulate import simulate
from frametool.sim.turtle import DT, PI, SIZE, TICK_NS, TIMEOUT_NS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

    from frametool.sim.leaders import MakeLeader
    from frametool.sim.turtle import State, TurtlePose

    Way = list[tuple[State, TurtlePose]]
    Floats = NDArray[np.float64]

NUMBERS = ("gain_linear", "gain_angular", "max_linear", "max_angular")
BLOCK = 1 << 14  # followers at a time; smaller blocks spend their time on calls


class Many(NamedTuple):
    """What became of the followers; every field has their common shape.

    x, y (m), theta (rad): where they ended.  distance (m): to the leader, at the end.
    time_to_reach (s): when they first were within reach; nan where never.
    overshoot (m): how much further off than their nearest they were again after that; nan where never within reach.
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
) -> Many:  # fmt: skip
    """Let many followers chase one leader, each on its own.

    spawn: (..., 3) of x, y (m), theta (rad); gains and limits: arrays that broadcast with its leading shape.
    law gives what is None; rate (Hz) is one for all.

        starts = np.stack([xs, ys, np.zeros_like(xs)], axis=-1)
        simulate_many("circle", spawn=starts).time_to_reach

    Raises ValueInvalid for what `FollowController` would refuse, for velocities and a spawn that are not finite.
    """
    law_itself = FollowController(law, rate=rate)
    given = dict(zip(NUMBERS, (gain_linear, gain_angular, max_linear, max_angular), strict=True))
    numbers = [_checked(name, getattr(law_itself, name) if value is None else value) for name, value in given.items()]
    columns = np.broadcast_arrays(*np.moveaxis(_places(spawn), -1, 0), *numbers)
    shape, flat = columns[0].shape, [column.reshape(-1) for column in columns]
    way = _way(leader, duration, seed)
    blocks = [
        _chase([column[at : at + BLOCK] for column in flat], way, law_itself, reach)
        for at in range(0, max(flat[0].size, 1), BLOCK)
    ]
    return Many(*(np.concatenate(parts).reshape(shape) for parts in zip(*blocks, strict=True)))


def grid(gain_linear: ArrayLike, gain_angular: ArrayLike, leader: MakeLeader | str = "still", **options: Any) -> Many:
    """Try every pair of gains; the fields have a row for each linear gain and a column for each angular one."""
    linear, angular = (np.asarray(gains, dtype=float).reshape(-1) for gains in (gain_linear, gain_angular))
    return simulate_many(leader, gain_linear=linear[:, None], gain_angular=angular[None, :], **options)


def rows(gain_linear: Sequence[float], gain_angular: Sequence[float], many: Many) -> Iterator[dict[str, float | None]]:
    """Yield a grid as records, nan as None."""
    columns = [many.time_to_reach.tolist(), many.overshoot.tolist(), many.distance.tolist(), many.wall_hits.tolist()]
    names = ("time_to_reach", "overshoot", "final_distance", "wall_hits")
    for row, linear in enumerate(gain_linear):
        for column, angular in enumerate(gain_angular):
            cells = (values[row][column] for values in columns)
            known = {name: None if cell != cell else cell for name, cell in zip(names, cells, strict=True)}  # noqa: PLR0124 - nan
            yield {"gain_linear": linear, "gain_angular": angular, **known}


def _checked(name: str, value: ArrayLike) -> Floats:
    """Let the controller judge the least and the greatest of some numbers; no limit is infinite."""
    numbers = np.asarray(value, dtype=float)
    if np.isnan(numbers).any():
        raise ValueInvalid(f"{name} must not be nan")
    for extreme in (numbers.min(), numbers.max()) if numbers.size else ():
        if not (name.startswith("max") and extreme == math.inf):
            FollowController("ros1", **{name: float(extreme)})
    return numbers


def _places(spawn: ArrayLike) -> Floats:
    """Check the start poses, and round them to float32 as the spawn service does."""
    places = np.asarray(spawn, dtype=float)
    if places.shape[-1:] != (3,):
        raise ValueInvalid(f"spawn must have the shape (..., 3) of x, y, theta, found {places.shape}")
    if not np.isfinite(places).all():
        raise ValueInvalid("spawn must be finite")
    return _single(places)


def _single(values: Floats) -> Floats:
    """Round to float32."""
    return values.astype(np.float32).astype(float)


def _way(leader: MakeLeader | str, duration: float, seed: int) -> Way:
    """Play the leader alone: where it is at time 0 and after every tick, and what it publishes of that."""
    if not 0.0 <= duration < math.inf:
        raise ValueInvalid(f"duration must be finite and 0 or more, found {duration}")
    steps = simulate(tutorial(leader=leader, followers=0, duration=duration, seed=seed))
    return [(step.states["turtle1"], step.poses["turtle1"]) for step in steps if step.is_tick]


def _chase(columns: list[Floats], way: Way, law: FollowController, reach: float) -> tuple[Any, ...]:
    """Play one block of followers: x, y, theta, gains, limits in, the fields of Many out."""
    crowd = _Crowd(columns, reach)
    count, commanded_ns = 0, 0
    for tick, (state, pose) in enumerate(way):
        now_ns = tick * TICK_NS
        if tick:
            crowd.move(still=now_ns - commanded_ns > TIMEOUT_NS)
        crowd.measure(state, now_ns / BILLION)
        if law.due_ns(count) < now_ns + TICK_NS:
            crowd.steer(pose)
            commanded_ns = now_ns + TICK_NS
        while law.due_ns(count) < now_ns + TICK_NS:
            count += 1
    return crowd.result(way[-1][0])


class _Crowd:
    """The followers of one block: the turtle's arithmetic and the law's, on arrays that are written in place."""

    def __init__(self, columns: list[Floats], reach: float) -> None:
        self.x, y, self.theta = (column.copy() for column in columns[:3])
        self.down = _single(SIZE - y)
        self.gain_linear, self.gain_angular, self.max_linear, self.max_angular = columns[3:]
        self.reach = reach
        self.speed, self.turn, self.sine, self.cosine = (np.zeros_like(self.x) for _ in range(4))
        self.reached, self.nearest, self.overshoot = (np.full_like(self.x, np.nan) for _ in range(3))
        self.hits = np.zeros(self.x.shape, np.int64)
        self.unreached = True
        self._one, self._two = np.empty_like(self.x), np.empty_like(self.x)

    def move(self, *, still: bool) -> None:
        """Live through one tick: `Turtle.update`, without what followers never do."""
        if still:
            self.speed[:] = self.turn[:] = 0.0
        one, two = self._one, self._two
        np.multiply(self.turn, DT, out=one)
        self.theta += one
        np.add(self.theta, PI, out=one)
        one /= 2.0 * PI
        np.floor(one, out=one)
        one *= 2.0 * PI
        self.theta -= one
        np.cos(self.theta, out=self.cosine)
        np.sin(self.theta, out=self.sine)
        np.multiply(np.multiply(self.cosine, self.speed, out=one), DT, out=one)
        np.multiply(np.multiply(self.sine, self.speed, out=two), DT, out=two)
        self.x += one
        self.down -= two
        self._stay_inside()

    def _stay_inside(self) -> None:
        if all(axis.min(initial=0.0) >= 0.0 and axis.max(initial=SIZE) <= SIZE for axis in (self.x, self.down)):
            return
        self.hits += (self.x < 0.0) | (self.x > SIZE) | (self.down < 0.0) | (self.down > SIZE)
        np.clip(self.x, 0.0, SIZE, out=self.x)
        np.clip(self.down, 0.0, SIZE, out=self.down)

    def measure(self, leader: State, t: float) -> None:
        """Compare the distances with the reach, and with the nearest since that was reached."""
        distance = self._distance(leader, self._one, self._two)
        if self.unreached:
            new = np.isnan(self.reached) & (distance <= self.reach)
            self.reached[new] = t
            self.nearest[new] = distance[new]
            self.overshoot[new] = 0.0
            self.unreached = bool(np.isnan(self.reached).any())
        np.minimum(self.nearest, distance, out=self.nearest)
        distance -= self.nearest
        np.maximum(self.overshoot, distance, out=self.overshoot)

    def _distance(self, leader: State, one: Floats, two: Floats) -> Floats:
        np.subtract(self.x, leader.x, out=one)
        np.subtract(SIZE - leader.y, self.down, out=two)
        one *= one
        two *= two
        one += two
        return np.sqrt(one, out=one)

    def steer(self, leader: TurtlePose) -> None:
        """Follow the published pose: what `lookup` and `FollowController.command` give, from float32 poses."""
        theta = _single(self.theta)
        sine, cosine = np.sin(theta), np.cos(theta)
        across, up = leader.x - _single(self.x), leader.y - _single(SIZE - self.down)
        ahead, left = cosine * across + sine * up, cosine * up - sine * across
        distance = np.sqrt(ahead * ahead + left * left)
        moving = distance >= ARRIVED
        with np.errstate(over="ignore"):  # what comes of it is refused below
            self.speed = np.clip(self.gain_linear * distance * moving, -self.max_linear, self.max_linear)
            turn = self.gain_angular * np.arctan2(left, ahead) * moving
        self.turn = np.clip(turn, -self.max_angular, self.max_angular)
        self._check_finite(distance)

    def _check_finite(self, distance: Floats) -> None:
        finite = np.isfinite(self.speed) & np.isfinite(self.turn)
        if not finite.all():
            first = int(np.argmin(finite))
            raise ValueInvalid(unbounded(self.gain_linear[first], self.gain_angular[first], distance[first]))

    def result(self, leader: State) -> tuple[Any, ...]:
        """Return the fields of Many."""
        distance = self._distance(leader, np.empty_like(self.x), self._two)
        return self.x, SIZE - self.down, self.theta, distance, self.reached, self.overshoot, self.hits
