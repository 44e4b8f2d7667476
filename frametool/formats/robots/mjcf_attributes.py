"""The attributes of MJCF elements, those of their default classes included, and the poses they write.

Five ways to write an orientation: quat (w first, any length), axisangle, euler, xyaxes, zaxis.  An element has one at
most, and its own puts aside that of its class.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import alternatives, shown
from frametool.geometry import axis_angle, floats, matrix, quaternion
from frametool.geometry.quaternion import cross, unit_vector
from frametool.geometry.trig import half_sincos, half_sincos_deg

if TYPE_CHECKING:
    from collections.abc import Mapping

    from frametool.documents.xml import Element, XmlFile, XmlNode
    from frametool.errors import FormatError
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Quaternion, Vector

    Attributes = Mapping[str, "Attribute"]

ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")
MAIN = "main"
STRAIGHT = ("capsule", "cylinder", "box", "ellipsoid")  # sites that may be written from end to end
LEAST = 1e-14  # what MuJoCo takes for a vector without a direction
SAME_LINE = 1e-10  # what MuJoCo takes for a zaxis along z


class Attribute(NamedTuple):
    """The text of an attribute, and the element that has it."""

    text: str
    element: Element


def own_attributes(element: Element) -> dict[str, Attribute]:
    """Return the attributes of an element; those that are empty count as missing."""
    return {name: Attribute(text, element) for name, text in element.attributes.items() if text.strip()}


def over(inner: Attributes, outer: Attributes) -> dict[str, Attribute]:
    """Return the attributes of an element on top of those of its class: one orientation puts all others aside."""
    turned = any(name in inner for name in ORIENTATIONS)
    kept = {name: each for name, each in outer.items() if not (turned and name in ORIENTATIONS)}
    return {**kept, **inner}


class Classes:
    """The default classes of a model: class -> kind of element -> attributes; nested ones have those around them too.

    A class may be used before it is defined.
    """

    def __init__(self, root: XmlNode, xml: XmlFile) -> None:
        """Read all sections of defaults; raises FormatError."""
        self.xml = xml
        self.classes: dict[str, dict[str, Attributes]] = {MAIN: {}}
        for section in root.all("default"):
            name = section.attribute("class") or MAIN
            if name != MAIN:
                message = f"the outermost default class is called main, found {shown(name)}"
                raise xml.error(section.element, message, "class")
            self._take(section, MAIN)

    def _take(self, section: XmlNode, name: str) -> None:
        """Read one section, then those in it, each from a copy; a stack, for they may be deep."""
        pending = [(section, name)]
        while pending:
            node, name = pending.pop()
            mine = self.classes[name]
            for child in node.children:
                if child.tag != "default":
                    mine[child.tag] = over(own_attributes(child.element), mine.get(child.tag, {}))
            for child in node.all("default"):
                inner = child.attribute("class")
                if not inner or inner in self.classes:
                    said = f"default class {shown(inner)} twice" if inner else "a <default> without class"
                    raise self.xml.error(child.element, said, "class" if inner else "")
                self.classes[inner] = dict(mine)
                pending.append((child, inner))

    def attributes(self, element: Element, around: str) -> dict[str, Attribute]:
        """Return the attributes of an element; `around` is the class that the bodies around it give it, if any."""
        own = own_attributes(element)
        name = own["class"].text if "class" in own else around or MAIN
        self.check(name, element, "class")
        return over(own, self.classes[name].get(element.tag, {}))

    def check(self, name: str, element: Element, attribute: str) -> None:
        """Raise FormatError for a class that is nowhere defined."""
        if name not in self.classes:
            message = f"no default class {shown(name)}{alternatives(name, self.classes, 'classes')}"
            raise self.xml.error(element, message, attribute)


class PoseReader:
    """Reads numbers, angles and poses as the compiler section of a model says."""

    def __init__(self, root: XmlNode, xml: XmlFile) -> None:
        """Read the compiler sections, wherever they stand: the last word on each setting counts; raises FormatError."""
        self.xml = xml
        said: dict[str, Attribute] = {}
        for section in root.all("compiler"):
            said.update(own_attributes(section.element))
        self.degrees = self.word(said, "angle", "degree", ("degree", "radian")) == "degree"
        self.limits_apply = self.word(said, "autolimits", "true", ("true", "false")) == "true"
        self.aligns_free = self.word(said, "alignfree", "false", ("true", "false")) == "true"
        self.eulerseq = said["eulerseq"].text if "eulerseq" in said else "xyz"
        if len(self.eulerseq) != len("xyz") or not set(self.eulerseq) <= set("xyzXYZ"):
            message = f"eulerseq {shown(self.eulerseq)}; expected three of xyz (moving axes) and XYZ (fixed axes)"
            raise self.error(said["eulerseq"], "eulerseq", message)
        if self.word(said, "coordinate", "local", ("local", "global")) == "global":
            message = "coordinate=global; MuJoCo reads it no more: save the model with MuJoCo 2.3.3 first"
            raise self.error(said["coordinate"], "coordinate", message)

    def word(self, attributes: Attributes, name: str, default: str, words: tuple[str, ...]) -> str:
        """Return an attribute that is one of some words."""
        if name not in attributes:
            return default
        text = attributes[name].text.strip()
        if text not in words:
            raise self.error(attributes[name], name, f"{name} {shown(text)}; expected {', '.join(words)}")
        return text

    def error(self, attribute: Attribute, name: str, message: str) -> FormatError:
        """Make the error for an attribute, in the element that has it: maybe a default."""
        return self.xml.error(attribute.element, message, name)

    def numbers(self, attributes: Attributes, name: str, count: int, default: tuple[float, ...]) -> tuple[float, ...]:
        """Read an attribute as so many numbers; without it the default."""
        if name not in attributes:
            return default
        text, element = attributes[name]
        return self.xml.numbers_in(text, element, name, count)

    def direction(self, attributes: Attributes, name: str, default: Vector) -> Vector:
        """Read a vector of any length but zero, as a unit one."""
        return self._unit(attributes, name, self.numbers(attributes, name, 3, default))

    def _unit(self, attributes: Attributes, name: str, vector: tuple[float, ...]) -> Vector:
        x, y, z = vector
        if quaternion.magnitude(x, y, z, floats) < LEAST:
            message = f"{name}: {x:g} {y:g} {z:g} has no direction"
            raise self.error(attributes[name], name, message)
        return unit_vector(x, y, z, floats)

    def pose(self, attributes: Attributes) -> Rigid:
        """Read position and orientation."""
        x, y, z = self.numbers(attributes, "pos", 3, (0.0, 0.0, 0.0))
        return (x, y, z, *self._orientation(attributes))

    def pose_of_site(self, attributes: Attributes) -> Rigid:
        """Read the pose of a site, which may be written from end to end: its z axis looks to the first end."""
        if "fromto" not in attributes:
            return self.pose(attributes)
        fromto = attributes["fromto"]
        if "pos" in attributes:
            raise self.error(fromto, "fromto", "pos and fromto in one site; keep one")
        self.word({"type": Attribute("sphere", fromto.element), **attributes}, "type", "", STRAIGHT)
        ax, ay, az, bx, by, bz = self.numbers(attributes, "fromto", 6, ())
        along = self._unit(attributes, "fromto", (ax - bx, ay - by, az - bz))
        return 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz), *_turning_z(*along)

    def _orientation(self, attributes: Attributes) -> Quaternion:
        given = [name for name in ORIENTATIONS if name in attributes]
        if len(given) > 1:
            message = f"{' and '.join(given)} in one element; keep one"
            raise self.error(attributes[given[1]], given[1], message)
        return getattr(self, f"_{given[0]}")(attributes) if given else (0.0, 0.0, 0.0, 1.0)

    def _quat(self, attributes: Attributes) -> Quaternion:
        """Read a quaternion, w first, of any length but zero."""
        w, x, y, z = self.numbers(attributes, "quat", 4, ())
        if w == x == y == z == 0.0:
            raise self.error(attributes["quat"], "quat", "quat: 0 0 0 0 has no direction")
        if abs(w * w + x * x + y * y + z * z - 1.0) <= quaternion.UNIT:
            return x, y, z, w
        return quaternion.normalized(x, y, z, w, floats)

    def _axisangle(self, attributes: Attributes) -> Quaternion:
        x, y, z, angle = self.numbers(attributes, "axisangle", 4, ())
        axis = self._unit(attributes, "axisangle", (x, y, z))
        return axis_angle.to_quaternion(*axis, angle, floats, degrees=self.degrees)

    def _euler(self, attributes: Attributes) -> Quaternion:
        """Multiply the turns about the axes of eulerseq: a moving axis on the right, a fixed one on the left."""
        turned = (0.0, 0.0, 0.0, 1.0)
        for letter, angle in zip(self.eulerseq, self.numbers(attributes, "euler", 3, ()), strict=True):
            sine, cosine = half_sincos_deg(angle, floats) if self.degrees else half_sincos(angle, floats)
            x, y, z = (sine if axis == letter.lower() else 0.0 for axis in "xyz")
            turn = x, y, z, cosine
            turned = quaternion.compose(*turned, *turn) if letter.islower() else quaternion.compose(*turn, *turned)
        return turned

    def _xyaxes(self, attributes: Attributes) -> Quaternion:
        """Read x and y axes: x counts, of y what is at right angles to it."""
        numbers = self.numbers(attributes, "xyaxes", 6, ())
        x = self._unit(attributes, "xyaxes", numbers[:3])
        along = sum(a * b for a, b in zip(x, numbers[3:], strict=True))
        y = self._unit(attributes, "xyaxes", tuple(b - along * a for a, b in zip(x, numbers[3:], strict=True)))
        z = cross(*x, *y)
        return matrix.to_quaternion(x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2], floats)

    def _zaxis(self, attributes: Attributes) -> Quaternion:
        return _turning_z(*self.direction(attributes, "zaxis", (0.0, 0.0, 1.0)))


def _turning_z(x: float, y: float, z: float) -> Quaternion:
    """Return the shortest turn of the z axis into a direction; about x where that is -z, as MuJoCo does."""
    if z < 0.0 and quaternion.length(x, y, 0.0, floats) < SAME_LINE:
        return 1.0, 0.0, 0.0, 0.0
    return quaternion.between(0.0, 0.0, 1.0, x, y, z, floats)
