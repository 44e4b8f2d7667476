"""What is wrong in a stream of JSON ends where it ends: the same answers whatever the size of the blocks."""

from __future__ import annotations

import json
import random
from time import process_time
from typing import Any

import pytest
from flow import MOVE, flow

SIZES = (0, 1, 7, 64, 512, 4096)
LAYOUTS = ("[A,A]\n", "[\nA,\nA\n]\n", "[A,\n A]", "[\n  A ,\n  A\n]\n", "[\nA\n,A\n]\n", "[ A , A ]\n", "A\nA\n", "AA\n", "A A", "[A\n,\nA]")
EXTRAS: list[dict[str, Any]] = [{}, {"tags": ["a]", "{b", {"q": [1, 2]}]}, {"l": [{"b": 1}, {"c": 2}]}, {"t": "x" * 300}]


def broken(seeded: random.Random, text: str) -> str:
    """Break a record behind its first key: a character more or less, cut, a wrong word, a bracket or a colon missing."""
    at = seeded.randrange(text.index(",") + 1, len(text))
    ways = [
        text[:at] + seeded.choice('"{}[],:\\x \n') + text[at:], text[:at] + text[at + 1 :], text[:at], text.replace("1", "tru", 1),
        text.replace("]", "", 1), text.replace('"', "'"), text.replace(":", "", 1), text[:-1] + ",}", text + " " * 100,
    ]  # fmt: skip
    return seeded.choice(ways)


def stream_of(seed: int) -> bytes:
    """Make a stream of JSON in some layout with a few broken records."""
    seeded = random.Random(seed)  # noqa: S311 - a seed
    indent = seeded.choice([None, None, 2, 0])
    records = [json.dumps({"id": at, "x": 1, "y": 2, "z": 3} | seeded.choice(EXTRAS), indent=indent) for at in range(seeded.choice([2, 5, 24]))]
    for _ in range(seeded.choice([1, 1, 2, 3])):
        at = seeded.randrange(len(records))
        records[at] = broken(seeded, records[at]) if "," in records[at] else records[at]
    begin, between, end = seeded.choice(LAYOUTS).split("A")
    return (begin + between.join(records) + end).encode()


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.parametrize("on_error", ["skip", "null", "stop"])
def test_answers_and_errors_do_not_depend_on_the_size_of_blocks(seed: int, on_error: str) -> None:
    text = stream_of(seed)
    one, *others = (flow(text, MOVE._replace(on_error=on_error), "json", size=size, most=1000) for size in SIZES)
    for other in others:  # what is out before a run is stopped depends on it
        assert (other.told, other.status) == (one.told, one.status)
        assert other.text == one.text or on_error == "stop"


LONG = ",".join(['[1, {"x": 2}]', '{"x": [3]}'] * 4000)
WRONG = {
    "a word": f'{{"id": 1, "l": [{LONG}], "x": tru}}', "a comma": f'{{"id": 1, "l": [{LONG}],}}', "at its begin": f'{{"id" 1, "l": [{LONG}]}}',
    "no colon": f'{{"id": 1, "l" [{LONG}]}}', "a bracket less": f'{{"id": 1, "l": [{LONG}}}', "a bracket more": f'{{"id": 1, "l": [{LONG}]]}}',
    "of the other kind": f'{{"id": 1, "l": [{LONG}}}}}', "cut": f'{{"id": 1, "l": [{LONG}', "a quote": f'{{"id": 1, "l": [{LONG}], "k: 1}}',
    "quotes of Python": f"{{'id': 1, 'l': [{LONG}]}}", "blanks": '{"id": 1 x' + " " * 60_000 + "}",
}  # fmt: skip
GOOD = '{"id": 0, "x": 1, "y": 2, "z": 3}'


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("between", [", ", ",\n", ",\n  "])
@pytest.mark.parametrize("size", [0, 700])
def test_an_array_ends_where_a_record_is_broken(wrong: str, between: str, size: int) -> None:
    text = "[" + between.join([GOOD, GOOD, WRONG[wrong], *[GOOD] * 30]) + "]\n"
    result = flow(text.encode(), MOVE._replace(on_error="skip"), "json", size=size)
    assert (result.status, len(json.loads(result.text))) == (1, 2)
    (told,) = result.told
    assert "not JSON: " in told


REPEATED = {
    "broken records on a line": ("[", '{"x":1,"y":tru},', "]"), "unclosed brackets": ("[", '{"a":{tru},', "]"), "keys": ("[", '{"a":[1}{', "]"),
    "blanks behind a record": (GOOD, " ", "x"), "blanks in an array": (f"[{GOOD}", " ", "x]"), "line ends": (f"[{GOOD},", "\n", "x"),
    "unclosed on lines": ("[\n", '{"a":[1,\n', "]"), "quotes": ("[", '"', "]"), "commas": ("[", ",", "{"), "closing ones": (f"[{GOOD}", "]", "{"),
}  # fmt: skip


@pytest.mark.parametrize("repeated", REPEATED)
def test_what_is_wrong_takes_time_in_proportion(repeated: str) -> None:
    before, unit, behind = REPEATED[repeated]

    def took(count: int) -> float:
        begin = process_time()
        flow((before + unit * (count // len(unit)) + behind).encode(), MOVE._replace(on_error="skip"), "json")
        return process_time() - begin

    assert took(80_000) < 12 * min(took(20_000), took(20_000)) + 0.5
