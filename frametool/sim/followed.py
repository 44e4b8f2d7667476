"""The data of one control step of the followers of a run, for its derivation."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid
from frametool.explain.derive import FollowStep, PlanarSample, Sighting
from frametool.frames.stamps import BILLION, format_stamp
from frametool.sim.drivers import ARRIVED, frame_of
from frametool.sim.simulate import simulate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.sim.scene import Follow, Scene
    from frametool.sim.simulate import IssuedCommand


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
    samples: dict[str, list[PlanarSample]] = {}  # turtles in the world, carrots relative to their leader
    reason, found = "", {}
    for step in simulate(scene):
        for sent in step.broadcasts:
            x, y, theta, *_ = step.poses.get(sent.child) or (*sent.transform.components[:2], 0.0)
            samples.setdefault(sent.child, []).append(PlanarSample(sent.stamp_ns, x, y, theta))
        reason = next((line for line in step.log if line.startswith("Could not transform")), reason)
        for command in step.commands:
            if due.get(command.turtle) == step.t_ns:
                found[command.turtle] = _step(command, followers[command.turtle], number, samples)
        if step.t_ns >= max(due.values()):
            break
    if missing := [name for name in followers if name not in found]:
        why = f": {reason}" if reason else ""
        raise ValueInvalid(f"{missing[0]} has no command at step {number}, {format_stamp(due[missing[0]])} s{why}")
    return [found[name] for name in followers]


def _step(
    command: IssuedCommand, follow: Follow, number: int, samples: Mapping[str, Sequence[PlanarSample]]
) -> FollowStep:
    """Return the input and the command of a follower."""
    target = frame_of(follow.leader, follow.target)
    own_ns = min(samples[name][-1].stamp_ns for name in (command.turtle, follow.leader, target))
    led_ns = own_ns
    if follow.delay_ns:
        own_ns, led_ns = samples[command.turtle][-1].stamp_ns, command.t_ns - follow.delay_ns
    controller, twist = follow.controller, command.twist
    return FollowStep(
        number, command.t_ns, command.turtle, follow.leader, target,
        _at(samples[command.turtle], own_ns), _at(samples[follow.leader], led_ns),
        _at(samples[target], led_ns) if target != follow.leader else None,
        (controller.gain_linear, controller.gain_angular), (controller.max_linear, controller.max_angular),
        ARRIVED, command.distance or 0.0, twist.linear_x, twist.angular_z,
    )  # fmt: skip


def _at(samples: Sequence[PlanarSample], at_ns: int) -> Sighting:
    """Return the samples around a time; only one if it is at that time, or the last."""
    after = bisect_right(samples, at_ns, key=lambda sample: sample.stamp_ns)
    before = samples[max(after - 1, 0)]
    return Sighting(at_ns, before, None if before.stamp_ns == at_ns or after == len(samples) else samples[after])
