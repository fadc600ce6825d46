"""Valves of a choice: sonic conductance with which a muscle is filled or discharged in a given time.

    C = 1/t integral of dm/q(p),   q = mass flow of a valve of unit conductance after ISO 6358

Along the quasi-static path between the end points the pressure p balances the load, and m = p V/(R T).
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.errors import SolveError
from ...physics.pneumatics import Orifice, Valve
from ...physics.pneumatics.gas import Isothermal, absolute_pressure
from .choice import MuscleChoice
from .requirement import LiftRequirement

STATIONS = 65
"""Stations of the quasi-static path (chosen)."""
CRITICAL_RATIO = 0.3
"""Critical pressure ratio of the valves (chosen)."""
TRIAL = 1e-8
"""Conductance [m3/(s Pa)] for which the time is computed first; the time is inversely proportional to it."""


@dataclasses.dataclass(frozen=True, eq=False)
class AirPath:
    """Absolute pressures [Pa] and air masses [kg] of one muscle along the path from long to short, (N,) each."""

    pressure: Array
    mass: Array


def air_path(choice: MuscleChoice) -> AirPath:
    """The quasi-static path of one muscle; with a joint, pressure and contraction are proportional on it.

    Raises SolveError for a choice without a geometry.
    """
    muscle, ambient = choice.muscle, choice.conditions.ambient
    if muscle.muscle is None:
        raise SolveError(
            f"{choice.entry.name}: the enclosed volume is not known, because its law has no geometry; valves and a "
            "scenario need it. Write a muscle file with a table [geometry]."
        )
    first, last = choice.design.extended, choice.design.contracted
    fraction = np.linspace(0.0, 1.0, STATIONS)
    contractions = first.contraction + fraction * (last.contraction - first.contraction)
    if isinstance(choice.requirement, LiftRequirement):
        loads = [choice.requirement.load(f * choice.requirement.stroke) / choice.count for f in fraction.tolist()]
        points = zip(contractions.tolist(), loads, strict=True)
        pressures = np.array([muscle.end_point(eps, load).pressure for eps, load in points])
    else:
        pressures = first.pressure + fraction * (last.pressure - first.pressure)
    volumes = np.array(
        [muscle.volume(p, eps) for p, eps in zip(pressures.tolist(), contractions.tolist(), strict=True)]
    )
    absolute = np.asarray(absolute_pressure(pressures, ambient))
    return AirPath(absolute, np.asarray(Isothermal().air_mass(absolute, volumes, ambient)))


def fill_valve(choice: MuscleChoice, duration: float) -> Valve:
    """Valve between the supply and one muscle that fills it in a time [s]. Raises SolveError."""
    return _valve(choice, fill_time(choice, Valve(TRIAL, CRITICAL_RATIO)), duration)


def discharge_valve(choice: MuscleChoice, duration: float) -> Valve:
    """Valve between one muscle and the surroundings that discharges it in a time [s]. Raises SolveError."""
    return _valve(choice, discharge_time(choice, Valve(TRIAL, CRITICAL_RATIO)), duration)


def fill_time(choice: MuscleChoice, orifice: Orifice, path: AirPath | None = None) -> float:
    """Time [s] in which an open valve at the supply fills one muscle. Raises SolveError."""
    path, ambient = path or air_path(choice), choice.conditions.ambient
    supply = absolute_pressure(choice.conditions.supply, ambient)
    return _time(orifice.mass_flow(supply, path.pressure, 1.0, ambient.temperature), path)


def discharge_time(choice: MuscleChoice, orifice: Orifice, path: AirPath | None = None) -> float:
    """Time [s] in which an open valve discharges one muscle into the surroundings. Raises SolveError."""
    path, ambient = path or air_path(choice), choice.conditions.ambient
    return _time(orifice.mass_flow(path.pressure, ambient.pressure, 1.0, ambient.temperature), path)


def _time(flow: Any, path: AirPath) -> float:
    slowness = 1.0 / np.maximum(flow, 1e-300)
    return float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(path.mass)))


def _valve(choice: MuscleChoice, time: float, duration: float) -> Valve:
    """The valve that moves the air in a duration; `time` is that of the trial conductance."""
    limit = 1e-5
    conductance = TRIAL * time / duration
    if not 0.0 < conductance <= limit:
        raise SolveError(
            f"{choice.entry.name}: to move its air in {duration:.3g} s, a valve needs a sonic conductance of "
            f"{1e8 * conductance:.4g} dm3/(s bar); allowed range: above 0 to {1e8 * limit:.4g}. Give a longer cycle "
            "time."
        )
    return Valve(conductance, CRITICAL_RATIO)
