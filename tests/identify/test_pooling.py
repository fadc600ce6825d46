"""Partial pooling: one law serves a further run of a measured muscle and a muscle of another
length.

Each specimen deviates from the law of the population by an effect with a normal prior. Its variance
follows from the restricted likelihood of the training rows alone; the shrinkage, the standard
errors and the coverage follow from it.
"""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.bench import (
    Candidate,
    RunSplit,
    SpecimenSplit,
    compare,
    confidence_band,
    select_for_both,
    standard_candidates,
)
from airmuscle.bench.comparison import compared_points
from airmuscle.bench.estimation import EffectRows, Runs, estimate_pooled_covariance
from airmuscle.bench.statics import predict_effects, static_fit
from airmuscle.bench.statics.static_fit_chapter import equation_section
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.files import Entry, load, save
from airmuscle.outlets.requests import FitRequest, build
from airmuscle.physics import ContractileSurface, LogarithmicLength, PooledLengthLaw
from airmuscle.recording import Recording

LENGTHS = (0.1, 0.15, 0.2, 0.3, 0.4, 0.25)
HELD = (0.0, 0.05, 0.1, 0.15)
NAMES = tuple(f"muscle {i + 1}" for i in range(len(LENGTHS)))
SCATTER = 12.0
NOISE = 2.0
POPULATION = LogarithmicLength(ContractileSurface.blank(3), ContractileSurface.blank(1), 0.2, 0.2)
CHANGED = LogarithmicLength(ContractileSurface.blank(3), ContractileSurface.blank(3), 0.2, 0.2)
BLANK_1 = ContractileSurface.blank(1)
POOLED = PooledLengthLaw(POPULATION, (ContractileSurface.blank(2),))
CANDIDATES = [
    Candidate("complete pooling", POPULATION),
    Candidate("rich", CHANGED),
    Candidate("partial pooling", POOLED),
    Candidate("rich, partial pooling", PooledLengthLaw(CHANGED, POOLED.effects)),
]


def truth(length: float, pressure: np.ndarray, contraction: np.ndarray) -> np.ndarray:
    """Force [N] of the mean muscle: no law of the library."""
    return (
        pressure * 1.6e-3 * (1 + 0.15 * np.log(length / 0.2)) * (1 - contraction / 0.27) ** 1.5
        - 120 * contraction
    )


def runs(seed: int = 1, scatter: float = SCATTER, rows: int = 20) -> list[Recording]:
    """Each muscle at each held contraction, swept in pressure; the muscles scatter by a random
    surface of degree 2.
    """
    random = np.random.default_rng(seed)
    made = []
    for name, length in zip(NAMES, LENGTHS, strict=True):
        effect = scatter * random.standard_normal(6)
        for held in HELD:
            pressure = np.linspace(1.5e5, 6e5, rows)
            contraction = np.full(rows, held)
            x = held / 0.075 - 1
            q = pressure / 2.25e5 - 5 / 3
            basis = np.array([1 + 0 * q, x + 0 * q, x * x + 0 * q, q, x * q, q * q])
            force = (
                truth(length, pressure, contraction)
                + effect @ basis
                + NOISE * random.standard_normal(rows)
            )
            columns = {"pressure": pressure, "contraction": contraction, "force": force}
            made.append(
                Recording(columns, f"{name}, {held}", {"resting_length": length, "specimen": name})
            )
    return made


@pytest.mark.slow
def test_one_pooled_law_is_within_five_per_cent_of_the_best_for_both_purposes():
    """Errors over three sets of six muscles together: with six muscles, chance decides between laws
    of new muscles.
    """
    squares: dict[str, dict[str, float]] = {}
    for seed in (1, 2, 3):
        joint = select_for_both(runs(seed), CANDIDATES)
        assert joint.recommended[0].candidate.name == "partial pooling"
        for each in joint.comparisons:
            of_purpose = squares.setdefault(each.leave_out.group_name, {})
            for m in each.ranking:
                name = m.candidate.name
                of_purpose[name] = of_purpose.get(name, 0.0) + m.cross_validated_rmse**2
    for of_purpose in squares.values():
        assert of_purpose["partial pooling"] <= 1.05**2 * min(of_purpose.values())
    assert squares["run"]["complete pooling"] > 4**2 * squares["run"]["partial pooling"]


def test_the_law_of_a_new_muscle_is_that_of_the_population():
    comparison = compare(runs(), CANDIDATES, leave_out=SpecimenSplit())
    errors = {
        name: comparison[name].cross_validated_rmse
        for name in ("partial pooling", "complete pooling")
    }
    assert errors["partial pooling"] == pytest.approx(errors["complete pooling"], rel=1e-9)


@pytest.mark.parametrize("split", [RunSplit(), SpecimenSplit()])
def test_the_variance_of_the_prior_is_chosen_without_the_rows_left_out(split):
    data = runs()
    comparison = compare(data, [Candidate("pooled", POOLED)], leave_out=split)
    label = str(split.labels(data)[5][0])
    left = [str(labels[0]) == label for labels in split.labels(data)]
    fitted = am.fit(POOLED, [run for run, out in zip(data, left, strict=True) if not out]).model
    errors = []
    for run in (run for run, out in zip(data, left, strict=True) if out):
        known = run.constants["specimen"] in fitted.specimens
        law = (
            fitted.for_specimen(run.constants["specimen"])
            if known
            else fitted.with_resting_length(run.constants["resting_length"])
        )
        errors.append(law.force(run["pressure"], run["contraction"]) - run["force"])
    score = next(s for s in comparison["pooled"].fold_scores if s.fold == label)
    assert score.rmse == pytest.approx(
        float(np.sqrt(np.mean(np.concatenate(errors) ** 2))), rel=1e-6
    )


def test_the_restricted_likelihood_finds_the_scatter_and_the_noise():
    fits = [am.fit(POOLED, runs(seed)) for seed in range(8)]
    found = np.array([(f.effects.deviation, f.effects.sigma) for f in fits]).mean(axis=0)
    assert found[0] == pytest.approx(SCATTER, rel=0.2)
    assert found[1] == pytest.approx(NOISE, rel=0.35)  # the truth is no surface of degree 3


def test_muscles_without_scatter_have_no_effects():
    data = runs(scatter=0.0)
    law = am.fit(POPULATION, data).model
    said = []
    for seed in (5, 1):
        random = np.random.default_rng(seed)
        made = []
        for run in data:
            force = law.with_resting_length(run.constants["resting_length"]).force(
                run["pressure"], run["contraction"]
            )
            made.append(run.with_columns(force=force + NOISE * random.standard_normal(len(run))))
        fitted = am.fit(POOLED, made)
        assert np.abs(fitted.effects.coefficients).max() < 0.1 * SCATTER
        assert fitted.effects.deviation < 0.1 * SCATTER
        said.append("the data show no difference between them" in " ".join(fitted.notes))
    assert said == [False, True]  # of the first the noise looks like an effect of 0.1 N


def test_effects_and_covariance_are_those_of_the_complete_matrices():
    random = np.random.default_rng(4)
    member = np.repeat([0, 1, 2], 20)
    matrix, basis, target = (
        random.normal(size=(60, 3)),
        random.normal(size=(60, 2)),
        random.normal(size=60),
    )
    effects = np.hstack([np.where((member == i)[:, None], basis, 0.0) for i in range(3)])
    target = target + effects @ (3 * random.normal(size=6))
    gain = np.linalg.pinv(matrix)
    residuals = target - matrix @ gain @ target
    rows = EffectRows(matrix, basis, residuals, member, 3)
    found = predict_effects(rows.sums(), ("a", "b", "c"))
    ratio = (found.sigma / found.deviation) ** 2
    shrink = np.linalg.inv(effects.T @ effects + ratio * np.eye(6)) @ effects.T
    keep = np.eye(60) - matrix @ gain
    np.testing.assert_allclose(found.coefficients.ravel(), shrink @ residuals, rtol=1e-9)
    assert found.degrees_of_freedom == pytest.approx(
        float(np.trace(effects @ shrink @ keep)), rel=1e-9
    )
    by_rows = np.vstack([gain, shrink @ keep])
    by_effects = by_rows @ effects - np.vstack([np.zeros((3, 6)), np.eye(6)])
    scatter = found.deviation**2 * by_effects @ by_effects.T
    single = Runs(np.zeros(60, dtype=int), member, in_time=False)
    independent = estimate_pooled_covariance(
        rows, single, ratio, found.deviation, found.degrees_of_freedom
    )
    assert independent.describe().startswith(
        "from the scatter of the specimens and of independent rows"
    )
    expected = found.sigma**2 * by_rows @ by_rows.T + scatter
    np.testing.assert_allclose(independent.matrix, expected, rtol=1e-8, atol=1e-12)

    run = member * 4 + np.tile(np.arange(20) // 5, 3)
    left = target - matrix @ gain @ target - effects @ found.coefficients.ravel()
    by_run = estimate_pooled_covariance(
        rows._replace(residuals=left), Runs(run, member, in_time=False), ratio, found.deviation, 6.0
    )

    def refitted(kept: np.ndarray) -> np.ndarray:
        population = np.linalg.lstsq(matrix[kept], left[kept], rcond=None)[0]
        rest = left[kept] - matrix[kept] @ population
        rows_of = effects[kept]
        return np.append(
            population, np.linalg.solve(rows_of.T @ rows_of + ratio * np.eye(6), rows_of.T @ rest)
        )

    changes = np.array([refitted(run != i) - refitted(run >= 0) for i in range(12)])
    np.testing.assert_allclose(
        by_run.matrix, 11 / 12 * changes.T @ changes + scatter, rtol=1e-8, atol=1e-12
    )
    assert by_run.describe() == "from the scatter of the specimens and of 12 runs"

    def likelihood(
        value: float,
    ) -> float:  # of the error contrasts, the complements of the columns of the population
        contrasts = np.linalg.svd(matrix)[0][:, 3:]
        spread = contrasts.T @ (np.eye(60) + effects @ effects.T / value) @ contrasts
        squares = target @ contrasts @ np.linalg.solve(spread, contrasts.T @ target)
        return float(-0.5 * np.linalg.slogdet(spread)[1] - 0.5 * 57 * np.log(squares))

    assert likelihood(ratio) > max(likelihood(ratio * 1.1), likelihood(ratio / 1.1))


def test_bands_of_a_new_muscle_contain_the_scatter_of_the_specimens():
    inside = []
    widths = []
    for seed in range(20, 30):
        data = runs(seed)
        fitted = am.fit(POOLED, [run for run in data if run.constants["specimen"] != NAMES[2]])
        new = [run for run in data if run.constants["specimen"] == NAMES[2]]
        for run in new:
            band = confidence_band(fitted, run, prediction=True)
            inside.append(np.mean((band.low < run["force"]) & (run["force"] < band.high)))
        known = confidence_band(fitted, data[0])
        widths.append(np.mean(band.high - band.low) / np.mean(known.high - known.low))
        assert np.abs(known.value - data[0]["force"]).mean() < 3 * NOISE
    assert 0.85 < np.mean(inside) < 1.0
    assert min(widths) > 3


@pytest.mark.parametrize("law", [POPULATION, POOLED], ids=["population", "pooled"])
def test_the_band_at_no_points_is_empty(law):
    places = {"pressure": np.zeros(0), "contraction": np.zeros(0)}
    points = Recording(places, "none", {"specimen": NAMES[0], "resting_length": LENGTHS[0]})
    assert [each.shape for each in confidence_band(am.fit(law, runs()), points)] == [(0,)] * 3


def held_by_bands(disturb, experiments: int) -> float:
    """The share of intervals of three measured muscles that hold their force at five points, where
    each run has errors of its own: `disturb(force, random)`. The truth is within the law, so that
    nothing but the rows is uncertain.
    """
    places = {
        "pressure": np.linspace(2e5, 5.5e5, 5),
        "contraction": np.array([0.02, 0.12, 0.05, 0.14, 0.08]),
    }
    smooth = am.fit(POOLED, runs(3, rows=12)[:12]).model
    inside = []
    for seed in range(experiments):
        random = np.random.default_rng(seed)
        made = []
        for run in runs(3, rows=12)[:12]:
            law = smooth.for_specimen(run.constants["specimen"])
            force = disturb(law.unclamped_force(run["pressure"], run["contraction"]), random)
            made.append(run.with_columns(force=force))
        fitted = am.fit(POOLED, made)
        for name, length in zip(NAMES[:3], LENGTHS, strict=False):
            band = confidence_band(
                fitted, Recording(places, "p", {"specimen": name, "resting_length": length})
            )
            true = smooth.for_specimen(name).unclamped_force(**places)
            inside.append((band.low < true) & (true < band.high))
    return float(np.mean(inside))


DISTURBANCES = {
    "independent": lambda force, random: force + 3 * random.standard_normal(force.size),
    "zero of a run": (
        lambda force, random: (
            force + random.standard_normal(force.size) + 5 * random.standard_normal()
        )
    ),
    "gain of a run": (
        lambda force, random: force * (1 + 0.01 * random.standard_normal()) + random.normal(size=12)
    ),
    "ramps": lambda force, random: force + np.cumsum(1.5 * random.standard_normal(force.size)),
}


def test_bands_of_a_measured_muscle_hold_its_force_where_each_run_has_a_zero_of_its_own():
    assert 0.88 <= held_by_bands(DISTURBANCES["zero of a run"], 12) <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", DISTURBANCES)
def test_bands_of_a_measured_muscle_hold_its_force_in_90_to_99_percent_of_experiments(name):
    assert 0.9 <= held_by_bands(DISTURBANCES[name], 40) <= 0.99


def test_few_runs_of_a_muscle_do_not_tell_the_scatter_between_runs():
    made = [run.with_columns(time=np.arange(float(len(run)))) for run in runs()]
    assert am.fit(POOLED, made).error_basis == "from the scatter of the specimens and of 24 runs"
    few = am.fit(POOLED, made[2:])  # two runs of the first muscle
    assert "successive parts of the runs; the scatter between runs" in few.error_basis


@pytest.mark.slow
def test_standard_errors_of_the_population_contain_the_scatter():
    values = []
    errors = []
    for seed in range(40, 70):
        fitted = am.fit(POOLED, runs(seed, rows=12))
        values.append(fitted["inner.coefficients[0]"].value)
        errors.append(fitted["inner.coefficients[0]"].stderr)
    assert np.std(values, ddof=1) == pytest.approx(np.mean(errors), rel=0.35)
    plain = am.fit(POPULATION, runs(40, rows=12))
    assert plain.error_basis.startswith("from the scatter of 6 specimens")
    assert 0.5 < plain["inner.coefficients[0]"].stderr / np.mean(errors) < 2


def test_a_pooled_law_is_saved_and_loaded_with_its_specimens(tmp_path):
    fitted = am.fit(POOLED, runs()).model
    for law in (fitted, fitted.for_specimen(NAMES[1])):
        path = save(Entry("pooled", "pooled", "fitted", law), tmp_path / "muscle.toml")
        assert load(path).characteristic == law
    own = fitted.for_specimen(NAMES[1])
    new = fitted.with_resting_length(LENGTHS[1])
    assert own.resting_length == new.resting_length == LENGTHS[1]
    assert own.force(3e5, 0.05) != new.force(3e5, 0.05)
    assert new.force(3e5, 0.05) == fitted.population.with_resting_length(LENGTHS[1]).force(
        3e5, 0.05
    )


def test_partial_pooling_refuses_what_it_cannot_use():
    with pytest.raises(IdentificationError, match="needs two specimens or more"):
        am.fit(POOLED, runs()[:4])
    twice = [
        *runs(),
        dataclasses.replace(runs()[0], constants={"resting_length": 0.5, "specimen": NAMES[0]}),
    ]
    with pytest.raises(IdentificationError, match=r"two resting lengths, 0\.1 and 0\.5 m"):
        am.fit(POOLED, twice)
    with pytest.raises(
        IdentificationError, match="only those of a ContractileSurface can be fitted"
    ):
        am.fit(PooledLengthLaw(POPULATION, (POPULATION,)), runs())
    law = PooledLengthLaw(POPULATION, (ContractileSurface.blank(1),), ("a",), (0.3,))
    with pytest.raises(ParameterError, match=r"'b' is not among the specimens \(a\)"):
        law.for_specimen("b")
    with pytest.raises(
        ParameterError, match=r"resting length of a is 0\.3 m, but that of its population is 0\.2 m"
    ):
        dataclasses.replace(law, specimen="a")
    with pytest.raises(ParameterError, match="these numbers must be equal"):
        dataclasses.replace(law, specimens=("a", "b"))
    with pytest.raises(ParameterError, match="different names"):
        PooledLengthLaw(POPULATION, law.effects * 2, ("a", "a"), (0.2, 0.2))


def test_partial_pooling_is_compared_where_three_specimens_are_measured():
    names = [c.name for c in standard_candidates(runs())]
    assert (
        "surface of degree 3 + length correction ln L0 of degree 1 + muscle effects of degree 2"
        in names
    )
    assert not any(c.name.startswith("pooled") for c in standard_candidates(runs()[:8]))


def answer_of(options: list[str]) -> str:
    done = airmuscle(*options)
    assert done.exit_code == 0, done.output
    return done.stdout


def test_the_report_shows_the_law_of_the_population_and_the_effect_of_each_specimen():
    fitted = am.fit(POOLED, runs())
    equations, (_, effects) = equation_section(fitted)
    titles = [
        e.title.partition(" (below zero force")[0] for e in equations if "specimen" in e.title
    ]
    assert titles == [
        f"Effect of specimen {name}, added to the law of the population" for name in NAMES
    ]
    assert set(effects.columns) == {
        "term",
        *(f"{n}{end}" for n in NAMES for end in ("", ", standard error")),
    }
    errors = effects.columns["muscle 2, standard error"]
    assert (list(errors), errors.unit) == (list(fitted.effects.standard_errors[1]), "N")


def test_scores_do_not_depend_on_the_number_of_processes():
    data = runs()[:12]
    one, two = (compare(data, CANDIDATES[:3], leave_out=RunSplit(), workers=n) for n in (1, 2))
    assert [m.cross_validated_rmse for m in one.ranking] == pytest.approx(
        [m.cross_validated_rmse for m in two.ranking], rel=1e-9
    )
    assert one.reason == two.reason
    assert [m.candidate.name for m in one.ranking] == [m.candidate.name for m in two.ranking]


def test_laws_of_one_population_share_its_fits_and_have_the_scores_of_each_alone(monkeypatch):
    candidates = [
        CANDIDATES[2],
        CANDIDATES[0],
        Candidate("of degree 1", PooledLengthLaw(POPULATION, (BLANK_1,))),
    ]
    data = runs()
    alone = [compare(data, [each], leave_out=RunSplit()).ranking[0] for each in candidates]
    fitted = []
    fit_law = static_fit._fit_law
    monkeypatch.setattr(
        static_fit, "_fit_law", lambda law, *rest: fitted.append(law) or fit_law(law, *rest)
    )
    refitted = []
    refits = compared_points.GroupRefits
    refit = refits.refit
    monkeypatch.setattr(refits, "refit", lambda *which: refitted.append(which) or refit(*which))
    together = {
        each.candidate.name: each
        for each in compare(data, candidates, leave_out=RunSplit()).ranking
    }
    assert fitted == [POPULATION]
    assert len(refitted) == len(data)
    for each in alone:
        found = together[each.candidate.name]
        assert found.fit.model == each.fit.model
        assert (found.cross_validated_rmse, found.aicc) == (each.cross_validated_rmse, each.aicc)


@pytest.mark.slow
def test_the_command_recommends_one_law_for_both_purposes_and_states_the_excess(tmp_path):
    for run in runs(rows=8)[:16]:
        columns = ("pressure", "contraction", "force")
        rows = "\n".join(",".join(f"{run[c][i]:.9g}" for c in columns) for i in range(len(run)))
        length = run.constants["resting_length"] * 1e3
        path = tmp_path / f"L{length:.0f}mm {run['contraction'][0]:g}.csv"
        path.write_text(f"pressure [Pa],contraction [1],force [N]\n{rows}\n")
    files = sorted(map(str, tmp_path.glob("*.csv")))
    common = [
        "--file-name",
        "L{resting_length [mm]}mm",
        "--compare",
        "--json",
        "--out",
        str(tmp_path / "out"),
    ]
    answer = json.loads(answer_of(["fit", *files, *common, "--length-error", "100 mm"]))
    purposes = [answer[f"comparison_{group}"] for group in ("run", "specimen")]
    assert purposes[0]["recommended"].startswith("pooled")
    assert [each["left_out"] for each in purposes] == ["run", "specimen"]
    assert "For other muscles of the same type: rms error" in purposes[0]["summary"][0]
    assert answer["length_errors"]["resting_lengths"][0]["specimen"] == "100 mm"
    law = load(tmp_path / "out" / "muscle.toml").characteristic
    assert law.specimens == ("100 mm", "150 mm", "200 mm", "300 mm")
    shown = answer_of(["fit", *files, *(each for each in common if each != "--json")]).splitlines()
    assert len(shown) <= 45, "more than a screen"
    assert sum(line.startswith("For other muscles of the same type") for line in shown) == 1
    assert sum(line == "Laws that are not ranked" for line in shown) <= 1


def test_a_purpose_names_the_rows_that_are_left_out():
    splits = {"repeat": RunSplit(), "length": SpecimenSplit(), "both": None}
    assert {
        name: build(FitRequest, {"compare": True, "purpose": name}, str).split for name in splits
    } == splits


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--compare", "--purpose", "all"], "allowed range: repeat, length, both"),
        (["--compare", "--purpose", "both", "--leave-out", "run"], "excludes --leave-out"),
        (["--characteristic", "Sarosi2012", "--purpose", "both"], "is for --compare"),
    ],
)
def test_the_command_refuses_a_purpose_that_it_cannot_serve(options, message):
    result = airmuscle("fit", "dmsp-20-300", *options)
    assert result.exit_code != 0
    assert message in " ".join(result.output.replace("│", " ").split())
