"""What the options say of a recording that is written: which messages, on which topic, what frames are called."""

from __future__ import annotations

import os

from click import UsageError

from frametool.cli.group import settings
from frametool.errors import shown
from frametool.formats.table import FORMATS, is_folder
from frametool.grammar.result import Recorded


def recorded(form: str, output: str | None) -> Recorded:
    """Return what of results a recording of a form holds, as options say; raises UsageError."""
    chosen = settings()
    if output in (None, "-"):
        raise UsageError(f"{form} is no text; give -o {'FOLDER' if is_folder(form) else 'FILE'}")
    if is_folder(form) and output.endswith(FORMATS[form].suffixes):
        raise UsageError(f"-o {output}: a ROS 2 bag is written as a folder of MCAP; give -f {form} -o FOLDER")
    told = chosen.recorded_frames or next(iter(chosen.named_frames), "")
    frames = tuple(name.strip() for name in told.split(",")) if told else ()
    if frames and (len(frames) != len(("WORLD", "BODY")) or not all(frames)):
        raise UsageError(f"--frames takes WORLD,BODY; found {shown(told)}")
    chosen.inputs = (*chosen.inputs, *[("", ("frames",))] * bool(chosen.named_frames))
    folder = os.path.dirname(os.path.abspath(output))
    return Recorded(tuple(chosen.messages), chosen.topic_out or "", frames, folder if os.path.isdir(folder) else "")
