"""Stamps: seconds as text to integer nanoseconds and back, by decimal arithmetic, never through a float."""

from __future__ import annotations

import re
from operator import index

from frametool.errors import ValueInvalid, shown, warn

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

BILLION = 1_000_000_000
_SECONDS = r"(?a)([-+]?)(\d*)(?:\.(\d*))?(?:[eE]([-+]?\d{1,3}))? ?(s|ms|us)?"
_BELOW = {None: 9, "s": 9, "ms": 6, "us": 3}  # decimals down to a nanosecond
_NANOSECONDS = r"(?a)([-+]?\d{1,30})ns"
# ISO 8601 with a zone; datetime does not parse fractions of more than six digits
_DATE = r"(?a)(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:[.,](\d{1,9})0*)? ?(Z|[-+]\d\d:?\d\d)"
SUFFIXES = {BILLION: "s", 10**6: "ms", 10**3: "us", 1: "ns"}
_OLDEST_NS, _NEWEST_NS = 946_684_800 * BILLION, 4_102_444_800 * BILLION  # the years 2000 and 2100


MOST_TIMES = 100_000_000  # of a range
FURTHEST_NS = 1 << 62  # differences of two such stamps fit into 64 bits; the year 2116


class NotATime(ValueInvalid):
    """A text that is not a time in any notation."""


def whole_stamp(stamp_ns: Any) -> int:
    """Return a stamp as an integer; raises ValueInvalid for a float, and for a stamp beyond the year 2116."""
    try:
        stamp = index(stamp_ns)
    except TypeError:
        raise ValueInvalid(f"a stamp is integer nanoseconds, found {shown(stamp_ns)}") from None
    if not -FURTHEST_NS < stamp < FURTHEST_NS:
        whole, below = divmod(stamp, BILLION)
        hint = "" if below or len(str(whole)) > 20 else f" then write {whole}ns"
        raise ValueInvalid(f"stamp {shown(stamp)} ns is beyond the year 2116; are these nanoseconds?{hint}")
    return stamp


def parse_stamp(text: str) -> int:
    """Read `12.5` (seconds), `500ms`, `12500000000ns` or `2024-05-01T12:00:00Z` as nanoseconds; raises ValueInvalid.

    Fractions of a nanosecond, which programs print that store time in floats, are rounded, halves to even.
    """
    if match := re.fullmatch(_NANOSECONDS, text):
        return int(match[1])
    if match := re.fullmatch(_DATE, text):
        from datetime import datetime

        zone = "+00:00" if match[3] == "Z" else match[3]
        try:
            seconds = datetime.fromisoformat(match[1] + zone).timestamp()  # an integer: exact
        except ValueError as error:
            raise NotATime(f"{shown(text)} is not a time: {error}") from None
        return int(seconds) * BILLION + int((match[2] or "").ljust(9, "0"))
    match = re.fullmatch(_SECONDS, text)
    if match is None or not (match[2] or match[3]) or len(text) > 60:
        raise NotATime(f"{shown(text)} is not a time; write decimal seconds (12.5) or nanoseconds (12500000000ns)")
    sign, whole, fraction, exponent = match[1], match[2], match[3] or "", int(match[4] or 0)
    shift = _BELOW[match[5]] - len(fraction) + exponent
    digits = int(whole + fraction)
    if shift < 0:
        digits, lost = divmod(digits, each := int(10**-shift))
        digits, shift = digits + (2 * lost + digits % 2 > each), 0
    stamp_ns = digits * int(10**shift)
    return -stamp_ns if sign == "-" else stamp_ns


def parse_time(text: str) -> int:
    """Read a time as `parse_stamp` does, within the range of valid stamps."""
    return whole_stamp(parse_stamp(text.strip()))


def parse_times(text: str) -> Sequence[int]:
    """Read START:STOP:STEP, where STOP is included if a step meets it, or T,T,..; raises ValueInvalid."""
    is_range = text.count(":") == 2
    try:
        times = list(map(parse_time, text.split(":" if is_range else ",")))
    except ValueInvalid as error:
        hint = "times are T,T,.. in seconds, START:STOP:STEP, or a file"
        hint = "a range is START:STOP:STEP in seconds" if is_range else hint
        raise ValueInvalid(f"{error}; {hint}") from None
    if not is_range:
        return times
    start, stop, step = times
    if step <= 0 or stop < start:
        raise ValueInvalid("STEP must be positive and STOP not before START")
    if (stop - start) // step >= MOST_TIMES:
        raise ValueInvalid(f"more than {MOST_TIMES} times")
    return range(start, stop + 1, step)


def nanoseconds_each(whole: Any) -> Any:
    """Return the nanoseconds per unit of an integer, or of each element of an array, inferred from its size.

    Units are seconds, unless in a smaller unit the number is a time between the years 2000 and 2100.
    """
    sizes = (size for size in SUFFIXES if size != BILLION)
    return BILLION + sum(
        (size - BILLION) * ((whole >= _OLDEST_NS // size) & (whole < _NEWEST_NS // size)) for size in sizes
    )


def tell_size(whole: int, each: int) -> None:
    """Warn, once per command, that the unit of stamps is inferred from their size."""
    if each != BILLION:
        unit = SUFFIXES[each]
        message = f"stamps such as {whole} are taken for {unit}, by their size; a column stamp_{unit} says so"
        warn(message, rule="by-size")


class FromFirst:
    """An addend for stamps, nanoseconds or arrays of them, that shifts the first of all to 0."""

    __array_ufunc__ = None  # numpy leaves the sum to __radd__

    def __init__(self) -> None:
        """Wait for the first stamp."""
        self._first: int | None = None

    def __radd__(self, stamps: Any) -> Any:
        """Return stamps relative to the first."""
        if self._first is None:
            if getattr(stamps, "size", 1) == 0:
                return stamps
            self._first = int(stamps if isinstance(stamps, int) else stamps[0])
        return stamps - self._first


def format_stamp(stamp_ns: int) -> str:
    """Write nanoseconds as seconds with nine decimals: `12.500000000`."""
    sign = "-" if stamp_ns < 0 else ""
    seconds, nanoseconds = divmod(abs(stamp_ns), BILLION)
    return f"{sign}{seconds}.{nanoseconds:09d}"


def read_header_stamp(seconds: str, nanoseconds: str) -> int:
    """Read the two numbers of a header's stamp as nanoseconds; raises ValueInvalid."""
    whole, below = (text.strip(" \t\"'") for text in (seconds, nanoseconds))
    if not (whole.lstrip("+-").isdecimal() and below.isdecimal()):
        raise ValueInvalid(f"a stamp is two whole numbers, found {shown(whole)} and {shown(below)}")
    return int(whole) * BILLION + int(below)


def read_stamp(text: str, *, in_ns: int) -> int:
    """Parse a cell to nanoseconds, ignoring quotes and blanks around it; raises ValueInvalid.

    in_ns: nanoseconds per unit, as the column's name states; 0: seconds, or the unit that a whole number's size implies
    """
    bare = text.strip(" \t\"'")
    if in_ns and not bare.endswith("ns"):
        if not bare.lstrip("+-").replace(".", "", in_ns > 1).isdecimal():
            unit = "integer nanoseconds" if in_ns == 1 else SUFFIXES[in_ns]
            raise ValueInvalid(f"{shown(bare)} is not a time in {unit}")
        bare += SUFFIXES[in_ns]
    elif bare.isdecimal() and len(bare) < 20:
        each = nanoseconds_each(int(bare))
        tell_size(int(bare), each)
        bare += SUFFIXES[each]
    stamp_ns = parse_stamp(bare)
    if abs(stamp_ns) >= 1 << 63:
        is_whole = bare.rstrip("s").isdecimal()
        remedy = "; are these some? then write "
        remedy += "ns behind them, or call them stamp_ns" if is_whole else "whole numbers, without point or exponent"
        raise ValueInvalid(f"{shown(text.strip())} is beyond 64 bits of nanoseconds{remedy}")
    return stamp_ns


def stamp_text(written: str, stamp_ns: int, *, in_ns: int) -> str:
    """Format a stamp in the notation of `written`: whole units, or seconds with at least as many decimals."""
    bare = written.strip()
    if bare.endswith("ns"):
        return f"{stamp_ns}ns"
    if in_ns and not bare.endswith("s"):
        whole, below = divmod(abs(stamp_ns), in_ns)
        decimals = f"{below:0{len(str(in_ns)) - 1}d}".rstrip("0") if below else ""
        return f"{'-' * (stamp_ns < 0)}{whole}" + f".{decimals}" * bool(below)
    seconds, _, decimals = format_stamp(stamp_ns).partition(".")
    wanted = 0 if bare.endswith("s") or ":" in bare or "e" in bare.lower() else len(bare.partition(".")[2])
    decimals = decimals.rstrip("0").ljust(wanted, "0")
    return f"{seconds}.{decimals}" if decimals else seconds
