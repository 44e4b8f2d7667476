"""Files that say where joints stand: maps in YAML and JSON, JointState messages, tables, states of other forms.

    {shoulder: 30deg, gripper: 2cm, base: {xyz: [1, 0, 0]}}          with `stamp`, one of many: the joints move
    {name: [shoulder, gripper], position: [0.5, 0.02]}               JointState, of either ROS, one or many
    t,shoulder_deg,gripper                                           a table; without a stamp its last row counts
    robot.srdf:ready                                                 a state that another form has a name for

Each statement keeps its place; what it means is for those who know the joint.
"""

from __future__ import annotations

import os
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.input_file import InputFile
from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid, did_you_mean, listing, shown, warn
from frametool.formats import FORMATS, readers
from frametool.formats.detect import detect
from frametool.formats.joint_columns import find_joint_columns, misspelt, no_joints, stamp_column
from frametool.formats.joints import JointValue
from frametool.frames.stamps import parse_stamp
from frametool.grammar.edges import Tally
from frametool.grammar.readers import Misfit, as_mapping, kind
from frametool.ros import joint_state, messages
from frametool.ros.message_stream import Message, line_texts, read_messages
from frametool.text.csv_line import split_line
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from frametool.formats.joints import Joint
    from frametool.grammar.readers import Path

TIMES = ("stamp", "stamp_ns", "time", "t")
DELIMITERS = {"tsv": "\t", "semicolon": ";"}  # of other tables than CSV


class Setting(NamedTuple):
    """What a file says of one joint: its value as written, and when; `refuse` makes the error for the value's place.

    loose: it is from a state that speaks of more than the robot has: a fixed joint, or a base that floats, is left out
    """

    joint: str
    value: Any
    stamp_ns: int | None
    refuse: Callable[[str, Path], FormatError]
    source: Source
    loose: bool = False


class JointFile:
    """One file of joint values, and the joints of the robot that it may speak of."""

    def __init__(self, path: str, joints: Mapping[str, Joint]) -> None:
        """Open it: a file, or FILE:STATE for a state that it has a name for; raises FileProblem."""
        self.path, self.state = _parted(path)
        self.joints = joints
        self.tally = Tally()
        self.file = InputFile(self.path)

    def settings(self) -> Iterator[Setting]:
        """Yield what it says, in order, and close it.

        Raises FormatError.
        """
        try:
            yield from self._settings()
        finally:
            self.file.close()
        for told in self.tally.told():
            warn(f"{self.file.name}:{told.line}: {told.message}")

    def _settings(self) -> Iterator[Setting]:
        head = self.file.head()
        name = self.file.name
        form = detect(head, "joints", "records", "rows", name=self.path, otherwise="yaml")[0]
        if "joints" in FORMATS[form].reads:
            yield from import_module(FORMATS[form].reader).read_joints(self.file, self.state)
        elif self.state:
            having = " and ".join(readers("joints"))
            raise FormatError(f"has no states with names; {having} files do", source=name)
        elif head.lstrip().startswith(b"<"):
            raise FormatError("this XML has no values of joints; maps, JointState messages, CSV have", source=name)
        elif "rows" in FORMATS[form].reads:
            yield from self._table(form, head.decode("utf-8", "replace"))
        else:
            for message in read_messages(self.file.stream, name, "echo", self.tally):
                yield from self._message(message, self._values)

    def _message(
        self, message: Message | FormatError, read: Callable[[Any, Path, Message], Iterator[Setting]]
    ) -> Iterator[Setting]:
        """Yield what one document or row says."""
        if isinstance(message, FormatError):
            raise message
        try:
            yield from read(message.value, (), message)
        except Misfit as misfit:
            raise message.error(misfit) from None

    def _values(self, value: Any, path: Path, message: Message) -> Iterator[Setting]:
        """Yield the settings of a plain value: a JointState, a map, or a list of either."""
        if type(value) is list:
            for index, each in enumerate(value):
                yield from self._values(each, (*path, index), message)
        elif type(value) is dict and messages.is_envelope(value):
            yield from self._values(value["msg"], (*path, "msg"), message)
        else:
            try:
                mapping = as_mapping(value, "a map of joints, or a JointState")
                read = self._state if joint_state.is_joint_state(mapping) else self._map
                yield from read(mapping, path, message)
            except Misfit as misfit:
                raise misfit.below(*path) from None

    def _state(self, mapping: dict[str, Any], path: Path, message: Message) -> Iterator[Setting]:
        stamp_ns = joint_state.stamp_of_state(mapping)
        for joint, position, place in joint_state.positions(mapping):
            number = _finite(position, place)
            yield Setting(joint, number, stamp_ns, partial(_refused, message, (*path, *place)), message.source)

    def _map(self, mapping: dict[str, Any], path: Path, message: Message) -> Iterator[Setting]:
        """Yield what a map says, or the one map in it, as under `joints:`."""
        times = [key for key in TIMES if key in mapping and key not in self.joints]
        stamp_ns = _time(mapping, times[0]) if times else None
        keys = [key for key in mapping if key not in times]
        if len(keys) == 1 and keys[0] not in self.joints and type(mapping[keys[0]]) is dict:
            path, mapping = (*path, keys[0]), mapping[keys[0]]
            keys = list(mapping)
        for key in keys:
            yield Setting(key, mapping[key], stamp_ns, partial(_refused, message, (*path, key)), message.source)

    def _table(self, form: str, head: str) -> Iterator[Setting]:
        """Yield the settings of a table: a column a joint, or what the echo tools write."""
        first = next((line for line in head.split("\n") if line.strip()), "")
        name = self.file.name
        if first.startswith("%time,"):
            for message in read_messages(self.file.stream, name, "csv1", self.tally):
                yield from self._message(message, self._numbered)
        elif joint_state.looks_like_row(first):
            for line, text in line_texts(self.file.stream, name, self.tally):
                yield from self._message(Message(text, Source(name, text), line, cells=True), self._row)
        else:
            yield from self._columns(form)

    def _numbered(self, value: Any, path: Path, message: Message) -> Iterator[Setting]:
        return self._state(joint_state.of_numbered(value), path, message)

    def _row(self, value: Any, path: Path, message: Message) -> Iterator[Setting]:
        return self._state(joint_state.of_row(joint_state.unquoted(value)), path, message)

    def _cells(self, form: str, line: str) -> list[str]:
        if form == "csv":
            return [cell.text for cell in split_line(line)]
        return [cell.strip().strip('"') for cell in line.split(DELIMITERS.get(form))]

    def _columns(self, form: str) -> Iterator[Setting]:
        """Yield the settings of a table whose header names joints."""
        rows = line_texts(self.file.stream, self.file.name, self.tally)
        number, header = next(rows, (1, ""))
        names = self._cells(form, header.strip("\r\ufeff"))
        try:
            columns = find_joint_columns(names, self.joints)
            if problem := misspelt(names, self.joints) if columns else no_joints(names, self.joints):
                raise ValueInvalid(problem)
        except ValueInvalid as error:
            raise FormatError(str(error), source=self.file.name, line=number) from None
        stamp = stamp_column(names, self.joints)
        used = {column.place for column in columns} | {stamp[0] if stamp else -1}
        if others := [name for place, name in enumerate(names) if place not in used]:
            warn(f"{self.file.name}:{number}: columns that are no joints were left out: {listing(others)}")
        source = Source(self.file.name, "")
        for number, line in rows:
            if line.lstrip().startswith("#"):
                continue
            cells = self._cells(form, line.rstrip("\r"))
            refuse = partial(_refused_row, self.file.name, number)
            if len(cells) != len(names):
                raise refuse(f"expected {len(names)} cells, found {len(cells)}", ())
            at = ""
            try:
                if stamp:
                    at = names[stamp[0]]
                    stamp_ns = parse_stamp(f"{cells[stamp[0]]}ns" if stamp[1] else cells[stamp[0]])
                for place, joint, degrees, per_metre in columns:
                    at = names[place]
                    value = JointValue(parse_number(cells[place]) / per_metre, degrees)
                    yield Setting(joint, value, stamp_ns if stamp else None, refuse, source)
            except ValueInvalid as error:
                raise refuse(f"{at}: {error}", ()) from None


def _parted(path: str) -> tuple[str, str]:
    """Part FILE:STATE, unless there is a file of that name."""
    file, colon, state = path.rpartition(":")
    return (file, state) if colon and file and not os.path.exists(path) and os.path.exists(file) else (path, "")


def _time(mapping: dict[str, Any], key: str) -> int:
    text = mapping[key]
    if type(text) is not str:
        raise Misfit(f"expected a time like 12.5, found {kind(text)}", (key,))
    try:
        return parse_stamp(f"{text}ns" if key.endswith("_ns") else text)
    except ValueInvalid as error:
        raise Misfit(str(error), (key,)) from None


def _finite(value: Any, path: Path) -> JointValue:
    """Read a position in a message: radians or metres, no units."""
    try:
        if type(value) is not str:
            raise ValueInvalid(f"expected a number, found {kind(value)}")
        return JointValue(parse_number(value))
    except ValueInvalid as error:
        raise Misfit(str(error), path, rule=error.rule) from None


def _refused(message: Message, path: Path, problem: str, below: Path) -> FormatError:
    return message.error(Misfit(problem, (*path, *below)))


def _refused_row(name: str, line: int, problem: str, _below: Path) -> FormatError:
    return FormatError(problem, source=name, line=line)


def unknown_joint(joint: str, joints: Mapping[str, Joint], fixed: frozenset[str]) -> str:
    """Say that a robot has no such joint, or that it does not move."""
    if joint in fixed:
        return f"joint {shown(joint)} is fixed and takes no value; joints: {listing(joints)}"
    near = did_you_mean(joint, joints)
    return f"no joint {shown(joint)}{near or ';'} joints: {listing(joints)}"
