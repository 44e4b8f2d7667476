"""What expressions may name, and where messages point: values, trees, the row of a stream.

Literals in braces: a pose in the grammar that files share, or a point, a vector or a twist as results are written.

{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}    {name: tool, parent: wrist, xyz: [0, 0, 0.1]}
{frame: map, point: [1, 2, 3]}           {twist: [1, 0, 0, 0, 0, 0.5]}
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.calc.tokens import CalcError
from frametool.calc.values import POINT, POSE, TWIST, VECTOR, Term, Type
from frametool.documents.document import parse_documents
from frametool.documents.source import Source
from frametool.errors import FormatError, did_you_mean, shown, warn
from frametool.grammar.pose import read_pose
from frametool.grammar.readers import Misfit, Reading, kind, read_numbers, within

if TYPE_CHECKING:
    from frametool.errors import FrametoolError
    from frametool.frames.lookups import Frames
    from frametool.grammar.pose import Pose

NAME = "literal"
AXES = ("x", "y", "z")
SIX = ("vx", "vy", "vz", "wx", "wy", "wz")
PLACED = {"point": (POINT, AXES), "vector": (VECTOR, AXES), "twist": (TWIST, SIX)}


class Literals:
    """Reads literals: what bare angles are, and whether rotations that are off are accepted."""

    def __init__(self, *, degrees: bool = False, normalize: bool = False) -> None:
        """Keep what the options say."""
        self.degrees = degrees
        self.normalize = normalize

    def read(self, text: str) -> Term:
        """Read one literal; raises CalcError."""
        source = Source(NAME, text)
        reading = Reading(source, degrees=self.degrees, normalize=self.normalize)
        try:
            (document,) = parse_documents(text, NAME)
            term = _read(document.value, reading)
        except FormatError as error:
            raise CalcError(error.message) from None
        except Misfit as misfit:
            raise CalcError(str(misfit)) from None
        for note in reading.notes:
            warn(note.message)
        return term

    def of_document(self, value: Any, source: Source) -> Term:
        """Read a document as a literal; raises FormatError with the place."""
        try:
            return _read(value, Reading(source, degrees=self.degrees, normalize=self.normalize))
        except Misfit as misfit:
            raise misfit.placed(source, 0) from None


def _read(value: Any, reading: Reading) -> Term:
    if type(value) is not dict:
        raise Misfit(f"expected a pose like {{xyz: [x, y, z], rpy_deg: [..]}}, found {kind(value)}")
    key = next((key for key in PLACED if key in value), "")
    if not key:
        return term_of_pose(read_pose(value, reading))
    if unknown := [each for each in value if each not in (key, "frame")]:
        hint = did_you_mean(unknown[0], ("frame",))
        raise Misfit(f"unknown key {shown(unknown[0])} beside {key}{hint}; expected frame", (unknown[0],), key=True)
    type_, names = PLACED[key]
    frame = value.get("frame")
    if frame is not None and (type(frame) is not str or not frame):
        raise Misfit(f"frame must be a frame's name, found {kind(frame)}", ("frame",))
    return Term(Type(type_, frame), within((key,), read_numbers, value[key], names))


def term_of_pose(pose: Pose) -> Term:
    """Return the value of a pose that names its frames or not."""
    return Term(Type(POSE, pose.parent, pose.name), pose.components)


class Scope:
    """What an expression may name: values, trees, the tree of bare look-ups, the row of a stream.

    row: the type of a row; None outside of streams
    seen: the frames of all that was evaluated
    """

    def __init__(
        self,
        *,
        tree: Frames | None = None,
        names: dict[str, Term] | None = None,
        literals: Literals | None = None,
        row: Type | None = None,
    ) -> None:
        """Keep all of it; `names` grows as lines bind."""
        self.tree = tree
        self.names = {} if names is None else names
        self.literals = literals or Literals()
        self.row = row
        self.seen: set[str | None] = {None}

    def with_row(self, row: Type) -> Scope:
        """Return the same scope for rows of a type, its names its own."""
        return Scope(tree=self.tree, names=dict(self.names), literals=self.literals, row=row)

    @property
    def trees(self) -> list[tuple[str, Frames]]:
        """Return the trees by the names that look-ups in them have; the tree of bare ones first."""
        named = [(name, term.tree) for name, term in self.names.items() if term.tree is not None]
        return [("", self.tree), *named] if self.tree is not None else named


def pointed(error: FrametoolError, text: str) -> FrametoolError:
    """Add the expression with a caret to an error that says its place."""
    at = getattr(error, "at", None)
    if at is not None and not getattr(error, "snippet", ""):
        from frametool.documents.source import line_of, places_of, pointer

        ((row, column),) = places_of(f"{text}.", [at]) if at < len(text) else [_end_of(text)]
        shown_line = pointer(line_of(text, row), column)
        error.fields = {**error.fields, "column": column}
        error.snippet = "\n".join(f"  {each}" for each in shown_line.split("\n"))  # type: ignore[attr-defined]
    return error


def _end_of(text: str) -> tuple[int, int]:
    """Return line and column behind the last character that shows."""
    lines = text.rstrip().splitlines() or [""]
    return len(lines), len(lines[-1]) + 1
