"""Many rotations are checked as each is alone: the same ones refused and why, normalised, and the same bits."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

import numpy as np
import pytest
import samples

from frametool.errors import FrametoolWarning, ValueInvalid
from frametool.geometry import floats
from frametool.geometry.representations import ROTATIONS, Notation, notation
from frametool.geometry.validation import read_rotations, require_rotations

if TYPE_CHECKING:
    from frametool.geometry import Array, Quaternion

SPECS = [*(name for name in ROTATIONS if name != "euler"), "euler:rzyx"]
SIZES = (
    1.0, 1.0 + 1e-15, 1.0 + 5e-7, 1.0 + 2e-6, 1.0005, 0.9995, 1.002, 2.0, 1e-3, 1e-160, 1e-310, 1e160, 1e300, 0.0, -1.0,
    math.inf, math.nan,
)  # fmt: skip


def rows_of(form: Notation) -> list[list[float]]:
    """List rows of a notation: right, too long or short by all sizes, and with one number that is odd."""
    rows = []
    for row in samples.quaternions(3)[::9]:
        parts = form.from_quaternion(*row, floats)
        rows += [[size * part for part in parts] for size in SIZES]
        rows += [[*parts[:-1], odd] for odd in (math.nan, -math.inf, 1e200, 4e6, 0.0, 5e-324)]
    return rows


def alone(form: Notation, row: list[float], *, normalize: bool) -> tuple[Quaternion, str, bool]:
    """Return what becomes of a row by itself: its quaternion, the reason if it is refused, whether it was normalised."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FrametoolWarning)
        try:
            return form.checked_quaternion(row, floats, normalize=normalize), "", bool(caught)
        except ValueInvalid as error:
            return (0.0, 0.0, 0.0, 1.0), str(error), False


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("normalize", [False, True])
def test_rows_are_judged_as_each_alone(spec: str, normalize: bool) -> None:  # noqa: FBT001
    form = notation(spec)
    rows = rows_of(form)
    found = read_rotations(form, [np.array(column) for column in zip(*rows, strict=True)], normalize=normalize)
    expected = [alone(form, row, normalize=normalize) for row in rows]
    assert found.reasons == {place: reason for place, (_, reason, _) in enumerate(expected) if reason}
    assert found.mended.tolist() == [place for place, (_, _, mended) in enumerate(expected) if mended]
    together = list(zip(*(part.tolist() for part in found.quaternions), strict=True))
    assert together == [quaternion for quaternion, _, _ in expected]


@pytest.mark.parametrize("spec", SPECS)
def test_a_bad_row_changes_no_other(spec: str) -> None:
    form = notation(spec)
    good = [form.from_quaternion(*row, floats) for row in samples.quaternions(5)]
    clean = np.array(read_rotations(form, list(np.array(good).T)).quaternions)
    for odd in (math.nan, math.inf, 0.0, 1e30):
        spoiled: Array = np.array(good).T.copy()
        spoiled[:, 4] = odd
        among = np.array(read_rotations(form, list(spoiled)).quaternions)
        assert np.array_equal(np.delete(among, 4, axis=1), np.delete(clean, 4, axis=1))


@pytest.mark.parametrize("spec", SPECS)
def test_the_first_bad_row_is_named_and_all_counted(spec: str) -> None:
    form = notation(spec)
    columns = np.array([form.from_quaternion(*row, floats) for row in samples.random_quaternions(6)]).T
    columns[:, (2, 5)] = math.nan
    with pytest.raises(ValueInvalid, match=r"^rows\[2\]: .*not finite"):
        require_rotations(form, tuple(columns), "rows")
