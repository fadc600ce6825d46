"""Pulley: a mass on a rope over a stepped pulley."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.constants import STANDARD_GRAVITY
from ...core.declaration import model, parameter
from ...core.ops import Value
from .translation import Translation


@model
class Pulley(Translation):
    """Stepped pulley: (J/r^2 + i^2 m) y'' = F - i m g - d y', with y from the position at the muscle's resting length.

    r radius of the drum on the muscle side, i r radius of the drum on the load side, so that the mass m is lifted by
    i y; J inertia of the pulley, d viscous friction of the bearing, referred to the muscle. i = 1 only redirects the
    rope; i = 1/2 also describes a block and tackle with half the load. All muscles act on the same point in parallel.
    """

    radius: float = parameter("m", "r", "radius of the drum on the muscle side", bounds=(1e-4, 10.0))
    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    ratio: float = parameter("1", "i", "load displacement per muscle displacement", bounds=(1e-3, 1e3), default=1.0)
    inertia: float = parameter("kg m^2", "J", "moment of inertia of the pulley", bounds=(0.0, 1e4), default=0.0)
    damping: float = parameter("N s/m", "d", "viscous friction of the bearing", bounds=(0.0, 1e6), default=0.0)
    gravity: float = parameter(
        "m/s^2", "g", "acceleration of gravity", bounds=(0.0, 20.0), fitted=False, default=STANDARD_GRAVITY
    )

    def _inertial_mass(self) -> Value:
        return self.inertia / self.radius**2 + self.ratio**2 * self.mass

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        resistance = self.ratio * self.mass * self.gravity + self.damping * v["speed"]
        return {"position": (forces["position"] - resistance) / self._inertial_mass()}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.mass * self.gravity * self.ratio * q["position"]

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return 0.5 * self._inertial_mass() * v["speed"] ** 2
