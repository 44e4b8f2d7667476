"""How a form writes poses, one after the other: the text around the numbers of each, and what it cannot hold.

    RowForm(("seconds", b" ", Numbers(7, b" "), b"\\n"))                         a row of a TUM trajectory
    1305031102.175800000 1.0 2.0 3.0 0.0 0.0 0.0 1.0

The table is filled in by `frametool.stream.writers`, for one pose and for a million.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, listing, warn
from frametool.formats.table import FORMATS
from frametool.frames.stamps import format_stamp
from frametool.geometry import quaternion, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from frametool.geometry.types import Components
    from frametool.grammar.result import Style

HALF_TURN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # about x: between optical axes and those of OpenGL
LOSABLE = {"frames": "names of frames", "stamps": "stamps"}
MOST_NAMED = 8
IMAGE = "image"  # the extra that names a picture
NUMBER = "number"  # the extra that says what a pose was counted as in the same form


class Numbers(NamedTuple):
    """So many numbers of a row, with the same text between them."""

    size: int
    between: bytes = b" "


class RowForm(NamedTuple):
    """The text of one pose.

    row: constant text, `Numbers`, and what else is known of a pose: `seconds`, `nanoseconds`, `number` (counted from
        `first`), `image` (the name of its picture, else its seconds)
    numbers: from tx, ty, tz, x, y, z, w to the numbers in the order they are written
    head, between, tail: text before the first pose, between two, and behind the last
    holds: which of `frames`, `stamps` are written; other columns are not
    beside: what else a reader of the form finds in it, told whenever it is written
    """

    row: tuple[str | bytes | Numbers, ...]
    numbers: Callable[..., Components] = lambda *pose: pose
    head: bytes = b""
    between: bytes = b""
    tail: bytes = b""
    first: int = 0
    holds: tuple[str, ...] = ("stamps",)
    beside: str = ""


class DroppedFields:
    """What a form cannot hold of the poses that are written: collected, and told at the end."""

    def __init__(self, form: RowForm, style: Style) -> None:
        """Collect nothing yet; raises ValueInvalid for notations that the form does not have."""
        self.form = form
        self.style = style
        self.found: dict[str, None] = {}
        self.counted = False
        self.by_stamp = False
        self.turned = False
        if any(each.spec != "quaternion" for each in style.notations):
            raise ValueInvalid(f"{style.form} writes rotations in its own way; leave --to out")

    def record(self, *, frames: bool, stamps: bool, extras: Iterable[str]) -> None:
        """Note fields of poses that the format cannot store."""
        said = {"frames": frames, "stamps": stamps}
        self.found |= {LOSABLE[what]: None for what, there in said.items() if there and what not in self.form.holds}
        self.found |= dict.fromkeys(extras)  # by name

    def tell(self) -> None:
        """Warn of all that was left out or made up, in one line."""
        left = [words for words in LOSABLE.values() if words in self.found]
        if others := self.found.keys() - {*LOSABLE.values()}:
            left.append(listing(others, MOST_NAMED))
        said = [f"{', '.join(left)} left out"] if left else []
        said += [self.form.beside] * bool(self.form.beside)
        said += ["without stamps, poses are numbered in seconds: 0, 1, 2 .."] * self.counted
        said += ["pictures are named by their stamps"] * self.by_stamp
        axes = FORMATS[self.style.form].poses.axes
        if self.turned:
            said.append(f"camera axes turned from {self.style.axes} to {axes}, half a turn about x")
        elif axes and not self.style.axes:
            said.append(f"the axes of the poses are taken for {axes}, as {self.style.form} has them")
        if said:
            warn(f"{self.style.form}: {'; '.join(said)}")


def turned(style: Style, pose: Components) -> Components:
    """Turn a camera's axes to those of a form where both are known, and those of a camera that it is seen from."""
    if not is_turned(style):
        return pose
    tx, ty, tz, x, y, z, w = pose
    found = rigid.compose(tx, ty, tz, x, y, z, w, *HALF_TURN)
    return rigid.compose(*HALF_TURN, *found) if style.in_camera else found


def is_turned(style: Style) -> bool:
    """Tell whether the axes of a camera are not those of the form it is written in."""
    axes = FORMATS[style.form].poses.axes if style.form in FORMATS else ""
    return bool(axes and style.axes and axes != style.axes)


def field(name: str, stamp_ns: int, number: int) -> str:
    """Return what is written for a field of a row."""
    if name == "seconds":
        return format_stamp(stamp_ns)
    if name == "nanoseconds":
        return str(stamp_ns)
    return str(number)


def image_name(image: str | None, stamp_ns: int) -> str:
    """Return the name of a picture, with what JSON and rows cannot hold left out; else its stamp."""
    if image is None:
        return format_stamp(stamp_ns)
    return "".join(letter for letter in image if letter.isprintable() and letter not in '"\\')


def rows_of_matrix(*pose: float) -> Components:
    """Return the first three rows of the 4x4 of a pose, twelve numbers."""
    tx, ty, tz, *turn = pose
    r = quaternion.to_matrix(*turn)
    return tuple(chain(r[0:3], [tx], r[3:6], [ty], r[6:9], [tz]))
