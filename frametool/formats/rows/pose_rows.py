"""How formats write poses, one after another, and how COLMAP, g2o and NeRF list them.

`("seconds", b" ", Numbers(7), b"\\n")` is a row of a TUM trajectory, 1305031102.175800000 1.0 2.0 3.0 0.0 0.0 0.0 1.0.
`frametool.rows.sinks.as_rows` fills in the table, for one pose or a million.

COLMAP's images.txt has two lines per image, the second its points (which may be empty, but must be there):

    # Image list with two lines of data per image:
    #   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME
    1 0.8517 0.0165 0.5035 -0.1431 -0.7376 1.0240 3.7463 1 P1180141.JPG
    2362.39 248.498 58396 1784.7 268.254 59027

It has the pose of the world in the camera, camera<-world: the camera is at -R't.  Optical axes.  Since 2025 frames.txt,
the list of frames of a rig, has the pose of the world in the rig: FRAME_ID RIG_ID QW .. TZ ..

A pose graph of g2o has vertices, poses in the world, metres, quaternion w last; edges are relative to the first vertex:

    VERTEX_SE3:QUAT 0 1.0 2.0 0.5 0.0 0.0 0.0 1.0
    VERTEX_SE2 1 1.0 2.0 0.5
    EDGE_SE3:QUAT 0 1 1.0 0.0 0.0 0.0 0.0 0.0 1.0 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1

Edges are measurements and may contradict each other, so they are not a tree; the vertices are the estimate.

NeRF's transforms.json has the pose of each camera in the world as 4x4 rows, any scale; axes of OpenGL: x right, y up,
z backward.  Matrices of three rows occur (Nerfstudio), and `applied_transform`, which is already included in them:

    {"camera_angle_x": 0.69, "frames": [{"file_path": "1.png", "transform_matrix": [[..], [..], [..], [0, 0, 0, 1]]}]}
"""

from __future__ import annotations

import re
from importlib import import_module
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

from frametool.documents.document import file_error, parse_documents
from frametool.documents.source import InputFile, lines
from frametool.errors import FormatError, NamedTuple, ValueInvalid, listing, shown
from frametool.formats.table import FORMATS, Rows
from frametool.frames.stamps import BILLION, format_stamp, parse_stamp, whole_stamp
from frametool.geometry import euler, floats, quaternion, rigid
from frametool.geometry.representations import notation
from frametool.grammar.edges import EdgeColumns, Options
from frametool.grammar.readers import Misfit, Path, as_mapping, kind, read_numbers, within
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.geometry import Components
    from frametool.grammar.result import Style


HALF_TURN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # about x: converts optical axes to those of OpenGL and back
MOST_NAMED = 8
IMAGE = "image"  # key of the extra with the name of an image
NUMBER = "number"  # key of the extra with the number of a pose in the file


class Numbers(NamedTuple):
    """Several numbers of a row, with the same text between them."""

    size: int
    between: bytes = b" "


class RowForm(NamedTuple):
    """How a format writes one pose.

    row: constant text, `Numbers`, and other fields of a pose: `seconds`, `nanoseconds`, `number` (counted from
        `first`), `image` (the name of its image, else its seconds)
    numbers: converts tx, ty, tz, x, y, z, w to the numbers in the order of the file
    head, between, tail: text before the first pose, between two, and after the last
    constants: describes columns with constants, which readers of the format need, for a message
    """

    row: tuple[str | bytes | Numbers, ...]
    numbers: Callable[..., Components] = lambda *pose: pose
    head: bytes = b""
    between: bytes = b""
    tail: bytes = b""
    first: int = 0
    constants: str = ""


def turned(style: Style, pose: Components) -> Components:
    """Convert a pose from the camera's axes to those of the format, if both are known.

    The camera is the body, or also the reference frame (`style.in_camera`).
    """
    if not is_turned(style):
        return pose
    tx, ty, tz, x, y, z, w = pose
    found = rigid.compose(tx, ty, tz, x, y, z, w, *HALF_TURN)
    return rigid.compose(*HALF_TURN, *found) if style.in_camera else found


def is_turned(style: Style) -> bool:
    """Return True if the camera's axes are known and differ from those of the output format."""
    axes = FORMATS[style.format].rows.axes if style.format in FORMATS else ""
    return bool(axes and style.axes and axes != style.axes)


def image_name(image: str | None, stamp_ns: int) -> str:
    """Return the name of an image without characters that JSON and rows cannot hold, or its stamp if it has no name."""
    if image is None:
        return format_stamp(stamp_ns)
    return "".join(letter for letter in image if letter.isprintable() and letter not in '"\\')


def rows_of_matrix(*pose: float) -> Components:
    """Return the first three rows of the 4x4 of a pose, twelve numbers."""
    tx, ty, tz, *turn = pose
    r = quaternion.to_matrix(*turn)
    return tuple(chain(r[0:3], [tx], r[3:6], [ty], r[6:9], [tz]))


_ROW = b"], [", Numbers(4, b", ")
ROWS = {
    "tum": RowForm(("seconds", b" ", Numbers(7), b"\n")),
    "euroc": RowForm(
        ("nanoseconds", b",", Numbers(7, b","), b"\n"), lambda tx, ty, tz, x, y, z, w: (tx, ty, tz, w, x, y, z),
        head=",".join(FORMATS["euroc"].rows.columns[:8]).encode() + b"\n",
    ),
    "kitti": RowForm((Numbers(12), b"\n"), rows_of_matrix),
    "colmap": RowForm(
        ("number", b" ", Numbers(7), b" 1 ", IMAGE, b"\n\n"), lambda tx, ty, tz, x, y, z, w: (w, x, y, z, tx, ty, tz),
        head=b"# Image list with two lines of data per image:\n"
        b"#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n",
        first=1, constants="every camera is number 1, without points",
    ),
    "nerf": RowForm(
        (b'    {"file_path": "', IMAGE, b'", "transform_matrix": [[', Numbers(4, b", "), *_ROW, *_ROW,
         b"], [0.0, 0.0, 0.0, 1.0]]}"),
        rows_of_matrix, head=b'{\n  "frames": [\n', between=b",\n", tail=b"\n  ]\n}\n",
    ),
    "g2o": RowForm((b"VERTEX_SE3:QUAT ", "number", b" ", Numbers(7), b"\n")),
}  # fmt: skip


def rows_of(spec: str) -> RowForm | None:
    """Return how a format writes poses as rows; None if it writes each result as a text of its own."""
    known: dict[str, RowForm] = getattr(import_module(FORMATS[spec].writer), "ROWS", {})
    return known.get(spec)


# --- what is common to files of poses of one body ---


def describe(options: Options, spec: Rows, count: int, *, named: bool = True) -> None:
    """Record the assumptions about a trajectory; they are reported with the name of its file."""
    parent, child = options.answers.names(*spec.frames)
    assumed = []
    if named and not options.answers.frames:
        assumed.append(f"{count} {'pose' if count == 1 else 'poses'} of {child} in {parent} (--frames)")
    if spec.counted and not options.answers.stamps:
        assumed.append(f"seconds are {spec.counted} (--stamps)")
    options.tally.assumed = ", ".join(assumed)


class StampFile:
    """Timestamps of poses, one per line: decimal seconds, or nanoseconds with `ns`, to the nanosecond."""

    def __init__(self, path: str) -> None:
        """Read the file; raises FileProblem, FormatError."""
        self.path = path
        self.stamps: list[int] = []
        for number, line in enumerate(InputFile(path).text.splitlines(), 1):
            bare = line.strip()
            if bare and not bare.startswith("#"):
                try:
                    self.stamps.append(whole_stamp(parse_stamp(bare)))
                except ValueInvalid as error:
                    raise FormatError(str(error), source=path, line=number) from None

    def between(self, begin: int, end: int) -> list[int]:
        """Return the stamps of poses begin to end, counted from 0; raises FormatError if there are too few."""
        if end > len(self.stamps):
            message = f"{len(self.stamps)} times are too few for the poses; one a line is wanted"
            raise FormatError(message, source=self.path)
        return self.stamps[begin:end]

    def finish(self, count: int, name: str) -> None:
        """Raise FormatError if the number of stamps is not that of the poses."""
        if count != len(self.stamps):
            raise FormatError(f"{len(self.stamps)} times for the {count} poses of {name}", source=self.path)


# --- lists of poses ---

BLOCK = 1 << 12  # poses
NUMBERED = 1 << 33  # larger numbers do not fit a stamp as seconds


class Written(NamedTuple):
    """One pose as written.

    numbers: x, y, z, then those of the rotation
    number: its number in the file
    line: its line; path: its path, in a document
    image: the name of its image, if it has one
    names: of its reference frame and its body, if each has its own
    """

    numbers: tuple[float, ...]
    number: int
    line: int = 0
    image: str = ""
    path: Path = ()
    names: tuple[str, str] | None = None


class PoseBlock(NamedTuple):
    """Checked poses of a body in the world.

    poses: tx, ty, tz, x, y, z, w, arrays (n,); stamps_ns: int64 (n,); rows: the poses as written
    """

    poses: Components
    stamps_ns: Any
    rows: Sequence[Written]


def form_of(file: InputFile, options: Options) -> Rows:
    """Return how the poses of a file are read; edges of g2o have the default reading."""
    return EDGES if file.format == "g2o" and options.answers.edges else FORMATS[file.format].rows


def read(file: InputFile, options: Options) -> Iterator[EdgeColumns]:
    """Yield the poses of a file as samples of one frame; assumptions are recorded."""
    spec = FORMATS[file.format].rows
    parent, child = options.answers.names(*spec.frames)
    for block in blocks(file, options):
        poses = [*zip(*(part.tolist() for part in block.poses), strict=True)]
        worlds, bodies, lines = [parent] * len(poses), [child] * len(poses), [row.line for row in block.rows]
        if poses:
            yield EdgeColumns(worlds, bodies, block.stamps_ns.tolist(), poses, lines, is_ordered=True)
    options.tally.axes[child] = options.answers.camera_axes or spec.axes


def blocks(file: InputFile, options: Options, *, named: bool = True) -> Iterator[PoseBlock]:
    """Yield the poses of a file, checked, in blocks.

    named: the frames have the names of the format or of --frames, which is recorded as an assumption
    Raises or reports FormatError with the place of an invalid rotation.
    """
    import numpy as np

    from frametool.geometry.validation import read_rotations

    spec, rows = form_of(file, options), READERS[file.format](file, options)
    stamps = StampFile(options.answers.stamps) if options.answers.stamps else None
    count = 0
    while some := list(islice(rows, BLOCK)):
        columns = np.array([row.numbers for row in some], np.float64).T
        found = read_rotations(notation(spec.rotation), list(columns[3:]), normalize=options.normalize)
        for at, reason in sorted(found.reasons.items()):
            options.report(file_error(file, reason, some[at].line, some[at].path))
        if spec.rotation == "matrix":
            options.tally.projected = max(options.tally.projected, found.off)
        else:
            options.tally.rough += [some[at].line for at in found.mended.tolist()]
        poses: Components = (*columns[:3], *found.quaternions)
        if spec.inverse:
            poses = rigid.inverse(*poses)
        for row in some if stamps is None else ():
            if row.number >= NUMBERED:
                what = f"{row.number} is too large to count seconds; give --stamps FILE"
                raise file_error(file, what, row.line, row.path)
        before, count = count, count + len(some)
        times = stamps.between(before, count) if stamps else [row.number * BILLION for row in some]
        good = [at for at in range(len(some)) if at not in found.reasons]
        yield PoseBlock(tuple(part[good] for part in poses), np.array(times, np.int64)[good], [some[at] for at in good])
    if stamps:
        stamps.finish(count, file.name)
    describe(options, spec, count, named=named)


def text_lines(file: InputFile) -> Iterator[tuple[int, str]]:
    """Yield the lines of a file with their numbers, in bounded memory."""
    for piece in lines(file.stream, file.name):
        yield from enumerate(piece.text.removesuffix("\n").split("\n"), piece.line)


def whole_in(file: InputFile, line: int, word: str, what: str) -> int:
    """Parse a word as an integer; raises FormatError with `what` as its name."""
    if not re.fullmatch("[0-9]{1,18}", word):
        raise file.error(f"expected {what}, a whole number, found {shown(word)}", line)
    return int(word)


def numbers_in(file: InputFile, line: int, words: Sequence[str]) -> list[float]:
    """Parse the words of a line as numbers; raises FormatError."""
    try:
        return [parse_number(word) for word in words]
    except ValueInvalid as error:
        raise file.error(str(error), line) from None


# --- COLMAP ---

IMAGE_LINE = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
NUMBER_BEFORE = r"[-+.\d]+(?:[eE][-+]?\d+)?\s"
FRAME_LINE = "FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS .."


def _colmap(file: InputFile, _options: Options) -> Iterator[Written]:
    """Yield the poses of images.txt, or of frames.txt, as written."""
    comments, lines = True, text_lines(file)
    of_frames = False
    numbered = set[bool]()  # True if the name of an image begins with a number and a space
    for line, text in lines:
        bare = text.strip()
        if not bare or bare.startswith("#"):
            of_frames |= comments and "Frame list" in bare
            continue
        comments = False
        words = bare.split(maxsplit=9)  # the name of an image may contain spaces
        data = bare.split()[9:] if of_frames else []  # a count, and three words per item
        expected = FRAME_LINE if of_frames else f"10 words ({IMAGE_LINE})"
        if len(words) < 10 - of_frames:
            raise file.error(f"expected {expected}, found {len(words)} words", line)
        number = whole_in(file, line, words[0], "an id")
        whole_in(file, line, *((words[1], "RIG_ID") if of_frames else (words[8], "CAMERA_ID")))
        if data and len(data) != 1 + 3 * whole_in(file, line, data[0], "NUM_DATA_IDS"):
            raise file.error(f"expected {expected}, three words of each, found {len(data)}", line)
        w, x, y, z, *position = numbers_in(file, line, words[1 + of_frames : 8 + of_frames])
        image = "" if of_frames else words[9]
        numbered.add(re.match(NUMBER_BEFORE, image) is not None)
        if len(numbered) > 1:
            message = f"only some pictures are called as {shown(image)}; a number too many or too few in the line?"
            raise file.error(message, line)
        yield Written((*position, w, x, y, z), number, line, image)
        if not of_frames:
            below, points = next(lines, (0, ""))
            words = points.split()
            if len(words) % 3 or not all(re.fullmatch("-1|[0-9]+", word) for word in words[2::3]):
                message = f"expected points (X Y POINT3D_ID each) or an empty line, found {len(words)} words"
                raise file.error(message, below)


# --- g2o ---

EDGES = Rows()
# other tags of g2o: landmarks, parameters, other measurements
NO_POSE = r"FIX|PARAMS_\w+|ROBOTLASER\d|VERTEX_(?:XY|\w+XYZ?|CAM|SW\w*)|EDGE_(?:SE[23]|PRIOR|BEARING|PR|SW|PO)\w+"
IN_SPACE, IN_PLANE = "x y z qx qy qz qw", "x y theta"
VERTICES = {"VERTEX_SE3:QUAT": IN_SPACE, "VERTEX_SE2": IN_PLANE}
MEASURED = {"EDGE_SE3:QUAT": IN_SPACE, "EDGE_SE2": IN_PLANE}
INFORMATION = {IN_SPACE: 21, IN_PLANE: 6}  # numbers after an edge


def _g2o(file: InputFile, options: Options) -> Iterator[Written]:
    """Yield the vertices of a pose graph as written, or with --edges its edges."""
    edges = options.answers.edges
    kinds, others = (MEASURED, VERTICES) if edges else (VERTICES, MEASURED)
    only_others = 0
    unknown: dict[str, int] = {}  # tag -> its first line
    for line, text in text_lines(file):
        tag, *words = text.split() or ["#"]
        if tag in others:
            only_others = only_others or line
        elif tag in kinds:
            only_others, layout = -1, kinds[tag]
            expected = f"{'i j' if edges else 'id'} {layout}"
            size = len(expected.split())
            if len(words) != size and (not edges or len(words) != size + INFORMATION[layout]):
                raise file.error(f"expected {tag} {expected}, found {len(words) + 1} words", line)
            number, *_ = (whole_in(file, line, word, "the id of a vertex") for word in words[: 1 + edges])
            numbers = numbers_in(file, line, words[1 + edges : size])
            if layout == IN_PLANE:
                x, y, theta = numbers
                numbers = [x, y, 0.0, *euler.to_quaternion(0.0, 0.0, theta, "sxyz", floats)]
            yield Written(tuple(numbers), number, line, names=(words[0], words[1]) if edges else None)
        elif not tag[0].isupper() and tag[0] != "#":
            raise file.error(f"expected a tag as {next(iter(kinds))}, found {shown(tag)}", line)
        elif tag[0] != "#" and not re.fullmatch(NO_POSE, tag):
            unknown.setdefault(tag, line)
    if unknown:
        options.tally.note(f"lines of unknown tags left out: {listing(unknown, 3)}", min(unknown.values()))
    if only_others > 0:
        as_poses = "edges in it, which measure and are no tree; as poses: frametool convert FILE --edges"
        found = "vertices in it; leave --edges out" if edges else as_poses
        raise file.error(f"only {found}", only_others)


# --- NeRF ---

MATRIX = "transform_matrix"
LAST_ROW = (0.0, 0.0, 0.0, 1.0)


def _nerf(file: InputFile, options: Options) -> Iterator[Written]:
    """Yield the poses of the cameras as written."""
    for document in parse_documents(file.text, file.name):
        try:
            whole = as_mapping(document.value, "transforms.json")
            if "applied_transform" in whole:
                options.tally.note("the poses contain its applied_transform; it is not taken out", 1)
            for index, entry in enumerate(whole.get("frames") or ()):
                yield within(("frames", index), _nerf_pose, entry, index)._replace(
                    path=(document.index, "frames", index, MATRIX)
                )
        except Misfit as misfit:
            raise misfit.placed(file.source, document.index) from None


def _nerf_pose(entry: Any, index: int) -> Written:
    """Read one entry of `frames`."""
    frame = as_mapping(entry, "a frame {file_path, transform_matrix}")
    matrix = frame.get(MATRIX)
    if type(matrix) is not list or len(matrix) not in (3, 4):
        raise Misfit(f"expected {MATRIX} as 4 rows, found {kind(matrix) if type(matrix) is not list else len(matrix)}")
    rows = [within((MATRIX, at), read_numbers, row, "1234") for at, row in enumerate(matrix)]
    if rows[3:] not in ([], [LAST_ROW]):
        raise Misfit("the last row of a pose is 0 0 0 1", (MATRIX, 3))
    image = frame.get("file_path")
    position, turn = [row[3] for row in rows[:3]], [number for row in rows[:3] for number in row[:3]]
    return Written((*position, *turn), index, image=image if type(image) is str else "")


READERS = {"colmap": _colmap, "g2o": _g2o, "nerf": _nerf}
