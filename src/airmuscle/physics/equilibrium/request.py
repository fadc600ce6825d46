"""Arguments of the search for equilibria: pressures or air masses of the muscles, and inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from ...core.annotation import one_line
from ...core.errors import ParameterError
from ...core.system import System
from ...core.units import quantity
from ...engine.loop.inputs import check_input_names
from .static_plant import StaticPlant

MuscleValues: TypeAlias = float | str | Sequence[float | str] | None
"""One number for all muscles, or one for each; None where the other quantity is given."""


def air_of_each(plant: StaticPlant, pressure: MuscleValues, air_mass: MuscleValues) -> tuple[float, ...]:
    """The given pressures [Pa] or air masses [kg], one for each muscle. Raises ParameterError or UnitError."""
    if (pressure is None) == (air_mass is None):
        raise ParameterError("find_equilibrium: give either the pressure [Pa] or the air_mass [kg] of the muscles.")
    name, given, unit = ("pressure", pressure, "Pa") if air_mass is None else ("air_mass", air_mass, "kg")
    where = f"find_equilibrium: {name}"
    several: Sequence[Any] = given if isinstance(given, tuple | list) else (given,) * len(plant.muscles)
    ambient = plant.ambient.pressure
    values = [quantity(v, unit, ambient=ambient, where=where) if isinstance(v, str) else v for v in several]
    if len(values) != len(plant.muscles):
        raise ParameterError(
            f"find_equilibrium: {name} has {len(values)} values; the plant has {len(plant.muscles)} muscles."
        )
    for value in values:
        if not isinstance(value, float | int | np.floating) or not np.isfinite(value):
            names = ", ".join(prefix.removesuffix(".") for prefix in plant.prefixes)
            raise ParameterError(
                f"find_equilibrium: {name} is {one_line(value)}; it must be a finite number in {unit}"
                f"{f', or a tuple with the values of {names}' if len(plant.muscles) > 1 else ''}."
            )
        if air_mass is not None and not value > 0:
            raise ParameterError(f"find_equilibrium: air_mass is {value:g} kg; it must be greater than 0.")
    return tuple(float(value) for value in values if value is not None)


def complete_inputs(system: System, inputs: Mapping[str, float] | None) -> dict[str, float]:
    """Every input of a system, 0 unless given. Raises ParameterError for an unknown name or one beyond its range."""
    given = dict(inputs or {})
    check_input_names(list(given), system.inputs)
    for variable in system.input_variables:
        value = given.get(variable.name, 0.0)
        if isinstance(value, str) or not np.ndim(value) == 0 or not np.isfinite(value):
            raise ParameterError(
                f"the input '{variable.name}' is {value!r}; it must be one finite number, in SI units."
            )
        if not variable.minimum <= value <= variable.maximum:
            unit = "" if variable.unit in ("", "1") else f" {variable.unit}"
            raise ParameterError(
                f"the input '{variable.name}' is {value:g}{unit}; allowed range: {variable.minimum:g} to "
                f"{variable.maximum:g}{unit} ({variable.meaning})."
            )
    return {name: float(given.get(name, 0.0)) for name in system.inputs}
