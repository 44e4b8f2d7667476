"""A record's result never depends on its neighbours, whatever is wrong with them and wherever blocks are cut."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from flow import INVERT, MOVE, Asked, Flow, convert, flow
from hypothesis import given, settings
from hypothesis import strategies as st

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


RECORDS = {
    "flat": '{{"x":{0},"y":2,"z":3,"qx":0,"qy":0,"qz":1,"qw":0}}',
    "point": '{{"id":{0},"point":[{0},2,3],"note":"a"}}',
    "pose": '{{"name":"b","parent":"a","xyz":[1,{0},3],"rpy":[0,0,0.5]}}',
    "message": '{{"header":{{"stamp":{{"sec":1,"nanosec":2}},"frame_id":"a"}},"child_frame_id":"b","transform":'
    '{{"translation":{{"x":{0},"y":2,"z":3}},"rotation":{{"x":0,"y":0,"z":0,"w":1}}}}}}',
    "plane": '{{"x":1,"y":{0},"yaw":0.25}}',
}
MUTATIONS: dict[str, Callable[[str], str]] = {
    "cut off": lambda text: text[:-1],
    "no beginning": lambda text: text[1:],
    "one bracket more": lambda text: text + "}",
    "null": lambda text: text.replace("2", "null", 1).replace('"qw":0', '"qw":null'),
    "no name": lambda text: text.replace('"b"', '""'),
    "word": lambda text: text.replace("2", '"oops"', 1),
    "no JSON number": lambda text: text.replace("2", "1.", 1),
    "huge": lambda text: text.replace("2", "4e306", 1),
    "many turns": lambda text: text.replace("0.5", "4e6").replace("0.25", "4e6"),
    "not finite": lambda text: text.replace("2", "1e999", 1),
    "other key": lambda text: text.replace('"y"', '"yy"').replace('"parent"', '"frame_id"'),
    "key twice": lambda text: text.replace("{", '{"k":1,"k":2,', 1),
    "a list": lambda _text: "[1, 2, 3]",
    "a word": lambda _text: "foo",
    "nothing": lambda _text: "{}",
    "two on a line": lambda text: text + " " + text,
    "a cell of half a text": lambda text: text.replace(":", ':"', 1),
    "no text": lambda text: text.replace("2", '"\udcff"', 1),
}
REQUESTS = {
    "move": MOVE._replace(rename=lambda _parent, name: ("m", name)),
    "invert": INVERT._replace(rename=lambda parent, name: (name, parent)),
    "convert": convert("rpy_deg"),
}
BYTES = ("utf-8", "surrogateescape")


def run(lines: list[str], request: Asked, size: int) -> Flow:
    text = "".join(f"{line}\n" for line in lines).encode(*BYTES)
    return flow(text, request._replace(on_error="skip"), "json", size=size)


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("wanted", REQUESTS)
@pytest.mark.parametrize("kind", RECORDS)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_mutated_line_changes_no_other(kind: str, wanted: str, data: st.DataObject) -> None:
    if kind == "plane" and wanted == "move":
        return  # leaves the plane
    count = data.draw(st.integers(1, 160))
    place = data.draw(st.integers(0, count - 1))
    mutation = data.draw(st.sampled_from(sorted(MUTATIONS)))
    size = data.draw(st.sampled_from([0, 64, 300, 1000]))
    lines = [RECORDS[kind].format(index % 7) for index in range(count)]
    clean = run(lines, REQUESTS[wanted], size).text.splitlines()
    lines[place] = MUTATIONS[mutation](lines[place])
    found = run(lines, REQUESTS[wanted], size).text.splitlines()
    others = clean[:place] + clean[place + 1 :]
    more = len(found) - len(others)
    assert found[:place] + found[place + more :] == others
    assert more in (0, 1, 2)


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("layout", ["array", "pretty"])
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_mutated_item_of_an_array_changes_none_before_it_and_none_behind_it_if_it_is_json(layout: str, data: st.DataObject) -> None:
    count = data.draw(st.integers(2, 60))
    place = data.draw(st.integers(0, count - 1))
    # a bracket too many or too few ends or holds the array itself
    inner = sorted(set(MUTATIONS) - {"cut off", "no beginning", "one bracket more", "a cell of half a text", "two on a line"})
    mutation = data.draw(st.sampled_from(inner))
    size = data.draw(st.sampled_from([0, 64, 1000]))
    items = [RECORDS["flat"].format(index % 7) for index in range(count)]

    def run_array(texts: list[str]) -> list[object]:
        shown = [text.replace(',"y"', ',\n  "y"') for text in texts] if layout == "pretty" else texts
        text = ("[" + ",\n".join(shown) + "]\n").encode(*BYTES)
        out: list[object] = json.loads(flow(text, REQUESTS["invert"]._replace(on_error="skip"), "json", size=size).text)
        return out

    clean = run_array(items)
    items[place] = MUTATIONS[mutation](items[place])
    found = run_array(items)
    others = clean[:place] + clean[place + 1 :]
    try:
        json.loads(f"[{items[place]}]")
    except ValueError:
        assert found[:place] == clean[:place]
    else:
        assert found[:place] + found[place + len(found) - len(others) :] == others


@pytest.mark.parametrize("count", [1, 20, 700])
def test_a_first_line_without_its_brace_hides_no_other(count: int) -> None:
    good = RECORDS["flat"].format(1)
    found = run([good[:-1], *[good] * count], REQUESTS["invert"], 0)
    assert found.text.count(b"\n") == count
    assert found.told[0].startswith("in:1:")


def test_a_mark_between_joined_files_is_passed_over() -> None:
    document = "xyz: [1, 2, 3]\n---\n"
    found = flow((document + "\ufeff" + document).encode(), INVERT, "yaml")
    assert (found.status, found.text.count(b"[-1.0, -2.0, -3.0]")) == (0, 2)


@pytest.mark.parametrize("text", ['[{"x":1,"y":2,"z":3} {"x":1,"y":2,"z":3},{"x":1,"y":2,"z":3}]\n', '[\n{"x":1,"y":2,"z":3}\n{"x":1,"y":2,"z":3},\n{"x":1,"y":2,"z":3}]'])
def test_a_comma_that_is_missing_is_a_fault_of_the_record_behind_it(text: str) -> None:
    found = flow(text.encode(), MOVE._replace(on_error="skip"), "json")
    assert (found.status, len(json.loads(found.text))) == (3, 2)
    assert "a comma is missing" in found.told[0]


PRINTED = [
    f"header:\n  stamp: {{sec: {at}, nanosec: 0}}\n  frame_id: odom\npose:\n  position: {{x: {at}.0, y: 2.0, z: 3.0}}\n"
    f"  orientation: {{x: 0.0, y: 0.0, z: {at * 0.25}, w: {(1 - at * at / 16) ** 0.5}}}\n---\n" for at in range(4)
]  # fmt: skip
WARNING = "[WARN] [1700000000.1] [echo]: zu spät\n"
LOSS = "A message was lost!!!\n\ttotal count change:1\n\ttotal count: 1---\n"


@pytest.mark.parametrize("noise", [WARNING, LOSS, "$ ros2 topic echo /pose\n", "^C\n"])
@pytest.mark.parametrize("command", [
    "mean -f json", "relative --first -f csv", "relative --consecutive -f json", "convert --to rpy --unwrap -f csv", "convert -f csv", "convert -f tum", "calc -e d=norm(trans(row)) -f csv",
])  # fmt: skip
def test_what_tools_print_between_messages_changes_no_result(command: str, noise: str, run: Callable[..., Any]) -> None:
    first, second, *others = PRINTED
    wanted = run(*command.split(), stdin="".join(PRINTED))
    assert wanted.status == 0
    texts = [noise + first + second, first + noise + second, noise + first + second + noise]
    texts += [first + second.replace("pose:", f"{WARNING}pose:")]
    for text in texts:
        done = run(*command.split(), stdin=text + "".join(others))
        assert (done.status, done.out) == (0, wanted.out), text
