"""25 s of filling and discharge: Rodas4 compared with solvers of other packages at equal accuracy.

A package that is not installed is omitted; a note states how to install it.
"""

from __future__ import annotations

import dataclasses
import importlib.util
from collections.abc import Callable

from filling import Array, Run, runs
from measure import Section, Target, Times, format_time, print_section, time_variants
from peer_solvers import (
    Solver,
    casadi_cvodes,
    casadi_cvodes_jit,
    control_response,
    diffrax_kvaerno5,
    sundae_by_hand,
    sundae_compiled,
)
from rodas4 import MAX_ERROR, kernel, loosest_tolerance

import airmuscle as am
from airmuscle.engine.compile.program import CompiledSystem, compile_system

HEADER = ("states", "variant", "rtol", "median", "minimum", "ratio to Rodas4", "maximum error [m]")
TEXT = (
    "2501 rows, 10 ms apart. Each solver has the loosest rtol of a series at which, and at the"
    f" next tighter one, the error is at most {MAX_ERROR:g} m; atol is rtol times the nominal value"
    " of each state. Each restarts at every switching time of the schedule. Preparation (creation"
    " of solvers, compilation of functions) is not timed. Eight states are six muscles on one"
    " mass, six and ten states two muscles on a joint. scikit-sundae calls Python for every"
    " evaluation, also of compiled rates. CasADi uses the expressions from which the library"
    " generates machine code, with parameters substituted, and an exact Jacobian. diffrax uses the"
    " library's laws with JAX arrays; it is omitted for eight states, which XLA had not compiled"
    " after two minutes. python-control is LSODA of SciPy with interpolated inputs. The reference"
    " is Rodas4 at rtol 1e-11."
)


@dataclasses.dataclass(frozen=True)
class Peer:
    """A solver of another package: its name, the required module, and the name of the package for
    pip.
    """

    name: str
    module: str
    package: str
    solver: Callable[[Run, CompiledSystem], Solver]
    min_ratio: float | None = None
    """Target: minimum ratio of its time to that of Rodas4."""
    reason: str = ""
    excluded_states: int = 0
    """Number of states of the plant for which it is omitted."""
    trial_solver: Callable[[Run, CompiledSystem], Solver] | None = None
    """Solver used to find the tolerance, if the creation of `solver` takes long."""

    @property
    def installed(self) -> bool:
        return importlib.util.find_spec(self.module) is not None

    @property
    def missing_note(self) -> str:
        return f"{self.package} is not installed and is omitted: pip install {self.package}."


REASON = (
    "with compiled rates most of the time is spent in CVODE and in the Python call of each"
    " evaluation, which hardly increases with the size of the plant, unlike the time of a step of"
    " Rodas4: 0.3 us with 3 states, 0.5 us with 10, 0.6 us with the surfaces of six muscles"
)
PEERS = (
    Peer(
        "scikit-sundae CVODE, hand-written rates", "sksundae", "scikit-sundae", sundae_by_hand, 45.0
    ),
    Peer(
        "scikit-sundae CVODE, compiled rates",
        "sksundae",
        "scikit-sundae",
        sundae_compiled,
        45.0,
        REASON,
    ),
    Peer(
        "diffrax Kvaerno5, jitted", "diffrax", "diffrax", diffrax_kvaerno5, 80.0, excluded_states=8
    ),
    Peer("CasADi CVODES", "casadi", "casadi", casadi_cvodes),
    Peer(
        "CasADi CVODES, compiled by gcc",
        "casadi",
        "casadi",
        casadi_cvodes_jit,
        trial_solver=casadi_cvodes,
    ),
    Peer("python-control input_output_response", "control", "control", control_response),
)


def at_loosest_tolerance(
    peer: Peer, run: Run, ready: CompiledSystem, reference: Array
) -> tuple[float, Callable[[], Array]]:
    """The loosest sufficient rtol of a peer, and its call at this rtol."""
    solver = peer.solver(run, ready)
    trial = peer.trial_solver(run, ready) if peer.trial_solver else solver
    rtol = loosest_tolerance(run, lambda rtol: trial(rtol)(), reference)
    return rtol, solver(rtol)


def measure(states: int, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Target, ...]]:
    """Rows and targets for one plant."""
    run = runs()[states]
    ready = compile_system(run.system)
    reference = kernel(run, ready, am.Rodas4(1e-11))()
    ours = loosest_tolerance(run, lambda rtol: kernel(run, ready, am.Rodas4(rtol))(), reference)
    tolerances = {"Rodas4, kernel": ours}
    calls = {"Rodas4, kernel": kernel(run, ready, am.Rodas4(ours))}
    installed = [peer for peer in PEERS if peer.installed and peer.excluded_states != states]
    for peer in installed:
        tolerances[peer.name], calls[peer.name] = at_loosest_tolerance(peer, run, ready, reference)
    times = time_variants(calls, rounds)
    first = times["Rodas4, kernel"]
    rows = tuple(
        _row(
            states, name, tolerances[name], times[name], first, run.error(calls[name](), reference)
        )
        for name in calls
    )
    targets = [
        Target(
            f"{states} states: {p.name} / Rodas4, each at its loosest rtol with an error <= 1e-7 m",
            times[p.name].ratio_to(first),
            p.min_ratio,
            "x",
            at_least=True,
            reason=p.reason,
        )
        for p in installed
        if p.min_ratio is not None
    ]
    return rows, tuple(targets)


def _row(
    states: int, name: str, rtol: float, time: Times, first: Times, error: float
) -> tuple[str, ...]:
    durations = format_time(time.median), format_time(time.minimum)
    return (
        str(states),
        name,
        f"{rtol:.0e}",
        *durations,
        f"{time.ratio_to(first):.3g}",
        f"{error:.1e}",
    )


def section(rounds: int = 9) -> Section:
    """The complete benchmark."""
    parts = [measure(states, rounds) for states in runs()]
    rows, targets = (
        tuple(x for part in column for x in part) for column in zip(*parts, strict=True)
    )
    missing = dict.fromkeys(peer.missing_note for peer in PEERS if not peer.installed)
    text = " ".join([TEXT, *missing])
    return Section(
        "25 s of filling and discharge, Rodas4 and other packages", text, HEADER, rows, targets
    )


if __name__ == "__main__":
    print_section(section())
