"""A row's result never depends on its neighbours: one row is changed in every way, all others stay to the bit."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest
from flow import INVERT, MOVE, QUARTER, asked, convert, flow

if TYPE_CHECKING:
    from collections.abc import Callable

COMPOSE = asked(left=QUARTER, right=(QUARTER,))
SWAP = INVERT._replace(rename=lambda parent, name: (name, parent))
TABLES = {
    "points": ("x,y,z", MOVE),
    "poses": ("x,y,z,qx,qy,qz,qw", COMPOSE),
    "angles": ("roll,pitch,yaw", convert("quaternion")),
    "degrees": ("x [mm],y,z,roll_deg,pitch_rad,yaw", INVERT),
    "vectors": ("x,y,z,rotvec_x,rotvec_y,rotvec_z", COMPOSE),
    "axes": ("axis_x,axis_y,axis_z,angle", convert("rpy,matrix")),
    "parameters": ("mrp_x,mrp_y,mrp_z", convert("rotvec_deg")),
    "plane": ("x,y,yaw", INVERT),
    "frames": ("parent,name,x,y,z,qx,qy,qz,qw", SWAP),
}
CELLS = [
    "", "oops", "nan", "inf", "1e400", "4000000", "-4e6", "1e300", "-0.0", "5e-324", '"1"', "1_0", "\0", 'a"b', "é",
    "90deg", "1.", " 7 ", "0x10", "123456789012345678901234567890", "\x1a", '"a,b"', '"a\nb"',
]  # fmt: skip
ROWS: list[Callable[[list[str]], list[str]]] = [
    lambda cells: cells[:-1], lambda cells: [*cells, "1"], lambda _cells: [], lambda cells: [""] * len(cells),
    lambda _cells: ["# no row"], lambda cells: [cells[0], *["0"] * (len(cells) - 1)], lambda cells: cells[:1],
]  # fmt: skip


def table(header: str, count: int, rng: random.Random) -> list[list[str]]:
    """Make rows of small rotations that are valid in every notation: the last number makes a quaternion unit."""
    rows = []
    names = header.split(",")
    for row in range(count):
        cells = [str(row), *(f"f{rng.randrange(3)}" if name in ("parent", "name") else "" for name in names)]
        for at, name in enumerate(names, 1):
            cells[at] = cells[at] or repr(rng.uniform(-0.3, 0.3))
            if name == "qw":
                cells[at] = repr((1.0 - sum(float(each) ** 2 for each in cells[at - 3 : at])) ** 0.5)
        rows.append(cells)
    return rows


def text_of(header: str, rows: list[list[str]]) -> bytes:
    return ("\n".join([f"id,{header}", *(",".join(cells) for cells in rows)]) + "\n").encode()


def by_id(text: bytes, without: int) -> list[bytes]:
    """Return the rows of a result but the changed one, told by the counter in front."""
    lines = text.splitlines()[1:]
    return [line for line in lines if line.split(b",")[0].isdigit() and int(line.split(b",")[0]) != without]


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("count", [1, 2, 17, 100])
@pytest.mark.parametrize("on_error", ["skip", "null"])
def test_a_changed_row_changes_no_other(name: str, count: int, on_error: str) -> None:
    header, request = TABLES[name]
    request = request._replace(on_error=on_error)
    rng = random.Random(f"{name} {count}")  # noqa: S311 - rows to change, nothing to hide
    rows = table(header, count, rng)
    clean = flow(text_of(header, rows), request).text
    width = len(rows[0])
    changes = [(at, cell) for at in range(1, width) for cell in CELLS]
    for at, cell in rng.sample(changes, min(len(changes), 12)):
        row = rng.randrange(count)
        changed = [list(cells) for cells in rows]
        changed[row][at] = cell
        result = flow(text_of(header, changed), request, size=rng.choice([0, 30, 200, 3000]))
        assert by_id(result.text, row) == by_id(clean, row), (at, cell)
    for change in ROWS:
        row = rng.randrange(count)
        changed = [list(cells) for cells in rows]
        changed[row] = change(changed[row])
        result = flow(text_of(header, changed), request, size=rng.choice([0, 30, 200, 3000]))
        assert by_id(result.text, row) == by_id(clean, row), changed[row]
