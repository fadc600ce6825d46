"""Ratings are what the maker permits: stated values limit, others do not, and lengths have their
range too.
"""

from __future__ import annotations

import pytest

from airmuscle.errors import ParameterError
from airmuscle.physics import Ratings

DMSP_20 = Ratings(
    max_force=1500.0, min_pressure=0.0, max_pressure=6e5, max_contraction=0.25, max_prestretch=0.04
)


def test_permitted_values_give_no_text_and_the_limits_are_permitted():
    assert DMSP_20.excesses(force=1500.0, pressure=6e5, contraction=0.25) == ()
    assert DMSP_20.excesses(force=0.0, pressure=0.0, contraction=-0.04) == ()


@pytest.mark.parametrize(
    ("quantity", "value", "text"),
    [
        ("force", 2000.0, "the force 2000 N is not permitted; allowed range: at most 1500 N"),
        ("pressure", 12e5, "the pressure 1200 kPa is not permitted; allowed range: 0 to 600 kPa"),
        ("pressure", -1e3, "the pressure -1 kPa is not permitted; allowed range: 0 to 600 kPa"),
        ("contraction", 0.3, "the contraction 30 % is not permitted; allowed range: -4 to 25 %"),
        ("contraction", -0.05, "the contraction -5 % is not permitted; allowed range: -4 to 25 %"),
    ],
)
def test_each_limit_is_named_with_its_range(quantity: str, value: float, text: str):
    assert DMSP_20.excesses(**{quantity: value}) == (text,)


def test_what_is_not_stated_does_not_limit():
    assert Ratings().stated == ()
    assert (
        Ratings().excesses(force=9e5, pressure=9e7, contraction=0.9, length=19.0, temperature=900.0)
        == ()
    )
    assert Ratings(max_temperature=323.15).excesses(temperature=330.0) == (
        "the temperature 56.85 °C is not permitted; allowed range: at most 50 °C",
    )
    assert Ratings(min_length=0.04).excesses(length=0.03) == (
        "the length 30 mm is not permitted; allowed range: at least 40 mm",
    )


def test_limits_in_the_wrong_order_and_unknown_quantities_are_refused():
    with pytest.raises(
        ParameterError, match="min_pressure 700000 must be less than max_pressure 600000"
    ):
        Ratings(min_pressure=7e5, max_pressure=6e5)
    with pytest.raises(ParameterError, match="'speed' is not rated; there are force, pressure"):
        Ratings().excesses(speed=1.0)
