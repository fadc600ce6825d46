"""Controllers and estimators that are called at each sample: predictive control, Kalman filters,
statics of a joint.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from measure import Section, Target, format_time, print_section

import airmuscle as am

SAMPLES = 2000
POINTS = 1000
SAMPLE_TIME = 0.01
PRESSURE = 2.5e5
SIDES = ("left", "right")
MEASURED = ("left.pressure", "right.pressure", "angle")
HEADER = ("call", "median", "99 % quantile", "maximum")
REASON = (
    "40 unknowns, two inputs over 20 steps, and measurements that jump at each sample, so that the"
    " active limits of the last sample do not help; the time includes observer, target and limits"
)
TEXT = (
    "The joint of the library with pressure regulators (eight states with those of the"
    f" regulators), sample time 10 ms; {SAMPLES} samples with random measurements and set points"
    " within ±0.3 rad, one by one. The maximum contains the other load of the machine. Predictive"
    " control: 20 steps, a compiled sample; `plan` is that sample from a given estimate, `step`"
    " that of the controller. The Kalman filters estimate all states from two pressures; a sample"
    " is one prediction and one correction. Static inverse: pressures of one muscle for its"
    f" tension; joint statics: both pressures for angle and stiffness; {POINTS} points at once."
)


def predictive(joint: Any, state: Any) -> am.control.LinearModelPredictive:
    """Predictive control of the angle, with disturbances of both pressures and of the speed
    (weights chosen).
    """
    model = am.linearise(joint, {**state}, {f"{side}.setpoint": PRESSURE for side in SIDES})
    noise = {"angular_speed": 0.1, "angular_speed.disturbance": 5.0}
    for side in SIDES:
        noise |= {
            f"{side}.air_mass": 1e-6,
            f"{side}.air_mass.disturbance": 1e-5,
            f"{side}.lagged_setpoint_rate": 1e3,
        }
    permitted = {"angle": 0.02, "angular_speed": 1.0, **{f"{side}.setpoint": 1e5 for side in SIDES}}
    return am.control.design_predictive(
        model,
        SAMPLE_TIME,
        measured=MEASURED,
        controlled=("angle",),
        disturbed=("left.air_mass", "right.air_mass", "angular_speed"),
        permitted=permitted,
        process_noise=noise,
        measurement_noise={"left.pressure": 300.0, "right.pressure": 300.0, "angle": 1e-4},
    )


def predictive_times(law: am.control.LinearModelPredictive) -> dict[str, np.ndarray]:
    """Times [s] of the program with its limits, and of the whole sample, shape (SAMPLES,)."""
    rng = np.random.default_rng(3)
    memory = law.init()
    ranges = {f"{side}.setpoint": (0.0, 6e5) for side in SIDES}
    low, high = ((np.full(2, end) - law.model.inputs) / law.model.input_sizes for end in (0.0, 6e5))
    alone = []
    whole = []
    for _ in range(SAMPLES):
        pressures = rng.uniform(1.5e5, 3.5e5, 2).tolist()
        angles = rng.uniform(-0.3, 0.3, 2).tolist()
        columns = dict(zip(MEASURED, (*pressures, angles[0]), strict=True))
        measurement = am.engine.Measurement(columns, {"angle": angles[1]}, ranges)
        begun = time.perf_counter()
        law.plan(memory.predicted, np.array(angles[1:]), low, high, memory)
        alone.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        _, memory = law.step(memory, measurement, SAMPLE_TIME)
        whole.append(time.perf_counter() - begun)
    return {
        "predictive control, plan": np.array(alone),
        "predictive control, step": np.array(whole),
    }


def filter_times(kind: type[Any], joint: Any, state: Any) -> np.ndarray:
    """Times [s] of a prediction and a correction, shape (SAMPLES,)."""
    noise = {"left.air_mass": 1e-6, "right.air_mass": 1e-6, "angular_speed": 0.3}
    estimator = kind(joint, MEASURED[:2], SAMPLE_TIME, noise, dict.fromkeys(MEASURED[:2], 500.0))
    estimate = estimator.start(state, {"angle": 0.05, "left.air_mass": 2e-6})
    rng = np.random.default_rng(4)
    inputs = [PRESSURE] * len(joint.inputs)
    readings = (PRESSURE + rng.normal(scale=500.0, size=(SAMPLES, 2))).tolist()
    times = []
    for reading in readings:
        begun = time.perf_counter()
        estimate, _ = estimator.correct(estimator.predict(estimate, inputs), reading, inputs)
        times.append(time.perf_counter() - begun)
    return np.array(times)


def repeated(call: Callable[[], Any], count: int) -> np.ndarray:
    """Times [s] of a call, shape (count,), after one that warms up."""
    call()
    times = []
    for _ in range(count):
        begun = time.perf_counter()
        call()
        times.append(time.perf_counter() - begun)
    return np.array(times)


def section(rounds: int = 20) -> Section:
    """The complete benchmark."""
    joint = am.load("joint-dmsp-20-regulators").plant
    state = am.find_equilibrium(joint, pressure=PRESSURE)
    times = predictive_times(predictive(joint, state))
    for name, kind in (
        ("extended", am.control.ExtendedKalmanFilter),
        ("unscented", am.control.UnscentedKalmanFilter),
    ):
        times[f"{name} Kalman filter, a sample"] = filter_times(kind, joint, state)
    inverse = am.control.StaticInverse(joint.muscles[0], max_pressure=6e5)
    contraction, force = np.linspace(0.02, 0.18, POINTS), np.linspace(300.0, 100.0, POINTS)
    times[f"static inverse, {POINTS} points"] = repeated(
        lambda: inverse.pressure(contraction, force), 5 * rounds
    )
    statics = am.physics.joint_statics(joint)
    angles = np.linspace(-0.2, 0.2, POINTS)
    low, high = (np.asarray(each) for each in statics.stiffness_limits(angles))
    wanted = low + np.linspace(0.3, 0.7, POINTS) * (high - low)
    assert (statics.pressures(angles, wanted).count == 1).all()
    times[f"joint statics, {POINTS} points"] = repeated(
        lambda: statics.pressures(angles, wanted), rounds
    )
    rows = tuple(
        (
            name,
            *(format_time(float(value)) for value in (np.median(t), np.quantile(t, 0.99), t.max())),
        )
        for name, t in times.items()
    )
    limits = {
        "predictive control, plan": 40.0,
        "predictive control, step": 200.0,
        "extended Kalman filter, a sample": 50.0,
        f"static inverse, {POINTS} points": 5000.0,
        f"joint statics, {POINTS} points": 5000.0,
    }
    targets = tuple(
        Target(f"{name}, median", 1e6 * float(np.median(times[name])), limit, "us", reason=REASON)
        for name, limit in limits.items()
    )
    return Section("Controllers and estimators, a sample", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
