"""Units in the names of columns and behind numbers: `x_mm`, `yaw [deg]`, `2cm`."""

from __future__ import annotations

import re

LENGTHS = {"": 1.0, "m": 1.0, "cm": 100.0, "mm": 1000.0, "um": 1e6}  # how many make a metre
ANGLES = {"deg": True, "degree": True, "degrees": True, "°": True, "rad": False, "radian": False, "radians": False}
BRACKETS = re.compile(r"\s*[\[(]\s*([^\[\]()]*?)\s*[\])]$")
