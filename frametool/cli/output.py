"""Results: in which form they are written, and where to.

Pictures on their way out: in which form, by the suffix of a file.
"""

from __future__ import annotations

import sys
from importlib import import_module
from itertools import islice
from os.path import splitext
from typing import TYPE_CHECKING, Any

from frametool.cli.options import FULL
from frametool.cli.sink import is_special, writing
from frametool.cli.stderr import say
from frametool.errors import ValueInvalid, listing, printable, shown, warn
from frametool.formats.table import FORMATS, by_name, holds_arrays, is_trajectory, writers
from frametool.geometry.representations import notation
from frametool.grammar.result import Result, Style, is_locked, sample_results

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.lookups import FrameTree
    from frametool.geometry.representations import Notation
    from frametool.grammar.pose import Pose
    from frametool.view.pictures import Picture

BATCH = 256  # poses
BLOCK = 1 << 13  # poses of a trajectory


class Output:
    """Where results go and how they look: what the options of a command say."""

    def __init__(
        self,
        *what: str,
        format_name: str | None = None,
        precision: int | None = None,
        output: str | None = None,
        force: bool = False,
        notations: tuple[Notation, ...] | None = None,
        deg: bool = False,
        keep_sign: bool = False,
        otherwise: str | None = None,
    ) -> None:
        """Choose the form: as told, else by the file's suffix, else text for a terminal and YAML for a pipe.

        otherwise: the form that stands in the place of these two
        """
        self.path = output
        self.force = force
        self.told = format_name or (by_name(output, writers(*what)) if output is not None else None)
        self.notations = notations or ()
        self._form_is_default = not (self.told or otherwise)
        form = self.told or otherwise or ("text" if output is None and sys.stdout.isatty() else "yaml")
        self._holds_arrays = holds_arrays(form)
        self.is_trajectory = is_trajectory(form)  # of the poses of one frame over time
        if self._holds_arrays and output is None and sys.stdout.isatty():
            raise ValueInvalid(f"{form} is no text for a terminal; give -o FILE, or pipe it")
        machine = form not in ("text", "dot", "mermaid")  # a drawing chooses what a person looks for
        chosen = notations or ((notation("quaternion"),) if machine else ())
        full = precision == FULL
        digits = None if full else precision
        self.style = Style(form, chosen, degrees=deg, precision=digits, full=full, keep_sign=keep_sign)

    def poses(self, results: Iterable[Result]) -> None:
        """Write poses."""
        if self._holds_arrays or self.is_trajectory:
            self.pieces(self._blocks(iter(results)))
        else:
            found = list(results)
            self.text(self._module("frametool.view.pose_text").write_poses(found, self.style))
            self._tell_dropped(key for each in found for key in each.extras)

    def _tell_dropped(self, keys: Iterable[str]) -> None:
        """Name what results say besides where the form has no place for it."""
        others = {*keys} - {"stamp_ns", "point", "vector", "frame"}
        if others and self.style.form not in ("text", "yaml", "json", "csv"):
            warn(f"{self.style.form}: {listing(others)} left out")

    def poses_as_they_come(self, results: Iterator[Result]) -> None:
        """Write poses that have the same keys, in batches."""
        self.pieces(self._blocks(results) if self._holds_arrays or self.is_trajectory else self._batches(results))

    def _batches(self, results: Iterator[Result]) -> Iterator[str | bytes]:
        """Yield the text of some results after the other, short batches first.

        In every form the text of several results begins with that of the first: what follows it is the batch's.
        """
        write_poses = self._module("frametool.view.pose_text").write_poses
        size = 2
        begin = list(islice(results, size))
        yield write_poses(begin, self.style)
        known = len(write_poses(begin[:1], self.style))
        while batch := list(islice(results, size)):
            yield write_poses([begin[0], *batch], self.style)[known:]
            size = min(2 * size, BATCH)

    def _blocks(self, results: Iterator[Result]) -> Iterator[bytes]:
        """Yield the poses of a trajectory, or columns of numbers, block after block."""
        from frametool.stream.row_layout import POSE
        from frametool.stream.row_poses import block_of
        from frametool.stream.writers import ArrayWriter, TextWriter

        writer = (ArrayWriter if self._holds_arrays else TextWriter)(self.style, POSE)
        while batch := list(islice(results, BLOCK)):
            yield bytes(writer.of_block(block_of(batch)))
        yield from writer.end()

    def values(self, values: Iterable[Result | dict[str, Any]]) -> None:
        """Write results: poses as poses; points, vectors and messages as the mappings they are."""
        if self.is_trajectory:
            self.poses(map(_as_pose, values))
            return
        found = list(values)
        poses = [each for each in found if isinstance(each, Result)]
        if len(poses) == len(found):
            self.poses(poses)
        else:
            self.points([each.mapping(self.style) if isinstance(each, Result) else each for each in found])

    def tree(self, tree: FrameTree | TransformBuffer, color: str = "auto") -> None:
        """Write a tree; on a terminal in colour, or as `color` says; in a form made of poses with every sample."""
        if self.style.form not in ("yaml", "json") and (
            "trajectory" in self._writes or (tree.moves and "poses" in self._writes)
        ):
            if self.is_trajectory:
                self.style.axes = _axes_of_only_mover(tree, self.style.form)
            self.poses(sample_results(tree))
            return
        if self.style.form != "text":
            if loses := FORMATS[self.style.form].loses:
                say(f"note: {loses}")
            self.text(self._module("").write_tree(tree, self.style))
            return
        from frametool.view.tree_text import print_tree, write_tree

        if self.path is None and (sys.stdout.isatty() or color == "always"):
            print_tree(tree, self.style, color)
        else:
            self.text(write_tree(tree, self.style))

    def tell_of_lock(self, poses: Sequence[Pose]) -> None:
        """Report that the Euler angles of a single result are not unique."""
        if len(poses) == 1 and any(is_locked(poses[0], form) for form in self.style.notations):
            say("note: gimbal lock: the angles are not unique; the third was set to 0")

    def points(self, records: Iterable[dict[str, Any]]) -> None:
        """Write points; for a person one a line, but what has more than three numbers as a mapping."""
        found = list(records)
        if self.style.form in FORMATS and "points" not in self._writes:
            raise ValueInvalid(f"{self.style.form} holds poses; a point has no rotation")
        if self._holds_arrays:
            from frametool.stream.row_poses import block_of_points
            from frametool.stream.writers import ArrayWriter

            writer = ArrayWriter(self.style, next((kind for kind in ("point", "vector") if kind in found[0]), "point"))
            self.pieces([bytes(writer.of_block(block_of_points(found))), *writer.end()])
            return
        placed = [each for each in found if not {"point", "vector"}.isdisjoint(each) and "header" not in each]
        self._tell_dropped(key for each in placed for key in each)
        is_plain = all(any(isinstance(value, list) for value in each.values()) for each in found)
        text_module = "frametool.view.pose_text" if is_plain else FORMATS["yaml"].writer
        self.text(self._module(text_module).write_points(found, self.style))

    def report(self, entries: Sequence[dict[str, Any]]) -> None:
        """Write flat records that are neither poses nor points."""
        if self.style.form != "text":
            self.text(self._module("").write_points(entries, self.style))
            return
        from frametool.view.report_text import write_report

        self.text(write_report(entries, self.style))

    @property
    def _writes(self) -> tuple[str, ...]:
        return FORMATS[self.style.form].writes if self.style.form in FORMATS else ()

    def _module(self, text_module: str) -> Any:
        return import_module(FORMATS[self.style.form].writer if self.style.form in FORMATS else text_module)

    def pieces(self, pieces: Iterable[str | bytes]) -> None:
        """Write text as it comes; into a file, whole or not at all."""
        is_plain = self.style.form == "text"
        with writing(self.path, force=self.force) as write:
            for piece in pieces:
                for_people = is_plain and isinstance(piece, str)
                write("\n".join(map(printable, str(piece).split("\n"))) if for_people else piece)
        self._tell_of_suffix()

    def _tell_of_suffix(self) -> None:
        """Say what a file holds whose suffix stands for no form, where none was told."""
        suffix = splitext(self.path or "")[1]
        if self._form_is_default and self.path and suffix and not is_special(self.path):
            none = f"no form written here has the suffix {shown(suffix)}"
            say(f"note: {self.path}: {none}; it holds {self.style.form}, -f says another")

    def text(self, text: str) -> None:
        """Write text."""
        self.pieces([text])


def _as_pose(value: Result | dict[str, Any]) -> Result:
    """Take a result for a pose; raise ValueInvalid for a point or a message."""
    if not isinstance(value, Result):
        raise ValueInvalid("a trajectory holds poses; a point has no rotation")
    return value


def _axes_of_only_mover(tree: FrameTree | TransformBuffer, form: str) -> str:
    """Return the camera axes of the one frame of a tree, "" if it is no camera; raise ValueInvalid for several."""
    children = [track.child for track in tree.tracks()]
    if len(children) != 1:
        frames = ", ".join(map(shown, children[:8])) or "none"
        instead = f"name two: lookup TREE TARGET SOURCE -f {form}"
        raise ValueInvalid(f"{form} holds one frame, the tree has {frames}; {instead}")
    return tree.camera_axes.get(children[0], "")


PICTURES = (".svg", ".html", ".png")


def drawn(picture: Picture, suffix: str, more: str = "") -> str | bytes:
    """Return a picture in the form of a suffix of PICTURES; `more` stands below it in HTML."""
    if suffix == ".png":
        from frametool.view.pictures import write_png

        return write_png(picture)
    from frametool.view.pictures import write_html, write_svg

    return write_svg(picture) if suffix == ".svg" else write_html(picture, more)
