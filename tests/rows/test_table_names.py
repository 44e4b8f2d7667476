"""The frames that rows of a table name: what results say, and what is refused."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Protocol

import pytest
from flow import INVERT, QUARTER, asked, convert, flow

from frametool.errors import UnknownFrame, ValueInvalid

if TYPE_CHECKING:
    from conftest import Outcome

    from frametool.geometry import Rigid

    class Run(Protocol):
        def __call__(self, *arguments: str, stdin: str = ..., files: dict[str, str] | None = None) -> Outcome: ...


TREE = """
frames:
  map:
    odom: {xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}
    lidar: {xyz: [0, 0, 1]}
"""
ONE = "0,0,0,0,0,0,1"
POSE = "x,y,z,qx,qy,qz,qw"
SWAP = INVERT._replace(rename=lambda parent, name: (name, parent))
EDGES = {"lidar": QUARTER, "7": QUARTER}


def way(own: str | None) -> Rigid:
    """Move from the frame that a row names; SOURCE is lidar."""
    if own not in (None, "lidar"):
        raise UnknownFrame(own, known=EDGES) if own not in EDGES else ValueInvalid(f"{own!r} is not 'lidar'")
    return QUARTER


MOVES = asked(left=QUARTER, moves=True, pose_from_frame=way, rename=lambda _, name: ("map", name), on_error="skip")


def rows(text: str | bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text.decode() if isinstance(text, bytes) else text)))


def test_the_tool_s_own_table_inverts_with_its_names(run: Run) -> None:
    there = run("lookup", "t.yaml", "map", "odom", "-f", "csv", files={"t.yaml": TREE}).out
    back = run("invert", stdin=there).out
    assert [rows(text)[0][key] for text in (there, back) for key in ("name", "parent")] == ["odom", "map", "map", "odom"]
    assert run("invert", stdin=back).out == there


@pytest.mark.parametrize("parent", ["parent", "frame", "frame_id", "header.frame_id", "field.header.frame_id"])
@pytest.mark.parametrize("name", ["name", "child_frame_id"])
@pytest.mark.parametrize("size", [0, 40])
def test_an_inverse_swaps_the_names(parent: str, name: str, size: int) -> None:
    text = f'{parent},{POSE},{name}\nmap,{ONE},"a,b"\n"map",{ONE},c\n"m""p",{ONE},c\n'.encode()
    result = flow(text, SWAP, size=size)
    assert [(row[parent], row[name]) for row in rows(result.text)] == [("a,b", "map"), ("c", "map"), ("c", 'm"p')]
    assert flow(result.text, SWAP, size=size).text.replace(b'"map"', b"map") == text.replace(b'"map"', b"map").replace(
        b"0,0,0,0,0,0,1", b"0.0,0.0,0.0,0.0,0.0,0.0,1.0"
    )


def test_a_product_checks_that_frames_touch_and_writes_the_outer_ones(run: Run) -> None:
    table = f"parent,name,{POSE}\nb,c,{ONE}\nx,c,{ONE}\n,c,{ONE}\n"
    done = run("compose", "{name: b, parent: a, xyz: [1, 0, 0]}", "-", "--on-error", "skip", stdin=table)
    assert [(row["parent"], row["name"]) for row in rows(done.out)] == [("a", "c"), ("a", "c")]
    assert "stdin:3:parent: frames do not touch: a <- b is followed by x <- c" in done.err
    assert done.status == 3


def test_relative_checks_that_both_are_given_in_one_frame(run: Run) -> None:
    table = f"parent,name,{POSE}\na,c,{ONE}\nx,c,{ONE}\n"
    done = run("relative", "{name: b, parent: a, xyz: [1, 0, 0]}", "-", "--on-error", "skip", stdin=table)
    assert [(row["parent"], row["name"]) for row in rows(done.out)] == [("b", "c")]
    assert "stdin:3:parent: A is in 'a' and B in 'x'" in done.err


@pytest.mark.parametrize("size", [0, 30])
def test_consecutive_rows_are_given_in_one_frame_and_seen_from_the_row_before(size: int) -> None:
    table = f"parent,name,{POSE}\na,c,{ONE}\nx,c,{ONE}\na,c,{ONE}\n".encode()
    result = flow(table, asked(of="previous", on_error="skip", rename=lambda _parent, name: (name, name)), size=size)
    assert [(row["parent"], row["name"]) for row in rows(result.text)] == [("c", "c"), ("c", "c")]
    assert result.told[0].startswith("in:3:parent: given in another frame than 'a'")


@pytest.mark.parametrize("form", ["csv", "json", "yaml"])
@pytest.mark.parametrize("way", ["--consecutive", "--first"])
@pytest.mark.parametrize("count", [1, 400])
def test_rows_of_another_frame_are_compared_in_no_form(run: Run, form: str, way: str, count: int) -> None:
    table = f"parent,name,{POSE}\n" + f"a,c,{ONE}\n" * count + f"x,c,{ONE}\n" + f"a,c,{ONE}\n"
    text = run("convert", "-f", form, stdin=table).out
    done = run("relative", way, "--on-error", "skip", "-f", "csv", stdin=text)
    assert (done.status, len(rows(done.out))) == (3, count + 1)
    assert "given in another frame than 'a', as the rows before are (row skipped)" in done.err


def test_frames_that_are_called_by_numbers_are_no_counters(run: Run) -> None:
    text = "{},x,y,z\n1,0,0,0\n2,0,0,0\n"
    assert "given in another frame than '1'" in run("relative", "--first", stdin=text.format("parent")).err
    assert run("relative", "--first", stdin=text.format("frame")).status == 0  # which counts pictures
    mixed = '{"xyz": [1, 2, 3]}\n{"parent": "w", "xyz": [1, 2, 3]}\n'
    assert "given in a frame, as the rows before are not" in run("relative", "--first", stdin=mixed).err


@pytest.mark.parametrize("column", ["frame", "frame_id", "parent", "header.frame_id"])
def test_a_row_in_another_frame_than_source_is_bad_and_names_both(run: Run, column: str) -> None:
    table = f"{column},x,y,z\nlidar,1,0,0\nodom,1,0,0\n"
    done = run("apply", "t.yaml", "map", "odom", "--on-error", "skip", stdin=table, files={"t.yaml": TREE})
    assert done.out == f"{column},x,y,z\nmap,1.0,3.0,0.0\n"
    assert f"stdin:2:{column}: " in done.err
    assert "'lidar'" in done.err
    assert "'odom'" in done.err
    own = run("apply", "t.yaml", "map", stdin=table, files={"t.yaml": TREE})
    assert own.out == f"{column},x,y,z\nmap,1.0,0.0,1.0\nmap,1.0,3.0,0.0\n"


def test_a_counter_called_frame_stays_unless_frames_are_called_so() -> None:
    table = b"frame,x,y,z\n7,0,0,0\nlidar,0,0,0\n"
    assert flow(table, MOVES).text == b"frame,x,y,z\n7,1.0,2.0,3.0\nmap,1.0,2.0,3.0\n"
    result = flow(table, MOVES.with_rows(frame_is_counter=False))
    assert result.text == b"frame,x,y,z\nmap,1.0,2.0,3.0\n"
    assert result.told[0].startswith("in:2:frame: '7' is not 'lidar'")
    assert flow(b"frame_id,x,y,z\n7,0,0,0\n", MOVES).status == 3


@pytest.mark.parametrize("size", [0, 30])
def test_a_name_that_nobody_knows_is_left_empty_and_told_once(size: int) -> None:
    with pytest.warns(match="frame 'map' is left out") as caught:
        result = flow(f"frame,{POSE}\nmap,{ONE}\nmap,{ONE}\n".encode(), SWAP, size=size)
    assert len(caught) == 1
    assert [row["frame"] for row in rows(result.text)] == ["", ""]


def test_bad_rows_keep_their_names() -> None:
    text = f"parent,{POSE},name\nmap,{ONE},odom\nmap,x{ONE},odom\nmap,1,odom\n".encode()
    result = flow(text, SWAP._replace(on_error="null"))
    assert [(row["parent"], row["name"]) for row in rows(result.text)][:2] == [("odom", "map"), ("map", "odom")]


def test_names_that_stay_keep_their_bytes() -> None:
    text = f'parent,{POSE},name\n"map",{ONE}, odom \n'.encode()
    assert b'"map",' in flow(text, convert("rpy")).text
    kept = flow(text, INVERT._replace(rename=lambda parent, name: (parent, name))).text
    assert kept.splitlines()[1].startswith(b'"map",')
    assert kept.splitlines()[1].endswith(b", odom ")
