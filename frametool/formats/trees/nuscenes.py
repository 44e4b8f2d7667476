r"""Tables of nuScenes: ego<-sensor, and global<-ego, which moves; metres, w first, microseconds.

Names of sensors are in sensor.json, in the same folder or passed with the other files.

    calibrated_sensor.json   [{"token": .., "sensor_token": .., "translation": [x, y, z], "rotation": [w, x, y, z]}, ..]
    ego_pose.json            [{"token": .., "timestamp": 1531883530449377, "translation": .., "rotation": ..}, ..]
    sensor.json              [{"token": .., "channel": "CAM_FRONT", "modality": "camera"}, ..]
"""

from __future__ import annotations

import os
import re
from functools import partial
from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_documents
from frametool.documents.source import InputFile
from frametool.errors import FormatError, bare, shown
from frametool.formats.trees.tree_reader import XYZ, document_edges
from frametool.geometry import rigid
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pose import read_rotation
from frametool.grammar.readers import Misfit, Reading, as_mapping, kind, read_numbers, within

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.geometry import Rigid

    Records = list[dict[str, Any]]

SENSORS = "sensor.json"


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a table."""
    return document_edges(file, options, partial(_edges, file, options))


def _edges(file: InputFile, options: Options, value: Any, reading: Reading) -> Iterator[Edge]:
    """Yield one edge per sensor, one sample per ego pose, or for sensor.json the ego frame without a parent."""
    world, ego = options.answers.names("global", "ego")
    records = _records(value)
    if "sensor_token" in records[0]:
        yield from _sensors(file, options, ego, records, reading)
    elif {"translation", "rotation", "timestamp"} <= records[0].keys():
        for path, microseconds, pose in _poses(records, "timestamp", reading):
            yield Edge(world, ego, pose, int(microseconds) * 1000, path=path)
    elif "channel" in records[0]:
        yield Edge(None, ego, rigid.IDENTITY)
    else:
        raise Misfit("no poses in this table of nuScenes: they are in calibrated_sensor.json and ego_pose.json")


def _poses(records: Records, key: str, reading: Reading) -> Iterator[tuple[tuple[int], str, Rigid]]:
    """Yield the path of each valid record, the text of a key of it, and its pose."""
    for index, record in enumerate(records):
        path = reading.here = (index,)
        try:
            word = within(path, _text, record, key)
            if key == "timestamp" and not re.fullmatch(r"(?a)\d{1,18}", word):
                raise Misfit(f"expected whole microseconds, found {shown(word)}", (index, key))
            for part in ("translation", "rotation"):
                if part not in record:
                    raise Misfit(f"missing {part}", path)
            rotation = record["rotation"]  # w, x, y, z, or the 3x3 matrix of some forks
            rows = type(rotation) is list and any(type(row) is list for row in rotation)
            x, y, z = within((index, "translation"), read_numbers, record["translation"], XYZ)
            turn = within((index, "rotation"), read_rotation, "matrix" if rows else "wxyz", rotation, reading)[1]
        except Misfit as misfit:
            reading.refuse(misfit)
        else:
            yield path, word, (x, y, z, *turn)


def _sensors(file: InputFile, options: Options, ego: str, records: Records, reading: Reading) -> Iterator[Edge]:
    """Yield the poses of sensors by name; if a sensor has several, each name includes the token of its record."""
    channels = channels_of(file)
    sensors: dict[str, dict[Rigid, tuple[int]]] = {}
    for path, word, pose in _poses(records, "sensor_token", reading):
        sensors.setdefault((channels or {}).get(word, word), {}).setdefault(pose, path)
    unnamed = f"sensors are called by their tokens ({SENSORS} has the names: --with it)" if channels is None else ""
    several = next((name for name, found in sensors.items() if len(found) > 1), None)
    more = f"those of several poses as {bare(several)}/TOKEN" if several else ""
    options.tally.assumed = ", ".join(filter(None, (unnamed, more)))
    for name, found in sensors.items():
        for pose, path in found.items():
            token = f"/{records[path[0]].get('token')}" if len(found) > 1 else ""
            yield Edge(ego, f"{name}{token}", pose, path=path)


def _records(value: Any) -> Records:
    if type(value) is not list or not value:
        raise Misfit(f"expected a list of records, found {kind(value) if value else 'an empty one'}")
    return [within((index,), as_mapping, record, "a record") for index, record in enumerate(value)]


def _text(record: dict[str, Any], key: str) -> str:
    found = record.get(key)
    if type(found) is not str or not found:
        raise Misfit(f"{key} must be one word, found {kind(found or None)}", (key,) if key in record else ())
    return found


def channels_of(file: InputFile) -> dict[str, str] | None:
    """Return the names of sensors by token, from sensor.json; None without this file."""
    table = next((each for each in file.siblings if os.path.basename(each.path) == SENSORS), None)
    if table is None:
        path = os.path.join(os.path.dirname(file.path), SENSORS)
        if file.path == "-" or not os.path.exists(path):
            return None
        table = InputFile(path)
    documents = parse_documents(table.text, table.name)
    try:
        records = _records(documents[0].value if len(documents) == 1 else None)
        return {_text(record, "token"): _text(record, "channel") for record in records}
    except Misfit as misfit:
        raise FormatError(str(misfit), source=table.name) from None
