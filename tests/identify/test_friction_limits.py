"""Limits of friction parameters: a muscle has no greater friction than its force, and no speed that
was not measured.

A transition below the resolution of the path is not seen, so that it bounds the stiffness. Terms of
speed need loops at clearly different speeds; rows in which valves pulse justify no friction.
"""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from airmuscle.bench import (
    ContractionPath,
    PolynomialCurve,
    classify_records,
    find_loops,
    fit_hysteresis,
    fit_jointly,
    fit_loop,
    preferred_fit,
)
from airmuscle.bench.campaign import fit_friction_stage
from airmuscle.bench.hysteresis import data_limits, make_loop_series
from airmuscle.physics import BoucWen, CreepElements, Dahl, LuGre, MaxwellSlip
from airmuscle.recording import Recording

LENGTH = 0.3
CURVE = PolynomialCurve("contraction", 1)
TURNS = (0.02, 0.16, 0.02, 0.16, 0.02)


def loop(friction, speeds, noise=0.5, rows=120):
    """An isobaric loop with one speed [m/s] for each of its four legs."""
    legs = list(itertools.pairwise(TURNS))
    contraction = np.concatenate([np.linspace(a, b, rows, endpoint=False) for a, b in legs])
    time = np.cumsum(
        np.repeat(
            [abs(b - a) * LENGTH / rows / v for (a, b), v in zip(legs, speeds, strict=True)], rows
        )
    )
    rng = np.random.default_rng(11)
    force = 900.0 - 4000.0 * contraction + noise * rng.standard_normal(time.size)
    force = force - friction.force_along(contraction * LENGTH, time)
    columns = {
        "time": time,
        "pressure": np.full(time.size, 4e5),
        "contraction": contraction,
        "force": force,
    }
    return Recording(columns, "loop", {"resting_length": LENGTH})


@pytest.mark.parametrize("initial", [1e3, 1.5e4, 9e4])
def test_the_terms_of_speed_of_one_speed_stay_within_the_force_of_the_muscle_and_are_not_justified(
    initial,
):
    run = loop(Dahl(4e4, 25.0), (2e-3,) * 4)
    fit = fit_hysteresis(LuGre(4e4, 20.0, initial, 1e-3), run, static_curve=CURVE)
    greatest = float(np.abs(run["force"]).max())
    assert 0.0 <= fit.friction.stribeck_force <= greatest
    assert fit.friction.damping <= greatest / 2e-3
    assert not fit.justified
    assert (
        "The speed in the data is 0.002 to 0.002 m/s, so the terms of speed cannot be identified"
        in fit.verdict
    )


def test_a_loop_at_one_speed_leaves_out_a_law_with_terms_of_speed_and_says_why():
    found = fit_loop(find_loops([loop(Dahl(4e4, 25.0), (1e-3,) * 4)])[0], elements=3)
    assert "LuGre" not in {type(fit.friction).__name__ for fit in found.fits}
    assert "measure loops at clearly different speeds" in found.failed["LuGre"]


def test_loops_at_different_speeds_determine_the_stribeck_curve():
    run = loop(LuGre(4e4, 15.0, 12.0, 3e-3), (1e-3, 1e-3, 4e-3, 2e-2), noise=0.1)
    fit = fit_hysteresis(LuGre(3e4, 20.0, 5.0, 5e-3), run, static_curve=CURVE)
    assert (fit.friction.coulomb_force, fit.friction.stribeck_force) == pytest.approx(
        (15.0, 12.0), rel=0.05
    )
    assert fit.friction.stribeck_speed == pytest.approx(3e-3, rel=0.05)
    assert not any(
        "measure loops at clearly different speeds" in reason for reason in fit.reservations
    )


def test_parameters_that_the_data_do_not_determine_are_named_in_words():
    run = loop(Dahl(4e4, 25.0), (1e-3, 2e-3, 4e-3, 2e-2))
    fit = fit_hysteresis(LuGre(4e4, 20.0, 5.0, 5e-3), run, static_curve=CURVE)
    assert "stribeck_speed" in fit.undetermined
    assert "determined" in str(fit.weak_combinations[0])
    assert (
        "A law with terms of speed is justified only if all of its parameters are determined."
        in fit.verdict
    )
    assert not fit.justified


def test_the_speeds_of_the_data_are_those_of_the_legs_whatever_the_noise():
    rng = np.random.default_rng(3)
    run = loop(Dahl(4e4, 25.0), (1e-3, 2e-3, 4e-3, 2e-2))
    path = run["contraction"] * LENGTH + 1e-5 * rng.standard_normal(len(run))
    limits = data_limits(run["force"], path, run["time"], np.ones(len(run), dtype=bool))
    assert (limits.low_speed, limits.high_speed) == pytest.approx((1e-3, 2e-2), rel=0.1)
    assert limits.force == np.abs(run["force"]).max()


def test_no_element_slides_at_a_greater_force_than_that_of_the_muscle():
    run = loop(Dahl(4e4, 25.0), (2e-3,) * 4)
    slips = MaxwellSlip((1.0, 1.0, 1.0), (1e-9, 2e-9, 1e-3))
    fit = fit_hysteresis(slips, run, static_curve=CURVE)
    forces = np.array(fit.friction.stiffnesses) * fit.friction.limits
    assert forces.max() <= np.abs(run["force"]).max() * (1 + 1e-9)


def test_the_pulses_of_valves_are_no_friction():
    """Steps of the pressure with a force sensor that lags by 30 ms, without any friction, and all
    rows fitted.
    """
    levels = np.concatenate([np.linspace(1e5, 5e5, 9), np.linspace(4.5e5, 1e5, 8)])
    time = np.arange(0.0, 2.0 * levels.size, 0.02)
    target = levels[np.minimum((time / 2.0).astype(int), levels.size - 1)]
    pressure = np.empty_like(time)
    lagged = np.empty_like(time)
    p = levels[0]
    f = levels[0]
    for i, goal in enumerate(target):
        p += 0.02 / 0.4 * (goal - p)
        f += 0.02 / 0.3 * (p - f)
        pressure[i] = p
        lagged[i] = f
    rng = np.random.default_rng(5)
    columns = {
        "time": time,
        "pressure": pressure + 100.0 * rng.standard_normal(time.size),
        "contraction": np.full(time.size, 0.05),
        "force": 1.5e-3 * lagged + 0.5 * rng.standard_normal(time.size),
    }
    recording = Recording(columns, "steps", {"resting_length": LENGTH})
    found = fit_loop(find_loops([recording], all_rows=True, degree=1)[0], elements=3)
    assert min(fit.p_value for fit in found.fits) < 0.01, (
        "by the tests alone this would be a friction"
    )
    assert found.recommended is None
    assert (
        "the pulses of valves and the dynamics of the gas appear as friction"
        in found.fits[0].verdict
    )


def sharp_loop(bar, coulomb_force, rows=300, seed=0):
    """Friction that is complete within a micrometre, on a displacement that is read to 0.01 mm."""
    random = np.random.default_rng(seed)
    turns = np.array(TURNS)
    path = np.interp(np.linspace(0.0, 4.0, rows), np.arange(5.0), turns) * LENGTH
    contraction = np.round(path / 1e-5) * 1e-5 / LENGTH
    force = 200.0 * bar * (1.0 - contraction / 0.32) ** 1.5 + random.normal(0.0, 3.0, rows)
    force -= Dahl(5e7, coulomb_force).force_along(contraction * LENGTH)
    columns = {
        "time": 0.1 * np.arange(rows),
        "pressure": np.full(rows, bar * 1e5),
        "contraction": contraction,
    }
    return Recording({**columns, "force": force}, f"{bar} bar", {"resting_length": LENGTH})


@pytest.mark.parametrize("initial", [Dahl(1e8, 20.0), BoucWen(1e8, 20.0, 5.0, 0.6)])
def test_a_stiffness_is_bounded_by_the_resolution_of_the_path(initial):
    """Rows at a tenth of a millimetre, then rows that repeat the readings of a hundredth."""
    for rows in (1680, 30_000):
        run = sharp_loop(3.0, 20.0, rows)
        assert (
            1e6
            < make_loop_series(run, CURVE, ContractionPath(), None).limits.stiffness
            < 1.5 * 20.0 / 1e-5
        )
    fit = fit_hysteresis(initial, sharp_loop(3.0, 20.0), static_curve=CURVE)
    assert fit.friction.stiffness < 1e6
    assert "stiffness" in fit.undetermined


def test_a_stiffness_that_the_path_shows_is_not_bounded():
    fit = fit_hysteresis(Dahl(1e4, 10.0), loop(Dahl(4e4, 25.0), (2e-3,) * 4), static_curve=CURVE)
    assert fit.friction.stiffness == pytest.approx(4e4, rel=0.05)
    assert not fit.undetermined


def test_a_law_with_open_parameters_gives_way_to_a_simpler_one_that_fits_as_well():
    def fit(friction, rmse, undetermined=(), justified=True):
        return SimpleNamespace(
            friction=friction, rmse=rmse, undetermined=undetermined, justified=justified
        )

    dahl = Dahl(1e5, 20.0)
    bouc_wen = BoucWen(1e5, 20.0, 20.0, 0.6)
    open_sharpness = fit(bouc_wen, 3.50, ("sharpness",))
    assert preferred_fit([open_sharpness, fit(dahl, 3.56, ("stiffness",))]).friction is dahl
    assert preferred_fit([open_sharpness, fit(dahl, 3.90)]).friction is bouc_wen
    assert preferred_fit([open_sharpness, fit(dahl, 3.56, justified=False)]).friction is bouc_wen
    assert preferred_fit([fit(bouc_wen, 3.50), fit(dahl, 3.56)]).friction is bouc_wen
    assert preferred_fit([fit(dahl, 3.5, justified=False)]) is None


def test_a_campaign_and_the_loops_alone_prefer_the_same_law():
    runs = [
        sharp_loop(bar, force, seed=i)
        for i, (bar, force) in enumerate([(2.0, 16.0), (3.5, 22.0), (5.0, 28.0)])
    ]
    alone = preferred_fit(
        fit_jointly([fit_loop(found) for found in find_loops(runs, all_rows=True)])
    )
    stage = fit_friction_stage(classify_records(runs), CreepElements(), lambda _: None)
    assert alone.name == stage.selected.name == "Dahl"
