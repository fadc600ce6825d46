"""Pulley profile: moment arm of a muscle as a function of the joint angle."""

import abc

from ...core import ParameterError, Value, model, ops, parameter

SAMPLES = 101
"""Number of angles at which a profile is checked (chosen)."""


class PulleyProfile(abc.ABC):
    """Shape of a pulley (interface): moment arm r(theta) = r f(theta) with f(0) = 1.

    The muscle on it shortens by r F(theta), where F is the integral of f from 0, so that moment arm and length of the
    muscle belong together. r is the radius at angle 0, a parameter of the mechanism.
    """

    @abc.abstractmethod
    def ratio(self, angle: Value) -> Value:
        """Moment arm divided by that at angle 0, f [1], at an angle [rad]."""

    @abc.abstractmethod
    def integral(self, angle: Value) -> Value:
        """Integral F [rad] of the ratio from 0 to an angle [rad]."""


@model
class ConstantRadius(PulleyProfile):
    """Circular pulley about the joint axis: f = 1, F = theta."""

    def ratio(self, angle: Value) -> Value:
        return 1.0

    def integral(self, angle: Value) -> Value:
        return angle


@model
class PolynomialProfile(PulleyProfile):
    """Shaped pulley: f = 1 + c_1 theta + c_2 theta^2 + ..., F = theta + c_1 theta^2/2 + c_2 theta^3/3 + ..."""

    coefficients: tuple[float, ...] = parameter(
        "1", "c_k", "coefficient of the k-th power of the angle in radians", bounds=(-100.0, 100.0)
    )

    def check(self) -> None:
        if not self.coefficients:
            raise ParameterError(
                "PolynomialProfile: coefficients is empty; give at least one, or use ConstantRadius for a circular "
                "pulley."
            )

    def ratio(self, angle: Value) -> Value:
        total: Value = 0.0
        for coefficient in reversed(self.coefficients):
            total = angle * (coefficient + total)
        return 1.0 + total

    def integral(self, angle: Value) -> Value:
        total: Value = 0.0
        for k, coefficient in reversed(list(enumerate(self.coefficients, start=2))):
            total = angle * (coefficient / k + total)
        return angle * (1.0 + total)


@model
class CrankProfile(PulleyProfile):
    """Crank with a muscle that stays parallel to itself: f = cos(theta - theta_m)/cos theta_m.

    theta_m angle of the maximum moment arm. F = (sin(theta - theta_m) + sin theta_m)/cos theta_m.
    """

    maximum_angle: float = parameter(
        "rad", "theta_m", "angle of the maximum moment arm", bounds=(-1.5, 1.5), default=0.0
    )

    def ratio(self, angle: Value) -> Value:
        return ops.cos(angle - self.maximum_angle) / ops.cos(self.maximum_angle)

    def integral(self, angle: Value) -> Value:
        top = self.maximum_angle
        return (ops.sin(angle - top) + ops.sin(top)) / ops.cos(top)


def check_profile(owner: str, profile: PulleyProfile, low: float, high: float) -> None:
    """Raise ParameterError if a profile is not positive in the range of angles [rad] from `low` to `high`."""
    step = (high - low) / (SAMPLES - 1)
    for k in range(SAMPLES):
        angle = low + k * step
        ratio = profile.ratio(angle)
        if not ratio > 0.0:
            raise ParameterError(
                f"{owner}: the moment arm of its profile is {ratio:.3g} times that at angle 0 at {angle:.4g} rad; "
                f"allowed range: greater than 0 from {low:.4g} to {high:.4g} rad. Choose another profile, or a smaller "
                "range of angles."
            )
