"""Registered tasks: a plant of the library, a task, and a randomisation each; ranges are chosen."""

from __future__ import annotations

import dataclasses
import functools
import math
import warnings

from ...core.errors import AirmuscleWarning
from ...files.library.catalogue import load
from ...files.library.entry import Entry, PlantEntry, ValveEntry
from ...physics.mechanism import HangingMass
from ...physics.muscle import LinearDamper
from ...physics.plant import Plant
from ...physics.pneumatics import FillDischarge, Supply
from .arm import ArmReaching
from .joint import JointTracking
from .lift import LoadLifting
from .randomisation import FactorRange, Randomisation, ValueRange

TaskWithRandomisation = tuple[JointTracking | LoadLifting | ArmReaching, tuple[Randomisation, ...]]


@functools.cache
def joint_task() -> TaskWithRandomisation:
    """Tracking by joint-dmsp-20-matrix; sines of 0.1 to 0.4 rad and 0.1 to 0.8 Hz, inertia and supply vary."""
    return JointTracking(_library_plant("joint-dmsp-20-matrix")), (
        ValueRange(("target_amplitude",), 0.1, 0.4),
        ValueRange(("target_frequency",), 0.1, 0.8),
        ValueRange(("target_phase",), 0.0, 2.0 * math.pi),
        FactorRange(("plant.mechanism.inertia",), 0.8, 1.2),
        FactorRange(("plant.mechanism.weight_torque",), 0.7, 1.3),
        FactorRange(("plant.circuit[0].supply.pressure", "plant.circuit[1].supply.pressure"), 0.8, 1.0),
    )


@functools.cache
def lift_task() -> TaskWithRandomisation:
    """Lifting of 15 to 25 kg by dmsp-20-300 with MATRIX 821 valves at 6 bar to heights of 10 to 40 mm."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        entry, valve_entry = load("dmsp-20-300"), load("matrix-821")
    assert isinstance(entry, Entry)
    assert isinstance(valve_entry, ValveEntry)
    muscle, valve = dataclasses.replace(entry.muscle, damper=LinearDamper(200.0)), valve_entry.valve
    plant = Plant(muscle, FillDischarge(Supply(6e5), valve, valve), HangingMass(20.0))
    return LoadLifting(plant), (
        ValueRange(("target_height",), 0.01, 0.04),
        FactorRange(("plant.mechanism.mass",), 0.75, 1.25),
        FactorRange(("plant.circuit.supply.pressure",), 0.8, 1.0),
    )


@functools.cache
def arm_task() -> TaskWithRandomisation:
    """Reaching by the arm of Lilly and Quesada: reference angles within 0.1 rad, masses vary."""
    masses = ("plant.mechanism.links[0].mass", "plant.mechanism.links[1].mass")
    return ArmReaching(_library_plant("arm-lilly-quesada")), (
        ValueRange(("targets[0]",), -0.1, 0.1),
        ValueRange(("targets[1]",), -0.1, 0.1),
        FactorRange(masses, 0.8, 1.2),
    )


def _library_plant(name: str) -> Plant:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        entry = load(name)
    assert isinstance(entry, PlantEntry)
    return entry.plant
