"""Normal equations of many bodies by block elimination: sparse Cholesky in numpy, six unknowns a body.

A symmetric matrix is kept as its blocks (n, 6, 6) on a pattern: the pairs of bodies that a row joins, and those that
elimination by least degree fills.  Once what remains is dense, it is solved whole.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.fit.linear import inverse, product

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.geometry.types import Array, Indices

SIX = 6
DENSE = 0.5  # of the bodies left: where the least joined one sees as many, the rest is solved whole


class Elimination:
    """The order in which bodies are eliminated, and where each block is kept.

    steps: (bodies eliminated at once, bodies left that they see)
    """

    def __init__(self, count: int, pairs: Iterable[tuple[int, int]]) -> None:
        """Order bodies 0 .. count - 1 by least degree; ties go to the lower number."""
        near: list[set[int]] = [set() for _ in range(count)]
        for a, b in pairs:
            near[a].add(b)
            near[b].add(a)
        for body, others in enumerate(near):
            others.discard(body)
        self.count = count
        self.steps: list[tuple[Indices, Indices]] = []
        left = set(range(count))
        while left:
            body = min(left, key=lambda each: (len(near[each]), each))
            others = near[body]
            if len(others) >= DENSE * (len(left) - 1):
                self.steps.append((np.array(sorted(left)), np.array([], int)))
                break
            left.discard(body)
            for other in others:
                near[other] |= others
                near[other] -= {other, body}
            self.steps.append((np.array([body]), np.array(sorted(others), int)))
        self._slot = np.full((count, count), -1)
        self.size = 0
        for bodies, seen in self.steps:
            self._number(bodies, bodies)
            self._number(bodies, seen)
            self._slot[np.ix_(seen, bodies)] = self._slot[np.ix_(bodies, seen)].T + len(bodies) * len(seen)
            self.size += len(bodies) * len(seen)

    def _number(self, rows: Indices, columns: Indices) -> None:
        count = len(rows) * len(columns)
        self._slot[np.ix_(rows, columns)] = np.arange(self.size, self.size + count).reshape(len(rows), len(columns))
        self.size += count

    def slots(self, rows: Indices, columns: Indices) -> Indices:
        """Return where the blocks of pairs are kept; indices broadcast."""
        found: Indices = self._slot[rows, columns]
        return found

    def gathered(self, blocks: Array, rows: Indices, columns: Indices) -> Array:
        """Return the blocks of all rows with all columns as one matrix."""
        part = blocks[self._slot[np.ix_(rows, columns)]]
        whole: Array = part.swapaxes(1, 2).reshape(SIX * len(rows), SIX * len(columns))
        return whole

    def scattered(self, blocks: Array, rows: Indices, columns: Indices, matrix: Array) -> None:
        """Put such a matrix back."""
        part = matrix.reshape(len(rows), SIX, len(columns), SIX).swapaxes(1, 2)
        blocks[self._slot[np.ix_(rows, columns)]] = part

    def factored(self, blocks: Array) -> BlockFactor:
        """Eliminate all bodies of a positive definite matrix."""
        left = blocks.copy()
        inverses: list[Any] = []
        gains: list[Any] = []
        for bodies, seen in self.steps:
            beside = self.gathered(left, bodies, seen)
            inverses.append(inverse(self.gathered(left, bodies, bodies)))
            gains.append(product(inverses[-1], beside))
            if len(seen):
                self.scattered(left, seen, seen, self.gathered(left, seen, seen) - product(beside.T, gains[-1]))
        return BlockFactor(self, inverses, gains)


class BlockFactor(NamedTuple):
    """A matrix after elimination.

    inverses: of each step, that of the matrix of its bodies when their turn came; gains: that times what they see
    """

    elimination: Elimination
    inverses: list[Array]
    gains: list[Array]

    def solve(self, right: Array) -> Array:
        """Return inv(H) right; right: (count, 6, columns)."""
        x = right.copy()
        columns = right.shape[-1]
        for (bodies, seen), gain in zip(self.elimination.steps, self.gains, strict=True):
            x[seen] -= product(gain.T, x[bodies].reshape(-1, columns)).reshape(-1, SIX, columns)
        for (bodies, seen), own, gain in self._backwards():
            above = product(own, x[bodies].reshape(-1, columns)) - product(gain, x[seen].reshape(-1, columns))
            x[bodies] = above.reshape(-1, SIX, columns)
        return x

    def inverse_diagonal(self) -> Array:
        """Return the diagonal blocks of inv(H), (count, 6, 6): its entries on the pattern need no others.

        Source: Takahashi, Fagan, Chen 1973.
        """
        of = self.elimination
        found = np.zeros((of.size, SIX, SIX))
        for (bodies, seen), own, gain in self._backwards():
            beside = -product(gain, of.gathered(found, seen, seen))
            block = own - product(beside, gain.T)
            of.scattered(found, bodies, bodies, (block + block.T) / 2)
            of.scattered(found, bodies, seen, beside)
            of.scattered(found, seen, bodies, beside.T)
        every = np.arange(of.count)
        diagonal: Array = found[of.slots(every, every)]
        return diagonal

    def _backwards(self) -> Any:
        return reversed(list(zip(self.elimination.steps, self.inverses, self.gains, strict=True)))
