"""The meanings of keys of matrices: which frames `T_cam_imu` or `body_T_cam0` relates, and in which direction.

A table has the meanings of keys; other keys are never guessed: the user has to state their direction.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import bare, shown
from frametool.formats.table import DIRECTIONS
from frametool.grammar.readers import Path, Unclear

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from frametool.grammar.edges import Answers

# pattern of the key, target, source; <a> and <b> are names in it, {..} are named by the file or the user:
# {me} the block of the key, {before} the camera before it, {imu} {body} the common reference frame
KEYS = (
    ("T_cn_cnm1", "{me}", "{before}"),  # Kalibr: from camera n-1 to camera n
    ("T_i_b", "{me}", "{imu}"),  # Kalibr: from the body, which is its first IMU, to this one
    ("T_cam_imu", "{me}", "{imu}"),  # Kalibr
    ("T_imu_cam", "{imu}", "{me}"),  # OpenVINS
    ("T_cam_body", "{me}", "{body}"),
    ("T_body_cam", "{body}", "{me}"),
    ("T_SC", "{sensor}", "{me}"),  # okvis: S is the IMU, C the camera
    ("T_BS", "{body}", "{me}"),  # EuRoC, okvis: S is the sensor of the file or block
    ("T_cam_<b>", "{me}", "<b>"),
    ("T_<a>_cam", "<a>", "{me}"),
    ("(?:T_)?<a>_from_<b>", "<a>", "<b>"),
    ("<a>_T_<b>", "<a>", "<b>"),  # VINS-Fusion: body_T_cam0
    ("T_<a>_<b>", "<a>", "<b>"),  # ORB-SLAM3: IMU.T_b_c1, Stereo.T_c1_c2
    ("T<letter><letter>", "<a>", "<b>"),  # ORB-SLAM3: Tbc
)
# these name two frames, and both directions are in use
AMBIGUOUS = (("(?:T_)?<a>_to_<b>", "<a>", "<b>"), ("(?:T_)?<a>2<b>", "<a>", "<b>"))
# two keys, a rotation (3x3, or a rotation vector of three numbers) and a translation, and their frames: together they
# map points of the second to the first; without frames, the direction must be set
PAIRS = (
    (r"rvec(.*)", r"tvec\1", "camera", r"object\1", ""),  # OpenCV's own: solvePnP, calibrateCamera
    (r"extrinsicRotation", "extrinsicTranslation", "imu", "cam0", ""),  # VINS-Mono: from the camera to the IMU
    (r"R", "T", "cam1", "cam0", "R1|P1|Q|E|F"),  # stereoCalibrate, which writes one of these too
    (r"R", "[Tt]", "", "", ""),
    (r"(?i:rotation(?:_?matrix)?)", "(?i:translation(?:_?vector)?)", "", "", ""),
)
# keys next to a matrix that name its frames, target first (OpenLORIS-Scene, tf); the direction must be set
FRAME_KEYS = (
    ("parent_frame", "child_frame"), ("parent_frame_id", "child_frame_id"), ("frame_id", "child_frame_id"),
    ("parent", "child"), ("target_frame", "source_frame"), ("destination_frame", "source_frame"),
)  # fmt: skip
# matrices that are not poses, although some have the size of one: projection, rectification, disparity to depth,
# geometry of two pictures, intrinsics, distortion, covariance
NO_POSE = (
    r"[PRKD][0-9]?|M[0-9]|[QEFH]|.*([Pp]rojection|[Rr]ectif|[Ee]ssential|[Ff]undamental|[Hh]omography|[Ii]ntrinsic|[Dd]ist|"
    r"[Cc]ov|[Nn]oise|[Ii]nformation).*|(P_rect|R_rect|[Cc]amera_?[Mm]atrix).*"
)


class Meaning(NamedTuple):
    """The meaning of a matrix: it maps points of `source` to `target`.

    child: the frame, of the two, that is the child in the tree
    is_stated: the key states the direction; otherwise this is the meaning with `--direction parent-from-child`
    """

    target: str
    source: str
    child: str
    is_stated: bool = True


def meaning_of(key: str, known: Mapping[str, str], frames: Sequence[str] = ()) -> Meaning | Unclear | None:
    """Return the meaning of a key, or an error if it may name two frames in several ways; None for unknown keys.

    key: a part before its last point (`IMU.T_b_c1`) is ignored
    known: names for the braces of the table; frames: names set by the user, which may be parts of the key
    """
    last = key.rpartition(".")[2]
    for row in (*AMBIGUOUS, *KEYS):
        pattern, target, source = row
        if ways := _ways(pattern, last, frames):
            if len(ways) > 1:
                pairs = " or ".join(f"{bare(a)},{bare(b)}" for a, b in ways)
                return Unclear(f"{bare(key)} may name its two frames in several ways; give --frames {pairs}", key=True)
            names = {"<a>": ways[0][0], "<b>": ways[0][1]} | {f"{{{name}}}": frame for name, frame in known.items()}
            child = names["{me}" if "{me}" in (target, source) else source]
            return Meaning(names[target], names[source], child, is_stated=row not in AMBIGUOUS)
    return None


def _ways(pattern: str, key: str, frames: Sequence[str]) -> list[tuple[str, str]]:
    """Return the pairs of names that a pattern finds in a key, those set by the user if they fit."""
    if "<" not in pattern:
        return [("", "")] if key == pattern else []
    fits = [(a, b) for a in frames for b in frames if re.fullmatch(_filled(pattern, re.escape(a), re.escape(b)), key)]
    if fits:
        return fits[:1]
    found: dict[tuple[str, str], None] = {}
    for name in (r"[A-Za-z]\w*?", r"[A-Za-z]\w*"):  # the shortest first name, then the longest
        if match := re.fullmatch(_filled(pattern, name, r"[A-Za-z]\w*"), key):
            names = {"a": "", "b": ""} | match.groupdict()
            found[names["a"], names["b"]] = None
    return list(found)


def _filled(pattern: str, a: str, b: str) -> str:
    letters = pattern.replace("<letter>", "(?P<a>[a-z])", 1).replace("<letter>", "(?P<b>[a-z])", 1)
    return letters if letters != pattern else pattern.replace("<a>", f"(?P<a>{a})").replace("<b>", f"(?P<b>{b})")


def partner_of(key: str, others: Collection[str]) -> tuple[str, str, str] | None:
    """Return the key of the translation for the key of a rotation, target and source as in PAIRS; None without one."""
    for rotation, translation, target, source, needed in PAIRS:
        match = re.fullmatch(rotation, key)
        if match is None or (needed and not any(re.fullmatch(needed, other) for other in others)):
            continue
        if match.groups():  # a numbered key has exactly one partner, which is looked up directly
            wanted = match.expand(translation)
            found = wanted if wanted in others else None
        else:
            found = next((other for other in others if re.fullmatch(translation, other)), None)
        if found is not None:
            return found, target, match.expand(source)
    return None


def directed(what: str, path: Path, parent: str, child: str, answers: Answers) -> Meaning:
    """Return the meaning for two frames with the direction of --direction; raises Unclear if that is not set."""
    if not answers.direction:
        one, other = DIRECTIONS
        a, b = bare(parent), bare(child)
        ways = f"--direction {one} (takes points of {b} to {a}) or {other} (of {a} to {b})"
        raise Unclear(f"{shown(what)}: the key does not say its direction: give {ways}", path, key=True)
    ends = (parent, child) if answers.direction == DIRECTIONS[0] else (child, parent)
    return Meaning(*ends, child)
