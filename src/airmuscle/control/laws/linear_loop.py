"""Linear control loops: a loop at a working point with hold, sensors and delays, and its
margins.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from ...core import Array, ParameterError, System, check_known
from ...engine.loop import (
    ControlLaw,
    Controller,
    ControlLoop,
    ControlLoopState,
    designed_loop,
)
from ...physics.analysis import LinearModel, linearise
from ...physics.analysis.frequency_figures import nyquist_figure, open_loop_figure
from ...physics.analysis.sampled_model import SampledModel, checked_frequencies, sampled
from ...report.chapter import Chapter, NamedValue
from .linear_law import LinearLaw, Point, linearise_law

POINTS = 4000
DECADES = 6
"""Frequencies below the Nyquist frequency between which crossings are sought, and their decades
(chosen).
"""
SHOWN = 500
"""Frequencies of a Bode plot."""
NO_GAIN = STABLE = 1e-9
"""Greatest gain of an open loop that counts as none (a closed valve), and by how much the magnitude
of a pole of a stable loop may exceed 1: enclosed air that is not controlled, rounding (chosen)."""

REST_TIME = 0.1
REST_TOLERANCE = 0.1
"""Time [s] over which an operating point is looked at, and by what part of its nominal value a
state may move in it with the inputs held (chosen)."""
REST_INSTANTS = 10
"""Instants in that time."""


@runtime_checkable
class HasLinearLaw(Protocol):
    """A controller that states its linear law, which holds while no limit acts."""

    def linear_law(self) -> LinearLaw:
        """The law by its slopes."""
        ...


@dataclasses.dataclass(frozen=True)
class Margins:
    """Distances of a stable loop from instability; L is the open loop, f frequencies [Hz].

    gain          smallest factor above 1 by which the gain may rise, 1/|L| where L is negative;
                  infinite: any
    lower_gain    greatest factor below 1 to which the gain may fall; 0: any
    gain_frequency    [Hz] of the smallest factor; NaN where there is none
    phase         smallest angle to -1 [rad] where |L| = 1; infinite where there is no such
                  frequency
    phase_frequency   [Hz] of that; NaN where there is none
    delay         smallest further dead time [s] at which the loop becomes unstable, phase/(2 pi f);
                  infinite: any
    peak          sensitivity peak, the greatest |1/(1 + L)|; its reciprocal is the distance of L
                  from -1
    peak_frequency    [Hz]
    """

    gain: float
    lower_gain: float
    gain_frequency: float
    phase: float
    phase_frequency: float
    delay: float
    peak: float
    peak_frequency: float

    def chapter(self) -> Chapter:
        """The description of the margins, each with the frequency at which it stands."""
        frequencies = (self.gain_frequency, self.phase_frequency, self.peak_frequency)
        of_gain, of_phase, of_peak = (
            f"at {f:.4g} Hz" if math.isfinite(f) else "" for f in frequencies
        )
        values = (
            NamedValue("gain margin", self.gain, remark=of_gain),
            NamedValue("phase margin", self.phase, "rad", "deg", remark=of_phase),
            NamedValue("delay margin", self.delay, "s", "ms"),
            NamedValue("sensitivity peak", self.peak, remark=of_peak),
        )
        lower = (
            (f"the gain may fall to {100 * self.lower_gain:.3g} %",)
            if self.lower_gain > 0.0
            else ()
        )
        return Chapter(
            "margins",
            "Margins",
            "Distances of the loop from instability.",
            values=values,
            notes=lower,
        )


def frequency_grid(model: SampledModel) -> Array:
    """Frequencies (F,) [Hz] up to the Nyquist frequency, denser at the resonances of a model."""
    top = model.nyquist_frequency
    grid = np.geomspace(top * 10.0**-DECADES, top, POINTS)
    turns = np.abs(np.angle(model.poles)) / (2 * math.pi * model.sample_time)
    near = np.array(
        [f * (1.0 + part) for f in turns if f > grid[0] for part in np.linspace(-0.02, 0.02, 21)]
    )
    frequencies = np.unique(np.concatenate([grid, near]))
    return frequencies[(frequencies > 0) & (frequencies <= top)]


def loop_margins(opened: SampledModel) -> Margins:
    """The margins of an open loop L with one input and one output, whose closed loop 1/(1 + L) is
    stable.

    Crossings between the frequencies of a grid are refined to rounding; the Nyquist frequency is
    one of them.
    """
    frequencies = frequency_grid(opened)

    def at(f: float) -> complex:
        return complex(opened.frequency_response([f])[0, 0, 0])

    values = _scanned(opened, frequencies)
    negative = [f for f in _zeros(frequencies, values.imag, lambda f: at(f).imag) if at(f).real < 0]
    if values[-1].real < 0:
        negative.append(float(frequencies[-1]))
    factors = {1.0 / abs(at(f)): f for f in negative if at(f) != 0}
    crossings = _zeros(frequencies, np.abs(values) - 1.0, lambda f: abs(at(f)) - 1.0)
    angles = {f: float(np.angle(-at(f))) for f in crossings}
    nearest = min(angles, key=lambda f: abs(angles[f]), default=math.nan)
    delays = [(angle % (2 * math.pi)) / (2 * math.pi * f) for f, angle in angles.items()]
    peak, where = _peak(frequencies, np.abs(1.0 + values), lambda f: abs(1.0 + at(f)))
    gain = min((x for x in factors if x >= 1.0), default=math.inf)
    lower = max((x for x in factors if x < 1.0), default=0.0)
    phase = abs(angles.get(nearest, math.inf))
    delay = min(delays, default=math.inf)
    return Margins(gain, lower, factors.get(gain, math.nan), phase, nearest, delay, peak, where)


def _scanned(opened: SampledModel, frequencies: Array) -> npt.NDArray[np.complex128]:
    """The responses (F,) of a loop, many at once: back substitution in the Schur form of its
    balanced state matrix.
    """
    from scipy.linalg import matrix_balance, schur

    balanced, (scale, _) = matrix_balance(opened.A, permute=False, separate=True)
    triangle, turn = schur(balanced, output="complex")
    b = turn.conj().T @ (opened.B[:, 0] / scale)
    c = (opened.C[0] * scale) @ turn
    z = np.exp(2j * math.pi * frequencies * opened.sample_time)
    states = np.zeros((len(b), z.size), dtype=complex)
    for i in reversed(range(len(b))):
        states[i] = (b[i] + triangle[i, i + 1 :] @ states[i + 1 :]) / (z - triangle[i, i])
    values = np.asarray(c @ states + opened.D[0, 0])
    for signs in (
        np.sign(values.imag),
        np.sign(np.abs(values) - 1.0),
    ):  # next to crossings a sign may be rounding
        near = np.unique(np.flatnonzero(np.diff(signs))[:, None] + np.arange(2))
        values[near] = opened.frequency_response(frequencies[near])[:, 0, 0]
    return values


def _zeros(grid: Array, values: Array, function: Callable[[float], float]) -> list[float]:
    """The zeros of a function between points where `values`, whose sign may be rounding, and it
    change their sign.
    """
    from scipy.optimize import brentq

    pairs = [grid[i : i + 2] for i in np.flatnonzero(values[:-1] * values[1:] < 0)]
    changes = [ends for ends in pairs if function(ends[0]) * function(ends[1]) < 0]
    return [float(brentq(function, *ends, xtol=1e-300, rtol=1e-14)) for ends in changes]


def _peak(grid: Array, distances: Array, function: Callable[[float], float]) -> tuple[float, float]:
    """The reciprocal of the smallest distance, and its frequency [Hz]."""
    from scipy.optimize import minimize_scalar

    i = int(np.argmin(distances))
    low = grid[max(i - 1, 0)]
    high = grid[min(i + 1, grid.size - 1)]
    search = minimize_scalar(
        function, bounds=(low, high), method="bounded", options={"xatol": 1e-12 * high}
    )
    best, where = min((float(search.fun), float(search.x)), (float(distances[i]), float(grid[i])))
    return (math.inf if best == 0 else 1.0 / best), where


@dataclasses.dataclass(frozen=True, eq=False)
class LinearLoop:
    """A control loop near a working point, between its samples: the plant for held inputs, and the
    law.

    plant        linearised, with the delays of its inputs; outputs are the measured columns
    laws         the law linearised at each sample of its period, with the lag and the delay of its
                 sensors in its memory; one for a law that is the same at all samples
    sample_time  [s]
    drift        how far each state of the plant moves within 0.1 s, with the inputs held, in the
                 unit of the state: the residual of the operating point, 0 at an equilibrium

    A law with a part at every n-th sample (Multirate) is lifted: its models describe the loop from
    period to period, their sample time is n `sample_time`. Reference: Franklin, Powell and Workman
    (1998), chapter 11.
    """

    plant: LinearModel
    laws: tuple[LinearLaw, ...]
    sample_time: float
    drift: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def period(self) -> float:
        """The period [s] of the loop: the sample time times the samples of the law's period."""
        return self.sample_time * len(self.laws)

    @property
    def closed(self) -> SampledModel:
        """The closed loop, from the set points to the measured columns."""
        return self._lifted(self._steps(None))

    def open_loop(self, column: str | None = None) -> SampledModel:
        """The loop opened at a measured column: from the value that the law receives to minus that
        of the plant.

        Without a column it is the first that is measured. The loops of all other columns remain
        closed: opened at the pressure, a cascade has the open loop of its pressure control, with
        that of the position around it. With L the loop is stable where 1 + L(z) has no zero outside
        the unit circle. Of a periodic law L is that of the sample at which the law receives the
        column. Raises ParameterError for another column, and for one that a periodic law receives
        at several samples of its period.
        """
        known = self.laws[0].measured
        name = known[0] if column is None else column
        check_known("open_loop: the law does not measure", name, known, "it measures")
        steps = self._steps(known.index(name))
        received = [k for k, step in enumerate(steps) if step.B.any()]
        if len(received) > 1 and len(steps) > 1:
            others = self._received_once()
            raise ParameterError(
                f"open_loop: the law receives '{name}' at {len(received)} of the {len(steps)}"
                " samples of its period, so that the loop opened there has no single frequency"
                f" response. Stability is that of 'is_stable'; margins: {others}."
            )
        first = received[0] if received else 0
        return self._lifted([*steps[first:], *steps[:first]])

    @property
    def poles(self) -> npt.NDArray[np.complex128]:
        """Poles z of the closed loop, that of the greatest magnitude first; unstable outside the
        unit circle.
        """
        return self.closed.poles

    @property
    def is_stable(self) -> bool:
        """Whether no pole of the closed loop is outside the unit circle."""
        return bool(np.abs(self.poles).max(initial=0.0) <= 1.0 + STABLE)

    def margins(self, column: str | None = None) -> Margins:
        """Gain, phase and delay margin and sensitivity peak of the loop that is opened at a
        measured column.

        Raises ParameterError where the closed loop is not stable: its margins would have no
        meaning.
        """
        if not self.is_stable:
            raise ParameterError(
                "margins: the closed loop is not stable, its pole of the greatest magnitude is"
                f" {self.poles[0]:.4g}. Lower the gains, or shorten the sample time."
            )
        return loop_margins(self._acting(column))

    def bode(self, column: str | None = None, frequencies: npt.ArrayLike | None = None) -> Any:
        """A Matplotlib figure of gain [dB] and phase [deg] of the open loop, up to the Nyquist
        frequency unless given [Hz], with the margins of a stable loop.
        """
        opened = self._acting(column)
        shown = (
            np.geomspace(1e-4, 1.0, SHOWN) * opened.nyquist_frequency
            if frequencies is None
            else checked_frequencies(frequencies)
        )
        margins = loop_margins(opened) if self.is_stable else None
        return open_loop_figure(opened, shown, margins)

    def nyquist(self, column: str | None = None) -> Any:
        """A Matplotlib figure of the open loop in the complex plane, with the circle of its
        sensitivity peak.
        """
        opened = self._acting(column)
        return nyquist_figure(
            opened.frequency_response(frequency_grid(opened))[:, 0, 0], loop_margins(opened).peak
        )

    def _acting(self, column: str | None) -> SampledModel:
        """The loop that is opened at a column; ParameterError where its gain is zero, as behind a
        closed valve.
        """
        opened = self.open_loop(column)
        name = column or self.laws[0].measured[0]
        if np.abs(opened.frequency_response(frequency_grid(opened))).max(initial=0.0) < NO_GAIN:
            raise ParameterError(
                f"the loop that is opened at '{name}' has no gain at this working point."
                " Linearise where the valves are open by a little; a spool within"
                " its overlap is a valve that is closed."
            )
        return opened

    def step_response(self, setpoint: str, duration: float, size: float = 1.0) -> dict[str, Array]:
        """`time` [s] and the deviations (K,) of all measured columns at the samples after a step of
        a set point.

        Of a periodic law the samples are the first ones of its periods.
        """
        known = self.laws[0].setpoints
        check_known("step_response: the law has no set point", setpoint, known)
        time = self.period * np.arange(max(round(duration / self.period), 1) + 1)
        steps = np.zeros((time.size, len(known)))
        steps[:, known.index(setpoint)] = size
        return {
            "time": time,
            **dict(zip(self.laws[0].measured, self.closed.response(steps).T, strict=True)),
        }

    def _received_once(self) -> str:
        """The columns at which a periodic loop can be opened, in words."""
        known = self.laws[0].measured
        once = [
            f"'{name}'"
            for i, name in enumerate(known)
            if sum(bool(step.B.any()) for step in self._steps(i)) == 1
        ]
        if once:
            return f"open the loop at {' or '.join(once)}"
        return "linearise the loop with Multirate(law, 1) at the sample time of the slower part"

    def _steps(self, opened: int | None) -> list[SampledModel]:
        """The loop over each sample of the period: from the set points to the columns, or from the
        received value of a column to minus its own.
        """
        plant = sampled(self.plant, self.sample_time, before=True)
        return [self._step(plant, law, opened) for law in self.laws]

    def _step(self, plant: SampledModel, law: LinearLaw, opened: int | None) -> SampledModel:
        back = np.eye(len(law.measured))
        if opened is not None:
            back[opened, opened] = 0.0
        seen = back @ plant.C
        a = np.block([[plant.A + plant.B @ law.D @ seen, plant.B @ law.C], [law.B @ seen, law.A]])
        by_plant, by_law = (
            (law.F, law.E) if opened is None else (law.D[:, [opened]], law.B[:, [opened]])
        )
        c = np.hstack([plant.C, np.zeros((len(law.measured), len(law.memory)))])
        names = (*plant.states, *(f"controller.{name}" for name in law.memory))
        b = np.vstack([plant.B @ by_plant, by_law])
        inputs = law.setpoints
        outputs = law.measured
        if opened is not None:
            c = -c[[opened]]
            inputs = (law.measured[opened],)
            outputs = ("open loop",)
        return SampledModel(
            a, b, c, np.zeros((len(c), b.shape[1])), self.sample_time, names, inputs, outputs
        )

    def _lifted(self, steps: list[SampledModel]) -> SampledModel:
        """The steps of a period as one, for inputs that are held over the period."""
        a = np.eye(len(steps[0].A))
        b = np.zeros_like(steps[0].B)
        for step in steps:
            a = step.A @ a
            b = step.A @ b + step.B
        return dataclasses.replace(steps[0], A=a, B=b, sample_time=self.period)


def linearise_loop(
    plant: System,
    loop: ControlLoop,
    state: Mapping[str, float],
    inputs: Mapping[str, float] | None = None,
    *,
    control_state: ControlLoopState | None = None,
    delay: float | Mapping[str, float] = 0.0,
) -> LinearLoop:
    """A control loop linearised at a state, by exact derivatives of plant and law.

    inputs         of the plant at the working point; those of the control_state or 0 unless given.
                   The memory of the law (if that does not suffice, its set points) is changed so
                   that it commands them
    control_state  of a run that ends there (`Solution.control_state`): the memory of the law;
                   otherwise it is that after the first sample, in which integrals are where the law
                   starts them
    delay          dead time [s] between command and input, of all inputs or by name, such as that
                   of the computer

    Sensors have neither noise nor steps. A driver counts as its mean: the opening is the command.
    A law with a part that is sampled at every n-th sample is lifted over its period, whatever the
    sample is at which a run has ended.
    Set points that are measured columns are their values. A controller that is no ControlLaw needs
    a method `linear_law`, as predictive control has, which is linear while no limit acts. Raises
    ParameterError for another controller, an active limit, a state or input that does not fit, a
    state that moves (by more than a tenth of a nominal value within 0.1 s, with the inputs held), a
    working point at a kink of the law, and a law whose samples have no common period or differ at
    random.
    """
    loop = designed_loop(loop, plant)
    law = loop.controller
    if not isinstance(law, ControlLaw | HasLinearLaw):
        raise ParameterError(
            f"linearise_loop: {type(law).__name__} is neither a ControlLaw nor has it a"
            " `linear_law`: its samples have no derivatives. Write the controller as a ControlLaw"
            " over airmuscle.core.ops, or give it a method `linear_law` that returns the LinearLaw"
            " of its samples."
        )
    present = control_state.applied_inputs if control_state else ()
    inputs_at_rest = {
        **dict(zip((i.name for i in plant.input_variables), present, strict=False)),
        **(inputs or {}),
    }
    model = linearise(plant, state, inputs_at_rest)
    loop.check_columns(model.outputs, model.inputs)
    drift = _drift(model)
    _check_rest(plant, model, drift)
    if not isinstance(law, ControlLaw):
        _check_no_limit(law, control_state)
        selected = model.select(law.inputs, law.measured_columns).with_delay(delay)
        return LinearLoop(selected, (law.linear_law(),), loop.sample_time, drift)
    columns = model.output_values
    measured = [columns[name] for name in law.measured_columns]
    nominal = {state_variable.name: abs(state_variable.nominal) for state_variable in plant.states}
    sizes = [max(abs(columns[name]), nominal.get(name, 1e-3)) for name in law.measured_columns]
    limits = np.array(list(loop.command_ranges(plant).values()))
    memory = law.initial_memory if control_state is None else control_state.controller
    values = np.array(list(memory.values() if isinstance(memory, Mapping) else memory), dtype=float)
    time = control_state.time if control_state else 0.0
    signal = loop.setpoint.segments(law.setpoints, time, loop.sample_time).values[0]
    setpoints = [
        columns.get(name, value) for name, value in zip(law.setpoints, signal.tolist(), strict=True)
    ]
    point = Point(np.array(measured), np.array(setpoints), values, limits[:, 0], limits[:, 1])
    laws = linearise_law(
        law, loop.sample_time, point, model.input_values, sizes, control_state is not None
    )
    return LinearLoop(
        model.select(law.inputs, law.measured_columns).with_delay(delay),
        laws,
        loop.sample_time,
        drift,
    )


def _check_no_limit(law: Controller, control_state: ControlLoopState | None) -> None:
    """Raise ParameterError for a run that ends where a limit of a controller acts: it is the linear
    law nowhere near.
    """
    active = getattr(control_state.controller, "active", None) if control_state else None
    if active is not None and np.any(active):
        raise ParameterError(
            f"linearise_loop: at this working point {np.count_nonzero(active)} limits of"
            f" {type(law).__name__} act, where it is no linear law. Give the control_state of a run"
            " that ends within the limits, or none."
        )


def _drift(model: LinearModel) -> dict[str, float]:
    """The greatest motion of each state within a time, with the inputs held, by the linear model
    with the rates of its operating point.
    """
    from scipy.linalg import expm

    n = len(model.states)
    rates = model.rates[:, None]
    moving = np.block([[model.A, rates], [np.zeros((1, n + 1))]]) * (REST_TIME / REST_INSTANTS)
    step = expm(moving)
    state = np.append(np.zeros(n), 1.0)
    greatest = np.zeros(n)
    for _ in range(REST_INSTANTS):
        state = step @ state
        greatest = np.maximum(greatest, np.abs(state[:n]))
    return dict(zip(model.states, greatest.tolist(), strict=True))


def _check_rest(plant: System, model: LinearModel, drift: Mapping[str, float]) -> None:
    """Raise ParameterError for a state that moves: it has no margins."""
    permitted = {
        state_variable.name: REST_TOLERANCE * abs(state_variable.nominal)
        for state_variable in plant.states
    }
    name = max(drift, key=lambda state: drift[state] / permitted[state], default="")
    if name and not drift[name] <= permitted[name]:
        unit = model.units[name]
        raise ParameterError(
            f"linearise_loop: this state is no operating point: with these inputs held, '{name}'"
            f" moves by {drift[name]:.3g} {unit} within {REST_TIME:g} s; allowed:"
            f" {permitted[name]:.3g} {unit}. Margins belong to a loop at rest. Give the state of"
            " find_equilibrium(plant, pressure=...) at the pressures of the run, and the inputs"
            " that hold it."
        )
