"""Sensitivities of control loops: derivatives of laws and through their samples, gradient of a
tracking error.
"""

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from ...core import (
    Array,
    ParameterError,
    System,
    Value,
    autodiff,
    check_known,
    model,
    nodes,
    slopes,
    suggestion,
    tree,
)
from ...core.declaration import forwarded
from ...recording.recording import Recording
from ..loop import SETPOINT, ControlLaw, ControlLoop, Measurement, Memory, Sampled
from .compiled_law import trace_sample
from .with_sensitivities import WithSensitivities, evaluated, sensitivity

CONTROLLER = "controller."
"""Prefix of the paths of a controller's parameters."""


class LoopWithSensitivities(NamedTuple):
    """A plant and a loop with derivatives along columns, for `simulate` and `simulate_batch`."""

    system: WithSensitivities
    loop: ControlLoop

    def initial_state(self, state: Mapping[str, float]) -> dict[str, float]:
        """The initial state of the system for one of the plant that does not depend on the
        columns.
        """
        return {**dict.fromkeys((s.name for s in self.system.states), 0.0), **state}


class TrackingSensitivity(NamedTuple):
    """The rms error of a column, in its unit, and its gradient (K,) by the columns of a sensitivity
    analysis.
    """

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
    """A plant and its control loop with the derivatives of all states, outputs and commands by
    parameters.

    columns   paths of parameters of the plant (`mechanism.mass`) or of the control law
              (`controller.gain`); a tuple of paths varies together
    scales    size of a change of each column [SI], for the error control of the derivatives
    observed  states and outputs whose derivatives are wanted; all unless given. Those that are
              measured are added

    Between two samples the derivatives obey the variational equation of the plant with v_k =
    du/dtheta_k held; at a sample those of commands and memory follow from those of the measurements
    by the chain rule, in compiled code. Both are exact for the step and the sample: with an
    integrator of fixed step they are the derivatives of that very run. Set points and inputs that
    are not commanded do not depend on the columns. The instants of samples are fixed; the instants
    of pulses would move, therefore a loop with drivers is refused.

    Raises ParameterError for a path that does not exist, a controller that is no ControlLaw, and
    drivers.
    """
    law = loop.controller
    if not isinstance(law, ControlLaw):
        raise ParameterError(
            f"differentiate_loop: {type(law).__name__} is no ControlLaw, its samples have no"
            " derivatives. Write the controller as a ControlLaw over airmuscle.core.ops."
        )
    if loop.drivers:
        raise ParameterError(
            f"differentiate_loop: the input '{next(iter(loop.drivers))}' has a driver, whose pulses"
            " begin and end at instants that move with the parameters; this is not differentiated."
            " Give a loop without drivers."
        )
    groups = [(group,) if isinstance(group, str) else tuple(group) for group in columns]
    of_law = tuple(
        tuple(p[len(CONTROLLER) :] for p in group if p.startswith(CONTROLLER)) for group in groups
    )
    of_plant = tuple(tuple(p for p in group if not p.startswith(CONTROLLER)) for group in groups)
    seen = tuple(dict.fromkeys((*observed, *law.measured_columns))) if observed else ()
    system = WithSensitivities(plant, of_plant, tuple(map(float, scales)), seen, law.inputs)
    return LoopWithSensitivities(
        system, dataclasses.replace(loop, controller=LawWithSensitivities(law, of_law))
    )


def tracking_sensitivity(
    recording: Recording, column: str, *, begin: float = 0.0
) -> TrackingSensitivity:
    """The rms error of a controlled column of a recording, and its gradient by all columns of the
    sensitivities.

        J = sqrt((1/T) integral e^2 dt),   dJ/dtheta_k = -(1/(J T)) integral e dy/dtheta_k dt,   e =
                                           r - y

    r set point, y the column, from `begin` [s] on, by the trapezoidal rule between the rows.
    Without any error the gradient is not defined and NaN. Raises ParameterError for a recording
    without the column, its set point, its derivatives, or at least two rows from `begin` on.
    """
    for name in (column, f"{SETPOINT}{column}", sensitivity(column, 0)):
        if name not in recording.columns:
            raise ParameterError(
                f"tracking_sensitivity: the recording has no column '{name}'; simulate a loop of"
                " differentiate_loop with a set point"
                f" '{column}'.{suggestion(name, recording.columns)}"
            )
    time = np.asarray(recording["time"], dtype=float)
    rows = time >= begin - 1e-12
    if not math.isfinite(begin) or np.count_nonzero(rows) < 2:
        raise ParameterError(
            f"tracking_sensitivity: begin is {begin:g} s; at least two rows must follow, allowed"
            f" range: {time[0]:g} to {time[-2] if time.size > 1 else time[0]:g} s."
        )
    error = (recording[f"{SETPOINT}{column}"] - recording[column])[rows]
    slopes = list[Array]()
    while (name := sensitivity(column, len(slopes))) in recording.columns:
        slopes.append(recording[name][rows])
    duration = time[rows][-1] - time[rows][0]
    size = math.sqrt(np.trapezoid(error**2, time[rows]) / duration)
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = -np.trapezoid(error * np.array(slopes), time[rows], axis=1) / (
            np.float64(size) * duration
        )
    return TrackingSensitivity(size, gradient)


@model
class LawWithSensitivities(ControlLaw):
    """u = k(y, r, m), m_+ = l(y, r, m) of a law, and for every column theta_k the derivatives

        du/dtheta_k   = (dk/dy) dy/dtheta_k + (dk/dm) dm/dtheta_k + dk/dtheta_k,
        dm_+/dtheta_k = (dl/dy) dy/dtheta_k + (dl/dm) dm/dtheta_k + dl/dtheta_k,

    u commands, y measurements, r set points, m memory. A column is a group of parameters of the law
    that vary together, or an empty group for a parameter of the plant alone. A command at a limit
    of its input has no derivative. The derivatives are further measured columns, commanded inputs
    and values of the memory, by the name `sensitivity(name, k)`. Where a law is not differentiable,
    such as at a quantisation, the derivative is that of one side. `differentiate_loop` makes the
    law for a loop.
    """

    from_file: ClassVar[bool] = False

    law: ControlLaw
    columns: tuple[tuple[str, ...], ...]

    def check(self) -> None:
        if not self.columns:
            raise ParameterError("LawWithSensitivities: there are no columns; give at least one.")
        known = [leaf.path for leaf in tree.leaves(self.law)]
        check_known(
            f"{type(self.law).__name__} has no parameter", itertools.chain(*self.columns), known
        )

    def _with_derivatives(self, names: tuple[str, ...]) -> tuple[str, ...]:
        return (*names, *(sensitivity(name, k) for name in names for k in range(len(self.columns))))

    setpoints = forwarded("law.setpoints")

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self._with_derivatives(self.law.measured_columns)

    @property
    def inputs(self) -> tuple[str, ...]:
        return self._with_derivatives(self.law.inputs)

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of the law, then the derivatives of each."""
        return dict(self._initial_memory)

    @functools.cached_property
    def _initial_memory(self) -> dict[str, float]:
        symbolic, parameters = autodiff.symbolic(self.law)
        traced = nodes.as_nodes(list(symbolic.initial_memory.values()))
        along = [
            slopes.tangents(traced, parameters, nodes.as_nodes(self._direction(k)))
            for k in range(len(self.columns))
        ]
        columns = evaluated(along, parameters, tree.flatten(self.law).tolist())
        values = dict(self.law.initial_memory)
        further = {
            sensitivity(name, k): float(column[i])
            for i, name in enumerate(values)
            for k, column in enumerate(columns)
        }
        return {**values, **further}

    def _direction(self, column: int) -> list[float]:
        """The change (P,) of the parameters of the law along a column."""
        moved = self.columns[column]
        return [float(leaf.path in moved) for leaf in tree.leaves(self.law)]

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        sample = trace_sample(self.law)
        law = self.law
        names = law.measured_columns
        remembered = tuple(law.initial_memory)
        bounds = zip(sample.commands, sample.minimum, sample.maximum, strict=True)
        limited = [nodes.limited(command, low, high) for command, low, high in bounds]
        variables = [*sample.measured, *sample.memory, *sample.parameters]
        parts = [[*sample.commands, *sample.later]]
        for k in range(len(self.columns)):
            seed = nodes.as_nodes(self._seed(k, memory, measurement))
            parts.append(slopes.tangents([*limited, *sample.later], variables, seed))
        ranges = [measurement.ranges[name] for name in law.inputs]
        point = [
            *(measurement.columns[name] for name in names),
            *(measurement.setpoints[name] for name in law.setpoints),
            *(memory[name] for name in remembered),
            *(low for low, _ in ranges),
            *(high for _, high in ranges),
            dt,
            *(leaf.value for leaf in tree.leaves(law)),
        ]
        symbols = [symbol for vector in sample[:-2] for symbol in vector]
        values, *columns = evaluated(parts, symbols, point)
        count = len(law.inputs)
        commands = dict(zip(law.inputs, values, strict=False))
        later = dict(zip(remembered, values[count:], strict=True))
        for k, column in enumerate(columns):
            commands |= _named_column(law.inputs, k, column[:count])
            later |= _named_column(remembered, k, column[count:])
        return commands, later

    def _seed(self, column: int, memory: Memory, measurement: Measurement) -> list[Value]:
        """The derivatives along a column of what a sample is computed from."""
        measured = self.law.measured_columns
        return [
            *(measurement.columns[sensitivity(name, column)] for name in measured),
            *(memory[sensitivity(name, column)] for name in self.law.initial_memory),
            *self._direction(column),
        ]


def _named_column(names: Iterable[str], k: int, values: Sequence[Value]) -> dict[str, Value]:
    """The derivatives of named quantities along column `k`."""
    return {sensitivity(name, k): value for name, value in zip(names, values, strict=True)}
