"""Floats and texts that break readers and printers."""

from __future__ import annotations

import itertools

import numpy as np

RNG_SEED = 20240607


def random_bits(count: int) -> list[float]:
    """Give floats of every exponent, nan, infinity and subnormal ones among them."""
    bits = np.random.default_rng(RNG_SEED).integers(0, 1 << 64, count, dtype=np.uint64)
    values: list[float] = bits.view(np.float64).tolist()
    return values


def at_scales(count: int) -> list[float]:
    """Give full floats, short decimals and integers of every size."""
    rng = np.random.default_rng(RNG_SEED)
    scales = 10.0 ** np.arange(-30, 31)
    full = [rng.uniform(-scale, scale, count) for scale in scales]
    short = [np.round(rng.uniform(-scale, scale, count), 3) for scale in scales]
    whole = [rng.integers(-(10**6), 10**6, count) * scale for scale in scales]
    values: list[float] = np.concatenate(full + short + whole).tolist()
    return values


def at_powers() -> list[float]:
    """Give powers of two and ten with their neighbours: their intervals are lopsided or barely hold a short decimal."""
    powers = np.concatenate([2.0 ** np.arange(-1074, 1024), 10.0 ** np.arange(-300, 309)])
    neighbours = [np.nextafter(powers, 0.0), powers, -np.nextafter(powers[powers < 1e308], np.inf)]
    return [value for value in np.concatenate(neighbours).tolist() if np.isfinite(value)]


SPECIAL = [0.0, -0.0, 1.0, -1.0, 5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, 1e22, 1e23, 9.5e-5, 1e-4, 0.1,
           9007199254740993.0, 99999999999999.98, 123456789012345.6, 9999999999999998.0, 1e16]  # fmt: skip
HOSTILE = [*SPECIAL, *random_bits(4000), *at_scales(40), *at_powers()]

NUMBERS = ["+1", "-1.", ".5", "-.5", "1e5", "1E5", "1e+5", "1e-5", " 1", " 1 ", "\t1\t", "1.5e3 ", "-0", "-0.0", "-0e5",
           "1e308", "1e-308", "5e-324", "2.5e-324", "1e-400", "123456789", "12345678", "12345678.5", "12345678.",
           "1234567.", "99999999.99999999", "90071992.54740993", "9007199254740993", "0" * 50 + "1", "1" + "0" * 50,
           "0." + "0" * 30 + "1", "1e0005", "1e00005", "1e+0005", "0e999", "1.e5", ".1e5", "12345678901",
           "1403636579.763555527"]  # fmt: skip
NO_NUMBERS = ["", ".", "-", "+", "1e", "e5", "1e5.", "1.2.3", "--1", "+-1", "1_0", "0x10", "nan", "inf", "-inf",
              "Infinity", "1 2", " ", "1e 5", "1e400", "-1e400", "1.5e3e4", "1e++5", "1e--5", "\x001", "1\x00", "1\xb2",
              "\xa01", "1:", "1/", "9:.5", "1.:", "e", ".e5", "+.e3", "- 1", "1\x0b", "x"]  # fmt: skip
SIGNS, EXPONENTS = ["", "-", "+"], ["", "e-3", "E+10", "e300"]
SHAPES = [
    f"{sign}{whole}{exponent}" for sign, whole, exponent in itertools.product(SIGNS, ["1.25", ".5", "7"], EXPONENTS)
]
