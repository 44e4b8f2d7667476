"""Names of keys and columns: of frames in rows and records, of stamps, and the units of these.

One table for mappings, messages and headers of tables: a name means the same everywhere.
"""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid, shown
from frametool.geometry import representations
from frametool.grammar.readers import NAME_KEYS as NAME_KEYS  # noqa: PLC0414 - also from here
from frametool.grammar.readers import PARENT_NAMES

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

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
STAMP_KEYS = ("stamp_ns", "stamp", "timestamp", "time", "t")
NANOSECONDS = ("%time", "field.header.stamp")  # names that `rostopic echo -p` writes
# compiled at first use, not at start-up
_STAMP = r"(?i)[#% ]*+(?:.*[._])?(?:stamp|timestamp|time|t)(?:_[nmuµ]?s)?\s*(?:[\[(].*)?"
_UNIT = r"_([nmuµ]?s)$|[\[(]\s*+((?:\s*+[^\[\]()\s]++)*+)\s*+[\])]$"
_WHOLE_SECONDS = r"(|.*[._])(?:secs?|seconds)"
_UNITS = {"ns": 1, "us": 10**3, "µs": 10**3, "ms": 10**6} | dict.fromkeys(("s", "sec", "seconds", ""), 0)
_EARTH = r"(?:^|[^a-z])(?:lat(?:itude)?(?![a-z])|lla$|ecef|utm|easting|north|mgrs|at$)"
PLACE_KEYS = frozenset((
    "lat", "latitude", "lon", "longitude", "lng", "alt", "altitude", "ecef", "utm", "easting", "northing", "east",
    "north", "up", "down",
))  # fmt: skip
FIX = "position_covariance"  # of a NavSatFix, along local east, north, up
EARTH_FRAMES = representations.EARTH_FRAMES
# positions whose keys and columns are simply their names and numbers; the others have readers of their own
FLAT = {key: row.names for key, row in representations.POSITIONS.items() if key not in ("lla", "ecef", "utm")}
FLAT_KEYS = frozenset(names[0] for names in FLAT.values())  # which no other data have


def is_rate(key: str) -> bool:
    """Return True if a key of a record is that of a velocity or of turn rates."""
    return re.fullmatch(rf"{RATES}|(?:linear_|angular_)?velocity", key) is not None


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


def may_be_uncertain(name: str) -> bool:
    """Return True if a column may be the first of a covariance, c11, or a sigma: `sigma_yaw_deg`, `sigma_z [mm]`."""
    return name == "c11" or FIX in name or name.startswith(("sigma_x", "sigma_y", "sigma_z", "sigma_r", "sigma_p"))


def without_mark(name: str) -> str:
    """Return a column's name without a comment mark: `#timestamp [ns]` is the first column of EuRoC's files."""
    return name.lstrip("#% ") or name
