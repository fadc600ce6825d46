"""Uncertainty in a muscle file: standard errors and correlations of parameters, and the stated band
of a quantity.
"""

import dataclasses
import math
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np

from ...core import Array, ParameterError, check_field_types, check_known, parameter
from ...recording.columns import QUANTITIES

PREDICTED = ("force", "contraction", "pressure")
"""Quantities that a law may give."""
WIDTHS = ("half_width", "held_half_width", "new_specimen_half_width")
"""The half widths, in the unit of the quantity."""
NOT_NEGATIVE = ("max_contraction_rate", "max_pressure_rate", "new_specimen_slack_force")
"""Further numbers that may be unknown."""


@dataclasses.dataclass(frozen=True)
class StatedBand:
    """The half width [SI] of the 95 % band of a predicted quantity, and the rows or groups that it
    comes from.
    """

    quantity: str
    half_width: float = parameter(
        "1", "h", "half width of the 95 % band for further records of the measured specimens"
    )
    source: str = ""
    held_half_width: float | None = parameter(
        "1", "h", "half width for isometric runs, if it differs", default=None
    )
    specimens: tuple[str, ...] = ()
    """The measured specimens; empty where they are not known."""
    resting_lengths: tuple[float, ...] = parameter(
        "m", "L_0", "their resting lengths, if known", default=()
    )
    new_specimen_half_width: float | None = parameter(
        "1", "h", "half width for other specimens, if known", default=None
    )
    new_specimen_source: str = ""
    """The specimens left out of the fit that it comes from."""
    new_specimen_slack_force: float | None = parameter(
        "N",
        "F_0",
        "greatest force of the law where a specimen left out was slack, if it exceeds the half"
        " width for other specimens",
        default=None,
    )
    max_contraction_rate: float | None = parameter(
        "1/s",
        "deps_max",
        "maximum rate of the contraction in the records of the fit, if known",
        default=None,
    )
    max_pressure_rate: float | None = parameter(
        "Pa/s",
        "dp_max",
        "maximum rate of the pressure in the records of the fit, if known",
        default=None,
    )

    def __post_init__(self) -> None:
        check_field_types(self)
        check_known("StatedBand: quantity is", self.quantity, PREDICTED, "allowed are")
        for name in WIDTHS:
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ParameterError(
                    f"StatedBand: {name} is {value:g}; it must be finite and positive."
                )
        rates = ((name, getattr(self, name)) for name in NOT_NEGATIVE)
        for name, value in (*rates, *(("length", length) for length in self.resting_lengths)):
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(
                    f"StatedBand: {name} is {value:g}; it must be finite and not negative."
                )

    @staticmethod
    def units_of_table(table: Mapping[str, Any]) -> dict[str, str]:
        """The units of the numbers of a table that depend on its quantity."""
        quantity = table.get("quantity")
        return dict.fromkeys(WIDTHS, QUANTITIES[quantity].unit if quantity in PREDICTED else "1")


@dataclasses.dataclass(frozen=True)
class ParameterUncertainty:
    """Standard errors [SI] and correlation matrix of fitted parameters, named by their paths in the
    muscle file.

    A parameter on a bound is not listed. Parameters that were fitted separately have the
    correlation zero.
    """

    parameters: tuple[str, ...]
    standard_errors: tuple[float, ...]
    correlations: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        check_field_types(self)
        count = len(self.parameters)
        rows = [len(row) for row in self.correlations]
        if len(self.standard_errors) != count or rows != [count] * count:
            raise ParameterError(
                f"ParameterUncertainty: {count} parameters have {len(self.standard_errors)}"
                f" standard errors and a correlation matrix with rows of {rows}; give one standard"
                f" error and one row of {count} values each."
            )
        matrix = np.array(self.correlations).reshape(count, count)
        if not (
            np.isfinite(self.standard_errors).all() and (np.array(self.standard_errors) >= 0).all()
        ):
            raise ParameterError(
                "ParameterUncertainty: standard errors must be finite and not negative."
            )
        if not np.allclose(matrix, matrix.T, atol=1e-6) or not np.allclose(
            np.diag(matrix), 1.0, atol=1e-6
        ):
            raise ParameterError(
                "ParameterUncertainty: the correlation matrix must be symmetric with a unit"
                " diagonal."
            )
        if (np.abs(matrix) > 1.0 + 1e-6).any():
            raise ParameterError("ParameterUncertainty: allowed range of a correlation: -1 to 1.")

    @property
    def covariance(self) -> Array:
        """Covariance matrix in the order of the parameters [SI], shape (P, P)."""
        errors = np.array(self.standard_errors)
        return np.asarray(np.array(self.correlations) * np.outer(errors, errors))

    def deviations(self, normal: Array) -> Array:
        """Deviations of the parameters [SI] with this covariance, from independent normal deviates
        (..., P).

        They follow from the root of the correlation matrix: that of the covariance would lose the
        small standard errors, because those in SI units differ by many powers of ten.
        """
        count = len(self.parameters)
        variances, directions = np.linalg.eigh(np.array(self.correlations).reshape(count, count))
        root = directions * np.sqrt(np.maximum(variances, 0.0))
        return np.asarray(normal @ root.T * np.array(self.standard_errors))

    def part(self, kept: Iterable[bool]) -> "ParameterUncertainty | None":
        """The uncertainty of those of the parameters that are kept; None if there are none."""
        places = np.flatnonzero(list(kept)).tolist()
        if not places:
            return None
        names = [self.parameters[i] for i in places]
        errors = [self.standard_errors[i] for i in places]
        correlations = np.array(self.correlations)[np.ix_(places, places)].tolist()
        return ParameterUncertainty(tuple(names), tuple(errors), tuple(map(tuple, correlations)))


def without_parts(
    uncertainty: ParameterUncertainty, parts: Collection[str]
) -> ParameterUncertainty | None:
    """The uncertainty without the parameters of these tables, such as `friction`; None if no
    parameter remains.
    """
    return uncertainty.part(name.partition(".")[0] not in parts for name in uncertainty.parameters)
