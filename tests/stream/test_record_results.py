"""Results of records in another form: those computed in bulk are those computed one by one, with all that is told."""

from __future__ import annotations

import json
import math
import random
from io import BytesIO
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import pytest
import yaml

from frametool.errors import FrametoolError, heard_by
from frametool.grammar.result import Result, Style
from frametool.stream import record_results, record_values
from frametool.stream.faults import SKIP, BadRows
from frametool.stream.record_cuts import RecordCutter
from frametool.stream.record_results import AlikeRecords, stream_results
from frametool.stream.request import Operation, Request
from frametool.stream.splitter import Splitter

if TYPE_CHECKING:
    from collections.abc import Callable

COUNT = 60
NUMBERS = (0, 1, -3, -0.0, 1e-9, 123456.789, 1e300, 0.1)
ODD_CUTS = (("1", '"x"'), ("0", "null"), ("}", ""), (":", ": nan ,"))
TEXTS = ("x", "a b", 'quo"te', "comma,", "é\\n\n", "null", "1", "", None, True, 1.5, [1, 2], {"a": {"b": "c"}})


def unit(rng: random.Random, digits: int) -> list[float]:
    """Return a random quaternion, rounded."""
    parts = [rng.gauss(0, 1) for _ in range(4)]
    return [round(part / math.hypot(*parts), digits) for part in parts]


def a_record(kind: str, rng: random.Random, at: int) -> dict[str, Any]:
    """Return one record of a kind."""
    xyz, q = [rng.choice(NUMBERS) for _ in range(3)], unit(rng, 17)
    position, rotation = dict(zip("xyz", xyz, strict=True)), dict(zip("xyzw", q, strict=True))
    header = {"stamp": {"sec": at, "nanosec": at * 1000}, "frame_id": rng.choice(["map", "map", "odom"])}
    made: dict[str, dict[str, Any]] = {
        "pose": {"stamp": f"{at / 100:.2f}", "xyz": xyz, "xyzw": q},
        "rough": {"t": at, "xyz": xyz, "wxyz": unit(rng, rng.choice([2, 3, 17]))},
        "degrees": {"xyz": xyz, "rpy": [rng.uniform(-9, 9) for _ in range(3)], "parent": "map", "name": "b"},
        "stamped": {"header": header, "pose": {"position": position, "orientation": rotation}, "seq": at},
        "transform": {"header": header, "child_frame_id": "b", "transform": {"translation": position, "rotation": rotation}},
        "point": {"point": xyz, "frame": "map", "stamp_ns": at, "of": {"id": at}},
        "flat": {**position, "intensity": rng.random()},
        "uncertain": {"xyz": xyz, "xyzw": q, "sigma": {"xyz": 0.1, "rpy": 0.2}},
        "place": {"xyz": xyz, "stamp": at},
        "turn": {"xyzw": q, "stamp": at},
    }
    return made[kind]


def a_stream(seed: int) -> tuple[str, bytes]:
    """Return records, in a form and layout of their own: alike, mixed, and some of them broken."""
    rng = random.Random(seed)  # noqa: S311 - the same streams in every run
    kinds = rng.sample(["pose", "rough", "degrees", "stamped", "transform", "point", "flat", "uncertain", "place", "turn"], rng.choice([1, 1, 2, 3]))
    is_mixed, has_more, is_broken = (rng.random() < part for part in (0.4, 0.5, 0.3))
    records = []
    for at in range(COUNT):
        kind = rng.choice(kinds) if is_mixed else kinds[at * len(kinds) // COUNT]
        more = {"tag": rng.choice(TEXTS), "deep": {"list": [at, {"text": rng.choice(TEXTS[:6])}]}} if has_more else {}
        records.append(a_record(kind, rng, at) | (more if rng.random() < 0.9 else {}))
    layout = rng.choice(["lines", "lines", "array", "pretty", "documents", "flow"])
    if layout == "lines":
        lines = [json.dumps(each, ensure_ascii=rng.random() < 0.5) for each in records]
        cut = (lambda line: line.replace(*rng.choice(ODD_CUTS), 1) if rng.random() < 0.1 else line) if is_broken else str
        return "json", "\n".join(map(cut, lines)).encode()
    if layout in ("array", "pretty"):
        return "json", json.dumps(records, indent=1 if layout == "pretty" else None).encode()
    texts = (yaml.safe_dump(each, sort_keys=False, default_flow_style=layout == "flow", width=10**6) for each in records)
    return "yaml", "---\n".join(texts).encode()


def told(form: str, data: bytes, request: Request, style: Style) -> tuple[list[Any], list[str]]:
    """Return results, the types of what they say among them, and everything that is told."""
    said: list[str] = []

    def report(error: FrametoolError) -> None:
        said.append(str(error))

    def typed(value: Any) -> Any:
        if isinstance(value, dict):
            return [(key, typed(each)) for key, each in value.items()]
        return [typed(each) for each in value] if isinstance(value, list) else (type(value), repr(value))

    bad = BadRows("a", SKIP, tell=report)
    with heard_by(lambda message, *_: said.append(message)):
        found = [
            (each.pose, typed(each.extras)) if isinstance(each, Result) else typed(each)
            for each in stream_results(BytesIO(data), form, request, style, bad)
        ]
    return [repr(each) for each in found], said


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("form", ["csv", "tum", "npy", "yaml"])
def test_in_bulk_as_one_by_one(seed: int, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    how, data = a_stream(seed)
    request = (Request(), Request(normalize=True), Request(operation=Operation(inverse=True)))[seed % 3]
    in_bulk = told(how, data, request, Style(form))
    monkeypatch.setattr(AlikeRecords, "_plan", lambda *_: None)
    one_by_one = told(how, data, request, Style(form))
    assert in_bulk[1] == one_by_one[1]
    assert [each.replace("-0.0", "0.0") for each in in_bulk[0]] == [each.replace("-0.0", "0.0") for each in one_by_one[0]]


@pytest.mark.parametrize("kind", ["pose", "degrees", "stamped", "transform", "point", "flat", "turn"])
@pytest.mark.parametrize("layout", ["lines", "array"])
def test_records_that_are_alike_are_read_once(kind: str, layout: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a thousand, those are read one by one that are the first of their template, or odd."""
    rng = random.Random(7)  # noqa: S311 - the same records in every run
    records = [a_record(kind, rng, at) | {"note": f"n{at}"} for at in range(1000)]
    data = json.dumps(records) if layout == "array" else "\n".join(map(json.dumps, records))
    alone = Mock(side_effect=record_values.results)
    monkeypatch.setattr(record_results, "results", alone)
    found, _ = told("json", data.encode(), Request(), Style("csv"))
    assert len(found) == 1000
    assert alone.call_count < 20


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_what_is_told_of_a_result_makes_no_other_record_of_it(form: str) -> None:
    """The results of one command are read by the next as the ones that are alike, whatever is said beside them."""
    told = [{"stamp_ns": at, "distance": at / 7, "angle_deg": at / 3, "source_stamp_ns": 2 * at} for at in range(50)]
    lines = [json.dumps({"xyz": [at, 0, 1], "xyzw": [0, 0, 0, 1], **told[at]}) for at in range(50)]
    cutter = RecordCutter(Splitter(form), form, Request(), "a")
    text = ("\n" if form == "json" else "\n---\n").join(lines).encode()
    parts = cutter.splitter.parts(text).parts
    for part in parts:
        assert cutter.match(text, part.start, part.end) or cutter.learn(text, part)
    assert len(parts) == 50
    assert len(cutter.templates) <= 2  # the last document of YAML ends in no line of its own


def test_a_frame_that_is_left_out_is_told_once(run: Callable[..., Any]) -> None:
    line = '{"parent": "map", "xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}\n'
    done = run("apply", "--transform", "{xyz: [1, 0, 0]}", "-f", "csv", stdin=line * 100)
    assert done.err == "frametool: warning: stdin: frame 'map' is left out: the frames of the result are not known\n"
    assert done.out.count("\n") == 101


def test_a_broken_record_whose_key_is_a_mapping_is_null(run: Callable[..., Any]) -> None:
    done = run("convert", "-f", "csv", "--on-error", "null", stdin='{"xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}\n{"a": nan , {"b": 1}: 2}\n')
    assert (done.status, done.out) == (3, "x,y,z,qx,qy,qz,qw\n1.0,2.0,3.0,0.0,0.0,0.0,1.0\n,,,,,,\n")
