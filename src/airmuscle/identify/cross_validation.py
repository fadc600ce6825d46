"""What a cross-validation leaves out at once: a whole run, level or specimen, never random rows.

Neighbouring rows of one run repeat each other. A law that was fitted to some of them meets the others, and
learns nothing of the next run from that.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ..core.errors import IdentificationError, ParameterError
from ..recording import Recording

Labels = npt.NDArray[np.str_]
MAX_LEVELS = 12
"""Most parts that are made; more are put together, neighbours first (chosen: each costs a fit a law)."""
ALWAYS_FITTED = ""
"""Name of the rows that are never left out."""


class GroupSplit(abc.ABC):
    """How the rows of recordings fall into parts, each of which is left out in turn."""

    group_name: ClassVar[str]
    purpose: ClassVar[str]
    """What a law is for that does well on parts like these, as a recommendation says it."""

    @abc.abstractmethod
    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        """The name of the part that each row belongs to, one array a recording; KEPT where it is in every fit."""


@dataclasses.dataclass(frozen=True)
class RunSplit(GroupSplit):
    """Each recording is a part."""

    group_name: ClassVar[str] = "run"
    purpose: ClassVar[str] = "another run of the kind that was measured"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        names = [run.origin for run in recordings]
        unique = [name if names.count(name) == 1 else f"{name} ({i + 1})" for i, name in enumerate(names)]
        return [np.full(len(run), name) for run, name in zip(recordings, unique, strict=True)]


@dataclasses.dataclass(frozen=True)
class SpecimenSplit(GroupSplit):
    """Each muscle is a part, told by the constant `specimen`, or else by its resting length."""

    group_name: ClassVar[str] = "specimen"
    purpose: ClassVar[str] = "a muscle of the type that was not measured"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        return [np.full(len(run), self._specimen_name(run)) for run in recordings]

    def _specimen_name(self, run: Recording) -> str:
        if "specimen" in run.constants:
            return str(run.constants["specimen"])
        length = run.constants.get("resting_length")
        return run.origin if length is None else f"{float(length) * 1e3:.6g} mm"


@dataclasses.dataclass(frozen=True)
class LevelSplit(GroupSplit):
    """Each level at which a quantity was held is a part; values closer than `gap` of their range are one level."""

    quantity: str
    min_gap: float = 0.02
    group_name: ClassVar[str] = "level"
    purpose: ClassVar[str] = "levels between those measured, and one step beyond"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        values = np.concatenate([run[self.quantity] for run in recordings])
        ordered = np.sort(values[np.isfinite(values)])
        span = float(np.ptp(ordered)) if ordered.size else 0.0
        ends = np.flatnonzero(np.diff(ordered) > self.min_gap * span) + 1
        groups = np.split(ordered, ends if span > 0 else [])
        middles = np.array([float(np.median(group)) for group in groups])
        while middles.size > MAX_LEVELS:
            nearest = int(np.argmin(np.diff(middles)))
            middles = np.delete(middles, nearest)
        edges = (middles[1:] + middles[:-1]) / 2
        names = np.array([f"{self.quantity} {middle:.4g}" for middle in middles])
        return [names[np.searchsorted(edges, run[self.quantity])] for run in recordings]


@dataclasses.dataclass(frozen=True)
class BlockSplit(GroupSplit):
    """Stretches of a quantity within every run, so that each run and each muscle has a say in every fit.

    A run's range is cut into `2 count` stretches; every `count`-th belongs to one part, in the next run one further.
    The first and the last stay in every fit: what is asked lies between them. Rows of a stretch repeat each other, and
    so are left out together (Roberts et al., Ecography 40:913 (2017)).
    """

    quantity: str = "pressure"
    folds: int = 5
    group_name: ClassVar[str] = "block"
    purpose: ClassVar[str] = "the muscles and contractions that were measured, within their range"

    def __post_init__(self) -> None:
        if self.folds < 2:
            raise ParameterError(
                f"BlockSplit.count is {self.folds}; there must be 2 or more parts to leave out in turn."
            )

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        names = np.array([f"block {k + 1}" for k in range(self.folds)])
        found = []
        for i, run in enumerate(recordings):
            stretch = self._interval_index(run[self.quantity])
            inside = (stretch > 0) & (stretch < 2 * self.folds - 1)
            found.append(np.where(inside, names[(i + stretch) % self.folds], ALWAYS_FITTED))
        return found

    def _interval_index(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.intp]:
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        shares = (np.nan_to_num(values, nan=low) - low) / (high - low if high > low else 1.0)
        return np.minimum((2 * self.folds * shares).astype(np.intp), 2 * self.folds - 1)


def label_folds(recordings: Sequence[Recording], leave_out: GroupSplit) -> tuple[list[Labels], list[str]]:
    """Labels by row and the parts in their order. Raises IdentificationError where there are fewer than two."""
    labels = leave_out.labels(recordings)
    names = list(dict.fromkeys(str(name) for array in labels for name in dict.fromkeys(array.tolist())))
    names = [name for name in names if name != ALWAYS_FITTED]
    if len(names) < 2:
        raise IdentificationError(
            f"{recordings[0].origin if recordings else 'no recording'}: all rows are of one {leave_out.group_name}, so none "
            "can be left out. Give more runs, or leave out Levels('contraction') or Levels('pressure')."
        )
    return labels, names


def default_split(recordings: Sequence[Recording]) -> GroupSplit:
    """SpecimenSplit where there are three or more, else runs, else levels of contraction, else of pressure."""
    choices: tuple[GroupSplit, ...] = (SpecimenSplit(), RunSplit(), LevelSplit("contraction"), LevelSplit("pressure"))
    for choice in choices:
        if len({name for array in choice.labels(recordings) for name in array.tolist()}) >= 3:
            return choice
    raise IdentificationError(
        "Fewer than three specimens, runs, levels of contraction and levels of pressure: laws cannot be compared by "
        "what they leave out. Measure at more levels."
    )
