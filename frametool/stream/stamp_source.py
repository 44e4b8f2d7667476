"""Rows that are moved each at its own time: where their stamps are, how they are read, who knows the poses then."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, AnyStr, NamedTuple

from frametool.documents.document import Node, parse_nodes
from frametool.errors import ValueInvalid, did_you_mean, shown
from frametool.geometry.rigid import EXACT
from frametool.grammar.readers import STAMP_KEYS, Misfit, Path, in_nanoseconds, kind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.geometry.types import Components

HEADER = "header.stamp"


class Timed(NamedTuple):
    """Where the stamps of rows are, and the poses that move from a frame (None: the one SOURCE) at such times.

    name: the column or key of the stamps; "" for the stamp in the header of each message
    many: columns of poses at an array of nanoseconds, nan where there is no data
    one: a pose at one time, or the reason raised
    moves: True if what lies between a frame and the target depends on the time
    width: how many numbers such a pose has, with its covariance if that counts
    """

    name: str
    many: Callable[[str | None, Any], Components]
    one: Callable[[str | None, int], Components]
    moves: Callable[[str | None], bool] = bool
    width: int = EXACT

    @classmethod
    def of_rows(cls, name: str) -> Timed:
        """Return where the stamps of rows stand for an expression, which knows by itself what they are for."""
        return cls(name, lambda *_: (), lambda *_: (), lambda _: True)

    @property
    def column(self) -> str:
        """Name the column or key for messages."""
        return self.name or HEADER

    def pose(self, frame: str | None, stamp_ns: int) -> Components:
        """Return the pose at one time, to the bit as `many` does; raises FrametoolError if absent."""
        found = tuple(float(column[0]) for column in self.many(frame, [stamp_ns]))
        return found if found[0] == found[0] else self.one(frame, stamp_ns)


def read_header_stamp(seconds: str, nanoseconds: str) -> int:
    """Read the two numbers of a header's stamp as nanoseconds; raises ValueInvalid."""
    whole, below = (text.strip(" \t\"'") for text in (seconds, nanoseconds))
    if not (whole.lstrip("+-").isdecimal() and below.isdecimal()):
        raise ValueInvalid(f"a stamp is two whole numbers, found {shown(whole)} and {shown(below)}")
    return int(whole) * 1_000_000_000 + int(below)


def read_stamp(text: str, *, in_ns: int) -> int:
    """Read a cell as nanoseconds, quotes and blanks around it left out; raises ValueInvalid.

    in_ns: how many a whole number is, by its name; 0 are seconds, or what its size says
    """
    from frametool.frames.stamps import SUFFIXES, nanoseconds_each, parse_stamp, tell_size

    bare = text.strip(" \t\"'")
    if in_ns and not bare.endswith("ns"):
        if not bare.lstrip("+-").replace(".", "", in_ns > 1).isdecimal():
            unit = "integer nanoseconds" if in_ns == 1 else SUFFIXES[in_ns]
            raise ValueInvalid(f"{shown(bare)} is not a time in {unit}")
        bare += SUFFIXES[in_ns]
    elif bare.isdecimal() and len(bare) < 20:
        each = nanoseconds_each(int(bare))
        tell_size(int(bare), each)
        bare += SUFFIXES[each]
    stamp_ns = parse_stamp(bare)
    if abs(stamp_ns) >= 1 << 63:
        remedy = "; are these some? then write ns behind them, or call them stamp_ns"
        raise ValueInvalid(f"{shown(text.strip())} is beyond 64 bits of nanoseconds{remedy}")
    return stamp_ns


def stamp_text(written: str, stamp_ns: int, *, in_ns: int) -> str:
    """Write another stamp as one was written: whole units as such, seconds with no fewer decimals."""
    from frametool.frames.stamps import format_stamp

    bare = written.strip()
    if bare.endswith("ns"):
        return f"{stamp_ns}ns"
    if in_ns and not bare.endswith("s"):
        whole, below = divmod(abs(stamp_ns), in_ns)
        decimals = f"{below:0{len(str(in_ns)) - 1}d}".rstrip("0") if below else ""
        return f"{'-' * (stamp_ns < 0)}{whole}" + f".{decimals}" * bool(below)
    seconds, _, decimals = format_stamp(stamp_ns).partition(".")
    wanted = 0 if bare.endswith("s") or "e" in bare.lower() else len(bare.partition(".")[2])
    decimals = decimals.rstrip("0").ljust(wanted, "0")
    return f"{seconds}.{decimals}" if decimals else seconds


def replaced(text: AnyStr, edits: Iterable[tuple[int, int, AnyStr]]) -> AnyStr:
    """Return text, or bytes, with others in the place of some stretches."""
    pieces: list[AnyStr] = []
    end = 0
    for start, stop, new in sorted(edits):
        pieces += [text[end:start], new]
        end = stop
    pieces.append(text[end:])
    return text[:0].join(pieces)


def at_other_times(text: str, offset_ns: int) -> tuple[str, int]:
    """Return documents with so much added to all stamps in them, and how many these are."""
    edits: list[tuple[int, int, str]] = []
    for root in parse_nodes(text):
        _shift(root, offset_ns, edits)
    return replaced(text, edits), len(edits)


def _shift(node: Node, offset_ns: int, edits: list[tuple[int, int, str]]) -> None:
    """Add to `edits` those of the stamps below a node: one of a mapping by its key, or the seconds it is made of."""
    if type(node.value) is list:
        for each in node.value:
            _shift(each, offset_ns, edits)
    if type(node.value) is not dict:
        return
    own = next((key for key in STAMP_KEYS if key in node.value and type(node.value[key][1].value) is str), "")
    for key, (_, value) in node.value.items():
        if key != own:
            _shift(value, offset_ns, edits)
            continue
        with suppress(ValueInvalid):
            in_ns = in_nanoseconds(key)
            new = stamp_text(value.value, read_stamp(value.value, in_ns=in_ns) + offset_ns, in_ns=in_ns)
            edits.append((value.start + bool(value.quote), value.end - bool(value.quote), new))
    for seconds, below in (("sec", "nanosec"), ("secs", "nsecs")):
        pair = [node.value[key][1] for key in (seconds, below) if key in node.value]
        if len(pair) == 2:
            with suppress(ValueInvalid):
                stamp_ns = read_header_stamp(*(each.value for each in pair)) + offset_ns
                parts = divmod(stamp_ns, 1_000_000_000)
                edits += [(each.start, each.end, str(part)) for each, part in zip(pair, parts, strict=True)]


def key_path(documents: Any, holder: Path, name: str, wanted: str = "a time like 12.5") -> Path:
    """Find a scalar of a point or pose, its stamp: its own key, else that of a mapping around it; raises Misfit.

    The name of a joint leads to its position in a JointState.
    """
    from frametool.ros import messages

    around = [documents]
    for step in holder:
        around.append(around[-1][step])
    for depth in range(len(holder), 0, -1):
        if (position := messages.position_of(name, around[depth])) is not None:
            return (*holder[:depth], *position)
        steps = name.split(".")
        for keys in ((name,), steps, [int(each) if each.isdecimal() else each for each in steps]):
            if (found := _below(around[depth], keys)) is not None:
                if type(found[0]) in (dict, list):
                    raise Misfit(f"expected {wanted}, found {kind(found[0])}", (*holder[:depth], *keys))
                return (*holder[:depth], *keys)
    known = [key for each in around[1:] if type(each) is dict for key in each]
    raise Misfit(f"no key {shown(name)}{did_you_mean(name, known)}", holder)


def stamp_keys(documents: Any, holder: Path) -> Path:
    """Find the key of a record's stamp by the names such keys have; raises Misfit."""
    for name in STAMP_KEYS:
        try:
            return key_path(documents, holder, name)
        except Misfit:
            continue
    usual = ", ".join(STAMP_KEYS)
    raise Misfit(f"no stamp: neither a header nor {usual}; name its key with --time-column", holder)


def _below(value: Any, keys: Sequence[str | int]) -> tuple[Any] | None:
    """Follow keys and indices down; None where one is not there."""
    for key in keys:
        is_index = type(value) is list and type(key) is int and key < len(value)
        if not (is_index or (type(value) is dict and key in value)):
            return None
        value = value[key]
    return (value,)
