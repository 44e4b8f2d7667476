"""Several processes give what one gives, to the byte: results, messages, lines, exit status, wherever blocks end."""

from __future__ import annotations

import io
import os
import tempfile
from typing import TYPE_CHECKING

import pytest
from flow import INVERT, MOVE, ON_ERROR, QUARTER, Asked, Flow, asked, convert, flow
from hypothesis import given, settings
from hypothesis import strategies as st
from sized import sized

from frametool.errors import FileProblem, heard_by

if TYPE_CHECKING:
    from io import BufferedReader

# where numpy was loaded with threads of its own, a newer Python warns of every fork; they do nothing here
pytestmark = pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")

HEADS = [b"x,y,z,tag\n", b"\xef\xbb\xbfx,y,z,tag\n", b"# a note\nx,y,z,tag\r\n"]
GOOD_ROWS = [b"1,2,3,a\n", b"40,5,6,long enough to fill a block\n", b'"1",2,3,"x\ny"\n', b'1,2,3,"a ""b"" \n\n\n"\n']
BAD_ROWS = [b"1,?,3,a\n", b"1,2,3\n", b'nan,2,3,"\n\n"\n', b"1,2,3,a,b\r\n"]
OTHER_ROWS = [b"\n", b"1,2,3,a\r\n", b'1,2,3,5" pipe\n', b"1,2,3,a\n", b"4,5,6,b\n"]
POSES = [
    b'{"x": 1, "y": 2, "z": 3}\n', b'{"id": 7, "xyz": [1, 2, 3], "rpy": [0, 0, 0.5]}\n', b'{"xyz": [1, 2, 3]}\n',
    b'{"x": "a", "y": 2, "z": 3}\n', b'{"xyz": [1, 2, 3], "rpy": [0, 0, 7]}\n', b"oops\n", b"\n", b'{"x": 1, "y": 2}\n',
]  # fmt: skip
VALUES = [b'{"x": 1, "y": 2, "z": 3}', b'{"xyz":\n [1, 2, 3]}', b'{"x": "a", "y": 2, "z": 3}', b'{"a": 1}']
DOCUMENTS = [
    b"x: 1\ny: 2\nz: 3\n---\n", b"# none\n---\n", b"xyz: [a, 2, 3]\n---\n",
    b"header:\n  frame_id: a\npoint: {x: 1, y: 2, z: 3}\n---\n",
]  # fmt: skip


def same_with_several(text: bytes, request: Asked, form: str, size: int, jobs: int) -> None:
    alone = heard(text, request, form)
    assert heard(text, request, form, size=size, jobs=jobs) == alone
    with tempfile.NamedTemporaryFile() as file:
        file.write(text)
        file.flush()
        with open(file.name, "rb") as stream:
            assert heard(stream, request, form, size=size, jobs=jobs) == alone


def heard(text: bytes | BufferedReader, request: Asked, form: str, *, size: int = 0, jobs: int = 1) -> Flow:
    """Run a stream; its warnings stand among the messages."""
    warned: list[str] = []
    with heard_by(lambda message, *_: warned.append(message)):
        found = flow(text, request, form, size=size, jobs=jobs)
    return found._replace(told=[*found.told, *warned])


CUTS = (st.integers(8, 120), st.integers(2, 3), st.sampled_from(ON_ERROR))  # size, jobs, on_error


@settings(max_examples=12, deadline=None)
@given(
    st.sampled_from(HEADS),
    st.lists(st.sampled_from(GOOD_ROWS * 3 + BAD_ROWS + OTHER_ROWS), max_size=40),
    st.sampled_from([b"", b"1,2,3,a", b'1,2,3,"never closed\n1,2,3,b\n', b'1,2,3,"']),
    *CUTS,
)
def test_tables_come_out_as_from_one_process(
    head: bytes, rows: list[bytes], last: bytes, size: int, jobs: int, on_error: str
) -> None:
    same_with_several(head + b"".join(rows) + last, MOVE._replace(on_error=on_error), "csv", size, jobs)


@settings(max_examples=8, deadline=None)
@given(st.lists(st.sampled_from(POSES[:3] * 4 + POSES), max_size=30), *CUTS)
def test_lines_of_json_come_out_as_from_one_process(rows: list[bytes], size: int, jobs: int, on_error: str) -> None:
    same_with_several(POSES[0] + b"".join(rows), MOVE._replace(on_error=on_error), "json", size, jobs)


@settings(max_examples=6, deadline=None)
@given(st.lists(st.sampled_from(VALUES[:2] * 4 + VALUES), max_size=20), st.sampled_from([b"]", b"]\n", b""]), *CUTS)
def test_arrays_come_out_as_from_one_process(
    values: list[bytes], end: bytes, size: int, jobs: int, on_error: str
) -> None:
    same_with_several(b"[\n" + b",\n".join(values) + b"\n" + end, MOVE._replace(on_error=on_error), "json", size, jobs)


@settings(max_examples=6, deadline=None)
@given(st.lists(st.sampled_from(DOCUMENTS[:1] * 4 + DOCUMENTS), min_size=1, max_size=20), *CUTS)
def test_documents_come_out_as_from_one_process(rows: list[bytes], size: int, jobs: int, on_error: str) -> None:
    same_with_several(b"".join(rows), MOVE._replace(on_error=on_error), "yaml", size, jobs)


@pytest.mark.parametrize("form", ["csv", "columns", "tum"])
@pytest.mark.parametrize("text", [b"", b"\n", b"# none\n", b"\xef\xbb\xbf", b"0 1 2 3 0 0 0 1\n# c\n\n1 1 2 3 0 0 0 1"])
def test_what_holds_little_or_nothing_is_told_alike(text: bytes, form: str) -> None:
    same_with_several(text.replace(b" ", b",") if form == "csv" else text, INVERT, form, 16, 2)


def test_rows_that_need_those_before_them_stay_in_order() -> None:
    rows = b"yaw\n" + b"".join(b"%d.5\n" % (turn % 6) for turn in range(50))
    same_with_several(rows, convert("rpy")._replace(unwrap=True), "csv", 16, 2)


def test_a_record_beyond_the_limit_is_refused_with_its_line() -> None:
    rows = b"x,y,z,tag\n" + b"1,2,3,a\n" * 100
    for cell in (b'"' + b"a\n" * 3000 + b'"', b"x" * 5000):
        with sized(record=5000):
            same_with_several(rows + b"4,5,6," + cell + b"\n7,8,9,b\n", MOVE, "csv", 100, 2)


def test_results_many_times_as_long_as_their_rows_arrive_too() -> None:
    same_with_several(b"yaw\n" + b"0\n1\n" * 5000, convert("matrix"), "csv", 600, 2)


class Failing(io.BytesIO):
    """A stream that fails where it should end."""

    def read1(self, size: int | None = -1, /) -> bytes:
        if piece := super().read1(size):
            return piece
        raise FileProblem("gone")


def test_what_ends_a_stream_is_told_behind_the_results_before() -> None:
    rows = b"x,y,z\n" + b"".join(b"%d,2,3\n" % number for number in range(200))
    found = flow(Failing(rows), MOVE, size=100, jobs=3)
    assert found == (flow(rows, MOVE).text, ["gone"], 5)


def test_a_file_that_becomes_shorter_while_it_is_read_is_an_error() -> None:
    with tempfile.NamedTemporaryFile() as file:
        file.write(b"frame,x,y,z\n" + b"a,1,2,3\n" * 1000)
        file.seek(0)

        def shortened(_own: str) -> tuple[float, ...]:
            os.truncate(file.name, 20)
            return QUARTER

        request = asked(moves=True, frames=("",), pose_of_row_frame=shortened, result_frame="map")
        with open(file.name, "rb") as stream:
            found = flow(stream, request, size=600, jobs=2)
    assert found.told[-1] == "in: became shorter while it was read"
    assert found.status == 5
