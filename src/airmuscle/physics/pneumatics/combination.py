"""Equivalent valve of valves in series or in parallel.

The choked flow of the equivalent valve is exact, and so is its flow near equal pressures, where the squares of the
pressures are linear in the square of the flow. Between, the equivalent valve follows an ellipse, which approximates the
exact curve. The errors stated below are tested against a numerical solution for the pressure between the valves.
"""

from __future__ import annotations

from ...core import ops
from ...core.declaration import attribute_hint
from ...core.errors import ParameterError
from .valve import Valve


def in_series(*valves: Valve) -> Valve:
    """Equivalent valve of valves in series, in the direction of the flow.

    For two valves, with C2/C1 = k and s the pressure between them over the upstream pressure at choking:

        C1 <= b1 C2    the first chokes     C = C1
        else           the second chokes    C = C2 s,  s = (b1 + sqrt(b1^2 + A (1 - 2 b1)))/A,  A = 1 + k^2 (1 - b1)^2
        b = 1 - C^2 ((1 - b1)/C1^2 + (1 - b2)/C2^2)

    s solves C2 s = C1 sqrt(1 - ((s - b1)/(1 - b1))^2). The order matters: C = 1 and 2 with b = 0.3 give 0.97 in one
    order and 0.92 in the other. Of any number of valves, C is the largest flow that none of them limits, by bisection.
    The maximum flow error is 2.8 % of the choked flow for b up to 0.6 and any ratio of the conductances, and for b from
    0.2 to 0.5 1.6 % for two valves and 1.8 % for three. Valid for steady flow in
    the given direction, without volume between the valves. Valves with C = 0 have no equivalent.

    Raises ParameterError for no valve, a valve with C = 0, or an argument that is not a Valve. The rules are equivalent
    to those of ISO 6358:1989 and of textbooks; they were derived independently, because neither text was available (ISO
    6358-3:2014 uses a numerical method).
    """
    _check_valves(valves, "in_series")
    if len(valves) == 1:
        return valves[0]
    conductance = _choked_flow(valves)
    ratio = 1.0 - conductance**2 * sum((1.0 - v.critical_ratio) / v.conductance**2 for v in valves)
    return _equivalent_valve(conductance, ratio, valves)


def in_parallel(*valves: Valve) -> Valve:
    """Equivalent valve of valves in parallel; the order does not matter.

        C = sum C_i,   b = 1 - (sum C_i / sum (C_i/sqrt(1 - b_i)))^2

    The flow is overestimated by at most 5.3 % of the choked flow for b up to 0.6, and by 1.8 % for b from 0.2 to 0.5;
    it is exact for equal b. Raises ParameterError as `in_series`.
    """
    _check_valves(valves, "in_parallel")
    if len(valves) == 1:
        return valves[0]
    conductance = sum(v.conductance for v in valves)
    near_equal = sum(v.conductance / ops.sqrt(1.0 - v.critical_ratio) for v in valves)
    return _equivalent_valve(conductance, 1.0 - (conductance / near_equal) ** 2, valves)


def _check_valves(valves: tuple[Valve, ...], rule: str) -> None:
    if not valves:
        raise ParameterError(f"{rule}: no valve is given; give at least one.")
    for i, valve in enumerate(valves, 1):
        if not isinstance(valve, Valve):
            raise ParameterError(
                f"{rule}: argument {i} is {type(valve).__name__}; it must be a Valve, with C and b."
                f"{attribute_hint(valve, Valve)}"
            )
        if not valve.conductance > 0:
            raise ParameterError(
                f"{rule}: the conductance of argument {i} is 0; it must be positive. Leave out a closed parallel valve."
            )


def _choked_flow(valves: tuple[Valve, ...]) -> float:
    """Largest flow of valves in series over the upstream pressure, as a conductance [m3/(s Pa)]."""
    low, high = 0.0, min(valve.conductance for valve in valves)
    if _passes(valves, high):
        return high
    while low < (middle := (low + high) / 2.0) < high:
        low, high = (middle, high) if _passes(valves, middle) else (low, middle)
    return low


def _passes(valves: tuple[Valve, ...], flow: float) -> bool:
    """Whether each valve passes a flow at the pressure that the ones before it leave; both over the upstream values."""
    pressure = 1.0
    for valve in valves:
        choked = valve.conductance * pressure
        if flow > choked:
            return False
        pressure *= valve.critical_ratio + (1.0 - valve.critical_ratio) * ops.sqrt(1.0 - (flow / choked) ** 2)
    return True


def _equivalent_valve(conductance: float, ratio: float, parts: tuple[Valve, ...]) -> Valve:
    """Valve with b >= 0 (negative only by rounding) and the widest laminar range of its parts."""
    return Valve(conductance, ops.maximum(ratio, 0.0), min(part.laminar_ratio for part in parts))
