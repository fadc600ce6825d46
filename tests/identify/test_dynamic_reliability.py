"""What standard errors of a dynamic fit do not contain is said: other optima, a single search,
bounds, flat directions.

An unknown on its bound has no standard error, and the consequence is named. The effect of the bound
on the others is that of a fit with another bound. Numbers are chosen.
"""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from airmuscle.bench import Estimate, Experiment, InitialConditions, fit_dynamic
from airmuscle.bench.dynamics import (
    describe_bounds,
    describe_flatness,
    describe_optima,
    distinct_optima,
    dynamic_chapters,
    searches_at_lowest,
)
from airmuscle.engine import Schedule, simulate
from airmuscle.files import load
from airmuscle.physics import FillDischarge, Isometric, Muscle, Plant, Polytropic, Supply, Valve

FILL = Schedule({"fill": ((0.0, 1.0),)})
CONDUCTANCE = "circuit.fill.conductance"
RATIO = "circuit.fill.critical_ratio"


def a_fill(ratio: float = 0.35, noise: float = 200.0) -> tuple[Plant, Experiment]:
    """A held muscle filled through a valve, recorded with noise."""
    entry = load("dmsp-20-300")
    muscle = Muscle(entry.characteristic, entry.geometry)
    valve = Valve(3e-9, ratio)
    plant = Plant(
        muscle, FillDischarge(Supply(6e5), valve, valve), Isometric(0.05), Polytropic(1.2)
    )
    run = simulate(
        plant, FILL, duration=1.5, initial_state=plant.state_at(pressure=0.0), output_times=0.01
    )
    noisy = run["pressure"] + noise * np.random.default_rng(2).standard_normal(len(run))
    record = dataclasses.replace(run, columns={"time": run["time"], "pressure": noisy}, units={})
    return plant, Experiment(record, FILL, InitialConditions.at_coordinates(plant, 0.0))


PARAMETERS = np.full(2, np.nan)
"""Margins of two parameters, which have none."""


def an_estimate(name: str, value: float, stderr: float, on_bound: bool = False) -> Estimate:
    return Estimate(name, name, value, stderr, "1", "", on_bound)


def test_another_optimum_of_nearly_the_same_residual_is_named_with_its_values() -> None:
    estimates = [
        an_estimate("valve.critical_ratio", 0.5, 0.005),
        an_estimate("valve.conductance", 2.0, 0.01),
    ]
    values = np.array([[0.5, 2.0], [0.69, 2.01], [0.2, 9.0]])
    costs = np.array([1000.0, 1020.1, 5000.0])
    optima = distinct_optima(values, costs, np.ones(2), PARAMETERS)
    assert [each.searches for each in optima] == [1, 1, 1]
    first, second = describe_optima(optima, estimates, costs, PARAMETERS)
    assert "1 search of 3 ended where the rms residual is only 1.0 % greater" in first
    assert "valve.critical_ratio 0.69 instead of 0.5;" in first
    assert "conductance" not in first
    assert "only one of 3 searches reached this optimum" in second


def test_searches_that_agree_are_one_optimum_and_need_no_remark() -> None:
    values = np.array([[0.5, 2.0], [0.5005, 2.001], [0.5, 2.0]])
    costs = np.array([1000.0, 1000.2, 1000.3])
    optima = distinct_optima(values, costs, np.ones(2), PARAMETERS)
    assert [each.searches for each in optima] == [3]
    assert searches_at_lowest(costs) == 3
    assert (
        describe_optima(
            optima, [an_estimate("a", 0.5, 0.01), an_estimate("b", 2.0, 0.01)], costs, PARAMETERS
        )
        == []
    )


def test_a_worse_optimum_and_one_within_the_standard_errors_are_no_alternative() -> None:
    costs = np.array([1000.0, 1000.1, 1003.0, 1300.0])
    values = np.array([[0.5], [0.5], [0.55], [0.9]])
    optima = distinct_optima(values, costs, np.ones(1), PARAMETERS[:1])
    assert len(optima) == 3
    assert describe_optima(optima, [an_estimate("a", 0.5, 0.03)], costs, PARAMETERS[:1]) == []


def test_a_bound_moves_the_other_unknowns_by_the_gradient_of_the_constrained_optimum() -> None:
    random = np.random.default_rng(4)
    jacobian = random.standard_normal((60, 3)) + random.standard_normal((60, 1))
    data = random.standard_normal(60)
    scales = np.array([2.0, 0.5, 3.0])

    def others(bound: float) -> np.ndarray:
        return (
            np.linalg.lstsq(jacobian[:, :2], data - jacobian[:, 2] * bound / scales[2], rcond=None)[
                0
            ]
            * scales[:2]
        )

    value = 1.2
    expected = others(1.1 * value) - others(value)
    inner = others(value)
    estimates = [
        *(an_estimate(f"x{i}", inner[i], 1e-3) for i in range(2)),
        an_estimate("tube.volume", value, np.nan, True),
    ]
    inverse = np.linalg.inv(jacobian[:, :2].T @ jacobian[:, :2])
    (note,) = describe_bounds(
        estimates, jacobian, inverse, np.array([False, False, True]), scales, np.zeros(3)
    )
    for i in range(2):
        assert f"x{i} by {expected[i]:+.2g}" in note
    assert "tube.volume is on its bound, 1.2, and has no standard error" in note
    assert "must not be used with another volume" in note


def test_a_critical_ratio_on_its_bound_has_no_standard_error_and_a_named_consequence() -> None:
    plant, experiment = a_fill(ratio=0.1)
    fit = fit_dynamic(
        plant_with_ratio(plant, 0.4),
        [experiment],
        free=(CONDUCTANCE, RATIO),
        observed={"pressure": 200.0},
        bounds={RATIO: (0.3, 0.9)},
    )
    assert fit[RATIO].on_bound
    assert np.isnan(fit[RATIO].stderr)
    note = next(note for note in fit.notes if RATIO in note)
    assert "has no standard error" in note
    assert "the predicted time to the final pressure is biased" in note
    stated = re.search(rf"would move {re.escape(CONDUCTANCE)} by (\S+)", note)
    assert stated
    wider = fit_dynamic(
        plant_with_ratio(plant, 0.4),
        [experiment],
        free=(CONDUCTANCE, RATIO),
        observed={"pressure": 200.0},
        bounds={RATIO: (0.33, 0.9)},
    )
    assert float(stated[1]) == pytest.approx(
        wider[CONDUCTANCE].value - fit[CONDUCTANCE].value, rel=0.3
    )


def plant_with_ratio(plant: Plant, ratio: float) -> Plant:
    circuit = plant.circuit
    assert isinstance(circuit, FillDischarge)
    return dataclasses.replace(plant, circuit=dataclasses.replace(circuit, fill=Valve(3e-9, ratio)))


def test_a_fit_with_model_error_states_the_range_at_one_per_cent_of_rms() -> None:
    estimates = [
        an_estimate("valve.critical_ratio", 0.5, 0.01),
        an_estimate("valve.conductance", 2.0, 1e-4),
    ]
    (note,) = describe_flatness(estimates, 10_000, PARAMETERS)
    half = 0.01 * np.sqrt(0.0201 * 10_000)
    assert f"valve.critical_ratio {0.5 - half:.3g} to {0.5 + half:.3g}" in note
    assert "conductance" not in note
    assert describe_flatness(estimates, 300, PARAMETERS) == []


@pytest.mark.parametrize("zero", [0.0, 1.7e9])
def test_changes_of_a_start_time_are_relative_to_its_margin_whatever_the_zero_of_the_clock(
    zero: float,
) -> None:
    margins, scales, costs = (
        np.array([np.nan, 0.02]),
        np.array([0.5, 0.02]),
        np.array([1000.0, 1000.1, 1000.2]),
    )
    values = np.array([[0.5, zero], [0.5, zero + 0.0002], [0.5, zero + 0.01]])
    optima = distinct_optima(values, costs, scales, margins)
    assert [each.searches for each in optima] == [2, 1]
    small, large = (
        [an_estimate("ratio", 0.5, 1e-5), an_estimate("start time", zero, e)] for e in (1e-5, 1e-3)
    )
    assert "start time" in describe_optima(optima, small, costs, margins)[0]
    assert describe_flatness(small, 10_000, margins) == []
    assert "start time" in describe_flatness(large, 10_000, margins)[0]


def test_the_range_at_one_per_cent_of_rms_is_that_of_a_linear_fit() -> None:
    random = np.random.default_rng(1)
    design = random.standard_normal((400, 2))
    data = random.standard_normal(400)
    best, cost, *_ = np.linalg.lstsq(design, data, rcond=None)
    stderr = np.sqrt(cost[0] / 398 * np.linalg.inv(design.T @ design)[0, 0])
    half = stderr * np.sqrt(0.0201 * 398)
    moved = np.linalg.lstsq(design[:, 1:], data - design[:, 0] * (best[0] + half), rcond=None)[1][0]
    assert np.sqrt(moved / cost[0]) == pytest.approx(1.01, abs=1e-6)


def test_the_report_shows_the_optima_and_a_single_search_says_so() -> None:
    plant, experiment = a_fill()
    fit = fit_dynamic(plant, [experiment], free=(CONDUCTANCE,), observed={"pressure": 200.0})
    assert "one search, so other optima were not sought" in str(fit)
    optima = (
        *fit.optima,
        dataclasses.replace(fit.optima[0], values=2 * fit.optima[0].values, cost=2 * fit.costs[0]),
    )
    tables = {
        t.name: t
        for t in dynamic_chapters(dataclasses.replace(fit, optima=optima), "Fill")[0].tables
    }
    assert tables["optima"].columns["rms residual relative to the lowest"] == pytest.approx(
        [1.0, 2**0.5]
    )
