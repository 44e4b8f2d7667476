"""Run a scene in simulated time: ticks, broadcasts, leaders and followers, each when it is due; and summarise the run.

Followers see everything through tf. At equal times: tick, then carrots, service calls, leaders, controllers. Commands
and calls act at the first tick strictly later. Poses enter the buffer as float32, the stamp is the tick's time, without
delay.

Steps are written as velocity commands, poses or transforms, in every format; a transform is the pose of the child in
its parent.

    linear: {x: ..}, angular: {..}                                  YAML: messages as `ros2 topic echo` prints them
    {"t": 0.1, "turtle": "turtle2", "linear": {"x": ..}, "angular": {"z": ..}}             JSON: one object per line
    t,turtle,linear_x,angular_z,distance,leader_x,leader_y,leader_theta,x,y,theta          CSV
"""

from __future__ import annotations

import math
from collections import Counter, deque
from contextlib import suppress
from heapq import merge
from itertools import count
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.writers import dump_json
from frametool.errors import LookupFailed, ValueInvalid, printable
from frametool.formats.rows.csv import row
from frametool.frames.buffer import TransformBuffer
from frametool.frames.stamps import BILLION
from frametool.frames.topology import seconds
from frametool.geometry.transform import Transform
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style
from frametool.ros.messages import message_text, transform_stamped
from frametool.sim.scene import Follow, Scene
from frametool.sim.turtle import TICK_NS, EndOfRun, Heading, ServiceRefused, TurtlePose, TurtleState, Twist, World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.sim.turtle import MakeLeader, Pen, WallHit

    Process = Iterator[int]  # yields the nanoseconds at which it is to be resumed; ends when it has finished
    Watch = Callable[["SimulationStep"], object]
    Record = dict[str, Any]

WORLD = "world"
CACHE_NS = 10 * BILLION  # tf's own default


CARROT_NS = BILLION // 10  # between two broadcasts of a carrot
CARROT_ASIDE = 2.0  # metres
CARROT_CIRCLE = 10.0  # metres


def frame_of(turtle: str, target: str) -> str:
    """Return the frame that is looked up: the turtle, or its carrot (turtle1's is carrot1)."""
    if target == "leader":
        return turtle
    return f"carrot{turtle[6:]}" if turtle[:6] == "turtle" and turtle[6:].isdigit() else f"{turtle}_carrot"


def offset(target: str, now_ns: int) -> tuple[float, float]:
    """Return the position of a target in its leader's frame, in metres."""
    if target == "leader":
        return 0.0, 0.0
    if target == "carrot":
        return 0.0, CARROT_ASIDE
    angle = now_ns / BILLION * math.pi
    return CARROT_CIRCLE * math.sin(angle), CARROT_CIRCLE * math.cos(angle)


def planar(x: float, y: float, theta: float) -> Transform:
    """Return a pose in the plane as a transform."""
    return Transform.of(x, y, 0.0, 0.0, 0.0, math.sin(theta / 2.0), math.cos(theta / 2.0))


class IssuedCommand(NamedTuple):
    """A command of a follower or a leader, and the follower's input.

    t_ns: the time, in nanoseconds.
    turtle: the name of the commanded turtle.
    twist: the command.
    distance: metres to the target; None for leaders.
    leader: the pose of the followed turtle; None for leaders.
    state: the pose of the turtle itself.
    """

    t_ns: int
    turtle: str
    twist: Twist
    distance: float | None
    leader: TurtleState | None
    state: TurtleState


class SimulationStep:
    """One instant with events; fields without events are empty.

    t_ns: the time, in nanoseconds.
    is_tick: whether turtlesim's timer fired.
    poses: of every turtle by name, if this is a tick; at time 0 the spawn poses.
    states: the same before rounding to float32.
    pens: of each turtle.
    commands: those of followers.
    led: those of leaders.
    walls: turtles that were moved back to the wall.
    broadcasts: published transforms: stamp in nanoseconds, parent, child, the pose of the child in its parent.
    log: messages of turtlesim and the followers.
    clears: how often the drawing has been cleared so far.
    """

    def __init__(self, t_ns: int) -> None:
        """Create an instant without events."""
        self.t_ns = t_ns
        self.is_tick = False
        self.poses: dict[str, TurtlePose] = {}
        self.states: dict[str, TurtleState] = {}
        self.pens: dict[str, Pen] = {}
        self.commands: list[IssuedCommand] = []
        self.led: list[IssuedCommand] = []
        self.walls: list[WallHit] = []
        self.broadcasts: list[tuple[int, str, str, Transform]] = []
        self.log: list[str] = []
        self.clears = 0


class Simulation:
    """The common state of the processes: the world, tf's buffer, the current instant, the last poses of turtles."""

    def __init__(self, scene: Scene) -> None:
        """Spawn the turtles of a scene."""
        longest = max((follow.delay_ns for follow in scene.followers.values()), default=0)
        self.world = World(scene.variant, holonomic=scene.holonomic)
        self.buffer = TransformBuffer(keep_ns=max(CACHE_NS, longest + BILLION))
        self.step = SimulationStep(0)
        self.states: dict[str, TurtleState] = {}
        self._calls = deque(sorted(scene.calls, key=attrgetter("t_ns")))  # that have not been sent yet
        for turtle in scene.turtles:
            self.world.spawn(*turtle.spawn, turtle.name)

    def broadcast(self, parent: str, child: str, transform: Transform) -> None:
        """Publish a transform: to the buffer, and to the step for observers."""
        self.buffer.insert(parent, child, transform, self.step.t_ns)
        self.step.broadcasts.append((self.step.t_ns, parent, child, transform))

    def ticks(self) -> Process:
        """Fire turtlesim's timer: service calls, motion, poses; at time 0 only poses."""
        for now_ns in count(0, TICK_NS):
            yield now_ns
            step, world = self.step, self.world
            while self._calls and self._calls[0].t_ns < now_ns:
                call = self._calls.popleft()
                try:
                    message = world.call(call.service, **call.arguments)
                except ServiceRefused as refusal:
                    message = f"{call.place}: {refusal}" if call.place else str(refusal)
                step.log += [message] if message else []
            step.is_tick = True
            if now_ns:
                step.walls = world.tick(now_ns)
            step.clears = world.clears
            for name, turtle in sorted(world.turtles.items()):
                pose = step.poses[name] = turtle.pose
                step.states[name] = turtle.state
                step.pens[name] = turtle.pen
                self.broadcast(WORLD, name, planar(pose.x, pose.y, pose.theta))
            self.states.update(step.states)


def simulate(scene: Scene) -> Iterator[SimulationStep]:
    """Run a scene: yield every instant with events, in order, the last one included.

        for step in simulate(tutorial(spawn=(1.0, 1.0, 0.0))):
            for command in step.commands:
                print(command.t_ns, command.twist)

    Pure and deterministic: simulated time, no sleep, the same scene gives the same steps. Memory does not grow.
    Raises ValueInvalid for an impossible scene.
    """
    simulation, followers = Simulation(scene), scene.followers
    carrots = sorted({(each.leader, each.target) for each in followers.values() if each.target != "leader"})
    leaders = ((name, make) for name, _, make in scene.turtles if not (make is None or isinstance(make, Follow)))
    due = merge(  # the first of processes that are due at the same time comes first
        simulation.ticks(), *(_carrot(simulation, *each) for each in carrots),
        *(_leader(simulation, *each) for each in leaders),
        *(_controller(simulation, *each) for each in followers.items()),
    )  # fmt: skip
    with suppress(EndOfRun):
        for due_ns in due:  # resumes the process that was due before
            if due_ns != simulation.step.t_ns:
                yield simulation.step
                simulation.step = SimulationStep(due_ns)
            if scene.duration_ns is not None and due_ns > scene.duration_ns:
                return
        yield simulation.step


def _carrot(simulation: Simulation, turtle: str, target: str) -> Process:
    """Broadcast a carrot frame relative to a turtle, fixed or moving, ten times per second."""
    for now_ns in count(0, CARROT_NS):
        yield now_ns
        x, y = offset(target, now_ns)
        simulation.broadcast(turtle, frame_of(turtle, target), planar(x, y, 0.0))


def _leader(simulation: Simulation, name: str, make: MakeLeader) -> Process:
    """Send a leader's commands to its turtle; without the turtle they are dropped."""
    pose, turtle = TurtlePose(0.0, 0.0, 0.0, 0.0, 0.0), None

    def look() -> TurtlePose:
        return pose

    for each in make(look):
        if isinstance(each, int):
            yield each
            turtle = simulation.world.turtles.get(name)
            pose = pose if turtle is None else turtle.pose
        elif turtle is None:
            continue
        elif isinstance(each, Heading):
            turtle.rotate_absolute(each.theta)
        else:
            turtle.command(each)
            step = simulation.step
            step.led.append(IssuedCommand(step.t_ns, name, each, None, None, turtle.state))


def _controller(simulation: Simulation, name: str, follow: Follow) -> Process:
    """Run the tutorial's listener: look up the target in tf at the rate of the law, and drive there.

    If the lookup fails it skips the cycle and logs the reason once, until the next success.
    """
    if follow.leader == name:
        raise ValueInvalid(f"{name} cannot follow itself")
    frame, failing = frame_of(follow.leader, follow.target), ""
    for number in count():
        yield follow.controller.due_ns(number)
        step, turtle = simulation.step, simulation.world.turtles.get(name)
        if turtle is None:
            continue
        try:
            if follow.delay_ns:  # the turtle itself is taken to stand at its last pose (tf2's lookup across time)
                then_ns = step.t_ns - follow.delay_ns
                x, y, *_ = simulation.buffer.lookup_across(name, None, frame, then_ns, WORLD).components
            else:
                x, y, *_ = simulation.buffer.lookup(name, frame).components
        except LookupFailed as error:
            if type(error).__name__ != failing:
                failing = type(error).__name__
                step.log.append(f"Could not transform {name} to {frame}: {error}")
            continue
        failing = ""
        try:
            twist = follow.controller.command(x, y)
        except ValueInvalid as error:
            raise ValueInvalid(f"{name}: {error}; give smaller gains, or limits") from None
        turtle.command(twist)
        leader, state = simulation.states.get(follow.leader), simulation.states[name]
        step.commands.append(IssuedCommand(step.t_ns, name, twist, math.sqrt(x * x + y * y), leader, state))


class RunSummary:
    """Summarise the steps of a scene; memory does not grow.

    reach: the distance in metres at which a follower has reached its target.
    """

    def __init__(self, scene: Scene, reach: float = 0.5) -> None:
        """Create the summary of a run that has not begun."""
        self.reach = reach
        self.t_ns: int | None = None  # of the last step
        self.walls: Counter[str] = Counter()
        self.distances: dict[str, float] = {}
        self.reached_ns: dict[str, int] = {}
        self._follows = scene.followers

    def watch(self, step: SimulationStep) -> None:
        """Add a step."""
        self.t_ns = step.t_ns
        self.walls.update(hit.turtle for hit in step.walls)
        for name, follow in self._follows.items():
            if name in step.states and follow.leader in step.states:
                own, leader, (x, y) = step.states[name], step.states[follow.leader], offset(follow.target, step.t_ns)
                cosine, sine = math.cos(leader.theta), math.sin(leader.theta)
                goal = leader.x + cosine * x - sine * y, leader.y + sine * x + cosine * y
                self.distances[name] = distance = math.hypot(goal[0] - own.x, goal[1] - own.y)
                if distance <= self.reach:
                    self.reached_ns.setdefault(name, step.t_ns)
            elif step.is_tick:  # one of them has left the world
                self.distances.pop(name, None)

    def lines(self) -> Iterator[str]:
        """Yield the summary: one line per follower, then the walls; names are escaped for a terminal."""
        if self.t_ns is None:
            yield "ended before the first step"
            return
        near = f"within {self.reach:g} m"
        for name, follow in self._follows.items():
            target = follow.leader if follow.target == "leader" else f"the {follow.target} of {follow.leader}"
            soon = f"{near} after {seconds(self.reached_ns[name])} s" if name in self.reached_ns else f"never {near}"
            distance = f"not in the world together with {follow.leader}"
            if name in self.distances:
                distance = f"final distance to {target} {self.distances[name]:.4f} m"
            yield printable(f"{name}: {distance}; {soon}")
        hits = ", ".join(f"{printable(name)} {count}" for name, count in sorted(self.walls.items()))
        yield f"{seconds(self.t_ns)} s simulated; wall hits: {self.walls.total()}{f' ({hits})' * bool(hits)}"


def event_log(say: Callable[[str], None]) -> Watch:
    """Return a function that reports the messages of turtlesim and the followers in a step; a wall once per contact."""
    at_wall: set[str] = set()

    def watch(step: SimulationStep) -> None:
        nonlocal at_wall
        new = (str(hit) for hit in step.walls if hit.turtle not in at_wall)
        for line in (*step.log, *new):
            say(f"{step.t_ns / BILLION:.3f} s: {line}")
        if step.is_tick:
            at_wall = {hit.turtle for hit in step.walls}

    return watch


FORMS = ("text", "yaml", "json", "csv")
EMITS = ("commands", "poses", "tf")
# names of columns in text, whose lines must fit a terminal
SHORT = {
    "linear_x": "linear", "angular_z": "turning", "distance": "away",
    "leader_x": "lead_x", "leader_y": "lead_y", "leader_theta": "lead_th",
    "linear_velocity": "linear", "angular_velocity": "turning",
}  # fmt: skip


def step_writer(
    emit: str, style: Style, *, leaders: bool = False, labelled: bool = False
) -> Callable[[SimulationStep], Iterator[str]]:
    """Return a function that yields the records of a step as text, the first after a header if the format has one.

    emit: one of EMITS; style.format: one of FORMS.  leaders: the commands of leaders too, not only of followers.
    labelled: name the turtle in a comment of a YAML message.
    """
    digits = 3 if style.precision is None else style.precision
    is_headed = style.format not in ("text", "csv")

    def write(step: SimulationStep) -> Iterator[str]:
        nonlocal is_headed
        for cells, message, labels in _emitted(step, emit, style, leaders=leaders):
            if not is_headed:
                is_headed = True
                names = {name: SHORT.get(name, name) for name in cells}
                yield row(cells, style) if style.format == "csv" else _aligned(names)
            match style.format:
                case "yaml":
                    head = f"# {printable(labels['turtle'])} at {labels['t']} s\n" if labelled and labels else ""
                    yield head + message_text(message, style)
                case "json":
                    yield f"{dump_json(labels | message, style.number)}\n"
                case "csv":
                    yield row(cells.values(), style)
                case _:
                    texts = {name: f"{cell:z.{digits}f}" if isinstance(cell, float) else printable(str(cell or "-"))
                             for name, cell in cells.items()}  # fmt: skip
                    yield _aligned(texts | {"t": f"{cells['t']:.3f}"})

    return write


def _aligned(texts: Record) -> str:
    """Format a line, each cell right-aligned in its column."""
    wide = ("turtle", "parent", "child")
    widths = {name: 7 if name in wide else max(6, len(SHORT.get(name, name))) for name in texts}
    return " ".join(f"{text:>{widths[name]}}" for name, text in texts.items()) + "\n"


def _emitted(
    step: SimulationStep, emit: str, style: Style, *, leaders: bool
) -> Iterator[tuple[Record, Record, Record]]:
    """Yield the events of a step: cells by column, for text and CSV; the ROS message; fields that the message lacks."""
    t = step.t_ns / BILLION
    if emit == "tf":  # geometry_msgs/TransformStamped
        for stamp_ns, parent, child, transform in step.broadcasts:
            numbers = zip(("x", "y", "z", "qx", "qy", "qz", "qw"), transform.components, strict=True)
            result = Result(Pose.of(transform.components, child, parent), {"stamp_ns": stamp_ns})
            yield {"t": t, "parent": parent, "child": child, **dict(numbers)}, transform_stamped(result, style), {}
    elif emit == "poses":  # turtlesim/Pose; turtles at time 0 have not moved yet
        for name, pose in step.poses.items() if step.t_ns else ():
            if not all(map(math.isfinite, pose)):
                raise ValueInvalid(f"{name} at {t:g} s: its speed does not fit the float32 of a pose message")
            labels = {"t": t, "turtle": name}
            yield labels | pose._asdict(), pose._asdict(), labels
    else:  # geometry_msgs/Twist
        for command in [*(step.led if leaders else ()), *step.commands]:
            ahead, turning, aside = command.twist
            labels = {"t": t, "turtle": command.turtle}
            seen = zip(("leader_x", "leader_y", "leader_theta"), command.leader or (None, None, None), strict=True)
            cells = {"linear_x": ahead, "angular_z": turning, "distance": command.distance, **dict(seen)}
            message = {"linear": {"x": ahead, "y": aside, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turning}}
            yield labels | cells | command.state._asdict(), message, labels
