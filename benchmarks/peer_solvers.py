"""The runs of `filling.py` through other packages, each as a user would have it at its quickest.

A solver is made once for a run; asked for an rtol it gives a call that returns the rows (N, n), everything that can be
done beforehand being done. The absolute tolerance is everywhere rtol times each state's nominal size, and every solver
starts anew, or is told to expect a jump, at each instant of the schedule.
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
from rodas4 import by_hand

from airmuscle.compile.kernels.calls import invoke, pointer
from airmuscle.compile.program import CompiledSystem

Solver = Callable[[float], Callable[[], Array]]
MOST_STEPS = 1_000_000
PADDED, NEWTON = (512, 2048), 1e-2


def pieces(run: Run) -> Iterator[tuple[Array, Array]]:
    """The rows' times of each segment, its beginning among them, and its openings."""
    begin = 0.0
    for end, openings in zip(run.segments.ends.tolist(), run.segments.values, strict=True):
        yield np.linspace(begin, end, round((end - begin) / SPACING) + 1), openings
        begin = end


@numba.njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def rates_into(y: Any, u: Any, c: Any, function: Any, f: Any) -> None:
    """The printed rates, written where the caller says."""
    invoke(function, (pointer(y), pointer(u), pointer(c), pointer(f)))


def sundae_by_hand(run: Run, ready: CompiledSystem) -> Solver:
    """scikit-sundae's CVODE (BDF, dense) with the rates written by hand in scalar Python."""
    under = by_hand(run)

    def function(openings: Array) -> Callable[[float, Array, Array], None]:
        rates = under(openings)[0]

        def into(t: float, y: Array, yp: Array) -> None:
            yp[:] = rates(t, y)

        return into

    return _sundae(run, function)


def sundae_compiled(run: Run, ready: CompiledSystem) -> Solver:
    """scikit-sundae's CVODE with compiled rates: it calls them from Python all the same, there is no other way in."""
    address, held = ready.address["rhs"], ready.precomputed

    def function(openings: Array) -> Callable[[float, Array, Array], None]:
        def into(t: float, y: Array, yp: Array) -> None:
            rates_into(y, openings, held, address, yp)

        return into

    return _sundae(run, function)


def _sundae(run: Run, function: Callable[[Array], Callable[[float, Array, Array], None]]) -> Solver:
    from sksundae.cvode import CVODE

    def at(rtol: float) -> Callable[[], Array]:
        atol = rtol * run.nominal
        solvers = [
            (CVODE(function(openings), rtol=rtol, atol=atol, max_num_steps=MOST_STEPS), times)
            for times, openings in pieces(run)
        ]

        def call() -> Array:
            rows = [run.vector[None]]
            for solver, times in solvers:
                rows.append(solver.solve(times, rows[-1][-1]).y[1:])
            return np.concatenate(rows)

        return call

    return at


def casadi_cvodes(run: Run, ready: CompiledSystem, **options: Any) -> Solver:
    """CasADi's CVODES on the expressions that our machine code is printed from, constants folded, states scaled by
    their nominal sizes, with its own exact Jacobian."""
    import casadi

    traced, size = ready.program.traced, run.nominal
    z = casadi.SX.sym("z", size.size)
    rates = casadi.substitute(traced.f, casadi.vertcat(traced.x, traced.p), casadi.vertcat(size * z, ready.parameters))
    equations = {"x": z, "u": traced.u, "ode": rates / size}

    def at(rtol: float) -> Callable[[], Array]:
        settings = {"reltol": rtol, "abstol": rtol, "max_num_steps": MOST_STEPS, **options}
        made: dict[int, Any] = {}
        for times, _ in pieces(run):
            if times.size not in made:
                grid = (SPACING * np.arange(1, times.size)).tolist()
                made[times.size] = casadi.integrator("run", "cvodes", equations, 0.0, grid, settings)
        parts = [(made[times.size], openings) for times, openings in pieces(run)]

        def call() -> Array:
            rows = [(run.vector / size)[None]]
            for solver, openings in parts:
                rows.append(np.asarray(solver(x0=rows[-1][-1], u=openings)["xf"]).T)
            return np.concatenate(rows) * size

        return call

    return at


def casadi_cvodes_jit(run: Run, ready: CompiledSystem) -> Solver:
    """The same with its functions compiled by gcc, which CasADi does in the folder that the process is in."""
    flags = {"flags": ["-O3", "-march=native"], "compiler": "gcc", "verbose": False}
    solver = casadi_cvodes(run, ready, jit=True, compiler="shell", jit_options=flags)

    def at(rtol: float) -> Callable[[], Array]:
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            return solver(rtol)

    return at


def diffrax_kvaerno5(run: Run, ready: CompiledSystem) -> Solver:
    """diffrax' Kvaerno5 on the library's laws with JAX arrays, jitted, forward only.

    A solve for each segment: with `jump_ts` the step of a long rest meets the opening of a valve, and the solver is
    left with states that are infinite. Times are padded to two lengths, so that no more is compiled. Newton's
    iterations to a hundredth instead of to rtol, and XLA on one thread, each make it two to five times quicker.
    """
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")
    import diffrax
    import jax
    from jax import numpy as jnp

    jax.config.update("jax_enable_x64", True)
    system, names, nominal = run.system, [s.name for s in run.system.states], jnp.asarray(run.nominal)

    def rates(t: Any, y: Any, u: Any) -> Any:
        found = system.rates(dict(zip(names, y, strict=True)), dict(zip(system.inputs, u, strict=True)))
        return jnp.stack([jnp.asarray(found[name], dtype=float) for name in names])

    method = diffrax.Kvaerno5(root_finder=diffrax.VeryChord(rtol=NEWTON, atol=NEWTON * nominal))

    @jax.jit
    def segment(y: Any, u: Any, times: Any, rtol: Any) -> Any:
        return diffrax.diffeqsolve(
            diffrax.ODETerm(rates), method, times[0], times[-1], 1e-5, y, args=u,
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol * nominal), max_steps=MOST_STEPS,
            saveat=diffrax.SaveAt(ts=times), adjoint=diffrax.ForwardMode(), throw=False,
        ).ys  # fmt: skip

    def padded(times: Array) -> Any:
        length = next(n for n in PADDED if n >= times.size)
        return jnp.asarray(np.append(times, np.full(length - times.size, times[-1])))

    parts = [(padded(times), times.size, jnp.asarray(openings)) for times, openings in pieces(run)]

    def at(rtol: float) -> Callable[[], Array]:
        def call() -> Array:
            y, rows = jnp.asarray(run.vector), [run.vector[None]]
            for times, size, openings in parts:
                found = segment(y, openings, times, rtol)
                y = found[-1]
                rows.append(np.asarray(found)[1:size])
            return np.concatenate(rows)

        return call

    return at


def control_response(run: Run, ready: CompiledSystem) -> Solver:
    """python-control's input_output_response, which is solve_ivp's LSODA behind an interpolation of the inputs; the
    rates written by hand, a system for each set of openings so that they need not look at their inputs."""
    import control

    under = by_hand(run)

    def system(openings: Array) -> Any:
        rates = under(openings)[0]
        return control.nlsys(lambda t, x, u, params: rates(t, x), None, inputs=0, states=run.vector.size)

    def at(rtol: float) -> Callable[[], Array]:
        settings = {"rtol": rtol, "atol": rtol * run.nominal}
        parts = [(system(openings), times) for times, openings in pieces(run)]

        def call() -> Array:
            rows = [run.vector[None]]
            for part, times in parts:
                found = control.input_output_response(
                    part, times[[0, -1]], 0.0, rows[-1][-1], solve_ivp_method="LSODA", solve_ivp_kwargs=settings,
                    evaluation_times=times, return_states=True,
                )  # fmt: skip
                rows.append(found.states.T[1:])
            return np.concatenate(rows)

        return call

    return at
