"""LawWithSensitivities: a control law that also computes the derivatives of its commands and of its memory."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, ClassVar

from ...core import autodiff, ops, tree
from ...core.declaration import model
from ...core.errors import ParameterError, suggestion
from ...core.ops import Value
from ..loop.control_law import ControlLaw
from ..loop.controller import Measurement
from .compiled_law import TracedSample, trace_sample
from .with_sensitivities import sensitivity


@model
class LawWithSensitivities(ControlLaw):
    """u = k(y, r, m), m_+ = l(y, r, m) of a law, and for every column theta_k the derivatives

        du/dtheta_k   = (dk/dy) dy/dtheta_k + (dk/dm) dm/dtheta_k + dk/dtheta_k,
        dm_+/dtheta_k = (dl/dy) dy/dtheta_k + (dl/dm) dm/dtheta_k + dl/dtheta_k,

    u commands, y measurements, r set points, m memory. A column is a group of parameters of the law that vary
    together, or an empty group for a parameter of the plant alone. A command at a limit of its input has no
    derivative. The derivatives are further measured columns, commanded inputs and values of the memory, by the name
    `sensitivity(name, k)`. Where a law is not differentiable, such as at a quantisation, the derivative is that of one
    side. `differentiate_loop` makes the law for a loop.
    """

    from_file: ClassVar[bool] = False

    law: ControlLaw
    columns: tuple[tuple[str, ...], ...]

    def check(self) -> None:
        if not self.columns:
            raise ParameterError("LawWithSensitivities: there are no columns; give at least one.")
        known = [leaf.path for leaf in tree.leaves(self.law)]
        for path in (path for group in self.columns for path in group):
            if path not in known:
                raise ParameterError(
                    f"{type(self.law).__name__} has no parameter '{path}'; there are {', '.join(known)}."
                    f"{suggestion(path, known)}"
                )

    def _with_derivatives(self, names: tuple[str, ...]) -> tuple[str, ...]:
        return (*names, *(sensitivity(name, k) for name in names for k in range(len(self.columns))))

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self._with_derivatives(self.law.measured_columns)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.law.setpoints

    @property
    def inputs(self) -> tuple[str, ...]:
        return self._with_derivatives(self.law.inputs)

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of the law, then the derivatives of each."""
        return dict(self._initial_memory)

    @functools.cached_property
    def _initial_memory(self) -> dict[str, float]:
        import casadi

        symbolic, parameters = autodiff.symbolic(self.law)
        traced = casadi.vertcat(casadi.SX(0, 1), *(casadi.SX(v) for v in symbolic.initial_memory.values()))
        slopes = [casadi.jtimes(traced, parameters, self._direction(k)) for k in range(len(self.columns))]
        numbers = casadi.Function("start", [parameters], slopes)(tree.flatten(self.law))
        columns = numbers if isinstance(numbers, tuple | list) else [numbers]
        values = dict(self.law.initial_memory)
        further = {
            sensitivity(name, k): float(column[i]) for i, name in enumerate(values) for k, column in enumerate(columns)
        }
        return {**values, **further}

    def _direction(self, column: int) -> Any:
        """The change (P,) of the parameters of the law along a column."""
        import casadi

        moved = self.columns[column]
        return casadi.DM([float(leaf.path in moved) for leaf in tree.leaves(self.law)])

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        import casadi

        sample, law = trace_sample(self.law), self.law
        names, remembered = law.measured_columns, tuple(law.initial_memory)
        limited = casadi.fmin(casadi.fmax(sample.commands, sample.minimum), sample.maximum)
        results = casadi.vertcat(limited, sample.later)
        parts = [casadi.vertcat(sample.commands, sample.later)]
        for k in range(len(self.columns)):
            seed = casadi.vertcat(
                casadi.SX(0, 1),
                *(measurement.columns[sensitivity(name, k)] for name in names),
                *(memory[sensitivity(name, k)] for name in remembered),
                self._direction(k),
            )
            variables = casadi.vertcat(sample.measured, sample.memory, sample.parameters)
            parts.append(casadi.jtimes(results, variables, seed))
        columns = _evaluated(casadi.horzcat(*parts), sample, self.law, memory, measurement, dt)
        count = len(law.inputs)
        commands = dict(zip(law.inputs, columns[0], strict=False))
        later = dict(zip(remembered, columns[0][count:], strict=True))
        for k, column in enumerate(columns[1:]):
            commands |= {sensitivity(name, k): column[i] for i, name in enumerate(law.inputs)}
            later |= {sensitivity(name, k): column[count + i] for i, name in enumerate(remembered)}
        return commands, later


def _evaluated(
    matrix: Any, sample: TracedSample, law: ControlLaw, memory: Mapping[str, Value], measurement: Measurement, dt: Value
) -> list[list[Any]]:
    """The columns of a matrix of expressions of a sample at these values, which may be symbols themselves."""
    import casadi

    ranges = [measurement.ranges[name] for name in law.inputs]
    values = [
        *(measurement.columns[name] for name in law.measured_columns),
        *(measurement.setpoints[name] for name in law.setpoints),
        *(memory[name] for name in law.initial_memory),
        *(low for low, _ in ranges),
        *(high for _, high in ranges),
        dt,
        *(leaf.value for leaf in tree.leaves(law)),
    ]
    free = casadi.vertcat(
        sample.measured, sample.setpoints, sample.memory, sample.minimum, sample.maximum, sample.sample_time,
        sample.parameters,
    )  # fmt: skip
    values_along = casadi.substitute(casadi.cse(matrix), free, casadi.vertcat(*values))
    columns = [[values_along[i, k] for i in range(values_along.shape[0])] for k in range(values_along.shape[1])]
    return columns if ops.is_symbol(*values) else [[float(v) for v in column] for column in columns]
