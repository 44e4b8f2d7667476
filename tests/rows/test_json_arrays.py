"""JSON arrays stay JSON whichever records are left out, in every layout and for every size of block."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from flow import MOVE, flow
from hypothesis import given
from hypothesis import strategies as st

if TYPE_CHECKING:
    from collections.abc import Callable

GOOD, TEXT, HUGE = '{"id": "a,]", "x": 1, "y": 2, "z": 3}', '{"x": "a", "y": 2, "z": 3}', '{"x": 1e999, "y": 2, "z": 3}'
LAYOUTS = [
    "[{},{}]\n", "[\n{},\n{}\n]\n", "[{},\n {}]", "[\n  {} ,\n  {}\n]\n", "[\n{}\n,{}\n]\n", "[ {} , {} ]\n", "[{}\n,\n{}\n]",
]  # fmt: skip


def array(layout: str, records: list[str]) -> str:
    begin, between, end = layout.split("{}")
    return begin + between.join(records) + end


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("is_broken_up", [False, True])
@given(
    records=st.lists(st.sampled_from([GOOD, TEXT, HUGE]), min_size=1, max_size=24), size=st.sampled_from([0, 1, 30, 200])
)
def test_what_is_left_is_an_array(layout: str, records: list[str], size: int, *, is_broken_up: bool) -> None:
    shown = [record.replace(', "y"', ',\n"y"') for record in records] if is_broken_up else records
    text = array(layout, shown).encode()
    kept = flow(text, MOVE._replace(on_error="skip"), "json", size=size)
    good = records.count(GOOD)
    assert json.loads(kept.text) == [{"id": "a,]", "x": -1.0, "y": 3.0, "z": 6.0}] * good
    assert kept.status == (0 if good == len(records) else 3)
    nulls = flow(text, MOVE._replace(on_error="null"), "json", size=size)
    assert [each["y"] is not None for each in json.loads(nulls.text)] == [record == GOOD for record in records]
    assert all(each.keys() == json.loads(record).keys() for each, record in zip(json.loads(nulls.text), records, strict=True))


@given(records=st.lists(st.sampled_from([GOOD, TEXT, HUGE]), min_size=1, max_size=24), size=st.sampled_from([0, 1, 100]))
def test_each_line_without_a_result_is_null(records: list[str], size: int) -> None:
    outcome = flow("".join(f"{record}\n" for record in records).encode(), MOVE._replace(on_error="null"), "json", size=size)
    rows = [json.loads(line) for line in outcome.text.splitlines()]
    assert [row["x"] is not None for row in rows] == [each == GOOD for each in records]


@given(records=st.lists(st.sampled_from([GOOD, TEXT, HUGE]), min_size=1, max_size=24), size=st.sampled_from([0, 1, 100]))
def test_each_document_without_a_result_is_null(records: list[str], size: int) -> None:
    text = "".join(f"{record}\n---\n" for record in records).encode()
    outcome = flow(text, MOVE._replace(on_error="null"), "yaml", size=size)
    documents = outcome.text.decode().removesuffix("\n---\n").split("\n---\n")
    assert ['"x": null, "y": null' not in document for document in documents] == [record == GOOD for record in records]


@pytest.mark.parametrize("count", [1, 80])
@pytest.mark.parametrize("between", [", ", ",\n"])
@pytest.mark.parametrize("end", ["] trailing\n", "]\ntrailing\n", "\n", ",\n", ',{"x": 1', ""])
def test_arrays_with_a_broken_end_give_what_is_good(count: int, between: str, end: str) -> None:
    text = ("[" + between.join([GOOD] * count) + end).encode()
    stopped = flow(text, MOVE, "json")
    assert (stopped.status, stopped.text.count(b"}")) == (1, count)
    for on_error in ("skip", "null"):
        result = flow(text, MOVE._replace(on_error=on_error), "json")
        assert result.status == (3 if end in ("\n", ",\n", "") else 1)
        assert len([each for each in json.loads(result.text) if each]) == count


@pytest.mark.parametrize("text", [b"[]", b"[]\n", b"[\n]\n"])
def test_an_empty_array_stays_one(text: bytes) -> None:
    assert flow(text, MOVE, "json") == (text, [], 0)


def test_a_long_array_on_one_line_is_one_however_long_the_blocks() -> None:
    text = ("[" + ",".join([GOOD] * 3000) + "]\n").encode()
    result = flow(text, MOVE, "json", size=1 << 15)
    assert result == flow(text, MOVE, "json")
    assert len(json.loads(result.text)) == 3000


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("size", [0, 1, 30])
@pytest.mark.parametrize("more", [1, 80])
def test_nothing_is_written_of_an_array_whose_first_record_is_an_error(layout: str, size: int, more: int) -> None:
    for bad in (TEXT, HUGE):
        found = flow(array(layout, [bad, *[GOOD] * more]).encode(), MOVE, "json", size=size)
        assert (found.status, found.text) == (1, b"")
    good = flow(array(layout, [GOOD, *[TEXT] * more]).encode(), MOVE, "json", size=size)
    assert good.status == 1
    assert good.text.lstrip().startswith(b"[")


@pytest.mark.parametrize("text", ["[]\n", "[ ]", "[\n]\n"])
def test_an_empty_array_stays_what_it_is(text: str) -> None:
    for on_error in ("stop", "skip", "null"):
        assert flow(text.encode(), MOVE._replace(on_error=on_error), "json").text == text.encode()


@pytest.mark.parametrize("between", [" ", "\n", "\n  "])
@pytest.mark.parametrize("command", ["invert", "convert"])
def test_a_comma_that_is_missing_between_records_is_an_error(run: Callable[..., Any], command: str, between: str) -> None:
    record = '{"xyz":[1,2,3]}'
    text = f"[{record},\n{record}{between}{record}]\n"
    done = run(command, stdin=text)
    assert done.status == 1
    assert done.err == f"frametool: stdin:{2 + between.count(chr(10))}: a comma is missing before this record\n"
    left = run(command, "--on-error", "skip", stdin=text)
    assert (left.status, len(json.loads(left.out))) == (3, 2)


@pytest.mark.parametrize("count", [0, 1, 3, 200])
@pytest.mark.parametrize("sink", ["json", "yaml", "csv", "npy"])
def test_an_array_that_was_cut_is_told_by_every_command(count: int, sink: str, run: Callable[..., Any]) -> None:
    records = ",\n".join([f'{{"xyz": [{row}, 2, 3], "t": {row}}}' for row in range(count)])
    (cut, whole), place = (f"[\n{records}", f"[\n{records}\n]\n\n"), f"a.json:{max(count, 0) + 1}"
    written = ("convert", "--to", "quaternion", "-i", "a.json", "-f", sink, "-o", "out", "--force")
    for command in (written, ("mean", "a.json"), ("compare", "--align", "none", "a.json", "a.json"))[: 3 if count > 1 else 1]:
        refused = run(*command, files={"a.json": cut})
        assert (refused.status in (1, 2), f"{place}: the array does not end: its ] is missing" in refused.err) == (True, True), refused.err
        assert "does not end" not in run(*command, files={"a.json": whole}).err
