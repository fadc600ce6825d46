"""A prediction states what it does not know: rows without tension where the law pulls count as
errors, and speeds, ranges, specimens and records that were not part of the fit are named with their
numbers.
"""

from __future__ import annotations

import csv
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from dynamic_study import HELD, STUDY, noisy_run, plant_table, run_table

import airmuscle as am
from airmuscle.bench import predict_static, rate_of_change, write
from airmuscle.errors import ParameterError
from airmuscle.files import load_scenario
from airmuscle.files.library import PLANT_READER, Location, StatedBand
from airmuscle.recording import Recording

LAW = "chou-hannaford"


def sweep(
    pressure: float = 3e5, seed: int = 1, rows: int = 300, top: float = 0.2, duration: float = 60.0
) -> Recording:
    """A triangle of the length at constant pressure, with noise of 4 N."""
    contraction = np.interp(np.linspace(0.0, 2.0, rows), [0.0, 1.0, 2.0], [0.02, top, 0.02])
    force = am.load(LAW).characteristic.force(np.full(rows, pressure), contraction)
    columns = {"time": np.linspace(0.0, duration, rows), "pressure": np.full(rows, pressure)}
    noise = np.random.default_rng(seed).normal(0.0, 4.0, rows)
    return Recording(
        {**columns, "force": force + noise, "contraction": contraction},
        "run",
        {"resting_length": 0.3},
    )


@pytest.fixture(scope="module")
def muscle(tmp_path_factory) -> Path:
    """A muscle fitted to three isobars of 0.6 % contraction per second."""
    folder = tmp_path_factory.mktemp("static")
    for bar in (2.0, 3.5, 5.0):
        write(sweep(bar * 1e5, int(bar)), folder / f"isobar{bar:g}.csv")
    files = sorted(folder.glob("*.csv"))
    options = ("--characteristic", LAW, "--resting-length", "300 mm", "--out", folder / "fit")
    assert airmuscle("fit", *files, *options).exit_code == 0
    return folder / "fit" / "muscle.toml"


def predicted(muscle: Path, record: Recording, tmp_path: Path, length: str = "300 mm") -> dict:
    """The prediction of a record by the command, with the folder of its files."""
    write(record, tmp_path / "run.csv")
    done = airmuscle(
        "predict",
        muscle,
        tmp_path / "run.csv",
        "--resting-length",
        length,
        "--out",
        tmp_path / "p",
        "--json",
    )
    assert done.exit_code == 0, done.stderr
    said = json.loads(done.stdout)
    (row,) = said["prediction"]["predictions"]
    return {**row, "notes": said["prediction_1"]["notes"]}


def test_rows_without_tension_where_the_law_pulls_count_as_errors_outside_the_band(
    muscle, tmp_path
):
    run = sweep()
    force = run["force"].copy()
    force[:60] = -6.7
    record = predicted(muscle, run.with_columns(force=force), tmp_path)
    assert record["rows"] == 300
    assert record["rows_within_the_band"] < 0.81
    assert record["maximum_error"] > 300.0
    assert record["in_row"] <= 60
    (note,) = [note for note in record["notes"] if "without tension" in note]
    assert "the law pulls at 60 of 60 rows without tension" in note


def test_rows_without_tension_where_the_law_is_slack_are_not_compared():
    run = sweep()
    law = am.load(LAW).characteristic
    force = run["force"].copy()
    slack = run.with_columns(
        pressure=np.where(np.arange(300) < 60, 0.0, 3e5),
        force=np.where(np.arange(300) < 60, -2.0, force),
    )
    prediction = predict_static(law, slack, half_width=8.0)
    assert int(prediction.quantities[0].compared.sum()) == 240
    assert not [note for note in prediction.notes if "tension" in note]


def test_a_faster_record_is_named_with_both_rates_in_terminal_report_and_csv(muscle, tmp_path):
    band = am.load(muscle).error_band
    assert band.max_contraction_rate == pytest.approx(0.006, rel=0.02)
    record = predicted(muscle, sweep(duration=12.0), tmp_path)
    (note,) = record["notes"]
    assert note.startswith(
        "the record is faster than those of the fit: contraction changes by up to 3"
    )
    assert "in the fit by 0.6" in note
    with (tmp_path / "p" / "data" / "predictions.csv").open(encoding="utf-8") as file:
        assert "faster than those of the fit" in file.read()
    assert "faster than those of the fit" in (tmp_path / "p" / "report.html").read_text(
        encoding="utf-8"
    )
    assert not predicted(muscle, sweep(), tmp_path)["notes"]


def test_rows_outside_the_range_are_named_with_both_ranges_and_marked_in_the_csv(muscle, tmp_path):
    record = predicted(muscle, sweep(6e5, top=0.23), tmp_path)
    (note,) = record["notes"]
    assert "pressure 600 kPa to 600 kPa, fitted 200 kPa to 500 kPa" in note
    assert "contraction 2 % to 22.93 %, fitted 2 % to 19.94 %" in note
    with (tmp_path / "p" / "data" / "prediction-1.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["outside the range of the fit"] for row in rows} == {"1"}


def test_another_length_than_that_of_one_muscle_has_no_band_and_says_so(muscle, tmp_path):
    record = predicted(muscle, sweep(), tmp_path, "200 mm")
    assert record["rows_within_the_band"] is None
    notes = " ".join(record["notes"])
    assert "specimen 200 mm was not measured (measured: 300 mm); the band is not known" in notes
    done = airmuscle(
        "predict",
        muscle,
        tmp_path / "run.csv",
        "--resting-length",
        "200 mm",
        "--out",
        tmp_path / "p",
    )
    assert "not known for a specimen that was not measured" in " ".join(done.stdout.split())


def test_the_rate_of_a_quantity_is_that_of_its_motion_and_not_of_its_noise():
    time = np.linspace(0.0, 10.0, 1001)
    rng = np.random.default_rng(0)
    ramp = Recording({"time": time, "pressure": 1e4 * time + rng.normal(0.0, 50.0, 1001)}, "ramp")
    assert rate_of_change(ramp, "pressure") == pytest.approx(1e4, rel=0.2)
    still = Recording({"time": time, "pressure": 3e5 + rng.normal(0.0, 50.0, 1001)}, "held")
    assert rate_of_change(still, "pressure") == 0.0
    assert rate_of_change(Recording({"pressure": time}, "x"), "pressure") == 0.0


@pytest.fixture(scope="module")
def plants(tmp_path_factory) -> Path:
    """A plant fitted to one record and to three, and a further record of it."""
    place = tmp_path_factory.mktemp("dynamic")
    rng = np.random.default_rng(5)
    command = tomllib.loads(STUDY)["input"]
    text = f"[input]\nfill = {command['fill']}\ndischarge = {command['discharge']}\n"
    for name, conductance in (
        ("a", 3e-9),
        ("b", 3.1e-9),
        ("c", 2.9e-9),
        ("later", 3.05e-9),
        ("far", 6e-9),
    ):
        truth = (
            plant_table(HELD, exponent=1.25, conductance=conductance) + run_table("0.2 bar") + text
        )
        (place / "truth.toml").write_text(truth, encoding="utf-8")
        write(
            Recording(noisy_run(place / "truth.toml", rng, {"pressure": 500.0}), name),
            place / f"{name}.csv",
        )
    start = plant_table(HELD, exponent=1.2, conductance=4e-9) + STUDY
    for name, files in (("one", "a"), ("three", "abc")):
        records = "".join(f'[[record]]\nfile = "{each}.csv"\n' for each in files)
        (place / f"{name}.toml").write_text(start + records, encoding="utf-8")
        done = airmuscle("fit-dynamic", place / f"{name}.toml", "--out", place / name)
        assert done.exit_code == 0, done.stderr
    return place


def test_a_plant_of_one_record_states_no_band_for_another(plants, tmp_path):
    done = airmuscle(
        "predict",
        plants / "one" / "scenario.toml",
        plants / "later.csv",
        "--out",
        tmp_path,
        "--json",
    )
    (record,) = json.loads(done.stdout)["prediction"]["predictions"]
    assert record["rows_within_the_band"] is None
    assert record["band"] == "not known from one record"
    said = airmuscle(
        "predict", plants / "one" / "scenario.toml", plants / "later.csv", "--out", tmp_path
    )
    assert "not known from one record" in " ".join(said.stdout.split())


def test_the_band_of_a_plant_of_three_records_is_that_of_the_records_left_out(plants, tmp_path):
    uncertainty = load_scenario(plants / "three" / "scenario-1.toml").uncertainty
    assert uncertainty.records == 3
    assert 3.0 < uncertainty.factors["pressure"] <= 4.31
    done = airmuscle(
        "predict",
        plants / "three" / "scenario-1.toml",
        plants / "later.csv",
        "--out",
        tmp_path,
        "--json",
    )
    (record,) = json.loads(done.stdout)["prediction"]["predictions"]
    assert record["rows_within_the_band"] > 0.9
    assert "errors of 3 records, each predicted by the others" in record["band"]


def test_a_record_of_a_plant_that_is_faster_than_those_of_the_fit_is_named(plants, tmp_path):
    done = airmuscle(
        "predict",
        plants / "three" / "scenario-1.toml",
        plants / "far.csv",
        "--out",
        tmp_path,
        "--json",
    )
    (record,) = json.loads(done.stdout)["prediction"]["predictions"]
    assert "the record is faster than those of the fit: pressure" in record["notes"]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"new_specimen_half_width": -1.0}, "new_specimen_half_width is -1"),
        ({"new_specimen_half_width": float("nan")}, "it must be finite"),
        ({"max_contraction_rate": float("inf")}, "it must be finite"),
        (
            {"max_pressure_rate": -3.0},
            "max_pressure_rate is -3; it must be finite and not negative",
        ),
        ({"specimens": "A"}, "specimens is 'A'; it must be a list"),
        ({"resting_lengths": ["3 bar"]}, "cannot be converted to 'm'"),
        ({"specimen": ["A"]}, "Did you mean 'specimens'"),
    ],
)
def test_a_stated_band_with_a_number_that_is_none_is_refused(table, message):
    with pytest.raises(am.errors.AirmuscleError, match=message):
        PLANT_READER.build(
            {"quantity": "force", "half_width": 5.0, "source": "x", **table},
            Location("m.toml", "", Path()),
            kind=StatedBand,
        )


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("records = 0", "records is 0; it must be an integer of at least 1"),
        ("records = 3\nfactors = { pressure = -1.0 }", "must be greater than zero"),
        ("ranges = { pressure = [1.0] }", "must be a list of minimum and maximum"),
        ("rates = { pressure = nan }", "must be finite"),
    ],
)
def test_an_uncertainty_of_a_plant_with_a_number_that_is_none_is_refused(
    plants, tmp_path, line, message
):
    text = (plants / "truth.toml").read_text(encoding="utf-8")
    (tmp_path / "s.toml").write_text(
        f"{text}\n[uncertainty]\ndeviations = {{ pressure = 500.0 }}\n{line}\n", encoding="utf-8"
    )
    with pytest.raises(ParameterError, match=message):
        load_scenario(tmp_path / "s.toml")


def test_a_band_that_does_not_hold_is_said_with_the_likely_reason(muscle, tmp_path):
    def said(record: Recording) -> str:
        (note,) = [
            note for note in predicted(muscle, record, tmp_path)["notes"] if "does not hold" in note
        ]
        return note

    shifted = said(sweep().with_columns(force=sweep()["force"] - 60.0))
    assert "is 60" in shifted or "is 59" in shifted
    assert (
        "too high on average; nothing recorded explains it; usual are another specimen" in shifted
    )
    far = sweep(top=0.26)
    beyond = far.with_columns(force=far["force"] + np.where(far["contraction"] > 0.201, 40.0, 0.0))
    assert (
        "too low on average; likely because of rows outside the range of the fit (inside it 9"
        in said(beyond)
    )
    fast = sweep(duration=12.0)
    assert "likely because of a faster motion" in said(
        fast.with_columns(force=fast["force"] + 30.0)
    )


def test_a_band_of_another_muscle_that_does_not_hold_names_the_difference():
    law = am.load(LAW).characteristic
    other = sweep().with_columns(force=sweep()["force"] + 40.0)
    prediction = predict_static(law, other, half_width=8.0, differences=("another specimen",))
    assert "likely because of another specimen" in prediction.notes[-1]


def test_a_band_that_holds_is_not_doubted(muscle, tmp_path):
    assert not [
        note
        for note in predicted(muscle, sweep(seed=9), tmp_path)["notes"]
        if "does not hold" in note
    ]
