"""Unit conversion: common units agree with pint; gauge and absolute pressure differ by the ambient
pressure.
"""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.core import units
from airmuscle.errors import UnitError

COMMON = {name: entry for name, entry in units._FACTORS.items() if name not in ("", "-", "min")}
"""Without those that pint reads otherwise, or not at all."""


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


@pytest.mark.parametrize(
    "text", ["7 bara", "7 bar abs", "7 bar(a)", "7 bar absolute", "700 kPa(a)", "700 kPa a"]
)
def test_every_spelling_of_absolute_is_understood(text):
    assert units.quantity(text, "Pa") == pytest.approx(7e5 - 101_325)


@pytest.mark.parametrize("text", ["7 barg", "7 bar(g)", "7 bar gauge", "7 bar", "700 kPag"])
def test_every_spelling_of_gauge_is_understood(text):
    assert units.quantity(text, "Pa") == pytest.approx(7e5)


def test_a_plain_pressure_unit_is_assumed_to_be_gauge_and_marked():
    assert units.conversion("bar", "Pa").assumed_gauge
    assert not units.conversion("barg", "Pa").assumed_gauge


@pytest.mark.parametrize(
    ("text", "target"), [("3 N", "m"), ("3 bara", "N"), ("3 zorkmid", "m"), ("3", "m"), ("", "m")]
)
def test_a_unit_of_another_quantity_is_an_error(text, target):
    with pytest.raises(UnitError):
        units.quantity(text, target)


@pytest.mark.parametrize(
    ("text", "target", "value"),
    [
        ("10 rad/s", "Hz", 10 / (2 * math.pi)),
        ("360 deg/s", "Hz", 1.0),
        ("60 rpm", "Hz", 1.0),
        ("60 rev/min", "Hz", 1.0),
        ("2 kHz", "Hz", 2000.0),
        ("5 1/s", "Hz", 5.0),
        ("300 1/min", "Hz", 5.0),
        ("1 Hz", "rad/s", 2 * math.pi),
        ("60 rpm", "rad/s", 2 * math.pi),
        ("180 deg/s", "rad/s", math.pi),
        ("1 Hz/s", "rad/s^2", 2 * math.pi),
    ],
)
def test_frequencies_and_angular_speeds_differ_by_two_pi(text: str, target: str, value: float):
    assert units.quantity(text, target) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "target", "message"),
    [
        (f"1 {unit}", "1", "to a ratio: it measures another quantity")
        for unit in (
            "rad",
            "deg",
            "turn",
            "gon",
            "arcmin",
            "arcsec",
            "mrad",
            "rev",
            "sr",
            "bit",
            "B",
            "rad/deg/deg",
        )
    ]
    + [
        (f"1 {unit}", "1", f"'{unit}' is logarithmic; write a ratio")
        for unit in ("dB", "Np", "octave")
    ]
    + [
        ("1 dBm", "W", "is logarithmic; write 'W'"),
        ("1 %", "rad", "to 'rad': it states no angle"),
        ("5 1/s", "rad/s", "it states no angle. Write rad/s, deg/s, or a frequency in Hz or rpm"),
        ("5 rad/s", "1/s", "measures another quantity"),
        ("5 rad", "N m/rad", "measures another quantity"),
        ("5 Nm/rad", "N m", "measures another quantity"),
    ],
)
def test_an_angle_or_a_logarithm_is_no_ratio(text: str, target: str, message: str):
    with pytest.raises(UnitError, match=re.escape(message)):
        units.quantity(text, target)


def test_a_stiffness_per_degree_is_converted_in_every_spelling_of_newton_metre():
    for unit in ("N m/deg", "Nm/deg", "N*m/deg", "Nm/°"):
        assert units.quantity(f"1 {unit}", "N m/rad") == pytest.approx(180 / math.pi)
    assert units.quantity("1 N m s", "N m s/rad") == 1.0


@pytest.mark.parametrize(
    ("text", "target", "instead"),
    [
        ("2 ton", "kg", "t (1000 kg), short_ton (907.2 kg) or long_ton (1016 kg)"),
        ("2 tons", "kg", "t (1000 kg)"),
        ("2 mt", "kg", "t (1000 kg)"),
        ("1 ton_force", "N", "write kN"),
        ("1 force_ton", "N", "write kN"),
        ("1 cwt", "kg", "write kg or lb"),
        ("1 ton/s", "kg/s", "t (1000 kg)"),
    ],
)
def test_a_name_of_several_units_is_refused(text: str, target: str, instead: str):
    with pytest.raises(UnitError, match=r"is the name of several units.*" + re.escape(instead)):
        units.quantity(text, target)


@pytest.mark.parametrize(
    ("text", "target", "value"),
    [
        ("2 t", "kg", 2000.0),
        ("1 short_ton", "kg", 907.18474),
        ("1 long_ton", "kg", 1016.0469),
        ("1 tonne", "kg", 1000.0),
        ("1 metric_ton", "kg", 1000.0),
        ("1 kgf", "N", 9.80665),
        ("1 kp", "N", 9.80665),
        ("1 in", "m", 0.0254),
        ("1 thou", "m", 2.54e-5),
        ("20 degC", "K", 293.15),
        ("1 W/degC", "W/K", 1.0),
        ("3 mmHg", "Pa", 399.96716),
        ("36 m3/h", "m3/s", 0.01),
        ("1 metric_horsepower", "W", 735.49875),
    ],
)
def test_units_outside_the_table_have_their_usual_size(text: str, target: str, value: float):
    assert units.quantity(text, target) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("50 %", "Pa"),
        ("1 mil", "m"),
        ("0.5 l", "1"),
        ("1 PS", "W"),
        ("1 Nm3/h", "m3/s"),
        ("1 Nl/min", "m3/s"),
        ("1 kg/cm2", "Pa"),
        ("20 C", "K"),
        ("1 kg", "N"),
        ("1 lb", "N"),
    ],
)
def test_a_text_that_may_mean_another_unit_is_refused(text: str, target: str):
    with pytest.raises(UnitError):
        units.quantity(text, target)


def test_a_text_of_a_hundred_thousand_characters_is_no_unit():
    for convert in (
        lambda: units.quantity("1 " + "m" * 100_000, "m"),
        lambda: units.conversion("m" * 100_000, "m"),
    ):
        with pytest.raises(UnitError, match=r"characters is not a .*unit; at most 200 are allowed"):
            convert()


@pytest.mark.parametrize(
    ("text", "target", "example"),
    [
        ("200", "m", "200 mm"),
        ("3", "Pa", "3 bar"),
        ("300", "Pa", "300 kPa"),
        ("5", "kg", "5 kg"),
        ("20", "s", "20 ms"),
        ("7", "N", "7 N"),
        ("x", "N m", "5 N m"),
        ("", "kg", "10 kg"),
        ("nan", "kg m^2", "1 kg m\\^2"),
    ],
)
def test_a_hint_has_the_usual_unit(text: str, target: str, example: str):
    with pytest.raises(UnitError, match=f"write it like '{example}'"):
        units.quantity(text, target)


@pytest.mark.parametrize(
    ("numerator", "target"),
    [("N m", "N m s/rad"), ("V", "V s/rad"), ("mN m", "N m s/rad"), ("N mm", "N m s/rad")],
)
def test_a_coefficient_per_frequency_is_one_per_cycle(numerator: str, target: str):
    """1/Hz is 1 s/rev, as 1/rpm is: the same coefficient, whichever frequency it refers to."""
    per_revolution = units.quantity(f"3 {numerator} s/rev", target)
    assert units.quantity(f"3 {numerator}/Hz", target) == pytest.approx(per_revolution, rel=1e-12)
    assert units.quantity(f"3 {numerator}/kHz", target) == pytest.approx(
        per_revolution / 1e3, rel=1e-12
    )
    assert units.quantity(f"3 {numerator}/rpm", target) == pytest.approx(
        60 * per_revolution, rel=1e-12
    )
    assert units.quantity("3 N m/Hz", "N m s/rad") == pytest.approx(0.4775, rel=1e-3)
