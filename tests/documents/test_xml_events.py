"""XML as elements with places: what is read, and that what cannot be is one placed line."""

from __future__ import annotations

import io

import pytest

from frametool.documents.source import InputFile
from frametool.documents.xml import Element, read_xml
from frametool.errors import FormatError


def xml(data: bytes) -> Element:
    return read_xml(InputFile("a.xml", io.BytesIO(data)))


def test_elements_have_their_places_and_texts() -> None:
    a = xml(b"<a>\n <b x='1 2'>t</b>\n</a>")
    (b,) = a.children
    assert [(each.tag, each.line, each.column, each.text) for each in (a, b)] == [("a", 1, 1, ""), ("b", 2, 2, "t")]


def test_prefixes_that_are_bound_nowhere_are_read_as_they_stand() -> None:
    assert [each.tag for each in xml(b"<robot><sensor:camera/></robot>").children] == ["sensor:camera"]


def test_other_encodings_are_read_where_the_file_declares_them() -> None:
    data = "<?xml version='1.0' encoding='iso-8859-1'?><a n='é'/>".encode("latin-1")
    assert xml(data).attributes == {"n": "é"}


BOMB = b'<!DOCTYPE a [<!ENTITY x "ha"><!ENTITY y "&x;&x;">]><a>&y;</a>'


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "a.xml:1:1: not XML: it ends too early"),
        (b"<a>\n<b>", "a.xml:2:4: not XML: it ends too early"),
        (b"<a>\n<b></a>", "a.xml:2:6: not XML: mismatched tag"),
        (b"<a>\xff</a>", "a.xml:1:4: not XML: not well-formed (invalid token)"),
        (b"<?xml version='1.0' encoding='foo'?><a/>", "a.xml:1:1: not XML: unknown encoding: foo"),
        (BOMB, "a.xml:1:25: a DOCTYPE with entities is not read; expand them: xmllint --noent FILE"),
        (b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>', "a.xml:1:"),
        (b'<!DOCTYPE a SYSTEM "file:///etc/passwd"><a/>', ""),
        (b"\x89PNG\r\n", "a.xml:1:1: not text but a PNG picture"),
    ],
)
def test_what_is_no_xml_is_one_placed_line(data: bytes, said: str) -> None:
    if not said:
        assert xml(data).tag == "a"
        return
    with pytest.raises(FormatError) as caught:
        xml(data)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("1 2", "a.xml:2:10: xyz: expected 3 numbers, found 2 in '1 2'"),
        ("1 2 nan", "a.xml:2:10: xyz: 'nan' is not finite"),
        ("1 2 3cm", "a.xml:2:10: xyz: '3cm' has a unit"),
    ],
)
def test_a_bad_number_is_shown_where_it_stands(value: str, said: str) -> None:
    (element,) = xml(f"<a>\n<o  xyz='{value}'/></a>".encode()).children
    with pytest.raises(FormatError) as caught:
        element.numbers(3, "xyz")
    assert str(caught.value).startswith(said)
    assert caught.value.snippet.endswith("^")


def test_a_million_elements_inside_one_another_are_refused_in_a_line() -> None:
    with pytest.raises(FormatError, match="more than 100000 elements inside one another"):
        xml(b"<a>" * 200_000)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_an_entity_of_another_file_is_refused_and_not_left_out(encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n<!DOCTYPE a SYSTEM "x.dtd">\n<a xyz="1 &neg;2 3"/>'
    with pytest.raises(FormatError, match=r"^a\.xml:2:\d+: a DOCTYPE with entities of 'x\.dtd' is not read; expand: xmllint"):
        xml(text.encode(encoding))
    plain = text.replace("&neg;", "&#45;")
    assert xml(plain.encode(encoding)).attributes == {"xyz": "1 -2 3"}
