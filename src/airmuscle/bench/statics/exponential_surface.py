"""Fit of the exponential surface k = k_max (1 - exp v(p, F)) by the procedure of Borzíková et al.,
for any muscle, with the polynomial bases of v and the conditioning of its design matrix in each.

`fit_linearised` is the method of the paper: v is fitted to ln(1 - k/k_max). `fit_nonlinear` is
least squares in k itself. Both use Chebyshev polynomials on the validity range of the data and
return the coefficients in bar and newton.
"""

import dataclasses
import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from ...core import Array, IdentificationError, bar
from ...physics.muscle.characteristic.base import Characteristic
from ...physics.muscle.characteristic.borzikova import BorzikovaExponential
from ...recording import Recording
from ..estimation import (
    CorrelationIndex,
    FreeParameter,
    LeastSquares,
    MeasuredProblem,
    SolvedProblem,
    correlation_index,
    solve_iteratively,
)
from ..inspection import distinct_readings, rounding

UNBOUNDED = (-np.inf, np.inf)


class LoadRange(NamedTuple):
    """A rectangular range of gauge pressure [Pa] and load [N]."""

    min_pressure: float
    max_pressure: float
    min_force: float
    max_force: float

    @classmethod
    def from_recording(cls, recording: Recording) -> "LoadRange":
        """The smallest range that contains every row."""
        p = recording["pressure"]
        f = recording["force"]
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
        """Evenly spaced points over the range, edges included, as two arrays of shape (pressures,
        forces).
        """
        p = np.linspace(self.min_pressure, self.max_pressure, pressures)
        f = np.linspace(self.min_force, self.max_force, forces)
        return np.broadcast_to(p[:, None], (pressures, forces)), np.broadcast_to(
            f, (pressures, forces)
        )


@dataclasses.dataclass(frozen=True)
class Monomials:
    """p^i F^j, with pressure and force in multiples of the given units [Pa, N]."""

    pressure_unit: float = 1.0
    force_unit: float = 1.0

    def design_matrix(
        self, pressure: Array, force: Array, pressure_degree: int, force_degree: int
    ) -> Array:
        """The terms at N points [Pa, N], one column each, ordered by degree in pressure, then in
        force.
        """
        degrees = [pressure_degree, force_degree]
        return np.asarray(
            polynomial.polyvander2d(pressure / self.pressure_unit, force / self.force_unit, degrees)
        )


@dataclasses.dataclass(frozen=True)
class Chebyshev:
    """T_i(x) T_j(y), with x and y scaled to -1..1 on the validity range, where they are nearly
    orthogonal.
    """

    validity_range: LoadRange

    def design_matrix(
        self, pressure: Array, force: Array, pressure_degree: int, force_degree: int
    ) -> Array:
        """The terms at N points [Pa, N], in the order of those of `Monomials`."""
        x, y = self.validity_range.scale(pressure, force)
        return np.asarray(chebyshev.chebvander2d(x, y, [pressure_degree, force_degree]))

    def to_bar_and_newton(
        self, coefficients: Array, pressure_degree: int, force_degree: int
    ) -> Array:
        """The coefficients of p^i F^j in bar and newton of the same surface, in the same order."""
        limits = self.validity_range
        by_pressure = _chebyshev_to_monomials(
            limits.min_pressure / bar, limits.max_pressure / bar, pressure_degree
        )
        by_force = _chebyshev_to_monomials(limits.min_force, limits.max_force, force_degree)
        table = coefficients.reshape(pressure_degree + 1, force_degree + 1)
        return (by_pressure @ table @ by_force.T).ravel()


@functools.lru_cache(maxsize=64)  # a bootstrap refits the same validity range a thousand times
def _chebyshev_to_monomials(low: float, high: float, degree: int) -> Array:
    """Column i holds the coefficients of T_i, scaled to low..high, in powers of the unscaled
    variable.
    """
    powers = np.zeros((degree + 1, degree + 1))
    for i in range(degree + 1):
        scaled = chebyshev.Chebyshev.basis(i, domain=[low, high]).convert(
            kind=polynomial.Polynomial
        )
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
        """Of a design matrix (N, coefficients), exact also beyond 1e16, where singular values are
        lost in rounding. The pseudo-inverse is computed with columns of unit norm, and its rows are
        scaled back by the norms.
        """
        norms = np.linalg.norm(matrix, axis=0)
        normalised = matrix / np.where(norms > 0, norms, 1.0)
        rank = int(np.linalg.matrix_rank(normalised))
        size = matrix.shape[1]
        if rank < size:
            return cls(rank, size, np.inf)
        inverse = np.linalg.pinv(normalised) / norms[:, None]
        return cls(rank, size, float(np.linalg.norm(matrix, 2) * np.linalg.norm(inverse, 2)))

    def __str__(self) -> str:
        return f"rank {self.rank} of {self.coefficients}, condition number {self.condition:.2g}"


def conditioning(
    recording: Recording,
    basis: Monomials | Chebyshev,
    pressure_degree: int = 4,
    force_degree: int = 2,
) -> Conditioning:
    """The conditioning of the design matrix of a surface at the points of a recording."""
    points = recording["pressure"], recording["force"]
    return Conditioning.from_design_matrix(
        basis.design_matrix(*points, pressure_degree, force_degree)
    )


@dataclasses.dataclass(frozen=True)
class SurfaceFit:
    """A fitted exponential surface and its errors over all points, including those that the fit
    could not use.
    """

    model: BorzikovaExponential
    procedure: str
    points: int
    points_dropped: int
    """Points that the procedure cannot use: k >= k_max has no logarithm."""
    rmse: float
    """Root mean square error in contraction [1]."""
    max_error: float
    """Maximum absolute error in contraction [1]."""
    correlation_index: CorrelationIndex
    conditioning: Conditioning
    solved: SolvedProblem
    """The problem with the Chebyshev coefficients of v: covariance, profiles, bootstrap."""

    def __str__(self) -> str:
        dropped = (
            f", {self.points_dropped} of them not used (k >= k_max)" if self.points_dropped else ""
        )
        return (
            f"{self.procedure}: rms error {100 * self.rmse:.4f} %, maximum error"
            f" {100 * self.max_error:.4f} %, correlation index {self.correlation_index} over"
            f" {self.points} points{dropped}; {self.conditioning}"
        )


@dataclasses.dataclass(frozen=True, eq=False)
class SurfaceProblem(MeasuredProblem):
    """Validated data, degrees and k_max of a surface fit, and the design matrix of v; the
    parameters are the Chebyshev coefficients of v.
    """

    recording: Recording
    saturation: float
    pressure_degree: int
    force_degree: int
    basis: Chebyshev
    terms: Array
    """Design matrix of v at the points, shape (N, coefficients)."""
    target: Array
    """Measured contraction [1], shape (N,)."""
    name = "exponential surface"
    quantity = "contraction"

    @property
    def origin(self) -> str:
        return self.recording.origin

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        initial = np.linalg.lstsq(*self.linear_system(), rcond=None)[0].tolist()
        names = [f"v[{i}]" for i in range(len(initial))]
        return tuple(
            FreeParameter(name, name, value, UNBOUNDED, "1", "coefficient of v")
            for name, value in zip(names, initial, strict=True)
        )

    @classmethod
    def from_recording(
        cls, recording: Recording, saturation: float, pressure_degree: int, force_degree: int
    ) -> "SurfaceProblem":
        """The problem for the points of a recording. Raises IdentificationError for non-finite
        values, too few rows, or a pressure or force that does not vary."""
        for name in ("pressure", "force", "contraction"):
            bad = np.flatnonzero(~np.isfinite(recording[name]))
            if bad.size:
                raise IdentificationError(
                    f"{recording.origin}, row {bad[0] + 1}: {name} is not a finite number. Remove"
                    " such rows first."
                )
        required = (pressure_degree + 1) * (force_degree + 1)
        if len(recording) < required:
            raise IdentificationError(
                f"{recording.origin}: {len(recording)} points cannot determine {required}"
                f" coefficients (degree {pressure_degree} in pressure, {force_degree} in force)."
                " Measure more points, or choose a lower degree."
            )
        for name, unit in (("pressure", "Pa"), ("force", "N")):
            values = recording[name]
            if float(np.ptp(values)) <= rounding(name, values):
                raise IdentificationError(
                    f"{recording.origin}: {name} is {values[0]:g} {unit} in every row, so a surface"
                    f" cannot be fitted. Measure at {force_degree + 1} or more loads and"
                    f" {pressure_degree + 1} or more pressures."
                )
        basis = Chebyshev(LoadRange.from_recording(recording))
        matrix = basis.design_matrix(
            recording["pressure"], recording["force"], pressure_degree, force_degree
        )
        problem = cls(
            recording,
            saturation,
            pressure_degree,
            force_degree,
            basis,
            matrix,
            recording["contraction"],
        )
        problem.check_determined(matrix)
        return problem

    def check_determined(self, rows: Array) -> None:
        """Raise IdentificationError where these rows of the design matrix do not determine all
        coefficients.
        """
        conditioning = Conditioning.from_design_matrix(rows)
        if conditioning.rank < conditioning.coefficients:
            levels = distinct_readings(self.recording["force"])
            loads = f"{', '.join(f'{load:g}' for load in levels)} N"
            loads = (
                loads
                if levels.size <= 6
                else f"{levels[0]:g} to {levels[-1]:g} N ({levels.size} levels)"
            )
            raise IdentificationError(
                f"{self.recording.origin}: {len(rows)} points at loads of {loads} determine"
                f" {conditioning.rank} of the {conditioning.coefficients} coefficients (degree"
                f" {self.pressure_degree} in pressure, {self.force_degree} in force). Measure at"
                f" {self.force_degree + 1} or more loads and {self.pressure_degree + 1} or more"
                " pressures, or choose a lower degree."
            )

    def predict(self, values: Array) -> Array:
        """Modelled contraction [1] at the points, shape (N,)."""
        return np.asarray(self.saturation * (1.0 - np.exp(self.terms @ values)))

    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        """Exact derivatives of `predict`, shape (N, coefficients)."""
        every = -self.saturation * np.exp(self.terms @ values)[:, None] * self.terms
        return np.asarray(every if which is None else every[:, list(which)])

    def linear_system(self) -> tuple[Array, Array]:
        """Matrix and right side of a linear fit of v that approximates a fit of k; 1 - k/k_max is
        limited to 0.01.
        """
        weights = np.maximum(1.0 - self.target / self.saturation, 0.01)
        return weights[:, None] * self.terms, weights * np.log(weights)

    def build_fit(self, coefficients: Array, procedure: str, dropped: int = 0) -> SurfaceFit:
        """The fit with these Chebyshev coefficients of v."""
        degrees = (self.pressure_degree, self.force_degree)
        plain = self.basis.to_bar_and_newton(coefficients, *degrees)
        law = BorzikovaExponential(
            tuple(plain), *self.basis.validity_range, *degrees, saturation=self.saturation
        )
        modelled = np.asarray(law.contraction(self.recording["pressure"], self.recording["force"]))
        residuals = modelled - self.target
        rmse = float(np.sqrt(np.mean(residuals**2)))
        max_error = float(np.abs(residuals).max())
        index = correlation_index(self.target, modelled)
        conditioning = Conditioning.from_design_matrix(self.terms)
        return SurfaceFit(
            law,
            procedure,
            len(self.recording),
            dropped,
            rmse,
            max_error,
            index,
            conditioning,
            SolvedProblem(self, coefficients),
        )


def fit_linearised(
    recording: Recording, saturation: float, *, pressure_degree: int = 4, force_degree: int = 2
) -> SurfaceFit:
    """Fit v to ln(1 - k/k_max) by linear least squares, as in the paper. `recording` has pressure
    [Pa], force [N] and contraction [1]; `saturation` is k_max [1]. Points with k >= k_max have no
    logarithm; they are omitted, and the result states their number. Raises IdentificationError."""
    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    usable = problem.target < saturation
    problem.check_determined(problem.terms[usable])
    targets = np.log(1.0 - problem.target[usable] / saturation)
    coefficients = np.linalg.lstsq(problem.terms[usable], targets, rcond=None)[0]
    return problem.build_fit(
        np.asarray(coefficients, dtype=float), "linearised least squares", int((~usable).sum())
    )


def fit_nonlinear(
    recording: Recording, saturation: float, *, pressure_degree: int = 4, force_degree: int = 2
) -> SurfaceFit:
    """Fit k itself by nonlinear least squares, S(A) = Sum (k_i - f(p_i, F_i, A))^2, with exact
    derivatives. The arguments are those of `fit_linearised`. All points are used, also those with k
    >= k_max. Raises IdentificationError."""
    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    solution = solve_iteratively(problem, LeastSquares(), problem.initial_values)
    return problem.build_fit(solution.values, "nonlinear least squares")
