"""Leader files, Twist streams and scenes: what is read, and where mistakes are found."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING

import pytest
import yaml

from frametool.documents.source import Source
from frametool.errors import FormatError
from frametool.grammar.result import Style
from frametool.sim.scene import Follow, read_commands, read_scene, read_script, tutorial
from frametool.sim.simulate import EMITS, SHORT, RunSummary, simulate, step_writer
from frametool.sim.turtle import CENTRE, KEYS, FollowController, Twist, scripted

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SECOND = 1_000_000_000
EXPECTED = [(0, Twist(2.0, 0.0)), (SECOND // 2, Twist(0.0, -1.5))]
ECHO = "linear:\n  x: 2.0\n  y: 0.0\n  z: 0.0\nangular:\n  x: 0.0\n  y: 0.0\n  z: 1.8\n---\n"


@pytest.mark.parametrize(
    "text",
    [
        "t,linear,angular\n0,2,0\n0.5,0,-1.5\n",
        't,linear,angular\n# a comment may hold one "\n0,2,0\n0.5,0,-1.5\n',
        "# made by hand\n\nangular, turtle, linear, t\r\n0,a b,2,0\r\n# more\r\n-1.5,,0,0.5",
        "t,turtle,linear_x,angular_z,distance\n0,a,2,0,\n500000000ns,a,0,-1.5,",
        "- {t: 0, linear: 2, angular: 0}\n- {t: 0.5, linear: 0, angular: -1.5}\n",
        "$ ros2 topic echo /turtle1/cmd_vel\nt: 0\nlinear: 2\n---\nt: 0.5\nangular: -1.5\n$ exit\n",
        "$ cat leader.csv\nt,linear,angular\n0,2,0\n0.5,0,-1.5\n",
        '{"t": 0, "linear": 2}\n{"t": 0.5, "angular": -1.5}\n',
        '[{"t": 0, "linear": 2}, {"t": 0.5, "angular": {"z": -1.5}}]',
        '[\n {"t": 0, "linear": [2, 0, 0]},\n {"t": 0.5, "angular": -1.5}\n]\n',
        "t: 0\nlinear: {x: 2}\n---\n---\nt: 0.5\nturtle: turtle1\nangular: {z: -1.5}\n---\n",
        "--- {t: 0, linear: 2}\n--- {t: 0.5, angular: -1.5}\n",
    ],
)
def test_a_leader_file_is_read_in_any_form(text: str) -> None:
    assert read_script(Source("leader", text)) == EXPECTED


def test_twist_messages_and_keys_follow_one_another_a_period_apart() -> None:
    commands = list(read_commands((ECHO + "up\nLEFT\n" + ECHO).splitlines(keepends=True), "stdin"))
    assert commands == [
        (0, Twist(2.0, 1.8)), (SECOND, KEYS["up"]), (2 * SECOND, KEYS["left"]), (3 * SECOND, Twist(2.0, 1.8)),
    ]  # fmt: skip


def test_a_stream_is_read_one_command_at_a_time() -> None:
    def lines() -> Iterator[str]:
        yield "up\n"
        raise AssertionError("read ahead")

    assert next(read_commands(lines(), "stdin")) == (0, KEYS["up"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "bad:1: no commands in it"),
        ("t,linear,angular\n", "bad:1: no commands in it"),
        ("t,linear,angular\n0,1,0\n1,foo,0\n", "bad:3:3: 'foo' is not a number"),
        ("t,linear,angular\n0,1\n", "bad:2:1: expected 3 cells, found 2"),
        ("t,linear,angular\n1,1,0\n0.5,1,0\n", "bad:3:1: t 0.500000000 comes after 1.000000000"),
        ("t,linear,angular\n-1,1,0\n", "bad:2:1: -1 s is before the start"),
        ("t,linear,angular\n0,nan,0\n", "bad:2:3: 'nan' is not finite"),
        ("t,lin,angular\n", "bad:1:1: no column linear; columns: t, lin, angular"),
        ("t,linear,angular,linear_x\n", "bad:1:18: two columns for linear"),
        ("0,1,0\n", "bad:1:1: no column t, linear, angular"),
        ("t,linear,angular,linearx\n", "bad:1:18: unknown column 'linearx'; did you mean 'linear_x'?"),
        ("5\n", "bad:1:1: expected a command {t: 0.5, linear: 2.0, angular: 0.0}, a Twist message, or a key"),
        ("$ cat x\n- {t: 1, linar: 1}\n", "bad:2:10: unknown key 'linar'"),
        ("- {t: 1, linear: 1}\n- {t: 0, linear: 1}\n", "bad:2:7: t 0.000000000 comes after"),
        ("- {t: 1, linar: 1}\n", "bad:1:10: unknown key 'linar'; did you mean 'linear'?"),
        ("- {t: 1}\n", "bad:1:3: neither linear nor angular"),
        (ECHO + "linear: {x: .inf}\n", "bad:10:13: '.inf' is not finite"),
        (ECHO + "linear: {x: 1\n---\n", "bad:1"),
        ("up\ndwon\n", "bad:2:1: unknown key 'dwon'; did you mean 'down'?"),
        ('{"t": 0, "linear": 1}\n{"t": 1, "linear": 1e999}\n', "bad:2:20: '1e999' is not finite"),
        ("t,turtle,linear,angular\n0,a,1,0\n1,b,1,0\n", "bad:3:1: commands of 'a' and 'b'; a leader takes those of one"),
        ("- {turtle: a, linear: 1}\n- {turtle: b, linear: 1}\n", "bad:1:1: commands of 'a' and 'b'"),
    ],
)
def test_a_mistake_in_a_leader_is_placed(text: str, message: str) -> None:
    with pytest.raises(FormatError) as caught:
        read_script(Source("bad", text))
    assert str(caught.value).startswith(message)


# --- scenes --------------------------------------------------------------------------------------------------------

SCENE = """\
duration: 2.5
turtlesim: ros2
holonomic: true
turtles:
  turtle1: {leader: [{t: 0, linear: 1, angular: 0}]}
  b: {spawn: [1, 2, 90deg], follow: turtle1, law: ros2, rate: 5, max_linear: 1, target: carrot, delay: 0.5}
  c: {spawn: [3, 4]}
events:
  - {t: 1, kill: c}
  - {t: 1.5, spawn: {x: 1, y: 1, theta: pi, name: d}}
  - {t: 2, set_pen: {turtle: b, r: 255, off: true}}
  - {t: 2, clear: }
"""


def test_a_scene_is_read() -> None:
    scene = read_scene(Source("scene.yaml", SCENE))
    follow = scene.followers["b"]
    assert (scene.duration_ns, scene.variant, scene.holonomic) == (2_500_000_000, "ros2", True)
    assert [actor.spawn for actor in scene.turtles] == [
        (CENTRE, CENTRE, 0.0), pytest.approx((1.0, 2.0, 1.5707963267948966)), (3.0, 4.0, 0.0),
    ]  # fmt: skip
    assert (follow.leader, follow.target, follow.delay_ns) == ("turtle1", "carrot", SECOND // 2)
    assert (follow.controller.rate, follow.controller.gain_angular, follow.controller.max_linear) == (5.0, 1.0, 1.0)
    assert [(call.t_ns, call.service) for call in scene.calls][:2] == [(SECOND, "kill"), (1_500_000_000, "spawn")]
    assert scene.calls[2].arguments == {"turtle": "b", "r": 255.0, "off": 1.0}


def test_a_scene_is_run() -> None:
    steps = [step for step in simulate(read_scene(Source("scene.yaml", SCENE))) if step.is_tick]
    assert [[*step.poses] for step in (steps[0], steps[-1])] == [["b", "c", "turtle1"], ["b", "d", "turtle1"]]
    assert steps[-1].pens["b"].off
    assert steps[-1].clears == 1


def test_a_leader_file_beside_the_scene_is_read(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("t,linear,angular\n0,1,0\n")
    text = '{"turtles": {"a": {"leader": "way.csv"}, "b": {"follow": "a"}}, "duration": "inf"}'
    scene = read_scene(Source(str(tmp_path / "scene.json"), text))
    steps = simulate(scene)
    assert scene.duration_ns is None
    assert next(steps).led[0].twist == Twist(1.0, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "s.yaml:1:1: expected one scene, found 0"),
        ("turtles: {a: }\n---\nturtles: {a: }\n", "s.yaml:1:1: expected one scene, found 2"),
        ("frames: {}\n", "s.yaml:1:1: unknown key 'frames'"),
        ("duration: 1\n", "s.yaml:1:1: no turtles"),
        ("duration: -1\nturtles: {a: }\n", "s.yaml:1:11: -1 s is before the start"),
        ("turtles:\n  a: {leader: squar}\n", "s.yaml:2:15: no file squar and no leader 'squar'; did you mean 'square'?"),
        ("turtles:\n  a: {folow: b}\n", "s.yaml:2:7: unknown key 'folow'; did you mean 'follow'?"),
        ("turtles:\n  a: {follow: a}\n", "s.yaml:2:15: a cannot follow itself"),
        ("turtles:\n  a: {follow: a, leader: still}\n", "s.yaml:2:18: a turtle has a leader script or follows"),
        ("turtles:\n  a: {law: ros1}\n", "s.yaml:2:7: law says how to follow; add follow: NAME"),
        ("turtles:\n  a:\n  b: {follow: a, law: ros3}\n", "s.yaml:3:23: unknown 'ros3'; did you mean"),
        ("turtles:\n  a:\n  b: {follow: a, rate: 0}\n", "s.yaml:3:24: a rate of 0 Hz has no steps"),
        ("turtles:\n  a: {spawn: [1, x]}\n", "s.yaml:2:18: 'x' is not a number"),
        ("turtles:\n  a: {spawn: 3}\n", "s.yaml:2:14: expected [x, y, theta], found '3'"),
        ("turtles:\n  a:\n  a:\n", "s.yaml:3:3: key 'a' appears twice"),
        ("turtles:\n  world:\n", "s.yaml:2:3: a turtle cannot be called 'world'"),
        ("turtles: {a: }\nevents:\n- {t: 1, fly: }\n", "s.yaml:3:10: unknown key 'fly'"),
        ("turtles: {a: }\nevents:\n- {t: 1}\n", "s.yaml:3:3: an event has t and one of spawn"),
        ("turtles: {a: }\nevents:\n- {t: 1, spawn: {x: 1}}\n", "s.yaml:3:17: spawn needs y"),
        ("turtles: {a: }\nevents:\n- {t: x, kill: a}\n", "s.yaml:3:7: 'x' is not a time"),
        ("turtles: {a: }\nevents:\n- {t: 1, set_pen: {turtle: a, r: 300}}\n", "s.yaml:3:34: expected a whole number 0 .. 255"),
        ("turtles: {a: }\nevents:\n- {t: 1, set_pen: {turtle: a, g: -4}}\n", "s.yaml:3:34: expected a whole number 0 .. 255"),
        ("turtles: {a: }\nevents:\n- {t: 1, set_pen: {turtle: a, width: 1e9}}\n", "s.yaml:3:38: expected a whole number"),
        ("turtles: {a: }\nseed: 1.5\n", "s.yaml:2:7: expected a whole number"),
    ],
)
def test_a_mistake_in_a_scene_is_placed(text: str, message: str) -> None:
    with pytest.raises(FormatError) as caught:
        read_scene(Source("s.yaml", text))
    assert str(caught.value).startswith(message)


# --- what is written -----------------------------------------------------------------------------------------------


def written(emit: str, form: str) -> str:
    """Return a short run as text."""
    records = step_writer(emit, Style(form))
    return "".join(text for step in simulate(tutorial(leader="circle", duration=0.2)) for text in records(step))


@pytest.mark.parametrize("emit", EMITS)
def test_yaml_and_json_say_the_same(emit: str) -> None:
    documents = [each for each in yaml.load_all(written(emit, "yaml"), yaml.CSafeLoader) if each]
    objects = [yaml.safe_load(line) for line in written(emit, "json").splitlines()]
    assert [{key: each[key] for key in document} for each, document in zip(objects, documents, strict=True)] == documents


def test_a_message_of_several_turtles_says_whose_it_is() -> None:
    records = step_writer("commands", Style("yaml"), labelled=True)
    texts = [text for step in simulate(tutorial(followers=2, duration=0.0)) for text in records(step)]
    assert [text.splitlines()[0] for text in filter(None, texts)] == ["# turtle2 at 0.0 s", "# turtle3 at 0.0 s"]
    assert len(read_script(Source("commands", "".join(texts)))) == 2


@pytest.mark.parametrize("emit", ["commands", "poses"])
def test_text_and_csv_have_the_same_columns_and_rows(emit: str) -> None:
    text, csv = (written(emit, form).splitlines() for form in ("text", "csv"))
    assert text[0].split() == [SHORT.get(name, name) for name in csv[0].split(",")]
    assert len(text) == len(csv)
    assert max(map(len, text)) <= 80
    for short, exact in zip(text[1:], csv[1:], strict=True):
        assert [float(cell) for cell in short.split()[2:]] == pytest.approx([*map(float, exact.split(",")[2:])], abs=0.00051)


def test_a_leader_reads_what_a_follower_commanded() -> None:
    given = [each for step in simulate(tutorial(duration=0.2)) for each in step.commands]
    expected = [(each.t_ns, each.twist) for each in given]
    for form in ("json", "csv"):
        records = step_writer("commands", Style(form))
        text = "".join(part for step in simulate(tutorial(duration=0.2)) for part in records(step))
        assert read_script(Source("commands", text)) == expected


@pytest.mark.parametrize("name", ["a,b", 'a"b', "a\nb", " a", "world,"])
def test_a_turtles_name_is_quoted_in_csv_where_a_reader_would_split_it(name: str) -> None:
    scene = tutorial(duration=0.2)
    turtles = [scene.turtles[0], scene.turtles[1]._replace(name=name)]
    steps = list(simulate(scene._replace(turtles=turtles)))
    records = step_writer("commands", Style("csv"))
    text = "".join(part for step in steps for part in records(step))
    rows = list(csv.reader(text.splitlines(keepends=True)))
    assert {len(row) for row in rows} == {10 + 1}
    assert {row[1] for row in rows[1:]} == {name}
    assert read_script(Source("commands", text)) == [(each.t_ns, each.twist) for step in steps for each in step.commands]


def test_a_name_with_control_characters_reaches_no_terminal_raw() -> None:
    scene = tutorial(followers=1, duration=2.0, leader=scripted([(0, Twist(30.0, 0.0))]))
    leader, follower = scene.turtles
    names = [leader._replace(name="a\x1b[31m"), follower._replace(name="b\n\x07", driver=Follow("a\x1b[31m", FollowController()))]
    scene = scene._replace(turtles=names)
    summary, texts = RunSummary(scene), []
    writers = [step_writer("commands", Style(form), labelled=True) for form in ("text", "yaml")]
    for step in simulate(scene):
        summary.watch(step)
        texts += [text for records in writers for text in records(step)]
        texts += map(str, step.walls)
    shown = "".join([*texts, *summary.lines()])
    assert "a\\x1b[31m" in shown
    assert not {"\x1b", "\x07"} & set(shown)
    assert all(text.startswith("# b\\n\\x07 at ") for text in texts if text.startswith("#"))
