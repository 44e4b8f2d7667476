"""Derivations of the operations on poses and records: from the input as written to the result of the command.

The lines are those of `sheets.txt`; this module passes the numbers in.  Every derivation ends with the command's own
result, after a check that it leads to it.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import reduce
from itertools import pairwise
from operator import itemgetter
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import FrametoolError, ValueInvalid, printable, shown
from frametool.explain.render import Explanation
from frametool.explain.run import ENTRIES, Row, Sheet
from frametool.frames.lookups import Frames
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry import euler, floats, quaternion
from frametool.geometry.rigid import IDENTITY
from frametool.grammar import pose_algebra
from frametool.grammar.pose import RELATIVE, Pose
from frametool.grammar.pose_algebra import Lookups, looked_up_across
from frametool.grammar.result import Result, pose_numbers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.explain.run import Values
    from frametool.frames.track import Track
    from frametool.geometry import Rigid
    from frametool.geometry.representations import Notation
    from frametool.grammar.readers import Quaternion, Vector
    from frametool.grammar.result import Style

    Edge = tuple[str, str, Rigid]  # parent, child, parent_from_child

ANGLES, ROLL_PITCH_YAW, ROTATION = "a1 a2 a3", "roll pitch yaw", " ".join(ENTRIES)
BLOCKS = {  # names of a representation's numbers in its two sheets: to the quaternion, and from it
    "quaternion": ("x y z w", "x y z w"),
    "xyzw": ("x y z w", "x y z w"),
    "wxyz": ("w x y z", "w x y z"),
    "rpy": (ROLL_PITCH_YAW, ROLL_PITCH_YAW),
    "euler": (ANGLES, ANGLES),
    "axis_angle": ("ax ay az angle", "vx vy vz angle"),
    "rotvec": ("rx ry rz", "rx ry rz"),
    "matrix": (ROTATION, ROTATION),
    "mrp": ("px py pz", "px py pz"),
    "six_d": ("ax ay az bx by bz", "r11 r21 r31 r12 r22 r32"),
    "rpy_unreal": (ROLL_PITCH_YAW, ROLL_PITCH_YAW),
    "euler_unity": ("a2 a3 a1", "a2 a3 a1"),
}
AXES_OF = {"rpy": "sxyz", "rpy_unreal": "sxyz", "euler_unity": "szxy"}  # Euler angles under another name
PLAIN = ("quaternion", "xyzw")


def names_of(notation: Notation, found: int, *, degrees: bool) -> list[str]:
    """Return the names of a representation's numbers; raises ValueInvalid if it has no sheets.

    found: 0 for the sheet to the quaternion, 1 for the sheet from it
    """
    representation = notation.representation
    if representation.name not in BLOCKS:
        raise ValueInvalid(f"there is no derivation of {shown(representation.name)}; derived are {', '.join(BLOCKS)}")
    names = enumerate(BLOCKS[representation.name][found].split())
    return [f"{name}_deg" if degrees and at in representation.angles else name for at, name in names]


def _words(notation: Notation, values: Values, *, degrees: bool) -> dict[str, str]:
    """Return the words for the sheets of a representation; add the properties of its Euler axes to the values."""
    words = {"deg": "_deg" * degrees, "unit": "deg" if degrees else "rad"}
    if (name := notation.representation.name) not in ("euler", *AXES_OF):
        return words
    axes = AXES_OF.get(name) or notation.bound_axes()
    i, j, k, parity, symmetric, fixed = euler.AXES[axes]
    values |= {"odd": float(parity < 0.0), "symmetric": float(symmetric), "fixed": float(fixed)}
    first, third = "31" if fixed else "13"
    words |= {"axes": axes, "turns": ", then ".join(axes[1:]), "i": "xyz"[i], "j": "xyz"[j], "k": "xyz"[k]}
    return words | {
        "first": first, "third": third, "A": axes[int(first)], "B": axes[2], "C": axes[int(third)],
    }  # fmt: skip


def to_quaternion(sheet: Sheet, numbers: Sequence[float], notation: Notation, *, degrees: bool) -> Quaternion:
    """Add the derivation of the quaternion from the numbers of a representation; return the quaternion."""
    values: Values = dict(zip(names_of(notation, 0, degrees=degrees), numbers, strict=True))
    words = _words(notation, values, degrees=degrees)
    sheet.play(f"{notation.representation.name} to", values, **words)
    return values["x"], values["y"], values["z"], values["w"]


def from_quaternion(
    sheet: Sheet, q: Quaternion, notation: Notation, *, degrees: bool, keep_sign: bool
) -> Sequence[float]:
    """Add the derivation of a representation from the quaternion; return its numbers."""
    names, (x, y, z, w) = names_of(notation, 1, degrees=degrees), q
    values = named("", q) | {"degrees": float(degrees), "negative": float((w or x or y or z) < 0.0)}
    values["signed"] = 0.0 if keep_sign else values["negative"]
    words, name = _words(notation, values, degrees=degrees), notation.representation.name
    if "axes" in words:
        values["locked"] = float(euler.locked(*q, words["axes"]))
        shown_as = ANGLES if name.startswith("euler") else ROLL_PITCH_YAW
        words |= dict(zip(ANGLES.split(), shown_as.split(), strict=True))
    sheet.play(f"{name} from", values, **words)
    return [values[each] for each in names]


def named(prefix: str, numbers: Sequence[float]) -> Values:
    """Return the numbers of a vector or a quaternion by name: the prefix with x, y, z, w."""
    return {f"{prefix}{name}": number for name, number in zip("xyzw", numbers, strict=False)}


def posed(letter: str, pose: Rigid) -> Values:
    """Return the numbers of a pose by name: position t and the letter, rotation by the letter."""
    return named(f"t{letter}", pose[:3]) | named(letter, pose[3:])


def pose_of(values: Values, letter: str = "") -> Rigid:
    """Return a pose by the names of its numbers: position t, rotation by a letter."""
    tx, ty, tz = (values[f"t{each}"] for each in "xyz")
    x, y, z, w = (values[letter + each] for each in "xyzw")
    return tx, ty, tz, x, y, z, w


def product(sheet: Sheet, a: Rigid, b: Rigid, frames: tuple[str, str, str]) -> Rigid:
    """Add the product of two poses and return it; frames: those of a_from_b and b_from_c, in this order."""
    words = dict(zip(("first", "middle", "last"), frames, strict=True))
    return pose_of(sheet.play("compose", posed("a", a) | posed("b", b), **words), "c")


def inverse(sheet: Sheet, pose: Rigid, target: str, source: str) -> Rigid:
    """Add the inverse of target_from_source and return it."""
    return pose_of(sheet.play("inverse", posed("", pose), target=target, source=source))


def between(sheet: Sheet, a: Rigid, b: Rigid, *, fraction: float) -> Rigid:
    """Add the interpolation of two poses, linear and by slerp, and return the result."""
    sheet.stretch = max(sheet.stretch, abs(fraction))
    line = sheet.play("line", {"f": fraction} | named("a", a[:3]) | named("b", b[:3]))
    arc = sheet.play("slerp", {"f": fraction} | named("a", a[3:]) | named("b", b[3:]))
    return pose_of(line | arc, "q")


def moved(sheet: Sheet, kind: str, pose: Rigid, numbers: Sequence[float], target: str, source: str) -> Vector:
    """Add the transform of a point or a vector to another frame, and return the result."""
    values = named("t", pose[:3]) | named("q", pose[3:]) | named(kind[0], numbers)
    sheet.play(kind, values, target=target, source=source)
    x, y, z = (values[kind[0] + each] for each in "xyz")
    return x, y, z


class OtherAxes(NamedTuple):
    """A change of axes.

    world, axes: name and rotation of the change on the left and on the right of the pose, None if unchanged
    mirrors: True if it is a reflection
    """

    world: tuple[str, Quaternion] | None = None
    axes: tuple[str, Quaternion] | None = None
    mirrors: bool = False


class WrittenPose(NamedTuple):
    """A pose as it was written.

    pose: its value, as every command reads it
    notation: representation of its rotation; None without a rotation
    numbers: of the rotation, in column order; degrees: True if its angles are degrees
    position: x, y, z in metres as written, before `inverse: true`
    inverse: True if the inverse was written
    """

    pose: Pose
    notation: Notation | None = None
    numbers: Sequence[float] = ()
    degrees: bool = False
    position: Sequence[float] = (0.0, 0.0, 0.0)
    inverse: bool = False

    def quaternion(self, sheet: Sheet) -> Quaternion:
        """Add the derivation of the quaternion from the numbers as written."""
        if self.notation is None:
            sheet.play("no rotation", {})
            return IDENTITY[3:]
        return to_quaternion(sheet, self.numbers, self.notation, degrees=self.degrees)

    def components(self, sheet: Sheet, target: str, source: str) -> Rigid:
        """Add the derivation of target_from_source from the numbers as written."""
        name = self.notation.representation.name if self.notation else ""
        if not name or (name in PLAIN and abs(sum(x * x for x in self.numbers) - 1.0) <= 1e-12):
            qx, qy, qz, qw = self.numbers or IDENTITY[3:]
        else:
            with sheet.about(self._named(target, source)):
                qx, qy, qz, qw = self.quaternion(sheet)
        x, y, z = self.position
        found: Rigid = (x, y, z, qx, qy, qz, qw)
        return inverse(sheet, found, source, target) if self.inverse else found

    def _named(self, target: str, source: str) -> str:
        return f"{source}_from_{target}" if self.inverse else f"{target}_from_{source}"

    def turned(self) -> WrittenPose:
        """Return the inverse: the written numbers are unchanged, the pose and its frames are inverted."""
        return self._replace(pose=pose_algebra.inverse(self.pose), inverse=not self.inverse)

    def say(self, sheet: Sheet, target: str, source: str) -> None:
        """List the pose of target_from_source as written."""
        sheet.reached(self.position)
        line = f"{self._named(target, source)}: xyz {sheet.numbers(self.position)} m"
        if self.notation is not None:
            name, axes = self.notation.representation.name, self.notation.axes
            if self.notation.representation.angles:
                name += ("_deg" if self.degrees else "_rad") + (f":{axes}" if axes else "")
            line += f", {'xyzw' if name == 'quaternion' else name} {sheet.numbers(self.numbers)}"
        sheet.say(line + (f"; its inverse is {target}_from_{source}" if self.inverse else ""))


def frames_of(poses: Sequence[Pose]) -> list[str]:
    """Return the frames along a chain of poses, each by the name in its neighbours, else by a letter."""
    taken = {name for pose in poses for name in (pose.name, pose.parent) if name}
    letters = (each for each in (*ascii_lowercase, *(f"f{n}" for n in range(len(poses) + 2))) if each not in taken)
    sides = zip((None, *(pose.name for pose in poses)), (*(pose.parent for pose in poses), None), strict=True)
    return [printable(before or after or next(letters)) for before, after in sides]


def chain(sheet: Sheet, frames: Frames, target: str, source: str, at_ns: int | None) -> Rigid:
    """Derive target_from_source at a time, None for the latest; the lookup itself has succeeded."""
    words = {"target": printable(target), "source": printable(source)}
    if target == source:
        sheet.play("same frame", {}, **words)
        return IDENTITY
    at_ns = frames.latest(target, source) if at_ns is None else at_ns
    path = frames.between(target, source, at_ns)
    down, up = path.to_target, path.to_source
    tracks = dict(zip(path.edges, frames.way(target, source, at_ns), strict=True))
    parents = {child: str(frames.parent(child, at_ns)) for child in tracks}
    left, right = (" @ ".join(_named(parents[child], child) for child in branch) for branch in (down, up))
    words["formula"] = " @ ".join(filter(None, [left and f"({left})^-1", right]))
    words |= {"top": printable(path.top), "path": " <- ".join(map(printable, path.frames))}
    sheet.play("way", {"down": float(len(down)), "up": float(len(up))}, **words)
    moving = [track for child in (*down, *up[::-1]) if not (track := tracks[child]).is_static]
    if moving and at_ns is not None:
        ends = ", ".join(f"{printable(track.child)} {format_stamp(track.last_ns)}" for track in moving)
        values = {"latest": float(at_ns == min(track.last_ns for track in moving)), "count": float(len(moving))}
        sheet.play("way of moving edges", values, at=format_stamp(at_ns), ends=ends)
    for child in (*down, *up):
        if (track := tracks[child]).is_static:
            sheet.reached(track.components[:3])
            sheet.say(f"{_named(track.parent, child)}: {_line(sheet, track.components)}")
    edges = {child: _edge(sheet, tracks[child], at_ns or 0) for child in (*down, *up[::-1])}
    return _joined(sheet, [edges[each] for each in down], [edges[each] for each in up])


def _line(sheet: Sheet, pose: Rigid) -> str:
    return f"xyz {sheet.numbers(pose[:3])} m, xyzw {sheet.numbers(pose[3:])}"


def _named(parent: str, child: str) -> str:
    return f"{printable(parent)}_from_{printable(child)}"


def _edge(sheet: Sheet, track: Track, at_ns: int) -> Edge:
    """Return an edge at a time, and add its derivation if it moves.

    The time is between the last sample that is not after it (else the first sample) and the next sample, if any.
    """
    parent, child = printable(track.parent), printable(track.child)
    if track.is_static:
        return parent, child, track.components
    samples = list(track.walk())
    at = max(bisect_right(samples, at_ns, key=itemgetter(0)), 1)
    begin_ns, seen_in, a = samples[at - 1]
    end_ns, other, b = samples[at] if at < len(samples) else samples[at - 1]
    sheet.reached(a[:3])
    edge, is_between = _named(seen_in, track.child), end_ns != begin_ns != at_ns
    words = dict(zip(("begin", "end", "at"), map(format_stamp, (begin_ns, end_ns, at_ns)), strict=True))
    if not is_between or other != seen_in:
        changes = {"changes": float(is_between)}
        sheet.play("sample", changes, edge=edge, pose=_line(sheet, a), other=printable(other), **words)
        return printable(seen_in), child, a
    sheet.reached(b[:3])
    with sheet.about(edge):
        values = sheet.play(
            "two samples", spans(begin_ns, end_ns, at_ns), a=_line(sheet, a), b=_line(sheet, b), **words
        )
        return printable(seen_in), child, between(sheet, a, b, fraction=values["f"])


def spans(begin_ns: int, end_ns: int, at_ns: int) -> Values:
    """Return the time after the first of two samples, and the interval between them, in seconds."""
    return {"past": (at_ns - begin_ns) / BILLION, "gap": (end_ns - begin_ns) / BILLION}


def _joined(sheet: Sheet, to_target: list[Edge], to_source: list[Edge]) -> Rigid:
    """Multiply both branches, topmost edges first, and join them; an empty branch to the target is not inverted."""
    products = []
    for edges in filter(None, (to_target, to_source)):
        top, here, pose = edges[0]
        for _, child, edge in edges[1:]:
            pose, here = product(sheet, pose, edge, (top, here, child)), child
        products.append((top, here, pose))
    top, end, pose = products[0]
    if to_target:
        pose = inverse(sheet, pose, top, end)
    if len(products) > 1:
        pose = product(sheet, pose, products[1][2], (end, top, products[1][1]))
    return pose


METRES, RADIANS, DEGREES = "m", "rad", "deg"
CLOSE = 1e-12  # radians; and of positions, relative to the largest of them or a metre
REPORT = "this is a mistake in frametool, please report it"
ANGLE_UNITS = {"distance": METRES, "angle": RADIANS, "angle_deg": DEGREES}


class DerivationWrong(FrametoolError):
    """A derivation that does not lead to the result: a bug, never to be printed."""


def explained(style: Style, title: str, write: Callable[[Sheet], None]) -> Explanation:
    """Return the derivation that `write` adds to a sheet.

    Rounding errors are shown as 0, unless that leads too far from the result, as with nearly singular numbers.
    style: its precision counts significant digits here, None for all
    """
    for clean in dict.fromkeys((style.precision is not None, False)):
        sheet = Sheet(style.precision, clean=clean)
        try:
            write(sheet)
            break
        except DerivationWrong:
            if not clean:
                raise
    return Explanation(title, sheet.items)


def derived_pose(style: Style, title: str, own: Result, way: Callable[[Sheet], Rigid]) -> Explanation:
    """Return the derivation of a pose and of its representations.

    own: the command's result; way: adds the derivation of the pose to a sheet and returns it
    """
    return explained(style, title, lambda sheet: end_with_pose(sheet, way(sheet), own, style))


def end_with_pose(sheet: Sheet, derived: Rigid, own: Result, style: Style) -> None:
    """Add the derivation of the requested representations, check them, and end with the command's own result.

    Numbers are compared as rotations, also near gimbal lock.  Raises DerivationWrong.
    """
    pose = own.pose
    rows: list[Row] = []
    if pose.position is not None:
        check_vector(sheet, derived[:3], pose.position)
        if not any(each.representation.whole for each in style.notations):
            rows.append(Row("xyz", "xyz", pose.position, METRES))
    target = quaternion.unit(*pose.components[3:], floats)
    for each in style.notations:
        degrees, whole, angles = each.in_degrees(style.degrees), each.representation.whole, each.representation.angles
        ends = from_quaternion(sheet, derived[3:], each, degrees=degrees, keep_sign=style.keep_sign)
        found = each.to_quaternion(tuple(ends), floats, degrees=degrees)
        off = quaternion.distance(*quaternion.normalized(*found, floats), *target, floats) if any(found) else math.inf
        if not off <= CLOSE * sheet.stretch:
            raise DerivationWrong(f"the derivation in {each.spec} is off by {off:.3g} rad from the result; {REPORT}")
        if whole and pose.position is not None:
            sheet.say("The 4x4 matrix of the pose: R on the left, the position as the fourth column, 0 0 0 1 below.")
        numbers = pose_numbers(pose, each, style)
        if whole is not None:  # a matrix, a row a line
            size = math.isqrt(len(numbers))
            lines = [(("",) * size, numbers[at : at + size], "") for at in range(0, len(numbers), size)]
        else:  # an axis and its angle are two lines
            cut = angles[0] if angles else len(numbers)
            angular = each.names[cut:], numbers[cut:], DEGREES if degrees else RADIANS
            lines = [part for part in ((each.names[:cut], numbers[:cut], ""), angular) if part[1]]
        rows += (Row(each.spec * (not at), *line) for at, line in enumerate(lines))
    rows += [Row(key, [""], [own.extras[key]], unit) for key, unit in ANGLE_UNITS.items() if key in own.extras]
    sheet.result(_named(pose.parent, pose.name) if pose.parent and pose.name else "", rows)


def check_vector(sheet: Sheet, derived: Sequence[float], own: Sequence[float]) -> None:
    """Compare positions or other vectors; raises DerivationWrong."""
    sheet.reached(own)
    off = max(abs(a - b) for a, b in zip(derived, own, strict=True))
    if not off <= CLOSE * sheet.reach * sheet.stretch:
        raise DerivationWrong(f"the derivation is off by {off:.3g} from the result; {REPORT}")


def convert(
    style: Style, pose: WrittenPose, *, own: Pose | None = None, change: OtherAxes | None = None
) -> Explanation:
    """Derive one pose or rotation in the requested notations.

    own: the command's result.  change: of its axes, on the left side of the pose, then on its right.
    """

    def way(sheet: Sheet) -> Rigid:
        sheet.reached(pose.position)
        x, y, z = pose.position
        found: Rigid = (x, y, z, *pose.quaternion(sheet))
        if pose.inverse:
            found = inverse(sheet, found, "child", "parent")
        if change is None:
            return found
        (world, left), (axes, right) = (side or ("", IDENTITY[3:]) for side in (change.world, change.axes))
        values = named("t", found[:3]) | named("q", found[3:]) | named("W", left) | named("B", right)
        values |= {"world": float(bool(world)), "axes": float(bool(axes)), "mirrors": float(change.mirrors)}
        return pose_of(sheet.play("other axes", values, world_axes=world, body_axes=axes), "q")

    begin = pose.notation.spec if pose.notation else "identity"
    title = f"{begin} to {', '.join(notation.spec for notation in style.notations)}"
    return derived_pose(style, title, Result(own or pose.pose), way)


def derived_from(sheet: Sheet, poses: Sequence[WrittenPose], labels: Sequence[tuple[str, str]]) -> list[Rigid]:
    """List the poses as written, and add the derivation of each; `labels` are its target and source."""
    sheet.heading("Given")
    for each, label in zip(poses, labels, strict=True):
        each.say(sheet, *label)
    return [each.components(sheet, *label) for each, label in zip(poses, labels, strict=True)]


def compose(style: Style, *poses: WrittenPose) -> Explanation:
    """Derive the product of poses."""
    if not poses:
        raise ValueInvalid("compose takes at least one pose")
    own = Result(reduce(pose_algebra.product, [each.pose for each in poses]))
    names = frames_of([each.pose for each in poses])
    labels = list(pairwise(names))

    def way(sheet: Sheet) -> Rigid:
        pose, *factors = derived_from(sheet, poses, labels)
        for factor, (middle, last) in zip(factors, labels[1:], strict=True):
            pose = product(sheet, pose, factor, (names[0], middle, last))
        return pose

    return derived_pose(style, f"{names[0]}_from_{names[-1]}", own, way)


def invert(style: Style, pose: WrittenPose) -> Explanation:
    """Derive the inverse of a pose."""
    own = Result(pose_algebra.inverse(pose.pose))
    target, source = frames_of([pose.pose])

    def way(sheet: Sheet) -> Rigid:
        return inverse(sheet, derived_from(sheet, [pose], [(target, source)])[0], target, source)

    return derived_pose(style, f"{source}_from_{target}", own, way)


def relative(style: Style, a: WrittenPose, b: WrittenPose) -> Explanation:
    """Derive the pose of B in A, with distance and angle."""
    own = pose_algebra.relative(a.pose, b.pose)
    frames, labels = _three_frames(a, b)

    def way(sheet: Sheet) -> Rigid:
        one, other = derived_from(sheet, [a, b], labels)
        words = dict(zip(("world", "first", "second"), frames, strict=True))
        turns = named("A", one[3:]) | named("B", other[3:])
        found = sheet.play("relative", named("a", one[:3]) | named("b", other[:3]) | turns, **words)
        pose = pose_of(found, "c")
        values = sheet.play("extent", posed("", pose), frame=frames[1])
        for name, key in zip(RELATIVE, ("d", "angle", "angle_deg"), strict=True):
            value = values[key]
            if abs(value - own.extras[name]) > 100.0 * CLOSE * sheet.reach:
                raise DerivationWrong(f"the derived {name} is {value!r}, not {own.extras[name]!r}; {REPORT}")
        return pose

    return derived_pose(style, f"{frames[1]}_from_{frames[2]}", own, way)


def interpolate(style: Style, a: WrittenPose, b: WrittenPose, fraction: float) -> Explanation:
    """Derive the pose at a fraction from A to B."""
    fraction = float(fraction)
    own = Result(pose_algebra.interpolated(a.pose, b.pose, fraction))
    frames, labels = _three_frames(a, b)
    title = f"{frames[1]} to {frames[2]} at {fraction!r}"
    return derived_pose(
        style, title, own, lambda sheet: between(sheet, *derived_from(sheet, [a, b], labels), fraction=fraction)
    )


def _three_frames(a: WrittenPose, b: WrittenPose) -> tuple[tuple[str, str, str], list[tuple[str, str]]]:
    """Return the common reference frame of two poses and their bodies, and the two labels of the poses."""
    names = a.pose.parent or b.pose.parent or "world", a.pose.name or "A", b.pose.name or "B"
    world, first, second = map(printable, names)
    return (world, first, second), [(world, first), (world, second)]


def lookup(
    style: Style, tree: Frames, target: str, source: str, *, at_ns: int | None = None,
    source_at_ns: int | None = None, fixed: str | None = None,
) -> Explanation:  # fmt: skip
    """Derive the pose of one frame of a tree in another; with `fixed` across two times."""
    if not isinstance(tree, Frames):
        raise ValueInvalid(f"expected a tree as frametool.load returns it, found {shown(tree)}")
    if fixed is None:
        own = Lookups(tree, carried=False).result(target, source, at_ns)
    else:
        own = looked_up_across(tree, target, at_ns, source, source_at_ns, fixed)

    def way(sheet: Sheet) -> Rigid:
        if fixed is None:
            return chain(sheet, tree, target, source, at_ns)
        with sheet.about("where the target was"):
            first = chain(sheet, tree, target, fixed, at_ns)
        with sheet.about("where the source was"):
            second = chain(sheet, tree, fixed, source, source_at_ns)
        sheet.play("across", {})
        return product(sheet, first, second, (printable(target), printable(fixed), printable(source)))

    return derived_pose(style, _named(target, source), own, way)


def write_explanation(found: dict[str, Any]) -> str:
    """Write the formulas of a comparison of trajectories with the numbers of this run."""
    sheet, fit, ate = Sheet(9, clean=False), found["transform"], found["ate"]
    errors = {name: ate[f"{name}_m"]["rmse"] for name in ("along", "across", "up")}
    turned = {"turned": float(bool(ate["deg"])), "deg": ate["deg"]["rmse"] if ate["deg"] else 0.0}
    values = {"sse": ate["m"]["sse"], "paired": float(found["poses"]["paired"]), "c": fit.get("scale", 1.0)}
    sheet.play(
        "comparison", values | errors | turned | {"offset": found["offset_s"]}, est=printable(found["est"]),
        ref=printable(found["ref"]), possible=found["poses"]["possible"], align=found["settings"]["align"],
        turn=sheet.numbers([*fit["quaternion"].values()]), shift=sheet.numbers(fit["xyz"]),
    )  # fmt: skip
    for each in found["rpe"]:
        if each["m"]:
            size = 0.0 if each["percent"] is None else float(each["delta"][:-1])
            summed = {"sse": each["m"]["sse"], "pairs": float(each["pairs"]), "size": size}
            sheet.play("relative error", summed, delta=each["delta"])
    if kitti := found["kitti"]:
        means = {key: kitti[key] for key in ("percent", "deg_per_m")}
        sheet.play("kitti", means, segments=kitti["segments"])
    return str(Explanation("comparison", sheet.items))
