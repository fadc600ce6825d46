"""Filters with outliers, missing values and lost samples; the smoother has the least squares of all
noise.

An innovation nu is an outlier where nu^T S^-1 nu exceeds the quantile of the chi-squared
distribution at the gate.
"""

from __future__ import annotations

import numpy as np
import pytest
from control_plants import LIFT

import airmuscle as am
from airmuscle.control import (
    ExtendedKalmanFilter,
    MovingHorizonEstimator,
    StateEstimate,
    UnscentedKalmanFilter,
)
from airmuscle.core import StateVariable, System
from airmuscle.errors import ParameterError, SolveError

H = 5e-3
START = am.find_equilibrium(LIFT, pressure=2e5)
NOISE = {"air_mass": 2e-6, "speed": 0.02}
DEVIATIONS = {"air_mass": 2e-6, "position": 1e-3, "speed": 5e-3}
SIGMA = {"pressure": 500.0, "position": 2e-5}


def lift_filter(kind=ExtendedKalmanFilter, measured=("pressure", "position"), **changes):
    return kind(LIFT, measured, H, NOISE, {name: SIGMA[name] for name in measured}, **changes)


def noisy(outliers=0.0, rows=400, seed=3):
    """A lifted load that is measured with noise; a part of the pressures is wrong by 50 sigma. The
    states, and rows.
    """
    time = H * np.arange(rows)
    command = am.Schedule({"fill": ((0.2, 0.4), (0.5, 0.0)), "discharge": ((1.2, 0.3), (1.5, 0.0))})
    run = am.simulate(LIFT, command, duration=float(time[-1]), initial_state=START, output_times=H)
    kept = np.searchsorted(run["time"], time - 1e-9)
    random = np.random.default_rng(seed)
    wrong = np.where(random.random(rows) < outliers, 50.0 * SIGMA["pressure"], 0.0)
    columns = {
        "time": time,
        # the value after a jump, which is held until the next row
        "fill": np.where((time > 0.2 - 1e-9) & (time < 0.5 - 1e-9), 0.4, 0.0),
        "discharge": np.where((time > 1.2 - 1e-9) & (time < 1.5 - 1e-9), 0.3, 0.0),
        "pressure": run["pressure"][kept] + SIGMA["pressure"] * random.normal(size=rows) + wrong,
        "position": run["position"][kept] + SIGMA["position"] * random.normal(size=rows),
    }
    return {name: run[name][kept] for name in run.columns}, am.Recording(columns, "test")


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, UnscentedKalmanFilter])
def test_a_gate_keeps_outliers_out_of_the_estimate(kind):
    truth, record = noisy(outliers=0.02)
    errors = []
    for gate in (1.0, 0.9999):
        judged = lift_filter(kind, gate=gate)
        found = judged.estimate(record, judged.start(START, DEVIATIONS))
        errors.append(np.sqrt(np.mean((found["force"] - truth["force"]) ** 2)))
    assert errors[0] > 2.0 * errors[1]
    clean = noisy()[1]
    judged = lift_filter(kind)
    exact = judged.estimate(clean, judged.start(START, DEVIATIONS))["force"]
    assert errors[1] < 1.2 * np.sqrt(np.mean((exact - truth["force"]) ** 2))


def test_the_gate_refuses_the_stated_part_of_true_measurements():
    judged = lift_filter(gate=0.9)
    free = lift_filter()
    estimate = free.start(START, DEVIATIONS)
    random = np.random.default_rng(5)
    kept = 0
    _, innovation = free.correct(estimate, [2e5, START["position"]], [0.0, 0.0])
    root = np.linalg.cholesky(innovation.covariance)
    centre = np.array([2e5, START["position"]]) - innovation.difference
    for _ in range(2000):
        corrected, _ = judged.correct(estimate, centre + root @ random.normal(size=2), [0.0, 0.0])
        kept += corrected is not estimate
    assert kept / 2000 == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, UnscentedKalmanFilter])
def test_without_a_value_the_others_correct_the_estimate(kind):
    both = lift_filter(kind)
    alone = lift_filter(kind, ("position",))
    estimate = both.start(START, DEVIATIONS)
    found, innovation = both.correct(estimate, [np.nan, START["position"] + 1e-4], [0.0, 0.0])
    expected, other = alone.correct(estimate, [START["position"] + 1e-4], [0.0, 0.0])
    assert found.mean == pytest.approx(expected.mean, rel=1e-9)
    assert found.covariance == pytest.approx(expected.covariance, rel=1e-6, abs=1e-22)
    assert innovation.normalised_square == pytest.approx(other.normalised_square, rel=1e-9)
    nothing, none = both.correct(estimate, [np.nan, np.nan], [0.0, 0.0])
    assert nothing.mean == pytest.approx(estimate.mean, rel=1e-12)
    assert none.difference.size == 0


def test_lost_rows_are_bridged_by_predictions_as_rows_without_values_are():
    _, record = noisy(rows=100)
    lost = np.isin(np.arange(100), [10, 11, 12, 60, 77])
    judged = lift_filter()
    first = judged.start(START, DEVIATIONS)
    shorter = judged.estimate(
        am.Recording({n: record[n][~lost] for n in record.columns}, "test"), first
    )
    hollow = {n: record[n].copy() for n in record.columns}
    for name in SIGMA:
        hollow[name][lost] = np.nan
    expected = judged.estimate(am.Recording(hollow, "test"), first)
    # the valves are at rest in the gaps, so that the inputs of both are the same
    assert shorter["force"] == pytest.approx(expected["force"][~lost], rel=1e-9)


def test_a_gate_beyond_its_range_is_refused():
    with pytest.raises(
        ParameterError,
        match=r"ExtendedKalmanFilter: gate is 0\.0; allowed range: above 0, 1 \(no gate\)",
    ):
        lift_filter(gate=0.0)


class Oscillator(System):
    """x'' = u - 4 x - 0.4 x'."""

    states = (StateVariable("position", "m", 1.0), StateVariable("speed", "m/s", 1.0))
    inputs = ("force",)

    def rates(self, state, inputs):
        return {
            "position": state["speed"],
            "speed": inputs["force"] - 4.0 * state["position"] - 0.4 * state["speed"],
        }

    def outputs(self, state, inputs):
        return {"sum": state["position"] + 0.5 * state["speed"]}


def oscillation(rows=30):
    """A filter of the oscillator, a record with missing values, and the first estimate."""
    h = 0.1
    random = np.random.default_rng(7)
    judged = ExtendedKalmanFilter(
        Oscillator(), ("sum",), h, {"position": 0.05, "speed": 0.3}, {"sum": 0.2}
    )
    values = random.normal(size=rows)
    values[[k for k in (4, 5, 20) if k < rows]] = np.nan
    columns = {"time": h * np.arange(rows), "force": np.sin(np.arange(rows)), "sum": values}
    first = judged.start({"position": 0.2, "speed": -0.1}, {"position": 0.5, "speed": 0.7})
    return judged, am.Recording(columns, "test"), first


def noise_equations(judged, record, first):
    """Matrix and right side of all noise in standard deviations, by the states of all samples."""
    rows = len(record["time"])
    equations = []
    right = []

    def add(blocks, value, deviation):
        row = np.zeros(2 * rows)
        for k, part in blocks:
            row[2 * k : 2 * k + 2] += part
        equations.append(row / deviation)
        right.append(value / deviation)

    for i, deviation in enumerate((0.5, 0.7)):
        add([(0, np.eye(2)[i])], first.mean[i], deviation)
    for k in range(rows - 1):
        moved, f = judged.transition(np.zeros(2), [record["force"][k]])
        for i, deviation in enumerate((0.05 * 0.1**0.5, 0.3 * 0.1**0.5)):
            add([(k + 1, np.eye(2)[i]), (k, -f[i])], moved[i], deviation)
    for k in np.flatnonzero(np.isfinite(record["sum"])):
        add([(k, np.array([1.0, 0.5]))], record["sum"][k], 0.2)
    return np.array(equations), np.array(right)


def test_the_smoother_of_a_linear_plant_has_the_least_squares_of_all_noise():
    """All states of all samples as unknowns of one least-squares problem, an independent
    solution.
    """
    judged, record, first = oscillation()
    found = judged.smooth(record, first)
    exact = np.linalg.lstsq(*noise_equations(judged, record, first), rcond=None)[0].reshape(-1, 2)
    assert np.column_stack([found["position"], found["speed"]]) == pytest.approx(
        exact, rel=1e-8, abs=1e-10
    )


def test_smoothed_estimates_of_a_lift_are_closer_than_filtered_ones():
    """The truth has the noise of the filter, by the simulated plant."""
    judged = lift_filter(measured=("position",))
    random = np.random.default_rng(11)
    stepper = am.engine.Stepper(LIFT, START)
    deviations = np.sqrt(np.diag(judged.noise))
    states = [stepper.state.copy()]
    inputs = []
    for k in range(400):
        inputs.append([0.3 * (k % 80 < 20), 0.2 * (k % 80 >= 60)])
        stepper.step(inputs[-1], H)
        stepper.state[:] += deviations * random.normal(size=3)
        states.append(stepper.state.copy())
    truth = dict(zip(judged.states, np.array(states).T, strict=True))
    fill, discharge = np.array([*inputs, [0.0, 0.0]]).T
    position = truth["position"] + SIGMA["position"] * random.normal(size=401)
    columns = {
        "time": H * np.arange(401),
        "fill": fill,
        "discharge": discharge,
        "position": position,
    }
    record = am.Recording(columns, "test")
    first = judged.start(START, {"position": 1e-5})
    filtered = judged.estimate(record, first)
    smoothed = judged.smooth(record, first)
    for name in judged.states:
        errors = [
            np.sqrt(np.mean((each[name] - truth[name]) ** 2)) for each in (filtered, smoothed)
        ]
        assert errors[1] < 0.85 * errors[0], name
    assert smoothed["force"][-1] == filtered["force"][-1]


class Lag(System):
    """y' = eps - y."""

    states = (StateVariable("y", "1", 1.0),)
    inputs = ("contraction",)

    def rates(self, state, inputs):
        return {"y": inputs.get("contraction", 0.0) - state["y"]}

    def outputs(self, state, inputs):
        return {"double": 2.0 * state["y"]}


class Decay(Lag):
    inputs = ()


@pytest.mark.parametrize(
    ("plant", "end"), [(Lag(), 0.25), (Decay(), 0.0)], ids=["converted input", "no input"]
)
def test_inputs_are_the_columns_of_a_recording_also_converted_ones_and_a_plant_may_have_none(
    plant, end
):
    judged = ExtendedKalmanFilter(plant, ("double",), 0.5, {}, {"double": 1.0})
    columns = {
        "time": 0.5 * np.arange(40),
        "double": np.full(40, np.nan),
        "length": np.full(40, 0.15),
    }
    record = am.Recording(columns, "test", {"resting_length": 0.2})
    assert judged.estimate(record, judged.start({"y": 0.0}, {}))["y"][-1] == pytest.approx(
        end, abs=1e-6
    )


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, UnscentedKalmanFilter])
def test_a_sample_needs_one_value_for_each_measured_column_and_each_input(kind):
    judged = lift_filter(kind)
    estimate = judged.start(START, DEVIATIONS)
    with pytest.raises(
        ParameterError, match=r"the measured values are \[200000\.0\], 1; needed are pressure, pos"
    ):
        judged.correct(estimate, [2e5], [0.0, 0.0])
    with pytest.raises(
        ParameterError, match=r"the inputs are \[0\.1\], 1; needed are fill, discharge"
    ):
        judged.predict(estimate, [0.1])
    with pytest.raises(
        ParameterError, match=r"the inputs are \[0\.1\], 1; needed are fill, discharge"
    ):
        judged.columns(estimate, [0.1])
    with pytest.raises(
        ParameterError, match=r"the states are \[0\.0\], 1; needed are air_mass, position, speed"
    ):
        judged.columns(StateEstimate(np.zeros(1), np.eye(1)), [0.0, 0.0])


# Moving horizon


@pytest.mark.parametrize("horizon", [1, 6, 40])
def test_without_bounds_the_moving_horizon_of_a_linear_plant_is_the_kalman_filter(horizon):
    judged, record, first = oscillation()
    kept = np.arange(30) != 12  # a lost sample
    record = am.Recording({name: record[name][kept] for name in record}, "test")
    exact = judged.estimate(record, first)
    found = MovingHorizonEstimator(judged, horizon).estimate(record, first)
    for name in judged.states:
        assert found[name] == pytest.approx(exact[name], abs=1e-9)


def test_the_moving_horizon_has_the_least_squares_within_bounds():
    """All states of all samples as unknowns of a bounded least-squares problem, an independent
    solution.
    """
    from scipy.optimize import lsq_linear

    judged, record, first = oscillation(12)
    low = -0.05
    high = 0.03
    found = MovingHorizonEstimator(judged, 40, {"position": (low, high)}).estimate(record, first)
    limits = np.tile([low, -np.inf], 12), np.tile([high, np.inf], 12)
    best = lsq_linear(
        *noise_equations(judged, record, first), limits, method="bvls", tol=1e-14
    ).x.reshape(-1, 2)
    assert (np.isclose(best[:, 0], high) | np.isclose(best[:, 0], low)).sum() > 2
    assert [found["position"][-1], found["speed"][-1]] == pytest.approx(best[-1], abs=1e-9)
    assert found["position"].min() >= low - 1e-9
    assert found["position"].max() <= high + 1e-9


def test_a_bound_that_is_known_brings_the_estimate_of_a_lift_closer():
    """The load is at rest; the filter starts with a wrong position, which its speed would
    explain.
    """
    truth, record = noisy(rows=30)
    judged = lift_filter(measured=("position",))
    first = judged.start(
        {**START, "position": START["position"] + 1e-3}, {"position": 1e-3, "speed": 0.2}
    )
    plain = judged.estimate(record, first)
    found = MovingHorizonEstimator(judged, 5, {"speed": (-2e-3, 2e-3)}).estimate(record, first)
    assert np.abs(truth["speed"]).max() < 1e-6
    assert np.abs(plain["speed"]).max() > 4e-3
    assert np.abs(found["speed"]).max() <= 2e-3 + 1e-9
    assert (
        np.abs(found["force"] - truth["force"])[-1] < np.abs(plain["force"] - truth["force"]).max()
    )


def test_an_impossible_window_is_refused():
    judged = lift_filter()
    with pytest.raises(ParameterError, match="horizon is 0; allowed range: 1 to 200"):
        MovingHorizonEstimator(judged, 0)
    with pytest.raises(ParameterError, match="bounds names 'presure'"):
        MovingHorizonEstimator(judged, 3, {"presure": (0.0, 1.0)})
    with pytest.raises(ParameterError, match="the bounds of 'speed' are 1 and 0"):
        MovingHorizonEstimator(judged, 3, {"speed": (1.0, 0.0)})
    with pytest.raises(SolveError, match="no trajectory of the window is within the bounds"):
        MovingHorizonEstimator(judged, 3, {"position": (1.0, 2.0)}).start(
            judged.start(START, {}), [2e5, START["position"]], [0.0, 0.0]
        )
