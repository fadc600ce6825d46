"""Random numbers as an expression that can be compiled: the generator MRG32k3a, and normal deviates from it."""

from __future__ import annotations

from collections.abc import Mapping

from ...core import ops
from ...core.ops import Value
from ...core.reference import Reference

LECUYER1999 = Reference(
    key="lecuyer-1999",
    authors="L'Ecuyer, P.",
    title="Good parameters and implementations for combined multiple recursive random number generators",
    where="Operations Research 47(1):159-164",
    year=1999,
    doi="10.1287/opre.47.1.159",
    note="MRG32k3a, whose products are exact in double precision",
)
FIRST_MODULUS, SECOND_MODULUS = 4294967087.0, 4294944443.0
_SEED_MODULUS, _SEED_FACTOR = 2147483647.0, 16807.0
"""Park and Miller's generator, from which the state of a seed is taken."""
STATE = ("x0", "x1", "x2", "y0", "y1", "y2")
"""Names of the six numbers of the state, the oldest first."""


def modulo(value: Value, modulus: float) -> Value:
    """Remainder of an integer below 2^53 in magnitude, from 0 to modulus - 1, exact."""
    rest = value - modulus * ops.floor(value / modulus)
    rest = ops.where(rest < 0.0, rest + modulus, rest)
    return ops.where(rest >= modulus, rest - modulus, rest)


def seeded(seed: Value) -> dict[str, Value]:
    """The state of a seed, a whole number from 0 to 2^31 - 3."""
    number, state = seed + 1.0, {}
    for name in ("", "", *STATE):
        number = modulo(_SEED_FACTOR * number, _SEED_MODULUS)
        state[name] = number
    del state[""]
    return state


def drawn(state: Mapping[str, Value]) -> tuple[Value, dict[str, Value]]:
    """A number that is uniform in (0, 1), and the next state; L'Ecuyer (1999), Fig. I, MRG32k3a."""
    s = state
    first = modulo(1403580.0 * s["x1"], FIRST_MODULUS) - modulo(810728.0 * s["x0"], FIRST_MODULUS)
    first = ops.where(first < 0.0, first + FIRST_MODULUS, first)
    second = modulo(527612.0 * s["y2"], SECOND_MODULUS) - modulo(1370589.0 * s["y0"], SECOND_MODULUS)
    second = ops.where(second < 0.0, second + SECOND_MODULUS, second)
    difference = ops.where(first > second, first - second, first - second + FIRST_MODULUS)
    later = {"x0": s["x1"], "x1": s["x2"], "x2": first, "y0": s["y1"], "y1": s["y2"], "y2": second}
    return difference / (FIRST_MODULUS + 1.0), later


def drawn_normal(state: Mapping[str, Value]) -> tuple[Value, dict[str, Value]]:
    """A normal deviate of mean 0 and standard deviation 1 by the method of Box and Muller, and the next state."""
    radius, state = drawn(state)
    direction, later = drawn(state)
    return ops.sqrt(-2.0 * ops.log(radius)) * ops.cos(2.0 * ops.pi * direction), later
