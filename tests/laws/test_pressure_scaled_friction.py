"""Friction whose force is scaled by an affine function of the gauge pressure: s(p) = max(a + (1 -
a) p/p_r, 0).
"""

from __future__ import annotations

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.core import evaluation, nodes
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    BoucWen,
    Dahl,
    IdentifiedFriction,
    LuGre,
    MaxwellSlip,
    Muscle,
    NoFriction,
    PrandtlIshlinskii,
    PressureScaledFriction,
)

SLIPS = (4e4, 2e4), (1e-4, 4e-4)
LAWS = [
    Dahl(5e4, 20.0),
    BoucWen(5e4, 20.0, 1.7, 0.8),
    MaxwellSlip(*SLIPS),
    PrandtlIshlinskii(*SLIPS, (5.0, -8.0), (0.8, -0.6)),
    LuGre(5e4, 15.0, 5.0, 0.01, 50.0, 20.0),
]


def name(law):
    return type(law).__name__


@pytest.mark.parametrize("law", LAWS, ids=name)
def test_every_law_takes_the_scale_and_keeps_its_states(law):
    scaled = PressureScaledFriction(law, 0.25, 4e5)
    bristles = {s.name: 0.5 * s.nominal for s in law.states}
    assert scaled.states == law.states
    assert scaled.rates(bristles, 0.01) == law.rates(bristles, 0.01)
    assert scaled.rate_independent is law.rate_independent
    assert [scaled.pressure_factor(p) for p in (0.0, 2e5, 4e5)] == pytest.approx([0.25, 0.625, 1.0])
    path = np.linspace(0.0, 1e-3, 20)
    np.testing.assert_array_equal(scaled.force_along(path), law.force_along(path))


def test_a_ratio_of_zero_is_proportional_to_the_pressure_and_vacuum_has_no_negative_friction():
    law = PressureScaledFriction(Dahl(5e4, 20.0), 0.0, 1e5)
    assert [law.pressure_factor(p) for p in (-5e4, 0.0, 3e5)] == [0.0, 0.0, 3.0]


def test_the_scale_acts_on_the_force_of_a_muscle():
    chosen = LAWS[0]
    plain, scaled = (
        Muscle(chosen_muscle().contractile, chosen_muscle().geometry, friction=friction)
        for friction in (chosen, PressureScaledFriction(chosen, 0.2, 5e5))
    )
    state = {"bristle": 2e-4}
    force = plain.friction_force(3e5, 0.0, state)
    assert scaled.friction_force(3e5, 0.0, state) == pytest.approx((0.2 + 0.8 * 0.6) * force)
    lost = [m.tension(3e5, 0.05) - m.tension(3e5, 0.05, 0.0, state) for m in (plain, scaled)]
    assert lost[1] == pytest.approx(0.68 * lost[0])
    p = nodes.symbol("p")
    traced = evaluation.Recorded([[p]], [[scaled.friction_force(p, 0.0, state)]])
    assert traced.at_numbers([3e5]) == [[pytest.approx(0.68 * force, rel=1e-12)]]


def test_the_range_of_the_data_belongs_to_the_law_and_changes_no_force():
    law = IdentifiedFriction(PressureScaledFriction(LAWS[0], 0.2, 5e5), 1e5, 5e5, 0.002)
    assert law.identified_range == ((1e5, 5e5), (-0.002, 0.002))
    assert law.pressure_factor(1e6) == law.inner.pressure_factor(1e6)
    assert NoFriction().identified_range is None
    with pytest.raises(
        ParameterError, match="min_pressure 500000 must be less than max_pressure 100000"
    ):
        IdentifiedFriction(LAWS[0], 5e5, 1e5)


@pytest.mark.parametrize("pressure", [0.0, 2e5, 6e5, 2.5e6])
def test_one_scale_within_another_multiplies_them(pressure):
    inner = PressureScaledFriction(LAWS[0], 0.5, 3e5)
    for outer in (PressureScaledFriction(inner, 1.4, 4e5), IdentifiedFriction(inner, 0.0, 6e5)):
        own = (
            max(1.4 - 0.4 * pressure / 4e5, 0.0)
            if isinstance(outer, PressureScaledFriction)
            else 1.0
        )
        assert outer.pressure_factor(pressure) == pytest.approx(own * (0.5 + 0.5 * pressure / 3e5))
