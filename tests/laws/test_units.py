"""Unit conversion: common units agree with pint; gauge and absolute pressure differ by the ambient pressure."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.core import units
from airmuscle.core.errors import UnitError

COMMON = {name: entry for name, entry in units._FACTORS.items() if name not in ("", "-", "min", "Nm")}
"""Without those that pint reads otherwise, or not at all; Nm is metre number (tex), a unit of yarns, there."""


@pytest.mark.parametrize("unit", COMMON)
def test_a_common_unit_agrees_with_pint(unit):
    factor, target = COMMON[unit]
    by_pint = units._convert_with_pint(
        "dimensionless" if unit == "1" else unit, "dimensionless" if target == "1" else target, ""
    )
    assert by_pint.factor == pytest.approx(factor, rel=1e-12)
    assert by_pint.offset == 0.0


def test_the_unit_factors_are_those_of_text():
    assert units.quantity("6 bar", "Pa") == 6 * units.bar
    assert units.quantity("300 mm", "m") == pytest.approx(300 * units.mm)
    assert units.quantity("25 deg", "rad") == 25 * units.degree


@given(st.floats(-1e5, 1e7), st.floats(9e4, 1.1e5))
def test_absolute_pressure_is_gauge_plus_ambient(gauge, ambient):
    absolute = units.conversion("kPa(a)", "Pa", ambient=ambient)
    assert absolute((gauge + ambient) / 1e3) == pytest.approx(gauge, abs=1e-8 * 1e7)
    assert units.conversion("barg", "Pa", ambient=ambient)(gauge / 1e5) == pytest.approx(gauge)


@pytest.mark.parametrize("text", ["7 bara", "7 bar abs", "7 bar(a)", "7 bar absolute", "700 kPa(a)", "700 kPa a"])
def test_every_spelling_of_absolute_is_understood(text):
    assert units.quantity(text, "Pa") == pytest.approx(7e5 - 101_325)


@pytest.mark.parametrize("text", ["7 barg", "7 bar(g)", "7 bar gauge", "7 bar", "700 kPag"])
def test_every_spelling_of_gauge_is_understood(text):
    assert units.quantity(text, "Pa") == pytest.approx(7e5)


def test_a_plain_pressure_unit_is_assumed_to_be_gauge_and_marked():
    assert units.conversion("bar", "Pa").assumed_gauge
    assert not units.conversion("barg", "Pa").assumed_gauge


@pytest.mark.parametrize(("text", "target"), [("3 N", "m"), ("3 bara", "N"), ("3 zorkmid", "m"), ("3", "m"), ("", "m")])
def test_a_unit_of_another_quantity_is_an_error(text, target):
    with pytest.raises(UnitError):
        units.quantity(text, target)


def test_a_text_of_a_hundred_thousand_characters_is_no_unit():
    for convert in (lambda: units.quantity("1 " + "m" * 100_000, "m"), lambda: units.conversion("m" * 100_000, "m")):
        with pytest.raises(UnitError, match=r"characters is not a .*unit; at most 200 are allowed"):
            convert()


@pytest.mark.parametrize(
    ("text", "target", "example"), [("200", "m", "200 mm"), ("3", "Pa", "3 bar"), ("300", "Pa", "300 kPa"),
                                    ("5", "kg", "5 kg"), ("20", "s", "20 ms"), ("7", "N", "7 N"),
                                    ("x", "N m", "5 N m"), ("", "kg", "10 kg"), ("nan", "kg m^2", "1 kg m\\^2")]
)  # fmt: skip
def test_a_hint_has_the_usual_unit(text: str, target: str, example: str):
    with pytest.raises(UnitError, match=f"write it like '{example}'"):
        units.quantity(text, target)
