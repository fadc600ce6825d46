"""LinearLaw: the linearisation of a control law at a working point, between its samples.

A periodic law, such as one with a part that is sampled at every n-th sample, has one linearisation
for each sample of its period.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, Node, ParameterError, Recorded, ShortRepr, flatten, nodes, slopes
from ...engine.loop import STATE, ColumnSensor, ControlLaw, rebuilt
from ...engine.run.compiled_law import TracedSample, trace_sample
from ...physics.analysis.linear_model import one_sided

KINK = 1e-3
"""Relative difference of the slopes on both sides above which a law is at a kink (chosen)."""
STEPS = 25
"""Newton steps for the memory that gives wanted commands (chosen)."""
MAX_PERIOD = 1000
"""Samples of the longest common period of the parts of a law (chosen)."""
GENERATOR = tuple(f"random.{name}" for name in STATE)
"""Ends of the names of memory of a random generator. Of the laws that have one, sensors count
without noise, and others are `irregular` where it matters."""


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
    """A law as a function of a Point, with its slopes.

    clocks    places of the memory that counts samples, on which something else depends
    """

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
        self.clocks = _clocks(tuple(law.initial_memory), values, t)
        self._ticks = Recorded(arguments, [[t.later[i] for i in self.clocks]])
        self._shape = len(values), len(by)
        self._last = [[sample_time], flatten(law).tolist()]
        self.count = len(law.initial_memory)

    def __call__(self, point: Point) -> tuple[Array, Array]:
        """Memory after the sample and commands (n + m,), and their slopes by memory, measurements
        and set points.
        """
        values, table = self._function.at_numbers(*_numbers(point), *self._last)
        return np.array(values, dtype=float), np.array(table, dtype=float).reshape(self._shape)

    def at_clocks(self, point: Point, counted: Sequence[float]) -> Point:
        """A point with other values of the clocks."""
        memory = np.array(point.memory, dtype=float)
        memory[self.clocks] = counted
        return point._replace(memory=memory)

    def period(self, point: Point) -> list[Point]:
        """The point at each sample of the common period of the clocks.

        It begins where the clocks are smallest, whatever their values at the point are. Raises
        ParameterError where they do not return to a former value.
        """
        counted = tuple(np.asarray(point.memory, dtype=float)[self.clocks].tolist())
        passed: dict[tuple[float, ...], None] = {}
        while counted not in passed and len(passed) <= 2 * MAX_PERIOD:
            passed[counted] = None
            (later,) = self._ticks.at_numbers(
                *_numbers(self.at_clocks(point, counted)), *self._last
            )
            counted = tuple(later)
        values = list(passed)
        cycle = values[values.index(counted) :] if counted in passed else values
        if len(cycle) > MAX_PERIOD:
            names = tuple(self.law.initial_memory)
            counting = [i for i, *counts in zip(self.clocks, *cycle, strict=True) if np.ptp(counts)]
            counters = ", ".join(f"'{names[i]}'" for i in counting)
            raise ParameterError(
                f"linearise_loop: the samples of {type(self.law).__name__} have no common period of"
                f" {MAX_PERIOD} samples at most, because it counts them without an end in"
                f" {counters}. Linearise the law that it encloses, its field 'law', or a law whose"
                " counters return to their first values."
            )
        first = cycle.index(min(cycle))
        return [self.at_clocks(point, counts) for counts in (*cycle[first:], *cycle[:first])]


def _numbers(point: Point) -> list[list[float]]:
    return [np.asarray(vector, dtype=float).tolist() for vector in point]


def _clocks(names: Sequence[str], values: Sequence[Node], t: TracedSample) -> list[int]:
    """The places of the memory that only depends on itself, and on which commands or other memory
    depend; generators of random numbers are left out.
    """
    outside = [*t.measured, *t.setpoints, *t.minimum, *t.maximum]
    count = len(names)
    depends = [nodes.occurring([value], [*t.memory, *outside]) for value in values]
    by_memory = [set(np.flatnonzero(row[:count]).tolist()) for row in depends]
    alone = {i for i in range(count) if not any(depends[i][count:])}
    while more := {i for i in alone if by_memory[i] - alone}:
        alone -= more
    alone = {i for i in alone if not names[i].endswith(GENERATOR)}
    used: set[int] = set()
    needed = _united(by_memory[i] for i in range(len(values)) if i not in alone) & alone
    while needed - used:
        used |= needed
        needed = _united(by_memory[i] for i in used) & alone
    return sorted(used)


def _united(sets: Iterable[set[int]]) -> set[int]:
    return set[int]().union(*sets)


def linearise_law(
    law: ControlLaw,
    sample_time: float,
    point: Point,
    wanted: Mapping[str, float],
    sizes: Sequence[float],
    known: bool,
) -> tuple[LinearLaw, ...]:
    """A law linearised at a point, for each sample of its period, with the memory changed as little
    as possible so that every sample gives wanted commands.

    sizes    of the measured columns, for the look at both sides of a kink
    known    whether the memory is that of a run; otherwise one sample is done first

    Raises ParameterError where no memory and no set points give the commands, where the law has
    a kink there, and where its samples have no common period.
    """
    _check_regular(law)

    def ideal(part: Any) -> Any:  # a sensor without noise and steps, which have no slope
        with_steps = isinstance(part, ColumnSensor) and (part.resolution or part.noise)
        return dataclasses.replace(part, resolution=0.0, noise=0.0) if with_steps else part

    sample = _Sample(rebuilt(law, ideal), sample_time)
    if not known:
        point = point._replace(memory=sample(point)[0][: sample.count])
    points = _moved(sample, sample.period(point), np.array([wanted[name] for name in law.inputs]))
    tables = [sample(at)[1] for at in points]
    _check_reached(sample, tables)
    for at, table in zip(points, tables, strict=True):
        _check_sides(sample, at, table, sizes)
    n = sample.count
    p = len(law.measured_columns)
    moving = np.any([table[:, :n] != 0 for table in tables], axis=0)
    seen = np.any(moving[n:], axis=0)  # on which commands depend, also over later samples
    for _ in range(n):
        seen = seen | np.any(moving[:n][seen], axis=0)
    kept = np.flatnonzero(seen).tolist()
    names = tuple(law.initial_memory)
    return tuple(
        LinearLaw(
            table[np.ix_(kept, kept)],
            table[kept, n : n + p],
            table[kept, n + p :],
            table[n:, kept],
            table[n:, n : n + p],
            table[n:, n + p :],
            tuple(names[i] for i in kept),
            law.measured_columns,
            law.setpoints,
            law.inputs,
        )
        for table in tables
    )


def _check_regular(law: ControlLaw) -> None:
    """Raise ParameterError for a law that is `irregular`, at any depth."""

    def checked(part: Any) -> Any:
        if reason := getattr(part, "irregular", ""):
            raise ParameterError(f"linearise_loop: {reason}")
        return part

    rebuilt(law, checked)


def _moved(sample: _Sample, points: list[Point], wanted: Array) -> list[Point]:
    """The points of a period whose commands are the wanted ones, by Newton steps of the memory,
    then of the set points, both the same for all samples but for the clocks.
    """
    n = sample.count
    p = points[0].measured.size
    size = 1e-9 * np.maximum(1.0, np.abs(wanted))
    counting = np.isin(np.arange(n), sample.clocks)
    for field, columns in (("memory", slice(0, n)), ("setpoints", slice(n + p, None))):
        for _ in range(STEPS):
            results = [sample(point) for point in points]
            misses = [wanted - values[n:] for values, _ in results]
            if all((np.abs(miss) <= size).all() for miss in misses):
                return points
            by_field = np.vstack([table[n:, columns] for _, table in results])
            if field == "memory":
                by_field[:, counting] = 0.0
            change = np.linalg.lstsq(by_field, np.concatenate(misses), rcond=1e-12)[0]
            points = [at._replace(**{field: getattr(at, field) + change}) for at in points]
    worst = int(np.argmax([np.abs(miss).max() for miss in misses]))
    commands = results[worst][0][n:]
    reached = ", ".join(
        f"{name} {value:.4g}" for name, value in zip(sample.law.inputs, commands, strict=True)
    )
    raise ParameterError(
        f"linearise_loop: {type(sample.law).__name__} does not command these inputs at this state,"
        f" but {reached}. Give the control_state of a run that ends there, or inputs that the law"
        " can command."
    )


def _check_reached(sample: _Sample, tables: Sequence[Array]) -> None:
    """Raise ParameterError where nothing reaches the commands at any sample of the period."""
    if not any(np.any(table[sample.count :]) for table in tables):
        raise ParameterError(
            f"linearise_loop: no command of {type(sample.law).__name__} depends on memory,"
            " measurements or set points at this working point: it is at a limit, or switches."
            " Choose another one."
        )


def _check_sides(sample: _Sample, point: Point, table: Array, sizes: Sequence[float]) -> None:
    """Raise ParameterError where the slopes of the commands, those of a table, differ on both
    sides.
    """
    n = sample.count

    def commands(measured: Array) -> Array:
        return sample(point._replace(measured=measured))[0][n:]

    by_measured = table[n:, n : n + len(sizes)]
    for i in one_sided(commands, point.measured, by_measured, np.array(sizes), KINK):
        raise ParameterError(
            f"linearise_loop: the slopes of {type(sample.law).__name__} by"
            f" '{sample.law.measured_columns[i]}' differ on both sides of this working point (a"
            " closed valve in split range, a limit, a dead zone). Choose one on a side: give"
            " inputs that are open by a little, such as {'fill': 0.01}."
        )
