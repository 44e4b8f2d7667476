"""Documents as deep as allowed: every command reads them or refuses them in a line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

POSE = '{"name": "a", "parent": "m", "xyz": [1, 2, 3]}'
DEEP = {
    "lists": "- " * 990 + "1\n",
    "lists around a message": "- " * 980 + "{header: {frame_id: a}, child_frame_id: b}\n",
    "envelopes": '{"op":"publish","msg":' * 900 + '{"transforms":[]}' + "}" * 900 + "\n",
    "a key beside a point": '{"point":[1,2,3],"z":' + '{"a":' * 980 + "1" + "}" * 980 + "}\n",
    "a key beside a message": "{header: {frame_id: a}, point: {x: 1, y: 2, z: 3}, z: " + "{a: " * 980 + "1" + "}" * 980 + "}\n",
    "a tree": "frames: {r: {f0: "
    + "".join(f"{{xyz: [1, 0, 0], children: {{f{at}: " for at in range(1, 325))
    + "{xyz: [1, 0, 0]}"
    + "}}" * 324
    + "}}\n",
}
COMMANDS = (
    "tree in", "tree in -f json", "check in", "monitor in", "lookup in r f300", "echo in r f300 -l 1", "static in",
    "invert in", "invert in -f json", "invert -i in", "convert in", "compose in in", "sim run in",
    *(f"apply POSE m a -i in -f {form}" for form in ("json", "yaml", "ros1", "ros2")),
)  # fmt: skip


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", DEEP)
def test_every_command_takes_the_deepest_document_or_refuses_it_in_a_line(name: str, run: Callable[..., Any]) -> None:
    for command in COMMANDS:
        outcome = run(*(POSE if word == "POSE" else word for word in command.split()), files={"in": DEEP[name]})
        assert outcome.status <= 5
        assert "Traceback" not in outcome.err
