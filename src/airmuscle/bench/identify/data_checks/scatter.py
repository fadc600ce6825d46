"""Scatter of the data of a fit: noise of the force sensor and repeatability, with which its residuals are compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....recording import Recording
from ...segment.sensor import estimate_noise

MAX_RATIO = 3.0
"""Ratio of the residual to the scatter of the data above which the law does not follow them (chosen)."""
MIN_MISFIT = 0.02
"""Minimum residual that is reported, as a fraction of the maximum force (chosen)."""


@dataclasses.dataclass(frozen=True)
class Scatter:
    """Standard deviations of the force: of noise, and of runs at equal pressure, contraction and direction [N]; None
    where the data do not show them. `branches` is the distance of the branches that the residuals follow [N]."""

    noise: float | None
    repeatability: float | None
    branches: float = 0.0

    @classmethod
    def of(cls, recordings: Sequence[Recording], repeatability: float | None) -> Scatter:
        """The scatter of recordings; the noise only where the rows are in order of time."""
        timed = [run["force"] for run in recordings if "time" in run and "force" in run]
        noise = [estimate_noise(force[np.isfinite(force)]) for force in timed]
        return cls(float(np.median(noise)) if noise and np.median(noise) > 0 else None, repeatability)

    def __str__(self) -> str:
        """Both as text; empty if neither is known."""
        parts = [] if self.noise is None else [f"noise {self.noise:.3g} N"]
        if self.repeatability is not None:
            parts.append(f"repeated runs differ by {np.sqrt(2.0) * self.repeatability:.3g} N")
        if self.branches:
            parts.append(f"branches {self.branches:.3g} N apart")
        return ", ".join(parts)

    def misfit_notes(self, rmse: float, greatest: float, lengths: int = 1) -> list[str]:
        """The remark that a residual [N] is greater than the scatter explains.

        A static law follows the middle of two branches. `greatest` is the maximum force of the data [N], `lengths` the
        number of resting lengths that a law without an effect of the length is fitted to.
        """
        known = [each for each in (self.noise, self.repeatability) if each is not None]
        expected = max([*known, 0.5 * self.branches], default=0.0)
        if not known or rmse <= MAX_RATIO * expected or rmse <= MIN_MISFIT * greatest:
            return []
        return [
            f"The rms error, {rmse:.3g} N, is {rmse / expected:.2g} times the scatter of the data ({self}): the "
            "law does not follow them. "
            + (f"It is one law for {lengths} resting lengths. " if lengths > 1 else "")
            + "Compare other laws, and check the remarks on contradicting or suspicious data."
        ]


@dataclasses.dataclass(frozen=True)
class Remarks:
    """Notes on a fit and its data, as sentences, and the scatter of the data."""

    notes: tuple[str, ...]
    scatter: Scatter | None
