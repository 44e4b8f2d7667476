"""Formats that are recognised but not supported: their signs, and what to do instead.

The only table of them: formats that were never supported, and those that were before 0.2.0.
"""

from __future__ import annotations

import os
from typing import NamedTuple

from frametool.errors import ValueInvalid
from frametool.formats.table import NUMBER


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
_NO_INDICES = r"(?!\s*0\s+1\s+2\s+0\s[^\n]*\n\s*1\s[^\n]*\n\s*2\s)"  # of a data frame
_OPEN3D = (
    rf"\A\ufeff?{_NO_INDICES}\s*\d+[ \t]+\d+[ \t]+\d+[^\S\n]*+\n"
    rf"(?:\s*+(?:{NUMBER}[ \t]+){{3}}{NUMBER}[^\S\n]*+\n){{2}}"
)
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
        (("text", _OPEN3D), ("json path", "parameters/extrinsic")),
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
    "camera_info": Unsupported(
        "camera_info, the intrinsics of a camera",
        "there is no pose in it; its frame is in the tree of the robot: frametool project TREE FRAME --camera FILE",
        (("yaml key", "projection_matrix|distortion_model"), ("line", r"\[image\]$")),
    ),
    "intrinsics": Unsupported(
        "cameras of Kalibr that were calibrated alone",
        "there is no pose in it; it would be under T_cam_imu or T_cn_cnm1 (project --camera FILE reads it)",
        (("yaml inner", r"distortion_coeffs|cam_overlaps"),),
    ),
    "cameras": Unsupported(
        "cameras.txt of COLMAP, the intrinsics",
        "there is no pose in it; those of the cameras are in images.txt (frametool project --camera FILE reads it)",
        (("text", rf"\A(?:\s*#[^\n]*\n)*\s*\d+ (?:{_COLMAP_MODELS}) \d+ \d+ "),),
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
    "usd": Unsupported(
        "a USD scene", "its units and axes differ from file to file; export URDF, or the poses as JSON",
        (("magic", rb"#usda |PXR-USDC"),), (".usd", ".usda", ".usdc", ".usdz"),
    ),
    "gltf": Unsupported(
        "a glTF scene", "glTF has y up and z forward; export URDF, or the poses as JSON",
        (("magic", rb"glTF"), ("json path", "asset/version")), (".gltf", ".glb"),
    ),
    "unity": Unsupported(
        "a Unity scene", "Unity is left-handed with y up; export poses as JSON and convert them",
        (("magic", rb"%YAML 1\.1\r?\n%TAG !u! tag:unity3d"),), (".unity", ".prefab"),
    ),
    "itk": Unsupported(
        "an ITK or ANTs transform",
        "it maps points about a centre in LPS axes, in mm; convert it to a 4x4 matrix first",
        (("magic", rb"#Insight Transform File"),), (".tfm",),
    ),
}


def unsupported_by_suffix(path: str) -> str | None:
    """Return the unsupported format with the suffix of a file, if any."""
    suffix = os.path.splitext(path)[1].lower()
    return next((name for name, row in UNSUPPORTED.items() if suffix in row.suffixes), None)


def refuse_suffix(path: str) -> None:
    """Raise ValueInvalid for an output file whose suffix belongs to a format that was written before 0.2.0."""
    name = unsupported_by_suffix(path)
    if name and UNSUPPORTED[name].was_written:
        raise ValueInvalid(f"{path}: {UNSUPPORTED[name]}")
