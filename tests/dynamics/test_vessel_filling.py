"""A vessel of constant volume filled through an orifice: the simulated pressure is the one known in
closed form.

Isothermal, p' = R T0/V qm with qm = C rho0 ps sqrt(1 - ((p/ps - b)/(1 - b))^2), and 1/tau = R T0 C
rho0/V:

    b = 0              p = ps sin(arcsin(p0/ps) + t/tau), full at a finite time
    choked, p < b ps   p = p0 + ps t/tau, until b ps
    then               p = ps (b + (1 - b) sin(t'/((1 - b) tau)))

b = 0 is the orifice of FONSim, whose restrictor takes the density at the mean of the two pressures:
q^2 = k (p1^2 - p2^2).
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from airmuscle.engine import Rodas4, Schedule, simulate
from airmuscle.physics import (
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    Ambient,
    Braid,
    CheckValve,
    ChouHannaford1996,
    FillDischarge,
    Isometric,
    Isothermal,
    Muscle,
    Orifice,
    Plant,
    SubsonicIndexValve,
    Supply,
    Valve,
)

SOURCE = 7e5
T0 = 293.15
CONDUCTANCE = 1e-9
AMBIENT = Ambient(100e3, T0)
BRAID = Braid(0.01, 0.4363, 0.3)
VOLUME = BRAID.volume(0.0)
TAU = VOLUME / (GAS_CONSTANT * T0 * CONDUCTANCE * REFERENCE_DENSITY)


def filled(valve: Orifice, start: float, duration: float):
    """Time [s] and absolute pressure [Pa] of a muscle held at zero contraction, whose volume is a
    vessel's.
    """
    circuit = FillDischarge(Supply(SOURCE - AMBIENT.pressure), valve, valve)
    plant = Plant(
        Muscle(ChouHannaford1996(BRAID), BRAID),
        circuit,
        Isometric(0.0),
        gas=Isothermal(),
        ambient=AMBIENT,
    )
    run = simulate(
        plant,
        Schedule({"fill": ((0.0, 1.0),)}),
        duration=duration,
        initial_state=plant.state_at(pressure=start - AMBIENT.pressure),
        integrator=Rodas4(rtol=1e-9),
    )
    return run["time"], run["pressure"] + AMBIENT.pressure


def closed_form(b: float, start: float, time):
    """Absolute pressure [Pa] in the vessel, as long as it is below the laminar range."""
    choke_end = max(b * SOURCE - start, 0.0) / SOURCE * TAU
    begin = np.arcsin((max(start, b * SOURCE) / SOURCE - b) / (1 - b))
    angle = begin + (time - choke_end) / ((1 - b) * TAU)
    return np.where(
        time < choke_end, start + SOURCE * time / TAU, SOURCE * (b + (1 - b) * np.sin(angle))
    )


@pytest.mark.parametrize(
    ("b", "start"), [(0.0, 1e5), (0.0, 4e5), (0.3, 1e5), (0.433, 1e5), (0.5, 6e5)]
)
def test_the_vessel_fills_as_the_closed_form_says(b: float, start: float):
    full = TAU * (max(b - start / SOURCE, 0.0) + (1 - b) * np.pi / 2)
    time, pressure = filled(Valve(CONDUCTANCE, b), start, full)
    expected = closed_form(b, start, time)
    below = expected < 0.9985 * SOURCE
    below &= np.maximum.accumulate(expected) <= expected
    assert below.sum() > 100
    assert pressure[below] == pytest.approx(expected[below], rel=1e-6)


def test_the_general_law_fills_it_alike():
    plain, general = (
        filled(law, 1e5, 2.0)[1]
        for law in (Valve(CONDUCTANCE, 0.3), SubsonicIndexValve(CONDUCTANCE, 0.3))
    )
    assert general == pytest.approx(plain, rel=1e-6)


def test_through_a_cracking_check_valve_it_stops_short_of_the_supply_and_does_not_empty():
    check = CheckValve(SubsonicIndexValve(CONDUCTANCE, 0.3, 0.55, 30e3))
    _, filling = filled(check, 1e5, 60.0)
    assert filling[-1] == pytest.approx(SOURCE - 30e3, rel=1e-4)
    assert filling.max() <= SOURCE - 30e3 + 1.0
    _, holding = filled(check, 9e5, 5.0)
    assert holding == pytest.approx(9e5, rel=1e-12)


@pytest.mark.parametrize("b", [0.0, 0.3, 0.433])
def test_the_closed_form_is_the_integral_of_the_printed_law(b: float):
    """SciPy's quadrature of dp/p' from 1 to 6.9 bar gives the time at which the closed form is
    there.
    """

    def slowness(p: float) -> float:
        ratio = p / SOURCE
        return TAU / SOURCE / (1.0 if ratio <= b else np.sqrt(1 - ((ratio - b) / (1 - b)) ** 2))

    time, _ = quad(slowness, 1e5, 6.9e5, points=[max(b * SOURCE, 1e5)], epsabs=1e-13)
    assert closed_form(b, 1e5, time) == pytest.approx(6.9e5, rel=1e-9)


def test_with_b_zero_the_square_of_the_flow_is_that_of_the_mean_density():
    """FONSim's restrictor: dp = k q^2/rho(mean pressure); so q^2 over dp (p1 + p2) is one
    constant.
    """
    valve = Valve(CONDUCTANCE, 0.0)
    for p1, p2 in ((7e5, 1e5), (7e5, 6e5), (2e5, 1e5)):
        assert valve.mass_flow(p1, p2, 1.0, T0) ** 2 / ((p1 - p2) * (p1 + p2)) == pytest.approx(
            (CONDUCTANCE * REFERENCE_DENSITY) ** 2
        )
