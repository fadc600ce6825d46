"""Status: how a kernel, a root search or a run ended."""

from __future__ import annotations

import enum


class Status(enum.IntEnum):
    """How a computation ended; `message` is the reason in words. `simulate` never returns PAUSED or NOT_STARTED."""

    DONE = 0
    PAUSED = 1
    STEP_TOO_SMALL = 2
    NOT_FINITE = 3
    TOO_MANY_STEPS = 4
    INTERRUPTED = 5
    NOT_STARTED = 6
    NEGATIVE_AIR_MASS = 7
    NON_FINITE_COMMAND = 8
    NON_POSITIVE_VOLUME = 9
    SINGULAR = 10
    NOT_CONVERGED = 11

    @property
    def message(self) -> str:
        """The reason, as the end of a sentence that begins with "because"."""
        return _MESSAGES[self]


_MESSAGES = {
    Status.DONE: "it is complete",
    Status.PAUSED: "it was paused",
    Status.STEP_TOO_SMALL: "the step became too small",
    Status.NOT_FINITE: "a rate or an output is not finite",
    Status.TOO_MANY_STEPS: "it took more steps than allowed",
    Status.INTERRUPTED: "it was interrupted",
    Status.NOT_STARTED: "no initial state was given",
    Status.NEGATIVE_AIR_MASS: "an air mass became negative",
    Status.NON_FINITE_COMMAND: "the controller gave a command that is not finite",
    Status.NON_POSITIVE_VOLUME: "a muscle volume became zero or negative",
    Status.SINGULAR: "the Jacobian is singular",
    Status.NOT_CONVERGED: "Newton's method did not converge",
}
