"""What the two values share: components inside, one item or an array of them, numpy's ways of choosing."""

from __future__ import annotations

from frametool.geometry import dispatch

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any, Self

    from frametool.geometry.types import Components

_new = object.__new__


class Batched:
    """One item, or an array of them of any shape; frozen."""

    __slots__ = ("_components",)
    __array_ufunc__ = None  # an array times a value is refused, not tried element by element
    _components: Components

    @classmethod
    def _of_columns(cls, components: Components) -> Self:
        """Trust components, all floats or all arrays of one shape."""
        made = _new(cls)
        made._components = components  # noqa: SLF001 - its own class
        return made

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the batch; () for one item."""
        return getattr(self._components[-1], "shape", ())

    def __len__(self) -> int:
        """Count along the first axis; one item has no length."""
        if not self.shape:
            raise TypeError(f"one {type(self).__name__.lower()} has no length")
        return self.shape[0]

    def __getitem__(self, index: Any) -> Self:
        """Choose elements as numpy does."""
        if not self.shape:
            raise TypeError(f"one {type(self).__name__.lower()} has no elements")
        return self._of_columns(dispatch.chosen(self._components, index))

    def __iter__(self) -> Iterator[Self]:
        """Go along the first axis."""
        return (self[index] for index in range(len(self)))
