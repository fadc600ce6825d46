"""Time of one evaluation of the derivative of a plant with many muscles, called from compiled
code.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numba
import numpy as np
from filling import BRAID, Array
from measure import Section, Target, format_time, print_section, time_variants
from new_plant import MUSCLES, many_muscles

import airmuscle as am
from airmuscle.engine.compile.kernels.calls import invoke, pointer
from airmuscle.engine.compile.program import CompiledSystem, compile_system

HEADER = ("plant", "median", "minimum", "per muscle")
CALLS = 10_000
TEXT = (
    f"{MUSCLES} muscles on one mass, 26 states: for each muscle the flow through two valves,"
    f" volume, pressure, characteristic, spring and damper; half-open valves. {CALLS} calls in a"
    " compiled loop, each at a state that depends on the previous call."
)
REASON = (
    "with half-open valves, both valves and the surface with its force limits are computed in every"
    " evaluation"
)


@numba.njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _calls(function: Any, x: Any, u: Any, c: Any, f: Any, count: Any) -> None:
    at_x = pointer(x)
    at_u = pointer(u)
    at_c = pointer(c)
    at_f = pointer(f)
    for _ in range(count):
        invoke(function, (at_x, at_u, at_c, at_f))
        for i in range(x.shape[0]):
            x[i] += 1e-30 * f[i]


def make_calls(
    ready: CompiledSystem, start: Mapping[str, float], count: int = CALLS
) -> Callable[[], Array]:
    """A function that evaluates the derivative `count` times in sequence and returns the last
    result.
    """
    x = np.array([start[s.name] for s in ready.system.states])
    u, f = np.full(max(ready.sizes.inputs, 1), 0.5), np.empty(x.size)

    def call() -> Array:
        _calls(ready.address["rhs"], x, u, ready.precomputed, f, count)
        return f

    return call


def chou_hannaford_muscles() -> am.Plant:
    """The same plant with the characteristic of Chou and Hannaford (1996), the simplest one."""
    plant = many_muscles()
    law = am.characteristic.ChouHannaford1996(BRAID)
    return dataclasses.replace(
        plant, muscle=tuple(dataclasses.replace(m, contractile=law) for m in plant.muscles)
    )


def section(rounds: int = 15) -> Section:
    """The complete benchmark."""
    plants = {
        "with a surface of 21 coefficients": many_muscles(),
        "of Chou and Hannaford (1996)": chou_hannaford_muscles(),
    }
    variants = {
        f"{MUSCLES} muscles {name}": make_calls(
            compile_system(plant), dict(am.find_equilibrium(plant, pressure=1e5))
        )
        for name, plant in plants.items()
    }
    times = time_variants(variants, rounds)
    rows = tuple(
        (
            name,
            *(format_time(t / CALLS) for t in (time.median, time.minimum, time.median / MUSCLES)),
        )
        for name, time in times.items()
    )
    targets = tuple(
        Target(f"derivative of {name}", time.minimum / CALLS * 1e6, 0.6, "us", reason=REASON)
        for name, time in times.items()
    )
    return Section(f"Derivative of a plant with {MUSCLES} muscles", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
