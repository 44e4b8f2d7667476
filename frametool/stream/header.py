"""Find points and poses among the columns of a table, by name: `x y z`, `qx qy qz qw`, `roll_deg ..`, with affixes.

A common prefix or suffix is one that is set off: `pose.qx`, `qx_left`, `field.pose.orientation.x`. Knows names only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, did_you_mean
from frametool.geometry.representations import REPRESENTATIONS, notation
from frametool.stream.faults import Misused

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.geometry.representations import Notation

POSITIONS = ("x y z", "tx ty tz", "px py pz")
TELLING = ("position", "translation", "point", "vector")
OTHER_UNITS = ("_cm", "_km", "_in", "_ft", "_deg", "_rad", "_s")
MILLIMETRES = "_mm"
WHOLE = tuple(f"m{row}{column}" for row in "1234" for column in "1234")
# `quaternion` stands for the three that share its columns; six_d's are a matrix's, euler's say no axes: by --from only
SEARCHED = ("quaternion", "rpy", "axis_angle", "rotvec", "matrix", "mrp")
WITH_XYZ = ("axis_angle", "rotvec", "mrp")  # their columns look like a position with a prefix
SAME_COLUMNS = {"xyzw": "quaternion", "wxyz": "quaternion"}


class Columns(NamedTuple):
    """Columns that belong together: where they stand, in the order of their meaning, and what surrounds their names.

    unit: numbers a metre of a position; form: notation of a rotation; whole: the 16 of a homogeneous matrix
    """

    places: tuple[int, ...]
    names: tuple[str, ...]
    prefix: str = ""
    suffix: str = ""
    unit: float | None = None
    form: Notation | None = None
    whole: bool = False

    @property
    def shown(self) -> str:
        """Name the columns."""
        return " ".join(self.names)


class Pose(NamedTuple):
    """The columns of one point or pose."""

    position: Columns | None
    rotation: Columns | None


def find_positions(names: Sequence[str]) -> list[Columns]:
    """Return every three columns that can be a position."""
    found = []
    quaternions = {(each.prefix, each.suffix) for each in find_quaternions(names)}
    turns = {place for name in WITH_XYZ for each in _of_representation(name, names, None) for place in each.places}
    for base in POSITIONS:
        for places, prefix, suffix in _matches(base.split(), names):
            if (prefix, suffix) in quaternions or suffix.startswith(OTHER_UNITS) or turns.issuperset(places):
                continue
            unit = 1000.0 if suffix.startswith(MILLIMETRES) else 1.0
            found.append(_columns(places, names, prefix, suffix)._replace(unit=unit))
    telling = [each for each in found if any(word in each.prefix.lower() for word in TELLING)]
    return telling or found


def find_quaternions(names: Sequence[str], *, bare: bool = False) -> list[Columns]:
    """Return quaternions written x y z w under a common prefix or suffix; without either only if `bare`."""
    form = notation("quaternion")
    matches = _matches(["x", "y", "z", "w"], names)
    return [
        _columns(*match[:1], names, *match[1:])._replace(form=form) for match in matches if bare or match[1] or match[2]
    ]


def find_rotations(names: Sequence[str], given: Notation | None) -> list[Columns]:
    """Return every set of columns that can be a rotation, of the given notation if there is one."""
    searched = SEARCHED if given is None else (SAME_COLUMNS.get(given.representation.name, given.representation.name),)
    found = [each for name in searched for each in _of_representation(name, names, given)]
    if "quaternion" in searched:
        found += find_quaternions(names, bare=given is not None)
    if "matrix" in searched:
        found += [
            _columns(places, names, prefix, suffix)._replace(form=notation("matrix"), whole=True, unit=1.0)
            for places, prefix, suffix in _matches(WHOLE, names)
        ]
    return found


def _of_representation(name: str, names: Sequence[str], given: Notation | None) -> Iterator[Columns]:
    """Find a representation's columns, with the unit in the angles' names and without."""
    row = REPRESENTATIONS[name]
    for unit in ("_deg", "_rad", "") if row.angles else ("",):
        base = [column + unit * (index in row.angles) for index, column in enumerate(row.columns)]
        for places, prefix, suffix in _matches(base, names):
            if not unit and row.angles and suffix.startswith(("_deg", "_rad")):
                continue
            form = given if given is not None and row.angles and not unit else _with_unit(name, unit, given)
            yield _columns(places, names, prefix, suffix)._replace(form=form)


def _with_unit(name: str, unit: str, given: Notation | None) -> Notation:
    axes = f":{given.axes}" if given is not None and given.axes else ""
    return notation(f"{name}{unit}{axes}")


def _matches(base: Sequence[str], names: Sequence[str]) -> Iterator[tuple[tuple[int, ...], str, str]]:
    """Yield the places of columns called prefix + base + suffix for all of the base, with the affixes."""
    folded = [name.casefold() for name in names]
    where = {name: index for index, name in reversed(list(enumerate(folded)))}
    for index, name in enumerate(folded):
        start = name.find(base[0])
        while start >= 0:
            prefix, suffix = name[:start], name[start + len(base[0]) :]
            if where[name] == index and _is_set_off(prefix[-1:], suffix[:1]):
                places = [where.get(prefix + each + suffix, -1) for each in base]
                if min(places) >= 0:
                    yield tuple(places), names[index][:start], names[index][start + len(base[0]) :]
            start = name.find(base[0], start + 1)


def _is_set_off(before: str, after: str) -> bool:
    return not before.isalnum() and not after.isalnum()


def _columns(places: Sequence[int], names: Sequence[str], prefix: str = "", suffix: str = "") -> Columns:
    return Columns(tuple(places), tuple(names[place] for place in places), prefix, suffix)


def find_poses(names: Sequence[str], given: Notation | None, count: int, source: str) -> list[Pose]:
    """Find so many points or poses; raises FormatError that lists the candidates, or the columns there are."""
    positions, rotations = find_positions(names), find_rotations(names, given)
    if len(positions) <= 1 and len(rotations) <= 1 and count == 1:
        whole = rotations and rotations[0].whole
        pose = Pose(None if whole or not positions else positions[0], rotations[0] if rotations else None)
        if pose == (None, None):
            raise FormatError(
                f"no columns of a point or pose among: {', '.join(names)}; name them with --columns",
                source=source,
                line=1,
            )
        return [pose]
    poses = _paired(positions, rotations)
    if len(poses) == count:
        return poses
    wanted = "one pose" if count == 1 else "two poses"
    candidates = "; ".join(each.shown for each in (*positions, *rotations)) or f"none among {', '.join(names)}"
    raise FormatError(
        f"columns of {wanted} are wanted, found {candidates}; choose with --columns", source=source, line=1
    )


def _paired(positions: Sequence[Columns], rotations: Sequence[Columns]) -> list[Pose]:
    """Put each rotation with the position that shares most of its affixes."""
    if not rotations or not positions:
        return [Pose(each, None) for each in positions] + [Pose(None, each) for each in rotations]
    poses = []
    left = list(positions)
    for rotation in rotations:
        near = max(left, key=lambda position: _kinship(position, rotation), default=None)
        if rotation.whole or near is None:
            poses.append(Pose(None, rotation))
            continue
        left.remove(near)
        poses.append(Pose(near, rotation))
    poses += [Pose(each, None) for each in left]
    return sorted(poses, key=lambda pose: min(each.places[0] for each in pose if each is not None))


def _kinship(position: Columns, rotation: Columns) -> tuple[bool, int]:
    same = 0
    for a, b in zip(position.prefix, rotation.prefix, strict=False):
        if a != b:
            break
        same += 1
    return position.suffix == rotation.suffix, same


def named_pose(spec: str, names: Sequence[str] | None, width: int, given: Notation | None) -> Pose:
    """Take columns by name or by position from 1 (`2-8`): x y z, a rotation's, or first the one and then the other.

    Raises Misused for names that are not there, or a count that says nothing.
    """
    places = [place for word in spec.split(",") for place in _places(word.strip(), names, width)]
    shown = names or [f"column {place + 1}" for place in range(width)]
    if twice := sorted({shown[place] for place in places if places.count(place) > 1}):
        raise Misused(f"--columns: {', '.join(twice)} stands twice")
    position = _columns(places[:3], shown)._replace(unit=1000.0 if shown[places[0]].endswith(MILLIMETRES) else 1.0)
    if len(places) == 3 and given is None:
        found = find_rotations([shown[place] for place in places], None) if names else []
        return Pose(None, _columns(places, shown)._replace(form=found[0].form)) if found else Pose(position, None)
    if len(places) == 16 and (given is None or given.representation.name == "matrix"):
        return Pose(None, _columns(places, shown)._replace(form=notation("matrix"), whole=True, unit=1.0))
    form, size = _form_of(places, shown, given)
    rotation = _columns(places[-size:], shown)._replace(form=form)
    return Pose(position if len(places) == size + 3 else None, rotation)


def _form_of(places: Sequence[int], shown: Sequence[str], given: Notation | None) -> tuple[Notation, int]:
    """Settle the notation of chosen columns: as their names say, as told, or by their count where only one has it."""
    for count in (len(places), len(places) - 3):
        form = _form_by_names([shown[place] for place in places[-count:]] if count > 0 else [], given)
        if form is not None:
            return form, count
    if given is not None:
        size = len(given.representation.columns)
        if len(places) in (size, size + 3):
            return given, size
        raise Misused(
            f"--columns: {given.spec} takes {size} columns, or {size + 3} with x y z before them; found {len(places)}"
        )
    if len(places) == 7:
        return notation("xyzw"), 4
    raise Misused(f"--columns: {len(places)} columns do not say what they are; add --from REP")


def _form_by_names(chosen: Sequence[str], given: Notation | None) -> Notation | None:
    """Return the notation whose columns these are, in their order."""
    for name in (*SEARCHED, "wxyz", *([given.representation.name] if given else ())):
        axes = given if given is not None and given.representation.name == name else None
        for each in _of_representation(name, chosen, axes):
            if each.places == tuple(range(len(chosen))) and each.form is not None:
                return each.form
    return None


def _places(word: str, names: Sequence[str] | None, width: int) -> list[int]:
    """Return the places of a column's name, or of a number or range from 1."""
    if names and word in names:
        return [names.index(word)]
    first, dash, last = word.partition("-")
    if first.isdecimal() and (last.isdecimal() if dash else not last):
        low, high = int(first), int(last or first)
        if 1 <= low <= high <= width:
            return list(range(low - 1, high))
        raise Misused(f"--columns: {word} is not within 1-{width}")
    near = did_you_mean(word, names or ())
    raise Misused(f"--columns: no column {word!r}{near}; columns: {', '.join(names or [f'1-{width}'])}")
