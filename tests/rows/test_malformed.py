"""No stream of whatever bytes may end in anything but results, told faults and a status."""

from __future__ import annotations

import pytest
from flow import INVERT, MOVE, ON_ERROR, convert, flow
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

GOOD = {
    "csv": (b"id,x,y,z,qx,qy,qz,qw,t\n", b'007,1,2,3,0,0,0,1,"a,b"\n'),
    "tsv": (b"id\tx\ty\tz\tqx\tqy\tqz\tqw\n", b"007\t1\t2\t3\t0\t0\t0\t1\n"),
    "columns": (b"# t x y z\n", b"1.5 1 2 3 0 0 0 1\n"),
    "json": (b"", b'{"id": "007", "xyz": [1, 2, 3], "xyzw": [0, 0, 0, 1]}\n'),
    "yaml": (b"", b"id: 007\nxyz: [1, 2, 3]\nquaternion: {x: 0, y: 0, z: 0, w: 1}\n---\n"),
}
BYTES = st.one_of(
    st.binary(max_size=40), st.text("{}[]:,\"'#-\\ \n\t\r0123456789.eEnaifxyzq\0é", max_size=40).map(str.encode)
)


@st.composite
def spoiled(draw: st.DrawFn, form: str) -> bytes:
    """Put stray bytes into, instead of or between good rows."""
    head, row = GOOD[form]
    rows = [row] * draw(st.integers(1, 24))
    for _ in range(draw(st.integers(1, 4))):
        index, at = draw(st.integers(0, len(rows) - 1)), draw(st.integers(0, len(row)))
        rows[index] = rows[index][:at] + draw(BYTES) + rows[index][at + draw(st.integers(0, 9)) :]
    return head + b"".join(rows)


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("form", GOOD)
@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_malformed_rows_end_in_a_status(form: str, data: st.DataObject) -> None:
    text = data.draw(spoiled(form))
    on_error = data.draw(st.sampled_from(ON_ERROR))
    request = data.draw(st.sampled_from([MOVE, INVERT, convert("rpy_deg")]))._replace(on_error=on_error)
    result = flow(text, request, form)
    assert result.status in (0, 1, 3)
    assert (result.status == 0) == (not result.told)


@pytest.mark.filterwarnings("ignore::frametool.errors.FrametoolWarning")
@pytest.mark.parametrize("form", GOOD)
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_what_is_skipped_leaves_the_rest_as_it_was(form: str, data: st.DataObject) -> None:
    head, row = GOOD[form]
    bad = data.draw(st.sampled_from([row.replace(b"2", b"?"), row.replace(b"1", b"nan", 1).replace(b"2", b"x")]))
    places = data.draw(st.lists(st.booleans(), min_size=1, max_size=40))
    text = head + row + b"".join(bad if spoil else row for spoil in places)
    clean = head + row * (1 + places.count(False))
    skipped = flow(text, INVERT._replace(on_error="skip"), form)
    assert skipped.text == flow(clean, INVERT, form).text
    assert skipped.status == (3 if any(places) else 0)
