"""Laboratories of the tests: measurement files of one muscle of known law, with the habits and
mistakes of benches.

The muscle is that of Tondu and Lopez (2000) with a linear elasticity of its rubber, Coulomb
friction, sensor noise and quantisation, written here independently of the package. A laboratory is
a set of tables; a variant changes what its files state, not the muscle.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

RESTING_LENGTH = 0.3
ATMOSPHERE = 101.325
Table = dict[str, np.ndarray]
"""Columns by heading, in the units of the headings."""
TIME = "time [s]"
PRESSURE = "pressure [kPa]"
LENGTH = "length [mm]"
FORCE = "force [N]"


@dataclasses.dataclass(frozen=True)
class Muscle:
    """True law of a laboratory: F = pi r0^2 p (a (1 - k eps)^2 - b) - elasticity eps + wall, not
    below 0; `wall` is the tension of a neo-Hookean tube that follows the braid.
    """

    radius: float = 0.011
    angle: float = np.radians(25.0)
    k: float = 1.15
    elasticity: float = 400.0
    friction: float = 8.0
    wall: float = 0.0
    """Shear modulus times the cross section of the wall [N]."""

    def wall_force(self, contraction: np.ndarray) -> np.ndarray:
        """The tension [N] of the wall, dU/dL of U = wall L0/2 (l1^2 + l2^2 + l3^2 - 3), where l1 is
        the axial stretch, l2 that around, of the braid, and l1 l2 l3 = 1; 0 at rest.
        """
        axial = 1.0 - contraction
        ratio = 1.0 / np.tan(self.angle) ** 2
        around = 1.0 + ratio * (1.0 - axial**2)  # l2^2
        slope = -2.0 * axial * ratio
        return (
            0.5
            * self.wall
            * (2.0 * axial + slope - 2.0 / (axial**3 * around) - slope / (axial * around) ** 2)
        )

    def force(self, pressure: np.ndarray, contraction: np.ndarray) -> np.ndarray:
        a = 3.0 / np.tan(self.angle) ** 2
        b = 1.0 / np.sin(self.angle) ** 2
        shape = a * (1.0 - self.k * contraction) ** 2 - b
        return np.maximum(
            np.pi * self.radius**2 * pressure * shape
            - self.elasticity * contraction
            + self.wall_force(contraction),
            0.0,
        )


MUSCLE = Muscle()
GREATEST = float(MUSCLE.force(np.array(6e5), np.array(0.0)))
"""Greatest force [N] of the muscle in the laboratories."""


def measured(
    time: np.ndarray,
    pressure: np.ndarray,
    contraction: np.ndarray,
    direction: np.ndarray,
    seed: int,
    muscle: Muscle = MUSCLE,
    noise: float = 1.0,
    step: float = 0.25,
    delay: float = 0.0,
) -> Table:
    """One file: force with friction against the motion, noise and quantisation; pressures in kPa,
    lengths in mm.
    """
    rng = np.random.default_rng(seed)
    force = muscle.force(pressure, contraction)
    force = np.where(force > 0.0, np.maximum(force + muscle.friction * direction, 0.0), 0.0)
    if delay:
        force = np.interp(time - delay, time, force)
    force = force + noise * rng.standard_normal(force.size)
    return {
        TIME: np.round(time, 4),
        PRESSURE: np.round(1e-3 * pressure + 0.2 * rng.standard_normal(force.size), 2),
        LENGTH: np.round(
            1e3 * RESTING_LENGTH * (1.0 - contraction) + 0.01 * rng.standard_normal(force.size), 3
        ),
        FORCE: step * np.round(force / step),
    }


def sweeps(
    muscle: Muscle = MUSCLE, count: int = 90, levels: int = 6, seed: int = 0
) -> dict[str, Table]:
    """Isobars from 100 to 600 kPa: the muscle is extended from its free contraction, then
    contracts.
    """
    tables = {}
    for i, pressure in enumerate(np.linspace(1e5, 6e5, levels)):
        half = np.linspace(0.0, 1.0, count)
        contraction = 0.24 * np.concatenate([half, half[-2::-1]])
        direction = -np.sign(np.gradient(contraction))
        time = 0.05 * np.arange(contraction.size)
        run = measured(time, np.full(time.size, pressure), contraction, direction, seed + i, muscle)
        tables[f"isobar_{pressure / 1e3:.0f}"] = run
    return tables


def ramps(
    muscle: Muscle = MUSCLE,
    duration: float = 10.0,
    sample_time: float = 0.05,
    delay: float = 0.0,
    seed: int = 20,
    noise: float = 1.0,
) -> dict[str, Table]:
    """Isometric ramps from 0 to 600 kPa and back at seven contractions."""
    tables = {}
    for i, contraction in enumerate((0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24)):
        time = sample_time * np.arange(round(2.0 * duration / sample_time) + 1)
        pressure = 6e5 * (1.0 - np.abs(1.0 - time / duration))
        direction = -np.where(time < duration, 1.0, -1.0)
        held = np.full(time.size, contraction)
        run = measured(time, pressure, held, direction, seed + i, muscle, noise=noise, delay=delay)
        tables[f"held_{100 * contraction:.0f}"] = run
    return tables


def by_hand(seed: int = 50) -> dict[str, Table]:
    """Points without time at five pressures and five lengths."""
    pressure, contraction = (
        g.ravel() for g in np.meshgrid(np.linspace(1e5, 6e5, 5), np.linspace(0.0, 0.2, 5))
    )
    table = measured(np.arange(25.0), pressure, contraction, np.zeros(25), seed)
    return {"points": {name: table[name] for name in (PRESSURE, LENGTH, FORCE)}}


def changed(
    tables: dict[str, Table], column: str, change: Callable[[np.ndarray], np.ndarray]
) -> dict[str, Table]:
    """The tables with one column changed in all files."""
    return {name: {**table, column: change(table[column])} for name, table in tables.items()}


def filtered(tables: dict[str, Table], column: str, time_constant: float) -> dict[str, Table]:
    """The tables with a low-pass filter of first order in one column, in equilibrium at first."""

    def response(time: np.ndarray, values: np.ndarray) -> np.ndarray:
        result = values.copy()
        for i, share in enumerate(np.exp(-np.diff(time) / time_constant), 1):
            result[i] = share * result[i - 1] + (1.0 - share) * values[i]
        return result

    return {
        name: {**table, column: response(table[TIME], table[column])}
        for name, table in tables.items()
    }


def every_other(tables: dict[str, Table], column: str, offset: float) -> dict[str, Table]:
    """The tables with an offset of one column in every other file."""
    return {
        name: {**table, column: table[column] + (offset if i % 2 else 0.0)}
        for i, (name, table) in enumerate(tables.items())
    }


def renamed(
    tables: dict[str, Table], headings: dict[str, str], factors: dict[str, float]
) -> dict[str, Table]:
    """The tables with other headings, their values multiplied by factors."""
    return {
        name: {headings.get(h, h): v * factors.get(h, 1.0) for h, v in table.items()}
        for name, table in tables.items()
    }


def one_file(
    *benches: dict[str, Table], column: str = "", values: tuple[object, ...] = ()
) -> dict[str, Table]:
    """All tables of several benches below each other in one file without time, with a column that
    tells them apart.
    """
    parts = [list(bench.values()) for bench in benches]
    table = {
        name: np.concatenate([t[name] for part in parts for t in part])
        for name in (PRESSURE, LENGTH, FORCE)
    }
    if column:
        rows = [sum(t[FORCE].size for t in part) for part in parts]
        table = {column: np.repeat(np.array(values, dtype=object), rows), **table}
    return {"both": table}


def with_glitches(
    tables: dict[str, Table], share: float, size: tuple[float, float], seed: int = 70
) -> dict[str, Table]:
    """The tables with outliers of the force in a share of the rows."""
    rng = np.random.default_rng(seed)
    result = {}
    for name, table in tables.items():
        force = table[FORCE].copy()
        rows = rng.choice(force.size, max(round(share * force.size), 1), replace=False)
        force[rows] += rng.choice([-1.0, 1.0], rows.size) * rng.uniform(*size, rows.size)
        result[name] = {**table, FORCE: force}
    return result


def with_code(
    tables: dict[str, Table], column: str, code: float, every: int = 15
) -> dict[str, Table]:
    """The tables with a code for a missing value in every n-th row of a column."""
    return changed(tables, column, lambda v: np.where(np.arange(v.size) % every == 7, code, v))


def write(tables: dict[str, Table], folder: Path, above: tuple[str, ...] = ()) -> list[Path]:
    """Write the tables as CSV files, with lines above the headings."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, table in tables.items():
        rows = zip(*(values.tolist() for values in table.values()), strict=True)
        lines = [
            *above,
            ",".join(table),
            *(",".join("" if v is None else f"{v}" for v in row) for row in rows),
        ]
        paths.append(folder / f"{name}.csv")
        paths[-1].write_text("\n".join(lines) + "\n", encoding="utf-8")
    return paths
