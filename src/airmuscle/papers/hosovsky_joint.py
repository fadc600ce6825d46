"""Joint variation of all chosen values of the quick release of Hošovský et al.: corners and a Sobol set."""

import dataclasses
import functools
import itertools
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..design.study import Sobol, Uniform
from ..report import AtLeast, Claim, Table
from ..report.formatting import format_quantity, format_unit
from .hosovsky_fill_and_release import RELEASED_AT, STATEMENTS, agrees, compare_releases, release
from .hosovsky_plant import FORCE_MAPS, PAPER, UnpublishedParameters
from .run import titled

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
    run = functools.cache(release)  # corners share their releases
    nominal = {"low_pressure": parameters.low_pressure, "high_pressure": parameters.high_pressure}

    def case(design: str, values: Sequence[float], data: str) -> JointCase:
        point = parameters
        for name, value in zip(VARIED, values, strict=True):
            point = point.with_value(name, value)
        shared = dataclasses.replace(point, **nominal)
        low, high = (run(shared, pressure.value, data, RELEASED_AT + OBSERVED)
                     for pressure in (point.low_pressure, point.high_pressure))  # fmt: skip
        return JointCase(design, point, compare_releases(low, high))

    ranges = [(getattr(parameters, name).low, getattr(parameters, name).high) for name in VARIED]
    corners = list(itertools.product(*ranges))
    sobol = Sobol(SOBOL_POINTS).values([Uniform(low, high) for low, high in ranges]).tolist()
    cases = [case(f"corners, {data}", point, data) for data in FORCE_MAPS for point in corners]
    return JointVariation((*cases, *(case("Sobol set", point, FORCE_MAPS[0]) for point in sobol)))


def joint_table(joint: JointVariation) -> Table:
    """Return the share of the joint variations for which each statement holds, and its extreme values."""
    counts = Counter(case.design for case in joint.cases)
    columns: dict[str, list[Any]] = {"statement": list(STATEMENTS)}
    for design, count in counts.items():
        columns[f"holds, {design}, {count} cases [%]"] = [100 * joint.share(key, design) for key in STATEMENTS]
    columns["minimum"] = [float(np.nanmin(joint.values(key))) for key in STATEMENTS]
    columns["maximum"] = [float(np.nanmax(joint.values(key))) for key in STATEMENTS]
    columns["worst case"] = [joint.worst(key).describe() for key in STATEMENTS]
    return titled("hosovsky_release_joint", columns)


def claims(joint: JointVariation) -> tuple[Claim, ...]:
    """Return the share of the joint variations for which each claim on Fig. 4 holds, as a case of that claim."""
    result = []
    for key, row in STATEMENTS.items():
        values, worst = joint.values(key), joint.worst(key)
        designs = dict.fromkeys(case.design for case in joint.cases)
        shares = "; ".join(f"{design} {100 * joint.share(key, design):.3g} %" for design in designs)
        note = (
            f"Share of {len(joint.cases)} combinations of all chosen values for which it holds: {shares}. Values "
            f"{np.nanmin(values):.3g} to {np.nanmax(values):.3g} {format_unit(row.unit)}".rstrip()
            + f"; worst case: {worst.describe()} ({worst.design})."
        )
        share = dataclasses.replace(row, printed=AtLeast(100.0, derived=True), unit="%")
        result.append(share.claim(PAPER, CASE, 100 * joint.share(key), note))
    return tuple(result)
