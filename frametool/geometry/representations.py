"""The table of all rotation notations: names, columns, units, and the conversion to and from a quaternion.

Files, options, CSV headers, help and tests are derived from REPRESENTATIONS. Degrees are handled here and in the
kernels this calls, nowhere else. Knows no file syntax.
"""

from __future__ import annotations

from functools import partial
from math import isfinite, isqrt, tau
from typing import TYPE_CHECKING, Any

from frametool.errors import NamedTuple, ValueInvalid, did_you_mean, listing, nearest, shown, warn
from frametool.geometry import euler, floats, matrix, quaternion

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry import Components, Kernel, Namespace, Quaternion

LIST, MAP, NAMED, ROWS = "list", "map", "named", "rows"  # how documents hold the numbers of a rotation
NAMED_AXES = "AXES"
WORLDS = ("enu", "ned")  # of a heading: how the axes of the frame lie in which it is seen
OF_WORLD = "enu|ned"


class Whole(NamedTuple):
    """How a notation writes a whole pose, position and rotation in one: the 4x4 matrix.

    columns: names of its numbers, in their order
    join: from the position and the rotation's numbers to those of the pose
    split: from those of the pose to the position and the rotation's numbers
    tail: the constant last numbers
    """

    columns: tuple[str, ...]
    join: Callable[..., Components]
    split: Callable[..., Any]
    tail: tuple[float, ...] = ()


def _no_rotation(*_: Any) -> Any:
    raise ValueInvalid("a place is not a rotation")


class BatchRule(NamedTuple):
    """How many rows of a notation are checked at once, if not every finite row is a rotation.

    what: what the rows are, in the plural
    deviation: kernel (components, xp) of the deviation of each row from a rotation; inf if it cannot be repaired
    repair: kernel (components, xp) that makes rotations of rows
    exact: the deviation up to which a row keeps its bits
    explained: function (components, halves, xp) that returns True if a row is a rotation up to half a unit of the last
        printed digit of each number; None if there is nothing to explain
    remark: function of the components of one that returns the warning for a row that was repaired
    """

    what: str
    deviation: Callable[..., Any]
    repair: Kernel
    exact: float
    explained: Callable[..., Any] | None = None
    remark: Callable[..., str] = str


class Representation(NamedTuple):
    """One notation and everything that is known about it; no other list or table names it.

    columns: bare names of its numbers, in tables and messages; angles: the indices of those that are angles
    summary, label: a line of help; its name in text for people
    forward, backward: kernels (components, xp, degrees, axes) to and from a quaternion
    complaint: takes the components of one rotation, and `normalize`, and returns the error if they are refused; None if
        any finite numbers are a rotation
    short: short names of its numbers, for people and as keys of a map; () for x y z, if there are three
    shape: how documents hold the numbers: LIST, MAP (a list is accepted too), NAMED (a map only), ROWS, or the
        keys of a map, each with the number of its values
    axes: Euler axes: "" none, NAMED_AXES if the user names them, else the fixed ones; OF_WORLD: one of WORLDS
    whole: how it holds the position too, if it can; searched: whether headers are searched for its columns
    alone: columns that suffice for the last number if the others are missing and 0
    batch: how many rows are checked at once; without it rows are refused whose quaternion is not finite
    in_degrees: whether its angles are degrees if their name states no unit
    overview: the units in which an overview shows it ("" for no unit)
    kernels: for a position the `module:name` of its arithmetic, a `place.Kernels`
    """

    columns: tuple[str, ...]
    angles: tuple[int, ...]
    summary: str
    forward: Callable[..., Quaternion] = _no_rotation
    backward: Callable[..., Components] = _no_rotation
    complaint: Callable[..., ValueInvalid | None] | None = None
    shape: str | tuple[tuple[str, int], ...] = LIST
    short: tuple[str, ...] = ()
    label: str = ""
    axes: str = ""
    whole: Whole | None = None
    searched: bool = True
    alone: tuple[str, ...] = ()
    overview: tuple[str, ...] = ()
    in_degrees: bool = False
    batch: BatchRule | None = None
    kernels: str = ""
    name: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Return the short names of its numbers, "" for those that have none."""
        return self.short or (("x", "y", "z") if len(self.columns) == 3 else ("",) * len(self.columns))

    @property
    def is_place(self) -> bool:
        """Return True if it is a position on the Earth and not a rotation: a row of POSITIONS."""
        return self.forward is _no_rotation

    @property
    def on_earth(self) -> bool:
        """Return True if it is such a position, or a heading."""
        return self.is_place or self.axes == OF_WORLD

    @property
    def spelling(self) -> str:
        """Return the name as help shows it."""
        return f"{self.name}:{self.axes}" if self.axes in (NAMED_AXES, OF_WORLD) else self.name

    def checked(self, components: Sequence[float], *, normalize: bool = False) -> Components:
        """Check the floats of one rotation; return them, corrected to a rotation.

        Raises:
            ValueInvalid: wrong count, not finite, or not a rotation.
        """
        if len(components) != len(self.columns):
            expected = f"{len(self.columns)} numbers ({' '.join(self.columns)})"
            raise ValueInvalid(f"{self.name} takes {expected}, found {len(components)}")
        if not all(map(isfinite, components)):
            numbers = " ".join(f"{value:g}" for value in components)
            what = self.label or self.name
            raise ValueInvalid(f"{what} {numbers} is not finite; give finite numbers", rule="not-finite")
        rule = self.batch
        if rule and (off := rule.deviation(*components, floats)) <= rule.exact:
            return tuple(components)
        if self.complaint and (problem := self.complaint(*components, normalize=normalize)):
            raise problem
        if rule is None:
            return tuple(components)
        if off > quaternion.SILENT and not normalize:
            warn(rule.remark(*components), rule="rounded")
        return rule.repair(*components, floats)


def _kernel(kernel: Callable[..., Components], takes: str = "") -> Callable[..., Components]:
    """Return a kernel as rows hold it: called with (components, xp, degrees, axes).

    takes: which of the last three it takes in addition to the components: none, "xp", also "degrees", also "axes"
    """
    return {
        "": lambda components, _xp, _degrees, _axes: kernel(*components),
        "xp": lambda components, xp, _degrees, _axes: kernel(*components, xp),
        "degrees": lambda components, xp, degrees, _axes: kernel(*components, xp, degrees=degrees),
        "axes": lambda components, xp, degrees, axes: kernel(*components, axes, xp, degrees=degrees),
    }[takes]


def _xyzw(x: Any, y: Any, z: Any, w: Any) -> Quaternion:
    return x, y, z, w


def _of_wxyz(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel of w, x, y, z made from one of x, y, z, w."""
    return lambda w, x, y, z, *xp, **options: kernel(x, y, z, w, *xp, **options)


def _as_wxyz(kernel: Kernel) -> Kernel:
    """Return a kernel with results w, x, y, z made from one with results x, y, z, w."""
    def reordered(*components: Any, **options: Any) -> Components:
        x, y, z, w = kernel(*components, **options)
        return w, x, y, z

    return reordered


def _of_heading(components: Components, xp: Namespace, degrees: bool, axes: str) -> Quaternion:  # noqa: FBT001 - all do
    """Return the level rotation with a heading: a turn about down, or of 90 degrees - it where z is up."""
    axes = checked_world(axes.replace("sxyz", ""))
    sine, cosine = (floats.half_sincos_deg if degrees else floats.half_sincos)(components[0], xp)
    zero = 0.0 * sine
    if axes == "enu":
        return quaternion.settled(zero, zero, floats.SQRT_HALF * (cosine - sine), floats.SQRT_HALF * (cosine + sine))
    return zero, zero, sine, cosine


def _heading(rotation: Quaternion, xp: Namespace, degrees: bool, axes: str) -> Components:  # noqa: FBT001 - all do
    """Return where x points: yaw, or 90 degrees - yaw where z is up, from 0 to less than a turn."""
    yaw, turn = euler.from_quaternion(*rotation, "sxyz", xp, degrees=degrees)[2], 360.0 if degrees else tau
    return ((turn / 4.0 - yaw if axes == "enu" else yaw) % turn % turn,)  # -1e-17 % 360 is 360


def _homogeneous(position: Components, rows: Components) -> Components:
    upper = [number for row, moved in enumerate(position) for number in (*rows[3 * row : 3 * row + 3], moved)]
    return (*upper, *LAST_ROW)


def _of_homogeneous(m: Components) -> tuple[Components, Components]:
    return (m[3], m[7], m[11]), (*m[0:3], *m[4:7], *m[8:11])


LAST_ROW = (0.0, 0.0, 0.0, 1.0)  # of a homogeneous matrix
HOMOGENEOUS = Whole(
    tuple(f"m{row}{column}" for row in range(1, 5) for column in range(1, 5)), _homogeneous, _of_homogeneous, LAST_ROW
)
QUATERNIONS = BatchRule(
    "quaternions", quaternion.deviation, quaternion.repaired, quaternion.UNIT, quaternion.explained, quaternion.remark
)
MATRICES = BatchRule(
    "matrices", matrix.deviation, matrix.nearest, matrix.ORTHONORMAL, matrix.explained, matrix.remark
)
RPY, EULER_COLUMNS = ("roll", "pitch", "yaw"), ("euler_1", "euler_2", "euler_3")
XYZW = Representation(
    ("qx", "qy", "qz", "qw"), (), "unit quaternion, scalar last", short=("x", "y", "z", "w"), label="quaternion",
    forward=_kernel(_xyzw), backward=_kernel(quaternion.from_quaternion, "xp"),
    complaint=quaternion.complaint, batch=QUATERNIONS,
)  # fmt: skip


ROTATIONS = {
    "quaternion": XYZW._replace(
        summary="unit quaternion, named x y z w", label="", shape=NAMED, overview=("",)
    ),
    "xyzw": XYZW,
    "wxyz": Representation(
        ("qw", "qx", "qy", "qz"), (), "unit quaternion, scalar first", short=("w", "x", "y", "z"), label="quaternion",
        forward=_kernel(_of_wxyz(_xyzw)), backward=_kernel(_as_wxyz(quaternion.from_quaternion), "xp"),
        complaint=_of_wxyz(quaternion.complaint),
        batch=QUATERNIONS._replace(
            deviation=_of_wxyz(quaternion.deviation), repair=_as_wxyz(_of_wxyz(quaternion.repaired)),
            remark=_of_wxyz(quaternion.remark),
        ),
    ),
    "rpy": Representation(
        RPY, (0, 1, 2), "roll, pitch, yaw about the fixed axes x, y, z (URDF, tf2 setRPY)",
        short=RPY, shape=MAP, axes="sxyz", alone=("yaw", "theta"), overview=("_rad", "_deg"),
        forward=_kernel(euler.to_quaternion, "axes"), backward=_kernel(euler.from_quaternion, "axes"),
    ),
    "euler": Representation(
        EULER_COLUMNS, (0, 1, 2), "three angles in the order of euler:AXES, s fixed or r rotating axes",
        short=EULER_COLUMNS, shape=(("angles", 3),), axes=NAMED_AXES, searched=False,
        forward=_kernel(euler.to_quaternion, "axes"), backward=_kernel(euler.from_quaternion, "axes"),
    ),
    "axis_angle": Representation(
        ("axis_x", "axis_y", "axis_z", "angle"), (3,), "axis of any length, then the angle about it",
        short=("x", "y", "z", "angle"), label="axis-angle", shape=(("axis", 3), ("angle", 1)), overview=("_rad",),
        forward=_kernel(quaternion.from_axis_angle, "degrees"), backward=_kernel(quaternion.as_axis_angle, "degrees"),
        complaint=quaternion.axis_angle_complaint,
    ),
    "rotvec": Representation(
        ("rotvec_x", "rotvec_y", "rotvec_z"), (0, 1, 2), "rotation vector: unit axis times angle",
        label="rotation vector", complaint=quaternion.rotvec_complaint,
        forward=_kernel(quaternion.from_rotvec, "degrees"), backward=_kernel(quaternion.as_rotvec, "degrees"),
    ),
    "matrix": Representation(
        ("r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"), (), "rotation matrix, row by row",
        shape=ROWS, whole=HOMOGENEOUS, overview=("",),
        forward=_kernel(matrix.to_quaternion, "xp"), backward=_kernel(quaternion.to_matrix),
        complaint=matrix.complaint, batch=MATRICES,
    ),
    "mrp": Representation(
        ("mrp_x", "mrp_y", "mrp_z"), (), "modified Rodrigues parameters: unit axis times tan(angle/4)",
        forward=_kernel(quaternion.from_mrp), backward=_kernel(quaternion.as_mrp, "xp"),
        complaint=partial(quaternion.rotvec_complaint, what="mrp"),
    ),
    "six_d": Representation(
        ("r11", "r21", "r31", "r12", "r22", "r32"), (), "first two columns of the matrix (Zhou's continuous 6D)",
        label="6d", searched=False,
        forward=_kernel(matrix.from_six_d, "xp"), backward=_kernel(matrix.as_six_d), complaint=matrix.six_d_complaint,
        batch=BatchRule("pairs of columns", matrix.six_d_deviation, lambda *columns: columns[:-1], 0.0),
    ),
    "rpy_unreal": Representation(
        RPY, (0, 1, 2), "degrees, as Unreal's FRotator and CARLA turn their own axes",
        short=RPY, shape=MAP, axes="sxyz", alone=("yaw",), searched=False, in_degrees=True,
        forward=_kernel(euler.from_unreal, "degrees"), backward=_kernel(euler.as_unreal, "degrees"),
    ),
    "euler_unity": Representation(
        ("euler_x", "euler_y", "euler_z"), (0, 1, 2), "degrees, Unity's Quaternion.Euler: about z, then x, then y",
        axes="szxy", searched=False, in_degrees=True,
        forward=_kernel(euler.from_unity, "degrees"), backward=_kernel(euler.as_unity, "degrees"),
    ),
}  # fmt: skip
PLACE = "frametool.geometry.place"
UTM_NAMES = ("zone", "easting", "northing", "alt")
POSITIONS = {
    "lla": Representation(("lat", "lon", "alt"), (), "WGS84 latitude, longitude (degrees), metres above the ellipsoid",
                          short=("lat", "lon", "alt"), kernels=f"{PLACE}:LLA_KERNELS"),
    "ecef": Representation(("ecef_x", "ecef_y", "ecef_z"), (),
                           "the Earth's frame: x to lat 0 lon 0, z to the north pole", kernels=f"{PLACE}:ECEF_KERNELS"),
    "utm": Representation(("utm_zone", *UTM_NAMES[1:]), (), "UTM, a zone as 32N or 32S and metres",
                          short=UTM_NAMES, kernels=f"{PLACE}:UTM_KERNELS"),
    "enu": Representation(("east", "north", "up"), (), "metres east, north, up of --origin",
                          short=("east", "north", "up"), kernels=f"{PLACE}:LOCAL_KERNELS"),
    "ned": Representation(("north", "east", "down"), (), "metres north, east, down of --origin",
                          short=("north", "east", "down"), kernels=f"{PLACE}:LOCAL_KERNELS"),
}  # fmt: skip
for _table in (ROTATIONS, POSITIONS):
    _table.update({name: row._replace(name=name) for name, row in _table.items()})
HEADING = Representation(
    ("heading",), (0,), "where x points, clockwise from north, whatever the tilt; axes of the frame it is seen from",
    axes=OF_WORLD, searched=False, forward=_of_heading, backward=_heading, name="heading",
)  # fmt: skip
EARTH_FRAMES = ("ecef", "earth")  # one frame, by either name: that of places
REPRESENTATIONS = {**ROTATIONS, "heading": HEADING, **POSITIONS}


class Notation:
    """A representation with its axes and unit: what `rpy_deg` or `euler:rzyx` means."""

    __slots__ = ("axes", "degrees", "representation", "spec")

    def __init__(self, spec: str, representation: Representation, axes: str | None, *, degrees: bool | None) -> None:
        """Store them; `axes` is None if none were named, `degrees` if the unit was not stated."""
        self.spec = spec
        self.representation = representation
        self.axes = axes
        self.degrees = degrees

    @property
    def columns(self) -> tuple[str, ...]:
        """Return the names of the columns; angles carry the unit if it was stated."""
        return self.columns_in(degrees=None)

    def columns_in(self, *, degrees: bool | None) -> tuple[str, ...]:
        """Return the names of the columns; angles carry the notation's unit, or else that of `degrees`."""
        row = self.representation
        suffix = "_deg" if (self.degrees or (degrees and self.degrees is None)) else "_rad" * (self.degrees is False)
        return tuple(name + suffix * (index in row.angles) for index, name in enumerate(row.columns))

    @property
    def names(self) -> tuple[str, ...]:
        """Return short names of the numbers, for people."""
        row = self.representation
        return tuple((self.axes or "")[1:]) if row.axes == NAMED_AXES else row.names

    @property
    def label(self) -> str:
        """Return what the notation is called in text for people."""
        row = self.representation
        return (row.label or row.name) + (f" {self.axes}" if self.axes else "")

    @property
    def euler_axes(self) -> str | None:
        """Return the Euler axes, fixed or named; None for a notation without."""
        fixed = self.representation.axes
        return self.axes if fixed == NAMED_AXES else "sxyz" if fixed == OF_WORLD else fixed or None

    @property
    def counts(self) -> tuple[int, ...]:
        """Return how many numbers make a rotation, and how many a whole pose."""
        size, whole = len(self.representation.columns), self.representation.whole
        return (size, size + 3, len(whole.columns)) if whole else (size, size + 3)

    @property
    def counted(self) -> str:
        """Return how many numbers it takes, for messages."""
        size, placed, *whole = self.counts
        if whole:
            return f"{self.spec} has {size} numbers, {placed} (three rows of a pose) or {whole[0]}"
        return f"{self.spec} has {size} numbers ({' '.join(self.columns)}), or {placed} with x y z before them"

    def in_degrees(self, default: bool) -> bool:  # noqa: FBT001 - the one thing it is about
        """Return True if angles are degrees: as the notation states, else as `default`."""
        return default if self.degrees is None else self.degrees

    def to_quaternion(self, components: Components, xp: Namespace, *, degrees: bool = False) -> Quaternion:
        """Return x, y, z, w; `degrees` applies if the notation itself states no unit."""
        unit = degrees if self.degrees is None else self.degrees
        return self.representation.forward(components, xp, unit, self.bound_axes())

    def from_quaternion(
        self, x: Any, y: Any, z: Any, w: Any, xp: Namespace, *, degrees: bool = False, keep_sign: bool = False
    ) -> Components:
        """Return the components of a unit quaternion; `degrees` applies if the notation itself states no unit.

        keep_sign: preserve the sign of a quaternion
        """
        row = self.representation
        if keep_sign and {*row.columns} == {*XYZW.columns}:
            named = {"qx": x, "qy": y, "qz": z, "qw": w}
            return tuple(named[column] for column in row.columns)
        unit = degrees if self.degrees is None else self.degrees
        return row.backward((x, y, z, w), xp, unit, self.bound_axes())

    def checked_quaternion(
        self, components: Sequence[float], xp: Namespace, *, degrees: bool = False, normalize: bool = False
    ) -> Quaternion:
        """Check the floats of one rotation and return its quaternion.

        Raises:
            ValueInvalid: wrong count, not finite, or not a rotation.
        """
        return self.to_quaternion(self.representation.checked(components, normalize=normalize), xp, degrees=degrees)

    def spelled(self, numbers: Sequence[Any]) -> Any:
        """Return the numbers of a rotation, or of a whole pose, in the shape in which documents hold them."""
        row = self.representation
        if isinstance(row.shape, tuple):
            entry: dict[str, Any] = {"axes": self.axes} if row.axes == NAMED_AXES else {}
            first = 0
            for key, count in row.shape:
                entry[key] = list(numbers[first : first + count]) if count > 1 else numbers[first]
                first += count
            return entry
        if row.shape == ROWS:
            return list(map(list, zip(*[iter(numbers)] * isqrt(len(numbers)), strict=True)))
        found: Any = list(numbers) if row.shape == LIST else dict(zip(self.names, numbers, strict=True))
        return numbers[0] if row.axes == OF_WORLD else found

    def bound_axes(self) -> str:
        """Return the Euler axes; raise ValueInvalid if they have to be named and were not."""
        if self.representation.axes == NAMED_AXES and self.axes is None:
            raise ValueInvalid(f"{self.spec} needs its axes: write euler:rzyx (one of {', '.join(sorted(euler.AXES))})")
        return self.axes or "sxyz"

    def in_world(self, axes: str) -> Notation:
        """Return a heading bound to the axes of its frame, where they are known, other notations as they are."""
        if self.representation.axes != OF_WORLD:
            return self
        if axes and self.axes not in (None, axes):
            raise ValueInvalid(f"{self.spec}: the result is in axes {axes}")
        return Notation(self.spec, self.representation, checked_world(axes or self.axes), degrees=self.degrees)


# a pose as the first three rows of its 4x4, as in a KITTI trajectory: no name spells it, twelve numbers are it
UPPER_ROWS = Notation("matrix", ROTATIONS["matrix"]._replace(
    whole=Whole(HOMOGENEOUS.columns[:12], lambda position, rows: _homogeneous(position, rows)[:12], _of_homogeneous)
), None, degrees=None)  # fmt: skip

# of other tools
OTHER_NAMES = {"quat": "quaternion", "ypr": "euler:rzyx", "ypr_deg": "euler_deg:rzyx", "ypr_rad": "euler_rad:rzyx"}


def notation(spec: str) -> Notation:
    """Read the name of a notation: `rpy`, `rpy_deg`, `euler:rzyx`, `euler_deg:rzyx`.

    Raises:
        ValueInvalid: unknown name or axes, a unit without an angle; lists the nearest name and all names.

    """
    name, colon, axes = spec.partition(":")
    bare, degrees = name, None
    if name not in REPRESENTATIONS and name[-4:] in ("_deg", "_rad"):
        bare, degrees = name[:-4], name.endswith("_deg")
    row = REPRESENTATIONS.get(bare)
    if row is None:
        known = f"{_near_names(bare, spec)} representations: {listing(REPRESENTATIONS, near=bare)}"
        raise ValueInvalid(f"unknown representation {shown(bare)}{known}")
    if degrees is not None and not row.angles:
        raise ValueInvalid(f"{bare} has no angle: write it without {name[-4:]}")
    if degrees is None and row.in_degrees:
        degrees = True
    if colon and row.axes not in CHECKED:
        raise ValueInvalid(f"{bare} has no axes to name; only euler has: euler:{axes or 'rzyx'}")
    return Notation(spec, row, CHECKED[row.axes](axes) if colon else None, degrees=degrees)


def _near_names(name: str, spec: str) -> str:
    """Return the nearest representation, and those nearly as near that have the same numbers in another order."""
    if spec in OTHER_NAMES:
        return f"; did you mean {shown(OTHER_NAMES[spec])}?"
    near = nearest(name, REPRESENTATIONS)
    rivals = [each for each in near if {*REPRESENTATIONS[each].columns} == {*REPRESENTATIONS[near[0]].columns}]
    return f"; did you mean {' or '.join(map(shown, rivals))}?" if near else ";"


def notations(spec: str) -> tuple[Notation, ...]:
    """Read the name of a notation, or `euler:all` for all 24 conventions; raises as `notation` does."""
    name, _, axes = spec.partition(":")
    return tuple(notation(f"{name}:{each}") for each in sorted(euler.AXES)) if axes == "all" else (notation(spec),)


def checked_axes(axes: str) -> str:
    """Return the name of an Euler convention; raise ValueInvalid, naming the nearest, if it is not one."""
    if axes in euler.AXES:
        return axes
    folded = axes.lower()
    letters = folded[1:] if folded[:1] not in ("s", "r") and f"r{folded[1:]}" in euler.AXES else folded
    if f"r{letters}" in euler.AXES:  # of three letters, bare or with another prefix, both readings are suggested
        near = f"; did you mean r{letters} (rotating axes, intrinsic) or s{letters} (static axes, extrinsic)?"
    else:  # static axes are never suggested for rotating
        near = did_you_mean(folded, [each for each in euler.AXES if each[0] == folded[:1]]) or ";"
    raise ValueInvalid(
        f"unknown Euler axes {shown(axes)}{near} s (static axes) or r (rotating axes) and three letters, such as rzyx"
    )


def checked_world(axes: str | None) -> str:
    """Return the axes of the frame of a heading back; else raise ValueInvalid with those there are."""
    if axes in WORLDS:
        return axes
    both = "write heading_deg:enu (x east, y north, z up) or heading_deg:ned (x north, y east, z down)"
    said = f"and not in axes {shown(axes)}" if axes else "which a pose does not say of its frame"
    raise ValueInvalid(f"a heading is clockwise from north in axes enu or ned, {said}; {both}")


CHECKED = {NAMED_AXES: checked_axes, OF_WORLD: checked_world}


def axes_name(order: str, frame: str) -> str:
    """Return the tf name of Euler axes from order and frame: `zyx`, `intrinsic` is `rzyx`."""
    prefix = {"intrinsic": "r", "extrinsic": "s"}.get(frame)
    if prefix is None:
        choices = "intrinsic (rotating axes) or extrinsic (static axes)"
        raise ValueInvalid(f"unknown Euler frame {shown(frame)}; write {choices}")
    return checked_axes(prefix + order.lower())
