"""Bags are read for the types that are asked for; what else is in them is in nobody's way."""

from __future__ import annotations

import re
from contextlib import closing
from sqlite3 import connect
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("rosbags")
from recorded import FORMS, START, TF, Maker, Sent, read, write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Run = Callable[..., Any]

STILL = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


def recording(folder: Path, form: str, *more: Sent) -> Path:
    made = Maker(form)
    sent = [Sent("/tf_static", *made.transforms(("map", "base", STILL, START)), START), *more]
    return write(folder / ("run.bag" if form == "bag" else "run"), form, sent)


def as_of_humble(path: Path) -> None:
    """Take out of a folder of sqlite3 what ROS 2 Humble did not write: definitions and hashes."""
    with closing(connect(next(path.glob("*.db3")))) as database, database:
        database.executescript(
            "DROP TABLE message_definitions; DROP TABLE metadata; UPDATE schema SET schema_version = 3;"
            "ALTER TABLE topics DROP COLUMN type_description_hash;"
        )
    metadata = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(re.sub(r"\n *type_description_hash:\s*\S+", "", metadata))


@pytest.mark.parametrize("form", FORMS)
def test_a_type_that_cannot_be_read_is_not_in_the_way_of_others(form: str, tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, form, Sent("/odd", "my_msgs/msg/Odd", b"1234", START))
    done = run("lookup", str(path), "map", "base", "-f", "csv")
    assert done.status == 0, done.err
    assert done.out.splitlines()[1].startswith("base,map,1.0,2.0,3.0")


def test_a_hash_that_is_not_that_of_its_definition_is_an_error(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "sqlite")
    with closing(connect(next(path.glob("*.db3")))) as database, database:
        database.execute("UPDATE topics SET type_description_hash = 'RIHS01_other'")
    done = run("lookup", str(next(path.glob("*.db3"))), "map", "base")
    assert done.status == 1
    assert f"hash of {TF} is RIHS01_e369d0f05a23ae" in done.err


def test_types_without_a_definition_are_those_of_ros2(tmp_path: Path, run: Run) -> None:
    path = recording(tmp_path, "sqlite", Sent("/odd", "my_msgs/msg/Odd", b"1234", START))
    as_of_humble(path)
    assert run("lookup", str(path), "map", "base", "-f", "csv").out.splitlines()[1].startswith("base,map,1.0,2.0,3.0")
    done = run("record", str(path), "-o", "new.mcap")
    assert done.err == (
        f"frametool: {path}: types that it does not define are written as in ROS 2 Humble: {TF}\n"
        f"frametool: {path}: types that it does not define are copied without a definition: my_msgs/msg/Odd\n"
        f"frametool: {path}: nothing is changed: 2 messages copied\n"
    )
    static, odd = read(tmp_path / "new.mcap")
    assert static.definition.startswith("geometry_msgs/TransformStamped[] transforms\n")
    assert (odd.definition, odd.data) == ("", b"1234")
    assert run("lookup", "new.mcap", "map", "base", "-f", "csv").status == 0
