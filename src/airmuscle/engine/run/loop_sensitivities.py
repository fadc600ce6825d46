"""Sensitivities of control loops: derivatives through the samples, and the gradient of a tracking error."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core.arrays import Array
from ...core.errors import ParameterError, suggestion
from ...core.system import System
from ...recording.recording import Recording
from ..loop.control_law import ControlLaw
from ..loop.control_loop import SETPOINT, ControlLoop
from .law_with_sensitivities import LawWithSensitivities
from .with_sensitivities import WithSensitivities, sensitivity

CONTROLLER = "controller."
"""Prefix of the paths of a controller's parameters."""


class LoopWithSensitivities(NamedTuple):
    """A plant and a loop with derivatives along columns, for `simulate` and `simulate_batch`."""

    system: WithSensitivities
    loop: ControlLoop

    def initial_state(self, state: Mapping[str, float]) -> dict[str, float]:
        """The initial state of the system for one of the plant that does not depend on the columns."""
        return {**dict.fromkeys((s.name for s in self.system.states), 0.0), **state}


class TrackingSensitivity(NamedTuple):
    """The rms error of a column, in its unit, and its gradient (K,) by the columns of a sensitivity analysis."""

    error: float
    gradient: Array


def differentiate_loop(
    plant: System,
    loop: ControlLoop,
    columns: Sequence[str | Sequence[str]],
    scales: Sequence[float],
    *,
    observed: Sequence[str] = (),
) -> LoopWithSensitivities:
    """A plant and its control loop with the derivatives of all states, outputs and commands by parameters.

    columns   paths of parameters of the plant (`mechanism.mass`) or of the control law (`controller.gain`); a tuple of
              paths varies together
    scales    size of a change of each column [SI], for the error control of the derivatives
    observed  states and outputs whose derivatives are wanted; all unless given. Those that are measured are added

    Between two samples the derivatives obey the variational equation of the plant with v_k = du/dtheta_k held; at a
    sample those of commands and memory follow from those of the measurements by the chain rule, in compiled code. Both
    are exact for the step and the sample: with an integrator of fixed step they are the derivatives of that very run.
    Set points and inputs that are not commanded do not depend on the columns. The instants of samples are fixed; the
    instants of pulses would move, therefore a loop with drivers is refused.

    Raises ParameterError for a path that does not exist, a controller that is no ControlLaw, and drivers.
    """
    law = loop.controller
    if not isinstance(law, ControlLaw):
        raise ParameterError(
            f"differentiate_loop: {type(law).__name__} is no ControlLaw, its samples have no derivatives. Write the "
            "controller as a ControlLaw over airmuscle.core.ops."
        )
    if loop.drivers:
        raise ParameterError(
            f"differentiate_loop: the input '{next(iter(loop.drivers))}' has a driver, whose pulses begin and end at "
            "instants that move with the parameters; this is not differentiated. Give a loop without drivers."
        )
    groups = [(each,) if isinstance(each, str) else tuple(each) for each in columns]
    of_law = tuple(tuple(p[len(CONTROLLER) :] for p in group if p.startswith(CONTROLLER)) for group in groups)
    of_plant = tuple(tuple(p for p in group if not p.startswith(CONTROLLER)) for group in groups)
    seen = tuple(dict.fromkeys((*observed, *law.measured_columns))) if observed else ()
    system = WithSensitivities(plant, of_plant, tuple(map(float, scales)), seen, law.inputs)
    return LoopWithSensitivities(system, dataclasses.replace(loop, controller=LawWithSensitivities(law, of_law)))


def tracking_sensitivity(recording: Recording, column: str, *, begin: float = 0.0) -> TrackingSensitivity:
    """The rms error of a controlled column of a recording, and its gradient by all columns of the sensitivities.

        J = sqrt((1/T) integral e^2 dt),   dJ/dtheta_k = -(1/(J T)) integral e dy/dtheta_k dt,   e = r - y

    r set point, y the column, from `begin` [s] on, by the trapezoidal rule between the rows. Without any error the
    gradient is not defined and NaN. Raises ParameterError for a recording without the column, its set point, its
    derivatives, or at least two rows from `begin` on.
    """
    for name in (column, f"{SETPOINT}{column}", sensitivity(column, 0)):
        if name not in recording.columns:
            raise ParameterError(
                f"tracking_sensitivity: the recording has no column '{name}'; simulate a loop of differentiate_loop "
                f"with a set point '{column}'.{suggestion(name, recording.columns)}"
            )
    time = np.asarray(recording["time"], dtype=float)
    rows = time >= begin - 1e-12
    if not math.isfinite(begin) or np.count_nonzero(rows) < 2:
        raise ParameterError(
            f"tracking_sensitivity: begin is {begin:g} s; at least two rows must follow, allowed range: "
            f"{time[0]:g} to {time[-2] if time.size > 1 else time[0]:g} s."
        )
    count = 0
    while sensitivity(column, count) in recording.columns:
        count += 1
    error = (recording[f"{SETPOINT}{column}"] - recording[column])[rows]
    slopes = np.array([recording[sensitivity(column, k)][rows] for k in range(count)])
    duration = time[rows][-1] - time[rows][0]
    size = math.sqrt(np.trapezoid(error**2, time[rows]) / duration)
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = -np.trapezoid(error * slopes, time[rows], axis=1) / (np.float64(size) * duration)
    return TrackingSensitivity(size, gradient)
