"""A law that is recommended does not pull where a muscle was measured slack.

The effects of a specimen are limited by its slack rows, by the points that these imply, and by the
decay of the effects where the population does not pull. A law of any length is slack at further
lengths far below the pressure at which it starts to pull. Errors at slack rows count in every
score, and a law that pulls there is not recommended.
"""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import airmuscle as am
from airmuscle.bench import (
    Candidate,
    LeastSquares,
    LevelSplit,
    RunSplit,
    SpecimenSplit,
    compare,
    fit,
    standard_candidates,
)
from airmuscle.bench.comparison import (
    SpecimenErrors,
    eligible_models,
    excess_error,
    odd_specimen_notes,
    recommend,
    specimen_notes,
)
from airmuscle.bench.estimation import batch_sample_size, solve_least_squares
from airmuscle.bench.statics import FitPoints, Slackness, SlackPull, slack_pull
from airmuscle.core import tree
from airmuscle.errors import IdentificationError
from airmuscle.physics import Braid, ContractileSurface, LogarithmicLength, PooledLengthLaw
from airmuscle.recording import Recording

NAME = "surface of degree 3 + length correction ln L0 of degree 1 + muscle effects of degree 3"
MUSCLES = ((0.083, 5.2e-3, 25.5, 1.25), (0.182, 5.3e-3, 24.6, 1.15), (0.382, 5.4e-3, 24.2, 1.08))
"""Resting length [m], radius [m], braid angle [degrees] and end correction (chosen)."""


def ramps(rows: int = 120) -> list[Recording]:
    """Ramps of pressure of three muscles with a dead zone that grows with the contraction; slack
    sensors read -2 N.
    """
    random = np.random.default_rng(1)
    made = []
    for length, radius, angle, correction in MUSCLES:
        law = am.characteristic.TonduLopez2000(Braid(radius, np.radians(angle), length), correction)
        for repeat in (1, 2):
            for held in (0.0, 0.04, 0.08, 0.12):
                time = np.linspace(0.0, 28.0, rows)
                pressure = 8e3 + 6.12e5 * (1 - np.abs(time / 14 - 1))
                contraction = np.full(rows, held)
                effective = np.maximum(pressure - 6e4 - 1.2e6 * held, 0.0) * (
                    1 + 0.02 * np.sin(pressure / 1.5e5)
                )
                force = np.maximum(
                    law.force(effective, contraction) - 2e3 * held * (effective > 0), 0.0
                )
                force = force + random.normal(0, 1, rows) - 2.0
                columns = {
                    "time": time,
                    "pressure": pressure,
                    "contraction": contraction,
                    "force": force,
                }
                made.append(
                    Recording(
                        columns,
                        f"{length * 1e3:.0f} mm, {held}, {repeat}",
                        {"resting_length": length},
                    )
                )
    return made


@pytest.fixture(scope="module")
def measured() -> list[Recording]:
    return ramps()


@pytest.fixture(scope="module")
def pooled(measured: list[Recording]) -> am.bench.Fit:
    candidate = next(each for each in standard_candidates(measured) if each.name == NAME)
    return fit(candidate.law, measured)


def test_the_law_of_a_specimen_does_not_pull_at_its_slack_rows(pooled):
    slack = pooled.recording["force"] <= 0
    assert np.count_nonzero(slack) > 500
    assert pooled.modelled[slack].max() < 20.0


def test_the_law_of_a_specimen_does_not_pull_at_pressures_below_its_slack_rows(pooled, measured):
    law = pooled.model.for_specimen("182 mm")
    own = [run for run in measured if run.constants["resting_length"] == 0.182]
    contraction = np.linspace(0.04, 0.12, 9)
    pressure = min(float(run["pressure"].min()) for run in own)
    assert np.max(law.force(np.full(9, pressure), contraction)) < 5.0


def test_the_law_of_a_specimen_does_not_pull_where_its_rows_imply_that_it_is_slack_but_none_was_recorded(
    measured,
):
    """Contracted muscles were recorded from 60 kPa on: at lower pressures they are slack all the
    more.
    """
    recorded = [
        run.rows((run["force"] > 0) | (run["pressure"] > 6e4) | (run["contraction"] < 0.04))
        for run in measured
    ]
    name = "surface of degree 3 + length correction ln L0 of degree 1 + muscle effects of degree 2"
    (law,) = [each.law for each in standard_candidates(recorded) if each.name == name]
    found = fit(law, recorded).model
    pressure, contraction = (
        x.ravel() for x in np.meshgrid(np.linspace(8e3, 9e4, 15), np.linspace(0.06, 0.12, 7))
    )
    assert (
        max(
            np.max(found.for_specimen(each).force(pressure, contraction))
            for each in found.specimens
        )
        < 2.0
    )


def test_the_effects_decay_where_the_population_does_not_pull():
    population = LogarithmicLength(
        _surface(-100.0),
        ContractileSurface.blank(1).with_validity_range((1e5, 6e5), (0.0, 0.2)),
        0.2,
        0.2,
    )
    law = PooledLengthLaw(population, (_surface(400.0),), ("a",), (0.2,), "a", effect_decay=1 / 20)
    assert law.force(3e5, 0.1) == 0.0
    assert dataclasses.replace(law, effect_decay=0.0).force(3e5, 0.1) == pytest.approx(300.0)
    weak = dataclasses.replace(
        law, population=dataclasses.replace(population, inner=_surface(-5.0))
    )
    assert weak.force(3e5, 0.1) == pytest.approx(-5.0 + 0.75 * 400.0)


def _surface(force: float):
    surface = ContractileSurface.blank(1).with_validity_range((1e5, 6e5), (0.0, 0.2))
    return dataclasses.replace(
        surface, coefficients=(force, 0.0, 0.0), min_force=-1e6, max_force=1e6
    )


def test_the_greatest_error_of_a_pooled_fit_includes_slack_rows(pooled):
    violated = np.where(pooled.recording["force"] <= 0, pooled.modelled, pooled.residuals)
    assert abs(pooled.max_error.error) == pytest.approx(float(np.abs(violated).max()))
    measured = pooled.recording["force"] > 0
    assert pooled.rmse == pytest.approx(
        float(np.sqrt(np.sum(violated**2) / np.count_nonzero(measured)))
    )


def test_a_law_of_any_length_pulls_less_where_a_length_that_was_not_measured_is_slack(measured):
    law = LogarithmicLength(ContractileSurface.blank(3), ContractileSurface.blank(1), 0.2, 0.2)
    others = [run for run in measured if run.constants["resting_length"] != 0.083]
    problem = FitPoints.from_recordings(others).problem(law)
    values = solve_least_squares(problem, LeastSquares()).values
    laws = fit(law, others).model, tree.with_parameters(problem.law, problem.leaf_values(values))
    pulls = [float(each.with_resting_length(0.083).force(8e3, 0.12)) for each in laws]
    assert pulls[0] < 0.7 * pulls[1]
    assert pulls[0] < 30.0


def test_a_law_that_pulls_at_slack_rows_of_a_specimen_left_out_loses(measured):
    """The constant law meets no slack row; its score must contain them."""
    comparison = compare(
        measured, [Candidate("plane", ContractileSurface.blank(1))], leave_out=SpecimenSplit()
    )
    (score,) = [s for s in comparison.ranking[0].fold_scores if s.fold == "83 mm"]
    others = [run for run in measured if run.constants["resting_length"] != 0.083]
    law = fit(ContractileSurface.blank(1), others).model
    own = [run for run in measured if run.constants["resting_length"] == 0.083]
    force, modelled = (
        np.concatenate(each)
        for each in (
            [run["force"] for run in own],
            [law.force(run["pressure"], run["contraction"]) for run in own],
        )
    )
    squares = np.sum((modelled - np.maximum(force, 0.0)) ** 2)
    assert score.rmse == pytest.approx(
        float(np.sqrt(squares / np.count_nonzero(force > 0))), rel=1e-6
    )


def test_a_law_that_pulls_where_a_muscle_is_slack_is_not_recommended(measured):
    candidates = [
        Candidate("rich", ContractileSurface.blank(3)),
        Candidate("plain", ContractileSurface.blank(2)),
    ]
    ranking = compare(measured[:8], candidates, leave_out=RunSplit()).ranking
    pulls = dataclasses.replace(
        ranking[0],
        slack=SlackPull(100, 7, 20.0, 461.0, 8e3, 0.124),
        cross_validated_rmse=0.5 * ranking[1].cross_validated_rmse,
    )
    recommended, reason = recommend([pulls, ranking[1]], RunSplit())
    assert recommended is ranking[1]
    assert "it pulls at 7 of 100 slack rows, up to 461 N at 8 kPa and 12.40 %" in reason
    assert pulls.candidate.name in reason


def test_a_slack_row_that_a_measured_force_contradicts_does_not_exclude_a_law():
    pressure = np.array([1e5, 2e5, 3e5, 4e5])
    contraction = np.full(4, 0.1)
    force = np.array([0.0, 50.0, 0.0, 150.0])
    modelled = np.array([2.0, 50.0, 100.0, 150.0])
    found = slack_pull(pressure, contraction, force, modelled, limit=10.0)
    assert (found.rows, found.pulling, found.greatest) == (2, 0, 2.0)
    modelled[0] = 60.0
    assert slack_pull(pressure, contraction, force, modelled, limit=10.0).pulling == 1


def test_the_slack_region_lies_below_the_pressure_and_above_the_contraction_of_slack_rows():
    pressure = np.array([1e5, 3e5, 2e5])
    contraction = np.array([0.05, 0.1, 0.12])
    steps = Slackness.of(
        pressure, contraction, np.array([True, True, False]), np.array([False, False, True])
    )
    assert steps.slack_limit(np.array([0.04, 0.05, 0.2])).tolist() == [-np.inf, 1e5, 3e5]
    assert steps.pull_limit(np.array([0.05, 0.12, 0.13])).tolist() == [2e5, 2e5, np.inf]
    p, c = steps.region(0.0, 0.12)
    assert p.max() == 2e5
    assert c.min() == 0.05


def test_the_batch_sample_size_is_that_of_independent_groups():
    random = np.random.default_rng(2)
    assert batch_sample_size(random.normal(size=10_000)) == pytest.approx(10_000, rel=0.35)
    groups = np.repeat(random.normal(size=1000), 10) + 0.1 * random.normal(size=10_000)
    assert batch_sample_size(groups) == pytest.approx(1000, rel=0.35)
    assert batch_sample_size(np.zeros(9)) == 9


def test_all_rows_slack_is_a_clear_error(measured):
    slack = [run.with_columns(force=np.full(len(run), -1.0)) for run in measured]
    with pytest.raises(IdentificationError, match="no measured value"):
        fit(
            PooledLengthLaw(
                LogarithmicLength(
                    ContractileSurface.blank(2), ContractileSurface.blank(1), 0.2, 0.2
                ),
                (ContractileSurface.blank(2),),
            ),
            slack,
        )


@pytest.mark.parametrize(
    ("rms", "odd"),
    [
        ((9.0, 8.0, 23.2, 10.0), "c"),
        ((9.0, 8.0, 15.0, 10.0), None),
        ((9.0, 8.0, 23.2), None),
    ],
)
def test_the_specimen_that_does_not_follow_the_others_is_named(
    rms: tuple[float, ...], odd: str | None
):
    errors = SpecimenErrors(tuple("abcd"[: len(rms)]), rms, (0.1, 0.2, 0.4, 0.3)[: len(rms)])
    assert (errors.odd or (None,))[0] == odd
    notes = odd_specimen_notes(errors)
    assert len(notes) == (odd is not None)
    if odd is not None:
        assert notes[0].startswith(
            "Specimen c does not follow the others: left out, its rms error is 23.2 N"
        )
        assert "extrapolated" in notes[0]
    assert odd_specimen_notes(None) == []


def test_the_force_where_a_specimen_was_slack_is_that_of_the_law_of_the_others(measured):
    blank = LogarithmicLength(ContractileSurface.blank(3), ContractileSurface.blank(1), 0.2, 0.2)
    comparison = compare(measured, [Candidate("law", blank)], leave_out=SpecimenSplit())
    scores = comparison["law"].fold_scores
    for (length, *_), score in zip(MUSCLES, scores, strict=True):
        runs = [run for run in measured if run.constants["resting_length"] == length]
        others = [run for run in measured if run.constants["resting_length"] != length]
        law = fit(blank, others).model.with_resting_length(length)
        at_slack = [
            np.max(law.force(run["pressure"], run["contraction"])[run["force"] <= 0.0], initial=0.0)
            for run in runs
        ]
        assert score.fold == f"{1e3 * length:.0f} mm"
        assert score.slack_force == pytest.approx(max(at_slack), rel=1e-3)
    assert max(score.slack_force for score in scores) > 1.0


@pytest.mark.parametrize(("force", "is_named"), [(76.0, True), (3.0, False)])
def test_a_force_beyond_the_band_where_a_specimen_was_slack_is_named(force: float, is_named: bool):
    errors = SpecimenErrors(("a", "b", "c"), (3.0, 4.0, 5.0), (), (1.0, force, 2.0))
    assert errors.slack_force == (force if is_named else None)
    notes = " ".join(specimen_notes(errors))
    named = "specimen b was slack where the law gives up to 76 N; the 95 % band of another"
    assert (named in notes) == is_named
    assert dataclasses.replace(errors, slack_forces=()).slack_force is None


def isobars(curve: float = 40.0, rows: int = 200) -> list[Recording]:
    """Three isobars that are curved, the last one little, with a force that is not linear in
    pressure (chosen).
    """
    random = np.random.default_rng(1)
    made = []
    for pressure, shift, bend in ((1e5, 3.0, 1.4), (3e5, -3.0, 0.9), (5e5, 3.0, 0.15)):
        contraction = np.linspace(0.02, 0.12, rows)
        x = (contraction - 0.07) / 0.05
        force = (
            2e-3 * pressure
            - 3000 * (contraction - 0.02)
            + bend * curve * (x * x - 1 / 3)
            + shift
            + 200
        )
        columns = {"pressure": pressure + random.normal(0, 300, rows), "contraction": contraction}
        columns["force"] = force + random.normal(0, 3, rows)
        made.append(Recording(columns, f"{pressure / 1e5:.0f} bar", {"resting_length": 0.17}))
    return made


def test_with_three_levels_a_law_is_not_recommended_that_the_measured_points_contradict():
    """One standard error of three folds admits straight isobars through curved points, 12 N against
    7 N.
    """
    candidates = [
        Candidate("straight", ContractileSurface.blank(1)),
        Candidate("curved", ContractileSurface.blank(2), ("coefficients[4]", "coefficients[5]")),
    ]
    found = compare(isobars(), candidates, leave_out=LevelSplit("pressure"))
    straight = found["straight"]
    curved = found["curved"]
    assert excess_error(straight, curved) <= 0
    assert straight.cross_validated_rmse < 1.25 * curved.cross_validated_rmse
    assert straight.in_sample_rmse > 1.5 * curved.in_sample_rmse
    assert found.recommended is curved
    plain = compare(isobars(curve=0.0), candidates, leave_out=LevelSplit("pressure"))
    assert plain.recommended.candidate.name == "straight"


def test_a_law_is_not_preferred_because_its_larger_error_permits_more_force_at_slack_rows():
    """The limit of three rms errors excludes a law only where another law pulls less."""
    exact, coarse, wild = (
        SimpleNamespace(slack=SlackPull(9, pulling, limit, greatest))
        for pulling, limit, greatest in ((1, 26.4, 30.9), (0, 44.0, 43.3), (5, 20.0, 461.0))
    )
    assert eligible_models([exact, coarse, wild]) == [exact, coarse]
    careful = SimpleNamespace(slack=SlackPull(9, 0, 44.0, 20.0))
    assert eligible_models([exact, coarse, careful]) == [coarse, careful]
    assert eligible_models([exact, wild]) == [exact, wild]
