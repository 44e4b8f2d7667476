"""Every way in which one record can be given, and one plain reader of whatever comes out."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any, NamedTuple

import yaml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from conftest import Outcome

    Run = Callable[..., Outcome]

TWENTY = 20
BILLION = 10**9


class Way(NamedTuple):
    """How a record is given: what stands for it among the arguments, standard input, files, and how many there are."""

    argument: str
    stdin: str = ""
    files: Mapping[str, str] = {}
    rows: int = 1
    source: str = "stdin"


class _Plain(yaml.SafeDumper):
    """Write every mapping where it stands, without anchors."""

    def ignore_aliases(self, _data: Any) -> bool:
        return True


def line(record: Any) -> str:
    return json.dumps(record) + "\n"


def inline(record: Any) -> str:
    return yaml.dump(record, Dumper=_Plain, default_flow_style=True, width=100_000, sort_keys=False).strip()


def document(record: Any) -> str:
    return yaml.dump(record, Dumper=_Plain, default_flow_style=False, sort_keys=False)


def table(cells: Mapping[str, Any], count: int) -> str:
    return ",".join(cells) + "\n" + (",".join(map(str, cells.values())) + "\n") * count


TEXTS: dict[str, tuple[str, Callable[[Any, int], str]]] = {
    "lines": ("jsonl", lambda record, count: line(record) * count),
    "array": ("json", lambda record, count: "[" + ",\n".join([json.dumps(record)] * count) + "]\n"),
    "documents": ("yaml", lambda record, count: "---\n".join([document(record)] * count)),
    "flow documents": ("yaml", lambda record, count: "---\n".join([f"{inline(record)}\n"] * count)),
}
ARGUMENTS = ("argument", "file")
STREAMS = (*TEXTS, "table")


def ways(form: str, record: Any, cells: Mapping[str, Any] | None = None, *, by_name: bool = False) -> Iterator[Way]:
    """Give a record in one form in all its ways, alone and in twenties.

    cells: the same as a row of a table
    by_name: also as a file named by -i
    """
    if form == "argument":
        yield Way(json.dumps(record), source="argument")
        yield Way(inline(record), source="argument")
    elif form == "file":
        yield Way("one.json", files={"one.json": line(record)}, source="one.json")
        yield Way("one.yaml", files={"one.yaml": document(record)}, source="one.yaml")
    elif form != "table" or cells is not None:
        suffix = TEXTS[form][0] if form in TEXTS else "csv"
        for count in (1, TWENTY):
            text = TEXTS[form][1](record, count) if form in TEXTS else table(cells or {}, count)
            yield Way("-", stdin=text, rows=count)
        if by_name:
            yield Way("-", files={f"rows.{suffix}": text}, rows=TWENTY, source=f"rows.{suffix}")


def given(run: Run, arguments: Sequence[str], way: Way) -> Outcome:
    """Run a command with the record given in a way; it stands last."""
    by_name = ("-i", way.source) if way.argument == "-" and way.source != "stdin" else ()
    return run(*arguments, *by_name, way.argument, stdin=way.stdin, files=dict(way.files))


class Reading(NamedTuple):
    """What a result says: the kind of thing, its numbers to the bit, its names and its time."""

    kind: str
    numbers: tuple[str, ...]
    parent: str | None = None
    name: str | None = None
    stamp_ns: int | None = None


PARENTS = ("frame", "frame_id", "parent", "parent_frame_id")
NAMES = ("name", "child_frame_id", "child")
POSITIONS = ("xyz", "position", "translation")
BLOCKS = {"twist": ("linear", "angular"), "wrench": ("force", "torque")}
TURNS = {"quaternion": "xyzw", "orientation": "xyzw", "rotation": "xyzw", "rotvec": "xyz"}


def readings(text: str, form: str = "json") -> list[Reading]:
    """Read all results of an output, one after another; a list of poses in a message is one each."""
    if form == "csv":
        rows = csv.DictReader(io.StringIO(text))
        return [reading({key: value for key, value in row.items() if value != ""}) for row in rows]
    found = [each for value in values(text, form) for each in (value if isinstance(value, list) else [value])]
    return [reading(each) for value in found for each in parts(value)]


def values(text: str, form: str = "json") -> Iterator[Any]:
    """Read the documents of an output, parted by whatever parts them."""
    if form == "yaml":
        yield from (each for each in yaml.load_all(text, yaml.CSafeLoader) if each is not None)
        return
    decode, at = json.JSONDecoder().raw_decode, 0
    while at < len(text.rstrip()):
        value, at = decode(text, at)
        yield value
        at += len(text[at:]) - len(text[at:].lstrip())


def parts(value: Any) -> Iterator[Any]:
    """Take the poses of a PoseArray, Path or TFMessage apart, each with the header it stands under."""
    for key in ("poses", "transforms"):
        if isinstance(value.get(key), list):
            for each in value[key]:
                yield each if "header" in each else {"header": value.get("header", {}), "pose": each}
            return
    yield value


def reading(record: Any) -> Reading:
    """Read one result in the grammar, as a message or as a row of a table."""
    header = record.get("header", {})
    body = record
    while isinstance(inner := body.get("pose", body.get("transform")), dict):
        body = inner
    kind, numbers = _kind_and_numbers(body)
    parent = _first(record, PARENTS) or header.get("frame_id") or None
    return Reading(kind, tuple(map(repr, numbers)), parent, _first(record, NAMES), _stamp_ns(record))


def _kind_and_numbers(body: Any) -> tuple[str, tuple[float, ...]]:
    position = next((_components(body[key]) for key in POSITIONS if key in body), _flat(body, "xyz"))
    turn = next((_components(body[key], axes) for key, axes in TURNS.items() if key in body), _flat(body, ("qx", "qy", "qz", "qw")))
    if turn:
        return ("pose", (*position, *turn)) if position else ("rotation", turn)
    for kind, parts_of in BLOCKS.items():
        if (block := body.get(kind, body if parts_of[0] in body else None)) is not None:
            return kind, tuple(number for part in parts_of for number in _components(block[part]))
        if flat := _flat(body, [f"{part}_{axis}" for part in parts_of for axis in "xyz"]):
            return kind, flat
    for kind in ("point", "vector"):
        if kind in body:
            return kind, _components(body[kind])
    return "point", position


def _components(value: Any, axes: str = "xyz") -> tuple[float, ...]:
    return tuple(float(value[axis]) for axis in axes) if isinstance(value, dict) else tuple(map(float, value))


def _flat(body: Any, keys: Sequence[str]) -> tuple[float, ...]:
    return tuple(float(body[key]) for key in keys) if all(key in body for key in keys) else ()


def _first(record: Any, keys: Sequence[str]) -> str | None:
    return next((record[key] for key in keys if record.get(key)), None)


def _stamp_ns(record: Any) -> int | None:
    stamp = record.get("header", record).get("stamp")
    if isinstance(stamp, dict):
        whole, below = stamp.values()
        return whole * BILLION + below if (type(whole), type(below)) == (int, int) else None
    if "stamp_ns" in record:
        return int(record["stamp_ns"])
    if stamp is None:
        return None
    whole, _, below = str(stamp).partition(".")
    return int(whole) * BILLION + int(below.ljust(9, "0"))
