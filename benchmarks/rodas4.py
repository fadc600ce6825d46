"""25 s of filling and discharge: Rodas4 compared with LSODA of SciPy, with hand-written and
compiled rates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from filling import DURATION, SPACING, Array, Run, runs
from measure import Section, Target, Times, format_time, print_section, time_variants
from scalar_rates import Rates, hill, six_states, ten_states
from several_rates import hanging_rates

import airmuscle as am
from airmuscle.engine.compile.kernels.calls import invoke, pointer
from airmuscle.engine.compile.program import CompiledSystem, compile_system

RTOL = 1e-6
HAND_WRITTEN: dict[int, Callable[[Any], Callable[[Sequence[float]], Rates]]] = {
    3: hill,
    6: six_states,
    8: hanging_rates,
    10: ten_states,
}
HEADER = ("states", "variant", "median", "minimum", "ratio to Rodas4", "maximum error [m]")
TEXT = (
    "2501 rows, 10 ms apart; rtol 1e-6 and atol 1e-6 times the nominal value of each state, unless"
    " the row states another value. The reference is Rodas4 at rtol 1e-11; the first row for each"
    " plant is its difference from LSODA at rtol 1e-12 with hand-written rates. `solve_ivp` is the"
    " present interface of SciPy, to which the target refers, `odeint` the older one. Rows with"
    " another rtol use the loosest of a series with an error of at most 1e-7 m: equal accuracy."
)
SERIES = (1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8)
MAX_ERROR = 1e-7
"""Target: maximum error of the displacement [m]."""
REASON = (
    "the hand-written rates skip closed valves, choked flow and the extrapolation beyond the"
    " validity range, so that an evaluation in Python takes 2 to 5 us; LSODA needs 1100 to 5400 of"
    " them, and most of the time is spent in `solve_ivp` itself. Rodas4 takes 450 to 900 steps of"
    " 0.3 to 0.6 us each; a stage is one chain of dependent operations, whose latency is the limit:"
    " independent stages of one muscle take a third of the time. A variant with the whole step as"
    " one function, without calls and loops, is 5 % faster for 3 states, 5 % slower for 6 and 2 %"
    " slower for 10, and takes twice as long to compile. At this rtol the error of LSODA is 1.7e-7"
    " m with 3 states and 1.4e-7 m with 6, that of Rodas4 6e-9 and 1e-8"
)


@numba.njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def compiled_rates(t: Any, y: Any, u: Any, c: Any, function: Any) -> Any:
    """The compiled rates with the interface of SciPy."""
    f = np.empty(y.shape[0])
    invoke(function, (pointer(y), pointer(u), pointer(c), pointer(f)))
    return f


def hand_written_rates(run: Run) -> Callable[[Array], Any]:
    """A function from valve openings to the hand-written rates and their arguments."""
    under = HAND_WRITTEN[len(run.system.states)](run.system)
    return lambda openings: (under(openings.tolist()), ())


def machine_code_rates(ready: CompiledSystem) -> Callable[[Array], Any]:
    """A function from valve openings to the compiled rates and their arguments."""
    return lambda openings: (compiled_rates, (openings, ready.precomputed, ready.address["rhs"]))


def lsoda(run: Run, rates: Callable[[Array], Any], rtol: float = RTOL) -> Array:
    """The run with solve_ivp, restarted at each switching time of the schedule."""
    from scipy.integrate import solve_ivp

    y = run.vector
    begin = 0.0
    rows = [run.vector[None]]
    atol = rtol * run.nominal
    for end, openings in zip(run.segments.ends, run.segments.values, strict=True):
        function, extra = rates(openings)
        grid = np.linspace(begin, end, round((end - begin) / SPACING) + 1)
        solution = solve_ivp(
            function, (begin, end), y, "LSODA", grid[1:], rtol=rtol, atol=atol, args=extra or None
        )
        rows.append(solution.y.T)
        y = solution.y[:, -1]
        begin = end
    return np.concatenate(rows)


def odeint_lsoda(run: Run, rates: Callable[[Array], Any], rtol: float = RTOL) -> Array:
    """The run with odeint, the older interface to the same method."""
    from scipy.integrate import odeint

    y = run.vector
    begin = 0.0
    rows = [run.vector[None]]
    atol = rtol * run.nominal
    for end, openings in zip(run.segments.ends, run.segments.values, strict=True):
        function, extra = rates(openings)
        grid = np.linspace(begin, end, round((end - begin) / SPACING) + 1)
        solution = odeint(
            function, y, grid, args=extra, rtol=rtol, atol=atol, tcrit=[end], tfirst=True
        )
        rows.append(solution[1:])
        y = solution[-1]
        begin = end
    return np.concatenate(rows)


def kernel(run: Run, ready: CompiledSystem, method: am.Rodas4 | None = None) -> Callable[[], Array]:
    """A function that runs the kernel alone on the compiled plant; all preparation is done before,
    as for the peers.
    """
    bound = (method or am.Rodas4(RTOL)).bind(ready)
    segments = run.segments
    times = run.times
    state = run.vector
    return lambda: bound.run(segments, 0.0, state, times).rows


def make_simulation(run: Run) -> Callable[[], Any]:
    """A function that calls `simulate`, including validation of the initial state, outputs and the
    Recording.
    """
    return lambda: am.simulate(
        run.system,
        run.command,
        duration=DURATION,
        initial_state=run.initial_state,
        output_times=SPACING,
    )


def check_rates(run: Run, ready: CompiledSystem) -> float:
    """The maximum difference of the rates, relative to the maximum of each; raises AssertionError
    above 1e-12.
    """
    rng = np.random.default_rng(1)
    visited = kernel(run, ready)()
    difference = np.zeros(visited.shape[1])
    size = np.zeros(visited.shape[1])
    for openings in run.segments.values:
        function = hand_written_rates(run)(openings)[0]
        for y in visited[rng.integers(0, len(visited), 40)]:
            y = y + 0.01 * run.nominal * rng.standard_normal(y.size)
            expected = ready.rates(y, openings)
            difference = np.maximum(difference, np.abs(function(0.0, y) - expected))
            size = np.maximum(size, np.abs(expected))
    worst = float((difference / size).max())
    if not worst < 1e-12:
        raise AssertionError(f"the hand-written rates differ by {worst:.2g} from the compiled ones")
    return worst


def measure(states: int, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Target, ...]]:
    """Rows and targets for one plant."""
    run = runs()[states]
    ready = compile_system(run.system)
    rate_difference = check_rates(run, ready)
    hand, machine = hand_written_rates(run), machine_code_rates(ready)
    reference = kernel(run, ready, am.Rodas4(1e-11))()
    variants: dict[str, Callable[[], Any]] = {
        "Rodas4, kernel": kernel(run, ready),
        "Rodas4, `simulate` with Recording": make_simulation(run),
        "solve_ivp LSODA, hand-written rates": lambda: lsoda(run, hand),
        "solve_ivp LSODA, compiled rates": lambda: lsoda(run, machine),
        "odeint LSODA, hand-written rates": lambda: odeint_lsoda(run, hand),
        "odeint LSODA, compiled rates": lambda: odeint_lsoda(run, machine),
    }
    times = time_variants(variants, rounds)
    errors = {name: _error(run, call(), reference) for name, call in variants.items()}
    first = next(iter(times))
    check = run.error(lsoda(run, hand, 1e-12), reference)
    note = (
        f"LSODA at rtol 1e-12, difference from the reference (rates agree to {rate_difference:.0e})"
    )
    rows = ((str(states), note, "", "", "", f"{check:.1e}"),)
    rows += tuple(_row(states, name, times[name], times[first], errors[name]) for name in variants)
    lsoda_times = times["solve_ivp LSODA, hand-written rates"]
    equal_rows, equal = at_equal_precision(run, ready, reference, rounds)
    return rows + equal_rows, (
        _ratio(
            f"{states} states: solve_ivp LSODA, hand-written rates / Rodas4, both at rtol 1e-6",
            lsoda_times.ratio_to(times[first]),
        ),
        _ratio(
            f"{states} states: the same, each at its loosest rtol with an error <= 1e-7 m", equal
        ),
        Target(f"{states} states: error of Rodas4(1e-6)", errors[first], MAX_ERROR, "m"),
    )


def _ratio(what: str, measured: float) -> Target:
    return Target(what, measured, 80.0, "x", at_least=True, reason=REASON)


def loosest_tolerance(run: Run, solve: Callable[[float], Array], reference: Array) -> float:
    """The loosest rtol of the series at which, and at the next tighter one, the error is at most
    MAX_ERROR.
    """
    loosest: float | None = None
    for rtol in SERIES:
        if not run.error(solve(rtol), reference) <= MAX_ERROR:
            loosest = None
        elif loosest:
            return loosest
        else:
            loosest = rtol
    return SERIES[-1]


def at_equal_precision(
    run: Run, ready: CompiledSystem, reference: Array, rounds: int
) -> tuple[tuple[tuple[str, ...], ...], float]:
    """Rows and time ratio of both methods, each at its loosest sufficient rtol."""
    hand, size = hand_written_rates(run), len(run.system.states)
    run_rodas4 = lambda rtol: kernel(run, ready, am.Rodas4(rtol))()  # noqa: E731
    run_lsoda = lambda rtol: lsoda(run, hand, rtol)  # noqa: E731
    rtol, lsoda_rtol = (
        loosest_tolerance(run, solve, reference) for solve in (run_rodas4, run_lsoda)
    )
    variants = {
        f"Rodas4({rtol:.0e}), kernel": kernel(run, ready, am.Rodas4(rtol)),
        f"solve_ivp LSODA at {lsoda_rtol:.0e}, hand-written rates": lambda: run_lsoda(lsoda_rtol),
    }
    times = time_variants(variants, max(1, rounds // 2))
    first, other = times.values()
    rows = tuple(
        _row(size, name, t, first, run.error(variants[name](), reference))
        for name, t in times.items()
    )
    return rows, other.ratio_to(first)


def _error(run: Run, result: Any, reference: Array) -> float:
    rows = (
        result
        if isinstance(result, np.ndarray)
        else np.column_stack([result[s.name] for s in run.system.states])
    )
    return run.error(rows, reference)


def _row(states: int, name: str, times: Times, first: Times, error: float) -> tuple[str, ...]:
    return (
        str(states),
        name,
        format_time(times.median),
        format_time(times.minimum),
        f"{times.ratio_to(first):.3g}",
        f"{error:.1e}",
    )


def section(rounds: int = 25) -> Section:
    """The complete benchmark."""
    parts = [measure(states, rounds) for states in runs()]
    rows, targets = (
        tuple(x for part in column for x in part) for column in zip(*parts, strict=True)
    )
    return Section("25 s of filling and discharge, Rodas4 and LSODA", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
