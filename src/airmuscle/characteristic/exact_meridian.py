"""The exact meridian of a straight-fibre muscle with its rubber: the truth that the assumed outlines approximate."""

from __future__ import annotations

import functools
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference
from ..geometry.base import check_contraction_range
from ..geometry.circular_arc import CircularArc
from ..geometry.meridian import SAGA_2007, Profile
from ..geometry.pleated import DAERDEN_LEFEBER_2001, PleatedTube
from .base import PressureLaw, Slopes
from .rubber import RubberLine
from .solve import check_solution, find_first_root

NODES = 120  # Gauss points over half the meridian


@functools.cache
def _graded_quadrature() -> tuple[Any, Any]:
    """Nodes and weights in v = y (2 - y): the end slope's approach to zero, 1/sqrt(1 - v), is then harmless."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    y = (nodes + 1) / 2
    return y * (2 - y), weights * (1 - y)


_MAX_ITERATIONS = 60
_LOAD_STEPS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.0)
_LENGTH_TOLERANCE = 1e-13
"""How well the two lengths must be met, as a part of the fibre's length."""


class MeridianShape(NamedTuple):
    """One shape of a segment: what fixes it, and the lengths that follow with their derivatives."""

    radius: Any
    """Largest radius R [m]."""
    pressure: Any
    """Gauge pressure [Pa]."""
    force: Any
    """Tension [N]."""
    lengths: Any
    """Arc and chord [m], shape (2, ...); NaN where the shape does not exist."""
    jacobian: Any
    """Their derivatives by radius, pressure and force, shape (2, 3, ...)."""


class _Curve(NamedTuple):
    """A meridian over v, letters as in `ExactMeridian`: r [m], what the rubber takes from R + r [m], what is left
    of it, z [m], C [m2], n [m2], and 4 sqrt(R - r_0)/sqrt(z (n + C)) [1/m], NaN where there is no such shape."""

    radius: Any
    rubber_pull: Any
    push: Any
    axial: Any
    fibre: Any
    per_v: Any


@model
class ExactMeridian(PressureLaw):
    """N cos(phi) = F + pi p r^2,   dN/dr = 2 pi t sigma(r): fibre tension N, slope phi, radius r, no outline assumed.

    With r = R - (R - r_0) v^2, C = F/(pi p) + r^2, z = R + r - (2 t/p)(alpha (R + r - 2 r_0)/(2 r_0) + beta),
    n = C + (R - r) z, per segment:
        l_0 = 4 sqrt(R - r_0) Int_0^1 n/sqrt(z (n + C)) dv,   l = 4 sqrt(R - r_0) Int_0^1 C/sqrt(z (n + C)) dv.
    R largest radius, r_0 end radius, t wall, sigma = alpha (r - r_0)/r_0 + beta. The two unknowns (R and p, or R and F)
    are found by Newton's method. Where z is not positive the tube would be drawn in below r_0, of which the
    rubber line says nothing, and no solution is given.
    Reference: Saga et al. 2007 for the muscle; the equations derived for airmuscle.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007, DAERDEN_LEFEBER_2001)
    traceable: ClassVar[bool] = False

    geometry: PleatedTube
    rubber: RubberLine
    wall_thickness: float = parameter("m", "t", "thickness of the wall at rest", bounds=(0.0, 0.1))

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From 0.01 %, where the fibres are all but straight, to the largest volume."""
        return (1e-4, self.geometry.free_contraction * (1.0 - 1e-6))

    @property
    def threshold_pressure(self) -> float:
        """The gauge pressure [Pa] at which contraction starts under any load: t beta/r_0."""
        return float(self.wall_thickness * self.rubber.intercept / self.geometry.end_radius)

    def pressure(self, contraction: Value, force: Value) -> Value:
        found = self._shape_or_raise(contraction, force).pressure
        return check_solution(found, self.pressure_range, (contraction, force), self._no_pressure_message)

    def force(self, pressure: Value, contraction: Value) -> Value:
        found = self.shape_at_pressure(pressure, contraction).force
        return check_solution(found, (-np.inf, np.inf), (pressure, contraction), self._no_shape_message)

    def contraction(self, pressure: Value, force: Value) -> Value:
        """Contraction [1] on the stable branch reached from rest, found along the radius, in which it is single."""
        tube = self.geometry

        def surplus(radius: Value, p: Value, load: Value) -> Value:
            return self._evaluate_shape(radius, p, load).lengths[0] / tube.fibre_length - 1.0

        started = (self.threshold_pressure, np.inf)
        check_solution(np.add(pressure, 0.0 * force), started, (pressure, force), self._below_threshold_message)
        reach = (tube.end_radius * (1 + 1e-9), float(tube.segment(tube.free_contraction).max_radius))
        radius = find_first_root(surplus, reach, (pressure, force), lambda p, f, *_: self._no_contraction_message(p, f))
        found = 1.0 - self._evaluate_shape(radius, pressure, force).lengths[1] / tube.fibre_length
        return float(found) if np.ndim(radius) == 0 else found

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        """By the implicit function theorem from the derivatives of the two lengths."""
        arc, chord = self.shape_at_pressure(pressure, contraction).jacobian
        determinant = arc[0] * chord[2] - arc[2] * chord[0]
        by_pressure = -(arc[0] * chord[1] - arc[1] * chord[0]) / determinant
        by_contraction = -self.geometry.fibre_length * arc[0] / determinant
        return Slopes(by_pressure, by_contraction)

    def shape_at_force(self, contraction: Value, force: Value) -> MeridianShape:
        """The shape that balances a tension [N] at a contraction [1]; its pressure is NaN where there is none."""
        check_contraction_range(contraction, self.contraction_range, "ExactMeridian")
        c, load = np.broadcast_arrays(np.asarray(contraction, float), np.asarray(force, float))
        radius, area, rubber = self._circle_estimate(c)
        start = np.maximum((load + rubber) / area, 1.05 * self._min_pressure(radius))
        found = self._solve_shape(c, MeridianShape(radius, start, load, None, None), unknown=1)
        lost = np.isnan(found.pressure)
        return self._solve_by_unloading(found, c, load, start * area, lost) if lost.any() else _unwrap_scalars(found)

    def _solve_by_unloading(
        self, found: MeridianShape, contraction: Any, load: Any, scale: Any, lost: Any
    ) -> MeridianShape:
        """The lost shapes sought again from a larger load, which is then taken away step by step."""
        c, wanted, extra = contraction[lost], load[lost], scale[lost]
        radius, area, rubber = self._circle_estimate(c)
        shape = MeridianShape(radius, (wanted + extra + rubber) / area, wanted, None, None)
        for share in _LOAD_STEPS:
            shape = self._solve_shape(c, shape._replace(force=wanted + share * extra), unknown=1)
        for part, again in zip(found, shape, strict=True):
            part[..., lost] = again
        return _unwrap_scalars(found)

    def shape_at_pressure(self, pressure: Value, contraction: Value) -> MeridianShape:
        """The shape that a pressure [Pa] holds at a contraction [1]; its force is NaN where there is none."""
        check_contraction_range(contraction, self.contraction_range, "ExactMeridian")
        p, c = np.broadcast_arrays(np.asarray(pressure, float), np.asarray(contraction, float))
        radius, area, rubber = self._circle_estimate(c)
        return _unwrap_scalars(self._solve_shape(c, MeridianShape(radius, p, p * area - rubber, None, None), unknown=2))

    def _circle_estimate(self, contraction: Any) -> tuple[Any, Any, Any]:
        """Where to start: radius [m], F/p [m2] and rubber's share of F [N] of the circle with virtual work."""
        tube, arc = self.geometry, CircularArc()
        z = arc.angle_squared(contraction)
        growth = arc.derivatives_times_angle(z, tube.fibre_length, tube.end_radius)
        energy = self.rubber.energy(growth.arc_excess, growth.arc_excess_squared, tube.end_radius)
        scale = tube.fibre_length * np.sqrt(z)
        radius = arc.segment(contraction, tube.fibre_length, tube.end_radius).max_radius
        return radius, np.maximum(growth.volume / scale, 1e-6), self.wall_thickness * energy / scale

    def _min_pressure(self, radius: Any) -> Any:
        """The pressure [Pa] below which the rubber overcomes it somewhere between r_0 and R (z = 0)."""
        r0, rest = self.geometry.end_radius, 2 * self.rubber.intercept
        at_end = (self.rubber.slope / r0 * (radius - r0) + rest) / (radius + r0)
        in_middle = (self.rubber.slope / r0 * 2 * (radius - r0) + rest) / (2 * radius)
        return self.wall_thickness * np.maximum(at_end, in_middle)

    def _solve_shape(self, contraction: Any, start: MeridianShape, unknown: int) -> MeridianShape:
        """Newton's method for R and pressure (1) or force (2), with steps halved where they do not help."""
        tube = self.geometry
        wanted = tube.fibre_length * np.stack([np.ones_like(contraction), 1.0 - contraction])
        now = self._evaluate_shape(start.radius, start.pressure, start.force)
        size = np.ones_like(contraction)
        for _ in range(_MAX_ITERATIONS):
            error = _length_error(now, wanted)
            if np.all((error < _LENGTH_TOLERANCE) | (size < 1e-9)):
                break
            trial = self._newton_step(now, wanted, size, unknown)
            better = _length_error(trial, wanted) < error
            now = MeridianShape(*(np.where(better, new, old) for new, old in zip(trial, now, strict=True)))
            size = np.where(better, np.minimum(1.0, 2 * size), size / 2)
        met = _length_error(now, wanted) < 1e-10
        return MeridianShape(*(np.where(met, part, np.nan) for part in now))

    def _newton_step(self, now: MeridianShape, wanted: Any, size: Any, unknown: int) -> MeridianShape:
        miss = wanted - now.lengths
        by_radius, by_other = now.jacobian[:, 0], now.jacobian[:, unknown]
        determinant = by_radius[0] * by_other[1] - by_radius[1] * by_other[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            radius_step = (miss[0] * by_other[1] - miss[1] * by_other[0]) / determinant
            other_step = (by_radius[0] * miss[1] - by_radius[1] * miss[0]) / determinant
        bulge = now.radius - self.geometry.end_radius
        radius = self.geometry.end_radius + bulge * np.exp(np.clip(size * radius_step / bulge, -1.0, 1.0))
        pressure, force = now.pressure, now.force
        if unknown == 1:
            pressure = pressure * np.exp(np.clip(size * other_step / pressure, -1.0, 1.0))
        else:
            force = force + size * other_step
        return self._evaluate_shape(radius, pressure, force)

    def _evaluate_shape(self, radius: Value, pressure: Value, force: Value) -> MeridianShape:
        """Arc and chord of the shape with these three, and their derivatives."""
        radius, pressure, force = np.broadcast_arrays(*(np.asarray(x, float) for x in (radius, pressure, force)))
        v, weights = (np.reshape(x, (-1,) + (1,) * radius.ndim) for x in _graded_quadrature())
        bulge = radius - self.geometry.end_radius
        curve = self._curve(radius, pressure, force, v)
        z, axial, fibre = curve.push, curve.axial, curve.fibre
        by_radius = 1.0 - v * v
        share = self.wall_thickness * self.rubber.slope / (self.geometry.end_radius * pressure)
        z_by = ((1.0 + by_radius) * (1.0 - share), curve.rubber_pull / pressure, 0.0)
        axial_by = (2 * curve.radius * by_radius, -force / (np.pi * pressure**2), 1.0 / (np.pi * pressure))
        first = axial_by[0] + v * v * (z + bulge * z_by[0])
        fibre_by = (first, axial_by[1] + bulge * v * v * z_by[1], axial_by[2])
        with np.errstate(divide="ignore", invalid="ignore"):
            g = weights * curve.per_v
            lengths = np.stack([(fibre * g).sum(axis=0), (axial * g).sum(axis=0)])
            growth = np.empty((2, 3, *radius.shape))
            for i in range(3):
                relative = -0.5 * (z_by[i] / z + (fibre_by[i] + axial_by[i]) / (fibre + axial))
                growth[0, i] = ((fibre_by[i] + fibre * relative) * g).sum(axis=0)
                growth[1, i] = ((axial_by[i] + axial * relative) * g).sum(axis=0)
            growth[:, 0] += lengths / (2 * bulge)
        return MeridianShape(radius, pressure, force, lengths, growth)

    def _curve(self, radius: Any, pressure: Any, force: Any, v: Any) -> _Curve:
        """The meridian at r = R - (R - r_0) v^2."""
        r0, bulge = self.geometry.end_radius, radius - self.geometry.end_radius
        r = radius - bulge * v * v
        pull = self.rubber.slope / r0 * (radius + r - 2 * r0) + 2 * self.rubber.intercept
        pull = self.wall_thickness / pressure * pull
        push = radius + r - pull
        axial = force / (np.pi * pressure) + r * r
        fibre = axial + bulge * v * v * push
        possible = np.all((push > 0) & (fibre + axial > 0), axis=0) & (pressure > self._min_pressure(radius))
        with np.errstate(divide="ignore", invalid="ignore"):
            per_v = np.where(possible, 4 * np.sqrt(bulge) / np.sqrt(push * (fibre + axial)), np.nan)
        return _Curve(r, pull, push, axial, fibre, per_v)

    def volume(self, contraction: float, force: float) -> float:
        """Enclosed volume [m3] of the whole muscle at a contraction [1] under a tension [N]."""
        curve, weights = self._curve_at(contraction, force)
        return float(self.geometry.segments * np.pi * np.sum(weights * curve.radius**2 * curve.axial * curve.per_v))

    def rubber_energy(self, contraction: float, force: float) -> float:
        """Energy [J] stored in the rubber of the whole muscle, zero at rest."""
        curve, weights = self._curve_at(contraction, force)
        rise, r0 = curve.radius - self.geometry.end_radius, self.geometry.end_radius
        per_length = self.wall_thickness * self.rubber.energy(rise, rise**2, r0)
        return float(self.geometry.segments * np.sum(weights * per_length * curve.fibre * curve.per_v))

    def _shape_or_raise(self, contraction: Value, force: Value) -> MeridianShape:
        """`balance_at`, refused where there is none."""
        found = self.shape_at_force(contraction, force)
        check_solution(found.pressure, (0.0, np.inf), (contraction, force), self._no_balance_message)
        return found

    def _curve_at(self, contraction: float, force: float) -> tuple[_Curve, Any]:
        found = self._shape_or_raise(contraction, force)
        v, weights = _graded_quadrature()
        return self._curve(found.radius, found.pressure, found.force, v), weights

    def profile(self, contraction: float, force: float, points: int = 201) -> Profile:
        """The outline of one segment under a tension [N]: positions from its middle and radii [m]."""
        found = self._shape_or_raise(contraction, force)
        upper = np.linspace(0.0, 1.0, points // 2 + 1)
        v, weights = (rule[:, None] for rule in _graded_quadrature())
        curve = self._curve(found.radius, found.pressure, found.force, upper * v)
        axial = upper * np.sum(weights * curve.axial * curve.per_v, axis=0) / 2
        radius = found.radius - (found.radius - self.geometry.end_radius) * upper**2
        return np.concatenate([-axial[:0:-1], axial]), np.concatenate([radius[:0:-1], radius])

    def _no_balance_message(self, contraction: float, force: float) -> str:
        return (
            f"ExactMeridian: nothing balances {force:.6g} N at a contraction of {contraction:.2%}. "
            "The rubber's stress at rest would draw the tube in below its end rings, of which its line says nothing; "
            "contract further or pull harder."
        )

    def _below_threshold_message(self, pressure: float, force: float) -> str:
        start = f"contraction starts at {self.threshold_pressure / 1e3:.6g} kPa"
        return f"ExactMeridian: at {pressure / 1e3:.6g} kPa the tube is still straight; {start}."

    def _no_shape_message(self, pressure: float, contraction: float) -> str:
        return (
            f"ExactMeridian: no outline holds a contraction of {contraction:.2%} at {pressure / 1e3:.6g} kPa, "
            "pulled or pushed. `pressure(contraction, force)` says what a load takes there."
        )


def _length_error(balance: MeridianShape, wanted: Any) -> Any:
    """The larger miss of the two lengths, as a part of the fibre's length; infinite where there is no shape."""
    return np.nan_to_num(np.abs(balance.lengths - wanted).max(axis=0) / wanted[0], nan=np.inf, posinf=np.inf)


def _unwrap_scalars(balance: MeridianShape) -> MeridianShape:
    """Plain floats where scalars were given."""
    return MeridianShape(*(float(part) if np.ndim(part) == 0 else part for part in balance))
