"""Claims about the engine without muscles: it solves equations of any kind with nothing of
`physics` imported.

Predator and prey keep the integral of Lotka and Volterra, delta x - gamma ln x + beta y - alpha ln
y. A pendulum under a sampled controller that is written here moves as SciPy says for the same
torques, held from sample to sample.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

PROGRAM = """
import json, sys
from airmuscle.core import StateVariable, System, model, ops, parameter
from airmuscle.engine import ControlLaw, ControlLoop, Rodas4, Schedule, simulate, simulate_batch

@model
class PredatorPrey(System):
    alpha: float = parameter("1/s", "alpha", "growth of the prey", bounds=(0.0, 10.0))
    beta: float = parameter("1/s", "beta", "prey that a predator eats", bounds=(0.0, 10.0))
    gamma: float = parameter("1/s", "gamma", "death of the predators", bounds=(0.0, 10.0))
    delta: float = parameter("1/s", "delta", "predators that a prey feeds", bounds=(0.0, 10.0))
    states = (StateVariable("prey", "1", 1.0), StateVariable("predators", "1", 1.0))
    inputs = ()
    def rates(self, state, inputs):
        x, y = state["prey"], state["predators"]
        return {"prey": (self.alpha - self.beta * y) * x, "predators": (self.delta * x - self.gamma) * y}
    def outputs(self, state, inputs):
        return {}

@model
class Pendulum(System):
    length: float = parameter("m", "l", "length", bounds=(0.0, 10.0))
    damping: float = parameter("1/s", "d", "damping by mass and squared length", bounds=(0.0, 10.0))
    states = (StateVariable("angle", "rad", 1.0), StateVariable("angular_speed", "rad/s", 1.0))
    inputs = ("torque",)
    def rates(self, state, inputs):
        speed = state["angular_speed"]
        fall = 9.81 / self.length * ops.sin(state["angle"])
        return {"angle": speed, "angular_speed": inputs["torque"] - fall - self.damping * speed}
    def outputs(self, state, inputs):
        return {"height": self.length * (1.0 - ops.cos(state["angle"]))}

@model
class Balance(ControlLaw):
    stiffness: float = parameter("1", "k", "torque by angle", bounds=(0.0, 1e3))
    damping: float = parameter("1", "d", "torque by speed", bounds=(0.0, 1e3))
    measured_columns = ("angle", "angular_speed")
    setpoints = ("angle",)
    inputs = ("torque",)
    initial_memory = {}
    def step(self, memory, measurement, dt):
        angle, speed = (measurement.columns[name] for name in self.measured_columns)
        return {"torque": self.stiffness * (measurement.setpoints["angle"] - angle) - self.damping * speed}, {}

tight = Rodas4(rtol=1e-10)
field = simulate(PredatorPrey(1.1, 0.4, 0.4, 0.1), Schedule({}), duration=40.0, output_times=0.5, integrator=tight,
                 initial_state={"prey": 10.0, "predators": 5.0})
start = {"angle": 0.1, "angular_speed": 0.0}
loop = ControlLoop(Balance(40.0, 8.0), 0.02, Schedule({"angle": ((0.0, 3.0),)}))
swing = simulate(Pendulum(0.5, 0.2), loop, duration=3.0, output_times=0.02, integrator=tight, initial_state=start)
both = simulate_batch(Pendulum(0.5, 0.2), {"length": [0.5, 0.7]}, loop, duration=3.0, output_times=0.02,
                      integrator=tight, initial_states=start)
print(json.dumps({
    "field": {name: field[name].tolist() for name in field.columns},
    "swing": {name: swing[name].tolist() for name in swing.columns},
    "batch": both["angle"].tolist(),
    "imported": sorted({name.split(".")[1] for name in sys.modules if name.startswith("airmuscle.")}),
}))
"""


@pytest.fixture(scope="module")
def results() -> dict:
    """What a fresh process computes."""
    run = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


def test_the_engine_brings_core_errors_and_recording_alone(results):
    assert set(results["imported"]) <= {"core", "engine", "errors", "recording"}


def test_predator_and_prey_keep_their_integral(results):
    x, y = (np.array(results["field"][name]) for name in ("prey", "predators"))
    kept = 0.1 * x - 0.4 * np.log(x) + 0.4 * y - 1.1 * np.log(y)
    assert np.abs(kept - kept[0]).max() < 1e-7
    assert x.max() / x.min() > 5, "the populations oscillate"


def test_a_pendulum_under_a_sampled_controller_moves_as_scipy_says(results):
    def rates(_, x, torque):
        return [x[1], torque - 9.81 / 0.5 * math.sin(x[0]) - 0.2 * x[1]]

    x = np.array([0.1, 0.0])
    angles = [0.1]
    for _ in range(150):
        torque = 40.0 * (3.0 - x[0]) - 8.0 * x[1]
        x = solve_ivp(rates, (0.0, 0.02), x, "DOP853", args=(torque,), rtol=1e-12, atol=1e-12).y[
            :, -1
        ]
        angles.append(x[0])
    swing = results["swing"]
    assert np.abs(np.array(swing["angle"]) - angles).max() < 1e-8
    assert swing["height"] == pytest.approx(0.5 * (1.0 - np.cos(angles)), abs=1e-8)
    assert swing["command.torque"][0] == pytest.approx(40.0 * 2.9)
    assert results["batch"][0] == pytest.approx(swing["angle"], abs=1e-12)
    assert np.abs(np.array(results["batch"][1]) - angles).max() > 1e-2, (
        "the other length moves otherwise"
    )
