"""Run kernels for the two values: floats directly, arrays in blocks, rows out for whoever asks for them.

Loads numpy only where a batch or an array is asked for.
"""

from __future__ import annotations

from frametool.errors import ValueInvalid
from frametool.geometry import floats
from frametool.geometry.validation import all_finite, at_first, first_row, single, weights

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from frametool.geometry.types import Array, Components, Kernel, Numbers


def checked(kernel: Kernel, count: int, given: Components, name: str, check: Callable[..., object]) -> Components:
    """Run a kernel that not every finite input suits; `check` looks at one item, and at the first row that fails."""
    if single(given):
        check(*given)
        return kernel(*given, floats)
    from frametool.geometry import arrays

    return arrays.run(arrays.guarded(kernel, lambda: _recheck(kernel, count, given, name, check)), count, given, arrays)


def _recheck(kernel: Kernel, count: int, given: Components, name: str, check: Callable[..., object]) -> None:
    """Find the first row a kernel failed on and say why."""
    import numpy as np

    from frametool.geometry import arrays

    all_finite(given, name)
    bad = ~np.logical_and.reduce([np.isfinite(part) for part in arrays.run(kernel, count, given, arrays)])
    if bad.any():
        try:
            check(*first_row(given, bad))
        except ValueInvalid as error:
            raise ValueInvalid(f"{at_first(name, bad)}: {error}") from None


def run(kernel: Kernel, count: int, given: Components, *, functions: bool = True) -> Components:
    """Run a kernel on trusted components; one of arithmetic alone takes no namespace of functions."""
    if single(given):
        return kernel(*given, floats) if functions else kernel(*given)
    from frametool.geometry import arrays

    return arrays.run(kernel, count, given, arrays) if functions else arrays.run(kernel, count, given)


def number(kernel: Callable[..., Any], given: Components) -> Any:
    """Run a kernel that returns one number."""
    return run(lambda *parts: (kernel(*parts),), 1, given)[0]


def rows(
    kernel: Kernel, inner: tuple[int, ...], given: Components, *args: object, out: Array | None = None
) -> Array:
    """Run a kernel that needs functions; return its components as rows (..., *inner), in `out` where it is given."""
    if single(given):
        return _one_row(kernel(*given, *args, floats), inner, out)
    from frametool.geometry import arrays

    return arrays.rows(kernel, inner, given, *args, arrays, out=out)


def moved(
    kernel: Kernel, mover: Components, given: Components, name: str, *,
    flatten: Kernel | None = None, out: Array | None = None,
) -> Array:  # fmt: skip
    """Move vectors, each by its own mover or all by one; `flatten` makes the matrix of one, which is faster.

    Vectors that are overwritten are looked at before: where one is not finite, all stay as they were.
    """
    inner = (len(given),)
    if single(given) and single(mover):
        return _one_row(kernel(*mover, *given), inner, out)
    from frametool.geometry import arrays, out_array

    parts = (*mover, *given)
    if flatten and single(mover):
        kernel, parts = _matrix_kernel(flatten(*mover)), given
    if out is None or not out_array.shares_memory(out, given):
        kernel = arrays.guarded(kernel, lambda: all_finite(given, name))
    elif not arrays.finite_throughout(given):
        all_finite(given, name)
    return arrays.rows(kernel, inner, parts, out=out)


def _one_row(components: Components, inner: tuple[int, ...], out: Array | None) -> Array:
    """Return the components of one item as an array, in `out` where it is given."""
    row = stacked(components).reshape(inner)
    if out is None:
        return row
    from frametool.geometry import out_array

    out_array.require_fitting(out, inner)
    out[...] = row
    return out


def _matrix_kernel(entries: Components) -> Kernel:
    """Make the kernel of one matrix, three rows of three or of four; sums in place save it a tenth."""
    width = len(entries) // 3
    matrix = [entries[start : start + width] for start in range(0, len(entries), width)]

    def kernel(x: Array, y: Array, z: Array) -> Components:
        moved = []
        for a, b, c, *shift in matrix:
            row = a * x
            row += b * y
            row += c * z
            for distance in shift:
                row += distance
            moved.append(row)
        return tuple(moved)

    return kernel


def stacked(components: Components) -> Array:
    """Return components as rows of a fresh array."""
    import numpy as np

    return np.stack(components, axis=-1)


def chosen(components: Components, index: Any) -> Components:
    """Index every component; what is left of one element becomes floats."""
    return tuple(part[index] if getattr(part[index], "shape", ()) else float(part[index]) for part in components)


def second_moment(components: Components, mass: Array) -> list[list[float]]:
    """Return sum(w q q^T), 4 by 4."""
    from frametool.geometry import arrays

    upper = {(i, j): 0.0 for i in range(4) for j in range(i, 4)}
    for _, (weight, *parts) in arrays.cut((mass, *components), 0):
        heavy = [weight * part for part in parts]
        for i, j in upper:
            upper[i, j] += total(heavy[i] * parts[j])
    return [[upper[min(i, j), max(i, j)] for j in range(4)] for i in range(4)]


def total(values: Array) -> float:
    """Return a sum, adding halves onto each other in place: numpy's own order depends on the machine."""
    sums = values.reshape(-1)
    while sums.size > 1:
        half = sums.size // 2
        sums[:half] += sums[-half:]
        sums = sums[: sums.size - half]
    return float(sums[0])


def masses(heavy: Numbers | None, shape: tuple[int, ...]) -> Array:
    """Return weights of a batch's shape, 1 each if none are told.

    Raises:
        ValueInvalid: the batch is empty, or the weights are none.
    """
    import numpy as np

    if 0 in shape:
        raise ValueInvalid("mean of no rotations; give at least one")
    return np.ones(shape) if heavy is None else weights(heavy, shape)
