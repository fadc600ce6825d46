"""Good records of several kinds, from formulas and from simulated plants, and faults planted in
them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping

import numpy as np

from airmuscle.recording import Recording

RATE = 200.0
DURATION = 12.0
TIME = np.arange(0.0, DURATION, 1.0 / RATE)
Columns = dict[str, np.ndarray]


def noise(seed: int, size: int, scale: float) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, scale, size)


def lagged(command: np.ndarray, lag: float, dead_time: float = 0.03) -> np.ndarray:
    """A first-order response [Pa] with a dead time."""
    shift = round(dead_time * RATE)
    late = np.concatenate([np.full(shift, command[0]), command[: len(command) - shift]])
    share = 1.0 - np.exp(-1.0 / RATE / lag)
    response = np.empty_like(late)
    response[0] = late[0]
    for i in range(1, len(late)):
        response[i] = response[i - 1] + share * (late[i] - response[i - 1])
    return response


def stairs(levels: tuple[float, ...]) -> np.ndarray:
    """A command [Pa] that holds levels [kPa]."""
    index = np.minimum((TIME / DURATION * len(levels)).astype(int), len(levels) - 1)
    return 1e3 * np.array(levels)[index]


STAIRS = (0.0, 100.0, 200.0, 300.0, 400.0, 300.0, 200.0, 100.0)


def regulator(seed: int = 0, levels: tuple[float, ...] = STAIRS, lag: float = 0.1) -> Columns:
    command = stairs(levels)
    pressure = lagged(command, lag) + noise(seed, len(TIME), 400.0)
    return {"time": TIME, "setpoint": command, "pressure": pressure}


def isotonic(seed: int = 1) -> Columns:
    """A muscle that lifts a load under slow stairs."""
    columns = regulator(seed)
    contraction = 0.22 * np.clip(columns["pressure"] / 4e5, 0.0, 1.0) ** 0.8
    force = 80.0 + noise(seed + 9, len(TIME), 0.4)
    return {
        **columns,
        "contraction": contraction + noise(seed + 5, len(TIME), 3e-4),
        "force": force,
    }


def isometric(seed: int = 2) -> Columns:
    pressure = 3e5 * 0.5 * (1.0 - np.cos(2 * np.pi * TIME / DURATION))
    force = 1.1e-3 * np.clip(pressure - 2e4, 0.0, None) + noise(seed, len(TIME), 0.5)
    length = np.full(len(TIME), 0.19) + noise(seed + 1, len(TIME), 2e-5)
    return {
        "time": TIME,
        "pressure": pressure + noise(seed + 2, len(TIME), 300.0),
        "force": force,
        "length": length,
    }


def isobaric(seed: int = 3) -> Columns:
    contraction = 0.1 * (1.0 - np.cos(2 * np.pi * TIME / DURATION))
    force = 300.0 * (1.0 - 3.2 * contraction) + 4.0 * np.sign(np.gradient(contraction))
    return {
        "time": TIME,
        "pressure": np.full(len(TIME), 3e5) + noise(seed, len(TIME), 500.0),
        "contraction": contraction,
        "force": -force * -1.0 + noise(seed + 1, len(TIME), 0.5),
    }


def joint(seed: int = 4) -> Columns:
    """An antagonistic joint with two regulated muscles."""
    left = 2e5 + 1e5 * np.sin(2 * np.pi * 0.3 * TIME)
    right = 2e5 - 1e5 * np.sin(2 * np.pi * 0.3 * TIME + 0.4)
    pressures = [
        lagged(side, 0.08) + noise(seed + i, len(TIME), 300.0)
        for i, side in enumerate((left, right))
    ]
    angle = 2.5e-6 * (pressures[0] - pressures[1]) + noise(seed + 7, len(TIME), 1e-3)
    return {
        "time": TIME,
        "left.setpoint": left,
        "left.pressure": pressures[0],
        "right.setpoint": right,
        "right.pressure": pressures[1],
        "angle": angle,
    }


def chirp(seed: int = 6) -> Columns:
    command = 2e5 + 1.2e5 * np.sin(2 * np.pi * (0.1 * TIME + 0.06 * TIME**2))
    return {
        "time": TIME,
        "setpoint": command,
        "pressure": lagged(command, 0.06) + noise(seed, len(TIME), 400.0),
    }


def quantised(seed: int = 7) -> Columns:
    """A regulator whose sensor resolves 2 kPa."""
    columns = regulator(seed)
    return {**columns, "pressure": 2e3 * np.round(columns["pressure"] / 2e3)}


def fill(seed: int = 8) -> Columns:
    pressure = 5e5 * (1.0 - np.exp(-np.clip(TIME - 1.0, 0.0, None) / 0.8))
    opening = (TIME >= 1.0).astype(float)
    return {
        "time": TIME,
        "fill": opening,
        "pressure": pressure + noise(seed, len(TIME), 600.0),
    }


def with_supply(seed: int = 9) -> Columns:
    columns = isotonic(seed)
    supply = 6e5 - 0.05 * columns["pressure"] + noise(seed + 3, len(TIME), 500.0)
    return {**columns, "supply.pressure": supply}


@functools.cache
def simulated(name: str, noisy: bool = True) -> Columns:
    """A plant of the library under steps of its valves or set points."""
    import airmuscle as am

    plant = am.load(name).plant
    schedule = {}
    for i, variable in enumerate(plant.input_variables):
        if variable.name.endswith("setpoint"):
            size = 1.0 if name == "joint-straight-fibre" else 2.4
            levels = (9e4 * size, (1.5e5 - 7e4 * (i % 2)) * size, 9e4 * size)
            schedule[variable.name] = tuple(zip((0.0, 2.0, 5.0), levels, strict=True))
    run = am.simulate(plant, am.Schedule(schedule), duration=8.0, output_times=0.01)
    columns = {column: np.array(values) for column, values in run.columns.items()}
    for j, (column, values) in enumerate(columns.items()):
        is_measured = column != "time" and not column.endswith("setpoint")
        if noisy and is_measured and np.ptp(values) > 0:
            columns[column] = values + noise(j, len(values), 1e-3 * float(np.ptp(values)))
    return columns


GOOD: Mapping[str, Callable[[], Columns]] = {
    "regulator": regulator,
    "fast regulator": lambda: regulator(11, lag=0.03),
    "slow regulator": lambda: regulator(12, lag=0.25),
    "two levels": lambda: regulator(13, (50.0, 350.0, 50.0, 350.0)),
    "small steps": lambda: regulator(14, (200.0, 210.0, 220.0, 230.0, 220.0, 210.0)),
    "isotonic": isotonic,
    "isotonic, other seed": lambda: isotonic(21),
    "isometric": isometric,
    "isometric, other seed": lambda: isometric(22),
    "isobaric": isobaric,
    "isobaric, other seed": lambda: isobaric(23),
    "joint": joint,
    "joint, other seed": lambda: joint(24),
    "chirp": chirp,
    "quantised": quantised,
    "fill": fill,
    "supply measured": with_supply,
    "noise-free regulator": lambda: {**regulator(), "pressure": lagged(stairs(STAIRS), 0.1)},
    "jitter of a tenth": lambda: {
        **regulator(),
        "time": TIME + noise(3, len(TIME), 0.05 / RATE),
    },
    "length in place of contraction": lambda: {
        **{k: v for k, v in isotonic(25).items() if k != "contraction"},
        "length": 0.2 * (1.0 - isotonic(25)["contraction"]),
    },
}
"""Records without a fault."""


def changed(make: Callable[[], Columns], **columns: Callable[[Columns], np.ndarray]) -> Columns:
    before = make()
    return {**before, **{name: change(before) for name, change in columns.items()}}


def _rows(columns: Columns, rows: np.ndarray) -> Columns:
    return {name: values[rows] for name, values in columns.items()}


def _held(values: np.ndarray, first: int, last: int) -> np.ndarray:
    held = values.copy()
    held[first:last] = values[first]
    return held


def _spiked(values: np.ndarray) -> np.ndarray:
    spiked = values.copy()
    spiked[[300, 900, 1500]] += 1.2 * np.ptp(values)
    return spiked


def _swapped_sensors() -> Columns:
    columns = joint()
    return {
        **columns,
        "left.pressure": columns["right.pressure"],
        "right.pressure": columns["left.pressure"],
    }


def _drooping() -> Columns:
    columns = regulator(31, (50.0, 400.0, 50.0, 400.0, 50.0, 400.0))
    loss = 1.0 - 0.03 * TIME
    return {**columns, "pressure": columns["pressure"] * np.clip(loss, 0.6, 1.0)}


ROWS = np.arange(len(TIME))
FAULTS: Mapping[str, tuple[str, Callable[[], Columns]]] = {
    "too short": ("length", lambda: _rows(isotonic(), ROWS[:20])),
    "ends in a step": ("length", lambda: _rows(fill(), ROWS[:260])),
    "gap": ("gap", lambda: _rows(isotonic(), ROWS[(ROWS < 800) | (ROWS > 1100)])),
    "time goes back": (
        "sample time",
        lambda: changed(isotonic, time=lambda c: np.where(ROWS > 1200, c["time"] - 3.0, c["time"])),
    ),
    "jitter": (
        "sample time",
        lambda: changed(regulator, time=lambda c: np.cumsum(np.abs(noise(5, len(TIME), 1 / RATE)))),
    ),
    "late response": (
        "delay",
        lambda: changed(
            regulator, pressure=lambda c: lagged(c["setpoint"], 0.1, 0.6) + noise(1, len(TIME), 300)
        ),
    ),
    "supply falls": (
        "supply",
        lambda: {**with_supply(), "supply.pressure": np.linspace(6e5, 4.2e5, len(TIME))},
    ),
    "holds fall": ("supply", _drooping),
    "command and pressure exchanged": (
        "exchanged columns",
        lambda: changed(
            regulator, setpoint=lambda c: c["pressure"], pressure=lambda c: c["setpoint"]
        ),
    ),
    "two sensors exchanged": ("exchanged columns", _swapped_sensors),
    "sign of the motion": (
        "sign",
        lambda: changed(isotonic, contraction=lambda c: -c["contraction"]),
    ),
    "sign of the force": ("value", lambda: changed(isometric, force=lambda c: -c["force"])),
    "zero of the pressure": (
        "zero",
        lambda: changed(regulator, pressure=lambda c: c["pressure"] + 3e4),
    ),
    "saturated pressure": (
        "saturation",
        lambda: changed(isotonic, pressure=lambda c: np.minimum(c["pressure"], 3.2e5)),
    ),
    "stuck sensor": (
        "stuck sensor",
        lambda: changed(isometric, force=lambda c: _held(c["force"], 700, 1100)),
    ),
    "dead sensor": ("dead sensor", lambda: changed(isometric, force=lambda c: 0.0 * c["force"])),
    "spikes": ("spike", lambda: changed(isometric, force=lambda c: _spiked(c["force"]))),
    "pressure does not follow": (
        "following",
        lambda: changed(regulator, pressure=lambda c: 1e5 + noise(8, len(TIME), 500.0)),
    ),
    "limit switch": (
        "end stop",
        lambda: changed(
            isotonic,
            contraction=lambda c: np.minimum(c["contraction"], 0.13) + noise(4, len(TIME), 1e-4),
        ),
    ),
    "one sensor twice": (
        "one sensor twice",
        lambda: changed(joint, **{"right.pressure": lambda c: c["left.pressure"]}),
    ),
    "unit": (
        "unit",
        lambda: changed(
            regulator,
            pressure=lambda c: c["pressure"] / 1e3,
            setpoint=lambda c: c["setpoint"] / 1e3,
        ),
    ),
    "noise": (
        "noise",
        lambda: changed(isometric, force=lambda c: c["force"] + noise(9, len(TIME), 30.0)),
    ),
}
"""Faults: the rule that must name each, and the record."""


def recording(columns: Columns, origin: str = "record.csv") -> Recording:
    return Recording(columns, origin)
