"""Exact meridian of a straight-fibre muscle with rubber wall, the reference for the assumed
meridians.
"""

import functools
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ....core import Array, Reference, Value, model, parameter
from ..geometry.base import Profile, check_contraction_range
from ..geometry.meridian import SAGA_2007, CircularArc
from ..geometry.straight_fibre import DAERDEN_LEFEBER_2001, PleatedTube, unwrap_scalar
from .base import PressureLaw
from .calls import Slopes
from .rubber import RubberLaw, RubberLine
from .solve import as_arrays, check_numbers, check_solution, find_first_root

NODES = 120  # Gauss points over half the meridian
_MAX_ITERATIONS = 60
_LOAD_STEPS = (
    1.0,
    0.7,
    0.5,
    0.35,
    0.25,
    0.18,
    0.12,
    0.08,
    0.05,
    0.03,
    0.02,
    0.01,
    0.005,
    0.002,
    0.0,
)
_LENGTH_TOLERANCE = 1e-13
"""Tolerance of the arc and chord lengths relative to the fibre length."""


class MeridianShape(NamedTuple):
    """Shape of a segment: its three parameters, and the resulting lengths with their
    derivatives.
    """

    radius: Any
    """Maximum radius R [m]."""
    pressure: Any
    """Gauge pressure [Pa]."""
    force: Any
    """Tension [N]."""
    lengths: Any
    """Arc and chord length [m], shape (2, ...); NaN if the shape does not exist."""
    jacobian: Any
    """Derivatives of the lengths with respect to radius, pressure and force, shape (2, 3, ...)."""


class _Curve(NamedTuple):
    """Meridian over v, symbols as in `ExactMeridian`: r [m], the rubber term R + r - z [m], z [m],
    C [m2], n [m2], and the integrand factor 4 sqrt(R - r_0)/sqrt(z (n + C)) [1/m], NaN if the shape
    does not exist."""

    radius: Any
    rubber_term: Any
    z: Any
    axial: Any
    fibre: Any
    factor: Any


@functools.cache
def graded_quadrature(nodes: int) -> tuple[Array, Array]:
    """Nodes v and weights, shape (nodes,) each, for integrals over 0 <= v <= 1 with a factor like
    1/sqrt(1 - v).

    The nodes are Gauss points y in v = y (2 - y), so that 1 - v = (1 - y)^2 removes the singularity
    at v = 1. The integral is sum(weights f(nodes)).
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    y = (points + 1) / 2
    return y * (2 - y), weights * (1 - y)


@model
class ExactMeridian(RubberLaw, PressureLaw):
    """Exact meridian: N cos(phi) = F + pi p r^2,   dN/dr = 2 pi t sigma(r).

    N: fibre tension; phi: slope angle; r: radius. With r = R - (R - r_0) v^2, C = F/(pi p) + r^2,
    z = R + r - (2 t/p)(alpha (R + r - 2 r_0)/(2 r_0) + beta), n = C + (R - r) z, per segment:
        l_0 = 4 sqrt(R - r_0) Int_0^1 n/sqrt(z (n + C)) dv,   l = 4 sqrt(R - r_0) Int_0^1 C/sqrt(z
            (n + C)) dv.
    R: maximum radius; r_0: end radius; t: wall thickness; sigma = alpha (r - r_0)/r_0 + beta: hoop
    stress. The two unknowns (R and p, or R and F) are computed by Newton's method. If z is not
    positive, the tube would contract below r_0, where the rubber line is not defined, and there is
    no solution. Reference: Saga et al. 2007 for the muscle; equations derived for airmuscle.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007, DAERDEN_LEFEBER_2001)
    traceable: ClassVar[bool] = False
    refuses_beyond: ClassVar[bool] = True

    geometry: PleatedTube
    rubber: RubberLine
    wall_thickness: float = parameter("m", "t", "wall thickness at rest", bounds=(0.0, 0.1))

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From 0.01 %, where the fibres are nearly straight, to the maximum volume."""
        return (1e-4, self.geometry.free_contraction * (1.0 - 1e-6))

    def pressure(self, contraction: Value, force: Value) -> Value:
        solution = self._shape_or_raise(contraction, force).pressure
        return check_solution(
            solution, self.pressure_range, (contraction, force), self._no_pressure_message
        )

    def force(self, pressure: Value, contraction: Value) -> Value:
        solution = self.shape_at_pressure(pressure, contraction).force
        return check_solution(
            solution, (-np.inf, np.inf), (pressure, contraction), self._no_shape_message
        )

    def contraction(self, pressure: Value, force: Value) -> Value:
        """Contraction [1] on the stable branch reached from rest, searched over the radius, in
        which it is unique.
        """
        tube = self.geometry

        def residual(radius: Value, p: Value, load: Value) -> Value:
            return self._evaluate_shape(radius, p, load).lengths[0] / tube.fibre_length - 1.0

        check_numbers(pressure, force)
        self.check_threshold(pressure, force)
        radii = (
            tube.end_radius * (1 + 1e-9),
            float(tube.segment(tube.free_contraction).max_radius),
        )
        r = find_first_root(
            residual, radii, (pressure, force), lambda p, f, *_: self._no_contraction_message(p, f)
        )
        contraction = 1.0 - self._evaluate_shape(r, pressure, force).lengths[1] / tube.fibre_length
        return float(contraction) if np.ndim(r) == 0 else contraction

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        """Partial derivatives by the implicit function theorem from the derivatives of the two
        lengths.
        """
        arc, chord = self.shape_at_pressure(pressure, contraction).jacobian
        determinant = arc[0] * chord[2] - arc[2] * chord[0]
        by_pressure = -(arc[0] * chord[1] - arc[1] * chord[0]) / determinant
        by_contraction = -self.geometry.fibre_length * arc[0] / determinant
        return Slopes(by_pressure, by_contraction)

    def shape_at_force(self, contraction: Value, force: Value) -> MeridianShape:
        """Shape in equilibrium with a tension [N] at a contraction [1]; its pressure is NaN if
        there is no solution.
        """
        check_contraction_range(contraction, self.contraction_range, "ExactMeridian")
        c, load = as_arrays(contraction, force)
        radius, area, rubber = self._circle_estimate(c)
        start = np.maximum((load + rubber) / area, 1.05 * self._min_pressure(radius))
        shape = self._solve_shape(c, MeridianShape(radius, start, load, None, None), unknown=1)
        failed = np.isnan(shape.pressure)
        if failed.any():  # by continuation from a larger load, which is reduced step by step
            c = c[failed]
            target = load[failed]
            extra = (start * area)[failed]
            radius, area, rubber = self._circle_estimate(c)
            other = MeridianShape(radius, (target + extra + rubber) / area, target, None, None)
            for fraction in _LOAD_STEPS:
                other = self._solve_shape(
                    c, other._replace(force=target + fraction * extra), unknown=1
                )
            for values, solved in zip(shape, other, strict=True):
                values[..., failed] = solved
        return MeridianShape(*map(unwrap_scalar, shape))

    def shape_at_pressure(self, pressure: Value, contraction: Value) -> MeridianShape:
        """Shape at a pressure [Pa] and a contraction [1]; its force is NaN if there is no
        solution.
        """
        check_contraction_range(contraction, self.contraction_range, "ExactMeridian")
        p, c = as_arrays(pressure, contraction)
        radius, area, rubber = self._circle_estimate(c)
        start = MeridianShape(radius, p, p * area - rubber, None, None)
        return MeridianShape(*map(unwrap_scalar, self._solve_shape(c, start, unknown=2)))

    def _circle_estimate(self, contraction: Any) -> tuple[Any, Any, Any]:
        """Initial values from the circular arc with virtual work: radius [m], F/p [m2], rubber part
        of F [N].
        """
        tube, arc = self.geometry, CircularArc()
        z = arc.angle_squared(contraction)
        derivatives = arc.derivatives_times_angle(z, tube.fibre_length, tube.end_radius)
        energy = self.rubber.energy(
            derivatives.arc_excess, derivatives.arc_excess_squared, tube.end_radius
        )
        scale = tube.fibre_length * np.sqrt(z)
        radius = arc.segment(contraction, tube.fibre_length, tube.end_radius).max_radius
        return (
            radius,
            np.maximum(derivatives.volume / scale, 1e-6),
            self.wall_thickness * energy / scale,
        )

    def _min_pressure(self, radius: Any) -> Any:
        """Pressure [Pa] below which z is not positive everywhere between r_0 and R."""
        r0 = self.geometry.end_radius
        rest = 2 * self.rubber.intercept
        at_end = (self.rubber.slope / r0 * (radius - r0) + rest) / (radius + r0)
        in_middle = (self.rubber.slope / r0 * 2 * (radius - r0) + rest) / (2 * radius)
        return self.wall_thickness * np.maximum(at_end, in_middle)

    def _solve_shape(self, contraction: Any, start: MeridianShape, unknown: int) -> MeridianShape:
        """Solve for R and pressure (`unknown` 1) or force (2) by Newton's method with step
        halving.
        """
        tube = self.geometry
        target = tube.fibre_length * np.stack([np.ones_like(contraction), 1.0 - contraction])
        shape = self._evaluate_shape(start.radius, start.pressure, start.force)
        size = np.ones_like(contraction)
        for _ in range(_MAX_ITERATIONS):
            error = _length_error(shape, target)
            if np.all((error < _LENGTH_TOLERANCE) | (size < 1e-9)):
                break
            trial = self._newton_step(shape, target, size, unknown)
            better = _length_error(trial, target) < error
            shape = MeridianShape(
                *(np.where(better, new, old) for new, old in zip(trial, shape, strict=True))
            )
            size = np.where(better, np.minimum(1.0, 2 * size), size / 2)
        converged = _length_error(shape, target) < 1e-10
        return MeridianShape(*(np.where(converged, values, np.nan) for values in shape))

    def _newton_step(
        self, shape: MeridianShape, target: Any, size: Any, unknown: int
    ) -> MeridianShape:
        """Return the shape after one damped Newton step towards the target lengths [m]."""
        error = target - shape.lengths
        by_radius = shape.jacobian[:, 0]
        by_other = shape.jacobian[:, unknown]
        determinant = by_radius[0] * by_other[1] - by_radius[1] * by_other[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            radius_step = (error[0] * by_other[1] - error[1] * by_other[0]) / determinant
            other_step = (by_radius[0] * error[1] - by_radius[1] * error[0]) / determinant
        bulge = shape.radius - self.geometry.end_radius
        radius = self.geometry.end_radius + bulge * np.exp(
            np.clip(size * radius_step / bulge, -1.0, 1.0)
        )
        pressure = shape.pressure
        force = shape.force
        if unknown == 1:
            pressure = pressure * np.exp(np.clip(size * other_step / pressure, -1.0, 1.0))
        else:
            force = force + size * other_step
        return self._evaluate_shape(radius, pressure, force)

    # without pressure there is no shape: its lengths are not finite
    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def _evaluate_shape(self, radius: Value, pressure: Value, force: Value) -> MeridianShape:
        """Arc and chord length of the shape with these parameters, and their derivatives."""
        radius, pressure, force = as_arrays(radius, pressure, force)
        v, weights = (np.reshape(x, (-1,) + (1,) * radius.ndim) for x in graded_quadrature(NODES))
        bulge = radius - self.geometry.end_radius
        curve = self._curve(radius, pressure, force, v)
        z = curve.z
        axial = curve.axial
        fibre = curve.fibre
        by_radius = 1.0 - v * v
        ratio = self.wall_thickness * self.rubber.slope / (self.geometry.end_radius * pressure)
        z_by = ((1.0 + by_radius) * (1.0 - ratio), curve.rubber_term / pressure, 0.0)
        axial_by = (
            2 * curve.radius * by_radius,
            -force / (np.pi * pressure**2),
            1.0 / (np.pi * pressure),
        )
        first = axial_by[0] + v * v * (z + bulge * z_by[0])
        fibre_by = (first, axial_by[1] + bulge * v * v * z_by[1], axial_by[2])
        g = weights * curve.factor
        lengths = np.stack([(fibre * g).sum(axis=0), (axial * g).sum(axis=0)])
        jacobian = np.empty((2, 3, *radius.shape))
        for i in range(3):
            relative = -0.5 * (z_by[i] / z + (fibre_by[i] + axial_by[i]) / (fibre + axial))
            jacobian[0, i] = ((fibre_by[i] + fibre * relative) * g).sum(axis=0)
            jacobian[1, i] = ((axial_by[i] + axial * relative) * g).sum(axis=0)
        jacobian[:, 0] += lengths / (2 * bulge)
        return MeridianShape(radius, pressure, force, lengths, jacobian)

    def _curve(self, radius: Any, pressure: Any, force: Any, v: Any) -> _Curve:
        """Meridian at r = R - (R - r_0) v^2."""
        r0 = self.geometry.end_radius
        bulge = radius - self.geometry.end_radius
        r = radius - bulge * v * v
        stress = self.rubber.slope / r0 * (radius + r - 2 * r0) + 2 * self.rubber.intercept
        rubber_term = self.wall_thickness / pressure * stress
        z = radius + r - rubber_term
        axial = force / (np.pi * pressure) + r * r
        fibre = axial + bulge * v * v * z
        exists = np.all((z > 0) & (fibre + axial > 0), axis=0) & (
            pressure > self._min_pressure(radius)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = np.where(exists, 4 * np.sqrt(bulge) / np.sqrt(z * (fibre + axial)), np.nan)
        return _Curve(r, rubber_term, z, axial, fibre, factor)

    def volume(self, contraction: float, force: float) -> float:
        """Enclosed volume [m3] of the whole muscle at a contraction [1] and a tension [N]."""
        curve, weights = self._curve_at(contraction, force)
        return float(
            self.geometry.segments
            * np.pi
            * np.sum(weights * curve.radius**2 * curve.axial * curve.factor)
        )

    def rubber_energy(self, contraction: float, force: float) -> float:
        """Elastic energy [J] of the rubber of the whole muscle, zero at rest."""
        curve, weights = self._curve_at(contraction, force)
        rise = curve.radius - self.geometry.end_radius
        r0 = self.geometry.end_radius
        per_length = self.wall_thickness * self.rubber.energy(rise, rise**2, r0)
        return float(
            self.geometry.segments * np.sum(weights * per_length * curve.fibre * curve.factor)
        )

    def _shape_or_raise(self, contraction: Value, force: Value) -> MeridianShape:
        """Return the shape of `shape_at_force`. Raises SolveError if there is none."""
        shape = self.shape_at_force(contraction, force)
        check_solution(
            shape.pressure, (0.0, np.inf), (contraction, force), self._no_balance_message
        )
        return shape

    def _curve_at(self, contraction: float, force: float) -> tuple[_Curve, Any]:
        """Meridian at the quadrature nodes, and the quadrature weights."""
        shape = self._shape_or_raise(contraction, force)
        v, weights = graded_quadrature(NODES)
        return self._curve(shape.radius, shape.pressure, shape.force, v), weights

    def profile(self, contraction: float, force: float, points: int = 201) -> Profile:
        """Outline of one segment at a tension [N]: axial positions from its middle [m] and radii
        [m].
        """
        shape = self._shape_or_raise(contraction, force)
        upper = np.linspace(0.0, 1.0, points // 2 + 1)
        v, weights = (rule[:, None] for rule in graded_quadrature(NODES))
        curve = self._curve(shape.radius, shape.pressure, shape.force, upper * v)
        axial = upper * np.sum(weights * curve.axial * curve.factor, axis=0) / 2
        radius = shape.radius - (shape.radius - self.geometry.end_radius) * upper**2
        return np.concatenate([-axial[:0:-1], axial]), np.concatenate([radius[:0:-1], radius])

    def _no_balance_message(self, contraction: float, force: float) -> str:
        return (
            f"ExactMeridian: no equilibrium with {force:.4g} N at a contraction of"
            f" {100 * contraction:.4g} %. The rubber would contract the tube below the radius of"
            " its rings, where the rubber line is not defined; increase the contraction or the"
            " force."
        )

    def _no_shape_message(self, pressure: float, contraction: float) -> str:
        return (
            f"ExactMeridian: no meridian with a contraction of {100 * contraction:.4g} % exists at"
            f" {pressure / 1e3:.4g} kPa. `pressure(contraction, force)` returns the pressure"
            " required for a load."
        )


def _length_error(shape: MeridianShape, target: Any) -> Any:
    """Larger error of the two lengths relative to the fibre length; infinite if the shape does not
    exist.
    """
    return np.nan_to_num(
        np.abs(shape.lengths - target).max(axis=0) / target[0], nan=np.inf, posinf=np.inf
    )
