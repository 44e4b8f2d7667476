"""The data of one control step of the followers of a run, for its derivation."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid
from frametool.explain.derive import FollowStep, PlanarSample, Sighting
from frametool.frames.stamps import BILLION, format_stamp
from frametool.sim.drivers import ARRIVED, frame_of
from frametool.sim.simulate import CACHE_NS, simulate

if TYPE_CHECKING:
    from frametool.sim.scene import Follow, Scene
    from frametool.sim.simulate import IssuedCommand, SimulationStep


def follow_steps(scene: Scene, number: int) -> list[FollowStep]:
    """Run a scene until its followers have taken a control step, counted from 0; return the step of each.

        frametool.explain("follow", frametool.follow_steps(frametool.tutorial(), 3))

    Raises ValueInvalid if there is no such step, or no command in it.
    """
    followers = scene.followers
    if not followers:
        raise ValueInvalid("nobody follows in this scene")
    if number < 0:
        raise ValueInvalid(f"control steps are counted from 0, found {number}")
    due = {name: follow.controller.due_ns(number) for name, follow in followers.items()}
    if scene.duration_ns is not None and max(due.values()) > scene.duration_ns:
        rate = followers[max(due, key=due.__getitem__)].controller.rate
        end, last = format_stamp(scene.duration_ns)[:-6], int(scene.duration_ns / BILLION * rate + 1e-9)
        raise ValueInvalid(f"step {number} comes after the end of the run at {end} s; steps: 0 .. {last}")
    seen = _Seen(CACHE_NS + max(follow.delay_ns for follow in followers.values()))
    found: dict[str, FollowStep] = {}
    for step in simulate(scene):
        seen.watch(step)
        for command in step.commands:
            if due.get(command.turtle) == step.t_ns:
                found[command.turtle] = seen.step(command, followers[command.turtle], number)
        if step.t_ns >= max(due.values()):
            break
    if missing := [name for name in followers if name not in found]:
        why = f": {seen.reason}" if seen.reason else ""
        raise ValueInvalid(f"{missing[0]} has no command at step {number}, {format_stamp(due[missing[0]])} s{why}")
    return [found[name] for name in followers]


class _Seen:
    """The recent transforms of each frame: turtles in the world, carrots relative to their leader."""

    def __init__(self, keep_ns: int) -> None:
        self.keep_ns = keep_ns
        self.samples: dict[str, deque[PlanarSample]] = {}
        self.reason = ""

    def watch(self, step: SimulationStep) -> None:
        """Store the broadcasts of a step; drop those older than a lookup needs."""
        for sent in step.broadcasts:
            x, y, theta, *_ = step.poses.get(sent.child) or (*sent.transform.components[:2], 0.0)
            sample = PlanarSample(sent.stamp_ns, x, y, theta)
            recent = self.samples.setdefault(sent.child, deque())
            recent.append(sample)
            while recent[0].stamp_ns < sample.stamp_ns - self.keep_ns:
                recent.popleft()
        self.reason = next((line for line in step.log if line.startswith("Could not transform")), self.reason)

    def step(self, command: IssuedCommand, follow: Follow, number: int) -> FollowStep:
        """Return the input and the command of a follower."""
        target = frame_of(follow.leader, follow.target)
        newest = {name: self.samples[name][-1].stamp_ns for name in (command.turtle, follow.leader, target)}
        own_ns = newest[command.turtle] if follow.delay_ns else min(newest.values())
        led_ns = command.t_ns - follow.delay_ns if follow.delay_ns else own_ns
        controller, twist = follow.controller, command.twist
        return FollowStep(
            number, command.t_ns, command.turtle, follow.leader, target,
            self._at(command.turtle, own_ns), self._at(follow.leader, led_ns),
            self._at(target, led_ns) if target != follow.leader else None,
            (controller.gain_linear, controller.gain_angular), (controller.max_linear, controller.max_angular),
            ARRIVED, command.distance or 0.0, twist.linear_x, twist.angular_z,
        )  # fmt: skip

    def _at(self, frame: str, at_ns: int) -> Sighting:
        """Return the samples around a time."""
        before = self.samples[frame][0]
        for sample in self.samples[frame]:
            if sample.stamp_ns > at_ns:
                return Sighting(at_ns, before, None if before.stamp_ns == at_ns else sample)
            before = sample
        return Sighting(at_ns, before)
