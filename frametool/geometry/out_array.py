"""Check and take apart the array a caller wants results in: the `out` of the public functions.

It may have any strides, and may lie where the input lies: the results are those of a fresh array all the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.types import Array, Components


def require_fitting(out: object, shape: tuple[int, ...]) -> None:
    """Raise ValueInvalid unless `out` is a numpy array of float64, writable and of this shape."""
    if not isinstance(out, np.ndarray):
        found = f"a {type(out).__name__}"
    elif out.dtype != np.float64:
        found = f"one of {out.dtype}"
    elif out.shape != shape:
        found = f"shape {out.shape}"
    elif not out.flags.writeable:
        found = "a read-only one"
    else:
        return
    raise ValueInvalid(f"out: expected a writable float64 array of shape {shape}, got {found}")


def flat_columns(out: Array, axes: int) -> Sequence[Array] | None:
    """Return flat views of each component of rows that fill the last axes; None where strides allow no such view."""
    out, shape = out.view(np.ndarray), out.shape[out.ndim - axes :]  # of a np.matrix no component has one axis
    if out.flags.c_contiguous:
        return list(out.reshape(-1, int(np.prod(shape))).T)
    columns = [out[(..., *place)].reshape(-1) for place in np.ndindex(*shape)]
    return columns if np.may_share_memory(columns[0], out) else None


def shares_memory(out: Array, parts: Components) -> bool:
    """Tell whether writing to `out` changes components that are arrays."""
    return any(not isinstance(part, float) and np.shares_memory(out, part) for part in parts)


def in_step(out: Array, axes: int, parts: Components) -> bool:
    """Tell whether components are those of `out` itself, in their order: a row is read before it is written."""
    own = [out[(..., *place)] for place in np.ndindex(*out.shape[out.ndim - axes :])]
    return len(own) == len(parts) and all(_place(part) == _place(mine) for part, mine in zip(parts, own, strict=True))


def _place(part: Array) -> tuple[object, ...]:
    return part.dtype, part.__array_interface__["data"][0], part.shape, part.strides
