"""Commissioning in the control benchmark: gains of a tuned controller, identified by runs on the truth."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...core.errors import AirmuscleError, ParameterError
from ...core.tree import leaves
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.controller import Controller
from ...engine.run.run import simulate
from ..tuning.case import with_gains
from .joints import ENCODER_STEP, BenchmarkJoint
from .task_signals import disturbance, task_signals
from .tasks import TUNING_BEGIN, ControlTask

RUNS, SWEEPS = 12, 2
"""Runs on the truth for each gain at most, and how often all gains are sought one after the other (chosen)."""
RESOLUTION = 0.01
"""Accuracy of an identified gain as a part of its range (chosen)."""


def identify_gains(
    joint: BenchmarkJoint, law: Controller, bounds: Mapping[str, tuple[float, float]], task: ControlTask
) -> tuple[dict[str, float], int]:
    """The gains within their bounds with which the truth follows a task best, by path [SI], and the number of runs.

    law     controller of the valves behind the sensors
    bounds  minimum and maximum [SI] of each gain; a name is the end of the path of one parameter of the law

    Each run is judged by the rms difference of set point and reading of the encoder, whose dead time is known
    afterwards. One gain after the other is sought by Brent's method without derivatives, in SWEEPS sweeps. A run that
    fails is the worst. Nothing but the sensors of the truth is used. Raises ParameterError for a gain that the law does
    not have.
    """
    from scipy.optimize import minimize_scalar

    known = [leaf.path for leaf in leaves(law)]
    paths = {name: _path(known, name) for name in bounds}
    gains: dict[str, float] = {}
    runs = 0
    for _ in range(SWEEPS if len(bounds) > 1 else 1):
        for name, (low, high) in bounds.items():

            def error(value: float, path: str = paths[name]) -> float:
                return tracking_error(joint, with_gains(law, {**gains, path: float(value)}), task)

            options = {"maxiter": RUNS, "xatol": RESOLUTION * (high - low)}
            optimum = minimize_scalar(error, bounds=(low, high), method="bounded", options=options)
            gains[paths[name]], runs = float(optimum.x), runs + int(optimum.nfev)
    return gains, runs


def _path(known: list[str], name: str) -> str:
    """The only path that ends with a name."""
    paths = [path for path in known if f".{path}".endswith(f".{name}")]
    if len(paths) != 1:
        raise ParameterError(f"identify_gains: {len(paths)} gains end with '{name}'; give the end of exactly one path.")
    return paths[0]


def tracking_error(joint: BenchmarkJoint, law: Controller, task: ControlTask) -> float:
    """The rms difference [rad] of set point and reading of the encoder in a run on the truth; infinite if it fails."""
    signals, start = task_signals(joint, task), joint.start(joint.truth)
    time = signals.time[signals.time <= task.duration + 1e-9]
    judged = time >= TUNING_BEGIN
    loop = ControlLoop(
        law, joint.sample_time, signals.setpoint(law.setpoints), disturbance(task, joint.truth.inputs),
        joint.truth_drivers,
    )  # fmt: skip
    try:
        record = simulate(
            joint.truth, loop, duration=task.duration, initial_state=start, output_times=joint.sample_time
        )
    except AirmuscleError:
        return float("inf")
    angle = np.interp(time, record["time"], record["angle"])
    reading = ENCODER_STEP * np.round(angle / ENCODER_STEP)
    return float(np.sqrt(np.mean((signals.angle[: time.size] - reading)[judged] ** 2)))
