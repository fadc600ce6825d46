"""Joints of the control benchmark: model of the controllers, its family, and truths on which they
are judged.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...core import ParameterError, ShortRepr, check_field_types, leaves
from ...engine.loop import ColumnSensor, Driver, SolenoidDriver
from ...files.library.loading import load_law
from ...physics import Dahl, JointWithExternalTorque, LinearDamper, Plant
from ...physics.equilibrium import nearest_equilibrium
from ...physics.pneumatics import FillDischarge, Orifice, Polytropic, Supply, TubeOrifice, Valve
from ..tuning import RobustObjective
from .tasks import DEGREE, ControlTask, SineMotion, commissioning_tasks, tuning_tasks
from .truths import JOINT, SIDES, SUPPLY, TRUTH_SEEDS, BenchmarkTruth, random_truth

ENCODER_STEP = 2.0 * math.pi / 4096
PRESSURE_NOISE = 500.0
PRESSURE_STEP = 1e6 / 4096
SPEED_NOISE = 1e-3
"""Noise of the speed [rad/s] (chosen): that of a rate gyroscope with 0.01 degrees/s/sqrt(Hz) behind
a lag of 10 ms.
"""
DEAD_TIME = 6e-3
PROPORTIONAL_CONDUCTANCE = 1e-8
MATRIX_CONDUCTANCE = 2.6167e-9
PROPORTIONAL_GAINS = (1.7e-5, 60e-5)
"""Range of the gain [1/Pa] of the pressure control with proportional valves (chosen): from the gain
at which the lag of the pressures with 55 % of the flow is about 30 ms, the greatest lead of a
feed-forward."""
FAST_SINE = SineMotion(1.6 * DEGREE, 5.9)
"""Motion in the tuning of the joint with proportional valves (chosen): above the frequencies that
are judged, where a loop that is tuned for slower motions amplifies its errors unseen. The on/off
valves cannot follow it."""
AIR_WEIGHT = 500.0
TRAVEL_WEIGHT = 2e-3
"""Weights of the objective of tuning [degree s/kg], [degree s/stroke] (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BenchmarkJoint(ShortRepr):
    """An antagonistic joint of the benchmark.

    model           the plant as the controllers know it: feed-forward, inverse, tuning
    family          perturbed models with their names, for which controllers are tuned
    truths          on which they are judged, of other classes of characteristic, valve, friction
                    and gas
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
    """

    name: str
    model: Plant
    family: Mapping[str, Plant]
    truths: tuple[BenchmarkTruth, ...]
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

    def __post_init__(self) -> None:
        check_field_types(self)
        for name, values in (("family of models", self.family), ("tuple of truths", self.truths)):
            if not values:
                raise ParameterError(
                    f"joint '{self.name}': the {name} is empty; give at least one."
                )
        for truth in self.truths:
            for plant in (self.model, *self.family.values()):
                check_truth_differs(plant, truth)

    @property
    def pressures(self) -> tuple[str, str]:
        """Names of the pressures of the two muscles."""
        first, second = (f"{muscle.name}.pressure" for muscle in self.model.muscles)
        return first, second

    @property
    def pressure_span(self) -> float:
        """Maximum half difference of the pressures [Pa] at the mean pressure."""
        return min(self.mean_pressure - self.min_pressure, self.max_pressure - self.mean_pressure)

    def describe(self, truth: BenchmarkTruth) -> dict[str, str]:
        """The kinds of a truth, and its numbers relative to the model."""
        plants = (self.model, truth.plant)
        ours, theirs = (
            {".".join(leaf.path.split(".")[-2:]): leaf.value for leaf in leaves(plant)}
            for plant in plants
        )
        ratios = {
            name: f"{value / ours[name]:.2f}" for name, value in theirs.items() if ours.get(name)
        }
        return {
            **{kind: ", ".join(sorted(names)) for kind, names in kinds_of(truth.plant).items()},
            "flow": ratios["fill.conductance"],
            "tube": f"{theirs['orifice.length']:.2g} m" if "orifice.length" in theirs else "–",
            **{
                name.replace("_", " "): ratios[f"inner.{name}"]
                for name in ("inertia", "weight_torque", "offset")
            },
            "unknown dead time": f"{1e3 * truth.extra_delay * self.sample_time:g} ms",
        }

    def start(self, plant: Plant) -> dict[str, float]:
        """The initial state of a plant: its equilibrium at the mean pressure in both muscles."""
        return nearest_equilibrium(plant, pressure=self.mean_pressure)


def kinds_of(plant: Plant) -> dict[str, set[str]]:
    """Class names of the characteristics, valves, friction laws and gas in a plant, without
    wrappers.
    """
    laws: list[Any] = [muscle.contractile for muscle in plant.muscles]
    while any(hasattr(law, "inner") for law in laws):
        laws = [getattr(law, "inner", law) for law in laws]
    return {
        "characteristic": {type(law).__name__ for law in laws},
        "valve": {name for circuit in plant.circuits for name in _valves(circuit)},
        "friction": {type(muscle.friction).__name__ for muscle in plant.muscles},
        "gas": {type(plant.gas).__name__},
    }


def check_truth_differs(plant: Plant, truth: BenchmarkTruth) -> None:
    """Raise ParameterError where a truth shares a class with a plant that is known to the
    controllers.
    """
    ours = kinds_of(plant)
    theirs = kinds_of(truth.plant)
    for kind, names in ours.items():
        if common := sorted(names & theirs[kind]):
            raise ParameterError(
                f"'{truth.name}' of the benchmark has the same {kind} as a model, {common[0]}; a"
                " controller would then be judged on the model that it was designed with. Give the"
                " truth another one."
            )


def _valves(part: Any) -> set[str]:
    """Class names of the orifices inside a circuit, other than those of tubes."""
    if isinstance(part, Orifice):
        return set() if isinstance(part, TubeOrifice) else {type(part).__name__}
    if not dataclasses.is_dataclass(part):
        return set()
    return {name for f in dataclasses.fields(part) for name in _valves(getattr(part, f.name))}


def model_plant(
    conductance: float, *, damping: float = 200.0, supply: float = SUPPLY, **joint: Any
) -> Plant:
    """The model of the benchmark: MartensBoblan2017, Valve after ISO 6358, Polytropic(1.2), no
    tube, no friction.

    Sonic conductance [m3/(s Pa)] of each valve, damping of a muscle [N s/m], supply pressure [Pa],
    and parameters of AntagonisticJoint.
    """
    valve = Valve(conductance, 0.35)
    muscle = load_law("dmsp-20-300").muscle
    circuit = FillDischarge(Supply(supply), valve, valve)
    pair = tuple(replace(muscle, name=name, damper=LinearDamper(damping)) for name in SIDES)
    return Plant(
        pair, (circuit, circuit), JointWithExternalTorque(replace(JOINT, **joint)), Polytropic(1.2)
    )


def perturbed_models(conductance: float) -> dict[str, Plant]:
    """The model and perturbed models by name, for which controllers are tuned (chosen)."""
    model = model_plant(conductance)
    return {
        "nominal": model,
        "inertia x 2": model_plant(conductance, inertia=0.1),
        "inertia x 0.5": model_plant(conductance, inertia=0.025),
        "weight x 2": model_plant(conductance, weight_torque=4.0),
        "supply -20 %": model_plant(conductance, supply=0.8 * SUPPLY),
        "pulley +10 %": model_plant(conductance, radius=0.044),
        "friction 10 N": replace(
            model, muscle=tuple(replace(m, friction=Dahl(2e4, 10.0)) for m in model.muscles)
        ),
    }


def benchmark_sensors(sample_time: float) -> tuple[ColumnSensor, ...]:
    """A 12-bit encoder, speed with a lag of 10 ms and 1 mrad/s of noise, pressures with 5 mbar of
    noise and 12 bits.

    All have a dead time of 6 ms, in samples of the sample time [s]. These numbers are chosen.
    """
    delay = round(DEAD_TIME / sample_time)
    return (
        ColumnSensor("angle", resolution=ENCODER_STEP, delay=delay),
        ColumnSensor("angular_speed", lag=0.01, noise=SPEED_NOISE, delay=delay),
        *(
            ColumnSensor(
                f"{n}.pressure", resolution=PRESSURE_STEP, noise=PRESSURE_NOISE, delay=delay
            )
            for n in SIDES
        ),
    )


def proportional_joint(seeds: Sequence[int] = TRUTH_SEEDS) -> BenchmarkJoint:
    """DMSP-20-300 pair with proportional valves of 1e-8 m3/(s Pa), sampled at 500 Hz, and the
    truths of these seeds.
    """
    conductance = PROPORTIONAL_CONDUCTANCE
    return BenchmarkJoint(
        "proportional valves",
        model_plant(conductance),
        perturbed_models(conductance),
        tuple(random_truth(seed, conductance) for seed in seeds),
        benchmark_sensors(2e-3),
        2e-3,
        f"four proportional valves, C = {conductance:g} m3/(s Pa) each",
        pressure_gains=PROPORTIONAL_GAINS,
        tuning_tasks=tuning_tasks(FAST_SINE),
        commissioning_tasks=commissioning_tasks(),
    )


def on_off_joint(seeds: Sequence[int] = TRUTH_SEEDS) -> BenchmarkJoint:
    """DMSP-20-300 pair with on/off valves of the size of MATRIX 821, sampled at 500 Hz, with delays
    of the valves.
    """
    conductance = MATRIX_CONDUCTANCE
    inputs = [f"{side}.{edge}" for side in SIDES for edge in ("fill", "discharge")]
    return BenchmarkJoint(
        "on/off valves",
        model_plant(conductance),
        perturbed_models(conductance),
        tuple(random_truth(seed, conductance, switching=True) for seed in seeds),
        benchmark_sensors(2e-3),
        2e-3,
        f"four on/off valves, C = {conductance:g} m3/(s Pa) each, delays of 1 ms",
        drivers=dict.fromkeys(inputs, SolenoidDriver(1e-3, 1e-3)),
        switching=True,
        objective=RobustObjective(travel_weight=0.01),
    )
