"""Joint variation of all chosen values of the quick release of Hošovský et al.: corners and a Sobol set."""

import dataclasses
import functools
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..design.study.design import Sobol
from ..design.study.distributions import Uniform
from ..report.chapter import Table
from ..report.claims import AtLeast, Claim
from ..report.formatting import format_quantity, format_unit
from .hosovsky_fill_and_release import RELEASED_AT, STATEMENTS, Release, agrees, compare_releases, release
from .hosovsky_plant import FORCE_MAPS, PAPER, UnpublishedParameters

VARIED = ("stiffness", "damping", "length", "braid_angle", "low_pressure", "high_pressure")
"""The chosen values on which the quick release depends."""
SOBOL_POINTS = 64
"""Number of Sobol points within the ranges (chosen)."""
CASE = "all chosen values varied together: share that holds"
"""Case of a claim for the joint variation."""
OBSERVED = 1.5
"""Time after the release [s] that contains the first four turning points of all cases (chosen)."""


@dataclasses.dataclass(frozen=True)
class JointCase:
    """One combination of the chosen values, and the values of the four statements for it."""

    design: str
    parameters: UnpublishedParameters
    values: dict[str, float]

    def describe(self) -> str:
        """The varied parameters with their values."""
        items = ((name.replace("_", " "), getattr(self.parameters, name)) for name in VARIED)
        return ", ".join(f"{name} {_quantity(item.value, item.unit)}" for name, item in items)


def _quantity(value: float, unit: str) -> str:
    return format_quantity(value / 1e3, "kPa") if unit == "Pa" else format_quantity(value, unit)


@dataclasses.dataclass(frozen=True)
class JointVariation:
    """All combinations of the chosen values for which the statements were evaluated."""

    cases: tuple[JointCase, ...]

    def values(self, key: str, design: str | None = None) -> np.ndarray:
        """The values of a statement, in the order of the cases, of one design or of all."""
        return np.array([case.values[key] for case in self.cases if design in (None, case.design)])

    def share(self, key: str, design: str | None = None) -> float:
        """The share of the cases for which a statement holds [1]; a missing value does not hold."""
        return float(np.mean([agrees(key, value) for value in self.values(key, design)]))

    def worst(self, key: str) -> JointCase:
        """The case that is nearest to a violation of a statement, or violates it most."""
        values = self.values(key)
        margin = values if agrees(key, np.inf) else -values
        return self.cases[int(np.argmin(np.where(np.isnan(values), -np.inf, margin)))]


def joint_variation(parameters: UnpublishedParameters) -> JointVariation:
    """Return the four statements at all corners of the ranges, for both force maps, and at Sobol points within them."""
    cases = [
        _case(f"corners, {data}", point, data, _cached_release) for data in FORCE_MAPS for point in _corners(parameters)
    ]
    cases += [_case("Sobol set", point, FORCE_MAPS[0], _release) for point in _sobol(parameters)]
    return JointVariation(tuple(cases))


def _case(design: str, point: UnpublishedParameters, data: str, run: Any) -> JointCase:
    low, high = (run(_without_pressures(point), pressure.value, data)
                 for pressure in (point.low_pressure, point.high_pressure))  # fmt: skip
    return JointCase(design, point, compare_releases(low, high))


def _without_pressures(point: UnpublishedParameters) -> UnpublishedParameters:
    """The values on which one release depends, so that corners share their releases."""
    nominal = UnpublishedParameters()
    return dataclasses.replace(point, low_pressure=nominal.low_pressure, high_pressure=nominal.high_pressure)


def _release(parameters: UnpublishedParameters, pressure: float, data: str) -> Release:
    return release(parameters, pressure, data, RELEASED_AT + OBSERVED)


_cached_release = functools.lru_cache(maxsize=256)(_release)


def _corners(parameters: UnpublishedParameters) -> Iterator[UnpublishedParameters]:
    ends = [(getattr(parameters, name).low, getattr(parameters, name).high) for name in VARIED]
    return (_at(parameters, point) for point in itertools.product(*ends))


def _sobol(parameters: UnpublishedParameters) -> Iterator[UnpublishedParameters]:
    ranges = [getattr(parameters, name) for name in VARIED]
    points = Sobol(SOBOL_POINTS).values([Uniform(value.low, value.high) for value in ranges])
    return (_at(parameters, point.tolist()) for point in points)


def _at(parameters: UnpublishedParameters, point: Sequence[float]) -> UnpublishedParameters:
    for name, value in zip(VARIED, point, strict=True):
        parameters = parameters.with_value(name, value)
    return parameters


def joint_table(joint: JointVariation) -> Table:
    """Return the share of the joint variations for which each statement holds, and its extreme values."""
    designs = list(dict.fromkeys(case.design for case in joint.cases))
    columns: dict[str, list[Any]] = {"statement": list(STATEMENTS)}
    for design in designs:
        count = sum(case.design == design for case in joint.cases)
        columns[f"holds, {design}, {count} cases [%]"] = [100 * joint.share(key, design) for key in STATEMENTS]
    columns["minimum"] = [float(np.nanmin(joint.values(key))) for key in STATEMENTS]
    columns["maximum"] = [float(np.nanmax(joint.values(key))) for key in STATEMENTS]
    columns["worst case"] = [joint.worst(key).describe() for key in STATEMENTS]
    note = (
        "All chosen values are varied together over their ranges: every combination of their ends, and a scrambled "
        "Sobol set (seed 0, uniform). Minimum and maximum of the differences in the units of the table above."
    )
    return Table("hosovsky_release_joint", "Quick release with all chosen values varied together", columns, note)


def claims(joint: JointVariation) -> tuple[Claim, ...]:
    """Return the share of the joint variations for which each claim on Fig. 4 holds, as a case of that claim."""
    result = []
    for key, row in STATEMENTS.items():
        values, worst = joint.values(key), joint.worst(key)
        shares = "; ".join(
            f"{design} {100 * joint.share(key, design):.3g} %"
            for design in dict.fromkeys(c.design for c in joint.cases)
        )
        note = (
            f"Share of {len(joint.cases)} combinations of all chosen values for which it holds: {shares}. Values "
            f"{np.nanmin(values):.3g} to {np.nanmax(values):.3g} {format_unit(row.unit)}".rstrip()
            + f"; worst case: {worst.describe()} ({worst.design})."
        )
        share = dataclasses.replace(row, printed=AtLeast(100.0, derived=True), unit="%")
        result.append(share.claim(PAPER, CASE, 100 * joint.share(key), note))
    return tuple(result)
