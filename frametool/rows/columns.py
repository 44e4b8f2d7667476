"""Find points and poses among the columns of a table by name: `x y z`, `qx qy qz qw`, `roll_deg ..`, with affixes.

A common prefix or suffix is separated from the name: `pose.qx`, `qx_left`, `field.pose.orientation.x`.  A unit follows
a name (`x_mm`, `roll_deg`) or is in brackets at its end (`x [mm]`, `yaw (rad)`).  Knows names only.
"""

from __future__ import annotations

import re
from collections import Counter
from copy import copy
from functools import lru_cache
from itertools import chain, product
from os.path import commonprefix
from typing import TYPE_CHECKING, Any

from frametool.errors import Misused, NamedTuple, ValueInvalid, alternatives, bare, first_of, shown
from frametool.geometry.representations import NAMED, ROTATIONS, UPPER_ROWS, Notation, Representation
from frametool.geometry.representations import notation as parse_notation
from frametool.grammar.readers import COLUMN_WORDS, NORMALS, PLACE_WORDS
from frametool.rows.shapes import POINT, POSE, SIX, TWIST, WRENCH, Shape, Unit, six_names
from frametool.text.numbers import ANGLES, BRACKETS, LENGTHS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.rows.request import Request

    Spot = tuple[int, str]  # a column's place, and the unit in its name

XYZ, BARE = ("x", "y", "z"), ("", "")
QUATERNION = (*XYZ, "w")
POSITIONS = (XYZ, ("tx", "ty", "tz"), ("px", "py", "pz"))
TELLING = ("position", "translation", "point", "vector")
FORCES = ("fx", "fy", "fz")
LETTERS = {
    TWIST: (("vx", "vy", "vz", "wx", "wy", "wz"),),
    WRENCH: ((*FORCES, "tx", "ty", "tz"), (*FORCES, "mx", "my", "mz")),
}
MOST_SHOWN, MOST_LISTED = 8, 40  # columns in a message
# after an underscore or a blank: the first group is supported, the second is refused
UNITS = re.compile(r"[_ ](deg|rad|mm|cm|um|m)(?![^\W_])|[_ ](km|in|ft|s|e7)$")
TOKEN = re.compile(r"[^\W_]+")

SIGMAS = [f"sigma_{part}" for part in ("xyz", "rpy", *XYZ, "roll", "pitch", "yaw")]  # without a prefix
WORDS = {word for row in ROTATIONS.values() for word in (*row.columns, *row.names, *row.alone) if word}.union(
    *POSITIONS, *(row.whole.columns for row in ROTATIONS.values() if row.whole)
)
NAMES_OF = {word: word for word in (*WORDS, *SIGMAS)} | COLUMN_WORDS | PLACE_WORDS  # the canonical name of each word
# x, y and z after these words are no position; STEMS are prefixes of the keys of a quaternion
WHOLE = {word for row in ROTATIONS.values() for word in row.columns}
WHOLE |= {word for word, name in COLUMN_WORDS.items() if name[0] != "t"}
STEMS = {word[:-1] for word, name in COLUMN_WORDS.items() if name[0] == "q"}
NAMES_OF |= {name.replace("_", mark): name for kind in LETTERS for name in six_names(kind) for mark in "_./"}
NAMES_OF |= {word: word for bases in LETTERS.values() for base in bases for word in base}
BY_TOKEN: dict[str, list[str]] = {}
for _word in sorted(NAMES_OF, key=len, reverse=True):
    BY_TOKEN.setdefault(re.split("[_./]", _word)[0], []).append(_word)


class Units(NamedTuple):
    """The units that the names of some columns may state.

    of: the quantity, for messages; known: the meaning of each unit
    never: columns with these units are something else
    """

    of: str
    known: Mapping[str, float | bool | None]
    never: frozenset[str] = frozenset()


NO_UNIT: dict[str, float | bool | None] = {"": None, "-": None, "1": None}
LENGTH = Units(  # units per metre
    f"of a length; known are {', '.join(filter(None, LENGTHS))}", LENGTHS, frozenset((*ANGLES, "s"))
)  # fmt: skip
ANGLE = Units("of an angle; known are deg, rad", NO_UNIT | ANGLES)  # True: degrees
NUMBER = Units("of a number that has none", NO_UNIT)
RATE = Units("of a velocity or a force", NO_UNIT, LENGTH.never.union(filter(None, LENGTHS)))


class Columns(NamedTuple):
    """Columns that belong together.

    places: their indices, in the order of their meaning; names: as in the header
    affixes: the common text before and after the names
    unit: of a position, in units per metre
    notation: of a rotation
    said: the meaning of the unit of each word that was looked for; None without a unit
    whole: they hold a whole pose, position and rotation
    absent: the indices of words without a column
    kind: twist or wrench, of six columns
    wrong: the error in the names, raised only if the columns are used
    """

    places: tuple[int, ...]
    names: tuple[str, ...]
    affixes: tuple[str, str] = BARE
    unit: Unit | None = None
    notation: Notation | None = None
    said: tuple[float | bool | None, ...] = ()
    whole: bool = False
    absent: tuple[int, ...] = ()
    kind: str = ""
    wrong: str = ""

    @property
    def shown(self) -> str:
        """Return the names for messages."""
        return " ".join(self.names)


class PoseColumns(NamedTuple):
    """The columns of one point or pose."""

    position: Columns | None
    rotation: Columns | None

    @property
    def places(self) -> tuple[int, ...]:
        """Return the indices of the columns of all numbers."""
        first = self.position.places if self.position else ()
        return first + self.rotation.places if self.rotation else first


class Header:
    """The names of a table's columns, parsed once: the known words in each, and its unit.

    found: for each pair of affixes and each word, the first column of each unit
    of_aircraft: phi, theta and psi are roll, pitch and yaw; theta alone would be a rotation about z
    """

    def __init__(self, names: Sequence[str], hidden: Collection[int] = ()) -> None:
        """Find the known words in all names but those of hidden columns."""
        names = ["" if at in hidden else name for at, name in enumerate(names)] if hidden else names
        self.names = names
        self.count = Counter(names)
        self.of_aircraft = {*TOKEN.findall(" ".join(names).lower())} >= {"phi", "theta", "psi"}
        self.found: dict[tuple[str, str], dict[str, dict[str, Spot]]] = {}
        for place, name in enumerate(names):
            own = name.lstrip("#% ") if place == 0 else name
            bracket = re.search(BRACKETS, own)
            bare = own[: bracket.start()] if bracket else own
            folded = bare.lower() if bare.isascii() else bare
            tokens = [(token.start(), word) for token in TOKEN.finditer(folded) for word in BY_TOKEN.get(token[0], ())]
            taken = 0
            for start, word in tokens:
                end = start + len(word)
                if start < taken or not folded.startswith(word, start) or folded[end : end + 1].isalnum():
                    continue
                taken = end if word in WHOLE or (word in SIGMAS and not start) else taken
                said = UNITS.match(folded, end)
                behind = said.end() if said else end
                before = end - 1 if word[:-1] in STEMS else start
                unit = _unit(bracket, said) or "rad" * word.startswith("rvec_")
                words = self.found.setdefault((bare[:before], bare[behind:]), {})
                words.setdefault(NAMES_OF[word], {}).setdefault(unit, (place, unit))

    def without(self, places: Collection[int]) -> Header:
        """Return a header without some of its columns; the others keep their places."""
        return Header(self.names, places) if places else self

    @property
    def has_pose(self) -> bool:
        """Return True if one of the columns may belong to a pose or a point."""
        return any(not WORDS.isdisjoint(words) for words in self.found.values())

    def spots(self, places: Iterable[int]) -> list[Spot | None]:
        """Return chosen columns with the units in their names."""
        found: list[Spot | None] = []
        for place in places:
            name = self.names[place].lower()
            ending = UNITS.match(name, name.replace(" ", "_").rfind("_"))
            found.append((place, _unit(re.search(BRACKETS, name), ending)))
        return found

    def match(
        self, base: Sequence[str], of: Units = NUMBER, angles: Sequence[int] = (), *, partly: bool = False
    ) -> Iterator[Columns]:
        """Yield the columns with all words of `base` under common affixes; if `partly`, those with only some of them.

        of: the units of all words but the angles.  Columns of one unit belong together; columns of several units belong
        together only if each word has a single one.
        """
        for affixes, group in self.found.items():
            if group.keys().isdisjoint(base) or (group.keys() >= {*base}) == partly:
                continue
            words = [group.get(word, {}) for word in base]
            alike = [spots for at, spots in enumerate(words) if spots and (of is not NUMBER or at in angles)]
            shared = [unit for unit in (alike[0] if alike else ()) if all(unit in spots for spots in alike)]
            units = shared or ("",)
            found = [[spots.get(unit) or next(iter(spots.values()), None) for spots in words] for unit in units]
            if len(alike) < len(base) and not partly:  # of angle and angle_deg take the one nearest to the axis
                spread = [max(filter(None, spots))[0] - min(filter(None, spots))[0] for spots in found]
                found = [spots for spots, size in zip(found, spread, strict=True) if size == min(spread)]
            for spots in found:
                if of.never.isdisjoint(spot[1] for spot in spots if spot):
                    yield self.columns(spots, of, angles, affixes)

    def columns(
        self, spots: Sequence[Spot | None], of: Units = NUMBER, angles: Sequence[int] = (),
        affixes: tuple[str, str] = BARE,
    ) -> Columns:  # fmt: skip
        """Return the columns found for some words under some affixes, with their units."""
        places, _ = zip(*filter(None, spots), strict=True)
        names, said, absent, wrong = tuple(map(self.names.__getitem__, places)), list[Any](), list[int](), ""
        for at, spot in enumerate(spots):
            units = ANGLE if at in angles else of
            said.append(units.known.get(spot[1]) if spot else None)
            if spot is None:
                absent.append(at)
            elif spot[1] not in units.known and not wrong:
                wrong = f"column {shown(self.names[spot[0]])}: unknown unit {shown(spot[1])} {units.of}"
        most = max(names, key=self.count.__getitem__)
        if self.count[most] > 1:
            wrong = f"column {most} appears twice; choose by number with --columns"
        unit: Unit | None = None
        if of is LENGTH:
            x, y, z = [1.0 if size is None else size for size in said]
            unit = x if x == y == z else (x, y, z)
        return Columns(places, names, affixes, unit, said=tuple(said), absent=tuple(absent), wrong=wrong)

    def is_plain(self, match: Columns) -> bool:
        """Return True if a column has no affix or those of a position: `yaw`, `pose.yaw`, but not `yaw_rate`."""
        return match.affixes == BARE or not {base[0] for base in POSITIONS}.isdisjoint(self.found[match.affixes])

    def is_map(self, match: Columns) -> bool:
        """Return True if x, y, z, w are a quaternion: under affixes, or if there are no other columns."""
        return match.affixes != BARE or len(self.names) == len(QUATERNION)


def _unit(bracket: re.Match[str] | None, said: re.Match[str] | None) -> str:
    """Return the unit in brackets, else the one after an underscore."""
    return bracket[1].lower() if bracket else (said[1] or said[2]) if said else ""


def has_pose_column(names: Iterable[str]) -> bool:
    """Return True if one of the names may be that of a column of a pose or a point."""
    return Header(list(names)).has_pose


def find_positions(header: Header) -> list[Columns]:
    """Return all triples of columns that can be a position."""
    found = dict[tuple[int, ...], Columns]()
    for match in chain.from_iterable(header.match(base, LENGTH) for base in POSITIONS):
        if not (header.is_map(match) and header.found[match.affixes].keys() >= {*QUATERNION}):
            found.setdefault(match.places, match)
    every = [*found.values()]
    return [each for each in every if any(word in each.affixes[0].lower() for word in TELLING)] or every


def find_rotations(header: Header, expected: Notation | None) -> list[Columns]:
    """Return all sets of columns that can be a rotation, of the expected notation if there is one."""
    rows, found = _searched(expected), dict[frozenset[int], Columns]()
    for row in rows:
        named = header.match(row.names if row.shape == NAMED else ())
        whole = header.match(row.whole.columns if row.whole else ())
        maps = (each for each in named if expected or header.is_map(each))
        for match in chain(header.match(row.columns, angles=row.angles), maps, whole):
            found[frozenset(match.places)] = rotation_of(match, row, expected)
    alone = list[Columns]()  # single columns that suffice if the others are absent: `yaw`, `theta`
    for kind, word in () if found or header.of_aircraft else [(row, word) for row in rows for word in row.alone]:
        *others, _ = kind.columns
        for match in header.match((*others, word), angles=kind.angles, partly=True):
            if header.is_plain(match) and match.absent == tuple(range(len(others))):
                alone.append(rotation_of(match, kind, expected))
    return [*found.values()] or alone


SEARCHED = {frozenset(row.columns): row for row in reversed(ROTATIONS.values()) if row.searched}


def _searched(expected: Notation | None) -> list[Representation]:
    """Return the representations to look for; of those with the same columns the first."""
    own = expected.representation if expected else None
    return [*SEARCHED.values()][::-1] if own is None else [SEARCHED[frozenset(own.columns)] if own.searched else own]


def rotation_of(columns: Columns, row: Representation, expected: Notation | None) -> Columns:
    """Return columns with their notation, which has the unit of the angles if that is the same for all."""
    units = {columns.said[at] for at in row.angles if at not in columns.absent}
    suffix = "_deg" if units == {True} else "_rad" if units == {False} else ""
    axes = f":{expected.axes}" if expected is not None and expected.axes else ""
    is_expected = expected is not None and expected.representation is row and not suffix
    notation = expected if is_expected else parse_notation(f"{row.name}{suffix}{axes}")
    whole = row.whole is not None and len(columns.said) == len(row.whole.columns)
    return columns._replace(notation=notation, whole=whole, unit=1.0 if whole else None)


def find_poses(header: Header, expected: Notation | None, count: int) -> list[PoseColumns]:
    """Find `count` points or poses; raises ValueInvalid with the candidates, or with all columns."""
    positions, rotations = find_positions(header), find_rotations(header, expected)
    if len(positions) > 1:
        positions = [each for each in positions if each.names not in NORMALS]
    half = "" if rotations or count > 1 or len(positions) > 1 else _half_rotation(header, expected)
    if half or not (positions or rotations):
        none = f"no columns of a point or pose among: {listed(header.names)}; name them with --columns"
        raise ValueInvalid(half or none)
    return paired(header, positions, rotations, count)


@lru_cache(maxsize=256)  # records of one kind have the same keys
def plain_pose(names: tuple[str, ...], *, affixed: bool) -> PoseColumns:
    """Find the one point or pose among the keys of a record: without affixes, else if `affixed` under some.

    Raises ValueInvalid for several rotations or positions, and for an incomplete rotation.
    """
    header = copy(full := Header(names))
    header.found = {key: group for key, group in full.found.items() if key[0] in ("", *STEMS) and not key[1]}
    positions = find_positions(header) or (find_positions(full) if affixed else [])
    rotations = find_rotations(header, None) or (find_rotations(full, None) if affixed else [])
    if not rotations and (half := _half_rotation(header, None)):
        raise ValueInvalid(half)
    found = positions or rotations
    return paired(full if affixed else header, positions, rotations)[0] if found else PoseColumns(None, None)


def paired(
    header: Header, positions: Sequence[Columns], rotations: Sequence[Columns], count: int = 1
) -> list[PoseColumns]:
    """Pair each rotation with the position whose affixes are most similar, else with an incomplete position.

    Raises ValueInvalid if there are not `count` poses.
    """
    poses, left = list[PoseColumns](), positions
    for rotation in rotations:
        left, turned = [each for each in left if {*each.places}.isdisjoint(rotation.places)], rotation.affixes
        near = max(
            () if rotation.whole else left, default=None,
            key=lambda at: (at.affixes[1] == turned[1], len(commonprefix([at.affixes[0], turned[0]]))),  # noqa: RUF071
        )  # fmt: skip
        if near:
            left.remove(near)
        half = None if near or rotation.whole else _half_position(header, rotation)
        poses.append(PoseColumns(near or half, rotation))
    if len(poses) != count:
        poses += [PoseColumns(each, None) for each in left]
    if len(poses) != count or max(len(positions), len(rotations)) > count:
        found = "; ".join(each.shown for each in (*positions, *rotations)[:MOST_SHOWN])
        wanted = "one pose" if count == 1 else "two poses"
        raise ValueInvalid(f"columns of {wanted} are wanted, found {found}; choose with --columns")
    return sorted(poses, key=lambda pose: pose.places[0])


def _half_position(header: Header, rotation: Columns) -> Columns | None:
    """Return x, y with a rotation about z, a pose in the plane; other incomplete positions are errors if used."""
    for base in POSITIONS:
        for match in header.match(base, LENGTH, partly=True):
            if len(match.absent) > 1 or match.affixes not in (rotation.affixes, BARE):
                continue
            (at,) = match.absent
            if rotation.absent and base[at] == base[-1]:
                return match
            missing = f"half a position: {match.shown} without {base[at].join(match.affixes)}"
            return match._replace(wrong=f"{missing}; add what is missing, or choose with --columns")
    return None


def listed(names: Sequence[str]) -> str:
    """Return the names of the columns for messages, of very many only the first."""
    return first_of(names, MOST_LISTED, quote=bare)


def _half_rotation(header: Header, expected: Notation | None) -> str:
    """Return the message for a rotation that is incomplete or has unusual names; "" if there is none."""
    for row in ROTATIONS.values() if expected is None else ():
        if not row.searched and (match := next(header.match(row.columns, angles=row.angles), None)):
            return f"columns {match.shown} may be {row.name}; then add --from {row.spelling}"
    for match in header.match(QUATERNION) if expected is None else ():
        return f"{match.shown} may be a quaternion or a point and a number; add --from xyzw, or --columns of the three"
    for row in _searched(expected):
        for match in header.match(row.columns, angles=row.angles, partly=True):
            if len(match.places) > 1 or (row.alone and header.is_plain(match)):
                if len(match.places) == len(XYZ) and match.names[0].lower().endswith("rot_x"):
                    axes = "name them roll, pitch, yaw or rotvec_x, rotvec_y, rotvec_z"
                    return f"columns {match.shown} do not say what they are; {axes}"
                parts = ", ".join(row.columns[at].join(match.affixes) for at in match.absent)
                return f"half a rotation: {match.shown} without {parts}; add what is missing, or choose with --columns"
    folded = {name.lower(): name for name in reversed(header.names)} if expected is None else {}
    stems = [name[:-1] for name in folded if name[-1:] == "w" and len(name) > 1] + ["q", "q_"]
    for stem, letters in product(stems, ("xyzw", "0123", "1234")):  # names without a standard order: ox oy oz ow
        found = [folded[stem + letter] for letter in letters if stem + letter in folded]
        if len(found) == len(letters) and (stem, letters) != ("q", "xyzw"):
            return (
                f"no qx, qy, qz, qw: {' '.join(found)} look like a quaternion under other names; name them so, or "
                f"add --columns x,y,z,{','.join(found)} --from xyzw (or wxyz)"
            )
    return "phi, theta, psi: name them roll, pitch, yaw, or choose with --columns" if header.of_aircraft else ""


def find_six(header: Header, kind: str) -> Columns | None:
    """Find the columns of a twist or a wrench by the names of its parts; by the usual letters only if `kind` is set."""
    for each in [kind] if kind else LETTERS:
        for base in (six_names(each), *LETTERS.get(kind, ())):
            for match in header.match(base, RATE):
                if not match.affixes[1]:
                    return match._replace(kind=each, wrong="")
    return None


def row_shape(pose: PoseColumns, request: Request, kind: str) -> Shape:
    """Return the shape of a row from its columns; kind: the requested kind, "" to decide by the columns."""
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


# --- columns that are chosen ---


def chosen_pose(spec: str, names: Sequence[str] | None, width: int, request: Request, kind: str) -> PoseColumns:
    """Return the columns in `spec`, by name or by number from 1 (`2-8`): x y z, a rotation, or x y z and a rotation.

    kind: of --as; a twist or a wrench has six columns
    Raises Misused for names that do not exist, or a number of columns with no meaning.
    """
    header, places = places_named(spec, names, width)
    size, expected = len(places), request.rows.given
    if kind in SIX and size != len(six_names(kind)):
        raise Misused(f"--columns: a {kind} has six ({' '.join(six_names(kind))}); found {size}")
    if kind in SIX:
        return PoseColumns(header.columns(header.spots(places), RATE)._replace(kind=kind, wrong=""), None)
    for first in (0, len(XYZ), 2):
        rotation = named_rotation(header, places[first:], expected) if size > first else None
        if rotation and (first != 2 or rotation.absent):
            break
    else:
        if size not in by_count(expected):
            unsaid = f"{size} columns do not say what they are; add --from REP"
            raise Misused(f"--columns: {f'{expected.counted}; found {size}' if expected else unsaid}")
        first, notation = by_count(expected)[size]
        if notation is not None:
            row = notation.representation
            rotation = rotation_of(header.columns(header.spots(places[first:]), angles=row.angles), row, notation)
    position = [*header.spots(places[:first]), None][: len(XYZ)]
    return PoseColumns(header.columns(position, LENGTH) if first else None, rotation)


def named_rotation(header: Header, places: Sequence[int], expected: Notation | None) -> Columns | None:
    """Return the rotation that the chosen columns are by their names, in this order; None if they are not."""
    named = Header([header.names[place] for place in places])
    for each in [each for own in dict.fromkeys((expected, None)) for each in find_rotations(named, own)]:
        if each.places == tuple(range(len(places))):
            return each._replace(places=tuple(places), affixes=BARE)
    return None


def by_count(expected: Notation | None) -> dict[int, tuple[int, Notation | None]]:
    """Return, for each meaningful number of columns, how many are a position, and the notation of the others.

    Twelve are three rows of a pose only if a matrix is expected.
    """
    if expected is None:
        wholes = [parse_notation(row.name) for row in ROTATIONS.values() if row.whole]
        found: dict[int, tuple[int, Notation | None]] = {len(XYZ): (len(XYZ), None)}
    else:
        wholes = [expected, UPPER_ROWS] if expected.representation.whole else []
        size = len(expected.representation.columns)
        found = {size: (0, expected), len(XYZ) + size: (len(XYZ), expected)}
    return found | {len(row.whole.columns): (0, each) for each in wholes if (row := each.representation).whole}


def places_named(spec: str, names: Sequence[str] | None, width: int) -> tuple[Header, list[int]]:
    """Return the header, and the indices of columns chosen by names, numbers or ranges from 1."""
    numbers = {name: place for place, name in reversed([*enumerate(names or ())])}
    places = list[int]()
    for word in map(str.strip, spec.split(",")):
        found = re.fullmatch(r"(\d{1,18})(?:-(\d{1,18}))?", word, re.ASCII)
        if word in numbers:
            places.append(numbers[word])
        elif found is None:
            known = alternatives(word, numbers, "columns") if numbers else f"; columns: 1-{width}"
            raise Misused(f"--columns: no column {shown(word)}{known}")
        elif 1 <= int(found[1]) <= int(found[2] or found[1]) <= width:
            places += range(int(found[1]) - 1, int(found[2] or found[1]))
        else:
            raise Misused(f"--columns: {word} is not within 1-{width}")
    return Header(names or [f"column {place + 1}" for place in range(width)]), places
