"""Print what text costs: nanoseconds a float (or a row), beside what Python and numpy take for the same in this run.

Run as: python tests/benchmarks/bench_text.py
"""

from __future__ import annotations

import csv
import io
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from frametool.text.parse import parse_floats
from frametool.text.spans import Cells, Spans, join, split_blank, split_delimited
from frametool.text.write import float_spans

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.text.spans import Floats

ROWS, COLUMNS, REPEATS = 8000, 3, 40
FULL = np.random.default_rng(1).uniform(-100.0, 100.0, (ROWS, COLUMNS))
PRINTED = {
    "17 digits": FULL,
    "6 decimals": np.round(FULL, 6),
    "2 decimals": np.round(FULL, 2),
    "1e-18 (exponents)": FULL * 1e-20,
    "0.001 (leading zeros)": FULL * 1e-5,
    "one column of zeros": FULL * [1.0, 1.0, 0.0],
}
READ = {"6 decimals": "%.6f", "17 digits": "%r", "%.18e": "%.18e", "6 decimals, blanks": " %.6f"}


def best(action: Callable[[], object], count: int) -> float:
    """Give the shortest of many times, in nanoseconds an item."""
    times = []
    for _ in range(REPEATS):
        begin = perf_counter()
        action()
        times.append(perf_counter() - begin)
    return min(times) / count * 1e9


def report(name: str, ours: float, other: str = "", theirs: float = 0.0) -> None:
    print(f"{name:44} {ours:8.1f}" + (f"   {other:24} {theirs:8.1f}   {theirs / ours:5.1f} x" if other else ""))


def table(values: Floats, style: str) -> bytes:
    rows = (",".join(style % value for value in row) for row in values.tolist())
    return "".join(f"{index:03},{row},name {index}\n" for index, row in enumerate(rows)).encode()


def by_repr(values: Floats) -> bytes:
    return "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in values.tolist()).encode()


def by_percent(values: Floats) -> bytes:
    return (("%.6f,%.6f,%.6f\n" * len(values)) % tuple(values.ravel().tolist())).encode()


def numbers(cells: Cells) -> Spans:
    return Spans(cells.data, cells.starts[:, 1:4], cells.ends[:, 1:4])


def moved(block: bytes, write: Callable[[Floats, bytes], Spans]) -> bytes:
    """Read, move and write the three middle columns of five, the others passing through."""
    cells = split_delimited(block, b",", 5)
    values, _ = parse_floats(numbers(cells))
    before = Spans(cells.data, cells.line_starts, cells.starts[:, 1])
    behind = Spans(cells.data, cells.starts[:, 4], cells.line_ends)
    return join([before, write(values[:, [1, 0, 2]] * 0.7 + 0.1, b",,,"), behind])


def by_loadtxt(block: bytes) -> Floats:
    return np.loadtxt(io.BytesIO(block), delimiter=",", usecols=(1, 2, 3))


def six_decimals(values: Floats, separators: bytes) -> Spans:
    return float_spans(values, separators, 6)


def shortest(values: Floats) -> bytes:
    return join([float_spans(values, b",,\n")])


def print_floats() -> None:
    print("floats to text, ns a float")
    for name, values in PRINTED.items():
        ours = best(partial(shortest, values), values.size)
        report(f"shortest, {name}", ours, "repr", best(partial(by_repr, values), values.size))
    ours = best(lambda: join([float_spans(FULL, b",,\n", 6)]), FULL.size)
    report("fixed, 6 decimals", ours, "one bulk %", best(lambda: by_percent(FULL), FULL.size))


def read_floats() -> None:
    print("text to floats, ns a float")
    for name, style in READ.items():
        block = table(FULL, style)
        cells = numbers(split_delimited(block, b",", 5))
        ours = best(partial(parse_floats, cells), FULL.size)
        report(name, ours, "loadtxt, with splitting", best(partial(by_loadtxt, block), FULL.size))


def split_rows() -> None:
    print("cells, ns a row of five")
    block = table(FULL, "%.6f")
    theirs = best(lambda: list(csv.reader(io.StringIO(block.decode()))), ROWS)
    report("delimited", best(lambda: split_delimited(block, b",", 5), ROWS), "csv.reader", theirs)
    quoted = block.replace(b"name", b'"a,').replace(b"\n", b'"\n')
    report("delimited, one quoted", best(lambda: split_delimited(quoted, b",", 5), ROWS), "csv.reader", theirs)
    blank = block.replace(b" ", b"_").replace(b",", b" ")
    report("blank-separated", best(lambda: split_blank(blank, 5), ROWS), "csv.reader", theirs)


def whole_rows() -> None:
    print("split, read, move, write and join, ns a row of five")
    for name in ("6 decimals", "17 digits"):
        block = table(FULL, READ[name])
        report(f"from {name}, shortest", best(partial(moved, block, float_spans), ROWS))
        report(f"from {name}, to 6 decimals", best(partial(moved, block, six_decimals), ROWS))


if __name__ == "__main__":
    print_floats()
    read_floats()
    split_rows()
    whole_rows()
