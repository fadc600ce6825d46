"""Loss functions of a fit: squared, Huber and soft L1."""

from __future__ import annotations

import abc
import dataclasses

import numpy as np

from ...core.annotation import check_field_types
from ...core.arrays import Array
from ...core.errors import ParameterError

ROBUST_LIMIT = 6.0
"""Limit of the residuals in the errors of a robust fit, in robust standard deviations (chosen)."""


class Loss(abc.ABC):
    """A function rho of the squared scaled residuals; a fit minimises the sum of scale^2 rho((residual/scale)^2)."""

    scale: float

    def limit(self, residuals: Array) -> float:
        """The magnitude to which residuals (N,) are limited in errors of a robust fit; infinite for least squares.

        It is six robust standard deviations, 1.4826 times the median magnitude, and at least `scale` (chosen).
        """
        return max(self.scale, ROBUST_LIMIT * 1.4826 * float(np.median(np.abs(residuals))))

    @abc.abstractmethod
    def rho(self, z: Array) -> Array:
        """rho(z) and its first and second derivative, shape (3, N), for z = (residual/scale)^2 >= 0, shape (N,)."""


@dataclasses.dataclass(frozen=True)
class LeastSquares(Loss):
    """rho = z: ordinary least squares."""

    scale: float = 1.0

    def __post_init__(self) -> None:
        check_field_types(self)

    def limit(self, residuals: Array) -> float:
        return np.inf

    def rho(self, z: Array) -> Array:
        return np.stack([z, np.ones_like(z), np.zeros_like(z)])


@dataclasses.dataclass(frozen=True)
class Huber(Loss):
    """rho = z for z <= 1, 2 sqrt(z) - 1 beyond: residuals above `scale` contribute linearly.

    `scale` has the unit of the fitted quantity [SI].
    Reference: Huber, P. J. (1964), "Robust estimation of a location parameter", Annals of Mathematical Statistics.
    """

    scale: float

    def __post_init__(self) -> None:
        check_field_types(self)
        _check_scale(self)

    def rho(self, z: Array) -> Array:
        root = np.sqrt(np.maximum(z, 1.0))
        inside = z <= 1.0
        return np.stack([np.where(inside, z, 2 * root - 1), 1 / root, np.where(inside, 0.0, -0.5 / root**3)])


@dataclasses.dataclass(frozen=True)
class SoftL1(Loss):
    """rho = 2 (sqrt(1 + z) - 1): a smooth transition from squared to absolute residuals at `scale` [SI]."""

    scale: float

    def __post_init__(self) -> None:
        check_field_types(self)
        _check_scale(self)

    def rho(self, z: Array) -> Array:
        root = np.sqrt(1.0 + z)
        return np.stack([2 * (root - 1), 1 / root, -0.5 / root**3])


def _check_scale(loss: Loss) -> None:
    if not 0 < loss.scale < np.inf:
        raise ParameterError(
            f"{type(loss).__name__}.scale is {loss.scale!r}; it must be positive and finite, in the unit of the fitted "
            "quantity. Use about three times the standard deviation of the noise."
        )
