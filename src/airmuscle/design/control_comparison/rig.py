"""Rig of a comparison of controllers: an antagonistic joint with its model, family and truths."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from ...core import Array, ParameterError, ShortRepr, check_field_types
from ...engine.loop import ColumnSensor, Driver
from ...physics import Plant
from ...physics.equilibrium import nearest_equilibrium
from ..tuning import RobustObjective
from .tasks import ControlTask, tuning_tasks
from .true_plant import TruePlant

AIR_WEIGHT = 500.0
TRAVEL_WEIGHT = 2e-3
"""Weights of the objective of tuning [degree s/kg], [degree s/stroke] (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class JointRig(ShortRepr):
    """An antagonistic joint on which controllers are compared, with what they know of it.

    model           the plant as the controllers know it: feed-forward, inverse, tuning
    family          perturbed models with their names, for which controllers are tuned
    truths          on which they are judged
    sensors         sensors of the columns that controllers may measure, with their dead time
    sample_time     [s]
    mean_pressure   mean gauge pressure of the pair [Pa]
    min_pressure, max_pressure    range of the commanded pressures [Pa]
    drivers         of the valves as assumed in tuning
    switching       whether the valves are on/off valves
    objective       of tuning: rms error [degree] over the family with weights of air [kg/s] and
                    travel [strokes/s]
    valve           description of the valves with their size
    pressure_gains  range of the gain of the inner pressure control [1/Pa] (chosen)
    tuning_tasks    for which controllers are tuned
    commissioning_tasks    for which they are commissioned on a truth; the default tuning tasks
                           unless given
    remark          sentence on truths and sensors for the report
    truths_note     note below the table of truths
    """

    name: str
    model: Plant
    family: Mapping[str, Plant]
    truths: tuple[TruePlant, ...]
    sensors: tuple[ColumnSensor, ...]
    sample_time: float
    valve: str
    mean_pressure: float = 2.5e5
    min_pressure: float = 0.1e5
    max_pressure: float = 5.5e5
    drivers: Mapping[str, Driver] = dataclasses.field(default_factory=dict)
    switching: bool = False
    objective: RobustObjective = RobustObjective(air_weight=AIR_WEIGHT, travel_weight=TRAVEL_WEIGHT)
    pressure_gains: tuple[float, float] = (1e-5, 60e-5)
    tuning_tasks: tuple[ControlTask, ...] = tuning_tasks()
    commissioning_tasks: tuple[ControlTask, ...] = tuning_tasks
    remark: str = ""
    truths_note: str = ""

    def __post_init__(self) -> None:
        check_field_types(self)
        for name, values in (("family of models", self.family), ("tuple of truths", self.truths)):
            if not values:
                raise ParameterError(
                    f"joint '{self.name}': the {name} is empty; give at least one."
                )

    @property
    def pressures(self) -> tuple[str, str]:
        """Names of the pressures of the two muscles."""
        first, second = (f"{muscle.name}.pressure" for muscle in self.model.muscles)
        return first, second

    @property
    def angle_step(self) -> float:
        """Resolution of the sensor of the angle [rad]; 0 where it has none."""
        return next((s.resolution for s in self.sensors if s.column == "angle"), 0.0)

    def read_angle(self, angle: Array) -> Array:
        """Readings (N,) [rad] of the sensor of the angle, without noise and dead time."""
        step = self.angle_step
        return step * np.round(angle / step) if step else angle

    @property
    def pressure_span(self) -> float:
        """Maximum half difference of the pressures [Pa] at the mean pressure."""
        return min(self.mean_pressure - self.min_pressure, self.max_pressure - self.mean_pressure)

    def start(self, plant: Plant) -> dict[str, float]:
        """The initial state of a plant: its equilibrium at the mean pressure in both muscles."""
        return nearest_equilibrium(plant, pressure=self.mean_pressure)
