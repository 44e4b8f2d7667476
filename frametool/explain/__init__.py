"""Derivations of results, step by step with the numbers of a run, as text or Markdown.

The package is callable: `frametool.explain(..)` is that of `frametool.sim.followed`, also where this room was imported.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class CallableRoom(ModuleType):
    """A package that can be called: it runs the public function of its name."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function."""
        import frametool

        function: Any = frametool.__getattr__(self.__name__.rpartition(".")[2])
        return function(*arguments, **options)


sys.modules[__name__].__class__ = CallableRoom
