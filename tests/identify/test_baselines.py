"""A prediction is shown beside persistence and a linear ARX model that runs freely, with its skill.

The ARX model of a record is fitted to the others, or to the other half of a single one: a linear
process is then predicted to its noise. Skill is 1 - error/error of the better baseline.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import write
from airmuscle.bench.prediction.baselines import (
    ARX,
    PERSISTENCE,
    TimedRecord,
    baseline_errors,
    fit_arx,
    skill,
)
from airmuscle.files import load
from airmuscle.recording import Recording


def linear_record(seed: int, rows: int = 400, step: float = 0.01) -> TimedRecord:
    """x'' = u - 2 x' - 4 x, in exact steps of its matrix exponential, with a random staircase of
    u.
    """
    from scipy.linalg import expm

    inputs = np.repeat(np.random.default_rng(seed).uniform(0.0, 1.0, rows // 20), 20)
    matrix = expm(step * np.array([[0.0, 1.0, 0.0], [-4.0, -2.0, 1.0], [0.0, 0.0, 0.0]]))
    state = np.zeros(2)
    values = []
    for u in inputs:
        values.append(state[0])
        state = (matrix @ [*state, u])[:2]
    time = step * np.arange(rows)
    return TimedRecord(
        time, np.array(values)[:, None], inputs[:, None], np.ones((rows, 1), dtype=bool)
    )


def test_skill_is_one_minus_the_error_over_that_of_the_better_baseline():
    assert skill(1.0, {"a": 4.0, "b": 10.0}) == pytest.approx(0.75)
    assert skill(8.0, {"a": 4.0}) == pytest.approx(-1.0)
    assert skill(1.0, {}) is None
    assert skill(0.0, {"a": 0.0}) is None


@pytest.mark.parametrize("count", [1, 3])
def test_a_linear_process_is_predicted_by_the_other_records_or_the_other_half(count):
    records = [linear_record(seed) for seed in range(count)]
    for record, errors in zip(records, baseline_errors(records), strict=True):
        assert errors[ARX][0] < 0.01 * np.ptp(record.outputs)
        deviation = record.outputs[:, 0] - record.outputs[0, 0]
        assert errors[PERSISTENCE][0] == pytest.approx(np.sqrt(np.mean(deviation**2)))


def test_the_record_itself_is_not_among_those_of_its_fit():
    """A record of another process is predicted badly, although it would predict itself."""
    slow = linear_record(1)
    other = slow._replace(outputs=-slow.outputs)
    assert baseline_errors([slow, other])[1][ARX][0] > 0.5 * np.ptp(slow.outputs)


def test_rows_that_are_not_compared_do_not_count():
    record = linear_record(2)
    spoiled = record.outputs.copy()
    spoiled[50] = np.nan
    compared = np.isfinite(spoiled)
    found = baseline_errors([record._replace(outputs=spoiled, compared=compared)])[0]
    assert found[PERSISTENCE][0] == pytest.approx(
        np.sqrt(np.mean(record.outputs[compared[:, 0]] ** 2))
    )
    assert np.isfinite(found[ARX][0])


def test_a_record_of_few_rows_has_persistence_alone():
    assert list(baseline_errors([linear_record(3, rows=40).on_grid(0.05)])[0]) == [PERSISTENCE]


def test_a_free_run_of_an_unstable_model_keeps_its_limits():
    growing = np.cumprod(np.full((60, 1), 1.2), axis=0)
    model = fit_arx([(growing, np.zeros((60, 1)))], -10.0, 10.0)
    assert model.free_run(growing[None, :4], np.zeros((1, 400, 1))).max() == 10.0


def test_predict_shows_the_baselines_and_the_skill(tmp_path):
    law = load("dmsp-20-300").characteristic
    files = []
    for i, held in enumerate((0.02, 0.08)):
        pressure = 3e5 + 2e5 * np.sin(np.linspace(0.0, 6.0 + i, 300))
        contraction = np.full(300, held)
        force = 0.97 * np.asarray(law.force(pressure, contraction))
        columns = {
            "time": 0.05 * np.arange(300),
            "pressure": pressure,
            "contraction": contraction,
            "force": force,
        }
        files.append(tmp_path / f"{i}.csv")
        write(Recording(columns, f"{i}", {"resting_length": 0.3}), files[-1])
    done = airmuscle(
        "predict",
        "dmsp-20-300",
        *files,
        "--resting-length",
        "300 mm",
        "--out",
        tmp_path / "p",
        "--json",
    )
    assert done.exit_code == 0, done.output
    for row in json.loads(done.stdout)["prediction"]["predictions"]:
        best = min(row["rms_error_of_persistence"], row["rms_error_of_an_ARX_of_depth_4"])
        assert row["skill"] == pytest.approx(1 - row["rms_error"] / best, rel=1e-6)
    page = (tmp_path / "p" / "report.html").read_text(encoding="utf-8")
    assert "the ARX model is fitted to the other records" in page
