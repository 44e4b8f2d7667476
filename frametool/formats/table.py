"""The table of all file formats, and their modules."""

from __future__ import annotations

import os
from typing import Any

from frametool.errors import NamedTuple


class Rows(NamedTuple):
    """The layout of a format's rows, and the meaning of the poses in them.

    delimiter: between the cells, "" for blanks; None if the file is not a table
    columns: in order, if there is no header; widths: allowed numbers of columns, () for any
    rotation: the representation of the numbers after the position
    inverse: the file has the pose of the world in the body, not of the body in the world
    axes: of a camera, `optical` or `opengl`, "" for other bodies
    frames: default names of world and body
    counted: the meaning of the numbers that replace stamps; "" if rows have stamps
    """

    delimiter: str | None = None
    columns: tuple[str, ...] = ()
    widths: tuple[int, ...] = ()
    rotation: str = "quaternion"
    inverse: bool = False
    axes: str = ""
    frames: tuple[str, str] = ("world", "body")
    counted: str = ""


class Format(NamedTuple):
    """A file format: its content, how it is recognised, and the modules that read and write it.

    summary: a description in one line
    suffixes: of files in this format; names: file names for which it is written
    reads: kinds of content: `tree`, read by `read` of `reader`, `joints` (values by name) by its `read_joints`;
        `records` and `rows` by the streams, columns of numbers as `arrays` by its `open_columns`; `trajectory`: it
        holds one moving frame; a `drawing`: edges without poses, by `read`, for `tree` alone; `cameras`: it may hold
        intrinsics too
    writes: kinds of results, written by `write_poses` (also a `trajectory`: the poses of one frame over time),
        `write_points` (also for a `report`), `write_tree` of `writer`; as `arrays` by its `create`, with
        columns of `texts` if it has them; if all poses have one notation, a RowForm in `ROWS` of `writer` replaces
        `write_poses`; as messages of a `recording`, whose trees are written by `tree_pieces` of `writer`
    magic: signs of its beginning, as (kind, pattern); `frametool.formats.detect` defines the kinds
    conventions: the meaning of its numbers (frames, units, order)
    required_options: the options for what it does not specify
    not_stored: what a tree loses in this format, for a warning
    """

    summary: str
    suffixes: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    reader: str = ""
    writes: tuple[str, ...] = ()
    writer: str = ""
    magic: tuple[tuple[str, str | bytes], ...] = ()
    conventions: str = ""
    required_options: tuple[str, ...] = ()
    not_stored: str = ""
    names: tuple[str, ...] = ()
    rows: Rows = Rows()

    @property
    def is_table(self) -> bool:
        """Return True if its lines are rows of cells."""
        return self.rows.delimiter is not None


def _trajectory(summary: str, reader: str, **fields: Any) -> Format:
    """Return the row of a format that lists poses of one frame, all in one notation."""
    known: dict[str, Any] = {"reader": reader, "required_options": ("frames", "stamps", "camera_axes")}
    known |= {"reads": ("tree", "trajectory", "rows"), "writes": ("poses", "trajectory")}
    return Format(summary, writer="frametool.formats.rows.pose_rows", **known | fields)


def _read_tree(summary: str, module: str, *, reads: tuple[str, ...] = ("tree",), **fields: Any) -> Format:
    """Return the row of a format of trees that is only read."""
    return Format(summary, reads=reads, reader=module, **fields)


def _tree(summary: str, module: str, **fields: Any) -> Format:
    """Return the row of a format of trees that one module reads and writes."""
    return _read_tree(summary, module, writes=("tree",), writer=module, **fields)


_DRAWINGS = "frametool.formats.trees.drawings"
_MESSAGES = "frametool.ros.message_stream"
BAG = "frametool.recordings.contents"


def _arrays(
    summary: str, module: str, *, writes: tuple[str, ...] = ("poses", "points", "arrays"), **fields: Any
) -> Format:
    """Return the row of a format of columns of numbers that one module reads and writes."""
    return Format(summary, reads=("arrays",), reader=module, writes=writes, writer=module, **fields)


def _messages(summary: str, *magic: tuple[str, str | bytes], reader: str = _MESSAGES, **fields: Any) -> Format:
    """Return the row of a format of messages."""
    return _read_tree(summary, reader, magic=magic, required_options=("frames",), **fields)


_CAMERAS = ("tree", "cameras")

# choices of options for what the format of a file does not specify
DIRECTIONS = ("parent-from-child", "child-from-parent")
CAMERA_AXES = ("optical", "opengl")
DH = ("standard", "modified")
ORDERS = ("xyzw", "wxyz")
CHOICES = {"direction": DIRECTIONS, "camera_axes": CAMERA_AXES, "dh": DH, "order": ORDERS}
_CAMERA = ("world", "camera")
_TREE = "frametool.formats.trees.tree_reader"
_TABLE = "frametool.rows.conversion"
NUMBER = r"[-+]?(?:\d++\.?\d*+|\.\d++)(?:[eE][-+]?\d++)?"
_ONE_COLUMN = r"\ufeff?\"?[A-Za-z]\w*(?: ?[\[(][a-z]+[\])])?\"?[ \t]*\r?\n[-+.\d]"  # a column name above a number
_MESSAGE_KEYS = (
    "transforms|static_transforms|header|child_frame_id|- header|linear|wrench|twist|pose|point|vector|force"
)
_POSE_WORDS = (
    r"[xyz](?:_mm|_cm)?|[pt][xyz]|xyz\w*|(?:trans|translation|pos|position|location)(?:_[xyz])?|t|tvec|value|pose|"
    r"(?:rot|rotation|q|quat|quaternion)(?:_?[xyzw])?|orientation|(?:roll|pitch|yaw|rpy|euler|axis_angle|rotvec)\w*|"
    r"xyzw|wxyz|matrix|a[xyz]|theta|[RT]|rotation_matrix|[rq]vec(?:_[wxyz])?|tvec_[xyz]"
)

_TWO_FRAMES = (
    r"T_[A-Za-z]\w{0,60}_\w{1,60}|[A-Za-z]\w{0,60}(?:_T_|_to_|_from_)\w{1,60}|[A-Za-z]{1,60}2[A-Za-z]\w{0,60}|"
    r"extrinsics?(?:_?matrix)?"
)
_AT_HEAD = r"(?=(?s:.{0,2000}?)"
_LENGTH = r"""(?<!\w)%s(?:[_ ]?[({\[]*[ijkn](?: ?- ?1)?[)}\]]*)?["']?\s*(?:[,;:\t ]|[\[(_](?:m|mm|cm)\b|$)"""
_DH = (
    rf"(?im)\A(?!\s*<){_AT_HEAD}(?<![^\W_])(?:alpha|\u03b1|twist))"
    rf"{_AT_HEAD}(?:{_LENGTH % '[ar]'}|link_length)){_AT_HEAD}(?:{_LENGTH % 'd'}|link_offset))"
)
_PCD = rb"# ?\.PCD|(?:\s*#[^\n]*\n)*\s*(?:VERSION|FIELDS|COLUMNS)[ \t][^\n]*\n(?:[^\n]*\n){0,5}?SIZE "
_KITTI = (
    r"\A(?:#[^\n]*\n)*(?:calib_time: *\d|"
    r"(?:P[0-3]|Tr\w*|R0_rect|R_rect|R):?(?:[ \t]+[^\s:]+){5})"
)

# rows of numbers, without a comment that names other columns
_UNNAMED = r"(?m)\A\ufeff?(?:[ \t]*(?:#(?!(?=.*\b(?:%s)\b)%s[ \t\r]*$).*)?\r?\n)*+[ \t]*"
_LIKE_EUROC = _UNNAMED % ("q_?w|roll|yaw", r"(?:[^,\n]*+,){7}(?:(?:[^,\n]*+,){9})?[^,\n]*")
_LIKE_KITTI = _UNNAMED % (r"r1[13][ \t]+r21|z[ \t]+r11|r33[ \t]+t?x", r"(?:[ \t]*+\S++){12}")

_KEY = r"""(?:\s|\{|#[^\n]*\n)*+["']?(?:%s)["']?:[ \t]*+"""
_PARTS = "linear|angular|force|torque|position|translation"  # keys of a message
_NAME = r"""(?:"(?:[^"\\\n]|\\.)++"|'[^'\n]++'|[\w./-]++(?: [\w./-]++)*+)"""  # the key of a frame
# no lines before the first: the search begins at each line
_TWO_KEYS = rf"""(?m)^[ \t{{]*+{_NAME}:(?:\s|\{{|#[^\n]*\n)*+(?!["']?(?:{_PARTS})["':]){_NAME}:[ \t]*+"""
_POSE_IN_TWO = rf"{_TWO_KEYS}(?:{_KEY % 'x|y|z|roll|pitch|yaw'}{NUMBER}[ ,]*){{3,}}+(?!{_KEY % 'q?[wxyz]'}{NUMBER})"

_EUROC = (
    "#timestamp [ns]", "p_RS_R_x [m]", "p_RS_R_y [m]", "p_RS_R_z [m]", "q_RS_w []", "q_RS_x []", "q_RS_y []",
    "q_RS_z []", "v_RS_R_x [m s^-1]", "v_RS_R_y [m s^-1]", "v_RS_R_z [m s^-1]", "b_w_RS_S_x [rad s^-1]",
    "b_w_RS_S_y [rad s^-1]", "b_w_RS_S_z [rad s^-1]", "b_a_RS_S_x [m s^-2]", "b_a_RS_S_y [m s^-2]",
    "b_a_RS_S_z [m s^-2]",
)  # fmt: skip

# formats that differ only in their names and magic
_ECHO = Format("", writes=("poses", "points", "tree"), writer="frametool.ros.messages")
_CALLS = Format("", writes=("poses", "tree"), writer="frametool.ros.publisher")
_RECORDING = _messages(
    "", reader=BAG, reads=_CAMERAS, writes=("poses", "points", "tree", "recording"), writer="frametool.recordings.write"
)
_DRAWN = _tree("", _DRAWINGS, reads=("drawing",), conventions="parent -> child, no poses")
_LAS = _arrays("", "frametool.formats.rows.las", writes=("points", "arrays"), conventions="metres")
_BIN = _arrays(
    "", "frametool.formats.rows.column_file", writes=("points", "arrays"),
    conventions="float32, metres, frame of the lidar; only --in tells it from other .bin",
)  # fmt: skip
_XYZI = ("x", "y", "z", "intensity")
_LAS_HEAD = rb"LASF.{100}"
_TEXTS = ("poses", "points", "arrays", "texts")
_ARROW = _arrays("", "frametool.formats.rows.arrow", writes=_TEXTS)

FORMATS = {
    "yaml": Format(
        "YAML: trees, poses, documents parted by ---", suffixes=(".yaml", ".yml"), reads=("tree", "records"),
        reader=_TREE, writes=("poses", "points", "tree", "report"), writer="frametool.grammar.result",
        magic=(
            ("own key", "frames|children"),
            ("line", r"\{ *[A-Za-z_][\w.]*: "),  # not JSON, whatever the suffix: its keys have quotes
            # a CSV header whose first column ends in a colon is not a key
            ("header", r"""(?!(?!.*(?:[{\[]|: )).*,)(?:---(?:\s|$)|%YAML|- |(?:[\w./-]+|"[^"\n]*"):(?:\s|$)|[\[{])"""),
        ),
    ),
    "json": Format(
        "JSON: trees, one object a line, or an array", suffixes=(".json", ".jsonl", ".ndjson"),
        reads=("tree", "records"), reader=_TREE, writes=("poses", "points", "tree", "report"),
        writer="frametool.grammar.result",
        magic=(("json key", "frames"), ("begin", r"""\s*(?:\{\s*["}]|\[\s*(?:[\[{"\]]|-?\d|$))""")),
    ),
    "csv": Format(
        "CSV with a header", suffixes=(".csv",), reads=("tree", "rows"), reader=_TABLE,
        required_options=("frames", "stamps"), writes=("poses", "points", "report", "trajectory"),
        writer="frametool.formats.rows.csv", magic=(("begin", _ONE_COLUMN), ("header", r"[^\t]*,[^\t]*$")),
        rows=Rows(","),
    ),
    "tsv": Format(
        "tab-separated values with a header", (".tsv", ".tab"), reads=("tree", "rows"), reader=_TABLE,
        required_options=("frames", "stamps"), rows=Rows("\t"),
        magic=(("line", r'(?:"?[A-Za-z_][^\t,;:{]*\t)+(?:"?[A-Za-z_][^\t,;:{]*)?$'), ("header", r".*\t")),
    ),
    "semicolon": Format(
        "CSV with semicolons and a header", reads=("tree", "rows"), reader=_TABLE,
        required_options=("frames", "stamps"), magic=(("line", r"[^\t,;:{]+(?:;[^\t,;:{]*)+$"),), rows=Rows(";"),
    ),
    "columns": Format(
        "columns between blanks, # comments", reads=("rows",), required_options=("stamps",),
        magic=(("header", r"#|\s*\S+\s+\S"),), rows=Rows(""),
    ),
    "tum": _trajectory(
        "trajectory: t x y z qx qy qz qw", _TABLE, suffixes=(".tum",),
        magic=(("line", rf"(?:{NUMBER}[ \t]+){{7}}{NUMBER}\s*$"),),
        conventions="world<-body, seconds, metres, quaternion x y z w", required_options=("frames",),
        rows=Rows("", ("t", "x", "y", "z", "qx", "qy", "qz", "qw"), rotation="xyzw"),
    ),
    "echo": _messages(
        "messages as `ros2 topic echo` or `rostopic echo` print them",
        ("line", rf"(?:{_MESSAGE_KEYS}): *$|(?:transforms|header): *[\[{{]"),
    ),
    "jsonl": _messages(
        "messages as JSON, one a line (rosbridge, Foxglove)",
        ("line", r'\{.*"(?:header|(?:static_)?transforms|parent_frame_id|op)".*\}\s*$'),
    ),
    "csv1": _messages("CSV of `rostopic echo -p`", ("line", "%time,")),
    "csv2": _messages(
        "CSV of `ros2 topic echo --csv`",
        ("line", rf"-?\d{{1,12}},\d{{1,10}},(?!{NUMBER},)[^,]*,[^,]+,|[-+0-9.e]+(?:,[-+0-9.e]+){{5}}$"),
    ),
    "calls": _read_tree(
        "static_transform_publisher calls", "frametool.ros.publisher",
        magic=(
            ("line", r".*\bstatic_transform_publisher\s+[-\d.]|--[\w-]+[ =]"),
            # numbers and two names: poses of a trajectory are numbers only
            ("line", r"[-+]?[\d.]+\s(?:\S+\s+){5,6}(?!-?[\d.])\S+\s+\S+\s*\d*\s*&?$"),
            ("last", r"(?m)^[^#\n]*\bstatic_transform_publisher\s+[-\d.]"),
        ),
    ),
    "bag1": _RECORDING._replace(
        summary="ROS 1 bag", suffixes=(".bag",), magic=(("magic", rb"#ROSBAG V2\.0\n(?:..\0\0|.{0,3}\Z)"),)
    ),
    "bag2": _RECORDING._replace(
        summary="ROS 2 bag: sqlite3, or a folder", suffixes=(".db3",),
        magic=(("magic", rb"SQLite format 3\0"), ("folder", "metadata.yaml")),
    ),
    "mcap": _RECORDING._replace(summary="MCAP file", suffixes=(".mcap",), magic=(("magic", rb"\x89MCAP0\r\n"),)),
    "ros1": _ECHO._replace(summary="messages as `rostopic echo` prints them"),
    "ros2": _ECHO._replace(summary="messages as `ros2 topic echo` prints them"),
    "foxglove": _ECHO._replace(summary="FrameTransform as JSON, one a line", writes=("poses", "tree")),
    "static1": _CALLS._replace(summary="static_transform_publisher of ROS 1"),
    "static2": _CALLS._replace(summary="static_transform_publisher of ROS 2"),
    "tf2": _DRAWN._replace(summary="the listing of tf2's all_frames_as_yaml", magic=(("yaml inner", "broadcaster"),)),
    "dot": _DRAWN._replace(
        summary="graphviz", suffixes=(".dot", ".gv"),
        magic=(("text", r"\A\ufeff?(?:\s|//[^\n]*\n)*(?:strict\s+)?digraph\b"),),
    ),
    "mermaid": Format("a mermaid flowchart", (".mmd",), writes=("tree",), writer=_DRAWINGS),
    "euroc": _trajectory(
        "EuRoC ground truth", _TABLE,
        magic=(
            ("text", r"\A\ufeff?#\s*timestamp[^\n]*q_RS_w"),
            ("text", rf"{_LIKE_EUROC}\d{{19}}(?:\s*,\s*{NUMBER}){{7}}(?:(?:\s*,\s*{NUMBER}){{9}})?\s*$"),
        ),
        conventions="world<-body (R<-S), nanoseconds, metres, quaternion w x y z", required_options=("frames",),
        rows=Rows(",", _EUROC, (8, 17), "wxyz"),
    ),
    "colmap": _trajectory(
        "COLMAP images.txt", "frametool.formats.rows.pose_rows", names=("images.txt",),
        rows=Rows(rotation="wxyz", inverse=True, axes="optical", frames=_CAMERA, counted="image ids"),
        magic=(
            ("text", r"\A\ufeff?(?:\s*#[^\n]*\n)*?# *(?:Image|Frame) list with"),
            ("line", rf"\d+(?:[ \t]+{NUMBER}){{7}}[ \t]+\d+[ \t]+\S*[^\s\d.]"),
        ),
        conventions="the file holds camera<-world, quaternion w x y z",
    ),
    "nerf": _trajectory(
        "NeRF transforms.json", "frametool.formats.rows.pose_rows", names=("transforms.json",),
        reads=("tree", "trajectory", "rows", "cameras"),
        rows=Rows(rotation="matrix", axes="opengl", frames=_CAMERA, counted="places in its list"),
        magic=(("json path", "frames/transform_matrix"),), conventions="world<-camera; opengl (y up, z back)",
    ),
    "kitti": _trajectory(
        "KITTI poses", _TABLE,
        magic=(("text", rf"{_LIKE_KITTI}(?:{NUMBER}[ \t]+){{11}}{NUMBER}\s*$"),), conventions="world<-cam0, metres",
        rows=Rows(
            "", ("r11", "r12", "r13", "tx", "r21", "r22", "r23", "ty", "r31", "r32", "r33", "tz"), (12,), "matrix",
            axes="optical", frames=("world", "cam0"), counted="numbers of pictures",
        ),
    ),
    "g2o": _trajectory(
        "g2o pose graph", "frametool.formats.rows.pose_rows", suffixes=(".g2o",),
        magic=(("line", r"(?:VERTEX|EDGE|PARAMS)_[A-Z0-9_]+(?::[A-Z_]+)?\s+\d|FIX\s+\d"),),
        conventions="world<-vertex or vertex<-vertex (--edges), quaternion x y z w",
        rows=Rows(counted="ids of vertices"), required_options=("frames", "stamps", "edges"),
    ),
    "autoware": _tree(
        "Autoware sensor calibration", "frametool.formats.trees.calibrations",
        magic=(("last", _POSE_IN_TWO),),
        conventions="parent<-child, metres, radians, roll pitch yaw about fixed axes",
    ),
    "named": _tree(
        "extrinsics by hand: a pose under each name", "frametool.formats.trees.calibrations",
        magic=(("entries", _POSE_WORDS),), conventions="pose of the name in its parent, metres, radians unless _deg",
        required_options=("frames", "direction", "order"),
    ),
    "camchain": _tree(
        "camera chain of Kalibr, OpenVINS or okvis; matrices by name", "frametool.formats.trees.matrix_files",
        magic=(
            ("yaml inner", r"T_cam_\w+|T_\w+_cam|T_cn_cnm1|T_i_b|T_SC|T_BS"),
            ("json path", "[^/]+/T_BS/data"),
            ("line", r"(?=\w+: *(?:\[|$))(?:T_[A-Za-z]\w*_\w|[A-Za-z]\w*_T_\w)"),
            ("text", r'(?m)^(?:\{\s*|[ \t]+)"(?=\w+":\s*\[)(?:T_[A-Za-z]\w*_\w|[A-Za-z]\w*_T_\w)'),
            ("text", rf"(?m)^(?:\{{\s*|[ \t]+(?=\"))?[\"']?(?:{_TWO_FRAMES})[\"']?:\s*(?:\[|-)\s*[\[-]\s*[-+.\d]"),
        ),
        conventions="target<-source as each key says; metres; intrinsics: frametool project",
        required_options=("direction", "frames"), reads=_CAMERAS,
    ),
    "kalibr": _read_tree(
        "results of Kalibr as text", "frametool.formats.trees.kalibr",
        magic=(
            ("text", r"(?im)^[ \t]*(?:baseline T_\d+_\d+:|Camera-system parameters:)"),
            ("text", r"(?im)^[ \t]*(?:Transformation[ \t]+)?T_(?:ci|ic|\w{1,40}_\w{1,40}):?[ \t]*\(\w{1,40} to \w"),
        ),
        conventions="target<-source; metres; q of a baseline is the inverse's, as in T_cn_cnm1; "
        "+- and timeshifts not read", required_options=("frames",),
    ),
    "opencv": _tree(
        "OpenCV FileStorage", "frametool.formats.trees.matrix_files",
        magic=(
            ("xml", "opencv_storage"),
            ("json path", "[^/]+/type_id"),
            ("magic", rb"(?:\xef\xbb\xbf)?\s*%YAML:1\.0(?!.*\bT_(?:cam_imu|imu_cam|cn_cnm1|i_b|SC|BS) *:)"),
            ("text", ": *!!opencv-"),
            ("yaml key", "trans_matrix"),  # of OpenLORIS-Scene
        ),
        conventions="target<-source as each key says, camera<-object by rvec and tvec; metres",
        required_options=("direction", "frames"), reads=_CAMERAS,
    ),
    "euroc-sensor": _read_tree(
        "sensor.yaml of EuRoC", "frametool.formats.trees.matrix_files",
        magic=(("yaml key", "T_BS"), ("json key", "T_BS")),
        conventions="T_BS is body<-sensor, metres", required_options=("frames",), reads=_CAMERAS,
    ),
    "apollo": _read_tree(
        "Apollo extrinsics: a TransformStamped", _TREE, magic=(("yaml inner", "euler_angles_degree"),),
        conventions="parent<-child, metres, quaternion by name; its euler_angles_degree are not used",
    ),
    "kitti-calib": _read_tree(
        "KITTI calibration", "frametool.formats.trees.kitti_calib", magic=(("text", _KITTI),),
        conventions="parent<-child, metres, optical axes of cameras by default",
        required_options=("frames", "camera_axes"), reads=_CAMERAS,
    ),
    "handeye": _tree(
        "hand-eye calibration of easy_handeye", "frametool.formats.trees.calibrations",
        magic=(("yaml inner", "eye_on_hand|tracking_base_frame"), ("yaml key", "eye_on_hand|tracking_base_frame")),
        conventions="effector (base if not on the hand)<-tracking base, metres, x y z w",
    ),
    "nuscenes": _read_tree(
        "nuScenes table", "frametool.formats.trees.nuscenes",
        magic=(("text", r'\A\s*\[\s*\{[^{}]*?"(?:sensor_)?token"\s*:\s*"'),),
        conventions="ego<-sensor, global<-ego, metres, w first, microseconds", required_options=("frames",),
        reads=_CAMERAS,
    ),
    "dh": _read_tree(
        "Denavit-Hartenberg table", "frametool.formats.robots.dh", magic=(("text", _DH),),
        conventions="parent<-child, metres, radians unless their names say deg", required_options=("dh", "frames"),
    ),
    "launch": _tree(
        "launch file", "frametool.formats.trees.launch", suffixes=(".launch",),
        magic=(("xml", "launch"), ("yaml key", "launch"), ("text", r"(?m)^ *def generate_launch_description\b")),
        conventions="parent<-child, metres, radians; angles yaw pitch roll where they have no flags",
    ),
    "mjcf": Format(
        "MJCF of MuJoCo", suffixes=(".mjcf",), reads=("tree", "joints"), reader="frametool.formats.robots.mjcf",
        magic=(("xml", "mujoco"),),
        conventions="parent<-child, metres, degrees unless radian, w first; site:NAME, camera:NAME (looking along -z)",
        required_options=("camera_axes",),
    ),
    "sdf": _read_tree(
        "SDF of Gazebo", "frametool.formats.robots.sdf", suffixes=(".sdf", ".world"), magic=(("xml", "sdf"),),
        conventions="parent<-child, metres, radians unless degrees; frames are model::link",
    ),
    "urdf": _tree(
        "URDF robot", "frametool.formats.robots.urdf", suffixes=(".urdf",), magic=(("xml", "robot"),),
        not_stored="written as links that are fixed to one another; joints, limits and shapes are no frames",
        conventions="parent<-child, metres, radians, rpy about fixed axes",
    ),
    "npy": _arrays(
        "NPY of numpy: n x 3 points, n x 7 poses, records with fields", "frametool.formats.rows.npy", writes=_TEXTS,
        suffixes=(".npy",), magic=(("magic", rb"\x93NUMPY"),),
    ),
    "pcd": _arrays(
        "PCD point cloud", "frametool.formats.rows.pcd", suffixes=(".pcd",), writes=("points", "arrays"),
        magic=(("magic", _PCD),), conventions="metres; VIEWPOINT: pose of the sensor among the points, w first",
    ),
    "ply": _arrays(
        "PLY point cloud or mesh", "frametool.formats.rows.clouds", suffixes=(".ply",), writes=("points", "arrays"),
        magic=(("magic", rb"ply\r?\n"),), conventions="metres",
    ),
    "kitti-bin": _BIN._replace(summary="point cloud of KITTI, .bin", rows=Rows(columns=_XYZI)),
    "nuscenes-bin": _BIN._replace(summary="point cloud of nuScenes, .pcd.bin", rows=Rows(columns=(*_XYZI, "ring"))),
    "las": _LAS._replace(summary="LAS laser scan", suffixes=(".las",), magic=(("magic", _LAS_HEAD + rb"[\x00-\x7f]"),)),
    "laz": _LAS._replace(summary="LAZ laser scan", suffixes=(".laz",), magic=(("magic", _LAS_HEAD + rb"[\x80-\xff]"),)),
    "parquet": _ARROW._replace(
        summary="Parquet (pip install 'frametool[arrow]')", suffixes=(".parquet", ".pq"), magic=(("magic", rb"PAR1"),),
    ),
    "arrow": _ARROW._replace(
        summary="a file of Arrow, Feather (pip install 'frametool[arrow]')", suffixes=(".arrow", ".feather", ".ipc"),
        magic=(("magic", rb"ARROW1"),),
    ),
}


FOLDERS = {name: str(what) for name, row in FORMATS.items() for kind, what in row.magic if kind == "folder"}


def readers(*what: str) -> tuple[str, ...]:
    """Return the formats that are read as any of these kinds: `tree`, `records`, `rows` and so on."""
    return tuple(name for name, row in FORMATS.items() if not set(what).isdisjoint(row.reads))


def writers(*what: str) -> tuple[str, ...]:
    """Return the formats that are written as any of these kinds: `poses`, `points`, `trajectory`, `tree`, `report`."""
    return tuple(name for name, row in FORMATS.items() if not set(what).isdisjoint(row.writes))


def is_trajectory(name: str) -> bool:
    """Return True if a format holds the poses of one frame over time, and nothing else."""
    return name in FORMATS and "trajectory" in FORMATS[name].reads


def holds(name: str | None, *what: str) -> bool:
    """Return True if a format is read or written as any of these kinds, such as `arrays` or `recording` (not text)."""
    return name in FORMATS and not {*what}.isdisjoint(FORMATS[name].reads + FORMATS[name].writes)


def by_name(path: str | None, names: tuple[str, ...]) -> str | None:
    """Return the format of `names` for an output file: by its whole name, its suffix, or a format's name as suffix."""
    last = os.path.basename(path or "")
    by_whole = next((name for name in names if last in FORMATS[name].names), None) or by_suffix(path, names)
    return by_whole or next((name for name in names if last.lower().endswith(f".{name}")), None)


def by_suffix(path: str | None, names: tuple[str, ...], table: dict[str, Any] = FORMATS) -> str | None:
    """Return the format of `names`, in a table, with the suffix of a file; None without one."""
    suffix = os.path.splitext(path or "")[1].lower()
    return next((name for name in names if suffix in table[name].suffixes), None)


def format_entry(name: str) -> dict[str, Any]:
    """Return the table row of a format as plain values."""
    row = FORMATS[name]
    return {
        "name": name, "summary": row.summary, "suffixes": row.suffixes, "reads": row.reads, "writes": row.writes,
        "states": row.conventions or None, "asks": tuple(map(option_of, row.required_options)),
    }  # fmt: skip


def option_of(ask: str) -> str:
    """Return the spelling of an option: `--dh standard|modified`."""
    choices = "|".join(CHOICES.get(ask, ()))
    name = "from" if ask == "order" else ask.replace("_", "-")
    return f"--{name}{' ' * bool(choices)}{choices}"


def example_of(name: str, width: int) -> list[str]:
    """Return the indented lines in the docstring of the format's reader, or else its writer.

    In a module of several formats, lines belong to the formats named before them.  Longer lines are cut to the width.
    """
    import re
    from importlib import import_module

    for module in filter(None, (FORMATS[name].reader, FORMATS[name].writer)):
        formats = {other for other, row in FORMATS.items() if module in (row.reader, row.writer)}
        named, lines = formats if len(formats) == 1 else set[str](), list[str]()
        for line in (import_module(module).__doc__ or "").split("\n"):
            if line.startswith("    "):
                lines += [line[4:]] * (name in named)
            elif line:
                named = formats.intersection(re.findall(r"[\w-]+", line.lower())) or named
        if lines:
            return [line if len(line) <= width else f"{line[: width - 3].rstrip()} .." for line in lines]
    return []
