"""How long the calculator page takes in Chromium: Pyodide alone, our part of the load, the first answer, the next ones.

    PYTHONPATH=.:tests:tests/support python tests/benchmarks/bench_calculator.py

The page's goals: load to first answer 1.5 x Pyodide's own load + 2 s at most, a next answer 60 ms.  It needs chromium,
playwright and npm.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from statistics import median

import make_calculator
from chromium import running, serving

ANSWERS = 25


def main() -> None:
    """Make the page, open it once, and print its times."""
    with tempfile.TemporaryDirectory() as folder, running() as browser:
        make_calculator.write(Path(folder))
        with serving(Path(folder)) as root:
            tab = browser.new_page()
            tab.goto(f"{root}/index.html#l=convert --from rpy_deg 0 0 90")
            tab.locator(".answer").first.wait_for(timeout=120_000)
            alone, own = (float(tab.get_attribute("body", f"data-{name}") or 0) for name in ("pyodide", "own"))
            times = [float(tab.locator(".answer").first.get_attribute("data-took") or 0)]
            for count in range(2, ANSWERS + 2):
                tab.locator("#line").fill(f"convert --from rpy_deg 0 0 {count}")
                tab.keyboard.press("Enter")
                answer = tab.locator(".answer")
                answer.nth(count - 1).wait_for()
                times.append(float(answer.first.get_attribute("data-took") or 0))
    print(f"Pyodide alone {alone:.0f} ms, our part {own:.0f} ms, first answer {times[0]:.0f} ms: "
          f"{(alone + own + times[0] - 2000) / alone:.2f} x Pyodide + 2 s; next answers {median(times[1:]):.0f} ms")  # fmt: skip


if __name__ == "__main__":
    main()
