"""The rules of `check`, and the output of findings.

Example:
    robot.yaml:9:17: error: quaternion 0 0 0 0.9 has norm 0.9; .. [denormalized]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.documents.json import dump

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from frametool.errors import Finding

# rule -> (level, description); an error fails, a warning fails under --strict, a note never
RULES = {
    "syntax": ("error", "text that cannot be read, or lacks a part"),
    "empty": ("warning", "a file without any transform"),
    "no-frames": ("warning", "a file of something else, among those of --each"),
    "denormalized": ("error", "a quaternion or matrix that is not a rotation"),
    "rounded": ("warning", "a rotation off by 1e-6 to 1e-3: normalised"),
    "mirrored": ("error", "a left-handed matrix"),
    "not-finite": ("error", "NaN or infinity"),
    "degrees": ("warning", "bare angles beyond a full turn: degrees?"),
    "w-first": ("warning", "x = 1 of x, y, z, w: the identity with w first?"),
    "identity": ("warning", "an entry with neither position nor rotation"),
    "slash": ("warning", "a frame name that begins with /"),
    "no-alt": ("note", "a place on the Earth without its height"),
    "band-s": ("warning", "a zone of UTM with S, which is south"),
    "noise": ("note", "lines that a tool printed between messages"),
    "topics": ("note", "the topics that transforms came by"),
    "two-topics": ("error", "a frame that comes by the topics of two robots"),
    "limit": ("warning", "the value of a joint beyond its limits"),
    "odd": ("warning", "anything else suspicious while reading"),
    "self": ("error", "a frame that is its own parent"),
    "cycle": ("error", "frames that form a cycle"),
    "two-parents": ("error", "a static frame with two parents"),
    "two-poses": ("error", "a static frame with two poses in its parent"),
    "static-and-moving": ("error", "a frame that is static in one place and moves in another"),
    "several-roots": ("note", "frames that hang in more than one tree"),
    "repeated": ("note", "the same sample twice"),
    "repeated-stamp": ("warning", "two different samples of a frame at one stamp"),
    "backward": ("warning", "samples of a frame that come after later ones"),
    "gap": ("warning", "a pause more than 5 times the usual one"),
    "jump": ("warning", "a step 10 times the usual one, and 0.1 m or 0.2 rad"),
    "disagreement": ("error", "a frame that jumps to and fro: two publishers?"),
    "reparented": ("note", "a frame whose parent changes once or twice"),
    "loop": ("warning", "a measurement (--measured) that the tree does not agree with"),
    "flicker": ("error", "a parent that goes to and fro: two publishers?"),
}


MOST_LINES = 5  # of the further places of a finding


def level(finding: Finding) -> str:
    """Return error, warning or note."""
    return RULES[finding.rule][0]


def write_text(findings: Iterable[Finding]) -> str:
    """Return one line per finding, as compilers do; findings of a file with equal words are combined."""
    alike: dict[tuple[str, str, str], list[Finding]] = {}
    for each in findings:
        alike.setdefault((each.source, each.rule, each.message), []).append(each)
    lines = []
    for each, *more in alike.values():
        place = ":".join(str(part) for part in (each.source, each.line, each.column) if part)
        lines.append(f"{place}: {level(each)}: {each.message} [{each.rule}]{_further(more)}\n")
    return "".join(lines)


def _further(more: Sequence[Finding]) -> str:
    """Return the number of further places of a finding, and the first of them."""
    if not more:
        return ""
    lines = list(dict.fromkeys(each.line for each in more if each.line))
    named = ", ".join(map(str, lines[:MOST_LINES])) + ", .." * (len(lines) > MOST_LINES)
    return f" (and {len(more)} more{f': lines {named}' if len(lines) > 1 else f': line {named}' if lines else ''})"


def write_json(findings: Iterable[Finding]) -> str:
    """Return one object per line."""
    lines = []
    for each in findings:
        place = {"file": each.source, "line": each.line or None, "column": each.column or None}
        lines.append(f"{dump(place | {'level': level(each), 'rule': each.rule, 'message': each.message})}\n")
    return "".join(lines)


def write_github(findings: Iterable[Finding]) -> str:
    """Return workflow commands, which GitHub shows at the lines of a pull request."""
    lines = []
    for each in findings:
        kind, place = level(each).replace("note", "notice"), {"line": each.line, "col": each.column}
        lines.append(github_command(kind, each.message, file=each.source, **place, title=each.rule))
    return "".join(lines)


def github_command(kind: str, message: str, **place: str | int) -> str:
    """Return one workflow command: `error`, `warning` or `notice`; unknown parts of the place are omitted."""
    properties = ",".join(f"{key}={_escaped(str(value), ',:')}" for key, value in place.items() if value)
    return f"::{kind} {properties}::{_escaped(message)}\n"


def _escaped(text: str, more: str = "") -> str:
    """Escape characters that would end a workflow command or one of its properties."""
    for character in "%\r\n" + more:
        text = text.replace(character, f"%{ord(character):02X}")
    return text


WRITERS = {"text": write_text, "json": write_json, "github": write_github}
