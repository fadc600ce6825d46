"""A comparison judges laws by what they say of runs, levels or specimens that they were not given.

The order by cross-validated error need not be that in sample: more coefficients always meet the
points better that they were fitted to. The simplest law is taken that is no worse than the best by
more than one standard error of the difference, for the purpose that what was left out stands for.
What the data do not determine is excluded, with the reason. The muscle file of the recommended law
loads back to the same numbers.
"""

from __future__ import annotations

import dataclasses
import json
import pickle
import warnings
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle import load_data
from airmuscle.bench import (
    BlockSplit,
    Candidate,
    LevelSplit,
    RunSplit,
    SpecimenSplit,
    compare,
    select_for_both,
    standard_candidates,
    write,
)
from airmuscle.bench.comparison import (
    FoldScore,
    compare_chapter,
    compare_chapters,
    excess_error,
    recommend,
)
from airmuscle.bench.estimation import ALWAYS_FITTED, default_split
from airmuscle.bench.statics import evaluate_force
from airmuscle.core import model, parameter
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.outlets.requests import FitRequest, build
from airmuscle.physics import (
    Braid,
    ContractileSurface,
    DataScales,
    ForceLaw,
    Hunt2017,
    InverseLength,
    LogarithmicLength,
    TonduLopez2000,
)
from airmuscle.recording import Recording

TRUTH = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.2)
START = TonduLopez2000(Braid(0.012, 0.4, 0.3), 1.0)


def isometric(
    contraction: float, *, seed: int, noise: float = 3.0, law=TRUTH, rows: int = 30
) -> Recording:
    """One run at constant length: a sweep of pressure, and an error that the whole run shares."""
    random = np.random.default_rng(seed)
    pressure = np.linspace(0.5e5, 6e5, rows)
    held = np.full(rows, contraction)
    shared = noise * random.standard_normal()
    force = (
        law.force(pressure, held)
        + shared * pressure / 6e5 * 4
        + noise * random.standard_normal(rows)
    )
    columns = {"pressure": pressure, "contraction": held, "force": force}
    return Recording(columns, f"run {contraction:.3f}", {"resting_length": 0.3})


def bench() -> list[Recording]:
    return [isometric(c, seed=i) for i, c in enumerate(np.linspace(0.0, 0.2, 7))]


CANDIDATES = (
    Candidate("braid", START),
    Candidate("surface of degree 2", ContractileSurface.blank(2)),
    Candidate("surface of degree 5", ContractileSurface.blank(5)),
    Candidate("surface of degree 6", ContractileSurface.blank(6)),
)


def test_a_comparison_does_not_warn_of_its_own_evaluations_beyond_a_range():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compare(am.load_data("dmsp-20-300"))


def test_the_order_in_sample_is_not_the_order_on_what_was_left_out():
    found = compare(bench(), CANDIDATES, leave_out=RunSplit())
    in_sample = min(found.ranking, key=lambda c: c.in_sample_rmse)
    assert in_sample.candidate.name == "surface of degree 5"
    assert found["surface of degree 5"].in_sample_rmse < 0.8 * found["braid"].in_sample_rmse
    assert (
        found["surface of degree 5"].cross_validated_rmse > 2 * found["braid"].cross_validated_rmse
    )
    assert found.recommended.candidate.name == "braid"
    assert "3 parameters" in found.reason
    ranking = next(table for table in found.chapter().tables if table.name == "ranking")
    assert min(ranking.columns["AICc above the lowest"]) == 0.0
    assert [c.cross_validated_rmse for c in found.ranking] == sorted(
        c.cross_validated_rmse for c in found.ranking
    )


def test_what_is_not_determined_is_excluded_with_its_reason():
    found = compare(bench(), CANDIDATES, leave_out=RunSplit())
    assert [e.name for e in found.excluded] == ["surface of degree 6"]
    assert "run 0.000" in found.excluded[0].reason
    assert "levels" in found.excluded[0].reason
    assert "degree" in found.excluded[0].reason


def test_a_part_left_out_is_not_among_the_points_of_its_fit():
    """With one run ruined, its own error is huge and that of laws fitted without it is what the
    truth leaves.
    """
    runs = bench()
    ruined = runs[3].with_columns(force=runs[3]["force"] + 500.0)
    found = compare([*runs[:3], ruined, *runs[4:]], CANDIDATES[:1], leave_out=RunSplit())
    errors = {part.fold: part.rmse for part in found.recommended.fold_scores}
    clean = fit_without(runs, 3)
    assert errors["run 0.100"] == pytest.approx(clean, rel=1e-6)


def fit_without(runs: list[Recording], index: int) -> float:
    model = am.fit(START, [run for i, run in enumerate(runs) if i != index]).model
    run = runs[index]
    error = model.force(run["pressure"], run["contraction"]) - run["force"] - 500.0
    return float(np.sqrt(np.mean(error**2)))


def test_of_laws_that_are_as_good_the_simplest_is_taken():
    exact = [isometric(c, seed=i, noise=1.0) for i, c in enumerate(np.linspace(0.0, 0.2, 9))]
    free = Candidate("braid", START)
    held = Candidate("braid, true ends", TonduLopez2000(START.geometry, 1.2), ("end_correction",))
    found = compare(exact, [free, held], leave_out=RunSplit())
    assert found.recommended.candidate.name == "braid, true ends"


def test_a_law_that_fails_at_one_part_only_is_not_recommended_for_its_large_standard_error():
    """The difference of 178 N at one of nine parts has a standard error as large as its mean."""
    found = compare(bench(), CANDIDATES[:2], leave_out=RunSplit())
    simple = found["braid"]
    rich = found["surface of degree 2"]
    good = [FoldScore(f"run {i}", 6.9, 30) for i in range(9)]
    failed = [*(FoldScore(f"run {i}", 6.8, 30) for i in range(8)), FoldScore("run 8", 178.0, 30)]
    best = dataclasses.replace(rich, fold_scores=tuple(good), cross_validated_rmse=6.9)
    poor = dataclasses.replace(simple, fold_scores=tuple(failed), cross_validated_rmse=59.7)
    assert excess_error(poor, best) < 0
    assert recommend([best, poor], RunSplit())[0] is best


def test_the_figure_of_the_folds_is_sorted_by_level_and_names_the_quantity_once():
    levels = (0.2, 0.04, 0.0, 0.12, 0.08, 0.16, 0.1)
    runs = [isometric(contraction, seed=i) for i, contraction in enumerate(levels)]
    comparison = compare(runs, CANDIDATES[:2], leave_out=LevelSplit("contraction"))
    plots = {plot.name: plot for plot in compare_chapter(comparison).plots}
    (axes,) = plots["left-out"].draw().axes
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert labels == ["0 %", "4 %", "8 %", "10 %", "12 %", "16 %", "20 %"]
    assert axes.get_xlabel() == "contraction"
    errors = {score.fold: score.rmse for score in comparison.ranking[0].fold_scores}
    assert axes.lines[0].get_ydata().tolist() == [
        errors[f"contraction {label}"] for label in labels
    ]


def test_the_figures_of_the_recommended_fit_are_in_one_of_two_chapters():
    def run(length: float, held: float) -> Recording:
        pressure = np.linspace(1e5, 6e5, 12)
        force = pressure * (1.5e-3 + 2e-4 * np.log(length)) * (1 - held / 0.3) ** 1.5 + np.cos(
            pressure
        )
        columns = {"pressure": pressure, "contraction": np.full(12, held), "force": force}
        return Recording(columns, f"{length}, {held}", {"resting_length": length})

    law = LogarithmicLength(ContractileSurface.blank(2), ContractileSurface.blank(1), 0.2, 0.2)
    runs = [run(length, held) for length in (0.1, 0.2, 0.3) for held in (0.0, 0.06, 0.12, 0.18)]
    joint = select_for_both(runs, [Candidate("one", law)])
    names = [
        [p.name for p in c.plots]
        for c in compare_chapters(joint.comparisons, joint.recommended[0], str(joint))
    ]
    assert names == [["run-left-out", "run-residuals", "run-correlations"], ["specimen-left-out"]]


def test_aicc_is_hurvich_and_tsais():
    contender = compare(bench(), CANDIDATES[:1], leave_out=RunSplit()).recommended
    n = 210
    k = 4
    pulls = sum(int((run["force"] > 0).sum()) for run in bench())
    assert pulls == n
    expected = n * np.log(contender.in_sample_rmse**2) + 2 * k + 2 * k * (k + 1) / (n - k - 1)
    assert contender.aicc == pytest.approx(expected, rel=1e-12)


def test_what_is_left_out_by_itself_is_the_widest_that_there_are_three_of():
    runs = bench()
    assert default_split(runs) == RunSplit()
    assert (
        default_split([run.with_constants(specimen=run.origin) for run in runs]) == SpecimenSplit()
    )
    whole = Recording(
        {n: np.concatenate([r[n] for r in runs]) for n in ("pressure", "contraction", "force")},
        "whole",
    )
    assert default_split([whole]) == LevelSplit("contraction")
    with pytest.raises(IdentificationError, match="more levels"):
        default_split([runs[0].rows(slice(0, 2))])


def test_levels_are_what_was_held():
    runs = bench()
    labels = [array.tolist() for array in LevelSplit("contraction").labels(runs)]
    assert all(len(set(names)) == 1 for names in labels)
    assert len({names[0] for names in labels}) == 7
    assert [labels[0][0], labels[-1][0]] == ["contraction 0 %", "contraction 20 %"]
    joined = Recording(
        {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}, "joined"
    )
    with pytest.raises(IdentificationError, match="one run"):
        compare(joined, CANDIDATES, leave_out=RunSplit())


def test_laws_of_every_direction_are_judged_in_force():
    law = Hunt2017(0.2)
    pressure, force = np.meshgrid(np.linspace(2e5, 6e5, 9), np.linspace(5.0, 300.0, 9))
    contraction = law.contraction(pressure.ravel(), force.ravel())
    found = evaluate_force(law, pressure.ravel(), contraction, 1000.0)
    assert found == pytest.approx(force.ravel(), abs=0.02)
    assert evaluate_force(law, np.array([1e5]), np.array([0.2]), 1000.0) == 0.0


def labelled(run: Recording, how) -> list[str]:
    return how.labels([run])[0].tolist()


def test_blocks_leave_stretches_of_every_run_out_and_keep_its_ends():
    run = isometric(0.1, seed=1, rows=100)
    labels = labelled(run, BlockSplit(folds=4))
    shares = (run["pressure"] - run["pressure"].min()) / np.ptp(run["pressure"])
    inside = (shares >= 1 / 8) & (shares < 7 / 8)
    assert [label == ALWAYS_FITTED for label in labels] == (~inside).tolist()
    stretch = (8 * shares[inside]).astype(int)
    assert [label for label in labels if label != ALWAYS_FITTED] == [
        f"block {s % 4 + 1}" for s in stretch
    ]
    two = BlockSplit(folds=4).labels([run, run])
    assert all(a == ALWAYS_FITTED or a != b for a, b in zip(*two, strict=True))
    found = compare(bench(), CANDIDATES[:1], leave_out=BlockSplit())
    rows = sum(part.rows for part in found.recommended.fold_scores)
    assert rows == int((np.concatenate(BlockSplit().labels(bench())) != ALWAYS_FITTED).sum())
    with pytest.raises(ParameterError, match="2 or more"):
        BlockSplit(folds=1)


def test_what_is_left_out_decides_what_the_law_is_for():
    """SpecimenSplit that each have a bend of their own: within them a rich law is right, and for
    another a plain one.
    """
    inner = ContractileSurface((300.0, -200.0, 180.0), 0.5e5, 6e5, 0.0, 0.2, -1e6, 1e6, 1)
    runs = []
    for i, length in enumerate((0.1, 0.17, 0.26, 0.4)):
        bend = (25.0, -20.0, 30.0, -35.0)[i]
        for contraction in np.linspace(0.0, 0.14, 6) + 0.004 * i:
            random = np.random.default_rng(len(runs))
            pressure, held = np.linspace(1e5, 6e5, 15), np.full(15, contraction)
            force = (
                inner.polynomial(pressure, held)
                + bend * np.sin(45 * held)
                + 1.0 * random.standard_normal(15)
            )
            columns = {"pressure": pressure, "contraction": held, "force": force}
            runs.append(
                Recording(
                    columns,
                    f"run {len(runs)}",
                    {"resting_length": length, "specimen": f"{length} m"},
                )
            )
    candidates = [
        Candidate("plain", ContractileSurface.blank(1)),
        Candidate(
            "rich",
            InverseLength(ContractileSurface.blank(5), ContractileSurface.blank(3), 0.4, 0.4),
        ),
    ]
    within, beyond = (
        compare(runs, candidates, leave_out=how) for how in (BlockSplit(), SpecimenSplit())
    )
    assert (within.recommended.candidate.name, beyond.recommended.candidate.name) == (
        "rich",
        "plain",
    )
    assert within.purpose in within.reason
    assert "the measured muscles and contractions, within the measured range" in within.reason
    assert beyond.purpose in str(beyond).splitlines()[0]
    assert "for other muscles of the same type" in beyond.reason


@pytest.mark.parametrize(
    ("word", "how"),
    [
        ("run", RunSplit()),
        ("specimen", SpecimenSplit()),
        ("block", BlockSplit()),
        ("pressure", LevelSplit("pressure")),
    ],
)
def test_the_command_knows_each_way_by_a_word(word: str, how):
    assert build(FitRequest, {"compare": True, "leave_out": word}, str).split == how


def test_each_way_of_leaving_out_has_a_purpose_of_its_own():
    purposes = [
        how.purpose for how in (RunSplit(), SpecimenSplit(), LevelSplit("pressure"), BlockSplit())
    ]
    assert len(set(purposes)) == 4


def test_the_command_writes_a_muscle_that_loads_back(tmp_path: Path):
    files = []
    for i, run in enumerate(bench()):
        files.append(tmp_path / f"run{i}.csv")
        write(run, files[-1])
    out = tmp_path / "out"
    options = [
        "--compare",
        "--leave-out",
        "run",
        "--resting-length",
        "300 mm",
        "--out",
        str(out),
        "--json",
    ]
    done = airmuscle("fit", *map(str, files), *options)
    assert done.exit_code == 0, done.output
    printed = json.loads(done.stdout)
    compared = printed["comparison"]
    assert compared["purpose"] == RunSplit().purpose
    assert (
        compared["recommended"] == compared["ranking"][0]["law"]
        or "standard error" in compared["summary"][0]
    )
    entry = am.load(out / "muscle.toml")
    fitted = {p["parameter"]: p["value"] for p in printed["fit"]["parameters"]}
    from airmuscle.core import tree

    loaded = {leaf.path: leaf.value for leaf in tree.leaves(entry.characteristic)}
    assert {name: loaded[name] for name in fitted} == fitted
    names = {path.stem for path in (out / "figures").glob("*.svg")}
    assert {"isobars", "errors", "residuals", "correlations", "left-out"} <= names
    assert "Ranking by cross-validation error" in (out / "report.html").read_text(encoding="utf-8")


def test_the_command_refuses_what_it_cannot_do(tmp_path: Path):
    done = airmuscle("fit", "dmsp-20-300", "--out", tmp_path / "a")
    assert done.exit_code == 2
    assert "--characteristic" in done.output
    done = airmuscle(
        "fit", "dmsp-20-300", "--compare", "--leave-out", "rows", "--out", tmp_path / "a"
    )
    assert done.exit_code == 2
    assert "contraction" in done.output
    assert not (tmp_path / "a").exists()


def test_a_law_without_a_force_at_measured_points_is_not_ranked_in_silence():
    recording = load_data("festo-tool-dmsp-40")
    candidates = [
        c for c in standard_candidates([recording]) if c.name in ("Hunt2017", "surface of degree 2")
    ]
    (excluded,) = compare(recording, candidates).excluded
    assert excluded.name == "Hunt2017"
    assert (
        "It gives no force at a measured point. Hunt2017: no force in the range 0 to 1e+04 N"
        in excluded.reason
    )


def test_a_ranked_law_that_is_slack_at_measured_points_says_so():
    recording = load_data("festo-tool-dmsp-20")
    candidates = [
        c for c in standard_candidates([recording]) if c.name in ("Hunt2017", "surface of degree 2")
    ]
    comparison = compare(recording, candidates)
    (note,) = comparison["Hunt2017"].notes
    assert note.startswith(
        "it is slack at 2 of 54 points with a positive force and is ranked with zero force there"
    )
    assert f"note: Hunt2017: {note}" in str(comparison)
    assert comparison["surface of degree 2"].notes == ()


def test_the_progress_of_a_comparison_has_an_end():
    steps = []
    compare(
        bench(),
        CANDIDATES,
        leave_out=RunSplit(),
        progress=lambda name, fraction: steps.append((name, fraction)),
    )
    assert steps == [(c.name, i / 4) for i, c in enumerate(CANDIDATES)] + [("", 1.0)]


def test_each_law_that_is_left_out_has_one_line_with_its_cause():
    found = compare(bench(), CANDIDATES, leave_out=RunSplit())
    excluded = next(table for table in found.chapter().tables if table.name == "excluded")
    assert list(excluded.columns["law"]) == ["surface of degree 6"]
    (cause,) = excluded.columns["cause"]
    assert cause.startswith("without run 0.000, the data cannot separate ")
    assert cause.endswith("(rank 27 of 28)")
    assert len(cause) <= 100
    assert " ".join(cause.split()[-3:]) in " ".join(str(found).split())


@model
class LinearLaw(ForceLaw):
    """A law of a user: F = p A (1 - eps/eps_max), started by the scales of the data."""

    area: float = parameter("m2", "A", "effective area at rest", bounds=(0.0, 0.1))
    max_contraction: float = parameter(
        "1", "eps_max", "contraction without load", bounds=(0.01, 0.6)
    )

    @classmethod
    def guess(cls, data):
        scales = DataScales.of(data)
        return cls(scales.force / scales.pressure, 1.5 * scales.contraction)

    def force(self, pressure, contraction):
        return pressure * self.area * (1.0 - contraction / self.max_contraction)


def test_a_law_that_starts_itself_takes_part_once_it_is_in_the_package(monkeypatch):
    runs = bench()
    (truth,) = [LinearLaw(1e-3, 0.3)]
    made = [
        run.with_columns(force=truth.force(run["pressure"], run["contraction"])) for run in runs
    ]
    guess = LinearLaw.guess(made)
    assert guess.area == max(run["force"].max() for run in made) / max(
        run["pressure"].max() for run in made
    )
    assert "LinearLaw" not in {each.name for each in standard_candidates(made)}
    monkeypatch.setattr(am.characteristic, "LinearLaw", LinearLaw, raising=False)
    monkeypatch.setattr(
        am.characteristic, "__dir__", lambda: [*am.characteristic.__all__, "LinearLaw"]
    )
    own = next(each for each in standard_candidates(made) if each.name == "LinearLaw")
    assert (own.law, own.fixed) == (guess, ())
    ranked = compare(made, [own, *standard_candidates(made)[:2]], leave_out=RunSplit())
    assert ranked["LinearLaw"].fit.values == pytest.approx([1e-3, 0.3], rel=1e-6)


def test_each_started_law_gives_forces_of_the_size_of_the_data():
    """The wall thickness of MartensBoblan2017 only multiplies its modulus and is kept."""
    runs = [dataclasses.replace(run, constants={"resting_length": 0.3}) for run in bench()]
    greatest = max(float(run["force"].max()) for run in runs)
    started = {each.name: each for each in standard_candidates(runs)}
    for name in (
        "ChouHannaford1996",
        "TonduLopez2000",
        "MartensBoblan2017",
        "Sarosi2012",
        "Hunt2017",
    ):
        pressure = max(float(run["pressure"].max()) for run in runs)
        assert 0.2 * greatest < float(started[name].law.force(pressure, 0.0)) < 5 * greatest, name
    assert started["MartensBoblan2017"].fixed == ("wall_thickness",)


@pytest.mark.parametrize("name", ["pressure", "contraction", "force"])
def test_laws_are_not_started_without_any_value_of_a_column(name: str):
    with pytest.raises(
        IdentificationError, match="no value of the pressure, of the contraction or of the force"
    ):
        standard_candidates(
            [run.with_columns(**{name: np.full(len(run), np.nan)}) for run in bench()]
        )


def test_the_laws_of_a_small_muscle_start_within_their_bounds():
    small = [run.with_columns(force=1e-4 * run["force"]) for run in bench()]
    assert {each.name for each in standard_candidates(small)} == {
        each.name for each in standard_candidates(bench())
    }


@pytest.mark.parametrize("split", [RunSplit(), BlockSplit(), LevelSplit("pressure")])
def test_a_recording_without_rows_does_not_count_in_a_comparison(split):
    given = [*bench(), bench()[0].rows(slice(0, 0))]
    assert standard_candidates(given) == standard_candidates(bench())
    errors = [
        compare(each, CANDIDATES[:1], leave_out=split).recommended.cross_validated_rmse
        for each in (given, bench())
    ]
    assert errors[0] == errors[1]


def test_a_law_without_a_guess_is_not_started_and_says_so():
    with pytest.raises(
        IdentificationError, match=r"BorzikovaDirect is not started from data; give its initial par"
    ):
        am.characteristic.BorzikovaDirect.guess(bench())


@pytest.mark.parametrize(
    ("name", "factor", "cause"),
    [
        ("force", 0, "the muscle is slack, or the load cell is not connected"),
        ("force", -1, "the sign of the force is wrong"),
        ("pressure", 0, "the pressure is at most 0 Pa, without which no muscle pulls"),
    ],
)
def test_data_without_tension_or_pressure_determine_no_law_and_say_so(name, factor, cause):
    runs = [run.with_columns(**{name: factor * run[name]}) for run in bench()]
    with pytest.raises(IdentificationError, match=cause):
        compare(runs)


def test_laws_that_need_a_length_are_named_where_none_is_stated():
    runs = [dataclasses.replace(run, constants={}) for run in bench()]
    found = compare(runs, leave_out=RunSplit())
    causes = {each.name: each.cause for each in found.unavailable}
    assert causes["TonduLopez2000"] == "not every recording states its resting length"
    line, family = [
        each for each in str(found).splitlines() if each.startswith("note: not compared: ")
    ]
    assert line.endswith(
        "Serres2009, TonduLopez2000: not every recording states its resting length."
    )
    assert family.endswith("LogarithmicLength: data of two resting lengths or more are required.")
    assert compare(runs, CANDIDATES[1:2], leave_out=RunSplit()).unavailable == ()


def test_a_fit_of_another_process_states_its_errors_in_the_unit_of_the_force():
    """A result from a process is a copy, also of the quantity that was fitted."""
    fit = am.fit(ContractileSurface.blank(2), load_data("dmsp-20-300"))
    copy = pickle.loads(pickle.dumps(fit))
    assert copy.format_residual(12.5) == fit.format_residual(12.5) == "12.5 N"
    assert copy.goodness() == fit.goodness()


def test_the_text_lists_the_first_laws_and_the_recommended_one():
    """Of the excluded laws the first four; `ranking` and `excluded` contain all."""
    comparison = compare(load_data("dmsp-20-300"), leave_out=LevelSplit("contraction"))
    last = dataclasses.replace(
        comparison.ranking[0], candidate=Candidate("the recommended law", START)
    )
    ranking = (
        *comparison.ranking[:5],
        *comparison.ranking[:5],
        *comparison.ranking[:2],
        last,
        *comparison.ranking[:3],
    )
    long = dataclasses.replace(comparison, ranking=ranking, recommended=last)
    lines = str(long).splitlines()
    at = lines.index(next(line for line in lines if line.startswith("the recommended law  ")))
    assert (lines[at - 1], lines[at + 1]) == ("... 2 more", "... 3 more in its chapter()")
    assert lines[at - 11].startswith(f"{ranking[0].candidate.name}  ")
    excluded = lines[lines.index("Laws that are not ranked") + 3 :]
    named = [each.name for each in comparison.excluded]
    assert [
        name for name in named[:4] if not any(line.startswith(f"{name}  ") for line in excluded)
    ] == []
    assert f"... {len(named) - 4} more in its chapter()" in excluded
