"""What a report is made of: chapters with claims, tables and figures. A verdict is computed, never written down."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.reference import Reference

HOLDS, DIFFERS, NOT_PRINTED = "holds", "differs", "not printed"


@dataclasses.dataclass(frozen=True)
class PublishedValue(abc.ABC):
    """What a paper prints for a claim, and how a reproduced number is held against it.

    Where a paper says only "low" or "comparable", the bound is `chosen`: then no number counts as published, and the
    bound stands as the tolerance.
    """

    value: float
    tolerance: float = 0.0
    chosen: bool = False

    @abc.abstractmethod
    def agrees(self, reproduced: float) -> bool:
        """Whether the reproduced number bears the claim out."""


class Equal(PublishedValue):
    """The reproduced number lies within the tolerance of the printed one."""

    def agrees(self, reproduced: float) -> bool:
        return abs(reproduced - self.value) <= self.tolerance


class AtLeast(PublishedValue):
    """The reproduced number reaches the printed one, less the tolerance."""

    def agrees(self, reproduced: float) -> bool:
        return reproduced >= self.value - self.tolerance


class AtMost(PublishedValue):
    """The reproduced number does not pass the printed one, plus the tolerance."""

    def agrees(self, reproduced: float) -> bool:
        return reproduced <= self.value + self.tolerance


@dataclasses.dataclass(frozen=True)
class Claim:
    """One statement of a paper, what it prints and what was computed here.

    `printed` is None where the paper gives nothing to compare with; `reproduced` is None where nothing was
    computed. Either way the verdict is "not printed". `note` says why a claim differs, or what was chosen.
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
        """The claim as `claims.json` holds it."""
        held = self.printed
        return {
            "paper": self.paper,
            "claim": self.claim,
            "published": None if held is None or held.chosen else held.value,
            "reproduced": self.reproduced,
            "unit": self.unit,
            "tolerance": None if held is None else held.value if held.chosen else held.tolerance,
            "verdict": self.verdict,
            "note": self.note,
        }


@dataclasses.dataclass(frozen=True, eq=False)
class Table:
    """A titled table; `columns` maps headers with units, `pressure [MPa]`, to values. Written to data/<name>.csv."""

    name: str
    title: str
    columns: Mapping[str, npt.NDArray[Any] | list[Any]]
    note: str = ""
    shown: bool = True
    """Whether the report prints it; long series are only written to their file."""

    def __post_init__(self) -> None:
        lengths = {
            header: len(np.atleast_1d(np.asarray(values, dtype=object))) for header, values in self.columns.items()
        }
        if len(set(lengths.values())) > 1:
            raise ValueError(f"table {self.name}: columns differ in length: {lengths}")


@dataclasses.dataclass(frozen=True, eq=False)
class Plot:
    """A Matplotlib figure with its caption. Written to figures/<name>.svg and .png and into the report."""

    name: str
    caption: str
    figure: Any


@dataclasses.dataclass(frozen=True, eq=False)
class Chapter:
    """One paper's part of the report: what it claims, what came out, and where every number is from."""

    paper: str
    title: str
    summary: str
    claims: tuple[Claim, ...] = ()
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    references: tuple[Reference, ...] = ()
    chosen: tuple[tuple[str, str, str], ...] = ()
    """Numbers that stand behind the figures: (what, value with unit, source or "chosen")."""
