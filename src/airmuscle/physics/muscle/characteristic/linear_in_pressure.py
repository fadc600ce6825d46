"""Reduced force law: linear in pressure, polynomials of the contraction, for muscles of unknown
size.
"""

from ....core import ParameterError, Value, model, ops, parameter
from .base import ForceLaw
from .validity_range import CONTRACTION_BOUNDS


@model
class LinearInPressure(ForceLaw):
    """F = S(p a(x) + d(x)),   S(y) = (y + sqrt(y^2 + s^2))/2,   x = eps - eps_r.

    a(x) = a_0 + a_1 x + ... effective area, d(x) = d_0 + d_1 x + ... force of bladder and braid
    without pressure, which also contains the zero of the pressure sensor; S lets the tension go to
    zero smoothly, over the width s, where the muscle is slack. Every law that is affine in the
    pressure has this form at each contraction (virtual work, Martens and Boblan); the polynomials
    are chosen. With the moment arm of a joint absorbed in a and d, it is identified from pressures
    and angles alone.
    """

    area: tuple[float, ...] = parameter(
        "m2", "a_i", "coefficients of the effective area", bounds=(-1e6, 1e6)
    )
    passive_force: tuple[float, ...] = parameter(
        "N", "d_i", "coefficients of the force without pressure", bounds=(-1e9, 1e9), default=(0.0,)
    )
    slack_width: float = parameter(
        "N", "s", "tension over which the muscle becomes slack", bounds=(1e-9, 1e6), default=1.0
    )
    reference: float = parameter(
        "1",
        "eps_r",
        "contraction about which the polynomials are written",
        bounds=(-0.5, 0.9),
        fitted=False,
        default=0.0,
    )

    def check(self) -> None:
        if not self.area or not self.passive_force:
            raise ParameterError(
                "LinearInPressure: area and passive_force need at least one coefficient each."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        """All contractions: the law has no length, and its polynomials are those of its fit."""
        return CONTRACTION_BOUNDS

    def force(self, pressure: Value, contraction: Value) -> Value:
        x = contraction - self.reference
        net = pressure * ops.polynomial(self.area, x) + ops.polynomial(self.passive_force, x)
        return 0.5 * (net + ops.sqrt(net**2 + self.slack_width**2))
