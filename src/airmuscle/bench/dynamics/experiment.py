"""Experiment: one record with its command, initial state, plant and ambient air, and the unknowns
of its own.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Hint, ParameterError, ShortRepr, check_field_types, check_known, tree
from ...engine.compile import System
from ...engine.loop.inputs import InputSignal, Schedule, check_input_signal
from ...physics.pneumatics import Ambient
from ...recording import Recording
from ...recording.recording import column_heading
from .initial_conditions import InitialConditions


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Experiment(ShortRepr):
    """One record: the recording, the command that was applied, and the initial conditions.
    `command` counts from the start of the run, which is at `start_time` [s] on the clock of the
    recording; rows before it are at the initial state. `plant` replaces the plant of the fit, for
    example with another load."""

    recording: Recording
    command: InputSignal
    initial_conditions: InitialConditions
    start_time: float = 0.0
    plant: System | None = None

    def __post_init__(self) -> None:
        check_input_signal(self.command)


class _Checked:
    """Base of unknowns of one record, whose fields have the declared types."""

    def __post_init__(self) -> None:
        check_field_types(self)


@dataclasses.dataclass(frozen=True)
class StartTime(_Checked):
    """The start time of a run on the clock of its recording, as an unknown."""

    margin: float
    """Maximum deviation from the start time of the experiment [s]."""


@dataclasses.dataclass(frozen=True)
class InitialValue(_Checked):
    """A known value of the initial conditions, as an unknown: `InitialValue("pressure", 2e3)`."""

    name: str
    margin: float
    """Maximum deviation from the value of the experiment [SI]."""


@dataclasses.dataclass(frozen=True)
class CommandInstants(_Checked):
    """The instants at which the command of a run, a Schedule, changes after its first one, each as
    an unknown; they count from the start of the run, whose error is that of `StartTime`."""

    margin: float
    """Maximum deviation from an instant of the command of the experiment [s]."""


@dataclasses.dataclass(frozen=True)
class CommandInstant:
    """One instant of a command as an unknown: the instant in the command of the experiment [s], and
    its margin [s].
    """

    instant: float
    margin: float


ParameterPaths = str | tuple[str, ...]
"""Path of a parameter, or paths of several parameters with one common value."""
Nuisance = StartTime | InitialValue | CommandInstant
"""An unknown of one record that is no parameter of the plant."""
RecordUnknown = ParameterPaths | StartTime | InitialValue | CommandInstants
"""An unknown with its own value in every record."""


class PriorValue(NamedTuple):
    """What is known of a positive parameter before a fit: its value [SI], and the standard
    deviation of the logarithm of the true value over it."""

    value: float
    deviation: float


@dataclasses.dataclass(frozen=True)
class Unknown:
    """One unknown number: parameters with a common value, a start time or an initial value.
    `record` is the index of the record it belongs to, None for all records. Value and bounds are
    SI."""

    name: str
    target: tuple[str, ...] | Nuisance
    record: int | None
    value: float
    low: float
    high: float
    unit: str
    symbol: str
    meaning: str
    prior: "PriorValue | None" = None

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the parameters with this value; none for an instant or an initial value."""
        return self.target if isinstance(self.target, tuple) else ()

    @property
    def scale(self) -> float:
        """Magnitude by which the unknown is scaled in the search."""
        if isinstance(self.target, Nuisance):
            return self.target.margin
        span = self.high - self.low
        return abs(self.value) or (span if np.isfinite(span) else 1.0)

    @property
    def origin(self) -> float:
        """Value from which the unknown is counted in the search: of an instant that of the
        experiment, otherwise 0.
        """
        return self.value if isinstance(self.target, StartTime | CommandInstant) else 0.0

    @property
    def search_range(self) -> tuple[float, float]:
        """Range of the initial guesses of a multi-start: a factor of three both ways, within the
        bounds.
        """
        if isinstance(self.target, Nuisance):
            return self.low, self.high
        ends = (self.value / 3, self.value * 3) if self.value else (-self.scale, self.scale)
        return max(self.low, min(ends)), min(self.high, max(ends))


def make_unknowns(
    plant: System,
    experiments: Sequence[Experiment],
    free: Sequence[ParameterPaths],
    per_record: Sequence[RecordUnknown],
    bounds: Mapping[str, tuple[float, float]],
    priors: Mapping[str, PriorValue] | None = None,
) -> tuple[Unknown, ...]:
    """The unknowns common to all records, then those of each record. Raises ParameterError for
    unknown names.
    """
    priors = priors or {}
    unknowns = [_plant_unknown(plant, paths, None, bounds, priors) for paths in free]
    for i, experiment in enumerate(experiments):
        for target in per_record:
            if isinstance(target, StartTime | InitialValue | CommandInstants):
                unknowns += _record_unknowns(experiment, target, i)
            else:
                unknowns.append(
                    _plant_unknown(experiment.plant or plant, target, i, bounds, priors)
                )
    if not unknowns:
        example = Hint("To name one, for example", "free", ("circuit.fill.conductance",))
        raise ParameterError("no parameter is free; at least one is required.", hint=example)
    names = {u.name.partition(" of record")[0] for u in unknowns}
    stated = {**dict.fromkeys(priors, "a prior is"), **dict.fromkeys(bounds, "bounds are")}
    for name, subject in stated.items():
        if name not in names:
            free = ", ".join(u.name for u in unknowns)
            raise ParameterError(
                f"{subject} given for '{name}', which is not free; free are {free}."
            )
    for name, (value, deviation) in priors.items():
        if not (value > 0.0 and deviation > 0.0):
            raise ParameterError(
                f"the prior of '{name}' has the value {value:g} and the standard deviation"
                f" {deviation:g} of its logarithm; both must be positive."
            )
    return tuple(unknowns)


def _plant_unknown(
    plant: System,
    target: ParameterPaths,
    record: int | None,
    bounds: Mapping[str, tuple[float, float]],
    priors: Mapping[str, PriorValue],
) -> Unknown:
    paths = (target,) if isinstance(target, str) else target
    leaves = {leaf.path: leaf for leaf in tree.leaves(plant)}
    check_known(f"{type(plant).__name__} has no parameter", paths, leaves, "its parameters are")
    leaf = leaves[paths[0]]
    low, high = bounds.get(paths[0], leaf.declared.bounds)
    name = paths[0] + ("" if record is None else f" of record {record + 1}")
    if not low <= leaf.value <= high:
        raise ParameterError(
            f"the initial value of {name} is {leaf.value:g}, outside its bounds {low:g} to"
            f" {high:g}. Change the value or the bounds."
        )
    declared = leaf.declared
    return Unknown(
        name,
        paths,
        record,
        leaf.value,
        low,
        high,
        declared.unit,
        declared.symbol,
        declared.meaning,
        priors.get(paths[0]),
    )


def _record_unknowns(
    experiment: Experiment, target: StartTime | InitialValue | CommandInstants, record: int
) -> list[Unknown]:
    """A start time, an initial value, or the instants of a command after its first one. Raises
    ParameterError.
    """
    described: list[tuple[str, Nuisance, float, str, str]]  # name, target, value, unit and symbol
    if isinstance(target, StartTime):
        described = [("start time", target, experiment.start_time, "s", "t_0")]
    elif isinstance(target, InitialValue):
        known = experiment.initial_conditions.known
        where = f"the initial conditions of record {record + 1}"
        check_known(f"{where} have no known value", target.name, known, "known are")
        unit = column_heading(target.name).partition("[")[2].rstrip("]") or "SI"
        described = [
            (f"initial {target.name}", target, known[target.name], unit, f"{target.name}_0")
        ]
    elif isinstance(experiment.command, Schedule):
        instants = sorted(
            {instant for points in experiment.command.changes.values() for instant, _ in points}
        )
        further = [
            (i, CommandInstant(instant, target.margin)) for i, instant in enumerate(instants[1:], 2)
        ]
        described = [
            (f"command instant {i}", instant, instant.instant, "s", f"t_{i}")
            for i, instant in further
        ]
    else:
        raise ParameterError(
            f"the command of record {record + 1} is a {type(experiment.command).__name__}, which"
            " has no instants; give a Schedule, or leave CommandInstants out."
        )
    return [
        Unknown(
            f"{name} of record {record + 1}",
            nuisance,
            record,
            value,
            value - target.margin,
            value + target.margin,
            unit,
            symbol,
            "command instant" if isinstance(nuisance, CommandInstant) else name,
        )
        for name, nuisance, value, unit, symbol in described
    ]


def with_command_instants(command: InputSignal, instants: Mapping[float, float]) -> InputSignal:
    """The command with its instants [s] replaced by others, all inputs that change at an instant
    together.
    """
    if not instants:
        return command
    assert isinstance(command, Schedule)
    changes = {
        name: tuple((instants.get(instant, instant), value) for instant, value in points)
        for name, points in command.changes.items()
    }
    return Schedule(changes)


PRESSURE_TOLERANCE = 1e-3
TEMPERATURE_TOLERANCE = 1.0
"""Relative difference of two ambient pressures, and difference of two temperatures [K], that are
neglected (chosen).
"""
CONSTANTS = {"ambient": "pressure", "ambient_temperature": "temperature"}
"""The constants of a recording by the field of `Ambient`."""


def stated_ambient(recording: Recording, default: Ambient | None = None) -> Ambient:
    """The ambient air of a recording: its constants `ambient` [Pa] and `ambient_temperature` [K];
    what it does not state is that of `default`, by default the standard atmosphere at 20 degC."""
    known = recording.constants
    stated = {field: float(known[name]) for name, field in CONSTANTS.items() if name in known}
    return dataclasses.replace(default or Ambient(), **stated)


def check_ambient(plant: System, experiment: Experiment) -> None:
    """Raise ParameterError where a record states another ambient air than its plant has."""
    plant_air = getattr(experiment.plant or plant, "ambient", None)
    if not isinstance(plant_air, Ambient):
        return
    stated = stated_ambient(experiment.recording, plant_air)
    origin = experiment.recording.origin
    if abs(stated.pressure - plant_air.pressure) > PRESSURE_TOLERANCE * plant_air.pressure:
        name = "pressure"
        values = [f"{air.pressure / 1e3:.4g} kPa" for air in (stated, plant_air)]
    elif abs(stated.temperature - plant_air.temperature) > TEMPERATURE_TOLERANCE:
        name = "temperature"
        values = [f"{air.temperature:.4g} K" for air in (stated, plant_air)]
    else:
        return
    raise ParameterError(
        f"{origin} states an ambient {name} of {values[0]}, but its plant has {values[1]}. The mass"
        " flow and the heat depend on it: give the plant of this record the ambient air of the"
        " record, Plant(..., ambient=Ambient(...)), or correct the record."
    )


def describe_other_ambient(plant: System, experiment: Experiment) -> list[str]:
    """A note where the plant of an experiment has another ambient air than a plant; empty
    otherwise.
    """
    plant_air, record_air = (
        getattr(source, "ambient", None) for source in (plant, experiment.plant)
    )
    if (
        not (isinstance(plant_air, Ambient) and isinstance(record_air, Ambient))
        or plant_air == record_air
    ):
        return []
    texts = [
        f"{air.pressure / 1e3:.4g} kPa and {air.temperature:.4g} K"
        for air in (record_air, plant_air)
    ]
    return [
        f"the ambient air is that of the record, {texts[0]}; the plant was identified at {texts[1]}"
    ]


def describe_ambient(recordings: Sequence[Recording]) -> list[str]:
    """What is supposed of the ambient air of records that state no pressure, as sentences."""
    silent = [recording.origin for recording in recordings if "ambient" not in recording.constants]
    subject = f"{', '.join(silent)} {'does' if len(silent) == 1 else 'do'} not state"
    text = (
        f"{'No record states' if len(silent) == len(recordings) else subject} the ambient pressure:"
        f" {Ambient().pressure / 1e3:.4g} kPa are supposed; an error of 5 % of it changes a fitted"
        " heat transfer by about 20 %."
    )
    return [text] if silent else []
