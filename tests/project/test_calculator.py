"""The calculator page in a real browser: its answers are the shell's, and nothing is asked of anybody else."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import make_calculator
import pytest
from chromium import serving
from site_pages import try_it
from site_pages.cookbook import questions

import frametool

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Visit = Callable[..., Any]

SOURCES = make_calculator.SOURCES
ROBOT = b"<robot name='r'><link name='base'/><link name='tip'/><joint name='lift' type='prismatic'><parent link='base'/><child link='tip'/><axis xyz='0 0 1'/><limit lower='0' upper='2' effort='1' velocity='1'/></joint></robot>"
WALK = b"1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n"
READY = "body[data-state=ready]"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the page, or skip where its packages cannot be had."""
    folder = tmp_path_factory.mktemp("site") / "some" / "path"
    try:
        make_calculator.write(folder)
    except (SystemExit, subprocess.CalledProcessError) as error:
        pytest.skip(f"no npm package pyodide, or no wheels for it: {error}")
    return folder


@pytest.fixture(scope="module")
def address(made: Path) -> Iterator[str]:
    """Serve the page below a path."""
    with serving(made.parents[1]) as root:
        yield f"{root}/some/path/index.html"


@pytest.fixture(scope="module")
def open_page(browser: Any, address: str) -> Iterator[Visit]:
    """Open the page; at the end nothing was asked of another place, and nothing complained of."""
    asked: list[str] = []
    complaints: list[str] = []

    def visit(fragment: str = "", **options: Any) -> Any:
        tab = browser.new_page(**{"viewport": {"width": 1280, "height": 900}, "permissions": ["clipboard-read", "clipboard-write"]} | options)
        tab.on("request", lambda request: asked.append(request.url))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        tab.goto(address + fragment)
        return tab

    yield visit
    origin = address.partition("/some/")[0]
    assert {url for url in asked if not url.removeprefix("blob:").startswith(origin)} == set()
    assert complaints == []


@pytest.fixture(scope="module")
def loaded(open_page: Visit) -> Any:
    """Open the page and wait until Python is there."""
    tab = open_page()
    tab.wait_for_selector(READY, timeout=120_000)
    return tab


@pytest.fixture
def tab(loaded: Any) -> Any:
    """Return the page that is open, without files and answers."""
    loaded.evaluate("document.getElementById('results').replaceChildren()")
    while loaded.locator("#files button").count():
        loaded.locator("#files button").first.click()
    return loaded


def expect(found: Any) -> Any:
    """Return what waits until something holds of a part of a page."""
    from playwright.sync_api import expect

    return expect(found)


def typed(tab: Any, line: str, number: int = 1) -> Any:
    """Type a line, and return its answer."""
    tab.fill("#line", line)
    tab.press("#line", "Enter")
    tab.locator(".answer").nth(number - 1).wait_for(timeout=30_000)
    return tab.locator(".answer").first


def test_the_page_is_small_and_says_what_it_is_made_of() -> None:
    own = [path for path in SOURCES.iterdir() if path.suffix in (".js", ".css")]
    assert sum(len(path.read_text().splitlines()) for path in own) <= 700
    pins = make_calculator.versions("3.14.2")
    assert re.fullmatch(rf"frametool {frametool.__version__}, Pyodide [\d.]+ \(Python 3\.14\.2\), click [\d.]+, pyyaml [\d.]+, rich [\d.]+", pins)


def test_the_page_is_useful_before_python_is_there() -> None:
    text = make_calculator.page(1, "3.14.2")
    assert len(make_calculator.QUESTIONS) == 12
    assert text.count("data-line=") == text.count("<pre><b>$ frametool ") == 12
    assert "roll 0.0 pitch 0.0 yaw 44.99999" in text
    assert "{{" not in text


def test_a_typed_line_is_answered_and_so_are_the_next_ones(tab: Any) -> None:
    answer = typed(tab, "convert --from rpy_deg 0 0 90 --to rpy_deg")
    assert answer.locator("pre.out").inner_text() == "  rpy  roll 0.0 pitch 0.0 yaw 90.0  deg\n"
    for number in range(2, 5):
        again = typed(tab, f"convert --from rpy_deg 0 0 {number}0 --to rpy_deg", number)
        assert again.locator("pre.out").inner_text() == f"  rpy  roll 0.0 pitch 0.0 yaw {number}0.0  deg\n"
    assert tab.locator("#said").get_attribute("role") == "status"
    assert tab.locator("#results").get_attribute("aria-live") == "polite"


def test_without_webassembly_the_page_says_so_and_keeps_its_answers(browser: Any, address: str) -> None:
    tab = browser.new_page()
    tab.add_init_script("delete globalThis.WebAssembly")
    tab.goto(address)
    expect(tab.locator("#said")).to_contain_text("this browser has no WebAssembly")
    assert tab.locator("#answers article").count() == 12
    tab.close()


def test_an_error_is_the_line_of_the_shell(tab: Any) -> None:
    answer = typed(tab, "lookup examples/robot.yaml map bse")
    assert answer.locator("pre.err").inner_text().startswith("frametool: unknown frame 'bse' in examples/robot.yaml")
    assert answer.locator("footer").inner_text() == "exit code 4"


def test_what_needs_numpy_is_said_to_need_an_installation(tab: Any) -> None:
    answer = typed(tab, "apply examples/robot.yaml base_link lidar -i examples/cloud.csv")
    assert answer.locator(".needs").inner_text() == "This command needs numpy, which a browser page cannot load. Installed, it runs: pipx install frametool"


def test_chips_are_answered_as_their_text_says(tab: Any) -> None:
    for number, chip in enumerate(tab.locator("#chips button").all(), 1):
        chip.click()
        tab.locator(".answer").nth(number - 1).wait_for(timeout=30_000)
        assert tab.locator(".answer").first.get_attribute("data-status") == "0", chip.inner_text()


def test_dropped_files_are_read_and_results_are_downloads(tab: Any) -> None:
    tab.set_input_files("#choose", [{"name": "robot.urdf", "mimeType": "", "buffer": ROBOT}, {"name": "walk.tum", "mimeType": "", "buffer": WALK}])
    expect(tab.locator("#files li")).to_contain_text(["robot.urdf 0.2 kB", "walk.tum 0.0 kB"])
    assert "z 1.5" in typed(tab, "lookup robot.urdf base tip -j lift=1.5 --to rpy_deg").inner_text()
    assert typed(tab, "convert -i walk.tum -f kitti", 2).locator(".needs").count() == 1  # rows need numpy
    answer = typed(tab, "tree robot.urdf -o robot.yaml", 3)
    with tab.expect_download() as started:
        answer.locator("a[download]").click()
    assert started.value.suggested_filename == "robot.yaml"
    assert "parent: base" in Path(started.value.path()).read_text()


def test_a_file_is_dropped_on_the_page(tab: Any) -> None:
    tab.evaluate("""text => {
        const held = new DataTransfer();
        held.items.add(new File([text], "dropped.yaml"));
        document.dispatchEvent(new DragEvent("drop", { dataTransfer: held, bubbles: true, cancelable: true }));
    }""", "frames: {map: {base: {xyz: [1, 2, 3]}}}")
    tab.locator("#files li").wait_for()
    assert "xyz 1 2 3" in typed(tab, "tree dropped.yaml").inner_text()


def test_tab_completes_commands_options_frames_and_files(tab: Any) -> None:
    begun = {
        "conv": "convert ", "convert --prec": "convert --precision ", "tree examples/rob": "tree examples/robot.yaml ",
        "lookup examples/robot.yaml map charg": "lookup examples/robot.yaml map charging_dock ",
    }  # fmt: skip
    for begin, whole in begun.items():
        tab.fill("#line", begin)
        tab.press("#line", "Tab")
        expect(tab.locator("#line")).to_have_value(whole)
    tab.fill("#line", "com")
    tab.press("#line", "Tab")
    expect(tab.locator("#offers code")).to_have_text(["compose", "compare"])
    assert tab.input_value("#line") == "comp"
    tab.press("#line", "Escape")
    tab.press("#line", "Tab")
    assert tab.evaluate("document.activeElement.textContent") == "Run"


def test_arrows_go_through_the_lines_before(tab: Any) -> None:
    typed(tab, "help time")
    typed(tab, "help axes", 2)
    tab.fill("#line", "")
    seen = []
    for key in ("ArrowUp", "ArrowUp", "ArrowDown", "ArrowDown"):
        tab.press("#line", key)
        seen.append(tab.input_value("#line"))
    assert seen == ["help axes", "help time", "help axes", ""]


def test_a_link_opens_the_same_answer_anew(tab: Any, open_page: Visit) -> None:
    tab.set_input_files("#choose", [{"name": "own.yaml", "mimeType": "", "buffer": b"frames: {map: {base: {xyz: [1, 2, 3]}}}"}])
    answer = typed(tab, "lookup own.yaml map base --to 'rpy_deg'")
    answer.get_by_text("Link").click()
    expect(answer.get_by_text("Copied")).to_be_visible()
    copied = tab.evaluate("navigator.clipboard.readText()")
    fragment = copied.partition("index.html")[2]
    assert fragment.startswith("#l=lookup+own.yaml+map+base")
    other = open_page(fragment)
    other.locator(".answer pre.out").wait_for(timeout=120_000)
    assert other.locator(".answer pre.out").inner_text() == answer.locator("pre.out").inner_text()
    other.close()
    expect(answer.get_by_text("Link")).to_be_visible()
    tab.set_input_files("#choose", [{"name": "large.yaml", "mimeType": "", "buffer": b" " * 30_000}])
    expect(tab.locator("#files li")).to_have_count(2)
    answer.get_by_text("Link").click()
    assert tab.locator("#said").inner_text() == "The files are 30 kB; a link holds 20 kB. Remove some."


def test_a_page_that_a_command_wrote_stands_beside_the_line_alone(tab: Any) -> None:
    typed(tab, "view examples/robot.yaml -o robot.html")
    frame = tab.frame_locator("#beside iframe")
    frame.locator("canvas").first.wait_for(timeout=20_000)
    assert tab.get_attribute("#beside iframe", "sandbox") == "allow-scripts"
    inner = next(each for each in tab.frames if each.url.endswith("frame.html"))
    assert inner.evaluate("self.origin") == "null"
    tab.click("#beside button")
    assert tab.locator("#beside iframe").count() == 0
    typed(tab, "view examples/robot.yaml --below base_link", 2)
    tab.frame_locator("#beside iframe").locator("canvas").first.wait_for(timeout=20_000)
    assert tab.locator(".answer").count() == 2


def test_a_long_run_is_stopped_and_the_next_line_runs(open_page: Visit) -> None:
    tab = open_page()
    tab.wait_for_selector(READY, timeout=120_000)
    tab.fill("#line", "sim follow --duration 100000000 -f csv -o x.csv")
    tab.press("#line", "Enter")
    tab.locator("#stop").wait_for(timeout=20_000)
    tab.click("#stop")
    assert "stopped" in tab.locator(".answer").first.inner_text()
    assert "yaw 90.0" in typed(tab, "convert --from rpy_deg 0 0 90 --to rpy_deg", 2).inner_text()
    tab.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_telephone(open_page: Visit, scheme: str) -> None:
    tab = open_page(viewport={"width": 390, "height": 800}, color_scheme=scheme)
    assert tab.evaluate("document.documentElement.scrollWidth") == 390
    tab.wait_for_selector(READY, timeout=120_000)
    typed(tab, "lookup examples/robot.yaml map camera_optical")
    assert tab.evaluate("document.documentElement.scrollWidth") == 390
    paper = tab.evaluate("getComputedStyle(document.body).backgroundColor")
    assert paper == {"light": "rgb(255, 255, 255)", "dark": "rgb(20, 23, 28)"}[scheme]
    tab.close()


def test_the_answers_of_the_page_are_those_of_the_shell(tab: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR")
    monkeypatch.setenv("TERM", "xterm-256color")
    files = make_calculator.example_files()
    lines = sorted(set(try_it.lines().values()))
    assert len(lines) > 60
    differ = []
    for line in lines:
        ran = frametool.run(line, files=files, columns=120)
        found = tab.evaluate("async line => { const r = (await window.frametool.ask('answer', line, {}, 120)).result; return [[...r.out], r.err, r.status]; }", line)
        if (bytes(found[0]), *found[1:]) != (ran.out, ran.err, ran.status):
            differ.append(line)
    assert differ == []


def test_what_the_cookbook_offers_to_try_is_in_it() -> None:
    asked = {command for each in questions() for command, _ in each.shell}
    assert set(try_it.lines()) <= asked
