"""What a run comes to: how near each follower is, how soon it was there, how often a wall was hit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from frametool.errors import printable
from frametool.frames.stamps import BILLION
from frametool.sim.targets import offset
from frametool.sim.turtle import TurtleState

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.sim.scene import Follow, Scene
    from frametool.sim.simulate import SimulationStep


class RunSummary:
    """Watch the steps of a scene and sum them up; memory does not grow.

    reach: metres within which a follower counts as having come to its target.
    """

    def __init__(self, scene: Scene, reach: float = 0.5) -> None:
        """Create the summary of a run that has not begun."""
        self.reach = reach
        self.t_ns: int | None = None  # of the last step
        self.walls: dict[str, int] = {}
        self.distances: dict[str, float] = {}
        self.reached_ns: dict[str, int] = {}
        self.gone: dict[str, tuple[str, int]] = {}  # follower -> who of the two left the world, and when
        self._follows = scene.followers

    def watch(self, step: SimulationStep) -> None:
        """Count a step in."""
        self.t_ns = step.t_ns
        for hit in step.walls:
            self.walls[hit.turtle] = self.walls.get(hit.turtle, 0) + 1
        for name, follow in self._follows.items():
            if name in step.states and follow.leader in step.states:
                distance = step.states[name].distance(goal(step.states[follow.leader], follow, step.t_ns))
                self.distances[name] = distance
                if distance <= self.reach:
                    self.reached_ns.setdefault(name, step.t_ns)
            elif step.is_tick and name in self.distances:
                del self.distances[name]
                self.gone[name] = (follow.leader if name in step.states else name, step.t_ns)

    def lines(self) -> Iterator[str]:
        """Yield the summary: one line a follower, then the walls; names as a terminal may show them."""
        if self.t_ns is None:
            yield "ended before the first step"
            return
        yield from (printable(self._line(name, follow)) for name, follow in self._follows.items())
        hits = ", ".join(f"{printable(name)} {count}" for name, count in sorted(self.walls.items()))
        yield f"{_seconds(self.t_ns)} simulated; wall hits: {sum(self.walls.values())}" + (f" ({hits})" if hits else "")

    def _line(self, name: str, follow: Follow) -> str:
        target = follow.leader if follow.target == "leader" else f"the {follow.target} of {follow.leader}"
        if name not in self.distances and name not in self.gone:
            return f"{name}: never in the world together with {follow.leader}"
        reached = self.reached_ns.get(name)
        near = f"within {self.reach:g} m"
        soon = f"never {near}" if reached is None else f"{near} after {_seconds(reached)}"
        if name in self.distances:
            return f"{name}: final distance to {target} {self.distances[name]:.4f} m; {soon}"
        who, when_ns = self.gone[name]
        return f"{name}: no final distance, {who} left the world at {_seconds(when_ns)}; {soon}"


def goal(leader: TurtleState, follow: Follow, now_ns: int) -> TurtleState:
    """Return where a follower's target is, in the world."""
    x, y = offset(follow.target, now_ns)
    cosine, sine = math.cos(leader.theta), math.sin(leader.theta)
    return TurtleState(leader.x + cosine * x - sine * y, leader.y + sine * x + cosine * y, leader.theta)


def _seconds(t_ns: int) -> str:
    return f"{t_ns / BILLION:.3f}".rstrip("0").rstrip(".") + " s"
