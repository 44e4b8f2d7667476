"""What the key of a matrix says: the frame it takes points to and the one it takes them from; one table for all forms.

    T_cam_imu    Kalibr: takes points of the IMU to the camera in whose block it stands
    body_T_cam0  VINS: takes points of cam0 to body, the pose of cam0 in body

A key that no row knows is never guessed: somebody has to tell its direction.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

# pattern of the key, target, source; <a> and <b> stand for names in it, {..} for what the file or the user names:
# {me} the block that the key stands in, {before} the camera before it, {imu} {body} what all of them are seen from
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
# these name two frames, and people write both directions so
ASKED = ("(?:T_)?<a>_to_<b>", "(?:T_)?<a>2<b>")
# two keys side by side, a rotation (3x3, or a rotation vector of three numbers) and a translation, and the frames they
# are about: together they take points of the second to the first; without frames their direction is asked for
PAIRS = (
    (r"rvec(.*)", r"tvec\1", "camera", r"object\1", ""),  # OpenCV's own: solvePnP, calibrateCamera
    (r"extrinsicRotation", "extrinsicTranslation", "imu", "cam0", ""),  # VINS-Mono: from the camera to the IMU
    (r"R", "T", "cam1", "cam0", "R1|P1|Q|E|F"),  # stereoCalibrate, which writes one of these beside them
    (r"R", "[Tt]", "", "", ""),
    (r"(?i:rotation(?:_?matrix)?)", "(?i:translation(?:_?vector)?)", "", "", ""),
)
# what is no pose, though some of it has the size of one
NO_POSE = (
    (r"P|P[0-9]|.*[Pp]rojection.*|P_rect.*", "projection"),
    (r"R|R[0-9]|.*[Rr]ectif.*|R_rect.*", "rectification"),
    (r"Q", "disparity to depth"),
    (r"E|F|.*[Ee]ssential.*|.*[Ff]undamental.*|H|.*[Hh]omography.*", "geometry of two pictures"),
    (r"K|K[0-9]|.*[Ii]ntrinsic.*|[Cc]amera_?[Mm]atrix.*|M[0-9]", "intrinsics"),
    (r"D|D[0-9]|.*[Dd]ist.*", "distortion"),
    (r".*[Cc]ov.*|.*[Nn]oise.*|.*[Ii]nformation.*", "covariance"),
)


class Meaning(NamedTuple):
    """What a matrix does: it takes points of `source` to `target`; in a tree `child` hangs under the other one.

    said: whether the key says so; else it is only how `--direction parent-from-child` would have it
    """

    target: str
    source: str
    child: str
    said: bool = True


class Ambiguous(NamedTuple):
    """The ways in which the names of two frames can be told apart in one key."""

    names: tuple[tuple[str, str], ...]


def meaning_of(key: str, known: Mapping[str, str], frames: Sequence[str] = ()) -> Meaning | Ambiguous | None:
    """Return what a key says; None if no row of the table knows it.

    key: without what stands before its last point (`IMU.T_b_c1`).
    known: names for what stands in braces; frames: names that the user told, which may be parts of the key.
    """
    bare = key.rpartition(".")[2]
    for pattern in ASKED:
        if ways := _ways(pattern, bare, frames):
            parent, child = ways[0]
            return Ambiguous(tuple(ways)) if len(ways) > 1 else Meaning(parent, child, child, said=False)
    for pattern, target, source in KEYS:
        if ways := _ways(pattern, bare, frames):
            if len(ways) > 1:
                return Ambiguous(tuple(ways))
            names = [_named(each, known, ways[0]) for each in (target, source)]
            return Meaning(names[0], names[1], known["me"] if "{me}" in (target, source) else names[1])
    return None


def _named(template: str, known: Mapping[str, str], names: tuple[str, str]) -> str:
    """Return the name of a frame in a row of the table."""
    return names[template == "<b>"] if template.startswith("<") else known[template[1:-1]]


def _ways(pattern: str, key: str, frames: Sequence[str]) -> list[tuple[str, str]]:
    """Return the pairs of names that a pattern finds in a key, those that the user told if they fit."""
    if "<" not in pattern:
        return [("", "")] if key == pattern else []
    told = [(a, b) for a in frames for b in frames if re.fullmatch(_filled(pattern, re.escape(a), re.escape(b)), key)]
    if told:
        return told[:1]
    found: dict[tuple[str, str], None] = {}
    for name in (r"[A-Za-z]\w*?", r"[A-Za-z]\w*"):  # the shortest first name, then the longest
        if match := re.fullmatch(_filled(pattern, name, r"[A-Za-z]\w*"), key):
            names = {"a": "", "b": ""} | match.groupdict()
            found[names["a"], names["b"]] = None
    return list(found)


def _filled(pattern: str, a: str, b: str) -> str:
    letters = pattern.replace("<letter>", "(?P<a>[a-z])", 1).replace("<letter>", "(?P<b>[a-z])", 1)
    return letters if letters != pattern else pattern.replace("<a>", f"(?P<a>{a})").replace("<b>", f"(?P<b>{b})")


def no_pose(key: str) -> str:
    """Return what a matrix is that is no pose, by its key; "" if that does not say it."""
    bare = re.split(r"[.]", key)[-1]
    return next((what for pattern, what in NO_POSE if re.fullmatch(pattern, bare)), "")


class Pair(NamedTuple):
    """The key of the translation that belongs to a rotation, and two frames as in `PAIRS`."""

    translation: str
    target: str
    source: str


def partner_of(key: str, others: Collection[str]) -> Pair | None:
    """Return what belongs to the key of a rotation among the keys beside it; None if nothing does."""
    for rotation, translation, target, source, needed in PAIRS:
        if not (match := re.fullmatch(rotation, key)):
            continue
        wanted, child = (match.expand(each) if match.groups() else each for each in (translation, source))
        found = next((other for other in others if re.fullmatch(wanted, other)), None)
        if found is not None and (not needed or any(re.fullmatch(needed, other) for other in others)):
            return Pair(found, target, child)
    return None
