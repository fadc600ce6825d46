"""Numbers of report tables are those of the results, in the unit of their heading."""

from __future__ import annotations

import dataclasses
import itertools
import pickle
import types
from typing import Any

import numpy as np
import pytest

import airmuscle as am
from airmuscle.bench import (
    Bootstrap,
    Comparison,
    Experiment,
    InitialConditions,
    LoopFit,
    QuantityPrediction,
    RecordPrediction,
    find_loops,
    fit,
    fit_dynamic,
    fit_hysteresis,
    fit_jointly,
)
from airmuscle.bench.campaign import ValidationRow
from airmuscle.bench.campaign.result import _validation_table
from airmuscle.bench.dynamics.dynamic_chapter import dynamic_chapters
from airmuscle.bench.hysteresis.hysteresis_chapter import joint_friction_chapter
from airmuscle.bench.prediction import prediction_chapters
from airmuscle.bench.statics import VolumePoints, fit_volume
from airmuscle.bench.statics.experiment_design import run_table
from airmuscle.bench.statics.static_fit_chapter import _rows
from airmuscle.design import LiftRequirement, SizingConditions, size_muscles
from airmuscle.design.sizing import scenario_valves
from airmuscle.design.sizing.result import _valve_settings
from airmuscle.engine import Schedule
from airmuscle.physics import (
    Braid,
    FillDischarge,
    Isometric,
    MaxwellSlip,
    Muscle,
    Plant,
    Polytropic,
    Supply,
    Valve,
    VirtualWork,
)
from airmuscle.recording import Recording
from airmuscle.report import Chapter, Table, TableColumn, shown_columns

LENGTH = 0.3
BRAID = Braid(0.01, 0.43, LENGTH)
SLIP = MaxwellSlip((2e4, 1e4), (4e-4, 2e-3))


def cells(table: Table) -> dict[str, Any]:
    """The cells of a table under their headings with units."""
    return {each.heading: each.cells for each in shown_columns(table)}


def table_of(chapter: Chapter, name: str) -> dict[str, Any]:
    """The cells of the table of this name."""
    return next(cells(table) for table in chapter.tables if table.name == name)


def test_a_choice_of_a_sizing_is_in_millimetres_bar_per_cent_and_litres():
    lift = LiftRequirement(force=300.0, stroke=0.03)
    conditions = SizingConditions(supply=6e5, max_count=1)
    result = size_muscles(lift, conditions, (am.load("dmsp-20-300"),))
    choice = result.best
    chapter = result.chapter()
    row = {
        name: column[0]
        for name, column in (table_of(chapter, "choices") | table_of(chapter, "air")).items()
    }
    first = choice.design.extended
    last = choice.design.contracted
    assert row["nominal length [mm]"] == pytest.approx(1e3 * choice.length)
    ends = [row["pressure, long [bar]"], row["pressure, short [bar]"]]
    assert ends == pytest.approx([first.pressure / 1e5, last.pressure / 1e5])
    assert row["contraction, long [%]"] == pytest.approx(100 * first.contraction)
    assert row["contraction, short [%]"] == pytest.approx(100 * last.contraction)
    assert row["force, short [N]"] == pytest.approx(last.force)
    assert row["air a cycle [l (ANR)]"] == pytest.approx(1e3 * choice.reference_volume)
    assert row["air a minute [l (ANR)]"] == pytest.approx(
        60e3 * choice.reference_volume / conditions.cycle_time
    )
    assert row["efficiency [%]"] == pytest.approx(100 * choice.efficiency)
    assert row["diameter [mm]"] == pytest.approx(1e3 * choice.diameter)
    assert 1.0 < row["diameter [mm]"] < 100.0
    valves = scenario_valves(choice)
    litres_per_second_and_bar = valves[0].conductance * 1e3 * 1e5
    assert float(_valve_settings(valves)[0][1].split()[0]) == pytest.approx(
        litres_per_second_and_bar, rel=1e-3
    )


def test_a_dynamic_fit_has_two_standard_errors_and_residuals_as_model_minus_measured():
    valve = Valve(3e-9, 0.35)
    plant = Plant(
        Muscle.ideal(BRAID),
        FillDischarge(Supply(6e5), valve, valve),
        Isometric(0.05),
        Polytropic(1.2),
    )
    command = Schedule({"fill": ((0.0, 1.0),)})
    run = am.simulate(
        plant, command, duration=1.0, initial_state=plant.state_at(pressure=0.0), output_times=0.01
    )
    noisy = run["pressure"] + 500.0 * np.random.default_rng(2).standard_normal(len(run))
    record = Recording({"time": run["time"], "pressure": noisy}, "fill.csv")
    found = fit_dynamic(
        plant,
        [Experiment(record, command, InitialConditions.at_coordinates(plant, 0.0))],
        free=("circuit.fill.conductance",),
        observed={"pressure": 500.0},
    )
    (estimate,) = found.estimates
    chapter, record = dynamic_chapters(found, "Fill")
    table = table_of(chapter, "estimates")
    assert (table["value"], table["standard error"]) == ([estimate.value], [estimate.stderr])
    assert table_of(chapter, "rms")["rms residual"] == pytest.approx([found.rms("pressure") / 1e3])
    assert table_of(chapter, "rms")["unit"] == ["kPa"]
    (values,) = record.tables
    assert values.columns["measured pressure"].unit == "Pa"
    assert values.columns["measured pressure"].values == noisy.tolist()
    assert values.columns["residual of pressure"].values == pytest.approx(
        found.modelled()["pressure"] - noisy
    )
    worse = dataclasses.replace(found.optima[0], cost=4.0 * found.optima[0].cost)
    chapter, _ = dynamic_chapters(
        dataclasses.replace(found, optima=(found.optima[0], worse)), "Fill"
    )
    assert table_of(chapter, "optima")["rms residual relative to the lowest"] == pytest.approx(
        [1.0, 2.0]
    )


def test_a_volume_is_in_cubic_centimetres_and_its_criterion_counts_from_the_best():
    contraction = np.linspace(0.0, 0.25, 20)
    volume = BRAID.volume(contraction) + 3e-7 * np.random.default_rng(1).standard_normal(20)
    found = fit_volume(VolumePoints(contraction, np.asarray(volume), 0), LENGTH)
    chapter = found.chapter()
    columns = table_of(chapter, "volume")
    at = np.array(columns["contraction [%]"]) / 100
    assert columns["volume [cm3]"] == pytest.approx(1e6 * np.asarray(found.geometry.volume(at)))
    assert columns["standard deviation [cm3]"] == pytest.approx(1e6 * found.standard_deviation(at))
    compared = table_of(chapter, "volume-laws")
    lowest = min(found.aicc.values())
    expected = [found.aicc[name] - lowest for name in compared["law"]]
    assert compared["AICc above the best"] == pytest.approx(expected)
    assert expected[0] == 0.0
    assert found.summary in str(pickle.loads(pickle.dumps(found)))
    assert "<table" in found._repr_html_()


def isobaric(level: float, coulomb: float) -> Recording:
    turns = (0.02, 0.16, 0.02, 0.16)
    contraction = np.concatenate([np.linspace(a, b, 100) for a, b in itertools.pairwise(turns)])
    noise = np.random.default_rng(int(level)).standard_normal(300)
    force = (
        900.0
        - 4000.0 * contraction
        - coulomb * SLIP.force_along(contraction * LENGTH)
        + 0.5 * noise
    )
    columns = {
        "time": 0.2 * np.arange(300),
        "pressure": np.full(300, level),
        "contraction": contraction,
    }
    return Recording({**columns, "force": force}, f"{level:g}", {"resting_length": LENGTH})


def test_the_friction_of_loops_is_in_newtons_and_deviations_in_per_cent():
    loops = find_loops([isobaric(1e5, 1.0), isobaric(3e5, 1.5)], degree=2)
    fits = [
        LoopFit(each, (fit_hysteresis(SLIP, each.recording, static_curve=each.static_curve),), {})
        for each in loops
    ]
    chapter = fits[0].chapter()
    one = fits[0].fits[0]
    columns = table_of(chapter, "laws")
    names = ("rmse_without_friction", "rmse", "gap", "residual_gap", "aicc_reduction")
    headings = (
        "rms error without friction [N]",
        "rms error [N]",
        "branch gap without friction [N]",
        "remaining branch gap [N]",
        "reduction of AICc",
    )
    assert [columns[heading] for heading in headings] == [[getattr(one, name)] for name in names]
    rows = loops[0].fitted_rows
    path = loops[0].recording["contraction"]
    rising = int(np.count_nonzero(rows & (np.gradient(path) > 0)))
    sentence = chapter.paragraphs[-1]
    assert int(sentence.split()[0]) == pytest.approx(rising, abs=4)
    assert rising > 1.5 * (rows.sum() - rising)
    (joint,) = fit_jointly(fits)
    table = table_of(joint_friction_chapter([joint]), "joint-runs")
    runs = joint.agreement
    assert table["from this run [N]"] == [run.amplitude for run in runs]
    assert table["from all runs [N]"] == [run.joint_amplitude for run in runs]
    assert table["rms deviation [%]"] == pytest.approx([100 * run.deviation for run in runs])


def test_a_prediction_has_rows_counted_from_1_shares_in_per_cent_and_display_units():
    measured = np.array([1e5, 2e5, 3e5, 4e5])
    predicted = np.array([1.01e5, 2.0e5, 2.95e5, 4e5])
    compared = np.array([True, True, True, False])
    quantity = QuantityPrediction("pressure", measured, predicted, np.full(4, 2e3), compared)
    record = RecordPrediction(Recording({"pressure": measured}, "a.csv"), (quantity,))
    chapter, of_record = prediction_chapters("plant.toml", VirtualWork(BRAID), [record])
    columns = table_of(chapter, "predictions")
    rms = np.sqrt((1e3**2 + 5e3**2) / 3)
    assert columns["rms error"] == pytest.approx([rms / 1e3])
    assert columns["maximum error"] == [-5.0]
    assert columns["unit"] == ["kPa"]
    assert (columns["rows"], columns["rows within the band [%]"]) == ([3], [pytest.approx(200 / 3)])
    assert columns["half width of the 95 % band"] == [2.0]
    assert "maximum error -5 kPa in row 3" in of_record.summary
    assert table_of(record.chapter(), "predictions") == columns
    assert "Prediction of a.csv" in str(pickle.loads(pickle.dumps(record)))
    assert "<table" in record._repr_html_()


def test_a_ranking_has_each_error_under_its_heading_and_the_criterion_from_the_lowest():
    def model(name: str, inside: float, outside: float, aicc: float) -> types.SimpleNamespace:
        candidate = types.SimpleNamespace(name=name)
        return types.SimpleNamespace(
            candidate=candidate,
            parameter_count=3,
            in_sample_rmse=inside,
            cross_validated_rmse=outside,
            aicc=aicc,
            slack=types.SimpleNamespace(rows=0, pulling=0),
        )

    ranking = (model("a", 1.0, 2.0, -90.0), model("b", 0.5, 3.0, -100.0))
    columns = cells(
        Comparison._ranking_table(types.SimpleNamespace(ranking=ranking, recommended=ranking[0]))
    )
    assert columns["in-sample rms error [N]"] == [1.0, 0.5]
    assert columns["cross-validation rms error [N]"] == [2.0, 3.0]
    assert columns["AICc above the lowest"] == [10.0, 0.0]


def test_the_intervals_of_a_fit_are_those_of_its_standard_errors_and_of_its_bootstrap():
    law = VirtualWork(BRAID)
    contraction = np.linspace(0.0, 0.2, 20)
    noise = np.random.default_rng(3).standard_normal(20)
    data = Recording(
        {
            "pressure": np.full(20, 3e5),
            "contraction": contraction,
            "force": np.asarray(law.force(3e5, contraction)) + noise,
        },
        "a",
        {"resting_length": LENGTH},
    )
    found = fit(law, data)
    draws = Bootstrap(found, found.values * np.linspace(0.9, 1.2, 101)[:, None], 5, 0)
    chapter = draws.chapter()
    columns = chapter.tables[0].columns
    low, high = np.transpose(columns["by standard error"].values)
    assert low == pytest.approx(found.values - 1.96 * found.standard_errors)
    assert high == pytest.approx(found.values + 1.96 * found.standard_errors)
    low, high = np.transpose(columns["by bootstrap"].values)
    assert low == pytest.approx(found.values * 0.9075)
    assert high == pytest.approx(found.values * 1.1925)
    assert "Bootstrap: 101 refits" in str(pickle.loads(pickle.dumps(draws)))
    assert "<table" in draws._repr_html_()
    rows = _rows(found).columns
    assert np.array(rows["residual"]) == pytest.approx(
        np.array(rows["modelled force"]) - data["force"]
    )


def test_tables_of_a_campaign_have_shares_in_per_cent_and_runs_in_kilopascals():
    columns = cells(_validation_table([ValidationRow("a", 2.0, 8.0, 0.94, 50)]))
    assert (columns["rms error [N]"], columns["half width of the 95 % band [N]"]) == ([2.0], [8.0])
    assert columns["rows within the band [%]"] == [94.0]
    force = np.array([10.0, 250.0])
    run = types.SimpleNamespace(
        constant="pressure", level=3e5, swept="contraction", sweep_limits=(0.0, 0.21), force=force
    )
    columns = cells(run_table([run], "plan", "Plan"))
    assert (columns["constant"], columns["pressure [kPa]"]) == (["pressure"], [300.0])
    assert columns["contraction [%]"] == [(0.0, 21.0)]
    assert columns["expected force [N]"] == [(250.0, 10.0)]


def test_a_ratio_has_no_unit_and_a_contraction_is_in_per_cent():
    columns = {"fill": TableColumn([0.25], "1"), "contraction": TableColumn([0.25], "1", "%")}
    assert cells(Table("t", "t", columns)) == {"fill": [0.25], "contraction [%]": [25.0]}
