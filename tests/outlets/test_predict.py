"""A model predicts records that it was not fitted to: `airmuscle predict` states the errors, and
the share of rows within the band that the model states; what a record lacks or a model cannot
predict is named.
"""

from __future__ import annotations

import dataclasses
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from dynamic_study import HELD, noisy_run, plant_table, run_table
from dynamic_study import STUDY as STUDY_OF_VALVES

import airmuscle as am
from airmuscle.bench import (
    Experiment,
    InitialConditions,
    PlantUncertainty,
    StartTime,
    predict_dynamic,
    predict_static,
    write,
)
from airmuscle.core import leaves, with_parameters
from airmuscle.engine import Rodas4
from airmuscle.errors import ColumnError, IdentificationError, ParameterError
from airmuscle.files import load_scenario
from airmuscle.files.library import StatedBand, predict_with_entry
from airmuscle.physics import Dahl
from airmuscle.recording import Recording

NOISE = 4.0
"""Standard deviation of the measured force [N]."""
STUDY = STUDY_OF_VALVES + 'start_time = "50 ms"\n'
RECORD = '[[record]]\nfile = "{}"\ninitial_state = {{ pressure = "0.2 bar" }}\n'
TRUE = {"exponent": 1.25, "conductance": 3e-9}
LATER_INPUT = (
    '[input]\nfill = [["0.2 s", 1], ["0.5 s", 0], ["0.8 s", 1]]\ndischarge = [["1.5 s", 1]]\n'
)


def sweep(pressure: float, seed: int, rows: int = 300, top: float = 0.2) -> Recording:
    """A triangle of the length at constant pressure, of a muscle of the library with noise."""
    law = am.load("chou-hannaford").characteristic
    contraction = np.interp(np.linspace(0.0, 2.0, rows), [0.0, 1.0, 2.0], [0.02, top, 0.02])
    force = law.force(np.full(rows, pressure), contraction) + np.random.default_rng(seed).normal(
        0.0, NOISE, rows
    )
    columns = {
        "time": np.linspace(0.0, 60.0, rows),
        "pressure": np.full(rows, pressure),
        "force": force,
    }
    return Recording(
        {**columns, "contraction": contraction}, f"{pressure:g}", {"resting_length": 0.3}
    )


@pytest.fixture(scope="module")
def muscle(tmp_path_factory) -> Path:
    """A muscle fitted to three isobars, with its stated band."""
    folder = tmp_path_factory.mktemp("static")
    for bar in (2.0, 3.5, 5.0):
        write(sweep(bar * 1e5, int(bar)), folder / f"isobar{bar:g}.csv")
    files = sorted(folder.glob("*.csv"))
    options = ("--characteristic", "chou-hannaford", "--resting-length", "300 mm")
    done = airmuscle("fit", *files, *options, "--out", folder / "fit")
    assert done.exit_code == 0, done.stderr
    return folder / "fit" / "muscle.toml"


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    """The folder of a plant fitted to two fills, and of two later ones: with another input, and of
    another supply.
    """
    place = tmp_path_factory.mktemp("dynamic")
    rng = np.random.default_rng(5)
    run_of_2_s = run_table("0.2 bar")
    truth = tomllib.loads(STUDY)["input"]
    plant = plant_table(HELD, **TRUE)
    text = (
        plant + run_of_2_s + f"[input]\nfill = {truth['fill']}\ndischarge = {truth['discharge']}\n"
    )
    later = plant + run_of_2_s + LATER_INPUT
    other = plant_table(HELD, **TRUE, supply=5.6) + run_of_2_s + LATER_INPUT
    for name, scenario, shift in (
        ("run1", text, 0.01),
        ("run2", text, 0.0),
        ("later", later, 0.02),
        ("again", text, 0.03),
        ("other", other, 0.0),
    ):
        (place / "truth.toml").write_text(scenario, encoding="utf-8")
        run = noisy_run(place / "truth.toml", rng, {"pressure": 500.0})
        write(Recording({**run, "time": run["time"] + shift}, name), place / f"{name}.csv")
    start = plant_table(HELD, exponent=1.1, conductance=4e-9)
    (place / "study.toml").write_text(
        start + STUDY + RECORD.format("run1.csv") + RECORD.format("run2.csv"), encoding="utf-8"
    )
    done = airmuscle("fit-dynamic", place / "study.toml", "--out", place / "fit")
    assert done.exit_code == 0, done.stderr
    return place


def test_a_fitted_muscle_predicts_another_run_within_its_stated_band(muscle, tmp_path):
    write(sweep(4e5, 9), tmp_path / "later.csv")
    done = airmuscle(
        "predict",
        muscle,
        tmp_path / "later.csv",
        "--resting-length",
        "300 mm",
        "--out",
        tmp_path / "p",
        "--json",
    )
    assert done.exit_code == 0, done.stderr
    (record,) = json.loads(done.stdout)["prediction"]["predictions"]
    assert (record["quantity"], record["unit"], record["rows"]) == ("force", "N", 300)
    assert record["rms_error"] == pytest.approx(NOISE, rel=0.15)
    assert 0.92 <= record["rows_within_the_band"] <= 0.98
    page = (tmp_path / "p" / "report.html").read_text(encoding="utf-8")
    assert "later.csv" in page
    assert (tmp_path / "p" / "figures" / "prediction-1.png").exists()
    assert (tmp_path / "p" / "data" / "prediction-1.csv").read_text(encoding="utf-8").count(
        "\n"
    ) == 301


def test_the_band_of_a_fitted_muscle_is_in_its_file_with_its_source(muscle):
    band = am.load(muscle).error_band
    assert band.quantity == "force"
    assert band.half_width == pytest.approx(1.96 * NOISE, rel=0.1)
    assert "900 rows of the fit" in band.source


def test_rows_outside_the_range_of_the_law_are_counted(muscle):
    prediction = predict_with_entry(am.load(muscle), sweep(4e5, 9, top=0.23))
    assert "rows are outside the range of the measurements" in " ".join(prediction.notes)
    assert not predict_with_entry(am.load(muscle), sweep(4e5, 9)).notes


def test_a_muscle_without_a_band_gives_errors_and_no_share(tmp_path):
    write(sweep(3e5, 1), tmp_path / "run.csv")
    done = airmuscle(
        "predict",
        "dmsp-20-300",
        tmp_path / "run.csv",
        "--resting-length",
        "300 mm",
        "--out",
        tmp_path / "p",
    )
    assert done.exit_code == 0, done.stderr
    assert "the model states no band" in done.stdout
    assert "run.csv" in done.stdout


def test_friction_is_subtracted_along_the_motion():
    law = am.load("dmsp-20-300").characteristic
    run = sweep(3e5, 1, top=0.12)
    still = predict_static(law, run).quantities[0].predicted
    moving = (
        predict_static(law, run, friction=Dahl(stiffness=1e5, coulomb_force=20.0))
        .quantities[0]
        .predicted
    )
    np.testing.assert_allclose((still - moving)[50:140], 20.0, atol=0.1)
    np.testing.assert_allclose((still - moving)[200:290], -20.0, atol=0.1)


def test_a_law_is_scaled_to_the_resting_length_of_the_record_with_a_note():
    entry = am.load("dmsp-20-300")
    run = sweep(3e5, 1)
    moved = Recording(run.columns, "short", {"resting_length": 0.2})
    assert "scaled from 300 mm to 200 mm" in " ".join(predict_with_entry(entry, moved).notes)


def test_a_length_without_a_resting_length_is_that_of_the_muscle_or_refused():
    entry = am.load("dmsp-20-300")
    run = sweep(3e5, 1)
    columns = {
        **{name: run[name] for name in ("time", "pressure", "force")},
        "length": run["length"],
    }
    (note,) = predict_with_entry(entry, Recording(columns, "own", {})).notes
    assert (
        note
        == "the record states no resting length; with that of the muscle, 300 mm, its contraction"
        " is 2 to 19.94 %"
    )
    longer = Recording({**columns, "length": 1.7 * columns["length"]}, "longer", {})
    with pytest.raises(
        ColumnError,
        match=r"its contraction is -66.6 to -36.1 %, which is impossible.*resting_length=",
    ):
        predict_with_entry(entry, longer)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"force": None}, "missing is force"),
        ({"contraction": None}, "missing is contraction"),
        ({"force": np.full(300, -1.0)}, "the force is -1 N in every row"),
        ({"force": np.full(300, np.nan)}, "no row has a force"),
    ],
)
def test_a_record_that_cannot_be_compared_is_refused(columns, message):
    run = sweep(3e5, 1)
    kept = {
        name: values for name, values in {**run.columns, **columns}.items() if values is not None
    }
    with pytest.raises((ColumnError, IdentificationError), match=message):
        predict_static(am.load("dmsp-20-300").characteristic, Recording(kept, "run", run.constants))


def test_a_fitted_plant_states_its_residuals_and_covariance_and_a_simulation_ignores_them(study):
    scenario = load_scenario(study / "fit" / "scenario-1.toml")
    assert scenario.uncertainty.deviations["pressure"] == pytest.approx(500.0, rel=0.1)
    assert scenario.uncertainty.parameters[0] == (
        "circuit.fill.conductance",
        "circuit.discharge.conductance",
    )
    assert scenario.uncertainty.covariance.shape == (2, 2)


def test_a_fitted_plant_predicts_a_later_run_of_the_same_input_with_its_own_start(study, tmp_path):
    done = airmuscle(
        "predict",
        study / "fit" / "scenario-1.toml",
        study / "again.csv",
        "--start-margin",
        "50 ms",
        "--out",
        tmp_path / "p",
        "--json",
    )
    assert done.exit_code == 0, done.stderr
    (record,) = json.loads(done.stdout)["prediction"]["predictions"]
    assert record["rms_error"] == pytest.approx(500.0, rel=0.15)
    assert 0.91 <= record["rows_within_the_band"] <= 0.99
    assert "start time 0.0" in record["notes"]


def test_a_file_of_records_predicts_a_run_with_another_input(study, tmp_path):
    table = LATER_INPUT + '[fit]\nstart_time = "50 ms"\n' + RECORD.format("later.csv")
    (study / "later.toml").write_text(table, encoding="utf-8")
    done = airmuscle(
        "predict",
        study / "fit" / "scenario-1.toml",
        study / "later.toml",
        "--out",
        tmp_path / "p",
        "--json",
    )
    assert done.exit_code == 0, done.stderr
    (record,) = json.loads(done.stdout)["prediction"]["predictions"]
    assert 0.91 <= record["rows_within_the_band"] <= 0.99


def test_a_parameter_that_differs_in_the_record_is_seen_and_can_be_estimated_from_it(
    study, tmp_path
):
    (study / "other.toml").write_text(LATER_INPUT + RECORD.format("other.csv"), encoding="utf-8")
    out = ("--out", tmp_path / "p", "--json")
    plain = airmuscle("predict", study / "fit" / "scenario-1.toml", study / "other.toml", *out)
    (record,) = json.loads(plain.stdout)["prediction"]["predictions"]
    assert record["rows_within_the_band"] < 0.6
    own = '[fit]\nown = ["circuit.supply.pressure"]\n'
    (study / "other.toml").write_text(
        own + LATER_INPUT + RECORD.format("other.csv"), encoding="utf-8"
    )
    told = airmuscle("predict", study / "fit" / "scenario-1.toml", study / "other.toml", *out)
    (record,) = json.loads(told.stdout)["prediction"]["predictions"]
    assert record["rows_within_the_band"] > 0.9
    assert "circuit.supply.pressure 5.6" in record["notes"]


def test_the_band_of_a_plant_grows_with_the_sensitivity_to_its_parameters(study):
    scenario = load_scenario(study / "fit" / "scenario-1.toml")
    run = am.bench.read(study / "again.csv")[0]
    experiment = Experiment(
        run, scenario.problem.input, InitialConditions.at_rest(scenario.plant, 2e4), 0.03
    )
    exact = Rodas4(rtol=1e-9)
    wide = PlantUncertainty({"pressure": 500.0}, ("gas.exponent",), np.array([[0.05**2]]))
    narrow, broad = (
        predict_dynamic(
            scenario.plant, experiment, {"pressure": 500.0}, uncertainty=each, method=exact
        ).quantities[0]
        for each in (PlantUncertainty({"pressure": 500.0}), wide)
    )
    np.testing.assert_allclose(narrow.half_width, 1.96 * 500.0, rtol=1e-4)
    moved = []
    for step in (1e-4, -1e-4):
        values = [
            leaf.value + step * (leaf.path == "gas.exponent") for leaf in leaves(scenario.plant)
        ]
        changed = with_parameters(scenario.plant, values)
        prediction = predict_dynamic(changed, experiment, {"pressure": 500.0}, method=exact)
        moved.append(prediction.quantities[0].predicted)
    slope = (moved[0] - moved[1]) / 2e-4
    np.testing.assert_allclose(broad.half_width, 1.95996 * np.hypot(500.0, 0.05 * slope), rtol=2e-3)


def test_the_start_time_of_a_prediction_is_estimated_where_it_is_unknown(study):
    scenario = load_scenario(study / "fit" / "scenario-1.toml")
    run = am.bench.read(study / "again.csv")[0]
    experiment = Experiment(
        run, scenario.problem.input, InitialConditions.at_rest(scenario.plant, 2e4), 0.0
    )
    late = predict_dynamic(scenario.plant, experiment, {"pressure": 500.0})
    found = predict_dynamic(scenario.plant, experiment, {"pressure": 500.0}, own=(StartTime(0.05),))
    assert found.quantities[0].rms < 0.5 * late.quantities[0].rms
    empty = dataclasses.replace(experiment, recording=run.rows(slice(0, 0)))
    with pytest.raises(IdentificationError, match="the record has no rows"):
        predict_dynamic(scenario.plant, empty, {"pressure": 0.0}, own=(StartTime(0.05),))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("dmsp-20-300", "x.csv", "--own", "gas.exponent"), "--own is for a scenario"),
        (("dmsp-20-300", "x.toml"), "a file of records is for a scenario"),
        (("nothing", "x.csv"), "nothing"),
    ],
)
def test_a_model_that_does_not_fit_the_options_is_refused(words, message, tmp_path):
    done = airmuscle("predict", *words, "--out", tmp_path / "p")
    assert done.exit_code in (1, 2)
    assert message in " ".join(done.stderr.split())
    assert not (tmp_path / "p").exists()


def test_a_record_without_a_quantity_of_the_plant_is_refused(study, tmp_path):
    write(Recording({"time": np.arange(5.0), "force": np.arange(5.0)}, "x"), tmp_path / "x.csv")
    done = airmuscle(
        "predict", study / "fit" / "scenario-1.toml", tmp_path / "x.csv", "--out", tmp_path / "p"
    )
    assert done.exit_code == 1
    assert "no column can be predicted; the plant gives pressure" in done.stderr


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("uncertainty = 3", "must be a table. Write its values in it: deviations"),
        (
            "[uncertainty]\nparameters = []",
            "deviations. is missing: standard deviation of the residuals",
        ),
        ("[uncertainty]\ndeviations = { pressure = -1 }", "must be greater than zero"),
        (
            (
                '[uncertainty]\ndeviations = { pressure = "1 kPa" }\nparameters ='
                ' ["gas.x"]\nstandard_errors = [1.0]\ncorrelations = [[1.0]]'
            ),
            "the plant has no parameter 'gas.x'",
        ),
    ],
)
def test_an_uncertainty_of_a_plant_that_is_none_names_its_table(study, tmp_path, table, message):
    text = (study / "truth.toml").read_text(encoding="utf-8")
    (tmp_path / "s.toml").write_text(
        f"{table}\n{text}" if "=" in table[:14] else f"{text}\n{table}\n", encoding="utf-8"
    )
    with pytest.raises(ParameterError, match=message):
        load_scenario(tmp_path / "s.toml")


def test_a_record_at_a_held_length_has_the_band_of_isometric_runs(muscle):
    entry = am.load(muscle)
    entry = dataclasses.replace(
        entry, error_band=dataclasses.replace(entry.error_band, held_half_width=20.0)
    )
    swept = predict_with_entry(entry, sweep(4e5, 9)).quantities[0]
    held = predict_with_entry(entry, sweep(4e5, 9, top=0.022)).quantities[0]
    assert set(held.half_width) == {20.0}
    assert set(swept.half_width) == {entry.error_band.half_width}


@pytest.mark.parametrize(
    ("name", "width", "message"),
    [
        ("mass", 1.0, "allowed are force"),
        ("force", 0.0, "positive"),
        ("force", float("nan"), "finite"),
    ],
)
def test_a_band_that_is_none_is_refused(name, width, message):
    with pytest.raises(ParameterError, match=message):
        StatedBand(name, width, "")
