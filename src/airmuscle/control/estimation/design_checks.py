"""Checks of the names and numbers that a controller design is given."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ...core.errors import ParameterError, suggestion

DISTURBANCE = ".disturbance"
"""End of the name of an estimated disturbance, after that of its state."""


def check_known(owner: str, argument: str, names: Iterable[str], known: Sequence[str]) -> None:
    """Raise ParameterError, with the nearest name, for a name that is not known."""
    for name in names:
        if name not in known:
            raise ParameterError(
                f"{owner}: {argument} names '{name}'; there are {', '.join(known)}.{suggestion(name, known)}"
            )


def check_numbers(
    owner: str, argument: str, given: Mapping[str, float], known: Sequence[str], needed: Sequence[str]
) -> None:
    """Raise ParameterError for an unknown name, a number that is not positive and finite, or a missing number."""
    check_known(owner, argument, given, known)
    for name, value in given.items():
        if not 0 < value < float("inf"):
            raise ParameterError(f"{owner}: {argument} of '{name}' is {value!r}; it must be positive and finite.")
    for name in needed:
        if name not in given:
            raise ParameterError(f"{owner}: {argument} has no number for '{name}'; give one.")


def check_sample_time(owner: str, sample_time: float, of_estimator: float) -> None:
    """Raise ParameterError where the sample time of the loop [s] is not that of the estimator [s]."""
    if abs(sample_time - of_estimator) > 1e-9 * sample_time:
        raise ParameterError(
            f"{owner}: the sample time of the loop is {sample_time:g} s and that of the estimator {of_estimator:g} s; "
            "they must be equal."
        )
