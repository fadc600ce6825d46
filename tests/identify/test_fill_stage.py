"""The stage of fills of a campaign finds what its own model has simulated, within three standard
errors: with a fill and its discharge in one file, with different critical ratios, and in any
ambient air that the records state. What the records do not show or state is supposed, and said.
"""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from command_line import airmuscle
from widths import widened

from airmuscle import load
from airmuscle.bench import (
    Experiment,
    FillStage,
    InitialConditions,
    RecordKind,
    classify_records,
    fit_dynamic,
    fit_tube,
    stated_ambient,
    write,
)
from airmuscle.bench.campaign import fit_fill_stage, fit_release_stage, stage_result, volume_change
from airmuscle.engine import Rodas4, Schedule, simulate
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    Ambient,
    Braid,
    ClosedChamber,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    Isometric,
    LinearDamper,
    Muscle,
    Plant,
    Polytropic,
    Supply,
    Tank,
    Tube,
    Valve,
    VirtualWork,
    WithLatch,
    WithTubes,
)
from airmuscle.recording import Recording

BRAID = Braid(0.01, math.radians(25), 0.3)
CONTRACTIONS = (0.0, 0.1, 0.2)
NOISE = 150.0
STANDARD = Ambient()
BOTH = {"fill": ((0.5, 1.0), (3.2, 0.0)), "discharge": ((3.2, 1.0),)}
FILL = {"fill": ((0.5, 1.0),)}
DISCHARGE = {"discharge": ((0.5, 1.0),)}


SINKING = Tank(Supply(6e5), Valve(5e-9, 0.3), 4e-4)


def true_plant(contraction, ratio, ambient, supply=Supply(6e5)):
    valves = FillDischarge(supply, Valve(3e-9, 0.35), Valve(3.6e-9, ratio))
    return Plant(Muscle.ideal(BRAID), valves, Isometric(contraction), EnergyBalance(0.4), ambient)


def record(
    contraction,
    command,
    seed,
    *,
    ratio=0.35,
    ambient=STANDARD,
    begin=0.0,
    stated=True,
    duration=6.0,
    supply=Supply(6e5),
):
    plant = true_plant(contraction, ratio, ambient, supply)
    times = np.arange(0.0, duration, 0.008)
    run = simulate(
        plant,
        Schedule(command),
        duration=duration,
        initial_state=plant.state_at(pressure=begin),
        output_times=times,
        integrator=Rodas4(1e-8),
    )
    noise = np.random.default_rng(seed).normal(0.0, NOISE, times.size)
    pressure = np.interp(times, run["time"], run["pressure"])
    columns = {
        "time": times,
        "pressure": pressure + noise,
        "contraction": np.full(times.size, contraction),
    }
    constants = (
        {"ambient": ambient.pressure, "ambient_temperature": ambient.temperature} if stated else {}
    )
    return Recording(
        columns, f"fill {contraction:g} {min(command)}", {"resting_length": 0.3, **constants}
    )


def tube_record(contraction, segments, seed):
    """A fill through a tube, sensed behind the valve."""
    plant = true_plant(contraction, 0.35, STANDARD)
    tube = Tube(Valve(4e-9, 0.0 if segments > 1 else 0.3), 8e-5, segments)
    plant = dataclasses.replace(plant, circuit=WithTubes(plant.circuit, tube))
    times = np.arange(0.0, 3.0, 0.004)
    sensed = f"{tube.prefixes[0]}pressure"
    run = simulate(
        plant,
        Schedule({"fill": ((0.2, 1.0),)}),
        duration=3.0,
        initial_state=plant.state_at(pressure=0.0),
        output_times=times,
        integrator=Rodas4(1e-8),
    )
    pressure = np.interp(times, run["time"], run[sensed]) + np.random.default_rng(seed).normal(
        0.0, NOISE, times.size
    )
    columns = {"time": times, "pressure": pressure, "contraction": np.full(times.size, contraction)}
    constants = {
        "resting_length": 0.3,
        "ambient": STANDARD.pressure,
        "ambient_temperature": STANDARD.temperature,
    }
    return Recording(columns, f"fill {contraction:g}", constants)


def test_the_scenario_of_a_fill_through_a_tube_predicts_the_recorded_pressure(tmp_path):
    """By the commands: the sensor is in the tube, and the records name its pressure `pressure`."""
    files = [
        write(tube_record(c, 1, i), tmp_path / f"fill{i}.csv") for i, c in enumerate(CONTRACTIONS)
    ]
    braid = ("--braid", "radius=10 mm, angle=25 deg", "--resting-length", "300 mm")
    done = airmuscle("campaign", *files, *braid, "--out", tmp_path / "out")
    said = " ".join(done.stdout.split())
    assert "Each fill is predicted from the others within 0.165 kPa" in said, done.output
    assert (tmp_path / "out" / "figures" / "campaign-fills.png").exists()
    scenario = tmp_path / "out" / "scenarios" / "fill0.toml"
    start = ("--start-time", "200 ms", "--start-margin", "20 ms")
    done = airmuscle(
        "predict", scenario, files[0], *start, "--out", tmp_path / "prediction", "--json"
    )
    assert done.exit_code == 0, done.output
    (row,) = json.loads(done.stdout)["prediction"]["predictions"]
    assert row["quantity"] == "tube.pressure"
    assert row["rms_error"] == pytest.approx(NOISE, rel=0.1)
    assert row["rows_within_the_band"] >= 0.9


@pytest.mark.parametrize("segments", widened([1, 3], lambda count: count == 3))
def test_a_tube_between_valves_and_muscle_is_found_with_the_number_of_its_segments(segments):
    stage = stage_of([tube_record(c, segments, i) for i, c in enumerate(CONTRACTIONS)])
    assert stage.fit.plant().circuit.tube.segment_count == segments
    true = {"tube.volume": 8e-5, "tube.orifice.conductance": 4e-9, "circuit.fill.conductance": 3e-9}
    for name, value in true.items():
        estimate = stage.fit[f"circuit.{name}"]
        assert abs(estimate.value - value) < 3.5 * estimate.stderr, estimate
    assert max(stage.cross_rms) == pytest.approx(NOISE, rel=0.15)
    said = "one segment" if segments == 1 else "3 segments"
    assert f"({said} by AICc): its volume of " in stage.verdict


def stage_of(recordings, geometry=BRAID, change=None):
    stage = fit_fill_stage(classify_records(recordings), geometry, change, lambda _: None)
    assert isinstance(stage, FillStage), stage.reason
    return stage


def true_values(ratio=0.35):
    return {
        "gas.heat_transfer": 0.4,
        "circuit.fill.critical_ratio": 0.35,
        "circuit.discharge.critical_ratio": ratio,
        "circuit.fill.conductance": 3e-9,
        "circuit.discharge.conductance": 3.6e-9,
        "circuit.supply.pressure": 6e5,
    }


def assert_true(stage, ratio=0.35):
    for name, true in true_values(ratio).items():
        estimate = stage.fit[name]
        assert abs(estimate.value - true) < 3.0 * estimate.stderr, estimate
    for i in range(len(stage.records)):
        assert stage.fit.rms("pressure", i) == pytest.approx(NOISE, rel=0.15)


@pytest.mark.parametrize("seed", widened(range(5), lambda seed: seed == 0))
def test_a_fill_and_its_discharge_in_one_file(seed):
    stage = stage_of([record(c, BOTH, 10 * seed + i) for i, c in enumerate(CONTRACTIONS)])
    assert_true(stage)
    assert not isinstance(
        stage.fit.plant().circuit, WithTubes
    )  # the muscle alone explains the records
    switch = (
        stage.commands(stage.records[2])["discharge"][0][0]
        + stage.fit["start time of record 3"].value
    )
    assert switch == pytest.approx(3.2, abs=1e-3)
    assert stage.records[2].steps[1].start < 3.196  # what is detected is early


@pytest.mark.parametrize(
    "ambient",
    widened([Ambient(8e4, 303.0), Ambient(9.5e4)], lambda ambient: ambient.pressure < 9e4),
)
def test_the_plants_have_the_ambient_air_of_their_records(ambient):
    stage = stage_of([record(c, BOTH, i, ambient=ambient) for i, c in enumerate(CONTRACTIONS)])
    assert_true(stage)
    assert stage.fit.plant().ambient == ambient


def test_a_fit_of_segments_needs_a_tube():
    with pytest.raises(
        ParameterError, match="fit_tube: the plant has no Tube between valves and muscle"
    ):
        fit_tube(true_plant(0.0, 0.35, STANDARD), lambda plant, sensor: None)


def test_records_in_different_ambient_air():
    airs = (Ambient(8e4), Ambient(9e4, 303.0), STANDARD)
    stage = stage_of(
        [
            record(c, BOTH, i, ambient=a)
            for i, (c, a) in enumerate(zip(CONTRACTIONS, airs, strict=True))
        ]
    )
    assert_true(stage)
    assert [stage.fit.plant(i).ambient for i in range(3)] == list(airs)
    assert "ambient" not in stage.verdict


def test_standard_errors_contain_the_scatter_of_records_from_rooms_of_unstated_temperature(
    monkeypatch,
):
    """The rooms are 3 K warmer than supposed on average: conductances are wrong by many standard
    errors of the rows.
    """
    monkeypatch.setattr(
        "airmuscle.bench.campaign.fill_records.TUBE_STARTS", 1
    )  # for the time of the test
    rooms = (Ambient(temperature=each) for each in (290.15, 296.15, 302.15))
    recordings = [
        record(c, BOTH, i, ambient=room, stated=False)
        for i, (c, room) in enumerate(zip(CONTRACTIONS, rooms, strict=True))
    ]
    fit = stage_of(recordings).fit
    for valve, true in (("fill", 3e-9), ("discharge", 3.6e-9)):
        estimate = fit[f"circuit.{valve}.conductance"]
        assert abs(estimate.value - true) < 2.5 * estimate.stderr
        assert 0.003 * true < estimate.stderr < 0.02 * true
    (said,) = [note for note in fit.notes if "scatter between 3 records" in note]
    assert "circuit.fill.conductance" in said
    assert "temperature of the room" in said


def test_an_ambient_pressure_that_no_record_states_is_said():
    silent = stage_of([record(c, BOTH, i, stated=False) for i, c in enumerate(CONTRACTIONS)])
    assert "No record states the ambient pressure: 101.3 kPa are supposed" in silent.verdict
    some = stage_of([record(c, BOTH, i, stated=i > 0) for i, c in enumerate(CONTRACTIONS)])
    assert "fill 0 discharge does not state the ambient pressure" in some.verdict


def test_fills_and_discharges_in_separate_files_with_different_critical_ratios():
    recordings = [record(c, FILL, i, ratio=0.15) for i, c in enumerate(CONTRACTIONS)]
    recordings += [
        record(c, DISCHARGE, 3 + i, ratio=0.15, begin=6e5) for i, c in enumerate(CONTRACTIONS)
    ]
    assert_true(stage_of(recordings), ratio=0.15)


def test_the_volume_follows_from_fills_also_with_separate_discharges():
    recordings = [record(c, FILL, i) for i, c in enumerate(CONTRACTIONS)]
    recordings += [record(c, DISCHARGE, 3 + i, begin=6e5) for i, c in enumerate(CONTRACTIONS)]
    change = volume_change(VirtualWork(BRAID), 0.3, (1e5, 6e5), (0.0, 0.25))
    estimate = stage_of(recordings, None, change).estimate
    error = abs(estimate.volume_at_rest - float(BRAID.volume(0.0)))
    assert error < 3.0 * estimate.volume_stderr < 0.02 * float(BRAID.volume(0.0))


@pytest.mark.parametrize(
    ("command", "begin", "missing", "shown"),
    [(FILL, 0.0, "discharge", "fill"), (DISCHARGE, 6e5, "fill", "discharge")],
)
def test_a_valve_that_no_record_shows_is_supposed_to_be_the_other(command, begin, missing, shown):
    stage = stage_of([record(c, command, i, begin=begin) for i, c in enumerate(CONTRACTIONS)])
    assert (
        f"No record is a {missing}: the {missing} valve is supposed to be equal to the {shown}"
        " valve" in stage.verdict
    )
    valves = stage.circuit
    assert valves.fill == valves.discharge
    assert valves.fill.conductance == pytest.approx(3e-9 if shown == "fill" else 3.6e-9, rel=0.01)


def test_a_critical_ratio_that_is_not_determined_is_supposed_to_be_the_other():
    """A discharge that ends while its flow is choked does not show the critical ratio."""
    recordings = [record(c, FILL, i) for i, c in enumerate(CONTRACTIONS)]
    recordings.append(record(0.1, BOTH, 9, duration=3.45))
    stage = stage_of(recordings)
    assert (
        "do not determine the critical ratio of the discharge valve (it has no effect on them)"
        in stage.verdict
    )
    assert stage.circuit.fill.critical_ratio == stage.circuit.discharge.critical_ratio


def test_the_release_has_the_ambient_air_of_its_record():
    muscle, ambient, times = load("dmsp-20-300").muscle, Ambient(8e4), np.arange(0.0, 2.0, 0.002)
    damped = dataclasses.replace(muscle, damper=LinearDamper(150.0))
    plant = Plant(damped, ClosedChamber(), WithLatch(HangingMass(15.0)), Polytropic(1.2), ambient)
    run = simulate(
        plant,
        Schedule({"latched": ((0.0, 1.0), (0.4, 0.0))}),
        duration=2.0,
        output_times=times,
        initial_state=plant.state_at(pressure=2.5e5, position=0.012),
        integrator=Rodas4(1e-8),
    )
    random = np.random.default_rng(1)
    pressure, path, force = (
        np.interp(times, run["time"], run[name]) for name in ("pressure", "position", "force")
    )
    path = path + random.normal(0.0, 1e-5, times.size)
    columns = {
        "time": times,
        "pressure": pressure + random.normal(0.0, 100.0, times.size),
        "contraction": path / 0.3,
        "length": 0.3 - path,
        "force": force,
    }
    released = Recording(columns, "release", {"resting_length": 0.3, "mass": 15.0, "ambient": 8e4})
    fit = fit_release_stage(classify_records([released]), damped).fit
    for name, true in (("gas.exponent", 1.2), ("muscle.damper.damping", 150.0)):
        assert abs(fit[name].value - true) < 3.0 * fit[name].stderr


def test_a_stage_of_releases_without_a_record_has_its_own_name():
    left_out = fit_release_stage([], None)
    assert (left_out.name, left_out.reason) == ("release", "no record is a release")


def test_a_record_in_other_ambient_air_than_its_plant_is_refused():
    measured = record(0.1, FILL, 0, ambient=Ambient(8e4))
    plant = true_plant(0.1, 0.35, STANDARD)
    experiment = Experiment(measured, Schedule(FILL), InitialConditions.at_rest(plant, 0.0))
    with pytest.raises(
        ParameterError, match=r"states an ambient pressure of 80 kPa, but its plant has 101\.3 kPa"
    ):
        fit_dynamic(
            plant, [experiment], free=("circuit.fill.conductance",), observed={"pressure": NOISE}
        )
    warm = true_plant(0.1, 0.35, Ambient(8e4, 310.0))
    experiment = Experiment(
        measured, Schedule(FILL), InitialConditions.at_rest(warm, 0.0), plant=warm
    )
    with pytest.raises(
        ParameterError, match=r"an ambient temperature of 293\.1 K, but its plant has 310 K"
    ):
        fit_dynamic(
            warm, [experiment], free=("circuit.fill.conductance",), observed={"pressure": NOISE}
        )


def test_what_a_record_does_not_state_is_that_of_the_default():
    assert stated_ambient(Recording({"time": np.zeros(1)}, "x")) == STANDARD
    warm = Recording({"time": np.zeros(1)}, "x", {"ambient_temperature": 300.0})
    assert stated_ambient(warm, Ambient(9e4)) == Ambient(9e4, 300.0)


def test_a_partial_discharge_is_left_out_by_name_and_the_fill_before_it_is_used():
    partial = {"fill": ((0.5, 1.0), (3.2, 0.0)), "discharge": ((3.2, 1.0), (3.3, 0.0))}
    fill, left_out = classify_records([record(CONTRACTIONS[0], partial, 0)])
    assert (fill.kind, len(fill.steps)) == (RecordKind.FILL, 1)
    assert left_out.kind is RecordKind.UNUSED
    assert "1 of 2 pressure steps at a held length end between" in left_out.reason


def test_a_supply_whose_pressure_sinks_is_found_where_the_records_need_it():
    recordings = [record(c, BOTH, i, supply=SINKING) for i, c in enumerate(CONTRACTIONS[:2])]
    stage = stage_of(recordings)
    true = true_values() | {"circuit.supply.volume": 4e-4, "circuit.supply.feed.conductance": 5e-9}
    true["circuit.supply.supply.pressure"] = true.pop("circuit.supply.pressure")
    for name, value in true.items():
        assert abs(stage.fit[name].value - value) < 3.0 * stage.fit[name].stderr, stage.fit[name]
    assert stage.circuit.supply.volume == stage.fit["circuit.supply.volume"].value
    assert "The supply pressure sinks during a fill: a volume of" in stage.verdict
    assert max(stage.cross_rms) < 1.3 * NOISE


@pytest.mark.slow
def test_the_volume_of_the_muscle_follows_also_where_the_supply_sinks():
    change = volume_change(VirtualWork(BRAID), 0.3, (1e5, 6e5), (0.0, 0.25))
    stage = stage_of(
        [record(c, BOTH, i, supply=SINKING) for i, c in enumerate(CONTRACTIONS)], None, change
    )
    assert (
        abs(stage.estimate.volume_at_rest - float(BRAID.volume(0.0)))
        < 3.0 * stage.estimate.volume_stderr
    )
    assert stage.fit["circuit.supply.volume"].value == pytest.approx(4e-4, rel=0.05)


def test_the_air_of_a_tank_at_rest_follows_its_supply_in_every_iterate():
    """A fit that starts from a wrong volume and a wrong supply pressure finds both, and predicts
    its own record.
    """
    plant = true_plant(0.0, 0.35, STANDARD, Tank(Supply(5.9e5), Valve(5e-9, 0.3), 8e-4))
    experiment = Experiment(
        record(0.0, FILL, 3, supply=SINKING),
        Schedule({"fill": ((0.0, 1.0),)}),
        InitialConditions.at_rest(plant, 0.0),
        0.5,
    )
    assert experiment.initial_conditions.settled == ("supply.air_mass",)
    fit = fit_dynamic(
        plant,
        [experiment],
        free=("circuit.supply.volume", "circuit.supply.supply.pressure"),
        observed={"pressure": NOISE},
    )
    assert (
        abs(fit["circuit.supply.volume"].value - 4e-4)
        < 3.0 * fit["circuit.supply.volume"].stderr
        < 2e-5
    )
    again = Experiment(
        experiment.recording, experiment.command, InitialConditions.at_rest(fit.plant(), 0.0), 0.5
    )
    predicted = fit_dynamic(
        fit.plant(), [again], free=("circuit.fill.critical_ratio",), observed={"pressure": NOISE}
    )
    assert predicted.rms("pressure") == pytest.approx(NOISE, rel=0.1)


def test_records_that_the_model_does_not_follow_are_reported_as_a_misfit(monkeypatch):
    """The valve closes to a third while the muscle fills; the model has one conductance."""
    monkeypatch.setattr(
        "airmuscle.bench.campaign.fill_records.TUBE_STARTS", 1
    )  # for the time of the test
    throttled = {"fill": ((0.5, 1.0), (0.7, 0.3), (3.2, 0.0)), "discharge": ((3.2, 1.0),)}
    stage = stage_of([record(c, throttled, i) for i, c in enumerate(CONTRACTIONS[:2])])
    assert "times the noise of the pressure sensor" in stage.misfit
    assert stage.misfit in stage.verdict
    assert stage.misfit in stage_result(stage)


def test_records_that_the_model_follows_have_no_remark_on_a_misfit():
    assert stage_of([record(c, BOTH, i) for i, c in enumerate(CONTRACTIONS[:2])]).misfit == ""
