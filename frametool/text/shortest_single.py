"""Floats of 32 bits to the shortest text that reads back to the same 32 bits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from frametool.text.array_types import Floats

_DIGITS = (6, 7, 8, 9)  # six always differ from one float to the next, nine always tell them apart
_LEAST, _GREATEST = 1e-12, 1e20  # between them the power of ten is exact


def rounded_to_single(values: Floats) -> Floats:
    """Return the doubles with the fewest digits that are the same floats of 32 bits.

    values: any shape; each is rounded to 32 bits first.  Their shortest text as doubles is then the shortest text
    that a reader of 32 bits takes for the same float.  What is not finite stays.
    """
    single = values.astype(np.float32)
    exact = single.astype(np.float64).ravel()
    size = np.abs(exact)
    found = exact.copy()
    usual = np.flatnonzero((size >= _LEAST) & (size < _GREATEST))
    wanted = exact[usual]
    exponents = np.floor(np.log10(size[usual])).astype(np.int64)
    for digits in _DIGITS:
        places = digits - 1 - exponents
        up, down = 10.0 ** np.maximum(places, 0), 10.0 ** np.maximum(-places, 0)
        tried = np.rint(wanted * up / down) * down / up
        same = tried.astype(np.float32) == wanted.astype(np.float32)
        found[usual[same]] = tried[same]
        usual, wanted, exponents = usual[~same], wanted[~same], exponents[~same]
        if not usual.size:
            break
    odd = np.flatnonzero(np.isfinite(exact) & (size > 0) & ((size < _LEAST) | (size >= _GREATEST)))
    found[odd] = [float(str(value)) for value in single.ravel()[odd]]
    return found.reshape(values.shape)
