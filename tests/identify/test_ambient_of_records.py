"""The ambient air that a record states is that of the plant that describes it: in the records of a
dynamic fit, in the scenarios of a campaign, and in predictions, where a note states that it is not
that of the identification.
"""

from __future__ import annotations

import numpy as np
import pytest
from dynamic_study import plant_table

from airmuscle import load
from airmuscle.bench import Campaign, ColumnMapping, LeftOutStage, RowReader, classify_records, read
from airmuscle.bench.campaign import fit_fill_stage
from airmuscle.engine import Schedule, simulate
from airmuscle.errors import ColumnError, ParameterError, UnitError
from airmuscle.files import load_dynamic_fit, load_plant_model, load_scenario
from airmuscle.files.scenario import campaign_scenarios
from airmuscle.physics import (
    Ambient,
    Braid,
    EnergyBalance,
    FillDischarge,
    Isometric,
    Muscle,
    Plant,
    Supply,
    Valve,
)
from airmuscle.recording import Recording

PLANT = 'title = "rig"' + plant_table(
    'model = "Isometric"\ncontraction = 0.1', exponent=1.2, conductance=3e-9
)
INPUT = '[input]\nfill = [["0.1 s", 1]]\n'
STUDY = (
    INPUT + '[observed]\npressure = "500 Pa"\n[fit]\nfree ='
    ' ["circuit.fill.conductance"]\n[[record]]\nfile = "r.csv"\n'
)
RUN = '[run]\nduration = "1 s"\ninitial_state = { pressure = "0 bar" }\n'
STATED = "# ambient [kPa] = 80\n# Raumtemperatur [°C] = 30\n"


def write(folder, preamble=STATED, heading="pressure [kPa]", offset=0.0):
    rows = [
        f"{t:.2f},{offset + 500 * (1 - np.exp(-max(t - 0.1, 0) / 0.1)):.3f}"
        for t in np.arange(0.0, 1.0, 0.01)
    ]
    path = folder / "r.csv"
    path.write_text("\n".join([preamble + f"time [s],{heading}", *rows]) + "\n", encoding="utf-8")
    return path


def study(folder, text):
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_pressure_and_temperature_are_constants_of_a_file(tmp_path):
    (recording,) = read(write(tmp_path))
    assert (
        recording.constants["ambient"],
        recording.constants["ambient_temperature"],
    ) == pytest.approx((8e4, 303.15))
    (recording,) = read(
        write(tmp_path, ""),
        ColumnMapping(ambient="95 kPa", constants={"ambient_temperature": "25 degC"}),
    )
    assert (
        recording.constants["ambient"],
        recording.constants["ambient_temperature"],
    ) == pytest.approx((9.5e4, 298.15))


@pytest.mark.parametrize("value", ["500 K", "-300 degC", "nan degC"])
def test_an_impossible_temperature_is_refused(value, tmp_path):
    with pytest.raises((ColumnError, ParameterError, UnitError), match="ambient_temperature"):
        read(write(tmp_path, f"# ambient_temperature = {value}\n"))


def test_absolute_pressures_without_an_ambient_pressure_are_converted_with_a_note(tmp_path):
    absolute = {"heading": "pressure [kPa(a)]", "offset": 100.0}
    (recording,) = read(write(tmp_path, "", **absolute))
    assert any("standard atmosphere, 101.3 kPa" in note for note in recording.notes)
    for path in (write(tmp_path, **absolute), write(tmp_path, "")):
        assert not any("standard atmosphere" in note for note in read(path)[0].notes)


def test_a_followed_stream_of_absolute_pressures_says_so_too():
    reader = RowReader("logger")
    for line in ("time [s],pressure [kPa(a)]\n", "0,100\n"):
        reader.read(line)
    assert any("standard atmosphere, 101.3 kPa" in note for note in reader.notes)


def test_the_plant_of_a_dynamic_fit_has_the_ambient_air_of_its_record(tmp_path):
    write(tmp_path)
    setup = load_dynamic_fit(study(tmp_path, PLANT + STUDY))
    assert setup.experiments[0].plant.ambient == Ambient(8e4, 303.15)
    text = setup.scenario(setup.fit())
    (tmp_path / "fitted.toml").write_text(text, encoding="utf-8")
    assert load_scenario(tmp_path / "fitted.toml").plant.ambient == Ambient(8e4, 303.15)


def test_a_dynamic_fit_says_which_ambient_pressure_is_supposed(tmp_path):
    write(tmp_path, "")
    supposed = load_dynamic_fit(study(tmp_path, PLANT + STUDY)).fit()
    assert any(
        note.startswith("No record states the ambient pressure: 101.3 kPa")
        for note in supposed.notes
    )
    stated = PLANT + '[plant.ambient]\nmodel = "Ambient"\npressure = "95 kPa"\n' + STUDY
    assert not any(
        "ambient" in note for note in load_dynamic_fit(study(tmp_path, stated)).fit().notes
    )


def test_another_ambient_pressure_in_the_file_of_the_study_is_refused(tmp_path):
    write(tmp_path)
    setup = load_dynamic_fit(
        study(tmp_path, PLANT + '[plant.ambient]\nmodel = "Ambient"\npressure = "95 kPa"\n' + STUDY)
    )
    with pytest.raises(
        ParameterError, match="states an ambient pressure of 80 kPa, but its plant has 95 kPa"
    ):
        setup.fit()


def test_the_ambient_pressure_of_a_record_may_be_stated_in_the_study(tmp_path):
    write(tmp_path, "")
    setup = load_dynamic_fit(study(tmp_path, PLANT + STUDY + 'ambient = "90 kPa"\n'))
    assert setup.experiments[0].plant.ambient == Ambient(9e4)


def test_a_prediction_has_the_ambient_air_of_its_record_and_says_so(tmp_path):
    model = load_plant_model(
        study(
            tmp_path,
            PLANT + '[plant.ambient]\nmodel = "Ambient"\npressure = "95 kPa"\n' + INPUT + RUN,
        )
    )
    (recording,) = read(write(tmp_path))
    prediction = model.predict_recording(recording)
    note = (
        "the ambient air is that of the record, 80 kPa and 303.1 K; the plant was identified at 95"
        " kPa and 293.1 K"
    )
    assert note in prediction.notes
    silent = model.predict_recording(read(write(tmp_path, ""))[0])
    assert not any("ambient" in note for note in silent.notes)
    assert not np.allclose(
        prediction.quantities[0].predicted, silent.quantities[0].predicted, atol=1e3
    )


def test_the_scenarios_of_a_campaign_have_the_ambient_air_of_their_records(tmp_path, monkeypatch):
    muscle = load("dmsp-20-300").muscle
    ambient = Ambient(8e4, 303.15)
    step = Schedule({"fill": ((0.2, 1.0),)})
    valves = FillDischarge(Supply(5e5), Valve(3e-9, 0.35), Valve(3e-9, 0.35))
    plant = Plant(
        Muscle.ideal(Braid(0.01, 0.44, 0.3)), valves, Isometric(0.1), EnergyBalance(0.4), ambient
    )
    run = simulate(
        plant, step, duration=3.0, initial_state=plant.state_at(pressure=0.0), output_times=0.01
    )
    stated = {
        "resting_length": 0.3,
        "ambient": ambient.pressure,
        "ambient_temperature": ambient.temperature,
    }
    filled = Recording(
        {name: run[name] for name in ("time", "pressure", "contraction")}, "r.csv", stated
    )
    columns = {"time": np.linspace(0.0, 60.0, 200), "pressure": np.full(200, 2e5)}
    columns |= {"contraction": np.linspace(0.0, 0.1, 200), "force": np.linspace(500.0, 100.0, 200)}
    slow = Recording(columns, "slow.csv", {"resting_length": 0.3, "ambient": 9e4})
    records = classify_records([filled, slow])
    stage = fit_fill_stage(records[:1], muscle.geometry, None, lambda _: None)
    left_out = LeftOutStage("x", "", "")
    campaign = Campaign(records, left_out, left_out, left_out, stage, left_out, ())
    monkeypatch.setattr(Campaign, "muscle", lambda *_: muscle)
    for scenario, ambient in zip(
        campaign_scenarios(campaign), (Ambient(8e4, 303.15), Ambient(9e4)), strict=True
    ):
        (tmp_path / scenario.name).write_text(scenario.text, encoding="utf-8")
        assert load_scenario(tmp_path / scenario.name).plant.ambient == ambient
