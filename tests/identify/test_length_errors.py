"""A resting length that is recorded wrongly is found as a nuisance parameter of the fit to several
specimens.

The shortening is measured, so that the contraction is wrong by a constant factor: nothing at rest,
one sign elsewhere. With a law whose ends are free, an error in one of three lengths has the same
effect as one in either of the others.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import airmuscle as am
from airmuscle.bench import (
    Candidate,
    RunSplit,
    compare,
    estimate_length_error,
    find_length_errors,
    select_for_both,
)
from airmuscle.bench.comparison import comparison_chapter
from airmuscle.bench.statics import blank_surface, corrected_length
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.physics import Braid, EffectiveLength, LogarithmicLength, TonduLopez2000
from airmuscle.recording import Recording

LAW = EffectiveLength(blank_surface(3), 0.3, 0.005)
OTHER = LogarithmicLength(blank_surface(3), blank_surface(1), 0.3, 0.3)


def run(length: float, contraction: float, seed: int) -> Recording:
    random = np.random.default_rng(seed)
    pressure = np.linspace(0.3e5, 6e5, 50)
    held = np.full(50, contraction)
    law = TonduLopez2000(Braid(0.01, 0.45, length - 0.02), 1.15)
    force = law.force(pressure, held * length / (length - 0.02)) + 2 * random.standard_normal(50)
    columns = {"pressure": pressure, "contraction": held, "force": force}
    return Recording(columns, f"run {seed}", {"resting_length": length})


def rig(wrong: float = 0.0) -> list[Recording]:
    """Three specimens; the resting length of that of 200 mm is recorded too long by `wrong` [m]."""
    points = [(length, held) for length in (0.15, 0.2, 0.3) for held in (0.0, 0.06, 0.12, 0.18)]
    runs = [run(*point, seed) for seed, point in enumerate(points)]
    return [corrected_length(r, wrong) if r.constants["resting_length"] == 0.2 else r for r in runs]


def test_an_error_of_a_recorded_length_is_estimated_with_its_standard_error():
    runs = rig(0.002)
    found = estimate_length_error(am.fit(LAW, runs).model, runs, "202 mm")
    assert found.resting_length == pytest.approx(0.202)
    assert abs(found.offset + 0.002) < 3 * found.standard_error
    assert found.standard_error < 3e-4
    assert found.rmse_after < 0.8 * found.rmse_before


def test_the_search_ends_where_no_correction_of_the_length_reduces_the_residuals_enough():
    runs = rig(0.002)
    ended = estimate_length_error(am.fit(LAW, runs).model, runs, "202 mm", min_reduction=1e6)
    assert ended.offset == 0.0
    assert ended.rmse_after == ended.rmse_before


def test_a_strong_prior_keeps_the_recorded_length():
    runs = rig(0.002)
    model = am.fit(LAW, runs).model
    held, free = (estimate_length_error(model, runs, "202 mm", prior) for prior in (1e-6, 1e-2))
    assert abs(held.offset) < 1e-5 < abs(free.offset)
    assert held.standard_error < free.standard_error


def test_the_error_of_one_length_is_reported_with_its_alternatives():
    runs = rig(0.002)
    found = {
        each.specimen: each.offset for each in find_length_errors(am.fit(LAW, runs).model, runs)
    }
    assert found["202 mm"] == pytest.approx(-0.002, abs=4e-4)
    comparison = compare(runs, [Candidate("ends", LAW)])
    (note,) = comparison.notes
    assert "that of 202 mm were 2" in note
    assert "mm less" in note
    assert f"note: {note}" in str(comparison)


@pytest.mark.parametrize("law", [LAW, OTHER])
def test_correct_lengths_give_no_remark_even_if_the_law_does_not_fit(law):
    runs = rig()
    assert find_length_errors(am.fit(law, runs).model, runs) == ()
    assert compare(runs, [Candidate("law", law)]).notes == ()


def test_two_specimens_do_not_show_an_error_of_length():
    runs = [each for each in rig(0.002) if each.constants["resting_length"] != 0.3]
    assert find_length_errors(am.fit(OTHER, runs).model, runs) == ()


def test_one_law_for_two_purposes_states_its_excess_over_the_best_of_each():
    candidates = [
        Candidate("ends", LAW),
        Candidate("logarithm", OTHER),
        Candidate("surface", blank_surface(2)),
    ]
    steps = []
    found = select_for_both(
        rig(), candidates, progress=lambda name, fraction: steps.append(fraction)
    )
    errors = [[each[c.name].cross_validated_rmse for c in candidates] for each in found.comparisons]
    worst = [max(row[i] / min(row) for row in errors) for i in range(3)]
    assert found.recommended[0].candidate is candidates[int(np.argmin(worst))]
    errors_of_both = zip(found.recommended, errors, strict=True)
    assert max(model.cross_validated_rmse / min(row) for model, row in errors_of_both) == min(worst)
    assert [each.leave_out.group_name for each in found.comparisons] == ["run", "specimen"]
    assert "For further runs of the same kind: rms error" in str(found)
    assert steps == sorted(steps)
    assert steps[-1] == 1.0


def test_a_law_that_is_not_determined_for_one_purpose_is_not_the_one_law(monkeypatch):
    two = [each for each in rig() if each.constants["resting_length"] != 0.3]
    family, surface = Candidate("logarithm", OTHER), Candidate("surface", blank_surface(1))
    found = select_for_both(two, [family, surface])
    assert found.comparisons[0].ranking[0].candidate is family
    assert found.recommended[0].candidate is surface
    monkeypatch.setattr(
        comparison_chapter,
        "compare_splits",
        lambda runs, _, splits, **__: tuple(
            compare(two, [family if split == RunSplit() else surface], leave_out=split)
            for split in splits
        ),
    )
    with pytest.raises(
        IdentificationError, match="no candidate is determined without each run and without each"
    ):
        select_for_both(two, [family, surface])


def test_a_corrected_length_keeps_the_shortening():
    before = rig()[1]
    after = corrected_length(before, 0.01)
    assert after["contraction"] * 0.16 == pytest.approx(before["contraction"] * 0.15)
    with pytest.raises(ParameterError, match="not stated"):
        corrected_length(dataclasses.replace(before, constants={}), 0.01)
    with pytest.raises(ParameterError, match="greater than 0"):
        corrected_length(before, -0.2)
    with pytest.raises(ParameterError, match="the specimens are 150 mm, 200 mm, 300 mm"):
        estimate_length_error(LAW, rig(), "1 m")
