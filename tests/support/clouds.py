"""Clouds made by hand, and where their points go: a product of elementary matrices that shares no code with the tool."""

from __future__ import annotations

import json
from math import cos, radians, sin
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    Run = Callable[..., Any]

SHIFT = (1.0, -2.0, 0.5)
TURN = 30.0  # degrees about z
POSE = json.dumps({"xyz": SHIFT, "rpy_deg": [0, 0, TURN]})
RNG = np.random.default_rng(5)
PCD = "# .PCD v0.7 - Point Cloud Data file format\n# a comment\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\nWIDTH {width}\nHEIGHT {height}\nVIEWPOINT {viewpoint}\nPOINTS {points}\nDATA {data}\n"
TYPES = {"i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float", "f8": "double"}


class Moved(NamedTuple):
    """What a run left: the bytes of its file (None: there is none), its status, what it said."""

    data: bytes | None
    status: int
    err: str


def move(run: Run, folder: Path, form: str, data: bytes, *options: str, into: str = "", pose: str = POSE) -> Moved:
    """Move a cloud by the pose from a file into another."""
    out = folder / f"out.{into or form}"
    out.unlink(missing_ok=True)
    done = run("apply", "--transform", pose, "-i", f"in.{form}", "-o", out.name, *options, files={f"in.{form}": data})
    assert not list(folder.glob("*.part"))
    return Moved(out.read_bytes() if out.exists() else None, done.status, done.err)


def turned(vectors: Any) -> NDArray[np.float64]:
    """Return vectors (n, 3) turned by the pose."""
    c, s = cos(radians(TURN)), sin(radians(TURN))
    found: NDArray[np.float64] = np.asarray(vectors, np.float64) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    return found


def moved(points: Any) -> NDArray[np.float64]:
    """Return points (n, 3) moved by the pose."""
    found: NDArray[np.float64] = turned(points) + SHIFT
    return found


def xyz(cloud: NDArray[Any], *names: str) -> NDArray[np.float64]:
    """Return three fields as rows."""
    return np.array([cloud[name] for name in names or "xyz"], np.float64).T


def cloud(count: int = 40, kind: str = "<f4", **others: str) -> NDArray[Any]:
    """Return records with x, y, z and other fields, each with its type, all of them random."""
    records = np.zeros(count, [*((name, kind) for name in "xyz"), *others.items()])
    for name in records.dtype.names or ():
        is_float = records[name].dtype.kind == "f"
        records[name] = RNG.normal(size=count, scale=20.0) if is_float else RNG.integers(0, 100, count)
    return records


def pcd(records: NDArray[Any], data: str = "binary", **words: object) -> bytes:
    """Write a PCD file; `words` replace those of its header."""
    kinds = [records.dtype[name] for name in records.dtype.names or ()]
    told: dict[str, object] = {
        "fields": " ".join(records.dtype.names or ()),
        "sizes": " ".join(str(kind.base.itemsize) for kind in kinds),
        "types": " ".join(kind.base.kind.upper() for kind in kinds),
        "counts": " ".join(str(int(np.prod(kind.shape))) for kind in kinds),
        "width": len(records), "height": 1, "viewpoint": "0 0 0 1 0 0 0", "points": len(records), "data": data,
    }  # fmt: skip
    head = PCD.format(**told | words).encode()
    if data == "ascii":
        return head + b"".join(" ".join(map(str, row.tolist())).encode() + b"\n" for row in records)
    return head + records.tobytes()


def pcd_rows(data: bytes | None, kind: Any) -> tuple[bytes, NDArray[Any]]:
    """Take a binary PCD file apart: its header and its points."""
    head, mark, body = (data or b"").partition(b"DATA binary\n")
    return head + mark, np.frombuffer(body, kind)


def ply(records: NDArray[Any], form: str = "binary_little_endian", before: str = "", after: str = "") -> bytes:
    """Write the header of a PLY file and its vertices; before, after: elements around them in the header."""
    properties = "".join(f"property {TYPES[records.dtype[name].str[1:]]} {name}\n" for name in records.dtype.names or ())
    head = f"ply\nformat {form} 1.0\ncomment by hand\nobj_info none\n{before}element vertex {len(records)}\n{properties}{after}end_header\n"
    if form == "ascii":
        return head.encode() + b"".join(" ".join(map(str, row.tolist())).encode() + b"\n" for row in records)
    kind = records.dtype.newbyteorder("<" if "little" in form else ">")
    return head.encode() + records.astype(kind).tobytes()


def ply_rows(data: bytes | None, kind: Any, count: int) -> tuple[bytes, NDArray[Any], bytes]:
    """Take a binary PLY file apart: its header, its vertices, what stands behind them."""
    head, mark, body = (data or b"").partition(b"end_header\n")
    size = np.dtype(kind).itemsize * count
    return head + mark, np.frombuffer(body[:size], kind), body[size:]
