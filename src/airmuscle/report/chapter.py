"""Building blocks of a report: chapters with claims, tables and figures; every verdict is computed."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.reference import Reference
from .formula import to_plain

HOLDS, DIFFERS, NOT_PRINTED = "holds", "differs", "not printed"


@dataclasses.dataclass(frozen=True)
class PublishedValue(abc.ABC):
    """The value that a paper prints for a claim, and the criterion for the reproduced number.

    Where a paper says only "low" or "comparable", the bound is `chosen`: then `claims.json` gives no published
    value, and the bound as the tolerance.
    """

    value: float
    tolerance: float = 0.0
    chosen: bool = False

    @abc.abstractmethod
    def agrees(self, reproduced: float) -> bool:
        """Whether the reproduced number confirms the claim."""


class Equal(PublishedValue):
    """Criterion: the reproduced number equals the printed one within the tolerance."""

    def agrees(self, reproduced: float) -> bool:
        return abs(reproduced - self.value) <= self.tolerance


class AtLeast(PublishedValue):
    """Criterion: the reproduced number is not below the printed one minus the tolerance."""

    def agrees(self, reproduced: float) -> bool:
        return reproduced >= self.value - self.tolerance


class AtMost(PublishedValue):
    """Criterion: the reproduced number is not above the printed one plus the tolerance."""

    def agrees(self, reproduced: float) -> bool:
        return reproduced <= self.value + self.tolerance


@dataclasses.dataclass(frozen=True)
class Claim:
    """One statement of a paper with the printed and the reproduced value.

    `printed` is None if the paper gives no value to compare with, `reproduced` is None if no value can be computed;
    in both cases the verdict is "not printed". `note` gives the reason of a difference, or the values chosen.
    """

    paper: str
    claim: str
    printed: PublishedValue | None
    reproduced: float | None
    unit: str
    note: str = ""

    @property
    def verdict(self) -> str:
        if self.printed is None or self.reproduced is None or not math.isfinite(self.reproduced):
            return NOT_PRINTED
        return HOLDS if self.printed.agrees(self.reproduced) else DIFFERS

    def as_dict(self) -> dict[str, Any]:
        """Return the claim as a record of `claims.json`."""
        printed = self.printed
        return {
            "paper": self.paper,
            "claim": to_plain(self.claim),
            "published": None if printed is None or printed.chosen else printed.value,
            "reproduced": self.reproduced,
            "unit": self.unit,
            "tolerance": None if printed is None else printed.value if printed.chosen else printed.tolerance,
            "verdict": self.verdict,
            "note": to_plain(self.note),
        }


@dataclasses.dataclass(frozen=True, eq=False)
class Table:
    """A titled table; `columns` maps headers with units, `pressure [MPa]`, to values. Written to data/<name>.csv."""

    name: str
    title: str
    columns: Mapping[str, npt.NDArray[Any] | list[Any]]
    note: str = ""
    shown: bool = True
    """Whether the page shows it; long series are only written to their file."""

    def __post_init__(self) -> None:
        lengths = {
            header: len(np.atleast_1d(np.asarray(values, dtype=object))) for header, values in self.columns.items()
        }
        if len(set(lengths.values())) > 1:
            raise ValueError(f"table {self.name}: all columns must have the same length, not {lengths}.")


@dataclasses.dataclass(frozen=True, eq=False)
class Plot:
    """A Matplotlib figure with its caption. Embedded in the page and written to figures/<name>.svg and .png."""

    name: str
    caption: str
    figure: Any


@dataclasses.dataclass(frozen=True, eq=False)
class DisplayedEquation:
    """An equation in LaTeX, one entry of `lines` for each definition, and its source text by language."""

    name: str
    title: str
    lines: tuple[str, ...]
    note: str
    sources: Mapping[str, str]


@dataclasses.dataclass(frozen=True, eq=False)
class Chapter:
    """A chapter of a report: summary, claims, tables, figures, references and the sources of all values."""

    paper: str
    title: str
    summary: str
    claims: tuple[Claim, ...] = ()
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    references: tuple[Reference, ...] = ()
    chosen: tuple[tuple[str, str, str], ...] = ()
    """Values used for the figures: (meaning, value with unit, source or "chosen")."""
    equations: tuple[DisplayedEquation, ...] = ()
