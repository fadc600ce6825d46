"""State vector of a system from values by name, checked; units of the columns of a run."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..core import Array, ParameterError, System, abridged, as_float, one_line, suggestion
from ..recording.columns import quantity_of


def check_system(what: str, given: object) -> None:
    """Raise ParameterError for anything that is not a System, such as a muscle or a class."""
    if not isinstance(given, System):
        raise ParameterError(f"{what}: {one_line(given)} is no plant; give Plant(muscle, circuit, mechanism).")


def state_vector(system: System, state: Mapping[str, float]) -> Array:
    """The values (n,) of a state, in the order of the system's states.

    Raises ParameterError for an unknown or missing name, a value that is no finite number, and a value below the lower
    bound of its state, such as a negative air mass.
    """
    names = [s.name for s in system.states]
    if not isinstance(state, Mapping):
        raise ParameterError(
            f"the initial state is {abridged(state)}; give a value for each name, as plant.state_at(...) and "
            "find_equilibrium(...) do."
        )
    if len(state) != len(names) or any(name not in state for name in names):
        _check_names(names, state)
    values = np.array([as_float(f"the initial state's {name}", state[name]) for name in names], dtype=float)
    if not np.isfinite(values).all():
        raise ParameterError(
            f"the initial state must be finite; it is {dict(zip(names, values.tolist(), strict=True))}."
        )
    for i in np.flatnonzero(values < np.asarray(system.state_lower_bounds)):
        raise ParameterError(
            f"the initial state's {names[i]} is {values[i]:.4g} {system.states[i].unit}; it must not be negative. Use "
            "plant.state_at(pressure=...)."
        )
    return values


def _check_names(names: list[str], state: Mapping[str, float]) -> None:
    for name in state:
        if name not in names:
            near = suggestion(str(name), names)
            raise ParameterError(
                f"the plant has no state '{one_line(name)}'; there are {', '.join(names)}.{near} "
                "plant.state_at(pressure=...) gives the state with a pressure."
            )
    missing = [name for name in names if name not in state]
    raise ParameterError(
        f"the initial state lacks {', '.join(missing)}; use plant.state_at(pressure=...) or find_equilibrium."
    )


def column_units(system: System, outputs: Sequence[str]) -> dict[str, str]:
    """The unit of every state, input and output; empty where none is known."""
    units = {name: getattr(quantity_of(name), "unit", "") for name in outputs}
    units |= {i.name: i.unit for i in system.input_variables}
    return {**units, **system.output_units, **{s.name: s.unit for s in system.states}}
