from __future__ import annotations

import io
import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sized import sized

from frametool.errors import FormatError
from frametool.text.lines import read_blocks
from frametool.text.spans import RecordEnds, whole_records

if TYPE_CHECKING:
    from conftest import Sizes


@given(st.binary(max_size=60).map(lambda text: text.replace(b"a", b"\n")), st.integers(1, 20))
def test_blocks_are_the_stream_cut_behind_line_ends(text: bytes, size: int) -> None:
    with sized(block=size):
        blocks = list(read_blocks(io.BytesIO(text)))
    assert b"".join(blocks) == text
    assert all(block.endswith(b"\n") for block in blocks[:-1])
    assert all(blocks)


def test_a_line_longer_than_allowed_is_an_error_that_says_so() -> None:
    with sized(block=100, record=1000), pytest.raises(FormatError, match="longer than 1000 bytes"):
        list(read_blocks(io.BytesIO(b"x" * 5000 + b"\n")))


def test_records_of_several_lines_stay_whole() -> None:
    text = b'a,"b\n\nc",d\n' * 10
    with sized(block=7):
        blocks = list(read_blocks(io.BytesIO(text), whole=whole_records))
    assert b"".join(blocks) == text
    assert all(block.count(b'"') % 2 == 0 for block in blocks)


class Trickle(io.BytesIO):
    """A stream that gives at most so many bytes at a time."""

    def __init__(self, text: bytes, most: int) -> None:
        super().__init__(text)
        self.most = most

    def read1(self, size: int | None = -1, /) -> bytes:
        return super().read1(min(size or 0, self.most))


RECORDS = [
    b'a,"b\n\nc",d\n', b"1,2\n", b'"x ""y""\n",",\n"\n', b'5" pipe,b\n', b'"\n\n\n\n\n\n\n\n\n"\n', b'"a"b"c,"\n"\n', b"\n",
]  # fmt: skip


@given(st.lists(st.sampled_from(RECORDS), max_size=8), st.integers(1, 40), st.integers(1, 40))
def test_blocks_end_where_records_do_however_the_stream_is_cut(rows: list[bytes], most: int, size: int) -> None:
    with sized(block=size):
        blocks = list(read_blocks(Trickle(b"".join(rows), most), whole=RecordEnds(b",")))
    ends = {sum(map(len, rows[:count])) for count in range(len(rows) + 1)}
    assert b"".join(blocks) == b"".join(rows)
    assert {sum(map(len, blocks[:count])) for count in range(len(blocks) + 1)} <= ends


@pytest.mark.parametrize("record", [b"x" * 99 + b"\n", b'"' + b"\n" * 97 + b'"\n', b'"' + b'""\n' * 32 + b'"\n'])
@pytest.mark.parametrize("longest", [120, 105, 101, 99, 98, 60, 30])
def test_the_longest_record_is_the_same_however_the_stream_is_cut(record: bytes, longest: int, sizes: Sizes) -> None:
    for most in (1, 2, 7, 64, 1000):
        for size in (1, 3, 50, 1000):
            sizes(block=size, record=longest)
            blocks = read_blocks(Trickle(b"a,b\n" + record + b"c\n", most), whole=RecordEnds(b","))
            if len(record) <= longest:
                assert b"".join(blocks) == b"a,b\n" + record + b"c\n"
            else:
                with pytest.raises(FormatError, match=f"longer than {longest} bytes"):
                    list(blocks)


@pytest.mark.parametrize("record", [b"x" * 20_000 + b"\n", b'"' + b"\n" * 20_000 + b'"\n', b'"",' * 5000 + b'"\n\n"\n'])
@pytest.mark.parametrize("most", [1, 10])
def test_bytes_that_arrive_one_by_one_are_looked_at_twice_at_most(record: bytes, most: int) -> None:
    seen = []
    ends = RecordEnds(b",")

    def whole(text: bytes) -> int:
        seen.append(len(text))
        return ends(text)

    assert b"".join(read_blocks(Trickle(record, most), whole=whole)) == record
    assert sum(seen) <= 2 * len(record) + most


def test_a_typed_line_comes_out_while_the_stream_stays_open() -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb") as stream, os.fdopen(writing, "wb", buffering=0) as typist:
        blocks = read_blocks(stream)
        typist.write(b"one\n")
        assert next(blocks) == b"one\n"
        typist.write(b"two\nthr")
        assert next(blocks) == b"two\n"
        typist.write(b"ee\n")
        assert next(blocks) == b"three\n"


def test_pieces_that_have_arrived_are_read_into_one_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frametool.text.lines.readiness", lambda _stream: lambda _patience: True)
    text = b"0123456\n" * 100_000
    blocks = list(read_blocks(Trickle(text, 1 << 16)))
    assert b"".join(blocks) == text
    assert len(blocks[0]) > 1 << 16


def test_reading_lines_loads_no_numpy() -> None:
    code = "import sys, frametool.text.lines; print('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout == b"False\n"
