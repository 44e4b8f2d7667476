"""LZF, the compression of `binary_compressed` PCD files: unpacking only.

A control byte below 32 says how many bytes follow as they are, less one.  Else its upper three bits are a length less
two (seven: the next byte is added) and its lower five the upper bits of a distance less one, whose lower eight follow.
Source: liblzf, lzf_d.c.
"""

from __future__ import annotations

from frametool.errors import ValueInvalid

MOST = 88  # bytes that one packed byte may stand for: three make up to 264
_TORN = "it ends in the middle of a run"


def unpack(packed: bytes, size: int) -> bytearray:
    """Return the `size` bytes that were packed.

    Memory grows with what is there, never with `size`.
    Raises ValueInvalid for what was not packed so, or makes more or fewer bytes.
    """
    if size > MOST * len(packed):
        raise ValueInvalid(f"{len(packed)} packed bytes cannot hold {size}")
    out = bytearray()
    try:
        at = _unpack(packed, size, out)
    except IndexError:
        raise ValueInvalid(_TORN) from None
    if len(out) != size or at > len(packed):
        raise ValueInvalid(_TORN if at > len(packed) else f"it makes {_count(out, size)} bytes, not {size}")
    return out


def _count(out: bytearray, size: int) -> str:
    return f"only {len(out)}" if len(out) < size else f"at least {len(out)}"


def _unpack(packed: bytes, size: int, out: bytearray) -> int:
    """Append runs until all is read or too much is there; return where reading ended.  The hot loop."""
    at, end = 0, len(packed)
    while at < end and len(out) <= size:
        control = packed[at]
        at += 1
        if control < 32:
            next_at = at + control + 1
            out += packed[at:next_at]
            at = next_at
            continue
        length = control >> 5
        if length == 7:
            length += packed[at]
            at += 1
        length += 2
        distance = ((control & 31) << 8) + packed[at] + 1
        at += 1
        start = len(out) - distance
        if start < 0:
            raise ValueInvalid("it refers to what stands before its beginning")
        if distance >= length:
            out += out[start : start + length]
        else:  # the run overlaps what it makes
            part = out[start:]
            out += (part * (length // distance + 1))[:length]
    return at
