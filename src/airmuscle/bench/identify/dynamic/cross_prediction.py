"""Cross-prediction of a joint dynamic fit: each record predicted by the parameters of the others."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

from ....core.errors import AirmuscleError
from ....recording.display_units import displayed
from .result import DynamicFit

OF_RECORD = " of record "
"""Part of the name of an unknown that has a value of its own in every record."""
MAX_RATIO = 3.0
"""Ratio of the cross-predicted to the fitted rms from which the parameters are a description only (chosen)."""


@dataclasses.dataclass(frozen=True)
class CrossPrediction:
    """A record predicted by the common parameters of a fit to the other records, with its own unknowns of the joint
    fit, such as start time and supply pressure: rms errors and rms residuals of the joint fit by quantity [SI]."""

    record: str
    rms: Mapping[str, float]
    fitted: Mapping[str, float]

    @property
    def ratio(self) -> float:
        """Maximum ratio of the rms error to the rms residual of the joint fit."""
        return max(self.rms[name] / max(self.fitted[name], 1e-300) for name in self.rms)

    def __str__(self) -> str:
        parts = ", ".join(
            f"{name} {displayed(name, error, 3)} (joint fit {displayed(name, self.fitted[name], 3)})"
            for name, error in self.rms.items()
        )
        return f"{self.record} predicted by the parameters of the other records: rms error {parts}."


def cross_predict(fit: DynamicFit, refit: Callable[[Sequence[int]], DynamicFit]) -> tuple[CrossPrediction, ...]:
    """Each record of a joint fit, predicted without it; empty for one record or without common parameters.

    refit  the fit to the records of these numbers, from 0, with the same unknowns

    A record without which the others do not give a fit is left out.
    """
    count = len(fit.problem.record_models)
    if count < 2 or all(OF_RECORD in estimate.name for estimate in fit.estimates):
        return ()
    predictions = []
    for i in range(count):
        try:
            part = refit([k for k in range(count) if k != i])
        except AirmuscleError:
            continue
        names = fit.problem.record_models[i].names
        common = {e.name: e for e in part.estimates if OF_RECORD not in e.name}
        estimates = tuple(
            dataclasses.replace(e, value=common[e.name].value) if e.name in common else e for e in fit.estimates
        )
        other = dataclasses.replace(fit, estimates=estimates)
        origin = fit.problem.record_models[i].experiment.recording.origin
        rms, fitted = ({name: each.rms(name, i) for name in names} for each in (other, fit))
        predictions.append(CrossPrediction(origin, rms, fitted))
    return tuple(predictions)


def describe_cross_predictions(predictions: Sequence[CrossPrediction]) -> str:
    """The meaning of the cross-predictions, as a sentence; empty without any."""
    if not predictions:
        return ""
    worst = max(predictions, key=lambda each: each.ratio)
    if worst.ratio <= MAX_RATIO:
        return (
            f"The records predict each other: the maximum rms error is {worst.ratio:.3g} times the residual of the "
            "joint fit."
        )
    return (
        f"The records do not predict each other: the rms error of {worst.record} is {worst.ratio:.3g} times the "
        "residual of the joint fit, so that the parameters describe the records but do not identify the plant."
    )
