"""The band for a specimen that was not measured comes from the specimens left out of the fit, with
Student's t for their small number; it holds 90 to 99 % of the rows of further specimens that vary
as the measured ones do.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import airmuscle as am
from airmuscle.bench import fit, standard_candidates
from airmuscle.bench.comparison import SpecimenErrors, specimens_of
from airmuscle.bench.comparison.specimen_errors import specimen_errors
from airmuscle.bench.estimation import degrees_of_freedom, leverages, t_quantile
from airmuscle.files import Entry, save
from airmuscle.files.library import predict_with_entry
from airmuscle.files.library.fitted_entry import fitted_entry
from airmuscle.physics import ContractileSurface
from airmuscle.recording import Recording

LENGTHS = {3: (0.1, 0.2, 0.4), 4: (0.1, 0.16, 0.25, 0.4), 6: (0.1, 0.13, 0.18, 0.24, 0.31, 0.4)}
LAW = "surface of degree 2 + length correction ln L0 of degree 1 + muscle effects of degree 2"
NOISE = 1.0


def specimen(
    rng: np.random.Generator, length: float, name: str, spread: float = 0.04
) -> list[Recording]:
    """Ramps of the pressure at four held lengths, of a muscle whose gain, slope and threshold
    differ from the type.
    """
    gain, slope, threshold = 1.0 + spread * rng.normal(size=3) * (1.0, 2.0, 5.0)
    runs = []
    pressure = np.linspace(1e5, 6e5, 30)
    for contraction in (0.02, 0.08, 0.14, 0.2):
        force = gain * 9e-4 * (pressure - 2e4 * threshold) * (1.0 - 3.4 * slope * contraction)
        force += 15.0 * math.log(length / 0.2) + rng.normal(0.0, NOISE, pressure.size)
        constants = {"resting_length": length, "specimen": name}
        columns = {"pressure": pressure, "contraction": np.full(30, contraction), "force": force}
        runs.append(Recording(columns, f"{name} {contraction}", constants))
    return runs


def family(seed: int, count: int) -> tuple[Entry, list[float]]:
    """The entry fitted to a number of specimens, and the share of the rows of three further ones
    within its band.
    """
    rng = np.random.default_rng(seed)
    runs = [
        run for i, length in enumerate(LENGTHS[count]) for run in specimen(rng, length, f"S{i}")
    ]
    (law,) = [each.law for each in standard_candidates(runs) if each.name == LAW]
    result = fit(law, runs)
    errors = specimen_errors(result, runs)
    entry = fitted_entry(
        result, Entry("m", "m", "fitted", law), [Path("x.csv")], recordings=runs, errors=errors
    )
    shares = []
    for i in range(3):
        predictions = [
            predict_with_entry(entry, run) for run in specimen(rng, rng.uniform(0.1, 0.4), f"N{i}")
        ]
        shares.append(float(np.mean([each.quantities[0].share for each in predictions])))
    return entry, shares


def coverage(count: int, repetitions: int) -> float:
    return float(np.mean([family(seed, count)[1] for seed in range(repetitions)]))


def test_the_band_of_further_specimens_holds_90_to_99_percent():
    assert 0.9 <= coverage(3, 10) <= 0.99


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 4, 6])
def test_the_band_of_further_specimens_holds_90_to_99_percent_of_many_families(count):
    assert 0.9 <= coverage(count, 40) <= 0.99


@pytest.fixture(scope="module")
def entry() -> Entry:
    """A muscle of four specimens."""
    return family(1, 4)[0]


def test_the_band_of_the_measured_specimens_remains_theirs(entry):
    band = entry.error_band
    assert band.half_width == pytest.approx(1.96 * NOISE, rel=0.15)
    assert band.specimens == ("S0", "S1", "S2", "S3")
    rng = np.random.default_rng(1)
    measured = predict_with_entry(entry, specimen(rng, 0.1, "S0")[1])
    assert set(measured.quantities[0].half_width) == {band.half_width}
    assert not measured.notes


def test_a_specimen_that_was_not_measured_is_named_and_has_the_band_of_those_left_out(entry):
    record = specimen(np.random.default_rng(9), 0.2, "X")[0]
    prediction = predict_with_entry(entry, record)
    (force,) = prediction.quantities
    assert force.half_width[0] == pytest.approx(entry.error_band.new_specimen_half_width, rel=0.01)
    assert "specimen X was not measured (measured: S0, S1, S2, S3)" in " ".join(prediction.notes)
    assert "3.18, the 95 % quantile of Student's t with 3 degrees of freedom" in force.band


def test_the_band_widens_and_a_note_names_the_length_beyond_the_measured_ones(entry):
    rng = np.random.default_rng(2)
    within, beyond = (
        predict_with_entry(entry, specimen(rng, length, "X")[0]) for length in (0.2, 0.8)
    )
    assert beyond.quantities[0].half_width[0] > 1.4 * within.quantities[0].half_width[0]
    assert "the resting length, 800 mm, is outside that of the fit, 100 mm to 400 mm" in " ".join(
        beyond.notes
    )
    assert "resting length" not in " ".join(within.notes)


def test_a_prediction_of_another_specimen_states_the_force_where_others_were_slack(entry, tmp_path):
    assert entry.error_band.new_specimen_slack_force is None  # no row of these is slack
    band = dataclasses.replace(entry.error_band, new_specimen_slack_force=76.0)
    save(dataclasses.replace(entry, error_band=band), tmp_path / "muscle.toml")
    stated = am.load(tmp_path / "muscle.toml")
    assert stated.error_band == band
    rng = np.random.default_rng(9)
    other, measured = (
        " ".join(predict_with_entry(stated, specimen(rng, 0.2, name)[0]).notes)
        for name in ("X", "S0")
    )
    assert "specimens left out of the fit were slack, the law gave up to 76 N" in other
    assert "slack" not in measured


def test_two_specimens_state_no_band_for_others(tmp_path):
    rng = np.random.default_rng(3)
    runs = [run for i, length in enumerate((0.1, 0.3)) for run in specimen(rng, length, f"S{i}")]
    law = ContractileSurface.blank(3)
    result = fit(law, runs)
    assert specimen_errors(result, runs) is None
    entry = fitted_entry(result, Entry("m", "m", "fitted", law), [Path("x.csv")], recordings=runs)
    prediction = predict_with_entry(entry, specimen(rng, 0.2, "X")[0])
    assert prediction.quantities[0].share is None
    assert prediction.quantities[0].band == "not known for a specimen that was not measured"
    assert "the band is not known for a specimen that was not measured" in " ".join(
        prediction.notes
    )


def test_a_muscle_file_keeps_both_bands_with_what_they_hold_for(entry, tmp_path):
    save(entry, tmp_path / "muscle.toml")
    assert am.load(tmp_path / "muscle.toml").error_band == entry.error_band


def test_files_that_state_neither_specimen_nor_length_are_not_taken_for_specimens():
    run = Recording({"pressure": np.ones(2)}, "a")
    assert specimens_of([run, run.with_constants(specimen="A")]) == ()
    assert specimens_of(
        [run.with_constants(specimen="A"), run.with_constants(resting_length=0.2)]
    ) == ("A", "200 mm")


def test_the_quantile_is_that_of_students_t_and_the_number_of_rows_does_not_count():
    assert t_quantile(2) == pytest.approx(4.3027, abs=1e-4)
    assert t_quantile(math.inf) == pytest.approx(1.95996, abs=1e-4)
    errors = SpecimenErrors(("a", "b", "c"), (3.0, 4.0, 5.0))
    assert errors.deviation == pytest.approx(math.sqrt(50.0 / 3.0 * 2.0 / 3.0))
    assert errors.half_width == pytest.approx(
        4.3027 * errors.deviation * math.sqrt(4.0 / 3.0), rel=1e-4
    )


def test_the_leverage_of_a_specimen_is_that_of_the_regression_by_the_logarithm_of_its_length():
    lengths = [0.1, 0.2, 0.4]
    matrix = np.vander(np.log(lengths), 2)
    hat = matrix @ np.linalg.inv(matrix.T @ matrix) @ matrix.T
    np.testing.assert_allclose(leverages(lengths, lengths), np.diag(hat), rtol=1e-12)
    np.testing.assert_allclose(leverages([0.2, 0.2], [0.2, 0.3]), 0.5)


def test_records_whose_errors_are_their_noise_have_the_normal_quantile_and_others_that_of_their_number():
    assert degrees_of_freedom(1.0, 1.0, 2) == math.inf
    assert degrees_of_freedom(10.0, 0.1, 3) == pytest.approx(2.0, rel=1e-3)
