"""Comparison of control loops on a user's plant: metrics by hand, truths within their spreads, one
task for all controllers, and no dependence on workers.

A controller knows the nominal plant alone. The parameters of a truth belong to its seed, whatever
other spreads there are.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airmuscle.control import PID, linearise_loop
from airmuscle.design import (
    ComparedLoop,
    ComparedPlant,
    RunSettings,
    compare_loops,
    compare_scenarios,
    load_scenario_loop,
)
from airmuscle.design.control_comparison import drawn_truth, read_seeds, read_spread
from airmuscle.engine import ControlLoop, Problem, Schedule, solve
from airmuscle.errors import ParameterError, UnitError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SHORT = 'duration = "1.2 s"'


def scenario(folder: Path, name: str, *changes: tuple[str, str]) -> Path:
    """The pressure loop of the examples, shortened, with other texts."""
    text = (EXAMPLES / "pressure_loop.toml").read_text("utf-8")
    text = text.replace('duration = "5 s"', SHORT).replace('"1 s", "3 bar"', '"0.4 s", "3 bar"')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("loops")
    return [
        scenario(folder, "fast"),
        scenario(folder, "slow", ("1.5 1/bar", "0.3 1/bar")),
    ]


@pytest.fixture(scope="module")
def result(files: list[Path]):
    return compare_scenarios(
        files, spreads=("mechanism.mass=5 kg:15 kg",), truth_seeds=(1, 2), begin=0.2
    )


def test_a_better_controller_is_first_and_the_report_begins_with_it(result):
    assert list(result.scores()) == ["fast", "slow"]
    chapter = result.chapter()
    assert chapter.paragraphs[0].startswith("fast has the smallest rms error: those of slow")
    assert chapter.paragraphs[0].endswith("larger on 3 of 3 plants.")
    assert "mechanism.mass 5 to 15" in chapter.paragraphs[1]
    assert [table.name for table in chapter.tables][:3] == ["ranking", "errors", "costs"]
    assert str(result).startswith("Comparison of 2 controllers\nfast has the smallest rms error")


def test_the_errors_are_those_of_a_simulation_from_the_judged_time_on(files, result):
    loaded = load_scenario_loop(files[0])
    problem = replace(loaded.scenario.problem, output_times=loaded.loop.sample_time)
    record = solve(problem).recording
    judged = record["time"] >= 0.2 - 1e-9
    error = (record["setpoint.pressure"] - record["pressure"])[judged]
    time = record["time"][judged]
    wanted = math.sqrt(np.trapezoid(error**2, time) / np.ptp(time))
    assert result.values("fast", "rmse", "pressure")[0] == pytest.approx(wanted, rel=1e-12)
    assert result.values("fast", "max_error", "pressure")[0] == np.abs(error).max()


def test_the_score_is_the_ratio_of_the_errors_on_the_same_plant(result):
    fast, slow = (result.values(name, "rmse", "pressure") for name in ("fast", "slow"))
    assert (slow > fast).all()
    assert result.ratios()["slow"][0] == pytest.approx(slow / fast)
    assert result.ratios()["fast"][0] == pytest.approx(1.0)
    other = result.chapter().tables[4].columns["than slow"]
    assert other.values == [3, None]


def test_two_equal_controllers_have_no_order(files):
    twice = compare_scenarios([files[0], same_as(files[0])])
    assert "have about the same rms error: the ratio is 1 in the median" in str(twice)


def same_as(path: Path) -> Path:
    other = path.with_name("again.toml")
    other.write_text(path.read_text("utf-8"), encoding="utf-8")
    return other


def test_a_run_does_not_depend_on_the_workers(files, result):
    again = compare_scenarios(
        files, spreads=("mechanism.mass=5 kg:15 kg",), truth_seeds=(1, 2), begin=0.2, workers=2
    )
    for name in result.names:
        for metric in ("effort", "strokes", "air"):
            np.testing.assert_array_equal(again.values(name, metric), result.values(name, metric))


def test_a_controller_knows_the_nominal_plant_alone(tmp_path):
    """Predictive control, which contains a model of the plant."""
    text = (EXAMPLES / "predictive_lift.toml").read_text("utf-8")
    path = tmp_path / "predictive.toml"
    path.write_text(text.replace('duration = "1.3 s"', 'duration = "0.3 s"'), encoding="utf-8")
    found = compare_scenarios([path], spreads=("mechanism.mass=30 %",), truth_seeds=(3,))
    nominal, truth = (compared.plant.mechanism.mass for compared in found.plants)
    (compared,) = found.loops
    assert compared.loop.controller.plant.mechanism.mass == nominal != truth
    errors = found.values("predictive", "rmse", "position")
    assert np.isfinite(errors).all()
    assert errors[0] != errors[1]


# Metrics


def test_strokes_are_those_of_the_valves_behind_pulse_width_modulation():
    """A duty of 30 % at 50 Hz: a valve opens and closes 50 times a second, its command rests."""
    loaded = load_scenario_loop(EXAMPLES / "pressure_loop.toml")
    plant = loaded.scenario.plant
    law = replace(loaded.loop.controller, gain=0.0, integral_time=1e3, initial_output=0.3)
    loop = replace(loaded.loop, controller=law)
    compared = compare_loops(
        [ComparedLoop("held", loop)],
        [ComparedPlant("nominal", plant, loaded.scenario.initial_state)],
        RunSettings(0.4, row_time=0.02),
    )
    (strokes,) = compared.values("held", "strokes")
    assert strokes == pytest.approx(100.0, rel=0.06)
    assert compared.values("held", "effort")[0] < 1e-3
    assert compared.values("held", "busiest")[0] == pytest.approx(strokes)


def test_the_air_is_what_flows_into_the_muscle(result, files):
    loaded = load_scenario_loop(files[0])
    record = solve(replace(loaded.scenario.problem, output_times=loaded.loop.sample_time)).recording
    judged = record["time"] >= 0.2 - 1e-9
    mass = record["air_mass"][judged]
    drawn = np.maximum(np.diff(mass), 0.0).sum() / np.ptp(record["time"][judged])
    assert result.values("fast", "air")[0] == pytest.approx(drawn)


def test_margins_are_those_of_the_linear_loop_where_the_run_ends():
    """A proportional loop of a plant that ends at rest."""
    loaded = load_scenario_loop(EXAMPLES / "pressure_loop.toml")
    plant = loaded.scenario.plant
    law = PID("pressure", loaded.loop.controller.commanded, gain=2e-6, integral_time=1.0)
    loop = ControlLoop(law, 0.02, Schedule({"pressure": ((0.0, 1e5),)}))
    start = loaded.scenario.initial_state
    found = compare_loops(
        [ComparedLoop("PI", loop)],
        [ComparedPlant("nominal", plant, start)],
        RunSettings(3.0, row_time=0.02),
    )
    (row,) = found.runs["PI", "nominal"].margins
    assert row.margins is not None, row.reason
    solution = solve(Problem(plant, loop, 3.0, start, output_times=0.02))
    if row.reason == "at the end of the run":
        linear = linearise_loop(
            plant, loop, solution.final_state, control_state=solution.control_state
        )
        assert row.margins == linear.margins("pressure")
    else:
        assert row.reason == "equilibrium at the last pressures, 1 % open"
    assert 1.0 < row.margins.gain < math.inf
    assert found.chapter().tables[3].columns["phase margin"][0] == row.margins.phase


# Truths


PLANT = load_scenario_loop(EXAMPLES / "pressure_loop.toml").scenario.plant


def test_the_parameters_of_a_truth_belong_to_its_seed_whatever_other_spreads_there_are():
    mass, flow = (
        read_spread(text, PLANT) for text in ("mechanism.mass=4 kg:6 kg", "*.conductance=30 %")
    )
    for seed in range(20):
        alone, both = (drawn_truth(PLANT, spreads, seed) for spreads in ((mass,), (flow, mass)))
        assert 4.0 <= alone.mechanism.mass <= 6.0
        assert alone.mechanism.mass == both.mechanism.mass
        assert both == drawn_truth(PLANT, (mass, flow), seed)
        factor = both.circuit.fill.conductance / PLANT.circuit.fill.conductance
        assert 0.7 <= factor <= 1.3
        discharge = both.circuit.discharge.conductance / PLANT.circuit.discharge.conductance
        assert discharge == pytest.approx(factor)
    masses = [drawn_truth(PLANT, (mass,), seed).mechanism.mass for seed in range(400)]
    assert np.mean(masses) == pytest.approx(5.0, abs=4 * 2 / math.sqrt(12 * 400))


def test_a_wide_range_is_drawn_by_its_logarithm():
    wide = read_spread("mechanism.mass=1 kg:100 kg", PLANT)
    logarithms = np.log10([wide.drawn(seed) for seed in range(400)])
    assert logarithms.mean() == pytest.approx(1.0, abs=4 * 2 / math.sqrt(12 * 400))


def test_seeds_are_numbers_and_ranges():
    assert read_seeds("101-103, 7,7") == (101, 102, 103, 7)
    assert read_seeds("") == ()


def test_an_unknown_dead_time_delays_all_measurements(files):
    found = compare_scenarios(files[:1], truth_seeds=range(1, 5), delay=3)
    delays = [compared.delay for compared in found.plants]
    assert delays[0] == 0
    assert len({*delays[1:]}) > 1
    assert max(delays) <= 3
    errors = found.values("fast", "rmse", "pressure")
    for delay, error in zip(delays, errors, strict=True):
        assert (error == errors[0]) == (delay == 0)


# Refusals


@pytest.mark.parametrize(
    ("spread", "error", "message"),
    [
        ("mechanism.mass", ParameterError, "must be a parameter and its range"),
        ("mechanism.mas=20 %", ParameterError, "Did you mean 'mechanism.mass'"),
        ("mechanism.mass=20", ParameterError, "is no range; give a share, '20 %'"),
        ("mechanism.mass=120 %", ParameterError, "allowed range: more than 0, below 100 %"),
        ("mechanism.mass=7 kg:4 kg", ParameterError, "the minimum must be below the maximum"),
        ("mechanism.mass=4 bar:7 bar", UnitError, "kg"),
        ("*.mas=20 %", ParameterError, r"no parameter of the plant fits '\*.mas'"),
        ("*.mass=4 kg:7 kg", ParameterError, r"needs a share of the present values"),
    ],
)
def test_an_impossible_spread_is_refused(spread, error, message):
    with pytest.raises(error, match=message):
        read_spread(spread, PLANT)


def test_a_truth_beyond_the_bounds_of_a_parameter_is_refused():
    spread = read_spread("circuit.fill.critical_ratio=0.4:3", PLANT)
    seed = next(seed for seed in range(10) if spread.drawn(seed) > 1.0)
    with pytest.raises(ParameterError, match=rf"truth {seed}.*critical_ratio"):
        drawn_truth(PLANT, (spread,), seed)


def test_another_plant_is_refused_and_its_remedy_works(files, tmp_path):
    heavy = scenario(tmp_path, "heavy", ('mass = "10 kg"', 'mass = "12 kg"'))
    with pytest.raises(ParameterError, match=r"its mechanism.mass is 12, not 10 kg.*use rig="):
        compare_scenarios([files[0], heavy])
    found = compare_scenarios([files[0], heavy], rig=files[0])
    (note,) = found.notes
    assert note == "heavy was written for another rig: its mechanism.mass is 12, not 10 kg"
    assert found.plants[0].plant.mechanism.mass == 10.0


def test_another_set_point_is_refused(files, tmp_path):
    other = scenario(tmp_path, "other", ('"0.4 s", "3 bar"', '"0.4 s", "2 bar"'))
    message = r"set points of 'pressure' differ: at 0\.4\d* s that of 'fast' is 3e\+05 and that of"
    with pytest.raises(ParameterError, match=message):
        compare_scenarios([files[0], other])


def test_seeds_without_a_spread_are_refused(tmp_path):
    bare = scenario(tmp_path, "bare")
    if load_scenario_loop(bare).uncertainties()[0] is None:
        with pytest.raises(ParameterError, match=r"nothing from which truths are drawn.*spreads="):
            compare_scenarios([bare], truth_seeds=(1,))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"begin": 2.0}, r"begin is 2 s; allowed range: 0 to 1\.2 s"),
        ({"delay": 10**6}, "delay is 1000000; allowed range: 0 to"),
    ],
)
def test_impossible_settings_are_refused(change, message, files):
    with pytest.raises(ParameterError, match=message):
        compare_scenarios(files, **change)
