"""25 s of fill and discharge with Rodas4 against SciPy's LSODA, its rates written by hand and compiled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from filling import DURATION, SPACING, Array, Run, runs
from measure import Bar, Section, Times, interleaved, of_time, show
from scalar_rates import Rates, hill, six_states, ten_states
from several_rates import several

from airmuscle.compile.kernels.calls import invoke, pointer
from airmuscle.compile.program import CompiledSystem, compile_system
from airmuscle.simulation import simulate
from airmuscle.simulation.integrators import Rodas4

RTOL = 1e-6
BY_HAND: dict[int, Callable[[Any], Callable[[Sequence[float]], Rates]]] = {
    3: hill,
    6: six_states,
    8: several,
    10: ten_states,
}
HEADING = ("states", "variant", "median", "least", "times Rodas4", "greatest error [m]")
TEXT = (
    "2501 rows, 10 ms apart; rtol 1e-6, and atol 1e-6 of each state's nominal size, unless the row says otherwise. The "
    "reference is Rodas4 at rtol 1e-11; the first row of each size tells how far LSODA at rtol 1e-12, with the rates "
    "written by hand, is from it. `solve_ivp` is SciPy's present interface and the one the bar is about, `odeint` its "
    "older one. Rows with another rtol hold the loosest of a series that keeps the error of 1e-7 m: work at equal "
    "precision."
)
SERIES = (1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8)
WANTED = 1e-7
"""Greatest error of displacement [m] that the bar allows."""
WHY = (
    "the opponent branches past shut valves, choked flow and the tangent beyond the validity range, so that an evaluation "
    "costs Python 2 to 5 us, LSODA needs 1100 to 5400 of them, and most of the time is that of `solve_ivp` "
    "itself. Rodas4 takes 450 to 900 steps of 0.4 to 0.7 us each; a stage is one chain of dependent operations, "
    "and that is what bounds it: stages of one muscle that need not wait for each other take a third of the time. "
    "The whole step printed as one function, without a call or a loop, was tried and is 5 % quicker for 3 states, "
    "5 % slower for 6 and 2 % slower for 10, and takes twice as long to compile. At this rtol LSODA errs by "
    "1.7e-7 m with 3 states and 1.4e-7 m with 6, Rodas4 by 6e-9 and 1e-8"
)


@numba.njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def compiled_rates(t: Any, y: Any, u: Any, c: Any, function: Any) -> Any:
    """The printed rates as SciPy calls them."""
    f = np.empty(y.shape[0])
    invoke(function, (pointer(y), pointer(u), pointer(c), pointer(f)))
    return f


def by_hand(run: Run) -> Callable[[Array], Any]:
    """Openings -> the rates written by hand."""
    under = BY_HAND[len(run.system.states)](run.system)
    return lambda openings: (under(openings.tolist()), ())


def by_machine(ready: CompiledSystem) -> Callable[[Array], Any]:
    """Openings -> the compiled rates and what they are called with."""
    return lambda openings: (compiled_rates, (openings, ready.precomputed, ready.address["rhs"]))


def lsoda(run: Run, rates: Callable[[Array], Any], rtol: float = RTOL) -> Array:
    """The run through solve_ivp, started anew at each instant of the schedule."""
    from scipy.integrate import solve_ivp

    y, begin, rows, atol = run.vector, 0.0, [run.vector[None]], rtol * run.nominal
    for end, openings in zip(run.segments.ends, run.segments.values, strict=True):
        function, extra = rates(openings)
        grid = np.linspace(begin, end, round((end - begin) / SPACING) + 1)
        found = solve_ivp(function, (begin, end), y, "LSODA", grid[1:], rtol=rtol, atol=atol, args=extra or None)
        rows.append(found.y.T)
        y, begin = found.y[:, -1], end
    return np.concatenate(rows)


def odeint_lsoda(run: Run, rates: Callable[[Array], Any], rtol: float = RTOL) -> Array:
    """The run through odeint, the older interface to the same method."""
    from scipy.integrate import odeint

    y, begin, rows, atol = run.vector, 0.0, [run.vector[None]], rtol * run.nominal
    for end, openings in zip(run.segments.ends, run.segments.values, strict=True):
        function, extra = rates(openings)
        grid = np.linspace(begin, end, round((end - begin) / SPACING) + 1)
        found = odeint(function, y, grid, args=extra, rtol=rtol, atol=atol, tcrit=[end], tfirst=True)
        rows.append(found[1:])
        y, begin = found[-1], end
    return np.concatenate(rows)


def kernel(run: Run, ready: CompiledSystem, method: Rodas4 | None = None) -> Callable[[], Array]:
    """The prepared plant through the kernel alone."""
    method, segments, times, state = method or Rodas4(RTOL), run.segments, run.times, run.vector
    return lambda: method.run(ready, segments, 0.0, state, times).rows


def whole(run: Run) -> Callable[[], Any]:
    """The call that a user makes: start checked, outputs evaluated, a Recording made."""
    return lambda: simulate(run.system, run.command, duration=DURATION, initial_state=run.start, output_times=SPACING)


def refuse_other_equations(run: Run, ready: CompiledSystem) -> float:
    """The greatest difference of the two sets of rates, relative to each rate's greatest; raises above 1e-12."""
    rng, visited = np.random.default_rng(1), kernel(run, ready)()
    difference, size = np.zeros(visited.shape[1]), np.zeros(visited.shape[1])
    for openings in run.segments.values:
        function = by_hand(run)(openings)[0]
        for y in visited[rng.integers(0, len(visited), 40)]:
            y = y + 0.01 * run.nominal * rng.standard_normal(y.size)
            expected = ready.rates(y, openings)
            difference = np.maximum(difference, np.abs(function(0.0, y) - expected))
            size = np.maximum(size, np.abs(expected))
    worst = float((difference / size).max())
    if not worst < 1e-12:
        raise AssertionError(f"the rates written by hand differ by {worst:.2g} from the compiled ones")
    return worst


def measure(states: int, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Bar, ...]]:
    """Rows and bars of one plant."""
    run = runs()[states]
    ready = compile_system(run.system)
    agree = refuse_other_equations(run, ready)
    hand, machine = by_hand(run), by_machine(ready)
    reference = kernel(run, ready, Rodas4(1e-11))()
    variants: dict[str, Callable[[], Any]] = {
        "Rodas4, kernel": kernel(run, ready),
        "Rodas4, `simulate` with its Recording": whole(run),
        "solve_ivp LSODA, rates by hand": lambda: lsoda(run, hand),
        "solve_ivp LSODA, rates compiled": lambda: lsoda(run, machine),
        "odeint LSODA, rates by hand": lambda: odeint_lsoda(run, hand),
        "odeint LSODA, rates compiled": lambda: odeint_lsoda(run, machine),
    }
    times = interleaved(variants, rounds)
    errors = {name: _error(run, call(), reference) for name, call in variants.items()}
    (
        first,
        *_,
    ) = times
    check = run.error(lsoda(run, hand, 1e-12), reference)
    note = f"LSODA at rtol 1e-12 against the reference (rates agree to {agree:.0e})"
    rows = ((str(states), note, "", "", "", f"{check:.1e}"),)
    rows += tuple(_row(states, name, times[name], times[first], errors[name]) for name in variants)
    opponent = times["solve_ivp LSODA, rates by hand"]
    equal_rows, equal = at_equal_precision(run, ready, reference, rounds)
    return rows + equal_rows, (
        _ratio(
            f"{states} states: solve_ivp LSODA by hand / Rodas4, both at rtol 1e-6", opponent.ratio_to(times[first])
        ),
        _ratio(f"{states} states: the same, each at its loosest rtol with an error <= 1e-7 m", equal),
        Bar(f"{states} states: error of Rodas4(1e-6)", errors[first], WANTED, "m"),
    )


def _ratio(what: str, measured: float) -> Bar:
    return Bar(what, measured, 80.0, "x", at_least=True, why=WHY)


def loosest(run: Run, solve: Callable[[float], Array], reference: Array) -> float:
    """The loosest rtol of the series at which, and at the next tighter one, the error is what was wanted."""
    kept: float | None = None
    for rtol in SERIES:
        if not run.error(solve(rtol), reference) <= WANTED:
            kept = None
        elif kept:
            return kept
        else:
            kept = rtol
    return SERIES[-1]


def at_equal_precision(
    run: Run, ready: CompiledSystem, reference: Array, rounds: int
) -> tuple[tuple[tuple[str, ...], ...], float]:
    """Rows and the ratio of both methods where each just keeps the error wanted."""
    hand, size = by_hand(run), len(run.system.states)
    ours, theirs = (lambda rtol: kernel(run, ready, Rodas4(rtol))()), (lambda rtol: lsoda(run, hand, rtol))
    loose, loose_theirs = (loosest(run, solve, reference) for solve in (ours, theirs))
    variants = {
        f"Rodas4({loose:.0e}), kernel": kernel(run, ready, Rodas4(loose)),
        f"solve_ivp LSODA at {loose_theirs:.0e}, rates by hand": lambda: theirs(loose_theirs),
    }
    times = interleaved(variants, max(1, rounds // 2))
    first, other = times.values()
    rows = tuple(_row(size, name, t, first, run.error(variants[name](), reference)) for name, t in times.items())
    return rows, other.ratio_to(first)


def _error(run: Run, found: Any, reference: Array) -> float:
    rows = found if isinstance(found, np.ndarray) else np.column_stack([found[s.name] for s in run.system.states])
    return run.error(rows, reference)


def _row(states: int, name: str, times: Times, first: Times, error: float) -> tuple[str, ...]:
    return (
        str(states),
        name,
        of_time(times.median),
        of_time(times.least),
        f"{times.ratio_to(first):.3g}",
        f"{error:.1e}",
    )


def section(rounds: int = 25) -> Section:
    """The whole comparison."""
    parts = [measure(states, rounds) for states in runs()]
    rows, bars = (tuple(x for part in column for x in part) for column in zip(*parts, strict=True))
    return Section("25 s of fill and discharge, Rodas4 against LSODA", TEXT, HEADING, rows, bars)


if __name__ == "__main__":
    show(section())
