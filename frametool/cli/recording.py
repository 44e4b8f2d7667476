"""What options say of a recording that is written: which messages, on which topic, names of frames, and where."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from click import UsageError

from frametool.cli.command import refuse
from frametool.errors import FileProblem, printable, shown
from frametool.formats.table import FORMATS, by_name, is_folder, writers
from frametool.grammar.result import RecordingStyle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.cli.command import Inputs


def recorded(chosen: Inputs, fmt: str, output: str | None) -> RecordingStyle:
    """Return what of results a recording of a format holds, as options say; raises UsageError."""
    place = _place(fmt, output)
    names = chosen.recorded_frames or next(iter(chosen.named_frames), "")
    frames = tuple(name.strip() for name in names.split(",")) if names else ()
    if frames and (len(frames) != len(("WORLD", "BODY")) or not all(frames)):
        raise UsageError(f"--frames takes WORLD,BODY; found {shown(names)}")
    refuse(len({*frames}) < len(frames), f"--frames {names}: no frame is its own parent; give two names")
    return RecordingStyle(tuple(chosen.messages), chosen.topic_out or "", frames, folder_of(place))


def _place(fmt: str, output: str | None) -> str:
    """Return where a recording is written; raises UsageError where it cannot be."""
    if output is None or output == "-":
        raise UsageError(f"{fmt} is no text; give -o {'FOLDER' if is_folder(fmt) else 'FILE'}")
    if is_folder(fmt) and output.endswith(FORMATS[fmt].suffixes):
        raise UsageError(f"-o {output}: a ROS 2 bag is written as a folder of MCAP; give -f {fmt} -o FOLDER")
    named = None if is_folder(fmt) else by_name(output, writers("recording"))
    if named not in (None, fmt):
        raise UsageError(f"-o {output} is the name of {named}, -f says {fmt}; give -o NEW{FORMATS[fmt].suffixes[0]}")
    return output


def folder_of(place: str) -> str:
    """Return the folder in which there is room for what is written to a place; "" where that does not exist."""
    folder = os.path.dirname(os.path.abspath(place))
    return folder if os.path.isdir(folder) else ""


def copied_as(fmt: str, path: str, output: str | None, named: str | None) -> tuple[str, str]:
    """Return the format in which a recording is copied, and its place; raise UsageError where none can be.

    named: the format, where the name of the output does not say it
    """
    folder = "bag2" if os.path.isdir(path) and output and not os.path.splitext(output)[1] else None
    copy = named or by_name(output, writers("recording")) or folder
    if copy is None:
        unknown = f"-o {output} names no format; " if output else ""
        raise UsageError(f"{unknown}give {'-o NEW.bag' if fmt == 'bag1' else '-o NEW.mcap or -f bag2 -o FOLDER'}")
    place = _place(copy, output)
    if "bag1" in (fmt, copy) and fmt != copy:
        what = f"{path} is copied as {'a ROS 1 bag' if fmt == 'bag1' else 'mcap or bag2'}, not as {copy}"
        raise UsageError(f"{what}; rosbags-convert --src {path} --dst {output} makes that of it")
    return copy, place


def refuse_input(output: str, inputs: Iterable[str]) -> None:
    """Raise FileProblem where a result would be written over what it is made of, or over a folder that this is in."""
    place = os.path.realpath(output)
    for path in filter(os.path.exists, inputs):
        files = [path, *(os.path.join(path, name) for name in os.listdir(path))] if os.path.isdir(path) else [path]
        if os.path.exists(place) and any(os.path.samefile(each, place) for each in files):
            raise FileProblem(f"{printable(output)}: is {printable(path)}, which is read; give another name")
        read = os.path.realpath(path)
        for inner, outer in ((read, place), (place, read)):
            if os.path.isdir(outer) and inner.startswith(f"{outer}{os.sep}"):
                inside = f"{printable(inner)} lies in {printable(outer)}"
                raise FileProblem(f"{printable(output)}: {inside}; give another name")
