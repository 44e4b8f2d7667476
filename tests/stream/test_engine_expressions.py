"""A transform written out as SQL: a text that says what is computed; engines evaluate it in test_beyond.py."""

from __future__ import annotations

import re
from typing import Any

import pytest

import frametool
from frametool.geometry import rigid

QUARTER = frametool.Transform(frametool.Rotation.from_rpy([0.0, 0.0, 1.5707963267948966]), [1.0, -2.5, 1e-20])


def test_sql_writes_the_twelve_numbers_so_that_they_read_back() -> None:
    transform = frametool.Transform.random(seed=1)
    found = [float(text) for text in re.findall(r"-?[\d.]+e[-+]?\d+", frametool.sql(transform))]
    assert tuple(found) == tuple(rigid.to_matrix(*transform.components))


def test_sql_names_three_columns_in_their_order() -> None:
    wanted = (
        '1.0e0 * "x" + 0.0e0 * "y" + 0.0e0 * "z" + 1.0e0 AS "x", '
        '0.0e0 * "x" + 1.0e0 * "y" + 0.0e0 * "z" + -2.5e0 AS "y", '
        '0.0e0 * "x" + 0.0e0 * "y" + 1.0e0 * "z" + 1e-20 AS "z"'
    )
    assert frametool.sql(frametool.Transform(frametool.Rotation.identity(), [1.0, -2.5, 1e-20])) == wanted


def test_vectors_have_no_shift() -> None:
    assert frametool.sql(QUARTER, as_="vector").count("e0") == 9


@pytest.mark.parametrize(
    ("quote", "written"), [('"', '"a""b"'), ("`", '`a"b`')], ids=["standard", "Spark"]
)
def test_a_quote_in_a_name_is_doubled(quote: str, written: str) -> None:
    assert f"AS {written}" in frametool.sql(QUARTER, ('a"b', "y", "z"), quote=quote)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((frametool.Transform.random(2, seed=1),), "expected one Transform, got <Transform of shape (2,)>"),
        (([1, 2, 3],), "expected one Transform, got list"),
        ((QUARTER, ("x", "y")), "columns: expected three, like x, y, z; found x, y"),
        ((QUARTER, ("x", "y", "")), "'' is no name of a column in SQL"),
    ],
    ids=str,
)
def test_what_cannot_be_written_is_refused(arguments: Any, message: str) -> None:
    with pytest.raises(frametool.FrametoolError) as caught:
        frametool.sql(*arguments)
    assert str(caught.value) == message
