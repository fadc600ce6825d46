"""Martens and Boblan 2017: Festo DMSP muscles, braid with axial and circumferential wall
stiffness.
"""

from typing import ClassVar, Self

from ....core import Reference, Value, model, ops, parameter, published
from ..geometry.braid import Braid
from .base import ForceLaw
from .data_scales import DataScales, MeasuredPoints

_MAX_CONTRACTION = 0.4
"""Upper limit of the contractions for which the modulus E(L) was identified."""


@model
class MartensBoblan2017(ForceLaw):
    """Braided muscle with a rubber wall of modulus E(L): F = max(0, -p dV/dL + F_pe dD/dL - F_l).

        L_f = L_0/cos(theta),   n = L_0 tan(theta)/(pi D_0),   D = sqrt(L_f^2 - L^2)/(n pi)
        dV/dL = (L_f^2 - 3 L^2)/(4 pi n^2),   dD/dL = -L/(n pi sqrt(L_f^2 - L^2))
        E = c_0 + c_1 L + c_2 L^2 + c_3 L^3
        F_l = E (L - L_0)/L_0 H_0 pi D,   F_pe = E (D - D_0)/D_0 H_0 L pi

    p: gauge pressure; L: length; D: diameter; L_f, n: length and number of turns of a thread; H_0:
    wall thickness; F_l, F_pe: axial and circumferential force of the wall. The braid angle is theta
    = 28.6 deg + d_theta with the printed d_theta in radians. Above a contraction of 40 %, the limit
    of E(L), the force is that at 40 %: the formula would give a force that increases with
    contraction. Reference: Martens and Boblan (2017).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("martens-boblan-2017"),)
    redundant: ClassVar[tuple[str, ...]] = ("wall_thickness",)  # it only multiplies the modulus

    geometry: Braid
    wall_thickness: float = parameter(
        "m",
        "H_0",
        "wall thickness at rest; only its product with E has an effect",
        bounds=(1e-4, 1e-2),
        fitted=False,
    )
    c0: float = parameter("Pa", "c_0", "modulus of the wall, constant term")
    c1: float = parameter("Pa/m", "c_1", "modulus of the wall, linear term")
    c2: float = parameter("Pa/m^2", "c_2", "modulus of the wall, quadratic term")
    c3: float = parameter("Pa/m^3", "c_3", "modulus of the wall, cubic term")

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        braid = DataScales.of(data).braid
        length = braid.resting_length
        # The modulus of a DMSP-10 in terms of L/L_0
        return cls(
            braid, 1.8e-3, 74.085e6, -172.3e6 / length, 114.8e6 / length**2, -13.26e6 / length**3
        )

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From -5 %, or half the contraction of straight threads if greater, to 40 %, the validity
        range of E(L).
        """
        straight, _ = self.geometry.contraction_range
        return (ops.maximum(-0.05, straight / 2), _MAX_CONTRACTION)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.maximum(self.unclamped_force(pressure, contraction), 0.0)

    def modulus(self, length: Value) -> Value:
        """Modulus E [Pa] of the wall at a length [m] between the fittings."""
        return self.c0 + length * (self.c1 + length * (self.c2 + length * self.c3))

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        rest = self.geometry.resting_length
        angle = self.geometry.braid_angle
        length = rest * (1.0 - ops.minimum(contraction, _MAX_CONTRACTION))
        turns = rest * ops.tan(angle) / (ops.pi * 2 * self.geometry.radius)
        thread = rest / ops.cos(angle)
        across = ops.sqrt(thread**2 - length**2)
        diameter = across / (turns * ops.pi)
        volume_by_length = (thread**2 - 3 * length**2) / (4 * ops.pi * turns**2)
        diameter_by_length = -length / (turns * ops.pi * across)
        stress = self.modulus(length) * self.wall_thickness * ops.pi
        along = stress * (length - rest) / rest * diameter
        around = stress * (diameter / (2 * self.geometry.radius) - 1.0) * length
        # Mechanically the axial force should be added: a wall shorter than at rest pushes. The
        # paper subtracts it and fitted c_0..c_3 accordingly; with a plus sign the maximum errors on
        # its maps are 15 % and 10 % instead of
        # 2.4 % and 7.4 %.
        return -pressure * volume_by_length + around * diameter_by_length - along
