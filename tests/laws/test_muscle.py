"""Hill's arrangement: what the elements add up to, that a muscle never pushes, and that volume and
gas fit together.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.errors import AirmuscleWarning
from airmuscle.physics import (
    GAS_CONSTANT,
    Ambient,
    Braid,
    ChouHannaford1996,
    Clamped,
    ContractileSurface,
    CubicSpring,
    EffectiveLength,
    Isothermal,
    LinearDamper,
    LinearSpring,
    Muscle,
    Polytropic,
    PressureDamper,
    Reynolds2003,
    absolute_pressure,
    gauge_pressure,
)

BRAID = Braid(0.01, 0.44, 0.3)
AMBIENT = Ambient()
pressure = st.floats(0, 6e5)
contraction = st.floats(-0.05, 0.3)
speed = st.floats(-1, 1)


def hill(spring=LinearSpring(2000.0), damper=LinearDamper(150.0)):
    return Muscle(ChouHannaford1996(BRAID), BRAID, spring, damper)


@given(pressure, contraction, speed)
def test_the_tension_is_contractile_less_spring_less_damper_and_never_negative(p, eps, v):
    muscle = hill()
    expected = muscle.contractile.force(p, eps) - 2000.0 * eps * 0.3 - 150.0 * v
    assert muscle.tension(p, eps, v) == pytest.approx(max(expected, 0.0), abs=1e-9)
    assert muscle.tension(p, eps, v) >= 0.0


@given(contraction)
def test_a_hardening_spring_is_the_constant_one_at_rest_and_stiffer_beyond(eps):
    constant = LinearSpring(2000.0)
    hardening = CubicSpring(2000.0, 50.0)
    assert abs(hardening.force(0.0, eps, 0.3)) >= abs(constant.force(0.0, eps, 0.3))
    assert CubicSpring(2000.0, 0.0).force(0.0, eps, 0.3) == constant.force(0.0, eps, 0.3)


@given(pressure, speed)
def test_a_damper_takes_energy_whatever_the_direction(p, v):
    for damper in (LinearDamper(100.0), PressureDamper(100.0, 1e-3)):
        assert damper.force(p, 0.1, v) * v >= 0.0
    assert PressureDamper(100.0, 1e-3).force(2e5, 0.1, 0.5) == pytest.approx(0.5 * (100.0 + 200.0))


@given(st.floats(1e4, 5e5), st.floats(0.0, 0.25))
def test_the_stiffness_is_the_slope_of_the_tension(p, eps):
    muscle = hill()
    step = 1e-6
    slope = (muscle.unclamped_tension(p, eps + step) - muscle.unclamped_tension(p, eps - step)) / (
        2 * step
    )
    assert muscle.stiffness(p, eps) == pytest.approx(-slope, rel=1e-6)


@given(contraction)
def test_the_braid_is_chou_and_hannafords_volume(eps):
    thread = 0.3 / np.cos(0.44)
    turns = 0.3 * np.tan(0.44) / (2 * np.pi * 0.01)
    angle = np.arccos((1 - eps) * np.cos(0.44))
    expected = thread**3 / (4 * np.pi * turns**2) * np.cos(angle) * np.sin(angle) ** 2
    assert BRAID.volume(eps) == pytest.approx(expected, rel=1e-12)


@given(
    st.floats(-5e4, 1e6),
    st.floats(1e-6, 1e-3),
    st.sampled_from([Isothermal(), Polytropic(1.2), Polytropic(1.4)]),
)
def test_air_mass_and_pressure_are_each_others_inverse(p, volume, gas):
    mass = gas.air_mass(absolute_pressure(p, AMBIENT), volume, AMBIENT)
    assert gauge_pressure(gas.pressure(mass, volume, AMBIENT), AMBIENT) == pytest.approx(
        p, abs=1e-6
    )


def test_isothermal_air_obeys_boyle_and_polytropic_air_its_exponent():
    mass = 3e-4
    one, two = (Isothermal().pressure(mass, v, AMBIENT) for v in (1e-4, 2e-4))
    assert one == pytest.approx(2 * two)
    assert one == pytest.approx(mass * GAS_CONSTANT * 293.15 / 1e-4)
    one, two = (Polytropic(1.3).pressure(mass, v, AMBIENT) for v in (1e-4, 2e-4))
    assert one == pytest.approx(2**1.3 * two)
    resting = AMBIENT.pressure * 1e-4 / (GAS_CONSTANT * 293.15)
    assert Polytropic(1.3).pressure(resting, 1e-4, AMBIENT) == pytest.approx(AMBIENT.pressure)


def test_a_law_of_another_resting_length_than_that_of_the_geometry_is_named():
    surface = ContractileSurface((300.0, -200.0, 40.0), 0.0, 6e5, 0.0, 0.25, 0.0, 1200.0, 1)
    laws = (Reynolds2003(0.2), Clamped(Reynolds2003(0.2)), EffectiveLength(surface, 0.2, 0.01))
    for law in laws:
        with pytest.warns(
            AirmuscleWarning, match="law of a muscle of 200 mm, but .* of Braid is 300 mm"
        ) as found:
            Muscle(law, BRAID)
        assert [each.filename for each in found] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for law in (ChouHannaford1996(Braid(0.01, 0.44, 0.2)), surface, Reynolds2003(0.3 + 1e-7)):
            Muscle(law, BRAID)
