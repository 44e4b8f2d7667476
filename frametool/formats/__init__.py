"""Bytes to records and back: one file a form of text, one table of them."""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """A form of text: the module that has its `write_poses`, `write_points`, `write_tree`, and what it is."""

    module: str
    suffixes: tuple[str, ...]
    summary: str
    writes: tuple[str, ...]


FORMATS = {
    "yaml": Row(
        "frametool.formats.yaml_form",
        (".yaml", ".yml"),
        "YAML, as trees and poses are read",
        ("poses", "points", "tree"),
    ),
    "json": Row(
        "frametool.formats.json_form", (".json", ".jsonl"), "JSON, one object a line", ("poses", "points", "tree")
    ),
    "csv": Row("frametool.formats.csv_form", (".csv",), "CSV with a header", ("poses", "points")),
    "ros1": Row("frametool.formats.ros", (), "TransformStamped as `rostopic echo` prints it", ("poses", "tree")),
    "ros2": Row("frametool.formats.ros", (), "TransformStamped as `ros2 topic echo` prints it", ("poses", "tree")),
    "dot": Row("frametool.formats.dot", (".dot", ".gv"), "graphviz", ("tree",)),
    "mermaid": Row("frametool.formats.mermaid", (".mmd",), "a mermaid flowchart", ("tree",)),
}


def writers(what: str) -> tuple[str, ...]:
    """Name the forms that write `poses`, `points` or a `tree`."""
    return tuple(name for name, row in FORMATS.items() if what in row.writes)
