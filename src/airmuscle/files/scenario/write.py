"""Writing of scenarios that `load_scenario` reads back: of a scenario, and of each record of a
campaign.
"""

import dataclasses
import re
import tomllib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...bench.campaign import Campaign, CampaignRecord, FillStage, RecordKind, ReleaseStage
from ...bench.dynamics import stated_ambient
from ...bench.inspection import CONTRACTION_BAND, running_median
from ...core import AirmuscleError, Array, ParameterError, tree
from ...engine.loop import ControlLoop, InputSignal, Periodic, SampledSignal, Schedule, WithDrivers
from ...engine.loop.sampled_signal import ACCELERATION, spline_trajectory
from ...physics import (
    Isometric,
    Muscle,
    Plant,
    PrescribedMotion,
    ProportionalRegulator,
    SecondOrderLag,
    Supply,
    Valve,
)
from ...recording import Recording
from ..library import Location, model_table, scenario_toml, tables_toml, write_text
from .plant_uncertainty import COVARIANCE_KEYS, SEPARATOR, fit_uncertainty
from .scenario import Scenario, build_scenario

POINTS = 120
"""Number of points of the pressure and of the motion of a slow record (chosen)."""
MEDIAN_ROWS = 5
"""Width of the moving median of the recorded motion, in rows (chosen)."""
REGULATOR = ProportionalRegulator(
    Supply(1e6), Valve(2e-7, 0.3), Valve(2e-7, 0.3), SecondOrderLag(20.0), 2e3
)
"""Regulator that follows the recorded pressure of a slow record; all its values are chosen."""
MARGIN = 2e5
"""Pressure of the supply above the highest recorded pressure [Pa] (chosen)."""

IDEAL = "Its tension is that of the volume by virtual work, because no force was measured."
"""Note of the scenario of a fill without a static law: the pressure at a held length does not
depend on the tension.
"""


class RecordScenario(NamedTuple):
    """The scenario of a record: its file name, its text, and the reason where there is none."""

    record: str
    name: str
    text: str
    reason: str = ""


def campaign_scenarios(campaign: Campaign) -> tuple[RecordScenario, ...]:
    """The scenario of each record, or the reason why it has none; names are those of the files."""
    names = Counter[str]()
    scenarios = []
    for record in campaign.records:
        stem = (
            re.sub(r"[^\w-]+", "-", record.origin.rpartition(".")[0] or record.origin)
            .strip("-")
            .lower()
        )
        names[stem] += 1
        unique = stem if names[stem] == 1 else f"{stem}-{names[stem]}"
        scenarios.append(
            RecordScenario(record.origin, f"{unique}.toml", *_text_or_reason(campaign, record))
        )
    return tuple(scenarios)


def _text_or_reason(campaign: Campaign, record: CampaignRecord) -> tuple[str, str]:
    """The text of the scenario of a record, and the reason where there is none."""
    muscle = campaign.muscle(record.resting_length)
    geometry = campaign.geometry(record.resting_length)
    if muscle is None and record.kind is RecordKind.FILL and geometry is not None:
        muscle = Muscle.ideal(geometry)
    if record.kind is RecordKind.UNUSED:
        return "", record.reason
    if muscle is None:
        return "", (
            "the muscle has no static law"
            if geometry is not None
            else "the muscle has no enclosed volume"
        )
    if "time" not in record.recording:
        return "", "the record has no time"
    try:
        if record.kind is RecordKind.FILL:
            return _fill(campaign, record, muscle)
        return (
            _release(campaign, record, muscle)
            if record.kind is RecordKind.RELEASE
            else (_slow(record, muscle), "")
        )
    except AirmuscleError as error:
        return "", str(error.message)


def _note(record: CampaignRecord, start: float) -> str:
    return (
        f"Reproduces {record.origin} ({record.kind.value}); time 0 is at {start:.6g} s of the"
        " record."
    )


def _fill(campaign: Campaign, record: CampaignRecord, muscle: Muscle) -> tuple[str, str]:
    stage = campaign.fills
    if not isinstance(stage, FillStage) or record not in stage.records:
        return "", "the fills of this muscle were not fitted"
    plant, known, start = _fitted_record(stage, record, muscle)
    ideal = "" if campaign.law() is not None else f" {IDEAL}"
    points = {
        name: [list(point) for point in rows] for name, rows in stage.commands(record).items()
    }
    run = {
        "duration": float(record.recording["time"][-1]) - start,
        "initial_state": {"pressure": known["pressure"]},
    }
    sensor = stage.fit.problem.record_models[0].names[0]
    table = fit_uncertainty(stage.fit, [{sensor: error} for error in stage.cross_rms])
    fitted: dict[str, Any] = {"uncertainty": _known_in(table, plant)}
    if sensor != "pressure":  # the sensor is in a tube
        fitted["observed"] = {sensor: {"deviation": stage.fit.rms(sensor), "column": "pressure"}}
    return (
        scenario_toml(record.origin, plant, points, run, f"{_note(record, start)}{ideal}", fitted),
        "",
    )


def _release(campaign: Campaign, record: CampaignRecord, muscle: Muscle) -> tuple[str, str]:
    stage = campaign.release
    if not isinstance(stage, ReleaseStage) or record not in stage.records:
        return "", "the release of this muscle was not fitted"
    plant, known, start = _fitted_record(stage, record, muscle)
    state = {name: known[name] for name in ("pressure", "position", "speed")}
    run = {"duration": float(record.recording["time"][-1]) - start, "initial_state": state}
    fitted = {"uncertainty": _known_in(fit_uncertainty(stage.fit), plant)}
    return (
        scenario_toml(
            record.origin, plant, {"latched": [[0.0, 0.0]]}, run, _note(record, start), fitted
        ),
        "",
    )


def _known_in(table: dict[str, Any], plant: Plant) -> dict[str, Any]:
    """The table without the covariance if the plant lacks one of its parameters."""
    paths = {leaf.path for leaf in tree.leaves(plant)}
    named = {path for name in table.get("parameters", ()) for path in name.split(SEPARATOR)}
    return (
        table
        if named <= paths
        else {key: value for key, value in table.items() if key not in COVARIANCE_KEYS}
    )


def _fitted_record(
    stage: FillStage | ReleaseStage, record: CampaignRecord, muscle: Muscle
) -> tuple[Plant, Mapping[str, float], float]:
    """The plant of a fitted record with the whole muscle, its initial conditions and its start [s]
    in the record.
    """
    number = stage.records.index(record)
    fitted = stage.fit.plant(number)
    assert isinstance(fitted, Plant)
    plant = dataclasses.replace(fitted, muscle=muscle)
    model = stage.fit.problem.record_models[number]
    return plant, model.experiment.initial_conditions.known, model.start_time(stage.fit.values)


def _slow(record: CampaignRecord, muscle: Muscle) -> str:
    """A slow record: a regulator follows the recorded pressure, and a drive the recorded motion."""
    recording = record.recording
    start = float(recording["time"][0])
    length = muscle.geometry.resting_length
    time, pressure, path = _points(recording, float(length))
    setpoint = np.maximum(pressure, 0.0)
    levels = np.column_stack([time, setpoint]).tolist()
    table: dict[str, Any] = {"model": "SampledSignal", "setpoint": levels}
    initial: dict[str, float] = {"pressure": float(pressure[0])}
    mechanism: Any = Isometric(float(np.median(path)) / length)
    # else the motion is noise of the sensor about one contraction
    if float(np.ptp(path)) > CONTRACTION_BAND * length:
        motion = spline_trajectory(time, path)
        points = motion.input.points[ACCELERATION]
        table[ACCELERATION] = [list(point) for point in points]
        initial |= motion.initial_state
        mechanism = PrescribedMotion()
    supply = float(pressure.max()) + MARGIN
    limit = max(REGULATOR.max_setpoint, supply)
    regulator = dataclasses.replace(REGULATOR, supply=Supply(supply), max_setpoint=limit)
    plant = Plant(muscle, regulator, mechanism, ambient=stated_ambient(recording))
    run: Mapping[str, Any] = {"duration": float(time[-1]), "initial_state": initial}
    return scenario_toml(record.origin, plant, table, run, _note(record, start))


class SlowPoints(NamedTuple):
    """Points (N,) of a slow record: time from the start [s], pressure [Pa], displacement [m]."""

    time: Array
    pressure: Array
    path: Array


def _points(recording: Recording, length: float) -> SlowPoints:
    """Points that are dense where the muscle moves: half of them at equal times, half at equal
    distances along the path.
    """
    time = recording["time"] - recording["time"][0]
    path = running_median(recording["contraction"] * length, MEDIAN_ROWS)
    pressure = running_median(recording["pressure"], MEDIAN_ROWS)
    coarse = slice(None, None, max(1, path.size // 400))
    steps = np.abs(np.diff(path[coarse]))
    travelled = np.append(0.0, np.cumsum(steps))
    distances = np.linspace(0.0, travelled[-1], POINTS // 2)
    by_path = np.interp(distances, travelled, time[coarse])
    by_time = np.linspace(0.0, time[-1], POINTS // 2)
    first, *between, last = np.unique(np.concatenate([by_time, by_path])).tolist()
    spaced = [first]
    distance = float(time[-1]) / (8 * POINTS)
    for instant in between:  # without those that follow another one too closely
        if instant - spaced[-1] >= distance and last - instant >= distance:
            spaced.append(instant)
    instants = np.array([*spaced, last])
    return SlowPoints(
        instants,
        np.interp(instants, time, pressure),
        np.interp(instants, time, path),
    )


def scenario_text(scenario: Scenario) -> str:
    """The text of the file of a scenario: the plant, the input or the control loop, and the run, in
    SI units.

    All parameters are written with all digits and the initial state by all states of the plant, so
    that the text is read back as an equal scenario. Raises ParameterError for a controller that is
    no ControlLaw, an input signal that has no form in a file, or a plant, an integrator or a law
    that no file describes.
    """
    tables = _tables(scenario)
    text = tables_toml(tables)
    if _tables(build_scenario(tomllib.loads(text), Location(scenario.title, "", Path()))) != tables:
        raise ParameterError(
            f"scenario '{scenario.title}': a file does not describe it all; write a Python program."
        )
    return text


def save_scenario(scenario: Scenario, path: str | Path) -> Path:
    """Write a scenario to a file that `load_scenario` reads. Raises FileError, ParameterError as
    `scenario_text`.
    """
    return write_text(Path(path), scenario_text(scenario))


def _tables(scenario: Scenario) -> dict[str, Any]:
    """The tables of a scenario, whose values may be models."""
    problem = scenario.problem
    if problem.control_state is not None or not isinstance(
        problem.output_times, float | int | None
    ):
        raise ParameterError(
            f"scenario '{scenario.title}': a file does not describe a continued run, or output"
            " times that are not equidistant; write it as a program in Python."
        )
    run: dict[str, Any] = {
        "duration": problem.duration,
        "start_time": problem.start_time,
        "output_times": problem.output_times,
        "initial_state": dict(scenario.initial_state),
        "integrator": problem.integrator,
    }
    signal = problem.input
    return {
        "title": scenario.title,
        "plant": {
            key: value for key, value in model_table(scenario.plant).items() if key != "model"
        },
        "input": (
            _loop_table(signal, scenario.plant)
            if isinstance(signal, ControlLoop)
            else _signal_table(signal)
        ),
        "run": {key: value for key, value in run.items() if value is not None},
        **({"output": {"columns": list(scenario.columns)}} if scenario.columns else {}),
    }


def _loop_table(loop: ControlLoop, plant: Plant) -> dict[str, Any]:
    """The table [input] of a control loop; a controller that contains the plant has it from
    [plant].
    """
    if not getattr(loop.controller, "from_file", False):
        raise ParameterError(
            f"scenario: {type(loop.controller).__name__} has no form in a file; write the loop as a"
            " program in Python."
        )
    controller = {
        **{name: value for name, value in model_table(loop.controller).items() if value != plant},
        "sample_time": loop.sample_time,
        "setpoint": _signal_table(loop.setpoint),
    }
    drivers = {"drivers": _drivers(loop.drivers)} if loop.drivers else {}
    return {**_signal_table(loop.other_inputs), "controller": controller, **drivers}


def _signal_table(signal: InputSignal) -> dict[str, Any]:
    """The table of an input signal. Raises ParameterError for one without a form in a file."""
    if isinstance(signal, WithDrivers) and not isinstance(signal.inner, WithDrivers):
        return {**_signal_table(signal.inner), "drivers": _drivers(signal.drivers)}
    if isinstance(signal, Periodic) and isinstance(signal.inner, Schedule | SampledSignal):
        return {**_signal_table(signal.inner), "period": signal.period}
    if isinstance(signal, Schedule):
        return _rows(signal.changes)
    if isinstance(signal, SampledSignal):
        return {"model": "SampledSignal", **_rows(signal.points)}
    raise ParameterError(
        f"scenario: the input signal {type(signal).__name__} has no form in a file; use Schedule,"
        " SampledSignal, Periodic or WithDrivers."
    )


def _drivers(drivers: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: list(chain) if isinstance(chain, tuple) else chain for name, chain in drivers.items()
    }


def _rows(signals: Mapping[str, Any]) -> dict[str, Any]:
    return {name: [[float(t), float(v)] for t, v in points] for name, points in signals.items()}
