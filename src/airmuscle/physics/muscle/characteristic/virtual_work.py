"""Laws of virtual work: force from the volume of a geometry, also with the rubber of a circular
meridian.
"""

import functools
from typing import ClassVar

from ....core import ParameterError, Reference, TraceError, Value, model, ops, parameter
from ....core.declaration import forwarded
from ..geometry.base import Geometry, check_contraction_range, check_not_straight
from ..geometry.braid import CHOU_HANNAFORD_1996
from ..geometry.meridian import FERRARESI_2001, SAGA_2007, CircularArc
from ..geometry.straight_fibre import FibreTube, StraightFibre
from .base import AreaLaw, ForceLaw
from .calls import Slopes
from .modes import is_formula_alone
from .rubber import RubberLaw, RubberLine
from .solve import check_solution, find_first_root


@model
class VirtualWork(AreaLaw):
    """Virtual work: F = -p dV/dL = p (dV/deps)/L_0.

    p: gauge pressure; V: enclosed volume; L = L_0 (1 - eps): length. The work p dV of the air is
    transferred to the load without loss, so that the Maxwell defect dF/dp + dV/dL is zero
    everywhere. Above the contraction of maximum volume the force is negative; limit it with
    `Clamped` if required. Reference: Chou and Hannaford (1996), derivation of the force.
    """

    references: ClassVar[tuple[Reference, ...]] = (CHOU_HANNAFORD_1996,)

    geometry: Geometry

    contraction_range = forwarded("geometry.contraction_range")

    @property
    def begins_at_straight_fibres(self) -> bool:
        """True for fibre tubes, whose volume increases infinitely fast at zero contraction."""
        return isinstance(self.geometry, FibreTube)

    def effective_area(self, contraction: Value) -> Value:
        return self.geometry.volume_derivative(contraction) / self.geometry.resting_length

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        if not type(self.geometry).traceable:
            raise TraceError(
                f"VirtualWork: {type(self.geometry).__name__} is not in closed form, so that its"
                " second derivative is not available. Replace it by"
                " airmuscle.geometry.as_polynomial(geometry)."
            )
        return super().slopes(pressure, contraction)


_MIN_ANGLE = 1e-200
"""Lower bound of the angle in a denominator, which avoids a division by zero for straight
fibres.
"""


@model
class CircleVirtualWork(RubberLaw, ForceLaw):
    """Straight-fibre muscle with a circular meridian, by virtual work.

        F = (p dV/deps - dU/deps)/l_0,   U = 2 pi t [alpha Q/(2 r_0) + beta G],   sin(psi)/psi = 1 -
                                         eps

    Per segment of fibre length l_0 and end radius r_0: V volume, G = Int (r - r_0) ds, Q = Int (r -
    r_0)^2 ds of the circular arc with half angle psi, all in closed form. Volume and force follow
    from one potential, so that a simulation conserves energy. Compared with the exact meridian, the
    pressure differs by less than 0.7 % from 100 N up to 30 % contraction, and by -1 % to 6.3 %
    without load. The meridian is from Ferraresi et al. 2001, the rubber from Saga et al. 2007; the
    force balance is from neither.
    """

    references: ClassVar[tuple[Reference, ...]] = (FERRARESI_2001, SAGA_2007)
    refuses_beyond: ClassVar[bool] = True

    geometry: StraightFibre
    rubber: RubberLine
    wall_thickness: float = parameter("m", "t", "thickness of the wall at rest", bounds=(0.0, 0.1))

    def check(self) -> None:
        if not isinstance(self.geometry.meridian, CircularArc):
            raise ParameterError(
                "CircleVirtualWork requires a circular meridian; its geometry has a"
                f" {type(self.geometry.meridian).__name__}. Use StraightFibre(...,"
                " meridian=CircularArc())."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From zero to the maximum volume, where the pressure required for a load becomes
        infinite.
        """
        return (0.0, _contraction_of_max_volume(self.geometry) * (1.0 - 1e-9))

    begins_at_straight_fibres = True

    @property
    def formula_range(self) -> tuple[Value, Value]:
        """That of the geometry."""
        return self.geometry.contraction_range

    def force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N]; negative beyond the maximum volume. Raises GeometryLimitError at zero
        contraction, where straight fibres pull infinitely.
        """
        self._check_contraction(contraction, self.geometry.contraction_range)
        if not is_formula_alone():  # a search goes there
            check_not_straight(contraction, "CircleVirtualWork")
        area, rubber, angle = self._work_terms(contraction)
        return (pressure * area - rubber) / ops.maximum(angle, _MIN_ANGLE)

    def pressure(self, contraction: Value, force: Value) -> Value:
        self._check_contraction(contraction, self.contraction_range)
        solution = self._pressure(contraction, force)
        return check_solution(
            solution, self.pressure_range, (contraction, force), self._no_pressure_message
        )

    def contraction(self, pressure: Value, force: Value) -> Value:
        def residual(contraction: Value, p: Value, load: Value) -> Value:
            return self._pressure(contraction, load) - p

        def message(p: float, load: float, low: float, high: float) -> str:
            required = f"Required pressure at this load: {(low + p) / 1e3:.4g} kPa or more."
            return self._no_contraction_message(p, load) + required

        self.check_threshold(pressure, force)
        return find_first_root(residual, self.contraction_range, (pressure, force), message)

    def _pressure(self, contraction: Value, force: Value) -> Value:
        """Equilibrium pressure [Pa], without a check of its range."""
        area, rubber, angle = self._work_terms(contraction)
        return (force * angle + rubber) / area

    def _work_terms(self, contraction: Value) -> tuple[Value, Value, Value]:
        """psi (dV/deps)/l_0 [m2], psi (dU/deps)/l_0 [N] and psi [rad], which are finite at zero
        contraction.
        """
        tube = self.geometry
        arc = CircularArc()
        angle_squared = arc.angle_squared(contraction)
        derivatives = arc.derivatives_times_angle(angle_squared, tube.fibre_length, tube.end_radius)
        energy = self.rubber.energy(
            derivatives.arc_excess, derivatives.arc_excess_squared, tube.end_radius
        )
        rubber = self.wall_thickness * energy / tube.fibre_length
        return derivatives.volume / tube.fibre_length, rubber, ops.sqrt(angle_squared)

    def _check_contraction(self, contraction: Value, limits: tuple[float, float]) -> None:
        """Raise GeometryLimitError if a contraction is outside `limits`, unless the model is being
        traced.
        """
        if not ops.is_symbol(self.wall_thickness):
            check_contraction_range(contraction, limits, "CircleVirtualWork")


@functools.lru_cache(maxsize=256)
def _contraction_of_max_volume(tube: StraightFibre) -> float:
    """Contraction of maximum volume, by bisection of dV/deps, or the upper limit of the
    geometry.
    """
    low, high = tube.contraction_range
    while (middle := (low + high) / 2) not in (low, high):
        arc = CircularArc()
        derivatives = arc.derivatives_times_angle(
            arc.angle_squared(middle), tube.fibre_length, tube.end_radius
        )
        low, high = (middle, high) if derivatives.volume > 0 else (low, middle)
    return high
