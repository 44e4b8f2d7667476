"""turtlesim's world: turtles by name, its clock's ticks, its services with their refusals."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, listing, printable, shown
from frametool.sim.turtle import CENTRE, Turtle, check_single, single

if TYPE_CHECKING:
    from frametool.sim.turtle import TurtleState

VARIANTS = ("ros1", "ros2")
FAR = 1e9  # metres, from where on a place is written with an exponent
# service -> its arguments and what they are when left out (None: must be given)
SERVICES: dict[str, dict[str, float | str | None]] = {
    "spawn": {"x": None, "y": None, "theta": 0.0, "name": ""},
    "kill": {"name": None},
    "reset": {},
    "clear": {},
    "teleport_absolute": {"turtle": None, "x": None, "y": None, "theta": 0.0},
    "teleport_relative": {"turtle": None, "linear": 0.0, "angular": 0.0},
    "rotate_absolute": {"turtle": None, "theta": None},
    "set_pen": {"turtle": None, "r": 0.0, "g": 0.0, "b": 0.0, "width": 0.0, "off": 0.0},
}


class ServiceRefused(ValueInvalid):
    """Report a service call that turtlesim refuses, in its own words."""


class WallHit(NamedTuple):
    """A tick at which a turtle was put back to the wall; `place` is where it would have been, y up."""

    t_ns: int
    turtle: str
    place: TurtleState

    def __str__(self) -> str:
        """Warn as turtlesim does, with y up."""
        x, y = (f"{each:f}" if abs(each) < FAR else f"{each:g}" for each in self.place[:2])
        return f"{printable(self.turtle)}: Oh no! I hit the wall! (Clamping from [x={x}, y={y}])"


class World:
    """The turtles by name, moved one after another in the order of their names at every tick.

        world = World()
        world.spawn(4.0, 2.0, 0.0, "turtle2")
        world.tick(16_000_000)

    variant: "ros1" or "ros2"; they differ in wording, in `rotate_absolute`, and in `holonomic`, which ROS 1 always is.
    """

    def __init__(self, variant: str = "ros1", *, holonomic: bool = False) -> None:
        """Create an empty world; `reset` gives it turtle1, as the node does when it starts."""
        if variant not in VARIANTS:
            raise ValueInvalid(f"no turtlesim {shown(variant)}; there are {', '.join(VARIANTS)}")
        self.variant = variant
        self.holonomic = holonomic or variant == "ros1"
        self.clears = 0  # how often the drawing was cleared
        self._turtles: dict[str, Turtle] = {}
        self._in_order = True
        self._count = 0

    @property
    def turtles(self) -> dict[str, Turtle]:
        """Return the turtles in the order of their names; sorted once after any number of spawns."""
        if not self._in_order:
            self._turtles = dict(sorted(self._turtles.items()))
            self._in_order = True
        return self._turtles

    def spawn(self, x: float = CENTRE, y: float = CENTRE, theta: float = 0.0, name: str = "") -> str:
        """Create a turtle; without a name it gets the next free turtleN. Returns its name.

        Raises ServiceRefused when the name is taken.
        """
        if name in self._turtles:
            article = "turtled" if self.variant == "ros1" else "turtle"
            raise ServiceRefused(f"A {article} named [{name}] already exists")
        while not name or name in self._turtles:
            self._count += 1
            name = f"turtle{self._count}"
        self._turtles[name] = Turtle(x, y, theta, name=name, holonomic=self.holonomic)
        self._in_order = False
        return name

    def kill(self, name: str) -> None:
        """Remove a turtle.

        Raises ServiceRefused when there is none of that name.
        """
        if name not in self._turtles:
            raise ServiceRefused(f"Tried to kill turtle [{name}], which does not exist")
        del self._turtles[name]

    def reset(self) -> None:
        """Remove all turtles, restart their numbering, clear the drawing, and spawn turtle1 in the centre."""
        self._turtles.clear()
        self._count = 0
        self.clear()
        self.spawn()

    def clear(self) -> None:
        """Clear the drawing."""
        self.clears += 1

    def turtle(self, name: str) -> Turtle:
        """Return a turtle by name.

        Raises ServiceRefused when there is none: its services went with it.
        """
        if name not in self._turtles:
            raise ServiceRefused(f"no turtle [{name}] to call; turtles: {listing(self._turtles) or 'none'}")
        return self._turtles[name]

    def call(self, service: str, **arguments: float | str) -> str:
        """Call a service of the table SERVICES by name; what is left out takes the table's value.

        Returns what turtlesim logs of it, or "".
        Raises ServiceRefused; ValueInvalid for an unknown service or a wrong argument.
        """
        given = complete(service, arguments)
        if self.variant == "ros1" and service == "rotate_absolute":
            raise ServiceRefused("rotate_absolute is an action of the ROS 2 turtlesim; add turtlesim: ros2")
        receiver = self.turtle(str(given.pop("turtle"))) if "turtle" in given else self
        answer = getattr(receiver, service)(**given)
        if service == "spawn":
            return f"Spawning turtle [{answer}] at " + ", ".join(
                f"{name}=[{single(float(given[name])):f}]" for name in ("x", "y", "theta")
            )
        return {"reset": "Resetting turtlesim.", "clear": "Clearing turtlesim."}.get(service, "")

    def tick(self, now_ns: int) -> list[WallHit]:
        """Move every turtle by one tick; returns those that hit a wall."""
        outside = ((name, turtle.update(now_ns)) for name, turtle in self.turtles.items())
        return [WallHit(now_ns, name, place) for name, place in outside if place is not None]


def complete(service: str, arguments: dict[str, float | str]) -> dict[str, float | str]:
    """Return a service's arguments with the defaults of the table.

    Raises ValueInvalid for a service or argument that does not exist, or one that is missing or no finite float32.
    """
    if service not in SERVICES:
        raise ValueInvalid(f"no service {shown(service)}; services: {', '.join(SERVICES)}")
    expected = SERVICES[service]
    if unknown := [name for name in arguments if name not in expected]:
        raise ValueInvalid(f"{service} has no {shown(unknown[0])}; expected {', '.join(expected) or 'nothing'}")
    given = {name: arguments.get(name, default) for name, default in expected.items()}
    if missing := [name for name, value in given.items() if value is None]:
        raise ValueInvalid(f"{service} needs {', '.join(missing)}")
    check_single(**{name: value for name, value in given.items() if isinstance(value, float)})
    return {name: value for name, value in given.items() if value is not None}
