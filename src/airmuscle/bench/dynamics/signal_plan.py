"""Choice of the test signals to play next on a regulator or a joint, by their information about the
parameters that the last fit did not determine.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ParameterError, ShortRepr, counted, listed, plotting, quantity_text
from ...physics import Plant
from ...recording import Recording
from ...report import Chapter, NamedValue, Plot, Table, TableColumn
from ..reported import Reported
from .experiment import ParameterPaths
from .signal_information import (
    ParameterKnowledge,
    SignalSimulator,
    check_set_points,
    knowledge_of,
)
from .signal_limits import SignalLimits
from .signal_shapes import SignalShape, independent, standard_shapes

LEVELS = (0.25, 0.5)
JOINT_LEVELS = (0.5,)
"""Levels of the rest of a regulator and of a joint, as fractions of the range (chosen)."""
MOST_REPEATS = 2
EXCHANGES = 2
"""Greatest number of times that one signal is played, and rounds of exchanges (chosen)."""
SHRINKS = 9
SHRINK = 0.8
"""Number of trials to shrink a signal that would leave the travel, and factor of each (chosen)."""
DEFAULT_DEVIATION = 1e3
DEFAULT_ANGLE = 0.01
"""Standard deviation of the residuals of a pressure [Pa] and of an angle [rad] where no fit states
one (chosen)."""
BEGIN = 1.0
"""Time from the minimum pressure to the first level, and back at the end [s] (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PlannedSignal(ShortRepr):
    """One signal of a plan.

    description  shape, amplitude, level and muscles
    start        time of its first row in the plan [s]
    commands     (N, m) [Pa] with the rest before and after
    gain         reduction of the logarithm of the determinant of the covariance of the targets
    """

    description: str
    start: float
    commands: Array
    gain: float


class PlannedParameter(NamedTuple):
    """A parameter with its relative standard error now and, as expected, after the plan."""

    path: str
    now: float
    after: float
    is_target: bool


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SignalPlan(Reported):
    """Test signals in the order in which they are played; `print` it.

    inputs       names of the commands
    commands     (N, m) gauge [Pa], each held until the next row; begins and ends at the minimum
    sample_time  [s]
    signals      of the plan, in order of time
    parameters   with their relative standard errors
    limits       that all commands, and the simulated motions, keep
    determinant  by which factor the determinant of the covariance of the targets decreases
    motions      simulated range of each coordinate [SI]
    """

    inputs: tuple[str, ...]
    commands: Array
    sample_time: float
    signals: tuple[PlannedSignal, ...]
    parameters: tuple[PlannedParameter, ...]
    limits: SignalLimits
    determinant: float
    motions: Mapping[str, tuple[float, float]]

    @property
    def times(self) -> Array:
        """Times of the rows [s], (N,)."""
        return np.asarray(self.sample_time * np.arange(len(self.commands)), dtype=np.float64)

    def recording(self) -> Recording:
        """Time and commands as a recording."""
        columns = dict(zip(self.inputs, self.commands.T, strict=True))
        return Recording({"time": self.times, **columns}, "planned signals")

    def chapter(self) -> Chapter:
        """The description of the plan."""
        targets = [parameter.path for parameter in self.parameters if parameter.is_target]
        duration = float(self.times[-1])
        values = (
            NamedValue("duration", duration, "s", digits=4),
            NamedValue("rows per second", 1.0 / self.sample_time, "1/s"),
            NamedValue("greatest command", float(self.commands.max()), "Pa", "kPa"),
            NamedValue("expected reduction of the determinant", self.determinant, digits=3),
            *(
                NamedValue(f"simulated {end} {name}", value, "rad", "deg", 3)
                for name, ends in self.motions.items()
                for end, value in zip(("lowest", "greatest"), ends, strict=True)
            ),
        )
        signals = {
            "start": TableColumn([signal.start for signal in self.signals], "s", digits=4),
            "signal": [signal.description for signal in self.signals],
            "gain": TableColumn([signal.gain for signal in self.signals], digits=3),
        }
        errors = {
            "parameter": [parameter.path for parameter in self.parameters],
            "standard error now": _percent([parameter.now for parameter in self.parameters]),
            "after the plan": _percent([parameter.after for parameter in self.parameters]),
            "to determine": ["yes" if p.is_target else "" for p in self.parameters],
        }
        summary = (
            f"{counted(len(self.signals), 'signal')} in {duration:.4g} s, chosen by their Fisher"
            f" information about {listed(targets)}. All commands keep the limits of pressure and"
            " rate, and the simulated motion keeps those of travel."
        )
        note = "Gain: reduction of ln det of the covariance of the parameters to determine."
        return Chapter(
            "signals",
            "Signals to play next",
            summary,
            values=values,
            tables=(
                Table("signals", "Signals", signals, note, brief=len(self.signals)),
                Table(
                    "expected-errors",
                    "Relative standard errors, linearised at the present values",
                    errors,
                    brief=len(self.parameters),
                ),
            ),
            plots=(Plot("commands", "Commands of the plan", self._figure),),
        )

    def _figure(self) -> Any:
        figure, axes = plotting.new_figure()
        for name, values in zip(self.inputs, self.commands.T, strict=True):
            axes.step(self.times, values / 1e3, where="post", label=name, linewidth=0.8)
        axes.set(xlabel="time [s]", ylabel="set point [kPa]")
        axes.legend()
        return figure


def _percent(errors: Sequence[float]) -> TableColumn:
    return TableColumn(list(errors), "1", "%", 3)


def plan_signals(
    plant: Plant,
    limits: SignalLimits,
    *,
    parameters: Sequence[ParameterPaths] = (),
    covariance: Array | None = None,
    deviations: Mapping[str, float] = {},
    determine: Sequence[str] = (),
    duration: float = 60.0,
    sample_time: float = 0.005,
    seed: int = 0,
) -> SignalPlan:
    """Choose the signals for the parameters that a fit did not determine, one after another by the
    gain per second, until `duration` [s] is reached.

    plant        with a pressure regulator for each muscle, and the values of the last fit
    limits       of the rig; a joint needs its travel
    parameters   of the last fit, with `covariance` (P, P) [SI] and the `deviations` of its
                 residuals by quantity [SI]; without them all are known to a factor of three
    determine    paths of the parameters to determine; by default those with a relative standard
                 error above 50 %
    sample_time  of the rows [s]; seed of the random steps

    Raises ParameterError where no signal keeps the limits or the duration is too short.
    """
    check_set_points(plant)
    _check_travel(plant, limits)
    if not 0.0 < sample_time <= 0.02:
        raise ParameterError(
            f"plan: the sample time is {sample_time:g} s; it must be above 0 and at most 0.02 s, so"
            " that the response of a regulator is resolved."
        )
    knowledge = knowledge_of(plant, parameters, covariance, determine)
    observed = _observed(plant, deviations)
    simulator = SignalSimulator(plant, knowledge, observed, sample_time)
    candidates = _candidates(simulator, limits, seed)
    if not candidates:
        raise ParameterError(
            "plan: no signal keeps the limits. Give a wider travel, or a greater range of pressure."
        )
    choice = _choose(knowledge, candidates, _time_for_signals(limits, duration), sample_time)
    while choice:
        plan = _assembled(simulator, limits, choice)
        if plan is not None:
            return plan
        choice = choice[:-1]
    raise ParameterError(
        f"plan: no signal that keeps the limits fits into {duration:g} s. Give a longer duration,"
        " at least 20 s, or a greater rate."
    )


def _check_travel(plant: Plant, limits: SignalLimits) -> None:
    names = [coordinate.name for coordinate in plant.mechanism.coordinates]
    unknown = sorted(set(limits.travel) - set(names))
    missing = [name for name in names if name not in limits.travel]
    if unknown or missing:
        text = f"no limit of {listed(missing)}" if missing else f"limits of {listed(unknown)}"
        raise ParameterError(
            f"plan: there is {text}; the coordinates of the plant are {listed(names) or 'none'}."
            " Give the travel of each of them."
        )


def _observed(plant: Plant, deviations: Mapping[str, float]) -> dict[str, float]:
    """The observed quantities with the standard deviations of their residuals [SI]."""
    pressures = dict.fromkeys(
        (f"{prefix}pressure" for prefix in plant.prefixes),
        DEFAULT_DEVIATION,
    )
    angles = dict.fromkeys(
        (coordinate.name for coordinate in plant.mechanism.coordinates),
        DEFAULT_ANGLE,
    )
    known = {}
    for name, deviation in deviations.items():
        if name in pressures | angles:
            known[name] = deviation
    return known or angles or pressures


def _time_for_signals(limits: SignalLimits, duration: float) -> float:
    """Duration without the way to the first level and back [s]."""
    return duration - 2.0 * max(BEGIN, limits.span / limits.max_rate)


@dataclasses.dataclass(frozen=True, eq=False)
class _Candidate:
    """A signal that could be played: commands from and to `level` [Pa], and its information."""

    description: str
    level: float
    commands: Array
    information: Array


class _Move(NamedTuple):
    """How the muscles move by one shape: values (N, m) between -1 and 1."""

    muscles: str
    values: Array


def _moves(plant: Plant, shape: SignalShape, sample_time: float, number: int) -> list[_Move]:
    """One muscle alone, or two of a pair against each other and together; random steps of several
    muscles also independently, by the `number` of the shape.
    """
    count = len(plant.inputs)
    if count == 1:
        return [_Move("", shape.values[:, None])]
    moves = []
    names = [name.rpartition(".")[0] for name in plant.inputs]
    for first in range(0, count - 1, 2):
        pair = f"{names[first]} and {names[first + 1]}"
        for text, sign in (("against each other", -1.0), ("together", 1.0)):
            direction = np.zeros(count)
            direction[first : first + 2] = (1.0, sign)
            moves.append(_Move(f"{pair} {text}", shape.values[:, None] * direction))
    if count % 2:
        moves.append(_Move(names[-1], shape.values[:, None] * np.eye(count)[-1]))
    if shape.random:
        moves.append(_Move("all independently", independent(sample_time, number, count)))
    return moves


def _candidates(simulator: SignalSimulator, limits: SignalLimits, seed: int) -> list[_Candidate]:
    """All signals that keep the limits, with their information."""
    plant = simulator.plant
    shapes = standard_shapes(simulator.sample_time, seed)
    candidates = list[_Candidate]()
    for share in JOINT_LEVELS if plant.mechanism.coordinates else LEVELS:
        level = limits.min_pressure + share * limits.span
        rest = simulator.rest(level)
        texts = list[str]()
        commands = list[Array]()
        for number, shape in enumerate(shapes, seed):
            for move in _moves(plant, shape, simulator.sample_time, number):
                wanted = shape.amplitude * limits.span * move.values
                rows = _within_travel(simulator, limits, rest, level, wanted)
                if rows is not None:
                    parts = (shape.description, _range_text(rows), move.muscles)
                    texts.append(", ".join(filter(None, parts)))
                    commands.append(rows)
        candidates += _informed(simulator, rest, level, texts, commands)
    return candidates


def _range_text(commands: Array) -> str:
    low = quantity_text(float(commands.min()), "Pa", "kPa")
    return f"{low} to {quantity_text(float(commands.max()), 'Pa', 'kPa')}"


def _informed(
    simulator: SignalSimulator,
    rest: Mapping[str, float],
    level: float,
    texts: Sequence[str],
    commands: Sequence[Array],
) -> list[_Candidate]:
    """The candidates of one level with their information; runs that fail are left out."""
    if not commands:
        return []
    longest = max(map(len, commands))
    padded = [_padded(rows, longest) for rows in commands]
    information = simulator.information(padded, rest)
    return [
        _Candidate(text, level, rows, matrix)
        for text, rows, matrix in zip(texts, commands, information, strict=True)
        if np.isfinite(matrix).all()
    ]


def _padded(rows: Array, count: int) -> Array:
    return np.concatenate([rows, np.repeat(rows[-1:], count - len(rows), axis=0)])


def _segment(limits: SignalLimits, sample_time: float, level: float, wanted: Array) -> Array:
    """Commands (N, m) [Pa] of rest, motion by `wanted` (N, m) and the way back to rest, within the
    limits.
    """
    rest = np.full(wanted.shape[1], level)
    moved = limits.limited(rest + wanted, rest, sample_time)
    back = limits.ramp(moved[-1], rest, sample_time, sample_time)
    return np.concatenate([rest[None], moved, back])


def _within_travel(
    simulator: SignalSimulator,
    limits: SignalLimits,
    rest: Mapping[str, float],
    level: float,
    wanted: Array,
) -> Array | None:
    """The commands with the greatest amplitude whose simulated motion keeps the travel; None if
    none does.
    """
    step = simulator.sample_time
    if not simulator.coordinates:
        return _segment(limits, step, level, wanted)
    scales = SHRINK ** np.arange(SHRINKS)
    commands = [_segment(limits, step, level, scale * wanted) for scale in scales]
    longest = max(map(len, commands))
    motions = simulator.motions([_padded(rows, longest) for rows in commands], rest)
    allowed = np.flatnonzero(limits.allows(motions))
    return commands[allowed[0]] if allowed.size else None


@dataclasses.dataclass(eq=False)
class _Selection:
    """Candidates that are played within a time: the one with the greatest gain per second, one
    after another, and then exchanges of one for a better one of the same length at most.
    """

    knowledge: ParameterKnowledge
    candidates: Sequence[_Candidate]
    sample_time: float
    numbers: list[int] = dataclasses.field(default_factory=list)

    def fill(self, available: float) -> None:
        """Select as many as the time [s] allows."""
        while True:
            remaining = available - sum(map(self._duration, self.numbers))
            now = self._uncertainty(self.numbers)
            gains = {
                number: (now - self._uncertainty([*self.numbers, number])) / self._duration(number)
                for number in range(len(self.candidates))
                if self._duration(number) <= remaining and self._may_repeat(number, self.numbers)
            }
            if not gains:
                return
            self.numbers.append(max(gains, key=lambda number: gains[number]))

    def exchange(self) -> None:
        """Replace one selected signal after another by the best one of its length or less."""
        for place, selected in enumerate(list(self.numbers)):
            others = self.numbers[:place] + self.numbers[place + 1 :]
            allowed = [
                number
                for number in range(len(self.candidates))
                if self._duration(number) <= self._duration(selected)
                and self._may_repeat(number, others)
            ]
            self.numbers[place] = min(
                allowed, key=lambda number: self._uncertainty([*others, number])
            )

    def choice(self) -> list["_Choice"]:
        """The selected candidates with what each adds to those before it."""
        choice = []
        for end, number in enumerate(self.numbers, 1):
            before = self._uncertainty(self.numbers[: end - 1])
            gain = before - self._uncertainty(self.numbers[:end])
            choice.append(_Choice(self.candidates[number], gain))
        return choice

    def _duration(self, number: int) -> float:
        return self.sample_time * len(self.candidates[number].commands)

    def _may_repeat(self, number: int, selected: Sequence[int]) -> bool:
        return selected.count(number) < MOST_REPEATS

    def _uncertainty(self, numbers: Sequence[int]) -> float:
        information = self.knowledge.information.copy()
        for number in numbers:
            information += self.candidates[number].information
        return self.knowledge.uncertainty(information)


class _Choice(NamedTuple):
    candidate: _Candidate
    gain: float


def _choose(
    knowledge: ParameterKnowledge,
    candidates: Sequence[_Candidate],
    available: float,
    sample_time: float,
) -> list[_Choice]:
    """The candidates of a plan of a duration [s]."""
    selection = _Selection(knowledge, candidates, sample_time)
    selection.fill(available)
    for _ in range(EXCHANGES):
        selection.exchange()
    return selection.choice()


def _assembled(
    simulator: SignalSimulator, limits: SignalLimits, choice: Sequence[_Choice]
) -> SignalPlan | None:
    """The plan of a choice, whose signals are sorted by their levels; None if its simulated motion
    leaves the travel.
    """
    plant = simulator.plant
    step = simulator.sample_time
    knowledge = simulator.knowledge
    ordered = sorted(choice, key=lambda chosen: chosen.candidate.level)
    least = np.full(len(plant.inputs), limits.min_pressure)
    parts = [least[None]]
    rows = 1
    signals = []
    for chosen in ordered:
        candidate = chosen.candidate
        target = np.full(len(plant.inputs), candidate.level)
        begin = BEGIN if len(parts) == 1 else step
        if not np.array_equal(parts[-1][-1], target):
            parts.append(limits.ramp(parts[-1][-1], target, begin, step))
            rows += len(parts[-1])
        signals.append(
            PlannedSignal(candidate.description, step * rows, candidate.commands, chosen.gain)
        )
        parts.append(candidate.commands)
        rows += len(candidate.commands)
    parts.append(limits.ramp(parts[-1][-1], least, BEGIN, step))
    commands = np.concatenate(parts)
    motions = simulator.motions([commands], simulator.rest(limits.min_pressure))
    if simulator.coordinates and not limits.allows(motions, margin=0.0).all():
        return None
    information = knowledge.information + sum(c.candidate.information for c in choice)
    now = knowledge.standard_errors(knowledge.information)
    after = knowledge.standard_errors(information)
    reduction = knowledge.uncertainty(knowledge.information) - knowledge.uncertainty(information)
    return SignalPlan(
        tuple(plant.inputs),
        commands,
        step,
        tuple(signals),
        tuple(
            PlannedParameter(name, float(now[k]), float(after[k]), k in knowledge.targets)
            for k, name in enumerate(knowledge.names)
        ),
        limits,
        float(np.exp(min(reduction, 700.0))),
        {name: (float(m.min()), float(m.max())) for name, m in motions.items()},
    )
