"""Working range of a muscle under the conditions of a sizing."""

import numpy as np

from ...core import ParameterError
from ...files.library import Entry
from ...physics.muscle import ElasticSeriesElement
from ...physics.muscle.characteristic import validity_range_of
from .requirement_and_choice import SizingConditions
from .static_muscle import StaticMuscle


def working_muscle(entry: Entry, conditions: SizingConditions) -> StaticMuscle:
    """The static muscle of an entry. Raises ParameterError if it has no working range, with the
    reason.
    """
    valid = validity_range_of(entry.characteristic, entry.validity_range)
    if valid is None:
        raise ParameterError(
            "no validity range is stated for its law, whose errors are therefore unknown"
        )
    if isinstance(entry.series, ElasticSeriesElement):
        raise ParameterError(
            "it has a series spring, of which the sizing does not know the stretch"
        )
    limits = (
        {row.quantity: row for row in entry.ratings.ranges()} if entry.ratings is not None else {}
    )
    rated_pressure = limits.get("pressure")
    rated_contraction = limits.get("contraction")
    if rated_pressure is not None and not conditions.supply <= rated_pressure.high * (1 + 1e-9):
        raise ParameterError(
            f"the supply pressure of {conditions.supply / 1e5:.4g} bar exceeds the permitted "
            f"{rated_pressure.high / 1e5:.4g} bar; reduce it"
        )
    low = max(
        valid.min_pressure,
        conditions.min_pressure,
        rated_pressure.low if rated_pressure else -np.inf,
    )
    high = min(valid.max_pressure, conditions.supply)
    if not low < high:
        raise ParameterError(
            f"its law is valid from {valid.min_pressure / 1e5:.4g} to"
            f" {valid.max_pressure / 1e5:.4g} bar; the working range is"
            f" {conditions.min_pressure / 1e5:.4g} to {conditions.supply / 1e5:.4g} bar"
        )
    ranges = [valid.contraction, entry.characteristic.contraction_range]
    ranges += [entry.geometry.contraction_range] if entry.geometry is not None else []
    ranges += (
        [(rated_contraction.low, rated_contraction.high)] if rated_contraction is not None else []
    )
    contraction = max(r[0] for r in ranges), min(r[1] for r in ranges)
    if not contraction[0] < contraction[1]:
        raise ParameterError("the ranges of contraction of its law and of its maker do not overlap")
    return StaticMuscle(entry, (low, high), contraction)
