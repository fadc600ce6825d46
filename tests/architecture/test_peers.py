"""Benchmarks of other packages: they solve the same equations, and a package that is not installed
is omitted.

No times are asserted. Packages that are not installed are not tested.
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
from filling import lifting_run, runs

from airmuscle.engine import DormandPrince8, Rodas4, RungeKutta4, Schedule
from airmuscle.engine.compile import compile_system
from airmuscle.physics import Plant


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
def test_a_peer_computes_the_same_solution(module, solver, states):
    pytest.importorskip(module)
    run = runs()[states]
    solution = solver(run, compile_system(run.system))(1e-8)()
    assert solution.shape == (2501, states)
    assert run.error(solution, reference(run)) < 1e-8


@pytest.mark.skipif("gcc" not in ode8.compilers(), reason="no gcc on the path")
def test_casadi_with_gcc_computes_the_same_solution_and_leaves_no_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = runs()[3]
    call = peer_solvers.casadi_cvodes_jit(run, compile_system(run.system))(1e-8)
    assert not list(
        tmp_path.iterdir()
    )  # even while the solver exists: a process that is killed does not clean up
    assert run.error(call(), reference(run)) < 1e-8


@pytest.mark.slow
def test_diffrax_computes_the_same_solution():
    pytest.importorskip("diffrax")
    run = runs()[3]
    solution = peer_solvers.diffrax_kvaerno5(run, compile_system(run.system))(1e-8)()
    assert run.error(solution, reference(run)) < 1e-7


def test_a_peer_that_is_not_installed_is_omitted_with_a_note(monkeypatch):
    casadi = next(peer for peer in peers.PEERS if peer.name == "CasADi CVODES")
    missing = dataclasses.replace(
        casadi, name="missing solver", module="not_installed", package="not-installed"
    )
    monkeypatch.setattr(peers, "PEERS", (casadi, missing))
    monkeypatch.setattr(peers, "runs", lambda: {3: runs()[3]})
    section = peers.section(rounds=1)
    assert [row[1] for row in section.rows] == ["Rodas4, kernel", "CasADi CVODES"]
    assert section.text.endswith(
        "not-installed is not installed and is omitted: pip install not-installed."
    )


def test_mujoco_is_omitted_if_it_is_not_installed(monkeypatch):
    monkeypatch.setattr(mujoco_peer.importlib.util, "find_spec", lambda name: None)
    section = mujoco_peer.section(rounds=1)
    assert section.rows == section.targets == ()
    assert section.text == "Omitted, because mujoco is not installed: pip install mujoco."


def test_the_loosest_tolerance_is_sufficient_and_so_is_the_next():
    """A tolerance that is sufficient by coincidence, between two that are not, is rejected."""
    run = runs()[3]
    solution = reference(run)
    errors = {1e-4: 0.0, 3e-5: 1.0, 1e-5: 1.0, 3e-6: 0.0, 1e-6: 0.0}
    assert (
        rodas4.loosest_tolerance(run, lambda rtol: solution + errors.get(rtol, 0.0), solution)
        == 3e-6
    )
    assert (
        rodas4.loosest_tolerance(run, lambda rtol: solution * np.nan, solution) == rodas4.SERIES[-1]
    )


@pytest.mark.skipif(not ode8.compilers(), reason="no C compiler on the path")
@pytest.mark.parametrize("muscles", [2, pytest.param(6, marks=pytest.mark.slow)])
@pytest.mark.slow
def test_the_c_code_for_several_muscles_computes_the_same_steps(tmp_path, muscles):
    run = lifting_run(muscles)
    start = run.system.state_at(
        pressure=tuple(5e5 + 4e4 * i for i in range(muscles)), position=0.05
    )
    opened = {
        f"{p}discharge": ((0.02 + 0.01 * i, 1.0), (0.09, 0.0))
        for i, p in enumerate(run.system.prefixes)
    }
    run = dataclasses.replace(run, initial_state=start, command=Schedule(opened))
    ready = compile_system(run.system)
    segments = run.command.segments(run.system.inputs, 0.0, 0.1)
    expected = (
        DormandPrince8(ode8.STEP)
        .run(ready, segments, 0.0, run.vector, np.linspace(0.0, 0.1, 11))
        .rows
    )
    for library in ode8.compile_libraries(tmp_path, muscles).values():
        np.testing.assert_allclose(
            ode8.make_c_run(run, library, segments)(), expected, rtol=1e-11, atol=1e-12
        )


@pytest.mark.skipif(bool(mujoco_peer.missing_note()), reason="no MuJoCo or no C compiler")
def test_mujoco_takes_the_same_steps_of_rk4(tmp_path):
    """At 1 ms, so that the error of a step is visible; the order of operations differs, hence
    1e-9.
    """
    run = lifting_run(2)
    rows = mujoco_peer.make_mujoco_run(run, mujoco_peer.compile_callbacks(tmp_path, 2), 1e-3)()
    expected = RungeKutta4(1e-3).run(
        compile_system(run.system), run.segments, 0.0, run.vector, run.times
    )
    assert run.error(rows, expected.rows) < 1e-9


def test_a_plant_of_components_has_the_rates_of_the_single_system():
    compared = [len(single.system.states) for composed, single in components.pairs() if single]
    assert compared == [6, 10]
    for composed, single in components.pairs():
        if single:
            both = compile_system(single.system), compile_system(composed.system)
            assert components.check_rates(*both, single.initial_state) < 1e-12


def test_different_rates_are_detected():
    composed, single = components.pairs()[1]
    assert isinstance(composed.system, Plant)
    stiffer = dataclasses.replace(
        composed.system, mechanism=dataclasses.replace(composed.system.mechanism, friction=0.201)
    )
    with pytest.raises(AssertionError, match="differ by"):
        components.check_rates(
            compile_system(single.system), compile_system(stiffer), single.initial_state
        )


def test_the_joint_with_proportional_valves_has_the_same_motion():
    """The flow of a pulse through a second-order spool equals that of a first-order one with a
    delay: 0.5 degrees.
    """
    (_, _), (ten, _), (twelve, _) = components.pairs()
    columns = [[s.name for s in run.system.states].index("angle") for run in (ten, twelve)]
    angles = [
        rodas4.kernel(run, compile_system(run.system))()[[900, -1], column]
        for run, column in zip((ten, twelve), columns, strict=True)
    ]
    assert len(twelve.system.states) == 12
    assert np.abs(np.diff(angles[0])) > np.radians(2.0)
    np.testing.assert_allclose(*angles, atol=np.radians(0.5))


def test_the_derivative_is_that_of_the_given_state():
    """The loop changes the state by less than rounding, so that all calls use the same state."""
    run = lifting_run(2)
    ready = compile_system(run.system)
    start = run.system.state_at(pressure=3e5, position=0.03, speed=0.1)
    expected = ready.rates([start[s.name] for s in run.system.states], [0.5] * 4)
    np.testing.assert_allclose(derivative.make_calls(ready, start, 10)(), expected, rtol=1e-12)


def test_both_plants_have_24_muscles():
    assert [
        len(plant.states)
        for plant in (derivative.many_muscles(), derivative.chou_hannaford_muscles())
    ] == [26, 26]


def test_pwm_pulses_have_the_commanded_width():
    plant = lifting_run(1).system
    segments = growth.pwm_command(plant, 50.0).segments(plant.inputs, 0.0, growth.PULSED)
    lengths = np.diff(np.append(0.0, segments.ends))
    np.testing.assert_allclose(lengths @ segments.values / growth.PULSED, [0.2, 0.2], rtol=1e-9)
    assert lengths.size > 4 * 50 * growth.PULSED / 2


def test_a_tighter_tolerance_needs_more_steps_and_has_a_smaller_error():
    rows = growth.measure_cases(
        [
            growth.Case(
                "tolerance", "p", f"{r:.0e}", lifting_run(1), lifting_run(1).segments, 25.0, r
            )
            for r in (1e-4, 1e-7)
        ],
        1,
        {},
    )
    coarse, fine = rows
    assert float(fine[4]) > 3 * float(coarse[4])
    assert float(fine[6]) < 1e-2 * float(coarse[6])


@pytest.mark.slow
def test_peak_memory_does_not_decrease():
    section = memory.section()
    peaks = [float(row[1]) for row in section.rows]
    assert peaks == sorted(peaks)
    assert not section.rows or len(peaks) == len(memory.TASKS)
