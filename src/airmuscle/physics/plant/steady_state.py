"""Steady state of muscles and their air at given pressures, without checks; values may be arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...core.ops import Value
from ...core.variables import select_prefix, with_prefix
from ..muscle import Muscle
from ..pneumatics.gas import Air, Ambient, Gas, absolute_pressure


def settle_muscles(
    muscles: Sequence[Muscle], prefixes: Sequence[str], contractions: Sequence[Value], pressures: Sequence[Value],
    state: Mapping[str, Value],
) -> tuple[dict[str, Value], list[Value]]:  # fmt: skip
    """`state` with the muscles' own states, in steady state unless they are given, and the volume [m3] of each."""
    settled, volumes = dict(state), []
    for muscle, prefix, pressure, contraction in zip(muscles, prefixes, pressures, contractions, strict=True):
        own = {**muscle.steady_state(pressure, contraction), **select_prefix(prefix, state)}
        volumes.append(muscle.volume(muscle.inner_contraction(contraction, own), own))
        settled = {**with_prefix(prefix, own), **settled}
    return settled, volumes


def fill_muscles(
    gas: Gas, ambient: Ambient, prefixes: Sequence[str], pressures: Sequence[Value], volumes: Sequence[Value]
) -> tuple[dict[str, Value], list[Air]]:
    """The states of the air at gauge pressures [Pa] in volumes [m3], and the air itself."""
    filled: dict[str, Value] = {}
    airs = []
    for prefix, pressure, volume in zip(prefixes, pressures, volumes, strict=True):
        content = gas.state_at(absolute_pressure(pressure, ambient), volume, ambient)
        airs.append(gas.air(content, volume, ambient))
        filled |= with_prefix(prefix, content)
    return filled, airs
