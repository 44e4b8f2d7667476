"""One file a command, and the table of them; imports nothing."""

# name -> (module, what it does); help, completion and the README's check are derived from this table
COMMANDS = {
    "convert": ("frametool.cli.commands.convert", "one rotation or pose in other representations"),
    "compose": ("frametool.cli.commands.compose", "product of poses, left to right: a_from_b, b_from_c -> a_from_c"),
    "invert": ("frametool.cli.commands.invert", "the inverse of a pose: a_from_b -> b_from_a"),
    "relative": ("frametool.cli.commands.relative", "the pose of B seen from A, with distance and angle"),
    "mean": ("frametool.cli.commands.mean", "the mean of poses or rows, and how far they lie from it"),
    "between": ("frametool.cli.commands.between", "the shortest rotation from one direction to another"),
    "interpolate": ("frametool.cli.commands.interpolate", "poses between A and B at fractions of the way"),
    "lookup": ("frametool.cli.commands.lookup", "where SOURCE is seen from TARGET in a tree of frames"),
    "apply": ("frametool.cli.commands.apply", "points, vectors and poses moved into another frame"),
    "compare": ("frametool.cli.commands.compare", "how far trajectories are from a reference"),
    "align": ("frametool.cli.commands.align", "the transform that brings a trajectory onto its reference"),
    "resample": ("frametool.cli.commands.resample", "a trajectory at other moments"),
    "solve": ("frametool.cli.commands.solve", "the tree, the camera's place or the transform that measurements mean"),
    "fk": ("frametool.cli.commands.fk", "where TIP of a robot is seen from BASE, for rows of joint values"),
    "tree": ("frametool.cli.commands.tree", "the tree of frames, drawn or written in another form"),
    "view": ("frametool.cli.commands.view", "the frames seen: in the terminal, as a page that turns, as a picture"),
    "calc": ("frametool.cli.commands.calc", "expressions over poses whose frames are checked like units"),
    "echo": ("frametool.cli.commands.echo", "where SOURCE is seen from TARGET as a recording goes by"),
    "record": ("frametool.cli.commands.record", "a recording with edges, frames of poses or its span changed"),
    "monitor": ("frametool.cli.commands.monitor", "rate, interval, gaps and jumps of each edge of a recording"),
    "static": ("frametool.cli.commands.static", "static_transform_publisher arguments, written and read"),
    "check": ("frametool.cli.commands.check", "what is wrong or odd in trees and recordings"),
    "diff": ("frametool.cli.commands.diff", "what differs between two trees, calibrations or recordings"),
    "batch": ("frametool.cli.commands.batch", "many commands, one a line, in one process"),
    "formats": ("frametool.cli.commands.formats", "the forms of files that are read and written, and what they mean"),
    "examples": ("frametool.cli.commands.examples", "the example files and the cookbook, printed or copied"),
    "help": ("frametool.cli.commands.help", "a subject on one screen, the cookbook, any word: pose, axes, extrinsics"),
    "sim": ("frametool.cli.commands.sim", "turtlesim and its followers, without ROS and without a screen"),
}
TROUBLE = {"diff": 2}  # command -> its one exit code for whatever goes wrong, as that of diff(1)
