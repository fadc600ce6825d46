"""Made bench campaign: the files of a rig, computed from a muscle that differs in kind from every
law of the library.

Static force: a cosine of the contraction of the active length, a threshold of the pressure of the
bladder, an exponential tube and an exponential overshoot at rest. Friction: a power-law transition
to an amplitude that depends on the direction, on a power of the pressure and on the logarithm of
the speed. Relaxation: a stretched exponential. Valve: an orifice with Perry's discharge
coefficient; the air exchanges heat with the wall.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

BAR = 1e5
AMBIENT = 101_325.0
ROOM = 293.15
GAS_CONSTANT = 287.05
KAPPA = 1.4
PRESSURE_NOISE = 400.0
LENGTH_NOISE = 2e-5
FORCE_NOISE = 4.0
"""Standard deviations of the sensors [Pa], [m], [N]."""


@dataclasses.dataclass(frozen=True)
class TrueMuscle:
    """A muscle of resting length L0 [m]; the ends of 25 mm together do not contract."""

    resting_length: float
    area: float = 2.45e-3
    ends: float = 0.025
    radius: float = 0.0105

    def active(self, contraction: np.ndarray) -> np.ndarray:
        return np.asarray(contraction) * self.resting_length / (self.resting_length - self.ends)

    def force(self, pressure: np.ndarray, contraction: np.ndarray) -> np.ndarray:
        """Static force [N]; negative values are those of a slack muscle."""
        x = self.active(contraction)
        p = np.asarray(pressure)
        threshold = 0.18 * BAR
        effective = p - threshold * (1.0 - np.exp(-np.maximum(p, 0.0) / threshold))
        overshoot = 110.0 * np.tanh(np.maximum(p, 0.0) / (0.5 * BAR)) * np.exp(-x / 0.06)
        return (
            effective * self.area * np.cos(np.pi * x / 0.60) - 16.0 * np.expm1(x / 0.11) + overshoot
        )

    def volume(self, contraction: float) -> float:
        """Enclosed volume [m3], whose derivative is the area of the pressure in the force."""
        length = self.resting_length - self.ends
        x = contraction * self.resting_length / length
        return math.pi * self.radius**2 * length + self.area * length * 0.60 / math.pi * math.sin(
            math.pi * x / 0.60
        )

    def friction(
        self, time: np.ndarray, pressure: np.ndarray, displacement: np.ndarray
    ) -> np.ndarray:
        """Friction force against contraction [N] along a path of the displacement [m] from a
        relaxed start.
        """
        z = 0.0
        force = np.zeros(time.size)
        for i in range(1, time.size):
            step = displacement[i] - displacement[i - 1]
            speed = abs(step) / (time[i] - time[i - 1])
            sign = math.copysign(1.0, step) if step else 0.0
            z += step / 6e-4 * max(1.0 - sign * z, 0.0) ** 1.5
            z = min(max(z, -1.0), 1.0)
            amplitude = 6.0 + 5.0 * (max(pressure[i], 0.0) / BAR) ** 0.93
            force[i] = amplitude * (1.0 + 0.04 * math.log1p(speed / 1e-3)) * (z + 0.05 * z * z)
        return force

    def relaxation(self, time: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Force against contraction [N] that relaxes after a motion as exp(-(t/20 s)^0.6)."""
        steps = np.diff(displacement, prepend=displacement[:1])
        moved = np.flatnonzero(steps)
        force = np.zeros(time.size)
        for i in moved:
            later = time[i:] - time[i]
            force[i:] += 900.0 * steps[i] * np.exp(-((later / 20.0) ** 0.6))
        return force

    def measured(
        self,
        time: np.ndarray,
        pressure: np.ndarray,
        contraction: np.ndarray,
        random: np.random.Generator,
    ) -> dict[str, np.ndarray]:
        """The columns of a record with the noise of the sensors [SI]."""
        displacement = contraction * self.resting_length
        force = self.force(pressure, contraction) - self.friction(time, pressure, displacement)
        force = np.maximum(force - self.relaxation(time, displacement), 0.0)
        return {
            "time": time,
            "pressure": pressure + random.normal(0.0, PRESSURE_NOISE, time.size),
            "length": (
                self.resting_length - displacement + random.normal(0.0, LENGTH_NOISE, time.size)
            ),
            "force": force + random.normal(0.0, FORCE_NOISE, time.size) * (force > 0.0),
        }

    def free_contraction(self, pressure: float) -> float:
        """Contraction [1] at zero force."""
        grid = np.linspace(0.0, 0.29, 2001)
        return float(grid[np.argmin(np.abs(self.force(np.full(grid.size, pressure), grid)))])

    def isobaric(
        self, bar: float, random: np.random.Generator, speed: float = 2e-3, rows: int = 700
    ) -> dict:
        """A triangle of the length at constant pressure, at a speed [m/s]."""
        pressure = bar * BAR
        end = 0.88 * self.free_contraction(pressure)
        contraction = np.interp(np.linspace(0.0, 2.0, rows), [0.0, 1.0, 2.0], [0.0, end, 0.0])
        time = np.linspace(0.0, 2.0 * end * self.resting_length / speed, rows)
        ripple = 600.0 * np.sin(2.0 * np.pi * time / 7.0)
        return self.measured(time, pressure + ripple, contraction, random)

    def isometric(
        self, contraction: float, random: np.random.Generator, duration: float = 80.0
    ) -> dict:
        """A triangle of the pressure from 0.3 to 6 bar at constant length."""
        time = np.linspace(0.0, duration, 600)
        pressure = np.interp(time, [0.0, duration / 2, duration], [0.3 * BAR, 6.0 * BAR, 0.3 * BAR])
        return self.measured(time, pressure, np.full(time.size, contraction), random)

    def hold(self, bar: float, contraction: float, random: np.random.Generator) -> dict:
        """A motion to a length within 0.4 s, which is then held for two minutes at constant
        pressure.
        """
        time = np.linspace(0.0, 120.0, 1200)
        path = contraction * np.clip((time - 2.0) / 0.4, 0.0, 1.0)
        return self.measured(time, np.full(time.size, bar * BAR), path, random)

    def fill(
        self,
        contraction: float,
        random: np.random.Generator,
        supply: float = 6.2,
        tau: float = 0.15,
    ) -> dict:
        """A fill at constant length from 0 bar through an orifice of 1.6 mm, and the discharge
        after 2.5 s.
        """
        time = np.arange(0.0, 5.0, 0.004)
        volume = self.volume(contraction)
        area = 0.25 * math.pi * 1.6e-3**2
        mass = AMBIENT * volume / GAS_CONSTANT / ROOM
        pressure = np.empty(time.size)
        temperature = ROOM
        fine = 8
        for i in range(time.size):
            pressure[i] = mass * GAS_CONSTANT * temperature / volume
            for _ in range(fine):
                step = 0.004 / fine
                now = mass * GAS_CONSTANT * temperature / volume
                flow = 0.0
                if 0.20 <= time[i] < 2.4:
                    flow = orifice_flow(supply * BAR + AMBIENT, now, ROOM, area)
                elif time[i] >= 2.5:
                    flow = -orifice_flow(now, AMBIENT, temperature, area)
                inflow_temperature = ROOM if flow > 0 else temperature
                heat = mass * GAS_CONSTANT / (KAPPA - 1) * (ROOM - temperature) / tau
                energy = mass * temperature * GAS_CONSTANT / (KAPPA - 1)
                energy += step * (
                    flow * inflow_temperature * GAS_CONSTANT * KAPPA / (KAPPA - 1) + heat
                )
                mass += step * flow
                temperature = energy * (KAPPA - 1) / (mass * GAS_CONSTANT)
        return self.measured(time, pressure - AMBIENT, np.full(time.size, contraction), random)

    def release(self, bar: float, mass: float, random: np.random.Generator) -> dict:
        """A mass that is held at rest length by a latch and released after 0.1 s, at a closed
        volume.
        """
        step = 1e-4
        time = np.arange(0.0, 1.5, 0.002)
        content = (bar * BAR + AMBIENT) * self.volume(0.0) ** 1.2
        y = 0.0
        v = 0.0
        columns = []
        for t in time:
            pressure = content / self.volume(y / self.resting_length) ** 1.2 - AMBIENT
            columns.append((pressure, y))
            for _ in range(round(0.002 / step)):
                if t < 0.1:
                    continue
                contraction = y / self.resting_length
                pressure = content / self.volume(contraction) ** 1.2 - AMBIENT
                tension = float(self.force(pressure, contraction)) - 160.0 * v
                tension -= (6.0 + 5.0 * pressure / BAR) * math.tanh(v / 2e-3)
                v += step * (max(tension, 0.0) / mass - 9.80665)
                y += step * v
        pressure, path = np.array(columns).T
        return self.measured(time, pressure, path / self.resting_length, random)


def orifice_flow(high: float, low: float, temperature: float, area: float) -> float:
    """Mass flow [kg/s] of an orifice with the discharge coefficient of Perry (1949) [Pa, K, m2]."""
    ratio = min(max(low / high, 0.0), 1.0)
    coefficient = (
        0.8414
        - 0.1002 * ratio
        + 0.8415 * ratio**2
        - 3.9 * ratio**3
        + 4.6001 * ratio**4
        - 1.6827 * ratio**5
    )
    critical = (2 / (KAPPA + 1)) ** (KAPPA / (KAPPA - 1))
    r = max(ratio, critical)
    factor = math.sqrt(
        max(2 * KAPPA / (KAPPA - 1) * (r ** (2 / KAPPA) - r ** ((KAPPA + 1) / KAPPA)), 0.0)
    )
    return coefficient * area * high * factor / math.sqrt(GAS_CONSTANT * temperature)


def write_german(path: Path, columns: dict[str, np.ndarray], resting_length: float) -> None:
    """A file as a German logger writes it: bar, mm and N, semicolons and decimal commas."""
    lines = [
        f"# Ruhelänge [mm] = {1e3 * resting_length:g}",
        "Zeit [s];Druck [bar];Länge [mm];Kraft [N]",
    ]
    scaled = (columns["time"], columns["pressure"] / BAR, 1e3 * columns["length"], columns["force"])
    for row in zip(*scaled, strict=True):
        lines.append(";".join(f"{value:.4f}" for value in row).replace(".", ","))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


PRESSURES = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
THREE_LENGTHS = (0.2, 0.3, 0.4)


def write_campaign(folder: Path, lengths: Sequence[float] = (0.3,), seed: int = 1) -> Path:
    """Write the files of a campaign: sweeps of every length; fills, holds and a release of the
    middle one.
    """
    random = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    for length in lengths:
        muscle = TrueMuscle(length)
        name = f"{1e3 * length:.0f}"
        for bar in PRESSURES:
            speed = 2e-3 if bar % 2 else 5e-3
            write_german(
                folder / f"m{name}_isobar_{bar:g}bar.csv",
                muscle.isobaric(bar, random, speed),
                length,
            )
        for contraction in (0.02, 0.10):
            columns = muscle.isometric(contraction, random)
            write_german(folder / f"m{name}_isometrisch_{100 * contraction:g}.csv", columns, length)
    length = sorted(lengths)[len(lengths) // 2]
    muscle = TrueMuscle(length)
    name = f"{1e3 * length:.0f}"
    for contraction in (0.0, 0.08, 0.15):
        write_german(
            folder / f"m{name}_fuellen_{100 * contraction:g}.csv",
            muscle.fill(contraction, random),
            length,
        )
    for bar in (2.0, 5.0):
        write_german(
            folder / f"m{name}_halten_{bar:g}bar.csv", muscle.hold(bar, 0.06, random), length
        )
    write_german(folder / f"m{name}_freigabe.csv", muscle.release(2.0, 30.0, random), length)
    return folder


def unseen_records(
    lengths: Sequence[float], seed: int = 9
) -> dict[str, tuple[dict[str, np.ndarray], float]]:
    """Records that no fit has seen, with their resting length: another pressure, length and
    speed.
    """
    random = np.random.default_rng(seed)
    middle = sorted(lengths)[len(lengths) // 2]
    records = {
        f"pressure {bar:g} bar": (TrueMuscle(middle).isobaric(bar, random), middle)
        for bar in (2.5, 3.5, 4.5)
    }
    records |= {
        f"speed {v:g} m/s": (TrueMuscle(middle).isobaric(3.0, random, v), middle)
        for v in (3e-3, 4e-3)
    }
    if len(lengths) > 1:
        between = 0.5 * (sorted(lengths)[0] + middle), 0.5 * (sorted(lengths)[-1] + middle)
        records |= {
            f"length {1e3 * x:g} mm, {bar:g} bar": (TrueMuscle(x).isobaric(bar, random), x)
            for x in between
            for bar in (2.0, 4.0)
        }
    return records
