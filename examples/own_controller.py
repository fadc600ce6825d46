"""A controller defined by the user beside a PID on a joint: feed-forward with compensation of
friction.

python examples/own_controller.py        writes report/examples/own_controller.png

A controller is a class with two members: `initial_memory`, the values that it keeps from one sample
to the next, and `step`, its commands. Both controllers are tuned alike, for perturbed models, and
judged on plants that are not their model: with friction, another inertia and smaller valves. The
small budget makes the example fast; benchmarks/control uses more, with truths of other kinds.
"""

from dataclasses import replace
from typing import ClassVar

import airmuscle as am
from airmuscle.control import PID
from airmuscle.core import model, ops, parameter, plotting
from airmuscle.design import Contender, JointRig, TruePlant, compare_controllers, find_tasks
from airmuscle.engine import ColumnSensor, ControlLaw
from airmuscle.physics import (
    AntagonisticJoint,
    Dahl,
    FillDischarge,
    JointWithExternalTorque,
    LinearDamper,
    NoFriction,
    Plant,
    Polytropic,
    Supply,
    Valve,
)


@model
class FrictionCompensation(ControlLaw):
    """d = d_ff + T d_ff' + K e + I + D (w_r - w) + p_c w_r/sqrt(w_r^2 + w_0^2),   I' = K/T_i e.

    d half the pressure difference, d_ff static inverse of the model, e error of the angle, w
    measured and w_r wanted speed, p_c pressure that overcomes Coulomb friction, w_0 = 0.05 rad/s
    (chosen).
    """

    gain: float = parameter("Pa/rad", "K", "proportional gain", bounds=(0.0, 1e7))
    integral_time: float = parameter("s", "T_i", "integral time", bounds=(1e-3, 1e3))
    damping: float = parameter("Pa s/rad", "D", "gain of the speed", bounds=(0.0, 1e6))
    lead_time: float = parameter("s", "T", "lead time of the feed-forward", bounds=(0.0, 1.0))
    friction_pressure: float = parameter(
        "Pa", "p_c", "pressure that overcomes the friction", bounds=(0.0, 1e5)
    )

    measured_columns = ("angle", "angular_speed")
    setpoints = ("angle", "angular_speed", "feed_forward", "feed_forward_rate")
    inputs = ("difference",)
    initial_memory: ClassVar[dict[str, float]] = {"integral": 0.0}

    def step(self, memory, measurement, dt):
        wanted = measurement.setpoints
        measured = measurement.columns
        error = wanted["angle"] - measured["angle"]
        feedback = self.gain * error + self.damping * (
            wanted["angular_speed"] - measured["angular_speed"]
        )
        forward = wanted["feed_forward"] + self.lead_time * wanted["feed_forward_rate"]
        speed = wanted["angular_speed"]
        friction = self.friction_pressure * speed / ops.sqrt(speed**2 + 0.05**2)
        low, high = measurement.ranges["difference"]
        command = forward + feedback + friction + memory["integral"]
        integral = memory["integral"] + self.gain / self.integral_time * error * dt
        later = ops.where(command == ops.clip(command, low, high), integral, memory["integral"])
        return {"difference": command}, {"integral": later}


mine = Contender(
    "friction compensation",
    FrictionCompensation(
        gain=6e5, integral_time=0.2, damping=6e3, lead_time=0.03, friction_pressure=3e3
    ),
    {
        "gain": (5e4, 1e6),
        "integral_time": (0.03, 3.0),
        "damping": (1e2, 3e4),
        "lead_time": (1e-3, 0.1),
    },
)


def joint_plant(conductance=1e-8, inertia=0.05, friction=NoFriction()):
    """Two DMSP-20-300 with four proportional valves; all numbers beside the muscle are chosen."""
    valve = Valve(conductance, 0.35)
    circuit = FillDischarge(Supply(6e5), valve, valve)
    muscle = replace(am.load("dmsp-20-300").muscle, damper=LinearDamper(200.0), friction=friction)
    pair = tuple(replace(muscle, name=name) for name in ("left", "right"))
    joint = AntagonisticJoint(0.04, inertia, damping=0.2, weight_torque=2.0, offset=0.11)
    return Plant(pair, (circuit, circuit), JointWithExternalTorque(joint), Polytropic(1.2))


rig = JointRig(
    "proportional valves",
    joint_plant(),
    {"nominal": joint_plant(), "inertia x 2": joint_plant(inertia=0.1)},
    (
        TruePlant("friction", joint_plant(friction=Dahl(2e4, 12.0), inertia=0.06)),
        TruePlant("small valves", joint_plant(7e-9, 0.07, Dahl(2e4, 6.0)), extra_delay=1),
    ),
    (
        ColumnSensor("angle", resolution=1.534e-3, delay=3),
        ColumnSensor("angular_speed", lag=0.01, noise=1e-3, delay=3),
        ColumnSensor("left.pressure", noise=500.0, delay=3),
        ColumnSensor("right.pressure", noise=500.0, delay=3),
    ),
    sample_time=2e-3,
    valve="four proportional valves, C = 1e-08 m3/(s Pa) each",
)
pid = Contender(
    "PID",
    PID("angle", "difference", 2e5, integral_time=0.3, derivative_time=0.02, derivative_filter=5.0),
    {"gain": (2e4, 2e6), "integral_time": (0.02, 3.0), "derivative_time": (1e-3, 0.2)},
)
tasks = find_tasks(("sine 1 Hz",))
result = compare_controllers(rig, (pid, mine), tasks, sets_per_gain=4, commissioning_runs=0)

print(f"valves: {rig.valve}")
for name, score in result.scores().items():
    errors = [(task.name, result.metric(name, task.name, "rmse")) for task in tasks]
    texts = ", ".join(
        f"{task} {error.median:.2f} ({error.low:.2f} to {error.high:.2f}) degrees"
        for task, error in errors
    )
    print(f"{name}: score {score.median:.2f}; rms error {texts}")
plotting.save(
    result.run_plot([task.name for task in tasks]).draw(), "report/examples/own_controller.png"
)
print("wrote report/examples/own_controller.png")
