"""Long lists of flow maps read as the YAML parser reads them, or are left to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as some
from sized import sized

from frametool.documents.document import parse_documents
from frametool.documents.yaml import STANDIN, split_brackets, split_run
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


def outcome(text: str) -> object:
    """Return the values of a text, or the message that refuses it."""
    try:
        return values(text)
    except FormatError as error:
        return str(error)


PIECES = ["f1: ", "- ", "xyz: ", "  ", "    ", "\n", "[1, 2]", "{a: b, c: [1, 2]}", "a: [x]\n", "children:\n", "[", "]", "{", "}", ", ", "on", "---\n", "? ", ": ", "~", "a: b: [1]\n"]  # fmt: skip


@given(some.lists(some.sampled_from(PIECES), max_size=14).map("".join))
def test_no_text_reads_otherwise_where_brackets_are_read_aside(text: str) -> None:
    expected = outcome(text)
    with sized(aside=0):
        assert outcome(text) == expected


NESTED = "frames:\n  world:\n    a: {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}\n    b:\n      xyz: [4, 5, 6]\n      children:\n        c: {xyz: [7]}\n"


@pytest.mark.parametrize("text", [NESTED, "- [1, 2]\n- a: [1]\n  b: {c: d}\n", "a: [1]\n---\na: {b: c}\n"])
def test_values_in_brackets_are_read_aside(text: str, sizes: Sizes) -> None:
    expected = values(text)
    sizes(aside=0)
    split = split_brackets(text)
    assert split is not None
    assert split[0].count(STANDIN) == len(split[1]) > 0
    assert values(text) == expected


@pytest.mark.parametrize("line", ['a: "b"', "a: 'b'", "a: |", "a: >", "a: b # c", "a: &b c", "a: *b", "a: !b c", "? a", "a:\tb"])
def test_a_text_with_more_than_plain_words_is_left_to_the_parser(line: str, sizes: Sizes) -> None:
    sizes(aside=0)
    assert split_brackets(f"{NESTED}{line}\n") is None


@pytest.mark.parametrize("text", [f"{NESTED}d: {STANDIN}\n", f"a: {STANDIN}\nframes:\n  - {{b: c}}\n", "a: |-\n  - {b: c}\n", "a: b\n- {c: d}\n", "--- a\n- {b: c}\n", "a:\n   b:\n  - {c: d}\n"])
def test_a_list_or_a_value_is_not_put_where_the_text_has_another(text: str) -> None:
    expected = outcome(text)
    with sized(aside=0):
        assert outcome(text) == expected


def test_brackets_read_aside_are_no_way_around_the_depth(sizes: Sizes) -> None:
    deep = "".join(f"{'  ' * level}a:\n" for level in range(999)) + "  " * 999 + "a: {b: [c]}\n"
    expected = outcome(deep)
    assert "nested deeper than 990 levels" in str(expected)
    sizes(aside=0)
    assert outcome(deep) == expected
