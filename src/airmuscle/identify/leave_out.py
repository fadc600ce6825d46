"""What a cross-validation leaves out at once: a whole run, level or specimen, never random rows.

Neighbouring rows of one run repeat each other. A law that was fitted to some of them meets the others, and
learns nothing of the next run from that.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..errors import IdentificationError
from ..recording import Recording

Labels = npt.NDArray[np.str_]
MOST = 12
"""Most parts that are made; more are put together, neighbours first (chosen: each costs a fit a law)."""


class LeaveOut(abc.ABC):
    """How the rows of recordings fall into parts, each of which is left out in turn."""

    word: str

    @abc.abstractmethod
    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        """The name of the part that each row belongs to, one array a recording."""


@dataclasses.dataclass(frozen=True)
class Runs(LeaveOut):
    """Each recording is a part."""

    word: str = "run"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        names = [run.origin for run in recordings]
        unique = [name if names.count(name) == 1 else f"{name} ({i + 1})" for i, name in enumerate(names)]
        return [np.full(len(run), name) for run, name in zip(recordings, unique, strict=True)]


@dataclasses.dataclass(frozen=True)
class Specimens(LeaveOut):
    """Each muscle is a part, told by the constant `specimen`, or else by its resting length."""

    word: str = "specimen"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        return [np.full(len(run), self._name(run)) for run in recordings]

    def _name(self, run: Recording) -> str:
        if "specimen" in run.constants:
            return str(run.constants["specimen"])
        length = run.constants.get("resting_length")
        return run.origin if length is None else f"{float(length) * 1e3:.6g} mm"


@dataclasses.dataclass(frozen=True)
class Levels(LeaveOut):
    """Each level at which a quantity was held is a part; values closer than `gap` of their range are one level."""

    quantity: str
    gap: float = 0.02
    word: str = "level"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        values = np.concatenate([run[self.quantity] for run in recordings])
        ordered = np.sort(values[np.isfinite(values)])
        span = float(np.ptp(ordered)) if ordered.size else 0.0
        ends = np.flatnonzero(np.diff(ordered) > self.gap * span) + 1
        groups = np.split(ordered, ends if span > 0 else [])
        middles = np.array([float(np.median(group)) for group in groups])
        while middles.size > MOST:
            nearest = int(np.argmin(np.diff(middles)))
            middles = np.delete(middles, nearest)
        edges = (middles[1:] + middles[:-1]) / 2
        names = np.array([f"{self.quantity} {middle:.4g}" for middle in middles])
        return [names[np.searchsorted(edges, run[self.quantity])] for run in recordings]


def parts(recordings: Sequence[Recording], leave_out: LeaveOut) -> tuple[list[Labels], list[str]]:
    """Labels by row and the parts in their order. Raises IdentificationError where there are fewer than two."""
    labels = leave_out.labels(recordings)
    names = list(dict.fromkeys(str(name) for array in labels for name in dict.fromkeys(array.tolist())))
    if len(names) < 2:
        raise IdentificationError(
            f"{recordings[0].origin if recordings else 'no recording'}: all rows are of one {leave_out.word}, so none "
            "can be left out. Give more runs, or leave out Levels('contraction') or Levels('pressure')."
        )
    return labels, names


def natural(recordings: Sequence[Recording]) -> LeaveOut:
    """Specimens where there are three or more, else runs, else levels of contraction, else of pressure."""
    choices: tuple[LeaveOut, ...] = (Specimens(), Runs(), Levels("contraction"), Levels("pressure"))
    for choice in choices:
        if len({name for array in choice.labels(recordings) for name in array.tolist()}) >= 3:
            return choice
    raise IdentificationError(
        "Fewer than three specimens, runs, levels of contraction and levels of pressure: laws cannot be compared by "
        "what they leave out. Measure at more levels."
    )
