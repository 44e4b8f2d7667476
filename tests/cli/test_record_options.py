"""What the options of numbers and tables do to records."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]


def test_precision_leaves_the_position_of_a_record_as_it_is_written(run: Run) -> None:
    record = '{"xyz":[0.123456789,2,3],"rpy_deg":[0,0,0]}\n'
    for text in (record, record * 40):
        found = run("convert", "--to", "quaternion", "--precision", "2", stdin=text)
        assert found.out.count('"xyz":[0.123456789,2,3]') == text.count("\n")
        assert found.out.count("1.00") == text.count("\n")


@pytest.mark.parametrize("option", [("--keep",), ("--prefix", "a_")])
def test_options_of_tables_are_refused_for_records(run: Run, option: tuple[str, ...]) -> None:
    found = run("convert", "--to", "quaternion", *option, stdin='{"xyz":[1,2,3],"rpy_deg":[0,0,0]}\n')
    assert (found.status, found.out) == (2, "")
