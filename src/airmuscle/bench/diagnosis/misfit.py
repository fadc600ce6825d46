"""Misfit: the verdict that a law does not follow the data, with the causes, which every result that
rests on the law states first.
"""

import dataclasses

import numpy as np

from .cause_names import MisfitCause, causes_text

MAX_ACCEPTED = 10.0
"""Ratio of the rms error to the scatter of the data above which a muscle is written only where the
misfit is accepted (chosen: static laws of muscles with friction reach 3.5)."""


@dataclasses.dataclass(frozen=True)
class LawMisfit:
    """A law that does not follow the data."""

    verdict: str
    """Sentences with the rms error and the scatter of the data."""
    ratio: float
    """Rms error over the scatter of the data."""
    causes: tuple[MisfitCause, ...] = ()
    """What explains the residuals, the greatest share first."""

    def __str__(self) -> str:
        return f"{self.verdict} {causes_text(self.causes)}"

    @property
    def must_be_accepted(self) -> bool:
        """Whether it is so great that a muscle is written only where it is accepted."""
        return bool(np.round(self.ratio, 6) > MAX_ACCEPTED)

    @property
    def warning(self) -> str:
        """What a file with the law states of it, as sentences."""
        return f"the law does not follow the data of its fit. {self}"

    @property
    def refusal(self) -> str:
        """Why the muscle is not written; empty where the misfit is tolerable."""
        if not self.must_be_accepted:
            return ""
        return (
            f"the muscle is not written: its rms error is {self.ratio:.3g} times the scatter of the"
            f" data, above {MAX_ACCEPTED:g} times. Remove the cause, or give --accept-misfit; the"
            " file then states the misfit."
        )


def misfit_warning(misfit: LawMisfit | None) -> str:
    """What a file with a law states of its misfit; empty of a law that follows the data."""
    return "" if misfit is None else misfit.warning
