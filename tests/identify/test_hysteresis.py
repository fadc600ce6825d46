"""Friction from loops: what made a loop is found again, and no friction is claimed where there was
none.

The verdict rests on AICc and the F test over rows that are independent, and on a second run where
there is one.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from airmuscle.bench import (
    ContractionPath,
    Creep,
    FixedCharacteristic,
    PolynomialCurve,
    PressurePath,
    fit_creep,
    fit_hysteresis,
    initial_friction_laws,
    motion_direction,
)
from airmuscle.bench.estimation import aicc, effective_sample_size, f_test_p_value
from airmuscle.bench.hysteresis import branch_gap, loop_path, plot_loops, repeat_difference
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.physics import (
    BoucWen,
    Braid,
    Dahl,
    IdentifiedFriction,
    LoopScales,
    LuGre,
    MaxwellSlip,
    NoFriction,
    PrandtlIshlinskii,
    VirtualWork,
)
from airmuscle.recording import Recording

LENGTH = 0.2
LIMITS = (3e-4, 1.2e-3, 5e-3)
SLIP = MaxwellSlip((2e4, 1e4, 3e3), LIMITS)
TRUE = [
    Dahl(3e4, 20.0),
    BoucWen(3e4, 20.0, 2.0, 0.8),
    SLIP,
    PrandtlIshlinskii(SLIP.stiffnesses, LIMITS, (6.0, -6.0), (0.6, -0.5)),
]


def name(law):
    return type(law).__name__


def isobaric(friction, noise=0.2, seed=1, pressure=3e5):
    """A loop of contraction with inner loops at constant pressure, its forces falling with
    contraction.
    """
    turns = (0.0, 0.12, 0.08, 0.11, 0.06, 0.12, 0.0)
    contraction = np.concatenate([np.linspace(a, b, 60) for a, b in itertools.pairwise(turns)])
    rng = np.random.default_rng(seed)
    static = 400.0 - 2500.0 * contraction - 3000.0 * contraction**2
    force = static - (friction.force_along(contraction * LENGTH) if friction else 0.0)
    columns = {
        "time": np.arange(contraction.size) * 0.1,
        "pressure": np.full(contraction.size, pressure),
        "contraction": contraction,
        "force": force + noise * rng.standard_normal(contraction.size),
    }
    return Recording(columns, "loop", {"resting_length": LENGTH})


def start_of(law):
    """Far from the truth, with the same limits and thresholds."""
    stiff = {"stiffnesses": tuple(3e3 for _ in LIMITS)} if hasattr(law, "limits") else {}
    more = {"weights": (0.0, 0.0)} if isinstance(law, PrandtlIshlinskii) else {}
    if isinstance(law, BoucWen):
        more = {"stiffness": 8e3, "coulomb_force": 60.0, "sharpness": 1.2, "unloading": 1.5}
    if isinstance(law, Dahl):
        more = {"stiffness": 8e3, "coulomb_force": 60.0}
    return replace(law, **stiff, **more)


CURVE = PolynomialCurve("contraction", 2)


@pytest.mark.parametrize("law", TRUE, ids=name)
def test_the_friction_that_made_a_loop_is_found_again(law):
    run = isobaric(law)
    fit = fit_hysteresis(start_of(law), run, static_curve=CURVE, friction_path=ContractionPath())
    made, found = (x.force_along(fit.series.path) for x in (law, fit.friction))
    assert np.abs(made - found - np.mean(made - found)).max() < 0.25
    assert fit.rmse == pytest.approx(0.2, rel=0.1)
    assert fit.rmse_without_friction > 5.0
    assert fit.residual_gap < 0.02 * fit.gap
    assert fit.justified
    assert fit.verdict.endswith("The data justify this friction.")


def test_the_parameters_of_dahl_and_of_the_slips_come_back():
    dahl = fit_hysteresis(start_of(TRUE[0]), isobaric(TRUE[0]), static_curve=CURVE).friction
    assert (dahl.stiffness, dahl.coulomb_force) == pytest.approx((3e4, 20.0), rel=0.02)
    slips = fit_hysteresis(start_of(SLIP), isobaric(SLIP), static_curve=CURVE).friction
    assert slips.stiffnesses == pytest.approx(SLIP.stiffnesses, rel=0.03)


def test_a_given_characteristic_takes_the_place_of_the_curve():
    law = VirtualWork(Braid(0.01, 0.4363, LENGTH))
    run = isobaric(SLIP)
    force = (
        law.force(run["pressure"], run["contraction"])
        + 3.0
        - SLIP.force_along(run["contraction"] * LENGTH)
    )
    fit = fit_hysteresis(
        start_of(SLIP), run.with_columns(force=force), static_curve=FixedCharacteristic(law)
    )
    assert fit.coefficients == pytest.approx([3.0], abs=1e-6)
    assert fit.friction.stiffnesses == pytest.approx(SLIP.stiffnesses, rel=1e-6)


def test_an_isometric_ramp_shows_friction_on_the_pressure():
    pressure = np.concatenate([np.linspace(0, 6e5, 150), np.linspace(6e5, 0, 150)])
    slide = PressurePath()
    friction = MaxwellSlip((3e3, 1e3), (4e-4, 2e-3))
    force = 5e-4 * pressure - friction.force_along(slide.displacement_per_pressure * pressure)
    run = Recording({"pressure": pressure, "force": force}, "ramp")
    fit = fit_hysteresis(
        MaxwellSlip((1.0, 1.0), friction.limits),
        run,
        static_curve=PolynomialCurve("pressure", 1),
        friction_path=slide,
    )
    assert fit.friction.stiffnesses == pytest.approx(friction.stiffnesses, rel=1e-3)


def test_lugre_uses_the_time_of_the_rows():
    law = LuGre(3e4, 10.0, 10.0, 0.003)
    run = isobaric(None, 0.0)
    path = run["contraction"] * LENGTH
    time = np.cumsum(np.repeat([0.02, 0.1, 1.0, 0.05, 0.1, 0.5], 60))
    rng = np.random.default_rng(2)
    force = run["force"] - law.force_along(path, time) + 0.1 * rng.standard_normal(time.size)
    fit = fit_hysteresis(
        LuGre(1e4, 20.0, 3.0, 0.01), run.with_columns(time=time, force=force), static_curve=CURVE
    )
    assert fit.rmse < 0.15
    assert fit.friction.coulomb_force == pytest.approx(10.0, rel=0.1)
    slow = fit_hysteresis(
        Dahl(1e4, 20.0), run.with_columns(time=time, force=force), static_curve=CURVE
    )
    assert slow.rmse > 3 * fit.rmse


def test_without_friction_none_is_claimed():
    """At most one of 60 loops of noise is taken for friction: the F test alone would let through 1
    %.
    """
    claims = 0
    for seed in range(60):
        run = isobaric(None, noise=1.0, seed=seed)
        claims += fit_hysteresis(start_of(SLIP), run, static_curve=CURVE).justified
    assert claims <= 1
    assert (
        "do not justify"
        in fit_hysteresis(start_of(SLIP), isobaric(None, 1.0), static_curve=CURVE).verdict
    )


def test_a_law_without_a_parameter_is_compared_like_the_others():
    fit = fit_hysteresis(NoFriction(), isobaric(SLIP), static_curve=CURVE)
    assert fit.friction == NoFriction()
    assert fit.rmse == pytest.approx(fit.rmse_without_friction, rel=1e-12)
    assert not fit.justified


def test_drifting_errors_count_as_few_rows():
    rng = np.random.default_rng(3)
    white = rng.standard_normal(4000)
    steps = rng.standard_normal(4000)
    drifting = np.zeros(4000)
    for i in range(1, 4000):
        drifting[i] = 0.8 * drifting[i - 1] + steps[i]
    assert effective_sample_size(white) == pytest.approx(4000, rel=0.08)
    assert effective_sample_size(drifting) == pytest.approx(4000 * 0.2 / 1.8, rel=0.15)


def test_a_friction_that_does_not_carry_over_to_the_second_run_is_not_justified():
    first = isobaric(SLIP, seed=1)
    same = isobaric(SLIP, seed=2)
    without = isobaric(None, seed=3)
    good = fit_hysteresis(start_of(SLIP), first, static_curve=CURVE, repeat=(same, None))
    assert good.justified
    assert good.repeat_rmse == pytest.approx(0.2, rel=0.15)
    assert good.repeatability < 0.3
    bad = fit_hysteresis(start_of(SLIP), first, static_curve=CURVE, repeat=(without, None))
    assert bad.repeat_rmse > 3 > bad.repeat_rmse_without_friction
    assert not bad.justified


def test_the_gap_between_branches_and_between_runs_is_measured_place_by_place():
    path = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 0, 200)])
    loop = np.where(np.arange(400) < 200, -2.0, 3.0)
    way = motion_direction(path)
    assert branch_gap(path, loop, way).values == pytest.approx(5.0 * np.ones(24), abs=0.2)
    assert repeat_difference(path, loop, way, path, loop + 1.5, way).values == pytest.approx(
        1.5 * np.ones(48)
    )


def test_a_bin_weighs_by_its_rows():
    """Fifty rows per bin without a gap, and one row of another value in a bin of its own."""
    rising = np.linspace(0.0, 1.0, 1200)
    falling = np.linspace(0.95, 0.0, 1140)
    path = np.concatenate([rising, [1.0], falling])
    way = np.concatenate([np.ones(1200), [-1.0], -np.ones(1140)])
    gap = branch_gap(path, np.where(np.arange(len(path)) == 1200, 10.0, 0.0), way)
    assert gap.values.max() == pytest.approx(10.0)
    assert gap.rms < 0.5


def test_a_verdict_does_not_contradict_its_reservations():
    good = fit_hysteresis(start_of(SLIP), isobaric(SLIP), static_curve=CURVE)
    assert good.justified
    assert good.reservations == ()
    doubts = [
        (replace(good, repeatability=2.0 * good.rmse), "below the repeatability"),
        (replace(good, gap=np.nan), "no common part"),
        (
            replace(good, series=replace(good.series, direction=np.ones(len(good.series.path)))),
            "very few rows",
        ),
    ]
    for fit, reason in doubts:
        assert not fit.justified
        assert reason in fit.verdict
        assert "The data do not justify this friction." in fit.verdict


def test_a_speed_of_a_friction_driven_by_pressure_is_in_pascals_per_second():
    axis = PressurePath(1e-8).axis
    assert axis.display(1e-3, "m/s") == (pytest.approx(1e5), "Pa/s")
    assert axis.display(1e4, "N/m") == (pytest.approx(1e-4), "N/Pa")
    assert axis.display(3.0, "N") == (3.0, "N")
    assert ContractionPath().axis.display(1e-3, "m/s") == (1e-3, "m/s")


def test_an_inner_loop_belongs_to_both_branches():
    """Up, half back, up, down: both falling ways lie 5 N above the rising ones, at every place they
    share.
    """
    path = np.concatenate([np.linspace(a, b, 100) for a, b in ((0, 1), (1, 0.5), (0.5, 1), (1, 0))])
    way = motion_direction(path)
    assert [int(s) for s in way[[50, 150, 250, 350]]] == [1, -1, 1, -1]
    assert branch_gap(path, np.where(way > 0, -2.0, 3.0), way).values == pytest.approx(
        5.0 * np.ones(24)
    )
    assert not motion_direction(np.ones(20)).any()


def test_the_criteria_meet_their_definitions():
    assert aicc(2.0, 50.0, 3) == pytest.approx(50 * np.log(2.0) + 8 + 40 / 45)
    assert aicc(2.0, 5.0, 3) == np.inf
    # F = (100/80 - 1)/2 / (1/(40 - 5)) = 4.375 with 2 and 35 degrees: 0.020 (tables: 3.27 is 5 %,
    # 5.27 is 1 %)
    assert f_test_p_value(100.0, 80.0, 40.0, 5, 2) == pytest.approx(0.0201, abs=3e-4)
    assert f_test_p_value(80.0, 80.0, 40.0, 5, 2) == 1.0


def test_candidates_are_sized_by_the_data_and_all_of_them_fit():
    run = isobaric(SLIP)
    path = run["contraction"] * LENGTH
    fits = [
        fit_hysteresis(f, run, static_curve=CURVE)
        for f in initial_friction_laws(path, SLIP.force_along(path))
    ]
    assert {name(f.friction) for f in fits} == {
        "Dahl",
        "LuGre",
        "BoucWen",
        "MaxwellSlip",
        "PrandtlIshlinskii",
    }
    assert all(f.rmse < 0.35 * f.rmse_without_friction for f in fits)
    best = min(fits, key=lambda f: f.rmse)
    assert name(best.friction) in ("MaxwellSlip", "PrandtlIshlinskii")


def test_a_friction_law_without_a_guess_is_not_fitted():
    scales = LoopScales.of(np.array([0.0, 0.02]), np.array([-3.0, 3.0]))
    assert (scales.stroke, scales.amplitude, scales.stiffness) == (0.02, 3.0, 1500.0)
    assert Dahl.guess(scales) == Dahl(1500.0, 3.0)
    assert IdentifiedFriction.guess(scales) is None


def test_runs_that_cannot_tell_are_refused():
    run = isobaric(SLIP)
    with pytest.raises(IdentificationError, match="4 fitted rows along a path of"):
        fit_hysteresis(SLIP, run, static_curve=CURVE, fitted_rows=np.arange(len(run)) < 4)
    with pytest.raises(
        IdentificationError, match="friction against shortening needs the resting length"
    ):
        fit_hysteresis(SLIP, Recording(run.columns, "loop"), static_curve=CURVE)
    with pytest.raises(IdentificationError, match="0 fitted rows along a path of 0 m"):
        fit_hysteresis(SLIP, run.rows(slice(0, 0)), static_curve=CURVE)
    gap = run.with_columns(
        contraction=np.where(np.arange(len(run)) == 60, np.nan, run["contraction"])
    )
    with pytest.raises(IdentificationError, match="loop, row 61: the displacement is missing"):
        fit_hysteresis(SLIP, gap, static_curve=CURVE)
    with pytest.raises(
        IdentificationError,
        match="the displacement of the friction is constant, so it cannot be identified",
    ):
        initial_friction_laws(np.ones(9), np.ones(9))


@pytest.mark.parametrize(
    "parts", [((), ()), ((0.02,), (3.0,)), ((0.01, 0.02), (1.0, 15.0))], ids=len
)
def test_creep_with_none_one_or_two_time_constants_is_told_apart(parts):
    creep = Creep(0.1, *parts)
    time = np.arange(0.0, 60.0, 0.1)
    rng = np.random.default_rng(4)
    values = creep.value_at(time) + 2e-4 * rng.standard_normal(time.size)
    values[100] = np.nan  # a missing reading
    fit = fit_creep(Recording({"time": time + 7.0, "contraction": values}, "hold"), "contraction")
    assert fit.creep.time_constants == pytest.approx(parts[1], rel=0.1)
    assert fit.creep.amplitudes == pytest.approx(parts[0], rel=0.1)
    assert fit.rmse == pytest.approx(2e-4, rel=0.1)
    assert ("no creep", "one time constant", "two time constants")[len(parts[0])] in fit.verdict


@pytest.mark.slow
def test_creep_is_not_claimed_of_noise():
    """At most four of 100 holds of noise: 1 % by the F test, somewhat more because the time
    constant is searched.
    """
    time = np.arange(0.0, 20.0, 0.2)
    noise = (np.random.default_rng(seed).standard_normal(time.size) for seed in range(100))
    fits = [
        fit_creep(Recording({"time": time, "force": values}, "hold"), "force") for values in noise
    ]
    assert sum(bool(fit.creep.amplitudes) for fit in fits) <= 4


def test_a_hold_too_short_for_its_creep_is_said_to_be_so():
    time = np.arange(0.0, 5.0, 0.02)
    rng = np.random.default_rng(4)
    force = Creep(100.0, (10.0,), (4.0,)).value_at(time) + 0.01 * rng.standard_normal(time.size)
    fit = fit_creep(Recording({"time": time, "force": force}, "hold"), "force")
    assert "too short for the longest" in fit.verdict
    with pytest.raises(
        IdentificationError, match="12 or more rows of a hold in increasing time; there are 5"
    ):
        fit_creep(Recording({"time": time[:5], "force": force[:5]}, "hold"), "force")
    with pytest.raises(ParameterError, match="1 amplitudes and 0 time constants"):
        Creep(1.0, (1.0,))


def test_figures_show_units_and_what_was_fitted():
    figure = plot_loops(SLIP)
    assert figure.axes[0].get_xlabel() == "displacement [mm]"
    path = loop_path(SLIP.presliding_distance)
    assert (path.max(), path.min(), path[-1]) == pytest.approx(
        (2 * SLIP.presliding_distance, -2 * SLIP.presliding_distance, path.max())
    )
    fit = fit_hysteresis(start_of(SLIP), isobaric(SLIP), static_curve=CURVE)
    upper, lower = fit.plot().axes
    assert (upper.get_ylabel(), lower.get_ylabel()) == (
        "force [N]",
        "residual (model - measured) [N]",
    )
    assert "MaxwellSlip fitted to loop" in str(fit)
