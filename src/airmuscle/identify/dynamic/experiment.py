"""What a dynamic fit is asked: records with their commands and starts, and the unknowns, shared or of one record."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ...compile import System
from ...control.inputs import InputSignal, check_input_signal
from ...core import tree
from ...core.errors import ParameterError, suggestion
from ...recording import Recording
from ...recording.recording import header
from .initial_conditions import InitialConditions


@dataclasses.dataclass(frozen=True, eq=False)
class Experiment:
    """One record: what was measured, under which command, from which start.

    `command` counts from the beginning of the run, which stands at `start_time` on the record's clock; rows before it
    are at the start. `plant` replaces the fit's plant where a record was made with another load, say.
    """

    recording: Recording
    command: InputSignal
    initial_conditions: InitialConditions
    start_time: float = 0.0
    plant: System | None = None

    def __post_init__(self) -> None:
        check_input_signal(self.command)


@dataclasses.dataclass(frozen=True)
class StartTime:
    """The instant at which a run begins on its record's clock, as an unknown."""

    margin: float
    """How far it may lie from where the experiment says [s]."""

    def __str__(self) -> str:
        return "start time"


@dataclasses.dataclass(frozen=True)
class InitialValue:
    """A value that the start takes as known, as an unknown: `StartValue("pressure", 2e3)`."""

    name: str
    margin: float
    """How far it may lie from where the experiment says, in its own unit."""

    def __str__(self) -> str:
        return f"start {self.name}"


ParameterPaths = str | tuple[str, ...]
RecordUnknown = ParameterPaths | StartTime | InitialValue


@dataclasses.dataclass(frozen=True)
class Unknown:
    """One number to find: leaves of the plant that share it, or a start's time or value, of one record or of all."""

    name: str
    target: tuple[str, ...] | StartTime | InitialValue
    record: int | None
    value: float
    low: float
    high: float
    unit: str
    symbol: str
    meaning: str

    @property
    def paths(self) -> tuple[str, ...]:
        """The leaves that take this number; none for what acts on the start alone."""
        return self.target if isinstance(self.target, tuple) else ()

    @property
    def scale(self) -> float:
        """The size of a change that counts."""
        if isinstance(self.target, StartTime | InitialValue):
            return self.target.margin
        span = self.high - self.low
        return abs(self.value) or (span if np.isfinite(span) else 1.0)

    @property
    def search_range(self) -> tuple[float, float]:
        """Where starts are spread: within the bounds, and a factor of three either way."""
        if isinstance(self.target, StartTime | InitialValue):
            return self.low, self.high
        reach = (self.value / 3, self.value * 3) if self.value else (-self.scale, self.scale)
        return max(self.low, min(reach)), min(self.high, max(reach))


def make_unknowns(
    plant: System,
    experiments: Sequence[Experiment],
    free: Sequence[ParameterPaths],
    own: Sequence[RecordUnknown],
    bounds: Mapping[str, tuple[float, float]],
) -> tuple[Unknown, ...]:
    """The shared unknowns, then those of each record. Raises ParameterError for what the plant lacks."""
    found = [_plant_unknown(plant, what, None, bounds) for what in free]
    for i, experiment in enumerate(experiments):
        for what in own:
            if isinstance(what, StartTime | InitialValue):
                found.append(_record_unknown(experiment, what, i))
            else:
                found.append(_plant_unknown(experiment.plant or plant, what, i, bounds))
    names = [u.name for u in found]
    for name in bounds:
        if name not in {u.name.partition(" of record")[0] for u in found}:
            raise ParameterError(f"bounds of '{name}', which is not free; free are {', '.join(names)}.")
    if not found:
        raise ParameterError("nothing is free: name what to find, free=('circuit.fill.conductance',).")
    return tuple(found)


def _plant_unknown(
    plant: System, what: ParameterPaths, record: int | None, bounds: Mapping[str, tuple[float, float]]
) -> Unknown:
    paths = (what,) if isinstance(what, str) else what
    leaves = {leaf.path: leaf for leaf in tree.leaves(plant)}
    for path in paths:
        if path not in leaves:
            known = [p for p in leaves if "[" not in p]
            raise ParameterError(
                f"{type(plant).__name__} has no parameter '{path}'; there are {', '.join(known)}."
                f"{suggestion(path, leaves)}"
            )
    leaf = leaves[paths[0]]
    low, high = bounds.get(paths[0], leaf.declared.bounds)
    name = paths[0] + ("" if record is None else f" of record {record + 1}")
    if not low <= leaf.value <= high:
        raise ParameterError(f"{name} starts at {leaf.value:g}; its bounds are {low:g} to {high:g}.")
    d = leaf.declared
    return Unknown(name, paths, record, leaf.value, low, high, d.unit, d.symbol, d.meaning)


def _record_unknown(experiment: Experiment, what: StartTime | InitialValue, record: int) -> Unknown:
    if isinstance(what, StartTime):
        value, unit, symbol = experiment.start_time, "s", "t_0"
    else:
        if what.name not in experiment.initial_conditions.known:
            known = ", ".join(experiment.initial_conditions.known)
            raise ParameterError(f"the start does not take '{what.name}' as known; it takes {known}.")
        value, symbol = experiment.initial_conditions.known[what.name], f"{what.name}_0"
        unit = header(what.name).partition("[")[2].rstrip("]") or "SI"
    name = f"{what} of record {record + 1}"
    return Unknown(name, what, record, value, value - what.margin, value + what.margin, unit, symbol, str(what))
