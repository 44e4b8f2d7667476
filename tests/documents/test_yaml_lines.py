"""Long lists of flow maps read as the YAML parser reads them, or are left to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as some
from sized import sized

from frametool.documents.document import parse_documents
from frametool.documents.yaml import split_run
from frametool.errors import FormatError

if TYPE_CHECKING:
    from conftest import Sizes

WORDS = some.sampled_from(["a", "on", "y", "007", "12.5", "-.5", "1e-3", "base_link", "/cam", "a-b", "x.y", "nullify", "N", "+3", "5."])
LISTS = some.lists(WORDS, min_size=1, max_size=4).map(lambda each: f"[{', '.join(each)}]")
MAPS = some.dictionaries(WORDS, WORDS | LISTS, min_size=1, max_size=5).map(
    lambda each: "{" + ", ".join(f"{key}: {value}" for key, value in each.items()) + "}"
)
LINES = some.tuples(some.sampled_from(["", "frames:\n", "angles: deg\nframes:\n", "a: {b: [1]}\nframes:\n"]), some.lists(MAPS, min_size=1, max_size=6))


def values(text: str) -> list[Any]:
    """Give the values of a text's documents."""
    return [document.value for document in parse_documents(text, "f")]


@given(LINES)
def test_both_ways_read_the_same(lines: tuple[str, list[str]]) -> None:
    head, maps = lines
    text = head + "".join(f"  - {each}\n" for each in maps)
    expected = values(text)
    with sized(aside=0):
        assert split_run(text) is not None
        assert values(text) == expected


BLOCKS = some.lists(some.dictionaries(WORDS, WORDS | LISTS, min_size=1, max_size=5), min_size=1, max_size=6)


@given(some.sampled_from(["", "  ", "    "]), BLOCKS)
def test_block_maps_too(indent: str, maps: list[dict[str, str]]) -> None:
    entries = [[f"{key}: {value}" for key, value in each.items()] for each in maps]
    text = "frames:\n" + "".join(f"{indent}- " + f"\n{indent}  ".join(each) + "\n" for each in entries)
    expected = values(text)
    with sized(aside=0):
        assert split_run(text) is not None
        assert values(text) == expected


@pytest.mark.parametrize(
    "line",
    ["- a: b, c: d", "- a: b\n    c:\n      d: e", "- a: b # c", "- a: b\n    a: c", "- a: [b,\n       c]", "- a: ''", "- a:\n    b: c", "- a: b\n   c: d"],
)  # fmt: skip
def test_other_blocks_are_left_to_the_parser(line: str, sizes: Sizes) -> None:
    sizes(aside=0)
    assert split_run(f"frames:\n  - a: b\n  {line}\n") is None


@pytest.mark.parametrize(
    "line",
    ["- {a: null}", "- {a: ~}", "- {a: 'b'}", "- {a: b, a: c}", "- {a: b} # c", "- {a: [b, [c]]}", "- {a: {b: c}}", "- {a:b}", "- {a: b c}", "- {a: é}",
     "- {a: b}\n    - {c: d}", "- {a: *b}", "-  {a: b}", "- {a: b,}", "- a"],
)  # fmt: skip
def test_anything_else_is_left_to_the_parser(line: str, sizes: Sizes) -> None:
    sizes(aside=0)
    text = f"frames:\n  - {{a: b}}\n  {line}\n"
    assert split_run(text) is None


def test_mistakes_before_such_a_list_are_told_where_they_are(sizes: Sizes) -> None:
    sizes(aside=0)
    with pytest.raises(FormatError, match="f:2:1: key 'a' appears twice"):
        parse_documents("a: 1\na: 2\nframes:\n  - {a: b}\n", "f")
