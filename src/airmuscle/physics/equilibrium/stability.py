"""Stability of equilibria, messages where there is none, and equilibria of several coordinates by
Newton's method.
"""

import weakref
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import (
    Array,
    EquilibriumError,
    GeometryLimitError,
    PhysicsError,
    Recorded,
    slopes,
)
from ...engine.compile.program import CompiledSystem, Program
from ..plant.static_plant import StaticPlant, air_states
from .single_dof import grid
from .statics import MAX_PRESSURE, Rows, Statics

MARGIN = 1e-9
"""Real part of an eigenvalue, relative to the largest eigenvalue, up to which it counts as zero
(chosen).
"""
_functions: weakref.WeakKeyDictionary[Program, Recorded] = weakref.WeakKeyDictionary()


def are_stable(
    compiled: CompiledSystem, parameters: Array, states: Array, inputs: Array, *, shut: bool = False
) -> npt.NDArray[np.bool_]:
    """Whether no eigenvalue of the motion has a positive real part, for plants with parameters (R,
    P) at states (R, n).

    The motion is that of coordinates, series springs, creep and walls. At given pressures, the
    states of the air are proportional to the volume, m = m_0 V/V_0; with `shut` valves they are
    constant. Friction is excluded, because it would hold any position. A state without finite
    derivatives is not stable.
    """
    plant = compiled.system
    names = [s.name for s in compiled.system.states]
    assert isinstance(plant, StaticPlant)
    air = set[str]()
    friction = set[str]()
    moving = {n for c in plant.mechanism.coordinates for n in (c.name, c.speed)}
    for prefix, muscle in zip(plant.prefixes, plant.muscles, strict=True):
        air |= {prefix + s.name for s in air_states(muscle, plant.gas, plant.ambient)}
        friction |= {prefix + s.name for s in muscle.friction.states}
        moving |= {prefix + s.name for s in muscle.states}
    moving -= friction
    free = [i for i, n in enumerate(names) if n in moving]
    if not free:
        return np.ones(len(states), dtype=bool)
    by_state, volumes, growths = _slopes(compiled, free, parameters, states, inputs)
    matrix = by_state[:, :, free]
    if not shut:
        for k, prefix in enumerate(plant.prefixes):
            growth = growths[:, k, free] / volumes[:, k, None]
            masses = [i for i, n in enumerate(names) if n in air and n.startswith(prefix)]
            pushed = np.einsum("rij,rj->ri", by_state[:, :, masses], states[:, masses])
            matrix = matrix + pushed[:, :, None] * growth[:, None, :]
    stable = np.array(np.isfinite(matrix).all(axis=(1, 2)))
    eigenvalues = np.linalg.eigvals(matrix[stable])
    stable[stable] = eigenvalues.real.max(axis=1) <= MARGIN * np.abs(eigenvalues).max(axis=1)
    return stable


def _slopes(
    compiled: CompiledSystem, free: list[int], parameters: Array, states: Array, inputs: Array
) -> tuple[Array, Array, Array]:
    """Jacobian of the rates of f states (R, f, n), the volumes of the muscles (R, k), and their
    Jacobian (R, k, n).
    """
    count, size = states.shape
    results = _function(compiled, free).at_points(
        list(states.T), inputs.tolist(), list(parameters.T)
    )
    by_state, volumes, growths = (_table(columns, count) for columns in results)
    return by_state.reshape(count, -1, size), volumes, growths.reshape(count, -1, size)


def _table(columns: list[Any], count: int) -> Array:
    """The values of some quantities (count, N) at all points, also of those that are equal."""
    table = np.empty((count, len(columns)))
    for k, column in enumerate(columns):
        table[:, k] = column
    return table


def _function(compiled: CompiledSystem, free: list[int]) -> Recorded:
    """(x, u, p) -> (df/dx of the states of the motion, V, dV/dx), differentiated once for each
    structure.
    """
    program = compiled.program
    plant = compiled.system
    assert isinstance(plant, StaticPlant)
    if program not in _functions:
        t = program.traced
        volumes = [t.o[compiled.output_names.index(f"{prefix}volume")] for prefix in plant.prefixes]
        by_state = slopes.jacobian([t.f[i] for i in free], t.x)
        growths = slopes.jacobian(volumes, t.x)
        _functions[program] = Recorded(
            [t.x, t.u, t.p], [slopes.by_row(by_state), volumes, slopes.by_row(growths)]
        )
    return _functions[program]


def no_equilibrium(statics: Statics) -> PhysicsError:
    """The error for one plant without a stable equilibrium, with the forces at both ends of its
    range.

    GeometryLimitError if no position is within the limits of all muscles, EquilibriumError
    otherwise.
    """
    kind = type(statics.plants.mechanism).__name__
    count = len(statics.plants.mechanism.coordinates)
    if count == 0:
        return EquilibriumError(_without_coordinates(statics))
    x = grid(statics)[0][:, None] if count == 1 else starts(statics)
    x = x[np.isfinite(x).all(axis=1)]
    if count == 1 and not len(x):
        muscles = ", ".join(m.name for m in statics.separate[0].muscles)
        return GeometryLimitError(
            f"{kind} has no position within the contraction limits of {muscles}; change offsets,"
            " radius or arms."
        )
    f = statics.accelerations(x[None])[0] if len(x) else x
    x = x[np.isfinite(f).all(axis=1)]
    f = f[np.isfinite(f).all(axis=1)]
    if not len(x):
        return EquilibriumError(
            f"{kind} has no equilibrium: no position permits the given air masses."
        )
    if not f.any():
        return EquilibriumError(
            f"{kind} is in equilibrium at every position: no force acts on it under these inputs."
            " Choose an initial state by plant.state_at(pressure=...,"
            f" {statics.plants.mechanism.coordinates[0].name}=...)."
        )
    if count == 1:
        places = [x[0], x[-1]]
        load = _required_tension(statics, x[0])
    else:
        places = [x[int(np.argmin(np.abs(f).max(axis=1)))]]
        load = ""
    lines = "; ".join(_line(statics, place) for place in places)
    return EquilibriumError(
        f"{kind} has no stable equilibrium: {lines}.{load} Change the load, the pressure or the"
        " parallel spring."
    )


def _without_coordinates(statics: Statics) -> str:
    plant = statics.separate[0]
    contractions = plant.mechanism.contractions({}, plant.resting_lengths)
    if statics.shut:
        texts = ", ".join(
            f"{m.name} cannot hold {mass:g} kg of air at a contraction of {100 * float(eps):.1f} %"
            for m, mass, eps in zip(plant.muscles, statics.air, contractions, strict=True)
        )
        return f"{texts}: no pressure below {MAX_PRESSURE:g} Pa belongs to it."
    plant.state_at(pressure=statics.air)
    return (
        f"{type(plant.mechanism).__name__} has no stable equilibrium: a muscle in series or its"
        " wall is unstable."
    )


def _line(statics: Statics, x: Array) -> str:
    plant = statics.separate[0]
    pulls = []
    states = plant.muscle_states(statics.state(x))
    for muscle, state in zip(plant.muscles, states, strict=True):
        # the addition of 0 makes a zero of a negative zero
        tension = float(state.tension) + 0.0
        pressure = round(float(state.pressure) / 1e3, 6) + 0.0
        contraction = 100 * float(state.contraction)
        pulls.append(
            f"{muscle.name} pulls {tension:.4g} N at {pressure:.4g} kPa and a contraction of"
            f" {contraction:.1f} %"
        )
    pulled = ", ".join(pulls)
    coordinates = statics.plants.mechanism.coordinates
    accelerations = statics.accelerations(x[None, None])[0, 0]
    if len(x) == 1:
        unit = coordinates[0].unit
        return f"{pulled}, and the load accelerates at {accelerations[0]:+.4g} {unit}/s2"
    named = zip(coordinates, accelerations, strict=True)
    moving = ", ".join(f"{c.name} {a:+.4g} {c.unit}/s2" for c, a in named)
    return f"{pulled}, and the accelerations are {moving}"


def _required_tension(statics: Statics, x: Array) -> str:
    """The tension of a single muscle that would hold the load; empty for several muscles."""
    plant = statics.separate[0]
    if len(plant.muscles) > 1:
        return ""
    state = statics.state(x)
    mechanism = plant.mechanism
    inputs = dict(zip(plant.inputs, statics.inputs.tolist(), strict=True))
    accelerations = []
    for tension in (0.0, 1.0):
        forces = mechanism.generalised_forces(state, [tension], plant.resting_lengths)
        accelerations.append(
            float(
                mechanism.acceleration(state, state, forces, inputs)[
                    statics.plants.mechanism.coordinates[0].name
                ]
            )
        )
    slope = accelerations[1] - accelerations[0]
    return f" The load requires a tension of {-accelerations[0] / slope:.4g} N." if slope else ""


STARTS = 60
"""Number of start points, spread evenly over the permitted contractions of the muscles (chosen)."""
ITERATIONS = 40
RESIDUAL_TOLERANCE = 1e-8
"""Residual acceleration of an equilibrium, relative to the largest at the start points (chosen)."""
DISTINCT = 1e-6
"""Equilibria closer than this fraction of the nominal sizes of the coordinates are the same
(chosen).
"""


def equilibria_of_several_coordinates(statics: Statics) -> tuple[Rows, Array]:
    """Row of the plant and coordinates (d,) of every equilibrium that start points lead to, in
    ascending order.
    """
    rows = list[int]()
    places = list[Array]()
    for row in range(len(statics.parameters)):
        single = statics.of(np.array([row]))
        equilibria = list[Array]()
        x = starts(single)
        sizes = single.nominal_sizes()
        f = single.accelerations(x[None])[0]
        for place in (
            _newton(single, x, f, sizes, RESIDUAL_TOLERANCE * np.abs(f).max()) if len(x) else ()
        ):
            if all(
                np.abs((place - equilibrium) / sizes).max() > DISTINCT for equilibrium in equilibria
            ):
                equilibria.append(place)
        rows += [row] * len(equilibria)
        places += sorted(equilibria, key=tuple)
    return np.array(rows, dtype=np.intp), np.array(places).reshape(
        len(rows), len(statics.plants.mechanism.coordinates)
    )


def starts(statics: Statics) -> Array:
    """Start points (K, d) within the permitted range of one plant: evenly spread contractions
    (additive recurrence).
    """
    limits = [
        [float(np.asarray(end).flat[0]) for end in ends] for ends in statics.contraction_limits
    ]
    low, high = np.array(limits).T
    high = np.minimum(high, 0.5)  # at greater contractions a muscle is beyond its maximum volume
    root = 2.0
    for _ in range(30):
        root = (1.0 + root) ** (1.0 / (low.size + 1))
    steps = root ** -np.arange(1.0, low.size + 1)
    targets = low + (high - low) * ((0.5 + np.arange(STARTS)[:, None] * steps) % 1.0)
    x = _coordinates_of(statics, targets)
    inside = statics.within_reach(x[None])[0] & np.isfinite(statics.accelerations(x[None])[0]).all(
        axis=1
    )
    permitted: Array = x[inside]
    return permitted


def _contractions(statics: Statics, x: Array) -> Array:
    """Contractions (K, muscles) at coordinates (K, d)."""
    return np.stack([eps[0] for eps in statics.contractions(x[None])], axis=-1)


def _coordinates_of(statics: Statics, targets: Array) -> Array:
    """Coordinates (K, d) whose contractions are nearest to the targets (K, muscles)."""
    sizes: Array = statics.nominal_sizes()
    x: Array = np.zeros((len(targets), sizes.size))
    for _ in range(4):
        at = _contractions(statics, x)
        perturbed = [_contractions(statics, x + 1e-6 * step) for step in np.diag(sizes)]
        slopes = np.stack([(value - at) / 1e-6 for value in perturbed], axis=-1)
        change = _least_squares(slopes, targets - at, 1e-15)
        x = np.add(x, sizes * change)
    return x


def _least_squares(matrices: Array, right: Array, rcond: float) -> Array:
    """Least-squares solutions (K, d) for matrices (K, r, d); NaN for matrices that are not
    finite.
    """
    solution: Array = np.full((len(matrices), matrices.shape[2]), np.nan)
    finite = np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    solution[finite] = np.einsum(
        "kdr,kr->kd", np.linalg.pinv(matrices[finite], rcond=rcond), right[finite]
    )
    return solution


def _newton(statics: Statics, x: Array, f: Array, sizes: Array, tolerance: float) -> list[Array]:
    """Equilibria that Newton's method finds from x (K, d); its steps are halved until the residual
    decreases.
    """
    equilibria = []
    for _ in range(ITERATIONS):
        step = _steps(statics, x, f, sizes)
        following, after, decreased = _descend(statics, x, f, step)
        ended = (np.abs(step / sizes).max(axis=1) < 1e-13) | ~decreased
        equilibria += list(
            x[ended & np.isfinite(step).all(axis=1) & (np.abs(f).max(axis=1) <= tolerance)]
        )
        x = following[~ended]
        f = after[~ended]
        if not len(x):
            break
    return equilibria


def _descend(
    statics: Statics, x: Array, f: Array, step: Array
) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Next points, their residuals, and for which of them a fraction of the step decreases the
    residual.
    """
    following = x.copy()
    after = f.copy()
    decreased = np.zeros(len(x), dtype=bool)
    waiting = np.flatnonzero(np.isfinite(step).all(axis=1))
    for part in 0.5 ** np.arange(12):
        if not waiting.size:
            break
        trial = x[waiting] + part * step[waiting]
        at = statics.accelerations(trial[None])[0]
        with np.errstate(invalid="ignore"):
            better = np.abs(at).max(axis=1) < np.abs(f[waiting]).max(axis=1)
        better &= statics.within_reach(trial[None])[0]
        rows = waiting[better]
        following[rows] = trial[better]
        after[rows] = at[better]
        decreased[rows] = True
        waiting = waiting[~better]
    return following, after, decreased


def _steps(statics: Statics, x: Array, f: Array, sizes: Array) -> Array:
    """Newton's step (K, d) by central differences, one-sided at the ends of the range; NaN if it
    does not exist.
    """
    slopes = np.empty((len(x), f.shape[1], x.shape[1]))
    for k, perturbation in enumerate(np.diag(1e-5 * sizes)):
        after, before = (
            np.where(statics.within_reach(p[None])[0][:, None], p, x)
            for p in (x + perturbation, x - perturbation)
        )
        span = (after - before)[:, k] / sizes[k]
        at_after = statics.accelerations(after[None])[0]
        at_before = statics.accelerations(before[None])[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes[:, :, k] = (at_after - at_before) / span[:, None]
    # rows of equal size, so that no acceleration is neglected beside a large one
    scale = np.abs(slopes).max(axis=2)
    scale[scale == 0.0] = 1.0
    scaled = slopes / scale[:, :, None]
    change = _least_squares(scaled, f / scale, 1e-14)
    return np.asarray(-sizes * change)
