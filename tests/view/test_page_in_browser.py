"""The page in a real browser: its numbers are the command's, and hands, keys and the address do what they say."""

from __future__ import annotations

import itertools
import json
import math
import random
import re
from functools import partial
from typing import TYPE_CHECKING, Any

import browsers
import pytest
from chromium import NEEDS_CHROMIUM
from console import ROOT
from flow import poses_in
from samples import LATTICE, LOCK_GAPS, random_quaternions

import frametool
from frametool.geometry import euler, floats, quaternion
from frametool.view.exports import write_page
from frametool.view.frame_scene import FrameScene

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from browsers import MakePage

    Visit = Callable[..., Any]

SECONDS = (0.0, 0.5, 1.999999999, 2.0, 2.5, 4.0)
HOSTILE_NAMES = ["</script><script>alert(1)</script>", "<img src=x onerror=alert(1)>", "__proto__", "@HEAD@", "\u202eabc", "x" * 200]
LOOKUP = "([target, source, t]) => window.frameview.lookup(target, source, t)"


@pytest.fixture
def page_of(tmp_path: Path) -> MakePage:
    """Write the page of a tree."""
    return partial(browsers.make_page, tmp_path)


@pytest.fixture
def visit(browser: Any) -> Iterator[Callable[..., Any]]:
    """Open a page and wait until it is drawn; afterwards nothing was asked for and nothing was complained of."""
    asked: list[str] = []
    complaints: list[str] = []
    contexts = []

    def go(path: Path, fragment: str = "", **options: Any) -> Any:
        context = browser.new_context(**({"viewport": {"width": 1280, "height": 800}} | options))
        contexts.append(context)
        tab = context.new_page()
        tab.on("request", lambda request: asked.append(request.url))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        tab.goto(f"file://{path}" + (f"#{fragment}" if fragment else ""))
        tab.wait_for_selector("html[data-ready]", state="attached")
        return tab

    yield go
    for context in contexts:
        context.close()
    assert complaints == []
    assert [url for url in asked if not url.startswith(("file:", "blob:"))] == []
    assert len(asked) == len(contexts)


def hostile_rotations() -> Iterator[tuple[float, float, float, float]]:
    """Yield rotations at, near and far from gimbal lock."""
    generator = random.Random(5)  # noqa: S311 - no secret
    yield from LATTICE
    yield from random_quaternions(200)
    for gap in LOCK_GAPS:
        for sign in (1.0, -1.0):
            for _ in range(12):
                roll, yaw = generator.uniform(-3.14, 3.14), generator.uniform(-3.14, 3.14)
                yield euler.to_quaternion(roll, sign * (math.pi / 2 - gap), yaw, "sxyz", floats)


@NEEDS_CHROMIUM
def test_the_transform_of_the_address_stands_in_the_page(page_of: MakePage) -> None:
    seen = browsers.seen_in_chromium(page_of("robot.yaml"), "target=base_link&source=tool")
    pose = json.loads(re.search('data-pose="([^"]*)"', seen)[1])  # type: ignore[index]
    assert pose == list(frametool.load(ROOT / "examples" / "robot.yaml").lookup("base_link", "tool").components)


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
def test_every_pair_of_frames_is_what_lookup_says_to_the_bit(page_of: MakePage, visit: Visit, name: str) -> None:
    tab, tree = visit(page_of(name)), frametool.load(ROOT / "examples" / name)
    for at in SECONDS if name == "drive.yaml" else (0.0,):
        for target, source in itertools.product(tree.frames, repeat=2):
            found = tab.evaluate(LOOKUP, [target, source, round(at * 1e9)])
            assert found["pose"] == list(tree.lookup(target, source, round(at * 1e9)).components), (target, source, at)


def test_hostile_rotations_have_the_numbers_of_the_command_to_the_bit(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"))
    rotations = [quaternion.from_quaternion(*each, floats) for each in hostile_rotations()]
    assert len(rotations) >= 400
    found = tab.evaluate("(all) => all.map((q) => window.frameview.notations([0, 0, 0, ...q]))", rotations)
    for q, page in zip(rotations, found, strict=True):
        *axis, angle = quaternion.as_axis_angle(*q, floats)
        assert page["q"] == list(q)
        assert page["rpy"] == list(euler.from_quaternion(*q, "sxyz", floats)), q
        assert page["rpy_deg"] == list(euler.from_quaternion(*q, "sxyz", floats, degrees=True))
        assert page["locked"] == bool(euler.locked(*q, "sxyz"))
        assert (page["axis"], page["angle"]) == (axis, angle)
        assert page["rotvec"] == list(quaternion.as_rotvec(*q, floats))
        assert [part for row in page["matrix"] for part in row] == list(quaternion.to_matrix(*q))


def test_all_digits_are_written_as_python_writes_them(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"), "target=map&source=tool")
    tab.click("#exact")
    x, y, z = frametool.load(ROOT / "examples" / "robot.yaml").lookup("map", "tool").components[:3]
    assert tab.inner_text("#pose tr:first-child").split("\t")[1:4] == [f"x{x!r}", f"y{y!r}", f"z{z!r}"]
    tree = "{frames: {a: {b: {xyz: [1.0e-5, 1.0e+17, 3]}}}}"
    tab = visit(page_of(tree))
    tab.click("#exact")
    assert tab.inner_text("#pose tr:first-child").split("\t")[1:4] == ["x1e-05", "y1e+17", "z3.0"]


def middle(tab: Any, name: str) -> tuple[float, float]:
    """Return where a frame is in the window."""
    x, y = tab.evaluate("(name) => window.frameview.at(name)", name)
    box = tab.locator("#view").bounding_box()
    return box["x"] + x, box["y"] + y


def test_hovering_tells_a_pose_and_clicking_chooses_source_and_target(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"))
    tab.mouse.move(*middle(tab, "lidar"))
    tab.wait_for_selector("#tip:not([hidden])")
    tip = tab.inner_text("#tip")
    assert tip.startswith("lidar\nin base_link\n")
    assert "0.2850    0.0000    0.3100  m" in tip
    assert "in map" in tip
    tab.mouse.click(*middle(tab, "lidar"))
    tab.keyboard.down("Shift")
    tab.mouse.click(*middle(tab, "forearm_link"))
    tab.keyboard.up("Shift")
    assert tab.inner_text("#say") == "lidar seen from forearm_link"
    assert "source=lidar" in tab.url
    assert tab.input_value("#target") == "forearm_link"


def test_what_is_copied_reads_back_as_the_same_pose(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"), "target=map&source=tool")
    tab.evaluate("() => { window.copied = []; navigator.clipboard.writeText = async (text) => { window.copied.push(text); }; }")
    tab.click("#copy")
    tab.click("#shell")
    yaml, command = tab.evaluate("() => window.copied")
    tree = frametool.load(ROOT / "examples" / "robot.yaml")
    (pose,) = poses_in(yaml)
    assert (pose.name, pose.parent) == ("tool", "map")
    assert frametool.Transform.of(*pose.components).is_close(tree.lookup("map", "tool"), angle=1e-13, distance=1e-13)
    assert command == "frametool lookup examples/robot.yaml map tool"


def test_search_ticks_and_only_these_choose_what_is_drawn(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"))
    tab.keyboard.press("/")
    tab.keyboard.type("wheel")
    assert tab.inner_text("#list").split() == ["wheel_left_link", "wheel_right_link"]
    tab.click("#only")
    tab.evaluate("() => window.frameview.draw()")
    words = tab.evaluate("() => window.frameview.labels.placed.map((each) => each.words)")
    assert set(words) == {"wheel_left_link", "wheel_right_link"}
    tab.locator("#list input").first.uncheck()
    tab.evaluate("() => window.frameview.draw()")
    assert tab.evaluate("() => window.frameview.labels.placed.map((each) => each.words)") == ["wheel_right_link"]
    tab.fill("#find", "/^base_/")
    assert tab.inner_text("#list").split() == ["base_footprint", "base_link"]


def test_only_the_path_hides_the_rest(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml", target="base_link", source="tool", path_only=True))
    path = tab.inner_text("#way").split(" ← ")
    drawn = tab.evaluate("() => window.frameview.labels.placed.flatMap((each) => each.group.length)")
    assert path[0] == "base_link"
    assert sum(drawn) <= len(path)
    tab.click("#path")
    tab.evaluate("() => window.frameview.draw()")
    assert sum(tab.evaluate("() => window.frameview.labels.placed.map((each) => each.group.length)")) > len(path)


def test_time_goes_by_slider_by_steps_and_by_playing(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("drive.yaml"), "source=base_link&target=map&t=1.5")
    assert tab.inner_text("#clock") == "1.500000000 s"
    tab.locator("#slide").evaluate("(e) => { e.value = 0.25; e.dispatchEvent(new Event('input')); }")
    assert tab.inner_text("#clock") == "1.000000000 s"
    tab.locator("#view").focus()
    tab.keyboard.press(".")
    assert tab.inner_text("#clock") == "2.000000000 s"
    tab.keyboard.press(",")
    assert tab.inner_text("#clock") == "1.000000000 s"
    tab.select_option("#speed", "10")
    tab.locator("#view").focus()
    tab.keyboard.press("Space")
    tab.wait_for_function("() => document.getElementById('clock').textContent === '4.000000000 s'")
    assert tab.inner_text("#play") == "▶"


def test_keys_turn_zoom_and_switch(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"))
    tab.locator("#view").focus()
    before = tab.evaluate("() => ({...window.frameview.cam})")
    for key in ("ArrowLeft", "ArrowUp", "+", "a", "x"):
        tab.keyboard.press(key)
    after = tab.evaluate("() => ({...window.frameview.cam, axes: window.frameview.state.axes})")
    assert after["azimuth"] == pytest.approx(before["azimuth"] + 0.1)
    assert after["elevation"] == pytest.approx(before["elevation"] + 0.1)
    assert after["scale"] == pytest.approx(before["scale"] * 1.2)
    assert after["axes"] is False
    assert tab.input_value("#target") == "camera_optical"
    tab.keyboard.press("7")
    assert tab.evaluate("() => window.frameview.cam.elevation") == pytest.approx(math.pi / 2)
    tab.keyboard.press("?")
    assert "swap source and target" in tab.inner_text("#help")


def test_dragging_turns_and_the_wheel_zooms_at_the_pointer(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"))
    azimuth = tab.evaluate("() => window.frameview.cam.azimuth")
    tab.mouse.move(300, 500)
    tab.mouse.down()
    tab.mouse.move(400, 500, steps=8)
    tab.mouse.up()
    assert tab.evaluate("() => window.frameview.cam.azimuth") < azimuth
    tab.evaluate("() => window.frameview.draw()")
    x, y = middle(tab, "lidar")
    tab.mouse.move(x, y)
    tab.mouse.wheel(0, -300)
    tab.wait_for_timeout(100)
    tab.evaluate("() => window.frameview.draw()")
    assert middle(tab, "lidar") == pytest.approx((x, y), abs=1.0)


def test_a_tap_on_a_phone_chooses_a_frame(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("robot.yaml"), viewport={"width": 412, "height": 839}, has_touch=True, is_mobile=True)
    tab.touchscreen.tap(*middle(tab, "forearm_link"))
    assert tab.inner_text("#say") == "forearm_link seen from map"


def test_the_page_is_dark_where_the_system_is(page_of: MakePage, visit: Visit) -> None:
    path = page_of("robot.yaml")
    papers = [
        visit(path, fragment, color_scheme=scheme).evaluate("() => getComputedStyle(document.body).backgroundColor")
        for scheme, fragment in (("light", ""), ("dark", ""), ("light", "theme=dark"), ("dark", "theme=light"))
    ]
    assert papers == ["rgb(255, 255, 255)", "rgb(20, 23, 28)", "rgb(20, 23, 28)", "rgb(255, 255, 255)"]


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml"])
@pytest.mark.parametrize("width", [1280, 800])
def test_no_name_lies_over_another(page_of: MakePage, visit: Visit, name: str, width: int) -> None:
    tab = visit(page_of(name), viewport={"width": width, "height": 700})
    boxes = tab.evaluate("() => window.frameview.labels.placed.map((each) => each.box)")
    assert boxes
    for a, b in itertools.combinations(boxes, 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def test_what_moved_between_two_trees_is_listed(tmp_path: Path, visit: Visit) -> None:
    after, before = ("{frames: {map: {a: {xyz: [1, 0, 0]}, b: {xyz: [0, 2, 0]}}}}", "{frames: {map: {a: {xyz: [1, 0, 0.012], rpy_deg: [0, 0, 3]}, b: {xyz: [0, 2, 0]}}}}")
    for name, text in (("after", after), ("before", before)):
        (tmp_path / f"{name}.yaml").write_text(text)
    scenes = [FrameScene(frametool.load(tmp_path / f"{name}.yaml")) for name in ("after", "before")]
    path = tmp_path / "moved.html"
    path.write_text(write_page(scenes[0], title="after", other=scenes[1], other_title="before"))
    tab = visit(path)
    assert tab.locator("#list div").all_inner_texts() == ["map\n0 m 0°", "a\n1.2 cm 3°", "b\n0 m 0°"]
    tab.mouse.move(*middle(tab, "a"))
    tab.wait_for_selector("#tip:not([hidden])")
    assert "1.2 cm 3° from before" in tab.inner_text("#tip")
    tab.locator("#source").fill("a")
    tab.locator("#source").dispatch_event("change")
    tab.locator("#view").focus()
    tab.keyboard.press("x")
    tab.keyboard.press("v")
    assert tab.locator("#list div").all_inner_texts()[1] == "a\n0 m 0°"


def test_hostile_names_are_text(page_of: MakePage, visit: Visit) -> None:
    names = HOSTILE_NAMES
    tree = json.dumps({"frames": [{"name": "map"}, *({"name": name, "parent": "map", "xyz": [k, 1, 0]} for k, name in enumerate(names))]})
    tab = visit(page_of(tree))
    assert tab.evaluate("() => document.querySelectorAll('img, #list script').length") == 0
    assert tab.locator("#list span").all_text_contents() == ["map", *names]
    for name in names:
        tab.fill("#source", name)
        tab.locator("#source").dispatch_event("change")
        assert tab.locator("#say").text_content() == f"{name} seen from map"


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        ("{frames: {alone: }}", "alone seen from alone"),
        ("{frames: {a: {b: {xyz: [1, 0, 0]}}, c: }}", "b seen from a"),
        ("{frames: {a: {near: {xyz: [0.001, 0, 0]}, far: {xyz: [1000000000, 0, 0]}}}}", "near seen from a"),
        ("{frames: [{name: a}, {name: b, parent: a, samples: [{stamp: 1700000000.5, xyz: [1, 0, 0]}, {stamp: 1700000001.5}]}]}", "b seen from a at 1700000000.500000000"),
    ],
)
def test_one_frame_several_roots_huge_distances_and_late_stamps_are_drawn(page_of: MakePage, visit: Visit, tree: str, said: str) -> None:
    tab = visit(page_of(tree))
    assert tab.inner_text("#say") == said


def test_frames_without_a_way_between_them_say_so(page_of: MakePage, visit: Visit) -> None:
    tab = visit(page_of("{frames: {a: , c: }}"), "target=a&source=c")
    assert tab.inner_text("#say") == "c seen from a: not connected"


@NEEDS_CHROMIUM
@pytest.mark.parametrize("asked", [1, 2, 1_699_999_999_999_999_999, 1_700_000_000_123_456_788, 1_700_000_000_123_456_789])
def test_stamps_a_lifetime_apart_are_exact(page_of: MakePage, asked: int) -> None:
    samples = [(1, 1.0), (2, 2.0), (1_700_000_000_123_456_787, 3.0), (1_700_000_000_123_456_789, 4.0)]
    listed = ", ".join(f"{{stamp_ns: {stamp}, xyz: [{x}, 0, 0]}}" for stamp, x in samples)
    tree = f"{{frames: [{{name: a}}, {{name: b, parent: a, samples: [{listed}]}}]}}"
    second, rest = divmod(asked, 10**9)
    seen = browsers.seen_in_chromium(page_of(tree), f"target=a&source=b&t={second}.{rest:09}")
    assert f'id="clock">{second}.{rest:09} s<' in seen
    path = page_of(tree).parent / "tree.yaml"
    pose = json.loads(re.search('data-pose="([^"]*)"', seen)[1])  # type: ignore[index]
    assert pose == pytest.approx(frametool.load(path).lookup("a", "b", asked).components, rel=1e-15)


def test_a_time_without_data_is_named_with_what_there_is(page_of: MakePage, visit: Visit) -> None:
    samples = "samples: [{stamp: 0, xyz: [1, 0, 0]}, {stamp: 1, xyz: [2, 0, 0]}]"
    late = "samples: [{stamp: 2, xyz: [1, 0, 0]}, {stamp: 3, xyz: [2, 0, 0]}]"
    tree = f"{{frames: [{{name: a}}, {{name: b, parent: a, {samples}}}, {{name: c, parent: a, {late}}}]}}"
    tab = visit(page_of(tree), "target=a&source=b&t=2.5")
    assert "no data for a → b at 2.500000000; samples cover 0.000000000 .. 1.000000000 (1.5 s too late)" in tab.inner_text("#say")


def test_a_thousand_frames_are_ready_in_a_second_and_drawn_in_thirty_milliseconds(page_of: MakePage, visit: Visit) -> None:
    grid = [{"name": f"f{k}", "parent": f"f{(k - 1) // 3}" if k else "map", "xyz": [k % 7, k % 11, k % 5]} for k in range(1000)]
    tab = visit(page_of(json.dumps({"frames": [{"name": "map"}, *grid]})))
    assert len(tab.evaluate("() => window.frameview.labels.placed")) > 20
    assert tab.inner_text("#foot").startswith("1001 frames")
    assert tab.evaluate("() => window.frameview.labels.hidden") > 0


# --- the report of a comparison ---------------------------------------------------------------------------------------


GOLDEN = ROOT / "tests" / "golden" / "compare"


@pytest.fixture
def report_of(run: Callable[..., Any], tmp_path: Path) -> Callable[..., Path]:
    """Write the report of estimates against the first trajectory, of the examples or the goldens."""

    def write(*names: str, align: str = "sim3") -> Path:
        paths = [next(path for folder in (ROOT / "examples", GOLDEN) if (path := folder / name).exists()) for name in names]
        assert run("compare", *map(str, paths), "-o", "report.html", "--align", align, "--force").status == 0
        return tmp_path / "report.html"

    return write


def test_each_measure_of_the_text_is_a_row_of_the_report_with_its_meaning(report_of: Callable[..., Path], visit: Visit, run: Callable[..., Any]) -> None:
    names = ("drone-ref.tum", "drone-est.tum")
    tab = visit(report_of(*names, align="se3"))
    lines = run("compare", *(str(GOLDEN / name) for name in names)).out.splitlines()
    wanted = [line.replace("%", "").split() for line in lines if re.match(r"ate (m|deg)|rpe|  (along|across|up)", line)]
    rows = [row.locator("th, td").all_inner_texts() for row in tab.locator(".measures tr:has(th[data-tip])").all()]
    assert [" ".join(row).split() for row in rows[:-2]] == wanted
    assert [row[:2] for row in rows[-2:]] == [["kitti", ""], ["ate by fit", "m"]]
    assert min(map(len, tab.evaluate("[...document.querySelectorAll('[data-tip]')].map((each) => each.dataset.tip)"))) > 20
    tiles = [each.inner_text().split("\n") for each in tab.locator("#tiles div").all()]
    assert [[line for line in tile if line][:2] for tile in tiles] == [["ATE", "0.043 m"], ["RPE", "0.786 %"], ["Poses paired", "160"]]


@pytest.mark.parametrize(("names", "said"), [(("prism-ref.csv", "prism-est.tum"), "needs rotations"), (("truth.tum", "truth.tum"), "over 100m")])
def test_there_are_always_three_tiles(report_of: Callable[..., Path], visit: Visit, names: tuple[str, ...], said: str) -> None:
    tab = visit(report_of(*names, align="none"))
    assert tab.locator("#tiles div").count() == 3
    assert said in tab.locator("#tiles div").nth(1).inner_text()
    assert "not aligned" in tab.locator("#tiles div").first.inner_text()


def test_the_table_of_a_report_has_the_numbers_of_csv_and_marks_the_best(report_of: Callable[..., Path], visit: Visit, run: Callable[..., Any]) -> None:
    names = ("truth.tum", "odometry.tum", "mono.tum")
    tab = visit(report_of(*names))
    rows = tab.evaluate("[...document.querySelectorAll('#estimates tbody tr')].map((row) => [...row.cells].map((cell) => cell.dataset.value ?? cell.textContent))")
    csv = run("compare", *(str(ROOT / "examples" / name) for name in names), "--align", "sim3", "-f", "csv").out.splitlines()[1:]
    assert [[*map(float, row[1:])] for row in rows] == [[*map(float, line.split(",")[1:])] for line in csv]
    assert [row[0] for row in rows] == [line.split(",")[0] for line in csv]
    assert tab.locator("#estimates tr:nth-child(2) .best").count() == 8


def test_pointing_at_a_curve_marks_its_place_on_the_path(report_of: Callable[..., Path], visit: Visit) -> None:
    tab = visit(report_of("truth.tum", "odometry.tum"))
    (curve,) = json.loads(tab.locator("#samples").text_content())["curves"]
    at = max(range(len(curve["m"])), key=lambda each: curve["m"][each])
    for picture in ("errors", "path"):
        box, high = tab.locator(f"#{picture} svg").bounding_box(), tab.evaluate(f"document.querySelector('#{picture} svg').viewBox.baseVal.height")
        x, y = curve[picture][at]
        tab.mouse.move(box["x"] + x * box["height"] / high, box["y"] + y * box["height"] / high)
        assert tab.inner_text("#tip") == f"{curve['t'][at]:g} s   {curve['m'][at]:g} m   {curve['deg'][at]:g}°"
        for name in ("errors", "path"):
            mark = tab.locator(f"#{name} .mark")
            assert [float(mark.get_attribute(each)) for each in ("cx", "cy")] == curve[name][at]
    tab.mouse.move(1, 1)
    assert tab.locator("#tip").is_hidden()


def test_the_table_of_estimates_sorts_by_what_is_clicked(report_of: Callable[..., Path], visit: Visit) -> None:
    tab = visit(report_of("truth.tum", "odometry.tum", "mono.tum"))

    def names() -> list[str]:
        return [text.rsplit("/", 1)[-1] for text in tab.locator("#estimates tbody th").all_inner_texts()]

    orders = []
    for title in ("ate", "ate", "est"):
        tab.click(f"#estimates button:has-text('{title}') >> nth=0")
        orders.append(names())
    assert orders == [["mono.tum", "odometry.tum"], ["odometry.tum", "mono.tum"], ["mono.tum", "odometry.tum"]]


@pytest.mark.parametrize("names", [("truth.tum", "odometry.tum"), ("truth.tum", "odometry.tum", "mono.tum")])
def test_a_report_prints_on_one_page_and_fits_a_phone(report_of: Callable[..., Path], visit: Visit, names: tuple[str, ...]) -> None:
    path = report_of(*names)
    assert len(re.findall(rb"/Type /Page\b", visit(path).pdf(prefer_css_page_size=True))) == 1
    phone = visit(path, viewport={"width": 390, "height": 844})
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390
    dark = visit(path, color_scheme="dark").evaluate("getComputedStyle(document.body).backgroundColor")
    assert dark == "rgb(20, 23, 28)"
