"""Files of frames: trees, recordings, bags, standard input; each read by the module of its form's row."""

from __future__ import annotations

import os
from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING

from frametool.documents.input_file import InputFile
from frametool.errors import BadAnswer, FileProblem, FormatError, warn
from frametool.formats import BAG, FORMATS
from frametool.formats.detect import detect, of_folder
from frametool.grammar.edges import Answers, Edge, Options, Samples, Tally, Topics, stop

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from os import PathLike
    from typing import BinaryIO

    from frametool.documents.source import Source
    from frametool.grammar.edges import Report


class Recording(InputFile):
    """A file of frames and its form."""

    def __init__(
        self,
        path: str | PathLike[str],
        stream: BinaryIO | None = None,
        form: str | None = None,
        topics: Iterable[str] = (),
        answers: Answers = Answers(),  # noqa: B008 - it is frozen
    ) -> None:
        """Open a file, a bag's folder, or standard input for `-`, and find its form, unless it is told.

        stream: what was opened already, with nothing of it read.  topics: those of a recording that are read.
        answers: what the form may leave open.
        Raises FileProblem.
        """
        folder = None if form else of_folder(str(path))
        if not (form or folder) and os.path.isdir(path):
            raise FileProblem(f"{path}: {_about_folder(str(path))}")
        super().__init__(path, stream, folder=folder is not None)
        try:
            self.form, self.known_by = form or folder or "", "what it holds" if folder else ""
            if not self.form:
                self.form, self.known_by = detect(self.head(), "tree", name=self.path, empty="yaml")
        except BaseException:
            self.close()
            raise
        self.tally = Tally()
        self.topics = Topics(topics)
        self.answers = answers

    @classmethod
    def inline(cls, source: Source) -> Recording:
        """Take a tree that is written on the command line or was read already."""
        made = cls(source.name, BytesIO(), "yaml")
        made.text = source.text
        return made

    @property
    def holds_samples(self) -> bool:
        """Tell a recording from a tree in YAML or JSON."""
        return "records" not in FORMATS[self.form].reads

    @property
    def described(self) -> str:
        """Say what the file was taken for."""
        return f"{self.name}: {FORMATS[self.form].summary}"

    @property
    def known(self) -> str:
        """Say what the file was taken for, and by what it was known, unless that was told."""
        return f"{self.described}{f', known by {self.known_by}' if self.known_by else ''}"

    @property
    def stated(self) -> str:
        """Say what a file that was read means, if its form is not one of ours: directions, units, what was assumed."""
        states, about = FORMATS[self.form].states, self.tally.about
        said = f"{self.described}{', ' if about else ''}{about}" if states or about else ""
        return f"{said}; {states}" if states else said

    def edges(
        self, report: Report = stop, *, tell: bool = True, raw: bool = False, normalize: bool = False
    ) -> Iterator[Edge]:
        """Yield the edges in the order they were written, then warn of what was odd; otherwise as `pieces`."""
        for piece in self.pieces(report, tell=tell, raw=raw, normalize=normalize):
            if isinstance(piece, Samples):
                yield from piece.edges()
            else:
                yield piece

    def pieces(
        self, report: Report = stop, *, tell: bool = True, raw: bool = False, normalize: bool = False
    ) -> Iterator[Edge | Samples]:
        """Yield edges, and the poses of one frame that come in bulk as one piece, in the order they were written.

        report: takes the errors, and reading goes on behind them where it can; without it the first one is raised.
        tell: without it what was odd is only kept, in `tally`.  raw: messages as tf2 receives them, unchecked.
        normalize: take any non-zero quaternion and any matrix near a rotation.
        """
        try:
            options = Options(self.tally, self.topics, report, raw, normalize, self.answers)
            found = import_module(FORMATS[self.form].reader).read(self, options)
            yield from self._scoped(found) if self.scopes else found
        finally:
            self.close()
        if missing := self.topics.missing():
            report(FormatError(missing, source=self.name))
        if tell:
            self.tell()

    def tell(self) -> None:
        """Warn of what was odd in the file, once it was read."""
        for told in self.tally.told():
            warn(f"{self.name}:{told.line}: {told.message}")

    def _scoped(self, edges: Iterable[Edge]) -> Iterator[Edge]:
        """Yield the edges under each of the scopes that another file gives them."""
        for edge in edges:
            for scope in self.scopes:
                child, parent = (
                    name and _in_scope(name, scope, has_own=self.form == "sdf") for name in (edge.child, edge.parent)
                )
                yield edge._replace(child=child or "", parent=parent)


def _in_scope(name: str, scope: str, *, has_own: bool) -> str:
    """Return a name in a scope, which takes the place of its own; the world is one for all."""
    if name == "world":
        return name
    return f"{scope}::{(name.partition('::')[2] or '__model__') if has_own else name}"


def opened_together(files: Iterable[Recording]) -> list[Recording]:
    """Return files that are opened one after the other; where one cannot be, the others are closed again."""
    found: list[Recording] = []
    try:
        found.extend(files)
    except BaseException:
        close_all(found)
        raise
    for file in found:
        file.beside = found
    return found


def close_all(files: Iterable[Source | Recording]) -> None:
    """Let go of files, those among them that were not read."""
    for file in files:
        if isinstance(file, Recording):
            file.close()


def refuse_unknown_joints(files: Sequence[Recording]) -> None:
    """Raise the error for a joint that options or files told of and that none of the files has, once all were read."""
    told = [file.answers for file in files if file.answers.joints or file.answers.joint_files]
    robots = [file.tally for file in files if file.tally.has_joints]
    if told and not robots:
        option = "--joint" if told[0].joints else "--joints"
        raise BadAnswer(f"{option}: there are no joints in {', '.join(file.name for file in files)}")
    for name, error in robots[0].unknown_joints.items() if robots else ():
        if all(name in robot.unknown_joints for robot in robots):
            raise error


def _about_folder(path: str) -> str:
    """Say why a folder is not read, and which of its files would be."""
    bags = tuple(suffix for row in FORMATS.values() if row.reader == BAG for suffix in row.suffixes)
    files = sorted(name for name in os.listdir(path) if name.endswith(bags))[:5]
    return f"a folder without metadata.yaml; name a file in it: {', '.join(files)}" if files else "is a directory"
