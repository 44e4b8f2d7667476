"""sensor.yaml of the EuRoC data sets: where one sensor sits on the body.

    T_BS:
      cols: 4
      rows: 4
      data: [0.0148, -0.9998, 0.0041, -0.0216, .., 0.0, 0.0, 0.0, 1.0]

Row-major, metres: takes points of the sensor to the body.  The sensor is called as the folder: mav0/cam0/sensor.yaml.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from frametool.formats.trees.matrices import FrameNames, Matrices
from frametool.formats.trees.matrix_keys import TAGS, made_ordinary
from frametool.formats.trees.tree_reader import document_edges
from frametool.grammar.readers import Misfit, as_mapping

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Edge, Options
    from frametool.grammar.readers import Reading


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the one edge."""
    body, sensor = options.answers.names("body", sensor_name(file.path))

    def take(value: Any, reading: Reading) -> Iterator[Edge]:
        naming = FrameNames(base=body, alone=sensor, told=(body, sensor))
        matrices = Matrices(as_mapping(value, "T_BS of a sensor"), naming, options.answers, reading)
        if not matrices.poses:
            raise Misfit("no pose in it: the pose of a sensor is T_BS")
        options.tally.about = f"the pose of {sensor}"
        yield from matrices.edges()

    yield from document_edges(made_ordinary(file), options, take, TAGS)


def sensor_name(path: str) -> str:
    """Return what a sensor is called by its file: the folder of a sensor.yaml, else the name of the file."""
    if path == "-":
        return "sensor"
    folder, name = os.path.split(os.path.abspath(path))
    stem = name.partition(".")[0]
    return (os.path.basename(folder) if stem == "sensor" else stem) or "sensor"
