"""Polynomial bases of a surface in pressure and force, and the conditioning of its design matrix in each."""

import abc
import dataclasses
import functools
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from ....core import Array, bar
from ....physics.muscle.characteristic.base import Characteristic
from ....recording import Recording


class LoadRange(NamedTuple):
    """A rectangular range of gauge pressure [Pa] and load [N]."""

    min_pressure: float
    max_pressure: float
    min_force: float
    max_force: float

    @classmethod
    def from_recording(cls, recording: Recording) -> "LoadRange":
        """The smallest range that contains every row."""
        p, f = recording["pressure"], recording["force"]
        return cls(float(p.min()), float(p.max()), float(f.min()), float(f.max()))

    @classmethod
    def from_law(cls, law: Characteristic) -> "LoadRange":
        """The validity range of a law that gives contraction."""
        return cls(*law.pressure_range, *law.force_range)

    def scale(self, pressure: Array, force: Array) -> tuple[Array, Array]:
        """Pressure and force scaled to -1..1 on the range."""
        x = 2 * (pressure - self.min_pressure) / (self.max_pressure - self.min_pressure) - 1
        y = 2 * (force - self.min_force) / (self.max_force - self.min_force) - 1
        return x, y

    def grid(self, pressures: int, forces: int) -> tuple[Array, Array]:
        """Evenly spaced points over the range, edges included, as two arrays of shape (pressures, forces)."""
        p = np.linspace(self.min_pressure, self.max_pressure, pressures)
        f = np.linspace(self.min_force, self.max_force, forces)
        return np.broadcast_to(p[:, None], (pressures, forces)), np.broadcast_to(f, (pressures, forces))


class Basis(abc.ABC):
    """Basis functions of a surface in pressure and force."""

    @abc.abstractmethod
    def design_matrix(self, pressure: Array, force: Array, pressure_degree: int, force_degree: int) -> Array:
        """Their values at N points [Pa, N], one column each, ordered by degree in pressure, then in force."""


@dataclasses.dataclass(frozen=True)
class Monomials(Basis):
    """p^i F^j, with pressure and force in multiples of the given units [Pa, N]."""

    pressure_unit: float = 1.0
    force_unit: float = 1.0

    def design_matrix(self, pressure: Array, force: Array, pressure_degree: int, force_degree: int) -> Array:
        degrees = [pressure_degree, force_degree]
        return np.asarray(polynomial.polyvander2d(pressure / self.pressure_unit, force / self.force_unit, degrees))


@dataclasses.dataclass(frozen=True)
class Chebyshev(Basis):
    """T_i(x) T_j(y), with x and y scaled to -1..1 on the validity range, where they are nearly orthogonal."""

    validity_range: LoadRange

    def design_matrix(self, pressure: Array, force: Array, pressure_degree: int, force_degree: int) -> Array:
        x, y = self.validity_range.scale(pressure, force)
        return np.asarray(chebyshev.chebvander2d(x, y, [pressure_degree, force_degree]))

    def to_bar_and_newton(self, coefficients: Array, pressure_degree: int, force_degree: int) -> Array:
        """The coefficients of p^i F^j in bar and newton of the same surface, in the same order."""
        limits = self.validity_range
        by_pressure = _chebyshev_to_monomials(limits.min_pressure / bar, limits.max_pressure / bar, pressure_degree)
        by_force = _chebyshev_to_monomials(limits.min_force, limits.max_force, force_degree)
        table = coefficients.reshape(pressure_degree + 1, force_degree + 1)
        return (by_pressure @ table @ by_force.T).ravel()


@functools.lru_cache(maxsize=64)  # a bootstrap refits the same validity range a thousand times
def _chebyshev_to_monomials(low: float, high: float, degree: int) -> Array:
    """Column i holds the coefficients of T_i, scaled to low..high, in powers of the unscaled variable."""
    powers = np.zeros((degree + 1, degree + 1))
    for i in range(degree + 1):
        scaled = chebyshev.Chebyshev.basis(i, domain=[low, high]).convert(kind=polynomial.Polynomial)
        powers[: i + 1, i] = scaled.convert(domain=[-1.0, 1.0]).coef[: i + 1]
    powers.setflags(write=False)
    return powers


@dataclasses.dataclass(frozen=True)
class Conditioning:
    """Rank, number of coefficients and condition number of a design matrix."""

    rank: int
    coefficients: int
    condition: float
    """Ratio of the largest to the smallest singular value; infinite for a rank-deficient matrix."""

    @classmethod
    def from_design_matrix(cls, matrix: Array) -> "Conditioning":
        """Of a design matrix (N, coefficients), exact also beyond 1e16, where singular values are lost in rounding.

        The pseudo-inverse is computed with columns of unit norm, and its rows are scaled back by the norms.
        """
        norms = np.linalg.norm(matrix, axis=0)
        normalised = matrix / np.where(norms > 0, norms, 1.0)
        rank, size = int(np.linalg.matrix_rank(normalised)), matrix.shape[1]
        if rank < size:
            return cls(rank, size, np.inf)
        inverse = np.linalg.pinv(normalised) / norms[:, None]
        return cls(rank, size, float(np.linalg.norm(matrix, 2) * np.linalg.norm(inverse, 2)))

    def __str__(self) -> str:
        return f"rank {self.rank} of {self.coefficients}, condition number {self.condition:.2g}"


def conditioning(recording: Recording, basis: Basis, pressure_degree: int = 4, force_degree: int = 2) -> Conditioning:
    """The conditioning of the design matrix of a surface at the points of a recording."""
    matrix = basis.design_matrix(recording["pressure"], recording["force"], pressure_degree, force_degree)
    return Conditioning.from_design_matrix(matrix)
