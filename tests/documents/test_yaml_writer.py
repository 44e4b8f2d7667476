"""What is written reads back: by our reader, and by YAML 1.1's."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as some

from frametool.documents.document import parse_documents
from frametool.documents.writers import dump_yaml
from frametool.errors import ValueInvalid

ODD_NAMES = (
    *[
        "on",
        "off",
        "yes",
        "no",
        "y",
        "n",
        "Y",
        "N",
        "true",
        "False",
        "null",
        "~",
        "nan",
        ".nan",
        ".inf",
        "inf",
        "007",
        "0o7",
        "0x1F",
        "1e3",
        "+.5",
        "-.5",
        "1_000",
        "12:30",
        "2026-11-20",
    ],
    *[
        "@x",
        "%x",
        "&x",
        "*x",
        "!x",
        "|x",
        ">x",
        "<<",
        "=",
        "-",
        "?",
        ":",
        "--",
        "---",
        "...",
        "[a]",
        "{a}",
        "a:",
        ":a",
        "a#b",
        "#a",
        ",a",
        "`x`",
        "'x'",
        '"x"',
        "x\\y",
        "a,b",
    ],
    *(
        "",
        " ",
        " a",
        "a ",
        "a: b",
        "a #b",
        "a\tb",
        "a\nb",
        "\ufeff",
        "\u2028",
        "\x85",
        "\x07",
        "\x7f",
        "a\u00a0b",
        "é",
        "龜",
        "🐢",
    ),
    *("robot::base", "/base_link", "camera0/x", "base link", "e5", "_", "a" * 3000, "é" * 900, "\ue000", "\ufffe"),
)


def as_text(value: object) -> object:
    """Give what our reader makes of a value: numbers and truth values as text."""
    if isinstance(value, dict):
        return {key: as_text(each) for key, each in value.items()}
    if isinstance(value, list):
        return [as_text(each) for each in value]
    if value is None or isinstance(value, str):
        return value
    return str(value).lower() if isinstance(value, bool) else float(value)  # type: ignore[arg-type]


def numbers_read(value: object, like: object) -> object:
    """Turn text into a number wherever `like` holds one."""
    if isinstance(value, dict) and isinstance(like, dict):
        return {key: numbers_read(each, like[key]) for key, each in value.items()}
    if isinstance(value, list) and isinstance(like, list):
        return [numbers_read(each, model) for each, model in zip(value, like, strict=True)]
    return float(value) if isinstance(like, float) and isinstance(value, str) else value


def reread(value: object) -> object:
    """Write and read with our own reader."""
    (document,) = parse_documents(dump_yaml(value), "written")
    return numbers_read(document.value, as_text(value))


@pytest.mark.parametrize("name", ODD_NAMES)
def test_a_name_reads_back_as_the_same_text_wherever_it_stands(name: str) -> None:
    names = [name] if name else []
    value = {"names": [name, name], "parent": name, "list": [{"name": name, "of": {"name": name}}]}
    keyed = {each: {each: 1.0, "below": {each: [1.0]}} for each in names}
    assert yaml.safe_load(dump_yaml(value)) == value
    assert reread(value) == value
    assert yaml.safe_load(dump_yaml(keyed) if keyed else "{}") == keyed
    assert not keyed or reread(keyed) == keyed


NAMES = some.text(some.characters(exclude_categories=["Cs"]), min_size=1)
FLOATS = some.floats(allow_nan=False, allow_infinity=False)
SCALARS = NAMES | FLOATS | some.none() | some.booleans() | some.integers(-(2**53), 2**53)
VALUES = some.recursive(SCALARS, lambda inner: some.lists(inner) | some.dictionaries(NAMES, inner), max_leaves=12)


@settings(max_examples=60, deadline=None)
@given(some.dictionaries(NAMES, VALUES, min_size=1))
def test_any_value_reads_back_equal(value: dict[str, object]) -> None:
    assert yaml.safe_load(dump_yaml(value)) == value
    assert reread(value) == as_text(value)


@settings(max_examples=150, deadline=None)
@given(FLOATS)
def test_a_float_reads_back_to_the_same_bits(value: float) -> None:
    assert yaml.safe_load(dump_yaml([value]))[0].hex() == value.hex()


def test_the_look_is_blocks_with_short_leaves_on_one_line() -> None:
    value = {
        "name": "camera",
        "xyz": [1.0, 2e-05, 3.0],
        "quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        "matrix": [[1.0, 0.0], [0.0, 1.0]],
        "frames": [{"name": "on", "parent": "world"}],
        "empty": {},
    }
    assert dump_yaml(value) == (
        "name: camera\n"
        "xyz: [1.0, 2.0e-05, 3.0]\n"
        "quaternion: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}\n"
        "matrix:\n  - [1.0, 0.0]\n  - [0.0, 1.0]\n"
        'frames:\n  - name: "on"\n    parent: world\n'
        "empty: {}\n"
    )


def test_a_number_may_be_written_with_fixed_decimals() -> None:
    assert dump_yaml({"xyz": [1.0, 2.5]}, "{:.3f}".format) == "xyz: [1.000, 2.500]\n"


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "\ud83d"])
def test_what_would_not_read_back_is_not_written(value: object) -> None:
    with pytest.raises(ValueInvalid):
        dump_yaml([value])
