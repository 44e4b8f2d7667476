"""`frametool between`: the shortest rotation from one direction to another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.cli.command import Inputs, argument, command_named, refuse
from frametool.cli.options import result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import inline_misuse, pose_source
from frametool.cli.sink import say
from frametool.grammar.pose_algebra import turn_between

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.grammar.readers import Vector

OPPOSITE = 1e-8  # radians from half a turn at which no digit of the axis is left


@command_named("between", own=("notations",))
@argument("vectors", nargs=-1, required=True, metavar="V1 V2")
@rotation_options
@result_options("poses")
def between_command(inputs: Inputs) -> None:
    """Print the shortest rotation that turns the direction V1 into the direction V2, and its angle.

    \b
      frametool between 1,0,0 0,1,0 --to rpy_deg
      frametool between 0 0 1 0.1 -0.2 9.7
      frametool between '{x: 0, y: 0, z: 1}' '[1, 1, 0]'

    A vector is three numbers or a mapping, of any length but 0. For opposite directions any perpendicular axis is
    valid; one is chosen and reported.
    """
    output = Output(inputs, "poses")
    start, end = _directions(inputs.vectors)
    result = turn_between(start, end)
    if result.extras["angle_deg"] > 180.0 - OPPOSITE:
        say("note: the directions are opposite: half a turn about any axis at right angles to them; one was chosen")
    output.values([result])


def _directions(texts: Sequence[str]) -> tuple[Vector, Vector]:
    """Read two vectors: six bare numbers, or each by itself."""
    if len(texts) == 6:
        texts = ",".join(texts[:3]), ",".join(texts[3:])
    found = [vector for text in texts for vector in _vectors(text)]
    refuse(len(found) != 2, f"two vectors are wanted, V1 and V2, of three numbers each; found {len(found)}")
    return found[0], found[1]


def _vectors(text: str) -> list[Vector]:
    """Read the vectors of an argument."""
    from frametool.stream.record_values import read_text
    from frametool.stream.request import Operation, Request
    from frametool.stream.row_layout import VECTOR

    request = Request(Operation(moves=True), kind=VECTOR)
    with inline_misuse():
        records = read_text(pose_source(text, request), request).records
        return [record.shape.position(record.values) for record in records]
