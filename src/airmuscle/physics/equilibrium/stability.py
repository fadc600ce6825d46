"""Stability of equilibria, by the eigenvalues of the motion; error messages for a plant without equilibrium."""

import weakref
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, EquilibriumError, GeometryLimitError, PhysicsError
from ...engine.compile.program import CompiledSystem, Program
from .multi_dof import starts
from .single_dof import grid
from .statics import MAX_PRESSURE, StaticPlant, Statics

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


def no_equilibrium(one: Statics) -> PhysicsError:
    """The error for one plant without a stable equilibrium, with the forces at both ends of its range.

    GeometryLimitError if no position is within the limits of all muscles, EquilibriumError otherwise.
    """
    kind, count = type(one.plants.mechanism).__name__, len(one.plants.mechanism.coordinates)
    if count == 0:
        return EquilibriumError(_without_coordinates(one))
    x = grid(one)[0][:, None] if count == 1 else starts(one)
    x = x[np.isfinite(x).all(axis=1)]
    if count == 1 and not len(x):
        muscles = ", ".join(m.name for m in one.separate[0].muscles)
        return GeometryLimitError(
            f"{kind} has no position within the contraction limits of {muscles}; change offsets, radius or arms."
        )
    f = one.accelerations(x[None])[0] if len(x) else x
    x, f = x[np.isfinite(f).all(axis=1)], f[np.isfinite(f).all(axis=1)]
    if not len(x):
        return EquilibriumError(f"{kind} has no equilibrium: no position permits the given air masses.")
    if not f.any():
        return EquilibriumError(
            f"{kind} is in equilibrium at every position: no force acts on it under these inputs. Choose an initial "
            f"state by plant.state_at(pressure=..., {one.plants.mechanism.coordinates[0].name}=...)."
        )
    if count == 1:
        places, load = [x[0], x[-1]], _required_tension(one, x[0])
    else:
        places, load = [x[int(np.argmin(np.abs(f).max(axis=1)))]], ""
    lines = "; ".join(_line(one, place) for place in places)
    return EquilibriumError(
        f"{kind} has no stable equilibrium: {lines}.{load} Change the load, the pressure or the parallel spring."
    )


def _without_coordinates(one: Statics) -> str:
    plant = one.separate[0]
    contractions = plant.mechanism.contractions({}, plant.resting_lengths)
    if one.shut:
        texts = ", ".join(
            f"{m.name} cannot hold {mass:g} kg of air at a contraction of {100 * float(eps):.1f} %"
            for m, mass, eps in zip(plant.muscles, one.air, contractions, strict=True)
        )
        return f"{texts}: no pressure below {MAX_PRESSURE:g} Pa belongs to it."
    plant.state_at(pressure=one.air)
    return f"{type(plant.mechanism).__name__} has no stable equilibrium: a muscle in series or its wall is unstable."


def _line(one: Statics, x: Array) -> str:
    plant = one.separate[0]
    states = plant.muscle_states(one.state(one.place(x)))
    pulls = ", ".join(
        f"{m.name} pulls {float(state.tension) + 0.0:.4g} N at {round(float(state.pressure) / 1e3, 6) + 0.0:.4g} kPa "
        f"and a contraction of {100 * float(state.contraction):.1f} %"
        for m, state in zip(plant.muscles, states, strict=True)
    )
    accelerations = one.accelerations(x[None, None])[0, 0]
    if len(x) == 1:
        unit = one.plants.mechanism.coordinates[0].unit
        return f"{pulls}, and the load accelerates at {accelerations[0]:+.4g} {unit}/s2"
    moving = ", ".join(
        f"{c.name} {a:+.4g} {c.unit}/s2" for c, a in zip(one.plants.mechanism.coordinates, accelerations, strict=True)
    )
    return f"{pulls}, and the accelerations are {moving}"


def _required_tension(one: Statics, x: Array) -> str:
    """The tension of a single muscle that would hold the load; empty for several muscles."""
    plant = one.separate[0]
    if len(plant.muscles) > 1:
        return ""
    state, mechanism = one.state(one.place(x)), plant.mechanism
    inputs = dict(zip(plant.inputs, one.inputs.tolist(), strict=True))
    accelerations = []
    for tension in (0.0, 1.0):
        forces = mechanism.generalised_forces(state, [tension], plant.resting_lengths)
        accelerations.append(
            float(mechanism.acceleration(state, state, forces, inputs)[one.plants.mechanism.coordinates[0].name])
        )
    slope = accelerations[1] - accelerations[0]
    return f" The load requires a tension of {-accelerations[0] / slope:.4g} N." if slope else ""
