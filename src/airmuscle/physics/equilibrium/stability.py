"""Stability of equilibria, by the eigenvalues of the motion."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...engine.compile.program import CompiledSystem, Program
from .static_plant import StaticPlant

MARGIN = 1e-9
"""Real part of an eigenvalue, relative to the largest eigenvalue, up to which it counts as zero (chosen)."""
_functions: weakref.WeakKeyDictionary[Program, Any] = weakref.WeakKeyDictionary()


def are_stable(
    compiled: CompiledSystem, parameters: Array, states: Array, inputs: Array, *, shut: bool = False
) -> npt.NDArray[np.bool_]:
    """Whether no eigenvalue of the motion has a positive real part, for plants with parameters (R, P) at states (R, n).

    The motion is that of coordinates, series springs, creep and walls. At given pressures, the states of the air
    are proportional to the volume, m = m_0 V/V_0; with `shut` valves they are constant. Friction is excluded, because
    it would hold any position. A state without finite derivatives is not stable.
    """
    plant, names = compiled.system, [s.name for s in compiled.system.states]
    assert isinstance(plant, StaticPlant)
    air, moving = _kinds(plant)
    free = [i for i, n in enumerate(names) if n in moving]
    if not free:
        return np.ones(len(states), dtype=bool)
    by_state, volumes, growths = _slopes(compiled, free, parameters, states, inputs)
    matrix = by_state[:, :, free]
    if not shut:
        for k, prefix in enumerate(plant.prefixes):
            growth = growths[:, k, free] / volumes[:, k, None]
            held = [i for i, n in enumerate(names) if n in air and n.startswith(prefix)]
            pushed = np.einsum("rij,rj->ri", by_state[:, :, held], states[:, held])
            matrix = matrix + pushed[:, :, None] * growth[:, None, :]
    stable = np.array(np.isfinite(matrix).all(axis=(1, 2)))
    eigenvalues = np.linalg.eigvals(matrix[stable])
    stable[stable] = eigenvalues.real.max(axis=1) <= MARGIN * np.abs(eigenvalues).max(axis=1)
    return stable


def _kinds(plant: StaticPlant) -> tuple[set[str], set[str]]:
    """The states of the air in the muscles, and the states of the motion."""
    air, friction = set[str](), set[str]()
    for prefix, muscle in zip(plant.prefixes, plant.muscles, strict=True):
        air |= {prefix + s.name for s in plant.gas.states(muscle.geometry.volume(0.05), plant.ambient)}
        friction |= {prefix + s.name for s in muscle.friction.states}
    moving = {n for c in plant.mechanism.coordinates for n in (c.name, c.speed)}
    moving |= {p + s.name for p, m in zip(plant.prefixes, plant.muscles, strict=True) for s in m.states}
    return air, moving - friction


def _slopes(
    compiled: CompiledSystem, free: list[int], parameters: Array, states: Array, inputs: Array
) -> tuple[Array, Array, Array]:
    """Jacobian of the rates of f states (R, f, n), the volumes of the muscles (R, k), and their Jacobian (R, k, n)."""
    count, size = states.shape
    results = _function(compiled, free)(states.T, np.repeat(inputs[:, None], count, axis=1), parameters.T)
    by_state, volumes, growths = (r.full() for r in results)
    stacked = [part.reshape(-1, count, size).transpose(1, 0, 2) for part in (by_state, growths)]
    return stacked[0], volumes.T, stacked[1]


def _function(compiled: CompiledSystem, free: list[int]) -> Any:
    """(x, u, p) -> (df/dx of the states of the motion, V, dV/dx), differentiated once for each structure."""
    program, plant = compiled.program, compiled.system
    assert isinstance(plant, StaticPlant)
    if program not in _functions:
        import casadi

        t = program.traced
        volumes = casadi.vertcat(*(t.o[compiled.output_names.index(f"{prefix}volume")] for prefix in plant.prefixes))
        wanted = [casadi.jacobian(t.f[free], t.x), volumes, casadi.jacobian(volumes, t.x)]
        _functions[program] = casadi.Function("motion", [t.x, t.u, t.p], casadi.cse(wanted))
    return _functions[program]
