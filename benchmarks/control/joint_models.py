"""Joints of the control benchmark: model of the controllers, its family, and truths on which they
are judged.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from joint_truths import JOINT, SIDES, SUPPLY, TRUTH_SEEDS, kinds_of, random_truth

import airmuscle as am
from airmuscle.design import JointRig, RobustObjective, SineMotion, TruePlant
from airmuscle.design.control_comparison.tasks import DEGREE, commissioning_tasks, tuning_tasks
from airmuscle.engine import ColumnSensor, SolenoidDriver
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    Dahl,
    FillDischarge,
    JointWithExternalTorque,
    LinearDamper,
    Plant,
    Polytropic,
    Supply,
    Valve,
)

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
REMARK = (
    "The truths are drawn at random from a family that has no characteristic, friction law, valve"
    " or gas of the models. The measurements have the resolution of a 12-bit encoder, noise and"
    " dead time, of which a part is unknown."
)
TRUTHS_NOTE = "Flow, inertia, weight and offset relative to the model."
FAST_SINE = SineMotion(1.6 * DEGREE, 5.9)
"""Motion in the tuning of the joint with proportional valves (chosen): above the frequencies that
are judged, where a loop that is tuned for slower motions amplifies its errors unseen. The on/off
valves cannot follow it."""


def check_truth_differs(plant: Plant, truth: TruePlant) -> None:
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


def model_plant(
    conductance: float, *, damping: float = 200.0, supply: float = SUPPLY, **joint: Any
) -> Plant:
    """The model of the benchmark: MartensBoblan2017, Valve after ISO 6358, Polytropic(1.2), no
    tube, no friction.

    Sonic conductance [m3/(s Pa)] of each valve, damping of a muscle [N s/m], supply pressure [Pa],
    and parameters of AntagonisticJoint.
    """
    valve = Valve(conductance, 0.35)
    muscle = am.load("dmsp-20-300").muscle
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


def proportional_joint(seeds: Sequence[int] = TRUTH_SEEDS) -> JointRig:
    """DMSP-20-300 pair with proportional valves of 1e-8 m3/(s Pa), sampled at 500 Hz, and the
    truths of these seeds.
    """
    conductance = PROPORTIONAL_CONDUCTANCE
    return checked_rig(
        JointRig(
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
            remark=REMARK,
            truths_note=TRUTHS_NOTE,
        )
    )


def on_off_joint(seeds: Sequence[int] = TRUTH_SEEDS) -> JointRig:
    """DMSP-20-300 pair with on/off valves of the size of MATRIX 821, sampled at 500 Hz, with delays
    of the valves.
    """
    conductance = MATRIX_CONDUCTANCE
    inputs = [f"{side}.{edge}" for side in SIDES for edge in ("fill", "discharge")]
    return checked_rig(
        JointRig(
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
            remark=REMARK,
            truths_note=TRUTHS_NOTE,
        )
    )


def checked_rig(rig: JointRig) -> JointRig:
    """The rig. Raises ParameterError where a truth shares a class with a model."""
    for truth in rig.truths:
        for plant in (rig.model, *rig.family.values()):
            check_truth_differs(plant, truth)
    return rig
