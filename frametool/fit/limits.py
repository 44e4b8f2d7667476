"""Limits on the numbers of a comparison, for continuous integration: `ate>5cm,rpe:10m>1%,paired<90%`."""

from __future__ import annotations

import operator
import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import ValueInvalid, alternatives, shown

if TYPE_CHECKING:
    from collections.abc import Callable

SHORT = {
    "ate": "ate.m.rmse", "max": "ate.m.max", "deg": "ate.deg.rmse", "along": "ate.along_m.rmse",
    "across": "ate.across_m.rmse", "up": "ate.up_m.rmse", "kitti": "kitti.percent", "scale": "transform.scale",
    "paired": "poses.paired", "offset": "offset_s",
}  # fmt: skip
UNITS = {"": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "deg": 1.0, "rad": 57.29577951308232, "s": 1.0,
         "ms": 0.001, "%": 1.0}  # fmt: skip
SIGNS: dict[str, Callable[..., bool]] = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
_LIMIT = r"([\w:.]+?)\s*(>=|<=|>|<)\s*([-+]?(?:\d++\.?\d*+|\.\d++)(?:e[-+]?\d+)?)\s*([a-z]*|%)"


class Limit(NamedTuple):
    """A limit on a number of a comparison.

    text: as written; name: one of SHORT, `rpe:DELTA`, or the path in the JSON
    bound: in metres, degrees, seconds or percent
    """

    text: str
    name: str
    sign: str
    bound: float
    unit: str

    def passed(self, found: dict[str, Any]) -> float | None:
        """Return the number of a comparison (its `as_dict()`) if it exceeds the limit, else None.

        Raises ValueInvalid if there is no such number.
        """
        kind, _, delta = self.name.partition(":")
        if kind == "rpe" and delta:
            row = next((row for row in found["rpe"] if row["delta"] == delta), None)
            value = number_at(row, {"%": "percent", "deg": "deg.rmse", "rad": "deg.rmse"}.get(self.unit, "m.rmse"))
        else:
            value = number_at(found, SHORT.get(self.name, self.name))
            if self.name == "paired" and self.unit == "%" and value is not None:
                value = 100.0 * value / max(found["poses"]["possible"], 1)
        if not isinstance(value, int | float):
            raise ValueInvalid(f"{self.text}: {found['est']} has no such number; -f json shows those there are")
        return float(value) if SIGNS[self.sign](value, self.bound) else None


def parse_limits(text: str) -> list[Limit]:
    """Parse limits separated by commas: a name or path, one of > >= < <=, and a number with its unit.

    Without a unit numbers are metres, degrees, poses, or percent of KITTI.  Raises ValueInvalid.
    """
    found = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = re.fullmatch(_LIMIT, part)
        if match is None or match[4] not in UNITS:
            raise ValueInvalid(f"{shown(part)} is not a limit; write a name, > or <, and a bound: ate>5cm, paired<90%")
        name = match[1]
        if "." not in name and not name.startswith("rpe:") and name not in SHORT:
            raise ValueInvalid(f"no number is called {shown(name)}{alternatives(name, [*SHORT, 'rpe:10m'], 'numbers')}")
        found.append(Limit(part, name, match[2], float(match[3]) * UNITS[match[4]], match[4]))
    if not found:
        raise ValueInvalid("no limit; write one as ate>5cm")
    return found


def number_at(value: Any, path: str) -> Any:
    """Return the value at a path of keys and indices, `ate.m.rmse`, in a mapping; None if the path does not exist."""
    for step in path.split("."):
        try:
            value = value[int(step) if isinstance(value, list) else step]
        except (KeyError, IndexError, TypeError, ValueError):
            return None
    return value
