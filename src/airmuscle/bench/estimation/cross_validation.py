"""Cross-validation splits by run, level, specimen or block, and the levels that a test rig keeps
constant.

Rows are left out in groups, never at random: neighbouring rows of one run are correlated, so that a
law fitted to some of them also fits the others, which says nothing about its error on a new run.
"""

import abc
import dataclasses
import re
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ...core import (
    Array,
    Hint,
    HintedText,
    IdentificationError,
    ParameterError,
    check_field_types,
    counted,
    level_text,
)
from ...recording import Recording
from ..inspection import EDGE, SAME_READING, constant_band, estimate_resolution, rounding

LEVEL_TOLERANCE = 0.005
"""Maximum difference between neighbouring values of a level, as a fraction of the maximum
(chosen).
"""
MAX_LEVEL_WIDTH = 3.0
"""Maximum width of a level, in the difference of neighbours; a wider group of values is a ramp
(chosen).
"""
HELD_FRACTION = 0.9
"""Minimum fraction of the rows at levels for a quantity that is held (chosen)."""
NUMBER = re.compile(r"(\d+(?:\.\d+)?)")
ROUND_DIGITS = 2
"""Significant digits of the levels that are chosen on a ramp."""


def held_levels(values: Array) -> tuple[Array, float]:
    """The levels of a measured quantity in increasing order, and the fraction of the rows at them:
    medians of groups of values, without groups that a ramp fills."""
    ordered = np.sort(values)
    tolerance = LEVEL_TOLERANCE * (1 + EDGE) * float(np.abs(ordered).max())
    ends = np.flatnonzero(np.diff(ordered) > tolerance) + 1
    groups = [
        group for group in np.split(ordered, ends) if np.ptp(group) <= MAX_LEVEL_WIDTH * tolerance
    ]
    return np.array([np.median(group) for group in groups]), sum(map(len, groups)) / ordered.size


def levels_of(values: Array, max_count: int) -> Array:
    """Return the levels of a measured quantity, at most `max_count` of them, evenly selected, in
    its unit. A level is the median of values closer together than a test rig controls them. A ramp
    gives quantiles, rounded to two significant digits."""
    levels, fraction = held_levels(values)
    if fraction < 0.5:
        quantiles = np.quantile(values, np.linspace(0.1, 0.9, max_count))
        return np.unique(
            [float(f"{value * (1 + EDGE):.{ROUND_DIGITS - 1}e}") for value in quantiles]
        )
    if levels.size <= max_count:
        return levels
    return np.asarray(levels[np.unique(np.linspace(0, levels.size - 1, max_count).astype(int))])


def is_pressure_ramp(pressure: Array, contraction: Array) -> bool:
    """Whether the pressure was swept at held contractions [Pa, 1], as in isometric tests."""
    return held_levels(contraction)[1] >= HELD_FRACTION and held_levels(pressure)[1] < 0.5


Labels = npt.NDArray[np.str_]
MAX_LEVELS = 12
"""Maximum number of levels; beyond it neighbouring levels are merged (chosen: every level costs a
fit of each law).
"""
ALWAYS_FITTED = ""
"""Label of the rows that are in every training set."""


class GroupSplit(abc.ABC):
    """A division of the rows of recordings into groups; each group is left out in turn (one
    fold).
    """

    group_name: ClassVar[str]
    """Noun for one group, used in reports."""
    purpose: ClassVar[str]
    """The use for which a low error on such groups recommends a law, as a phrase for reports."""

    @abc.abstractmethod
    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        """The group of each row, one array for each recording; ALWAYS_FITTED for rows that are
        never left out.
        """


@dataclasses.dataclass(frozen=True)
class RunSplit(GroupSplit):
    """Each recording is a group."""

    group_name: ClassVar[str] = "run"
    purpose: ClassVar[str] = "further runs of the same kind"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        names = [run.origin for run in recordings]
        unique = [
            name if names.count(name) == 1 else f"{name} ({i + 1})" for i, name in enumerate(names)
        ]
        return [np.full(len(run), name) for run, name in zip(recordings, unique, strict=True)]


@dataclasses.dataclass(frozen=True)
class SpecimenSplit(GroupSplit):
    """Each muscle is a group, identified by the constant `specimen`, or else by its resting
    length.
    """

    group_name: ClassVar[str] = "specimen"
    purpose: ClassVar[str] = "other muscles of the same type"

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        return [np.full(len(run), specimen_name(run)) for run in recordings]


def specimen_name(run: Recording) -> str:
    """The constant `specimen`, or else the resting length in mm, or the origin of the recording."""
    if "specimen" in run.constants:
        return str(run.constants["specimen"])
    length = run.constants.get("resting_length")
    return run.origin if length is None else f"{float(length) * 1e3:.6g} mm"


def specimens_of(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """The specimens of the recordings; empty if one of them states neither its specimen nor its
    resting length.
    """
    if not all(
        "specimen" in run.constants or "resting_length" in run.constants for run in recordings
    ):
        return ()
    return tuple(dict.fromkeys(specimen_name(run) for run in recordings))


def resting_lengths_of(recordings: Sequence[Recording]) -> dict[str, float]:
    """The resting length [m] of each specimen that states one."""
    stated = [run for run in recordings if "resting_length" in run.constants]
    return {specimen_name(run): float(run.constants["resting_length"]) for run in stated}


@dataclasses.dataclass(frozen=True)
class LevelSplit(GroupSplit):
    """Each level of a quantity is a group; values closer than `min_gap` times their range belong to
    one level.
    """

    quantity: str
    min_gap: float = 0.02
    group_name: ClassVar[str] = "level"
    purpose: ClassVar[str] = "levels between the measured ones and one step beyond"

    def __post_init__(self) -> None:
        check_field_types(self)

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        values = np.concatenate([run[self.quantity] for run in recordings])
        ordered = np.sort(values[np.isfinite(values)])
        span = float(np.ptp(ordered)) if ordered.size else 0.0
        same = self._difference_of_readings(ordered)
        span = span if span > same else 0.0
        ends = np.flatnonzero(np.diff(ordered) > max(self.min_gap * span * (1 + EDGE), same)) + 1
        groups = np.split(ordered, ends if span > 0 else [])
        centres = np.array([float(np.median(group)) for group in groups])
        while centres.size > MAX_LEVELS:
            gaps = np.diff(centres)
            nearest = int(np.argmax(gaps <= gaps.min() * (1 + EDGE)))  # the first of equal gaps
            centres = np.delete(centres, nearest)
        edges = (centres[1:] + centres[:-1]) / 2
        names = np.array(
            [f"{self.quantity} {level_text(self.quantity, float(each), span)}" for each in centres]
        )
        return [names[np.searchsorted(edges, run[self.quantity])] for run in recordings]

    def _difference_of_readings(self, values: Array) -> float:
        """The difference up to which values (N,) are readings of one level: rounding, or one count
        of a quantity that is constant in all of them.
        """
        band = constant_band(self.quantity, values)
        is_constant = values.size > 0 and float(np.ptp(values)) <= band
        count = estimate_resolution(values, band) if is_constant else 0.0
        return max((1.0 + SAME_READING) * count, rounding(self.quantity, values))


@dataclasses.dataclass(frozen=True)
class BlockSplit(GroupSplit):
    """Blocks of a quantity within every run, so that every run and every muscle is part of each
    training set.

    The range of a run is divided into `2 folds` intervals. Every `folds`-th interval belongs to one
    group, shifted by one interval from run to run. The first and the last interval are in every
    training set, so that a law is evaluated by interpolation only. The rows of an interval are
    correlated and are therefore left out together (Roberts et al., Ecography 40:913 (2017)).
    """

    quantity: str = "pressure"
    folds: int = 5
    group_name: ClassVar[str] = "block"
    purpose: ClassVar[str] = "the measured muscles and contractions, within the measured range"

    def __post_init__(self) -> None:
        check_field_types(self)
        if self.folds < 2:
            raise ParameterError(f"BlockSplit.folds is {self.folds}; it must be 2 or more.")

    def labels(self, recordings: Sequence[Recording]) -> list[Labels]:
        names = np.array([f"block {k + 1}" for k in range(self.folds)])
        labels = []
        for i, run in enumerate(recordings):
            values = run[self.quantity]
            known = values[~np.isnan(values)]
            low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
            fractions = (np.nan_to_num(values, nan=low) - low) / (high - low if high > low else 1.0)
            cells = 2 * self.folds * fractions + EDGE  # a row on an edge is above it
            interval = np.minimum(cells.astype(np.intp), 2 * self.folds - 1)
            inside = (interval > 0) & (interval < 2 * self.folds - 1)
            labels.append(np.where(inside, names[(i + interval) % self.folds], ALWAYS_FITTED))
        return labels


def _by_number(name: str) -> list[tuple[int, float, str]]:
    """The texts and numbers of a name, for sorting."""
    parts = NUMBER.split(name)
    return [(0, float(part), "") if i % 2 else (1, 0.0, part) for i, part in enumerate(parts)]


def label_folds(
    recordings: Sequence[Recording], leave_out: GroupSplit
) -> tuple[list[Labels], list[str]]:
    """The label of each row, and the names of the folds in the order of their numbers, which does
    not depend on that of the files. Raises IdentificationError where
    there are fewer than two groups."""
    labels = leave_out.labels(recordings)
    names = list(
        dict.fromkeys(str(name) for array in labels for name in dict.fromkeys(array.tolist()))
    )
    names = sorted((name for name in names if name != ALWAYS_FITTED), key=_by_number)
    if len(names) < 2:
        raise IdentificationError(
            HintedText(
                f"{recordings[0].origin if recordings else 'no recording'}: cross-validation needs"
                f" two groups or more, but all rows belong to one {leave_out.group_name}. Give more"
                " runs.",
                *(
                    Hint(f"To leave out levels of {n}", "leave_out", LevelSplit(n))
                    for n in ("contraction", "pressure")
                ),
            )
        )
    return labels, names


def default_split(recordings: Sequence[Recording], least: int = 3) -> GroupSplit:
    """The first split with `least` groups or more: specimens, runs, levels of contraction, levels
    of pressure. Raises IdentificationError where there is none."""
    splits: tuple[GroupSplit, ...] = (
        SpecimenSplit(),
        RunSplit(),
        LevelSplit("contraction"),
        LevelSplit("pressure"),
    )
    counts = []
    for split in splits:
        count = len({name for array in split.labels(recordings) for name in array.tolist()})
        if count >= least:
            return split
        subject = f" of {split.quantity}" if isinstance(split, LevelSplit) else ""
        counts.append(f"{counted(count, split.group_name)}{subject}")
    origin = recordings[0].origin if recordings else "no recording"
    raise IdentificationError(
        HintedText(
            f"{origin}: cross-validation leaves out one of {least} groups or more in turn, but the"
            f" recordings have {', '.join(counts)} (a sweep without a gap is one level). Give more"
            " runs, or hold the pressure or the length at more levels.",
            Hint("To leave out parts of each run", "leave_out", BlockSplit()),
        )
    )
