"""Tables of Denavit-Hartenberg parameters: a row a joint, in CSV, TSV or between blanks, in YAML or JSON.

    joint,theta,d,a,alpha_deg
    1,q1,0.089159,0,90

standard: turn by theta about z and shift by d along it, then shift by a along x and turn by alpha about it.
modified (Craig): alpha and a first, of the joint before, then theta and d.  Nothing in a table says which: `--dh` does.
Metres and radians; a column that ends in deg or mm has that unit, a cell may have its own.  Joints stand at 0, which is
added to what theta says, or d of a sliding one.  link0 carries link1 and so on: parent<-child.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import Unanswered
from frametool.formats.dh_table import rows_of
from frametool.formats.joints import Joint
from frametool.formats.posture import Posture
from frametool.geometry import euler, floats, rigid
from frametool.grammar.edges import Edge

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.input_file import InputFile
    from frametool.formats.dh_table import Amount, DhRow
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options

AXIS = (0.0, 0.0, 1.0)
TURN = 6.283185307179586
_IDENTITY: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield an edge a row, its joint as told, else at 0."""
    rows = rows_of(file)
    if not options.answers.dh:
        choice = "--dh standard (a and alpha behind the joint) or --dh modified (Craig: before it)"
        error = rows[0].fail(f"nothing in a table of Denavit-Hartenberg parameters says which they are: give {choice}")
        raise Unanswered(error.message, source=error.source, line=error.line, column=error.column)
    fails = {row.name: row.fail for row in rows}
    joints = [Joint(row.name, row.kind, AXIS, line=row.fail("").line) for row in rows if row.kind != "fixed"]
    fixed = [row.name for row in rows if row.kind == "fixed"]
    posture = Posture(joints, options, lambda joint, problem: fails[joint.name](problem), fixed=fixed)
    options.tally.about = ", ".join(filter(None, (options.answers.dh, options.tally.about)))
    frames = options.answers.names(*(f"link{number}" for number in range(len(rows) + 1)))
    for row, parent, child in zip(rows, frames, frames[1:], strict=False):
        line = row.fail("").line
        _tell_degrees(row, line, options)
        before, behind = _parts(row, modified=options.answers.dh == "modified")
        motions = posture.motions(row.name) if row.kind != "fixed" else [(None, (_IDENTITY,))]
        for stamp_ns, (moved,) in motions:
            pose = rigid.compose(*rigid.compose(*before, *moved), *behind)
            yield Edge(parent, child, pose, stamp_ns, line)


def _parts(row: DhRow, *, modified: bool) -> tuple[Rigid, Rigid]:
    """Return the poses before and behind the motion of a joint, which turns about z or shifts along it."""
    along_z: Rigid = (0.0, 0.0, row.d.number, *_turned((0.0, 0.0, row.theta.number), row.theta))
    along_x: Rigid = (row.a, 0.0, 0.0, *_turned((row.alpha.number, 0.0, 0.0), row.alpha))
    return (along_x, along_z) if modified else (_IDENTITY, rigid.compose(*along_z, *along_x))


def _turned(angles: tuple[float, float, float], amount: Amount) -> tuple[float, float, float, float]:
    return euler.to_quaternion(*angles, "sxyz", floats, degrees=amount.degrees)


def _tell_degrees(row: DhRow, line: int, options: Options) -> None:
    """Wonder about bare angles beyond a full turn."""
    for name, amount in (("theta", row.theta), ("alpha", row.alpha)):
        if not amount.degrees and abs(amount.number) > TURN:
            message = f"{name} {amount.number:g} is more than a full turn in radians; degrees? write {name}_deg"
            options.tally.note_each(message, line, "degrees")
