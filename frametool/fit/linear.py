"""Sums and matrices whose last digits are the same everywhere.

numpy leaves long sums, and products and solutions of matrices, to code that adds in whatever order suits its version
and the processor.  Here numbers are added, multiplied and divided one by one, in an order of ours; products of large
matrices go to that code all the same, in parts so short that no sum of theirs is ever rounded.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid
from frametool.geometry import floats, quaternion
from frametool.geometry.rotation import Rotation

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.geometry.types import Array

class NotSettled(ValueInvalid):
    """Report equations that have no solution."""


LONG = 24  # rows and columns of a large matrix
BITS = 53  # of a float
SWEEPS = 6  # of Jacobi's: each doubles the digits


def total(values: Array) -> float:
    """Return the sum of numbers."""
    return float(_added(np.array(values, float)[:, None])[0])


def summed(rows: Array) -> Array:
    """Return the sum over the first axis of rows, (n, k)."""
    return _added(np.array(rows, float))


def _added(sums: Array) -> Array:
    """Add up the last axis but one in place, halves onto each other."""
    count = sums.shape[-2]
    while count > 1:
        half = count // 2
        sums[..., :half, :] += sums[..., count - half : count, :]
        count -= half
    found: Array = sums[..., 0, :] if count else sums.sum(-2)
    return found


def dot(a: Array, b: Array) -> Array:
    """Return the products of vectors, which lie along the last axis."""
    found: Array = _added((a * b)[..., None])[..., 0]
    return found


def length(vectors: Array) -> Array:
    """Return the lengths of vectors."""
    return np.sqrt(dot(vectors, vectors))


def applied(matrices: Array, vectors: Array) -> Array:
    """Return matrices times vectors: (.., n, k) and (.., k)."""
    return dot(matrices, vectors[..., None, :])


def crossed(a: Array, b: Array) -> Array:
    """Return a' b of matrices with many rows, (n, i) and (n, j)."""
    return np.stack([_added(column[:, None] * b) for column in a.T])


def product(a: Array, b: Array) -> Array:
    """Return the products of small matrices, (.., n, k) and (.., k, m)."""
    return _added(a[..., None] * b[..., None, :, :])


def large_product(a: Array, b: Array) -> Array:
    """Return the product of two matrices by parts whose sums are exact in any order, the smallest parts left out.

    Good to the last digits of the largest number of a row of a times that of a column of b.
    Source: Ozaki, Ogita, Oishi, Rump 2012.
    """
    bits = (BITS - len(b).bit_length()) // 2
    a_0, a_1, a_2 = _parts(a, 1, bits)
    b_0, b_1, b_2 = _parts(b, 0, bits)
    found: Array = a_0 @ b_0 + (a_0 @ b_1 + a_1 @ b_0 + (a_0 @ b_2 + a_1 @ b_1 + a_2 @ b_0))
    return found


def _parts(matrix: Array, axis: int, bits: int) -> Iterator[Array]:
    """Cut numbers into three parts, each some bits long beside the largest number along an axis."""
    for _ in range(3):
        exponents = np.frexp(np.abs(matrix).max(axis, keepdims=True))[1]
        cut = np.ldexp(1.5, exponents + BITS - 1 - bits)  # adding it leaves no bits below; 1.5 is for either sign
        part = matrix + cut - cut
        matrix = matrix - part
        yield part


def inverse(matrix: Array) -> Array:
    """Return the inverse of a symmetric positive definite matrix; a large one goes by quarters.

    Raises NotSettled where there is none.
    """
    if (half := len(matrix) // 2) <= LONG // 2:
        return solved(matrix, np.eye(len(matrix)))
    units: Array = np.ldexp(1.0, np.frexp(np.diagonal(matrix))[1] // 2)  # powers of two: dividing rounds nothing
    matrix = matrix / (units * units[:, None])
    first, beside = inverse(matrix[:half, :half]), matrix[:half, half:]
    gain = large_product(first, beside)
    last = inverse(matrix[half:, half:] - large_product(beside.T, gain))
    beside = -large_product(gain, last)
    found = np.block([[first - large_product(beside, gain.T), beside], [beside.T, last]])
    return found / (units * units[:, None])


def solved(matrix: Array, right: Array) -> Array:
    """Return inv(matrix) right, (n, k), of a small symmetric positive definite matrix, by elimination.

    Raises NotSettled where there is none.
    """
    size = len(matrix)
    rows = np.hstack([matrix, right])
    for k in range(size):
        if not rows[k, k] > 0.0:
            raise NotSettled("the numbers do not settle what is asked for: too few, too alike or too far apart")
        rows[k + 1 :, k:] -= rows[k + 1 :, k, None] / rows[k, k] * rows[k, k:]
    for k in reversed(range(size)):
        rows[k, size:] /= rows[k, k]
        rows[:k, size:] -= rows[:k, k, None] * rows[k, size:]
    return rows[:, size:]


def eigen(matrix: Array) -> tuple[Array, Array]:
    """Return the eigenvalues of a symmetric matrix, the largest last, and their vectors as columns.

    Source: Jacobi 1846, in the form of Golub and Van Loan 2013, section 8.5.
    """
    values, vectors = np.array(matrix, float), np.eye(len(matrix))
    for p, q in [*combinations(range(len(matrix)), 2)] * SWEEPS:
        if values[p, q] != 0.0:
            gap, twice = values[q, q] - values[p, p], 2.0 * values[p, q]
            tangent = twice / (gap + np.copysign(np.sqrt(gap * gap + twice * twice), gap))
            cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
            sine = tangent * cosine
            for each in (values, values.T, vectors):
                first, second = each[:, p].copy(), each[:, q].copy()
                each[:, p], each[:, q] = cosine * first - sine * second, sine * first + cosine * second
    order = np.argsort(np.diagonal(values))
    return np.diagonal(values)[order], vectors[:, order]


def turn_between(source: Array, target: Array) -> Rotation:
    """Return the R of the least sum of |target - R source|^2 over vectors (n, 3); source: Horn 1987."""
    moments = crossed(source, target)
    whole = np.empty((4, 4))
    trace = moments[0, 0] + moments[1, 1] + moments[2, 2]
    whole[:3, :3] = moments + moments.T - trace * np.eye(3)
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        whole[i, 3] = whole[3, i] = moments[j, k] - moments[k, j]
    whole[3, 3] = trace
    whole += (total(np.abs(moments.reshape(-1))) or 1.0) * np.eye(4)  # so that no eigenvalue is negative
    return Rotation.of(*quaternion.largest_eigenvector(whole.tolist(), floats)).canonical()
