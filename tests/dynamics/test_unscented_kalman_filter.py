"""The unscented Kalman filter is the Kalman filter for a linear plant, agrees with sigma points
that are computed independently for a plant that is not, is consistent by its NEES, and estimates
what the extended filter estimates.
"""

from __future__ import annotations

import numpy as np
import pytest
from control_plants import LIFT

import airmuscle as am
from airmuscle.control import (
    ExtendedKalmanFilter,
    UnscentedKalmanFilter,
    consistency_band,
    normalised_error_squared,
)
from airmuscle.core import StateVariable, System, model, parameter
from airmuscle.errors import ParameterError

H = 5e-3
NOISE = {"air_mass": 2e-6, "speed": 0.02}
START = am.find_equilibrium(LIFT, pressure=2e5)
DEVIATIONS = {"air_mass": 2e-6, "position": 1e-3, "speed": 5e-3}
RUNS = 16


@model
class Oscillator(System):
    """A linear oscillator x'' = u - k x - d x' whose position is measured."""

    stiffness: float = parameter(
        "1/s^2", "k", "stiffness over mass", bounds=(0.0, 1e6), default=40.0
    )

    states = (StateVariable("position", "m", 1.0), StateVariable("speed", "m/s", 1.0))
    inputs = ("push",)

    def rates(self, state, inputs):
        return {
            "position": state["speed"],
            "speed": inputs["push"] - self.stiffness * state["position"] - 2.0 * state["speed"],
        }

    def outputs(self, state, inputs):
        return {"sum": state["position"] + 0.1 * state["speed"]}


def lifted(kind=UnscentedKalmanFilter, **changes):
    return kind(LIFT, ("pressure",), H, NOISE, {"pressure": 500.0}, **changes)


@pytest.mark.parametrize("spread", [{}, {"alpha": 0.1, "kappa": 1.0}])
def test_for_a_linear_plant_it_is_the_kalman_filter(spread):
    given = Oscillator(), ("sum",), 0.02, {"speed": 0.3}, {"sum": 0.01}
    kalman = ExtendedKalmanFilter(*given)
    unscented = UnscentedKalmanFilter(*given, **spread)
    start = {"position": 0.1, "speed": 0.0}
    both = [judged.start(start, {"position": 0.05, "speed": 0.2}) for judged in (kalman, unscented)]
    rng = np.random.default_rng(2)
    for k in range(50):
        inputs = [float(k % 7 < 3)]
        value = [rng.normal(scale=0.05)]
        both = [
            f.correct(f.predict(e, inputs), value, inputs)[0]
            for f, e in zip((kalman, unscented), both, strict=True)
        ]
        assert both[1].mean == pytest.approx(both[0].mean, abs=1e-11)
        assert both[1].covariance == pytest.approx(both[0].covariance, rel=1e-9, abs=1e-14)


def test_a_step_is_that_of_the_sigma_points_of_filterpy():
    """Prediction and correction composed of the points and the transformation of filterpy; the
    plant is not linear.
    """
    kalman = pytest.importorskip("filterpy.kalman", reason="filterpy is not installed")
    judged = lifted(alpha=0.5, kappa=1.0)
    single = lifted(ExtendedKalmanFilter)
    inputs = [0.4, 0.0]
    moving = {**START, "speed": 0.05}
    first = judged.start(moving, {name: 20 * value for name, value in DEVIATIONS.items()})
    points = kalman.MerweScaledSigmaPoints(3, alpha=0.5, beta=2.0, kappa=1.0)
    moved = np.array(
        [single.transition(x, inputs)[0] for x in points.sigma_points(first.mean, first.covariance)]
    )
    mean, covariance = kalman.unscented_transform(moved, points.Wm, points.Wc, judged.noise)
    predicted = judged.predict(first, inputs)
    size = np.sqrt(np.diag(covariance))
    assert (predicted.mean - mean) / size == pytest.approx(0.0, abs=1e-8)
    assert predicted.covariance / np.outer(size, size) == pytest.approx(
        covariance / np.outer(size, size), abs=1e-8
    )
    again = points.sigma_points(mean, covariance)
    seen = np.array(
        [[judged.columns(predicted._replace(mean=x), inputs)["pressure"]] for x in again]
    )
    y, s = kalman.unscented_transform(seen, points.Wm, points.Wc, np.diag(judged.variances))
    cross = sum(
        w * np.outer(x - mean, z - y) for w, x, z in zip(points.Wc, again, seen, strict=True)
    )
    gain = cross / s
    estimate, innovation = judged.correct(predicted, [2.1e5], inputs)
    assert innovation.covariance == pytest.approx(s, rel=1e-8)
    assert (estimate.mean - mean - gain @ ([2.1e5] - y)) / size == pytest.approx(0.0, abs=1e-7)
    left = covariance - gain @ s @ gain.T
    assert estimate.covariance / np.outer(size, size) == pytest.approx(
        left / np.outer(size, size), abs=1e-7
    )


def test_the_average_nees_is_within_its_95_per_cent_band():
    judged = lifted()
    rng = np.random.default_rng(4)
    told = []
    spread = np.sqrt(np.diag(judged.noise))
    truth = lifted(ExtendedKalmanFilter)
    for _ in range(RUNS):
        estimate = judged.start(START, DEVIATIONS)
        state = estimate.mean + rng.normal(size=3) * np.sqrt(np.diag(estimate.covariance))
        for k in range(40):
            inputs = [0.3 * (k % 20 < 5), 0.2 * (k % 20 >= 15)]
            state = truth.transition(state, inputs)[0] + spread * rng.normal(size=3)
            estimate = judged.predict(estimate, inputs)
            exact = judged.columns(estimate._replace(mean=state), inputs)
            estimate, _ = judged.correct(
                estimate, [exact["pressure"] + 500.0 * rng.normal()], inputs
            )
        told.append(normalised_error_squared(estimate, state))
    low, high = consistency_band(3, RUNS)
    assert low < np.mean(told) < high


def test_a_state_without_variance_and_an_unknown_parameter_are_permitted():
    judged = lifted(parameters=("mechanism.mass",))
    first = judged.start(START, {"mechanism.mass": 0.5})
    estimate = judged.predict(first, [0.2, 0.0])
    assert np.isfinite(estimate.covariance).all()
    assert estimate.covariance[3, 3] == pytest.approx(0.25, rel=1e-12)
    assert estimate.covariance[2, 3] < 0.0  # a larger mass accelerates less


@pytest.mark.parametrize(
    "changes", [{"alpha": 0.0}, {"kappa": -3.0}, {"beta": float("nan")}, {"alpha": float("inf")}]
)
def test_impossible_sigma_points_are_refused(changes):
    with pytest.raises(ParameterError, match="allowed range: alpha above 0 to 10"):
        lifted(**changes)
