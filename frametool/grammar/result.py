"""Poses as the mappings that machine formats write: the inverse of the grammar in `frametool.grammar.pose`.

YAML and JSON have one document or line per result; metres, radians unless the key states degrees; numbers as Python's
repr.  Other formats have the numbers: angles read back to the same rotation if possible, matrices to the last bits,
because a quaternion has more bits than either preserves.  Drawings show an edge in short: millimetres and hundredths of
a degree.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from frametool.errors import NamedTuple, ValueInvalid, listing, shown, warn
from frametool.geometry import euler, floats, quaternion, rigid
from frametool.geometry.representations import EARTH_FRAMES, Notation, notation
from frametool.grammar.pose import NAMES, SCALE, Pose
from frametool.grammar.readers import AXES_KEY, Quaternion

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry import Rigid, Three
    from frametool.geometry.place import Place
    from frametool.geometry.transform import Transform

INFINITE = float("inf")
ROUNDED_TO_ZERO = 1e-12  # smaller numbers, on a screen
SPELLED = ("csv", "json", "yaml")  # formats of records: every number and other field has a name
SEEN = ("text", "yaml")  # formats with rounded numbers on a screen


class RecordingStyle(NamedTuple):
    """How results are written to a recording.

    kinds: the messages, by their names in `recordings.made`; () for the default of each result
    topic: of all of them; "" for the usual ones
    frames: the reference frame and the body frame, for poses that do not name them
    folder: for temporary files while it is written
    """

    kinds: tuple[str, ...] = ()
    topic: str = ""
    frames: tuple[str, ...] = ()
    folder: str = ""


class Style(NamedTuple):
    """How results are written: format, notations, unit of bare angles, digits, sign of quaternions.

    precision: decimals; None for the shortest text that reads back
    full: this text for people too, who otherwise get a rounded overview, or 9 digits on a screen
    screen: the result is shown on a terminal, in the default format
    axes: of the camera whose poses are written, `optical` or `opengl`; "" if unknown
    in_camera: the reference frame is the same camera at another time
    place: how positions on the Earth are written, None for x, y, z
    in_cm: positions are written as xyz_cm, for axes of tools that use centimetres
    recording: how results are written to a recording
    """

    format: str
    notations: tuple[Notation, ...] = ()
    degrees: bool = False
    precision: int | None = None
    full: bool = False
    keep_sign: bool = False
    screen: bool = False
    axes: str = ""
    in_camera: bool = False
    place: Place | None = None
    in_cm: bool = False
    recording: RecordingStyle = RecordingStyle()

    def changed(self, **fields: Any) -> Style:
        """Return the same style with other fields; tables have no columns for convergence and scale of UTM."""
        style = self._replace(**fields)
        gridded = style.format in ("text", "yaml", "json")
        return style._replace(place=style.place and style.place.with_grid(gridded=gridded))

    def number(self, value: float) -> str:
        """Format a finite number: the shortest text that reads back to the same bits, or fixed decimals; never -0."""
        if not -INFINITE < value < INFINITE:
            raise ValueInvalid(f"a result is {value}: too large for a double, or not finite to begin with")
        if self.precision is not None:
            return f"{value:z.{self.precision}f}"
        if self.screen and self.format in SEEN and not self.full:  # 9 digits, and 0 for rounding errors
            value = float(f"{value:.9g}") if abs(value) >= ROUNDED_TO_ZERO else 0.0
        return repr(value + 0.0)


class Result(NamedTuple):
    """A pose and further results (distance, angle, ..)."""

    pose: Pose
    extras: dict[str, Any] = MappingProxyType({})  # type: ignore[assignment] # none

    def mapping(self, style: Style) -> dict[str, Any]:
        """Return the tree entry: name, parent, xyz, one key per representation, then the extras."""
        pose = self.pose
        entry: dict[str, Any] = {"name": pose.name} if pose.name else {}
        entry |= {"parent": pose.parent} if pose.parent else {}
        extras = self.all_extras(style)
        if style.place is not None:
            from frametool.grammar.place import placed_entry

            written, pose = placed_entry(pose, style.place)
            if style.place.origin is not None:  # the keys state its axes
                entry.pop("parent", None)
            entry |= written
        elif pose.rotation is None or (
            pose.position is not None and not any(each.representation.whole for each in style.notations)
        ):
            entry |= placed(pose.position or (0.0, 0.0, 0.0), style)
        for each in style.notations if pose.rotation is not None else ():
            key, value = rotation_entry(pose, each, style)
            if key in entry:  # Euler angles about different axes share a key and become a list
                known = entry[key]
                several = known if type(known) is list and type(value) is dict else [known]
                value = known if value in several else [*several, value]
            entry[key] = value
            if is_locked(pose, each):
                extras = {"gimbal_lock": True} | extras
        return entry | extras

    def all_extras(self, style: Style) -> dict[str, Any]:
        """Return the extras of a pose, and its scale unless the only matrix that is written contains it."""
        extras = with_entries(self.extras) if self.extras else {}
        return extras if self.pose.scale == 1.0 or holds_scale(style.notations) else {SCALE: self.pose.scale} | extras


def placed(position: Sequence[float], style: Style) -> dict[str, list[float]]:
    """Return a position by its key; in centimetres with the decimals that read back to the same metres."""
    if not style.in_cm:
        return {"xyz": list(position)}
    from decimal import Decimal

    return {"xyz_cm": [float(Decimal(repr(part)).scaleb(2)) for part in position]}


class NoResult(Result):
    """A bad row with --on-error null: its frames and other keys, with null in place of its pose."""

    __slots__ = ()

    def mapping(self, style: Style) -> dict[str, Any]:
        """Return the keys of a result."""
        if self.pose == Pose():
            return dict(self.extras)
        entry = Result(self.pose).mapping(style)
        return {key: value if key in NAMES else None for key, value in entry.items()} | with_entries(self.extras)


def with_entries(extras: dict[str, Any]) -> dict[str, Any]:
    """Return numbers by name with those of a covariance, c11 .. c33 or c66, as a single list for mappings."""
    first = next((name for name in extras if name.endswith("c11")), None)
    if first is None:
        return extras
    prefix = first.removesuffix("c11")
    axes = "123456" if f"{prefix}c66" in extras else "123"
    names = [f"{prefix}c{i}{j}" for i in axes for j in axes]
    if not extras.keys() >= {*names}:
        return extras
    entries = [extras[name] for name in names]
    whole = {f"{prefix}covariance": None if entries[0] is None else entries}
    return {name: value for name, value in extras.items() if name not in names} | whole


def in_columns(extras: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the extras of poses or points as columns: a covariance as c11 .. c66, or c11 .. c33."""
    entries = in_one_list(extras["covariance"]) if "covariance" in extras else None
    if entries is None:
        return extras
    from frametool.grammar.covariance import columns

    found = {key: value for key, value in extras.items() if key != "covariance"}
    return found | dict(zip(columns(len(entries)), entries, strict=True))


def in_one_list(covariance: Any) -> list[Any] | None:
    """Return the entries of a covariance that is a list, or a list of rows; None for anything else."""
    entries = covariance if isinstance(covariance, list) else []
    if entries and all(isinstance(row, list) and len(row) == len(entries) for row in entries):
        entries = [entry for row in entries for entry in row]
    return entries if len(entries) in (36, 9) else None


def tree_entries(tree: Frames, style: Style) -> Iterator[dict[str, Any]]:
    """Yield the entries of a tree in list form: roots, then edges; moving ones with their samples."""
    cameras = {name: {"camera": camera.mapping()} for name, camera in tree.cameras.items()}
    yield from ({"name": root, **cameras.get(root, {})} for root in tree.roots)
    for track in tree.tracks():
        camera = cameras.get(track.child, {})
        covariance = tree.covariances.get(track.child)
        if track.is_static:
            yield _edge(Pose.of((*track.components, *(covariance or ())), track.child, track.parent), style) | camera
            continue
        if covariance and style.place is not None and track.parent in EARTH_FRAMES:
            warn(f"frame {shown(track.child)} is written by xyz: its one covariance is along the axes of ecef")
        written, samples = style.changed(place=None) if covariance else style, []
        for stamp_ns, parent, components in track.walk():  # a sample under another parent than the newest names it
            pose = Pose.of(components, None, None if parent == track.parent else parent)
            samples.append({"stamp_ns": stamp_ns} | _edge(pose, written, parent))
        yield {"name": track.child, "parent": track.parent} | uncertain(covariance) | {"samples": samples} | camera


def _edge(pose: Pose, style: Style, above: str | None = None) -> dict[str, Any]:
    """Return an edge as a mapping; in the Earth's frame with a geodetic position, if the style writes these.

    above: the parent of a sample that does not name it
    """
    at: dict[str, Any] = {}
    if style.place is not None and style.place.name != EARTH_FRAMES[0] and (above or pose.parent) in EARTH_FRAMES:
        from frametool.grammar.place import frame_entry

        at, pose = frame_entry(pose, style.place)
    entry = Result(pose, uncertain(pose.covariance)).mapping(style.changed(place=None))
    return {key: entry.pop(key) for key in ("name", "parent") if key in entry} | at | entry


def uncertain(entries: Iterable[float] | None) -> dict[str, Any]:
    """Return the covariance part of a result; empty if it is exact."""
    if entries is None:
        return {}
    from frametool.grammar.covariance import COVARIANCE, Unrounded

    return {COVARIANCE: [Unrounded(entry + 0.0) for entry in entries]}


def sample_results(tree: Frames) -> Iterator[Result]:
    """Yield every sample as a separate result, frame by frame; those of moving frames have their stamp."""
    for track in tree.tracks():
        for stamp_ns, parent, components in track.walk():
            yield Result(Pose.of(components, track.child, parent), {} if stamp_ns is None else {"stamp_ns": stamp_ns})


def edge_results(tree: Frames) -> Iterator[Result]:
    """Yield every edge as a result, with the time of the tree, if one was chosen."""
    extras = {} if tree.at_ns is None else {"stamp_ns": tree.at_ns}
    return (Result(Pose.of(transform.components, child, parent), extras) for parent, child, transform in tree.edges())


def holds_scale(notations: Sequence[Notation]) -> bool:
    """Return True if a similarity is written as a single matrix whose 3 x 3 is s R."""
    return len(notations) == 1 and notations[0].representation.whole is not None


def is_locked(pose: Pose, notation: Notation) -> bool:
    """Return True if the requested Euler angles are not unique: the third was set to 0."""
    axes = notation.euler_axes
    return axes is not None and pose.rotation is not None and bool(euler.locked(*pose.rotation, axes))


def rotation_numbers(pose: Pose, notation: Notation, style: Style) -> Sequence[float]:
    """Return a pose's rotation as the numbers of a notation, in column order."""
    unit = quaternion.unit(*pose.components[3:], floats)
    numbers = notation.from_quaternion(*unit, floats, degrees=style.degrees, keep_sign=style.keep_sign)
    scale = pose.scale if pose.scale != 1.0 and holds_scale(style.notations) else 1.0
    return [number * scale + 0.0 for number in numbers]  # avoids -0.0


def pose_numbers(pose: Pose, notation: Notation, style: Style) -> Sequence[float]:
    """Return the numbers of a notation: of the whole pose if it includes the position."""
    numbers, whole = rotation_numbers(pose, notation, style), notation.representation.whole
    return numbers if whole is None or pose.position is None else whole.join(pose.position, numbers)


def rotation_entry(pose: Pose, notation: Notation, style: Style) -> tuple[str, Any]:
    """Return the key and the value of a notation, in the shape that the grammar reads."""
    row = notation.representation
    key = f"{row.name}_deg" if row.angles and notation.in_degrees(style.degrees) else row.name
    return key, notation.spelled(pose_numbers(pose, notation, style))


METRES = 3
DEGREES = 2
MOST_PLAIN = 1e9
NOISE = 1e-9  # the rounding error of a zero, metres or degrees


def edge_label(transform: Transform, style: Style, parent: str) -> tuple[str, str]:
    """Return two lines: `xyz 0.1 0 1.2` and `rpy_deg 0 15 0`, or the first requested representation.

    In the Earth's frame: `lat 48.1 lon 11.5 alt 520` and `enu rpy_deg 0 15 0`.
    """
    pose, at, axes = Pose.of(transform.components, None, parent), "", ""
    digits = {"lat": 9, "lon": 9} if style.precision is None else {}  # 0.1 mm
    usual = METRES if style.precision is None else style.precision
    if parent in EARTH_FRAMES:
        from frametool.grammar.place import seen_at

        members, pose = seen_at(pose, style.place)
        axes = f"{members.pop(AXES_KEY)} " if members else ""
        at = " ".join(
            f"{key} {each if type(each) is str else _rounded(each, digits.get(key, usual))}"
            for key, each in members.items()
        )
    chosen = style.notations[0] if style.notations else notation("rpy_deg")
    degrees = bool(chosen.representation.angles) and chosen.in_degrees(style.degrees)
    decimals = DEGREES if degrees and style.precision is None else usual
    position = " ".join(_rounded(part, usual) for part in pose.components[:3])
    rotation = " ".join(_rounded(part, decimals) for part in rotation_numbers(pose, chosen, style))
    return at or f"xyz {position}", f"{axes}{chosen.spec} {rotation}"


def graphviz(text: str) -> str:
    """Escape a text for double quotes in graphviz, where & and a backslash begin escapes."""
    return text.replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


def _rounded(value: float, decimals: int) -> str:
    """Round a number for display, without trailing zeros; very small and very large numbers get an exponent."""
    if abs(value) < NOISE:
        value = 0.0
    if value and not 0.5 * 10.0**-decimals <= abs(value) < MOST_PLAIN:
        return f"{value:.1e}"
    text = f"{value + 0.0:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if decimals else text


# --- texts in YAML and JSON, and the numbers of other formats ---


def write_poses(results: Iterable[Result | dict[str, Any]], style: Style) -> str:
    """Return one line per result in JSON, else the results as documents separated by `---`."""
    from frametool.documents.writers import dump_json, dump_yaml

    is_json = style.format == "json"
    dump, end = (dump_json, "\n") if is_json else (dump_yaml, "")
    texts = []
    for each in results:
        record = each.mapping(style) if isinstance(each, Result) else each
        texts.append(dump(record, style.number) + end)
    return ("" if is_json else "---\n").join(texts)


write_points = write_poses


def write_tree(tree: Frames, style: Style) -> str:
    """Return the tree in list form, roots first; JSON on one line."""
    from frametool.documents.writers import dump_json, flow

    if style.format == "json":
        return f"{dump_json({'frames': list(tree_entries(tree, style))}, style.number)}\n"
    entries = "".join(f"  - {flow(entry, style.number)}\n" for entry in tree_entries(tree, style))
    return f"frames:\n{entries}"


MOST_DECIMALS = 17


def refuse_motion(tree: Frames, fmt: str) -> None:
    """Raise ValueInvalid for a tree that moves, which a format cannot hold."""
    if moving := next((track.child for track in tree.tracks() if not track.is_static), None):
        raise ValueInvalid(f"{fmt} holds no moving frames, and {shown(moving)} moves; give --at TIME")


def static_edges(tree: Frames, fmt: str) -> list[tuple[str, str, Rigid]]:
    """Return parent, child and pose of the edges of a tree; warns about frames without any edge.

    Raises ValueInvalid if it moves, or has none.
    """
    refuse_motion(tree, fmt)
    edges = [(track.parent, track.child, track.components) for track in tree.tracks()]
    if not edges:
        raise ValueInvalid(f"{fmt} holds poses, and the tree has none: {listing(tree.frames)}")
    parents = {parent for parent, _, _ in edges}
    if lonely := [frame for frame in tree.roots if frame not in parents]:
        warn(f"{fmt} cannot store frames without a pose: {', '.join(map(shown, lonely[:5]))} left out")
    return edges


def angles_of(rotation: Quaternion) -> Three[float]:
    """Return roll, pitch, yaw of a rotation: with the fewest decimals that give the same bits, else the nearest."""
    original = quaternion.from_quaternion(*rotation, floats)
    exact: Three[float] = euler.from_quaternion(*original, "sxyz", floats)
    for decimals in range(MOST_DECIMALS):
        roll, pitch, yaw = (round(angle, decimals) for angle in exact)
        if of_angles((roll, pitch, yaw)) == original:
            return roll, pitch, yaw
    return exact


def of_angles(angles: Iterable[float]) -> Quaternion:
    """Return the rotation of roll, pitch and yaw, as it is read back."""
    roll, pitch, yaw = angles
    return floats.canonical_sign(*euler.to_quaternion(roll, pitch, yaw, "sxyz", floats))


def rows_of(pose: Rigid) -> list[list[float]]:
    """Return the rows of the 4x4 matrix of a pose."""
    numbers = rigid.to_homogeneous(*pose[:3], *quaternion.from_quaternion(*pose[3:], floats), floats)
    return [[number + 0.0 for number in numbers[at : at + 4]] for at in (0, 4, 8, 12)]  # avoids -0.0
