"""Scatter of the force of recordings, and the misfit of a law that it does not explain."""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from ...recording import Recording
from ...report.chapter import NamedValue
from ..inspection import estimate_noise
from .misfit import LawMisfit

MAX_MISFIT = 3.0
MIN_MISFIT = 0.002
"""Residual above which the law does not follow the data: ratio to their scatter, and to the maximum
force, below which it is within the accuracy of load cells (chosen).
"""
MARGIN = 1.645
"""Standard errors of the rms error by which it must exceed this ratio: 5 % of the laws that reach
it exactly exceed it by chance.
"""
MIN_UNREPEATABLE = 0.005
"""Residual above which a difference of repeated runs is named that exceeds the noise by the first
ratio, as a fraction of the maximum force (chosen)."""


@dataclasses.dataclass(frozen=True)
class Scatter:
    """Standard deviations of the force: of noise, and of runs at equal pressure, contraction and
    direction [N]; None where the data do not show them. `branches` is the distance of the branches
    that the residuals follow [N].
    """

    noise: float | None
    repeatability: float | None
    branches: float = 0.0

    def values(self) -> Iterator[NamedValue]:
        """What is known of the scatter, for a report."""
        if self.noise is not None:
            yield NamedValue("noise of the data", self.noise, "N", digits=3)
        if self.repeatability is not None:
            yield NamedValue(
                "difference of repeated runs",
                float(np.sqrt(2.0)) * self.repeatability,
                "N",
                digits=3,
            )
        if self.branches:
            yield NamedValue("distance of the branches", self.branches, "N", digits=3)

    def misfit(self, rmse: float, rows: int, greatest: float, lengths: int = 1) -> LawMisfit | None:
        """The misfit of a law whose residual [N] is greater than the scatter explains, without its
        causes; None of a law that follows the data, or where their scatter is not known. A static
        law follows the middle of two branches.

        rmse      rms error of the law [N], which `rows` of the data determine
        greatest  maximum force of the data [N]
        lengths   number of resting lengths that a law without an effect of the length is fitted to
        """
        # a scatter of zero is that of equal files
        known = [each for each in (self.noise, self.repeatability) if each]
        noise = known[0] if known else 0.0
        within = max(noise, 0.5 * self.branches)
        expected = max([*known, within])
        parts = ", ".join(f"{each.name} {each.value:.3g} N" for each in self.values())
        least = rmse * (1.0 - MARGIN / np.sqrt(2.0 * max(rows, 2)))
        if not known or least <= MAX_MISFIT * within or rmse <= MIN_MISFIT * greatest:
            return None
        if least > MAX_MISFIT * expected:
            return LawMisfit(
                f"The rms error, {rmse:.3g} N, is {rmse / expected:.3g} times the scatter of the"
                f" data ({parts}): the law does not follow them. "
                + (f"It is one law for {lengths} resting lengths. " if lengths > 1 else "")
                + "Compare other laws, and check the remarks on contradicting or suspicious data.",
                rmse / expected,
            )
        if rmse <= MIN_UNREPEATABLE * greatest:
            return None
        return LawMisfit(
            f"The rms error, {rmse:.3g} N, is {rmse / within:.3g} times the scatter within a run"
            f" ({parts}), although repeated runs differ by a similar amount.",
            rmse / expected,
        )


def force_noise(recordings: Sequence[Recording]) -> float | None:
    """The noise of the force [N]; None where it is not known, as of rows in no order of time."""
    timed = [run["force"] for run in recordings if "time" in run and "force" in run]
    noise = [estimate_noise(force[np.isfinite(force)]) for force in timed]
    return float(np.median(noise)) or None if noise else None
