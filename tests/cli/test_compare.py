"""`compare`, `align`, `resample` on the command line: what they print, refuse and end with."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import yaml

import frametool
from frametool.view.comparison_report import write_report

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from conftest import Outcome

    Run = Callable[..., Outcome]

GOLDEN = Path(__file__).parents[1] / "golden" / "compare"
FILES = {path.name: path.read_bytes() for path in GOLDEN.iterdir()}
DRONE = ("drone-ref.tum", "drone-est.tum")


def found(run: Run, *arguments: str, **more: Any) -> dict[str, Any]:
    done = run("compare", *arguments, "-f", "json", files=FILES, **more)
    assert done.status == 0, done.err
    return json.loads(done.out)  # type: ignore[no-any-return]


def test_the_pairs_come_first_and_the_text_holds_the_numbers(run: Run) -> None:
    done = run("compare", *DRONE, files=FILES)
    assert done.out.splitlines()[:6] == [
        "drone-ref.tum     reference: 450 poses, 8.980 s, 31.735 m",
        "drone-est.tum     160 of 160 poses paired (100 %), drone-ref.tum interpolated",
        "fit se3; ate m    none 18.837  origin 0.138  yaw 4.025  se3 0.043  sim3 0.029",
        "                      rmse      mean    median       p95       max",
        "ate m             0.042998  0.039549  0.039266  0.073505  0.095208",
        "ate deg           0.592264  0.548815  0.529096  0.896243  1.221841",
    ]
    assert "kitti             -  (31.7 m of path, 100 m asked)" in done.out
    assert (done.status, done.err) == (0, "")


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_every_setting_and_number_stands_in_an_object(run: Run, form: str) -> None:
    done = run("compare", *DRONE, "-f", form, files=FILES)
    each = json.loads(done.out) if form == "json" else yaml.safe_load(done.out)
    assert {"ref", "est", "settings", "poses", "duration_s", "path_m", "offset_s", "offset_score", "transform", "ate_by_alignment", "ate", "rpe", "kitti", "hints"} <= {*each}
    assert each["poses"] == {"ref": 450, "est": 160, "possible": 160, "paired": 160, "shared": 0}
    assert (each["settings"]["match"], each["settings"]["interpolated"], each["settings"]["max_gap_s"]) == ("interpolate", "ref", 0.06)
    assert each["kitti"] is None
    assert {*each["ate"]["m"]} == {"rmse", "mean", "median", "std", "min", "max", "sse", "p95"}


def test_positions_alone_have_no_angles_and_never_zeros(run: Run) -> None:
    each = found(run, "prism-ref.csv", "prism-est.tum")
    assert each["ate"]["deg"] is each["kitti"] is each["rpe"][0]["m"] is None
    assert each["ate_by_alignment"]["origin"] is None
    assert each["rpe"][0]["distance_m"]["rmse"] > 0
    assert "ate deg                  -" in run("compare", "prism-ref.csv", "prism-est.tum", files=FILES).out


def test_evo_does_the_same(run: Run) -> None:
    cases = json.loads((GOLDEN.parent / "compare.json").read_text())["cases"]
    wanted = next(case for case in cases if case["name"] == "drone")["evo"]
    each = found(run, *DRONE, "--as", "evo")
    ape, rpe = wanted["ape"][0], wanted["rpe"][0]
    assert each["ate"]["m"]["rmse"] == pytest.approx(ape["trans_part"]["rmse"], rel=1e-9)
    assert each["ate"]["rot"]["rmse"] == pytest.approx(ape["rot_part"]["rmse"], rel=1e-9)
    assert each["ate"]["full"]["rmse"] == pytest.approx(ape["full"]["rmse"], rel=1e-9)
    assert each["rpe"][0]["full"]["rmse"] == pytest.approx(rpe["full"]["rmse"], rel=1e-9)


def test_all_pairs_of_frames_are_exactly_so_many_frames_apart(run: Run) -> None:
    """The tolerance is one of distances and times: nine frames at the end are no ten."""
    rows = run("compare", *DRONE, "--delta", "20frames", "--all-pairs", "--rows=rpe", "-f", "csv", files=FILES).out
    assert len(rows.splitlines()) == 1 + 160 - 20


def test_clock_and_mount_are_found_and_told(run: Run) -> None:
    told = run("compare", "clock-ref.tum", "clock-est.tum", files=FILES).err
    assert re.search(r"the clock of clock-est.tum seems 0.25\d s behind \(score 0.99\d\); --offset auto", told)
    each = found(run, "clock-ref.tum", "clock-est.tum", "--offset", "auto")
    assert each["offset_s"] == pytest.approx(0.25, abs=1e-3)
    assert any("the bodies are 86.0 deg apart; --mount" in hint for hint in each["hints"])
    mount = re.search(r"--mount '(.*)'", " ".join(each["hints"]))
    assert mount is not None
    mounted = found(run, "clock-ref.tum", "clock-est.tum", "--offset", "auto", "--mount", mount[1])
    assert mounted["ate"]["deg"]["rmse"] < 1
    arm = found(run, "prism-ref.csv", "prism-est.tum", "--mount", "auto")["settings"]["mount"]["xyz"]
    assert arm == pytest.approx([-0.073693, -0.06452, -0.465915], abs=1e-6)


REFUSED = {
    ("drone-ref.tum", "clock-est.tum"): (1, "clock-est.tum: 0 of 182 poses have a partner in drone-ref.tum (0.0 %): drone-ref.tum 1700000000.000 .. 1700000008.980 s, clock-est.tum 1001.652 .. 1010.703 s; try --offset auto, --max-gap, --min-match 0"),
    ("line-ref.tum", "line-est.tum"): (1, "line-ref.tum lies on a line: the turn about it is free; --align yaw, origin or none"),
    ("kitti-ref.txt", "drone-est.tum"): (1, "kitti-ref.txt has no stamps; give them with --stamps FILE"),
    ("drone-ref.tum", "line-est.tum", "--offset", "auto"): (1, "no clear clock offset (score 0.19); give one: --offset T"),
    (*DRONE, "--delta", "5"): (2, "'5' is not a distance between poses; write a number with m, s, deg, frames"),
    (*DRONE, "--max-diff", "1ms"): (2, "--max-diff has no effect here"),
    (*DRONE, "--tolerance", "5%"): (2, "--tolerance needs --all-pairs"),
    (*DRONE, "--fail", "ate>1", "--delta", "x"): (2, "'x' is not a distance between poses"),
    (*DRONE, "--fail", "atee>1"): (2, "no number is called 'atee'; did you mean 'ate'?"),
    (*DRONE, "--fail", "kitti>1"): (2, "kitti>1: drone-est.tum has no such number; -f json shows those there are"),
    ("drone-ref.tum", "none.tum"): (5, "none.tum: no such file or directory"),
    ("-", "-"): (2, "standard input can be read once; only one argument may be -"),
    (*DRONE, "--start", "+20s"): (1, "no pair from 1700000020.505976832 to 1700000008.455779072 s; there are some in 1700000000.505 .. 1700000008.455 s"),
}  # fmt: skip


@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
def test_what_is_not_determined_is_refused_in_one_line(run: Run, arguments: tuple[str, ...]) -> None:
    status, message = REFUSED[arguments]
    done = run("compare", *arguments, files=FILES)
    assert (done.status, done.out) == (status, "")
    assert message in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("limits", "status"), [("ate<1cm,paired<90%", 0), ("ate>5cm", 0), ("ate>4cm", 1), ("rpe:1m>3%", 1), ("rpe:1m>1deg,ate.m.p95>=7cm", 1), ("paired<=160", 1)]
)
def test_limits_decide_the_exit_status(run: Run, limits: str, status: int) -> None:
    done = run("compare", *DRONE, "--fail", limits, files=FILES)
    assert done.status == status
    assert ("limit exceeded" in done.err) == (status == 1)


def test_trouble_is_no_limit_passed(run: Run) -> None:
    assert run("compare", "line-ref.tum", "line-est.tum", "--fail", "ate>1", files=FILES).status == 2


@pytest.mark.parametrize("form", ["text", "csv", "markdown", "latex"])
def test_several_estimates_are_a_table(run: Run, monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    lines = run("compare", "drone-ref.tum", "drone-est.tum", "handheld-est.tum", "-f", form, files=FILES).out.splitlines()
    names = [at for at, line in enumerate(lines) if "est.tum" in line]
    assert len(names) == 2
    rows = [lines[at + (form == "text")] for at in names]  # 80 columns hold the numbers, not the names beside them
    assert form != "text" or max(map(len, lines)) <= 80
    best = {"text": "0.043*", "csv": "0.0429975122", "markdown": "**0.043**", "latex": r"\textbf{0.043}"}[form]
    assert best in rows[0]


def test_rows_are_those_of_the_errors(run: Run) -> None:
    done = run("compare", *DRONE, "--rows", "-f", "json", files=FILES)
    rows = [json.loads(line) for line in done.out.splitlines()]
    errors = np.array([row["ate_m"] for row in rows])
    assert float(np.sqrt((errors**2).mean())) == pytest.approx(0.0429975122282, rel=1e-9)
    assert [row["stamp_ns"] for row in rows[:2]] == [1700000000505976832, 1700000000551459328]
    assert run("compare", *DRONE, "--rows=rpe", files=FILES).out.startswith("stamp_ns,end_ns,delta,m,deg,distance_m\n")
    assert run("compare", "kitti-ref.txt", "kitti-est.txt", "--rows=kitti", "--align", "none", files=FILES).out.startswith("stamp_ns,end_ns,length_m,percent,deg_per_m\n")


def test_any_way_to_name_a_trajectory_gives_the_same_numbers(run: Run) -> None:
    wanted = found(run, *DRONE)["ate"]
    piped = found(run, "drone-ref.tum", "-", stdin=FILES["drone-est.tum"])
    assert piped["ate"] == wanted
    tree = run("tree", "drone-est.tum", "-f", "yaml", "--frames", "odom,base", files=FILES).out
    files = FILES | {"est.yaml": tree}
    for name in ("est.yaml:odom:base", "est.yaml"):
        done = run("compare", "drone-ref.tum", name, "-f", "json", files=files)
        each = json.loads(done.out)
        assert each["ate"]["m"]["rmse"] == pytest.approx(wanted["m"]["rmse"], rel=1e-12)
        assert each["transform"]["name"] == "odom"
    rows = run("convert", "-i", "drone-est.tum", "-f", "csv", files=FILES).out
    assert json.loads(run("compare", "drone-ref.tum", "est.csv", "-f", "json", files=FILES | {"est.csv": rows}).out)["ate"] == wanted


def test_bad_rows_stop_or_are_skipped(run: Run) -> None:
    lines = FILES["drone-est.tum"].decode().splitlines(keepends=True)
    files = FILES | {"bad.tum": "".join([*lines[:3], "1700000000.7 1 2 x 0 0 0 1\n", *lines[3:]]).encode()}
    stopped = run("compare", "drone-ref.tum", "bad.tum", files=files)
    assert (stopped.status, stopped.out) == (1, "")
    assert "bad.tum:4:" in stopped.err
    skipped = run("compare", "drone-ref.tum", "bad.tum", "--on-error", "skip", files=files)
    assert skipped.status == 3
    assert "160 of 160 poses paired" in skipped.out


def test_order_and_equal_stamps_are_told(run: Run) -> None:
    lines = FILES["drone-est.tum"].decode().splitlines(keepends=True)
    files = FILES | {"odd.tum": "".join([lines[1], lines[0], *lines[1:]]).encode()}
    done = run("compare", "drone-ref.tum", "odd.tum", files=files)
    assert "odd.tum: stamps are out of order; sorted" in done.err
    assert "odd.tum: 1 pose has the stamp of another; the last counts" in done.err
    assert "160 of 160 poses paired" in done.out


@pytest.mark.parametrize("suffix", ["svg", "html"])
def test_a_report_is_one_file_that_asks_nothing(run: Run, tmp_path: Path, suffix: str) -> None:
    name = '<script>alert("x")</script>.tum'.replace("/", "_")
    files = FILES | {name: FILES["drone-est.tum"]}
    done = run("compare", "drone-ref.tum", name, "-o", f"report.{suffix}", files=files)
    assert (done.status, done.out) == (0, "")
    text = (tmp_path / f"report.{suffix}").read_text()
    assert len(text) < 300_000
    assert "<script>alert" not in text
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", text)
    if suffix == "html":
        assert "default-src 'none'" in text
        held = re.search(r'<script type="application/json" id="numbers">(.*?)</script>', text, re.DOTALL)
        assert held is not None
        assert json.loads(held[1])[0]["poses"]["paired"] == 160
        assert text.count("<script") == 3
    again = run("compare", "drone-ref.tum", name, "-o", f"report.{suffix}", files=files)
    assert again.status == 5


def report(run: Run, folder: Path, *arguments: str) -> str:
    """Return the page of a comparison."""
    assert run("compare", *arguments, "--report", "report.html", "--force", files=FILES).status == 0
    return (folder / "report.html").read_text()


def held_in(text: str, name: str) -> Any:
    """Read what a page holds as JSON."""
    return json.loads(re.search(f'<script type="application/json" id="{name}">(.*?)</script>', text, re.DOTALL)[1])  # type: ignore[index]


def test_a_report_says_what_was_compared_and_holds_the_numbers_of_json(run: Run, tmp_path: Path) -> None:
    text = report(run, tmp_path, *DRONE)
    assert "<h1>drone-est.tum against drone-ref.tum</h1>" in text
    assert re.search(r"<p>\d{4}-\d\d-\d\d \d\d:\d\d UTC, frametool [\d.]+</p>", text)
    assert re.search(r"<code>\$ frametool .*</code>", text)
    assert held_in(text, "numbers") == [found(run, *DRONE)]
    assert html.unescape(re.search("<noscript><pre>(.*?)</pre>", text, re.DOTALL)[1]) == run("compare", *DRONE, files=FILES).out  # type: ignore[index]


def test_the_path_of_a_report_has_equal_scales_and_axes_in_metres(run: Run, tmp_path: Path) -> None:
    path = re.search('<figure id="?path"?>(.*?)</figure>', report(run, tmp_path, *DRONE), re.DOTALL)[1]  # type: ignore[index]
    words = re.findall(r'<text class="[^"]*" x="([\d.]+)" y="([\d.]+)"[^>]*>([^<]*)</text>', path)
    assert {"y (m)", "z (m)", "reference", "estimate, by error"} <= {text for _, _, text in words}
    across = {float(text): float(x) for x, y, text in words if re.fullmatch(r"-?\d+", text) and float(x) > 60}
    down = {float(text): float(y) for x, y, text in words if re.fullmatch(r"-?\d+", text) and float(x) < 60}
    scales = [(max(at.values()) - min(at.values())) / (max(at) - min(at)) for at in (across, down)]
    assert scales[0] == pytest.approx(scales[1], rel=1e-3)


def test_errors_by_length_are_drawn_of_three_lengths_or_more(run: Run, tmp_path: Path) -> None:
    drawn = ["relative error (%)" in report(run, tmp_path, *names) for names in (DRONE, ("kitti-ref.txt", "kitti-est.txt"))]
    assert drawn == [False, True]


@pytest.mark.parametrize("names", [DRONE, (DRONE[0], DRONE[0]), ("prism-ref.csv", "prism-est.tum"), ("gaps-ref.csv", "gaps-est.tum")])
def test_nothing_is_drawn_beside_its_chart(run: Run, tmp_path: Path, names: tuple[str, str]) -> None:
    """Of the same path twice all errors are 0."""
    text = report(run, tmp_path, *names, *(["--align", "none"] if len(set(names)) == 1 else []))
    for figure in re.findall("<figure.*?</figure>", text, re.DOTALL):
        wide, high = map(float, re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', figure)[0])
        places = [(float(x), float(y)) for x, y in re.findall(r"[ML]([-\d.]+) ([-\d.]+)", figure)]
        assert all(0 <= x <= wide and 0 <= y <= high for x, y in places)


def test_a_report_of_several_has_a_box_each(run: Run, tmp_path: Path) -> None:
    text = report(run, tmp_path, "drone-ref.tum", "drone-est.tum", "drone-ref.tum")
    distribution = re.search('<figure id="?distribution"?>(.*?)</figure>', text, re.DOTALL)[1]  # type: ignore[index]
    assert distribution.count("<rect") == 2
    assert len(held_in(text, "samples")["curves"]) == 2


def test_a_report_of_many_poses_stays_small_and_keeps_the_extremes() -> None:
    generator = np.random.default_rng(3)
    way, noise = np.cumsum(generator.normal(0.0, 0.05, (100_000, 3)), 0), generator.normal(0.0, 0.1, (100_000, 3))
    noise[54_321] = 9.0
    turned = np.tile([0.0, 0.0, 0.0, 1.0], (100_000, 1))
    ref, est = (frametool.Trajectory(np.arange(100_000) * 10**9, xyz, turned) for xyz in (way, way + noise))
    text = write_report([frametool.compare(ref, est, align="none")], "html", "frametool compare")
    assert len(text) <= 400_000
    (curve,) = held_in(text, "samples")["curves"]
    assert max(zip(curve["m"], curve["t"], strict=True)) == (pytest.approx(9.0 * 3**0.5, rel=1e-3), 54_321)


def test_align_prints_an_entry_and_writes_the_whole_estimate(run: Run) -> None:
    done = run("align", "mono-ref.tum", "mono-est.tum", "--align", "sim3", "-o", "moved.tum", "-f", "tum", "--names", "map,slam", files=FILES)
    entry = yaml.safe_load(done.out)
    assert (entry["name"], entry["parent"]) == ("slam", "map")
    again = found_in(run, "mono-ref.tum", "moved.tum", "--align", "none")
    assert again["ate"]["m"]["rmse"] == pytest.approx(again["ate_by_alignment"]["sim3"], rel=1e-9)
    assert again["poses"]["est"] == FILES["mono-est.tum"].count(b"\n")
    assert run("tree", "entry.yaml", files={"entry.yaml": "frames:\n  map:\n    slam: {xyz: [1, 2, 3], scale: 2.0}\n"}).status == 1


def found_in(run: Run, *arguments: str) -> dict[str, Any]:
    return json.loads(run("compare", *arguments, "-f", "json").out)  # type: ignore[no-any-return]


def test_resampling_keeps_the_poses_there_are(run: Run) -> None:
    at = run("resample", "drone-ref.tum", "--at", "drone-ref.tum", "-f", "tum", files=FILES)
    assert [line.split()[1:4] for line in at.out.splitlines()] == [line.split()[1:4] for line in FILES["drone-ref.tum"].decode().splitlines()]
    rate = run("resample", "drone-ref.tum", "--rate", "10", "-f", "csv", files=FILES).out.splitlines()
    assert len(rate) == 1 + 90
    path = run("resample", "drone-ref.tum", "--every", "1m", "-f", "csv", files=FILES).out.splitlines()
    steps = np.linalg.norm(np.diff([[float(cell) for cell in row.split(",")[:3]] for row in path[1:]], axis=0), axis=1)
    assert (steps <= 1 + 1e-6).all()
    assert (steps > 0.8).all()
    gaps = run("resample", "gaps-ref.csv", "--rate", "20", files=FILES)
    assert "of gaps-ref.csv or in a gap and are left out" in gaps.err
    line = {"odo.csv": "t,x,y,z\n0,0,0,0\n5,1,0,0\n"}
    assert run("resample", "odo.csv", "--at", "9", files=line).err == "frametool: note: 1 of 1 times lies outside 0 .. 5 s of odo.csv and is left out\n"
    assert run("resample", "drone-ref.tum", files=FILES).status == 2


def test_the_python_face_gives_what_the_command_prints(run: Run, tmp_path: Path) -> None:
    wanted = found(run, *DRONE)
    ref, est = (frametool.load_trajectory(tmp_path / name) for name in DRONE)
    each = frametool.compare(ref, est, align="se3", deltas=("1m", "10m"))
    assert each.as_dict()["ate"] == wanted["ate"]
    assert float(np.sqrt((each.ate.m**2).mean())) == pytest.approx(wanted["ate"]["m"]["rmse"], rel=1e-12)
    aligned = frametool.align(ref, est)
    assert aligned.transform.xyz.tolist() == wanted["transform"]["xyz"]
    assert aligned.moved.size == est.size
    assert frametool.resample(ref, rate=10).size == 90
    shifted = frametool.Trajectory(est.stamps_ns, est.xyz, world="odom")
    assert frametool.compare(ref, shifted).ate.rad is None
    with pytest.raises(frametool.FrametoolError, match="integer nanoseconds"):
        frametool.compare(ref, frametool.Trajectory(est.stamps_ns / 1e9, est.xyz))
    with pytest.raises(TypeError, match="aling"):
        frametool.compare(ref, est, aling="yaw")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"align": "se2"}, "align 'se2' is not known; did you mean 'se3'?"),
        ({"match": "closest"}, "match 'closest' is not known; words: interpolate, nearest"),
        ({"mount": "antenna"}, "mount 'antenna' is not known; words: auto"),
        ({"like": "kitti"}, "like 'kitti' is not known; words: evo"),
        ({"offset": "soon"}, "'soon' is not a time"),
        ({"offset": float("nan")}, "'nan' is not a time"),
    ],
)
def test_words_that_no_setting_has_are_refused_in_python(tmp_path: Path, settings: dict[str, Any], message: str) -> None:
    ref, est = ((tmp_path / name, (tmp_path / name).write_bytes(FILES[name]))[0] for name in DRONE)
    with pytest.raises(frametool.FrametoolError, match=re.escape(message)):
        frametool.compare(ref, est, **settings)


def test_settings_in_python_are_what_the_options_are(tmp_path: Path) -> None:
    ref, est = ((tmp_path / name, (tmp_path / name).write_bytes(FILES[name]))[0] for name in DRONE)
    each, same = (frametool.compare(ref, est, **given) for given in ({"offset": "20ms", "deltas": "2m"}, {"offset": 0.02, "deltas": ["2m"]}))
    assert each.as_dict() == same.as_dict()
    for given in ({"rate": 0}, {"rate": -2}, {"rate": float("inf")}, {"at": [0.5]}):
        with pytest.raises(frametool.FrametoolError):
            frametool.resample(ref, **given)
    with pytest.raises(frametool.FrametoolError, match="did you mean 'tum'"):
        frametool.load_trajectory(ref, format="tumm")
    with pytest.raises(frametool.FrametoolError, match="camera_axes is optical or opengl"):
        frametool.load_trajectory(ref, camera_axes="opencv")


def test_view_draws_the_path_coloured_by_time_and_several_side_by_side(run: Run, tmp_path: Path) -> None:
    files = {name: FILES[name] for name in DRONE}
    done = run("view", "drone-ref.tum", "--with", "drone-est.tum", "--frames", "world,ref", "--frames", "world,est", "-o", "paths.svg", files=files)
    assert done.status == 0
    text = (tmp_path / "paths.svg").read_text()
    for name in ("ref", "est"):
        shades = re.findall(rf'<path stroke="(#\w{{6}})"[^>]*><title>{name}</title>', text)
        assert len(shades) >= 20
        assert len(set(shades)) == len(shades)


def test_a_report_is_replaced_with_force_alone(run: Run) -> None:
    arguments = ("compare", *DRONE, "--report", "error.svg")
    assert run(*arguments, files=FILES).status == 0
    assert run(*arguments, files=FILES).status == 5
    assert run(*arguments, "--force", files=FILES).status == 0


def test_records_with_stamps_are_a_trajectory(run: Run) -> None:
    wanted = found(run, *DRONE)["ate"]
    lines = run("convert", "-i", "drone-est.tum", "-f", "json", files=FILES).out
    files = FILES | {"est.jsonl": lines}
    assert json.loads(run("compare", "drone-ref.tum", "est.jsonl", "-f", "json", files=files).out)["ate"] == wanted
    points = "".join(json.dumps({"stamp_ns": each["stamp_ns"], "point": each["xyz"]}) + "\n" for each in map(json.loads, lines.splitlines()))
    alone = json.loads(run("compare", "drone-ref.tum", "-", "-f", "json", stdin=points, files=FILES).out)["ate"]
    assert (alone["m"], alone["deg"]) == (wanted["m"], None)
    mixed = lines + '{"xyz": [1, 2, 3]}\n'
    assert "some poses have a stamp and some have none" in run("compare", "drone-ref.tum", "-", stdin=mixed, files=FILES).err


@pytest.mark.parametrize("name", ["e.tum", "est-" + "by-some-slam-" * 3 + "in-may.tum"])
def test_text_fits_eighty_columns_whatever_files_are_called(run: Run, name: str) -> None:
    files = {f"ref-{name}": FILES["drone-ref.tum"], name: FILES["drone-est.tum"]}
    lines = run("compare", f"ref-{name}", name, files=files).out.splitlines()
    assert max(map(len, lines)) <= 80
    assert any(line.startswith(name) for line in lines)


MONO = ("mono-ref.tum", "mono-est.tum")


def test_origin_and_scale_are_those_of_evo(run: Run) -> None:
    """evo 1.38.1: evo_ape tum mono-ref.tum mono-est.tum --correct_scale --align_origin."""
    each = found(run, *MONO, "--align", "origin+scale", "--as", "evo")
    assert each["ate"]["m"]["rmse"] == pytest.approx(0.03275968068181095, rel=1e-12)
    assert each["transform"]["scale"] == pytest.approx(2.7023720167395764, rel=1e-12)
    assert run("compare", *MONO, "--align", "origin+scale", files=FILES).out.splitlines()[2].startswith("fit origin+scale; ate m none ")
    assert "needs rotations of both" in run("compare", "prism-ref.csv", "prism-est.tum", "--align", "origin+scale", files=FILES).err


@pytest.mark.parametrize("align", ["se3", "sim3", "yaw"])
def test_a_fit_with_the_first_position_tied_is_the_best_of_those_that_keep_it(run: Run, align: str) -> None:
    from scipy.optimize import minimize
    from scipy.spatial.transform import Rotation

    arguments = ("compare", *MONO, "--align", align, "--tie-first", "--rows")
    done = run(*arguments, "-f", "json", files=FILES)
    errors = [json.loads(line)["ate_m"] for line in done.out.splitlines()]
    assert errors[0] == pytest.approx(0.0, abs=1e-9)
    ref, est = (frametool.load_trajectory(GOLDEN / name) for name in MONO)
    pairs = frametool.resample(ref, at=est.stamps_ns)
    r, e = (each.xyz - each.xyz[0] for each in (pairs, est))

    def cost(x: Any) -> Any:
        turn = Rotation.from_rotvec([0, 0, x[0]] if align == "yaw" else x[:3])
        return ((turn.apply(e) * (np.exp(x[3]) if align == "sim3" else 1.0) - r) ** 2).sum()

    entry = found(run, *MONO, "--align", align, "--tie-first")["transform"]
    turn = Rotation.from_quat([*entry["quaternion"].values()]).as_rotvec()
    start = [turn[2], 0, 0, 0] if align == "yaw" else [*turn, np.log(entry.get("scale", 1.0))]
    best = minimize(cost, np.array(start) + 1e-3, tol=1e-14).fun
    assert sum(error**2 for error in errors) == pytest.approx(best, rel=1e-6)


def test_the_span_has_the_same_options_everywhere(run: Run) -> None:
    first = frametool.load_trajectory(GOLDEN / DRONE[0]).stamps_ns[0] / 1e9
    span = ("--start", f"{first + 2:.6f}", "--stop", f"{first + 3:.6f}")
    for command in (("compare", *DRONE, "--rows"), ("resample", DRONE[0], "--rate", "20")):
        lines = run(*command, *span, "-f", "json", files=FILES).out.splitlines()
        rows = [json.loads(line)["stamp_ns"] / 1e9 for line in lines]
        assert (len(rows) > 10, min(rows) >= first + 2 - 1e-6, max(rows) <= first + 3 + 1e-6) == (True, True, True)
    assert run("resample", "kitti-ref.txt", "--every", "1m", *span, files=FILES).status == 2


@pytest.mark.parametrize("suffix", ["mcap", "bag"])
def test_a_recording_with_one_trajectory_is_that_trajectory(run: Run, tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("rosbags")
    bag = str(tmp_path / f"ref.{suffix}")
    assert run("convert", "-i", DRONE[0], "-o", bag, files=FILES).status == 0
    wanted = found(run, *DRONE)["ate"]
    assert found(run, bag, DRONE[1])["ate"] == found(run, f"{bag}:/pose", DRONE[1])["ate"] == wanted


@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize("align", ["none", "origin", "yaw"])
def test_few_poses_are_compared_where_nothing_has_to_be_fitted_to_a_line(run: Run, rows: int, align: str) -> None:
    text = "".join(f"{at} {at} 0 0 0 0 0 1\n" for at in range(rows))
    done = run("compare", "a.tum", "b.tum", "--align", align, files={"a.tum": text, "b.tum": text})
    assert (done.status, "Traceback" in done.err) == (int(align == "yaw" and rows == 1), False)


def test_what_cannot_be_written_is_refused_in_one_line(run: Run) -> None:
    done = run("compare", *DRONE, "--rows", "-f", "markdown", files=FILES)
    assert (done.status, "--rows are written as csv, json or yaml, not as markdown" in done.err) == (2, True)
    listed = run("calc", "row.x", "-i", "images.txt", files={"images.txt": "1 1 0 0 0 1 2 3 1 a.png\n\n"})
    assert (listed.status, "columns added to the rows of colmap; convert it to csv first" in listed.err) == (2, True)


@pytest.mark.parametrize("form", ["csv", "json", "yaml"])
def test_poses_of_several_bodies_are_no_trajectory_in_any_form(run: Run, form: str) -> None:
    rows = "".join(f"{at},{name},{at},0,{name == 'b':d},0,0,0,1\n" for at in range(4) for name in "ab")
    files = {"two": run("convert", "-f", form, stdin=f"t,name,x,y,z,qx,qy,qz,qw\n{rows}").out}
    done = run("resample", "two", "--rate", "1", files=files)
    told = "two: poses of several frames (world:a, world:b ..); name one: two:TARGET:SOURCE"
    assert (done.status, done.out, done.err) == (1, "", f"frametool: {told}\n")


def at_seconds(positions: Sequence[Sequence[float]], line: Callable[[int, Sequence[float]], str]) -> str:
    return "".join(line(second, each) + "\n" for second, each in enumerate(positions, 1))


def header_at(second: int) -> dict[str, Any]:
    return {"stamp": {"sec": second, "nanosec": 0}, "frame_id": "gps"}


@pytest.mark.parametrize("beside", ["sigma_x", ",".join(f"c{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))])
@pytest.mark.parametrize("form", ["csv", "parquet", "json"])
def test_positions_with_a_covariance_have_no_rotation(run: Run, beside: str, form: str) -> None:
    """Its numbers are not those of a quaternion."""
    cells = "0.5" if beside == "sigma_x" else "1,0,0,0,1,0,0,0,1"
    table = f"t,x,y,z,{beside}\n" + at_seconds([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)], lambda t, p: f"{t},{p[0]},{p[1]},{p[2]},{cells}")
    if form != "csv":
        assert run("convert", "-o", f"walk.{form}", stdin=table).status == 0
    files = {"walk.csv": table} if form == "csv" else {}
    assert run("resample", f"walk.{form}", "--rate", "1", "-f", "csv", files=files).out.splitlines()[:2] == ["x,y,z,stamp_ns", "0.0,0.0,0.0,1000000000"]
    found = json.loads(run("compare", f"walk.{form}", f"walk.{form}", "-f", "json").out)
    assert (found["ate"]["m"]["max"] < 1e-12, found["ate"]["deg"]) == (True, None)


def test_messages_of_positions_are_trajectories(run: Run) -> None:
    """NavSatFix and PointStamped, echoed as YAML, as JSON lines, as CSV, or recorded."""
    walk = [(0.0, 0.0, 0.0), (10.0, 0.0, 1.0), (10.0, 5.0, 2.0), (15.0, 15.0, 0.0)]
    points = at_seconds(walk, lambda t, p: json.dumps({"header": header_at(t), "point": dict(zip("xyz", p, strict=True))}))
    enu = "t,east,north,up\n" + at_seconds(walk, lambda t, p: f"{t},{p[0]},{p[1]},{p[2]}")
    lla = [[float(each) for each in row.split(",")[1:]] for row in run("convert", "--to", "lla", "--origin", "48,11,500", stdin=enu).out.splitlines()[1:]]
    fixes = at_seconds(lla, lambda t, p: json.dumps({"header": header_at(t), "status": {"status": 0, "service": 1}, "latitude": p[0], "longitude": p[1], "altitude": p[2], "position_covariance": [1, 0, 0, 0, 1, 0, 0, 0, 1], "position_covariance_type": 2}))
    titles = ",".join(f"field.position_covariance{at}" for at in range(9))
    printed = f"%time,field.header.stamp,field.latitude,field.longitude,field.altitude,{titles}\n" + at_seconds(lla, lambda t, p: f"{t}000000000,{t}000000000,{p[0]},{p[1]},{p[2]},1,0,0,0,1,0,0,0,1")
    files = {"walk.csv": "t,x,y,z\n" + at_seconds(walk, lambda t, p: f"{t},{p[0]},{p[1]},{p[2]}"), "points.jsonl": points, "fixes.jsonl": fixes, "fixes.csv": printed}
    for name in ("points", "fixes"):
        files[f"{name}.yaml"] = "".join(f"{yaml.safe_dump(json.loads(line), sort_keys=False)}---\n" for line in files[f"{name}.jsonl"].splitlines())
        assert run("convert", "-i", f"{name}.jsonl", "-o", f"{name}.mcap", files=files).status == 0
    for name in (*list(files)[1:], "points.mcap", "fixes.mcap", "fixes.mcap:/fix"):
        done = run("compare", "walk.csv", name, "--max-gap", "5s", "-f", "json", files=files)
        assert done.status == 0, done.err
        found = json.loads(done.out)
        assert found["poses"]["paired"] == 4
        assert found["ate"]["m"]["max"] < 1e-8
        assert found["ate"]["deg"] is None
