"""Detect the format of a file by its first bytes and its name; nothing else guesses.

Kinds of signs in the table, the strongest first.  Signs that have priority over the suffix belong to one format only:

    magic      a pattern of the first bytes
    folder     a file in the folder
    xml text   a pattern found in XML, outside comments
    xml        the root element
    json path  a pattern of the path to a nested key: keys separated by slashes; lists do not count
    json key   a key of the outermost object, or of the objects in the outermost list
    own key    a pattern of a key at the beginning of a line that makes YAML a frametool tree, whatever its value
    yaml key   a pattern of a key at the beginning of a line
    yaml inner a pattern of a nested key
    text       a pattern found in the first characters
    entries    all values of the outermost map, or of its only key `transforms` or `extrinsics`, are poses: maps with
               a key of this pattern, or lists of seven numbers; none is a message
    line       a pattern of the first line of data, after blank lines, comments and text that tools print
    last       a pattern found in the first characters, if nothing above fits

After the suffix, the first match is used:

    begin      a pattern of the first characters
    header     a pattern of the first line that is not a comment, or of a comment with column names

Formats that are recognised but not supported have a table here, with what to do instead: those that were never
supported, and those that were before 0.2.0.
"""

from __future__ import annotations

import os
import re
from functools import cached_property, partial

from frametool.documents.source import HEAD, LOOKED_AT, UTF16, not_text
from frametool.errors import FormatError, NamedTuple, ValueInvalid, bare, first_of
from frametool.formats.table import BAG, FOLDERS, FORMATS, by_suffix, readers

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Any


class Beginning:
    """The first bytes of a file, and their properties, computed on demand."""

    def __init__(self, head: bytes) -> None:
        """Store the bytes."""
        self.head = head

    @cached_property
    def text(self) -> str:
        """Return the bytes as text, with line feeds as line ends."""
        encoding = "utf-16" if self.head.startswith(UTF16) else "utf-8-sig"
        return self.head.decode(encoding, "replace").replace("\r\n", "\n")

    @cached_property
    def data_line(self) -> str:
        """Return the first line of data: not blank, a comment, `---`, or text that tools print."""
        from frametool.ros.messages import is_noise

        lines = (line for line in self.text.splitlines() if line.strip() and not line.startswith(("#", "---")))
        return next((line for line in lines if not is_noise(line)), "")

    @cached_property
    def first_line(self) -> str:
        """Return the first line that is not a comment; a comment with commas or tabs, like the rows, is a header."""
        from frametool.ros.messages import is_noise

        lines = [line for line in self.text.split("\n") if line.strip() and not is_noise(line)]
        plain = next((line for line in lines if not line.startswith("#")), "")
        if lines and re.match("#.*[,\t]", lines[0]) and (not plain or re.search("[,\t]", plain)):
            return lines[0]
        return plain or "".join(lines[:1])

    @cached_property
    def has_data(self) -> bool:
        """Return True for text that may hold frames or poses, False for prose."""
        is_prose = re.match(_SENTENCE, self.data_line) and not re.search(rf"(?i)\b{_OURS}\b", self.data_line)
        return not is_prose and re.search(_DATA, self.text[:LOOKED_AT]) is not None

    @cached_property
    def json_paths(self) -> set[str]:
        """Return the paths of the keys of JSON, `frames/name`; lists on the path are skipped."""
        from frametool.documents.document import looks_like_json

        found: set[str] = set()
        inner: list[tuple[str, Any]] = [("", self.value)] if looks_like_json(self.text[:LOOKED_AT]) else []
        for path, value in inner:  # grows during the loop
            if isinstance(value, list):
                inner += [(path, each.value) for each in value]
            elif isinstance(value, dict):
                found |= {path + key for key in value}
                inner += [(f"{path}{key}/", each.value) for key, (_, each) in value.items()]
        return found

    @cached_property
    def yaml_keys(self) -> list[str]:
        """Return the words at the beginnings of lines that are followed by a colon."""
        return re.findall(rf"(?m)^{_YAML_KEY}(?=\s|$)", self.text)

    @cached_property
    def yaml_inner_keys(self) -> list[str]:
        """Return the words after blanks, dashes or a brace at the beginning of a line that are followed by a colon."""
        return re.findall(rf"(?m)^(?:[ -]++|[\w./-]+: *(?=\{{))\{{?+ *+{_YAML_KEY}", self.text)

    @cached_property
    def value(self) -> Any:
        """Return the first YAML or JSON value in the first LOOKED_AT characters; None if they have no value.

        It is as in `Node.value`: a map is key -> (key node, value node), a list has nodes, a scalar is its text.
        """
        from frametool.documents.document import nodes_of
        from frametool.documents.yaml import yaml_events

        return next((node.value for node in nodes_of(yaml_events(self.text[:LOOKED_AT]))), None)

    @cached_property
    def xml(self) -> str:
        """Return the text of XML from its root element on, without comments; "" if it is not XML."""
        if not self.text.lstrip().startswith("<"):
            return ""
        text = re.sub(r"(?s)<!--.*?(?:-->|\Z)", "", self.text)
        return re.sub(r"(?s)\A\s*(?:<[?!][^>]*>\s*)*", "", text) or " "

    @cached_property
    def root(self) -> str:
        """Return the name of the root element of XML, "" if it is not in the text."""
        found = re.search(r"<([\w.:-]+)", self.xml[:LOOKED_AT])
        return found[1] if found else ""


_YAML_KEY = r"""["']?([A-Za-z_][\w./-]*)["']?[ \t]*:"""


_NO_NAME = r"header|transform|pose|point|vector|twist|wrench|force|linear|angular|child_frame_id|name|parent|samples"


def _are_poses(words: str, begin: Beginning) -> bool:
    """Return True for a map of names, or a list, whose entries are poses; the last one may be truncated."""
    if not re.search(r"(?m)^[^\s#][^\n]*:(?:\s|$)|\A\s*\{", begin.text) or not isinstance(begin.value, dict):
        return False
    top = {key: each.value for key, (_, each) in begin.value.items() if key != "angles"}
    entries = [*top.values()]
    if len(top) == 1 and (inner := top.get("transforms", top.get("extrinsics"))):
        top = inner if isinstance(inner, dict) else {}
        entries = [each.value for each in (inner if isinstance(inner, list) else (node for _, node in top.values()))]
    if len(begin.text) > LOOKED_AT and len(entries) > 1:
        entries.pop()

    def is_pose(entry: Any) -> bool:
        if isinstance(entry, list):
            return len(entry) == 7 and all(isinstance(each.value, str) for each in entry)
        keys = set(entry) if isinstance(entry, dict) else set()
        is_message = "child_frame_id" in keys and not keys.isdisjoint(("timestamp", "stamp"))  # of Foxglove
        is_message = is_message or not keys.isdisjoint(("header", "transform"))
        return any(re.fullmatch(words, key) for key in keys) and not is_message

    return bool(entries) and not _is_key(f"{words}|{_NO_NAME}", top) and all(map(is_pose, entries))


def _is_key(pattern: str, keys: Iterable[str]) -> bool:
    return any(map(re.compile(pattern).fullmatch, keys))


# kind -> the property of Beginning to search ("": all of it), and the function that matches; strongest first
_STRONG: dict[str, tuple[str, Callable[..., Any]]] = {
    "magic": ("head", partial(re.match, flags=re.DOTALL)),
    "xml text": ("xml", re.search),
    "xml": ("root", re.fullmatch),
    "json path": ("json_paths", _is_key),
    "json key": ("json_paths", _is_key),
    "own key": ("yaml_keys", _is_key),
    "yaml key": ("yaml_keys", _is_key),
    "yaml inner": ("yaml_inner_keys", _is_key),
    "text": ("text", re.search),
    "entries": ("", _are_poses),
    "line": ("data_line", re.match),
    "last": ("text", re.search),
}
_WEAK: dict[str, tuple[str, Callable[..., Any]]] = {"begin": ("text", re.match), "header": ("first_line", re.match)}
_KINDS = _STRONG | _WEAK


def _fitting(begin: Beginning, kinds: Iterable[str], names: Iterable[str]) -> tuple[list[str], str]:
    """Return the formats that match a sign of the strongest matching kind, and this kind ("" without a match)."""
    found: dict[str, str] = {}
    for kind in kinds:
        searched, fits = _KINDS[kind]
        text = getattr(begin, searched) if searched else begin
        for name in names if text else ():
            for of, what in (UNSUPPORTED.get(name) or FORMATS[name]).magic:
                if of == kind and name not in found and fits(what, text):
                    found[name] = kind
        if found and kind != "yaml key":  # outermost keys are as strong as nested ones
            break
    return [*found], next(iter(found.values()), "")


def by_sign(head: bytes | Beginning, *reads: str, name: str = "") -> str | None:
    """Return the format that the first bytes identify, among the formats read as one of `reads`; None without a match.

    Supported formats have priority.  Raises FormatError if two formats fit, or an unsupported one.
    """
    begin, known = head if isinstance(head, Beginning) else Beginning(head), readers(*reads)
    fitting, kind = _fitting(begin, _STRONG, (*known, *UNSUPPORTED, *readers("drawing")))
    if fitting and kind != "magic" and not begin.head.startswith(UTF16) and not_text(begin.head):
        return None  # bytes that resemble a line of some format by chance
    found = [fmt for fmt in fitting if fmt in known]
    if fitting and not found:
        raise not_read(fitting[0], name)
    if len(found) > 1:
        raise FormatError(f"fits {' and '.join(found)}; give --in {'|'.join(found)}", source=name or "stdin")
    return found[0] if found else None


_NO_POSES = "no poses in it (frametool tree shows the frames); give what it was made from, as a bag of /tf, /tf_static"


def not_read(fmt: str, name: str) -> FormatError:
    """Return the error for a format that is recognised but not supported: its description and what to do instead."""
    about = str(UNSUPPORTED[fmt]) if fmt in UNSUPPORTED else f"{FORMATS[fmt].summary}: {_NO_POSES}"
    return FormatError(about, source=name or "stdin")


def of_folder(path: str) -> str | None:
    """Return the format of a folder; None for a file or any other folder."""
    return next((fmt for fmt, what in FOLDERS.items() if os.path.exists(os.path.join(path, what))), None)


def detect(head: bytes, *reads: str, name: str = "", otherwise: str = "", empty: str = "") -> str:
    """Return the format of a file, among the formats read as one of `reads`.

    head: its first bytes; name: of the file, "" for standard input
    otherwise: the default format; empty: the format of a file that has only comments
    Raises FormatError if nothing matches and there is no default, or if two formats fit.
    """
    begin = Beginning(head)
    if fmt := by_sign(begin, *reads, name=name):
        return fmt
    what = not_text(head)
    if what and "tree" not in reads:
        raise _no_text(what, name)
    if "tree" in reads and begin.xml and (begin.root or not by_suffix(name, readers(*reads))):
        raise _unknown(begin, *reads, name=name)
    if others := _fitting(begin, ("magic",), readers("arrays"))[0]:
        message = f"{FORMATS[others[0]].summary}: no frames in it; frametool convert and apply read it"
        raise FormatError(message, source=name or "stdin")
    if fmt := by_suffix(name, readers(*reads)):
        if what.startswith("not text but") and FORMATS[fmt].reader != BAG:
            raise _no_text(what, name)
        return fmt
    if fmt := by_suffix(name, (*UNSUPPORTED,), UNSUPPORTED):
        raise not_read(fmt, name)
    if what and not head.startswith(UTF16):
        raise _no_text(what, name)
    found, _ = _fitting(begin, _WEAK, readers(*reads))
    if found and (otherwise or begin.has_data):
        return found[0]
    if otherwise:
        return otherwise
    if not begin.data_line and empty:
        return empty
    if not begin.text.strip():
        raise FormatError("nothing in it", source=name or "stdin")
    if "records" in reads or not begin.has_data or not re.search(r"(?m):(?:\s|$)|^[^\S\n]*+[-?&!{[]", begin.text):
        raise _unknown(begin, *reads, name=name)
    return "yaml"


def _no_text(what: str, name: str) -> FormatError:
    """Return the error for binary data: a cloud without a header needs --in."""
    if name.lower().endswith(".bin"):
        what = "binary data; of a cloud say which: --in kitti-bin (float32 x y z intensity) or nuscenes-bin (and ring)"
    return FormatError(f"{what}; {_LISTED}", source=name or "stdin")


def instead_of_text(error: FormatError, path: str) -> FormatError:
    """Return the error for a binary file in place of a pose: its kind, not the position of an invalid byte."""
    with open(path, "rb") as file:
        head = file.read(HEAD)
    what = not_text(head)
    return (_points_to_lookup(head, path) or _no_text(what, path)) if what else error


_LISTED = "`frametool formats` lists what is read"
_NUM = r"""["']?[-+]?(?:\.?\d[\w.+-]*|nan|inf\w*)["']?"""
_SENTENCE = r"\W*(?:[A-Za-z][\w'-]*[,;:]? +){3,}[A-Za-z]"
_KEYS = (
    "frames?|name|parent|children|child_frame_id|transforms?|header|samples|poses?|point|vector|position|translation|"
    r"orientation|rotation|quaternion|matrix|(?:xyz|rpy|euler)\w*"
)
_OURS = r"(?:\w*[._])?(?:q?[xyz]|qw|roll|pitch|yaw|frame|frame_id|name|parent)"
# what data have: a number as a cell or value, or at the beginning of a line; a frametool key, a list or map; a header
_DATA = "(?im)" + "|".join((
    rf"[,;\t:{{][ \t]*+{_NUM}[ \t]*(?=[,;\t\]}}]|$)|\[[ \t]*{_NUM}[ \t]*[,;]",
    rf"^[ \t]*+(?:- )*{_NUM}(?:[ \t]+{_NUM}|[ \t]*$|[,;\t])",
    rf"""(?:^|[\s{{,-])["']?(?:{_KEYS})["']?:(?:\s|$)|^[-\s]*+(?:\{{|\[(?![a-z ]+\]))""",
    rf"""\A[# ]*x +y\b|\A[#%" ]*(?:[^\n]*[,;\t] *)?["']?{_OURS}["']?\s*(?:[,;\t(\[]|$)""",
))  # fmt: skip
_MOST_NAMED = 8


def _unknown(begin: Beginning, *reads: str, name: str) -> FormatError:
    """Return the error for a file whose format is not detected: how it begins, and the formats."""
    likely = readers(*reads)
    what = "this text"
    if begin.xml:
        likely = tuple(fmt for fmt in likely if any(kind.startswith("xml") for kind, _ in FORMATS[fmt].magic))
        what = f"XML without an element{f' in its first {HEAD >> 10} KiB' * (len(begin.head) >= HEAD)}"
        what = f"XML with the root element {bare(begin.root)}" if begin.root else what
    named = f"formats: {first_of(likely, _MOST_NAMED)}" if likely else "none of those read here is XML"
    return FormatError(
        f"cannot detect the format of {what}; {named}; `frametool formats` lists all, --in FORMAT sets one",
        source=name or "stdin",
        line=1,
    )


_FRAMES_KEY = r"""(?m)^[^\S\n]*+(?:---\s*+)?(?:\{\s*+)?["']?frames["']?\s*+:"""  # of frametool trees
_MESSAGES = ("echo", "jsonl", "calls", "csv1", "csv2")  # formats that are read as poses too


def with_hint(error: FormatError, text: bytes, name: str, *, chosen: bool = False) -> FormatError:
    """Return the error for text without a pose: for frames it suggests `lookup`, for unknown text it lists formats.

    error: returned if neither applies; chosen: the format was set by the user
    """
    begin = Beginning(text[:HEAD])
    has_sign = bool(_fitting(begin, _STRONG, (*FORMATS, *UNSUPPORTED))[0])
    is_known = begin.has_data or by_suffix(name, readers("records", "rows")) or has_sign
    if begin.data_line and not (chosen or is_known or not_text(begin.head)):
        error = _unknown(begin, "records", "rows", name=name)
    return _points_to_lookup(text, name) or error


def _points_to_lookup(text: bytes, name: str) -> FormatError | None:
    begin = Beginning(text[:HEAD])
    try:
        fmt = by_sign(begin, "tree", name=name)
    except FormatError as error:
        return error
    if fmt in (None, "yaml", "json"):
        fmt = "yaml" if re.search(_FRAMES_KEY, begin.text) else None
    if fmt is None or fmt in _MESSAGES or "rows" in FORMATS[fmt].reads:
        return None
    what = "a tree of frames" if fmt == "yaml" else f"{FORMATS[fmt].summary}: frames"
    file = "FILE" if name in ("", "stdin") else name
    hint = f"look one up: frametool lookup {file} TARGET SOURCE"
    return FormatError(f"{what}, not a pose; {hint}", source=name or "stdin")


# --- formats that are recognised but not supported ---


class Unsupported(NamedTuple):
    """A format that is neither read nor written.

    summary: a description; remedy: what to do instead
    magic, suffixes: how it is recognised, as in `frametool.formats.table`
    was_written: files with its suffix were written before 0.2.0
    """

    summary: str
    remedy: str
    magic: tuple[tuple[str, str | bytes], ...] = ()
    suffixes: tuple[str, ...] = ()
    was_written: bool = False

    def __str__(self) -> str:
        """Return the description and the remedy in one line."""
        return f"{self.summary}: {self.remedy}"


_COLMAP_MODELS = "(?:SIMPLE_|FULL_)?(?:PINHOLE|RADIAL|OPENCV|FOV)(?:_FISHEYE)?|(?:RAD_TAN_)?THIN_PRISM_FISHEYE"
_SRDF = (
    "group|group_state|gripper|end_effector|virtual_joint|passive_joint|joint_property|link_sphere_approximation|"
    "(?:disable|enable|disable_default)_collisions"
)

UNSUPPORTED = {
    "drake": Unsupported(
        "Drake model directives",
        "write what add_frame and add_weld say as a tree: {name: .., parent: .., xyz: [..], rpy_deg: [..]}",
        (("yaml key", "directives"),),
    ),
    "srdf": Unsupported(
        "SRDF, the semantics of a robot",
        "give values of joints, --joints FILE with {JOINT: VALUE}; a virtual joint is an edge of a tree",
        (("xml text", rf"\A<robot\b[^<>]*>\s*<(?:{_SRDF})\b"),), (".srdf",),
    ),
    "open3d": Unsupported(
        "Open3D camera trajectory",
        "use kitti: the first 12 numbers of each pose in a line, optical axes (of JSON's extrinsics the inverse)",
        (("json path", "parameters/extrinsic"),),
    ),
    "bundler": Unsupported(
        "Bundler's bundle.out",
        "use COLMAP's images.txt, R and t of each camera with y and z negated (colmap, optical axes)",
        (("text", r"\A\ufeff?# *Bundle file v"),),
    ),
    "npz": Unsupported(
        "NPZ of numpy, several arrays in a zip file",
        'use one NPY for each array (numpy.save("NEW.npy", numpy.load("OLD.npz")["NAME"]))',
        (("magic", rb"PK\x03\x04.{26}[^\0/]{1,200}?\.npy"),), (".npz",), was_written=True,
    ),
    "arrows": Unsupported(
        "a stream of Arrow",
        "use a file of Arrow (arrow): pyarrow.feather.write_feather(pyarrow.ipc.open_stream(SOURCE).read_all(), NEW)",
        (("magic", rb"\xff\xff\xff\xff..\0\0"),), (".arrows",), was_written=True,
    ),
    "colmap-bin": Unsupported(
        "COLMAP images.bin",
        "write it as text: colmap model_converter --input_path . --output_path . --output_type TXT",
        (("magic", rb".{4}\0{4}.{4}.{56}.{4}[\x20-\x7e]{1,200}\0"),),
    ),
    "xacro": Unsupported(
        "xacro, from which URDF is made", "expand it: xacro FILE > robot.urdf (pip install xacro)",
        (  # launch files have the same substitutions
            ("xml text", r"(?s)\A(?!<launch\b).*?(?:<xacro:\w|\$\{|\$\((?:arg|find|eval|env|optenv|dirname)\b)"),
        ),
        (".xacro",),
    ),
    "ur": Unsupported(
        "UR kinematics, a chain that xacro puts into the robot",
        "expand the robot's URDF with it: xacro ur.urdf.xacro kinematics_params:=FILE ..",
        (("yaml key", "kinematics"),),
    ),
    "cameras": Unsupported(
        "the intrinsics of cameras",
        "there is no pose in it; with a tree that has its frame: frametool project TREE FRAME --camera FILE",
        (
            ("yaml key", "projection_matrix|distortion_model"), ("line", r"\[image\]$"),
            ("yaml inner", r"distortion_coeffs|cam_overlaps"),
            ("text", rf"\A(?:\s*#[^\n]*\n)*\s*\d+ (?:{_COLMAP_MODELS}) \d+ \d+ "),
        ),
    ),
    "lio": Unsupported(
        "parameters of FAST-LIO or LIO-SAM",
        "extrinsic_T, R are imu<-lidar, extrinsicRot is lidar<-imu; write {xyz: .., matrix: ..} as a tree",
        (("yaml inner", r"extrinsic_[TR]|extrinsic(?:Trans|Rot|RPY)|[RP]cl"), ("yaml key", r"extrinsic_[TR]")),
    ),
    "map": Unsupported(
        "map.yaml of a map server",
        "its origin is the lower left corner of the picture in the map: {xyz: [x, y, 0], rpy: [0, 0, yaw]}",
        (("yaml key", "occupied_thresh"),),
    ),
    "scene": Unsupported(
        "a scene of USD, glTF or Unity", "units and axes differ from file to file; export URDF, or the poses as JSON",
        (
            ("magic", rb"#usda |PXR-USDC|glTF|%YAML 1\.1\r?\n%TAG !u! tag:unity3d"), ("json path", "asset/version"),
        ),
        (".usd", ".usda", ".usdc", ".usdz", ".gltf", ".glb", ".unity", ".prefab"),
    ),
    "itk": Unsupported(
        "an ITK or ANTs transform",
        "it maps points about a centre in LPS axes, in mm; convert it to a 4x4 matrix first",
        (("magic", rb"#Insight Transform File"),), (".tfm",),
    ),
}


def refuse_suffix(path: str) -> None:
    """Raise ValueInvalid for an output file whose suffix belongs to a format that was written before 0.2.0."""
    name = by_suffix(path, (*UNSUPPORTED,), UNSUPPORTED)
    if name and UNSUPPORTED[name].was_written:
        raise ValueInvalid(f"{path}: {UNSUPPORTED[name]}")
