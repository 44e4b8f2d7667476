"""The page's arithmetic, kernels.js, in a real browser: the steps of `frametool.geometry`, to the bit."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
import samples
from browsers import seen_in_chromium
from chromium import NEEDS_CHROMIUM

from frametool.geometry import floats, rigid

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

DRAWN = np.random.default_rng(4)
TURNS = samples.quaternions(20)
NEAR = [[part + 1e-9 * float(DRAWN.normal()) for part in row] for row in TURNS]
FAR = [TURNS[place] for place in DRAWN.permutation(len(TURNS)).tolist()]


def in_the_page(folder: Path, call: str, cases: Sequence[Any]) -> Any:
    """Return what a call of the page's functions makes of each case."""
    kernels = files("frametool.view").joinpath("page").joinpath("kernels.js").read_text("utf-8")
    script = f"{kernels}\nconst found = JSON.stringify({json.dumps(cases)}.map({call}));"
    page = folder / "kernels.html"
    page.write_text(
        f"<html><body><pre></pre><script>{script} document.querySelector('pre').textContent = found;"
        "document.documentElement.dataset.ready = '';</script></body></html>"
    )
    return json.loads(re.search("<pre>(.*?)</pre>", seen_in_chromium(page))[1])  # type: ignore[index]


@NEEDS_CHROMIUM
def test_the_way_between_samples_is_that_of_the_buffer(tmp_path: Path) -> None:
    cases: list[Any] = [
        [[*DRAWN.normal(size=3).tolist(), *start], [*DRAWN.normal(size=3).tolist(), *end], float(DRAWN.uniform())]
        for ends in (NEAR, FAR, TURNS)
        for start, end in zip(TURNS, ends, strict=True)
    ]
    prepare: Any = rigid.prepare
    along: Any = rigid.along
    expected = [along(*a, *prepare(*a, *b, floats), fraction, floats) for a, b, fraction in cases]
    found = in_the_page(tmp_path, "([a, b, fraction]) => along(a, b, fraction)", cases)
    assert [tuple(pose) for pose in found] == expected
