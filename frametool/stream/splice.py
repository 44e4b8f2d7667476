"""What changes in the text of a record: numbers where they are, members that are replaced, added or left out.

Everything else stays as it is, byte for byte.  Knows the syntax of JSON and YAML only as far as members go: what
stands between them, and how one is written.
"""

from __future__ import annotations

from itertools import starmap
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.source import Verbatim
from frametool.documents.yaml_writer import quoted
from frametool.errors import ValueInvalid, shown
from frametool.geometry.representations import ROTATIONS
from frametool.grammar.names import EARTH_FRAMES, PLACE_KEYS
from frametool.grammar.pose import LISTED_WORDS, ROTATION_KEYS, Pose
from frametool.grammar.readers import AXES_KEY
from frametool.grammar.result import Result, Style, with_entries
from frametool.stream.layout import Const, IfLocked, Item, Out, Renamed, Word
from frametool.stream.record import POINT_KEYS, QUATERNION, STALE, XYZ
from frametool.stream.row_layout import POINT, POSE, SIX, TURNED, VECTOR, count_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.document import Node
    from frametool.stream.layout import Piece
    from frametool.stream.record import Name, Record
    from frametool.stream.record_text import Entry
    from frametool.stream.request import Request
    from frametool.stream.row_layout import Target

MARK = "\0"
SAMPLE = (0.5, 0.5, 0.5, 0.5)
OURS = frozenset((*POINT_KEYS, *ROTATION_KEYS, AXES_KEY, *XYZ, "linear", "angular", "force", "torque")).union(
    *({column, f"{column}_deg", f"{column}_rad"} for row in ROTATIONS.values() for column in row.columns)
)


class Edit(NamedTuple):
    """A stretch of the text and what replaces it; an empty stretch is an insertion."""

    start: int
    end: int
    pieces: tuple[Piece, ...]


def target_of(record: Record, request: Request) -> Target:
    """Choose how the result of a record is written; conventions of Euler angles share a key and are together."""
    names = [each.representation.name for each in request.notations]
    together = sorted(request.notations, key=lambda each: names.index(each.representation.name))
    return request._replace(notations=tuple(together)).target(record.shape)


def null_edits(node: Node) -> list[Edit]:
    """Put null in the place of every number that is ours, wherever in a record it is; the rest stays."""
    if type(node.value) is list:
        return [edit for item in node.value for edit in null_edits(item)]
    if type(node.value) is not dict:
        return []
    found = []
    for key, (_, value) in node.value.items():
        if (key in OURS and (key not in LISTED_WORDS or type(value.value) in (list, dict))) or key in PLACE_KEYS:
            found.append(Edit(value.start, value.end, (Const(b"null"),)))
        else:
            found += null_edits(value)
    return found


class Splicer:
    """The edits of one record; `first` is the index of its first number among all results of the text."""

    def __init__(
        self, text: str, root: Node, entry: Entry, request: Request, *, json: bool, first: int
    ) -> None:
        """Find the record's mapping and its numbers among the nodes of the text."""
        self.text = text
        self.root = root
        self.record = record = entry.record
        self.node = root.at(record.path)
        self.entry = entry
        self.target = entry.target
        self.request = request.for_kind(record.shape.kind)
        self.json = json
        self.first = first
        self.edits: list[Edit] = []
        self.dropped: set[str] = set()
        self.slots: list[Node | None] = [None if path is None else root.at(path) for path in record.numbers]

    def run(self) -> list[Edit]:
        """Return the edits, in no order."""
        shape = self.record.shape
        if self.request.operation.only_adds:
            lists = [at for at, step in enumerate(self.record.path) if type(step) is int]
            self.node = self.root.at(self.record.path[: lists[-1] + 1])  # the outermost that holds this record alone
            for member in self._extras(0):
                self._insert_after(self._last_value(), member)
            return self.edits
        if type(self.node.value) is not dict or not self.node.value:
            if self.request.operation.result_kind(shape.kind) != shape.kind:
                return self._rewritten()
            return self._numbers(range(len(self.slots)), 0) if self._stays_a_list() else self._rewritten()
        self._names()
        if self.request.operation.result_kind(shape.kind) != shape.kind:
            return self._of_other_kind()
        if self.target.scaled:
            self.dropped.update(self.record.covariances)  # the matrix says the scale
        elif not shape.rewritten:
            extras = len(self.request.extras(shape))
            self._numbers(range(shape.own_size, shape.own_size + sum(shape.covariance)), self.target.size + extras)
        if shape.kind in SIX:
            self._numbers(range(6), 0)
            return self.edits
        self._position()
        if shape.kind in TURNED:
            self._rotation()
            self.dropped.update({*STALE, "inverse", *self.record.others} - set(self.record.flat))
        else:
            self.dropped.update(self.record.others)
            for member in self._extras(self.target.size):
                self._insert_after(self._last_value(), member)
        self._leave_out()
        return self.edits

    def _stays_a_list(self) -> bool:
        """Return True if a result has the numbers of the bare list it comes from and no others."""
        has_place = self.target.unit is None or self.record.shape.unit is not None
        extra = self.request.extras(self.record.shape)
        return self._same_rotation() and has_place and not extra

    def _same_rotation(self) -> bool:
        """Return True if the rotation is written as it was read, number by number."""
        shape, target = self.record.shape, self.target
        same = [(shape.notation, shape.degrees)] == list(target.notations) if shape.notation else not target.notations
        is_alone = self.record.flat == QUATERNION and target.unit is not None  # x y z w mean nothing with xyz
        return same and shape.whole == target.whole and not (self.record.shape.inverse or is_alone)

    def _numbers(self, slots: Sequence[int], first: int) -> list[Edit]:
        """Put numbers of the result where the slots are."""
        for index, slot in enumerate(slots):
            node = self.slots[slot]
            if node is not None:
                out = self.first + first + index
                self.edits.append(
                    Edit(node.start + bool(node.quote), node.end - bool(node.quote), (Out(out, out + 1, b""),))
                )
        return self.edits

    def _position(self) -> None:
        """Write the position where it is, or as a member of its own; a whole matrix takes it in."""
        key, target = self.record.key, self.target
        if self.record.shape.unit is None:
            if target.unit is not None:
                anchor = self.node.value[self.record.rotation][0] if self.record.rotation else self._first_key()
                self._insert_before(anchor, self._place("xyz"))
            return
        kind = "xyz" if self.record.shape.kind == POSE else self.record.shape.kind
        if key in (POINT, VECTOR) and key != kind:
            node = self.node.value[key][0]
            self.edits.append(Edit(node.start, node.end, (Const(self._text(kind).encode()),)))
        members = (key,) if key else self.record.members
        there = self.record.shape.position_size
        if target.unit is None:
            self.dropped.update(members)
        elif None in self.slots[:there] or (there < 3 and not target.absent) or target.place != self.record.shape.place:
            self._replace(self.node.value[members[0]], self._place(key or kind))
            self.dropped.update(members[1:])
        elif not self.request.keeps_position or self.record.shape.inverse:  # else it keeps its text
            self._numbers(range(there), 0)

    def _place(self, key: str) -> tuple[Piece, ...]:
        """Write the position as a member, or as those of a place, with the axes of its rotation."""
        place = self.target.place
        if place is None:
            return self._member({key: list(SAMPLE[:3])}, 0)
        entry = place.entry(place.sample)
        if place.name in EARTH_FRAMES:
            entry = {key: entry.pop(place.name)} | entry
        elif self.target.notations:
            entry |= {AXES_KEY: place.axes}
        words = {self.first + at: each for at, each in place.words.items()}
        return tuple(
            Word(piece.first, words[piece.first], b'"' * self.json)
            if isinstance(piece, Out) and piece.first in words else piece
            for piece in self._member(entry, 0)
        )  # fmt: skip

    def _rotation(self) -> None:
        """Write the rotation where it is, or its members anew."""
        shape, target = self.record.shape, self.target
        first = 0 if target.unit is None else 3 - sum(place < 3 for place in target.absent)
        first = first if target.place is None else target.place.size
        slots = range(shape.position_size, shape.own_size)
        rotation = self.record.rotation
        members = self._members(first)
        if self._same_rotation() and None not in [self.slots[slot] for slot in slots]:
            self._numbers(slots, first)
            members = []
        elif rotation:
            self._replace(self.node.value[rotation], members.pop(0) if members else ())
            self.dropped.update({"angles", *self.record.flat} - {rotation})
        elif members and target.unit is None and (self.record.key or self.record.members):
            rotation = self.record.key or self.record.members[0]  # in the place of the position, which it takes in
            self._replace(self.node.value[rotation], members.pop(0))
            self.dropped.discard(rotation)
        members += self._extras(target.size)
        after = self.node.value[rotation or self.record.key][1] if (rotation or self.record.key) else self._last_value()
        for member in members:
            self._insert_after(after, member)

    def _members(self, first: int) -> list[tuple[Piece, ...]]:
        """Return one member for each key of a notation, and the flag of a lock."""
        notations = self.target.notations
        degrees = any(degrees for notation, degrees in notations if notation.degrees is None)  # what bare angles are
        style = Style("json", tuple(notation for notation, _ in notations), degrees=degrees)
        position = SAMPLE[:3] if self.target.whole else None
        members = []
        for key, value in Result(Pose(position, SAMPLE)).mapping(style).items():
            if key not in ("gimbal_lock", "xyz"):
                members.append(self._member({key: value}, first))
                first += sum(isinstance(piece, Out) for piece in members[-1])
        if any(notation.euler_axes for notation, _ in notations):
            flag = self._member({"gimbal_lock": True}, 0)
            members.append(tuple(IfLocked(piece.text) for piece in flag if isinstance(piece, Const)))
        return members

    def _extras(self, first: int) -> list[tuple[Piece, ...]]:
        if (said := self.request.operation.shown) is not None:
            return [*filter(None, starmap(self._shown, said.members.items()))]
        names = [self.request.prefix + name for name in self.request.extras(self.record.shape)]
        members, last = [], first
        for key, value in with_entries(dict.fromkeys(names, 0.5)).items():
            members.append(self._member({key: value}, last))
            last += len(value) if isinstance(value, list) else 1
        return members

    def _shown(self, name: str, value: str | Word | tuple[int, ...]) -> tuple[Piece, ...]:
        """Return a text, a word or numbers as a member; of one that gives way to it the edit, and nothing to add."""
        key, said = self.request.prefix + name, self.request.operation.shown
        if said and said.replaces and key in self.node.value:
            self._replace(self.node.value[key], self._member_of(key, value))
            return ()
        refuse_member(key, self.node.value)
        return self._member_of(key, value)

    def _member_of(self, key: str, value: str | Word | tuple[int, ...]) -> tuple[Piece, ...]:
        """Return a text, a word, or a list of numbers as a member."""
        if isinstance(value, str):
            return self._member({key: value}, 0)
        begin = self._member({key: 0.5}, 0)[:-1]
        if isinstance(value, Word):
            return (*begin, value._replace(number=self.first + value.number))
        precision = self.request.precision
        fmt, exponent = "" if precision is None else f"z.{precision}f", b"e" if self.json else b".0e"
        marks = [("[" * (not at), "]" if at == len(value) - 1 else ", ") for at in range(len(value))]
        marks = marks if value[1:] else [("", "")]
        items = zip(value, marks, strict=True)
        return (*begin, *(
            Item(self.first + at, (*around, "null" * (at == value[0]), fmt), exponent) for at, around in items
        ))  # fmt: skip

    def _of_other_kind(self) -> list[Edit]:
        """Write what an expression has made of a record in place of all the members that said what it was."""
        members = self._all_members()
        record = self.record
        self.dropped.update({record.key, record.rotation, *record.others, *record.members, *record.flat, *STALE,
                             "inverse", "angles"})  # fmt: skip
        if self.dropped.issuperset(self.node.value):
            between = Const(self._between().encode())
            pieces = [piece for member in members for piece in (between, *member)][1:]
            self.edits = [Edit(self._first_key().start, self._last_value().end, tuple(pieces))]
            return self.edits
        self._leave_out()
        for member in members:
            self._insert_after(self._last_value(), member)
        return self.edits

    def _names(self) -> None:
        """Rename the frames as the operation does."""
        record = self.record
        if record.parent.text and not record.parent.paths and not self._is_local():  # a place, which says its frame
            self._insert_before(self._first_key(), self._member({self._parent_key(): self.entry.parent}, 0))
        if record.placed and record.name.text and not record.name.paths:
            self._insert_before(self._first_key(), self._member({"name": self.entry.name}, 0))
        if "header" in record.placed and record.stamp_ns is not None:
            self._insert_before(self._first_key(), self._member({"stamp_ns": Verbatim(str(record.stamp_ns))}, 0))
        if self.request.rename is None:
            return
        if not self.request.poses and {"name", "parent"} & self.node.value.keys() - {*record.members}:
            return  # in a row that was no pose they say something else
        self._name(record.name, self.entry.name, "name")
        if record.parent.paths or not record.parent.text:
            self._name(record.parent, self.entry.parent, self._parent_key())

    def _parent_key(self) -> str:
        """Return the key that names the frame in which a result is given."""
        return "parent" if self.request.operation.result_kind(self.record.shape.kind) == POSE else "frame"

    def _is_local(self) -> bool:
        """Return True if a result on the Earth says no frame: a point that says its place, or axes of an origin."""
        place = self.target.place
        says = place is not None and place.name not in EARTH_FRAMES and self._parent_key() == "frame"
        return says or (place is not None and place.origin is not None)

    def _name(self, old: Name, new: str | None, key: str) -> None:
        """Write a frame's name where the record says it, or as a member of its own."""
        if new == old.text:
            return
        if not old.paths and self.record.shape.kind not in SIX:  # a bare Twist or Wrench has no field for it
            self._insert_before(self._first_key(), self._member({key: new}, 0))
        for path in old.paths:
            if new is None and path[:-1] == self.record.path and path[-1] != "child_frame_id":
                self.dropped.add(str(path[-1]))
            else:
                node = self.root.at(path)
                text = quoted_name(node, new or "", json=self.json).encode()
                self.edits.append(Edit(node.start, node.end, (Renamed(node.start, text),)))

    def _text(self, value: Any) -> str:
        """Write a value in the record's syntax, each number a mark."""
        if value is True or (type(value) is str and not self.json):
            return "true" if value is True else quoted(value)
        if self.json:
            from frametool.documents.json import dump
        else:
            from frametool.documents.yaml_writer import dump
        return dump(value, lambda _: MARK).rstrip("\n")

    def _member(self, entry: dict[str, Any], first: int) -> tuple[Piece, ...]:
        """Write members in the record's style, each number a piece."""
        if self.json:
            text = ", ".join(f"{self._text(key)}: {self._text(value)}" for key, value in entry.items())
        elif self.node.flow:
            text = ", ".join(f"{self._text(key)}: {_flow(value, self._text)}" for key, value in entry.items())
        else:
            text = self._text(entry).replace("\n", self._between())
        return tuple(_with_numbers(text, self.first + first))

    def _first_key(self) -> Node:
        key, _ = next(iter(self.node.value.values()))
        return key  # type: ignore[no-any-return]

    def _last_value(self) -> Node:
        return list(self.node.value.values())[-1][1]  # type: ignore[no-any-return]

    def _between(self) -> str:
        return ", " if self.json or self.node.flow else "\n" + " " * self._first_key().column

    def _insert_before(self, key: Node, pieces: tuple[Piece, ...]) -> None:
        self.edits.append(Edit(key.start, key.start, (*pieces, Const(self._between().encode()))))

    def _insert_after(self, value: Node, pieces: tuple[Piece, ...]) -> None:
        conditional = any(isinstance(piece, IfLocked) for piece in pieces)
        between: Piece = IfLocked(self._between().encode()) if conditional else Const(self._between().encode())
        self.edits.append(Edit(value.end, value.end, (between, *pieces)))

    def _replace(self, member: tuple[Node, Node], pieces: tuple[Piece, ...]) -> None:
        self.edits.append(Edit(member[0].start, member[1].end, pieces))

    def _rewritten(self) -> list[Edit]:
        """Write a bare list, a matrix or a point, as a mapping."""
        pieces: list[Piece] = []
        for member in self._all_members():
            conditional = any(isinstance(piece, IfLocked) for piece in member)
            pieces += [IfLocked(b", ") if conditional else Const(b", "), *member]
        self.edits.append(Edit(self.node.start, self.node.end, (Const(b"{"), *pieces[1:], Const(b"}"))))
        return self.edits

    def _all_members(self) -> list[tuple[Piece, ...]]:
        """Return the members of a result: position, rotation, extra numbers."""
        kind = self.request.operation.result_kind(self.record.shape.kind)
        position = [self._place("xyz" if kind == POSE else kind)] if self.target.unit is not None else []
        return [*position, *self._members(count_of(self.target.unit)), *self._extras(self.target.size)]

    def _leave_out(self) -> None:
        """Leave members out, with what parts them from their neighbours."""
        members = list(self.node.value.items())
        follows = False  # whether a member that stays comes before
        for index, (key, (key_node, value)) in enumerate(members):
            if key not in self.dropped:
                follows = True
            elif follows:
                self.edits.append(Edit(members[index - 1][1][1].end, value.end, ()))
            else:
                end = members[index + 1][1][0].start if index + 1 < len(members) else value.end
                self.edits.append(Edit(key_node.start, end, ()))


def quoted_name(node: Node, name: str, *, json: bool) -> str:
    """Write a frame's name with the quotes that the one before it had."""
    if node.quote == "'":
        return "'" + name.replace("'", "''") + "'"
    if not json and (node.quote != '"' or not node.value):
        return quoted(name) if name else "''"
    from frametool.documents.json import dump

    return dump(name)


def refuse_member(key: str, members: Any) -> None:
    """Raise ValueInvalid where a key that is added is there already."""
    if type(members) is not dict or key in members:
        raise ValueInvalid(f"key {shown(key)} is there already; name the new ones with --prefix")


def _flow(value: Any, text: Any) -> str:
    """Write a value in brackets."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(each, text)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow(each, text) for each in value) + "]"
    return str(text(value))


def _with_numbers(text: str, first: int) -> Iterator[Piece]:
    """Split a text at the marks of numbers."""
    parts = text.split(MARK)
    for index, part in enumerate(parts):
        if index:
            yield Out(first + index - 1, first + index, b"")
        if part:
            yield Const(part.encode())
