"""`frametool fk`: forward kinematics, rows of joint values to rows of poses."""

from __future__ import annotations

from click import UsageError

from frametool.cli.command import FILE, Inputs, argument, command_named, refuse
from frametool.cli.options import pose_result_options, reading_options
from frametool.cli.output import Output
from frametool.cli.streaming import Stream, stream_options
from frametool.cli.trees import FRAME, frame_name, opened, state
from frametool.formats.robots.urdf import robot_of
from frametool.formats.table import holds_arrays
from frametool.stream.joint_rows import JointRows, names_in
from frametool.stream.request import Operation, Request


@command_named("fk", own=("input_path", "joints"))
@argument("tree", FILE, metavar="URDF")
@argument("base", FRAME, metavar="BASE")
@argument("tip", FRAME, metavar="TIP")
@stream_options
@reading_options
@pose_result_options("poses")
def fk_command(inputs: Inputs) -> int:
    """Add the pose of TIP in BASE to rows of joint values.

    \b
      frametool fk arm.urdf arm_base tool -i joints.csv
      frametool fk arm.urdf tool right_finger -i joints.csv --prefix finger_
      printf 't,gripper_mm\\n0,12.5\\n' | frametool fk arm.urdf tool left_finger

    Rows are a table with a column for each joint, JSON lines or YAML documents with a key for each, or JointState
    messages as `ros2 topic echo` prints them. Columns have the names of joints: radians and metres, or elbow_deg, elbow
    [deg], finger_mm. Other columns are unchanged. A joint of the chain without a column needs --joint or --joints; a
    mimic joint follows its leader. For a single posture use `frametool lookup arm.urdf arm_base tool -j elbow=30deg`.
    """
    stream = Stream(inputs, Output(inputs, "poses"))
    if (joints := inputs.peek("joints")) and not stream.path and not stream.has_input():
        words = " ".join((inputs.tree, inputs.base, inputs.tip, *(f"-j {each}" for each in joints)))
        raise UsageError(f"no rows of joint values: give -i FILE; for one posture, frametool lookup {words}")
    (file,) = opened((inputs.tree,), streams=True)
    robot, posture = robot_of(file)
    rows = JointRows(robot, posture, frame_name(inputs.base, robot), frame_name(inputs.tip, robot))
    with stream.opened() as source:
        begin = source.peek()
        fmt = stream.chosen_format() or stream.detected(begin)
        refuse(holds_arrays(fmt), f"rows of joints are a table of text, records or messages, not {fmt}")
        names = names_in(begin, fmt, stream.name, "a key for each joint, or JointState messages", header=inputs.header)
        rows.bind(names, stream.name, fixed=frozenset(file.answers.joints))
        file.tally.assumed = ""  # rows say where each joint on the way is
        state([file])
        operation = Operation(moves=True, formula=rows)
        return stream.run(Request(operation, poses=0, degrees=inputs.deg, normalize=inputs.normalize))
