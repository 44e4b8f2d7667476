"""How formats write poses, one after another: the text around the numbers, and what they cannot store.

`("seconds", b" ", Numbers(7), b"\\n")` is a row of a TUM trajectory, 1305031102.175800000 1.0 2.0 3.0 0.0 0.0 0.0 1.0.
`frametool.stream.writers` fills in the table, for one pose or a million.
"""

from __future__ import annotations

from importlib import import_module
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, ValueInvalid, listing, warn
from frametool.formats.table import FORMATS
from frametool.frames.stamps import format_stamp, parse_stamp, whole_stamp
from frametool.geometry import quaternion, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from frametool.formats.table import Poses
    from frametool.geometry.types import Components
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style


HALF_TURN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # about x: between optical axes and those of OpenGL
LOSABLE = {"frames": "names of frames", "stamps": "stamps"}
MOST_NAMED = 8
IMAGE = "image"  # the extra that names an image
NUMBER = "number"  # the extra with the number of a pose in the same format


class Numbers(NamedTuple):
    """Several numbers of a row, with the same text between them."""

    size: int
    between: bytes = b" "


class RowForm(NamedTuple):
    """The text of one pose.

    row: constant text, `Numbers`, and other fields of a pose: `seconds`, `nanoseconds`, `number` (counted from
        `first`), `image` (the name of its image, else its seconds)
    numbers: from tx, ty, tz, x, y, z, w to the numbers in the order of the file
    head, between, tail: text before the first pose, between two, and after the last
    holds: which of `frames`, `stamps` are written; other columns are not
    constants: what else is written for readers of the format, for a note
    """

    row: tuple[str | bytes | Numbers, ...]
    numbers: Callable[..., Components] = lambda *pose: pose
    head: bytes = b""
    between: bytes = b""
    tail: bytes = b""
    first: int = 0
    holds: tuple[str, ...] = ("stamps",)
    constants: str = ""


class DroppedFields:
    """What a format cannot store of the poses that are written: collected, and reported at the end."""

    def __init__(self, spec: RowForm, style: Style) -> None:
        """Start empty; raises ValueInvalid for notations that the format does not have."""
        self.format, self.style = spec, style
        self.found: dict[str, None] = {}
        self.counted = False
        self.by_stamp = False
        self.turned = False
        if any(each.spec != "quaternion" for each in style.notations):
            raise ValueInvalid(f"{style.format} writes rotations in its own way; leave --to out")

    def record(self, *, frames: bool, stamps: bool, extras: Iterable[str]) -> None:
        """Record fields of poses that the format cannot store."""
        said = {"frames": frames, "stamps": stamps}
        self.found |= {LOSABLE[what]: None for what, there in said.items() if there and what not in self.format.holds}
        self.found |= dict.fromkeys(extras)  # by name

    def tell(self) -> None:
        """Warn about everything that was omitted or made up, in one line."""
        left = [words for words in LOSABLE.values() if words in self.found]
        if others := self.found.keys() - {*LOSABLE.values()}:
            left.append(listing(others, MOST_NAMED))
        said = [f"{', '.join(left)} left out"] if left else []
        said += [self.format.constants] * bool(self.format.constants)
        said += ["without stamps, poses are numbered in seconds: 0, 1, 2 .."] * self.counted
        said += ["pictures are named by their stamps"] * self.by_stamp
        axes = FORMATS[self.style.format].poses.axes
        if self.turned:
            said.append(f"camera axes turned from {self.style.axes} to {axes}, half a turn about x")
        elif axes and not self.style.axes:
            said.append(f"the axes of the poses are taken for {axes}, as {self.style.format} has them")
        if said:
            warn(f"{self.style.format}: {'; '.join(said)}")


def turned(style: Style, pose: Components) -> Components:
    """Convert a camera's axes to those of a format if both are known, and those of a camera as reference frame."""
    if not is_turned(style):
        return pose
    tx, ty, tz, x, y, z, w = pose
    found = rigid.compose(tx, ty, tz, x, y, z, w, *HALF_TURN)
    return rigid.compose(*HALF_TURN, *found) if style.in_camera else found


def is_turned(style: Style) -> bool:
    """Return True if the axes of a camera differ from those of the format it is written in."""
    axes = FORMATS[style.format].poses.axes if style.format in FORMATS else ""
    return bool(axes and style.axes and axes != style.axes)


def field(name: str, stamp_ns: int, number: int) -> str:
    """Return the text of a field of a row."""
    if name == "seconds":
        return format_stamp(stamp_ns)
    if name == "nanoseconds":
        return str(stamp_ns)
    return str(number)


def image_name(image: str | None, stamp_ns: int) -> str:
    """Return the name of an image, without characters that JSON and rows cannot hold; else its stamp."""
    if image is None:
        return format_stamp(stamp_ns)
    return "".join(letter for letter in image if letter.isprintable() and letter not in '"\\')


def rows_of_matrix(*pose: float) -> Components:
    """Return the first three rows of the 4x4 of a pose, twelve numbers."""
    tx, ty, tz, *turn = pose
    r = quaternion.to_matrix(*turn)
    return tuple(chain(r[0:3], [tx], r[3:6], [ty], r[6:9], [tz]))


_ROW = b"], [", Numbers(4, b", ")
ROWS = {
    "tum": RowForm(("seconds", b" ", Numbers(7), b"\n")),
    "euroc": RowForm(
        ("nanoseconds", b",", Numbers(7, b","), b"\n"), lambda tx, ty, tz, x, y, z, w: (tx, ty, tz, w, x, y, z),
        head=",".join(FORMATS["euroc"].columns[:8]).encode() + b"\n",
    ),
    "kitti": RowForm((Numbers(12), b"\n"), rows_of_matrix, holds=()),
    "colmap": RowForm(
        ("number", b" ", Numbers(7), b" 1 ", IMAGE, b"\n\n"), lambda tx, ty, tz, x, y, z, w: (w, x, y, z, tx, ty, tz),
        head=b"# Image list with two lines of data per image:\n"
        b"#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n",
        first=1, holds=(), constants="every camera is number 1, without points",
    ),
    "nerf": RowForm(
        (b'    {"file_path": "', IMAGE, b'", "transform_matrix": [[', Numbers(4, b", "), *_ROW, *_ROW,
         b"], [0.0, 0.0, 0.0, 1.0]]}"),
        rows_of_matrix, head=b'{\n  "frames": [\n', between=b",\n", tail=b"\n  ]\n}\n", holds=(),
    ),
    "g2o": RowForm((b"VERTEX_SE3:QUAT ", "number", b" ", Numbers(7), b"\n"), holds=()),
}  # fmt: skip


def rows_of(spec: str) -> RowForm | None:
    """Return how all poses are written in a format; None if each result has a text of its own."""
    found = getattr(import_module(FORMATS[spec].writer), "ROWS", None)
    return found[spec] if isinstance(found, dict) else found


# --- what is common to files of poses of one body ---


def describe(options: Options, spec: Poses, count: int, *, named: bool = True) -> None:
    """Record the assumptions about a trajectory, to be reported with the name of its file."""
    parent, child = options.answers.names(*spec.frames)
    said = []
    if named and not options.answers.frames:
        said.append(f"{count} {'pose' if count == 1 else 'poses'} of {child} in {parent} (--frames)")
    if spec.counted and not options.answers.stamps:
        said.append(f"seconds are {spec.counted} (--stamps)")
    options.tally.assumed = ", ".join(said)


class StampFile:
    """Timestamps of poses, one per line: decimal seconds, or nanoseconds with `ns`, to the nanosecond."""

    def __init__(self, path: str) -> None:
        """Read the file; raises FileProblem, FormatError."""
        from frametool.documents.source import read_text

        self.path = path
        self.stamps: list[int] = []
        for number, line in enumerate(read_text(path).splitlines(), 1):
            bare = line.strip()
            if bare and not bare.startswith("#"):
                try:
                    self.stamps.append(whole_stamp(parse_stamp(bare)))
                except ValueInvalid as error:
                    raise FormatError(str(error), source=path, line=number) from None

    def at(self, index: int) -> int:
        """Return the time of a pose, counted from 0."""
        if index >= len(self.stamps):
            message = f"{len(self.stamps)} times are too few for the poses; one a line is wanted"
            raise FormatError(message, source=self.path)
        return self.stamps[index]

    def finish(self, count: int, name: str) -> None:
        """Check that there was one time per pose."""
        if count != len(self.stamps):
            raise FormatError(f"{len(self.stamps)} times for the {count} poses of {name}", source=self.path)
