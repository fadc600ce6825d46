"""Stages of a campaign: a stage without a result has the reason and the measurement that would give one."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class LeftOutStage:
    """A stage without a result: its name, the reason, and what to measure, as phrases."""

    name: str
    reason: str
    remedy: str

    @property
    def verdict(self) -> str:
        """The reason and what to measure, as sentences."""
        return f"Not identified: {self.reason.rstrip('.')}. To identify it, {self.remedy.rstrip('.')}."
