"""Results on their way out: which form, and to where."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from frametool.cli.sink import writing
from frametool.cli.stderr import say
from frametool.errors import ValueInvalid
from frametool.formats import FORMATS, by_suffix, writers
from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style, is_locked, sample_results

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from frametool.formats.points import Point
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.tree import FrameTree
    from frametool.geometry.representations import Notation
    from frametool.ros.message_stream import Message
    from frametool.ros.stamped import Stamped


class Output:
    """Where results go and how they look: what the options of a command say."""

    def __init__(
        self,
        what: str,
        *,
        format_name: str | None = None,
        precision: int | None = None,
        output: str | None = None,
        force: bool = False,
        notations: tuple[Notation, ...] | None = None,
        deg: bool = False,
        keep_sign: bool = False,
    ) -> None:
        """Settle the form: as told, else by the file's suffix, else text for a terminal and YAML for a pipe."""
        self.path = output
        self.force = force
        self.told = format_name or by_suffix(output, writers(what))
        self.notations = notations or ()
        form = self.told or ("text" if output is None and sys.stdout.isatty() else "yaml")
        machine = form not in ("text", "dot", "mermaid")  # a drawing chooses what a person looks for
        chosen = notations or ((notation("quaternion"),) if machine else ())
        self.style = Style(form, chosen, degrees=deg, precision=precision, keep_sign=keep_sign)

    def poses(self, results: Iterable[Result]) -> None:
        """Write poses."""
        self.text(self._module("frametool.view.pose_text").write_poses(results, self.style))

    def moved(self, records: Sequence[Pose | Point]) -> None:
        """Write moved records: poses as poses, whatever else there is as it was spelled."""
        if all(isinstance(each, Pose) for each in records):
            self.poses([Result(each) for each in records if isinstance(each, Pose)])
        else:
            self.points(
                [Result(each).mapping(self.style) if isinstance(each, Pose) else each.mapping() for each in records]
            )

    def tree(self, tree: FrameTree | TransformBuffer, color: str = "auto") -> None:
        """Write a tree; on a terminal in colour, or as `color` says; in a form made of poses with every sample."""
        if tree.moves and "poses" in self._writes and self.style.form not in ("yaml", "json"):
            self.poses(sample_results(tree))
            return
        if self.style.form != "text":
            self.text(self._module("").write_tree(tree, self.style))
            return
        from frametool.view.tree_text import print_tree, write_tree

        if self.path is None and (sys.stdout.isatty() or color == "always"):
            print_tree(tree, self.style, color)
        else:
            self.text(write_tree(tree, self.style))

    def tell_of_lock(self, poses: Sequence[Pose]) -> None:
        """Say of a single result that its Euler angles are not unique."""
        if len(poses) == 1 and any(is_locked(poses[0], form) for form in self.style.notations):
            say("note: gimbal lock: the angles are not unique; the third was set to 0")

    def points(self, records: Iterable[dict[str, Any]]) -> None:
        """Write points."""
        self.text(self._module("frametool.view.pose_text").write_points(records, self.style))

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

    def message(self, message: Message, moved: Sequence[Stamped]) -> str:
        """Return the text of a message in which some moved: as it was spelled unless the command was told otherwise."""
        from frametool.ros.stamped_splice import respelled

        if moved and self.told in (None, moved[0].form):
            style = self.style.in_form(moved[0].form)
            text = respelled(message.source.text, message.document, moved, style)
            if text is not None:
                return text if text.endswith("\n") else f"{text}\n"
        return "".join(map(self._message, moved))

    def _message(self, message: Stamped) -> str:
        from frametool.ros.stamped import spelling

        form = self.style.form if self.told or not message.form else message.form
        if form == "text":
            form = spelling(message.message)
        if form == "csv":
            raise ValueInvalid("a message is nested and has no place in csv; write json, yaml, ros1 or ros2")
        style = self.style.in_form(form)
        text: str = import_module(FORMATS[form].writer).write_points([message.mapping()], style)
        return f"{text}---\n" if form == "yaml" else text

    def pieces(self, pieces: Iterable[str]) -> None:
        """Write text as it comes; into a file, whole or not at all."""
        with writing(self.path, force=self.force) as write:
            for piece in pieces:
                write(piece)

    def text(self, text: str) -> None:
        """Write text."""
        self.pieces([text])


