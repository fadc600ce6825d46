"""Benchmarks: all variants solve the same equations, and every script runs.

No times are asserted, because they depend on the machine; benchmarks/RESULTS.md contains them.
"""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import batch
import control_page
import controllers
import environments
import loops
import measure
import new_plant
import numpy as np
import ode8
import pytest
import rodas4
import run
import run_contenders
import startup
import static_fit
from contender_set import standard_contenders
from filling import runs
from joint_models import proportional_joint

from airmuscle.core import tree
from airmuscle.design import Group, compare_controllers, find_tasks
from airmuscle.engine import DormandPrince8, Rodas4, Schedule
from airmuscle.engine.compile import compile_system
from airmuscle.errors import InputError

SMALLEST = 5e-324


@pytest.fixture(autouse=True)
def subnormal_numbers_remain():
    """A library that gcc links with -ffast-math sets subnormal numbers to zero in the whole
    process.
    """
    yield
    assert SMALLEST * float(len("1")) > 0.0, "a loaded library has changed the arithmetic"


def test_the_page_of_the_control_benchmark_has_the_tables_of_a_result_in_their_units():
    joint = proportional_joint((1,))
    known = [each for each in standard_contenders(joint) if each.name == "feed-forward"]
    narrow = dataclasses.replace(joint, family={"nominal": joint.model})
    for seeds, spread in ((1, 2), r"\|\s[^|–]+\|$"), ((1,), r"\| – \|$"):
        found = compare_controllers(
            narrow, known, find_tasks(("step",)), seeds=seeds, sets_per_gain=8, commissioning_runs=0
        )
        text = "\n".join(control_page.part(found))
        error = found.metric("feed-forward", "step", "rmse").median
        assert (
            "RMS error [deg], models only.\n\n| task | feed-forward |\n|---|---|\n| step |"
            f" {error:.4g} |" in text
        )
        (searched,) = re.findall(r"\| controller \| gains .*\n.*\n(.*)", text)
        assert re.search(spread, searched)
        assert f"0 of {len(seeds)} searches converged" in control_page.convergence(found)
        assert "(not: feed-forward; their scores say as much" in control_page.convergence(found)
        assert found.unfinished == {"feed-forward": len(seeds)}
        assert f"feed-forward ({len(seeds)} of {len(seeds)})" in " ".join(found.chapter().notes)
        ranked = found.ranking_table(Group.MODELS).columns["searches converged"]
        assert ranked.values == [f"0 of {len(seeds)}"]


def test_contenders_of_the_benchmark_are_run_on_some_tasks(tmp_path, capsys):
    """With a scenario file among them, without a search."""
    scenario = str(Path(__file__).resolve().parents[2] / "examples" / "joint_cascade.toml")
    asked = ["--contender", "PID", "--contender", scenario, "--task", "step", "--budget", "0"]
    few = ["--truth-seeds", "35", "--runs", "2", "--out", str(tmp_path / "out"), "--json"]
    found = run_contenders.main([*asked, *few])
    assert found.contenders(Group.MODELS) == ("PID", "joint_cascade")
    content = json.loads(capsys.readouterr().out)["comparison"]
    assert {row["truth"] for row in content["metrics"]} == {"truth 35"}
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for text in ("LuGre", "12-bit encoder", "1e-08 m3/(s Pa)", "weight x 2"):
        assert text in page, text
    with pytest.raises(InputError, match="there is no controller 'PDI'; there are PID, feed-"):
        run_contenders.main(["--contender", "PDI", *few])
    with pytest.raises(InputError, match="--trials needs at least 2 trials and the controller"):
        run_contenders.main([*asked, "--trials", "3", *few])


@pytest.mark.parametrize("states", [3, 6, 8, 10])
def test_the_hand_written_rates_are_those_of_the_plant(states):
    case = runs()[states]
    assert len(case.system.states) == states
    assert rodas4.check_rates(case, compile_system(case.system)) < 1e-12


@pytest.mark.parametrize(("pressure", "position"), [(7e5, 0.06), (5e4, -0.02)])
def test_the_hand_written_rates_are_equal_beyond_the_validity_range(pressure, position):
    """At points where the force is within its limits, so that the extrapolation is used."""
    case = runs()[3]
    y = np.array(
        list(case.system.state_at(pressure=pressure, position=position, speed=0.1).values())
    )
    rates = rodas4.hand_written_rates(case)(np.array([1.0, 0.5]))[0](0.0, y)
    np.testing.assert_allclose(rates, compile_system(case.system).rates(y, [1.0, 0.5]), rtol=1e-12)


def test_different_equations_are_detected():
    case = runs()[3]
    heavier = dataclasses.replace(
        case.system, mechanism=dataclasses.replace(case.system.mechanism, mass=5.001)
    )
    with pytest.raises(AssertionError, match="differ by"):
        rodas4.check_rates(case, compile_system(heavier))


def test_lsoda_computes_the_same_solution():
    case = runs()[3]
    ready = compile_system(case.system)
    reference = rodas4.kernel(case, ready, Rodas4(1e-11))()
    for solve in (rodas4.lsoda, rodas4.odeint_lsoda):
        for rates in (rodas4.hand_written_rates(case), rodas4.machine_code_rates(ready)):
            solution = solve(case, rates, 1e-8)
            assert solution.shape == reference.shape
            assert case.error(solution, reference) < 1e-8


@pytest.mark.skipif(not ode8.compilers(), reason="no C compiler on the path")
@pytest.mark.slow
def test_the_c_code_computes_the_same_steps(tmp_path):
    """Over 0.2 s from a state beyond the validity range of the surface, with valve openings; equal
    to rounding.
    """
    case = runs()[3]
    start = case.system.state_at(pressure=6.5e5, position=0.05)
    short = dataclasses.replace(
        case, initial_state=start, command=Schedule({"discharge": ((0.05, 1.0), (0.15, 0.0))})
    )
    ready = compile_system(case.system)
    segments = short.command.segments(case.system.inputs, 0.0, 0.2)
    times = np.linspace(0.0, 0.2, 21)
    expected = DormandPrince8(ode8.STEP).run(ready, segments, 0.0, short.vector, times).rows
    for library in ode8.compile_libraries(tmp_path).values():
        rows = ode8.make_c_run(short, library, segments)()[:21]
        np.testing.assert_allclose(rows, expected, rtol=1e-11, atol=1e-12)


@pytest.mark.slow
def test_c_numpy_and_lanes_compute_the_same_batch(tmp_path):
    """Over 0.7 s with the opening of a valve: 37 plants, a number that is not a multiple of any
    block size.
    """
    timed = batch.make_variants(tmp_path, 37, 0.7)
    assert any("C, gcc" in name for name in timed) or not ode8.compilers()
    final_states = {name: call() for name, (_, call) in timed.items()}
    parameters = batch.random_parameters(batch.hanging(), 37)
    table = batch.c_parameters(tree.unflatten(batch.hanging(), list(parameters.values())), 37)
    final_states["NumPy"] = batch.run_numpy(table, runs()[3].vector, 0.7)
    batch.check_final_states(final_states, "simulate_batch", runs()[3].nominal)
    table[0, 3] *= 1.0001
    final_states["NumPy"] = batch.run_numpy(table, runs()[3].vector, 0.7)
    with pytest.raises(AssertionError, match="the final states of NumPy and simulate_batch differ"):
        batch.check_final_states(final_states, "simulate_batch", runs()[3].nominal)


@pytest.mark.slow
def test_the_section_of_the_batch_has_its_rows_and_targets():
    section = batch.section(rounds=1, count=16, seconds=0.02)
    assert section.rows[0][:3] == ("simulate_batch (0.02 s simulated)", "16", "1")
    assert any("NumPy" in target.name for target in section.targets)


@pytest.mark.slow
def test_the_section_of_the_environments_has_a_row_for_each_variant(monkeypatch):
    monkeypatch.setattr(environments, "STEPS", 20)
    section = environments.section(rounds=1, count=16)
    names = [row[0] for row in section.rows]
    assert names[0] == "Stepper.step, 10 ms"
    assert ("vector environment, double" in names) == environments.is_installed("gymnasium")
    assert ("mujoco.rollout" in names) == environments.is_installed("mujoco")


def test_lmfit_computes_the_same_coefficients():
    pytest.importorskip("lmfit")
    section = static_fit.section(rounds=1)
    assert all(target.met for target in section.targets)


@pytest.mark.slow
def test_the_section_of_loops_has_a_row_for_each_plant_and_integrator():
    section = loops.section(rounds=1, count=2, duration=1.5)
    assert len(section.rows) == 8
    assert all(float(error) < 1e-4 for row in section.rows for error in row[-2:])
    assert len(section.targets) == 3


@pytest.mark.slow
def test_the_section_of_controllers_has_a_row_for_each_call(monkeypatch):
    monkeypatch.setattr(controllers, "SAMPLES", 20)
    section = controllers.section(rounds=1)
    assert len(section.rows) == 6
    assert len(section.targets) == 5


def test_a_section_and_its_targets_are_printed():
    case = runs()[3]
    times = measure.time_variants(
        {"kernel": rodas4.kernel(case, compile_system(case.system))}, rounds=2
    )
    target = measure.Target("speed", 3.0, 4.0, "x", at_least=True, reason="a reason")
    section = measure.Section(
        "title",
        "text",
        ("what", "time"),
        (("kernel", measure.format_time(times["kernel"].median)),),
        (target,),
    )
    text = run.report([section], 1.0)
    assert "| speed | 3 x | >= 4 x | **missed** |" in text
    assert "Missed: speed. Reason: a reason." in text
    assert "## title" in text


@pytest.mark.skipif("gcc" not in ode8.compilers(), reason="gcc is needed")
def test_the_library_and_gcc_compute_the_same_for_each_width_of_registers():
    section = batch.section_of_widths(rounds=1, count=32, seconds=0.1)
    assert len(section.rows) == len(batch.LEVELS) * 3
    assert [target.limit for target in section.targets] == [1.15, 0.95] * len(batch.LEVELS)
    assert all("-O3 -ffast-math -march=" in target.name for target in section.targets)


@pytest.mark.parametrize("unit", [*measure.SECONDS, *measure.PER_SECOND])
def test_a_time_is_compared_in_yardsticks_so_that_a_slow_machine_has_the_same_targets(
    unit, monkeypatch
):
    """A machine that takes three times as long for everything meets and misses the same."""
    results = []
    for pace in (1.0, 3.0):
        monkeypatch.setattr(measure, "yardstick", lambda pace=pace: pace * measure.NOMINAL)
        change = pace if unit in measure.SECONDS else 1 / pace
        for measured in (0.9, 1.1):
            target = measure.Target("time", measured * change, 1.0, unit)
            results.append((target.met, *target.cells[2:], target.cells[1].split(" = ")[1]))
    assert results[:2] == results[2:]
    assert [met for met, *_ in results[:2]] == [True, False]


def test_the_yardstick_is_a_short_time_that_is_measured():
    assert 1e-8 < measure.yardstick() < 1e-5
    energies = [measure.oscillate(steps)["speed"] ** 2 for steps in (0, 1000)]
    assert energies[0] == 1.0
    assert energies[1] != 1.0


def test_a_new_plant_is_traced_and_compiled_again():
    system = runs()[3].system
    assert new_plant.compile_anew(system).address != compile_system(system).program.address


def test_a_separate_process_runs_the_program():
    startup.run_python([*startup.program(), "list"])
