"""One friction for loops at several pressures: its dependence on pressure is found, and what does
not hold is refused.

The truth of these tests is a Coulomb friction with a sinusoidal presliding, which is none of the
laws that are fitted.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from airmuscle.bench import (
    ContractionPath,
    PolynomialCurve,
    find_loops,
    fit_jointly,
    fit_loop,
    identified_friction,
)
from airmuscle.bench.hysteresis import make_loop_series, search_parameters
from airmuscle.physics import (
    BoucWen,
    Dahl,
    IdentifiedFriction,
    MaxwellSlip,
    PrandtlIshlinskii,
    PressureScaledFriction,
)
from airmuscle.recording import Recording

LENGTH = 0.3
PRESLIDING = 2.5e-3
SPEED = 1e-3
LEVELS = (1e5, 3e5, 6e5)
GROWING = {1e5: 13.0, 2e5: 18.0, 3e5: 23.0, 4.5e5: 30.5, 6e5: 38.0}
TURNS = (0.02, 0.16, 0.05, 0.12, 0.02)


def sinusoidal_friction(path, coulomb):
    """Force of a deflection that is limited to the presliding distance, with a sinusoidal
    stiffness.
    """
    deflection = 0.0
    force = [0.0]
    for step in np.diff(path):
        deflection = min(max(deflection + step, -PRESLIDING), PRESLIDING)
        force.append(coulomb * np.sin(0.5 * np.pi * deflection / PRESLIDING))
    return np.array(force)


def sweep(pressure, coulomb, seed=0, density=1000):
    """An isobaric loop with a minor loop at 1 mm/s."""
    rng = np.random.default_rng(int(pressure) + seed)
    contraction = np.concatenate(
        [
            np.linspace(a, b, int(density * abs(b - a)), endpoint=False)
            for a, b in itertools.pairwise(TURNS)
        ]
    )
    path = contraction * LENGTH
    static = 2e-3 * pressure * (1.0 - 3.2 * contraction) + 40.0 * contraction**2 + 60.0
    force = static - sinusoidal_friction(path, coulomb) + 0.4 * rng.standard_normal(len(path))
    columns = {
        "time": np.cumsum(np.full(len(path), np.abs(np.diff(path)).max() / SPEED)),
        "pressure": pressure + 60.0 * rng.standard_normal(len(path)),
        "contraction": contraction,
        "force": force,
    }
    return Recording(columns, f"{pressure / 1e3:.0f} kPa", {"resting_length": LENGTH})


def joint(coulomb_forces, seed=0):
    loops = find_loops([sweep(p, f, seed) for p, f in coulomb_forces.items()])
    return fit_jointly([fit_loop(loop, elements=3) for loop in loops])


@pytest.fixture(scope="module")
def growing():
    return joint({p: GROWING[p] for p in LEVELS})


def test_friction_that_grows_with_pressure_is_found_and_predicts_a_pressure_between(growing):
    best = growing[0]
    assert best.justified
    assert isinstance(best.friction, PressureScaledFriction)
    assert best.friction.ambient_ratio == pytest.approx(8.0 / 38.0, abs=0.02)
    path = sweep(4.5e5, 0.0)["contraction"] * LENGTH
    made = sinusoidal_friction(path, GROWING[4.5e5])
    found = best.friction.pressure_factor(4.5e5) * best.friction.force_along(path)
    assert np.sqrt(np.mean((made - found) ** 2)) < 0.1 * GROWING[4.5e5]
    assert [run.amplitude for run in best.agreement] == pytest.approx(
        [GROWING[p] for p in LEVELS], rel=0.05
    )
    assert "multiplied by 0.2" in best.verdict
    assert best.verdict.endswith("The data justify this friction for all runs.")


def test_every_law_that_the_speeds_allow_gets_the_scale(growing):
    assert {fit.name for fit in growing} == {"BoucWen", "Dahl", "MaxwellSlip", "PrandtlIshlinskii"}
    assert all(isinstance(fit.friction, PressureScaledFriction) for fit in growing)


def test_the_friction_to_be_written_states_the_range_of_its_data(growing):
    written = identified_friction(growing[0].friction, growing[0].series)
    assert isinstance(written, IdentifiedFriction)
    assert written.identified_range.pressure == pytest.approx((0.88e5, 6.12e5), rel=0.02)
    assert written.max_speed == pytest.approx(SPEED, rel=0.05)


def test_a_friction_that_does_not_hold_for_all_runs_is_refused_with_the_run_and_its_numbers():
    fits = joint({1e5: 13.0, 3e5: 38.0, 6e5: 15.0})
    assert not any(fit.justified for fit in fits)
    assert "The friction does not hold for all runs" in fits[0].verdict
    assert "300 kPa (isobaric at 300 kPa): 3" in fits[0].verdict
    assert "do not justify this friction for all runs" in fits[0].verdict


def test_a_constant_friction_gets_no_scale():
    best = joint(dict.fromkeys(LEVELS, 20.0), seed=2)[0]
    assert best.justified
    assert not isinstance(best.friction, PressureScaledFriction)
    assert "The data justify no dependence of the friction on the pressure" in best.verdict


def test_a_run_without_a_pressure_leaves_the_dependence_on_pressure_untested():
    """Its mean pressure is unknown, so that no scale over the pressure can be fitted to the
    runs.
    """
    fits = [
        fit_loop(loop, elements=3)
        for loop in find_loops([sweep(p, GROWING[p]) for p in (1e5, 3e5, 6e5)])
    ]
    without = [
        dataclasses.replace(f, series=dataclasses.replace(f.series, pressure=None))
        for f in fits[0].fits
    ]
    unknown = dataclasses.replace(fits[0], fits=tuple(without))
    for found in fit_jointly([unknown, *fits[1:]]):
        assert not isinstance(found.friction, PressureScaledFriction)
        assert np.isnan(found.scale_p_value)


@pytest.mark.slow
def test_two_pressures_cannot_test_the_dependence_and_one_loop_is_no_joint_fit():
    fits = joint({1e5: 13.0, 6e5: 38.0})
    assert "Two pressures determine this dependence but cannot test it." in fits[0].verdict
    loops = find_loops([sweep(3e5, 20.0)])
    assert fit_jointly([fit_loop(loops[0], elements=5)]) == ()


@pytest.mark.parametrize(
    "law",
    [
        Dahl(4e4, 30.0),
        BoucWen(4e4, 30.0, 1.5, 0.7),
        MaxwellSlip((1e4, 5e3), (1e-3, 4e-3)),
        PrandtlIshlinskii((1e4, 5e3), (1e-3, 4e-3), (9.0, -9.0), (0.5, -0.4)),
    ],
    ids=lambda law: type(law).__name__,
)
def test_the_scale_of_a_made_friction_comes_back_in_every_law(law):
    truth = PressureScaledFriction(law, 0.3, 6e5)
    runs = []
    for pressure in LEVELS:
        run = sweep(pressure, 0.0)
        path = run["contraction"] * LENGTH
        force = run["force"] - truth.pressure_factor(pressure) * law.force_along(path)
        curve = PolynomialCurve("contraction", 2)
        runs.append(make_loop_series(run.with_columns(force=force), curve, ContractionPath(), None))
    start = PressureScaledFriction(law, 0.8, 6e5)
    found, _ = search_parameters(start, runs)
    assert found.ambient_ratio == pytest.approx(0.3, abs=0.02)
    assert found.reference_pressure == 6e5


def test_the_figure_shows_each_run_and_the_joint_fit_over_the_pressure(growing):
    (axes,) = growing[0].plot().axes
    assert axes.get_xlabel() == "gauge pressure [kPa]"
    assert axes.get_ylabel() == "friction, half its range [N]"
    line = axes.lines[0]
    assert np.interp(600.0, line.get_xdata(), line.get_ydata()) == pytest.approx(38.0, rel=0.05)
