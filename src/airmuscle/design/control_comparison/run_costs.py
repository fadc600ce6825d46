"""Costs of a run: air from the supplies and travel of the valves."""

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...physics import Plant
from ...physics.pneumatics import FillDischarge, WithTubes, absolute_pressure
from ...recording import Recording

TORQUE_INPUT = "external_torque"
Mask = npt.NDArray[np.bool_]


def drawn_flow(plant: Plant, record: Recording) -> Array:
    """The mass flow (N,) [kg/s] from the supplies, also what a stuck valve loses; else that into
    the muscle.
    """
    flow = np.zeros(len(record["time"]))
    for muscle, circuit in zip(plant.muscles, plant.circuits, strict=True):
        inner = circuit.circuit if isinstance(circuit, WithTubes) else circuit
        if not isinstance(inner, FillDischarge):
            flow += np.maximum(record[f"{muscle.name}.mass_flow"], 0.0)
            continue
        air = inner.supply.air({}, plant.ambient)
        tube = f"{muscle.name}.tube.pressure"
        pressure = record[tube] if tube in record.columns else record[f"{muscle.name}.pressure"]
        opening = np.asarray(record[f"{muscle.name}.fill"])
        absolute = absolute_pressure(np.asarray(pressure), plant.ambient)
        flow += np.maximum(
            inner.fill.mass_flow(air.pressure, absolute, opening, air.temperature), 0.0
        )
    return flow


def valve_travel(plant: Plant, record: Recording, judged: Mask) -> Array:
    """Travel of each valve [full strokes/s] between the samples."""
    commands = [record[f"command.{name}"][judged] for name in plant.inputs if name != TORQUE_INPUT]
    return np.asarray(np.abs(np.diff(commands)).sum(axis=1) / np.ptp(record["time"][judged]))
