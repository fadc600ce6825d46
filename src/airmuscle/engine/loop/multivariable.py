"""MultivariableController (base): a controller of several columns by several inputs."""

from __future__ import annotations

from .controller import Controller


class MultivariableController(Controller):
    """A controller that leads the columns `controlled` to their set points, from the columns `measured`."""

    measured: tuple[str, ...]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.measured

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.controlled

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.commanded


def failure_notes(owner: str, program: str, failures: int) -> tuple[str, ...]:
    """The note of a predictive controller on the samples at which its program had no solution; none without them."""
    if not failures:
        return ()
    return (
        f"{owner}: the {program} had no solution at {failures} samples; the next input of the last plan was applied. "
        "Make the limits of columns soft (a finite slack_weight) or wider.",
    )
