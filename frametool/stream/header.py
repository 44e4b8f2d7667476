"""Find points and poses among the columns of a table by name: `x y z`, `qx qy qz qw`, `roll_deg ..`, with affixes.

A common prefix or suffix is one that is set off: `pose.qx`, `qx_left`, `field.pose.orientation.x`. A unit is right
behind a name (`x_mm`, `roll_deg`) or in brackets at its end (`x [mm]`, `yaw (rad)`). Knows names only.
"""

from __future__ import annotations

import re
from collections import Counter
from copy import copy
from functools import lru_cache
from itertools import product
from os.path import commonprefix
from typing import TYPE_CHECKING, Any

from frametool.errors import FormatError, Misused, NamedTuple, ValueInvalid, alternatives, bare, first_of, shown
from frametool.geometry.representations import NAMED, REPRESENTATIONS, ROTATIONS, UPPER_ROWS, Notation, Representation
from frametool.geometry.representations import notation as parse_notation
from frametool.grammar.readers import COLUMN_WORDS, NORMALS
from frametool.stream.row_layout import POINT, POSE, SIX, TWIST, WRENCH, Shape, Unit, six_names
from frametool.text.numbers import ANGLES, BRACKETS, LENGTHS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from frametool.stream.request import Request

    Spot = tuple[int, str]  # a column's place, and the unit that its name says

XYZ = ("x", "y", "z")
POSITIONS = (XYZ, ("tx", "ty", "tz"), ("px", "py", "pz"))
TURNED = (  # x, y and z behind these are no position
    "rvec_", "qvec_", "quat_", "rot_", "euler_",
    *(column[:-1] for row in ROTATIONS.values() for column in row.columns if column.endswith("_x")),
)  # fmt: skip
TELLING = ("position", "translation", "point", "vector")
FORCES = ("fx", "fy", "fz")
LETTERS = {
    TWIST: (("vx", "vy", "vz", "wx", "wy", "wz"),),
    WRENCH: ((*FORCES, "tx", "ty", "tz"), (*FORCES, "mx", "my", "mz")),
}
NO_UNIT: dict[str, float | bool | None] = {"": None, "-": None, "1": None}
MOST_SHOWN, MOST_LISTED = 8, 40  # columns in a message
# behind an underscore: these are units of no length, and those are lengths that nobody should have to guess
UNITS = re.compile(r"_(deg|rad|mm|cm|um|m)(?![^\W_])|_(km|in|ft|s)$")
NO_LENGTHS = frozenset((*ANGLES, "s"))  # columns of these are no position
OUR_UNITS = NO_LENGTHS.union(filter(None, LENGTHS))  # of no velocity and no force
TOKEN = re.compile(r"[^\W_]+")


class Units(NamedTuple):
    """The units that the names of some columns may say: of what they are, and what each means."""

    of: str
    known: Mapping[str, float | bool | None]


LENGTH = Units(f"of a length; known are {', '.join(filter(None, LENGTHS))}", LENGTHS)  # numbers a metre
ANGLE = Units("of an angle; known are deg, rad", NO_UNIT | ANGLES)  # True: degrees
NUMBER = Units("of a number that has none", NO_UNIT)
UNITS_OF = {
    row.name: tuple(ANGLE if at in row.angles else NUMBER for at in range(len(row.columns)))
    for row in REPRESENTATIONS.values()
}  # fmt: skip


class Columns(NamedTuple):
    """Columns that belong together.

    places: where they are, in the order of their meaning; names: as the header writes them
    prefix, suffix: what surrounds the names
    unit: numbers a metre of a position
    notation: that of a rotation
    said: for each word that was looked for what its unit means, None where it says none
    units: those of the columns
    whole: the numbers of a whole pose
    absent: which words have no column
    kind: twist or wrench, of six columns
    wrong: what is wrong with the names, an error where the columns are used
    """

    places: tuple[int, ...]
    names: tuple[str, ...]
    prefix: str = ""
    suffix: str = ""
    unit: Unit | None = None
    notation: Notation | None = None
    said: tuple[float | bool | None, ...] = ()
    units: tuple[str, ...] = ()
    whole: bool = False
    absent: tuple[int, ...] = ()
    kind: str = ""
    wrong: str = ""

    @property
    def shown(self) -> str:
        """Name the columns."""
        return " ".join(self.names)


class PoseColumns(NamedTuple):
    """The columns of one point or pose."""

    position: Columns | None
    rotation: Columns | None

    @property
    def places(self) -> tuple[int, ...]:
        """Return where their numbers are."""
        first = self.position.places if self.position else ()
        return first + self.rotation.places if self.rotation else first


class Header:
    """The names of a table's columns, taken apart once: which words of ours each holds, and in which unit.

    found: by affixes and word the first column of each unit
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Look for the columns of all representations and positions in the names."""
        self.names = names
        self.count = Counter(names)
        self.found: dict[tuple[str, str], dict[str, dict[str, Spot]]] = {}
        self.affixes: dict[tuple[str, str], tuple[str, str]] = {}
        for place, name in enumerate(names):
            own = name.lstrip("#% ") if place == 0 else name
            bracket = re.search(BRACKETS, own)
            bare = own[: bracket.start()] if bracket else own
            folded = bare.lower() if bare.isascii() else bare
            tokens = [(token.start(), word) for token in TOKEN.finditer(folded) for word in BY_TOKEN.get(token[0], ())]
            for start, word in tokens:
                end = start + len(word)
                if not folded.startswith(word, start) or folded[end : end + 1].isalnum():
                    continue
                said = UNITS.match(folded, end)
                behind = said.end() if said else end
                key = folded[:start], folded[behind:]
                self.affixes.setdefault(key, (bare[:start], bare[behind:]))
                unit = _unit(bracket, said) or "rad" * word.startswith("rvec_")
                words = self.found.setdefault(key, {})
                words.setdefault(NAMES_OF[word], {}).setdefault(unit, (place, unit))

    def match(self, base: Sequence[str], units: Sequence[Units], *, partly: bool = False) -> Iterator[Columns]:
        """Yield the columns that have all words of a base under common affixes; `partly` those that have just some.

        units: those that each may have; columns of one unit belong together, and those of several only where each word
        has one column.
        """
        for key, found in self.found.items():
            if found.keys().isdisjoint(base) or (found.keys() >= {*base}) == partly:
                continue
            words = [found.get(word, {}) for word in base]
            alike = [spots for spots, each in zip(words, units, strict=True) if spots and each is not NUMBER]
            shared = [unit for unit in (alike[0] if alike else ()) if all(unit in spots for spots in alike)]
            for unit in shared or ("",):
                yield self.columns([spots.get(unit) or next(iter(spots.values()), None) for spots in words], units, key)

    def columns(
        self, spots: Sequence[Spot | None], units: Sequence[Units], key: tuple[str, str] = ("", "")
    ) -> Columns:
        """Name the columns that were found for some words under some affixes, and read their units."""
        places, own = zip(*filter(None, spots), strict=True)
        names, said, absent, wrong = tuple(map(self.names.__getitem__, places)), list[Any](), list[int](), ""
        for at, (spot, (of, known)) in enumerate(zip(spots, units, strict=True)):
            said.append(known.get(spot[1]) if spot else None)
            if spot is None:
                absent.append(at)
            elif spot[1] not in known and not wrong:
                wrong = f"column {shown(self.names[spot[0]])}: unknown unit {shown(spot[1])} {of}"
        most = max(names, key=self.count.__getitem__)
        if self.count[most] > 1:
            wrong = f"column {most} appears twice; choose by number with --columns"
        affixes = self.affixes.get(key, key)
        return Columns(places, names, *affixes, said=tuple(said), units=own, absent=tuple(absent), wrong=wrong)

    def is_plain(self, match: Columns) -> bool:
        """Return True if a column has the affixes of a position, or no affix: `yaw`, `pose.yaw`, and not `yaw_rate`."""
        key = match.prefix.lower(), match.suffix.lower()
        return key == ("", "") or not {base[0] for base in POSITIONS}.isdisjoint(self.found.get(key, ()))


WORDS = {word for row in ROTATIONS.values() for word in (*row.columns, *row.names, *row.alone) if word}.union(
    *POSITIONS, *(row.whole.columns for row in ROTATIONS.values() if row.whole)
)
NAMES_OF = {word: word for word in WORDS} | COLUMN_WORDS  # what each word is called here
NAMES_OF |= {name.replace("_", mark): name for kind in LETTERS for name in six_names(kind) for mark in "_./"}
NAMES_OF |= {word: word for bases in LETTERS.values() for base in bases for word in base}
BY_TOKEN: dict[str, list[str]] = {}
for _word in sorted(NAMES_OF):
    BY_TOKEN.setdefault(re.split("[_./]", _word)[0], []).append(_word)


def has_pose_column(names: Iterable[str]) -> bool:
    """Return True if one of some names is that of a column of a pose or a point."""
    return any(not WORDS.isdisjoint(words) for words in Header(list(names)).found.values())


def find_positions(header: Header) -> list[Columns]:
    """Return every three columns that can be a position."""
    named = {(match.prefix, match.suffix) for match in _named_maps(header)}
    found: dict[tuple[int, ...], Columns] = {}
    for base in POSITIONS:
        for match in header.match(base, (LENGTH,) * 3):
            is_other = (match.prefix, match.suffix) in named or match.prefix.lower().endswith(TURNED)
            if not is_other and NO_LENGTHS.isdisjoint(match.units):
                found.setdefault(match.places, _position(match))
    every = [*found.values()]
    return [each for each in every if any(word in each.prefix.lower() for word in TELLING)] or every


def _position(columns: Columns) -> Columns:
    """Take the units of a position's columns, of which one may be absent."""
    x, y, z = [1.0 if said is None else said for said in columns.said]
    return columns._replace(unit=x if x == y == z else (x, y, z))


def find_rotations(header: Header, expected: Notation | None) -> list[Columns]:
    """Return every set of columns that can be a rotation, of the expected notation if there is one."""
    rows = _searched(expected)
    found: dict[frozenset[int], Columns] = {}  # qvec_w .. are found by either of two names
    for row in rows:
        named = _named_maps(header, bare=expected is not None) if row.shape == NAMED else ()
        for match in (*header.match(row.columns, UNITS_OF[row.name]), *named):
            found[frozenset(match.places)] = _rotation(match, row, expected)
        for match in header.match(row.whole.columns, (NUMBER,) * len(row.whole.columns)) if row.whole else ():
            found[frozenset(match.places)] = _rotation(match, row, expected)._replace(whole=True, unit=1.0)
    spread = [(max(each.places) - min(each.places) - len(each.places), each) for each in found.values()]
    best: dict[int, int] = {}  # where several share a column, an axis with an angle and an angle_deg, the nearest
    for size, each in spread:
        for place in each.places:
            best[place] = min(best.get(place, size), size)
    nearest = [each for size, each in spread if size <= min(map(best.__getitem__, each.places))]
    alone = list[Columns]()  # of columns that say one by themselves, where none of the others is there: `yaw`, `theta`
    for row in () if nearest else rows:
        last, units = len(row.columns) - 1, UNITS_OF[row.name]
        words = [(*[""] * last, word) for word in row.alone]
        lone = [each for base in words for each in header.match(base, units, partly=True) if header.is_plain(each)]
        if lone:
            others = header.match(row.columns, units, partly=True)
            affixes = {each[2:4] for each in others if {*each.absent} != {*range(last)}}
            alone += [_rotation(each, row, expected) for each in lone if each[2:4] not in affixes]
    return nearest or alone


SEARCHED = {frozenset(row.columns): row for row in reversed(ROTATIONS.values()) if row.searched}


def _searched(expected: Notation | None) -> list[Representation]:
    """Return the representations whose columns are looked for, of those that share their columns the first."""
    own = expected.representation if expected else None
    return [*SEARCHED.values()][::-1] if own is None else [SEARCHED[frozenset(own.columns)] if own.searched else own]


def _named_maps(header: Header, *, bare: bool = False) -> Iterator[Columns]:
    """Yield the columns called as the keys of a map, x y z w: with affixes, or alone, or where they may be `bare`."""
    words = ROTATIONS["quaternion"].names
    for match in header.match(words, UNITS_OF["quaternion"]):
        if bare or match.prefix or match.suffix or len(header.names) == len(words):
            yield match


def _rotation(columns: Columns, row: Representation, expected: Notation | None) -> Columns:
    """Take the notation that a rotation's columns say, with the unit of angles if they all have one."""
    units = {columns.said[at] for at in row.angles if at not in columns.absent}
    suffix = "_deg" if units == {True} else "_rad" if units == {False} else ""
    axes = f":{expected.axes}" if expected is not None and expected.axes else ""
    notation = expected if expected and row.angles and not suffix else parse_notation(f"{row.name}{suffix}{axes}")
    return columns._replace(notation=notation)


def find_poses(header: Header, expected: Notation | None, count: int, source: str) -> list[PoseColumns]:
    """Find so many points or poses; raises FormatError that lists the candidates, or the columns there are."""
    names, positions, rotations = header.names, find_positions(header), find_rotations(header, expected)
    if len(positions) > 1:
        positions = [each for each in positions if each.names not in NORMALS]
    reason = "" if rotations or count > 1 or len(positions) > 1 else _half_rotation(header, expected)
    poses = [] if reason else _paired(header, positions, rotations, count)
    if len(poses) == count and max(len(positions), len(rotations)) <= count:
        return sorted(poses, key=lambda pose: pose.places[0]) if count > 1 else poses
    wanted = "one pose" if count == 1 else "two poses"
    found = "; ".join(each.shown for each in (*positions, *rotations)[:MOST_SHOWN]) or f"none among {listed(names)}"
    if count == 1 and not (positions or rotations):
        reason = reason or f"no columns of a point or pose among: {listed(names)}; name them with --columns"
    reason = reason or f"columns of {wanted} are wanted, found {found}; choose with --columns"
    raise FormatError(reason, source=source, line=1)


def _paired(
    header: Header, positions: Sequence[Columns], rotations: Sequence[Columns], count: int
) -> list[PoseColumns]:
    """Put each rotation with the position that shares most of its affixes, or with the half of one that is there."""
    poses, left = list[PoseColumns](), positions
    for rotation in rotations:
        left = [each for each in left if {*each.places}.isdisjoint(rotation.places)]
        near = max(
            () if rotation.whole else left, default=None,
            key=lambda at: (at.suffix == rotation.suffix, len(commonprefix([at.prefix, rotation.prefix]))),  # noqa: RUF071
        )  # fmt: skip
        if near:
            left.remove(near)
        half = None if near or rotation.whole else _half_position(header, rotation)
        poses.append(PoseColumns(near or half, rotation))
    return poses if len(poses) == count else [*poses, *(PoseColumns(each, None) for each in left)]


@lru_cache(maxsize=256)  # records of one kind have the same keys
def plain_pose(names: tuple[str, ...], *, affixed: bool) -> PoseColumns:
    """Find the one point or pose among the keys of a record: without affixes, else under some if it may be `affixed`.

    Raises ValueInvalid for several rotations or positions, and for a rotation that is there by half.
    """
    header, bare = copy(full := Header(names)), ("", "")
    header.found = {bare: full.found.get(bare, {})}
    positions = find_positions(header) or (find_positions(full) if affixed else [])
    rotations = find_rotations(header, None) or (find_rotations(full, None) if affixed else [])
    for what, found in (("rotation", rotations), ("position", positions)):
        if len(found) > 1:
            raise ValueInvalid(f"expected one {what}, found {' and '.join(each.shown for each in found)}")
    if not rotations and (half := _half_rotation(header, None)):
        reason = half.partition(", or add --")[0]
        raise ValueInvalid(reason.replace("choose with --columns", "leave it out").replace("columns", "keys"))
    return next(iter(_paired(full if affixed else header, positions, rotations, 1)), PoseColumns(None, None))


def _half_position(header: Header, rotation: Columns) -> Columns | None:
    """Return x, y with a turn about z, a pose in the plane; other parts of a position are wrong if they are used."""
    affixes = ((rotation.prefix, rotation.suffix), ("", ""))
    for base in POSITIONS:
        for match in header.match(base, (LENGTH,) * 3, partly=True):
            if len(match.absent) > 1 or (match.prefix, match.suffix) not in affixes:
                continue
            (at,), columns = match.absent, _position(match)
            if not rotation.absent or base[at] != base[-1]:
                missing = f"half a position: {columns.shown} without {match.prefix}{base[at]}{match.suffix}"
                columns = columns._replace(wrong=f"{missing}; add what is missing, or choose with --columns")
            return columns
    return None


def listed(names: Sequence[str]) -> str:
    """List the columns there are, the first of very many."""
    return first_of(names, MOST_LISTED, quote=bare)


def _half_rotation(header: Header, expected: Notation | None) -> str:
    """Return what is missing of a rotation that is there by half, or goes by other names; "" if absent."""
    for row in ROTATIONS.values() if expected is None else ():
        if not row.searched and (match := next(header.match(row.columns, UNITS_OF[row.name]), None)):
            return f"columns {match.shown} may be {row.name}; then add --from {row.spelling}"
    for match in _named_maps(header, bare=True) if expected is None else ():
        may_be = f"{match.shown} may be a quaternion or a point and a number"
        return f"{may_be}; add --from xyzw, or --columns with the three"
    for match in header.match(XYZ, (LENGTH,) * 3) if expected is None else ():
        if match.prefix.lower().endswith("rot_"):
            axes = "name them roll, pitch, yaw or rotvec_x, rotvec_y, rotvec_z"
            return f"columns {match.shown} do not say what they are; {axes}"
    for row in _searched(expected):
        for match in header.match(row.columns, UNITS_OF[row.name], partly=True):
            if len(match.places) > 1 or (row.alone and header.is_plain(match)):
                missing = ", ".join(f"{match.prefix}{row.columns[at]}{match.suffix}" for at in match.absent)
                half = f"half a rotation: {match.shown} without {missing}"
                return f"{half}; add what is missing, or choose with --columns"
    folded = {name.lower(): name for name in reversed(header.names)} if expected is None else {}
    stems = [name[:-1] for name in folded if name[-1:] == "w" and len(name) > 1] + ["q", "q_"]
    for stem, letters in product(stems, ("xyzw", "0123", "1234")):  # names that nobody has agreed upon: ox oy oz ow
        found = [folded[stem + letter] for letter in letters if stem + letter in folded]
        if len(found) == len(letters) and (stem, letters) != ("q", "xyzw"):
            return (
                f"no qx, qy, qz, qw: {' '.join(found)} look like a quaternion under other names; name them so, or "
                f"add --columns x,y,z,{','.join(found)} --from xyzw (or wxyz)"
            )
    return ""


def find_six(header: Header, kind: str) -> Columns | None:
    """Find the columns of a twist or a wrench, by the words of its parts; by usual letters only where asked."""
    for each in [kind] if kind else LETTERS:
        for base in (six_names(each), *LETTERS.get(kind, ())):
            for match in header.match(base, (NUMBER,) * 6):
                if not match.suffix and OUR_UNITS.isdisjoint(match.units):
                    return match._replace(kind=each, wrong="")
    return None


def row_shape(pose: PoseColumns, request: Request, kind: str) -> Shape:
    """Return what the numbers of a pose's columns mean; kind: what they are taken for, "" as they look."""
    position, rotation = pose
    if position and position.kind:
        if not request.operation.moves:
            raise Misused(f"a {position.kind} cannot be taken for a pose; apply moves it")
        return Shape(position.kind, None)
    unit = position.unit if position and not (rotation and rotation.whole) else None
    if rotation is None or rotation.notation is None:
        moved = request.operation.takes_points and kind != POSE
        return Shape((kind or POINT) if moved else POSE, unit)
    if kind not in ("", POSE) and request.operation.moves:
        raise Misused(
            f"rows have a rotation, {rotation.shown}, and cannot be taken for a {kind}; "
            "name the three with --columns"
        )
    notation = rotation.notation
    angles = notation.representation.angles
    said = [notation.in_degrees(request.rows.degrees) if each is None else each for each in rotation.said]
    degrees = any(said[at] for at in angles if at not in rotation.absent)
    radians_at = tuple(at for at in angles if degrees and not said[at])
    first = 0 if unit is None else len(XYZ)
    absent = (*(position.absent if position else ()), *(first + at for at in rotation.absent))
    return Shape(POSE, unit, ((notation, degrees),), rotation.whole, radians_at=radians_at, absent=absent)


def named_pose(spec: str, names: Sequence[str] | None, width: int, request: Request, kind: str) -> PoseColumns:
    """Take columns by name or by position from 1 (`2-8`): x y z, a rotation's, or first the one and then the other.

    kind: what --as says; a twist or a wrench has six.

    Raises Misused for names that are not there, or a count that says nothing.
    """
    called, places = places_named(spec, names, width)
    if kind in SIX and len(places) != 6:
        raise Misused(f"--columns: a {kind} has six ({' '.join(six_names(kind))}); found {len(places)}")
    if kind in SIX:
        return PoseColumns(Columns(tuple(places), tuple(called[place] for place in places), kind=kind), None)
    header = Header(called)
    count, rotation = _chosen_rotation(header, places, request.rows.given)
    if count == len(places):
        return PoseColumns(None, rotation)
    return PoseColumns(_position(_chosen(header, places[: len(places) - count], (LENGTH,) * 3)), rotation)


def wholes_of(expected: Notation | None) -> list[Notation]:
    """Return the notations whose numbers may be those of a whole pose: without names twelve need a word for it."""
    if expected is not None:
        return [expected, *([UPPER_ROWS] if expected.representation.whole else [])]
    return [parse_notation(row.name) for row in ROTATIONS.values() if row.whole]


def _chosen(header: Header, places: Sequence[int], units: Sequence[Units]) -> Columns:
    """Take columns as they were chosen, with the units that their names say; the last may be absent."""
    names = [header.names[place] for place in places]
    said = [(re.search(BRACKETS, name), UNITS.match(name.lower(), max(name.rfind("_"), 0))) for name in names]
    spots = [(place, _unit(*each)) for place, each in zip(places, said, strict=True)]
    return header.columns([*spots, *[None] * (len(units) - len(spots))], units)


def _unit(bracket: re.Match[str] | None, said: re.Match[str] | None) -> str:
    """Return the unit that is in brackets, else that behind an underscore."""
    return bracket[1].lower() if bracket else (said[1] or said[2]) if said else ""


def _chosen_rotation(header: Header, places: Sequence[int], expected: Notation | None) -> tuple[int, Columns | None]:
    """Return how many of the chosen columns, from the last, are a rotation, and which: by name, as set, by count."""
    size = len(places)
    for count in (size, size - 3, size - 2):
        last = places[-count:] if count > 0 else []
        named = Header([header.names[place] for place in last])
        for each in [each for own in dict.fromkeys((expected, None)) for each in find_rotations(named, own)]:
            if each.places == tuple(range(count)) and (count != size - 2 or each.absent):
                return count, each._replace(places=tuple(last), prefix="", suffix="")
    if expected is None and size == len(XYZ):
        return 0, None
    for notation in wholes_of(expected):
        row = notation.representation
        if row.whole and size == len(row.whole.columns):
            found = _rotation(_chosen(header, places, (NUMBER,) * size), row, expected)
            return size, found._replace(whole=True, unit=1.0, notation=notation)
    if expected is None:
        raise Misused(f"--columns: {size} columns do not say what they are; add --from REP")
    if size not in expected.counts:
        raise Misused(f"--columns: {expected.counted}; found {size}")
    row, size = expected.representation, len(expected.representation.columns)
    return size, _rotation(_chosen(header, places[-size:], UNITS_OF[row.name]), row, expected)


def places_named(spec: str, names: Sequence[str] | None, width: int) -> tuple[Sequence[str], list[int]]:
    """Return what columns are called, and the places of those that are chosen by names, numbers or ranges from 1."""
    numbers = {name: place for place, name in reversed([*enumerate(names or ())])}
    places = list[int]()
    for word in map(str.strip, spec.split(",")):
        first, dash, last = word.partition("-")
        is_range = first.isdecimal() and (last.isdecimal() if dash else not last) and len(word) < 40
        low, high = (int(first), int(last or first)) if is_range else (0, 0)
        if word in numbers:
            places.append(numbers[word])
        elif not is_range:
            known = alternatives(word, numbers, "columns") if numbers else f"; columns: 1-{width}"
            raise Misused(f"--columns: no column {shown(word)}{known}")
        elif 1 <= low <= high <= width:
            places += range(low - 1, high)
        else:
            raise Misused(f"--columns: {word} is not within 1-{width}")
    return names or [f"column {place + 1}" for place in range(width)], places
