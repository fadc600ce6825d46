"""Scenario of a choice: a lift with on/off valves or a joint with pressure regulators, as text for
`load_scenario`.
"""

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np

from ...core import STANDARD_GRAVITY, AirmuscleError, Array, SolveError
from ...files.library.write import scenario_toml
from ...physics import (
    AntagonisticJoint,
    Geometry,
    HangingMass,
    Isotonic,
    LinearDamper,
    Mechanism,
    Muscle,
    Plant,
    Ratings,
    SpringLoad,
    ValidityRange,
    as_force_law,
)
from ...physics.pneumatics import (
    FillDischarge,
    Orifice,
    ProportionalRegulator,
    SecondOrderLag,
    Supply,
    Valve,
)
from ...physics.pneumatics.gas import Isothermal, absolute_pressure
from .requirement_and_choice import (
    JointRequirement,
    MuscleChoice,
    PullRequirement,
    SizingConditions,
)

STATIONS = 65
"""Stations of the quasi-static path (chosen)."""
CRITICAL_RATIO = 0.3
"""Critical pressure ratio of the valves (chosen)."""
TRIAL = 1e-8
"""Conductance [m3/(s Pa)] for which the time is computed first; the time is inversely proportional
to it.
"""


class AirPath(NamedTuple):
    """Absolute pressures [Pa] and air masses [kg] of one muscle along the path from long to short,
    (N,) each.
    """

    pressure: Array
    mass: Array
    conditions: SizingConditions

    def time(self, orifice: Orifice, *, filling: bool) -> float:
        """Time [s] in which an open valve fills one muscle from the supply, or discharges it into
        the surroundings.
        """
        ambient = self.conditions.ambient
        if filling:
            supply = absolute_pressure(self.conditions.supply, ambient)
            flow = orifice.mass_flow(supply, self.pressure, 1.0, ambient.temperature)
        else:
            flow = orifice.mass_flow(self.pressure, ambient.pressure, 1.0, ambient.temperature)
        slowness = 1.0 / np.maximum(flow, 1e-300)
        return float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(self.mass)))


def air_path(choice: MuscleChoice) -> AirPath:
    """The quasi-static path of one muscle; with a joint, pressure and contraction are proportional
    on it.

    Raises SolveError for a choice without a geometry.
    """
    muscle = choice.muscle
    ambient = choice.conditions.ambient
    _known_geometry(choice)
    first = choice.design.extended
    last = choice.design.contracted
    fraction = np.linspace(0.0, 1.0, STATIONS)
    contractions = first.contraction + fraction * (last.contraction - first.contraction)
    if isinstance(choice.requirement, PullRequirement):
        loads = [
            choice.requirement.load(f * choice.requirement.travel) / choice.count
            for f in fraction.tolist()
        ]
        points = zip(contractions.tolist(), loads, strict=True)
        pressures = np.array([muscle.end_point(eps, load).pressure for eps, load in points])
    else:
        pressures = first.pressure + fraction * (last.pressure - first.pressure)
    volumes = np.array(list(map(muscle.volume, pressures.tolist(), contractions.tolist())))
    absolute = np.asarray(absolute_pressure(pressures, ambient))
    return AirPath(
        absolute, np.asarray(Isothermal().air_mass(absolute, volumes, ambient)), choice.conditions
    )


def _known_geometry(choice: MuscleChoice) -> Geometry:
    """The geometry of a choice, which gives its volume. Raises SolveError without one."""
    if choice.entry.geometry is None:
        raise SolveError(
            f"{choice.entry.name}: the enclosed volume is not known, because its law has no"
            " geometry; valves and a scenario need it. Write a muscle file with a table"
            " [geometry]."
        )
    return choice.entry.geometry


def fill_valve(choice: MuscleChoice, duration: float) -> Valve:
    """Valve between the supply and one muscle that fills it in a time [s]. Raises SolveError."""
    return _valve(choice, duration, filling=True)


def discharge_valve(choice: MuscleChoice, duration: float) -> Valve:
    """Valve between one muscle and the surroundings that discharges it in a time [s]. Raises
    SolveError.
    """
    return _valve(choice, duration, filling=False)


def _valve(choice: MuscleChoice, duration: float, *, filling: bool) -> Valve:
    limit = 1e-5
    conductance = (
        TRIAL * air_path(choice).time(Valve(TRIAL, CRITICAL_RATIO), filling=filling) / duration
    )
    if not 0.0 < conductance <= limit:
        raise SolveError(
            f"{choice.entry.name}: to move its air in {duration:.3g} s, a valve needs a sonic"
            f" conductance of {1e8 * conductance:.4g} dm3/(s bar); allowed range: above 0 to"
            f" {1e8 * limit:.4g}. Give a longer cycle time."
        )
    return Valve(conductance, CRITICAL_RATIO)


MOVING = 0.375
RESTING = 0.125
"""Parts of the cycle for each motion and for each rest (chosen)."""
DAMPING_RATIO = 0.7
"""Damping ratio of the load on the stiffness of the muscles in the middle of the motion
(chosen).
"""
FORCE_MASS = 0.1
"""Moving mass of a load that is a force: this part of the mass with the same weight (chosen)."""
LAG = SecondOrderLag(20.0)
"""Lag of the set point of a regulator (chosen)."""
BAND = 5e3
"""Proportional band of a regulator [Pa] (chosen)."""
OVERTRAVEL = 0.03
"""Contraction [1] beyond both end points for which the polynomial of a law holds (chosen)."""
SURROGATE_DEGREE = 11
"""Degree of that polynomial (chosen)."""
JOINT_MASS_TIME = 0.1
"""Inertia of a joint without a stated one: the torque turns it over its range in this part of the
cycle (chosen).
"""


def scenario_text(choice: MuscleChoice) -> str:
    """The scenario of a choice, with the chosen values in comments at its beginning.

    Several muscles on each side of a joint are equal pairs on one axis, which move alike: the
    scenario is one pair with its part of torque and inertia. Raises SolveError for a choice without
    a geometry.
    """
    is_lift = isinstance(choice.requirement, PullRequirement)
    modelled = plant_muscle(choice)
    build = _lift if is_lift else _joint
    plant, inputs, run, is_inertia_chosen = build(choice, modelled.muscle)
    damper = (
        "" if choice.entry.damper is not None else f", the damper (damping ratio {DAMPING_RATIO:g})"
    )
    inertia = ", the moving mass or inertia" if is_inertia_chosen else ""
    notes = [
        "Sized by airmuscle size; SI units.",
        "The valves are sized after ISO 6358 to fill and to discharge in"
        f" {100 * MOVING:.4g} % of the cycle.",
        "Chosen: this part, the critical pressure ratio of the valves, isothermal"
        f" air{damper}{inertia}.",
        f"Volume: {choice.geometry_source}.",
    ]
    notes += [modelled.note] if modelled.note else []
    if is_lift:
        notes.append(
            "The times of the valves are for isothermal air: with the default gas, which warms"
            " while it fills, they lift 3 to 6 % of the stroke too far. Delete the gas to see it,"
            " and close a loop where that matters."
        )
    else:
        notes.append(
            "Chosen: the regulators, and a pendulum that gives the torque at both ends of the"
            " range."
        )
        if choice.count > 1:
            notes.append(
                f"The joint has {choice.count} equal pairs of muscles, which move alike. This is"
                f" one of them, with 1/{choice.count} of torque and inertia."
            )
    title = f"{choice.size}{choice.by_law}: {choice.requirement.describe()}"
    return scenario_toml(title, plant, inputs, run, "\n".join(notes))


class PlantMuscle(NamedTuple):
    """The muscle of a choice for a plant, and a sentence on how its law is approximated there."""

    muscle: Muscle
    note: str


def plant_muscle(choice: MuscleChoice) -> PlantMuscle:
    """The muscle of a choice for a plant; a law that a plant cannot evaluate, such as a table, is
    a polynomial in the part of its range that the motion needs.

    Raises SolveError for a choice without a geometry.
    """
    muscle = choice.muscle
    if muscle.muscle is not None:
        return PlantMuscle(muscle.muscle, "")
    entry = choice.entry
    geometry = _known_geometry(choice)
    low, high = muscle.contraction_range
    first = max(low, choice.design.extended.contraction - OVERTRAVEL)
    last = min(high, choice.design.contracted.contraction + OVERTRAVEL)
    valid = ValidityRange(*muscle.pressure_range, first, last)
    law = as_force_law(entry.characteristic, valid, degree=SURROGATE_DEGREE)
    ratings = entry.ratings or Ratings()
    note = (
        f"Law: {entry.name} as a polynomial of pressure and contraction, with an error of at most"
        f" about {law.max_error:.2g} N."
    )
    return PlantMuscle(Muscle(law, geometry, validity_range=valid, ratings=ratings), note)


class SizingScenario(NamedTuple):
    """The scenario of a choice: text, and a sentence on it; the text is empty where there is
    none.
    """

    text: str
    note: str


def sizing_scenario(choice: MuscleChoice, file: str) -> SizingScenario:
    """The scenario of a choice; the sentence names `file`, or the reason why there is none."""
    try:
        text = scenario_text(choice)
    except AirmuscleError as error:
        return SizingScenario("", f"No scenario is written: {error}")
    return SizingScenario(
        text,
        f"The scenario of this choice, {choice.size}, is {file}; run airmuscle simulate with it.",
    )


def scenario_valves(choice: MuscleChoice) -> tuple[Valve, Valve]:
    """Fill and discharge valve of each muscle in the scenario of a choice."""
    duration = MOVING * choice.conditions.cycle_time
    return fill_valve(choice, duration), discharge_valve(choice, duration)


def _muscles(
    choice: MuscleChoice, muscle: Muscle, names: tuple[str, ...], damping: float
) -> tuple[Muscle, ...]:
    damper = muscle.damper if choice.entry.damper is not None else LinearDamper(damping)
    return tuple(dataclasses.replace(muscle, name=name, damper=damper) for name in names)


def _stiffness(choice: MuscleChoice, muscle: Muscle) -> float:
    """Stiffness [N/m] of one muscle at constant pressure in the middle between its end points."""
    first = choice.design.extended
    last = choice.design.contracted
    pressure = 0.5 * (first.pressure + last.pressure)
    contraction = 0.5 * (first.contraction + last.contraction)
    stiffness = float(muscle.stiffness(pressure, contraction))
    return max(stiffness, 0.0) / choice.length


def _load(choice: MuscleChoice, requirement: PullRequirement) -> tuple[Mechanism, float]:
    """The mechanism of a lift and its moving mass [kg]; the position 0 is that of the muscles at
    rest.
    """
    start = choice.design.extended.contraction * choice.length
    weight = requirement.load(0.0)
    stiffness = requirement.stiffness_at_muscle
    mass = requirement.moving_mass or FORCE_MASS * weight / STANDARD_GRAVITY
    if stiffness < 0.0:
        raise SolveError(
            "the scenario of a load that decreases over the stroke is not written; give a constant"
            " load."
        )
    if stiffness:
        return SpringLoad(mass, stiffness, preload=weight - stiffness * start), mass
    if mass * STANDARD_GRAVITY == weight:
        return HangingMass(mass), mass
    return Isotonic(weight, mass), mass


def _lift(
    choice: MuscleChoice, muscle: Muscle
) -> tuple[Plant, dict[str, Any], dict[str, Any], bool]:
    """Plant, input signals and run of a lift, and whether its moving mass is chosen."""
    assert isinstance(choice.requirement, PullRequirement)
    cycle = choice.conditions.cycle_time
    mechanism, mass = _load(choice, choice.requirement)
    fill, discharge = scenario_valves(choice)
    damping = (
        2.0
        * DAMPING_RATIO
        * math.sqrt(choice.count * _stiffness(choice, muscle) * mass)
        / choice.count
    )
    names = (
        tuple(f"muscle{i + 1}" for i in range(choice.count)) if choice.count > 1 else ("muscle",)
    )
    several = choice.count > 1
    muscles = _muscles(choice, muscle, names, damping)
    circuit = FillDischarge(Supply(choice.conditions.supply), fill, discharge)
    plant = Plant(
        muscles if several else muscles[0],
        (circuit,) * choice.count if several else circuit,
        mechanism,
        Isothermal(),
        choice.conditions.ambient,
    )
    rows = {"fill": (RESTING, RESTING + MOVING), "discharge": (2 * RESTING + MOVING, 1.0)}
    prefixes = [f"{name}." for name in names] if choice.count > 1 else [""]
    inputs = {
        f"{prefix}{name}": [[start * cycle, 1.0], [end * cycle, 0.0]]
        for prefix in prefixes
        for name, (start, end) in rows.items()
    }
    start = choice.design.extended
    run = {
        "duration": (1.0 + RESTING) * cycle,
        "output_times": cycle / 400.0,
        "initial_state": {
            "pressure": start.pressure,
            "position": start.contraction * choice.length,
        },
    }
    return plant, inputs, run, mass != choice.requirement.moving_mass


def _joint(
    choice: MuscleChoice, muscle: Muscle
) -> tuple[Plant, dict[str, Any], dict[str, Any], bool]:
    """Plant, input signals and run of one pair of a joint, and whether its inertia is chosen."""
    assert isinstance(choice.requirement, JointRequirement)
    requirement = choice.requirement.reduced(load=1.0 / choice.count)
    cycle = choice.conditions.cycle_time
    design = choice.design
    half = 0.5 * requirement.angle
    fill, discharge = scenario_valves(choice)  # raises for a choice without a geometry
    assert design.radius is not None
    inertia = (
        requirement.inertia
        or requirement.torque * (JOINT_MASS_TIME * cycle) ** 2 / requirement.angle
    )
    stiffness = 2.0 * _stiffness(choice, muscle) * design.radius**2
    damping = 2.0 * DAMPING_RATIO * math.sqrt(stiffness * inertia) / (2.0 * design.radius**2)
    weight = requirement.torque / math.sin(min(half, 0.5 * math.pi))
    joint = AntagonisticJoint(
        design.radius,
        inertia,
        weight_torque=weight,
        min_angle=-1.5 * half,
        max_angle=1.5 * half,
        offset=0.5 * (design.extended.contraction + design.contracted.contraction),
    )
    supply = choice.conditions.supply
    regulator = ProportionalRegulator(
        Supply(supply), fill, discharge, LAG, BAND, max_setpoint=supply
    )
    muscles = _muscles(choice, muscle, ("left", "right"), damping)
    plant = Plant(muscles, (regulator, regulator), joint, Isothermal(), choice.conditions.ambient)
    low = design.extended.pressure
    high = design.contracted.pressure
    middle = 0.5 * (low + high)
    inputs = {
        f"{name}.setpoint": [
            [0.0, middle],
            [RESTING * cycle, first],
            [(1.0 - MOVING) * cycle, second],
        ]
        for name, first, second in (("left", high, low), ("right", low, high))
    }
    run = {
        "duration": (1.0 + MOVING) * cycle,
        "output_times": cycle / 400.0,
        "initial_state": {"pressure": middle, "angle": 0.0},
    }
    return plant, inputs, run, inertia != requirement.inertia
