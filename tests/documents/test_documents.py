"""The document loader: everything stays text, every trap is a value or one placed line."""

from __future__ import annotations

import gc
import json
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from hypothesis import assume, example, given, settings
from hypothesis import strategies as some

from frametool import sizes
from frametool.documents import yaml as yaml_documents
from frametool.documents.document import explain_scalar, format_error, locate_many, parse_documents, parse_nodes
from frametool.documents.source import InputFile, decode
from frametool.documents.writers import dump_json
from frametool.errors import FileProblem, FormatError

if TYPE_CHECKING:
    from pathlib import Path


def values(text: str) -> list[Any]:
    """Return the values of the documents of a text."""
    return [document.value for document in parse_documents(text, "f")]


def refusal(text: str) -> str:
    """Return the message a text is refused with."""
    with pytest.raises(FormatError) as caught:
        parse_documents(text, "f")
    assert "\n" not in str(caught.value)
    return str(caught.value)


READ = {
    "on: off": [{"on": "off"}],
    "007: 12:30": [{"007": "12:30"}],
    "2026-11-20: 1e-3": [{"2026-11-20": "1e-3"}],
    "{1: a, 1.0: b, true: c}": [{"1": "a", "1.0": "b", "true": "c"}],
    "null: 1\n~: 2": [{"null": "1", "~": "2"}],
    "a: [~, null, Null, NULL, '', 'null', \"~\"]": [{"a": [None, None, None, None, "", "null", "~"]}],
    "a:\nb: 1": [{"a": None, "b": "1"}],
    "a: 1\n---\n# empty\n---\nb: 2\n---\n": [{"a": "1"}, {"b": "2"}],
    "": [],
    "# only a comment\n": [],
    "\ufeffa: 1": [{"a": "1"}],
    "a:\t1\t\nb: 2": [{"a": "1", "b": "2"}],
    "%YAML 1.2\n---\na: 010": [{"a": "010"}],
    "a: &p [1, {b: 2}]\nc: *p": [{"a": ["1", {"b": "2"}], "c": ["1", {"b": "2"}]}],
    "'<<': 1": [{"<<": "1"}],
    '{"a": [true, false, null, 1e-3, 010]}': [{"a": ["true", "false", None, "1e-3", "010"]}],
    '{"a": [true, false, null, 1e-3, NaN],\t"b": "\\ud83d\\udc22"}': [
        {"a": ["true", "false", None, "1e-3", "NaN"], "b": "🐢"}
    ],
    '{"a": 1}\n{"a": 2}\n': [{"a": "1"}, {"a": "2"}],
    "a: 1\r  \rb: 2": [{"a": "1", "b": "2"}],
    "robot::base: /x": [{"robot::base": "/x"}],
    '{"n": ' + "9" * 5000 + "}": [{"n": "9" * 5000}],
}

REFUSED = {
    "a: 1\nb: {x: 1, x: 2}": "f:2:11: key 'x' appears twice; first at 2:5",
    '{"a": {"b": 1,\n "b": 2}}': "f:2:2: key 'b' appears twice; first at 1:8",
    "- {a: 1}\n- a: 1\n  b: 2\n  a: 3": "f:4:3: key 'a' appears twice; first at 2:3",
    "a:\n\tb: 1": "f:2:1: a tab cannot indent YAML; use blanks",
    "a: 1\n\tb: 2": "f:2:1: a tab cannot indent YAML; use blanks",
    "a: @x": "f:1:4: found character that cannot start any token; quote the text",
    "`x`: 1": "f:1:1: found character that cannot start any token; quote the text",
    "%x: 1": "f:1:3: found unexpected non-alphabetical character, while scanning a directive",
    "a: !Rpy {deg: [1]}": "f:1:4: tag !Rpy is not read here",
    "a: !!float abc": "f:1:4: tag !!float is not read here",
    "b: &b {x: 1}\na:\n  <<: *b": "f:3:3: merge keys (<<) are not supported; write the entries out",
    "&a [*a]": "f:1:5: alias *a is inside its own anchor",
    "a: *b": "f:1:4: alias *b has no anchor &b before it",
    "? [1]\n: 2": "f:1:3: a key must be one text, not a list or map",
    ": 1": "f:1:1: did not find expected key; check the indentation and the brackets above",
    "'': 1": "f:1:1: an empty key; write a name, or quotes around a blank one",
    '{"": 1}': "f:1:2: an empty key",
    '{"a": "\\ud83d"}': "f:1:8: \\ud83d is half a character; its other half is missing",
    "a: \ud83d": "f:1:4: not UTF-8: half a character (U+D83D)",
    "a: \x01": "f:1:4: the character U+0001 is not allowed in YAML or JSON; is this text?",
    "[" * 200_000: "f:1:991: nested deeper than 990 levels",
    "[" * 991 + "]" * 991: "f:1:991: nested deeper than 990 levels",
    '{"a":' * 200_000: "f:1:4951: nested deeper than 990 levels",
    "- " * 5000: "f:1:1981: nested deeper than 990 levels",
    "a: [1, 2": "f:1:9: did not find expected ',' or ']', while parsing a flow sequence",
    "x: 1\na: [1,\n  2": "f:3:4: did not find expected ',' or ']', while parsing a flow sequence",
}


@pytest.mark.parametrize("text", READ, ids=lambda text: ascii(text)[:40])
def test_every_scalar_stays_text(text: str) -> None:
    assert values(text) == READ[text]


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: ascii(text)[:40])
def test_what_cannot_be_read_is_one_placed_line(text: str) -> None:
    assert refusal(text) == REFUSED[text]


@pytest.mark.parametrize("text", [text for text in READ if "\t" not in text], ids=lambda text: ascii(text)[:40])
def test_the_parser_without_libyaml_reads_the_same(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml_documents, "_Loader", yaml.SafeLoader)
    assert values(text) == READ[text]


@pytest.mark.parametrize("text", ["[" + "[]," * 30 + "[]]", "[a," + "[]," * 30 + "[]]", "- []\n" * 30])
def test_lists_and_maps_are_counted(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizes, "MOST_CONTAINERS", 30)
    assert "lists and maps in one file; split it" in refusal(text)


def test_a_text_too_long_is_refused_before_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizes, "MOST_CHARACTERS", 100)
    assert refusal("a" * 101) == "f: longer than 100 characters, the most in one file; split it"
    (tmp_path / "long.yaml").write_text("a" * 101)
    with pytest.raises(FormatError, match="longer than 100 bytes"):
        InputFile(tmp_path / "long.yaml").read()


@pytest.mark.parametrize("text", ["1," * 31, "- 1\n" * 31])
def test_values_in_no_list_of_their_own_are_counted(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizes, "MOST_VALUES", 30)
    assert refusal(text) == "f: more than 30 commas and line ends, the most in one file; split it"


def test_a_million_messages_are_within_the_limits() -> None:
    stamp = {"sec": 1_700_000_000, "nanosec": 123_456_789}
    moved, turned = (dict.fromkeys(names, -0.7071067811865476) for names in ("xyz", "xyzw"))
    transform = {"translation": moved, "rotation": turned}
    message = {"header": {"stamp": stamp, "frame_id": "f123456"}, "child_frame_id": "f123457", "transform": transform}
    text = json.dumps(message, indent=4)
    assert 1e6 * text.count("{") < sizes.MOST_CONTAINERS
    assert 1e6 * (text.count(",") + text.count("\n") + 2) < sizes.MOST_VALUES
    assert 1e6 * len(text) < sizes.MOST_CHARACTERS


def laughs(depth: int) -> str:
    """Return a text whose aliases would repeat 9**depth values."""
    rows = [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, depth)]
    return "\n".join(["a0: &a0 [x, x, x, x, x, x, x, x, x]", *rows])


def test_aliases_cannot_grow_a_text_without_bound() -> None:
    assert "aliases repeat more than" in refusal(laughs(9))
    assert "more than 1000 aliases" in refusal("a: &a 1\nb: [" + "*a, " * 1001 + "]")


def test_aliases_cannot_nest_deeper_than_the_limit() -> None:
    rows = "\n".join(f"a{n}: &a{n} " + "[" * 400 + f"*a{n - 1}" + "]" * 400 for n in range(1, 4))
    assert "nested deeper than 990" in refusal(f"a0: &a0 [1]\n{rows}")


def test_an_alias_is_a_value_of_its_own() -> None:
    (value,) = values("a: &p [1, [2]]\nb: *p")
    value["a"][1].append("3")
    assert value["b"] == ["1", ["2"]]


@pytest.mark.parametrize("enabled", [True, False])
@pytest.mark.parametrize("text", ["a: 1", "a: ["])
def test_the_garbage_collector_is_left_as_it_was(enabled: bool, text: str) -> None:  # noqa: FBT001
    was = gc.isenabled()
    (gc.enable if enabled else gc.disable)()
    try:
        values(text) if text == "a: 1" else refusal(text)
        assert gc.isenabled() == enabled
    finally:
        (gc.enable if was else gc.disable)()


TREE = 'frames:\n  - {name: on, xyz: [1, "a", 3]}\n  - name: b\n    rpy:\n---\nx:\n  y: 2\n'
PLACES = {
    (0, "frames"): ((2, 3), (1, 1)),
    (0, "frames", 0): ((2, 5), (2, 5)),
    (0, "frames", 0, "name"): ((2, 12), (2, 6)),
    (0, "frames", 0, "xyz", 1): ((2, 25), (2, 25)),
    (0, "frames", 1, "rpy"): ((4, 9), (4, 5)),
    (0, "frames", 1, "missing"): ((3, 5), (3, 5)),
    (1, "x", "y"): ((7, 6), (7, 3)),
    (9,): ((1, 1), (1, 1)),
}


@pytest.mark.parametrize("path", PLACES, ids=str)
def test_a_path_is_found_in_yaml(path: tuple[int | str, ...]) -> None:
    assert (*locate_many(TREE, [path]), *locate_many(TREE, [path], key=True)) == PLACES[path]


def test_a_path_is_found_in_json() -> None:
    text = '{"a": {"\\u0062\\"": [1,\t{"c": "\\ud83d\\udc22]"}],\n "d": null}}\n{"a": 5}'
    paths = [(0, "a", 'b"', 1, "c"), (0, "a", "d"), (1, "a")]
    assert locate_many(text, paths) == [(1, 30), (2, 7), (3, 7)]
    assert locate_many(text, paths, key=True) == [(1, 25), (2, 2), (3, 2)]


LETTERS = 'ab"\\ :,[]{}#\té龜🐢\u2028\x85\n\ue000'
NAMES = some.text(LETTERS, min_size=1, max_size=4)
NESTED = some.recursive(
    some.text(LETTERS, max_size=5), lambda inner: some.lists(inner) | some.dictionaries(NAMES, inner), max_leaves=10
)


def leaves(value: Any, path: tuple[Any, ...]) -> list[tuple[tuple[Any, ...], str]]:
    """Return the paths and texts of the leaves."""
    if isinstance(value, str):
        return [(path, value)]
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    return [leaf for key, each in inner for leaf in leaves(each, (*path, key))]


@settings(max_examples=60, deadline=None)
@given(some.dictionaries(NAMES, NESTED, min_size=1), some.sampled_from([None, 1]), some.booleans())
def test_at_the_place_of_a_leaf_stands_the_leaf(value: dict[str, Any], indent: int | None, ascii_only: bool) -> None:  # noqa: FBT001
    text = json.dumps(value, indent=indent, ensure_ascii=ascii_only)
    (document,) = parse_documents(text, "f")
    assert document.value == value
    found = leaves(value, (0,))
    rows = yaml_lines(text)
    for (line, column), (_, leaf) in zip(locate_many(text, [path for path, _ in found]), found, strict=True):
        assert rows[line - 1].startswith(json.dumps(leaf, ensure_ascii=ascii_only)[:1], column - 1)


@settings(max_examples=60, deadline=None)
@given(some.dictionaries(NAMES, NESTED, min_size=1))
def test_json_and_yaml_have_the_same_nodes(value: dict[str, Any]) -> None:
    text = json.dumps(value)
    assume("\\ud8" not in text)  # YAML has no pairs of escapes
    (ours,) = parse_nodes(text)
    (as_yaml,) = parse_nodes(f"--- {text}")
    assert [(leaf.start + 4, leaf.end + 4, leaf.value, leaf.quote) for leaf in ours.leaves()] == [
        (leaf.start, leaf.end, leaf.value, leaf.quote) for leaf in as_yaml.leaves()
    ]
    assert [json.loads(text[leaf.start : leaf.end]) for leaf in ours.leaves()] == [leaf.value for leaf in ours.leaves()]


@pytest.mark.parametrize("text", ["[" * 990 + "1" + "]" * 990, "- " * 990 + "1", '{"a":' * 990 + "1" + "}" * 990])
def test_the_deepest_text_has_nodes_and_places(text: str) -> None:
    (node,) = parse_nodes(text)
    (leaf,) = node.leaves()
    assert text[leaf.start : leaf.end] == "1"
    step: int | str = "a" if text.startswith("{") else 0
    assert locate_many(text, [(0, *[step] * 990)]) == [(1, leaf.start + 1)]


def yaml_lines(text: str) -> list[str]:
    """Split at what YAML takes for line ends."""
    for end in "\x85\u2028\u2029":
        text = text.replace(end, "\n")
    return text.split("\n")


def test_an_error_shows_the_line_with_a_caret_below_the_column() -> None:
    (document,) = parse_documents("a:\t{龜: 1,\tb: 2}", "f")
    error = format_error(document.source, (0, "a", "b"), "no", key=True)
    assert str(error) == "f:1:11: no"
    assert error.snippet == "a:\t{龜: 1,\tb: 2}\n  \t       \t^"


def test_a_long_line_is_cut_around_the_column() -> None:
    text = "[" + "1, " * 5000 + "x]"
    (document,) = parse_documents(text, "f")
    error = format_error(document.source, (0, 2500), "no")
    line, caret = error.snippet.split("\n")
    assert len(line) <= 80
    assert line[caret.index("^")] == "1"


def test_a_terminal_is_not_commanded_by_a_snippet() -> None:
    (document,) = parse_documents('a: "\u202e\\e[2J\x85b"', "f")
    assert document.value == {"a": "\u202e\x1b[2J b"}
    assert format_error(document.source, (0, "a"), "no").snippet == 'a: "\ufffd\\e[2J\n   ^'


ENCODED = {
    b"\xef\xbb\xbfa: 1": "a: 1",
    "a: é".encode(): "a: é",
    "a: é".encode("utf-16"): "a: é",
    b"\xfe\xff" + "a: 龜".encode("utf-16-be"): "a: 龜",
}


@pytest.mark.parametrize("data", ENCODED)
def test_utf_8_and_marked_utf_16_are_text(data: bytes) -> None:
    assert decode(data, "f") == ENCODED[data]


BINARY = {
    b"a: 1\nb: caf\xe9": "f:2:7: not UTF-8: byte 0xe9",
    b"\xef\xbb\xbf\xe9": "f:1:1: not UTF-8: byte 0xe9",
    b"\xff\xfea\x00\x00\xd8": "f:1:2: UTF-16, which",
    b"\x7fELF\x02\x01\x01\x00": "f:1:8: not text but a program (ELF)",
    b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR": "f:1:1: not text but a PNG picture",
    b"\x1f\x8b\x08\x00": "f:1:2: not text but gzip data; unpack it first",
    b"a: 1\n\x00": "f:2:1: not text: it holds a NUL byte",
    bytes(range(256)): "f:3:115: not text but binary data",
}


@pytest.mark.parametrize("data", BINARY)
def test_other_bytes_are_refused_with_their_place(data: bytes) -> None:
    with pytest.raises(FormatError) as caught:
        decode(data, "f")
    assert str(caught.value).startswith(BINARY[data])


def test_a_file_that_cannot_be_read_is_a_file_problem(tmp_path: Path) -> None:
    with pytest.raises(FileProblem, match="no such file"):
        InputFile(tmp_path / "none.yaml").read()
    with pytest.raises(FileProblem, match="is a directory"):
        InputFile(tmp_path).read()
    with pytest.raises(FileProblem, match="no file name"):
        InputFile("a\0b").read()


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("x:1.5", "write a blank after 'x:'"),
        ("x:1.5 y:2", "write a blank after 'x:'"),
        ("x:\u00a01.5", "it has no-break space (U+00A0), invisible; use an ordinary blank"),
        ("x = 1", "write 'x: ' instead of '='"),
        ("base_link", ""),
        ("http://a", ""),
    ],
)
def test_a_text_where_a_mapping_was_meant_is_explained(text: str, hint: str) -> None:
    assert explain_scalar(text) == hint


PIECES = (
    *(b"{", b"}", b"[", b"]", b":", b": ", b",", b'"', b"'", b"\t", b"\n", b"- ", b"? ", b"&a ", b"*a ", b"!x "),
    *(b"%", b"@", b"#", b"\xff", b"\x00", b"\xc2\x85", b"\xe2\x80\xa8", b"\xef\xbb\xbf", b"---\n", b"...\n", b"|\n"),
    *(b"<<: ", b"\\ud83d", b"\r", b"null", b"1e999", b"\xed\xa0\x80", b"%YAML 1.1\n", b"%YAML:1.0\n", b"a", b"b: 1"),
)


@settings(max_examples=400, deadline=None)
@given(some.binary(max_size=40) | some.lists(some.sampled_from(PIECES), max_size=25).map(b"".join))
@example(b"? l}")
def test_any_bytes_are_documents_or_one_placed_line(data: bytes) -> None:
    try:
        text = decode(data, "f")
        for document in parse_documents(text, "f"):
            assert locate_many(text, [(document.index,)]) >= [(1, 1)]
    except FormatError as error:
        assert error.line >= 1  # noqa: PT017 - either outcome is right
        assert error.column >= 1  # noqa: PT017
        assert not {"\n", "\r"} & set(str(error))  # noqa: PT017


def list_of_frames(count: int) -> str:
    """Return a tree in list form."""
    row = (
        "  - {{name: f{}, parent: f{}, xyz: [0.692039, 3.022651, -4.368932], rpy_deg: [-68.7746, 46.9732, -4.9959]}}\n"
    )
    return "frames:\n" + "".join(row.format(n + 1, n) for n in range(count))


def test_many_frames_are_read() -> None:
    (document,) = parse_documents(list_of_frames(2000), "f")
    assert len(document.value["frames"]) == 2000
    ((line, column),) = locate_many(document.source.text, [(0, "frames", 1999, "rpy_deg", 2)])
    assert document.source.text.split("\n")[line - 1][column - 1 :] == "-4.9959]}"
    assert line == 2001


@pytest.mark.parametrize("text", ["", "base_link", "-1.5", 'a"b', "a\\b", "a/b", "\u00e9", "\x7f", "\n", "\ud800", *map(chr, range(128))])
def test_texts_are_written_as_json_writes_them(text: str) -> None:
    assert json.loads(dump_json(text)) == text
    assert dump_json(text) == json.dumps(text, ensure_ascii=not text.isprintable())
