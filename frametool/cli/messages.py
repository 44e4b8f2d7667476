"""Stamped ROS messages moved one after the other; what bad ones do, the policy says."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import FormatError, FrametoolError
from frametool.formats.stamped_stream import read_stamped_messages
from frametool.stream.faults import NULL, STOP, Fault

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.cli.commands.apply import Way
    from frametool.cli.output import Output
    from frametool.formats.recordings import Recording
    from frametool.formats.stamped_stream import Batch
    from frametool.stream.faults import BadRows


def move_messages(
    recording: Recording, kind: str | None, way: Way, output: Output, policy: BadRows, *, normalize: bool
) -> int:
    """Move messages, each from its own frame and at its own time; gives the exit status."""
    rows = 0
    null = "null\n" if recording.form == "jsonl" else "null\n---\n"

    def texts() -> Iterator[str]:
        nonlocal rows
        for batch in read_stamped_messages(recording, kind, normalize=normalize):
            rows += 1
            found = batch if isinstance(batch, FormatError) else _moved(batch, way, output)
            if isinstance(found, str):
                yield found
                continue
            if policy.on_error == STOP and isinstance(found, FormatError):
                raise found
            policy.take([_fault(found)])
            if policy.on_error == NULL:
                yield null

    output.pieces(texts())
    return policy.finish(rows)


def _moved(batch: Batch, way: Way, output: Output) -> str | Fault:
    """Return the text of a message that moved, or why there is none."""
    message, moved = batch.message, []
    for each in batch.stamped:
        try:
            moved.append(each.moved(way.from_frame(each.frame, each.stamp_ns), way.target))
        except FrametoolError as error:
            key = ".".join(map(str, (*each.path, "header" if "header" in each.message else each.key)))
            return Fault.of(message.line, key, error)
    try:
        return output.message(message, moved)
    except FrametoolError as error:
        return Fault.of(message.line, "", error)


def _fault(error: Fault | FormatError) -> Fault:
    if isinstance(error, Fault):
        return error
    return Fault(error.line, str(error.column or ""), error.message, kind=error.kind)
