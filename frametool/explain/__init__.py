"""Derivations of results, step by step with the numbers of a run, as text or Markdown.

The package is callable: `frametool.explain(..)` is that of `frametool.derivation`.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

entry = "frametool.derivation"


class CallableRoom(ModuleType):
    """A package that can be called: it runs the function with its own name in the module `entry`."""

    entry: str

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function."""
        from importlib import import_module

        return getattr(import_module(self.entry), self.__name__.rpartition(".")[2])(*arguments, **options)


sys.modules[__name__].__class__ = CallableRoom
