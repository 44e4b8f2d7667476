"""The picture at the top of README: a terminal with a lookup, the drawing of `view` beside it.

`python tests/make_picture.py` writes it; a test holds it to what the commands print now.
"""

from __future__ import annotations

import os
import re
from html import escape
from unittest import mock

from console import ROOT

import frametool

PICTURE = ROOT / ".github" / "frametool.svg"
LINES = (
    "lookup examples/robot.yaml map camera_optical",
    "convert --from wxyz 0.9238795 0 0 0.3826834 --to rpy_deg --precision 3",
    "lookup examples/arm.urdf arm_base tool -j elbow=70deg --to rpy_deg",
)
VIEW = "view examples/robot.yaml -f svg --below base_link"
COLUMNS = 86
CELL, LINE = 8.4, 20.0  # pixels of a character
COLOURS = {"1": "#ff8a80", "2": "#69db7c", "3": "#fbbf24", "4": "#7ab0ff", "5": "#c4a7ff", "6": "#66d9e8", "7": "#e8eaed"}
DRAWING = 500.0  # pixels of the width of the drawing


def picture() -> str:
    """Return the SVG."""
    files = {f"examples/{name}": (ROOT / "examples" / name).read_bytes() for name in ("robot.yaml", "arm.urdf")}
    with mock.patch.dict(os.environ, {"TERM": "xterm-256color"}):
        os.environ.pop("NO_COLOR", None)
        printed = {line: frametool.run(line, files=files, columns=COLUMNS).out.decode() for line in LINES}
    lines = [text for line, found in printed.items() for text in (f"\x1b[2m$\x1b[0m frametool {line}", *found.splitlines())]
    left, height = COLUMNS * CELL + 48.0, len(lines) * LINE + 76.0
    rows = "\n".join(f'<text x="24" y="{64 + LINE * number:g}">{spans(line)}</text>' for number, line in enumerate(lines))
    drawing = frametool.run(VIEW, files=files).out.decode()
    return f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + DRAWING + 12:g} {height:g}" role="img">
<title>{'; '.join(f'frametool {line}' for line in LINES)}; and the frames as frametool view draws them</title>
<rect width="{left:g}" height="{height:g}" rx="10" fill="#14171c"/>
<g fill="#5b6470"><circle cx="24" cy="24" r="6"/><circle cx="44" cy="24" r="6"/><circle cx="64" cy="24" r="6"/></g>
<g font-family="ui-monospace, Menlo, Consolas, 'DejaVu Sans Mono', monospace" font-size="14" fill="#e8eaed">
{rows}
</g>
<rect x="{left + 12:g}" width="{DRAWING:g}" height="{height:g}" rx="10" class="paper faint-line"/>
{placed(drawing, left + 12, height)}</svg>
"""


def spans(line: str) -> str:
    """Return a line of a terminal with its colours; each piece stands in its column, whatever the font."""
    found, style, column = [], "", 0
    for piece in re.split(r"(\x1b\[[0-9;]*m)", line):
        if codes := re.fullmatch(r"\x1b\[([0-9;]*)m", piece):
            style = "" if codes[1] in ("", "0") else style + styled(codes[1])
        for word in re.finditer(r"\S+(?: \S+)*", "" if codes else piece):
            place = f'x="{24 + CELL * (column + word.start()):g}" textLength="{CELL * len(word[0]):g}"'
            found.append(f"<tspan {place}{style}>{escape(word[0])}</tspan>")
        column += 0 if codes else len(piece)
    return "".join(found)


def styled(codes: str) -> str:
    """Return the attributes for codes of a terminal."""
    weight = {"1": ' font-weight="bold"', "2": ' opacity="0.6"'}
    return "".join(weight.get(code) or (f' fill="{COLOURS[code[-1]]}"' if code[-1:] in COLOURS and len(code) == 2 else "") for code in codes.split(";"))


def placed(drawing: str, left: float, height: float) -> str:
    """Return a drawing as a part of another one."""
    inner = re.sub(r"^<\?xml.*?\?>\s*", "", drawing)
    head, rest = inner.split(">", 1)
    head = re.sub(r' (?:width|height)="[^"]*"', "", head).replace('font-size="12"', 'font-size="15"')  # it is drawn small
    return f'{head} x="{left:g}" y="0" width="{DRAWING:g}" height="{height:g}">{rest}'


if __name__ == "__main__":
    PICTURE.write_text(picture(), "utf-8")
