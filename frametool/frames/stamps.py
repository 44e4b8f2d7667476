"""Stamps: text of seconds to integer nanoseconds and back, by decimal arithmetic, never through a float."""

from __future__ import annotations

import re
from operator import index

from frametool.errors import ValueInvalid, shown

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

BILLION = 1_000_000_000
_SECONDS = r"(?a)([-+]?)(\d*)(?:\.(\d*))?(?:[eE]([-+]?\d{1,3}))? ?(s|ms|us)?"
_BELOW = {None: 9, "s": 9, "ms": 6, "us": 3}  # decimals down to a nanosecond
_NANOSECONDS = r"(?a)([-+]?\d{1,30})ns"


FURTHEST_NS = 1 << 62  # differences of two such stamps fit into 64 bits; the year 2116


class NotATime(ValueInvalid):
    """Report a text that is written in no way that a time is."""


def whole_stamp(stamp_ns: Any) -> int:
    """Check a stamp: an integer, never a float.

    Raises ValueInvalid.
    """
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
    """Read `12.5` (seconds), `500ms` or `12500000000ns` as nanoseconds; digits below a nanosecond must be 0.

    Raises ValueInvalid.
    """
    if match := re.fullmatch(_NANOSECONDS, text):
        return int(match[1])
    match = re.fullmatch(_SECONDS, text)
    if match is None or not (match[2] or match[3]) or len(text) > 60:
        raise NotATime(f"{shown(text)} is not a time; write decimal seconds (12.5) or nanoseconds (12500000000ns)")
    sign, whole, fraction, exponent = match[1], match[2], match[3] or "", int(match[4] or 0)
    shift = _BELOW[match[5]] - len(fraction) + exponent
    digits = int(whole + fraction)
    if shift < 0:
        digits, lost = divmod(digits, int(10**-shift))
        if lost:
            raise ValueInvalid(f"{shown(text)} is finer than a nanosecond; round it")
        shift = 0
    stamp_ns = digits * int(10**shift)
    return -stamp_ns if sign == "-" else stamp_ns


def format_stamp(stamp_ns: int) -> str:
    """Write nanoseconds as seconds with nine decimals: `12.500000000`."""
    sign = "-" if stamp_ns < 0 else ""
    seconds, nanoseconds = divmod(abs(stamp_ns), BILLION)
    return f"{sign}{seconds}.{nanoseconds:09d}"
