"""Muscles of a body as MuJoCo plugins: the law of each muscle with a pressure regulator, its air
and valves as states.
"""

import dataclasses
import math
import warnings
from pathlib import Path
from typing import Any, NamedTuple

from ...core import AirmuscleError, AirmuscleWarning, ParameterError, leaves
from ...design.body import RouteMuscle
from ...design.sizing import SizingConditions
from ...design.sizing.laws_of_product import with_volume
from ...design.sizing.static_muscle import at_length
from ...files.library import Entry
from ...physics import HangingMass, Isothermal, LinearDamper, Plant
from ...physics.plant import open_plant
from ...physics.pneumatics import ProportionalRegulator, SecondOrderLag, Supply, Valve
from .mujoco_plugin import MuscleActuator, check_mujoco, write_mujoco_plugin

BASE_LENGTH = 0.2
"""Resting length [m] of the muscle of which a plugin is built (chosen); an actuator has its own as
parameters.
"""
BASE_SUPPLY = 6e5
BASE_CONDUCTANCE = 1e-8
"""Supply pressure [Pa] and sonic conductance [m3/(s Pa)] of that muscle (chosen)."""
FILL_TIME = 0.2
"""Time [s] in which a regulator fills its muscle, by choked flow (chosen)."""
CRITICAL_RATIO = 0.3
"""Critical pressure ratio of the regulator (chosen)."""
LAG = SecondOrderLag(20.0)
BAND = 5e3
"""Lag of the set point, and proportional band [Pa] of the regulator (chosen)."""
VISCOSITY = 0.02
"""Damping of a muscle without a stated damper: this part of its permitted force at a speed of its
length in 1 s (chosen)."""
REFERENCE_PRESSURE = 1e5
"""Pressure [Pa] of the reference atmosphere of ISO 8778."""


class RoutePlugin(NamedTuple):
    """The plugin of the muscles of a route, and the names of its actuators.

    `plugin.initialise(model, data, name, pressure=...)` sets the states of each at a pressure.
    """

    plugin: MuscleActuator
    names: tuple[str, ...]


class MusclePlugins:
    """The plugins of the muscles of a body, one for each law, in a folder."""

    def __init__(self, folder: Path, conditions: SizingConditions) -> None:
        """Raises ParameterError for a MuJoCo whose plugins do not work."""
        check_mujoco()
        self.folder = folder
        self.conditions = conditions
        self.built: dict[str, MuscleActuator | None] = {}

    def add(self, spec: Any, choice: RouteMuscle, tendon: str) -> RoutePlugin | None:
        """Add the muscles of a route to a specification; None where their law cannot be built."""
        entry = choice.muscle.entry
        actuator = self._actuator(entry)
        if actuator is None:
            return None
        defaults = {leaf.path: float(leaf.value) for leaf in leaves(actuator.plant)}
        part = open_plant(self._plant(entry, choice.length, self._conductance(choice)))
        values = {leaf.path: float(leaf.value) for leaf in leaves(part)}
        changed = {path: value for path, value in values.items() if defaults[path] != value}
        rest = choice.length * choice.contraction[0] + choice.sweep.longest.length / choice.tackle
        names = tuple(
            choice.name if choice.count == 1 else f"{choice.name}_{number}"
            for number in range(1, choice.count + 1)
        )
        for name in names:
            added = actuator.add_to(
                spec,
                name=name,
                tendon=tendon,
                gear=1.0 / choice.tackle,
                rest_length=rest,
                parameters=changed,
            )
            added.ctrlrange = [0.0, choice.muscle.pressure_range[1]]
        return RoutePlugin(actuator, names)

    def _actuator(self, entry: Entry) -> MuscleActuator | None:
        """The plugin of a law; None for one that gives no force. Raises ParameterError where no
        plugin can be built, such as without a C compiler.
        """
        if entry.name not in self.built:
            name = "fit_out_" + entry.name.replace("-", "_")
            try:
                plant = self._plant(entry, BASE_LENGTH, BASE_CONDUCTANCE, BASE_SUPPLY)
                built = write_mujoco_plugin(plant, self.folder, name=name)
            except AirmuscleError:
                self.built[entry.name] = None
            else:
                if built.library is None:
                    raise ParameterError(built.remark)
                self.built[entry.name] = built
        return self.built[entry.name]

    def _plant(
        self, entry: Entry, length: float, conductance: float, supply: float | None = None
    ) -> Plant:
        """One muscle with its regulator. Raises UnknownNameError for a law that gives no force."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AirmuscleWarning)
            muscle = at_length(with_volume(entry)[0], length).muscle
        force = entry.ratings.max_force if entry.ratings is not None else 1e3
        damper = muscle.damper or LinearDamper(VISCOSITY * min(force, 1e5) / BASE_LENGTH)
        pressure = self.conditions.supply if supply is None else supply
        valve = Valve(conductance, CRITICAL_RATIO)
        regulator = ProportionalRegulator(
            Supply(pressure), valve, valve, LAG, BAND, max_setpoint=pressure
        )
        return Plant(
            (dataclasses.replace(muscle, name="muscle", damper=damper),),
            (regulator,),
            HangingMass(1.0),
            Isothermal(),
            self.conditions.ambient,
        )

    def _conductance(self, choice: RouteMuscle) -> float:
        """Sonic conductance [m3/(s Pa)] with which choked flow fills one muscle in FILL_TIME."""
        diameter = choice.muscle.entry.ratings.diameter if choice.muscle.entry.ratings else 0.02
        # a contracted muscle has about twice the volume of the one at rest
        volume = 2.0 * choice.length * 0.25 * math.pi * diameter**2
        pressure = self.conditions.supply
        upstream = pressure + self.conditions.ambient.pressure
        return volume * pressure / (REFERENCE_PRESSURE * upstream * FILL_TIME)
