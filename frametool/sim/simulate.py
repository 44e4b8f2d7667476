"""The play: ticks, broadcasts, leaders and followers, each at its time; everything seen goes through tf.

At equal times: tick, then carrots, service calls, leaders, controllers. Commands and calls act at the first tick
strictly later. Poses enter the buffer as float32, the stamp is the tick's time, nothing is late on its way.
"""

from __future__ import annotations

import math
from heapq import heapify, heappop, heapreplace
from typing import TYPE_CHECKING, NamedTuple, Protocol

from frametool.errors import LookupFailed, UnknownFrame, ValueInvalid
from frametool.frames.buffer import TransformBuffer
from frametool.frames.stamps import BILLION
from frametool.sim.leaders import Curtain, Heading
from frametool.sim.scene import Follow
from frametool.sim.targets import CARROT_NS, frame_of, offset, planar
from frametool.sim.turtle import TICK_NS, State, TurtlePose
from frametool.sim.world import ServiceRefused, World

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.geometry.transform import Transform
    from frametool.sim.leaders import Leader
    from frametool.sim.scene import Actor, Call, Scene
    from frametool.sim.turtle import Pen, Twist
    from frametool.sim.world import WallHit

WORLD = "world"
CACHE_NS = 10 * BILLION  # tf's own default


class Command(NamedTuple):
    """What a follower or a leader commanded; what it saw: distance (m) to its target, the two turtles' states."""

    t_ns: int
    turtle: str
    twist: Twist
    distance: float | None
    leader: State | None
    state: State


class Broadcast(NamedTuple):
    """A transform as it was published: the pose of `child` in `parent` at a time."""

    stamp_ns: int
    parent: str
    child: str
    transform: Transform


class Step:
    """One instant at which something happened; what did not is empty."""

    __slots__ = (
        "broadcasts", "clears", "commands", "is_tick", "led", "log", "pens", "poses", "states", "t_ns", "walls",
    )  # fmt: skip

    def __init__(self, t_ns: int) -> None:
        """Begin an instant."""
        self.t_ns = t_ns
        self.is_tick = False
        self.poses: dict[str, TurtlePose] = {}  # of every turtle, if this is a tick; at time 0 where they were spawned
        self.states: dict[str, State] = {}  # the same before rounding
        self.pens: dict[str, Pen] = {}
        self.commands: list[Command] = []  # of followers
        self.led: list[Command] = []  # of leaders
        self.walls: list[WallHit] = []
        self.broadcasts: list[Broadcast] = []
        self.log: list[str] = []
        self.clears = 0  # how often the drawing has been cleared so far


class Part(Protocol):
    """Whoever acts at times."""

    rank: int

    def act(self, now_ns: int, stage: Stage, step: Step) -> int | None:
        """Act, and say when to be called again; None: never."""


class Stage:
    """What the parts share: the world, the buffer, where turtles were last seen."""

    def __init__(self, scene: Scene) -> None:
        """Spawn the turtles of a scene."""
        longest = max((follow.delay_ns for follow in scene.followers.values()), default=0)
        self.world = World(scene.variant, holonomic=scene.holonomic)
        self.buffer = TransformBuffer(keep_ns=max(CACHE_NS, longest + BILLION))
        self.states: dict[str, State] = {}
        self.calls: list[Call] = []
        for actor in scene.actors:
            self.world.spawn(*actor.spawn, actor.name)

    def broadcast(self, step: Step, parent: str, child: str, transform: Transform) -> None:
        """Publish a transform: into the buffer, and into the step for whoever watches."""
        self.buffer.insert(parent, child, transform, step.t_ns)
        step.broadcasts.append(Broadcast(step.t_ns, parent, child, transform))


class Ticker:
    """turtlesim's timer: calls, motion, poses; at time 0 only poses."""

    rank = 0

    def act(self, now_ns: int, stage: Stage, step: Step) -> int:
        """Move the world on by one tick."""
        world = stage.world
        self._serve(stage, step)
        step.is_tick = True
        if now_ns:
            step.walls = world.tick(now_ns)
        step.clears = world.clears
        for name, turtle in world.turtles.items():
            pose = step.poses[name] = turtle.pose
            step.states[name] = turtle.state
            step.pens[name] = turtle.pen
            stage.broadcast(step, WORLD, name, planar(pose.x, pose.y, pose.theta))
        stage.states.update(step.states)
        return now_ns + TICK_NS

    def _serve(self, stage: Stage, step: Step) -> None:
        """Answer the service calls that have come in since the last tick."""
        for call in stage.calls:
            try:
                message = stage.world.call(call.service, **call.arguments)
            except ServiceRefused as refusal:
                message = f"{call.place}: {refusal}" if call.place else str(refusal)
            step.log += [message] if message else []
        stage.calls.clear()


class Carrot:
    """The broadcaster of a carrot frame beside a turtle, fixed or moving, ten times a second."""

    rank = 1

    def __init__(self, turtle: str, target: str) -> None:
        """Hang the carrot on a turtle."""
        self.turtle = turtle
        self.target = target

    def act(self, now_ns: int, stage: Stage, step: Step) -> int:
        """Publish where the carrot is."""
        x, y = offset(self.target, now_ns)
        stage.broadcast(step, self.turtle, frame_of(self.turtle, self.target), planar(x, y, 0.0))
        return now_ns + CARROT_NS


class Caller:
    """Whoever makes one service call."""

    rank = 2

    def __init__(self, call: Call) -> None:
        """Keep the call."""
        self.call = call

    def act(self, now_ns: int, stage: Stage, step: Step) -> None:  # noqa: ARG002
        """Send it; the world answers at its next tick."""
        stage.calls.append(self.call)


class Drive:
    """A leader at the wheel of its turtle; when the turtle is gone its commands reach nobody."""

    rank = 3

    def __init__(self, turtle: str, leader: Leader) -> None:
        """Let a leader drive a turtle."""
        self.turtle = turtle
        self.leader = leader
        self._pose = TurtlePose(0.0, 0.0, 0.0, 0.0, 0.0)

    def act(self, now_ns: int, stage: Stage, step: Step) -> int | None:
        """Send the leader's command."""
        turtle = stage.world.turtles.get(self.turtle)
        if turtle is not None:
            self._pose = turtle.pose
        given = self.leader.command(self._pose)
        if turtle is None or given is None:
            return self.leader.due_ns
        if isinstance(given, Heading):
            turtle.rotate_absolute(given.theta)
        else:
            turtle.command(given)
            step.led.append(Command(now_ns, self.turtle, given, None, None, turtle.state))
        return self.leader.due_ns


class Chase:
    """A follower: looks its target up, and drives there; where tf has no answer, it lets the step pass."""

    rank = 4

    def __init__(self, turtle: str, follow: Follow) -> None:
        """Let a turtle follow."""
        self.turtle = turtle
        self.follow = follow
        self.frame = frame_of(follow.leader, follow.target)
        self._count = 0
        self._failing = ""

    def act(self, now_ns: int, stage: Stage, step: Step) -> int:
        """Look, command, and wait for the next control step."""
        self._count += 1
        if self.turtle in stage.world.turtles:
            self._steer(now_ns, stage, step)
        return self.follow.controller.due_ns(self._count)

    def _steer(self, now_ns: int, stage: Stage, step: Step) -> None:
        try:
            x, y = self._look(stage.buffer)
        except LookupFailed as error:
            self._tell(error, step)
            return
        self._failing = ""
        try:
            twist = self.follow.controller.command(x, y)
        except ValueInvalid as error:
            raise ValueInvalid(f"{self.turtle}: {error}") from None
        stage.world.turtles[self.turtle].command(twist)
        states = stage.states
        distance = math.sqrt(x * x + y * y)
        step.commands.append(
            Command(now_ns, self.turtle, twist, distance, states.get(self.follow.leader), states[self.turtle]),
        )

    def _look(self, buffer: TransformBuffer) -> tuple[float, float]:
        """Return the target as the turtle sees it: at the latest common time, or where it was a while ago."""
        if not self.follow.delay_ns:
            return buffer.lookup(self.turtle, self.frame).components[:2]
        now_ns = buffer.latest(WORLD, self.turtle)
        if now_ns is None:
            raise UnknownFrame(self.turtle, known=())
        past_ns = now_ns - self.follow.delay_ns
        return buffer.lookup_across(self.turtle, now_ns, self.frame, past_ns, WORLD).components[:2]

    def _tell(self, error: LookupFailed, step: Step) -> None:
        """Say once why there is no command, until there is one again."""
        if type(error).__name__ != self._failing:
            self._failing = type(error).__name__
            step.log.append(f"Could not transform {self.turtle} to {self.frame}: {error}")


def simulate(scene: Scene) -> Iterator[Step]:
    """Play a scene: give every instant at which something happens, in order, the last one included.

        for step in simulate(tutorial(spawn=(1.0, 1.0, 0.0))):
            for command in step.commands:
                print(command.t_ns, command.twist)

    Pure and deterministic: simulated time, no sleep, the same scene gives the same steps. Memory does not grow.
    Raises ValueInvalid when a scene is impossible.
    """
    stage = Stage(scene)
    queue = [(due_ns, part.rank, order, part) for order, (due_ns, part) in enumerate(_parts(scene))]
    heapify(queue)
    while queue and (scene.duration_ns is None or queue[0][0] <= scene.duration_ns):
        step = Step(queue[0][0])
        while queue and queue[0][0] == step.t_ns:
            _, rank, order, part = queue[0]
            try:
                due_ns = part.act(step.t_ns, stage, step)
            except Curtain:
                return
            if due_ns is None:
                heappop(queue)
            else:
                heapreplace(queue, (due_ns, rank, order, part))
        yield step


def _parts(scene: Scene) -> Iterator[tuple[int, Part]]:
    """Yield everybody who acts, with the time of the first act."""
    yield 0, Ticker()
    carrots = {(follow.leader, follow.target) for follow in scene.followers.values() if follow.target != "leader"}
    yield from ((0, Carrot(leader, target)) for leader, target in sorted(carrots))
    yield from ((call.t_ns, Caller(call)) for call in scene.calls)
    for actor in scene.actors:
        yield from _driver(actor)


def _driver(actor: Actor) -> Iterator[tuple[int, Part]]:
    if isinstance(actor.driver, Follow):
        if actor.driver.leader == actor.name:
            raise ValueInvalid(f"{actor.name} cannot follow itself")
        yield 0, Chase(actor.name, actor.driver)
    elif actor.driver is not None:
        leader = actor.driver()
        if leader.due_ns is not None:
            yield leader.due_ns, Drive(actor.name, leader)
