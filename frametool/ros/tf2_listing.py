"""tf2's `all_frames_as_yaml`: for each frame its parent, who sent it, how often, and over which time.

    laser:
      parent: 'base_link'
      broadcaster: 'default_authority'
      rate: 10000.000

Names are not quoted, a blank follows each, stamps have three decimals (six under `--tf2 ros2`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.frames.edge_log import cache_entries

if TYPE_CHECKING:
    from frametool.frames.edge_log import CacheEntry
    from frametool.frames.lookups import Frames
    from frametool.grammar.result import Style


def write_tree(tree: Frames, style: Style) -> str:  # noqa: ARG001 - tf2 has no say in it
    """Return the listing; `{}`, or `[]` under ROS 2's rules, for no frames."""
    decimals = tree.policy.listing_decimals
    return "".join(_entry(each, decimals) for each in cache_entries(tree)) or ("{}\n" if decimals == 3 else "[]\n")


def _entry(each: CacheEntry, decimals: int) -> str:
    return (
        f"{each.child}: \n"
        f"  parent: '{each.parent}'\n"
        f"  broadcaster: '{each.authority}'\n"
        f"  rate: {each.rate:.3f}\n"
        f"  most_recent_transform: {each.newest:.{decimals}f}\n"
        f"  oldest_transform: {each.oldest:.{decimals}f}\n"
        f"  buffer_length: {each.length:.3f}\n"
    )
