"""A controller defined by the user in the control benchmark of a joint: feed-forward with
compensation of friction.

python examples/own_controller.py        writes report/examples/own_controller.png

A controller is a class with two members: `initial_memory`, the values that it keeps from one sample
to the next, and `step`, its commands. It is tuned as the controllers of the package are, for
perturbed models, and judged on a plant that is not its model. The small budget makes the example
fast; `airmuscle benchmark` uses more.
"""

from typing import ClassVar

from airmuscle.core import model, ops, parameter, plotting
from airmuscle.design import (
    Contender,
    benchmark_controllers,
    find_tasks,
    proportional_joint,
    standard_contenders,
)
from airmuscle.engine import ControlLaw


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
joint = proportional_joint((11, 12))  # two truths
others = [each for each in standard_contenders(joint) if each.name == "feed-forward + PID"]
tasks = find_tasks(("sine 1 Hz",))
result = benchmark_controllers(joint, (*others, mine), tasks, sets_per_gain=4, commissioning_runs=0)

print(f"valves: {joint.valve}")
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
