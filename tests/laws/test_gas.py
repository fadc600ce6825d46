"""Dry ideal air: first law, adiabatic and isothermal limits, a vessel charged as an independent
solution has it.

U' = sum c_p T_i m_i' - p V' + hA (T_amb - T), p V = m R T; what a process stores falls with volume
by its pressure.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joints import chosen_muscle
from scipy.integrate import quad, solve_ivp

from airmuscle.core import autodiff
from airmuscle.engine import Rodas4, Schedule, simulate
from airmuscle.physics import (
    GAS_CONSTANT,
    Air,
    Ambient,
    EnergyBalance,
    FillDischarge,
    Flow,
    Isometric,
    Isothermal,
    Plant,
    Polytropic,
    Supply,
    Valve,
    VirialGas,
    virial_coefficient_of_air,
)
from airmuscle.physics.pneumatics import (
    SPECIFIC_HEAT_CONSTANT_PRESSURE,
    SPECIFIC_HEAT_CONSTANT_VOLUME,
)

AMBIENT = Ambient()
WARM = AMBIENT.temperature
SUPPLY = 650e3
VALVE = Valve(1e-8, 0.3)
CONTRACTION = 0.05
VOLUME = chosen_muscle().geometry.volume(CONTRACTION)
PROCESSES = [Isothermal(), Polytropic(1.2), Polytropic(1.4), VirialGas(), VirialGas(2e-3)]


def vessel(gas, ambient=AMBIENT):
    """A muscle that is held is a vessel of constant volume."""
    supply = Supply(SUPPLY - ambient.pressure)
    return Plant(
        chosen_muscle(), FillDischarge(supply, VALVE, VALVE), Isometric(CONTRACTION), gas, ambient
    )


def charge(gas, absolute=AMBIENT.pressure, duration=1.0, rtol=1e-9):
    plant = vessel(gas)
    start = plant.state_at(pressure=absolute - AMBIENT.pressure)
    command = Schedule({"fill": ((0.0, 1.0),)})
    return simulate(
        plant,
        command,
        duration=duration,
        initial_state=start,
        integrator=Rodas4(rtol),
        output_times=duration / 200,
    )


def independent(heat_transfer, times):
    """Pressure and temperature of the same vessel from the textbook's p and T equations, not from m
    and U.
    """

    def flow(p):  # ISO 6358, written out again
        ratio = min(p / SUPPLY, 1.0)
        subsonic = np.sqrt(1 - ((ratio - 0.3) / 0.7) ** 2) if ratio > 0.3 else 1.0
        chord = (1 - ratio) * np.sqrt(1 - ((0.999 - 0.3) / 0.7) ** 2) / 0.001
        return 1e-8 * 1.185 * SUPPLY * min(subsonic, chord)

    def rates(_, y):
        p, T = y
        q = flow(p)
        heat = heat_transfer * (WARM - T)
        dp = (1.4 * 287.05 * WARM * q + 0.4 * heat) / VOLUME
        dT = T * (dp / p - q * 287.05 * T / (p * VOLUME))
        return [dp, dT]

    return solve_ivp(
        rates,
        (0, times[-1]),
        [AMBIENT.pressure, WARM],
        "Radau",
        times,
        rtol=1e-10,
        atol=[1e-4, 1e-8],
    ).y


@pytest.mark.parametrize("heat_transfer", [0.0, 0.3, 5.0])
def test_a_vessel_is_charged_as_an_independent_solution_has_it(heat_transfer):
    run = charge(EnergyBalance(heat_transfer))
    pressure, temperature = independent(heat_transfer, run["time"])
    np.testing.assert_allclose(run["pressure"] + AMBIENT.pressure, pressure, rtol=1e-6)
    np.testing.assert_allclose(run["temperature"], temperature, rtol=1e-6)
    assert run["temperature"].max() > WARM + 20.0


@pytest.mark.parametrize("start", [100.0, AMBIENT.pressure])
def test_adiabatic_filling_ends_at_gamma_times_the_supplys_temperature(start):
    """U = U0 + c_p T_s (m - m0): T = p/((p - p0)/(gamma T_s) + p0/T0), gamma T_s for an evacuated
    vessel.
    """
    run = charge(EnergyBalance(0.0), start)
    p = run["pressure"] + AMBIENT.pressure
    expected = p / ((p - start) / (1.4 * WARM) + start / WARM)
    np.testing.assert_allclose(run["temperature"], expected, rtol=1e-7)
    if start < 1e3:
        assert run["temperature"][-1] == pytest.approx(1.4 * WARM, rel=1e-4)


def test_without_heat_transfer_it_is_adiabatic_and_with_much_it_is_isothermal():
    adiabatic = charge(EnergyBalance(0.0))
    hardly = charge(EnergyBalance(1e-6))
    np.testing.assert_allclose(hardly["pressure"], adiabatic["pressure"], rtol=1e-6, atol=1.0)
    isothermal = charge(Isothermal())["pressure"]
    apart = [
        np.abs(charge(EnergyBalance(hA))["pressure"] - isothermal).max()
        for hA in (100.0, 1000.0, 10000.0)
    ]
    assert apart[0] > 100.0
    assert apart[1] / apart[0] == pytest.approx(0.1, rel=0.2)
    assert apart[2] / apart[1] == pytest.approx(0.1, rel=0.2)


def test_a_discharging_vessel_cools_along_the_adiabat():
    """Air that leaves takes c_p T along: T/T0 = (p/p0)^((gamma - 1)/gamma)."""
    plant = vessel(EnergyBalance(0.0))
    start = plant.state_at(pressure=5e5)
    run = simulate(
        plant,
        Schedule({"discharge": ((0.0, 1.0),)}),
        duration=1.0,
        initial_state=start,
        integrator=Rodas4(1e-10),
    )
    p = run["pressure"] + AMBIENT.pressure
    np.testing.assert_allclose(run["temperature"], WARM * (p / p[0]) ** (0.4 / 1.4), rtol=1e-8)
    assert run["temperature"][-1] < 180.0


@given(
    st.floats(1e3, 1e6),
    st.floats(200, 500),
    st.floats(-1e-2, 1e-2),
    st.floats(-1e-3, 1e-3),
    st.floats(0, 100),
)
def test_pressure_rises_by_the_first_law(p, T, inflow, growth, heat_transfer):
    """p' = (gamma - 1)/V (c_p T_s m' - p V' + hA (T_amb - T)) - p V'/V."""
    gas = EnergyBalance(heat_transfer)
    V = 1e-4
    mass = p * V / (GAS_CONSTANT * T)
    energy = p * V / 0.4
    content = {"air_mass": mass, "internal_energy": energy}
    air = gas.air(content, V, AMBIENT)
    assert air.pressure == pytest.approx(p)
    assert air.temperature == pytest.approx(T)
    flow = Flow(inflow, SPECIFIC_HEAT_CONSTANT_PRESSURE * 300.0 * inflow)
    rates = gas.rates(content, air, flow, growth, AMBIENT)
    expected = (
        0.4 / V * (1004.675 * 300.0 * inflow - p * growth + heat_transfer * (WARM - T))
        - p * growth / V
    )
    found = 0.4 * rates["internal_energy"] / V - 0.4 * energy * growth / V**2
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-3)
    assert rates["air_mass"] == inflow


def test_the_specific_heats_are_those_of_dry_air():
    assert pytest.approx(1005, abs=1.0) == SPECIFIC_HEAT_CONSTANT_PRESSURE
    assert (
        pytest.approx(GAS_CONSTANT)
        == SPECIFIC_HEAT_CONSTANT_PRESSURE - SPECIFIC_HEAT_CONSTANT_VOLUME
    )


@pytest.mark.parametrize("gas", PROCESSES, ids=repr)
def test_what_a_process_stores_is_the_work_it_can_do(gas):
    mass = 3e-4
    small = 0.8e-4
    large = 1.7e-4
    work = quad(lambda v: gas.pressure(mass, v, AMBIENT), small, large, epsrel=1e-12)[0]
    stored = [gas.available_energy({"air_mass": mass}, v, AMBIENT) for v in (small, large)]
    assert stored[0] - stored[1] == pytest.approx(work, rel=1e-9)
    step = 1e-9
    grown = gas.available_energy({"air_mass": mass + step}, small, AMBIENT) - gas.available_energy(
        {"air_mass": mass}, small, AMBIENT
    )
    brought = gas.energy_flow({"air_mass": mass}, Flow(1.0, 0.0), small, AMBIENT)
    assert brought == pytest.approx(grown / step, rel=1e-4)


@pytest.mark.parametrize("gas", [*PROCESSES, EnergyBalance(0.0)], ids=repr)
def test_sound_travels_at_the_root_of_dp_by_drho(gas):
    """Along the gas's own process: a chamber that is squeezed a little, its mass kept."""
    V = 1e-4
    content = gas.state_at(4e5, V, AMBIENT)
    air = gas.air(content, V, AMBIENT)
    squeeze = 1e-6 * V
    rates = gas.rates(content, air, Flow(0.0, 0.0), -squeeze, AMBIENT)
    after = gas.air(
        {name: value + rates[name] for name, value in content.items()}, V - squeeze, AMBIENT
    )
    density = content["air_mass"] / V
    by_density = (after.pressure - air.pressure) / (density * 1e-6)
    assert gas.sound_speed(air) ** 2 == pytest.approx(by_density, rel=1e-5)


def test_sound_in_warm_still_air_has_its_known_speed():
    assert EnergyBalance(0.0).sound_speed(Air(1e5, 293.15)) == pytest.approx(343.2, abs=0.1)
    assert Isothermal().sound_speed(Air(1e5, 293.15)) == pytest.approx(290.1, abs=0.1)


@pytest.mark.parametrize("gas", [*PROCESSES, EnergyBalance(2.0)], ids=repr)
def test_content_and_air_are_each_others_inverse(gas):
    for pressure in (2e4, 1e5, 8e5):
        content = gas.state_at(pressure, 1e-4, AMBIENT)
        assert gas.air(content, 1e-4, AMBIENT).pressure == pytest.approx(pressure, rel=1e-12)
        assert set(content) == {s.name for s in gas.states(1e-4, AMBIENT)}


@pytest.mark.parametrize("gas", PROCESSES, ids=repr)
def test_the_slope_of_the_stored_energy_is_the_pressure(gas):
    mass = 2e-4
    volume = 9e-5
    (by_volume,) = autodiff.jvp(lambda x: [gas.energy(mass, x[0], AMBIENT)], [volume], [1.0])
    assert -by_volume == pytest.approx(gas.pressure(mass, volume, AMBIENT), rel=1e-12)


def test_the_virial_gas_is_air_and_without_coefficient_the_ideal_gas():
    """Second virial coefficients of air in cm3/mol: -8.64 at 20 °C (CIPM-2007), near -13.4 at 0 °C
    (tables).
    """
    molar = 28.96546e-3 * 1e6
    assert VirialGas().virial_coefficient * molar == pytest.approx(-8.64, abs=0.02)
    assert virial_coefficient_of_air(273.15) * molar == pytest.approx(-13.4, abs=0.4)
    assert virial_coefficient_of_air(333.15) * molar == pytest.approx(
        -1.82, abs=0.01
    )  # by hand from a_0 to a_2
    for absolute in (1e5, 6.5e5):
        density = VirialGas().air_mass(absolute, 1.0, AMBIENT)
        assert VirialGas().pressure(density, 1.0, AMBIENT) == pytest.approx(absolute, rel=1e-14)
        factor = absolute / (density * GAS_CONSTANT * WARM)
        assert factor == pytest.approx(1.0 + VirialGas().virial_coefficient * density, rel=1e-14)
        assert VirialGas(0.0).air_mass(absolute, 1.0, AMBIENT) == Isothermal().air_mass(
            absolute, 1.0, AMBIENT
        )


def test_the_speed_of_sound_of_the_virial_gas_is_the_slope_of_its_pressure():
    gas = VirialGas(2e-3)
    slope = (gas.pressure(8.001, 1.0, AMBIENT) - gas.pressure(7.999, 1.0, AMBIENT)) / 0.002
    air = Air(gas.pressure(8.0, 1.0, AMBIENT), WARM)
    assert gas.sound_speed(air) == pytest.approx(np.sqrt(slope), rel=1e-8)
