"""Solvers of other packages for the runs of `filling.py`, each in its fastest configuration.

A solver is created once per run. For an rtol it returns a function that computes the rows (N, n);
all preparation is done before. The absolute tolerance is always rtol times the nominal value of
each state, and every solver restarts at each switching time of the schedule.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

import numba
import numpy as np
from filling import SPACING, Array, Run
from rodas4 import hand_written_rates

from airmuscle.control.estimation.predictive_program import casadi_operations
from airmuscle.core import nodes
from airmuscle.engine.compile.kernels.calls import invoke, pointer
from airmuscle.engine.compile.program import CompiledSystem

Solver = Callable[[float], Callable[[], Array]]
MAX_STEPS = 1_000_000
PADDED = (512, 2048)
NEWTON = 1e-2


def segments_of(run: Run) -> Iterator[tuple[Array, Array]]:
    """The output times of each segment, including its start, and its valve openings."""
    begin = 0.0
    for end, openings in zip(run.segments.ends.tolist(), run.segments.values, strict=True):
        yield np.linspace(begin, end, round((end - begin) / SPACING) + 1), openings
        begin = end


@numba.njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def rates_into(y: Any, u: Any, c: Any, function: Any, f: Any) -> None:
    """The compiled rates, written to the array `f`."""
    invoke(function, (pointer(y), pointer(u), pointer(c), pointer(f)))


def sundae_by_hand(run: Run, ready: CompiledSystem) -> Solver:
    """CVODE of scikit-sundae (BDF, dense) with hand-written rates in scalar Python."""
    under = hand_written_rates(run)

    def function(openings: Array) -> Callable[[float, Array, Array], None]:
        rates = under(openings)[0]

        def into(t: float, y: Array, yp: Array) -> None:
            yp[:] = rates(t, y)

        return into

    return _sundae(run, function)


def sundae_compiled(run: Run, ready: CompiledSystem) -> Solver:
    """CVODE of scikit-sundae with compiled rates, which it can only call from Python."""
    address = ready.address["rhs"]
    precomputed = ready.precomputed

    def function(openings: Array) -> Callable[[float, Array, Array], None]:
        def into(t: float, y: Array, yp: Array) -> None:
            rates_into(y, openings, precomputed, address, yp)

        return into

    return _sundae(run, function)


def _sundae(run: Run, function: Callable[[Array], Callable[[float, Array, Array], None]]) -> Solver:
    from sksundae.cvode import CVODE

    def at(rtol: float) -> Callable[[], Array]:
        atol = rtol * run.nominal
        solvers = [
            (CVODE(function(openings), rtol=rtol, atol=atol, max_num_steps=MAX_STEPS), times)
            for times, openings in segments_of(run)
        ]

        def call() -> Array:
            rows = [run.vector[None]]
            for solver, times in solvers:
                rows.append(solver.solve(times, rows[-1][-1]).y[1:])
            return np.concatenate(rows)

        return call

    return at


def casadi_cvodes(run: Run, ready: CompiledSystem, **options: Any) -> Solver:
    """CVODES of CasADi on the expressions from which the library generates machine code, with
    parameters substituted, states scaled by their nominal values, and an exact Jacobian."""
    import casadi

    traced = ready.program.traced
    size = run.nominal
    z = casadi.SX.sym("z", size.size)
    u = casadi.SX.sym("u", len(traced.u))
    values = {id(symbol): size[i] * z[i] for i, symbol in enumerate(traced.x)}
    values |= {id(symbol): u[i] for i, symbol in enumerate(traced.u)}
    values |= zip(map(id, traced.p), ready.parameters.tolist(), strict=True)
    rates = casadi.vertcat(*nodes.replayed(traced.f, values, casadi_operations()))
    equations = {"x": z, "u": u, "ode": rates / size}

    def at(rtol: float) -> Callable[[], Array]:
        settings = {"reltol": rtol, "abstol": rtol, "max_num_steps": MAX_STEPS, **options}
        integrators: dict[int, Any] = {}
        for times, _ in segments_of(run):
            if times.size not in integrators:
                grid = (SPACING * np.arange(1, times.size)).tolist()
                integrators[times.size] = casadi.integrator(
                    "run", "cvodes", equations, 0.0, grid, settings
                )
        parts = [(integrators[times.size], openings) for times, openings in segments_of(run)]

        def call() -> Array:
            rows = [(run.vector / size)[None]]
            for solver, openings in parts:
                rows.append(np.asarray(solver(x0=rows[-1][-1], u=openings)["xf"]).T)
            return np.concatenate(rows) * size

        return call

    return at


def casadi_cvodes_jit(run: Run, ready: CompiledSystem) -> Solver:
    """The same with functions compiled by gcc, which CasADi does in the working directory."""
    flags = {"flags": ["-O3", "-march=native"], "compiler": "gcc", "verbose": False}
    solver = casadi_cvodes(run, ready, jit=True, compiler="shell", jit_options=flags)

    def at(rtol: float) -> Callable[[], Array]:
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            return solver(rtol)

    return at


def diffrax_kvaerno5(run: Run, ready: CompiledSystem) -> Solver:
    """Kvaerno5 of diffrax on the library's laws with JAX arrays, compiled by jit, forward mode
    only.

    One solve per segment: with `jump_ts`, the long steps of a state of rest reach the opening of a
    valve, and the states become infinite. Output times are padded to two lengths, so that only two
    functions are compiled. A tolerance of 0.01 of the Newton iterations instead of rtol, and XLA
    with one thread, each reduce the time by a factor of two to five.
    """
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")
    import diffrax
    import jax
    from jax import numpy as jnp

    jax.config.update("jax_enable_x64", True)
    system, names, nominal = (
        run.system,
        [s.name for s in run.system.states],
        jnp.asarray(run.nominal),
    )

    def rates(t: Any, y: Any, u: Any) -> Any:
        values = system.rates(
            dict(zip(names, y, strict=True)), dict(zip(system.inputs, u, strict=True))
        )
        return jnp.stack([jnp.asarray(values[name], dtype=float) for name in names])

    method = diffrax.Kvaerno5(root_finder=diffrax.VeryChord(rtol=NEWTON, atol=NEWTON * nominal))

    @jax.jit
    def segment(y: Any, u: Any, times: Any, rtol: Any) -> Any:
        return diffrax.diffeqsolve(
            diffrax.ODETerm(rates),
            method,
            times[0],
            times[-1],
            1e-5,
            y,
            args=u,
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol * nominal),
            max_steps=MAX_STEPS,
            saveat=diffrax.SaveAt(ts=times),
            adjoint=diffrax.ForwardMode(),
            throw=False,
        ).ys

    def padded(times: Array) -> Any:
        length = next(n for n in PADDED if n >= times.size)
        return jnp.asarray(np.append(times, np.full(length - times.size, times[-1])))

    parts = [
        (padded(times), times.size, jnp.asarray(openings)) for times, openings in segments_of(run)
    ]

    def at(rtol: float) -> Callable[[], Array]:
        def call() -> Array:
            y = jnp.asarray(run.vector)
            rows = [run.vector[None]]
            for times, size, openings in parts:
                states = segment(y, openings, times, rtol)
                y = states[-1]
                rows.append(np.asarray(states)[1:size])
            return np.concatenate(rows)

        return call

    return at


def control_response(run: Run, ready: CompiledSystem) -> Solver:
    """input_output_response of python-control: LSODA of solve_ivp with interpolated inputs;
    hand-written rates, with one system for each set of valve openings, so that the rates do not
    depend on inputs."""
    import control

    under = hand_written_rates(run)

    def system(openings: Array) -> Any:
        rates = under(openings)[0]
        return control.nlsys(
            lambda t, x, u, params: rates(t, x), None, inputs=0, states=run.vector.size
        )

    def at(rtol: float) -> Callable[[], Array]:
        settings = {"rtol": rtol, "atol": rtol * run.nominal}
        parts = [(system(openings), times) for times, openings in segments_of(run)]

        def call() -> Array:
            rows = [run.vector[None]]
            for part, times in parts:
                response = control.input_output_response(
                    part,
                    times[[0, -1]],
                    0.0,
                    rows[-1][-1],
                    solve_ivp_method="LSODA",
                    solve_ivp_kwargs=settings,
                    evaluation_times=times,
                    return_states=True,
                )
                rows.append(response.states.T[1:])
            return np.concatenate(rows)

        return call

    return at
