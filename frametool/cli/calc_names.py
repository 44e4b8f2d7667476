"""Files that get a name in expressions: a tree if it holds frames, the pose if it holds one, a list if many."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

from frametool.calc.evaluate import read_line
from frametool.calc.literals import PLACED, term_of_pose
from frametool.calc.values import LIST, TREE, Term, Type
from frametool.cli.poses import source_of
from frametool.cli.trees import load_tree
from frametool.errors import FormatError
from frametool.formats import FORMATS

if TYPE_CHECKING:
    from frametool.calc.literals import Literals
    from frametool.calc.scope import Scope
    from frametool.documents.source import Source

OF_TREES = frozenset(("frames", "transforms", "static_transforms"))


LIKE_A_FILE = r"(?!row\.)[^\s(){}\[\]*<>\"']*\.[A-Za-z]\w*"
LONGEST_PATH = 4096


def file_named_in(text: str, scope: Scope) -> Term | None:
    """Bind the name of `NAME=FILE` to what the file holds, and return it; None for everything else.

    What looks like a file and is none is refused as one.
    """
    head, equals, tail = text.partition("=")
    name, path = head.strip(), tail.strip()
    if not equals or not name.isidentifier() or not 0 < len(path) < LONGEST_PATH:
        return None
    if path != "-" and not _is_file(path) and not re.fullmatch(LIKE_A_FILE, path):
        return None
    read_line(f"{name}=0")  # refuses a name that is taken
    scope.names[name] = named_file(name, path, scope.literals).written(name, atomic=True)
    return scope.names[name]


def _is_file(path: str) -> bool:
    return "\0" not in path and os.path.exists(path)


def named_file(name: str, path: str, literals: Literals) -> Term:
    """Read a file for a name in expressions; `-` is standard input.  Raises FileProblem, FormatError."""
    if path == "-":
        source = source_of("-")
        found = _values(source, literals)
        if found is None:
            from frametool.formats.load import load_sources
            from frametool.formats.recordings import Recording

            return Term(Type(TREE), (), tree=load_sources([Recording.inline(source)]), text=name)
        return found
    form = _form(path)
    if "rows" in FORMATS[form].reads:
        from frametool.calc.pose_table import poses_of_table

        return poses_of_table(path, form, normalize=literals.normalize, degrees=literals.degrees)
    found = _values(source_of(path), literals) if "records" in FORMATS[form].reads else None
    return found or Term(Type(TREE), (), tree=load_tree(path, streams=True), text=name)


def _form(path: str) -> str:
    """Find the form of a file; what is none of tables and documents may be a tree."""
    from frametool.documents.input_file import InputFile
    from frametool.formats.detect import detect

    file = InputFile(path)
    try:
        return detect(file.head(), "tree", "rows", "records", name=path, otherwise="yaml")[0]
    finally:
        file.close()


def _values(source: Source, literals: Literals) -> Term | None:
    """Read the poses or points of a document; None for a tree."""
    from frametool.documents.document import parse_documents
    from frametool.stream.record_values import read_poses

    documents = [document.value for document in parse_documents(source.text, source.name)]
    if any(type(each) is dict and not OF_TREES.isdisjoint(each) for each in documents):
        return None
    if len(documents) == 1 and type(documents[0]) is dict and not PLACED.keys().isdisjoint(documents[0]):
        return literals.of_document(documents[0], source)
    poses = read_poses(source, degrees=literals.degrees, normalize=literals.normalize)
    if not poses:
        raise FormatError("nothing in it", source=source.name)
    items = tuple(map(term_of_pose, poses))
    return items[0] if len(items) == 1 else Term(Type(LIST), (), items=items)
