"""A state that is given by names: refused where it cannot be, and as the vector of its system."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ..compile import System
from ..core.arrays import Array
from ..core.declaration import as_float
from ..core.errors import ParameterError, suggestion
from ..core.variables import select_prefix
from .plant import Plant

ROUNDING = 1e-3
"""Share of its nominal size by which a tolerance may carry air below zero (chosen)."""
_OF_AIR = ("air_mass", "internal_energy")


def check_system(what: str, given: object) -> None:
    """Raise ParameterError for what has no states, inputs, rates and outputs, as a muscle or a class."""
    if isinstance(given, type) or not all(hasattr(given, name) for name in ("states", "inputs", "rates", "outputs")):
        raise ParameterError(f"{what}: {str(given)[:80]} is no plant; give Plant(muscle, circuit, mechanism).")


def state_vector(system: System, state: Mapping[str, float]) -> Array:
    """The values (n,) of a state, in the order of the system's.

    Raises ParameterError for an unknown or missing name, for what is no finite number, and for less air than none.
    """
    names = [s.name for s in system.states]
    if not isinstance(state, Mapping):
        raise ParameterError(
            f"the start is {state!r}; give a value for each name, as plant.state_at(...) and equilibrium(...) do."
        )
    for name in state:
        if name not in names:
            near = suggestion(str(name), names)
            raise ParameterError(f"the plant has no state '{name}'; there are {', '.join(names)}.{near}")
    missing = [name for name in names if name not in state]
    if missing:
        raise ParameterError(f"the start lacks {', '.join(missing)}; use plant.state_at(pressure=...) or equilibrium.")
    values = np.array([as_float(f"the start's {name}", state[name]) for name in names], dtype=float)
    if not np.isfinite(values).all():
        raise ParameterError(f"the start must be finite; it is {dict(zip(names, values.tolist(), strict=True))}.")
    for i in np.flatnonzero(has_negative_mass(system, values)):
        raise ParameterError(
            f"the start's {names[i]} is {values[i]:g} {system.states[i].unit}; there is no less air than none. Use "
            "plant.state_at(pressure=...)."
        )
    return values


def has_negative_mass(system: System, values: Array) -> npt.NDArray[np.bool_]:
    """For states (..., n) of a Plant, where there is less air than none: a step was far too long for its valves."""
    return np.asarray(values < state_lower_bounds(system))


def state_lower_bounds(system: System) -> Array:
    """What each state (n,) of a Plant may be at least, lest there be less air than none; elsewhere minus infinity."""
    of_air = _OF_AIR if isinstance(system, Plant) else ()
    return np.array([-ROUNDING * s.nominal if s.name.endswith(of_air) else -np.inf for s in system.states])


def check_state(plant: Plant, state: Mapping[str, float]) -> None:
    """Raise OutOfReach where a muscle cannot take its contraction, ParameterError where it encloses nothing."""
    contractions = plant.mechanism.contractions(state, plant.resting_lengths)
    for muscle, prefix, contraction in zip(plant.muscles, plant.prefixes, contractions, strict=True):
        own = select_prefix(prefix, state)
        inner = muscle.inner_contraction(contraction, own)
        muscle.geometry.check_contraction(inner)
        volume = muscle.volume(inner, own)
        if not volume > 0.0:
            raise ParameterError(
                f"the start: {muscle.name} encloses {volume:g} m3 at a contraction of {contraction:.2%}; choose one "
                "further within its reach."
            )
