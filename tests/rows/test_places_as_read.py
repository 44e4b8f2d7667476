"""A place that nothing moves is written as it was read: its numbers take no way through ECEF."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

LAT, LON, ALT = "48.137154321987651", "11.576124567891234", "12.5"
PLACES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "lla": ("lat,lon,alt", f"{LAT},{LON},{ALT}", {"lat": LAT, "lon": LON, "alt": ALT}),
    "utm": (
        "utm_zone,easting,northing,alt", "32N,691607.86,5334760.4,12.5",
        {"utm": {"zone": "32N", "easting": "691607.86", "northing": "5334760.4", "alt": ALT}},
    ),
    "enu": ("east,north,up", "1.1,2.3,12.5", {"east": "1.1", "north": "2.3", "up": ALT}),
}  # fmt: skip
ORIGIN = ("--origin", "{lat: 48.1, lon: 11.5, alt: 500}")


def bare(text: str) -> str:
    """Leave out quotes and what results of UTM say beside the numbers."""
    entry: dict[str, Any] = json.loads(text)
    for key in ("convergence_deg", "grid_scale"):
        entry.get("utm", {}).pop(key, None)
    return json.dumps(entry)


@pytest.mark.parametrize("form", PLACES)
def test_rows_records_and_arguments_come_back_as_they_were_read(form: str, run: Callable[..., Any]) -> None:
    title, row, mapping = PLACES[form]
    asked = ("convert", "--to", form, *(ORIGIN if form == "enu" else ()))
    text = json.dumps(mapping)
    for number in row.split(",")["utm" in mapping :]:
        text = text.replace(f'"{number}"', number)
    expected = text.replace(LAT, repr(float(LAT))).replace(LON, repr(float(LON)))
    assert run(*asked, stdin=f"{title}\n{row}\n").out == f"{title}\n{row}\n".replace(LAT, repr(float(LAT))).replace(
        LON, repr(float(LON))
    )
    assert bare(run(*asked, stdin=text + "\n").out) == expected
    assert bare(run(*asked, text, "-f", "json").out) == expected
    if form == "lla":
        assert bare(run(*asked, "-f", "json", stdin=f"{title}\n{row}\n").out) == expected
        assert run(*asked, "-f", "csv", stdin=text + "\n").out.splitlines()[1] == ",".join(
            repr(float(cell)) for cell in row.split(",")
        )


def test_a_height_stays_in_another_form_of_position_too(run: Callable[..., Any]) -> None:
    for given, to in (("lla", "utm"), ("utm", "lla")):
        title, row, _ = PLACES[given]
        assert run("convert", "--to", to, stdin=f"{title}\n{row}\n").out.splitlines()[1].endswith(f",{ALT}")


def test_a_place_with_a_rotation_keeps_its_numbers(run: Callable[..., Any]) -> None:
    text = f"lat,lon,alt,axes,roll,pitch,yaw\n{float(LAT)!r},{float(LON)!r},{ALT},enu,0.0,0.0,0.5\n"
    found = run("convert", "--to", "lla,rpy", stdin=text).out.splitlines()[1].split(",")
    assert found[:3] == [repr(float(LAT)), repr(float(LON)), ALT]
    argument = json.dumps({"lat": float(LAT), "lon": float(LON), "alt": 12.5, "axes": "enu", "rpy": [0.0, 0.0, 0.5]})
    entry = json.loads(run("convert", argument, "--to", "lla,rpy", "-f", "json").out)
    assert [entry[key] for key in ("lat", "lon", "alt")] == [float(LAT), float(LON), 12.5]


@pytest.mark.parametrize("row", ["95,11,5", "48,11,1e21", "48,11,-6371000", "48,400,0"])
def test_what_is_no_place_is_refused_also_where_nothing_moves(row: str, run: Callable[..., Any]) -> None:
    rows = run("convert", "--to", "lla", stdin=f"lat,lon,alt\n{row}\n")
    lat, lon, alt = map(float, row.split(","))
    record = run("convert", "--to", "lla", stdin=json.dumps({"lat": lat, "lon": lon, "alt": alt}) + "\n")
    assert (rows.status, record.status) == (1, 1)
