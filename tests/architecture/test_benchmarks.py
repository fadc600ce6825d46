"""The benchmarks compare like with like: the opponents compute the same equations, and every script runs.

No time is asserted here; times depend on the machine and stand in benchmarks/RESULTS.md.
"""

from __future__ import annotations

import dataclasses

import batch
import measure
import new_plant
import numpy as np
import ode8
import pytest
import rodas4
import run
import startup
import static_fit
from filling import runs

from airmuscle.compile.program import compile_system
from airmuscle.control.inputs import Schedule
from airmuscle.core import tree
from airmuscle.simulation.integrators import DormandPrince8, Rodas4


@pytest.mark.parametrize("states", [3, 6, 8, 10])
def test_the_rates_written_by_hand_are_those_of_the_plant(states):
    case = runs()[states]
    assert len(case.system.states) == states
    assert rodas4.refuse_other_equations(case, compile_system(case.system)) < 1e-12


@pytest.mark.parametrize(("pressure", "position"), [(7e5, 0.06), (5e4, -0.02)])
def test_so_are_they_beyond_the_box_of_the_surface(pressure, position):
    """Where the force is also within its clamp, so that the tangent counts."""
    case = runs()[3]
    y = np.array(list(case.system.state_at(pressure=pressure, position=position, speed=0.1).values()))
    found = rodas4.by_hand(case)(np.array([1.0, 0.5]))[0](0.0, y)
    np.testing.assert_allclose(found, compile_system(case.system).rates(y, [1.0, 0.5]), rtol=1e-12)


def test_other_equations_are_refused():
    case = runs()[3]
    heavier = dataclasses.replace(case.system, mechanism=dataclasses.replace(case.system.mechanism, mass=5.001))
    with pytest.raises(AssertionError, match="differ by"):
        rodas4.refuse_other_equations(case, compile_system(heavier))


def test_lsoda_with_rates_by_hand_finds_the_same_course():
    case = runs()[3]
    ready = compile_system(case.system)
    reference = rodas4.kernel(case, ready, Rodas4(1e-11))()
    for solve in (rodas4.lsoda, rodas4.odeint_lsoda):
        for rates in (rodas4.by_hand(case), rodas4.by_machine(ready)):
            found = solve(case, rates, 1e-8)
            assert found.shape == reference.shape
            assert case.error(found, reference) < 1e-8


@pytest.mark.skipif(not ode8.compilers(), reason="no C compiler on the path")
def test_the_c_computes_the_same_steps(tmp_path):
    """Over 0.2 s from beyond the validity range of the surface, within which valves open; equal to rounding."""
    case = runs()[3]
    start = case.system.state_at(pressure=6.5e5, position=0.05)
    short = dataclasses.replace(case, start=start, command=Schedule({"discharge": ((0.05, 1.0), (0.15, 0.0))}))
    ready, segments = compile_system(case.system), short.command.segments(case.system.inputs, 0.0, 0.2)
    times = np.linspace(0.0, 0.2, 21)
    expected = DormandPrince8(ode8.STEP).run(ready, segments, 0.0, short.vector, times).rows
    for library in ode8.compiled(tmp_path).values():
        found = ode8.in_c(short, library, segments)()[:21]
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-12)


def test_c_numpy_and_lanes_compute_the_same_batch(tmp_path):
    """Over 0.7 s, within which a valve opens: 37 plants, whose number is no multiple of any block."""
    timed = batch.variants(tmp_path, 37, 0.7)
    assert any("C, gcc" in name for name in timed) or not ode8.compilers()
    ends = {name: call() for name, (_, call) in timed.items()}
    parameters = batch.varied(batch.hanging(), 37)
    table = batch.constants(tree.unflatten(batch.hanging(), list(parameters.values())), 37)
    ends["NumPy"] = batch.in_numpy(table, runs()[3].vector, 0.7)
    batch.refuse_other_ends(ends, "simulate_batch", runs()[3].nominal)
    table[0, 3] *= 1.0001
    ends["NumPy"] = batch.in_numpy(table, runs()[3].vector, 0.7)
    with pytest.raises(AssertionError, match="NumPy ends"):
        batch.refuse_other_ends(ends, "simulate_batch", runs()[3].nominal)


def test_the_section_of_the_batch_holds_its_rows_and_bars():
    section = batch.section(rounds=1, count=16, seconds=0.02)
    assert section.rows[0][:3] == ("simulate_batch (0.02 s simulated)", "16", "1")
    assert any("NumPy" in bar.what for bar in section.bars)


def test_lmfit_finds_the_same_coefficients():
    pytest.importorskip("lmfit")
    section = static_fit.section(rounds=1)
    assert all(bar.held for bar in section.bars)


def test_a_section_and_its_bars_are_printed():
    case = runs()[3]
    times = measure.interleaved({"kernel": rodas4.kernel(case, compile_system(case.system))}, rounds=2)
    bar = measure.Bar("speed", 3.0, 4.0, "x", at_least=True, why="a reason")
    section = measure.Section(
        "title", "text", ("what", "time"), (("kernel", measure.of_time(times["kernel"].median)),), (bar,)
    )
    text = run.report([section], 1.0)
    assert "| speed | 3 x | >= 4 x | **missed** |" in text
    assert "Missed: speed. Why: a reason." in text
    assert "## title" in text


def test_a_new_plant_is_traced_and_compiled_anew():
    system = runs()[3].system
    assert new_plant.fresh(system).address != compile_system(system).program.address


def test_a_process_of_its_own_runs_the_program():
    startup.process([*startup.command(), "list"])
