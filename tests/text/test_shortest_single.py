"""Floats of 32 bits: the fewest digits that read back, as numpy's own writer for one float finds them."""

from __future__ import annotations

import numpy as np
import pytest

from frametool.text.write import rounded_to_single

RNG = np.random.default_rng(11)


@pytest.mark.parametrize(
    "values",
    [
        RNG.integers(0, 1 << 32, 3000, dtype=np.uint32).view(np.float32),
        RNG.normal(size=3000, scale=30.0).astype(np.float32),
        np.round(RNG.normal(size=3000, scale=30.0), 3).astype(np.float32),
        np.array([0.0, -0.0, 1e-45, 1.1754944e-38, 3.4028235e38, 1e-12, 1e20, 16777216.0, 33554432.0], np.float32),
        (2.0 ** np.arange(-149, 128)).astype(np.float32),
        (10.0 ** np.arange(-44, 39)).astype(np.float32),
    ],
    ids=["any bits", "usual", "decimals", "ends", "powers of 2", "powers of 10"],
)
def test_a_float_has_the_digits_that_numpy_writes(values: np.ndarray) -> None:
    values = values[np.isfinite(values)]
    assert rounded_to_single(values.astype(np.float64)).tolist() == [float(str(value)) for value in values]


def test_what_is_not_finite_stays() -> None:
    found = rounded_to_single(np.array([np.nan, np.inf, -np.inf]))
    assert (np.isnan(found[0]), found[1:].tolist()) == (True, [np.inf, -np.inf])
