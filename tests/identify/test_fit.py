"""A fit returns what made the data, says how sure it is, and refuses what the data cannot tell.

Noise-free points give the parameters back. Standard deviations are those of repeated experiments.
Points cut off at the ends of the range of force bound the law and do not bend it. Where nothing is
cut off the answers are those of scipy and lmfit. Neither units nor scales change them. What cannot
be told apart is named.
"""

from __future__ import annotations

import dataclasses
import datetime
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import curve_fit
from widths import widened

import airmuscle
from airmuscle.bench import (
    UNCENSORED,
    Censoring,
    Fit,
    Huber,
    LeastSquares,
    Loss,
    confidence_band,
    fit,
    read_csv,
)
from airmuscle.core import model, ops, parameter
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.files import load, load_data
from airmuscle.physics import (
    Braid,
    Clamped,
    ContractileSurface,
    ContractionLaw,
    MartensBoblan2017,
    Parabola,
    PressureLaw,
    Saga2007,
    Sarosi2012,
    StraightFibre,
    TonduLopez2000,
)
from airmuscle.physics.muscle.characteristic import LINE_A, exponents
from airmuscle.recording import Recording
from airmuscle.report import render_page

DATA = Path(airmuscle.__file__).parent / "files" / "library" / "data"
WIDE = {"min_force": -1e6, "max_force": 1e6}
MUSCLE = Sarosi2012(1.2e-4, 420.0, -57.0, -8.7e-3, 2.7e-3, -310.0)
"""Near to what the measured map of the DMSP-20-300 gives."""


def points(
    force, *, n: int = 200, seed: int = 1, noise: float = 0.0, high: float = 0.25
) -> Recording:
    """Scattered points of a law, with noise [N] on the force."""
    random = np.random.default_rng(seed)
    pressure = random.uniform(0.5e5, 6e5, n)
    contraction = random.uniform(-0.02, high, n)
    measured = force(pressure, contraction) + noise * random.standard_normal(n)
    return Recording({"pressure": pressure, "contraction": contraction, "force": measured}, "bench")


def surface(degree: int = 2, *, seed: int = 3, **clamp: float) -> ContractileSurface:
    size = len(exponents(degree))
    coefficients = np.random.default_rng(seed).uniform(-100, 100, size)
    coefficients[0] += 400.0
    limits = {**WIDE, **clamp}
    return ContractileSurface(tuple(coefficients), 0.5e5, 6e5, -0.02, 0.25, degree=degree, **limits)


def sheet(degree: int, recording: Recording) -> np.ndarray:
    """The design matrix of a surface, written out once more."""
    scaled = []
    for name in ("contraction", "pressure"):
        values = recording[name]
        scaled.append(2 * (values - values.min()) / np.ptp(values) - 1)
    return np.column_stack([scaled[0] ** i * scaled[1] ** j for i, j in exponents(degree)])


# What made the data comes back


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_a_surface_gives_its_forces_back(degree: int):
    truth = surface(degree)
    recording = points(truth.force)
    found = fit(ContractileSurface.blank(degree, **WIDE), recording)
    assert found.rank == len(exponents(degree))
    assert np.abs(found.residuals).max() < 1e-9
    boxed = truth.with_validity_range(
        found.validity_range.pressure, found.validity_range.contraction
    )
    refitted = fit(boxed, points(boxed.force))
    assert refitted.values == pytest.approx(boxed.coefficients, abs=1e-8)


def test_laws_that_are_not_linear_give_their_parameters_back():
    recording = points(lambda p, c: Clamped(MUSCLE).force(p, c))
    start = Clamped(Sarosi2012(1e-3, 200.0, -30.0, -1e-3, 1e-3, -200.0))
    found = fit(start, recording)
    assert found.names == tuple(f"inner.a{i}" for i in range(1, 7))
    assert found.values == pytest.approx(
        [MUSCLE.a1, MUSCLE.a2, MUSCLE.a3, MUSCLE.a4, MUSCLE.a5, MUSCLE.a6], rel=1e-7
    )
    assert found.model == start.__class__(dataclasses.replace(found.model.inner))


def test_what_is_fixed_stays():
    braid = Braid(0.0095, 0.42, 0.3)
    recording = points(TonduLopez2000(braid, 1.3).force, high=0.2)
    found = fit(TonduLopez2000(Braid(0.0095, 0.5, 0.3), 1.1), recording, fixed=("geometry.radius",))
    assert found.names == ("geometry.braid_angle", "end_correction")
    assert found.values == pytest.approx([0.42, 1.3], rel=1e-9)
    assert found.model.geometry.radius == 0.0095
    assert found.model.geometry.resting_length == 0.3


@model
class HungLoad(ContractionLaw):
    """eps = m (1 - exp(-p/p_0)) - c F, for these tests."""

    most: float = parameter(
        "1", "m", "contraction without load at full pressure", bounds=(0.0, 1.0)
    )
    knee: float = parameter("Pa", "p_0", "pressure of two thirds of it")
    compliance: float = parameter("1/N", "c", "contraction lost to a newton")

    def contraction(self, pressure, force):
        return self.most * (1.0 - ops.exp(-pressure / self.knee)) - self.compliance * force


class Untraced(HungLoad):
    """The same law, as one whose formula cannot be traced."""

    traceable: ClassVar[bool] = False


@model
class NeededPressure(PressureLaw):
    """P = p_0 + a eps^2 + b F, for these tests."""

    threshold: float = parameter("Pa", "p_0", "pressure that lifts the rubber off")
    stiffness: float = parameter("Pa", "a", "pressure per contraction squared")
    area: float = parameter("Pa/N", "b", "pressure per newton")

    def pressure(self, contraction, force):
        return self.threshold + self.stiffness * contraction**2 + self.area * force


def hung(law: HungLoad, noise: float = 0.0) -> Recording:
    random = np.random.default_rng(5)
    pressure = random.uniform(1e4, 6e5, 80)
    force = random.uniform(0, 300, 80)
    contraction = law.contraction(pressure, force) + noise * random.standard_normal(80)
    return Recording(
        {"pressure": pressure, "contraction": contraction, "force": force}, "hung loads"
    )


@pytest.mark.parametrize("kind", [HungLoad, Untraced])
def test_a_law_in_contraction_is_fitted_in_contraction(kind: type[HungLoad]):
    truth = HungLoad(0.25, 1.4e5, 3e-4)
    found = fit(kind(0.1, 5e4, 1e-4), hung(truth))
    assert found.fitted_quantity.name == "contraction"
    assert found.values == pytest.approx([0.25, 1.4e5, 3e-4], rel=1e-8)


def test_exact_derivatives_and_differences_agree_on_the_uncertainty():
    recording = hung(HungLoad(0.25, 1.4e5, 3e-4), noise=2e-3)
    exact, differences = (fit(kind(0.1, 5e4, 1e-4), recording) for kind in (HungLoad, Untraced))
    assert differences.values == pytest.approx(exact.values, rel=1e-6)
    assert differences.standard_errors == pytest.approx(exact.standard_errors, rel=1e-6)


def test_a_law_in_pressure_is_fitted_in_pressure():
    truth = NeededPressure(6e4, 5e6, 700.0)
    random = np.random.default_rng(5)
    contraction = random.uniform(0, 0.2, 60)
    force = random.uniform(0, 300, 60)
    pressure = truth.pressure(contraction, force)
    recording = Recording(
        {"pressure": pressure, "contraction": contraction, "force": force}, "bench"
    )
    found = fit(NeededPressure(0.0, 1e6, 1.0), recording)
    assert found.fitted_quantity.name == "pressure"
    assert found.values == pytest.approx([6e4, 5e6, 700.0], rel=1e-9)


def test_several_recordings_are_fitted_together():
    runs = tuple(points(surface(2).force, n=5, seed=seed) for seed in (1, 2, 3))
    found = fit(ContractileSurface.blank(2, **WIDE), runs)
    assert found.rows_used == 15
    assert np.abs(found.residuals).max() < 1e-9


# How sure


def repeats(count: int, noise: float) -> list[Fit]:
    truth = surface(2)
    clean = points(truth.force, n=60)
    random = np.random.default_rng(11)
    noisy = (clean["force"] + noise * random.standard_normal(60) for _ in range(count))
    return [
        fit(ContractileSurface.blank(2, **WIDE), clean.with_columns(force=force)) for force in noisy
    ]


@pytest.mark.slow
def test_standard_deviations_are_those_of_repeated_experiments():
    fits = repeats(800, noise=4.0)
    values = np.array([found.values for found in fits])
    stated = np.sqrt(np.mean([found.standard_errors**2 for found in fits], axis=0))
    # 800 repeats leave 2.5 % of a deviation open: four times that is allowed
    assert values.std(axis=0, ddof=1) / stated == pytest.approx(np.ones(6), abs=0.1)
    assert np.sqrt(np.mean([found.sigma**2 for found in fits])) == pytest.approx(4.0, rel=0.02)
    assert np.corrcoef(values.T) == pytest.approx(fits[0].correlations, abs=0.14)


@pytest.mark.slow
def test_robust_standard_deviations_are_those_of_repeated_experiments():
    truth = surface(1)
    clean = points(truth.force, n=80)
    random = np.random.default_rng(12)
    fits = []
    for _ in range(400):
        noise = np.where(random.random(80) < 0.1, 40.0, 4.0) * random.standard_normal(80)
        rows = clean.with_columns(force=clean["force"] + noise)
        fits.append(fit(ContractileSurface.blank(1, **WIDE), rows, loss=Huber(6.0)))
    scatter = np.std([found.values for found in fits], axis=0, ddof=1)
    stated = np.sqrt(np.mean([found.standard_errors**2 for found in fits], axis=0))
    assert scatter / stated == pytest.approx(np.ones(3), abs=0.15)


def test_a_fit_equals_lmfit():
    lmfit = pytest.importorskip("lmfit")
    recording = points(surface(3).force, n=80, noise=3.0)
    found = fit(ContractileSurface.blank(3, **WIDE), recording)
    matrix = sheet(3, recording)
    measured = recording["force"]
    names = [f"a{i}" for i in range(10)]
    start = lmfit.Parameters()
    for name in names:
        start.add(name, value=0.0)
    peer = lmfit.minimize(lambda p: matrix @ [p[name].value for name in names] - measured, start)
    assert found.values == pytest.approx([peer.params[name].value for name in names], rel=1e-6)
    assert found.standard_errors == pytest.approx(
        [peer.params[name].stderr for name in names], rel=1e-5
    )
    assert found.correlations[0, 9] == pytest.approx(peer.params["a0"].correl["a9"], abs=1e-6)
    assert found.sigma == pytest.approx(np.sqrt(peer.redchi), rel=1e-9)


def test_a_weighted_fit_equals_curve_fit():
    recording = points(MUSCLE.force, noise=3.0, high=0.1, seed=2)
    sigma = np.random.default_rng(1).uniform(1.0, 4.0, len(recording))
    measured = (np.stack([recording["pressure"], recording["contraction"]]), recording["force"])

    def law(x, *a):
        return Sarosi2012(*(float(v) for v in a)).force(*x)

    start = [1e-4, 400.0, -50.0, -8e-3, 3e-3, -300.0]
    scale = np.abs(start)
    peer, covariance = curve_fit(
        lambda x, *u: law(x, *(u * scale)),
        *measured,
        p0=start / scale,
        sigma=sigma,
        xtol=1e-13,
        ftol=1e-13,
    )
    found = fit(Sarosi2012(*start), recording, sigma=sigma, censoring=UNCENSORED)
    assert found.values == pytest.approx(peer * scale, rel=1e-5)
    assert found.standard_errors == pytest.approx(np.sqrt(np.diag(covariance)) * scale, rel=1e-4)


def test_figures_of_quality_are_their_formulas():
    recording = points(surface(1).force, n=40, noise=5.0)
    found = fit(ContractileSurface.blank(1, **WIDE), recording)
    measured = recording["force"]
    errors = sheet(1, recording) @ np.linalg.lstsq(sheet(1, recording), measured)[0] - measured
    assert found.rmse == pytest.approx(np.sqrt(np.mean(errors**2)))
    assert found.sigma == pytest.approx(np.sqrt(np.sum(errors**2) / 37))
    assert found.r2 == pytest.approx(
        1 - np.sum(errors**2) / np.sum((measured - measured.mean()) ** 2)
    )
    assert found.ik == pytest.approx(np.sqrt(found.r2))
    worst = int(np.argmax(np.abs(errors)))
    extreme = found.max_error
    assert extreme.error == pytest.approx(errors[worst])
    assert (extreme.pressure, extreme.contraction) == (
        recording["pressure"][worst],
        recording["contraction"][worst],
    )


def test_a_law_worse_than_the_mean_has_no_correlation_index():
    recording = points(lambda p, c: 100.0 + 0.0 * p + np.sin(1e4 * c), n=60)
    found = fit(TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.0), recording, fixed=("geometry.radius",))
    assert found.r2 < 0
    assert found.ik is None
    assert f"1 - SSE/SST = {found.r2:.4g}" in str(found)


# Cut off


def slack_and_taut(noise: float = 0.0) -> tuple[ContractileSurface, Recording]:
    """A muscle that is slack in about a third of the points."""
    truth = surface(2, min_force=0.0)
    truth = dataclasses.replace(truth, coefficients=(100.0, -400.0, 30.0, 250.0, -90.0, 20.0))
    clean = points(truth.polynomial, noise=noise)
    return truth, clean.with_columns(force=np.maximum(clean["force"], 0.0))


def test_points_at_zero_force_do_not_bend_the_surface():
    _, recording = slack_and_taut()
    start = ContractileSurface.blank(2)
    found, as_zeros = fit(start, recording), fit(start, recording, censoring=UNCENSORED)
    assert 50 < found.rows_censored < 100
    taut = recording["force"] > 0
    assert np.abs(found.residuals).max() < 1e-8
    assert np.abs(as_zeros.residuals[taut]).max() > 10.0
    assert as_zeros.rows_censored == 0


def test_with_noise_too_the_cut_off_points_are_better_left_to_bound():
    truth, recording = slack_and_taut(noise=4.0)
    start = ContractileSurface.blank(2)
    taut = truth.polynomial(recording["pressure"], recording["contraction"]) > 0
    right = truth.force(recording["pressure"], recording["contraction"])
    off = [
        np.sqrt(np.mean((fit(start, recording, censoring=c).modelled - right)[taut] ** 2))
        for c in (None, UNCENSORED)
    ]
    assert off[0] < 2.0
    assert off[1] > 3 * off[0]


def test_slack_points_forbid_a_pull_where_nothing_else_was_measured():
    """Taut points at low contraction alone leave the slope open; slack ones beyond hold the surface
    down.
    """
    contraction = np.concatenate([np.full(4, 0.0), np.full(4, 0.01), np.full(8, 0.2)])
    pressure = np.tile([1e5, 2e5, 3e5, 4e5], 4)
    force = np.where(contraction < 0.1, 100.0 + 50 * contraction / 0.01, 0.0)
    recording = Recording(
        {"pressure": pressure, "contraction": contraction, "force": force}, "bench"
    )
    bounded = fit(ContractileSurface.blank(1), recording)
    free = fit(ContractileSurface.blank(1), recording.rows(force > 0))
    assert free.model.polynomial(2e5, 0.2) > 100.0
    assert abs(bounded.model.polynomial(2e5, 0.2)) < 20.0


def test_points_at_the_upper_clamp_are_bounds_too():
    truth = surface(2)
    clean = points(truth.polynomial)
    limit = float(np.quantile(clean["force"], 0.8))
    recording = clean.with_columns(force=np.minimum(clean["force"], limit))
    found = fit(ContractileSurface.blank(2, max_force=limit), recording)
    assert found.rows_censored == 40
    assert found.model.polynomial(clean["pressure"], clean["contraction"]) == pytest.approx(
        clean["force"], abs=1e-8
    )


def test_a_blank_surface_does_not_limit_the_force_of_a_strong_muscle_and_a_limited_one_says_so():
    recording = points(lambda p, c: 20.0 * surface(2).polynomial(p, c))
    assert recording["force"].max() > 5000.0
    free = fit(ContractileSurface.blank(2), recording)
    assert free.modelled == pytest.approx(recording["force"], abs=1e-6)
    limit = float(np.quantile(recording["force"], 0.7))
    limited = fit(ContractileSurface.blank(2, max_force=limit), recording)
    (note,) = [note for note in limited.notes if "the law gives no greater force" in note]
    assert note.startswith("60 rows are above the upper limit of the force of the law, max_force")


def test_the_meaning_of_a_list_of_coefficients_is_stated_once():
    found = fit(ContractileSurface.blank(2), points(surface(2).force))
    chapter = dataclasses.replace(found.chapter(), plots=())
    page = render_page([chapter], Path(), title="Fit", date=datetime.date(2026, 1, 1))
    _, _, parameters = page.partition(">Parameters<")
    assert parameters.partition("</table>")[0].count("coefficients of the polynomial") == 1


def test_the_resolution_of_the_sensor_may_be_where_it_is_cut_off():
    truth, recording = slack_and_taut()
    offset = recording.with_columns(
        force=np.where(recording["force"] < 2.0, 1.3, recording["force"])
    )
    found = fit(ContractileSurface.blank(2), offset, censoring=Censoring(min_force=2.0))
    right = truth.force(recording["pressure"], recording["contraction"])
    assert np.abs(found.modelled - right).max() < 1e-8
    assert (
        abs(found.max_error.error) < 1e-8
    )  # 1.3 N read where the muscle hangs slack is no error of the law


def test_slack_points_bound_laws_in_contraction_and_pressure_too():
    """A slack muscle is shorter than its free contraction, or under less pressure than would
    tighten it.
    """
    hanging = HungLoad(0.25, 1.4e5, 3e-4)
    needed = NeededPressure(6e4, 5e6, 700.0)
    random = np.random.default_rng(5)
    force = np.where(np.arange(60) < 20, 0.0, random.uniform(1, 300, 60))
    given = random.uniform(0.02, 0.2, 60)
    more = np.where(force == 0, random.uniform(0.01, 0.1, 60), 0.0)
    shorter = {
        "pressure": 3e6 * given,
        "contraction": hanging.contraction(3e6 * given, force) + more,
    }
    softer = {"pressure": needed.pressure(given, force) - 1e5 * more, "contraction": given}
    for start, columns, truth in (
        (HungLoad(0.1, 5e4, 1e-4), shorter, [0.25, 1.4e5, 3e-4]),
        (NeededPressure(0.0, 1e6, 1.0), softer, [6e4, 5e6, 700.0]),
    ):
        recording = Recording({**columns, "force": force}, "bench")
        assert fit(start, recording, censoring=Censoring()).values == pytest.approx(truth, rel=1e-8)
        unbound = fit(start, recording)
        assert unbound.values != pytest.approx(truth, rel=1e-3)
        assert any(
            "20 rows at zero force or below are treated as measured values" in note
            for note in unbound.notes
        )


@given(st.integers(0, 10_000), st.integers(1, 3), st.sampled_from([LeastSquares(), Huber(0.5)]))
def test_no_other_coefficients_are_better(seed: int, degree: int, loss: Loss):
    """At the least of a convex sum its gradient vanishes, however wild the data and however many
    rows are cut off.
    """
    random = np.random.default_rng(seed)
    columns = {name: random.uniform(0, 1, 40) for name in ("pressure", "contraction")}
    force = np.maximum(random.normal(0, 1, 40), 0)
    found = fit(
        ContractileSurface.blank(degree), Recording({**columns, "force": force}, "noise"), loss=loss
    )
    errors = found.model.polynomial(columns["pressure"], columns["contraction"]) - force
    errors = np.where(found.censoring * errors < 0, 0.0, errors)
    influence = errors * loss.rho((errors / loss.scale) ** 2)[1]
    assert np.abs(sheet(degree, found.recording).T @ influence).max() < 1e-6


@pytest.mark.parametrize("loss", [LeastSquares(), Huber(5.0)])
@given(z=st.floats(0.0, 30.0).filter(lambda z: abs(z - 1.0) > 1e-3))
def test_a_loss_is_the_squared_residual_near_zero_and_its_derivatives_are_consistent(
    loss: Loss, z: float
):
    """rho(0) = 0 and rho'(0) = 1; beyond, rho' and rho'' are the slopes of rho and rho'."""
    assert loss.rho(np.zeros(1))[:2, 0] == pytest.approx([0.0, 1.0])
    step = 1e-4
    values = loss.rho(np.array([z + step, z + 2 * step, z + 3 * step]))
    slopes = (values[:, 2] - values[:, 0]) / (2 * step)
    assert slopes[:2] == pytest.approx(values[1:, 1], abs=1e-7)


@pytest.mark.parametrize("loss", [LeastSquares(), Huber(5.0)])
def test_both_solvers_find_the_same_robust_and_censored_fit(loss):
    """A surface inside Clamped is not known to be linear and goes through the iterating solver."""
    _, recording = slack_and_taut(noise=8.0)
    direct = fit(ContractileSurface.blank(2), recording, loss=loss)
    start = dataclasses.replace(direct.model, coefficients=(50.0,) * 6, **WIDE)
    iterated = fit(Clamped(start), recording, loss=loss)
    assert iterated.values == pytest.approx(direct.values, rel=1e-6)
    assert iterated.standard_errors == pytest.approx(direct.standard_errors, rel=1e-5)
    assert iterated.names[0] == "inner.coefficients[0]"


def test_a_robust_fit_forgets_gross_errors():
    truth = surface(2)
    recording = points(truth.force, noise=1.0)
    force = recording["force"].copy()
    force[::12] += 300.0
    spoilt = recording.with_columns(force=force)
    right = truth.force(recording["pressure"], recording["contraction"])
    start = ContractileSurface.blank(2, **WIDE)
    plain = fit(start, spoilt)
    robust = fit(start, spoilt, loss=Huber(3.0))
    assert np.sqrt(np.mean((robust.modelled - right) ** 2)) < 0.6
    assert np.sqrt(np.mean((plain.modelled - right) ** 2)) > 20.0
    assert any("Huber(scale=3.0), in N" in note for note in robust.notes)


MAPS = {"dmsp-20-300": 5, "festo-tool-dmsp-40": 5, "festo-tool-dmsp-20": 2}
SCALES = (1000.0, 10.0, 1.0, 0.1, 0.01)


def differs_in_kind(name: str, degree: int, scale: float) -> bool:
    """Scales beyond all residuals, among them and below them all; both degrees."""
    return (name, scale) in (("dmsp-20-300", 1000.0), ("dmsp-20-300", 0.01)) or (
        name == "festo-tool-dmsp-20" and scale in (1.0, 0.01)
    )


@pytest.mark.parametrize(
    ("name", "degree", "scale"),
    widened(((*each, scale) for each in MAPS.items() for scale in SCALES), differs_in_kind),
)
def test_a_robust_loss_of_any_scale_settles_where_no_change_helps(
    name: str, degree: int, scale: float
):
    """Maps with slack rows, of which the shortest length of the DMSP-20-300 has nothing else."""
    recording = read_csv(DATA / f"{name}.csv")
    loss = Huber(scale)
    found = fit(ContractileSurface.blank(degree, max_force=1e5), recording, loss=loss)
    assert found.rank == len(exponents(degree))

    def total(values: np.ndarray) -> float:
        return float(
            np.sum(
                loss.rho((found.problem.residuals(found.problem.predict(values)) / scale) ** 2)[0]
            )
        )

    random = np.random.default_rng(3)
    least = total(found.values)
    for size in (1e-3, 1e-2, 0.1, 1.0):
        changes = size * random.standard_normal((20, found.values.size)) * np.abs(found.values)
        assert min(total(found.values + change) for change in changes) > least * (1 - 1e-6)


def test_a_wide_robust_loss_is_least_squares_for_slack_rows_too():
    recording = read_csv(DATA / "dmsp-20-300.csv")
    start = ContractileSurface.blank(5, max_force=2000.0)
    plain = fit(start, recording)
    robust = fit(start, recording, loss=Huber(1000.0))
    assert robust.values == pytest.approx(plain.values, rel=1e-6, abs=1e-6)


def test_a_loss_narrower_than_the_noise_is_noted():
    recording = points(surface(2).force, noise=5.0)
    start = ContractileSurface.blank(2, **WIDE)
    assert any(
        "standard errors are too small" in n for n in fit(start, recording, loss=Huber(0.5)).notes
    )
    assert not any("too small" in n for n in fit(start, recording, loss=Huber(15.0)).notes)


# Units and scales


@given(st.floats(1e-3, 1e3), st.floats(1e-6, 1e3), st.floats(-1e5, 1e5), st.floats(0.1, 10.0))
def test_units_and_scales_change_nothing(
    force_scale: float, pressure_scale: float, shift: float, stretch: float
):
    recording = points(surface(3).force, n=60, noise=3.0)
    start = ContractileSurface.blank(3, min_force=-1e9, max_force=1e9)
    found = fit(start, recording)
    other = fit(
        start,
        recording.with_columns(
            force=force_scale * recording["force"],
            pressure=pressure_scale * (recording["pressure"] + shift),
            contraction=stretch * recording["contraction"],
        ),
    )
    assert other.values == pytest.approx(
        force_scale * found.values, rel=1e-6, abs=1e-7 * force_scale
    )
    assert other.standard_errors == pytest.approx(force_scale * found.standard_errors, rel=1e-6)
    assert (other.r2, other.condition) == pytest.approx((found.r2, found.condition), rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-3, 1e3))
@pytest.mark.slow
def test_the_iterating_solver_knows_no_unit_either(scale: float):
    recording = points(MUSCLE.force, noise=3.0, high=0.1, seed=2)
    start = [1e-4, 400.0, -50.0, -8e-3, 3e-3, -300.0]
    factors = np.array([scale, scale, 1.0, scale, scale, scale])
    plain = fit(Sarosi2012(*start), recording, censoring=UNCENSORED)
    scaled = recording.with_columns(force=scale * recording["force"])
    other = fit(Sarosi2012(*(start * factors)), scaled, censoring=UNCENSORED)
    assert other.values == pytest.approx(factors * plain.values, rel=1e-6)


# What the data cannot tell


def refused(law, recording, **options) -> str:
    with pytest.raises(IdentificationError) as caught:
        fit(law, recording, **options)
    return str(caught.value)


def grid(contractions: int, pressures: int) -> Recording:
    c, p = np.meshgrid(np.linspace(0, 0.2, contractions), np.linspace(1e5, 6e5, pressures))
    return Recording(
        {"pressure": p.ravel(), "contraction": c.ravel(), "force": 900 - 3000 * c.ravel()},
        "map.csv",
    )


def test_too_few_levels_are_named_with_the_powers_they_leave_open():
    """(x + 1)(x + 1/2) x (x - 1/2)(x - 1), which vanishes at five even levels, holds odd powers
    only.
    """
    said = refused(ContractileSurface.blank(5), grid(5, 12))
    assert "map.csv: the data cannot separate a(x), a(x^3), a(x^5) of ContractileSurface" in said
    assert "rank 20 of 21" in said
    assert "12 of pressure, 5 of contraction" in said
    assert "lower degree" in said
    assert fit(ContractileSurface.blank(4), grid(5, 12)).rank == 15
    assert fit(ContractileSurface.blank(5), grid(6, 12)).rank == 21


def test_parameters_that_only_act_together_are_named_and_may_be_held():
    law = Saga2007(StraightFibre(0.072, 0.012, meridian=Parabola()), LINE_A, 0.002)
    contraction, force = (
        x.ravel() for x in np.meshgrid(np.linspace(0.02, 0.3, 6), np.linspace(20.0, 200.0, 5))
    )
    columns = {
        "contraction": contraction,
        "force": force,
        "pressure": law.pressure(contraction, force),
    }
    recording = Recording(columns, "bench")
    said = refused(law, recording)
    assert "cannot separate" in said
    assert all(symbol in said for symbol in ("t", "alpha", "beta", "rank 2 of 3"))
    assert "fixed=(" in said
    assert fit(law, recording, fixed=("wall_thickness",)).rank == 2


def test_a_library_muscle_is_refitted_to_its_own_map_without_a_word_more():
    found = fit(load("dmsp-20-300").characteristic, load_data("dmsp-20-300"))
    assert found.rank == 6
    residuals = found.residuals[found.censoring == 0]
    assert np.sqrt(np.mean(residuals**2)) < 3.3


def test_a_parameter_without_any_effect_is_named():
    recording = hung(HungLoad(0.25, 1.4e5, 3e-4)).with_columns(force=np.zeros(80))
    said = refused(HungLoad(0.2, 1e5, 1e-4), recording)
    assert "do not depend on c of HungLoad" in said


def test_fewer_points_than_parameters():
    said = refused(ContractileSurface.blank(5, **WIDE), points(surface(2).force, n=20))
    assert "21 free parameters, but only 20 rows are measured values" in said
    assert "lower degree" in said


def test_slack_points_do_not_count_as_measured():
    recording = points(surface(2).force, n=30)
    cut = recording.with_columns(force=np.where(np.arange(30) < 10, recording["force"], 0.0))
    said = refused(ContractileSurface.blank(4), cut)
    assert "only 10 rows are measured values (20 further rows are censored" in said
    said = refused(ContractileSurface.blank(2), cut.with_columns(force=np.zeros(30)))
    assert "all 30 rows are censored" in said
    assert "censoring=" in said


@pytest.mark.parametrize("name", ["pressure", "contraction"])
def test_a_column_that_does_not_vary(name: str):
    recording = points(surface(2).force)
    said = refused(ContractileSurface.blank(2), recording.with_columns(**{name: np.full(200, 0.1)}))
    assert f"{name} is 0.1" in said
    assert f"several levels of {name}" in said


def test_an_infinite_value_is_refused_and_a_missing_one_left_out():
    recording = points(surface(2).force, n=50)
    force = recording["force"].copy()
    force[7] = np.nan
    found = fit(ContractileSurface.blank(2, **WIDE), recording.with_columns(force=force))
    assert (found.rows_used, found.rows_dropped) == (49, 1)
    assert "1 rows with a missing value (NaN) were dropped." in found.notes
    force = np.where(np.isnan(force), np.inf, force)
    said = refused(ContractileSurface.blank(2), recording.with_columns(force=force))
    assert "bench, row 8: force is inf" in said
    assert "np.isfinite" in said


@pytest.mark.parametrize("name", ["pressure", "contraction", "force"])
def test_a_missing_value_of_one_of_two_recordings_is_left_out_of_the_checks_too(name: str):
    recording = points(surface(2).force, n=50)
    gap = recording.with_columns(
        **{name: np.where(np.arange(50) == 7, np.nan, recording[name] + 1e-6)}
    )
    found = fit(ContractileSurface.blank(2, **WIDE), [gap, recording])
    assert "1 rows with a missing value (NaN) were dropped." in found.notes


def test_points_beyond_the_reach_of_a_law_are_named():
    law = MartensBoblan2017(Braid(0.01, 0.45, 0.3), 1.8e-3, 9e7, -7e8, 1.5e9, -5e8)
    recording = points(lambda p, c: 1e-3 * p, n=20)
    contraction = recording["contraction"].copy()
    contraction[4] = -0.2
    said = refused(law, recording.with_columns(contraction=contraction))
    assert "gives no finite force at 1 of 20 points" in said
    assert "contraction -0.2" in said


def test_an_unknown_name_to_hold():
    with pytest.raises(
        ParameterError,
        match=r"no parameter 'end_corection' to be fixed.*Did you mean 'end_correction'",
    ):
        fit(
            TonduLopez2000(Braid(0.01, 0.45, 0.3)),
            points(surface(2).force),
            fixed=("end_corection",),
        )


def test_a_parameter_on_its_bound_is_flagged_and_has_no_deviation():
    truth = TonduLopez2000(Braid(0.0095, 0.42, 0.3), 1.0)
    shorter = points(lambda p, c: truth.force(p, 0.9 * c), high=0.2, noise=1.0)
    found = fit(TonduLopez2000(Braid(0.0095, 0.5, 0.3), 1.2), shorter, fixed=("geometry.radius",))
    estimate = found["end_correction"]
    assert estimate.on_bound
    assert estimate.value == pytest.approx(1.0, abs=1e-6)
    assert np.isnan(estimate.stderr)
    assert np.isfinite(found["geometry.braid_angle"].stderr)
    assert "end_correction is on its bound; its value is not determined by the data." in found.notes
    known = fit(
        dataclasses.replace(found.model, end_correction=1.0),
        shorter,
        fixed=("geometry.radius", "end_correction"),
    )
    places = points(truth.force, high=0.2, n=5)
    bands = [confidence_band(each, places) for each in (found, known)]
    ratios = np.divide(
        *(band.high - band.low for band in bands)
    )  # far beyond its bound, its error adds little
    assert (ratios >= 1).all()
    assert 1.01 < ratios.max() < 1.03


def test_as_many_points_as_parameters_leave_the_deviations_unknown():
    found = fit(ContractileSurface.blank(1, **WIDE), points(surface(1).force, n=3))
    assert np.isnan(found.standard_errors).all()
    assert (
        "There are as many rows as parameters, so the standard errors are unknown." in found.notes
    )


def test_a_recording_of_another_specimen_is_noted():
    recording = points(
        TonduLopez2000(Braid(0.0095, 0.42, 0.3), 1.3).force, high=0.2
    ).with_constants(resting_length=0.25)
    found = fit(TonduLopez2000(Braid(0.0095, 0.5, 0.3), 1.1), recording, fixed=("geometry.radius",))
    assert (
        "The muscle in the recording has a resting length of 0.25 m, but geometry.resting_length is"
        " 0.3 m." in found.notes
    )


# Measured muscles


def test_the_measured_map_of_the_dmsp_20_determines_21_coefficients():
    """Martens and Boblan (2017), appendix: 6 lengths at 21 pressures, slack in 66 of 126 points."""
    recording = read_csv(DATA / "dmsp-20-300.csv")
    found = fit(ContractileSurface.blank(5, max_force=2000.0), recording)
    assert (found.rank, found.rows_used, found.rows_censored) == (21, 126, 66)
    assert found.rmse == pytest.approx(2.07, abs=0.01)
    assert found.condition == pytest.approx(757, abs=5)
    bare = found.model.polynomial(recording["pressure"], recording["contraction"])[
        recording["force"] == 0
    ]
    assert bare.max() < 2.0


def test_what_only_bounds_determine_stays_near_to_them_and_is_noted():
    """At the shortest length that map holds no pull at all: five levels are left for the fifth
    power of x.

    Any multiple of the quintic that vanishes at the five levels meets the points as well, if it
    points downward.
    """
    recording = read_csv(DATA / "dmsp-20-300.csv")
    assert recording["force"][recording["length"] == 0.222].max() == 0
    start = ContractileSurface.blank(5, max_force=2000.0)
    found = fit(start, recording)
    assert "The uncensored rows determine 20 of 21 parameters" in " ".join(found.notes)
    at_shortest = found.recording["contraction"] == found.recording["contraction"].max()
    bare = found.model.polynomial(found.recording["pressure"], found.recording["contraction"])[
        at_shortest
    ]
    assert bare.max() == pytest.approx(0.0, abs=1e-3)
    again = fit(start, recording.rows(np.random.default_rng(1).permutation(126)))
    assert again.values == pytest.approx(found.values, abs=1e-3)
    taut = recording.rows(recording["force"] > 0)
    assert "rank 20 of 21" in refused(start, taut)
    assert "determine 20 of 21" not in " ".join(
        fit(ContractileSurface.blank(4, max_force=2e3), recording).notes
    )


@pytest.mark.parametrize(("name", "rms"), [("10", 2.7), ("20", 8.4), ("40", 30.0)])
def test_the_tool_tables_are_met_as_an_independent_fit_meets_them(name: str, rms: float):
    recording = read_csv(DATA / f"festo-tool-dmsp-{name}.csv")
    found = fit(ContractileSurface.blank(5, max_force=1e5, min_force=-1e5), recording)
    assert found.rows_censored == 0
    assert found.rmse == pytest.approx(rms, rel=0.02)


# How it shows itself


def test_a_fit_prints_its_parameters_and_figures():
    recording = points(TonduLopez2000(Braid(0.0095, 0.42, 0.3), 1.3).force, high=0.2, noise=1.0)
    found = fit(TonduLopez2000(Braid(0.0095, 0.5, 0.3), 1.1), recording, fixed=("geometry.radius",))
    text = str(found)
    assert f"{found['end_correction'].value:.4g}" in text
    assert f"{found['end_correction'].stderr:.3g}" in text
    parameters = next(table for table in found.chapter().tables if table.name == "parameters")
    assert (
        "contraction of the middle relative to that of the whole muscle"
        in parameters.columns["meaning"]
    )
    for said in (
        "rms error",
        " N  ",
        "at ",
        " kPa, ",
        "R2",
        "correlation index",
        "rank",
    ):
        assert said in text
    assert {"residual standard deviation", "condition", "contraction of the data"} <= {
        v.name for v in found.goodness()
    }
    assert "<table>" in found._repr_html_()


def test_a_fit_draws_parity_and_errors_with_units():
    _, recording = slack_and_taut()
    figure = fit(ContractileSurface.blank(2), recording).plot()
    parity, errors = figure.axes
    assert parity.get_xlabel() == "measured force [N]"
    assert errors.get_ylabel() == "residual (model - measured) [N]"
    assert [text.get_text() for text in figure.legends[0].get_texts()][-1] == "censored (bound)"
