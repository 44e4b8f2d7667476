from __future__ import annotations

import io
import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frametool.errors import FormatError
from frametool.text.cells import whole_records
from frametool.text.lines import read_blocks


@given(st.binary(max_size=60).map(lambda text: text.replace(b"a", b"\n")), st.integers(1, 20))
def test_blocks_are_the_stream_cut_behind_line_ends(text: bytes, size: int) -> None:
    blocks = list(read_blocks(io.BytesIO(text), size=size))
    assert b"".join(blocks) == text
    assert all(block.endswith(b"\n") for block in blocks[:-1])
    assert all(blocks)


def test_a_line_longer_than_allowed_is_an_error_that_says_so() -> None:
    with pytest.raises(FormatError, match="longer than 1000 bytes"):
        list(read_blocks(io.BytesIO(b"x" * 5000 + b"\n"), size=100, longest=1000))


def test_records_of_several_lines_stay_whole() -> None:
    text = b'a,"b\n\nc",d\n' * 10
    blocks = list(read_blocks(io.BytesIO(text), size=7, whole=whole_records))
    assert b"".join(blocks) == text
    assert all(block.count(b'"') % 2 == 0 for block in blocks)


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
    class Pipe(io.BytesIO):
        def read1(self, size: int | None = -1, /) -> bytes:
            return super().read1(min(size or 0, 1 << 16))

    monkeypatch.setattr("frametool.text.lines._readiness", lambda _stream: lambda _patience: True)
    text = b"0123456\n" * 100_000
    blocks = list(read_blocks(Pipe(text)))
    assert b"".join(blocks) == text
    assert len(blocks[0]) > 1 << 16


def test_reading_lines_loads_no_numpy() -> None:
    code = "import sys, frametool.text.lines; print('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout == b"False\n"
