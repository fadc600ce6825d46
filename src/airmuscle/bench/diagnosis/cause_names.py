"""Names of the causes of a misfit, what is done about them, and a cause with its share."""

from collections.abc import Sequence
from typing import NamedTuple

FORM = "the form of the law"
FRICTION = "friction, which follows the direction of the motion"
DELAY = "a delay of a sensor"
FILTER = "a low-pass filter of a sensor"
AVERAGE = "a moving average of a sensor or logger"
CREEP = "creep of the muscle, or another slow drift"
MUSCLES = "two muscles, or gains, in two groups of runs"
TEMPERATURE = "another temperature of the wall in a group of runs"
ZEROS = "another zero of a sensor in a group of runs"
RUNS = "offsets and gains of single runs (another muscle, a temperature, a zero)"
STEPS = "the steps of the {} readings"
REMEDIES = {
    MUSCLES: "No law follows such runs: check whether the muscle or a sensor was exchanged.",
    TEMPERATURE: "No law follows such runs: measure at one temperature, after some warming cycles.",
    ZEROS: "No law follows such runs: check the zeros of the sensors before each run.",
    RUNS: (
        "No law follows such runs: check whether the muscle, its temperature or a zero has changed"
        " between them."
    ),
    DELAY: "Do not take it for friction: shift the later signal, or ramp more slowly.",
    FILTER: "Do not take it for friction: turn the filter off, or ramp more slowly.",
    AVERAGE: "Do not take it for friction: record without averaging, or ramp more slowly.",
    CREEP: (
        "Do not take it for friction: hold each level for the same time before it is read, or fit"
        " the creep of a hold."
    ),
}
"""What is done about a cause that comes first."""
TOLD_APART = "A run at another speed, or a hold, tells these two apart."
"""What is done where another cause explains the same."""


class MisfitCause(NamedTuple):
    """A cause and its share of the squared residuals, from 0 to 1."""

    name: str
    share: float
    detail: str = ""
    """Its time, and which signal is later; empty where it has none."""
    rival: str = ""
    """A cause that explains the same as well; empty where the data tell them apart."""

    def __str__(self) -> str:
        rival = f"not told from {self.rival}" if self.rival else ""
        remarks = "; ".join(filter(None, (self.detail, rival)))
        return f"{100 * self.share:.0f} % by {self.name}" + (f" ({remarks})" if remarks else "")


def causes_text(causes: Sequence[MisfitCause]) -> str:
    """The causes as a sentence; that none is known without any."""
    if not causes:
        return "No form of the law, motion, sensor, run or step of the readings explains it."
    first = causes[0]
    remedy = TOLD_APART if first.rival else REMEDIES.get(first.name, "")
    explained = ", ".join(map(str, causes))
    return f"Of the squared residuals are explained: {explained}. {remedy}".rstrip()
