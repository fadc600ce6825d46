"""IdentifiedArm: an arm identified from episodes, with what the prediction of later ones needs."""

import dataclasses

import numpy as np

from ...core import Array, ShortRepr
from ...physics import PressureDriven
from .episode_mapping import EpisodeMapping
from .episodes import Episodes, in_order
from .free_run import RegulatorLag
from .result import ArmFit

ENDS = (0.01, 0.99)
"""Quantiles of the fitted rows that are the ends of a range (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class IdentifiedArm(ShortRepr):
    """An arm of J joints and M muscles that predicts later episodes of its record.

    arm           the arm along measured pressures
    columns       (M,) numbers, from 1, of the pressures of the record that its muscles have
    pairs         for each joint the columns of the muscles that raise and lower its angle
    gains, zeros  (M,) of the readings of its muscles, p = gain (reading - zero) [1, Pa]
    sample_time   of the record [s]; delay of its pressures [rows]
    angles        (J, 2) [rad] ends of the ranges of the fitted angles, 1 and 99 % quantiles
    pressures     (M, 2) [Pa] those of the fitted pressures, by the columns of the record
    deviation     (J,) [rad] rms error of the free run on the episodes that judged the fit
    band          (rows, J) [rad] half-width that held 95 % of these errors
    judged        number of these episodes
    regulators    (M,) between command and pressure, or empty
    mapping       how the record was read, or None
    """

    arm: PressureDriven
    columns: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]
    gains: tuple[float, ...]
    zeros: tuple[float, ...]
    sample_time: float
    delay: int
    angles: Array
    pressures: Array
    deviation: Array
    band: Array
    judged: int
    regulators: tuple[RegulatorLag, ...] = ()
    mapping: EpisodeMapping | None = None

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.arm.mechanism.coordinates)

    def acting(self, episodes: Episodes) -> Episodes:
        """Episodes with the pressures that act in the muscles of the arm, in their order."""
        ordered = in_order(episodes, self.columns)
        zeros = np.array(self.zeros)
        gains = np.array(self.gains)
        runs = [
            dataclasses.replace(run, pressure=gains * (run.pressure - zeros))
            for run in ordered.runs
        ]
        return dataclasses.replace(ordered, runs=tuple(runs))


def identified_arm(fit: ArmFit, mapping: EpisodeMapping | None = None) -> IdentifiedArm:
    """The arm of a fit; `mapping` is how its record was read."""
    fitted = fit.inspection.episodes
    angles, pressures = (
        np.quantile(fitted.rows(name), ENDS, axis=0).T for name in ("angle", "pressure")
    )
    return IdentifiedArm(
        fit.arm,
        fit.columns,
        fit.pairs,
        fit.gains,
        fit.zeros,
        fitted.sample_time,
        fit.inspection.delay,
        angles,
        pressures,
        fit.rms,
        fit.band,
        len(np.unique(fit.episode)),
        fit.regulators,
        mapping,
    )
