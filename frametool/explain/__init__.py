"""How a result came about: the derivation step by step with the numbers of this run, as text or Markdown.

The room is a function too, because `frametool.explain(..)` and `frametool.explain.api` share a name.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class CallableRoom(ModuleType):
    """A package that can be called: it runs the function of its own name, which stands in its module `api`."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function."""
        from importlib import import_module

        return getattr(import_module(f"{self.__name__}.api"), self.__name__.rpartition(".")[2])(*arguments, **options)


sys.modules[__name__].__class__ = CallableRoom
