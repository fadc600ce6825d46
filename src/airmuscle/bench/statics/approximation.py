"""Approximation of one characteristic by another in least squares, and its error."""

import dataclasses
import itertools
from typing import Any

import numpy as np

from ...core import IdentificationError, SolveError, contraction_text, quantity_text
from ...physics.muscle.characteristic import Characteristic, ValidityRange, values_or_nan
from ...physics.muscle.characteristic.sampling import check_approximates, sample_force
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Table, TableColumn
from ...report.parameter_tables import parameter_table
from ..estimation import UNCENSORED
from ..inspection import POINT_COLUMNS
from ..reported import Reported
from .goodness import WorstPoint
from .static_fit import fit

BANDS = 6
"""Pressure intervals of the validity range for which errors are stated (chosen)."""
GRID_POINTS = 24
"""Grid points in pressure and in contraction for the fit; the error is evaluated on a grid with one
more of each.
"""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ModelApproximation(Reported):
    """The fitted target model, and its error in force over the validity range."""

    model: Characteristic
    rmse: float
    """Root mean square error [N], at points between those of the fit."""
    max_error: WorstPoint
    """The error of maximum magnitude [N], target minus source."""
    check_points: Recording
    """The points where the error was evaluated: force of the source law [N], and `error` of the
    target [N].
    """

    validity_range: ValidityRange
    """The range of the approximation."""

    @property
    def summary(self) -> str:
        """The errors in one phrase."""
        worst = self.max_error
        errors = f"{type(self.model).__name__}: rms error {self.rmse:.4g} N"
        at = f"{worst.pressure / 1e3:.4g} kPa and {100 * worst.contraction:.2f} %"
        return f"{errors}, maximum error {worst.error:.4g} N at {at}"

    def chapter(self) -> Chapter:
        """The description of the approximation: its errors, also in intervals of pressure, and its
        parameters.
        """
        limits = self.validity_range
        model = type(self.model).__name__
        return Chapter(
            "approximation",
            f"{model} over {quantity_text(limits.min_pressure, 'Pa', 'kPa')} to"
            f" {quantity_text(limits.max_pressure, 'Pa', 'kPa')} and"
            f" {contraction_text(limits.min_contraction)} to"
            f" {contraction_text(limits.max_contraction)}",
            f"{self.summary}.",
            values=(
                NamedValue("model", model, brief=False),
                NamedValue("pressure range", limits.pressure, "Pa", "kPa", brief=False),
                NamedValue("contraction range", limits.contraction, "1", "%", brief=False),
                NamedValue("rms error", self.rmse, "N", brief=False),
                NamedValue("maximum error", self.max_error.error, "N", brief=False),
                NamedValue(
                    "pressure of the maximum error",
                    self.max_error.pressure,
                    "Pa",
                    "kPa",
                    brief=False,
                ),
                NamedValue(
                    "contraction of the maximum error",
                    self.max_error.contraction,
                    "1",
                    "%",
                    brief=False,
                ),
            ),
            tables=(
                self._band_table(),
                parameter_table(self.model, "parameters", f"Parameters of {model}"),
            ),
        )

    def _band_table(self) -> Table:
        """The errors in intervals of pressure; the maximum force is that of the original."""
        points = self.check_points
        bands = []
        for low, high in itertools.pairwise(
            np.linspace(*self.validity_range.pressure, BANDS + 1).tolist()
        ):
            inside = points.rows((points["pressure"] >= low) & (points["pressure"] <= high))
            if len(inside):
                bands.append(((low, high), inside["error"], inside["force"]))
        columns: dict[str, Any] = {
            "pressure": TableColumn([limits for limits, _, _ in bands], "Pa", "kPa"),
            "rms error": TableColumn(
                [float(np.sqrt(np.mean(error**2))) for _, error, _ in bands], "N"
            ),
            "maximum error": TableColumn(
                [float(np.abs(error).max()) for _, error, _ in bands], "N"
            ),
            "maximum force": TableColumn([float(force.max()) for _, _, force in bands], "N"),
        }
        return Table("bands", "Errors by pressure", columns, brief=len(bands))


def approximate(
    law: Characteristic, other: Characteristic, validity_range: ValidityRange
) -> ModelApproximation:
    """Approximate `law` by the model of `other` on a validity range, by least squares in force.

    `other` gives the structure and the initial values, as in `fit`. Only points where `law` gives a
    positive force are used. Raises IdentificationError where the validity range does not determine
    the parameters of `other`, SolveError where `law` gives no positive force on it or an infinite
    one, and for a result that does not approximate it.
    """
    data = sample_on_grid(law, validity_range, GRID_POINTS)
    target = other
    most = float(data["force"].max())
    if getattr(target, "max_force", np.inf) <= most:
        target = dataclasses.replace(target, max_force=2.0 * most)  # type: ignore[type-var]
    model = fit(target, data, censoring=UNCENSORED).model
    check_points = sample_on_grid(law, validity_range, GRID_POINTS + 1)
    predicted = values_or_nan(model.force, check_points["pressure"], check_points["contraction"])
    difference = predicted - check_points["force"]
    missing = np.flatnonzero(~np.isfinite(difference))
    if missing.size:
        p = check_points["pressure"][missing[0]]
        c = check_points["contraction"][missing[0]]
        raise IdentificationError(
            f"the fitted {type(other).__name__} has no force at {missing.size} of"
            f" {len(check_points)} points where {type(law).__name__} has one, the first at"
            f" {p / 1e3:.4g} kPa and {100 * c:.2f} %. Choose a smaller validity range."
        )
    check_approximates(
        "approximate", f"the fitted {type(other).__name__}", difference, check_points["force"]
    )
    worst = int(np.argmax(np.abs(difference)))
    rmse = float(np.sqrt(np.mean(difference**2)))
    point = WorstPoint(
        float(difference[worst]), *(float(check_points[name][worst]) for name in POINT_COLUMNS)
    )
    return ModelApproximation(
        model, rmse, point, check_points.with_columns(error=difference), validity_range
    )


def sample_on_grid(law: Characteristic, validity_range: ValidityRange, count: int) -> Recording:
    """The forces of a law on a Chebyshev-Lobatto grid of the validity range, `count` points in each
    direction. Points without a positive force are omitted. Raises SolveError where no point is
    left, and where the force is infinite."""
    nodes = (1 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2
    p_low, p_high = validity_range.pressure
    c_low, c_high = validity_range.contraction
    pressure, contraction = np.meshgrid(
        p_low + (p_high - p_low) * nodes, c_low + (c_high - c_low) * nodes
    )
    p = pressure.ravel()
    c = contraction.ravel()
    force = sample_force("approximate", law, validity_range, p, c)
    pulls = force > 0
    if not pulls.any():
        raise SolveError(
            f"{type(law).__name__} gives no positive force on the validity range, so it cannot be"
            " converted. Choose another validity range."
        )
    return Recording(
        {"pressure": p[pulls], "contraction": c[pulls], "force": force[pulls]}, type(law).__name__
    )
