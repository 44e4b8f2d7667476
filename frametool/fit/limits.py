"""Limits on the numbers of a comparison, for machines that watch over them: `ate>5cm,rpe:10m>1%,paired<90%`."""

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
SIGNS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt,
}  # fmt: skip
_LIMIT = r"([\w:.]+?)\s*(>=|<=|>|<)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*([a-z]*|%)"


class Limit(NamedTuple):
    """A number by its name or its path in the JSON, and what it may not be."""

    text: str
    name: str
    sign: str
    bound: float
    unit: str

    def passed(self, found: dict[str, Any]) -> float | None:
        """Return the number of a comparison that passes the limit, None where it holds.

        Raises ValueInvalid where there is no such number.
        """
        value = self._value(found)
        return value if SIGNS[self.sign](value, self.bound) else None

    def _value(self, found: dict[str, Any]) -> float:
        kind, _, delta = self.name.partition(":")
        if kind == "rpe" and delta:
            row = next((row for row in found["rpe"] if row["delta"] == delta), None)
            path = "percent" if self.unit == "%" else "deg.rmse" if self.unit in ("deg", "rad") else "m.rmse"
            value = None if row is None else _at(row, path)
        else:
            value = _at(found, SHORT.get(self.name, self.name))
            if self.name == "paired" and self.unit == "%" and value is not None:
                value = 100.0 * value / max(found["poses"]["possible"], 1)
        if not isinstance(value, int | float):
            raise ValueInvalid(f"{self.text}: {found['est']} has no such number; -f json shows those there are")
        return float(value)


def parse_limits(text: str) -> list[Limit]:
    """Read limits with commas between them: a name or path, > >= < or <=, a number with its unit.

    Bare numbers are metres, degrees, poses, and percent of KITTI.  Raises ValueInvalid.
    """
    found = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = re.fullmatch(_LIMIT, part)
        if match is None or match[4] not in UNITS:
            raise ValueInvalid(f"{shown(part)} is no limit; write a name, > or <, and a bound: ate>5cm, paired<90%")
        name = match[1]
        if ":" in name and not name.startswith("rpe:"):
            raise ValueInvalid(f"{shown(name)} is no number of a comparison; rpe has a delta behind a colon: rpe:10m")
        if "." not in name and ":" not in name and name not in SHORT:
            raise ValueInvalid(f"no number is called {shown(name)}{alternatives(name, [*SHORT, 'rpe:10m'], 'numbers')}")
        found.append(Limit(part, name, match[2], float(match[3]) * UNITS[match[4]], match[4]))
    if not found:
        raise ValueInvalid("no limit; write one as ate>5cm")
    return found


def _at(value: Any, path: str) -> Any:
    """Follow a path of keys and indices into a mapping; None where it ends."""
    for step in path.split("."):
        if isinstance(value, dict):
            value = value.get(step)
        elif isinstance(value, list) and step.isdigit() and int(step) < len(value):
            value = value[int(step)]
        else:
            return None
    return value
