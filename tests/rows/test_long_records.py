"""Records of very many keys among short ones: what becomes of each is what becomes of it alone."""

from __future__ import annotations

import pytest
from flow import MOVE, Asked, convert, flow
from sized import sized

COUNT = 2100  # keys: of more than 2000 nothing is learned for other records
SHORT = {
    "json": '{"xyz": [%d, 2, 3], "rpy_deg": [0, 0, 90], "id": "ä%d"}\n',
    "yaml": "xyz: [%d, 2, 3]\nrpy_deg: [0, 0, 90]\nid: ä%d\n---\n",
}
LONG = {
    "json": '{"xyz": [%d, 2, 3], "näme": "ö", "more": {' + ", ".join(f'"k{n}": {n}' for n in range(COUNT)) + '}, "rpy_deg": [0, 0, %d]}\n',
    "yaml": "xyz: [%d, 2, 3]\nnäme: ö\nmore:\n" + "".join(f"  k{n}: {n}\n" for n in range(COUNT)) + "rpy_deg: [0, 0, %d]\n---\n",
}
BAD = {"json": '{"xyz": [1, 2], "rpy": [0, 0, 0]}\n', "yaml": "xyz: [1, 2]\nrpy: [0, 0, 0]\n---\n"}


def records(form: str, *, bad: bool = False) -> bytes:
    made = [pattern % (number, number) for number in range(3) for pattern in (SHORT[form], LONG[form], LONG[form], SHORT[form])]
    return "".join([*made[:7], *([BAD[form]] * bad), *made[7:]]).encode()


@pytest.mark.parametrize("form", ["json", "yaml"])
@pytest.mark.parametrize("request_of", [MOVE, convert("quaternion"), MOVE._replace(on_error="skip"), MOVE._replace(on_error="null")])
@pytest.mark.parametrize("bad", [False, True])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_long_records_become_what_they_become_alone(form: str, request_of: Asked, bad: bool, end: str) -> None:  # noqa: FBT001 - parameters
    text = records(form, bad=bad).replace(b"\n", end.encode())
    with sized(few=1000):
        alone = flow(text, request_of, form)
    with sized(few=0):
        assert flow(text, request_of, form) == flow(text, request_of, form, size=700) == alone
