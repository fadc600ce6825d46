"""Recursive least squares give the fit to all samples, and name the point that adds most to it."""

from __future__ import annotations

import numpy as np
import pytest
from widths import widened

from airmuscle.bench import UNCENSORED, BenchLimits, RecursiveFit, fit
from airmuscle.bench.statics import NextPoint
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.physics import ContractileSurface, ValidityRange
from airmuscle.recording import Recording

LIMITS = BenchLimits(ValidityRange(0.0, 6e5, 0.0, 0.25), 1500.0)
SIGMA = 2.0


def truth(pressure, contraction):
    """A force that is no polynomial."""
    return (
        2.2e-3 * pressure * (1.0 - 3.5 * contraction)
        + 30.0 * np.tanh(10 * contraction)
        - 40 * contraction
    )


def samples(count: int, seed: int = 3):
    rng = np.random.default_rng(seed)
    pressure = rng.uniform(0, 6e5, count)
    contraction = rng.uniform(0, 0.25, count)
    return pressure, contraction, truth(pressure, contraction) + SIGMA * rng.standard_normal(count)


def fitted(count: int, **options) -> RecursiveFit:
    result = RecursiveFit(LIMITS, **options)
    for row in zip(*samples(count), strict=True):
        result = result.updated(*map(float, row))
    return result


def test_the_coefficients_are_those_of_the_fit_to_all_samples():
    pressure, contraction, force = samples(400)
    # the range of the data is the limits
    pressure[:4] = (0.0, 6e5, 0.0, 6e5)
    contraction[:4] = (0.0, 0.0, 0.25, 0.25)
    recursive = RecursiveFit(LIMITS)
    for row in zip(pressure, contraction, force, strict=True):
        recursive = recursive.updated(*map(float, row))
    data = Recording({"pressure": pressure, "contraction": contraction, "force": force}, "made")
    whole = fit(ContractileSurface.blank(), data, censoring=UNCENSORED)
    assert recursive.model.coefficients == pytest.approx(
        whole.model.coefficients, rel=1e-5, abs=1e-4
    )
    residuals = recursive.model.polynomial(pressure, contraction) - force
    assert recursive.rmse == pytest.approx(float(np.sqrt(np.mean(residuals**2))), rel=1e-6)


def test_the_standard_error_of_a_prediction_is_that_of_repeated_measurements():
    predictions = []
    errors = []
    for seed in range(60):
        result = RecursiveFit(LIMITS, degree=2)
        rng = np.random.default_rng(seed)
        for p, c in zip(rng.uniform(0, 6e5, 60), rng.uniform(0, 0.25, 60), strict=True):
            result = result.updated(p, c, 1e-3 * p - 400 * c + SIGMA * rng.standard_normal())
        force, error = result.force(3e5, 0.1)
        predictions.append((force - 260.0) / error)
        errors.append(error)
    assert 0.75 < np.std(predictions) < 1.3
    assert abs(np.mean(predictions)) < 0.45


def test_points_that_are_chosen_one_by_one_determine_more_than_points_on_a_path():
    chosen = RecursiveFit(LIMITS, degree=3, sigma=SIGMA)
    path = RecursiveFit(LIMITS, degree=3, sigma=SIGMA)
    for i in range(60):
        point = chosen.next_point()
        chosen = chosen.updated(
            point.pressure, point.contraction, float(truth(point.pressure, point.contraction))
        )
        path = path.updated(1e4 * i, 0.004 * i, float(truth(1e4 * i, 0.004 * i)))
    assert chosen.determined > 0.9
    assert path.determined < 0.5
    with pytest.raises(
        IdentificationError, match=r"the samples determine the force on \d+ % of the range"
    ):
        _ = path.model


def test_the_next_point_keeps_to_the_greatest_force():
    limited = RecursiveFit(BenchLimits(LIMITS.validity_range, 400.0), degree=3)
    for row in zip(*samples(200), strict=True):
        limited = limited.updated(*map(float, row))
    for _ in range(30):
        point = limited.next_point()
        assert isinstance(point, NextPoint)
        assert point.force <= 400.0
        limited = limited.updated(point.pressure, point.contraction, point.force)


def test_forgetting_follows_a_muscle_that_changes():
    kept = fitted(300, degree=2)
    forgetting = fitted(300, degree=2, forgetting=0.98)
    for p, c, f in zip(*samples(300, seed=9), strict=True):
        kept, forgetting = (
            r.updated(float(p), float(c), float(f) + 50.0) for r in (kept, forgetting)
        )
    changed = float(truth(3e5, 0.1)) + 50.0
    assert abs(forgetting.force(3e5, 0.1)[0] - changed) < 0.4 * abs(
        kept.force(3e5, 0.1)[0] - changed
    )


@pytest.mark.parametrize("forgetting", [1.0, 0.99, 0.97])
def test_the_standard_deviation_of_a_force_does_not_depend_on_how_much_is_forgotten(forgetting):
    noises = []
    for seed in range(4):
        result = RecursiveFit(LIMITS, degree=2, sigma=70.0, forgetting=forgetting)
        rng = np.random.default_rng(seed)
        for p, c in zip(rng.uniform(0, 6e5, 500), rng.uniform(0, 0.25, 500), strict=True):
            result = result.updated(p, c, 1e-3 * p - 400 * c + SIGMA * rng.standard_normal())
        noises.append(result.noise)
    assert np.mean(noises) == pytest.approx(SIGMA, rel=0.12)


def test_samples_that_are_soon_forgotten_do_not_determine_their_standard_deviation():
    """With a factor of 0.9 the weights add up to 10 at most, less than twice the 6 coefficients."""
    assert fitted(300, degree=2, forgetting=0.9, sigma=70.0).noise == 70.0


def test_samples_outside_the_limits_are_counted_and_left_out():
    result = RecursiveFit(LIMITS, degree=1).updated(7e5, 0.1, 900.0).updated(3e5, 0.1, 500.0)
    assert (result.samples, result.outside) == (1, 1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"degree": 12}, "degree is 12; allowed range: 0 to 9"),
        (
            {"forgetting": 0.2},
            "forgetting 0.2 .*; allowed range: sigma and force above 0, forgetting 0.5 to 1",
        ),
        ({"sigma": 0.0}, "sigma is 0"),
    ],
)
def test_options_out_of_their_range_are_refused(options, message):
    with pytest.raises(ParameterError, match=message):
        RecursiveFit(LIMITS, **options)


@pytest.mark.parametrize("forgetting", widened([1.0, 0.95], lambda forgetting: forgetting < 1.0))
def test_the_standard_error_is_the_spread_of_the_predictions(forgetting):
    """Forces of a surface of degree 1 with noise: 250 repetitions at one point; their spread is
    known to 5 %.
    """
    rng = np.random.default_rng(5)
    pressure = rng.uniform(0, 6e5, 80)
    contraction = rng.uniform(0, 0.25, 80)
    clean = 1e-3 * pressure - 900 * contraction
    found = []
    for _ in range(250):
        fit = RecursiveFit(LIMITS, degree=1, forgetting=forgetting)
        for row in zip(pressure, contraction, clean + SIGMA * rng.standard_normal(80), strict=True):
            fit = fit.updated(*map(float, row))
        found.append((*fit.force(4e5, 0.1), fit.noise))
    force, stated, noise = np.transpose(found)
    assert np.std(force) == pytest.approx(np.mean(stated), rel=0.15)
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(SIGMA, rel=0.03)


def test_the_noise_is_by_the_weights_of_the_samples_and_their_squares():
    """sigma^2 = SS/(W - tr(M^-1 M_2)), with the sums of all samples at once."""
    fit = fitted(60, degree=2, forgetting=0.93)
    count = 60
    kept = 0.93
    pressure, contraction, force = samples(count)
    terms = fit._terms(pressure, contraction)
    weights = kept ** np.arange(count - 1.0, -1.0, -1.0)
    first, second = ((terms.T * w) @ terms for w in (weights, weights**2))
    residuals = force - terms @ np.linalg.solve(first, terms.T @ (weights * force))
    freedom = weights.sum() - np.trace(np.linalg.solve(first, second))
    assert fit.noise == pytest.approx(np.sqrt(np.sum(weights * residuals**2) / freedom), rel=1e-4)
