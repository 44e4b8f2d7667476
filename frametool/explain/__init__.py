"""Derivations of results, step by step with the numbers of a run, as text or Markdown.

The package is callable, because it has the name of the function `frametool.explain` of `frametool.sim.followed`.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class CallableRoom(ModuleType):
    """A callable package: a call runs the public function of the same name."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function."""
        import frametool

        function: Any = frametool.__getattr__(self.__name__.rpartition(".")[2])
        return function(*arguments, **options)


sys.modules[__name__].__class__ = CallableRoom
