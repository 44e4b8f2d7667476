"""A record means the same alone, in twos and in forties; as argument, line, array, document and row of a table."""

from __future__ import annotations

import json
import math
import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
import yaml
from flow import INVERT, MOVE, Asked, asked, convert, flow, poses_in, values_of

from frametool.errors import FrametoolError, FrametoolWarning
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

H = math.sqrt(0.5)
HEADER = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "a"}
XYZ, NEW = {"x": 1, "y": 2, "z": 3}, {"x": 0, "y": 0, "z": H, "w": H}
TURNS = {"linear": XYZ, "angular": {"x": 0, "y": 0, "z": 1}}
COVARIANCE = [0.015625 * (at % 7 == 0) for at in range(36)]
RECORDS: dict[str, dict[str, Any]] = {
    "point": {"frame": "a", "point": [1, 2, 3], "k": 1},
    "vector": {"vector": [1, 2, 3]},
    "bare point": XYZ,
    "position": {"id": 7, "xyz": [1, 2, 3], "tag": "a b"},
    "millimetres": {"xyz_mm": [1000, 2, 3], "rotvec": [0.1, 0.2, 0.3]},
    "rpy": {"name": "b", "parent": "a", "xyz": [1, 2, 3], "rpy": [0.1, 0.2, 0.3]},
    "degrees": {"xyz": [1, 2, 3], "rpy_deg": [10, 20, 30], "k": [1, {"a": None}]},
    "angles": {"angles": "deg", "rpy": {"roll": 10, "yaw": 30}},
    "inverse": {"xyz": [1, 2, 3], "quaternion": NEW, "inverse": True},
    "wxyz": {"wxyz": [H, 0, H, 0]},
    "alone": {"x": 0.5, "y": 0.5, "z": -0.5, "w": 0.5},
    "euler": {"xyz": [1, 2, 3], "euler": {"axes": "rzyx", "angles": [0.1, 0.2, 0.3]}},
    "axis and angle": {"axis_angle": {"axis": [0, 0, 2], "angle": 0.5}},
    "matrix": {"matrix": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]},
    "whole matrix": {"matrix": [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]},
    "two spellings": {"quaternion": NEW, "rpy_deg": [0, 0, 90]},
    "rough": {"xyz": [1, 2, 3], "quaternion": {"x": 0, "y": 0, "z": 0, "w": 1.0001}},
    "degrees?": {"rpy": [0, 0, 90]},
    "flat": {"id": 1, "x": 1, "y": 2, "z": 3, "qx": 0, "qy": 0, "qz": H, "qw": H, "tag": "a"},
    "flat degrees": {"x": 1, "y": 2, "z": 3, "roll_deg": 0, "pitch_deg": 10, "yaw_deg": 90, "frame_id": "a"},
    "flat millimetres": {"x_mm": 1, "y_mm": 2, "z_mm": 3, "roll": 0, "pitch": 0.1, "yaw": 0.2},
    "plane": {"x": 1, "y": 2, "yaw": 0.25, "child_frame_id": "b"},
    "PointStamped": {"header": HEADER, "point": XYZ},
    "PoseStamped": {"header": HEADER, "pose": {"position": XYZ, "orientation": NEW}},
    "PoseWithCovarianceStamped": {
        "header": HEADER, "pose": {"pose": {"position": XYZ, "orientation": NEW}, "covariance": COVARIANCE},
    },
    "TransformStamped": {
        "header": HEADER, "child_frame_id": "b", "transform": {"translation": XYZ, "rotation": NEW},
    },
    "TwistStamped": {"header": HEADER, "twist": TURNS},
    "WrenchStamped": {"header": HEADER, "wrench": {"force": XYZ, "torque": {"x": 0, "y": 1, "z": 0}}},
}  # fmt: skip
BAD: dict[str, dict[str, Any]] = {
    "no number": {"xyz": [1, 2, "foo"]},
    "not finite": {"point": [1, 2, "nan"]},
    "null": {"x": 1, "y": 2, "z": 3, "qx": 0, "qy": 0, "qz": 0, "qw": None},
    "too short": {"xyz": [1, 2], "rpy": [0, 0, 0]},
    "no rotation": {"xyz": [1, 2, 3], "xyzw": [0, 0, 0, 0.5]},
    "no order": {"quaternion": [0, 0, 0, 1]},
    "half": {"x": 1, "y": 2, "z": 3, "qx": 0, "qy": 0, "qz": 0},
    "two positions": {"point": [1, 2, 3], "vector": [1, 2, 3]},
    "typo": {"xyz": [1, 2, 3], "rpy_dge": [0, 0, 90]},
    "two frames": {"frame": "a", "parent": "b", "xyz": [1, 2, 3]},
    "disagreement": {"quaternion": NEW, "rpy_deg": [0, 0, 80]},
    "mirrored": {"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]},
    "unknown unit": {"x [furlong]": 1, "y [furlong]": 2, "z [furlong]": 3},
}
REQUESTS = {
    "move": MOVE._replace(rename=lambda _parent, name: ("m", name)),
    "invert": INVERT._replace(rename=lambda parent, name: (name, parent)),
    "compose": asked(left=(1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8), right=((0.5, 0.0, 0.0, 0.6, 0.0, 0.0, 0.8),)),
    "convert": convert("rpy_deg,quaternion"),
}
COUNTS = (1, 2, 40)
ONLY_MOVED = ("point", "vector", "bare point", "PointStamped", "TwistStamped", "WrenchStamped")


class Said(NamedTuple):
    """What a run left behind: values, bad rows without their place, warnings without theirs."""

    values: list[Any]
    faults: list[str]
    warned: list[str]


def told(texts: list[str]) -> list[str]:
    """Take the place off what was told."""
    return [text.split(": ", 1)[1].removesuffix(" (row skipped)") for text in texts]


def ways(record: dict[str, Any], request: Asked) -> Iterator[tuple[str, int, Said]]:
    """Run a record in every way of a stream."""
    line = json.dumps(record)
    document = yaml.safe_dump(record, default_flow_style=False, sort_keys=False)
    texts: dict[str, tuple[str, Callable[[int], str]]] = {
        "lines": ("json", lambda count: f"{line}\n" * count),
        "array": ("json", lambda count: "[" + ",\n".join([line] * count) + "]\n"),
        "array on a line": ("json", lambda count: "[" + ", ".join([line] * count) + "]"),
        "pretty": ("json", lambda count: (json.dumps(record, indent=2) + "\n") * count),
        "documents": ("yaml", lambda count: "---\n".join([document] * count)),
        "flow documents": ("yaml", lambda count: "---\n".join([f"{line}\n"] * count)),
    }
    for name, (form, text) in texts.items():
        for count in COUNTS:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", FrametoolWarning)
                found = flow(text(count).encode(), request._replace(on_error="skip"), form, most=1000)
            yield f"{name} x {count}", count, Said(values(found.text.decode(), form, name), told(found.told[:-1]), [str(each.message) for each in caught])


def values(text: str, form: str, name: str) -> list[Any]:
    if form == "yaml":
        return [each for each in yaml.load_all(text, yaml.CSafeLoader) if each is not None]
    if name.startswith("array"):
        return list(json.loads(text))
    decode = json.JSONDecoder().raw_decode
    found, at = [], 0
    while at < len(text.rstrip()):
        value, at = decode(text, at)
        found.append(value)
        at += len(text[at:]) - len(text[at:].lstrip())
    return found


@pytest.mark.parametrize("wanted", REQUESTS)
@pytest.mark.parametrize("kind", RECORDS)
def test_count_and_layout_do_not_show(kind: str, wanted: str) -> None:
    first: Said | None = None
    for way, count, said in ways(RECORDS[kind], REQUESTS[wanted]):
        first = first or said
        assert said.values == first.values * count, way
        assert told(said.warned[:1]) == told(first.warned[:1]), way
        assert said.faults == first.faults * count, way
        assert all(text.startswith("in:") for text in said.warned), way


@pytest.mark.parametrize("kind", BAD)
def test_what_is_wrong_is_said_alike(kind: str) -> None:
    for request in (REQUESTS["move"], REQUESTS["invert"]):
        reasons = set()
        for _, count, said in ways(BAD[kind], request):
            assert (said.values, len(said.faults)) == ([], count)
            reasons |= set(said.faults)
        reasons |= {str(error).split(": ", 1)[1] for error in as_argument(BAD[kind], request)}
        assert len(reasons) == 1, reasons


def as_argument(record: dict[str, Any], request: Asked) -> Iterator[FrametoolError]:
    for text in (json.dumps(record), yaml.safe_dump(record)):
        with pytest.raises(FrametoolError) as found:
            values_of(text, request)
        yield found.value


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("wanted", REQUESTS)
@pytest.mark.parametrize("kind", RECORDS)
def test_an_argument_has_the_numbers_of_a_line(kind: str, wanted: str) -> None:
    request = REQUESTS[wanted]
    if kind == "plane" and wanted in ("move", "compose"):
        return  # leaves the plane, which only a stream has to keep
    if RECORDS[kind].get("header") is None and kind not in ONLY_MOVED:
        request = request.with_results(notations=convert("quaternion").results.notations)
    text = json.dumps(RECORDS[kind])
    line = flow(f"{text}\n".encode(), request, "json")
    if line.status:
        with pytest.raises(FrametoolError):
            values_of(text, request)
        return
    (mine,) = values_of(text, request)
    if isinstance(mine, Result):
        (again,) = poses_in(line.text.decode())
        x, y, z, *turned = mine.pose.components
        assert again.components in ((x, y, z, *turned), (x, y, z, *(0.0 - part for part in turned)))
    else:
        assert sorted(floats_in(mine)) == sorted(floats_in(json.loads(line.text)))


def floats_in(value: Any) -> list[float]:
    """Give the numbers of a result; what only passes is written without a point in these records."""
    if isinstance(value, dict):
        return [leaf for each in value.values() for leaf in floats_in(each)]
    if isinstance(value, list):
        return [leaf for each in value for leaf in floats_in(each)]
    return [value] if isinstance(value, float) else []


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("wanted", ["move", "invert", "compose"])
@pytest.mark.parametrize("kind", [kind for kind, record in RECORDS.items() if kind.startswith(("flat", "plane", "bare"))])
@pytest.mark.parametrize("count", COUNTS)
def test_a_row_of_a_table_has_the_numbers_of_a_line(kind: str, wanted: str, count: int) -> None:
    record, request = RECORDS[kind], REQUESTS[wanted]
    text = ",".join(record) + "\n" + (",".join(map(str, record.values())) + "\n") * count
    table = flow(text.encode(), request, "csv")
    line = flow((json.dumps(record) + "\n").encode() * count, request, "json")
    assert table.status == line.status
    if table.status:
        return
    header, *rows = [row.split(",") for row in table.text.decode().splitlines()]
    found = [dict(zip(header, row, strict=True)) for row in rows]
    lines = [json.loads(row) for row in line.text.splitlines()]
    names = [name for name in header if name in lines[0] and isinstance(lines[0][name], float)]
    assert names
    assert [[float(row[name]) for name in names] for row in found] == [[row[name] for name in names] for row in lines]
