"""The one table of rotation notations: their names, columns, units, and the way to and from a quaternion.

Files, options, CSV headers, help and tests are derived from REPRESENTATIONS. Degrees are handled here and in the
kernels this calls, nowhere else. Knows no syntax of any file.
"""

from __future__ import annotations

from math import inf, isfinite

from frametool.errors import ValueInvalid, alternatives, did_you_mean
from frametool.geometry import axis_angle, euler, matrix, mrp, quaternion, rotvec, six_d

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from frametool.geometry.types import Components, Kernel, Namespace, Quaternion

    Check = Callable[..., Components]


class BatchRule:
    """How many rows of a notation are checked at once, for notations that refuse or mend more than infinities.

    what: what the rows are, in the plural
    deviation: kernel (components, xp) of how far each row is from a rotation; inf where nothing can be made of it
    repair: kernel (components, xp) that makes rotations of rows
    exact: the deviation up to which a row keeps its bits
    """

    __slots__ = ("deviation", "exact", "repair", "what")

    def __init__(self, what: str, deviation: Callable[..., Any], repair: Kernel, exact: float) -> None:
        """Bind the kernels."""
        self.what = what
        self.deviation = deviation
        self.repair = repair
        self.exact = exact


class Representation:
    """One notation: its name, bare column names, which columns are angles, and a line of help."""

    __slots__ = ("_backward", "_check", "_forward", "angles", "batch", "columns", "name", "summary")

    def __init__(
        self, columns: str, angles: tuple[int, ...], summary: str, *,
        forward: Callable[..., Any], backward: Callable[..., Any], check: Check | None = None,
        batch: BatchRule | None = None,
    ) -> None:  # fmt: skip
        """Describe a notation; `forward` and `backward` take (components, xp, degrees, axes)."""
        self.name = ""
        self.columns = tuple(columns.split())
        self.angles = angles
        self.summary = summary
        self._forward = forward
        self._backward = backward
        self._check = check
        self.batch = batch

    def __repr__(self) -> str:
        """Show the name."""
        return f"<representation {self.name}>"

    @property
    def can_fail(self) -> bool:
        """Tell whether finite numbers may be no rotation: a norm, an axis, a matrix; three angles always are one."""
        return self._check is not None

    def to_quaternion(
        self, components: Components, xp: Namespace, *, degrees: bool = False, axes: str = "sxyz"
    ) -> Quaternion:
        """Return x, y, z, w of components in column order; `degrees` touches the angle columns only, `axes` Euler's."""
        result: Quaternion = self._forward(components, xp, degrees, axes)
        return result

    def from_quaternion(
        self, x: Any, y: Any, z: Any, w: Any, xp: Namespace, *, degrees: bool = False, axes: str = "sxyz"
    ) -> Components:
        """Return the components in column order of a unit quaternion."""
        result: Components = self._backward((x, y, z, w), xp, degrees, axes)
        return result

    def checked(self, components: Sequence[float], *, normalize: bool = False) -> Components:
        """Return the floats of one rotation, as near to a rotation as they must be.

        Raises:
            ValueInvalid: wrong count, not finite, or no rotation.
        """
        if len(components) != len(self.columns):
            expected = f"{len(self.columns)} numbers ({' '.join(self.columns)})"
            raise ValueInvalid(f"{self.name} takes {expected}, found {len(components)}")
        if self._check is not None:
            return self._check(*components, normalize=normalize)
        if not all(map(isfinite, components)):
            shown = " ".join(f"{value:g}" for value in components)
            raise ValueInvalid(f"{self.name} {shown} is not finite; give finite numbers", rule="not-finite")
        return tuple(components)


def _arithmetic(kernel: Callable[..., Components]) -> Callable[..., Components]:
    return lambda components, _xp, _degrees, _axes: kernel(*components)


def _plain(kernel: Callable[..., Components]) -> Callable[..., Components]:
    return lambda components, xp, _degrees, _axes: kernel(*components, xp)


def _angular(kernel: Callable[..., Components]) -> Callable[..., Components]:
    return lambda components, xp, degrees, _axes: kernel(*components, xp, degrees=degrees)


def _euler(kernel: Callable[..., Components]) -> Callable[..., Components]:
    return lambda components, xp, degrees, axes: kernel(*components, axes, xp, degrees=degrees)


def _rpy(kernel: Callable[..., Components]) -> Callable[..., Components]:
    return lambda components, xp, degrees, _axes: kernel(*components, "sxyz", xp, degrees=degrees)


def _same(x: Any, y: Any, z: Any, w: Any) -> Quaternion:
    return x, y, z, w


def _from_wxyz(w: Any, x: Any, y: Any, z: Any) -> Quaternion:
    return x, y, z, w


def _as_wxyz(x: Any, y: Any, z: Any, w: Any, xp: Namespace) -> Components:
    x, y, z, w = quaternion.from_quaternion(x, y, z, w, xp)
    return w, x, y, z


def _wxyz_deviation(w: Any, x: Any, y: Any, z: Any, xp: Any) -> Any:
    return quaternion.deviation(x, y, z, w, xp)


def _wxyz_repaired(w: Any, x: Any, y: Any, z: Any, xp: Any) -> Quaternion:
    x, y, z, w = quaternion.repaired(x, y, z, w, xp)
    return w, x, y, z


def _check_wxyz(w: float, x: float, y: float, z: float, *, normalize: bool = False) -> Components:
    x, y, z, w = quaternion.check(x, y, z, w, normalize=normalize)
    return w, x, y, z


def _check_mrp(*parameters: float, normalize: bool = False) -> Components:
    return rotvec.check(*parameters, normalize=normalize, what="mrp")


def _xyzw(summary: str) -> Representation:
    return Representation(
        "qx qy qz qw", (), summary,
        forward=_arithmetic(_same), backward=_plain(quaternion.from_quaternion), check=quaternion.check,
        batch=BatchRule("quaternions", quaternion.deviation, quaternion.repaired, quaternion.UNIT),
    )  # fmt: skip


REPRESENTATIONS: dict[str, Representation] = {
    "quaternion": _xyzw("unit quaternion, named x y z w"),
    "xyzw": _xyzw("unit quaternion, scalar last"),
    "wxyz": Representation(
        "qw qx qy qz", (), "unit quaternion, scalar first",
        forward=_arithmetic(_from_wxyz), backward=_plain(_as_wxyz), check=_check_wxyz,
        batch=BatchRule("quaternions", _wxyz_deviation, _wxyz_repaired, quaternion.UNIT),
    ),
    "rpy": Representation(
        "roll pitch yaw", (0, 1, 2), "roll, pitch, yaw about the fixed axes x, y, z (URDF, tf2 setRPY)",
        forward=_rpy(euler.to_quaternion), backward=_rpy(euler.from_quaternion),
    ),
    "euler": Representation(
        "euler_1 euler_2 euler_3", (0, 1, 2), "three angles in the order of euler:AXES, s fixed or r rotating axes",
        forward=_euler(euler.to_quaternion), backward=_euler(euler.from_quaternion),
    ),
    "axis_angle": Representation(
        "axis_x axis_y axis_z angle", (3,), "axis of any length, then the angle about it",
        forward=_angular(axis_angle.to_quaternion), backward=_angular(axis_angle.from_quaternion),
        check=axis_angle.check,
    ),
    "rotvec": Representation(
        "rotvec_x rotvec_y rotvec_z", (0, 1, 2), "rotation vector: unit axis times angle",
        forward=_angular(rotvec.to_quaternion), backward=_angular(rotvec.from_quaternion), check=rotvec.check,
    ),
    "matrix": Representation(
        "r11 r12 r13 r21 r22 r23 r31 r32 r33", (), "rotation matrix, row by row",
        forward=_plain(matrix.to_quaternion), backward=_arithmetic(quaternion.to_matrix), check=matrix.check,
        batch=BatchRule("matrices", matrix.deviation, matrix.nearest, matrix.ORTHONORMAL),
    ),
    "mrp": Representation(
        "mrp_x mrp_y mrp_z", (), "modified Rodrigues parameters: unit axis times tan(angle/4)",
        forward=_arithmetic(mrp.to_quaternion), backward=_plain(mrp.from_quaternion), check=_check_mrp,
    ),
    "six_d": Representation(
        "r11 r21 r31 r12 r22 r32", (), "first two columns of the matrix (Zhou's continuous 6D)",
        forward=_plain(six_d.to_quaternion), backward=_arithmetic(six_d.from_quaternion), check=six_d.check,
        batch=BatchRule("pairs of columns", six_d.deviation, six_d.repaired, inf),
    ),
}  # fmt: skip
for _name, _row in REPRESENTATIONS.items():
    _row.name = _name


class Notation:
    """A representation with its axes and unit bound: what `rpy_deg` or `euler:rzyx` spells."""

    __slots__ = ("axes", "degrees", "representation", "spec")

    def __init__(self, spec: str, representation: Representation, axes: str | None, *, degrees: bool | None) -> None:
        """Bind; `axes` is None where none were named, `degrees` where the unit was not said."""
        self.spec = spec
        self.representation = representation
        self.axes = axes
        self.degrees = degrees

    @property
    def columns(self) -> tuple[str, ...]:
        """Name the columns; angles carry the unit where it was said."""
        if self.degrees is None:
            return self.representation.columns
        suffix = "_deg" if self.degrees else "_rad"
        angles = self.representation.angles
        return tuple(name + suffix * (index in angles) for index, name in enumerate(self.representation.columns))

    def to_quaternion(self, components: Components, xp: Namespace, *, degrees: bool = False) -> Quaternion:
        """Return x, y, z, w; `degrees` counts where the notation itself says no unit."""
        unit = degrees if self.degrees is None else self.degrees
        return self.representation.to_quaternion(components, xp, degrees=unit, axes=self.bound_axes())

    def from_quaternion(self, x: Any, y: Any, z: Any, w: Any, xp: Namespace, *, degrees: bool = False) -> Components:
        """Return the components of a unit quaternion; `degrees` counts where the notation itself says no unit."""
        unit = degrees if self.degrees is None else self.degrees
        return self.representation.from_quaternion(x, y, z, w, xp, degrees=unit, axes=self.bound_axes())

    def checked_quaternion(
        self, components: Sequence[float], xp: Namespace, *, degrees: bool = False, normalize: bool = False
    ) -> Quaternion:
        """Return the quaternion of the floats of one rotation.

        Raises:
            ValueInvalid: wrong count, not finite, or no rotation.
        """
        return self.to_quaternion(self.representation.checked(components, normalize=normalize), xp, degrees=degrees)

    def bound_axes(self) -> str:
        """Return the Euler axes; raise ValueInvalid where `euler` was named without them."""
        if self.representation.name == "euler" and self.axes is None:
            raise ValueInvalid(f"{self.spec} needs its axes: write euler:rzyx (one of {', '.join(sorted(euler.AXES))})")
        return self.axes or "sxyz"


def notation(spec: str) -> Notation:
    """Read the name of a notation: `rpy`, `rpy_deg`, `euler:rzyx`, `euler_deg:rzyx`.

    Raises:
        ValueInvalid: unknown name or axes, a unit where there is no angle; with the nearest name and those there are.
    """
    name, colon, axes = spec.partition(":")
    bare, degrees = name, None
    if name not in REPRESENTATIONS and name[-4:] in ("_deg", "_rad"):
        bare, degrees = name[:-4], name.endswith("_deg")
    row = REPRESENTATIONS.get(bare)
    if row is None:
        raise ValueInvalid(f"unknown representation {bare!r}{alternatives(bare, REPRESENTATIONS, 'representations')}")
    if degrees is not None and not row.angles:
        raise ValueInvalid(f"{bare} has no angle: write it without {name[-4:]}")
    if colon and bare != "euler":
        raise ValueInvalid(f"{bare} has no axes to name; only euler has: euler:{axes or 'rzyx'}")
    return Notation(spec, row, checked_axes(axes) if colon else None, degrees=degrees)


def checked_axes(axes: str) -> str:
    """Return the name of an Euler convention back if it is one; else raise ValueInvalid with those there are."""
    if axes in euler.AXES:
        return axes
    near = _both_readings(axes.lower()) or did_you_mean(axes.lower(), euler.AXES) or ";"
    raise ValueInvalid(
        f"unknown Euler axes {axes!r}{near} s (static axes) or r (rotating axes) and three letters: "
        f"{', '.join(sorted(euler.AXES))}"
    )


def _both_readings(letters: str) -> str:
    """Name the two conventions that three bare letters may mean; nothing for other texts."""
    if f"r{letters}" not in euler.AXES:
        return ""
    return f"; did you mean r{letters} (rotating axes, intrinsic) or s{letters} (static axes, extrinsic)?"


def axes_name(order: str, frame: str) -> str:
    """Return the tf name of Euler axes told as order and frame: `zyx`, `intrinsic` is `rzyx`."""
    prefix = {"intrinsic": "r", "extrinsic": "s"}.get(frame)
    if prefix is None:
        raise ValueInvalid(f"unknown Euler frame {frame!r}; write intrinsic (rotating axes) or extrinsic (static axes)")
    return checked_axes(prefix + order.lower())
