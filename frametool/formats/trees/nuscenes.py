"""Tables of nuScenes: the poses of sensors on the vehicle, and of the vehicle.

    calibrated_sensor.json   [{"token": .., "sensor_token": .., "translation": [x, y, z], "rotation": [w, x, y, z]}, ..]
    ego_pose.json            [{"token": .., "timestamp": 1531883530449377, "translation": .., "rotation": ..}, ..]
    sensor.json              [{"token": .., "channel": "CAM_FRONT", "modality": "camera"}, ..]

Metres, w first, microseconds.  ego<-sensor, and global<-ego, which moves.  Names of sensors are in sensor.json, in the
same folder or passed with the other files.  Some forks have rotations as 3x3 matrices.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_documents
from frametool.documents.source import InputFile
from frametool.errors import FormatError, bare, shown
from frametool.formats.trees.matrices import grid_of, read_turn
from frametool.formats.trees.tree_reader import document_edges
from frametool.geometry.representations import notation
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Edge, Options
from frametool.grammar.readers import INDICES, Misfit, Reading, as_mapping, kind, read_numbers, within
from frametool.grammar.rotation_spelling import rotation_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Quaternion

NAMES = "sensor.json"
_WXYZ = notation("wxyz")


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per sensor, or one sample per ego pose; of sensor.json only the frame above the sensors."""
    world, ego = options.answers.names("global", "ego")

    def take(value: Any, reading: Reading) -> Iterator[Edge]:
        records = _records(value)
        known = as_mapping(records[0], "a record")
        if "sensor_token" in known:
            yield from _sensors(records, ego, _channels(file), reading, options)
        elif {"translation", "rotation", "timestamp"} <= known.keys():
            yield from _ego_poses(records, world, ego, reading)
        elif "channel" in known:
            yield Edge(None, ego, IDENTITY)
        else:
            raise Misfit("no poses in this table of nuScenes: they are in calibrated_sensor.json and ego_pose.json")

    yield from document_edges(file, options, take)


def _records(value: Any) -> list[Any]:
    if type(value) is not list or not value:
        raise Misfit(f"expected a list of records, found {kind(value) if value else 'an empty one'}")
    return value


def _sensors(
    records: list[Any], ego: str, channels: dict[str, str] | None, reading: Reading, options: Options
) -> Iterator[Edge]:
    """Yield an edge for each pose of each sensor; if it has several, each name includes the token."""
    poses: dict[str, dict[Rigid, tuple[str, Path]]] = {}
    for index, record in enumerate(records):
        reading.here = (index,)
        try:
            sensor = within((index,), _text, as_mapping(record, "a record"), "sensor_token")
            pose = within((index,), _pose, record, reading)
        except Misfit as misfit:
            reading.refuse(misfit)
            continue
        name = (channels or {}).get(sensor, sensor)
        poses.setdefault(name, {}).setdefault(pose, (str(record.get("token")), (index,)))
    several = [name for name, found in poses.items() if len(found) > 1]
    unnamed = [] if channels is not None else [f"sensors are called by their tokens ({NAMES} has the names: --with it)"]
    more = [f"those of several poses as {bare(each)}/TOKEN" for each in several[:1]]
    options.tally.assumed = ", ".join(unnamed + more)
    for name, found in poses.items():
        for pose, (token, path) in found.items():
            yield Edge(ego, f"{name}/{token}" if len(found) > 1 else name, pose, path=path)


def _ego_poses(records: list[Any], world: str, ego: str, reading: Reading) -> Iterator[Edge]:
    """Yield the samples of the vehicle."""
    for index, record in enumerate(records):
        reading.here = (index,)
        try:
            stamp = within((index,), _text, as_mapping(record, "a record"), "timestamp")
            if not re.fullmatch(r"(?a)\d{1,18}", stamp):
                raise Misfit(f"expected whole microseconds, found {shown(stamp)}", (index, "timestamp"))
            yield Edge(world, ego, within((index,), _pose, record, reading), int(stamp) * 1000, path=(index,))
        except Misfit as misfit:
            reading.refuse(misfit)


def _text(record: dict[str, Any], key: str) -> str:
    found = record.get(key)
    if type(found) is not str or not found:
        raise Misfit(f"{key} must be one word, found {kind(found or None)}", (key,) if key in record else ())
    return found


def _pose(record: dict[str, Any], reading: Reading) -> Rigid:
    for key in ("translation", "rotation"):
        if key not in record:
            raise Misfit(f"missing {key}")
    x, y, z = within(("translation",), read_numbers, record["translation"], ("x", "y", "z"))
    return (x, y, z, *within(("rotation",), _rotation, record["rotation"], reading))


def _rotation(value: Any, reading: Reading) -> Quaternion:
    """Read w, x, y, z, or the 3x3 matrix of a fork."""
    grid = grid_of(value)
    if grid is not None and (grid.holds(9) or (grid.rows, grid.columns) == (3, 3)):
        return read_turn(grid, reading)
    if grid is None or not grid.holds(4):
        raise Misfit(f"expected [w, x, y, z] or a 3 x 3 matrix, found {grid.size if grid else kind(value)}")
    return rotation_of(_WXYZ, grid.texts, INDICES, reading)


def _channels(file: InputFile) -> dict[str, str] | None:
    """Return the names of sensors, by their tokens; None without the table of them."""
    table = next((each for each in file.siblings if os.path.basename(each.path) == NAMES), None)
    if table is None:
        path = os.path.join(os.path.dirname(file.path), NAMES)
        if file.path == "-" or not os.path.exists(path):
            return None
        table = InputFile(path)
    try:
        (document,) = parse_documents(table.text, table.name)
        records = [as_mapping(record, "a record") for record in _records(document.value)]
        return {_text(record, "token"): _text(record, "channel") for record in records}
    except Misfit as misfit:
        raise FormatError(str(misfit), source=table.name) from None
    except ValueError as error:
        raise error if isinstance(error, FormatError) else FormatError("no records in it", source=table.name) from None
