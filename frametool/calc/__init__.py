"""Expressions over poses, points and numbers, whose frames are checked like units.

The room is a function too, because `frametool.calc(..)` and `frametool.calc.evaluate` share a name.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Room(ModuleType):
    """Calculates when it is called; see `frametool.calc.python_face.calc`."""

    def __call__(self, text: str, /, **options: Any) -> Any:
        """Return the value of an expression."""
        from frametool.calc.python_face import calc

        return calc(text, **options)


sys.modules[__name__].__class__ = _Room
