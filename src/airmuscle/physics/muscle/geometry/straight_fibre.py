"""Straight-fibre geometries: tubes of axial fibres between rings, with an assumed or the exact
outline; fibre sums.
"""

import abc
import functools
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ....core import Array, Reference, Value, model, ops, parameter, published, within
from .base import LENGTHS, RESTING_LENGTH, Geometry, Profile, check_contraction_range
from .meridian import CircularArc, Meridian, Segment

DAERDEN_LEFEBER_2001 = published("daerden-lefeber-2001")
_ROOT_MU_BRACKET = (1e-6, 0.9)
"""Search interval of sqrt(mu)."""
_ROOT_TOLERANCES = {
    "xatol": 0.0,
    "xrtol": 4 * float(np.finfo(float).eps),
    "fatol": 0.0,
    "frtol": 0.0,
}
_SEARCH: dict[str, Any] = {"tolerances": _ROOT_TOLERANCES, "maxiter": 300}
"""Options of the root searches, which end at rounding."""


class FibreSum(abc.ABC):
    """M = Sum sin(theta_n) over the half section, theta_n = (pi/m)(2 n + 1): Saga et al. 2007,
    (13), (15).
    """

    @abc.abstractmethod
    def sum_of_sines(self, fibres: int) -> Value:
        """M [1] for m = `fibres`."""


@model
class PrintedFibreSum(FibreSum):
    """Sum over n = 0..m/2, as (15) is printed: one fibre lies beyond pi and is subtracted; 4.93074
    for 16 fibres.
    """

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres) - ops.sin(ops.pi / fibres)


@model
class HalfShellFibreSum(FibreSum):
    """Sum over n = 0..m/2 - 1, the fibres of the half section: 1/sin(pi/m); 5.12583 for 16
    fibres.
    """

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres)


@model
class UniformFibreSum(FibreSum):
    """Continuous distribution of fibres: m/pi, as axial symmetry requires; 5.09296 for 16
    fibres.
    """

    def sum_of_sines(self, fibres: int) -> Value:
        return fibres / ops.pi


@model
class UserDefinedFibreSum(FibreSum):
    """User-defined value, for sensitivity studies."""

    value: float = parameter(
        "1", "M", "sum of the sines of the fibre angles", bounds=(0.1, 1e3), fitted=False
    )

    def sum_of_sines(self, fibres: int) -> Value:
        return self.value


@model
class FibreTube(Geometry):
    """Straight inextensible fibres between rings of equal diameter: n rings form n + 1 equal
    segments in series.

    Each segment has the fibre length l_0 = L_0/(n + 1) and the contraction of the whole muscle. The
    width of a ring is neglected. Equal division by the rings is inferred; Saga et al. 2007 do not
    state it.
    """

    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    end_diameter: float = parameter(
        "m", "d_0", "diameter at the ends and rings", bounds=(1e-4, 0.5), fitted=False
    )
    rings: int = within(0, 1_000_000, default=0)

    @property
    def end_radius(self) -> Value:
        """r_0 = d_0/2 [m]."""
        return self.end_diameter / 2

    @property
    def segments(self) -> int:
        """Number of segments n + 1 for n rings."""
        return self.rings + 1

    @property
    def fibre_length(self) -> Value:
        """Fibre length l_0 [m] of one segment."""
        return self.resting_length / self.segments

    @abc.abstractmethod
    def segment(self, contraction: Value) -> Segment:
        """Shape and integrals of one segment at a contraction [1]. Raises GeometryLimitError
        outside the range.
        """

    @abc.abstractmethod
    def profile(self, contraction: float, position: Array) -> Profile:
        """Axial positions from the middle of a segment [m] and radii [m] at normalised positions
        from -1 to 1.
        """

    def volume(self, contraction: Value) -> Value:
        return self.segments * self.segment(contraction).volume

    def outline(self, contraction: float, points: int = 201) -> Profile:
        self.check_contraction(contraction)
        coordinate = np.linspace(0.0, self.segments, points)
        number = np.minimum(np.floor(coordinate), self.rings)
        axial, radius = self.profile(contraction, 2 * (coordinate - number) - 1)
        chord = self.fibre_length * (1.0 - contraction)
        return axial + (number - self.rings / 2) * chord, radius


@model
class StraightFibre(FibreTube):
    """Straight-fibre tube with an assumed meridian: CircularArc, Catenary, TrueArcParabola, or
    Parabola (Saga et al.).

    The default is the circular arc: it preserves the fibre length and has the smallest error under
    virtual work.
    """

    meridian: Meridian = CircularArc()

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From straight fibres to the maximum contraction of the meridian."""
        return (0.0, self.meridian.max_contraction)

    def segment(self, contraction: Value) -> Segment:
        check_contraction_range(contraction, self.contraction_range, "StraightFibre")
        return self.meridian.segment(contraction, self.fibre_length, self.end_radius)

    def volume_derivative(self, contraction: Value) -> Value:
        check_contraction_range(contraction, self.contraction_range, "StraightFibre")
        return super().volume_derivative(contraction)

    def profile(self, contraction: float, position: Array) -> Profile:
        return self.meridian.profile(contraction, self.fibre_length, self.end_radius, position)


class EllipticOutline(NamedTuple):
    """Parameter mu, angle theta_0 and elliptic integrals that define an outline."""

    parameter: Any
    """mu = R^2/(2 (R^2 + A)) with A = F/(pi p); the tension is zero at 1/2 and compressive
    above.
    """
    angle: Any
    """theta_0 with cos(theta_0) = r_0/R."""
    first: Any
    """F(theta_0 | mu), incomplete elliptic integral of the first kind."""
    deficit: Any
    """F(theta_0 | mu) - E(theta_0 | mu), computed without cancellation."""


@model
class PleatedTube(FibreTube):
    """Straight-fibre muscle without hoop stress: N cos(phi) = F + pi p r^2 with N constant along
    the fibre.

        l_0 = (R/sqrt mu) F,  l = (R/sqrt mu)(2 E - F),  eps = 2 (1 - E/F),  F/p = pi R^2 (1 - 2
                              mu)/(2 mu)
        V = (pi R^3/(3 mu^1.5)) [(1 - mu) F - (1 - 2 mu) E + 2 mu sin(theta_0) cos(theta_0) D_0]

    R: maximum radius; F, E: incomplete elliptic integrals F(theta_0 | mu), E(theta_0 | mu) with
    parameter mu = R^2/(2 (R^2 + A)), A = F/(pi p), cos(theta_0) = r_0/R, D_0 = sqrt(1 - mu sin^2
    theta_0). Carlson's symmetric integrals remain accurate at small contraction. Same form as in
    Daerden and Lefeber 2001.
    """

    references: ClassVar[tuple[Reference, ...]] = (DAERDEN_LEFEBER_2001,)
    traceable: ClassVar[bool] = False

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From zero to 50 %, less for a short tube, more for a slender one, to its
        `free_contraction`.

        Above `free_contraction` the tension is negative.
        """
        at_bracket_end = _contraction_of_tube(_ROOT_MU_BRACKET[1] ** 2, self._slenderness)
        return (0.0, max(self.free_contraction, min(0.5, at_bracket_end)))

    @property
    def free_contraction(self) -> float:
        """Contraction [1] of maximum volume, where the tension is zero."""
        return _contraction_of_tube(0.5, self._slenderness)

    @property
    def _slenderness(self) -> float:
        """lambda = l_0/r_0 [1]."""
        return float(self.fibre_length / self.end_radius)

    def elliptic_outline(self, contraction: Value) -> EllipticOutline:
        """Parameter, angle and integrals at a contraction [1], by a bracketed root search for the
        parameter.
        """
        from scipy.optimize import elementwise

        self.check_contraction(contraction)
        target = np.asarray(contraction, dtype=float)

        def residual(root_mu: Any, c: Any) -> Any:
            return _contraction(root_mu * root_mu, self._slenderness) - c

        # searched in sqrt(mu), which is proportional to contraction^(1/4) near zero and keeps the
        # accuracy there
        root = elementwise.find_root(residual, _ROOT_MU_BRACKET, args=(target,), **_SEARCH)
        mu = np.where(target > 0, root.x, np.nan) ** 2
        angle = _angle(mu, self._slenderness)
        return EllipticOutline(mu, angle, *_integrals(mu, angle))

    def effective_area(self, contraction: Value) -> Value:
        """Effective area F/p [m2] of the ideal muscle; infinite at zero contraction."""
        shape = self.elliptic_outline(contraction)
        radius = self.end_radius / np.cos(shape.angle)
        area = np.pi * radius**2 * (1 - 2 * shape.parameter) / (2 * shape.parameter)
        return unwrap_scalar(np.where(np.asarray(contraction) > 0, area, np.inf))

    def volume_derivative(self, contraction: Value) -> Value:
        """dV/deps = L_0 F/p [m3] by virtual work; the tests compare it with the derivative of the
        volume.
        """
        return self.resting_length * self.effective_area(contraction)

    def segment(self, contraction: Value) -> Segment:
        shape = self.elliptic_outline(contraction)
        mu, sine, cosine = shape.parameter, np.sin(shape.angle), np.cos(shape.angle)
        root = np.sqrt(mu)
        radius = self.end_radius / cosine
        delta = np.sqrt(1 - mu * sine**2)
        length = self.fibre_length * (1.0 - np.asarray(contraction))
        section = radius**2 / root * sine * delta
        arc_moment = radius**2 / mu * np.arcsin(root * sine)
        squares = radius**3 / root * (shape.first - shape.deficit / mu)
        bracket = (
            shape.deficit + mu * (shape.first - 2 * shape.deficit) + 2 * mu * sine * cosine * delta
        )
        # with A + r^2 = R^2 (1 - 2 mu + 2 mu cos^2)/(2 mu) and N/(pi p) = R^2/(2 mu)
        values = (
            length,
            np.full_like(length, self.fibre_length),
            radius,
            2 * root * sine * delta,
            1 - 2 * mu * sine**2,
            section - self.end_radius * length,
            arc_moment - self.end_radius * self.fibre_length,
            squares - 2 * self.end_radius * arc_moment + self.end_radius**2 * self.fibre_length,
            np.pi * radius**3 / (3 * mu**1.5) * bracket,
        )
        rest = self.fibre_length
        r0 = self.end_radius
        cylinder = (
            rest,
            rest,
            r0,
            0.0,
            1.0,
            0.0,
            0.0,
            0.0,
            np.pi * r0**2 * rest,
        )  # at zero contraction, where mu = 0
        pairs = zip(values, cylinder, strict=True)
        return Segment(
            r0,
            *(
                unwrap_scalar(np.where(np.asarray(contraction) > 0, v, at_rest))
                for v, at_rest in pairs
            ),
        )

    def profile(self, contraction: float, position: Array) -> Profile:
        from scipy.special import ellipeinc, ellipkinc

        if contraction == 0:
            return position / 2 * self.fibre_length, np.full_like(position, self.end_radius)
        shape = self.elliptic_outline(contraction)
        theta = position * shape.angle
        radius = self.end_radius / np.cos(shape.angle)
        mu = shape.parameter
        axial = radius / np.sqrt(mu) * (2 * ellipeinc(theta, mu) - ellipkinc(theta, mu)) / 2
        return axial, radius * np.cos(theta)


def _integrals(mu: Any, angle: Any) -> tuple[Any, Any]:
    """Return F(angle | mu) and F - E by Carlson's symmetric integrals."""
    from scipy.special import elliprd, elliprf

    sine = np.sin(angle)
    cosine = np.cos(angle)
    delta_squared = 1 - mu * sine**2
    first = sine * elliprf(cosine**2, delta_squared, 1.0)
    return first, mu / 3 * sine**3 * elliprd(cosine**2, delta_squared, 1.0)


def _angle(mu: Any, slenderness: float) -> Any:
    """Return theta_0 with F(theta_0 | mu) = lambda sqrt(mu) cos(theta_0); the difference increases
    with the angle.
    """
    from scipy.optimize import elementwise
    from scipy.special import ellipkinc

    def residual(angle: Any, mu: Any) -> Any:
        return ellipkinc(angle, mu) - slenderness * np.sqrt(mu) * np.cos(angle)

    return elementwise.find_root(residual, (0.0, np.pi / 2), args=(np.asarray(mu),), **_SEARCH).x


def _contraction(mu: Any, slenderness: float) -> Any:
    """Return the contraction [1] of a parameter mu."""
    first, deficit = _integrals(mu, _angle(mu, slenderness))
    return 2 * deficit / first


@functools.lru_cache(4096)
def _contraction_of_tube(mu: float, slenderness: float) -> float:
    """Return the contraction [1] of a parameter mu, which laws ask for at every point of a tube."""
    return float(_contraction(np.asarray(mu), slenderness))


def unwrap_scalar(value: Any) -> Any:
    """Return a float for a zero-dimensional array, else the array."""
    return float(value) if np.ndim(value) == 0 else value
