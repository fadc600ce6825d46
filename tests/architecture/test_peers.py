"""The benchmarks' peers are given the same equations, and one that is not installed is left out with a line.

No time is asserted here. A peer that is not installed is not tested here either.
"""

from __future__ import annotations

import dataclasses

import components
import derivative
import growth
import memory
import mujoco_peer
import numpy as np
import ode8
import peer_solvers
import peers
import pytest
import rodas4
from filling import lifts, runs

from airmuscle.compile.program import compile_system
from airmuscle.control.inputs import Schedule
from airmuscle.plant.plant import Plant
from airmuscle.simulation.integrators import DormandPrince8, Rodas4, RungeKutta4


def reference(run):
    return rodas4.kernel(run, compile_system(run.system), Rodas4(1e-11))()


@pytest.mark.parametrize("states", [3, 8])
@pytest.mark.parametrize(
    ("module", "solver"),
    [
        ("sksundae", peer_solvers.sundae_by_hand),
        ("sksundae", peer_solvers.sundae_compiled),
        ("casadi", peer_solvers.casadi_cvodes),
        ("control", peer_solvers.control_response),
    ],
)
def test_a_peer_finds_the_same_course(module, solver, states):
    pytest.importorskip(module)
    run = runs()[states]
    found = solver(run, compile_system(run.system))(1e-8)()
    assert found.shape == (2501, states)
    assert run.error(found, reference(run)) < 1e-8


@pytest.mark.skipif("gcc" not in ode8.compilers(), reason="no gcc on the path")
def test_so_does_casadi_with_gcc_and_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = runs()[3]
    call = peer_solvers.casadi_cvodes_jit(run, compile_system(run.system))(1e-8)
    assert not list(tmp_path.iterdir())  # while the solver lives, for a process that is killed cleans nothing up
    assert run.error(call(), reference(run)) < 1e-8


@pytest.mark.slow
def test_so_does_diffrax():
    pytest.importorskip("diffrax")
    run = runs()[3]
    found = peer_solvers.diffrax_kvaerno5(run, compile_system(run.system))(1e-8)()
    assert run.error(found, reference(run)) < 1e-7


def test_a_peer_that_is_not_installed_is_left_out_with_a_line(monkeypatch):
    casadi = next(peer for peer in peers.PEERS if peer.name == "CasADi CVODES")
    nobody = dataclasses.replace(casadi, name="nobody's solver", module="nobody_has_this", package="nobody-has-this")
    monkeypatch.setattr(peers, "PEERS", (casadi, nobody))
    monkeypatch.setattr(peers, "runs", lambda: {3: runs()[3]})
    section = peers.section(rounds=1)
    assert [row[1] for row in section.rows] == ["Rodas4, kernel", "CasADi CVODES"]
    assert section.text.endswith("nobody-has-this is not installed and left out: pip install nobody-has-this.")


def test_so_is_mujoco(monkeypatch):
    monkeypatch.setattr(mujoco_peer.importlib.util, "find_spec", lambda name: None)
    section = mujoco_peer.section(rounds=1)
    assert section.rows == section.bars == ()
    assert section.text == "mujoco is not installed and left out: pip install mujoco."


def test_the_loosest_tolerance_serves_and_so_does_the_next():
    """A tolerance that serves by luck, between two that do not, is not taken."""
    run = runs()[3]
    good = reference(run)
    lucky = {1e-4: 0.0, 3e-5: 1.0, 1e-5: 1.0, 3e-6: 0.0, 1e-6: 0.0}
    assert rodas4.loosest(run, lambda rtol: good + lucky.get(rtol, 0.0), good) == 3e-6
    assert rodas4.loosest(run, lambda rtol: good * np.nan, good) == rodas4.SERIES[-1]


@pytest.mark.skipif(not ode8.compilers(), reason="no C compiler on the path")
@pytest.mark.parametrize("muscles", [2, pytest.param(6, marks=pytest.mark.slow)])
def test_the_c_of_several_muscles_computes_the_same_steps(tmp_path, muscles):
    run = lifts(muscles)
    start = run.system.state_at(pressure=tuple(5e5 + 4e4 * i for i in range(muscles)), position=0.05)
    opened = {f"{p}discharge": ((0.02 + 0.01 * i, 1.0), (0.09, 0.0)) for i, p in enumerate(run.system.prefixes)}
    run = dataclasses.replace(run, start=start, command=Schedule(opened))
    ready, segments = compile_system(run.system), run.command.segments(run.system.inputs, 0.0, 0.1)
    expected = DormandPrince8(ode8.STEP).run(ready, segments, 0.0, run.vector, np.linspace(0.0, 0.1, 11)).rows
    for library in ode8.compiled(tmp_path, muscles).values():
        np.testing.assert_allclose(ode8.in_c(run, library, segments)(), expected, rtol=1e-11, atol=1e-12)


@pytest.mark.skipif(bool(mujoco_peer.absent()), reason="no MuJoCo or no C compiler")
def test_mujoco_takes_the_same_steps_of_rk4(tmp_path):
    """At 1 ms, so that a step's error would show; MuJoCo's order of operations is its own, hence 1e-9."""
    run = lifts(2)
    found = mujoco_peer.in_mujoco(run, mujoco_peer.callbacks(tmp_path, 2), 1e-3)()
    course = RungeKutta4(1e-3).run(compile_system(run.system), run.segments, 0.0, run.vector, run.times)
    assert run.error(found, course.rows) < 1e-9


def test_a_plant_of_components_has_the_rates_written_out():
    compared = [len(written.system.states) for put_together, written in components.pairs() if written]
    assert compared == [6, 10]
    for put_together, written in components.pairs():
        if written:
            both = compile_system(written.system), compile_system(put_together.system)
            assert components.refuse_other_rates(*both, written.start) < 1e-12


def test_other_rates_are_refused():
    put_together, written = components.pairs()[1]
    assert isinstance(put_together.system, Plant)
    stiffer = dataclasses.replace(
        put_together.system, mechanism=dataclasses.replace(put_together.system.mechanism, friction=0.201)
    )
    with pytest.raises(AssertionError, match="differ by"):
        components.refuse_other_rates(compile_system(written.system), compile_system(stiffer), written.start)


def test_the_joint_with_proportional_valves_moves_as_the_other():
    """A spool of second order lets through as much in a pulse as one of first order, a little later: half a degree."""
    (_, _), (ten, _), (twelve, _) = components.pairs()
    places = [[s.name for s in run.system.states].index("angle") for run in (ten, twelve)]
    angles = [
        rodas4.kernel(run, compile_system(run.system))()[[900, -1], place]
        for run, place in zip((ten, twelve), places, strict=True)
    ]
    assert len(twelve.system.states) == 12
    assert np.abs(np.diff(angles[0])) > np.radians(2.0)
    np.testing.assert_allclose(*angles, atol=np.radians(0.5))


def test_the_derivative_is_that_of_the_state_given():
    """The loop moves the state by less than rounding, so that the last call is at the state of the first."""
    run = lifts(2)
    ready = compile_system(run.system)
    start = run.system.state_at(pressure=3e5, position=0.03, speed=0.1)
    expected = ready.rates([start[s.name] for s in run.system.states], [0.5] * 4)
    np.testing.assert_allclose(derivative.calls(ready, start, 10)(), expected, rtol=1e-12)


def test_both_arms_have_24_muscles():
    assert [len(plant.states) for plant in (derivative.many_muscles(), derivative.plain_muscles())] == [26, 26]


def test_pulses_of_a_carrier_are_as_wide_as_told():
    plant = lifts(1).system
    segments = growth.pulsed(plant, 50.0).segments(plant.inputs, 0.0, growth.PULSED)
    lengths = np.diff(np.append(0.0, segments.ends))
    np.testing.assert_allclose(lengths @ segments.values / growth.PULSED, [0.2, 0.2], rtol=1e-9)
    assert lengths.size > 4 * 50 * growth.PULSED / 2


def test_a_tighter_tolerance_takes_more_steps_and_errs_less():
    rows = growth.rows_of(
        [growth.Case("tolerance", "p", f"{r:.0e}", lifts(1), lifts(1).segments, 25.0, r) for r in (1e-4, 1e-7)], 1, {}
    )
    coarse, fine = rows
    assert float(fine[4]) > 3 * float(coarse[4])
    assert float(fine[6]) < 1e-2 * float(coarse[6])


def test_memory_only_grows():
    section = memory.section()
    peaks = [float(row[1]) for row in section.rows]
    assert peaks == sorted(peaks)
    assert not section.rows or len(peaks) == len(memory.TASKS)
