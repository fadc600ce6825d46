"""WithSensors: a control law that receives its measurements through sensors with finite quality."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core import (
    Array,
    ParameterError,
    Reference,
    Value,
    check_known,
    ops,
    published,
    select_prefix,
    with_prefix,
)
from ...core.annotation import within
from ...core.declaration import Parameter, model, parameter
from .control_law import ControlLaw, EnclosingLaw, Memory, Sampled
from .controller import Measurement, SignalRelated

MAX_DELAY = 1000
"""Maximum delay of a sensor in samples (chosen)."""
LECUYER1999 = published("lecuyer-1999")
FIRST_MODULUS = 4294967087.0
SECOND_MODULUS = 4294944443.0
_SEED_MODULUS = 2147483647.0
_SEED_FACTOR = 16807.0
"""Park and Miller's generator, from which the state of a seed is taken."""
STATE = ("x0", "x1", "x2", "y0", "y1", "y2")
"""Names of the six numbers of the state, the oldest first."""


@model
class ColumnSensor(SignalRelated):
    """Sensor of one column: first-order lag T y' = x - y, noise, quantisation, delay, in this
    order.

        y_k = y_(k-1) + (1 - exp(-h/T)) (x_k - y_(k-1)),   z_k = q floor((y_k + sigma n_k)/q + 1/2),
                                                           output z_(k-d)

    x column, h sample time, n_k normal deviates. The lag starts at the first measurement, and the
    first value is delivered until the delay has passed. A parameter that is 0 disables its part.
    All are in the unit of the column.
    """

    column: str
    resolution: float = parameter(
        "y", "q", "resolution; 0: continuous", bounds=(0.0, 1e9), fitted=False, default=0.0
    )
    noise: float = parameter(
        "y", "sigma", "standard deviation of the noise", bounds=(0.0, 1e9), default=0.0
    )
    lag: float = parameter(
        "s", "T", "time constant of the lag; 0: none", bounds=(0.0, 1e3), default=0.0
    )
    delay: int = within(0, MAX_DELAY, default=0)

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a parameter: y is that of the column."""
        return units[self.column] or "1" if declared.unit == "y" else declared.unit

    @property
    def initial_memory(self) -> dict[str, float]:
        """The lagged value, and the values on their way, the oldest first."""
        return {"lagged": 0.0, **{f"delayed{i}": 0.0 for i in range(self.delay)}}

    def measure(
        self, memory: Mapping[str, Value], value: Value, deviate: Value, started: Value, dt: Value
    ) -> tuple[Value, dict[str, Value]]:
        """The output of the sensor for a value and a normal deviate, and its memory; first sample:
        `started` is 0.
        """
        lag = ops.where(self.lag > 0, self.lag, 1.0)
        share = ops.where(self.lag > 0, 1.0 - ops.exp(-dt / lag), 1.0)
        lagged = ops.where(
            started > 0, memory["lagged"] + share * (value - memory["lagged"]), value
        )
        noisy = lagged + self.noise * deviate
        step = ops.where(self.resolution > 0, self.resolution, 1.0)
        read = ops.where(self.resolution > 0, step * ops.floor(noisy / step + 0.5), noisy)
        if not self.delay:
            return read, {"lagged": lagged}
        waiting = [ops.where(started > 0, memory[f"delayed{i}"], read) for i in range(self.delay)]
        moved = [*waiting[1:], read]
        return waiting[0], {
            "lagged": lagged,
            **{f"delayed{i}": value_in_line for i, value_in_line in enumerate(moved)},
        }


def modulo(value: Value, modulus: float) -> Value:
    """Remainder of an integer below 2^53 in magnitude, from 0 to modulus - 1, exact."""
    rest = value - modulus * ops.floor(value / modulus)
    rest = ops.where(rest < 0.0, rest + modulus, rest)
    return ops.where(rest >= modulus, rest - modulus, rest)


def seeded(seed: Value) -> dict[str, Value]:
    """The state of a seed, a whole number from 0 to 2^31 - 3."""
    number = seed + 1.0
    state = {}
    for name in ("", "", *STATE):
        number = modulo(_SEED_FACTOR * number, _SEED_MODULUS)
        state[name] = number
    del state[""]
    return state


def drawn(state: Mapping[str, Value]) -> tuple[Value, dict[str, Value]]:
    """A number that is uniform in (0, 1), and the next state; L'Ecuyer (1999), Fig. I, MRG32k3a."""
    x0, x1, x2 = (state[name] for name in ("x0", "x1", "x2"))
    y0, y1, y2 = (state[name] for name in ("y0", "y1", "y2"))
    minuend = modulo(1403580.0 * x1, FIRST_MODULUS)
    subtrahend = modulo(810728.0 * x0, FIRST_MODULUS)
    first = minuend - subtrahend
    first = ops.where(first < 0.0, first + FIRST_MODULUS, first)
    minuend = modulo(527612.0 * y2, SECOND_MODULUS)
    subtrahend = modulo(1370589.0 * y0, SECOND_MODULUS)
    second = minuend - subtrahend
    second = ops.where(second < 0.0, second + SECOND_MODULUS, second)
    difference = first - second
    difference = ops.where(first > second, difference, difference + FIRST_MODULUS)
    later = {
        "x0": x1,
        "x1": x2,
        "x2": first,
        "y0": y1,
        "y1": y2,
        "y2": second,
    }
    return difference / (FIRST_MODULUS + 1.0), later


def drawn_normal(state: Mapping[str, Value]) -> tuple[Value, dict[str, Value]]:
    """A normal deviate of mean 0 and standard deviation 1 by the method of Box and Muller, and the
    next state.
    """
    radius, state = drawn(state)
    direction, later = drawn(state)
    return ops.sqrt(-2.0 * ops.log(radius)) * ops.cos(2.0 * ops.pi * direction), later


@model
class WithSensors(EnclosingLaw):
    """A control law whose measurements pass through sensors; a column without a sensor is measured
    exactly.

    The noise is a sequence of the generator MRG32k3a that the seed determines, a whole number: the
    same in every run, whether compiled or called from Python. In `simulate_batch` the seed may
    vary, `"controller.seed"`. The columns `measured.` of a recording hold the values in front of
    the sensors. Also used to state the dead time of a computer, as a delay of all columns.
    Reference: L'Ecuyer (1999) for the generator.
    """

    references: ClassVar[tuple[Reference, ...]] = (LECUYER1999,)
    simulated: ClassVar[bool] = True

    law: ControlLaw
    sensors: tuple[ColumnSensor, ...]
    seed: float = parameter(
        "1", "seed", "seed of the noise", bounds=(0.0, 2147483644.0), fitted=False, default=0.0
    )

    def check(self) -> None:
        named = [sensor.column for sensor in self.sensors]
        for name in named:
            check_known(
                "WithSensors: the law does not measure",
                name,
                self.law.measured_columns,
                "it measures",
            )
            if named.count(name) > 1:
                raise ParameterError(
                    f"WithSensors: '{name}' has two sensors; give one for each column."
                )
        if self.seed % 1.0:
            raise ParameterError(f"WithSensors: seed is {self.seed:g}; it must be a whole number.")

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started (0 or 1), and the values of the sensors, of the generator and of
        the law.
        """
        memory = {"started": 0.0}
        for sensor in self.sensors:
            memory |= with_prefix(f"sensor.{sensor.column}.", sensor.initial_memory)
        random = with_prefix("random.", dict.fromkeys(STATE, 0.0))
        return {**memory, **random, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        columns, later = self._read(memory, measurement.columns, dt)
        commands, law = self.law.step(
            select_prefix("law.", memory), measurement._replace(columns=columns), dt
        )
        return commands, {**later, **with_prefix("law.", law)}

    def readings(self, measured: Array, sample_time: float) -> Array:
        """The outputs (K, m) of the sensors for the values (K, m) in front of them, at successive
        samples.
        """
        memory = self.initial_memory
        rows = []
        for row in measured.tolist():
            columns, later = self._read(
                memory, dict(zip(self.measured_columns, row, strict=True)), sample_time
            )
            memory = {**memory, **later}
            rows.append(list(columns.values()))
        return np.array(rows, dtype=float).reshape(measured.shape)

    def _read(
        self, memory: Mapping[str, Value], measured: Mapping[str, Value], dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        """The measured columns behind their sensors, and the memory of sensors and generator."""
        started = memory["started"]
        fresh = seeded(self.seed)
        stored = select_prefix("random.", memory)
        random: dict[str, Value] = {
            name: ops.where(started > 0, stored[name], fresh[name]) for name in STATE
        }
        columns = dict(measured)
        later = {"started": 1.0}
        for sensor in self.sensors:
            deviate, random = drawn_normal(random)
            sensor_memory = select_prefix(f"sensor.{sensor.column}.", memory)
            columns[sensor.column], after = sensor.measure(
                sensor_memory, columns[sensor.column], deviate, started, dt
            )
            later |= with_prefix(f"sensor.{sensor.column}.", after)
        return columns, {**later, **with_prefix("random.", random)}
