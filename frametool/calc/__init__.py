"""Expressions over poses, points and numbers, whose frames are checked like units.

The package is callable, because `frametool.calc(..)` and `frametool.calc.evaluate` share a name.
"""

from __future__ import annotations

import sys

from frametool.explain import CallableRoom

sys.modules[__name__].__class__ = CallableRoom
