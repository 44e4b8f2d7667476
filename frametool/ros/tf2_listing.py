"""tf2's `all_frames_as_yaml`: for each frame its parent, publisher, rate, and time span.

    laser:
      parent: 'base_link'
      broadcaster: 'default_authority'
      rate: 10000.000

Names are not quoted, a blank follows each, stamps have three decimals (six under `--tf2 ros2`).  There are no poses.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.frames.edge_log import cache_entries, listed_motion
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Edge

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.edge_log import CacheEntry
    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style


_FACTS = ("rate", "buffer_length", "most_recent_transform")


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a listing; their rates are recorded in the tally, there are no poses."""
    for entry in re.finditer(r"(?m)^(\S.*?):[ \t]*\r?\n((?:[ \t]+\S.*(?:\n|\Z))+)", file.text):
        facts = dict(re.findall(r"(?m)^\s*(\w+):[ \t]*(.*?)\s*$", entry[2]))
        child, parent = (options.tally.names.bare(each.strip("'\"")) for each in (entry[1], facts.get("parent", "")))
        if parent:
            numbers = (facts.get(name, "") for name in _FACTS)
            numbers = (float(each) if re.fullmatch(r"\d+(?:\.\d*)?", each) else 0.0 for each in numbers)
            options.tally.drawn[child] = listed_motion(*numbers)
            yield Edge(parent, child, IDENTITY, line=1 + file.text.count("\n", 0, entry.start()))


def write_tree(tree: Frames, style: Style) -> str:  # noqa: ARG001 - tf2 has no say in it
    """Return the listing; `{}` for no frames."""
    return "".join(map(_entry, cache_entries(tree))) or "{}\n"


def _entry(each: CacheEntry) -> str:
    return (
        f"{each.child}: \n"
        f"  parent: '{each.parent}'\n"
        "  broadcaster: 'default_authority'\n"
        f"  rate: {each.rate:.3f}\n"
        f"  most_recent_transform: {each.newest:.3f}\n"
        f"  oldest_transform: {each.oldest:.3f}\n"
        f"  buffer_length: {each.length:.3f}\n"
    )
