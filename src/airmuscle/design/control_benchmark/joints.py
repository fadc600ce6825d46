"""Joints of the control benchmark: the model of the controllers, and a truth that differs from it in kind."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ...core.annotation import check_field_types
from ...core.errors import ParameterError
from ...core.short_repr import ShortRepr
from ...engine.loop.driver import Driver, SolenoidDriver
from ...engine.loop.sensors import ColumnSensor
from ...files.library.entry_file import load_law
from ...physics.equilibrium import find_equilibrium
from ...physics.mechanism import AntagonisticJoint, JointWithExternalTorque
from ...physics.muscle import LinearDamper, Muscle
from ...physics.muscle.friction import Dahl, Friction, LuGre
from ...physics.plant.plant import Plant
from ...physics.pneumatics import (
    EnergyBalance,
    FillDischarge,
    Orifice,
    Polytropic,
    SubsonicIndexValve,
    Supply,
    Tube,
    TubeOrifice,
    Valve,
    WithTubes,
)
from ..tuning import RobustObjective

SIDES = ("left", "right")
SUPPLY = 6e5
ENCODER_STEP = 2.0 * math.pi / 4096
PRESSURE_NOISE, PRESSURE_STEP = 500.0, 1e6 / 4096
DEAD_TIME = 6e-3
PROPORTIONAL_CONDUCTANCE, MATRIX_CONDUCTANCE = 1e-8, 2.6167e-9


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BenchmarkJoint(ShortRepr):
    """An antagonistic joint of the benchmark.

    model           the plant as the controllers know it: feed-forward, inverse, tuning
    truth           the plant on which they are judged, of other kinds of characteristic, valve and friction
    family          perturbed models with their names, for which controllers are tuned
    sensors         sensors of the columns that controllers may measure, with their dead time
    sample_time     [s]
    mean_pressure   mean gauge pressure of the pair [Pa]
    min_pressure, max_pressure    range of the commanded pressures [Pa]
    model_drivers, truth_drivers  drivers of the valves as assumed in tuning, and as they are
    switching       whether the valves are on/off valves
    objective       of tuning: rms error [degree] over the family with weights of air [kg/s] and switchings [1/s]
    valve           description of the valves with their size
    """

    name: str
    model: Plant
    truth: Plant
    family: Mapping[str, Plant]
    sensors: tuple[ColumnSensor, ...]
    sample_time: float
    valve: str
    mean_pressure: float = 2.5e5
    min_pressure: float = 0.1e5
    max_pressure: float = 5.5e5
    model_drivers: Mapping[str, Driver] = dataclasses.field(default_factory=dict)
    truth_drivers: Mapping[str, Driver] = dataclasses.field(default_factory=dict)
    switching: bool = False
    objective: RobustObjective = RobustObjective(air_weight=100.0)

    def __post_init__(self) -> None:
        check_field_types(self)
        check_truth_differs(self.model, self.truth)
        if not self.family:
            raise ParameterError(f"joint '{self.name}': the family of models is empty; give at least the model.")

    @property
    def pressures(self) -> tuple[str, str]:
        """Names of the pressures of the two muscles."""
        first, second = (f"{muscle.name}.pressure" for muscle in self.model.muscles)
        return first, second

    @property
    def pressure_span(self) -> float:
        """Maximum half difference of the pressures [Pa] at the mean pressure."""
        return min(self.mean_pressure - self.min_pressure, self.max_pressure - self.mean_pressure)

    def start(self, plant: Plant) -> dict[str, float]:
        """The initial state of a plant: its equilibrium at the mean pressure in both muscles."""
        return find_equilibrium(plant, pressure=self.mean_pressure)


def kinds_of(plant: Plant) -> dict[str, set[str]]:
    """Class names of the characteristics, valves and friction laws in a plant, without wrappers of a characteristic."""
    laws = {type(_innermost(muscle.contractile)).__name__ for muscle in plant.muscles}
    friction = {type(muscle.friction).__name__ for muscle in plant.muscles}
    valves = {name for circuit in plant.circuits for name in _valves(circuit)}
    return {"characteristic": laws, "valve": valves, "friction": friction}


def check_truth_differs(model: Plant, truth: Plant) -> None:
    """Raise ParameterError where model and truth have a class of characteristic, valve or friction in common."""
    ours, theirs = kinds_of(model), kinds_of(truth)
    for kind, names in ours.items():
        if common := sorted(names & theirs[kind]):
            raise ParameterError(
                f"model and truth of the benchmark have the same {kind}, {common[0]}; a controller would then be "
                "judged on the model that it was designed with. Give the truth another one."
            )


def _innermost(law: Any) -> Any:
    while hasattr(law, "inner"):
        law = law.inner
    return law


def _valves(part: Any) -> set[str]:
    """Class names of the orifices inside a circuit, other than those of tubes."""
    if isinstance(part, Orifice):
        return set() if isinstance(part, TubeOrifice) else {type(part).__name__}
    if not dataclasses.is_dataclass(part):
        return set()
    return {name for f in dataclasses.fields(part) for name in _valves(getattr(part, f.name))}


def _pair(muscle: Muscle, **changes: Any) -> tuple[Muscle, ...]:
    return tuple(replace(muscle, name=name, **changes) for name in SIDES)


def _joint(**changes: float) -> JointWithExternalTorque:
    joint = AntagonisticJoint(radius=0.04, inertia=0.05, damping=0.2, weight_torque=2.0, offset=0.11)
    return JointWithExternalTorque(replace(joint, **changes))  # type: ignore[arg-type]


def model_plant(
    conductance: float, *, damping: float = 200.0, supply: float = SUPPLY, **joint: float
) -> Plant:  # fmt: skip
    """The model of the benchmark: MartensBoblan2017, Valve after ISO 6358, Polytropic(1.2), no tube, no friction.

    Sonic conductance [m3/(s Pa)] of each valve, damping of a muscle [N s/m], supply pressure [Pa], and parameters of
    AntagonisticJoint.
    """
    valve = Valve(conductance, 0.35)
    circuit = FillDischarge(Supply(supply), valve, valve)
    muscle = load_law("dmsp-20-300").muscle
    pair = _pair(muscle, damper=LinearDamper(damping))
    return Plant(pair, (circuit, circuit), _joint(**joint), Polytropic(1.2))


def true_plant(conductance: float) -> Plant:
    """The truth of the benchmark: Sarosi2012, LuGre friction, tubes, heat, and other numbers (all chosen).

    Valves with 80 % of the conductance and a subsonic index, inertia 20 % and weight 30 % greater, damper 50 %
    stronger.
    """
    valve = SubsonicIndexValve(0.8 * conductance, 0.3, 0.55)
    circuit = WithTubes(FillDischarge(Supply(SUPPLY), valve, valve), Tube.from_dimensions(0.3, 6e-3))
    friction: Friction = LuGre(3e4, 15.0, 5.0, 0.01, 50.0)
    muscle = load_law("dmsp-20-300").muscle
    law = load_law("sarosi-dmsp-20-400n").characteristic
    pair = _pair(muscle, contractile=law, friction=friction, damper=LinearDamper(300.0))
    return Plant(pair, (circuit, circuit), _joint(inertia=0.06, weight_torque=2.6), EnergyBalance(1.0))


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
        "friction 10 N": replace(model, muscle=tuple(replace(m, friction=Dahl(2e4, 10.0)) for m in model.muscles)),
    }


def benchmark_sensors(sample_time: float) -> tuple[ColumnSensor, ...]:
    """A 12-bit encoder, speed with a lag of 10 ms, pressures with 5 mbar of noise and 12 bits, for a sample time [s].

    All have a dead time of 6 ms. These numbers are chosen.
    """
    delay = round(DEAD_TIME / sample_time)
    return (
        ColumnSensor("angle", resolution=ENCODER_STEP, delay=delay),
        ColumnSensor("angular_speed", lag=0.01, delay=delay),
        *(ColumnSensor(f"{n}.pressure", resolution=PRESSURE_STEP, noise=PRESSURE_NOISE, delay=delay) for n in SIDES),
    )


def proportional_joint() -> BenchmarkJoint:
    """DMSP-20-300 pair with proportional valves of 1e-8 m3/(s Pa), sampled at 500 Hz."""
    conductance = PROPORTIONAL_CONDUCTANCE
    return BenchmarkJoint(
        "proportional valves", model_plant(conductance), true_plant(conductance), perturbed_models(conductance),
        benchmark_sensors(2e-3), 2e-3,
        f"four proportional valves, C = {conductance:g} m3/(s Pa) each, -20 % in the truth",
    )  # fmt: skip


def on_off_joint() -> BenchmarkJoint:
    """DMSP-20-300 pair with on/off valves of the size of MATRIX 821, sampled at 500 Hz, with delays of the valves."""
    conductance = MATRIX_CONDUCTANCE
    inputs = [f"{side}.{edge}" for side in SIDES for edge in ("fill", "discharge")]
    assumed, actual = SolenoidDriver(1e-3, 1e-3), SolenoidDriver(1.5e-3, 1.5e-3)
    return BenchmarkJoint(
        "on/off valves", model_plant(conductance), true_plant(conductance), perturbed_models(conductance),
        benchmark_sensors(2e-3), 2e-3,
        f"four on/off valves, C = {conductance:g} m3/(s Pa) each, -20 % in the truth, delays 1 ms, 1.5 ms in the truth",
        model_drivers=dict.fromkeys(inputs, assumed), truth_drivers=dict.fromkeys(inputs, actual), switching=True,
        objective=RobustObjective(switching_weight=0.01),
    )  # fmt: skip
