"""Stamped geometry out of a recording, one message after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import FormatError, ValueInvalid, warn
from frametool.formats.ros_stream import read_messages
from frametool.formats.stamped import moveables, spelling
from frametool.formats.values import Misfit, Reading

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.formats.recordings import Recording
    from frametool.formats.ros_stream import Message
    from frametool.formats.stamped import Stamped


def read_stamped_messages(recording: Recording, kind: str | None, *, normalize: bool = False) -> Iterator[Stamped]:
    """Give every message of a recording that can be moved, in order, then warn of what was odd.

    kind: what --as says they are.
    Raises FormatError with the place, also for a recording without messages; ValueInvalid for another kind.
    """
    found = False
    if recording.stream is None:
        raise FormatError("messages are read from text; of a bag only the transforms are", source=recording.name)
    for message in read_messages(recording.stream, recording.name, recording.form, recording.tally):
        if isinstance(message, FormatError):
            raise message
        reading = Reading(message.source, normalize=normalize)
        try:
            for stamped in moveables(message.value, reading):
                if kind not in (None, stamped.key):
                    raise ValueInvalid(f"{recording.name}:{message.line}: a {stamped.key} cannot be taken for a {kind}")
                found = True
                yield stamped._replace(form=_form(recording.form, stamped, message))
        except Misfit as misfit:
            raise message.error(misfit) from None
        for _, note in reading.notes:
            recording.tally.notes.setdefault(note, message.line)
    if not found:
        raise FormatError("no messages in it", source=recording.name)
    for line, sentence in recording.tally.told():
        warn(f"{recording.name}:{line}: {sentence}")


def _form(form: str, stamped: Stamped, message: Message) -> str:
    """Name the form a message was written in; rostopic leaves blanks at the ends of lines, also without a header."""
    if form == "jsonl":
        return "json"
    return "ros1" if form == "csv1" or ": \n" in message.source.text else spelling(stamped.message)
