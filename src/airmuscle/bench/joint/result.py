"""ArmFit: an arm identified from episodes, with its free-run errors beside the baselines, and its plant."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from ...core.arrays import Array
from ...core.short_repr import ShortRepr
from ...physics import Plant, PressureDriven, ProportionalRegulator, SecondOrderLag, Supply, Valve
from .episode_inspection import EpisodeInspection
from .free_run import coverage, rms
from .separation import ArmParameter

SUPPLY = 6e5
"""Gauge pressure [Pa] of the supply of the plant (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ArmFit(ShortRepr):
    """An arm identified from the first episodes and judged on the last ones; `print` it.

    arm          the arm along measured pressures, with the identified parameters
    inspection   of all episodes
    pairs        muscles, from 1, that raise and lower each angle; muscle 2j and 2j + 1 of `arm` are the pair of joint j
    errors       (N, rows, J) [rad] of the free run on the episodes left out; `episode` (N,) their numbers
    by_baseline  errors of the same windows by the name of the baseline
    band         (rows, J) half-width of the band of the free run that holds 95 % of these errors [rad]
    estimates    parameters with their standard errors
    remarks      what the record does not separate, and what the fit left out
    """

    arm: PressureDriven
    inspection: EpisodeInspection
    pairs: tuple[tuple[int, int], ...]
    errors: Array
    episode: Array
    by_baseline: Mapping[str, Array]
    band: Array
    estimates: tuple[ArmParameter, ...]
    remarks: tuple[str, ...]

    @property
    def rms(self) -> Array:
        """Root mean square error (J,) [rad] of the free run on the episodes left out."""
        return rms(self.errors)

    @property
    def best_baseline(self) -> tuple[str, ...]:
        """Name of the baseline with the smallest error, by joint."""
        names = list(self.by_baseline)
        levels = np.array([rms(errors) for errors in self.by_baseline.values()])
        return tuple(names[i] for i in np.argmin(levels, axis=0))

    @property
    def skill(self) -> Array:
        """1 - error/error of the best baseline (J,): 1 for a perfect prediction, 0 for none beyond the baseline."""
        best = np.min([rms(errors) for errors in self.by_baseline.values()], axis=0)
        return np.asarray(1.0 - self.rms / best)

    @property
    def coverage(self) -> Array:
        """Share (J,) of errors on one half of the episodes left out inside a band from the other half."""
        return coverage(self.errors, self.episode)

    @property
    def horizon(self) -> Array:
        """Times [s] after the start of a window at which `band` and the errors stand."""
        return np.asarray(self.inspection.episodes.sample_time * np.arange(1, self.errors.shape[1] + 1))

    def plant(self) -> Plant:
        """The arm with a proportional regulator for each muscle, whose time constant is the lag of its pressure.

        Supply, orifices and volumes of the muscles are chosen: the record does not contain them.
        """
        valve = Valve(3e-8, 0.3)
        regulators = tuple(
            ProportionalRegulator(Supply(SUPPLY), valve, valve, SecondOrderLag(1 / (2 * np.pi * lag), 1.0), 2e4, SUPPLY)
            for lag in self.arm.lags
        )
        return Plant(self.arm.muscle, regulators, self.arm.mechanism)

    def table(self) -> list[tuple[str, list[float]]]:
        """Errors of the free run [deg] by joint, of the baselines and of the model, the skill, and the band's end."""
        rows = [(name, np.degrees(rms(errors)).tolist()) for name, errors in self.by_baseline.items()]
        rows += [("model", np.degrees(self.rms).tolist()), ("skill", self.skill.tolist())]
        rows += [("band at the horizon, +- deg", np.degrees(self.band[-1]).tolist())]
        return [*rows, ("share inside the band, %", (100 * self.coverage).tolist())]

    def __str__(self) -> str:
        joints = range(1, self.errors.shape[2] + 1)
        count, end = len(np.unique(self.episode)), self.horizon[-1]
        head = f"free run over {end:.3g} s on {count} episodes left out, {len(self.errors)} windows; rms [deg]"
        width = max(len(name) for name, _ in self.table()) + 2
        lines = [head, " " * width + "".join(f"{f'joint {j}':>10}" for j in joints)]
        lines += [f"{name:<{width}}" + "".join(f"{v:>10.3g}" for v in values) for name, values in self.table()]
        muscles = [f"joint {j}: {a} raises, {b} lowers" for j, (a, b) in enumerate(self.pairs, start=1)]
        return "\n".join([*lines, "muscles: " + "; ".join(muscles), *(f"remark: {each}" for each in self.remarks)])
