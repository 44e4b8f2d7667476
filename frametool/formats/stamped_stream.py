"""Stamped geometry out of a recording, one message after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, ValueInvalid, warn
from frametool.grammar.readers import Misfit, Reading
from frametool.ros.message_stream import read_messages
from frametool.ros.stamped import moveables, spelling

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.recordings import Recording
    from frametool.ros.message_stream import Message
    from frametool.ros.stamped import Stamped


class Batch(NamedTuple):
    """All that can be moved in one message of a recording."""

    message: Message
    stamped: Sequence[Stamped]


def read_stamped_messages(
    recording: Recording, kind: str | None, *, normalize: bool = False
) -> Iterator[Batch | FormatError]:
    """Yield every message of a recording with what can be moved in it, in order, then warn of what was odd.

    Where a message cannot be read the error stands in its place.  kind: what --as says they are.
    Raises FormatError for a recording without messages; ValueInvalid for another kind.
    """
    found = False
    if recording.stream is None:
        raise FormatError("messages are read from text; of a bag only the transforms are", source=recording.name)
    for message in read_messages(recording.stream, recording.name, recording.form, recording.tally):
        found = True
        yield message if isinstance(message, FormatError) else _batch(message, recording, kind, normalize=normalize)
    if not found:
        raise FormatError("no messages in it", source=recording.name)
    for told in recording.tally.told():
        warn(f"{recording.name}:{told.line}: {told.message}")


def _batch(message: Message, recording: Recording, kind: str | None, *, normalize: bool) -> Batch | FormatError:
    """Read what can be moved in a message."""
    reading = Reading(message.source, normalize=normalize)
    try:
        found = list(moveables(message.value, reading))
    except Misfit as misfit:
        return message.error(misfit)
    stamped = [each._replace(form=_form(recording.form, each, message)) for each in found]
    if other := next((each.key for each in stamped if kind not in (None, each.key)), None):
        raise ValueInvalid(f"{recording.name}:{message.line}: a {other} cannot be taken for a {kind}")
    for note in reading.notes:
        recording.tally.note(note, message.line)
    return Batch(message, stamped)


def _form(form: str, stamped: Stamped, message: Message) -> str:
    """Name the form a message was written in; rostopic leaves blanks at the ends of lines, also without a header."""
    if form == "jsonl":
        return "json"
    return "ros1" if form == "csv1" or ": \n" in message.source.text else spelling(stamped.message)
