"""Saga, Nakamura and Yaegashi 2007: a rubber tube with straight fibres, in closed form, in all its readings."""

from __future__ import annotations

import functools
from typing import ClassVar, NamedTuple

from ..core import autodiff, ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from ..geometry.base import check_contraction_range
from ..geometry.fibre_sum import FibreSum, HalfShellFibreSum
from ..geometry.meridian import SAGA_2007
from ..geometry.parabola import Parabola
from ..geometry.straight_fibre import StraightFibre
from .base import PressureLaw
from .rubber import AxialIntegral, RubberIntegral, RubberLine
from .solve import check_solution, find_first_root

LINE_A = RubberLine(slope=0.1263e6, intercept=0.3e6)
"""The rubber as the text prints it; its stress at strain 3 is 0.68 MPa. That it is in MPa is inferred from Fig. 4."""
LINE_B = RubberLine(slope=0.3e6, intercept=0.1263e6)
"""The rubber with slope and intercept exchanged: 1.03 MPa at strain 3, the corner of the axes of Fig. 4."""
RUBBER_TEST_STRAIN = 3.0
"""The strain at which the rubber test of Fig. 4 ends; the line is extrapolated beyond."""


_MIN_SLOPE = 1e-200
"""Stands for a zero slope in a denominator, so that straight fibres pull without bound but divide by nothing."""


class EquilibriumPoint(NamedTuple):
    """A contraction at which pressure and load balance."""

    contraction: float
    stable: bool
    """Whether it takes more pressure to contract further; where it takes less, the muscle snaps through."""


@model
class Saga2007(PressureLaw):
    """P = [t H + (M/m) tau F]/[w A_1 - (M/m) tau pi r_0^2],   tau = l/(q a): equation (19), each reading a field.

    Balance of the half shell (9) with the fibre tension that the end section (5) asks for. Per segment of fibre
    length l_0: l chord, 1/a = sqrt(24 (l_0 - l)/l^3) curvature (3), never a itself, so that nothing is lost at small
    contraction; A_1 = Int r dx, H = Int sigma (12), r_0 = d_0/2, t wall, m fibres, M sum of their sines (15).
    Letter for letter
        P = [2 m t (alpha l^2 + 6 a beta d_0) + 12 d_0 M F/q]/(d_0 [w m (l^2 + 6 a d_0) - 3 pi M d_0^2/q]).
    Readings: w = 2 as (17) prints, 1 as (16) demands; q = 1 as (7), (8), (14), (18) print, 2 the end slope of (2);
    M printed, mended or evenly spread; H along x as printed or along the arc. The default is the printed one (w = 2,
    q = 1, along x) with the mended sum. Only w = 1, q = 2, UniformFibreSum, ArcIntegral is exact mechanics; no reading keeps
    energy, so that dynamics want CircleVirtualWork. Reference: Saga et al. 2007.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007,)

    geometry: StraightFibre
    rubber: RubberLine
    wall_thickness: float = parameter("m", "t", "thickness of the wall at rest", bounds=(0.0, 0.1))
    projection_factor: float = parameter(
        "1", "w", "factor of the projected pressure", bounds=(0.5, 4.0), fitted=False, default=2.0
    )
    slope_factor: float = parameter(
        "1", "q", "divisor of the end slope l/a", bounds=(0.5, 4.0), fitted=False, default=1.0
    )
    fibres: int = 16
    fibre_sum: FibreSum = HalfShellFibreSum()
    rubber_integral: RubberIntegral = AxialIntegral()

    def check(self) -> None:
        if isinstance(self.fibres, bool) or not isinstance(self.fibres, int) or self.fibres < 4 or self.fibres % 2:
            raise ParameterError(f"Saga2007.fibres is {self.fibres!r}; it must be an even whole number, 4 or more.")
        if not isinstance(self.geometry.meridian, Parabola):
            raise ParameterError(
                "Saga2007 is closed for the parabola (2), (3); its geometry has a "
                f"{type(self.geometry.meridian).__name__}. Give StraightFibre(..., meridian=Parabola())."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From rest to just before the pole, or to 50 %, where the parabola (3) is widest."""
        return (0.0, min(self.geometry.contraction_range[1], self.pole * (1.0 - 1e-9)))

    @property
    def pole(self) -> float:
        """The contraction [1] at which this reading's pressure becomes infinite."""
        return _pole(self)

    @property
    def threshold_pressure(self) -> float:
        """The gauge pressure [Pa] at which contraction starts under any load, t beta/(w r_0); w = 1 is a thin ring."""
        thin_ring = self.wall_thickness * self.rubber.intercept / self.geometry.end_radius
        return float(thin_ring / self.projection_factor)

    @property
    def snap_through_load(self) -> float:
        """The load [N] below which pressure falls as contraction starts: the muscle then snaps, as a balloon does."""
        tube, share = self.geometry, self.fibre_sum.sum_of_sines(self.fibres) / (self.fibres * self.slope_factor)
        widening = tube.fibre_length**2 / 12 - share * ops.pi * tube.end_radius**2 / self.projection_factor
        stiffening = self.wall_thickness * self.rubber.slope * tube.fibre_length**2 / (12 * tube.end_radius)
        return float((self.wall_thickness * self.rubber.intercept / tube.end_radius * widening - stiffening) / share)

    def pressure(self, contraction: Value, force: Value) -> Value:
        self._check_contraction(contraction)
        found = self.equilibrium_pressure(contraction, force)
        return check_solution(found, self.pressure_range, (contraction, force), self._no_pressure_message)

    def force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N]; without bound at zero contraction, where the straight fibres hold any."""
        self._check_contraction(contraction)
        shell, rubber, lever = self._terms(contraction)
        return (pressure * shell - rubber) / ops.maximum(lever, _MIN_SLOPE)

    def contraction(self, pressure: Value, force: Value) -> Value:
        def excess(contraction: Value, p: Value, load: Value) -> Value:
            return self.equilibrium_pressure(contraction, load) - p

        def message(p: float, load: float, low: float, high: float) -> str:
            possible = f"Between these it needs {(low + p) / 1e3:.6g} to {(high + p) / 1e3:.6g} kPa under this load."
            return self._no_contraction_message(p, load) + possible

        started = (self.threshold_pressure, float("inf"))
        check_solution(pressure + 0.0 * force, started, (pressure, force), self._below_threshold_message)
        return find_first_root(excess, self.contraction_range, (pressure, force), message)

    def equilibrium_pressure(self, contraction: Value, force: Value) -> Value:
        """The formula itself [Pa], at any contraction below 1, whatever comes out: beyond the pole it is negative."""
        shell, rubber, lever = self._terms(contraction)
        return (rubber + lever * force) / shell

    def _terms(self, contraction: Value) -> tuple[Value, Value, Value]:
        """w A_1 - (M/m) tau pi r_0^2 [m2], t H [N], (M/m) tau [1]."""
        tube = self.geometry
        parabola = tube.meridian.segment(contraction, tube.fibre_length, tube.end_radius)
        lever = self.fibre_sum.sum_of_sines(self.fibres) / self.fibres * self.end_slope(contraction)
        shell = self.projection_factor * parabola.half_section - lever * ops.pi * tube.end_radius**2
        return shell, self.wall_thickness * self.rubber_integral.hoop_stress(self.rubber, parabola), lever

    def end_slope(self, contraction: Value) -> Value:
        """tau = l/(q a), the tangent of the fibres' angle at the end in this reading."""
        return 2.0 * ops.sqrt(6.0 * contraction / (1.0 - contraction)) / self.slope_factor

    def end_tension(self, pressure: Value, contraction: Value, force: Value) -> Value:
        """Tension of one fibre [N] by the axial balance at the end, (8)."""
        steepness = ops.sqrt(1.0 + self.end_slope(contraction) ** 2)
        return (ops.pi * self.geometry.end_radius**2 * pressure + force) * steepness / self.fibres

    def shell_tension(self, pressure: Value, contraction: Value) -> Value:
        """Tension of one fibre [N] by the radial balance of the half shell, (18); equal to (8) where F balances."""
        shell, rubber, lever = self._terms(contraction)
        pushed = pressure * (shell + lever * ops.pi * self.geometry.end_radius**2) - rubber
        steepness = ops.sqrt(1.0 + self.end_slope(contraction) ** 2)
        return pushed * steepness / (self.fibres * lever)

    def middle_strain(self, contraction: Value) -> Value:
        """Hoop strain of the rubber in the middle, (10): (l_0/(4 d_0)) sqrt(24 eps (1 - eps)) [1]."""
        tube = self.geometry
        return tube.fibre_length / (4 * tube.end_diameter) * ops.sqrt(24 * contraction * (1 - contraction))

    def contraction_at_strain(self, strain: float) -> float:
        """The contraction [1] at which the rubber in the middle is strained so far; 0.5 if it never is."""
        tube = self.geometry
        product = (4 * tube.end_diameter * strain / tube.fibre_length) ** 2 / 24
        return float(0.5 - ops.sqrt(max(0.25 - product, 0.0)))

    def validity_warnings(self, pressure: float, contraction: float) -> tuple[str, ...]:
        """What one should know of the model at this point: rubber extrapolated, unstable, past the largest volume."""
        found = []
        if (strain := float(self.middle_strain(contraction))) > RUBBER_TEST_STRAIN:
            end = self.contraction_at_strain(RUBBER_TEST_STRAIN)
            found.append(
                f"the rubber is strained to {strain:.2f}; its test ended at 3, reached at {end:.1%} contraction"
            )
        if contraction > 0 and float(self.slopes(pressure, contraction).by_contraction) > 0:
            found.append("the muscle is unstable here: it takes less pressure to contract further; it snaps through")
        if contraction > 0 and float(self.geometry.volume_derivative(contraction)) < 0:
            found.append("the volume falls with contraction here, and still the balance pulls: no energy is kept")
        return tuple(found)

    def equilibria(self, pressure: float, force: float) -> tuple[EquilibriumPoint, ...]:
        """Every contraction from 0 to 1 that balances a gauge pressure [Pa] and a load [N], smallest first.

        With the rubber along x they are roots of one quintic, so that no search can miss one. Past
        `contraction_range` they are the formula's, not a muscle's.
        """
        if not isinstance(self.rubber_integral, AxialIntegral):
            raise ParameterError(
                "Saga2007: the equilibria are roots of a polynomial only with the rubber along the axis; "
                "give rubber_integral=AxialIntegral(), or ask for `contraction`."
            )
        roots = sorted({c for c in _quintic_roots(self, pressure, force) if 0.0 <= c < 1.0})
        return tuple(EquilibriumPoint(c, self._is_stable(c, force)) for c in roots)

    def _is_stable(self, contraction: float, force: float) -> bool:
        at = max(contraction, 1e-12)  # the slope is infinite at zero
        return bool(autodiff.derivative(self, "equilibrium_pressure", at, force) > 0)

    def _check_contraction(self, contraction: Value) -> None:
        if not ops.is_symbol(self.wall_thickness):
            why = f"; the pole of this reading is at {self.pole:.2%}" if self.pole < 0.5 else ""
            check_contraction_range(contraction, self.contraction_range, "Saga2007", why)

    def _below_threshold_message(self, pressure: float, force: float) -> str:
        text = (
            f"Saga2007: at {pressure / 1e3:.6g} kPa the tube is still straight; contraction starts at "
            f"{self.threshold_pressure / 1e3:.6g} kPa."
        )
        return text + " Equilibria that are not reached from rest are listed by `equilibria(pressure, force)`."


@functools.lru_cache(maxsize=256)
def _pole(law: Saga2007) -> float:
    """Where w A_1 = (M/m) tau pi r_0^2. Their difference per chord rises, then falls to minus infinity: one root."""
    low, high = 0.0, 1.0
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (middle, high) if law._terms(middle)[0] > 0 else (low, middle)
    return low


def _quintic_roots(law: Saga2007, pressure: float, force: float) -> list[float]:
    """The contractions at which a B = A_2 l^2 + A_0 with (3) squared: 24 (l_0 - l)(A_2 l^2 + A_0)^2 = B^2 l^3."""
    import numpy as np  # noqa: TID251  (roots of a polynomial are never traced)

    tube, m, w, q = law.geometry, law.fibres, law.projection_factor, law.slope_factor
    d, t, m_sum = tube.end_diameter, law.wall_thickness, law.fibre_sum.sum_of_sines(law.fibres)
    a2 = m * (w * pressure * d - 2 * t * law.rubber.slope) * tube.fibre_length**2
    a0 = -3 * ops.pi * m_sum * d**3 / q * pressure - 12 * d * m_sum * force / q
    b = 6 * m * d * (2 * t * law.rubber.intercept - w * pressure * d) * tube.fibre_length
    # in x = l/l_0; both sides by powers of x, the highest first
    square = np.array([a2 * a2, 0.0, 2 * a2 * a0, 0.0, a0 * a0])
    quintic = np.polysub(24 * np.polymul([-1.0, 1.0], square), [b * b, 0.0, 0.0, 0.0])
    found = np.roots(quintic)
    real = found.real[(abs(found.imag) < 1e-7) & (found.real > 0) & (found.real <= 1)]
    sided = [1.0 - x for x in real if b * (a2 * x * x + a0) >= 0]
    return [_refine_root(law, float(c), pressure, force) for c in sided]


def _refine_root(law: Saga2007, contraction: float, pressure: float, force: float) -> float:
    """The root after two Newton steps on the law itself, where they help."""
    for _ in range(2):
        if not 0.0 < contraction < 1.0:
            break
        miss = law.equilibrium_pressure(contraction, force) - pressure
        better = contraction - miss / autodiff.derivative(law, "equilibrium_pressure", contraction, force)
        if not 0.0 < better < 1.0 or abs(law.equilibrium_pressure(better, force) - pressure) >= abs(miss):
            break
        contraction = float(better)
    return contraction
