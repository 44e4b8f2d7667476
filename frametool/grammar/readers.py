"""Small readers for values of documents, shared by all grammars; names of keys and columns of frames and stamps.

One table of names serves mappings, messages and headers of tables: a name has the same meaning everywhere.
"""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from frametool.errors import Finding, FormatError, Unanswered, ValueInvalid, shown, warn
from frametool.geometry import representations
from frametool.text.numbers import parse_length, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.documents.source import Source
    from frametool.geometry.place import Earth


Path = tuple[str | int, ...]  # keys and indices that lead to a value
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

AXES_KEY = "axes"  # a constant rotation by name instead of numbers; the axes at a position on the Earth
NAME_KEYS = ("child_frame_id", "child_frame", "child", "name")  # the frame whose pose it is
PARENT_NAMES = ("parent", "parent_frame_id", "parent_frame", "frame_id")  # the frame that it is expressed in
INDICES: tuple[Path, ...] = tuple((index,) for index in range(16))
PARENT_KEYS = (*PARENT_NAMES, "frame")  # the frame in which something is expressed
PARENT_COLUMNS = ("header.frame_id", *PARENT_KEYS)  # the header of a message has priority
# names of other tools for columns, and for keys with a single number
COLUMN_WORDS = {
    **{f"rvec_{axis}": f"rotvec_{axis}" for axis in "xyz"},
    **{f"{word}_{axis}": f"t{axis}" for word in ("tvec", "trans", "pos", "translation") for axis in "xyz"},
    **{f"{word}_{axis}": f"q{axis}" for word in ("qvec", "quat", "rot", "q") for axis in "xyzw"},
}
NORMALS: tuple[tuple[str, ...], ...] = (("normal_x", "normal_y", "normal_z"), ("nx", "ny", "nz"))
# velocities and rates of bodies; names such as velocity_x, twist.linear.x resemble a second position and are refused
RATES = r"(?i)((?:body[_.])?[vw])[xyz]([ _\[(].*)?"
RATE_KEYS = rf"{RATES}|(?:linear_|angular_)?velocity"  # of records
STAMP_KEYS = ("stamp_ns", "stamp", "timestamp", "time", "t")
NANOSECONDS = ("%time", "field.header.stamp")  # names that `rostopic echo -p` writes
# compiled at first use
_STAMP = r"(?i)[#% ]*+(?:.*[._])?(?:stamp|timestamp|time|t)(?:_[nmuµ]?s)?\s*(?:[\[(].*)?"
_UNIT = r"_([nmuµ]?s)$|[\[(]\s*+((?:\s*+[^\[\]()\s]++)*+)\s*+[\])]$"
_WHOLE_SECONDS = r"(|.*[._])(?:secs?|seconds)"
_UNITS = {"ns": 1, "us": 10**3, "µs": 10**3, "ms": 10**6} | dict.fromkeys(("s", "sec", "seconds", ""), 0)
_EARTH = r"(?:^|[^a-z])(?:lat(?:itude)?(?![a-z])|lla$|ecef|utm|easting|north|mgrs|at$)"
# fields of positions on the Earth, by key or column, including names of other tools
PLACE_FIELDS = {"lat": "lat", "latitude": "lat", "lon": "lon", "longitude": "lon", "lng": "lon", "long": "lon"}
PLACE_FIELDS |= {"alt": "alt", "altitude": "alt", "height": "alt", "hae": "alt", "utm_zone": "zone"}
PLACE_FIELDS |= dict.fromkeys(("msl", "ele", "elevation", "orthometric"), "msl")
PLACE_FIELDS |= dict.fromkeys(("undulation", "geoid_separation"), "undulation")
PLACE_KEYS = frozenset((
    "lat", "latitude", "lon", "longitude", "lng", "alt", "altitude", "ecef", "utm", "easting", "northing", "east",
    "north", "up", "down",
))  # fmt: skip
EARTH_FRAMES = representations.EARTH_FRAMES
FIX = "position_covariance"  # of a NavSatFix, along local east, north, up
# positions whose keys and columns are simply their names and numbers; the others have readers of their own
FLAT = {key: row.names for key, row in representations.POSITIONS.items() if key not in ("lla", "ecef", "utm")}
FLAT_KEYS = frozenset(names[0] for names in FLAT.values())  # which no other data have
_OTHERS = ("easting", "northing", "zone", "heading", "axes", "parent", "datum", "epsg", "mgrs")
PLACE_WORDS = PLACE_FIELDS | {"status.status": "status"} | {
    word: word for words in (_OTHERS, representations.POSITIONS["ecef"].columns, *FLAT.values()) for word in words
}  # fmt: skip


class Misfit(ValueInvalid):
    """A value that does not fit, with the keys and indices that lead to it from the value that was read."""

    def __init__(self, message: str, path: Path = (), *, key: bool = False, rule: str = "") -> None:
        """Store the path; `key` marks the last key itself as wrong, not its value."""
        super().__init__(message, rule=rule)
        self.path = path
        self.key = key

    def below(self, *outer: str | int) -> Misfit:
        """Return the same error with the path as seen from a higher level."""
        return type(self)(str(self), (*outer, *self.path), key=self.key, rule=self.rule)

    def placed(self, source: Source, *document: int) -> FormatError:
        """Return the error with line and column; the path begins at the top of `source`, or of a document of it."""
        from frametool.documents.document import format_error

        error = format_error(source, (*document, *self.path), str(self), key=self.key)
        error.rule = self.rule
        return answerable(error) if isinstance(self, Unclear) else error


class NotARotation(Misfit):
    """Numbers that could be read but are not a rotation, a covariance, or a pose."""


class Unclear(Misfit):
    """A value whose meaning has to be set by an option."""


def answerable(error: FormatError) -> Unanswered:
    """Convert an error into one that an option can resolve."""
    place = {"source": error.source, "line": error.line, "column": error.column, "snippet": error.snippet}
    return Unanswered(error.message, **place)  # type: ignore[arg-type]


class Reading:
    """The settings while a document is read: the unit of bare angles, the rules, and warnings."""

    __slots__ = ("bare_numbers", "degrees", "earth", "faults", "framed", "here", "normalize", "notes", "source")

    def __init__(
        self, source: Source, *, degrees: bool = False, normalize: bool = False,
        earth: Earth | None = None,
    ) -> None:  # fmt: skip
        """Start at the top of a document of `source`; `notes` collects warnings.

        earth: options for all positions on the Earth
        `bare_numbers` is set for formats of other tools, which have neither `90deg` nor `pi/2`.  `framed` is set if
        poses are those of frames: a frame on the Earth has axes even without a rotation.
        """
        self.source = source
        self.degrees = degrees
        self.normalize = normalize
        self.earth = earth
        self.bare_numbers = self.framed = False
        self.here: Path = ()
        self.notes: list[Finding] = []
        self.faults: list[Misfit] | None = None

    def refuse(self, misfit: Misfit) -> None:
        """Raise an error in one entry; or collect it in `faults`, for a reader that continues with the next entry."""
        if self.faults is None:
            raise misfit
        self.faults.append(misfit)

    def note(self, message: str, *path: str | int, rule: str = "odd") -> None:
        """Record a warning about a place below `here`."""
        self.notes.append(Finding(rule, message, path=(*self.here, *path)))

    def bare(self, name: str, *path: str | int) -> str:
        """Remove one leading `/` from a frame's name, as tf2 does, and note it."""
        if not is_slashed(name):
            return name
        self.note(slash_note(name), *path, rule="slash")
        return name[1:]


def tell(source: Source, notes: list[Finding], most: int = 10) -> None:
    """Emit the recorded warnings with their places, the same ones once; only count those beyond `most`."""
    if not notes:
        return
    from collections import Counter

    from frametool.documents.document import locate_many
    from frametool.documents.source import Pasted

    firsts: dict[str, Finding] = {}
    for note in notes:
        firsts.setdefault(alike(note), note)
    counts = Counter(map(alike, notes))
    shown_notes = list(firsts.values())[: most + (len(firsts) == most + 1)]
    places = locate_many(source.text, [note.path for note in shown_notes])
    for (line, column), note in zip(places, shown_notes, strict=True):
        place = ":".join(map(str, (source.name, *(() if isinstance(source, Pasted) else source.place(line, column)))))
        warn(f"{place}: {note.message}{more_like_it(counts.pop(alike(note)))}", rule=note.rule)
    if counts:
        warn(f"{source.name}: {counts.total()} more like these")


def alike(note: Finding) -> str:
    """Return the key of a warning; of all warnings with the same key only the first is emitted."""
    return str(note.rule if note.rule in ("slash", "identity", "rounded") else note.message)


def more_like_it(count: int) -> str:
    """Return the number of further places of a warning, if any."""
    return f" ({count - 1} more like it)" if count > 1 else ""


def is_slashed(name: str) -> bool:
    """Return True if a name begins with one `/`, which tf2 removes; in `/` and `//a` it is part of the name."""
    return name[:1] == "/" and name[1:2] not in ("", "/")


def slash_note(name: str) -> str:
    """Return the warning that a name lost its leading `/`."""
    return f"frame {shown(name)}: the leading / is no part of a name and was left out"


def within(path: Path, read: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Call a reader of a nested value; `path` is put before the path of its errors."""
    try:
        return read(*arguments, **options)
    except Misfit as misfit:
        raise misfit.below(*path) from None
    except ValueInvalid as error:
        made = NotARotation if error.rule else Misfit  # a rule of `check` about numbers
        raise made(str(error), path, rule=error.rule) from None


def kind(value: Any) -> str:
    """Return a description of a value for messages."""
    if value is None:
        return "nothing"
    if isinstance(value, dict):
        return "a mapping"
    return "a list" if isinstance(value, list) else shown(value)


def as_mapping(value: Any, what: str) -> dict[str, Any]:
    """Return a value that must be a mapping; otherwise raise an error that describes it."""
    if type(value) is not dict:
        from frametool.documents.document import explain_scalar

        hint = explain_scalar(value) if type(value) is str else None
        raise Misfit(f"expected {what}, found {kind(value)}" + (f"; {hint}" if hint else ""))
    return value


def read_number(value: Any) -> float:
    """Read one number."""
    if type(value) is not str:
        raise Misfit(f"expected a number, found {kind(value)}")
    return parse_number(value)


def places_in(value: list[Any]) -> Sequence[tuple[int, ...]]:
    """Return the paths of the numbers of a list, also if it is written as a column or a row of a matrix: [[x], ..]."""
    if not value or type(value[0]) is not list:
        return [*zip(range(len(value)))]
    if all(type(each) is list and len(each) == 1 for each in value):
        return [(at, 0) for at in range(len(value))]
    return [(0, at) for at in range(len(value[0]))] if len(value) == 1 else [(at,) for at in range(len(value))]


def read_texts(value: Any, names: Sequence[str], *, partial: bool = False) -> list[Any]:
    """Return the values of a list of fixed length, or of a mapping with these names, in their order.

    partial: missing names in a mapping are 0.
    """
    if type(value) is list:
        texts: list[Any] = value
        if value and type(value[0]) is list:
            texts = [value[path[0]][path[1]] if len(path) > 1 else value[path[0]] for path in places_in(value)]
        if len(texts) != len(names):
            raise Misfit(f"expected {len(names)} numbers ({' '.join(names)}), found {len(texts)}")
        return texts
    if type(value) is not dict:
        raise Misfit(f"expected [{', '.join(names)}], found {kind(value)}")
    if (*value,) == names:  # the common case: all names in their order
        return [*value.values()]
    for key in value:
        if key not in names:
            raise Misfit(f"unknown key {shown(key)}; expected {', '.join(names)}", (key,), key=True)
    if len(value) < len(names) and not partial:
        missing = ", ".join(name for name in names if name not in value)
        raise Misfit(f"missing {missing}; expected {', '.join(names)}")
    return [value.get(name, "0") for name in names]


def read_numbers(
    value: Any, names: Sequence[str], *, partial: bool = False, metres: bool = False
) -> tuple[float, ...]:
    """Read a list of fixed length, or a mapping with these names, as floats.

    metres: lengths in metres, which may have another unit: 10cm
    """
    texts = read_texts(value, names, partial=partial)
    try:
        return tuple(map(parse_number, texts))
    except (ValueInvalid, TypeError):
        places: Sequence[Path] = [(name,) for name in names] if type(value) is dict else places_in(value)
        return tuple(
            within(place, parse_length if metres and type(text) is str else read_number, text)
            for place, text in zip(places, texts, strict=True)
        )


# --- names of keys and columns ---


def in_nanoseconds(name: str) -> int:
    """Return the nanoseconds per unit of an integer, by its name: 1 for `stamp_ns`, `t [ns]`; 0 for seconds.

    Raises ValueInvalid for an unknown unit.
    """
    if name in NANOSECONDS:
        return 1
    found = re.search(_UNIT, name.lower())
    unit = (found[1] or found[2] or "") if found else ""
    if unit in _UNITS:
        return _UNITS[unit]
    raise ValueInvalid(f"{shown(name)}: unknown unit {shown(unit)} of a time; known are s, ms, us, ns")


def stamp_column(names: Iterable[str] | None) -> int | None:
    """Return the index of the first column that has the name of a stamp, in a known unit."""
    for at, name in enumerate(names or ()):
        if re.fullmatch(_STAMP, name):
            with suppress(ValueInvalid):
                in_nanoseconds(name)
                return at
    return None


def stamp_places(names: Iterable[str] | None) -> tuple[int | None, int | None]:
    """Return the index of the stamps as `stamp_column` does, or of whole seconds and of the nanoseconds."""
    known = tuple(names or ())
    if (found := stamp_column(known)) is not None:
        return found, None
    pairs = ((at, below) for at in range(len(known)) if (below := nanoseconds_beside(known, at)) is not None)
    return next(pairs, (None, None))


def nanoseconds_beside(names: Sequence[str], place: int) -> int | None:
    """Return the index of the nanoseconds for a column of whole seconds: `header.stamp.sec`, `..nanosec`."""
    found = re.fullmatch(_WHOLE_SECONDS, names[place].lower())
    folded = [name.lower() for name in names] if found else []
    wanted = [f"{found[1]}{part}" for part in ("nanosec", "nanosecs", "nsec", "nsecs", "nanoseconds")] if found else []
    return next((folded.index(name) for name in wanted if name in folded), None)


def may_be_on_earth(name: str) -> bool:
    """Return True if a key or column may be a position on the Earth: a latitude, ECEF, UTM, north."""
    return re.search(_EARTH, name.lower()) is not None or name in FLAT_KEYS


_SIGMAS = ("sigma_x", "sigma_y", "sigma_z", "sigma_r", "sigma_p")


def may_be_uncertain(name: str) -> bool:
    """Return True if a column may belong to a covariance, c11, or be a sigma: `sigma_yaw_deg`, `sigma_z [mm]`."""
    return name == "c11" or "covariance" in name or name.startswith(_SIGMAS)


def without_mark(name: str) -> str:
    """Return a column's name without a comment mark: `#timestamp [ns]` is the first column of EuRoC's files."""
    return name.lstrip("#% ") or name
