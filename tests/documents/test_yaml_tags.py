"""Tags of YAML: read where a form has them, on mappings only; an error everywhere else."""

from __future__ import annotations

import pytest

from frametool.documents.document import locate_many, parse_documents
from frametool.documents.source import TAG
from frametool.errors import FormatError

TAGS = frozenset(("!Rpy", "!!opencv-matrix"))


def test_a_mapping_keeps_its_tag_beside_its_keys() -> None:
    text = "a: !Rpy {deg: [1]}\nb: !!opencv-matrix\n  rows: 4\n"
    (document,) = parse_documents(text, "f", TAGS)
    assert document.value == {"a": {TAG: "!Rpy", "deg": ["1"]}, "b": {TAG: "!!opencv-matrix", "rows": "4"}}
    assert locate_many(text, [(0, "b", "rows")]) == [(3, 9)]


def test_an_alias_repeats_the_tag() -> None:
    (document,) = parse_documents("a: &x !Rpy {deg: 1}\nb: *x\n", "f", TAGS)
    assert document.value["b"] == {TAG: "!Rpy", "deg": "1"}


@pytest.mark.parametrize("text", ["a: !Rpy [1]\n", "a: !Rpy 1\n", "!Rpy a: 1\n", "a: !Rpy\n", "- !Uniform {}\n", "a: !!python/object {}\n"])
def test_other_tags_and_other_values_are_refused(text: str) -> None:
    with pytest.raises(FormatError, match=r"^f:1:\d+: tag \S+ is not read here$"):
        parse_documents(text, "f", TAGS)


def test_without_tags_named_every_tag_is_refused() -> None:
    with pytest.raises(FormatError, match=r"^f:1:4: tag !Rpy is not read here$"):
        parse_documents("a: !Rpy {deg: 1}\n", "f")


def test_a_key_that_looks_like_a_tag_is_a_key_of_its_own() -> None:
    with pytest.raises(FormatError):
        parse_documents('a: !Rpy {"!": 1}\n', "f", TAGS)
    assert parse_documents('{"!": "1", b: 2}\n', "f")[0].value == {"!": "1", "b": "2"}
