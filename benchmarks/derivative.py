"""One evaluation of the derivative of a plant, with as many muscles as an arm has; called from compiled code."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numba
import numpy as np
from filling import BRAID, Array
from measure import Bar, Section, interleaved, of_time, show
from new_plant import MUSCLES, many_muscles

from airmuscle.analysis.equilibrium import find_equilibrium
from airmuscle.characteristic import ChouHannaford1996
from airmuscle.compile.kernels.calls import invoke, pointer
from airmuscle.compile.program import CompiledSystem, compile_system
from airmuscle.plant.plant import Plant

HEADING = ("what", "median", "least", "a muscle")
CALLS = 10_000
TEXT = (
    f"{MUSCLES} muscles on one mass, 26 states: for each the flow through two valves, volume, pressure, "
    f"characteristic, spring and damper; half open. {CALLS} calls in a compiled loop, each at a state that depends on "
    "the call before."
)
WHY = "half open, both valves and the surface with its clamp are computed in every evaluation"


@numba.njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _calls(function: Any, x: Any, u: Any, c: Any, f: Any, count: Any) -> None:
    at_x, at_u, at_c, at_f = pointer(x), pointer(u), pointer(c), pointer(f)
    for _ in range(count):
        invoke(function, (at_x, at_u, at_c, at_f))
        for i in range(x.shape[0]):
            x[i] += 1e-30 * f[i]


def calls(ready: CompiledSystem, start: Mapping[str, float], count: int = CALLS) -> Callable[[], Array]:
    """So many evaluations of the derivative, one after the other; what the last one gave."""
    x = np.array([start[s.name] for s in ready.system.states])
    u, f = np.full(max(ready.sizes.inputs, 1), 0.5), np.empty(x.size)

    def call() -> Array:
        _calls(ready.address["rhs"], x, u, ready.precomputed, f, count)
        return f

    return call


def plain_muscles() -> Plant:
    """The same arm with muscles after Chou and Hannaford, the simplest characteristic there is."""
    plant = many_muscles()
    law = ChouHannaford1996(BRAID)
    return dataclasses.replace(plant, muscle=tuple(dataclasses.replace(m, contractile=law) for m in plant.muscles))


def section(rounds: int = 15) -> Section:
    """Both arms."""
    plants = {"with a surface of 21 coefficients": many_muscles(), "after Chou and Hannaford": plain_muscles()}
    variants = {
        f"{MUSCLES} muscles {name}": calls(compile_system(plant), dict(find_equilibrium(plant, pressure=1e5)))
        for name, plant in plants.items()
    }
    times = interleaved(variants, rounds)
    rows = tuple(
        (name, *(of_time(t / CALLS) for t in (time.median, time.least, time.median / MUSCLES)))
        for name, time in times.items()
    )
    bars = tuple(
        Bar(f"derivative of {name}", time.least / CALLS * 1e6, 0.6, "us", why=WHY) for name, time in times.items()
    )
    return Section(f"Derivative of an arm of {MUSCLES} muscles", TEXT, HEADING, rows, bars)


if __name__ == "__main__":
    show(section())
