"""Statistics of friction, creep and volume fits against their formulas, and the chosen limits from
both sides.
"""

from __future__ import annotations

import dataclasses
import itertools
import pickle

import numpy as np
import pytest
from scipy import stats

from airmuscle.bench import (
    Creep,
    FrictionStage,
    HysteresisFit,
    LoopFit,
    PolynomialCurve,
    RunAgreement,
    find_holds,
    find_loops,
    fit_creep,
    fit_hysteresis,
    fit_jointly,
    identified_friction,
)
from airmuscle.bench.hysteresis import (
    Axis,
    DataLimits,
    agreement_of_run,
    data_limits,
    force_amplitude,
    parameters_on_bounds,
)
from airmuscle.bench.hysteresis.creep import _drifts, _fit_elements
from airmuscle.bench.statics import VolumePoints, fit_volume, volume_points
from airmuscle.errors import AirmuscleWarning, ColumnError, IdentificationError
from airmuscle.physics import Dahl, IdentifiedFriction, MaxwellSlip, NoFriction
from airmuscle.recording import Recording

LENGTH = 0.3
CURVE = PolynomialCurve("contraction", 2)
SLIP = MaxwellSlip((2e4, 1e4), (4e-4, 2e-3))


def loop(noise: float = 0.5, seed: int = 0, shift: float = 0.0, memory: float = 0.0) -> Recording:
    """Two loops of contraction with friction; the noise is that of a first-order process with a
    memory.
    """
    contraction = np.concatenate(
        [np.linspace(a, b, 150) for a, b in itertools.pairwise((0.02, 0.16, 0.02, 0.16, 0.02))]
    )
    white = noise * np.random.default_rng(seed).standard_normal(contraction.size)
    coloured = np.zeros(contraction.size)
    for i in range(contraction.size):
        coloured[i] = memory * coloured[i - 1] + np.sqrt(1.0 - memory**2) * white[i]
    force = 900.0 - 4000.0 * contraction - SLIP.force_along(contraction * LENGTH) + coloured + shift
    columns = {
        "time": 0.1 * np.arange(force.size),
        "pressure": np.full(force.size, 3e5),
        "contraction": contraction,
    }
    return Recording({**columns, "force": force}, "loop", {"resting_length": LENGTH})


def fitted(recording: Recording, repeat: Recording | None = None) -> HysteresisFit:
    second = None if repeat is None else (repeat, None)
    return fit_hysteresis(SLIP, recording, static_curve=CURVE, repeat=second)


def independent_rows(residuals: np.ndarray) -> float:
    centred = residuals - residuals.mean()
    r = max(float(centred[1:] @ centred[:-1] / (centred @ centred)), 0.0)
    return residuals.size * (1.0 - r) / (1.0 + r)


# Friction of one run


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_evidence_of_a_friction_counts_its_parameters_and_those_of_the_curve_over_independent_rows(
    memory: float,
):
    fit = fitted(loop(12.0, memory=memory))
    with_friction = fit.series.fitted_residuals(fit.friction)
    without = fit.series.fitted_residuals(None)
    n = independent_rows(with_friction)
    square = np.mean(with_friction**2)
    plain = np.mean(without**2)
    freedom = n - 5  # three coefficients of the curve and two stiffnesses
    expected = stats.f.sf((plain - square) / 2 / (square / freedom), 2, freedom)
    assert fit.effective_sample_size == pytest.approx(n)
    assert np.log(fit.p_value) == pytest.approx(np.log(expected), rel=1e-6)

    def criterion(mean_square: float, k: int) -> float:
        return n * np.log(mean_square) + 2 * k + 2 * k * (k + 1) / (n - k - 1)

    assert fit.aicc_reduction == pytest.approx(criterion(plain, 4) - criterion(square, 6))


def test_too_few_independent_residuals_leave_aicc_undefined_and_are_no_nan():
    """The residuals change so slowly that fewer of them are independent than the model has
    parameters.
    """
    fit = fitted(loop(60.0, memory=0.999).rows(slice(None, None, 15)))
    assert fit.effective_sample_size < 7
    assert fit.aicc_reduction == -np.inf
    assert not fit.justified
    assert "AICc is not defined for so few independent residuals" in fit.verdict
    (found,) = find_loops([loop()])
    table = LoopFit(found, (fit,), {}).chapter().tables[0]
    assert list(table.columns["reduction of AICc"].values) == [None]


def test_a_fitted_loop_is_shown_by_print_and_in_a_notebook_also_after_it_was_sent():
    (found,) = find_loops([loop()])
    fit = pickle.loads(pickle.dumps(LoopFit(found, (fitted(loop()),), {"Dahl": "no speed"})))
    assert found.description in str(fit)
    assert "Dahl was not fitted: no speed" in str(fit)
    assert "<table" in fit._repr_html_()
    assert len(repr(fit)) < 1000


def test_the_repeatability_is_the_standard_deviation_of_two_runs():
    fit = fitted(loop(0.0), loop(0.0, shift=3.0))
    assert fit.repeatability == pytest.approx(np.std([0.0, 3.0], ddof=1), rel=1e-6)


@pytest.mark.parametrize(("kept", "is_named"), [(28, True), (34, False)])
def test_a_branch_with_less_than_a_tenth_of_the_rows_of_the_other_is_named(
    kept: int, is_named: bool
):
    fit = fitted(loop())
    rows = fit.series.direction > 0
    falling = np.flatnonzero(fit.series.direction < 0)
    rows[falling[:: falling.size // kept][:kept]] = True
    thinned = dataclasses.replace(fit, series=dataclasses.replace(fit.series, fitted_rows=rows))
    assert ("One branch has very few rows" in " ".join(thinned.reservations_of_rows)) == is_named


# Agreement of runs


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_the_amplitude_of_a_run_has_the_scatter_of_repeated_runs_as_its_standard_error(
    memory: float,
):
    runs = [fitted(loop(4.0, seed, memory=memory)) for seed in range(40)]
    found = [agreement_of_run(SLIP, run, "", 3e5) for run in runs]
    scatter = np.std([each.amplitude for each in found], ddof=1)
    assert np.mean([each.amplitude_stderr for each in found]) == pytest.approx(scatter, rel=0.4)
    assert np.mean([each.amplitude for each in found]) == pytest.approx(
        force_amplitude(runs[0].series, SLIP), rel=0.05
    )


@pytest.mark.parametrize(
    ("deviation", "p_value", "disagrees"),
    [(0.19, 0.001, False), (0.21, 0.001, True), (0.21, 0.011, False)],
)
def test_a_run_disagrees_if_it_deviates_by_a_fifth_and_significantly(deviation, p_value, disagrees):
    assert RunAgreement("run", "", 3e5, 10.0, 1.0, 10.0, deviation, p_value).disagrees == disagrees


def test_the_range_of_an_identified_friction_is_that_of_its_pressures_without_the_extreme_hundredths():
    series = dataclasses.replace(fitted(loop()).series, pressure=np.linspace(1e5, 2e5, 600))
    friction = identified_friction(SLIP, [series])
    assert isinstance(friction, IdentifiedFriction)
    margin = 0.02 * 1.99e5
    assert (friction.min_pressure, friction.max_pressure) == pytest.approx(
        (1.01e5 - margin, 1.99e5 + margin), rel=1e-6
    )


@pytest.mark.parametrize(("ratio", "is_tested"), [(1.15, False), (1.25, True)])
def test_a_dependence_on_pressure_is_tested_from_a_ratio_of_pressures_of_1_2_on(
    ratio: float, is_tested: bool
):
    recordings = [
        dataclasses.replace(
            loop(seed=i).with_columns(pressure=np.full(600, level)), origin=f"{level:g}"
        )
        for i, level in enumerate((3e5, 3e5 * ratio))
    ]
    loops = find_loops(recordings)
    (joint,) = fit_jointly([LoopFit(each, (fitted(each.recording),), {}) for each in loops])
    assert np.isfinite(joint.scale_p_value) == is_tested


def test_a_campaign_whose_loops_cannot_be_fitted_together_names_no_friction():
    """One of two loops has no law: the muscle has no friction, although the other loop alone would
    justify one.
    """
    runs = [
        loop(seed=i).with_columns(pressure=np.full(600, level))
        for i, level in enumerate((2e5, 4e5))
    ]
    first, second = find_loops(
        [dataclasses.replace(run, origin=f"loop {i}") for i, run in enumerate(runs)]
    )
    alone = LoopFit(first, (fitted(first.recording),), {})
    stage = FrictionStage(NoFriction(), (alone, LoopFit(second, (), {})), fit_jointly([alone]))
    assert alone.recommended is not None
    assert (
        stage.verdict
        == "Fewer than two loops can be fitted together; the muscle is written without friction."
    )
    single = dataclasses.replace(stage, friction=alone.recommended.friction, loops=(alone,))
    assert single.verdict.startswith(alone.recommended.verdict)


# Limits by the data


def test_the_speeds_of_the_data_are_those_without_the_lowest_and_the_highest_twentieth():
    path = np.linspace(0.0, 0.04, 4001)  # 40 intervals of 1 mm
    speeds = np.repeat(np.linspace(1e-3, 41e-3, 40), 100)
    time = np.concatenate([[0.0], np.cumsum(np.diff(path) / speeds)])
    limits = data_limits(np.ones(4001), path, time, np.ones(4001, dtype=bool))
    expected = np.quantile(np.linspace(2e-3, 40e-3, 39), [0.05, 0.95])
    assert [limits.low_speed, limits.high_speed] == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize(("ratio", "varies"), [(2.9, False), (3.1, True)])
def test_speeds_that_differ_by_a_factor_of_three_determine_terms_of_speed(
    ratio: float, varies: bool
):
    assert DataLimits(100.0, 1e-3, ratio * 1e-3).has_speed_variation == varies


@pytest.mark.parametrize(("force", "on_bound"), [(98.0, False), (99.5, True)])
def test_a_force_within_a_hundredth_of_the_maximum_force_is_on_its_bound(
    force: float, on_bound: bool
):
    found = parameters_on_bounds(Dahl(3e4, force), DataLimits(100.0, np.nan, np.nan))
    assert bool(found) == on_bound


def test_parameters_of_a_friction_along_the_pressure_have_pascals_in_place_of_metres():
    axis = Axis("pressure", 1.0, "Pa", 1e8)  # 1e8 Pa correspond to a metre
    displayed = {unit: axis.display(2.0, unit) for unit in ("m", "m/s", "N/m", "N s/m", "1", "N")}
    assert displayed == {
        "m": (2e8, "Pa"),
        "m/s": (2e8, "Pa/s"),
        "N/m": (2e-8, "N/Pa"),
        "N s/m": (2e-8, "N s/Pa"),
        "1": (2.0, ""),
        "N": (2.0, "N"),
    }


# Creep


def hold(
    creep: Creep, noise: float, duration: float = 100.0, rows: int = 400, seed: int = 1
) -> Recording:
    time = np.linspace(0.0, duration, rows)
    force = creep.value_at(time) + noise * np.random.default_rng(seed).standard_normal(rows)
    return Recording({"time": time, "force": force}, "hold")


def test_evidence_of_creep_counts_two_parameters_of_each_element():
    recording = hold(Creep(100.0, (-1.0,), (10.0,)), 0.8, rows=40)
    fit = fit_creep(recording, "force")
    larger = _fit_elements(recording["time"], recording["force"], 2).creep
    n = independent_rows(larger.value_at(recording["time"]) - recording["force"])
    squares = np.square(fit.rmse_by_order)
    for count in (1, 2):
        freedom = n - (1 + 2 * count)
        ratio = (squares[count - 1] - squares[count]) / 2 / (squares[count] / freedom)
        assert fit.p_values[count - 1] == pytest.approx(stats.f.sf(ratio, 2, freedom), rel=1e-6)


def test_close_time_constants_are_not_separated():
    recording = hold(Creep(100.0, (-5.0, -5.0), (6.0, 12.0)), 1e-4)
    first, second = _fit_elements(recording["time"], recording["force"], 2).creep.time_constants
    assert second >= 2.999 * first


def test_a_time_constant_up_to_twice_the_hold_is_found():
    fit = fit_creep(hold(Creep(100.0, (-5.0,), (170.0,)), 1e-4), "force")
    assert fit.creep.time_constants == pytest.approx((170.0,), rel=0.02)


@pytest.mark.parametrize(("change", "drifts"), [(2.3, False), (3.2, True)])
def test_a_quantity_drifts_if_its_quarters_differ_by_two_standard_deviations(
    change: float, drifts: bool
):
    noise = np.random.default_rng(3).standard_normal(20_000)
    assert _drifts(100.0 + noise + change * np.linspace(0.0, 1.0, 20_000)) == drifts


@pytest.mark.parametrize(("difference", "count"), [(4e-4, 1), (7e-4, 2)])
def test_lengths_that_differ_by_more_than_five_hundredths_of_a_per_cent_are_two_holds(
    difference: float, count: int
):
    contraction = 0.1 + difference * np.concatenate(
        [np.zeros(200), np.linspace(0.0, 1.0, 300), np.ones(200)]
    )
    time = 0.1 * np.arange(700)
    columns = {"time": time, "pressure": np.full(700, 3e5), "contraction": contraction}
    recording = Recording(
        {**columns, "force": 100.0 + 50.0 * np.exp(-time / 10.0)}, "hold", {"resting_length": 0.3}
    )
    assert [each.quantity for each in find_holds(recording)] == ["force"] * count


# Volume


def test_a_mass_flow_is_integrated_by_the_trapezoidal_rule_and_its_end_is_the_last_twentieth():
    time = np.concatenate([np.linspace(0.0, 1.0, 10), np.linspace(1.0, 2.0, 91)[1:]])  # uneven rows
    flow = np.where(time < 1.9, 1e-4 * time, 0.0)
    mass = np.concatenate([[0.0], np.cumsum((flow[1:] + flow[:-1]) / 2 * np.diff(time))])
    volume = 5e-5
    columns = {
        "time": time,
        "pressure": mass * 287.05 * 293.15 / volume,
        "contraction": np.zeros(time.size),
    }
    (found,) = volume_points([Recording({**columns, "mass_flow": flow}, "fill")]).volume
    assert found == pytest.approx(volume, rel=1e-9)
    late = dataclasses.replace(
        Recording({**columns, "air_mass": mass + 1e-5 * (time < 1.9)}, "fill"), constants={}
    )  # a mass that is wrong until the last rows
    expected = (mass[-5:].mean() - mass[:5].mean() - 1e-5) * 287.05 * 293.15
    rise = columns["pressure"][-5:].mean() - columns["pressure"][:5].mean()
    assert volume_points([late]).volume[0] == pytest.approx(expected / rise, rel=1e-9)


def test_the_standard_deviation_and_the_criterion_of_a_polynomial_are_those_of_linear_least_squares():
    contraction = np.linspace(0.0, 0.25, 12)
    volume = (
        6e-5 + 2e-5 * np.sin(14 * contraction) + 3e-7 * np.random.default_rng(1).standard_normal(12)
    )
    fit = fit_volume(VolumePoints(contraction, volume, 0), 0.2)
    degree = len(fit.geometry.coefficients) - 1
    design = np.vander(contraction, degree + 1)
    coefficients, square, *_ = np.linalg.lstsq(design, volume, rcond=None)
    covariance = square[0] / (12 - degree - 1) * np.linalg.inv(design.T @ design)
    at = np.array([0.01, 0.13, 0.24])
    rows = np.vander(at, degree + 1)
    assert fit.geometry.volume(at) == pytest.approx(rows @ coefficients, rel=1e-9)
    assert fit.standard_deviation(at) == pytest.approx(
        np.sqrt(np.sum(rows @ covariance * rows, axis=1)), rel=1e-5
    )
    k = degree + 2
    criterion = 12 * np.log(square[0] / 12) + 2 * k + 2 * k * (k + 1) / (12 - k - 1)
    assert fit.aicc[f"polynomial of degree {degree}"] == pytest.approx(criterion, rel=1e-9)


# No rows


def test_a_recording_without_rows_is_refused_or_left_out_by_name():
    empty = dataclasses.replace(loop().rows(slice(0, 0)), origin="empty.csv")
    with pytest.raises(
        IdentificationError, match=r"empty\.csv: a fit of creep needs 12 or more rows"
    ):
        fit_creep(empty, "force")
    with pytest.raises(ColumnError, match=r"empty\.csv: the recording has no rows"):
        volume_points([empty])
    with pytest.raises(IdentificationError, match=r"empty\.csv: the recording has no rows"):
        find_loops([empty])
    with pytest.warns(AirmuscleWarning, match=r"left out: empty\.csv: the recording has no rows"):
        assert len(find_loops([empty, loop()])) == 1


def test_creep_is_fitted_to_a_contraction_or_a_force_only():
    time = np.arange(20.0)
    rows = Recording({"time": time, "length": 0.2 + 1e-3 * np.exp(-time)}, "hold.csv")
    with pytest.raises(
        IdentificationError,
        match=r"hold.csv: creep of the column 'length' .*'contraction' or 'force'",
    ):
        fit_creep(rows, "length")
    assert fit_creep(rows.with_constants(resting_length=0.21), "contraction").verdict
