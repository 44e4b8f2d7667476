"""`frametool align`: the transform that brings a trajectory onto its reference."""

from __future__ import annotations

from frametool.cli.command import Inputs, argument, command_named, option
from frametool.cli.commands.compare import comparisons, pairing_options, trajectory_options, write_trajectory
from frametool.cli.options import names_as, result_options, rotation_options
from frametool.cli.output import Output
from frametool.stream.faults import ROWS_SKIPPED


@command_named("align")
@argument("ref")
@argument("est")
@pairing_options
@option("--names REF,EST", "names of the two worlds  [default: their own]", names_as("REF,EST"))
@trajectory_options
@rotation_options
@result_options("poses")
def command(inputs: Inputs) -> int:
    """Print the pose of EST's world in REF's, as `compare` fits it, as a tree entry.

    \b
      frametool align truth.tum odometry.tum --offset auto --names map,odom
      frametool align truth.tum odometry.tum --offset auto -o aligned.tum
      frametool align truth.tum mono.tum --align sim3 --to matrix

    -o FILE writes all of EST as it was compared: on REF's clock, with the mount and the fit applied, in the format of
    its suffix or of -f. `frametool help trajectories` describes the fits. The scale of sim3 is separate from the pose:
    p' = scale R p + t; such an entry cannot be part of a tree.
    """
    into = Output(inputs, "poses") if inputs.output else None
    entry = Output(inputs.but(output=None, format_name=None) if into else inputs, "poses")
    (found,), skipped = comparisons(inputs.ref, [inputs.est], inputs)
    from frametool.fit.numbers import whole_estimate, worlds
    from frametool.grammar.pose import Pose
    from frametool.grammar.result import Result

    named = inputs.names or worlds(found)
    whole = whole_estimate(found)._replace(world=found.pairs.ref.world)
    if into is not None or entry.is_trajectory:
        write_trajectory(into or entry, whole)
    if not entry.is_trajectory:
        pose = Pose.of(found.fit.transform.components, named[1], named[0])
        entry.values([Result(pose._replace(scale=found.fit.scale))])
    return ROWS_SKIPPED if skipped else 0
