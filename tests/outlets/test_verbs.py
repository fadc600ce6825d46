"""Every public function that is given what it cannot use ends in an error of airmuscle's own, never
in one of Python.

One argument of a call that succeeds is replaced by junk. A function of a room says which argument
does not conform to its annotation where the call fails (core/annotation.py); numbers that it cannot
use are checked by the function.
"""

from __future__ import annotations

import contextlib
import functools
import math
import pickle
import random
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from plants import EXAMPLES

import airmuscle as am
from airmuscle import (
    bench,
    characteristic,
    control,
    design,
    engine,
    files,
    outlets,
    physics,
    recording,
    units,
)
from airmuscle.errors import (
    AirmuscleError,
    ColumnError,
    FileError,
    IdentificationError,
    ParameterError,
    UnitError,
)

JUNK: tuple[Any, ...] = (
    None,
    "abc",
    "",
    "3 furlongs",
    "1 bar",
    math.nan,
    math.inf,
    -1,
    -1.0,
    0,
    3,
    10**400,
    [],
    (),
    {},
    object(),
    True,
    int,
    ("a", None),
    [None],
    [math.nan],
    [[1.0], 2],
    b"1",
    1j,
    lambda: 0,
    "9" * 100_000,
    np.array("x"),
    np.ones((2, 2)),
    {"a": {"b": 1}},
    {"pressure": "x"},
    {"pressure": math.nan},
    {1: 2},
    Path("/nowhere/x"),
    "\0",
    ((object(),),),
)
RUN = recording.Recording({"time": np.arange(5.0), "pressure": np.linspace(1e5, 2e5, 5)}, "table")
PRESSURE, CONTRACTION = np.meshgrid(np.linspace(1e5, 5e5, 5), np.linspace(0.0, 0.2, 8))
TABLE = recording.Recording(
    {
        name: values.ravel()
        for name, values in zip(
            ("pressure", "contraction", "force"),
            (PRESSURE, CONTRACTION, 2e-3 * PRESSURE * (0.25 - CONTRACTION)),
            strict=True,
        )
    },
    "table",
    {"resting_length": 0.3},
)
Verb = tuple[Callable[..., Any], Mapping[str, Any]]


@functools.cache
def verbs(folder: Path) -> Mapping[str, Verb]:
    """Calls of public functions that succeed within some milliseconds, by name."""
    entry = am.load("dmsp-20-300")
    law = characteristic.ContractileSurface.blank(1, max_force=1e4)
    time = np.linspace(0.0, 20.0, 401)
    swing = 0.1 - 0.1 * np.cos(0.2 * np.pi * time)
    force = 600.0 - 2500.0 * swing + 20.0 * np.sign(np.gradient(swing))
    ramp = recording.Recording(
        {"time": time, "pressure": np.full_like(time, 3e5), "contraction": swing, "force": force},
        "ramp",
        {"resting_length": 0.3},
    )
    fit = am.fit(law, TABLE)
    plant = EXAMPLES["surface"]
    state = plant.state_at(pressure=1e5)
    schedule = engine.Schedule({"fill": ((0.0, 1.0),)})
    sensors = bench.estimate_sensors(ramp)
    model = design.FirstOrderDeadTime(1.0, 1.0, 0.1)
    area = characteristic.ValidityRange(1e5, 5e5, 0.0, 0.2)
    experiment = bench.Experiment(
        am.simulate(plant, schedule, duration=0.2, initial_state=state),
        schedule,
        bench.InitialConditions.at_rest(plant, 1e5),
    )
    valve = physics.Valve(2.6e-9, 0.433)
    found: dict[str, Verb] = {
        "read": (
            am.read,
            {
                "source": folder / "run.csv",
                "mapping": bench.ColumnMapping(),
                "downsampling": bench.Decimation(),
                "progress": None,
            },
        ),
        "read_csv": (am.read_csv, {"path": folder / "run.csv", "mapping": bench.ColumnMapping()}),
        "write": (am.write, {"recording": TABLE, "path": folder / "w.csv", "comments": True}),
        "from_pandas": (
            bench.from_pandas,
            {
                "frame": pd.DataFrame({"pressure [bar]": [1.0, 2.0]}),
                "mapping": bench.ColumnMapping(),
                "origin": "frame",
            },
        ),
        "fit": (
            am.fit,
            {
                "law": law,
                "recordings": TABLE,
                "loss": bench.LeastSquares(),
                "censoring": None,
                "sigma": None,
                "fixed": (),
            },
        ),
        "compare": (
            bench.compare,
            {
                "recordings": [TABLE],
                "candidates": bench.standard_candidates([TABLE])[:1],
                "leave_out": None,
                "loss": bench.LeastSquares(),
                "workers": 1,
                "progress": None,
            },
        ),
        "bootstrap": (
            bench.bootstrap,
            {"fit": fit, "recordings": TABLE, "refits": 2, "by": None, "seed": 0, "progress": None},
        ),
        "confidence_band": (
            bench.confidence_band,
            {"fit": fit, "points": TABLE, "level": 0.95, "prediction": False},
        ),
        "profile": (bench.profile, {"fit": fit, "name": fit.estimates[0].name, "level": 0.95}),
        "weakly_determined": (bench.weakly_determined, {"fit": fit}),
        "find_runs": (bench.find_runs, {"recording": ramp, "sensors": sensors}),
        "find_branches": (
            bench.find_branches,
            {"recording": ramp, "sensor": None, "reversal": 0.05, "runs": None},
        ),
        "find_outliers": (bench.find_outliers, {"recording": ramp, "sensors": sensors}),
        "find_plateaus": (
            bench.find_plateaus,
            {"recording": ramp, "sensors": sensors, "columns": ("pressure",)},
        ),
        "plateau_points": (
            bench.plateau_points,
            {"recording": ramp, "plateaus": bench.find_plateaus(ramp)},
        ),
        "quasi_static_rows": (
            bench.quasi_static_rows,
            {"recording": ramp, "sensors": sensors, "max_change": 0.01},
        ),
        "find_loops": (
            bench.find_loops,
            {"recordings": [ramp], "law": None, "degree": 3, "all_rows": True},
        ),
        "find_holds": (bench.find_holds, {"recording": ramp}),
        "find_shape_violations": (
            bench.find_shape_violations,
            {"law": fit.model, "validity_range": area, "points": 5},
        ),
        "estimate_sensors": (bench.estimate_sensors, {"recordings": ramp}),
        "inspect": (bench.inspect, {"recording": ramp, "shared_sensors": None}),
        "inspect_all": (bench.inspect_all, {"recordings": [ramp]}),
        "classify_records": (bench.classify_records, {"recordings": [ramp]}),
        "check_contents": (bench.check_contents, {"recordings": [ramp]}),
        "standard_candidates": (bench.standard_candidates, {"recordings": [TABLE]}),
        "predict_static": (
            bench.predict_static,
            {
                "law": fit.model,
                "recording": TABLE,
                "friction": None,
                "creep": None,
                "half_width": None,
                "validity_range": None,
                "rates": None,
                "band": "",
                "notes": (),
                "differences": (),
            },
        ),
        "predict_dynamic": (
            bench.predict_dynamic,
            {
                "plant": plant,
                "experiment": experiment,
                "observed": {"pressure": 1e3},
                "uncertainty": None,
                "own": (),
                "method": None,
            },
        ),
        "fit_dynamic": (
            bench.fit_dynamic,
            {
                "plant": plant,
                "experiments": [experiment],
                "free": ["muscle.damper.damping"],
                "observed": {"pressure": 1e3},
                "per_record": (),
                "bounds": None,
                "starts": 1,
                "seed": 0,
                "method": None,
            },
        ),
        "fit_regulator": (
            bench.fit_regulator,
            {
                "recordings": [ramp],
                "supply_pressure": 6e5,
                "volume": 1e-4,
                "noise": 1e3,
                "initial": None,
                "free": ("fill.conductance",),
                "starts": 1,
                "seed": 0,
            },
        ),
        "identify_campaign": (
            bench.identify_campaign,
            {
                "recordings": [ramp],
                "geometry": None,
                "progress": None,
                "finished": None,
            },
        ),
        "free_of_creep": (
            bench.free_of_creep,
            {"elements": physics.CreepElements((1e4,), (10.0,)), "recordings": [ramp]},
        ),
        "fit_creep": (bench.fit_creep, {"recording": ramp, "quantity": "force"}),
        "fit_held_creep": (bench.fit_held_creep, {"recordings": [ramp], "law": None}),
        "fit_shape_constrained": (
            bench.fit_shape_constrained,
            {"law": law, "recordings": TABLE, "free": None, "cells": (3, 3)},
        ),
        "approximate": (
            bench.approximate,
            {"law": entry.characteristic, "other": law, "validity_range": area},
        ),
        "find_length_errors": (bench.find_length_errors, {"law": fit.model, "recordings": [TABLE]}),
        "maximum_rate": (bench.maximum_rate, {"recordings": [ramp], "name": "contraction"}),
        "rate_of_change": (bench.rate_of_change, {"recording": ramp, "name": "contraction"}),
        "motion_direction": (
            bench.motion_direction,
            {"values": swing, "time": time, "reversal": 0.05},
        ),
        "without_outliers": (bench.without_outliers, {"recordings": [ramp]}),
        "analyse_sampling": (bench.analyse_sampling, {"recording": ramp}),
        "stated_ambient": (bench.stated_ambient, {"recording": ramp, "default": None}),
        "initial_friction_laws": (
            bench.initial_friction_laws,
            {"path": swing, "force": force, "elements": 2},
        ),
        "simulate": (
            am.simulate,
            {
                "plant": plant,
                "input": schedule,
                "duration": 0.01,
                "initial_state": state,
                "start_time": 0.0,
                "output_times": None,
                "integrator": None,
                "complete": True,
            },
        ),
        "simulate_batch": (
            engine.simulate_batch,
            {
                "plant": plant,
                "variations": {"mechanism.mass": [1.0, 2.0]},
                "input": schedule,
                "duration": 0.01,
                "initial_states": None,
                "start_time": 0.0,
                "output_times": None,
                "integrator": None,
                "keep": None,
                "into": None,
                "cores": None,
            },
        ),
        "advance": (
            engine.advance,
            {
                "plant": plant,
                "state": state,
                "inputs": {"fill": 1.0},
                "dt": 0.01,
                "integrator": None,
                "start_time": 0.0,
            },
        ),
        "solve": (engine.solve, {"problem": engine.Problem(plant, schedule, 0.01, state)}),
        "spline_trajectory": (
            engine.spline_trajectory,
            {"times": [0.0, 1.0], "positions": [0.0, 1.0], "from_rest": True},
        ),
        "find_equilibrium": (
            physics.find_equilibrium,
            {"plant": plant, "pressure": 1e5, "inputs": None},
        ),
        "find_equilibria": (
            physics.find_equilibria,
            {"plant": plant, "pressure": 1e5, "inputs": None},
        ),
        "complete_inputs": (physics.complete_inputs, {"system": plant, "inputs": {"fill": 1.0}}),
        "linearise": (physics.linearise, {"plant": plant, "state": state, "inputs": {"fill": 1.0}}),
        "stiffness": (physics.stiffness, {"plant": plant, "state": state}),
        "as_force_law": (
            physics.as_force_law,
            {"law": entry.characteristic, "validity_range": area, "degree": 3},
        ),
        "as_polynomial": (
            physics.as_polynomial,
            {"geometry": entry.geometry, "degree": 4, "contraction_range": (0.0, 0.2)},
        ),
        "in_series": (physics.in_series, {"valves": valve}),
        "in_parallel": (physics.in_parallel, {"valves": valve}),
        "orifice_flow": (
            physics.orifice_flow,
            {"orifice": valve, "first": physics.Air(6e5, 293.0), "second": physics.Air(1e5, 293.0)},
        ),
        "load": (am.load, {"name_or_path": "dmsp-20-300"}),
        "load_data": (am.load_data, {"name": "dmsp-20-300"}),
        "load_scenario": (files.load_scenario, {"path": "x.toml"}),
        "load_dynamic_fit": (files.load_dynamic_fit, {"path": "x.toml"}),
        "load_plant_model": (files.load_plant_model, {"path": "x.toml"}),
        "load_study": (design.load_study, {"path": "x.toml"}),
        "load_valve": (files.load_valve, {"name_or_path": files.list_valves()[0]}),
        "load_product": (files.load_product, {"name": files.list_products()[0]}),
        "entries_of_product": (files.entries_of_product, {"name": files.list_products()[0]}),
        "save": (am.save, {"entry": entry, "path": folder / "m.toml"}),
        "to_toml": (files.to_toml, {"entry": entry}),
        "verify": (files.verify, {"entry": entry}),
        "cite": (am.cite, {"obj": entry}),
        "amigo_pi": (design.amigo_pi, {"model": model}),
        "amigo_pid": (design.amigo_pid, {"model": model}),
        "simc": (design.simc, {"model": model, "closed_loop_time": 0.2}),
        "rule_settings": (design.rule_settings, {"model": model}),
        "first_order_of_step": (
            design.first_order_of_step,
            {"time": time, "output": 1.0 - np.exp(-time), "step": 1.0, "step_time": None},
        ),
        "integrator_of_step": (
            design.integrator_of_step,
            {"time": time, "output": time, "step": 1.0, "step_time": None},
        ),
        "ultimate_point": (
            design.ultimate_point,
            {"time": time, "output": np.sin(5.0 * time), "amplitude": 1.0, "hysteresis": 0.0},
        ),
        "size_muscles": (
            design.size_muscles,
            {
                "requirement": design.LiftRequirement(0.03, mass=10.0),
                "conditions": design.SizingConditions(6e5),
                "muscles": [entry],
                "sort": design.by_air,
                "progress": None,
            },
        ),
        "consistency_band": (
            control.consistency_band,
            {"dimension": 2, "runs": 10, "probability": 0.95},
        ),
        "make_identifiers": (outlets.make_identifiers, {"names": ["a b"]}),
        "write_law": (
            outlets.write_law,
            {"law": law, "folder": folder / "law", "name": "", "title": ""},
        ),
        "conversion": (
            units.conversion,
            {"unit": "bar", "target": "Pa", "ambient": 101325.0, "where": ""},
        ),
        "quantity": (
            units.quantity,
            {"value": "1 bar", "target": "Pa", "ambient": None, "where": ""},
        ),
        "law.force": (law.force, {"pressure": 1e5, "contraction": 0.1}),
        "geometry.volume": (entry.geometry.volume, {"contraction": 0.1}),
        "plant.state_at": (plant.state_at, {"pressure": 1e5, "position": 0.0}),
        "Stepper.step": (
            lambda dt, inputs: engine.Stepper(plant, state).step(inputs, dt),
            {"inputs": {"fill": 1.0}, "dt": 0.01},
        ),
        "Recording[]": (lambda column: TABLE[column], {"column": "pressure"}),
    }
    return found


NO_FILE = {"load_scenario", "load_dynamic_fit", "load_plant_model", "load_study"}
"""Functions that are given the name of no file, whose content other tests spoil."""


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Verb]:
    folder = tmp_path_factory.mktemp("verbs")
    lines = (f"{i},{100 + 20 * i},{i / 10},{200 + 10 * i}" for i in range(3))
    (folder / "run.csv").write_text(
        "\n".join(["time [s],pressure [kPa],contraction [%],force [N]", *lines])
    )
    return verbs(folder)


def call(verb: Verb, **changed: Any) -> None:
    """The call, with some arguments changed; of `valves`, the one argument is given by its
    place.
    """
    function, arguments = verb
    given = {**arguments, **changed}
    valves = [given.pop("valves")] if "valves" in given else []
    function(*valves, **given)


def refusal_of(verb: Verb, argument: str, junk: Any) -> str:
    """The message of the refusal, empty if the junk is accepted; another exception is one of the
    test.
    """
    try:
        call(verb, **{argument: junk})
    except AirmuscleError as error:
        return str(error)
    return ""


@pytest.mark.filterwarnings("ignore::airmuscle.errors.AirmuscleWarning")
def test_the_calls_that_are_spoiled_succeed(
    known: Mapping[str, Verb], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    assert len(known) >= 80
    for name in known.keys() - NO_FILE - {"fit_regulator"}:  # of a record without a command
        call(known[name])


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("count", [2, pytest.param(len(JUNK), marks=pytest.mark.slow)])
def test_junk_in_one_argument_is_accepted_or_refused_by_an_error_of_airmuscle(
    known: Mapping[str, Verb], count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    draw = random.Random(26)
    for name, verb in known.items():
        for argument in verb[1]:
            for junk in draw.sample(JUNK, count):
                said = refusal_of(verb, argument, junk)
                assert len(said) < 1000, (name, argument, junk)


@pytest.mark.parametrize(
    ("wrong", "error", "message"),
    [
        (
            lambda: bench.bootstrap(3, None),
            ParameterError,
            "bootstrap: fit must be an instance of Fit; it is 3",
        ),
        (
            lambda: bench.maximum_rate([1], "force"),
            ParameterError,
            "maximum_rate: recordings must be a sequence, each",
        ),
        (
            lambda: bench.standard_candidates([]),
            ParameterError,
            "standard_candidates: recordings is empty; give at least",
        ),
        (lambda: physics.in_series("a"), ParameterError, "argument 1 is"),
        (
            lambda: design.first_order_of_step("a", [1], 1.0),
            ParameterError,
            "time must be an array of numbers; it is 'a'",
        ),
        (
            lambda: bench.compare(TABLE, progress=3),
            ParameterError,
            "compare: progress must be a function of a text and a number or None; it is 3",
        ),
        (
            lambda: bench.compare(TABLE, progress=lambda: 0),
            ParameterError,
            "function of a text and a number or None; it is <f",
        ),
        (
            lambda: design.size_muscles(
                design.LiftRequirement(0.03, mass=10.0), design.SizingConditions(6e5), sort=int
            ),
            ParameterError,
            "sort must be a function of an instance of MuscleChoice; it is <class 'int'>",
        ),
        (
            lambda: am.read("9" * 5000),
            FileError,
            "read: source is '9.*, which is no usable path: File name too long",
        ),
        (
            lambda: control.consistency_band(2, 0),
            ParameterError,
            "runs is 0; it must be a whole number of at least 1",
        ),
        (lambda: RUN[[1]], ColumnError, r"table: no column '\[1\]'; the columns are time"),
        (
            lambda: units.conversion(3, "Pa"),
            UnitError,
            "a unit is a text, such as 'mm', 'kPa' or 'N'; given are 3 and",
        ),
        (
            lambda: units.quantity("1 m", 3),
            UnitError,
            "the target of a quantity is a unit in SI, .* given is 3",
        ),
        (
            lambda: am.load("dmsp-20-300").characteristic.force(int, 0.1),
            ParameterError,
            r"pressure is <class 'int'>; give",
        ),
        (lambda: am.fit(am.load("dmsp-20-300").characteristic, TABLE, sigma=[1.0]), None, ""),
        (
            lambda: am.fit(am.load("dmsp-20-300").characteristic, TABLE, sigma=[1, 2]),
            IdentificationError,
            r"shape \(2,\)",
        ),
    ],
)
def test_the_argument_that_is_wrong_is_named(
    wrong: Callable[[], Any], error: type[Exception] | None, message: str
):
    with pytest.raises(error, match=message) if error else contextlib.nullcontext():
        wrong()


def test_an_error_of_python_that_no_argument_explains_is_passed_on():
    """It is an error of the program, or of a function of the user, and its traceback shows the
    line.
    """

    def progress(name: str, fraction: float) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        bench.compare([TABLE], bench.standard_candidates([TABLE])[:1], progress=progress)
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'name'"):
        bench.profile(None)


def test_a_function_of_a_room_is_pickled_by_its_name():
    assert am.fit is bench.fit
    assert pickle.loads(pickle.dumps(bench.fit)) is bench.fit


def test_a_remembered_analysis_is_called_by_the_names_of_its_arguments():
    assert [run.kind for run in bench.find_runs(recording=RUN)] == [
        run.kind for run in bench.find_runs(RUN)
    ]
