"""The instants of a command may be unknowns of a dynamic fit: the outputs depend on them by the
variational equation, which begins at each instant with the difference of the rates before and after
it.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from airmuscle.bench import CommandInstants, Experiment, InitialConditions, StartTime, fit_dynamic
from airmuscle.engine import Rodas4, SampledSignal, Schedule, simulate
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    Braid,
    EnergyBalance,
    FillDischarge,
    Isometric,
    Muscle,
    Plant,
    Supply,
    Valve,
)

MUSCLE = Muscle.ideal(Braid(0.01, math.radians(25), 0.3))
VALVES = FillDischarge(Supply(6e5), Valve(3e-9, 0.35), Valve(3.6e-9, 0.2))
PLANT = Plant(MUSCLE, VALVES, Isometric(0.1), EnergyBalance(0.4))
DETECTED = Schedule({"fill": ((0.1, 1.0), (0.5, 0.0)), "discharge": ((0.5, 1.0), (0.9, 0.0))})
TRUE = Schedule({"fill": ((0.1, 1.0), (0.504, 0.0)), "discharge": ((0.504, 1.0), (0.897, 0.0))})
FREE = ("circuit.fill.conductance", "gas.heat_transfer")


def fitted(command, duration=1.5, own=(StartTime(0.02), CommandInstants(0.02))):
    run = simulate(PLANT, TRUE, duration=duration, output_times=0.01, integrator=Rodas4(1e-8))
    recording = run.with_columns(
        pressure=run["pressure"] + np.random.default_rng(0).normal(0.0, 150.0, len(run))
    )
    experiment = Experiment(recording, command, InitialConditions.at_rest(PLANT, 0.0))
    return fit_dynamic(PLANT, [experiment], free=FREE, observed={"pressure": 150.0}, per_record=own)


def test_the_derivatives_are_those_of_finite_differences():
    fit = fitted(DETECTED)
    model = fit.problem.record_models[0]
    values = fit.values
    for k in model.unknown_indices:
        step = 1e-5 * fit.unknowns[k].scale * (1 if fit.unknowns[k].paths else 10)
        ends = [
            model.evaluate(values + sign * step * np.eye(values.size)[k]).values for sign in (-1, 1)
        ]
        difference = (ends[1] - ends[0]) / (2 * step)
        jacobian = model.evaluate(values).jacobian[:, :, k]
        away = np.abs(model.times[:, None] - np.array([0.1, 0.504, 0.897])).min(axis=1) > 1e-3
        np.testing.assert_allclose(
            difference[away], jacobian[away], atol=2e-3 * np.abs(jacobian).max()
        )


def test_each_later_instant_is_found_for_all_inputs_that_change_there():
    fit = fitted(DETECTED)
    assert [e.name for e in fit.estimates[3:]] == [
        "command instant 2 of record 1",
        "command instant 3 of record 1",
    ]
    for name, true in (
        ("command instant 2 of record 1", 0.504),
        ("command instant 3 of record 1", 0.897),
    ):
        assert (
            abs(fit[name].value - true)
            < 3.0 * fit[name].stderr + 3.0 * fit["start time of record 1"].stderr
        )
    command = fit.problem.record_models[0].command(fit.values)
    assert (
        command.changes["fill"][1][0]
        == command.changes["discharge"][0][0]
        == fit.estimates[3].value
    )
    assert fit.residual_std == pytest.approx(1.0, abs=0.1)


def test_an_instant_after_the_end_of_the_record_is_named_as_undetermined():
    fit = fitted(DETECTED, duration=0.8)
    assert any("command instant 3 of record 1" in note for note in fit.notes)


def test_a_command_of_one_instant_has_no_later_ones():
    own = (CommandInstants(0.02),)
    command = Schedule({"fill": ((0.1, 1.0),)})
    run = simulate(PLANT, command, duration=1.0, output_times=0.01)
    experiment = Experiment(run, command, InitialConditions.at_rest(PLANT, 0.0))
    fit = fit_dynamic(PLANT, [experiment], free=FREE, observed={"pressure": 150.0}, per_record=own)
    assert [estimate.name for estimate in fit.estimates] == list(FREE)


def test_a_command_without_instants_is_refused():
    signal = SampledSignal({"fill": ((0.1, 0.0), (0.2, 1.0))})
    with pytest.raises(
        ParameterError, match="the command of record 1 is a SampledSignal, which has no instants"
    ):
        fitted(signal)
