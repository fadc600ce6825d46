"""The procedure of Borzikova et al., for any muscle: measured k become k = k_max (1 - exp v(p, F)).

`linearised` is the paper's way, a spreadsheet's: v is fitted to ln(1 - k/k_max). `nonlinear` is least squares
on k itself. Both work in Chebyshev polynomials on the validity range of the data and hand the coefficients over in bar
and newton.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ...characteristic.borzikova import BorzikovaExponential
from ...core.arrays import Array
from ...core.errors import IdentificationError
from ...recording import Recording
from ..correlation_index import CorrelationIndex, correlation_index
from .basis import Chebyshev, Conditioning, LoadRange


@dataclasses.dataclass(frozen=True)
class SurfaceFit:
    """A fitted exponential surface and its errors over all points, those left out of the fit included."""

    model: BorzikovaExponential
    procedure: str
    points: int
    points_dropped: int
    """Points that the procedure could not use: k >= k_max has no logarithm."""
    rmse: float
    """Root mean square of the errors in contraction [1]."""
    max_error: float
    """The greatest error in contraction [1], without its sign."""
    correlation_index: CorrelationIndex
    conditioning: Conditioning

    def __str__(self) -> str:
        left_out = f", {self.points_dropped} of them not used (k >= k_max)" if self.points_dropped else ""
        return (
            f"{self.procedure}: rms {self.rmse:.4%}, at most {self.max_error:.4%}, {self.correlation_index} over "
            f"{self.points} points{left_out}; {self.conditioning}"
        )


@dataclasses.dataclass(frozen=True, eq=False)
class SurfaceProblem:
    """What is to be fitted: points, degrees and k_max, checked, and the design matrix of v."""

    recording: Recording
    saturation: float
    pressure_degree: int
    force_degree: int
    basis: Chebyshev
    design_matrix: Array
    contraction: Array

    @classmethod
    def from_recording(
        cls, recording: Recording, saturation: float, pressure_degree: int, force_degree: int
    ) -> SurfaceProblem:
        """The problem that a recording poses. Raises IdentificationError where it cannot be solved."""
        _check_usable(recording, pressure_degree, force_degree)
        pressure, force = recording["pressure"], recording["force"]
        basis = Chebyshev(LoadRange.from_recording(recording))
        columns = basis.design_matrix(pressure, force, pressure_degree, force_degree)
        contraction = recording["contraction"]
        problem = cls(recording, saturation, pressure_degree, force_degree, basis, columns, contraction)
        problem.check_determined(columns)
        return problem

    def check_determined(self, columns: Array) -> None:
        """Raise IdentificationError where these rows of the design leave coefficients open."""
        found = Conditioning.from_design_matrix(columns)
        if found.rank < found.coefficients:
            loads = _list_loads(self.recording["force"])
            raise IdentificationError(
                f"{self.recording.origin}: {len(columns)} points under {loads} determine {found.rank} of the "
                f"{found.coefficients} coefficients (degree {self.pressure_degree} in pressure, "
                f"{self.force_degree} in force). Measure at {self.force_degree + 1} loads and "
                f"{self.pressure_degree + 1} pressures at the least, or lower a degree."
            )

    def predict(self, coefficients: Array) -> Array:
        """Contraction at the points, from Chebyshev coefficients of v."""
        return np.asarray(self.saturation * (1.0 - np.exp(self.design_matrix @ coefficients)))

    def jacobian(self, coefficients: Array) -> Array:
        """Exact derivatives of `modelled` by the coefficients, shape (N, coefficients)."""
        return np.asarray(-self.saturation * np.exp(self.design_matrix @ coefficients)[:, None] * self.design_matrix)

    def linear_targets(self) -> tuple[Array, Array]:
        """Targets and weights with which a linear fit of v nearly is one of k; k >= k_max is held below."""
        remaining = np.maximum(1.0 - self.contraction / self.saturation, 0.01)
        return np.log(remaining), remaining

    def build_fit(self, coefficients: Array, procedure: str, dropped: int = 0) -> SurfaceFit:
        """The fit that these Chebyshev coefficients of v are."""
        degrees = (self.pressure_degree, self.force_degree)
        plain = self.basis.to_bar_and_newton(coefficients, *degrees)
        law = BorzikovaExponential(tuple(plain), *self.basis.validity_range, *degrees, saturation=self.saturation)
        modelled = np.asarray(law.contraction(self.recording["pressure"], self.recording["force"]))
        errors = modelled - self.contraction
        return SurfaceFit(
            model=law,
            procedure=procedure,
            points=len(self.recording),
            points_dropped=dropped,
            rmse=float(np.sqrt(np.mean(errors**2))),
            max_error=float(np.abs(errors).max()),
            correlation_index=correlation_index(self.contraction, modelled),
            conditioning=Conditioning.from_design_matrix(self.design_matrix),
        )


def fit_linearised(
    recording: Recording, saturation: float, *, pressure_degree: int = 4, force_degree: int = 2
) -> SurfaceFit:
    """Fit v to ln(1 - k/k_max) by linear least squares, as the paper does.

    `recording` has pressure [Pa], force [N] and contraction [1]; `saturation` is k_max [1]. Points with k >=
    k_max have no logarithm: they are left out, and the fit says how many. Raises IdentificationError.
    """
    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    usable = problem.contraction < saturation
    problem.check_determined(problem.design_matrix[usable])
    targets = np.log(1.0 - problem.contraction[usable] / saturation)
    coefficients = np.linalg.lstsq(problem.design_matrix[usable], targets, rcond=None)[0]
    return problem.build_fit(np.asarray(coefficients, dtype=float), "linearised least squares", int((~usable).sum()))


def fit_nonlinear(
    recording: Recording, saturation: float, *, pressure_degree: int = 4, force_degree: int = 2
) -> SurfaceFit:
    """Fit k itself by least squares, S(A) = Sum (k_i - f(p_i, F_i, A))^2, with exact derivatives.

    `recording` has pressure [Pa], force [N] and contraction [1]; `saturation` is k_max [1]. Every point is
    used, also where k >= k_max. Raises IdentificationError.
    """
    from scipy.optimize import least_squares

    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    targets, weights = problem.linear_targets()
    start = np.linalg.lstsq(weights[:, None] * problem.design_matrix, weights * targets, rcond=None)[0]
    found = least_squares(
        lambda c: problem.predict(c) - problem.contraction,
        start,
        jac=problem.jacobian,
        method="lm",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    if not found.success:
        raise IdentificationError(
            f"{recording.origin}: least squares on k did not converge ({found.message}). "
            "Lower a degree, or ask for the linearised fit."
        )
    return problem.build_fit(np.asarray(found.x), "nonlinear least squares")


def _check_usable(recording: Recording, pressure_degree: int, force_degree: int) -> None:
    """Raise IdentificationError for rows that are no numbers, too few rows, or a validity range without extent."""
    for name in ("pressure", "force", "contraction"):
        bad = np.flatnonzero(~np.isfinite(recording[name]))
        if bad.size:
            raise IdentificationError(
                f"{recording.origin}, row {bad[0] + 1}: {name} is not a finite number. Drop such rows first."
            )
    wanted = (pressure_degree + 1) * (force_degree + 1)
    if len(recording) < wanted:
        raise IdentificationError(
            f"{recording.origin}: {len(recording)} points cannot determine {wanted} coefficients (degree "
            f"{pressure_degree} in pressure, {force_degree} in force). Measure more, or lower a degree."
        )
    for name, unit in (("pressure", "Pa"), ("force", "N")):
        values = recording[name]
        if values.min() == values.max():
            raise IdentificationError(
                f"{recording.origin}: {name} is {values[0]:g} {unit} in every row, so no surface "
                f"over it can be fitted. Measure at {force_degree + 1} loads and {pressure_degree + 1} pressures at "
                "the least."
            )


def _list_loads(forces: Array) -> str:
    loads = np.unique(forces)
    if loads.size > 6:
        return f"{loads.size} loads between {loads[0]:g} and {loads[-1]:g} N"
    return f"{', '.join(f'{load:g}' for load in loads)} N"
