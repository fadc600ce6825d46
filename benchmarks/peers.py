"""25 s of fill and discharge, Rodas4 against the solvers of other packages, each at its loosest tolerance that serves.

A package that is not installed is left out, and a line says how to install it.
"""

from __future__ import annotations

import dataclasses
import importlib.util
from collections.abc import Callable

from filling import Array, Run, runs
from measure import Bar, Section, Times, interleaved, of_time, show
from peer_solvers import (
    Solver,
    casadi_cvodes,
    casadi_cvodes_jit,
    control_response,
    diffrax_kvaerno5,
    sundae_by_hand,
    sundae_compiled,
)
from rodas4 import WANTED, kernel, loosest

from airmuscle.compile.program import CompiledSystem, compile_system
from airmuscle.simulation.integrators import Rodas4

HEADING = ("states", "variant", "rtol", "median", "least", "times Rodas4", "greatest error [m]")
TEXT = (
    "2501 rows, 10 ms apart. Each has the loosest rtol of a series at which, and at the next tighter one, the error is "
    f"at most {WANTED:g} m, with atol rtol times each state's nominal size; each begins anew at every instant of the "
    "schedule. What can be done beforehand (solvers made, functions compiled) is not timed. Eight states are six "
    "muscles on one mass, six and ten two muscles on a joint. scikit-sundae calls Python for every evaluation, also of "
    "compiled rates; CasADi has the expressions that our machine code is printed from, constants folded, and an exact "
    "Jacobian; diffrax has the library's laws with JAX arrays, and is left out of the eight states, which XLA had not "
    "compiled after two minutes; python-control is SciPy's LSODA with an "
    "interpolation of its inputs at every evaluation. The reference is Rodas4 at rtol 1e-11."
)


@dataclasses.dataclass(frozen=True)
class Peer:
    """A solver of another package: what it is called, what must be importable, and what pip calls that."""

    name: str
    module: str
    package: str
    solver: Callable[[Run, CompiledSystem], Solver]
    least: float | None = None
    """How many times longer it is wanted to take, at least."""
    why: str = ""
    but: int = 0
    """The states of a plant that it is spared."""
    series_of: Callable[[Run, CompiledSystem], Solver] | None = None
    """What finds its tolerance, where it would take long to make it for each of the series."""

    @property
    def there(self) -> bool:
        return importlib.util.find_spec(self.module) is not None

    @property
    def absent(self) -> str:
        return f"{self.package} is not installed and left out: pip install {self.package}."


COMPILED = (
    "with compiled rates most of CVODE's time is its own and that of the call of Python around each evaluation, which "
    "hardly grow with the plant, while a step of Rodas4 does: 0.4 us with 3 states, 0.8 us with 10, 1.4 us with the "
    "surfaces of six muscles"
)
PEERS = (
    Peer("scikit-sundae CVODE, rates by hand", "sksundae", "scikit-sundae", sundae_by_hand, 45.0),
    Peer("scikit-sundae CVODE, rates compiled", "sksundae", "scikit-sundae", sundae_compiled, 45.0, COMPILED),
    Peer("diffrax Kvaerno5, jitted", "diffrax", "diffrax", diffrax_kvaerno5, 80.0, but=8),
    Peer("CasADi CVODES", "casadi", "casadi", casadi_cvodes),
    Peer("CasADi CVODES, compiled by gcc", "casadi", "casadi", casadi_cvodes_jit, series_of=casadi_cvodes),
    Peer("python-control input_output_response", "control", "control", control_response),
)


def fitting(peer: Peer, run: Run, ready: CompiledSystem, reference: Array) -> tuple[float, Callable[[], Array]]:
    """Its loosest rtol that serves, and the call at this rtol."""
    solver = peer.solver(run, ready)
    trial = peer.series_of(run, ready) if peer.series_of else solver
    rtol = loosest(run, lambda rtol: trial(rtol)(), reference)
    return rtol, solver(rtol)


def measure(states: int, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Bar, ...]]:
    """Rows and bars of one plant."""
    run = runs()[states]
    ready = compile_system(run.system)
    reference = kernel(run, ready, Rodas4(1e-11))()
    ours = loosest(run, lambda rtol: kernel(run, ready, Rodas4(rtol))(), reference)
    tolerances, calls = {"Rodas4, kernel": ours}, {"Rodas4, kernel": kernel(run, ready, Rodas4(ours))}
    there = [peer for peer in PEERS if peer.there and peer.but != states]
    for peer in there:
        tolerances[peer.name], calls[peer.name] = fitting(peer, run, ready, reference)
    times = interleaved(calls, rounds)
    first = times["Rodas4, kernel"]
    rows = tuple(_row(states, name, tolerances[name], times[name], first, run.error(calls[name](), reference))
                 for name in calls)  # fmt: skip
    bars = [
        Bar(f"{states} states: {p.name} / Rodas4, each at its loosest rtol with an error <= 1e-7 m",
            times[p.name].ratio_to(first), p.least, "x", at_least=True, why=p.why)
        for p in there if p.least is not None
    ]  # fmt: skip
    return rows, tuple(bars)


def _row(states: int, name: str, rtol: float, time: Times, first: Times, error: float) -> tuple[str, ...]:
    taken = of_time(time.median), of_time(time.least)
    return (str(states), name, f"{rtol:.0e}", *taken, f"{time.ratio_to(first):.3g}", f"{error:.1e}")


def section(rounds: int = 9) -> Section:
    """The whole comparison."""
    parts = [measure(states, rounds) for states in runs()]
    rows, bars = (tuple(x for part in column for x in part) for column in zip(*parts, strict=True))
    absent = dict.fromkeys(peer.absent for peer in PEERS if not peer.there)
    text = " ".join([TEXT, *absent])
    return Section("25 s of fill and discharge, Rodas4 against other packages", text, HEADING, rows, bars)


if __name__ == "__main__":
    show(section())
