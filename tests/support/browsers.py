"""Pages of the examples, and what chromium makes of them."""

from __future__ import annotations

import re
import subprocess
from typing import TYPE_CHECKING, Any

from chromium import CHROMIUM
from console import ROOT

import frametool
from frametool.view.exports import write_page
from frametool.view.frame_scene import FrameScene

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    MakePage = Callable[..., Path]

OPTIONS = ("--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=10000")


def make_page(folder: Path, tree: str, *, eye: tuple[float, float] | None = None, **options: Any) -> Path:
    """Write the page of a tree: a file in examples, or its text; further options are the scene's."""
    source = ROOT / "examples" / tree
    if "{" in tree:
        source = folder / "tree.yaml"
        source.write_text(tree)
    scene = FrameScene(frametool.load(source), **options)
    path = folder / f"page{len(list(folder.iterdir()))}.html"
    path.write_text(write_page(scene, title=source.name, file=f"examples/{source.name}", eye=eye))
    return path


def seen_in_chromium(path: Path, fragment: str = "") -> str:
    """Return the page's elements as they stand after its script has run; needs no package."""
    arguments = [str(CHROMIUM), *OPTIONS, "--dump-dom", f"file://{path}#{fragment}"]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=False)
    assert re.search("<html[^>]*data-ready", done.stdout), done.stderr
    return done.stdout
