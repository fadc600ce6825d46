"""Validation of the parts of a plant: types, numbers, names, closed-form laws."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import (
    ParameterError,
    TraceError,
    at_ambient,
    check_above_vacuum,
    one_line,
    quantity,
    with_ambient,
)
from ...core.declaration import as_finite_float, check_structure, parameters
from ..mechanism import Mechanism
from ..muscle import Muscle
from ..muscle.characteristic.validity_range import ValidityRange
from ..pneumatics import Ambient, Circuit, Gas, check_not_shared


def check_parts(plant: Any) -> None:
    """Raise ParameterError for parts that do not form a plant, TraceError for a law without closed
    form.
    """
    parts: list[tuple[str, Any, type[Any]]] = [
        ("mechanism", plant.mechanism, Mechanism),
        ("gas", plant.gas, Gas),
    ]
    parts += [("ambient", plant.ambient, Ambient)]
    parts += [("muscle", m, Muscle) for m in plant.muscles] + [
        ("circuit", c, Circuit) for c in plant.circuits
    ]
    for field, part, kind in parts:
        if not isinstance(part, kind):
            hint = " Put several into a tuple." if isinstance(part, list) else ""
            hint = f" It has one: give its .{field}." if hasattr(part, field) else hint
            raise ParameterError(
                f"Plant: its {field} must be a {kind.__name__}; it is {one_line(part)}.{hint}"
            )
    for muscle, part in ((m, part) for m in plant.muscles for part in (m.contractile, m.geometry)):
        if not part.traceable:
            raise TraceError(
                f"{type(part).__name__} of {muscle.name} is not closed-form and cannot be part of a"
                " plant. Use as_force_law(law, validity_range) for a characteristic,"
                " as_polynomial(geometry) for a geometry."
            )
    _check_limits_of_laws(plant.muscles)
    check_structure((tuple(plant.muscles), tuple(plant.circuits), plant.mechanism))
    _check_counts(plant.muscles, plant.circuits, plant.mechanism)
    _check_held_pressures(plant.circuits, plant.mechanism)
    if isinstance(plant.circuit, tuple) and any(c.port_count != 1 for c in plant.circuits):
        raise ParameterError(
            "Plant: give a circuit that feeds several muscles alone, not in a tuple."
        )


def _check_limits_of_laws(muscles: Sequence[Muscle]) -> None:
    """Raise ParameterError for a law whose validity range is not within the bounds of one."""
    limits = parameters(ValidityRange)
    ranged = (
        m.contractile
        for m in muscles
        if all(hasattr(m.contractile, limit.name) for limit in limits)
    )
    for law, declared in itertools.product(ranged, limits):
        limit = getattr(law, declared.name)
        low, high = declared.bounds
        # a limit may be a column (N,)
        smallest = float(np.min(limit))
        largest = float(np.max(limit))
        if not low <= smallest <= largest <= high:
            unit = "" if declared.unit == "1" else f" {declared.unit}"
            raise ParameterError(
                f"{type(law).__name__}.{declared.name} ({declared.symbol}, {declared.meaning}) is"
                f" {smallest if smallest < low else largest:g}{unit}; allowed range: {low:g} to"
                f" {high:g}{unit}."
            )


def convert_pressures(plant: Any) -> None:
    """Convert the pressures that parts of a plant state as absolute with its ambient air, then
    check supplies.

    Raises ParameterError for a placeholder of a supply, and for a supply that cannot exist in the
    ambient air.
    """
    for name in ("muscle", "circuit", "mechanism"):
        part = with_ambient(getattr(plant, name), plant.ambient.pressure)
        if part is not getattr(plant, name):
            object.__setattr__(plant, name, part)
            plant.__dict__.pop(f"{name}s", None)  # derived from the part before
    for circuit in plant.circuits:
        check_not_shared(f"Plant: its {type(circuit).__name__}", circuit.supply)
        circuit.supply.check_ambient(plant.ambient)


def _check_counts(
    muscles: Sequence[Muscle], circuits: Sequence[Circuit], mechanism: Mechanism
) -> None:
    names = [m.name for m in muscles]
    if not names:
        raise ParameterError("Plant: it has no muscle; give one, or a tuple of them.")
    ports = sum(c.port_count for c in circuits)
    if ports != len(names):
        raise ParameterError(f"Plant: its circuits feed {ports} muscles; {len(names)} are given.")
    if mechanism.muscle_count not in (None, len(names)):
        owner = type(mechanism).__name__
        raise ParameterError(
            f"Plant: {owner} takes {mechanism.muscle_count} muscles; {len(names)} are given."
        )
    if len(set(names)) < len(names):
        raise ParameterError(f"Plant: muscles need different names; they are {names}.")


def _check_held_pressures(circuits: Sequence[Circuit], mechanism: Mechanism) -> None:
    """Raise ParameterError for a residual that depends on pressures which the circuits do not
    hold.
    """
    if not mechanism.needs_held_pressures:
        return
    for circuit in circuits:
        if not circuit.holds_pressure:
            raise ParameterError(
                "Plant: its mechanism has a GaussianResidual, which depends on pressures and holds"
                f" only where they are controlled; {type(circuit).__name__} can shut the air in,"
                " and a closed cycle would then give energy that no air pays for. Give each muscle"
                " a ProportionalRegulator or a PressureRegulator, or remove the residual"
                " (residual=None)."
            )


def as_quantity(where: str, value: Any, unit: str, ambient: Ambient) -> float:
    """A finite number in SI, also from a text with a unit; absolute pressures are converted with
    `ambient`.

    Raises ParameterError or UnitError.
    """
    if isinstance(value, str):
        return quantity(value, unit, ambient=ambient.pressure, where=where)
    return as_finite_float(where, at_ambient(value, ambient.pressure))


def check_pressures(
    pressure: float | str | Sequence[float | str], muscles: int, ambient: Ambient
) -> list[float]:
    """The gauge pressure [Pa] of each muscle, from one for all or one for each; also texts with a
    unit.

    Raises UnitError, and ParameterError for a pressure that is not above absolute vacuum and for
    another number than of muscles.
    """
    stated = pressure if isinstance(pressure, tuple | list) else (pressure,) * muscles
    pressures = [as_quantity("Plant: the pressure of a state", p, "Pa", ambient) for p in stated]
    if len(pressures) != muscles:
        raise ParameterError(f"Plant: {len(pressures)} pressures are given for {muscles} muscles.")
    for value in pressures:
        check_above_vacuum(value, ambient.pressure)
    return pressures
