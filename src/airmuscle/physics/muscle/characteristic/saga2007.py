"""Saga, Nakamura and Yaegashi 2007: straight-fibre rubber muscle in closed form, in all
interpretations.
"""

import functools
from typing import ClassVar, NamedTuple

import numpy as np  # noqa: TID251  (polynomial roots are never traced)

from ....core import (
    ParameterError,
    Reference,
    Value,
    as_finite_float,
    autodiff,
    model,
    ops,
    parameter,
)
from ..geometry.base import check_contraction_range, check_not_straight
from ..geometry.meridian import SAGA_2007, Parabola
from ..geometry.straight_fibre import FibreSum, HalfShellFibreSum, StraightFibre
from .base import PressureLaw
from .modes import is_formula_alone
from .rubber import AxialIntegral, RubberIntegral, RubberLaw, RubberLine
from .solve import check_solution, solve_direction

LINE_A = RubberLine(slope=0.1263e6, intercept=0.3e6)
"""Rubber as printed in the text; 0.68 MPa at strain 3. The unit MPa is inferred from Fig. 4."""
LINE_B = RubberLine(slope=0.3e6, intercept=0.1263e6)
"""Rubber with slope and intercept exchanged; 1.03 MPa at strain 3, the corner of the axes of Fig.
4.
"""
RUBBER_TEST_STRAIN = 3.0
"""Maximum strain of the rubber test of Fig. 4; the line is extrapolated above it."""


_MIN_SLOPE = 1e-200
"""Lower bound of the slope in a denominator, which avoids a division by zero for straight
fibres.
"""


class EquilibriumPoint(NamedTuple):
    """Contraction in equilibrium with a pressure and a load."""

    contraction: float
    stable: bool
    """Whether the equilibrium pressure increases with contraction; if it decreases, the muscle
    snaps through.
    """


@model
class Saga2007(RubberLaw, PressureLaw):
    """Equation (19): P = [t H + (M/m) tau F]/[w A_1 - (M/m) tau pi r_0^2],   tau = l/(q a).

    Force balance of the half shell (9) with the fibre tension from the end section (5). Per segment
    of fibre length l_0: chord l; curvature 1/a = sqrt(24 (l_0 - l)/l^3) (3), used instead of a for
    accuracy at small contraction; A_1 = Int r dx; H = Int sigma (12); r_0 = d_0/2; t wall
    thickness; m fibres; M sum of their sines (15). In full:
        P = [2 m t (alpha l^2 + 6 a beta d_0) + 12 d_0 M F/q]/(d_0 [w m (l^2 + 6 a d_0) - 3 pi M
            d_0^2/q]).
    Interpretations: w = 2 as printed in (17), 1 as required by (16); q = 1 as printed in (7), (8),
    (14), (18), 2 from the end slope of (2); M printed, corrected or uniform; H along the axis as
    printed, or along the arc. The default is as printed (w = 2, q = 1, axis) with the corrected
    sum. Only w = 1, q = 2, UniformFibreSum, ArcIntegral is mechanically exact. No interpretation is
    conservative: simulate CircleVirtualWork instead. Reference: Saga et al. 2007.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007,)
    refuses_beyond: ClassVar[bool] = True
    begins_at_straight_fibres = True

    geometry: StraightFibre
    rubber: RubberLine
    wall_thickness: float = parameter("m", "t", "wall thickness at rest", bounds=(0.0, 0.1))
    projection_factor: float = parameter(
        "1",
        "w",
        "factor of the pressure on the projected area",
        bounds=(0.5, 4.0),
        fitted=False,
        default=2.0,
    )
    slope_factor: float = parameter(
        "1", "q", "divisor of the end slope l/a", bounds=(0.5, 4.0), fitted=False, default=1.0
    )
    fibres: int = 16
    fibre_sum: FibreSum = HalfShellFibreSum()
    rubber_integral: RubberIntegral = AxialIntegral()

    def check(self) -> None:
        if (
            isinstance(self.fibres, bool)
            or not isinstance(self.fibres, int)
            or self.fibres < 4
            or self.fibres % 2
        ):
            raise ParameterError(
                f"Saga2007.fibres is {self.fibres!r}; it must be an even integer, 4 or more."
            )
        if not isinstance(self.geometry.meridian, Parabola):
            raise ParameterError(
                "Saga2007 requires the parabolic meridian of (2), (3); its geometry has a"
                f" {type(self.geometry.meridian).__name__}. Use StraightFibre(...,"
                " meridian=Parabola())."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From zero to just below the pole, or to 50 %, where the parabola (3) has its maximum
        radius.
        """
        return (0.0, min(self.geometry.contraction_range[1], self.pole * (1.0 - 1e-9)))

    @property
    def pole(self) -> float:
        """Contraction [1] at which the pressure of this interpretation becomes infinite."""
        return _pole(self)

    @property
    def threshold_pressure(self) -> float:
        """Gauge pressure [Pa] at which contraction starts at any load, t beta/(w r_0); w = 1 is a
        thin-walled ring.
        """
        return super().threshold_pressure / self.projection_factor

    @property
    def snap_through_load(self) -> float:
        """Load [N] below which pressure decreases as contraction starts: the muscle snaps through
        like a balloon.
        """
        tube = self.geometry
        factor = self.fibre_sum.sum_of_sines(self.fibres) / (self.fibres * self.slope_factor)
        widening = (
            tube.fibre_length**2 / 12
            - factor * ops.pi * tube.end_radius**2 / self.projection_factor
        )
        stiffening = (
            self.wall_thickness * self.rubber.slope * tube.fibre_length**2 / (12 * tube.end_radius)
        )
        return float(
            (self.wall_thickness * self.rubber.intercept / tube.end_radius * widening - stiffening)
            / factor
        )

    def pressure(self, contraction: Value, force: Value) -> Value:
        self._check_contraction(contraction)
        solution = self.equilibrium_pressure(contraction, force)
        return check_solution(
            solution, self.pressure_range, (contraction, force), self._no_pressure_message
        )

    def force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N]. Raises GeometryLimitError at zero contraction, where straight fibres pull
        infinitely."""
        self._check_contraction(contraction)
        if not is_formula_alone():  # a search goes there
            check_not_straight(contraction, "Saga2007")
        shell, rubber, lever = self._terms(contraction)
        return (pressure * shell - rubber) / ops.maximum(lever, _MIN_SLOPE)

    def contraction(self, pressure: Value, force: Value) -> Value:
        self.check_threshold(pressure, force)
        return solve_direction(
            lambda contraction, _, load: self.equilibrium_pressure(contraction, load),
            self.contraction_range,
            (pressure, force),
            0,
            self._no_contraction_message,
            "Required pressure at this load",
            "kPa",
        )

    def equilibrium_pressure(self, contraction: Value, force: Value) -> Value:
        """Equation (19) [Pa] at any contraction below 1 without a check of its range; negative
        beyond the pole.
        """
        shell, rubber, lever = self._terms(contraction)
        return (rubber + lever * force) / shell

    def _terms(self, contraction: Value) -> tuple[Value, Value, Value]:
        """Terms of (19): w A_1 - (M/m) tau pi r_0^2 [m2], t H [N], (M/m) tau [1]."""
        tube = self.geometry
        parabola = tube.meridian.segment(contraction, tube.fibre_length, tube.end_radius)
        lever = self.fibre_sum.sum_of_sines(self.fibres) / self.fibres * self.end_slope(contraction)
        shell = self.projection_factor * parabola.half_section - lever * ops.pi * tube.end_radius**2
        return (
            shell,
            self.wall_thickness * self.rubber_integral.hoop_stress(self.rubber, parabola),
            lever,
        )

    def end_slope(self, contraction: Value) -> Value:
        """tau = l/(q a), the tangent of the fibre angle at the end in this interpretation."""
        return 2.0 * ops.sqrt(6.0 * contraction / (1.0 - contraction)) / self.slope_factor

    def end_tension(self, pressure: Value, contraction: Value, force: Value) -> Value:
        """Tension of one fibre [N] from the axial force balance at the end, (8)."""
        steepness = ops.sqrt(1.0 + self.end_slope(contraction) ** 2)
        return (ops.pi * self.geometry.end_radius**2 * pressure + force) * steepness / self.fibres

    def shell_tension(self, pressure: Value, contraction: Value) -> Value:
        """Tension of one fibre [N] from the radial balance of the half shell, (18); equal to (8) in
        equilibrium.

        It is unbounded at zero contraction, where the fibres are straight.
        """
        shell, rubber, lever = self._terms(contraction)
        resultant = pressure * (shell + lever * ops.pi * self.geometry.end_radius**2) - rubber
        steepness = ops.sqrt(1.0 + self.end_slope(contraction) ** 2)
        return resultant * steepness / (self.fibres * ops.maximum(lever, _MIN_SLOPE))

    def middle_strain(self, contraction: Value) -> Value:
        """Hoop strain of the rubber in the middle, (10): (l_0/(4 d_0)) sqrt(24 eps (1 - eps))
        [1].
        """
        tube = self.geometry
        return (
            tube.fibre_length
            / (4 * tube.end_diameter)
            * ops.sqrt(24 * contraction * (1 - contraction))
        )

    def contraction_at_strain(self, strain: float) -> float:
        """Contraction [1] at which the hoop strain in the middle reaches `strain`; 0.5 if it is
        never reached.
        """
        tube = self.geometry
        product = (4 * tube.end_diameter * strain / tube.fibre_length) ** 2 / 24
        return float(0.5 - ops.sqrt(max(0.25 - product, 0.0)))

    def validity_warnings(self, pressure: float, contraction: float) -> tuple[str, ...]:
        """Warnings at this point: extrapolated rubber line, unstable equilibrium, or beyond the
        maximum volume.
        """
        texts = []
        if (strain := float(self.middle_strain(contraction))) > RUBBER_TEST_STRAIN:
            end = self.contraction_at_strain(RUBBER_TEST_STRAIN)
            texts.append(
                f"the rubber strain of {strain:.3g} exceeds the tested maximum of 3, reached at a"
                f" contraction of {100 * end:.3g} %"
            )
        if contraction > 0 and float(self.slopes(pressure, contraction).by_contraction) > 0:
            texts.append(
                "the equilibrium is unstable: the pressure decreases with contraction"
                " (snap-through)"
            )
        if contraction > 0 and float(self.geometry.volume_derivative(contraction)) < 0:
            texts.append(
                "the volume decreases with contraction but the tension is positive: energy is not"
                " conserved"
            )
        return tuple(texts)

    def equilibria(self, pressure: float, force: float) -> tuple[EquilibriumPoint, ...]:
        """All contractions from 0 to 1 in equilibrium with a gauge pressure [Pa] and a load [N], in
        ascending order.

        With the rubber integrated along the axis they are roots of one quintic, so that none is
        missed. Beyond `contraction_range` they are mathematical solutions without physical meaning.
        Raises ParameterError for another rubber integral, and for a pressure or a load that is not
        finite.
        """
        if not isinstance(self.rubber_integral, AxialIntegral):
            raise ParameterError(
                "Saga2007: the equilibria are roots of a polynomial only if the rubber is"
                " integrated along the axis; use rubber_integral=AxialIntegral(), or the method"
                " `contraction`."
            )
        for name, value in (("pressure", pressure), ("force", force)):
            as_finite_float(f"Saga2007.equilibria: {name}", value)
        roots = sorted({c for c in _quintic_roots(self, pressure, force) if 0.0 <= c < 1.0})
        return tuple(EquilibriumPoint(c, self._is_stable(c, force)) for c in roots)

    def _is_stable(self, contraction: float, force: float) -> bool:
        point = max(contraction, 1e-12)  # the slope is infinite at zero
        return bool(autodiff.derivative(self, "equilibrium_pressure", point, force) > 0)

    def _check_contraction(self, contraction: Value) -> None:
        """Raise GeometryLimitError if a contraction is out of range, unless the model is being
        traced.
        """
        if not ops.is_symbol(self.wall_thickness):
            remark = (
                f"; the pole of this interpretation is at {100 * self.pole:.4g} %"
                if self.pole < 0.5
                else ""
            )
            check_contraction_range(contraction, self.contraction_range, "Saga2007", remark)

    def _below_threshold_message(self, pressure: float, force: float) -> str:
        from_rest = (
            "Equilibria that are not reached from rest are returned by `equilibria(pressure,"
            " force)`."
        )
        return f"{super()._below_threshold_message(pressure, force)} {from_rest}"


@functools.lru_cache(maxsize=256)
def _pole(law: Saga2007) -> float:
    """Root of w A_1 = (M/m) tau pi r_0^2; the difference per chord increases, then falls to minus
    infinity.
    """
    low = 0.0
    high = 1.0
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (middle, high) if law._terms(middle)[0] > 0 else (low, middle)
    return low


def _quintic_roots(law: Saga2007, pressure: float, force: float) -> list[float]:
    """Contractions with a B = A_2 l^2 + A_0, from (3) squared: 24 (l_0 - l)(A_2 l^2 + A_0)^2 = B^2
    l^3.
    """
    tube = law.geometry
    m = law.fibres
    w = law.projection_factor
    q = law.slope_factor
    d = tube.end_diameter
    t = law.wall_thickness
    m_sum = law.fibre_sum.sum_of_sines(law.fibres)
    a2 = m * (w * pressure * d - 2 * t * law.rubber.slope) * tube.fibre_length**2
    a0 = -3 * ops.pi * m_sum * d**3 / q * pressure - 12 * d * m_sum * force / q
    b = 6 * m * d * (2 * t * law.rubber.intercept - w * pressure * d) * tube.fibre_length
    # polynomial in x = l/l_0, coefficients in descending order
    square = np.array([a2 * a2, 0.0, 2 * a2 * a0, 0.0, a0 * a0])
    quintic = np.polysub(24 * np.polymul([-1.0, 1.0], square), [b * b, 0.0, 0.0, 0.0])
    roots = np.roots(quintic)
    real = roots.real[(abs(roots.imag) < 1e-7) & (roots.real > 0) & (roots.real <= 1)]
    contractions = [1.0 - x for x in real if b * (a2 * x * x + a0) >= 0]
    return [_refine_root(law, float(c), pressure, force) for c in contractions]


def _refine_root(law: Saga2007, contraction: float, pressure: float, force: float) -> float:
    """Return the root after up to two Newton steps on the model itself, as long as they reduce the
    residual.
    """
    for _ in range(2):
        if not 0.0 < contraction < 1.0:
            break
        residual = law.equilibrium_pressure(contraction, force) - pressure
        refined = contraction - residual / autodiff.derivative(
            law, "equilibrium_pressure", contraction, force
        )
        if not 0.0 < refined < 1.0 or abs(
            law.equilibrium_pressure(refined, force) - pressure
        ) >= abs(residual):
            break
        contraction = float(refined)
    return contraction
