"""LinearLaw: the linearisation of a control law at a working point, between its samples."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ParameterError, Recorded, ShortRepr, flatten, nodes, slopes
from ...engine.loop import ColumnSensor, ControlLaw, rebuilt
from ...engine.run.compiled_law import trace_sample
from ...physics.analysis.linear_model import one_sided

KINK = 1e-3
"""Relative difference of the slopes on both sides above which a law is at a kink (chosen)."""
STEPS = 25
"""Newton steps for the memory that gives wanted commands (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LinearLaw(ShortRepr):
    """dm_(k+1) = A dm_k + B dy_k + E dr_k,  du_k = C dm_k + D dy_k + F dr_k: deviations of a law
    from a working point.

    m memory, as far as commands depend on it, y measured columns, r set points, u commands

    A, B, E, C, D, F    slopes, rows and columns in the order of the names
    memory, measured, setpoints, inputs    the names
    """

    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    F: Array
    memory: tuple[str, ...]
    measured: tuple[str, ...]
    setpoints: tuple[str, ...]
    inputs: tuple[str, ...]


class Point(NamedTuple):
    """The arguments of a sample: measured columns, set points, memory, lower and upper limits of
    the inputs.
    """

    measured: Array
    setpoints: Array
    memory: Array
    minimum: Array
    maximum: Array


class _Sample:
    """A law as a function of a Point, with its slopes."""

    def __init__(self, law: ControlLaw, sample_time: float) -> None:
        self.law = law
        t = trace_sample(law)
        commands = [
            nodes.limited(command, low, high)
            for command, low, high in zip(t.commands, t.minimum, t.maximum, strict=True)
        ]
        values = [*t.later, *commands]
        by = [*t.memory, *t.measured, *t.setpoints]
        arguments = [
            t.measured,
            t.setpoints,
            t.memory,
            t.minimum,
            t.maximum,
            t.sample_time,
            t.parameters,
        ]
        table = slopes.by_row(slopes.jacobian(values, by))
        self._function = Recorded(arguments, [values, table])
        self._shape = len(values), len(by)
        self._last = [[sample_time], flatten(law).tolist()]
        self.count = len(law.initial_memory)

    def __call__(self, point: Point) -> tuple[Array, Array]:
        """Memory after the sample and commands (n + m,), and their slopes by memory, measurements
        and set points.
        """
        vectors = [np.asarray(vector, dtype=float).tolist() for vector in point]
        values, table = self._function.at_numbers(*vectors, *self._last)
        return np.array(values, dtype=float), np.array(table, dtype=float).reshape(self._shape)


def linearise_law(
    law: ControlLaw,
    sample_time: float,
    point: Point,
    wanted: Mapping[str, float],
    sizes: Sequence[float],
    known: bool,
) -> LinearLaw:
    """A law linearised at a point, with the memory changed as little as possible so that it gives
    wanted commands.

    sizes    of the measured columns, for the look at both sides of a kink
    known    whether the memory is that of a run; otherwise one sample is done first

    Raises ParameterError where no memory and no set points give the commands, and where the law has
    a kink there.
    """

    def ideal(part: Any) -> Any:  # a sensor without noise and steps, which have no slope
        with_steps = isinstance(part, ColumnSensor) and (part.resolution or part.noise)
        return dataclasses.replace(part, resolution=0.0, noise=0.0) if with_steps else part

    sample = _Sample(rebuilt(law, ideal), sample_time)
    if not known:
        point = point._replace(memory=sample(point)[0][: sample.count])
    point = _moved(sample, point, np.array([wanted[name] for name in law.inputs]))
    _check_sides(sample, point, sizes)
    slopes, n, p = sample(point)[1], sample.count, len(law.measured_columns)
    by_memory = slopes[:, :n]
    by_measured = slopes[:, n : n + p]
    by_setpoint = slopes[:, n + p :]
    seen = np.any(by_memory[n:] != 0, axis=0)  # on which commands depend, also over later samples
    for _ in range(n):
        seen = seen | np.any(by_memory[:n][seen] != 0, axis=0)
    kept = np.flatnonzero(seen).tolist()
    names = tuple(law.initial_memory)
    return LinearLaw(
        by_memory[np.ix_(kept, kept)],
        by_measured[kept],
        by_setpoint[kept],
        by_memory[n:, kept],
        by_measured[n:],
        by_setpoint[n:],
        tuple(names[i] for i in kept),
        law.measured_columns,
        law.setpoints,
        law.inputs,
    )


def _moved(sample: _Sample, point: Point, wanted: Array) -> Point:
    """The point whose commands are the wanted ones, by Newton steps of the memory, then of the set
    points.
    """
    n = sample.count
    p = point.measured.size
    size = 1e-9 * np.maximum(1.0, np.abs(wanted))
    for field, columns in (("memory", slice(0, n)), ("setpoints", slice(n + p, None))):
        for _ in range(STEPS):
            values, slopes = sample(point)
            miss = wanted - values[n:]
            if (np.abs(miss) <= size).all():
                return point
            moved = (
                getattr(point, field) + np.linalg.lstsq(slopes[n:, columns], miss, rcond=1e-12)[0]
            )
            point = point._replace(**{field: moved})
    reached = ", ".join(
        f"{name} {value:.4g}" for name, value in zip(sample.law.inputs, values[n:], strict=True)
    )
    raise ParameterError(
        f"linearise_loop: {type(sample.law).__name__} does not command these inputs at this state,"
        f" but {reached}. Give the control_state of a run that ends there, or inputs that the law"
        " can command."
    )


def _check_sides(sample: _Sample, point: Point, sizes: Sequence[float]) -> None:
    """Raise ParameterError where the slopes of the commands differ on both sides, or nothing
    reaches the commands.
    """
    n, slopes = sample.count, sample(point)[1]
    if not np.any(slopes[n:]):
        raise ParameterError(
            f"linearise_loop: no command of {type(sample.law).__name__} depends on memory,"
            " measurements or set points at this working point: it is at a limit, or switches."
            " Choose another one."
        )

    def commands(measured: Array) -> Array:
        return sample(point._replace(measured=measured))[0][n:]

    for i in one_sided(
        commands, point.measured, slopes[n:, n : n + len(sizes)], np.array(sizes), KINK
    ):
        raise ParameterError(
            f"linearise_loop: the slopes of {type(sample.law).__name__} by"
            f" '{sample.law.measured_columns[i]}' differ on both sides of this working point (a"
            " closed valve in split range, a limit, a dead zone). Choose one on a side: give"
            " inputs that are open by a little, such as {'fill': 0.01}."
        )
