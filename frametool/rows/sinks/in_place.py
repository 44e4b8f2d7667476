"""Edit records in the text of a stream: replace numbers in place; replace, add or remove members.

All other text is unchanged, byte for byte.  Of the syntax of JSON and YAML only the spelling of members and their
separators is used.
"""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from itertools import chain, groupby
from math import isnan
from operator import itemgetter
from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.documents.document import Aliased, Node, parse_documents, parse_nodes
from frametool.documents.source import Source, Verbatim, decode
from frametool.documents.writers import dump_json, dump_yaml, flow, quoted
from frametool.errors import FormatError, FrametoolError, NamedTuple
from frametool.geometry.representations import ROTATIONS
from frametool.grammar.pose import LISTED_WORDS, ROTATION_KEYS, Pose
from frametool.grammar.readers import AXES_KEY, EARTH_FRAMES, PLACE_KEYS
from frametool.grammar.result import Result, Style, with_entries
from frametool.rows.faults import Fault
from frametool.rows.holders import POINT_KEYS, QUATERNION, XYZ, outdated
from frametool.rows.plain import Answer, Entry, Outside, RecordText, json_documents, written
from frametool.rows.record import outermost
from frametool.rows.shapes import POINT, POSE, SIX, TURNED, VECTOR
from frametool.rows.sinks import Const, IfLocked, In, Out, Piece, Renamed, Word, one_of
from frametool.text.lines import with_edits

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.rows.request import Request
    from frametool.rows.sources.records import Part

Pieces: TypeAlias = tuple[Piece, ...]

MARK = "\0"
SAMPLE = (0.5, 0.5, 0.5, 0.5)
OURS = frozenset((*POINT_KEYS, *ROTATION_KEYS, AXES_KEY, *XYZ, "linear", "angular", "force", "torque")).union(
    *({column, f"{column}_deg", f"{column}_rad"} for row in ROTATIONS.values() for column in row.columns)
)


class Edit(NamedTuple):
    """A range of the text and the pieces that replace it; an empty range is an insertion."""

    start: int
    end: int
    pieces: Pieces


def nulls_in(node: Node) -> Iterator[tuple[int, int, str]]:
    """Yield the range of each number of a pose, at any depth of a record, with the null that replaces it."""
    if type(node.value) is list:
        for item in node.value:
            yield from nulls_in(item)
    for key, (named, value) in node.value.items() if type(node.value) is dict else ():
        if not ((key in OURS and (key not in LISTED_WORDS or type(value.value) in (list, dict))) or key in PLACE_KEYS):
            yield from nulls_in(value)
        elif type(value.value) in (list, dict) and not value.flow:  # a block of lines
            yield named.end, value.end, ": null"
        else:
            yield value.start, value.end, "null"


class Splicer:
    """The edits that write a result into the text of its record.

    first: the index of the record's first number among all results of the text
    ahead, behind: members to insert before and after a member, by its key; dropped: keys of members to remove
    """

    def __init__(self, root: Node, entry: Entry, request: Request, *, json: bool, first: int) -> None:
        """Find the record's mapping and its numbers among the nodes of the text."""
        self.root, self.entry, self.json, self.first = root, entry, json, first
        self.record, self.target = record, _ = entry.record, entry.target
        self.request = request.for_kind(record.shape.kind)
        self.kind = request.operation.result_kind(record.shape.kind)
        self.node = root.at(outermost(record.path) if request.operation.only_adds else record.path)
        self.members: dict[str, tuple[Node, Node]] = self.node.value if type(self.node.value) is dict else {}
        self.flow = json or self.node.flow or not self.members
        self.head, self.tail = next(iter(self.members), ""), next(reversed(self.members), "")
        self.between = ", " if self.flow else "\n" + " " * self.members[self.head][0].column  # separator of members
        self.edits, self.dropped = list[Edit](), set[str]()
        self.ahead, self.behind = defaultdict[str, list[Pieces]](list), defaultdict[str, list[Pieces]](list)
        self.slots: list[Node | None] = [None if path is None else root.at(path) for path in record.numbers]

    def run(self) -> list[Edit]:
        """Return the edits, in no particular order."""
        shape, unit = self.record.shape, self.target.unit
        # a bare list remains one if the result has the same numbers
        stays = bool(self.members) or ((unit is None or shape.unit is not None) and not self.target.extras)
        if self.request.operation.only_adds:
            self.behind[self.tail] += self._extras(0)
        else:
            if self.members:
                self._names()
            if self.kind != shape.kind or not stays or not (self.members or self._same_rotation()):  # all new members
                keys, size = self.record.keys, self.target.own_size
                position = [self._place("xyz" if self.kind == POSE else self.kind)] if unit is not None else []
                self.behind[self.tail] += [*position, *self._rotation(), *self._extras(size)]
                self.dropped |= {keys.position, keys.rotation, *keys.others, *keys.members, *keys.flat}
                self.dropped |= {*outdated(self.members), *self.target.extras, "inverse", "angles"}
            elif self.members:
                self._in_place()
            else:
                self._numbers(range(len(self.slots)), 0)
        return [*self.edits, *self._put_together()]

    def _put_together(self) -> Iterator[Edit]:
        """Yield the edits that insert and remove members, with their separators."""
        gap, members = Const(self.between.encode()), list(self.members.values())
        if not members and (parts := self.behind[""]):
            yield Edit(self.node.start, self.node.end, (Const(b"{"), *_joined(parts, gap), Const(b"}")))
        follows = False  # True after the first remaining member
        for at, (key, (key_node, value)) in enumerate(self.members.items()):
            parts = self.behind[key]
            yield from (Edit(key_node.start, key_node.start, (*part, gap)) for part in self.ahead[key])
            if key not in self.dropped:
                yield from (Edit(value.end, value.end, (gap, *part)) for part in parts)
            elif parts:
                yield Edit(key_node.start, value.end, _joined(parts, gap))
            elif follows:
                yield Edit(members[at - 1][1].end, value.end, ())
            else:
                yield Edit(key_node.start, members[at + 1][0].start if at + 1 < len(members) else value.end, ())
            follows = follows or bool(parts) or key not in self.dropped

    def _same_rotation(self) -> bool:
        """Return True if the rotation is written in the notation it was read in."""
        shape, target = self.record.shape, self.target
        same = [(shape.notation, shape.degrees)] == list(target.notations) if shape.notation else not target.notations
        is_alone = self.record.keys.flat == QUATERNION and target.unit is not None  # no rotation next to xyz
        return same and shape.whole == target.whole and not (shape.inverse or is_alone)

    def _numbers(self, slots: Sequence[int], first: int) -> None:
        """Replace the numbers in some slots by those of the result, from `first` on."""
        for out, slot in enumerate(slots, self.first + first):
            if (node := self.slots[slot]) is not None:
                quote = bool(node.quote)
                self.edits.append(Edit(node.start + quote, node.end - quote, (Out(out, out + 1, b""),)))

    def _in_place(self) -> None:
        """Write the result over the record's numbers; numbers without a place of their own become new members."""
        target, shape, keys = self.target, self.record.shape, self.record.keys
        if target.scaled:
            self.dropped.update(keys.covariances)  # the matrix contains the scale
        elif not shape.rewritten:
            covariances = range(shape.own_size, shape.own_size + sum(shape.covariance))
            self._numbers(covariances, target.own_size + len(target.extras))
        if shape.kind in SIX:
            self._numbers(range(6), 0)
            return
        kind = "xyz" if shape.kind == POSE else shape.kind
        named = kind if keys.position in ("", POINT, VECTOR) else keys.position
        members, there = (keys.position,) if keys.position else keys.members, shape.position_size
        if shape.unit is None:
            if target.unit is not None:
                self.ahead[keys.rotation or self.head].append(self._place("xyz"))
        elif target.unit is None:  # becomes part of a 4x4 matrix
            self.dropped.update(members)
        elif None in self.slots[:there] or (there < 3 and not target.absent) or target.place != shape.place:
            self.behind[members[0]].append(self._place(named))
            self.dropped.update(members)
        elif not self.request.keeps_position or shape.inverse:  # else its text is unchanged
            self._numbers(range(there), 0)
        at, made = "", list[Pieces]()
        if shape.kind in TURNED:
            old = {*outdated(self.members), *self.target.extras, "inverse", *keys.others}
            self.dropped.update(old.difference(keys.flat))
            slots, at = range(there, shape.own_size), keys.rotation
            if self._same_rotation() and None not in [self.slots[slot] for slot in slots]:
                self._numbers(slots, self.target.position_size)
                at = keys.flat[-1] if keys.flat else at
            else:
                made = self._rotation()
                if at:
                    self.dropped.update({"angles", at, *keys.flat})
                elif made and target.unit is None:
                    at = next(iter(members), "")  # in place of the position, which the matrix contains
            at = at or keys.position
        else:
            self.dropped.update(keys.others)
        if keys.position not in ("", named, *self.dropped):
            node, quote = self.members[keys.position][0], '"' * self.json
            self.edits.append(Edit(node.start, node.end, (Const(f"{quote}{named}{quote}".encode()),)))
        self.behind[at or self.tail] += made + self._extras(target.own_size, () if made else keys.flat)

    def _place(self, key: str) -> Pieces:
        """Return the position as members: x, y, z, or a geodetic position with the axes of its rotation."""
        place = self.target.place
        entry: dict[str, Any] = {key: list(SAMPLE[:3])} if place is None else place.entry(place.sample)
        if place is not None and place.name in EARTH_FRAMES:
            entry = {key: entry.pop(place.name)} | entry
        elif place is not None and self.target.notations:
            entry |= {AXES_KEY: place.axes}
        return self._member(entry, 0)

    def _rotation(self) -> list[Pieces]:
        """Return the rotation as members in all notations, with a flag for gimbal lock; [] without a rotation."""
        notations = self.target.notations
        degrees = any(degrees for notation, degrees in notations if notation.degrees is None)  # of bare angles
        style = Style("json", tuple(notation for notation, _ in notations), degrees=degrees)
        entry = Result(Pose(SAMPLE[:3] if self.target.whole else None, SAMPLE)).mapping(style)
        entry.pop("gimbal_lock", None)
        made = self._member(entry, self.target.position_size)
        if any(notation.euler_axes for notation, _ in notations):
            flag = [Const(self.between.encode()), *self._member({"gimbal_lock": True}, 0)]
            made += tuple(IfLocked(piece.text) for piece in flag if isinstance(piece, Const))
        return [made] if made else []

    def _extras(self, first: int, there: Sequence[str] = ()) -> list[Pieces]:
        """Return the extra numbers of a result as members; existing ones are replaced if the operation wants it.

        there: keys that are already written, such as the angle of an axis-angle
        """
        said, prefix, members = self.request.operation.shown, self.request.results.prefix, list[Pieces]()
        if said is None:
            for is_there, group in groupby((prefix + name for name in self.target.extras), there.__contains__):
                names = dict.fromkeys(group, 0.5)
                members += [] if is_there else [self._member(with_entries(names), first)]
                first += len(names)
            return members
        for name, value in said.members.items():
            key = prefix + name
            member = self._member({key: value if isinstance(value, str) else 0.5}, 0)
            if isinstance(value, Word):
                member = *member[:-1], value._replace(number=self.first + value.number)
            elif not isinstance(value, str):
                member = *member[:-1], *self._listed(value)
            if said.replaces and key in self.members:
                self.behind[key].append(member)
                self.dropped.add(key)
            else:
                members.append(member)
        return members

    def _listed(self, places: Sequence[int]) -> Iterator[Piece]:
        """Yield the pieces of a list of numbers, or of a single number; null for nan."""
        precision = self.request.results.precision
        fmt, exponent = "" if precision is None else f"z.{precision}f", "e" if self.json else ".0e"
        opens, closes = ("[", "]") if places[1:] else ("", "")
        for at in places:
            behind = closes if at == places[-1] else ", "
            around = opens * (at == places[0]), behind, "null" * (at == places[0]), fmt, exponent
            yield Word(self.first + at, partial(_item, *around))

    def _names(self) -> None:
        """Rename frames where the record names them, or in new members."""
        record, place, kind = self.record, self.target.place, self.record.shape.kind
        parent, placed = "parent" if self.kind == POSE else "frame", record.keys.placed
        is_local = bool(place and (place.origin or (self.kind != POSE and place.name not in EARTH_FRAMES)))
        said: dict[str, Any] = {}
        if record.parent.text and not record.parent.paths and not is_local:  # of a geodetic position
            said[parent] = self.entry.parent
        if placed and record.name.text and not record.name.paths:
            said["name"] = self.entry.name
        if "header" in placed and record.stamp_ns is not None:
            said["stamp_ns"] = Verbatim(str(record.stamp_ns))
        names = [(record.name, self.entry.name, "name")]
        names += [(record.parent, self.entry.parent, parent)] if record.parent.paths or not record.parent.text else []
        # in a row without a pose these keys have another meaning
        others = not self.request.rows.poses and {"name", "parent"} & self.members.keys() - {*record.keys.members}
        for old, new, key in () if self.request.rename is None or others else names:
            if new == old.text:
                continue
            if not old.paths and kind not in SIX:  # a bare Twist or Wrench has no such field
                said[key] = new
            for path in old.paths:
                if new is None and path[:-1] == record.path and path[-1] != "child_frame_id":
                    self.dropped.add(str(path[-1]))
                    continue
                node = self.root.at(path)
                text = quoted_name(node, new or "", json=self.json).encode()
                self.edits.append(Edit(node.start, node.end, (Renamed(node.start, text),)))
        if said:
            self.ahead[self.head].append(self._member(said, 0))

    def _member(self, entry: dict[str, Any], first: int) -> Pieces:
        """Return members in the style of the record, with a piece for each number."""
        if self.flow or not entry:
            text = (dump_json if self.json else flow)(entry, lambda _: MARK)[1:-1]
        else:
            text = dump_yaml(entry, lambda _: MARK).rstrip("\n").replace("\n", self.between)
        words = {} if self.target.place is None else self.target.place.words
        pieces: list[Piece] = []
        for at, part in enumerate(text.split(MARK), first):
            number = self.first + at
            made = Word(number, one_of(words[at], b'"' * self.json)) if at in words else Out(number, number + 1, b"")
            pieces += [Const(part.encode()), made] if part else [made]
        return tuple(pieces[:-1])


def _item(before: str, behind: str, none: str, fmt: str, exponent: str, number: float) -> bytes:
    """Write a number of a list with the text around it, or `none` for nan."""
    return none.encode() if isnan(number) else f"{before}{number_text(number, fmt, exponent)}{behind}".encode()


def number_text(number: float, fmt: str, exponent: str) -> str:
    """Write a number with a format specification; exponent: replaces the e of 1e-05, `.0e` for YAML."""
    text = format(number, fmt)
    return text if "." in text else text.replace("e", exponent)


def _joined(parts: Sequence[Pieces], gap: Const) -> Pieces:
    """Return members joined by separators."""
    return tuple(piece for part in parts for piece in (gap, *part))[1:]


def quoted_name(node: Node, name: str, *, json: bool) -> str:
    """Write a frame's name with the quotes of the name that it replaces."""
    if node.quote == "'":
        return "'" + name.replace("'", "''") + "'"
    if not json and (node.quote != '"' or not node.value):
        return quoted(name) if name else "''"
    return dump_json(name)


def rendered(known: RecordText, answers: Sequence[Answer]) -> bytes:
    """Return the text with its numbers replaced by results; b"" if it has no records."""
    numbers = [*chain.from_iterable(map(written, answers))]
    precision, exponent = known.request.results.precision, "e" if known.json else ".0e"
    fmt = "" if precision is None else f"z.{precision}f"
    locked = any(each.entry.target.locked(each.parts) for each in answers)
    stretches, pieces = stretches_of(len(known.text), (), known.edits)
    shown = []
    for piece in pieces:
        if isinstance(piece, In):
            shown.append(known.text[slice(*stretches[piece.part])])
        elif isinstance(piece, Out):
            shown.append(number_text(numbers[piece.first], fmt, exponent))
        elif isinstance(piece, Word):
            shown.append(piece.text(numbers[piece.number]).decode())
        elif isinstance(piece, (Const, Renamed)) or (locked and isinstance(piece, IfLocked)):
            shown.append(piece.text.decode())
    return "".join(shown).encode() if known.entries else b""


def stretches_of(
    length: int, cuts: Sequence[tuple[int, int]], edits: Iterable[Edit]
) -> tuple[list[tuple[int, int]], list[Piece]]:
    """Split a text at `cuts` and `edits` into stretches; return these and the pieces of the result."""
    stretches: list[tuple[int, int]] = []
    pieces: list[Piece] = []
    slots, at = list(reversed(cuts)), 0
    for edit in (*sorted(edits, key=itemgetter(0, 1)), Edit(length, length, ())):
        start = max(edit.start, at)
        for end, stays, added in ((start, True, edit.pieces), (max(edit.end, start), False, ())):
            while at < end:
                slot = slots[-1] if slots and slots[-1][1] <= end else None
                stop = end if slot is None else slot[0] if slot[0] > at else slots.pop()[1]
                stretches.append((at, stop))
                if stays:
                    pieces.append(In(len(stretches) - 1))
                at = stop
            pieces += added
    return stretches, pieces


def nulled(record: bytes, *, json: bool) -> tuple[str, bool]:
    """Return a record with null for the numbers of its pose, and True if it has any; "" for one that is not valid."""
    try:
        text = record.decode()
        json_documents(Source("", text)) if json else parse_documents(text, "")
        edits = [edit for root in parse_nodes(text) for edit in nulls_in(root)]
    except (FormatError, UnicodeDecodeError):
        return "", False
    return with_edits(text, edits), bool(edits)


def column_in(text: bytes, place: int) -> int:
    """Return the column, from 1, of an offset in its line."""
    return len(text[text.rfind(b"\n", 0, place) + 1 : place].decode("utf-8", "replace")) + 1


def attempt(text: bytes, part: Part, line: int = 0, *, fmt: str, request: Request, name: str) -> RecordText | Fault:
    """Read one record of a stream and prepare its edits, or return a Fault; line: its first line, from 0."""
    if part.problem:
        return Fault(line, "", part.problem, final=part.final)
    source = Source(name, "", line + 1, column_in(text, part.start))
    try:
        decoded = decode(text[part.start : part.end], name)
        if fmt == "yaml":
            from frametool.ros.messages import without_noise

            decoded = without_noise(decoded)
            if request.results.rewrite_records and not decoded.strip():
                return Fault(line, "", Outside("printed between messages"))
        source = source._replace(text=decoded)
        found = RecordText(source, request, json=fmt == "json")
        edits, first = list[Edit](), 0
        for entry in () if request.results.rewrite_records else found.entries:
            edits += Splicer(found.root, entry, request, json=found.json, first=first).run()
            first += entry.target.size
        found.edits = list(dict.fromkeys(edits))  # a name that several records share is edited once
    except FrametoolError as error:
        return fault_at(source, error, line)
    return found


def fault_at(source: Source, error: FrametoolError, line: int) -> Fault:
    """Return an error in a record as a Fault with its place; line: for an error without one."""
    column = getattr(error, "column_name", "")
    if not isinstance(error, FormatError):
        return Fault(line, column, error)
    if isinstance(error, Aliased):
        error = error.in_text(source.text)
    at_line, at = source.place(max(error.line, 1), error.column)
    return Fault(at_line - 1, column or (str(at) if error.column else ""), error.message, kind=error.kind)
