"""The extended Kalman filter estimates contraction and force from the pressure alone; it is
consistent: the average NEES of independent runs is within its 95 % band, and leaves it where the
stated noise is wrong. For a linear plant it is the Kalman filter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from control_plants import LIFT

import airmuscle as am
from airmuscle.control import (
    ExtendedKalmanFilter,
    StateEstimate,
    consistency_band,
    normalised_error_squared,
)
from airmuscle.engine import RungeKutta4, Stepper, advance
from airmuscle.engine.compile import compile_system, derivatives
from airmuscle.errors import ParameterError, SolveError

H = 5e-3
PLANT = LIFT
NOISE = {"air_mass": 2e-6, "speed": 0.02}
START = am.find_equilibrium(PLANT, pressure=2e5)
DEVIATIONS = {"air_mass": 2e-6, "position": 1e-3, "speed": 5e-3}

COMMAND = am.Schedule({"fill": ((0.2, 0.4), (0.5, 0.0)), "discharge": ((1.2, 0.3), (1.5, 0.0))})


def at_samples(run):
    """The rows of a recording at the sampling instants, without those that the input adds between
    them.
    """
    phase = run["time"] / H
    kept = np.flatnonzero(np.abs(phase - np.round(phase)) < 1e-6)
    return am.Recording({name: run[name][kept] for name in run.columns}, "test")


def the_filter(**changes):
    given = {
        "measured": ("pressure",),
        "sample_time": H,
        "process_noise": NOISE,
        "measurement_noise": {"pressure": 500.0},
    }
    return ExtendedKalmanFilter(PLANT, **{**given, **changes})


RUNS = 24


def average_nees(judged, samples=40, seed=1):
    """NEES, averaged over runs, at the last sample; the truth has the noise of `the_filter`, by the
    simulated plant.
    """
    rng = np.random.default_rng(seed)
    true_filter = the_filter()
    truth = Stepper(PLANT, START)
    spread = np.sqrt(np.diag(true_filter.noise))
    told = []
    for _ in range(RUNS):
        estimate = judged.start(START, DEVIATIONS)
        state = estimate.mean + rng.normal(size=3) * np.sqrt(np.diag(estimate.covariance))
        for k in range(samples):
            inputs = [0.3 * (k % 20 < 5), 0.2 * (k % 20 >= 15)]
            truth.state[:] = state
            truth.step(inputs, H)
            state = truth.state + spread * rng.normal(size=3)
            estimate = judged.predict(estimate, inputs)
            exact = true_filter.columns(StateEstimate(state, estimate.covariance), inputs)
            estimate, _ = judged.correct(
                estimate, [exact["pressure"] + 500.0 * rng.normal()], inputs
            )
        told.append(normalised_error_squared(estimate, state))
    return float(np.mean(told))


def test_the_average_nees_is_within_its_95_per_cent_band():
    low, high = consistency_band(3, RUNS)
    assert low < average_nees(the_filter()) < high


def test_a_filter_that_is_told_too_little_noise_leaves_the_band():
    told = the_filter(process_noise={name: 0.2 * value for name, value in NOISE.items()})
    assert average_nees(told) > consistency_band(3, RUNS)[1]


def test_the_band_is_that_of_the_chi_squared_distribution():
    low, high = consistency_band(4, 50)
    assert (low, high) == pytest.approx((3.25, 4.82), abs=0.01)


def test_the_prediction_is_that_of_the_matrix_exponential_of_scipy():
    """To 1e-11 of the largest change; also with a stiff valve, and with an unknown mass as a
    further state.
    """
    from scipy.linalg import expm

    stiff = am.load("joint-dmsp-20-proportional").plant
    for plant, measured in ((PLANT, "pressure"), (stiff, "left.pressure")):
        judged = ExtendedKalmanFilter(plant, (measured,), H, {}, {measured: 500.0})
        start = judged.start(am.find_equilibrium(plant, pressure=2e5), {}).mean
        inputs = [0.3] * len(plant.inputs)
        at = derivatives(compile_system(plant), start, inputs)
        n = len(start)
        sizes = judged.magnitudes
        wide = np.zeros((n + 1, n + 1))
        wide[:n] = H * np.column_stack([at.rates_by_state * sizes, at.rates]) / sizes[:, None]
        exact = expm(wide)
        mean, matrix = judged.transition(start, inputs)
        assert (mean - start) / sizes == pytest.approx(
            exact[:n, n], rel=1e-11, abs=1e-11 * np.abs(exact[:n, n]).max()
        )
        assert matrix * sizes / sizes[:, None] == pytest.approx(exact[:n, :n], rel=1e-10, abs=1e-11)


def test_the_error_of_the_prediction_falls_with_the_third_power_of_the_sample_time():
    """Of the position, from a state that moves; the local error of a method of second order."""
    moving = {**START, "speed": 0.1}
    errors = []
    exact_steps = RungeKutta4(1e-5)
    for h in (4e-3, 2e-3):
        judged = the_filter(sample_time=h)
        mean = judged.predict(judged.start(moving, {}), [0.5, 0.0]).mean
        exact = advance(PLANT, moving, {"fill": 0.5, "discharge": 0.0}, h, exact_steps)
        errors.append(abs(mean[judged.states.index("speed")] - exact["speed"]))
    assert errors[1] < errors[0] / 6.0


def test_the_transition_matrix_is_the_derivative_of_the_simulation():
    judged = the_filter()
    inputs = {"fill": 0.3, "discharge": 0.0}
    matrix = judged.transition(judged.start(START, {}).mean, list(inputs.values()))[1]
    for j, name in enumerate(judged.states):
        step = 1e-4 * max(abs(START[name]), 1e-2)
        ends = [
            advance(PLANT, {**START, name: START[name] + sign * step}, inputs, H)
            for sign in (1, -1)
        ]
        difference = np.array([(ends[0][n] - ends[1][n]) / (2 * step) for n in judged.states])
        assert matrix[:, j] == pytest.approx(
            difference, rel=0.03, abs=0.03 * np.abs(difference).max()
        )


def test_contraction_and_force_follow_from_the_pressure_alone():
    """3 % of the range, with a wrong first estimate and a load that is right; the valves' commands
    are known.
    """
    run = am.simulate(
        PLANT,
        COMMAND,
        duration=2.0,
        initial_state=START,
        output_times=H,
        integrator=RungeKutta4(H / 10),
    )
    noisy = run["pressure"] + np.random.default_rng(3).normal(scale=500.0, size=len(run["time"]))
    kept = np.isclose((run["time"] / H) % 1.0, 0.0, atol=1e-6) | np.isclose(
        (run["time"] / H) % 1.0, 1.0, atol=1e-6
    )
    columns = {name: run[name][kept] for name in ("time", "fill", "discharge")}
    record = am.Recording({**columns, "pressure": noisy[kept]}, "test")
    judged = the_filter()
    first = judged.start({**START, "position": START["position"] + 2e-3}, DEVIATIONS)
    estimated = judged.estimate(record, first)
    late = estimated["time"] > 0.3
    for name in ("contraction", "force"):
        error = np.abs(estimated[name] - run[name][kept])[late].max()
        assert error <= 0.03 * np.ptp(run[name]), name


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"measured": ("presure",)},
            "measured names 'presure'; there are .*Did you mean 'pressure'",
        ),
        ({"process_noise": {"pressure": 1.0}}, "process_noise names 'pressure'"),
        ({"measurement_noise": {}}, "measurement_noise has no number for 'pressure'"),
        ({"sample_time": -1.0}, "'sample_time' is -1.0; it must be positive"),
    ],
)
def test_an_incomplete_filter_is_refused(changes, message):
    with pytest.raises(ParameterError, match=message):
        the_filter(**changes)


def test_a_measurement_that_is_not_finite_is_refused():
    judged = the_filter()
    estimate = judged.start({**START, "air_mass": 1e-4}, {})
    with pytest.raises(
        SolveError, match="ExtendedKalmanFilter: the measured values must be finite"
    ):
        judged.correct(estimate, [float("inf")], [0.0, 0.0])


def test_the_load_is_estimated_from_position_and_pressure():
    """The mass of the filter's plant is 30 % too large; the mass is a further state."""
    wrong = replace(PLANT, mechanism=replace(PLANT.mechanism, mass=1.3 * PLANT.mechanism.mass))
    run = at_samples(am.simulate(PLANT, COMMAND, duration=2.0, initial_state=START, output_times=H))
    noise = {**NOISE, "mechanism.mass": 0.05}
    judged = ExtendedKalmanFilter(
        wrong,
        ("pressure", "position"),
        H,
        noise,
        {"pressure": 500.0, "position": 2e-5},
        parameters=("mechanism.mass",),
    )
    estimated = judged.estimate(run, judged.start(START, {**DEVIATIONS, "mechanism.mass": 1.0}))
    assert estimated["mechanism.mass"][-1] == pytest.approx(PLANT.mechanism.mass, rel=0.02)
    assert estimated["mechanism.mass"][0] > 1.1 * PLANT.mechanism.mass


def test_a_disturbance_is_estimated_as_the_rate_that_the_plant_lacks():
    """A mass of 1.3 m accelerates as m does with the disturbance F/(1.3 m) - F/m; at rest the force
    is 1.3 m g.
    """
    mechanism = PLANT.mechanism
    heavy = replace(PLANT, mechanism=replace(mechanism, mass=1.3 * mechanism.mass))
    rest = am.find_equilibrium(heavy, pressure=3e5)
    record = at_samples(
        am.simulate(
            heavy,
            am.Schedule({"fill": ((0, 0),)}),
            duration=1.0,
            initial_state=rest,
            output_times=H,
        )
    )
    judged = ExtendedKalmanFilter(
        PLANT,
        ("pressure", "position"),
        H,
        {**NOISE, "speed.disturbance": 5.0},
        {"pressure": 100.0, "position": 1e-5},
        disturbances=("speed",),
    )
    estimated = judged.estimate(
        record, judged.start(rest, {**DEVIATIONS, "speed.disturbance": 3.0})
    )
    assert estimated["speed.disturbance"][-1] == pytest.approx(-0.3 * 9.80665, rel=0.02)


def test_a_recording_whose_time_counts_from_1970_is_estimated_as_one_from_0():
    judged = the_filter()
    time = H * np.arange(20.0)
    first = judged.start(START, DEVIATIONS)
    found = [
        judged.estimate(
            am.Recording({"time": time + begin, "pressure": np.full(20, 2e5)}, "test"), first
        )["force"]
        for begin in (0.0, 1.7e9)
    ]
    assert np.array_equal(*found)


def test_rows_at_other_intervals_are_refused():
    judged = the_filter()
    record = am.Recording(
        {"time": np.array([0.0, H, 2.5 * H]), "pressure": np.full(3, 2e5)}, "test"
    )
    with pytest.raises(ParameterError, match=r"the rows must be 0\.005 s apart"):
        judged.estimate(record, judged.start(START, {}))
