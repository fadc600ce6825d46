"""Options of `airmuscle fit`: bootstrap, profile likelihood, cross-validation groups, shape constraints, loss."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import typer

from ...bench.identify import (
    BlockSplit,
    Fit,
    GroupSplit,
    Huber,
    LeastSquares,
    LengthError,
    LevelSplit,
    Loss,
    RunSplit,
    ShapeConstrainedFit,
    SpecimenSplit,
    bootstrap,
    estimate_length_error,
    profile,
    weakly_determined,
)
from ...bench.identify.length_errors import PRIOR_STD
from ...bench.identify.shape_chapter import shape_chapter
from ...bench.identify.surface.shape import fit_shape_constrained, shape_violations_of_fit
from ...bench.identify.uncertainty_chapter import Uncertainty, uncertainty_chapter
from ...core.errors import ParameterError
from ...core.units import quantity
from ...files.library.entry import Entry
from ...physics.muscle.characteristic import ContractileSurface
from ...recording import Recording
from ...report.chapter import Chapter
from .execution import Execution
from .fit_geometry import BraidSize
from .progress import computation_progress

PURPOSES: dict[str, GroupSplit | None] = {"repeat": RunSplit(), "length": SpecimenSplit(), "both": None}
"""Values of --purpose with the split that serves each: further runs of the measured muscles, other muscles, or both."""
WEAK = "weak"
"""Value of --profile that stands for all weakly determined parameters."""


@dataclasses.dataclass(frozen=True)
class FitRequest:
    """Settings of the fit and of its output."""

    options: FitOptions
    fixed: tuple[str, ...]
    degree: int
    robust: str | None
    uncensored: bool
    equal_weights: bool
    out: Path
    json: bool
    braid: BraidSize | None = None
    execution: Execution = Execution()


@dataclasses.dataclass(frozen=True)
class FitOptions:
    """Computations beyond the fit; checked before any file is read."""

    refits: int | None
    profiled: tuple[str, ...]
    split: GroupSplit | None
    shape: bool
    free_contractions: tuple[tuple[float, float], ...]
    """Points of zero force: pressures [Pa] and contractions [1]."""
    purpose: str | None = None
    """Value of --purpose; None without."""
    length_errors: tuple[str, ...] = ()
    """Specimens whose resting length is estimated."""

    @classmethod
    def parse(
        cls, refits: int | None, profiled: list[str] | None, leave_out: str | None, shape: bool,
        free_contraction: list[str] | None, compare: bool, purpose: str | None = None,
        length_error: list[str] | None = None,
    ) -> FitOptions:  # fmt: skip
        """The options from their texts. Raises BadParameter or UnitError."""
        if free_contraction and not shape:
            raise typer.BadParameter("--free-contraction requires --shape")
        if shape and compare:
            raise typer.BadParameter(
                "--shape is for a ContractileSurface, given with --characteristic; it excludes --compare"
            )
        points = tuple(_parse_point(text) for text in free_contraction or ())
        split, length_errors = parse_split(leave_out, purpose, compare), tuple(length_error or ())
        return cls(refits, tuple(profiled or ()), split, shape, points, purpose, length_errors)

    def evaluate(self, fit: Fit, recordings: Sequence[Recording]) -> FitExtras:
        """The requested results beyond the fit. Raises IdentificationError or ParameterError."""
        weak = weakly_determined(fit) if WEAK in self.profiled else ()
        names = dict.fromkeys((*weak, *(name for name in self.profiled if name != WEAK)))
        sample = None
        if self.refits is not None:
            with computation_progress("refits") as progress:
                sample = bootstrap(fit, recordings, refits=self.refits, by=self.split, progress=progress)
        profiles = tuple(profile(fit, name) for name in names)
        shaped = _fit_shaped(fit, recordings, self.free_contractions) if self.shape else None
        none_weak = WEAK in self.profiled and not weak
        errors = tuple(estimate_length_error(fit.model, recordings, name) for name in self.length_errors)
        return FitExtras(Uncertainty(fit, sample, profiles), shaped, len(self.free_contractions), none_weak, errors)


@dataclasses.dataclass(frozen=True, eq=False)
class FitExtras:
    """Results beyond the fit, for the report, the terminal and JSON."""

    uncertainty: Uncertainty
    shaped: ShapeConstrainedFit | None
    free_contractions: int
    """Number of points at which the force is constrained to zero."""
    none_weak: bool
    """Whether the weakly determined parameters were requested and there are none."""
    length_errors: tuple[LengthError, ...] = ()

    def chapters(self) -> list[Chapter]:
        """Chapters of the report, which precede that of the fit."""
        fit = self.uncertainty.fit
        shape = [] if self.shaped is None else [shape_chapter(self.shaped, fit, self.free_contractions)]
        return [*shape, *([uncertainty_chapter(self.uncertainty)] if self.uncertainty.requested else [])]

    def lines(self) -> list[str]:
        """Lines for the terminal."""
        lines = [*self.uncertainty.lines(), *map(_describe_length_error, self.length_errors)]
        if self.none_weak:
            lines.append("profile: no parameter is weakly determined; the standard errors are valid")
        if self.shaped is None:
            return [*lines, *(f"note: {violation}" for violation in shape_violations_of_fit(self.uncertainty.fit))]
        errors = f"rms error {self.shaped.rmse:.4g} N, unconstrained {self.shaped.unconstrained_rmse:.4g} N"
        return [
            *lines,
            f"shape: {errors}",
            *(f"unconstrained: {violation}" for violation in self.shaped.unconstrained_violations),
        ]

    def to_dict(self) -> dict[str, Any]:
        """Plain data, all numbers SI."""
        violations = (
            shape_violations_of_fit(self.uncertainty.fit)
            if self.shaped is None
            else self.shaped.unconstrained_violations
        )
        data = {**self.uncertainty.as_data(), "shape_violations": [_violation_to_dict(each) for each in violations]}
        if self.length_errors:
            names = ("specimen", "resting_length", "offset", "standard_error", "rmse_before", "rmse_after")
            data["length_errors"] = [{name: getattr(each, name) for name in names} for each in self.length_errors]
        if self.shaped is not None:
            data["shaped"] = {"rmse": self.shaped.rmse, "unconstrained": self.shaped.unconstrained_rmse}
        return data

    def constrained_entry(self, entry: Entry) -> Entry:
        """The entry with the shape-constrained surface if one was requested, else the entry itself."""
        if self.shaped is None:
            return entry
        note = f"{entry.note} With shape constraints: rms error {self.shaped.rmse:.4g} N."
        return dataclasses.replace(entry, characteristic=self.shaped.model, note=note, error_band=None)


def parse_split(name: str | None, purpose: str | None = None, compare: bool = True) -> GroupSplit | None:
    """The groups of rows that --leave-out names or --purpose needs; None for both purposes. Raises BadParameter."""
    if purpose is not None:
        if purpose not in PURPOSES:
            raise typer.BadParameter(f"--purpose is '{purpose}'; allowed range: {', '.join(PURPOSES)}")
        if not compare or name is not None:
            raise typer.BadParameter("--purpose is for --compare, and excludes --leave-out")
        return PURPOSES[purpose]
    splits: dict[str, GroupSplit] = {
        "run": RunSplit(),
        "specimen": SpecimenSplit(),
        "contraction": LevelSplit("contraction"),
        "pressure": LevelSplit("pressure"),
        "block": BlockSplit(),
    }
    if name is not None and name not in splits:
        raise typer.BadParameter(f"--leave-out is '{name}'; allowed range: {', '.join(splits)}")
    return None if name is None else splits[name]


def robust_loss(robust: str | None, unit: str) -> Loss:
    """The loss that --robust gives, with its threshold in this SI unit; squared loss without it."""
    return LeastSquares() if robust is None else Huber(quantity(robust, unit, where="--robust"))


def _parse_point(text: str) -> tuple[float, float]:
    """A point of zero force: pressure [Pa] and contraction [1]."""
    pressure, sign, contraction = text.partition("=")
    if not sign:
        raise typer.BadParameter(f"--free-contraction must be PRESSURE=CONTRACTION, such as '3 bar=18 %', not '{text}'")
    value = quantity(contraction, "1", where="--free-contraction")
    if not 0.0 <= value < 1.0:
        raise typer.BadParameter(f"--free-contraction: a contraction must be from 0 to 100 %, not '{contraction}'")
    return quantity(pressure, "Pa", where="--free-contraction"), value


def _fit_shaped(
    fit: Fit, recordings: Sequence[Recording], points: tuple[tuple[float, float], ...]
) -> ShapeConstrainedFit:
    if not isinstance(fit.model, ContractileSurface):
        raise ParameterError(
            f"--shape: the shape of {type(fit.model).__name__} is given by its formula; only a ContractileSurface can "
            "be constrained. Give --characteristic ContractileSurface, or omit --shape."
        )
    free = None
    if points:
        pressure, contraction = np.array(points).T
        free = Recording({"pressure": pressure, "contraction": contraction}, "--free-contraction")
    return fit_shape_constrained(fit.model, recordings, free=free)


def _violation_to_dict(violation: Any) -> dict[str, Any]:
    return {**dataclasses.asdict(violation), "rule": violation.rule.description}


def _describe_length_error(error: LengthError) -> str:
    """The estimated error of a resting length, with its consequence."""
    return (
        f"length error: as if {error}; rms residual {error.rmse_before:.4g} before, {error.rmse_after:.4g} after the "
        f"correction (SI); normal prior with a standard deviation of {PRIOR_STD * 1e3:g} mm (chosen)"
    )
