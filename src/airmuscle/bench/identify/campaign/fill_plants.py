"""Plants of the fills and discharges of a campaign: a held muscle behind valves, with a supply and perhaps a tube."""

import dataclasses

import numpy as np

from ....core import tree
from ....physics.mechanism import Isometric
from ....physics.muscle import Muscle
from ....physics.muscle.geometry import Vessel
from ....physics.plant.plant import Plant
from ....physics.pneumatics import EnergyBalance, FillDischarge, Supply, Tube, Valve, WithTubes
from ..dynamic import stated_ambient
from .record import CampaignRecord

ASSUMED_CONDUCTANCE = 1e-8
"""Conductance [m3/(s Pa)] for which the relative volumes are fitted (chosen)."""
HEAT_TRANSFER, HEAT_TRANSFER_BOUNDS = "gas.heat_transfer", (1e-3, 1e3)
"""Path of the heat transfer, and its bounds [W/K] (chosen)."""


def held_contraction(record: CampaignRecord) -> float:
    """The contraction at which the muscle is held."""
    return float(np.median(record.recording["contraction"]))


def vessel_plant(record: CampaignRecord) -> Plant:
    """The plant of a held muscle, with initial values from the steps of the record and the ambient air it states."""
    rising = [step for step in record.steps if step.change > 0]
    top = max(step.final_pressure for step in record.steps) if rising else float(record.recording["pressure"][0])
    duration = float(np.mean([step.duration for step in record.steps]))
    volume = ASSUMED_CONDUCTANCE * 1e5 * duration / 1.2
    muscle = Muscle.ideal(Vessel(min(max(volume, 2e-7), 5e-2), record.resting_length or 0.2))
    valve = Valve(ASSUMED_CONDUCTANCE, 0.35)
    circuit = FillDischarge(Supply(top + 5e3), valve, valve)
    return Plant(
        muscle, circuit, Isometric(held_contraction(record)), EnergyBalance(1.0), stated_ambient(record.recording)
    )


def plant_of(plant: object) -> Plant:
    """The plant of a fill, which the records of a fit keep as any system."""
    assert isinstance(plant, Plant)
    return plant


def valves_of(circuit: object) -> FillDischarge:
    """The circuit of the valves, without a tube."""
    valves = circuit.circuit if isinstance(circuit, WithTubes) else circuit
    assert isinstance(valves, FillDischarge)
    return valves


def rescaled(plant: Plant, scale: float) -> Plant:
    """The plant with its conductances, heat transfer and volumes of supply and tube multiplied by the scale."""
    values = {leaf.path: leaf.value for leaf in tree.leaves(plant)}
    for path, value in values.items():
        if path == HEAT_TRANSFER:
            values[path] = float(np.clip(value * scale, *HEAT_TRANSFER_BOUNDS))
        elif path.startswith("circuit.") and path.endswith(("conductance", "volume")):
            values[path] = value * scale
    changed: Plant = tree.with_parameters(plant, list(values.values()))
    return changed


def at_record(plant: Plant, record: CampaignRecord, volume: float) -> Plant:
    """The plant with this volume [m3], at the held length and in the ambient air of a record."""
    vessel = Vessel(volume, plant.muscles[0].geometry.resting_length)
    return dataclasses.replace(
        plant, muscle=Muscle.ideal(vessel), mechanism=Isometric(held_contraction(record)),
        ambient=stated_ambient(record.recording),
    )  # fmt: skip


def tube_guess(plant: Plant) -> Tube:
    """Initial guess of a tube for a plant without one (chosen): a tenth of its volume, twice the conductance."""
    valve = valves_of(plant.circuit).fill
    assert isinstance(valve, Valve)
    volume = min(max(0.1 * volume_at_rest(plant), 1e-9), 1e-2)
    return Tube(Valve(2.0 * valve.conductance, 0.3), volume)


def volume_at_rest(plant: Plant) -> float:
    """Volume of the first muscle of a plant at its resting length [m3]."""
    return float(plant.muscles[0].geometry.volume(0.0))


def sensor_of(plant: Plant) -> str:
    """The output at the pressure sensor of a plant, which is behind the valves: in the first segment of a tube."""
    circuit = plant.circuit
    return f"{circuit.tube.prefixes[0]}pressure" if isinstance(circuit, WithTubes) else "pressure"
