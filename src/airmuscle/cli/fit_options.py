"""What `airmuscle fit` is asked beyond the fit: bootstrap, profiles, a physical shape."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..identify.cross_validation import GroupSplit
    from ..identify.result import Fit
    from ..identify.surface.shape import ShapeConstrainedFit
    from ..library.entry import Entry
    from ..recording import Recording
    from ..report.chapter import Chapter
    from ..report.uncertainty_chapter import Uncertainty

WEAK = "weak"
"""For --profile: all parameters whose standard deviation should not be trusted."""


@dataclasses.dataclass(frozen=True)
class FitRequest:
    """How to fit, and where the answers go."""

    more: FitOptions
    fixed: tuple[str, ...]
    degree: int
    robust: str | None
    uncensored: bool
    equal_weights: bool
    out: Path
    json: bool


@dataclasses.dataclass(frozen=True)
class FitOptions:
    """The options, checked before anything is read."""

    refits: int | None
    profiled: tuple[str, ...]
    by: GroupSplit | None
    shape: bool
    free: tuple[tuple[float, float], ...]
    """Pressures [Pa] and contractions [1] at which the muscle hangs free."""

    @classmethod
    def of(
        cls, refits: int | None, profiled: list[str] | None, leave_out: str | None, shape: bool,
        free: list[str] | None, compare: bool,
    ) -> FitOptions:  # fmt: skip
        """From the options as typed."""
        if free and not shape:
            raise typer.BadParameter("--free states where the force of a surface with --shape is zero; give --shape")
        if shape and compare:
            raise typer.BadParameter("--shape is for a ContractileSurface, named with --characteristic; no --compare")
        return cls(refits, tuple(profiled or ()), part_of(leave_out), shape, tuple(_point(text) for text in free or ()))

    def find(self, fit: Fit, recordings: Sequence[Recording]) -> FitExtras:
        """All that was asked of a fit. Raises IdentificationError or ParameterError."""
        from ..identify import bootstrap, profile, weakly_determined
        from ..report.uncertainty_chapter import Uncertainty
        from .progress import working_progress

        weak = weakly_determined(fit) if WEAK in self.profiled else ()
        names = dict.fromkeys((*weak, *(name for name in self.profiled if name != WEAK)))
        drawn = None
        if self.refits is not None:
            with working_progress("refits") as progress:
                drawn = bootstrap(fit, recordings, refits=self.refits, by=self.by, progress=progress)
        profiles = tuple(profile(fit, name) for name in names)
        shaped = _shaped(fit, recordings, self.free) if self.shape else None
        none_weak = WEAK in self.profiled and not weak
        return FitExtras(Uncertainty(fit, drawn, profiles), shaped, len(self.free), none_weak)


@dataclasses.dataclass(frozen=True, eq=False)
class FitExtras:
    """The answers, for report, terminal and file."""

    sure: Uncertainty
    shaped: ShapeConstrainedFit | None
    free: int
    none_weak: bool

    def chapters(self) -> list[Chapter]:
        """Their chapters, before the fit's own."""
        from ..report.shape_chapter import shape_chapter
        from ..report.uncertainty_chapter import uncertainty_chapter

        shape = [] if self.shaped is None else [shape_chapter(self.shaped, self.sure.fit, self.free)]
        return [*shape, *([uncertainty_chapter(self.sure)] if self.sure.requested else [])]

    def lines(self) -> list[str]:
        """The same for a terminal."""
        from ..identify.surface.shape import shape_violations_of_fit

        said = self.sure.lines()
        if self.none_weak:
            said.append("profile: no parameter is nearly undetermined; the standard deviations stand")
        if self.shaped is None:
            return [*said, *(f"note: {each}" for each in shape_violations_of_fit(self.sure.fit))]
        cost = f"rms {self.shaped.rmse:.4g} N with it, {self.shaped.unconstrained_rmse:.4g} N without"
        return [*said, f"shape: {cost}", *(f"without it {each}" for each in self.shaped.unconstrained_violations)]

    def as_data(self) -> dict[str, Any]:
        """The same as plain data, SI."""
        from ..identify.surface.shape import shape_violations_of_fit

        broken = shape_violations_of_fit(self.sure.fit) if self.shaped is None else self.shaped.unconstrained_violations
        found = {**self.sure.as_data(), "shape_breaks": [_broken(each) for each in broken]}
        if self.shaped is not None:
            found["shaped"] = {"rmse": self.shaped.rmse, "unconstrained": self.shaped.unconstrained_rmse}
        return found

    def shaped_entry(self, entry: Entry) -> Entry:
        """The muscle with the surface that keeps its shape, where one was asked for."""
        if self.shaped is None:
            return entry
        note = f"{entry.note} Here with the shape of a muscle: rms error {self.shaped.rmse:.4g} N."
        return dataclasses.replace(entry, characteristic=self.shaped.model, note=note)


def part_of(word: str | None) -> GroupSplit | None:
    """What --leave-out names."""
    from ..identify.cross_validation import BlockSplit, LevelSplit, RunSplit, SpecimenSplit

    parts: dict[str, GroupSplit] = {
        "run": RunSplit(),
        "specimen": SpecimenSplit(),
        "contraction": LevelSplit("contraction"),
        "pressure": LevelSplit("pressure"),
        "block": BlockSplit(),
    }
    if word is not None and word not in parts:
        raise typer.BadParameter(f"--leave-out is '{word}'; it may be {', '.join(parts)}")
    return None if word is None else parts[word]


def _point(text: str) -> tuple[float, float]:
    from ..core.units import quantity

    pressure, sign, contraction = text.partition("=")
    if not sign:
        raise typer.BadParameter(f"--free wants PRESSURE=CONTRACTION, like '3 bar=18 %', not '{text}'")
    found = quantity(contraction, "1", where="--free")
    if not 0.0 <= found < 1.0:
        raise typer.BadParameter(
            f"--free: a muscle that hangs free is contracted by 0 to 100 %, not by '{contraction}'"
        )
    return quantity(pressure, "Pa", where="--free"), found


def _shaped(fit: Fit, recordings: Sequence[Recording], free: tuple[tuple[float, float], ...]) -> ShapeConstrainedFit:
    from ..characteristic import ContractileSurface
    from ..core.errors import ParameterError
    from ..identify import fit_shape_constrained
    from ..recording import Recording

    if not isinstance(fit.model, ContractileSurface):
        raise ParameterError(
            f"--shape: {type(fit.model).__name__} has the shape that its formula gives it; only a ContractileSurface "
            "can be held to one. Give --characteristic ContractileSurface, or leave out --shape."
        )
    points = None
    if free:
        pressure, contraction = zip(*free, strict=True)
        points = Recording({"pressure": list(pressure), "contraction": list(contraction)}, "--free")  # type: ignore[dict-item]
    return fit_shape_constrained(fit.model, recordings, free=points)


def _broken(each: Any) -> dict[str, Any]:
    return {**dataclasses.asdict(each), "rule": each.rule.description}
