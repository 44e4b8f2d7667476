"""Records of many keys: no expression is made of them, and what becomes of them is the same."""

from __future__ import annotations

import pytest
from flow import MOVE, Flow, convert, flow

from frametool.stream import template
from frametool.stream.template import Template

SHORT = {
    "json": '{"xyz": [%d, 2, 3], "rpy_deg": [0, 0, 90], "id": "ä%d"}\n',
    "yaml": "xyz: [%d, 2, 3]\nrpy_deg: [0, 0, 90]\nid: ä%d\n---\n",
}
LONG = {
    "json": '{"xyz": [%d, 2, 3], "näme": "ö", "more": {' + ", ".join(f'"k{n}": {n}' for n in range(30)) + '}, "rpy_deg": [0, 0, %d]}\n',
    "yaml": "xyz: [%d, 2, 3]\nnäme: ö\nmore:\n" + "".join(f"  k{n}: {n}\n" for n in range(30)) + "rpy_deg: [0, 0, %d]\n---\n",
}
BAD = {"json": '{"xyz": [1, 2], "rpy": [0, 0, 0]}\n', "yaml": "xyz: [1, 2]\nrpy: [0, 0, 0]\n---\n"}


def records(form: str, *, bad: bool = False) -> bytes:
    made = [pattern % (number, number) for number in range(8) for pattern in (SHORT[form], LONG[form], LONG[form], SHORT[form])]
    return "".join([*made[:20], *([BAD[form]] * bad), *made[20:]]).encode()


@pytest.mark.parametrize("form", ["json", "yaml"])
@pytest.mark.parametrize("size", [0, 700])
@pytest.mark.parametrize("request_of", [MOVE, convert("quaternion"), MOVE._replace(on_error="skip"), MOVE._replace(on_error="null")])
@pytest.mark.parametrize("bad", [False, True])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_long_records_become_what_short_ones_become(
    form: str, size: int, request_of: object, bad: bool, end: str, monkeypatch: pytest.MonkeyPatch  # noqa: FBT001 - parameters
) -> None:
    text = records(form, bad=bad).replace(b"\n", end.encode())

    def found(most: int) -> Flow:
        monkeypatch.setattr(template, "MOST_LEAVES", most)
        return flow(text, request_of, form, size=size)  # type: ignore[arg-type]

    assert found(12) == found(2000)


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_no_expression_is_made_of_a_long_record(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Template] = []

    class Counted(Template):
        @property
        def expression(self) -> bytes:
            made.append(self)
            return Template.expression.func(self)  # type: ignore[attr-defined, no-any-return]

    monkeypatch.setattr(template, "Template", Counted)
    monkeypatch.setattr(template, "MOST_LEAVES", 12)
    assert flow(records(form), MOVE, form).status == 0
    assert made
    assert {each.is_long for each in made} == {False}
