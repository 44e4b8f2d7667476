"""Bytes to records and back: one file a form of text, one table of them."""

from __future__ import annotations


class Row:
    """A form of text: the module that has its `write_poses`, `write_points`, `write_tree`, and what it is."""

    __slots__ = ("module", "suffixes", "summary", "writes")

    def __init__(self, module: str, suffixes: tuple[str, ...], summary: str, writes: tuple[str, ...]) -> None:
        """Fill the row."""
        self.module = module
        self.suffixes = suffixes
        self.summary = summary
        self.writes = writes


FORMATS = {
    "yaml": Row(
        "frametool.formats.yaml_format",
        (".yaml", ".yml"),
        "YAML, as trees and poses are read",
        ("poses", "points", "tree", "report"),
    ),
    "json": Row(
        "frametool.formats.json_format",
        (".json", ".jsonl"),
        "JSON, one object a line",
        ("poses", "points", "tree", "report"),
    ),
    "csv": Row("frametool.formats.csv_format", (".csv",), "CSV with a header", ("poses", "points", "report")),
    "ros1": Row(
        "frametool.ros.echo_format", (), "messages as `rostopic echo` prints them", ("poses", "points", "tree")
    ),
    "ros2": Row(
        "frametool.ros.echo_format", (), "messages as `ros2 topic echo` prints them", ("poses", "points", "tree")
    ),
    "foxglove": Row("frametool.ros.foxglove", (), "FrameTransform as JSON, one a line", ("poses", "tree")),
    "static1": Row("frametool.ros.publisher", (), "static_transform_publisher of ROS 1", ("poses", "tree")),
    "static2": Row("frametool.ros.publisher", (), "static_transform_publisher of ROS 2", ("poses", "tree")),
    "tf2": Row("frametool.ros.tf2_listing", (), "the listing of tf2's all_frames_as_yaml", ("tree",)),
    "dot": Row("frametool.formats.dot", (".dot", ".gv"), "graphviz", ("tree",)),
    "mermaid": Row("frametool.formats.mermaid", (".mmd",), "a mermaid flowchart", ("tree",)),
}


def writers(what: str) -> tuple[str, ...]:
    """Name the forms that write `poses`, `points` or a `tree`."""
    return tuple(name for name, row in FORMATS.items() if what in row.writes)
